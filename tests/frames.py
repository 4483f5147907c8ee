"""What tests of frames share: held dofs, frequencies of a frame by itself, the structures of the reference values."""

import numpy as np
from problems import state_matrix
from scipy import linalg, sparse

import fembeam as fb
import reduction

PORTAL = {"A": (0, 0), "B": (0, 3), "C": (4, 3), "D": (4, 0)}
SPACE_L = {"A": (0.0, 0.0, 0.0), "B": (0.5, 0.0, 0.0), "C": (0.5, 0.3, 0.0)}


def portal():
    steel = fb.Section.rectangle(2.1e11, 7850.0, width=0.05, height=0.1)
    return fb.Frame(PORTAL, [fb.Member("A", "B", steel), fb.Member("B", "C", steel), fb.Member("D", "C", steel)])


def space_l(turn=None):
    """The space L, turned by a rotation matrix."""
    turn = np.eye(3) if turn is None else turn
    flat = fb.Section.rectangle(2.1e11, 7850.0, width=0.02, height=0.01)
    nodes = {name: tuple(turn @ np.array(at)) for name, at in SPACE_L.items()}
    return fb.Frame.polyline(nodes, flat, up=tuple(turn[:, 2]))


def turned(seed):
    """A random rotation matrix."""
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return Q * np.linalg.det(Q)


def free_dofs(made, *places):
    """Numbers of the dofs that are left when places are clamped."""
    rows = sparse.vstack([sparse.csr_matrix((0, len(made.labels))), *(made.rows(place) for place in places)])
    return np.flatnonzero(np.diff(rows.tocsc().indptr) == 0)


def frequencies(made, count, *places):
    """The lowest frequencies with places clamped."""
    free = free_dofs(made, *places)
    root = None if made.root is None else made.root[:, free]
    return reduction.modal_basis(made.M[free][:, free], made.K[free][:, free], count, root=root).omega


def static(made, load, *places):
    """The static answer (N,) to a load (N,) with places clamped."""
    free = free_dofs(made, *places)
    u = np.zeros(len(made.labels))
    u[free] = sparse.linalg.spsolve(made.K[free][:, free].tocsc(), load[free])
    return u


def rigid_motions(made, position):
    """Translations along x, y, z and rotations about them through the origin, (N, 6)."""
    names = ("x", "y", "z", "rx", "ry", "rz")
    at = np.array([position(place) for place, _ in made.labels])
    turning = [np.hstack([np.cross(axis, at), np.tile(axis, (len(at), 1))]) for axis in np.eye(3)]
    turned = [[t[i, names.index(c)] if c in names else 0.0 for i, (_, c) in enumerate(made.labels)] for t in turning]
    return np.column_stack([made.translations, np.array(turned).T])


def whirl(made, *places):
    """Whirl frequencies, signed: plus where y follows x by a quarter turn, as the spin turns."""
    free = free_dofs(made, *places)
    M, K = (A[free][:, free].toarray() for A in (made.M, made.K))
    G = np.zeros_like(M) if made.gyroscopic is None else made.gyroscopic[free][:, free].toarray()
    tip = made.rows("B")[:, free].toarray()
    values, vectors = linalg.eig(state_matrix(M, G, K))
    upper = values.imag > 0
    x, y = tip[:2] @ vectors[: len(free), upper]
    sense = np.sign((np.conj(x) * y).imag)  # y = -i x in e^{iωt}: y is behind by a quarter, counterclockwise
    found = -sense * values.imag[upper]
    return found[np.argsort(np.abs(found))]
