"""Work and damping of many coordinates, whose forms leave the zeros out, against those of few, which are full."""

import numpy as np
import pytest
from scipy.linalg import block_diag

import fembeam as fb
from contacts import KelvinVoigt
from solvers import Contact, System, integrate

COPIES = 5  # of 12 coordinates each: more than 100 rows, from which on forms are sparse


def chain(copies, tones_only):
    """Copies of twelve chain modes that do not touch each other, each with a stop, a tone, a record and noise."""
    n = 12
    K = 400.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    w2, V = np.linalg.eigh(K)
    t = np.linspace(0.0, 1.0, 101)
    signals = [fb.Harmonic(3.0, 11.0), fb.Record(t, np.sin(9 * t) ** 3), fb.Record(t, 2.0 * np.cos(14 * t) ** 5)]
    loads = [(np.tile(V[3 + i], copies), signal) for i, signal in enumerate(signals)]
    stops = [Contact(row, KelvinVoigt(5e3, 1.0), 1e-3) for row in np.kron(np.eye(copies), -V[6])]
    C, K = (block_diag(*[part] * copies) for part in (np.diag(0.04 * np.sqrt(w2)), np.diag(w2)))
    return System(np.eye(copies * n), C, K, stops, loads[:1] if tones_only else loads)


@pytest.mark.parametrize("tones_only", [True, False])
def test_copies_of_a_structure_take_as_many_times_its_energy(tones_only):
    one, many = (
        integrate(system, np.zeros(system.size), np.zeros(system.size), 1.0, 0.01)
        for system in (chain(1, tones_only), chain(COPIES, tones_only))
    )
    assert len(many.contacts) == COPIES * len(one.contacts) > 0
    size = COPIES * np.abs(one.energy.stored).max()
    for name in ("input", "damping", "stored", "contact"):
        found, expected = getattr(many.energy, name), COPIES * getattr(one.energy, name)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * size, err_msg=name)
    assert np.abs(many.energy.residual).max() < 1e-9 * np.abs(many.energy.input).max()
