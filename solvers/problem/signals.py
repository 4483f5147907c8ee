"""Signals as arrays, for compiled code.

A signal is any callable t -> value that broadcasts. It becomes exactly one of

* *tones*: ``signal.tones() -> (omega (k,), amplitude (k,) complex)``, value Re Σ a e^{iωt}, exact, ω of either sign;
* *nodes*: ``signal.nodes(duration, rtol) -> (dt, (N, 3))``, rows [s, s', s''] at t = 0, dt, ...; between them the
  quintic through both ends' values, slopes and curvatures, within ``rtol`` times the signal's size, in the mean
  square at least. Where slope or curvature jump at nodes, (N, 6): of the cell that begins there, then of that which
  ends;
* nothing of either: sampled here by a quintic spline, refined until it agrees between its nodes at 4096 places or more.
  What is shorter than duration/4096, such as a pulse, may hide between these and needs ``nodes``. Where the signal or
  its slope jumps, no spline agrees to a small tolerance, and the signal is refused, with the time of a jump or kink.

What is made of signals that are frozen dataclasses, their arrays read-only, is kept for other runs of the system; all
other signals are asked anew by every run.

A node table declares all that a signal does. Flight of `Exponential` crosses it cell by cell, and its contact steps are
compared with every node they pass. A step of `DormandPrince` ends on the next node, passes some if they are close, or
goes on to where the signal ceases to be constant. So neither passes over a part of it, however short, even at rest.
Methods of constant step know a signal only where their steps evaluate it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.problem.matrices import Array
from solvers.problem.system import Signal

_MOST_NODES = 20_000_000
_FEWEST_PLACES = 4096  # where a plain callable is compared with its spline
_JUMP_ROUNDS = 5  # each looks at a 64th of the interval before
_KINK_ROUNDS = 3  # each looks at a 32nd


@dataclass(frozen=True, eq=False)
class Forcing:
    """All signals of a system as arrays: tones (K,) and node tables (sum N, 3), each with the load it drives."""

    tone_omega: Array
    tone_amplitude: Any
    tone_load: Any
    table: Array
    table_dt: Array
    table_start: Any
    table_load: Any

    @property
    def nbytes(self) -> int:
        """Memory of the arrays."""
        return sum(int(array.nbytes) for array in vars(self).values())


def sampling_tolerance(rtol: float) -> float:
    """Tolerance to which a method of some ``rtol`` takes signals that are sampled: at most 1e-6, at least 1e-12."""
    return min(max(rtol, 1e-12), 1e-6)


def forcing_of(signals: list[Signal], duration: float, rtol: float) -> Forcing:
    """Arrays of all signals on [0, duration]."""
    tones: list[tuple] = []
    tables: list[tuple[float, Array, int]] = []
    for load, signal in enumerate(signals):
        if hasattr(signal, "tones"):
            tones += [  # of a constant the real part is all there is
                (w, a if w else complex(a.real), load)
                for w, a in zip(*(part.tolist() for part in tones_of(signal, load)), strict=True)
            ]
        else:
            provider = getattr(signal, "nodes", None)
            told = provider(duration, rtol) if provider else _sample(signal, duration, rtol, load)
            dt, rows = _numbers(told, load)
            _check_nodes(rows, dt, duration, load)
            tables.append((dt, rows, load))
    starts = np.cumsum([0] + [len(rows) for _, rows, _ in tables])
    return Forcing(
        np.array([t[0] for t in tones], dtype=float),
        np.array([t[1] for t in tones], dtype=complex),
        np.array([t[2] for t in tones], dtype=np.int64),
        joined([rows for _, rows, _ in tables]),
        np.array([dt for dt, _, _ in tables], dtype=float),
        starts.astype(np.int64),
        np.array([load for _, _, load in tables], dtype=np.int64),
    )


def tones_of(signal: Any, load: int) -> tuple[Array, Any]:
    """Frequencies (k,), none of them negative, and complex amplitudes (k,) of the signal of a load, checked."""
    told = signal.tones()
    try:
        parts: Any = (np.asarray(part, dtype=kind) for part, kind in zip(told, (float, complex), strict=True))
        omega, amplitude = parts
        fits = omega.ndim == 1 and omega.shape == amplitude.shape
    except (TypeError, ValueError):
        fits = False
    if not fits:
        need = f"tones() of the signal of load {load} must give frequencies and as many amplitudes"
        raise ValueError(f"{need}, got {repr(told)[:60]}")
    if not (np.all(np.isfinite(omega)) and np.all(np.isfinite(amplitude))):
        raise ValueError(f"tones() of the signal of load {load} must be finite, got {repr(told)[:60]}")
    return np.abs(omega), np.where(omega < 0.0, np.conj(amplitude), amplitude)


def sampled_values(forcing: Forcing, t: Array) -> dict[int, Array]:
    """Values (k,) at times (k,) of the loads that have node tables, as the quintics between the nodes have them."""
    found = {}
    for j, load in enumerate(forcing.table_load.tolist()):
        own = forcing.tone_load == load  # of a load whose other tones are sampled
        tones = forcing.tone_amplitude[own] @ np.exp(1j * np.outer(forcing.tone_omega[own], t))
        rows = forcing.table[forcing.table_start[j] : forcing.table_start[j + 1]]
        dt = float(forcing.table_dt[j])
        cell = np.clip((t / dt).astype(np.int64), 0, len(rows) - 2)
        found[load] = tones.real + quintics(dt, rows, cell, t / dt - cell)[0]
    return found


def quintics(dt: float, rows: Array, cell: Any, x: Array) -> tuple[Array, Array]:
    """Values and slopes (...,) of a node table within some of its cells, at places x (...,) from 0 to 1."""
    a, b = (side * np.array([1.0, dt, dt * dt]) for side in (rows[cell, :3], rows[cell + 1, -3:]))
    rest = b - np.stack((a @ [1.0, 1.0, 0.5], a @ [0.0, 1.0, 1.0], a[..., 2]), axis=-1)
    c3, c4, c5 = rest @ [10.0, -4.0, 0.5], rest @ [-15.0, 7.0, -1.0], rest @ [6.0, -3.0, 0.5]
    value = a[..., 0] + x * (a[..., 1] + x * (0.5 * a[..., 2] + x * (c3 + x * (c4 + x * c5))))
    slope = a[..., 1] + x * (a[..., 2] + x * (3.0 * c3 + x * (4.0 * c4 + 5.0 * x * c5)))
    return value, slope / dt


def joined(tables: list[Array]) -> Array:
    """All node tables in one array, with both sides of each node if one has them; a single one is not copied."""
    if len(tables) == 1:
        return np.ascontiguousarray(tables[0], dtype=float)
    columns, ends = max([table.shape[1] for table in tables], default=3), np.cumsum([len(table) for table in tables])
    out = np.empty((ends[-1] if tables else 0, columns))
    for table, end in zip(tables, ends, strict=True):
        width = table.shape[1]
        for side in range(0, columns, width):  # both sides of a node are one where the table does not tell them
            out[end - len(table) : end, side : side + width] = table
    return out


def tones_as_nodes(forcing: Forcing, chosen: list[int], duration: float, rtol: float) -> Forcing:
    """The same forcing with some tones as node tables: quintics within ``rtol`` of them, |error| <= (ω dt)⁶/46080."""
    tables, loads = [forcing.table], sorted(set(forcing.tone_load[chosen].tolist()))
    for load in loads:  # one table per load, as for any signal
        mine = [i for i in chosen if forcing.tone_load[i] == load]
        omega = forcing.tone_omega[mine]
        longest = (4608.0 * rtol) ** (1.0 / 6.0) / omega.max() if omega.max() > 0.0 else duration
        t = np.linspace(0.0, duration, max(1, int(np.ceil(duration / longest))) + 1)
        waves = forcing.tone_amplitude[mine] * np.exp(1j * np.outer(t, omega))
        tables.append(np.stack([(waves * (1j * omega) ** k).sum(axis=1).real for k in range(3)], axis=1))
    kept = np.setdiff1d(np.arange(len(forcing.tone_omega)), chosen)
    sizes = [len(table) for table in tables[1:]]
    return Forcing(
        forcing.tone_omega[kept],
        forcing.tone_amplitude[kept],
        forcing.tone_load[kept],
        joined(tables),
        np.concatenate((forcing.table_dt, [duration / (size - 1) for size in sizes])),
        np.concatenate((forcing.table_start, forcing.table_start[-1] + np.cumsum(sizes, dtype=np.int64))),
        np.concatenate((forcing.table_load, np.array(loads, dtype=np.int64))),
    )


def _numbers(told: Any, load: int) -> tuple[float, Array]:
    """Step and rows of a node table as real numbers, or a ValueError that says what was given."""
    try:
        dt, rows = told
        if np.iscomplexobj(rows):
            raise TypeError
        return float(dt), np.asarray(rows, dtype=float)
    except (TypeError, ValueError):
        need = f"nodes() of the signal of load {load} must give dt and rows of real numbers"
        raise ValueError(f"{need}, got {repr(told)[:60]}") from None


def _check_nodes(rows: Array, dt: float, duration: float, load: int) -> None:
    """A node table has three columns, or six, is finite and covers the run."""
    if not 0.0 < dt < math.inf:
        raise ValueError(f"nodes() of the signal of load {load} must give a positive, finite dt (s), got {dt!r}")
    if np.ndim(rows) != 2 or np.shape(rows)[1] not in (3, 6):
        raise ValueError(
            f"nodes() of the signal of load {load} must give rows [s, s', s''], (N, 3), or of both sides, (N, 6); "
            f"got the shape {np.shape(rows)}"
        )
    if not np.all(np.isfinite(rows)):
        bad = int(np.argwhere(~np.isfinite(rows))[0, 0])
        raise ValueError(f"the signal of load {load} is not finite at t = {bad * dt:g} s")
    if rows.shape[1] == 6 and not np.allclose(rows[:, 0], rows[:, 3], 0.0, 1e-9 * np.abs(rows[:, 0]).max()):
        bad = int(np.argmax(np.abs(rows[:, 0] - rows[:, 3])))
        raise ValueError(f"the signal of load {load} jumps at t = {bad * dt:g} s; only slope and curvature may")
    if (len(rows) - 1) * dt < duration * (1.0 - 1e-12):
        raise ValueError(f"the signal of load {load} ends at {(len(rows) - 1) * dt:g} s, the run at {duration:g} s")


def _values(signal: Signal, t: Any, load: int) -> Array:
    """Checked values (k,) of a plain callable, which may change the times that it is given."""
    try:
        found = np.asarray(signal(t.copy()))
    except (TypeError, ValueError) as error:
        told = f"the signal of load {load} must take an array of times, got {type(error).__name__} ({error})"
        raise ValueError(f"{told}; write np.sin for math.sin, np.where for if") from error
    if found.shape != t.shape:
        told = f"the signal of load {load} must broadcast: {t.shape} times gave {found.shape} values"
        raise ValueError(f"{told}; a constant is np.full_like(t, value)")
    if np.iscomplexobj(found):
        raise ValueError(
            f"the signal of load {load} must be real, got {found[0]} at t = {t[0]:g} s; give its real part"
        )
    values = found.astype(float)
    if not np.all(np.isfinite(values)):
        bad = int(np.argmin(np.isfinite(values)))
        raise ValueError(f"the signal of load {load} is {values[bad]} at t = {t[bad]:g} s")
    return values


def _refuse_jumps(signal: Signal, t: Array, values: Array, rtol: float, load: int) -> None:
    """ValueError where a signal changes within 1e-9 of its steepest cell by half as much as in all of it, or more."""
    found, changes = values, []
    for _ in range(1 + _JUMP_ROUNDS):
        steepest = int(np.argmax(np.abs(np.diff(found))))
        t = np.linspace(t[steepest], t[steepest + 1], 65)
        found = _values(signal, t, load)
        changes.append(np.ptp(found))
    if changes[-1] > max(0.5 * changes[0], rtol * np.abs(values).max()):
        raise ValueError(
            f"the signal of load {load} jumps at t = {t[0]:g} s; only slope and curvature may, at nodes(): "
            "let it rise within a short time"
        )


def _refuse_kinks(signal: Signal, around: float, cell: float, error: float, duration: float, load: int) -> None:
    """ValueError where a signal's slope changes within 1e-4 of a cell by half as much as within six, or more.

    So much that it explains the error of the spline: otherwise it is rounding.
    """
    t = np.linspace(max(around - 3.0 * cell, 0.0), min(around + 3.0 * cell, duration), 65)
    changes, at = [], around
    for _ in range(1 + _KINK_ROUNDS):
        slopes = np.diff(_values(signal, t, load)) / (t[1] - t[0])
        sharpest = int(np.argmax(np.abs(np.diff(slopes))))
        changes.append(float(np.ptp(slopes)))
        at, t = t[sharpest + 1], np.linspace(t[sharpest], t[sharpest + 2], 65)
    if max(0.5 * changes[0], error / cell) < changes[-1] < 2.0 * changes[0]:  # of a jump it grows
        raise ValueError(
            f"the signal of load {load} has a kink at t = {at:g} s, where no spline agrees: give it nodes() that tell "
            "both sides, such as those of a record joined by straight lines, or loosen rtol"
        )


def _sample(signal: Signal, duration: float, rtol: float, load: int) -> tuple[float, Array]:
    """Nodes of a plain callable: double a quintic spline's grid until it agrees to ``rtol`` between its nodes."""
    from scipy.interpolate import make_interp_spline

    cells = 64
    while cells <= _MOST_NODES:
        t = np.linspace(0.0, duration, cells + 1)
        values = _values(signal, t, load)
        spline = make_interp_spline(t, values, k=5)
        # thirds rather than midpoints, so that no period of the signal hides between the samples
        places = np.arange(max(cells, _FEWEST_PLACES))
        between = (places + np.where(places % 2, 1 / 3, 0.58)) * (duration / len(places))
        errors = np.abs(spline(between) - _values(signal, between, load))
        error, allowed = errors.max(), rtol * np.abs(values).max()
        if error <= allowed:
            return duration / cells, np.stack([values, spline(t, 1), spline(t, 2)], axis=1)
        if cells >= _FEWEST_PLACES:
            _refuse_jumps(signal, t, values, rtol, load)
            if error * cells > allowed * _MOST_NODES:  # too much at a kink for all nodes there may be
                _refuse_kinks(signal, between[errors.argmax()], t[1], error, duration, load)
        cells *= 2
    raise ValueError(
        f"the signal of load {load} is too rough to sample to {rtol:g}; give it tones() or nodes(), or loosen rtol"
    )
