"""Contacts to expect: those of a short trial and of one strike at its usual speed.

Where stops are many, the most touched ones are struck, of the others the trial alone tells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import solvers
from fembeam.inspection.units import highest_driven
from fembeam.scene import signals_of
from solvers.problem.whole_runs import whole_runs

if TYPE_CHECKING:
    from fembeam.model import Model

PERIODS = 20.0  # periods of the lowest mode that swings: how long a trial usually lasts
FEW_STOPS = 100  # stops up to which a trial lasts PERIODS; with more it is shorter in proportion
LEAST_PERIODS = 4.0  # periods of the lowest mode that it lasts nevertheless
MOST_PERIODS = 3000.0  # periods of the highest mode, or of a faster load, that a trial may last, which costs the time
MOST_RECORDED = 30_000.0  # periods of the highest mode under records or sweeps: the strongest part may come late
NOMINAL_SPEED = 0.1  # m/s, speed of impact at a stop that no trial struck
MOST_STRUCK = 40  # stops; each takes a fiftieth of a second
NAMED = 6  # stops in a warning


@dataclass(frozen=True)
class Touched:
    """What to expect of one stop.

    Attributes
    ----------
    contacts : in the trial. speed : m/s (rad/s of rotation), the trial's median, else nominal. time : s that such a
        contact lasts, and peak_force : N or N m, of a strike, else the trial's medians. periods : contact time over the
        shortest period kept.
    """

    stop: int
    contacts: int
    speed: float
    time: float
    peak_force: float
    periods: float


def expected(model: Model) -> tuple[list[Touched], list[str]]:
    """What to expect of the stops, and why the trial failed if it did; as costly as a run of some twenty periods."""
    log, failed = _trial(model)
    return _all_touched(model, log), failed


def fastest(model: Model) -> float:
    """Highest frequency kept, rad/s."""
    return max(float(model.omega.max()), 1e-9)


@whole_runs()
def _trial(model: Model) -> tuple[solvers.ContactLog | None, list[str]]:
    """Contacts of the first periods from rest; None, and why, when they cannot be computed."""
    moving = model.omega[model.omega > 1e-6 * fastest(model)]
    if not len(moving):
        return None, []
    lengths = [signal.duration for signal in signals_of(model.scene).values() if hasattr(signal, "duration")]
    share = min(1.0, FEW_STOPS / max(len(stops(model)), 1))
    driven = highest_driven(model.scene)
    quickest = max(fastest(model), driven if math.isfinite(driven) else 0.0)
    usual = min(max(PERIODS * share, LEAST_PERIODS) / float(moving.min()), MOST_PERIODS / quickest)
    duration = min([2 * math.pi * (MOST_RECORDED / fastest(model) if lengths else usual), *lengths])
    try:
        return model.simulate(duration, solver=solvers.Exponential(1e-6, ledger=False)).contacts, []
    except (ValueError, solvers.SolverError) as error:
        return None, [f"a trial of {duration:.3g} s fails: {error}"]


def stops(model: Model) -> list[int]:
    """Numbers of what opens and closes: stops and impactors, those of further bodies too."""
    return [number for number, row in enumerate(model.contact_rows) if not row.always]


def _all_touched(model: Model, log: solvers.ContactLog | None) -> list[Touched]:
    """What to expect of the stops; nothing of one of which neither a strike nor the trial tells."""
    counts = np.bincount(np.zeros(0, dtype=int) if log is None else log.stop, minlength=len(model.contact_rows))
    known = stops(model)
    struck = sorted(known, key=lambda stop: -counts[stop])[:MOST_STRUCK]
    return [one for stop in known if (one := _touched(model, log, stop, stop in struck))]


def _touched(model: Model, log: solvers.ContactLog | None, stop: int, struck: bool) -> Touched | None:
    """One stop in the trial, and struck at its usual speed."""
    mine = np.zeros(0, dtype=int) if log is None else np.flatnonzero((log.stop == stop) & (log.speed_in != 0.0))
    speed = float(np.median(np.abs(log.speed_in[mine]))) if log is not None and len(mine) else NOMINAL_SPEED
    hit, of_hit = (_strike(model, speed, stop), slice(1)) if struck else (log, mine)
    if hit is None or not len(hit.stop[of_hit]):
        return None
    time, force = float(np.median((hit.t_out - hit.t_in)[of_hit])), float(np.median(hit.peak_force[of_hit]))
    time = time if math.isfinite(time) else math.inf  # longer than it was watched
    return Touched(stop, len(mine), speed, time, force, time * fastest(model) / (2 * math.pi))


def _strike(model: Model, speed: float, stop: int) -> solvers.ContactLog | None:
    """Contacts with a stop struck by the first mode of its body; None when that does not move there."""
    moves = np.abs(model.directions[model.rows_of[stop]]).max(axis=0)
    first = moves[np.flatnonzero(moves)[:1]]  # modes of other bodies are exactly 0
    if not len(first) or first[0] <= 1e-9 * moves.max():
        return None
    try:
        return model.strike(speed, stop)
    except (ValueError, ArithmeticError, solvers.SolverError):
        return None


def of_contacts(model: Model, touched: list[Touched]) -> list[str]:
    """What contacts make doubtful."""
    slowest = 2 * math.pi / max(float(model.omega.min()), 1e-12)
    open_at_rest = [one for one in touched if model.contact_rows[one.stop].gap >= 0.0]  # a preload lasts as it should
    soft = [one.stop for one in open_at_rest if one.time > 0.5 * slowest]
    short = [one.stop for one in touched if one.periods <= 3 and one.time * fastest(model) < 3 * math.pi]
    found = []
    if soft:
        found.append(f"{_listed(model, soft)}: so soft that a contact lasts half the lowest period or more: "
                     "is the stiffness in N/m (Hertz: N/m^1.5)?")  # fmt: skip
    if short:
        found.append(f"contacts with {_listed(model, short)} excite modes above the {len(model.omega)} kept: forces "
                     "and contact times are this model's only; see suggested modes, or ask [mode_count]")  # fmt: skip
    pulling = [stop for stop, row in enumerate(model.contact_rows) if row.friction and _pulls(row.law)]
    if pulling:
        found.append(f"{_listed(model, pulling)}: the law pulls as a contact opens, N < 0; friction has no force there")
    return found


def _pulls(law: Any) -> bool:
    """Whether a law is negative somewhere as a contact opens: just above its surface, at up to 10 m/s."""
    depths, speeds = np.meshgrid(np.geomspace(1e-9, 1e-4, 6), -np.geomspace(1e-3, 10.0, 5))
    return bool(np.min(law.force(depths.ravel(), speeds.ravel(), -speeds.ravel())) < 0.0)


def _listed(model: Model, stops: list[int]) -> str:
    """Names of stops, the first ones of many."""
    more = f" and {len(stops) - NAMED} more" if len(stops) > NAMED else ""
    return "; ".join(model.contact_rows[stop].name for stop in stops[:NAMED]) + more
