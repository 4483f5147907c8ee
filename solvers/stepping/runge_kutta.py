r"""The classical Runge–Kutta method of order four, with constant step.

.. math:: k_1 = f(x, t),\; k_2 = f(x + \tfrac h2 k_1, t + \tfrac h2),\; k_3 = f(x + \tfrac h2 k_2, t + \tfrac h2),\;
          k_4 = f(x + h k_3, t + h),\quad x_+ = x + \tfrac h6 (k_1 + 2 k_2 + 2 k_3 + k_4)

References
----------
Kutta, Zeitschrift für Mathematik und Physik 46 (1901) 435.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from solvers.compiled.kernels import kernel, rhs
from solvers.problem import System
from solvers.stepping.constant_step import ConstantStep
from solvers.stepping.henon import hermite
from solvers.stepping.shared import shared
from solvers.stepping.stability import Radius, taylor_radius


@kernel
def _add_stage(start, stage, weight, reach, x, x_new, trial):
    """x_new = start + weight × stage, trial = x + reach × stage: the point of the next stage."""
    for i in range(x.size):
        x_new[i] = start[i] + weight * stage[i]
        trial[i] = x[i] + reach * stage[i]


@shared
def runge_kutta(rate_of, problem, t, h, move):
    """One step with the rates f = ``rate_of``; returns (error estimate 0, law calls).

    ``move.dense`` gets the cubic Hermite interpolant.
    """
    x, rate, segment, entry_rate, x_new, rate_new, dense, work, _ = move
    trial, stage, batch, calls = work[0], work[1], work[2], 0
    _add_stage(x, rate, h / 6.0, 0.5 * h, x, x_new, trial)
    for j in range(1, 4):
        calls += rate_of(problem, t + (h if j == 3 else 0.5 * h), trial, segment, entry_rate, stage, batch)
        weight, reach = (h / 6.0, 0.0) if j == 3 else (h / 3.0, h if j == 2 else 0.5 * h)
        _add_stage(x_new, stage, weight, reach, x, x_new, trial)
    calls += rate_of(problem, t + h, x_new, segment, entry_rate, rate_new, batch)
    hermite(h, x, rate, x_new, rate_new, dense)
    return 0.0, calls


@kernel
def step(problem, t, h, move):
    """`runge_kutta` on decoupled modes."""
    return runge_kutta(rhs, problem, t, h, move)


@dataclass(frozen=True)
class RK4(ConstantStep):
    """Classical Runge–Kutta of order 4 with constant step.

    Parameters
    ----------
    dt : step, s.
    locate : locate every entry, exit and kink (on the cubic interpolant); False lets the force act from the end of the
        step in which a contact began, to show what that costs.
    force_unstable : run even where the step is predicted to be unstable.

    Notes
    -----
    Stable for hω < 2√2 on an undamped mode, h|λ| < 2.785 on an overdamped one. Order 4 on smooth motion; through
    contact 4 if the law is smooth between its ends (a linear stop), 2.5 for Hertz, whose force begins as δ^1.5; without
    location 2 at best, 1 for laws that jump or that latch the entry rate. Borders of laws with memory are not located:
    what a step has passed is renewed at its end, order 2, or 1 where the force jumps at a border.

    Examples
    --------
    >>> bool(abs(RK4(dt=1.0).stable_dt(System.modal([2.0], 0.0)).flight - 2**0.5) < 1e-6)
    True
    """

    dt: float
    locate: bool = True
    force_unstable: bool = False

    work_rows: ClassVar[int] = 3
    step: ClassVar[Any] = staticmethod(step)

    @property
    def radius(self) -> Radius:
        """|1 + z + z²/2 + z³/6 + z⁴/24|, z = hλ."""
        return taylor_radius(4)

    def takes_matrices(self, system: System) -> bool:
        """Sparse matrices are stepped on as they are."""
        return system.sparse

    def matrix_step(self, equations: Any) -> Any:
        """The step on matrices."""
        return partial(runge_kutta, equations.rate)
