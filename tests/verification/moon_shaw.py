"""A beam against a stop on one side: period doubling and chaos

Moon and Shaw shook a cantilever whose tip was held beyond a fixed displacement, so that its stiffness had two slopes,
and saw subharmonics, then chaos with power near the subharmonic frequencies; a model of one mode did the same. In
part only: their parameters are not used here, and their figures are compared in kind. One mode, in units of its mass
and frequency,

    q'' + 2ζ q' + q = cos Ωt + k max(-q - g, 0)

Each piece is solved in closed form, and the derivative of a run is the product of the pieces' matrix exponentials.
From these the sheet finds where the harmonic motion doubles its period (multiplier -1; k = 4, g = 0, ζ = 0.05), where
it decays to a stable subharmonic (exponent -ζ), and the exponent of a chaotic one (k = 18.2, as between a free and a
pinned tip: g = -0.3, ζ = 0.03). fembeam follows a branch of orbits, and the growth of the tangent of a run. Of a
chaotic motion two runs share the mean only: four standard errors of the shorter one, 50 %, are allowed.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import sketch
from oscillators import Bilinear
from sheets import Row

import solvers

SOURCE = (
    "F.C. Moon, S.W. Shaw, *Chaotic vibrations of a beam with non-linear boundary conditions*, Int. J. Non-Linear "
    "Mech. 18 (1983) 465; S.W. Shaw, P.J. Holmes, *J. Sound Vib.* 90 (1983) 129"
)
DOUBLING = Bilinear(1.1, zeta=0.05)
CHAOTIC, REGULAR = (Bilinear(omega, stiffness=18.2, zeta=0.03, gap=-0.3) for omega in (1.05, 1.1))


@cache
def flips():
    """Orbits with a multiplier -1, of the harmonic branch."""

    def make(omega):
        problem = replace(DOUBLING, omega=omega)
        return problem.system(), problem.period

    branch = solvers.branch(make, (0.8, 1.1), DOUBLING.settled(60), at=1.0, step=0.25).run()
    return sorted((orbit for orbit in branch.special if orbit.mark == "flip"), key=lambda orbit: orbit.parameter)


def exponent(problem, periods, lead=20):
    """Mean growth of the derivative, by closed pieces, once its direction has settled."""
    x, v, growth = problem.settled(60), np.array([1.0, 0.0]), []
    for _ in range(lead + periods):
        x, derivative, _ = problem.march(x, problem.period, grid=60)
        v = derivative @ v
        growth.append(math.log(np.linalg.norm(v)))
        v /= np.linalg.norm(v)
    return float(np.mean(growth[lead:])) / problem.period


def growth(problem, periods):
    """Ours."""
    whole, lead = (periods + 100) * problem.period, 100 * problem.period
    return solvers.lyapunov(problem.system(), [0.0], [0.0], whole, lead, solvers.Exponential(1e-8)).value


def rows():
    found = []
    for number, orbit in enumerate(flips(), start=1):
        exact, _ = replace(DOUBLING, omega=orbit.parameter).special(-1.0, orbit.state)
        found.append(Row(f"Ω of doubling {number}", float(exact), orbit.parameter, 1e-8))
    return [
        *found,
        Row("exponent at Ω = 1.1, subharmonic", -REGULAR.zeta, growth(REGULAR, 400), 1e-2),
        Row("exponent at Ω = 1.05, chaotic", exponent(CHAOTIC, 200), growth(CHAOTIC, 3000), 0.5),
    ]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.6)
    sketch.beam(rig, 0.0, 2.0)
    sketch.stop(rig, 2.0, -0.15, 0.5)
    sketch.arrow(rig, (2.25, -0.15), (2.25, 0.0), "g", shift=(0.1, -0.1))
    sketch.arrow(rig, (-0.4, -0.3), (-0.4, 0.3), both=True)
    rig.text(-0.4, 0.4, "cos Ωt", ha="center")
    sketch.view(rig, -0.8, 2.6, -0.85, 0.7)
    system, period = CHAOTIC.system(), CHAOTIC.period
    run = solvers.integrate(system, [0.0], [0.0], 1500 * period, period, solvers.Exponential(1e-8))
    plot.plot(run.q[100:, 0], run.q_dot[100:, 0], "k,")
    plot.set(xlabel="q once a period, Ω = 1.05", ylabel="q'")
