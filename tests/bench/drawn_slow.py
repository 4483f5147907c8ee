"""Structures beside whose periods the cells of sampled loads are short or long, 1e-4 to 1e3, for `drawn.py`.

With short pulses in flight or in contact, soft and stiff modes up to 1e5, loads that nearly cancel a preload, little or
no damping, jumps at both ends of a record, several cells, rigid modes that drift, loads that begin late, contacts much
longer than a period, and units from 1e-9 to 1e3 m and 1e-6 to 1e6 kg. Slow modes beside fast ones that follow a moving
support, or rest until a stop pushes. Gaps are placed on the path of the structure without stops.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import fembeam as fb
from solvers import Contact, DormandPrince, System, integrate
from solvers.problem.signals import quintics

MOST_CELLS = 30_000  # of a load in a run: the reference takes a step for each
MOST_UNEQUAL = 30  # cells of tables that are cut to a common grid, 160 times finer
MOST_RADIANS = 3e4  # of the fastest mode in a run: the reference takes a step for every sixth
PLACES = 4000  # of the path without stops


class Table:
    """A load that is a node table, with one or both sides of each node."""

    def __init__(self, dt: float, rows: Any) -> None:
        self.dt, self.rows = dt, rows

    def __call__(self, t: Any) -> Any:
        x = np.asarray(t, dtype=float) / self.dt
        cell = np.clip(x.astype(np.int64), 0, len(self.rows) - 2)
        return quintics(self.dt, self.rows, cell, x - cell)[0]

    def nodes(self, duration: float, rtol: float) -> tuple[float, Any]:
        return self.dt, self.rows


def _rough(rng: np.random.Generator, size: float, dt: float, count: int) -> Any:
    """Values, slopes and curvatures that know nothing of each other."""
    return size * rng.standard_normal((count, 3)) * 0.3 / dt ** np.arange(3.0)


def _kinked(rng: np.random.Generator, size: float, dt: float, count: int) -> Any:
    """The same with slopes and curvatures of its own on either side of each node."""
    both = np.hstack((_rough(rng, size, dt, count), _rough(rng, size, dt, count)))
    both[:, 3] = both[:, 0]
    return both


def _lines(rng: np.random.Generator, size: float, dt: float, count: int) -> Any:
    """Straight lines between random values, or from zero to zero but for a few."""
    values = size * rng.standard_normal(count)
    if rng.random() < 0.4:
        values[rng.random(count) > 10.0 ** rng.uniform(-2.0, -0.5)] = 0.0
    slopes = np.diff(values, append=values[-1]) / dt
    sides = np.zeros((count, 6))
    sides[:, 0], sides[:, 3], sides[:, 1], sides[1:, 4] = values, values, slopes, slopes[:-1]
    return sides


def _waves(rng: np.random.Generator, size: float, dt: float, count: int) -> Any:
    """A sine of 3 to 300 cells that is nearly smooth on its grid, and a rest that is none."""
    w = 2.0 * math.pi / (dt * 10.0 ** rng.uniform(0.5, 2.5))
    phase = w * dt * np.arange(count) + rng.uniform(0.0, 6.0)
    return size * np.stack((np.sin(phase), w * np.cos(phase), -w * w * np.sin(phase)), axis=1)


def _knocks(rng: np.random.Generator, size: float, dt: float, count: int) -> Any:
    """One to four nodes that are not zero, ten times as large."""
    rows = np.zeros((count, 3))
    at = rng.integers(0, count, rng.integers(1, 5))
    rows[at, 0] = 10.0 * size * rng.standard_normal(at.size)
    return rows


def draw_table(rng: np.random.Generator, size: float, dt: float, duration: float) -> tuple[Any, str]:
    """A load of cells dt: of any kind, from the start or beginning late, with a large mean or none."""
    dt = max(dt, duration / MOST_CELLS)
    count = max(3, math.ceil(duration / dt * (1.0 + 1e-9)) + 1)
    kinds: list[Callable[..., Any]] = [_rough, _kinked, _lines, _waves, _knocks]
    kind = kinds[rng.integers(len(kinds))]
    rows, words = kind(rng, size, dt, count), kind.__name__[1:]
    if rng.random() < 0.25:
        rows[: int(count * rng.uniform(0.0, 0.9))] = 0.0
        rows[:, 3:4] = rows[:, :1] if rows.shape[1] == 6 else rows[:, 3:4]
        words += " late"
    return Table(dt, rows), f"{words} {dt:.3g} s"


def draw_once(rng: np.random.Generator, size: float, duration: float, kinds: int) -> tuple[Any, str]:
    """A pulse or a step of 1e-3 to 1 of the run, or as the third of ``kinds`` a record that begins with a jump."""
    kind, length = rng.integers(kinds), duration * 10.0 ** rng.uniform(-3.0, 0.0)
    if kind == 0:
        return fb.Pulse(size * rng.choice([-1.0, 1.0]), length, rng.uniform(0.0, 0.9) * duration), f"pulse {length:.3g}"
    if kind == 1:
        return fb.Step(size * rng.choice([-1.0, 1.0]), length, rng.uniform(0.0, 0.9) * duration), f"step {length:.3g}"
    count = int(rng.integers(8, 200))
    h = duration * rng.uniform(0.2, 1.0) / (count - 1)
    padding = 1.2 * duration - h * (count - 1)
    record = _Padded(h, size * (1.0 + 0.3 * rng.standard_normal(count)), padding)
    return record, f"record {h:.3g}"


class _Padded:
    """A record of straight lines that begins with a jump, and drops to zero within a step before zeros are added."""

    def __init__(self, h: float, values: Any, padding: float) -> None:
        zeros = np.zeros(math.ceil(padding / h) + 2)
        y = np.concatenate((values, zeros))
        self.record = fb.Record(h * np.arange(y.size), y, quantity="force", interpolation="linear")

    def __call__(self, t: Any) -> Any:
        return self.record(t)

    def nodes(self, duration: float, rtol: float) -> tuple[float, Any]:
        return self.record.nodes(duration, rtol)


def _frequencies(rng: np.random.Generator, low: float, n: int) -> Any:
    """From ``low`` on, up to 1e5 as fast, some of the same; the lowest may be none."""
    spread = rng.choice([0.5, 1.5, 3.0, 5.0])
    omega = low * np.concatenate(([1.0], 10.0 ** rng.uniform(0.0, spread, n - 1)))
    if rng.random() < 0.25:
        omega[0] = 0.0
    return omega


def _path(system: System, q0: Any, q_dot0: Any, duration: float) -> tuple[Any, Any, Any]:
    """Times, coordinates and rates without stops."""
    free = System(system.M, system.C, system.K, [], system.loads)
    found = integrate(free, q0, q_dot0, duration, duration / PLACES, DormandPrince(1e-7), check=False)
    return found.t, found.q, found.q_dot


def _placed(rng: np.random.Generator, way: Any, rate: Any) -> tuple[float, float, str]:
    """A gap that a path meets soon, late, hardly, or from the start on, pressed or at rest; and the speed there."""
    span, fast = float(np.ptp(way)), float(np.abs(rate).max())
    kind = rng.integers(5)
    if kind == 0:  # met late: what was never reached before
        i = int(len(way) * rng.uniform(0.2, 0.95))
        gap, words = float(way[:i].max()), "late"
    elif kind == 1:
        gap, words = float(way[0] + rng.uniform(0.0, 1.0) * (way.max() - way[0])), "met"
    elif kind == 2:
        gap, words = float(way.max() - span * 10.0 ** rng.uniform(-6.0, -1.0)), "hardly"
    elif kind == 3:
        gap, words = float(way[0]), "touching"
    else:
        gap, words = float(way[0] - span * 10.0 ** rng.uniform(-4.0, 1.0)), "pressed"
    above = np.flatnonzero(way > gap)
    speed = abs(float(rate[above[0]])) if above.size and kind < 3 else fast * rng.uniform(0.1, 1.0)
    return gap, max(speed, 1e-3 * fast), words


def draw_slow(rng: np.random.Generator) -> Any:
    """One to four modes under one to three loads of cells 1e-4 to 1e3 of a period, and one to three stops."""
    from drawn import Scene, draw_law

    n, low = int(rng.integers(1, 5)), 10.0 ** rng.uniform(-1.0, 3.0)
    length, mass = 10.0 ** rng.uniform(-9.0, 3.0), 10.0 ** rng.uniform(-6.0, 6.0)
    if rng.random() < 0.5:
        length, mass = 10.0 ** rng.uniform(-4.0, -1.0), 1.0
    omega = _frequencies(rng, low, n)
    zeta = rng.choice([0.0, 1e-12, 1e-6, 1e-3, 0.02, 0.3])
    period = 2.0 * math.pi / rng.choice([low, max(omega.max(), low)])
    ratio = 10.0 ** rng.uniform(-4.0, 3.0)
    dt = ratio * period
    duration = max(rng.uniform(0.5, 8.0) * 2.0 * math.pi / low, dt * rng.uniform(0.3, 12.0))
    duration = min(duration, MOST_RADIANS / max(omega.max(), low) * rng.uniform(0.3, 1.0), dt * MOST_CELLS)
    force = mass * length * low**2
    loads, words = [], f"n={n} ω=[{omega.min():.3g}..{omega.max():.3g}] ζ={zeta:.1g} T={duration:.3g} m={mass:.1g} "
    for i in range(rng.integers(1, 4)):
        steps, few = [1.0, 0.5, 2.0, 0.75, 10.0 ** rng.uniform(-1.5, 1.5)], duration < MOST_UNEQUAL * dt
        own = dt if i == 0 else dt * float(rng.choice(steps if few else steps[:3]))
        if rng.random() < 0.25:
            signal, kind = draw_once(rng, force, duration, 3 if few else 2)
        else:
            signal, kind = draw_table(rng, force, own, duration)
        row, words = rng.standard_normal(n), f"{words} {kind}"
        loads.append((row, signal))
        if rng.random() < 0.2:
            many = 10.0 ** rng.uniform(1.0, 3.0)  # more is rounding of what is left
            loads.append((row, fb.Harmonic(-many * force, 0.0)))
            loads.append((row, fb.Harmonic(many * force * (1.0 + 10.0 ** rng.uniform(-8.0, -1.0)), 0.0)))
            words += " offset"
    M, C, K = mass * np.eye(n), mass * np.diag(2.0 * zeta * omega), mass * np.diag(omega**2)
    system, moved = System(M, C, K, [], loads), rng.choice([1e-6, 1.0, 1.0])  # hardly: may be at rest for long
    q0 = moved * length * rng.standard_normal(n) * low / np.maximum(omega, low)
    q_dot0 = moved * length * low * rng.standard_normal(n)
    _, q, q_dot = _path(system, q0, q_dot0, duration)
    contacts = []
    for _ in range(rng.integers(1, 4)):
        row = rng.standard_normal(n)
        gap, speed, kind = _placed(rng, -q @ row, -q_dot @ row)
        time = 10.0 ** rng.uniform(-2.5, 0.5) * float(rng.choice([period, 2.0 * math.pi / low, min(dt, duration)]))
        contacts.append(Contact(row, draw_law(rng, mass / (row @ row), speed, min(time, duration)), gap))
        words += f" {kind}"
    return Scene(System(M, C, K, contacts, loads), q0, q_dot0, duration, words)


def _motion(rng: np.random.Generator, size: float, low: float, dt: float, duration: float) -> tuple[list[Any], str]:
    """Displacement of a support in cells dt, with speed and acceleration where these are known."""
    kind, band = rng.integers(6), low * 10.0 ** rng.uniform(-0.5, 0.7)
    if kind == 0 and rng.random() < 0.5:  # its acceleration has kinks
        t = dt * np.arange(max(math.ceil(duration / dt) + 2, 8))
        values = size * band**2 * rng.standard_normal(t.size)
        record = fb.Record(t, values, quantity="acceleration", interpolation="linear")
        return [record.derivative(i) for i in range(3)], "accelerogram"
    if kind == 0:
        signal, words = draw_table(rng, size, dt, duration)
        return [signal], words
    length, at = rng.uniform(0.1, 0.9) * duration, rng.uniform(0.0, 0.8) * duration
    drawn: list[Any] = [
        fb.Harmonic(size, band),
        fb.Pulse(size, length, at),
        fb.Step(size, length, at),
        fb.SineSweep(size, 0.3 * band, band, 2.0 * duration),
        fb.BandNoise(size, (0.0, band), seed=int(rng.integers(1 << 30))),
    ]
    of_order = [drawn[kind - 1].derivative(i) for i in range(5)]
    if kind > 1:  # as they are on their grid: cells may be coarse
        t = dt * np.arange(math.ceil(duration / dt) + 1)
        rows = np.stack([one(t) for one in of_order], axis=1)
        of_order = [Table(dt, rows[:, i : i + 3]) for i in range(3)]
    return of_order[:3], type(drawn[kind - 1]).__name__


def draw_stiff(rng: np.random.Generator, moved: bool) -> Any:
    """One to three slow modes, one or two 300 to 1e5 times as fast; damped or not, coupled or not; one to three stops.

    The fast ones follow one or two supports that are ``moved``, or rest until a stop pushes them.
    """
    from drawn import Scene, draw_law, draw_signal

    n, low, speed = int(rng.integers(2, 6)), 10.0 ** rng.uniform(0.0, 2.0), 10.0 ** rng.uniform(-2.0, 0.5)
    fast = np.arange(n) >= n - min(n - 1, int(rng.integers(1, 3)))
    omega = low * 10.0 ** np.where(fast, rng.uniform(2.5, 5.0, n), rng.uniform(0.0, 0.7, n))
    zeta = rng.choice([0.0, 1e-3, 0.02, 0.3], n)
    duration = min(rng.uniform(2.0, 12.0) / low, 0.6 * MOST_RADIANS / omega.max())
    row = rng.standard_normal(n) * math.sqrt(low) * 10.0 ** rng.uniform(-1.0, 0.3) * int(rng.random() < 0.25)
    C, loads = np.diag(2.0 * zeta * omega) + np.outer(row, row), []
    q0, q_dot0 = speed / low * rng.standard_normal(n) * ~fast, speed * rng.standard_normal(n) * ~fast
    words = f"n={n} ω=[{omega.min():.3g}..{omega.max():.3g}] ζ={zeta} T={duration:.3g}" + " coupled" * int(row.any())
    dt = min(10.0 ** rng.uniform(-3.0, 0.0) / low, duration)
    for _ in range(rng.integers(1, 3) if moved else 0):
        signals, kind = _motion(rng, speed / low, low, dt * float(rng.choice([1.0, 1.0, 0.5])), duration)
        shape, follows = rng.standard_normal(n), int(rng.random() < 0.7)
        rows = shape * fast * omega**2, shape * fast * 2.0 * zeta * omega, -shape * ~fast
        loads += zip(rows, signals, strict=False)
        begin, soon = np.asarray(signals[0](np.array([0.0, 1e-6 / low])))
        q0, q_dot0 = q0 + follows * shape * fast * begin, q_dot0 + follows * shape * fast * (soon - begin) * 1e6 * low
        words += f" {kind}" + " at once" * (1 - follows)
    if not moved and rng.random() < 0.6:
        signal, kind = draw_signal(rng, speed * low * 10.0 ** rng.uniform(-1.0, 0.3), low)
        loads, words = [(rng.standard_normal(n), signal)], f"{words} {kind}"
    system, contacts = System(np.eye(n), C, np.diag(omega**2), [], loads), []
    _, q, q_dot = _path(system, q0, q_dot0, duration)
    for _ in range(rng.integers(1, 4)):
        row = rng.standard_normal(n) * np.where(fast, 10.0 ** rng.uniform(-1.5, 0.5), 1.0)
        gap, rate, kind = _placed(rng, -q @ row, -q_dot @ row)
        part = row[~fast] if rng.random() < 0.5 else row
        time = duration * 10.0 ** rng.uniform(-3.0, -0.5)
        contacts.append(Contact(row, draw_law(rng, 1.0 / (part @ part), rate, time), gap))
        words += f" {kind}"
    kept = np.eye(2 * n)[:n][fast]  # a move of a fast place would be one of 1e5 times as much of its rate
    return Scene(System(np.eye(n), C, system.K, contacts, loads), q0, q_dot0, duration, words, kept=kept)
