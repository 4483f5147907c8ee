"""Cross-sections of a beam: E in N/m², rho in kg/m³, A in m², I in m⁴ (about the bending axis).

The two numbers that the beam equation needs are EI (bending stiffness) and ρA (mass per metre); stress also needs
the distance of the outer fibre. A frame in space bends in two planes and twists:

    EI = E [[I, I12], [I12, I2]],    GJ = E J/(2 (1 + ν)),    torsion inertia ρ (I + I2)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.support import is_finite, make_native, require, require_finite, require_positive

Shear: TypeAlias = float | tuple[float, float] | None


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
    I2, I12 : for frames in space: ∫ x² dA across and the product ∫ x y dA, where y is the way of bending with I and x
        across it; m⁴, I2 > 0 and I12² < I I2. Centroid and shear centre are taken as one.
    J : torsion constant of Saint-Venant, m⁴, > 0, for frames in space.
    nu : Poisson's ratio, -1 < ν ≤ 0.5, for torsion.
    fibre2 : distance of the outer fibre across, m, > 0.
    shear : shear coefficients κ for bending with I and with I2, in (0, 1.5], or one for both, such as 5/6 of a
        rectangle: frames then deform in shear and have rotary inertia (Timoshenko). None: neither.

    Raises
    ------
    ValueError : a value is not a finite positive number, or beyond its bounds.

    Notes
    -----
    Slender beams: shear deformation and the section's own rotary inertia are neglected but in frames with `shear`.

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
    I2: float | None = field(default=None, repr=False)  # what follows is for frames in space
    I12: float = field(default=0.0, repr=False)
    J: float | None = field(default=None, repr=False)
    nu: float = field(default=0.3, repr=False)
    fibre2: float | None = field(default=None, repr=False)
    shear: Shear = field(default=None, repr=False)

    def __post_init__(self) -> None:
        make_native(self)
        require_positive("E", self.E, "Section", "give Young's modulus in N/m²")
        require_positive("rho", self.rho, "Section", "give the mass density in kg/m³")
        require_positive("A", self.A, "Section", "give the area in m²")
        require_positive("I", self.I, "Section", "give the second moment of area in m⁴")
        if self.fibre is not None:
            require_positive("fibre", self.fibre, "Section", "give the distance of the outer fibre in m, or None")
        self._check_space()

    def _check_space(self) -> None:
        """Raise ValueError unless the numbers for frames in space, where given, are possible."""
        names = (("I2", "m⁴"), ("J", "m⁴"), ("fibre2", "m"))
        for name, unit in names:
            if getattr(self, name) is not None:
                require_positive(name, getattr(self, name), "Section", f"give it in {unit}, or None")
        require_finite("I12", self.I12, "Section", "give the product of area in m⁴")
        most = math.sqrt(self.I * self.I2) if self.I2 is not None else 0.0
        require(abs(self.I12) < most or self.I12 == 0, f"I12 must stay below √(I I2) = {most:g} m⁴", self.I12,
                "Section", "give I2 with it, and compute all three about one centroid")  # fmt: skip
        require_finite("nu", self.nu, "Section", "give Poisson's ratio", ", above -1 and at most 0.5",
                       is_finite(self.nu) and -1 < self.nu <= 0.5)  # fmt: skip
        if self.shear is not None:
            several = isinstance(self.shear, (tuple, list)) or np.ndim(self.shear) > 0
            given = list(self.shear) if several else [np.asarray(self.shear).tolist()] * 2  # type: ignore[arg-type]
            right = len(given) == 2 and all(is_finite(k) and 0 < k <= 1.5 for k in given)
            require(right, "shear must be one or two coefficients above 0, at most 1.5", self.shear, "Section",
                    "give 5/6 for a rectangle, 0.9 for a circle")  # fmt: skip
            object.__setattr__(self, "shear", tuple(map(float, given)))
            require(self.I12 == 0, "I12 must be 0 with shear", self.I12, "Section", "turn it to principal axes")

    @classmethod
    def rectangle(
        cls, E: float, rho: float, width: float, height: float, nu: float = 0.3, shear: Shear = None
    ) -> Section:
        """Solid rectangle bending over its height (m): A = b h, I = b h³/12, I2 = h b³/12; J by its series."""
        require_positive("width", width, "Section.rectangle", "give the width in m")
        require_positive("height", height, "Section.rectangle", "give the height in the bending plane in m")
        width, height = float(width), float(height)
        I, I2, J = width * height**3 / 12, height * width**3 / 12, _rectangle_torsion(width, height)
        return cls(E, rho, width * height, I, height / 2, I2, 0.0, J, nu, width / 2, shear)

    @classmethod
    def circle(cls, E: float, rho: float, diameter: float, nu: float = 0.3, shear: Shear = None) -> Section:
        """Solid circle (m): A = π d²/4, I = I2 = π d⁴/64, J = 2 I."""
        require_positive("diameter", diameter, "Section.circle", "give the diameter in m")
        diameter = float(diameter)
        I, fibre = math.pi * diameter**4 / 64, diameter / 2
        return cls(E, rho, math.pi * diameter**2 / 4, I, fibre, I, 0.0, 2 * I, nu, fibre, shear)

    @classmethod
    def tube(cls, E: float, rho: float, outer: float, inner: float, nu: float = 0.3, shear: Shear = None) -> Section:
        """Round tube of outer and inner diameter (m): A = π (D² - d²)/4, I = I2 = π (D⁴ - d⁴)/64, J = 2 I."""
        require_positive("outer", outer, "Section.tube", "give the outer diameter in m")
        require_positive("inner", inner, "Section.tube", "give the inner diameter in m, or use Section.circle")
        require(inner < outer, f"inner must be below outer = {outer}", inner, "Section.tube", "swap the two")
        outer, inner = float(outer), float(inner)
        I, fibre = math.pi * (outer**4 - inner**4) / 64, outer / 2
        return cls(E, rho, math.pi * (outer**2 - inner**2) / 4, I, fibre, I, 0.0, 2 * I, nu, fibre, shear)

    @property
    def bending_stiffness(self) -> float:
        """EI in N m²."""
        return self.E * self.I

    @property
    def line_mass(self) -> float:
        """ρA in kg/m."""
        return self.rho * self.A

    @property
    def torsion_stiffness(self) -> float:
        """GJ in N m², G = E/(2 (1 + ν)); NaN where J is unknown."""
        return math.nan if self.J is None else self.E / (2 * (1 + self.nu)) * self.J

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


def _rectangle_torsion(width: float, height: float) -> float:
    """J = a b³/3 (1 - 192 b/(π⁵ a) Σ tanh(n π a/2b)/n⁵), n = 1, 3, …; a ≥ b (Timoshenko & Goodier 1970, art. 109)."""
    a, b = max(width, height), min(width, height)
    n = np.arange(1, 400, 2)  # the rest of Σ 1/n⁵ is 5e-12
    return float(a * b**3 / 3 * (1 - 192 * b / (math.pi**5 * a) * np.sum(np.tanh(n * math.pi * a / (2 * b)) / n**5)))


def _height(profile: Profile) -> NDArray[np.float64]:
    """Height of the rectangle with the same A and I."""
    return np.sqrt(12 * profile.I / profile.A)


def _width(profile: Profile) -> NDArray[np.float64]:
    """Width of the rectangle with the same A and I."""
    return profile.A / _height(profile)
