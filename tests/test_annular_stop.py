"""Annular stops of scenes: identities, the matrix level, balance, files, tables, figures, bad input."""

import json
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused_by
from scipy.integrate import solve_ivp

import fembeam as fb
import solvers
from contacts import Hertz, KelvinVoigt, WaltonBraun
from fembeam.inspection.check import _limits
from fembeam.response import backbone
from fembeam.scene_file import SceneFileError

STEEL = fb.Section.tube(2.0e11, 7850.0, 0.0191, 0.0168)
LAW = KelvinVoigt(2e5, 20.0)
METHOD = solvers.Exponential(1e-10)


def tube():
    return fb.Frame.straight(1.0, STEEL, bending_only=True)


def pushed(size, omega, phase=0.0, direction="x", z=0.6):
    return fb.PointForce(z, fb.Harmonic(size, omega, phase), direction=direction)


def held(stops, forces, **options):
    ends = {"supports": [fb.Clamped("A"), fb.Pinned("B")], "damping": fb.ModalDamping(0.02), **options}
    return fb.Scene(tube(), stops=stops, forces=forces, **ends)


def whirling(law=LAW, **options):
    """A tube pushed about in a hole near its middle."""
    hole = fb.AnnularStop(0.4, law, 2e-4, **options)
    return held([hole], [pushed(60.0, 210.0), pushed(30.0, 130.0, 1.0, "y")])


def ran(scene, duration=0.1, modes=4, solver=METHOD):
    return scene.reduce(modes=modes).simulate(duration, 1e-4, solver=solver)


@pytest.fixture(scope="module")
def run():
    return ran(whirling())


def test_the_matrix_level_gives_the_same_motion():
    """EI = ρA = L = 1, clamped and free, by the exact roots of cos β cosh β = -1; a hole at the tip."""
    roots = np.array([1.8751040687119611, 4.694091132974175])
    sigma = (np.sinh(roots) - np.sin(roots)) / (np.cosh(roots) + np.cos(roots))
    mid = np.cosh(roots / 2) - np.cos(roots / 2) - sigma * (np.sinh(roots / 2) - np.sin(roots / 2))
    ends, omega = np.array([2.0, -2.0]), np.repeat(roots**2, 2)
    rows = np.array([np.kron(ends, one) for one in np.eye(2)])
    law, x, y = KelvinVoigt(300.0, 0.0), fb.Harmonic(1.5, 3.2), fb.Harmonic(1.05, 3.9, 0.5)
    loads = [(np.kron(mid, one), signal) for one, signal in zip(np.eye(2), (x, y), strict=True)]
    hole = solvers.Contact(rows, law, 0.012, map="annulus")
    exact = solvers.integrate(solvers.System.modal(omega, 0.01, [hole], loads), np.zeros(4), np.zeros(4), 0.6,
                              method=solvers.DormandPrince(1e-11))  # fmt: skip
    bar = fb.Frame.straight(1.0, fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0, I2=1.0), bending_only=True)
    forces = [fb.PointForce(0.5, x, direction="x"), fb.PointForce(0.5, y, direction="y")]
    scene = fb.Scene(bar, [fb.Clamped("A")], stops=[fb.AnnularStop("B", law, 0.012)], forces=forces,
                     damping=fb.ModalDamping(0.01))  # fmt: skip
    found = scene.reduce(modes=4).simulate(0.6, 0.01, solver=METHOD)
    assert len(exact.contacts.t_in) >= 2
    np.testing.assert_allclose(found.contacts.t_in, exact.contacts.t_in, rtol=1e-4)
    np.testing.assert_allclose(found.contacts.peak_force, exact.contacts.peak_force, rtol=1e-3)
    np.testing.assert_allclose(found.place_in_clearance(0)[-1], rows @ exact.q[-1], rtol=0.0, atol=1e-6)


def test_histories_of_an_annular_stop(run):
    d, force = run.place_in_clearance(), run.force()
    r = np.linalg.norm(d, axis=1)
    np.testing.assert_allclose(d, np.stack([run.displacement(0.4, n) for n in "xy"], axis=1), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(run.indentation(), r - 2e-4, rtol=0.0, atol=1e-18)
    rate = np.sum(d * np.stack([run.velocity(0.4, n) for n in "xy"], axis=1), axis=1) / np.where(r > 0, r, 1.0)
    np.testing.assert_allclose(run.indentation_rate(), rate, rtol=0.0, atol=1e-14)
    size = np.where(r > 2e-4, LAW.force(r - 2e-4, rate, 1.0), 0.0)
    np.testing.assert_allclose(force, -size[:, None] * d / np.where(r > 0, r, 1.0)[:, None], rtol=0.0, atol=1e-8)
    assert run.force(0, mean=True)[:-1].sum() * 1e-4 == pytest.approx(run.contacts.impulse.sum(), rel=0.02)
    assert run.names == ("annular stop at 0.4 m",)
    assert np.abs(run.energy.residual).max() < 1e-9 * run.energy.input[-1]


def test_accelerations_are_the_slopes_of_velocities():
    """Centred differences of a run with fine samples; a law that is smooth but at its ends, where few samples lie."""
    fine = whirling(KelvinVoigt(1e4, 0.0)).reduce(modes=4).simulate(0.02, 1e-5, solver=METHOD)
    difference = (fine.velocity(0.4, "y")[2:] - fine.velocity(0.4, "y")[:-2]) / 2e-5
    a = fine.acceleration(0.4, "y")[1:-1]
    assert fine.force().any()
    assert np.quantile(np.abs(a - difference), 0.98) < 1e-4 * np.abs(a).max()


def test_reactions_carry_what_the_hole_does_not():
    """At rest under dead loads, pressed into the hole: supports, hole and loads balance, as forces and as moments."""
    loads = {(0.6, "x"): 300.0, (0.6, "y"): 200.0}
    dead = [fb.PointForce(0.6, fb.Harmonic(size, 0.0), direction=n) for (_, n), size in loads.items()]
    model = held([fb.AnnularStop(0.4, Hertz(1e8), 2e-4, centre=(3e-5, -4e-5))], dead).reduce(modes=4, residual=True)
    still = model.simulate(0.01, 1e-3, model.equilibrium(loads), solver=METHOD)
    force = still.force()[-1]
    assert np.ptp(still.displacement(0.4, "x")) < 1e-9
    assert np.linalg.norm(force) > 100.0
    np.testing.assert_allclose(still.reactions().force[-1, :2] + force + [300.0, 200.0], 0.0, atol=1e-5)
    about_y = sum(one["ry"][-1] + one.part_at * one["x"][-1] for one in _placed(still.reactions()))
    assert about_y + 0.4 * force[0] + 0.6 * 300.0 == pytest.approx(0.0, abs=1e-5)
    assert model.static_share.shape == (4,)
    np.testing.assert_allclose(model.static_share, 1.0, rtol=1e-6)


@pytest.mark.parametrize(("pull", "lies_on_it"), [((30.0, 10.0), True), ((50.0, 0.1), False)])
def test_an_equilibrium_is_found_round_a_post(pull, lies_on_it):
    """What weight presses to a post slides round it until springs or the post hold it: it was refused."""
    body = fb.Structure(np.diag([8e3, 5e3]), 1.3 * np.eye(2), labels=[("D", "x"), ("D", "y")], nodes={"D": (0, 0, 0)})
    centre = np.array([3e-3, 3e-3] if lies_on_it else [4.1e-3, 0.0])
    post = fb.AnnularStop("D", KelvinVoigt(2e5, 0.0), 4e-3, centre=tuple(centre), outer=True, directions=("x", "y"))
    model = fb.Scene(body, stops=[post], gravity=(*pull, 0.0)).reduce(modes=2)

    def slopes(t, d):
        away = d - centre
        r = np.linalg.norm(away)
        return 1.3 * np.array(pull) - np.array([8e3, 5e3]) * d + 2e5 * max(4e-3 - r, 0.0) * away / r

    rest = solve_ivp(slopes, (0.0, 0.1), np.zeros(2), "LSODA", rtol=1e-10, atol=1e-14).y[:, -1]
    start = model.equilibrium()[:2]
    found = np.array([model.phi(("D", way)) @ start for way in "xy"])
    assert (np.linalg.norm(found - centre) < 4e-3) == lies_on_it
    np.testing.assert_allclose(found, rest, rtol=0.0, atol=1e-9)


def _placed(reactions):
    """Reactions with the z of their node."""
    for one in reactions:
        object.__setattr__(one, "part_at", {"A": 0.0, "B": 1.0}[one.part.z])
        yield one


def test_two_tubes_in_opposite_motion_share_a_clearance():
    """Each is met by the other as by a fixed hole half as wide, whose law is twice as stiff."""
    drive = [pushed(60.0, 210.0), pushed(30.0, 130.0, 1.0, "y")]
    against = [pushed(60.0, 210.0, np.pi), pushed(30.0, 130.0, 1.0 + np.pi, "y")]
    half = ran(held([fb.AnnularStop(0.4, KelvinVoigt(2e5, 20.0), 2e-4)], drive))
    other = held([], against)
    stop = fb.AnnularStop(0.4, KelvinVoigt(1e5, 10.0), 4e-4, on=(1, 0.4))
    both = ran(held([stop], drive, bodies=[other]))
    assert both.names == ("annular stop at 0.4 m, on 0.4 of beam 1",)
    assert len(half.contacts) == len(both.contacts) > 2
    np.testing.assert_allclose(both.force(), half.force(), rtol=0.0, atol=1e-6 * np.abs(half.force()).max())
    np.testing.assert_allclose(both.displacement(0.7, "y", body=1), -half.displacement(0.7, "y"), rtol=0.0, atol=1e-10)


def test_a_ring_around_a_post():
    post = fb.AnnularStop(0.4, Hertz(1e8), 1e-3, centre=(0.0, 1.2e-3), outer=True)
    assert held([post], []).figure().axes
    found = ran(held([post], [pushed(60.0, 210.0, direction="y"), pushed(10.0, 150.0)]))
    d = found.place_in_clearance()
    np.testing.assert_allclose(found.indentation(), 1e-3 - np.linalg.norm(d, axis=1), rtol=0.0, atol=1e-15)
    assert len(found.contacts) > 3
    assert np.all(found.force()[found.indentation() > 1e-7, 1] < 0.0)  # away from the post above


def test_the_same_frame_among_other_stops_and_elements():
    """Rows of contacts behind a circle are counted right."""
    drive = [pushed(60.0, 210.0), pushed(45.0, 210.0, 1.0, "y")]
    stops = [fb.AnnularStop(0.4, LAW, 2e-4), fb.Stop(0.7, LAW, 1e-4, direction="-y"), fb.AnnularStop(0.8, LAW, 1e-4)]
    scene = held(stops, drive, elements=[fb.Element(0.5, KelvinVoigt(1e3, 1.0), direction="x")])
    found = ran(scene, 0.05)
    assert found.force(2).shape == (501, 2)
    np.testing.assert_allclose(found.indentation(1), -found.displacement(0.7, "y") - 1e-4, rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(found.force(3)[1:], (1e3 * found.displacement(0.5, "x")
                               + found.velocity(0.5, "x"))[1:], rtol=1e-9, atol=1e-9)  # fmt: skip
    assert set(found.contacts.stop) == {0, 1, 2}


def test_saved_runs_keep_the_circle(run, tmp_path):
    again = fb.load(run.save(tmp_path / "run"))
    for name in ("force", "indentation", "place_in_clearance"):
        np.testing.assert_array_equal(getattr(again, name)(0), getattr(run, name)(0))
    np.testing.assert_array_equal(again.acceleration(0.4, "x"), run.acceleration(0.4, "x"))
    np.testing.assert_array_equal(again.reactions().force, run.reactions().force)
    assert again.places == run.places
    with np.load(tmp_path / "run.npz") as file:
        contents = dict(file)
    assert contents["directions"].shape == (2, 4)
    np.savez(tmp_path / "wrong.npz", **{**contents, "circles": np.zeros((1, 3))})
    with pytest.raises(ValueError, match="directions must have 1 rows, there are 2"):
        fb.load(tmp_path / "wrong.npz")
    plain = ran(held([fb.Stop(0.4, LAW, 2e-4, direction="x")], [pushed(60.0, 210.0)]), 0.01).save(tmp_path / "plain")
    with np.load(plain) as file:
        assert "circles" not in file
        assert "circles" not in json.loads(str(file["about"]))["units"]


def test_tables_and_figures(run, tmp_path):
    run.to_csv(tmp_path)
    head = (tmp_path / "histories.csv").read_text().splitlines()[0]
    assert head.endswith("indentation stop 0 [m],force stop 0 x [N],force stop 0 y [N]")
    assert "annular stop at 0.4 m" in str(run)
    circle, free, touching = fb.plot.orbit_in_clearance(run, window=(0.05, 0.1)).axes[0].lines
    assert np.nanmax(np.hypot(*circle.get_data())) == pytest.approx(0.2)
    assert np.nanmax(np.hypot(*touching.get_data())) > 0.2 > np.nanmin(np.hypot(*free.get_data()))
    with pytest.raises(ValueError, match=r"at least 2 samples, got \(3.0, 4.0\) .*; samples lie from 0 to 0"):
        fb.plot.orbit_in_clearance(run, window=(3.0, 4.0))
    texts = [text.get_text() for text in run.model.scene.figure().axes[0].texts]
    assert any("clearance 0.2 mm" in " ".join(text.split()) for text in texts)
    for draw in (fb.plot.time_history, fb.plot.densities, fb.plot.spectrum, fb.plot.contacts):
        assert draw(run).axes
    assert not _limits(run.model)  # of methods that do not take it


def test_a_place_struck_by_the_first_mode():
    """Slow: the stop is met at δ = 0 with the speed asked for."""
    for options in ({}, {"centre": (1e-4, 0.0)}, {"centre": (3e-4, 0.0), "outer": True}):
        log = whirling(**options).reduce(modes=4).strike(0.05)
        assert log.t_in[0] == 0.0
        assert log.speed_in[0] == pytest.approx(0.05, rel=1e-9)


def test_orbits_and_their_multipliers_are_those_of_two_stops():
    """Along x; those across are of the tube alone, free in the circle: met at right angles."""
    drive, law = [pushed(20.0, 210.0)], KelvinVoigt(2e4, 20.0)
    stops = [[fb.AnnularStop(0.4, law, 2e-4)], [fb.Stop(0.4, law, 2e-4, direction=n) for n in ("x", "-x")]]
    circle, line = (held(one, drive, damping=fb.ModalDamping(0.1)).reduce(modes=4).orbit() for one in stops)
    assert len(circle.contacts) == len(line.contacts) == 2
    np.testing.assert_allclose(circle.state, line.state, rtol=0.0, atol=1e-8 * np.abs(line.state).max())
    lines = np.sort_complex(line.multipliers)
    alike = [np.abs(circle.multipliers - one).min() < 1e-6 for one in lines]
    assert sum(alike) >= 4  # those of the motion along x


TOML = """
[frame]
nodes = { A = [0, 0, 0], B = [0, 0, 1] }
bending_only = true
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
law = { kind = "kelvin_voigt", stiffness = 2e5, damping = 20.0 }
name = "baffle"
[[stops]]
kind = "annular"
at = ["A-B", 0.8]
clearance = 1e-3
centre = [0.0, 1.5e-3]
outer = true
directions = [[0.6, 0.8, 0], [0.8, -0.6, 0]]
law = { kind = "hertz", stiffness = 1e8 }
[[stops]]
at = "B"
direction = "x"
law = { kind = "hertz", stiffness = 1e8 }
[simulate]
duration = 0.01
dt = 1e-3
"""


def test_scene_files(file_of):
    stops = file_of(TOML).scene.stops
    ways = ((0.6, 0.8, 0), (0.8, -0.6, 0))
    assert stops[:2] == (
        fb.AnnularStop(0.4, LAW, 2e-4, directions=("x", "y"), name="baffle"),
        fb.AnnularStop(("A-B", 0.8), Hertz(1e8), 1e-3, (0.0, 1.5e-3), outer=True, directions=ways),
    )
    assert stops[2] == fb.Stop("B", Hertz(1e8), direction="x")
    for old, new, message in (
        ("clearance = 2e-4", "clearance = 0.0", "clearance must be finite and positive, got 0"),
        ("clearance = 2e-4", "", "the key 'clearance' is missing"),
        ('kind = "annular"', 'kind = "anular"', "kind must be one of stop, annular; got 'anular'; did you mean"),
        ("outer = true", "out = true", "unknown key 'out'"),
        ("directions = [[", 'directions = "x" #', "directions must be a list of 2 names or vectors, got 'x'"),
    ):
        with pytest.raises(SceneFileError, match=message):
            file_of(TOML.replace(old, new))


test_bad_stops_are_refused = refused_by(
    lambda options: fb.AnnularStop(**{"z": 0.4, "law": LAW, "clearance": 2e-4, **options}),
    ({"clearance": 0.0}, "clearance must be finite and positive, got 0.0 .* at z = 0.4; .* spring along each"),
    ({"clearance": -1e-3}, "clearance must be finite and positive"),
    ({"clearance": "2 mm"}, "clearance must be a number"),
    ({"centre": (2e-4, 0.0, 0.0)}, "centre must be two finite numbers"),
    ({"centre": (np.nan, 0.0)}, "centre must be two finite numbers"),
    ({"centre": (3e-4, 4e-4)}, r"got \(0.0003, 0.0004\) .* 0.0003 m outside, towards \(-0.6, -0.8\)"),
    ({"outer": 1}, "outer must be True or False, got 1"),
    ({"outer": True}, r"begin outside the circle round the centre, got \(0.0, 0.0\) .* 0.0002 m inside"),
    ({"law": WaltonBraun(1e3, 2e3, "kept")}, "law must have no memory"),
    ({"law": Hertz}, "law must offer force"),
    ({"directions": "xy"}, "directions must be two"),
    ({"directions": ("x", "rx")}, "directions must be displacements"),
    ({"directions": ("x", (1.0, 1.0))}, "directions must be at right angles"),
    ({"directions": ("x", "w")}, "direction must be one of x, y"),
    ({"on": (1, None)}, "on must be a place"),
    error=(ValueError, TypeError),
)


def test_arrays_say_where_the_circle_is():
    given = fb.AnnularStop(0.4, LAW, 2e-4, centre=np.array([1e-4, 0.0]), directions=np.eye(3)[:2])
    listed = fb.AnnularStop(0.4, LAW, 2e-4, centre=(1e-4, 0.0), directions=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    assert given == listed
    assert fb.AnnularStop(0.4, LAW, 2e-4, directions=list(np.eye(3)[:2])).directions == listed.directions


def test_bad_scenes_are_refused():
    hole = fb.AnnularStop(0.4, LAW, 2e-4)
    bent = fb.Frame.polyline({"A": (0, 0, 0), "B": (0, 1, 0), "C": (1, 2, 0)}, STEEL)
    plane = fb.Frame({"A": (0, 0), "B": (1, 0)}, [fb.Member("A", "B", STEEL)])
    for body, stops, message in (
        (fb.Beam(1.0, STEEL), [hole], "a Beam bends in one plane, got .*; use two stops of this gap, side='below'"),
        (plane, [replace(hole, z="B")], "this frame lies in one plane, got .*; use two stops of this gap, direction="),
        (plane, [replace(hole, z="B", directions=("x", "y"))], "this frame lies in one plane"),
        (bent, [replace(hole, z="B")], "directions must be given: 'B' is on no one member"),
        (bent, [replace(hole, z=("B-C", 0.1))], "directions must be given: 0.1 m along 'B-C' is on no one member"),
        (tube(), [replace(hole, z=1.4)], "z must lie on the frame"),
        (tube(), [replace(hole, directions=("x", "z"))], "must move along z; it has x, y, rx, ry"),
        (tube(), [hole, replace(hole)], r"stops must not share one place, direction and gap \(z = 0.4, x and y\)"),
        (tube(), [replace(hole, on=(1, 0.4))], "on must name a body, and there is none"),
        (tube(), [replace(hole, on=0.4)], "on must be another place"),
        (tube(), [replace(hole, name="a"), replace(hole, z=0.6, name="a")], "names must be unique"),
    ):
        with pytest.raises(ValueError, match=message):
            fb.Scene(
                body, [fb.Clamped("A" if body is not plane and not isinstance(body, fb.Beam) else 0.0)], stops=stops
            )
    assert fb.Scene(bent, stops=[replace(hole, z=("A-B", 0.1))]).stops[0].directions == ("x", "z")


@pytest.mark.filterwarnings("ignore:1 mode cuts a pair")
def test_what_takes_stops_on_lines_alone_says_so(run):
    model = run.model
    with pytest.raises(ValueError, match="RK4 takes scalar stops"):
        model.simulate(0.01, solver=solvers.RK4(1e-5))
    with pytest.raises(ValueError, match="the stop must be an annular one"):
        ran(held([fb.Stop(0.4, LAW, 2e-4, direction="x")], []), 0.01).place_in_clearance()
    with pytest.raises(ValueError, match=r"the modes must move the place of 'annular stop at 0\.4 m' along both"):
        model.scene.reduce(modes=[0]).simulate(0.01)
    assert np.isnan(backbone(model, (0.4, "x"), np.array([1e-3]))).all()


def test_the_log_has_the_angles_of_entry_and_exit(run):
    """Without friction too: those of the path at these times, which cubics through the samples give."""
    log = run.contacts
    fine = run.model.simulate(float(run.t[-1]), np.sort(np.concatenate([log.t_in, log.t_out[~np.isnan(log.t_out)]])),
                              run.made.start, solver=METHOD)  # fmt: skip
    angle = np.arctan2(*fine.place_in_clearance().T[::-1])
    for times, angles in ((log.t_in, log.angle_in), (log.t_out, log.angle_out)):
        ended = ~np.isnan(times)
        np.testing.assert_allclose(angles[ended], angle[np.searchsorted(fine.t, times[ended])], atol=1e-6)
    assert {"angle_in", "angle_out"} <= set(log.named_arrays())
    line = fb.Scene(
        fb.Beam(0.3, fb.Section.circle(2e11, 7800.0, 0.01)),
        [fb.Clamped(0.0)],
        stops=[fb.Stop(0.3, LAW)],
        base=fb.Harmonic(1e-3, 90.0),
    )
    plain = line.reduce(modes=1).simulate(0.1).contacts
    assert len(plain) > 0
    assert "angle_in" not in plain.named_arrays()


def test_whirl_is_animated(run, tmp_path):
    """The place moves in its circle beside the tube, with the way it came."""
    assert fb.plot.animate(run, tmp_path / "whirl.gif", frames=3).stat().st_size > 1000
    t = float(run.t[len(run.t) // 2])
    figure = fb.plot.frame(run, t, window=(t - 0.01, t + 0.01))
    _, beside = figure.axes
    at = 1e3 * run.place_in_clearance()[int(np.argmin(abs(run.t - t)))]
    np.testing.assert_allclose(np.ravel(beside.lines[-1].get_data()), at, rtol=1e-9)
    assert "clearance" in beside.get_title()
    assert beside.get_xlabel() == "x / mm"
