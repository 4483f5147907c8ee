"""What may end a step in contact: borders of the pieces of all stops, open ones included, and bends of their laws.

Between two points of a step δ is taken as the cubic through both values and rates, around the highest node of an open
stop as in `peaks`; such a stop keeps a distance of the ripple too, which fast modes may have between the nodes. With
many stops, one that a bound of |δ̈| keeps from its surface is not looked at further.

A bend is where the law of a stop in contact has a kink that is not at a given indentation: δ̇ = 0 for one that damps on
approach only, F = 0 for one cut where it would pull. Its side is the sign of δ̇, or of the force before it is cut. No
step goes across; one step ends on it.
"""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.dop853_tableau import STAGES, C
from solvers.compiled.kernels import call_force, copy, dot, indentation, inlined, inner
from solvers.compiled.simd import put, spread
from solvers.compiled.state import PEAK_FORCE, T_IN, T, is_open, surface_tolerance
from solvers.compiled.sums import above
from solvers.exponential.contact.blocks import ENTERING, GOING_ON, carry_forces, goes_through_blocks, see
from solvers.exponential.contact.node_response import respond, ripple_of
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.peaks import deepest
from solvers.exponential.flight import energy_norms

RATE, FORCE = 1.0, 2.0  # kinds of bends in Tables.bend; 0 for a law that has none
FREE, TURNED = -1, -2  # of a landing: nothing else happens on the way, or something does that wants shorter steps
_ON = 1e-9  # value, in units of the largest of the step, at which a stop counts as on its bend
_TOGETHER = 1e-6  # part of its way by which a stop may be carried over its bend when another lands
_SAME = 1e-11  # the same for the sign of a node


@inner
def extremum(d, a, slope_a, b, slope_b):
    """Value where the cubic through (0, a) and (d, b) turns; its slopes there have opposite signs."""
    mean = (b - a) / d
    c2 = (3.0 * mean - 2.0 * slope_a - slope_b) / d
    c3 = (slope_a + slope_b - 2.0 * mean) / (d * d)
    root = math.sqrt(max(c2 * c2 - 3.0 * c3 * slope_a, 0.0))
    x = slope_a / (root - c2 if slope_a > 0.0 else -root - c2)
    x = min(max(x, 0.0), d)
    return a + x * (slope_a + x * (c2 + x * c3))


@inlined
def _passes(d, a, slope_a, b, slope_b, lower, upper):
    """Whether δ leaves [lower, upper] before the second point or at it."""
    if not lower <= b <= upper:
        return True
    if slope_a > 0.0 > slope_b:
        return extremum(d, a, slope_a, b, slope_b) > upper
    if slope_a < 0.0 < slope_b:
        return extremum(d, a, slope_a, b, slope_b) < lower
    return False


@inlined
def _turns(rates, begin, end, up, down):
    """Whether the rate changes its sign upwards or downwards, as asked, between two points of a step."""
    before, found = begin, False
    for i in range(S + 1):
        after = rates[i] if i < S else end
        found |= (up and before < 0.0 < after) or (down and before > 0.0 > after)
        before = after
    return found


@inner
def _passes_between(problem, tables, state, space, family, h, s, lower, upper):
    """Whether δ leaves [lower, upper] between two points of the step or at one."""
    size = 2 * problem.k.size
    t, delta, rate = 0.0, space.seen[s, 0], space.seen[s, 1]
    for i in range(S + 1):
        if i < S:
            after, delta_new, rate_new = h * tables.times[family, i], space.motion[s, 0, i], space.motion[s, 1, i]
        else:
            after, delta_new = h, indentation(problem, s, space.x_new)
            rate_new = dot(problem.read_rate[s], space.x_new, size)
        if _passes(after - t, delta, rate, delta_new, rate_new, lower, upper):
            return True
        t, delta, rate = after, delta_new, rate_new
    return False


@inner
def _bound_rates(problem, tables, state, space, h):
    """Into ``space.m`` bounds of |δ̈| of all stops on a step; forces are taken as twice their largest node value."""
    n, stops = problem.k.size, problem.gap.size
    energy_norms(problem, state.x, space.norms)
    for s in range(stops):
        space.m[s] = 0.0
    for u in range(space.force.shape[0] if problem.table_dt.size else stops):
        if u < stops and state.piece[u] == 0:
            continue
        largest, push = 0.0, problem.push[u] if u < stops else problem.load[u - stops]
        for i in range(S):
            largest = max(largest, 2.0 * abs(space.force[u, i]))
        for b in range(n):
            space.norms[b] += h * largest * math.sqrt(push[n + b] ** 2 + problem.k[b] * push[b] ** 2)
        for s in range(stops):
            direct = tables.mobility[s, u] if u < stops else tables.direct[s, u - stops]
            space.m[s] += largest * abs(direct)
    for s in range(stops):
        space.m[s] += dot(tables.weight[s], space.norms, n)


@inlined
def _stays_away(space, s, h):
    """Whether an open stop cannot be reached on the step; its motion then is taken as what it begins with."""
    delta, rate = space.seen[s, 0], space.seen[s, 1]
    put(space.motion[s, 0], 0, spread(delta))
    put(space.motion[s, 1], 0, spread(rate))
    return delta + h * max(rate, 0.0) + 0.5 * h * h * space.m[s] < 0.0


@inlined
def _watch(problem, tables, state, space, family, level, s, carried):
    """Motion of an open stop at the nodes, by the blocks if there are many; whether forces have been carried there."""
    if not goes_through_blocks(tables):
        respond(problem, tables, state, space, family, level, s)
        return carried
    if not carried:
        carry_forces(problem, tables, state, space, family, level, GOING_ON)
        carry_forces(problem, tables, state, space, family, level, ENTERING)
    see(problem, space, s, problem.gap[s], space.motion[s])
    return True


@inner
def leaves_piece(problem, tables, state, space, family, level):
    """Whether any stop may cross a border of its piece on the step."""
    size, h, carried, through = 2 * problem.k.size, tables.step[level], False, goes_through_blocks(tables)
    if through:
        _bound_rates(problem, tables, state, space, h)
    for s in range(problem.gap.size):
        piece, ripple = state.piece[s], 0.0
        upper, lower = problem.levels[s, piece], -np.inf
        if piece > 0 and problem.levels[s, piece - 1] == -np.inf and upper == np.inf:
            continue
        if piece == 0:
            if through and _stays_away(space, s, h):
                continue
            carried = _watch(problem, tables, state, space, family, level, s, carried)
            ripple = ripple_of(tables.sway[s], tables.alias[tables.kind[family], level], state.x, problem.k.size)
        else:
            lower = problem.levels[s, piece - 1]
        lowest = highest = indentation(problem, s, space.x_new)
        for i in range(S):
            lowest, highest = min(lowest, space.motion[s, 0, i]), max(highest, space.motion[s, 0, i])
        begin, end = space.seen[s, 1], dot(problem.read_rate[s], space.x_new, size)
        turns = _turns(space.motion[s, 1], begin, end, piece > 0, upper < np.inf)
        if not turns and lower <= lowest and highest + ripple <= upper:
            continue
        tolerance = 8.0 * surface_tolerance(problem, s, state.x)
        if not (lower - tolerance <= lowest and highest + ripple <= upper + tolerance):
            return True
        if piece == 0 and deepest(problem, tables, state, space, family, h, s) > upper + tolerance:
            return True
        if _passes_between(problem, tables, state, space, family, h, s, lower - tolerance, upper + tolerance):
            return True
    return False


@inlined
def _sides(problem, tables, state, s, n, delta, rate, out):
    """δ̇ or the force before it is cut, at n points with δ >= 0."""
    if tables.bend[s] == RATE:
        copy(rate, out, n)
    else:
        call_force(tables.uncut[s], n, delta, rate, state.entry_rate[s], tables.uncut_parameters[s], (out,))


@inner
def side_at(problem, tables, state, s, x, batch):
    """δ̇, or the force before it is cut, in the state x."""
    batch[0] = max(indentation(problem, s, x), problem.levels[s, 0])
    batch[1] = dot(problem.read_rate[s], x, 2 * problem.k.size)
    _sides(problem, tables, state, s, 1, batch[0:1], batch[1:2], batch[2:3])
    return batch[2]


@inner
def choose_sides(problem, tables, state, space):
    """On which side of their bends the contacts that begin now are."""
    for s in range(problem.gap.size):
        if tables.bend[s] > 0.0 and state.piece[s] > 0 and state.open[s, T_IN] == state.now[T]:
            space.side[s] = -1.0 if side_at(problem, tables, state, s, state.x, space.trial) < 0.0 else 1.0


@inner
def bend_ahead(problem, tables, state, space, family, level, fresh, rtol):
    """(time after the begin of the step, stop) of the first bend on it; no stop is -1.

    A stop that begins on its bend (``fresh``), or was carried over it, takes the side of the first node; one whose
    rate, or force, stays within the tolerance bends without harm.
    """
    first, stop, h = np.inf, -1, tables.step[level]
    for s in range(problem.gap.size):
        if tables.bend[s] == 0.0 or state.piece[s] == 0:
            continue
        values, begin = space.sides, side_at(problem, tables, state, s, state.x, space.trial)
        above(space.motion[s, 0], problem.levels[s, 0], space.clipped)
        _sides(problem, tables, state, s, S, space.clipped, space.motion[s, 1], values)
        values[S] = side_at(problem, tables, state, s, space.x_new, space.trial)
        largest = abs(begin)
        for i in range(S + 1):
            largest = max(largest, abs(values[i]))
        harmless = 0.01 * rtol * space.scale[s] if tables.bend[s] == RATE else space.accuracy[s]
        if largest <= harmless:
            continue
        on = space.side[s] * begin < 0.0 or (fresh and abs(begin) <= _ON * largest)
        if on and space.side[s] * values[0] < -_SAME * largest:
            space.side[s] = -space.side[s]
        before, t = begin, 0.0
        for i in range(S + 1):
            after = h * tables.times[family, i] if i < S else h
            if space.side[s] * values[i] < -_SAME * largest:
                way = before / (before - values[i]) if space.side[s] * before > 0.0 else 0.0
                if t + way * (after - t) < first:
                    first, stop = t + way * (after - t), s
                    space.sides[S + 1] = largest
                break
            before, t = values[i], after
    return first, stop


@inner
def on_the_way(problem, tables, state, space, stop, bends, w, x):
    """What happens besides the landing of ``stop``, on a bend or not, between the states w and x, which end in times.

    FREE, TURNED, or another stop that has crossed a border of its piece. A peak must lie in another kind of step.
    """
    size, width = 2 * problem.k.size, state.x.size
    d = x[width] - w[width]
    long = d > 4.0 * tables.step[tables.step.size - 1]
    for s in range(problem.gap.size):
        piece, slope_a, slope_b = state.piece[s], 0.0, 0.0
        if s != stop or bends:
            slope_a, slope_b = dot(problem.read_rate[s], w, size), dot(problem.read_rate[s], x, size)
        if s != stop:
            a, b = indentation(problem, s, w), indentation(problem, s, x)
            tolerance = surface_tolerance(problem, s, x)
            upper = problem.levels[s, piece] + tolerance
            lower = problem.levels[s, piece - 1] - tolerance if piece > 0 else -np.inf
            if not lower <= b <= upper:
                return s
            if long and _passes(d, a, slope_a, b, slope_b, lower, upper):
                return TURNED
        if not long or piece == 0 or is_open(problem, s):
            continue
        if problem.levels[s, 0] < 0.0:  # no contact of the log but where the law opens
            if problem.opening[s] >= 0 and slope_a > 0.0 and slope_b < -_TOGETHER * slope_a:
                return TURNED
            continue
        if slope_a > 0.0 > slope_b and (s != stop or tables.bend[s] != RATE):
            return TURNED
        if s != stop and tables.bend[s] > 0.0:
            before = space.side[s] * side_at(problem, tables, state, s, w, space.trial)
            if space.side[s] * side_at(problem, tables, state, s, x, space.trial) < -_TOGETHER * abs(before):
                return TURNED
        if not bends and tables.bend[s] == FORCE and _pulls_inside(space.work, size + 3 + 2 * s, width):
            return TURNED
        if _force_turns(space.work, size + 3 + 2 * s, width, state.open[s, PEAK_FORCE]):
            return TURNED
    return FREE


@inlined
def _force_turns(work, column, width, known):
    """Whether a force, the impulse's rate over that of time, has a maximum above ``known`` inside a landing."""
    if work[0, column] / work[0, width] < 0.5 * known:  # such steps are short for every contact
        return False
    last, highest = STAGES - 1 if work[STAGES - 1, width] != 0.0 else STAGES - 2, known
    for i in range(1, last):
        if work[i, column] / work[i, width] > highest:
            highest = work[i, column] / work[i, width]
    ends = max(work[0, column] / work[0, width], work[last, column] / work[last, width])
    if max(highest, ends) <= known:
        return False
    return highest > ends or _turns_at(work, column, width, 0, 1, 2) or _turns_at(work, column, width, 8, 10, last)


@inlined
def _pulls_inside(work, column, width):
    """Whether a law would pull at an inner stage of a landing."""
    pulls = False
    for i in range(1, STAGES - 1):
        pulls |= work[i, column] / work[i, width] < 0.0
    return pulls


@inlined
def _turns_at(work, column, width, i, j, k):
    """Whether the parabola through a force at three stages has its maximum between them."""
    a, b, c = work[i, column] / work[i, width], work[j, column] / work[j, width], work[k, column] / work[k, width]
    rise, fall = (b - a) / (C[j] - C[i]), (c - b) / (C[k] - C[j])
    bend = (fall - rise) / (C[k] - C[i])
    return bend < 0.0 and rise - bend * (C[j] - C[i]) > 0.0 > fall + bend * (C[k] - C[j])
