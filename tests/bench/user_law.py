"""What a law of one's own costs: run times on the paper's scene relative to the built-in law, timed by turns.

``python tests/bench/user_law.py`` prints medians over the rounds of ratios within a round.
"""

import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
from problems import paper_scene

import solvers
from contacts import Hertz, Hysteretic, Tabulated, law

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
for method in (solvers.Exponential(1e-8), solvers.DormandPrince(1e-10)):
    models = {name: paper_scene(law=one).reduce(2) for name, one in laws.items()}
    runs = {name: model.simulate(0.2, None, solver=method) for name, model in models.items()}
    times = {name: [] for name in models}
    for _ in range(ROUNDS):
        for name, model in models.items():
            start = time.perf_counter()
            for _ in range(5):
                model.simulate(0.2, None, solver=method)
            times[name].append((time.perf_counter() - start) / 5)
    first = np.array(times["Hysteretic"])
    print(f"{type(method).__name__}: Hysteretic takes {1e6 * np.median(first):.0f} µs for 0.2 s")
    for name, taken in times.items():
        ratio, run = np.median(np.array(taken) / first), runs[name]
        print(f"  {name:30} {ratio:5.2f} times as long, {len(run.contacts)} contacts, {run.cost.law_calls} law calls")
