"""Work and damping over contact steps summed over the blocks: tables for a few stops.

The velocities of the blocks are linear in y = (x, f), see `contact_tables`: x is the state of blocks and tones, f the
values at the nodes of every *head*, a force or a sampled signal. So the work of a signal on the velocity of its power
row is f^T W y, and that of the tones' loads x^T W y. Damping is a quadratic form of y. Summed over the blocks, once per
length of step, they cost a step no more than its free response. What is left of every block is the damping of its free
motion: three numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.compiled.kernels import Problem
from solvers.compiled.sums import padded
from solvers.exponential.contact.nodes import S
from solvers.exponential.energy.contact_tables import BEGAN, ENTERING, SQUARES
from solvers.exponential.tables import Tables

_FREE = slice(S, BEGAN)  # rows of `contact_table` of p₀ and v₀


@dataclass(frozen=True, eq=False)
class Steps:
    """Integrals over the steps of a node set, block by block.

    ``table`` (j, n, 3S + 5, 2S) is that of `contact_table`, ``entering`` the heads whose force has a weight,
    ``weights`` (j, S) those of the nodes, s, ``tones`` (j, 2K, 2K, S) the motion of the tones at the nodes from that at
    the start.
    """

    table: Any
    entering: Sequence[int]
    weights: Any
    tones: Any

    def moments(self, u: int) -> Any:
        """(j, n, S, S) ∫ L_i v dt per node value of head u."""
        return self.table[:, :, ENTERING:SQUARES, :S] if u in self.entering else self.table[:, :, :S, :S]

    def squares(self, u: int, w: int) -> Any:
        """(j, n, S, S) ∫ v_w v_u dt per node value of each of two heads."""
        if u in self.entering and w in self.entering:
            return self.table[:, :, SQUARES : SQUARES + S, :S]
        if w in self.entering:
            return 0.5 * self.table[:, :, ENTERING:SQUARES, S:]
        return self.squares(w, u).swapaxes(2, 3) if u in self.entering else self.table[:, :, :S, S:]

    def free(self, u: int) -> Any:
        """(j, n, 2, S) twice ∫ v v_u dt, per p₀ and v₀, and per node value of head u."""
        return self.table[:, :, SQUARES + S :, :S] if u in self.entering else self.table[:, :, _FREE, S:]


def tones_at_nodes(steady: Any, k: Any) -> Any:
    """`Steps.tones` from α and β (j, K, 2, S) of the tones."""
    steps, count, _, _ = steady.shape
    out, tone = np.zeros((steps, 2 * count, 2 * count, S)), np.arange(count)
    alpha, beta = steady[:, :, 0], steady[:, :, 1]
    out[:, tone, tone], out[:, count + tone, tone] = alpha, beta
    out[:, tone, count + tone], out[:, count + tone, count + tone] = -k[:, None] * beta, alpha
    return out


class Sums:
    """The forms of one system; `of` computes those of a node set."""

    def __init__(self, problem: Problem, tables: Tables) -> None:
        forces, n, blocks = len(problem.gap), int(tables.own_blocks), len(problem.k)
        self.heads = np.append(np.arange(forces), forces + np.unique(problem.table_load)).astype(np.int64)
        self.first, self.forces, b = 2 * blocks, forces, np.arange(blocks)
        self.p, self.v = b[:n], blocks + b[:n]
        self.tone = np.append(b[n:], blocks + b[n:])
        self.push = np.concatenate((problem.push, problem.load))[:, self.v]
        self.power, self.signal = tables.power_rows, tables.signal_rows
        self.c, self.loss = problem.c[:n], tables.loss_rows[:, self.tone]
        self.works = S * len(self.heads)  # column at which the works of loads begin, then come those of the tones
        self.of_tones = 2 * self.works - S * forces
        self.shape = self.first + self.works, self.of_tones + padded(2 * len(self.tone))

    def rows(self, head: int) -> slice:
        """Where the node values of a head are in y."""
        return slice(self.first + S * head, self.first + S * (head + 1))

    def of(self, steps: Steps) -> Any:
        """(j, y, columns) forms of all steps: S per head damping, S per load work, then those of the tones."""
        out = np.zeros((len(steps.weights), *self.shape))
        work = [self._work(steps, load) for load in range(len(self.power))]
        for i, u in enumerate(self.heads.tolist()):
            out[..., S * i : S * (i + 1)] = self._damping(steps, u)
        for i, u in enumerate(self.heads[self.forces :].tolist()):
            out[..., self.works + S * i : self.works + S * (i + 1)] = work[u - self.forces]
        first, count = self.of_tones, len(self.tone)
        out[..., first : first + count] = self._damping_of_tones(steps)
        for row, of_load in zip(self.signal[:, self.tone], work, strict=True):
            signal = np.einsum("c,jzci->jzi", row, steps.tones)
            out[..., first + count : first + 2 * count] += of_load @ signal.swapaxes(1, 2)
        return out

    def _work(self, steps: Steps, load: int) -> Any:
        """(j, y, S) ∫ L_i P dt, with P the velocity on the power row of a load."""
        out = np.zeros((len(steps.weights), self.shape[0], S))
        for part, rows in enumerate((self.p, self.v)):
            out[:, rows] = self.power[load, self.v, None] * steps.table[:, :, S + part, :S]
        for i, w in enumerate(self.heads.tolist()):
            out[:, self.rows(i)] = _over_blocks(self.power[load, self.v] * self.push[w], steps.moments(w))
        out[:, self.tone] = steps.weights[:, None] * np.einsum("c,jzci->jzi", self.power[load, self.tone], steps.tones)
        return out

    def _damping(self, steps: Steps, u: int) -> Any:
        """(j, y, S) damping by the velocities due to y and those due to head u."""
        out, by_head = np.zeros((len(steps.weights), self.shape[0], S)), self.c * self.push[u]
        for part, rows in enumerate((self.p, self.v)):
            out[:, rows] = by_head[:, None] * steps.free(u)[:, :, part]
        for i, w in enumerate(self.heads.tolist()):
            out[:, self.rows(i)] = _over_blocks(by_head * self.push[w], steps.squares(u, w))
        out[:, self.tone] = self._crossed(steps, u).swapaxes(1, 2)
        return out

    def _damping_of_tones(self, steps: Steps) -> Any:
        """(j, y, 2K) damping by the velocities due to y and those of the steady motion."""
        out, steady = np.zeros((len(steps.weights), self.shape[0], len(self.tone))), self._steady(steps)
        for part, rows in enumerate((self.p, self.v)):
            free = steps.table[:, :, S + part, :S]
            out[:, rows] = 2.0 * np.sqrt(self.c)[:, None] * np.einsum("jbzi,jbi->jbz", steady, free)
        for i, u in enumerate(self.heads.tolist()):
            out[:, self.rows(i)] = self._crossed(steps, u)
        out[:, self.tone] = np.einsum("ji,jbzi,jbyi->jzy", steps.weights, steady, steady)
        return out

    def _steady(self, steps: Steps) -> Any:
        """(j, n, 2K, S) √c times the velocity of each block's steady motion at the nodes."""
        return np.einsum("bc,jzci->jbzi", self.loss, steps.tones)

    def _crossed(self, steps: Steps, u: int) -> Any:
        """(j, S, 2K) damping by head u and the tones."""
        by_head = np.sqrt(self.c) * self.push[u]
        return np.einsum("b,jbei,jbzi->jez", by_head, steps.moments(u), self._steady(steps), optimize=True)


def _over_blocks(weights: Any, forms: Any) -> Any:
    """(j, S, S) weighted sum of forms (j, n, S, S)."""
    return np.einsum("b,jbei->jei", weights, forms)


def free_loss(table: Any, c: Any) -> Any:
    """(j, 3, n) damping of the blocks' free motion = Σ rows × (p², p v, v²)."""
    return np.ascontiguousarray((table[:, :, BEGAN, :3] * c[:, None]).swapaxes(1, 2))
