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
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solvers.compiled.kernels import (
    add_loads,
    contact_forces,
    contact_gradient,
    copy,
    indentation,
    indentation_rate,
    inner,
    kernel,
    rhs,
)
from solvers.problem import Array, System, require_step
from solvers.stepping.constant_step import ConstantStep
from solvers.stepping.critical_step import newmark_oscillator
from solvers.stepping.henon import hermite
from solvers.stepping.stability import Radius, alpha_radius

MOST_SWEEPS = 60


@kernel
def contact_force(problem, s, entry_rate, delta, delta_dot, by_force, rate_by_force, force, batch):
    """Solve F = law(δ - by_force (F - force), δ̇ - rate_by_force (F - force)) from ``force``; (F, law calls).

    NaN where Newton finds nothing. ``batch`` is working space of six numbers.
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
def _accelerate(n, i, a, h, beta, gamma, x):
    """Add the share of an acceleration to the end of the step."""
    x[i] += beta * h * h * a
    x[n + i] += gamma * h * a


@inner
def _touch(problem, h, segment, entry_rate, x_new, rate_new, work):
    """Add what the stops in contact do to the end of a step, by turns until their forces agree; law calls."""
    n, stops, active, calls = problem.k.size, problem.law.size, 0, 0
    force, effective, batch = work[0], work[1], work[2]
    kept, beta, gamma = 1.0 - work[3][1], work[3][2], work[3][3]
    for s in range(stops):
        active += 1 if segment[s] > 0 else 0
        force[s] = 0.0
    for _ in range(MOST_SWEEPS if active else 0):
        largest, change = 0.0, 0.0
        for s in range(stops):
            if segment[s] == 0:
                continue
            row, compliance = problem.first[s], 0.0
            for i in range(n):
                compliance -= problem.read[row, i] * kept * problem.push[row, n + i] / effective[i]
            F, used = contact_force(
                *(problem, s, entry_rate[s], indentation(problem, s, x_new)),
                *(indentation_rate(problem, s, x_new), beta * h * h * compliance, gamma * h * compliance),
                *(force[s], batch),
            )
            calls += used
            for i in range(n):
                a = kept * problem.push[row, n + i] * (F - force[s]) / effective[i]
                _accelerate(n, i, a, h, beta, gamma, x_new)
                rate_new[n + i] += a
            largest, change = max(largest, abs(F)), max(change, abs(F - force[s]))
            force[s] = F
        if active == 1 or change <= 1e-12 * largest:
            break
    return calls


@kernel
def step(problem, t, h, x, rate, segment, entry_rate, x_new, rate_new, dense, work, rtol, atol):
    """One step on decoupled modes; the last row of ``work`` holds (α_m, α_f, β, γ).

    Returns (error estimate 0, law calls). ``dense`` gets the cubic Hermite interpolant.
    """
    n = problem.k.size
    alpha_m, alpha_f, beta, gamma = work[3][0], work[3][1], work[3][2], work[3][3]
    effective, kept, calls = work[1], 1.0 - alpha_f, 0
    if alpha_f != 0.0:
        calls += rhs(problem, t, x, segment, entry_rate, dense[0], work[2])
    for i in range(n):  # predict
        x_new[i] = x[i] + h * x[n + i] + h * h * (0.5 - beta) * rate[n + i]
        x_new[n + i] = x[n + i] + h * (1.0 - gamma) * rate[n + i]
        rate_new[i] = rate_new[n + i] = 0.0
        effective[i] = (1.0 - alpha_m) + kept * (gamma * h * problem.c[i] + beta * h * h * problem.k[i])
    add_loads(problem, t + h, x_new, rate_new)
    for i in range(n):  # without contact
        a = kept * (rate_new[n + i] - problem.c[i] * x_new[n + i] - problem.k[i] * x_new[i]) - alpha_m * rate[n + i]
        if alpha_f != 0.0:
            a += alpha_f * dense[0, n + i]
        _accelerate(n, i, a / effective[i], h, beta, gamma, x_new)
        rate_new[n + i] = a / effective[i]
    calls += _touch(problem, h, segment, entry_rate, x_new, rate_new, work)
    copy(rate_new[n : 2 * n], effective, n)
    copy(x[2 * n :], x_new[2 * n :], x.size - 2 * n)
    calls += rhs(problem, t + h, x_new, segment, entry_rate, rate_new, work[2])
    if alpha_m != 0.0 or alpha_f != 0.0:
        copy(effective, rate_new[n : 2 * n], n)
    for i in range(2 * n, x.size):  # the energy balance by the trapezoidal rule
        x_new[i] = x[i] + 0.5 * h * (rate[i] + rate_new[i])
    hermite(h, x, rate, x_new, rate_new, dense)
    return 0.0, calls


class _Family(ConstantStep):
    """What the methods of this module share."""

    work_rows: ClassVar[int] = 4

    @property
    def radius(self) -> Radius:
        """From the matrix of one step."""
        return alpha_radius(*self.constants)

    @property
    def step(self) -> Any:
        """The compiled step."""
        return step

    def takes_matrices(self, system: System) -> bool:
        """Sparse matrices, and damping or gyroscopic terms that couple the modes, are stepped on as they are."""
        return system.sparse or system.blocks.loss.size > 0

    def critical(self, M: Any, C: Any, K: Any, G: Any = None) -> tuple[Array, Array]:
        """A contact couples the modes even where they are stepped one by one."""
        _, _, beta, gamma = self.constants
        return newmark_oscillator(beta, gamma, M, C, K, G)

    @property
    def matrix_step(self) -> Any:
        """The step on matrices."""
        from solvers.stepping.sparse import newmark_step

        return newmark_step


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

    def __post_init__(self) -> None:
        require_step("dt", self.dt)


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
        require_step("dt", self.dt)
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
        require_step("dt", self.dt)
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
