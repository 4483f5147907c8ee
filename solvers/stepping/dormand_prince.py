"""Dormand and Prince's Runge–Kutta method of order 8 with error control and dense output of order 7.

References
----------
Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., Sections II.5 and II.6 (DOP853). The
coefficients are those published with SciPy's `scipy.integrate.DOP853`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from solvers.compiled.dop853_tableau import E3, E5, EXTENDED, STAGES, A, C, D
from solvers.compiled.kernels import copy, inner, kernel, rhs
from solvers.problem import Array, Forcing, System
from solvers.problem.matrices import number
from solvers.stepping.events import ATOL, LOCATED, RTOL


@kernel
def step(problem, t, h, move):
    """One step; returns (error estimate in units of the tolerance, law calls). ``move.work`` holds the stages."""
    x, rate, segment, entry_rate, x_new, rate_new, dense, work, limits = move
    trial, batch = work[EXTENDED], work[EXTENDED + 1]
    copy(rate, work[0], x.size)
    calls = 0
    for i in range(1, STAGES + 1):
        _stage(i, h, x, work, trial)
        if i == STAGES:  # its weights are the step's: the stage is the new state, its rate the new rate
            copy(trial, x_new, x.size)
        calls += rhs(problem, t + C[i] * h, trial, segment, entry_rate, work[i], batch)
    copy(work[STAGES], rate_new, x.size)
    error = _error(2 * problem.k.size, h, x, x_new, work, limits)
    if error <= 1.0:
        for i in range(STAGES + 1, EXTENDED):
            _stage(i, h, x, work, trial)
            calls += rhs(problem, t + C[i] * h, trial, segment, entry_rate, work[i], batch)
        _interpolant(h, x, x_new, work, dense)
    return error, calls


@inner
def _stage(i, h, x, work, trial):
    """State at which stage i is evaluated."""
    for e in range(x.size):
        total = 0.0
        for j in range(i):
            total += A[i, j] * work[j, e]
        trial[e] = x[e] + h * total


@inner
def _error(size, h, x, x_new, work, limits):
    """DOP853's mixed estimate in the energy-like norm: positions and rates against their largest."""
    # one scale for all positions and one for all rates: a mode at rest must not dictate the step
    half, rtol, atol = size // 2, limits[RTOL], limits[ATOL]
    p_scale, v_scale = atol, atol
    for e in range(half):
        p_scale = max(p_scale, rtol * max(abs(x[e]), abs(x_new[e])))
        v_scale = max(v_scale, rtol * max(abs(x[half + e]), abs(x_new[half + e])))
    e5, e3 = 0.0, 0.0
    for e in range(size):
        scale = p_scale if e < half else v_scale
        five, three = 0.0, 0.0
        for j in range(STAGES + 1):
            five += E5[j] * work[j, e]
            three += E3[j] * work[j, e]
        e5 += (five / scale) ** 2
        e3 += (three / scale) ** 2
    if e5 == 0.0 and e3 == 0.0:
        return 0.0
    return abs(h) * e5 / math.sqrt((e5 + 0.01 * e3) * size)


@inner
def _interpolant(h, x, x_new, work, dense):
    """Rows F of x + θ(F₀ + (1-θ)(F₁ + θ(F₂ + (1-θ)(F₃ + ...))))."""
    for e in range(x.size):
        change = x_new[e] - x[e]
        dense[0, e] = change
        dense[1, e] = h * work[0, e] - change
        dense[2, e] = 2.0 * change - h * (work[STAGES, e] + work[0, e])
        for i in range(4):
            total = 0.0
            for j in range(EXTENDED):
                total += D[i, j] * work[j, e]
            dense[3 + i, e] = h * total


@dataclass(frozen=True)
class DormandPrince:
    """DOP853 with every entry, exit and kink located; the independent reference for any problem.

    Parameters
    ----------
    rtol : relative tolerance of a step, in [1e-14, 1e-2], against the largest coordinate.
    atol : absolute tolerance of coordinates (m or modal) and rates; keeps a start at rest from stalling. Where start
        and loads, or at rest what stops are pressed, are so small that it would stand above rtol times the motion, that
        is taken instead.

    Notes
    -----
    Explicit: steps are bounded by the fastest mode (about hω < 6), and in contact by the stop's stiffness. Borders of
    laws with memory and of friction are located like entries and exits; those met at one instant are renewed together.

    Examples
    --------
    >>> DormandPrince(rtol=1e-10).adaptive
    True
    """

    rtol: float = 1e-8
    atol: float = 1e-14

    adaptive: ClassVar[bool] = True
    takes_annuli: ClassVar[bool] = True
    takes_friction: ClassVar[bool] = True
    events: ClassVar[int] = LOCATED
    steps: ClassVar[tuple[float, float]] = (math.inf, math.inf)  # the longest
    work_rows: ClassVar[int] = EXTENDED + 2
    constants: ClassVar[tuple[float, ...]] = ()
    step: ClassVar[Any] = staticmethod(step)

    def __post_init__(self) -> None:
        if not 1e-14 <= number(self.rtol, "rtol") <= 1e-2:
            raise ValueError(f"rtol must lie in [1e-14, 1e-2], got {self.rtol!r}")
        if not 0.0 < number(self.atol, "atol") < math.inf:
            raise ValueError(f"atol must be positive and finite, got {self.atol!r}")

    def prepared(self, system: System, forcing: Forcing, duration: float) -> tuple[Forcing, None]:
        """The forcing alone: nothing is tabulated in advance."""
        return forcing, None

    def engine(self, system: System, z: Array, prepared: tuple[Forcing, None], duration: float) -> Any:
        """The method made ready for one run."""
        from solvers.stepping.engine import Engine  # here: the loop knows this module

        return Engine(self, system, z, prepared[0], duration)
