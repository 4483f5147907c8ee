"""A steel ball falls on a steel beam

A ball of 1 cm radius hits the middle of a bar of 1 cm × 1 cm at 1 cm/s. Timoshenko joined Hertz's law to the motion
of the beam in an integral equation; until waves come back from the supports, the beam is as good as infinite:

    δ = v t - 1/m ∫₀ᵗ (t - τ) F dτ - 1/(ρA √(2πa)) ∫₀ᵗ √(t - τ) F dτ,    F = K δ^1.5,  a = √(EI/ρA)

The sheet solves it by the trapezoidal rule with 4000 steps; fembeam takes 45 modes of a beam of 60 cm. The numbers
are those of [ball_on_beam.py](../../examples/ball_on_beam.py) of the course.
"""

import sketch
from sheets import Row, example

SOURCE = (
    "S.P. Timoshenko, *Zur Frage nach der Wirkung eines Stoßes auf einen Balken*, Z. Math. Phys. 62 (1913); W. "
    "Goldsmith, *Impact*, Arnold 1960, chapter on transverse impact on beams"
)


def rows():
    found = example("ball_on_beam")
    log = found["log"]
    return [
        Row("peak force / N", found["peak"], found["peaks"][-1], 2e-3),
        Row("contact time / s", found["time"], float(log.t_out[0] - log.t_in[0]), 2e-3),
    ]


def draw(rig, plot):
    sketch.beam(rig, 0.0, 2.4, 0.0, 0.12)
    for x in (0.0, 2.4):
        sketch.pin(rig, x, -0.06)
    sketch.ball(rig, 1.2, 0.45, 0.2, "m")
    sketch.arrow(rig, (1.6, 0.65), (1.6, 0.3), "v", shift=(0.12, 0.0))
    sketch.view(rig, -0.3, 2.7, -0.5, 0.9)
    found = example("ball_on_beam")
    plot.axhline(found["peak"], color="0.6", lw=3.0, label="integral equation")
    plot.semilogx((5, 15, 45), found["peaks"], "k.-", label="fembeam")
    plot.set(xlabel="modes of the beam", ylabel="peak force / N", xticks=(5, 15, 45), xticklabels=("5", "15", "45"))
    plot.minorticks_off()
    plot.legend()
