"""What a run returns: states, contact log, energy balance, status, cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from solvers.problem import event_list as at
from solvers.problem.frames import Columns
from solvers.problem.friction import SLIDES
from solvers.problem.matrices import Array

if TYPE_CHECKING:
    from solvers.problem.losses import Losses
    from solvers.problem.record import Record


def counted(count: int, noun: str) -> str:
    """A number with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


class Status(Enum):
    """How a run ended, as the sentence shown to the user. The order is the compiled kernels' code.

    Examples
    --------
    >>> Status.DONE.value, Status.DONE.good, Status.INTERRUPTED.good
    ('finished', True, False)
    """

    DONE = "finished"
    RUNNING = "not finished yet"
    INTERRUPTED = "interrupted: partial result up to the time reached"
    STEP_TOO_SMALL = "the step fell below the resolution of time; the problem may be singular there: loosen rtol"
    DIVERGED = (
        "the state is not finite any more; the method is unstable at this step, or loads overflow: use smaller ones"
    )
    CHATTER = "more events than progress in time; a contact chatters: add damping, or change its law"
    LOG_FULL = "the contact log is full"
    LAW_NOT_FINITE = "a contact law gave a force that is not finite"
    UNBALANCED = "the energy does not balance: the result is wrong; use a smaller rtol, or DormandPrince"
    GAINED = "the motion holds more energy than it was ever given: the method is unstable here"
    OVERDRAWN = (
        "the spring of friction in a circle was drawn by half a turn, beyond which its force is not known; "
        "use a larger stiffness of Friction, or a smaller mu"
    )

    STALLED = (
        "hardly any progress in time: a law may jump where it does not say so, such as with the sign of the rate; "
        "use a law with memory, or Friction"
    )

    @property
    def good(self) -> bool:
        """Whether the result is what was asked for."""
        return self is Status.DONE


class SolverError(RuntimeError):
    """A run that failed; ``solution`` holds what was computed before."""

    def __init__(self, message: str, solution: Any = None) -> None:
        super().__init__(message)
        self.solution = solution


# columns of a log of contacts
(_STOP, _T_IN, _T_OUT, _, _SPEED_OUT, _DEEPEST, _LARGEST, _IMPULSE, _LOSS, _CLIPPED, _, _ANGLE_OUT) = range(12)


@dataclass(frozen=True, eq=False)
class ContactLog(Columns):
    """Contacts in order of their end, one array entry each; a contact still open at the end has t_out = NaN.

    Attributes
    ----------
    stop : index of the stop. name : what it is called. t_in, t_out : s. speed_in, speed_out : m/s, both positive.
    peak_indentation : m. peak_force : N. impulse : N s. energy_loss : J taken out of the beam.
    entry_rate_clipped : whether the entry speed was below the law's floor (also for a contact that began at t = 0);
        every law has one, 1e-3 m/s where none was given, whether or not its force depends on that speed.
    angle_in, angle_out : rad, of the place in its circular clearance, that of a contact still open as at the end; NaN
        of other stops; tables leave them out where no contact has one.
    """

    stop: Any
    t_in: Array
    t_out: Array
    speed_in: Array
    speed_out: Array
    peak_indentation: Array
    peak_force: Array
    impulse: Array
    energy_loss: Array
    entry_rate_clipped: Any
    angle_in: Any = None
    angle_out: Any = None
    names: tuple[str, ...] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        for name in ("angle_in", "angle_out"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.full(len(self.stop), np.nan))

    def named_arrays(self) -> dict[str, Any]:
        """The columns by name, without those of angles where there are none."""
        bare = np.all(np.isnan(self.angle_in)) and np.all(np.isnan(self.angle_out))
        return {k: v for k, v in super().named_arrays().items() if not (bare and k in ("angle_in", "angle_out"))}

    def __repr__(self) -> str:
        open_ones = int(np.isnan(self.t_out).sum())
        return f"<{counted(len(self), 'contact')}, {open_ones} of them not ended>"

    @classmethod
    def of_events(cls, rows: Array, names: Sequence[str] = ()) -> ContactLog:
        """From an event list in which every contact begins and ends, with names of all stops."""
        first, ends = at.paired(at.begins_of(rows), at.ends_of(rows))
        return cls(
            stop=ends[:, at.ELEMENT].astype(int),
            t_in=first[:, at.TIME].copy(),
            t_out=ends[:, at.TIME].copy(),
            speed_in=np.abs(first[:, at.RATE]),
            speed_out=-ends[:, at.RATE],
            peak_indentation=ends[:, at.DEEPEST].copy(),
            peak_force=ends[:, at.LARGEST].copy(),
            impulse=ends[:, at.IMPULSE] - first[:, at.IMPULSE],
            energy_loss=ends[:, at.WORK] - first[:, at.WORK],
            entry_rate_clipped=first[:, at.CLIPPED].astype(bool),
            angle_in=at.angles_of(first),
            angle_out=at.angles_of(ends),
            names=tuple(names),
        )

    @classmethod
    def of_rows(cls, rows: Array, names: Sequence[str] = ()) -> ContactLog:
        """From a table with one contact a row, with names of all stops."""
        columns: list[Any] = [*rows.T.copy()]
        columns[_STOP], columns[_CLIPPED] = columns[_STOP].astype(int), columns[_CLIPPED].astype(bool)
        return cls(*columns, names=tuple(names))

    @classmethod
    def of_period(cls, logs: Sequence[ContactLog], starts: Sequence[float], period: float) -> ContactLog:
        """One log of the runs that make up a period, each of whose times counts from its own start.

        A contact cut by the end of a run is made whole again with its rest in the next run (of the next period).
        """
        rows = [np.array(list(log.arrays().values()), dtype=float).T for log in logs]
        for i, start in enumerate(starts):
            for row in rows[i][np.isnan(rows[i][:, _T_OUT])]:
                rest = rows[(i + 1) % len(rows)]
                later = starts[i + 1] if i + 1 < len(rows) else starts[0] + period
                ends = (rest[:, _STOP] == row[_STOP]) & (rest[:, _T_IN] == 0.0) & ~np.isnan(rest[:, _T_OUT])
                found = np.flatnonzero(ends)
                if found.size:
                    _make_whole(row, rest[found[0]], later - start)
                    rows[i][(rows[i][:, _STOP] == row[_STOP]) & np.isnan(rows[i][:, _T_OUT])] = row
                    rows[(i + 1) % len(rows)] = np.delete(rest, found[0], axis=0)
        for part, start in zip(rows, starts, strict=True):
            part[:, [_T_IN, _T_OUT]] += start
        return cls.of_rows(np.concatenate(rows), logs[0].names)


@dataclass(frozen=True, eq=False)
class FrictionLog(Columns):
    """What friction did in the contacts that have it, in order of their end, one array entry each.

    A contact still open at the end has t_out = NaN, angle_out and speed_out as then. What its spring holds then, or
    held as the run began, is no loss and no slip.

    Attributes
    ----------
    contact : index of the contact. name : what it is called. t_in, t_out : s.
    angle_in, angle_out : rad, of the place in its circular clearance; NaN of an oblique stop.
    speed_in, speed_out : m/s, ξ̇ of the surface. peak_friction : N, the largest |F_t|. impulse : N s, ∫F_t dt.
    slip : m, the path of the slider in slip, while N > 0. energy_loss : J, lost by friction.
    """

    contact: Any
    t_in: Array
    t_out: Array
    angle_in: Array
    angle_out: Array
    speed_in: Array
    speed_out: Array
    peak_friction: Array
    impulse: Array
    slip: Array
    energy_loss: Array
    names: tuple[str, ...] = field(default=(), kw_only=True)

    def __repr__(self) -> str:
        return f"<friction of {counted(len(self), 'contact')}>"

    @classmethod
    def of_events(cls, rows: Array, names: Sequence[str] = ()) -> FrictionLog:
        """From an event list in which every contact begins and ends."""
        rows = rows[rows[:, at.GUARD] == at.FRICTION]
        first, ends = at.paired(rows[rows[:, at.CLIPPED] == 1.0], rows[rows[:, at.CLIPPED] == 0.0])
        both: list[Any] = [
            part for c in (at.TIME, at.DELTA, at.RATE) for part in (first[:, c].copy(), ends[:, c].copy())
        ]
        changes: list[Any] = [ends[:, c] - first[:, c] for c in (at.IMPULSE, at.FORCE, at.WORK)]
        columns: list[Any] = [ends[:, at.ELEMENT].astype(int), *both, ends[:, at.LARGEST].copy(), *changes]
        return cls(*columns, names=tuple(names))


def _make_whole(row: Array, rest: Array, later: float) -> None:
    """Add to a log row the rest of its contact, whose times count from ``later``."""
    row[_T_OUT] = later + rest[_T_OUT]
    row[[_SPEED_OUT, _ANGLE_OUT]] = rest[[_SPEED_OUT, _ANGLE_OUT]]
    row[[_DEEPEST, _LARGEST]] = np.maximum(row[[_DEEPEST, _LARGEST]], rest[[_DEEPEST, _LARGEST]])
    row[[_IMPULSE, _LOSS]] += rest[[_IMPULSE, _LOSS]]


@dataclass(frozen=True, eq=False)
class Transitions(Columns):
    """Borders that laws with memory have passed, in order of time, one array entry each.

    Attributes
    ----------
    contact : index of the contact. name : what it is called. t : s. border : its index among those of the law.
    event : what it was, by the law's names, such as "stick" and "slip"; "free" of friction where its contact pulls.
    delta, delta_dot, force : m, m/s and N as the border was met.
    impulse : N s, and work : J, done by the law's force since the run began, before the border.
    """

    contact: Any
    t: Array
    border: Any
    event: Any
    delta: Array
    delta_dot: Array
    force: Array
    impulse: Array
    work: Array
    names: tuple[str, ...] = field(default=(), kw_only=True)

    def __repr__(self) -> str:
        return f"<{counted(len(self), 'transition')} of laws with memory>"

    @classmethod
    def of_events(cls, rows: Array, contacts: Sequence[Any]) -> Transitions:
        """From the event list."""
        rows = rows[rows[:, at.GUARD] >= 0.0]
        contact, border, code = rows[:, [at.ELEMENT, at.GUARD, at.CODE]].T.astype(int)
        names = [contacts[c].law.events[i] for c, i in zip(contact, code, strict=True)]
        known: list[Any] = [*rows[:, at.DELTA : at.WORK + 1].T.copy()]
        return cls(
            contact,
            rows[:, at.TIME].copy(),
            border,
            np.array(names, dtype=object),
            *known,
            names=tuple(one.name for one in contacts),
        )

    def slid(self) -> Array:
        """(k,) m: path of the slip that each "stick" ends, 0 for other rows."""
        path, slips = np.zeros(len(self)), {}
        for i, key in enumerate(zip(self.contact, self.border, strict=True)):
            if self.event[i] == "slip":
                slips[key] = self.delta[i]
            elif self.event[i] == "stick" and key in slips:
                path[i] = abs(self.delta[i] - slips.pop(key))
            elif self.event[i] == "free":
                slips.pop((self.contact[i], SLIDES), None)
        return path


@dataclass(frozen=True, eq=False)
class Energy:
    """Energy balance at the output times, J: stored - initial = input + spin - damping - contact - friction + residual.

    ``input`` is the work of all loads, ``damping`` what C took, ``contact`` the work done on the stops (in a contact
    it contains what the stop will give back), ``friction`` that done on sliders and their springs, ∫F_t ξ̇ dt, ``spin``
    the work of prescribed spins, ∫F_t R Ω dt, ``residual`` the error.
    """

    input: Array
    damping: Array
    contact: Array
    stored: Array
    initial: float
    friction: Any = 0.0
    spin: Any = 0.0

    def __repr__(self) -> str:
        return f"<energy balance of {counted(len(self.stored), 'sample')}>"

    @property
    def residual(self) -> Array:
        """What the energy balance does not account for."""
        return self.stored - self.initial - self.input + self.damping + self.contact + self.friction - self.spin


@dataclass(frozen=True)
class Cost:
    """Work of a run: accepted steps, rejected ones, law values asked for, switches of stops, wall seconds."""

    steps: int
    rejections: int
    law_calls: int
    events: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Solution:
    """A run.

    Attributes
    ----------
    t : (k,) s. q, q_dot : (k, n) coordinates and rates then; without output samples k = 1, the end.
    contacts : log, energy : energy balance, transitions and losses : what laws with memory met, what each contact took,
        friction : log of what it did; made of ``record`` when first looked at.
    status : how it ended. cost : what it took.
    tangent : (2n, 2n or 2n + 1) derivative of the final [q, q̇], and rate : (2n,) its derivative by time; None unless
        asked for.
    memory : what the laws have latched at the end, one array per contact, empty for laws without memory.
    end : (2n + l,) [q, q̇] at the time reached, which samples need not reach, and the numbers of ``memory`` in a row.
    memory_tangent : (2n + l, 2n + l or 2n + l + 1) derivative of the final [q, q̇, memory] with respect to the same at
        the start, and to a parameter; codes of segments have zeros. None without laws with memory.

    Examples
    --------
    >>> from contacts import Hertz
    >>> from solvers import Contact, System, integrate
    >>> ball = System(M=[[2.0]], C=[[0.0]], K=[[0.0]], contacts=[Contact([1.0], Hertz(1e6))])
    >>> run = integrate(ball, [1e-3], [-0.5], duration=0.1, dt=1e-3)
    >>> run
    <solution to t = 0.1 s, 1 contact: finished>
    >>> float(run.contacts.speed_in[0]), float(run.contacts.impulse[0])
    (0.500000, 2.00000)
    >>> bool(abs(run.energy.residual).max() < 1e-6)
    True
    """

    record: Record = field(repr=False)  # what all but the status and the derivatives is made of
    status: Status
    tangent: Array | None = None
    rate: Array | None = None
    memory_tangent: Array | None = None

    def __repr__(self) -> str:
        reached = f"to t = {self.t[-1]:g} s" if len(self.t) else "without samples"
        return f"<solution {reached}, {counted(len(self.contacts), 'contact')}: {self.status.value}>"

    @property
    def t(self) -> Array:
        """Output times, s, or the end."""
        return self.record.t

    @cached_property
    def q(self) -> Array:
        """Coordinates."""
        return self.record.motion[:, : self.record.system.size]

    @cached_property
    def q_dot(self) -> Array:
        """Rates."""
        return self.record.motion[:, self.record.system.size :]

    @cached_property
    def cost(self) -> Cost:
        """What it took."""
        return self.record.cost()

    @property
    def memory(self) -> tuple[Array, ...]:
        """What the laws have latched at the end."""
        return self.record.memory

    @cached_property
    def end(self) -> Array:
        """[q, q̇] at the time reached, and what is latched then."""
        return self.record.end()

    @cached_property
    def contacts(self) -> ContactLog:
        """The contact log."""
        return self.record.contacts()

    @cached_property
    def transitions(self) -> Transitions:
        """What laws with memory have met: the times of stick, slip and yield."""
        return self.record.transitions()

    @cached_property
    def friction(self) -> FrictionLog:
        """What friction did in each contact that has it."""
        return self.record.friction()

    @cached_property
    def energy(self) -> Energy:
        """The energy balance."""
        return self.record.energy()

    @cached_property
    def losses(self) -> Losses:
        """What each contact has taken: work, loss, path of slip."""
        return self.record.losses()
