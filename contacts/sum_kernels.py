"""Compiled laws in parallel: forces, derivatives and what each part latches, by the addresses of its own kernels.

A law of stops beside one with memory stands behind a gate, open while δ > 0, that latches the rate at entry: parameters
(code, rate at entry, floor, address, address of its derivatives, its own).
"""

from llvmlite import ir
from numba import cfunc, njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from contacts.kernels import GRADIENT, REALS, SIGNATURE, compiled

RENEW = types.int64(types.int64, types.float64, types.float64, types.float64, REALS)
RENEW_GRADIENT = types.void(types.int64, types.float64, types.float64, types.float64, REALS, REALS)
HEAD = 11  # numbers in a sum's parameters before those of each part, these behind its address:
SLOPES, FLOOR, SIZE, BORDERS, RENEWAL, BY_MEMORY, RENEWAL_SLOPES, BORDER_COUNT, LATCHED, EVENTS = range(1, HEAD)


@intrinsic
def _from(typingctx, pointer, offset):
    """The pointer to the number at this offset."""

    def codegen(context, builder, sig, args):
        return builder.gep(args[0], [args[1]])

    return REALS(REALS, types.int64), codegen


def _call(declared):
    """An intrinsic that calls a function of this signature: (address, arguments...) as one tuple."""

    @intrinsic
    def call(typingctx, arguments):
        given = types.Tuple((types.int64, *declared.args))

        def codegen(context, builder, sig, args):
            kinds = [context.get_value_type(kind) for kind in declared.args]
            empty = declared.return_type == types.void
            result = ir.VoidType() if empty else context.get_value_type(declared.return_type)
            address, *values = (builder.extract_value(args[0], k) for k in range(1 + len(kinds)))
            returned = builder.call(builder.inttoptr(address, ir.FunctionType(result, kinds).as_pointer()), values)
            return context.get_dummy_value() if empty else returned

        return declared.return_type(given), codegen

    return call


_fill, _slopes, _renew, _renewal_slopes = _call(SIGNATURE), _call(GRADIENT), _call(RENEW), _call(RENEW_GRADIENT)
POINTS = 8  # that a part is called for at once, at most


@intrinsic
def _room(typingctx):
    """A pointer to `POINTS` numbers that last until the function returns."""

    def codegen(context, builder, sig, args):
        return cgutils.alloca_once(builder, ir.DoubleType(), size=POINTS)

    return REALS(), codegen


@compiled(njit)
def _add(count, more, out):
    """Add so many numbers to others."""
    for i in range(count):
        out[i] += more[i]


@compiled(cfunc, SIGNATURE)
def parallel(n, delta, delta_dot, entry_rate, parameters, force):
    """Sum of laws by their addresses; parameters as in `contacts.sums.Sum.parameters`."""
    found = _room()
    for first in range(0, n, POINTS):
        count, at = min(POINTS, n - first), 1
        d, v, out = _from(delta, first), _from(delta_dot, first), _from(force, first)
        for i in range(count):
            out[i] = 0.0
        for _ in range(int(parameters[0])):
            rate = max(entry_rate, parameters[at + FLOOR])
            _fill((int(parameters[at]), count, d, v, rate, _from(parameters, at + HEAD), found))
            _add(count, found, out)
            at += HEAD + int(parameters[at + SIZE])


@compiled(cfunc, GRADIENT)
def parallel_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `parallel`."""
    of_delta, of_rate, of_entry = _room(), _room(), _room()
    for i in range(n):
        by_delta[i], by_rate[i], by_entry[i] = 0.0, 0.0, 0.0
    for first in range(0, n, POINTS):
        count, at = min(POINTS, n - first), 1
        d, v = _from(delta, first), _from(delta_dot, first)
        for _ in range(int(parameters[0])):
            rate, own = max(entry_rate, parameters[at + FLOOR]), _from(parameters, at + HEAD)
            _slopes((int(parameters[at + SLOPES]), count, d, v, rate, own, of_delta, of_rate, of_entry))
            _add(count, of_delta, _from(by_delta, first))
            _add(count, of_rate, _from(by_rate, first))
            if entry_rate > parameters[at + FLOOR]:
                _add(count, of_entry, _from(by_entry, first))
            at += HEAD + int(parameters[at + SIZE])


@compiled(njit)
def _rows(kernel, counted, n, delta, delta_dot, entry_rate, parameters, out):
    """Rows of n numbers from a kernel of every part, as many as each part counts."""
    at, row = 1, 0
    for _ in range(int(parameters[0])):
        count, rate = int(parameters[at + counted]), max(entry_rate, parameters[at + FLOOR])
        if count > 0:
            own, rows = _from(parameters, at + HEAD), _from(out, row * n)
            _fill((int(parameters[at + kernel]), n, delta, delta_dot, rate, own, rows))
        row += count
        at += HEAD + int(parameters[at + SIZE])


@compiled(cfunc, SIGNATURE)
def parallel_borders(n, delta, delta_dot, entry_rate, parameters, values):
    """Borders of all parts, one part after the other."""
    _rows(BORDERS, BORDER_COUNT, n, delta, delta_dot, entry_rate, parameters, values)


@compiled(cfunc, SIGNATURE)
def parallel_memory_gradient(n, delta, delta_dot, entry_rate, parameters, by_memory):
    """Derivatives of the force by the latched numbers of all parts, one part after the other."""
    _rows(BY_MEMORY, LATCHED, n, delta, delta_dot, entry_rate, parameters, by_memory)


@compiled(cfunc, RENEW)
def parallel_renew(j, delta, delta_dot, entry_rate, parameters):
    """Renew the numbers of the part that has border j; its event is counted from those of the parts before it on."""
    at, first, events = 1, 0, 0
    for _ in range(int(parameters[0])):
        count = int(parameters[at + BORDER_COUNT])
        if first <= j < first + count:
            rate, own = max(entry_rate, parameters[at + FLOOR]), _from(parameters, at + HEAD)
            return events + _renew((int(parameters[at + RENEWAL]), j - first, delta, delta_dot, rate, own))
        first += count
        events += int(parameters[at + EVENTS])
        at += HEAD + int(parameters[at + SIZE])
    return -1


@compiled(njit)
def _spread(block, row, count, width):
    """Move the rows of a part's block, packed at its beginning, to where they stand in the whole; from the end on."""
    for a in range(count - 1, -1, -1):
        for b in range(width - 1, -1, -1):
            own = b if b < 2 else b - row
            mine = own < 2 + count and (b < 2 or own >= 2)
            block[a * width + b] = block[a * (2 + count) + own] if mine else 0.0


@compiled(cfunc, RENEW_GRADIENT)
def parallel_renew_gradient(j, delta, delta_dot, entry_rate, parameters, out):
    """Derivatives of `parallel_renew`: those of the part renewed, of no renewal (j = -1) for all others."""
    at, width = 1, 2
    for _ in range(int(parameters[0])):
        width += int(parameters[at + LATCHED])
        at += HEAD + int(parameters[at + SIZE])
    at, first, row = 1, 0, 0
    for _ in range(int(parameters[0])):
        borders, count = int(parameters[at + BORDER_COUNT]), int(parameters[at + LATCHED])
        if count > 0:
            mine = j - first if first <= j < first + borders else -1
            rate, own = max(entry_rate, parameters[at + FLOOR]), _from(parameters, at + HEAD)
            block = _from(out, row * width)
            _renewal_slopes((int(parameters[at + RENEWAL_SLOPES]), mine, delta, delta_dot, rate, own, block))
            _spread(block, row, count, width)
        first += borders
        row += count
        at += HEAD + int(parameters[at + SIZE])


GATE = 5  # numbers before those of a law behind a gate: code, rate at entry, floor, two addresses


@compiled(cfunc, SIGNATURE)
def gated(n, delta, delta_dot, entry_rate, parameters, force):
    """The law behind the gate while that is open, code 1; a little below the surface its force is that at δ = 0."""
    inside, own, rate = _room(), _from(parameters, GATE), max(parameters[1], parameters[2])
    for first in range(0, n, POINTS):
        count, d, out = min(POINTS, n - first), _from(delta, first), _from(force, first)
        for i in range(count):
            inside[i], out[i] = max(d[i], 0.0), 0.0
        if parameters[0] != 0.0:
            _fill((int(parameters[3]), count, inside, _from(delta_dot, first), rate, own, out))


@compiled(njit)
def _gate_slopes(delta, delta_dot, parameters):
    """Derivatives of the law behind an open gate by δ, its rate, and the rate at entry, which a floor may hide."""
    d, v, by_delta, by_rate, by_entry = _room(), _room(), _room(), _room(), _room()
    d[0], v[0], rate = max(delta, 0.0), delta_dot, max(parameters[1], parameters[2])
    _slopes((int(parameters[4]), 1, d, v, rate, _from(parameters, GATE), by_delta, by_rate, by_entry))
    return by_delta[0], by_rate[0], by_entry[0] if parameters[1] > parameters[2] else 0.0


@compiled(cfunc, GRADIENT)
def gated_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `gated`; that by the rate at entry belongs to its own."""
    for i in range(n):
        by_delta[i], by_rate[i], by_entry[i] = 0.0, 0.0, 0.0
        if parameters[0] != 0.0:
            by_delta[i], by_rate[i], _ = _gate_slopes(delta[i], delta_dot[i], parameters)


@compiled(cfunc, SIGNATURE)
def gated_borders(n, delta, delta_dot, entry_rate, parameters, values):
    """The indentation, which opens or closes the gate."""
    for i in range(n):
        values[i] = -delta[i] if parameters[0] == 0.0 else delta[i]


@compiled(cfunc, RENEW)
def gated_renew(j, delta, delta_dot, entry_rate, parameters):
    """Latch the rate at entry; or shut the gate."""
    if parameters[0] != 0.0:
        parameters[0] = 0.0
        return 1
    parameters[0], parameters[1] = 1.0, delta_dot
    return 0


@compiled(cfunc, SIGNATURE)
def gated_memory_gradient(n, delta, delta_dot, entry_rate, parameters, by_memory):
    """Derivatives of `gated` by its own rate at entry."""
    for i in range(n):
        by_memory[i], by_memory[n + i] = 0.0, 0.0
        if parameters[0] != 0.0:
            by_memory[n + i] = _gate_slopes(delta[i], delta_dot[i], parameters)[2]


@compiled(cfunc, RENEW_GRADIENT)
def gated_renew_gradient(j, delta, delta_dot, entry_rate, parameters, out):
    """The rate at entry is that of the mass, once."""
    for i in range(8):
        out[i] = 0.0
    out[5 if j == 0 and parameters[0] == 0.0 else 7] = 1.0
