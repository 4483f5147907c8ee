"""Motion with stops in 80-bit numbers by extrapolation: independent of every method, table and kernel of the library.

Gragg's modified midpoint rule, extrapolated in h² (Hairer, Nørsett, Wanner I, Section II.9), with error control; every
border of a law's pieces and every turning point of an indentation is landed on by halving true steps, so that grazes
of any depth are seen. Forces are written anew here. Slow: milliseconds a step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

REAL = np.longdouble
COLUMNS = 7
TOLERANCE = 1e-16 if np.finfo(REAL).eps < 1e-18 else 1e-14
_SUBSTEPS = 2 * np.arange(1, COLUMNS + 1)
_HALVINGS = 90
ROW = ("stop", "t_in", "t_out", "speed_in", "speed_out", "peak_indentation", "peak_force", "impulse", "energy_loss")


class Tone:
    """a cos(ωt + φ), as a signal of the library and in extended precision."""

    def __init__(self, amplitude: float, omega: float, phase: float) -> None:
        self.amplitude, self.omega, self.phase = amplitude, omega, phase

    def __call__(self, t: Any) -> Any:
        return self.amplitude * np.cos(self.omega * t + self.phase)

    def tones(self) -> Any:
        return np.array([self.omega]), np.array([self.amplitude * np.exp(1j * self.phase)])


def force_of(law: Any, piece: int) -> Callable[[Any, Any, Any], Any]:
    """F(δ, δ̇, entry rate) of a law's piece, on arrays of extended numbers, from its parameters."""
    if law.compiled == "power":
        K, p, a, c, r, clamp, approach = (REAL(x) for x in law.parameters)

        def power(d: Any, v: Any, entry: Any) -> Any:
            d = np.maximum(d, 0)
            force = K * d**p * (1 + a * v / entry)
            damped = np.where(v > 0, v, 0) if approach else v
            force = force + c * d**r * damped if c else force
            return np.maximum(force, 0) if clamp else force

        return power
    if law.compiled == "piecewise":
        knot, c0, c1, c2, c3, viscosity = law.parameters[1:].reshape(-1, 6).astype(REAL)[piece - 1]

        def piecewise(d: Any, v: Any, entry: Any) -> Any:
            x = np.maximum(d, 0) - knot
            return c0 + x * (c1 + x * (c2 + x * c3)) + viscosity * v

        return piecewise
    function, values = law.function, [REAL(x) for x in law.parameters]
    return np.vectorize(lambda d, v, entry: function(max(d, REAL(0)), v, entry, *values), otypes=[REAL])


class Motion:
    """M q'' + C q' + K q = Σ loads + Σ w F with diagonal M; state [q, q', work and impulse of every stop]."""

    def __init__(self, system: Any, q0: Any, q_dot0: Any) -> None:
        self.n, self.stops = system.size, len(system.contacts)
        self.M = np.diag(np.asarray(system.M, REAL))
        self.C, self.K = np.asarray(system.C, REAL), np.asarray(system.K, REAL)
        self.w = np.array([c.direction for c in system.contacts], REAL).reshape(self.stops, self.n)
        self.gap = np.array([c.gap for c in system.contacts], REAL)
        self.laws = [c.law for c in system.contacts]
        self.levels = [[REAL(-math.inf), REAL(0), *map(REAL, law.knots), REAL(math.inf)] for law in self.laws]
        self.loads = [(np.asarray(vector, REAL), signal) for vector, signal in system.loads]
        self.fastest = float(np.sqrt(np.abs(np.linalg.eigvals((self.K / self.M[:, None]).astype(float))).max()))
        self.fastest += float(np.abs(self.C / self.M[:, None]).sum()) + max([s.omega for _, s in self.loads], default=0)
        self.x = np.concatenate((np.asarray(q0, REAL), np.asarray(q_dot0, REAL), np.zeros(2 * self.stops, REAL)))
        self.t, self.h = REAL(0), 1e-4 / self.fastest
        self.size = np.maximum(np.abs(self.x), 0)
        self.entry, self.forces = np.ones(self.stops, REAL), [force_of(law, 1) for law in self.laws]
        self.piece, self.rows, self.open = [0] * self.stops, [], {}
        for s in range(self.stops):
            delta = self.delta(self.x, s)
            self.piece[s] = sum(bool(delta > level) for level in self.levels[s][1:])
            if self.piece[s]:
                self.begin(s)
                self.forces[s] = force_of(self.laws[s], self.piece[s])

    # --- equations

    def delta(self, x: Any, s: int) -> Any:
        return -(x[..., : self.n] @ self.w[s]) - self.gap[s]

    def rate(self, x: Any, s: int) -> Any:
        return -(x[..., self.n : 2 * self.n] @ self.w[s])

    def force(self, x: Any, s: int) -> Any:
        return self.forces[s](self.delta(x, s), self.rate(x, s), self.entry[s])

    def slope(self, t: Any, x: Any) -> Any:
        """Rates of a batch of states (k, size) at times (k,)."""
        n = self.n
        q, v = x[:, :n], x[:, n : 2 * n]
        out = np.zeros_like(x)
        out[:, :n] = v
        total = -(v @ self.C.T) - q @ self.K.T
        for vector, signal in self.loads:
            value = REAL(signal.amplitude) * np.cos(REAL(signal.omega) * t + REAL(signal.phase))
            total = total + value[:, None] * vector
        for s in range(self.stops):
            if self.piece[s]:
                force = self.force(x, s)
                total = total + force[:, None] * self.w[s]
                out[:, 2 * n + 2 * s], out[:, 2 * n + 2 * s + 1] = force * self.rate(x, s), force
        out[:, n : 2 * n] = total / self.M
        return out

    def step(self, h: Any) -> tuple[Any, float]:
        """(state after h, estimated error in units of the tolerance); all columns of the table at once."""
        small = (REAL(h) / _SUBSTEPS)[:, None]
        first = self.slope(np.array([self.t]), self.x[None, :])
        before = np.repeat(self.x[None, :], COLUMNS, axis=0)
        now, table = before + small * first, np.empty_like(before)
        for m in range(1, int(_SUBSTEPS[-1]) + 1):
            rate = self.slope(self.t + m * small[:, 0], now)
            done = int(np.flatnonzero(m == _SUBSTEPS)[0]) if m in _SUBSTEPS else -1
            if done >= 0:
                table[done] = 0.5 * (now[done] + before[done] + small[done] * rate[done])
            before, now = now, before + 2 * small * rate
        for k in range(1, COLUMNS):
            less = table[-1].copy()
            ratio = (REAL(1) * _SUBSTEPS[k:] / _SUBSTEPS[:-k]) ** 2
            table[k:] = table[k:] + (table[k:] - table[k - 1 : -1]) / (ratio - 1)[:, None]
        difference = np.abs(table[-1] - less)
        n = self.n
        scale = np.maximum(self.size, np.abs(self.x))
        scale[:n] = np.maximum(scale[:n], scale[n : 2 * n] / self.fastest)
        error = float((difference[: 2 * n] / np.maximum(scale[: 2 * n], 1e-300)).max()) / TOLERANCE
        return table[-1], error if math.isfinite(error) else 1e9

    # --- events

    def outward(self, x: Any, s: int, way: int) -> Any:
        """How far a stop is beyond the upper (+1) or lower (-1) border of its piece."""
        level = self.levels[s][self.piece[s] + (1 if way > 0 else 0)]
        return way * (self.delta(x, s) - level) if math.isfinite(level) else REAL(-math.inf)

    def root(self, value: Callable[[Any], Any], low: Any, high: Any) -> Any:
        """Duration in (low, high] at which an ascending value becomes positive: Illinois, on true steps."""
        low, high = REAL(low), REAL(high)
        f_low, f_high = value(self.step(low)[0]) if low > 0 else value(self.x), value(self.step(high)[0])
        if not f_low < 0:
            return low
        for _ in range(_HALVINGS):
            middle = high - f_high * (high - low) / (f_high - f_low)
            if not low < middle < high:
                middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            f = value(self.step(middle)[0])
            if f > 0:
                high, f_high, f_low = middle, f, 0.5 * f_low
            else:
                low, f_low, f_high = middle, f, 0.5 * f_high
            if f == 0 or high - low < 1e-19 * (abs(self.t) + high):
                break
        return high

    def events(self, h: Any, x: Any) -> list[tuple[Any, int, int]]:
        """(duration, stop, way) of every border crossed in the step that ends at x."""
        found = []
        for s in range(self.stops):
            for way in (1, -1) if self.piece[s] else (1,):
                begin, turned = way * self.rate(self.x, s), way * self.rate(x, s)
                low = REAL(0)
                if begin < 0 < turned:  # away, then back
                    low = self.root(lambda z, s=s, way=way: way * self.rate(z, s), 0, h)
                beyond, high = self.outward(x, s, way) > 0, h
                if not beyond and begin > 0 > turned:  # it may have been beyond
                    high = self.root(lambda z, s=s, way=way: -way * self.rate(z, s), 0, h)
                    beyond = self.outward(self.step(high)[0], s, way) > 0
                if beyond:
                    found.append((self.root(lambda z, s=s, way=way: self.outward(z, s, way), low, high), s, way))
        return found

    # --- log

    def begin(self, s: int) -> None:
        rate, n = abs(self.rate(self.x, s)), 2 * self.n + 2 * s
        self.entry[s] = max(rate, REAL(self.laws[s].entry_rate_floor))
        self.open[s] = [s, self.t, math.nan, rate, math.nan, max(self.delta(self.x, s), REAL(0)), -math.inf,
                        self.x[n + 1], self.x[n]]  # fmt: skip

    def row(self, s: int) -> list[float]:
        row, n = list(self.open[s]), 2 * self.n + 2 * s
        row[7], row[8] = self.x[n + 1] - row[7], self.x[n] - row[8]
        return [float(number) for number in row]

    def switch(self, s: int, way: int) -> None:
        if self.piece[s] == 0:
            self.begin(s)
        self.piece[s] += way
        if self.piece[s] == 0:
            self.open[s][2], self.open[s][4] = self.t, -self.rate(self.x, s)
            self.rows.append(self.row(s))
        else:
            self.forces[s] = force_of(self.laws[s], self.piece[s])
        self.h = min(self.h, 1e-6 / self.fastest)

    def watch(self, h: Any, x: Any) -> None:
        """Largest indentation and force within a step, at turning points found by true steps."""
        for s, row in self.open.items():
            if not self.piece[s]:
                continue
            row[5] = max(row[5], self.delta(x, s))
            if self.rate(self.x, s) > 0 > self.rate(x, s):
                top = self.root(lambda z, s=s: -self.rate(z, s), 0, h)
                row[5] = max(row[5], self.delta(self.step(top)[0], s))
            values = [self.force(z, s) for z in (self.x, self.step(0.5 * h)[0], x)]
            row[6] = max(row[6], *values)
            small = 1e-4 * h
            rising = self.force(self.step(small)[0], s) > values[0]
            falling = self.force(self.step(h - small)[0], s) > values[2]
            if rising and falling and max(values) > 0.8 * row[6]:
                row[6] = max(row[6], self.highest(s, h))

    def highest(self, s: int, h: Any) -> Any:
        """Largest force inside a step, by golden section."""
        a, b, golden, best = REAL(0), REAL(h), (math.sqrt(5) - 1) / 2, REAL(-math.inf)
        for _ in range(28):
            c, d = b - golden * (b - a), a + golden * (b - a)
            at_c, at_d = self.force(self.step(c)[0], s), self.force(self.step(d)[0], s)
            a, b, best = (a, d, max(best, at_c)) if at_c > at_d else (c, b, max(best, at_d))
        return best

    # --- the run

    def settle(self) -> None:
        """Switch what sits on a border, to rounding, and moves out of its piece."""
        for s in range(self.stops):
            near = 1e-18 * (float(np.abs(self.w[s]) @ np.abs(self.x[: self.n])) + abs(float(self.gap[s])))
            for way in (1, -1) if self.piece[s] else (1,):
                if self.outward(self.x, s, way) >= -near and way * self.rate(self.x, s) > 0:
                    self.switch(s, way)
                    break

    def run(self, duration: float, most: int = 20000) -> Motion:
        """Advance to ``duration``."""
        end = REAL(duration)
        self.settle()
        for _ in range(most):
            if self.t >= end:
                return self
            h = min(REAL(self.h), REAL(0.5 / self.fastest), end - self.t)
            x, error = self.step(h)
            if not error <= 1.0:
                self.h = float(h) * max(0.1, 0.8 * error ** (-1.0 / (2 * COLUMNS - 1)))
                continue
            self.h = float(h) * min(4.0, 0.8 * max(error, 1e-10) ** (-1.0 / (2 * COLUMNS - 1)))
            found = self.events(h, x)
            if found:
                h = min(duration for duration, _, _ in found)
                x = self.step(h)[0]
            self.watch(h, x)
            self.t, self.x = (end if h == end - self.t else self.t + h), x
            self.size = np.maximum(self.size, np.abs(x))
            for s, way in [(s, way) for duration, s, way in found if duration == h]:
                self.switch(s, way)
            self.settle()
        raise RuntimeError("too many steps")

    def log(self) -> np.ndarray:
        """Rows of the contact log, those under way last, in the order of `ContactLog`."""
        under_way = [self.row(s) for s in range(self.stops) if self.piece[s]]
        return np.array(self.rows + under_way).reshape(-1, len(ROW))
