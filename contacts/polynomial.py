"""A stop whose force is a polynomial of the indentation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import LARGEST_OF_POWERS, finite_row


@dataclass(frozen=True)
class Polynomial(Law):
    """Elastic polynomial law, F = Σ_j c_j δ^j with j = 1..k.

    Parameters
    ----------
    coefficients : (k,) c_1, c_2, ..., N/m^j, finite; zeros may lead, and the first that is not zero is positive.

    Raises
    ------
    ValueError for no coefficient, one that is not a finite number, or a first non-zero one that is negative.

    Notes
    -----
    With all c_j >= 0 the force never pulls and the restitution is 1. A negative c_j may let it pull over a range of
    indentation, as a snap-through spring does; `describe` gives the range. If the last c_j is negative, a fast mass
    may never come back: `restitution` raises ValueError there.

    Examples
    --------
    >>> bumper = Polynomial([1e5, 0.0, 1e9])
    >>> float(bumper.force(1e-2))
    2000.0
    """

    coefficients: Sequence[float]

    compiled: ClassVar[str] = "polynomial"
    kinds: ClassVar[dict[str, str]] = {"polynomial": ""}
    equation: ClassVar[str] = "F = Σ coefficients[j-1] δ^j, j = 1..k"
    units: ClassVar[dict[str, str]] = {"coefficients": "N/m^j"}
    one_sided: ClassVar[bool] = False  # type: ignore[misc]

    def __post_init__(self) -> None:
        values = finite_row(self.coefficients, "coefficients of Polynomial", LARGEST_OF_POWERS, 1.0 / LARGEST_OF_POWERS)
        if not next(iter(values[values != 0.0]), 0.0) > 0.0:
            raise ValueError(
                "coefficients of Polynomial must be finite, the first non-zero one positive, got "
                f"{self.coefficients!r}; give c_1, c_2, ... of F = c_1 δ + c_2 δ² + ..."
            )
        object.__setattr__(self, "coefficients", tuple(values.tolist()))

    @property
    def powers(self) -> tuple[float, ...]:
        """The exponents of all terms."""
        return tuple(float(j) for j, c in enumerate(self.coefficients, start=1) if c != 0.0)

    @property
    def exponent(self) -> float:  # type: ignore[override]
        """That of the first term."""
        return self.powers[0]

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(k, c_1, ..., c_k)."""
        return np.array([len(self.coefficients), *self.coefficients])

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """Where it pulls."""
        if min(self.coefficients) >= 0.0:
            return ("never pulls; smooth",)
        roots = np.roots(self.coefficients[::-1])
        zeros = sorted(root.real for root in roots if root.real > 0.0 and abs(root.imag) <= 1e-9 * abs(root))
        if not zeros:
            return ("never pulls; smooth",)
        return (
            f"force zero at δ = {', '.join(f'{zero:.4g}' for zero in zeros)} m; pulls where it is negative; smooth",
        )

    def exact_restitution(self, entry_rate: float, mass: float) -> float | None:
        """Elastic: 1; found by integration if a coefficient is negative, since the mass may never come back."""
        return 1.0 if min(self.coefficients) >= 0.0 else None
