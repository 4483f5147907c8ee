"""How many modes a quantity needs: the convergence study.

    error(n) = ‖mean(x_n - x_ref)‖ / ‖mean x_ref‖,        observed rate p: error ~ n^-p

Random responses of all counts are driven by the same seeds, so that differences are paired: what the realisations
have in common cancels. The uncertainty of an error is the 95 % half-width of the mean difference (Student's t); an
error below it is noise and is marked so.

A single transient has no scatter. There the reference is run a second time at ten times the tolerance: errors not well
above the resulting change may be due to rounding, as in chaotic motion, and the study says so.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

import solvers
from fembeam import plot
from fembeam.model import check_mode_count
from fembeam.scene import Scene
from fembeam.study.execution.checkpoint import Checkpoint
from fembeam.study.measure import Case, Measured, Plan, Start, identity_of, measured
from fembeam.study.quantities import Quantity, label, named, unit_of
from fembeam.study.result import Result, with_units
from fembeam.support import Part, is_listed, is_whole, require, titled, warn
from solvers.problem import counted

LOOSER = 10.0  # times the tolerance, in the second run of the reference
LOOSEST = 1e-2  # the largest tolerance that methods take
NEGLIGIBLE = 1e-5  # relative change by it that only a sensitive motion exceeds: others, some 1e-7
MARGIN = 10.0  # one change is one draw of chance, and another may be larger
HEAD = "modes", "static", "coordinates", "{}", "error", "± (95 %)", "static share", "periods", "seconds", ""


@dataclass(frozen=True, eq=False)
class Row:
    """One model of the study.

    Attributes
    ----------
    modes, residual : what was asked for; modes is None for all modes of the mesh.
    value : mean of the quantity, ‖·‖/√size of an array.
    error, uncertainty : relative to the reference; NaN where the quantity is not defined (no contact, say).
    reference : whether this is the reference itself.
    measured : values, coordinates, seconds, static share, periods of the highest frequency in a contact.
    """

    modes: int | None
    residual: bool
    value: float
    error: float
    uncertainty: float
    reference: bool
    measured: Measured

    @property
    def resolved(self) -> bool:
        """Whether the error stands out of its uncertainty."""
        return not self.reference and self.error > self.uncertainty

    @property
    def bound(self) -> float:
        """Error + uncertainty: not exceeded, with 97.5 %."""
        return self.error + self.uncertainty

    def cells(self) -> tuple[str, ...]:
        """The row of the printed table."""
        m = self.measured
        remark = "reference" if self.reference else "" if self.resolved or not self.uncertainty else "within noise"
        if not np.isfinite(self.error):
            remark = "not defined"
        return (
            "all" if self.modes is None else str(self.modes), "yes" if self.residual else "no", str(m.coordinates),
            f"{self.value:.6g}", "" if self.reference else f"{self.error:.2e}",
            f"{self.uncertainty:.1e}" if self.uncertainty else "", f"{m.share:.6f}", f"{m.periods:.3g}",
            f"{m.seconds:.3g}", remark,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ModeCount(Result):
    """A convergence study; print it for the table.

    Attributes
    ----------
    quantity : its name.
    rows : one per count and kind, modes alone first; the reference is among them.
    rate, rate_residual : observed p in error ~ n^-p, without and with static shapes; NaN when fewer than two errors
        are resolved.
    closest : error of the row next finest to the reference: the reference itself is hardly better than this.
    sensitivity : relative change of the reference at ten times the tolerance; None where scatter tells (several
        realisations, or a periodic response), or the solver's step is fixed.
    doubt : a sentence where errors are below ten times the sensitivity, else "".
    unit : of the values, SI, empty where it is not known.
    """

    quantity: str
    rows: tuple[Row, ...]
    sensitivity: float | None = None
    unit: str = ""

    @property
    def rate(self) -> float:
        """Observed rate of modes alone."""
        return observed_rate([row for row in self.rows if not row.residual])

    @property
    def rate_residual(self) -> float:
        """Observed rate with residual shapes."""
        return observed_rate([row for row in self.rows if row.residual])

    @property
    def closest(self) -> float:
        """Error of the finest row that is not the reference."""
        others = [row for row in self.rows if not row.reference]
        return max(others, key=lambda row: row.measured.coordinates).error if others else float("nan")

    @property
    def doubt(self) -> str:
        """Which errors are within the sensitivity to the tolerance; "" for none."""
        if self.sensitivity is None or self.sensitivity <= NEGLIGIBLE:
            return ""
        errors = [row.error for row in self.rows if not row.reference and np.isfinite(row.error)]
        hidden = sum(not error > MARGIN * self.sensitivity for error in errors)
        if not hidden:
            return ""
        return (
            f"{hidden} of {len(errors)} errors may be chance, not modes: at {LOOSER:g} times the tolerance "
            f"{self.quantity} of the reference changes by {self.sensitivity:.1e} (chaos?); "
            "use an average over seeds, or a shorter run"
        )

    def row(self, modes: int | None, residual: bool = False) -> Row:
        """One row; ValueError when it is not in the study."""
        for row in self.rows:
            if (row.modes, row.residual) == (modes, residual):
                return row
        names = [(row.modes, row.residual) for row in self.rows]
        raise ValueError(f"no row with {modes} modes, residual={residual}, in this study; rows are {names}")

    def __repr__(self) -> str:
        return f"<convergence of {self.quantity} with modes, {counted(len(self.rows), 'model')}>"

    def _parts(self) -> list[Part]:
        rates = f"observed rate: {self.rate:.2f} modes alone, {self.rate_residual:.2f} with static shapes"
        doubt: list[Part] = [f"IN DOUBT: {self.doubt}"] if self.doubt else []
        value = with_units(["value"], [self.unit])[0]
        head = tuple(name.format(value) for name in HEAD)
        return [self.quantity, (head, [row.cells() for row in self.rows]), rates, *doubt]

    def table(self) -> list[dict[str, Any]]:
        """The rows."""
        names = "modes", "residual", "value", "error", "uncertainty", "reference"
        measured = "coordinates", "share", "periods", "seconds"
        return [
            {name: getattr(row, name) for name in names} | {name: getattr(row.measured, name) for name in measured}
            for row in self.rows
        ]

    def _units(self) -> dict[str, str]:
        return {"value": self.unit}

    figure = plot.mode_count


def mode_count(
    scene: Scene,
    counts: Iterable[int],
    quantity: str | Quantity,
    duration: float | None = None,
    dt: float | None = None,
    discard: float = 0.0,
    seeds: Sequence[int] = (),
    residual: bool | None = None,
    reference: int | Literal["full"] | None = None,
    start: Start | None = None,
    solver: Any = None,
    executor: Executor | None = None,
    elements: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> ModeCount:
    """How a quantity converges with the number of modes.

    Parameters
    ----------
    scene : Scene.
    counts : numbers of modes, each ≥ 1.
    quantity : a name of `quantities`, or a function of a run that gives a number or an array.
    duration : s; None: the settled response to harmonic motion (120 drive periods in ten groups, after 240, or after
        14 correlation times of the structure if that is longer).
    dt : output sampling in s; None keeps contact log and end only, enough for forces, contact times, impact rates.
        Without duration None takes 128 samples of a period, or 16 of its fastest tone and of the lowest mode.
    discard : s at the beginning that the quantity does not see; the times it sees count from there. Without duration
        the least time to settle.
    seeds : of the noise, three or more; the same for all counts.
    residual : with static shapes of stops and forces (True), without (False), both (None, if there are any).
    reference : a count, or "full" for all modes of the finest count's mesh; None: the finest of the counts.
    start : function of a model that gives its initial state, such as ``lambda m: m.state(velocity=…)``; None: rest.
    solver : one of `solvers`; None: `Exponential(1e-8)` without energy balance.
    executor : any `concurrent.futures.Executor`; counts are spread over it.
    elements : of the mesh of all counts; None: for each as few as make its frequencies right to 1e-6.
    checkpoint : file that keeps each count; what it holds is not computed again, also of other counts. It is
        refused when scene, quantity or runs differ.
    progress : show a bar (on terminals and in notebooks only).

    Returns
    -------
    ModeCount : table, rates, figure.

    Raises
    ------
    ValueError : no counts, counts below 1 or beyond the dofs, a quantity that changes its shape or is zero, NaN or
        infinite for the reference, runs that cannot be made like this. SolverError when a run fails.

    Warns
    -----
    UserWarning : the quantity of a single transient depends on the tolerance more than on the modes, as in chaos.

    Notes
    -----
    Frequencies of every model are right to 1e-6 by its own mesh; smaller errors than that are not resolved. Long
    chaotic transients do not converge as trajectories: use averages over seeds. Several attractors may coexist under
    harmonic motion; two counts may settle on different ones.

    Examples
    --------
    >>> from fembeam.study.quantities import PROBABILITIES
    >>> from fembeam import Beam, Clamped, Harmonic, ModalDamping, Scene, Section
    >>> steel = Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    >>> scene = Scene(Beam(0.26, steel), [Clamped(0.0)], damping=ModalDamping(0.05), base=Harmonic(1e-3, 100.0))
    >>> study = mode_count(scene, [1, 2, 4], "amplitude")
    >>> study.row(2).error < study.row(1).error < 0.01
    True
    """
    kept, chosen = named(quantity), checked_counts(counts)
    plan = Plan(duration, dt, discard, seeds, start, solver)
    plan.check(scene, kept)
    kinds = kinds_of(scene, residual)
    mesh = {} if elements is None else {"elements": elements}
    arguments: list[dict[str, Any]] = [{"modes": n, "residual": kind, **mesh} for kind in kinds for n in chosen]
    if reference == "full":
        arguments.append({"modes": "all", "elements": scene.matrices(elements, max(chosen)).elements})
    elif reference is not None:
        chosen = sorted({*chosen, *checked_counts([reference], "reference")})
        arguments.append({"modes": reference, "residual": kinds[-1], **mesh})
    check_mode_count(scene, max(chosen), elements)
    arguments = [a for i, a in enumerate(arguments) if a not in arguments[:i]]
    finest = arguments[-1] if reference is not None else {"modes": max(chosen), "residual": kinds[-1], **mesh}
    method = solvers.Exponential(ledger=False) if solver is None else solver
    items = [
        Case(scene, tuple(a.items()), plan, kept, (method, *(_looser(method, plan) if a == finest else ())))
        for a in arguments
    ]
    finished = Checkpoint(checkpoint, partial(identity_of, scene, plan, kept))
    with finished:
        found = measured(items, executor, titled(progress, f"modes for {label(kept)}"), finished)
    exact, *loose = found[arguments.index(finest)]
    rows = _rows(arguments, [first for first, *_ in found], exact)
    study = ModeCount(label(kept), rows, _change(loose[0], exact) if loose else None, unit_of(kept, scene))
    if study.doubt:
        warn(study.doubt)
    return study


def _looser(method: Any, plan: Plan) -> tuple[Any, ...]:
    """The method at ten times the tolerance, for a single transient; nothing where scatter tells as much."""
    adjustable = is_dataclass(method) and any(f.name == "rtol" for f in fields(method))
    if plan.seeds or plan.duration is None or not adjustable:
        return ()
    return (replace(method, rtol=min(LOOSER * method.rtol, LOOSEST)),)


def _change(one: Measured, other: Measured) -> float:
    """Relative distance of two values; infinite when they cannot be compared."""
    error = difference(one, other)[0] if one.values.shape == other.values.shape else np.inf
    return error if np.isfinite(error) else np.inf


def _rows(arguments: Sequence[dict[str, Any]], measured: Sequence[Measured], reference: Measured) -> tuple[Row, ...]:
    """Rows with errors against the reference."""
    check_comparable({f"study of {given}": each for given, each in zip(arguments, measured, strict=True)}, reference)
    return tuple(
        Row(None if given["modes"] == "all" else given["modes"], bool(given.get("residual")), each.value,
            *difference(each, reference), each is reference, each)
        for given, each in zip(arguments, measured, strict=True)
    )  # fmt: skip


def check_comparable(measured: Mapping[str, Measured], reference: Measured) -> None:
    """ValueError unless the reference has a size that errors are relative to, and all, by name, have its shape."""
    size, shape = float(np.linalg.norm(reference.mean)), reference.values.shape
    require(0 < size < np.inf, "the reference value must be finite and not zero", reference.mean, "study",
            "does anything happen in this run? is there contact?")  # fmt: skip
    for where, each in measured.items():
        require(each.values.shape == shape, f"quantity must return one shape, {shape[1:]} for the reference",
                each.values.shape[1:], where, "return a fixed number of values")  # fmt: skip


def kinds_of(scene: Scene, residual: bool | None) -> tuple[bool, ...]:
    """With static shapes or without; both if neither is asked for and the scene has any."""
    if residual is not None:
        known = isinstance(residual, (bool, np.bool_))
        require(known, "residual must be True, False or None", residual, "study", "None takes both")
        return (bool(residual),)
    return (False, True) if scene.acting or scene.forces else (False,)


def difference(one: Measured, other: Measured) -> tuple[float, float]:
    """Relative error of paired values against a reference, and its 95 % half-width; 0 of a single value."""
    from scipy.stats import t

    scale, apart = np.linalg.norm(other.mean), one.values - other.values
    if len(apart) == 1:
        return float(np.linalg.norm(apart) / scale), 0.0
    scatter = np.std(apart, axis=0, ddof=1) * t.ppf(0.975, len(apart) - 1) / np.sqrt(len(apart))
    return float(np.linalg.norm(apart.mean(axis=0)) / scale), float(np.linalg.norm(scatter) / scale)


def observed_rate(rows: Sequence[Row]) -> float:
    """Slope p of error ~ n^-p by least squares over the resolved errors of counts up to half the finest."""
    finest = max((row.modes or 0 for row in rows), default=0)
    used = [(row.modes, row.error) for row in rows if row.modes and row.resolved and 2 * row.modes <= finest]
    if len(used) < 2:
        return float("nan")
    modes, errors = np.log(used).T
    return -float(np.polyfit(modes, errors, 1)[0])


def checked_counts(counts: Iterable[int], name: str = "counts") -> list[int]:
    """Checked counts, ascending, each once."""
    require(is_listed(counts), "counts must be a list of numbers of modes", counts, "study", "e.g. [1, 2, 3, 5, 10]")
    chosen = list(counts)
    require(len(chosen) > 0, "counts must hold a number of modes", chosen, "study", "e.g. [1, 2, 3, 5, 10]")
    for count in chosen:
        whole = is_whole(count)
        require(whole and count > 0, f"{name} must be whole numbers above 0", count, "study", "e.g. [1, 2, 3]")
    return sorted({int(count) for count in chosen})
