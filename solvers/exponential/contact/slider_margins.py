"""Margins of a slider in a step of the main method: at the nodes, at its ends, between nodes; see `compiled.sliding`.

They depend on ξ, ξ̇ and, in slip, Ṅ besides δ and δ̇. Ṅ of a law with a dashpot needs δ̈. In a state this follows from
the equations of motion, at the nodes from the polynomial through δ̇ there and at the start of the step. Where a law
bends at δ̇ = 0, its N_δ̇ jumps, and with it the margin of slip, perhaps below zero. So on the bend, where δ̇ is
rounding, the margin is taken on the side on which the law is.
"""

from __future__ import annotations

from numba import types

from solvers.compiled.friction import friction_force
from solvers.compiled.kernels import (
    VECTOR,
    copy,
    indentation_and_rate,
    inlined,
    inner,
    merged,
    place_of,
    radius_of,
    rhs,
    row_of,
    slider_of,
    surface_tolerance,
    xi_and_rate_at,
)
from solvers.compiled.parts import RUB_AROUND, RUB_IN, RUB_MARGINS, RUB_PEAK, part
from solvers.compiled.simd import largest8, least8, load8, size8, splat8, sqrt8, store8
from solvers.compiled.sliding import (
    ACCELERATION,
    POINT,
    RATE,
    motion_without_accelerations,
    move_point,
    normal_force,
    normal_forces,
    normal_slopes,
    point_of,
    slider_margins,
    slopes_of,
    xi_tolerances,
)
from solvers.compiled.state import T, rate_tolerance
from solvers.compiled.sums import above, combine
from solvers.exponential.circles.friction import (
    NODE_XI,
    NODE_XI_RATE,
    SPARE,
    TANGENTIAL,
    xi_and_rate_at_nodes,
    xi_continued,
)
from solvers.exponential.contact.crossings import REST, ROUNDING
from solvers.exponential.contact.first_step import NEW
from solvers.exponential.contact.node_response import (
    DELTAS,
    FORCES,
    KNOWN,
    LEFT_BY_ITERATION,
    RATES,
    RTOL,
    rate_ripple_of,
    ripple_of,
    swing_of,
)
from solvers.exponential.contact.nodes import AT_BEGIN, AT_END, LOCAL_SLOPES, SLOPE_AT_BEGIN, SLOPE_AT_END, S
from solvers.exponential.contact.peaks import BELOW_PEAK, local_maximum, motion_around
from solvers.exponential.tables import DAMPING, EXPONENT, FACTOR
from solvers.exponential.tables import STIFFNESS as ELASTICITY
from solvers.problem.friction import CODE, CUT, FREE, MU, PEAK, PRESSES, SLIDES, STICK, STIFFNESS

ENDS = 6  # margins in `Scratch.ends` for a border: at the start, at the end, and at the start with what may change it
BEGIN, END, DELTA_ROUNDED, RATE_ROUNDED, DELTA_RIPPLED, RATE_RIPPLED = range(ENDS)
_SLOPE_ROUNDING = 1e-8  # of a margin, in units of its largest, that contains the slope of a polynomial
_TINY = 1e-300  # m, keeps N/δ finite
_DIFFERENCE_STEP = 1e-6  # relative step in δ and δ̇ for differences of the slopes of N
_LEFT_OUT, _CLEAR_OF_ZERO = 4.0, 0.05  # see `_ends_by_polynomial`
_ON_BEND = 1e-9  # δ̇, in units of the reference speed, that a landing on a bend at δ̇ = 0 may leave


@inlined
def _slips(slider):
    """Whether a slider slips."""
    return abs(slider[CODE]) == 1.0


@inner
def margin_rounding(run, s, j, t, x):
    """Rounding of margin j of a slider in the state x by that of ξ, ξ̇, δ and δ̇: m/s of its own in slip, else N."""
    problem, state = run.problem, run.state
    slider, (of_way, of_rate) = slider_of(problem, s), xi_tolerances(problem, s, t, x)
    if j == SLIDES and _slips(slider):
        return of_rate
    delta, rate = indentation_and_rate(problem, s, x)
    least = surface_tolerance(problem, s, x)
    normal_force(problem, s, state.segment[s], state.entry_rate[s], max(delta, least), rate)
    by_delta, by_rate, _ = slopes_of(problem, s, state.entry_rate[s])
    of_normal = abs(by_delta) * least + abs(by_rate) * rate_tolerance(problem, s, x)
    return of_normal if slider[CODE] != STICK else slider[MU] * of_normal + slider[STIFFNESS] * of_way


@inlined
def _rate_dependent(problem, s):
    """Whether N depends on δ̇, so that it may pull, and the slider has two borders."""
    return problem.border_count[s] > PRESSES


@inlined
def _rate_on_side(run, s, rate):
    """δ̇, or if that is rounding on the wrong side of the law's bend, a tiny rate on its side."""
    side, rounding = run.scratch.side[s], _ON_BEND * run.scratch.reference_speed[s]
    on = slider_of(run.problem, s)[CUT] < 0.0 and side * rate <= 0.0 and abs(rate) <= rounding
    return side * _TINY if on and side != 0.0 else rate


@part(RUB_IN, types.void, types.int64, types.float64, VECTOR, types.float64, VECTOR)
def slider_margins_in(run, s, t, x, later, out):
    """Margins of element s in the state x at time t, or extrapolated by ``later``, s.

    ``scratch.point`` is left with its motion in both.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    point, moved = scratch.point[0], scratch.point[1]
    if later != 0.0 or (slider_of(problem, s)[CODE] != STICK and _rate_dependent(problem, s)):
        rhs(problem, t, x, state.segment, state.entry_rate, state.rate, scratch.numbers)
        point_of(problem, s, t, x, state.rate, point)
        move_point(point, later, moved)
    else:
        motion_without_accelerations(problem, s, t, x, point)
        copy(point, moved, POINT)
    moved[RATE] = _rate_on_side(run, s, moved[RATE])
    slider_margins(problem, s, state.segment[s], state.entry_rate[s], moved, out)


@inlined
def _node_accelerations(run, node_set, h, s, rates, out):
    """δ̈ at the nodes: slopes of the polynomial through δ̇ there and at the start."""
    scratch = run.scratch
    store8(scratch.trial, 0, load8(rates, 0) - splat8(scratch.start_motion[s, 1]))
    combine(run.tables.node_slopes[node_set], scratch.trial, S, None, out)
    store8(out, 0, load8(out, 0) / splat8(h))


@inlined
def _slopes(run, s, delta, rate, slope):
    """N_δ and N_δ̇ at S points with δ >= 0; of N = K δ^p (1 + a δ̇) + c δ̇ with p = 1 or 1.5 without a call of the law."""
    law = run.tables.power_law[s]
    if not law[EXPONENT] > 0.0:
        normal_slopes(run.problem, s, S, delta, rate, run.state.entry_rate[s], slope[0], slope[1], slope[2])
        return
    factor, deep, steep = law[FACTOR] / run.state.entry_rate[s], load8(delta, 0), splat8(law[ELASTICITY])
    if law[EXPONENT] == 1.5:
        steep = steep * sqrt8(deep)
    store8(slope[0], 0, splat8(law[EXPONENT]) * steep * (splat8(1.0) + splat8(factor) * load8(rate, 0)))
    store8(slope[1], 0, splat8(factor) * steep * deep + splat8(law[DAMPING]))


@inner
def _margins_at(run, s, delta, rate, xi_rates, forces, accelerations):
    """Margins at S points into ``scratch.margin``, from N in ``scratch.numbers``, δ, δ̇, ξ̇, F_t and δ̈."""
    scratch = run.scratch
    slider, margin, normal, slope = slider_of(run.problem, s), scratch.margin, scratch.numbers, scratch.slope[s]
    slips, mu = _slips(slider), slider[MU]
    if slips and mu > 0.0:
        _slopes(run, s, delta, rate, slope)
    for i in range(S):
        if _rate_dependent(run.problem, s):
            margin[S + i] = normal[i] if slips else 1.0
        if slider[CODE] == FREE:
            margin[i] = -normal[i]
        elif not slips:
            margin[i] = mu * normal[i] - abs(forces[i])
        else:
            margin[i] = slider[CODE] * xi_rates[i]
            if mu > 0.0:
                normal_rate = slope[0, i] * rate[i]
                normal_rate += slope[1, i] * accelerations[i] if slope[1, i] != 0.0 else 0.0
                margin[i] -= mu / slider[STIFFNESS] * normal_rate


@inner
def slider_margins_at_nodes(run, s, node_set, h):
    """Margins at the nodes of the step just tried, into ``scratch.margin``.

    N and F_t there are known; only of a law that is cut at zero N is evaluated again, without the cut.
    """
    problem, scratch = run.problem, run.scratch
    place, slid, slider = place_of(problem, s), scratch.slid[s], slider_of(problem, s)
    motion = scratch.motion[place]
    above(motion[0], problem.knots[s, 0], scratch.clipped)
    copy(scratch.law_force[place], scratch.numbers, S)
    if slider[CUT] >= 0.0:
        normal_forces(problem, s, S, scratch.clipped, motion[1], run.state.entry_rate[s], scratch.numbers)
    if _slips(slider) and _rate_dependent(problem, s):
        _node_accelerations(run, node_set, h, s, motion[1], slid[SPARE])
    _margins_at(run, s, scratch.clipped, motion[1], slid[NODE_XI_RATE], slid[TANGENTIAL], slid[SPARE])


@merged
def _margin_slopes(run, s):
    """|slopes| of both margins at the last node: of the own one by δ and δ̇, then of N by δ and δ̇.

    In slip the margin contains slopes of N, which are differenced; of a power law that only pushes they are known.
    """
    problem, scratch = run.problem, run.scratch
    slider, numbers, motion = slider_of(problem, s), scratch.local_motion, scratch.motion[place_of(problem, s)]
    deltas, rates, slopes = numbers[KNOWN, :3], numbers[KNOWN, 3:6], numbers[FORCES]
    delta, rate = max(motion[0, S - 1], problem.knots[s, 0]), motion[1, S - 1]
    if not _rate_dependent(problem, s):
        p = run.tables.power_law[s, EXPONENT]
        by_delta, share = p * scratch.numbers[S - 1] / max(delta, _TINY), slider[MU] / slider[STIFFNESS]
        if not _slips(slider):
            return slider[MU] * by_delta, 0.0, by_delta, 0.0
        return share * abs((p - 1.0) * by_delta * rate) / max(delta, _TINY), share * by_delta, by_delta, 0.0
    by = _DIFFERENCE_STEP * max(delta, 1e-300), _DIFFERENCE_STEP * max(abs(rate), scratch.reference_speed[s])
    deltas[0], deltas[1], deltas[2] = delta, delta + by[0], delta
    rates[0], rates[1], rates[2] = rate, rate, rate + by[1]
    normal_slopes(problem, s, 3, deltas, rates, run.state.entry_rate[s], slopes[0:3], slopes[3:6], slopes[6:9])
    by_delta, by_rate = abs(slopes[0]), abs(slopes[3])
    if slider[CODE] == FREE:
        return by_delta, by_rate, by_delta, by_rate
    if not _slips(slider):
        return slider[MU] * by_delta, slider[MU] * by_rate, by_delta, by_rate
    acceleration, share = scratch.slid[s, SPARE, S - 1], slider[MU] / slider[STIFFNESS]
    normal_rate = slopes[0] * rate + slopes[3] * acceleration
    first = abs(slopes[1] * rate + slopes[4] * acceleration - normal_rate) / by[0]
    second = abs(slopes[2] * (rate + by[1]) + slopes[5] * acceleration - normal_rate) / by[1]
    return share * first, share * second, by_delta, by_rate


@inlined
def _ends_by_polynomial(run, s):
    """Ends of a smooth step's margins by the polynomials through their nodes, into ``scratch.ends``.

    Returns whether these tell both margins at the start, whether at the end, and whether they are far from zero all
    over the step. A value is told if it is larger than what the polynomial may leave out. A negative one at the start
    is not: no step begins beyond a border, but just after an entry N has a broken power there, which bends the margin.
    """
    scratch = run.scratch
    begin_told, end_told, far, summary = True, True, True, scratch.local_motion[KNOWN, :S]
    for j in range(run.problem.border_count[s]):
        ends, margin = scratch.ends[ENDS * j : ENDS * (j + 1)], scratch.margin[S * j : S * j + S]
        combine(run.tables.summary[0], margin, S, None, summary)
        ends[BEGIN], ends[END], values = summary[AT_BEGIN], summary[AT_END], load8(margin, 0)
        zero = max(_LEFT_OUT * max(abs(summary[2]), abs(summary[3])), _CLEAR_OF_ZERO * largest8(size8(values)))
        begin_told &= ends[BEGIN] > zero
        end_told &= abs(ends[END]) > zero
        far &= min(ends[BEGIN], ends[END], least8(values)) > zero
    return begin_told, end_told, begin_told and end_told and far


@inlined
def _ends_in_states(run, s, h, begin_told, end_told):
    """Margins at the start and the end of the step, in the states there, unless they are told already."""
    state, scratch = run.state, run.scratch
    if not end_told:
        slider_margins_in(run, s, state.now[T] + h, scratch.x_new, 0.0, scratch.fired)
        for j in range(run.problem.border_count[s]):
            scratch.ends[ENDS * j + END] = scratch.fired[j]
    if not begin_told:
        slider_margins_in(run, s, state.now[T], state.x, 0.0, scratch.fired)
        for j in range(run.problem.border_count[s]):
            scratch.ends[ENDS * j + BEGIN] = scratch.fired[j]


@part(RUB_MARGINS, types.void, *[types.int64] * 3)
def slider_margins_on_step(run, s, node_set, level):
    """Margins at the nodes and ends of the step just tried, their largest values and rounding, as in `borders`.

    Far from zero their rounding is that of the last step that was not. The motion at the start of a step from an entry
    stays in ``scratch.point[0]``.
    """
    tables, scratch = run.tables, run.scratch
    h, far = tables.contact_step[level], False
    xi_and_rate_at_nodes(run.problem, scratch, s)
    slider_margins_at_nodes(run, s, node_set, h)
    ripple, faster = _ripples(run, s, tables.alias[tables.kind[node_set], level])
    begin_told, end_told, slopes = False, False, (0.0, 0.0, 0.0, 0.0)
    if node_set == 0 and ripple == 0.0 and faster == 0.0 and tables.bend[s] == 0.0:  # beyond a bend nothing is smooth
        begin_told, end_told, far = _ends_by_polynomial(run, s)
    begin_told &= scratch.control[NEW] == 0  # a segment begins on its border
    far &= scratch.control[NEW] == 0
    if not far:
        slopes = _margin_slopes(run, s)
    _ends_in_states(run, s, h, begin_told, end_told)
    for j in range(run.problem.border_count[s]):
        ends, values = scratch.ends[ENDS * j : ENDS * (j + 1)], load8(scratch.margin[S * j :], 0)
        for i in range(DELTA_ROUNDED, ENDS):
            ends[i] = ends[BEGIN]
        scratch.largest[s, j] = max(abs(ends[BEGIN]), abs(ends[END]), largest8(size8(values)))
    if not far:
        _add_rounding(run, s, slopes, ripple, faster)


@merged
def _add_rounding(run, s, slopes, ripple, faster):
    """Rounding of the margins by that of δ, δ̇, ξ and ξ̇, and at the start the ripple of fast blocks.

    ``slopes`` are those of `_margin_slopes`.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    own_by_delta, own_by_rate, normal_by_delta, normal_by_rate = slopes
    slider, slips = slider_of(problem, s), _slips(slider_of(problem, s))
    xi, xi_rate = xi_tolerances(problem, s, state.now[T], state.x)
    rest, own_by_way = REST * scratch.reference_speed[s], slider[STIFFNESS] if slider[CODE] == STICK else 0.0
    left = LEFT_BY_ITERATION * scratch.accuracy[RTOL] * scratch.reference_speed[s]
    delta, rate = surface_tolerance(problem, s, state.x), max(rate_tolerance(problem, s, state.x), rest)
    for j in range(problem.border_count[s]):
        by_delta, by_rate, by_way, by_speed = own_by_delta, own_by_rate, own_by_way, 1.0 if slips else 0.0
        if j == PRESSES:
            by_delta, by_rate, by_way, by_speed = normal_by_delta, normal_by_rate, 0.0, 0.0
        if j == SLIDES or slips:
            scratch.ends[ENDS * j + DELTA_RIPPLED] += (by_delta + by_way) * ripple + by_speed * faster
        noise = by_delta * delta + by_rate * rate + by_way * xi + by_speed * max(xi_rate, rest, left)
        differenced = j == SLIDES and slips and _rate_dependent(problem, s)
        share = _SLOPE_ROUNDING if differenced else ROUNDING
        scratch.noise[s, j] = max(share * scratch.largest[s, j], 2.0 * noise)


@inlined
def _ripples(run, s, alias):
    """Bounds of the errors of δ or ξ, m, and of their rates, m/s, by blocks that the nodes do not resolve."""
    ripple, faster, first, x = 0.0, 0.0, row_of(run.problem, s), swing_of(run)
    for r in range(first, first + 2):
        ripple += ripple_of(run, x, r, alias)
        faster += rate_ripple_of(run, x, r, alias)
    return ripple, faster


@merged
def _tangential_motion_around(run, node_set, h, s, place):
    """ξ and ξ̇ at points around a node, into row `FORCES` of ``scratch.local_motion``; δ and δ̇ are there already."""
    state, scratch = run.state, run.scratch
    known, slid, out = scratch.local_motion[KNOWN], scratch.slid[s], scratch.local_motion[FORCES]
    xi, xi_rate = (
        xi_continued(run, s, state.now[T], state.x, 0),
        xi_and_rate_at(run.problem, s, state.now[T], state.x)[1],
    )
    copy(slid[NODE_XI], known, S)
    for i in range(S):
        known[S + i] = h * slid[NODE_XI_RATE, i]
    known[2 * S] = xi
    known[2 * S + 1] = h * xi_rate
    combine(run.tables.local_interpolation[node_set, place], known, 2 * S + 2, None, out)
    for i in range(S):
        out[S + i] /= h


@part(RUB_AROUND, types.void, *[types.int64] * 2, types.float64, types.int64)
def slider_margins_around(run, s, node_set, h, place):
    """Margins at points around a node of the step, into ``scratch.margin``."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    motion_around(run, node_set, h, s, place)
    _tangential_motion_around(run, node_set, h, s, place)
    begin, end = tables.local_interval[node_set, place, 0], tables.local_interval[node_set, place, 1]
    deltas, rates, tangential = scratch.local_motion[DELTAS], scratch.local_motion[RATES], scratch.local_motion[FORCES]
    accelerations, kappa, forces = scratch.slid[s, SPARE], tables.time_exponent[node_set], scratch.trial
    combine(LOCAL_SLOPES, rates, S, None, accelerations)
    for i in range(S):
        deltas[i] = max(deltas[i], problem.knots[s, 0])
        rates[i] = _rate_on_side(run, s, rates[i])
        sigma = begin + 0.5 * (LOCAL_SLOPES[S, i] + 1.0) * (end - begin)
        pace = h * kappa * sigma ** (kappa - 1.0) * 0.5 * (end - begin)
        accelerations[i] = accelerations[i] / pace if pace > 0.0 else scratch.point[0, ACCELERATION]
    normal_forces(problem, s, S, deltas, rates, run.state.entry_rate[s], scratch.numbers)
    for i in range(S):
        forces[i] = friction_force(radius_of(problem, s), slider_of(problem, s), tangential[i], scratch.numbers[i])
    _margins_at(run, s, deltas, rates, tangential[S:], forces, accelerations)


@part(RUB_PEAK, types.void, types.int64, types.float64, types.int64, types.float64)
def peak_of_friction(run, node_set, h, s, limit):
    """Raise the largest |F_t| of stop s by the converged step of length h, up to σ = ``limit``."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    slider, slid, highest = slider_of(problem, s), scratch.slid[s], -1
    for i in range(S):
        if tables.nodes[node_set, i] <= limit and (
            highest < 0 or abs(slid[TANGENTIAL, i]) > abs(slid[TANGENTIAL, highest])
        ):
            highest = i
    if highest < 0:
        return
    known, largest = slider[PEAK], abs(slid[TANGENTIAL, highest])
    slider[PEAK] = max(known, largest)
    if largest < BELOW_PEAK * slider[PEAK] or (limit >= 1.0 and _maximum_outside(run, node_set, s, highest, known)):
        return
    begin, end = tables.local_interval[node_set, highest, 0], tables.local_interval[node_set, highest, 1]
    within = min(2.0 * (limit - begin) / (end - begin) - 1.0, 1.0)
    if within <= -1.0:
        return
    motion_around(run, node_set, h, s, highest)
    values = slid[SPARE]
    if slider[CODE] == STICK:
        shift = slid[NODE_XI, highest] - slid[TANGENTIAL, highest] / slider[STIFFNESS]
        _tangential_motion_around(run, node_set, h, s, highest)
        for i in range(S):
            values[i] = slider[STIFFNESS] * abs(scratch.local_motion[FORCES, i] - shift)
    else:
        deltas, rates = scratch.local_motion[DELTAS], scratch.local_motion[RATES]
        above(deltas, problem.knots[s, 0], deltas)
        normal_forces(problem, s, S, deltas, rates, run.state.entry_rate[s], values)
        for i in range(S):
            values[i] = slider[MU] * max(values[i], 0.0)
    slider[PEAK] = max(slider[PEAK], local_maximum(values, within, scratch.clipped))


@merged
def _maximum_outside(run, node_set, s, highest, known):
    """Whether |F_t| rises out of the step at its highest node, an end node, so that no maximum is inside."""
    forces, summary = run.scratch.slid[s, TANGENTIAL], run.scratch.trial
    combine(run.tables.summary[node_set], forces, S, None, summary)
    sign = 1.0 if forces[highest] > 0.0 else -1.0
    if highest == S - 1:
        return sign * summary[SLOPE_AT_END] >= 0.0  # still rising at the end, where the next step begins
    falls = highest == 0 and sign * summary[SLOPE_AT_BEGIN] <= 0.0
    return node_set == 0 and falls and known >= sign * summary[AT_BEGIN]
