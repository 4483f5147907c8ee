"""The smallest model that gives a quantity to a tolerance, with the evidence.

The total error of a model with n modes at tolerance rtol is split and bounded by measurement:

    |x(n, rtol) - x(∞, 0)| ≤ |x(n) - x(n_ref)| + |x(n_ref) - x(∞)| + |x(n, rtol) - x(n, rtol → 0)|
                               reduction                                  integration

where the distance of the finest model n_ref from the next finest stands for its distance from all modes. Counts climb
a ladder 1, 2, 3, 4, 6, 8, … until one of them agrees with everything finer, up to at least twice its modes; then the
gap below it is filled in, rtol is loosened as far as the rest of the tolerance allows, and the answer is checked
against twice the modes and a hundredth of rtol.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import solvers
from fembeam import plot
from fembeam.model import Model
from fembeam.scene import Scene
from fembeam.study.execution.checkpoint import Checkpoint
from fembeam.study.measure import Case, Measured, Plan, Start, identity_of, measured
from fembeam.study.mode_count import check_comparable, difference, kinds_of
from fembeam.study.quantities import Quantity, label, named
from fembeam.study.result import Result
from fembeam.support import Part, is_finite, is_whole, require, titled

HEAD = "modes", "static", "rtol", "value", "error", "± (95 %)", "seconds", ""
MOST = 64  # modes offered as an answer; the ladder goes twice as far
RUNGS = ((1, 2, 3, 4, 6, 8), (12, 16), (24, 32), (48, 64), (96, 128))
TIGHT = 1e-10  # rtol of all models while modes are counted
RTOLS = tuple(10.0**-k for k in range(2, 10))
REDUCTION_SHARE = 0.7  # of the tolerance that modes may use up; integration gets what is left


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
        return (
            str(self.choice.modes), "yes" if self.choice.residual else "no", f"{self.choice.rtol:.0e}",
            f"{self.measured.value:.6g}", f"{self.error:.2e}",
            f"{self.uncertainty:.1e}" if self.uncertainty else "", f"{self.measured.seconds:.3g}", self.remark,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class SmallestModel(Result):
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
        for title in ("reduction", "integration"):
            if lines := getattr(self, title):
                parts += [f"\n{title}:", (HEAD, [line.cells() for line in lines])]
        return parts

    def table(self) -> list[dict[str, Any]]:
        """The lines of evidence."""
        return [
            {"part": part, **line.choice._asdict(), "error": line.error, "uncertainty": line.uncertainty,
             "remark": line.remark, "coordinates": line.measured.coordinates, "seconds": line.measured.seconds}
            for part in ("reduction", "integration")
            for line in getattr(self, part)
        ]  # fmt: skip

    figure = plot.smallest_model


class NotMetError(RuntimeError):
    """The tolerance cannot be met; `evidence` (a `SmallestModel` without a model) says how far it went."""

    def __init__(self, evidence: SmallestModel) -> None:
        super().__init__(f"{evidence.quantity} to {evidence.tolerance:g}: {evidence.verdict}")
        self.evidence = evidence


def smallest_model(
    scene: Scene,
    quantity: str | Quantity,
    tolerance: float,
    duration: float | None = None,
    dt: float | None = None,
    discard: float = 0.0,
    seeds: Sequence[int] = (),
    residual: bool | None = None,
    most: int = MOST,
    start: Start | None = None,
    executor: Executor | None = None,
    elements: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> SmallestModel:
    """The fewest coordinates and the loosest rtol that give a quantity to a relative tolerance.

    Parameters
    ----------
    scene, quantity, duration, dt, discard, seeds, residual, start, executor, elements, progress : as for `mode_count`.
    tolerance : relative, in (0, 1); of the norm if the quantity is an array.
    most : modes that an answer may have, 1 to 64. checkpoint : as for `mode_count`, of each model.

    Returns
    -------
    SmallestModel : model, solver settings, errors split into reduction and integration, evidence, figure.

    Raises
    ------
    ValueError : tolerance or most out of range, and what `mode_count` refuses.
    NotMetError : no such model up to `most`; the message says whether modes, scatter or chaos are to blame, and its
        `evidence` holds the tables.

    Notes
    -----
    Modes may use up 0.7 of the tolerance, and the model found is the smallest that keeps within it with all finer ones
    of its kind, so that no chance hit counts. Errors of random responses and of chaotic ones are bounded with 97.5 % at
    each comparison: they count with their uncertainty. Rungs between 8 and 64 are not all tried unless they border on
    the answer, so a quantity that converges unevenly may have a smaller model than the one found; the one found is
    checked.

    Examples
    --------
    >>> from fembeam import Beam, Clamped, Harmonic, ModalDamping, Scene, Section
    >>> steel = Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    >>> scene = Scene(Beam(0.26, steel), [Clamped(0.0)], damping=ModalDamping(0.05), base=Harmonic(1e-3, 100.0))
    >>> smallest_model(scene, "amplitude", tolerance=0.01).modes
    1
    """
    check_goal(tolerance, most)
    plan, kept = Plan(duration, dt, discard, seeds, start), named(quantity)
    plan.check(scene, kept)
    finished = Checkpoint(checkpoint, partial(identity_of, scene, plan, kept))
    told = titled(progress, f"smallest model for {label(kept)}")
    search = Search(
        scene, kept, plan, float(tolerance), int(most), kinds_of(scene, residual), executor, elements, finished, told
    )
    with finished:
        return search.answer()


def check_goal(tolerance: float, most: int) -> None:
    """Raise ValueError unless the tolerance is a part and `most` a count that the ladder reaches."""
    where, part = "smallest_model", is_finite(tolerance) and 0 < tolerance < 1
    require(part, "tolerance must lie in (0, 1)", tolerance, where, "e.g. 0.01")
    reached = is_whole(most) and 1 <= most <= MOST
    require(reached, f"most must be a whole number, 1 to {MOST}", most, where, "e.g. 20")


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
    elements: int | None
    finished: Checkpoint
    told: str | None
    seen: dict[Choice, Measured] = field(default_factory=dict)

    def answer(self) -> SmallestModel:
        """Candidates from small to large; the first that holds in every respect."""
        rejected: set[Choice] = set()
        for rung in RUNGS:
            counts = [n for n in rung if n <= max(2 * self.most, 2)]
            self._measured([Choice(n, kind, TIGHT) for kind in self.kinds for n in counts])
            while (found := self._candidate(rejected)) is not None:
                if (result := self._settled(found)) is not None:
                    return result
                rejected.add(found)
        raise NotMetError(self._failure(rejected))

    def _measured(self, choices: Sequence[Choice]) -> list[Measured]:
        """Every model measured, the new ones spread over the executor."""
        new = [choice for choice in choices if choice not in self.seen]
        models = dict.fromkeys(choice[:2] for choice in new)  # one reduction serves all tolerances
        groups = [[choice for choice in new if choice[:2] == model] for model in models]
        items = [
            Case(self.scene, (("modes", n), ("residual", kind), *self._mesh.items()), self.plan, self.quantity,
                 tuple(solvers.Exponential(choice.rtol, ledger=False) for choice in group))
            for (n, kind), group in zip(models, groups, strict=True)
        ]  # fmt: skip
        if items:
            found = measured(items, self.executor, self.told, self.finished)
            for group, each in zip(groups, found, strict=True):
                self.seen.update(zip(group, each, strict=True))
        return [self.seen[choice] for choice in choices]

    @property
    def _mesh(self) -> dict[str, Any]:
        """The argument of `Scene.reduce` for a mesh that was asked for."""
        return {} if self.elements is None else {"elements": self.elements}

    def _reference(self) -> Choice:
        """The finest model measured so far."""
        return max((c for c in self.seen if c.rtol == TIGHT), key=lambda c: (c.modes, c.residual))

    def _errors(self) -> list[Evidence]:
        """Distance of every model from the finest one, small models first."""
        reference = self._reference()
        finest, tight = self.seen[reference], {c: each for c, each in self.seen.items() if c.rtol == TIGHT}
        check_comparable({f"smallest_model, {_words(choice)}": each for choice, each in tight.items()}, finest)
        return [
            Evidence(choice, tight[choice], *difference(tight[choice], finest), "reference" * (choice == reference))
            for choice in sorted(tight, key=lambda c: (c.residual, c.modes))
        ]

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
        errors, limit = self._errors(), REDUCTION_SHARE * self.tolerance - self._gap()
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
        model = self.scene.reduce(choice.modes, residual=choice.residual, **self._mesh)
        return SmallestModel(
            label(self.quantity), self.tolerance, verdict, tuple(self._errors()), tuple(lines), True, choice,
            model, line.measured.mean, *bounds, checked,
        )  # fmt: skip

    def _failure(self, rejected: set[Choice]) -> SmallestModel:
        """Why there is no answer, in a sentence."""
        errors = self._errors()
        offered = [line for line in errors if line.choice.modes <= self.most and not line.remark]
        best = min(offered, key=lambda line: line.bound)
        finer = [one for one in errors if one.choice.residual == best.choice.residual and one.choice > best.choice]
        worst = max(finer, key=lambda line: line.bound)
        off = f"the best of up to {self.most} modes is off by {best.error:.2e}"
        if rejected:
            verdict = "it does not settle as rtol goes to 0 (chaos?); use an average over seeds, or a shorter run"
        elif best.bound <= self.tolerance < worst.bound:
            verdict = (
                f"it does not settle with modes (a contact that grazes?), {_words(best.choice)} are off by "
                f"{best.error:.2e} and {_words(worst.choice)} by {worst.error:.2e}; use a mean over "
                "more, or a quantity that does not jump"
            )
        elif best.uncertainty > best.error:
            verdict = f"scatter hides it, {off} ± {best.uncertainty:.1e}; use more seeds or longer runs"
        else:
            verdict = f"modes converge too slowly, {off} ({_words(best.choice)})"
        verdict = f"NOT MET: {verdict}"
        return SmallestModel(label(self.quantity), self.tolerance, verdict, tuple(errors))


def _words(choice: Choice) -> str:
    """A choice of modes as text."""
    return f"{choice.modes} mode{'s' * (choice.modes > 1)}" + " with static shapes" * choice.residual
