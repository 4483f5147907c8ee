"""What the exponential method prepares once per system: a block per tone, tables, layout of the working arrays."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import types

from solvers.compiled.fields import packed_type, shapes_of
from solvers.compiled.kernels import Problem, type_of
from solvers.compiled.packed import Layout, Packed, PackedTemplate, PackedType, aligned
from solvers.compiled.parts import (
    BORDERS,
    CIRCLES,
    ENERGY,
    EVERY_RUN,
    FOLLOWING,
    FRICTION,
    KINKS,
    MANY_STOPS,
    TWO_STOPS,
    load,
)
from solvers.compiled.state import (
    NO_ROWS,
    STATE,
    T_END,
    State,
    begin_state,
    frictions_of,
    gaps_of,
    most_borders,
    new_log,
    problem_of,
    radii_of,
)
from solvers.compiled.sums import padded
from solvers.exponential.contact.landing import landing_reach
from solvers.exponential.contact.many_stops import POOL
from solvers.exponential.contact.node_response import START, Scratch
from solvers.exponential.contact.nodes import S, series_of
from solvers.exponential.energy.flight_tables import ENERGY_TABLES, energy_tables_for
from solvers.exponential.steady_response import steady_response, without_resonance
from solvers.exponential.tables import SHORTER, TONE_TABLES, Tables, build, doublings, fill_tones, law_tables_of
from solvers.problem import Array, Contact, Forcing, Memo, System, dense, on_one_grid
from solvers.problem.friction import ACCOUNTS
from solvers.problem.run_arguments import output_arrays

TABLES, SCRATCH = packed_type(Tables), packed_type(Scratch)
_KNOWN = "energy", "accuracy"  # arrays of the scratch that Python reads or writes
_SHARED = TABLES, ENERGY_TABLES, STATE, SCRATCH


_MOST_KEPT = 1 << 26  # bytes of tables of the energy balance
_MOST_SHORTENED = 2  # times that contact steps are shortened: to 1e-10 of the usual shortest one
_ROUNDING_OF_TIME = 1e-16  # of the duration: shorter steps are none


class Run(NamedTuple):
    """All that the compiled functions of a run share, packed; called ``run`` there."""

    problem: Any  # `Problem` or `PlanarProblem`: blocks, rows and laws
    tables: Any  # `Tables`: responses of the blocks for the lengths of the steps
    energy_tables: Any  # `EnergyTables`: those of the balance, `NO_ENERGY_TABLES` where none is kept
    state: Any  # `State`: what the run has reached, and its outputs
    scratch: Any  # `Scratch`: what one step leaves to the next, and working arrays


def load_parts(problem: types.NamedTuple, places: Iterable[int]) -> None:
    """Compile functions that are called at their addresses, or load their machine code; see `compiled.parts`."""
    packed = [PackedType(kind) for kind in (problem, *_SHARED)]
    load({"problem": packed[0], "run": types.NamedTuple(packed, Run)}, places)


class Workspace:
    """The memory one run writes to: a block, its arrays, and the addresses of their descriptors for compiled code."""

    def __init__(self, layout: Layout, rest: Array, blocks: int) -> None:
        self.layout = layout
        self.block, words = layout.block()
        self.numbers = self.block[: layout.slices[1][Scratch._fields.index("jacobian")][0].start]
        self.addresses = [words + start for start in layout.starts]
        self.state = State._make(layout.arrays(self.block, 0))
        self.energy, self.accuracy = (layout.array(self.block, 1, Scratch._fields.index(name)) for name in _KNOWN)
        begin_state(self.state, rest)
        self.rest, self.settings = self.numbers.copy(), (0.0, 0.0)  # duration and rtol of the last run
        n = rest.size // 2
        self.p, self.v = self.state.x[:blocks], self.state.x[n : n + blocks]  # of the structure's own blocks
        self.replace(log=new_log(len(self.state.segment)))
        self.first = self.state, self.block[layout.size :].copy()  # and the addresses of its arrays
        self.times: Array | None = None  # of the outputs there is room for
        self.ready = self.state  # as a run begins, its list of events short

    def begin(self, z: Array, duration: float, rtol: float) -> None:
        """The state of a run at t = 0 from the coordinates of the structure's own blocks."""
        self.numbers[:] = self.rest
        if self.settings != (duration, rtol):
            self.settings = duration, rtol
            self.state.now[T_END], self.accuracy[:] = duration, (rtol, landing_reach(rtol))
            self.rest[:] = self.numbers
        self.p += z[: self.p.size]
        self.v += z[self.p.size :]

    def sample(self, times: Array, duration: float) -> None:
        """Make room for outputs at times; room for the same times is used again."""
        if self.times is not times:
            self.forget_outputs()
            self.replace(**output_arrays(times, duration, self.state.x.size))
            self.times, self.ready = times, self.state

    def forget_outputs(self) -> None:
        """Remove the room for outputs, so that the next run keeps its end only, and a short list of events."""
        self.state, self.block[self.layout.size :] = self.first
        self.times, self.ready = None, self.state

    def replace(self, **arrays: Array) -> None:
        """Replace arrays of the state by others."""
        self.state = self.state._replace(**arrays)
        for name, array in arrays.items():
            self.layout.replace_array(self.block, 0, State._fields.index(name), array)


class Prepared(NamedTuple):
    """What all runs of one system share."""

    problem: Packed
    tables: Packed
    back: Array  # (2n, 2N): [q, q̇] from the state of all blocks
    layout: Layout  # of State and Scratch
    rest: Array  # state at t = 0: the tones' blocks, and minus the steady response of the structure's blocks
    steady: Any  # (tones, 2n) complex amplitudes of the steady response to each tone
    tone_load: Any  # (tones,) the load each belongs to
    spare_workspaces: list[Workspace]  # of runs that are over
    kept: Memo  # tables of the energy balance by the spacing of outputs and the tones, for all systems of the structure
    tones: bytes

    def energy_tables_for(self, spacing: float) -> Packed:
        """Tables of the energy balance for outputs of a spacing, s; what reads them is compiled for the first."""

        def make() -> tuple[Packed, Any]:
            load_parts(type_of(self.problem.value), ENERGY)
            made = energy_tables_for(self.problem.value, self.tables.value, spacing)
            return made, made.value  # so that the arrays count

        made: Packed = self.kept.get((spacing, self.tones), make)[0]
        return made

    @property
    def nbytes(self) -> int:
        """Memory that belongs to this one only; the rest is in `_SharedTables`."""
        return self.problem.nbytes + self.tables.nbytes + int(self.back.nbytes)

    def workspace(self) -> Workspace:
        """A workspace that no other run uses, a spare one if there is.

        With a new one for every run, the runs of `tests/bench/compiler_options.py` take 1.15, 1.09, 1.05 and, under
        noise, 1.03 times as long.
        """
        try:
            return self.spare_workspaces.pop()
        except IndexError:
            return Workspace(self.layout, self.rest, self.back.shape[0] // 2)


def prepare_run(system: System, forcing: Forcing, duration: float, rtol: float) -> tuple[Forcing, Prepared]:
    """The forcing without resonant tones and on one grid, and the tables with its sampled values."""
    system.about_structure.get("passive", lambda: _check_passive(system))
    taken = on_one_grid(without_resonance(system, forcing, duration, rtol), duration, float(_speeds(system).max()))
    prepared = prepare_system(system, taken)
    kind = type_of(prepared.problem.value)
    if _is_kinked(taken):
        load_parts(kind, KINKS)
    if prepared.tables.value.follows:
        load_parts(kind, FOLLOWING)
    if taken.table.size:
        sampled = prepared.problem.replaced(kind, table=taken.table, table_start=taken.table_start)
        prepared = prepared._replace(problem=sampled)
    return taken, prepared


def prepare_system(system: System, forcing: Forcing) -> Prepared:
    """Tables of a system, made once for each grid of its sampled signals and kept on it."""
    dt_cell = float(forcing.table_dt[0]) if forcing.table_dt.size else 1.0
    tones = forcing.tone_omega, forcing.tone_amplitude, forcing.tone_load

    def make() -> Prepared:
        return _shared_tables_for(system, forcing, dt_cell).with_tones(forcing, system.contacts)

    key = (
        "tables",
        dt_cell,
        _is_kinked(forcing),
        shortened(system),
        forcing.table_load.tobytes(),
        *(part.tobytes() for part in tones),
    )
    prepared: Prepared = system.kept.get(key, make)
    return prepared


def _shared_tables_for(system: System, forcing: Forcing, dt_cell: float) -> _SharedTables:
    """The tables shared by systems that differ only in tones, sampled values and gaps."""
    about, laws = system.about_structure, system.about_laws
    places = (part.tobytes() for part in (forcing.tone_load, forcing.table_dt, forcing.table_load))
    key = (
        "tables",
        laws,
        _is_kinked(forcing),
        shortened(system),
        *places,
        doublings(_speeds(system), forcing.tone_omega),
    )
    shared: _SharedTables = about.get(key, lambda: _SharedTables(system, forcing, dt_cell))
    return shared


def _is_kinked(forcing: Forcing) -> bool:
    """Whether the slopes of sampled signals jump at nodes."""
    return bool(forcing.table.shape[1] > 3)


def shortened(system: System) -> int:
    """How often the contact steps of a system have been shortened."""
    return len(system.kept.find("shortened") or ())


def shorten(system: System, shortest: float, duration: float) -> bool:
    """Shorten the contact steps of a system, the shortest one in s; False if that would be below rounding of time."""
    if shortened(system) == _MOST_SHORTENED or shortest * SHORTER < _ROUNDING_OF_TIME * duration:
        return False
    system.kept.get("shortened", list).append(True)
    return True


def _speeds(system: System) -> Array:
    """Bounds of the blocks' |λ|."""
    speeds: Array = np.sqrt(system.blocks.k) + system.blocks.c
    return speeds


class _SharedTables:
    """The problem and its tables with columns for tones, each of which becomes one more undamped block.

    The steady response to Re(a e^{iΩt}) is Re(Z e^{iΩt}) = Re Z · p + Im Z/Ω · v with p = cos Ωt, v = -Ω sin Ωt.
    """

    def __init__(self, system: System, forcing: Forcing, dt_cell: float) -> None:
        plain, self.tones = problem_of(system, forcing), len(forcing.tone_omega)
        self.k, self.c, self.load = plain.k, plain.c, plain.load  # not the whole, which holds the sampled signals
        contacts = system.contacts
        rubbing = [c.friction is not None for c in contacts]
        self.series = tuple((1.0, 0.0) if c.always else series_of(c.law) for c in contacts)
        problem, loss = _widened(plain, forcing, contacts), _loss_rows(plain, system)
        read_by = plain.read, plain.power, loss, system.blocks.T
        self.rows, ends = np.concatenate(read_by), np.cumsum([len(rows) for rows in read_by]).tolist()
        self.places = [slice(end - len(rows), end) for rows, end in zip(read_by, ends, strict=True)]
        self.back, self.fastest = among_tones(system.blocks.T, self.tones), max(float(_speeds(system).max()), 1e-3)
        energy_rows = np.zeros_like(problem.load), problem.power, among_tones(loss, self.tones)
        laws = law_tables_of(contacts)
        tables = build(
            problem, self.tones, self.series, laws, dt_cell, energy_rows, shortened(system), _is_kinked(forcing)
        )
        sizes = {
            **{"E": len(contacts), "R": len(problem.gap), "L": len(problem.load), "N": len(problem.k)},
            **{"tables": len(forcing.table_dt), "B": most_borders(problem), "A": int(np.count_nonzero(problem.radius))},
            **{"G": len(contacts) if any(rubbing) else 0, "F": sum(rubbing)},
        }
        bent = tables.bend.any() or problem.border_count.any()
        needs = bent, len(contacts) > 1, tables.node_propagator.size, problem.radius.any() or any(rubbing), any(rubbing)
        for places, needed in zip((BORDERS, TWO_STOPS, MANY_STOPS, CIRCLES, FRICTION), needs, strict=True):
            load_parts(type_of(problem), (*EVERY_RUN, *places) if needed else EVERY_RUN)
        self.layout = _layout(pool=POOL if tables.node_propagator.size else 0, **sizes)
        self.kept = Memo(_MOST_KEPT)
        self.problem = PackedTemplate(problem, type_of(problem), ("gap", "radius", "k", "read", "read_rate", "power"))
        self.tables = PackedTemplate(aligned(tables), TABLES, TONE_TABLES)

    @property
    def nbytes(self) -> int:
        """Memory of problem and tables."""
        return sum(getattr(array, "nbytes", 8) for part in (self.problem, self.tables) for array in part.value)

    def with_tones(self, forcing: Forcing, contacts: Sequence[Contact]) -> Prepared:
        """A copy with the columns of given tones, and with the gaps of given contacts."""
        omega, amplitude, n = forcing.tone_omega, forcing.tone_amplitude, len(self.k)
        load = self.load[forcing.tone_load] * amplitude[:, None]
        response = steady_response(self.k, self.c, load, omega[:, None])
        turn = 1.0 / np.where(omega > 0.0, omega, np.inf)
        steady = np.concatenate((response.real, response.imag * turn[:, None])).T  # (2n, 2 tones)
        columns = (self.rows @ steady).reshape(len(self.rows), 2, self.tones)
        problem, tables, back = self.problem.copy(), self._tables(forcing, turn), self.back.copy()
        read_by = problem.value.read, problem.value.power, tables.value.loss_rows, back
        for rows, place in zip(read_by, self.places, strict=True):
            _columns_of_tones(rows, n)[:] = columns[place]
        problem.value.gap[:], problem.value.radius[:] = gaps_of(contacts), radii_of(contacts)
        problem.value.k[n:] = omega**2
        p, v = columns[self.places[0]].transpose(1, 0, 2)
        rate = _columns_of_tones(problem.value.read_rate, n)
        rate[:, 0], rate[:, 1] = -v * problem.value.k[n:], p
        tables.value.power_rows[:], tables.value.steady_rate[:, :n] = problem.value.power, steady[n:].T
        fill_tones(tables.value, problem.value, self.tones, self.series)
        rest = among_tones(-response.real.sum(axis=0), self.tones)
        rest[n : n + self.tones] = 1.0
        key = omega.tobytes() + amplitude.tobytes()
        return Prepared(problem, tables, back, self.layout, rest, response, forcing.tone_load, [], self.kept, key)

    def _tables(self, forcing: Forcing, turn: Array) -> Packed:
        """Tables that know the signals made of tones, Re(a e^{iΩt}) = Re a · p + Im a/Ω · v; ``turn`` is 1/Ω."""
        tables = self.tables.copy(fastest=max(self.fastest, float(forcing.tone_omega.max(initial=0.0))))
        rows, load, each = tables.value.signal_rows, forcing.tone_load, np.arange(self.tones)
        rows[load, each - self.tones + rows.shape[1] // 2] = forcing.tone_amplitude.real
        rows[load, each - self.tones] = forcing.tone_amplitude.imag * turn
        return tables


def _columns_of_tones(rows: Array, n: int) -> Array:
    """(k, 2, tones) columns of the blocks behind the first n."""
    return rows.reshape(len(rows), 2, rows.shape[1] // 2)[:, :, n:]


def _check_passive(system: System) -> bool:
    """True if no block gains energy by itself, else ValueError: the proof that no contact is missed assumes it."""
    k, c = system.blocks.k, system.blocks.c
    if np.any(k < 0.0):
        raise ValueError(
            f"K must be positive semi-definite for Exponential, its lowest ω² is {k.min():g} (buckled?); "
            "use DormandPrince"
        )
    if c.min() < -1e-12 * (np.sqrt(k).max() + np.abs(c).max()):
        raise ValueError(
            f"C must not drive the motion for Exponential, its lowest 2ζω is {c.min():g}; use DormandPrince, or a law"
        )
    return True


@lru_cache(maxsize=64)
def _layout(**known: int) -> Layout:
    """Shapes and places of the arrays of `State` and `Scratch`; ``pool`` counts its pairs of rows, 0 for few rows."""
    blocks, pool, inputs = known["N"], known["pool"], known["R"] + known["L"]
    own, many = padded(blocks), blocks if pool else 0
    width = 2 * blocks + 2 + 2 * known["E"] + ACCOUNTS * known["F"]
    sizes = {
        **{"X": width, "X8": padded(width), "W8": max(padded(width + 2), 2 * own), "N8": own, "stages": START + 1},
        **{"S": S, "M": many, "M8": padded(2 * many), **NO_ROWS},
        "numbers": padded(4 * blocks + 2 * S * (inputs + 2)) + 16 * known["tables"],
        **known,
    }
    return Layout([STATE, SCRATCH], [shapes_of(State, sizes), shapes_of(Scratch, sizes)])


def _loss_rows(problem: Problem, system: System) -> Array:
    """Rows whose squares sum to the damping power: √c v, or of coupled blocks √C q̇ with q̇ of the blocks.

    A root of the blocks' own quadratic form of the power would err by the square of what cancels in q̇. As many rows
    tell that the blocks are coupled; their squares, of what C drives where it is indefinite, are taken off.
    """
    n = len(problem.k)
    if not problem.loss.size:
        return np.hstack((np.zeros((n, n)), np.diag(np.sqrt(np.maximum(problem.c, 0.0)))))
    C = dense(system.C)
    values, vectors = np.linalg.eigh(0.5 * (C + C.T))
    rates = vectors.T @ system.blocks.T[n:]
    return np.vstack([np.sqrt(np.maximum(part, 0.0))[:, None] * rates for part in (values, -values)])


def _widened(problem: Problem, forcing: Forcing, contacts: Sequence[Contact]) -> Problem:
    """The problem with one block per tone, whose read rows are zero; tones and sampled values are removed."""
    tones, none = len(forcing.tone_omega), np.zeros(0)
    sampled = np.zeros_like(problem.load)
    sampled[forcing.table_load] = problem.load[forcing.table_load]
    rows = {name: among_tones(getattr(problem, name), tones) for name in ("push", "read", "read_rate", "power")}
    return problem._replace(
        k=np.concatenate((problem.k, forcing.tone_omega**2)),
        c=np.concatenate((problem.c, np.zeros(tones))),
        loss=np.empty((0, 0)),
        load=among_tones(sampled, tones),
        friction=frictions_of(contacts, 2 * (len(problem.k) + tones)),
        tone_omega=none,
        tone_amplitude=none.astype(complex),
        tone_load=none.astype(np.int64),
        table=np.empty((0, 3)),
        table_start=np.zeros_like(forcing.table_start),
        **rows,
    )


@lru_cache(maxsize=64)
def places_among_tones(n: int, tones: int) -> Any:
    """(2n,) indices of the structure's coordinates among those with the tones' blocks."""
    own = np.arange(n)
    return np.concatenate((own, own + (n + tones)))


def among_tones(rows: Array, tones: int) -> Array:
    """Block coordinates (..., 2n) widened by zeros for the tones' blocks."""
    n = rows.shape[-1] // 2
    out = np.zeros((*rows.shape[:-1], 2, n + tones))
    out[..., :n] = rows.reshape(*rows.shape[:-1], 2, n)
    return out.reshape(*rows.shape[:-1], 2 * (n + tones))
