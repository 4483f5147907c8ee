"""Impact of an elastic sphere on a half-space

A sphere of radius R and mass m hits a half-space at speed V. With F = K δ^1.5, K = 4/3 E* √R, and waves left out,

    δ_max = (15 m V²/16 E* √R)^(2/5),    F_max = K δ_max^1.5
    T = 2 δ_max/V ∫₀¹ dx/√(1 - x^(5/2)) = (4/5) B(2/5, 1/2) δ_max/V

Here a steel ball of 10 mm radius, 0.1 and 3 m/s, E = 210 GPa, ν = 0.3, ρ = 7850 kg/m³ on the same steel. The
published factors are those of δ_max/V and of (m²/(R E*² V))^(1/5).
"""

import math

import numpy as np
import sketch
from scipy.special import beta
from sheets import Row

import solvers
from contacts import Hertz

SOURCE = (
    "K.L. Johnson, *Contact Mechanics*, Cambridge University Press 1985, section 11.4, T = 2.94 δ/V = 2.87 (…)^(1/5)"
)
E, NU, RHO, R = 2.1e11, 0.3, 7850.0, 0.01
MASS, MODULUS = 4.0 / 3.0 * math.pi * R**3 * RHO, 0.5 * E / (1.0 - NU**2)
LAW = Hertz.of_spheres(E, NU, R, E, NU, math.inf)
SPEEDS = (0.1, 3.0)


def thrown(speed, **options):
    """The ball from when it touches."""
    stop = solvers.Contact([1.0], LAW)
    system = solvers.System([[MASS]], [[0.0]], [[0.0]], [stop])
    return solvers.integrate(system, [0.0], [-speed], 4e-4, method=solvers.Exponential(1e-10), **options)


def exact(speed):
    """Peak indentation, peak force, contact time."""
    depth = (15.0 * MASS * speed**2 / (16.0 * MODULUS * math.sqrt(R))) ** 0.4
    return depth, 4.0 / 3.0 * MODULUS * math.sqrt(R) * depth**1.5, 0.8 * beta(0.4, 0.5) * depth / speed


def rows():
    found = []
    for speed in SPEEDS:
        log, (depth, force, time) = thrown(speed).contacts, exact(speed)
        ours = float(log.t_out[0] - log.t_in[0])
        scale = (MASS**2 / (R * MODULUS**2 * speed)) ** 0.2
        at = f", {speed:g} m/s"
        found += [
            Row(f"δ max / m{at}", depth, float(log.peak_indentation[0]), 1e-8),
            Row(f"F max / N{at}", force, float(log.peak_force[0]), 1e-8),
            Row(f"T V/δ max{at}", time * speed / depth, ours * speed / float(log.peak_indentation[0]), 1e-8, "2.94"),
            Row(f"T (R E*² V/m²)^(1/5){at}", time / scale, ours / scale, 1e-8, "2.87"),
            Row(f"exit over entry speed{at}", 1.0, float(log.speed_out[0]) / speed, 1e-8),
        ]
    return found


def draw(rig, plot):
    sketch.ball(rig, 0.0, 0.62, 0.5, "m, R")
    sketch.arrow(rig, (0.75, 1.0), (0.75, 0.5), "V", shift=(0.12, 0.0))
    sketch.wall(rig, 0.0, 0.0, 2.0, 0.0, -1.0)
    sketch.view(rig, -1.2, 1.3, -0.3, 1.3)
    run = thrown(3.0, dt=1e-6)
    delta = np.maximum(-run.q[:, 0], 0.0)
    _, force, time = exact(3.0)
    plot.plot(1e6 * run.t, LAW.stiffness * delta**1.5, "k-", label="fembeam")
    plot.plot([0.0, 1e6 * time], [0.0, 0.0], "o", color="0.6", ms=8, zorder=0, label="formula")
    plot.plot([5e5 * time], [force], "o", color="0.6", ms=8, zorder=0)
    plot.set(xlabel="t / µs", ylabel="force at 3 m/s / N", xlim=(-3.0, 1.4e6 * time))
    plot.legend()
