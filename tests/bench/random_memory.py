"""Random systems with memory: `Exponential` against `DormandPrince`, thousands of them; prints every failure.

    python tests/bench/random_memory.py [count] [first seed] [processes]

A system has one to ten modes and one to four elements: sliders, dry friction with a static limit or without, Iwan's and
Bouc and Wen's hysteresis, yielding with hardening or without and yielding stops, alone or summed with one another and
with springs and dashpots, on coordinates of their own, on a shared one or between two, beside other stops; it is free,
or driven by tones, sampled noise, pulses and base motion, from a start at any place or one that is under way; see
`drawn_memory`. Seeds from 100 000 on have dashpots and laws of stops beside yielding stops and sliders, sums of several
laws with memory, laws of a user's own, full matrices, and starts far beyond limits, with other rates than those under
way, or with what another run has latched; see `drawn_wider`. Compared at rtol 1e-4 to 1e-10 are the motion, the log of
contacts, the transitions (which, when, at which place and force, after which work and impulse), work, stored energy,
loss, slip and impulse of every element and the energy balance. What a difference is worth is told as in
`comparison`, with three bounds besides, of what the motion itself does not determine better:

- Where the motion is off by e, a border with the margin b is met at a time off by |∂b/∂(δ, δ̇)| e / |db/dt|. After the
  motion has decayed, or where it grazes a border, this is long: times are compared in units of it (`patience`).
- Steps err by rtol of the largest rate of the run: a small contact late in a run is compared in units of the run
  (`widened`).
- Two transitions between which the motion goes beyond a border and back by less than e may be there or not, and so may
  those passed before an element has gone further than e from its start. They are left out of both runs only if the
  runs differ in them; e is the difference of the two motions (`without_pairs`, `still`).

Work, loss, slip and impulse of every element, and the energy balance, are also compared with quadratures over the same
run, sampled densely, of the method and of the reference; no passive law gives energy, and what a slider takes is its
limit times its slip (`memory_balance`).

Of every tenth system also the derivative of the end by the start is compared with differences of the reference, and
those free or under tones are run in two parts, the second from what the first has latched; of some also `Newmark` with
steps of two lengths. See `more_memory_checks`.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import numpy as np
from comparison import (
    ALLOWED,
    COARSER,
    REFERENCE,
    Verdict,
    against,
    cut_after_transitions,
    main,
    numbers_of,
    references,
    run,
    strictly,
)
from drawn import Scene
from drawn_memory import disturbed, draw
from memory_balance import Integrals, accounts, integrals, pace_of
from more_memory_checks import more_checks

from solvers import Exponential, integrate

MOST_TRANSITIONS = 40
VALVES = ("throttled", "relieved upwards", "relieved downwards")
BY_RATE = ("stick", "reversal", "unload", *VALVES)  # events at a certain δ̇, most at zero; others at a δ or force
BETWEEN = 1e-5 / ALLOWED  # rtol of the reference between its steps
WIDER = (1.5, 3.0, 6.0)  # a pair on one side of a bound in one run may be on the other side in the other, once


def reach(scene: Scene, motion: Any) -> Any:
    """(elements, 2) largest δ and δ̇ of every element that coordinates and rates as large as those given can make."""
    rows = np.abs([contact.direction for contact in scene.system.contacts]).sum(axis=1)
    return np.outer(rows, [np.abs(motion.q).max(), np.abs(motion.q_dot).max()])


def shown(rows: Any, duration: float, begin: Any, left_out: tuple[Any, bool] | None) -> Any:
    """Indices of the transitions to compare, in order of element, border and time.

    A start beyond borders passes them in any order, or within a shortest step. If the runs differ those that may be
    there or not are ``left_out``, by `still` and `without_pairs`: within how much, and whether the last two of three.
    """
    i = np.lexsort((rows.t, rows.border, rows.contact))
    i = i[rows.t[i] > 1e-7 * duration]
    if left_out is None:
        return i
    least, last = left_out
    i = i[~np.isin(i, still(rows, i, begin, least))]
    return without_pairs(rows, i[::-1], least)[::-1] if last else without_pairs(rows, i, least)


def still(rows: Any, shown: Any, begin: Any, least: Any) -> list[int]:
    """The transitions of elements that have not gone further than ``least`` from where they ``begin`` (elements, 2).

    The way there and back is at most half the time × the larger rate, as long as that changes steadily.
    """
    found, rests = [], np.ones(len(begin), dtype=bool)
    for i in sorted(shown, key=lambda one: rows.t[one]):
        c = int(rows.contact[i])
        way = 0.5 * rows.t[i] * max(abs(begin[c, 1]), abs(rows.delta_dot[i]))
        rests[c] &= max(way, abs(rows.delta[i] - begin[c, 0])) <= least[c, 0]
        if rests[c]:
            found.append(i)
    return found


def without_pairs(rows: Any, shown: Any, least: Any) -> Any:
    """The transitions but for pairs between which δ or δ̇ goes beyond a border by less than ``least`` (elements, 2).

    Beyond a border of δ̇ the element may be for so short that δ moves by less: what it latches then is no other.
    Of three in a row the first two are left out; if they are given in the order of falling time, the last two.
    """
    kept: list[int] = []
    for i in shown:
        if kept and rows.contact[kept[-1]] == rows.contact[i] and rows.border[kept[-1]] == rows.border[i]:
            j, k = sorted((kept[-1], i), key=lambda one: rows.t[one])
            by_rate = int(rows.event[j] in BY_RATE)
            apart, way = abs(rows.delta[k] - rows.delta[j]), np.inf
            if by_rate:  # the mean of a parabola between two zeros is 2/3 of its vertex
                fast = max(abs(rows.delta_dot[j]), abs(rows.delta_dot[k]))
                way = max(apart, 0.5 * (rows.t[k] - rows.t[j]) * fast)
                mean = (rows.delta[k] - rows.delta[j]) / max(rows.t[k] - rows.t[j], 1e-300)
                apart = max(1.5 * abs(mean - rows.delta_dot[j]), abs(rows.delta_dot[k] - rows.delta_dot[j]))
            if apart <= least[rows.contact[i], by_rate] or way <= least[rows.contact[i], 0]:
                kept.pop()
                continue
        kept.append(i)
    return np.array(kept, dtype=int)


def widened(found: dict[str, Any], scene: Scene, solution: Any, along: Integrals) -> None:
    """Put the numbers of contacts of laws with memory, which always act, in units of the whole run.

    A step's error is rtol of the largest rate that the element has had since the run began, so a small contact late in
    a run is off by (e_δ, e_v) of the whole: its ends by e_δ/δ̇, its peaks by e_δ and k e_δ, the impulse by k e_δ times
    its length, the loss by F e_δ; beside a damper c by c e_v more.
    """
    stops, scale = found["stop"], found["scale"]
    i = [s for s, stop in enumerate(stops) if scene.system.contacts[stop].always]
    if not i:
        return
    stop = np.asarray(stops, dtype=int)[i]
    delta, rate = reach(scene, solution)[stop].T
    steep = along.stiffness[stop] * delta + along.damping[stop] * rate
    length, force = scale["t_in"][i], scale["peak_force"][i]
    for name, fast in (("t_in", "speed_in"), ("t_out", "speed_out")):
        scale[name] = scale[name].copy()
        scale[name][i] = np.maximum(length, delta / np.maximum(np.nan_to_num(np.abs(found[fast][i])), 1e-300))
    wide = {"speed_in": rate, "speed_out": rate, "peak_indentation": delta, "peak_force": steep}
    wide |= {"impulse": steep * length, "energy_loss": force * delta}
    for name, value in wide.items():
        scale[name] = scale[name].copy()
        scale[name][i] = np.maximum(scale[name][i], value)


def numbers(
    solution: Any, scene: Scene, size: float, duration: float, patience: Any, along: Integrals, left_out: Any = None
) -> dict[str, Any]:
    """What `numbers_of` compares, with losses, and with transitions, element by element and border by border.

    The force of an element that opens grows from zero: it is off by as much as δ and δ̇ are times the law's slopes, also
    where the contact is but as deep as that.
    """
    found, rows = numbers_of(solution, scene, size, duration), solution.transitions
    way, fast = reach(scene, solution).T
    widened(found, scene, solution, along)
    taken(found, solution.losses, along, way, duration)
    contacts = scene.system.contacts
    begin = np.array([c.motion(scene.q0, scene.q_dot0)[:2] for c in contacts], dtype=float)
    i = shown(rows, duration, begin, left_out)
    contact = rows.contact[i].astype(int)
    found["order"] = [
        *found["order"],
        *zip(contact.tolist(), rows.border[i].tolist(), rows.event[i].tolist(), strict=True),
    ]
    values = {"t": rows.t[i], "delta": rows.delta[i], "force": rows.force[i]}
    values |= {"work": rows.work[i], "impulse": rows.impulse[i]}
    opens = [getattr(c.law, "opens", False) for c in contacts]
    steep = np.where(opens, along.stiffness * way + along.damping * fast, along.force)
    largest = {
        "delta": way,
        "force": np.maximum(steep, along.force),
        "work": along.force * way,
        "impulse": along.force * duration,
    }
    spacing = duration / (1.0 + np.bincount(contact, minlength=len(contacts)))
    for name, row in values.items():
        found[f"border {name}"] = row
        scale = (spacing if name == "t" else largest[name])[contact]
        if name == "t" and len(patience) == len(rows):
            scale = np.maximum(scale, patience[i])
        found["scale"][f"border {name}"] = np.maximum(scale, 1e-300)
    return found


def taken(found: dict[str, Any], losses: Any, along: Integrals, way: Any, duration: float) -> None:
    """Put in what the elements have taken, in units of force × reach of the motion; an impulse of force × time."""
    force = np.maximum(along.force, np.finfo(float).eps * along.force.max() + 1e-300)  # what rests has rounding's
    work, impulse = force * way, force * duration
    units = {"work": work, "stored": work, "loss": work, "slip": way}
    for name, unit in units.items():
        found[f"losses {name}"], found["scale"][f"losses {name}"] = getattr(losses, name), unit
    found["losses impulse"], found["scale"]["losses impulse"] = losses.impulses[-1], impulse


def patience(scene: Scene, reference: Any) -> Any:
    """(transitions,) s by which each is off where the motion is off by as much as its own largest value.

    A border at δ̇ = 0 has the rate δ̈, one at a δ or a force the rate δ̇; with a damper c beside the spring k of what
    sticks it is (k δ̇ + c δ̈)/k, and what the motion is off by counts with (1, c/k).
    """
    rows = reference.transitions
    c = rows.contact.astype(int)
    size, faster = reach(scene, reference)[c], accelerations(scene, rows)
    by_rate = np.isin(rows.event, BY_RATE)
    share = np.array([_damping_share(scene.system.contacts[s].law) for s in c])  # c/k, s
    pace = np.where(by_rate, np.abs(faster), np.abs(rows.delta_dot + share * faster))
    return np.where(by_rate, size[:, 1], size[:, 0] + share * size[:, 1]) / np.maximum(pace, 1e-300)


def accelerations(scene: Scene, rows: Any) -> Any:
    """δ̈ just before every transition, by the difference of δ̇ at two instants between the one before and it."""
    at = np.unique(rows.t[rows.t > 0.0])
    at = at[np.diff(at, prepend=0.0) > 1e-9 * scene.duration]  # of those closer together the first
    if not len(at):
        return np.zeros(len(rows))
    before = np.diff(at, prepend=0.0)
    times = np.stack((at - 2e-3 * before, at - 1e-3 * before), axis=1)
    given = scene.system, scene.q0, scene.q_dot0, scene.duration, times.ravel(), COARSER
    motion = integrate(*given, memory=scene.memory)
    gained = np.diff(motion.q_dot.reshape(len(at), 2, -1), axis=1)[:, 0] / (1e-3 * before[:, None])
    place = np.maximum(np.searchsorted(at, rows.t, side="right") - 1, 0)
    directions = np.array([contact.direction for contact in scene.system.contacts])
    return -np.einsum("ij,ij->i", directions[rows.contact.astype(int)], gained[place])


def _damping_share(law: Any) -> float:
    """Damping by stiffness of a slider that sticks, the largest of a sum; 0 of other laws."""
    parts = getattr(law, "parts", (law,))
    return max(float(part.damping / part.stiffness) if hasattr(part, "static_limit") else 0.0 for part in parts)


def judged(scene: Scene, rtol: float, seed: int, known: Any) -> Verdict:
    """How the method does on a system of known references."""
    if known[0] is None:
        return against(scene, *known, rtol, seed)
    along = integrals(scene, REFERENCE, known[0], pace_of(scene))
    look = partial(numbers, patience=patience(scene, known[0]), along=along)
    verdict = against(scene, *known, rtol, seed, look, disturbed)
    if not verdict.kind.startswith("events"):
        return verdict
    ours = run(scene, Exponential(rtol))
    apart = reach(scene, type("Apart", (), {"q": ours.q - known[0].q, "q_dot": ours.q_dot - known[0].q_dot}))
    for wider, last in product(WIDER, (False, True)):
        again = against(scene, *known, rtol, seed, partial(look, left_out=(wider * apart, last)), disturbed)
        if again.kind in ("fine", "ill-conditioned"):
            return again
        if not again.kind.startswith("events"):
            verdict = again
    return verdict


def judge(seed: int) -> tuple[str, Verdict]:
    """Draw, run and compare."""
    with strictly():
        try:
            scene, rtol = draw(seed)  # runs what it draws to learn how far it moves
        except ValueError as error:
            if "cannot be separated" not in str(error):
                raise
            return f"seed {seed}: {error}", Verdict("the reference failed")
        known = references(scene, lambda scene: cut_after_transitions(scene, MOST_TRANSITIONS))[:2]
        verdict = judged(scene, rtol, seed, known)
        if verdict.kind in ("fine", "ill-conditioned") and known[0] is not None:
            size = reach(scene, known[0])
            methods = (Exponential(rtol), rtol), (REFERENCE, BETWEEN)
            wrong = [words for method, off in methods if (words := accounts(scene, method, off, size))]
            verdict.kind = "; ".join(wrong) or verdict.kind
        if verdict.kind == "fine":
            verdict.kind = more_checks(scene, rtol, seed, known[0]) or "fine"
        return f"seed {seed}: {scene.words}", verdict


if __name__ == "__main__":
    main(judge)
