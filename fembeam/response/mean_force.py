"""Contact force as its mean over each sample: a contact between two samples is seen with its impulse.

    F_j = (1/w_j) ∫ F dt over the cell of sample j, which ends halfway to its neighbours;   Σ F_j w_j = Σ impulses

Impulses are those of the contact log, to the last sample. Of a contact over several cells the law says how its impulse
is shared, on the cubics through δ and δ̇ at entry, samples and exit, by Gauss-Legendre quadrature of each part within
one cell. Of what always acts the impulse from sample to sample is that of the run; it is divided at the middle by the
same quadrature.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.response.contact_force import force_at
from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.response.histories import Histories

Vector = NDArray[np.float64]
Cubics = tuple[Vector, Vector, Vector]  # t, δ, δ̇ where they start and where they end (3, p), where a cell ends (p,)
Force = Callable[[NDArray[np.int64], Vector, Vector, Vector], Vector]  # of the cubic's number, t, δ, δ̇
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
BLOCK = 2**17  # cubics at once, in some 100 MB


def mean_force(run: Histories, stop: int) -> Vector:
    """Mean contact force (k,) of a stop over the cells of the samples, N; `Run.force` explains it."""
    t = run.t
    require(len(t) > 1, "the mean force needs samples", len(t), "Run.force",
            "give simulate a dt below the duration")  # fmt: skip
    if run.readout.means is not None:
        return run.readout.means[stop]
    stop %= len(run.stops)
    contact = run.readout.model.contact_rows[stop]
    edges = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2, t[-1:]])
    motion = np.array([t, run.indentation(stop), run.indentation_rate(stop)])
    if contact.always or contact.remembers:
        force = partial(force_at, run, stop, contact)
        found = _impulses(lambda _, *at: force(*at), (motion[:, :-1], motion[:, 1:], edges[1:-1]))
        found += (_missed(run, stop, found.sum(axis=1)) / 2)[:, None]
        impulse = np.append(found[:, 0], 0.0) + np.append(0.0, found[:, 1])
    else:
        impulse = _of_log(run, stop, contact.law, motion, edges)
    return np.asarray(impulse / np.diff(edges))


def _missed(run: Histories, stop: int, found: Vector) -> Vector:
    """What impulses found from sample to sample (k - 1,) lack of those of the run; 0 where it does not tell."""
    kept = run.losses.impulses
    return 0.0 * found if kept is None else np.diff(kept[:, stop]) - found


def _of_log(run: Histories, stop: int, law: Any, motion: Vector, edges: Vector) -> Vector:
    """The log's impulses in each cell (k,): of contacts within a cell whole, of others in shares."""
    log, t = run.contacts, motion[0]
    seen = np.flatnonzero((log.stop == stop) & ~(log.t_out <= t[0]) & (log.t_in < t[-1]))
    if not len(seen):
        return np.zeros(len(t))
    starts, ends, impulses = _within_samples(run, stop, motion, seen)
    first, last = (np.searchsorted(edges, times, side="right") - 1 for times in (starts[0], ends[0]))
    whole = first == last
    impulse: Vector = np.bincount(first[whole], impulses[whole], len(t)).astype(float)
    if whole.all():
        return impulse
    owner, a, b = _between(motion, starts[:, ~whole], ends[:, ~whole])
    interval = np.clip(np.searchsorted(t, (a[0] + b[0]) / 2) - 1, 0, len(t) - 2)
    rates = np.maximum(np.abs(log.speed_in[seen[~whole]]), law.entry_rate_floor)[owner]
    parts = _shared(law, owner, rates, impulses[~whole], (a, b, edges[1:-1][interval]))
    for half in (0, 1):
        impulse += np.bincount(interval + half, parts[:, half], len(t))
    return impulse


def _within_samples(
    run: Histories, stop: int, motion: Vector, seen: NDArray[np.int64]
) -> tuple[Vector, Vector, Vector]:
    """Of the log's contacts (c,) t, δ, δ̇ (3, c) at entry and exit and impulses, from the first to the last sample.

    A run has the impulse up to every sample. What contacts that lie before it do not tell of that, the contact under
    way at the first or the last sample does.
    """
    log, (first, *_, last) = run.contacts, motion.T
    starts = np.array([log.t_in[seen], 0.0 * seen, log.speed_in[seen]])
    ends = np.array([log.t_out[seen], 0.0 * seen, -log.speed_out[seen]])
    impulses = log.impulse[seen]
    begun, lasts = starts[0] < first[0], ~(ends[0] <= last[0])
    if begun.any() or lasts.any():
        kept, mine = run.losses.impulses, log.stop == stop
        assert kept is not None  # of a run read from a file `mean_force` has returned
        before, after = (
            kept[k, stop] - log.impulse[mine & (log.t_out <= t)].sum() for k, t in ((0, first[0]), (-1, last[0]))
        )
        impulses = np.where(lasts, after, impulses) - np.where(begun, before, 0.0)
    return np.where(begun, first[:, None], starts), np.where(lasts, last[:, None], ends), impulses


def _between(motion: Vector, starts: Vector, ends: Vector) -> tuple[NDArray[np.int64], Vector, Vector]:
    """The cubics of contacts from entry (3, c) through samples to exit: whose each is, t, δ, δ̇ at both ends."""
    numbers = np.arange(starts.shape[1])
    low, high = np.searchsorted(motion[0], starts[0]), np.searchsorted(motion[0], ends[0], side="right")
    count = high - low
    within = np.arange(count.sum()) + np.repeat(low - np.cumsum(count) + count, count)
    owner = np.concatenate([numbers, np.repeat(numbers, count), numbers])
    order = np.argsort(owner, kind="stable")
    owner, points = owner[order], np.concatenate([starts, motion[:, within], ends], axis=1)[:, order]
    cubic = np.flatnonzero((np.diff(owner) == 0) & (np.diff(points[0]) > 0.0))
    return owner[cubic], points[:, cubic], points[:, cubic + 1]


def _shared(law: Any, owner: NDArray[np.int64], rates: Vector, impulses: Vector, cubics: Cubics) -> Vector:
    """Impulses (p, 2) on each cubic before and after its cell's end, which add up to those of the contacts (c,).

    What the law on cubics misses of those is divided as the sizes of what it finds; by time where F is 0.
    """
    found = _impulses(lambda cubic, _, d, v: law.force(d, v, rates[cubic]), cubics)
    sizes = np.abs(found)
    pushed = np.bincount(owner, sizes.sum(axis=1))[owner] > 0.0
    sizes[~pushed] = _halves(cubics)[~pushed]
    missed = impulses - np.bincount(owner, found.sum(axis=1), len(impulses))
    return np.asarray(found + sizes * (missed / np.bincount(owner, sizes.sum(axis=1), len(impulses)))[owner, None])


def _halves(cubics: Cubics) -> Vector:
    """Half the lengths (p, 2) of a cubic before and after its cell's end, s."""
    start, end = cubics[0][0], cubics[1][0]
    cut = np.clip(cubics[2], start, end)
    return np.array([cut - start, end - cut]).T / 2


def _impulses(force: Force, cubics: Cubics) -> Vector:
    """∫ F dt (p, 2) on each cubic before and after its cell's end."""
    halves = _halves(cubics)
    found = np.empty(halves.shape)
    for block in np.array_split(np.arange(len(found)), len(found) // BLOCK + 1):
        (start, d0, v0), (end, d1, v1) = (side[:, block, None, None] for side in cubics[:2])
        half, h = halves[block][..., None], end - start
        centre = np.concatenate([start + half[:, :1], end - half[:, 1:]], axis=1)
        t = centre + half * NODES
        s = (t - start) / h
        delta = (1 - s) ** 2 * ((1 + 2 * s) * d0 + s * h * v0) + s**2 * ((3 - 2 * s) * d1 + (s - 1) * h * v1)
        rate = (1 - s) * ((1 - 3 * s) * v0 - 6 * s * (d0 - d1) / h) + s * (3 * s - 2) * v1
        at = (np.repeat(block, t[0].size), t.ravel(), delta.ravel(), rate.ravel())
        found[block] = (force(*at).reshape(t.shape) * (half * WEIGHTS)).sum(axis=-1)
    return found
