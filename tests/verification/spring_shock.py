"""A mass on a spring thrown onto a stop

A mass of 100 kg on a spring of 1e4 N/m leaves its rest position at 1 m/s and meets a stop of 1e6 N/m there. While it
is in contact it swings with ω = √((k + K)/m), so that

    T = π/ω,    F_max = K v/ω,    ∫F dt = 2 K v/ω²

and it comes back with -v, to hit the stop again half a period of its own spring later.
"""

import math
from functools import cache

import numpy as np
import sketch
from sheets import Row

import solvers
from contacts import PiecewiseLinear

SOURCE = "EDF R&D, code_aster validation manual, *SDND101*, document V5.01.101"
MASS, SPRING, STOP, SPEED = 100.0, 1e4, 1e6, 1.0
OMEGA = math.sqrt((SPRING + STOP) / MASS)


@cache
def run():
    """Three contacts."""
    system = solvers.System([[MASS]], [[0.0]], [[SPRING]], [solvers.Contact([1.0], PiecewiseLinear([STOP]))])
    return solvers.integrate(system, [0.0], [-SPEED], 0.9, 1e-3, solvers.Exponential(1e-10))


def rows():
    log = run().contacts
    between = math.pi / math.sqrt(SPRING / MASS)
    return [
        Row("contact time / s", math.pi / OMEGA, float(log.t_out[0] - log.t_in[0]), 1e-8),
        Row("largest force / N", STOP * SPEED / OMEGA, float(log.peak_force[0]), 1e-8),
        Row("impulse / N s", 2.0 * STOP * SPEED / OMEGA**2, float(log.impulse[0]), 1e-8),
        Row("speed after / m s⁻¹", SPEED, float(log.speed_out[0]), 1e-8),
        Row("time to the next contact / s", between, float(log.t_in[1] - log.t_out[0]), 1e-8),
    ]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.8)
    sketch.spring(rig, (0.0, 0.0), (0.9, 0.0))
    sketch.block(rig, 1.2, 0.0, "m", 0.6, 0.5)
    sketch.spring(rig, (1.55, 0.0), (2.2, 0.0))
    sketch.line(rig, [1.53, 1.53], [-0.15, 0.15], lw=2.0)
    sketch.wall(rig, 2.2, 0.0, 0.8, 90.0, -1.0)
    sketch.arrow(rig, (1.0, 0.45), (1.45, 0.45), "v", shift=(0.12, 0.0))
    rig.text(0.45, 0.15, "k", ha="center")
    rig.text(1.9, 0.15, "K", ha="center")
    sketch.view(rig, -0.3, 2.5, -0.6, 0.7)
    t = run().t
    plot.plot(t, 1e3 * -run().q[:, 0], "k-", label="fembeam")
    plot.plot(0.5 * math.pi / OMEGA, 1e3 * SPEED / OMEGA, "o", color="0.6", ms=9, zorder=0, label="formula")
    low = -1e3 * SPEED / math.sqrt(SPRING / MASS)
    plot.plot(math.pi / OMEGA + 0.05 * np.pi, low, "o", color="0.6", ms=9, zorder=0)
    plot.set(xlabel="t / s", ylabel="way into the stop / mm", ylim=(-110.0, 50.0))
    plot.legend(ncols=2, loc="upper right")
