"""Natural frequencies of uniform beams

A uniform slender beam of length L, bending stiffness EI and mass ρA per length vibrates at

    ω_n = (λ_n/L)² √(EI/ρA)

where λ_n are the roots of

    clamped, free       cos λ cosh λ = -1
    pinned, pinned      sin λ = 0
    clamped, pinned     tan λ = tanh λ
    clamped, clamped    cos λ cosh λ = 1

Here L = 1.2 m, a steel bar of 30 mm × 10 mm, E = 210 GPa, ρ = 7850 kg/m³. Elements are as many as fembeam chooses, so
that every frequency is right to 1e-6; Hermite elements come from above. The sheet finds the roots itself.
"""

import math
from functools import cache

import numpy as np
import sketch
from scipy.optimize import brentq
from sheets import Row

import fembeam as fb

SOURCE = (
    "R.D. Blevins, *Formulas for Natural Frequency and Mode Shape*, Van Nostrand Reinhold 1979, table 8-1 "
    "(single-span beams)"
)
LENGTH, MODES = 1.2, 4
STEEL = fb.Section.rectangle(2.1e11, 7850.0, 0.03, 0.01)
ENDS = {"clamped, free": (fb.Clamped, None), "pinned, pinned": (fb.Pinned, fb.Pinned),
        "clamped, pinned": (fb.Clamped, fb.Pinned), "clamped, clamped": (fb.Clamped, fb.Clamped)}  # fmt: skip
EQUATIONS = {
    "clamped, free": lambda x: math.cos(x) + 1.0 / math.cosh(x),
    "pinned, pinned": math.sin,
    "clamped, pinned": lambda x: math.sin(x) - math.cos(x) * math.tanh(x),
    "clamped, clamped": lambda x: math.cos(x) - 1.0 / math.cosh(x),
}
ABOUT = {"clamped, free": -0.5, "pinned, pinned": 0.0, "clamped, pinned": 0.25, "clamped, clamped": 0.5}
PRINTED = {
    "clamped, free": ("1.87510407", "4.69409113", "7.85475744", "10.99554073"),
    "clamped, pinned": ("3.92660231", "7.06858275", "10.21017612", "13.35176878"),
    "clamped, clamped": ("4.73004074", "7.85320462", "10.9956079", "14.1371655"),
}


def root(ends, n):
    """λ_n, which lies near (n + shift) π."""
    near = (n + ABOUT[ends]) * math.pi
    return brentq(EQUATIONS[ends], near - 0.5, near + 0.5, xtol=1e-14)


@cache
def model(ends):
    """The beam, supported."""
    supports = [part(z) for part, z in zip(ENDS[ends], (0.0, LENGTH), strict=True) if part]
    return fb.Scene(fb.Beam(LENGTH, STEEL), supports).reduce(MODES)


def rows():
    scale = math.sqrt(STEEL.bending_stiffness / STEEL.line_mass) / LENGTH**2
    found = []
    for ends in ENDS:
        lambdas = np.sqrt(model(ends).omega / scale)
        for n, ours in enumerate(lambdas, start=1):
            printed = PRINTED[ends][n - 1] if ends in PRINTED else ""
            found.append(Row(f"λ{n}, {ends}", root(ends, n), float(ours), 1e-6, printed))
    return found


def draw(rig, plot):
    for y, ends in zip((1.8, 1.2, 0.6, 0.0), ENDS, strict=True):
        sketch.beam(rig, 0.0, 2.0, y)
        for part, x, side in zip(ENDS[ends], (0.0, 2.0), (1.0, -1.0), strict=True):
            if part is fb.Clamped:
                sketch.wall(rig, x, y, 0.36, 90.0, side)
            elif part:
                sketch.pin(rig, x, y - 0.035)
    sketch.arrow(rig, (0.0, 2.1), (2.0, 2.1), "L", both=True, shift=(0.0, 0.12))
    sketch.view(rig, -0.3, 2.3, -0.45, 2.35)
    z = np.linspace(0.0, LENGTH, 200)
    for ends in ENDS:
        shape = model(ends).phi(z)[:, 1]
        plot.plot(z / LENGTH, shape / np.abs(shape).max(), label=ends)
    plot.set(xlabel="z/L", ylabel="second mode", ylim=(-1.1, 1.75))
    plot.legend(fontsize="small", ncols=2, loc="upper center")
