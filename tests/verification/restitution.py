"""Restitution of dissipative contact laws

A free mass m enters a stop at speed v and leaves it at r v. Published damping factors ask for a nominal restitution
e; what the equation of motion then gives is another number, in closed form:

    Hunt–Crossley, Lankarani–Nikravesh: F = K δ^1.5 (1 + a δ'/v),     a (1 + r) = ln[(1 + a)/(1 - a r)]
    Jankowski: F = K δ^1.5 + c δ^¼ δ' on approach only,               r = exp(-ζ arccos ζ/√(1 - ζ²)), ζ = 2ξ/√5
    Anagnostopoulos: F = k δ + c δ', which may pull,                  r = exp(-πζ/√(1 - ζ²)), ζ = c/2√(k m)
    Walton–Braun: k₁ δ in, slope k₂ out,                              r = √(k₁/k₂)

with a = 3(1 - e)/2 and 3(1 - e²)/4, ξ = (9√5/2)(1 - e²)/(e (e (9π - 16) + 16)), ζ = -ln e/√(π² + ln² e). The fourth
follows from substituting x = δ^(5/4), in which the mass is a linear oscillator. "Published" is the nominal e = 0.5;
"fembeam" integrates the motion of 0.3 kg at 0.4 m/s.
"""

import math

import numpy as np
import sketch
from scipy.optimize import brentq
from sheets import Row

import solvers
from contacts import Hysteretic, KelvinVoigt, Viscoelastic, WaltonBraun

SOURCE = (
    "K.H. Hunt, F.R.E. Crossley, *J. Appl. Mech.* 42 (1975) 440; H.M. Lankarani, P.E. Nikravesh, *J. Mech. Des.* 112 "
    "(1990) 369; R. Jankowski, *Earthq. Eng. Struct. Dyn.* 34 (2005) 595 and 35 (2006) 517; S.A. Anagnostopoulos, "
    "*Earthq. Eng. Struct. Dyn.* 16 (1988) 443; O.R. Walton, R.L. Braun, *J. Rheol.* 30 (1986) 949"
)
E, MASS, SPEED, K = 0.5, 0.3, 0.4, 1e7
LAWS = {
    "Hunt–Crossley": Hysteretic.hunt_crossley(K, E),
    "Lankarani–Nikravesh": Hysteretic.lankarani_nikravesh(K, E),
    "Jankowski": Viscoelastic.jankowski(K, E, MASS),
    "Anagnostopoulos": KelvinVoigt.anagnostopoulos(1e5, E, MASS),
    "Walton–Braun": WaltonBraun(1e5, 4e5),
}


def hysteretic(a):
    """The root r of a (1 + r) = ln[(1 + a)/(1 - a r)]."""
    return brentq(lambda r: a * (1.0 + r) - math.log1p(a) + math.log1p(-a * r), 1e-3, min(1.0, 0.999 / a), xtol=1e-15)


def jankowski():
    """Of the published damping ratio."""
    xi = 4.5 * math.sqrt(5.0) * (1.0 - E**2) / (E * (E * (9.0 * math.pi - 16.0) + 16.0))
    zeta = 2.0 * xi / math.sqrt(5.0)
    return math.exp(-zeta * math.acos(zeta) / math.sqrt(1.0 - zeta**2))


EXACT = {
    "Hunt–Crossley": lambda: hysteretic(1.5 * (1.0 - E)),
    "Lankarani–Nikravesh": lambda: hysteretic(0.75 * (1.0 - E**2)),
    "Jankowski": jankowski,
    "Anagnostopoulos": lambda: E,
    "Walton–Braun": lambda: math.sqrt(1e5 / 4e5),
}


def bounced(law):
    """State after the mass has left."""
    system = solvers.System([[MASS]], [[0.0]], [[0.0]], [solvers.Contact([1.0], law)])
    return solvers.integrate(system, [0.0], [-SPEED], 0.05, method=solvers.Exponential(1e-10))


def rows():
    achieved = {name: float(bounced(law).q_dot[-1, 0]) / SPEED for name, law in LAWS.items()}
    return [Row(f"r, {name}", EXACT[name](), r, 1e-7, str(E)) for name, r in achieved.items()]


def draw(rig, plot):
    sketch.block(rig, 0.0, 0.8, "m", 0.6, 0.35)
    sketch.arrow(rig, (0.5, 0.95), (0.5, 0.55), "v", shift=(0.13, 0.0))
    sketch.spring(rig, (-0.2, 0.0), (-0.2, 0.5))
    sketch.dashpot(rig, (0.2, 0.0), (0.2, 0.5))
    sketch.line(rig, [-0.35, 0.35], [0.5, 0.5])
    sketch.wall(rig, 0.0, 0.0, 1.2, 0.0, -1.0)
    sketch.view(rig, -0.9, 0.9, -0.25, 1.2)
    nominal = np.linspace(0.05, 0.99, 60)
    plot.plot(nominal, nominal, color="0.7", label="nominal")
    plot.plot(nominal, [hysteretic(1.5 * (1.0 - e)) for e in nominal], label="Hunt–Crossley")
    plot.plot(nominal, [hysteretic(0.75 * (1.0 - e**2)) for e in nominal], label="Lankarani–Nikravesh")
    for name in ("Hunt–Crossley", "Lankarani–Nikravesh"):
        plot.plot(E, bounced(LAWS[name]).q_dot[-1, 0] / SPEED, "k.", ms=9)
    plot.set(xlabel="nominal restitution", ylabel="achieved; dots: fembeam")
    plot.legend(fontsize="small")
