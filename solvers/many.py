"""Many starts of one system at once: checked, shared out among threads, collected in arrays.

The results of a start do not depend on the other starts, on their order, or on the threads.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import pairwise
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.integration import BLOCK_STEPS, prepared_once
from solvers.problem import Array, SolverError, Status, System, counted
from solvers.problem.matrices import number, reals
from solvers.problem.run_arguments import output_times

if TYPE_CHECKING:
    from solvers.exponential.many_starts import Worker
    from solvers.exponential.method import Engine

_GROUP = 64  # starts a thread takes at once, at most
_LOOK = 0.1  # s between two looks at the threads


@dataclass(frozen=True, eq=False)
class ManySolutions:
    """Ends of k runs of one system with m stops.

    Attributes
    ----------
    q, q_dot : (k, n) coordinates and rates at the end; NaN for a start that was not finished after Ctrl-C.
    t : (k,) time reached, s. status : (k,) `Status` of each run.
    contacts : (k,) how many there were, those under way at the end included.
    peak_indentation, peak_force : (k, m) largest of each stop, m and N; 0 where it was not touched, and of contacts
        that always act, which have no peaks.
    seconds : wall time of all of them.
    """

    q: Array
    q_dot: Array
    t: Array
    status: Any
    contacts: Any
    peak_indentation: Array
    peak_force: Array
    seconds: float

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        found = {status: int(np.sum(self.status == status)) for status in Status}
        states = ", ".join(f"{number} {status.value}" for status, number in found.items() if number)
        return f"<{counted(len(self), 'run')}, {counted(int(self.contacts.sum()), 'contact')}: {states}>"


def integrate_many(
    system: System,
    q0: ArrayLike,
    q_dot0: ArrayLike,
    duration: float,
    method: Any = None,
    threads: int = 1,
    progress: Callable[[int], None] | None = None,
    *,
    gaps: ArrayLike | None = None,
    factors: ArrayLike | None = None,
    check: bool = True,
) -> ManySolutions:
    """Integrate a system from many starts in one compiled loop; each ends as `integrate` ends it, bit for bit.

    Runs may differ in their gaps and in the amplitudes and phases of tones too, at no cost beside their own steps: the
    tables of the method do not depend on these. Other parameters need a system, and a call, for each value.

    Parameters
    ----------
    system : the problem; see `integrate`.
    q0, q_dot0 : (k, n) initial coordinates and rates, a start in each row; not changed.
    duration : s, > 0, of every run.
    method : `Exponential`, the only one that offers this; None takes ``Exponential(rtol=1e-8)``.
    threads : how many work at the same time, each without Python's lock; results do not depend on it.
    progress : called with the number of starts finished now and then.
    gaps : (k, m) of every stop in each run, m (rad about an axis), in place of those of the system.
    factors : (k, p) what multiplies the signal of each load in each run; a complex one, r e^{iφ}, turns tones by φ
        besides, counted at positive frequency: on a tone of negative ω it acts as its conjugate. Loads that are
        sampled, or at resonance with an undamped mode, take 1 only. The numbers are those of `integrate` with such
        signals to rounding.
    check : raise when a run fails; False returns all of them, with their status.

    Returns
    -------
    ManySolutions. After Ctrl-C the starts not finished have NaN and `Status.INTERRUPTED`.

    Raises
    ------
    ValueError and TypeError for bad input, before computing; SolverError (with ``.solution``, all the runs) when one
    fails, with its index.

    Examples
    --------
    >>> system = System.modal(omega=[2.0], zeta=[0.0])
    >>> ends = integrate_many(system, [[1.0], [0.5]], [[0.0], [0.0]], duration=np.pi)
    >>> ends
    <2 runs, 0 contacts: 2 finished>
    >>> bool(np.abs(ends.q[:, 0] - [1.0, 0.5]).max() < 1e-7)
    True
    """
    from solvers.exponential.many_starts import CONTACTS, REACHED, Outcomes, Worker, final_statuses, whole_starts
    from solvers.exponential.method import Exponential

    method = Exponential() if method is None else method
    if not isinstance(method, Exponential):
        raise TypeError(f"integrate_many offers Exponential only, got {method!r}; call integrate for each start")
    starts = _starts(system, q0, q_dot0)
    duration = number(duration, "duration")
    output_times(duration, None)
    _check_threads(threads)
    own_gaps, scaled = _gaps(system, gaps, len(starts)), _factors(system, factors, len(starts))
    started, again = time.perf_counter(), True
    while again:
        prepared = prepared_once(system, method, duration)
        engines = [method.engine(system, starts[0], prepared, duration) for _ in range(min(threads, len(starts)))]
        for engine in engines:
            engine.sample(None)  # an earlier run may have left room for its outputs
        outcomes = Outcomes.of(len(starts), engines[0].back.shape[1], len(system.contacts))
        of_blocks = whole_starts(engines[0], starts, _of_tones(scaled, engines[0]))
        workers = [Worker(engine, of_blocks, own_gaps, outcomes, BLOCK_STEPS) for engine in engines]
        _to_the_end(workers, len(starts), progress)
        status = final_statuses(engines[0], outcomes, own_gaps)
        whole = not np.any(status == Status.INTERRUPTED)
        again = bool(whole and np.any(status == Status.STEP_TOO_SMALL)) and engines[0].shorten()
        for engine in engines:
            engine.release()
    motion, n = _products(engines[0].back, outcomes.x), system.size
    t, contacts = outcomes.number[:, REACHED], outcomes.count[:, CONTACTS]
    peaks = outcomes.peak[..., 0], outcomes.peak[..., 1]
    found = ManySolutions(motion[:, :n], motion[:, n:], t, status, contacts, *peaks, time.perf_counter() - started)
    if check:
        _check_status(found, duration)
    return found


def _starts(system: System, q0: ArrayLike, q_dot0: ArrayLike) -> Array:
    """Checked starts (k, 2n), in the coordinates of the blocks."""
    n, parts = system.size, [reals(q0, "q0"), reals(q_dot0, "q_dot0")]
    for name, part in zip(("q0", "q_dot0"), parts, strict=True):
        if part.ndim != 2 or part.shape[1] != n or not len(part):
            raise ValueError(f"{name} must have shape (k, {n}), a start in each of k > 0 rows, got {part.shape}")
        _check_finite(name, part, "at start {}, coordinate {}")
    if len(parts[0]) != len(parts[1]):
        raise ValueError(f"q0 and q_dot0 must have as many rows, got {len(parts[0])} and {len(parts[1])}")
    return _products(system.blocks.inverse, np.hstack(parts))


def _rows(name: str, values: ArrayLike, count: int, width: int, each: str, kind: type = float) -> Any:
    """Checked array (k, width)."""
    rows: Any = np.array(values, dtype=kind, order="C")
    if rows.shape != (count, width):
        raise ValueError(f"{name} must have shape {(count, width)}, {each} in the row of each run, got {rows.shape}")
    _check_finite(name, rows, "in run {}, column {}")
    return rows


def _check_finite(name: str, rows: Array, where: str) -> None:
    """ValueError that says where the first number that is not finite stands."""
    bad = np.argwhere(~np.isfinite(rows))
    if bad.size:
        raise ValueError(f"{name} must be finite, got {rows[tuple(bad[0])]} {where.format(*bad[0])}")


def _gaps(system: System, gaps: ArrayLike | None, count: int) -> Array:
    """(k, m) gaps of each run; no rows if all have those of the system."""
    if gaps is None:
        return np.empty((0, 0))
    rows: Array = _rows("gaps", gaps, count, len(system.contacts), "that of each contact")
    circles = np.array([contact.map == "annulus" for contact in system.contacts], dtype=bool)
    bad = np.argwhere((rows <= 0.0) & circles)
    if bad.size:
        which = f"contact {bad[0, 1]} in run {bad[0, 0]}"
        raise ValueError(f"gaps: the clearance of an annulus must be positive, got {rows[tuple(bad[0])]} for {which}")
    return rows


def _factors(system: System, factors: ArrayLike | None, count: int) -> Any:
    """(k, p) complex factors of the loads, None without."""
    if factors is None:
        return None
    return _rows("factors", factors, count, len(system.loads), "that of each load", complex)


def _of_tones(factors: Any, engine: Engine) -> Any:
    """(k, tones) complex factors of the tones; ValueError for loads that are not made of tones alone."""
    if factors is None:
        return None
    for load in np.unique(engine.problem.table_load):
        bad = np.flatnonzero(factors[:, load] != 1.0)
        if bad.size:
            given = f"got {factors[bad[0], load]} in run {bad[0]}"
            raise ValueError(
                f"factors: load {load} is sampled or at resonance, so its factor must be 1, {given}; "
                "scale its signal and call once for each amplitude"
            )
    return factors[:, engine.prepared.tone_load]


def _products(matrix: Array, rows: Array) -> Array:
    """Matrix · row for each row, every one a product of its own: one of all of them at once rounds otherwise."""
    return np.ascontiguousarray(np.matmul(matrix, rows[:, :, None])[:, :, 0])


def _check_threads(threads: int) -> None:
    """A count of threads."""
    if not isinstance(threads, (int, np.integer)) or isinstance(threads, bool) or threads < 1:
        raise ValueError(f"threads must be a whole number above 0, got {threads!r}")


def _check_status(found: ManySolutions, duration: float) -> None:
    """Raise for the first run that failed."""
    failed = [i for i, status in enumerate(found.status) if status not in (Status.DONE, Status.INTERRUPTED)]
    if failed:
        first = failed[0]
        others = f" ({len(failed)} of {len(found)} starts failed)" if len(failed) > 1 else ""
        where = f"start {first} stopped at t = {found.t[first]:.9g} s of {duration:g} s"
        raise SolverError(f"{where}: {found.status[first].value}{others}", found)


def _to_the_end(workers: list[Worker], count: int, progress: Callable[[int], None] | None) -> None:
    """Let the workers share the starts; after Ctrl-C they stop where they are."""
    groups, stop, done = iter(_shared_out(count, len(workers))), Event(), [0] * len(workers)
    tell = (lambda: progress(sum(done))) if progress else (lambda: None)
    tasks = [_groups(worker, groups, stop, done, i) for i, worker in enumerate(workers)]
    try:
        if len(tasks) == 1:
            for _ in tasks[0]:
                tell()
        else:
            _in_threads(tasks, stop, tell)
    except KeyboardInterrupt:
        pass
    tell()


def _shared_out(count: int, threads: int) -> list[tuple[int, int]]:
    """First start of each group and the one after its last; they get shorter, so that all threads end together."""
    places = [0]
    while places[-1] < count:
        places.append(places[-1] + min(_GROUP, math.ceil((count - places[-1]) / (2 * threads))))
    return list(pairwise(places))


def _groups(worker: Worker, groups: Iterator[tuple[int, int]], stop: Event, done: list[int], i: int) -> Iterator[None]:
    """The work of one thread, with a look at the world outside in between."""
    for first, beyond in groups:
        worker.assign(first, beyond)
        while not worker.march():
            if stop.is_set():
                return
            yield
        done[i] += beyond - first
        if stop.is_set():
            return
        yield


def _in_threads(tasks: list[Iterator[None]], stop: Event, tell: Callable[[], None]) -> None:
    """Each in a thread of its own, until all are done or this one is interrupted."""
    with ThreadPoolExecutor(len(tasks)) as pool:
        futures: list[Future[int]] = [pool.submit(sum, (0 for _ in task)) for task in tasks]
        try:
            left = set(futures)
            while left:
                left = wait(left, _LOOK).not_done
                tell()
        except BaseException:
            stop.set()
            raise
    for future in futures:
        future.result()
