r"""How long a constant step may be: predicted, before a run begins.

One step of a linear method multiplies the state of a mode p'' + c p' + k p = 0 by a matrix; the motion stays bounded if
its spectral radius ρ(h) is at most 1. A run of duration T is refused if it would amplify a mode by more than a tenth,
ln ρ · T/h > 0.1: the limit proper for T → ∞, and for a short run of an undamped mode a little more.

In contact the law is replaced by its tangent at the expected indentation, k_t = ∂F/∂δ and c_t = ∂F/∂δ̇:

.. math:: K_c = K + k_t\, w w^T,\qquad C_c = C + c_t\, w w^T

and the modes of (M, C_c, K_c) are judged in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from solvers.problem import Array, Contact, System
from solvers.problem.friction import Rubbing

Radius = Callable[[Any, Any, Any], Any]
"""ρ(h, k, c): factor by which one step of size h multiplies a mode p'' + c p' + k p = 0; arrays as numbers."""

EXPECTED_SPEED = 1.0  # m/s; the frequency on a Hertz stop goes with its fifth root, so a guess is good enough
_SLACK = 1e-10  # rounding of ρ
_GROWTH = 0.1  # allowed logarithm of the amplification of a mode in a run
_SMALLEST, _LARGEST, _PER_DECADE = 1e-2, 1e2, 60  # h × fastest rate, searched first; never stable below
_AT_ONCE = 100  # modes that are searched in one array


class Limit(NamedTuple):
    """Largest stable steps in s, in flight and with the stops in contact; the mode (0 the lowest) that sets each.

    A mode is -1 where one vector stands for all, as on sparse matrices.
    """

    flight: float
    contact: float
    mode: int
    contact_mode: int


# --- spectral radii --------------------------------------------------------------------------------------------------


def taylor_radius(order: int) -> Radius:
    """ρ of an explicit Runge–Kutta method with as many stages as its order: |Σ (hλ)^j/j!| over both eigenvalues λ."""
    coefficients = [1.0 / math.factorial(j) for j in range(order, -1, -1)]

    def radius(h: Any, k: Any, c: Any) -> Any:
        root = np.sqrt(0.25 * c * c - k + 0j)
        roots = np.array([h * (-0.5 * c + root), h * (-0.5 * c - root)])
        return np.abs(np.polyval(coefficients, roots)).max(axis=0)

    return radius


def alpha_radius(alpha_m: float, alpha_f: float, beta: float, gamma: float) -> Radius:
    """ρ of the generalised-α family, see `newmark`, from its matrix on (p, h p', h² p'')."""
    predicted = np.array([[1.0, 1.0, 0.5 - beta], [0.0, 1.0, 1.0 - gamma]])
    kept = 1.0 - alpha_f

    def radius(h: Any, k: Any, c: Any) -> Any:
        x, y = (np.asarray(each)[..., None] for each in (h * h * k, h * c))
        effective = (1.0 - alpha_m) + kept * (y * gamma + x * beta)
        old = np.concatenate([-alpha_f * x, -alpha_f * y, np.full_like(x, -alpha_m)], axis=-1)
        a = (old - kept * (x * predicted[0] + y * predicted[1])) / effective
        step = np.stack([predicted[0] + beta * a, predicted[1] + gamma * a, a], axis=-2)
        if alpha_m == 0.0 and alpha_f == 0.0:  # the equation holds at every step: p'' is no unknown of its own
            step = step[..., :2, :2] - step[..., :2, 2:] * np.concatenate([x, y], axis=-1)[..., None, :]
        return np.abs(np.linalg.eigvals(step)).max(axis=-1)

    return radius


# --- limits ----------------------------------------------------------------------------------------------------------


def largest_steps(radius: Radius, k: Array, c: Array, duration: float) -> Array:
    """Largest h (j,) up to which modes (j,) are not amplified by a tenth within ``duration`` s; 0 if there is none."""

    def stable(h: Array, mode: Any) -> Any:
        growth = radius(h, k[mode], c[mode]) - 1.0
        amplified = np.log1p(np.maximum(growth, _SLACK)) * np.maximum(duration / h, 1.0)
        return (growth <= _SLACK) | (amplified <= _GROWTH)

    found, fastest = np.full(k.shape, math.inf), np.maximum(np.sqrt(np.abs(k)), np.abs(c))
    moving = np.flatnonzero(fastest > 0.0)
    for start in range(0, moving.size, _AT_ONCE):
        part = moving[start : start + _AT_ONCE]
        found[part] = _first_border(stable, part, fastest[part], duration, _LARGEST)
    # Of an overdamped mode c is the fastest rate. Implicit damping leaves borders at 1/√k, or at c/k with γ > ½.
    slow = np.flatnonzero((found == math.inf) & (k > 0.0) & (c**2 > k))
    if slow.size:
        most = _LARGEST * float((c[slow] ** 2 / k[slow]).max())
        found[slow] = _first_border(stable, slow, fastest[slow], duration, most)
    return found


def _first_border(
    stable: Callable[[Array, Any], Any], modes: Any, fastest: Array, duration: float, most: float
) -> Array:
    """Longest step of the first interval of stable steps, by search on a grid and bisection, for modes (j,)."""
    grid = np.geomspace(_SMALLEST, most, round(_PER_DECADE * math.log10(most / _SMALLEST)) + 1)
    steps = grid / fastest[:, None]
    good = stable(steps, modes[:, None])
    border, first = np.full(len(modes), math.inf), np.argmin(good, axis=1)
    inside = np.flatnonzero(first > 0)
    low, high = steps[inside, first[inside] - 1], steps[inside, first[inside]]
    while np.any(high - low > 1e-9 * high):
        middle = 0.5 * (low + high)
        holds = stable(middle, modes[inside])
        low, high = np.where(holds, middle, low), np.where(holds, high, middle)
    border[inside] = low
    for mode in np.flatnonzero(~good[:, 0]):
        smaller = steps[mode, 0] * 0.5 ** np.arange(1, 41)
        holds = stable(smaller, modes[mode]) & (duration < math.inf)
        border[mode] = smaller[np.argmax(holds)] if holds.any() else 0.0
    return border


def with_tangents(system: System, indentation: float | None) -> tuple[Any, Any]:
    """C and K with every stop's tangent."""
    from scipy.sparse import csc_array

    C, K = system.C, system.K
    for contact, (stiffness, damping, _) in zip(system.contacts, tangents(system, indentation), strict=True):
        column = contact.direction[:, None]
        column = csc_array(column) if system.sparse else column
        outer = column @ column.T
        C, K = C + damping * outer, K + stiffness * outer
    return C, K


def half_periods(system: System, indentation: float | None) -> list[float]:
    """Half a period, s, on the tangent of every stop that has a stiffness."""
    found = tangents(system, indentation)
    return [math.pi * math.sqrt(mass / stiffness) for stiffness, _, mass in found if stiffness > 0.0]


def tangents(system: System, indentation: float | None) -> list[tuple[float, float, float]]:
    """The `tangent` of every stop; computed once per system."""
    key = "tangents", indentation
    return system.kept.get(key, lambda: [tangent(system, contact, indentation) for contact in system.contacts])


def tangent(system: System, contact: Contact, indentation: float | None) -> tuple[float, float, float]:
    """∂F/∂δ, ∂F/∂δ̇ of a stop at its expected indentation, and the mass 1/(wᵀM⁻¹w) it feels."""
    reach = float(contact.direction @ _solve(system.M, contact.direction))
    if not reach > 0.0:  # nothing moves it
        return 0.0, 0.0, math.inf
    mass = 1.0 / reach
    if indentation is None:
        delta, speed = max(_depth(contact.law, mass, EXPECTED_SPEED), -contact.gap), EXPECTED_SPEED
    else:
        delta, speed = indentation, math.sqrt(2.0 * max(work_of(contact.law, indentation), 0.0) / mass)
    speed = max(speed, contact.law.entry_rate_floor)
    around = delta * np.array([1.0 - 1e-6, 1.0 + 1e-6])
    forces = contact.law.force(around, 0.0, speed)
    if getattr(contact.law, "opens", False):  # its unloading is steepest
        forces = contact.law.along([0.0, *around[::-1]])[:0:-1]  # type: ignore[attr-defined]
    by_delta = np.diff(forces)[0] / (around[1] - around[0])
    by_rate = np.diff(contact.law.force(np.full(2, delta), speed * np.array([-1e-6, 1e-6]), speed))[0] / (2e-6 * speed)
    if not np.isfinite(by_delta + by_rate):
        return 0.0, 0.0, mass
    return float(by_delta), float(by_rate), mass


def _solve(M: Any, vector: Array) -> Array:
    """M⁻¹ times a vector."""
    if hasattr(M, "toarray"):
        from scipy.sparse.linalg import spsolve

        return np.asarray(spsolve(M, vector)).reshape(vector.shape)
    return np.linalg.solve(M, vector)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


def work_of(law: Any, delta: float) -> float:
    """∫F dδ, J, up to an indentation at rest; 0 in flight."""
    return 0.0 if delta <= 0.0 else 0.5 * delta * float(_WEIGHTS @ law.force(0.5 * delta * (1.0 + _NODES), 0.0, 1.0))


def is_dissipative(law: Any) -> bool:
    """Whether a law pushes at rest, and its damping acts against the motion."""
    deepest = 2.0 * _depth(law, 1.0, EXPECTED_SPEED)
    delta, rate = np.meshgrid(deepest * np.geomspace(1e-6, 1.0, 13), np.linspace(-2.0, 2.0, 9))
    slow = law.force(delta, 0.0, EXPECTED_SPEED)
    with np.errstate(all="ignore"):  # a force that overflows does not pass the comparison
        damping = law.force(delta, rate, EXPECTED_SPEED) - slow
        return bool(np.all(slow >= 0.0) and np.all(damping * rate >= -1e-12 * slow))


def kinks_of(system: System) -> list[int]:
    """Per stop: 1 where the law is cut at zero while δ > 0, plus 2 where it bends at δ̇ = 0."""
    return system.about_laws.get("kinks", lambda: [_kinks(contact.law) for contact in system.contacts])


def _kinks(law: Any) -> int:
    """The same of a law, from samples of its force: a user's law need not declare them."""
    delta = 2.0 * _depth(law, 1.0, EXPECTED_SPEED) * np.geomspace(1e-6, 1.0, 13)
    with np.errstate(all="ignore"):
        cut = (isinstance(law, Rubbing) or not getattr(law, "memory", ())) and any(
            np.any(law.force(delta, rate, EXPECTED_SPEED) == 0.0) for rate in (-1e3, -1.0, 1.0)
        )
        leaving, rest, entering = (law.force(delta, rate, EXPECTED_SPEED) for rate in (-1e-4, 0.0, 1e-4))
        bent = np.abs(leaving - 2.0 * rest + entering) > 1e-2 * np.abs(entering - leaving) + 1e-13 * np.abs(rest)
    return int(cut) + 2 * int(np.any(bent))


def _depth(law: Any, mass: float, speed: float) -> float:
    """Indentation, m, at which a stop has taken the kinetic energy of a mass at this speed."""
    low, high = -15.0, 3.0  # powers of ten, m
    while high - low > 1e-6:
        powers = np.linspace(low, high, 65)
        delta = 10.0 ** powers[:, None]
        works = 0.5 * delta[:, 0] * (law.force(0.5 * delta * (1.0 + _NODES), 0.0, 1.0) @ _WEIGHTS)
        enough = np.append(works >= 0.5 * mass * speed**2, True)
        at = min(max(int(enough.argmax()), 1), 64)
        low, high = powers[at - 1], powers[at]
    return float(10.0**low)
