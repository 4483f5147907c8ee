"""The entry point `integrate`: check the input, run a method's loop in short blocks of steps, collect the result.

Blocks are short so that Ctrl-C and progress are served; the state between them is complete, so an interrupted run keeps
everything computed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from solvers.compiled.sliding import slider_force
from solvers.compiled.state import EVENTS, LOG_FULL, LOGGED, RUNNING, SAMPLED, STATUSES, State, T, event_row, slider_row
from solvers.exponential.energy.check import cancelling, unbalanced
from solvers.problem import (
    Array,
    Forcing,
    Parameter,
    Record,
    Solution,
    SolverError,
    Status,
    System,
    forcing_of,
    product,
)
from solvers.problem import event_list as at
from solvers.problem.friction import ACCOUNTS, BEGUN, CODE, STICK, most_friction, tell_sliders
from solvers.problem.matrices import number
from solvers.problem.run_arguments import (
    check_laws,
    check_maps,
    check_places,
    check_tangent,
    checked_start,
    latched_at_start,
    output_times,
)
from solvers.problem.signals import sampled_values, sampling_tolerance
from solvers.problem.whole_runs import must_be_whole, whole_runs

_SAMPLES = 64  # of a run that is made again for its balance
BLOCK_STEPS = 20_000  # steps in a block: between two checks for signals and calls of `progress`
_IDLE, _MOST_IDLE = 1e-6, 50  # of shortened steps: part of the duration a block must pass; blocks in turn that may not
_MOST_KEPT = 1 << 22  # bytes of sampled signals that are kept for other runs: of longer ones the run takes the time
_NOTHING = np.empty(0)  # latched by a law without memory


class Engine(Protocol):
    """One run of a method: what a new method offers.

    Its ``engine(system, z, prepared, duration)`` makes one, with z the start in the coordinates that it steps in.
    """

    watched: ClassVar[bool]  # whether ``march`` watches the energy itself, and returns a code where it grows
    duration: float
    method: Any
    problem: Any
    back: Any  # (2n, ·): [q, q̇] from the coordinates that are stepped

    @property
    def state(self) -> State:
        """What has been reached, and the outputs."""

    def sample(self, times: Array | None) -> None:
        """Make room for outputs at times; None if the end alone is kept."""

    def record(self, **arrays: Array) -> None:
        """Replace arrays of the state that outputs go to: ``log``, ``event_record``."""

    def start(self) -> None:
        """What is to be done once before the first step."""

    def march(self, budget: int) -> int:
        """Advance by about so many steps; the place in `STATUSES` of what ended it."""

    def keeps_ledger(self, sampled: bool) -> bool:
        """Whether input and damping of the energy balance are known."""

    def has_gained(self, exchanged: Callable[[], Array]) -> bool:
        """Whether the finished run holds more energy than it can have been given."""

    def shorten(self) -> bool:
        """Let the next run of the system take shorter steps; whether the method can."""

    def explain(self, status: Status) -> str:
        """What the method can say about a failure."""

    def release(self) -> None:
        """Leave working arrays to other runs; the state must not be read any more."""


def integrate(
    system: System,
    q0: ArrayLike,
    q_dot0: ArrayLike,
    duration: float,
    dt: float | ArrayLike | None = None,
    method: Any = None,
    tangent: bool | Parameter = False,
    *,
    progress: Callable[[float], None] | None = None,
    check: bool = True,
    memory: Sequence[ArrayLike | None] | None = None,
) -> Solution:
    """Integrate M q̈ + C q̇ + K q = Σ v_l s_l(t) + Σ w_s F_s from (q0, q_dot0) at t = 0 over ``duration``.

    Parameters
    ----------
    system : the problem.
    q0, q_dot0 : (n,) initial coordinates and rates; not changed.
    duration : s, > 0.
    dt : output sampling, s, or the output times themselves, increasing, within [0, duration]: a contact can so be
        sampled as finely as needed. None keeps the final state and the contact log only.
    method : `Exponential`, `DormandPrince`, `HenonRK2`, `RK4`, `CentralDifference`, `Newmark` or `GeneralizedAlpha`;
        None takes ``Exponential(rtol=1e-8)``.
    tangent : True adds the derivative of the final [q, q̇] with respect to [q0, q_dot0], (2n, 2n), to the solution; a
        `Parameter` adds one more column, with respect to that parameter at fixed duration. `Exponential` only. Of laws
        like δ^{3/2} it may err by some hundred rtol in units of the largest motion: slopes are less smooth than forces.
    progress : called with the simulated time now and then.
    check : raise when the run fails; False returns the partial solution with its status instead.
    memory : what the laws have latched at the start, one entry per contact as `Solution.memory` has it, None for what
        a law begins with; by it a run goes on from another one's end. It does not hold the rate at which a contact
        under way was entered: laws that depend on it take that at the start; end the first run where they are open.

    Returns
    -------
    Solution. After Ctrl-C it is partial, with `Status.INTERRUPTED`.

    Raises
    ------
    ValueError and TypeError for bad input, before computing; SolverError (with ``.solution``) when the method fails.

    Examples
    --------
    >>> system = System.modal(omega=[2.0], zeta=[0.0])
    >>> end = integrate(system, [1.0], [0.0], duration=np.pi)
    >>> bool(abs(end.q[-1, 0] - 1.0) < 1e-7)
    True
    """
    method = _chosen(method)
    duration = number(duration, "duration")
    arguments = system, q0, q_dot0, duration, dt, method, tangent, memory
    run = prepared_run(*arguments)
    started = time.perf_counter()
    status = run.to_the_end(progress)
    while status is Status.STEP_TOO_SMALL and run.engine.shorten():
        run.engine.release()
        run = prepared_run(*arguments)
        status = run.to_the_end(progress)
    solution = run.solution(status, time.perf_counter() - started)
    status = solution.status
    if isinstance(tangent, Parameter) and status is Status.DONE and not run.tangent.exact:
        behind, ahead = (_end(s, q0, q_dot0, duration, method, memory) for s in (tangent.behind, tangent.ahead))
        column, known = (ahead - behind) / (2.0 * tangent.step), cast(Array, solution.tangent)
        solution = replace(solution, tangent=np.column_stack((known, column)))
    if check and status not in (Status.DONE, Status.INTERRUPTED):
        words = status.value + run.engine.explain(status)
        if status is Status.UNBALANCED:
            words = cancelling(system, np.hstack((solution.q, solution.q_dot))) or words
        if status is Status.OVERDRAWN:
            words = f"{_overdrawn(solution.record)}: {words}"
        raise SolverError(f"stopped at t = {run.time:.9g} s of {duration:g} s: {words}", solution)
    run.engine.release()
    return solution


def _chosen(method: Any) -> Any:
    """The method, the default one instead of None, checked."""
    if method is None:
        from solvers.exponential.method import Exponential

        return Exponential()
    if not hasattr(method, "engine") or isinstance(method, type):
        raise TypeError(f"method must be one of solvers, made with its settings, such as Exponential(), got {method!r}")
    return method


def prepared_run(
    system: System,
    q0: ArrayLike,
    q_dot0: ArrayLike,
    duration: float,
    dt: Any,
    method: Any,
    tangent: Any,
    memory: Sequence[ArrayLike | None] | None = None,
) -> _Run:
    """A run ready to start, everything checked."""
    method = _chosen(method)
    duration = number(duration, "duration")
    check_tangent(tangent, method, system)
    z = checked_start(system, q0, q_dot0, method)
    check_places(system, q0)
    times = output_times(duration, dt)
    prepared = prepared_once(system, method, duration)
    latched = latched_at_start(system, memory)
    engine: Engine = method.engine(system, z, prepared, duration)
    for s, numbers in latched:
        engine.problem.parameters[s, system.contacts[s].memory] = numbers
    return _Run(system, engine, times, tangent)


def prepared_once(system: System, method: Any, duration: float) -> tuple[Forcing, Any]:
    """What a method prepares for all starts, the system checked; kept as long as no signal can have changed."""
    key = "prepared", method, duration, len(system.kept.find("shortened") or ())
    known: tuple[Forcing, Any] | None = system.kept.find(key)
    if known is None:
        check_maps(system, method)
        check_laws(system)
        fixed = all(_is_fixed(signal) for _, signal in system.loads)
        forcing = _forcing(system, duration, sampling_tolerance(method.rtol), fixed)
        known = method.prepared(system, forcing, duration)
        if fixed and forcing.table.nbytes <= _MOST_KEPT:
            system.kept.store(key, known)
    return known


def _forcing(system: System, duration: float, rtol: float, fixed: bool) -> Forcing:
    """Arrays of all signals; if these are ``fixed`` and made of tones, the same for every duration."""
    kept: Forcing | None = system.kept.find("tones")
    if kept is None:
        kept = forcing_of([signal for _, signal in system.loads], duration, rtol)
        if fixed and not kept.table_dt.size:
            kept = system.kept.store("tones", kept)
    return kept


def _is_fixed(signal: Any) -> bool:
    """Whether a signal cannot change: a frozen dataclass, whose arrays are read-only."""
    options = getattr(type(signal), "__dataclass_params__", None)
    names = {*getattr(signal, "__dict__", ()), *getattr(type(signal), "__dataclass_fields__", ())}  # the last of slots
    held = (getattr(signal, name, None) for name in names)
    arrays = [value for value in held if isinstance(value, np.ndarray)]
    return options is not None and options.frozen and not any(array.flags.writeable for array in arrays)


def loads_taken(system: System, duration: float, t: Array, method: Any = None) -> dict[int, Array]:
    """Values (k,) at times (k,) of the sampled loads, by number, as a run by a method takes them: right to its rtol.

    Where a load is much larger than what it leaves, as that of a support's displacement on a stiff shape that follows
    it, the motion goes by these and not by the signal itself.
    """
    method = _chosen(method)
    return sampled_values(prepared_once(system, method, duration)[0], t)


class _Run:
    """One run: a method's engine, its output, and the loop over blocks of steps."""

    def __init__(self, system: System, engine: Engine, times: Array | None, tangent: Any) -> None:
        self.system, self.engine, self.times = system, engine, times
        engine.sample(times)
        self.tangent: Any = None
        self.parameter: Any = tangent if isinstance(tangent, Parameter) else None
        if tangent:
            from solvers.exponential.tangent import Tangent

            self.tangent = Tangent(system, engine, self.parameter)
        state = self.state
        self.size = 2 * engine.problem.k.size
        self.initial, self.latched = state.x[: self.size].copy(), self.memory
        if state.due[0] == 0.0:
            state.out[0] = state.x
            state.count[SAMPLED] = 1

    @property
    def state(self) -> State:
        """What has been reached, and the outputs."""
        return self.engine.state

    def _derivatives(self) -> dict[str, Array]:
        """Derivatives of the end, with and without what is latched."""
        matrix, n2 = self.tangent.matrix(), 2 * self.system.size
        own = matrix.shape[1] - n2 - self.tangent.exact
        more = {"tangent": np.delete(matrix, np.s_[n2 : n2 + own], axis=1), "rate": self.tangent.rate()}
        if not own:
            return more
        latched = np.vstack((matrix, self.tangent.latched_matrix()))
        turned = np.empty((len(self.latched), 0))
        if self.tangent.exact:
            surfaces = [
                [one.surface for one in side.contacts] for side in (self.parameter.behind, self.parameter.ahead)
            ]
            turned = self.time * np.diff(surfaces, axis=0).T / (2.0 * self.parameter.step)
        tell_sliders(latched, self.system.contacts, self.latched, self.memory, turned)
        return {**more, "memory_tangent": latched}

    @property
    def memory(self) -> tuple[Array, ...]:
        """What the laws have latched by now, one array per contact."""
        if not self.system.latches:
            return (_NOTHING,) * len(self.system.contacts)
        rows = zip(self.system.contacts, self.engine.problem.parameters, strict=True)
        found = tuple(row[contact.memory] for contact, row in rows)
        for contact, latched in zip(self.system.contacts, found, strict=True):
            if contact.friction is not None:
                # A slider is told as of a run that begins now; one that slips has no place.
                latched[1] = latched[1] - contact.surface * self.time if latched[0] == STICK else 0.0
        return found

    @property
    def time(self) -> float:
        """Simulated time reached."""
        return float(self.state.now[T])

    def to_the_end(self, progress: Callable[[float], None] | None) -> Status:
        """Block after block until done, failed or interrupted."""
        code, passed, idle = RUNNING, 0.0, 0
        try:
            self.engine.start()
            while code in (RUNNING, LOG_FULL):
                if code == LOG_FULL:
                    self.engine.record(log=np.concatenate((self.state.log, np.empty_like(self.state.log))))
                code = self.engine.march(BLOCK_STEPS)
                if code == RUNNING and self.system.kept.find("shortened"):
                    idle = idle + 1 if self.time - passed < _IDLE * self.engine.duration else 0
                    if idle > _MOST_IDLE:
                        return Status.STALLED
                    passed = self.time
                if self.tangent:
                    self.tangent.follow()
                if progress:
                    progress(self.time)
        except KeyboardInterrupt:
            if must_be_whole():
                raise
            return Status.INTERRUPTED
        x = self.state.x
        finite = math.isfinite(sum(x.tolist())) or np.isfinite(x).all()  # a sum may overflow
        return STATUSES[code] if finite or STATUSES[code] is not Status.DONE else Status.DIVERGED

    def solution(self, status: Status, seconds: float) -> Solution:
        """Collect outputs, log and energy balance."""
        engine, state, size, sampled = self.engine, self.engine.state, self.size, self.times is not None
        last, work = state.x.copy(), (*state.count[: EVENTS + 1].tolist(), seconds)
        if self.times is None:
            t, motion, accounts = state.now[T : T + 1].copy(), engine.back.dot(last[:size])[None], last[None, size:]
        else:
            x = state.out[: self._sampled(status)]
            t, motion = self.times[: len(x)].copy(), product(x[:, :size], engine.back.T)
            accounts = x[:, size:].copy()  # so that all the samples can be let go
        record = Record(
            self.system, engine.back, self.initial, self.latched, last, self.memory, t, motion, accounts,
            self._rows(), engine.keeps_ledger(sampled), self._rubbed(), work,
        )  # fmt: skip
        if status is Status.DONE:
            status = self._checked(record)
        known = self.tangent is not None and status is Status.DONE
        return Solution(record, status, **self._derivatives()) if known else Solution(record, status)

    def _checked(self, record: Record) -> Status:
        """Whether what was reached can be right: the energy balances, and friction stayed within what is known."""
        if not self._balances(record):
            return Status.UNBALANCED
        return Status.OVERDRAWN if record.rubbed is not None and _overdrawn(record) else Status.DONE

    def _rubbed(self) -> Array | None:
        """(m, 3) loss by friction and work of the spin, J, and way of the slider, m; None without friction."""
        contacts, problem, state = self.system.contacts, self.engine.problem, self.state
        if not len(problem.friction):
            return None
        found = np.zeros((len(contacts), 3))
        for s in np.flatnonzero(problem.friction[:, 0]).tolist():
            law: Any = contacts[s].law
            work, impulse, way = state.x[problem.friction[s, 1] :][:ACCOUNTS]
            begun, stored, drawn = self._held(s)
            found[s] = work - (stored - begun), law.arm * law.spin * impulse, way - drawn
        return found

    def _held(self, s: int) -> tuple[float, float, float]:
        """Energy in the spring of a slider as the run began and now, J, and how far it is drawn now if in slip, m."""
        problem, state = self.engine.problem, self.state
        law: Any = self.system.contacts[s].law
        own, k_t = problem.parameters[s, law.place :], law.friction.stiffness
        force = slider_force(problem, s, state.segment[s], state.entry_rate[s], state.now[T], state.x)
        slips = state.segment[s] > 0 and abs(own[CODE]) == 1.0
        return 0.5 * own[BEGUN] ** 2 / k_t, 0.5 * force**2 / k_t, abs(force) / k_t if slips else 0.0

    def _balances(self, record: Record) -> bool:
        """Whether the energy balance closes, where it is kept and has not been watched along."""
        if self.engine.watched:
            return True
        if record.complete and len(record.motion):
            return not unbalanced(record, self.engine.method.rtol)
        return not self.engine.has_gained(record.exchanged) or self._balances_sampled()

    def _balances_sampled(self) -> bool:
        """Whether a run that exceeds the bound of its energy balances when it is made again with samples."""
        method, duration = replace(self.engine.method, ledger=True), self.engine.duration
        q, q_dot = np.split(self.engine.back @ self.initial, 2)
        memory = self.latched if self.system.latches else None
        with whole_runs():
            again = integrate(self.system, q, q_dot, duration, duration / _SAMPLES, method, check=False, memory=memory)
        return again.status is Status.DONE

    def _sampled(self, status: Status) -> int:
        """Samples written; the last one may lie a rounding beyond the end."""
        written = int(self.state.count[SAMPLED])
        out = self.state.out
        if status is Status.DONE and written == len(out) - 1:
            out[-1] = self.state.x
            return len(out)
        return written

    def _rows(self) -> Array:
        """The event list; contacts under way end last, at no time."""
        state = self.engine.state
        logged, segments = state.log[: state.count[LOGGED]].copy(), state.segment.tolist()
        if len(self.engine.problem.friction):
            self._count_held(logged)
        if not any(segments):
            return logged
        under_way = [s for s, segment in enumerate(segments) if segment > 0]
        rows = np.empty((len(under_way), at.CODE + 1))
        for s, row in zip(under_way, rows, strict=True):
            event_row(self.engine.problem, state, s, math.nan, at.KNOT, math.nan, math.nan, row)
        rubbing = [s for s in under_way if self.system.contacts[s].friction is not None]
        more = np.empty((len(rubbing), at.CODE + 1))
        for s, row in zip(rubbing, more, strict=True):
            slider_row(self.engine.problem, state, s, self.time, row)
            row[[at.TIME, at.CLIPPED]] = math.nan, 0.0
            row[[at.WORK, at.FORCE]] -= self._held(s)[1:]
        return np.concatenate((logged, rows, more))

    def _count_held(self, logged: Array) -> None:
        """Count what springs of sliders held as the run began as brought into the contacts under way then."""
        begun = (logged[:, at.GUARD] == at.FRICTION) & (logged[:, at.CLIPPED] == 1.0) & (logged[:, at.TIME] == 0.0)
        for i in np.flatnonzero(begun).tolist():
            logged[i, at.WORK] -= self._held(int(logged[i, at.ELEMENT]))[0]
            logged[i, at.FORCE] = 0.0  # the slider's way, which began with what its spring was drawn


def _overdrawn(record: Record) -> str:
    """Where F_t has come to k_t π c in a circle of radius c, as ξ and ξ - s are known up to whole turns; else empty."""
    rows = record.rows[record.rows[:, at.GUARD] == at.FRICTION]
    for s, contact in enumerate(record.system.contacts):
        if contact.friction is not None and contact.circle:
            most = most_friction(contact, abs(contact.circle))
            largest = rows[rows[:, at.ELEMENT] == s, at.LARGEST].max(initial=0.0)
            if largest > most:
                return f"friction of contact {s} came to {largest:.4g} N, of {most:.4g} N at most"
    return ""


def _end(system: System, q0: ArrayLike, q_dot0: ArrayLike, duration: float, method: Any, memory: Any) -> Array:
    """Final [q, q̇] of a plain run."""
    with whole_runs():
        return integrate(system, q0, q_dot0, duration, method=method, memory=memory).end[: 2 * system.size]
