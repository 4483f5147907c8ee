"""Integrals over a step in contact from values at its nodes: impulse and work of a force."""

from __future__ import annotations

from solvers.compiled.kernels import inlined
from solvers.compiled.simd import load8, splat8, sum8
from solvers.compiled.sums import combine
from solvers.exponential.contact.nodes import S

_BRIEF = 1.0  # radians of the fastest block up to which nodes resolve δ̇; δ - δ₀ may be rounding of δ


@inlined
def is_weighted(tables, node_set, s):
    """Whether the force of element s has the weight σ^λ on a step with these nodes."""
    return s == node_set - 1 and tables.weight_exponent[node_set] > 0.0


@inlined
def weights_of(tables, node_set, s):
    """Weights of the eight nodes, per length of the step, for ∫F dt of the force of element s."""
    return load8(tables.weights[node_set], 0) if is_weighted(tables, node_set, s) else load8(tables.plain[node_set], 0)


@inlined
def resolves_rates(tables, node_set, s, h):
    """Whether `work_by_rates` is right for the force of element s on a step of length h; else `work_by_places` is."""
    return is_weighted(tables, node_set, s) or h * tables.fastest <= _BRIEF


@inlined
def work_by_rates(tables, node_set, s, h, force, rates):
    """∫F δ̇ dt, J, of the force of element s from its values (S,) and the rates (S,)."""
    return h * sum8(weights_of(tables, node_set, s) * load8(force, 0) * load8(rates, 0))


@inlined
def work_by_places(tables, node_set, force, places, ends, spare):
    """∫F dδ, J, of a force without weight, with F interpolated in the nodes, δ in nodes and ends.

    The quadrature of F δ̇ at the nodes would be wrong where the force hardly changes: there steps grow until fast
    blocks oscillate between the nodes. A constant force does the work F × (change of δ), whatever the motion in
    between. ``places`` (S,) and both ``ends`` are δ, ``spare`` takes eight numbers.
    """
    begin, end = ends
    combine(tables.work[node_set], force, S, None, spare)
    within = sum8(load8(spare, 0) * (load8(places, 0) - splat8(begin)))
    return within + sum8(load8(tables.work_end[node_set], 0) * load8(force, 0)) * (end - begin)
