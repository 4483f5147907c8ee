"""The result of an identification from measured loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contacts.identification.records import Vector
from contacts.identification.result import Estimate
from contacts.law import Law


@dataclass(frozen=True, eq=False)
class MeasuredLoop:
    """One record: (k,) m and N as measured, and the forces of the law found, with the offset."""

    delta: Vector
    force: Vector
    fitted: Vector


@dataclass(frozen=True, eq=False)
class IdentifiedLoop:
    """What `identify_loop` finds; see there for an example.

    Attributes
    ----------
    law : the law found, ready for an element.
    estimates : its parameters by name, with intervals; those of Iwan's elements as "limits[0]", in the order of slip.
    force_offset : N.
    noise : standard deviation of the force about the law, N.
    correlations : (p, p) of the estimates' errors, in their order.
    records : each with what the law makes of it.
    remarks : what makes the numbers doubtful; also issued as warnings.
    confidence : of the intervals.
    """

    law: Law
    estimates: dict[str, Estimate]
    force_offset: Estimate
    noise: float
    correlations: NDArray[np.float64]
    records: tuple[MeasuredLoop, ...]
    remarks: tuple[str, ...]
    confidence: float

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {self._with_unit(name)}" for name in self.estimates)
        return f"<{self._head()}: {told}>"

    def __str__(self) -> str:
        lines = [f"{self._head()}, {100 * self.confidence:g} % intervals"]
        lines += [f"  {name:<14} {self._with_unit(name)}" for name in self.estimates]
        if "alpha" in self.estimates:
            lines.append(f"  A, n           1 (chosen: loops tell A and beta, gamma together only), {self.law.n}")  # type: ignore[attr-defined]
        lines += [f"  force offset   {self.force_offset} N", f"  noise          {self.noise:.3g} N"]
        return "\n".join(lines + [f"  beware: {remark}" for remark in self.remarks])

    def _head(self) -> str:
        """The law and how many records."""
        count = len(self.records)
        return f"{type(self.law).__name__} from {count} record{'s' * (count != 1)}"

    def _with_unit(self, name: str) -> str:
        """An estimate and the unit of it, if it has one."""
        unit = self.law.units.get(name.partition("[")[0], "").replace("^n", f"^{getattr(self.law, 'n', '')}")
        return f"{self.estimates[name]} {unit.removesuffix('^1')}".rstrip()
