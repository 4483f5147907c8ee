"""Time integration of linear structures with local contacts: systems, methods, events.

`problem` holds what is to be solved and what comes out, `compiled` what all compiled functions share. `stepping` has
the methods of constant or controlled step, `exponential` the main method; `integration` runs any of them, `many` runs
many starts. `energy_norm` measures small changes. `sensitivities` derives runs by their start and by parameters.
`orbits` finds periodic motion, `branches` continues it over a parameter. Imports: numpy, scipy, numba;
nothing is compiled or imported from numba before a method is used. Begin with `problem.system`, then `integration`.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from solvers.problem import (
    Contact,
    ContactLog,
    Cost,
    Energy,
    Friction,
    Parameter,
    Solution,
    SolverError,
    Status,
    System,
)

_LATER = {
    "integrate": "integration",
    "integrate_many": "many",
    "ManySolutions": "many",
    "HenonRK2": "stepping.henon",
    "DormandPrince": "stepping.dormand_prince",
    "Exponential": "exponential.method",
    "RK4": "stepping.runge_kutta",
    "CentralDifference": "stepping.newmark",
    "Newmark": "stepping.newmark",
    "GeneralizedAlpha": "stepping.newmark",
    "lumped": "stepping.newmark",
    "sensitivity": "sensitivities.variation",
    "Sensitivity": "sensitivities.variation",
    "Nearby": "sensitivities.nearby",
    "NoDerivativeError": "sensitivities.events",
    "lyapunov": "orbits.exponents",
    "orbit": "orbits.shooting",
    "Orbit": "orbits.periodic_orbit",
    "OrbitError": "orbits.periodic_orbit",
    "branch": "branches.continuation",
    "Branch": "branches.continuation",
}

__all__ = [
    "RK4",
    "Branch",
    "CentralDifference",
    "Contact",
    "ContactLog",
    "Cost",
    "DormandPrince",
    "Energy",
    "Exponential",
    "Friction",
    "GeneralizedAlpha",
    "HenonRK2",
    "ManySolutions",
    "Nearby",
    "Newmark",
    "NoDerivativeError",
    "Orbit",
    "OrbitError",
    "Parameter",
    "Sensitivity",
    "Solution",
    "SolverError",
    "Status",
    "System",
    "branch",
    "integrate",
    "integrate_many",
    "lumped",
    "lyapunov",
    "orbit",
    "sensitivity",
]


def __getattr__(name: str) -> Any:
    """Import methods when they are asked for."""
    if name not in _LATER:
        raise AttributeError(f"module 'solvers' has no attribute {name!r}; it offers {__all__}")
    value = getattr(import_module(f"solvers.{_LATER[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names."""
    return __all__
