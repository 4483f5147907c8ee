"""Time integration of linear structures with local contacts: systems, methods, events.

Nothing is compiled or imported from numba before a method is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from solvers.result import ContactLog, Cost, Energy, Solution, SolverError, Status
from solvers.system import Contact, Parameter, System

_LATER = {
    "integrate": "integration",
    "HenonRK2": "henon",
    "DormandPrince": "dormand_prince",
    "Exponential": "exponential",
    "RK4": "runge_kutta",
    "CentralDifference": "newmark",
    "Newmark": "newmark",
    "GeneralizedAlpha": "newmark",
    "lumped": "newmark",
    "lyapunov": "growth",
    "orbit": "shooting",
    "Orbit": "periodic",
    "OrbitError": "periodic",
    "branch": "continuation",
    "Branch": "continuation",
}

__all__ = [
    "Branch",
    "CentralDifference",
    "Contact",
    "ContactLog",
    "Cost",
    "DormandPrince",
    "Energy",
    "Exponential",
    "GeneralizedAlpha",
    "HenonRK2",
    "Newmark",
    "Orbit",
    "OrbitError",
    "Parameter",
    "RK4",
    "Solution",
    "SolverError",
    "Status",
    "System",
    "branch",
    "integrate",
    "lumped",
    "lyapunov",
    "orbit",
]


def __getattr__(name: str) -> Any:
    """Import methods when they are asked for."""
    if name not in _LATER:
        raise AttributeError(f"module 'solvers' has no attribute {name!r}; it offers {__all__}")
    value = getattr(import_module(f"solvers.{_LATER[name]}"), name)
    globals()[name] = value
    return value
