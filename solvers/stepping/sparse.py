"""Stepping on the matrices themselves: sparse, of any size, with any damping. The loop is Python, the solves SciPy's.

The state is x = [q, q̇, energy balance]; events, log and samples are those of `loop`. The step is constant, so an
implicit method factorises its matrix once, and a few times more where it lands on an event.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from solvers.compiled.kernels import kernel, rhs
from solvers.compiled.state import (
    CALLS,
    GAINED,
    H_FLIGHT,
    REJECTED,
    RUNNING,
    State,
    T,
    begin_contacts,
    directions_of,
    log_begin,
    matrix_problem_of,
    new_state,
)
from solvers.problem import Array, Forcing, System
from solvers.stepping.energy_gain import LEAST, NOW, gains, negligible_energy, watched
from solvers.stepping.engine import Engine
from solvers.stepping.events import LOCATED, MOST_LANDINGS, NONE, UNRESOLVED, nearer
from solvers.stepping.henon import hermite
from solvers.stepping.located import SWITCHED, accept, find, landing_tolerance, look
from solvers.stepping.loop import new_space
from solvers.stepping.newmark import MOST_SWEEPS, contact_force


class MatrixEngine(Engine):
    """One run of a method on matrices."""

    def __init__(self, method: Any, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        from scipy.sparse import csc_array, eye_array

        self.method, self.system, self.duration = method, system, duration
        self.M, self.C, self.K = (csc_array(matrix) for matrix in (system.M, system.C, system.K))
        self.by_rate = self.C if system.gyroscopic is None else csc_array(system.by_rate)
        self.problem = matrix_problem_of(system, forcing)
        self.back = eye_array(2 * system.size, format="csc")
        self.state: State = new_state(z, len(system.contacts))
        self.state.now[H_FLIGHT] = method.dt
        self.space = new_space(self.problem, self.state, 4, watched(system, z, 0.0))
        self.solvers: dict[Any, Any] = {}
        self.replies: dict[Any, Array] = {}  # acceleration per newton of a stop
        self.directions = directions_of(system)

    def _negligible(self) -> float:
        """Energy that counts as rounding."""
        vectors = self.problem.power[:, self.system.size :]
        solve = self.solver("mass", lambda: self.M)
        return negligible_energy(self.problem, np.array([v @ solve(v) for v in vectors]), self.method.dt)

    def start(self, log: Array) -> None:
        """Find the segment of every stop and evaluate the first rate."""
        self.space.watch[LEAST] = self._negligible()
        begin_contacts(self.problem, self.state)
        log_begin(self.problem, self.state, log)
        self.refresh()

    def refresh(self) -> None:
        """Evaluate the rate anew."""
        self.rate(self.state.now[T], self.state.x, self.state.rate)

    def march(self, budget: int, log: Array, out: Array, due: Array) -> int:
        """Advance by at most ``budget`` steps; the loop of `loop.march` for a constant step."""
        state, space, method, t_end = self.state, self.space, self.method, self.duration
        for _ in range(budget):
            code = look(self.problem, state, space, t_end, log, method.events)
            if code == SWITCHED:
                self.refresh()
                continue
            if code != RUNNING:
                return int(code)
            tried = h = min(state.now[H_FLIGHT], t_end - state.now[T])
            state.now[H_FLIGHT] = method.dt
            self.attempt(h)
            stop, direction = -1, 0
            if method.events == LOCATED:
                theta, stop, direction, level = find(self.problem, state, space)
                h = self._landed(h, theta, stop, direction, level)
                if h < 0.0:  # look closer
                    state.now[H_FLIGHT] = -h
                    state.count[REJECTED] += 1
                    continue
            at_end = stop < 0 and h == tried and h >= t_end - state.now[T]
            code = accept(self.problem, state, space, h, stop, direction, at_end, t_end, log, out, due)
            if code != RUNNING:
                return int(code)
            if stop >= 0:
                self.refresh()
            if self._gains():
                return GAINED
        return RUNNING

    def attempt(self, h: float) -> None:
        """One step from the present state."""
        with np.errstate(all="ignore"):  # `accept` reports what is not finite
            self.method.matrix_step(self, h)
        _interpolate(h, self.state, self.space)

    def _landed(self, longest: float, theta: float, stop: int, direction: int, level: float) -> float:
        """Duration of the step that ends on the event; where none does, minus the step to try."""
        if theta == UNRESOLVED:
            return -longest / 32.0
        if theta >= NONE:
            return longest
        tolerance, row = landing_tolerance(self.problem, self.state, stop), self.problem.first[stop]
        h, before, beyond = theta * longest, 0.0, longest
        for _ in range(MOST_LANDINGS):
            self.attempt(h)
            x = self.space.x_new[: 2 * self.system.size]
            distance = direction * (self.problem.read[row] @ x - self.problem.gap[row] - level)
            if abs(distance) <= tolerance:
                return h
            before, beyond = (h, beyond) if distance < 0.0 else (before, h)
            rate = direction * (self.problem.read_rate[row] @ x)
            corrected = nearer(h, distance, rate, before, beyond, longest)
            if not corrected > 0.0:
                return h if abs(distance) <= 100.0 * tolerance else -0.5 * longest
            h = corrected
        return -0.5 * longest

    def _gains(self) -> bool:
        """Whether energy comes from nowhere."""
        q, q_dot = np.split(self.state.x[: 2 * self.system.size], 2)
        self.space.watch[NOW] = self.system.energy(q, q_dot)
        return bool(gains(self.problem, self.state, self.space))

    # --- what steps are made of

    def forces(self, t: float, x: Array, segment: Any, out: Array) -> None:
        """Loads and contacts on [q, q̇]: out = [q̇, force, rates of the energy balance]."""
        calls = rhs(self.problem, t, x, segment, self.state.entry_rate, out, self.space.work[3])
        self.state.count[CALLS] += calls

    def rate(self, t: float, x: Array, out: Array) -> None:
        """Rate of the whole state, M⁻¹ included."""
        n = self.system.size
        q, q_dot = x[:n], x[n : 2 * n]
        self.forces(t, x, self.state.segment, out)
        out[2 * n + 1] = q_dot @ (self.C @ q_dot)
        out[n : 2 * n] = self.solver("mass", lambda: self.M)(out[n : 2 * n] - self.by_rate @ q_dot - self.K @ q)

    def solver(self, key: Any, matrix: Callable[[], Any]) -> Any:
        """Solver of a matrix, kept for the mass and for the constant step; a diagonal one only divides."""
        if key in self.solvers:
            return self.solvers[key]
        solve = _factorised(matrix(), key == "mass" or self.by_rate is self.C)
        if key in ("mass", self.method.dt):
            self.solvers[key] = solve
        return solve

    def reply(self, h: float, stop: int, solve: Any) -> Array:
        """S⁻¹w of a stop, kept for the constant step."""
        direction = self.directions[self.problem.first[stop]]
        if h != self.method.dt:
            return np.asarray(solve(direction))
        if stop not in self.replies:
            self.replies[stop] = solve(direction)
        return self.replies[stop]


@kernel
def _interpolate(h, state, space):
    """The cubic Hermite interpolant of a step."""
    hermite(h, state.x, state.rate, space.x_new, space.rate_new, space.dense)


def _factorised(matrix: Any, symmetric: bool) -> Callable[[Array], Array]:
    """Solver of a sparse matrix, positive definite where it is ``symmetric``."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    matrix = csc_array(matrix)
    diagonal = matrix.diagonal()
    if matrix.count_nonzero() == np.count_nonzero(diagonal):
        return lambda vector: vector / diagonal
    options: dict[str, Any] = {}
    if symmetric:
        options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    solve: Callable[[Array], Array] = splu(matrix, **options).solve
    return solve


def runge_kutta_step(engine: MatrixEngine, h: float) -> None:
    """One step of `runge_kutta`."""
    t, x, k1 = engine.state.now[T], engine.state.x, engine.state.rate
    k2, k3, k4 = (np.empty_like(x) for _ in range(3))
    engine.rate(t + 0.5 * h, x + 0.5 * h * k1, k2)
    engine.rate(t + 0.5 * h, x + 0.5 * h * k2, k3)
    engine.rate(t + h, x + h * k3, k4)
    engine.space.x_new[:] = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    engine.rate(t + h, engine.space.x_new, engine.space.rate_new)


def newmark_step(engine: MatrixEngine, h: float) -> None:
    """One step of `newmark`; the same letters."""
    alpha_m, alpha_f, beta, gamma = engine.method.constants
    n, state, x, rate = engine.system.size, engine.state, engine.state.x, engine.state.rate
    x_new, rate_new, kept = engine.space.x_new, engine.space.rate_new, 1.0 - alpha_f
    q, v, a = x_new[:n], x_new[n : 2 * n], rate[n : 2 * n]
    solve = engine.solver(
        h, lambda: (1.0 - alpha_m) * engine.M + kept * (gamma * h * engine.by_rate + beta * h * h * engine.K)
    )
    old = np.zeros_like(a)
    if alpha_f != 0.0:
        engine.rate(state.now[T], x, rate_new)
        old = alpha_f * (engine.M @ rate_new[n : 2 * n])
    q[:] = x[:n] + h * x[n : 2 * n] + h * h * (0.5 - beta) * a
    v[:] = x[n : 2 * n] + h * (1.0 - gamma) * a
    engine.forces(state.now[T] + h, x_new, np.zeros_like(state.segment), rate_new)
    inertia = alpha_m * (engine.M @ a) if alpha_m != 0.0 else 0.0
    a_new = solve(kept * (rate_new[n : 2 * n] - engine.by_rate @ v - engine.K @ q) + old - inertia)
    q += beta * h * h * a_new
    v += gamma * h * a_new
    if state.segment.any():
        a_new = a_new + _contact_accelerations(engine, h, solve, kept, beta, gamma)
    x_new[2 * n :] = x[2 * n :]
    engine.forces(state.now[T] + h, x_new, state.segment, rate_new)
    rate_new[2 * n + 1] = v @ (engine.C @ v)
    rate_new[n : 2 * n] = a_new
    x_new[2 * n :] += 0.5 * h * (rate[2 * n :] + rate_new[2 * n :])


def _contact_accelerations(engine: MatrixEngine, h: float, solve: Any, kept: float, beta: float, gamma: float) -> Array:
    """Accelerations from the stops in contact, added to the end of the step by turns until all forces agree."""
    n, state, x_new = engine.system.size, engine.state, engine.space.x_new
    problem, active = engine.problem, np.flatnonzero(state.segment)
    force, total = np.zeros(len(active)), np.zeros(n)
    reply = [kept * engine.reply(h, int(s), solve) for s in active]
    for _ in range(MOST_SWEEPS):
        before = force.copy()
        for i, s in enumerate(active):
            row = problem.first[s]
            w = engine.directions[row]
            compliance = w @ reply[i]
            delta, delta_dot = -w @ x_new[:n] - problem.gap[row], -w @ x_new[n : 2 * n]
            F, calls = contact_force(
                *(problem, s, state.entry_rate[s], delta, delta_dot),
                *(beta * h * h * compliance, gamma * h * compliance, force[i], engine.space.work[3]),
            )
            state.count[CALLS] += calls
            change = reply[i] * (F - force[i])
            total += change
            x_new[:n] += beta * h * h * change
            x_new[n : 2 * n] += gamma * h * change
            force[i] = F
        if len(active) == 1 or np.abs(force - before).max() <= 1e-12 * np.abs(force).max():
            break
    return total
