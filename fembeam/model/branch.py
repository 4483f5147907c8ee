"""Orbits of a model along one scalar of its scene; saved to a file and continued from it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam.model.equations import load_period
from fembeam.model.orbit import Orbit, checked_period, orbit
from fembeam.model.reduce import likeness, signed_like
from fembeam.scene import changes_structure, path_of, replaced, value_of
from fembeam.support import (
    Part,
    Printed,
    changes,
    counting,
    file_path,
    note,
    numbers,
    require,
    write_rows,
    written_whole,
)
from fembeam.support.fingerprint import fingerprint
from solvers.branches import recorded, restarted
from solvers.problem import counted, dataframe

if TYPE_CHECKING:
    from fembeam.model.model import Model

Vector = NDArray[np.float64]
RECORDED = {"name", "period", "scene", "digest", "modes", "omega", "walks"}  # of a saved branch
SAME = 1e-9  # relative: frequencies of one model, made again
ALIKE = 0.8  # cosine between shapes of a mode, from which on its sign is known
EVERY = 10.0  # s between two times a branch under way is saved
CLOSE = 1e-6  # arclength between two orbits found from the same start
SHORTEST = 2.0**-8  # share of a step in which signs are followed


@dataclass(frozen=True, eq=False)
class Family:
    """A model whose scene has one number varied: parameter -> (system, period), the form `solvers.branch` takes."""

    model: Model
    name: str
    period: int
    kept: dict[float, tuple[solvers.System, float]] = field(default_factory=dict, repr=False)
    known: dict[float, Model] = field(default_factory=dict, repr=False)  # by which signs of shapes are followed

    def __repr__(self) -> str:
        return f"<{self.model!r} along {self.name}, period {self.period}>"

    def at(self, parameter: float) -> Model:
        """The model at a value of the parameter; the signs of its shapes are followed from the family's own model."""
        if not changes_structure(self.name):
            return self.model.under(replaced(self.model.scene, self.name, parameter))
        if not self.known:
            self.known[value_of(self.model.scene, self.name)] = self.model
        return self._followed(parameter, self._again(parameter))

    def _again(self, parameter: float) -> Model:
        """The scene reduced anew: a shape whose node passes the watched place changes its sign there."""
        return self.model.again(replaced(self.model.scene, self.name, parameter))

    def _followed(self, parameter: float, model: Model) -> Model:
        """The model with signs followed from the nearest one known, in steps within which shapes stay alike."""
        at = min(tuple(self.known), key=lambda one: abs(one - parameter))  # other threads may add some
        near, step = self.known[at], parameter - at
        least = SHORTEST * abs(step)
        while likeness(model, near) < ALIKE:
            step *= 0.5
            if abs(step) <= least:  # frequencies that cross change places
                self.known[parameter] = model = signed_like(model, near)
                break
            between = signed_like(self._again(at + step), near)
            if likeness(between, near) >= ALIKE:
                at, near = at + step, between
                self.known[at], step = near, parameter - at
        return signed_like(model, near)

    def __call__(self, parameter: float) -> tuple[solvers.System, float]:
        """The system and its period, s; the latest are kept, because Newton's method asks for them again."""
        if parameter not in self.kept:
            model = self.at(parameter)
            while len(self.kept) >= 8:
                self.kept.pop(next(iter(self.kept)))
            self.kept[parameter] = model.system, self.period * load_period(model.scene)
        return self.kept[parameter]


@dataclass(frozen=True, eq=False)
class Branch(Printed):
    """Orbits along a parameter, computed as they are asked for; iterate over it, or call `run`.

    Attributes
    ----------
    family : the model and its varied parameter. found : the `solvers.Branch`.
    """

    family: Family
    found: solvers.Branch

    def _orbit(self, one: solvers.Orbit) -> Orbit:
        """One of the orbits, with the model it belongs to; made once."""
        known = self.found.kept
        if id(one) not in known:
            known[id(one)] = Orbit(self.family.at(one.parameter), one, self.family.period)
        return known[id(one)]  # type: ignore[no-any-return]

    def __iter__(self) -> Iterator[Orbit]:
        """Known orbits, then new ones."""
        return (self._orbit(one) for one in self.found)

    def run(self, progress: bool = False, checkpoint: str | Path | None = None) -> Branch:
        """Compute all of it; after Ctrl-C the orbits found are kept, and another call continues.

        With checkpoint it goes on from that file if there is one; ValueError if it is of another branch or scene. It is
        written as by `save` at once, every `EVERY` seconds, and at the end, whatever ends it.
        """
        if checkpoint is not None:
            self._take(file_path(checkpoint, "Branch.run"))
            self.save(checkpoint)  # what cannot be written is refused before it is computed
        try:
            with counting(progress, self.found, unit=" orbits") as bar:
                saved = monotonic()
                for one in bar:
                    bar.set_postfix_str(f"{self.family.name} = {one.parameter:.6g}", refresh=False)
                    if checkpoint is not None and monotonic() - saved > EVERY:
                        self.save(checkpoint)
                        saved = monotonic()
        finally:
            if checkpoint is not None:
                self.save(checkpoint)
        note("%r", self)
        return self

    def _take(self, path: Path) -> None:
        """Go on from a file, if there is one that knows more of this branch; ValueError for one of another."""
        if not path.is_file():
            return
        kept, mine = _record_for(self.family.model, path, "Branch.run"), self._record()
        said = changes(repr(_asked(kept)), repr(_asked(mine)))
        if not said and not self._begins_at(_first(kept)):
            there, here = (_first(one)["parameter"] for one in (kept, mine))
            said = f"its first orbit, at {there:.9g} there and {here:.9g} here, is another one"
        if said:
            raise ValueError(f"{path} belongs to another branch: {said}; set it back, delete the file to begin anew, "
                             "or choose another place")  # fmt: skip
        if _known(kept) > _known(mine):
            self.found.walks[:] = restarted(self.family, kept["walks"]).walks

    def _begins_at(self, first: dict[str, Any]) -> bool:
        """Whether a first point of as many shots is this branch's, to what Newton's method leaves."""
        mine = self.found.walks[0].first
        off = np.append(np.ravel(first["x"]), first["parameter"]) - mine.unknowns
        return mine.length(off) < CLOSE

    @property
    def orbits(self) -> list[Orbit]:
        """What is known so far, from one end of the branch to the other."""
        return [self._orbit(one) for one in self.found.orbits]

    @property
    def special(self) -> list[Orbit]:
        """Folds, flips, Neimark–Sacker, branch, grazing, stick, floor and merging points."""
        return [one for one in self.orbits if one.mark]

    @property
    def status(self) -> str:
        """How each direction ended, as sentences."""
        return "; ".join(self.found.endings)

    @property
    def ends(self) -> list[tuple[Orbit, str]]:
        """The last orbit of each direction, and in words how it ended."""
        pairs = zip(self.found.walks, self.found.endings, strict=False)
        return [(self._orbit(walk.orbits[-1]), words) for walk, words in pairs]

    @property
    def parameter(self) -> Vector:
        """(k,) values along the branch."""
        return np.array([one.parameter for one in self.found.orbits])

    @property
    def stable(self) -> Any:
        """(k,) whether each orbit is stable."""
        return np.array([one.stable for one in self.found.orbits])

    def extremes(self, z: float) -> Vector:
        """(k, 2) lowest and highest displacement at z, m."""
        return np.array([one.extremes(z) for one in self.orbits])

    def doubled(self, flip: Orbit) -> Branch:
        """The branch of twice the period that is born at a flip of this one."""
        family = replace(self.family, period=2 * self.family.period)
        return Branch(family, self.found.doubled(flip.found))

    def table(self) -> list[dict[str, Any]]:
        """One row per orbit: parameter, period, stability, largest multiplier, impacts, peaks, residual, mark."""
        rows = []
        for one in self.found.orbits:
            log, largest = one.contacts, one.transverse[0]
            rows.append({
                self.family.name: one.parameter,
                "period": self.family.period,
                "stable": one.stable,
                "largest multiplier": abs(largest),
                "its angle": float(np.angle(largest)),
                "impacts": len(log),
                "peak indentation": float(log.peak_indentation.max(initial=0.0)),
                "peak force": float(log.peak_force.max(initial=0.0)),
                "residual": one.residual,
                "mark": one.mark,
            })  # fmt: skip
        return rows

    def to_dataframe(self) -> Any:
        """The table as one of pandas, one orbit a row; ImportError without pandas."""
        return dataframe(self.table())

    def to_csv(self, path: str | Path) -> None:
        """Write the table, units in the heads of its columns; the file is written whole or not at all."""
        write_rows(file_path(path, "Branch.to_csv"), self.table(), self._units())

    def _units(self) -> dict[str, str]:
        """Units of the columns that have one."""
        from fembeam.plot.axis_names import parameter_unit

        name, log = self.family.name, self._orbit(self.found.orbits[0]).contacts
        peaks = {words: log.unit(words.replace(" ", "_")) for words in ("peak indentation", "peak force")}
        return {name: parameter_unit(name, self.family.model.scene), "its angle": "rad"} | peaks

    def __repr__(self) -> str:
        known = self.parameter
        span = f"{self.family.name} = {known.min():.6g} to {known.max():.6g}"
        return f"<branch of {counted(len(known), 'orbit')} of period {self.family.period}, {span}: {self.status}>"

    def _parts(self) -> list[Part]:
        """Special orbits and how each direction ended."""
        found = [(one, one.mark) for one in self.found.special] + [(one.found, "end") for one, _ in self.ends]
        rows = [(mark, f"{one.parameter:.9g}", "yes" if one.stable else "no") for one, mark in found]
        stable = int(np.sum(self.stable))
        count = f"{len(self.found.special)} special among {counted(len(self.parameter), 'orbit')}"
        head = f"{count} of period {self.family.period}, {stable} stable"
        return [head, (("", self.family.name, "stable"), rows), self.status]

    def save(self, path: str | Path) -> None:
        """Write all that is known as .npz, enough to go on as if it had not been saved; whole or not at all."""
        with written_whole(file_path(path, "Branch.save")) as file:
            np.savez_compressed(file, branch=np.array(json.dumps(self._record())))

    def _record(self) -> dict[str, Any]:
        """All that is known as numbers, lists and text."""
        model = self.family.model
        return {
            **{"name": self.family.name, "period": self.family.period},
            **{"scene": repr(model.scene), "digest": _digest(model)},
            **{"modes": list(model.modes), "omega": model.omega.tolist(), "walks": recorded(self.found)},
        }


def follow(
    model: Model,
    parameter: str,
    span: tuple[float, float],
    period: int,
    start: ArrayLike | Orbit | None,
    at: float | None,
    options: dict[str, Any],
) -> Branch:
    """See `Model.branch`."""
    family = Family(model, path_of(model.scene, parameter), checked_period(period))
    low, high = _checked_span(span)
    if at is None:
        present = start.parameter if isinstance(start, Orbit) else np.nan
        at = value_of(model.scene, family.name) if np.isnan(present) else present
        at = at if low <= at <= high else low
    first = start if isinstance(start, Orbit) else orbit(family.at(at), family.period, start, None)
    return Branch(family, solvers.branch(family, (low, high), first.found, at=at, **options))


def _checked_span(span: Any) -> tuple[float, float]:
    """The two ends; ValueError for what is no span."""
    where, advice = "Model.branch", "give (lowest, highest)"
    ends = numbers("span", span, where, advice)
    right = ends.shape == (2,) and bool(ends[0] < ends[1]) and bool(np.isfinite(ends).all())
    require(right, "span must be two values, ascending", span, where, advice)
    return float(ends[0]), float(ends[1])


def resumed(model: Model, path: str | Path) -> Branch:
    """A saved branch of this model, to be continued."""
    record = _record_for(model, file_path(path, "Model.resume"), "Model.resume")
    family = Family(model, record["name"], record["period"])
    return Branch(family, restarted(family, record["walks"]))


def _record_for(model: Model, path: Path, where: str) -> dict[str, Any]:
    """What a saved branch of this model knows; ValueError for one of another scene."""
    record = _record_of(path, where)
    differing = [
        changes(record["scene"], repr(model.scene)),
        changes(repr(tuple(record["modes"])), repr(tuple(model.modes)), "modes"),
    ]
    omega = np.array(record["omega"])
    same = omega.shape == model.omega.shape and bool(np.allclose(omega, model.omega, rtol=SAME, atol=0.0))
    if not same and not any(differing):
        differing = [f"the frequencies, {omega} there and {model.omega} here in rad/s, of another mesh"]
    if record["digest"] != _digest(model) and not any(differing):
        differing = ["a law, a signal or fembeam itself has other code, or reads other values, than there"]
    if said := "; ".join(filter(None, differing)):
        raise ValueError(f"{path} belongs to another scene: {said}; set it back, delete the file to begin anew, "
                         "or choose another place")  # fmt: skip
    return record


def _asked(record: dict[str, Any]) -> dict[str, Any]:
    """What a branch was asked for, besides its first orbit."""
    walk = record["walks"][0]
    shots = len(walk["problems"][_first(record)["problem"]]["fractions"])
    asked = {"parameter": record["name"], "period": record["period"], "span": list(walk["span"])}
    return asked | {"step": walk["largest"], "shots": shots, "directions": len(record["walks"])} | walk["method"]


def _first(record: dict[str, Any]) -> dict[str, Any]:
    """The point a branch began at."""
    walk = record["walks"][0]
    return dict(walk["points"][walk["first"]])


def _known(record: dict[str, Any]) -> int:
    """How many orbits it knows in both directions."""
    return sum(len(walk["orbits"]) for walk in record["walks"])


def _digest(model: Model) -> str:
    """Digest of the scene; "" of one that cannot be told from another, whose branch is saved all the same."""
    with suppress(ValueError):
        return fingerprint(model.scene, "the scene")
    return ""


def _record_of(path: Path, where: str) -> dict[str, Any]:
    """What a saved branch knows; ValueError for another file, or a damaged one."""
    advice = "give what Branch.save wrote" + (", or choose another place" if where == "Branch.run" else "")
    try:
        with np.load(path, allow_pickle=False) as file:
            require("branch" in file, f"{path} holds no branch", sorted(file), where, advice)
            record = json.loads(str(file["branch"]))
        missing = sorted(RECORDED - set(record))
        require(not missing, f"{path} must hold all of a branch, {missing} are missing", sorted(record),
                where, advice)  # fmt: skip
    except Exception as error:  # a byte of the archive's own lists has many ways to be wrong
        said = str(error)
        if said.startswith(str(path)) or getattr(error, "filename", None) is not None:
            raise
        raise ValueError(f"{path} is not a saved branch, or is damaged: {said}; {advice}") from None
    return dict(record)
