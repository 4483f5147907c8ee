"""Two masses, one on dry friction with a larger static limit

Two masses of 5 kg are joined by a spring of 1e4 N/m. The first is pressed on a plane by 1e4 N, with coefficients of
friction 0.3 in stick and 0.2 in slip; the second is pulled by 3000 N until 0.2 s. The first sticks, slips from t₁ on,
and sticks again at t₃. Each phase is a sum of a straight or parabolic motion and a cosine, which the sheet joins.

The published numbers are the analytical ones of code_aster's validation manual; its own results there differ by up
to 0.23 %. In fembeam the contact has a tangential stiffness of 1e9 N/m and a critical dashpot in stick, so that the
first mass moves by micrometres before it slips.
"""

import math
from functools import cache

import numpy as np
import sketch
from scipy.optimize import brentq
from sheets import Row

import fembeam as fb
import solvers
from contacts import Coulomb

SOURCE = "EDF R&D, code_aster validation manual, *SDND106*, document V5.01.106, sections 1 to 3"
MASS, K, PULL, STATIC, KINETIC, RELEASE = 5.0, 1e4, 3e3, 3e3, 2e3, 0.2
SLOW, FAST = math.sqrt(K / MASS), math.sqrt(2.0 * K / MASS)


def stuck(state, pull, t):
    """[x₁, v₁, x₂, v₂] after t s with the first mass at rest."""
    x, _, y, v = state
    rest = x + pull / K
    c, s = math.cos(SLOW * t), math.sin(SLOW * t)
    return np.array([x, 0.0, rest + (y - rest) * c + v / SLOW * s, -(y - rest) * SLOW * s + v * c])


def sliding(state, pull, t):
    """The same with the first mass sliding forwards."""
    x, u, y, v = state
    push = (pull - KINETIC) / (2.0 * MASS)
    middle, speed = (x + y) / 2 + (u + v) / 2 * t + push * t**2 / 2, (u + v) / 2 + push * t
    rest = (pull + KINETIC) / (2.0 * K)
    c, s = math.cos(FAST * t), math.sin(FAST * t)
    apart = rest + (y - x - rest) * c + (v - u) / FAST * s
    rate = -(y - x - rest) * FAST * s + (v - u) * c
    return np.array([middle - apart / 2, speed - rate / 2, middle + apart / 2, speed + rate / 2])


def exact():
    """(t₁, t₃, state at a time) of the three phases."""
    first = math.acos(1.0 - STATIC / PULL) / SLOW
    begin = stuck(np.zeros(4), PULL, first)
    released = sliding(begin, PULL, RELEASE - first)
    times = np.linspace(0.0, 0.2, 401)
    stops = next(t for t in times if sliding(released, 0.0, t)[1] < 0.0)
    last = RELEASE + brentq(lambda t: sliding(released, 0.0, t)[1], stops - times[1], stops, xtol=1e-15)
    end = sliding(released, 0.0, last - RELEASE)

    def at(t):
        if t < first:
            return stuck(np.zeros(4), PULL, t)
        if t < RELEASE:
            return sliding(begin, PULL, t - first)
        return sliding(released, 0.0, t - RELEASE) if t < last else stuck(end, 0.0, t - last)

    return first, last, at


@cache
def runs():
    """With the pull, then without."""
    stiffness = 1e9
    law = Coulomb(KINETIC, stiffness, STATIC, damping=2.0 * math.sqrt(stiffness * MASS))
    friction = [solvers.Contact([1.0, 0.0], law, always=True)]
    M, C, spring = MASS * np.eye(2), np.zeros((2, 2)), K * np.array([[1.0, -1.0], [-1.0, 1.0]])
    method = solvers.Exponential(1e-9)
    pulled = solvers.System(M, C, spring, friction, [([0.0, 1.0], fb.Harmonic(PULL, 0.0))])
    first = solvers.integrate(pulled, [0.0, 0.0], [0.0, 0.0], RELEASE, 0.002, method)
    left = solvers.System(M, C, spring, friction)
    later = solvers.integrate(left, first.q[-1], first.q_dot[-1], 0.16, 0.002, method, memory=first.memory)
    return first, later


def rows():
    t1, t3, at = exact()
    first, later = runs()
    return [
        Row("t₁ / s", t1, float(first.transitions.t[0]), 1e-4, "0.03512"),
        Row("t₃ / s", t3, RELEASE + float(later.transitions.t[0]), 1e-4, "0.31492"),
        Row("x₂ / m at 0.02 s", at(0.02)[2], float(first.q[10, 1]), 1e-4, "0.11221"),
        Row("x₁ / m at 0.15 s", at(0.15)[0], float(first.q[75, 0]), 1e-4, "1.35332"),
        Row("x₂ / m at 0.15 s", at(0.15)[2], float(first.q[75, 1]), 1e-4, "1.80751"),
        Row("x₂ / m at 0.34 s", at(0.34)[2], float(later.q[70, 1]), 1e-4, "3.96813"),
    ]


def draw(rig, plot):
    sketch.block(rig, 0.3, 0.0, "m", 0.6, 0.5)
    sketch.block(rig, 1.7, 0.0, "m", 0.6, 0.5)
    sketch.spring(rig, (0.6, 0.0), (1.4, 0.0))
    sketch.wall(rig, 0.3, -0.25, 1.0, 0.0, -1.0)
    sketch.arrow(rig, (0.3, 0.75), (0.3, 0.25), "1e4 N", shift=(0.0, 0.65))
    sketch.arrow(rig, (2.0, 0.0), (2.5, 0.0), "3000 N", shift=(0.0, 0.15))
    sketch.view(rig, -0.4, 2.9, -0.6, 1.1)
    first, later = runs()
    *_, at = exact()
    t = np.concatenate((first.t, RELEASE + later.t[1:]))
    plot.plot(t, [at(x)[[0, 2]] for x in t], color="0.75", lw=4.0)
    plot.plot(t, np.vstack((first.q, later.q[1:])), "k-", lw=1.0)
    plot.set(xlabel="t / s", ylabel="x₁, x₂ / m; grey: formula")
