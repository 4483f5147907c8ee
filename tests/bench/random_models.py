"""Random scenes as users build them: every number a user reads, against a second implementation.

    python tests/bench/random_models.py [count] [first seed] [depth] [processes]

A scene is drawn from its seed (`drawn_models`): beams, supports, masses, springs, dashpots, stops, elements, impactors,
a second beam, loads and base motion, damping, reduction, start, output. ``depth`` 0 is a clamped beam with a stop and a
tone, 1 adds beams, supports and laws, 2 loads, reductions and starts, 3 elements, rotations and impactors, 4 a second
beam. `finite_elements`, `second_signals` and `second_motion` compute the same from the equations in `docs`, on the same
nodes; frequencies are compared with those of a finer mesh, too.

What a difference is worth is told by the scene: the second implementation is run again less accurately, from a moved
start, and read with its states moved. A number may differ by rtol × its amplification (times ALLOWED), by what the
reference itself is off, and by what rounding of K (eps times the ratio of largest to lowest eigenvalue) does to it.
Scenes so chaotic that displacements amplify 1e5 times, or whose contacts come and go, are counted, not compared.
"""

from __future__ import annotations

import math
import sys
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from comparison import judged, told_apart
from drawn_models import Drawer, Drawn
from finite_elements import Whole
from model_numbers import PROBES, Numbers, own_numbers, same_start, their_numbers
from model_tables import scene_of
from more_model_checks import more_checks
from second_motion import Acting, Motion, TooManyError
from second_signals import breaks, signal

import fembeam as fb
from reduction import AccuracyError
from solvers import Exponential, SolverError

ALLOWED = 300.0
WORST_ROUNDING = 1e-5  # of the lowest frequency in the second implementation: two places very near each other
MOVE = 1e-7  # of the start, relative


def second(drawn: Drawn, model: fb.Model) -> tuple[Whole, Any, list[str]]:
    """The second implementation of a model on its nodes, its start, and where its loads break."""
    whole = Whole(drawn.tables, [beam.nodes for beam in model.matrices.beams], drawn.how)
    tables = [table for _, table in whole.loads] + ([drawn.tables["base"]] if "base" in drawn.tables else [])
    return whole, [t for table in tables for t in breaks(table)]


def integrated(drawn: Drawn, whole: Whole, kinks: list[float], start: Any, rtol: float, move: Any = 0.0) -> Motion:
    """A run of the second implementation."""
    V = whole.vectors
    acting = [Acting(law, gap, V.T @ w, always) for w, gap, law, always in whole.contacts]
    loads, signals = [row @ V for row, _ in whole.loads], [signal(table) for _, table in whole.loads]
    if "base" in drawn.tables:
        loads, signals = [*loads, -whole.gamma], [*signals, signal(drawn.tables["base"], 2)]
    if "gravity" in drawn.tables:
        loads, signals = [*loads, -whole.gamma], [*signals, lambda t: drawn.tables["gravity"]]
    motion = Motion(whole.omega, whole.C, np.array(loads), signals, acting)
    q, u = start
    mass = math.sqrt(float(np.trace(whole.M[::2, ::2])))
    scale = np.array(drawn.sizes) * mass
    return motion.run(q + move * scale[0], u + move * scale[1], drawn.duration, kinks, rtol, 0.01 * scale)


def worst(ours: dict[str, Any], exact: Numbers, allowed: dict[str, Any]) -> list[str]:
    """The numbers that differ by more than allowed, in words."""
    found = [f"{name} {'missing' if name not in ours else 'unknown'}" for name in exact.keys() ^ ours.keys()]
    for name in exact.keys() & ours.keys():
        a, (b, size) = ours[name], exact[name]
        if np.shape(a) != np.shape(b):
            found.append(f"{name} has {np.shape(a)} instead of {np.shape(b)}")
            continue
        apart = apart_of(a, b, size)
        if not np.all(apart <= allowed[name]):
            found.append(f"{name} {np.max(apart / allowed[name]):.3g} times what is allowed, {np.max(apart):.2g}")
    return sorted(found)


def apart_of(a: Any, b: Any, size: Any) -> Any:
    """Differences in units of a size; both NaN is none, one of them infinitely many."""
    apart = np.abs(np.subtract(a, b, dtype=float)) / np.maximum(size, 1e-300)
    return np.where(np.isnan(a) & np.isnan(b), 0.0, np.where(np.isnan(apart), math.inf, apart))


def allowances(
    exact: Numbers, coarse: Numbers, moved: Numbers, shifted: Numbers, drawn: Drawn, rounding: float
) -> dict[str, Any] | None:
    """What every number may be off, relative to its size; None where contacts come or go, or all is chaos."""
    found = {}
    for name, (b, size) in exact.items():
        if np.shape(coarse[name][0]) != np.shape(b) or np.shape(moved[name][0]) != np.shape(b):
            return None
        doubt, change = (apart_of(other[name][0], b, size) for other in (coarse, moved))
        if not np.all(np.isfinite(change)) or not np.all(np.isfinite(doubt)):
            return None
        change = max(change.max(initial=0.0), apart_of(shifted[name][0], b, size).max(initial=0.0))
        amplification = max(1.0, change / MOVE)
        if amplification > 1e5 and name.startswith("displacement"):
            return None
        found[name] = (ALLOWED * drawn.rtol + 1e-11 + 30 * rounding) * amplification + doubt.max(initial=0.0)
    return found


def judge(seed: int, depth: int = 4, part: float = 1.0) -> tuple[str, list[str], int]:
    """Draw, run a part of its duration, compare: what was drawn, what differs, how many contacts there were."""
    drawn = Drawer(seed, depth).draw()
    drawn.duration, drawn.dt, drawn.brief = part * drawn.duration, drawn.dt and part * drawn.dt, part < 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            model = scene_of(drawn.tables).reduce(**drawn.how)
        except (ValueError, AccuracyError) as error:
            return told(drawn, seed), [f"refused: {error}"], 0
        return told(drawn, seed), *compared(drawn, model, seed)


def told(drawn: Drawn, seed: int) -> str:
    """A scene in words."""
    parts = [
        f"{k}: {[x.get('kind', x.get('law', {}).get('kind', '')) for x in v] if isinstance(v, list) else ''}"
        for k, v in drawn.tables.items()
    ]
    return f"seed {seed}: {', '.join(parts)}; {drawn.how} rtol {drawn.rtol:g} dt {drawn.dt} start {drawn.start}"


def start_of(drawn: Drawn, model: fb.Model, seed: int) -> Any:
    """Rest, a moving start, or static equilibrium under a load."""
    if drawn.start == "moving":
        rng = np.random.default_rng(seed)
        start = model.rest()
        n = len(model.omega) - len(model.matrices.impactors)
        tip = np.abs(model.phi(np.array(PROBES) * model.shapes.nodes[-1])).max()
        start[:n] += 0.3 * drawn.sizes[0] / tip * rng.uniform(-1, 1, n) / np.arange(1, n + 1) ** 2
        start[len(model.omega) : len(model.omega) + n] += (
            0.3 * drawn.sizes[1] / tip * rng.uniform(-1, 1, n) / np.arange(1, n + 1)
        )
        return start
    remembering = any(one.remembers for one in model.contact_rows)
    if drawn.start == "equilibrium" and model.omega.min() > 0 and not remembering:
        mass = model.moving_mass
        return model.equilibrium({0.77 * model.shapes.nodes[-1]: 0.5 * mass * model.omega[0] ** 2 * drawn.sizes[0]})
    return model.rest()


def compared(drawn: Drawn, model: fb.Model, seed: int) -> tuple[list[str], int]:
    """What differs, and how many contacts were compared."""
    whole, kinks = second(drawn, model)
    lowest = [part.free_modes()[0] for part in whole.parts]
    rounding = 1e-16 * max(squares[-1] / squares[0] for squares in lowest)
    if rounding > WORST_ROUNDING:
        return ["the reference failed"], 0
    start = start_of(drawn, model, seed)
    try:
        run = model.simulate(drawn.duration, drawn.dt, start, Exponential(drawn.rtol))
        run = replace(run, sampled=True)  # without samples its end is compared
    except (SolverError, ValueError) as error:
        return [f"{'refused' if isinstance(error, ValueError) else 'failed'}: {error}"], 0
    own_start = same_start(whole, model, start)
    sign = np.random.default_rng([seed, 7]).choice([-1.0, 1.0], len(whole.omega))
    runs = ((1e-12, 0.0), (1e-10, 0.0), (1e-11, MOVE * sign))
    try:
        motions = [integrated(drawn, whole, kinks, own_start, rtol, move) for rtol, move in runs]
    except TooManyError:
        return ["the reference failed"], 0
    found = [own_numbers(drawn, whole, motion, run.t) for motion in motions]
    found.append(own_numbers(drawn, whole, motions[0], run.t, MOVE * np.concatenate([sign, sign[::-1]])))
    more = more_checks(drawn, model, whole, run, start, rounding)
    allowed = allowances(*found, drawn, rounding)
    if allowed is None:
        return [*more, *(["ill-conditioned"] if not more else [])], 0
    return more + worst(their_numbers(drawn, run), found[0], allowed), len(run.contacts)


def main(count: int = 100, first: int = 0, depth: int = 4, processes: int = 1) -> int:
    """Run and print; returns the number of scenes that differ."""
    return told_apart(judged(judge, count, first, processes, depth), f"{count} scenes of depth {depth}")


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:])) > 0)
