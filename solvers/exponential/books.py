"""The energy ledger step by step: whole steps by the forms of `energy_tables`, parts of steps by series.

Within a part the state is the Taylor series of its differential equation in panels of `LONG_REACH` radians of the
fastest block, and the powers are summed by Gauss's rule with six points, which is exact to rounding there.
"""

from __future__ import annotations

import math

from solvers.compiled.kernels import copy, dot, inner, reordered
from solvers.compiled.simd import eight, put, spread, total
from solvers.compiled.state import T
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy import account, powers
from solvers.exponential.energy_contact import BEGIN
from solvers.exponential.flight import LONG, LONG_REACH, add_taylor, level_within, signal_derivatives, turn

SERIES, BRIEF = -1, -2  # kinds of flight steps that have no tables
_SCRATCH, _MOVING, _MARK = 9, 10, 11  # rows of Space.work; those before hold a load on the blocks and its derivatives


@reordered
def _own_loss(plain, x, n):
    """Damping of blocks by themselves."""
    loss, blocks = 0.0, plain.shape[1]
    for b in range(blocks):
        p, v = x[b], x[n + b]
        loss += plain[0, b] * p * p + plain[1, b] * p * v + plain[2, b] * v * v
    return loss


@inner
def mark(problem, state, space):
    """Note where a flight without sampled signals begins that `book_until` shall book."""
    copy(state.x, space.work[_MARK], 2 * problem.k.size)
    space.work[_MARK, 2 * problem.k.size] = state.now[T]


@inner
def book_until(problem, tables, books, state, space, t, x):
    """Add to the ledger what a flight without sampled signals does from the mark until it is at x; that is the new mark.

    It is booked from output to output, whatever steps it takes.
    """
    begin, size = space.work[_MARK], 2 * problem.k.size
    span = t - begin[size]
    if books.closed > 0.0 and abs(span - books.spacing) <= 4e-16 * t:
        _book_forms(problem, books, space, tables.h.size, begin, state.x)
        span = 0.0
    while books.closed > 0.0 and span >= tables.h[tables.h.size - 1]:
        level = level_within(tables, span)
        _book_forms(problem, books, space, level, begin, state.x)
        turn(problem, tables.propagator[level, 0], tables.propagator[level, 1], begin)
        span -= tables.h[level]
    if span > 0.0:
        book_series(problem, tables, books, space, t - span, span, begin, state.x)
    copy(x, begin, size)
    begin[size] = t


@inner
def book_flight(problem, tables, books, state, space, kind, h, x):
    """Add to the ledger what loads and damping do over a flight step under sampled signals from x on, by its place in the tables."""
    if kind == BRIEF:
        _book_brief(problem, tables, state, space, h)
        return
    for j in range(problem.table_dt.size):
        signal_derivatives(problem, j, state.now[T], space.six[j])
    if kind == SERIES or books.closed == 0.0:
        copy(x, space.work[_MOVING], 2 * problem.k.size)
        book_series(problem, tables, books, space, state.now[T], h, space.work[_MOVING], state.x)
        return
    _book_forms(problem, books, space, kind, x, state.x)


@inner
def _book_forms(problem, books, space, level, x, row):
    """The same by the forms of a step, from the signals' derivatives in ``space.six``."""
    n, driven, given = problem.k.size, books.driver.size, space.book[0]
    signals = 6 * problem.table_dt.size
    for i in range(driven):
        given[i] = x[books.driver[i]]
    for i in range(signals):
        given[driven + i] = space.six[i // 6, i % 6]
    sums = space.terms
    combine(books.rows[level], given, driven + signals, None, sums)
    gain, loss = dot(sums[0], x, 2 * n), dot(sums[1], x, 2 * n) + _own_loss(books.plain[level], x, n)
    if signals:
        sums, given, half = space.book[1], given[driven:], books.pairs.shape[2] // 2
        combine(books.pairs[level], given, signals, None, sums)
        gain += dot(sums, given, signals)
        loss += dot(sums[half:], given, signals)
    row[2 * n] += gain
    row[2 * n + 1] += loss


@inner
def _book_brief(problem, tables, state, space, h):
    """The same for a step on the Taylor polynomial in ``space.terms``, by Gauss's rule with three points."""
    size, inner = 2 * problem.k.size, space.work[_SCRATCH]
    for i in range(3):
        span = h * (0.5 + 0.3872983346207417 * (i - 1))  # sqrt(3/5)/2 apart
        add_taylor(space.terms, inner, span, size, space.values, space.work[0])
        gain, loss = powers(problem, tables, state.now[T] + span, inner)
        weight = h * (4.0 if i == 1 else 2.5) / 9.0
        state.x[size] += weight * gain
        state.x[size + 1] += weight * loss


@inner
def book_series(problem, tables, books, space, t, span, x, row):
    """Move the state x of a flight on within a cell, and add to the ledger of ``row`` what happens meanwhile."""
    panels, size = max(1, int(math.ceil(tables.fastest * span / LONG_REACH - 1e-9))), 2 * problem.k.size
    for i in range(panels):
        _clear(space, size)
        for j in range(problem.table_dt.size):
            signal_derivatives(problem, j, t + i * span / panels, space.six[j])
            load = problem.load[problem.table_load[j]]
            for order in range(space.six.shape[1]):
                for e in range(size):
                    space.work[order, e] += load[e] * space.six[j, order]
        _book_panel(problem, tables, books, space, t + i * span / panels, span / panels, x, row)


@inner
def _clear(space, size):
    """No load on the blocks."""
    for order in range(S):
        for e in range(size):
            space.work[order, e] = 0.0


@inner
def _book_panel(problem, tables, books, space, t, span, x, row):
    """Move x on under the load in ``space.work``, and add work and damping to the ledger of ``row``."""
    n, terms, weights, z = problem.k.size, space.terms, space.book[0], space.work[_SCRATCH]
    copy(x, terms[0], 2 * n)
    for i in range(LONG - 1):
        for b in range(n):
            terms[i + 1, b] = terms[i, n + b]
            terms[i + 1, n + b] = -problem.k[b] * terms[i, b] - problem.c[b] * terms[i, n + b]
        if i < S:
            for e in range(2 * n):
                terms[i + 1, e] += space.work[i, e]
    weights[0] = 1.0
    for q in range(books.gauss.shape[1] + 1):
        part = span * books.gauss[0, q] if q < books.gauss.shape[1] else span
        for i in range(LONG - 1):
            weights[i + 1] = weights[i] * part / (i + 1.0)
        combine(terms, weights, LONG, None, z)
        if q < books.gauss.shape[1]:
            gain, loss = powers(problem, tables, t + part, z)
            row[2 * n] += span * books.gauss[1, q] * gain
            row[2 * n + 1] += span * books.gauss[1, q] * loss
    copy(z, x, 2 * n)


@inner
def book_contact(problem, tables, books, state, space, family, level, span, row):
    """Add to the ledger of ``row`` what loads and damping do over ``span`` of the contact step just found."""
    h = tables.step[level]
    if span == h and level >= books.first and h <= books.longest[books.kind[family]]:
        _book_nodes(problem, tables, books, state, space, family, level - int(books.first), h, row)
    elif family == 0:
        _book_pieces(problem, tables, books, state, space, h, span, row)
    else:
        account(problem, tables, state, space, family, h, span, state.x, row)


@inner
def _book_pieces(problem, tables, books, state, space, h, span, row):
    """The same on a part of a smooth step, whose forces are polynomials of time, by series."""
    panels, size = max(1, int(math.ceil(tables.fastest * span / LONG_REACH - 1e-9))), 2 * problem.k.size
    x = space.work[_MOVING]
    copy(state.x, x, size)
    for i in range(panels):
        begin = i * span / panels
        _clear(space, size)
        for u in range(space.force.shape[0]):
            if u >= problem.gap.size or state.piece[u] > 0:
                push = problem.push[u] if u < problem.gap.size else problem.load[u - problem.gap.size]
                _add_force(books, space, space.force[u], push, h, begin / h, size)
        _book_panel(problem, tables, books, space, state.now[T] + begin, span / panels, x, row)


@inner
def _add_force(books, space, force, push, h, place, size):
    """Derivatives at a place in (0, 1) of a force known at a smooth step's nodes, times its push, to the load."""
    powers = space.book[0]
    for i in range(S):
        powers[i] = dot(books.monomials[i], force, S)
    for i in range(S):  # Horner's scheme moves the polynomial to the place
        for m in range(S - 2, i - 1, -1):
            powers[m] += place * powers[m + 1]
    factor = 1.0
    for i in range(S):
        for e in range(size):
            space.work[i, e] += factor * powers[i] * push[e]
        factor *= (i + 1.0) / h


@inner
def _steady_nodes(problem, tables, books, state, space, kind, place, h, weights):
    """Signals at the nodes into ``space.book``, p and v of the tones into ``space.terms``; work on the steady motion."""
    n, size, gain = int(tables.own), problem.k.size, 0.0
    for k in range(size - n):
        alpha, beta = eight(books.steady[kind, place, k, 0], 0), eight(books.steady[kind, place, k, 1], 0)
        p, v = spread(state.x[n + k]), spread(state.x[size + n + k])
        put(space.terms, 2 * S * k, alpha * p + beta * v)
        put(space.terms, 2 * S * k + S, alpha * v - beta * spread(problem.k[n + k]) * p)
    for load in range(tables.power_rows.shape[0]):
        signal, power = eight(space.force[problem.gap.size + load], 0), spread(0.0)
        signal += _of_tones(tables.signal_rows[load], space, n, size)
        power += _of_tones(tables.power_rows[load], space, n, size)
        put(space.book[2 + load], 0, signal)
        gain += h * total(eight(weights, 0) * signal * power)
    return gain


@inner
def _of_tones(row, space, n, size):
    """A row's sum over the tones at the nodes."""
    values = spread(0.0)
    for k in range(size - n):
        values += spread(row[n + k]) * eight(space.terms, 2 * S * k)
        values += spread(row[size + n + k]) * eight(space.terms, 2 * S * k + S)
    return values


@inner
def _block_forces(problem, tables, state, space, family, b, y):
    """Forces on a block at the nodes, plain ones and that of the stop that enters, then its state, into y; signals."""
    size, signal, plain, entering = problem.k.size, spread(0.0), spread(0.0), spread(0.0)
    for u in range(problem.gap.size):
        if state.piece[u] > 0:
            force = spread(problem.push[u, size + b]) * eight(space.force[u], 0)
            if u == family - 1 and tables.lead[family] > 0.0:
                entering += force
            else:
                plain += force
    for load in range(tables.power_rows.shape[0]):
        plain += spread(problem.load[load, size + b]) * eight(space.force[problem.gap.size + load], 0)
        signal += spread(tables.power_rows[load, size + b]) * eight(space.book[2 + load], 0)
    put(y, 0, plain)
    put(y, S, entering)
    y[BEGIN], y[BEGIN + 1] = state.x[b], state.x[size + b]
    return signal


@inner
def _book_nodes(problem, tables, books, state, space, family, place, h, row):
    """The same for a whole step by its tables."""
    n, size, kind, weights = int(tables.own), problem.k.size, books.kind[family], tables.plain[family]
    y, sums, loss = space.book[0], space.book[1], 0.0
    put(y, BEGIN, spread(0.0))
    gain = _steady_nodes(problem, tables, books, state, space, kind, place, h, weights)
    for b in range(n):
        signal = _block_forces(problem, tables, state, space, family, b, y)
        table = books.contact[kind, place, b]
        combine(table, y, S, None, sums)
        if tables.lead[family] > 0.0:
            combine(table[S:], y[S:], S, sums, sums)
        combine(table[BEGIN:], y[BEGIN:], 2, sums, sums)
        moments = eight(sums, 0)
        squares = eight(sums, S) * eight(y, 0) + eight(sums, 2 * S) * eight(y, S) + eight(sums, 3 * S) * eight(y, 2 * S)
        gain += total(signal * moments)
        loss += problem.c[b] * total(squares)
        if n < size:
            steady = _of_tones(tables.loss_rows[b], space, n, size)
            loss += 2.0 * tables.loss_rows[b, size + b] * total(steady * moments)
            loss += h * total(eight(weights, 0) * steady * steady)
    row[2 * size] += gain
    row[2 * size + 1] += loss
