"""Friction under the force of a contact along a run: what sticks and slips when, its force, what it takes.

stick: F_t = k_t (ξ - s);    slip: F_t = ±μN;    free: F_t = 0;    s as the run has logged it, between two events

In a circular clearance ξ = c θ + R (φ + Ω t) is known up to whole turns, and ξ - s is far below half of one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from solvers.problem.friction import FREE, STICK

if TYPE_CHECKING:
    from fembeam.response.histories import Histories

Vector = NDArray[np.float64]
TINY = 1e-9  # share of a contact's loss that is spread evenly over it


def sliding(run: Histories, stop: int) -> tuple[Vector, Vector]:
    """ξ and ξ̇ (k,) of a stop with friction at the samples, m and m/s; 0 at the centre of a circle."""
    q, q_dot, rows = run.q, run.q_dot, run.directions[run._rows[stop]]
    if not run.circles[stop, 0]:
        return q @ rows[1], q_dot @ rows[1]
    (x, y), (v, w) = run._in_circle(stop).T, (q_dot @ rows[:2].T).T
    c, arm, spin = abs(run.circles[stop, 0]), run.rubs[stop, 2], run.rubs[stop, 3]
    square = np.where(x**2 + y**2 > 0.0, x**2 + y**2, 1.0)
    turned, turning = (q @ rows[2], q_dot @ rows[2]) if len(rows) > 2 else (0.0, 0.0)
    way = c * np.arctan2(-y, -x) + arm * (turned + spin * run.t)  # from the centre of the circle as integrators count
    return way, c * (x * w - y * v) / square + arm * (turning + spin)


def states(run: Histories, stop: int) -> tuple[Vector, Vector, Vector]:
    """What the slider of a stop did: times (j,) from which on, codes, and s where it sticks (NaN: undrawn)."""
    log, passed, k_t = run.friction_log, run.transitions, run.rubs[stop, 1]
    mine = np.flatnonzero(log.contact == stop)
    mine = mine[np.argsort(log.t_in[mine], kind="stable")]
    events = np.flatnonzero(passed.contact == stop)
    stuck, freed = (passed.event[events] == word for word in ("stick", "free"))
    time, force, way, speed = (column[events] for column in (passed.t, passed.force, passed.delta, passed.delta_dot))
    slider = way - force / k_t
    slips = np.where((force != 0.0) | freed, np.copysign(1.0, force), np.sign(speed))
    codes, places = _begun(run, stop, mine, (time, stuck | freed, slips, slider))
    ended = mine[~np.isnan(log.t_out[mine])]
    over = np.full(len(ended), FREE), np.full(len(ended), np.nan)
    after = np.where(freed, FREE, np.where(stuck, STICK, slips)), np.where(stuck, slider, np.nan)
    times = np.concatenate((log.t_in[mine], time, log.t_out[ended]))
    kinds = np.repeat([0, 1, 2], [len(mine), len(time), len(ended)])
    order = np.lexsort((kinds, times))
    all_codes, all_places = (np.concatenate(parts)[order] for parts in zip((codes, places), after, over, strict=True))
    return times[order], all_codes, all_places


def _begun(run: Histories, stop: int, mine: Any, events: tuple[Vector, ...]) -> tuple[Vector, Vector]:
    """Code and s of each contact as it begins, which the log does not hold.

    Its first transition tells: before "stick" or "free" it slipped, before "slip" it stuck. Without one it slipped
    throughout, or stuck if its slider never moved; one that lasts has the state at the end of the run. A run that began
    in contact began with the memory that it was given.
    """
    log, (time, caught, slips, slider) = run.friction_log, events
    t_in, t_out = log.t_in[mine], log.t_out[mine]
    first, ends = np.searchsorted(time, t_in), np.where(np.isnan(t_out), np.inf, t_out)
    known = first < np.searchsorted(time, ends, side="right")
    at = np.where(known, first, len(time))
    stuck = known & ~np.append(caught, True)[at]
    way, came = np.append(slips, 0.0)[at], np.sign(log.speed_in[mine])  # signs of slip: at the transition, at the entry
    slipped = np.where(way != 0.0, way, np.where(known | (log.slip[mine] > 0.0), came, STICK))
    codes = np.where(stuck, STICK, slipped)
    places = np.where(stuck, np.append(slider, np.nan)[at], np.nan)
    if len(mine) and np.isnan(t_out[-1]) and not known[-1]:
        codes[-1], places[-1] = _at_end(run, stop)
    if len(mine) and t_in[0] == 0.0 and len(run.memory_at_start) > stop and run.memory_at_start[stop][-2] != FREE:
        codes[0], places[0] = run.memory_at_start[stop][-2:]
    return codes, places


def _at_end(run: Histories, stop: int) -> tuple[float, float]:
    """Code and s in which a run has ended; of one whose laws are not known, slip the way of ξ̇ if it has moved."""
    if run.model is None or run.end is None:
        speed = sliding(run, stop)[1][-1:].sum()
        return float(np.sign(speed)), np.nan
    rows, first = run.model.contact_rows, 2 * len(run.model.omega)
    place = first + sum(row.latched for row in rows[:stop])
    code, s = run.end[place : place + rows[stop].latched][-2:].tolist()
    arm, spin = run.rubs[stop, 2:]
    return code, s + arm * spin * run.reached  # of ξ that counts its time from the run's start


def friction_force(run: Histories, stop: int, normal: Vector) -> Vector:
    """F_t (k,) at the samples under a force N (k,), N."""
    times, codes, places = states(run, stop)
    mu, k_t = run.rubs[stop, :2]
    last = np.searchsorted(times, run.t, side="right") - 1
    code = np.where(last >= 0, np.append(codes, FREE)[last], FREE)
    left = sliding(run, stop)[0] - np.append(places, np.nan)[last]
    if turn := 2.0 * np.pi * abs(run.circles[stop, 0]):
        left = left - turn * np.floor(left / turn + 0.5)
    stuck = k_t * np.where(np.isnan(left), 0.0, left)
    limit = mu * np.maximum(normal, 0.0)
    slipping = np.where(code == FREE, 0.0, code * limit)
    return np.asarray(np.where(code == STICK, np.clip(stuck, -limit, limit), slipping))


def on_rows(run: Histories, stop: int, normal: Vector, force: Vector) -> list[Vector]:
    """Forces (k,) on the rows of a stop with friction, from N and F_t."""
    if not run.circles[stop, 0]:
        return [normal, -force]
    (x, y), outward = run._in_circle(stop).T, run._outward(stop).T
    square = np.where(x**2 + y**2 > 0.0, x**2 + y**2, 1.0)
    across = abs(run.circles[stop, 0]) * force / square  # F_t (c/r) e_θ = across (-y, x)
    found = [-normal * outward[0] + across * y, -normal * outward[1] - across * x]
    torque = [-run.rubs[stop, 2] * force] if len(run.directions[run._rows[stop]]) > 2 else []
    return found + torque


def read_back(run: Histories, stop: int) -> Vector:
    """F_t (k,) from the forces on the rows."""
    forces = run._forces[run._rows[stop]]
    if not run.circles[stop, 0]:
        return -forces[1]
    x, y = run._in_circle(stop).T
    return np.asarray((forces[0] * y - forces[1] * x) / abs(run.circles[stop, 0]))


def losses_by_friction(run: Histories) -> Vector:
    """(k, m) J lost by friction up to the samples: of each contact as logged, within it ∫F_t ξ̇ dt - F_t²/2k_t."""
    found = np.zeros((len(run.t), len(run.stops)))
    for stop in np.flatnonzero(run.rubs[:, 1]).tolist():
        found[:, stop] = _lost(run, stop)
    return found


def _lost(run: Histories, stop: int) -> Vector:
    """J (k,) of one stop. The work between its samples shares the loss of a contact among them."""
    log, t = run.friction_log, run.t
    mine = np.flatnonzero(log.contact == stop)
    mine = mine[np.argsort(log.t_in[mine], kind="stable")]
    if not len(mine):
        return np.zeros(len(t))
    t_in, loss = log.t_in[mine], log.energy_loss[mine].copy()
    loss[-1 if np.isnan(log.t_out[mine][-1]) else 0] += run.losses.friction[stop] - loss.sum()  # held by the spring
    t_out = np.where(np.isnan(log.t_out[mine]), run.reached, log.t_out[mine])
    force = read_back(run, stop)
    power = force * sliding(run, stop)[1]
    done = np.append(0.0, np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(t)))
    least = TINY * max(float(np.abs(power).max(initial=0.0)), 1e-300)  # shared by time where no sample tells
    grown = np.maximum.accumulate(done - force**2 / (2.0 * run.rubs[stop, 1])) + least * (t - t[0])

    def share(times: Vector) -> Any:
        return np.interp(times, t, grown) + least * np.maximum(times - t[-1], 0.0)

    before, last = np.append(0.0, np.cumsum(loss)), np.searchsorted(t_in, t, side="right") - 1
    begun, ended = share(t_in), share(t_out)
    part = np.clip((grown - begun[last]) / np.maximum(ended - begun, 1e-300)[last], 0.0, 1.0)
    part = np.where(t >= t_out[last], 1.0, part)
    return np.asarray(np.where(last >= 0, before[last] + part * loss[last], 0.0))
