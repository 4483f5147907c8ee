"""The variational equation along a known motion, from one event to the next.

    Y' = A Y + Σ b_s dF_s + G,    dF = ∂F/∂δ dδ + ∂F/∂δ̇ dδ̇ + ∂F/∂(entry rate) d(entry rate) + ∂F/∂L dL + ∂F/∂p
    dδ = -w·dq - (dw·q + dgap),   M G = -dM q̈ - dC q̇ - dK q + Σ (dv s + v ds) + Σ dw F

Columns of Y: by the start [q, q̇], by what laws have latched then, and last by the parameter, to which alone the
explicit terms belong. Flights are exact; while forces act, the forces at a panel's nodes are the unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from solvers.problem import Array, System, dense
from solvers.sensitivities import laws
from solvers.sensitivities.nearby import Change
from solvers.sensitivities.panels import Panel, S, moved, propagator
from solvers.sensitivities.stretches import Acting, Motion

_INSIDE = 1e-10  # relative distance kept from a knot, where the slope of a law could be that of the next segment


class Flow:
    """The derivatives at one time, moved along."""

    def __init__(self, system: System, motion: Motion, by: Change | None, start: Array, latched: list[Array]) -> None:
        self.system, self.motion, self.by = system, motion, by
        blocks, n = system.blocks, system.size
        self.k, self.c, self.T = blocks.k, blocks.c, blocks.T
        self.w = np.array([one.direction for one in system.contacts]).reshape(-1, n)
        self.gaps = np.array([one.gap for one in system.contacts])
        self.push = self.w @ system.push.T
        self.read, self.read_rate = -self.w @ self.T[:n], -self.w @ self.T[n:]
        self.y = blocks.inverse @ start
        self.columns = start.shape[1]
        self.latched = latched  # (l, m) of every element
        self.entry, self.impulse = (np.zeros((len(self.w), self.columns)) for _ in range(2))
        self.roughness = 0.0

    @property
    def state(self) -> Array:
        """(2n, m) derivatives of [q, q̇]."""
        return np.asarray(self.T @ self.y)

    def motion_of(self, t: Any, s: int) -> tuple[Any, Any]:
        """δ and δ̇ of an element at times."""
        q, q_dot = np.split(self.motion.at(t), 2)
        return -self.w[s] @ q - self.gaps[s], -self.w[s] @ q_dot

    def force(self, t: Any, s: int, acting: Acting) -> Array:
        """F (k,) at times."""
        inside = self._inside(s, acting, *self.motion_of(t, s))
        return laws.force(self.system.contacts[s].law, acting.rows[s], inside, acting.entry_rate[s])

    def bend(self, t: Array, s: int, acting: Acting) -> Array | None:
        """What changes its sign at kinks of a law within its segment, at times; None without any."""
        inside = self._inside(s, acting, *self.motion_of(t, s))
        return laws.bend(self.system.contacts[s].law, inside, acting.entry_rate[s])

    def _inside(self, s: int, acting: Acting, delta: Any, rate: Any) -> tuple[Any, Any]:
        """δ kept within the segment of the law, and δ̇."""
        contact = self.system.contacts[s]
        knots = (-np.inf if contact.always else 0.0, *contact.law.knots, np.inf)
        low, high = knots[acting.segment[s] - 1], knots[acting.segment[s]]
        low = low + _INSIDE * abs(low) + 1e-300 if np.isfinite(low) else low  # above zero, where a force may jump
        high = high * (1.0 - _INSIDE)
        return np.clip(delta, low, high), rate

    def rate(self, t: Array, acting: Acting) -> Array:
        """[q̇, q̈] (2n, k) of the motion at times (k,)."""
        system, x = self.system, self.motion.at(t)
        q, q_dot = np.split(x, 2)
        push = -dense(system.by_rate) @ q_dot - dense(system.K) @ q
        for vector, signal in system.loads:
            push += np.outer(np.asarray(vector), np.broadcast_to(signal(t), t.shape))
        for s in acting.elements:
            push += np.outer(self.w[s], self.force(t, s, acting))
        return np.concatenate((q_dot, np.linalg.solve(dense(system.M), push)))

    def rates(self, t: float, s: int, acting: Acting) -> tuple[float, float]:
        """δ̇ and δ̈ of an element."""
        speed, acceleration = np.split(self.rate(np.array([t]), acting)[:, 0], 2)
        return -float(self.w[s] @ speed), -float(self.w[s] @ acceleration)

    def change(self, t: float, s: int) -> tuple[Array, Array]:
        """dδ and dδ̇ (m,) of an element at fixed time."""
        moved, sped = self.read[s] @ self.y, self.read_rate[s] @ self.y
        explicit = self._explicit(t, s)
        moved[-1] += explicit[0]
        sped[-1] += explicit[1]
        return moved, sped

    def _explicit(self, t: Any, s: int) -> tuple[Any, Any]:
        """Change of δ and δ̇ by the parameter with the motion held fixed."""
        if self.by is None:
            return 0.0, 0.0
        q, q_dot = np.split(self.motion.at(t), 2)
        turned = self.by.directions[s]
        return -turned @ q - self.by.gaps[s], -turned @ q_dot

    def of_knot(self, s: int, border: int) -> float:
        """Change of a knot by the parameter."""
        return 0.0 if self.by is None else self.by.knot(s, border)

    def over_laws(self, s: int, acting: Acting, read: Callable[[Any, Array], Any]) -> Any:
        """Derivative by the parameter of what is read off a law, with what it has latched held fixed."""
        if self.by is None:
            return 0.0
        places = list(getattr(self.system.contacts[s].law, "memory", ()))
        width = len(acting.rows[s])

        def of(law: Any) -> Any:
            row = np.zeros(width)
            row[: len(law.parameters)] = law.parameters
            row[places] = acting.rows[s][places]
            return read(law, row)

        return self.by.over_laws(s, of)

    def force_change(self, t: Array, s: int, acting: Acting) -> tuple[Array, Array]:
        """∂F/∂(δ, δ̇) (2, k), and the change (k, m) of a force by all but these, at times (k,)."""
        law: Any = self.system.contacts[s].law
        inside, rate = self._inside(s, acting, *self.motion_of(t, s)), acting.entry_rate[s]
        slopes = laws.slopes(law, acting.rows[s], inside, rate)
        other = np.outer(slopes[2], self.entry[s])
        if len(self.latched[s]):
            other += laws.by_latched(law, acting.rows[s], inside, rate).T @ self.latched[s]
        other[:, -1] += self.over_laws(s, acting, lambda one, own: laws.force(one, own, inside, rate))
        moved, sped = self._explicit(t, s)
        other[:, -1] += slopes[0] * moved + slopes[1] * sped
        return slopes[:2], other

    def at_instant(self, t: float, s: int, acting: Acting) -> tuple[float, float, Array]:
        """F, dF/dt and dF (m,) at fixed time of an element that acts."""
        times = np.array([t])
        slopes, other = self.force_change(times, s, acting)
        rate, acceleration = self.rates(t, s, acting)
        changed = other[0] + slopes[0, 0] * (self.read[s] @ self.y) + slopes[1, 0] * (self.read_rate[s] @ self.y)
        return float(self.force(times, s, acting)[0]), float(slopes[:, 0] @ (rate, acceleration)), changed

    def fly(self, duration: float) -> None:
        """Over a time in which nothing acts."""
        self.y = moved(self.k, self.c, *propagator(self.k, self.c, np.array(duration)), self.y)

    def pass_panel(self, panel: Panel, acting: Acting) -> dict[int, Array]:
        """Over a panel; the changes (S, m) of the forces at its nodes."""
        drive = self._drive(panel.times, acting)
        free, elements = panel.free(self.y), acting.elements
        if drive is not None:
            free[..., -1] += panel.at_nodes(drive)
        right, size = np.zeros((len(elements), S, self.columns)), len(elements) * S
        matrix = np.zeros((len(elements), S, len(elements), S))
        for i, s in enumerate(elements):
            slopes, other = self.force_change(panel.times, s, acting)
            rows = self.read[s], self.read_rate[s]
            right[i] = other + sum(
                a[:, None] * np.tensordot(row, free, axes=1) for a, row in zip(slopes, rows, strict=True)
            )
            for j, r in enumerate(elements):
                matrix[i, :, j] = -sum(
                    a[:, None] * panel.response(row, self.push[r]) for a, row in zip(slopes, rows, strict=True)
                )
        matrix = matrix.reshape(size, size) + np.eye(size)
        forces = np.linalg.solve(matrix, right.reshape(size, -1)).reshape(right.shape) if size else right
        rates = np.zeros((2 * len(self.k), S, self.columns))
        for i, s in enumerate(elements):
            rates += self.push[s][:, None, None] * forces[i]
            self.impulse[s] += panel.weights @ forces[i]
        if drive is not None:
            rates[..., -1] += drive
        self.y = panel.end(self.y, rates)
        return dict(zip(elements, forces, strict=True))

    def _drive(self, t: Array, acting: Acting) -> Array | None:
        """Rate (2n, k) of the blocks by the parameter with state and forces held fixed; None where it is zero."""
        by, system = self.by, self.system
        if by is None or not (by.forced or np.any(by.directions)):
            return None
        push = np.zeros((system.size, len(t)))
        if by.structural:
            q, q_dot = np.split(self.motion.at(t), 2)
            push -= by.M @ self.rate(t, acting)[system.size :] + by.B @ q_dot + by.K @ q
        for (vector, signal), turned, slope in zip(system.loads, by.vectors, by.signals, strict=True):
            if np.any(turned):
                push += np.outer(turned, np.broadcast_to(signal(t), t.shape))
            if slope is not None:
                push += np.outer(np.asarray(vector), slope(t))
        for s in acting.elements:
            push += np.outer(by.directions[s], self.force(t, s, acting))
        return np.asarray(system.push @ push)


def _begun(places: list[int], law: Any) -> Array:
    """What a law begins with."""
    return np.asarray(law.parameters)[places]


def latched_columns(system: System, first: int, columns: int, by: Change | None, given: Sequence[Any] | None) -> Any:
    """(l, m) of every element at the start: by what it has latched itself, and by the parameter where laws begin so."""
    found, place = [], first
    for s, contact in enumerate(system.contacts):
        places = list(getattr(contact.law, "memory", ()))
        own = np.zeros((len(places), columns))
        own[:, place : place + len(places)] = np.eye(len(places))
        place += len(places)
        if places and by is not None and (given is None or given[s] is None):
            own[:, -1] = by.over_laws(s, partial(_begun, places))
        found.append(own)
    return found
