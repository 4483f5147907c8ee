"""What all methods of constant step share: checked before they start, watched while they run.

Borders of laws with memory are not located: a step keeps the segment it began with, in implicit steps through all
iterations. At its end every border with a negative margin is renewed, until none is left (a return map). A force that
is late by part of a step leaves an error of order h² per border where the force is continuous, h where it jumps.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from solvers.problem import Array, Forcing, System, require_step
from solvers.problem.run_arguments import check_maps
from solvers.stepping.critical_step import eigen_oscillators
from solvers.stepping.events import IGNORED, LOCATED
from solvers.stepping.stability import Limit, Radius, half_periods, largest_steps, with_tangents


class ConstantStep(ABC):
    """A method of constant step: checked before it starts, watched while it runs."""

    adaptive: ClassVar[bool] = False
    rtol: ClassVar[float] = 1e-10  # for sampling signals
    atol: ClassVar[float] = 0.0
    constants: ClassVar[tuple[float, ...]] = ()
    dt: float
    locate: bool
    force_unstable: bool

    def __post_init__(self) -> None:
        require_step("dt", self.dt)

    @property
    def steps(self) -> tuple[float, float]:
        """Steps in flight and in contact, s."""
        return self.dt, self.dt

    @property
    def events(self) -> int:
        """How events are treated: located, or ignored until the end of a step."""
        return LOCATED if self.locate else IGNORED

    @property
    @abstractmethod
    def radius(self) -> Radius:
        """Spectral radius of a step."""

    def takes_matrices(self, system: System) -> bool:
        """Whether a run steps on the matrices themselves rather than on decoupled modes."""
        return False

    def stable_dt(self, system: System, indentation: float | None = None, duration: float = math.inf) -> Limit:
        """Predicted limits of the step.

        Parameters
        ----------
        system : the problem.
        indentation : expected one in m, for the tangent of the contact laws; None takes that of a hit at 1 m/s.
        duration : s; a short run may amplify a mode by a tenth.

        Returns
        -------
        Limit : the named tuple (flight, contact, mode, contact_mode) in s; 0 where no step is stable, inf where every
            one is.

        Notes
        -----
        Exact, dashpots that couple the modes included; in contact as good as a frozen tangent is. Of large sparse
        matrices only the largest, the most damped and the fastest eigenvalues are asked.
        """
        check_maps(system, self)
        flight, mode = self._shortest(system, *self.oscillators(system), duration)
        if not system.contacts:
            return Limit(flight, math.inf, mode, -1)
        decisive = self.critical(system.M, *with_tangents(system, indentation), system.gyroscopic)
        longest = duration  # of a contact: a preloaded one may last for ever
        if not any(contact.always or contact.gap < 0.0 for contact in system.contacts) and duration < math.inf:
            longest = min(duration, max(half_periods(system, indentation), default=0.0))
        contact, contact_mode = self._shortest(system, *decisive, longest)
        return Limit(flight, contact, mode, contact_mode)

    def _shortest(self, system: System, k: Array, c: Array, duration: float) -> tuple[float, int]:
        """Smallest limit of oscillators, and which mode it is; -1 if they are not the modes."""
        steps = largest_steps(self.radius, k, c, duration)
        return float(steps.min()), int(np.argmin(steps)) if len(steps) == system.size else -1

    def critical(self, M: Any, C: Any, K: Any, G: Any) -> tuple[Array, Array]:
        """Stiffness k and damping c (j,) of the oscillators that decide on matrices."""
        return eigen_oscillators(M, C, K, G)

    def oscillators(self, system: System) -> tuple[Array, Array]:
        """The same of a system in flight: its decoupled modes, or the oscillators that limit a step on its matrices."""
        if system.sparse or self.takes_matrices(system):
            return self.critical(system.M, system.C, system.K, system.gyroscopic)
        return system.blocks.k, system.blocks.c

    def prepared(self, system: System, forcing: Forcing, duration: float) -> tuple[Forcing, None]:
        """The forcing alone: nothing is tabulated in advance."""
        return forcing, None

    def engine(self, system: System, z: Array, prepared: tuple[Forcing, None], duration: float) -> Any:
        """The method made ready for one run; ValueError for a step that is predicted to be unstable or blind."""
        if not self.force_unstable:
            check_stability(self, system, duration)
            check_sampling(self, prepared[0])
        if self.takes_matrices(system):
            from solvers.stepping.sparse import MatrixEngine

            return MatrixEngine(self, system, z, prepared[0], duration)
        from solvers.stepping.engine import Engine  # here: the loop knows the methods' modules

        return Engine(self, system, z, prepared[0], duration)


def check_stability(method: ConstantStep, system: System, duration: float) -> None:
    """ValueError for a step above its limit; checked once per system."""
    key = "limit", type(method), method.constants, duration
    found = system.kept.get(key, lambda: method.stable_dt(system, duration=duration))
    for where, step, longest, mode in (
        ("in flight", method.steps[0], found.flight, found.mode),
        ("in contact, hit at 1 m/s", method.steps[1], found.contact, found.contact_mode),
    ):
        if not step <= longest:
            advice = f"take a step below {longest:.3g} s" if longest > 0.0 else "no step is stable: take another method"
            raise ValueError(
                f"{method!r} is unstable {where}: mode {_name(system, mode)} allows {longest:.3g} s, got {step:g} s; "
                f"{advice}, or run it all the same with force_unstable=True"
            )


def check_sampling(method: ConstantStep, forcing: Forcing) -> None:
    """ValueError for a step that samples a load less than twice in its period, and so takes it for a slower one."""
    seen = forcing.tone_omega[forcing.tone_amplitude != 0.0]
    tables = [forcing.table[a:b] for a, b in pairwise(forcing.table_start.tolist())]
    fastest = max([0.0, *seen, *map(_mean_frequency, forcing.table_dt.tolist(), tables)])
    if max(method.steps) * fastest > math.pi:
        raise ValueError(
            f"{method!r} samples a load of {fastest:.4g} rad/s less than twice in its period; take a step below "
            f"{math.pi / fastest:.3g} s, or run it all the same with force_unstable=True"
        )


def _mean_frequency(dt: float, rows: Array) -> float:
    """Root mean square frequency of a node table, rad/s; a kink counts as its curvature within a cell."""
    size = float(np.linalg.norm(rows[:, 1])) if len(rows) else 0.0
    curvature = rows[:, 2] + (rows[:, 1] - rows[:, -2]) / dt
    return float(np.linalg.norm(curvature)) / size if size > 0.0 else 0.0


def _name(system: System, mode: int) -> str:
    """A mode for a message, counted from 1."""
    return "of the highest frequency" if system.sparse or mode < 0 else f"{mode + 1} of {system.size}"
