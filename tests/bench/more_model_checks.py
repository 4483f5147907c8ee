"""Checks of `random_models.py` beside the motion: the model, files, tables, static and linear answers."""

from __future__ import annotations

import csv
import math
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from drawn_models import Drawn
from finite_elements import Part, Whole, at, hermite
from model_numbers import same_start, their_numbers
from model_tables import scene_file, scene_of
from second_motion import Acting

import fembeam as fb
from fembeam.scene_file import read
from solvers import Exponential

PROMISED = 1e-6  # of the frequencies on a mesh of the library's choice


def more_checks(drawn: Drawn, model: fb.Model, whole: Whole, run: fb.Run, start: Any, rounding: float) -> list[str]:
    """What differs, in words."""
    checks = (
        linear(drawn, model, whole, 1e-9 + 30 * rounding), settled(drawn, model, whole, start, rounding),
        sections(drawn, whole, run, 1e-9 + 100 * rounding), files(drawn, run), tables(run),
        parts(drawn, model, run, start), promised(drawn),
    )  # fmt: skip
    return [
        f"{name}: off by {error:.3g}, allowed {most:.3g}"
        for one in checks
        for name, error, most in one
        if not error <= most
    ]


Check = Iterator[tuple[str, float, float]]


def off(a: Any, b: Any) -> float:
    """Largest difference in units of the largest number."""
    a, b = np.asarray(a, dtype=complex), np.asarray(b, dtype=complex)
    if a.shape != b.shape:
        return math.inf
    same = np.isnan(a) & np.isnan(b)
    return float(
        np.max(np.where(same, 0.0, np.abs(a - b)), initial=0.0) / max(np.nanmax(np.abs(b), initial=0.0), 1e-300)
    )


def linear(drawn: Drawn, model: fb.Model, whole: Whole, most: float) -> Check:
    """Frequencies, damping, shapes, participation, moving mass, buckling, frequency response."""
    if model.omega.size != whole.omega.size:  # static shapes so nearly dependent that one of the two left one out
        yield "number of modes", math.inf, most
        return
    high = max(whole.omega.max(), 1e-300)
    yield "omega", float(np.max(np.abs(model.omega - whole.omega) / np.maximum(whole.omega, 1e-6 * high))), most
    rates = model._of_each_beam(lambda d, w, i: d.modal_coefficients(w, i), model.scene)
    yield "2 zeta omega", off(rates, whole.own_rates), most
    for body, part in enumerate(whole.parts):
        z = np.linspace(0.0, part.nodes[-1], 17)
        mine, own = model.phi(z, 0, body), np.array([whole.phi(x, 0, body) for x in z])
        yield f"shapes {body}", off(mine @ mine.T, own @ own.T), most * 10
    yield "participation", off(np.abs(model.participation), np.abs(whole.gamma)), most * 10
    free = np.concatenate(
        [p.free + s for p, s in zip(whole.parts, whole.starts, strict=False)]
        + [np.arange(whole.starts[-1], whole.size)]
    )
    load = (whole.M @ whole.r)[free]
    yield "moving mass", off(model.moving_mass, load @ np.linalg.solve(whole.M[np.ix_(free, free)], load)), 1e-10
    coarse, fine = (
        Part(drawn.tables, divided(whole.parts[0].nodes, k)).buckling() for k in ((2, 4) if drawn.brief else (4, 8))
    )
    yield "buckling", off(model.scene.buckling_load(), fine), 1e-5 + abs(coarse / fine - 1)
    w = np.array([0.31, 0.77, 1.9]) * max(whole.omega[whole.omega > 0].min(), 1e-3)
    always = [contact[:3] for contact in whole.contacts if contact[3]]
    acting = [(whole.vectors.T @ row, Acting(law, gap, None, True), gap) for row, gap, law in always]
    K, C = np.diag(whole.omega**2), whole.C.copy()
    for row, one, gap in acting:
        k, c = slopes(one, -gap)
        K, C = K + k * np.outer(row, row), C + c * np.outer(row, row)
    z = 0.63 * whole.parts[0].nodes[-1]
    pairs = [
        ("base", lambda x: x * x * whole.gamma),
        (0.44 * whole.parts[0].nodes[-1], lambda x: whole.phi(0.44 * whole.parts[0].nodes[-1])),
    ]
    for name, load in pairs:
        own = [whole.phi(z) @ np.linalg.solve(K + 1j * x * C - np.diag(np.full(len(K), x * x)), load(x)) for x in w]
        yield f"frequency response of {name}", off(model.frequency_response(w, name, z).values, own), 1e3 * most


def divided(nodes: Any, count: int) -> Any:
    """Every element in several."""
    return np.concatenate([np.linspace(a, b, count + 1)[:-1] for a, b in pairwise(nodes)] + [nodes[-1:]])


def slopes(one: Acting, d: float) -> tuple[float, float]:
    """Stiffness and damping of an element at a deformation."""
    law = one.law
    if law["kind"] == "bouc_wen":
        bent = law["A"] - (law["beta"] + law["gamma"]) * abs(one.first_z(d))  # loaded further
        return law["stiffness"] * (law["alpha"] + (1 - law["alpha"]) * bent), 0.0
    if one.slides:
        return law["stiffness"] if abs(one.k * d) < one.f else one.h, 0.0
    if law["kind"] == "kelvin_voigt":
        return law["stiffness"], law["damping"]
    return sum((j + 1) * c * d**j for j, c in enumerate(law["coefficients"])), 0.0


def settled(drawn: Drawn, model: fb.Model, whole: Whole, start: Any, rounding: float) -> Check:
    """A start of equilibrium balances: f + Σ w F = K q, by the laws at rest."""
    if drawn.start != "equilibrium" or model.omega.min() <= 0 or "impactors" in drawn.tables:
        return
    q, _ = same_start(whole, model, start)
    z = 0.77 * model.shapes.nodes[-1]
    load = whole.phi(z) * 0.5 * model.moving_mass * model.omega[0] ** 2 * drawn.sizes[0]
    left = load - whole.gamma * drawn.tables.get("gravity", 0.0) - whole.omega**2 * q
    size = np.abs(load).max() + np.abs(whole.omega**2 * q).max()
    for row, gap, law, always in whole.contacts:
        one = Acting(law, gap, None, always)
        d = -(whole.vectors.T @ row) @ q - gap
        if law["kind"] in ("bouc_wen", "jenkins", "elasto_plastic"):
            return
        if d > 0 and not always:
            one.enter(d, 0.0)
        force = one.force(d, 0.0, 0.0)
        left, size = left + whole.vectors.T @ row * force, size + abs(force) * np.abs(whole.vectors.T @ row).max()
    yield "equilibrium", float(np.abs(left).max() / size), 1e-9 + 100 * rounding


def sections(drawn: Drawn, whole: Whole, run: fb.Run, most: float) -> Check:
    """Moments, shear and stress: end forces of every element, K v - M a, and a cubic between; ahead of a point load."""
    done = 0
    for body, part in enumerate(whole.parts):
        count, mine = part.inertia.shape[1], slice(whole.starts[body], whole.starts[body + 1])
        shapes, own = whole.vectors[mine], []
        inertia = np.zeros_like(shapes)
        inertia[:, done : done + count] = part.inertia
        done += count
        for (dofs, M, K), a, b in zip(part.elements, part.nodes[:-1], part.nodes[1:], strict=True):
            forces, N = K @ shapes[dofs] - M @ inertia[dofs], part.beam.get("axial_force", 0.0)
            ends = np.array([-forces[1], forces[0] + N * shapes[dofs][1], forces[3], N * shapes[dofs][3] - forces[2]])
            own += [[hermite(x, b - a, order) @ ends for order in (0, 1)] for x in (0.0, 0.37)]
        z = (part.nodes[:-1, None] + np.diff(part.nodes)[:, None] * [0.0, 0.37]).ravel()
        for order, name in enumerate(("moment", "shear")):
            yield f"{name} {body}", off_coordinates(run, whole, name, z, body, np.array(own)[:, order]), most
        numbers = np.array([at(part.beam, x) for x in z])
        if not np.isnan(numbers).any():
            _, _, A, I, c = numbers.T
            stress = run.moment(z, body) * c / I + part.beam.get("axial_force", 0.0) / A
            yield f"stress {body}", off(run.stress(z, body), stress), 1e-9


def off_coordinates(run: fb.Run, whole: Whole, name: str, z: Any, body: int, own: Any) -> float:
    """Rows of a field by its histories: signs of modes are those of participation or shapes."""
    model = run.model
    nodes = whole.parts[body].nodes
    places = np.linspace(0.0, nodes[-1], 17)
    mine, other = model.phi(places, 0, body), np.array([whole.phi(x, 0, body) for x in places])
    sign = np.sign(np.sum(mine * other, axis=0))
    return off(getattr(run, name)(z, body), run.q @ (sign * own).T)


def files(drawn: Drawn, run: fb.Run) -> Check:
    """A saved run tells the same, and so does the scene written to a file and read back."""

    def all_of(run: fb.Run) -> dict[str, Any]:
        means = {f"mean force {i}": run.force(i, mean=True) for i in range(len(run.stops)) if len(run.t) > 1}
        return {name: x for name, x in their_numbers(drawn, run).items() if name != "impulses"} | means

    here = all_of(run)
    with tempfile.TemporaryDirectory() as folder:
        back = all_of(fb.load(run.save(Path(folder, "run.npz"))))
        yield "saved: names", float(here.keys() != back.keys()), 0.0
        for name in here.keys() & back.keys():
            yield f"saved: {name}", off(back[name], here[name]), 1e-12
        if "bodies" in drawn.tables:
            return
        path = Path(folder, "scene.toml")
        path.write_text(scene_file(drawn.tables, drawn.how))
        found = read(path)
        yield "scene file", float(repr(found.scene) != repr(run.model.scene)), 0.0
        again = found.scene.reduce(**found.reduce).simulate(
            drawn.duration, drawn.dt, run.model.rest() if drawn.start == "rest" else None, Exponential(drawn.rtol)
        )
        if drawn.start == "rest":
            yield "scene file: q", off(again.q, run.q), 0.0


def tables(run: fb.Run) -> Check:
    """CSV files hold what the run tells, in twelve digits; means over samples carry the impulse."""
    places = [0.137 * run.shapes.nodes[-1]]
    names = ["displacement", "absolute velocity", "acceleration", "slope", "moment", "reactions"]
    names += ["indentation", "force", "work"] if len(run.stops) else []
    with tempfile.TemporaryDirectory() as folder:
        run.to_csv(folder, places=places, quantities=names)
        rows, logged = (
            list(csv.reader(Path(folder, f"{name}.csv").read_text(encoding="utf-8").splitlines()))
            for name in ("histories", "contacts")
        )
    table = dict(zip(rows[0], np.array(rows[1:], dtype=float).reshape(-1, len(rows[0])).T, strict=True))
    z, stops = places[0], range(len(run.stops))
    expected = [("absolute velocity", run.velocity(z, absolute=True))]
    expected += [(name, getattr(run, name)(z)) for name in ("displacement", "acceleration", "slope", "moment")]
    expected += [(f"reaction force {i} ", one.force) for i, one in enumerate(run.reactions())]
    expected += [(f"{name} {run.key(i)} ", getattr(run, name)(i)) for i in stops for name in ("indentation", "force")]
    expected += [(f"work {run.key(i)} ", run.losses.history[:, i]) for i in stops]
    for name, values in expected:
        column = [x for head, x in table.items() if head.startswith(name)]
        yield f"csv: {name}", off(column[0], values) if len(column) == 1 else math.inf, 1e-11
    yield "csv: contacts", float(len(logged) - 1 != len(run.contacts)), 0.0
    if len(run.t) > 2:
        for i in range(len(run.stops)):
            impulses = run.losses.impulses[:, i]
            size = np.abs(np.diff(impulses)).max(initial=0.0) + np.abs(impulses).max()
            mean = np.trapezoid(run.force(i, mean=True), run.t)
            yield f"mean force {i}", abs(mean - impulses[-1] + impulses[0]) / max(size, 1e-300), 1e-9


def parts(drawn: Drawn, model: fb.Model, run: fb.Run, start: Any) -> Check:
    """Without samples the end is the same; without moving loads, so is a run in two parts."""
    bare = model.simulate(drawn.duration, None, start, Exponential(drawn.rtol))
    same = len(bare.contacts) == len(run.contacts)
    yield "dt=None: contacts", float(not same), 0.0
    whole = np.arange(0.0, drawn.duration * (1 + 1e-12), drawn.dt) if drawn.dt else [drawn.duration]
    yield "samples", off(run.t, whole), 1e-12


def promised(drawn: Drawn) -> Check:
    """On a mesh of its own choice, frequencies are those of a mesh three times as fine."""
    if drawn.brief or "bodies" in drawn.tables or drawn.how.get("residual") or drawn.how.get("interface"):
        return
    model = scene_of(drawn.tables).reduce(modes=drawn.how["modes"])
    nodes = model.matrices.nodes if not model.others else model.shapes.nodes
    squares, _ = Part(drawn.tables, divided(nodes, 3)).free_modes()
    mine = model.omega[: len(model.omega) - len(model.matrices.impactors)]
    own = np.sqrt(np.maximum(squares[list(model.modes[: len(mine)])], 0.0))
    rounding = 1e-16 * squares[-1] / np.maximum(own, 1e-300) ** 2
    for i in np.flatnonzero(own > 1e-3 * own.max()):
        yield f"omega {i} of its own mesh", abs(mine[i] / own[i] - 1), PROMISED + 10 * rounding[i]
