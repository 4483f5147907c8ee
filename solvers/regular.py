"""Runge–Kutta steps in a variable in which a contact is smooth: DOP853 with t as one of the unknowns.

    INDENTATION   dt = dδ/δ̇         lands exactly on a kink, or on another stop's surface
    ROOT          dt = 2u du/δ̇      u = √δ: lands exactly on δ = 0, where δ^{3/2} is singular in t

The unknowns are [p, v, ledger, t, u]. The error is estimated by a tenth of the embedded fifth-order difference: in
these variables that stays a few times above the true one, where DOP853's own mixed estimate falls below it.
"""

from __future__ import annotations

from solvers.dormand_prince import E5, STAGES, A
from solvers.kernels import contact_forces, dot, indentation, inlined, inner, table_value
from solvers.ledger import powers
from solvers.vector import combine

INDENTATION, ROOT = range(2)


@inlined
def _rate(problem, tables, ledger, variable, stop, span, w, piece, entry_rate, out, batch):
    """Derivative of the unknowns with respect to the chosen variable, times its span; ``w`` ends in (t, u)."""
    n, calls = problem.k.size, 0
    size, t = 2 * n, 2 * n + 2 + 2 * problem.gap.size
    for b in range(n):
        out[b] = w[n + b]
        out[n + b] = -problem.k[b] * w[b] - problem.c[b] * w[n + b]
    for j in range(problem.table_dt.size):
        value, load = table_value(problem, j, w[t]), problem.load[problem.table_load[j]]
        for e in range(size):
            out[e] += load[e] * value
    out[size], out[size + 1] = powers(problem, tables, w[t], w) if ledger else (0.0, 0.0)
    for s in range(problem.gap.size):
        batch[2] = 0.0
        batch[1] = dot(problem.read_rate[s], w, size)
        if piece[s] > 0:
            batch[0] = indentation(problem, s, w)
            contact_forces(problem, s, batch[0:1], batch[1:2], entry_rate[s], batch[2:3])
            calls += 1
            for e in range(size):
                out[e] += problem.push[s, e] * batch[2]
        out[size + 2 + 2 * s] = batch[2] * batch[1]
        out[size + 3 + 2 * s] = batch[2]
    delta_dot = dot(problem.read_rate[stop], w, size)
    factor = span / delta_dot if variable == INDENTATION else span * 2.0 * w[t + 1] / delta_dot
    for e in range(t):
        out[e] *= factor
    out[t] = factor
    out[t + 1] = span if variable == ROOT else 0.0
    return calls


@inner
def regular_step(problem, tables, ledger, variable, stop, span, w, piece, entry_rate, work):
    """One DOP853 step of the chosen variable from ``w`` into ``work[15]``; (error of δ̇ of the stop, law calls)."""
    calls = 0
    difference, batch, trial = work[STAGES + 1], work[STAGES + 2], work[STAGES + 3]
    for i in range(STAGES):
        combine(work, A[i], i, w, trial)
        calls += _rate(problem, tables, ledger, variable, stop, span, trial, piece, entry_rate, work[i], batch)
    combine(work, A[STAGES], STAGES, w, trial)
    combine(work, E5, STAGES, None, difference)
    error = 0.0
    for e in range(2 * problem.k.size):
        error += abs(problem.read_rate[stop, e] * difference[e])
    return 0.1 * error, calls
