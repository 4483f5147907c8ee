"""Forms of work and damping with the zeros left out, as large systems use them, against full ones."""

import numpy as np
import pytest

import fembeam as fb
import solvers
from contacts import KelvinVoigt
from solvers.exponential.energy import quadratic_forms


def system():
    """Twelve chain modes with a stop, a tone, a record and noise."""
    n = 12
    K = 400.0 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    w2, V = np.linalg.eigh(K)
    t = np.linspace(0.0, 1.0, 101)
    signals = [fb.Harmonic(3.0, 11.0), fb.Record(t, np.sin(9 * t) ** 3), fb.Record(t, 2.0 * np.cos(14 * t) ** 5)]
    loads = [(V[3 + i], signal) for i, signal in enumerate(signals)]
    return solvers.System(np.eye(n), np.diag(0.04 * np.sqrt(w2)), np.diag(w2),
                          [solvers.Contact(-V[6], KelvinVoigt(5e3, 1.0), 1e-3)], loads)  # fmt: skip


@pytest.mark.parametrize("tones_only", [True, False])
def test_sparse_forms_give_the_balance_of_full_ones(monkeypatch, tones_only):
    def balance():
        made = system()
        made = solvers.System(made.M, made.C, made.K, made.contacts, made.loads[:1]) if tones_only else made
        return solvers.integrate(made, np.zeros(12), np.zeros(12), 1.0, 0.01)

    full = balance()
    monkeypatch.setattr(quadratic_forms, "MOST_DENSE", 0)
    sparse = balance()
    assert len(full.contacts) > 0
    for name in ("input", "damping", "stored", "contact"):
        one, other = getattr(full.energy, name), getattr(sparse.energy, name)
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * np.abs(full.energy.stored).max())
    assert np.abs(sparse.energy.residual).max() < 1e-9 * np.abs(sparse.energy.input).max()
