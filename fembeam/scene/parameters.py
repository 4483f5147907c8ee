"""The scalars of a scene by name: read them, and make the same scene with another value.

A name is a path such as ``base.omega``, ``stops[0].gap``, ``stops[0].law.stiffness`` or ``masses[1].mass``; a part that
has a name may be called by it, ``stops[valve].gap``. Its last part alone will do where no other path ends so; ``omega``
and ``amplitude`` mean the base motion's first, and every name the scene's own part before that of a body,
``bodies[0].stops[0].gap``. Of a base that moves in several directions ``base.omega`` is that of all, if it is one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from copy import copy
from dataclasses import Field, fields, is_dataclass, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from fembeam.scene.signals import is_of_signal, support_motion
from fembeam.support import is_number, is_whole, require

if TYPE_CHECKING:
    from fembeam.scene.scene import Scene

SHARED = "base.omega"
LISTS = ("masses", "springs", "dashpots", "stops", "elements", "forces")


def scalars(scene: Scene, within: str = "") -> dict[str, float]:
    """All numbers of a scene and of its bodies that can be varied, by path; `within` stands before each."""
    found: dict[str, float] = {}
    for part in fields(scene):
        value = getattr(scene, part.name)
        items = [(f"{part.name}[{i}]", item) for i, item in enumerate(value)] if part.name in LISTS else []
        for path, item in items or [(part.name, _as_declared(part, value))]:
            found.update(_numbers(f"{within}{path}", item))
    for i, support in enumerate(scene.supports):
        found.update(_numbers(f"{within}supports[{i}].motion", support_motion(support)))
    if (shared := _shared_omega(scene)) is not None:
        found[f"{within}{SHARED}"] = shared
    for i, body in enumerate(scene.bodies):
        found.update(scalars(body, f"{within}bodies[{i}]."))
    return found


def _shared_omega(scene: Scene) -> float | None:
    """The frequency of a base motion in several directions, if all of them have the same one."""
    base = scene.base if isinstance(scene.base, dict) else {}
    found = [getattr(signal, "omega", None) for signal in base.values()]
    shared = len(found) > 1 and all(isinstance(omega, float) and omega == found[0] for omega in found)
    return found[0] if shared else None


def _numbers(path: str, item: Any) -> dict[str, float]:
    """Numbers of one part, and of the parts it has."""
    if isinstance(item, float):
        return {path: item}
    if isinstance(item, tuple) and all(isinstance(entry, float) for entry in item):
        return {f"{path}[{i}]": entry for i, entry in enumerate(item)}
    if isinstance(item, tuple) and all(is_dataclass(entry) for entry in item):
        return {name: value for i, entry in enumerate(item) for name, value in _numbers(f"{path}[{i}]", entry).items()}
    if isinstance(item, dict):
        return {name: value for key, part in item.items() for name, value in _numbers(f"{path}.{key}", part).items()}
    if not is_dataclass(item):
        return {}
    found: dict[str, float] = {}
    varied = getattr(item, "varied", None)
    for part in fields(item):
        if part.init and part.repr and (varied is None or part.name in varied):
            found.update(_numbers(f"{path}.{part.name}", _as_declared(part, getattr(item, part.name))))
    return found | {f"{path}.{name}": value for name, value in _bound(item).items()}


def _as_declared(part: Field[Any], value: Any) -> Any:
    """A value as its field declares it: whole numbers where there may be others are numbers to vary."""
    kind = str(part.type)
    if isinstance(value, tuple) and "[float" in kind and all(map(is_number, value)):
        return tuple(map(float, value))
    return float(value) if is_whole(value) and "float" in kind else value


def _bound(item: Any) -> dict[str, float]:
    """Parameters of a law of the user's own, by the names that its function gives them."""
    return dict(item.values) if hasattr(item, "rebound") else {}


def path_of(scene: Scene, name: str) -> str:
    """The full path a name means; an unknown or ambiguous one is an error that lists what there is.

    A part may be called by its name: ``stops[valve].gap``.
    """
    require(isinstance(name, str), "a parameter must be called by its path", name, "parameter", "e.g. 'omega'")
    known, path = scalars(scene), numbered(scene, name)
    if path in known:
        return path
    ends = [one for one in known if one.endswith(f".{path}")]
    own = [path for path in ends if not path.startswith("bodies")]
    first = [path for path in ends if path.startswith("base.")] or own or ends
    first = [SHARED] if SHARED in first else first
    near = get_close_matches(name, [*known, *_by_name(scene, known)], n=1, cutoff=0.5)
    advice = f"did you mean {near[0]}?" if near else "use one of these"
    require(bool(ends), f"no such parameter; the scene has {', '.join(known)}", name, "parameter", advice)
    require(len(first) == 1, f"ambiguous parameter: {', '.join(ends)}", name, "parameter", "give the whole path")
    return first[0]


def numbered(scene: Scene, path: str) -> str:
    """A path with numbers for the names of parts: "stops[0].gap" for "stops[valve].gap"; what is a number stays one."""
    for numbers, part in scene.named_parts.items():
        parts = numbers.rpartition("[")[0]
        if path.startswith(f"{parts}[{part.name}].") and not _is_number(scene, parts, part.name):
            return f"{numbers}.{path.removeprefix(f'{parts}[{part.name}].')}"
    return path


def _is_number(scene: Scene, parts: str, name: str) -> bool:
    """Whether a name is the number of one of the parts at a path, such as "bodies[0].stops": then it means this one."""
    *bodies, last = parts.split(".")
    for body in bodies:
        scene = scene.bodies[int(body.removeprefix("bodies[").removesuffix("]"))]
    return name.isdecimal() and int(name) < len(getattr(scene, last))


def called(scene: Scene, name: str) -> str:
    """The full path that a name means, by the names of parts where it has them: "stops[valve].gap", "base.omega"."""
    path = path_of(scene, name)
    return name if numbered(scene, name) == path else path


def _by_name(scene: Scene, known: Iterable[str]) -> list[str]:
    """Paths with the names of parts in place of their numbers, of the parts that have one."""
    parts = scene.named_parts.items()
    return [
        f"{numbers.rpartition('[')[0]}[{part.name}]{path.removeprefix(numbers)}"
        for path in known
        for numbers, part in parts
        if path.startswith(f"{numbers}.")
    ]


def value_of(scene: Scene, name: str) -> float:
    """Present value of a parameter."""
    return scalars(scene)[path_of(scene, name)]


def with_value(scene: Scene, name: str, value: float) -> Scene:
    """The same scene with another value of one parameter; the scene's own checks apply."""
    return replaced(scene, path_of(scene, name), value)


def replaced(item: Any, path: str, value: float) -> Any:
    """A copy of a scene, or of a part of one, with the number at the end of a full path replaced."""
    return _replaced(item, re.findall(r"\w+", path), value)


def _replaced(item: Any, path: list[str], value: float) -> Any:
    """A copy with the number at the end of a path replaced."""
    if not path:
        return value
    if path[0].isdigit():
        changed = list(item)
        changed[int(path[0])] = _replaced(item[int(path[0])], path[1:], value)
        return type(item)(changed)
    if isinstance(item, dict) and path[0] not in item:  # of all directions
        return {key: _replaced(part, path, value) for key, part in item.items()}
    if isinstance(item, dict):
        return {**item, path[0]: _replaced(item[path[0]], path[1:], value)}
    if path[0] in _bound(item):
        return item.rebound(**{path[0]: value})
    changed = _replaced(getattr(item, path[0]), path[1:], value)
    if path[0] != "base":
        return replace(item, **{path[0]: changed})
    moved = copy(item)  # no check of a scene asks for the base motion, which has checked itself
    object.__setattr__(moved, "base", changed)
    return moved


def changes_structure(path: str) -> bool:
    """Whether a parameter changes the mode shapes or frequencies: anything but signals, gaps and laws."""
    part = re.sub(r"^(bodies\[\d+\]\.)+", "", path)
    place = re.fullmatch(r"\w+\[\d+\]\.(z|on|to|direction|tangent|directions)(\[\d+\])*", part)
    return not (is_of_signal(path) or part.startswith(("stops", "elements"))) or place is not None
