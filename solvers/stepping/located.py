"""Events of a step, located on its dense output: borders crossed, peaks, bends of laws, samples."""

from __future__ import annotations

import numpy as np

from solvers.compiled.friction import friction_force
from solvers.compiled.kernels import (
    copy,
    dot,
    force_at,
    indentation,
    indentation_rate,
    inner,
    kernel,
    merged,
    off_knots,
    radius_of,
    rubs,
    slider_of,
    surface_tolerance,
)
from solvers.compiled.renewals import most_rows
from solvers.compiled.sliding import DELTA, RATE, XI, normal_force
from solvers.compiled.state import (
    AT_ONCE,
    CALLS,
    CHATTER,
    DIVERGED,
    DONE,
    LAW_NOT_FINITE,
    LOG_FULL,
    LOGGED,
    MOST_EVENTS_AT_ONCE,
    PEAK_DELTA,
    PEAK_FORCE,
    RUNNING,
    SAMPLED,
    STEPS,
    T_END,
    T,
    acting_segment,
    begins_and_ends,
    move_clock,
    switch,
    switch_on_surface,
)
from solvers.problem.friction import PEAK
from solvers.stepping.borders import border_distance, renew_crossed
from solvers.stepping.events import (
    IGNORED,
    LOCATED,
    MOST_LANDINGS,
    NONE,
    delta_at,
    golden_section,
    motion_of,
    nearer,
    point_at,
    rate_at,
)
from solvers.stepping.shared import shared

SWITCHED = -1  # besides the status codes: an event has changed the right-hand side

_PEAK_NODES = np.linspace(0.0, 1.0, 9)
_KINK_NODES = np.array([0.0, 1 / 16, 1 / 4, 1 / 2, 3 / 4, 7 / 8, 31 / 32, 127 / 128, 511 / 512, 1.0])
NEAR_END = 1e-6  # share of a step: a kink this near to an end counts as reached


@inner
def _peaks(problem, state, space, h):
    """Largest indentation and force of the step just accepted, for every stop in contact."""
    for s in range(problem.law.size):
        if acting_segment(problem, state, s) == 0 or not begins_and_ends(problem, s):
            continue
        motion_of(problem, s, state.x, space.dense, space.coefficients)
        for column in (PEAK_DELTA, PEAK_FORCE):
            known = (problem, state, s, column, space.coefficients, space.work[0])
            best, a, b = _largest_node(_peak_value, known)
            if best > 0.9 * state.active[s, column]:
                best = max(best, golden_section(_peak_value, known, a, b)[1])
                state.active[s, column] = max(state.active[s, column], best)
        if rubs(problem, s):
            _peak_of_friction(problem, state, space, h, s)


@merged
def _largest_node(value, known):
    """(largest ``value(known, θ)`` at some θ of the step, and the θ before and after)."""
    best, place = -np.inf, 0
    for i in range(_PEAK_NODES.size):
        found = value(known, _PEAK_NODES[i])
        if found > best:
            best, place = found, i
    return best, _PEAK_NODES[max(place - 1, 0)], _PEAK_NODES[min(place + 1, _PEAK_NODES.size - 1)]


@inner
def _peak_of_friction(problem, state, space, h, s):
    """Raise the largest |F_t| by the step just accepted; the coefficients are those of `motion_of`."""
    known, slider = (problem, state, space, h, s), slider_of(problem, s)
    best, a, b = _largest_node(_friction_at, known)
    slider[PEAK] = max(slider[PEAK], best, golden_section(_friction_at, known, a, b)[1])


@inner
def _friction_at(known, theta):
    """|F_t|, N, at θ of the step."""
    problem, state, space, h, s = known
    point_at(problem, s, state.now[T], h, theta, space.coefficients, space.point[0])
    normal = normal_force(
        problem, s, state.segment[s], state.entry_rate[s], space.point[0, DELTA], space.point[0, RATE]
    )
    return abs(friction_force(radius_of(problem, s), slider_of(problem, s), space.point[0, XI], normal))


@inner
def _peak_value(known, theta):
    """Indentation or force of a stop at θ of the step."""
    problem, state, s, column, coefficients, batch = known
    delta = delta_at(coefficients, radius_of(problem, s), theta)
    if column == PEAK_DELTA:
        return delta
    delta = off_knots(problem, s, state.segment[s], delta)
    rate = rate_at(coefficients, radius_of(problem, s), theta)
    return force_at(problem, s, delta, rate, state.entry_rate[s], batch)


@inner
def first_kink(problem, state, space):
    """θ of the first kink inside the step: a law is cut at zero, or a damper of approach begins or ends; else NONE."""
    first = NONE
    for s in range(problem.law.size):
        if state.segment[s] == 0 or space.kinks[s] == 0:
            continue
        motion_of(problem, s, state.x, space.dense, space.coefficients)
        lowest = landing_tolerance(problem, state, s)
        for i in range(1, _KINK_NODES.size):
            a, b = _KINK_NODES[i - 1], _KINK_NODES[i]
            before = _side(problem, state, space, s, a, lowest)
            if before == _side(problem, state, space, s, b, lowest):
                continue
            for _ in range(50):
                middle = 0.5 * (a + b)
                same = _side(problem, state, space, s, middle, lowest) == before
                a, b = (middle, b) if same else (a, middle)
            if b > NEAR_END and b < 1.0 - NEAR_END:
                first = min(first, b)
                break
    return first


@inner
def _side(problem, state, space, s, theta, lowest):
    """Which side of its kinks a law is on at θ of the step: plus 1 cut, plus 2 approaching; no cut near the surface."""
    radius = radius_of(problem, s)
    delta, rate = delta_at(space.coefficients, radius, theta), rate_at(space.coefficients, radius, theta)
    side = 2 if space.kinks[s] & 2 and rate > 0.0 else 0
    if space.kinks[s] & 1 and delta > lowest:
        force = force_at(problem, s, delta, rate, state.entry_rate[s], space.work[0])
        side += 1 if force == 0.0 else 0
    return side


@inner
def _sample(state, space, h):
    """Write the output samples that lie within the step."""
    t, out, due = state.now[T], state.out, state.due
    while due[state.count[SAMPLED]] <= t + h:
        theta = min(max((due[state.count[SAMPLED]] - t) / h, 0.0), 1.0) if h > 0.0 else 0.0
        row, u = out[state.count[SAMPLED]], 1.0 - theta
        for i in range(state.x.size):
            value = 0.0
            for j in range(6, -1, -1):
                value = space.dense[j, i] + (u if j % 2 == 0 else theta) * value
            row[i] = state.x[i] + theta * value
        state.count[SAMPLED] += 1


@kernel
def landing_tolerance(problem, state, stop):
    """Distance from a level, m, that counts as reached."""
    return 4.0 * surface_tolerance(problem, stop, state.x)


@kernel
def _beyond_level(problem, stop, direction, level, x):
    """(distance beyond a level in a direction, m, its rate, m/s) of a state."""
    return direction * (indentation(problem, stop, x) - level), direction * indentation_rate(problem, stop, x)


@shared
def land(step, problem, state, space, move, longest, event):
    """Repeat the step just tried, ``longest``, with the duration that ends on its first event.

    ``event`` is (θ, stop, direction, level, border): it ends on the level, or on the border if that is not -1. Returns
    the duration, s, or if it fails minus the step to try instead.
    """
    theta, stop, direction, level, border = event
    tolerance = landing_tolerance(problem, state, stop)
    h, before, beyond = theta * longest, 0.0, longest
    for _ in range(MOST_LANDINGS):
        error, calls = step(problem, state.now[T], h, move)
        state.count[CALLS] += calls
        distance, slope = _beyond_level(problem, stop, direction, level, space.x_new)
        if border >= 0:
            distance, slope, tolerance = border_distance(problem, state, space, h, stop, border)
        if abs(distance) <= tolerance:
            return _if_accurate(h, error)
        before, beyond = (h, beyond) if distance < 0.0 else (before, h)
        corrected = nearer(h, distance, slope, before, beyond, longest)
        if not corrected > 0.0:  # a graze: off the surface by rounding, or in need of shorter steps
            return _if_accurate(h, error) if abs(distance) <= 100.0 * tolerance else -0.5 * longest
        h = corrected
    return -0.5 * longest


@shared
def _if_accurate(h, error):
    """Duration h of a landing, or minus the step to try: across a bend the shorter step may have the larger error."""
    return h if error <= 1.0 else -max(0.2, 0.9 * error**-0.125) * h if np.isfinite(error) else -0.2 * h


@inner
def _switch_by_sign(problem, state):
    """Move every stop to the segment of its indentation, one border at a time; returns whether any moved."""
    switched = False
    for s in range(problem.law.size):
        delta = indentation(problem, s, state.x)
        if delta > problem.knots[s, state.segment[s]]:
            switch(problem, state, s, 1)
            switched = True
        elif state.segment[s] > 0 and delta <= problem.knots[s, state.segment[s] - 1]:
            switch(problem, state, s, -1)
            switched = True
    return switched


@kernel
def before_step(problem, state, space, events):
    """A status code if the run is over, SWITCHED if a stop switched or a border was renewed, else RUNNING."""
    if state.now[T] >= state.now[T_END]:
        return DONE
    if state.count[LOGGED] + most_rows(problem) > state.log.shape[0]:
        return LOG_FULL
    if state.count[AT_ONCE] > MOST_EVENTS_AT_ONCE:
        return CHATTER
    if events == IGNORED:
        switched = _switch_by_sign(problem, state)
    else:
        switched = switch_on_surface(problem, state, events == LOCATED)
    return SWITCHED if renew_crossed(problem, state, space) or switched else RUNNING


@kernel
def accept(problem, state, space, h, stop, direction, at_end):
    """Accept and record a step, which ends on an event of ``stop`` unless that is -1; returns a status code."""
    if not np.isfinite(dot(space.x_new, space.x_new, space.x_new.size)):
        return LAW_NOT_FINITE if _law_not_finite(problem, state, space, h) else DIVERGED
    _sample(state, space, h)
    _peaks(problem, state, space, h)
    copy(space.x_new, state.x, state.x.size)
    copy(space.rate_new, state.rate, state.x.size)
    move_clock(state.now, h)
    state.now[T] = state.now[T_END] if at_end else state.now[T]
    state.count[STEPS] += 1
    if stop >= 0:
        switch(problem, state, stop, direction)
    return RUNNING


@inner
def _law_not_finite(problem, state, space, h):
    """Whether a law is not finite where an Euler step would take its stop."""
    for s in range(problem.law.size):
        read = problem.read[problem.first[s]]
        delta = indentation(problem, s, state.x) + h * dot(read, state.rate, 2 * problem.k.size)
        if state.segment[s] > 0 and np.isfinite(delta):
            rate = indentation_rate(problem, s, state.x)
            if not np.isfinite(force_at(problem, s, delta, rate, state.entry_rate[s], space.work[0])):
                return True
    return False
