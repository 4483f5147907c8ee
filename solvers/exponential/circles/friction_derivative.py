"""Derivative of a run through contacts with friction; see `linearised`.

At fixed time the forces on the rows change by their slopes, `friction.row_slopes`, and at fixed motion by

    dF_t = -k_t ds in stick,  ±μ dN in slip,   dN by the latched entry rate.

s is latched at entry, ds = dξ + ξ̇ dt*, and where slip ends, at s = ξ - F_t/k_t,

    ds = dξ - dF_t/k_t + (ξ̇ - Ḟ_t/k_t) dt*.

There ṡ = ξ̇ - Ḟ_t/k_t falls to zero, so that dt* does not matter, unless ṡ jumps with Ṅ, or N jumps up, at a knot or an
event of another element; then dt* is that of this event. F_t is continuous at all borders, unless N has jumped down on
a knot. A parameter adds the change of the forces at fixed motion, a difference of the two laws ahead and behind.
"""

from __future__ import annotations

from solvers.compiled.friction import friction_force
from solvers.compiled.kernels import (
    acceleration_of,
    add_tangential,
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
    slider_of,
    xi_and_rate_at,
)
from solvers.compiled.sliding import (
    begin_slider,
    begins_beyond_zero,
    end_slider,
    normal_force,
    renew_slider,
    slider_force,
    slopes_of,
)
from solvers.compiled.state import LAST_EVENT, T
from solvers.exponential.circles.derivative import change_of, explicit_change, is_parameter, row_change
from solvers.exponential.circles.friction import (
    NODE_XI,
    count_of,
    friction_by_normal,
    friction_by_xi,
    row_directions,
    row_slopes,
    rubbing_forces,
    xi_and_rate_at_nodes,
)
from solvers.exponential.contact.nodes import S
from solvers.problem.friction import ARM, CODE, FREE, SLIDER, SPIN, STICK, STIFFNESS

_OF_SLIDER = 1  # index of s among the latched numbers of an element


@inlined
def _latched_place(problem, s):
    """Index of ds of element s in ``derivatives.latched``."""
    return s * problem.latched.shape[1] + _OF_SLIDER


@inner
def xi_change(run, x, c, s, t):
    """Change of ξ in the state x at fixed time, in column c."""
    problem, y, change = run.problem, run.derivatives.y[c], 0.0
    first, size = row_of(problem, s), 2 * problem.k.size
    u = dot(problem.read[first], x, size) - problem.gap[first]
    w = dot(problem.read[first + 1], x, size) - problem.gap[first + 1]
    for a in range(count_of(problem, s)):
        change += row_directions(problem, s, u, w, a)[1] * row_change(run, y, c, first + a, 0, t)
    return change


@inner
def _copy_slider(run, s):
    """Copy the slider's code and place to the laws ahead and behind."""
    if run.variation.law_step > 0.0:
        slider, one, other = slider_of(run.problem, s), slider_of(run.ahead, s), slider_of(run.behind, s)
        one[CODE], one[SLIDER] = slider[CODE], slider[SLIDER]
        other[CODE], other[SLIDER] = slider[CODE], slider[SLIDER]


@inner
def latch_begin(run, s):
    """Changes of s as latched at the begin of a contact, whose time changes by ``derivatives.shift``."""
    problem, past, derivatives, variation = run.problem, run.past, run.derivatives, run.variation
    t, place, slider, explicit = past.now[T], _latched_place(problem, s), slider_of(problem, s), 0.0
    xi_rate = xi_and_rate_at(problem, s, t, past.x)[1]
    if variation.law_step > 0.0:
        explicit = xi_and_rate_at(run.ahead, s, t, past.x)[0] - xi_and_rate_at(run.behind, s, t, past.x)[0]
        explicit /= 2.0 * variation.law_step
    for c in range(derivatives.y.shape[0]):
        change = xi_change(run, past.x, c, s, t) + xi_rate * derivatives.shift[c, s]
        change += explicit if is_parameter(run, c) else 0.0
        derivatives.latched[c, place] = change if slider[CODE] == STICK else 0.0
    _copy_slider(run, s)


@inner
def begin_rubbing(run, s):
    """Begin the slider of a contact and the derivative of its place."""
    begin_slider(run.problem, s, run.past.now[T], run.past.x, run.past.entry_rate[s], False)
    latch_begin(run, s)


@inner
def end_rubbing(run, s):
    """End the slider of a contact; the derivative of its place is zero."""
    end_slider(run.problem, s)
    for c in range(run.derivatives.y.shape[0]):
        run.derivatives.latched[c, _latched_place(run.problem, s)] = 0.0
    _copy_slider(run, s)


@inner
def _slider_place(problem, s, entry_rate, segment, t, x):
    """ξ - F_t/k_t, m: the place of a slider that would stick now."""
    slider, xi = slider_of(problem, s), xi_and_rate_at(problem, s, t, x)[0]
    normal = normal_force(problem, s, segment, entry_rate, *indentation_and_rate(problem, s, x))
    return xi - friction_force(radius_of(problem, s), slider, xi, normal) / slider[STIFFNESS]


@inner
def _changes_by_parameter(run, s):
    """Changes of N and of ξ - F_t/k_t at fixed motion per unit of a parameter of the laws."""
    if run.variation.law_step == 0.0:
        return 0.0, 0.0
    past, width = run.past, 2.0 * run.variation.law_step
    entry, segment, t, x = past.entry_rate[s], past.segment[s], past.now[T], past.x
    place = _slider_place(run.ahead, s, entry, segment, t, x) - _slider_place(run.behind, s, entry, segment, t, x)
    delta, rate = indentation_and_rate(run.problem, s, x)
    pressed = normal_force(run.ahead, s, segment, entry, delta, rate)
    return (pressed - normal_force(run.behind, s, segment, entry, delta, rate)) / width, place / width


@inner
def pass_slider(run, s, j):
    """Cross border j of a slider: renew it, and its derivative ds if it sticks from then on.

    Where slip ends, dt* is that of the event which ended it, if one did; where N begins to grow, ds = dξ + ξ̇ dt* with
    dt* = -dN/Ṅ, unless it has jumped there. So has F_t where N has jumped below its limit.
    """
    problem, past, derivatives = run.problem, run.past, run.derivatives
    t, slider, entry = past.now[T], slider_of(problem, s), past.entry_rate[s]
    jumped = begins_beyond_zero(problem, s, entry, past.segment[s], past.x)
    friction_jump = -slider_force(problem, s, past.segment[s], entry, t, past.x)
    rhs(problem, t, past.x, past.segment, past.entry_rate, derivatives.rate[0], derivatives.batch)
    code_before, share = slider[CODE], friction_by_normal(slider) / slider[STIFFNESS]
    by_law = _changes_by_parameter(run, s)
    delta, rate = indentation_and_rate(problem, s, past.x)
    acceleration = acceleration_of(problem, s, past.x, derivatives.rate[0])
    normal_force(problem, s, past.segment[s], entry, delta, rate)
    by_delta, by_rate, by_entry = slopes_of(problem, s, entry)
    normal_rate, xi_rate = by_delta * rate + by_rate * acceleration, xi_and_rate_at(problem, s, t, past.x)[1]
    out = derivatives.batch[5:8]
    renew_slider(problem, s, j, entry, past.segment[s], t, past.x, derivatives.rate[0], out)
    friction_jump += slider_force(problem, s, past.segment[s], entry, t, past.x)
    event = problem.law.size if t > 0.0 else s  # at the start only its own entry may be what it falls with
    for c in range(derivatives.y.shape[0]):
        normal_change = by_delta * change_of(run, past.x, c, s, 0, t)
        normal_change += by_rate * change_of(run, past.x, c, s, 1, t)
        normal_change += by_entry * derivatives.entry[c, s]
        change = xi_change(run, past.x, c, s, t) - share * normal_change
        if is_parameter(run, c):
            normal_change, change = normal_change + by_law[0], change + by_law[1]
        shift = derivatives.shift[c, event] if past.now[LAST_EVENT] == t else 0.0
        if code_before == FREE and not jumped:
            change -= xi_rate * normal_change / normal_rate if normal_rate != 0.0 else 0.0
        else:
            change += (xi_rate - share * normal_rate) * shift
            add_tangential(problem, s, -friction_jump * shift, past.x, derivatives.y[c])
        derivatives.latched[c, _latched_place(problem, s)] = change if slider[CODE] == STICK else 0.0
    _copy_slider(run, s)


@inner
def store_row_directions(run, s):
    """Store ∂δ/∂y and ∂ξ/∂y of the rows at the nodes before ``scratch.motion`` is overwritten by changes."""
    problem, scratch = run.problem, run.scratch
    first = row_of(problem, s)
    for i in range(S):
        u, w = scratch.motion[first, 0, i], scratch.motion[first + 1, 0, i]
        for a in range(count_of(problem, s)):
            by_delta, by_xi = row_directions(problem, s, u, w, a)
            scratch.node_directions[6 * s + 2 * a, i], scratch.node_directions[6 * s + 2 * a + 1, i] = by_delta, by_xi


@inner
def _forces_of_side(side, past, scratch, s, place, normals, frictions):
    """N and F_t at the nodes by the laws of one ``side`` of the parameter, for the motion found."""
    motion, slid, slider, radius = scratch.motion[place], scratch.slid[s], slider_of(side, s), radius_of(side, s)
    copy(motion[0], scratch.clipped, S)
    contact_forces(side, s, scratch.clipped, motion[1], past.entry_rate[s], normals)
    xi_and_rate_at_nodes(side, scratch, s)
    for i in range(S):
        frictions[i] = friction_force(radius, slider, slid[NODE_XI, i], normals[i])


@inner
def rubbing_by_parameter(run, s):
    """Forces at the nodes of a step, and the changes of N and F_t at fixed motion per unit of the parameter.

    The changes go to ``derivatives.by_rows`` at the first two rows of the element.
    """
    problem, past, scratch, derivatives, variation = run.problem, run.past, run.scratch, run.derivatives, run.variation
    rubbing_forces(run.here, s)
    store_row_directions(run.here, s)
    if variation.law_step == 0.0:
        return
    first, place = row_of(problem, s), place_of(problem, s)
    normals, frictions = derivatives.by_rows[first], derivatives.by_rows[first + 1]
    _forces_of_side(run.behind, past, scratch, s, place, scratch.numbers, scratch.trial)
    _forces_of_side(run.ahead, past, scratch, s, place, normals, frictions)
    for i in range(S):
        normals[i] = (normals[i] - scratch.numbers[i]) / (2.0 * variation.law_step)
        frictions[i] = (frictions[i] - scratch.trial[i]) / (2.0 * variation.law_step)
    xi_and_rate_at_nodes(problem, scratch, s)


@inner
def rubbing_residual(run, node_set, level, c, s, shift, place):
    """Right-hand sides for the changes of the forces on the rows at the nodes, in column c, into ``scratch.residual``.

    ``scratch.motion`` holds the change of motion of the rows without that of the forces. In a frame that moves with an
    entry the clock of the spin is moved, too.
    """
    problem, tables, scratch = run.problem, run.tables, run.scratch
    derivatives, variation = run.derivatives, run.variation
    first, m, slider = row_of(problem, s), count_of(problem, s), slider_of(problem, s)
    parameter, slopes = is_parameter(run, c), scratch.row_slopes[9 * s :]
    latched = derivatives.latched[c, _latched_place(problem, s)] - slider[ARM] * slider[SPIN] * shift
    for i in range(S):
        t = run.past.now[T] + tables.contact_step[level] * tables.times[node_set, i]
        d_normal = derivatives.entry[c, s] * scratch.slope[s, 2, i]
        d_friction = friction_by_normal(slider) * d_normal - friction_by_xi(slider) * latched
        if parameter and variation.law_step > 0.0:
            d_normal += derivatives.by_rows[first, i]
            d_friction += derivatives.by_rows[first + 1, i]
        for a in range(m):
            by_delta, by_xi = scratch.node_directions[6 * s + 2 * a, i], scratch.node_directions[6 * s + 2 * a + 1, i]
            change = by_delta * d_normal + by_xi * d_friction
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
def _friction_in_state(side, s, t, w, normal):
    """F_t by the slider of one ``side`` of the parameter, or of the run itself, in the state w of a landing."""
    return friction_force(radius_of(side, s), slider_of(side, s), xi_and_rate_at(side, s, t, w)[0], normal)


@inner
def add_rubbing_change(run, s, w, t, delta, factor, out):
    """Add the changes of an element's forces, in the state w of a landing, to the rates of all columns.

    The slopes of the law are in ``derivatives.batch[2:5]``, N ahead and behind in the next two.
    """
    problem, derivatives, variation = run.problem, run.derivatives, run.variation
    first, m, size, batch = row_of(problem, s), count_of(problem, s), 2 * problem.k.size, derivatives.batch
    by_delta, by_rate, by_entry, rate = batch[2], batch[3], batch[4], indentation_rate(problem, s, w)
    motion, slopes, slider = derivatives.at_rows, derivatives.turned, slider_of(problem, s)
    normal_by_parameter, friction_by_parameter = 0.0, 0.0
    if variation.law_step > 0.0:
        width = 2.0 * variation.law_step
        normal_by_parameter = (batch[5] - batch[6]) / width
        friction_by_parameter = _friction_in_state(run.ahead, s, t, w, batch[5]) / width
        friction_by_parameter -= _friction_in_state(run.behind, s, t, w, batch[6]) / width
    normal = force_at(problem, s, delta, rate, run.past.entry_rate[s], batch[5:8])
    tangential = _friction_in_state(problem, s, t, w, normal)
    for a in range(m):
        motion[a, 0, 0] = dot(problem.read[first + a], w, size) - problem.gap[first + a]
        motion[a, 1, 0] = dot(problem.read_rate[first + a], w, size)
    row_slopes(problem, s, motion, 0, rate, normal, tangential, by_delta, by_rate, slopes)
    for c in range(derivatives.y.shape[0]):
        y, latched = derivatives.trial[c], derivatives.latched[c, _latched_place(problem, s)]
        d_normal = by_entry * derivatives.entry[c, s]
        d_friction = friction_by_normal(slider) * d_normal - friction_by_xi(slider) * latched
        if is_parameter(run, c):
            d_normal, d_friction = d_normal + normal_by_parameter, d_friction + friction_by_parameter
        for a in range(m):
            press, rub = row_directions(problem, s, motion[0, 0, 0], motion[1, 0, 0], a)
            change = press * d_normal + rub * d_friction
            for b in range(m):
                for d in range(2):
                    moved = row_change(run, y, c, first + b, d, t)
                    change += slopes[a * m + b, d, 0] * moved
            for e in range(size):
                out[c, e] += factor * change * problem.push[first + a, e]
