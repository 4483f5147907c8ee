"""One run of a stepping method: its problem, its state, its part of the loop, and explanations of failures."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np

from solvers.compiled.kernels import PlanarProblem, rhs
from solvers.compiled.state import (
    CALLS,
    DONE,
    GAINED,
    H_CONTACT,
    H_FLIGHT,
    LAW_NOT_FINITE,
    RUNNING,
    T_END,
    State,
    T,
    begin_contacts,
    log_begin,
    new_state,
    problem_of,
)
from solvers.problem import Array, Forcing, Status, System
from solvers.problem.run_arguments import output_arrays
from solvers.stepping.energy_gain import IN_A_ROW, NOW, STEPS_OF_GAIN, gains, largest_loads, negligible_energy, watched
from solvers.stepping.events import HENON
from solvers.stepping.loop import march_of, new_space
from solvers.stepping.stability import half_periods, kinks_of


def absolute_tolerance(method: Any, system: System, problem: Any, z: Array, fastest: float) -> float:
    """The method's own, or less if all that moves is so small or slow that it would exceed rtol times the motion."""
    p, v = np.abs(z).reshape(2, -1).max(axis=1)
    push = np.abs(problem.load).max(axis=1, initial=0.0) @ largest_loads(problem) / fastest
    size = max(p, v / fastest, push / fastest) or _released(system, problem)
    size *= min(fastest, 1.0)  # it holds for rates, too
    return float(min(method.atol, method.rtol * size) if size > 0.0 else method.atol)


def _released(system: System, problem: Any) -> float:
    """Block coordinate by which the largest indentation at q = 0 is given back: what is at rest moves by about that."""
    rest, reach = np.zeros(system.size), np.linalg.norm(problem.read[:, : problem.k.size], axis=1)
    delta = [abs(float(c.indentation(rest))) if c.always else float(c.indentation(rest)) for c in system.contacts]
    return max([0.0, *(d / r for d, r in zip(delta, reach[problem.first[:-1]], strict=True) if r > 0.0)])


class Engine:
    """One run of a stepping method: problem, state, and its part of the loop."""

    watched: ClassVar[bool] = True

    def __init__(self, method: Any, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        self.method, self.duration, self.system = method, duration, system
        self.problem = problem_of(system, forcing)
        self.back = system.blocks.T
        if method.events == HENON:
            self.problem.knots[:, 1:] = math.inf  # kinks are not located
        self.state: State = new_state(z, len(system.contacts), sum(c.friction is not None for c in system.contacts))
        self.state.now[T_END] = duration
        dt = 0.0 if method.adaptive else max(method.steps)
        least = negligible_energy(self.problem, np.sum(self.problem.load * self.problem.power, axis=1), dt)
        fastest = max([math.sqrt(abs(k)) for k in self.problem.k] + list(self.problem.c) + [1.0 / duration])
        self.state.now[[H_FLIGHT, H_CONTACT]] = (0.1 / fastest, 0.01 / fastest) if method.adaptive else method.steps
        atol = absolute_tolerance(method, system, self.problem, z, fastest)
        self.space = new_space(self.problem, self.state, method, atol, watched(system, self.back @ z, least))
        self.space.kinks[:] = kinks_of(system)
        self.rate, loop = rhs, march_of(isinstance(self.problem, PlanarProblem))
        self.loop: Any = partial(loop, method.step)

    def sample(self, times: Array | None) -> None:
        """Make room for outputs at times; None if the end alone is kept."""
        if times is not None:
            self.record(**output_arrays(times, self.duration, self.state.x.size))

    def record(self, **arrays: Array) -> None:
        """Replace arrays of the state that outputs go to: ``log``, ``out``, ``due``."""
        self.state = self.state._replace(**arrays)

    def start(self) -> None:
        """Find the segment of every stop and evaluate the first rate."""
        state = self.state
        begin_contacts(self.problem, state)
        log_begin(self.problem, state)
        state.count[CALLS] += self.rate(
            *(self.problem, 0.0, state.x, state.segment, state.entry_rate, state.rate, self.space.work[0])
        )

    def keeps_ledger(self, sampled: bool) -> bool:
        """Always: the energy balance is integrated along."""
        return True

    def march(self, budget: int) -> int:
        """Advance by ``budget`` steps at most."""
        method = self.method
        if self.state.now[T] == 0.0 and not np.isfinite(self.state.rate).all():
            return LAW_NOT_FINITE  # loads and starts have been checked before
        code = self.loop(self.problem, self.state, self.space, budget, method.adaptive, method.events)
        return GAINED if code in (DONE, RUNNING) and self._gained() else code

    def has_gained(self, exchanged: Callable[[], Array]) -> bool:
        """No: ``march`` would have told."""
        return False

    def shorten(self) -> bool:
        """No: the steps are the user's, or as short as time can tell."""
        return False

    def release(self) -> None:
        """Nothing: no other run uses these arrays."""

    def _gained(self) -> bool:
        """Whether a run with coupling damping gained energy; see `gains`."""
        if not self.problem.loss.size or self.method.adaptive:
            return False
        size = 2 * self.problem.k.size
        self.space.watch[NOW] = self.system.energy(*np.split(self.back @ self.state.x[:size], 2))
        self.space.watch[IN_A_ROW] = STEPS_OF_GAIN
        return bool(gains(self.problem, self.state, self.space))

    def explain(self, status: Status) -> str:
        """Which coordinate grew, and which step to try."""
        if status not in (Status.GAINED, Status.DIVERGED) or self.method.adaptive:
            return ""
        q, q_dot = np.split(self.back @ self.state.x[: 2 * self.problem.k.size], 2)
        return explanation(self.method, self.system, q, q_dot, self.duration)


def explanation(method: Any, system: System, q: Array, q_dot: Array, duration: float) -> str:
    """The coordinate that grew, and the predicted limits."""
    modal = not system.sparse and not np.any(system.M - np.eye(system.size))
    share = np.abs(q_dot * (system.M @ q_dot))
    if modal:  # among the modes that a step amplifies, if any
        k, c = np.diag(system.K), np.diag(system.C)
        grows = np.maximum(*(method.radius(h, k, c) for h in method.steps)) > 1.0 + 1e-9
        share = np.where(grows, share + k * q**2, 0.0) if grows.any() else share + k * q**2
    worst = int(np.argmax(np.nan_to_num(share, nan=math.inf, posinf=math.inf)))
    where = f"coordinate {worst} of {system.size}"
    if modal:
        where = f"mode {worst + 1} of {system.size} (ω = {math.sqrt(abs(system.K[worst, worst])):.6g} rad/s)"
    limit = method.stable_dt(system, duration=duration)
    step = min(limit.flight, limit.contact, *method.steps, *(0.1 * half for half in half_periods(system, None)))
    grown = f"; it grew in {where}, steps {method.steps[0]:g} s in flight and {method.steps[1]:g} s in contact"
    return f"{grown}, predicted limits {limit.flight:.3g} s and {limit.contact:.3g} s: try {0.5 * step:.2g} s"
