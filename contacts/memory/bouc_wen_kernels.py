"""Compiled Bouc–Wen hysteresis, in closed form between reversals.

F = k_e d + k_z z. While v keeps its sign σ, w = σ z is a function of y = σ (d - d_r) alone,

    dw/dy = A - c |w|^n,        c = γ + β sgn(w),        w(0) = σ z_r:

exponentials for n = 1, tanh, tan or a line for n = 2; at w = 0 one piece ends and the other begins.
Parameters (k_e, k_z, A, β, γ, n, σ, d_r, z_r); σ = 0 until the first reversal, and then that of d - d_r.
"""

import math

from numba import cfunc, njit

from contacts.kernels import GRADIENT, SIGNATURE, compiled
from contacts.sum_kernels import RENEW, RENEW_GRADIENT


@compiled(njit)
def _sign(parameters, d, v):
    """The direction of this segment."""
    if parameters[6] != 0.0:
        return parameters[6]
    moved = d - parameters[7]
    return math.copysign(1.0, moved if moved != 0.0 else v)


@compiled(njit)
def _linear(w, y, A, k):
    """Solution w(y) and dw(y)/dw(0) of w' = A - k w."""
    decay = math.exp(-k * y)
    return w * decay + A * (-math.expm1(-k * y) / k if k != 0.0 else y), decay


@compiled(njit)
def _quadratic(w, y, A, c):
    """`_linear` for w' = A - c w², as (w + A T)/(1 + c w T) with T' = 1 - A c T²; NaN beyond a pole."""
    root = math.sqrt(A * abs(c))
    if c > 0.0:
        T = math.tanh(root * y) / root
    elif c < 0.0:
        T = math.tan(root * y) / root if root * abs(y) < 0.5 * math.pi else math.nan
    else:
        T = y
    below = 1.0 + c * w * T
    if not below > 0.0:
        return math.nan, math.nan
    return (w + A * T) / below, (1.0 - A * c * T * T) / (below * below)


@compiled(njit)
def _zero(w, A, c, n):
    """Where w < 0 comes to zero under w' = A - c |w|^n; infinite where it saturates before."""
    if c == 0.0:
        return -w / A
    if n == 1.0:
        left = c * w / A
        return -math.log1p(left) / c if left > -1.0 else math.inf
    root = math.sqrt(abs(c) / A)
    part = -w * root
    if c < 0.0:
        return math.atan(part) / (root * A)
    return math.atanh(part) / (root * A) if part < 1.0 else math.inf


@compiled(njit)
def _slope(w, A, low, high, n):
    """A - c |w|^n, that is dw/dy."""
    return A - (low if w < 0.0 else high) * (abs(w) if n == 1.0 else w * w)


@compiled(njit)
def _response(parameters, d, v):
    """Hysteretic displacement z, dz/dd and dz/dz_r."""
    A, beta, gamma, n = parameters[2], parameters[3], parameters[4], parameters[5]
    sign = _sign(parameters, d, v)
    start, y, low, high = sign * parameters[8], sign * (d - parameters[7]), gamma - beta, gamma + beta
    w, by_start = start, 1.0
    zero = _zero(start, A, low, n) if start < 0.0 else 0.0
    if start < 0.0 and y < zero:
        w, by_start = _linear(start, y, A, -low) if n == 1.0 else _quadratic(start, y, A, low)
    elif start < 0.0:
        w = (_linear(0.0, y - zero, A, high) if n == 1.0 else _quadratic(0.0, y - zero, A, high))[0]
        by_start = _slope(w, A, low, high, n) / _slope(start, A, low, high, n)
    else:
        w, by_start = _linear(start, y, A, high) if n == 1.0 else _quadratic(start, y, A, high)
    return sign * w, _slope(w, A, low, high, n), by_start


@compiled(cfunc, SIGNATURE)
def bouc_wen(n, delta, delta_dot, entry_rate, parameters, force):
    """F = k_e d + k_z z."""
    for i in range(n):
        force[i] = parameters[0] * delta[i] + parameters[1] * _response(parameters, delta[i], delta_dot[i])[0]


@compiled(cfunc, GRADIENT)
def bouc_wen_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `bouc_wen`."""
    for i in range(n):
        by_delta[i] = parameters[0] + parameters[1] * _response(parameters, delta[i], delta_dot[i])[1]
        by_rate[i], by_entry[i] = 0.0, 0.0


@compiled(cfunc, SIGNATURE)
def bouc_wen_borders(n, delta, delta_dot, entry_rate, parameters, values):
    """The rate in the direction of this segment; the way to z = 0, where the force bends, while that lies ahead."""
    for i in range(n):
        sign = _sign(parameters, delta[i], delta_dot[i])
        values[i] = sign * delta_dot[i]
        ahead = sign * parameters[8] < 0.0
        values[n + i] = -sign * _response(parameters, delta[i], delta_dot[i])[0] if ahead else 1.0


@compiled(cfunc, RENEW)
def bouc_wen_renew(j, delta, delta_dot, entry_rate, parameters):
    """Latch the point of reversal, or that at which z is zero; a start may lie beyond it, and keeps its z."""
    z, sign = _response(parameters, delta, delta_dot)[0], _sign(parameters, delta, delta_dot)
    kept = j == 0 or sign * z > 0.0
    parameters[6], parameters[7], parameters[8] = -sign if j == 0 else sign, delta, z if kept else 0.0
    return j


@compiled(cfunc, SIGNATURE)
def bouc_wen_memory_gradient(n, delta, delta_dot, entry_rate, parameters, by_memory):
    """Derivatives of `bouc_wen` by σ (none), d_r and z_r."""
    for i in range(n):
        _, slope, by_start = _response(parameters, delta[i], delta_dot[i])
        by_memory[i] = 0.0
        by_memory[n + i], by_memory[2 * n + i] = -parameters[1] * slope, parameters[1] * by_start


@compiled(cfunc, RENEW_GRADIENT)
def bouc_wen_renew_gradient(j, delta, delta_dot, entry_rate, parameters, out):
    """Derivatives of the point of reversal by (d, v, σ, d_r, z_r)."""
    for i in range(15):
        out[i] = 0.0
    if j < 0:
        out[8], out[14] = 1.0, 1.0
        return
    out[5] = 1.0
    z, slope, by_start = _response(parameters, delta, delta_dot)
    if j == 0 or _sign(parameters, delta, delta_dot) * z > 0.0:  # z is kept; where it is zero the time of it says so
        out[10], out[13], out[14] = slope, -slope, by_start
