"""The first contact within a short flight: the root of a Taylor polynomial, exact to rounding there."""

from __future__ import annotations

import math

import numpy as np

from solvers.compiled.kernels import dot, inlined, inner, is_circle, row_of, surface_tolerance
from solvers.compiled.state import rate_tolerance
from solvers.exponential.circles.flight import radial_polynomial
from solvers.exponential.flight import ORDER


@inlined
def _polynomial(problem, s, terms, values):
    """Coefficients of δ in powers of time."""
    row, factorial = row_of(problem, s), 1.0
    for i in range(ORDER + 1):
        values[i] = dot(problem.read[row], terms[i], 2 * problem.k.size) / factorial
        factorial *= i + 1.0
    values[0] -= problem.gap[row]
    values[1] = dot(problem.read_rate[row], terms[0], 2 * problem.k.size)  # loads of coupled blocks leave rounding


@inner
def first_root(problem, terms, s, x, longest, values, slopes):
    """First time in [0, longest] at which δ becomes positive on the Taylor polynomial, or -1.

    ``values`` and ``slopes`` are scratch for the coefficients of the polynomial and of its derivative.
    """
    if is_circle(problem, s):
        radial_polynomial(problem, s, terms, values)
    else:
        _polynomial(problem, s, terms, values)
    if abs(values[0]) <= surface_tolerance(problem, s, x):
        values[0] = 0.0
        if abs(values[1]) <= rate_tolerance(problem, s, x):
            values[1] = 0.0  # at rest on the surface: the acceleration decides
    if values[0] >= 0.0 and (values[1] > 0.0 or (values[1] == 0.0 and values[2] > 0.0)):
        return 0.0
    end = longest
    if values[1] > 0.0 and _horner(values, longest)[1] < 0.0:  # δ has its maximum inside
        for i in range(ORDER):
            slopes[i] = (i + 1.0) * values[i + 1]
        slopes[ORDER] = 0.0
        end = _first_sign_change(slopes, -1.0, longest, -0.5 * values[1] / values[2])
    if not _horner(values, end)[0] > 0.0:
        return -1.0
    square = values[1] * values[1] - 4.0 * values[0] * values[2]
    return _first_sign_change(values, 1.0, end, -2.0 * values[0] / (values[1] + math.sqrt(max(square, 0.0))))


@inlined
def _horner(coefficients, x):
    """Value and slope of a polynomial at x."""
    value, slope = coefficients[ORDER], 0.0
    for i in range(ORDER - 1, -1, -1):
        slope = slope * x + value
        value = value * x + coefficients[i]
    return value, slope


@inner
def _first_sign_change(coefficients, sign, b, guess):
    """Sign change of a polynomial in [0, b], to rounding, by Newton's method safeguarded by bisection.

    Newton's method doubles the digits, so after a step of 1e-11 the error is rounding. A double root is found to 1e-8
    at best.
    """
    a, x = 0.0, guess if 0.0 < guess < b else b
    for _ in range(60):
        f, slope = _horner(coefficients, x)
        if sign * f > 0.0:
            b = x
        else:
            a = x
        next_x = x - (f / slope if slope != 0.0 else np.inf)
        if not a <= next_x <= b:
            next_x = 0.5 * (a + b)
        if abs(next_x - x) <= 1e-11 * x:
            return next_x
        x = next_x
    return x
