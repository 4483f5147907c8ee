"""How often `solvers.orbit` finds an orbit from rest, of random systems of one to five modes with one or two stops.

    python tests/bench/orbits_from_rest.py [count] [first seed] [gyroscopic]

The drive reaches the stops. Prints those without an orbit, which orbits were found only with more damping, and whether
every orbit found comes back in an independent integration over its period.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from differences import end_of
from oscillators import Tone

from contacts import Hertz, Hysteretic, PiecewiseLinear
from solvers import Contact, DormandPrince, Orbit, OrbitError, System, orbit
from solvers.orbits import delayed, shooting


def drawn(seed: int, gyroscopic: bool) -> tuple[System, float]:
    """A system, and the period of its drive."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    natural, zeta = np.sort(rng.uniform(50.0, 1500.0, n)), 10.0 ** rng.uniform(-2.3, -1.0, n)
    omega, load, skew = 2.0 * math.pi * 10.0 ** rng.uniform(1.0, 2.3), rng.normal(size=n), np.zeros((n, n))
    if gyroscopic:
        skew = rng.normal(size=(n, n))
        skew = 0.3 * natural.mean() * (skew - skew.T)
    dynamic = np.diag(natural**2 - omega**2 + 2j * zeta * natural * omega) + 1j * omega * skew
    stops = [_stop(rng, np.linalg.solve(dynamic, load), omega) for _ in range(rng.integers(1, 3))]
    system = System(
        np.eye(n), np.diag(2.0 * zeta * natural), np.diag(natural**2), stops, [(load, Tone(1.0, omega))], skew
    )
    return system, 2.0 * math.pi / omega


def _stop(rng: np.random.Generator, response: np.ndarray, omega: float) -> Contact:
    """One that the steady motion reaches."""
    way = rng.normal(size=response.size)
    amplitude = abs(way @ response)
    stiffness = 10.0 ** rng.uniform(0.0, 4.0) * omega**2 / (way @ way)
    laws = PiecewiseLinear([stiffness]), Hertz(stiffness / amplitude**0.5), Hysteretic(stiffness / amplitude**0.5, 0.6)
    return Contact(way, laws[rng.integers(3)], amplitude * rng.uniform(0.0, 1.0))


def missed(found: Orbit) -> float:
    """How far an independent run over the period ends from its start, of the orbit's size and its growth."""
    end = end_of(delayed(found.system, found.phase), found.period, DormandPrince(rtol=1e-12, atol=1e-18))(found.state)
    scale = np.repeat((1.0 / found.period, 1.0), found.system.size)
    growth = max(1.0, float(np.abs(found.monodromy).max()))
    return float(np.linalg.norm(scale * (end - found.state)) / np.linalg.norm(scale * found.state) / growth)


def main(count: int = 300, first: int = 0, gyroscopic: bool = False) -> None:
    """Print what was found."""
    damped, worst, none, plain = list[int](), 0.0, 0, shooting.orbit_by_damping
    for seed in range(first, first + count):
        shooting.orbit_by_damping = lambda *a, seed=seed: damped.append(seed) or plain(*a)
        started = time.perf_counter()
        try:
            error = missed(orbit(*drawn(seed, gyroscopic)))
        except OrbitError as refused:
            none += 1
            print(f"{seed}: none after {time.perf_counter() - started:.0f} s, {str(refused)[-120:]}", flush=True)
            continue
        worst = max(worst, error)
        if error > 1e-8:
            print(f"{seed}: does not come back, by {error:.1e}", flush=True)
    print(f"{count} systems: none found in {none}, with more damping in {len(damped) - none}: {damped}")
    print(f"an independent run comes back to {worst:.1e}")


if __name__ == "__main__":
    numbers = [int(argument) for argument in sys.argv[1:3]]
    main(*(numbers + [300, 0][len(numbers) :]), "gyroscopic" in sys.argv)
