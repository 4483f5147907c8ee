"""Backbone of the lowest mode: how fast it vibrates freely against its stops, over the amplitude.

    ½ q'² + V(q) = E,   V(q) = ½ ω² q² + Σ_s ∫ F_s dδ_s,   δ_s = -w_s q - gap_s,   2π/Ω = 2 ∫ dq/√(2 (E - V))

from one turning point to the other. The elastic part of the laws (δ' = 0) counts; other modes and damping do not.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from fembeam.model import Model

Vector = NDArray[np.float64]
GAUSS = np.polynomial.legendre.leggauss(48)  # on each piece between the places where stops are met
_HALVINGS = 55  # to a turning point known to rounding


def backbone(model: Model, z: float, amplitudes: Vector) -> Vector:
    """Ω (k,) in rad/s at which the lowest mode vibrates freely with max |u(z)| of so many m (k,), > 0.

    NaN where this does not hold: gravity or preload, bodies that touch each other, annular stops, friction, a mode at
    rest at z, forces that attract, laws with memory. Errors below 1e-6; where other modes take part the
    backbone of the structure lies beside.

    References
    ----------
    A.H. Nayfeh, D.T. Mook, Nonlinear Oscillations (1979), section 2.3.
    """
    shape = float(model.phi(z)[0])
    apart = all(row.on[0] == "frame" and row.body == 0 and not row.remembers for row in model.contact_rows)
    apart = apart and not any(row.is_circle or row.friction for row in model.contact_rows)
    loaded = any(row.force(-row.gap) != 0.0 for row in model.contact_rows)
    if model.scene.gravity != 0.0 or loaded or not apart or model.omega[0] == 0.0 or shape == 0.0:
        return np.full(len(amplitudes), np.nan)
    furthest = np.asarray(amplitudes, dtype=float) / abs(shape)
    far, energy, near = _turning_points(model, furthest)
    ends = zip(np.minimum(far, near), np.maximum(far, near), energy, strict=True)
    return np.array([_frequency(model, *points) for points in ends])


def _turning_points(model: Model, furthest: Vector) -> tuple[Vector, Vector, Vector]:
    """The turning points so far (k,) from 0, V there, and those on the other side, where stops are met earlier."""
    energies = np.array([_potential(model, -furthest), _potential(model, furthest)])
    energy = energies.min(axis=0)
    far = np.where(energies[0] <= energies[1], -furthest, furthest)
    inside, near = np.zeros_like(far), -far
    even = np.abs(energies[0] - energies[1]) <= 1e-13 * energy
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + near)
        beyond = _potential(model, middle) > energy
        inside, near = np.where(beyond, inside, middle), np.where(beyond, middle, near)
    return far, energy, np.where(even, -far, near)


def _frequency(model: Model, low: float, high: float, energy: float) -> float:
    """Ω of the vibration between two turning points, with V there."""
    rows = zip(model.directions[:, 0], model.contact_rows, strict=True)
    met = [-(row.gap + place) / w for w, row in rows if w != 0.0 for place in (0.0, *row.law.knots)]
    knots = np.unique([low, *(q for q in met if low < q < high), high])
    angle, weight = GAUSS
    angle, weight = 0.5 * np.pi * (1.0 + angle), 0.5 * np.pi * weight
    half = 0.5 * np.diff(knots)[:, None]
    q = knots[:-1, None] + half * (1.0 - np.cos(angle))  # takes the roots at turning points away
    left = energy - _potential(model, q.ravel()).reshape(q.shape)
    if not np.all(left > 0.0):
        return np.nan
    return float(np.pi / np.sum(weight * half * np.sin(angle) / np.sqrt(2.0 * left)))


def _potential(model: Model, q: Vector) -> Vector:
    """V (k,) of the lowest mode."""
    energy = 0.5 * model.omega[0] ** 2 * q**2
    for w, row in zip(model.directions[:, 0], model.contact_rows, strict=True):
        delta = -w * q - row.gap
        delta = delta if row.always else np.maximum(delta, 0.0)
        energy += _stored(row, delta)
    return np.asarray(energy)


def _stored(row: Any, delta: Vector) -> Vector:
    """∫F dδ (k,) from 0, knot by knot of the law."""
    at, weight = 0.5 * (1.0 + GAUSS[0]), 0.5 * GAUSS[1]
    total = np.zeros_like(delta)
    for low, high in pairwise((0.0, *row.law.knots, np.inf)):
        span = np.minimum(delta, high) - low
        span = np.maximum(span, 0.0) if low > 0.0 else span
        total += span * (row.force(low + span[:, None] * at) @ weight)
    return total
