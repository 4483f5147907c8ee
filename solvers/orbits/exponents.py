"""Largest Lyapunov exponent of a motion: how fast neighbouring motions diverge."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from solvers.compiled.state import T_END
from solvers.energy_norm import energy_norm
from solvers.exponential.method import Exponential
from solvers.integration import prepared_run
from solvers.problem import Array, SolverError, Status, System
from solvers.problem.whole_runs import whole_runs

_BATCHES = 20


class Exponent(NamedTuple):
    """Largest Lyapunov exponent, 1/s, and its standard error from batches of the run."""

    value: float
    error: float


def lyapunov(
    system: System, q0: ArrayLike, q_dot0: ArrayLike, duration: float, discard: float = 0.0, method: Any = None
) -> Exponent:
    """Mean rate at which the tangent grows in the norm of energy, λ = lim ln‖∂x(t)/∂x(0)‖ / t.

    Positive for chaotic motion; ln|μ|/T on a periodic orbit of period T and largest multiplier μ.

    Parameters
    ----------
    system, q0, q_dot0, duration, method : as for `integrate`; an `Exponential`.
    discard : s from the start on that are not counted, in [0, duration); without it the result depends a little on the
        units of numbers that laws latch, on no others.

    Returns
    -------
    Exponent : value and standard error; the error means nothing when fewer than some 200 contacts were made.

    Raises
    ------
    ValueError for bad input before computing; SolverError when the run fails.

    References
    ----------
    Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980) 9; the derivative of an event's time enters the tangent.

    Examples
    --------
    >>> free = System.modal(omega=[10.0], zeta=[0.1])
    >>> round(lyapunov(free, [1.0], [0.0], duration=500.0, discard=100.0).value, 3)
    -1.0
    """
    if not 0.0 <= discard < duration:
        raise ValueError(f"discard must lie in [0, duration), got {discard!r} of {duration!r} s")
    run = prepared_run(system, q0, q_dot0, duration, None, Exponential() if method is None else method, True)
    norm = energy_norm(system, duration)
    inverse, growth = np.linalg.inv(norm), [0.5 * math.log(len(norm))] if discard == 0.0 else []
    borders = np.linspace(discard, duration, _BATCHES + 1)
    for border in borders[borders > 0.0]:  # the tangent follows to where a stretch ends
        run.state.now[T_END] = border
        with whole_runs():
            status = run.to_the_end(None)
        if status is not Status.DONE:
            raise SolverError(f"stopped at t = {run.time:.9g} s of {duration:g} s: {status.value}")
        growth.append(_log_size(run.tangent, norm, inverse))
    if not np.all(np.isfinite(growth)):
        raise SolverError("the tangent vanished: neighbouring motions meet below the range of numbers; shorten the run")
    rates = np.diff(growth) / np.diff(borders)
    return Exponent(float(rates.mean()), float(rates.std(ddof=1) / math.sqrt(_BATCHES)))


def _log_size(tangent: Any, norm: Array, inverse: Any) -> float:
    """Logarithm of the tangent's size at the time reached: of N ∂[q, q̇]/∂x(0) N⁻¹, latched numbers as they are."""
    matrix = norm @ tangent.blocks.T @ tangent.y[:, tangent.places].T
    matrix[:, : len(norm)] = matrix[:, : len(norm)] @ inverse
    largest = float(np.abs(matrix).max())
    return tangent.log_scale + math.log(largest * np.linalg.norm(matrix / largest)) if largest > 0.0 else -math.inf
