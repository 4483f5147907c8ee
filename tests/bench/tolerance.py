"""Tolerance against measured error: what `Exponential(rtol)` means; prints a table and may draw it.

python tests/bench/tolerance.py [--chart FILE.png] [--starts 12]

The paper's beam, harmonic base motion, two drive periods (two or three contacts): error of δ at the end in units of
1 mm against `DormandPrince(1e-13)`, median over the starts and the largest; hysteretic and elastic stop, 2, 10 and 30
modes. The slope is that of a line through log median error over log rtol, above the rounding. The largest errors belong
to starts whose contacts multiply any error. The third line is the tail of the control itself: the largest error in
units of rtol times the factor by which that start multiplies a displacement, found by differences. It should stay
below one. Last come the sums of steps, rejected ones included, and of law calls.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from problems import PAPER_LAW, paper_scene

from contacts import Hertz
from solvers import DormandPrince, Exponential, integrate

RTOLS = tuple(float(f"1e-{k}") for k in range(4, 13))
STOPS = {"hysteretic": PAPER_LAW, "elastic": Hertz(2.1e8)}
LENGTH = 1e-3  # m, the unit of the errors
DURATION = 2.2 * 2.0 * math.pi / 195.0
SHOWN = RTOLS.index(1e-10) + 1  # of the tail; beyond it rounding decides
FLOOR = 1e-11  # of the reference and of rounding, in units of 1 mm; contacts multiply it, too


def scene(law, n):
    """The reduced system of the paper's beam with this stop."""
    return paper_scene(zeta=(0.02,) + (0.01,) * (n - 1), law=law).reduce(n).system


def starts_of(n, count):
    """(count, n) displacements in the first two modes."""
    q0 = np.zeros((count, n))
    q0[:, :2] = np.random.default_rng(1).uniform(-1.0, 1.0, (count, 2))[:, :n] * [3e-5, 1e-6][:n]
    return q0


def end(system, q0, method):
    """δ at the end of a run from rest at q0, in units of 1 mm, and what it cost."""
    run = integrate(system, q0, np.zeros(len(q0)), DURATION, method=method)
    return -system.contacts[0].direction @ run.q[-1] / LENGTH, run.cost


def errors(law, n, rtols=RTOLS, starts=12):
    """(starts, tolerances) error of δ at the end; (tolerances, 2) steps and law calls of all starts."""
    system, found, work = scene(law, n), np.empty((starts, len(rtols))), np.zeros((len(rtols), 2), dtype=int)
    for row, q0 in zip(found, starts_of(n, starts), strict=True):
        exact = end(system, q0, DormandPrince(1e-13, 1e-17))[0]
        for i, rtol in enumerate(rtols):
            reached, cost = end(system, q0, Exponential(rtol))
            row[i], work[i] = abs(reached - exact), work[i] + [cost.steps + cost.rejections, cost.law_calls]
    return found, work


def amplification(law, n, starts, size=1e-8):
    """(starts,) largest growth of a displacement of the stop's place by ``size`` (1 mm) in mode 1 or 2."""
    system, method = scene(law, n), Exponential(1e-12)
    moved = np.eye(2, n) * size * LENGTH / np.abs(system.contacts[0].direction[:2, None])
    return np.array(
        [
            max(abs(end(system, q0 + by, method)[0] - end(system, q0, method)[0]) / size for by in moved)
            for q0 in starts_of(n, starts)
        ]
    )


def normalised(found, factors, rtols=RTOLS):
    """Errors in units of rtol times the factor of their start; what may be rounding counts as none."""
    return np.maximum(found - FLOOR * np.maximum(factors, 1.0)[:, None], 0.0) / (factors[:, None] * rtols)


def slope(rtols, found):
    """Of log error over log rtol, where the error is above the floor."""
    above = found > FLOOR
    return float(np.polyfit(np.log(np.array(rtols)[above]), np.log(found[above]), 1)[0])


def chart(curves):
    """The curves beside the line of error = tolerance."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    ax = figure.subplots()
    for (name, n), found in curves.items():
        style = "-" if name == "hysteretic" else "--"
        ax.loglog(RTOLS, found, style, marker="os^"[(2, 10, 30).index(n)], ms=4, label=f"{name} stop, {n} modes")
    ax.loglog(RTOLS, RTOLS, color="0.6", lw=1.0, label="error = tolerance")
    ax.axhspan(1e-14, FLOOR, color="0.93")
    ax.set(xlabel="rtol", ylabel="error of δ at the end / 1 mm, median", ylim=(1e-14, 1e-2))
    ax.set_title("Grey: rounding and the error of the reference")
    ax.grid(alpha=0.25, lw=0.5)
    ax.legend(frameon=False)
    return figure


def line(head, values, form=".1e"):
    """One row of the table."""
    return f"{head:>21s}  " + " ".join(f"{value:8{form}}" for value in values)


def main():
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chart", metavar="FILE.png")
    parser.add_argument("--starts", type=int, default=12)
    given, curves = parser.parse_args(), {}
    print("stop, modes            " + " ".join(f"{r:8.0e}" for r in RTOLS))
    for name, law in STOPS.items():
        for n in (2, 10, 30):
            found, work = errors(law, n, starts=given.starts)
            factors = amplification(law, n, given.starts)
            median = curves[name, n] = np.median(found, axis=0)
            print(line(f"{name:11s} {n:2d} median", median) + f"  slope {slope(RTOLS, median):.2f}")
            print(line("largest", found.max(axis=0)) + f"  factors {factors.min():.1f} to {factors.max():.0f}")
            print(line("over rtol and factor", normalised(found, factors).max(axis=0)[:SHOWN]))
            print(line("steps", work[:, 0], "d"), line("law calls", work[:, 1], "d"), sep="\n", flush=True)
    if given.chart:
        chart(curves).savefig(given.chart, dpi=100)


if __name__ == "__main__":
    main()
