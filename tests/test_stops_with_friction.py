"""Friction of stops in scenes: identities, the matrix level, balance, readout, files, parts of runs, bad input."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refused_by

import fembeam as fb
import solvers
from contacts import Hertz, KelvinVoigt, WaltonBraun
from fembeam.model import run_csv
from fembeam.response import backbone, states
from fembeam.results import files, html_page
from fembeam.scene_file import SceneFileError, json_schema
from fembeam.study.measure import cut

METHOD = solvers.DormandPrince(1e-11)
TUBE = fb.Section.tube(2.0e11, 7850.0, 0.0191, 0.0168)
LAW, RUB = KelvinVoigt(2e5, 20.0), fb.Friction(0.3, stiffness=1.5e5)
HELD = np.diag([1e-9, 1e-9, 1e-9])  # N/m: free, but no mode of frequency 0 turns with another


def disc(spring=0.0, **options):
    """A disc of radius 0.4 m in a hole of 1 m, that of the tests of `solvers.Friction`."""
    rub = {"radius": 0.4, "friction": fb.Friction(0.25, 5e3), **options}
    body = fb.Structure(HELD + spring * np.diag([1.0, 1.0, 0.02]), np.diag([1.0, 1.0, 0.08]),
                        labels=[("D", "x"), ("D", "y"), ("D", "rz")], nodes={"D": (0, 0, 0)})  # fmt: skip
    hole = fb.AnnularStop("D", KelvinVoigt(1e4, 0.0), 1.0, directions=("x", "y"), **rub)
    return fb.Scene(body, stops=[hole]).reduce(modes=3)


def thrown(model, duration=4.0, dt=0.01):
    """Its motion from the start of these tests."""
    speeds = {("D", "x"): 0.2, ("D", "y"): 0.8, ("D", "rz"): -1.5}
    return model.simulate(duration, dt, model.state({("D", "x"): 0.5}, speeds), solver=METHOD)


def frame(**options):
    """A plane frame of two members whose corner meets a wall obliquely."""
    steel = fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01)
    body = fb.Frame.polyline({"A": (0, 0), "B": (0.4, 0), "C": (0.4, 0.3)}, steel)
    wall = fb.Stop("C", LAW, 1e-4, direction="-y", friction=RUB, **options)
    drives = {"C": fb.Harmonic(60.0, 210.0), "B": fb.Harmonic(40.0, 150.0, 1.0)}
    push = [fb.PointForce(at, drive, direction="y") for at, drive in drives.items()]
    return fb.Scene(body, [fb.Clamped("A")], stops=[wall], forces=push, damping=fb.ModalDamping(0.02))


def hole(z=0.4, **options):
    """A tube pushed about in a hole near its middle; with ``spin`` a shaft."""
    spin, bending = options.pop("spin", 0.0), options.pop("bending_only", True)
    stop = fb.AnnularStop(z, LAW, 2e-4, **{"friction": RUB, **options})
    loads = [fb.PointForce(0.6, fb.Harmonic(60.0, 210.0), direction="x"),
             fb.PointForce(0.6, fb.Harmonic(30.0, 130.0, 1.0), direction="y")]  # fmt: skip
    body = fb.Frame.straight(1.0, TUBE, spin, bending_only=bending)
    return fb.Scene(body, [fb.Clamped("A"), fb.Pinned("B")], stops=[stop], forces=loads, damping=fb.ModalDamping(0.02))


@pytest.fixture(scope="module")
def corner():
    return frame().reduce(modes=3).simulate(0.05, 1e-4, solver=METHOD)


@pytest.fixture(scope="module")
def tube():
    return hole().reduce(modes=4).simulate(0.06, 1e-4, solver=METHOD)


@pytest.fixture(scope="module")
def rolled():
    return thrown(disc())


def test_a_disc_is_that_of_the_matrix_level(rolled):
    expected = [-0.31970493889, -0.41690718554, -4.7094931086]
    np.testing.assert_allclose(rolled.motion("D")[-1], expected, rtol=0.0, atol=1e-7)  # of springs of 1e-9 N/m
    assert rolled.transitions.event.tolist() == ["slip", "slip"]
    times, codes, _ = states(rolled, 0)
    assert codes.tolist() == [0.0, 1.0, 2.0, 0.0, -1.0, 2.0]  # stick, slip +, open, stick, slip -, open
    assert np.all(np.diff(times) > 0.0)


def test_torque_and_force_of_friction_are_what_accelerates(rolled):
    np.testing.assert_allclose(0.08 * rolled.acceleration("D", "rz"), -0.4 * rolled.friction(), rtol=0.0, atol=1e-8)
    d, force = rolled.place_in_clearance(), rolled.force()
    across = (force[:, 0] * d[:, 1] - force[:, 1] * d[:, 0]) / np.linalg.norm(d, axis=1)
    expected = rolled.friction() / np.linalg.norm(d, axis=1)
    np.testing.assert_allclose(across, expected, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(rolled.acceleration("D", "x"), force[:, 0], rtol=0.0, atol=1e-7)


def limits_are_kept(run):
    """|F_t| <= μN, and no force while the stop is open; F_t changes as k_t ξ̇ where it sticks."""
    f, n = run.friction(), run._normal_force(0)
    limit = run.rubs[0, 0] * np.maximum(n, 0.0)
    assert np.all(np.abs(f) <= limit * (1.0 + 1e-9) + 1e-12)
    assert np.abs(f).max() > 0.3 * limit.max()
    times, codes, _ = states(run, 0)
    code = np.append(codes, 2.0)[np.searchsorted(times, run.t, side="right") - 1]
    np.testing.assert_allclose(np.abs(f)[np.abs(code) == 1.0], limit[np.abs(code) == 1.0], rtol=1e-9, atol=1e-12)
    both = (code[1:] == 0.0) & (code[:-1] == 0.0)
    if run.t[1] > 1e-3:  # too coarse for differences
        return both.any()
    mean = 0.5 * (run.sliding_speed()[1:] + run.sliding_speed()[:-1]) * np.diff(run.t)
    drawn = run.rubs[0, 1] * mean[both]
    np.testing.assert_allclose(np.diff(f)[both], drawn, rtol=0.0, atol=0.1 * np.abs(f).max())
    return both.any()


def test_forces_of_friction_keep_its_law(corner, tube, rolled):
    assert any([limits_are_kept(corner), limits_are_kept(tube), limits_are_kept(rolled)])
    for run in (corner, tube):
        assert len(run.contacts) > 1
        assert len(run.friction_log) == len(run.contacts)
        assert np.abs(run.energy.residual).max() < 1e-8 * run.energy.input.max()
        assert run.friction_loss[-1, 0] == pytest.approx(run.losses.friction[0], rel=1e-6)
        taken = run.energy.friction - run.friction() ** 2 / (2.0 * RUB.stiffness)  # less what the spring holds
        assert run.friction_loss[-1, 0] == pytest.approx(taken[-1], rel=1e-6)
        np.testing.assert_allclose(run.friction_loss[:, 0], taken, rtol=0.0, atol=0.03 * taken[-1])
        assert np.all(np.diff(run.friction_loss[:, 0]) >= 0.0)


def test_an_oblique_stop_of_a_frame_is_that_of_the_matrix_level(corner):
    """Modes, rows and loads by hand."""
    model = corner.model
    n, t = model.phi(("C", "y")), -model.phi(("C", "x"))  # of -y the other way in the plane is -x
    np.testing.assert_array_equal(corner.directions, [n, t])
    contact = solvers.Contact(n, LAW, 1e-4, map="oblique", tangent=t, friction=RUB)
    loads = [(model.phi((at, "y")), load.signal) for at, load in zip("CB", model.scene.forces, strict=True)]
    system = solvers.System.modal(model.omega, 0.02, [contact], loads)
    run = solvers.integrate(system, np.zeros(3), np.zeros(3), 0.05, 1e-4, METHOD)
    np.testing.assert_allclose(corner.q, run.q, rtol=0.0, atol=1e-9 * np.abs(run.q).max())
    assert corner.force().shape == (501, 2)
    np.testing.assert_allclose(corner.force()[:, 1], -corner.friction(), rtol=0.0, atol=0.0)
    acting = corner._forces.T @ corner.directions
    np.testing.assert_allclose(acting @ t, corner._forces[0] * (n @ t) - corner.friction() * (t @ t), atol=1e-9)
    assert frame(tangent="x").stops[0].coordinates[1].along[0] == 1.0


def test_a_tangent_the_other_way_turns_signs_alone(corner):
    one, other = (frame(tangent=way).reduce(modes=3).simulate(0.05, 1e-4, solver=METHOD) for way in ("x", "-x"))
    np.testing.assert_allclose(other.q, one.q, rtol=0.0, atol=1e-9 * np.abs(one.q).max())
    size = 1e-6 * np.abs(one.friction()).max()
    np.testing.assert_allclose(other.friction(), -one.friction(), rtol=0.0, atol=size)
    np.testing.assert_allclose(np.abs(corner.friction()), np.abs(one.friction()), rtol=0.0, atol=size)


def test_turning_the_loads_and_the_directions_turns_the_motion(tube):
    c, s = np.cos(0.7), np.sin(0.7)
    ways = (c, s, 0.0), (-s, c, 0.0)
    scene = hole(directions=ways)
    turned = [replace(force, direction=way) for force, way in zip(scene.forces, ways, strict=True)]
    other = replace(scene, forces=turned).reduce(modes=4).simulate(0.06, 1e-4, solver=METHOD)
    np.testing.assert_allclose(other.contacts.t_in, tube.contacts.t_in, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(other.friction(), tube.friction(), rtol=0.0, atol=1e-4 * np.abs(tube.friction()).max())


def test_with_hardly_a_coefficient_hardly_anything_rubs():
    scene = hole()
    rubs = fb.Friction(1e-9, 1e5), None
    still, plain = (replace(scene, stops=[replace(scene.stops[0], friction=rub)]) for rub in rubs)
    one, other = (each.reduce(modes=4).simulate(0.03, 1e-4, solver=METHOD) for each in (still, plain))
    np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-7 * np.abs(other.q).max())
    assert 0.0 < np.abs(one.friction()).max() <= 1.001e-9 * one.contacts.peak_force.max()
    with pytest.raises(ValueError, match="the stop must have friction"):
        other.friction()


def test_a_shaft_spins_at_its_radius():
    """Bending alone, and torsion kept: stiff in torsion, both slide by R Ω."""
    for options, modes in (({"bending_only": True}, 4), ({"bending_only": False}, 6)):
        run = hole(spin=150.0, radius=0.00955, **options).reduce(modes=modes).simulate(0.02, 1e-4, solver=METHOD)
        own = run.rubs[0]
        assert own.tolist() == [0.3, 1.5e5, 0.00955, 150.0]
        d = run.place_in_clearance()
        v = np.stack([run.velocity(0.4, way) for way in "xy"], axis=1)
        swept = 2e-4 * (d[:, 0] * v[:, 1] - d[:, 1] * v[:, 0])[1:] / np.sum(d**2, axis=1)[1:]
        turning = run.velocity(0.4, "rz")[1:] if "rz" in run.shapes.components else 0.0
        expected = swept + 0.00955 * (150.0 + turning)
        np.testing.assert_allclose(run.sliding_speed()[1:], expected, rtol=1e-9)
        assert run.losses.spin[0] > 0.5 * run.losses.friction[0] > 0.0
        assert run.losses.spin[0] == pytest.approx(run.energy.spin[-1], rel=1e-9)
    backward = fb.AnnularStop(0.4, LAW, 2e-4, directions=("y", "x"), friction=RUB, radius=0.01)
    scene = replace(hole(spin=150.0, radius=0.01), stops=[backward])
    assert scene.reduce(modes=4).contact_rows[0].spin == -150.0


def test_an_inclined_shaft_twists_as_one_along_an_axis():
    """Its twist goes about a vector, which has no name: such scenes were refused."""
    straight = hole(radius=0.00955, bending_only=False)
    rotation, ways = (0.0, 0.9, 0.0), ((np.cos(0.9), 0.0, -np.sin(0.9)), (0.0, 1.0, 0.0))
    pushes = [replace(one, direction=way) for one, way in zip(straight.forces, ways, strict=True)]
    stop = replace(straight.stops[0], directions=ways)
    inclined = replace(straight, beam=straight.beam.turned(rotation), stops=[stop], forces=pushes)
    models = (scene.reduce(modes=4, residual=True) for scene in (straight, inclined))
    one, other = (model.simulate(0.06, 1e-4, solver=METHOD) for model in models)
    assert np.abs(one.friction()).max() > 1.0
    np.testing.assert_allclose(other.friction(), one.friction(), rtol=0.0, atol=1e-5 * np.abs(one.friction()).max())


def test_a_run_goes_on_from_a_slider_that_sticks():
    """Also on a shaft that spins slowly, whose loads are constant: time begins anew."""
    scene = hole(spin=0.5, radius=0.00955)
    dead = [replace(one, signal=fb.Harmonic(90.0, 0.0)) for one in scene.forces]
    model = replace(scene, forces=dead).reduce(modes=4)
    whole = model.simulate(0.02, 1e-3, solver=METHOD)
    times, codes, _ = states(whole, 0)
    middle = 0.5 * (times[1:] + times[:-1])[codes[:-1] == 0.0][-1]
    part = model.simulate(float(middle), solver=METHOD)
    rest = model.simulate(0.02 - float(middle), start=part.end, solver=METHOD)
    assert part.end[-2] == 0.0
    np.testing.assert_allclose(rest.q, whole.q[-1:], rtol=0.0, atol=1e-8 * np.abs(whole.q).max())


def test_parts_of_a_run_keep_forces_and_losses(tube):
    part = cut(tube, 0.02, 0.05)
    kept = slice(200, 501)
    np.testing.assert_array_equal(part.friction(), tube.friction()[kept])
    np.testing.assert_array_equal(part.force(), tube.force()[kept])
    np.testing.assert_allclose(part.friction_loss, tube.friction_loss[kept] - tube.friction_loss[200], atol=1e-18)
    inside = (tube.friction_log.t_in >= 0.02) & (tube.friction_log.t_in < 0.05)
    assert len(part.friction_log) == inside.sum()
    assert np.isnan(part.losses.friction).all()
    assert "nan" in str(part)  # in its table of friction
    assert set(part.losses.arrays()) == set(tube.losses.arrays())


def test_saved_runs_keep_friction(corner, tube, rolled, tmp_path):
    for i, run in enumerate((corner, tube, rolled)):
        again = fb.load(run.save(tmp_path / f"run{i}"))
        for name in ("force", "friction", "sliding_speed"):
            np.testing.assert_array_equal(getattr(again, name)(0), getattr(run, name)(0))
        np.testing.assert_array_equal(again.friction_loss, run.friction_loss)
        for column, values in run.friction_log.arrays().items():
            np.testing.assert_array_equal(again.friction_log.arrays()[column], values)
        assert again.losses.friction == run.losses.friction
        assert again.energy.friction[-1] == run.energy.friction[-1]
        np.testing.assert_array_equal(states(again, 0)[1], states(run, 0)[1])
    with np.load(tmp_path / "run0.npz") as file:
        contents = dict(file)
    np.savez(tmp_path / "wrong.npz", **{**contents, "rubs": np.zeros((1, 4))})
    with pytest.raises(ValueError, match="directions must have 1 rows, there are 2"):
        fb.load(tmp_path / "wrong.npz")


def test_tables(corner, tube, tmp_path):
    names = [path.name for path in tube.to_csv(tmp_path, quantities=["force", "friction", "friction loss"])]
    assert names == ["histories.csv", "contacts.csv", "friction.csv"]
    head = (tmp_path / "histories.csv").read_text().splitlines()[0]
    assert head == "t [s],force stop 0 x [N],force stop 0 y [N],friction stop 0 [N],friction loss stop 0 [J]"
    first = (tmp_path / "friction.csv").read_text().splitlines()[0]
    assert first.startswith("stop,name,t_in [s],t_out [s],angle_in [rad]")
    corner.to_csv(tmp_path)
    head = (tmp_path / "histories.csv").read_text().splitlines()[0]
    assert head.endswith("force stop 0 [N],force stop 0 along [N]")
    assert "loss by friction / J" in str(tube)


def test_the_energy_of_a_summary_and_its_page_balances_with_friction(tube, tmp_path):
    """The work of a spin and what friction took, 33 times the work done on the stop here, were in neither."""
    run = hole(spin=150.0, radius=0.00955).reduce(modes=4).simulate(0.02, 1e-4, solver=METHOD)
    found = files.summary(run)
    energy, losses = found["energy"], found["losses"]
    taken = energy["damping"] + energy["contact"] + energy["friction"]
    assert energy["input"] + energy["spin"] - taken - energy["stored"] == pytest.approx(0.0, abs=1e-9 * energy["spin"])
    assert energy["friction"] > energy["contact"]
    assert losses["loss"][0] == pytest.approx(losses["work"][0] - losses["stored"][0] + losses["friction"][0], rel=1e-9)
    assert losses["spin"][0] == pytest.approx(energy["spin"], rel=1e-9)
    assert list(run.losses.arrays()) == ["work", "stored", "loss", "slip", "friction", "spin"]
    files.write_json(tmp_path / "summary.json", found)
    page = html_page.write_page(tmp_path).read_text(encoding="utf-8")
    assert "put in by spin" in page
    assert "lost in friction" in page
    plain = replace(hole(), stops=[replace(hole().stops[0], friction=None)]).reduce(modes=4)
    assert "spin" not in files.summary(plain.simulate(0.002, 1e-4))["energy"]


def test_equilibrium_and_strikes_know_no_friction():
    """Pressed at rest the slider is undrawn."""
    model = hole(radius=0.00955).reduce(modes=4)
    start = model.equilibrium({(0.6, "x"): 300.0, (0.6, "y"): 200.0})
    plain = replace(model.scene, stops=[replace(model.scene.stops[0], friction=None, radius=None)]).reduce(modes=4)
    np.testing.assert_allclose(start, plain.equilibrium({(0.6, "x"): 300.0, (0.6, "y"): 200.0}), rtol=1e-12)
    assert len(model.strike(0.05)) == len(plain.strike(0.05)) == 1
    assert np.isnan(backbone(frame().reduce(modes=2), ("C", "y"), np.array([1e-3]))).all()


TOML = """
[frame]
nodes = { A = [0, 0, 0], B = [0, 0, 1] }
bending_only = true
spin = 100.0
[[frame.members]]
nodes = ["A", "B"]
section = { shape = "tube", E = 2.0e11, rho = 7850.0, outer = 0.0191, inner = 0.0168 }
[[supports]]
kind = "clamped"
at = "A"
[[stops]]
kind = "annular"
at = 0.4
clearance = 2e-4
radius = 0.00955
friction = { mu = 0.3, stiffness = 5e5 }
law = { kind = "hertz", stiffness = 1e8 }
[[stops]]
at = "B"
direction = "x"
tangent = "y"
gap = 1e-3
friction = { mu = 0.2, stiffness = 1e5 }
law = { kind = "hertz", stiffness = 1e8 }
"""


def test_scene_files(file_of):
    first, second = file_of(TOML).scene.stops
    assert (first.friction, first.radius) == (fb.Friction(0.3, 5e5), 0.00955)
    assert second == fb.Stop("B", Hertz(1e8), 1e-3, direction="x", friction=fb.Friction(0.2, 1e5), tangent="y")
    for old, new, message in (
        ("mu = 0.3,", "mu = -0.3,", "mu of Friction must be finite and >= 0"),
        (", stiffness = 5e5", "", "needs stiffness > 0"),
        ("mu = 0.3", "nu = 0.3", "unknown key 'nu'; did you mean 'mu'"),
        ("{ mu = 0.3, stiffness = 5e5 }", "0.3", r"friction: must be a table { mu = …, stiffness = …, … }, got 0.3"),
        ("radius = 0.00955", "", "friction on a shaft that spins needs radius="),
        ('tangent = "y"', 'tangent = "x"', "tangent must be a displacement at right angles"),
    ):
        with pytest.raises(SceneFileError, match=message):
            file_of(TOML.replace(old, new))
    options = json_schema()["properties"]["stops"]["items"]["anyOf"]
    assert all("friction" in one["properties"] for one in options)
    assert "mu" in str(json_schema()["$defs"]["kind such as coulomb"])


test_bad_annular_stops_are_refused = refused_by(
    lambda options: fb.AnnularStop(**{"z": 0.4, "law": LAW, "clearance": 2e-4, "friction": RUB, **options}),
    ({"friction": 0.3}, "friction must be a Friction"),
    ({"friction": None, "radius": 0.01}, "radius is for an annular stop with friction"),
    ({"radius": 0.0}, "radius must be finite and positive"),
    ({"clearance": 0.0}, "clearance must be finite and positive"),
    error=(ValueError, TypeError),
)


test_bad_oblique_stops_are_refused = refused_by(
    lambda options: fb.Stop("C", **{"law": LAW, "direction": "-y", "friction": RUB, "tangent": "x", **options}),
    ({"friction": 0.3}, "friction must be a Friction"),
    ({"friction": None}, "tangent is for a stop with friction"),
    ({"tangent": "y"}, "tangent must be a displacement at right angles .* got 'y'"),
    ({"tangent": (0.0, -2.0)}, "tangent must be a displacement at right angles"),
    ({"tangent": "rz"}, "tangent must be a displacement at right angles"),
    ({"tangent": "up"}, "direction must be one of .* in tangent of Stop"),
    ({"direction": "rz", "tangent": "x"}, "friction is for stops of displacement"),
    ({"law": WaltonBraun(1e3, 2e3, "kept")}, "law of a stop with friction must have no memory"),
    error=(ValueError, TypeError),
)


def test_bad_scenes_are_refused():
    beam, space, flat = fb.Beam(1.0, TUBE), fb.Frame.straight(1.0, TUBE), frame().beam
    bent = fb.Stop("B", LAW, direction="x", friction=RUB)
    for body, stop, message in (
        (beam, fb.Stop(0.5, LAW, friction=RUB), "a Beam bends in one plane, got .*; make the Beam a Frame.straight"),
        (beam, fb.Stop(0.5, LAW, direction="y", friction=RUB, tangent="z"), "a Beam bends in one plane"),
        (space, bent, "friction of a stop in space needs tangent="),
        (flat, replace(bent, z="C", direction="z"), "must move along z; it has x, y, rz"),
        (fb.Frame.straight(1.0, TUBE, bending_only=True), replace(bent, tangent="z"), "must move along z; it has x, y"),
        (replace(space, spin=50.0), fb.AnnularStop("B", LAW, 1e-3, friction=RUB), "a shaft that spins needs radius="),
    ):
        with pytest.raises(ValueError, match=message):
            fb.Scene(body, [fb.Clamped("A" if body is flat else 0.0)], stops=[stop])
    held = fb.Scene(space, [fb.Clamped("A"), fb.Fixed("B", "y")], stops=[replace(bent, tangent="y")])
    with pytest.raises(ValueError, match="must be free to move along y, got 'B' in stops"):
        held.reduce(modes=4)
    with pytest.raises(ValueError, match="must move the place of 'stop at C, -y' along its direction and its tangent"):
        frame().reduce(modes=1).simulate(0.01)


def test_the_main_method_gives_the_same(corner, tube, rolled):
    for run in (corner, tube, rolled):
        other = run.model.simulate(float(run.t[-1]), run.t, run.made.start, solver=solvers.Exponential(1e-11))
        np.testing.assert_allclose(other.q, run.q, rtol=0.0, atol=1e-6 * np.abs(run.q).max())
        size = 1e-4 * np.abs(run.friction()).max()
        np.testing.assert_allclose(other.friction(), run.friction(), rtol=0.0, atol=size)
        assert other.losses.friction == pytest.approx(run.losses.friction, rel=1e-6)
        assert len(other.friction_log) == len(run.friction_log)


def test_names_and_prints_of_scenes_without_friction_stay():
    assert "friction" not in repr(fb.Stop(0.2, LAW))
    assert "friction=Friction(mu=0.3" in repr(hole().stops[0])


def test_figures_tell_stick_from_slip(tube):
    labels = ["clearance 0.2 mm", "free", "slips", "sticks"]
    path = fb.plot.orbit_in_clearance(tube).axes[0].lines
    assert [line.get_label() for line in path] == labels
    r = [np.hypot(*line.get_data()) for line in path]
    assert np.nanmax(r[2]) > 0.2 > np.nanmin(r[1])
    assert np.nanmax(r[3]) > 0.2
    assert any("μ = 0.3" in text.get_text().replace("\n", " ") for text in tube.model.scene.figure().axes[0].texts)
    axis = fb.plot.forces_in_clearance(tube, window=(0.01, 0.06)).axes[0]
    normal, friction = axis.lines
    assert normal.get_ydata().max() == pytest.approx(np.linalg.norm(tube.force()[100:], axis=1).max(), rel=0.1)
    assert np.all(friction.get_ydata() <= 0.3 * normal.get_ydata() * (1.0 + 1e-9))
    with pytest.raises(ValueError, match="axes must be polar"):
        fb.plot.forces_in_clearance(tube, axes=fb.plot.orbit_in_clearance(tube).axes[0])
    with pytest.raises(ValueError, match="the window must hold at least 2 samples"):
        fb.plot.forces_in_clearance(tube, window=(3.0, 4.0))


def test_a_data_set_has_friction(tube, monkeypatch):
    """F_t and the loss by friction over time and stop; a stand-in keeps what xarray would be given."""
    given = SimpleNamespace(Dataset=lambda variables, axes, about: (variables, axes, about))
    monkeypatch.setattr(run_csv, "optional", lambda package, wanted: given)
    variables, _, _ = tube.to_xarray()
    for name, expected, unit in (("friction", tube.friction(0), "N"), ("friction_loss", tube.friction_loss[:, 0], "J")):
        axes, values, about = variables[name]
        assert axes == ("t", "stop")
        np.testing.assert_array_equal(values[:, 0], expected)
        assert about == {"units": unit}
    plain, _, _ = hole(friction=None).reduce(modes=4).simulate(0.01, 1e-3).to_xarray()
    assert "friction" not in plain


def test_a_law_that_pulls_is_told():
    """Where N < 0 friction has no force: `check` says so, of laws that do pull alone."""
    said = "the law pulls as a contact opens, N < 0; friction has no force there"
    for law, pulls in (
        (KelvinVoigt(2e5, 20.0), True),
        (KelvinVoigt(2e5, 20.0, clamp=True), False),
        (Hertz(1e8), False),
    ):
        scene = fb.Scene(fb.Frame.straight(1.0, TUBE, bending_only=True), [fb.Clamped("A")],
                         stops=[fb.AnnularStop("B", law, 2e-4, friction=RUB)])  # fmt: skip
        assert any(said in one for one in scene.check()) == pulls
