"""Arrays of a problem, calls of contact laws, signals, and the right-hand side of the equations of motion.

The state is x = [p (n), v (n), energy balance (2 + 2E + 3F)], with b the push and r the read row of a stop:

    p' = v + b^p·F,   v' = -k p - c v + b^v·F + l·s(t),   δ_s = r_s·[p, v] - g_s

Two ranges of indices: *elements* s, E in number, are the stops and whatever else exerts forces; they have laws and what
these latch. *Rows* r, R in number, are the coordinates on which elements act; they have vectors and motion. Element s
has the rows from ``first[s]`` to before ``first[s + 1]``. On a line, the indentation is the displacement on the first
of them, where the force pushes. The first two rows of a circular clearance, which has a ``radius`` c, read the vector u
from the place to the centre, r = |u|:

    δ = r - c,  δ̇ = u·u̇/r,  force on the rows N u/r;    of an outer one, where c is kept negative: δ = |c| - r, -N u/r

Sampled signals j have a range of their own, each with a table of its nodes; ``table_load[j]`` is the load it drives.

The entries of the energy balance are the integrals of input power and damping power, then for every stop of force ×
indentation rate (work done on the stop, J) and of force (impulse, N s). Then come three for each element with friction:
the integrals of F_t ξ̇ (J), of F_t (N s), and the path of its slider (m), ∫ σξ̇ dt in slip corrected by the change of
the spring's stretch.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from solvers.compiled.decorators import entry as entry  # re-exported for files of kernels
from solvers.compiled.decorators import inlined, inner, kernel, reordered
from solvers.compiled.decorators import merged as merged
from solvers.compiled.fields import packed_type
from solvers.compiled.friction import friction_force, slip_sign, xi_and_rate_of, xi_of, xi_rate_of
from solvers.compiled.packed import PackedType
from solvers.compiled.parts import RADIAL_ACCELERATION, RADIAL_MOTION, RADIAL_PUSH, part
from solvers.compiled.shortcuts import known_by_type
from solvers.compiled.simd import WIDTH, load8, splat8, store8
from solvers.problem.friction import ACCOUNTS, ARM, CODE, STICK


class Problem(NamedTuple):
    """Arrays that kernels read; in `parameters` they write what laws latch, and what sliders hold.

    `state.problem_of` fills them, in SI units.
    z = [p, v] are block coordinates, for mass-normalised modes in √kg m and √kg m/s.
    """

    k: Annotated[Any, "N"]  # block stiffness, 1/s²
    c: Annotated[Any, "N"]  # block damping, 1/s
    loss: Annotated[Any, "2*N, 2*N"]  # damping power zᵀ loss z in W, or (0, 0): then the power is Σ c v²
    push: Annotated[Any, "R, 2*N"]  # state rate per newton on a row
    read: Annotated[Any, "R, 2*N"]  # displacement = read·z - gap, m
    read_rate: Annotated[Any, "R, 2*N"]  # its rate = read_rate·z, m/s
    gap: Annotated[Any, "R"]  # m; minus the centre's coordinates on the rows of a circle
    radius: Annotated[Any, "C"]  # m, (E,) of circular clearances, negative of outer ones, 0 on lines; or none at all
    friction: Annotated[Any, "int F, 2"]  # (E, 2) place of a slider in parameters, or 0, and in x; or none at all
    first: Annotated[Any, "int E+1"]  # first row of each element, and the end
    element: Annotated[Any, "int R"]  # that each row belongs to
    own: Annotated[Any, "int E"]  # place of an element's δ: its first row, or behind all rows that of a circle
    knots: Annotated[Any, "E, J"]  # m, between two segments, ascending: 0 (-inf if it always acts), knots, inf
    law: Annotated[Any, "int E"]  # addresses of the compiled forces
    gradient: Annotated[Any, "int E"]  # addresses of their derivatives
    parameters: Annotated[Any, "E, P"]  # of the laws; the run's own if numbers latched are among them
    floor: Annotated[Any, "E"]  # smallest entry rates, m/s
    borders: Annotated[Any, "int E"]  # addresses of the margins of laws with memory, 0 for others
    renewal: Annotated[Any, "int E"]  # addresses of what they latch on a border
    border_count: Annotated[Any, "int E"]  # how many borders
    latched: Annotated[Any, "int E, l"]  # places of the latched numbers among the parameters, padded by -1
    by_latched: Annotated[Any, "int E"]  # addresses of the forces' derivatives by them
    by_renewal: Annotated[Any, "int E"]  # addresses of the derivatives of what is latched on a border
    opening: Annotated[Any, "int E"]  # place in parameters of a segment's code, 0 while the law is open; or -1
    load: Annotated[Any, "L, 2*N"]  # state rate per unit of signal l
    power: Annotated[Any, "L, 2*N"]  # input power = signal × power·z, W
    tone_omega: Annotated[Any, "K"]  # rad/s
    tone_amplitude: Annotated[Any, "complex K"]  # complex, a of Re a e^{iωt}
    tone_load: Annotated[Any, "int K"]  # the load each drives
    table: Annotated[Any, "rows, sides"]  # [s, s', s''] at the nodes of all sampled signals, see `problem.signals`
    table_dt: Annotated[Any, "tables"]  # s
    table_start: Annotated[Any, "int tables+1"]  # first row of each, and the end
    table_load: Annotated[Any, "int tables"]  # the load each drives
    parts: Annotated[Any, "int parts"]  # addresses of what is compiled by itself, 0 where it is not; see `parts`


class PlanarProblem(Problem):
    """The same where an element has several rows, so that its contact is a circle or has friction.

    It is another type to the compiler: code for a `Problem` has nothing of these.
    """

    __slots__ = ()


REAL = types.float64
VECTOR = types.Array(REAL, 1, "C")
MATRIX = types.Array(REAL, 2, "C")
INTEGERS = types.Array(types.int64, 1, "C")
PROBLEM, PLANAR_PROBLEM = packed_type(Problem), packed_type(PlanarProblem)


def type_of(problem: Problem) -> types.NamedTuple:
    """The compiler's type of a problem."""
    return PLANAR_PROBLEM if isinstance(problem, PlanarProblem) else PROBLEM


def _planar(kind):
    """Whether a type of the compiler is that of a `PlanarProblem`; None before types are known."""
    kind = kind.kind if isinstance(kind, PackedType) else kind
    return issubclass(kind.instance_class, PlanarProblem) if isinstance(kind, types.NamedTuple) else None


def _never_on_lines(kind):
    """What is known of something that only a `PlanarProblem` has."""
    return None if _planar(kind) is not False else False


@known_by_type(_planar)
@intrinsic
def is_planar(typingctx, problem):
    """Whether a problem is a `PlanarProblem`; a constant of the compiled code."""
    planar = _planar(problem)
    return types.boolean(problem), lambda context, *_: context.get_constant(types.boolean, planar)


def _c_function(outputs):
    """An intrinsic that calls the C function of a law at an address, with pointers to the arrays' numbers."""

    @intrinsic
    def call(typingctx, address, n, delta, delta_dot, entry_rate, parameters, results):
        signature = types.void(types.int64, types.int64, delta, delta_dot, types.float64, parameters, results)

        def codegen(context, builder, sig, args):
            def data(kind, value):
                return context.make_array(kind)(context, builder, value).data

            tuple_type = sig.args[6]
            arrays = [builder.extract_value(args[6], i) for i in range(outputs)]
            out = [data(tuple_type[i], array) for i, array in enumerate(arrays)]
            real, reals = ir.DoubleType(), ir.DoubleType().as_pointer()
            declared = ir.FunctionType(ir.VoidType(), [ir.IntType(64), reals, reals, real, reals, *[reals] * outputs])
            function = builder.inttoptr(args[0], declared.as_pointer())
            known = [data(sig.args[i], args[i]) for i in (2, 3, 5)]
            builder.call(function, [args[1], known[0], known[1], args[4], known[2], *out])
            return context.get_dummy_value()

        return signature, codegen

    return call


@intrinsic
def call_renewal(typingctx, address, border, delta, delta_dot, entry_rate, parameters):
    """Call a law's C function that latches numbers on a border, at an address; returns the code of the event."""
    known = [types.int64, types.int64, types.float64, types.float64, types.float64]
    signature = types.int64(*known, parameters)

    def codegen(context, builder, sig, args):
        real, long = ir.DoubleType(), ir.IntType(64)
        declared = ir.FunctionType(long, [long, real, real, real, real.as_pointer()])
        data = context.make_array(sig.args[5])(context, builder, args[5]).data
        return builder.call(builder.inttoptr(args[0], declared.as_pointer()), [*args[1:5], data])

    return signature, codegen


@intrinsic
def call_renewal_gradient(typingctx, address, border, delta, delta_dot, entry_rate, parameters, out):
    """Call a law's C function for the derivatives of what it latches on a border, at an address."""
    known = [types.int64, types.int64, types.float64, types.float64, types.float64]
    signature = types.void(*known, parameters, out)

    def codegen(context, builder, sig, args):
        real, long = ir.DoubleType(), ir.IntType(64)
        reals = real.as_pointer()
        declared = ir.FunctionType(ir.VoidType(), [long, real, real, real, reals, reals])
        data = [context.make_array(sig.args[i])(context, builder, args[i]).data for i in (5, 6)]
        builder.call(builder.inttoptr(args[0], declared.as_pointer()), [*args[1:5], *data])
        return context.get_dummy_value()

    return signature, codegen


_DELTA_ROUNDING = 1e-14  # rounding of an indentation, in units of its gap
_ON_KNOT = 1e-11  # distance from a knot, in units of its δ, up to which laws count as on it, see `contacts.kernels`

call_force = _c_function(1)
call_gradient = _c_function(3)


@inlined
def contact_forces(problem, stop, delta, delta_dot, entry_rate, force):
    """Forces, N, of one stop at ``delta.size`` indentations and rates; ``delta`` below its surface is raised to it."""
    for i in range(delta.size):
        delta[i] = max(delta[i], problem.knots[stop, 0])
    law_forces(problem, stop, delta.size, delta, delta_dot, entry_rate, force)


@inlined
def force_at(problem, s, delta, delta_dot, entry_rate, batch):
    """Force of one stop, N; ``batch`` is left with δ, raised to the surface, δ̇ and the force."""
    batch[0], batch[1] = delta, delta_dot
    contact_forces(problem, s, batch[0:1], batch[1:2], entry_rate, batch[2:3])
    return batch[2]


@inlined
def off_knots(problem, stop, segment, delta):
    """δ, but for a knot, up to rounding, a point beside it in the segment: the force may jump at the knot."""
    lower, upper = problem.knots[stop, segment - 1], problem.knots[stop, segment]
    rounding = _DELTA_ROUNDING * abs(problem.gap[row_of(problem, stop)])
    if lower > 0.0 and abs(delta - lower) <= rounding + _ON_KNOT * lower:
        return lower * (1.0 + 2.0 * _ON_KNOT)
    if upper < np.inf and abs(delta - upper) <= rounding + _ON_KNOT * upper:
        return upper * (1.0 - 2.0 * _ON_KNOT)
    return delta


@inlined
def law_forces(problem, stop, n, delta, delta_dot, entry_rate, force):
    """Forces of one stop at the first n indentations, none of which is below its surface."""
    call_force(problem.law[stop], n, delta, delta_dot, entry_rate, problem.parameters[stop], (force,))


@inner
def contact_gradient(problem, stop, delta, delta_dot, entry_rate, by_delta, by_rate, by_entry):
    """Derivatives of the forces by δ, δ̇ and entry rate; ``delta`` below the surface is raised to it."""
    for i in range(delta.size):
        delta[i] = max(delta[i], problem.knots[stop, 0])
    results = (by_delta, by_rate, by_entry)
    call_gradient(problem.gradient[stop], delta.size, delta, delta_dot, entry_rate, problem.parameters[stop], results)


@inlined
def copy(source, target, n):
    """Copy the first n entries; a slice assignment would allocate."""
    for i in range(n):
        target[i] = source[i]


@inlined
def raised(x, exponent):
    """X to the power of a whole number given as a float, usually 0 to 4."""
    result = 1.0
    for _ in range(int(exponent)):
        result *= x
    return result


@reordered
def dot(a, b, n):
    """Sum of the first n products."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@reordered
def abs_dot(a, b, n):
    """Sum of the absolute values of the first n products."""
    total = 0.0
    for i in range(n):
        total += abs(a[i] * b[i])
    return total


@inlined
def at_end(problem):
    """Column of the node tables from which on a row has s, s', s'' of the cell that ends there."""
    return problem.table.shape[1] - 3


@inlined
def cell_ends(problem, row):
    """[s, s', s''] at the start and at the end of the cell that begins with a row of the node tables."""
    return problem.table[row], problem.table[row + 1, at_end(problem) :]


@inlined
def bends_at(problem, row):
    """Whether slope or curvature of a sampled signal jump at a row of the node tables."""
    both, e = problem.table[row], at_end(problem)
    return both[1] != both[e + 1] or both[2] != both[e + 2]


@inlined
def quintic(problem, j, cell):
    """Coefficients of the quintic of node table j on a cell, in powers of (t - start)/dt."""
    dt = problem.table_dt[j]
    row, e = problem.table_start[j] + cell, at_end(problem)
    a, b = problem.table[row], problem.table[row + 1]
    s1, s2 = a[1] * dt, 0.5 * a[2] * dt * dt
    e0 = b[e] - a[0] - s1 - s2
    e1 = b[e + 1] * dt - s1 - 2.0 * s2
    e2 = 0.5 * b[e + 2] * dt * dt - s2
    return a[0], s1, s2, 10.0 * e0 - 4.0 * e1 + e2, -15.0 * e0 + 7.0 * e1 - 2.0 * e2, 6.0 * e0 - 3.0 * e1 + e2


@inner
def table_value(problem, j, t):
    """Quintic Hermite value of node table j at time t."""
    dt, cells = problem.table_dt[j], problem.table_start[j + 1] - problem.table_start[j] - 1
    cell = min(max(int(t / dt), 0), cells - 1)
    x, (s0, s1, s2, s3, s4, s5) = t / dt - cell, quintic(problem, j, cell)
    return s0 + x * (s1 + x * (s2 + x * (s3 + x * (s4 + x * s5))))


@inner
def add_loads(problem, t, x, rate):
    """Add all loads at time t to the state's rate, and their power to the rate of the energy balance."""
    size = 2 * problem.k.size
    for i in range(problem.tone_omega.size):
        angle = problem.tone_omega[i] * t
        a = problem.tone_amplitude[i]
        value = a.real * np.cos(angle) - a.imag * np.sin(angle)
        _add_load(problem, problem.tone_load[i], value, size, x, rate)
    for j in range(problem.table_dt.size):
        _add_load(problem, problem.table_load[j], table_value(problem, j, t), size, x, rate)


@inner
def _add_load(problem, load, value, size, x, rate):
    """Add the load of a signal with a given value, and its power."""
    for i in range(size):
        rate[i] += problem.load[load, i] * value
    rate[size] += value * dot(problem.power[load], x, size)


@inlined
def _damping_power(problem, x):
    """Power dissipated by the linear damping, W."""
    n, power = problem.k.size, 0.0
    if problem.loss.shape[0] == 0:
        for i in range(n):
            power += problem.c[i] * x[n + i] ** 2
        return power
    for i in range(2 * n):
        power += x[i] * dot(problem.loss[i], x, 2 * n)
    return power


@kernel
def rhs(problem, t, x, segment, entry_rate, rate, batch):
    """Write x' into ``rate`` with every stop on its ``segment`` (> 0: in contact); returns the number of law calls.

    ``batch`` is scratch for three numbers.
    """
    n, calls = problem.k.size, 0
    size = 2 * n
    for i in range(n):
        rate[i] = x[n + i]
        rate[n + i] = -problem.k[i] * x[i] - problem.c[i] * x[n + i]
    rate[size] = 0.0
    rate[size + 1] = _damping_power(problem, x)
    add_loads(problem, t, x, rate)
    for s in range(problem.law.size):
        work = work_column(problem, s)
        rate[work], rate[work + 1] = 0.0, 0.0
        if rubs(problem, s):
            calls += _add_element_with_friction(problem, s, t, segment[s], entry_rate[s], x, rate, batch)
        elif segment[s] > 0:
            delta, delta_dot = indentation_and_rate(problem, s, x)
            delta = off_knots(problem, s, segment[s], delta)
            force = force_at(problem, s, delta, delta_dot, entry_rate[s], batch)
            add_push(problem, s, force, x, rate)
            rate[work], rate[work + 1] = force * delta_dot, force
            calls += 1
    return calls


@inner
def _add_element_with_friction(problem, s, t, segment, entry_rate, x, rate, batch):
    """Add the forces of an element with friction to the state's rate, and their power; number of law calls."""
    if segment == 0:
        no_friction(problem, s, rate)
        return 0
    rows, work = rows_at(problem, s, x), work_column(problem, s)
    delta, delta_dot = delta_of(radius_of(problem, s), rows)
    normal = force_at(problem, s, off_knots(problem, s, segment, delta), delta_dot, entry_rate, batch)
    add_friction(problem, s, t, rows, normal, rate)
    rate[work], rate[work + 1] = normal * delta_dot, normal
    return 1


@inlined
def width_of(problem):
    """Length of a state: blocks, energy balance, friction."""
    width = 2 * problem.k.size + 2 + 2 * problem.law.size
    if is_planar(problem):
        for s in range(problem.friction.shape[0]):
            if problem.friction[s, 0] > 0:
                width = problem.friction[s, 1] + ACCOUNTS
    return width


@inlined
def work_column(problem, s):
    """Place of the work of element s in a state; that of its impulse is the next one."""
    return 2 * problem.k.size + 2 + 2 * s


@inlined
def row_of(problem, s):
    """First row of an element: its own index if all have one row."""
    return problem.first[s] if is_planar(problem) else s


@inlined
def element_of(problem, r):
    """The element a row belongs to."""
    return problem.element[r] if is_planar(problem) else r


@inlined
def place_of(problem, s):
    """Index of an element's δ and force in arrays at the nodes, see `Problem.own`."""
    return problem.own[s] if is_planar(problem) else s


@known_by_type(_never_on_lines)
@inlined
def rubs(problem, s):
    """Whether a stop has friction."""
    return is_planar(problem) and problem.friction.shape[0] > 0 and problem.friction[s, 0] > 0


@merged
def slider_of(problem, s):
    """The numbers of a slider among the element's parameters, see `problem.friction`."""
    return problem.parameters[s, problem.friction[s, 0] :]


@reordered
def plane_motion(problem, r, x):
    """Motion u, u̇, w, ẇ of row r and of the next one; in one loop, as four sums by themselves take twice as long."""
    u, u_dot, w, w_dot = -problem.gap[r], 0.0, -problem.gap[r + 1], 0.0
    for i in range(2 * problem.k.size):
        u += problem.read[r, i] * x[i]
        u_dot += problem.read_rate[r, i] * x[i]
        w += problem.read[r + 1, i] * x[i]
        w_dot += problem.read_rate[r + 1, i] * x[i]
    return u, u_dot, w, w_dot


@inner
def rows_at(problem, s, x):
    """Motion of the rows of an element with friction: u, u̇, w, ẇ, and of a third row with its sign changed, else 0."""
    first, size, turned, turning = row_of(problem, s), 2 * problem.k.size, 0.0, 0.0
    u, u_dot, w, w_dot = plane_motion(problem, first, x)
    if first + 2 < row_of(problem, s + 1):
        turned, turning = -dot(problem.read[first + 2], x, size), -dot(problem.read_rate[first + 2], x, size)
    return u, u_dot, w, w_dot, turned, turning


@inlined
def delta_of(radius, rows):
    """δ and δ̇ from the motion of the rows."""
    u, u_dot, w, w_dot, _, _ = rows
    if radius == 0.0:
        return u, u_dot
    return radial(u * u + w * w, u * u_dot + w * w_dot, u_dot * u_dot + w_dot * w_dot, radius)


@inner
def xi_and_rate_at(problem, s, t, x):
    """ξ and ξ̇ of a stop with friction in a state."""
    u, u_dot, w, w_dot, turned, turning = rows_at(problem, s, x)
    return xi_and_rate_of(radius_of(problem, s), slider_of(problem, s), t, u, u_dot, w, w_dot, turned, turning)


@inner
def angle_of(problem, s, x):
    """Angle, rad, from the centre of a circle to the place; NaN of a stop on a line."""
    if not is_circle(problem, s):
        return math.nan
    first, size = row_of(problem, s), 2 * problem.k.size
    u = dot(problem.read[first], x, size) - problem.gap[first]
    w = dot(problem.read[first + 1], x, size) - problem.gap[first + 1]
    return math.atan2(-w, -u)


@inlined
def accelerations_at(problem, s, rate):
    """ü, ẅ and the second derivative of the third row with its sign changed, from the state's rate; see `rows_at`."""
    first, size, turning = row_of(problem, s), 2 * problem.k.size, 0.0
    u_twice, w_twice = dot(problem.read_rate[first], rate, size), dot(problem.read_rate[first + 1], rate, size)
    if first + 2 < row_of(problem, s + 1):
        turning = -dot(problem.read_rate[first + 2], rate, size)
    return u_twice, w_twice, turning


@inlined
def no_friction(problem, s, rate):
    """Set the rates of a slider's three integrals to zero."""
    account = problem.friction[s, 1]
    rate[account], rate[account + 1], rate[account + 2] = 0.0, 0.0, 0.0


@inner
def add_friction(problem, s, t, rows, normal, rate):
    """Add N and F_t of a stop in contact to the state's rate, and what its slider's integrals grow by."""
    u, u_dot, w, w_dot, turned, turning = rows
    slider, radius, account = slider_of(problem, s), radius_of(problem, s), problem.friction[s, 1]
    xi = xi_of(radius, slider, t, u, w, turned) if slider[CODE] == STICK else 0.0
    xi_rate, force = xi_rate_of(radius, slider, u, u_dot, w, w_dot, turning), friction_force(radius, slider, xi, normal)
    _add_to_rows(problem, s, u, w, normal, force, rate)
    rate[account], rate[account + 1], rate[account + 2] = force * xi_rate, force, slip_sign(slider) * xi_rate


@inlined
def _add_rows(rate, first, first_force, second, second_force, size):
    """Add two rows of numbers, each times a force, to the state's rate."""
    one, two, whole = splat8(first_force), splat8(second_force), size - size % WIDTH
    for i in range(0, whole, WIDTH):
        store8(rate, i, load8(rate, i) + one * load8(first, i) + two * load8(second, i))
    for i in range(whole, size):
        rate[i] += first_force * first[i] + second_force * second[i]


@inlined
def _add_to_rows(problem, s, u, w, normal, tangential, rate):
    """Add N and F_t of a stop with friction, whose first two rows are at u and w, to the state's rate."""
    first, size, radius = row_of(problem, s), 2 * problem.k.size, radius_of(problem, s)
    push, first_force, second_force = problem.push, normal, -tangential
    if radius != 0.0:
        square = u * u + w * w
        share_t, share_n = tangential * abs(radius) / square, math.copysign(normal, normal * radius) / math.sqrt(square)
        first_force, second_force = share_n * u - share_t * w, share_n * w + share_t * u
    _add_rows(rate, push[first], first_force, push[first + 1], second_force, size)
    if radius != 0.0 and first + 2 < row_of(problem, s + 1):
        third_force = math.copysign(1.0, slider_of(problem, s)[ARM]) * tangential
        for i in range(size):
            rate[i] -= push[first + 2, i] * third_force


@inner
def add_tangential(problem, s, force, x, rate):
    """Add a tangential force F_t of stop s to the state's rate."""
    u, _, w, _, _, _ = rows_at(problem, s, x)
    _add_to_rows(problem, s, u, w, 0.0, force, rate)


@known_by_type(_never_on_lines)
@inlined
def is_circle(problem, s):
    """Whether a stop is a circular clearance."""
    return is_planar(problem) and problem.radius.size > 0 and problem.radius[s] != 0.0


@inlined
def radius_of(problem, s):
    """Radius of a stop as in `Problem`; 0 of a stop on a line."""
    return problem.radius[s] if problem.radius.size > 0 else 0.0


@inlined
def indentation(problem, s, x):
    """Indentation of stop s, m."""
    if is_circle(problem, s):
        return radial_motion(problem, s, x)[0]
    row = row_of(problem, s)
    return dot(problem.read[row], x, 2 * problem.k.size) - problem.gap[row]


@inlined
def indentation_rate(problem, s, x):
    """Indentation rate of stop s, m/s."""
    if is_circle(problem, s):
        return radial_motion(problem, s, x)[1]
    return dot(problem.read_rate[row_of(problem, s)], x, 2 * problem.k.size)


@inlined
def indentation_and_rate(problem, s, x):
    """(δ, δ̇) of stop s; of a circle for the cost of one."""
    if is_circle(problem, s):
        return radial_motion(problem, s, x)
    row, size = row_of(problem, s), 2 * problem.k.size
    return dot(problem.read[row], x, size) - problem.gap[row], dot(problem.read_rate[row], x, size)


@inner
def surface_tolerance(problem, s, x):
    """Distance, m, from a knot up to which a stop counts as on it: rounding of δ."""
    row = row_of(problem, s)
    size = abs(problem.gap[row]) + abs_dot(problem.read[row], x, 2 * problem.k.size)
    if is_circle(problem, s):
        size += abs(problem.radius[s]) + abs(problem.gap[row + 1])
        size += abs_dot(problem.read[row + 1], x, 2 * problem.k.size)
    return 1e-15 * size + 1e-20


@part(RADIAL_MOTION, types.UniTuple(REAL, 2), types.int64, VECTOR)
def radial_motion(problem, s, x):
    """(δ, m, δ̇, m/s) of a circular clearance; at the centre δ̇ is that of going outward."""
    u, u_dot, w, w_dot = plane_motion(problem, row_of(problem, s), x)
    return radial(u * u + w * w, u * u_dot + w * w_dot, u_dot * u_dot + w_dot * w_dot, problem.radius[s])


@inlined
def radial(square, product, speed, radius):
    """δ and δ̇ of a circle from u·u, u·u̇ and u̇·u̇."""
    distance = math.sqrt(square)
    rate = product / distance if distance > 0.0 else math.sqrt(speed)
    return (distance - radius, rate) if radius > 0.0 else (-radius - distance, -rate)


@inlined
def radial_acceleration(radius, u, u_dot, u_twice, w, w_dot, w_twice):
    """δ̈ from the motion of the first two rows; of a stop on a line from the first."""
    if radius == 0.0:
        return u_twice
    square, product = u * u + w * w, u * u_dot + w * w_dot
    along = u_dot * u_dot + w_dot * w_dot + u * u_twice + w * w_twice
    found = (along - product * product / square) / math.sqrt(square)
    return found if radius > 0.0 else -found


@part(RADIAL_ACCELERATION, REAL, types.int64, VECTOR, VECTOR)
def _radial_acceleration(problem, s, x, rate):
    """δ̈ = ±(u̇·u̇ + u·ü - ṙ²)/r of a circular clearance."""
    first, size = row_of(problem, s), 2 * problem.k.size
    u, u_dot, w, w_dot = plane_motion(problem, first, x)
    u_twice, w_twice = dot(problem.read_rate[first], rate, size), dot(problem.read_rate[first + 1], rate, size)
    return radial_acceleration(problem.radius[s], u, u_dot, u_twice, w, w_dot, w_twice)


@part(RADIAL_PUSH, types.void, types.int64, REAL, VECTOR, VECTOR)
def _add_radial_push(problem, s, force, x, rate):
    """Add a radial force to the state's rate."""
    square, first, size = 0.0, row_of(problem, s), 2 * problem.k.size
    for r in range(first, first + 2):
        square += (dot(problem.read[r], x, size) - problem.gap[r]) ** 2
    share = (force if problem.radius[s] > 0.0 else -force) / math.sqrt(square)
    for r in range(first, first + 2):
        part = share * (dot(problem.read[r], x, size) - problem.gap[r])
        for i in range(size):
            rate[i] += problem.push[r, i] * part


@inlined
def acceleration_of(problem, s, x, rate):
    """Second derivative of the indentation by time, m/s², from the state and its rate."""
    if is_circle(problem, s):
        return _radial_acceleration(problem, s, x, rate)
    return dot(problem.read_rate[row_of(problem, s)], rate, 2 * problem.k.size)


@inlined
def add_push(problem, s, force, x, rate):
    """Add a force of stop s along its indentation to the state's rate."""
    if is_circle(problem, s):
        _add_radial_push(problem, s, force, x, rate)
        return
    push = problem.push[row_of(problem, s)]
    for i in range(2 * problem.k.size):
        rate[i] += push[i] * force


@merged
def push_of(problem, u):
    """State rate per unit of an input: of a row's force, or with indices behind the rows of a load's signal."""
    return problem.push[u] if u < problem.gap.size else problem.load[u - problem.gap.size]
