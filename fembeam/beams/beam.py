"""The bending beam, in cubic Hermite elements on spans of constant or tapered section.

    (EI u'')'' - N u'' + k u + ρA ü = 0

Every element stands on its own unit interval, z = z_e + h ξ, with unknowns (u, h u_z) at both ends:

    K_e = ∫ EI/h³ u_ξξ v_ξξ + N/h u_ξ v_ξ + k h u v dξ,   M_e = ∫ ρA h u v dξ.

The unit interval is there for rounding: scikit-fem inverts the monomials of the coordinate it gets, and on
the beam's own axis 500 elements would lose nine of the sixteen digits.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from fembeam.beams.section import Profile, Section, Taper
from fembeam.support import make_native, require, require_finite, require_non_negative, require_positive

Vector = NDArray[np.float64]
Span = tuple[float, Section | Taper]


@dataclass(frozen=True)
class Beam:
    """A straight beam from z = 0 to z = length, of one section or of several spans.

    Parameters
    ----------
    length : m, > 0.
    section : Section, or Taper; None in a beam of several spans.
    spans : ((length, section), …) from z = 0 on; leave it to `Beam.of_spans`.
    foundation : k in N/m², ≥ 0: elastic foundation (Winkler), a force -k u per metre.
    axial_force : N in newton, tension positive: it stiffens bending, compression softens it. Its direction is fixed.
    places : ((name, z), …): places named in a mesh, see `place`; leave it to `Beam.from_mesh`.

    Raises
    ------
    ValueError : a length is not finite and positive, no spans, lengths that do not add up.
    TypeError : a section is not a Section.

    Examples
    --------
    >>> steel = Section.circle(2.1e11, 7800.0, 0.01)
    >>> Beam.of_spans([(0.5, steel), (0.25, steel)]).borders
    (0.0, 0.5, 0.75)
    """

    length: float
    section: Section | Taper | None
    spans: tuple[Span, ...] = ()
    foundation: float = 0.0
    axial_force: float = 0.0
    places: tuple[tuple[str, float], ...] = ()
    meshed = True  # elements are chosen, or asked for

    def __post_init__(self) -> None:
        make_native(self)
        require_positive("length", self.length, "Beam", "give the length in m")
        if self.section is not None:  # rebuilt always, so that dataclasses.replace(beam, length=…) works
            object.__setattr__(self, "spans", ((self.length, self.section),))
        require(len(self.spans) > 0, "spans must not be empty", self.spans, "Beam", "give (length, section) pairs")
        for index, (length, section) in enumerate(self.spans):
            require_positive(f"length of span {index}", length, "Beam", "give the length in m")
            if not isinstance(section, (Section, Taper)):
                raise TypeError(f"section of span {index} must be a Section, got {section!r} in Beam; make one first")
            ends = (section.start, section.end) if isinstance(section, Taper) else (section,)
            require(all(one.shear is None for one in ends), "a Beam must be without shear deformation", section,
                    f"span {index} of Beam", "use Frame.straight")  # fmt: skip
        total = sum(length for length, _ in self.spans)
        require(abs(total - self.length) <= 1e-12 * total, f"length must be {total}", self.length, "Beam",
                "use Beam.of_spans")  # fmt: skip
        require_non_negative("foundation", self.foundation, "Beam", "give N/m per metre of beam")
        require_finite("axial_force", self.axial_force, "Beam", "give N, tension positive")

    @classmethod
    def of_spans(cls, spans: Sequence[Span], foundation: float = 0.0, axial_force: float = 0.0) -> Beam:
        """A beam of several spans [(length, section), …], rigidly joined, from z = 0 on."""
        try:
            parts = tuple((length, section) for length, section in spans)
        except (TypeError, ValueError):
            parts = ()
        require(len(parts) > 0, "spans must be pairs, one at least", spans, "Beam.of_spans",
                "give [(length, section), …]")  # fmt: skip
        for index, (length, _) in enumerate(parts):
            require_positive(f"length of span {index}", length, "Beam.of_spans", "give the length in m")
        single = parts[0][1] if len(parts) == 1 else None
        total = sum(length for length, _ in parts)
        total = max(total, float(f"{total:.15g}"))  # 0.7 + 0.1 is 0.7999999999999999, and 0.8 lies on the beam
        return cls(total, single, parts, foundation, axial_force)

    @classmethod
    def from_mesh(cls, path: str | os.PathLike[str], sections: Mapping[Any, Section | Taper], **options: Any) -> Beam:
        """A beam from a file of line elements along a straight axis: gmsh, VTU, Abaqus and all that meshio reads.

        Parameters
        ----------
        path : the file.
        sections : a Section or Taper for every name of a group (physical group, element set) or number in the cell
            data. Neighbouring elements of one name make one span, along which a Taper runs.
        options : `data`, the name of the cell data that number the sections, where a file has several; and
            `foundation`, `axial_force` of the beam.

        Returns
        -------
        Beam : z runs along the axis from its end with the smaller coordinate. Node sets and groups of points are
            its places (`place`), for supports, masses and stops.

        Raises
        ------
        ValueError : the file cannot be read, has no lines or other elements, lines that branch, are disconnected or
            not straight, a group without section; each says where.
        """
        from fembeam.beams.mesh_files import beam_of

        return beam_of(path, sections, **options)

    def to_mesh(self, path: str | os.PathLike[str], elements: int = 100) -> dict[str, Section | Taper]:
        """Write the beam as line elements (.msh, .inp, .vtu, .vtk); returns the `sections` to read it back with."""
        from fembeam.beams.mesh_files import to_mesh

        return to_mesh(self, path, elements)

    @property
    def borders(self) -> tuple[float, ...]:
        """Coordinates of the span ends, 0 and length included."""
        return (0.0, *np.cumsum([length for length, _ in self.spans]).tolist()[:-1], float(self.length))

    def place(self, name: str) -> float:
        """The z (m) of a place named in the mesh; ValueError lists the names there are."""
        places = dict(self.places)
        known = ", ".join(places) or "none: the beam is not from a mesh with node sets"
        require(name in places, f"name must be one of the beam's places ({known})", name, "Beam.place", "use one")
        return places[name]

    def profile(self, z: ArrayLike, behind: bool = False) -> Profile:
        """Section properties (E, rho, A, I, fibre), each (k,), at z (k,).

        At a border those of the span ahead, or ``behind``.
        """
        z = np.asarray(z, dtype=float)
        span, start = self._span(z, behind), np.array(self.borders)
        columns = np.full((5, *z.shape), np.nan)
        for index, (length, section) in enumerate(self.spans):
            mine = span == index
            columns[:, mine] = section.profile((z[mine] - start[index]) / length)
        return Profile(*columns)

    def bending_stiffness(self, z: ArrayLike) -> Vector:
        """EI (k,) in N m² at z (k,); at a border the span ahead."""
        profile = self.profile(z)
        return profile.E * profile.I

    def line_mass(self, z: ArrayLike) -> Vector:
        """ρA (k,) in kg/m at z (k,); at a border the span ahead."""
        profile = self.profile(z)
        return profile.rho * profile.A

    @property
    def tapered(self) -> bool:
        """Whether any span is."""
        return any(isinstance(section, Taper) for _, section in self.spans)

    def _span(self, z: ArrayLike, behind: bool) -> NDArray[np.int64]:
        """Index of the span that holds z; at a border of that ahead, or behind."""
        return np.searchsorted(self.borders[1:-1], z, side="left" if behind else "right")


def bending_matrices(beam: Beam, nodes: Vector) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Stiffness K and consistent mass M on all dofs (u_0, u_z0, u_1, u_z1, …).

    K = Σ ∫ EI u_zz v_zz + N u_z v_z + k u v dz,  M = Σ ∫ ρA u v dz

    Parameters
    ----------
    beam : Beam
        The beam.
    nodes : (m,)
        Increasing coordinates in m; every border of a span is one.

    Returns
    -------
    K, M : (2m, 2m) sparse, symmetric; N/m and kg for u, times m per slope.

    References
    ----------
    T. Gustafsson, G.D. McBain, scikit-fem, J. Open Source Software 5 (2020) 2369: ElementLineHermite.
    """
    K, M, dofs = element_matrices(beam, nodes)
    join = joining(np.diff(nodes), dofs)
    return (join.T @ K @ join).tocsr(), (join.T @ M @ join).tocsr()


@lru_cache(maxsize=16)  # scenes that differ in what stands on a beam, one after the other, have it in common
def bare_beam(beam: Beam, at: bytes) -> tuple[sparse.csr_matrix, sparse.csr_matrix, sparse.csr_matrix]:
    """K, M and R of `bending_matrices` and `bending_root` on nodes given as bytes; not to be written to."""
    nodes = np.frombuffer(at)
    found = (*bending_matrices(beam, nodes), bending_root(beam, nodes))
    for matrix in found:
        matrix.sort_indices()
        matrix.data.setflags(write=False)
    return found


def element_matrices(beam: Beam, nodes: Vector) -> tuple[sparse.csr_matrix, sparse.csr_matrix, NDArray[np.int64]]:
    """Each element by itself: K and M (4e, 4e) on its (u, h u_z) at both ends; numbers (2, 2e) of these dofs."""
    from skfem import Basis, BilinearForm, ElementLineHermite, MeshLine  # here: slow to import
    from skfem.helpers import d, dd

    bending = BilinearForm(lambda u, v, w: w.EI / w.h**3 * dd(u)[0, 0] * dd(v)[0, 0])
    stiffness = BilinearForm(
        lambda u, v, w: (
            w.EI / w.h**3 * dd(u)[0, 0] * dd(v)[0, 0]
            + beam.axial_force / w.h * d(u)[0] * d(v)[0]
            + beam.foundation * w.h * u * v
        )
    )
    inertia = BilinearForm(lambda u, v, w: w.rho_A * w.h * u * v)

    count = len(nodes) - 1
    ends = np.ascontiguousarray(np.arange(2 * count).reshape(count, 2).T)
    exact = 10 if beam.tapered else 6  # degree of u v, times that of A
    basis = Basis(MeshLine(np.tile([0.0, 1.0], count)[None], ends), ElementLineHermite(), intorder=exact)
    h = np.diff(nodes)
    z = nodes[:-1, None] + h[:, None] * basis.quadrature[0][0]
    w = {"h": np.broadcast_to(h[:, None], z.shape), "EI": beam.bending_stiffness(z), "rho_A": beam.line_mass(z)}
    more = beam.axial_force != 0 or beam.foundation != 0
    K, M = ((stiffness if more else bending).assemble(basis, **w), inertia.assemble(basis, **w))
    return K, M, basis.nodal_dofs


def joining(h: Vector, nodal_dofs: NDArray[np.int64]) -> sparse.csr_matrix:
    """Sparse map from (u, u_z) per node to (u, h u_z) per element end; nodal_dofs (2, 2 elements)."""
    node = np.repeat(np.arange(len(h)), 2) + np.tile([0, 1], len(h))
    columns = np.concatenate([2 * node, 2 * node + 1])
    values = np.concatenate([np.ones(2 * len(h)), np.repeat(h, 2)])
    return sparse.csr_matrix((values, (nodal_dofs.ravel(), columns)), shape=(4 * len(h), 2 * len(h) + 2))


def bending_root(beam: Beam, nodes: Vector) -> sparse.csr_matrix:
    """R (k, 2m) with RᵀR = K: √(EI w) times the curvature at Gauss points, and the like; compression's imaginary.

    ‖R u‖² keeps the strain energy of smooth shapes to about eps n² for n elements, uᵀK u only to eps n⁴.
    """
    h = np.diff(nodes)
    curvature, inside = _at_gauss_points(nodes, 4 if beam.tapered else 2, derivative=2)
    rows = [curvature(beam.bending_stiffness(inside))]
    for value, points, derivative in ((beam.axial_force, 3, 1), (beam.foundation, 4, 0)):
        if value != 0:
            rows.append(_at_gauss_points(nodes, points, derivative)[0](np.full(points * len(h), value)))
    return sparse.vstack(rows, format="csr")


def geometric_stiffness(nodes: Vector) -> sparse.csr_matrix:
    """∫ u_z v_z dz (2m, 2m): the stiffness of a unit of tension."""
    slope = _at_gauss_points(nodes, 3, derivative=1)[0](np.ones(3 * (len(nodes) - 1)))
    return (slope.T @ slope).tocsr()


def _at_gauss_points(nodes: Vector, points: int, derivative: int) -> tuple[Callable[[Vector], Any], Vector]:
    """(coefficient -> rows √(coefficient weight) u^(derivative)) and the points (e points,) they belong to."""
    x, weight = gauss_points(points)
    h = np.repeat(np.diff(nodes), points)
    element = np.repeat(np.arange(len(nodes) - 1), points)
    x, weight = np.tile(x, len(nodes) - 1), np.tile(weight, len(nodes) - 1)
    rows = _rows(nodes, element, x, derivative)
    return (lambda coefficient: sparse.diags(np.emath.sqrt(coefficient * weight * h)) @ rows), nodes[element] + h * x


def gauss_points(points: int) -> tuple[Vector, Vector]:
    """Gauss–Legendre points in [0, 1] and their weights, exact to degree 2 points - 1."""
    x, weight = np.polynomial.legendre.leggauss(points)
    if points == 2:
        x = np.array([-1.0, 1.0]) / np.sqrt(3)  # by hand: the table is off in its last digit
    return 0.5 + x / 2, weight / 2


def hermite_rows(nodes: Vector, z: ArrayLike, derivative: int = 0) -> sparse.csr_matrix:
    """Rows (k, 2m) that turn nodal (u, u_z) into u, u_z or u_zz at z (k,), inside [nodes[0], nodes[-1]]."""
    z = np.atleast_1d(np.asarray(z, dtype=float))
    element = np.clip(np.searchsorted(nodes, z, side="right") - 1, 0, len(nodes) - 2)
    x = (z - nodes[element]) / (nodes[element + 1] - nodes[element])
    return _rows(nodes, element, x, derivative)


def _rows(nodes: Vector, element: NDArray[np.int64], x: Vector, derivative: int) -> sparse.csr_matrix:
    """`hermite_rows` at x (k,) in [0, 1] of given elements."""
    h = nodes[element + 1] - nodes[element]
    shapes = hermite_shapes(x, derivative) / h**derivative
    shapes[1::2] *= h
    columns = (2 * element + np.arange(4)[:, None]).T
    rows = np.repeat(np.arange(len(x)), 4)
    return sparse.csr_matrix((shapes.T.ravel(), (rows, columns.ravel())), shape=(len(x), 2 * len(nodes)))


def hermite_shapes(x: Vector, derivative: int) -> Vector:
    """The four cubic Hermite shapes, or their derivatives, at x in [0, 1]: (4, k)."""
    zero = np.zeros_like(x)
    if derivative == 0:
        return np.array([1 - x**2 * (3 - 2 * x), x * (1 - x) ** 2, x**2 * (3 - 2 * x), x**2 * (x - 1)])
    if derivative == 1:
        return np.array([-6 * x * (1 - x), (1 - x) * (1 - 3 * x), 6 * x * (1 - x), x * (3 * x - 2)])
    if derivative == 2:
        return np.array([12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2]) + zero
    raise ValueError(f"derivative must be 0, 1 or 2, got {derivative!r} in interpolation; 2 is the curvature")
