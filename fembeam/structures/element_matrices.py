"""Elements of frames: cubic in bending, quadratic along and in twist, by their fields at Gauss points.

With v along `up`, w `across`, u and the twist θ along the member:

    K = ∫ EA u'² + E (I v''² + 2 I12 v'' w'' + I2 w''²) + GJ θ'² + N (v'² + w'²) + k (v² + w²) ds  = RᵀR
    M = ∫ ρA (u² + v² + w²) + ρ (I + I2) θ² ds
    with spin Ω:  M + ∫ ρI (v'² + w'²) ds,   G = ∫ 2 ρI Ω (φ ψᵀ - ψ φᵀ) ds,  φ = -v', ψ = w'

A section with shear coefficients κ turns by β ≠ v' (Timoshenko): v'' above is β', K gains ∫ κGA (v' - β)² ds and M
∫ ρI β² ds. With Φ = 12 EI/(κGA h²) the fields that solve the static equations are, for the cubics H of bending,

    v = (H + Φ L)/(1 + Φ),   L = (1 - x, h x (1 - x)/2, x, -h x (1 - x)/2),
    β = (H' + Φ Λ)/(1 + Φ),   Λ = (0, 1 - x, 0, x).

The unknowns of an element are displacement and rotation of both ends along the global axes, and interior numbers, the
heights of parabolas over what the ends give: one each for u and θ, with shear for v, w and the two β as well. (Without
these v' - β is constant, and the error of second order.) Rotations are vectors: φ about `across`, ψ about `up`. So the
relative error of ω is (γ h)⁴/1440 along and in twist, the very constant of cubic bending.

References: J.S. Przemieniecki, Theory of Matrix Structural Analysis (1968), 11; H.D. Nelson, J.M. McVaugh, J. Eng. Ind.
98 (1976) 593, for the spinning shaft; Z. Friedman, J.B. Kosmatka, Comput. Struct. 47 (1993) 473, for shear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fembeam.beams import Section, gauss_points, hermite_shapes

Vector = NDArray[np.float64]
Indices = NDArray[np.int64]
ACROSS, UP, ALONG = 0, 1, 2  # rows of the axes
PARABOLAS = ("along", "twist", "across", "up", "turn2", "turn")  # interior numbers of an element, after its two ends
WIDTH = 12 + len(PARABOLAS)


@dataclass(frozen=True, eq=False)
class Elements:
    """All elements of a frame, and how their ends follow its dofs.

    Attributes
    ----------
    h : (e,) lengths. axes : (e, 3, 3) rows across, up, along.
    properties : {name: (e,)} of EA, GJ, EI, EI2, EI12, rho_A, rho_I, rho_Ip, N, k; shear stiffnesses S, S2, infinite
        without shear, and rotary inertias of bending in force, turning and turning2.
    join : (18 e, N) from the frame's dofs to (displacement, rotation) of first and second end, then PARABOLAS, of every
        element in turn.
    planes : ways of bending that are there, of UP and ACROSS. stretches, twists : whether the others are.
    """

    h: Vector
    axes: Vector
    properties: dict[str, Vector]
    join: sparse.csr_matrix
    planes: tuple[int, ...]
    stretches: bool
    twists: bool

    @property
    def count(self) -> int:
        """How many."""
        return len(self.h)

    def only(self, which: Indices) -> Elements:
        """Some of them, in the order asked for."""
        rows = (WIDTH * which[:, None] + np.arange(WIDTH)).ravel()
        properties = {name: values[which] for name, values in self.properties.items()}
        return replace(self, h=self.h[which], axes=self.axes[which], properties=properties, join=self.join[rows])

    def bending(self, element: Indices, x: Vector, plane: int, derivative: int = 0) -> sparse.csr_matrix:
        """Rows (k, 18 e) of v, w or their derivatives along the member at x in [0, 1] of elements (k,)."""
        h, shear = self.h[element], self._shear(element, plane)
        shapes = (hermite_shapes(x, derivative) + shear * _sheared(x, derivative)) / (1 + shear) / h**derivative
        shapes[1::2] *= h
        return self._bent(element, shapes, plane, 14, _parabola(x, derivative) / h**derivative)

    def turning(self, element: Indices, x: Vector, plane: int, derivative: int = 0) -> sparse.csr_matrix:
        """The same of the section's rotation β, which is v' or w' but for shear, or of its derivative."""
        h, shear = self.h[element], self._shear(element, plane)
        shapes = hermite_shapes(x, derivative + 1)
        shapes[1::2] += shear * (np.array([1 - x, x]) if derivative == 0 else np.array([[-1.0], [1.0]]))
        shapes /= (1 + shear) * h ** (derivative + 1)
        shapes[1::2] *= h
        return self._bent(element, shapes, plane, 16, _parabola(x, derivative) / h**derivative)

    def _shear(self, element: Indices, plane: int) -> Vector:
        """Φ = 12 EI/(κGA h²) of elements, 0 without shear."""
        suffix = "" if plane == UP else "2"
        bending, shear = self.properties["EI" + suffix][element], self.properties["S" + suffix][element]
        return np.asarray(12 * bending / (shear * self.h[element] ** 2))

    def _bent(self, element: Indices, shapes: Vector, plane: int, first: int, bow: Vector) -> sparse.csr_matrix:
        """Rows of the four numbers (4, k) of bending in a plane, and of its parabola."""
        turn = self.axes[element, UP] if plane == ACROSS else -self.axes[element, ACROSS]
        values = np.zeros((len(element), WIDTH))
        for end in range(2):
            values[:, 6 * end : 6 * end + 3] = shapes[2 * end][:, None] * self.axes[element, plane]
            values[:, 6 * end + 3 : 6 * end + 6] = shapes[2 * end + 1][:, None] * turn
        values[:, first + plane] = bow
        return self._rows(element, values)

    def along(self, element: Indices, x: Vector, turning: bool, derivative: int = 0) -> sparse.csr_matrix:
        """The same of u, or of the twist θ."""
        ends = [1 - x, x] if derivative == 0 else [0 * x - 1, 0 * x + 1]
        line = np.array([*ends, _parabola(x, derivative)]) / self.h[element] ** derivative
        values = np.zeros((len(x), WIDTH))
        for end in range(2):
            first = 6 * end + 3 * turning
            values[:, first : first + 3] = line[end][:, None] * self.axes[element, ALONG]
        values[:, 12 + turning] = line[2]
        return self._rows(element, values)

    def motion(self, element: Indices, x: Vector) -> tuple[list[Any], list[Any]]:
        """Rows (k, 18 e) of displacement and of rotation about (across, up, along); None for what is not there."""
        w, v = (self.bending(element, x, plane) if plane in self.planes else None for plane in (ACROSS, UP))
        u = self.along(element, x, False) if self.stretches else None
        turn_up = self.turning(element, x, ACROSS) if ACROSS in self.planes else None
        turn_across = -self.turning(element, x, UP) if UP in self.planes else None
        return [w, v, u], [turn_across, turn_up, self.along(element, x, True) if self.twists else None]

    def _rows(self, element: Indices, values: Vector) -> sparse.csr_matrix:
        """Sparse rows with the values of one element each."""
        columns = WIDTH * element[:, None] + np.arange(WIDTH)
        start = WIDTH * np.arange(len(element) + 1)
        return sparse.csr_matrix((values.ravel(), columns.ravel(), start), shape=(len(element), WIDTH * self.count))

    def at_gauss(self, points: int) -> tuple[Indices, Vector, Vector]:
        """Elements, x and weight times length of all Gauss points."""
        x, weight = gauss_points(points)
        element = np.repeat(np.arange(self.count), points)
        return element, np.tile(x, self.count), np.tile(weight, self.count) * self.h[element]


def properties_of(
    sections: Sequence[Section], forces: Vector, foundations: Vector, spinning: bool
) -> dict[str, Vector]:
    """What the integrals read, from a section, a tension and a foundation for each element; unknown I2, J are NaN."""
    E, rho, A, I, I12 = (np.array([getattr(one, name) for one in sections]) for name in ("E", "rho", "A", "I", "I12"))
    I2 = np.array([np.nan if one.I2 is None else one.I2 for one in sections])
    GJ = np.array([one.torsion_stiffness for one in sections])
    stiffness = {"EA": E * A, "GJ": GJ, "EI": E * I, "EI2": E * I2, "EI12": E * I12, "N": forces, "k": foundations}
    kappa = np.array([(np.inf, np.inf) if one.shear is None else one.shear for one in sections])
    G = E / (2 * (1 + np.array([one.nu for one in sections])))
    turns = np.array([spinning or one.shear is not None for one in sections])
    shear = {"S": kappa[:, 0] * G * A, "S2": kappa[:, 1] * G * A}
    rotary = {"turning": np.where(turns, rho * I, 0.0), "turning2": np.where(turns, rho * I2, 0.0)}
    return {**stiffness, **shear, **rotary, "rho_A": rho * A, "rho_I": rho * I, "rho_Ip": rho * (I + I2)}


def stiffness_root(elements: Elements) -> sparse.csr_matrix:
    """R with K = RᵀR on the ends of the elements; imaginary in the rows of members under compression."""
    element, x, weight = elements.at_gauss(2)
    p = {name: values[element] for name, values in elements.properties.items()}
    curved = {plane: elements.turning(element, x, plane, 1) for plane in elements.planes}
    rows = []
    if len(curved) == 2:
        shared = p["EI12"] / p["EI"]
        rows.append(_scaled(p["EI"] * weight, curved[UP] + sparse.diags(shared) @ curved[ACROSS]))
        rows.append(_scaled((p["EI2"] - shared * p["EI12"]) * weight, curved[ACROSS]))
    else:
        rows.append(_scaled(p["EI"] * weight, curved[UP]))
    if elements.stretches:
        rows.append(_scaled(p["EA"] * weight, elements.along(element, x, False, 1)))
    if elements.twists:
        rows.append(_scaled(p["GJ"] * weight, elements.along(element, x, True, 1)))
    rows += _transverse(elements, "k", 4, 0) + _transverse(elements, "N", 3, 1) + _shear_strain(elements)
    return sparse.vstack(rows, format="csr")


def _transverse(elements: Elements, name: str, points: int, derivative: int) -> list[sparse.csr_matrix]:
    """Rows of √p v and w, or of their slopes, of a property p; none where it is zero everywhere."""
    element, x, weight = elements.at_gauss(points)
    value = elements.properties[name][element] * weight
    if not np.any(value):
        return []
    return [_scaled(value, elements.bending(element, x, plane, derivative)) for plane in elements.planes]


def _shear_strain(elements: Elements) -> list[sparse.csr_matrix]:
    """Rows of √κGA (v' - β); none where no section has shear."""
    element, x, weight = elements.at_gauss(3)
    rows = []
    for plane in elements.planes:
        shear = elements.properties["S" if plane == UP else "S2"][element]
        stiff = np.where(np.isfinite(shear), shear, 0.0)
        if np.any(stiff):
            strain = elements.bending(element, x, plane, 1) - elements.turning(element, x, plane)
            rows.append(_scaled(stiff * weight, strain))
    return rows


def inertia_root(elements: Elements) -> sparse.csr_matrix:
    """P with M = PᵀP on the ends of the elements."""
    element, x, weight = elements.at_gauss(4)
    p = {name: values[element] for name, values in elements.properties.items()}
    moved = [elements.bending(element, x, plane) for plane in elements.planes]
    rows = [_scaled(p["rho_A"] * weight, field) for field in moved]
    if elements.stretches:
        rows.append(_scaled(p["rho_A"] * weight, elements.along(element, x, False)))
    if elements.twists:
        rows.append(_scaled(p["rho_Ip"] * weight, elements.along(element, x, True)))
    for plane, name in zip(elements.planes, ("turning", "turning2"), strict=False):
        if np.any(p[name]):
            rows.append(_scaled(p[name] * weight, elements.turning(element, x, plane)))
    return sparse.vstack(rows, format="csr")


def gyroscopic(elements: Elements, spin: Vector) -> sparse.csr_matrix:
    """G on the ends of the elements, for a spin (e,) in rad/s about `along`; both planes must be there."""
    element, x, weight = elements.at_gauss(3)
    about_across, about_up = -elements.turning(element, x, UP), elements.turning(element, x, ACROSS)
    half = about_across.T @ sparse.diags(2 * (elements.properties["rho_I"] * spin)[element] * weight) @ about_up
    return (half - half.T).tocsr()


def _parabola(x: Vector, derivative: int) -> Vector:
    """4 x (1 - x), 0 at both ends and 1 in the middle, or a derivative."""
    return (4 * x * (1 - x), 4 - 8 * x, -8.0 + 0 * x)[derivative]


def _sheared(x: Vector, derivative: int) -> Vector:
    """(4, k): the straight line and parabolas L, or their derivatives, that shear adds to the cubics."""
    one, zero = np.ones_like(x), np.zeros_like(x)
    bow, line = [x * (1 - x) / 2, 0.5 - x, -one], [[1 - x, x], [-one, one], [zero, zero]]
    start, end = line[derivative]
    return np.array([start, bow[derivative], end, -bow[derivative]])


def _scaled(value: Vector, rows: sparse.csr_matrix) -> sparse.csr_matrix:
    """√value times each row."""
    return sparse.diags(np.emath.sqrt(value)) @ rows
