"""What the labels of a rig say: the name of a part, then its numbers with units, its law, its signal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from fembeam.plot.units import length_for
from fembeam.scene import (
    Clamped,
    Dashpot,
    Element,
    Fixed,
    Guided,
    Impactor,
    LumpedMass,
    Pinned,
    PointForce,
    PointMoment,
    Spring,
    Stop,
    support_motion,
)
from fembeam.support import is_finite

if TYPE_CHECKING:
    from fembeam.scene import ScenePart

WIDE = 22  # characters of a line


def label(part: ScenePart) -> str:
    """The name of a part and what there is to say about it, in lines.

    Examples
    --------
    >>> from contacts import Hertz
    >>> print(label(Stop(0.25, Hertz(1e9), gap=5e-4, name="valve")))
    valve
    gap 0.5 mm
    Hertz
    """
    joined = part.label.replace(" m", "\u00a0m").replace(" at ", " at\u00a0")  # a place keeps its unit
    lines = [line.replace("\u00a0", " ") for line in textwrap.wrap(joined, WIDE)]
    return "\n".join([*lines, *(line for line in _facts(part) if line)])


def _facts(part: Any) -> Iterator[str]:
    """The numbers of one part."""
    match part:
        case Clamped() | Pinned() | Guided() | Fixed():
            yield from motion_words(part)
        case LumpedMass():
            yield f"{part.mass:.4g} kg"
            yield f"J = {part.inertia:.3g} kg m²" if is_finite(part.inertia) and part.inertia else ""
            offset: Any = part.offset if is_finite(part.offset) else 0.0
            yield f"{length(abs(offset))} {'ahead' if offset > 0 else 'behind'}" if offset else ""
        case Spring():
            yield f"{part.stiffness:.6g} N/m" if part.stiffness else ""
            yield f"{part.rotational:.6g} N m/rad" if part.rotational else ""
            yield f"foot: {signal_words(part.foot, 'm')}" if part.foot is not None else ""
        case Dashpot():
            yield f"{part.damping:.6g} N s/m" if part.damping else ""
            yield f"{part.rotational:.6g} N m s/rad" if part.rotational else ""
        case Stop() | Element():
            yield gap_words(part.gap, part.coordinate.rotation) if part.gap or not part.always else ""
            yield law_words(part.law)
            yield friction_words(part)
            yield f"to {part.coordinate.to_words}" if part.name and part.coordinate.to else ""
        case PointForce() | PointMoment():
            yield signal_words(part.signal, "N m" if isinstance(part, PointMoment) else "N")
        case Impactor():
            yield f"{part.mass:.4g} kg" + (f", {part.velocity:.3g} m/s" if part.velocity else "")
            yield gap_words(part.gap, False)
            yield law_words(part.law)
            yield f"own spring {part.stiffness:.6g} N/m" if part.stiffness else ""


def motion_words(support: Any) -> list[str]:
    """How a support moves, in words.

    Examples
    --------
    >>> from fembeam import Harmonic
    >>> motion_words(Pinned(0.5, motion={"y": Harmonic(1e-3, 46.0)})), motion_words(Pinned(0.5))
    (['y: Harmonic, 1 mm, 46 rad/s'], [])
    """
    units = {True: "rad", False: "m"}
    return [
        f"{dof}: {signal_words(signal, units[dof.startswith('r')])}".replace("\n", " ")
        for dof, signal in support_motion(support).items()
    ]


def gap_words(gap: float, rotation: bool) -> str:
    """A clearance or a preload.

    Examples
    --------
    >>> gap_words(5e-4, False), gap_words(0.0, False), gap_words(-2e-5, False), gap_words(0.02, True)
    ('gap 0.5 mm', 'no gap', 'pressed on by 0.02 mm', 'gap 0.02 rad')
    """
    if gap == 0.0:
        return "no gap"
    size = f"{abs(gap):.4g} rad" if rotation else length(abs(gap))
    return f"gap {size}" if gap > 0.0 else f"pressed on by {size}"


def friction_words(part: Any) -> str:
    """The coefficient of friction of a stop that has one.

    Examples
    --------
    >>> from contacts import Hertz
    >>> from fembeam import Friction
    >>> friction_words(Stop("C", Hertz(1e9), direction="-y", friction=Friction(0.3, 5e5), tangent="x"))
    'μ = 0.3'
    """
    friction = getattr(part, "friction", None)
    return "" if friction is None else f"μ = {friction.mu:.4g}"


def length(value: float) -> str:
    """A length in mm, from 1 m on in m, below 0.01 mm in µm or nm."""
    scale, unit = (1.0, "m") if abs(value) >= 1.0 else length_for(value)
    return f"{scale * value:.4g} {unit}"


def law_words(law: Any) -> str:
    """The kind of a law, of a sum those of its parts, of one's own its name."""
    parts = getattr(law, "parts", (law,))
    name = " + ".join(getattr(part, "name", None) or type(part).__name__ for part in parts)
    return "\n".join(textwrap.wrap(name, WIDE))


def signal_words(signal: Any, unit: str) -> str:
    """The kind of a signal, its size and frequency where it is one tone.

    Examples
    --------
    >>> from fembeam import Harmonic, Pulse
    >>> print(signal_words(Harmonic(1.5, 300.0), "N"))
    Harmonic, 1.5 N,
    300 rad/s
    >>> signal_words(Pulse(10.0, 1e-3), "N"), signal_words(Harmonic(9.81, 0.0), "N")
    ('Pulse', 'constant 9.81 N')
    """
    size: Any = getattr(signal, "amplitude", None)
    omega: Any = getattr(signal, "omega", None)
    if is_finite(omega) and is_finite(size):
        amount = length(size) if unit == "m" else f"{size:.4g} {unit}"
        return f"Harmonic, {amount},\n{omega:.4g} rad/s" if omega else f"constant {amount}"
    name = getattr(signal, "__name__", None) or type(signal).__name__
    return "function of t" if name == "<lambda>" else str(name)
