"""Newton's method for the forces of a contact step, where stiff or strongly damped laws need it."""

from __future__ import annotations

import numpy as np
from numba import types

from solvers.compiled.kernels import element_of, inner, is_circle, merged, row_of, rubs
from solvers.compiled.parts import NEWTON, part
from solvers.compiled.state import CALLS, acts, rate_tolerance
from solvers.exponential.circles.contact import linearise_circle
from solvers.exponential.circles.friction import linearise_rubbing
from solvers.exponential.contact.many_stops import pair_response
from solvers.exponential.contact.node_response import law_slopes_at_nodes, node_forces, respond_all
from solvers.exponential.contact.nodes import S

MOST_ITERATIONS = 16
_MOST_NOISE = 1e-3  # of a force by rounding of δ̇; iterates that come down from far off change by more


@inner
def linearise(run, node_set, level):
    """Write J = 1 - ∂law/∂(δ, δ̇) ∂(δ, δ̇)/∂F, over nodes and rows in contact, into ``scratch.jacobian``; its size."""
    problem, state = run.problem, run.state
    for s in range(problem.law.size):
        if state.segment[s] > 0:
            law_slopes_at_nodes(run, s)
            state.count[CALLS] += S
    size = 0
    for r in range(problem.gap.size):
        if acts(problem, state, r):
            s = element_of(problem, r)
            if rubs(problem, s):
                if r == row_of(problem, s):
                    linearise_rubbing(run, node_set, level, s, size)
            elif not is_circle(problem, s):
                _linearise_row(run, node_set, level, r, size)
            elif r == row_of(problem, s):
                linearise_circle(run, node_set, level, s, size)
            size += S
    return size


@inner
def _linearise_row(run, node_set, level, r, begin):
    """Write the S rows of J that belong to row r, from its row ``begin`` on."""
    problem = run.problem
    slope, pushes, column = run.scratch.slope[element_of(problem, r)], r == row_of(problem, element_of(problem, r)), 0
    for u in range(problem.gap.size):
        if not acts(problem, run.state, u):
            continue
        matrix = pair_response(run, node_set, level, r, u)
        for i in range(S):
            for j in range(S):
                value = slope[0, i] * matrix[j, i] + slope[1, i] * matrix[j, S + i] if pushes else 0.0
                run.scratch.jacobian[begin + i, column + j] = (1.0 if r == u and i == j else 0.0) - value
        column += S


@inner
def factorise(matrix, pivots, n):
    """LU factors with partial pivoting, in place (Golub, Van Loan, Matrix Computations, Section 3.4)."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        for j in range(n):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, n):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]


@inner
def substitute(matrix, pivots, n, x):
    """Solve with the factors, in place."""
    for k in range(n):
        best = pivots[k]
        x[k], x[best] = x[best], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= matrix[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= matrix[i, j] * x[j]
        x[i] /= matrix[i, i]


@merged
def _store_rate_slopes(run):
    """Largest |∂F/∂δ̇| at the nodes of every stop in contact, N s/m, into ``scratch.viscous``."""
    scratch = run.scratch
    for s in range(run.state.segment.size):
        if run.state.segment[s] > 0:
            scratch.viscous[s] = 0.0
            for i in range(S):
                scratch.viscous[s] = max(scratch.viscous[s], abs(scratch.slope[s, 1, i]))


@part(NEWTON, types.boolean, types.int64, types.int64)
def newton(run, node_set, level):
    """Solve for the forces by Newton's method, where fixed-point iteration diverges; whether it converged."""
    problem, state, scratch = run.problem, run.state, run.scratch
    for _ in range(MOST_ITERATIONS):
        place = 0
        respond_all(run, node_set, level)
        for s in range(problem.law.size):
            if state.segment[s] == 0:
                continue
            node_forces(run, s)
            for r in range(row_of(problem, s), row_of(problem, s + 1)):
                for i in range(S):
                    scratch.residual[place + i] = scratch.law_force[r, i] - scratch.force[r, i]
                place += S
        n = linearise(run, node_set, level)
        factorise(scratch.jacobian, scratch.pivots, n)
        substitute(scratch.jacobian, scratch.pivots, n, scratch.residual)
        found, place = True, 0
        _store_rate_slopes(run)
        for r in range(problem.gap.size):
            s = element_of(problem, r)
            if state.segment[s] == 0:
                continue
            change, largest = 0.0, 0.0
            for i in range(S):
                scratch.force[r, i] += scratch.residual[place + i]
                change += abs(scratch.residual[place + i])
                largest = max(largest, abs(scratch.force[r, i]))
            if not change < np.inf:
                return False
            noise = max(3e-14 * largest, 0.1 * scratch.viscous[s] * rate_tolerance(problem, s, state.x))
            noise = min(noise, _MOST_NOISE * largest)  # of forces far off, whose slopes are as large
            found &= change <= max(scratch.force_tolerance[s], noise)
            place += S
        if found:
            return True
    return False
