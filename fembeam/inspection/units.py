"""Numbers of a scene that look like another unit: a modulus in N/mm², hertz for rad/s, grams for kilograms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.scene import signals_of

if TYPE_CHECKING:
    from fembeam.beams import Beam
    from fembeam.model import Model
    from fembeam.scene import AnnularStop, Element, Scene, Stop

STEEP = 0.35  # rad; the slope of a beam
STICKY = 3.0  # a coefficient of friction beyond that of rubber


def doubts(model: Model) -> list[str]:
    """Warnings about the numbers of a model's scene, as sentences; of its bodies, too."""
    return [*of_bodies(model.scene), *of_undamped(model), *of_loads(model.scene, model)]


def of_bodies(scene: Scene) -> list[str]:
    """Those that need no modes: about beams, frames, and what stands on them."""
    found = _of_body(scene)
    for i, body in enumerate(scene.bodies):
        found += [f"bodies[{i}]: {said}" for said in _of_body(body)]
    return found


def of_each_body(model: Model) -> list[slice]:
    """The coordinates of each body, the scene's own first."""
    ends = np.cumsum([0, *map(sum, model.counts)])
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]


def of_undamped(model: Model) -> list[str]:
    """Bodies without damping beside others that have some: that of a scene is of its own body alone."""
    damped = [bool(model.system.C[own, own].any()) for own in of_each_body(model)]
    return [
        f"bodies[{i - 1}]: nothing damps it; the damping of a scene is that of its own body, give this one its own"
        for i, found in enumerate(damped)
        if i and damped[0] and not found
    ]


def _of_body(scene: Scene) -> list[str]:
    """Doubts about one beam or frame and what stands on it; of a structure, about its damping."""
    if not scene.named:
        return [*of_beam(scene.beam), *of_features(scene)]
    frames = [one for one in getattr(scene.beam, "bodies", (scene.beam,)) if hasattr(one, "members")]
    found = [said for frame in frames for said in of_frame(frame)]
    size = sum(frame.size for frame in frames)
    weight = sum(
        one.section.rho * one.section.A * float(h) for f in frames for one, h in zip(f.members, f.lengths, strict=True)
    )
    return [*found, *(of_parts(scene, weight, size, "frame") if frames else []), *of_damping(scene)]


def of_frame(frame: Any) -> list[str]:
    """Modulus, density, section and length of members, each kind of doubt once.

    Examples
    --------
    >>> from fembeam import Frame, Section
    >>> of_frame(Frame.straight(0.3, Section.circle(E=2.1e5, rho=7800, diameter=0.01)))
    ["member 'A-B': E = 210000 N/m² looks like N/mm²: steel has 2.1e11 N/m²"]
    """
    found: dict[str, str] = {}
    for one, length in zip(frame.members, frame.lengths.tolist(), strict=True):
        beam = one.beam(length, frame.in_plane)
        height = length / _slenderness(beam)
        if height > frame.size:
            found.setdefault("height", f"member {one.name!r}: a section {height:.3g} m high in a frame of "
                             f"{frame.size:.4g} m: is it in mm?")  # fmt: skip
        for said in of_beam(beam):
            if not said.startswith("the beam is"):  # short members are common, and may have shear
                found.setdefault(said.split("=")[0], f"member {one.name!r}: {said}")
    return list(found.values())


def of_beam(beam: Beam) -> list[str]:
    """Modulus, density, section and length.

    Examples
    --------
    >>> from fembeam import Beam, Section
    >>> of_beam(Beam(0.3, Section.circle(E=2.1e5, rho=7800, diameter=0.01)))
    ['E = 210000 N/m² looks like N/mm²: steel has 2.1e11 N/m²']
    """
    found = []
    middles = (np.array(beam.borders[:-1]) + np.array(beam.borders[1:])) / 2
    profile = beam.profile(middles)
    A, I = np.asarray(profile.A), np.asarray(profile.I)
    E, rho = np.asarray(profile.E), np.asarray(profile.rho)
    if E.min() < 1e6:
        found.append(f"E = {E.min():.6g} N/m² looks like N/mm²: steel has 2.1e11 N/m²")
    if E.max() > 2e12:
        found.append(f"E = {E.max():.6g} N/m² is stiffer than diamond (1.2e12 N/m²)")
    if rho.min() < 12:
        found.append(f"rho = {rho.min():.6g} kg/m³ looks like g/cm³ or t/mm³: steel has 7800 kg/m³")
    if rho.max() > 30_000:
        found.append(f"rho = {rho.max():.6g} kg/m³ is heavier than osmium (22 600 kg/m³)")
    shape = I / A**2
    if shape.min() < 1e-5 or shape.max() > 1e3:
        worst = shape.min() if shape.min() < 1e-5 else shape.max()
        found.append(f"I/A² = {worst:.2g}, where a square has 0.08: is one of them in mm² or mm⁴?")
    slenderness = _slenderness(beam)
    if slenderness < 10:
        doubt = "is its section in mm?" if slenderness < 1 else "shear is not modelled"
        found.append(f"the beam is {slenderness:.2g} times as long as high: {doubt}")
    if beam.length >= 1000:
        found.append(f"length = {beam.length:g} m looks like mm")
    return found


def _slenderness(beam: Beam) -> float:
    """Length over the height √(12 I/A) of a rectangle of the same A and I, where that is highest."""
    profile = beam.profile((np.array(beam.borders[:-1]) + np.array(beam.borders[1:])) / 2)
    return beam.length / math.sqrt(12.0 * float((np.asarray(profile.I) / np.asarray(profile.A)).max()))


def of_features(scene: Scene) -> list[str]:
    """Masses, gaps and damping."""
    z = np.linspace(0, scene.beam.length, 101)
    weight = float(np.mean(scene.beam.line_mass(z)) * scene.beam.length)
    return of_parts(scene, weight, scene.beam.length, "beam") + of_damping(scene)


def of_parts(scene: Scene, weight: float, length: float, body: str) -> list[str]:
    """Masses and gaps, against the mass and the length of what carries them."""
    found = []
    for i, mass in enumerate(scene.masses):
        if mass.mass > 1000 * weight:
            found.append(f"masses[{i}]{mass.quoted} = {mass.mass:g} kg is {mass.mass / weight:.2g} times the {body}: "
                         "is it in grams?")  # fmt: skip
    for i, part in enumerate(scene.acting):
        count = len(scene.stops)
        at = f"stops[{i}]{part.quoted}" if i < count else f"elements[{i - count}]{part.quoted}"
        found += [f"{at}: {said}" for said in [_of_gap(part, length, body), *_of_friction(part, length, body)] if said]
    return found


def _of_friction(part: Stop | AnnularStop | Element, length: float, body: str) -> Iterator[str]:
    """What is wrong with the friction of a stop."""
    friction, radius = getattr(part, "friction", None), getattr(part, "radius", None)
    if friction is not None and friction.mu >= STICKY:
        yield f"mu = {friction.mu:g} looks like per cent"
    if radius is not None and radius > 0.2 * length:
        yield f"a radius of {radius:g} m on a {body} of {length:.4g} m: is it in mm?"


def of_damping(scene: Scene) -> list[str]:
    """Ratios that look like per cent."""
    ratios = np.atleast_1d(np.asarray(getattr(scene.damping, "zeta", 0.0), dtype=float))
    return [f"zeta = {ratios.max():g} looks like per cent: 1 is critical damping"] if ratios.max() >= 0.5 else []


def _of_gap(part: Stop | AnnularStop | Element, length: float, body: str) -> str:
    """What is wrong with a gap; small slopes are assumed up to about 20 degrees."""
    if part.coordinate.rotation:
        return f"a gap of {part.gap:g} rad is no small slope: is it in degrees?" if abs(part.gap) > STEEP else ""
    return (
        f"a gap of {part.gap:g} m on a {body} of {length:.4g} m: is it in mm?" if abs(part.gap) > 0.2 * length else ""
    )


def of_loads(scene: Scene, model: Model) -> list[str]:
    """Amplitudes and frequencies of what drives the scene."""
    found = []
    for path, signal in signals_of(scene).items():
        size = getattr(signal, "std", getattr(signal, "amplitude", 0.0))
        long = math.inf if scene.named else scene.beam.length
        if path.endswith(("base", "foot")) and not callable(size) and np.max(np.abs(size)) > long:
            found.append(f"{path} moves by {np.max(np.abs(size)):g} m, more than the beam is long: is it in mm?")
    top = highest_driven(scene)
    if 0 < top < math.inf:
        near = model.omega[np.abs(2 * math.pi * top / np.maximum(model.omega, 1e-300) - 1) < 0.02]
        if len(near):
            found.append(
                f"omega = {top:g} rad/s looks like Hz: a mode has {near[0]:.6g} rad/s, {near[0] / 2 / math.pi:.4g} Hz"
            )
        if top > 1.05 * float(model.omega.max()):
            found.append(f"loads reach {top:g} rad/s, the highest mode kept has {model.omega.max():.6g} rad/s")
    return found


def highest_driven(scene: Scene) -> float:
    """Highest frequency in the loads, rad/s; 0 without loads, inf when they have none."""
    tops = []
    for signal in signals_of(scene).values():
        if getattr(signal, "band", None) is not None:
            tops.append(float(np.max(signal.band)))
        elif hasattr(signal, "omega1"):
            tops.append(max(signal.omega0, signal.omega1))
        elif hasattr(signal, "omega"):
            tops.append(float(np.max(signal.omega)))
        else:
            tops.append(math.inf)
    return max(tops, default=0.0)
