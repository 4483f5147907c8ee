"""Named quantities of a run, shared by all studies: a number or an array of fixed shape each.

A quantity is any function of a run. Those here say with `sampled` whether they need output samples; without, a run
keeps its contact log only, which is the cheapest. `stop` is the number or the name of a stop or element. The signal
looked at is δ of a stop, or u at `z`, or u of the tip in a scene without stops.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fembeam.model import Run, extremes_of, places
from fembeam.model.extremes import of_top
from fembeam.plot.axis_names import TURNED
from fembeam.scene import Place, Scene, turns_at
from fembeam.statistics import psd
from fembeam.support import is_finite, is_pair, is_whole, require, warn

if TYPE_CHECKING:
    from fembeam.study.gradients import Change

Vector = NDArray[np.float64]
Quantity = Callable[[Run], Any]

PROBABILITIES = np.arange(1, 20) / 20
STRETCHES = 4  # of the run without overlap, each a segment of the spectrum
FEWEST_IN_CONTACT = 4  # samples: of 4.4 the mean energy of a beam on its stop is right to 1e-4, of 1.4 to 4e-3


@dataclass(frozen=True)
class OfSignal:
    """What is read off δ of a stop, or u at `z`."""

    stop: int | str = 0
    z: Place | None = None
    sampled: ClassVar[bool] = True

    def signal(self, run: Run) -> tuple[Vector, Vector]:
        """The signal and its rate."""
        return signal(run, self.stop, self.z)

    def change(self, change: Change) -> tuple[Vector, Vector]:
        """Derivatives of the signal and of its rate."""
        return change.signal(self.stop, self.z)


@dataclass(frozen=True)
class OfContacts:
    """What is read off the log of one stop's contacts."""

    stop: int | str = 0
    sampled: ClassVar[bool] = False

    def mine(self, run: Run) -> Any:
        """(c,) which contacts of the log are those of the stop."""
        return run.contacts.stop == (run.number(self.stop) if self.stop or len(run.stops) else 0)


class Amplitude(OfSignal):
    """Half the range of δ (or u at `z`), m; extremes between samples by cubics."""

    unit: ClassVar[str] = "m"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        lowest, highest = extremes_of(run.t, *self.signal(run))
        return (highest - lowest) / 2

    def derivative(self, change: Change) -> float:
        """By a parameter."""
        (u, v), both = self.signal(change.run), self.change(change)
        return (of_top(change.run.t, u, v, *both) - of_top(change.run.t, -u, -v, *both)) / 2


class Rms(OfSignal):
    """Root mean square of δ (or u at `z`) about its mean, m; by trapezia over the samples, so their times matter."""

    unit: ClassVar[str] = "m"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        u = self.signal(run)[0]
        return math.sqrt(mean_in_time(run, (u - mean_in_time(run, u)) ** 2))

    def derivative(self, change: Change) -> float:
        """By a parameter, at samples whose times do not change."""
        u = self.signal(change.run)[0]
        u = u - mean_in_time(change.run, u)
        return change.mean(u**2, 2.0 * u * self.change(change)[0]) / (2.0 * self(change.run))


class PeakForce(OfContacts):
    """Largest contact force of one stop, N; 0 without contact."""

    unit: ClassVar[str] = "N"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        return float(run.contacts.peak_force[self.mine(run)].max(initial=0.0))

    def derivative(self, change: Change) -> float:
        """By a parameter: that of the contact with the largest force; 0 without contact."""
        mine = self.mine(change.run)
        forces, changes = change.run.contacts.peak_force[mine], change.of_contacts("peak_force")[mine]
        return float(changes[np.argmax(forces)]) if len(forces) else 0.0


class MeanForce(OfContacts):
    """Mean of the peak forces of one stop's contacts, N; NaN without contact. Random response: far less scatter."""

    unit: ClassVar[str] = "N"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        return _mean(run.contacts.peak_force[self.mine(run)])

    def derivative(self, change: Change) -> float:
        """By a parameter, the number of contacts being the same."""
        return _mean(change.of_contacts("peak_force")[self.mine(change.run)])


class ContactTime(OfContacts):
    """Mean duration of one stop's contacts that ended, s; NaN without contact."""

    unit: ClassVar[str] = "s"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        log = run.contacts
        durations = (log.t_out - log.t_in)[self.mine(run)]
        return _mean(durations[np.isfinite(durations)])

    def derivative(self, change: Change) -> float:
        """By a parameter, the number of contacts being the same."""
        changes = (change.of_contacts("exits") - change.of_contacts("entries"))[self.mine(change.run)]
        return _mean(changes[np.isfinite(changes)])


class ImpactRate(OfContacts):
    """Contacts of one stop per second."""

    unit: ClassVar[str] = "1/s"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        return float(np.sum(self.mine(run))) / run.reached


@dataclass(frozen=True)
class Psd:
    """Power spectral density of δ (or u at `z`), mean level in equal parts of a band, m² s/rad: (parts,).

    `band` in rad/s; `parts` ≥ 1 of them; `dt` of the run must resolve the band.
    """

    band: tuple[float, float] = (1.0, 1200.0)
    parts: int = 12
    stop: int | str = 0
    z: Place | None = None
    sampled: ClassVar[bool] = True

    def __post_init__(self) -> None:
        two = is_pair(self.band) and all(map(is_finite, self.band))
        right = two and 0 <= self.band[0] < self.band[1]
        require(right, "band must be (lo, hi) in rad/s, 0 ≤ lo < hi", self.band, "Psd", "e.g. (1, 1200)")
        right = is_whole(self.parts) and self.parts >= 1
        require(right, "parts must be a whole number of at least 1", self.parts, "Psd", "e.g. 12")

    def __call__(self, run: Run) -> Vector:
        """Value of a run."""
        require(len(run.t) > 1, "the run must have samples", len(run.t), "Psd", "give a dt below the duration")
        dt = float(run.t[1] - run.t[0])
        fits = self.band[1] * dt < np.pi
        require(fits, f"dt must be below {np.pi / self.band[1]:.3g} s for a band to {self.band[1]:g} rad/s", dt, "Psd",
                "sample more often")  # fmt: skip
        width = (self.band[1] - self.band[0]) / self.parts
        segment = int(np.ceil(4 * 2 * np.pi / (width * dt)))  # four lines in each part
        fewest = 8 * segment <= len(run.t)
        require(fewest, f"the run must last {8 * segment * dt:.3g} s for parts of {width:g} rad/s", float(run.t[-1]),
                "Psd", "run longer, or use fewer parts")  # fmt: skip
        # as fine as the run allows: of a peak near a border coarse lines carry most into the part beside it
        spectrum = psd(signal(run, self.stop, self.z)[0], dt, max(8, len(run.t) // STRETCHES))
        # a line stands for half a step to both sides: whole lines would make parts of four now and then five
        step = spectrum.omega[1]
        borders = np.concatenate(([0.0], spectrum.omega + step / 2))
        below = np.concatenate(([0.0], np.cumsum(spectrum.density) * step))
        edges = np.linspace(*self.band, self.parts + 1)
        return np.asarray(np.diff(np.interp(edges, borders, below)) / width)


class Density(OfSignal):
    """The density of δ (or u at `z`) as its quantiles at 5, 10, … 95 %, m: (19,); needs no bins.

    Each sample but the last stands for the time to the next: of a period, the last is the first once more.
    """

    def __call__(self, run: Run) -> Vector:
        """Value of a run."""
        return np.asarray(np.quantile(self.signal(run)[0][:-1], PROBABILITIES))


@dataclass(frozen=True)
class MeanEnergy:
    """Mean energy stored in the beam, ½ Σ (q̇² + ω² q²), J; trapezoidal over the samples.

    While a contact lasts it is less, by what the stop holds: a UserWarning tells of contacts too short for the samples.
    """

    sampled: ClassVar[bool] = True
    unit: ClassVar[str] = "J"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        _warn_of_short_contacts(run)
        return mean_in_time(run, np.sum(run.q_dot**2 + (run.q * run.readout.omega) ** 2, axis=1) / 2)

    def derivative(self, change: Change) -> float:
        """By a parameter."""
        run = change.run
        assert run.model is not None
        omega = run.model.omega
        energy = np.sum(run.q_dot**2 + (run.q * omega) ** 2, axis=1) / 2
        potential = run.q * (omega**2 * change.q + 0.5 * run.q @ change.stiffness)
        return change.mean(energy, np.sum(run.q_dot * change.q_dot + potential, axis=1))


@dataclass(frozen=True)
class Power:
    """Mean power that one stop or element takes, W: work on it and loss by friction over the time of the samples."""

    stop: int | str = 0
    sampled: ClassVar[bool] = True
    unit: ClassVar[str] = "W"

    def __call__(self, run: Run) -> float:
        """Value of a run."""
        require(len(run.t) > 1, "the run must have samples", len(run.t), type(self).__name__,
                "give a dt below the duration")  # fmt: skip
        work = self.work(run, run.number(self.stop))
        return float((work[-1] - work[0]) / (run.t[-1] - run.t[0]))

    def work(self, run: Run, number: int) -> Vector:
        """Up to each sample, J."""
        return np.asarray(run.losses.history[:, number] + run.friction_loss[:, number])


class WearPower(Power):
    """Mean work rate by friction of one stop, W: μN|v| of its slip over the time of the samples, which wear goes by."""

    rubbing: ClassVar[bool] = True

    def work(self, run: Run, number: int) -> Vector:
        """Up to each sample, J."""
        require(run.rubs[number, 1] > 0.0, "the stop must have friction", self.stop, "WearPower", "give it a Friction")
        return np.asarray(run.friction_loss[:, number])


QUANTITIES: dict[str, Callable[..., Quantity]] = {
    "amplitude": Amplitude,
    "rms": Rms,
    "peak_force": PeakForce,
    "mean_force": MeanForce,
    "contact_time": ContactTime,
    "impact_rate": ImpactRate,
    "psd": Psd,
    "density": Density,
    "energy": MeanEnergy,
    "power": Power,
    "wear_power": WearPower,
}


def named(quantity: str | Quantity) -> Quantity:
    """The quantity of that name, or the function itself.

    Raises
    ------
    ValueError : an unknown name; TypeError : neither a name nor a function.

    Examples
    --------
    >>> named("peak_force")
    PeakForce(stop=0)
    """
    if isinstance(quantity, str):
        require(quantity in QUANTITIES, f"quantity must be one of {', '.join(QUANTITIES)}, or a function of a run",
                quantity, "study", "choose one")  # fmt: skip
        return QUANTITIES[quantity]()
    if not callable(quantity) or isinstance(quantity, type):
        raise TypeError(f"quantity must be a name or a function of a run, got {quantity!r}; e.g. 'peak_force'")
    return quantity


def label(quantity: Quantity) -> str:
    """A name for tables and figures.

    Examples
    --------
    >>> label(PeakForce(stop=1))
    'peak_force(stop=1)'
    """
    names = {kind: name for name, kind in QUANTITIES.items()}
    name = names.get(type(quantity))  # type: ignore[call-overload]
    if name is None:
        return getattr(quantity, "__name__", None) or repr(quantity)
    own = [(f.name, getattr(quantity, f.name)) for f in fields(quantity)]  # type: ignore[arg-type]
    plain = QUANTITIES[name]()
    changed = ", ".join(f"{key}={value}" for key, value in own if value != getattr(plain, key))
    return f"{name}({changed})" if changed else name


def unit_of(quantity: Quantity, scene: Scene) -> str:
    """The unit of a named quantity of a scene's runs; empty of others.

    Examples
    --------
    >>> from fembeam import Beam, Scene, Section
    >>> scene = Scene(Beam(0.5, Section.circle(2.1e11, 7800.0, 0.01)))
    >>> unit_of(PeakForce(), scene), unit_of(Rms(), scene), unit_of(max, scene)
    ('N', 'm', '')
    """
    unit: str = getattr(quantity, "unit", "") if type(quantity) in QUANTITIES.values() else ""
    z, stop = getattr(quantity, "z", None), getattr(quantity, "stop", 0)
    turning = turns_at(z) if z is not None else stop in _turning(scene)
    return TURNED.get(unit, unit) if turning else unit


def check_contact(quantity: Quantity, scene: Scene) -> None:
    """Raise ValueError where a named quantity asks for a contact that no run of the scene has.

    Of joined bodies the run tells; a made name may go on with " (2)", or end before the " m" where a place is a node.
    """
    stop, known = getattr(quantity, "stop", 0), _contacts(scene)
    if type(quantity) not in QUANTITIES.values() or stop == 0 or scene.joints:
        return
    if isinstance(stop, str):
        near = get_close_matches(stop, [name for name, *_ in known], 1, 0.0)
        alike = (made and (stop.startswith(name) or name.startswith(stop)) for name, _, made in known)
        right = stop in [name for name, *_ in known] or any(alike)
        require(right, "no contact has this name", stop, label(quantity),
                f"the nearest is {near[0]!r}" if near else "there is none at all")  # fmt: skip
    else:
        right = is_whole(stop) and -len(known) <= stop < len(known)
        require(right, f"stop must be below {len(known)}, the number of stops", stop, label(quantity), "count from 0")


def _contacts(scene: Scene) -> list[tuple[str, bool, bool]]:
    """Name of every contact in the order of the log, whether it acts on a rotation, whether its name was made."""
    found: list[tuple[str, bool, bool]] = []
    for body, part in enumerate((scene, *scene.bodies)):
        found += [(one.label_on(body), bool(one.coordinate.rotation), one.name is None) for one in part.acting]
        found += [(one.label_on(body), False, True) for one in part.impactors for _ in one.pushes]
    return found


def _turning(scene: Scene) -> list[int | str]:
    """Names and numbers of the contacts that act on a rotation, in the order of the log."""
    found = [(name, rotation) for name, rotation, _ in _contacts(scene)]
    numbers = [i for i, (_, rotation) in enumerate(found) if rotation]
    return [*numbers, *(i - len(found) for i in numbers), *(name for name, rotation in found if rotation)]


def signal(run: Run, stop: int | str = 0, z: Place | None = None) -> tuple[Vector, Vector]:
    """δ and its rate at a stop, or u and u̇ at z, or at the tip of a scene without stops."""
    require(len(run.t) > 1, "the run must have samples", len(run.t), "quantity", "give a dt below the duration")
    if z is None and len(run.stops):
        return run.indentation(stop), run.indentation_rate(stop)
    place = place_of(run, z)
    return run.displacement(place), run.velocity(place)


def place_of(run: Run, z: Place | None) -> Any:
    """The place itself, or the tip."""
    last = getattr(run.shapes, "nodes", None)
    return z if z is not None else next(iter(places(run.shapes).values())) if last is None else float(last[-1])


def mean_in_time(run: Run, values: Vector) -> float:
    """Mean over the time of the samples by trapezia: of a period, whose last sample is its first, each counts once."""
    require(len(run.t) > 1, "the run must have samples", len(run.t), "quantity", "give a dt below the duration")
    return float(np.trapezoid(values, run.t) / (run.t[-1] - run.t[0]))


def _warn_of_short_contacts(run: Run) -> None:
    """Warn where samples pass over what a contact takes from the beam and gives back."""
    lasted = run.contacts.t_out - run.contacts.t_in
    lasted = lasted[np.isfinite(lasted)]
    if len(lasted) and len(run.t) > 1 and np.median(lasted) < FEWEST_IN_CONTACT * (run.t[1] - run.t[0]):
        # the same words of all runs of a study: Python says them once
        warn(f"contacts last fewer than {FEWEST_IN_CONTACT} samples: the mean energy may be off by the share of "
             "time in contact; give a smaller dt")  # fmt: skip


def _mean(values: Vector) -> float:
    """Mean, NaN of nothing without a warning."""
    return float(values.mean()) if len(values) else float("nan")
