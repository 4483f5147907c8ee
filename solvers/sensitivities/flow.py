"""The variational equation along a known motion, from one event to the next.

    Y' = A Y + Σ b_s dF_s + G,    dF = ∂F/∂δ dδ + ∂F/∂δ̇ dδ̇ + ∂F/∂(entry rate) d(entry rate) + ∂F/∂L dL + ∂F/∂p
    dδ = -w·dq - (dw·q + dgap),   M G = -dM q̈ - dC q̇ - dK q + Σ (dv s + v ds) + Σ dw F

Columns of Y: by the start [q, q̇], by what laws have latched then, and last by the parameters, to which alone the
explicit terms belong. Flights are exact; while forces act, the forces at a panel's nodes are the unknowns. What a panel
does is linear in the state at its start: all panels of a stretch are solved at once, then passed one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from solvers.problem import Array, System, dense
from solvers.sensitivities import laws
from solvers.sensitivities.nearby import Change
from solvers.sensitivities.panels import Panels, S, moved, propagator, running
from solvers.sensitivities.stretches import Acting, Motion

_INSIDE = 1e-10  # relative distance kept from a knot, where the slope of a law could be that of the next segment


class Flow:
    """The derivatives at one time, moved along."""

    def __init__(self, system: System, motion: Motion, by: Change, start: Array, latched: list[Array]) -> None:
        self.system, self.motion, self.by = system, motion, by
        blocks, n = system.blocks, system.size
        self.k, self.c, self.T = blocks.k, blocks.c, blocks.T
        self.w = np.array([one.direction for one in system.contacts]).reshape(-1, n)
        self.gaps = np.array([one.gap for one in system.contacts])
        self.push = self.w @ system.push.T
        self.read, self.read_rate = -self.w @ self.T[:n], -self.w @ self.T[n:]
        self.accelerate = np.linalg.inv(dense(system.M))
        self.y = blocks.inverse @ start
        self.columns = start.shape[1]
        self.own = slice(self.columns - len(by), self.columns)  # of the parameters
        self.latched = latched  # (l, m) of every element
        self.entry, self.impulse = (np.zeros((len(self.w), self.columns)) for _ in range(2))
        self.largest = np.zeros((len(self.w), self.columns))  # change of each force so far
        self.roughness = 0.0

    @property
    def state(self) -> Array:
        """(2n, m) derivatives of [q, q̇]."""
        return np.asarray(self.T @ self.y)

    @property
    def by_parameters(self) -> Array:
        """(d, 2n) of them those by the parameters."""
        return np.asarray((self.T @ self.y[:, self.own]).T)

    def motion_of(self, t: Any, s: int) -> tuple[Any, Any]:
        """δ and δ̇ of an element at times."""
        q, q_dot = self.motion.at(t)
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
        system, (q, q_dot) = self.system, self.motion.at(t)
        push = -dense(system.by_rate) @ q_dot - dense(system.K) @ q
        for vector, signal in system.loads:
            push += np.outer(np.asarray(vector), np.broadcast_to(signal(t), t.shape))
        for s in acting.elements:
            push += np.outer(self.w[s], self.force(t, s, acting))
        return np.concatenate((q_dot, self.accelerate @ push))

    def rates(self, t: float, s: int, acting: Acting) -> tuple[float, float]:
        """δ̇ and δ̈ of an element."""
        speed, acceleration = self.rate(np.array([t]), acting).reshape(2, -1)
        return -float(self.w[s] @ speed), -float(self.w[s] @ acceleration)

    def change(self, t: float, s: int) -> tuple[Array, Array]:
        """dδ and dδ̇ (m,) of an element at fixed time."""
        moved, sped = self.read[s] @ self.y, self.read_rate[s] @ self.y
        explicit = self._explicit(t, s)
        moved[self.own] += explicit[0]
        sped[self.own] += explicit[1]
        return moved, sped

    def _explicit(self, t: Any, s: int) -> tuple[Any, Any]:
        """Changes (..., d) of δ and δ̇ by the parameters with the motion held fixed."""
        q, q_dot = self.motion.at(t)
        turned = self.by.directions[:, s].T
        return -q.T @ turned - self.by.gaps[:, s], -q_dot.T @ turned

    def over_laws(self, s: int, acting: Acting, read: Callable[[Any, Array], Any]) -> Any:
        """Derivatives (..., d) by the parameters of what is read off a law, with what it has latched held fixed."""
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
        other[:, self.own] += self.over_laws(s, acting, lambda one, own: laws.force(one, own, inside, rate))
        for slope, explicit in zip(slopes[:2], self._explicit(t, s), strict=True):
            other[:, self.own] += slope[:, None] * explicit
        return slopes[:2], other

    def at_instant(self, t: float, s: int, acting: Acting) -> tuple[float, float, Array]:
        """F, dF/dt and dF (m,) at fixed time of an element that acts."""
        times = np.array([t])
        slopes, other = self.force_change(times, s, acting)
        rate, acceleration = self.rates(t, s, acting)
        changed = other[0] + slopes[0, 0] * (self.read[s] @ self.y) + slopes[1, 0] * (self.read_rate[s] @ self.y)
        return float(self.force(times, s, acting)[0]), float(slopes[:, 0] @ (rate, acceleration)), changed

    def fly(self, start: float, end: float, samples: Array) -> Array:
        """Over a time in which nothing acts; derivatives by the parameters at samples, (q, 2n, d)."""
        over = propagator(self.k, self.c, np.append(samples, end) - start)
        found = moved(self.k, self.c, over, self.y[:, None])
        self.y = found[:, -1]
        return np.moveaxis(found[:, :-1, self.own], 0, 1)

    def pass_flight(self, panels: Panels, acting: Acting, samples: Array) -> Array:
        """The same where the parameters drive the motion."""
        rates, begun = self._drive(panels.times, acting), self.y[:, None, self.own]
        found = self.fly(panels.ends[0], panels.ends[-1], samples)
        if rates is None:
            return found
        ends = running(self.k, self.c, panels.ends[1:], panels.at_ends(rates))
        self.y[:, self.own] += ends[:, -1]
        if samples.size:
            starts = np.concatenate((np.zeros_like(begun), ends[:, :-1]), axis=1)
            found = found + panels.within(panels.free(starts) + panels.at_nodes(rates), samples)
        return found

    def pass_panels(self, panels: Panels, acting: Acting, samples: Array) -> tuple[Array, dict[int, Array]]:
        """Where elements act; derivatives at samples, and the changes (P, S, m) of forces at nodes.

        F = A y + B with y at the start of a panel; y ← (E + K A) y + K B + drive at its end.
        """
        count, size, own = len(panels), 2 * len(self.k), self.own
        drive = self._drive(panels.times, acting)
        by_state, other = self._forces(panels, acting, drive)
        reach = np.concatenate([panels.reach(self.push[s]) for s in acting.elements], axis=2)
        across, given = panels.across() + reach @ by_state, reach @ other
        if drive is not None:
            given[..., own] += np.moveaxis(panels.at_ends(drive), 0, 1)
        starts = np.empty((count + 1, size, self.columns))
        starts[0] = self.y
        for i in range(count):
            starts[i + 1] = across[i] @ starts[i] + given[i]
        self.y = starts[-1]
        both = by_state @ starts[:-1] + other
        forces = {s: both[:, i * S : (i + 1) * S] for i, s in enumerate(acting.elements)}
        for s, change in forces.items():
            self.impulse[s] += np.tensordot(panels.weights, change, 2)
        if not samples.size:
            return np.zeros((0, size, len(self.by))), forces
        rates = np.zeros((size, count, S, len(self.by))) if drive is None else drive
        for s, change in forces.items():
            rates = rates + self.push[s][:, None, None, None] * change[..., own]
        states = panels.free(np.moveaxis(starts[:-1, :, own], 1, 0)) + panels.at_nodes(rates)
        return panels.within(states, samples), forces

    def _forces(self, panels: Panels, acting: Acting, drive: Array | None) -> tuple[Array, Array]:
        """Changes of all forces at the nodes: by the state at the start of a panel (P, m S, 2n), and else."""
        elements, count, size = acting.elements, len(panels), 2 * len(self.k)
        m, driven = len(elements), None if drive is None else panels.at_nodes(drive)
        by_state, other = np.zeros((count, m, S, size)), np.zeros((count, m, S, self.columns))
        left: Array = np.zeros((count, m, S, m, S))
        for i, s in enumerate(elements):
            slopes, change = self.force_change(panels.times.ravel(), s, acting)
            other[:, i] = change.reshape(count, S, -1)
            for slope, row in zip(slopes.reshape(2, count, S, 1), (self.read[s], self.read_rate[s]), strict=True):
                by_state[:, i] += slope * panels.seen(row)
                if driven is not None:
                    other[:, i, :, self.own] += slope * np.tensordot(row, driven, 1)
                for j, r in enumerate(elements):
                    left[:, i, :, j] -= slope * panels.response(row, self.push[r])
        left = left.reshape(count, m * S, m * S) + np.eye(m * S)
        right = np.concatenate((by_state, other), axis=3).reshape(count, m * S, -1)
        solved = np.asarray(np.linalg.solve(left, right), dtype=float)
        return solved[..., :size], solved[..., size:]

    def _drive(self, t: Array, acting: Acting) -> Array | None:
        """Rates (2n, P, S, d) of the blocks by the parameters at times (P, S), state and forces held fixed."""
        by, system = self.by, self.system
        if not (by.forced or np.any(by.directions)):
            return None
        times = t.ravel()
        push = np.zeros((len(by), system.size, times.size))
        if by.structural:
            rate = self.rate(times, acting)
            q, (q_dot, q_ddot) = self.motion.at(times)[0], rate.reshape(2, -1, times.size)
            push -= by.M @ q_ddot + by.B @ q_dot + by.K @ q
        for i, (vector, signal) in enumerate(system.loads):
            if np.any(by.vectors[:, i]):
                push += by.vectors[:, i, :, None] * np.broadcast_to(signal(times), times.shape)
            for j, signals in enumerate(by.signals):
                if (slope := signals[i]) is not None:
                    push[j] += np.outer(np.asarray(vector), slope(times))
        for s in acting.elements:
            if np.any(by.directions[:, s]):
                push += by.directions[:, s, :, None] * self.force(times, s, acting)
        return np.asarray(np.moveaxis(system.push @ push, 0, -1)).reshape(-1, *t.shape, len(by))


def _begun(places: list[int], law: Any) -> Array:
    """What a law begins with."""
    return np.asarray(law.parameters)[places]


def latched_columns(system: System, by: Change, columns: int, given: Sequence[Any] | None) -> list[Array]:
    """(l, m) of every element at the start: by what it has latched itself, and by parameters where laws begin so."""
    found, place = [], 2 * system.size
    for s, contact in enumerate(system.contacts):
        places = list(getattr(contact.law, "memory", ()))
        own = np.zeros((len(places), columns))
        own[:, place : place + len(places)] = np.eye(len(places))
        place += len(places)
        if places and (given is None or given[s] is None):
            own[:, columns - len(by) :] = by.over_laws(s, partial(_begun, places))
        found.append(own)
    return found
