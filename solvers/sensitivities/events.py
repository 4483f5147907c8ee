"""Derivatives across an event: entry, exit, knot, or border of a law with memory.

    dt* = -db/ḃ,   Y ← Y - b ΔF dt*,   d(entry rate) = dδ̇ + δ̈ dt*,   dL ← m_L dL + m_δ (dδ + δ̇ dt*) + m_δ̇ (dδ̇ + δ̈ dt*)

with b = δ - knot, or the law's border function. See Leine, Nijmeijer, Dynamics and Bifurcations of Non-Smooth
Mechanical Systems, 2004, chapter 7.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.problem import Array
from solvers.problem import event_list as at
from solvers.sensitivities import laws
from solvers.sensitivities.flow import Flow
from solvers.sensitivities.stretches import Acting, after

GRAZING = 1e-9  # depth δ̇²/2|δ̈| to which an entry would go without force, in units of the motion, below which it grazes
_OFF = 1e-10  # relative distance from a knot at which a law is certainly on one side of it
_BEHIND = 1e-6  # part of what a margin is made of, by which it is negative where another border has left it behind


class NoDerivativeError(ArithmeticError):
    """The motion has no derivative: a contact grazes, or an event is no crossing."""


def cross(flow: Flow, t: float, row: Array, acting: Acting, span: float, last: Array | None) -> tuple[Acting, Array]:
    """Take all derivatives across one event; what acts then, and the change dt* (m,) of its time.

    ``last`` is that of an event at the same time; ``span`` the size of the element's displacement.
    """
    s = int(row[at.ELEMENT])
    following = after(flow.system, acting, row)
    if row[at.GUARD] == at.BEGIN:
        _latch_at_start(flow, t, s)
        return acting, np.zeros(flow.columns)
    memory = row[at.GUARD] >= 0.0
    rate, acceleration = flow.rates(t, s, acting)
    moved, sped = flow.change(t, s)
    entering = row[at.FROM] == 0.0 and row[at.TO] > 0.0
    if memory:
        shift = _at_border(flow, t, row, acting, (moved, sped, rate, acceleration), last)
    else:
        shift = _at_knot(flow, t, row, acting, (moved, rate, acceleration), span)
    jump = _jump(flow, row, acting, following)
    flow.y -= np.outer(flow.push[s], jump * shift)
    flow.impulse[s] -= jump * shift
    if entering:
        floored = abs(row[at.RATE]) < flow.system.contacts[s].law.entry_rate_floor
        flow.entry[s] = 0.0 if floored else np.sign(rate) * (sped + acceleration * shift)
    return following, shift


def _latch_at_start(flow: Flow, t: float, s: int) -> None:
    """A contact under way at the start latches its rate then."""
    rate = flow.motion_of(t, s)[1]
    floor = flow.system.contacts[s].law.entry_rate_floor
    flow.entry[s] = 0.0 if abs(rate) < floor else np.sign(rate) * flow.change(t, s)[1]


def _at_knot(flow: Flow, t: float, row: Array, acting: Acting, motion: tuple[Any, ...], span: float) -> Array:
    """dt* at the surface or a knot."""
    s, (moved, rate, acceleration) = int(row[at.ELEMENT]), motion
    up = row[at.RATE] > 0.0
    border = acting.segment[s] if up else acting.segment[s] - 1
    late = moved.copy()
    late[flow.own] -= flow.by.of_knot(s, border)
    still = rate * rate <= 2.0 * abs(acceleration) * GRAZING * span
    if t == 0.0 and still and not np.any(late[flow.own]):
        return np.zeros(flow.columns)  # at rest on the surface: it begins at once
    if still:
        what = (
            f"contact {s} is entered with {abs(rate):.3g} m/s" if up and not border else f"contact {s} turns on a knot"
        )
        raise NoDerivativeError(f"no derivative: {what} at t = {t:.9g} s, which grazes; change the parameter a little")
    return -late / rate


def _at_border(flow: Flow, t: float, row: Array, acting: Acting, motion: tuple[Any, ...], last: Array | None) -> Array:
    """dt* at a border of a law with memory; what it latches then."""
    s, border, (moved, sped, rate, acceleration) = int(row[at.ELEMENT]), int(row[at.GUARD]), motion
    law: Any = flow.system.contacts[s].law
    place = border, float(row[at.DELTA]), float(row[at.RATE])
    by = laws.margin_slopes(law, acting.rows[s], *place, acting.entry_rate[s])
    known = flow.latched[s]
    late = by[0] * moved + by[1] * sped + by[2:] @ known
    late[flow.own] += flow.over_laws(s, acting, lambda one, own: laws.margin(one, own, *place, acting.entry_rate[s]))
    pace = by[0] * rate + by[1] * acceleration
    size = np.abs(by * np.concatenate((place[1:], acting.rows[s][list(law.memory)]))).sum()
    behind = laws.margin(law, acting.rows[s], *place, acting.entry_rate[s]) < -_BEHIND * size
    if behind and last is not None:
        shift = last
    else:
        shift = -late / pace if pace < 0.0 and t > 0.0 else np.zeros(flow.columns)
    maps = laws.renewal_slopes(law, acting.rows[s], *place, acting.entry_rate[s])
    latched = np.outer(maps[:, 0], moved + rate * shift) + np.outer(maps[:, 1], sped + acceleration * shift)
    latched += maps[:, 2:] @ known
    places = list(law.memory)
    latched[:, flow.own] += flow.over_laws(s, acting, lambda one, own: laws.renewed(one, own, *place)[places])
    flow.latched[s] = latched
    return shift


def _jump(flow: Flow, row: Array, before: Acting, then: Acting) -> float:
    """By how much the force jumps."""
    s = int(row[at.ELEMENT])
    law: Any = flow.system.contacts[s].law
    rate, forces = float(row[at.RATE]), []
    if row[at.GUARD] >= 0.0:
        delta = float(row[at.DELTA])
        forces = [laws.force(law, a.rows[s], (delta, rate), then.entry_rate[s])[0] for a in (before, then)]
        return float(forces[1] - forces[0])
    border = min(before.segment[s], then.segment[s])
    knot = 0.0 if border == 0 else law.knots[border - 1]
    for acting in (before, then):
        place = knot * (1.0 - _OFF) if acting.segment[s] == border else knot * (1.0 + _OFF) + 1e-300
        none = acting.segment[s] == 0
        forces.append(0.0 if none else laws.force(law, acting.rows[s], (place, rate), then.entry_rate[s])[0])
    return float(forces[1] - forces[0])
