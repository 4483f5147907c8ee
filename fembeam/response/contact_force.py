"""Force of a stop or element along a run: of its law, with the entry rates and the latched numbers of the time.

A law with memory is replayed: from one border it passed to the next its latched numbers stay, at a border they are
renewed from δ and δ̇ there, as the run has logged them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contacts.path import renew
from fembeam.response.friction import FREE, friction_force, on_rows

if TYPE_CHECKING:
    from fembeam.response.histories import Histories
    from fembeam.scene.contact_rows import ContactRow

Vector = NDArray[np.float64]


def forces(run: Histories) -> Vector:
    """Forces (r, k) of all stops and elements of a run at its samples on their rows of coordinates, N or N m."""
    found: list[Vector] = []
    for stop, contact in enumerate(run.readout.model.contact_rows):
        force = _force_of(run, stop, contact)
        if contact.friction is not None:
            found += on_rows(run, stop, force, friction_force(run, stop, force))
            continue
        found += [-force * along for along in run._outward(stop).T] if contact.is_circle else [force]
    return np.array(found).reshape(len(found), len(run.t))


def _force_of(run: Histories, stop: int, contact: ContactRow) -> Vector:
    """Force (k,) of one stop or element at the samples."""
    if contact.always or contact.remembers:
        return force_at(run, stop, contact, run.t, run._deformation(stop), run._deformation_rate(stop))
    mine = run.contacts.stop == stop
    entered, speed = run.contacts.t_in[mine], run.contacts.speed_in[mine]
    if not len(entered):
        return np.zeros(len(run.t))
    order = np.argsort(entered)
    last = np.searchsorted(entered[order], run.t, side="right") - 1
    entry_rate = np.maximum(np.abs(speed[order])[np.maximum(last, 0)], contact.law.entry_rate_floor)
    delta = np.where(last >= 0, run._deformation(stop), -1.0)
    return np.asarray(contact.force(delta, run._deformation_rate(stop), entry_rate))


def force_at(run: Histories, stop: int, contact: ContactRow, t: Vector, delta: Vector, rate: Vector) -> Vector:
    """Force of one that always acts at times t (k,), ascending, of deformations and rates there.

    With a memory it is that between the borders passed, each with the latched numbers of its time.
    """
    if not contact.remembers:
        return np.asarray(contact.force(delta, rate))
    law, log = contact.law, run.transitions
    parameters = _parameters_at_start(run, stop, law)
    mine = np.flatnonzero(log.contact == stop)
    ends = np.append(np.searchsorted(t, log.t[mine]), len(t))
    force, first = np.empty(len(t)), 0
    for passed, end in enumerate(ends):
        if end > first:
            force[first:end] = law.batch(1.0, parameters)(delta[first:end], rate[first:end])
        if passed < len(mine):
            at = mine[passed]
            renew(law, int(log.border[at]), log.delta[at], log.delta_dot[at], parameters)
        first = max(first, end)
    return force


def latched_before(run: Histories, time: float) -> tuple[Vector, ...]:
    """What each law has latched before a time of the run; empty without laws with memory."""
    rows, found = run.readout.model.contact_rows, []
    for stop, contact in enumerate(rows) if any(row.latched for row in rows) else ():
        law: Any = contact.law
        parameters = _parameters_at_start(run, stop, law)
        log = run.transitions
        if contact.friction is not None:  # undrawn: what it has latched lies in the whole run
            found.append(np.array([FREE, 0.0]))
            continue
        for at in np.flatnonzero((log.contact == stop) & (log.t < time)):
            renew(law, int(log.border[at]), log.delta[at], log.delta_dot[at], parameters)
        found.append(parameters[list(getattr(law, "memory", ()))])
    return tuple(found)


def _parameters_at_start(run: Histories, stop: int, law: Any) -> Vector:
    """The law's parameters with what it had latched when the run began."""
    parameters = np.array(law.parameters)
    if run.memory_at_start:
        parameters[list(getattr(law, "memory", ()))] = run.memory_at_start[stop]
    return parameters
