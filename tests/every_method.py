"""Every method, on every kind of own law: run once; ``python tests/every_method.py`` tells what had to be compiled."""

from scipy import sparse
from test_contacts import cubic, hertz_by_hand
from test_own_memory import OWN

import solvers

METHODS = {
    "Exponential": solvers.Exponential(),
    "DormandPrince": solvers.DormandPrince(1e-6),
    "HenonRK2": solvers.HenonRK2(1e-4, 1e-4),
    "RK4": solvers.RK4(1e-4),
    "CentralDifference": solvers.CentralDifference(1e-4),
    "Newmark": solvers.Newmark(1e-4),
    "GeneralizedAlpha": solvers.GeneralizedAlpha(1e-4),
}
LAWS = {"law": hertz_by_hand(stiffness=1e6), "law with derivative": cubic(stiffness=1e9), "law with memory": OWN}
START = [1e-3], [-0.5]


def ball(*laws):
    """A mass over stops."""
    return solvers.System([[2.0]], [[0.0]], [[0.0]], [solvers.Contact([1.0], law, always=law is OWN) for law in laws])


def run_all():
    """A few milliseconds of each."""
    every = ball(*LAWS.values())
    for name, method in METHODS.items():
        for system in [*map(ball, LAWS.values()), every]:
            solvers.integrate(system, *START, 0.01, method=method)
        if name in ("RK4", "CentralDifference", "Newmark", "GeneralizedAlpha"):
            matrices = (sparse.csc_array(matrix) for matrix in (every.M, every.C, every.K))
            solvers.integrate(solvers.System(*matrices, every.contacts), *START, 0.01, method=method)
    solvers.integrate(every, *START, 0.01, tangent=True)
    solvers.integrate_many(every, [START[0]] * 2, [START[1]] * 2, 0.01)


if __name__ == "__main__":
    from numba.core import event

    class Told(event.Listener):
        """Names what is compiled."""

        def on_start(self, _):
            """One step of the compiler."""

        def on_end(self, found):
            """It is done."""
            print(found.data["qualname"])

    event.register("numba:run_pass", Told())
    run_all()
