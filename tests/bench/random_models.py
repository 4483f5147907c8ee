"""Random scenes as users build them: every number a user reads, against a second implementation.

    python tests/bench/random_models.py [count] [first seed] [depth] [processes]

A scene is drawn from its seed (`drawn_models`): beams, supports, masses, springs, dashpots, stops, elements, impactors,
a second beam, loads and base motion, damping, reduction, start, output. ``depth`` 0 is a clamped beam with a stop and a
tone, 1 adds beams, supports and laws, 2 loads, reductions and starts, 3 elements, rotations and impactors, 4 a second beam.
`finite_elements`, `second_signals` and `second_motion` compute the same from the equations in `docs`, on the same nodes.

What a difference is worth is told by the scene: the second implementation is run again less accurately, and from a moved
start. A number may differ by rtol × its amplification (times ALLOWED), by what the reference itself is off, and by
what rounding of K (eps times the ratio of largest to lowest eigenvalue) does to frequencies.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from drawn_models import Drawer, Drawn, scene_of
from finite_elements import Whole
from more_model_checks import more_checks
from second_motion import Acting, Motion, TooManyError
from second_signals import breaks, signal

import fembeam as fb
from solvers import Exponential, SolverError

ALLOWED = 300.0
MOVE = 1e-7  # of the start, relative
LOG = ("t_in", "t_out", "speed_in", "speed_out", "peak_indentation", "peak_force", "impulse", "energy_loss")
PROBES = (0.0, 0.137, 0.5, 0.731, 1.0)  # of the length: at nodes and between
Numbers = dict[str, tuple[Any, Any]]  # values and the size they are compared with


def second(drawn: Drawn, model: fb.Model) -> tuple[Whole, Any, list[str]]:
    """The second implementation of a model on its nodes, its start, and where its loads break."""
    whole = Whole(drawn.tables, [beam.nodes for beam in model.matrices.beams], drawn.how)
    tables = [table for _, table in whole.loads] + ([drawn.tables["base"]] if "base" in drawn.tables else [])
    return whole, [t for table in tables for t in breaks(table)]


def same_start(whole: Whole, model: fb.Model, start: Any) -> tuple[Any, Any]:
    """A start of the model in the coordinates of the second implementation, by its fields."""
    found = []
    for q in np.split(np.asarray(start)[: 2 * len(model.omega)], 2):
        fields = []
        for body, part in enumerate(whole.parts):
            both = [model.phi(part.nodes, order, body) @ q for order in (0, 1)]
            fields.append(np.stack(both, axis=1).ravel())
        extra = len(whole.impactors)
        full = np.concatenate([*fields, q[len(q) - extra :] / np.sqrt([one["mass"] for one in whole.impactors])])
        found.append(whole.vectors.T @ whole.M @ full)
    return found[0], found[1]


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


def own_numbers(drawn: Drawn, whole: Whole, motion: Motion, t: Any, shift: Any = 0.0) -> Numbers:
    """What `their_numbers` reads off a run, from the second implementation; states moved by a part of their size."""
    n, m = motion.n, motion.m
    y, F = motion.at(t, shift)
    q, u = y[:, :n], y[:, n : 2 * n]
    load = np.array([motion.load(x) for x in t])
    a = load - u @ whole.C.T - whole.omega**2 * q + F @ motion.W
    found: Numbers = {}
    base = [np.array([signal(drawn.tables["base"], k)(x) for x in t]) for k in range(3)] if "base" in drawn.tables else [np.zeros(len(t))] * 3
    for body, part in enumerate(whole.parts):
        places = np.array(PROBES) * part.nodes[-1]
        phi = np.array([whole.phi(z, 0, body) for z in places])
        for name, x, y_base in zip(("displacement", "velocity", "acceleration"), (q, u, a), base, strict=True):
            found |= {f"{name} {body}": sized(x @ phi.T), f"absolute {name} {body}": sized(x @ phi.T + y_base[:, None])}
        found[f"slope {body}"] = sized(q @ np.array([whole.phi(z, 1, body) for z in places]).T)
    d = (-motion.W @ q.T).T - motion.gaps
    for i in range(m):
        found |= {f"indentation {i}": sized(d[:, i], drawn.sizes[0] * 0.01), f"force {i}": sized(F[:, i])}
    work = y[:, 2 * n : 2 * n + 2 + m]
    stored = 0.5 * np.sum(u**2 + (whole.omega * q) ** 2, axis=1)
    handled = np.abs(work).max() + stored.max()
    ledger = {"input": work[:, 0], "damping": work[:, 1], "contact": work[:, 2:].sum(axis=1), "stored": stored}
    ledger = ledger if drawn.dt else {"stored": stored}
    found |= {f"energy {name}": (x, handled) for name, x in ledger.items()}
    if m:
        found["losses work"] = (motion.end[2 * n + 2 : 2 * n + 2 + m], handled)
        found["losses history"] = (work[:, 2:], handled)
        found["impulses"] = sized(y[:, 2 * n + 2 + m : 2 * n + 2 + 2 * m])
    found |= reactions(drawn, whole, q, u, a, F, base[2], t)
    return found | logged(motion.log)


def sized(values: Any, least: float = 0.0) -> tuple[Any, Any]:
    """Values and their largest size."""
    return values, max(float(np.abs(values).max(initial=0.0)), least)


def logged(rows: list[dict[str, float]]) -> Numbers:
    """The log in order of stop and time, each contact in its own units."""
    rows = sorted(rows, key=lambda one: (one["stop"], one["t_in"]))
    c = {name: np.array([one[name] for one in rows]) for name in ("stop", "entry_rate_clipped", *LOG)}
    found: Numbers = {name: (c[name], 1.0) for name in ("stop", "entry_rate_clipped")}
    length = np.maximum(np.where(np.isnan(c["t_out"]), c["t_in"] + c["peak_indentation"] / np.maximum(c["speed_in"], 1e-300), c["t_out"]) - c["t_in"], 1e-300)
    fast = np.maximum(c["speed_in"], c["peak_indentation"] / length)
    force = np.maximum(np.abs(c["peak_force"]), 1e-300)
    scales = [length, length, fast, fast, c["peak_indentation"], force, force * length, force * c["peak_indentation"]]
    return found | {name: (c[name], scale) for name, scale in zip(LOG, scales, strict=True)}


def reactions(drawn: Drawn, whole: Whole, q: Any, u: Any, a: Any, F: Any, y2: Any, t: Any) -> Numbers:
    """Forces and moments of supports, springs, dashpots from K u = f - M (ü + r (ÿ + g)) on each beam."""
    found: Numbers = {}
    lift = np.array([row for row, *_ in whole.contacts]).reshape(-1, whole.size)
    values = np.array([[signal(table)(x) for _, table in whole.loads] for x in t]).reshape(len(t), -1)
    rows = np.array([row for row, _ in whole.loads]).reshape(-1, whole.size)
    inertia = (a @ whole.vectors.T + np.outer(y2 + drawn.tables.get("gravity", 0.0), whole.r)) @ whole.M
    full = F @ lift + values @ rows - inertia
    feet = [i for i, (_, table) in enumerate(whole.loads)]
    count = 0
    for body, part in enumerate(whole.parts):
        mine = slice(whole.starts[body], whole.starts[body + 1])
        rates = u @ whole.vectors[mine].T
        f = full[:, mine] - rates @ part.C
        static = np.zeros_like(f)
        static[:, part.free] = np.linalg.solve(part.K[np.ix_(part.free, part.free)], f[:, part.free].T).T
        left, forces = static @ part.K - f, part.tables.get("forces", ())
        foot = sum(len(p.tables.get("forces", ())) + sum("foot" in s for s in p.tables.get("springs", ())) for p in whole.parts[:body]) + len(forces)
        for one in part.tables.get("supports", ()):
            fixed = {"clamped": (1, 1), "pinned": (1, 0), "guided": (0, 1)}[one["kind"]]
            both = [left[:, 2 * part.node(one["z"]) + k] * fixed[k] for k in (0, 1)]
            found[f"reaction {count}"], count = (np.array(both), None), count + 1
        for one in part.tables.get("springs", ()):
            both = [-k * static @ part.row(one["z"], i) for i, k in enumerate((one["stiffness"], one.get("rotational", 0.0)))]
            if "foot" in one:
                both[0] = both[0] + one["stiffness"] * values[:, feet[foot]]
                foot += 1
            found[f"reaction {count}"], count = (np.array(both), None), count + 1
    for body, part in enumerate(whole.parts):
        mine = slice(whole.starts[body], whole.starts[body + 1])
        for one in part.tables.get("dashpots", ()):
            both = [-k * u @ whole.vectors[mine].T @ part.row(one["z"], i) for i, k in enumerate((one["damping"], one.get("rotational", 0.0)))]
            found[f"reaction {count}"], count = (np.array(both), None), count + 1
    sizes = np.max([np.abs(x).max(axis=1) for x, _ in found.values()], axis=0) if found else 0
    size = np.maximum(sizes, np.abs(inertia[:, : whole.starts[-1] : 2]).sum(axis=1).max() * np.array([1.0, whole.parts[0].nodes[-1]]))
    return {name: (x, size[:, None]) for name, (x, _) in found.items()}


def their_numbers(drawn: Drawn, run: fb.Run) -> dict[str, Any]:
    """Every number that is read off a run."""
    found: dict[str, Any] = {}
    for body in range(1 + len(drawn.tables.get("bodies", ()))):
        places = np.array(PROBES) * (run.shapes, *run.others)[body].nodes[-1]
        for name in ("displacement", "velocity", "acceleration"):
            read_off = getattr(run, name)
            found |= {f"{name} {body}": read_off(places, body), f"absolute {name} {body}": read_off(places, body, True)}
        found[f"slope {body}"] = run.slope(places, body)
    for i in range(len(run.stops)):
        found |= {f"indentation {i}": run.indentation(i), f"force {i}": run.force(i)}
    kept = ("input", "damping", "contact", "stored") if drawn.dt else ("stored",)
    found |= {f"energy {name}": getattr(run.energy, name) for name in kept}
    if len(run.stops):
        found |= {"losses work": run.losses.work, "losses history": run.losses.history}
        found["impulses"] = run.losses.impulses
    found |= {f"reaction {i}": np.array([one.force, one.moment]) for i, one in enumerate(run.reactions())}
    log, order = run.contacts, np.lexsort((run.contacts.t_in, run.contacts.stop))
    return found | {name: np.asarray(getattr(log, name))[order] for name in ("stop", "entry_rate_clipped", *LOG)}


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


def allowances(exact: Numbers, coarse: Numbers, moved: Numbers, shifted: Numbers, drawn: Drawn, rounding: float) -> dict[str, Any] | None:
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
        except ValueError as error:
            return told(drawn, seed), [f"refused: {error}"], 0
        return told(drawn, seed), *compared(drawn, model, seed)


def told(drawn: Drawn, seed: int) -> str:
    """A scene in words."""
    parts = [f"{k}: {[x.get('kind', x.get('law', {}).get('kind', '')) for x in v] if isinstance(v, list) else ''}" for k, v in drawn.tables.items()]
    return f"seed {seed}: {', '.join(parts)}; {drawn.how} rtol {drawn.rtol:g} dt {drawn.dt} start {drawn.start}"


def start_of(drawn: Drawn, model: fb.Model, seed: int) -> Any:
    """Rest, a moving start, or static equilibrium under a load."""
    if drawn.start == "moving":
        rng = np.random.default_rng(seed)
        start = model.rest()
        n = len(model.omega) - len(model.matrices.impactors)
        tip = np.abs(model.phi(np.array(PROBES) * model.shapes.nodes[-1])).max()
        start[:n] += 0.3 * drawn.sizes[0] / tip * rng.uniform(-1, 1, n) / np.arange(1, n + 1) ** 2
        start[len(model.omega) : len(model.omega) + n] += 0.3 * drawn.sizes[1] / tip * rng.uniform(-1, 1, n) / np.arange(1, n + 1)
        return start
    if drawn.start == "equilibrium" and model.omega.min() > 0:
        mass = model.moving_mass
        return model.equilibrium({0.77 * model.shapes.nodes[-1]: 0.5 * mass * model.omega[0] ** 2 * drawn.sizes[0]})
    return model.rest()


def compared(drawn: Drawn, model: fb.Model, seed: int) -> tuple[list[str], int]:
    """What differs, and how many contacts were compared."""
    whole, kinks = second(drawn, model)
    lowest = [part.free_modes()[0] for part in whole.parts]
    rounding = 1e-16 * max(squares[-1] / squares[0] for squares in lowest)
    start = start_of(drawn, model, seed)
    try:
        run = model.simulate(drawn.duration, drawn.dt, start, Exponential(drawn.rtol))
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
    kinds: Counter[str] = Counter()
    with ProcessPoolExecutor(processes) as pool:
        for words, wrong, contacts in pool.map(judge, range(first, first + count), [depth] * count):
            kinds["contacts"] += contacts
            passed = wrong and wrong[0].split(":")[0] in ("ill-conditioned", "the reference failed", "refused")
            kinds[wrong[0].split(":")[0] if passed else "differ" if wrong else "agree"] += 1
            if wrong and wrong != ["ill-conditioned"]:
                print(words, *wrong, sep="\n    ", flush=True)
    print(f"{count} scenes of depth {depth}: {dict(kinds)}")
    return kinds["differ"]


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:])) > 0)
