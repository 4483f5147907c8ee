"""A law from measured collisions, by least squares over all of them.

    F = F₀ + K x^p (1 + a δ̇/δ̇⁻),  x = δ - δ₀

with one stiffness K, exponent p, damping factor a and the offsets F₀, δ₀ of the two channels for all collisions, and
the entry rate δ̇⁻ of each. Following van de Wouw et al., Int. J. Non-Linear Mech. 38 (2003) 767, Eqs (4)-(6), which take
K at the largest indentation and a from the loop's area; those two are given beside as a cross-check.
"""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contacts.identification.motion import motion_of
from contacts.identification.records import Samples, Vector, check_pushes, checked_options, collisions_of
from contacts.identification.result import EXACT, Collision, Estimate, Identified, inflation_of
from contacts.numbers import check_number
from contacts.restitution import achieved_restitution

_STEEPEST = 8.0  # exponent, fitted or given
_STIFFEST = 20.0  # logarithm of a stiffness in units of the largest force and indentation: what can be one of a stop
_SETTLED = 1e-13  # relative change that ends least squares, hundreds of roundings; if not met, evaluations are limited
_UNTOLD = "these records do not tell the law. Look at force over indentation; keep the exponent, or offsets=False"
_UNLIKELY = 1e-3  # chance below which collisions that agree would differ so much


def identify(
    delta: Any,
    delta_dot: Any = None,
    force: Any = None,
    *,
    time: Any = None,
    exponent: float | None = 1.5,
    offsets: bool = True,
    confidence: float = 0.95,
) -> Identified:
    """Stiffness, exponent and damping factor of a stop from measured collisions, with confidence intervals.

    Parameters
    ----------
    delta, delta_dot, force : (k,) m, m/s, N of a record with one or several collisions, or lists of such records.
    time : (k,) s instead of ``delta_dot``: indentation and rate are then smoothed by a polynomial per collision, and
        the noise of ``delta`` is part of the intervals. Otherwise only the force and the entry rate count as noisy:
        noise of 5 % in ``delta_dot`` makes the damping factor 1.8 % too small; 86 % of its intervals hold the truth.
    exponent : p from 1 to 8 to keep; None to fit it.
    offsets : fit the zeros of force and indentation too; without, both are taken as exact.
    confidence : of the intervals, in (0, 1).

    Returns
    -------
    Identified : print it; ``.law`` is the law.

    Raises
    ------
    ValueError for arrays that do not fit together, are not finite, are not in SI units (sizes from 1e-30 to 1e30), or
    hold fewer than 8 samples of a collision in contact; for forces that pull on the way in, or do not tell the law.
    Warns where collisions disagree, and widens the intervals by their scatter.

    Notes
    -----
    Intervals are of linear theory with Student's t, widened for a correlation of neighbouring residuals (a filtered
    channel) and for the noise of the smoothed motion. They do not know of a law of another form.

    Examples
    --------
    >>> from contacts import Hysteretic, bounce
    >>> hits = [bounce(Hysteretic(2.1e8, 0.5625), speed, mass=0.03) for speed in (0.2, 0.4)]
    >>> found = identify([h.delta for h in hits], [h.delta_dot for h in hits], [h.force for h in hits])
    >>> round(found.damping_factor.value, 3), round(found.restitution.value, 3)
    (0.563, 0.725)
    """
    p = None if exponent is None else check_number(exponent, "exponent of identify", 1.0, most=_STEEPEST)
    share = checked_options(offsets, confidence)
    fit = _Fit(collisions_of(delta, delta_dot, force, time), p, bool(offsets))
    return fit.result(share)


class _Fit:
    """Least squares in θ = (ln κ, a, [F₀, δ₀,] [p]), with force and indentation in units of their largest values."""

    def __init__(self, measured: list[Samples], exponent: float | None, offsets: bool) -> None:
        self.depth = max(float(one.delta.max()) for one in measured)
        self.strength = max(float(np.abs(one.force).max()) for one in measured)
        for number, one in enumerate(measured, 1):
            check_pushes(one, exponent or 1.5, offsets, number)
        self.measured, self.exponent, self.offsets = measured, exponent, offsets
        self.count = 2 + 2 * offsets + (exponent is None)
        self.theta = np.zeros(self.count)
        if exponent is None:
            self.theta[-1] = 1.5
        self._solve()

    def split(self, theta: Vector) -> tuple[float, float, float, float, float]:
        """(κ, a, F₀, δ₀, p) in units."""
        F0, d0 = (float(theta[2]), float(theta[3])) if self.offsets else (0.0, 0.0)
        p = float(theta[-1]) if self.exponent is None else self.exponent
        return math.exp(theta[0]), float(theta[1]), F0, d0, p

    def _solve(self) -> None:
        """Alternate between the motion (entry rates depend a little on δ₀ and p) and the law."""
        from scipy.optimize import least_squares

        low, high = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        low[0], high[0] = -_STIFFEST, _STIFFEST
        if self.offsets:
            low[3], high[3] = -0.4, 0.4
        if self.exponent is None:
            low[-1], high[-1] = 0.5, _STEEPEST
        for _ in range(4):
            before = self.theta
            _, a, _, d0, p = self.split(self.theta)
            self.motions = [motion_of(one, d0 * self.depth, p, a, fully=False) for one in self.measured]
            done = least_squares(
                lambda x: np.concatenate([self.residual(x, i) for i in range(len(self.measured))]),
                *(self.theta, lambda x: np.vstack([self.jacobian(x, i)[0] for i in range(len(self.measured))])),
                **{"bounds": (low, high), "xtol": _SETTLED, "ftol": _SETTLED, "gtol": _SETTLED, "x_scale": "jac"},
            )
            self.theta = done.x
            if abs(done.x[0]) > 0.99 * _STIFFEST:
                raise ValueError("the force does not follow the indentation: " + _UNTOLD)
            if np.all(np.abs(self.theta - before) < 1e-8):
                break
        _, a, _, d0, p = self.split(self.theta)
        self.motions = [motion_of(one, d0 * self.depth, p, a) for one in self.measured]

    def _parts(self, theta: Vector, i: int) -> tuple[Vector, Vector, Vector]:
        """(x, x^p, δ̇/δ̇⁻) of a collision in units."""
        _, _, _, d0, p = self.split(theta)
        motion = self.motions[i]
        x = np.maximum(motion.delta / self.depth - d0, 0.0)
        return x, x**p, motion.delta_dot / motion.entry_rate

    def residual(self, theta: Vector, i: int) -> Vector:
        """Law minus force."""
        kappa, a, F0, _, _ = self.split(theta)
        _, power, s = self._parts(theta, i)
        return F0 + kappa * power * (1.0 + a * s) - self.measured[i].force / self.strength

    def jacobian(self, theta: Vector, i: int) -> tuple[Vector, Vector]:
        """Derivatives of the law by θ (k, q), and by (δ, δ̇, δ̇⁻) in SI (3, k)."""
        kappa, a, _, _, p = self.split(theta)
        x, power, s = self._parts(theta, i)
        swing, elastic = 1.0 + a * s, kappa * power
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.where(x > 0.0, p * elastic / np.where(x > 0.0, x, 1.0), 0.0) * swing
            by_p = np.where(x > 0.0, elastic * np.log(np.where(x > 0.0, x, 1.0)), 0.0) * swing
        columns = [elastic * swing, elastic * s]
        if self.offsets:
            columns += [np.ones_like(x), -slope]
        if self.exponent is None:
            columns.append(by_p)
        rate = self.motions[i].entry_rate
        return np.column_stack(columns), np.array([slope / self.depth, elastic * a / rate, -elastic * a * s / rate])

    def covariance(self) -> tuple[NDArray[np.float64], float, float, float, int]:
        """(covariance of θ, noise, neighbours' correlation, what it inflates, freedom of the least known collision)."""
        indices = range(len(self.measured))
        residuals = [self.residual(self.theta, i) for i in indices]
        jacobians = [self.jacobian(self.theta, i) for i in indices]
        moved = [m.influence(*by) @ _root(m.covariance) for (_, by), m in zip(jacobians, self.motions, strict=True)]
        freedom = sum(map(len, residuals)) - self.count
        # residuals hold the noise of the force, of each collision its own, and that of the motion, whose share is known
        totals = np.array([float(r @ r) for r in residuals])
        own = np.maximum(totals - [float(np.sum(m * m)) for m in moved], 0.05 * totals)
        neighbours = sum(float(r[1:] @ r[:-1]) for r in residuals) - sum(float(np.sum(m[1:] * m[:-1])) for m in moved)
        correlation = min(max(neighbours / own.sum(), -1.0), 1.0) if own.sum() > 0.0 else 0.0
        inflation = inflation_of(correlation, freedom)
        middle = np.zeros((self.count, self.count))
        for r, (J, _), m, mine in zip(residuals, jacobians, moved, own, strict=True):
            variance = mine / (len(r) - self.count / len(residuals))
            middle += inflation * variance * (J.T @ J) + (J.T @ m) @ (J.T @ m).T
        normal = sum(J.T @ J for J, _ in jacobians)
        fewest = min(min(len(r), m.freedom) for r, m in zip(residuals, self.motions, strict=True))
        try:
            inverse = np.linalg.inv(normal + sum(self._feedback(i, *jacobians[i]) for i in indices))
        except np.linalg.LinAlgError:
            raise ValueError(f"stiffness, damping factor and what else is fitted go together: {_UNTOLD}") from None
        return inverse @ middle @ inverse.T, math.sqrt(own.sum() / freedom), correlation, inflation, fewest

    def _feedback(self, i: int, J: Vector, by_motion: Vector) -> NDArray[np.float64]:
        """(q, q) what the entry rate's dependence on θ adds to the normal matrix."""
        changes = np.empty(self.count)
        for j, step in enumerate(1e-4 * np.eye(self.count)):
            rates = []
            for theta in (self.theta - step, self.theta + step):
                _, a, _, d0, p = self.split(theta)
                rates.append(self.motions[i].entry_rate_at(d0 * self.depth, p, a))
            changes[j] = (rates[1] - rates[0]) / 2e-4
        return np.outer(J.T @ by_motion[2], changes)

    def alone(self, i: int, inflation: float) -> tuple[Vector, Vector]:
        """(ln κ, a) of one collision at the common offsets and exponent, and their standard errors."""
        _, _, F0, _, _ = self.split(self.theta)
        _, power, s = self._parts(self.theta, i)
        target = self.measured[i].force / self.strength - F0
        J = np.column_stack((power, power * s))
        (kappa, product), *_ = np.linalg.lstsq(J, target, rcond=None)
        error = J @ (kappa, product) - target
        variance = inflation * float(error @ error) / max(len(target) - 2, 1)
        inverse = np.linalg.pinv(J.T @ J)
        a = product / kappa
        by = J.T @ self.motions[i].influence(*(self.jacobian(self.theta, i)[1]))
        cov = inverse @ (variance * (J.T @ J) + by @ self.motions[i].covariance @ by.T) @ inverse
        change = np.array([[1.0 / kappa, 0.0], [-a / kappa, 1.0 / kappa]])
        return np.array([math.log(abs(kappa)), a]), np.sqrt(np.maximum(np.diag(change @ cov @ change.T), 0.0))

    def result(self, confidence: float) -> Identified:
        """Everything in SI with intervals."""
        from scipy.stats import t as student

        covariance, noise, correlation, inflation, freedom = self.covariance()
        singles = [self.alone(i, inflation) for i in range(len(self.measured))]
        widening, remarks = self._disagreement(singles)
        if correlation > 0.5 and noise > EXACT:
            remarks.append(
                f"neighbouring residuals are correlated ({correlation:.2f}): the channel is filtered, or the stop does "
                "not follow this law; see the residuals"
            )
        width = float(student.ppf(0.5 + 0.5 * confidence, freedom)) * widening
        kappa, a, F0, d0, p = self.split(self.theta)
        factor = self.strength / self.depth**p
        to_stiffness = np.zeros(self.count)
        to_stiffness[0] = 1.0
        if self.exponent is None:
            to_stiffness[-1] = -math.log(self.depth)
        variance = max(float(to_stiffness @ covariance @ to_stiffness), 0.0)
        spread = math.exp(min(width * math.sqrt(variance), 700.0))
        errors = width * np.sqrt(np.maximum(np.diag(covariance), 0.0))

        def around(value: float, error: float, unit: float = 1.0) -> Estimate:
            return Estimate(unit * value, unit * (value - error), unit * (value + error))

        damping = around(a, errors[1])
        fixed = around(0.0, 0.0)
        for remark in remarks:
            warnings.warn(remark, stacklevel=3)
        peak, loop = self._published(p, F0)
        return Identified(
            stiffness=Estimate(kappa * factor, kappa * factor / spread, kappa * factor * spread),
            exponent=around(p, errors[-1]) if self.exponent is None else around(p, 0.0),
            damping_factor=damping,
            nominal=Estimate(*(_nominal(x) for x in (damping.value, damping.high, damping.low))),
            restitution=Estimate(*(_achieved(x) for x in (damping.value, damping.high, damping.low))),
            force_offset=around(F0, errors[2], self.strength) if self.offsets else fixed,
            indentation_offset=around(d0, errors[3], self.depth) if self.offsets else fixed,
            noise=noise * self.strength,
            loop_stiffness=peak,
            loop_damping_factor=loop,
            collisions=tuple(self._collision(i, singles[i][0], p, F0, d0) for i in range(len(self.measured))),
            remarks=tuple(remarks),
            confidence=confidence,
        )

    def _disagreement(self, singles: list[tuple[Vector, Vector]]) -> tuple[float, list[str]]:
        """Birge's factor by which intervals must grow for collisions that disagree, and what to say of it."""
        from scipy.stats import chi2

        widening, remarks = 1.0, list[str]()
        if len(singles) < 2:
            return widening, remarks
        values, errors = (np.array(x) for x in zip(*singles, strict=True))
        for column, name in enumerate(("stiffness", "damping factor")):
            x, weight = values[:, column], 1.0 / np.maximum(errors[:, column], EXACT) ** 2
            q = float(weight @ (x - (weight @ x) / weight.sum()) ** 2)
            if chi2.sf(q, len(x) - 1) < _UNLIKELY:
                widening = max(widening, math.sqrt(q / (len(x) - 1)))
                scale = np.exp(x - self.theta[0]) if column == 0 else x
                unit = " times the common one" if column == 0 else ""
                remarks.append(
                    f"collisions disagree in {name}, {scale.min():.4g} to {scale.max():.4g}{unit}: the law misses "
                    f"something (rate, wear, alignment); intervals are widened {widening:.1f} times"
                )
        return widening, remarks

    def _published(self, p: float, F0: float) -> tuple[float, float]:
        """K from the forces near the largest indentation, a from the loops' area: Eqs (4) and (5)."""
        top, loops, measure = np.zeros(2), 0.0, 0.0
        for i, one in enumerate(self.measured):
            x, power, s = self._parts(self.theta, i)
            force = (one.force / self.strength - F0) * (x > 0.0)
            slow = np.abs(s) < 0.15
            top += force[slow] @ power[slow], power[slow] @ power[slow]
            loops += float(np.trapezoid(force, x))
            measure += float(np.trapezoid(power * s, x))
        kappa = top[0] / top[1] if top[1] > 0.0 else math.nan
        return kappa * self.strength / self.depth**p, loops / (kappa * measure) if measure else math.nan

    def _collision(self, i: int, single: Vector, p: float, F0: float, d0: float) -> Collision:
        """One collision in SI."""
        motion, force = self.motions[i], self.measured[i].force - F0 * self.strength
        delta = motion.delta - d0 * self.depth
        fitted = force + self.strength * self.residual(self.theta, i)
        return Collision(
            *(delta, motion.delta_dot, force, fitted, motion.entry_rate, motion.exit_rate),
            float(np.trapezoid(force * (delta > 0.0), delta)),
            math.exp(single[0]) * self.strength / self.depth**p,
            float(single[1]),
        )


def _nominal(a: float) -> float:
    """Nominal coefficient of restitution, eq. (6)."""
    return math.sqrt(1.0 - 4.0 * max(a, 0.0) / 3.0) if a <= 0.75 else math.nan


def _achieved(a: float) -> float:
    """Coefficient of restitution of a free mass; a factor below zero, by chance, counts as elastic."""
    return achieved_restitution(max(a, 0.0))


def _root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """R with R Rᵀ the covariance, which rounding may have left with values a little below zero."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0))
