"""Synchronous full rub of a Jeffcott rotor

A disk (m = 2 kg) on a massless shaft (k = 8e4 N/m), with damping c = 60 N s/m and eccentricity e = 0.1 mm, turns with
Ω in a smooth elastic ring (k_c = 3e5 N/m) with a clearance g = 0.2 mm. In full rub it whirls on a circle of radius r
with the spin, and never leaves the ring:

$$
|k - m Ω^2 + k_c (1 - g/r) + i c Ω| r = m e Ω^2
$$

In axes that turn with Ω this is an equilibrium, about which small motions follow

$$
m \\ddot{x} + (c + 2 m Ω J) \\dot{x} + (k - m Ω^2 + c Ω J + K_w) x = 0
$$

with J a quarter turn and the wall as K_w: k_c along the radius, k_c (1 - g/r) across it. In fixed axes the rub is an
orbit of one turn T = 2π/Ω with the multipliers exp(λT), λ the eigenvalues. fembeam finds that orbit by shooting, and
the multipliers as those of its exact tangent; without friction the rub is stable at 180 and at 220 rad/s.
"""

import numpy as np
import sketch
from matplotlib.patches import Circle
from scipy.optimize import brentq
from sheets import Row

from contacts import KelvinVoigt
from fembeam import Harmonic
from solvers import Contact, System, orbit

SOURCE = (
    "A. Muszynska, *Rotordynamics*, CRC Press 2005 (rub of rotor and stator); models of rub are reviewed in K. "
    "Prabith, I.R.P. Krishna, *Nonlinear Dynamics* 2020, doi 10.1007/s11071-020-05832-y; no number is printed for this "
    "rotor"
)
MASS, DAMPING, SHAFT, WALL, CLEARANCE, ECCENTRICITY = 2.0, 60.0, 8e4, 3e5, 2e-4, 1e-4
PLANE, QUARTER = np.eye(2), np.array([[0.0, -1.0], [1.0, 0.0]])
SPEEDS = (180.0, 220.0)  # rad/s


def radius(omega):
    """R of the whirl in full contact."""

    def apart(r):
        stiffness = SHAFT - MASS * omega**2 + WALL * (1.0 - CLEARANCE / r)
        return abs(stiffness + 1j * DAMPING * omega) * r - MASS * ECCENTRICITY * omega**2

    return brentq(apart, CLEARANCE, 10.0 * CLEARANCE, xtol=1e-18)


def multipliers(omega):
    """Of the formula, with angles from 0 to π, ascending."""
    r = radius(omega)
    damping = DAMPING * PLANE + 2.0 * MASS * omega * QUARTER
    stiffness = (SHAFT - MASS * omega**2) * PLANE + DAMPING * omega * QUARTER
    stiffness += np.diag([WALL, WALL * (1.0 - CLEARANCE / r)])
    values = np.linalg.eigvals(np.block([[0.0 * PLANE, PLANE], [-stiffness / MASS, -damping / MASS]]))
    return upper(np.exp(2.0 * np.pi / omega * values))


def upper(values):
    """One of each pair, with angles from 0 to π, ascending."""
    return sorted((one for one in values if one.imag >= 0.0), key=np.angle)


def rubbing(omega):
    """The orbit by shooting."""
    push = MASS * ECCENTRICITY * omega**2
    loads = [(PLANE[0], Harmonic(push, omega)), (PLANE[1], Harmonic(push, omega, phase=-0.5 * np.pi))]
    ring = Contact(PLANE, KelvinVoigt(WALL, 0.0), CLEARANCE, map="annulus")
    return orbit(System(MASS * PLANE, DAMPING * PLANE, SHAFT * PLANE, [ring], loads), 2.0 * np.pi / omega)


def rows():
    made = []
    for omega in SPEEDS:
        found, at = rubbing(omega), f"Ω = {omega:g} rad/s"
        made.append(Row(f"radius r / m, {at}", radius(omega), float(np.linalg.norm(found.state[:2])), 1e-8))
        pairs = zip(multipliers(omega), upper(found.multipliers), strict=True)
        for i, (formula, ours) in enumerate(pairs, start=1):
            made.append(Row(f"size of pair {i} of multipliers, {at}", abs(formula), float(abs(ours)), 1e-6))
            made.append(Row(f"its angle / rad, {at}", np.angle(formula), float(np.angle(ours)), 1e-6))
    return made


def draw(rig, plot):
    rig.add_patch(Circle((0.0, 0.0), 1.05, fc="w", ec="0.15", lw=2.0))
    rig.add_patch(Circle((0.0, 0.0), 0.45, fc="w", ec="0.6", lw=0.8, ls="--"))
    sketch.ball(rig, 0.39, 0.22, 0.6)
    rig.plot([0.0, 0.39, 0.62], [0.0, 0.22, 0.05], "k-", lw=0.6, zorder=4)
    rig.plot([0.0], [0.0], "k+", ms=8, zorder=5)
    rig.plot([0.39], [0.22], "k.", ms=5, zorder=5)
    rig.plot([0.62], [0.05], "ko", ms=5, mfc="w", zorder=5)
    rig.text(0.13, 0.16, "r", zorder=5)
    rig.text(0.54, 0.18, "e", zorder=5)
    rig.text(-0.52, -0.62, "path of the centre", fontsize=7)
    sketch.arrow(rig, (-0.05, 1.25), (-0.6, 1.12), "Ω", shift=(0.15, 0.12))
    sketch.view(rig, -1.4, 1.4, -1.2, 1.5)
    speeds = np.linspace(175.0, 235.0, 60)
    plot.plot(speeds, [1e3 * radius(one) for one in speeds], color="0.6", lw=3.0, label="formula")
    marks = np.linspace(180.0, 230.0, 6)
    plot.plot(marks, [1e3 * np.linalg.norm(rubbing(one).state[:2]) for one in marks], "k.", label="fembeam")
    plot.axhline(1e3 * CLEARANCE, color="0.3", lw=0.8, ls=":")
    plot.text(210.0, 1e3 * CLEARANCE + 0.0007, "clearance", fontsize=8)
    plot.set(xlabel="Ω / rad s⁻¹", ylabel="radius / mm")
    plot.legend()
