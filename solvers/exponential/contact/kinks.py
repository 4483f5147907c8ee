"""Kinks of sampled loads: a step in contact ends on one, as the force has a kink in its third derivative there.

It ends by a landing of known length where this is exact enough; steps of the main method, whose lengths are tabulated,
lead near it.
"""

from __future__ import annotations

import numpy as np

from solvers.compiled.kernels import REAL, bends_at, inlined, inner, merged
from solvers.compiled.parts import PASSED, TO_KINK, part
from solvers.compiled.state import STEPS, T_END, T
from solvers.exponential.contact.borders import passed
from solvers.exponential.contact.crossings import CLEAR, before_landing
from solvers.exponential.contact.first_step import (
    ENTRY,
    NEW,
    NEXT_LEVEL,
    NODE_SET,
    SEGMENT,
    entry_nodes,
    latest_entered,
)
from solvers.exponential.contact.landing import (
    accept_landing,
    error_in_time,
    longest_time,
    promising_time,
    take_step,
)
from solvers.exponential.contact.landing_step import SINCE, TIME, start_landing
from solvers.exponential.contact.node_response import LANDED, START
from solvers.exponential.flight import cell_of


@inlined
def _time_to_kink(problem, t, horizon):
    """Time, s, until slope or curvature of a sampled load jump, inf if that is beyond the ``horizon``."""
    dt, start = problem.table_dt[0], problem.table_start
    cell, offset = cell_of(problem, t)
    for ahead in range(1, start[1] - start[0] - 1 - cell):
        time = ahead * dt - offset
        if time > horizon:
            break
        for j in range(problem.table_dt.size):
            if bends_at(problem, start[j] + cell + ahead):
                return time
    return np.inf


@inlined
def _promising(run, variable):
    """Length, s, of a landing in time above which it would hardly be within the tolerance."""
    longest = longest_time(run)
    for s in range(run.problem.law.size):
        if run.state.segment[s] > 0:
            longest = min(longest, promising_time(run.scratch, variable, s))
    return longest


@merged
def _land(run, time):
    """Try to land a ``time`` ahead; returns whether it was done."""
    scratch = run.scratch
    control, stop, variable, span = scratch.control, latest_entered(run.state), np.int64(TIME), time
    if control[NEW] == ENTRY and control[NODE_SET] > 0:
        stop, variable = control[NODE_SET] - 1, np.int64(SINCE)
        span = time ** (1.0 / run.tables.time_exponent[stop + 1])
    if time > _promising(run, variable):
        return False
    start_landing(run, stop, variable)
    w, x = scratch.stages[START], scratch.stages[LANDED]
    take_step(run, variable, stop, span)
    if not error_in_time(run, time) <= 1.0:
        return False
    if before_landing(run, np.int64(-1), np.bool_(1), w, x) != CLEAR:
        return False
    if run.problem.parts[PASSED] and passed(run, np.int64(-1), np.int64(-1), w, x)[0] != -1:
        return False
    return accept_landing(run, variable, stop, np.inf, span)


@part(TO_KINK, REAL, REAL)
def step_to_kink(run, horizon):
    """Time, s, to the next kink of a sampled load, inf if that is beyond the ``horizon``; 0 if the step was done."""
    state = run.state
    time, control = _time_to_kink(run.problem, state.now[T], horizon), run.scratch.control
    if time == np.inf or not _land(run, time):
        return time
    state.count[STEPS] += 1
    control[NEW] = SEGMENT
    control[NODE_SET] = entry_nodes(run, latest_entered(state), control[NEXT_LEVEL])
    return 0.0


@inner
def land_on_kink_or_limit(run, level):
    """Longest step, s, that sampled loads allow; 0 if a step to their next kink has been done.

    It ends at this kink, if a step of a level reaches so far, and at most a cell beyond the end of the run.
    """
    remaining = run.state.now[T_END] - run.state.now[T]
    longest = remaining + run.problem.table_dt[0]
    if run.problem.table.shape[1] > 3:
        horizon = min(run.tables.contact_step[level], remaining)
        longest = min(longest, step_to_kink(run, horizon))
    return longest
