"""Work and damping of whole steps as quadratic forms: tables made for the first run with an energy balance.

With y = (x, s), the state and the derivatives s, s', ..., s⁽⁵⁾ of every sampled signal, flight is y' = B y, and input
work and damping of a step are

    ∫ y^T P y dt = y₀^T M(h) y₀,   M(2h) = M(h) + Φ(h)^T M(h) Φ(h),   Φ = exp(B h),

started by Gauss's rule on steps short enough for a Taylor series of Φ. Kept are the damping of the structure's blocks
and, for every *driver* (tones and signals; with coupled damping every coordinate), the rows that give work and damping.

Tables of contact steps are those of `contact_tables`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np

from solvers.compiled.fields import packed_type
from solvers.compiled.kernels import Problem
from solvers.compiled.packed import Packed, aligned
from solvers.compiled.sums import padded
from solvers.exponential.contact.nodes import S, gauss
from solvers.exponential.energy.contact_sums import Steps, Sums, free_loss, tones_at_nodes
from solvers.exponential.energy.contact_tables import contact_table
from solvers.exponential.energy.quadratic_forms import Forms, carried, entries_of, flow_of, forms_of, rows_of, taylor
from solvers.exponential.flight import SERIES_TERMS
from solvers.exponential.phi_functions import derivatives_of_ends, signal_responses
from solvers.exponential.responses import fill_propagators
from solvers.exponential.tables import OBSERVED_RADIANS, Tables

_OCTAVE = 4  # flight steps per factor of two
_BRIEF = 0.04  # |λ| h up to which twelve terms of a Taylor series are exact
_MOST_NUMBERS = 10_000_000  # in ``rows``: above, with many drivers, flight is integrated by series
_MOST_PER_BLOCK = 1000  # numbers of a summed form per block: above, with many tones, forms of each block are cheaper
_SERIES = np.array([gauss(S)[0] ** i / math.factorial(i) for i in range(SERIES_TERMS)])  # see `flight_balance`


class EnergyTables(NamedTuple):
    """Numbers of the energy balance, read by kernels only; l counts flight steps and the cell, j contact steps."""

    active: Annotated[float, "number"]  # whether there is a balance
    closed: Annotated[float, "number"]  # whether there are forms for flight
    spacing: Annotated[float, "number"]  # s, of the last step in the tables: a cell, or the time between outputs
    driver: Annotated[Any, "int d"]  # columns of the state that are drivers, see the module
    power: Annotated[Any, "L, N8"]  # input power = signal × power row, from v
    plain: Annotated[Any, "l, 3, N8"]  # damping = Σ rows × (p², p v, v²)
    rows: Annotated[Any, "l, 6*J+d, 4*N8"]  # work, then damping, from p, then v, per unit of a signal or driver
    pairs: Annotated[Any, "l, 6*J, pairs"]  # the same from the signals, 2 × 6J padded
    series: Annotated[Any, "LONG, S"]  # x^i/i! at Gauss's points, see `flight_balance`
    kind: Annotated[Any, "int f"]  # contact table of every node set
    first: Annotated[float, "number"]  # contact step at which the tables begin
    longest: Annotated[Any, "kinds"]  # s: contact step up to which they may be used
    steady: Annotated[Any, "kinds, j, K, 2, S"]  # α, β of every tone at the nodes
    contact: Annotated[Any, "kinds, j, N, 3*S+5, 2*S"]  # forms of each block, or none if there are the next three
    head: Annotated[Any, "int H"]  # rows of `Scratch.force` that are heads, see `contact_sums`
    sums: Annotated[Any, "f, j, heads, sums"]  # forms of 2N + S H rows summed over the blocks
    free_loss: Annotated[Any, "kinds, j, 3, N"]  # damping of free motion = Σ rows × (p², p v, v²)


ENERGY_TABLES = packed_type(EnergyTables)


def _empty(kept: float, node_sets: int) -> EnergyTables:
    """Tables without forms; ``kept`` is 1 if there is a balance."""
    none, nothing, contact = np.zeros(0, dtype=np.int64), np.zeros((0, 0, 0)), np.zeros((0, 0, 0, 0, 0))
    flight = kept, 0.0, 0.0, none, np.zeros((0, 0)), nothing, nothing, nothing
    kind, longest, sums = np.zeros(node_sets, dtype=np.int64), np.zeros(1), np.zeros((0, 0, 0, 0))
    return EnergyTables(*flight, _SERIES, kind, 0.0, longest, contact, contact, none, sums, sums)


NO_ENERGY_TABLES = Packed.of(_empty(0.0, 1), ENERGY_TABLES)


def energy_tables_for(problem: Problem, tables: Tables, spacing: float) -> Packed:
    """All tables of a run with an energy balance, beyond those of the motion; ``spacing`` of its outputs, s."""
    energy_tables, own = _empty(1.0, len(tables.time_exponent)), int(tables.own_blocks)
    if not (_coupled(tables) or any(part[:, :own].any() for part in (problem.push, problem.load, problem.read_rate))):
        energy_tables = _contact_part(energy_tables, problem, tables)
    driver = np.flatnonzero(_drives(problem, tables))
    power = np.zeros((len(problem.load), padded(len(problem.k))))
    power[:, : len(problem.k)] = tables.power_rows[:, len(problem.k) :]
    step = problem.table_dt[0] if len(problem.table_dt) else spacing  # cells are crossed whole even without forms
    energy_tables = energy_tables._replace(power=power, spacing=step)
    size, signals = 2 * len(problem.k), len(problem.table_dt)
    if (len(tables.flight_step) + 1) * (len(driver) + 6 * signals) * 2 * padded(size) <= _MOST_NUMBERS:
        energy_tables = _flight_part(energy_tables, problem, tables, driver)
    return Packed.of(aligned(energy_tables), ENERGY_TABLES)


def _coupled(tables: Tables) -> bool:
    """Whether damping couples the blocks: then it has a row per coordinate, else per block."""
    return len(tables.loss_rows) > int(tables.own_blocks)


def _drives(problem: Problem, tables: Tables) -> Any:
    """(2N,) whether a coordinate is a driver: those of tones, and all if damping couples the blocks."""
    own = np.arange(2 * len(problem.k)) % len(problem.k) < int(tables.own_blocks)
    return np.ones_like(own) if _coupled(tables) else ~own


# --- flight


def _flight_part(energy_tables: EnergyTables, problem: Problem, tables: Tables, driver: Any) -> EnergyTables:
    """Add the forms of all flight steps, then of the cell or, without sampled signals, of the time between two outputs.

    Signals are given by their derivatives at the start of a step, but for a cell by s, s', s'' at both ends.
    """
    powers, size, n = _power_forms(problem, tables), 2 * len(problem.k), len(problem.k)
    levels = -(-len(tables.flight_step) // _OCTAVE) * _OCTAVE
    h = tables.flight_step[0] * 2.0 ** (-np.arange(levels) / _OCTAVE)
    signal = tables.signal[..., :n].reshape(*tables.signal.shape[:3], size)
    spacing = energy_tables.spacing
    *_, last = _doubled_forms(problem, powers, *_halved_steps(problem, spacing))
    Y = powers.shape[-1]
    kept = np.append(np.arange(size, Y), driver)
    b = np.arange(0 if _coupled(tables) else int(tables.own_blocks))

    def read(forms: Forms) -> tuple[Any, Any, Any]:
        """What is kept of the forms of some steps: rows, damping of blocks by themselves, pairs of signals."""
        rows = rows_of(forms, Y, kept)
        pairs, rows = rows[:, :, : Y - size, size:].copy(), 2.0 * rows[..., :size]
        rows[:, :, Y - size :][..., driver] *= 0.5
        plain = np.zeros((len(rows), 3, padded(n)))
        plain[..., b] = entries_of(forms, Y, n, b) * np.array([1.0, 2.0, 1.0])[:, None]
        return rows, plain, pairs

    groups = [read(forms) for forms in _doubled_forms(problem, powers, h, _OCTAVE, tables.flight_propagator, signal)]
    steps = [np.concatenate(parts)[: len(tables.flight_step)] for parts in zip(*reversed(groups), strict=True)]
    cell = read(carried(last, _ends(size, Y, spacing)))
    rows, plain, pairs = (np.concatenate(both) for both in zip(steps, cell, strict=True))
    return energy_tables._replace(
        **{"closed": 1.0, "driver": driver.astype(np.int64), "plain": plain},
        **{"rows": _side_by_side(rows.reshape(*rows.shape[:-1], 2, n)), "pairs": _side_by_side(pairs[:, :, :, None])},
    )


def _side_by_side(forms: Any) -> Any:
    """(l, d, numbers) parts (l, 2, d, parts, columns) of work, then of damping, padded and side by side."""
    steps, _, rows, parts, columns = forms.shape
    out = np.zeros((steps, rows, 2, parts, padded(columns)))
    out[..., :columns] = forms.transpose(0, 2, 1, 3, 4)
    return out.reshape(steps, rows, 2 * parts * padded(columns))


def _power_forms(problem: Problem, tables: Tables) -> Any:
    """(2, Y, Y) input power and damping power as forms of y."""
    size = 2 * len(problem.k)
    forms = np.zeros((2, *(size + 6 * len(problem.table_dt),) * 2))
    forms[0, :size, :size] = tables.signal_rows.T @ tables.power_rows
    for j, load in enumerate(problem.table_load):
        forms[0, size + 6 * j, :size] += tables.power_rows[load]
    forms[0] = 0.5 * (forms[0] + forms[0].T)
    signs = np.where(np.arange(len(tables.loss_rows)) < int(tables.own_blocks), 1.0, -1.0)
    forms[1, :size, :size] = (tables.loss_rows.T * signs) @ tables.loss_rows
    return forms


def _ends(size: int, Y: int, h: float) -> Forms:
    """The flow from values and derivatives of the signals at both ends of a cell to those at its start."""
    matrix = np.eye(Y)
    for first in range(size, Y, 6):
        matrix[first : first + 6, first : first + 6] = derivatives_of_ends(h)
    rows, columns = np.nonzero(matrix)
    return flow_of(rows, columns, matrix[rows, columns][None], Y)


def _generator(problem: Problem) -> tuple[Any, Any, Any]:
    """B of y' = B y: rows, columns and values of its entries."""
    n, size = len(problem.k), 2 * len(problem.k)
    b, state, shifts = np.arange(n), np.arange(size), np.arange(5)
    parts = [(b, n + b, np.ones(n)), (n + b, b, -problem.k), (n + b, n + b, -problem.c)]
    for j, load in enumerate(problem.table_load):
        first = size + 6 * j
        parts += [(state, np.full(size, first), problem.load[load]), (first + shifts, first + shifts + 1, np.ones(5))]
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    return rows, columns, values


def _brief_forms(problem: Problem, powers: Any, h: Any) -> Forms:
    """(len(h), 2, Y, Y) forms of steps of at most `_BRIEF`, by Gauss's rule on the Taylor series of Φ."""
    (rows, columns, values), (points, weights), Y = _generator(problem), gauss(8), powers.shape[-1]
    start, all_rows, ones = forms_of(powers, len(h)), np.arange(Y), np.ones(Y)
    total = 0.0 * start
    for point, weight in zip(points, weights, strict=True):
        begin = flow_of(all_rows, all_rows, np.sqrt(weight * h)[:, None] * ones, Y)
        generator = flow_of(rows, columns, point * h[:, None] * values, Y)
        total = total + carried(start, taylor(begin, generator))
    return total


def _doubled_forms(problem: Problem, powers: Any, h: Any, octave: int, propagator: Any, signal: Any) -> Iterator[Forms]:
    """(octave, 2, Y, Y) forms of falling steps, each twice as long as that ``octave`` places later; shortest first."""
    shorter = 0
    fastest = float((np.sqrt(problem.k) + problem.c).max())
    brief = h[-octave:]
    while brief[0] * fastest > _BRIEF:
        brief, shorter = 0.5 * brief, shorter + 1
    form = _brief_forms(problem, powers, brief)
    for _ in range(shorter):
        form, brief = form + carried(form, _flow(problem, brief, *_moves(problem, brief))), 2.0 * brief
    yield form
    for end in range(len(h), octave, -octave):
        which = slice(end - octave, end)
        moves = _moves(problem, h[which]) if end > len(propagator) else (propagator[which], signal[which])
        form = form + carried(form, _flow(problem, h[which], *moves))
        yield form


def _moves(problem: Problem, h: Any) -> tuple[Any, Any]:
    """Propagators and responses to signals for a few steps."""
    steps, n = np.ascontiguousarray(h), len(problem.k)
    moves = np.empty((len(steps), 2, n))
    fill_propagators(problem.k, problem.c, (0, n), steps, moves)
    return moves, signal_responses(problem, steps)


def _halved_steps(problem: Problem, h: float) -> tuple[Any, int, Any, Any]:
    """Steps from h down to a brief one, each half of the one before, with octave 1 and their `_moves`."""
    fastest = float((np.sqrt(problem.k) + problem.c).max())
    steps = h * 2.0 ** -np.arange(1 + max(0, math.ceil(math.log2(max(h * fastest, 1e-300) / _BRIEF))))
    return steps, 1, *_moves(problem, steps)


def _flow(problem: Problem, h: Any, propagator: Any, signal: Any) -> Forms:
    """Φ(h) of some steps."""
    n, b, state = len(problem.k), np.arange(len(problem.k)), np.arange(2 * len(problem.k))
    alpha, beta = propagator[:, 0, :n], propagator[:, 1, :n]
    parts: list[Any] = [
        (b, b, alpha),
        (b, n + b, beta),
        (n + b, b, -problem.k * beta),
        (n + b, n + b, alpha - problem.c * beta),
    ]
    for j, load in enumerate(problem.table_load):
        first, power = 2 * n + 6 * j, np.ones_like(h)
        for apart in range(6):
            parts.append((state, np.full(2 * n, first + apart), signal[:, load, apart]))
            own = first + np.arange(6 - apart)
            parts.append((own, own + apart, np.repeat(power[:, None], len(own), axis=1)))
            power = power * h / (apart + 1.0)
    rows, columns, values = zip(*parts, strict=True)
    places = np.concatenate(rows), np.concatenate(columns)
    return flow_of(*places, np.concatenate(values, axis=1), 2 * n + 6 * len(problem.table_dt))


# --- contact


def _contact_part(energy_tables: EnergyTables, problem: Problem, tables: Tables) -> EnergyTables:
    """Add the tables of contact steps, one for all stops with the same exponents κ and λ."""
    own = int(tables.own_blocks)
    fastest = float((np.sqrt(problem.k) + problem.c)[:own].max())
    h = tables.contact_step[int(np.searchsorted(-tables.contact_step * fastest, -OBSERVED_RADIANS)) :]
    node_sets = list(zip(tables.time_exponent.tolist(), tables.weight_exponent.tolist(), strict=True))
    kinds = list(dict.fromkeys(node_sets))
    places = tables.nodes[[node_sets.index(kind) for kind in kinds]]
    structure = [part.tobytes() for part in (problem.k[:own], problem.c[:own], h)]
    of_kinds = [contact_table(*structure, *kind, row.tobytes()) for kind, row in zip(kinds, places, strict=True)]
    steady = _steady(np.sqrt(problem.k[own:]), h, places ** np.array([power for power, _ in kinds])[:, None])
    energy_tables = energy_tables._replace(
        kind=np.array([kinds.index(node_set) for node_set in node_sets], dtype=np.int64),
        first=float(len(tables.contact_step) - len(h)),
        longest=_longest(np.sqrt(problem.k[own:].max(initial=0.0)), kinds, h),
    )
    sums = Sums(problem, tables)
    if tables.node_propagator.size or math.prod(sums.shape) > _MOST_PER_BLOCK * own:
        return energy_tables._replace(steady=steady, contact=np.stack(of_kinds))
    tones, weights = [tones_at_nodes(part, problem.k[own:]) for part in steady], h[:, None] * tables.plain[:, None]
    entering = [
        np.flatnonzero((problem.element == f - 1) & (weight > 0.0)).tolist()
        for f, weight in enumerate(tables.weight_exponent)
    ]
    steps = [Steps(of_kinds[kind], entering[f], weights[f], tones[kind]) for f, kind in enumerate(energy_tables.kind)]
    return energy_tables._replace(
        head=sums.heads,
        sums=np.stack([sums.of(part) for part in steps]),
        free_loss=np.stack([free_loss(table, problem.c[:own]) for table in of_kinds]),
    )


def _longest(omega: float, kinds: Any, h: Any) -> Any:
    """(kinds,) s: step up to which polynomials through the nodes resolve a tone to 1e-11; cos is a series in σ^{2κ}."""
    terms = [S // int(power) for power, _ in kinds]
    phases = np.array([(1e-11 * 2.0 ** (2 * S - 1) * math.factorial(count)) ** (1.0 / count) for count in terms])
    return np.minimum(phases / omega, h[0]) if omega > 0.0 else np.full(len(kinds), h[0])


def _steady(omega: Any, h: Any, times: Any) -> Any:
    """(kinds, j, K, 2, S) α, β of tones at the nodes of all steps."""
    phase = omega[:, None] * (h[:, None] * times[:, None, :])[:, :, None, :]
    moving = np.where(omega > 0.0, omega, 1.0)[:, None]
    sine = np.where(omega[:, None] > 0.0, np.sin(phase), (h[:, None] * times[:, None, :])[:, :, None, :])
    return np.ascontiguousarray(np.stack((np.cos(phase), sine / moving), axis=3))
