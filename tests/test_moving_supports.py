"""Supports with motions of their own: equal ones are a base motion, one end that moves by formula, what is refused."""

import numpy as np
import pytest
from frames import PORTAL, portal
from refusals import refused

import fembeam as fb
from contacts import Hertz, Jenkins, KelvinVoigt
from fembeam.plot.bodies import displacements
from fembeam.study.measure import cut
from solvers import DormandPrince, Exponential

WAVE = fb.Harmonic(1e-3, 46.0, phase=0.7)
DAMPED = {"damping": fb.ModalDamping(0.02)}
SPAN = fb.Section(E=1e4, rho=1.0, A=1.0, I=1e-4)


def feet(wave_a, wave_d, **options):
    """The portal with feet that move along x."""
    supports = [fb.Clamped("A", motion={"x": wave_a}), fb.Clamped("D", motion={"x": wave_d})]
    return fb.Scene(portal(), supports, **DAMPED, **options)


def based(**options):
    """The portal on a frame that moves."""
    return fb.Scene(portal(), [fb.Clamped("A"), fb.Clamped("D")], base={"x": WAVE}, **DAMPED, **options)


def equal(one, two, tolerance):
    """Whether two histories are one to a share of their size."""
    return np.abs(one - two).max() <= tolerance * np.abs(one).max()


def test_equal_motions_are_a_base_motion():
    """On all coordinates to rounding: motion, reactions, section forces; energy balances; the saved run as well."""
    one, two = (scene.reduce("all", elements=6).simulate(0.3, 5e-3) for scene in (based(), feet(WAVE, WAVE)))
    for place in ("A", "C", ("B-C", 1.3)):
        for quantity in ("displacement", "velocity", "acceleration"):
            known = getattr(one, quantity)(place, "x", absolute=True)
            assert equal(known, getattr(two, quantity)(place, "x"), 1e-10), (place, quantity)
    for mine, other in zip(one.reactions(), two.reactions(), strict=True):
        assert all(equal(mine[c], other[c], 1e-10) for c in ("x", "y", "rz"))
    for place in (("A-B", 0.0), ("A-B", 1.5), ("B-C", 4.0)):
        forces = two.section_forces(place)
        assert all(equal(known, forces[name], 1e-10) for name, known in one.section_forces(place).items())
    assert abs(two.energy.residual).max() < 1e-9 * abs(two.energy.input).max()


TIMES = 0.01 * np.arange(100)
RECORD = fb.Record(TIMES, np.cos(9.0 * TIMES) + 0.5 * np.sin(40.0 * TIMES), quantity="acceleration")


@pytest.mark.parametrize("signal", [
    fb.BandNoise(1e-3, (0.0, 400.0), seed=3), fb.SineSweep(1e-3, 50.0, 200.0, 0.8), RECORD,
])  # fmt: skip
def test_equal_sampled_motions_are_a_base_motion(signal, tmp_path):
    """At the default tolerance, to which the run takes such signals; also of a part of the run and of its file."""
    rod = fb.Section.circle(2.1e11, 7800.0, 0.02)
    damping = fb.Rayleigh(0.0, 1e-5)
    shaken = fb.Scene(fb.Beam(1.0, rod), [fb.Clamped(0.0)], damping=damping, base=signal)
    moved = fb.Scene(fb.Beam(1.0, rod), [fb.Clamped(0.0, motion={"y": signal})], damping=damping)
    one, two = (scene.reduce(8).simulate(0.79, 5e-3) for scene in (shaken, moved))
    known, force = one.acceleration(1.0, absolute=True), one.reactions()[0].force
    two.save(tmp_path / "run.npz")
    for run, first in ((two, 1), (cut(two, 0.1, 0.79), 20), (fb.load(tmp_path / "run.npz"), 1)):
        found = slice(len(run.t) - len(known) + first, None)
        assert equal(known[first:], run.acceleration(1.0)[found], 2e-5)
        assert equal(force[first:], run.reactions()[0].force[found], 2e-5)


def rotor(spin=180.0, motion=None, **options):
    """A shaft on pins with a disk on one of them, out of balance; the pins at rest or in one motion."""
    shaft = fb.Frame.straight(0.8, fb.Section.circle(2.1e11, 7850.0, 0.03), spin=spin, bending_only=True)
    supports = [fb.Pinned(end, motion=motion) for end in "AB"]
    disks = [fb.Disk("A", 2.0, 0.02, 0.035), fb.Disk(0.3, 6.0, 0.03, 0.055)]
    return fb.Scene(shaft, supports, masses=disks, forces=[fb.Unbalance(0.3, 3e-4)], **DAMPED, **options)


def test_equal_motions_of_the_bearings_of_a_rotor_are_a_base_motion():
    """Gyroscopic moments between moving bearings and what is beside them count: motion and reactions, to rounding."""
    scenes = rotor(base={"x": WAVE}), rotor(motion={"x": WAVE})
    one, two = (scene.reduce("all", elements=6).simulate(0.1, 5e-3) for scene in scenes)
    for way in "xy":
        assert equal(*(run.displacement(0.5, way, absolute=True) for run in (one, two)), 1e-9), way
        for mine, other in zip(one.reactions(), two.reactions(), strict=True):
            assert equal(mine[way], other[way], 1e-9), way


def test_models_of_another_spin_on_moving_bearings():
    """A model made again for another spin is that of the rotor with this spin."""
    motion = {"x": WAVE}
    made = rotor(120.0, motion).reduce(4).again(rotor(240.0, motion))
    runs = [model.simulate(0.1, 1e-3).displacement(0.5, "y") for model in (rotor(240.0, motion).reduce(4), made)]
    assert np.array_equal(*runs)


def test_kept_by_a_file(tmp_path):
    """Places on and beside moving supports, from the file alone."""
    run = feet(WAVE, fb.Harmonic(2e-3, 30.0)).reduce(2).simulate(0.1, 5e-3)
    run.save(tmp_path / "run.npz")
    read = fb.load(tmp_path / "run.npz")
    for place, signal in (("A", WAVE), ("D", fb.Harmonic(2e-3, 30.0))):
        assert np.allclose(run.displacement(place, "x"), signal(run.t), rtol=0, atol=1e-15)
        assert np.array_equal(run.displacement(place, "x"), read.displacement(place, "x"))
        assert np.array_equal(run.velocity(place, "x"), read.velocity(place, "x"))
    assert np.allclose(read.reactions()[1]["x"], run.reactions()[1]["x"], rtol=1e-12)
    assert run.motion("D")[:, 0].max() == run.extremes(z=[("D", "x")]).highest[0]


def test_few_modes_with_the_shapes_of_the_supports():
    """Two modes and the static shapes of both feet are as good as two modes under a base motion."""
    one, two = (scene.reduce(modes=2) for scene in (based(), feet(WAVE, WAVE)))
    assert (len(one.omega), len(two.omega)) == (2, 4)
    w = np.array([5.0, 30.0, 60.0])
    both = [two.frequency_response(w, f"supports[{i}].motion.x", ("C", "x")).values for i in range(2)]
    assert np.allclose(sum(both), one.frequency_response(w, "base.x", ("C", "x"), absolute=True).values, rtol=1e-4)


@pytest.mark.parametrize("elements", [4, 12])
def test_reactions_with_few_modes(elements):
    """Off from those on a base that moves by (ω/ω_s)² of the inertia that the other modes leave out."""
    wave, damping = fb.Harmonic(1e-3, 200.0, phase=-np.pi / 2), fb.ModalDamping(0.2)
    frame = fb.Frame({"A": (0, 0), "B": (1.0, 0.4)}, [fb.Member("A", "B", fb.Section.circle(2.1e11, 7800.0, 0.02))])
    based = fb.Scene(frame, [fb.Clamped("A")], base={"x": wave}, damping=damping).reduce(4, elements=elements)
    moved = fb.Scene(frame, [fb.Clamped("A", motion={"x": wave})], damping=damping).reduce(4, elements=elements)
    one, two = (model.simulate(0.4, 5e-3, None, Exponential(1e-9)).reactions()[0]["x"] for model in (based, moved))
    left = based.moving_mass[0] - based.effective_mass[:, 0].sum()
    off = left * wave.amplitude * wave.omega**2 * (wave.omega / moved.omega.max()) ** 2
    assert 0.8 * off < abs(two - one)[40:].max() < 1.2 * off < 1e-3 * abs(one).max()


@pytest.mark.parametrize("omega", [3.0, 20.0, 55.0])
def test_one_end_moves(omega):
    """A beam on two pins, one of which moves: u = Y/2 (sin κz/sin κL + sinh κz/sinh κL)."""
    frame = fb.Frame({"A": (0, 0), "B": (1.0, 0)}, [fb.Member("A", "B", SPAN)])
    wave = fb.Harmonic(1.0, omega)
    scene = fb.Scene(frame, [fb.Pinned("A"), fb.Fixed("B", "y", motion={"y": wave})])
    kappa, at = np.sqrt(omega), np.array([0.25, 0.5, 0.9, 1.0])
    exact = 0.5 * (np.sin(kappa * at) / np.sin(kappa) + np.sinh(kappa * at) / np.sinh(kappa))
    places, errors = [(("A-B", float(z)), "y") for z in at], []
    for modes in (8, 24):
        response = scene.reduce(modes).frequency_response([omega], "supports[1].motion.y", places)
        errors.append(np.abs(response.values[0] - exact).max())
    assert errors[1] < 5e-5
    assert errors[1] < 0.2 * errors[0]  # what the modes left out had of the inertia


def test_contacts():
    """Stops between places of the structure do not know which way its feet were said to move."""
    stops = [fb.Stop("C", KelvinVoigt(1e6, 1e3), gap=1e-4, direction="x", on=("A-B", 1.5))]
    one, two = (s.reduce("all", elements=6).simulate(0.2) for s in (based(stops=stops), feet(WAVE, WAVE, stops=stops)))
    assert len(one.contacts) == len(two.contacts) > 1
    assert np.allclose(one.contacts.t_in[:3], two.contacts.t_in[:3], rtol=1e-7)


def test_places_close_to_a_support_do_not_swing_about_the_table_of_its_motion():
    """At t = 0 the nodes of noise are off by a part of rtol, times the square of 5.4e5 rad/s 5 times the acceleration.

    Within cells of 0.65 rad of the fastest line the second derivative of a quintic errs by some 100 rtol.
    """
    noise, rtol = fb.BandNoise(1e-3, (0.0, 200.0), seed=1), 1e-6
    rod = fb.Section(E=2.1e11, rho=7800.0, A=1e-4, I=8.3e-10)

    def acceleration(supports, base=None):
        springs = [fb.Spring(0.01, 1e-3)]  # asks for a node there
        scene = fb.Scene(fb.Beam(1.0, rod), supports, springs=springs, base=base, **DAMPED)
        run = scene.reduce("all", elements=8).simulate(0.02, 1e-4, solver=Exponential(rtol))
        return run.acceleration(0.01, absolute=True)

    known = acceleration([fb.Clamped(0.0), fb.Pinned(0.7)], noise)
    found = acceleration([fb.Clamped(0.0, motion={"y": noise}), fb.Pinned(0.7, motion={"y": noise})])
    assert np.abs(found - known).max() < 1e3 * rtol * np.abs(known).max()


def test_statistics_over_realisations_of_the_noise_that_moves_supports():
    """Equal motions are a base motion; with each new realisation the supports jumped, which all damped at 10/s kept."""
    noise, rod = fb.BandNoise(1e-3, (0.0, 200.0), seed=1), fb.Section(E=2.1e11, rho=7800.0, A=1e-4, I=8.3e-10)

    def response(supports, base=None):
        scene = fb.Scene(fb.Beam(1.0, rod), supports, damping=fb.Rayleigh(20.0, 0.0), base=base)
        watch = {
            "u": lambda run: run.displacement(0.5, absolute=True),
            "a": lambda run: run.acceleration(0.5, absolute=True),
        }
        return fb.study.stationary(scene.reduce("all", elements=4), 16.0, 2e-3, watch, discard=1.0, segment=256)

    known = response([fb.Clamped(0.0), fb.Pinned(0.7)], noise)
    found = response([fb.Clamped(0.0, motion={"y": noise}), fb.Pinned(0.7, motion={"y": noise})])
    for name in ("u", "a"):
        assert found[name].std.value == pytest.approx(known[name].std.value, rel=1e-4)


def test_a_run_longer_than_the_period_of_its_noise_starts_where_its_supports_are():
    """Without a period asked for, such a run takes another realisation: its start must be of that one."""
    band = (0.0, 2e4)  # its period, left out, is 1.3 s

    def run(period):
        feet = {"y": fb.BandNoise(1e-3, band, seed=1, period=period)}
        scene = fb.Scene(fb.Beam(1.0, SPAN), [fb.Clamped(0.0, motion=feet), fb.Clamped(1.0)], **DAMPED)
        return scene.reduce(modes=1, elements=4).simulate(1.5, 0.1)

    left_out, given = run(None), run(1.5)
    np.testing.assert_array_equal(left_out.q, given.q)
    np.testing.assert_array_equal(left_out.q_dot, given.q_dot)


def test_joined_pieces():
    """Feet of three joined pieces: the run, reactions and section forces of the portal in one piece."""
    pieces = [fb.Frame({n: PORTAL[n] for n in (one.a, one.b)}, [one]) for one in portal().members]
    wave = fb.Harmonic(2e-3, 30.0)
    supports = fb.Clamped("A", motion={"x": WAVE}), fb.Fixed("D", motion={"x": wave, "y": WAVE})
    bodies = [fb.Scene(pieces[1]), fb.Scene(pieces[2], supports[1:])]
    joints = [fb.Joint("B", (1, "B")), fb.Joint("C", (2, "C"), body=1)]
    joined = fb.Scene(pieces[0], supports[:1], bodies=bodies, joints=joints, **DAMPED)
    one, two = (s.reduce(4).simulate(0.2, 5e-3) for s in (fb.Scene(portal(), supports, **DAMPED), joined))
    assert equal(one.displacement("C", "x"), two.displacement((2, "C"), "x"), 1e-9)
    assert np.array_equal(one.displacement("D", "y"), two.displacement("D", "y"))
    for mine, other in zip(one.reactions(), two.reactions(), strict=True):
        assert all(equal(mine[c], other[c], 1e-7) for c in ("x", "y", "rz"))
    assert equal(one.section_forces(("D-C", 1.0))["M"], two.section_forces((2, ("D-C", 1.0)))["M"], 1e-8)


def test_names_of_signals():
    """Studies vary the motions by their paths; noise without a period gets one of the run."""
    scene = feet(WAVE, fb.Harmonic(1e-3, 20.0))
    assert list(fb.scene.signals_of(scene)) == ["supports[0].motion.x", "supports[1].motion.x"]
    other = fb.scene.with_value(scene, "supports[1].motion.x.amplitude", 3e-3)
    assert other.supports[1].motion["x"].amplitude == 3e-3
    assert other.supports[0] == scene.supports[0]
    assert not fb.scene.changes_structure("supports[1].motion.x.omega")
    assert repr(fb.Clamped("A")) == "Clamped(z='A')"


def test_in_a_file(file_of):
    """A table of signals by dof."""
    nodes = ", ".join(f"{name} = {list(at)}" for name, at in PORTAL.items())
    text = f"""
[frame]
nodes = {{ {nodes} }}
[[frame.members]]
nodes = ["A", "B", "C", "D"]
section = {{ shape = "rectangle", E = 2.1e11, rho = 7850.0, width = 0.05, height = 0.1 }}
[[supports]]
kind = "clamped"
at = "A"
motion = {{ x = {{ kind = "harmonic", amplitude = 1e-3, omega = 46.0, phase = 0.7 }} }}
[[supports]]
kind = "fixed"
at = "D"
dofs = ["x", "y"]
[supports.motion.x]
kind = "harmonic"
amplitude = 2e-3
omega = 30.0
"""
    assert file_of(text).scene.supports == (
        fb.Clamped("A", motion={"x": WAVE}),
        fb.Fixed("D", "x", "y", motion={"x": fb.Harmonic(2e-3, 30.0)}),
    )


def test_drawn():
    """The rig says how supports move; a picture of the run has the feet where they are."""
    scene = feet(WAVE, fb.Harmonic(1e-3, 20.0))
    texts = " ".join(text.get_text().replace("\n", " ") for axes in scene.figure().axes for text in axes.texts)
    assert "clamp at A, x: Harmonic, 1 mm, 46 rad/s" in texts
    run = scene.reduce(2).simulate(0.1, 5e-3)
    moved = displacements(run.shapes, run.with_supports(run.q, run.shapes.moving)[-1])
    assert moved[run.shapes.known.index("A"), 0] == pytest.approx(WAVE(run.t[-1:])[0], rel=1e-12)
    assert fb.plot.deflected(run).axes


# What no support can do.
test_refused = refused(
    (lambda: fb.Pinned("A", motion={"rz": WAVE}), r"of dofs that the support holds, x, y, z, got 'rz' in Pinned"),
    (lambda: fb.Clamped("A", motion=WAVE), "motion must name its dofs"),
    (lambda: fb.Clamped("A", motion={"x": np.sin}), "signals that know their derivatives"),
    (lambda: fb.Scene(portal(), [fb.Clamped("A", motion={"z": WAVE})]), r"has x, y, rz, got .'z'. in supports.0."),
    (lambda: feet(WAVE, WAVE, stops=[fb.Stop("D", Hertz(1e8), direction="x")]), r"moves along x, got 'D' in stops"),
)  # fmt: skip


@pytest.mark.parametrize("rtol", [1e-8, 1e-12])
def test_stiff_coordinate_that_follows_a_sampled_motion(rtol):
    """The load of the support gives the shape that follows it 8e4 J, of which each of its 2.8e6 rad/s rounds a part."""
    steel = fb.Section(2.1e11, 7800.0, 8.567e-5, 1.2316e-9)
    scene = fb.Scene(
        fb.Beam(0.398, steel),
        [fb.Clamped(0.0), fb.Pinned(0.2128, motion={"y": fb.Step(1e-3, 0.01)})],
        springs=[fb.Spring(0.2683, 4014.0)],
        dashpots=[fb.Dashpot(0.2853, 4.3)],
        elements=[fb.Element(0.262, Jenkins(2000.0, 0.5))],
        damping=fb.ModalDamping(0.02),
        forces=[fb.PointForce(0.26325, fb.Pulse(5.0, 0.05, 0.01)), fb.PointForce(0.3956, fb.Step(5.0, 0.03))],
    )
    run = scene.reduce(modes=6, residual=True).simulate(0.3, 1e-3, solver=Exponential(rtol))
    # 12 000 or 14 000 by the rounding of its modes, 100 000 where what follows the load counts as oscillating
    assert run.cost.steps < 40_000
    assert np.abs(run.energy.residual).max() < 1e-7 * np.abs(run.energy.input).max()


def test_a_support_moved_by_an_accelerogram_beside_a_stop():
    """Its kinks left the coordinate of 2e5 rad/s that follows the support to set the steps: 170 000 in 0.5 s."""
    t = 0.005 * np.arange(120)
    ground = 3.0 * np.cumsum(np.random.default_rng(0).standard_normal(t.size))
    record = fb.Record(t, ground, quantity="acceleration", interpolation="linear", detrend=True)
    steel = fb.Section(2.1e11, 7800.0, 1e-4, 8.3e-10)
    scene = fb.Scene(
        fb.Beam(1.0, steel),
        [fb.Clamped(0.0, motion={"y": record}), fb.Pinned(1.0)],
        stops=[fb.Stop(0.5, law=Hertz(1e7), gap=2e-3)],
        damping=fb.ModalDamping(0.01),
    )
    model = scene.reduce(modes=5)
    ours, other = (model.simulate(0.26, 1e-3, solver=solver) for solver in (Exponential(1e-8), DormandPrince(1e-9)))
    assert len(ours.contacts) == len(other.contacts) == 2
    assert ours.contacts.t_in == pytest.approx(other.contacts.t_in, abs=1e-10)
    assert np.abs(ours.q - other.q).max() < 1e-8 * np.abs(other.q).max()
    assert ours.cost.steps < 2000
    assert np.abs(ours.energy.residual).max() < 1e-9 * np.abs(ours.energy.input).max()
