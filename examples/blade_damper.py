"""The best friction limit of a blade's damper: the peak of resonance over the limit is a curve, and has a least.

A turbine blade is pushed by a tone at its tip; a damper under its platform is a spring k in series with a slider of
limit f. A loose damper slips and loses little, a tight one sticks and loses nothing. For every limit the peak is where

    ∂a/∂ω = 0,   a = ½ (max u - min u),   and its height changes by   da/df = ∂a/∂f

with exact derivatives of the periodic orbit; the best limit is where the latter is zero. The backbone tells frequency
and damping of the best one at other levels of the tone. The independent check is brute force: runs from rest over a
grid of limits and frequencies, each to its steady state.

    python examples/blade_damper.py       prints the curve of peaks and the best limit, writes blade_damper.png
"""

import numpy as np

import fembeam as fb
from contacts import Jenkins

tip, platform = 0.20, 0.07  # m
blade = fb.Section.rectangle(E=1.15e11, rho=4430.0, width=0.06, height=0.006)
scene = fb.Scene(
    fb.Beam(tip, blade),
    [fb.Clamped(0.0)],
    elements=[fb.Element(platform, Jenkins(stiffness=4e5, limit=20.0), name="damper")],
    forces=[fb.PointForce(tip, fb.Harmonic(amplitude=4.0, omega=800.0))],
    damping=fb.ModalDamping(0.002),
)
limit, span = "elements[damper].law.limit", (700.0, 1000.0)


def brute_force(limits, omega) -> np.ndarray:
    """Largest amplitude over the frequencies, for each limit: the last 20 ms of runs from rest."""
    periods = {"duration": 0.4, "dt": 1e-4, "discard": 0.38}
    asked = fb.study.quantities.Amplitude(z=tip)
    grid = fb.study.vary(scene, {limit: limits, "omega": omega}, asked, **periods, modes=2)
    return grid[grid.quantities[0]].max(axis=1)


if __name__ == "__main__":
    model = scene.reduce(modes=2)
    found = fb.study.peak(model, "omega", limit, [8.0, 16.0, 32.0, 64.0], span, z=tip)
    print(found)
    found.figure().savefig("blade_damper.png")
    best = found.least
    assert best is not None, "a limit between is best"
    backbone = fb.study.backbone(best.orbit.model, [1.0, 2.0, 4.0, 8.0], span, z=tip)
    print(backbone)
    limits = best.value * np.array([0.8, 1.0, 1.25])
    heights = brute_force(limits, best.at + np.linspace(-30.0, 30.0, 21))
    print(
        "brute force / mm:", *(f"{1e3 * height:.4f} at {f:.2f} N," for f, height in zip(limits, heights, strict=True))
    )
    assert np.argmin(heights) == 1, "no limit beside has a lower peak"
    assert abs(heights[1] / best.amplitude - 1.0) < 2e-3, f"{heights[1]:.6g} m by brute force"
    assert abs(best.value - 31.56) < 0.1
