r"""Synthetic collisions, and how often the intervals of `contacts.identify` hold the truth.

``python tests/bench/collisions.py [--experiments 400]`` prints, for several kinds of measurement, the share of
experiments whose 95 % interval holds the true value, and the mean half-widths. ``--write PATH`` writes the file of
examples/identify_stop.py.
"""

from __future__ import annotations

import argparse
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np

from contacts import Hysteretic, bounce, identify

LAW = Hysteretic(2.1e8, 0.5625)
SPEEDS, MASS = (0.2, 0.3, 0.4), 0.03
thrown = lru_cache(bounce)

KINDS = {
    "force noise 2 %": ({"noise_force": 0.02}, {}),
    "force noise 2 %, exponent free": ({"noise_force": 0.02}, {"exponent": None}),
    "force noise 2 %, zeros known": ({"noise_force": 0.02}, {"offsets": False}),
    "zeros off": ({"noise_force": 0.02, "offset_force": 0.1, "offset_delta": 2e-6}, {}),
    "force and rate noise": ({"noise_force": 0.02, "noise_rate": 0.01}, {}),
    "15 samples a collision": ({"samples": 15, "noise_force": 0.02, "noise_rate": 0.01}, {}),
    "time, noise 1 % on both": ({"samples": 80, "noise_force": 0.01, "noise_delta": 0.01, "timed": True}, {}),
    "time, exponent free": (
        {"samples": 80, "noise_force": 0.01, "noise_delta": 0.01, "timed": True},
        {"exponent": None},
    ),
    "time, 25 samples": ({"samples": 25, "noise_force": 0.02, "noise_delta": 0.01, "timed": True}, {}),
}


def collisions(
    rng, law=LAW, speeds=SPEEDS, mass=MASS, samples=60, noise_force=0.0, noise_delta=0.0, noise_rate=0.0,
    offset_force=0.0, offset_delta=0.0, timed=False,
):  # fmt: skip
    """Arguments of `identify`; noises and the force's offset relative to the largest values of the middle collision."""
    from scipy.interpolate import CubicHermiteSpline

    middle = thrown(law, speeds[len(speeds) // 2], mass)
    strongest, deepest = middle.force.max(), middle.delta.max()
    out = {"delta": [], "force": [], ("time" if timed else "delta_dot"): []}
    for speed in speeds:
        one = thrown(law, speed, mass)
        lasting, around = one.t[-1], 0.1 * one.t[-1] if timed else 0.0
        t = np.linspace(-around, lasting + around, samples)
        inside = CubicHermiteSpline(one.t, one.delta, one.delta_dot)
        rates = CubicHermiteSpline(one.t, one.delta_dot, -one.force / mass)
        at = np.clip(t, 0.0, lasting)
        rate = rates(at)
        delta = inside(at) + rate * (t - at)
        force = law.force(delta, rate, speed)
        out["force"].append(force + strongest * (offset_force + noise_force * rng.standard_normal(samples)))
        out["delta"].append(delta + offset_delta + deepest * noise_delta * rng.standard_normal(samples))
        if timed:
            out["time"].append(t)
        else:
            out["delta_dot"].append(rate + speed * noise_rate * rng.standard_normal(samples))
    return out


def coverage(experiments, made, options, law=LAW, seed=1):
    """(shares of experiments whose interval holds K, p, a, achieved restitution; half-widths of K (relative), a)."""
    from contacts import achieved_restitution

    rng, hits, widths = np.random.default_rng(seed), np.zeros(4), np.zeros(2)
    truth = law.stiffness, law.exponent, law.damping_factor, achieved_restitution(law.damping_factor)
    for _ in range(experiments):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            found = identify(**collisions(rng, law, **made), **options)
        estimates = found.stiffness, found.exponent, found.damping_factor, found.restitution
        hits += [value in estimate for value, estimate in zip(truth, estimates, strict=True)]
        a = found.damping_factor
        widths += [0.5 * np.log(found.stiffness.high / found.stiffness.low), 0.5 * (a.high - a.low)]
    return hits / experiments, widths / experiments


def write(path):
    """The collisions of the example."""
    made = {"samples": 60, "noise_force": 0.015, "noise_delta": 0.005, "offset_force": 0.02, "timed": True}
    data = collisions(np.random.default_rng(2003), speeds=(0.15, 0.2, 0.25, 0.3, 0.4), **made)
    lines, start = ["# indentation of a stop and its force in five collisions", "collision,time,delta,force"], 0.0
    for number, (t, delta, force) in enumerate(zip(data["time"], data["delta"], data["force"], strict=True), 1):
        lines += [f"{number},{start + x:.6e},{d:.5e},{f:.2f}" for x, d, f in zip(t, delta, force, strict=True)]
        start += 0.05
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--experiments", type=int, default=400)
    parser.add_argument("--write")
    asked = parser.parse_args()
    if asked.write:
        write(asked.write)
    else:
        print(f"{asked.experiments} experiments; 95 % intervals hold    K      p      a      r   | half-width of K, a")
        for kind, (made, options) in KINDS.items():
            shares, widths = coverage(asked.experiments, made, options)
            print(f"{kind:36}" + "".join(f"{100 * s:6.1f}%" for s in shares) + f"   | {widths[0]:.2%}  {widths[1]:.4f}")
