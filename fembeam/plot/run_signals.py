"""The signals of a run that its figures show, whether they are stationary, and in how many independent parts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fembeam.model import places
from fembeam.plot.axis_names import coordinate_name
from fembeam.plot.style import Vector
from fembeam.scene import persistent_drive, turns_at
from fembeam.scene.places import unsigned
from fembeam.statistics import Signal, pdf
from fembeam.support import is_finite, require, require_non_negative

if TYPE_CHECKING:
    from fembeam.model import Run

FINER = 8  # times the samples, what is drawn between them
MOST_BATCHES, FEWEST_BATCHES = 32, 4  # of a history, for standard errors
MEMORIES = 10.0  # time constants of the structure that a batch lasts at least
ROUNDED = 1e-9  # of the largest motion: what moves less does so by rounding
STEADY = 0.1  # of the largest mean square over a quarter of the time: below it the motion comes and goes


def responses(run: Run, discard: float = 0.0) -> dict[str, Vector]:
    """Signals shown with density, m: δ of the first stop of displacement (the tip when there is none) and mid-beam."""
    kept = after_discard(run, discard)
    named, stop = places(run.shapes), first_stop(run)
    first = {} if stop is None else {"δ": run.indentation(stop)}
    if not first and "tip" in named:
        first = {"tip u": run.displacement(named["tip"])}
    if "mid-beam" in named:
        second = {"mid-beam u": run.displacement(named["mid-beam"])}
    else:  # of other bodies the first usual place that moves and is not that of the stop
        at = None if stop is None else place_of(run, stop)
        moving = {f"{name} u": run.displacement(one) for name, one in named.items() if not (first and one == at)}
        least = ROUNDED * max((float(np.ptp(x)) for x in [*first.values(), *moving.values()]), default=0.0)
        second = dict([next((pair for pair in moving.items() if np.ptp(pair[1]) > least), ("", np.zeros(0)))])
    return {name: x[kept] for name, x in {**first, **second}.items() if len(x)}


def signal_name(run: Run, name: str) -> str:
    """One of `responses` as figures call it: δ says of which stop it is where there are several."""
    stop = first_stop(run)
    return f"δ of {run.name(stop)}" if name == "δ" and stop is not None and len(run.stops) > 1 else name


def first_stop(run: Run) -> int | None:
    """Number of the first stop or element that acts on displacement, not on the slope."""
    found = np.flatnonzero(~run.rotational)
    return int(found[0]) if len(found) else None


def watched(run: Run) -> Any:
    """The place to watch, m: of the first stop of displacement, else the tip, else mid-beam."""
    stop = first_stop(run)
    return next(iter(places(run.shapes).values())) if stop is None else place_of(run, stop)


def place_of(run: Run, stop: int) -> Any:
    """Where a stop or element acts: z in m, or (place, direction), of an annular stop the first of both."""
    z = float(run.stops[stop, 0])
    if not np.isnan(z):
        return z
    place, direction = run.places[stop]
    direction = direction[0] if run.circles[stop, 0] else direction
    return place, unsigned(direction)


def natural(run: Run) -> Vector:
    """Natural frequencies, rad/s."""
    return run.readout.omega


def coordinates(run: Run) -> list[str]:
    """Each coordinate in words, "mode 1", "static shape"; of a run read from a file its number from 1."""
    if run.model is None:
        return [f"{i + 1}" for i in range(len(natural(run)))]
    return [coordinate_name(name) for name in run.model.names]


def sampling_of(run: Run) -> float:
    """Output sampling, s."""
    require(len(run.t) > 1, "figures and spectra of a run need output samples", len(run.t), "plot",
            "give simulate a dt below the duration")  # fmt: skip
    return float(run.t[1] - run.t[0])


def samples_in(run: Run, window: tuple[float, float] | None, where: str, advice: str = "widen it") -> Any:
    """Numbers of the samples in a window (s), all without one; ValueError below two."""
    first, last = float(run.t[0]), float(run.t[-1])
    lo, hi = (first, last) if window is None else two_times(window, where)
    if not (lo < last and hi > first):
        advice = f"samples lie from {first:g} to {last:g} s"
    inside = np.flatnonzero((run.t >= lo) & (run.t <= hi))
    require(len(inside) >= 2, "the window must hold at least 2 samples", (lo, hi), where, advice)
    return inside


def two_times(window: Any, where: str) -> tuple[float, float]:
    """A window's begin and end (s); ValueError for what is none."""
    pair = isinstance(window, (tuple, list, np.ndarray)) and len(window) == 2 and all(map(is_finite, window))
    require(pair, "the window must be two numbers", window, where, "give (from, to) in s")
    lo, hi = map(float, window)
    require(lo < hi, "the window must end after it begins", (lo, hi), where, "give (from, to) in s")
    return lo, hi


def after_discard(run: Run, discard: float) -> Any:
    """Which samples lie after `discard` s; ValueError if it is no time, or none does."""
    require_non_negative("discard", discard, "fembeam.plot", "give s at the beginning to leave out")
    require(discard < run.t[-1] or discard == 0.0, f"discard must be below the last sample, at {run.t[-1]:g} s",
            discard, "fembeam.plot", "lower it")  # fmt: skip
    return run.t >= discard


def between_samples(t: Vector, x: Vector, rates: Vector) -> tuple[Vector, Vector]:
    """Times on a grid finer than the samples, and values there, by cubics through values and rates."""
    from scipy.interpolate import CubicHermiteSpline

    fine = np.linspace(t[0], t[-1], FINER * (len(t) - 1) + 1)
    return fine, CubicHermiteSpline(t, x, rates)(fine)


def stationary(run: Run, discard: float = 0.0) -> bool:
    """Whether a run may settle to a motion that lasts: tones and noise drive it, or it neither grows nor dies away.

    Free motion does not. Of records, of signals of the user and of runs read from a file the motion itself tells: its
    mean square over each quarter of the time is a tenth or more of the largest.
    """
    known = None if run.model is None else persistent_drive(run.model.scene)
    if known is not None:
        return known
    x = next(iter(responses(run, discard).values()))
    if len(x) < 4:
        return False
    power = [float(np.mean(part**2)) for part in np.array_split(x - x.mean(), 4)]
    return min(power) >= STEADY * max(power)


def batches(run: Run, discard: float) -> int:
    """How many nearly independent parts the samples make, at most `MOST_BATCHES`; 0 when too few."""
    if len(run.t) < 2:
        return 0
    decay = np.diag(run.readout.damping).min() / 2  # ζω
    count = min(MOST_BATCHES, int(max(float(run.t[-1]) - discard, 0.0) * decay / MEMORIES))
    return count if count >= FEWEST_BATCHES else 0


def estimated(run: Run, discard: float, segment: int) -> dict[str, Signal]:
    """The `responses` with density and spectrum, each with its confidence where the run has independent parts.

    Parameters
    ----------
    segment : samples of a Welch segment; a part holds two of them at least.
    """
    found, at = {}, places(run.shapes)
    for name, x in responses(run, discard).items():
        # the last edge lies beyond the samples
        bins = np.linspace(x.min(), x.max() + 1e-9 * np.ptp(x), len(pdf(x).x) + 1)
        unit = "rad" if turns_at(at.get(name.removesuffix(" u"))) else "m"  # δ is that of a displacement
        found[name] = signal = Signal(x, sampling_of(run), segment, bins=bins, unit=unit)
        parts = min(batches(run, discard), len(x) // segment)
        for part in np.array_split(x, parts if parts >= FEWEST_BATCHES else 1):
            signal.add(part)
    return found
