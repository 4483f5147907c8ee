"""Random systems with friction: `Exponential` against `DormandPrince`, thousands of them; prints every failure.

    python tests/bench/random_friction.py [count] [first seed] [processes]

A system has one to four modes in each of two planes, and perhaps a rotation; one to three elements: holes and posts
without and with friction, with a rotation or a spin, oblique stops with friction, stops on a line, springs and sliders
beside them; it is free or under loads of every kind, from a start in the open, pressed, under way or at rest; see
`drawn_friction`. Compared at rtol 1e-5 to 1e-11 are the motion, the logs of contacts and of friction, the transitions
(which, when, at which ξ, ξ̇ and F_t), every line of the energy balance and what each element has taken, of runs with
samples and without. What a difference is worth is told as in `comparison`. Runs in which the spring of friction in
a circle is drawn by half a turn must be refused by both methods.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from comparison import (
    Verdict,
    against,
    cut_after_contacts,
    cut_after_transitions,
    handled,
    main,
    numbers_of,
    references,
    rounding_of_surfaces,
    significant,
    strictly,
)
from drawn import Scene
from drawn_friction import draw
from drawn_memory import disturbed

MOST_TRANSITIONS = 30
LEAST_FORCE = 1e-11  # of a contact's largest force: rounding of the margin N
HALF_A_TURN = "drawn by half a turn"  # of a spring of friction in a circle: runs are refused, by all methods
TINY = 1e-300


def units(scene: Scene, solution: Any) -> dict[str, Any]:
    """(elements,) sizes in a run: way and speed of ξ, force of friction, time of a contact; of others of δ and F."""
    size, fast = np.abs(solution.q).max(axis=0), np.abs(solution.q_dot).max(axis=0)
    way, speed = (np.array([(np.abs(c.rows) @ x).sum() for c in scene.system.contacts]) for x in (size, fast))
    count, log = len(scene.system.contacts), solution.contacts
    speed += [abs(c.spin * (c.radius or 0.0)) for c in scene.system.contacts]
    force, time = np.zeros(count), np.zeros(count)
    np.maximum.at(force, log.stop, np.abs(log.peak_force))
    np.maximum.at(force, solution.transitions.contact, np.abs(solution.transitions.force))
    end = np.where(np.isnan(log.t_out), scene.duration, log.t_out)
    np.maximum.at(time, log.stop, end - log.t_in)
    spacing = scene.duration / (1.0 + np.bincount(solution.transitions.contact.astype(int), minlength=count))
    time = np.where(time > 0.0, np.minimum(time, spacing), spacing)
    return {"way": way, "speed": speed, "force": force + TINY, "time": time}


def turned(scene: Scene, contact: Any, way: Any) -> Any:
    """ξ as a cosine and a sine of a turn each, which do not jump, in units of ξ; of other elements as it is."""
    circle = np.array([abs(c.circle) for c in scene.system.contacts])[contact]
    safe = np.where(circle > 0.0, circle, 1.0)
    x, y = (circle * f(way / safe) for f in (np.cos, np.sin))
    return np.where(circle > 0.0, x, way), np.where(circle > 0.0, y, 0.0)


def numbers(solution: Any, scene: Scene, size: float, duration: float) -> dict[str, Any]:
    """What `numbers_of` compares, with friction, transitions, losses and the energy balance."""
    found, unit = numbers_of(solution, scene, size, duration), units(scene, solution)
    of_friction(found, solution, scene, size, unit)
    of_transitions(found, solution, scene, unit)
    total, energy, lost = handled(solution), solution.energy, solution.losses
    for name in ("input", "damping", "contact", "stored", "friction", "spin"):
        put(found, f"energy {name}", np.atleast_1d(getattr(energy, name))[-1:], np.array([total]))
    for name in ("work", "friction", "spin"):
        put(found, f"losses {name}", np.broadcast_to(getattr(lost, name), unit["way"].shape), total)
    return found


def put(found: dict[str, Any], name: str, values: Any, scale: Any) -> None:
    """Compare these in units of the scale."""
    found[name], found["scale"][name] = np.asarray(values), np.maximum(scale, TINY) + np.zeros(np.shape(values))


def of_friction(found: dict[str, Any], solution: Any, scene: Scene, size: float, unit: dict[str, Any]) -> None:
    """Put in the log of friction, contact by contact."""
    log, deep = solution.friction, solution.contacts
    shown = significant(solution, size)
    real = set(zip(deep.stop[shown].tolist(), deep.t_in[shown].tolist(), strict=True))
    i = np.lexsort((log.t_in, log.contact))
    i = np.array([k for k in i if (int(log.contact[k]), float(log.t_in[k])) in real], dtype=int)
    c = log.contact[i].astype(int)
    found["order"] = [*found["order"], *(("rubs", int(one)) for one in c)]
    for name in ("angle_in", "angle_out"):
        angle = getattr(log, name)[i]
        put(found, f"friction {name} cos", np.cos(angle), 1.0)
        put(found, f"friction {name} sin", np.sin(angle), 1.0)
    mu = np.array([one.friction.mu if one.friction else 0.0 for one in scene.system.contacts])[c]
    force = np.maximum(mu, 1e-3) * unit["force"][c]
    scales = {"speed_in": unit["speed"][c], "speed_out": unit["speed"][c], "peak_friction": force}
    scales |= {"impulse": force * unit["time"][c], "slip": unit["way"][c], "energy_loss": force * unit["way"][c]}
    for name, scale in scales.items():
        put(found, f"friction {name}", getattr(log, name)[i], scale)


def at_openings(solution: Any, scene: Scene) -> Any:
    """(transitions,) whether a contact opens within its rounding, then or just after.

    A slip back under N = k δ^p, which falls at the rate Ṅ = p k δ^{p-1} δ̇, ends where μ|Ṅ| = k_t |ξ̇|: at the depth
    δ = (k_t |ξ̇| / μ p k |δ̇|)^{1/(p-1)}, which may be any power of ten: 1e-17 m where p = 1.2 and the base is 4e-4. δ is
    known to the rounding ε of what it is read from, and the opening to ε/|δ̇|: what is nearer to it may as well not be.
    Nor is N told from zero, and a slip from a free slider, where it is `LEAST_FORCE` of its peak.
    """
    rows, log = solution.transitions, solution.contacts
    spread = rounding_of_surfaces(scene)[log.stop.astype(int)] / np.maximum(np.abs(log.speed_out), TINY)
    apart = np.abs(rows.t[:, None] - log.t_out)  # NaN of a contact that is still closed
    close = apart <= spread + 4e-16 * scene.duration
    for i, j in zip(*np.nonzero(apart < 1e-6 * (log.t_out - log.t_in)), strict=True):
        law, speed = scene.system.contacts[int(log.stop[j])].law, log.speed_out[j]
        normal = law.force(speed * apart[i, j], -speed, max(log.speed_in[j], law.entry_rate_floor))
        close[i, j] |= abs(float(normal)) <= LEAST_FORCE * log.peak_force[j]
    return np.any((rows.contact[:, None] == log.stop) & close, axis=1)


def of_transitions(found: dict[str, Any], solution: Any, scene: Scene, unit: dict[str, Any]) -> None:
    """Put in the transitions, element by element."""
    rows = solution.transitions
    i = np.lexsort((rows.t, rows.border, rows.contact))
    i = i[(rows.t[i] > 1e-7 * scene.duration) & ~at_openings(solution, scene)[i]]
    c = rows.contact[i].astype(int)
    found["order"] = [*found["order"], *zip(c.tolist(), rows.border[i].tolist(), rows.event[i].tolist(), strict=True)]
    along, across = turned(scene, c, rows.delta[i])
    put(found, "border t", rows.t[i], unit["time"][c])
    put(found, "border ξ cos", along, unit["way"][c])
    put(found, "border ξ sin", across, unit["way"][c])
    put(found, "border ξ̇", rows.delta_dot[i], unit["speed"][c])
    put(found, "border F_t", rows.force[i], unit["force"][c])


def judge(seed: int) -> tuple[str, Verdict]:
    """Draw, run and compare."""
    with strictly():
        scene, rtol = draw(seed)
        theirs, again, why = references(
            scene, lambda scene: cut_after_transitions(cut_after_contacts(scene, seed), MOST_TRANSITIONS)
        )
        verdict = against(scene, theirs, again, rtol, seed, numbers, disturbed)
        if HALF_A_TURN in verdict.kind and HALF_A_TURN in why:
            verdict.kind = "refused by both"
        return f"seed {seed}: {scene.words}", verdict


if __name__ == "__main__":
    main(judge)
