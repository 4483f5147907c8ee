"""A hysteresis cycle of Bouc and Wen

    F = α k δ + (1 - α) k z,    z' = A δ' - β |δ'| z - γ δ' |z|        (n = 1)

While δ rises, dz/dδ = A - s z for z > 0, with s = β + γ, and A + d z for z < 0, with d = γ - β. So the branch from
-z_m to z_m is a pair of exponentials that meet at z = 0:

    z < 0:  z = -A/d + (A/d - z_m) e^(d (δ + X)),     z > 0:  z = A/s (1 - e^(-s (δ - δ₀)))

Both give z_m by 2X = ln[(A/d)/(A/d - z_m)]/d - ln(1 - s z_m/A)/s. The loss per cycle is the area 2 (1 - α) k ∫ z dδ
over that branch. Here k = 1, α = 0.1, A = 1, β = 0.6, γ = 0.3, amplitudes X = 0.5, 1.5 and 4; the path is run through
until the cycle has closed.
"""

import math

import numpy as np
import sketch
from scipy.optimize import brentq
from sheets import Row

from contacts import BoucWen
from contacts.path import work

SOURCE = (
    "Y.-K. Wen, *J. Eng. Mech. Div. ASCE* 102 (1976) 249; R. Bouc, *Proc. 4th Conf. Nonlinear Oscillations*, Prague "
    "1967, p. 315; the closed cycle as in F. Ikhouane, J. Rodellar, *Systems with Hysteresis*, Wiley 2007"
)
ALPHA, A, BETA, GAMMA = 0.1, 1.0, 0.6, 0.3
LAW = BoucWen(1.0, ALPHA, A, BETA, GAMMA)
S, D = BETA + GAMMA, GAMMA - BETA
AMPLITUDES = (0.5, 1.5, 4.0)
SETTLING = 30  # cycles until it has closed


def parts(z):
    """Widths in δ of the branch below and above z = 0, of a cycle whose top is z."""
    return math.log((A / D) / (A / D - z)) / D, -math.log(1.0 - S * z / A) / S


def top(X):
    """z_m of the cycle."""
    return brentq(lambda z: sum(parts(z)) - 2.0 * X, 0.0, A / S * (1.0 - 1e-12), xtol=1e-15)


def loss(X):
    """Area of the cycle."""
    below, above = parts(top(X))
    negative = -A / D * below + (A / D - top(X)) * math.expm1(D * below) / D
    positive = A / S * (above + math.expm1(-S * above) / S)
    return 2.0 * (1.0 - ALPHA) * (negative + positive)


def rows():
    found = []
    for X in AMPLITUDES:
        path = np.tile([X, -X], SETTLING)
        force = LAW.along(np.append(path, X))[-1]
        area = work(LAW, [0.0, *path, X, -X, X]) - work(LAW, [0.0, *path, X])
        z = (force - ALPHA * X) / (1.0 - ALPHA)
        found += [Row(f"top of z, X = {X:g}", top(X), z, 1e-8), Row(f"loss per cycle, X = {X:g}", loss(X), area, 1e-8)]
    return found


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 1.4, 90.0)
    sketch.spring(rig, (0.0, 0.4), (1.4, 0.4))
    sketch.spring(rig, (0.0, -0.4), (0.8, -0.4))
    sketch.slider(rig, (0.8, -0.4), (1.4, -0.4), 0.12)
    sketch.line(rig, [1.4, 1.4], [-0.5, 0.5])
    rig.text(0.7, 0.62, "α k", ha="center")
    rig.text(0.7, -0.75, "(1 - α) k, z", ha="center")
    sketch.arrow(rig, (1.4, 0.0), (1.9, 0.0), "δ", shift=(0.1, 0.0))
    sketch.view(rig, -0.3, 2.2, -0.95, 0.95)
    for X in AMPLITUDES:
        cycle = np.concatenate((np.linspace(X, -X, 100), np.linspace(-X, X, 100)))
        plot.plot(cycle, LAW.along(np.append(np.tile([X, -X], SETTLING), cycle))[-200:])
        plot.plot([X, -X], np.array([1.0, -1.0]) * (ALPHA * X + (1.0 - ALPHA) * top(X)), "k.")
    plot.set(xlabel="δ", ylabel="force; dots: formula")
