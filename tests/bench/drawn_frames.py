"""Random frames as the tables of a scene file, for `random_frames.py`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from drawn_models import Drawer
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from second_frames import AXES, PIECES, Space, Table, section

PLACED = "supports", "masses", "springs", "dashpots", "stops", "elements", "forces", "impactors"


class FrameDrawer(Drawer):
    """Draws frames."""

    def some(self, chance: float) -> bool:
        """Whether."""
        return bool(self.rng.random() < chance)

    def vector(self) -> list[float]:
        """A direction."""
        v = self.rng.normal(size=2 if self.plane else 3)
        return [float(f"{x:.4g}") for x in v / np.linalg.norm(v)]

    def way(self) -> Any:
        """A direction, by its name or as a vector."""
        if self.some(0.5):
            return self.pick("", "-") + self.pick(*("xy" if self.plane else "xyz"))
        return self.vector()

    def profile(self, h: float) -> Table:
        """A section of a frame."""
        material = self.pick({"E": 2.1e11, "rho": 7800.0}, {"E": 7e10, "rho": 2700.0, "nu": 0.33})
        kind = self.pick("rectangle", "tube", "general")
        if kind == "rectangle":
            return {"shape": kind, **material, "width": self.u(0.6, 2) * h, "height": h}
        if kind == "tube":
            return {"shape": kind, **material, "outer": h, "inner": self.u(0.3, 0.9) * h}
        I, I2 = h**4 / 12, self.u(0.3, 2) * h**4 / 12
        return {"shape": kind, **material, "A": h * h, "I": I, "I2": I2, "J": self.u(0.5, 1.5) * (I + I2) / 2,
                "I12": 0.0 if self.plane else self.pick(0.0, self.u(-0.5, 0.5) * math.sqrt(I * I2))}  # fmt: skip

    def place(self, tables: Table, free: list[str]) -> Any:
        """A node, or a point of the mesh within a member."""
        if free and self.some(0.5):
            return self.pick(*free)
        m = tables["frame"]["members"][self.rng.integers(len(tables["frame"]["members"]))]
        name = f"{m['nodes'][0]}-{m['nodes'][1]}"
        return [name, self.lengths[name] * 2 * int(self.rng.integers(1, PIECES // 2)) / PIECES]

    def frame(self, L: float = 0.0, plane: bool = False) -> Table:
        """A tree of members."""
        rng, L, plane = self.rng, L or self.u(0.3, 3.0), plane if L else self.some(0.35)
        self.L, self.plane = L, plane
        dim = 2 if self.plane else 3
        nodes, members = {"A": np.zeros(dim)}, []
        self.lengths: dict[str, float] = {}
        for name in "BCDE"[: int(rng.integers(1, 4))]:
            base = self.pick(*list(nodes)[-2:])
            way = rng.normal(size=dim)
            way /= np.linalg.norm(way)
            at = nodes[base] + L * self.u(0.5, 1.2) * way
            nodes[name] = np.array([float(f"{x:.5g}") for x in at])
            members.append({"nodes": [base, name], "section": self.profile(L * self.u(0.015, 0.04))})
        for m in members:
            a, b = (nodes[n] for n in m["nodes"])
            along = b - a
            if not self.plane and self.some(0.5):
                m["up"] = self.vector()
            if self.some(0.2):
                m["offset"] = [[float(f"{x:.3g}") for x in 0.05 * L * rng.normal(size=dim)] for _ in range(2)]
                along = along + np.subtract(m["offset"][1], m["offset"][0])
            self.lengths["-".join(m["nodes"])] = float(np.linalg.norm(along))
            if self.some(0.2):
                I = min(x for x in section(m["section"])[4:6])
                m["axial_force"] = self.pick(0.5, 3.0) * section(m["section"])[0] * I / L**2
            if self.some(0.15):
                m["foundation"] = self.u(1, 20) * section(m["section"])[0] * section(m["section"])[4] / L**4
        return {"nodes": {k: [float(x) for x in v] for k, v in nodes.items()}, "members": members}

    def shaft(self) -> Table:
        """A straight one of round sections; its spin comes later."""
        self.L, self.plane, self.lengths = self.u(0.3, 2.0), False, {}
        way, far = self.rng.normal(size=3), 0.0
        way, start = way / np.linalg.norm(way), self.rng.normal(size=3)
        nodes, members = {"A": [float(x) for x in start]}, []
        for a, b in ("AB", "BC", "CD")[: int(self.rng.integers(1, 4))]:
            far += self.L * self.u(0.3, 0.8)
            nodes[b] = [float(x) for x in start + far * way]
            h = self.L * self.u(0.02, 0.06)
            shape = self.pick({"shape": "circle", "diameter": h}, {"shape": "tube", "outer": h, "inner": 0.6 * h})
            members.append({"nodes": [a, b], "section": {**shape, "E": 2.1e11, "rho": 7800.0}})
            self.lengths[a + "-" + b] = float(np.linalg.norm(np.subtract(nodes[b], nodes[a])))
        return {"nodes": nodes, "members": members}

    def held(self, tables: Table) -> list[str]:
        """Supports; the nodes that are left free."""
        rng, names = self.rng, list(tables["frame"]["nodes"])[1:]
        ends = [n for n in names if sum(n in m["nodes"] for m in tables["frame"]["members"]) == 1]
        tables["supports"] = [{"kind": "clamped", "at": "A"}]
        if self.some(0.6) or len(names) == 1:
            return names
        known = ["x", "y", "rz"] if self.plane else list(AXES)
        one: Table = {"kind": self.pick("pinned", "fixed"), "at": ends[-1]}
        if one["kind"] == "fixed":
            one["dofs"] = sorted(rng.choice(known, int(rng.integers(1, len(known))), replace=False).tolist())
        tables["supports"].append(one)
        return [name for name in names if name != ends[-1]]

    def body(self, at: Any, whole: float) -> Table:
        """A rigid body, or a disk of a shaft."""
        one: Table = {"at": at, "mass": self.u(0.05, 0.5) * whole}
        if self.turning and self.some(0.7):
            I = 0.2 * one["mass"] * (0.2 * self.L) ** 2
            return {"kind": "disk", **one, "diametral": I, "polar": self.u(0.5, 2.0) * I}
        if self.some(0.6):
            B = self.rng.normal(size=(3, 3))
            J = np.round(0.3 * B @ B.T + 0.01 * np.eye(3), 3) * whole * (0.05 * self.L) ** 2
            ways = float(J[2, 2]), J.tolist(), [float(x) for x in np.diag(J)]
            one["inertia"] = ways[0] if self.plane else ways[self.rng.integers(3)]
        if self.some(0.6):
            arm = [float(f"{x:.3g}") for x in 0.05 * self.L * self.rng.normal(size=2 if self.plane else 3)]
            one["offset"] = [*arm, 0.0][:3]
        return one

    def linear(self, tables: Table) -> None:
        """Bodies, springs, dashpots, damping, spin; what is usual: mass, lowest frequency."""
        free, bare = self.free, Space(tables)
        r = bare.carried(0)
        self.mass = mass = float(r @ bare.M @ r)
        k = lowest(bare) ** 2 * mass
        if self.turning:
            tables["frame"]["spin"] = self.pick(-1, 1) * self.u(0.2, 3) * math.sqrt(k / mass)
        tables["masses"] = [self.body(self.place(tables, free), mass) for _ in range(self.rng.integers(0, 3))]
        tables["springs"] = []
        for _ in range(self.rng.integers(0, 3)):
            way = "rz" if self.some(0.2) else self.way()
            stiff = self.u(0.3, 5) * k * (0.05 * self.L**2 if way == "rz" else 1.0)
            tables["springs"].append({"at": self.place(tables, free), "stiffness": stiff, "direction": way})
        self.w1 = w1 = lowest(Space(tables))
        if self.some(0.3):
            c = self.u(0.02, 0.3) * mass * w1
            tables["dashpots"] = [{"at": self.place(tables, free), "damping": c, "direction": self.way()}]
        tables["damping"] = self.pick({"zeta": [0.03, 0.02]}, {"alpha": 0.02 * w1, "beta": 0.01 / w1}, {"zeta": 0.01})

    def stop(self, tables: Table) -> Table:
        """A stop along a way or a turn, perhaps on another place."""
        L, rate = self.L, self.rate
        at, gap = self.place(tables, self.free), self.pick(0.0, self.u(0.02, 0.3) * self.size)
        if self.some(0.15):
            way = self.pick("", "-") + ("rz" if self.plane else self.pick("rx", "ry", "rz"))
            law = self.law(0.1 * self.kc * L**2, 5 * self.deep / L, 0.1 * self.mass * L**2, rate / L)
            return {"at": at, "gap": gap / L, "direction": way, "law": law}
        found = {"at": at, "gap": gap, "direction": self.way(), "law": self.law(self.kc, self.deep, self.mass, rate)}
        other = self.place(tables, self.free)
        return found | ({"on": other} if self.some(0.2) and other != at else {})

    def element(self, tables: Table) -> Table:
        """An element to the frame or another place."""
        at, other = self.place(tables, self.free), self.place(tables, self.free)
        law = self.element_law(0.3 * self.mass * self.w1**2, self.size, self.mass)
        to = {"to": other} if self.some(0.4) and other != at else {}
        return {"at": at, "direction": self.way(), "law": law, **to}

    def acting(self, tables: Table) -> None:
        """Stops, elements, an impactor."""
        kinds = {str([s["at"], s["direction"]]).replace("-", ""): s for s in map(self.stop, 3 * [tables])}
        tables["stops"] = list(kinds.values())[: int(self.rng.integers(1, 4))]
        tables["elements"] = [self.element(tables) for _ in range(self.rng.integers(0, 3))]
        if self.some(0.25):
            side = self.pick("above", "below", "both")
            own = {"stiffness": 0.2 * self.mass * self.w1**2, "damping": 0.01 * self.mass * self.w1}
            struck = {"at": self.place(tables, self.free), "direction": self.way(), "mass": 0.2 * self.mass}
            struck |= {"velocity": self.rate if side == "below" else -self.rate, "gap": self.u(0.1, 1) * self.size}
            struck |= {"law": self.law(self.kc, self.deep, self.mass, self.rate), "side": side}
            tables["impactors"] = [struck | (own if self.some(0.5) else {})]

    def driven(self, tables: Table) -> None:
        """Motions of the base and of supports, forces, gravity."""
        axes, size, w1, free = "xy" if self.plane else "xyz", self.size, self.w1, self.free
        motion = lambda part, base=True: self.signal(part * size, w1, base, self.duration)  # noqa: E731
        if self.some(0.7):
            tables["base"] = {a: motion(0.6) for a in axes if self.some(0.6)} or {"x": motion(1.0)}
        tables["forces"] = []
        if self.turning and self.some(0.6):
            at, moment = self.place(tables, free), 0.2 * self.mass * size
            tables["forces"].append({"kind": "unbalance", "at": at, "moment": moment, "phase": self.u(0, 6)})
        for _ in range(self.rng.integers(0, 3)):
            push = self.some(0.5)
            force = 0.3 * self.mass * w1**2 / (1.0 if push else 5.0 / self.L)
            way = self.way() if push else "rz" if self.plane else self.pick("rx", "-ry", "rz")
            one = {"kind": "point_force" if push else "point_moment", "at": self.place(tables, free), "direction": way}
            tables["forces"].append({**one, "signal": motion(force, False)})
        if self.some(0.3):
            tables["gravity"] = [float(f"{0.3 * w1 * self.rate * x:.4g}") for x in self.rng.normal(size=len(axes))]
        for one in tables["springs"]:
            if self.some(0.3) and one["direction"] != "rz":
                one["foot"] = motion(1.0, False)
        if self.some(0.25) and (moved := {a: motion(0.5) for a in axes if self.some(0.5)}):
            tables["supports"][0]["motion"] = moved
        if not any(tables.get(name) for name in ("base", "forces", "gravity", "impactors")):
            tables["base"] = {"y": motion(1.0)}

    def second(self, tables: Table) -> None:
        """A frame beside the first one, which meets it."""
        L, lengths = self.L, self.lengths
        other = self.frame(L, self.plane)
        met = self.place({"frame": other}, list(other["nodes"])[1:])
        self.L, self.lengths = L, lengths
        clamped = [{"kind": "clamped", "at": "A"}]
        tables["bodies"] = [{"frame": other, "supports": clamped, "damping": {"zeta": 0.02}}]
        law = self.law(self.kc, self.deep, self.mass, self.rate)
        one = {"at": self.place(tables, self.free), "on": [1, met], "direction": self.way(), "gap": 0.1 * self.size}
        tables["stops"].append({**one, "law": law})
        if self.some(0.5):
            law = self.element_law(0.3 * self.mass * self.w1**2, self.size, self.mass)
            one = {"at": self.place(tables, self.free), "to": [1, met], "direction": self.way(), "law": law}
            tables["elements"].append(one)

    def draw_frame(self) -> tuple[Table, Table, float]:
        """Tables, reduction and rtol; sizes and duration are kept."""
        self.turning = self.some(0.2)
        tables: Table = {"frame": self.shaft() if self.turning else self.frame()}
        self.free = self.held(tables)
        self.linear(tables)
        self.size = self.L * 10 ** self.u(-4.5, -3)
        self.rate, self.duration = self.w1 * self.size, self.u(1, 3) * 2 * math.pi / self.w1
        tc = self.u(0.1, 0.4) / self.w1
        self.kc, self.deep = 0.3 * self.mass / tc**2, 0.3 * self.rate * tc
        self.acting(tables)
        self.driven(tables)
        if self.some(0.25) and not self.turning:
            self.second(tables)
        tables = {name: value for name, value in tables.items() if value}
        return tables, {"modes": int(self.rng.integers(2, 7))}, self.pick(1e-7, 1e-9)


def lowest(space: Space) -> float:
    """The lowest frequency."""
    K, M = (space.Z.T @ A @ space.Z for A in (space.K, space.M))
    return math.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 0))[0])


def cut(tables: Table, rng: Any) -> Table:
    """The same in two bodies joined at a node, the second one turned; parts of it stay with the scene, or do not."""
    frame = tables["frame"]
    root = next((m["nodes"][0] for m in frame["members"] if m["nodes"][0] != "A"), None)
    if root is None:
        return tables
    beyond, moved = {root}, []
    for m in frame["members"]:
        if m["nodes"][0] in beyond:
            beyond.add(m["nodes"][1])
            moved.append(m)
    own = _turned(tables, moved, rng)
    names = {"-".join(m["nodes"]) for m in moved}
    there = lambda at: (at in beyond and at != root) if isinstance(at, str) else at[0] in names  # noqa: E731
    kept = {n: v for n, v in frame["nodes"].items() if n not in beyond or n == root}
    found = {**tables, "frame": {**frame, "nodes": kept, "members": [m for m in frame["members"] if m not in moved]}}
    body: Table = {"frame": own}
    for kind in PLACED:
        rows = tables.get(kind, ())
        if kind in ("masses", "springs", "dashpots") and rng.random() < 0.5:
            body[kind] = [one for one in rows if there(one["at"])]
            rows = [one for one in rows if not there(one["at"])]
        ends = "at", "on", "to"
        found[kind] = [one | {k: [1, one[k]] if there(one[k]) else one[k] for k in ends if k in one} for one in rows]
    used = [one[k] for kind in PLACED for one in tables.get(kind, ()) for k in ("at", "on", "to") if k in one]
    if all(isinstance(at, str) for at in used if there(at)) and rng.random() < 0.6:
        own["reduced"] = {"nodes": sorted(beyond), "modes": 14}
    found["bodies"], found["joints"] = [{k: v for k, v in body.items() if v}], [{"at": root, "to": [1, root]}]
    return {k: v for k, v in found.items() if v}


def _turned(tables: Table, members: list[Table], rng: Any) -> Table:
    """The frame of some members in coordinates of its own, and by what it is turned."""
    nodes = {n: tables["frame"]["nodes"][n] for m in members for n in m["nodes"]}
    plane = len(tables["frame"]["nodes"]["A"]) == 2
    vector = np.array([0.0, 0.0, rng.uniform(-3, 3)]) if plane else rng.normal(size=3)
    back, known = Rotation.from_rotvec(vector).inv().as_matrix(), Space(tables).members
    turn = lambda v: [float(x) for x in (back @ np.array([*v, 0.0][:3]))[: len(v)]]  # noqa: E731
    own: Table = {"nodes": {n: turn(at) for n, at in nodes.items()}, "turned": vector.tolist(), "members": []}
    for m in members:
        arms = {"offset": [turn(arm) for arm in m["offset"]]} if "offset" in m else {}
        up = {} if plane else {"up": turn(known["-".join(m["nodes"])][3])}
        own["members"].append({**m, **arms, **up})
    return own
