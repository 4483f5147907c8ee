"""Planes of starts: two directions in the states of a model, each with the values along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.support import is_finite, is_whole, require

if TYPE_CHECKING:
    from fembeam.model import Model

Vector = NDArray[np.float64]
WHERE = "basins"


@dataclass(frozen=True, eq=False)
class Axis:
    """One direction of a plane: (2n,) change of [q, q̇] per unit, the values (k,) along it, its name."""

    direction: Vector
    values: Vector
    name: str


def axis_of(model: Model, kind: Any, span: Any, points: int, z: float) -> Axis:
    """An axis from what `basins` takes for it, checked."""
    ends = np.asarray(span, dtype=float)
    valid = ends.shape == (2,) and bool(np.isfinite(ends).all()) and ends[0] < ends[1]
    require(valid, "a span must be two finite values, ascending", span, WHERE, "give (lowest, highest)")
    direction, name = _direction(model, kind, z)
    return Axis(direction, np.linspace(ends[0], ends[1], points), name)


def _direction(model: Model, kind: Any, z: float) -> tuple[Vector, str]:
    """The direction an axis goes, and its name."""
    n = len(model.omega)
    if isinstance(kind, str) and kind == "displacement":
        return np.concatenate((_pulled(model, z), np.zeros(n))), f"displacement at {z:g} m / m"
    if isinstance(kind, str) and kind == "velocity":
        return np.concatenate((np.zeros(n), _shape(model, z, np.ones(n)))), f"velocity at {z:g} m / (m/s)"
    if is_whole(kind):
        require(
            bool(0 <= kind < 2 * n), f"the number of a state must lie in [0, {2 * n})", kind, WHERE, "q first, then q̇"
        )
        return np.eye(2 * n)[kind], f"q[{kind}]" if kind < n else f"q_dot[{kind - n}]"
    advice = f'give "displacement", "velocity", the number of a state, or a vector of {2 * n} numbers'
    require(not isinstance(kind, (str, bool)) and kind is not None, "an axis is not known", kind, WHERE, advice)
    vector = np.array(kind, dtype=float)
    fine = vector.shape == (2 * n,) and bool(np.isfinite(vector).all())
    require(fine, f"an axis must be {2 * n} finite numbers", kind, WHERE, advice)
    return vector, "along the given vector"


def _pulled(model: Model, z: float) -> Vector:
    """Q of the shape a force at z bends the beam to, per metre there."""
    loose = (model.omega <= 0.0) & (model.phi(z) != 0.0)
    require(not loose.any(), "a force at z moves the beam without end", z, WHERE, "use velocity, or numbers of states")
    return _shape(model, z, 1.0 / np.where(model.omega > 0.0, model.omega, np.inf) ** 2)


def _shape(model: Model, z: float, compliance: Vector) -> Vector:
    """Coordinates that a push at z brings about, per unit of motion there."""
    phi = model.phi(z)
    moved = float(phi @ (compliance * phi))
    require(moved > 0.0, "the modes kept do not move at z", z, WHERE, "choose another place")
    found: Vector = compliance * phi / moved
    return found


def checked_points(points: Any) -> tuple[int, int]:
    """Numbers of values along x and y."""
    both = (points, points) if isinstance(points, (int, np.integer)) else tuple(np.ravel(points).tolist())
    whole = len(both) == 2 and all(is_finite(k) and k == int(k) and k >= 2 for k in both)
    require(whole, "points must be one or two whole numbers of at least 2", points, WHERE, "e.g. (100, 100)")
    return int(both[0]), int(both[1])


def starts_of(origin: Vector, x: Axis, y: Axis) -> Vector:
    """(ny, nx, 2n) all the starts."""
    along = x.values[:, None] * x.direction
    starts: Vector = origin + (y.values[:, None] * y.direction)[:, None, :] + along
    return starts


def checked_plane(model: Model, start: ArrayLike | None, x: Axis, y: Axis) -> Vector:
    """The state at the plane's origin, after a check that x and y span a plane."""
    size = 2 * len(model.omega)
    origin = model.rest() if start is None else np.array(start, dtype=float)
    fine = origin.shape == (size,) and bool(np.isfinite(origin).all())
    require(fine, f"start must be {size} finite numbers", start, WHERE, "use model.state(displacement, velocity)")
    units = [axis.direction / max(float(np.linalg.norm(axis.direction)), 1e-300) for axis in (x, y)]
    flat = np.linalg.svd(np.array(units), compute_uv=False)[-1] < 1e-9
    require(not flat, "x and y must be two directions", (x.name, y.name), WHERE, "choose another one")
    return origin
