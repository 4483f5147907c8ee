"""Powers of loads and damping; state and energy balance inside a contact step, from the forces at its nodes.

With x = E(t) y a block's equation is y' = E(-t) Σ push F. Gauss's collocation solves it, in panels of at most
`_PANEL_RADIANS`, or `_FINE_RADIANS`, of the fastest block: y at a panel's points is y₀ + Σ_r a_qr y'_r. Work, damping
and impulses are sums over the same points. Such a method conserves quadratic forms: work of contacts and loads less
damping adds up to the energy, even where the velocity of a stop is far from a polynomial through its values at the
nodes.

At the end of a contact step the polynomials of the forces give the rate to h^15, inside to h^9 only. For a sample there
they are replaced, if need be, by the laws' forces for the motion that they give: one iteration of Picard's, which makes
the error some hundred times smaller. It does not converge beside strong dashpots; their forces stay polynomials.
"""

from __future__ import annotations

from numba import types

from solvers.compiled.kernels import (
    REAL,
    VECTOR,
    contact_forces,
    copy,
    dot,
    element_of,
    inlined,
    inner,
    is_circle,
    merged,
    off_knots,
    place_of,
    push_of,
    raised,
    reordered,
    row_of,
    rubs,
    table_value,
    work_column,
)
from solvers.compiled.parts import WITHIN_STEP, part
from solvers.compiled.simd import WIDTH, load8, splat8, store8, sum8
from solvers.compiled.state import CALLS, T, acts
from solvers.compiled.sums import combine
from solvers.exponential.circles.contact import radial_forces, work_within_circle
from solvers.exponential.circles.friction import rubbing_forces, work_within_rubbing
from solvers.exponential.contact.node_response import LANDED, RTOL, next_coefficient
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.step_integrals import is_weighted

_PANEL_RADIANS = 3.0  # up to which the energy of a damped block is off by 5e-11 ζ of its own, and its motion by less
_FINE_RADIANS = 2.0  # the same, 1e-13 ζ, where blocks follow signals: what follows handles much energy all the time
_TERMS, _REACH = 14, 0.4  # of Taylor's series, and its radians of the fastest block: exact to 3e-17
_INSIDE = 0.02  # largest integral of the next polynomial inside a step
_RESOLVED = 0.5  # error of a rate inside a step, in units of its tolerance, up to which polynomials of forces do
_INTEGRALS = 2  # first row of `Tables.gauss` with a_qr, one per r
PACE = S  # row of `Scratch.between` with dt of the panel's points, behind polynomials, before forces


@inner
def powers(run, t, x):
    """(power of the loads, power of the damping) at time t, W."""
    problem, tables = run.problem, run.tables
    size, gain, loss, own = 2 * problem.k.size, 0.0, 0.0, int(tables.own_blocks)
    for load in range(tables.power_rows.shape[0] if own < problem.k.size else 0):
        gain += dot(tables.signal_rows[load], x, size) * dot(tables.power_rows[load], x, size)
    for j in range(problem.table_dt.size):
        gain += table_value(problem, j, t) * dot(tables.power_rows[problem.table_load[j]], x, size)
    if tables.loss_rows.shape[0] > own:  # damping that couples the blocks has a row per coordinate
        for r in range(tables.loss_rows.shape[0]):
            root = dot(tables.loss_rows[r], x, size)
            loss += root * root if r < own else -root * root
    else:
        loss = _plain_loss(problem.k.size, own, problem.c, tables.steady_rate, x)
    return gain, loss


@reordered
def _plain_loss(n, own, c, steady_rate, x):
    """Power of damping, W, of uncoupled blocks whose rate is that of x and of the steady motion under tones."""
    loss, whole, tones = 0.0, own - own % WIDTH, n - own
    losses = splat8(0.0)
    for first in range(0, whole, WIDTH):
        rate = load8(x, n + first)
        for k in range(tones):
            rate += splat8(x[own + k]) * load8(steady_rate[k], first)
            rate += splat8(x[n + own + k]) * load8(steady_rate[tones + k], first)
        losses += load8(c, first) * rate * rate
    for b in range(whole, own):
        rate = x[n + b]
        for k in range(tones):
            rate += x[own + k] * steady_rate[k, b] + x[n + own + k] * steady_rate[tones + k, b]
        loss += c[b] * rate * rate
    return loss + sum8(losses)


@merged
def _panel_points(run, node_set, h, begin, width):
    """Points of a panel: σ into ``trial``, times after its start into ``clipped``, polynomials, dt into ``between``."""
    tables, scratch = run.tables, run.scratch
    time_exponent, between, nodes = tables.time_exponent[node_set], scratch.between, tables.nodes[node_set]
    start = h * raised(begin, time_exponent)
    for q in range(S):
        sigma = begin + width * tables.gauss[0, q]
        pace = h * raised(sigma, time_exponent - 1.0)
        scratch.trial[q], scratch.clipped[q] = sigma, pace * sigma - start
        between[PACE, q] = width * time_exponent * pace
    sigma = load8(scratch.trial, 0)
    for j in range(S):
        product = splat8(1.0)
        for i in range(S):
            if i != j:
                product = product * (sigma - splat8(nodes[i]))
        store8(between[j], 0, product)


@merged
def _forces(run, node_set):
    """Forces and signals at the points of the panel times dt, into ``scratch.between``."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    between = scratch.between
    for u in range(scratch.force.shape[0]):
        if u < problem.gap.size and not acts(problem, run.state, u):
            continue
        weighted = u < problem.gap.size and is_weighted(tables, node_set, element_of(problem, u))
        row = between[PACE + 1 + u]
        scales, value = tables.lagrange[node_set, 1 if weighted else 0], splat8(0.0)
        for j in range(S):
            value += splat8(scales[j] * scratch.force[u, j]) * load8(between[j], 0)
        store8(row, 0, value * load8(between[PACE], 0))
        for q in range(S if weighted else 0):
            row[q] *= scratch.trial[q] ** tables.weight_exponent[node_set]


@merged
def _panel_propagators(run, length):
    """α, β of every block from the start of a panel to its points, back by det E = e^{-ct}, and to its end."""
    problem, scratch = run.problem, run.scratch
    halvings, reach = 0, run.tables.fastest * length
    while reach > _REACH:
        halvings, reach = halvings + 1, 0.5 * reach
    share, powers, last = splat8(0.5**halvings), splat8(1.0), splat8(1.0)
    within, whole = share * load8(scratch.clipped, 0), share * splat8(length)
    for i in range(_TERMS):  # t^i/i!
        store8(scratch.terms[i], 0, powers)
        store8(scratch.terms[i], S, last)
        following = splat8(1.0 / (i + 1.0))
        powers, last = powers * within * following, last * whole * following
    for b in range(problem.k.size):
        out, k, c = scratch.moves[b], splat8(problem.k[b]), splat8(problem.c[b])
        alpha, beta = _propagators(scratch.terms, 0, problem.k[b], problem.c[b], halvings)
        grown = splat8(1.0) / (alpha * alpha - c * alpha * beta + k * beta * beta)
        store8(out[0], 0, alpha)
        store8(out[1], 0, beta)
        store8(out[2], 0, grown * (alpha - c * beta))
        store8(out[3], 0, splat8(0.0) - grown * beta)
        alpha, beta = _propagators(scratch.terms, S, problem.k[b], problem.c[b], halvings)
        out[4, 0], out[4, 1] = 0.125 * sum8(alpha), 0.125 * sum8(beta)  # of eight times that are the same


@inlined
def _propagators(powers, first, k, c, halvings):
    """α, β of a block at eight times: Taylor's series of β and β' from t^i/i!, then E(2t) = E(t)² for every halving."""
    beta, slope, derivative, following = splat8(0.0), splat8(0.0), 0.0, 1.0
    for i in range(_TERMS):
        power = load8(powers[i], first)
        beta += splat8(derivative) * power
        slope += splat8(following) * power
        derivative, following = following, -c * following - k * derivative
    alpha = slope + splat8(c) * beta
    for _ in range(halvings):
        alpha, beta = alpha * alpha - splat8(k) * beta * beta, beta * (alpha + alpha - splat8(c) * beta)
    return alpha, beta


@merged
def _pull_back(run, b, moves):
    """Rates of a block at the points, moved back to the panel's start, into ``scratch.trial`` and ``clipped``."""
    problem, scratch = run.problem, run.scratch
    n, p, v = problem.k.size, splat8(0.0), splat8(0.0)
    for u in range(scratch.force.shape[0]):
        if u >= problem.gap.size or acts(problem, run.state, u):
            push = push_of(problem, u)
            force = load8(scratch.between[PACE + 1 + u], 0)
            p += splat8(push[b]) * force
            v += splat8(push[n + b]) * force
    alpha, beta = load8(moves[2], 0), load8(moves[3], 0)
    store8(scratch.trial, 0, alpha * p + beta * v)
    store8(scratch.clipped, 0, alpha * v - beta * (splat8(problem.k[b]) * p + splat8(problem.c[b]) * v))


@merged
def _move_blocks(run, row):
    """Write the blocks at the points of the panel into ``scratch.along``, and move ``row`` to its end."""
    problem, tables, scratch = run.problem, run.tables, run.scratch
    n, gauss, weights = problem.k.size, tables.gauss, load8(tables.gauss[1], 0)
    for b in range(n):
        k, c, moves = problem.k[b], problem.c[b], scratch.moves[b]
        p, v = row[b], row[n + b]
        p_points, v_points = splat8(p), splat8(v)
        if b < tables.own_blocks:
            _pull_back(run, b, moves)
            for r in range(S):
                share = load8(gauss[_INTEGRALS + r], 0)
                p_points += splat8(scratch.trial[r]) * share
                v_points += splat8(scratch.clipped[r]) * share
            p += sum8(weights * load8(scratch.trial, 0))
            v += sum8(weights * load8(scratch.clipped, 0))
        alpha, beta = load8(moves[0], 0), load8(moves[1], 0)
        store8(scratch.along[b], 0, alpha * p_points + beta * v_points)
        store8(scratch.along[n + b], 0, alpha * v_points - beta * (splat8(k) * p_points + splat8(c) * v_points))
        row[b], row[n + b] = moves[4, 0] * p + moves[4, 1] * v, moves[4, 0] * v - moves[4, 1] * (k * p + c * v)


@merged
def _add_works(run, row):
    """Add works and impulses of the contacts over the panel to ``row``."""
    problem, scratch = run.problem, run.scratch
    for s in range(problem.law.size):
        if run.state.segment[s] > 0:
            r = row_of(problem, s)
            if rubs(problem, s):
                account = problem.friction[s, 1]
                work, impulse, friction_work, friction_impulse, slip_distance = work_within_rubbing(run, s, PACE + 1)
                row[account], row[account + 1] = row[account] + friction_work, row[account + 1] + friction_impulse
                row[account + 2] += slip_distance
            elif is_circle(problem, s):
                work, impulse = work_within_circle(run, s, PACE + 1)
            else:
                combine(scratch.along, problem.read_rate[r], 2 * problem.k.size, None, scratch.trial)
                impulses = load8(run.tables.gauss[1], 0) * load8(scratch.between[PACE + 1 + r], 0)
                work, impulse = sum8(impulses * load8(scratch.trial, 0)), sum8(impulses)
            column = work_column(problem, s)
            row[column], row[column + 1] = row[column] + work, row[column + 1] + impulse


@merged
def exchanged_over(run):
    """Work of the loads and damping, J, over a panel: motion at its points, dt there, and the sampled loads times dt.

    They are in ``scratch.along``, row `PACE` of ``between``, and behind its rows of forces.
    """
    tables, scratch = run.tables, run.scratch
    gain, loss = splat8(0.0), splat8(0.0)
    n, own, rows = run.problem.k.size, int(tables.own_blocks), tables.loss_rows
    weights, pace = load8(tables.gauss[1], 0), load8(scratch.between[PACE], 0)
    for load in range(tables.power_rows.shape[0]):
        signal = load8(scratch.between[PACE + 1 + run.problem.gap.size + load], 0)
        if own < n:
            combine(scratch.along, tables.signal_rows[load], 2 * n, None, scratch.trial)
            signal += pace * load8(scratch.trial, 0)
        combine(scratch.along, tables.power_rows[load], 2 * n, None, scratch.trial)
        gain += weights * signal * load8(scratch.trial, 0)
    for r in range(rows.shape[0]):
        if rows.shape[0] > own:  # damping that couples the blocks
            combine(scratch.along, rows[r], 2 * n, None, scratch.trial)
            value = load8(scratch.trial, 0)
        else:
            value = splat8(rows[r, n + r]) * load8(scratch.along[n + r], 0)
            for k in range(own, n):
                value += splat8(rows[r, k]) * load8(scratch.along[k], 0)
                value += splat8(rows[r, n + k]) * load8(scratch.along[n + k], 0)
        loss += splat8(1.0 if r < own else -1.0) * weights * pace * value * value
    return sum8(gain), sum8(loss)


@merged
def hides_motion(run, h):
    """Whether polynomials of the forces may miss an indentation rate inside the step by half its tolerance."""
    problem, scratch = run.problem, run.scratch
    worst = 0.0
    for u in range(problem.gap.size):
        if acts(problem, run.state, u):
            impulse = _INSIDE * h * next_coefficient(scratch.summary[u])
            for r in range(problem.gap.size):
                speed = scratch.reference_speed[element_of(problem, r)]
                worst = max(worst, impulse * abs(run.tables.accelerance[r, u]) / speed)
    return worst > _RESOLVED * scratch.accuracy[RTOL]


@merged
def _motion_at_points(run, r, out):
    """Displacements and rates of a row at the points of the panel, from the motion in ``scratch.along``."""
    problem = run.problem
    combine(run.scratch.along, problem.read[r], 2 * problem.k.size, None, out[0])
    combine(run.scratch.along, problem.read_rate[r], 2 * problem.k.size, None, out[1])
    store8(out[0], 0, load8(out[0], 0) - splat8(problem.gap[r]))


@merged
def _follow_laws(run, node_set, h, begin, width):
    """Forces at the points of the panel times dt by their laws, for the motion that is in ``scratch.along``."""
    problem, state, scratch = run.problem, run.state, run.scratch
    points = scratch.local_motion[:2]  # peaks, which need it, are looked for later
    for s in range(problem.law.size):
        if state.segment[s] == 0 or scratch.viscous[s] > 0.0:
            continue
        r = row_of(problem, s)
        if is_circle(problem, s) or rubs(problem, s):
            _follow_in_plane(run, node_set, h, begin, width, s)
            continue
        _motion_at_points(run, r, points)
        for q in range(S):
            scratch.trial[q] = off_knots(problem, s, state.segment[s], points[0, q])
        copy(points[1], scratch.clipped, S)
        contact_forces(problem, s, scratch.trial, scratch.clipped, state.entry_rate[s], scratch.numbers)
        state.count[CALLS] += S
        store8(scratch.between[PACE + 1 + r], 0, load8(scratch.numbers, 0) * load8(scratch.between[PACE], 0))


@merged
def _follow_in_plane(run, node_set, h, begin, width, s):
    """The same of an element in a plane: its forces are those at the nodes of a step that has the points as nodes."""
    problem, scratch = run.problem, run.scratch
    first, beyond = row_of(problem, s), row_of(problem, s + 1)
    _exchange(run, s, True)
    for r in range(first, beyond):
        _motion_at_points(run, r, scratch.motion[r])
    if rubs(problem, s):
        for q in range(S):
            sigma = begin + width * run.tables.gauss[0, q]
            scratch.node_time[q] = run.state.now[T] + h * raised(sigma, run.tables.time_exponent[node_set])
        rubbing_forces(run, s)
    else:
        radial_forces(run, s)
    for r in range(first, beyond):
        store8(scratch.between[PACE + 1 + r], 0, load8(scratch.law_force[r], 0) * load8(scratch.between[PACE], 0))
    _exchange(run, s, False)


@merged
def _exchange(run, s, keep):
    """Keep what `Scratch` has of an element at the nodes in ``scratch.kept``, or bring it back."""
    problem, scratch = run.problem, run.scratch
    row = 0
    for r in range(row_of(problem, s), row_of(problem, s + 1) + 1):
        at = r if r < row_of(problem, s + 1) else place_of(problem, s)
        for values in (scratch.motion[at, 0], scratch.motion[at, 1], scratch.law_force[at]):
            row = _move_row(scratch, values, row, keep)
    if rubs(problem, s):
        for i in range(4):
            row = _move_row(scratch, scratch.slid[s, i], row, keep)
        _move_row(scratch, scratch.node_time, row, keep)


@inlined
def _move_row(scratch, values, row, keep):
    """Copy eight numbers into a row of ``scratch.kept``, or out of it; returns the next row."""
    if keep:
        copy(values, scratch.kept[row], S)
    else:
        copy(scratch.kept[row], values, S)
    return row + 1


@part(WITHIN_STEP, types.void, types.int64, *[REAL] * 3, VECTOR, types.boolean, types.boolean)
def state_within(run, node_set, h, begin, end, row, ledger, by_laws):
    """Move ``row`` from ``begin`` to ``end``, s after the start of a contact step of length h whose forces are known.

    Works and impulses of the contacts are integrated along; those of loads and damping only with ``ledger``.
    With ``by_laws`` forces follow their laws where they can, see the module.
    """
    time_exponent = run.tables.time_exponent[node_set]
    sigma, last = (begin / h) ** (1.0 / time_exponent), (end / h) ** (1.0 / time_exponent)
    begun = run.scratch.stages[LANDED]  # no landing is under way
    radians, size = _FINE_RADIANS if run.tables.follows > 0.0 else _PANEL_RADIANS, 2 * run.problem.k.size
    panels = 1 + int(time_exponent * run.tables.fastest * (end - begin) / radians)
    width = (last - sigma) / panels
    for i in range(panels):
        _panel_points(run, node_set, h, sigma, width)
        if i == 0 or time_exponent > 1.0:
            length = h * (raised(sigma + width, time_exponent) - raised(sigma, time_exponent))
            _panel_propagators(run, length)
        _forces(run, node_set)
        if by_laws:
            copy(row, begun, size)
        _move_blocks(run, row)
        if by_laws:
            _follow_laws(run, node_set, h, sigma, width)
            copy(begun, row, size)
            _move_blocks(run, row)
        _add_works(run, row)
        if ledger:
            gain, loss = exchanged_over(run)
            row[size], row[size + 1] = row[size] + gain, row[size + 1] + loss
        sigma += width
