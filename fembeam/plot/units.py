"""Units of axes: with the prefix that suits what is shown, so that micro structures are read in µm, bridges in MN."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from fembeam.scene import turns_at

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
LEAST, MOST = 0.01, 2000.0  # of the largest number on an axis in its usual unit; beyond it takes another prefix
LARGEST = {"m": 0, "s": 0}  # no km, no ks


def unit_for(shown: Any, unit: str, usual: int = 0) -> tuple[float, str]:
    """Factor and name of the unit in which numbers are drawn, by the largest of them.

    Parameters
    ----------
    shown : in the SI unit: numbers, an array, or several of them; NaN does not count.
    unit : "m", "N or N m", …; its words take the prefix.
    usual : power of ten of the prefix kept while the largest is 0.01 to 2000 of it.

    Examples
    --------
    >>> unit_for([0.0, -5e-4], "m", usual=-3), unit_for(2e-8, "m", usual=-3), unit_for(3e4, "N or N m")
    ((1000.0, 'mm'), (1000000000.0, 'nm'), (0.001, 'kN or kN m'))
    """
    size = largest(shown)
    power = usual
    if size > 0.0 and not LEAST <= size / 10.0**usual <= MOST * (1 + 1e-9):
        top = min(LARGEST.get(unit, 9), 9)
        power = min(max(3 * math.floor(math.log10(size * (1 + 1e-9)) / 3), -9), top)
    return 10.0**-power, " or ".join(PREFIXES[power] + word for word in unit.split(" or "))


def length_for(shown: Any) -> tuple[float, str]:
    """Of lengths and displacements: mm, above 1 m in m, below 0.01 mm in µm or nm.

    Examples
    --------
    >>> length_for(0.02), length_for(2e-6), length_for(1.5)
    ((1000.0, 'mm'), (1000000.0, 'µm'), (1.0, 'm'))
    """
    return (1.0, "m") if largest(shown) > 1.0 else unit_for(shown, "m", usual=-3)


def signal_for(unit: str, shown: Any) -> tuple[float, str]:
    """Of a signal with this unit, which is empty where it is not known.

    Examples
    --------
    >>> signal_for("m", 2e-3), signal_for("rad", 2e-3), signal_for("", 2e-3)
    ((1000.0, 'mm'), (1000.0, 'mrad'), (1.0, ''))
    """
    if not unit:
        return 1.0, ""
    return length_for(shown) if unit == "m" else unit_for(shown, unit)


def motion_for(z: Any, shown: Any) -> tuple[float, str]:
    """Of what a place does: of a rotation rad, else as lengths.

    Examples
    --------
    >>> motion_for(("lever", "rx"), 2e-3), motion_for(("lever", "x"), 2e-3)
    ((1000.0, 'mrad'), (1000.0, 'mm'))
    """
    return signal_for("rad" if turns_at(z) else "m", shown)


def density_label(units: Iterable[str]) -> str:
    """What the axis of power spectral densities of signals in these units is called; without units where one has none.

    Examples
    --------
    >>> density_label(["m", "m"]), density_label(["m", "rad"]), density_label(["m", ""])
    ('PSD / m² s rad⁻¹', 'PSD / m² or rad² s rad⁻¹', 'PSD')
    """
    known = dict.fromkeys(units)
    return f"PSD / {' or '.join(f'{unit}²' for unit in known)} s rad⁻¹" if all(known) else "PSD"


def largest(shown: Any) -> float:
    """The largest finite size in numbers, arrays, or several of them; 0 where there is none."""
    if isinstance(shown, Iterable) and not isinstance(shown, np.ndarray):
        return max((largest(one) for one in shown), default=0.0)
    values = np.abs(np.asarray(shown, dtype=float))
    return float(values[np.isfinite(values)].max(initial=0.0))
