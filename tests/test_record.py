"""Records: joined by straight lines, padded, in a scene and in a scene file."""

import json
import math
import os
import warnings
from dataclasses import replace

import numpy as np
import pytest
from problems import ROD_FILE
from refusals import refused, refused_by
from scipy.interpolate import BPoly

import fembeam as fb
import solvers
from contacts import KelvinVoigt
from fembeam.cli import main
from fembeam.excitation.polyline import Polyline
from fembeam.scene_file import SceneFileError, read

STEEL = fb.Section.circle(2.1e11, 7800.0, 0.01)
QUAKE = np.random.default_rng(4).normal(size=400) * np.hanning(400)  # m/s², every 10 ms
H = 0.01
TIMES = H * np.arange(400)


def stepped(samples, h, omega, zeta, steps, count):
    """q of q'' + 2ζω q' + ω² q = -a(t) under a polyline a, stepwise exact by the matrix exponential, at h/steps."""
    from scipy.linalg import expm

    dt = h / steps
    A = np.zeros((4, 4))  # q, q', a, its slope
    A[0, 1], A[1], A[2, 3] = 1.0, [-(omega**2), -2 * zeta * omega, -1.0, 0.0], 1.0
    forward, x, found = expm(A * dt), np.zeros(2), [0.0]
    for i in range(count):
        cell, inside = divmod(i, steps)
        slope = (samples[cell + 1] - samples[cell]) / h
        x = (forward @ [*x, samples[cell] + inside * dt * slope, slope])[:2]
        found.append(x[0])
    return np.array(found)


@pytest.mark.parametrize("omega", [3.0, 40.0, 300.0, 1200.0])  # the samples' Nyquist frequency is 314 rad/s
def test_a_polyline_loads_an_oscillator_as_the_exact_recursion_does(omega):
    def motion(interpolation):
        record = fb.Record(TIMES, QUAKE, quantity="acceleration", interpolation=interpolation)
        system = solvers.System.modal([omega], [0.05], loads=[([-1.0], record.derivative(2))])
        return solvers.integrate(system, [0.0], [0.0], 3.9, dt=H / 4, method=solvers.Exponential(1e-9)).q[:, 0]

    exact = stepped(QUAKE, H, omega, 0.05, 4, 4 * 390)
    error = np.abs(motion("linear") - exact) / np.abs(exact).max()
    assert error.max() < 1e-10
    assert np.abs(motion("spectral") - exact).max() > 5e-4 * np.abs(exact).max()  # another convention


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-11])
def test_steps_in_contact_end_on_the_kinks_of_a_polyline(rtol):
    """A stop with a dashpot that stays pressed is one spring more: q'' + 2ζω q' + ω² q = 5 k - a."""
    omega, stiffness, damping = 30.0, 2e3, 4.0
    record = fb.Record(TIMES, QUAKE, quantity="acceleration", interpolation="linear")
    stop = solvers.Contact([1.0], KelvinVoigt(stiffness, damping), -5.0)
    system = solvers.System.modal([omega], [0.0], [stop], [([-1.0], record.derivative(2))])
    together = math.sqrt(omega**2 + stiffness)
    pressed, method = 5.0 * stiffness / together**2, solvers.Exponential(rtol)
    run = solvers.integrate(system, [pressed], [0.0], 3.9, dt=H / 2, method=method)
    exact = stepped(QUAKE, H, together, damping / (2.0 * together), 2, 2 * 390)
    assert np.abs(run.q[:, 0] - pressed - exact).max() < 2.0 * rtol * np.abs(exact).max()


@pytest.mark.parametrize("integrals", [0, 1, 2])
def test_the_cells_of_a_polyline_are_its_pieces(integrals):
    line = Polyline(H, QUAKE[100:120], integrals)
    dt, rows = line.nodes(18.5 * H, 1e-9)
    assert len(rows) == 20
    assert dt == H
    x = np.linspace(0.0, 1.0, 5)
    for i, (begin, end) in enumerate(zip(rows[:-1, :3], rows[1:, -3:], strict=True)):
        piece = BPoly.from_derivatives([0.0, dt], [begin, end])
        assert piece(dt * x) == pytest.approx(line.at(dt * (i + x)), rel=1e-12, abs=1e-13 * np.abs(rows[:, 0]).max())


def test_the_value_of_a_linear_acceleration_is_its_double_integral():
    record = fb.Record(TIMES, QUAKE, quantity="acceleration", interpolation="linear")
    assert abs(record(0.0)) < 1e-15
    assert abs(record(record.duration)) < 1e-12
    t = np.linspace(0.5, 3.0, 200)
    assert record.derivative(2)(t) == pytest.approx(np.interp(t, TIMES, QUAKE), abs=1e-12)
    h = 1e-4
    rate = (record(t + h) - record(t - h)) / (2 * h)
    assert record.derivative(1)(t) == pytest.approx(rate, abs=2e-6)
    line = fb.Record(TIMES, 2.0 - 3.0 * TIMES, quantity="force", interpolation="linear")
    assert line(0.1234) == pytest.approx(2.0 - 3.0 * 0.1234)


@pytest.mark.parametrize("band", [None, (0.0, 250.0)])
def test_the_value_of_an_acceleration_is_its_double_integral(band):
    """Its straight line from the first to the last sample is integrated, too: here to 3 m of 2 cm of motion."""
    acceleration = np.cos(9.0 * TIMES) + 0.5 * np.sin(40.0 * TIMES)
    record = fb.Record(TIMES, acceleration, band, "acceleration")
    t, h = np.linspace(1.0, 3.0, 50), 1e-4
    exact = np.cos(9.0 * t) + 0.5 * np.sin(40.0 * t)
    assert record.derivative(2)(t) == pytest.approx(exact, abs=3e-3)
    ends = record([0.0, record.duration])
    assert np.abs(ends).max() < 1e-14
    motion = -np.cos(9.0 * t) / 81.0 - 0.5 * np.sin(40.0 * t) / 1600.0
    assert np.abs(np.polyval(np.polyfit(t, record(t) - motion, 1), t) - (record(t) - motion)).max() < 1e-4
    assert record.derivative(1)(t) == pytest.approx((record(t + h) - record(t - h)) / (2 * h), abs=1e-6)
    assert record.derivative(2)(t) == pytest.approx((record(t + h) - 2 * record(t) + record(t - h)) / h**2, abs=1e-5)
    dt, rows = record.nodes(record.duration, 1e-9)
    at = dt * np.arange(len(rows))
    for order, column in enumerate(rows.T):
        inside = at <= record.duration
        assert column[inside] == pytest.approx(record.derivative(order)(at[inside]), abs=1e-6)


@pytest.mark.parametrize("interpolation", ["linear", "spectral"])
def test_padding_lets_a_run_outlast_its_record(interpolation):
    record = fb.Record(TIMES, QUAKE, quantity="acceleration", interpolation=interpolation, padding=2.003)
    assert record.duration == pytest.approx(3.99 + 2.01)  # whole steps
    assert np.abs(record.derivative(2)(4.0 + H * np.arange(200))).max() < 1e-12 * np.abs(QUAKE).max()
    scene = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02), base=record)
    run = scene.reduce(modes=1).simulate(5.5, 1e-3)
    assert run.complete
    with pytest.raises(ValueError, match=r"Record is 3\.99 s long .* or give padding"):
        replace(record, padding=0.0).for_duration(5.5)
    with pytest.warns(UserWarning, match="padding with zeros lets it jump"):
        fb.Record(TIMES, QUAKE + 1.0, quantity="acceleration", padding=1.0)


def test_the_quantity_has_one_name_and_the_older_one_still_works():
    new, old = (fb.Record(TIMES, QUAKE, **{name: "acceleration"}) for name in ("quantity", "kind"))
    assert new.quantity == old.quantity == old.kind == "acceleration"
    assert new.derivative(2)(0.5) == old.derivative(2)(0.5)
    assert replace(old, quantity="displacement").quantity == "displacement"
    assert replace(new, kind="displacement").quantity == "displacement"
    assert "quantity='acceleration', interpolation='linear'" in repr(replace(new, interpolation="linear"))


test_bad_choices = refused_by(
    lambda options: fb.Record(TIMES, QUAKE, **{"quantity": "acceleration", **options}),
    ({"interpolation": "linear", "band": (1.0, 50.0)}, "takes uniform samples as they are, got a band"),
    ({"interpolation": "cubic"}, "interpolation must be 'spectral' or 'linear', got 'cubic'"),
    ({"quantity": "velocity"}, "quantity must be 'displacement' or 'acceleration' or 'force', got 'velocity'"),
    ({"padding": -1.0}, "padding .s. must be finite of at least 0"),
)


def test_what_has_no_second_derivative_is_no_base_motion():
    jittered = TIMES + np.where(np.arange(400) == 7, 0.2 * H, 0.0)
    with pytest.raises(ValueError, match="got times off a uniform grid"):
        fb.Record(jittered, QUAKE, quantity="acceleration", interpolation="linear")
    for options, message in (
        ({"interpolation": "linear"}, "y'' of a displacement joined by straight lines does not exist"),
        ({"quantity": "force"}, "base must hold samples of a motion, not of a force, got Record"),
    ):
        record = fb.Record(TIMES, QUAKE, **options)
        with pytest.raises(ValueError, match=message):
            fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], base=record)
        fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], forces=[fb.PointForce(0.5, record)])


def scene_with(**parts):
    return fb.Scene(fb.Beam(0.5, STEEL), **{"supports": [fb.Clamped(0.0)], **parts})


PUSHED = fb.Record(TIMES, QUAKE, quantity="force")
SHAKEN = fb.Record(TIMES, QUAKE, quantity="acceleration")

test_samples_of_a_load_and_of_a_motion_stand_at_their_own_places = refused(
    (
        lambda: fb.PointForce(0.5, SHAKEN),
        "samples of a load in N, not of an acceleration.*in PointForce at z = 0.5; give",
    ),
    (
        lambda: fb.PointMoment(0.5, SHAKEN),
        "samples of a load in N m, not of an acceleration.*in PointMoment at z = 0.5",
    ),
    (lambda: fb.PointForce(0.5, SHAKEN.derivative(1)), "not of an acceleration, whose double integral would act"),
    (
        lambda: fb.Spring(0.5, 1.0, foot=PUSHED),
        "foot must hold samples of a motion, not of a force.*in Spring at z = 0.5",
    ),
    (lambda: fb.Clamped(0.0, motion={"y": PUSHED}), "motion along y must hold samples of a motion, not of a force"),
    (lambda: scene_with(bodies=[scene_with(forces=[fb.PointForce(0.5, SHAKEN)])]), "not of an acceleration"),
)


def test_an_acceleration_asked_for_its_own_samples_is_a_load():
    force = fb.PointForce(0.5, SHAKEN.derivative(2)).signal
    np.testing.assert_allclose(force(TIMES), PUSHED(TIMES), atol=1e-9 * np.abs(QUAKE).max())


def test_a_displacement_that_begins_with_an_acceleration_is_told():
    def error(phase, samples):
        """Of the tip, relative to its largest value, with so many samples in a period."""
        t = 2 * np.pi / 100.0 / samples * np.arange(40 * samples)
        motion = fb.Harmonic(1e-3, 100.0, phase)
        runs = [
            fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02), base=base)
            .reduce(modes=2).simulate(1.0, 1e-3).displacement(0.5)
            for base in (motion, fb.Record(t, motion(t)))
        ]  # fmt: skip
        return np.abs(runs[1] - runs[0]).max() / np.abs(runs[0]).max()

    with pytest.warns(UserWarning, match=r"Record begins with y'' near -10 m/s² .* begin where it is at rest"):
        assert error(0.0, 50) > 0.02
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert error(-np.pi / 2, 50) < 1e-3
        quiet = fb.Record(TIMES, QUAKE * np.minimum(TIMES, 1.0) ** 4, band=(0.0, 60.0))
        fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], base=quiet)
        fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], base=fb.Record(TIMES, QUAKE, quantity="acceleration"))


SCENE = (
    ROD_FILE
    + """
[damping]
zeta = 0.02
[simulate]
duration = 3.0
dt = 1e-3
[base]
kind = "record"
path = "quake.csv"
quantity = "acceleration"
"""
)


def scene_file(folder, more=""):
    (folder / "quake.csv").write_text("\n".join(f"{t:.2f},{a!r}" for t, a in zip(TIMES, QUAKE.tolist(), strict=True)))
    (folder / "scene.toml").write_text(SCENE + more)
    return folder / "scene.toml"


@pytest.mark.parametrize("more", ["", "band = [1, 100]", 'interpolation = "linear"\npadding = 1', "detrend = true"])
def test_check_reads_every_record(tmp_path, capsys, more):
    assert main(["check", str(scene_file(tmp_path, more)), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    named = [name for name in found["suggested_modes"] if "the motion" in name]
    assert len(named) == more.startswith("band")


def test_linear_and_padded_in_a_file(tmp_path):
    base = read(scene_file(tmp_path, 'interpolation = "linear"\npadding = 1\nscale = 2.0')).scene.base
    assert (base.interpolation, base.padding, base.quantity) == ("linear", 1.0, "acceleration")
    assert base.derivative(2)(1.0) == pytest.approx(2 * QUAKE[100])
    with pytest.raises(SceneFileError, match=r"interpolation must be 'spectral' or 'linear', got 'cubic'"):
        read(scene_file(tmp_path, 'interpolation = "cubic"'))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_pipes_folders_and_devices_are_refused(tmp_path):
    path = scene_file(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "folder", "/dev/zero", "/dev/null"):
        with pytest.raises(SceneFileError, match=rf'with --set base.path="{name}": {name} is no ordinary'):
            read(path, [f'base.path="{name}"'])
