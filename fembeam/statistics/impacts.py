"""Statistics of the contacts of one stop, in constant memory.

row of a batch: [time, time in contact, entries, contacts, Σa, Σa², Σb, Σb², …]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fembeam.statistics.batches import Batches, Estimate
from fembeam.statistics.scales import RATE

if TYPE_CHECKING:
    import solvers

Vector = NDArray[np.float64]
QUANTITIES = ("duration", "peak_force", "entry_speed", "energy_loss")
TIME, TOUCHING, ENTRIES, CONTACTS, SUMS = range(5)


class Impacts:
    """Rate, share of time, and means of the contacts of one stop, each with its standard error.

    Attributes
    ----------
    largest : the largest duration (s), peak_force (N), entry_speed (m/s), energy_loss (J) met; NaN without a contact.

    Notes
    -----
    Entries count where they fall, time in contact where it passes, so neither is biased by where batches end. A contact
    counts for the means in the batch it began in, unless it has not ended when a segment of the run ends. One that is
    under way when a run begins counts as time in contact only: it began before.
    """

    def __init__(self) -> None:
        self.batches = Batches(SUMS + 2 * len(QUANTITIES))
        self.largest = dict.fromkeys(QUANTITIES, math.nan)

    def add(self, log: solvers.ContactLog, stop: int, start: float, end: float) -> None:
        """One batch: what the log says of a stop between two times (s)."""
        t_out = np.where(np.isnan(log.t_out), end, log.t_out)
        mine = (log.stop == stop) & (log.t_in < end) & (t_out > start)
        entered = mine & (log.t_in >= start) & (log.t_in > 0.0)
        whole = entered & np.isfinite(log.t_out)
        row = np.zeros(self.batches.rows.shape[1])
        row[TIME] = end - start
        row[TOUCHING] = (np.minimum(t_out[mine], end) - np.maximum(log.t_in[mine], start)).sum()
        row[ENTRIES], row[CONTACTS] = np.count_nonzero(entered), np.count_nonzero(whole)
        for i, (name, values) in enumerate(self._columns(log, whole).items()):
            row[SUMS + 2 * i : SUMS + 2 * i + 2] = values.sum(), (values**2).sum()
            self.largest[name] = float(np.fmax.reduce([self.largest[name], *values]))
        self.batches.add(row)

    def arrays(self) -> dict[str, Vector]:
        """All it holds, to be kept in a file."""
        return {"largest": np.array([self.largest[name] for name in QUANTITIES]), **self.batches.arrays()}

    def take(self, arrays: Mapping[str, Vector]) -> None:
        """Go on from the `arrays` of another one."""
        self.largest = dict(zip(QUANTITIES, map(float, arrays["largest"]), strict=True))
        self.batches.take(arrays)

    @staticmethod
    def _columns(log: solvers.ContactLog, kept: NDArray[np.bool_]) -> dict[str, Vector]:
        """The four quantities of the contacts kept."""
        columns = (log.t_out - log.t_in, log.peak_force, log.speed_in, log.energy_loss)
        return {name: column[kept] for name, column in zip(QUANTITIES, columns, strict=True)}

    @property
    def number(self) -> int:
        """Contacts that began."""
        return int(self.batches.total[ENTRIES])

    @property
    def rate(self) -> Estimate:
        """Contacts that begin per second."""
        return self._share(ENTRIES)

    @property
    def probability(self) -> Estimate:
        """Share of the time spent in contact."""
        return self._share(TOUCHING)

    def _share(self, place: int) -> Estimate:
        """A sum by time; its error is not known where it is 0."""
        return self.batches.estimate(lambda s: s[place] / s[TIME], RATE).if_met(self.batches.total[place] > 0.0)

    def mean(self, quantity: str) -> Estimate:
        """Mean per contact of duration (s), peak_force (N), entry_speed (m/s) or energy_loss (J)."""
        i = self._place(quantity)
        return self.batches.estimate(lambda s: s[i] / s[CONTACTS] if s[CONTACTS] else math.nan)

    def std(self, quantity: str) -> Estimate:
        """Standard deviation over the contacts."""
        i = self._place(quantity)
        return self.batches.estimate(
            lambda s: (
                math.sqrt(max(s[i + 1] / s[CONTACTS] - (s[i] / s[CONTACTS]) ** 2, 0.0)) if s[CONTACTS] else math.nan
            )
        )

    @staticmethod
    def _place(quantity: str) -> int:
        """Where its sum stands in a row."""
        if quantity not in QUANTITIES:
            raise ValueError(f"a contact has no quantity {quantity!r}; it has {', '.join(QUANTITIES)}")
        return SUMS + 2 * QUANTITIES.index(quantity)
