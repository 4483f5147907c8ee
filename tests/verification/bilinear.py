"""A beam that just touches a stop: the bilinear oscillator

One mode of a cantilever and a linear stop k under its tip, without a gap. Free vibration spends half a period without
the stop and half with it,

    ω = 2 ω₁ω₂/(ω₁ + ω₂),    ω₂ = √(ω₁² + φ² k)

which is at most 2 ω₁. The numbers are those of [bilinear.py](../../examples/bilinear.py) of the course.
"""

import numpy as np
import sketch
from sheets import Row, example

SOURCE = "S.W. Shaw, P.J. Holmes, *A periodically forced piecewise linear oscillator*, J. Sound Vib. 90 (1983) 129"


def rows():
    results = example("bilinear")["results"]
    return [Row(f"ω / rad s⁻¹, k = {k:g} N/m", formula, ours, 1e-8) for k, (ours, formula, _) in results.items()]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.6)
    sketch.beam(rig, 0.0, 2.0)
    sketch.stop(rig, 2.0, -0.035, 0.5)
    rig.text(2.2, -0.3, "k")
    sketch.view(rig, -0.3, 2.6, -0.75, 0.5)
    results = example("bilinear")["results"]
    free = next(iter(results.values()))[2]
    ratios = np.geomspace(0.03, 1e3, 200)  # φ² k over ω₁²
    stiff = np.sqrt(1.0 + ratios)
    plot.semilogx(ratios, 2.0 * stiff / (1.0 + stiff), color="0.6", lw=3.0, label="formula")
    for ours, formula, _ in results.values():
        second = formula / (2.0 * free - formula)  # ω₂/ω₁
        plot.semilogx(second**2 - 1.0, ours / free, "k.", ms=9)
    plot.set(xlabel="φ² k/ω₁²", ylabel="ω/ω₁; dots: fembeam")
    plot.legend()
