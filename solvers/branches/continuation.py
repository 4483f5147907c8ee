"""Branches of periodic orbits by pseudo-arclength continuation.

Each step predicts a point, on the tangent or on the cubic through the last two points, corrects it by Newton's method
(Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977), and sets the next step by the error
of the prediction. A branch may fold; it has corners where contacts graze, and jumps where two contacts become one.
`walk` controls the steps, `point` takes one, `bifurcations` locates the special points in between, `nonsmooth` crosses
corners and jumps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.branches.ending import ending
from solvers.branches.point import Point, metric_of, point_of
from solvers.branches.reshooting import reshot
from solvers.branches.subharmonic_end import Scaled
from solvers.branches.walk import BranchStatus, Walk
from solvers.orbits import (
    Orbit,
    PeriodicProblem,
    at_zero,
    checked,
    checked_start,
    codes,
    constant,
    newton,
    orbit_of,
    solved_chain,
)
from solvers.problem import System, counted


@dataclass(eq=False)
class Branch:
    """Orbits along a parameter, computed as they are asked for: iterate over it, or call `run`; made by `branch`.

    An iteration may be interrupted: the next one yields the known orbits, then continues.
    """

    walks: list[Walk]
    kept: dict[int, Any] = field(default_factory=dict)  # for the user of the branch

    def __repr__(self) -> str:
        return f"<branch of {counted(len(self.orbits), 'orbit')}: {'; '.join(self.endings)}>"

    @property
    def orbits(self) -> list[Orbit]:
        """The orbits known so far, from one end of the branch to the other; special ones carry a ``mark``."""
        behind = self.walks[1].orbits[:0:-1] if len(self.walks) > 1 else []
        return behind + self.walks[0].orbits

    @property
    def status(self) -> tuple[BranchStatus, ...]:
        """How each direction ended."""
        closed = self.walks[0].status is BranchStatus.CLOSED  # then there is but one direction
        return tuple(walk.status for walk in self.walks[: 1 if closed else None])

    @property
    def endings(self) -> tuple[str, ...]:
        """How each direction ended, in words, and where, unless that is the end of the span."""
        return tuple(ending(walk) for walk in self.walks[: len(self.status)])

    @property
    def special(self) -> list[Orbit]:
        """The marked orbits."""
        return [orbit for orbit in self.orbits if orbit.mark]

    def __iter__(self) -> Iterator[Orbit]:
        """Known orbits, then new ones, one direction after the other."""
        for number, walk in enumerate(self.walks):
            if self.walks[0].status is BranchStatus.CLOSED and number:
                return
            i = min(number, 1)  # both walks begin with the same orbit
            while True:
                while i < len(walk.orbits):
                    yield walk.orbits[i]
                    i += 1
                if walk.status is not BranchStatus.RUNNING:
                    break
                walk.extend()

    def run(self) -> Branch:
        """Compute all of it."""
        for _ in self:
            pass
        return self

    def doubled(self, flip: Orbit) -> Branch:
        """The branch of twice the period that is born at a flip of this one."""
        if flip.mark != "flip":
            raise ValueError(f"a branch doubles at an orbit marked 'flip', got one marked {flip.mark!r}")
        walk = self.walks[0]
        old = walk.first.problem
        fraction = flip.phase / flip.period
        problem = PeriodicProblem(Scaled(old.make, 2.0), old.method, (0.5 * fraction, 0.5 * fraction + 0.5), old.step)
        values, vectors = np.linalg.eig(flip.monodromy)
        v = vectors[:, np.argmin(np.abs(values + 1.0))].real
        chain = problem.evaluate(np.array([flip.whole, flip.whole]), flip.parameter)
        metric = metric_of(problem, chain, walk.span[1] - walk.span[0])
        turning = np.zeros(len(flip.whole))
        turning[~codes(flip.system)] = v
        tangent = np.concatenate((turning, -turning, [0.0]))
        tangent /= math.sqrt(tangent @ metric @ tangent)
        orbit = orbit_of(problem, replace(chain, error=flip.residual), "flip")
        return Branch([Walk(Point(orbit, problem, chain, tangent, metric), walk.span, walk.largest)])


def branch(
    make_system: Callable[[float], tuple[System, float]],
    span: tuple[float, float],
    start: Orbit | ArrayLike,
    at: float | None = None,
    *,
    step: float = 0.04,
    shots: int = 1,
    method: Any = None,
) -> Branch:
    """Follow a periodic orbit along a parameter, in both directions.

    Parameters
    ----------
    make_system : parameter -> (system, period in s); the systems must agree in size, contacts and loads.
    span : (lowest, highest) value of the parameter.
    start : an orbit, or a state [q, q̇] at t = 0 near one, as for `orbit`.
    at : the parameter there; None: the orbit's own, else ``span[0]``.
    step : largest step along the branch, in units of the span and the first orbit's size.
    shots : per period.
    method : an `Exponential`; None takes one with rtol 1e-11.

    Returns
    -------
    Branch : nothing but its first orbit is computed before it is iterated over.

    Raises
    ------
    ValueError for bad input; OrbitError when there is no orbit near the start.

    Examples
    --------
    >>> def free(omega):
    ...     return System.modal([1.0], [0.1]), 2.0 * np.pi / omega
    >>> branch(free, (0.5, 2.0), start=[0.0, 0.0], step=0.5).run().status
    (<BranchStatus.END: 'reached the end of the span'>,)
    """
    low, high = (float(value) for value in span)
    if not -math.inf < low < high < math.inf:
        raise ValueError(f"span must be two finite values, ascending, got {span!r}")
    if not 0.0 < step <= 1.0:
        raise ValueError(f"step must lie in (0, 1], got {step!r}")
    own = start.parameter if isinstance(start, Orbit) else math.nan
    if at is None and isinstance(start, Orbit) and math.isnan(own):
        raise ValueError("the orbit to start from knows no parameter; give at=")
    parameter = at if at is not None else low if math.isnan(own) else own
    if not low <= parameter <= high:
        raise ValueError(f"the start must lie in the span {span}, got {parameter!r}; give at=")
    system, period = make_system(parameter)
    method = checked(system, period, method, shots)
    first = at_zero(start) if isinstance(start, Orbit) else checked_start(system, start, period, method)
    problem, chain = solved_chain(constant(system, period, method), first, shots)
    problem = replace(problem, make=make_system, step=1e-6 * (high - low))
    chain = newton(problem, chain.x, parameter, slope=True)
    metric = metric_of(problem, chain, high - low)
    ahead = np.zeros(len(metric))
    ahead[-1] = 1.0
    point = reshot(point_of(problem, chain, metric, ahead))
    back = replace(point, tangent=-point.tangent)
    return Branch(
        [Walk(p, (low, high), step) for p, room in ((point, parameter < high), (back, parameter > low)) if room]
    )
