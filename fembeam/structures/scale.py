"""Units of another program: millimetres, tonnes and seconds to SI."""

from __future__ import annotations

from dataclasses import dataclass

from fembeam.support import is_finite, require

LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
MASSES = {"kg": 1.0, "t": 1e3, "g": 1e-3, "mg": 1e-6, "lb": 0.45359237, "slug": 14.593902937206,
          "slinch": 175.126835246}  # fmt: skip
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


@dataclass(frozen=True)
class Scale:
    """The units in which matrices are given, one of length, of mass and of time; the structure is in SI.

    M of two displacements counts in the unit of mass, K in mass/time²; a rotation (rad) stands for a length each.

    Parameters
    ----------
    length, mass, time : such as "mm", "t", "s" (forces are then N, stresses MPa), or what one unit is in m, kg, s.

    Raises
    ------
    ValueError : an unknown unit (lists those there are), a number that is not positive.

    Examples
    --------
    >>> scale = Scale("mm", "t", "s")
    >>> scale.length, scale.mass, scale.stiffness  # 1 N/mm in N/m
    (0.001, 1000.0, 1000.0)
    """

    length: str | float = "m"
    mass: str | float = "kg"
    time: str | float = "s"

    def __post_init__(self) -> None:
        for name, known in (("length", LENGTHS), ("mass", MASSES), ("time", TIMES)):
            value = getattr(self, name)
            if isinstance(value, str):
                require(value in known, f"{name} must be one of {', '.join(known)}, or a number", value, "Scale",
                        "give what one unit is in SI")  # fmt: skip
                value = known[value]
            require(is_finite(value) and value > 0, f"{name} must be positive and finite", value, "Scale",
                    "give what one unit is in SI")  # fmt: skip
            object.__setattr__(self, name, float(value))

    @property
    def stiffness(self) -> float:
        """N/m of one unit of K between displacements."""
        return float(self.mass) / float(self.time) ** 2

    @property
    def damping(self) -> float:
        """N s/m of one unit of C between displacements."""
        return float(self.mass) / float(self.time)
