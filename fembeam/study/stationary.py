"""A long run in constant memory: statistics of a stationary response with standard errors.

The run is cut into segments. The noise is renewed in each (an independent realisation from the state reached) and the
lead-in, five correlation times 1/min(ζω), is left out (of friction those at the level of a pilot run, see `decay`).
Sums of tones continue from the last sample in free flight, so that no contact is cut. The statistics need no more
storage than one segment.

A standard error tells how results scatter from one seed to another. Noise here is a sum of lines of fixed power, so
that parts of one realisation say little about it: over a period of the noise the variance of a linear response is the
same for every seed, while that of its parts scatters. Under noise a batch is therefore a whole segment; under tones and
records, which have one realisation only, a segment holds eight.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam import plot
from fembeam.model import Model, Run, places
from fembeam.scene import keys_of, signals_of, turns_at, unit_of
from fembeam.statistics import Batches, Estimate, Impacts, Signal
from fembeam.statistics.initial_transient import Settling, settling
from fembeam.statistics.spectra import FEWEST_OF_SLOW, FINEST_RESOLUTION
from fembeam.study.decay import correlation_time
from fembeam.study.execution.checkpoint import Checkpoint, model_identity
from fembeam.study.measure import require_model
from fembeam.study.result import Result, with_units
from fembeam.study.segments import FEWEST_SAMPLES, SHORTEST, Segment, Segments, check_duration
from fembeam.support import Part, bar, is_whole, note, number, numbers, require, warn
from fembeam.support.fingerprint import fingerprint

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fembeam.scene.contact_rows import ContactRow

Vector = NDArray[np.float64]
Watch = Callable[[Run], Any]
MOST_SAMPLES = 1e13  # months of computing
FEWEST_BATCHES = 16  # before `until` is asked
FEWEST_IN_SEGMENT = 8  # samples, as of `statistics.psd`
TRIES = 4  # segments dropped while the transient lasts


@dataclass(frozen=True, eq=False)
class Response(Result):
    """Statistics of a stationary response.

    Attributes
    ----------
    signals : name -> `statistics.Signal`: mean, variance, std, skewness, kurtosis, crossing_rate, pdf, psd; also
        ``response["δ"]``.
    impacts : one `statistics.Impacts` for each of `touching`: rate, probability, mean(quantity).
    duration : s the statistics use. discarded : s left out, lead-ins included.
    settling : end of the transient; None when `discard` was given.
    enough : whether the standard error asked for by `until` was reached; None when none was.
    seconds : wall seconds of integration.
    names : of stops, elements and impactors, in the order of `power`. rubbing : which of them have friction.
        rotations : which act on a rotation.
    touching : numbers in `names` of those that `impacts` are of: all but elements.
    """

    signals: dict[str, Signal]
    impacts: list[Impacts]
    duration: float
    discarded: float
    settling: Settling | None
    enough: bool | None
    seconds: float
    names: tuple[str, ...] = ()
    work: Batches = field(default_factory=lambda: Batches(1), repr=False)
    rubbing: tuple[bool, ...] = ()
    rotations: tuple[bool, ...] = ()
    touching: tuple[int, ...] = ()
    INDEX: ClassVar[str] = "name"

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise KeyError(f"no signal {name!r} was watched; there are {', '.join(self.signals)}")
        return self.signals[name]

    def __repr__(self) -> str:
        return f"<stationary response of {', '.join(self.signals)} over {self.duration:.4g} s>"

    def _parts(self) -> list[Part]:
        """Every number with its standard error and 95 % interval."""
        found, units = self.numbers(), self.units
        heads = with_units(list(found), [units.get(name, "") for name in found])
        rows = [(h, repr(one), *map(float, one.interval())) for h, one in zip(heads, found.values(), strict=True)]
        return [repr(self), (("", "value ± standard error", "95 % from", "to"), rows)]

    def table(self) -> list[dict[str, Any]]:
        """Every number by name: its unit, value, standard error and 95 % interval."""
        columns, units = ("value", "standard_error", "low", "high"), self.units
        rows = {k: (one.value, one.standard_error, *one.interval()) for k, one in self.numbers().items()}
        return [
            {"name": k, "unit": units.get(k, "")} | dict(zip(columns, map(float, row), strict=True))
            for k, row in rows.items()
        ]

    @property
    def units(self) -> dict[str, str]:
        """Units of the `numbers`, of those that have one."""
        signals = {name: signal.unit for name, signal in self.signals.items()}
        return units_of_numbers(signals, dict(zip(self.names, self.rotations, strict=True)))

    def figure(self) -> Figure:
        """Probability densities of the signals against the Gaussian."""
        return plot.random_densities(self.signals)

    def power(self, contact: int | str | None = None) -> Estimate:
        """Mean power (W) that a stop or element takes, numbered or named as in `names`; None: all of them together.

        From the work done on it, and its loss by friction; the change of the energy stored averages to zero.
        """
        mine, count = self._numbered(contact), len(self.names)
        return self.work.estimate(lambda sums: sum(sums[1 + i] + sums[1 + count + i] for i in mine) / sums[0])

    def wear(self, contact: int | str | None = None) -> Estimate:
        """Mean work rate by friction (W) of a stop, μN|v| in slip, which wear goes by; None: of all of them together.

        0 of stops without friction. What impacts take is `power` less this.
        """
        mine, count = self._numbered(contact), len(self.names)
        return self.work.estimate(lambda sums: sum(sums[1 + count + i] for i in mine) / sums[0])

    def _numbered(self, contact: int | str | None) -> list[int]:
        """The numbers of a stop or element, or of all; ValueError for one that is none."""
        count = len(self.names)
        if isinstance(contact, str):
            require(contact in self.names, f"contact must be one of {', '.join(self.names)}", contact, "Response",
                    "give its name or number")  # fmt: skip
            contact = self.names.index(contact)
        if contact is not None and not (is_whole(contact) and -count <= contact < count):
            raise ValueError(f"contact must be below {count}, the number of stops and elements, got {contact!r}")
        return list(range(count)) if contact is None else [contact % count]

    def numbers(self) -> dict[str, Estimate]:
        """Every number with its standard error, by names such as "δ std", "stop 0 rate" or "valve rate"."""
        names = ("mean", "std", "skewness", "kurtosis", "crossing_rate")
        found = {f"{key} {name}": getattr(s, name) for key, s in self.signals.items() for name in names}
        for stop, impacts in zip((self.names[i] for i in self.touching), self.impacts, strict=True):
            found |= {f"{stop} {name}": getattr(impacts, name) for name in ("rate", "probability")}
            found |= {f"{stop} {name}": impacts.mean(name) for name in impacts.largest}
        found |= {f"{name} power": self.power(i) for i, name in enumerate(self.names)}
        rubs = (i for i, has in enumerate(self.rubbing) if has)
        return found | {f"{self.names[i]} wear": self.wear(i) for i in rubs}


def units_of_numbers(signals: Mapping[str, str], contacts: Mapping[str, bool]) -> dict[str, str]:
    """Units of `Response.numbers`: of signals with these units, and of contacts, which may act on a rotation.

    Examples
    --------
    >>> units_of_numbers({"δ": "m"}, {"stop 0": False})["stop 0 peak_force"]
    'N'
    """
    found = {f"{name} {kind}": unit for name, unit in signals.items() for kind in ("mean", "std") if unit}
    found |= {f"{name} crossing_rate": "1/s" for name in signals}
    for name, turns in contacts.items():
        units = {"rate": "1/s", "duration": "s", "peak_force": unit_of("force", [turns]), "energy_loss": "J"}
        units |= {"entry_speed": unit_of("speed", [turns]), "power": "W", "wear": "W"}
        found |= {f"{name} {kind}": unit for kind, unit in units.items()}
    return found


def stationary(
    model: Model,
    duration: float,
    dt: float,
    watch: Mapping[str, Watch] | None = None,
    *,
    until: float | None = None,
    of: Callable[[Response], Any] | None = None,
    discard: float | None = None,
    segment: int | None = None,
    bins: Mapping[str, ArrayLike] | None = None,
    levels: Mapping[str, float] | None = None,
    start: ArrayLike | None = None,
    solver: Any = None,
    progress: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Response:
    """Statistics of the stationary response of a model, over ``duration`` seconds in constant memory.

    Parameters
    ----------
    duration : s the statistics use, transient and lead-ins not counted; the most when `until` is given. Without
        `discard` at least 32 correlation times of the structure.
    dt : output sampling in s; ten samples to the shortest period that matters.
    watch : name -> function of a `Run` that returns samples (k,), or (samples, rates): then crossings between two
        samples are counted too, those of the cubics through them. None: δ of every stop of the scene itself (the tip
        when there is none) and mid-beam.
    until : stop when the relative standard error falls below it, in (0, 1).
    of : function of the `Response` giving the `Estimate`, or several, that `until` is about; None: every variance.
    discard : s to leave out at the start; None: until the transient has died out, at least ten correlation times.
    segment : samples of a Welch segment; None: 2 rad/s of resolution, at least 64.
    bins, levels : name -> edges of the histogram, level of the crossings (0 unless given).
    start : (2n,) as for `Model.simulate`.
    solver : None is ``solvers.Exponential(1e-8, ledger=False)``.
    progress : show a bar (on terminals and in notebooks only).
    checkpoint : file that keeps each segment; the same call goes on from there and gives the same bits, with
        another `until` too. It is refused when anything else has changed, as of `ensemble`. Of a record, which is one
        segment, it holds the end only.

    Raises
    ------
    ValueError for bad input; solvers.SolverError when the integration fails.

    Warns
    -----
    UserWarning : the transient had not died out within the segments dropped for it; or the run is too short for two
        realisations of the noise, eight correlation times and 1.5 segments of the spectrum each: no standard errors.

    Notes
    -----
    Standard errors are those between realisations of the noise: at least 16 in a run, of 8 to 100 correlation times
    each; fewer where the duration allows no more. Intervals of 95 % hold 93 to 97 % from two realisations on; in 60
    correlation times beside two soft stops, one of them preloaded, those of skewness and of means per contact hold 91
    to 93 %; of the kurtosis of a tip whose slider slips, 3.9, they hold 88 % in 80 and in 320 correlation times; of the
    rate of rare contacts, five expected in a run, 72 %, as a quarter of such runs meets none. Records and other signals
    that cannot be continued are run as one segment of eight batches, a sum of tones in batches of about 50 correlation
    times. A response that switches between two regimes less often than that needs an `ensemble`.

    A realisation of noise repeats after its period, automatic or that of the segment, and is no more Gaussian than
    that many lines: see `BandNoise`. Where levels beyond 3 standard deviations matter, such as for rare contacts, and
    where many runs are averaged, give the noise a period of some hundred correlation times.

    A structure that only elements damp will do. Correlation times are then those with their dashpots, or with dashpots
    that lose as much in a cycle as sliders do at the rms of a pilot run: a mode whose sliders stick at this level is
    refused.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  damping=fb.ModalDamping(0.05), base=fb.BandNoise(1e-5, (0.0, 400.0), seed=1))
    >>> found = stationary(scene.reduce(modes=1), duration=400.0, dt=2e-3)
    >>> found["tip u"].std.relative < 0.02  # standard error over value
    True
    """
    check(model, duration, dt, until, discard)
    _check_options(watch, segment, bins, levels, of)
    segment = segment or default_segment(dt)
    solver = solver or solvers.Exponential(1e-8, ledger=False)
    plan = Segments.of(model, duration, dt, discard, start, solver, segment)
    watched, units = _watched(model, watch)
    sums = Sums(watched, units, model.contact_rows, dt, segment, dict(bins or {}), dict(levels or {}))
    kept = Checkpoint(checkpoint, partial(_identity, plan, sums, discard, start))
    settled, enough = _resumed(kept, plan, sums), None if until is None else False
    if until is not None and plan.taken >= FEWEST_BATCHES:  # as it was asked before the end of an earlier call
        enough = _enough(sums.response(plan, settled, enough), of, until)
    with kept, bar(duration, progress) as report:
        for whole in plan.pieces() if not enough else ():
            piece: Segment | None = whole
            seen = {name: _looked(name, look, whole.run) for name, look in watched.items()}
            if settled is None and discard is None:
                settled, piece = _after_transient(whole, [x for x, _ in seen.values()], plan)
            if piece is None:
                continue
            plan.keep(piece, sums.add(piece, seen))
            _keep(kept, plan, sums, settled)
            response = sums.response(plan, settled, enough)
            report(min(plan.kept, duration))
            if until is not None and plan.taken >= FEWEST_BATCHES:
                enough = _enough(response, of, until)
                if enough:
                    break
    if until is not None and not enough:  # of fewer batches, which are not asked before the end
        enough = _enough(response, of, until)
    _warn_of_a_short_run(plan, settled)
    response = sums.response(plan, settled, enough)
    note("%r, %.4g s before it left out", response, response.discarded)
    return response


def _watched(model: Model, watch: Mapping[str, Watch] | None) -> tuple[dict[str, Watch], dict[str, str]]:
    """What is looked at by name, and its units, which of a user's own functions are not known."""
    known = {name: (look, "") for name, look in watch.items()} if watch else watched_by_default(model)
    return {name: look for name, (look, _) in known.items()}, {name: unit for name, (_, unit) in known.items()}


def _identity(plan: Segments, sums: Sums, discard: Any, start: Any) -> dict[str, str]:
    """What the segments depend on, seeds among it, as texts that can be compared."""
    asked = [plan.duration, plan.dt, discard, None if start is None else np.asarray(start), plan.solver]
    asked += [sums.segment, sums.bins, sums.levels, sums.touching]
    about = model_identity(plan.model) | {"watch": f"{', '.join(sums.watched)} #{fingerprint(sums.watched, 'watch')}"}
    return about | {"stationary": f"{plan.duration:g} s, dt = {plan.dt:g} s #{fingerprint(asked, 'stationary')}"}


def _keep(kept: Checkpoint, plan: Segments, sums: Sums, settled: Settling | None) -> None:
    """Write what there is so far."""
    if kept.path is None:
        return
    end = [] if settled is None else [settled.time, settled.drift, float(settled.died_out)]
    kept.add("so far", {"settled": np.array(end), **plan.arrays(), **sums.arrays()})


def _resumed(kept: Checkpoint, plan: Segments, sums: Sums) -> Settling | None:
    """Go on from what a checkpoint holds: the end of the transient, if it was found."""
    if not kept.values:
        return None
    arrays = kept.values["so far"]
    plan.take(arrays)
    sums.take(arrays)
    end = arrays["settled"].tolist()
    return Settling(end[0], end[1], bool(end[2])) if end else None


def characteristics(model: Model, duration: float, dt: float, **options: Any) -> dict[str, Any]:
    """Numbers and spectra of one `stationary` run as plain values: a quantity for `ensemble`.

    Parameters
    ----------
    duration, dt, options : as for `stationary`.

    Returns
    -------
    Those of `Response.numbers`, and "δ psd" and so on: densities per rad/s; "omega": their frequencies. What a contact
    has on average is there when the model has stops, and None without a contact.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  damping=fb.ModalDamping(0.05), base=fb.BandNoise(1e-5, (0.0, 400.0), seed=1))
    >>> found = characteristics(scene.reduce(modes=1), duration=30.0, dt=5e-3)
    >>> [name for name in found if name.endswith("psd")]
    ['tip u psd', 'mid-beam u psd']
    """
    response = stationary(model, duration, dt, **options)
    found = {name: estimate.value for name, estimate in response.numbers().items()}
    values: dict[str, Any] = {name: None if np.isnan(value) else value for name, value in found.items()}
    for name, signal in response.signals.items():
        values[f"{name} psd"] = signal.psd.density
        values["omega"] = signal.psd.omega
    return values


def units_of_characteristics(model: Model, watch: Mapping[str, Watch] | None = None) -> dict[str, str]:
    """Units of the values of `characteristics` that have one; of densities those of their signals."""
    known = {} if watch else {name: unit for name, (_, unit) in watched_by_default(model).items()}
    signals = known or dict.fromkeys(watch or (), "")
    contacts = {row.key(i): row.rotation for i, row in enumerate(model.contact_rows)}
    return units_of_numbers(signals, contacts) | {f"{name} psd": unit for name, unit in known.items()}


def watched_by_default(model: Model) -> dict[str, tuple[Watch, str]]:
    """δ of every stop (the tip when there is none) and mid-beam, with rates; each with its unit."""
    count, at = len(model.scene.stops), places(model.shapes)
    names = ["δ"] if count == 1 else [f"δ {stop.name or i}" for i, stop in enumerate(model.scene.stops)]
    units = [unit_of("indentation", [row.rotation]) for row in model.contact_rows]
    found: dict[str, tuple[Watch, str]] = {
        name: (partial(indentation, stop=i), units[i]) for i, name in enumerate(names)
    }
    if model.scene.named:
        beside = [] if found else [(name, z) for name, z in at.items() if np.any(model.shapes(z))][:1]
    else:
        beside = [(name, z) for name, z in at.items() if name != "tip" or not found]
    for name, z in beside:
        found[f"{name} u"] = partial(displacement, shape=model.shapes(z)), "rad" if turns_at(z) else "m"
    return found


def indentation(run: Run, stop: int) -> tuple[Vector, Vector]:
    """δ of a stop and its rate."""
    return run.indentation(stop), run.indentation_rate(stop)


def displacement(run: Run, shape: Vector) -> tuple[Vector, Vector]:
    """Displacement where the modes have these values (n,), and its rate."""
    return run.q @ shape, run.q_dot @ shape


def _after_transient(piece: Segment, signals: list[Vector], plan: Segments) -> tuple[Settling | None, Segment | None]:
    """The end of the transient, None while it may come later, and what counts of the segment, None if nothing does."""
    settled = _settled(signals, piece, plan)
    later = not settled.died_out and plan.dropped < TRIES and plan.repeats
    if later or (plan.batches == 1 and settled.time > piece.start):  # batches are whole realisations
        plan.drop(piece)
        return None if later else settled, None
    return settled, replace(piece, start=max(piece.start, settled.time))


def _settled(signals: list[Vector], piece: Segment, plan: Segments) -> Settling:
    """End of the transient of the slowest signal."""
    found = [settling(x[: piece.end + 1], plan.dt, plan.correlation_time) for x in signals]
    return Settling(max(f.time for f in found), max(f.drift for f in found), all(f.died_out for f in found))


def _warn_of_a_short_run(plan: Segments, settled: Settling | None) -> None:
    """Warn of a transient that goes on, and of a single realisation; the caller's caller is shown."""
    if settled is not None and not settled.died_out:
        warn(f"the transient has not died out: its halves differ by {settled.drift:.1f} standard errors; "
             "simulate longer, or give discard=")  # fmt: skip
    if plan.taken < 2:
        finer = ", or give a shorter segment= of the spectrum" * (plan.shortest > SHORTEST * plan.correlation_time)
        warn(f"{plan.kept:.4g} s hold one realisation of the noise, which tells no standard error; "
             f"simulate at least {2 * plan.shortest:.3g} s{finer}")  # fmt: skip


def _looked(name: str, look: Watch, run: Run) -> tuple[Vector, Vector | None]:
    """Samples and rates of a watched signal, one for every sample of the run."""
    seen = look(run)
    both = seen if isinstance(seen, tuple) else (seen,)
    found = [numbers(f"watch[{name!r}]", one, "stationary", "return samples, or (samples, rates)") for one in both]
    right = len(found) in (1, 2) and all(one.shape == run.t.shape for one in found)
    require(right, f"watch[{name!r}] must return a value for each of the {len(run.t)} samples, or (samples, rates)",
            [one.shape for one in found], "stationary", "e.g. run.q[:, 0]")  # fmt: skip
    return found[0], found[1] if len(found) == 2 else None


def _check_options(watch: Any, segment: Any, bins: Any, levels: Any, of: Any) -> None:
    """Bad options, before any computing."""
    where = "stationary"
    for name, given in (("watch", watch), ("bins", bins), ("levels", levels)):
        require(given is None or isinstance(given, Mapping), f"{name} must be a mapping by names of signals", given,
                where, 'such as {"δ": …}')  # fmt: skip
    require(of is None or callable(of), "of must be a function of a response", of, where, 'lambda r: r["δ"].std')
    for name, look in (watch or {}).items():
        require(isinstance(name, str), "names of watch must be text", name, where, 'such as {"δ": …}')
        require(callable(look), f"watch[{name!r}] must be a function of a run", look, where, "lambda run: run.q[:, 0]")
    right = segment is None or (is_whole(segment) and segment >= FEWEST_IN_SEGMENT)
    require(right, f"segment must be a whole number of samples, at least {FEWEST_IN_SEGMENT}", segment, where,
            "or leave it out")  # fmt: skip
    for name, given in (bins or {}).items():
        edges = numbers(f"bins[{name!r}]", given, where, "give rising edges")
        rising = edges.ndim == 1 and edges.size > 1 and np.isfinite(edges).all() and bool(np.all(np.diff(edges) > 0))
        require(bool(rising), f"bins[{name!r}] must be two or more finite edges that rise", given, where, "sort them")
    for name, given in (levels or {}).items():
        number(f"levels[{name!r}]", given)


def default_segment(dt: float) -> int:
    """Samples of a Welch segment that resolves 2 rad/s, at least 64."""
    from scipy.fft import next_fast_len

    samples = max(FEWEST_OF_SLOW, math.ceil(2 * math.pi / (FINEST_RESOLUTION * dt)))
    return int(next_fast_len(samples, real=True))


def _enough(response: Response, of: Callable[[Response], Any] | None, until: float) -> bool:
    """Whether the estimates that `until` is about are known so well."""
    found = [signal.variance for signal in response.signals.values()] if of is None else of(response)
    asked = list(found) if isinstance(found, Iterable) else [found]
    require(bool(asked) and all(isinstance(one, Estimate) for one in asked), "of must return an Estimate, or several",
            found, "stationary", 'e.g. lambda r: r["δ"].std')  # fmt: skip
    return all(one.relative <= until for one in asked)


def check(model: Model, duration: float, dt: float, until: float | None, discard: float | None) -> None:
    """Bad input, before any computing."""
    require_model(model, "stationary")
    number("duration (s)", duration, above=0.0)
    number("dt (s)", dt, above=0.0)
    if not dt < duration / FEWEST_SAMPLES:
        raise ValueError(
            f"dt must leave at least {FEWEST_SAMPLES} samples of the duration of {duration:g} s, got {dt:g} s"
        )
    if not duration / dt < MOST_SAMPLES:
        raise ValueError(f"dt must leave fewer than {MOST_SAMPLES:.0e} samples of the duration of {duration:g} s, "
                         f"got {dt:g} s")  # fmt: skip
    if until is not None and not 0.0 < number("until", until, above=0.0) < 1.0:
        raise ValueError(f"until must be a relative standard error below 1, got {until!r}")
    if discard is not None:
        number("discard (s)", discard, least=0.0)
    if not signals_of(model.scene):
        raise ValueError(
            "a stationary response needs something that drives it; give the scene base=, forces= or a spring foot="
        )


def check_length(model: Model, duration: float, dt: float, discard: float | None) -> None:
    """Bad input of `characteristics` that a model refuses without a run; what friction alone damps needs one."""
    check(model, duration, dt, None, discard)
    if not any(one.always and one.remembers for one in model.contact_rows):
        check_duration(list(signals_of(model.scene).values()), duration, dt, discard, correlation_time(model))


@dataclass
class Sums:
    """Sums over the segments taken so far."""

    watched: Mapping[str, Watch]
    units: Mapping[str, str]  # of what is watched
    contacts: Sequence[ContactRow]
    dt: float
    segment: int
    bins: dict[str, ArrayLike]
    levels: dict[str, float]
    signals: dict[str, Signal] = field(default_factory=dict)
    impacts: list[Impacts] = field(default_factory=list)
    touching: tuple[int, ...] = ()  # contacts that begin and end
    work: Batches = field(init=False)  # rows: seconds, work on each contact, loss by friction

    def __post_init__(self) -> None:
        for option, given in (("bins", self.bins), ("levels", self.levels)):
            for name in given:
                if name not in self.watched:
                    raise ValueError(
                        f"{option} names {name!r}, which is not watched; there are {', '.join(self.watched)}"
                    )
        self.touching = tuple(i for i, row in enumerate(self.contacts) if not row.always)
        self.impacts = [Impacts() for _ in self.touching]
        self.work = Batches(1 + 2 * len(self.contacts))

    def add(self, piece: Segment, seen: Mapping[str, tuple[Vector, Vector | None]]) -> float:
        """Take in a segment, batch by batch; returns its seconds."""
        first = math.ceil(piece.start / self.dt - 1e-9)
        borders = np.linspace(first, piece.end, piece.batches + 1).round().astype(int)
        for name, (x, rate) in seen.items():
            if name not in self.signals:
                self.signals[name] = self._signal(name, x[first : piece.end], piece.batches)
            self.signals[name].cut()
            for a, b in pairwise(borders):
                self.signals[name].add(x[a:b], None if rate is None else rate[a:b])
        for stop, impacts in zip(self.touching, self.impacts, strict=True):
            for a, b in pairwise(borders):
                impacts.add(piece.run.contacts, stop, a * self.dt, b * self.dt)
        self._add_work(piece.run, borders)
        return self.dt * float(piece.end - first)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All sums by name, to be kept in a file."""
        parts: dict[str, Batches | Impacts | Signal] = {"work": self.work}
        parts |= {f"impacts {i}": one for i, one in enumerate(self.impacts)}
        parts |= {f"signal {name}": one for name, one in self.signals.items()}
        return {f"{part} {key}": array for part, one in parts.items() for key, array in one.arrays().items()}

    def take(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Go on from these sums."""
        self.work.take(_part(arrays, "work"))
        for i, one in enumerate(self.impacts):
            one.take(_part(arrays, f"impacts {i}"))
        for name in self.watched:
            level = self.levels.get(name, 0.0)
            self.signals[name] = Signal.of_arrays(_part(arrays, f"signal {name}"), self.dt, level, self.units[name])

    def _add_work(self, run: Run, borders: Any) -> None:
        """Take in what each contact took between samples."""
        rubs = np.any(run.rubs[:, 1] > 0.0)
        lost = run.friction_loss if rubs else np.zeros((len(run.t), len(self.contacts)))
        for a, b in pairwise(borders) if self.contacts else ():
            changes = (part[b] - part[a] for part in (run.losses.history, lost))
            self.work.add([(b - a) * self.dt, *np.concatenate(list(changes))])

    def _signal(self, name: str, x: Vector, batches: int) -> Signal:
        """Empty sums for a signal, arranged by its first samples."""
        segment = min(self.segment, max(8, x.size // 2 if batches > 1 else x.size - 1))
        bins = self.bins.get(name)
        edges = None if bins is None else np.asarray(bins, dtype=np.float64)
        return Signal(x, self.dt, segment, self.levels.get(name, 0.0), edges, self.units[name])

    def response(self, plan: Segments, settled: Settling | None, enough: bool | None) -> Response:
        """The statistics so far."""
        seen = self.signals, self.impacts, plan.kept, plan.discarded, settled, enough, plan.seconds
        names = keys_of(self.contacts)
        rubbing = tuple(row.rub[1] > 0.0 for row in self.contacts)
        rotations = tuple(row.rotation for row in self.contacts)
        return Response(*seen, names, self.work, rubbing, rotations, self.touching)


def _part(arrays: Mapping[str, NDArray[Any]], name: str) -> dict[str, NDArray[Any]]:
    """The arrays of one part, by their own names."""
    return {key.removeprefix(f"{name} "): one for key, one in arrays.items() if key.startswith(f"{name} ")}
