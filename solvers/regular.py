r"""Runge–Kutta steps in a variable in which a contact is smooth: DOP853 with t as one of the unknowns.

    INDENTATION   dt = dδ/δ̇         lands exactly on a kink, or on another stop's surface
    ROOT          dt = 2u du/δ̇      u = √δ: lands exactly on δ = 0, where δ^{3/2} is singular in t

The unknowns are [p, v, ledger, t, u]. The error is estimated by a tenth of the embedded fifth-order difference: in
these variables that stays a few times above the true one, where DOP853's own mixed estimate falls below it.
"""

from __future__ import annotations

from solvers.collocation import powers
from solvers.dormand_prince import E5, STAGES, A
from solvers.kernels import contact_forces, dot, indentation, inlined, table_value

INDENTATION, ROOT = range(2)


@inlined
def _rate(problem, tables, ledger, variable, stop, w, piece, entry_rate, out, batch):
    """Derivative of the unknowns with respect to the chosen variable; ``w[-2:]`` is (t, u)."""
    n, calls = problem.k.size, 0
    size = 2 * n
    for b in range(n):
        out[b] = w[n + b]
        out[n + b] = -problem.k[b] * w[b] - problem.c[b] * w[n + b]
    for j in range(problem.table_dt.size):
        value, load = table_value(problem, j, w[w.size - 2]), problem.load[problem.table_load[j]]
        for e in range(size):
            out[e] += load[e] * value
    out[size], out[size + 1] = powers(problem, tables, w[w.size - 2], w) if ledger else (0.0, 0.0)
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
    delta_dot, u = dot(problem.read_rate[stop], w, size), w[w.size - 1]
    factor = 1.0 / delta_dot if variable == INDENTATION else 2.0 * u / delta_dot
    for e in range(w.size - 2):
        out[e] *= factor
    out[w.size - 2] = factor
    out[w.size - 1] = 1.0 if variable == ROOT else 0.0
    return calls


@inlined
def regular_step(problem, tables, ledger, variable, stop, span, w, piece, entry_rate, work):
    """One DOP853 step of the chosen variable from ``w`` into ``work[-1]``; (error of δ̇ of the stop, law calls)."""
    size, calls = w.size, 0
    trial, batch = work[STAGES + 1], work[STAGES + 2]
    for i in range(STAGES + 1):
        for e in range(size):
            total = 0.0
            for j in range(i):
                total += A[i, j] * work[j, e]
            trial[e] = w[e] + span * total
        if i < STAGES:
            calls += _rate(problem, tables, ledger, variable, stop, trial, piece, entry_rate, work[i], batch)
    result = work[STAGES + 3]
    for e in range(size):
        result[e] = trial[e]
    error = 0.0
    for e in range(2 * problem.k.size):
        total = 0.0
        for j in range(STAGES):
            total += E5[j] * work[j, e]
        error += abs(problem.read_rate[stop, e] * total)
    return 0.1 * abs(span) * error, calls
