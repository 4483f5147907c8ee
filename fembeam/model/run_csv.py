"""A run as tables: CSV for spreadsheets, pandas, xarray, printed tables; units in the head of every column."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from fembeam.model.watched_places import places as usual_places
from fembeam.response import BodyReaction
from fembeam.scene import directed_words, is_directed, place_words, unit_of
from fembeam.support import is_finite, is_whole, require, tuples
from solvers.problem import dataframe, optional

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import ArrayLike

    from fembeam.model.run import Run, Vector
    from fembeam.support import Part

FRICTION_UNITS = {"t_in": "s", "t_out": "s", "angle_in": "rad", "angle_out": "rad", "speed_in": "m/s",
                  "speed_out": "m/s", "peak_friction": "N", "impulse": "N s", "slip": "m",
                  "energy_loss": "J"}  # fmt: skip
DIGITS = "%.12g"
Output = Literal[
    "displacement", "velocity", "acceleration", "absolute displacement", "absolute velocity", "absolute acceleration",
    "slope", "moment", "shear", "stress", "section forces", "indentation", "force", "friction", "work", "friction loss",
    "reactions",
]  # fmt: skip
UNITS = {  # of what `histories` can be asked for
    **dict.fromkeys(get_args(Output), "m"),
    **{"velocity": "m/s", "absolute velocity": "m/s", "acceleration": "m/s²", "absolute acceleration": "m/s²"},
    **{"slope": "rad", "moment": "N m", "shear": "N", "stress": "N/m²", "force": "N", "work": "J"},
    **{"friction": "N", "friction loss": "J"},
}
USUAL = ("displacement", "velocity", "indentation", "force")
SECTIONS = ("moment", "shear", "stress", "section forces")
OF_STOPS = ("indentation", "force", "friction", "work", "friction loss")
ELSEWHERE = (*OF_STOPS, "reactions")  # not at places: of stops and of supports


def write(run: Run, folder: Path, stride: int = 1, **chosen: Any) -> list[Path]:
    """Write `histories.csv` and `contacts.csv`, with friction `friction.csv`; see `Run.to_csv`."""
    kept = histories(run, stride, **chosen)
    folder.mkdir(parents=True, exist_ok=True)
    units = ((name, run.contacts.unit(name), column) for name, column in run.contacts.named_arrays().items())
    log = {f"{name} [{unit}]" if unit else name: column for name, unit, column in units}
    written = [_write(folder / "histories.csv", kept), _write(folder / "contacts.csv", log)]
    if not run.rubs.any():
        return written
    heads = {name: f"{name} [{unit}]" for name, unit in FRICTION_UNITS.items()} | {"contact": "stop"}  # as contacts.csv
    rubbed = {heads.get(name, name): column for name, column in run.friction_log.named_arrays().items()}
    return [*written, _write(folder / "friction.csv", rubbed)]


def histories(
    run: Run, stride: int = 1, places: Sequence[Any] | None = None, quantities: Sequence[str] | None = None
) -> dict[str, Vector]:
    """Columns of every `stride`-th sample, by name and unit: quantities at places, of stops, of supports."""
    require(
        is_whole(stride) and stride >= 1, "stride must be a whole number above 0", stride, "Run", "1 keeps every sample"
    )
    _check_lists(run, places, quantities)
    asked = USUAL if quantities is None else quantities
    unknown = [name for name in asked if name not in UNITS]
    require(not unknown, f"quantities must be among {', '.join(UNITS)}", unknown, "Run", "choose from these")
    columns = {"t [s]": run.t, **(_at_named_places if run.shapes.named else _along_a_beam)(run, asked, places)}
    for stop in range(len(run.stops)):
        columns |= _of_stop(run, stop, asked)
    if "reactions" in asked:
        columns |= _of_reactions(run)
    return {name: column[::stride] for name, column in columns.items()}


def _check_lists(run: Run, places: Any, quantities: Any) -> None:
    """Raise ValueError for one place, or one quantity, where a list of them belongs."""
    require(not isinstance(quantities, str), "quantities must be a list", quantities, "Run", "put it in brackets")
    listed = isinstance(places, (list, tuple)) or (not run.shapes.named and np.ndim(places) == 1)
    require(places is None or listed, "places must be a list", places, "Run", "put it in brackets")


def _along_a_beam(run: Run, asked: Sequence[str], places: Sequence[Any] | None) -> dict[str, Vector]:
    """Quantities at z of a beam."""
    where: dict[str, Any] = usual_places(run.shapes)
    if places is not None:
        astray = [z for z in places if not is_finite(run.shapes.place(z))]
        require(not astray, "places of a beam must be numbers", astray, "Run", "give z in m")
        where = {f"at {z}" if isinstance(z, str) else f"at {z:.12g} m": z for z in places}
    require("section forces" not in asked, "section forces are of a frame", list(asked), "Run",
            "ask for moment and shear")  # fmt: skip
    there = [what for what in asked if what not in ELSEWHERE]
    return {f"{what} {name} [{_unit(what, z)}]": _at(run, what, z) for name, z in where.items() for what in there}


def _at_named_places(run: Run, asked: Sequence[str], places: Sequence[Any] | None) -> dict[str, Vector]:
    """Section forces, then motion, at places that have names; one without a direction moves along all components."""
    sections = [what for what in asked if what in SECTIONS]
    require(places is not None or not sections, "places must be given for section forces", sections, "Run",
            "write places=[('A-B', 0.4)], a member and a distance in m")  # fmt: skip
    found: dict[str, Vector] = {}
    ways = usual_places(run.shapes) if places is None else {}
    for at in map(tuples, places or ()):
        found |= _sections_at(run, sections, at[0] if is_directed(at) else at)
        along = [at] if is_directed(at) else [(at, way) for way in run.shapes.components]
        ways |= {f"at {directed_words(one)}": one for one in along}
    motions = [what for what in asked if what not in SECTIONS and what not in ELSEWHERE]
    for name, one in ways.items():
        found |= {f"{what} {name} [{_unit(what, one)}]": _at(run, what, one) for what in motions}
    return found


def _sections_at(run: Run, sections: Sequence[str], place: Any) -> dict[str, Vector]:
    """Moment, shear force or stress at a place on a member, or all section forces."""
    found: dict[str, Vector] = {}
    for what in sections:
        forces = run.section_forces(place) if what == "section forces" else {what: _at(run, what, place)}
        units = {name: UNITS.get(name, "N" if name[0] in "NQ" else "N m") for name in forces}  # N, Q, M, Q2, M2, T
        found |= {f"{name} at {place_words(place)} [{units[name]}]": x for name, x in forces.items()}
    return found


def _of_stop(run: Run, stop: int, asked: Sequence[str]) -> dict[str, Vector]:
    """Indentation and force of a stop, work, friction, as far as asked for."""
    found: dict[str, Vector] = {}
    key = run.key(stop)
    for what in asked:
        if what in ("indentation", "force"):
            found |= _by_components(run, what, stop, key)
    if "work" in asked:
        found[f"work {key} [J]"] = run.losses.history[:, stop]
    if "friction" in asked and run.rubs[stop, 1]:
        found[f"friction {key} [N]"] = run.friction(stop)
    if "friction loss" in asked and run.rubs[stop, 1]:
        found[f"friction loss {key} [J]"] = run.friction_loss[:, stop]
    return found


def _by_components(run: Run, what: str, stop: int, key: str) -> dict[str, Vector]:
    """The indentation or force of a stop; of an annular one both components of the force."""
    values, unit = getattr(run, what)(stop), run.unit(what, stop)
    if values.ndim == 1:
        return {f"{what} {key} [{unit}]": values}
    given = run.places[stop][1] if run.circles[stop, 0] else ("", "along")  # N, and the force along the tangent
    # a vector without commas, for the file
    ways = [one if isinstance(one, str) else f"({' '.join(f'{number:.4g}' for number in one)})" for one in given]
    return {f"{what} {key} {way}".rstrip() + f" [{unit}]": values[:, i] for i, way in enumerate(ways)}


def _of_reactions(run: Run) -> dict[str, Vector]:
    """Force and moment of every support, spring and dashpot; of a body with directions by components."""
    found: dict[str, Vector] = {}
    for i, one in enumerate(run.reactions()):
        about = one.name if one.part.name is not None else f"{i} ({one.name})"
        if isinstance(one, BodyReaction):
            have = (run.shapes, *run.others)[one.body].components
            found |= {f"reaction {c} {about} [{'N m' if c[0] == 'r' else 'N'}]": one[c] for c in have}
        else:
            found |= {f"reaction force {about} [N]": one.force, f"reaction moment {about} [N m]": one.moment}
    return found


def _unit(quantity: str, at: Any) -> str:
    """Unit of a quantity at a place: rad for m where the direction is a rotation."""
    return UNITS[quantity].replace("m", "rad", 1) if _turns(at) else UNITS[quantity]


def _turns(at: Any) -> bool:
    """Whether a place stands with a rotation."""
    return isinstance(at, tuple) and isinstance(at[1], str) and at[1].lstrip("-").startswith("r")


def _at(run: Run, quantity: str, z: Any) -> Vector:
    """A quantity (k,) at a place."""
    name = quantity.removeprefix("absolute ")
    return getattr(run, name)(z) if name == quantity else getattr(run, name)(z, absolute=True)


def extremes_table(columns: Mapping[str, Vector], discard: float = 0.0) -> dict[str, dict[str, float]]:
    """Mean, standard deviation, least and greatest value with their times of `histories` from t = discard on."""
    t = columns["t [s]"]
    kept, found = t >= discard, {}
    for name, values in list(columns.items())[1:] if kept.any() else ():
        x = values[kept]
        low, high = int(np.argmin(x)), int(np.argmax(x))
        numbers = (x.mean(), x.std(), x[low], t[kept][low], x[high], t[kept][high])
        found[name] = dict(zip(("mean", "std", "min", "t_min", "max", "t_max"), map(float, numbers), strict=True))
    return found


def to_dataframe(run: Run, stride: int = 1, **chosen: Any) -> Any:
    """See `Run.to_dataframe`."""
    return dataframe(histories(run, stride, **chosen)).set_index("t [s]")


def to_xarray(run: Run, z: ArrayLike | None = None) -> Any:
    """See `Run.to_xarray`."""
    named, place = run.shapes.named, run._places(z)
    variables = {
        "displacement": (("t", "z"), run.displacement(place), {"units": "m"}),
        "velocity": (("t", "z"), run.velocity(place), {"units": "m/s"}),
        "indentation": (("t", "stop"), _side_by_side(run, run.indentation), {"units": run.unit("indentation")}),
        "force": (("t", "stop"), _side_by_side(run, run._normal_force), {"units": run.unit("force")}),
        **_friction_variables(run),
        "q": (("t", "coordinate"), run.q, {"units": "m √kg"}),
        "q_dot": (("t", "coordinate"), run.q_dot, {"units": "m √kg/s"}),
    }
    axes = {
        "t": ("t", run.t, {"units": "s"}),
        "z": ("z", [directed_words(at) for at in place], {}) if named else ("z", place, {"units": "m"}),
        "stop": np.arange(len(run.stops)),
    }
    sites = run.contacts.sites
    axes |= {"name": ("stop", list(run.names)), "place": ("stop", [one.place for one in sites])}
    axes["direction"] = "stop", [one.direction for one in sites]
    return optional("xarray", "a data set").Dataset(variables, axes, {"status": run.status, "scene": run.scene})


def _friction_variables(run: Run) -> dict[str, Any]:
    """F_t and the loss by friction of every stop, NaN and 0 of one without; none in a run without friction."""
    if not run.rubs.any():
        return {}
    without = np.full(len(run.t), np.nan)
    force = _side_by_side(run, lambda stop: run.friction(stop) if run.rubs[stop, 1] else without)
    return {
        "friction": (("t", "stop"), force, {"units": "N"}),
        "friction_loss": (("t", "stop"), run.friction_loss, {"units": "J"}),
    }


def _side_by_side(run: Run, history: Callable[[int], Vector]) -> Vector:
    """A history of every stop, (k, m)."""
    return np.array([history(stop) for stop in range(len(run.stops))]).reshape(len(run.stops), len(run.t)).T


def _write(target: Path, columns: Mapping[str, Any]) -> Path:
    """One file with a column each, numbers to twelve digits; text with a comma in it stands in quotes."""
    from fembeam.support import written_whole

    texts = [np.asarray(column).dtype == object for column in columns.values()]
    with written_whole(target) as file:
        wrapped = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
        writer = csv.writer(wrapped, lineterminator="\n")
        writer.writerow(columns)
        if any(texts):
            kinds = [str if text else DIGITS.__mod__ for text in texts]
            writer.writerows(
                [kind(x) for kind, x in zip(kinds, row, strict=True)] for row in zip(*columns.values(), strict=True)
            )
        else:
            rows = np.column_stack([np.asarray(column, dtype=float) for column in columns.values()])
            np.savetxt(wrapped, rows, fmt=DIGITS, delimiter=",")
        wrapped.detach()
    return target


def parts(run: Run) -> list[Part]:
    """What print shows of a run: how it ended, its signals, the contacts of each stop."""
    signals, places = {}, usual_places(run.shapes)
    if run.sampled:
        signals = {f"displacement, {name}": run.displacement(z) for name, z in places.items()}
        signals |= {f"indentation, {run.name(i)}": run.indentation(i) for i in range(len(run.stops))}
    moved = [(name, *map(float, (x.mean(), x.std(), x.min(), x.max()))) for name, x in signals.items() if len(x)]
    log, rows = run.contacts, []
    for stop in range(len(run.stops)):
        mine = log.stop == stop
        peak, entry = log.peak_force[mine], log.speed_in[mine]
        numbers = (float(peak.max()), float(peak.mean()), float(entry.mean())) if mine.any() else (None,) * 3
        if not run.always_acting[stop]:
            rows.append((run.name(stop), int(mine.sum()), *numbers))
    length = unit_of("indentation", [*map(_turns, places.values()), *run.rotational])
    force, speed = run.unit("force"), run.unit("speed")
    found: list[Part] = [repr(run), (("", *(f"{name} / {length}" for name in ("mean", "std", "min", "max"))), moved)]
    head = "", "contacts", f"largest force / {force}", f"mean peak force / {force}", f"mean entry speed / {speed}"
    return [*found, *([(head, rows)] if rows else []), *_rubbing(run), *_elements(run)]


def _rubbing(run: Run) -> list[Part]:
    """What friction did at every stop that has it."""
    rows, log = [], run.friction_log
    for stop in np.flatnonzero(run.rubs[:, 1]).tolist():
        mine = log.contact == stop
        largest = float(log.peak_friction[mine].max(initial=0.0))
        impact, friction = float(run.losses.impact[stop]), float(run.losses.friction[stop])
        rows.append((run.name(stop), largest, float(run.losses.slip[stop]), impact, friction))
    head = "", "largest friction / N", "slip / m", "loss by impact / J", "loss by friction / J"
    return [(head, rows)] if rows else []


def _elements(run: Run) -> list[Part]:
    """Work on every element, what it took for good, and the path of its sliders."""
    acting = np.flatnonzero(run.always_acting).tolist()
    rows = [(run.name(i), *(float(x[i]) for x in (run.losses.work, run.losses.loss, run.losses.slip))) for i in acting]
    length = unit_of("indentation", run.rotational[acting])
    return [(("", "work / J", "loss / J", f"slip / {length}"), rows)] if rows else []
