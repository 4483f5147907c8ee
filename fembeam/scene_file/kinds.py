"""What a table of a scene file can choose from by its `kind` (sections: `shape`), and which keys hold such tables."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_origin

import contacts
import solvers
from fembeam.beams import Section, Taper
from fembeam.excitation import BandNoise, Harmonic, Interpolation, Multisine, Pulse, Quantity, Record, SineSweep, Step
from fembeam.excitation.earthquake import earthquake
from fembeam.scene import PLACES, Fixed, Friction
from fembeam.scene_file.keys import Constructors
from fembeam.scene_file.structures import fixed
from fembeam.study.quantities import QUANTITIES

SHAPES: Constructors = {
    "general": Section,
    "rectangle": Section.rectangle,
    "circle": Section.circle,
    "tube": Section.tube,
    "taper": Taper,
}


def _laws() -> dict[str, Callable[..., Any]]:
    """The laws of `contacts` by the names they state themselves, and several in parallel."""
    public = [getattr(contacts, name) for name in contacts.__all__]
    classes = [law for law in public if isinstance(law, type) and issubclass(law, contacts.Law)]
    named = {kind: getattr(law, maker) if maker else law for law in classes for kind, maker in law.kinds.items()}
    return {**named, "parallel": contacts.parallel}


LAWS: Constructors = _laws()


def record(
    path: Path,
    quantity: Quantity,
    columns: tuple[int, int] = (0, 1),
    scale: float = 1.0,
    band: tuple[float, float] | None = None,
    detrend: bool = False,
    interpolation: Interpolation = "spectral",
    padding: float = 0.0,
) -> Record:
    """`Record.from_csv` for a scene file, which has to say what was measured."""
    return Record.from_csv(path, columns, scale, band, quantity, detrend, interpolation, padding)


def sine_sweep(
    amplitude: float, omega0: float, omega1: float, duration: float, rate: Literal["linear", "logarithmic"] = "linear"
) -> SineSweep:
    """`SineSweep` for a scene file, where `kind` is the kind of signal."""
    return SineSweep(amplitude, omega0, omega1, duration, rate)


SIGNALS: Constructors = {
    "harmonic": Harmonic,
    "multisine": Multisine,
    "band_noise": BandNoise,
    "noise_of_psd": BandNoise.of_psd,
    "rolled_off_noise": BandNoise.rolled_off,
    "record": record,
    "earthquake": earthquake,
    "pulse": Pulse,
    "sine_sweep": sine_sweep,
    "step": Step,
}
SOLVERS = {
    "exponential": "Exponential",
    "dormand_prince": "DormandPrince",
    "henon_rk2": "HenonRK2",
    "rk4": "RK4",
    "central_difference": "CentralDifference",
    "newmark": "Newmark",
    "generalized_alpha": "GeneralizedAlpha",
}


@dataclass(frozen=True)
class Nested:
    """A table inside a table: what it can be, the key that says which, the one taken when it does not."""

    constructors: Callable[[], Constructors]
    key: str = "kind"
    default: str = ""
    listed: bool = False  # several of them
    by_name: bool = False  # plain text is the name


MAKERS: Mapping[Any, Callable[..., Any]] = {Fixed: fixed}  # parts that a file makes otherwise
SECTION = Nested(lambda: SHAPES, "shape", "general")
SIGNAL = Nested(lambda: SIGNALS)
KEYS = {
    "section": SECTION,
    "law": Nested(lambda: LAWS),
    "laws": Nested(lambda: LAWS, listed=True),
    **{key: SIGNAL for key in PLACES.values()},
    "solver": Nested(  # made when asked for: methods are slow to import
        lambda: {name: getattr(solvers, method) for name, method in SOLVERS.items() if method in solvers.__all__}
    ),
    "quantity": Nested(lambda: QUANTITIES, by_name=True),
    "friction": Nested(lambda: {"coulomb": Friction}, default="coulomb"),
}


def nested(key: str, parameter: inspect.Parameter) -> Nested | None:
    """The kind of table a key holds; None for plain values."""
    if parameter.annotation is Section:
        return SECTION
    return None if get_origin(parameter.annotation) is Literal else KEYS.get(key)  # the quantity of a record is a word
