"""heyoka's Taylor integrator on the benchmark's problem, with the signature of `peers`."""

from __future__ import annotations

from typing import Any

import numpy as np
from reference import DURATION, FACTOR, LOAD, OMEGA, RATE_FLOOR, STIFFNESS, Problem, Vector

Setting = dict[str, Any]


def heyoka(problem: Problem, setting: Setting) -> Any:
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
