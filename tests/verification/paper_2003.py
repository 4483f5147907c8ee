"""A beam-impact system under noise, the paper of 2003

A cantilever of 259.9 mm with a mass of 25.4 g (half-sphere and accelerometer) near its end hits a half-sphere; the
base moves. E = 190 GPa, ρ = 8000 kg/m³, A = 58.3 mm², I = 18.5 mm⁴, K = 2.1e8 N/m^1.5, e = 0.5, the mass at 244.45
mm, with a rotary inertia of 3e-6 kg m² (ours: the paper gives none). The table compares eigenfrequencies with the
paper's model of four degrees of freedom and with exact transfer matrices of the beam; its measured ones are 101.5 and
781.6 rad/s.

The figures are compared by scripts of the course, every statement with 99.99 % confidence where it is random. Damping
ratios and noise levels are our choices, as the text gives neither.

| figure | statement | holds |
| --- | --- | --- |
| 2 | two modes below 1000 rad/s | yes |
| 3 | force over indentation of measured collisions | the law; the measurement is not compared |
| 4 | harmonic, 1/2 and 1/3 resonances, each higher than the one before; dents in the first two | yes |
| 5 | no dents with one mode | yes |
| 6, 7 | peaks near 195, 390 and 780 rad/s, much power below 50 rad/s | yes |
| 8 | mid-beam: the second mode, multiples of 195 rad/s | yes |
| 9, 10 | δ is far from Gaussian, mid-beam near to it | in part: in skewness, not in kurtosis |
| 11 to 13 | narrow bands: stochastic 1/2 and 1/3 subharmonics of rising power | yes |
| 14, 15 | the experiment | not compared |
| 16, 17 | a band that rolls off gives the same peaks | yes, of the model; measured curves are not compared |
| 18 to 22 | a second mode changes low frequencies too; the 1/2 subharmonic needs less input | yes, likewise |
| text | a third mode changes little | in part: it takes 17.5 % of the variance |

Figures 4 and 5 are those of [paper_periodic.py](../../examples/paper_periodic.py), 6 to 22 those of
[paper_random.py](../../examples/paper_random.py), the law that of [contact_laws.py](../../examples/contact_laws.py).

The numbers stand in [The paper's beam](../explanation/paper_beam.md).
"""

import numpy as np
import sketch
from scipy.linalg import expm
from scipy.optimize import brentq
from sheets import Row

import fembeam as fb

SOURCE = (
    "N. van de Wouw, A. de Kraker, D.H. van Campen et al., *Non-linear dynamics of a stochastically excited beam "
    'system with impact*, Int. J. Non-Linear Mech. 38 (2003) 767, table 1; "approximately 2300 rad/s" in section 8'
)
LENGTH, TIP, MASS, INERTIA = 0.2599, 0.24445, 25.4e-3, 3.0e-6
STEEL = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
PRINTED = ("109.1", "790.7", "2300")


def determinant(omega):
    """Of the free end, by (u, u', M, V)' = A (u, u', M, V) from the clamp past the mass."""
    A = np.diag([1.0, 1.0 / STEEL.bending_stiffness, 1.0], 1)
    A[3, 0] = STEEL.line_mass * omega**2
    jump = np.eye(4)
    jump[3, 0], jump[2, 1] = MASS * omega**2, -INERTIA * omega**2
    T = expm(A * (LENGTH - TIP)) @ jump @ expm(A * TIP)
    return float(np.linalg.det(T[2:, 2:]))


def model():
    """Three modes."""
    tip = fb.LumpedMass(TIP, mass=MASS, inertia=INERTIA)
    return fb.Scene(fb.Beam(LENGTH, STEEL), [fb.Clamped(0.0)], [tip]).reduce(3)


def rows():
    found = []
    for n, (ours, printed) in enumerate(zip(model().omega, PRINTED, strict=True), start=1):
        exact = brentq(determinant, 0.99 * float(printed), 1.01 * float(printed), rtol=1e-13)
        found.append(Row(f"ω{n} / rad s⁻¹", exact, float(ours), 1e-6, printed))
    return found


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.6)
    sketch.beam(rig, 0.0, 2.2)
    sketch.ball(rig, 2.0, -0.16, 0.13)
    sketch.ball(rig, 2.0, -0.42, 0.13)
    sketch.wall(rig, 2.0, -0.55, 0.5, 0.0, -1.0)
    sketch.arrow(rig, (-0.35, -0.3), (-0.35, 0.3), "y(t)", shift=(0.0, 0.12))
    sketch.arrow(rig, (0.0, 0.3), (2.0, 0.3), "244.45 mm", both=True, shift=(0.0, 0.13))
    sketch.view(rig, -0.7, 2.6, -0.8, 0.7)
    z = np.linspace(0.0, LENGTH, 100)
    shapes = model().phi(z)
    for n in (0, 1):
        plot.plot(1e3 * z, shapes[:, n] / np.abs(shapes[:, n]).max(), label=f"{model().omega[n]:.1f} rad/s")
    plot.axvline(1e3 * TIP, color="0.7", lw=1.0)
    plot.set(xlabel="z / mm", ylabel="modes")
    plot.legend()
