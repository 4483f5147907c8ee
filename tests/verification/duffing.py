"""Free vibration of Duffing's oscillator: its backbone

    q'' + q + β q³ = 0,    ω = π √(1 + β X²)/2K(m),    m = β X²/(2 (1 + β X²))

with the complete elliptic integral K of parameter m; for large amplitudes ω tends to 0.8472 √β X. Here β = 1. fembeam
runs ten periods of the formula and is asked by how much the phase is off then.
"""

import math

import numpy as np
import sketch
from scipy.special import ellipk
from sheets import Row

import solvers
from contacts import Polynomial

SOURCE = (
    "A.H. Nayfeh, D.T. Mook, *Nonlinear Oscillations*, Wiley 1979, chapter 2; I. Kovacic, M.J. Brennan (eds), *The "
    "Duffing Equation*, Wiley 2011, chapter 2"
)
AMPLITUDES = (0.1, 1.0, 3.0, 10.0)


def exact(X):
    """ω."""
    return math.pi * math.sqrt(1.0 + X * X) / (2.0 * ellipk(X * X / (2.0 * (1.0 + X * X))))


def found(X):
    """ω, from the phase after ten periods of the formula."""
    cubic = solvers.Contact([1.0], Polynomial([0.0, 0.0, 1.0]), always=True)
    system = solvers.System([[1.0]], [[0.0]], [[1.0]], [cubic])
    duration = 20.0 * math.pi / exact(X)
    end = solvers.integrate(system, [X], [0.0], duration, method=solvers.Exponential(1e-11))
    late = float(end.q_dot[-1, 0]) / (X + X**3)  # q' = -(X + X³) times what has passed since the top
    return exact(X) * duration / (duration + late)


def rows():
    return [Row(f"ω, X = {X:g}", exact(X), found(X), 1e-9) for X in AMPLITUDES]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.8)
    sketch.spring(rig, (0.0, 0.0), (1.2, 0.0))
    sketch.arrow(rig, (0.4, -0.25), (0.85, 0.25))
    sketch.block(rig, 1.5, 0.0, "1", 0.6, 0.5)
    rig.text(0.6, 0.35, "q + β q³", ha="center")
    sketch.arrow(rig, (1.8, 0.0), (2.3, 0.0), "q", shift=(0.1, 0.0))
    sketch.view(rig, -0.3, 2.6, -0.6, 0.7)
    X = np.linspace(0.01, 3.2, 100)
    plot.plot([exact(x) for x in X], X, color="0.6", lw=3.0, label="formula")
    plot.plot([found(x) for x in (0.1, 0.5, 1.0, 2.0, 3.0)], (0.1, 0.5, 1.0, 2.0, 3.0), "k.", label="fembeam")
    plot.set(xlabel="ω", ylabel="amplitude")
    plot.legend()
