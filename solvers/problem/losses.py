"""What contacts have taken for good: the work done on each less what its law would give back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from solvers.problem.frames import dataframe, named
from solvers.problem.matrices import Array
from solvers.problem.renewals import renew
from solvers.problem.result import Transitions, counted
from solvers.problem.system import Contact

if TYPE_CHECKING:
    from solvers.problem.record import Record


@dataclass(frozen=True, eq=False)
class Losses:
    """What contacts have taken in a run, one array entry each.

    Attributes
    ----------
    work : (m,) J done on each. stored : (m,) J that its law holds more at the end than at the start; NaN where a law
        cannot tell.
    slip : (m,) m (rad of rotation), distance that δ went while sliders slipped, summed over the sliders of a law; of a
        user's law in its segment "slip" if it has that and one "stick".
    history : (k, m) J, work done on each up to the samples. impulses : (k, m) N s (N m s), of each force likewise;
        None of a run read from a file. names : what each is called.
    friction : (m,) J lost by friction under the contact's force, ∫F_t ξ̇ dt less the change of F_t²/2k_t. spin : (m,) J,
        work of its prescribed spin.

    Notes
    -----
    For a stop that is open at both ends of the run ``loss`` is the sum of its contacts' ``energy_loss``. Laws without
    memory store the integral of their force at rest.
    """

    work: Array
    stored: Array
    slip: Array
    history: Array
    impulses: Array | None = None
    names: tuple[str, ...] = field(default=(), kw_only=True)
    friction: Any = field(default=0.0, kw_only=True)
    spin: Any = field(default=0.0, kw_only=True)

    def __len__(self) -> int:
        return len(self.work)

    def __repr__(self) -> str:
        return f"<losses of {counted(len(self), 'contact')}: {self.loss.sum():.6g} J>"

    @property
    def loss(self) -> Array:
        """(m,) J taken for good: work less what is stored, and what friction took."""
        return self.impact + self.friction

    @property
    def impact(self) -> Array:
        """(m,) J taken for good by the laws alone."""
        return self.work - self.stored

    def arrays(self) -> dict[str, Array]:
        """The columns with one entry per contact, by name; friction and the work of spins of runs with friction."""
        columns = {"work": self.work, "stored": self.stored, "loss": self.loss, "slip": self.slip}
        return columns | ({"friction": self.friction, "spin": self.spin} if np.ndim(self.friction) else {})

    def to_dataframe(self) -> Any:
        """A table of pandas, one contact a row, in SI units; ImportError where pandas is missing."""
        return dataframe({"name": named(self.names, np.arange(len(self)))} | self.arrays())

    @classmethod
    def of_run(cls, record: Record) -> Losses:
        """From what a run leaves."""
        contacts, size, works, passed = record.system.contacts, record.begin.size, record.works, record.transitions()
        deltas = [_indentations(contacts, record.back.dot(x[:size])) for x in (record.begin, record.last)]
        memories = _renewed_at_once(contacts, record.latched, passed), record.memory
        first, last = (_stored(contacts, *one) for one in zip(deltas, memories, strict=True))
        slip = _slipped(contacts, record.latched, passed, *deltas)
        more: dict[str, Any] = {"names": tuple(contact.name for contact in contacts)}
        if record.rubbed is not None:
            more |= {"friction": record.rubbed[:, 0], "spin": record.rubbed[:, 1]}
            slip = slip + record.rubbed[:, 2]
        work = record.last[size + 2 : size + 2 + 2 * len(contacts) : 2]
        return cls(work, last - first, slip, works[:, 2::2], works[:, 3::2], **more)

    def part(self, kept: slice) -> Losses:
        """Of some of the samples: their work and impulses; what was stored and slip are not known there."""
        history = self.history[kept] - self.history[kept][:1]
        impulses = None if self.impulses is None else self.impulses[kept] - self.impulses[kept][:1]
        unknown = np.full(len(self), math.nan)
        work = history[-1] if len(history) else unknown
        return Losses(work, unknown, unknown, history, impulses, names=self.names)


def _renewed_at_once(contacts: Sequence[Contact], memory: Sequence[Array], passed: Transitions) -> list[Array]:
    """What is latched after the borders passed at t = 0, as where a force begins beyond its limit: no work is done."""
    found = [np.array(latched) for latched in memory]
    for row in np.flatnonzero(passed.t == 0.0).tolist():
        number = int(passed.contact[row])
        if contacts[number].friction is not None:  # its slider is no part of the law
            continue
        law, places = contacts[number].law, contacts[number].memory
        parameters = np.array(law.parameters, dtype=float)
        parameters[places] = found[number]
        renew(law, parameters, int(passed.border[row]), float(passed.delta[row]), float(passed.delta_dot[row]))
        found[number] = parameters[places]
    return found


def _indentations(contacts: Sequence[Contact], motion: Array) -> Array:
    """δ (m,) of each contact in a state [q, q̇]."""
    q = motion[: motion.size // 2]
    return np.array([float(contact.indentation(q)) for contact in contacts])


def _stored(contacts: Sequence[Contact], deltas: Array, memory: Sequence[Array]) -> Array:
    """(m,) J stored by each law."""
    return np.array([_stored_by(*one) for one in zip(contacts, deltas.tolist(), memory, strict=True)])


def _stored_by(contact: Contact, delta: float, latched: Array) -> float:
    """J stored by one law; NaN where it cannot tell."""
    law: Any = contact.law
    if delta <= 0.0 and not contact.always:
        return 0.0
    if delta < 0.0 and getattr(law, "one_sided", True) and not contact.memory:  # of a law for stops that acts both ways
        return float(law.work_at_rest(delta)) if hasattr(law, "work_at_rest") else math.nan
    if not hasattr(law, "stored"):
        return math.nan
    row = np.array(law.parameters, dtype=float)
    row[contact.memory] = latched
    return float(law.stored(delta, row))


def _slipped(
    contacts: Sequence[Contact], memory: Sequence[Array], passed: Transitions, begin: Array, end: Array
) -> Array:
    """(m,) way of δ while sliders slipped, of those also that slip at the start or at the end of the run."""
    path = np.zeros(len(begin))
    for number, (contact, latched) in enumerate(zip(contacts, memory, strict=True)):
        mine = passed.contact == number
        for borders, place, slip in _sliders(contact.law) if contact.friction is None else ():
            since = float(begin[number]) if abs(latched[place]) == slip else math.nan
            way = 0.0
            for row in np.flatnonzero(mine & np.isin(passed.border, borders)).tolist():
                delta = float(passed.delta[row])
                way += 0.0 if math.isnan(since) else abs(delta - since)
                since = delta if passed.event[row] == "slip" else math.nan
            path[number] += way + (0.0 if math.isnan(since) else abs(float(end[number]) - since))
    return path


def _sliders(law: Any) -> list[tuple[list[int], int, int]]:
    """Of all that sticks and slips in a law: borders, the place of its code in what is latched, the code in slip."""
    found, border, place = [], 0, 0
    for part in getattr(law, "acting", (law,)):
        events = getattr(part, "events", ())
        coded = [i for i, codes in enumerate(getattr(part, "segment_codes", ())) if codes]
        for j, i in enumerate(coded if {"stick", "slip"} <= {*events} else ()):
            each = part.borders // len(coded)
            own = list(range(border + j * each, border + (j + 1) * each))
            found.append((own, place + i, events.index("slip")))
        border, place = border + getattr(part, "borders", 0), place + len(getattr(part, "memory", ()))
    return found
