"""A second implementation of frames for `random_frames.py`: matrices, shapes and runs of the tables of a scene file.

Members of 16 elements, cubic in bending and quadratic along and in twist; all points of all members have six numbers,
which a matrix T makes those of nodes. Modes are those of dense matrices, `second_motion` integrates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import block_diag, eigh
from second_motion import Acting, Motion
from second_signals import breaks, signal

PIECES = 16
LOG = "t_in", "peak_force", "speed_in", "energy_loss"
AXES = ("x", "y", "z", "rx", "ry", "rz")
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(6)
POINTS, WEIGHTS = 0.5 + 0.5 * POINTS, 0.5 * WEIGHTS
CUBICS = [np.polynomial.Polynomial(c) for c in ([1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1])]
STILL = 1e-13  # of the largest of a mode, below which what it moves a place is rounding: stops would hear of it
HEAVY = 1e12  # mass of a coordinate that is prescribed: the motion of a support
Table = dict[str, Any]


def cross(a: Any) -> Any:
    """a × as a matrix."""
    x, y, z = a
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def section(s: Table) -> tuple[float, ...]:
    """E, G, ρ, A, I, I2, I12, J."""
    E, rho, nu = s["E"], s["rho"], s.get("nu", 0.3)
    if s["shape"] == "general":
        A, I, I2, I12, J = (s.get(k, 0.0) for k in ("A", "I", "I2", "I12", "J"))
    elif s["shape"] in ("tube", "circle"):
        D, d = s.get("outer", s.get("diameter")), s.get("inner", 0.0)
        A, I = math.pi / 4 * (D**2 - d**2), math.pi / 64 * (D**4 - d**4)
        I2, I12, J = I, 0.0, 2 * I
    else:
        b, h = s["width"], s["height"]
        A, I, I2, I12 = b * h, b * h**3 / 12, h * b**3 / 12, 0.0
        long, short = max(b, h), min(b, h)
        odd = np.arange(1, 40, 2)
        series = np.sum(np.tanh(odd * math.pi * long / (2 * short)) / odd**5)
        J = long * short**3 / 3 * (1 - 192 * short / (math.pi**5 * long) * series)
    return E, E / (2 * (1 + nu)), rho, A, I, I2, I12, J


def bending(x: float, h: float, order: int, up: Any, across: Any) -> tuple[Any, Any]:
    """Rows (12,) of displacements up and across at the part x of an element, or of their derivatives."""
    H = [(p.deriv(order) if order else p)(x) / h**order for p in CUBICS]
    v = np.concatenate([H[0] * up, -h * H[1] * across, H[2] * up, -h * H[3] * across])
    return v, np.concatenate([H[0] * across, h * H[1] * up, H[2] * across, h * H[3] * up])


def stretching(x: float, h: float, first: int, along: Any) -> tuple[Any, Any]:
    """Rows (13,) of stretch (first 0) or twist (3), and of its derivative; the last number is that of a parabola."""
    row, slope = np.zeros((2, 13))
    row[first : first + 3], row[6 + first : 9 + first], row[12] = (1 - x) * along, x * along, 4 * x * (1 - x)
    slope[first : first + 3], slope[6 + first : 9 + first], slope[12] = -along / h, along / h, (4 - 8 * x) / h
    return row, slope


class Space:
    """Matrices of a frame: 6 numbers for every point of every member and node, constraints as a matrix T."""

    def __init__(self, tables: Table, pieces: int = PIECES) -> None:
        self.tables, self.pieces, frame = tables, pieces, tables["frame"]
        self.plane, self.spin = len(next(iter(frame["nodes"].values()))) == 2, frame.get("spin", 0.0)
        self.at = {k: np.array([*v, 0.0][:3], dtype=float) for k, v in frame["nodes"].items()}
        self.nodes = {k: i for i, k in enumerate(self.at)}
        self.members: dict[str, Any] = {}
        for m in frame["members"]:
            self.members["-".join(m["nodes"])] = self.placed(m, len(self.nodes) + len(self.members) * (pieces + 1))
        self.points = 6 * (len(self.nodes) + len(self.members) * (pieces + 1))
        self.N = self.points + 2 * pieces * len(self.members)  # and parabolas of stretch and twist of each element
        self.N += -self.N % 6
        whole = [np.zeros((self.N, self.N)) for _ in range(3)]
        for number, (m, L, along, up, points, _) in enumerate(self.members.values()):
            self.add_member(*whole, m, L, along, up, points, self.points + 2 * pieces * number)
        self.T = self.ties()
        self.K, self.M, self.G = (self.T.T @ A @ self.T for A in whole)
        self.C = np.zeros_like(self.K)
        self.add_parts()
        self.H = np.array([self.rows(one["at"])[AXES.index(d)] for one in tables["supports"] for d in self.held(one)])
        self.Z = np.linalg.svd(self.H)[2][len(self.H) :].T

    def placed(self, m: Table, first: int) -> tuple[Any, ...]:
        """A member: its length, its ways along and up, its points from a number on, its arms."""
        arms = [np.array([*a, 0.0][:3]) for a in m.get("offset", ((0, 0, 0), (0, 0, 0)))]
        start, end = (self.at[n] + a for n, a in zip(m["nodes"], arms, strict=True))
        L = float(np.linalg.norm(end - start))
        along = (end - start) / L
        usual = np.array([0.0, 1.0, 0.0]) if math.hypot(along[0], along[2]) > 1e-6 else np.array([0.0, 0.0, 1.0])
        up = np.array(m.get("up", usual), dtype=float)
        up = up - (up @ along) * along
        up = np.array([-along[1], along[0], 0.0]) if self.plane else up / np.linalg.norm(up)
        return m, L, along, up, first + np.arange(self.pieces + 1), arms

    def ties(self) -> Any:
        """T: ends of members follow their nodes on rigid arms; in the plane the rest is held."""
        T, slaves = np.eye(self.N), set()
        for m, _, _, _, points, arms in self.members.values():
            for p, arm, name in zip(6 * points[[0, -1]], arms, m["nodes"], strict=True):
                n = 6 * self.nodes[name]
                T[p : p + 6] = 0.0
                T[p : p + 6, n : n + 6] = np.eye(6)
                T[p : p + 3, n + 3 : n + 6] = -cross(arm)
                slaves |= set(range(p, p + 6))
        inner = range(self.points, self.points + 2 * self.pieces * len(self.members))
        kept = [i for i in range(self.points) if i not in slaves and (not self.plane or i % 6 in (0, 1, 5))]
        return T[:, kept + [i for i in inner if not self.plane or i % 2 == 0]]

    def add_parts(self) -> None:
        """Rigid bodies, disks, springs, dashpots."""
        for one in self.tables.get("masses", ()):
            row, J = self.rows(one["at"]), np.array(one.get("inertia", 0.0), dtype=float)
            J = J if J.ndim == 2 else np.diag(J * np.ones(3))
            if one.get("kind") == "disk":
                n = next(iter(self.members.values()))[2]
                J = one["diametral"] * (np.eye(3) - np.outer(n, n)) + one["polar"] * np.outer(n, n)
                self.G += one["polar"] * self.spin * row[3:].T @ -cross(n) @ row[3:]
            arm = np.eye(6)
            arm[:3, 3:] = -cross(one.get("offset", (0.0, 0.0, 0.0)))
            self.M += row.T @ arm.T @ block_diag(one["mass"] * np.eye(3), J) @ arm @ row
        for name, matrix, size in (("springs", self.K, "stiffness"), ("dashpots", self.C, "damping")):
            for one in self.tables.get(name, ()):
                w = self.row(one["at"], one["direction"])
                matrix += one[size] * np.outer(w, w)

    def held(self, one: Table) -> list[str]:
        """Components that a support holds."""
        known = ["x", "y", "rz"] if self.plane else list(AXES)
        names = {"clamped": known, "pinned": [a for a in known if a[0] != "r"]}.get(one["kind"], one.get("dofs", known))
        return [a for a in known if a in names]

    def add_member(
        self, K: Any, M: Any, whirling: Any, m: Table, L: float, along: Any, up: Any, points: Any, inner: int
    ) -> None:
        """The elements of a member."""
        E, G, rho, A, I, I2, I12, J = section(m["section"])
        N0, k0, h, across = m.get("axial_force", 0.0), m.get("foundation", 0.0), L / self.pieces, np.cross(up, along)
        both = lambda a: np.outer(a[0], a[0]) + np.outer(a[1], a[1])  # noqa: E731
        for a, b in pairwise(points):
            dofs = np.concatenate([6 * a + np.arange(6), 6 * b + np.arange(6)])
            bent = np.ix_(dofs, dofs)
            for x, weight in zip(POINTS, WEIGHTS * h, strict=True):
                moved, sloped, (v2, w2) = (bending(x, h, order, up, across) for order in range(3))
                curved = I * np.outer(v2, v2) + I2 * np.outer(w2, w2) + I12 * (np.outer(v2, w2) + np.outer(w2, v2))
                K[bent] += weight * (E * curved + N0 * both(sloped) + k0 * both(moved))
                M[bent] += weight * rho * (A * both(moved) + bool(self.spin) * I * both(sloped))
                turning = 2 * weight * rho * I * self.spin * np.outer(-sloped[0], sloped[1])
                whirling[bent] += turning - turning.T
            for first, stiff, mass in ((0, E * A, rho * A), (3, G * J, rho * (I + I2))):
                own = np.append(dofs, inner)
                inner += 1
                for x, weight in zip(POINTS, WEIGHTS * h, strict=True):
                    row, slope = stretching(x, h, first, along)
                    K[np.ix_(own, own)] += weight * stiff * np.outer(slope, slope)
                    M[np.ix_(own, own)] += weight * mass * np.outer(row, row)

    def rows(self, place: Any) -> Any:
        """(6, n) displacement and rotation at a place; those within members are points of the mesh."""
        if isinstance(place, str):
            return self.T[6 * self.nodes[place] :][:6]
        _, L, _, _, points, _ = self.members[place[0]]
        p = points[round(place[1] / L * self.pieces)]
        return self.T[6 * p :][:6]

    def row(self, place: Any, direction: Any) -> Any:
        """Along a direction: a name or a vector."""
        rows = self.rows(place)
        if isinstance(direction, str):
            return rows[AXES.index(direction.lstrip("-"))] * (-1.0 if direction.startswith("-") else 1.0)
        n = np.array([*direction, 0.0][:3], dtype=float)
        return n / np.linalg.norm(n) @ rows[:3]

    def carried(self, axis: int) -> Any:
        """Displacement of all by a unit motion of the base."""
        full = np.zeros(self.N)
        full[axis : self.points : 6] = 1.0
        return np.linalg.lstsq(self.T, full, rcond=None)[0]


class Several:
    """Frames beside each other and impactors: the matrices as blocks, places of the second one as [1, place]."""

    def __init__(self, tables: Table, pieces: int = PIECES) -> None:
        self.tables = tables
        self.parts = [
            Space(one, pieces) for one in (tables, *(tables.get("bodies", ()) if "joints" not in tables else ()))
        ]
        self.plane, self.nodes = self.parts[0].plane, self.parts[0].nodes
        self.starts = np.cumsum([0, *(len(part.K) for part in self.parts)])
        self.impactors = tables.get("impactors", ())
        mass = np.diag([one["mass"] for one in self.impactors])
        none = np.zeros_like(mass)
        self.K = block_diag(*(part.K for part in self.parts), none)
        self.M = block_diag(*(part.M for part in self.parts), mass)
        self.C = block_diag(*(part.C + part.G for part in self.parts), none)
        empty = np.zeros((len(mass), 0))
        self.Z = block_diag(*(part.Z for part in self.parts), empty)
        self.H = block_diag(*(part.H for part in self.parts), empty.T)

    def held(self, one: Table) -> list[str]:
        """Components that a support holds."""
        return self.parts[0].held(one)

    def rows(self, place: Any) -> Any:
        """(6, n) at a place."""
        body, place = (place[0], place[1]) if not isinstance(place, str) and isinstance(place[0], int) else (0, place)
        found = np.zeros((6, len(self.K)))
        found[:, self.starts[body] : self.starts[body + 1]] = self.parts[body].rows(place)
        return found

    row = Space.row

    def carried(self, axis: int) -> Any:
        """Displacement of all by a unit motion of the base."""
        ways = [self.along(one)[axis] for one in self.impactors]
        return np.concatenate([*(part.carried(axis) for part in self.parts), ways])

    def along(self, one: Table) -> Any:
        """The direction of an impactor."""
        way = one["direction"]
        if isinstance(way, str):
            return np.eye(3)[AXES.index(way.lstrip("-"))] * (-1.0 if way.startswith("-") else 1.0)
        n = np.array([*way, 0.0][:3], dtype=float)
        return n / np.linalg.norm(n)

    def strikes(self) -> list[tuple[Table, Any]]:
        """Row (n,) with δ = row·u - gap of every contact of an impactor."""
        found = []
        for i, one in enumerate(self.impactors):
            above = self.row(one["at"], one["direction"])
            above[self.starts[-1] + i] -= 1.0
            for sign in {"above": (1.0,), "below": (-1.0,), "both": (-1.0, 1.0)}[one["side"]]:
                found.append((one, sign * above))
        return found


@dataclass
class Reduced:
    """Modes of the second implementation, of each body by itself, then impactors; shapes and motions of supports."""

    space: Several
    omega: Any
    vectors: Any
    C: Any
    shapes: Any
    motions: list[Table]
    apart: float  # the least relative distance of frequencies between which it must be told


def reduced(tables: Table, modes: int) -> Reduced:
    """The modes of a scene."""
    space, found, least = Several(tables), [], 1.0
    for part in space.parts:
        K, M = part.Z.T @ part.K @ part.Z, part.Z.T @ part.M @ part.Z
        inverse, V = eigh((M + M.T) / 2, (K + K.T) / 2)  # of M v = v/ω²: the highest modes do not round the lowest
        omegas = inverse[: -modes - 2 : -1] ** -0.5
        omega, d = omegas[:modes], part.tables["damping"]
        zeta = np.append(np.atleast_1d(d.get("zeta", 0.0)), np.full(modes, np.atleast_1d(d.get("zeta", 0.0))[-1]))
        C = d["alpha"] + d["beta"] * omega**2 if "alpha" in d else 2 * zeta[:modes] * omega
        found.append((omega, part.Z @ V[:, : -modes - 1 : -1] * omega, C))
        apart = np.diff(omegas) / omega
        least = min(least, apart[-1], apart[0] if np.size(d.get("zeta", 0.0)) > 1 else 1.0)
    m, k, c = (np.array([one.get(key, 0.0) for one in space.impactors]) for key in ("mass", "stiffness", "damping"))
    omegas, vectors, C = zip(*found, (np.sqrt(k / m), np.diag(1 / np.sqrt(m)), c / m), strict=True)
    shapes = followed(space)
    motions = [table for one in tables["supports"] for table in one.get("motion", {}).values()]
    return Reduced(
        space, np.concatenate(omegas), block_diag(*vectors), np.diag(np.concatenate(C)), shapes, motions, float(least)
    )


def followed(space: Several) -> Any:
    """(k, N): static shapes of unit motions of supports."""
    K, supports, shapes = space.Z.T @ space.K @ space.Z, space.tables["supports"], []
    held = [(j, d) for j, other in enumerate(supports) for d in space.held(other)]
    for i, name in [(i, name) for i, one in enumerate(supports) for name in one.get("motion", {})]:
        goal = np.zeros(len(space.H))
        goal[held.index((i, name))] = 1.0
        particular = np.linalg.lstsq(space.H, goal, rcond=None)[0]
        shapes.append(particular - space.Z @ np.linalg.solve(K, space.Z.T @ space.K @ particular))
    return np.array(shapes).reshape(-1, len(space.K))


def forces_of(tables: Table, space: Any) -> list[Table]:
    """Row and signal of every force; of an unbalance two, m e Ω² along two axes across the shaft, e₁ × e₂ = n."""
    found = []
    for one in tables.get("forces", ()):
        if one["kind"] != "unbalance":
            found.append({"row": space.row(one["at"], one["direction"]), "signal": one["signal"]})
            continue
        spin, (_, _, along, up, *_) = tables["frame"]["spin"], next(iter(space.parts[0].members.values()))
        for way, late in ((np.cross(up, along), 0.0), (up, -math.pi / 2)):
            told = {
                "kind": "harmonic",
                "amplitude": one["moment"] * spin**2,
                "omega": spin,
                "phase": one["phase"] + late,
            }
            found.append({"row": way @ space.rows(one["at"])[:3], "signal": told})
    return found


def loads_of(tables: Table, space: Several) -> list[tuple[Any, Table | None, int]]:
    """Load (N,), signal and its derivative of the base, of gravity (no signal), of forces and moving springs."""
    found: list[Any] = []
    for name, table in tables.get("base", {}).items():
        found.append((-space.M @ space.carried(AXES.index(name)), table, 2))
    for i, size in enumerate(tables.get("gravity", ())):
        found.append((size * space.M @ space.carried(i), None, 0))
    found += [(one["row"], one["signal"], 0) for one in forces_of(tables, space)]
    for one in tables.get("springs", ()):
        if "foot" in one:
            found.append((one["stiffness"] * space.row(one["at"], one["direction"]), one["foot"], 0))
    return found


def contacts_of(tables: Table, space: Several) -> list[tuple[Table, Any, bool]]:
    """Part, row (N,) with δ = row·u - gap, and whether it always acts."""
    found = []
    for one in (*tables.get("stops", ()), *tables.get("elements", ())):
        w, other = space.row(one["at"], one["direction"]), one.get("on", one.get("to"))
        w = w if other is None else w - space.row(other, one["direction"])
        found.append((one, w, "gap" not in one))
    return found + [(one, w, False) for one, w in space.strikes()]


def own_run(tables: Table, model: Reduced, duration: float, rtol: float, sizes: Any, move: Any = 0.0) -> Any:
    """The run of the second implementation and its vectors; behind the modes stand the motions of supports."""
    space, n, s = model.space, model.vectors.shape[1], len(model.shapes)
    V = np.hstack([model.vectors, model.shapes.T / HEAVY])
    C = V.T @ space.C @ V
    C[:n, :n] += model.C
    parts = loads_of(tables, space)
    loads = [load @ V for load, _, _ in parts]
    signals = [signal(table, order) if table else lambda t: 1.0 for _, table, order in parts]
    for i, table in enumerate(model.motions):
        loads.append(np.append(-model.vectors.T @ space.M @ model.shapes[i], HEAVY * np.eye(s)[i]))
        signals.append(signal(table, 2))
    kinks = [t for table in (*model.motions, *(table for _, table, _ in parts if table)) for t in breaks(table)]
    told = contacts_of(tables, space)
    rows = np.array([w for _, w, _ in told]).reshape(-1, len(space.K)) @ V
    rows[np.abs(rows) < STILL * np.abs(V).max(axis=0)] = 0.0
    acting = [
        Acting(one["law"], one.get("gap", 0.0), -row, always) for (one, _, always), row in zip(told, rows, strict=True)
    ]
    motion = Motion(np.append(model.omega, np.zeros(s)), C, np.array(loads), signals, acting)
    scale = math.sqrt(float(np.trace(space.parts[0].M[::6, ::6]))) * np.array(sizes)
    q, u = np.zeros((2, n + s))
    u[n - len(space.impactors) : n] = [math.sqrt(one["mass"]) * one["velocity"] for one in space.impactors]
    for i, table in enumerate(model.motions):
        q[n + i], u[n + i] = HEAVY * signal(table)(0.0), HEAVY * signal(table, 1)(0.0)
    q[:n] += move * scale[0]
    u[:n] += move * scale[1]
    least = 0.01 * np.outer(sizes, np.append(np.full(n, scale[0] / sizes[0]), np.full(s, HEAVY)))
    return motion.run(q, u, duration, kinks, rtol, least), V


def own_numbers(tables: Table, model: Reduced, motion: Motion, V: Any, t: Any) -> dict[str, Any]:
    """What is compared, by names such as "u B x", "force 0", "reaction 1 rx", "log t_in"."""
    space, n, m = model.space, motion.n, motion.m
    y, F = motion.at(t)
    q, u = y[:, :n], y[:, n : 2 * n]
    a = np.array([motion.load(x) for x in t]) - u @ motion.C.T - motion.omega**2 * q + F @ motion.W
    found: dict[str, Any] = {}
    known = [0, 1, 5] if space.plane else range(6)
    for node in space.nodes:
        for c, row in zip(known, space.rows(node)[known] @ V, strict=True):
            found |= {f"{name} {node} {AXES[c]}": x @ row for name, x in (("u", q), ("v", u), ("a", a))}
    for i in range(m):
        found |= {f"force {i}": F[:, i], f"impulse {i}": y[:, 2 * n + 2 + m + i], f"work {i}": y[:, 2 * n + 2 + i]}
    stop, depth, t_in = (np.array([r[k] for r in motion.log]) for k in ("stop", "peak_indentation", "t_in"))
    kept = significant(stop, depth, t_in)
    found["contacts"] = np.array([np.sum(stop[kept] == i) for i in range(m)])
    found |= {f"log {name}": np.array([motion.log[i][name] for i in kept]) for name in LOG}
    return found | reactions(tables, model, u @ V.T, a @ V.T, F, t)


def significant(stop: Any, depth: Any, t_in: Any) -> Any:
    """Contacts deeper than 1e-7 of the deepest of their stop, by stop and time: others vary."""
    deepest = np.array([depth[stop == i].max() for i in stop])
    order = np.lexsort((t_in, stop))
    return order[depth[order] > 1e-7 * deepest[order]]


def reactions(tables: Table, model: Reduced, u: Any, a: Any, F: Any, t: Any) -> dict[str, Any]:
    """Of supports, from K u = f - M ü - C u̇ on all points under all loads."""
    space = model.space
    full = -a @ space.M - u @ space.C.T - F @ np.array([w for _, w, _ in contacts_of(tables, space)])
    for load, table, order in loads_of(tables, space):
        full += np.outer([signal(table, order)(x) if table else 1.0 for x in t], load)
    shift = np.zeros_like(full)
    for shape, table in zip(model.shapes, model.motions, strict=True):
        shift += np.outer([signal(table)(x) for x in t], shape)
    Z, K, first = space.Z, space.K, space.starts[1]
    static = shift + np.linalg.solve(Z.T @ K @ Z, Z.T @ (full - shift @ K).T).T @ Z.T
    left = (static @ K - full)[:, :first]
    forces = np.linalg.lstsq(space.parts[0].H.T, left.T, rcond=None)[0]
    names = [f"reaction {i} {d}" for i, one in enumerate(tables["supports"]) for d in space.held(one)]
    return dict(zip(names, forces, strict=True))
