"""The energy ledger step by step: whole steps by the forms of `flight_tables`, parts of steps by series.

Within a part the state is the Taylor series of its differential equation in panels of `LONG_REACH` radians of the
fastest block, and the powers are summed by Gauss's rule with five points, 2e-12 off at most.

A flight is booked from a *mark* on, its begin, the last output, or with sampled signals the last cell's begin: whatever
steps it takes, a form of its own then holds most of what it does.
"""

from __future__ import annotations

import math

from solvers.compiled.kernels import copy, dot, inlined, inner, reordered
from solvers.compiled.simd import eight, put, spread, total
from solvers.compiled.state import T
from solvers.compiled.sums import combine
from solvers.exponential.contact.collocation import _beyond, _size
from solvers.exponential.contact.node_response import WITHIN
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.contact_tables import BEGAN, ENTERING, SQUARES
from solvers.exponential.energy.quadrature import inside, powers
from solvers.exponential.flight import LONG, LONG_REACH, add_signals, level_within, signal_derivatives, turn

_SCRATCH, _MOVING, _MARK = 9, 10, 11  # rows of Space.work; those before hold a load on the blocks and its derivatives
_EXACT = 1e-17  # share of the last term of a series
_UNSEEN = 10.0  # times what a polynomial is thought to leave out


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
    """Note the state from which `book_until` shall book a flight; its ledger is complete."""
    copy(state.x, space.work[_MARK], 2 * problem.k.size)
    space.work[_MARK, 2 * problem.k.size] = state.now[T]


@inner
def book_until(problem, tables, books, space, t, row):
    """Add to the ledger of ``row`` what a flight does from the mark to t, within a cell, whatever steps it takes."""
    x, size = space.work[_MOVING], 2 * problem.k.size
    copy(space.work[_MARK], x, size)
    begin = space.work[_MARK, size]
    span, level = t - begin, tables.h.size
    if books.closed > 0.0 and abs(span - books.spacing) <= _rounding(problem, books, t):
        _derive(problem, space, begin)
        _book_forms(problem, books, space, level, x, row)
        return
    while books.closed > 0.0 and tables.fastest * span > LONG_REACH:
        level = level_within(tables, span)
        _derive(problem, space, begin)
        _book_forms(problem, books, space, level, x, row)
        turn(problem, tables.propagator[level, 0], tables.propagator[level, 1], x)
        if problem.table_dt.size:
            add_signals(problem, tables.signal[level], x, begin, space.six)
        begin, span = begin + tables.h[level], span - tables.h[level]
    if span > 0.0:
        _book_series(problem, tables, books, space, begin, span, x, row)


@inner
def book_output(problem, tables, books, state, space, t, row):
    """Complete the ledger of an output at t; without sampled signals the flight is booked on from there."""
    size = 2 * problem.k.size
    copy(state.x[size:], row[size:], 2)
    book_until(problem, tables, books, space, t, row)
    if problem.table_dt.size == 0:
        copy(row[size:], state.x[size:], 2)
        copy(row, space.work[_MARK], size)
        space.work[_MARK, size] = t


@inner
def book_on(problem, tables, books, state, space):
    """Complete the ledger of the state, from which the flight is booked on."""
    book_until(problem, tables, books, space, state.now[T], state.x)
    mark(problem, state, space)


@inlined
def _rounding(problem, books, t):
    """By which the time between two outputs, or two cells' ends, may differ from the step in the tables."""
    return 1e-7 * books.spacing if problem.table_dt.size else 4e-16 * t


@inner
def _derive(problem, space, t):
    """Derivatives of the sampled signals at t, into ``space.six``."""
    for j in range(problem.table_dt.size):
        signal_derivatives(problem, j, t, space.six[j])


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
def _book_series(problem, tables, books, space, t, span, x, row):
    """The same by series for a part of a cell from x at t on; x moves."""
    panels, size = max(1, math.ceil(tables.fastest * span / LONG_REACH - 1e-9)), 2 * problem.k.size
    for i in range(panels):
        _clear(space, size)
        _derive(problem, space, t + i * span / panels)
        for j in range(problem.table_dt.size):
            load = problem.load[problem.table_load[j]]
            for order in range(space.six.shape[1]):
                for e in range(size):
                    space.work[order, e] += load[e] * space.six[j, order]
        _book_panel(problem, tables, books, space, t + i * span / panels, span / panels, x, row, i + 1 < panels)


@inner
def _clear(space, size):
    """No load on the blocks."""
    for order in range(S):
        for e in range(size):
            space.work[order, e] = 0.0


@inner
def _book_panel(problem, tables, books, space, t, span, x, row, further):
    """Add work and damping under the load in ``space.work`` to the ledger of ``row``; x moves if told to go further.

    Term i of the series is span^i times a derivative.
    """
    n, terms, z = problem.k.size, space.terms, space.work[_SCRATCH]
    copy(x, terms[0], 2 * n)
    count, size, power = 1, 1.0, span
    while count < LONG and (count <= S or size > _EXACT):
        i, count = count - 1, count + 1
        size *= tables.fastest * span / (i + 1.0)
        for b in range(n):
            p, v = terms[i, b], terms[i, n + b]
            terms[i + 1, b], terms[i + 1, n + b] = span * v, -span * (problem.k[b] * p + problem.c[b] * v)
        if i < S:
            for e in range(2 * n):
                terms[i + 1, e] += power * space.work[i, e]
            power *= span
    points = books.gauss.shape[1]
    for q in range(points):
        combine(terms, books.series[q], count, None, z)
        gain, loss = powers(problem, tables, t + span * books.gauss[0, q], z)
        row[2 * n] += span * books.gauss[1, q] * gain
        row[2 * n + 1] += span * books.gauss[1, q] * loss
    if further:
        combine(terms, books.series[points], count, None, z)
        copy(z, x, 2 * n)


@inner
def book_contact(problem, tables, books, state, space, family, level, h, row):
    """Add to the ledger of ``row`` what loads and damping do over the contact step of length h just found."""
    if level >= books.first and h <= books.longest[books.kind[family]]:
        _book_nodes(problem, tables, books, state, space, family, level - int(books.first), h, row)
        return
    x, size = space.work[WITHIN], 2 * problem.k.size
    copy(state.x, x, state.x.size)
    inside(problem, tables, state, space, family, h, 0.0, h, x, books.kept > 0.0)
    for s in range(problem.gap.size):
        if state.piece[s] > 0:
            _add_unseen(tables, space, family, h, s, x[size + 2 + 2 * s] - state.x[size + 2 + 2 * s], row[size + 2 :])
    copy(x[size:], row[size:], 2)


@inner
def _add_unseen(tables, space, family, h, s, work, works):
    """Add of a contact's work what `finish_step` leaves out, which sums at the nodes.

    That is no more than the polynomial through the powers at the nodes may be wrong: so the sum still tests the rest. A
    force that is constant lets steps grow until the velocity oscillates between the nodes.
    """
    weights = tables.weights[family] if family == 0 or s == family - 1 else tables.plain[family]
    powers = eight(space.force[s], 0) * eight(space.motion[s, 1], 0)
    put(space.trial, 0, powers)
    combine(tables.tail[family], space.trial, S, None, space.clipped)
    most = _UNSEEN * h * _beyond(space.clipped, _size(space.trial), S // 2 if family == 0 else 1)
    works[2 * s] += min(max(work - h * total(eight(weights, 0) * powers), -most), most)


@inner
def _steady_nodes(problem, tables, books, state, space, kind, place, h, weights):
    """Signals at the nodes into ``space.book``, p and v of the tones into ``space.terms``; work on steady motion."""
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
    """Forces on a block at the nodes and its state, for plain forces and for that of the stop that enters; signals."""
    size, signal, plain, entering = problem.k.size, spread(0.0), spread(0.0), spread(0.0)
    for u in range(problem.gap.size):
        if state.piece[u] > 0:
            force = spread(problem.push[u, size + b]) * eight(space.force[u], 0)
            if _enters(tables, family, u):
                entering += force
            else:
                plain += force
    for load in range(tables.power_rows.shape[0]):
        plain += spread(problem.load[load, size + b]) * eight(space.force[problem.gap.size + load], 0)
        signal += spread(tables.power_rows[load, size + b]) * eight(space.book[2 + load], 0)
    put(y, 0, plain)
    put(y, 2 * S, entering)
    y[S], y[S + 1] = state.x[b], state.x[size + b]
    y[3 * S], y[3 * S + 1] = y[S], y[S + 1]
    return signal


@inlined
def _enters(tables, family, u):
    """Whether the force of a stop has a weight on a step."""
    return u == family - 1 and tables.lead[family] > 0.0


@inner
def _book_nodes(problem, tables, books, state, space, family, place, h, row):
    """The same for a whole step by its tables."""
    n, size, kind, weights = int(tables.own), problem.k.size, books.kind[family], eight(tables.plain[family], 0)
    y, sums, entering = space.book[0], space.book[1], tables.lead[family] > 0.0
    gain, loss = _steady_nodes(problem, tables, books, state, space, kind, place, h, tables.plain[family]), 0.0
    gains, losses = spread(0.0), spread(0.0)
    for b in range(n):
        signal, p, v = _block_forces(problem, tables, state, space, family, b, y), state.x[b], state.x[size + b]
        table, c = books.contact[kind, place, b], problem.c[b]
        combine(table, y, S + 2, None, sums)
        if entering:
            combine(table[ENTERING:], y[2 * S :], S, sums, sums)
        moments, squares = eight(sums, 0), eight(sums, S) * eight(y, 0)
        if entering:
            combine(table[SQUARES:], y[2 * S :], S + 2, None, sums)
            squares += eight(sums, 0) * eight(y, 2 * S)
        put(space.along[b], 0, moments)
        gains += signal * moments
        losses += spread(c) * squares
        loss += c * (table[BEGAN, 0] * p * p + table[BEGAN, 1] * p * v + table[BEGAN, 2] * v * v)
        if n < size:
            steady = _of_tones(tables.loss_rows[b], space, n, size)
            losses += spread(2.0 * tables.loss_rows[b, size + b]) * steady * moments
            losses += spread(h) * weights * steady * steady
    row[2 * size] += gain + total(gains)
    row[2 * size + 1] += loss + total(losses)
    for s in range(problem.gap.size):
        if state.piece[s] > 0 and not _enters(tables, family, s):
            combine(space.along, problem.read_rate[s, size:], n, None, space.trial)
            steady = spread(h) * weights * _of_tones(problem.read_rate[s], space, n, size)
            work = total(eight(space.force[s], 0) * (eight(space.trial, 0) + steady))
            _add_unseen(tables, space, family, h, s, work, row[2 * size + 2 :])
