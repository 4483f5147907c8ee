"""The search for the smallest model: which runs are made, and in which order."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

import solvers
from fembeam.study.execution.executors import spread
from fembeam.study.measure import Case, Measured, Plan, measure
from fembeam.study.mode_count import difference
from fembeam.study.quantities import Quantity, label
from fembeam.study.smallest_model_result import Choice, Evidence, NotMetError, SmallestModel
from fembeam.support import require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fembeam.scene import Scene

RUNGS = ((1, 2, 3, 4, 6, 8), (12, 16), (24, 32), (48, 64), (96, 128))
TIGHT = 1e-10  # rtol of all models while modes are counted
RTOLS = tuple(10.0**-k for k in range(2, 10))
REDUCTION_SHARE = 0.7  # of the tolerance that modes may use up; integration gets what is left


@dataclass(frozen=True, eq=False)
class Search:
    """The search; `seen` keeps every model measured."""

    scene: Scene
    quantity: Quantity
    plan: Plan
    tolerance: float
    most: int
    kinds: tuple[bool, ...]
    executor: Executor | None
    seen: dict[Choice, Measured] = field(default_factory=dict)

    def answer(self) -> SmallestModel:
        """Candidates from small to large; the first that holds in every respect."""
        rejected: set[Choice] = set()
        for rung in self._rungs():
            self._measured([Choice(n, kind, TIGHT) for kind in self.kinds for n in rung])
            while (found := self._candidate(rejected)) is not None:
                if (result := self._settled(found)) is not None:
                    return result
                rejected.add(found)
        raise NotMetError(self._failure(rejected))

    def _rungs(self) -> list[list[int]]:
        """Counts to be tried, in batches, up to twice `most`."""
        return [batch for rung in RUNGS if (batch := [n for n in rung if n <= max(2 * self.most, 2)])]

    def _measured(self, choices: Sequence[Choice]) -> list[Measured]:
        """Every model measured, the new ones spread over the executor."""
        new = [choice for choice in choices if choice not in self.seen]
        models = dict.fromkeys(choice[:2] for choice in new)  # one reduction serves all tolerances
        groups = [[choice for choice in new if choice[:2] == model] for model in models]
        items = [
            Case(self.scene, (("modes", n), ("residual", kind)), self.plan, self.quantity,
                 tuple(solvers.Exponential(choice.rtol, ledger=False) for choice in group))
            for (n, kind), group in zip(models, groups, strict=True)
        ]  # fmt: skip
        if items:
            found = spread(measure, items, self.executor, f"smallest model for {label(self.quantity)}")
            for group, measured in zip(groups, found, strict=True):
                self.seen.update(zip(group, measured, strict=True))
        return [self.seen[choice] for choice in choices]

    def _reference(self) -> Choice:
        """The finest model measured so far."""
        return max((c for c in self.seen if c.rtol == TIGHT), key=lambda c: (c.modes, c.residual))

    def _errors(self) -> list[Evidence]:
        """Distance of every model from the finest one, small models first."""
        reference = self._reference()
        finest = self.seen[reference]
        scale = float(np.linalg.norm(finest.mean))
        require(0 < scale < np.inf, "the reference value must be finite and not zero", finest.mean, "smallest_model",
                "does anything happen in this run? is there contact?")  # fmt: skip
        tight = [choice for choice in self.seen if choice.rtol == TIGHT]
        lines = []
        for choice in sorted(tight, key=lambda c: (c.residual, c.modes)):
            each = self.seen[choice]
            shape, same = finest.values.shape[1:], each.values.shape == finest.values.shape
            require(same, f"quantity must return one shape, {shape}", each.values.shape[1:], "smallest_model",
                    "return a fixed number of values")  # fmt: skip
            remark = "reference" if choice == reference else ""
            lines.append(Evidence(choice, each, *difference(each, finest), remark))
        return lines

    def _gap(self) -> float:
        """How far the finest model may be from all modes: its resolved distance from the next finest of its kind."""
        reference = self._reference()
        others = [c for c in self.seen if c.rtol == TIGHT and c.residual == reference.residual and c != reference]
        if not others:
            return float("inf")
        error, uncertainty = difference(self.seen[max(others)], self.seen[reference])
        return max(error - uncertainty, 0.0)

    def _candidate(self, rejected: set[Choice]) -> Choice | None:
        """The smallest model, at most half the finest, that agrees with all finer ones of its kind and the finest."""
        limit, errors = REDUCTION_SHARE * self.tolerance - self._gap(), self._errors()
        good: list[Evidence] = []
        for kind in self.kinds:
            mine = [line for line in errors if line.choice.residual == kind]
            failing = [line.choice.modes for line in mine if line.bound > limit]
            above = max(failing, default=0)
            most = min(self.most, mine[-1].choice.modes // 2)
            upper = min((line.choice.modes for line in mine if line.choice.modes > above), default=most + 1)
            if upper <= most:
                inside = [Choice(n, kind, TIGHT) for n in range(above + 1, upper)]
                if any(choice not in self.seen for choice in inside):
                    self._measured(inside)
                    return self._candidate(rejected)
                good += [line for line in mine if above < line.choice.modes <= most and line.choice not in rejected]
        order = sorted(good, key=lambda line: (line.measured.coordinates, line.error))
        return order[0].choice if order else None

    def _settled(self, found: Choice) -> SmallestModel | None:
        """The answer with the loosest rtol for a candidate, None when integration or the final check refuse it."""
        reduction = next(line for line in self._errors() if line.choice == found)
        left = self.tolerance - reduction.bound - self._gap()
        choices = [found._replace(rtol=rtol) for rtol in RTOLS]
        exact = self.seen[found]
        lines = [
            Evidence(choice, each, *difference(each, exact))
            for choice, each in zip(choices, self._measured(choices), strict=True)
        ]
        for index, line in enumerate(lines):
            tighter_too = all(tighter.error - tighter.uncertainty <= left for tighter in lines[index:])
            if line.bound <= left and tighter_too:
                checked = self._checked(line.choice)
                if checked <= self.tolerance:
                    return self._result(line, reduction, lines, checked)
        return None

    def _checked(self, choice: Choice) -> float:
        """Distance, uncertainty included, from twice the modes at a hundredth of rtol."""
        finer = Choice(2 * choice.modes, choice.residual, choice.rtol / 100)
        one, other = self._measured([choice, finer])
        return float(sum(difference(one, other)))

    def _result(self, line: Evidence, reduction: Evidence, lines: list[Evidence], checked: float) -> SmallestModel:
        """The answer."""
        choice, bounds = line.choice, (reduction.bound + self._gap(), line.bound)
        verdict = (
            f"{_words(choice)}, rtol = {choice.rtol:.0e}; error {sum(bounds):.2e} = {bounds[0]:.2e} reduction + "
            f"{bounds[1]:.2e} integration; {checked:.2e} off twice the modes at rtol/100"
        )
        return SmallestModel(
            label(self.quantity), self.tolerance, verdict, tuple(self._errors()), tuple(lines), True, choice,
            self.scene.reduce(modes=choice.modes, residual=choice.residual), line.measured.mean, *bounds, checked,
        )  # fmt: skip

    def _failure(self, rejected: set[Choice]) -> SmallestModel:
        """Why there is no answer, in a sentence."""
        errors = self._errors()
        offered = [line for line in errors if line.choice.modes <= self.most and not line.remark]
        best = min(offered, key=lambda line: line.bound)
        off = f"the best of up to {self.most} modes is off by {best.error:.2e}"
        if rejected:
            verdict = "it does not settle as rtol goes to 0 (chaos?); use an average over seeds, or a shorter run"
        elif best.uncertainty > best.error:
            verdict = f"scatter hides it, {off} ± {best.uncertainty:.1e}; use more seeds or longer runs"
        else:
            verdict = f"modes converge too slowly, {off} ({_words(best.choice)})"
        verdict = f"NOT MET: {verdict}"
        return SmallestModel(label(self.quantity), self.tolerance, verdict, tuple(errors))


def _words(choice: Choice) -> str:
    """A choice of modes as text."""
    return f"{choice.modes} mode{'s' * (choice.modes > 1)}" + " with static shapes" * choice.residual
