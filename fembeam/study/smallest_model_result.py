"""The smallest model found, with its evidence: a table of every model tried."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import solvers
from fembeam.study.measure import Measured
from fembeam.support import Part, Printed
from solvers.problem import dataframe

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fembeam.model import Model


HEAD = "modes", "static", "rtol", "value", "error", "± (95 %)", "seconds", ""


class Choice(NamedTuple):
    """A candidate: number of modes, with static shapes or not, rtol."""

    modes: int
    residual: bool
    rtol: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """One line of the evidence: a model and its distance from the one it was compared with."""

    choice: Choice
    measured: Measured
    error: float
    uncertainty: float
    remark: str = ""

    @property
    def bound(self) -> float:
        """Error + uncertainty; infinite where the quantity is not defined."""
        total = self.error + self.uncertainty
        return total if np.isfinite(total) else np.inf

    def cells(self) -> tuple[str, ...]:
        """The line of the printed table."""
        value = self.measured.mean
        return (
            str(self.choice.modes), "yes" if self.choice.residual else "no", f"{self.choice.rtol:.0e}",
            f"{np.linalg.norm(value) / np.sqrt(value.size):.6g}", f"{self.error:.2e}",
            f"{self.uncertainty:.1e}" if self.uncertainty else "", f"{self.measured.seconds:.3g}", self.remark,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class SmallestModel(Printed):
    """The answer; print it for the evidence.

    Attributes
    ----------
    met : whether the tolerance is met; False only inside a `NotMetError`.
    model, solver : what to simulate with (``model.simulate(…, solver=solver)``).
    modes, residual, rtol : its settings; value : of the quantity, as it gives it.
    reduction_error, integration_error : relative, uncertainty included; their sum is at most the tolerance.
    check : relative distance, uncertainty included, from twice the modes at a hundredth of rtol.
    reduction, integration : lines of evidence. verdict : a sentence.
    """

    quantity: str
    tolerance: float
    verdict: str
    reduction: tuple[Evidence, ...]
    integration: tuple[Evidence, ...] = ()
    met: bool = False
    choice: Choice | None = None
    model: Model | None = None
    value: Any = None
    reduction_error: float = float("nan")
    integration_error: float = float("nan")
    check: float = float("nan")

    @property
    def modes(self) -> int | None:
        """Number of modes."""
        return None if self.choice is None else self.choice.modes

    @property
    def residual(self) -> bool | None:
        """Whether static shapes are added."""
        return None if self.choice is None else self.choice.residual

    @property
    def rtol(self) -> float | None:
        """Tolerance of `solvers.Exponential`."""
        return None if self.choice is None else self.choice.rtol

    @property
    def solver(self) -> Any:
        """The solver with that tolerance."""
        return None if self.choice is None else solvers.Exponential(self.choice.rtol)

    def __repr__(self) -> str:
        return f"<smallest model for {self.quantity} to {self.tolerance:g}: {self.verdict}>"

    def _parts(self) -> list[Part]:
        parts: list[Part] = [f"{self.quantity} to {self.tolerance:g}: {self.verdict}"]
        for title, lines in (("reduction", self.reduction), ("integration", self.integration)):
            if lines:
                parts += [f"\n{title}:", (HEAD, [line.cells() for line in lines])]
        return parts

    def to_dataframe(self) -> Any:
        """The rows as a table of pandas; ImportError without pandas."""
        lines = [("reduction", line) for line in self.reduction] + [("integration", line) for line in self.integration]
        names = "error", "uncertainty", "remark"
        return dataframe([
            {"part": part} | line.choice._asdict() | {name: getattr(line, name) for name in names}
            | {"coordinates": line.measured.coordinates, "seconds": line.measured.seconds}
            for part, line in lines
        ])  # fmt: skip

    def figure(self) -> Figure:
        """Errors against coordinates and against rtol, with the tolerance."""
        from fembeam import plot

        return plot.smallest_model(self)


class NotMetError(RuntimeError):
    """The tolerance cannot be met; `evidence` (a `SmallestModel` without a model) says how far it went."""

    def __init__(self, evidence: SmallestModel) -> None:
        super().__init__(f"{evidence.quantity} to {evidence.tolerance:g}: {evidence.verdict}")
        self.evidence = evidence
