"""The variational equation along a known motion, from one event to the next.

    Y' = A Y + Σ b_r df_r + G,    y = -rows·q - offsets,    dy = -rows·dq - (d rows·q + d offsets)

    M G = -dM q̈ - dC q̇ - dK q + Σ (dv s + v ds) + Σ d rows f

with the changes df of the forces on the rows from `elements`. Columns of Y: by the start [q, q̇], by what laws have
latched then, and last by the parameter, to which alone the explicit terms belong. Flights are exact; while forces act,
the forces at a panel's nodes are the unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from solvers.problem import Array, System, dense
from solvers.problem.friction import MU, SLIDER, STIFFNESS
from solvers.sensitivities import laws
from solvers.sensitivities.elements import (
    ElementMotion,
    Linear,
    Slider,
    acceleration_of,
    forces_of,
    linear,
    motion_of,
)
from solvers.sensitivities.nearby import Change
from solvers.sensitivities.panels import Panel, S, moved, propagator
from solvers.sensitivities.stretches import Acting, Motion

_INSIDE = 1e-10  # relative distance kept from a knot, where the slope of a law could be that of the next segment


class Flow:
    """The derivatives at one time, moved along."""

    def __init__(self, system: System, motion: Motion, by: Change | None, start: Array, latched: list[Array]) -> None:
        self.system, self.motion, self.by = system, motion, by
        blocks, n, contacts = system.blocks, system.size, system.contacts
        self.k, self.c, self.T = blocks.k, blocks.c, blocks.T
        self.rows = [one.rows for one in contacts]
        self.push = [rows @ system.push.T for rows in self.rows]
        self.read = [np.stack((-rows @ self.T[:n], -rows @ self.T[n:])) for rows in self.rows]  # (2, m, 2n)
        self.y = blocks.inverse @ start
        self.columns = start.shape[1]
        self.latched = latched  # (l, m) of every element
        self.entry, self.impulse = (np.zeros((len(contacts), self.columns)) for _ in range(2))
        self.roughness = 0.0

    @property
    def state(self) -> Array:
        """(2n, m) derivatives of [q, q̇]."""
        return np.asarray(self.T @ self.y)

    def _of_rows(self, t: Any, s: int) -> tuple[Array, Array]:
        """Motion y and ẏ (m, k) of an element's rows at times (k,)."""
        q, q_dot = np.split(self.motion.at(np.atleast_1d(t)), 2)
        return -self.rows[s] @ q - self.system.contacts[s].row_gaps[:, None], -self.rows[s] @ q_dot

    def motion_of(self, t: Any, s: int) -> ElementMotion:
        """ElementMotion of an element at times."""
        return motion_of(self.system.contacts[s], np.atleast_1d(t), *self._of_rows(t, s))

    def slider(self, s: int, acting: Acting) -> Slider | None:
        """Friction of an element."""
        return Slider.of(self.system.contacts[s], acting.rows[s])

    def force(self, t: Any, s: int, acting: Acting, motion: ElementMotion | None = None) -> Array:
        """N (k,) at times."""
        motion = self.motion_of(t, s) if motion is None else motion
        inside = self._inside(s, acting, motion)
        return laws.force(self.system.contacts[s].law, acting.rows[s], inside, acting.entry_rate[s])

    def forces(self, t: Any, s: int, acting: Acting) -> Array:
        """Forces (m, k) on the rows at times."""
        motion = self.motion_of(t, s)
        return forces_of(motion, self.slider(s, acting), self.force(t, s, acting, motion))

    def bend(self, t: Array, s: int, acting: Acting) -> Array | None:
        """What changes its sign at kinks of a law within its segment, at times; None without any."""
        motion, slider = self.motion_of(t, s), self.slider(s, acting)
        found = laws.bend(self.system.contacts[s].law, self._inside(s, acting, motion), acting.entry_rate[s])
        if found is None and slider is not None and not slider.sticks:
            normal = self.force(t, s, acting, motion)
            return normal if self.system.contacts[s].law.jump or normal.min() < 0.0 else None  # μN is cut at zero
        return found

    def _inside(self, s: int, acting: Acting, motion: ElementMotion) -> tuple[Array, Array]:
        """δ kept within the segment of the law, and δ̇."""
        contact = self.system.contacts[s]
        knots = (-np.inf if contact.always else 0.0, *contact.law.knots, np.inf)
        low, high = knots[acting.segment[s] - 1], knots[acting.segment[s]]
        low = low + _INSIDE * abs(low) + 1e-300 if np.isfinite(low) else low  # above zero, where a force may jump
        high = high * (1.0 - _INSIDE)
        return np.clip(motion.delta, low, high), motion.rate

    def rate(self, t: Array, acting: Acting) -> Array:
        """[q̇, q̈] (2n, k) of the motion at times (k,)."""
        system, x = self.system, self.motion.at(t)
        q, q_dot = np.split(x, 2)
        push = -dense(system.by_rate) @ q_dot - dense(system.K) @ q
        for vector, signal in system.loads:
            push += np.outer(np.asarray(vector), np.broadcast_to(signal(t), t.shape))
        for s in acting.elements:
            push += self.rows[s].T @ self.forces(t, s, acting)
        return np.concatenate((q_dot, np.linalg.solve(dense(system.M), push)))

    def rates(self, t: float, s: int, acting: Acting) -> tuple[float, float]:
        """δ̇ and δ̈ of an element."""
        y_dot, y_twice = -self.rows[s] @ self.rate(np.array([t]), acting).reshape(2, -1, 1)
        motion = self.motion_of(t, s)
        return float(motion.rate[0]), float(acceleration_of(motion, y_dot, y_twice)[0])

    def change(self, t: float, s: int) -> tuple[Array, Array]:
        """dδ and dδ̇ (m,) of an element at fixed time."""
        motion, (moved_rows, sped) = self.motion_of(t, s), self._rows_change(t, s)
        press, turning = motion.press[:, 0], motion.turning[:, 0]
        found = press @ moved_rows, press @ sped + turning @ moved_rows
        if self.by is not None:
            found[0][-1] -= np.sign(self.system.contacts[s].circle) * self.by.elements[s].clearance
        return found

    def way_change(self, t: float, s: int) -> Array:
        """dξ (m,) of an element with friction at fixed time."""
        motion = self.motion_of(t, s)
        found = motion.rub[:, 0] @ self._rows_change(t, s)[0]
        if self.by is not None:
            one = self.by.elements[s]
            found[-1] += one.clearance * motion.angle[0] + one.surface * t
        return np.asarray(found)

    def _rows_change(self, t: float, s: int) -> tuple[Array, Array]:
        """Changes dy and dẏ (m, columns) of an element's rows at fixed time."""
        moved_rows, sped = self.read[s] @ self.y
        for one, more in zip((moved_rows, sped), self._explicit(t, s), strict=True):
            one[:, -1] += more[:, 0]
        return moved_rows, sped

    def _explicit(self, t: Any, s: int) -> tuple[Array, Array]:
        """Change of y and ẏ (m, k) by the parameter with the motion held fixed."""
        if self.by is None:
            none = np.zeros((len(self.rows[s]), np.size(t)))
            return none, none
        q, q_dot = np.split(self.motion.at(np.atleast_1d(t)), 2)
        one = self.by.elements[s]
        return -one.rows @ q - one.offsets[:, None], -one.rows @ q_dot

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

    def force_change(self, t: Array, s: int, acting: Acting) -> Linear:
        """Changes of an element's forces by its motion, and by all but that, at times (k,)."""
        law: Any = self.system.contacts[s].law
        motion, slider = self.motion_of(t, s), self.slider(s, acting)
        inside, rate = self._inside(s, acting, motion), acting.entry_rate[s]
        slopes = laws.slopes(law, acting.rows[s], inside, rate)
        by_law = np.outer(slopes[2], self.entry[s])
        if len(self.latched[s]) and slider is None:
            by_law += laws.by_latched(law, acting.rows[s], inside, rate).T @ self.latched[s]
        by_law[:, -1] += self.over_laws(s, acting, lambda one, own: laws.force(one, own, inside, rate))
        if self.by is not None:
            by_law[:, -1] -= slopes[0] * np.sign(self.system.contacts[s].circle) * self.by.elements[s].clearance
        found = linear(motion, slider, self.force(t, s, acting, motion), slopes[:2], by_law)
        if slider is not None:
            self._add_friction(t, s, acting, motion, slider, found)
        for one, normal, explicit in zip(found.slopes, found.normal, self._explicit(t, s), strict=True):
            found.other[..., -1] += np.einsum("abk,bk->ak", one, explicit)
            found.normal_other[:, -1] += (normal * explicit).sum(axis=0)
        return found

    def _add_friction(
        self, t: Array, s: int, acting: Acting, motion: ElementMotion, slider: Slider, found: Linear
    ) -> None:
        """Add what its slider's place, and the parameter, change a force by at fixed motion and N."""
        normal, drawn = self.force(t, s, acting, motion), slider.drawn(motion.way)
        stiffness = slider.numbers[STIFFNESS] if slider.sticks else 0.0
        found.other[...] -= stiffness * motion.rub[..., None] * self.latched[s][1]
        if self.by is None:
            return
        one, contact = self.by.elements[s], self.system.contacts[s]
        changed = slider.share(normal) * normal * (one.mu / slider.numbers[MU] if slider.numbers[MU] else 0.0)
        if slider.sticks:
            changed = one.stiffness * drawn + stiffness * one.surface * t
        if contact.circle:
            turns = (drawn - (motion.way - slider.numbers[SLIDER])) / contact.gap
            changed = changed + stiffness * one.clearance * (motion.angle + turns)
            lengthened = one.clearance / contact.gap * slider.force(motion.way, normal)
            found.other[:2, :, -1] += lengthened * motion.rub[:2]
        found.other[..., -1] += changed * motion.rub

    def at_instant(self, t: float, s: int, acting: Acting) -> tuple[float, float, Array]:
        """N, dN/dt and dN (m,) at fixed time of an element that acts."""
        times = np.array([t])
        change, moved_rows = self.force_change(times, s, acting), self.read[s] @ self.y
        law: Any = self.system.contacts[s].law
        inside = self._inside(s, acting, self.motion_of(t, s))
        slopes = laws.slopes(law, acting.rows[s], inside, acting.entry_rate[s])[:2, 0]
        changed = change.normal_other[0] + np.einsum("dak,dac->c", change.normal, moved_rows)
        return float(self.force(times, s, acting)[0]), float(slopes @ self.rates(t, s, acting)), changed

    def fly(self, duration: float) -> None:
        """Over a time in which nothing acts."""
        self.y = moved(self.k, self.c, *propagator(self.k, self.c, np.array(duration)), self.y)

    def pass_panel(self, panel: Panel, acting: Acting) -> dict[int, tuple[Array, Array]]:
        """Over a panel; at its nodes the changes of N (S, columns), and of the forces on the rows (m, S, columns)."""
        drive = self._drive(panel.times, acting)
        free, elements = panel.free(self.y), acting.elements
        if drive is not None:
            free[..., -1] += panel.at_nodes(drive)
        changes = [self.force_change(panel.times, s, acting) for s in elements]
        motion = [np.tensordot(self.read[s], free, axes=1) for s in elements]  # (2, m, S, columns) each
        first = np.cumsum([0, *(len(self.rows[s]) for s in elements)])
        size, right = (
            int(first[-1]),
            [_by_motion(one.slopes, y) + one.other for one, y in zip(changes, motion, strict=True)],
        )
        responses = [self._responses(panel, s, elements) for s in elements]  # (2, m, size, S, S) each
        matrix = np.eye(size * S).reshape(size, S, size, S)
        for i, (one, response) in enumerate(zip(changes, responses, strict=True)):
            matrix[first[i] : first[i + 1]] -= np.einsum("dabi,dbrij->airj", one.slopes, response)
        forces: Array = np.zeros((size, S, self.columns))
        if size:
            found = np.linalg.solve(matrix.reshape(size * S, -1), np.concatenate(right).reshape(size * S, -1))
            forces = np.asarray(found.reshape(forces.shape))
        rates, out = np.zeros((2 * len(self.k), S, self.columns)), {}
        for i, s in enumerate(elements):
            own = forces[first[i] : first[i + 1]]
            rates += np.tensordot(self.push[s].T, own, axes=1)
            normal = own[0]
            if len(own) > 1:
                y = motion[i] + np.einsum("dbrij,rjc->dbic", responses[i], forces)
                normal = changes[i].normal_other + np.einsum("dak,dakc->kc", changes[i].normal, y)
            self.impulse[s] += panel.weights @ normal
            out[s] = normal, own
        if drive is not None:
            rates[..., -1] += drive
        self.y = panel.end(self.y, rates)
        return out

    def _responses(self, panel: Panel, s: int, elements: list[int]) -> Array:
        """(2, m, R, S, S) of an element's rows, and of their rates, to forces on all R rows."""
        pushes = [push for r in elements for push in self.push[r]]
        return np.array([[[panel.response(row, push) for push in pushes] for row in rows] for rows in self.read[s]])

    def _drive(self, t: Array, acting: Acting) -> Array | None:
        """Rate (2n, k) of the blocks by the parameter with state and forces held fixed; None where it is zero."""
        by, system = self.by, self.system
        if by is None or not (by.forced or by.turned):
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
            push += by.elements[s].rows.T @ self.forces(t, s, acting)
        return np.asarray(system.push @ push)


def _by_motion(slopes: Array, y: Array) -> Array:
    """Σ over displacement and rate (m, k, columns)."""
    return np.asarray(np.einsum("dabk,dbkc->akc", slopes, y))


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
