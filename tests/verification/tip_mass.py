"""Cantilever with a mass of rotary inertia at its tip

A body of mass μ ρAL and rotary inertia κ ρAL³ sits at the free end of a clamped beam. With u'' = κ λ⁴ u' and u''' =
-μ λ⁴ u there, in units of L, the frequencies ω_n = (λ_n/L)² √(EI/ρA) are the zeros of the determinant

    | -(c + C) + κ λ³ (s + S)    -(s + S) - κ λ³ (c - C) |
    |   s - S + μ λ (c - C)      -(c + C) + μ λ (s - S)  |      c = cos λ, s = sin λ, C = cosh λ, S = sinh λ

Three bodies: the mass alone, as heavy as the beam (μ = 1, κ = 0), with rotary inertia (κ = 0.01, 1). The published
numbers are λ² for the mass alone. The paper defines its inertia otherwise, so its other columns are not compared.
"""

import math
from functools import cache

import numpy as np
import sketch
from scipy.optimize import brentq
from sheets import Row

import fembeam as fb

SOURCE = (
    "P.A.A. Laura, J.L. Pombo, E.A. Susemihl, *J. Sound Vib.* 37 (1974) 161 (the equation without inertia); published "
    "numbers: *Frequency Equation of Flexural Vibrating Cantilever Beam Considering the Rotary Inertial Moment of an "
    "Attached Mass*, Math. Probl. Eng. 2017, article 1568019, table 1, last columns"
)
BODIES = ((1.0, 0.0), (1.0, 0.01), (1.0, 1.0))
PRINTED = {(1.0, 0.0): ("1.557298", "16.25009", "50.89584", "105.1983")}
UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0)


def determinant(x, mu, kappa):
    """Zero at the roots λ; over cosh² λ."""
    c, s, C, S = math.cos(x), math.sin(x), math.cosh(x), math.sinh(x)
    first = (-(c + C) + kappa * x**3 * (s + S), -(s + S) - kappa * x**3 * (c - C))
    second = (s - S + mu * x * (c - C), -(c + C) + mu * x * (s - S))
    return (first[0] * second[1] - first[1] * second[0]) / C**2


def roots(mu, kappa, count=4):
    """The first λ, by changes of sign on a fine grid."""
    grid = np.arange(0.1, 12.0, 0.02)
    signs = np.sign([determinant(x, mu, kappa) for x in grid])
    changes = np.flatnonzero(signs[:-1] != signs[1:])[:count]
    return [brentq(determinant, grid[i], grid[i + 1], args=(mu, kappa), xtol=1e-14) for i in changes]


@cache
def model(mu, kappa):
    """The cantilever of unit length with its body."""
    tip = fb.LumpedMass(1.0, mass=mu, inertia=kappa)
    return fb.Scene(fb.Beam(1.0, UNIT), [fb.Clamped(0.0)], [tip]).reduce(4)


def rows():
    found = []
    for mu, kappa in BODIES:
        printed = PRINTED.get((mu, kappa), ("",) * 4)
        for n, (root, ours) in enumerate(zip(roots(mu, kappa), model(mu, kappa).omega, strict=True)):
            found.append(Row(f"λ{n + 1}², μ = {mu:g}, κ = {kappa:g}", root**2, float(ours), 1e-6, printed[n]))
    return found


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.6)
    sketch.beam(rig, 0.0, 2.0)
    sketch.block(rig, 2.15, 0.0, "m, J", 0.5, 0.5)
    sketch.arrow(rig, (0.0, 0.45), (2.0, 0.45), "L", both=True, shift=(0.0, 0.12))
    sketch.view(rig, -0.3, 2.6, -0.7, 0.9)
    z = np.linspace(0.0, 1.0, 200)
    for mu, kappa in BODIES:
        shape = model(mu, kappa).phi(z)[:, 1]
        plot.plot(z, shape / np.abs(shape).max(), label=f"κ = {kappa:g}")
    plot.set(xlabel="z/L", ylabel="second mode, μ = 1")
    plot.legend()
