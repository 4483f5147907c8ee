"""Compiled sliders in parallel beside a spring: force, borders, renewal and their derivatives.

Parameters (N, k_0, then per slider: k, f, f_s, c, code, s). A slider whose code is 0 sticks, F = k (d - s) + c v, until
|F| = f_s; one with code ±1 slips at ±f until v = 0 and sticks from there on with s = d ∓ f/k.
"""

import math

from numba import cfunc, njit

from contacts.kernels import GRADIENT, SIGNATURE, compiled
from contacts.sum_kernels import RENEW, RENEW_GRADIENT

SLIDER_SIZE = 6
STIFFNESS, LIMIT, STATIC, DAMPING, CODE, SLIDER = range(SLIDER_SIZE)
STICK, SLIP = range(2)  # events


@compiled(njit)
def _sticking(parameters, at, d, v):
    """Force of a slider that sticks."""
    return parameters[at + STIFFNESS] * (d - parameters[at + SLIDER]) + parameters[at + DAMPING] * v


@compiled(cfunc, SIGNATURE)
def sliders(n, delta, delta_dot, entry_rate, parameters, force):
    """F = k_0 d + sum over the sliders."""
    for i in range(n):
        force[i] = parameters[1] * delta[i]
    for j in range(int(parameters[0])):
        at = 2 + SLIDER_SIZE * j
        code = parameters[at + CODE]
        for i in range(n):
            slip = code * parameters[at + LIMIT]
            force[i] += slip if code != 0.0 else _sticking(parameters, at, delta[i], delta_dot[i])


@compiled(cfunc, GRADIENT)
def sliders_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `sliders`: those of the sliders that stick."""
    k, c = parameters[1], 0.0
    for j in range(int(parameters[0])):
        at = 2 + SLIDER_SIZE * j
        if parameters[at + CODE] == 0.0:
            k += parameters[at + STIFFNESS]
            c += parameters[at + DAMPING]
    for i in range(n):
        by_delta[i], by_rate[i], by_entry[i] = k, c, 0.0


@compiled(cfunc, SIGNATURE)
def sliders_borders(n, delta, delta_dot, entry_rate, parameters, values):
    """One per slider: what is left to its limit, or the rate in the direction of its slip."""
    for j in range(int(parameters[0])):
        at = 2 + SLIDER_SIZE * j
        code = parameters[at + CODE]
        for i in range(n):
            left = parameters[at + STATIC] - abs(_sticking(parameters, at, delta[i], delta_dot[i]))
            values[j * n + i] = code * delta_dot[i] if code != 0.0 else left


@compiled(cfunc, RENEW)
def sliders_renew(j, delta, delta_dot, entry_rate, parameters):
    """Begin the slip of slider j, or let it stick where it is."""
    at = 2 + SLIDER_SIZE * j
    code = parameters[at + CODE]
    if code == 0.0:
        parameters[at + CODE] = math.copysign(1.0, _sticking(parameters, at, delta, delta_dot))
        return SLIP
    parameters[at + SLIDER] = delta - code * parameters[at + LIMIT] / parameters[at + STIFFNESS]
    parameters[at + CODE] = 0.0
    return STICK


@compiled(cfunc, SIGNATURE)
def sliders_memory_gradient(n, delta, delta_dot, entry_rate, parameters, by_memory):
    """Derivatives of `sliders` by code (none) and place of every slider."""
    for j in range(int(parameters[0])):
        at = 2 + SLIDER_SIZE * j
        for i in range(n):
            by_memory[2 * j * n + i] = 0.0
            by_memory[(2 * j + 1) * n + i] = -parameters[at + STIFFNESS] if parameters[at + CODE] == 0.0 else 0.0


@compiled(cfunc, RENEW_GRADIENT)
def sliders_renew_gradient(j, delta, delta_dot, entry_rate, parameters, out):
    """A slider that begins to stick follows d; all others stay where they are."""
    count = int(parameters[0])
    width = 2 + 2 * count
    for i in range(2 * count * width):
        out[i] = 0.0
    for p in range(count):
        row = (2 * p + 1) * width
        held = p == j and parameters[2 + SLIDER_SIZE * p + CODE] != 0.0
        out[row if held else row + 2 * p + 3] = 1.0
