"""The bending beam: EI u'''' + ρA ü = 0 on spans of constant section, in cubic Hermite elements.

Every element stands on its own unit interval, z = z_e + h ξ, with unknowns (u, h u_z) at both ends:

    K_e = ∫ EI/h³ u_ξξ v_ξξ dξ,   M_e = ∫ ρA h u v dξ.

The unit interval is there for rounding: scikit-fem inverts the monomials of the coordinate it gets, and on
the beam's own axis 500 elements would lose nine of the sixteen digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from fembeam.section import Section, require, require_positive

Vector = NDArray[np.float64]
Span = tuple[float, Section]


@dataclass(frozen=True)
class Beam:
    """A straight beam from z = 0 to z = length, of one section or of several spans.

    Parameters
    ----------
    length : m, > 0.
    section : Section; None in a beam of several spans.
    spans : ((length, section), …) from z = 0 on; leave it to `Beam.of_spans`.

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
    section: Section | None
    spans: tuple[Span, ...] = ()

    def __post_init__(self) -> None:
        require_positive("length", self.length, "Beam", "give the length in m")
        if self.section is not None:  # rebuilt always, so that dataclasses.replace(beam, length=…) works
            object.__setattr__(self, "spans", ((self.length, self.section),))
        require(len(self.spans) > 0, "spans must not be empty", self.spans, "Beam", "give (length, section) pairs")
        for index, (length, section) in enumerate(self.spans):
            require_positive(f"length of span {index}", length, "Beam", "give the length in m")
            if not isinstance(section, Section):
                raise TypeError(f"section of span {index} must be a Section, got {section!r} in Beam; make one first")
        total = sum(length for length, _ in self.spans)
        require(abs(total - self.length) <= 1e-12 * total, f"length must be {total}", self.length, "Beam",
                "use Beam.of_spans")  # fmt: skip

    @classmethod
    def of_spans(cls, spans: Sequence[Span]) -> Beam:
        """A beam of several spans [(length, section), …], rigidly joined, from z = 0 on."""
        spans = tuple((length, section) for length, section in spans)
        require(len(spans) > 0, "spans must not be empty", spans, "Beam.of_spans", "give (length, section) pairs")
        for index, (length, _) in enumerate(spans):
            require_positive(f"length of span {index}", length, "Beam.of_spans", "give the length in m")
        if len(spans) == 1:
            return cls(*spans[0])
        return cls(sum(length for length, _ in spans), None, spans)

    @property
    def borders(self) -> tuple[float, ...]:
        """Coordinates of the span ends, 0 and length included."""
        return (0.0, *np.cumsum([length for length, _ in self.spans]).tolist()[:-1], float(self.length))

    def bending_stiffness(self, z: ArrayLike) -> Vector:
        """EI (k,) in N m² at z (k,); at a border the span ahead."""
        return np.array([section.bending_stiffness for _, section in self.spans])[self._span(z)]

    def line_mass(self, z: ArrayLike) -> Vector:
        """ρA (k,) in kg/m at z (k,); at a border the span ahead."""
        return np.array([section.line_mass for _, section in self.spans])[self._span(z)]

    def _span(self, z: ArrayLike) -> NDArray[np.int64]:
        """Index of the span that holds z."""
        return np.searchsorted(self.borders[1:-1], z, side="right")


def bending_matrices(beam: Beam, nodes: Vector) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Bending stiffness K and consistent mass M on all dofs (u_0, u_z0, u_1, u_z1, …).

    K = Σ ∫ EI u_zz v_zz dz,  M = Σ ∫ ρA u v dz

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
    from skfem import Basis, BilinearForm, ElementLineHermite, MeshLine  # here: slow to import
    from skfem.helpers import dd

    bending = BilinearForm(lambda u, v, w: w.EI / w.h**3 * dd(u)[0, 0] * dd(v)[0, 0])
    inertia = BilinearForm(lambda u, v, w: w.rho_A * w.h * u * v)

    count = len(nodes) - 1
    ends = np.ascontiguousarray(np.arange(2 * count).reshape(count, 2).T)
    basis = Basis(MeshLine(np.tile([0.0, 1.0], count)[None], ends), ElementLineHermite())
    h = np.diff(nodes)
    z = nodes[:-1, None] + h[:, None] * basis.quadrature[0][0]
    w = {
        "h": np.broadcast_to(h[:, None], z.shape),
        "EI": beam.bending_stiffness(z),
        "rho_A": beam.line_mass(z),
    }
    join = _joining(h, basis.nodal_dofs)
    return tuple((join.T @ form.assemble(basis, **w) @ join).tocsr() for form in (bending, inertia))  # type: ignore


def _joining(h: Vector, nodal_dofs: NDArray[np.int64]) -> sparse.csr_matrix:
    """Sparse map from (u, u_z) per node to (u, h u_z) per element end; nodal_dofs (2, 2 elements)."""
    node = np.repeat(np.arange(len(h)), 2) + np.tile([0, 1], len(h))
    columns = np.concatenate([2 * node, 2 * node + 1])
    values = np.concatenate([np.ones(2 * len(h)), np.repeat(h, 2)])
    return sparse.csr_matrix((values, (nodal_dofs.ravel(), columns)), shape=(4 * len(h), 2 * len(h) + 2))


def bending_root(beam: Beam, nodes: Vector) -> sparse.csr_matrix:
    """R (2 elements, 2m) with RᵀR = K: √(EI w) times the curvature at two Gauss points per element.

    ‖R u‖² keeps the strain energy of smooth shapes to about eps n² for n elements, uᵀK u only to eps n⁴.
    """
    h = np.repeat(np.diff(nodes), 2)
    element = np.repeat(np.arange(len(nodes) - 1), 2)
    x = np.tile(0.5 + np.array([-0.5, 0.5]) / np.sqrt(3), len(nodes) - 1)  # exact: linear curvature, squared
    weight = np.sqrt(beam.bending_stiffness(nodes[element] + h * x) * h / 2)
    return (sparse.diags(weight) @ _rows(nodes, element, x, derivative=2)).tocsr()


def hermite_rows(nodes: Vector, z: ArrayLike, derivative: int = 0) -> sparse.csr_matrix:
    """Rows (k, 2m) that turn nodal (u, u_z) into u, u_z or u_zz at z (k,), inside [nodes[0], nodes[-1]]."""
    z = np.atleast_1d(np.asarray(z, dtype=float))
    element = np.clip(np.searchsorted(nodes, z, side="right") - 1, 0, len(nodes) - 2)
    x = (z - nodes[element]) / (nodes[element + 1] - nodes[element])
    return _rows(nodes, element, x, derivative)


def _rows(nodes: Vector, element: NDArray[np.int64], x: Vector, derivative: int) -> sparse.csr_matrix:
    """The same at x in [0, 1] of given elements."""
    h = nodes[element + 1] - nodes[element]
    shapes = _shapes(x, derivative) / h**derivative
    shapes[1::2] *= h
    columns = (2 * element + np.arange(4)[:, None]).T
    rows = np.repeat(np.arange(len(x)), 4)
    return sparse.csr_matrix((shapes.T.ravel(), (rows, columns.ravel())), shape=(len(x), 2 * len(nodes)))


def _shapes(x: Vector, derivative: int) -> Vector:
    """The four cubic Hermite shapes, or their derivatives, at x in [0, 1]: (4, k)."""
    zero = np.zeros_like(x)
    if derivative == 0:
        return np.array([1 - x**2 * (3 - 2 * x), x * (1 - x) ** 2, x**2 * (3 - 2 * x), x**2 * (x - 1)])
    if derivative == 1:
        return np.array([-6 * x * (1 - x), (1 - x) * (1 - 3 * x), 6 * x * (1 - x), x * (3 * x - 2)])
    if derivative == 2:
        return np.array([12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2]) + zero
    raise ValueError(f"derivative must be 0, 1 or 2, got {derivative!r} in interpolation; 2 is the curvature")
