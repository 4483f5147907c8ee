"""`DormandPrince` and its contact log against motion in 80-bit numbers (`extrapolated`): hundreds of small systems.

    python tests/bench/high_precision.py [count] [first seed]

A system has 1 to 3 coordinates and 1 to 3 stops with laws of every kind; by turns it is drawn as plain, with a graze
1e-15 to 1e-6 deep, with a symmetric pair of stops, compressed at the start, ending inside a contact, and made of
oscillators that do not touch each other. Errors are told in units of rtol times what the quantity itself moves under a
relative move of the start, so that 1 is what a backward stable method could leave.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from extrapolated import ROW, Motion, Tone

from contacts import PUBLISHED, Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Tabulated, Viscoelastic, law
from solvers import Contact, DormandPrince, SolverError, System, integrate

KINDS = ("plain", "graze", "pair", "compressed", "ends inside", "apart")
TOLERANCES = (1e-6, 1e-9, 1e-12)
MOVE = 1e-8
ROUNDING = 1e-14  # of times and of what is a difference of sums
MOST_CONTACTS = 5
QUANTITIES = ("motion", *ROW[1:])


@law(exponent=1.5)
def softening(delta, delta_dot, entry_rate, stiffness, loss, scale):
    """A user's law: Hertz with a loss, softening with depth."""
    return stiffness * delta**1.5 * (1.0 + loss * delta_dot / entry_rate) / (1.0 + delta / scale)


def draw_law(rng: np.random.Generator, mass: float, speed: float, time: float) -> Any:
    """A law of any kind whose contact at ``speed`` lasts about ``time``."""
    depth, kind, e = speed * time / 3.0, rng.integers(9), rng.uniform(0.3, 0.95)
    stiffness, clamp = mass * (speed / depth) ** 2, bool(rng.random() < 0.3)
    p = (1.5, 1.5, 2.0, 1.2)[rng.integers(4)]
    power, options = 0.5 * (p + 1.0) * stiffness / depth ** (p - 1.0), {"exponent": p}
    knots = np.sort(rng.uniform(0.05, 0.9, 2)) * depth
    if kind == 0:
        return Hertz(power, p)
    if kind <= 2:
        published = getattr(Hysteretic, PUBLISHED[rng.integers(len(PUBLISHED))])
        return published(power, e, clamp=clamp, entry_rate_floor=1e-6 * speed, **options)
    if kind == 3:
        return KelvinVoigt(stiffness, rng.uniform(0.02, 0.6) * math.sqrt(stiffness * mass), clamp=clamp)
    if kind == 4:
        return (Viscoelastic.tsuji if rng.random() < 0.5 else Viscoelastic.jankowski)(power, e, mass, **options)
    if kind == 5:
        damping = rng.uniform(0.0, 0.2, 3) * math.sqrt(stiffness * mass) * (rng.random() < 0.5)
        return PiecewiseLinear(list(stiffness * rng.uniform(0.2, 3.0, 3)), tuple(knots), list(damping))
    if kind == 6:
        return PiecewiseLinear([stiffness])
    if kind == 7:
        delta = np.array([0.0, *knots, depth, 3.0 * depth])
        return Tabulated(delta, stiffness * delta * (1.0 + delta / depth))
    return softening(stiffness=1.25 * stiffness / math.sqrt(depth), loss=rng.uniform(0.0, 0.6), scale=4.0 * depth)


def draw(seed: int) -> tuple[System, Any, Any, float, str]:
    """(system, q0, q_dot0, duration, kind) of a seed."""
    rng, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    n = 2 + seed // len(KINDS) % 2 if kind == "apart" else int(rng.integers(1, 4))
    omega, M = np.sort(10.0 ** rng.uniform(0.7, 1.8, n)), np.diag(rng.uniform(0.5, 2.0, n))
    turn = np.eye(n) if kind == "apart" else np.linalg.qr(rng.standard_normal((n, n)))[0]
    K = turn @ np.diag(omega**2) @ turn.T
    C = turn @ np.diag(2.0 * 10.0 ** rng.uniform(-3.0, -1.0, n) * omega) @ turn.T
    K, C = 0.5 * (K + K.T), 0.5 * (C + C.T)
    speed = 10.0 ** rng.uniform(-1.0, 0.5)
    q0, v0 = speed / omega * rng.standard_normal(n), speed * rng.standard_normal(n)
    duration, loads = rng.uniform(3.0, 8.0) / omega[0], []
    if rng.random() < 0.5:
        loads = [(rng.standard_normal(n), Tone(speed * omega[0], omega[0] * rng.uniform(0.3, 3.0), rng.uniform(0, 6)))]
    stops = []
    for s in range(n if kind == "apart" else rng.integers(1, 4)):
        w = np.eye(n)[s] if kind == "apart" else rng.standard_normal(n)
        w = w * rng.choice([-1.0, 1.0]) / np.linalg.norm(w)
        own = omega[s] if kind == "apart" else omega[0]
        gap = rng.choice([0.0, 0.2, 0.5]) * speed / own
        found = draw_law(rng, 1.0 / (w @ np.linalg.solve(M, w)), speed, 10.0 ** rng.uniform(-1.7, -0.2) / own)
        stops.append(Contact(w, found, gap))
    if kind == "pair":
        stops = [stops[0], Contact(-stops[0].direction, stops[0].law, stops[0].gap)]
        stops += [stops[0]] if rng.random() < 0.3 else []
    if kind == "compressed":
        first = stops[0]
        stops[0] = Contact(first.direction, first.law, -first.direction @ q0 - 0.02 * speed / omega[0])
    if kind == "graze":
        stops = [grazed(System(M, C, K, (), loads), q0, v0, duration, stops[0], 10.0 ** rng.uniform(-15.0, -6.0))]
    system = System(M, C, K, stops, loads)
    return system, q0, v0, cut(rng, system, q0, v0, duration, kind), kind


def grazed(free: System, q0: Any, v0: Any, duration: float, stop: Contact, depth: float) -> Contact:
    """The stop moved to where the free motion enters it by a relative ``depth``, at its farthest turning point."""
    motion = Motion(System(free.M, free.C, free.K, [Contact(stop.direction, stop.law, 1e9)], free.loads), q0, v0)
    farthest = -math.inf
    while motion.t < duration:
        before = motion.t, motion.x
        motion.run(min(duration, float(motion.t) + 0.3 / motion.fastest))
        if -(before[1][free.size :][: free.size] @ motion.w[0]) > 0 > motion.rate(motion.x, 0):
            end, motion.t, motion.x = (motion.t, motion.x), *before
            top = motion.step(motion.root(lambda z: -motion.rate(z, 0), 0, end[0] - before[0]))[0]
            farthest = max(farthest, motion.delta(top, 0) + 1e9)
            motion.t, motion.x = end
    return Contact(stop.direction, stop.law, float(farthest) * (1.0 - depth)) if farthest > 0.0 else stop


def run(system: System, q0: Any, v0: Any, duration: float, rtol: float) -> Any:
    """A run of the method; RuntimeError where a stop is too stiff for an explicit one."""
    left = iter(range(5))  # stretches of 20 000 steps

    def progress(_t: float) -> None:
        if next(left, None) is None:
            raise RuntimeError("too stiff")

    return integrate(system, q0, v0, duration, method=DormandPrince(rtol), progress=progress)


def cut(rng: np.random.Generator, system: System, q0: Any, v0: Any, duration: float, kind: str) -> float:
    """A duration with few contacts, that ends inside one where the kind asks for that."""
    log = run(system, q0, v0, duration, 1e-8).contacts
    order = np.argsort(log.t_in)
    if len(log) > MOST_CONTACTS:
        duration = float(log.t_in[order[MOST_CONTACTS]]) * 0.999
    if kind == "ends inside" and np.isfinite(log.t_out).any():
        i = int(rng.choice(np.flatnonzero(np.isfinite(log.t_out) & (log.t_in < duration))))
        duration = float(log.t_in[i] + rng.uniform(0.02, 0.98) * (log.t_out[i] - log.t_in[i]))
    return duration


def table(solution: Any) -> Any:
    """A log as the rows of `Motion.log`, in order of stop and beginning."""
    return ordered(np.column_stack([getattr(solution.contacts, name) for name in ROW]).astype(float))


def ordered(rows: Any) -> Any:
    """Rows by stop, then beginning."""
    return rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def judge(seed: int) -> tuple[str, str, dict[float, dict[str, float]]]:
    """(kind, verdict, per tolerance the errors of each quantity in units of rtol × what it moves)."""
    system, q0, v0, duration, kind = draw(seed)
    motion, n = Motion(system, q0, v0).run(duration), system.size
    exact, rows = motion.x[: 2 * n].astype(float), ordered(motion.log())
    size = np.repeat([float(motion.size[:n].max()), float(motion.size[n : 2 * n].max())], n)

    def solved(rtol: float, move: Any = 0.0) -> Any:
        start = np.concatenate((q0, v0)) + move
        found = run(system, start[:n], start[n:], duration, rtol)
        return np.concatenate((found.q[-1], found.q_dot[-1])), table(found)

    rng = np.random.default_rng([seed, 1])
    base, gain, moved_rows = solved(1e-13), 1.0, np.zeros((len(rows), len(ROW)))
    same = base[1].shape == rows.shape
    for _ in range(4):
        end, moved = solved(1e-13, MOVE * size * rng.choice([-1.0, 1.0], 2 * n))
        gain = max(gain, float((np.abs(end - base[0]) / size).max()) / MOVE)
        same &= moved.shape == rows.shape
        if same:
            moved_rows = np.maximum(moved_rows, np.abs(np.nan_to_num(moved - base[1])) / MOVE)
    scale = np.abs(np.nan_to_num(rows)) + moved_rows
    if len(rows):
        scale[:, 1:3] = moved_rows[:, 1:3] + np.nan_to_num(rows[:, 2:3] - rows[:, 1:2], nan=duration)
        mass = np.array([1.0 / (c.direction @ np.linalg.solve(system.M, c.direction)) for c in system.contacts])
        momentum = mass[rows[:, 0].astype(int)] * rows[:, 3]
        scale[:, 7] += momentum
        scale[:, 8] += np.abs(rows[:, 5] * rows[:, 6]) + momentum * rows[:, 3]
    largest = np.array([0.0, duration, duration, 0.0, 0.0, *np.max(np.abs(scale[:, 5:]), axis=0, initial=0.0)])
    verdict, errors = ("compared" if same else "motion only"), {}
    if gain > 1e4:
        return kind, "ill-conditioned", {}
    shallow = 1e3 * float(motion.size[:n].max())  # times rtol: the tolerance decides whether such a contact is met
    for rtol in TOLERANCES:
        end, log = solved(rtol)
        clear = rows[:, 5] > shallow * rtol
        if not clear.all():
            log = log[log[:, 5] > shallow * rtol]
        there, unit = rows[clear], np.maximum(rtol * scale[clear] + ROUNDING * largest, 1e-300)
        found = {"motion": float((np.abs(end - exact) / size).max()) / (rtol * gain)}
        if same and log.shape != there.shape:
            verdict = f"{len(log)} contacts at rtol {rtol:g}, exactly {len(there)}"
        elif same and len(there):
            apart = np.nan_to_num(np.abs(log - there) / unit, nan=0.0)
            apart[np.isnan(log) != np.isnan(there)] = math.inf
            found |= {name: float(apart[:, i].max()) for i, name in enumerate(ROW) if i}
        errors[rtol] = found
    return kind, verdict, errors


def main(count: int = 300, first: int = 0) -> int:
    """Run and print; returns the number of systems whose number of contacts differs."""
    worst: dict[tuple[float, str], tuple[float, int]] = {}
    counts: dict[str, int] = {}
    failures = 0
    for seed in range(first, first + count):
        try:
            kind, verdict, errors = judge(seed)
        except (SolverError, RuntimeError) as error:
            kind, verdict, errors = KINDS[seed % len(KINDS)], f"{error}", {}
        counts[verdict] = counts.get(verdict, 0) + 1
        if verdict not in ("compared", "motion only", "ill-conditioned"):
            failures += 1
            print(f"seed {seed} ({kind}): {verdict}", flush=True)
        for rtol, found in errors.items():
            for name, value in found.items():
                if value > 300.0:
                    print(f"seed {seed} ({kind}): {name} {value:.3g} rtol at {rtol:g}", flush=True)
                worst[rtol, name] = max(worst.get((rtol, name), (0.0, -1)), (value, seed))
    print(", ".join(f"{number} {verdict}" for verdict, number in counts.items()))
    for rtol in TOLERANCES:
        listed = [(name, *worst.get((rtol, name), (math.nan, -1))) for name in QUANTITIES]
        print(f"rtol {rtol:g}: " + ", ".join(f"{name} {value:.3g} ({seed})" for name, value, seed in listed))
    return failures


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:3])) > 0)
