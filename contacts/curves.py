"""Laws given by a curve: piecewise linear, and a table of measured forces.

A clearance belongs to the stop (its ``gap``), and so does a preload (a negative ``gap``: the stop is compressed at
rest). A stop acts on one side; a body that moves between two sides has two stops, one below and one above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.numbers import LARGEST_PARAMETER, finite_row, read_columns

MOST_SHOWN = 8  # numbers of a kind in a repr
ROUNDING = 1e-12  # of the largest force: below zero by as much is zero, where slopes soften to nothing


@dataclass(frozen=True)
class PiecewiseLinear(Law):
    """Polyline from F(0) = 0 with slope ``slopes[j]`` before ``knots[j]``, and a dashpot per branch.

        F = F_j + k_j (δ - δ_j) + c_j δ̇    for δ_j < δ <= δ_j+1

    Parameters
    ----------
    slopes : m >= 1 stiffnesses k_j, N/m; the first positive; later ones may stiffen, or soften as long as F >= 0.
    knots : the m - 1 indentations δ_j (m) where the slope changes, ascending and positive.
    damping : c_j >= 0, N s/m: one for all branches, or m of them. The force jumps where it changes.

    Examples
    --------
    >>> fender = PiecewiseLinear([1e4, 1e6], knots=[1e-3])
    >>> fender.force([5e-4, 2e-3])
    array([   5., 1010.])
    """

    slopes: Sequence[float] | float
    knots: tuple[float, ...] = ()
    damping: Sequence[float] | float = 0.0

    compiled: ClassVar[str] = "piecewise"
    kinds: ClassVar[dict[str, str]] = {"piecewise_linear": ""}
    equation: ClassVar[str] = "F = F_j + slopes[j] (δ - knots[j-1]) + damping[j] δ̇ between two knots"
    units: ClassVar[dict[str, str]] = {"slopes": "N/m", "knots": "m", "damping": "N s/m"}

    def __post_init__(self) -> None:
        slopes, knots, damping = (self._row(name) for name in ("slopes", "knots", "damping"))
        damping = damping * len(slopes) if len(damping) == 1 else damping
        for name, values in (("slopes", slopes), ("knots", knots), ("damping", damping)):
            object.__setattr__(self, name, values)
        if not slopes or slopes[0] <= 0.0:
            raise ValueError(f"slopes of PiecewiseLinear must be at least one, the first positive, got {slopes}")
        if len(knots) != len(slopes) - 1:
            raise ValueError(f"PiecewiseLinear with {len(slopes)} slopes needs {len(slopes) - 1} knots, got {knots}")
        if not np.all(np.diff(knots, prepend=0.0) > 0.0):
            raise ValueError(f"knots of PiecewiseLinear must be finite, positive and ascending, got {knots}")
        if len(damping) != len(slopes) or min(damping) < 0.0:
            raise ValueError(
                f"damping of PiecewiseLinear must be finite and >= 0, one for all or {len(slopes)} (one per slope), "
                f"got {damping}"
            )
        corners = self._corner_forces()
        if np.any(corners < -ROUNDING * corners.max()) or (len(slopes) > 1 and slopes[-1] < 0.0):
            raise ValueError(f"slopes {slopes} of PiecewiseLinear soften to a negative force")

    def _row(self, name: str) -> tuple[float, ...]:
        """Numbers of one field."""
        return tuple(finite_row(getattr(self, name), f"{name} of PiecewiseLinear", LARGEST_PARAMETER).tolist())

    def _corner_forces(self) -> NDArray[np.float64]:
        """Elastic force at (0, knots...)."""
        rises = np.diff(self.knots, prepend=0.0) * np.asarray(self.slopes)[:-1]
        return np.concatenate((np.zeros(1), np.cumsum(rises)))

    @property
    def jump(self) -> bool:  # type: ignore[override]
        """The first branch's dashpot acts at once."""
        return bool(np.atleast_1d(self.damping)[0] > 0.0)

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(m, then knot, force, slope, 0, 0, damping of every piece)."""
        nothing = np.zeros(len(self._corner_forces()))
        pieces = (0.0, *self.knots), self._corner_forces(), self.slopes, nothing, nothing, self.damping
        return np.concatenate(([nothing.size], np.column_stack(pieces).ravel()))

    @property
    def remarks(self) -> tuple[str, ...]:  # type: ignore[override]
        """What a user should know."""
        damped = any(np.atleast_1d(self.damping))
        pulls = "pulls at the end of a rebound, where the dashpot outweighs the spring" if damped else "never pulls"
        return pulls, "integrators locate every knot; smooth between"

    def exact_restitution(self, entry_rate: float, mass: float) -> float | None:
        """Elastic without damping: 1."""
        return None if any(np.atleast_1d(self.damping)) else 1.0


@dataclass(frozen=True)
class Tabulated(Law):
    """Elastic force through measured points, by the monotone cubics of Fritsch and Butland (PCHIP).

        F = F_j + x (c_1j + x (c_2j + x c_3j)),  x = δ - δ_j    for δ_j < δ <= δ_j+1

    Parameters
    ----------
    indentation : (k,) m, ascending, >= 0; the point (0, 0) is added where it is missing.
    measured : (k,) N, not falling, >= 0. Beyond the last point the force goes on with its last slope.

    Raises
    ------
    ValueError for points that do not fit together, fall, or do not begin at (0, 0).

    Notes
    -----
    Between points the force is monotone and its slope continuous; the curvature jumps at the points, so integrators
    locate each. Thin out a dense table first: every point costs two located events per contact.

    References
    ----------
    F.N. Fritsch, J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300.

    Examples
    --------
    >>> rubber = Tabulated([1e-3, 2e-3, 3e-3], [10.0, 40.0, 120.0])
    >>> rubber.force([1e-3, 3e-3])
    array([ 10., 120.])
    """

    indentation: Sequence[float]
    measured: Sequence[float]

    compiled: ClassVar[str] = "piecewise"
    kinds: ClassVar[dict[str, str]] = {"tabulated": "", "tabulated_file": "from_csv"}
    equation: ClassVar[str] = "F = monotone piecewise cubic through (indentation, measured), straight beyond the last"
    units: ClassVar[dict[str, str]] = {"indentation": "m", "measured": "N"}
    remarks: ClassVar[tuple[str, ...]] = (  # type: ignore[misc]
        "never pulls",
        "integrators locate every point; smooth between",
    )

    def __repr__(self) -> str:
        """All of few points; of many how many there are, and a digest that tells one table from another."""
        if len(self.indentation) <= MOST_SHOWN:
            return f"Tabulated(indentation={self.indentation!r}, measured={self.measured!r})"
        last = f"the last ({self.indentation[-1]:g} m, {self.measured[-1]:g} N)"
        digest = crc32(repr((self.indentation, self.measured)).encode())
        return f"Tabulated({len(self.indentation)} points, {last}, digest {digest:08x})"

    def __post_init__(self) -> None:
        points = tuple(
            tuple(finite_row(values, f"{name} of Tabulated", LARGEST_PARAMETER, 1.0 / LARGEST_PARAMETER).tolist())
            for name, values in (("indentation", self.indentation), ("measured", self.measured))
        )
        if len(points[0]) != len(points[1]):
            raise ValueError(
                f"Tabulated needs as many forces as indentations, got {len(points[1])} and {len(points[0])}"
            )
        if points[0] and points[0][0] < 0.0:
            first = f"got {points[0][0]:g} m first; leave out what was measured in the gap"
            raise ValueError(f"indentation of Tabulated must be >= 0 and ascend, {first}")
        if not points[0] or points[0][0] > 0.0:
            points = (0.0, *points[0]), (0.0, *points[1])
        steps, rises = np.diff(points[0]), np.diff(points[1])
        if not np.all(steps > 0.0):
            row = int(np.argmin(steps > 0.0))
            raise ValueError(
                f"indentation of Tabulated must be >= 0 and ascend, got {points[0][row]:g} m, "
                f"then {points[0][row + 1]:g} m; sort it, or average what was measured twice"
            )
        if points[1][0] != 0.0:
            raise ValueError(
                f"Tabulated must have force 0 at indentation 0, got {points[1][0]:g} N; subtract the offset"
            )
        if len(rises) == 0 or np.any(rises < 0.0) or points[1][-1] <= 0.0:
            row = int(np.argmax(rises < 0.0)) if len(rises) else 0
            raise ValueError(
                "measured of Tabulated must not fall with indentation and must end above 0"
                + (f", got {points[1][row]:g} then {points[1][row + 1]:g} N" if len(rises) else ", got no point")
                + "; smooth the measurement first"
            )
        object.__setattr__(self, "indentation", points[0])
        object.__setattr__(self, "measured", points[1])

    @classmethod
    def from_csv(cls, path: str | Path) -> Tabulated:
        """A table from a text file with columns ``delta`` (m) and ``force`` (N), named in its first line."""
        columns = read_columns(path, ("delta", "force"))
        return cls(tuple(columns["delta"]), tuple(columns["force"]))

    @property
    def knots(self) -> tuple[float, ...]:  # type: ignore[override]
        """The measured points."""
        return tuple(self.indentation[1:])

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(m, then knot, c0, c1, c2, c3, 0 of every piece); the last piece is the straight one beyond the table."""
        from scipy.interpolate import PchipInterpolator

        x, F = np.asarray(self.indentation), np.asarray(self.measured)
        curve = PchipInterpolator(x, F)
        pieces = np.column_stack((x[:-1], curve.c[::-1].T, np.zeros(len(x) - 1)))
        last = [x[-1], F[-1], float(curve.derivative()(x[-1])), 0.0, 0.0, 0.0]
        return np.concatenate(([len(x)], pieces.ravel(), last))

    def exact_restitution(self, entry_rate: float, mass: float) -> float:
        """Elastic: 1."""
        return 1.0
