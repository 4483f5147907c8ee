"""The tables that grow with blocks and stops: what a state and forces do on contact steps, and what structures share.

A few stops have tables of what reaches every one of them; with more only the responses of the blocks are kept, see
`contact.blocks`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solvers.compiled.kernels import Problem
from solvers.compiled.sums import padded
from solvers.exponential.contact.nodes import PHASES, Families, S, gauss
from solvers.exponential.responses import fill_ahead, fill_free, fill_propagators, fill_way
from solvers.problem import Memo

FEW = 2  # stops that have tables of their own; three are as quick through the blocks, more are quicker
MOST_BYTES = 4e9


class Blocks(NamedTuple):
    """The part of the tables that takes long, block by block; no contact force reaches the tones' blocks."""

    propagator: Any
    step_propagator: Any
    alias: Any
    free: Any
    ahead: Any
    forced: Any
    kick: Any
    response: Any
    ending: Any


_KNOWN = Memo(1 << 27)  # `Blocks` of structures met lately: a tone, gap or stiffness more is cheap


def blocks_of(problem: Problem, tones: int, h: Any, contact_h: Any, families: Families) -> Blocks:
    """Tables of all blocks, zero for the tones; those of a structure met lately are kept."""
    size = len(problem.k)
    own = size - tones
    rows = (row.reshape(-1, 2, size)[:, :, :own] for row in (problem.push, problem.read, problem.load))
    arrays = (problem.k[:own], problem.c[:own], *rows, h, contact_h, families.power, families.lead, families.nodes)
    key = b"|".join((b"%d %d" % (tones, FEW), *(array.tobytes() for array in arrays)))

    def make() -> Blocks:
        _require_room(len(problem.gap), len(problem.load), size, len(contact_h), families)
        return filled(_empty(problem, own, h, contact_h, families), problem, (0, own), h, contact_h, families)

    known: Blocks = _KNOWN.get(key, make)
    return known


def _shapes(stops: int, loads: int, size: int, own: int, levels: int, families: Families) -> dict[str, tuple[int, ...]]:
    """Of the tables that a few stops have, and those of many; what the others have is empty."""
    kinds, ways, inputs, few = len(families.kinds), len(families.ways), stops + loads, stops <= FEW
    many = 0 if few else levels
    levels = levels if few else 0
    return {
        "free": (kinds, levels, stops, 2 * size, 2 * S),
        "ahead": (kinds, many, 2, size, S),
        "forced": (ways, levels, inputs, stops, S, 2 * S),
        "kick": (ways, levels, inputs, S, padded(2 * size)),
        "response": (ways, many, S, 2 * own, S),
        "ending": (ways, many, 2, own, S),
    }


def _require_room(stops: int, loads: int, size: int, levels: int, families: Families) -> None:
    """Refuse tables, or matrices of stops that touch together, beyond what a machine has."""
    numbers = sum(math.prod(shape) for shape in _shapes(stops, loads, size, size, levels, families).values())
    wanted = 8 * (numbers + (S * stops) ** 2)
    if wanted > MOST_BYTES:
        raise ValueError(
            f"Exponential would need {wanted / 1e9:.1f} GB for {stops} stops and {size} modes, more than "
            f"{MOST_BYTES / 1e9:g} GB; use DormandPrince, or fewer modes or stops"
        )


def _empty(problem: Problem, own: int, h: Any, contact_h: Any, families: Families) -> Blocks:
    """Zeros for the tables of all blocks."""
    size, levels = len(problem.k), len(contact_h)
    shapes = _shapes(len(problem.gap), len(problem.load), size, own, levels, families)
    return Blocks(
        propagator=np.zeros((len(h), 2, padded(size))),
        step_propagator=np.zeros((levels, 2, size)),
        alias=np.zeros((len(families.kinds), levels, 2 * size)),
        **{name: np.zeros(shape) for name, shape in shapes.items()},
    )


def filled(
    tables: Blocks, problem: Problem, blocks: tuple[int, int], h: Any, contact_h: Any, families: Families
) -> Blocks:
    """The tables, filled for the blocks from the first to before the last."""
    fill_propagators(problem.k, problem.c, blocks, h, tables.propagator)
    fill_propagators(problem.k, problem.c, blocks, contact_h, tables.step_propagator)
    for i, f in enumerate(families.kinds):
        power, nodes = families.power[f], families.nodes[f]
        if tables.ahead.size:
            fill_ahead(problem, blocks, contact_h, power, nodes, tables.ahead[i])
        else:
            fill_free(problem, blocks, contact_h, power, nodes, tables.free[i])
        _fill_alias(tables.alias[i], problem.k, blocks, contact_h, families.alias[f])
    if blocks[0] == 0:
        _fill_ways(tables, problem, contact_h, families)
    return tables


def _fill_ways(tables: Blocks, problem: Problem, contact_h: Any, families: Families) -> None:
    """What forces do; the responses of the blocks are working space where pairs are kept."""
    inputs = np.ascontiguousarray(np.concatenate((problem.push, problem.load)).reshape(-1, 2 * len(problem.k)))
    own = tables.ending.shape[3]
    response, ending = tables.response, tables.ending
    if not response.size:
        response, ending = (
            np.empty((len(families.ways), 1, S, 2 * own, S)),
            np.empty((len(families.ways), 1, 2, own, S)),
        )
    for i, (f, weighted) in enumerate(families.ways):
        fill_way(
            *(problem, contact_h, families.power[f], families.lead[f] * weighted, families.nodes[f]),
            *(families.lagrange[f, weighted], gauss(12), inputs, response[i], ending[i], tables.forced[i]),
            *(tables.kick[i], np.zeros((S + 1, S, 2)), np.zeros(max(2 * own, S))),
        )


def _fill_alias(out: Any, k: Any, blocks: tuple[int, int], h: Any, alias: Any) -> None:
    """Error of e^{iωt} between the nodes of one kind, times ω for positions, of the blocks that oscillate."""
    some, size = slice(*blocks), len(k)
    omega = np.sqrt(k[some])
    error = np.interp(np.outer(h, omega), PHASES, alias, left=0.0)
    error[error <= 1e-13] = 0.0
    out[:, some], out[:, size:][:, some] = error * omega, error
