"""heyoka's own ensemble call on the benchmark's problem: all starts in one `ensemble_propagate_until`.

An ensemble runs one integrator per start to its end, so flight and contact are one set of equations here, with a switch
σ that a terminal event's callback turns over (σ = 1 in contact, where u = √δ and dt = u dτ; in flight dt = dτ):

    s = 1 - σ + σ u,   t' = s,   u' = σ δ̇/2,   q' = s v,   v' = s (-c v - k q + Γ A Ω² cos Ωt) + σ φ K u² δ (1 + a δ̇/δ̇⁻)
"""

from __future__ import annotations

from typing import Any

import numpy as np
from reference import DURATION, FACTOR, LOAD, OMEGA, RATE_FLOOR, STIFFNESS, Problem, Vector

LONGEST = 100.0  # τ of a run; each ends at its time


class _Turn:
    """The callback of the event: σ and a/δ̇⁻ change, u begins at 0."""

    def __init__(self, phi: Vector) -> None:
        self.phi = phi

    def __call__(self, integrator: Any, sign: int) -> bool:
        n, pars = self.phi.size, integrator.pars
        pars[0] = 1.0 - pars[0]
        if pars[0]:
            pars[1] = FACTOR / max(-float(self.phi @ integrator.state[n : 2 * n]), RATE_FLOOR)
        integrator.state[2 * n] = 0.0
        return True


class Ensemble:
    """The compiled integrator; call it with starts (k, 2n) to get the tips (k,) at the end."""

    def __init__(self, problem: Problem, tol: float) -> None:
        import heyoka as hy

        self.phi = problem.phi
        self.integrator = hy.taylor_adaptive(
            _equations(problem), np.zeros(2 * problem.n + 2), t_events=_events(problem), pars=[0.0, 0.0], tol=tol
        )

    def __call__(self, starts: Vector) -> Vector:
        """On one core."""
        import heyoka as hy

        def begun(integrator: Any, i: int) -> Any:
            integrator.state[:-2] = starts[i]
            return integrator

        ends = hy.ensemble_propagate_until(self.integrator, LONGEST, len(starts), begun, max_workers=1)
        return np.array([self.phi @ end[0].state[: self.phi.size] for end in ends])


def _motion(problem: Problem) -> tuple[Any, ...]:
    """Variables q, v, u, t, and the expressions δ and δ̇."""
    import heyoka as hy

    q, v = (hy.make_vars(*(f"{name}{i}" for i in range(problem.n))) for name in "qv")
    q, v = (list(x) if problem.n > 1 else [x] for x in (q, v))
    delta, rate = (hy.sum([-float(p) * x for p, x in zip(problem.phi, one, strict=True)]) for one in (q, v))
    return q, v, *hy.make_vars("u", "t"), delta, rate


def _equations(problem: Problem) -> list[tuple]:
    """(variable, derivative by τ)."""
    import heyoka as hy

    q, v, u, t, delta, rate = _motion(problem)
    switch, wave = hy.par[0], LOAD * hy.cos(OMEGA * t)
    s = 1.0 - switch + switch * u
    push = switch * STIFFNESS * (u * u) * delta * (1.0 + hy.par[1] * rate)
    equations = [(x, s * y) for x, y in zip(q, v, strict=True)]
    for x, y, k, c, gamma, phi in zip(q, v, problem.k, problem.c, problem.gamma, problem.phi, strict=True):
        equations.append((y, s * (float(gamma) * wave - float(k) * x - float(c) * y) + float(phi) * push))
    return [*equations, (u, 0.5 * switch * rate), (t, s)]


def _events(problem: Problem) -> list[Any]:
    """The stop's surface, δ = 0 in flight and u = 0 in contact, and the end of the run."""
    import heyoka as hy

    _, _, u, t, delta, _ = _motion(problem)
    surface = (1.0 - hy.par[0]) * delta + hy.par[0] * u
    return [hy.t_event(surface, callback=_Turn(problem.phi)), hy.t_event(t - DURATION)]
