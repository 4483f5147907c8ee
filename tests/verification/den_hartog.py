"""Forced vibration with dry friction

A mass on a spring k slides against a force F of dry friction, driven by P cos ωt. Steady motion without standstill
has the amplitude, with r = ω over the natural frequency,

    x k/P = √(V² - U² (F/P)²),    V = 1/(1 - r²),    U = sin(π/r)/(r (1 + cos(π/r)))

fembeam has no rigid friction: the slider sits behind a tangential stiffness, here 1e8 k, and the formula is
approached like the inverse root of it (factor 10 in the error for 100 in the stiffness). The motion is found as a
periodic orbit.
"""

import math
from functools import cache

import numpy as np
import sketch
from sheets import Row

import fembeam as fb
import solvers
from contacts import Coulomb

SOURCE = (
    "J.P. Den Hartog, *Forced vibrations with combined viscous and Coulomb damping*, Phil. Mag. (7) 9 (1930) 801, and"
    " *Trans. ASME* 53 (1931) APM-53-9"
)
CASES = ((0.6, 0.3), (0.8, 0.5), (1.25, 0.5), (2.0, 0.3))  # frequency ratio, F/P


def exact(r, friction):
    """x k/P."""
    V, U = 1.0 / (1.0 - r * r), math.sin(math.pi / r) / (r * (1.0 + math.cos(math.pi / r)))
    return math.sqrt(V**2 - (U * friction) ** 2)


@cache
def orbit(r, friction):
    """One period, sampled."""
    slider = solvers.Contact([1.0], Coulomb(friction, 1e8), always=True)
    system = solvers.System([[1.0]], [[0.0]], [[1.0]], [slider], [([1.0], fb.Harmonic(1.0, r))])
    return solvers.orbit(system, 2.0 * math.pi / r).samples()


def rows():
    return [
        Row(f"x k/P, r = {r:g}, F/P = {f:g}", exact(r, f), float(np.abs(orbit(r, f).q).max()), 2e-4) for r, f in CASES
    ]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.1, 0.8)
    sketch.spring(rig, (0.0, 0.2), (1.0, 0.2))
    sketch.block(rig, 1.4, 0.1, "m", 0.8, 0.55)
    sketch.wall(rig, 1.2, -0.175, 2.0, 0.0, -1.0)
    sketch.arrow(rig, (1.8, 0.1), (2.4, 0.1), "P cos ωt", shift=(0.0, 0.15))
    rig.text(0.5, 0.4, "k", ha="center")
    rig.text(1.4, -0.45, "friction F", ha="center")
    sketch.view(rig, -0.3, 2.8, -0.7, 0.8)
    for friction in (0.3, 0.5):
        for low, high in ((0.55, 0.93), (1.07, 2.2)):
            r = np.linspace(low, high, 100)
            plot.plot(r, [exact(x, friction) for x in r], color="0.6" if friction == 0.3 else "C0")
    for r, friction in CASES:
        plot.plot(r, np.abs(orbit(r, friction).q).max(), "k.", ms=9)
    plot.set(xlabel="ω over natural frequency", ylabel="x k/P; dots: fembeam", ylim=(0.0, 6.0))
    plot.text(1.3, 4.5, "grey F/P = 0.3\nblue F/P = 0.5")
