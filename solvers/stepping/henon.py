"""The paper's scheme: Heun's method with two constant steps, and Hénon's step onto the stop.

Heun, x' = f(x, t): k₁ = f(x, t), k₂ = f(x + h k₁, t + h), x₊ = x + h (k₁ + k₂)/2.

Hénon's step: where a flight step would end inside a stop, δ becomes the independent variable,

    dx/dδ = f/δ̇,   dt/dδ = 1/δ̇,

and one Heun step from the present δ to 0 ends on the surface exactly. In contact the small step is used; the exit is
not located, the large step resumes once δ <= 0.

References
----------
van de Wouw, de Kraker, van Campen, Int. J. Non-Linear Mech. 38 (2003) 767, Sections 4.2 and 4.3;
Hénon, Physica D 5 (1982) 412.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from solvers.compiled.kernels import indentation, indentation_rate, inner, kernel, rhs
from solvers.problem import require_step
from solvers.stepping.constant_step import ConstantStep
from solvers.stepping.events import HENON
from solvers.stepping.stability import Radius, taylor_radius


@kernel
def hermite(h, x, rate, x_new, rate_new, dense):
    """Write the dense output of a step known at its ends only: the cubic Hermite interpolant."""
    for i in range(x.size):
        change = x_new[i] - x[i]
        dense[0, i] = change
        dense[1, i] = h * rate[i] - change
        dense[2, i] = 2.0 * change - h * (rate[i] + rate_new[i])
        for j in range(3, 7):
            dense[j, i] = 0.0


@kernel
def step(problem, t, h, move):
    """One Heun step; returns (error estimate 0, law calls). ``move.dense`` gets the cubic Hermite interpolant."""
    x, rate, segment, entry_rate, x_new, rate_new, dense, work, _ = move
    trial, second, batch = work[0], work[1], work[2]
    for i in range(x.size):
        trial[i] = x[i] + h * rate[i]
    calls = rhs(problem, t + h, trial, segment, entry_rate, second, batch)
    for i in range(x.size):
        x_new[i] = x[i] + 0.5 * h * (rate[i] + second[i])
    calls += rhs(problem, t + h, x_new, segment, entry_rate, rate_new, batch)
    hermite(h, x, rate, x_new, rate_new, dense)
    return 0.0, calls


@inner
def land(problem, t, h, move, stop):
    """Hénon's step onto the surface of a stop; returns its duration, s, or -1 where it fails (δ̇ near 0)."""
    x, rate, trial, second, batch = move.x, move.rate, move.work[0], move.work[1], move.work[2]
    delta_dot = indentation_rate(problem, stop, x)
    distance = -indentation(problem, stop, x)
    if not delta_dot > 0.0:
        return -1.0
    for i in range(x.size):
        trial[i] = x[i] + distance * rate[i] / delta_dot
    rhs(problem, t + distance / delta_dot, trial, move.segment, move.entry_rate, second, batch)
    second_delta_dot = indentation_rate(problem, stop, trial)
    duration = 0.5 * distance * (1.0 / delta_dot + 1.0 / second_delta_dot)
    if not (second_delta_dot > 0.0 and 0.0 <= duration <= 2.0 * h):
        return -1.0
    for i in range(x.size):
        move.x_new[i] = x[i] + 0.5 * distance * (rate[i] / delta_dot + second[i] / second_delta_dot)
    return duration


@dataclass(frozen=True)
class HenonRK2(ConstantStep):
    """Heun's second-order method with two constant steps and Hénon's landing: the paper's scheme.

    Parameters
    ----------
    dt_flight : step without contact, s.
    dt_contact : step while any stop is in contact, s.
    force_unstable : run even where a step is predicted to be unstable.

    Notes
    -----
    Order 2; only 1 for a law whose force jumps, as the exit is not located, and for one that depends on the entry rate
    where a stop is met while another is in contact, as it lands from flight only. Unstable for every step on an
    undamped mode (|R|² = 1 + (hω)⁴/4); with damping ratio ζ stable for about hω < (8ζ)^(1/3). Two contacts of one stop
    inside one flight step are missed. Where the beam grazes a stop Hénon's step divides by zero; it is then approached
    with ``dt_contact`` instead, without landing.

    Examples
    --------
    >>> from solvers import System
    >>> round(HenonRK2(dt_flight=1e-5, dt_contact=1e-6).stable_dt(System.modal([100.0], 0.001)).flight, 5)
    0.002
    """

    dt_flight: float
    dt_contact: float
    force_unstable: bool = False

    rtol: ClassVar[float] = 1e-8
    work_rows: ClassVar[int] = 3
    step: ClassVar[Any] = staticmethod(step)

    def __post_init__(self) -> None:
        for name in ("dt_flight", "dt_contact"):
            require_step(name, getattr(self, name))

    @property
    def events(self) -> int:
        """Hénon's step onto entries."""
        return HENON

    @property
    def steps(self) -> tuple[float, float]:
        """Flight and contact."""
        return self.dt_flight, self.dt_contact

    @property
    def radius(self) -> Radius:
        """|1 + z + z²/2|, z = hλ."""
        return taylor_radius(2)
