"""Axially loaded beams: frequencies and Euler's buckling loads

A tension S raises the frequencies of a pinned beam, a compression lowers them to zero at Euler's load:

    ω_n = (nπ/L)² √(EI/ρA) √(1 + S L²/(n² π² EI))
    P = π²EI/4L² (clamped, free)   π²EI/L² (pinned)   x²EI/L², x = tan x (clamped, pinned)   4π²EI/L² (clamped)

All in units EI = ρA = L = 1, with S from half of the buckling load in compression to ten times it in tension.
"""

import math

import numpy as np
import sketch
from scipy.optimize import brentq
from sheets import Row

import fembeam as fb

SOURCE = (
    "S. Timoshenko, D.H. Young, *Vibration Problems in Engineering*, Van Nostrand 1955 (frequencies of a bar with "
    "axial force); S.P. Timoshenko, J.M. Gere, *Theory of Elastic Stability*, McGraw-Hill 1961, chapter 2 (buckling; "
    "20.19 for one end built in, the other hinged)"
)
UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0)
PINNED = [fb.Pinned(0.0), fb.Pinned(1.0)]
CLAMPED = fb.Clamped(0.0)
SHARES = (-0.5, 1.0, 10.0)


def exact(n, share):
    """ω_n under S = share π²."""
    return (n * math.pi) ** 2 * math.sqrt(1.0 + share / n**2)


def omega(share, count=2):
    """Ours."""
    return fb.Scene(fb.Beam(1.0, UNIT, axial_force=share * math.pi**2), PINNED).reduce(count).omega


def rows():
    found = []
    for share in SHARES:
        for n, ours in enumerate(omega(share), start=1):
            found.append(Row(f"ω{n}, S = {share:g} π²", exact(n, share), float(ours), 1e-6))
    tangent = brentq(lambda x: math.tan(x) - x, 4.4, 4.6, xtol=1e-14) ** 2
    loads = {
        "clamped, free": ([CLAMPED], math.pi**2 / 4.0, ""),
        "pinned, pinned": (PINNED, math.pi**2, ""),
        "clamped, pinned": ([CLAMPED, fb.Pinned(1.0)], tangent, "20.19"),
        "clamped, clamped": ([CLAMPED, fb.Clamped(1.0)], 4.0 * math.pi**2, ""),
    }
    for ends, (supports, load, printed) in loads.items():
        ours = fb.Scene(fb.Beam(1.0, UNIT), supports).buckling_load()
        found.append(Row(f"buckling load, {ends}", load, ours, 1e-6, printed))
    return found


def draw(rig, plot):
    sketch.beam(rig, 0.0, 2.0)
    for x in (0.0, 2.0):
        sketch.pin(rig, x, -0.035)
    sketch.arrow(rig, (2.05, 0.0), (2.6, 0.0), "S", shift=(0.1, 0.0))
    sketch.arrow(rig, (-0.05, 0.0), (-0.6, 0.0), "S", shift=(-0.1, 0.0))
    sketch.view(rig, -0.9, 2.9, -0.6, 0.6)
    shares = np.linspace(-0.999, 4.0, 300)
    plot.plot(shares, [exact(1, one) ** 2 for one in shares], color="0.6", lw=3.0, label="formula")
    marks = np.array([-0.99, -0.5, 0.0, 1.0, 2.0, 3.0, 4.0])
    plot.plot(marks, [omega(one)[0] ** 2 for one in marks], "k.", label="fembeam")
    plot.set(xlabel="S L²/π²EI", ylabel="ω₁² ρA L⁴/EI")
    plot.legend()
