"""Forces of one element along a known motion of its rows, and their changes.

    y = -rows·q - offsets,    f = N a + F_t b,    a = ∂δ/∂y,  b = ∂ξ/∂y

    F_t = k_t (ξ - s) in stick, ±μN in slip

A stop on a line has one row, y = δ, and f = N. The rows of an oblique stop are δ and -ξ; those of a circular clearance
-d and, where the place turns, -|R| φ:

    δ = ±(|d| - c),    ξ = c θ + R (φ + Ω t)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.problem import Array
from solvers.problem import event_list as at
from solvers.problem.friction import CODE, CUT, FREE, MU, PRESSES, SLIDER, STICK, STIFFNESS
from solvers.sensitivities import laws

STUCK = 0.0  # code of the event at which stick begins
_CENTRE = 1e-12  # least |d| in units of the clearance: at the centre, where no force acts, slopes have no direction


@dataclass(frozen=True, eq=False)
class ElementMotion:
    """δ, δ̇, ξ, ξ̇ (k,) of an element at times (k,), their slopes (m, k) and curvatures (m, m, k) by its m rows.

    ``delta_slopes`` are ∂δ/∂y = ∂δ̇/∂ẏ, ``rate_slopes`` ∂δ̇/∂y, ``xi_slopes`` ∂ξ/∂y; ``angle`` is θ, rad, of a circular
    clearance with friction.
    """

    delta: Array
    rate: Array
    delta_slopes: Array
    delta_curvature: Array
    rate_slopes: Array
    xi: Array
    xi_rate: Array
    xi_slopes: Array
    xi_curvature: Array
    angle: Array


def motion_of(contact: Any, q: Array, q_dot: Array, t: Any = 0.0) -> ElementMotion:
    """The motion of an element at coordinates (n, k)."""
    y, y_dot = -contact.rows @ q - contact.row_gaps[:, None], -contact.rows @ q_dot  # of its rows
    m, k = y.shape
    none, slopes, bends = np.zeros(k), np.zeros((m, k)), np.zeros((m, m, k))
    if contact.map != "annulus":
        delta_slopes, xi_slopes = slopes + np.eye(2, m)[0][:, None], slopes - np.eye(2, m)[1][:, None]
        xi, xi_rate = (none, none) if m == 1 else (-y[1], -y_dot[1])
        return ElementMotion(y[0], y_dot[0], delta_slopes, bends, slopes, xi, xi_rate, xi_slopes, bends, none)
    sign, c = math.copysign(1.0, contact.circle), contact.gap
    r = np.maximum(np.hypot(y[0], y[1]), _CENTRE * c)
    e, across = y[:2] / r, np.stack((-y[1], y[0])) / r
    delta_slopes, delta_curvature, xi_slopes, xi_curvature = slopes.copy(), bends.copy(), slopes.copy(), bends.copy()
    delta_slopes[:2], delta_curvature[:2, :2] = sign * e, sign / r * (across[:, None] * across)
    rate_slopes = np.einsum("abk,bk->ak", delta_curvature, y_dot)
    known = sign * r - contact.circle, (delta_slopes * y_dot).sum(axis=0), delta_slopes, delta_curvature, rate_slopes
    if contact.friction is None:
        return ElementMotion(*known, none, none, xi_slopes, xi_curvature, none)
    xi_slopes[:2], xi_curvature[:2, :2] = c / r * across, -c / r**2 * (e[:, None] * across + across[:, None] * e)
    xi_slopes[2:] = -math.copysign(1.0, contact.law.arm)
    angle, surface = np.arctan2(y[1], y[0]), contact.surface
    xi = c * angle + (xi_slopes[2:] * y[2:]).sum(axis=0) + surface * t
    return ElementMotion(*known, xi, (xi_slopes * y_dot).sum(axis=0) + surface, xi_slopes, xi_curvature, angle)


def acceleration_of(motion: ElementMotion, y_dot: Array, y_twice: Array) -> Array:
    """δ̈ (k,) from ẏ and ÿ (m, k)."""
    return (motion.delta_slopes * y_twice + motion.rate_slopes * y_dot).sum(axis=0)


@dataclass(frozen=True, eq=False)
class Slider:
    """The numbers of an element's friction: μ, k_t, R and Ω, code of the segment and place of the slider."""

    contact: Any
    numbers: Array

    @classmethod
    def of(cls, contact: Any, row: Array) -> Slider | None:
        """The slider in an element's parameters; None without friction."""
        return None if contact.friction is None else cls(contact, row[contact.law.place :])

    @property
    def sticks(self) -> bool:
        """Whether it sticks."""
        return bool(self.numbers[CODE] == STICK)

    @property
    def free(self) -> bool:
        """Whether it follows without force, as N <= 0."""
        return bool(self.numbers[CODE] == FREE)

    def uncut(self, row: Array) -> Array:
        """Parameters of the law without a cut at N = 0."""
        place, row = int(self.numbers[CUT]), row.copy()
        if place >= 0:
            row[place] = 0.0
        return row

    def friction_by_normal(self, normal: Array) -> Array:
        """∂F_t/∂N (k,): ±μ in slip, else 0."""
        return np.where(normal > 0.0, self._side * self.numbers[MU], 0.0)

    def friction_by_mu(self, normal: Array) -> Array:
        """∂F_t/∂μ (k,): ±N in slip, also of μ = 0, else 0."""
        return self._side * np.maximum(normal, 0.0)

    @property
    def _side(self) -> float:
        """The way of slip, 0 in stick and where the slider is free."""
        return 0.0 if self.free else float(self.numbers[CODE])

    def stretch(self, xi: Array) -> Array:
        """ξ - s (k,), in a circle to the nearest turn."""
        left, turn = xi - self.numbers[SLIDER], 2.0 * math.pi * abs(self.contact.circle)
        return left - turn * np.round(left / turn) if turn else left

    def force(self, xi: Array, normal: Array) -> Array:
        """F_t (k,)."""
        return self.numbers[STIFFNESS] * self.stretch(xi) if self.sticks else self.friction_by_normal(normal) * normal

    def begun(self, motion: ElementMotion, row: Array, entry_rate: float) -> Array:
        """Parameters after a run has begun in contact: stick, or free where the law pulls."""
        law = self.contact.law
        if law.borders > PRESSES and laws.force(law, row, (motion.delta, motion.rate), entry_rate)[0] <= 0.0:
            return self._latched(row, FREE, 0.0)
        return self.entered(motion, row, STICK if self.numbers[MU] else math.copysign(1.0, float(motion.xi_rate[0])))

    def entered(self, motion: ElementMotion, row: Array, code: float) -> Array:
        """Parameters after an entry that began a segment of this code."""
        return self._latched(row, code, float(motion.xi[0]))

    def renewed(self, row: Array, event: Array) -> Array:
        """Parameters after an event of the slider: stick or slip ends, N falls to zero, or N begins to grow again."""
        xi, xi_rate, force = (float(number) for number in event[at.DELTA : at.FORCE + 1])
        if event[at.GUARD] == PRESSES:
            return self._latched(row, FREE, 0.0)
        if event[at.CODE] == STUCK:
            return self._latched(row, STICK, xi - force / self.numbers[STIFFNESS])
        if self.free:
            return self._latched(row, math.copysign(1.0, xi_rate), xi)
        if self.numbers[MU] == 0.0 and not self.sticks:
            return self._latched(row, -self.numbers[CODE], self.numbers[SLIDER])
        return self._latched(row, math.copysign(1.0, force), self.numbers[SLIDER])

    def _latched(self, row: Array, code: float, place: float) -> Array:
        """Parameters with other latched numbers: code of the segment and place of the slider."""
        row = row.copy()
        row[self.contact.memory] = code, place
        return row


@dataclass(frozen=True, eq=False)
class Linear:
    """Changes of an element's forces at times (k,).

    df = slopes[0] dy + slopes[1] dẏ + other, (2, m, m, k) and (m, k, columns); dN likewise by ``normal`` (2, m, k) and
    ``normal_other`` (k, columns).
    """

    slopes: Array
    other: Array
    normal: Array
    normal_other: Array


def forces_of(motion: ElementMotion, slider: Slider | None, normal: Array) -> Array:
    """Forces (m, k) on the rows under N (k,)."""
    if slider is None:
        return normal * motion.delta_slopes
    return normal * motion.delta_slopes + slider.force(motion.xi, normal) * motion.xi_slopes


def linear(motion: ElementMotion, slider: Slider | None, normal: Array, slopes: Array, by_law: Array) -> Linear:
    """Changes of the forces by the motion, with N_δ and N_δ̇ (2, k), and by other changes of N (k, columns)."""
    a, b = motion.delta_slopes, motion.xi_slopes
    by_normal = np.stack((slopes[0] * a + slopes[1] * motion.rate_slopes, slopes[1] * a))
    along, found = a, np.stack((normal * motion.delta_curvature, np.zeros_like(motion.delta_curvature)))
    if slider is not None:
        along = a + slider.friction_by_normal(normal) * b
        found[0] += slider.force(motion.xi, normal) * motion.xi_curvature
        if slider.sticks:
            found[0] += slider.numbers[STIFFNESS] * b[:, None] * b
    found += along[None, :, None] * by_normal[:, None]
    return Linear(found, along[..., None] * by_law, by_normal, by_law)
