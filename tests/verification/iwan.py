"""Iwan's distributed elements: uniform limits of slip

Infinitely many springs with sliders in parallel, whose limits are spread evenly from 0, stiffness k and limit f of
all together. The first loading is a parabola, and a cycle of amplitude X loses the area between two of its halves:

    F = k δ (1 - k δ/4f) up to δ = 2f/k,    W = k² X³/3f,    4 f (X - 4f/3k) beyond

With N elements both are approached like 1/N²: the force is at most f/4N² off. Here k = 1, f = 1, N = 60.
"""

import numpy as np
import sketch
from sheets import Row

from contacts import Iwan
from contacts.path import work

SOURCE = "W.D. Iwan, *J. Appl. Mech.* 33 (1966) 893, the distributed-element model with uniform yield levels"
LAW = Iwan.uniform(1.0, 1.0, 60)


def force(x):
    """Of the first loading."""
    return x * (1.0 - 0.25 * x) if x < 2.0 else 1.0


def loss(X):
    """Area of a cycle: 8 ∫ F dδ - 4 X F(X)."""
    return X**3 / 3.0 if X < 2.0 else 4.0 * (X - 4.0 / 3.0)


def area(X):
    """Ours."""
    return work(LAW, [0.0, X, -X, X]) - work(LAW, [0.0, X])


def rows():
    found = [Row(f"first loading, k δ/f = {x:g}", force(x), float(LAW.along([x])[0]), 3e-3) for x in (0.3, 1.0, 2.5)]
    return found + [Row(f"loss per cycle, k X/f = {X:g}", loss(X), area(X), 3e-3) for X in (0.5, 1.0, 2.0, 3.0)]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 1.8, 90.0)
    for y, text in ((0.7, "f₁"), (0.25, "f₂"), (-0.2, "f₃"), (-0.7, "f_N")):
        sketch.spring(rig, (0.0, y), (0.8, y))
        sketch.slider(rig, (0.8, y), (1.4, y), 0.1)
        rig.text(1.2, y + 0.14, text, ha="center", fontsize="small")
    rig.text(0.7, -0.47, "…", ha="center")
    sketch.line(rig, [1.4, 1.4], [-0.85, 0.85])
    sketch.arrow(rig, (1.4, 0.0), (1.9, 0.0), "δ", shift=(0.1, 0.0))
    sketch.view(rig, -0.3, 2.2, -1.0, 1.0)
    for X in (1.0, 2.0, 3.0):
        cycle = np.concatenate((np.linspace(0.0, X, 40), np.linspace(X, -X, 60), np.linspace(-X, X, 60)))
        plot.plot(cycle, LAW.along(cycle))
    x = np.linspace(0.0, 3.0, 13)
    plot.plot(x, [force(one) for one in x], "k.", label="F = k δ (1 - k δ/4f)")
    plot.set(xlabel="k δ/f", ylabel="F/f")
    plot.legend()
