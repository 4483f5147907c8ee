"""Cross-sections of a beam: E in N/m², rho in kg/m³, A in m², I in m⁴ (about the bending axis).

The two numbers that the beam equation needs are EI (bending stiffness) and ρA (mass per metre).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real


def is_finite(value: object) -> bool:
    """Whether value is a real, finite number (booleans are not numbers here)."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def require(valid: bool, rule: str, got: object, where: str, advice: str) -> None:
    """Raise ValueError as `what, got, where; do` unless valid."""
    if not valid:
        shown = got if is_finite(got) or isinstance(got, float) else repr(got)
        raise ValueError(f"{rule}, got {shown} in {where}; {advice}")


def require_finite(name: str, value: object, where: str, advice: str) -> None:
    """Raise ValueError unless value is a finite number."""
    require(is_finite(value), f"{name} must be finite", value, where, advice)


def require_positive(name: str, value: object, where: str, advice: str) -> None:
    """Raise ValueError unless value is finite and > 0."""
    valid = is_finite(value) and value > 0  # type: ignore[operator]
    require(valid, f"{name} must be finite and positive", value, where, advice)


def require_non_negative(name: str, value: object, where: str, advice: str) -> None:
    """Raise ValueError unless value is finite and >= 0."""
    valid = is_finite(value) and value >= 0  # type: ignore[operator]
    require(valid, f"{name} must be finite and not negative", value, where, advice)


@dataclass(frozen=True)
class Section:
    """A cross-section with its material: EI u'''' + ρA ü = 0.

    Parameters
    ----------
    E : Young's modulus, N/m², > 0.
    rho : mass density, kg/m³, > 0.
    A : area, m², > 0.
    I : second moment of area about the bending axis, m⁴, > 0.

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

    def __post_init__(self) -> None:
        require_positive("E", self.E, "Section", "give Young's modulus in N/m²")
        require_positive("rho", self.rho, "Section", "give the mass density in kg/m³")
        require_positive("A", self.A, "Section", "give the area in m²")
        require_positive("I", self.I, "Section", "give the second moment of area in m⁴")

    @classmethod
    def rectangle(cls, E: float, rho: float, width: float, height: float) -> Section:
        """Solid rectangle bending over its height (m): A = b h, I = b h³/12."""
        require_positive("width", width, "Section.rectangle", "give the width in m")
        require_positive("height", height, "Section.rectangle", "give the height in the bending plane in m")
        return cls(E, rho, width * height, width * height**3 / 12)

    @classmethod
    def circle(cls, E: float, rho: float, diameter: float) -> Section:
        """Solid circle (m): A = π d²/4, I = π d⁴/64."""
        require_positive("diameter", diameter, "Section.circle", "give the diameter in m")
        return cls(E, rho, math.pi * diameter**2 / 4, math.pi * diameter**4 / 64)

    @classmethod
    def tube(cls, E: float, rho: float, outer: float, inner: float) -> Section:
        """Round tube of outer and inner diameter (m): A = π (D² - d²)/4, I = π (D⁴ - d⁴)/64."""
        require_positive("outer", outer, "Section.tube", "give the outer diameter in m")
        require_positive("inner", inner, "Section.tube", "give the inner diameter in m, or use Section.circle")
        require(inner < outer, f"inner must be below outer = {outer}", inner, "Section.tube", "swap the two")
        return cls(E, rho, math.pi * (outer**2 - inner**2) / 4, math.pi * (outer**4 - inner**4) / 64)

    @property
    def bending_stiffness(self) -> float:
        """EI in N m²."""
        return self.E * self.I

    @property
    def line_mass(self) -> float:
        """ρA in kg/m."""
        return self.rho * self.A
