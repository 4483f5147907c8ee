"""When a shot may begin: while every stop whose law latches its entry rate is open."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from solvers.orbits.shots import Chain
from solvers.problem import Array, Contact, ContactLog, System


def latches(contact: Contact) -> bool:
    """Whether a law's force depends on the rate at which the contact was entered."""
    delta, rate = np.array([1e-6, 1e-4, 1e-2]), max(0.1, contact.law.entry_rate_floor)
    return bool(np.any(contact.law.force(delta, rate, rate) != contact.law.force(delta, rate, 2.0 * rate)))


def latching_stops(system: System) -> list[int]:
    """The stops whose law depends on the entry rate."""
    contacts = enumerate(system.contacts)
    return system.about_laws.get("latching", lambda: [s for s, one in contacts if latches(one)])


def open_intervals(
    system: System, contacts: ContactLog, period: float, passed: Array | None = None
) -> list[tuple[float, float]]:
    """Intervals of a period in which all stops are open; if there are none, those whose law latches the entry rate.

    They are divided at the times ``passed`` at which laws with memory reach borders.
    """
    ends = np.where(np.isnan(contacts.t_out), period, contacts.t_out)
    for stops in (range(len(system.contacts)), latching_stops(system)):
        mine = np.isin(contacts.stop, list(stops))
        open_spans, end = [], 0.0
        found = list(zip(contacts.t_in[mine], ends[mine], strict=True))
        found += [(0.0, left - period) for _, left in found if left > period]  # what goes on in the next period
        for start, left in [*sorted(found), (period, period)]:
            if start > end:
                open_spans.append((float(end), float(start)))
            end = max(end, left)
        if open_spans:
            return open_spans if passed is None else [part for span in open_spans for part in _cut(*span, passed)]
    return []


def _cut(start: float, end: float, at: Array) -> Iterator[tuple[float, float]]:
    """The parts of an interval, divided at times."""
    return pairwise([start, *sorted(at[(at > start) & (at < end)].tolist()), end])


def open_starts(
    system: System, contacts: ContactLog, period: float, count: int, zero: bool, passed: Array | None = None
) -> list[float]:
    """Times for the starts of ``count`` shots: zero if asked for, then the middles of the longest open intervals.

    Fewer if there is no open interval.
    """
    open_spans = open_intervals(system, contacts, period, passed)
    starts = [0.0] if zero else []
    while open_spans and len(starts) < count:
        a, b = open_spans.pop(max(range(len(open_spans)), key=lambda i: open_spans[i][1] - open_spans[i][0]))
        starts.append(0.5 * (a + b))
        open_spans += [(a, starts[-1]), (starts[-1], b)]
    return sorted(starts)


def closed(system: System, x: Array, stops: Sequence[int]) -> bool:
    """Whether any of these stops is closed in a state; elements that always act are no stops."""
    contacts = [system.contacts[s] for s in stops if not system.contacts[s].always]
    return any(contact.indentation(x[: system.size]) > 0.0 for contact in contacts)


def is_cut(chain: Chain, system: System) -> bool:
    """Whether a contact whose law latches the entry rate is under way where a shot begins."""
    logs = [solution.contacts for solution in chain.solutions]
    latched = [np.isin(one.stop, latching_stops(system)) for one in logs]
    return any(
        np.any(mine & ((one.t_in == 0.0) | np.isnan(one.t_out))) for mine, one in zip(latched, logs, strict=True)
    )
