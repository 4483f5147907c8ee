"""Laws that act in parallel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import chain, pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law

HEAD = 11  # numbers before those of each part; as in `contacts.sum_kernels`, which is slow to import


@dataclass(frozen=True)
class Sum(Law):
    """Laws in parallel, ``F = F_1 + F_2 + ...``; written ``law_a + law_b``.

    Each part keeps its own floor of the entry rate. Beside laws with memory, which may act at both signs of δ, laws of
    stops act while δ > 0, with the entry rate of that contact; all laws without memory do so beside one that opens.
    Then contacts are logged from δ = 0 to δ = 0; of several laws with memory alone they are not logged.

    Parameters
    ----------
    parts : the laws F_1, F_2, ...

    Examples
    --------
    >>> from contacts import Hertz, KelvinVoigt
    >>> float((Hertz(1e9) + KelvinVoigt(1e6, 100.0)).force(1e-4, 0.5))
    1150.0
    """

    parts: tuple[Law, ...]

    def __post_init__(self) -> None:
        wrong = (
            [part for part in self.parts if not isinstance(part, Law)]
            if isinstance(self.parts, (tuple, list))
            else [self.parts]
        )
        if wrong or not self.parts:
            raise ValueError(f"parts of Sum must be contact laws, at least one, got {wrong[0] if wrong else ()!r}")

    home: ClassVar[str] = "contacts.sum_kernels"
    compiled: ClassVar[str] = "parallel"
    equation: ClassVar[str] = "F = sum of the laws below"

    @property
    def knots(self) -> tuple[float, ...]:  # type: ignore[override]
        """The knots of all parts."""
        return tuple(sorted({knot for part in self.parts for knot in part.knots}))

    @property
    def jump(self) -> bool:  # type: ignore[override]
        """Whether any part jumps."""
        return any(part.jump for part in self.parts)

    @property
    def exponent(self) -> float:  # type: ignore[override]
        """The smallest."""
        return min(part.exponent for part in self.parts)

    @property
    def powers(self) -> tuple[float, ...]:
        """Those of all parts."""
        return tuple(sorted({power for part in self.parts for power in part.powers}))

    @property
    def bend(self) -> str | None:
        """That of the parts if they have but one at the same place: a cut part's is not at a zero of the sum."""
        bends = {part.bend for part in self.parts}
        return "rate" if bends <= {"rate", None} and "rate" in bends else None

    @property
    def entry_rate_floor(self) -> float:  # type: ignore[override]
        """The smallest; the others are applied inside."""
        return min(part.entry_rate_floor for part in self.parts)

    @property
    def acting(self) -> tuple[Law, ...]:
        """The parts, those of stops behind gates if others have a memory; before the rest if these open."""
        remembering = [part for part in self.parts if part.memory]
        opens = any(part.opens for part in remembering)
        gated = [bool(remembering) and not part.memory and (opens or part.one_sided) for part in self.parts]
        acting = [Gated(part) if gate else part for part, gate in zip(self.parts, gated, strict=True)]
        return tuple(sorted(acting, key=lambda part: opens and not isinstance(part, Gated)))

    @property
    def opens(self) -> bool:  # type: ignore[override]
        """Whether it is open where δ <= 0, as its first part's gate says: all parts open, and one is behind a gate."""
        acting = self.acting
        return isinstance(acting[0], Gated) and all(part.opens for part in acting)

    @property
    def one_sided(self) -> bool:  # type: ignore[override]
        """Whether any part is; of laws with memory, whether all of these are."""
        remembering = [part.one_sided for part in self.parts if part.memory]
        return all(remembering) if remembering else any(part.one_sided for part in self.parts)

    @property
    def jumps(self) -> bool:  # type: ignore[override]
        """Whether any part jumps at a border."""
        return any(part.jumps for part in self.acting)

    @property
    def reach(self) -> float:  # type: ignore[override]
        """The largest."""
        return max(part.reach for part in self.parts)

    @property
    def borders(self) -> int:  # type: ignore[override]
        """Those of all parts, in order."""
        return sum(part.borders for part in self.acting)

    @property
    def events(self) -> tuple[str, ...]:  # type: ignore[override]
        """Those of all parts, in order."""
        return tuple(chain.from_iterable(part.events for part in self.acting))

    @property
    def segment_codes(self) -> tuple[tuple[float, ...], ...]:  # type: ignore[override]
        """Those of all parts, in order."""
        return tuple(chain.from_iterable(part.segment_codes or ((),) * len(part.memory) for part in self.acting))

    @property
    def memory(self) -> tuple[int, ...]:  # type: ignore[override]
        """Places of the latched numbers of all parts, in order."""
        if not any(part.memory for part in self.acting):
            return ()
        return tuple(
            start + place for part, (start, _) in zip(self.acting, self._spans(), strict=True) for place in part.memory
        )

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(count, then per part: head, parameters).

        A head is (address, address of its derivatives, floor, size, addresses of the four kernels of its memory or
        zeros, number of borders, of latched numbers, of events). Addresses lie below 2**53: exact as floats.
        """
        numbers: list[NDArray] = [np.array([len(self.acting)], dtype=float)]
        for part in self.acting:
            own = part.parameters
            head = [part.address, part.gradient_address, part.entry_rate_floor, own.size]
            head += [part.borders_address, part.renew_address]
            head += [part.memory_gradient_address, part.renew_gradient_address]
            head += [part.borders, len(part.memory), len(part.events)]
            numbers += [np.array(head, dtype=float), own]
        return np.concatenate(numbers)

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """Energy stored by all parts, J."""
        spans = self._spans()
        return sum(part.stored(delta, parameters[a:b]) for part, (a, b) in zip(self.acting, spans, strict=True))

    def _spans(self) -> list[tuple[int, int]]:
        """Where the parameters of each part begin and end."""
        ends = np.cumsum([1] + [HEAD + part.parameters.size for part in self.acting]).tolist()
        return [(start + HEAD, end) for start, end in pairwise(ends)]


@dataclass(frozen=True)
class Gated(Law):
    """A law of stops as one with memory: it acts while δ > 0 and latches the rate at entry; made by `Sum`."""

    law: Law

    home: ClassVar[str] = "contacts.sum_kernels"
    compiled: ClassVar[str] = "gated"
    memory: ClassVar[tuple[int, ...]] = (0, 1)  # type: ignore[misc]
    borders: ClassVar[int] = 1  # type: ignore[misc]
    events: ClassVar[tuple[str, ...]] = ("contact", "open")  # type: ignore[misc]
    segment_codes: ClassVar[tuple[tuple[float, ...], ...]] = ((0.0, 1.0), ())  # type: ignore[misc]
    opens: ClassVar[bool] = True  # type: ignore[misc]

    @property
    def jumps(self) -> bool:  # type: ignore[override]
        """Whether the force does when contact begins."""
        return self.law.jump

    @property
    def knots(self) -> tuple[float, ...]:  # type: ignore[override]
        """Those of the law."""
        return self.law.knots

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(code, rate at entry, floor, address, address of the derivatives, those of the law), open at first."""
        law = self.law
        return np.array([0.0, 0.0, law.entry_rate_floor, law.address, law.gradient_address, *law.parameters])

    def stored(self, delta: float, parameters: NDArray[np.float64]) -> float:
        """What the law stores for δ > 0, J."""
        return self.law.stored(delta, parameters[5:]) if delta > 0.0 else 0.0


def parts_of(law: Law) -> tuple[Law, ...]:
    """The laws that act in parallel in one law."""
    return law.parts if isinstance(law, Sum) else (law,)


def parallel(laws: list[Law]) -> Law:
    """All laws at once, as ``laws[0] + laws[1] + ...``; for scene files. ValueError for an empty list.

    Examples
    --------
    >>> from contacts import Hertz, KelvinVoigt
    >>> float(parallel([Hertz(1e9), KelvinVoigt(1e6, 0.0)]).force(1e-4))
    1100.0
    """
    if not isinstance(laws, (list, tuple)) or not laws or not all(isinstance(one, Law) for one in laws):
        raise ValueError(f"laws must be a list of contact laws, at least one, got {laws!r}")
    return reduce(lambda a, b: a + b, laws)
