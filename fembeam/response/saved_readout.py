"""The `Readout` of a run as arrays and JSON, so that its file can be read without its scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from fembeam.beams import Beam, Section, Taper
from fembeam.response.readout import Readout, Vector
from fembeam.response.saved_frames import frames_packed, frames_unpacked
from fembeam.response.section_forces import SectionForces
from fembeam.scene import FEATURES

PLAIN = ("stiffness", "damping", "zeta", "load_vectors", "loads", "frame", "heights", "impactor_places")
READOUT_FINITE = {*PLAIN, "reactions", "moments", "shears", "members"}
READOUT_UNITS = {
    "stiffness": "1/s²",
    "damping": "1/s",
    "zeta": "1, of the structure without dashpots",
    "frame": "m, m/s",
    "moments": "N m/(m √kg)",
    "shears": "N/(m √kg)",
    "members": "of frames, values and slopes along: N, N m and these per m, each per m √kg",
    "heights, impactor_places": "m",
}
HOLDING = {part.__name__: part for name in ("supports", "springs", "dashpots") for part in FEATURES[name]}

Arrays = dict[str, Vector]
Shape = tuple[int, ...]


def packed(read: Readout) -> tuple[dict[str, Any], Arrays]:
    """Words for JSON, and arrays by name."""
    parts, rows = read.reactions
    about: dict[str, Any] = {
        "base": read.base,
        "moved": read.moved,
        "beams": [],
        "parts": [{"kind": type(part).__name__, "body": body, **_numbers(part)} for part, body in parts],
    }
    arrays = {name: getattr(read, name) for name in PLAIN} | {"reactions": rows}
    for i, one in enumerate(read.section_forces):
        words: Any = None
        if isinstance(one, SectionForces):
            words = _beam_as_words(one.beam)
            arrays |= {f"moments_{i}": one.moments, f"shears_{i}": one.shears}
        elif one is not None:
            words, of_frames = frames_packed(one, i)
            arrays |= of_frames
        about["beams"].append(words)
    return about, arrays


def unpacked(about: Mapping[str, Any], arrays: Mapping[str, Any], nodes: list[Any]) -> Readout:
    """The same from a file, with the nodes of its beams; ValueError where words and arrays contradict each other."""
    counts = {"bodies": ("beams", len(nodes)), "reactions": ("parts", len(arrays["reactions"]))}
    for what, (name, count) in counts.items():
        if len(about[name]) != count:
            raise ValueError(f"{name} must be {count}, the number of {what}, there are {len(about[name])}")
    if about["base"] is not None and not 0 <= about["base"] < len(arrays["loads"]):
        raise ValueError(f"base must be the number of a load, it is {about['base']}")
    forces = tuple(
        None
        if beam is None
        else frames_unpacked(beam, arrays, i)
        if "frames" in beam
        else SectionForces(_beam_of_words(beam), nodes[i], arrays[f"moments_{i}"], arrays[f"shears_{i}"])
        for i, beam in enumerate(about["beams"])
    )
    parts: Any = [_part(dict(words)) for words in about["parts"]]
    kept: dict[str, Any] = {name: arrays[name] for name in PLAIN}
    straight = [(part, body) for part, body in parts if "spans" in (about["beams"][body] or ())]
    held = [(part.z, body) for part, body in straight if type(part) in FEATURES["supports"]]
    kept["supports"] = np.array(held, dtype=float).reshape(-1, 2)
    kept |= {
        "base": about["base"],
        "moved": tuple(about["moved"]),
        "section_forces": forces,
        "reactions": (parts, arrays["reactions"]),
    }
    return Readout(None, arrays["t"], kept)


def expected_readout(arrays: Mapping[str, Any]) -> dict[str, Shape]:
    """{name: shape} of what is there, as follow from q, the loads, rows of stops, reactions and nodes."""
    (k, n), loads, r = arrays["q"].shape, len(arrays["loads"]), len(arrays["reactions"])
    rows = len(arrays["directions"])
    components = 6 if arrays["reactions"].ndim == 3 and arrays["reactions"].shape[1] == 6 else 2
    bodies = sum(name.split("_")[0] == "nodes" for name in arrays)
    shapes: dict[str, Shape] = {
        **{"stiffness": (n, n), "damping": (n, n), "load_vectors": (loads, n), "loads": (loads, k)},
        **{"frame": (2 * (len(arrays["frame"]) // 2), k), "reactions": (r, components, rows + loads + 2 * n)},
        **{"zeta": (n,), "heights": (bodies,), "impactor_places": (len(arrays["impactor_masses"]), 2)},
    }
    for name in arrays:
        if name.startswith("members_"):
            names, elements, _, columns = arrays[name].shape[1:]
            shapes[name] = (2, names, elements, 2, max(columns, n))
    for i in range(bodies):
        if f"moments_{i}" not in arrays:  # a body without sections
            continue
        elements = arrays[f"nodes_{i}" if i else "nodes"].size - 1
        columns = max(arrays[f"moments_{i}"].shape[-1], n)  # with those of supports that move
        shapes |= {f"{name}_{i}": (elements, 2, columns) for name in ("moments", "shears")}
    return shapes


def _numbers(part: Any) -> dict[str, Any]:
    """The fields of a support, spring or dashpot but its signals."""
    values = {field.name: getattr(part, field.name) for field in fields(part)}
    return {name: value for name, value in values.items() if not callable(value) and name != "motion"}


def _part(words: dict[str, Any]) -> tuple[Any, int]:
    """A support, spring (without the motion of its foot) or dashpot, and its body."""
    made, body = HOLDING[words.pop("kind")], int(words.pop("body"))
    return made(**{name: tuple(value) if isinstance(value, list) else value for name, value in words.items()}), body


def _beam_as_words(beam: Beam) -> dict[str, Any]:
    """Spans and what acts along the beam."""
    spans = [[length, asdict(section)] for length, section in beam.spans]
    return {"spans": spans, "foundation": beam.foundation, "axial_force": beam.axial_force}


def _beam_of_words(words: Mapping[str, Any]) -> Beam:
    """The same as a beam."""
    spans = [(length, _section(section)) for length, section in words["spans"]]
    return Beam.of_spans(spans, words["foundation"], words["axial_force"])


def _section(words: Mapping[str, Any]) -> Section | Taper:
    """A section or a taper of two."""
    if "start" in words:
        return Taper(Section(**words["start"]), Section(**words["end"]))
    return Section(**words)
