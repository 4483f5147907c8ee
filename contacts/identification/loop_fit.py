"""Least squares over all records, in units of half their ranges, and intervals of what it finds."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contacts.identification.loop_models import Loop, Model, Sliders
from contacts.identification.loop_remarks import remarks_on
from contacts.identification.loop_result import IdentifiedLoop, MeasuredLoop
from contacts.identification.records import Vector, records_of
from contacts.identification.result import Estimate, inflation_of

ROUNDING = 1e-10
"""Share of the force's half range below which nothing is left to explain."""
_TIGHT: dict[str, Any] = {"ftol": 1e-13, "xtol": 1e-13, "gtol": 1e-13}  # not met by every rounding: `most` ends it too


class Measured:
    """The records in units of half the range of displacement and force."""

    def __init__(self, delta: Any, force: Any, offset: bool) -> None:
        self.delta, self.force = records_of("delta", delta), records_of("force", force)
        if len(self.delta) != len(self.force):
            raise ValueError(f"force must have as many records as delta, {len(self.delta)}, got {len(self.force)}")
        for number, (d, f) in enumerate(zip(self.delta, self.force, strict=True), 1):
            if len(d) != len(f) or len(d) < 2:
                raise ValueError(
                    f"record {number} has {len(d)} samples of delta and {len(f)} of force; give two or more of each"
                )
            if np.ptp(d) == 0.0:
                raise ValueError(f"delta of record {number} does not move from {d[0]:g} m; leave the record out")
        together = [np.concatenate(x) for x in (self.delta, self.force)]
        self.depth, self.strength = (0.5 * float(np.ptp(x)) for x in together)
        if not self.strength > 0.0:
            raise ValueError(f"force is {together[1][0]:g} N in all records; there is no loop")
        self.loops = [Loop(d / self.depth, f / self.strength) for d, f in zip(self.delta, self.force, strict=True)]
        self.offset, self.count = offset, together[0].size
        self.target = np.concatenate([loop.force for loop in self.loops])


class Fit:
    """Least squares in θ = (parameters of the model, [F₀,] memory at the start of every record)."""

    def __init__(self, measured: Measured, model: Model, start: Vector, most: int = 100) -> None:
        from scipy.optimize import least_squares

        self.measured, self.model = measured, model
        if measured.count < len(start) + 4:
            raise ValueError(
                f"the records have {measured.count} samples, at least {len(start) + 4} are needed for the {len(start)} "
                "numbers to be found, memory at the start of each record included"
            )
        low, high = (
            np.append(ends, np.full(len(start) - model.main, sign * np.inf))
            for sign, ends in zip((-1, 1), model.ends, strict=True)
        )
        within = np.clip(start, low, high)  # of records of very different ranges starts may lie beyond
        done = least_squares(self.residual, within, self.jacobian, (low, high), x_scale="jac", max_nfev=most, **_TIGHT)
        self.theta, self.slopes = done.x, done.jac
        self.squares = 2.0 * float(done.cost)
        self.exact = math.sqrt(self.squares / measured.count) < ROUNDING

    def residual(self, theta: Vector) -> Vector:
        """Law minus force; large where the law has none."""
        model, at = self.model, self.model.main + self.measured.offset
        states = theta[at:].reshape(-1, model.states)
        pairs = zip(states, self.measured.loops, strict=True)
        forces = np.concatenate([model.force(theta[: model.main], state, loop) for state, loop in pairs])
        zero = theta[model.main] if self.measured.offset else 0.0
        return np.nan_to_num(forces + zero - self.measured.target, nan=1e3, posinf=1e3, neginf=-1e3)

    def jacobian(self, theta: Vector) -> NDArray[np.float64]:
        """Its derivatives by θ."""
        model, at, row = self.model, self.model.main + self.measured.offset, 0
        out = np.zeros((self.measured.count, theta.size))
        out[:, model.main : at] = 1.0
        for i, loop in enumerate(self.measured.loops):
            own, rows = slice(at + i * model.states, at + (i + 1) * model.states), slice(row, row + loop.x.size)
            slopes = np.nan_to_num(model.slopes(theta[: model.main], theta[own], loop), posinf=0.0, neginf=0.0)
            out[rows, : model.main], out[rows, own] = np.split(slopes, [model.main], axis=1)
            row = rows.stop
        return out

    def covariance(self) -> tuple[NDArray[np.float64], float, float]:
        """(of what is reported: the parameters in SI and F₀; noise; correlation of neighbouring residuals)."""
        left, ends = self.residual(self.theta), np.cumsum([loop.x.size for loop in self.measured.loops])
        freedom = left.size - self.theta.size
        neighbours = left[1:] * left[:-1]
        neighbours[ends[:-1] - 1] = 0.0
        correlation = float(neighbours.sum() / self.squares) if self.squares > 0.0 else 0.0
        variance = self.squares / freedom * inflation_of(correlation, freedom)
        sizes = np.linalg.norm(self.slopes, axis=0)
        sizes[sizes == 0.0] = 1.0
        _, values, rows = np.linalg.svd(self.slopes / sizes, full_matrices=False)
        spread = (rows / np.maximum(values, 1e-12)[:, None] / sizes).T  # what no sample sees has a huge variance
        reported = self._reported_slopes() @ spread
        return variance * reported @ reported.T, math.sqrt(self.squares / freedom), correlation

    def _reported(self, theta: Vector) -> Vector:
        """Parameters in SI, and F₀."""
        m = self.measured
        values = self.model.values(theta[: self.model.main], m.depth, m.strength)
        zero = m.strength * theta[self.model.main] if m.offset else 0.0
        return np.array([*values.values(), zero])

    def _reported_slopes(self) -> NDArray[np.float64]:
        """Their derivatives by θ."""
        steps = 1e-6 * np.eye(self.theta.size)
        return np.transpose([self._reported(self.theta + h) - self._reported(self.theta - h) for h in steps]) / 2e-6

    def _one_way(self, margin: float) -> list[tuple[int, int]]:
        """(slider, direction) of those that may as well slip in this direction only: with no more squares left.

        Then the limit has no upper end, as the zero of force moves with it. The slope of the squares does not tell:
        the least are often where slip in the other direction just begins, by noise.
        """
        model, most = self.model, self.squares + max(margin, self.measured.count * ROUNDING**2)
        if not isinstance(model, Sliders) or not self.measured.offset:
            return []
        tried = [(j, side) for j in range(model.count) for side in (-1, 1)]
        return [
            one for one in tried if Fit(self.measured, replace(model, wide=one[0]), self._widened(*one)).squares <= most
        ]

    def _widened(self, slider: int, side: int) -> Vector:
        """θ with a slider that cannot slip both ways, and the same forces while it slips towards one side."""
        model, theta = self.model, self.theta.copy()
        theta[model.states + slider] = 0.5
        before, after = np.exp([x[model.states + slider] for x in (self.theta, theta)])
        theta[model.main] -= side * math.exp(theta[slider]) * (after - before)
        states = theta[model.main + 1 + slider :: model.states]  # a view: of this slider, in all records
        states[:] = np.arcsin(np.clip((before * np.sin(states) + side * (after - before)) / after, -0.999, 0.999))
        return theta

    def _place_of_limit(self, slider: int) -> int:
        """Where the limit of a slider stands among what is reported: after all stiffnesses, in the order of slip."""
        widths = self.theta[self.model.states : 2 * self.model.states]
        return self.model.states + int(np.count_nonzero(widths < widths[slider]))

    def result(self, confidence: float) -> IdentifiedLoop:
        """Everything in SI with intervals."""
        from scipy.stats import t as student

        m, model, freedom = self.measured, self.model, self.measured.count - self.theta.size
        covariance, noise, correlation = self.covariance()
        values, errors = self._reported(self.theta), np.sqrt(np.diag(covariance))
        quantile = float(student.ppf(0.5 + 0.5 * confidence, freedom))
        low, high = values - quantile * errors, values + quantile * errors
        named = model.values(self.theta[: model.main], m.depth, m.strength)
        for slider, side in self._one_way(quantile**2 * noise**2 * inflation_of(correlation, freedom)):
            high[self._place_of_limit(slider)] = math.inf
            (low if side > 0 else high)[-1] = -side * math.inf
        found = [Estimate(*map(float, ends)) for ends in zip(values, low, high, strict=True)]
        estimates = dict(zip(named, found[:-1], strict=True))
        scaled = np.where(errors > 0.0, errors, 1.0)
        correlations = (covariance / np.outer(scaled, scaled))[:-1, :-1]
        remarks = remarks_on(m.loops, estimates, correlations, correlation, noise)
        for remark in remarks:
            warnings.warn(remark, stacklevel=3)
        borders = np.cumsum([d.size for d in m.delta])[:-1]
        fitted = np.split(m.strength * (self.residual(self.theta) + m.target), borders)
        law = model.law({name: float(x) for name, x in named.items()})
        return IdentifiedLoop(
            *(law, estimates, found[-1], noise * m.strength, correlations),
            tuple(MeasuredLoop(*rows) for rows in zip(m.delta, m.force, fitted, strict=True)),
            *(remarks, confidence),
        )
