"""Names of a scene's numbers in words, with units, for axes."""

from __future__ import annotations

import re
from typing import Any

from fembeam.plot.style import short
from fembeam.scene import PointMoment, Scene

SIGNALS = {"base": "base", "foot": "foot", "signal": "drive", "motion": "motion"}
SIZES = {"amplitude": "amplitude", "std": "standard deviation", "mean": "mean", "peak": "peak", "size": "size"}
TIMES = {"omega0": ("first frequency ω", "rad s⁻¹"), "omega1": ("last frequency ω", "rad s⁻¹"),
         "band": ("band of ω", "rad s⁻¹"), "phase": ("phase", "rad"), "period": ("period", "s"),
         "duration": ("duration", "s"), "length": ("length", "s"), "at": ("start", "s"), "rise": ("rise time", "s"),
         "padding": ("padding", "s")}  # fmt: skip
LAWS = {"stiffness": ("contact stiffness", "N/m^p"), "exponent": ("exponent of the contact law", ""),
        "damping_factor": ("hysteresis factor", "s/m"), "damping": ("contact damping", "N s/m^p"),
        "limit": ("limit of slip", "N"), "limits": ("limit of slip", "N"), "yield_force": ("yield force", "N"),
        "static_limit": ("limit of stick", "N"), "hardening": ("hardening", "N/m"), "knots": ("knee", "m"),
        "slopes": ("slope of the contact law", "N/m"), "loading": ("stiffness in loading", "N/m"),
        "coefficients": ("coefficient of the contact law", "N/m"), "unloading": ("stiffness in unloading", "N/m"),
        "entry_rate_floor": ("floor of entry rates", "m/s")}  # fmt: skip
PARTS = {
    "gap": ("gap", "m"), "clearance": ("clearance", "m"), "centre": ("centre of the circle", "m"),
    "z": ("place z", "m"), "mass": ("mass", "kg"), "inertia": ("rotary inertia", "kg m²"),
    "stiffness": ("stiffness", "N/m"), "rotational": ("rotational stiffness", "N m/rad"),
    "damping": ("damping", "N s/m"), "length": ("length", "m"), "E": ("Young's modulus", "N/m²"),
    "rho": ("density", "kg/m³"), "A": ("area", "m²"), "I": ("second moment of area", "m⁴"),
    "gravity": ("gravity", "m/s²"), "alpha": ("Rayleigh's α", "1/s"), "beta": ("Rayleigh's β", "s"),
    "axial_force": ("axial force", "N"), "foundation": ("foundation stiffness", "N/m²"),
    "velocity": ("velocity", "m/s"), "offset": ("offset of the centre of mass", "m"), "zeta": ("damping ratio ζ", ""),
    "on": ("second place", "m"), "to": ("second place", "m"), "fibre": ("distance of the outer fibre", "m"),
    "spin": ("spin", "rad/s"), "mu": ("coefficient of friction", ""),
}  # fmt: skip
TURNED = {  # of rotation
    "m": "rad", "N": "N m", "N/m^p": "N m/rad^p", "s/m": "s/rad", "N s/m^p": "N m s/rad^p", "N/m": "N m/rad",
    "m/s": "rad/s", "N s/m": "N m s/rad", "N s/m^((p+1)/2)": "N m s/rad^((p+1)/2)", "1/m^n": "1/rad^n",
}  # fmt: skip
ACTING = "stops", "elements", "springs", "dashpots"
OWNERS = {"supports": "support", "masses": "mass", "springs": "spring", "dashpots": "dashpot", "stops": "stop",
          "elements": "element", "forces": "force", "bodies": "beam"}  # fmt: skip


def axis_name(path: str, scene: Scene) -> str:
    """A parameter of a scene as the words of an axis, with its unit; a path that is not known stays as it is.

    Examples
    --------
    >>> from fembeam import Beam, Scene, Section
    >>> scene = Scene(Beam(0.5, Section.circle(2.1e11, 7800.0, 0.01)))
    >>> axis_name("forces[0].signal.omega", scene), axis_name("stops[1].gap", scene)
    ('drive frequency ω / rad s⁻¹', 'gap of stop 1 / m')
    """
    name, unit = _named(path, scene)
    return f"{name} / {unit}" if unit else name or path


def parameter_unit(path: str, scene: Scene) -> str:
    """The unit of a parameter; empty without one, and of a path that is not known.

    Examples
    --------
    >>> from fembeam import Beam, Scene, Section
    >>> scene = Scene(Beam(0.5, Section.circle(2.1e11, 7800.0, 0.01)))
    >>> parameter_unit("stops[0].gap", scene), parameter_unit("base.std", scene), parameter_unit("damping.zeta", scene)
    ('m', 'm', '')
    """
    return _named(path, scene)[1]


def _named(path: str, scene: Scene) -> tuple[str, str]:
    """Name and unit of a parameter; a name that is not known is empty."""
    owner = re.match(r"(bodies\[(\d+)\]\.)?(\w+)(\[(\d+)\])?", path)
    last = re.sub(r"\[\d+\]$", "", path.rsplit(".", 1)[-1])
    assert owner is not None
    kind, number, beam = owner[3], owner[5], owner[2]
    signal = next((part for part in path.split(".") if part in SIGNALS), "")
    if signal:
        name, unit = _of_signal(path, scene, kind, beam, number, signal, last)
    elif ".nodes." in path:
        component = path.removesuffix("]").rpartition("[")[2]
        name, unit = f"{'xyz'[int(component)]} of node {last}", "m"
    else:
        name, unit = _of_part(scene, beam, kind, int(number or 0), last, ".law." in path)
        if last == "coefficients" and path.endswith("]"):  # N/m^j of the j-th
            j = int(path.removesuffix("]").rpartition("[")[2]) + 1
            name, unit = name.replace("coefficient", f"coefficient {j}"), unit if j == 1 else f"{unit}^{j}"
    return name + (f" of beam {int(beam) + 1}" if name and beam else ""), unit


def _of_part(scene: Scene, beam: str | None, kind: str, number: int, last: str, of_law: bool) -> tuple[str, str]:
    """Name and unit of a number of a part, or of its law."""
    if kind == "dashpots" and last == "rotational":
        return f"rotational damping of {_owner(scene, beam, kind, number)}", "N m s/rad"
    name, unit = (LAWS if of_law else PARTS).get(last, ("", ""))
    part = _part(scene, beam, kind, number) if kind in ACTING and last not in ("z", "on", "to") else None
    if of_law and part is not None and last != "coefficients":
        unit = part.law.units.get(last, unit)
    if part is not None and _turns(part):
        unit = TURNED.get(unit, unit)
    return name + (f" of {_owner(scene, beam, kind, number)}" if name and kind in OWNERS else ""), unit


def _turns(part: Any) -> bool:
    """Whether a part acts on a rotation."""
    coordinate, direction = getattr(part, "coordinate", None), getattr(part, "direction", None)
    return bool(coordinate.rotation) if coordinate is not None else isinstance(direction, str) and "r" in direction


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
    name = rf"$\omega_{{{number}}}${space}{of} =" if number.isdigit() else f"{coordinate}:"
    return f"{name} {short(omega)}"


def _owner(scene: Scene, beam: str | None, kind: str, number: int) -> str:
    """What a part is called: its name, else its kind and number."""
    part = _part(scene, beam, kind, number)
    return f"{OWNERS[kind]} {number}" if part is None or part.name is None else str(part.name)


def _part(scene: Scene, beam: str | None, kind: str, number: int) -> Any:
    """A part of a scene, or of one of its further beams; None of one that it does not have."""
    parts = getattr(scene if beam is None else scene.bodies[int(beam)], kind)
    return parts[number] if number < len(parts) else None


def _of_signal(
    path: str, scene: Scene, kind: str, beam: str | None, number: str | None, signal: str, last: str
) -> tuple[str, str]:
    """Name and unit of a signal's number."""
    if last == "omega":
        name, unit = "drive frequency ω", "rad s⁻¹"
    elif last in SIZES:
        name, unit = f"{SIGNALS[signal]} {SIZES[last]}", "N" if kind == "forces" else "m"
    else:
        words, unit = TIMES.get(last, ("", ""))
        name = f"{SIGNALS[signal]} {words}" if words else ""
    along = re.search(r"\b(?:base|motion)\.(r?[xyz])\.", path)
    moment = kind == "forces" and isinstance(_part(scene, beam, kind, int(number or 0)), PointMoment)
    if moment or (along and along[1].startswith("r")):
        unit = TURNED.get(unit, unit)
    name += f" along {along[1]}" if name and along else ""
    return name + (f" of {_owner(scene, beam, kind, int(number or 0))}" if name and signal == "motion" else ""), unit
