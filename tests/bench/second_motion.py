"""Laws and time integration of the second implementation: SciPy's DOP853 from border to border.

    q'' + C q' + ω² q = -Γ (ÿ + g) + Σ φ f + Σ w F(δ, δ̇),    δ = -w·q - gap

Every law is a machine of few states with borders at which it goes over to another one: a stop is open until δ rises
through zero. Forces cut at zero, and the kink of Bouc and Wen at a reversal, are left to the control of steps.
Besides the motion, the work of loads and dampers and the work and impulse of every contact are integrated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

FACTORS = {
    "lankarani_nikravesh": lambda e: 0.75 * (1 - e * e),
    "hunt_crossley": lambda e: 1.5 * (1 - e),
    "flores": lambda e: 1.6 * (1 - e) / e,
    "gonthier": lambda e: (1 - e * e) / e,
}
FLOOR = 1e-3  # m/s, the least rate of entry that a law sees unless it says otherwise
MOST_BORDERS = 3000
INSIDE = np.arange(1, 16) / 16  # parts of a step at which open stops are looked at
MOST_REFINED, SHORTER = 4, 8.0  # trials with shorter steps where one passes its surface between them
WITHIN = 1.0 - 1e-12  # of its limit is where a slider sticks: at it, rounding could let it slip on at once


class TooManyError(RuntimeError):
    """A run passes more borders than the reference has patience for."""


@dataclass
class Acting:
    """A stop or element: what it is now, and what it latched."""

    law: Any
    gap: float
    w: Any
    always: bool
    state: str = "open"
    entry: float = 0.0
    place: float = 0.0  # of a slider
    place_at: int = 0  # of z of Bouc and Wen among the integrated numbers

    def __post_init__(self) -> None:
        kind, law = self.law["kind"], self.law
        if kind == "jenkins":
            self.k, self.f, self.h = law["stiffness"], law["limit"], 0.0
        elif kind == "elasto_plastic":
            self.h = law.get("hardening", 0.0)
            self.k = law["stiffness"] - self.h
            self.f = law["yield_force"] * (1 - self.h / law["stiffness"])
        self.floor = law.get("entry_rate_floor", FLOOR)
        self.slides = kind in ("jenkins", "elasto_plastic")
        if self.always:
            self.state = "stick" if self.slides else "on"

    def force(self, d: Any, v: Any, z: Any) -> Any:
        """Force in the present state."""
        if self.state == "open":
            return 0.0 * d
        if self.slides:
            return self.h * d + (self.k * (d - self.place) if self.state == "stick" else self.f * SIGN[self.state])
        force = self.smooth(d, v, z)
        return np.maximum(force, 0.0) if self.law.get("clamp") else force

    def smooth(self, d: Any, v: Any, z: Any = 0.0) -> Any:
        """Force of a law without borders of its own."""
        kind, law = self.law["kind"], self.law
        if kind == "polynomial":
            return sum(c * d ** (j + 1) for j, c in enumerate(law["coefficients"]))
        if kind == "kelvin_voigt":
            return law["stiffness"] * d + law["damping"] * v
        if kind == "bouc_wen":
            return law["stiffness"] * (law["alpha"] * d + (1 - law["alpha"]) * z)
        if kind == "piecewise_linear":
            knots, slopes = [0.0, *law.get("knots", ())], law["slopes"]
            branch = int(self.state[6:]) if self.state.startswith("branch") else 0
            below = sum(k * (b - a) for k, a, b in zip(slopes, knots[:branch], knots[1 : branch + 1], strict=False))
            return below + slopes[branch] * (d - knots[branch])
        power = law["stiffness"] * np.maximum(d, 0.0) ** law.get("exponent", 1.5)
        if kind == "hertz":
            return power
        a = law["damping_factor"] if kind == "hysteretic" else FACTORS[kind](law["restitution"])
        return power * (1.0 + a * v / self.entry)

    def first_z(self, d: float) -> float:
        """z of Bouc and Wen (n = 1) at the start: that of a path from δ = 0 straight to where it begins."""
        rate = self.law["beta"] + self.law["gamma"]
        return math.copysign(self.law["A"] / rate * -math.expm1(-rate * abs(d)), d)

    def z_rate(self, v: float, z: float) -> float:
        """z' of Bouc and Wen."""
        law = self.law
        n = law.get("n", 1)
        return law["A"] * v - law["beta"] * abs(v) * abs(z) ** (n - 1) * z - law["gamma"] * v * abs(z) ** n

    def borders(self) -> list[tuple[Any, float, str]]:
        """(function of δ, δ̇, z, direction in which it passes zero, next state)."""
        if self.state == "open":
            return [(lambda d, v, z: d, 1.0, "enter")]
        if self.slides and self.state == "stick":
            force = lambda d: self.k * (d - self.place)  # noqa: E731
            return [(lambda d, v, z: force(d) - self.f, 1.0, "up"), (lambda d, v, z: force(d) + self.f, -1.0, "down")]
        if self.slides:
            return [(lambda d, v, z: v, -SIGN[self.state], "stick")]
        found = [] if self.always else [(lambda d, v, z: d, -1.0, "open")]
        if self.state.startswith("branch"):
            j, knots = int(self.state[6:]), self.law.get("knots", ())
            found += [(lambda d, v, z: d - knots[j], 1.0, f"branch{j + 1}")] if j < len(knots) else []
            found += [(lambda d, v, z: d - knots[j - 1], -1.0, f"branch{j - 1}")] if j > 0 else []
        return found

    def enter(self, d: float, v: float) -> None:
        """A contact begins, or lasts from the start on."""
        self.entry, self.state = max(abs(v), self.floor), "on"
        if self.law["kind"] == "piecewise_linear":
            self.state = f"branch{sum(d > knot for knot in self.law.get('knots', ()))}"

    def go(self, to: str, d: float, v: float) -> None:
        """Pass a border."""
        if to == "enter":
            self.enter(d, v)
            return
        if to == "stick":
            self.place = d - SIGN[self.state] * WITHIN * self.f / self.k
        self.state = to


SIGN = {"up": 1.0, "down": -1.0}


@dataclass
class Motion:
    """What was integrated: pieces of dense output, and contacts as dicts."""

    omega: Any
    C: Any
    loads: Any  # (c, n)
    signals: list[Any]
    acting: list[Acting]
    pieces: list[Any] = field(default_factory=list)
    log: list[dict[str, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.n, self.W = len(self.omega), np.array([a.w for a in self.acting]).reshape(-1, len(self.omega))
        self.gaps = np.array([a.gap for a in self.acting])
        self.hysteretic = [i for i, a in enumerate(self.acting) if a.law["kind"] == "bouc_wen"]
        n, self.m = self.n, len(self.acting)
        self.A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(self.omega**2), -self.C]])
        self.D = np.kron(np.eye(2), -self.W)

    def local(self, y: Any) -> tuple[Any, Any, Any]:
        """δ, δ̇ and z of all, of one state or of columns of states."""
        n, m = self.n, self.m
        gaps = self.gaps if y.ndim == 1 else self.gaps[:, None]
        return -self.W @ y[:n] - gaps, -self.W @ y[n : 2 * n], y[2 * n + 2 + 2 * m :]

    def forces(self, y: Any) -> Any:
        """Forces in the present states."""
        d, v, z = self.local(y)
        return np.array([a.force(d[i], v[i], z[i]) for i, a in enumerate(self.acting)]).reshape(d.shape)

    def load(self, t: float) -> Any:
        """Forces of the signals on the coordinates."""
        return np.array([s(t) for s in self.signals]) @ self.loads if self.signals else np.zeros(self.n)

    def rate(self, t: float, y: Any) -> Any:
        """Derivative of [q, q̇, work of loads, work of damping, work and impulse and z of each]."""
        n, m = self.n, self.m
        x, u = y[: 2 * n], y[n : 2 * n]
        local, load, z = self.D @ x, self.load(t), y[2 * n + 2 + 2 * m :]
        v, found = local[m:], np.zeros(len(y))
        F = np.array([one.force(local[i] - one.gap, v[i], z[i]) for i, one in enumerate(self.acting)])
        found[: 2 * n] = self.A @ x
        found[n : 2 * n] += load + F @ self.W
        found[2 * n : 2 * n + 2] = load @ u, u @ self.C @ u
        found[2 * n + 2 : 2 * n + 2 + m], found[2 * n + 2 + m : 2 * n + 2 + 2 * m] = F * v, F
        for i in self.hysteretic:
            found[2 * n + 2 + 2 * m + i] = self.acting[i].z_rate(v[i], z[i])
        return found

    def run(self, q: Any, u: Any, duration: float, breaks: list[float], rtol: float, sizes: Any) -> Motion:
        """Integrate; ``breaks``: kinks of signals. ``sizes``: of q and q', (2,) or (2, n), for absolute tolerances."""
        self.duration = duration
        n, m = self.n, self.m
        y, t = np.concatenate([q, u, np.zeros(2 + 3 * m)]), 0.0
        d, v, _ = self.local(y)
        a = -self.W @ self.rate(0.0, y)[n : 2 * n]
        for i, one in enumerate(self.acting):
            if one.law["kind"] == "bouc_wen":
                y[2 * n + 2 + 2 * m + i] = one.first_z(d[i])
                continue
            if not one.always and (d[i] > 0 or (d[i] == 0 and (v[i] > 0 or (v[i] == 0 and a[i] > 0)))):
                one.enter(d[i], v[i])
                self.begin(i, t, d[i], v[i], y)
            elif one.slides and abs(one.k * d[i]) > one.f:
                one.state = "up" if d[i] > 0 else "down"
                if v[i] * d[i] < 0:
                    one.go("stick", d[i], v[i])
        least = np.min(sizes[1])
        each, work = [size * np.ones(n) for size in sizes], np.full(2, np.max(sizes[1]) ** 2)
        atol = rtol * np.concatenate([*each, work, np.full(m, least**2), np.full(2 * m, least)])
        for end in [*[b for b in sorted(set(breaks)) if 0 < b < duration], duration]:
            while t < end:
                t, y = self.stretch(t, y, end, rtol, atol)
                if len(self.pieces) > MOST_BORDERS:
                    raise TooManyError
        for one in self.log:
            if "t_out" not in one:
                self.finish(one, duration, y, math.nan)
        self.log = [one for one in self.log if one["peak_force"] != 0.0]  # at rest on its surface, left at once
        self.end = y
        return self

    def stretch(self, t: float, y: Any, end: float, rtol: float, atol: Any) -> tuple[float, Any]:
        """To the next border."""
        events, what, (d, v, z) = [], [], self.local(y)
        for i, one in enumerate(self.acting):
            for value, direction, to in one.borders():

                def event(t: float, y: Any, i: int = i, value: Any = value, near: float = -1e-300 * direction) -> float:
                    d, v, z = self.local(y)
                    return float(value(d[i], v[i], z[i])) or near  # at rest on a border it has not passed

                event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
                events.append(event)
                what.append((i, to, value, direction, direction * value(d[i], v[i], z[i]) < 0.0))
        longest = 1.0 / max(self.omega.max(), 1e-300)
        for _ in range(MOST_REFINED):
            found = solve_ivp(self.rate, (t, end), y, "DOP853", dense_output=True, events=events or None, rtol=rtol,
                              atol=atol, max_step=longest)  # fmt: skip
            assert found.status >= 0, found.message
            if not self.passes_surface(found):
                break
            longest /= SHORTER
        self.pieces.append((t, found.t[-1], found.sol, [(a.state, a.entry, a.place) for a in self.acting]))
        t, y = found.t[-1], found.y[:, -1]
        d, v, z = self.local(y)
        for (i, to, value, direction, ahead), times in zip(what, found.t_events or (), strict=True):
            # SciPy tells one of several events at one time: the others are behind by rounding.
            if len(times) or (ahead and direction * value(d[i], v[i], z[i]) >= 0.0):
                if to == "open":
                    self.finish(self.latest(i), t, y, abs(v[i]))
                    self.latest(i)["t_out"] = t
                self.acting[i].go(to, d[i], v[i])
                if to == "enter":
                    self.begin(i, t, d[i], v[i], y)
        return t, y

    def passes_surface(self, found: Any) -> bool:
        """Whether an open stop is in contact between two steps, which SciPy's events do not see."""
        t = (found.t[:-1, None] + np.diff(found.t)[:, None] * INSIDE).ravel()
        d = self.local(found.sol(t))[0]
        is_open = [one.state == "open" for one in self.acting]
        return bool((d[is_open] > 1e-12 * np.abs(d[is_open]).max(initial=0.0)).any())

    def latest(self, i: int) -> dict[str, float]:
        """The last contact of a stop."""
        return [one for one in self.log if one["stop"] == i][-1]

    def begin(self, i: int, t: float, d: float, v: float, y: Any) -> None:
        """A row of the log."""
        n, m, clipped = self.n, self.m, float(abs(v) < self.acting[i].floor)
        self.log.append({"stop": i, "t_in": t, "speed_in": abs(v), "entry_rate_clipped": clipped,
                         "_work": y[2 * n + 2 + i], "_impulse": y[2 * n + 2 + m + i]})  # fmt: skip

    def finish(self, one: dict[str, float], t: float, y: Any, speed: float) -> None:
        """Its end."""
        n, m, i = self.n, self.m, int(one["stop"])
        one |= {"t_out": math.nan, "speed_out": speed, "energy_loss": y[2 * n + 2 + i] - one.pop("_work"),
                "impulse": y[2 * n + 2 + m + i] - one.pop("_impulse")}  # fmt: skip
        tops = [self.top(piece, one["t_in"], t, i) for piece in self.pieces]
        one["peak_indentation"], one["peak_force"] = np.max(tops, axis=0)

    def top(self, piece: Any, begin: float, end: float, i: int) -> tuple[float, float]:
        """Largest δ and force of a stop in one piece of a contact."""
        a, b = max(begin, piece[0]), min(end, piece[1])
        if not a < b:
            return -math.inf, -math.inf
        count = 400 + int(8.0 * (b - a) * self.omega.max())
        t, result = np.linspace(a, b, count), []
        for which in (0, 1):
            values = self.seen(piece, t)[which][i]
            j = int(np.argmax(values))
            around = (t[max(j - 1, 0)], t[min(j + 1, count - 1)])
            best = minimize_scalar(
                lambda x, which=which: -self.seen(piece, np.array([x]))[which][i, 0], bounds=around, method="bounded",
                options={"xatol": 1e-9 * (b - a)},
            )  # fmt: skip
            result.append(max(values[j], -best.fun))
        return result[0], result[1]

    def seen(self, piece: Any, t: Any, moved: Any = 0.0) -> tuple[Any, Any]:
        """δ and forces (m, k) at times within a piece, states moved."""
        now = [(a.state, a.entry, a.place) for a in self.acting]
        self.put(piece[3])
        y = piece[2](t) + moved
        found = self.local(y)[0], self.forces(y)
        self.put(now)
        return found

    def put(self, states: Any) -> None:
        """States of all laws."""
        for one, state in zip(self.acting, states, strict=True):
            one.state, one.entry, one.place = state

    def at(self, times: Any, shift: Any = 0.0) -> tuple[Any, Any]:
        """States (k, …) and forces (k, m) at times, with [q, q̇] moved by parts of their size in the run."""
        times = np.minimum(times, self.duration)  # the last sample may be beyond by rounding
        moved = np.zeros((len(self.end), 1))
        if np.any(shift):
            sizes = [np.abs(p[2](np.linspace(*p[:2], 9))).max(axis=1) for p in self.pieces]
            moved[: 2 * self.n, 0] = shift * np.max(sizes, axis=0)[: 2 * self.n]
        states, forces = np.zeros((len(times), len(self.end))), np.zeros((len(times), self.m))
        for piece in self.pieces:
            here = np.flatnonzero((times >= piece[0]) & (times <= piece[1]))
            if len(here):
                states[here] = (piece[2](times[here]) + moved).T
                forces[here] = self.seen(piece, times[here], moved)[1].T
        return states, forces
