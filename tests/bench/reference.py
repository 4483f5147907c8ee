r"""The problem every method of the benchmark solves, and its high-precision solution.

.. math:: \ddot q_i + c_i \dot q_i + k_i q_i = Γ_i A Ω^2 \cos Ωt + φ_i F,\quad δ = -φ^T q,\quad
          F = K δ^{3/2} (1 + a \dot δ/\dot δ^-)\ \text{for}\ δ > 0

``python tests/bench/reference.py`` makes ``reference.npz``: modal data, starts, and the tip's displacement φᵀq after
ten periods. Two methods that share nothing but the equation find it, both in extended precision (ε = 1e-19):

* here: x_i = q̇_i - λ̄_i q_i obeys x' = λx + f, which flight solves in closed form; in contact a Taylor series of order
  28 in τ with dt = u dτ, u = √δ, where the motion is analytic:
  u' = δ̇/2, t' = u, x' = u (λx + f), F = K u³ (1 + a δ̇/δ̇⁻);
* heyoka's Taylor integrator on (q, q̇) with terminal events, flight included (`peers.heyoka`).

``DormandPrince(rtol=1e-14)`` in double precision is a third witness. The differences are stored with the values.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from problems import PAPER_LAW as LAW
from problems import TIP, paper_scene

import fembeam as fb
import solvers

FILE = Path(__file__).with_name("reference.npz")
MODES = 2, 10, 30
STARTS = 12
AMPLITUDE, OMEGA = 1e-3, 195.0
DURATION = 10.0 * 2.0 * math.pi / OMEGA
LENGTH = 1e-3  # m, the unit of all errors
STIFFNESS = LAW.stiffness
FACTOR = LAW.damping_factor
RATE_FLOOR = LAW.entry_rate_floor
LOAD = AMPLITUDE * OMEGA**2

Vector = NDArray[np.float64]
Long = np.longdouble


@dataclass(frozen=True, eq=False)
class Problem:
    """Modal data (n,) of one mode count, the starts (s, 2n) as rows [q, q̇], and the tip at the end (s,) in m."""

    k: Vector
    c: Vector
    gamma: Vector
    phi: Vector
    starts: Vector
    tips: Vector

    @property
    def n(self) -> int:
        """Number of modes."""
        return self.k.size

    @cached_property
    def system(self) -> solvers.System:
        """The problem as this library's integrators take it; one object, so that their tables are made once."""
        stop = solvers.Contact(self.phi, LAW)
        load = -self.gamma, fb.Harmonic(AMPLITUDE, OMEGA).derivative(2)
        return solvers.System(np.eye(self.n), np.diag(self.c), np.diag(self.k), [stop], [load])

    def error(self, start: int, tip: float) -> float:
        """|tip - reference| / 1 mm."""
        return abs(tip - self.tips[start]) / LENGTH


def problem(modes: int) -> Problem:
    """The stored problem with so many modes."""
    with np.load(FILE) as stored:
        return Problem(*(stored[f"{name}_{modes}"] for name in ("k", "c", "gamma", "phi", "starts", "tips")))


# --- the method of this file -----------------------------------------------------------------------------------------


class Exact:
    """Exact flight and Taylor series in τ, all in extended precision."""

    order = 28
    chunk = 4000
    scan = 2e-6  # s between two looks at δ in flight
    grazing = 1e-9  # m: a summit nearer to the stop than this could hide a contact from the scan

    def __init__(self, of: Problem) -> None:
        self.k, self.c, self.phi = (Long(v) for v in (of.k, of.c, of.phi))
        self.omega_d = np.sqrt(self.k - self.c**2 / 4)
        self.rate = -self.c / 2 + 1j * self.omega_d
        self.load = Long(of.gamma) * Long(AMPLITUDE) * Long(OMEGA) ** 2
        self.forcing = 1j * Long(OMEGA)
        self.response = self.load / (self.forcing - self.rate) / 2, self.load / (-self.forcing - self.rate) / 2
        self.contacts = 0

    def tip(self, start: Vector) -> Long:
        """φᵀq at the end of a run from [q, q̇]."""
        q, q_dot = np.split(Long(start), 2)
        x, t, self.contacts = q_dot + self.c / 2 * q + 1j * self.omega_d * q, Long(0), 0
        end = Long(DURATION)
        while t < end:
            x, t = self.flight(x, t, end)
            if t < end:
                self.contacts += 1
                x, t = self.contact(x, t, end)
        return -self.delta(x)

    def delta(self, x: NDArray) -> NDArray:
        """δ = -φᵀq of states (..., n)."""
        return -np.sum(self.phi * x.imag / self.omega_d, axis=-1)

    def delta_dot(self, x: NDArray) -> NDArray:
        """δ̇ = -φᵀq̇."""
        return -np.sum(self.phi * (x.real - self.c / 2 * x.imag / self.omega_d), axis=-1)

    def steady(self, t: NDArray) -> NDArray:
        """The particular solution, (..., n)."""
        turn = np.exp(self.forcing * np.asarray(t))[..., None]
        return self.response[0] * turn + self.response[1] * turn.conj()

    def moved(self, x: NDArray, t: Long, later: NDArray | Long) -> NDArray:
        """Flight from (x, t) to the instants ``later``."""
        free = x - self.steady(t)
        return self.steady(later) + np.exp(np.multiply.outer(later - t, self.rate)) * free

    def flight(self, x: NDArray, t: Long, end: Long) -> tuple[NDArray, Long]:
        """To the next entry or the end, whichever comes first."""
        begin = t
        while True:
            times = np.minimum(begin + Long(self.scan) * np.arange(1, self.chunk + 1), end)
            delta = self.delta(self.moved(x, t, times))
            entries = np.flatnonzero((delta[:-1] < 0.0) & (delta[1:] >= 0.0))
            self._provable(delta[: entries[0] + 1] if entries.size else delta)
            if entries.size:
                return self._landed(x, t, times[entries[0] + 1])
            if times[-1] == end:
                return self.moved(x, t, end), end
            begin = times[-4]

    def _provable(self, delta: NDArray) -> None:
        """Refuse a flight that nearly grazes, or is over at once: there the scan proves nothing."""
        inner = delta[1:-1]
        summit = (inner > delta[:-2]) & (inner > delta[2:]) & (inner > -self.grazing)
        if delta[0] >= 0.0 or np.any(summit):
            raise ValueError("a flight nearly grazes the stop; choose other starts")

    def _landed(self, x: NDArray, t: Long, guess: Long) -> tuple[NDArray, Long]:
        """Newton on δ from just beyond the entry."""
        for _ in range(8):
            y = self.moved(x, t, guess)
            guess = guess - self.delta(y) / self.delta_dot(y)
        return self.moved(x, t, guess), guess

    def contact(self, x: NDArray, t: Long, end: Long) -> tuple[NDArray, Long]:
        """To the exit or the end."""
        entry, u = max(self.delta_dot(x), Long(RATE_FLOOR)), Long(0)
        depth = (5 * entry**2 / (4 * Long(STIFFNESS) * np.sum(self.phi**2))) ** Long(0.4)
        while True:
            xs, us, ts = self._series(x, u, t, entry)
            h = min(_radius(np.abs(xs).max(axis=1), np.abs(x).max()), _radius(np.abs(us), np.sqrt(depth)))
            h *= Long(1e-21) ** (Long(1) / self.order)
            leaving = _value(us, h) <= 0
            h = _root(us, h, -1) if leaving else h
            over = _value(ts, h) >= end
            h = _root(ts - end * (np.arange(ts.size) == 0), h, 1) if over else h
            x, u, t = (_value(series, h) for series in (xs, us, ts))
            if over or leaving:
                return x, end if over else t

    def _series(self, x: NDArray, u: Long, t: Long, entry: Long) -> tuple[NDArray, NDArray, NDArray]:
        """Taylor coefficients in τ of x (N+1, n), u and t."""
        N, turn = self.order, Long(OMEGA)
        xs = np.zeros((N + 1, x.size), dtype=np.clongdouble)
        us, ts, cs, ss, squares, cubes, factor, v = (np.zeros(N + 1, dtype=Long) for _ in range(8))
        rates = np.zeros_like(xs)
        xs[0], us[0], ts[0], cs[0], ss[0] = x, u, t, np.cos(turn * t), np.sin(turn * t)
        for j in range(N):
            v[j] = self.delta_dot(xs[j])
            factor[j] = Long(FACTOR) / entry * v[j] + (j == 0)
            squares[j] = us[: j + 1] @ us[j::-1]
            cubes[j] = squares[: j + 1] @ us[j::-1]
            force = Long(STIFFNESS) * (cubes[: j + 1] @ factor[j::-1])
            rates[j] = self.rate * xs[j] + self.load * cs[j] + self.phi * force
            xs[j + 1] = us[j::-1] @ rates[: j + 1] / (j + 1)
            us[j + 1] = v[j] / (2 * (j + 1))
            ts[j + 1] = us[j] / (j + 1)
            cs[j + 1] = -turn * (us[j::-1] @ ss[: j + 1]) / (j + 1)
            ss[j + 1] = turn * (us[j::-1] @ cs[: j + 1]) / (j + 1)
        return xs, us, ts


def _radius(terms: Vector, scale: Long) -> Long:
    """About the radius of convergence, from the last two coefficients' sizes."""
    return min((scale / terms[j]) ** (Long(1) / j) for j in (terms.size - 2, terms.size - 1))


def _value(series: NDArray, h: Long) -> NDArray:
    """A power series at h."""
    total = series[-1]
    for term in series[-2::-1]:
        total = total * h + term
    return total


def _root(values: NDArray, h: Long, sign: int) -> Long:
    """First zero in (0, h] of a polynomial that ends with the given sign there and begins with the other."""
    low, high = Long(0), h
    for _ in range(90):
        middle = (low + high) / 2
        low, high = (low, middle) if sign * _value(values, middle) > 0 else (middle, high)
    return high


# --- making the file -------------------------------------------------------------------------------------------------


def unsolved(modes: int) -> Problem:
    """The problem with its starts, the tips not yet known."""
    model = paper_scene().reduce(modes)
    c, k = np.diag(model.system.C).copy(), np.diag(model.system.K).copy()
    empty = np.empty((0, 2 * modes))
    bare = Problem(k, c, model.participation, model.phi(TIP), empty, np.empty(0))
    starts = _starts(bare)
    return Problem(k, c, bare.gamma, bare.phi, starts, np.full(len(starts), np.nan))


def _starts(of: Problem) -> Vector:
    """Seeded throws of order 1 mm, settled for one period so that all modes take part; none begins at the stop."""
    random, method = np.random.default_rng(2003), solvers.DormandPrince(1e-8)
    starts = []
    while len(starts) < STARTS:
        q, q_dot = np.zeros((2, of.n))
        q[:2], q_dot[:2] = random.standard_normal((2, 2)) * LENGTH / of.phi[:2]
        q *= np.sign(q @ of.phi)  # above the stop
        q_dot[:2] *= np.sqrt(of.k[:2]) / 2
        settled = solvers.integrate(of.system, q, q_dot, DURATION / 10.0, method=method)
        if settled.q[-1] @ of.phi > 0.1 * LENGTH:
            starts.append(np.concatenate((settled.q[-1], settled.q_dot[-1])))
    return np.array(starts)


def solved(of: Problem) -> dict[str, Vector]:
    """Tips by this file's method, contacts per run, and how far the two witnesses are away, in mm."""
    import peers

    mine, contacts = Exact(of), []
    tips = np.empty(STARTS, dtype=Long)
    for i, start in enumerate(of.starts):
        tips[i] = mine.tip(start)
        contacts.append(mine.contacts)
    other = peers.heyoka(of, {"tol": 1e-18, "extended": True})
    double = peers.dormand_prince(of, {"rtol": 1e-14})
    return {
        "tips": tips.astype(float),
        "contacts": np.array(contacts),
        "heyoka": np.array([float(other(s)[0] - tip) for s, tip in zip(of.starts, tips, strict=True)]) / LENGTH,
        "dormand_prince": np.array([float(double(s)[0] - tip) for s, tip in zip(of.starts, tips, strict=True)])
        / LENGTH,
    }


def main() -> None:
    """Write the file and print the agreement."""
    stored = {}
    for modes in MODES:
        of = unsolved(modes)
        found = solved(of)
        names = {name: getattr(of, name) for name in ("k", "c", "gamma", "phi", "starts")}
        stored |= {f"{name}_{modes}": values for name, values in (names | found).items()}
        for name in ("heyoka", "dormand_prince"):
            off = np.abs(found[name])
            print(f"{modes:2d} modes, {name:14s}: median {np.median(off):.1e}, worst {off.max():.1e} of 1 mm; ", end="")
            print(f"contacts {found['contacts'].min()} to {found['contacts'].max()}")
    np.savez_compressed(FILE, **stored)


if __name__ == "__main__":
    main()
