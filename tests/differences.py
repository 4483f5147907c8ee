"""Derivatives by differences of runs, independent of the linearised integrator."""

import numpy as np

from solvers import Exponential, integrate


def central(function, step):
    """Derivative at 0, of second order."""
    return (np.asarray(function(step)) - function(-step)) / (2.0 * step)


def five_points(function, step):
    """Derivative at 0, of fourth order."""
    a, b, c, d = (np.asarray(function(k * step)) for k in (-2, -1, 1, 2))
    return (8.0 * (c - b) - (d - a)) / (12.0 * step)


def jacobian(function, x, steps, formula=five_points):
    """(m, n) derivative by x (n,), whose coordinates have steps of their own or one in common."""
    moves = zip(np.eye(len(x)), np.broadcast_to(steps, len(x)), strict=True)
    return np.transpose([formula(lambda h, unit=unit: function(x + h * unit), step) for unit, step in moves])


def end_of(system, duration, method=None, **options):
    """The state [q, q̇] a run ends in, a function of the one it begins in."""
    method = Exponential(1e-12) if method is None else method
    return lambda x: integrate(system, *np.split(np.asarray(x), 2), duration, method=method, **options).end[: len(x)]
