"""Contact force as its mean over each sample, so that a contact between two samples is seen with its impulse.

    F_j = (1/w_j) ∫ F dt over the cell of sample j, which ends halfway to its neighbours;   Σ F_j w_j = Σ impulses

Impulses are those of the contact log. Of a contact over several cells the law says how its impulse is shared, on the
cubic through δ and δ̇ at entry, samples and exit.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.response.acceleration import model_of
from fembeam.response.contact_force import force_at
from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model import Run
    from solvers import ContactLog

Vector = NDArray[np.float64]
Motion = tuple[Vector, Vector, Vector]
FINER = 16  # parts of every piece of the cubic, on which the force is integrated


def mean_force(run: Run, stop: int) -> Vector:
    """Mean contact force (k,) of a stop over the cells of the samples, N; `Run.force` explains it."""
    stop %= len(run.stops)
    contact, t = model_of(run, "mean force").contact_rows[stop], run.t
    require(len(t) > 1, "the mean force needs samples", len(t), "Run.force", "give simulate a dt")
    edges = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2, t[-1:]])
    motion = (t, run.indentation(stop), run.indentation_rate(stop))
    if contact.always or contact.remembers:
        return np.diff(np.interp(edges, *_grown(partial(force_at, run, stop, contact), motion, edges))) / np.diff(edges)
    law, log = contact.law, run.contacts
    mine = np.flatnonzero(log.stop == stop)
    ends = np.where(np.isnan(log.t_out), t[-1], log.t_out)
    first, last = (np.searchsorted(edges, times[mine], side="right") - 1 for times in (log.t_in, ends))
    inside = (first == last) & (first >= 0) & (first < len(t))
    impulse = np.bincount(first[inside], log.impulse[mine[inside]], len(t)).astype(float)
    for entry in mine[~inside]:
        knots = _knots(log, entry, ends[entry], motion)
        impulse += log.impulse[entry] * _shares(law, abs(log.speed_in[entry]), knots, edges)
    return impulse / np.diff(edges)


def _shares(law: Any, speed: float, knots: Motion, edges: Vector) -> Vector:
    """Part (k,) of a contact's impulse in each cell."""
    rate = max(speed, law.entry_rate_floor)
    t, grown = _grown(lambda _, d, v: np.maximum(law.force(d, v, rate), 0.0), knots, edges)
    if not grown[-1] > 0.0:
        grown = t - t[0]
    return np.diff(np.interp(edges, t, grown / grown[-1]))


def _grown(force: Callable[[Vector, Vector, Vector], Any], knots: Motion, edges: Vector) -> tuple[Vector, Vector]:
    """Times, the edges within among them, and the impulse grown till then, of a force of t, δ and δ̇ on their cubic."""
    from scipy.integrate import cumulative_trapezoid
    from scipy.interpolate import CubicHermiteSpline

    t, delta, rate = knots
    fine = np.interp(np.arange(FINER * (len(t) - 1) + 1) / FINER, np.arange(len(t)), t)
    fine = np.union1d(fine, edges[(edges > t[0]) & (edges < t[-1])])
    cubic = CubicHermiteSpline(t, delta, rate)
    return fine, cumulative_trapezoid(force(fine, cubic(fine), cubic(fine, 1)), fine, initial=0.0)


def _knots(log: ContactLog, contact: int, end: float, motion: Motion) -> Motion:
    """Times, δ and δ̇ at entry, at the samples of a contact and at its exit; δ = 0 at both ends but where cut."""
    begin = log.t_in[contact]
    within = slice(np.searchsorted(motion[0], begin), np.searchsorted(motion[0], end, side="right"))
    t, delta, rate = (values[within] for values in motion)
    enters, leaves = int(not len(t) or t[0] > begin), int(not len(t) or t[-1] < end)
    return (
        np.concatenate([[begin] * enters, t, [end] * leaves]),
        np.concatenate([[0.0] * enters, delta, [0.0] * leaves]),
        np.concatenate([[log.speed_in[contact]] * enters, rate, [-log.speed_out[contact]] * leaves]),
    )
