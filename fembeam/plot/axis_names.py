"""Names of a scene's numbers in words, with units, for axes."""

from __future__ import annotations

import re
from typing import Any

from fembeam.scene import PointMoment, Scene

SIGNALS = {"base": "base", "foot": "foot", "signal": "drive"}
LAWS = {"stiffness": ("contact stiffness", "N/m^p"), "exponent": ("exponent of the contact law", ""),
        "damping_factor": ("hysteresis factor", "s/m"), "damping": ("contact damping", "N s/m^p"),
        "limit": ("limit of slip", "N")}  # fmt: skip
PARTS = {
    "gap": ("gap", "m"), "clearance": ("clearance", "m"), "centre": ("centre of the circle", "m"),
    "z": ("place z", "m"), "mass": ("mass", "kg"), "inertia": ("rotary inertia", "kg m²"),
    "stiffness": ("stiffness", "N/m"), "rotational": ("rotational stiffness", "N m/rad"),
    "damping": ("damping", "N s/m"), "length": ("length", "m"), "E": ("Young's modulus", "N/m²"),
    "rho": ("density", "kg/m³"), "A": ("area", "m²"), "I": ("second moment of area", "m⁴"),
    "gravity": ("gravity", "m/s²"), "alpha": ("Rayleigh's α", "1/s"), "beta": ("Rayleigh's β", "s"),
    "axial_force": ("axial force", "N"), "foundation": ("foundation stiffness", "N/m²"),
    "velocity": ("velocity", "m/s"), "offset": ("offset of the centre of mass", "m"), "zeta": ("damping ratio ζ", ""),
    "on": ("second place", "m"), "to": ("second place", "m"),
}  # fmt: skip
TURNED = {"m": "rad", "N": "N m", "N/m^p": "N m/rad^p", "s/m": "s/rad", "N s/m^p": "N m s/rad^p"}  # of rotation
OWNERS = {"masses": "mass", "springs": "spring", "dashpots": "dashpot", "stops": "stop", "elements": "element",
          "forces": "force", "bodies": "beam"}  # fmt: skip


def axis_name(path: str, scene: Scene) -> str:
    """A parameter of a scene as the words of an axis, with its unit; a path that is not known stays as it is.

    Examples
    --------
    >>> from fembeam import Beam, Scene, Section
    >>> scene = Scene(Beam(0.5, Section.circle(2.1e11, 7800.0, 0.01)))
    >>> axis_name("forces[0].signal.omega", scene), axis_name("stops[1].gap", scene)
    ('drive frequency ω / rad s⁻¹', 'gap of stop 1 / m')
    """
    owner = re.match(r"(bodies\[(\d+)\]\.)?(\w+)(\[(\d+)\])?", path)
    last = re.sub(r"\[\d+\]$", "", path.rsplit(".", 1)[-1])
    assert owner is not None
    kind, number, beam = owner[3], owner[5], owner[2]
    signal = next((part for part in path.split(".") if part in SIGNALS), "")
    if signal:
        turns = kind == "forces" and isinstance(_part(scene, beam, kind, int(number)), PointMoment)
        name, unit = _of_signal(kind, signal, last, turns)
        along = re.match(r"(?:bodies\[\d+\]\.)?base\.([xyz])\.", path)
        name += f" along {along[1]}" if name and along else ""
    elif kind == "dashpots" and last == "rotational":
        name, unit = f"rotational damping of {_owner(scene, beam, kind, int(number))}", "N m s/rad"
    else:
        name, unit = (LAWS if ".law." in path else PARTS).get(last, ("", ""))
        acts = kind in ("stops", "elements") and last not in ("z", "on", "to")
        if acts and (part := _part(scene, beam, kind, int(number))) and part.coordinate.rotation:
            unit = TURNED.get(unit, unit)
        name += f" of {_owner(scene, beam, kind, int(number or 0))}" if name and kind in OWNERS else ""
    if not name:
        return path
    name += f" of beam {int(beam) + 1}" if beam else ""
    return f"{name} / {unit}" if unit else name


def coordinate_name(name: str) -> str:
    """A coordinate of a reduced model, one of `Model.names`, in words.

    Examples
    --------
    >>> [coordinate_name(name) for name in ("1", "static", "2 of beam 1", "impactor 0")]
    ['mode 1', 'static shape', 'mode 2 of beam 1', 'impactor 0']
    """
    return f"mode {name}" if name[0].isdigit() else name.replace("static", "static shape")


def frequency_words(coordinate: str, omega: float) -> str:
    r"""The frequency of a coordinate given in words: that of a static shape is no natural one.

    Examples
    --------
    >>> print(frequency_words("mode 2 of beam 1", 310.2), frequency_words("static shape", 473.1), sep=", ")
    $\omega_{2}$ of beam 1 = 310, static shape: 473
    """
    number, space, of = coordinate.removeprefix("mode ").partition(" ")
    return rf"$\omega_{{{number}}}${space}{of} = {omega:.0f}" if number.isdigit() else f"{coordinate}: {omega:.0f}"


def _owner(scene: Scene, beam: str | None, kind: str, number: int) -> str:
    """What a part is called: its name, else its kind and number."""
    part = _part(scene, beam, kind, number)
    return f"{OWNERS[kind]} {number}" if part is None or part.name is None else str(part.name)


def _part(scene: Scene, beam: str | None, kind: str, number: int) -> Any:
    """A part of a scene, or of one of its further beams; None of one that it does not have."""
    parts = getattr(scene if beam is None else scene.bodies[int(beam)], kind)
    return parts[number] if number < len(parts) else None


def _of_signal(kind: str, signal: str, last: str, turns: bool) -> tuple[str, str]:
    """Name and unit of a signal's number."""
    if last == "omega":
        return "drive frequency ω", "rad s⁻¹"
    if last == "phase":
        return f"{SIGNALS[signal]} phase", "rad"
    if last == "amplitude":
        return f"{SIGNALS[signal]} amplitude", "m" if kind != "forces" else "N m" if turns else "N"
    return "", ""
