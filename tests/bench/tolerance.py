"""Tolerance against measured error: what `Exponential(rtol)` means; prints a table and may draw it.

python tests/bench/tolerance.py [--chart FILE.png] [--starts 12]

The paper's beam, harmonic base motion, two drive periods (two or three contacts): error of δ at the end in units of
1 mm, median over the starts, against `DormandPrince(1e-13)`; hysteretic and elastic stop, 2, 10 and 30 modes. The slope
is that of a line through log error over log rtol, above the rounding.
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

RTOLS = tuple(10.0**-k for k in range(4, 13))
STOPS = {"hysteretic": PAPER_LAW, "elastic": Hertz(2.1e8)}
LENGTH = 1e-3  # m, the unit of the errors
DURATION = 2.2 * 2.0 * math.pi / 195.0
FLOOR = 1e-11  # of the reference and of rounding, in units of 1 mm


def errors(law, n, rtols=RTOLS, starts=12):
    """Median error of δ at the end for each tolerance."""
    system = paper_scene(zeta=(0.02,) + (0.01,) * (n - 1), law=law).reduce(n).system
    direction, rng = system.contacts[0].direction, np.random.default_rng(1)
    found = np.empty((starts, len(rtols)))
    for i in range(starts):
        q0 = np.zeros(n)
        q0[:2] = rng.uniform(-1.0, 1.0, 2)[:n] * [3e-5, 1e-6][:n]
        ends = [
            integrate(system, q0, np.zeros(n), DURATION, method=method).q[-1]
            for method in (DormandPrince(1e-13, 1e-17), *(Exponential(r) for r in rtols))
        ]
        found[i] = [abs(direction @ (q - ends[0])) / LENGTH for q in ends[1:]]
    return np.median(found, axis=0)


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


def main():
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chart", metavar="FILE.png")
    parser.add_argument("--starts", type=int, default=12)
    given, curves = parser.parse_args(), {}
    print("stop, modes       " + " ".join(f"{r:8.0e}" for r in RTOLS) + "    slope")
    for name, law in STOPS.items():
        for n in (2, 10, 30):
            found = curves[name, n] = errors(law, n, starts=given.starts)
            print(f"{name:11s} {n:4d}  " + " ".join(f"{e:8.1e}" for e in found) + f"    {slope(RTOLS, found):.2f}")
    if given.chart:
        chart(curves).savefig(given.chart, dpi=100)


if __name__ == "__main__":
    main()
