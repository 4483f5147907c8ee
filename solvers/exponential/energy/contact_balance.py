"""The energy balance of contact steps: whole steps by tables, the rest by `quadrature`.

With a few stops and tones a step is one form that `contact_sums` has summed over the blocks; with more the forms of the
blocks, see `contact_tables`, are evaluated and summed here.
"""

from __future__ import annotations

from numba import types

from solvers.compiled.kernels import REAL, copy, element_of, inlined, merged, reordered
from solvers.compiled.parts import ACCOUNT_CONTACT, part
from solvers.compiled.simd import load8, splat8, store8, sum8
from solvers.compiled.state import acts
from solvers.compiled.sums import combine
from solvers.exponential.contact.node_response import WITHIN
from solvers.exponential.contact.nodes import S
from solvers.exponential.contact.step_integrals import is_weighted
from solvers.exponential.energy.contact_tables import BEGAN, ENTERING, SQUARES
from solvers.exponential.energy.quadrature import state_within


@part(ACCOUNT_CONTACT, types.void, types.int64, types.int64, REAL)
def account_contact(run, node_set, level, h):
    """Add work of the loads and damping over the contact step of length h just solved to the state's balance."""
    energy_tables, state = run.energy_tables, run.state
    if level >= energy_tables.first and h <= energy_tables.longest[energy_tables.kind[node_set]]:
        place = level - int(energy_tables.first)
        if energy_tables.sums.shape[0]:
            _account_sums(run, node_set, place)
        else:
            _account_nodes(run, node_set, place, h)
        return
    x, size = run.scratch.stages[WITHIN], 2 * run.problem.k.size
    copy(state.x, x, state.x.size)
    state_within(run, node_set, h, 0.0, h, x, energy_tables.active > 0.0, False)
    copy(x[size:], state.x[size:], 2)


@reordered
def _free_loss(plain, x, n):
    """Energy, J, dissipated by the free motion of the structure's blocks."""
    loss, blocks = 0.0, plain.shape[1]
    for b in range(blocks):
        p, v = x[b], x[n + b]
        loss += plain[0, b] * p * p + plain[1, b] * p * v + plain[2, b] * v * v
    return loss


@merged
def _account_sums(run, node_set, place):
    """The same for a whole step by the forms that are summed over the blocks."""
    problem, energy_tables, state, scratch = run.problem, run.energy_tables, run.state, run.scratch
    size, rows, heads = 2 * problem.k.size, problem.gap.size, energy_tables.head
    y, sums, tones = scratch.energy_sums[0], scratch.energy_sums[1], problem.k.size - int(run.tables.own_blocks)
    copy(state.x, y, size)
    for i in range(heads.size):
        used = heads[i] >= rows or acts(problem, state, heads[i])
        store8(y, size + S * i, load8(scratch.force[heads[i]], 0) if used else splat8(0.0))
    combine(energy_tables.sums[node_set, place], y, size + S * heads.size, None, sums)
    losses, gains = splat8(0.0), splat8(0.0)
    for i in range(heads.size):
        values = load8(y, size + S * i)
        losses += values * load8(sums, S * i)
        if heads[i] >= rows:
            gains += values * load8(sums, S * (heads.size + i - rows))
    gain, loss = sum8(gains), sum8(losses)
    loss += _free_loss(energy_tables.free_loss[energy_tables.kind[node_set], place], state.x, problem.k.size)
    of_tones = sums[S * (2 * heads.size - rows) :]
    for k in range(2 * tones):
        value = state.x[int(run.tables.own_blocks) + (k if k < tones else k + problem.k.size - tones)]
        loss, gain = loss + value * of_tones[k], gain + value * of_tones[2 * tones + k]
    state.x[size], state.x[size + 1] = state.x[size] + gain, state.x[size + 1] + loss


@merged
def _steady_nodes(run, kind, place, h, weights):
    """Work, J, of the loads on the steady motion over the step.

    Signals at the nodes are left in ``scratch.energy_sums``, motion of the tones there in ``scratch.terms``.
    """
    problem, tables, scratch = run.problem, run.tables, run.scratch
    n, size, gain, steady = int(tables.own_blocks), problem.k.size, 0.0, run.energy_tables.steady[kind, place]
    for k in range(size - n):
        alpha, beta = load8(steady[k, 0], 0), load8(steady[k, 1], 0)
        p, v = splat8(run.state.x[n + k]), splat8(run.state.x[size + n + k])
        store8(scratch.terms, 2 * S * k, alpha * p + beta * v)
        store8(scratch.terms, 2 * S * k + S, alpha * v - beta * splat8(problem.k[n + k]) * p)
    for load in range(tables.power_rows.shape[0]):
        signal, power = load8(scratch.force[problem.gap.size + load], 0), splat8(0.0)
        signal += _sum_of_tones(tables.signal_rows[load], scratch, n, size)
        power += _sum_of_tones(tables.power_rows[load], scratch, n, size)
        store8(scratch.energy_sums[2 + load], 0, signal)
        gain += h * sum8(load8(weights, 0) * signal * power)
    return gain


@inlined
def _sum_of_tones(row, scratch, n, size):
    """A row's sum over the motion of the tones at the nodes."""
    values = splat8(0.0)
    for k in range(size - n):
        values += splat8(row[n + k]) * load8(scratch.terms, 2 * S * k)
        values += splat8(row[size + n + k]) * load8(scratch.terms, 2 * S * k + S)
    return values


@merged
def _block_forces(run, node_set, b, y):
    """Write a block's plain forces, that of the stop that enters, and its state into ``y``; its signal at the nodes."""
    problem, tables, state, scratch = run.problem, run.tables, run.state, run.scratch
    size, signal, plain, entering = problem.k.size, splat8(0.0), splat8(0.0), splat8(0.0)
    for u in range(problem.gap.size):
        if acts(problem, state, u):
            force = splat8(problem.push[u, size + b]) * load8(scratch.force[u], 0)
            if is_weighted(tables, node_set, element_of(problem, u)):
                entering += force
            else:
                plain += force
    for load in range(tables.power_rows.shape[0]):
        plain += splat8(problem.load[load, size + b]) * load8(scratch.force[problem.gap.size + load], 0)
        signal += splat8(tables.power_rows[load, size + b]) * load8(scratch.energy_sums[2 + load], 0)
    store8(y, 0, plain)
    store8(y, 2 * S, entering)
    y[S], y[S + 1] = state.x[b], state.x[size + b]
    y[3 * S], y[3 * S + 1] = y[S], y[S + 1]
    return signal


@merged
def _account_nodes(run, node_set, place, h):
    """The same for a whole step by the forms of each block."""
    problem, tables, energy_tables, state, scratch = run.problem, run.tables, run.energy_tables, run.state, run.scratch
    n, size, kind, plain = int(tables.own_blocks), problem.k.size, energy_tables.kind[node_set], tables.plain[node_set]
    y, sums, entering = scratch.energy_sums[0], scratch.energy_sums[1], tables.weight_exponent[node_set] > 0.0
    gain, loss = _steady_nodes(run, kind, place, h, plain), 0.0
    weights, gains, losses = load8(plain, 0), splat8(0.0), splat8(0.0)
    for b in range(n):
        signal, p, v = _block_forces(run, node_set, b, y), state.x[b], state.x[size + b]
        table, c = energy_tables.contact[kind, place, b], problem.c[b]
        combine(table, y, S + 2, None, sums)
        if entering:
            combine(table[ENTERING:], y[2 * S :], S, sums, sums)
        moments, squares = load8(sums, 0), load8(sums, S) * load8(y, 0)
        if entering:
            combine(table[SQUARES:], y[2 * S :], S + 2, None, sums)
            squares += load8(sums, 0) * load8(y, 2 * S)
        gains += signal * moments
        losses += splat8(c) * squares
        loss += c * (table[BEGAN, 0] * p * p + table[BEGAN, 1] * p * v + table[BEGAN, 2] * v * v)
        if n < size:
            steady = _sum_of_tones(tables.loss_rows[b], scratch, n, size)
            losses += splat8(2.0 * tables.loss_rows[b, size + b]) * steady * moments
            losses += splat8(h) * weights * steady * steady
    state.x[2 * size] += gain + sum8(gains)
    state.x[2 * size + 1] += loss + sum8(losses)
