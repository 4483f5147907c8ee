r"""The main method: exact flight, collocated contact, every event landed on.

A tone Re(a e^{iΩt}) of a load is subtracted as its steady response, which then is one more undamped block with
k = Ω², c = 0 that no force pushes; so flight under tones is an autonomous linear system and exact in one
multiplication per block. Sampled signals are quintics per cell, exact likewise. `solvers.certify` proves flight steps
safe, `solvers.collocation` solves the contacts, `solvers.regular` lands on their ends.

Limitations
-----------
* In flight no contact of the model is missed, however short. While one stop is in contact the others are watched at 8
  nodes per step only: a second contact shorter than the distance of two nodes can be missed.
* Touching is no contact: a stop counts as entered where δ becomes positive. An entry at rest counts when δ̈ > 0.
* A law that bends (clamp=True, a table) between its declared knots is integrated with smaller steps, at lower order.
* K must be positive semi-definite (no buckled modes).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numba import njit, types

from solvers.certify import fly
from solvers.collocation import (
    Space,
    account,
    arrive,
    contact_time,
    finish_step,
    free_response,
    inside,
    leaves_piece,
    peaks_so_far,
    solve_forces,
    step_error,
)
from solvers.flight import energy_norms
from solvers.forcing import Forcing, on_one_grid, tones_as_nodes
from solvers.kernels import OPTIONS, PROBLEM, Problem, contact_forces, copy, dot, indentation, inlined, inner
from solvers.regular import INDENTATION, ROOT, regular_step
from solvers.state import (
    AT_ONCE,
    CALLS,
    CHATTER,
    DONE,
    HEAD,
    LANDING,
    LOG_FULL,
    LOGGED,
    MOST_EVENTS_AT_ONCE,
    PART,
    PEAK_DELTA,
    REJECTED,
    RUNNING,
    SAMPLED,
    STATE,
    STEP,
    STEP_TOO_SMALL,
    STEPS,
    T_IN,
    TAPED,
    State,
    T,
    begin_contacts,
    new_state,
    problem_of,
    rate_rows,
    switch,
    switch_on_surface,
    tape,
    touching,
)
from solvers.system import Array, System
from solvers.tables import S, Tables, build

_REAL = types.float64
_VECTOR = types.Array(_REAL, 1, "C")
_MATRIX = types.Array(_REAL, 2, "C")
_INTEGERS = types.Array(types.int64, 1, "C")


def _arrays(*dimensions):  # shapes of a named tuple's contiguous float arrays
    return [types.Array(_REAL, d, "C") if d else _REAL for d in dimensions]


TABLES = types.NamedTuple(
    [
        *_arrays(1, 3, 4, 2, 3, 2, 2, 2, 2, 0, 2, 1),
        *_arrays(1, 3, 2, 2, 2, 3, 2, 6, 7, 5, 3, 2, 2, 2, 2, 4),
    ],
    Tables,
)
SPACE = types.NamedTuple([*_arrays(1, 2, 2, 1, 1, 1, 1, 2, 2, 1, 3, 2, 1, 2, 3, 2, 1), _INTEGERS, _MATRIX], Space)

SCALE, DURATION, SHARE = range(
    3
)  # places in `numbers`: reference speed, T_c, then per stop a first step's share of T_c
LEVEL, FAMILY, FRESH, STOP, WANTED = range(5)  # places in `last`
_GOAL = 0.3  # error aimed at, in units of the tolerance
_MOST_TRIES = 8  # to meet an output time on the way to a landing
_ORDER = 15.0  # the error estimate falls like h^15


@inner
def _begin(problem, tables, state, space, numbers, last, stop):
    """Scale, first step and family of a contact that begins (or changes piece) at ``stop``."""
    size, n = 2 * problem.k.size, problem.k.size
    speed = abs(dot(problem.read_rate[stop], state.x, size))
    energy_norms(problem, state.x, space.norms)
    possible = dot(tables.reach[stop], space.norms, n)
    numbers[SCALE] = max(speed, 0.1 * possible, 0.1 * problem.floor[stop])
    delta = indentation(problem, stop, state.x)
    entering = state.piece[stop] == 1 and delta < 1e-9 * max(state.open[stop, PEAK_DELTA], 1e-6)
    duration = contact_time(problem, tables, state, space, stop, max(speed, 1e-3 * numbers[SCALE]))
    if numbers[SHARE + stop] == 0.0:
        numbers[SHARE + stop] = min(0.1, 4.0 / (tables.fastest * duration))
    last[FAMILY] = 1 + stop if entering else 0
    last[WANTED] = _level(tables, numbers[SHARE + stop] * duration)
    numbers[DURATION] = duration
    last[FRESH], last[STOP] = 1, stop


@inlined
def _level(tables, h):
    """Contact step of about h, the shortest one if need be."""
    last = tables.step.size - 1
    j = min(max(int(np.ceil(2.0 * math.log2(tables.step[0] / h))), 0), last)
    return j + 1 if tables.step[j] > h and j < last else j


@inlined
def _nearest_surface(problem, state):
    """(time, stop, direction) of the border of a piece that will be met first at the present rates."""
    size = 2 * problem.k.size
    near, stop, direction = np.inf, -1, 0
    for s in range(problem.gap.size):
        delta = indentation(problem, s, state.x)
        rate = dot(problem.read_rate[s], state.x, size)
        piece = state.piece[s]
        if rate < 0.0 and piece > 0:
            time, way = (delta - problem.levels[s, piece - 1]) / -rate, -1
        elif rate > 0.0:
            time, way = (problem.levels[s, piece] - delta) / rate, 1
        else:
            continue
        if time < near:
            near, stop, direction = time, s, way
    return near, stop, direction


@inlined
def _land(problem, tables, state, space, numbers, stop, direction, near, rtol, t_end, out, dt, ledger):
    """Try to land on the border ahead by one regular step; whether it succeeded."""
    size, t = state.x.size, state.now[T]
    delta = indentation(problem, stop, state.x)
    level = problem.levels[stop, state.piece[stop] - (1 if direction < 0 else 0)]
    leaving = direction < 0 and state.piece[stop] == 1
    if tables.fastest * near > 1.5:
        return False
    if leaving and delta > 0.09 * state.open[stop, PEAK_DELTA]:
        return False
    if not leaving and state.piece[stop] > 0 and abs(level - delta) > 0.2 * max(level, delta):
        return False
    w = space.work[17]
    copy(state.x, w, size)
    w[size], w[size + 1] = t, math.sqrt(max(delta, 0.0))
    broken = tables.exponent[stop] % 1.0 != 0.0
    variable = ROOT if leaving and broken else INDENTATION
    span = -w[size + 1] if variable == ROOT else level - delta
    landed, length, time, tries = np.inf, span, np.inf, 0
    while True:  # first the landing itself, then the samples (and the end of the run) that lie on the way
        error, calls = regular_step(
            *(problem, tables, ledger, variable, stop, length, w),
            *(state.piece, state.entry_rate, space.work),
        )
        state.count[CALLS] += calls
        x = space.work[15]
        if landed == np.inf:
            landed = x[size]
            if not (error <= rtol * numbers[SCALE] and t <= landed <= t + 4.0 * near):
                return False
            copy(x, state.x, size)
            state.now[T] = landed
        else:
            late, tries = x[size] - time, tries + 1
            pace = dot(problem.read_rate[stop], x, 2 * problem.k.size)  # d(variable)/dt
            if variable == ROOT:
                pace /= 2.0 * x[size + 1]
            if abs(late) > 1e-15 * landed and abs(pace) < np.inf and tries < _MOST_TRIES:
                length -= late * pace
                continue
            if state.count[SAMPLED] < out.shape[0] and time == state.count[SAMPLED] * dt:
                copy(x, out[state.count[SAMPLED]], size)
                state.count[SAMPLED] += 1
            if time == t_end:
                if state.tape.shape[0]:
                    tape(state, LANDING, t, t_end, length, variable, stop, w)
                copy(x, state.x, size)
                state.now[T] = t_end
                return True
        time = min(state.count[SAMPLED] * dt, t_end) if state.count[SAMPLED] < out.shape[0] else t_end
        if time > landed:
            if state.tape.shape[0]:
                tape(state, LANDING, t, landed, span, variable, stop, w)
            return True
        left = (landed - time) / (landed - t) if landed > t else 0.0
        length, tries = span * (1.0 - (math.sqrt(left) if variable == ROOT else left)), 0


@inlined
def _predict(problem, tables, state, space, last, family, level):
    """First guess of the forces: the last step's polynomial, or the law on the free response."""
    for s in range(problem.gap.size):
        if state.piece[s] == 0:
            continue
        if last[FRESH]:
            copy(space.free[s, 0], space.clipped, S)
            contact_forces(problem, s, space.clipped, space.free[s, 1], state.entry_rate[s], space.force[s])
            state.count[CALLS] += S
            continue
        shift = level - last[LEVEL] + 2
        for i in range(S):
            if 0 <= shift < tables.extend.shape[1]:
                space.force[s, i] = dot(tables.extend[last[FAMILY], shift, i], space.previous[s], S)
            else:
                space.force[s, i] = space.previous[s, S - 1]


@inlined
def _try(problem, tables, state, space, numbers, last, family, level, rtol):
    """Attempt one contact step; error in units of the tolerance, inf when it must be shorter anyway."""
    h = tables.step[level]
    bottom = level == tables.step.size - 1
    free_response(problem, tables, state, space, family, level)
    _predict(problem, tables, state, space, last, family, level)
    mobility = 1e-300
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            mobility = max(mobility, tables.mobility[s, s])
    tolerance = rtol * numbers[SCALE]
    if not solve_forces(problem, tables, state, space, family, level, 0.05 * tolerance / (h * mobility)):
        return np.inf
    arrive(problem, tables, state, space, family, level)
    if leaves_piece(problem, tables, state, space, family, level):
        return 1.0 if bottom else np.inf
    error = step_error(problem, tables, state, space, family, level) / tolerance
    return min(error, 1.0) if bottom else error


@inner
def _record(problem, tables, state, space, family, level, t_end, out, dt, ledger):
    """Samples inside the converged step, and the state at the end of the run if that lies inside."""
    t, h = state.now[T], tables.step[level]
    while True:
        due = state.count[SAMPLED] < out.shape[0] and state.count[SAMPLED] * dt <= min(t + h, t_end)
        if not due and t + h < t_end:
            return
        span = state.count[SAMPLED] * dt - t if due else t_end - t
        row = out[state.count[SAMPLED]] if due else space.work[17]
        copy(state.x, row, state.x.size)
        inside(problem, tables, state, space, family, h, span, row)
        if ledger:
            account(problem, tables, state, space, family, h, span, state.x, row)
        if not due:
            return
        state.count[SAMPLED] += 1


@inlined
def touch(problem, tables, state, space, numbers, last, t_end, rtol, log, out, dt, ledger):
    """One accepted step in contact: land if a border is near, else collocate; returns a status code."""
    near, stop, direction = _nearest_surface(problem, state)
    if (
        stop >= 0
        and not last[FRESH]
        and _land(problem, tables, state, space, numbers, stop, direction, near, rtol, t_end, out, dt, ledger)
    ):
        state.count[STEPS] += 1
        if state.now[T] < t_end:
            switch(problem, state, stop, direction, log)
            if touching(state):
                _begin(problem, tables, state, space, numbers, last, stop)
        return RUNNING
    for s in range(problem.gap.size):  # a stop the loads lean on moves faster than it was entered
        if state.piece[s] > 0:
            rate = abs(dot(problem.read_rate[s], state.x, 2 * problem.k.size))
            numbers[SCALE] = max(numbers[SCALE], rate)
    family = last[FAMILY] if last[FRESH] else 0
    longest = np.inf if last[FRESH] else 0.8 * near
    if problem.table_dt.size:
        longest = min(longest, t_end - state.now[T] + problem.table_dt[0])
    wanted, bottom = last[WANTED], tables.step.size - 1
    level = _level(tables, longest) if longest < tables.step[wanted] else wanted
    while True:
        error = _try(problem, tables, state, space, numbers, last, family, level, rtol)
        if error <= 1.0:
            break
        if level == bottom:
            return STEP_TOO_SMALL
        level = min(bottom, level + (1 + int(2.0 / _ORDER * math.log2(error / _GOAL)) if error < np.inf else 2))
        wanted = level
        state.count[REJECTED] += 1
    end = state.now[T] + tables.step[level]
    ends = end >= t_end
    if ends or dt * state.count[SAMPLED] <= end:
        _record(problem, tables, state, space, family, level, t_end, out, dt, ledger)
    if ends:
        share = (t_end - state.now[T]) / tables.step[level]
        peaks_so_far(problem, tables, state, space, family, share, space.work[17])
        if state.tape.shape[0]:
            _tape_forces(problem, state, space, PART, t_end, family, level)
        copy(space.work[17], state.x, state.x.size)
        state.now[T] = t_end
        state.count[STEPS] += 1
        return RUNNING
    for s in range(problem.gap.size):
        copy(space.force[s], space.previous[s], S)
    if ledger:
        account(problem, tables, state, space, family, tables.step[level], tables.step[level], state.x, state.x)
    if state.tape.shape[0]:
        _tape_forces(problem, state, space, STEP, state.now[T] + tables.step[level], family, level)
    finish_step(problem, tables, state, space, family, level)
    _adapt(tables, numbers, last, level, family, wanted, error)
    state.count[STEPS] += 1
    return RUNNING


@inner
def _tape_forces(problem, state, space, kind, ended, family, level):
    """A row of the tape with the forces at the nodes."""
    forces = state.tape[state.count[TAPED], HEAD + state.x.size :]
    for s in range(problem.gap.size):
        copy(space.force[s], forces[s * S : (s + 1) * S], S)
    tape(state, kind, state.now[T], ended, ended - state.now[T], family, level, state.x)


@inlined
def _adapt(tables, numbers, last, level, family, wanted, error):
    """Size of the next step from the error of this one."""
    longer = 2.0 / _ORDER * math.log2(_GOAL / max(error, 1e-30))  # in levels
    if last[FRESH]:  # the next contact of this stop begins with what was right here
        share = SHARE + last[STOP]
        if level != last[WANTED]:
            numbers[share] = tables.step[level] / numbers[DURATION]
        numbers[share] *= 2.0 ** (0.5 * min(max(longer, -1.0), 0.5))
    suggested = min(max(level - int(min(math.floor(longer), 2.0)), 0), tables.step.size - 1)
    last[WANTED] = suggested if level == wanted else min(suggested, wanted)
    last[LEVEL], last[FAMILY], last[FRESH] = level, family, 0


@inner
def _latest(state):
    """The stop in contact that was entered last."""
    stop = -1
    for s in range(state.piece.size):
        if state.piece[s] > 0 and (stop < 0 or state.open[s, T_IN] >= state.open[stop, T_IN]):
            stop = s
    return stop


@njit(
    types.int64(
        *[PROBLEM, TABLES, STATE, SPACE, _VECTOR, _INTEGERS, _REAL, types.int64, _REAL, _MATRIX, _MATRIX, _REAL],
        types.boolean,
    ),
    **OPTIONS,
)
def advance(problem, tables, state, space, numbers, last, t_end, budget, rtol, log, out, dt, ledger):
    """Advance the state to ``t_end`` or for about ``budget`` steps; returns a status code."""
    begun = state.count[STEPS] + state.count[REJECTED]
    if last[STOP] < 0 and touching(state):  # the run starts in contact
        _begin(problem, tables, state, space, numbers, last, _latest(state))
    while state.count[STEPS] + state.count[REJECTED] - begun < budget:
        if state.now[T] >= t_end:
            return DONE
        if state.count[LOGGED] + problem.gap.size > log.shape[0]:
            return LOG_FULL
        if state.tape.shape[0] and state.count[TAPED] + problem.gap.size + 2 > state.tape.shape[0]:
            return RUNNING
        if state.count[AT_ONCE] > MOST_EVENTS_AT_ONCE:
            return CHATTER
        if switch_on_surface(problem, state, log, True):
            if touching(state):
                _begin(problem, tables, state, space, numbers, last, _latest(state))
            continue
        if touching(state):
            code = touch(problem, tables, state, space, numbers, last, t_end, rtol, log, out, dt, ledger)
            if code != RUNNING:
                return code
            continue
        stop = fly(problem, tables, state, space, t_end, budget, out, dt, ledger)
        if stop >= 0:
            switch(problem, state, stop, 1, log)
            _begin(problem, tables, state, space, numbers, last, stop)
    return RUNNING


@dataclass(frozen=True)
class Exponential:
    """Exact flight and collocated contact; the library's best method for any linear structure with stops.

    Parameters
    ----------
    rtol : error of an indentation rate that one contact step may make, relative to the speed of entry (or a tenth of
        what the motion could reach at the stop, whichever is larger), in [1e-12, 1e-2]. Flight is exact.
    ledger : keep the energy ledger of runs with output samples, by quadrature; without it their input and damping
        are NaN and the run several times quicker. Runs with ``dt=None`` keep none.

    Notes
    -----
    Cost is nearly independent of rtol and grows linearly with the number of modes. See the module for its limits.

    Examples
    --------
    >>> Exponential(rtol=1e-10).rtol
    1e-10
    """

    rtol: float = 1e-8
    ledger: bool = True
    has_tangent: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 1e-12 <= self.rtol <= 1e-2:
            raise ValueError(f"rtol must lie in [1e-12, 1e-2], got {self.rtol!r}")

    def engine(self, system: System, z: Array, forcing: Forcing, duration: float) -> Engine:
        """The method made ready for one run."""
        return Engine(self, system, z, forcing, duration)


class Engine:
    """One run: problem with tones among the blocks, tables, state."""

    def __init__(self, method: Exponential, system: System, z: Array, forcing: Forcing, duration: float) -> None:
        self.method, self.duration = method, duration
        forcing = on_one_grid(_without_resonance(system, forcing, duration, method.rtol), duration)
        prepared = _prepared(system, forcing)
        self.tables, steady = prepared.tables, prepared.steady
        self.problem = problem = prepared.problem._replace(table=forcing.table, table_start=forcing.table_start)
        stops, loads, size = len(problem.gap), len(problem.load), 2 * len(problem.k)
        self.back = prepared.back
        self.state: State = new_state(_start(z, steady, forcing), stops)
        shapes = [self.state.x.size, (7, size), (forcing.table_dt.size, 6), 7, size // 2, loads, stops]
        shapes += [(stops, S), (stops, S), S, (stops, 2, S), (stops + loads, S), S, (stops, S), (stops, 3, S)]
        shapes += [(stops * S, stops * S), stops * S, stops * S, (18, self.state.x.size + 2)]
        types_of = ["i8" if name == "pivots" else "f8" for name in Space._fields]
        self.space = Space._make(np.zeros(shape, kind) for shape, kind in zip(shapes, types_of, strict=True))
        self.numbers = np.zeros(2 + stops)
        self.last = np.full(5, -1)

    def start(self) -> None:
        """Put every stop on its piece."""
        begin_contacts(self.problem, self.state)

    def keeps_ledger(self, sampled: bool) -> bool:
        """Whether input and damping of the energy ledger are known."""
        return self.method.ledger and sampled

    def march(self, budget: int, log: Array, out: Array, dt: float) -> int:
        """Go on for a stretch."""
        return advance(
            *(self.problem, self.tables, self.state, self.space, self.numbers, self.last),
            *(self.duration, budget, self.method.rtol, log, out, dt, self.keeps_ledger(len(out) > 0)),
        )


class _Prepared(NamedTuple):
    """What does not change from run to run of one system."""

    problem: Problem
    tables: Tables
    steady: Array
    back: Array


def _prepared(system: System, forcing: Forcing) -> _Prepared:
    """Tables of a system, made once and kept on it, those of the last grid of its sampled signals only."""
    dt_cell = float(forcing.table_dt[0]) if forcing.table_dt.size else 1.0
    key = (dt_cell, tuple(forcing.tone_omega))
    if system.kept.get("exponential", (None,))[0] != key:
        if np.any(system.blocks.k < 0.0):
            raise ValueError(
                "K must be positive semi-definite for Exponential, its lowest ω² is "
                f"{system.blocks.k.min():g} (buckled?); use DormandPrince"
            )
        plain = problem_of(system, forcing)
        problem, steady = with_tones(plain, forcing)
        laws = [contact.law for contact in system.contacts]
        ledger = (_signal_rows(problem, forcing), problem.power, _loss_rows(plain) @ steady)
        tables = build(problem, [law.exponent for law in laws], [law.jump for law in laws], dt_cell, ledger)
        system.kept["exponential"] = (key, _Prepared(problem, tables, steady, system.blocks.T @ steady))
    prepared: _Prepared = system.kept["exponential"][1]
    return prepared


def _without_resonance(system: System, forcing: Forcing, duration: float, rtol: float) -> Forcing:
    """Tones without a useful steady response are sampled instead.

    That is those on the frequency of a block hardly damped, and those whose steady response l/|k - Ω² + iΩc| is a
    thousand times what the load can do within the duration, l duration²/2: their difference would lose its digits.
    """
    if "distances" not in system.kept:
        tones = zip(forcing.tone_omega, forcing.tone_load, strict=True)
        system.kept["distances"] = [_distance(system, omega, load) for omega, load in tones]
    resonant = [
        i
        for i, (absolute, relative) in enumerate(system.kept["distances"])
        if relative <= 1e-6 or absolute * duration**2 < 2e-3
    ]
    return tones_as_nodes(forcing, resonant, duration, rtol) if resonant else forcing


def _distance(system: System, omega: float, load: int) -> tuple[float, float]:
    """Smallest |k - Ω² + iΩc| of the blocks a load pushes, absolute and relative to max(k, Ω²)."""
    blocks = system.blocks
    distance = np.abs(blocks.k - omega**2 + 1j * omega * blocks.c)
    vector = blocks.inverse[:, system.size :] @ np.linalg.solve(system.M, np.asarray(system.loads[load][0]))
    distance = distance[np.hypot(*np.split(vector, 2)) > 0.0]
    scale = np.maximum(blocks.k, omega**2)[np.hypot(*np.split(vector, 2)) > 0.0]
    relative = np.divide(distance, scale, out=np.zeros_like(distance), where=scale > 0.0)
    return float(distance.min(initial=np.inf)), float(relative.min(initial=np.inf))


def _signal_rows(problem: Problem, forcing: Forcing) -> Array:
    """Each load's tones as a row of the state: Re(a e^{iΩt}) = Re a · p + Im a/Ω · v."""
    tones, N = len(forcing.tone_omega), len(problem.k)
    rows = np.zeros((len(problem.load), 2 * N))
    for i, (omega, amplitude, load) in enumerate(
        zip(forcing.tone_omega, forcing.tone_amplitude, forcing.tone_load, strict=True)
    ):
        rows[load, N - tones + i] = amplitude.real
        rows[load, 2 * N - tones + i] = amplitude.imag / omega if omega > 0.0 else 0.0
    return rows


def _loss_rows(problem: Problem) -> Array:
    """Rows whose squares sum to the damping power: √c v, or a root of the coupled loss."""
    n = len(problem.k)
    if not problem.loss.size:
        return np.hstack((np.zeros((n, n)), np.diag(np.sqrt(problem.c))))
    values, vectors = np.linalg.eigh(0.5 * (problem.loss + problem.loss.T))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def with_tones(problem: Problem, forcing: Forcing) -> tuple[Problem, Array]:
    """The problem with one undamped block per tone, and the map (2n, 2N) from its state to the blocks' z.

    The steady response to Re(a e^{iΩt}) is Re(Z e^{iΩt}) = Re Z · p + Im Z/Ω · v with p = cos Ωt, v = -Ω sin Ωt.
    """
    n, tones = len(problem.k), len(forcing.tone_omega)
    steady = np.zeros((2 * n, 2 * (n + tones)))
    steady[:n, :n] = steady[n:, n + tones : 2 * n + tones] = np.eye(n)
    for i, (omega, amplitude, load) in enumerate(
        zip(forcing.tone_omega, forcing.tone_amplitude, forcing.tone_load, strict=True)
    ):
        lp, lv = problem.load[load, :n] * amplitude, problem.load[load, n:] * amplitude
        # (iΩ - A)⁻¹ of a block: [[iΩ + c, 1], [-k, iΩ]] / (k - Ω² + iΩc)
        denominator = problem.k - omega**2 + 1j * omega * problem.c
        denominator = np.where((lp == 0.0) & (lv == 0.0), 1.0, denominator)
        response = np.concatenate(
            [((1j * omega + problem.c) * lp + lv) / denominator, (-problem.k * lp + 1j * omega * lv) / denominator]
        )
        steady[:, n + i] = response.real
        if omega > 0.0:
            steady[:, 2 * n + tones + i] = response.imag / omega
    none = np.zeros(0)
    push = np.zeros((len(problem.gap), 2 * (n + tones)))
    push[:, :n], push[:, n + tones : 2 * n + tones] = problem.push[:, :n], problem.push[:, n:]
    sampled = np.zeros((len(problem.load), 2 * (n + tones)))
    for load in forcing.table_load:
        sampled[load, :n], sampled[load, n + tones : 2 * n + tones] = problem.load[load, :n], problem.load[load, n:]
    k = np.concatenate((problem.k, forcing.tone_omega**2))
    c = np.concatenate((problem.c, np.zeros(tones)))
    return problem._replace(
        k=k,
        c=c,
        loss=np.empty((0, 0)),
        push=push,
        read=problem.read @ steady,
        read_rate=rate_rows(problem.read @ steady, k, c),
        load=sampled,
        power=problem.power @ steady,
        tone_omega=none,
        tone_amplitude=none.astype(complex),
        tone_load=none.astype(np.int64),
    ), steady


def _start(z: Array, steady: Array, forcing: Forcing) -> Array:
    """State with the tones' blocks at t = 0: p = 1, v = 0, the structure's less their steady response."""
    n, tones = len(z) // 2, len(forcing.tone_omega)
    pseudo = np.concatenate((np.zeros(n), np.ones(tones), np.zeros(n + tones)))
    rest = z - steady @ pseudo
    return pseudo + np.concatenate((rest[:n], np.zeros(tones), rest[n:], np.zeros(tones)))
