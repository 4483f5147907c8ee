"""A fold of a branch over a second number of the scene: where jumps are, and where two folds meet and vanish.

    x(T; x₀, λ, p) = x₀,    one multiplier 1

`solvers.branches.folds` follows the curve by its arc length, so that p may turn: at a cusp two folds meet, and on its
other side the motion no longer jumps.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from itertools import count
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fembeam import plot
from fembeam.model import Branch, Orbit, observed
from fembeam.model.branch import Family
from fembeam.plot.axis_names import axis_name, parameter_unit
from fembeam.scene import called, path_of, turns_at, value_of
from fembeam.study.execution.checkpoint import Checkpoint, study_identity
from fembeam.study.result import Result, with_units
from fembeam.support import Part, by_rows, counting, is_finite, is_whole, require
from solvers.branches import fold_curve
from solvers.problem import counted

Vector = NDArray[np.float64]
WHERE = "study.fold"
KEPT = 8  # values of p whose models are kept


@dataclass(frozen=True, eq=False, repr=False)
class Fold(Result):
    """A curve of folds over two numbers of the scene.

    Attributes
    ----------
    parameter, over : names of λ, along which the branch turns back, and of p.
    values, at : (k,) p and λ along the curve, from one end to the other; p need not ascend.
    amplitude : (k,) m, half the range of the displacement at z.
    orbits : the motions, ``mark`` "fold", or "cusp" where two folds meet.
    endings : how both directions ended, in words. titles : of p and λ, for axes.
    units : of p and λ, empty where not known.
    """

    INDEX: ClassVar[str] = "value"

    parameter: str
    over: str
    values: Vector
    at: Vector
    amplitude: Vector
    orbits: tuple[Orbit, ...] = field(repr=False)
    endings: tuple[str, ...]
    z: Any
    titles: tuple[str, str]
    units: tuple[str, str] = ("", "")

    @property
    def cusps(self) -> list[int]:
        """Numbers of the points at which two folds meet."""
        return [i for i, one in enumerate(self.orbits) if one.mark == "cusp"]

    def __repr__(self) -> str:
        span = f"{self.values.min():.6g} to {self.values.max():.6g}"
        return f"<folds along {self.parameter} over {self.over}, {span}, {counted(len(self.cusps), 'cusp')}>"

    def table(self) -> list[dict[str, Any]]:
        """A row for each point, in SI units."""
        marks = [one.mark for one in self.orbits]
        return by_rows({"value": self.values, "at": self.at, "amplitude": self.amplitude, "mark": marks})

    def plain(self) -> dict[str, Any]:
        """What was found, as JSON has it, without orbits."""
        return {"parameter": self.parameter, "over": self.over, "folds": self.table(), "endings": list(self.endings)}

    def _units(self) -> dict[str, str]:
        return {"value": self.units[0], "at": self.units[1], "amplitude": "rad" if turns_at(self.z) else "m"}

    def _parts(self) -> list[Part]:
        names = self.over, f"fold at {self.parameter}", "amplitude"
        head = *with_units(names, list(self._units().values())), ""
        rows = [(*list(row.values())[:-1], row["mark"] if row["mark"] == "cusp" else "") for row in self.table()]
        return [repr(self), (head, rows), "; ".join(dict.fromkeys(self.endings))]

    figure = plot.fold_curve


def fold(
    branch: Branch,
    over: str,
    span: tuple[float, float],
    number: int = 0,
    z: Any = None,
    progress: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Fold:
    """Follow a fold of a branch along a second number of its scene, both ways.

        x(T; x₀, λ, p) = x₀,   g(x₀, λ, p) = 0, which vanishes where 1 is a multiplier

    Parameters
    ----------
    branch : along λ, from `Model.branch`, computed as far as the fold.
    over : p, such as "forces[0].signal.amplitude"; paths as for `vary`.
    span : (lowest, highest) p, the present one among them.
    number : which of the folds of the branch, from 0.
    z : m, or (place, direction), of the displacement u; None: the first stop or element, else the tip.
    progress : show a bar of the folds found (on terminals and in notebooks only).
    checkpoint : file that keeps each fold; what it holds is not computed again.

    Returns
    -------
    Fold : ``values``, ``at``, ``amplitude``, ``orbits``, ``cusps``; print it, `table()`, `figure()`.

    Raises
    ------
    ValueError : no such fold, an unknown path, a span without the present value, the checkpoint of another study.
    solvers.OrbitError : there is no fold to rounding.

    Notes
    -----
    Motions are periodic to 1e-10, λ and p are right to 1e-8 of themselves. Where a contact grazes the curve ends, as
    the return map is not smooth there, and a closed one where it began; `endings` says so.

    References
    ----------
    W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (2000), chapters 3 and 4.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Polynomial
    >>> rod = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    >>> scene = fb.Scene(rod, [fb.Clamped(0.0)], elements=[fb.Element(0.5, Polynomial([0.0, 0.0, 2e7]))],
    ...                  forces=[fb.PointForce(0.5, fb.Harmonic(0.2, 190.0))], damping=fb.ModalDamping(0.01))
    >>> branch = scene.reduce(modes=1).branch("omega", (182.0, 192.0)).run()
    >>> found = fold(branch, "forces[0].signal.amplitude", (0.1, 0.21))
    >>> round(float(found.values[found.cusps[0]]), 4)  # below this force nothing jumps
    0.1196
    """
    model, name = branch.family.model, branch.family.name
    path = path_of(model.scene, over)
    require(path != name, "over must be another number than the parameter of the branch", over, WHERE, "name both")
    known = [one for one in branch.special if one.mark == "fold"]
    right = is_whole(number) and 0 <= number < len(known)
    require(bool(known), "the branch must have a fold", branch, WHERE, "branch.run() over a span with one")
    require(right, f"number must be one of the {len(known)} folds of the branch", number, WHERE, "count from 0")
    present = value_of(model.scene, path)
    within = np.shape(span) == (2,) and all(map(is_finite, span)) and span[0] <= present <= span[1]
    require(bool(within and span[0] < span[1]), f"span must hold the present value {present:.6g}", span, WHERE,
            "give (lowest, highest)")  # fmt: skip
    z = observed(model) if z is None else z
    model.phi(z)  # a place that does not exist is refused
    families = _Families(Family(model, path, branch.family.period), name)
    low, high = branch.found.walks[0].span
    ends, start = (float(span[0]), float(span[1])), known[number].found
    asked = {"parameter": name, "over": path, "span": ends, "width": high - low}
    begun = start.parameter, start.phase, start.period, start.whole, start.method
    kept = Checkpoint(checkpoint, lambda: study_identity(model, study="fold", **asked, fold=begun))
    answers = [kept.values[str(i)] for i in range(len(kept.values))]
    keys = map(str, count(len(answers)))
    with kept, counting(progress, unit=" folds") as bar:
        found = fold_curve(families, start, present, ends, high - low, seen=bar.update, known=answers,
                           keep=lambda one: kept.add(next(keys), one))  # fmt: skip
    orbits = tuple(
        Orbit(families.at(value).at(one.parameter), one, branch.family.period)
        for value, one in zip(found.values.tolist(), found.orbits, strict=True)
    )
    extremes = np.array([one.extremes(z) for one in orbits])
    at = np.array([one.parameter for one in orbits])
    titles = axis_name(path, model.scene), axis_name(name, model.scene)
    amplitude = 0.5 * (extremes[:, 1] - extremes[:, 0])
    units = parameter_unit(path, model.scene), parameter_unit(name, model.scene)
    return Fold(name, called(model.scene, over), found.values, at, amplitude, orbits, found.endings, z, titles, units)


@dataclass
class _Families:
    """A model with two numbers varied: (λ, p) -> (system, period)."""

    over: Family
    name: str
    kept: dict[float, Family] = field(default_factory=dict)

    def at(self, p: float) -> Family:
        """Along λ at a value of p; the latest are kept."""
        if p not in self.kept:
            while len(self.kept) >= KEPT:
                self.kept.pop(next(iter(self.kept)))
            self.kept[p] = Family(self.over.at(p), self.name, self.over.period)
        return self.kept[p]

    def __call__(self, first: float, second: float) -> Any:
        return self.at(second)(first)
