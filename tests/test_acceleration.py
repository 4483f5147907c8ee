"""Accelerations of runs: against closed forms, differences of exact velocities, and the equation of motion."""

import numpy as np
from problems import PAPER_BEAM

import fembeam as fb
from contacts import Hertz, KelvinVoigt

BASE = fb.Harmonic(amplitude=1e-3, omega=195.0, phase=0.3)


def scene(**parts):
    parts = {"base": BASE, "damping": fb.ModalDamping(0.02), **parts}
    return fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], **parts)


def test_absolute_motion_is_that_of_the_frame_on_top():
    run = scene().reduce(modes=2).simulate(0.1, 1e-3)
    for name, order in (("displacement", 0), ("velocity", 1), ("acceleration", 2)):
        history = getattr(run, name)
        frame = BASE.derivative(order)(run.t)
        np.testing.assert_allclose(history(0.2, absolute=True) - history(0.2), frame, atol=1e-12 * np.abs(frame).max())
        both = history([0.1, 0.2], absolute=True)
        np.testing.assert_allclose(both[:, 1], history(0.2, absolute=True), rtol=1e-12)


def test_absolute_acceleration_of_a_shaken_oscillator():
    """ü + ÿ = Re[-ω² (1 + H) Y exp(iωt)],  H = ω² Γ φ/(ω_1² - ω² + 2iζω_1ω), once the start is forgotten."""
    model = scene(damping=fb.ModalDamping(0.1)).reduce(modes=1)
    run, z, w, omega = model.simulate(3.0, 1e-3), 0.2, BASE.omega, model.omega[0]
    H = w**2 * model.participation[0] * model.phi(z)[0] / (omega**2 - w**2 + 0.2j * omega * w)
    exact = (-(w**2) * (1 + H) * 1e-3 * np.exp(1j * (w * run.t + 0.3))).real
    late = run.t > 2.5  # exp(-0.1 · 109 · 2.5) = 1e-12
    np.testing.assert_allclose(run.acceleration(z, absolute=True)[late], exact[late], atol=1e-7 * np.abs(exact).max())


def test_it_is_the_slope_of_the_velocity_through_contacts_dashpots_and_forces():
    """Central differences err by h²/6 of the third derivative; samples beside entries and exits are left out."""
    rig = scene(
        stops=[fb.Stop(0.24, KelvinVoigt(1e5, 20.0))],
        dashpots=[fb.Dashpot(0.1, 0.5)],
        forces=[fb.PointForce(0.15, fb.Harmonic(2.0, 80.0))],
        gravity=9.81,
    )
    run = rig.reduce(modes=3, residual=True).simulate(0.06, 2e-7)
    step, z = run.t[1], 0.2
    velocity, acceleration = run.velocity(z), run.acceleration(z)
    slope = (velocity[2:] - velocity[:-2]) / (2 * step)
    edges = np.concatenate([run.contacts.t_in, run.contacts.t_out[np.isfinite(run.contacts.t_out)]])
    assert len(edges) > 4
    away = np.abs(run.t[1:-1, None] - edges).min(axis=1) > 3 * step
    error = np.abs(slope - acceleration[1:-1])[away]
    assert error.max() < 1e-4 * np.abs(acceleration).max()


def test_bodies_and_runs_from_files(tmp_path):
    other = fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.01))
    stop = fb.Stop(0.25, Hertz(1e7), gap=1e-4, on=(1, 0.2))
    run = scene(bodies=[other], stops=[stop]).reduce(2).simulate(0.05, 1e-6)
    velocity, acceleration = run.velocity(0.2, body=1), run.acceleration(0.2, body=1)
    assert len(run.contacts)
    slope = (velocity[2:] - velocity[:-2]) / 2e-6
    np.testing.assert_allclose(acceleration[1:-1], slope, atol=1e-3 * np.abs(slope).max())
    again = fb.load(run.save(tmp_path / "run"))
    np.testing.assert_array_equal(again.acceleration(0.2, body=1), acceleration)
    np.testing.assert_array_equal(again.velocity(0.2, absolute=True), run.velocity(0.2, absolute=True))


def test_a_spinning_shaft_is_turned_aside_by_its_gyroscopic_moments():
    """Accelerations are slopes of velocities, and the clamp holds what is left of the loads."""
    shaft = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 1e-3, 0.012), spin=300.0, bending_only=True)
    signals = {"x": fb.Harmonic(2.0, 90.0), "y": fb.Harmonic(2.0, 90.0, 1.0)}
    scene = fb.Scene(
        shaft,
        supports=[fb.Clamped("A")],
        masses=[fb.Disk("B", 3.0, 0.02, 0.04)],
        forces=[fb.PointForce("B", signal, direction=way) for way, signal in signals.items()],
    )
    run = scene.reduce(modes=4).simulate(0.3, 1e-4)
    for way in ("x", "y", "rx", "ry"):
        velocity, acceleration = run.velocity("B", way), run.acceleration("B", way)
        slope = (-velocity[4:] + 8 * velocity[3:-1] - 8 * velocity[1:-3] + velocity[:-4]) / 1.2e-3
        np.testing.assert_allclose(acceleration[2:-2], slope, rtol=0.0, atol=1e-5 * np.abs(slope).max())
    for number, (way, signal) in enumerate(signals.items()):
        held = 3.0 * run.acceleration("B", way) - signal(run.t)  # the shaft has no mass
        reaction = run.reactions()[0].force[:, number]
        np.testing.assert_allclose(reaction, held, rtol=0.0, atol=1e-6 * np.abs(held).max())
