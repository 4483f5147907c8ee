"""A law that is not finite from the start on: every method ends, and says that it is the law."""

import numpy as np
import pytest

import solvers
from contacts import law

METHODS = [
    solvers.DormandPrince(), solvers.Exponential(), solvers.RK4(1e-3, 1e-4), solvers.Newmark(1e-3, 1e-4),
    solvers.HenonRK2(1e-3, 1e-4),
]  # fmt: skip


@law
def breaks(delta, delta_dot, entry_rate, k):
    """Finite where laws are looked at before a run, and not farther in."""
    return np.nan if delta > 0.01 else k * delta


@law
def stalls(delta, delta_dot, entry_rate, k):
    """Not finite while it goes in."""
    return np.nan if delta_dot > 1e-9 else k * delta


def pressed(chosen, push=0.0):
    """A mass that begins 20 mm in under a constant force, N."""
    contacts, loads = [solvers.Contact([1.0], chosen)], [([-1.0], lambda t: push + 0.0 * np.asarray(t))]
    return solvers.System(np.eye(1), [[0.1]], [[100.0]], contacts, loads if push else []), [-0.02], [0.0]


@pytest.mark.parametrize("method", METHODS, ids=lambda one: type(one).__name__)
def test_at_the_start(method):
    """At t = 0, where any step however short still moves the clock."""
    with pytest.raises(
        solvers.SolverError, match=r"stopped at t = 0 s .* a contact law gave a force that is not finite"
    ):
        solvers.integrate(*pressed(breaks(k=100.0)), 1.0, method=method)


@pytest.mark.parametrize("method", METHODS[:2], ids=lambda one: type(one).__name__)
def test_just_after_the_start(method):
    """Finite at t = 0 itself, and no more once a load has pushed the mass in."""
    with pytest.raises(solvers.SolverError, match="a contact law gave a force that is not finite"):
        solvers.integrate(*pressed(stalls(k=100.0), 10.0), 1.0, method=method)


def test_many():
    """The same for many starts at once."""
    system, q, v = pressed(breaks(k=100.0))
    with pytest.raises(solvers.SolverError, match=r"t = 0 s of 1 s: a contact law gave .* \(2 of 2 starts failed\)"):
        solvers.integrate_many(system, [q, q], [v, v], 1.0, solvers.Exponential())
