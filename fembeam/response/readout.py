"""What it takes besides coordinates to evaluate a run: computed from its model when asked for, or kept by its file.

    q'' = Σ_l v_l s_l(t) + Σ_s w_s F_s - C q' - K q,    reactions = R [F; s; q''; q']

k samples, n coordinates, m rows of contacts, l loads, r reactions. Neither scene nor laws nor signals are needed then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.beams import Beam, Section, Taper
from fembeam.response.section_forces import SectionForces
from fembeam.scene import FEATURES, heights, loads
from fembeam.structures import Frame, FrameForces, FrameMesh, JoinedForces, Member, located_among, points_of
from fembeam.support import require, tuples

if TYPE_CHECKING:
    from fembeam.model import Model

Vector = NDArray[np.float64]
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


class Readout:
    """Loads, damping, the frame's motion, section forces, reactions, heights of one run; each made once.

    ``kept`` are those of a file, by the names of the properties; what is neither there nor of a model is a ValueError.
    ``taken`` gives values of loads at times by their numbers, where they are not those of the signals themselves.
    """

    forces: Vector | None = None  # (r, k) on the rows of contacts, of a run read from a file
    means: Vector | None = None  # (m, k) of the contacts over each sample, likewise

    def __init__(
        self, model: Model | None, t: Vector, kept: Mapping[str, Any], taken: Callable[[Vector], Any] | None = None
    ) -> None:
        self._model, self.t, self._taken = model, t, taken
        self.__dict__.update(kept)

    @property
    def model(self) -> Model:
        """The model; ValueError without one."""
        require(self._model is not None, "this needs the model of the run",
                "a run read from a file that does not keep it", "Run",
                "simulate again, or use dataclasses.replace(run, model=model)")  # fmt: skip
        assert self._model is not None
        return self._model

    @cached_property
    def stiffness(self) -> Vector:
        """K (n, n), 1/s²; M is 1."""
        return np.asarray(self.model.system.K)

    @cached_property
    def omega(self) -> Vector:
        """Natural frequencies ω (n,) with all contacts open, rad/s: K is diagonal."""
        return np.sqrt(np.diag(self.stiffness))

    @cached_property
    def zeta(self) -> Vector:
        """Damping ratios (n,) of the structure without dashpots."""
        return self.model.zeta

    @cached_property
    def damping(self) -> Vector:
        """C (n, n), 1/s; of a shaft that spins with its gyroscopic matrix."""
        return np.asarray(self.model.system.by_rate)

    @cached_property
    def load_vectors(self) -> Vector:
        """Vectors v (l, n)."""
        vectors = [vector for vector, _ in self.model.system.loads]
        return np.array(vectors, dtype=float).reshape(len(vectors), len(self.stiffness))

    @cached_property
    def loads(self) -> Vector:
        """Signals s (l, k): of forces and feet, then the frame's ÿ if it moves, then gravity.

        With supports that move sampled ones as the run took them: their displacement loads shapes of some 1e5 rad/s
        that follow it, whose accelerations are differences of nearly equal terms.
        """
        signals = [signal for _, signal in self.model.system.loads]
        known = {} if self._taken is None else self._taken(self.t)
        values = [known[i] if i in known else _sampled(signal, self.t) for i, signal in enumerate(signals)]
        return np.array(values).reshape(len(signals), len(self.t))

    @cached_property
    def base(self) -> int | None:
        """Number of ÿ (the first of several) among the loads; None for a frame at rest."""
        scene = self.model.scene
        return None if not scene.motions else len(loads(scene, self.model.matrices))

    @cached_property
    def moved(self) -> tuple[str, ...]:
        """Directions (b,) in which the frame moves."""
        return tuple(self.model.scene.motions)

    @cached_property
    def frame(self) -> Vector:
        """Its motion y and ẏ (2 b, k), m and m/s, one direction after the other; (0, k) for a frame at rest."""
        motions = [part for base in self.model.scene.motions.values() for part in (base, base.derivative(1))]
        return np.array([_sampled(motion, self.t) for motion in motions]).reshape(len(motions), len(self.t))

    @cached_property
    def section_forces(self) -> Any:
        """`SectionForces` of each beam; None of bodies without sections."""
        return self.model.section_forces

    @cached_property
    def reactions(self) -> tuple[list[tuple[Any, int]], Vector]:
        """(part, body) of each reaction and R (r, 2, m + l + 2 n): force and moment."""
        from fembeam.response.support_reactions import reaction_rows

        return reaction_rows(self.model)

    @cached_property
    def supports(self) -> Vector:
        """Place z and body of each support (s, 2)."""
        scene = self.model.scene
        beams = [(body, one) for body, one in enumerate((scene, *scene.bodies)) if not one.named]
        found = [(support.z, body) for body, one in beams for support in one.supports]
        return np.array(found, dtype=float).reshape(-1, 2)

    @cached_property
    def heights(self) -> Vector:
        """Heights of the beams (b,), m."""
        return np.array(heights(self.model.scene)[0])

    @cached_property
    def impactor_places(self) -> Vector:
        """Place z and height of each impactor (i, 2), m; z is 0 where places have names."""
        along = [one.z if one.direction is None else 0.0 for one in self.model.matrices.impactors]
        return np.array([along, heights(self.model.scene)[1]]).T.reshape(-1, 2)


def _sampled(signal: Any, t: Vector) -> Vector:
    """A signal at the samples (k,)."""
    return np.broadcast_to(np.asarray(signal(t), dtype=float), t.shape)


# --- on file, so that a run can be read without its scene: words for JSON, and arrays


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
            words, of_frames = _frames_packed(one, i)
            arrays |= of_frames
        about["beams"].append(words)
    return about, arrays


def unpacked(about: Mapping[str, Any], arrays: Mapping[str, Any], nodes: list[Any]) -> dict[str, Any]:
    """What a `Readout` is given, with the nodes of its beams; ValueError where words contradict arrays."""
    counts = {"bodies": ("beams", len(nodes)), "reactions": ("parts", len(arrays["reactions"]))}
    for what, (name, count) in counts.items():
        if len(about[name]) != count:
            raise ValueError(f"{name} must be {count}, the number of {what}, there are {len(about[name])}")
    if about["base"] is not None and not 0 <= about["base"] < len(arrays["loads"]):
        raise ValueError(f"base must be the number of a load, it is {about['base']}")
    forces = tuple(
        None
        if beam is None
        else _frames_unpacked(beam, arrays, i)
        if "frames" in beam
        else SectionForces(_beam_of_words(beam), nodes[i], arrays[f"moments_{i}"], arrays[f"shears_{i}"])
        for i, beam in enumerate(about["beams"])
    )
    parts: Any = [_part(dict(words)) for words in about["parts"]]
    kept: dict[str, Any] = {name: arrays[name] for name in PLAIN}
    kept |= {"forces": arrays["force"], "means": arrays["mean_force"]}
    straight = [(part, body) for part, body in parts if "spans" in (about["beams"][body] or ())]
    held = [(part.z, body) for part, body in straight if type(part) in FEATURES["supports"]]
    kept["supports"] = np.array(held, dtype=float).reshape(-1, 2)
    kept |= {
        "base": about["base"],
        "moved": tuple(about["moved"]),
        "section_forces": forces,
        "reactions": (parts, arrays["reactions"]),
    }
    return kept


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
    return made(**{name: tuples(value) for name, value in words.items()}), body


def _beam_as_words(beam: Beam) -> dict[str, Any]:
    """Spans and what acts along the beam."""
    spans = [[length, asdict(section)] for length, section in beam.spans]
    return {"spans": spans, "foundation": beam.foundation, "axial_force": beam.axial_force}


def _beam_of_words(words: Mapping[str, Any]) -> Beam:
    """The beam that `_beam_as_words` wrote."""
    spans = [(length, _section(section)) for length, section in words["spans"]]
    return Beam.of_spans(spans, words["foundation"], words["axial_force"])


@dataclass(frozen=True)
class SavedBodies:
    """The frames among joined bodies, by their numbers: what of them a file keeps."""

    frames: Mapping[int, Frame]

    def located(self, place: Any, where: str) -> tuple[int, Any]:
        """Number of the body that a place is on, and the place there."""
        return located_among(self.frames, place, where)


def _frames_packed(forces: FrameForces | JoinedForces, body: int) -> tuple[dict[str, Any], dict[str, Vector]]:
    """Words, and arrays members_<body>_<number> (2, names, elements, 2, n): values and slopes at both ends."""
    each = forces.each if isinstance(forces, JoinedForces) else {0: forces}
    words = {str(number): _frame_as_words(one) for number, one in each.items()}
    arrays = {
        f"members_{body}_{number}": np.array([[kind[name] for name in one.names] for kind in (one.ends, one.slopes)])
        for number, one in each.items()
    }
    return {"frames": words, "joined": isinstance(forces, JoinedForces)}, arrays


def _frames_unpacked(words: Mapping[str, Any], arrays: Mapping[str, Any], body: int) -> FrameForces | JoinedForces:
    """The same of a file; ValueError where words and arrays contradict each other."""
    found = {int(n): _frame_of_words(one, arrays[f"members_{body}_{n}"]) for n, one in words["frames"].items()}
    if not words["joined"]:
        return found[0]
    frames = {number: forces.mesh.frame for number, forces in found.items()}
    return JoinedForces(SavedBodies(frames), found)


def _frame_as_words(forces: FrameForces) -> dict[str, Any]:
    """The frame, the nodes of its mesh along the members, names of its section forces."""
    frame = forces.mesh.frame
    members = [asdict(one) for one in frame.members]
    about = {"nodes": frame.nodes, "members": members, "spin": frame.spin, "bending_only": frame.bending_only}
    return {"frame": about, "borders": [s.tolist() for s in forces.mesh.borders], "names": forces.names}


def _frame_of_words(words: Mapping[str, Any], values: Vector) -> FrameForces:
    """Section forces of one frame."""
    about, names = dict(words["frame"]), list(words["names"])
    members = [Member(**{**one, "section": _section(one["section"])}) for one in about.pop("members")]
    frame, borders = Frame(members=members, **about), tuple(np.array(s, dtype=float) for s in words["borders"])
    mesh = FrameMesh(frame, borders, (), sparse.identity(points_of(borders), format="csr"))  # dofs are its points'
    if values.shape[:4] != (2, len(names), int(mesh.first[-1]), 2) or len(mesh.borders) != len(members):
        raise ValueError(f"section forces must be of {int(mesh.first[-1])} elements, they have shape {values.shape}")
    ends, slopes = (dict(zip(names, kind, strict=True)) for kind in values)
    return FrameForces(mesh, ends, slopes)


def _section(words: Mapping[str, Any]) -> Section | Taper:
    """A section or a taper of two; JSON has lists for tuples."""
    if "start" in words:
        return Taper(Section(**words["start"]), Section(**words["end"]))
    return Section(**{name: tuples(value) for name, value in words.items()})
