"""All signals of a scene with their places: base motion, forces, moments, feet of springs, those of bodies too.

Whatever reads, renews, shifts or lengthens signals goes through this list, so that none is forgotten.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fembeam.scene.scene import Scene

PLACES = {"forces": "signal", "springs": "foot"}  # lists of a scene whose entries carry a signal, and their field
_PATH = re.compile(
    r"(bodies\[\d+\]\.)*(base|supports\[\d+\]\.motion|"
    + "|".join(rf"{n}\[\d+\]\.{key}" for n, key in PLACES.items())
    + r"|forces\[\d+\]\.(moment|phase))\b"  # of an unbalance, which makes its signal of them
)


def support_motion(support: Any) -> dict[str, Any]:
    """The signals of a support by its dofs; none of one at rest."""
    return getattr(support, "motion", None) or {}


def signals_of(scene: Scene) -> dict[str, Any]:
    """Every signal by its place, such as ``base``, ``springs[1].foot`` or ``bodies[0].forces[2].signal``.

    Examples
    --------
    >>> import fembeam as fb
    >>> beam, y = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), fb.Harmonic(1e-3, 50.0)
    >>> list(signals_of(fb.Scene(beam, [fb.Clamped(0.0)], springs=[fb.Spring(0.5, 1e4, foot=y)], base=y)))
    ['base', 'springs[0].foot']
    """
    return dict(_listed(scene))


def persistent_drive(scene: Scene) -> bool | None:
    """Whether a scene is driven by tones and noise alone, so that its motion settles; False without loads.

    None where other signals drive it, such as records, of which one cannot tell.
    """
    signals = signals_of(scene).values()
    known = all(hasattr(signal, "tones") or hasattr(signal, "psd_at") for signal in signals)
    return bool(signals) if known else None


def _listed(scene: Scene) -> Iterator[tuple[str, Any]]:
    """Paths and signals, one by one."""
    if isinstance(scene.base, dict):
        yield from ((f"base.{direction}", motion) for direction, motion in scene.base.items())
    elif scene.base is not None:
        yield "base", scene.base
    for i, support in enumerate(scene.supports):
        yield from ((f"supports[{i}].motion.{dof}", motion) for dof, motion in support_motion(support).items())
    for name, key in PLACES.items():
        for i, part in enumerate(getattr(scene, name)):
            if getattr(part, key) is not None:
                yield f"{name}[{i}].{key}", getattr(part, key)
    for i, body in enumerate(scene.bodies):
        for path, signal in _listed(body):
            yield f"bodies[{i}].{path}", signal


def with_signals(scene: Scene, change: Callable[[Any], Any]) -> Scene:
    """The scene with every signal changed; parts whose signals stay, and a scene of such parts, are kept."""

    def changed(part: Any, key: str) -> Any:
        old = getattr(part, key)
        new = None if old is None else change(old)
        return part if new is old else replace(part, **{key: new})

    def moved_on(support: Any) -> Any:
        old = support_motion(support)
        new = {dof: change(motion) for dof, motion in old.items()}
        return support if all(new[dof] is old[dof] for dof in old) else replace(support, motion=new)

    parts: dict[str, Any] = {"supports": [moved_on(support) for support in scene.supports]}
    parts |= {n: [changed(part, key) for part in getattr(scene, n)] for n, key in PLACES.items()}
    parts["bodies"] = [with_signals(body, change) for body in scene.bodies]
    moved = {direction: change(motion) for direction, motion in scene.motions.items()}
    still = all(new is scene.motions[direction] for direction, new in moved.items())
    base = scene.base if still else moved if isinstance(scene.base, dict) else moved["y"]
    pairs = [pair for name, new in parts.items() for pair in zip(getattr(scene, name), new, strict=True)]
    if base is scene.base and all(old is new for old, new in pairs):
        return scene
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # what it says of the scene was said when it was made
        return replace(scene, base=base, **parts)


def for_duration(signal: Any, duration: float) -> Any:
    """The signal for a run of that length, s: what its own `for_duration` returns, itself if it has none."""
    return signal.for_duration(duration) if hasattr(signal, "for_duration") else signal


def is_of_signal(path: str) -> bool:
    """Whether the path of a parameter leads into a signal, or to what an unbalance makes its signal of.

    Examples
    --------
    >>> [is_of_signal(path) for path in ("springs[0].foot.omega", "springs[0].stiffness", "bodies[1].forces[0].z")]
    [True, False, False]
    """
    return _PATH.match(path) is not None
