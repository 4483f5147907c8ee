r"""Newmark's family with constant step: central differences, Newmark, generalised α. One formula serves all.

.. math:: u_+ = u + h v + h^2 ((\tfrac12-β) a + β a_+),\qquad v_+ = v + h ((1-γ) a + γ a_+)

    M ((1-α_m) a_+ + α_m a) = (1-α_f) r_+ + α_f r,\qquad r = f(t) - C v - K u + \sum_s w_s F_s(δ_s, \dot δ_s)

Solved for a₊ with S = (1-α_m) M + (1-α_f)(γ h C + β h² K). The unknown of a contact is one number, its force: with
a₊ = a₀ + S⁻¹ w (1-α_f) F the end of the step reads δ = δ₀ - β h² g F, δ̇ = δ̇₀ - γ h g F, g = (1-α_f) wᵀS⁻¹w, and Newton
solves F = law(δ, δ̇); several stops by turns (Gauss–Seidel).

References
----------
Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67; Chung and Hulbert, J. Appl. Mech. 60 (1993) 371; Hughes, The Finite
Element Method (1987), Section 9.1 (limits of stability).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solvers.compiled.kernels import (
    add_loads,
    contact_forces,
    contact_gradient,
    indentation,
    indentation_rate,
    inlined,
    kernel,
    rhs,
)
from solvers.problem import Array, System
from solvers.stepping.constant_step import ConstantStep
from solvers.stepping.critical_step import newmark_oscillator
from solvers.stepping.events import count_in_contact
from solvers.stepping.henon import hermite
from solvers.stepping.shared import shared
from solvers.stepping.stability import Radius, alpha_radius

MOST_SWEEPS = 60  # iterations for one contact force, and sweeps over all of them


@kernel
def contact_force(problem, s, entry_rate, delta, delta_dot, by_force, rate_by_force, force, batch):
    """Solve F = law(δ - by_force (F - force), δ̇ - rate_by_force (F - force)) by Newton's method; (F, law calls).

    δ and δ̇ are those under ``force``, the first guess. NaN if Newton's method fails. ``batch`` holds six numbers.
    """
    F, calls = force, 0
    for _ in range(MOST_SWEEPS):
        batch[0] = delta - by_force * (F - force)
        batch[1] = delta_dot - rate_by_force * (F - force)
        inside = batch[0] > problem.knots[s, 0]
        contact_forces(problem, s, batch[0:1], batch[1:2], entry_rate, batch[2:3])
        contact_gradient(problem, s, batch[0:1], batch[1:2], entry_rate, batch[3:4], batch[4:5], batch[5:6])
        calls += 1
        slope = rate_by_force * batch[4] + (by_force * batch[3] if inside else 0.0)
        change = (batch[2] - F) / (1.0 + slope)
        F += change
        if abs(change) <= 1e-13 * abs(F) + 1e-300:
            return F, calls
    return (F if abs(change) <= 1e-9 * abs(F) else np.nan), calls


@kernel
def _predict(n, h, constants, x, rate, x_new):
    """Write the end of the step for (1-α_m) a₊ + α_m a = 0."""
    beta, gamma, share = constants[2], constants[3], constants[0] / (1.0 - constants[0])
    for i in range(n):
        a = rate[n + i]
        x_new[i] = x[i] + h * x[n + i] + h * h * (0.5 - beta * (1.0 + share)) * a
        x_new[n + i] = x[n + i] + h * (1.0 - gamma * (1.0 + share)) * a


@kernel
def _blend(n, constants, before, force):
    """Replace r₊ in ``force`` by (1-α_f) r₊ + α_f r; r is ``before``."""
    share, alpha_f = 1.0 - constants[1], constants[1]
    for i in range(n, 2 * n if alpha_f != 0.0 else n):
        force[i] = share * force[i] + alpha_f * before[i]


@kernel
def _accelerate(n, h, constants, change, x_new):
    """Add a change of a₊ to displacements and rates at the end of the step."""
    beta, gamma = constants[2], constants[3]
    for i in range(n):
        x_new[i] += beta * h * h * change[n + i]
        x_new[n + i] += gamma * h * change[n + i]


@kernel
def _solve_contact(problem, s, h, entry_rate, x_new, rate_new, work):
    """Find the force of one stop that equals its law at the end of the step, and apply it; returns the law calls."""
    n, row, force, reply, compliance = problem.k.size, problem.first[s], work[0], work[3], 0.0
    beta, gamma = work[4, 2], work[4, 3]
    for i in range(n):
        compliance -= problem.read[row, i] * reply[n + i]
    F, calls = contact_force(
        *(problem, s, entry_rate, indentation(problem, s, x_new), indentation_rate(problem, s, x_new)),
        *(beta * h * h * compliance, gamma * h * compliance, force[s], work[2]),
    )
    for i in range(n):
        a = reply[n + i] * (F - force[s])
        x_new[i] += beta * h * h * a
        x_new[n + i] += gamma * h * a
        rate_new[n + i] += a
    force[s] = F
    return calls


@shared
def _add_contacts(reply, problem, h, move):
    """Find the forces of all stops in contact at the end of a step by Gauss–Seidel sweeps; returns the law calls."""
    segment, work, calls = move.segment, move.work, 0
    active, force = count_in_contact(segment), work[0]
    if active == 0:
        return 0
    for s in range(problem.law.size):
        force[s] = 0.0
    for _ in range(MOST_SWEEPS):
        largest, change = 0.0, 0.0
        for s in range(problem.law.size):
            if segment[s] > 0:
                before = force[s]
                reply(problem, h, s, work)
                calls += _solve_contact(problem, s, h, move.entry_rate[s], move.x_new, move.rate_new, work)
                largest, change = max(largest, abs(force[s])), max(change, abs(force[s] - before))
        if active == 1 or change <= 1e-12 * largest:
            break
    return calls


@kernel
def _store_accelerations(n, rate, change):
    """Copy the accelerations a₊ to ``change`` before they are overwritten."""
    for i in range(n, 2 * n):
        change[i] = rate[i]


@kernel
def _finish(n, h, constants, x, rate, x_new, rate_new, change, dense):
    """Set the new acceleration, the energy balance by the trapezoidal rule, and the interpolant."""
    share = constants[0] / (1.0 - constants[0])
    for i in range(n, 2 * n):
        rate_new[i] = change[i] - share * rate[i]
    for i in range(2 * n, x.size):
        x_new[i] = x[i] + 0.5 * h * (rate[i] + rate_new[i])
    hermite(h, x, rate, x_new, rate_new, dense)


@shared
def newmark(balance, flight, solve, reply, problem, t, h, move):
    """One step; the last row of ``move.work`` holds (α_m, α_f, β, γ).

    ``balance`` writes r and the rates of the energy balance and returns the law calls, ``flight`` writes r without
    contact, ``solve`` puts S⁻¹ r in place of r, all of them behind n entries; ``reply`` writes (1-α_f) S⁻¹ w of a stop
    to ``work[3]``. Returns (error estimate 0, law calls). ``move.dense`` gets the cubic Hermite interpolant.
    """
    x, rate, segment, entry_rate, x_new, rate_new, dense, work, _ = move
    n, constants, calls = problem.k.size, work[4], 0
    if constants[1] != 0.0:
        calls += balance(problem, t, x, segment, entry_rate, dense[0], work[2])
    _predict(n, h, constants, x, rate, x_new)
    flight(problem, t + h, x_new, rate_new)
    _blend(n, constants, dense[0], rate_new)
    solve(problem, h, work, rate_new)
    _accelerate(n, h, constants, rate_new, x_new)
    calls += _add_contacts(reply, problem, h, move)
    _store_accelerations(n, rate_new, work[1])
    calls += balance(problem, t + h, x_new, segment, entry_rate, rate_new, work[2])
    _finish(n, h, constants, x, rate, x_new, rate_new, work[1], dense)
    return 0.0, calls


# --- on decoupled modes, where M is 1 and K, C and S have diagonals only


@inlined
def _flight(problem, t, x, force):
    """Write the forces of loads, damping and stiffness."""
    n = problem.k.size
    for i in range(2 * n):
        force[i] = 0.0
    add_loads(problem, t, x, force)
    for i in range(n):
        force[n + i] = force[n + i] - problem.c[i] * x[n + i] - problem.k[i] * x[i]


@inlined
def _solve(problem, h, work, force):
    """Divide forces by S, which is kept in ``work[1]``."""
    n, alpha_m, kept, beta, gamma = problem.k.size, work[4, 0], 1.0 - work[4, 1], work[4, 2], work[4, 3]
    for i in range(n):
        work[1, i] = (1.0 - alpha_m) + kept * (gamma * h * problem.c[i] + beta * h * h * problem.k[i])
        force[n + i] /= work[1, i]


@inlined
def _reply(problem, h, s, work):
    """Write the push of a stop over S to ``work[3]``."""
    n, row = problem.k.size, problem.first[s]
    for i in range(n):
        work[3, n + i] = (1.0 - work[4, 1]) * problem.push[row, n + i] / work[1, i]


@kernel
def step(problem, t, h, move):
    """`newmark` on decoupled modes."""
    return newmark(rhs, _flight, _solve, _reply, problem, t, h, move)


class _Family(ConstantStep):
    """What the methods of this module share."""

    work_rows: ClassVar[int] = 5
    step: ClassVar[Any] = staticmethod(step)

    @property
    def radius(self) -> Radius:
        """Of the matrix of one step."""
        return alpha_radius(*self.constants)

    def takes_matrices(self, system: System) -> bool:
        """Sparse matrices, and damping or gyroscopic terms that couple the modes, are stepped on as they are."""
        return system.sparse or system.blocks.loss.size > 0

    def critical(self, M: Any, C: Any, K: Any, G: Any) -> tuple[Array, Array]:
        """The oscillator that limits a step on matrices, since contacts couple the modes."""
        _, _, beta, gamma = self.constants
        return newmark_oscillator(beta, gamma, M, C, K, G)

    def matrix_step(self, equations: Any) -> Any:
        """The step on matrices."""
        return partial(newmark, equations.balance, equations.flight, equations.solve, equations.reply)


@dataclass(frozen=True)
class CentralDifference(_Family):
    """Central differences in their one-step form (velocity Verlet): β = 0, γ = ½, damping taken at the end.

    Parameters
    ----------
    dt : step, s.
    locate, force_unstable : as in `RK4`.

    Notes
    -----
    Stable for hω < 2, whatever the damping. Order 2, through contact too, with events located; without 2 at a smooth
    stop, 1 for laws that jump or that latch the entry rate. With the consistent mass matrix every step solves with
    M + ½hC, factorised once; with a diagonal M (`lumped`) and C it only divides.

    Examples
    --------
    >>> round(CentralDifference(dt=1.0).stable_dt(System.modal([4.0], 0.1)).flight, 6)
    0.5
    """

    dt: float
    locate: bool = True
    force_unstable: bool = False

    constants: ClassVar[tuple[float, ...]] = (0.0, 0.0, 0.0, 0.5)


@dataclass(frozen=True)
class Newmark(_Family):
    """Newmark's method.

    Parameters
    ----------
    dt : step, s.
    beta, gamma : β >= 0 and γ >= ½; (¼, ½) is the trapezoidal rule, (1/6, ½) linear acceleration.
    locate, force_unstable : as in `RK4`.

    Notes
    -----
    Stable for every step if 2β >= γ; else for hω < (γ/2 - β)^{-1/2}, more with damping if γ > ½. Order 2 for γ = ½,
    else 1; so through contact with events located, without them 1 for laws that jump or that latch the entry rate. The
    trapezoidal rule conserves the energy of the linear part, not that of a contact: it may gain.

    Examples
    --------
    >>> Newmark(dt=1.0).stable_dt(System.modal([4.0], 0.0)).flight
    inf
    """

    dt: float
    beta: float = 0.25
    gamma: float = 0.5
    locate: bool = True
    force_unstable: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.beta < math.inf:
            raise ValueError(f"beta must be >= 0 and finite, got {self.beta!r}")
        if not 0.5 <= self.gamma < math.inf:
            raise ValueError(f"gamma must be >= 1/2 (below, every step is unstable), got {self.gamma!r}")

    @property
    def constants(self) -> tuple[float, ...]:  # type: ignore[override]
        """(α_m, α_f, β, γ)."""
        return 0.0, 0.0, self.beta, self.gamma


@dataclass(frozen=True)
class GeneralizedAlpha(_Family):
    """The generalised-α method of Chung and Hulbert.

    Parameters
    ----------
    dt : step, s.
    rho_inf : spectral radius at infinite frequency, in [0, 1]; 1 keeps high modes, 0 removes them in one step.
    locate, force_unstable : as in `RK4`.

    Notes
    -----
    α_m = (2ρ-1)/(ρ+1), α_f = ρ/(ρ+1), β = ¼(1-α_m+α_f)², γ = ½-α_m+α_f: order 2, stable for every step; through
    contact as `Newmark`. After an event the acceleration is that of the equation of motion. The first steps overshoot
    in modes with hω above about 10.

    Examples
    --------
    >>> GeneralizedAlpha(dt=1.0, rho_inf=0.5).stable_dt(System.modal([4.0], 0.0)).flight
    inf
    """

    dt: float
    rho_inf: float = 0.8
    locate: bool = True
    force_unstable: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.rho_inf <= 1.0:
            raise ValueError(f"rho_inf must lie in [0, 1], got {self.rho_inf!r}")

    @property
    def constants(self) -> tuple[float, ...]:  # type: ignore[override]
        """(α_m, α_f, β, γ)."""
        alpha_m = (2.0 * self.rho_inf - 1.0) / (self.rho_inf + 1.0)
        alpha_f = self.rho_inf / (self.rho_inf + 1.0)
        return alpha_m, alpha_f, 0.25 * (1.0 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f


def lumped(M: Any, influence: ArrayLike) -> Any:
    """A diagonal mass matrix: rows summed over the translations, the slopes' own inertia kept.

    m_i = Σ_j M_ij r_j where r_i ≠ 0, else M_ii: the total mass rᵀM r is kept, a point mass unchanged.

    Parameters
    ----------
    M : (n, n) consistent mass matrix, SciPy sparse.
    influence : r (n,), 1 on translations and 0 on slopes, such as ``scene.matrices().influence``.

    Returns
    -------
    (n, n) SciPy sparse diagonal matrix.

    Examples
    --------
    >>> from scipy.sparse import csc_array
    >>> lumped(csc_array([[2.0, 1.0], [1.0, 2.0]]), [1.0, 1.0]).diagonal()
    array([3., 3.])
    """
    from scipy.sparse import diags_array

    r: Array = np.asarray(influence, dtype=float)
    return diags_array(np.where(r != 0.0, M @ r, M.diagonal()), format="csc")
