"""Flights in a circular clearance: is the first contact ever missed?

Undamped and damped modes of two planes fly inside a circle that is a share 1e-9 to 0.3 smaller
than the farthest they would go. The exact motion is sampled: the run must have entered by the first sample outside.

    python tests/bench/circle_flights.py [flights, 10000]
"""

import sys

import numpy as np

from contacts import KelvinVoigt
from solvers import Contact, System, integrate

DURATION, SAMPLES, BATCH = 3.0, 6001, 100
LAW = KelvinVoigt(1e3, 0.0)
TIMES = np.linspace(0.0, DURATION, SAMPLES)


def system_of(random, modes):
    """Modes in two planes, and the rows of a place."""
    omega, zeta = np.sort(random.uniform(1.0, 10.0 * modes, (2, modes)), axis=1).ravel(), 0.01 * random.integers(2)
    rows = np.zeros((2, 2 * modes))
    shapes = random.standard_normal((2, modes)) / np.arange(1, modes + 1)
    rows[0, :modes], rows[1, modes:] = shapes
    return System.modal(omega, zeta, [Contact(rows, LAW, 1.0, map="annulus")]), omega, zeta, rows


def motion_of(omega, zeta, rows, q, v):
    """(samples, 2) the place in free flight."""
    damped, decay = omega * np.sqrt(1.0 - zeta**2), np.exp(-zeta * np.outer(TIMES, omega))
    turned = np.outer(TIMES, damped)
    return decay * (q * np.cos(turned) + (v + zeta * omega * q) / damped * np.sin(turned)) @ rows.T


def missed(flights, seed=1):
    """(flights that were tried, those that entered after the first sample outside)."""
    random, tried, late = np.random.default_rng(seed), 0, 0
    while tried < flights:
        modes = int(random.integers(1, 8))
        system, omega, zeta, rows = system_of(random, modes)
        for _ in range(min(BATCH, flights - tried)):
            q, v = random.standard_normal((2, 2 * modes))
            distance = np.linalg.norm(motion_of(omega, zeta, rows, q, omega * v), axis=1)
            radius = distance.max() * (1.0 - 10.0 ** random.uniform(-9.0, -0.5))
            if distance[0] >= radius:
                continue
            first = TIMES[np.argmax(distance > radius)]
            one = system.like(contacts=[Contact(rows, LAW, radius, map="annulus")])
            entries = integrate(one, q, omega * v, min(first + 1e-9, DURATION)).contacts.t_in
            tried, late = tried + 1, late + (len(entries) == 0)
    return tried, late


if __name__ == "__main__":
    print("{} flights, {} contacts missed".format(*missed(int(sys.argv[1]) if len(sys.argv) > 1 else 10000)))
