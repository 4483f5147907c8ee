"""Borders of laws with memory: their margins, and what is latched and logged when one is reached.

A law has margins b_j(δ, δ̇), its event functions, which are positive inside the present segment. When one falls to
zero, the law *renews* the numbers that it latches, which are among its parameters, and another segment begins. The
margins of friction depend on more than δ and δ̇, see `sliding`.
"""

from __future__ import annotations

from solvers.compiled.kernels import (
    acceleration_of,
    call_force,
    call_renewal,
    force_at,
    indentation_and_rate,
    inlined,
    inner,
    rubs,
)
from solvers.compiled.state import LOGGED, PEAK_DELTA, RENEWAL, T, end_event, event_row, renew_slider_row, write_event
from solvers.problem import event_list as at


@inlined
def margins(problem, state, s, n, delta, rate, out):
    """Margins of the borders of element s at n points, row by row into ``out``."""
    call_force(problem.borders[s], n, delta, rate, state.entry_rate[s], problem.parameters[s], (out,))


@inner
def margins_in(problem, state, s, x, batch, out):
    """The same in one state; returns δ and δ̇."""
    batch[0], batch[1] = indentation_and_rate(problem, s, x)
    margins(problem, state, s, 1, batch[0:1], batch[1:2], out)
    return batch[0], batch[1]


@inner
def margins_after(problem, state, s, delta, rate, time, batch, out):
    """Margins a time after the present state, which is extrapolated by its acceleration; before it if negative."""
    acceleration = acceleration_of(problem, s, state.x, state.rate)
    batch[0] = delta + time * (rate + 0.5 * time * acceleration)
    batch[1] = rate + time * acceleration
    margins(problem, state, s, 1, batch[0:1], batch[1:2], out)


@inner
def renew(problem, state, s, j, delta, rate):
    """Renew what element s latches on its border j, in a state whose rate is known, and log it."""
    t, row = state.now[T], state.log[state.count[LOGGED]]
    if state.event_record.shape[0]:
        write_event(state, RENEWAL, t, t, 0.0, s, j, state.x)
    event_row(problem, state, s, t, j, delta, rate, row)
    if rubs(problem, s):
        renew_slider_row(problem, state, s, j, row)
        return
    force_at(problem, s, delta, rate, state.entry_rate[s], row[at.DELTA : at.FORCE + 1])
    row[at.CODE] = call_renewal(problem.renewal[s], j, delta, rate, state.entry_rate[s], problem.parameters[s])
    end_event(problem, state, s, row)
    if row[at.FROM] == 0.0 and row[at.TO] > 0.0:
        state.active[s, PEAK_DELTA] = delta


@inlined
def most_rows(problem):
    """The most rows of the log that the events of one instant take."""
    rows = problem.law.size + 2 * problem.friction.shape[0]
    for count in problem.border_count:
        rows += count
    return rows
