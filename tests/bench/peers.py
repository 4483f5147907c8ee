r"""Other people's integrators on the benchmark's problem, all with one signature.

``peer(problem, setting)`` prepares (compiles, warms up) and returns ``run(start) -> (tip, calls or None)``: the tip's
displacement φᵀq at the end of a run from start = [q, q̇], and the force evaluations. Only ``run`` is timed. All solve

.. math:: \dot q = v,\quad \dot v_i = -c_i v_i - k_i q_i + Γ_i A Ω^2 \cos Ωt + φ_i F,\quad δ = -φ^T q

with F = 0 in flight and F = K δ^{3/2} (1 + a δ̇/δ̇⁻) in contact, and stop at entry (δ = 0 upward) and exit (δ = 0
downward) by their own event location. The entry rate δ̇⁻ is latched, not below the law's floor.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from reference import DURATION, FACTOR, LOAD, OMEGA, RATE_FLOOR, STIFFNESS, Problem, Vector
from taylor import heyoka

import solvers

__all__ = ["constant_step", "cvode", "dormand_prince", "exponential", "henon", "heyoka", "regularised", "scipy_ivp"]

Run = Callable[[Vector], tuple[Any, "int | None"]]
Setting = dict[str, Any]


# --- this library's methods ------------------------------------------------------------------------------------------


def _own(problem: Problem, method: Any) -> Run:
    """The public call on one system."""
    system, n, phi = problem.system, problem.n, problem.phi

    def run(start: Vector) -> tuple[Any, int | None]:
        end = solvers.integrate(system, start[:n], start[n:], DURATION, dt=None, method=method)
        return phi @ end.q[-1], end.cost.law_calls

    run(problem.starts[0])
    return run


def exponential(problem: Problem, setting: Setting) -> Run:
    """Exact flight and collocated contact; setting rtol."""
    return _own(problem, solvers.Exponential(**setting))


def dormand_prince(problem: Problem, setting: Setting) -> Run:
    """DOP853 compiled with numba, events landed; settings rtol, atol."""
    return _own(problem, solvers.DormandPrince(**setting))


def henon(problem: Problem, setting: Setting) -> Run:
    """The paper's scheme: Heun with two steps and Hénon's landing; settings dt_flight, dt_contact."""
    return _own(problem, solvers.HenonRK2(**setting))


def constant_step(problem: Problem, setting: Setting) -> Run:
    """RK4, central differences, Newmark or generalised α; settings kind (the class), dt, locate."""
    setting = dict(setting)
    return _own(problem, setting.pop("kind")(**setting))


def regularised(problem: Problem, setting: Setting) -> Run:
    """The readable reference of the tests, plain Python: exact flight, SciPy's DOP853 in √δ; setting rtol."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from regularised import regularised as solve

    n = problem.n
    return lambda start: (problem.phi @ solve(problem.system, start[:n], start[n:], DURATION, **setting)[0], None)


# --- interpreted drivers with compiled right-hand sides --------------------------------------------------------------


class _Callbacks:
    """Right-hand side and δ compiled with numba, the fastest callbacks a Python-driven solver can have."""

    def __init__(self, problem: Problem) -> None:
        from numba import njit

        k, c, phi, load = problem.k, problem.c, problem.phi, problem.gamma * LOAD
        n = problem.n

        @njit(error_model="numpy")
        def rhs(t, x, factor, out):
            """F acts where ``factor`` = a/δ̇⁻ is not NaN; each mode's equation is that of the module."""
            delta = delta_dot = 0.0
            for i in range(n):
                delta -= phi[i] * x[i]
                delta_dot -= phi[i] * x[n + i]
            force = 0.0
            if delta > 0.0 and not math.isnan(factor):
                force = STIFFNESS * delta * math.sqrt(delta) * (1.0 + factor * delta_dot)
            wave = math.cos(OMEGA * t)
            for i in range(n):
                out[i] = x[n + i]
                out[n + i] = load[i] * wave + phi[i] * force - c[i] * x[n + i] - k[i] * x[i]

        @njit
        def delta(x):
            """δ = -φᵀq."""
            total = 0.0
            for i in range(n):
                total -= phi[i] * x[i]
            return total

        self.rhs, self.delta, self.n, self.phi, self.calls = rhs, delta, n, phi, 0

    def tip(self, x: Vector) -> float:
        """φᵀq."""
        return float(self.phi @ x[: self.n])

    def factor(self, x: Vector) -> float:
        """a/δ̇⁻ at an entry."""
        return FACTOR / max(-float(self.phi @ x[self.n :]), RATE_FLOOR)


def _alternate(problem: Problem, callbacks: _Callbacks, leg: Callable[..., tuple]) -> Run:
    """Flight and contact by turns; ``leg(t, x, factor) -> (t, x)`` ends at the event or the end."""

    def run(start: Vector) -> tuple[float, int]:
        callbacks.calls = 0
        t, x, factor = 0.0, start, math.nan
        while t < DURATION:
            before, (t, x) = t, leg(t, x, factor)
            if not t > before:
                raise RuntimeError(f"the same event again at t = {t} s")
            factor = callbacks.factor(x) if math.isnan(factor) else math.nan
        return callbacks.tip(x), callbacks.calls

    callbacks.rhs(0.0, problem.starts[0], math.nan, np.empty(2 * problem.n))
    callbacks.delta(problem.starts[0])
    return run


def scipy_ivp(problem: Problem, setting: Setting) -> Run:
    """SciPy's solve_ivp with terminal events; settings method, rtol, max_step."""
    from scipy.integrate import solve_ivp

    callbacks = _Callbacks(problem)
    options = {"atol": setting["rtol"] * 1e-3, **setting}

    def leg(t: float, x: Vector, factor: float) -> tuple[float, Vector]:
        def rhs(t: float, x: Vector) -> Vector:
            callbacks.calls += 1
            out = np.empty_like(x)
            callbacks.rhs(t, x, factor, out)
            return out

        def event(t: float, x: Vector) -> float:
            return callbacks.delta(x)

        event.terminal, event.direction = True, 1.0 if math.isnan(factor) else -1.0
        # a small first step leaves the surface, so that rounding in δ there hides no event of the next step
        first = min(1e-6, 0.5 * (DURATION - t))
        part = solve_ivp(rhs, (t, DURATION), x, events=event, first_step=first, **options)
        if part.status < 0:
            raise RuntimeError(part.message)
        return part.t[-1], part.y[:, -1]

    return _alternate(problem, callbacks, leg)


def cvode(problem: Problem, setting: Setting) -> Run:
    """SUNDIALS' CVODE by scikit-sundae with root finding; settings method (Adams, BDF), rtol."""
    from sksundae.cvode import CVODE

    callbacks = _Callbacks(problem)
    options = {"atol": setting["rtol"] * 1e-3, "max_num_steps": 10_000_000, **setting}
    factor = np.array([math.nan])

    def rhs(t: float, x: Vector, out: Vector) -> None:
        callbacks.calls += 1
        callbacks.rhs(t, x, factor[0], out)

    def solver(direction: int) -> Any:
        def event(t: float, x: Vector, out: Vector) -> None:
            out[0] = callbacks.delta(x)

        event.terminal, event.direction = [True], [direction]
        return CVODE(rhs, eventsfn=event, num_events=1, **options)

    flight, contact = solver(1), solver(-1)

    def leg(t: float, x: Vector, now: float) -> tuple[float, Vector]:
        factor[0] = now
        part = (flight if math.isnan(now) else contact).solve([t, DURATION], x)
        return float(part.t[-1]), np.array(part.y[-1])

    return _alternate(problem, callbacks, leg)
