"""Derivatives across an event: entry, exit, knot, or border of a law with memory.

    dt* = -db/ḃ,   Y ← Y - b ΔF dt*,   d(entry rate) = dδ̇ + δ̈ dt*,   dL ← m_L dL + m_δ (dδ + δ̇ dt*) + m_δ̇ (dδ̇ + δ̈ dt*)

with the event function b = δ - knot, or the margin of the law's border, and the derivatives m of what is latched. See
Leine, Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.problem import Array, System, renewal_slopes
from solvers.problem import event_list as at
from solvers.problem.friction import CODE, FREE, MU, STIFFNESS
from solvers.sensitivities import laws
from solvers.sensitivities.elements import forces_of
from solvers.sensitivities.flow import Flow
from solvers.sensitivities.stretches import Acting, after, rises

GRAZING = 1e-9  # depth δ̇²/2|δ̈| of an entry without force, in units of the motion, below which it grazes
_OFF = 1e-10  # relative distance from a knot at which a law is evaluated on one side of it
_CORRECTIONS = 3  # by which a nearby law's border, 1e-4 away, is met to rounding
_LEFT_BEHIND = 1e-6  # margin, in units of its terms, below which another event has crossed its border before


class NoDerivativeError(ArithmeticError):
    """The motion has no derivative: a contact grazes, or an event is no crossing."""


def called(system: System, contact: int) -> str:
    """What messages call a contact: its name, or its number."""
    return system.contacts[contact].name or f"contact {contact}"


def cross(flow: Flow, t: float, row: Array, acting: Acting, span: float, last: Array | None) -> tuple[Acting, Array]:
    """Take all derivatives across one event; returns what acts after it, and the change dt* (m,) of its time.

    ``last`` is dt* of another event at the same time, if any; ``span`` the size of the element's displacement.
    """
    s = int(row[at.ELEMENT])
    following = after(flow.system, acting, row)
    if row[at.GUARD] == at.BEGIN:
        return _latch_at_start(flow, t, s, acting), np.zeros(flow.columns)
    if flow.slider(s, acting) is not None and row[at.GUARD] >= 0.0:
        shift = np.zeros(flow.columns) if last is None else last
        _renew_slider(flow, t, row, acting, following, shift)
        flow.y -= np.outer(flow.push[s].T @ _friction_jump(flow, t, s, acting, following), shift)
        return following, shift
    rate, acceleration = flow.rates(t, s, acting)
    d_delta, d_rate = flow.change(t, s)
    entering = row[at.FROM] == 0.0 and row[at.TO] > 0.0
    if row[at.GUARD] >= 0.0:
        shift = _at_border(flow, t, row, acting, (d_delta, d_rate, rate, acceleration), last)
    else:
        shift = _at_knot(flow, t, row, acting, (d_delta, rate, acceleration), span)
    if entering:
        floored = abs(row[at.RATE]) < flow.system.contacts[s].law.entry_rate_floor
        flow.entry[s] = 0.0 if floored else np.sign(rate) * (d_rate + acceleration * shift)
        following = _enter_slider(flow, t, row, following, shift)
    normal, forces = _jump(flow, t, row, acting, following)
    flow.y -= np.outer(flow.push[s].T @ forces, shift)
    flow.impulse[s] -= normal * shift
    return following, shift


def _latch_at_start(flow: Flow, t: float, s: int, acting: Acting) -> Acting:
    """Latch the entry rate of a contact under way at the start, and the place of its slider unless it is given."""
    rate = float(flow.motion_of(t, s).rate[0])
    floor = flow.system.contacts[s].law.entry_rate_floor
    flow.entry[s] = 0.0 if abs(rate) < floor else np.sign(rate) * flow.change(t, s)[1]
    slider = flow.slider(s, acting)
    if slider is None or slider.numbers[CODE] != FREE:
        return acting
    begun = slider.begun(flow.motion_of(t, s), acting.rows[s], acting.entry_rate[s])
    return _latch_slider(flow, t, s, acting.changed(s, rows=begun), np.zeros(flow.columns))


def _enter_slider(flow: Flow, t: float, row: Array, acting: Acting, shift: Array) -> Acting:
    """Begin stick or slip as a contact begins."""
    s = int(row[at.ELEMENT])
    slider = flow.slider(s, acting)
    if slider is None:
        return acting
    begun = slider.entered(flow.motion_of(t, s), acting.rows[s], float(row[at.CODE]))
    return _latch_slider(flow, t, s, acting.changed(s, rows=begun), shift)


def _latch_slider(flow: Flow, t: float, s: int, begun: Acting, shift: Array) -> Acting:
    """Derivative of the place of a slider that sticks as its contact begins, s = ξ."""
    flow.latched[s][:] = 0.0
    if flow.slider(s, begun).sticks:  # type: ignore[union-attr]
        flow.latched[s][1] = flow.xi_change(t, s) + float(flow.motion_of(t, s).xi_rate[0]) * shift
    return begun


def _renew_slider(flow: Flow, t: float, row: Array, acting: Acting, following: Acting, shift: Array) -> None:
    """Derivative of the place of a slider where stick begins, s = ξ - F_t/k_t.

    Where slip ends, the rate of s is zero, so that dt* does not matter, unless Ṅ jumps there, or N up, at a knot or an
    event of another element; then dt* is that of this event. Where N begins to grow from zero, dt* = -dN/Ṅ.
    """
    s, xi = int(row[at.ELEMENT]), float(row[at.DELTA])
    flow.latched[s][:] = 0.0
    slider, before = flow.slider(s, following), flow.slider(s, acting)
    if slider is None or before is None or not slider.sticks:
        return
    if before.free:
        pushing = acting.changed(s, rows=before.uncut(acting.rows[s]))
        push, normal_rate, change = flow.at_instant(t, s, pushing)
        jumped = push > _LEFT_BEHIND * flow.size_of_force(t, s, pushing)
        moved = shift if jumped else -change / normal_rate
        flow.latched[s][1] = flow.xi_change(t, s, xi) + float(flow.motion_of(t, s).xi_rate[0]) * moved
        return
    numbers = slider.numbers
    _, normal_rate, normal_change = flow.at_instant(t, s, acting)
    normal = flow.force(t, s, acting)
    force, friction_by_normal = before.force(np.zeros(1), normal)[0], before.friction_by_normal(normal)[0]
    rate = float(flow.motion_of(t, s).xi_rate[0]) - friction_by_normal / numbers[STIFFNESS] * normal_rate
    flow.latched[s][1] = (
        flow.xi_change(t, s, xi) - friction_by_normal / numbers[STIFFNESS] * normal_change + rate * shift
    )
    if numbers[MU]:
        one = flow.by.elements[s]
        changed = one.mu / numbers[MU] - one.stiffness / numbers[STIFFNESS]
        flow.latched[s][1, flow.own] -= force / numbers[STIFFNESS] * changed


def _friction_jump(flow: Flow, t: float, s: int, acting: Acting, following: Acting) -> Array:
    """Jumps of the forces (m,) on the rows where a slider begins another segment: none, unless N has jumped down."""
    motion, normal = flow.motion_of(t, s), flow.force(np.array([t]), s, acting)
    before, then = (forces_of(motion, flow.slider(s, one), normal)[:, 0] for one in (acting, following))
    return then - before


def knot_shift(flow: Flow, t: float, row: Array, acting: Acting, span: float) -> Array:
    """Change dt* (m,) of the time of a knot."""
    s = int(row[at.ELEMENT])
    return _at_knot(flow, t, row, acting, (flow.change(t, s)[0], *flow.rates(t, s, acting)), span)


def _at_knot(flow: Flow, t: float, row: Array, acting: Acting, motion: tuple[Any, ...], span: float) -> Array:
    """dt* at the surface or a knot; NoDerivativeError if it grazes."""
    s, (d_delta, rate, acceleration) = int(row[at.ELEMENT]), motion
    up = rises(row)
    border = acting.segment[s] if up else acting.segment[s] - 1
    d_border = d_delta.copy()
    d_border[flow.own] -= flow.by.of_knot(s, border)
    grazes = rate * rate <= 2.0 * abs(acceleration) * GRAZING * span
    if t == 0.0 and grazes and not np.any(flow.leaves_at_start(s, border)):
        return np.zeros(flow.columns)  # at rest on the surface: it begins at once
    if grazes:
        what = f"is entered with {abs(rate):.3g} m/s" if up and not border else "turns on a knot"
        where = f"{called(flow.system, s)} {what} at t = {t:.9g} s"
        raise NoDerivativeError(f"no derivative: {where}, which grazes; change the parameter a little")
    return -d_border / rate


def _at_border(flow: Flow, t: float, row: Array, acting: Acting, motion: tuple[Any, ...], last: Array | None) -> Array:
    """dt* at a border of a law with memory, whose renewal also changes the derivatives of what is latched."""
    s, border, (d_delta, d_rate, rate, acceleration) = int(row[at.ELEMENT]), int(row[at.GUARD]), motion
    law, places = flow.system.contacts[s].law, flow.system.contacts[s].memory
    place = border, float(row[at.DELTA]), float(row[at.RATE])
    sizes = np.abs(flow.motion.at(t)) @ np.abs(flow.system.contacts[s].rows[0])
    by = laws.margin_slopes(law, acting.rows[s], *place, acting.entry_rate[s], sizes)
    known = flow.latched[s]
    d_margin = by[0] * d_delta + by[1] * d_rate + by[2:] @ known
    d_margin[flow.own] += flow.over_laws(s, acting, lambda one, own, entry: laws.margin(one, own, *place, entry))
    margin_rate = by[0] * rate + by[1] * acceleration
    size = np.abs(by * np.concatenate((place[1:], acting.rows[s][places]))).sum()
    margin = laws.margin(law, acting.rows[s], *place, acting.entry_rate[s])
    left_behind = margin < -_LEFT_BEHIND * size
    if left_behind and last is not None:
        shift = last
    else:
        shift = -d_margin / margin_rate if margin_rate < 0.0 and t > 0.0 else np.zeros(flow.columns)
    maps = renewal_slopes(law, acting.rows[s], *place, acting.entry_rate[s])
    latched = np.outer(maps[:, 0], d_delta + rate * shift) + np.outer(maps[:, 1], d_rate + acceleration * shift)
    latched += maps[:, 2:] @ known

    def followed(one: Any, own: Array, entry: float) -> Array:
        """Numbers latched by a nearby law where it meets the border itself: they may have a corner there."""
        delta = place[1]
        for _ in range(_CORRECTIONS if by[0] else 0):
            beyond = laws.margin(one, own, border, delta, place[2], entry) - margin
            delta -= beyond / by[0]
        after = laws.renewed(one, own, border, delta, place[2])[places]
        return after - maps[:, 0] * (delta - place[1])

    latched[:, flow.own] += flow.over_laws(s, acting, followed)
    flow.latched[s] = latched
    return shift


def _jump(flow: Flow, t: float, row: Array, before: Acting, then: Acting) -> tuple[float, Array]:
    """Jumps of N and of the forces (m,) on the rows at an event."""
    s, found = int(row[at.ELEMENT]), []
    for acting in (before, then):
        normal, forces = np.zeros(1), np.zeros(len(flow.push[s]))
        if acting.segment[s]:
            normal[0] = _force_beside(flow, row, before, then, acting)
            forces = forces_of(flow.motion_of(t, s), flow.slider(s, acting), normal)[:, 0]
        found.append((normal[0], forces))
    return float(found[1][0] - found[0][0]), found[1][1] - found[0][1]


def _force_beside(flow: Flow, row: Array, before: Acting, then: Acting, acting: Acting) -> float:
    """N just before or after an event."""
    s, rate = int(row[at.ELEMENT]), float(row[at.RATE])
    law: Any = flow.system.contacts[s].law
    if row[at.GUARD] >= 0.0:
        return float(laws.force(law, acting.rows[s], (float(row[at.DELTA]), rate), then.entry_rate[s])[0])
    border = min(before.segment[s], then.segment[s])
    knot = 0.0 if border == 0 else law.knots[border - 1]
    place = knot * (1.0 - _OFF) if acting.segment[s] == border else knot * (1.0 + _OFF) + 1e-300
    return float(laws.force(law, acting.rows[s], (place, rate), then.entry_rate[s])[0])
