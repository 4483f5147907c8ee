"""A rod flies against a wall

A rod of length L and wave speed c = √(E/ρ) hits a rigid wall at speed v. A wave runs to its free end and back, after
which it leaves with the speed it had:

    T = 2L/c,    ∫F dt = 2 m v,    F = v A √(Eρ)

Here 80 finite elements and a wall ten times as stiff as one of them, see [matrices.py](../../examples/matrices.py) of
the course: a front is as steep as the elements allow, so that 2 % are missed.
"""

import math

import sketch
from sheets import Row, example

SOURCE = "A.J.C.B. de Saint-Venant, *J. Math. Pures Appl.* (2) 12 (1867) 237; W. Goldsmith, *Impact*, Arnold 1960"


def rows():
    found = example("matrices")
    log, mass = found["log"], float(found["mass"].sum())
    force = found["speed"] * found["A"] * math.sqrt(found["E"] * found["rho"])
    return [
        Row("contact time / s", found["duration"], float(log.t_out[-1]), 0.02),
        Row("impulse / N s", 2.0 * mass * found["speed"], float(log.impulse.sum()), 0.02),
        Row("mean force / N", force, float(log.impulse.sum() / log.t_out[-1]), 0.04),
    ]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.8)
    sketch.beam(rig, 0.15, 2.2, 0.0, 0.2)
    sketch.arrow(rig, (1.4, 0.3), (0.9, 0.3), "v", shift=(-0.12, 0.0))
    sketch.arrow(rig, (0.15, -0.3), (2.2, -0.3), "L", both=True, shift=(0.0, -0.13))
    sketch.view(rig, -0.3, 2.5, -0.6, 0.7)
    found = example("matrices")
    speeds = found["arrived"].q_dot[-1]
    plot.plot(range(len(speeds)), speeds / found["speed"], "k.-", ms=3, lw=0.7, label="fembeam")
    plot.axhline(1.0, color="0.6", lw=3.0, zorder=0, label="formula")
    plot.set(xlabel="node", ylabel="speed after the impact / v", ylim=(0.0, 1.6))
    plot.legend()
