"""Stepping on the matrices themselves: sparse, of any size, with any damping. The solves are SciPy's.

The state is x = [q, q̇, energy balance]; loop and methods are those of decoupled modes, run as Python. The step is
constant, so an implicit method factorises its matrix once, and a few times more where it lands on an event.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from solvers.compiled.kernels import rhs
from solvers.compiled.state import H_CONTACT, H_FLIGHT, T_END, matrix_problem_of, new_state
from solvers.problem import Array, Forcing, System
from solvers.stepping.energy_gain import LEAST, NOW, gains, negligible_energy, watched
from solvers.stepping.engine import Engine
from solvers.stepping.loop import march, new_space

MASS = 0.0  # key of the mass matrix among the factors, whose keys are steps


class Factor(NamedTuple):
    """A factorised matrix: how to solve with it, and its solutions for the pushes of stops."""

    solve: Callable[[Array], Array]
    replies: dict[int, Array]


class MatrixEngine(Engine):
    """One run of a method on matrices: the functions that `runge_kutta` and `newmark` call, on sparse matrices."""

    def __init__(self, method: Any, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        from scipy.sparse import csc_array, eye_array

        self.method, self.system, self.duration = method, system, duration
        self.M, self.C, self.K = (csc_array(matrix) for matrix in (system.M, system.C, system.K))
        self.by_rate = self.C if system.gyroscopic is None else csc_array(system.by_rate)
        self.problem = matrix_problem_of(system, forcing)
        self.back = eye_array(2 * system.size, format="csc")
        self.state = new_state(z, len(system.contacts))
        self.state.now[[H_FLIGHT, H_CONTACT, T_END]] = *method.steps, duration
        self.space = new_space(self.problem, self.state, method, method.atol, watched(system, z, 0.0))
        self.open = np.zeros_like(self.state.segment)
        self.moving = slice(system.size, 2 * system.size)  # rates in x, accelerations or forces in its rate
        self.factors: dict[float, Factor] = {}
        self.loop = partial(march, method.matrix_step(self), self.rate, self.gained)

    def start(self) -> None:
        """Set the negligible energy, the segment of every stop, and the first rate."""
        vectors, solve = self.problem.power[:, self.moving], self.factor(MASS).solve
        least = negligible_energy(self.problem, np.array([v @ solve(v) for v in vectors]), self.method.dt)
        self.space.watch[LEAST] = least
        super().start()

    def march(self, budget: int) -> int:
        """Advance by at most ``budget`` steps."""
        with np.errstate(all="ignore"):  # the loop reports numbers that are not finite
            return super().march(budget)

    def gained(self, problem: Any, state: Any, space: Any) -> bool:
        """Whether the run gains energy, see `gains`."""
        q, q_dot = state.x[: self.system.size], state.x[self.moving]
        space.watch[NOW] = 0.5 * (q_dot @ (self.M @ q_dot) + q @ (self.K @ q))
        return bool(gains(problem, state, space))

    def rate(self, *at: Any) -> int:
        """Rate of the state, as `rhs`."""
        calls, out = self.balance(*at), at[5]
        out[self.moving] = self.factor(MASS).solve(out[self.moving])
        return calls

    def balance(self, problem: Any, t: float, x: Array, segment: Any, entry_rate: Any, out: Array, batch: Any) -> int:
        """The same with forces in place of accelerations."""
        n, q_dot = self.system.size, x[self.moving]
        calls: int = rhs(problem, t, x, segment, entry_rate, out, batch)
        damping = self.C @ q_dot
        out[2 * n + 1] = q_dot @ damping
        out[self.moving] -= (damping if self.by_rate is self.C else self.by_rate @ q_dot) + self.K @ x[:n]
        return calls

    def flight(self, problem: Any, t: float, x: Array, out: Array) -> None:
        """Forces without contact, into ``out``."""
        self.balance(problem, t, x, self.open, self.state.entry_rate, out, self.space.work[2])

    def solve(self, problem: Any, h: float, work: Array, force: Array) -> None:
        """Replace forces by S⁻¹ times them, accelerations."""
        force[self.moving] = self.factor(h).solve(force[self.moving])

    def reply(self, problem: Any, h: float, s: int, work: Array) -> None:
        """Write the accelerations per newton of a stop to ``work[3]``."""
        solve, replies = self.factor(h)
        if s not in replies:
            replies[s] = (1.0 - self.method.constants[1]) * solve(problem.push[problem.first[s], self.moving])
        work[3, self.moving] = replies[s]

    def factor(self, h: float) -> Factor:
        """Factorised M (h = `MASS`) or S of a step h; kept for the constant step and the latest landing."""
        if h not in self.factors:
            self.factors = {kept: self.factors[kept] for kept in (MASS, self.method.dt) if kept in self.factors}
            symmetric = h == MASS or self.by_rate is self.C
            self.factors[h] = Factor(_factorised(self.M if h == MASS else self._effective(h), symmetric), {})
        return self.factors[h]

    def _effective(self, h: float) -> Any:
        """S of `newmark`."""
        alpha_m, alpha_f, beta, gamma = self.method.constants
        return (1.0 - alpha_m) * self.M + (1.0 - alpha_f) * (gamma * h * self.by_rate + beta * h * h * self.K)


def _factorised(matrix: Any, symmetric: bool) -> Callable[[Array], Array]:
    """Solver of a sparse matrix, positive definite if ``symmetric``; of a diagonal matrix it divides."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    matrix = csc_array(matrix)
    diagonal = matrix.diagonal()
    if matrix.count_nonzero() == np.count_nonzero(diagonal):
        return lambda vector: vector / diagonal
    options: dict[str, Any] = {}
    if symmetric:
        options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    return splu(matrix, **options).solve
