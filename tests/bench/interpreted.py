"""Every method on small systems with the kernels run as plain Python, so that coverage sees their lines (2 min).

    coverage run -a tests/bench/interpreted.py

Fails where the main method and `DormandPrince` end apart, and where a run stops that should not; all else about results
is what the tests are for.
"""

from __future__ import annotations

import sys

import numpy as np
import plain_kernels  # noqa: F401  first: it changes what the others import

import solvers
import solvers.integration as integration
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Tabulated, Viscoelastic, law
from fembeam import BandNoise, Harmonic
from solvers import Contact, System
from solvers.problem import COLUMNS


@law
def cubic(delta, delta_dot, entry_rate, stiffness):
    """A user's law."""
    return stiffness * delta**3


@law(derivative=lambda delta, delta_dot, entry_rate, stiffness: (2.0 * stiffness * delta, 0.0, 0.0))
def square(delta, delta_dot, entry_rate, stiffness):
    """One that brings its derivatives."""
    return stiffness * delta**2


@law
def brittle(delta, delta_dot, entry_rate, stiffness, depth):
    """A spring that has no value beyond a depth."""
    return stiffness * delta if delta < depth else np.nan


MAIN, REFERENCE = solvers.Exponential(1e-8), solvers.DormandPrince(1e-9)
TROUBLE: list[str] = []
STEPPING = [
    solvers.HenonRK2(1e-4, 2e-5, force_unstable=True),
    solvers.RK4(1e-4),
    solvers.RK4(1e-4, locate=False),
    solvers.CentralDifference(1e-4),
    solvers.Newmark(1e-4),
    solvers.GeneralizedAlpha(1e-4),
]
SOFT = Hysteretic.lankarani_nikravesh(1e7, restitution=0.5)
STEEP = Viscoelastic.tsuji(1e6, 0.5, mass=1.0)  # its slope at the surface is infinite: it has no tangent
LAWS = [
    Hertz(1e6),
    Hertz(1e6, exponent=1.2) + KelvinVoigt(1e3, 1.0),
    KelvinVoigt(1e4, 10.0),
    KelvinVoigt(1e4, 10.0, clamp=True),
    Hysteretic(1e6, damping_factor=3.0, clamp=True),
    PiecewiseLinear([1e4, 5e4], [2e-4]),
    PiecewiseLinear([1e4, 5e4], [2e-4]) + Hertz(1e5),
    Tabulated([0.0, 1e-4, 3e-4], [0.0, 1.0, 9.0]),
    cubic(stiffness=1e11),
    square(stiffness=1e8),
    STEEP,
]


def system(law=SOFT, n=2, stops=1, gap=0.0, sampled=False, zeta=0.02, omega=60.0):
    """Decoupled modes that meet stops on both sides, shaken by a harmonic or a tabulated load."""
    shape = np.array([1.0, 0.6, 0.3])[:n]
    touches = [Contact((-1.0) ** i * shape, law, gap=gap * (i + 1)) for i in range(stops)]
    signal = BandNoise(10.0, (0.0, 200.0), seed=1) if sampled else Harmonic(30.0, omega)
    return System.modal(np.array([40.0, 170.0, 500.0])[:n], zeta, touches, [(np.ones(n), signal)])


def coupled():
    """A dashpot between two masses, one of which is free."""
    C = 3.0 * np.array([[1.0, -1.0], [-1.0, 1.0]]) + np.diag([1.0, 0.0])
    return System(np.eye(2), C, np.array([[4e3, -4e3], [-4e3, 4e3]]), [Contact([0.0, 1.0], SOFT)])


SYSTEMS = [
    system(),
    system(n=3, stops=2, gap=2e-4),
    system(sampled=True),
    system(gap=-1e-4),
    system(gap=1e-3, sampled=True),
    system(zeta=[0.0, 1.5]),
    coupled(),
    System.modal([0.0], 0.0, [Contact([1.0], SOFT, gap=1e-3)]),
    System.modal([40.0], 0.0, [Contact([1.0], PiecewiseLinear([1e4, 5e4], [2e-4]))] * 2),
]


def begin(one):
    """At rest in the middle, on the way to the first stop."""
    return np.zeros(one.size), np.full(one.size, -0.1)


def tried(one, duration, dt=None, method=MAIN, **options):
    """One run; what goes wrong is told, not raised: interpreted arithmetic is stricter."""
    try:
        return solvers.integrate(one, *begin(one), duration, dt, method, **options)
    except Exception as error:
        TROUBLE.append(f"{type(error).__name__}: {error} ({method!r})")


def all_methods(one):
    """With output and without; the main method ends where the reference does."""
    runs = [tried(one, 0.05, dt, method) for method in (MAIN, REFERENCE) for dt in (3e-4, None)]
    ends = [run.q[-1] for run in runs if run is not None]
    if len(ends) < 4 or np.ptp([ends[1], ends[3]], axis=0).max() > 1e-6 * np.abs(ends[1]).max():
        TROUBLE.append(f"Exponential and DormandPrince differ: {ends}")
    for method in STEPPING:
        for dt in (1e-2, None):
            tried(one, 0.02, dt, method)
    for ledger in (False, True):
        tried(one, 0.05, 1e-2, solvers.Exponential(1e-6, ledger))
    tried(one, 0.05, tangent=True)


def all_laws():
    """Output times and ends of runs lie within contacts and on the way to their ends too."""
    for one_law in LAWS:
        one = system(one_law)
        run = tried(one, 0.05, 1e-4)
        tried(one, 0.05, tangent=one_law is not STEEP)
        tried(one, 1e-5, tangent=one_law is not STEEP)
        tried(one, 0.05, method=REFERENCE)
        for early in (1e-7, 1e-5, 2e-3) if run and len(run.contacts.t_out) else ():
            tried(one, run.contacts.t_out[0] - early, tangent=one_law is not STEEP)


def barely():
    """Contacts that hardly are one, at rest on the surface, pressed on it by a stiff dashpot."""
    for depth in (1e-3, 1e-6, 3e-7, 1e-7, 1e-9, 1e-12, -1e-9):  # of the swing
        one = System.modal([10.0], 0.0, [Contact([1.0], PiecewiseLinear([1e6]), gap=0.01 * (1.0 - depth))])
        for method in (MAIN, REFERENCE, *STEPPING):
            tried(one, 0.3, method=method)
    for method in (MAIN, REFERENCE, STEPPING[0]):
        for pressed, gap in ((-1.0, 0.0), (1.0, 0.0), (-1.0, 1e-9)):
            one = system(KelvinVoigt(1e6, 1e3), gap=gap).like(loads=[(np.ones(2), Harmonic(pressed, 0.0))])
            solvers.integrate(one, np.zeros(2), np.zeros(2), 0.02, None, method)


def parameters():
    """Tangents with respect to gap, stiffness and frequency of a load."""
    for sampled in (False, True):
        sides = [system(Hertz(1e6 * s), gap=1e-4 * s, omega=60.0 * s, sampled=sampled) for s in (0.999, 1.001)]
        middle = system(Hertz(1e6), gap=1e-4, sampled=sampled)
        tried(middle, 0.05, tangent=solvers.Parameter(*sides, 1e-3))


def in_pieces():
    """Runs handed over in short stretches, with logs that soon are full."""
    budget, integration._BUDGET = integration._BUDGET, 3
    for method in (MAIN, REFERENCE, *STEPPING[:3]):
        one = system(Hertz(1e8))
        run = integration.prepared_run(one, *begin(one), 0.03, None, method, method is MAIN)
        run.log = np.empty((1, COLUMNS))
        if run.tangent:
            run.engine.record_events(run.engine.state.event_record[:6])
        run.to_the_end(None)
    integration._BUDGET = budget


def stopped():
    """Runs that cannot go on, and those whose step is too long."""
    many = PiecewiseLinear([1.0] * 121, [1e-23 * i for i in range(1, 121)])
    for method in (MAIN, REFERENCE, *STEPPING):
        for one_law in (many, brittle(stiffness=1e2, depth=1.1e-3)):
            tried(System.modal([40.0], 0.0, [Contact([1.0], one_law)]), 0.05, method=method, check=False)
    for kind in (solvers.RK4, solvers.CentralDifference, solvers.HenonRK2):
        steps = (0.2,) if kind is not solvers.HenonRK2 else (0.2, 0.2)
        tried(System.modal([100.0], 0.0), 100.0, method=kind(*steps, force_unstable=True), check=False)
    tried(system(PiecewiseLinear([1e7])), 3.0, method=solvers.Newmark(1e-3, locate=False), check=False)


def main():
    """All systems, methods, laws, loads; tangents; failures."""
    with np.errstate(all="ignore"):
        for one in SYSTEMS:
            all_methods(one)
        for part in (all_laws, barely, parameters, in_pieces, stopped):
            part()
    sys.exit("\n".join(TROUBLE) or 0)


if __name__ == "__main__":
    main()
