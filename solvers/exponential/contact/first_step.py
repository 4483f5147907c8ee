"""The start of contact steps: reference speeds, length and nodes of the first one."""

from __future__ import annotations

import math

import numpy as np
from numba import types

from solvers.compiled.kernels import (
    dot,
    force_at,
    indentation,
    indentation_rate,
    inlined,
    inner,
    is_circle,
    merged,
    row_of,
    rubs,
    surface_tolerance,
)
from solvers.compiled.parts import BEGIN, part
from solvers.compiled.state import T_IN, T
from solvers.exponential.contact.crossings import choose_sides
from solvers.exponential.contact.node_response import note_swing, own_accelerance, swing_of
from solvers.exponential.contact.peaks import pressed_speed, state_peaks
from solvers.exponential.flight import energy_norms
from solvers.exponential.tables import EXPONENT, STIFFNESS

LEVEL, NODE_SET, NEW, STOP, NEXT_LEVEL, BEGUN, BALANCED = range(7)
"""Places in Scratch.control: level and node set of the last step; kind of the next one, see below; stop that entered
last; level of the next step; 1 once the run has begun; 1 if it keeps the energy balance."""
UNKNOWN = -1.0  # in Scratch.noise, of an element whose segment has just begun: its margins may have another unit
ENTRY, SEGMENT = 1, 2  # values of NEW: first step of a contact, or of a segment of its law; 0: any other step
_LEAST_SPEED = 1e-60  # m/s: lower bound of a reference speed, and of the speed of an impact
_PRESSED_SHARE = 1e-3  # of `pressed_speed` as a reference speed: a stop at rest under a force moves by rounding


@part(BEGIN, types.void, types.int64)
def begin_steps(run, stop):
    """Set reference speeds, level and nodes of the next step after ``stop`` has entered, changed its segment, or left.

    The reference speed of a stop that enters or is open is the largest of |δ̇|, a tenth of the bound of |δ̇| by the
    energy of the blocks, without what follows sampled signals, and 1e-3 of `pressed_speed`, m/s.
    """
    problem, state, scratch = run.problem, run.state, run.scratch
    control, others = scratch.control, False
    if run.tables.follows > 0.0:
        note_swing(run)
    energy_norms(problem, swing_of(run), scratch.norms)
    for s in range(problem.law.size):
        speed = abs(indentation_rate(problem, s, state.x))
        in_contact_before = state.segment[s] > 0 and state.active[s, T_IN] < state.now[T]
        if in_contact_before:
            scratch.reference_speed[s] = max(scratch.reference_speed[s], speed)
        else:
            reached = 0.1 * dot(run.tables.rate_weight[row_of(problem, s)], scratch.norms, problem.k.size)
            if is_circle(problem, s) or rubs(problem, s):
                second = dot(run.tables.rate_weight[row_of(problem, s) + 1], scratch.norms, problem.k.size)
                reached = math.hypot(reached, 0.1 * second)
            pressed = _PRESSED_SHARE * pressed_speed(run, s, scratch.trial)
            scratch.reference_speed[s] = max(speed, reached, pressed, _LEAST_SPEED)
        for j in range(problem.border_count[s] if s == stop or not in_contact_before else 0):
            scratch.noise[s, j] = UNKNOWN
        others |= in_contact_before
    control[NODE_SET], control[NEW] = 0, SEGMENT
    if state.segment[stop] > 0 and state.active[stop, T_IN] == state.now[T]:
        wanted = _first_step(run, stop)
        control[NEXT_LEVEL] = max(wanted, control[NEXT_LEVEL]) if others else wanted
        control[NODE_SET], control[NEW], control[STOP] = entry_nodes(run, stop, wanted), ENTRY, stop
    choose_sides(run)
    state_peaks(run, state.x)


@merged
def _contact_time(run, s, speed):
    """Duration, s, of an impact at a speed on one stop alone: T = 3.2 δ_m/v, where the law stores the energy at δ_m."""
    speed = max(speed, _LEAST_SPEED)
    accelerance = max(own_accelerance(run, s), 1e-300)
    target = 0.5 * speed * speed / accelerance
    law, p = run.tables.power_law[s], run.tables.exponent[s]
    if law[EXPONENT] > 0.0 and law[STIFFNESS] > 0.0:
        return 3.2 * (target * (p + 1.0) / law[STIFFNESS]) ** (1.0 / (p + 1.0)) / speed
    deepest = 1e-3 * speed
    for _ in range(4):
        energy = force_at(run.problem, s, deepest, 0.0, speed, run.scratch.trial) * deepest / (p + 1.0)
        if not energy > 0.0 or abs(target - energy) < 0.1 * target:
            break
        deepest *= (target / energy) ** (1.0 / (p + 1.0))
    return 3.2 * deepest / speed


@merged
def _first_step(run, stop):
    """Level of the first step of a contact: a share of the duration of an impact on this stop alone."""
    scratch = run.scratch
    speed = abs(indentation_rate(run.problem, stop, run.state.x))
    duration = _contact_time(run, stop, max(speed, 1e-3 * scratch.reference_speed[stop]))
    if scratch.first_step_share[stop] == 0.0:
        scratch.first_step_share[stop] = min(0.1, 4.0 / (run.tables.fastest * duration))
    scratch.duration[stop] = duration
    return level_of(run.tables, scratch.first_step_share[stop] * duration)


@merged
def entry_nodes(run, stop, level):
    """Node set of the next step: that of a stop just entered, whose force has broken powers, first ``stop``; else 0."""
    problem, state = run.problem, run.state
    found, just_now = 0, 1e-6 * run.tables.contact_step[level]
    for s in range(state.segment.size):
        if state.segment[s] == 1 and run.tables.time_exponent[1 + s] > 1.0 and (found == 0 or s == stop):
            rate = indentation_rate(problem, s, state.x)
            if indentation(problem, s, state.x) <= just_now * rate + 4.0 * surface_tolerance(problem, s, state.x):
                found = 1 + s
    return found


@inlined
def level_of(tables, h):
    """Level of the longest contact step up to h, or of the shortest one if that is longer."""
    last = tables.contact_step.size - 1
    j = min(max(int(np.ceil(2.0 * math.log2(tables.contact_step[0] / h))), 0), last)
    return j + 1 if tables.contact_step[j] > h and j < last else j


@inner
def latest_entered(state):
    """The stop in contact that was entered last, or -1."""
    stop = -1
    for s in range(state.segment.size):
        if state.segment[s] > 0 and (stop < 0 or state.active[s, T_IN] >= state.active[stop, T_IN]):
            stop = s
    return stop
