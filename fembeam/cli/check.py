"""What a scene is before it is run: modes, contacts to expect, steps and modes to take, and what looks wrong.

Contacts are those of a short trial and of one strike at its usual speed; where stops are many, the most touched ones
are struck, of the others the trial alone tells. A contact of length T excites what lies below 3π/T, where the spectrum
of a half-sine pulse first vanishes: modes above it are hardly excited.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import solvers
from fembeam.cli.unit_checks import doubts
from fembeam.model.mode_table import mode_rows, mode_table
from fembeam.scene import signals_of, title, unit_of

if TYPE_CHECKING:
    from fembeam.model import Model
    from fembeam.scene_file import SceneFile

PERIODS = 20.0  # of the lowest mode that the trial lasts
MOST_PERIODS = 3000.0  # of the highest mode that it may take
MOST_RECORDED = 30_000.0  # likewise where records or sweeps drive, whose strongest part may come late
NOMINAL_SPEED = 0.1  # m/s, where the trial tells none
MOST_STRUCK = 40  # stops; each takes a fiftieth of a second
NAMED = 6  # stops in a warning
MOST_MODES = 40  # considered when counting those a contact excites


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


@dataclass(frozen=True)
class Check:
    """What was found; print it."""

    model: Model
    touched: list[Touched]
    steps: dict[str, float]
    modes: dict[str, int]
    correlation_time: float
    warnings: list[str]

    def __str__(self) -> str:
        lines = [*self.structure, mode_table(self.model)]
        lines.append(f"\ncorrelation time of the structure 1/min(ζω): {self.correlation_time:.3g} s")
        for one in self.touched:
            seen = f"{one.contacts} contacts in a trial" if one.contacts else "no contact in a trial"
            speed, force = (unit_of(of, [self.model.contact_rows[one.stop].rotation]) for of in ("speed", "force"))
            row = self.model.contact_rows[one.stop]
            called = title(row, one.stop) or f"stop {one.stop}"
            lines.append(
                f"{called}: {seen}; at {one.speed:.3g} {speed} a contact lasts {one.time:.3g} s "
                f"({one.periods:.2g} periods of the highest mode kept), peak force {one.peak_force:.3g} {force}"
            )
        if self.stiffened:
            lowest = ", ".join(f"{omega:.6g}" for omega in self.stiffened[:3])
            lines.append(f"elements: with their stiffness at u = 0 the lowest frequencies are {lowest} rad/s")
        lines += [f"suggested {what}: {count}" for what, count in self.modes.items()]
        lines += [f"suggested {what}: {step:.2g} s" for what, step in self.steps.items()]
        return "\n".join(lines)

    @property
    def structure(self) -> list[str]:
        """What the matrices of a structure say."""
        return self.model.scene.beam.check() if hasattr(self.model.scene.beam, "check") else []

    @property
    def stiffened(self) -> list[float]:
        """Frequencies with the stiffness of the elements, rad/s; empty without elements."""
        if not any(one.always for one in self.model.contact_rows):
            return []
        squares = np.linalg.eigvalsh(self.model.system.K + self.model.linear_elements[0])
        return np.sqrt(np.maximum(squares, 0.0)).tolist()  # type: ignore[no-any-return]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            **({"structure": self.structure} if self.structure else {}),
            "modes": mode_rows(self.model),
            "correlation_time": self.correlation_time,
            "stops": [asdict(one) for one in self.touched],
            "suggested_modes": self.modes,
            "suggested_steps": self.steps,
            "warnings": self.warnings,
            **({"omega_with_elements": self.stiffened} if self.stiffened else {}),
        }


def check(file: SceneFile, model: Model) -> Check:
    """Look at a scene; costs about what a simulation of some twenty periods does.

    Parameters
    ----------
    file : what was read. model : its reduced model.
    """
    log = _trial(model)
    touched = _all_touched(model, log)
    shortest = min((one.time for one in touched), default=math.inf)
    moving = bool(np.any(model.omega > 0))  # rigid-body modes alone have no period
    steps = {"output step dt, 20 in the shortest period kept": 2 * math.pi / (20 * _fastest(model))} if moving else {}
    if shortest < math.inf:
        steps["output step dt to see the force, 20 in a contact"] = shortest / 20
    steps |= _limits(model)
    found = [*doubts(file, model), *_of_trial(model, touched)]
    return Check(model, touched, steps, _suggested_modes(file, shortest), _correlation_time(model), found)


def _fastest(model: Model) -> float:
    """Highest frequency kept, rad/s."""
    return max(float(model.omega.max()), 1e-9)


def _trial(model: Model) -> solvers.ContactLog | None:
    """Contacts of the first periods from rest; None when they cannot be computed."""
    moving = model.omega[model.omega > 1e-6 * _fastest(model)]
    if not len(moving):
        return None
    lengths = [signal.duration for signal in signals_of(model.scene).values() if hasattr(signal, "duration")]
    usual = min(PERIODS / float(moving.min()), MOST_PERIODS / _fastest(model))
    duration = min([2 * math.pi * (MOST_RECORDED / _fastest(model) if lengths else usual), *lengths])
    try:
        return model.simulate(duration, solver=solvers.Exponential(1e-6, ledger=False)).contacts
    except (ValueError, solvers.SolverError) as error:
        warnings.warn(f"a trial of {duration:.3g} s fails: {error}", UserWarning, stacklevel=2)
        return None


def _all_touched(model: Model, log: solvers.ContactLog | None) -> list[Touched]:
    """What to expect of the stops; nothing of one of which neither a strike nor the trial tells."""
    counts = np.bincount(np.zeros(0, dtype=int) if log is None else log.stop, minlength=len(model.contact_rows))
    stops = range(len(model.scene.stops))
    struck = sorted(stops, key=lambda stop: -counts[stop])[:MOST_STRUCK]
    return [one for stop in stops if (one := _touched(model, log, stop, stop in struck))]


def _touched(model: Model, log: solvers.ContactLog | None, stop: int, struck: bool) -> Touched | None:
    """One stop in the trial, and struck at its usual speed."""
    mine = np.zeros(0, dtype=int) if log is None else np.flatnonzero((log.stop == stop) & (log.speed_in != 0.0))
    speed = float(np.median(np.abs(log.speed_in[mine]))) if log is not None and len(mine) else NOMINAL_SPEED
    hit, of_hit = (_strike(model, speed, stop), slice(1)) if struck else (log, mine)
    if hit is None or not len(hit.stop[of_hit]):
        return None
    time, force = float(np.median((hit.t_out - hit.t_in)[of_hit])), float(np.median(hit.peak_force[of_hit]))
    time = time if math.isfinite(time) else math.inf  # longer than it was watched
    return Touched(stop, len(mine), speed, time, force, time * _fastest(model) / (2 * math.pi))


def _strike(model: Model, speed: float, stop: int) -> solvers.ContactLog | None:
    """Contacts with a stop struck by the first mode; None when that does not move there."""
    if abs(model.directions[stop, 0]) < 1e-9 * np.abs(model.directions[stop]).max():
        return None
    try:
        return model.strike(speed, stop)
    except (ValueError, ArithmeticError, solvers.SolverError):
        return None


def _of_trial(model: Model, touched: list[Touched]) -> list[str]:
    """What contacts make doubtful."""
    slowest = 2 * math.pi / max(float(model.omega.min()), 1e-12)
    soft = [one.stop for one in touched if one.time > 0.5 * slowest]
    short = [one.stop for one in touched if one.periods <= 3 and one.time * _fastest(model) < 3 * math.pi]
    found = []
    if soft:
        found.append(f"{_listed(soft)}: so soft that a contact lasts half the lowest period or more: "
                     "is the stiffness in N/m (Hertz: N/m^1.5)?")  # fmt: skip
    if short:
        found.append(f"contacts with {_listed(short)} excite modes above the {len(model.omega)} kept: forces and "
                     "contact times are this model's only; see suggested modes, or ask [mode_count]")  # fmt: skip
    return found


def _listed(stops: list[int]) -> str:
    """Stops in words, the first ones of many.

    Examples
    --------
    >>> _listed([3]), _listed([0, 2]), _listed(list(range(5, 200)))
    ('stop 3', 'stops 0, 2', 'stops 5, 6, 7, 8, 9, 10 and 189 more')
    """
    more = f" and {len(stops) - NAMED} more" if len(stops) > NAMED else ""
    return f"stop{'s' * (len(stops) > 1)} {', '.join(map(str, stops[:NAMED]))}{more}"


def _suggested_modes(file: SceneFile, shortest: float) -> dict[str, int]:
    """Numbers of modes for what drives the beam and for its contacts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            omega = file.scene.reduce(modes=MOST_MODES).omega
        except (ValueError, RuntimeError):
            return {}
    wanted = {}
    top = highest_driven(file.scene)
    if 0 < top < math.inf:
        wanted["modes for the motion, up to 1.5 times the highest frequency that drives it"] = 1.5 * top
    if shortest < math.inf:
        wanted["modes for contact forces, up to 3π over the contact time"] = 3 * math.pi / shortest
    counts = {name: max(1, int(np.count_nonzero(omega <= w))) for name, w in wanted.items()}
    return {name if n < MOST_MODES else f"{name} (at least)": n for name, n in counts.items()}


def highest_driven(scene: Any) -> float:
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


def _limits(model: Model) -> dict[str, float]:
    """Largest stable steps of methods with constant steps."""
    found: dict[str, float] = {}
    for method in (solvers.RK4(1e-6), solvers.HenonRK2(1e-6, 1e-6)):
        limit = method.stable_dt(model.system)
        name = type(method).__name__
        steps = {"flight": limit.flight, **({"contact": limit.contact} if model.scene.stops else {})}
        found |= {f"step of {name} in {where}, at most": step for where, step in steps.items() if 0 < step < math.inf}
    return found


def _correlation_time(model: Model) -> float:
    """Time constant of the slowest decay, s; infinite without damping."""
    from fembeam.study.segments import correlation_time

    try:
        return correlation_time(model)
    except ValueError:
        return math.inf
