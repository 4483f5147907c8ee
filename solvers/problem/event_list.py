"""Columns of the event list, the table that a run writes: one row an event; the contact log is read off it.

At an event an element passes to another segment of its law, by an entry, an exit, a knot, or a border of its memory.
"""

from __future__ import annotations

import numpy as np

from solvers.problem.matrices import Array

(ELEMENT, TIME, GUARD, FROM, TO, DELTA, RATE, FORCE, IMPULSE, WORK, DEEPEST, LARGEST, CLIPPED, CODE) = range(14)
"""The element; s; what it met, a border of its law or else as named below; its segment before and after, 0 while no
force acts; m, m/s and N as it was met, at the surface and at knots the angle in rad in a circular clearance for N, NaN
elsewhere; N s and J since the run began; largest m and N of the contact; whether the entry rate is the floor; the law's
code of what it did, of an entry that of a slider's segment."""
KNOT, BEGIN, FRICTION = -1.0, -2.0, -3.0
"""In GUARD: a knot or the surface; a contact that is under way as the run begins; no event, but what friction has done
by the begin or the end of a contact, with the angle in DELTA, ξ̇ in RATE, the slider's way in FORCE, and CLIPPED 1 at
the begin."""
NO_EVENTS = np.empty((0, CODE + 1))


def ends_of(rows: Array) -> Array:
    """Events by which contacts end."""
    return rows[(rows[:, FROM] > 0.0) & (rows[:, TO] == 0.0)]


def begins_of(rows: Array) -> Array:
    """Events by which they begin."""
    return rows[(rows[:, FROM] == 0.0) & (rows[:, TO] > 0.0)]


def angles_of(rows: Array) -> Array:
    """Angles in a circular clearance at begins and ends, rad; NaN also where a border of a law gives its force."""
    return np.where(rows[:, GUARD] < 0.0, rows[:, FORCE], np.nan)


def paired(begins: Array, ends: Array) -> tuple[Array, Array]:
    """The begin of the contact that each end ends, beside the ends; an element begins and ends in turn."""
    first = np.empty_like(ends)
    first[np.argsort(ends[:, ELEMENT], kind="stable")] = begins[np.argsort(begins[:, ELEMENT], kind="stable")]
    return first, ends
