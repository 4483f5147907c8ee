"""The tables that grow with blocks and stops: responses to a state and to forces on contact steps.

For a few stops the response of every stop to every force is kept; for more only those of the blocks are, see
`contact.many_stops`. Systems of equal structure share them.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solvers.compiled.kernels import Problem
from solvers.compiled.sums import padded
from solvers.exponential.contact.nodes import PHASES, NodeSets, S, gauss
from solvers.exponential.responses import fill_free, fill_node_propagators, fill_propagators, fill_weighting
from solvers.problem import Memo

FEW = 2  # rows up to which pairs of rows have tables; with three, both ways take the same time
MOST_BYTES = 4e9


class Blocks(NamedTuple):
    """The tables that take long to fill, block by block; contact forces do not act on the tones' blocks."""

    flight_propagator: Any
    contact_propagator: Any
    alias: Any
    free: Any
    node_propagator: Any
    forced: Any
    end_response: Any
    block_response: Any
    block_end_response: Any


_CACHE = Memo(1 << 27)  # `Blocks` of recent structures: another tone, gap or stiffness of a stop is cheap


def blocks_of(problem: Problem, tones: int, h: Any, contact_h: Any, node_sets: NodeSets) -> Blocks:
    """Tables of all blocks, zero for the tones; those of recent structures are kept."""
    size = len(problem.k)
    own = size - tones
    rows = (row.reshape(-1, 2, size)[:, :, :own] for row in (problem.push, problem.read, problem.load))
    of_nodes = node_sets.time_exponent, node_sets.weight_exponent, node_sets.nodes
    arrays = problem.k[:own], problem.c[:own], *rows, h, contact_h, *of_nodes
    key = b"|".join((b"%d %d" % (tones, FEW), *(array.tobytes() for array in arrays)))

    def make() -> Blocks:
        _require_room(len(problem.gap), len(problem.load), size, len(contact_h), node_sets)
        return filled(_empty(problem, own, h, contact_h, node_sets), problem, (0, own), h, contact_h, node_sets)

    known: Blocks = _CACHE.get(key, make)
    return known


def _shapes(rows: int, loads: int, size: int, own: int, levels: int, node_sets: NodeSets) -> dict[str, tuple[int, ...]]:
    """Shapes of the tables for a few stops and of those for many; one of the two groups is empty."""
    kinds, weightings, inputs, few = len(node_sets.kinds), len(node_sets.weightings), rows + loads, rows <= FEW
    many = 0 if few else levels
    levels = levels if few else 0
    return {
        "free": (kinds, levels, rows, 2 * size, 2 * S),
        "node_propagator": (kinds, many, 2, size, S),
        "forced": (weightings, levels, inputs, rows, S, 2 * S),
        "end_response": (weightings, levels, inputs, S, padded(2 * size)),
        "block_response": (weightings, many, S, 2 * own, S),
        "block_end_response": (weightings, many, 2, own, S),
    }


def _require_room(rows: int, loads: int, size: int, levels: int, node_sets: NodeSets) -> None:
    """Refuse tables, and a Jacobian of all stops in contact, that need more than `MOST_BYTES`."""
    numbers = sum(math.prod(shape) for shape in _shapes(rows, loads, size, size, levels, node_sets).values())
    wanted = 8 * (numbers + (S * rows) ** 2)
    if wanted > MOST_BYTES:
        raise ValueError(
            f"Exponential would need {wanted / 1e9:.1f} GB for {rows} stops and {size} modes, more than "
            f"{MOST_BYTES / 1e9:g} GB; use DormandPrince, or fewer modes or stops"
        )


def _empty(problem: Problem, own: int, h: Any, contact_h: Any, node_sets: NodeSets) -> Blocks:
    """Zeros for the tables of all blocks."""
    size, levels = len(problem.k), len(contact_h)
    shapes = _shapes(len(problem.gap), len(problem.load), size, own, levels, node_sets)
    return Blocks(
        flight_propagator=np.zeros((len(h), 2, padded(size))),
        contact_propagator=np.zeros((levels, 2, size)),
        alias=np.zeros((len(node_sets.kinds), levels, 2 * size)),
        **{name: np.zeros(shape) for name, shape in shapes.items()},
    )


def filled(
    tables: Blocks, problem: Problem, blocks: tuple[int, int], h: Any, contact_h: Any, node_sets: NodeSets
) -> Blocks:
    """The tables, with the columns of blocks filled from the first to before the last."""
    fill_propagators(problem.k, problem.c, blocks, h, tables.flight_propagator)
    fill_propagators(problem.k, problem.c, blocks, contact_h, tables.contact_propagator)
    for i, f in enumerate(node_sets.kinds):
        time_exponent, nodes = node_sets.time_exponent[f], node_sets.nodes[f]
        if tables.node_propagator.size:
            fill_node_propagators(
                problem.k, problem.c, blocks, contact_h, time_exponent, nodes, tables.node_propagator[i]
            )
        else:
            structure = problem.k, problem.c, problem.read, problem.read_rate
            fill_free(*structure, blocks, contact_h, time_exponent, nodes, tables.free[i])
        _fill_alias(tables.alias[i], problem.k, blocks, contact_h, node_sets.alias[f])
    if blocks[0] == 0:
        _fill_weightings(tables, problem, contact_h, node_sets)
    return tables


def _fill_weightings(tables: Blocks, problem: Problem, contact_h: Any, node_sets: NodeSets) -> None:
    """Fill the responses to forces; those of the blocks are scratch if those of every stop are kept."""
    inputs = np.ascontiguousarray(np.concatenate((problem.push, problem.load)).reshape(-1, 2 * len(problem.k)))
    own = tables.block_end_response.shape[3]
    response, ending = tables.block_response, tables.block_end_response
    if not response.size:
        count = len(node_sets.weightings)
        response, ending = np.empty((count, 1, S, 2 * own, S)), np.empty((count, 1, 2, own, S))
    structure = problem.k, problem.c, problem.read, problem.read_rate
    scratch = np.zeros((S + 1, S, 2)), np.zeros((S + 2, 12, S + 1)), np.zeros(2 * own)
    for i, (f, weighted) in enumerate(node_sets.weightings):
        exponents = node_sets.time_exponent[f], node_sets.weight_exponent[f] * weighted
        weighting = *exponents, node_sets.nodes[f], node_sets.lagrange[f, weighted]
        of_one = response[i], ending[i], tables.forced[i], tables.end_response[i]
        fill_weighting(structure, contact_h, weighting, gauss(12), inputs, of_one, scratch)


def _fill_alias(out: Any, k: Any, blocks: tuple[int, int], h: Any, alias: Any) -> None:
    """Error of the interpolant of e^{iωt} between the nodes, times ω for positions, of oscillating blocks."""
    some, size = slice(*blocks), len(k)
    omega = np.sqrt(k[some])
    error = np.interp(np.outer(h, omega), PHASES, alias, left=0.0)
    error[error <= 1e-13] = 0.0
    out[:, some], out[:, size:][:, some] = error * omega, error
