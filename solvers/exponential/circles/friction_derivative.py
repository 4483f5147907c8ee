"""Derivative of a run through contacts with friction; see `linearised`.

At fixed time the forces on the rows change by their slopes, `friction.row_slopes`, and at fixed motion by

    dF_t = -k_t ds in stick,  ±μ dN in slip,   dN by the latched entry rate.

s is latched at entry, ds = dξ + ξ̇ dt*, and where slip ends, at s = ξ - F_t/k_t,

    ds = dξ - dF_t/k_t + (ξ̇ - Ḟ_t/k_t) dt*.

There ṡ = ξ̇ - Ḟ_t/k_t falls to zero, so that it does not matter when, unless it jumps with Ṅ, at a knot or an event of
another element, whose dt* it is. F_t is continuous at all borders. A parameter adds what the forces change by at fixed
motion, a difference of the two laws ahead and behind.
"""

from __future__ import annotations

from solvers.compiled.friction import friction_force
from solvers.compiled.kernels import (
    acceleration_of,
    contact_forces,
    copy,
    dot,
    force_at,
    indentation_and_rate,
    indentation_rate,
    inlined,
    inner,
    place_of,
    radius_of,
    rhs,
    row_of,
    slide_of,
    slider_of,
)
from solvers.compiled.sliding import begin_slider, end_slider, normal_force, renew_slider, slopes_of
from solvers.compiled.state import LAST_EVENT, T
from solvers.exponential.circles.derivative import change_of, explicit_change, is_parameter, row_change
from solvers.exponential.circles.friction import (
    WAYS,
    count_of,
    row_slopes,
    rubbing_forces,
    share_of,
    slide_at_nodes,
    spring_of,
    ways_of,
)
from solvers.exponential.contact.nodes import S
from solvers.problem.friction import CODE, FREE, SLIDER, STIFFNESS

_OF_SLIDER = 1  # place of s among what is latched


@inlined
def _place(problem, s):
    """Where ds of element s stands among the derivatives of what is latched."""
    return s * problem.latched.shape[1] + _OF_SLIDER


@inner
def way_change(problem, variation, derivatives, x, c, s, t):
    """Change of ξ in the state x at fixed time, in column c."""
    first, size, change, y = row_of(problem, s), 2 * problem.k.size, 0.0, derivatives.y[c]
    u = dot(problem.read[first], x, size) - problem.gap[first]
    w = dot(problem.read[first + 1], x, size) - problem.gap[first + 1]
    for a in range(count_of(problem, s)):
        change += ways_of(problem, s, u, w, a)[1] * row_change(problem, variation, derivatives, y, c, first + a, 0, t)
    return change


@inner
def _keep_together(problem, ahead, behind, variation, s):
    """The laws ahead and behind have latched the same."""
    if variation.law_step > 0.0:
        own, one, other = slider_of(problem, s), slider_of(ahead, s), slider_of(behind, s)
        one[CODE], one[SLIDER] = own[CODE], own[SLIDER]
        other[CODE], other[SLIDER] = own[CODE], own[SLIDER]


@inner
def latch_begin(problem, ahead, behind, past, derivatives, variation, s):
    """What the slider of a contact has latched as it began; its time has changed by ``derivatives.shift``."""
    t, place, own, explicit = past.now[T], _place(problem, s), slider_of(problem, s), 0.0
    speed = slide_of(problem, s, t, past.x)[1]
    if variation.law_step > 0.0:
        explicit = slide_of(ahead, s, t, past.x)[0] - slide_of(behind, s, t, past.x)[0]
        explicit /= 2.0 * variation.law_step
    for c in range(derivatives.y.shape[0]):
        found = way_change(problem, variation, derivatives, past.x, c, s, t) + speed * derivatives.shift[c, s]
        found += explicit if is_parameter(variation, derivatives, c) else 0.0
        derivatives.latched[c, place] = found if own[CODE] == 0.0 else 0.0
    _keep_together(problem, ahead, behind, variation, s)


@inner
def begin_rubbing(problem, ahead, behind, past, derivatives, variation, s):
    """A contact begins."""
    begin_slider(problem, s, past.now[T], past.x, past.entry_rate[s], False)
    latch_begin(problem, ahead, behind, past, derivatives, variation, s)


@inner
def end_rubbing(problem, ahead, behind, derivatives, variation, s):
    """A contact ends, and with it its slider."""
    end_slider(problem, s)
    for c in range(derivatives.y.shape[0]):
        derivatives.latched[c, _place(problem, s)] = 0.0
    _keep_together(problem, ahead, behind, variation, s)


@inner
def _place_of_slider(problem, s, entry_rate, segment, t, x):
    """ξ - F_t/k_t."""
    own, way = slider_of(problem, s), slide_of(problem, s, t, x)[0]
    normal = normal_force(problem, s, segment, entry_rate, *indentation_and_rate(problem, s, x))
    return way - friction_force(radius_of(problem, s), own, way, normal) / own[STIFFNESS]


@inner
def _by_law(problem, ahead, behind, past, variation, s):
    """Changes of N and of ξ - F_t/k_t at fixed motion per unit of a parameter of the laws."""
    if variation.law_step == 0.0:
        return 0.0, 0.0
    entry, segment, t, x, width = past.entry_rate[s], past.segment[s], past.now[T], past.x, 2.0 * variation.law_step
    place = _place_of_slider(ahead, s, entry, segment, t, x) - _place_of_slider(behind, s, entry, segment, t, x)
    delta, rate = indentation_and_rate(problem, s, x)
    pressed = normal_force(ahead, s, segment, entry, delta, rate)
    return (pressed - normal_force(behind, s, segment, entry, delta, rate)) / width, place / width


@inner
def pass_slider(problem, ahead, behind, past, derivatives, variation, s, j):
    """Stick, slip or the freedom of a slider ends; where it sticks from then on, s is latched.

    Where slip ends dt* is that of the event which ended it, if one did; where N begins to grow, ds = dξ + ξ̇ dt* with
    dt* = -dN/Ṅ.
    """
    t, own, entry = past.now[T], slider_of(problem, s), past.entry_rate[s]
    rhs(problem, t, past.x, past.segment, past.entry_rate, derivatives.rate[0], derivatives.batch)
    was, share, by_law = own[CODE], share_of(own) / own[STIFFNESS], _by_law(problem, ahead, behind, past, variation, s)
    delta, rate = indentation_and_rate(problem, s, past.x)
    acceleration = acceleration_of(problem, s, past.x, derivatives.rate[0])
    normal_force(problem, s, past.segment[s], entry, delta, rate)
    by_delta, by_rate, by_entry = slopes_of(problem, s, entry)
    growing, speed = by_delta * rate + by_rate * acceleration, slide_of(problem, s, t, past.x)[1]
    out = derivatives.batch[5:8]
    renew_slider(problem, s, j, entry, past.segment[s], t, past.x, derivatives.rate[0], out)
    for c in range(derivatives.y.shape[0]):
        pressed = by_delta * change_of(problem, variation, derivatives, past.x, c, s, 0, t)
        pressed += by_rate * change_of(problem, variation, derivatives, past.x, c, s, 1, t)
        pressed += by_entry * derivatives.entry[c, s]
        found = way_change(problem, variation, derivatives, past.x, c, s, t) - share * pressed
        if is_parameter(variation, derivatives, c):
            pressed, found = pressed + by_law[0], found + by_law[1]
        if was == FREE:
            found -= speed * pressed / growing if growing != 0.0 else 0.0
        elif past.now[LAST_EVENT] == t:
            found += (speed - share * growing) * derivatives.shift[c, problem.law.size]
        derivatives.latched[c, _place(problem, s)] = found if own[CODE] == 0.0 else 0.0
    _keep_together(problem, ahead, behind, variation, s)


@inner
def keep_ways(problem, scratch, s):
    """∂δ/∂y and ∂ξ/∂y of the rows at the nodes, before the motion there gives way to its changes."""
    first = row_of(problem, s)
    for i in range(S):
        u, w = scratch.motion[first, 0, i], scratch.motion[first + 1, 0, i]
        for a in range(count_of(problem, s)):
            press, rub = ways_of(problem, s, u, w, a)
            scratch.row_ways[6 * s + 2 * a, i], scratch.row_ways[6 * s + 2 * a + 1, i] = press, rub


@inner
def _forces_of_side(side, past, scratch, s, place, normals, drags):
    """N and F_t at the nodes of a step by the laws of one side of the parameter, for the motion found."""
    motion, slid, own, radius = scratch.motion[place], scratch.slid[s], slider_of(side, s), radius_of(side, s)
    copy(motion[0], scratch.clipped, S)
    contact_forces(side, s, scratch.clipped, motion[1], past.entry_rate[s], normals)
    slide_at_nodes(side, scratch, s)
    for i in range(S):
        drags[i] = friction_force(radius, own, slid[WAYS, i], normals[i])


@inner
def rubbing_by_parameter(problem, ahead, behind, tables, past, scratch, derivatives, variation, s):
    """Forces at the nodes of a step; what N and F_t change by at fixed motion per unit of the parameter.

    The changes stand in ``derivatives.by_rows`` at the first two rows of the element.
    """
    rubbing_forces(problem, tables, past, scratch, s)
    keep_ways(problem, scratch, s)
    if variation.law_step == 0.0:
        return
    first, place = row_of(problem, s), place_of(problem, s)
    normals, drags = derivatives.by_rows[first], derivatives.by_rows[first + 1]
    _forces_of_side(behind, past, scratch, s, place, scratch.numbers, scratch.trial)
    _forces_of_side(ahead, past, scratch, s, place, normals, drags)
    for i in range(S):
        normals[i] = (normals[i] - scratch.numbers[i]) / (2.0 * variation.law_step)
        drags[i] = (drags[i] - scratch.trial[i]) / (2.0 * variation.law_step)
    slide_at_nodes(problem, scratch, s)


@inner
def rubbing_residual(problem, tables, scratch, derivatives, variation, node_set, level, begin, c, s, shift, place, at):
    """Right-hand sides for the changes of the forces on the rows at the nodes, in column c, into ``scratch.residual``.

    The motion of the rows without the changes of forces is in ``scratch.motion``; ``at`` is where N stands.
    """
    first, m, own, slopes = row_of(problem, s), count_of(problem, s), slider_of(problem, s), scratch.row_slopes[9 * s :]
    parameter, latched = is_parameter(variation, derivatives, c), derivatives.latched[c, _place(problem, s)]
    for i in range(S):
        t = begin + tables.contact_step[level] * tables.times[node_set, i]
        along = derivatives.entry[c, s] * scratch.slope[s, 2, i]
        aside = share_of(own) * along - spring_of(own) * latched
        if parameter and variation.law_step > 0.0:
            along, aside = along + derivatives.by_rows[first, i], aside + derivatives.by_rows[first + 1, i]
        for a in range(m):
            press, rub = scratch.row_ways[6 * s + 2 * a, i], scratch.row_ways[6 * s + 2 * a + 1, i]
            change = press * along + rub * aside
            for b in range(m):
                for d in range(2):
                    value = scratch.motion[first + b, d, i]
                    if shift != 0.0:
                        value += shift * derivatives.response[first + b, d, i]
                    if parameter:
                        value += explicit_change(variation, first + b, d, t)
                    change += slopes[a * m + b, d, i] * value
            scratch.residual[place + a * S + i] = change


@inner
def _forces_at(problem, s, entry_rate, t, w, delta, rate, batch):
    """N and F_t in a state of a landing."""
    normal = force_at(problem, s, delta, rate, entry_rate, batch)
    return normal, friction_force(radius_of(problem, s), slider_of(problem, s), slide_of(problem, s, t, w)[0], normal)


@inner
def add_rubbing_change(problem, ahead, behind, derivatives, variation, s, entry_rate, w, t, delta, factor, out):
    """Add to the rates of all columns what the changes of the forces of an element do in the state w of a landing.

    The slopes of the law are in ``derivatives.batch[2:5]``.
    """
    first, m, size, batch = row_of(problem, s), count_of(problem, s), 2 * problem.k.size, derivatives.batch
    by_delta, by_rate, by_entry, rate = batch[2], batch[3], batch[4], indentation_rate(problem, s, w)
    motion, slopes, own = derivatives.at_rows, derivatives.turned, slider_of(problem, s)
    pressed, rubbed = 0.0, 0.0
    if variation.law_step > 0.0:
        pressed, rubbed = _forces_at(ahead, s, entry_rate, t, w, delta, rate, batch[5:8])
        press, rub = _forces_at(behind, s, entry_rate, t, w, delta, rate, batch[5:8])
        pressed, rubbed = (pressed - press) / (2.0 * variation.law_step), (rubbed - rub) / (2.0 * variation.law_step)
    normal, tangential = _forces_at(problem, s, entry_rate, t, w, delta, rate, batch[5:8])
    for a in range(m):
        motion[a, 0, 0] = dot(problem.read[first + a], w, size) - problem.gap[first + a]
        motion[a, 1, 0] = dot(problem.read_rate[first + a], w, size)
    row_slopes(problem, s, motion, 0, rate, normal, tangential, by_delta, by_rate, slopes)
    for c in range(derivatives.y.shape[0]):
        y, latched = derivatives.trial[c], derivatives.latched[c, _place(problem, s)]
        along = by_entry * derivatives.entry[c, s]
        aside = share_of(own) * along - spring_of(own) * latched
        if is_parameter(variation, derivatives, c):
            along, aside = along + pressed, aside + rubbed
        for a in range(m):
            press, rub = ways_of(problem, s, motion[0, 0, 0], motion[1, 0, 0], a)
            change = press * along + rub * aside
            for b in range(m):
                for d in range(2):
                    moved = row_change(problem, variation, derivatives, y, c, first + b, d, t)
                    change += slopes[a * m + b, d, 0] * moved
            for e in range(size):
                out[c, e] += factor * change * problem.push[first + a, e]
