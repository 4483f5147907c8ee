"""What a law of one's own costs: run times relative to the built-in law, timed by turns.

``python tests/bench/user_law.py`` prints medians over the rounds of ratios within a round: stops on the paper's scene,
and a slider beside its beam.
"""

import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
from own_memory_laws import ratchet
from problems import paper_scene

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, Jenkins, Tabulated, law

K, A, ROUNDS = 2.1e8, 0.5625, 60


def slopes(delta, delta_dot, entry_rate, stiffness, a):
    """Derivatives of the law below."""
    root = math.sqrt(delta)
    swing = 1.0 + a * delta_dot / entry_rate
    elastic = stiffness * delta * root
    return 1.5 * stiffness * root * swing, elastic * a / entry_rate, -elastic * a * delta_dot / entry_rate**2


def by_hand(delta, delta_dot, entry_rate, stiffness, a):
    """Hysteretic Hertz."""
    return stiffness * delta**1.5 * (1.0 + a * delta_dot / entry_rate)


depths = np.linspace(0.0, 4e-5, 9)
laws = {
    "Hysteretic": Hysteretic(K, A),
    "the same by @law": law(by_hand)(stiffness=K, a=A),
    "the same with its derivative": law(derivative=slopes)(by_hand)(stiffness=K, a=A),
    "in two parallel halves": Hysteretic(K / 2, A) + Hysteretic(K / 2, A),
    "Hertz": Hertz(K),
    "Hertz tabulated at 8 points": Tabulated(depths, K * depths**1.5),
}
sliders = {"Jenkins": Jenkins(3e3, 1.0), "the same by memory_law": ratchet(stiffness=3e3, up=1.0, down=1.0)}


def compare(models, method):
    """Print how much longer runs of models take than that of the first."""
    runs = {name: model.simulate(0.2, None, solver=method) for name, model in models.items()}
    times = {name: [] for name in models}
    for _ in range(ROUNDS):
        for name, model in models.items():
            start = time.perf_counter()
            for _ in range(5):
                model.simulate(0.2, None, solver=method)
            times[name].append((time.perf_counter() - start) / 5)
    first = np.array(next(iter(times.values())))
    print(f"{type(method).__name__}: {next(iter(models))} takes {1e6 * np.median(first):.0f} µs for 0.2 s")
    for name, taken in times.items():
        ratio, run = np.median(np.array(taken) / first), runs[name]
        print(f"  {name:30} {ratio:5.2f} times as long, {len(run.contacts)} contacts, {run.cost.law_calls} law calls")


for method in (solvers.Exponential(1e-8), solvers.DormandPrince(1e-10)):
    compare({name: paper_scene(law=one).reduce(2) for name, one in laws.items()}, method)
scene = paper_scene(law=laws["Hysteretic"])
for modes in (2, 10):
    with_slider = {
        name: replace(scene, stops=(), elements=[fb.Element(scene.stops[0].z, one)]) for name, one in sliders.items()
    }
    compare({name: one.reduce(modes) for name, one in with_slider.items()}, solvers.Exponential(1e-8))
