"""Scenes from the tables of a scene file, for `random_models.py`: by the constructors, and as the text of the file."""

from __future__ import annotations

from typing import Any

from finite_elements import Table

import contacts
import fembeam as fb

LAWS = {
    **{
        name: getattr(contacts.Hysteretic, name)
        for name in ("lankarani_nikravesh", "hunt_crossley", "flores", "gonthier")
    },
    **{"hertz": contacts.Hertz, "hysteretic": contacts.Hysteretic, "kelvin_voigt": contacts.KelvinVoigt},
    **{"piecewise_linear": contacts.PiecewiseLinear, "polynomial": contacts.Polynomial, "jenkins": contacts.Jenkins},
    **{"elasto_plastic": contacts.ElastoPlastic, "bouc_wen": contacts.BoucWen},
}
SHAPES = {"general": fb.Section, "rectangle": fb.Section.rectangle, "circle": fb.Section.circle}
SHAPES |= {"tube": fb.Section.tube, "taper": fb.Taper}
SIGNALS = {"harmonic": fb.Harmonic, "multisine": fb.Multisine, "band_noise": fb.BandNoise, "pulse": fb.Pulse}
SIGNALS |= {"step": fb.Step, "sine_sweep": lambda rate="linear", **rest: fb.SineSweep(kind=rate, **rest)}
PARTS = {"clamped": fb.Clamped, "pinned": fb.Pinned, "guided": fb.Guided}
PARTS |= {"point_force": fb.PointForce, "point_moment": fb.PointMoment}
LISTS = {"masses": fb.LumpedMass, "springs": fb.Spring, "dashpots": fb.Dashpot, "stops": fb.Stop}
LISTS |= {"elements": fb.Element, "impactors": fb.Impactor, "supports": None, "forces": None}


def kind_of(table: Table, key: str, makers: Any) -> Any:
    """What a table with a kind or shape stands for."""
    rest = {k: v for k, v in table.items() if k != key}
    return makers[table[key]](**{k: nested(k, v) for k, v in rest.items()})


def nested(key: str, value: Any) -> Any:
    """A value of a table, objects instead of tables."""
    if key == "law":
        return kind_of(value, "kind", LAWS)
    if key in ("section", "start", "end") and isinstance(value, dict):
        return kind_of(value, "shape", SHAPES)
    return kind_of(value, "kind", SIGNALS) if key in ("signal", "foot", "base") else value


def scene_of(tables: Table) -> fb.Scene:
    """The scene by the constructors."""
    beam, found = dict(tables["beam"]), {}
    if "spans" in beam:
        beam["spans"] = [(span["length"], nested("section", span["section"])) for span in beam["spans"]]
    else:
        beam["section"] = nested("section", beam["section"])
    found["beam"] = (fb.Beam.of_spans if "spans" in beam else fb.Beam)(**beam)
    for name, maker in LISTS.items():
        rows = tables.get(name, ())
        found[name] = [
            maker(**{k: nested(k, v) for k, v in row.items()}) if maker else kind_of(row, "kind", PARTS) for row in rows
        ]
    if "damping" in tables:
        found["damping"] = (fb.Rayleigh if "alpha" in tables["damping"] else fb.ModalDamping)(**tables["damping"])
    if "base" in tables:
        found["base"] = nested("base", tables["base"])
    return fb.Scene(**found, gravity=tables.get("gravity", 0.0), bodies=[scene_of(b) for b in tables.get("bodies", ())])


def toml(value: Any) -> str:
    """A value of a scene file."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    return (
        str(value).lower() if isinstance(value, bool) else repr(value) if not isinstance(value, str) else f'"{value}"'
    )


def scene_file(tables: Table, how: Table) -> str:
    """The text of the scene file."""
    lines = [f"gravity = {tables['gravity']!r}"] if "gravity" in tables else []
    for name, value in [*tables.items(), ("reduce", how)]:
        if name == "gravity":
            continue
        for row in value if isinstance(value, list) else [value]:
            lines.append(f"[[{name}]]" if isinstance(value, list) else f"[{name}]")
            lines += [f"{k} = {toml(v)}" for k, v in row.items()]
    return "\n".join(lines) + "\n"
