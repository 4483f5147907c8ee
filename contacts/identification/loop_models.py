"""Forces of laws with memory over a measured path, in closed form from one turning point to the next.

    sliders     F = Σ k_j e_j + k₀ x,   e_j = x - s_j, kept within ±f_j/k_j
    Bouc–Wen    F = k_e x + c z,        z' = x' - β |x'| |z|^(n-1) z - γ x' |z|^n

Displacements and forces are in units of the records' half ranges. A model has ``main`` parameters, and for each record
the memory at its first sample: the extensions e_j, or z. Loops tell c A, β/c^n and γ/c^n only, not c, A, β, γ: A is 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contacts.law import Law
from contacts.memory import BoucWen, Iwan, Jenkins
from contacts.path import Vector, monotone_runs

_WEN = BoucWen(1.0, 0.0, 1.0, 1.0, 0.0)  # its kernel takes the parameters that are tried


@dataclass(frozen=True, eq=False)
class Loop:
    """A record in units: (k,) displacements and forces; its monotone runs."""

    x: Vector
    force: Vector
    runs: list[tuple[int, int]] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "runs", list(monotone_runs(self.x)))


def extensions(loop: Loop, widths: Vector, start: Vector) -> NDArray[np.float64]:
    """(N, k) extensions e_j of springs behind sliders that give way at ± widths, from ``start`` on."""
    low, high = -widths[:, None], widths[:, None]
    out = np.empty((widths.size, loop.x.size))
    out[:, 0] = start
    for a, b in loop.runs:
        free = out[:, a : a + 1] + (loop.x[a : b + 1] - loop.x[a])
        np.minimum(np.maximum(free, low), high, out=out[:, a : b + 1])
    return out


def extension_slopes(widths: Vector, found: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, N, k) derivatives of extensions by widths and by start, which is forgotten where a slider gives way."""
    side = np.sign(found) * (np.abs(found) == widths[:, None])
    last = np.maximum.accumulate(np.where(side != 0.0, np.arange(found.shape[1]), 0), axis=1)  # time it gave way
    by_width = np.take_along_axis(side, last, axis=1)
    return np.stack((by_width, by_width == 0.0))


@dataclass(frozen=True)
class Sliders:
    """θ = (ln k_j, ln f_j/k_j, [k₀]) of ``count`` sliders, with a spring k₀ beside them or without.

    Memory is the arc sine of e_j k_j/f_j: a number without bounds, where least squares cannot get stuck. The slider
    ``wide``, if any, is as wide as half the range of the displacement or wider: it cannot slip both ways.
    """

    count: int
    spring: bool
    wide: int | None = None

    @property
    def main(self) -> int:
        """How many parameters the law has."""
        return 2 * self.count + self.spring

    @property
    def states(self) -> int:
        """How many numbers are latched."""
        return self.count

    @property
    def ends(self) -> NDArray[np.float64]:
        """(2, main) bounds of what the records can determine."""
        stiffness, width, spring = (
            [[-20.0, 8.0]] * self.count,
            [[0.0 if j == self.wide else -8.0, 1.0] for j in range(self.count)],
            [[-np.inf, np.inf]] * self.spring,
        )
        return np.array([*stiffness, *width, *spring]).T

    def force(self, theta: Vector, state: Vector, loop: Loop) -> Vector:
        """(k,) forces of a record."""
        stiffness, widths = np.exp(theta[: 2 * self.count]).reshape(2, -1)
        force = stiffness @ extensions(loop, widths, widths * np.sin(state))
        return np.asarray(force + theta[-1] * loop.x if self.spring else force)

    def slopes(self, theta: Vector, state: Vector, loop: Loop) -> NDArray[np.float64]:
        """(k, main + states) derivatives of the forces."""
        stiffness, widths = np.exp(theta[: 2 * self.count]).reshape(2, -1)
        e = extensions(loop, widths, widths * np.sin(state))
        by_width, by_start = stiffness[:, None] * extension_slopes(widths, e)
        own = widths * (by_width.T + by_start.T * np.sin(state))
        spring = [loop.x] * self.spring
        return np.column_stack((stiffness * e.T, own, *spring, by_start.T * widths * np.cos(state)))

    def values(self, theta: Vector, depth: float, strength: float) -> dict[str, float]:
        """Parameters by name in SI."""
        stiffness, widths = np.exp(theta[: 2 * self.count]).reshape(2, -1)
        k, f = stiffness * strength / depth, stiffness * widths * strength
        if not self.spring:
            return {"stiffness": k[0], "limit": f[0]}
        order = np.argsort(widths)  # by the displacement at which they slip
        named = {f"stiffness[{i}]": k[j] for i, j in enumerate(order)}
        named |= {f"limits[{i}]": f[j] for i, j in enumerate(order)}
        return {**named, "spring": theta[-1] * strength / depth}

    def law(self, values: dict[str, float]) -> Law:
        """The law; a spring stiffness fitted below zero counts as 0."""
        if not self.spring:
            return Jenkins(**values)
        k, f = np.array(list(values.values())[:-1]).reshape(2, -1).tolist()
        spring = values["spring"]
        return Iwan([*k, spring], [*f, np.inf]) if spring > 0.0 else Iwan(k, f)


@dataclass(frozen=True)
class Smooth:
    """θ = (ln c, k_e, β, γ) of Bouc and Wen's law of exponent n with A = 1."""

    n: int
    main: int = 4
    states: int = 1

    @property
    def ends(self) -> NDArray[np.float64]:
        """No bounds but for exp(θ₁)."""
        return np.array([[-20.0, 8.0], *[[-np.inf, np.inf]] * 3]).T

    def force(self, theta: Vector, state: Vector, loop: Loop) -> Vector:
        """(k,) forces of a record; nan beyond a pole."""
        elastic, c, z = theta[1], np.exp(theta[0]), state[0]
        row = np.array([elastic, c, 1.0, theta[2], theta[3], self.n, 0.0, 0.0, 0.0])
        of_law, force = _WEN.batch(1.0, row), np.empty(loop.x.size)
        for a, b in loop.runs:
            points = loop.x[a : b + 1]
            direction = 1.0 if points[-1] >= points[0] else -1.0
            row[6:] = direction, points[0], z
            force[a : b + 1] = of_law(points, np.full(points.size, direction))
            z = (force[b] - elastic * points[-1]) / c
        return force

    def slopes(self, theta: Vector, state: Vector, loop: Loop) -> NDArray[np.float64]:
        """(k, main + states) derivatives of the forces, by differences."""
        all_of, columns = np.append(theta, state), []
        for i, step in enumerate(1e-6 * np.maximum(np.abs(all_of), 1e-2)):
            ends = [all_of + sign * step * (np.arange(all_of.size) == i) for sign in (-1.0, 1.0)]
            behind, ahead = (self.force(end[: self.main], end[self.main :], loop) for end in ends)
            columns.append((ahead - behind) / (2.0 * step))
        return np.column_stack(columns)

    def values(self, theta: Vector, depth: float, strength: float) -> dict[str, float]:
        """Parameters by name in SI; k and α from the elastic and the hysteretic part."""
        c, elastic = np.exp(theta[0]), theta[1]
        shape = (theta[2:] / depth**self.n).tolist()
        k = (c + elastic) * strength / depth
        return {"stiffness": k, "alpha": elastic / (c + elastic), "beta": shape[0], "gamma": shape[1]}

    def law(self, values: dict[str, float]) -> Law:
        """The law; an α fitted below zero counts as 0."""
        alpha = max(values["alpha"], 0.0)
        return BoucWen(**{**values, "alpha": alpha}, A=1.0, n=self.n)  # type: ignore[arg-type]


Model = Sliders | Smooth
