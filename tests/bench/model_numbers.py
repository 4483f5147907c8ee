"""Every number that a user reads off a run: from the run, and from the second implementation of its scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from drawn_models import Drawn
from finite_elements import Whole
from second_motion import Motion
from second_signals import signal

import fembeam as fb

LOG = ("t_in", "t_out", "speed_in", "speed_out", "peak_indentation", "peak_force", "impulse", "energy_loss")
PROBES = (0.0, 0.137, 0.5, 0.731, 1.0)  # of the length: at nodes and between
Numbers = dict[str, tuple[Any, Any]]  # values and the size they are compared with


def own_numbers(drawn: Drawn, whole: Whole, motion: Motion, t: Any, shift: Any = 0.0) -> Numbers:
    """What `their_numbers` reads off a run, from the second implementation; states moved by a part of their size."""
    n, m = motion.n, motion.m
    y, F = motion.at(t, shift)
    q, u = y[:, :n], y[:, n : 2 * n]
    load = np.array([motion.load(x) for x in t])
    a = load - u @ whole.C.T - whole.omega**2 * q + F @ motion.W
    found: Numbers = {}
    base = (
        [np.array([signal(drawn.tables["base"], k)(x) for x in t]) for k in range(3)]
        if "base" in drawn.tables
        else [np.zeros(len(t))] * 3
    )
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
    length = np.maximum(
        np.where(
            np.isnan(c["t_out"]), c["t_in"] + c["peak_indentation"] / np.maximum(c["speed_in"], 1e-300), c["t_out"]
        )
        - c["t_in"],
        1e-300,
    )
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
    count = 0
    for body, part in enumerate(whole.parts):
        mine = slice(whole.starts[body], whole.starts[body + 1])
        rates = u @ whole.vectors[mine].T
        f = full[:, mine] - rates @ part.C
        static = np.zeros_like(f)
        static[:, part.free] = np.linalg.solve(part.K[np.ix_(part.free, part.free)], f[:, part.free].T).T
        left, forces = static @ part.K - f, part.tables.get("forces", ())
        foot = sum(
            len(p.tables.get("forces", ())) + sum("foot" in s for s in p.tables.get("springs", ()))
            for p in whole.parts[:body]
        ) + len(forces)
        for one in part.tables.get("supports", ()):
            fixed = {"clamped": (1, 1), "pinned": (1, 0), "guided": (0, 1)}[one["kind"]]
            both = [left[:, 2 * part.node(one["z"]) + k] * fixed[k] for k in (0, 1)]
            found[f"reaction {count}"], count = (np.array(both), None), count + 1
        for one in part.tables.get("springs", ()):
            both = [
                -k * static @ part.row(one["z"], i)
                for i, k in enumerate((one["stiffness"], one.get("rotational", 0.0)))
            ]
            if "foot" in one:
                both[0] = both[0] + one["stiffness"] * values[:, foot]
                foot += 1
            found[f"reaction {count}"], count = (np.array(both), None), count + 1
    for body, part in enumerate(whole.parts):
        mine = slice(whole.starts[body], whole.starts[body + 1])
        for one in part.tables.get("dashpots", ()):
            both = [
                -k * u @ whole.vectors[mine].T @ part.row(one["z"], i)
                for i, k in enumerate((one["damping"], one.get("rotational", 0.0)))
            ]
            found[f"reaction {count}"], count = (np.array(both), None), count + 1
    sizes = np.max([np.abs(x).max(axis=1) for x, _ in found.values()], axis=0) if found else 0
    size = np.maximum(
        sizes, np.abs(inertia[:, : whole.starts[-1] : 2]).sum(axis=1).max() * np.array([1.0, whole.parts[0].nodes[-1]])
    )
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
