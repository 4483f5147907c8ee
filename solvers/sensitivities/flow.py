"""The variational equation along a known motion, from one event to the next.

    Y' = A Y + Σ b_r df_r + G,    y = -rows·q - offsets,    dy = -rows·dq - (d rows·q + d offsets)

    M G = -dM q̈ - dC q̇ - dK q + Σ (dv s + v ds) + Σ d rows f

with the changes df of the forces on the rows from `elements`. Columns of Y: by the start [q, q̇], by what laws have
latched then, and last by the parameters, which alone have the explicit terms. Flights are exact; while forces act,
their values at a panel's nodes are the unknowns. They are linear in the state at its start: all panels of a stretch are
solved at once, then passed one after the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from solvers.problem import Array, System, dense
from solvers.problem.friction import SLIDER, STIFFNESS
from solvers.sensitivities import laws
from solvers.sensitivities.elements import ElementMotion, Linear, Slider, acceleration_of, forces_of, linear, motion_of
from solvers.sensitivities.nearby import Change
from solvers.sensitivities.panels import Panels, S, moved, propagator, running
from solvers.sensitivities.stretches import Acting, Motion

_ROUNDING = 1e-9  # of a sum of changes, relative to its terms
_INSIDE = 1e-10  # relative distance kept from a knot, where the slope of a law may be that of the next segment


class Flow:
    """The derivatives at one time; methods move them on to later times."""

    def __init__(self, system: System, motion: Motion, by: Change, start: Array, latched: list[Array]) -> None:
        self.system, self.motion, self.by = system, motion, by
        blocks, n, contacts = system.blocks, system.size, system.contacts
        self.k, self.c, self.T = blocks.k, blocks.c, blocks.T
        self.rows = [one.rows for one in contacts]
        self.push = [rows @ system.push.T for rows in self.rows]
        self.read = [np.stack((-rows @ self.T[:n], -rows @ self.T[n:])) for rows in self.rows]  # (2, m, 2n)
        self.accelerate = np.linalg.inv(dense(system.M))
        self.y = blocks.inverse @ start
        self.columns = start.shape[1]
        self.own = slice(self.columns - len(by), self.columns)  # of the parameters
        self.places = start[:n, self.own]  # of q at the start, as given: in decoupled form speeds round into it
        self.latched = latched  # (l, m) of every element
        self.entry, self.impulse = (np.zeros((len(contacts), self.columns)) for _ in range(2))
        self.largest = np.zeros((len(contacts), self.columns))  # change of each element's forces so far
        self.roughness = 0.0

    @property
    def state(self) -> Array:
        """(2n, m) derivatives of [q, q̇]."""
        return self.T @ self.y

    @property
    def by_parameters(self) -> Array:
        """(d, 2n) derivatives of [q, q̇] by the parameters."""
        return (self.T @ self.y[:, self.own]).T

    def motion_of(self, t: Any, s: int) -> ElementMotion:
        """`ElementMotion` of an element at times."""
        times = np.atleast_1d(t)
        q, q_dot = self.motion.at(times)
        return motion_of(self.system.contacts[s], q, q_dot, times)

    def slider(self, s: int, acting: Acting) -> Slider | None:
        """The slider of an element, None without friction."""
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
        """Event function of kinks of a law within its segment, at times; None without any."""
        return laws.bend(
            self.system.contacts[s].law, self._inside(s, acting, self.motion_of(t, s)), acting.entry_rate[s]
        )

    def _inside(self, s: int, acting: Acting, motion: ElementMotion, more: Sequence[Any] = ()) -> tuple[Array, Array]:
        """δ, kept within the segment of the law, and of ``more`` laws with as many knots elsewhere, and δ̇."""
        contact = self.system.contacts[s]
        lowest, own = -np.inf if contact.always else 0.0, contact.law.knots
        alike = (law.knots for law in more if len(law.knots) == len(own))  # those of a sum may fall together
        knots = np.array([(lowest, *one, np.inf) for one in (own, *alike)])
        low, high = knots[:, acting.segment[s] - 1].max(), knots[:, acting.segment[s]].min()
        if not low < high:  # a knot moves by more than its segment
            low, high = knots[0, acting.segment[s] - 1], knots[0, acting.segment[s]]
        low = low + _INSIDE * abs(low) + 1e-300 if np.isfinite(low) else low  # above zero, where a force may jump
        high = high * (1.0 - _INSIDE)
        return np.clip(motion.delta, low, high), motion.rate

    def rate(self, t: Array, acting: Acting) -> Array:
        """[q̇, q̈] (2n, k) of the motion at times (k,)."""
        system, (q, q_dot) = self.system, self.motion.at(t)
        push = -dense(system.by_rate) @ q_dot - dense(system.K) @ q
        for vector, signal in system.loads:
            push += np.outer(np.asarray(vector), np.broadcast_to(signal(t), t.shape))
        for s in acting.elements:
            push += self.rows[s].T @ self.forces(t, s, acting)
        return np.concatenate((q_dot, self.accelerate @ push))

    def rates(self, t: float, s: int, acting: Acting) -> tuple[float, float]:
        """δ̇ and δ̈ of an element."""
        y_dot, y_twice = -self.rows[s] @ self.rate(np.array([t]), acting).reshape(2, -1, 1)
        motion = self.motion_of(t, s)
        return float(motion.rate[0]), float(acceleration_of(motion, y_dot, y_twice)[0])

    def change(self, t: float, s: int) -> tuple[Array, Array]:
        """dδ and dδ̇ (m,) of an element at fixed time."""
        motion, (moved_rows, sped) = self.motion_of(t, s), self._rows_change(t, s)
        delta_slopes, rate_slopes = motion.delta_slopes[:, 0], motion.rate_slopes[:, 0]
        found = delta_slopes @ moved_rows, delta_slopes @ sped + rate_slopes @ moved_rows
        found[0][self.own] -= np.sign(self.system.contacts[s].circle) * self.by.elements[s].clearance
        return found

    def leaves_at_start(self, s: int, border: int) -> Array:
        """(d,) whether parameters move δ off a border at t = 0: by more than 1e-9 of the sums that tell it."""
        one, motion = self.by.elements[s], self.motion_of(0.0, s)
        slopes, q = motion.delta_slopes[:, 0], self.motion.at(np.zeros(1))[0][:, 0]
        terms = [-slopes @ self.rows[s] * self.places.T, -slopes @ one.rows * q, -one.offsets * slopes]
        rest = np.sign(self.system.contacts[s].circle) * one.clearance, self.by.of_knot(s, border)
        summed = np.concatenate([*terms, -np.transpose(rest)], axis=1)
        return np.abs(summed.sum(axis=1)) > _ROUNDING * np.abs(summed).sum(axis=1)

    def xi_change(self, t: float, s: int, told: float | None = None) -> Array:
        """dξ (m,) of an element with friction at fixed time; of ξ as it is ``told``, which may count more turns."""
        motion = self.motion_of(t, s)
        found, one = motion.xi_slopes[:, 0] @ self._rows_change(t, s)[0], self.by.elements[s]
        turn, angle = 2.0 * math.pi * abs(self.system.contacts[s].circle), motion.angle[0]
        if turn and told is not None:
            angle += 2.0 * math.pi * round((told - motion.xi[0]) / turn)
        found[self.own] += one.clearance * angle + one.surface * t
        return found

    def _rows_change(self, t: float, s: int) -> tuple[Array, Array]:
        """Changes dy and dẏ (m, columns) of an element's rows at fixed time."""
        moved_rows, sped = self.read[s] @ self.y
        for one, more in zip((moved_rows, sped), self._explicit(t, s), strict=True):
            one[:, self.own] += more[:, 0]
        return moved_rows, sped

    def _explicit(self, t: Any, s: int) -> tuple[Array, Array]:
        """Changes of y and ẏ (m, k, d) by the parameters with the motion held fixed."""
        one = self.by.elements[s]
        y, y_dot = (np.moveaxis(-one.rows @ x, 0, -1) for x in self.motion.at(np.atleast_1d(t)))
        return y - one.offsets.T[:, None], y_dot

    def over_laws(self, s: int, acting: Acting, read: Callable[[Any, Array, float], Any]) -> Any:
        """Derivatives (..., d) by the parameters of what is read off a law, at fixed latched numbers.

        An entry rate at the floor of the law is, in nearby ones, at theirs.
        """
        places, width, rate = self.system.contacts[s].memory, len(acting.rows[s]), acting.entry_rate[s]
        floored = rate == self.system.contacts[s].law.entry_rate_floor

        def of(law: Any) -> Any:
            row = np.zeros(width)
            row[: len(law.parameters)] = law.parameters
            row[places] = acting.rows[s][places]
            return read(law, row, law.entry_rate_floor if floored else rate)

        return self.by.over_laws(s, of)

    def _force_over_laws(self, s: int, acting: Acting, motion: ElementMotion) -> Array:
        """Derivatives (k, d) of N by the parameters, through the law's numbers at fixed motion.

        On a knot, a little beside it, where nearby laws of other knots are in the same segment. Of a law that is cut at
        zero force where it is not cut itself: nearby ones are cut a little before or after.
        """
        law, rate = self.system.contacts[s].law, acting.entry_rate[s]
        inside = self._inside(s, acting, motion, self.by.laws_of(s))
        if getattr(law, "bend", None) != "force":
            return self.over_laws(s, acting, lambda one, own, entry: laws.force(one, own, inside, entry))
        pushes: Any = laws.bend(law, inside, rate)
        uncut = self.over_laws(s, acting, lambda one, own, entry: laws.uncut_force(one, inside, entry))
        return uncut * (pushes > 0.0)[:, None]

    def force_change(self, t: Array, s: int, acting: Acting) -> Linear:
        """Changes of an element's forces at times (k,), by its motion and by everything else."""
        law: Any = self.system.contacts[s].law
        motion, slider = self.motion_of(t, s), self.slider(s, acting)
        inside, rate = self._inside(s, acting, motion), acting.entry_rate[s]
        slopes = laws.slopes(law, acting.rows[s], inside, rate)
        by_law = np.outer(slopes[2], self.entry[s])
        if len(self.latched[s]) and slider is None:
            by_law += laws.by_latched(law, acting.rows[s], inside, rate).T @ self.latched[s]
        by_law[:, self.own] += self._force_over_laws(s, acting, motion)
        if circle := self.system.contacts[s].circle:
            by_law[:, self.own] -= np.outer(slopes[0], np.sign(circle) * self.by.elements[s].clearance)
        found = linear(motion, slider, self.force(t, s, acting, motion), slopes[:2], by_law)
        if slider is not None:
            self._add_friction(t, s, acting, motion, slider, found)
        for one, normal, explicit in zip(found.slopes, found.normal, self._explicit(t, s), strict=True):
            found.other[..., self.own] += np.einsum("abk,bkd->akd", one, explicit)
            found.normal_other[:, self.own] += np.einsum("ak,akd->kd", normal, explicit)
        return found

    def _add_friction(
        self, t: Array, s: int, acting: Acting, motion: ElementMotion, slider: Slider, found: Linear
    ) -> None:
        """Add the changes of F_t at fixed motion and N, by the slider's place and by the parameters."""
        normal, stretch = self.force(t, s, acting, motion), slider.stretch(motion.xi)
        stiffness = slider.numbers[STIFFNESS] if slider.sticks else 0.0
        found.other[...] -= stiffness * motion.xi_slopes[..., None] * self.latched[s][1]
        one, contact = self.by.elements[s], self.system.contacts[s]
        changed = np.outer(slider.friction_by_mu(normal), one.mu)
        if slider.sticks:
            changed = np.outer(stretch, one.stiffness) + stiffness * np.outer(
                np.broadcast_to(t, stretch.shape), one.surface
            )
        if contact.circle:
            turns = (stretch - (motion.xi - slider.numbers[SLIDER])) / contact.gap
            changed = changed + stiffness * np.outer(motion.angle + turns, one.clearance)
            lengthened = np.outer(slider.force(motion.xi, normal), one.clearance / contact.gap)
            found.other[:2, :, self.own] += lengthened * motion.xi_slopes[:2, :, None]
        found.other[..., self.own] += changed * motion.xi_slopes[..., None]

    def at_instant(self, t: float, s: int, acting: Acting) -> tuple[float, float, Array]:
        """N, dN/dt and dN (m,) at fixed time of an element that acts."""
        times = np.array([t])
        change, moved_rows = self.force_change(times, s, acting), self.read[s] @ self.y
        slopes, _ = self._slopes(t, s, acting)
        changed = change.normal_other[0] + np.einsum("dak,dac->c", change.normal, moved_rows)
        return float(self.force(times, s, acting)[0]), float(slopes @ self.rates(t, s, acting)), changed

    def _slopes(self, t: float, s: int, acting: Acting) -> tuple[Array, tuple[Array, Array]]:
        """N_δ and N_δ̇ of an element that acts, and the δ and δ̇ that its law is given."""
        inside = self._inside(s, acting, self.motion_of(t, s))
        law: Any = self.system.contacts[s].law
        return laws.slopes(law, acting.rows[s], inside, acting.entry_rate[s])[:2, 0], inside

    def size_of_force(self, t: float, s: int, acting: Acting) -> float:
        """What the terms of N add up to, N."""
        slopes, inside = self._slopes(t, s, acting)
        return float(sum(abs(slope * np.ravel(part)[0]) for slope, part in zip(slopes, inside, strict=True)))

    def fly(self, start: float, end: float, samples: Array) -> Array:
        """Move over a flight that parameters do not drive; derivatives by the parameters at samples, (q, 2n, d)."""
        found = moved(self.k, self.c, propagator(self.k, self.c, samples - start), self.y[:, None, self.own])
        self.y = moved(self.k, self.c, propagator(self.k, self.c, np.asarray(end - start)), self.y)
        return np.moveaxis(found, 0, 1)

    def pass_flight(self, panels: Panels, acting: Acting, samples: Array) -> Array:
        """The same where the parameters drive the motion, too."""
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

    def pass_panels(
        self, panels: Panels, acting: Acting, samples: Array
    ) -> tuple[Array, dict[int, tuple[Array, Array]]]:
        """Move over panels in which elements act; derivatives at samples (q, 2n, d), and changes of forces.

        These are at the nodes, of N (P, S, columns) and of the forces on the rows (P, m, S, columns).

        f = A y + B with y at the start of a panel; y ← E y + K f + drive at its end.
        """
        count, size, own = len(panels), 2 * len(self.k), self.own
        drive, pushes = self._drive(panels.times, acting), [push for s in acting.elements for push in self.push[s]]
        (by_state, forces), normals = self._forces(panels, acting, drive, pushes)
        starts = self._pass(panels, by_state, forces, normals, drive, pushes)
        forces, changes, first = forces.reshape(count, len(pushes), S, -1), {}, 0
        for s, normal in zip(acting.elements, normals, strict=True):
            mine = forces[:, first : first + len(self.rows[s])]
            first += len(self.rows[s])
            changes[s] = mine[:, 0] if normal is None else normal[1], mine
            self.impulse[s] += np.tensordot(panels.weights, changes[s][0], 2)
        if not samples.size:
            return np.zeros((0, size, len(self.by))), changes
        rates = np.tensordot(np.transpose(pushes), forces[..., own], (1, 1))
        rates = rates if drive is None else rates + drive
        return panels.within(panels.free(starts) + panels.at_nodes(rates), samples), changes

    def _pass(
        self, panels: Panels, by_state: Array, forces: Array, normals: Any, drive: Array | None, pushes: list[Array]
    ) -> Array:
        """Move over panels one after the other; the states (2n, P, d) at their starts by the parameters.

        Adds what the state at the start of a panel does to all forces and to those N that are given beside it.
        """
        reach = np.concatenate([panels.reach(push) for push in pushes], axis=2)
        given = None if drive is None else panels.at_ends(drive)
        (a, b), n, own = (one.T[..., None] for one in panels.across()), len(self.k), self.own
        from_p, from_v = self.k[:, None] * b, a - self.c[:, None] * b
        starts = np.empty((2 * n, len(panels), len(self.by)))
        for i, (to_end, force) in enumerate(zip(reach, forces, strict=True)):
            p, v = self.y[:n], self.y[n:]
            starts[:, i] = self.y[:, own]
            force += by_state[i] @ self.y
            for by_start, normal in (one for one in normals if one is not None):
                normal[i] += by_start[i] @ self.y
            self.y = to_end @ force
            self.y[:n] += a[i] * p + b[i] * v
            self.y[n:] += from_v[i] * v - from_p[i] * p
            if given is not None:
                self.y[:, own] += given[:, i]
        return starts

    def _forces(self, panels: Panels, acting: Acting, drive: Array | None, pushes: list[Array]) -> Any:
        """Changes of all R forces on rows at the nodes by the state at a panel's start (P, R S, 2n), and by the rest.

        Likewise those of N of each element; None if it is the force on its only row.
        """
        count, size, total = len(panels), 2 * len(self.k), len(pushes)
        driven = None if drive is None else panels.at_nodes(drive)
        by_state, other = np.zeros((count, total, S, size)), np.zeros((count, total, S, self.columns))
        left: Array = np.zeros((count, total, S, total, S))
        known, first = [], 0
        for s in acting.elements:
            change, reads = self.force_change(panels.times.ravel(), s, acting), self.read[s]
            m = reads.shape[1]
            rows, slopes = slice(first, first + m), change.slopes.reshape(2, m, m, count, S)
            seen = np.array([[panels.seen(row) for row in pair] for pair in reads])  # (2, m, P, S, 2n)
            answer = np.array([[[panels.response(row, push) for push in pushes] for row in pair] for pair in reads])
            by_state[:, rows] = np.einsum("dabps,dbpsn->pasn", slopes, seen)
            other[:, rows] = np.moveaxis(change.other.reshape(m, count, S, -1), 0, 1)
            moved_rows = None if driven is None else np.tensordot(reads, driven, 1)
            if moved_rows is not None:
                other[:, rows, :, self.own] += np.einsum("dabps,dbpsc->pasc", slopes, moved_rows)
            left[:, rows] -= np.einsum("dabps,dbrpsj->pasrj", slopes, answer)
            known.append((change, seen, answer, moved_rows))
            first += m
        left = left.reshape(count, total * S, total * S) + np.eye(total * S)
        right = np.concatenate((by_state, other), axis=3).reshape(count, total * S, -1)
        solved = np.linalg.solve(left, right)
        found = solved[..., :size], solved[..., size:]
        return found, [None if one[0].slopes.shape[1] == 1 else self._normal(count, *one, found) for one in known]

    def _normal(
        self, count: int, change: Linear, seen: Array, answer: Array, moved_rows: Array | None, forces: Any
    ) -> tuple[Array, Array]:
        """Changes of N at the nodes (P, S, ...), by the state at the start of a panel and by the rest."""
        normal = change.normal.reshape(2, -1, count, S)
        pull = np.einsum("dbps,dbrpsj->psrj", normal, answer).reshape(count, S, -1)
        other = change.normal_other.reshape(count, S, -1) + pull @ forces[1]
        if moved_rows is not None:
            other[..., self.own] += np.einsum("dbps,dbpsc->psc", normal, moved_rows)
        return np.einsum("dbps,dbpsn->psn", normal, seen) + pull @ forces[0], other

    def _drive(self, t: Array, acting: Acting) -> Array | None:
        """Rates (2n, P, S, d) of the blocks by the parameters at times (P, S), at fixed state and forces, or None."""
        by, system = self.by, self.system
        if not (by.forced or by.turned):
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
        for s in acting.elements if by.turned else ():
            push += by.elements[s].rows.transpose(0, 2, 1) @ self.forces(times, s, acting)
        return np.moveaxis(system.push @ push, 0, -1).reshape(-1, *t.shape, len(by))


def _begun(places: list[int], law: Any) -> Array:
    """The latched numbers a law begins with."""
    return np.asarray(law.parameters)[places]


def begun_numbers(system: System, given: Sequence[Any] | None) -> list[Array]:
    """The latched numbers at the start: given ones, or those that laws begin with."""
    begin = [_begun(one.memory, one.law) for one in system.contacts]
    return begin if given is None else [one if own is None else own for one, own in zip(begin, given, strict=True)]


def latched_columns(system: System, by: Change, starts: Array, given: Sequence[Any] | None) -> list[Array]:
    """(l, m) derivatives of the latched numbers of every element at the start, those by the parameters from ``starts``.

    Given numbers are unknowns of the start; numbers that laws begin with depend on the parameters.
    """
    found, place, whole = [], 2 * system.size, len(starts)
    for s, contact in enumerate(system.contacts):
        places = contact.memory
        mine = slice(place, place + len(places))
        own = np.eye(whole, whole + len(by))[mine]
        own[:, whole:] = starts[mine]
        if places and (given is None or given[s] is None):
            own[:, whole:] += by.over_laws(s, partial(_begun, places))
        found.append(own)
        place = mine.stop
    return found
