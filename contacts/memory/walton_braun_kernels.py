"""Compiled stop of two slopes that yields: force, borders, renewal and their derivatives.

Parameters (k_1, k_2, kept, code, F_p): open (0), on the first loading F = k_1 d (1), or on the line of unloading and
reloading F = k_2 (d - d_0) (2), which meets the first at F_p and zero at d_0 = F_p (1/k_1 - 1/k_2).
"""

from numba import cfunc, njit

from contacts.kernels import GRADIENT, SIGNATURE, compiled
from contacts.sum_kernels import RENEW, RENEW_GRADIENT

CODE, YIELDED = 3, 4
OPEN, LOADING, UNLOADING = 0.0, 1.0, 2.0
CONTACT, UNLOAD, RELOAD, LEFT, FORGET = range(5)  # events


@compiled(njit)
def _set(parameters):
    """d_0: where the line of unloading meets zero."""
    return parameters[YIELDED] * (1.0 / parameters[0] - 1.0 / parameters[1])


@compiled(cfunc, SIGNATURE)
def walton_braun(n, delta, delta_dot, entry_rate, parameters, force):
    """Force of the present line."""
    code, rest = parameters[CODE], _set(parameters)
    for i in range(n):
        if code == OPEN:
            force[i] = 0.0
        elif code == LOADING:
            force[i] = parameters[0] * delta[i]
        else:
            force[i] = parameters[1] * (delta[i] - rest)


@compiled(cfunc, GRADIENT)
def walton_braun_gradient(n, delta, delta_dot, entry_rate, parameters, by_delta, by_rate, by_entry):
    """Derivatives of `walton_braun`."""
    code = parameters[CODE]
    slope = 0.0 if code == OPEN else parameters[0] if code == LOADING else parameters[1]
    for i in range(n):
        by_delta[i], by_rate[i], by_entry[i] = slope, 0.0, 0.0


@compiled(cfunc, SIGNATURE)
def walton_braun_borders(n, delta, delta_dot, entry_rate, parameters, values):
    """Open: contact, loss of the set. Loading: reversal. Unloading: opening, return to the first loading."""
    code, rest, forgets = parameters[CODE], _set(parameters), parameters[2] == 0.0 and parameters[YIELDED] > 0.0
    for i in range(n):
        d = delta[i]
        if code == OPEN:
            values[i], values[n + i] = rest - d, d if forgets else 1.0
        elif code == LOADING:
            values[i], values[n + i] = delta_dot[i], 1.0
        else:
            values[i], values[n + i] = d - rest, parameters[YIELDED] / parameters[0] - d


@compiled(cfunc, RENEW)
def walton_braun_renew(j, delta, delta_dot, entry_rate, parameters):
    """Pass to the next line."""
    code = parameters[CODE]
    if code == OPEN and j == 1:
        parameters[YIELDED] = 0.0
        return FORGET
    if code == OPEN:
        parameters[CODE] = UNLOADING if parameters[YIELDED] > 0.0 else LOADING
        return CONTACT
    if code == LOADING:
        parameters[CODE], parameters[YIELDED] = UNLOADING, parameters[0] * delta
        return UNLOAD
    parameters[CODE] = LOADING if j == 1 else OPEN
    return RELOAD if j == 1 else LEFT


@compiled(cfunc, SIGNATURE)
def walton_braun_memory_gradient(n, delta, delta_dot, entry_rate, parameters, by_memory):
    """Derivatives of `walton_braun` by code (none) and F_p."""
    for i in range(n):
        by_memory[i] = 0.0
        by_memory[n + i] = 1.0 - parameters[1] / parameters[0] if parameters[CODE] == UNLOADING else 0.0


@compiled(cfunc, RENEW_GRADIENT)
def walton_braun_renew_gradient(j, delta, delta_dot, entry_rate, parameters, out):
    """F_p follows d where the mass turns, and is lost where it is forgotten."""
    for i in range(8):
        out[i] = 0.0
    if j == 0 and parameters[CODE] == LOADING:
        out[4] = parameters[0]
    elif not (j == 1 and parameters[CODE] == OPEN):
        out[7] = 1.0
