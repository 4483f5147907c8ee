r"""Work against error on a beam that hits its stop.

``python tests/bench/impact.py [--modes 2 10 30] [--starts 12] [--quick] [--chart FILE.png]`` prints one table per mode
count, and draws all points, peers included, on one chart; ``--many 1200`` compares calls for so many starts at once
instead. Every
method runs the same starts over ten periods; the error is that of the tip at the end against `reference`, in units of
1 mm. All methods are timed by turns in one process, the fastest of several rounds counts for each start, and medians
over the starts are printed. Ratios are taken at equal error, each method's time being interpolated in log-log between
its settings that no other of its settings beats in both. Taylor, SciPy and CVODE are timed as called from Python.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import peers
from reference import DURATION, LENGTH, MODES, STARTS, Problem, problem
from taylor_ensemble import Ensemble

import fembeam as fb
import solvers

PATIENCE = 15.0  # s that one setting may take for all its starts; slower ones run fewer starts and say so
SHORT = 3.0  # the same with --quick
ROUNDS = 7


def rtols(*values: float, **options: Any) -> list[dict[str, Any]]:
    """One setting per relative tolerance."""
    return [{**options, "rtol": value} for value in values]


def steps(*pairs: tuple[float, float]) -> list[dict[str, float]]:
    """One setting per (flight, contact) step."""
    return [{"dt_flight": flight, "dt_contact": contact} for flight, contact in pairs]


def tols(*values: float, **options: Any) -> list[dict[str, Any]]:
    """One setting per tolerance of a Taylor integrator."""
    return [{**options, "tol": value} for value in values]


def methods(modes: int) -> dict[str, tuple[Any, list[dict[str, Any]]]]:
    """Name: (peer, settings)."""
    # Python-driven solvers take seconds per run from 10 modes on; there only what brackets 1e-5 is worth waiting for
    # max_step 1e-3: shortest flights here last half of it, and looser tolerances step over entries without it
    loose = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10) if modes < 10 else (1e-4, 1e-5, 1e-6, 1e-7)
    few = (1e-4, 1e-5, 1e-6, 1e-8) if modes < 10 else (1e-3, 1e-5)
    heun = [(4e-6, 4e-6), (2e-6, 1e-6), (1e-6, 1e-6), (1e-6, 1e-7), (5e-7, 5e-7)]
    if modes >= 10:  # stable for about hω < (8ζ)^(1/3); the modes' phases, not the contacts, then set the step
        heun = [(1e-6, 1e-6), (1e-6, 2e-7), (5e-7, 5e-7), (3e-7, 3e-7), (1.5e-7, 1.5e-7)]
    constant = [1e-5, 4e-6, 1e-6] if modes < 30 else [1e-6]
    return {
        "Exponential": (peers.exponential, rtols(1e-6, 1e-8, 1e-10)),
        "heyoka, in √δ": (peers.heyoka, tols(1e-6, 1e-7, 1e-8, 1e-10, 1e-12)),
        "heyoka, in t": (peers.heyoka, tols(1e-7, 1e-9, 1e-11, root=False)),
        "DOP853, numba": (peers.dormand_prince, rtols(1e-7, 1e-8, 1e-9, 1e-10, 1e-11)),
        "Heun + Hénon": (peers.henon, steps(*heun)),
        **{
            kind.__name__: (peers.constant_step, [{"kind": kind, "dt": dt} for dt in constant])
            for kind in (solvers.RK4, solvers.CentralDifference, solvers.Newmark, solvers.GeneralizedAlpha)
        },
        "RK4, blind": (peers.constant_step, [{"kind": solvers.RK4, "dt": dt, "locate": False} for dt in constant]),
        "DOP853 in √δ": (peers.regularised, rtols(1e-7, 1e-9)),
        "SciPy DOP853": (peers.scipy_ivp, rtols(*loose, method="DOP853", max_step=1e-3)),
        "SciPy LSODA": (peers.scipy_ivp, rtols(*loose, method="LSODA", max_step=1e-3)),
        "SciPy Radau": (peers.scipy_ivp, rtols(*few, method="Radau", max_step=1e-3)),
        "CVODE Adams": (peers.cvode, rtols(*loose, method="Adams", max_step=1e-3)),
        "CVODE BDF": (peers.cvode, rtols(*loose, method="BDF", max_step=1e-3)),
    }


SHOWN = "rtol", "tol", "dt", "dt_flight", "dt_contact"
RATIOS = [("heyoka", 1e-8), ("DOP853, numba", 1e-8), ("Heun + Hénon", 1e-5), ("SciPy", 1e-5), ("CVODE", 1e-5)]


@dataclass
class Point:
    """One method at one setting: the best time (s), error and law calls of each start."""

    method: str
    setting: dict[str, Any]
    run: peers.Run
    seconds: dict[int, float] = field(default_factory=dict)
    errors: dict[int, float] = field(default_factory=dict)
    calls: dict[int, int | None] = field(default_factory=dict)
    spent: float = 0.0

    @property
    def time(self) -> float:
        """Median over the starts."""
        return float(np.median(list(self.seconds.values()))) if self.seconds else math.nan

    @property
    def error(self) -> float:
        """Median over the starts."""
        return float(np.median(list(self.errors.values()))) if self.errors else math.nan

    def measure(self, of: Problem, start: int) -> None:
        """One timed run."""
        started = time.perf_counter()
        tip, calls = self.run(of.starts[start])
        took = time.perf_counter() - started
        self.spent += took
        self.seconds[start] = min(took, self.seconds.get(start, math.inf))
        self.errors[start], self.calls[start] = of.error(start, float(tip)), calls

    def line(self) -> str:
        """A row of the table."""
        values = ", ".join(f"{v:g}" for name, v in self.setting.items() if name in SHOWN)
        known = [c for c in self.calls.values() if c is not None]
        calls = f"{np.median(known):.0f}" if known else "-"
        worst = max(self.errors.values(), default=math.nan)
        return (
            f"{self.method:14s} {values:>16s} {1e6 * self.time:12.0f} {self.error:10.1e} {worst:10.1e} "
            f"{calls:>10s} {len(self.errors):6d}"
        )


def prepared(of: Problem) -> list[Point]:
    """All methods at all settings, compiled and warmed up; what is missing or fails is left out with a notice."""
    points = []
    for name, (peer, settings) in methods(of.n).items():
        for setting in settings:
            try:
                points.append(Point(name, setting, peer(of, setting)))
            except Exception as fault:
                print(f"left out: {name} {setting}: {type(fault).__name__}: {fault}")
                break
    return points


def measure(points: list[Point], of: Problem, starts: int, patience: float, rounds: int) -> None:
    """Time all points by turns."""
    broken: set[int] = set()
    for turn in range(rounds):
        for i, point in enumerate(points):
            if i in broken or (turn and point.spent * (turn + 1) / turn > patience):
                continue
            for start in range(len(point.errors) if turn else starts):
                if not turn and start and point.spent * (start + 1) / start > patience:
                    break
                try:
                    point.measure(of, start)
                except Exception as fault:
                    print(f"failed: {point.method} {point.setting}, start {start}: {fault}")
                    broken.add(i)
                    break


def front(points: list[Point]) -> list[tuple[float, float]]:
    """(error, time) of the points that no other beats in both, from coarse to fine."""
    pairs = sorted((p.time, max(p.error, 1e-16)) for p in points if p.errors)
    best: list[tuple[float, float]] = []
    for seconds, error in pairs:
        if not best or error < best[-1][0]:
            best.append((error, seconds))
    return best


def time_at(points: list[Point], error: float) -> tuple[float, str]:
    """Time at an error by log-log interpolation on the front, and a remark where the points do not bracket it."""
    curve = front(points)
    if not curve:
        return math.nan, "not measured"
    errors, times = (np.log(values) for values in zip(*curve, strict=True))
    wanted = math.log(error)
    if wanted < errors[-1]:
        return math.nan, f"not reached, {curve[-1][0]:.0e} at best"
    if wanted > errors[0]:  # even the coarsest setting is better than asked: its time is an upper bound
        return curve[0][1], f"at its coarsest, {curve[0][0]:.0e}"
    return math.exp(np.interp(-wanted, -errors, times)), ""


def ratios(points: list[Point]) -> list[str]:
    """How many times faster `Exponential` is at equal error."""
    lines = []
    mine = [p for p in points if p.method == "Exponential"]
    for name, error in RATIOS:
        own, note = time_at(mine, error)
        theirs, remark = time_at([p for p in points if p.method.startswith(name)], error)
        value = f"{theirs / own:8.1f} x" if math.isfinite(theirs / own) else "       - "
        notes = "; ".join(f"{who} {what}" for who, what in (("Exponential", note), (name, remark)) if what)
        lines.append(
            f"  {name:14s} at {error:.0e}: {value}   ({1e6 * theirs:.0f} µs against {1e6 * own:.0f} µs)  {notes}"
        )
    return lines


def chart(points: dict[int, list[Point]]) -> Any:
    """The chart of `fb.study.speed_accuracy`, from points measured here."""
    study = fb.study
    drawn = [
        study.Point(p.method, "", n, *(np.array(list(v.values())) for v in (p.seconds, p.errors, p.errors)), 0.0, 0.0)
        for n, measured in points.items()
        for p in measured
        if p.errors
    ]
    nothing = dict.fromkeys(points, 0.0)
    return fb.plot.speed_accuracy(study.SpeedAccuracy(drawn, 1e-3, nothing, nothing, "tip after ten periods / 1 mm"))


def many(of: Problem, count: int, rounds: int) -> list[str]:
    """Time per start of calls for many starts at once, by turns; "times" compares processor time, which other work on
    the machine leaves alone; two threads on two free processors show in the first column.
    """
    starts, tips = (np.resize(values, (count, *values.shape[1:])) for values in (of.starts, of.tips))
    method, ensemble = solvers.Exponential(1e-8), Ensemble(of, 1e-8)
    single, alone = peers.exponential(of, {"rtol": 1e-8}), peers.heyoka(of, {"tol": 1e-8})

    gaps = np.tile([[contact.gap for contact in of.system.contacts]], (count, 1))

    def ours(threads: int, **parameters: Any) -> Any:
        ends = solvers.integrate_many(of.system, *np.hsplit(starts, 2), DURATION, method, threads, **parameters)
        return ends.q @ of.phi

    def own_system(start: Any) -> Any:
        contacts = [replace(contact) for contact in of.system.contacts]
        return solvers.integrate(of.system.like(contacts), *np.split(start, 2), DURATION, method=method).q[-1] @ of.phi

    calls = {
        "integrate_many": lambda: ours(1),
        "the same, a gap for each": lambda: ours(1, gaps=gaps, factors=np.ones((count, len(of.system.loads)))),
        "integrate, a system for each": lambda: [own_system(start) for start in starts[:100]],
        "integrate_many, 2 threads": lambda: ours(2),
        "integrate, one by one": lambda: [single(start)[0] for start in starts[:100]],
        "heyoka, its ensemble": lambda: ensemble(starts[:100]),
        "heyoka, one by one": lambda: [alone(start)[0] for start in starts[:100]],
    }
    wall, processor, error = (dict.fromkeys(calls, math.inf) for _ in range(3))
    for _ in range(rounds):
        for name, call in calls.items():
            started, spent = time.perf_counter(), time.process_time()
            found = np.asarray(call(), dtype=float)
            wall[name] = min(wall[name], (time.perf_counter() - started) / len(found))
            processor[name] = min(processor[name], (time.process_time() - spent) / len(found))
            error[name] = float(np.median(np.abs(found - tips[: len(found)]))) / LENGTH
    own = processor["integrate_many"]
    load = f"load of the machine {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return [f"{'call':28s} {'µs a start':>10s} {'processor µs':>12s} {'error':>8s} {'times':>6s}   {load}"] + [
        f"{name:28s} {1e6 * wall[name]:10.0f} {1e6 * spent:12.0f} {error[name]:8.0e} {spent / own:6.2f}"
        for name, spent in processor.items()
    ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--modes", type=int, nargs="+", default=list(MODES), choices=MODES)
    parser.add_argument("--starts", type=int, default=STARTS)
    parser.add_argument("--quick", action="store_true", help="fewer rounds, and slow settings on few starts")
    parser.add_argument("--chart", metavar="FILE.png", help="draw all points")
    parser.add_argument("--many", type=int, metavar="STARTS", help="calls for so many starts at once, nothing else")
    given, drawn = parser.parse_args(), {}
    patience, rounds = (SHORT, 3) if given.quick else (PATIENCE, ROUNDS)
    for modes in given.modes:
        of = problem(modes)
        if given.many:
            print(f"\n{modes} modes, 10 periods", *many(of, given.many, rounds), sep="\n", flush=True)
            continue
        points = prepared(of)
        measure(points, of, min(given.starts, STARTS), patience, rounds)
        print(f"\n{modes} modes, 10 periods")
        print(
            f"{'method':14s} {'setting':>16s} {'median µs':>12s} {'median err':>10s} {'worst err':>10s} "
            f"{'law calls':>10s} {'starts':>6s}"
        )
        print(*(point.line() for point in points), sep="\n")
        print("Exponential is faster, at equal median error, than")
        print(*ratios(points), sep="\n", flush=True)
        drawn[modes] = points
    if given.chart:
        chart(drawn).savefig(given.chart, dpi=100)


if __name__ == "__main__":
    main()
