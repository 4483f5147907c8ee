"""Indentations and rates of the stops at the nodes of a contact step, without and with contact forces."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from solvers.compiled.dop853_tableau import STAGES
from solvers.compiled.kernels import (
    cell_ends,
    contact_gradient,
    copy,
    inlined,
    inner,
    is_circle,
    is_planar,
    law_forces,
    merged,
    place_of,
    quintic,
    reordered,
    row_of,
    rubs,
    surface_tolerance,
    table_value,
)
from solvers.compiled.simd import largest8, load8, size8, splat8, store8
from solvers.compiled.state import CALLS, PEAK_FORCE, T, acts, rate_tolerance
from solvers.compiled.sums import above, add_response, combine
from solvers.exponential.circles.contact import radial_forces
from solvers.exponential.circles.friction import rubbing_forces
from solvers.exponential.contact.many_stops import (
    SIGNALS,
    add_block_motion,
    free_block_motion,
    motion_at_nodes,
    pair_response,
    prefers_blocks,
    respond_through_blocks,
    uses_blocks,
)
from solvers.exponential.contact.nodes import DERIVATIVES, S
from solvers.exponential.flight import SWING, join, split, take_off_following

SHORT = STAGES
DIFFERENCE, BATCH, LANDED, WITHIN, START = STAGES + 1, *range(STAGES + 4, STAGES + 8)
"""Rows of `Scratch.stages` behind the stages of a landing's Runge–Kutta step:

    SHORT .. SHORT + 3   stages of a short step; outside of one, SHORT + 1 is DIFFERENCE, an embedded difference
    BATCH                numbers for one law call
    LANDED               trial states, at last the one landed on
    WITHIN               a state within a step, for the energy balance
    START                the state at the start of a landing, or at the end of a run within a step
"""
DELTAS, RATES, FORCES, KNOWN = range(4)
"""Rows of `Scratch.local_motion`: m, m/s, N at points around a node, and the values they are interpolated from."""
RTOL, REACH = range(2)  # places in Scratch.accuracy
WHEN, SLOPE = range(2)  # places in Scratch.ahead and expected: s; slope by time of the margin at its zero, 0 if unknown
ELEMENT, BORDER, ONLY_EXPECTED = range(3)  # places in Scratch.ahead_of; the first two also in expected_of
_KINK_JUMP = 1e-2  # jump of a third derivative, over signal/dt³, that is a kink; smooth signals have a tenth
LEFT_BY_ITERATION = 0.05  # of rtol × reference speed: what the iterated forces of a step may leave open of a rate
STRAIGHT = 1e-9  # change of a law's slope on a step, in units of the slope, that is rounding
_WORK_TOLERANCE = 10.0  # part of a force, in units of rtol × the largest force, that a step may leave out for its work
_ROUNDINGS = 4.0  # rounding of the coefficients of a force, in units of that of its values
_RESOLVED = 4.0  # times the last two coefficients of a signal: differences up to this are estimated by them already


class Scratch(NamedTuple):
    """Working arrays of the exponential integrator; the first index of many arrays is the row or element.

    Kernels write to them, `Workspace.begin` sets them back and writes `accuracy`. `previous`, `control` and arrays with
    one number per stop may last from step to step; values at the nodes are new in each step. States are block
    coordinates (for mass-normalised modes in √kg m and √kg m/s), then the energy balance in J, and J and N s per stop;
    indentations are in m, rates in m/s, forces in N, signals in their own units.
    """

    x_new: Annotated[Any, "X8"]  # state at the end of the step tried
    terms: Annotated[Any, "14, 2*N8"]  # derivatives of the state
    swing: Annotated[Any, "2*N"]  # state at the start of a step without what follows the sampled signals
    oscillation: Annotated[Any, "2*N"]  # the same without what follows the forces of the step tried
    is_split: Annotated[Any, "int 1"]  # 1 if ``oscillation`` is that of the step tried
    signal_terms: Annotated[Any, "tables, 6"]  # value and derivatives of every sampled signal
    values: Annotated[Any, "14"]  # coefficients of a polynomial
    norms: Annotated[Any, "N"]  # energy norms of the blocks, √(v² + k p²), √J
    ringing: Annotated[Any, "N"]  # rate, √J, at which the blocks swing by the forces of a contact or segment just begun
    driven_speed: Annotated[Any, "tables"]  # √J: energy norm that its largest value drives in a cell of a table
    signal_bounds: Annotated[Any, "L, 4"]  # of the sampled signals and their three derivatives on some cells
    per_row: Annotated[Any, "R"]  # bounds of |δ̈| in m/s², errors of δ in m, or of δ̇ in m/s
    slow: Annotated[Any, "R, 3"]  # of the rows in flight, places named in `flight`
    split_state: Annotated[Any, "7, 2, N8"]  # p and v of the blocks, of several states; see `energy.flight_balance`
    motion: Annotated[Any, "R+A, 2, S"]  # displacements of the rows and their rates at the nodes, δ and δ̇ of circles
    clipped: Annotated[Any, "S"]  # indentations of a stop at the nodes, not below its first knot; or other values
    free: Annotated[Any, "R, 2, S"]  # the motion of the rows without contact forces
    force: Annotated[Any, "R+L, S"]  # forces on the rows, then values of the signals
    law_force: Annotated[Any, "R+A, S"]  # forces on the rows by the laws for the present motion, then the radial ones
    trial: Annotated[Any, "S"]  # eight numbers for use within a function
    summary: Annotated[Any, "R+A, 8"]  # of forces, see Tables.summary
    previous: Annotated[Any, "R, S"]  # forces of the last accepted step
    slope: Annotated[Any, "E, 3, S"]  # derivatives of the laws at the nodes by δ, δ̇ and entry rate
    turned: Annotated[Any, "5*A, 2, S"]  # slopes of the components of circles' forces, see `circles.contact`
    residual: Annotated[Any, "R*S"]  # N: of Newton's method, then its changes of the forces
    pivots: Annotated[Any, "int R*S"]  # of the LU factors
    stages: Annotated[Any, "stages, W8"]  # states and rates, rows as named above
    reference_speed: Annotated[Any, "E"]  # m/s: an error of an indentation rate is measured in rtol × reference speed
    first_step_share: Annotated[Any, "E"]  # of a contact's duration that its first step may take; 0: unknown
    force_tolerance: Annotated[Any, "E"]  # N: change of a force in an iteration below which it counts as converged
    unresolved: Annotated[Any, "R"]  # N s: impulse that the polynomials of a step leave out
    before_cut: Annotated[Any, "E"]  # N: force before its cut at zero in a landing, for derivatives
    turns: Annotated[Any, "int E"]  # 1 if the force of friction has a maximum inside the landing just taken
    marked: Annotated[Any, "1"]  # s: time from which on the energy of a flight is accounted for
    guess: Annotated[Any, "R, S"]  # forces from which the iterations begin
    viscous: Annotated[Any, "E"]  # N s/m: slope of a force by its rate, from the last Newton iteration; 0 if not needed
    local_motion: Annotated[Any, "4, 3*S"]  # rows as named above, see `peaks`
    side: Annotated[Any, "E"]  # +1 or -1: sign of the event function of each stop's bend, see `crossings`
    side_at_begin: Annotated[Any, "E"]  # the same at the start of the step tried
    bend_values: Annotated[Any, "S+2"]  # event function of a bend at the nodes and at the end, then its largest size
    accuracy: Annotated[Any, "2"]  # rtol; radians of the fastest block that a landing may take
    stiffened: Annotated[Any, "1"]  # rad/s: frequency of the structure as stiffened by the contacts, for derivatives
    duration: Annotated[Any, "E"]  # s: estimate for the last contact of a stop, as if nothing else acted on the body
    energy_sums: Annotated[Any, "2+L, numbers"]  # see `energy.flight_balance` and `contact_balance`
    energy: Annotated[Any, "3"]  # J, see `energy.check`
    control: Annotated[Any, "int 7"]  # integers of the step control, places named in `first_step`
    start_motion: Annotated[Any, "E, 2"]  # δ and δ̇ at the start of the step
    node_time: Annotated[Any, "S"]  # s, of the nodes of the step tried
    slid: Annotated[Any, "G, 4, S"]  # ξ, ξ̇ and F_t at the nodes, then scratch; see `circles.friction`
    row_slopes: Annotated[Any, "9*G, 2, S"]  # of forces on the rows of an element with friction, by these
    node_directions: Annotated[Any, "6*G, S"]  # ∂δ/∂y and ∂ξ/∂y of each of its rows at the nodes, for derivatives
    slider_code: Annotated[Any, "E"]  # code of each slider before the contacts begin, for derivatives
    point: Annotated[Any, "2, 6"]  # motion of an element with friction, now and extrapolated, see `compiled.sliding`
    numbers: Annotated[Any, "S"]  # for a law call
    margin: Annotated[Any, "B*S"]  # margins of an element's borders at points, row by row; see `borders`
    ends: Annotated[Any, "6*B"]  # margins of an element's borders at the ends of a step or landing; see `borders`
    fired: Annotated[Any, "B"]  # margins of an element's borders in one state
    ahead: Annotated[Any, "2"]  # border that a step is known to meet, places named above: time, 0 if there is none
    ahead_of: Annotated[Any, "int 3"]  # its element and number; 1 if no step has crossed it yet
    expected: Annotated[Any, "2"]  # border beyond the step tried: time after its start, inf if there is none
    expected_of: Annotated[Any, "int 2"]
    margin_begin: Annotated[Any, "E, B"]  # margins at the start of a landing, then at its end and shortly before it
    margin_end: Annotated[Any, "E, B"]
    margin_before: Annotated[Any, "B"]  # of the element whose border is landed on
    largest: Annotated[Any, "E, B"]  # largest margins on the step tried last
    noise: Annotated[Any, "E, B"]  # their rounding
    last_resort: Annotated[Any, "int 1"]  # 1 allows a landing of any error, `TURNED` tells that such a one has turned
    block_motion: Annotated[Any, "2*M, S"]  # p and v at the nodes; as the next two see `many_stops`
    block_force: Annotated[Any, "2*M, S"]  # state rates of the blocks by the forces at the nodes
    pair_weights: Annotated[Any, "M8"]  # products of a read row with the push of another row
    jacobian: Annotated[Any, "R*S, R*S"]  # of the rows in contact; as the next two not cleared between runs
    pair_pool: Annotated[Any, "pool, S, 2*S"]  # responses of pairs of rows
    pool_keys: Annotated[Any, "int pool"]  # which pair of rows and step length each of them belongs to
    along: Annotated[Any, "2*N, S"]  # p and v of the blocks at a panel's points, as the next two of any number of stops
    moves: Annotated[Any, "N, 5, S"]  # see `energy.quadrature`
    between: Annotated[Any, "S+1+R+L, S"]
    kept: Annotated[Any, "17, S"]  # what an element in a plane has at the nodes, see `energy.quadrature`


@merged
def sample_signals(run, node_set, t, h):
    """Values of the sampled signals at the nodes of a step of length h from time t, into rows of ``scratch.force``."""
    problem = run.problem
    for j in range(problem.table_dt.size):
        for i in range(S):
            run.scratch.force[problem.gap.size + problem.table_load[j], i] = table_value(
                problem, j, t + h * run.tables.times[node_set, i]
            )


@inlined
def largest_size(values):
    """Largest size of node values."""
    return largest8(size8(load8(values, 0)))


@inlined
def _last_sizes(coefficients):
    """A₂ and A₁ of the last four coefficients of a polynomial: the larger one of the first two, and of the last two."""
    return max(abs(coefficients[0]), abs(coefficients[1])), max(abs(coefficients[2]), abs(coefficients[3]))


@inlined
def unresolved_part(coefficients, largest, power):
    """A₁ max((A₁/A₂)^power, A₁/largest), see `_last_sizes`: estimate of what a polynomial of a function leaves out."""
    before, last = _last_sizes(coefficients)
    if last <= 1e-14 * largest:
        return 0.0
    decay = min(last / before, 1.0) if before > 0.0 else 1.0
    return last * max(decay**power, min(last / largest, 1.0))


@inlined
def next_coefficient(coefficients):
    """A₁ √(A₁/A₂), see `_last_sizes`: estimate of the coefficient behind the last four."""
    before, last = _last_sizes(coefficients)
    return last * math.sqrt(min(last / before, 1.0)) if before > 0.0 else last


@inlined
def error_of_work(run, s, unresolved, largest, slopes):
    """Part of a force that a step leaves out, N, in units of its tolerance for the work of an element.

    ``slopes`` of the law by δ and δ̇ give the rounding of the force, which is no error of the step.
    """
    problem, state = run.problem, run.state
    rounding = slopes[0] * surface_tolerance(problem, s, state.x) + slopes[1] * rate_tolerance(problem, s, state.x)
    allowed = _WORK_TOLERANCE * run.scratch.accuracy[RTOL] * max(largest, state.active[s, PEAK_FORCE])
    return max(unresolved - _ROUNDINGS * rounding, 0.0) / allowed


@inner
def unresolved_signal(run, node_set, j, t, h):
    """Estimate of the part of sampled signal j that its polynomial leaves out; on an entry step at half the order.

    What lies between the nodes, such as a short pulse, does not show in the coefficients: there the table is compared.
    Where the table has kinks, the coefficients decay too slowly to show it: there the difference is integrated.
    """
    problem = run.problem
    values, c = run.scratch.force[problem.gap.size + problem.table_load[j]], run.scratch.trial
    largest, dt, start = largest_size(values), problem.table_dt[j], problem.table_start[j]
    combine(run.tables.tail[node_set], values, S, None, c)
    found = unresolved_part(c, largest, S // 2 if node_set == 0 else 1)
    first, beyond = start + int(t / dt) + 1, min(start + int((t + h) / dt) + 1, problem.table_start[j + 1])
    if beyond - first > S:
        difference, mean = _between_nodes(problem, c, run.tables.time_exponent[node_set], j, first, beyond, t, h)
        if difference > _RESOLVED * max(abs(c[2]), abs(c[3])) + 1e-12 * largest:
            found = max(found, mean)
    if _has_kinks(problem, j, first, beyond, largest):
        found = max(found, _missed_impulse(run, values, node_set, j, t, h))
    return found


@inner
def _between_nodes(problem, coefficients, time_exponent, j, first, beyond, t, h):
    """Largest and mean difference of a signal from its polynomial, at the nodes of its table within the step."""
    dt, start, largest, total, power = problem.table_dt[j], problem.table_start[j], 0.0, 0.0, 1.0 / time_exponent
    for node in range(first, beyond):
        place = ((node - start) * dt - t) / h
        if power < 1.0:
            place = place**power
        difference = abs(problem.table[node, 0] - _legendre(coefficients, 2.0 * place - 1.0))
        largest, total = max(largest, difference), total + difference
    return largest, total / (beyond - first)


@inner
def _has_kinks(problem, j, first, beyond, largest):
    """Whether derivative p = 1, 2 or 3 of a signal jumps at a node by more than `_KINK_JUMP` × largest/dtᵖ."""
    dt, most = problem.table_dt[j], 0.0
    last = problem.table_start[j + 1] - 1
    for node in range(max(first, problem.table_start[j] + 1), min(beyond, last)):
        (a, before), (b, c) = cell_ends(problem, node - 1), cell_ends(problem, node)
        slope, curvature = dt * (b[1] - before[1]), dt * dt * (b[2] - before[2])
        jump = 60.0 * (a[0] - 2.0 * b[0] + c[0]) + 24.0 * dt * (a[1] - c[1]) - 36.0 * slope
        jump += 3.0 * dt * dt * (a[2] - 6.0 * b[2] + c[2]) + 9.0 * curvature
        most = max(most, abs(slope), abs(curvature), abs(jump))
    return most > _KINK_JUMP * largest


@inner
def _missed_impulse(run, values, node_set, j, t, h):
    """|mean| over the step of signal less polynomial; on a smooth step also of the difference times 2τ/h - 1."""
    problem = run.problem
    dt, impulse, moment = problem.table_dt[j], 0.0, 0.0
    last = min(int((t + h) / dt), problem.table_start[j + 1] - problem.table_start[j] - 2)
    for cell in range(min(int(t / dt), last), last + 1):
        begin, end = max(t / dt - cell, 0.0), (t + h) / dt - cell if cell == last else 1.0
        a = _cell_moments(problem, j, cell, begin)
        b = _cell_moments(problem, j, cell, end)
        impulse += b[0] - a[0]
        moment += (b[1] - a[1]) + (cell - (t + 0.5 * h) / dt) * (b[0] - a[0])
    impulse, moment = impulse * dt / h, moment * 2.0 * dt * dt / (h * h)
    for i in range(S):
        weight = run.tables.plain[node_set, i]
        impulse -= weight * values[i]
        moment -= weight * (2.0 * run.tables.times[node_set, i] - 1.0) * values[i]
    return abs(impulse) + (abs(moment) if node_set == 0 else 0.0)


@inlined
def _cell_moments(problem, j, cell, x):
    """∫ s du and ∫ s u du from the start of a cell to u = x, u in units of the cell's length."""
    s0, s1, s2, c3, c4, c5 = quintic(problem, j, cell)
    plain = s0 + x * (s1 / 2.0 + x * (s2 / 3.0 + x * (c3 / 4.0 + x * (c4 / 5.0 + x * c5 / 6.0))))
    first = s0 / 2.0 + x * (s1 / 3.0 + x * (s2 / 4.0 + x * (c3 / 5.0 + x * (c4 / 6.0 + x * c5 / 7.0))))
    return x * plain, x * x * first


@inlined
def _legendre(coefficients, x):
    """Value at x in [-1, 1] of a polynomial from its Legendre coefficients, which are in the order of `Tables.tail`."""
    before, now, half = 1.0, x, S // 2
    total = coefficients[half] + x * coefficients[half + 1]
    for k in range(2, S):
        before, now = now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k
        total += coefficients[(k + half) % S] * now
    return total


@inner
def free_response(run, node_set, level):
    """Motion of the rows at the nodes without contact forces, but with signals, into ``scratch.free``.

    With many rows only those in contact are computed.
    """
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    rows, size, by_blocks = problem.gap.size, 2 * problem.k.size, uses_blocks(tables)
    if is_planar(problem):
        for i in range(S):
            scratch.node_time[i] = state.now[T] + tables.contact_step[level] * tables.times[node_set, i]
    if problem.table_dt.size:
        sample_signals(run, node_set, state.now[T], tables.contact_step[level])
    if by_blocks:
        free_block_motion(run, node_set, level, state.x)
        if problem.table_dt.size:
            add_block_motion(run, node_set, level, SIGNALS, scratch.block_motion)
    for r in range(rows):
        free = scratch.free[r]
        if by_blocks:
            if acts(problem, state, r):
                motion_at_nodes(run, r, problem.gap[r], free)
            continue
        store8(free[0], 0, splat8(-problem.gap[r]))
        store8(free[1], 0, splat8(0.0))
        combine(tables.free[tables.kind[node_set], level, r], state.x, size, free, free)
        for j in range(problem.table_dt.size):
            u = rows + problem.table_load[j]
            combine(tables.forced[tables.kind[node_set], level, u, r], scratch.force[u], S, free, free)


@inlined
def respond(run, node_set, level, r):
    """Displacement and rate of row r at the nodes under the present forces, into ``scratch.motion``."""
    scratch = run.scratch
    delta, rate = load8(scratch.free[r, 0], 0), load8(scratch.free[r, 1], 0)
    for u in range(run.problem.gap.size):
        if acts(run.problem, run.state, u):
            rows = pair_response(run, node_set, level, r, u)
            delta, rate = add_response(rows, scratch.force[u], delta, rate)
    store8(scratch.motion[r, 0], 0, delta)
    store8(scratch.motion[r, 1], 0, rate)


@inner
def respond_all(run, node_set, level):
    """The same of all rows in contact, through the blocks if that is cheaper."""
    if prefers_blocks(run):
        respond_through_blocks(run, node_set, level)
        return
    for r in range(run.problem.gap.size):
        if acts(run.problem, run.state, r):
            respond(run, node_set, level, r)


@inlined
def own_accelerance(run, s):
    """-δ̈ of a stop per newton of its own force, 1/kg; of a circle the larger one of its rows."""
    tables = run.tables
    row = row_of(run.problem, s)
    if is_circle(run.problem, s):
        return max(tables.accelerance[row, row], tables.accelerance[row + 1, row + 1])
    return tables.accelerance[row, row]


@inlined
def shortest_step(tables):
    """Length, s, of the shortest contact step."""
    return tables.contact_step[tables.contact_step.size - 1]


@merged
def motion_of(run, s):
    """(2, S) δ, m, and δ̇, m/s, of stop s at the nodes."""
    return run.scratch.motion[place_of(run.problem, s)]


@merged
def force_of(run, s):
    """(S,) force, N, of stop s at the nodes; of a circle that along the radius."""
    problem, scratch = run.problem, run.scratch
    return scratch.force[row_of(problem, s)] if not is_circle(problem, s) else scratch.law_force[place_of(problem, s)]


@inlined
def law_slopes_at_nodes(run, s):
    """Derivatives of the law of stop s at the nodes by δ, δ̇ and entry rate, into ``scratch.slope``."""
    scratch = run.scratch
    motion, slope = motion_of(run, s), scratch.slope[s]
    copy(motion[0], scratch.clipped, S)
    contact_gradient(run.problem, s, scratch.clipped, motion[1], run.state.entry_rate[s], slope[0], slope[1], slope[2])


@inlined
def ripple_of_stop(run, s, alias):
    """Error of a stop's indentation between the nodes by fast blocks, m; see `ripple_of`."""
    row, x = row_of(run.problem, s), swing_of(run)
    ripple = ripple_of(run, x, row, alias)
    return ripple + ripple_of(run, x, row + 1, alias) if is_circle(run.problem, s) else ripple


@inner
def note_swing(run):
    """Write what oscillates in the state, without what follows the sampled signals, into ``scratch.swing``."""
    split(run.problem, run.state.x, run.scratch.split_state[SWING])
    take_off_following(run, run.state.now[T])
    join(run.problem, run.scratch.split_state[SWING], run.scratch.swing)


@merged
def swing_of(run):
    """(2N,) what oscillates in the state at the start of the step."""
    return run.scratch.swing if run.tables.follows > 0.0 else run.state.x


@inner
def ripple_of(run, x, r, alias):
    """Bound, m, of the error of row r's displacement between the nodes, by fast blocks that oscillate by x, (2N,)."""
    return _sum_of_swings(run.tables.ripple_weight[r], alias, x, run.problem.k.size)


@inner
def rate_ripple_of(run, x, r, alias):
    """The same of its rate, m/s."""
    return _sum_of_swings(run.tables.rate_ripple_weight[r], alias, x, run.problem.k.size)


@reordered
def force_ripple_of(run, x, r, alias, stiffness, damping):
    """The same of a force, N, with these slopes by the displacement and its rate."""
    weight, rate_weight, n = run.tables.ripple_weight[r], run.tables.rate_ripple_weight[r], run.problem.k.size
    error = 0.0
    for b in range(n):
        slope = stiffness * weight[b] + damping * rate_weight[b]
        error += slope * (alias[b] * abs(x[b]) + alias[n + b] * abs(x[n + b]))
    return error


@reordered
def _take_off_following(x, rows, derivatives, per_h, out):
    """Write x less what follows a force with the ``derivatives`` F⁽ⁱ⁾ hⁱ into ``out``; see `tables.following`."""
    f0, f1, f2, f3 = derivatives[0], derivatives[1], derivatives[2], derivatives[3]
    f1, f2, f3 = f1 * per_h, f2 * per_h**2, f3 * per_h**3
    for i in range(out.size):
        out[i] = x[i] - (f0 * rows[0, i] + f1 * rows[1, i] + f2 * rows[2, i] + f3 * rows[3, i])


@inner
def note_oscillation(run, level):
    """Write what oscillates on the step tried, with smooth nodes, into ``scratch.oscillation``, if it is not there yet.

    The blocks respond to forces that are polynomials by a polynomial of the same degree, which the nodes hold exactly,
    and by an oscillation: what the state at the start has more than that polynomial. Four terms of it are taken off; a
    block that oscillates between the nodes follows the others so little that they may count as oscillation.
    """
    problem, tables, scratch = run.problem, run.tables, run.scratch
    if scratch.is_split[0]:
        return
    x, per_h = swing_of(run), 1.0 / tables.contact_step[level]
    for u in range(problem.gap.size):
        if acts(problem, run.state, u):
            combine(DERIVATIVES, scratch.force[u], S, None, scratch.trial)
            _take_off_following(x, tables.force_following[u], scratch.trial, per_h, scratch.oscillation)
            x = scratch.oscillation
    scratch.is_split[0] = 1


@reordered
def _sum_of_swings(weight, alias, x, n):
    """Σ weight (alias |p| + alias |v|) over the blocks."""
    error = 0.0
    for b in range(n):
        error += weight[b] * (alias[b] * abs(x[b]) + alias[n + b] * abs(x[n + b]))
    return error


@inlined
def node_forces(run, s):
    """Forces of stop s on its rows at the nodes by its law, into ``scratch.law_force``."""
    problem, scratch = run.problem, run.scratch
    if rubs(problem, s):
        rubbing_forces(run, s)
        return
    if is_circle(problem, s):
        radial_forces(run, s)
        return
    motion, force = motion_of(run, s), scratch.law_force[row_of(problem, s)]
    above(motion[0], problem.knots[s, 0], scratch.clipped)
    law_forces(problem, s, S, scratch.clipped, motion[1], run.state.entry_rate[s], force)
    run.state.count[CALLS] += S
