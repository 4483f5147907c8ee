"""A second implementation of scenes for `random_models.py`, from the equations in `docs` and not from the packages.

Scenes are the tables of a scene file (and `bodies`, a list of such tables). Euler–Bernoulli elements are integrated by
eight Gauss points, supports take their dofs away, modes are those of dense matrices, every beam by itself; impactors
are dofs of their own. `second_motion` integrates the reduced equations, `second_laws` has the laws.

    K_e = ∫ EI u'' v'' + N u' v' + k u v dz,    M_e = ∫ ρA u v dz
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import eigh, null_space

Table = dict[str, Any]
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)
POINTS, WEIGHTS = 0.5 + 0.5 * POINTS, 0.5 * WEIGHTS
CUBICS = np.array([[1.0, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]])
FIXED = {"clamped": (0, 1), "pinned": (0,), "guided": (1,)}


def section_at(table: Table, x: float) -> tuple[float, float, float, float, float]:
    """E, ρ, A, I and distance of the outer fibre at the part x of a span."""
    shape = table["shape"]
    if shape == "taper":
        (E, rho, A, I, c), (_, _, B, J, d) = (section_at(table[end], x) for end in ("start", "end"))
        h, k = math.sqrt(12 * I / A), math.sqrt(12 * J / B)
        height, width = h + x * (k - h), A / h + x * (B / k - A / h)
        return E, rho, width * height, width * height**3 / 12, c + x * (d - c)
    E, rho = table["E"], table["rho"]
    if shape == "rectangle":
        b, h = table["width"], table["height"]
        return E, rho, b * h, b * h**3 / 12, h / 2
    if shape == "general":
        return E, rho, table["A"], table["I"], table.get("fibre", math.nan)
    D, d = (table["diameter"], 0.0) if shape == "circle" else (table["outer"], table["inner"])
    return E, rho, math.pi * (D**2 - d**2) / 4, math.pi * (D**4 - d**4) / 64, D / 2


def spans_of(beam: Table) -> list[tuple[float, float, Table]]:
    """Start, end and section of every span."""
    spans = beam.get("spans") or [{"length": beam["length"], "section": beam["section"]}]
    ends = np.cumsum([0.0] + [span["length"] for span in spans])
    return [(ends[i], ends[i + 1], span["section"]) for i, span in enumerate(spans)]


def at(beam: Table, z: float) -> tuple[float, float, float, float, float]:
    """Section numbers at z, at a border those of the span ahead."""
    spans = spans_of(beam)
    a, b, section = next((s for s in spans if z < s[1]), spans[-1])
    return section_at(section, (z - a) / (b - a))


def hermite(x: float, h: float, order: int) -> Any:
    """Shape functions of (u, u_z) at both ends of an element of length h at the part x, or a derivative by z."""
    powers = [math.perm(j, order) * x ** (j - order) if j >= order else 0.0 for j in range(4)]
    return CUBICS @ powers * np.array([1.0, h, 1.0, h]) / h**order


@dataclass
class Part:
    """One beam on given nodes: M, K, dashpots C on all its dofs (u, u_z of every node), G of axial force."""

    tables: Table
    nodes: Any
    M: Any = field(init=False)
    K: Any = field(init=False)

    def __post_init__(self) -> None:
        size, self.beam = 2 * len(self.nodes), self.tables["beam"]
        self.M, self.K, self.C, self.G = (np.zeros((size, size)) for _ in range(4))
        self.elements = []
        for e, (a, b) in enumerate(zip(self.nodes[:-1], self.nodes[1:], strict=True)):
            mine = slice(2 * e, 2 * e + 4)
            M, K, G = self.element(a, b - a)
            self.elements.append((mine, M, K))
            for whole, one in ((self.M, M), (self.K, K), (self.G, G)):
                whole[mine, mine] += one
        for mass in self.tables.get("masses", ()):
            u, slope = self.row(mass["z"]), self.row(mass["z"], 1)
            arm = u + mass.get("offset", 0.0) * slope
            self.M += mass["mass"] * np.outer(arm, arm) + mass.get("inertia", 0.0) * np.outer(slope, slope)
        for name, matrix, key in (("springs", self.K, "stiffness"), ("dashpots", self.C, "damping")):
            for one in self.tables.get(name, ()):
                for order, value in enumerate((one[key], one.get("rotational", 0.0))):
                    matrix += value * np.outer(self.row(one["z"], order), self.row(one["z"], order))
        self.r = np.tile([1.0, 0.0], len(self.nodes))
        held = [2 * self.node(s["z"]) + i for s in self.tables.get("supports", ()) for i in FIXED[s["kind"]]]
        self.free = np.setdiff1d(np.arange(size), held)

    def element(self, z: float, h: float) -> Any:
        """M, K (with foundation and axial force) and ∫ u' v' of an element."""
        M, K, G = np.zeros((3, 4, 4))
        for x, w in zip(POINTS, h * WEIGHTS, strict=True):
            E, rho, A, I, _ = at(self.beam, z + x * h)
            u, slope, bend = (hermite(x, h, order) for order in range(3))
            M += w * rho * A * np.outer(u, u)
            G += w * np.outer(slope, slope)
            K += w * (E * I * np.outer(bend, bend) + self.beam.get("foundation", 0.0) * np.outer(u, u))
        return M, K + self.beam.get("axial_force", 0.0) * G, G

    def node(self, z: float) -> int:
        """The node at z."""
        return int(np.argmin(np.abs(self.nodes - z)))

    def row(self, z: float, order: int = 0) -> Any:
        """u or u_z at z on all dofs."""
        e = int(np.clip(np.searchsorted(self.nodes, z) - 1, 0, len(self.nodes) - 2))
        h = self.nodes[e + 1] - self.nodes[e]
        row = np.zeros(2 * len(self.nodes))
        row[2 * e : 2 * e + 4] = hermite((z - self.nodes[e]) / h, h, order)
        return row

    def free_modes(self) -> tuple[Any, Any]:
        """ω² and mass-normalised vectors of all modes, on the free dofs."""
        inside = np.ix_(self.free, self.free)
        return eigh(self.K[inside], self.M[inside])

    def buckling(self) -> float:
        """Lowest P of (K - P G) φ = 0."""
        inside = np.ix_(self.free, self.free)
        return 1.0 / eigh(self.G[inside], self.K[inside], eigvals_only=True)[-1]

    def basis(self, how: Table, loaded: list[Any]) -> tuple[Any, Any, Any]:
        """ω, vectors on all dofs and mode numbers; static shapes under the rows in ``loaded`` included.

        Kept beside: the inertia a of the vectors, K v = M a + loads along the rows.
        """
        squares, vectors = self.free_modes()
        highest = squares[-1]
        chosen = how["modes"] if isinstance(how["modes"], list) else list(range(how["modes"]))
        rows = np.array(loaded).reshape(len(loaded), len(self.M))[:, self.free]
        kept, inside = vectors[:, chosen] if chosen else vectors[:, :0], np.ix_(self.free, self.free)
        M, K, inertia = self.M[inside], self.K[inside], kept * squares[chosen]
        if how.get("residual") and len(rows):
            others = [i for i in range(len(squares)) if i not in chosen]
            inertia = np.hstack([inertia, -kept @ (kept.T @ rows.T)])
            kept = np.hstack([kept, (vectors[:, others] / squares[others]) @ vectors[:, others].T @ rows.T])
        if how.get("interface"):
            inner = null_space(rows)
            apart, held = eigh(inner.T @ K @ inner, inner.T @ M @ inner)
            held, n = inner @ held[:, : len(chosen)], len(chosen)
            inertia = np.hstack([held * apart[:n], np.zeros(rows.T.shape)])
            kept = np.hstack([held, np.linalg.solve(K, rows.T)])
        given, kept = kept, independent(kept, M)
        squares, ritz = eigh(kept.T @ K @ kept, kept.T @ M @ kept)
        whole, self.inertia = np.zeros((2, len(self.M), kept.shape[1]))
        whole[self.free] = kept @ ritz
        size = np.linalg.norm(given, axis=0)
        self.inertia[self.free] = inertia / size @ np.linalg.lstsq(given / size, kept @ ritz, rcond=1e-12)[0]
        numbers = list(range(kept.shape[1]))
        if not how.get("interface"):
            numbers = [*chosen, *range(chosen[-1] + 1, chosen[-1] + 1 + kept.shape[1] - len(chosen))]
        return np.sqrt(np.where(squares < 1e-12 * highest, 0.0, squares)), whole, numbers  # rigid ones: rounding


def independent(columns: Any, M: Any) -> Any:
    """An orthonormal basis of the columns in the mass norm; equal ones count once."""
    sized = columns / np.sqrt(np.einsum("ij,ij->j", columns, M @ columns))
    found: list[Any] = []
    for column in sized.T:
        left = column.copy()
        for _ in range(3):
            for one in found:
                left = left - one * (one @ M @ left)
        size = math.sqrt(left @ M @ left)
        if size > 1e-7:
            found.append(left / size)
    return np.array(found).T


def rates_of(damping: Table, omega: Any, numbers: list[int]) -> Any:
    """2ζω of every coordinate."""
    if "alpha" in damping:
        return damping["alpha"] + damping["beta"] * omega**2
    zeta = np.atleast_1d(damping["zeta"])
    return 2 * zeta[np.minimum(numbers, len(zeta) - 1)] * omega


@dataclass
class Whole:
    """All beams and impactors of a scene: vectors of the coordinates on all dofs, and rows of what acts."""

    tables: Table
    nodes: list[Any]
    how: Table

    def __post_init__(self) -> None:
        scenes = [self.tables, *self.tables.get("bodies", ())]
        self.parts = [Part(t, n) for t, n in zip(scenes, self.nodes, strict=True)]
        self.impactors = self.tables.get("impactors", [])
        self.starts = np.cumsum([0] + [len(part.M) for part in self.parts])
        self.size = self.starts[-1] + len(self.impactors)
        self.contacts = list(self._contacts())
        self.loads = list(self._loads())
        found = [part.basis(self.how, self._loaded(i)) for i, part in enumerate(self.parts)]
        n, extra = sum(len(omega) for omega, _, _ in found), len(self.impactors)
        self.vectors, done, rates = np.zeros((self.size, n + extra)), 0, []
        for i, (omega, vectors, numbers) in enumerate(found):
            self.vectors[self.starts[i] : self.starts[i + 1], done : done + len(omega)] = vectors
            rates.append(rates_of(scenes[i].get("damping", {"zeta": 0.0}), omega, numbers))
            done += len(omega)
        for i, one in enumerate(self.impactors):
            self.vectors[self.starts[-1] + i, n + i] = 1 / math.sqrt(one["mass"])
        own = [math.sqrt(one.get("stiffness", 0.0) / one["mass"]) for one in self.impactors]
        self.omega = np.concatenate([*(omega for omega, _, _ in found), own])
        self.M, self.r, dashpots = self._full()
        own_rates = [one.get("damping", 0.0) / one["mass"] for one in self.impactors]
        self.own_rates = np.concatenate([*rates, np.zeros(extra)])
        self.C = np.diag(np.concatenate([*rates, own_rates])) + self.vectors.T @ dashpots @ self.vectors
        self.gamma = self.vectors.T @ self.M @ self.r

    def _full(self) -> tuple[Any, Any, Any]:
        """M, r and dashpots of all dofs."""
        M, C, r = np.zeros((self.size, self.size)), np.zeros((self.size, self.size)), np.ones(self.size)
        for part, start in zip(self.parts, self.starts, strict=False):
            mine = slice(start, start + len(part.M))
            M[mine, mine], C[mine, mine], r[mine] = part.M, part.C, part.r
        for i, one in enumerate(self.impactors):
            M[self.starts[-1] + i, self.starts[-1] + i] = one["mass"]
        return M, r, C

    def row(self, z: float, order: int = 0, body: int = 0) -> Any:
        """u or u_z of a beam at z, on all dofs."""
        row = np.zeros(self.size)
        row[self.starts[body] : self.starts[body + 1]] = self.parts[body].row(z, order)
        return row

    def phi(self, z: float, order: int = 0, body: int = 0) -> Any:
        """The same on the coordinates."""
        return self.row(z, order, body) @ self.vectors

    def _contacts(self) -> Any:
        """(w on all dofs, gap, law, always) of each beam's stops, elements, impactors."""
        for body, part in enumerate(self.parts):
            for name, key in (("stops", "on"), ("elements", "to")):
                for one in part.tables.get(name, ()):
                    order = int(one.get("of") == "rotation")
                    row = self.row(one["z"], order, body)
                    if key in one:
                        other, z = one[key] if isinstance(one[key], (list, tuple)) else (body, one[key])
                        row = row - self.row(z, order, other)
                    push = -1.0 if name == "elements" or one.get("side") == "above" else 1.0
                    yield push * row, one.get("gap", 0.0), one["law"], name == "elements"
            if body == 0:
                yield from self._struck()

    def _struck(self) -> Any:
        """The same of the impactors, all of the first beam."""
        for i, one in enumerate(self.impactors):
            row = self.row(one["z"])
            row[self.starts[-1] + i] = -1.0
            side = one.get("side") or ("below" if one["velocity"] > 0 else "above")
            for push in {"above": (-1.0,), "below": (1.0,), "both": (1.0, -1.0)}[side]:
                yield push * row, one.get("gap", 0.0), one["law"], False

    def _loads(self) -> Any:
        """(row on all dofs, name of its signal): forces, moments and feet of every beam."""
        for body, part in enumerate(self.parts):
            for one in part.tables.get("forces", ()):
                yield self.row(one["z"], int(one.get("kind") == "point_moment"), body), one["signal"]
            for one in part.tables.get("springs", ()):
                if "foot" in one:
                    yield one["stiffness"] * self.row(one["z"], 0, body), one["foot"]

    def _loaded(self, body: int) -> list[Any]:
        """Rows of a beam's static shapes: stops, elements, loads, dashpots, impactors; no gap, no size."""
        part, mine = self.parts[body], slice(self.starts[body], self.starts[body + 1])
        rows = [row[mine] for row, *_ in self.contacts] + [row[mine] for row, _ in self.loads]
        for one in part.tables.get("dashpots", ()):
            sizes = one["damping"], one.get("rotational", 0.0)
            rows += [part.row(one["z"], order) for order, size in enumerate(sizes) if size]
        return [row / np.abs(row).max() for row in rows if np.abs(row).max() > 0]
