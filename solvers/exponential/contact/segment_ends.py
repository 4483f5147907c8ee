"""The end of a segment of a law: a step ends on a surface or knot, on a bend, or on a border of a law with memory.

If another stop reaches its own border before, that is landed on instead. Then the next segment begins: the next one of
the law, the other side of a bend, or one with newly latched numbers.
"""

from __future__ import annotations

import numpy as np
from numba import types

from solvers.compiled.kernels import REAL, indentation
from solvers.compiled.parts import FIRST_END, GO_BEYOND, LAND, LAND_IN_TIME, part
from solvers.exponential.contact.borders import UNRESOLVED, border_ahead, renew_all, renew_border
from solvers.exponential.contact.crossings import first_bend
from solvers.exponential.contact.landing import land, land_on_bend_or_border
from solvers.exponential.contact.node_response import BORDER, ELEMENT, LANDED, SLOPE


@part(LAND, types.UniTuple(types.int64, 2), types.int64, types.int64, REAL)
def land_first(problem, tables, state, scratch, stop, direction, time_to_knot):
    """Land on the knot reached first, be it that of another stop; (stop, direction), or (-1, 0) on failure."""
    for _ in range(problem.law.size + 1):
        landed = land(problem, tables, state, scratch, stop, direction, time_to_knot)
        if landed == stop or landed < 0:
            return landed, direction
        above = indentation(problem, landed, scratch.stages[LANDED]) > problem.knots[landed, state.segment[landed]]
        stop, direction = landed, 1 if above else -1
    return -1, 0


@part(FIRST_END, types.Tuple((REAL, types.int64)), types.int64, types.int64, types.boolean)
def first_end(problem, tables, state, scratch, node_set, level, is_new):
    """(time after the start of the step just tried, stop) of the first bend or border that it crosses, or (inf, -1).

    ``scratch.border`` gets the number of the border, -1 of a bend. The stop is `UNRESOLVED` if the step is too long to
    decide.
    """
    first, stop = first_bend(problem, tables, state, scratch, node_set, level, is_new)
    time, element, border = border_ahead(problem, tables, state, scratch, node_set, level)
    scratch.border[0] = border if time < first else -1
    if element == UNRESOLVED and level < tables.contact_step.size - 1:
        return np.inf, UNRESOLVED
    return (time, element) if time < first else (first, stop)


@part(LAND_IN_TIME, types.Tuple((types.int64, types.boolean)), types.int64, REAL)
def land_in_time(problem, tables, state, scratch, stop, first):
    """Land on the bend or border of ``stop``, ``first`` s ahead, or on a border reached before; (stop, success).

    ``scratch.border`` holds the number of the border, -1 of a bend, before and after, ``scratch.ahead`` the slope of
    its margin. "In time": unlike that of a landing on a knot, the length of the step has to be found.
    """
    border, guess = scratch.border[0], first
    for _ in range(problem.law.size + 1):
        if land_on_bend_or_border(problem, tables, state, scratch, stop, border, guess):
            scratch.border[0] = border
            return stop, True
        if scratch.border[0] < 0 or scratch.landed[ELEMENT] < 0:
            break
        stop, border = scratch.landed[ELEMENT], scratch.landed[BORDER]
        scratch.ahead[SLOPE] = 0.0
    return stop, False


@part(GO_BEYOND, types.void, types.int64, types.boolean)
def go_beyond(problem, state, scratch, stop, alone):
    """Begin what follows a bend, or a border and, unless ``alone``, others reached with it."""
    border = scratch.border[0]
    if border < 0:
        scratch.side[stop] = -scratch.side[stop]
    elif alone:
        renew_border(problem, state, scratch, stop, border)
    else:
        renew_all(problem, state, scratch, stop, border)
