"""A beam under white noise, without and with a stop

One mode ω of a cantilever, damping ratio ζ, under a random force at its tip of one-sided spectrum S (N² s/rad) has

    E[q²] = π φ² S/4ζω³,    E[q'²] = π φ² S/4ζω

and the second holds with any spring or elastic stop beside it (equipartition, from the Fokker–Planck equation).
fembeam's noise ends at 20 ω: what is missing above, φ² S/20ω of E[q'²], is left out in the formula. Without a stop
one period of the noise gives the variance of every seed; with a Hertzian stop it is estimated from a run, and 4
standard errors are allowed.
"""

import math
from functools import cache

import numpy as np
import sketch
from sheets import Row

import fembeam as fb
from contacts import Hertz

SOURCE = (
    "S.H. Crandall, W.D. Mark, *Random Vibration in Mechanical Systems*, Academic Press 1963; T.K. Caughey, "
    "*Derivation and application of the Fokker–Planck equation to discrete nonlinear dynamic systems subjected to "
    "white random excitation*, J. Acoust. Soc. Am. 35 (1963) 1683"
)
TIP, ZETA, STD, BAND, LINES = 0.26, 0.05, 0.5, 20.0, 2000
STEEL = fb.Section.rectangle(E=2.1e11, rho=7850.0, width=0.02, height=0.003)


@cache
def model(stop=False):
    """One mode of the beam under the noise."""
    plain = fb.Scene(fb.Beam(TIP, STEEL), [fb.Clamped(0.0)]).reduce(1)
    omega = float(plain.omega[0])
    period = None if stop else 2.0 * math.pi * LINES / (BAND * omega)
    noise = fb.BandNoise(STD, (0.0, BAND * omega), seed=1, period=period)
    stops = [fb.Stop(TIP, Hertz(1e6))] if stop else []
    force = fb.PointForce(TIP, noise)
    scene = fb.Scene(plain.scene.beam, plain.scene.supports, stops=stops, forces=[force], damping=fb.ModalDamping(ZETA))
    return scene.reduce(1)


def exact():
    """E[q²], E[q'²]."""
    (omega,), (phi,) = model().omega, model().phi(TIP)
    level = STD**2 / (BAND * omega)
    white = math.pi * phi**2 * level / (4.0 * ZETA * omega)
    return white / omega**2, white - phi**2 * level / (BAND * omega)


@cache
def response():
    """(q, q') over one period of the noise, after the start is forgotten."""
    omega, samples = float(model().omega[0]), 8192
    period = 2.0 * math.pi * LINES / (BAND * omega)
    start = model().simulate(period, period).end  # the noise repeats, so does the motion
    run = model().simulate(period, period / samples, start=start)
    return run.q[1:, 0], run.q_dot[1:, 0]


@cache
def hitting():
    """Statistics of the beam on its stop."""
    omega = float(model().omega[0])
    rate = {"q_dot": lambda run: run.q_dot[:, 0]}
    return fb.study.stationary(model(True), 6000.0 / omega, 0.3 / omega, rate)


def rows():
    displacement, rate = exact()
    q, q_dot = response()
    with_stop = hitting()["q_dot"].variance
    return [
        Row("E[q²], no stop", displacement, float(np.mean(q**2)), 1e-3),
        Row("E[q'²], no stop", rate, float(np.mean(q_dot**2)), 1e-3),
        Row("E[q'²], Hertzian stop", rate, float(with_stop.value), round(4.0 * with_stop.relative, 2)),
    ]


def draw(rig, plot):
    sketch.wall(rig, 0.0, 0.0, 0.6)
    sketch.beam(rig, 0.0, 2.0)
    sketch.stop(rig, 2.0, -0.035, 0.5)
    sketch.arrow(rig, (2.0, 0.6), (2.0, 0.06), "F(t)", shift=(0.0, 0.65))
    sketch.view(rig, -0.3, 2.6, -0.75, 0.9)
    q, _ = response()
    size = math.sqrt(exact()[0])
    x = np.linspace(-4.0, 4.0, 200)
    plot.plot(x, np.exp(-(x**2) / 2.0) / math.sqrt(2.0 * math.pi), color="0.6", lw=3.0, label="formula")
    plot.hist(q / size, 40, density=True, histtype="step", color="k", label="fembeam, one period")
    plot.set(xlabel="q over its standard deviation, no stop", ylabel="density")
    plot.legend(fontsize="small")
