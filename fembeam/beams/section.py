"""Cross-sections of a beam: E in N/m², rho in kg/m³, A in m², I in m⁴ (about the bending axis).

The two numbers that the beam equation needs are EI (bending stiffness) and ρA (mass per metre); stress also needs
the distance of the outer fibre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.support import require, require_positive


@dataclass(frozen=True)
class Section:
    """A cross-section with its material: EI u'''' + ρA ü = 0.

    Parameters
    ----------
    E : Young's modulus, N/m², > 0.
    rho : mass density, kg/m³, > 0.
    A : area, m², > 0.
    I : second moment of area about the bending axis, m⁴, > 0.
    fibre : distance of the outer fibre from the neutral axis, m, > 0; None: unknown, no stress is computed.

    Raises
    ------
    ValueError : a value is not a finite positive number.

    Notes
    -----
    Slender beams: shear deformation and the section's own rotary inertia are neglected.

    Examples
    --------
    >>> Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12).bending_stiffness
    3.515
    """

    E: float
    rho: float
    A: float
    I: float
    fibre: float | None = None

    def __post_init__(self) -> None:
        require_positive("E", self.E, "Section", "give Young's modulus in N/m²")
        require_positive("rho", self.rho, "Section", "give the mass density in kg/m³")
        require_positive("A", self.A, "Section", "give the area in m²")
        require_positive("I", self.I, "Section", "give the second moment of area in m⁴")
        if self.fibre is not None:
            require_positive("fibre", self.fibre, "Section", "give the distance of the outer fibre in m, or None")

    @classmethod
    def rectangle(cls, E: float, rho: float, width: float, height: float) -> Section:
        """Solid rectangle bending over its height (m): A = b h, I = b h³/12."""
        require_positive("width", width, "Section.rectangle", "give the width in m")
        require_positive("height", height, "Section.rectangle", "give the height in the bending plane in m")
        return cls(E, rho, width * height, width * height**3 / 12, height / 2)

    @classmethod
    def circle(cls, E: float, rho: float, diameter: float) -> Section:
        """Solid circle (m): A = π d²/4, I = π d⁴/64."""
        require_positive("diameter", diameter, "Section.circle", "give the diameter in m")
        return cls(E, rho, math.pi * diameter**2 / 4, math.pi * diameter**4 / 64, diameter / 2)

    @classmethod
    def tube(cls, E: float, rho: float, outer: float, inner: float) -> Section:
        """Round tube of outer and inner diameter (m): A = π (D² - d²)/4, I = π (D⁴ - d⁴)/64."""
        require_positive("outer", outer, "Section.tube", "give the outer diameter in m")
        require_positive("inner", inner, "Section.tube", "give the inner diameter in m, or use Section.circle")
        require(inner < outer, f"inner must be below outer = {outer}", inner, "Section.tube", "swap the two")
        return cls(E, rho, math.pi * (outer**2 - inner**2) / 4, math.pi * (outer**4 - inner**4) / 64, outer / 2)

    @property
    def bending_stiffness(self) -> float:
        """EI in N m²."""
        return self.E * self.I

    @property
    def line_mass(self) -> float:
        """ρA in kg/m."""
        return self.rho * self.A

    def profile(self, x: ArrayLike) -> Profile:
        """What the beam equation reads at x (k,) in [0, 1] of a span: here the same everywhere."""
        fibre = math.nan if self.fibre is None else self.fibre
        return Profile(*(np.full(np.shape(x), value) for value in (self.E, self.rho, self.A, self.I, fibre)))


@dataclass(frozen=True)
class Taper:
    """A section that changes linearly from `start` to `end` of its span, in width and in height.

    Of the rectangle with the same A and I (height √(12 I/A), width A/height) both sides vary linearly: exact for
    rectangles whose width or height or both taper, for solid cones and for similar tubes.

    Parameters
    ----------
    start, end : Section, of one material (same E and rho).

    Raises
    ------
    TypeError : not a Section. ValueError : two materials.

    Examples
    --------
    >>> wedge = Taper(Section.rectangle(1.0, 1.0, 1.0, 2.0), Section.rectangle(1.0, 1.0, 1.0, 1.0))
    >>> float(wedge.profile(0.5).I * 12 / 1.5**3)
    1.0
    """

    start: Section
    end: Section

    def __post_init__(self) -> None:
        for name, section in (("start", self.start), ("end", self.end)):
            if not isinstance(section, Section):
                raise TypeError(f"{name} must be a Section, got {section!r} in Taper; make one first")
        same = (self.start.E, self.start.rho) == (self.end.E, self.end.rho)
        require(same, "start and end must have the same E and rho", (self.start, self.end), "Taper",
                "use several spans for several materials")  # fmt: skip

    def profile(self, x: ArrayLike) -> Profile:
        """What the beam equation reads at x (k,) in [0, 1] of the span."""
        share = np.asarray(x, dtype=float)
        first, last = self.start.profile(share), self.end.profile(share)
        height, width, fibre = (
            (1 - share) * a + share * b
            for a, b in ((_height(first), _height(last)), (_width(first), _width(last)), (first.fibre, last.fibre))
        )
        return Profile(first.E, first.rho, width * height, width * height**3 / 12, fibre)


class Profile(NamedTuple):
    """Section properties at k places: each (k,); `fibre` is NaN where unknown."""

    E: NDArray[np.float64]
    rho: NDArray[np.float64]
    A: NDArray[np.float64]
    I: NDArray[np.float64]
    fibre: NDArray[np.float64]


def _height(profile: Profile) -> NDArray[np.float64]:
    """Height of the rectangle with the same A and I."""
    return np.sqrt(12 * profile.I / profile.A)


def _width(profile: Profile) -> NDArray[np.float64]:
    """Width of the rectangle with the same A and I."""
    return profile.A / _height(profile)
