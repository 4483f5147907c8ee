"""Short contacts at one stop while another lasts: how many are found, by depth and tolerance.

    python tests/bench/second_contacts.py [count]

A fast oscillator touches its stop near its amplitude again and again, while a slow one lies on its own.
"""

from __future__ import annotations

import sys

import numpy as np

import fembeam as fb
from contacts import PiecewiseLinear
from solvers import Contact, DormandPrince, Exponential, System, integrate


def contacts_found(seed: int, depth: float, method: object) -> int:
    """Contacts of the fast oscillator of a random pair, at most ``depth`` of its amplitude deep."""
    rng = np.random.default_rng(seed)
    slow, fast = 3.0, 3.0 * 10.0 ** rng.uniform(1.5, 3.0)
    contacts = [
        Contact([1.0, 0.0], PiecewiseLinear([50.0]), -1.0),
        Contact([0.0, 1.0], PiecewiseLinear([2.0 * fast**2]), 1.0 - depth),
    ]
    system = System.modal([slow, fast], [0.01, 0.0], contacts, [([1.0, 0.0], fb.Harmonic(1.0, 1.0))])
    start, duration = rng.uniform(0.0, 0.2), 40.3 * 2.0 * np.pi / fast
    log = integrate(system, [start, 0.0], [0.0, fast], duration, method=method).contacts
    return int((log.stop == 1).sum())


def main(count: int = 200) -> None:
    """Print a table."""
    for depth in (1e-1, 1e-2, 1e-3, 1e-4):
        true = [contacts_found(seed, depth, DormandPrince(1e-10)) for seed in range(count)]
        for rtol in (1e-3, 1e-6):
            found = [contacts_found(seed, depth, Exponential(rtol)) for seed in range(count)]
            missed = sum(max(a - b, 0) for a, b in zip(true, found, strict=True))
            print(f"depth {depth:g}, rtol {rtol:g}: {missed} of {sum(true)} missed", flush=True)


if __name__ == "__main__":
    main(*(int(x) for x in sys.argv[1:]))
