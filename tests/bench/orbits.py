r"""Periodic response of one oscillator over a one-sided elastic stop: this library, mousai, and the closed answer.

.. math:: \ddot q + 2ζ \dot q + q = f \cos Ωt + k \max(-q - \text{gap}, 0)

``python tests/bench/orbits.py`` follows the response once through its resonance with `solvers.branch`, solves for the
same Ω by harmonic balance (mousai's ``hb_time``, each point started from the one before), and prints for both: points
per second, and the largest error of q(t) over all times and frequencies, relative to the largest |q|. The closed answer
is `tests/oscillators.py`: matrix exponentials per piece. A branch gives monodromy matrices too.
mousai is of the extra ``bench``; without it only this library is shown.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oscillators import Bilinear

import solvers
from solvers.orbits import delayed

PROBLEM = Bilinear(omega=0.8, stiffness=4.0, zeta=0.1, gap=0.2)
SPAN, STEP = (0.8, 2.0), 0.1
TOLERANCES = 1e-6, 1e-8, 1e-11
HARMONICS = 5, 10, 20
REPEATS = 3

Motions = list[tuple[float, np.ndarray, np.ndarray]]  # Ω, times, q there


def make(omega: float) -> tuple[solvers.System, float]:
    """The family that is followed."""
    problem = replace(PROBLEM, omega=omega)
    return problem.system(), problem.period


def timed(solve: Callable[[], object]) -> float:
    """Shortest wall time of a few runs after a first one, s."""
    times = []
    for _ in range(1 + REPEATS):
        started = time.perf_counter()
        solve()
        times.append(time.perf_counter() - started)
    return min(times[1:])


def ours(rtol: float) -> tuple[solvers.Branch, float]:
    """The branch and its wall time."""

    def solve() -> solvers.Branch:
        start = PROBLEM.steady(False, 0.0)
        return solvers.branch(make, SPAN, start, step=STEP, method=solvers.Exponential(rtol)).run()

    return solve(), timed(solve)


def motions(branch: solvers.Branch) -> Motions:
    """q(t) of every orbit at 64 times, counted from the drive's phase zero."""
    found = []
    for orbit in branch.orbits:
        run = orbit.samples(64)
        found.append((orbit.parameter, orbit.phase + run.t, run.q[:, 0]))
    return found


def balanced(omegas: list[float], harmonics: int) -> Motions:
    """The same frequencies by mousai, without stability."""
    import mousai

    def acceleration(q: np.ndarray, v: np.ndarray, now: dict) -> np.ndarray:
        push = PROBLEM.stiffness * np.maximum(-q - PROBLEM.gap, 0.0)
        drive = PROBLEM.amplitude * np.cos(now["omega"] * now["cur_time"])
        return (drive + push - q - 2.0 * PROBLEM.zeta * v)[:, None]

    found, x = [], PROBLEM.linear_amplitude() * np.cos(2.0 * np.pi * np.arange(2 * harmonics + 1) / (2 * harmonics + 1))
    x = x[None, :]
    for omega in omegas:
        t, x, *_ = mousai.hb_time(
            acceleration, x, omega, num_harmonics=harmonics, params={}, f_tol=1e-9, method="newton_krylov"
        )
        found.append((omega, t, x[0].copy()))
    return found


def error(found: Motions) -> float:
    """Largest distance from the closed answer, relative to the largest |q|."""
    worst, largest, x = 0.0, 0.0, PROBLEM.orbit(PROBLEM.settled(50))[0]
    for omega, times, q in sorted(found, key=lambda motion: motion[0]):
        problem = replace(PROBLEM, omega=omega)
        x = problem.orbit(x)[0]
        exact = np.array([problem.march(x, t)[0][0] if t > 0.0 else x[0] for t in times % problem.period])
        worst, largest = max(worst, np.abs(q - exact).max()), max(largest, np.abs(exact).max())
    return worst / largest


def residual(branch: solvers.Branch) -> float:
    """Largest |Φ(x) - x|/|x| of a branch, run anew with DOP853."""
    worst = 0.0
    for orbit in branch.orbits:
        x, method = orbit.state, solvers.DormandPrince(rtol=1e-13, atol=1e-16)
        run = solvers.integrate(delayed(orbit.system, orbit.phase), x[:1], x[1:], orbit.period, method=method)
        end = np.concatenate((run.q[-1], run.q_dot[-1]))
        worst = max(worst, float(np.linalg.norm(end - x) / np.linalg.norm(x)))
    return worst


def main() -> None:
    """Print one line per setting."""
    print(f"{PROBLEM}, Ω from {SPAN[0]} to {SPAN[1]} rad/s, step {STEP}")
    for rtol in TOLERANCES:
        branch, seconds = ours(rtol)
        count = len(branch.orbits)
        print(
            f"solvers.branch, rtol {rtol:.0e}: {count} orbits with stability, {count / seconds:8.1f} points/s, "
            f"error {error(motions(branch)):.1e}, residual {residual(branch):.1e}"
        )
    if find_spec("mousai") is None:
        print("mousai is not installed: pip install mousai")
        return
    omegas = sorted(orbit.parameter for orbit in branch.orbits)
    for harmonics in HARMONICS:
        started = time.perf_counter()
        found = balanced(omegas, harmonics)
        seconds = time.perf_counter() - started
        print(
            f"mousai.hb_time, {harmonics} harmonics, newton_krylov, f_tol 1e-9: {len(found)} points, "
            f"{len(found) / seconds:8.1f} points/s, error {error(found):.1e}"
        )


if __name__ == "__main__":
    main()
