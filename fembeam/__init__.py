"""Beams with pluggable local nonlinearities: from a scene to transients, orbits and random response.

    import fembeam as fb
    from contacts import Hysteretic

    steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    scene = fb.Scene(
        beam=fb.Beam(0.2599, steel),
        supports=[fb.Clamped(0.0)],
        masses=[fb.LumpedMass(0.24445, mass=25.4e-3, inertia=3.0e-6)],
        stops=[fb.Stop(0.24445, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
        damping=fb.ModalDamping([0.02, 0.01]),
        base=fb.Harmonic(amplitude=1e-3, omega=195.0),
    )
    run = scene.reduce(modes=2).simulate(duration=1.0, dt=1e-4)

Everything is imported where it is first used, so that this import stays quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_OFFERED = {
    "beams": "Section Taper Beam ModalDamping Rayleigh",
    "structures": "Frame Joint Member Scale Structure",
    "scene": "AnnularStop Clamped Dashpot Disk Element Fixed Friction Guided Impactor LumpedMass Pinned PointForce "
    "PointMoment Scene Spring Stop Unbalance",
    "excitation": "Harmonic Multisine BandNoise RollOff Record Pulse SineSweep Step",
    "model": "Model Attractor Orbit Branch Run load",
    "response": "response_spectrum",
    "statistics": "moments pdf psd",
}
_HOME = {name: folder for folder, names in _OFFERED.items() for name in names.split()}
_MODULES = ["plot", "study"]

__all__ = [
    "AnnularStop", "Attractor", "BandNoise", "Beam", "Branch", "Clamped", "Dashpot", "Disk", "Element", "Fixed",
    "Frame", "Friction", "Guided", "Harmonic", "Impactor", "Joint", "LumpedMass", "Member", "ModalDamping", "Model",
    "Multisine", "Orbit", "Pinned", "PointForce", "PointMoment", "Pulse", "Rayleigh", "Record", "RollOff", "Run",
    "Scale", "Scene", "Section", "SineSweep", "Spring", "Step", "Stop", "Structure", "Taper", "Unbalance", "load",
    "moments", "pdf", "plot", "psd", "response_spectrum", "study",
]  # fmt: skip

if TYPE_CHECKING:
    from fembeam import plot, study
    from fembeam.beams import Beam, ModalDamping, Rayleigh, Section, Taper
    from fembeam.excitation import BandNoise, Harmonic, Multisine, Pulse, Record, RollOff, SineSweep, Step
    from fembeam.model import Attractor, Branch, Model, Orbit, Run, load
    from fembeam.response import response_spectrum
    from fembeam.scene import (
        AnnularStop,
        Clamped,
        Dashpot,
        Disk,
        Element,
        Fixed,
        Friction,
        Guided,
        Impactor,
        LumpedMass,
        Pinned,
        PointForce,
        PointMoment,
        Scene,
        Spring,
        Stop,
        Unbalance,
    )
    from fembeam.statistics import moments, pdf, psd
    from fembeam.structures import Frame, Joint, Member, Scale, Structure


def _check_neighbours() -> None:
    """Say in one sentence when another module shadows one of our packages."""
    from importlib.util import find_spec
    from pathlib import Path

    home = Path(__file__).resolve().parent.parent
    for name in ("contacts", "reduction", "solvers"):
        spec = find_spec(name)
        if spec is None or spec.origin is None or Path(spec.origin).resolve().parent.parent != home:
            found = "nothing" if spec is None else spec.origin or ", ".join(spec.submodule_search_locations or ())
            raise ImportError(
                f"fembeam needs its own package {name!r} beside it in {home}, but Python finds {found}; "
                "rename or remove that, or put fembeam's folder first on sys.path"
            )


_check_neighbours()


def __getattr__(name: str) -> Any:
    """Import public names when they are asked for."""
    if name in _MODULES:
        return import_module(f"fembeam.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'fembeam' has no attribute {name!r}")
    value = getattr(import_module(f"fembeam.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names."""
    return __all__
