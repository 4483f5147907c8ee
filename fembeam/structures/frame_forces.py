"""Section forces along the members of a frame, from the equilibrium of their elements.

The forces at both ends of every element,

    f_e = K_e u_e - M_e a_e,

balance its stiffness against its inertia a (ω² φ for a mode), so that they are as accurate as the frequencies and
exact for static shapes. Between the ends M, Q and all others run as cubics with the right values and slopes:
M' = Q - ρI a' (the last where sections have rotary inertia, a' of their rotation), N' = -ρA a along the member,
T' = -ρ (I + I2) a about it.

Signs, seen along the member with `up` upwards, are those of a straight beam: N tension; M = E (I v'' + I12 w'') with
the deflection v along `up`, which stretches the lower fibre, and Q = M'; M2 = E (I2 w'' + I12 v'') with w `across`,
Q2 = M2'; T = GJ θ'. With rotary inertia Q and Q2 are the forces across, not M' and M2'.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.beams import hermite_shapes
from fembeam.structures.element_matrices import ACROSS, ALONG, UP, WIDTH, Elements, inertia_root, stiffness_root
from fembeam.support import is_finite, require

if TYPE_CHECKING:
    from fembeam.structures.frame_mesh import FrameMatrices, FrameMesh

Vector = NDArray[np.float64]

FORCES = ("N", "Q", "M", "Q2", "M2", "T")  # N, T in N and N m; Q, Q2 in N; M, M2 in N m


@dataclass(frozen=True, eq=False)
class FrameForces:
    """Section forces of n coordinates, per unit of each.

    Attributes
    ----------
    mesh : the frame's mesh. names : those that are there, of N, Q, M, Q2, M2, T.
    ends : {name: (e, 2, n)} at both ends of every element. slopes : {name: (e, 2, n)} along the member.
    """

    mesh: FrameMesh
    ends: dict[str, Vector]
    slopes: dict[str, Vector]

    @property
    def names(self) -> tuple[str, ...]:
        """The section forces that are there."""
        return tuple(self.ends)

    def __repr__(self) -> str:
        count = next(iter(self.ends.values())).shape[2]
        return f"<section forces {', '.join(self.names)} of {count} coordinates in {len(self.mesh.h)} elements>"

    def names_at(self, place: Any) -> tuple[str, ...]:
        """The same at a place: all of them."""
        return self.names

    def sections(self) -> list[tuple[str, float]]:
        """All mesh nodes as (member, distance), member by member."""
        return self.mesh.sections()

    def rows(self, place: Any, names: tuple[str, ...] | None = None, behind: bool = False) -> Vector:
        """(len(names), n) at a place on a member; at a point load ahead of it, or ``behind``. None: all of `names`."""
        member, s = self._on_member(place)
        element, x, _ = self.mesh.located(member, np.array([s]), behind)
        h = self.mesh.h[element]
        value, slope = hermite_shapes(x, 0)[[0, 2]], hermite_shapes(x, 0)[[1, 3]] * h
        chosen = self.names if names is None else names
        unknown = [name for name in chosen if name not in self.ends]
        require(not unknown, f"section forces must be among {', '.join(self.names)}", unknown, "section forces",
                "choose some of these")  # fmt: skip
        found = [
            value[:, 0] @ self.ends[name][element[0]] + slope[:, 0] @ self.slopes[name][element[0]] for name in chosen
        ]
        return np.array(found)

    def stress(self, place: Any, x: float = 0.0, y: float | None = None, behind: bool = False) -> Vector:
        """Normal stress (n,) per unit of each coordinate at the point (x across, y up) of the section, m; tension +.

        σ = N/A - y M_y - x M_x with the moments turned to principal ones where I12 ≠ 0. None: y of the lower fibre.
        """
        member, _ = self._on_member(place)
        own = self.mesh.frame.members[member].section
        if y is None:
            require(own.fibre is not None, "the section must know its outer fibre", own, "stress",
                    "give Section(..., fibre=), or y")  # fmt: skip
            y = -float(own.fibre or 0.0)
        for name, number in (("x", x), ("y", y)):
            require(is_finite(number), f"{name} must be finite", number, "stress", "give m from the centroid")
        N, M, M2 = (self.rows(place, (name,), behind)[0] if name in self.ends else 0.0 for name in ("N", "M", "M2"))
        if "M2" not in self.ends or own.I2 is None:
            return np.asarray(N / own.A - y * M / own.I)
        curved = np.linalg.solve([[own.I, own.I12], [own.I12, own.I2]], np.array([M, M2]))
        return np.asarray(N / own.A - y * curved[0] - x * curved[1])

    def preload(self, place: Any, quantity: str) -> float:
        """What the given axial force of the member adds to "N" or to "stress", nothing to others."""
        member = self.mesh.frame.members[self._on_member(place)[0]]
        return float(member.axial_force * {"N": 1.0, "stress": 1 / member.section.A}.get(quantity, 0.0))

    def _on_member(self, place: Any) -> tuple[int, float]:
        """The member and the distance; a node with one member is the end of that."""
        frame = self.mesh.frame
        site = frame.site(place, "section forces")
        if not isinstance(site, str):
            return site
        met = [(i, end) for i, one in enumerate(frame.members) for end in range(2) if site == (one.a, one.b)[end]]
        first = frame.members[met[0][0]].name
        require(len(met) == 1, f"a place of section forces must lie on one member; {len(met)} meet there", place,
                "section forces", f"write ({first!r}, s)")  # fmt: skip
        member, end = met[0]
        return member, end * float(frame.lengths[member])


def frame_forces(made: FrameMatrices, vectors: Vector, inertia: Vector, stresses: Vector | None = None) -> FrameForces:
    """Section forces of displacements (N, n) and of the inertia (N, n) that their stiffness balances, on all dofs.

    `stresses` R v (k, n), K = RᵀR, are taken in place of those of the displacements, where they are known better.
    The preload of members is apart from N; with spin, gyroscopic moments are left out.
    """
    elements = made.mesh.elements
    u, a = elements.join @ vectors, elements.join @ inertia
    P, R = inertia_root(elements), stiffness_root(elements)
    forces = (R.T @ (R @ u if stresses is None else stresses)).real - P.T @ (P @ a)
    (push, turn), (shift, tilt) = (_at_ends(values, vectors.shape[1]) for values in (forces, a))
    side, p = np.array([-1.0, 1.0])[None, :, None], elements.properties

    def along(values: Vector, axis: int) -> Vector:
        return np.asarray(np.einsum("ec,eicn->ein", elements.axes[:, axis], values))

    ends, slopes = {}, {}
    if elements.stretches:
        ends["N"], slopes["N"] = side * along(push, ALONG), -p["rho_A"][:, None, None] * along(shift, ALONG)
    for plane in elements.planes:
        turning, sign, suffix = (ACROSS, -1.0, "") if plane == UP else (UP, 1.0, "2")  # v' = -φ, w' = ψ
        moment, tension = side * sign * along(turn, turning), p["N"][:, None, None]
        shear = -side * along(push, plane) + tension * _slopes(elements, plane, u)
        turned, bent = (p["turning" + suffix][:, None, None] * one for one in _turns(elements, plane, a))
        rise = shear - turned
        ends["M" + suffix], slopes["M" + suffix] = moment, rise
        ends["Q" + suffix], slopes["Q" + suffix] = shear, _bend(moment, rise, elements.h[:, None]) + bent
    if elements.twists:
        ends["T"], slopes["T"] = side * along(turn, ALONG), -p["rho_Ip"][:, None, None] * along(tilt, ALONG)
    order = [name for name in FORCES if name in ends]
    return FrameForces(made.mesh, {name: ends[name] for name in order}, {name: slopes[name] for name in order})


def _at_ends(values: Vector, n: int) -> tuple[Vector, Vector]:
    """Displacements and rotations, or their forces, (e, 2, 3, n) of (18 e, n)."""
    both = values.reshape(-1, WIDTH, n)[:, :12].reshape(-1, 2, 2, 3, n)
    return both[:, :, 0], both[:, :, 1]


def _slopes(elements: Elements, plane: int, u: Vector) -> Vector:
    """(e, 2, n): v' or w' at both ends."""
    every = np.arange(elements.count)
    return np.stack([elements.bending(every, np.full(len(every), x), plane, 1) @ u for x in (0.0, 1.0)], axis=1)


def _turns(elements: Elements, plane: int, u: Vector) -> tuple[Vector, Vector]:
    """(e, 2, n) twice: the section's rotation at both ends, and its derivative along the member."""
    every, ends = np.arange(elements.count), (0.0, 1.0)
    found = [[elements.turning(every, np.full(len(every), x), plane, d) @ u for x in ends] for d in (0, 1)]
    return np.stack(found[0], axis=1), np.stack(found[1], axis=1)


def _bend(value: Vector, slope: Vector, h: Vector) -> Vector:
    """Second derivatives (e, 2, n) at both ends of the cubics with these values and slopes."""
    (a, b), (da, db) = np.moveaxis(value, 1, 0), np.moveaxis(slope, 1, 0)
    rise = 6 * (b - a) / h**2
    return np.stack([rise - (4 * da + 2 * db) / h, (2 * da + 4 * db) / h - rise], axis=1)
