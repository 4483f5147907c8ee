"""What a run leaves, in plain arrays: logs, energy balance and losses are made of it when they are asked for."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from solvers.problem import event_list as at
from solvers.problem.friction import ACCOUNTS
from solvers.problem.losses import Losses
from solvers.problem.matrices import Array
from solvers.problem.result import ContactLog, Cost, Energy, FrictionLog, Transitions
from solvers.problem.system import System


class Record(NamedTuple):
    """A run of a system with m contacts in N blocks: k samples, or without them the end alone, k = 1."""

    system: System
    back: Any  # (2n, 2N) makes [q, q̇] of the state of the blocks
    begin: Array  # (2N,) state of the blocks at t = 0
    latched: tuple[Array, ...]  # by the laws then
    last: Array  # (2N + a,) the state reached, and the accounts then
    memory: tuple[Array, ...]  # latched then
    t: Array  # (k,) s
    motion: Array  # (k, 2n) [q, q̇] at the samples
    accounts: Array  # (k, a) input, damping, work and impulse of each contact, and `ACCOUNTS` of each friction
    rows: Array  # event list
    complete: bool  # whether input and damping are known
    rubbed: Array | None  # (m, 3) loss by friction and work of the spin, J, and way of the slider, m; None without
    work: tuple[Any, ...]  # the numbers of `Cost`

    @property
    def works(self) -> Array:
        """(k, 2 + 2m) the accounts but for those of friction."""
        return self.accounts[:, : 2 + 2 * len(self.system.contacts)]

    @property
    def works_of_friction(self) -> tuple[Any, Any]:
        """(k,) works of friction and (k,) of spins, J; 0.0 without friction."""
        if self.rubbed is None:
            return 0.0, 0.0
        laws: list[Any] = [contact.law for contact in self.system.contacts if contact.friction is not None]
        own = self.accounts[:, self.works.shape[1] :]
        return own[:, ::ACCOUNTS].sum(axis=1), own[:, 1::ACCOUNTS] @ [law.arm * law.spin for law in laws]

    def cost(self) -> Cost:
        """What the run took."""
        return Cost(*self.work)

    def end(self) -> Array:
        """(2n + l,) [q, q̇] at the time reached, and what is latched then."""
        return np.concatenate((self.back.dot(self.last[: self.begin.size]), *self.memory))

    def names(self) -> list[str]:
        """What the contacts are called."""
        return [contact.name for contact in self.system.contacts]

    def contacts(self) -> ContactLog:
        """The log of those contacts that begin and end."""
        rows = self.rows
        for s, contact in enumerate(self.system.contacts):
            if contact.always and not getattr(contact.law, "opens", False):
                rows = rows[rows[:, at.ELEMENT] != s]
        return ContactLog.of_events(rows, self.names())

    def transitions(self) -> Transitions:
        """What laws with memory have met."""
        return Transitions.of_events(self.rows, self.system.contacts)

    def friction(self) -> FrictionLog:
        """What friction did."""
        return FrictionLog.of_events(self.rows, self.names())

    def energy(self) -> Energy:
        """The energy balance; input and damping are NaN where it was not kept."""
        works, start = self.works, self.back @ self.begin
        given = works[:, :2] if self.complete else np.full((len(works), 2), math.nan)
        stored, initial = (self.system.energy(*np.split(x, 2, axis=-1)) for x in (self.motion, start))
        taken = works[:, 2::2].sum(axis=1)
        return Energy(given[:, 0], given[:, 1], taken, stored, float(initial), *self.works_of_friction)

    def losses(self) -> Losses:
        """What each contact has taken."""
        return Losses.of_run(self)

    def exchanged(self) -> Array:
        """Peak force times peak indentation of every contact, J."""
        ends = at.ends_of(self.rows)
        return ends[:, at.DEEPEST] * ends[:, at.LARGEST]
