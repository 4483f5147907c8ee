r"""Runge–Kutta steps in a variable in which a contact is smooth: DOP853 with t as one of the unknowns.

    TIME          dt = dt
    INDENTATION   dt = dδ/δ̇         lands exactly on a kink, or on another stop's surface
    ROOT          dt = 2u du/δ̇      u = √δ: lands exactly on δ = 0, where δ^{3/2} is singular in t
    STRETCHED     dt = u dτ, u' = δ̇/2   analytic through entry and exit; u is carried as an unknown

The unknowns are [p, v, ledger, t, u]. The error is estimated by a tenth of the embedded fifth-order difference: in
these variables that stays a few times above the true one, where DOP853's own mixed estimate falls below it.
"""

from __future__ import annotations

from solvers.collocation import powers
from solvers.dormand_prince import E5, STAGES, A
from solvers.kernels import dot, kernel, rhs

TIME, INDENTATION, ROOT, STRETCHED = range(4)


@kernel
def _rate(problem, tables, ledger, variable, stop, w, piece, entry_rate, out, batch):
    """Derivative of the unknowns with respect to the chosen variable; ``w[-1]`` is u."""
    size = w.size - 2
    calls = rhs(problem, w[size], w, piece, entry_rate, out, batch)
    out[2 * problem.k.size], out[2 * problem.k.size + 1] = 0.0, 0.0
    if ledger:
        gain, loss = powers(problem, tables, w[size], w)
        out[2 * problem.k.size], out[2 * problem.k.size + 1] = gain, loss
    delta_dot = dot(problem.read_rate[stop], w, 2 * problem.k.size)
    u = w[size + 1]
    if variable == TIME:
        factor = 1.0
    elif variable == INDENTATION:
        factor = 1.0 / delta_dot
    elif variable == ROOT:
        factor = 2.0 * u / delta_dot
    else:
        factor = u
    for e in range(size):
        out[e] *= factor
    out[size] = factor
    out[size + 1] = 1.0 if variable == ROOT else 0.5 * delta_dot if variable == STRETCHED else 0.0
    return calls


@kernel
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
