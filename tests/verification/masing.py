"""Masing's rule, on Ramberg and Osgood's curve

A material of sliders in parallel follows, after each reversal, its first loading enlarged twice:

    (δ_r - δ)/2 = δ_b((F_r - F)/2),    δ_b(F) = F + α F^r

where δ_b is the first loading, here that of Ramberg and Osgood with α = 0.5, r = 5. The loss per cycle between ±F_m
is then

    W = 4 α (r - 1)/(r + 1) F_m^(r + 1)

The first loading is given as 120 points to sliders in parallel; errors are those of this polygon.
"""

import numpy as np
import sketch
from sheets import Row

from contacts import Iwan
from contacts.path import work

SOURCE = (
    "G. Masing, *Proc. 2nd Int. Congr. Appl. Mech.*, Zürich 1926, p. 332; P.C. Jennings, *J. Eng. Mech. Div. ASCE* 90"
    " EM2 (1964) 131 (the loss)"
)
ALPHA, POWER, TOP = 0.5, 5, 1.5


def first(force):
    """δ_b of the first loading."""
    return force + ALPHA * force**POWER


FORCES = np.linspace(0.0, 1.2 * TOP, 121)
LAW = Iwan.from_backbone(first(FORCES), FORCES)
X = float(first(TOP))


def rows():
    found = []
    for share in (0.5, 0.0, -0.5):  # of the top, unloading
        delta = X - 2.0 * float(first(0.5 * TOP * (1.0 - share)))
        found.append(Row(f"2 F_m - F unloading from F_m, at F = {share:g} F_m", (2.0 - share) * TOP,
                         2.0 * TOP - float(LAW.along([X, delta])[-1]), 1e-3))  # fmt: skip
    for force in (0.75, 1.0, TOP):
        x = float(first(force))
        area = work(LAW, [0.0, x, -x, x]) - work(LAW, [0.0, x])
        exact = 4.0 * ALPHA * (POWER - 1.0) / (POWER + 1.0) * force ** (POWER + 1)
        found.append(Row(f"loss per cycle, F_m = {force:g}", exact, area, 1e-3))
    return found


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.8, 90.0)
    sketch.beam(rig, 0.0, 1.6, 0.0, 0.3)
    sketch.arrow(rig, (1.65, 0.0), (2.2, 0.0), "F", shift=(0.1, 0.0))
    sketch.arrow(rig, (1.6, 0.35), (2.0, 0.35), "δ", shift=(0.1, 0.0))
    sketch.view(rig, -0.3, 2.5, -0.6, 0.7)
    down = np.linspace(X, -X, 50)
    forces = np.linspace(0.0, TOP, 13)
    path = [*first(np.linspace(0.0, TOP, 40)), *down, *down[::-1]]
    plot.plot(path, LAW.along(path), label="fembeam")
    plot.plot(first(forces), forces, "k.", label="first loading")
    plot.plot(X - 2.0 * first(forces), TOP - 2.0 * forces, "x", color="0.4", label="twice as large")
    plot.set(xlabel="δ", ylabel="F")
    plot.legend()
