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

import solvers

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
    return lambda start: (
        problem.phi @ solve(problem.system, start[:n], start[n:], DURATION, **setting)[0],
        None,
    )


# --- heyoka ----------------------------------------------------------------------------------------------------------


def heyoka(problem: Problem, setting: Setting) -> Run:
    r"""Taylor's method of heyoka.py with terminal events, driven from Python.

    Settings: tol; ``root`` (default True) writes contact in u = √δ with dt = u dτ,

    .. math:: u' = \dot δ/2,\quad t' = u,\quad (q, v)' = u\,(\dot q, \dot v),\quad F = K δ u (1 + a \dot δ/\dot δ^-),

    where Taylor series pass the ends of a contact; otherwise contact is in t, where δ^{3/2} ends every series at δ = 0:
    it then begins and ends at δ₀ = δ_max tol^{2/5}, below which the force's work is beneath the tolerance.
    ``compact_mode`` (default False, twice as fast once compiled); ``high_accuracy``; ``extended`` for 80-bit numbers.
    """
    setting = dict(setting)
    rooted = setting.pop("root", True)
    options = {"compact_mode": False, **setting}
    real = np.longdouble if options.pop("extended", False) else float
    options |= {"fp_type": real, "tol": real(options["tol"])}
    return (_HeyokaRoot if rooted else _Heyoka)(problem, real, options).run


class _Heyoka:
    """Two compiled integrators, flight and contact in t, made once and reused."""

    def __init__(self, problem: Problem, real: type, options: Setting) -> None:
        import heyoka as hy

        self.real, self.n, self.phi = real, problem.n, np.asarray(problem.phi, dtype=real)
        self.tolerance, self.end, self.options = float(options["tol"]), real(DURATION), options
        self.depth = (1.25 / (STIFFNESS * float(problem.phi @ problem.phi))) ** 0.4
        self.up, self.down = hy.event_direction.positive, hy.event_direction.negative
        self.q, self.v = (hy.make_vars(*(f"{name}{i}" for i in range(self.n))) for name in "qv")
        self.delta = hy.sum([-real(p) * q for p, q in zip(problem.phi, self.q, strict=True)])
        self.delta_dot = hy.sum([-real(p) * v for p, v in zip(problem.phi, self.v, strict=True)])
        self.flight = self.compiled(self.equations(problem, hy.time, None), [(self.delta, self.up)], 0)
        self.contact = self.made_contact(problem)

    def equations(self, problem: Problem, t: Any, force: Any) -> list[tuple]:
        """(variable, derivative) of q and v in t."""
        import heyoka as hy

        real, wave = self.real, hy.cos(self.real(OMEGA) * t)
        rates = []
        for q, v, k, c, gamma, phi in zip(
            self.q, self.v, problem.k, problem.c, problem.gamma, problem.phi, strict=True
        ):
            terms = [-real(k) * q, -real(c) * v, real(gamma) * real(LOAD) * wave]
            rates.append((v, hy.sum(terms if force is None else [*terms, real(phi) * force])))
        return [(q, v) for q, v in zip(self.q, self.v, strict=True)] + rates

    def law(self, elastic: Any) -> Any:
        """F from its elastic part; parameter 0 is a/δ̇⁻."""
        import heyoka as hy

        return self.real(STIFFNESS) * elastic * (self.real(1.0) + hy.par[0] * self.delta_dot)

    def compiled(self, equations: list[tuple], events: list[tuple], parameters: int) -> Any:
        """A Taylor integrator that stops at each (expression, direction)."""
        import heyoka as hy

        stops = [hy.t_event(e, direction=d, fp_type=self.real) for e, d in events]
        zeros, pars = (np.zeros(size, dtype=self.real) for size in (len(equations), parameters))
        return hy.taylor_adaptive(equations, zeros, t_events=stops, pars=pars, **self.options)

    def made_contact(self, problem: Problem) -> Any:
        """Contact in t; parameter 1 is δ₀."""
        import heyoka as hy

        force = self.law(self.delta**1.5)
        return self.compiled(self.equations(problem, hy.time, force), [(self.delta - hy.par[1], self.down)], 2)

    def run(self, start: Vector) -> tuple[Any, None]:
        """Flight and contact by turns until the end."""
        flight, size = self.flight, 2 * self.n
        flight.state[:], flight.time = start, self.real(0)
        while self._advance(flight):
            rate = -(self.phi @ flight.state[self.n : size])
            if self.touch(flight, rate):
                break
        return self.phi @ flight.state[: self.n], None

    def _advance(self, integrator: Any) -> bool:
        """To the event (True) or the end (False)."""
        integrator.reset_cooldowns()
        return int(integrator.propagate_until(self.end)[0]) == -1

    def touch(self, flight: Any, rate: Any) -> bool:
        """One contact; the state comes back in ``flight``. True at the end of the run."""
        contact = self.contact
        entry = max(rate, RATE_FLOOR)
        offset = self.depth * entry**0.8 * self.tolerance**0.4
        flight.propagate_for(offset / rate)
        contact.state[:], contact.time = flight.state, flight.time
        contact.pars[0], contact.pars[1] = FACTOR / entry, offset
        inside = self._advance(contact)
        flight.state[:], flight.time = contact.state, contact.time
        return not inside


class _HeyokaRoot(_Heyoka):
    """Contact in u = √δ."""

    def made_contact(self, problem: Problem) -> Any:
        """Parameter 1 is the end of the run, which stops contact as an event."""
        import heyoka as hy

        u, t = hy.make_vars("u", "t")
        rates = [(x, u * rate) for x, rate in self.equations(problem, t, self.law(u * self.delta))]
        rates += [(u, self.real(0.5) * self.delta_dot), (t, u)]
        return self.compiled(rates, [(u, self.down), (t - hy.par[1], self.up)], 2)

    def touch(self, flight: Any, rate: Any) -> bool:
        """One contact from u = 0 to u = 0, or to the end of the run."""
        contact, size, one = self.contact, 2 * self.n, self.real(1)
        state = contact.state
        state[:size], state[size], state[size + 1] = flight.state, 0.0, flight.time
        contact.time = self.real(0)
        contact.pars[0], contact.pars[1] = self.real(FACTOR) / max(rate, self.real(RATE_FLOOR)), self.end
        contact.reset_cooldowns()
        event = int(contact.propagate_until(one)[0])  # τ of a contact is below 1 s^½: an event comes first
        flight.state[:], flight.time = state[:size], state[size + 1]
        if self.real is np.longdouble:  # an entry soon after an exit is otherwise missed now and then
            flight.step(self.real(1e-4))
        return event == -2


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
