"""The end of a segment of a law: a step ends on a surface or knot, on a bend, or on a border of a law with memory.

If another stop reaches its own border before, that is landed on instead. Then the next segment begins: the next one of
the law, the other side of a bend, or one with newly latched numbers.
"""

from __future__ import annotations

import numpy as np
from numba import types

from solvers.compiled.kernels import REAL, indentation
from solvers.compiled.parts import FIRST_END, GO_BEYOND, LAND, LAND_IN_TIME, part
from solvers.exponential.contact.borders import border_ahead, renew_all, renew_border
from solvers.exponential.contact.crossings import UNRESOLVED, first_bend
from solvers.exponential.contact.landing import land, land_on_bend_or_border
from solvers.exponential.contact.node_response import LANDED


@part(LAND, types.Tuple((*[types.int64] * 4, types.boolean)), types.int64, types.int64, REAL)
def land_first(run, stop, direction, time_to_knot):
    """Land on the knot reached first, be it that of another stop: (stop, direction, and the last three of `Landing`).

    The stop is -1 on failure.
    """
    problem = run.problem
    for _ in range(problem.law.size + 1):
        landed = land(run, stop, direction, time_to_knot)
        if landed.stop == stop or landed.stop < 0:
            return landed.stop, direction, landed.element, landed.border, landed.opened
        stop = landed.stop
        above = indentation(problem, stop, run.scratch.stages[LANDED]) > problem.knots[stop, run.state.segment[stop]]
        direction = 1 if above else -1
    return -1, 0, -1, -1, False


@part(FIRST_END, types.Tuple((REAL, types.int64, types.int64, REAL)), types.int64, types.int64, types.boolean)
def first_end(run, node_set, level, is_new):
    """(time after the start, element, border, slope) of the first bend or border that the step just tried crosses.

    The border is -1 of a bend; the slope is that of its margin by time, 0 if it is not known. The element is -1 if
    there is none, `UNRESOLVED` if the step is too long to decide.
    """
    first, stop = first_bend(run, node_set, level, is_new)
    time, element, border, slope = border_ahead(run, node_set, level)
    if min(stop, element) == UNRESOLVED and level < run.tables.contact_step.size - 1:
        return np.inf, UNRESOLVED, -1, 0.0
    return (time, element, border, slope) if time < first else (first, stop, -1, 0.0)


_ON = types.Tuple((types.int64, types.int64, types.boolean))


@part(LAND_IN_TIME, _ON, types.int64, types.int64, REAL, REAL, types.boolean)
def land_in_time(run, element, border, time, slope, opened):
    """Land on a bend or border, ``time`` s ahead, or on a border reached before; (element, border, success).

    ``border`` is -1 of a bend; ``slope`` is that of its margin there, 0 if it is not known; ``opened`` is that of
    `Landing`. "In time": unlike that of a landing on a knot, the length of the step has to be found.
    """
    is_bend = border < 0
    for _ in range(run.problem.law.size + 1):
        landed = land_on_bend_or_border(run, element, border, time, slope, opened)
        if landed.stop >= 0:
            return element, border, True
        if is_bend or landed.element < 0:
            break
        element, border, slope, opened = landed.element, landed.border, 0.0, False
    return element, border, False


@part(GO_BEYOND, types.void, types.int64, types.int64, types.boolean)
def go_beyond(run, element, border, alone):
    """Begin what follows a bend, -1, or a border and, unless ``alone``, others reached with it."""
    if border < 0:
        run.scratch.side[element] = -run.scratch.side[element]
    elif alone:
        renew_border(run, element, border)
    else:
        renew_all(run, element, border)
