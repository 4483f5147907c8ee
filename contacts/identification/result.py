"""The result of an identification: parameters with intervals, each collision, remarks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from contacts.identification.records import Vector
from contacts.power_laws import Hysteretic

EXACT = 5e-4  # relative differences that matter to nobody


def inflation_of(correlation: float, freedom: int) -> float:
    """What a correlation of neighbouring residuals multiplies variances by, as far as chance does not explain it."""
    long = min(max(0.0, correlation - 2.0 / math.sqrt(freedom)), 0.98)
    return (1.0 + long) / (1.0 - long)


@dataclass(frozen=True)
class Estimate:
    """A value with the ends of its confidence interval; equal ends: it was given.

    Examples
    --------
    >>> found = Estimate(0.56, 0.55, 0.57)
    >>> print(found, 0.5625 in found)
    0.56 [0.55, 0.57] True
    """

    value: float
    low: float
    high: float

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high

    def __str__(self) -> str:
        return f"{self.value:.6g}" + ("" if self.low == self.high else f" [{self.low:.6g}, {self.high:.6g}]")


@dataclass(frozen=True, eq=False)
class Collision:
    """One collision and what it says by itself.

    Attributes
    ----------
    delta, delta_dot, force, fitted : (k,) m, m/s, N, N; offsets taken off.
    entry_rate, exit_rate : m/s, both positive.
    energy_loss : J, area of the loop.
    stiffness, damping_factor : from this collision alone.
    """

    delta: Vector
    delta_dot: Vector
    force: Vector
    fitted: Vector
    entry_rate: float
    exit_rate: float
    energy_loss: float
    stiffness: float
    damping_factor: float

    def __repr__(self) -> str:
        return f"<collision at {self.entry_rate:.4g} m/s, {len(self.force)} samples, largest {self.force.max():.4g} N>"


@dataclass(frozen=True, eq=False)
class Identified:
    """What `identify` finds; see there for an example.

    Attributes
    ----------
    stiffness, exponent, damping_factor : K (N/m^p), p, a.
    nominal : restitution that Lankarani and Nikravesh's formula gives a, e = √(1 - 4a/3), Eq. (6); NaN for a > 3/4.
    restitution : what a free mass achieves with a.
    force_offset, indentation_offset : N, m.
    noise : standard deviation of the force about the law, N.
    loop_stiffness, loop_damping_factor : K at the largest indentation and a from the loops' area, Eqs (4) and (5).
    collisions : each by itself.
    remarks : what makes the numbers doubtful; also issued as warnings.
    confidence : of the intervals.
    """

    stiffness: Estimate
    exponent: Estimate
    damping_factor: Estimate
    nominal: Estimate
    restitution: Estimate
    force_offset: Estimate
    indentation_offset: Estimate
    noise: float
    loop_stiffness: float
    loop_damping_factor: float
    collisions: tuple[Collision, ...]
    remarks: tuple[str, ...]
    confidence: float

    def __repr__(self) -> str:
        return (
            f"<law from {len(self.collisions)} collisions: stiffness {self.stiffness}, restitution {self.restitution}>"
        )

    @property
    def law(self) -> Hysteretic:
        """The law found, ready for a stop."""
        return Hysteretic(self.stiffness.value, max(self.damping_factor.value, 0.0), max(self.exponent.value, 1.0))

    def __str__(self) -> str:
        p = f"{self.exponent.value:.4g}"
        lines = [
            f"{len(self.collisions)} collisions, {100 * self.confidence:g} % intervals",
            f"  stiffness          {self.stiffness} N/m^{p}",
            f"  exponent           {self.exponent}" + (" (given)" if self.exponent.low == self.exponent.high else ""),
            f"  damping factor     {self.damping_factor}",
            f"  restitution        nominal {self.nominal}, achieved {self.restitution}",
            f"  offsets            force {self.force_offset} N, indentation {self.indentation_offset} m",
            f"  noise              {self.noise:.3g} N",
            f"  from peaks, loops  stiffness {self.loop_stiffness:.6g} N/m^{p}, damping factor "
            f"{self.loop_damping_factor:.6g}",
        ]
        return "\n".join(lines + [f"  beware: {remark}" for remark in self.remarks])
