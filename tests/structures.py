"""Structures that tests share: a beam given by its matrices, and a small frame of springs in space."""

import numpy as np

import fembeam as fb
from contacts import KelvinVoigt

LENGTH, ELEMENTS = 0.5, 8
BEAM = fb.Beam(LENGTH, fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01))
LAW = KelvinVoigt(1e6, 10.0)
TURN = np.tile([1.0, -1.0], ELEMENTS + 1)  # u_z = -rx


def beam_labels():
    """Dofs of the nodes 0 to 8 of the beam, along y and about x."""
    return [(i, c) for i in range(ELEMENTS + 1) for c in ("y", "rx")]


def beam_matrices():
    """K and M of the free beam in y and rx, dense."""
    full = fb.Scene(BEAM).matrices(ELEMENTS)
    return tuple(TURN[:, None] * A.toarray() * TURN for A in (full.K, full.M))


def beam_structure(**options):
    """The beam as a structure, with named ends and a middle."""
    K, M = beam_matrices()
    given = {
        "labels": beam_labels(),
        "nodes": {i: (0.0, 0.0, i * LENGTH / ELEMENTS) for i in range(ELEMENTS + 1)},
        "points": {"root": 0, "middle": 4, "tip": 8},
        "lines": [tuple(range(ELEMENTS + 1))],
        **options,
    }
    return fb.Structure(K, M, **given)


def space_truss():
    """Four masses on springs in space, free: every pair joined along its line."""
    at = {1: (0.0, 0.0, 0.0), 2: (1.0, 0.0, 0.0), 3: (0.0, 1.0, 0.0), 4: (0.2, 0.3, 1.0)}
    K = np.zeros((12, 12))
    for a in range(4):
        for b in range(a):
            n = np.subtract(at[a + 1], at[b + 1])
            n /= np.linalg.norm(n)
            row = np.zeros(12)
            row[3 * a : 3 * a + 3], row[3 * b : 3 * b + 3] = n, -n
            K += 1e5 * np.outer(row, row)
    labels = [(node, c) for node in at for c in "xyz"]
    return fb.Structure(K, np.kron(np.diag([2.0, 1.0, 1.5, 0.5]), np.eye(3)), labels=labels, nodes=at,
                        points={"top": 4, "foot": 1})  # fmt: skip
