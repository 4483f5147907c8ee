"""Derivatives of runs of scenes against differences of runs, where elements turn together and numbers are zero."""

import numpy as np
import pytest

import fembeam as fb
from contacts import BoucWen, Coulomb, KelvinVoigt, PiecewiseLinear, Polynomial, Segment, Tabulated, law, memory_law
from fembeam.scene import value_of, with_value
from solvers import Exponential

BAR = fb.Section.rectangle(2.0e11, 7800.0, width=0.02, height=0.003)
FINE = Exponential(1e-11)


def rig(law=None, element=None, masses=(), **parts):
    """A cantilever that is shaken onto a stop at its tip, perhaps with an element beside it."""
    return fb.Scene(
        fb.Beam(0.25, BAR),
        [fb.Clamped(0.0)],
        masses=masses or [fb.LumpedMass(0.25, mass=0.05)],
        stops=[fb.Stop(0.25, law or Polynomial([2e4]), gap=1e-4)],
        elements=[] if element is None else [fb.Element(0.2, element)],
        damping=fb.ModalDamping(0.02),
        base=fb.Harmonic(1e-3, 110.0),
        **parts,
    )


def simulated(scene, modes=1, duration=0.12, dt=3e-3):
    return scene.reduce(modes=modes).simulate(duration, dt, solver=FINE)


def differences(scene, path, step, read, sides=(-2, -1, 1, 2), weights=(1 / 12, -2 / 3, 2 / 3, -1 / 12), **options):
    """Derivative of what is read off a run by five-point differences."""
    value = value_of(scene, path)
    values = [read(simulated(with_value(scene, path, value + k * step), **options)) for k in sides]
    return sum(weight * one for weight, one in zip(weights, values, strict=True)) / step


@pytest.mark.parametrize("path", ["y.amplitude", "y.omega", "y.phase", "rx.phase"])
def test_numbers_of_a_support_that_moves_change_the_start_that_follows_it(path):
    """At rest the structure has the place and the speed of its supports at t = 0; beside one a place moves with it."""
    motion = {"y": fb.Harmonic(1e-3, 70.0, 0.4), "rx": fb.Harmonic(2e-3, 50.0)}
    scene = fb.Scene(
        fb.Beam(0.5, BAR),
        [fb.Clamped(0.0, motion=motion), fb.Pinned(0.5)],
        stops=[fb.Stop(0.3, KelvinVoigt(1e5, 20.0), gap=2e-4)],
        damping=fb.ModalDamping(0.02),
    )
    path, options = f"supports[0].motion.{path}", {"modes": 3, "duration": 0.1, "dt": 1e-3}
    run = simulated(scene, **options)
    found = run.sensitivity(path)
    assert len(run.contacts)
    both = [0.004, 0.3]
    for read in (lambda one: one.displacement(both), lambda one: one.velocity(both)):
        by_differences = differences(scene, path, 1e-4 * (value_of(scene, path) or 0.1), read, **options)
        miss = np.abs(read(found) - by_differences).max(axis=0)
        assert np.all(miss <= np.array([1e-4, 1e-5]) * np.abs(by_differences).max(axis=0))  # a stiff shape moves there


def test_a_small_number_that_stands_for_zero():
    """Modes do not feel a thousandth of it: the derivative by an axial force of 1 nN was three times too large."""
    scene = fb.Scene(fb.Beam(0.5, BAR, axial_force=1e-9), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02),
                     forces=[fb.PointForce(0.5, fb.Harmonic(1.0, 60.0))])  # fmt: skip
    path, options = "beam.axial_force", {"modes": 2, "duration": 0.05, "dt": 1e-3}
    found = simulated(scene, **options).sensitivity(path).displacement(0.5)
    by_differences = differences(scene, path, 0.1, lambda run: run.displacement(0.5), **options)
    np.testing.assert_allclose(found, by_differences, rtol=0.0, atol=1e-4 * np.abs(by_differences).max())


def test_motion_beside_a_support_that_moves():
    """Linear: an orbit's extremes by the amplitude are in proportion; by the length the first element is another."""
    motion, damping = {"y": fb.Harmonic(1e-3, 150.0)}, fb.ModalDamping(0.05)
    scene = fb.Scene(fb.Beam(0.5, BAR), [fb.Clamped(0.0, motion=motion)], damping=damping)
    orbit = scene.reduce(modes=2).orbit()
    found = orbit.sensitivity("supports[0].motion.y.amplitude")
    for z in (0.0, 0.004):
        np.testing.assert_allclose(1e-3 * np.array(found.extremes(z)), orbit.extremes(z), rtol=1e-6)
    path, options = "beam.length", {"modes": 2, "duration": 0.05, "dt": 1e-3}
    found = simulated(scene, **options).sensitivity(path).displacement(0.004)
    by_differences = differences(scene, path, 1e-4, lambda run: run.displacement(0.004), **options)
    np.testing.assert_allclose(found, by_differences, rtol=0.0, atol=1e-4 * np.abs(by_differences).max())


@pytest.mark.parametrize("side", ["below", "above"])
def test_rest_on_a_stop_without_gap(side):
    """Two tones cancel at t = 0 to rounding only: most such runs were refused, "touched at the start", "grazes"."""
    tones = fb.Multisine([1e-3, 4e-4], [110.0, 242.0], [0.1, 0.3])
    stop = fb.Stop(0.25, KelvinVoigt(1e5, 20.0), gap=0.0, side=side)
    scene = fb.Scene(fb.Beam(0.25, BAR), [fb.Clamped(0.0)], [fb.LumpedMass(0.25, mass=0.05)], stops=[stop],
                     damping=fb.ModalDamping(0.02), base=tones)  # fmt: skip
    path, options = "masses[0].mass", {"modes": 2, "duration": 0.05, "dt": 1e-3}
    found = simulated(scene, **options).sensitivity(path).displacement(0.25)
    by_differences = differences(scene, path, 1e-5, lambda run: run.displacement(0.25), **options)
    np.testing.assert_allclose(found, by_differences, rtol=0.0, atol=1e-5 * np.abs(by_differences).max())


@pytest.mark.parametrize("path", ["impactors[0].velocity", "impactors[0].mass"])
def test_a_speed_at_the_start_moves_no_stop_off_its_surface(path):
    """Dashpots on both couple places with speeds, so that dδ(0) was 3e-37 m for 0: refused, "touched at the start"."""
    ball = fb.Impactor(0.25, 0.05, -1.0, KelvinVoigt(1e5, 5.0), gap=1e-3, stiffness=100.0, damping=1.0)
    scene = fb.Scene(fb.Beam(0.25, BAR), [fb.Clamped(0.0)], stops=[fb.Stop(0.2, KelvinVoigt(1e5, 20.0), gap=0.0)],
                     impactors=[ball], dashpots=[fb.Dashpot(0.2, 5.0)], base=fb.Harmonic(1e-3, 110.0))  # fmt: skip
    options = {"modes": 4, "duration": 0.02, "dt": 1e-3}
    found = simulated(scene, **options).sensitivity(path).displacement(0.1)
    step = 1e-5 * abs(value_of(scene, path))
    by_differences = differences(scene, path, step, lambda run: run.displacement(0.1), **options)
    np.testing.assert_allclose(found, by_differences, rtol=0.0, atol=1e-5 * np.abs(by_differences).max())


@pytest.mark.parametrize("element", [Coulomb(0.3, 1e4), BoucWen(1e4, 0.2, 1.0, 2e3, 1e3)])
def test_a_force_that_peaks_where_an_element_turns(element):
    """One mode turns at once in the stop and in the element, so that the largest force lies on the element's event."""
    scene, path = rig(element=element), "masses[0].mass"
    found = simulated(scene, duration=0.15).sensitivity(path)
    by_differences = differences(scene, path, 1e-6, lambda run: run.contacts.peak_force, duration=0.15)
    np.testing.assert_allclose(found.peak_force, by_differences, rtol=3e-6)


@pytest.mark.parametrize("name", ["A", "beta", "gamma", "stiffness", "alpha"])
def test_numbers_of_smooth_hysteresis(name):
    """Its displacement z passes zero in every cycle, where it is latched as zero."""
    scene, path = rig(element=BoucWen(1e4, 0.2, 1.0, 2e3, 1e3)), f"elements[0].law.{name}"
    found = simulated(scene).sensitivity(path).displacement(0.25)
    by_differences = differences(scene, path, 1e-4 * value_of(scene, path), lambda run: run.displacement(0.25))
    np.testing.assert_allclose(found, by_differences, rtol=0.0, atol=5e-7 * np.abs(by_differences).max())


@law(knots=[1e-4])
def two_slopes(delta, delta_dot, entry_rate, soft=1e4, hard=3e4):
    return soft * delta + (hard - soft) * max(delta - 1e-4, 0.0)


def power(delta, delta_dot, entry_rate, stiffness, exponent):
    return stiffness * delta**exponent


def spring(delta, delta_dot, stiffness):
    return stiffness * delta


def test_parameters_of_own_laws():
    """They have the names of the function's arguments, also of laws with memory and in sums."""
    known = rig(PiecewiseLinear([1e4, 3e4], knots=[1e-4]))
    scene = rig(two_slopes())
    for own, same in (("soft", "slopes[0]"), ("hard", "slopes[1]")):
        assert value_of(scene, f"stops[0].law.{own}") == value_of(known, f"stops[0].law.{same}")
        found, right = (
            simulated(one).sensitivity(f"stops[0].law.{name}").displacement(0.25)
            for one, name in ((scene, own), (known, same))
        )
        np.testing.assert_allclose(found, right, rtol=0.0, atol=1e-7 * np.abs(right).max())
    line = memory_law("line", {"always": Segment(spring)})(stiffness=1e3)
    both = rig(two_slopes() + KelvinVoigt(1e3, 1.0), line)
    for path in ("stops[0].law.parts[0].hard", "elements[0].law.stiffness"):
        assert value_of(with_value(both, path, 2e3), path) == 2e3
    with pytest.raises(ValueError, match=r"no such parameter; the scene has .*law\.hard.* did you mean .*law\.hard"):
        value_of(scene, "stops[0].law.hrd")
    with pytest.raises(ValueError, match="must not pull at rest"):
        with_value(scene, "stops[0].law.soft", -1e4)


def test_the_exponent_of_an_own_law_follows_its_parameters():
    """Unless it was given; it is no number of the scene, nor are knots."""
    found, given = law(power)(stiffness=1e7, exponent=1.5), law(power, exponent=2.0)(stiffness=1e7, exponent=1.5)
    assert [with_value(rig(one), "exponent", 1.25).stops[0].law.exponent for one in (found, given)] == [1.25, 2.0]
    for path in ("stops[0].law.exponent", "stops[0].law.knots[0]"):
        with pytest.raises(ValueError, match="no such parameter"):
            value_of(rig(two_slopes()), path)


def test_a_knot_that_is_hardly_passed():
    """Most times beyond the knot lie before nearby values of it, if these are not very near."""
    options = {"duration": 0.06, "dt": 1e-3}
    deepest = simulated(rig(PiecewiseLinear([1e4])), **options).contacts.peak_indentation[0]
    scene, path = rig(PiecewiseLinear([1e4, 3e4], knots=[deepest * (1.0 - 1e-5)])), "stops[0].law.knots[0]"
    found = simulated(scene, **options).sensitivity(path)
    by_differences = differences(scene, path, 2e-7 * deepest, lambda run: run.contacts.impulse, **options)
    np.testing.assert_allclose(found.impulse, by_differences, rtol=2e-2)


def test_a_last_sample_that_rounds_beyond_the_end():
    """50 × (duration/50) may be more than the duration by rounding."""
    duration, count = next((t, k) for t in (0.011, 0.013, 0.017) for k in range(40, 400) if k * (t / k) > t)
    run = simulated(rig(), duration=duration, dt=duration / count)
    assert run.sensitivity("base.phase").q[-1].any()


def test_a_clearance_about_its_centre():
    """A hole narrower than the step that other zeros are differenced by."""
    shaft = fb.Frame.straight(0.3, fb.Section.circle(2.1e11, 7850.0, 0.02), bending_only=True)
    base = {"x": fb.Harmonic(1e-4, 300.0)}
    hole = fb.AnnularStop("B", KelvinVoigt(1e6, 10.0), clearance=2e-5)
    scene = fb.Scene(shaft, [fb.Clamped("A")], stops=[hole], damping=fb.ModalDamping(0.02), base=base)
    path = "centre[0]"
    options = {"modes": 2, "duration": 0.02, "dt": 1e-3}
    found = simulated(scene, **options).sensitivity(path).displacement("B", "x")
    by_differences = differences(scene, path, 1e-9, lambda run: run.displacement("B", "x"), **options)
    np.testing.assert_allclose(found, by_differences, rtol=0.0, atol=1e-6 * np.abs(by_differences).max())


@pytest.mark.parametrize("size", [1.0, 0.05])
def test_an_inertia_and_an_axial_force_that_are_zero(size):
    """Steps of both follow the size of the rig: some were refused as changing the modes abruptly."""
    section = fb.Section.rectangle(2.0e11, 7800.0, width=0.02 * size, height=0.003 * size)
    mass = fb.LumpedMass(0.2 * size, mass=0.05 * size**3)
    model = fb.Scene(fb.Beam(0.25 * size, section), [fb.Pinned(0.0), fb.Pinned(0.25 * size)], [mass],
                     damping=fb.ModalDamping(0.02), base=fb.Harmonic(1e-3, 110.0)).reduce(modes=1)  # fmt: skip
    run = model.simulate(0.01, 1e-3)
    buckling = model.scene.buckling_load()
    for path, step in (("beam.axial_force", 1e-4 * buckling), ("masses[0].inertia", 1e-4 * mass.mass * size**2)):
        found = run.sensitivity(path).models.derivative(lambda one: one.omega)
        a, b, c = (with_value(model.scene, path, k * step).reduce(modes=1).omega for k in (0, 1, 2))
        np.testing.assert_allclose(found, (4.0 * b - 3.0 * a - c) / (2.0 * step), rtol=1e-4)


def cantilever_between(**reduction):
    """A run of a bar in space that is shaken onto either of two stops across it."""
    bar = fb.Frame({"A": (0.0, 0.0, 0.0), "B": (0.25, 0.0, 0.0)}, [fb.Member("A", "B", BAR, up=(0.0, 0.6, 0.8))])
    stops = [fb.Stop("B", KelvinVoigt(1e4, 2.0), gap=1e-4, direction=(0.0, side, 0.0)) for side in (1.0, -1.0)]
    shaken = fb.Scene(bar, [fb.Clamped("A")], stops=stops, damping=fb.ModalDamping(0.02),
                      base={"y": fb.Harmonic(1e-3, 110.0)})  # fmt: skip
    return shaken.reduce(modes=2, **reduction).simulate(0.05, 1e-3, solver=FINE)


def test_the_share_of_up_along_the_member_changes_nothing():
    """Steps from 0 grew until the scene refused them."""
    run = cantilever_between()
    assert len(run.contacts) > 1
    along, across = (run.sensitivity(f"beam.members[0].up[{i}]") for i in (0, 1))
    assert np.abs(along.q).max() < 1e-9 * np.abs(across.q).max()
    assert np.abs(along.peak_force).max() < 1e-9 * np.abs(across.peak_force).max()


def test_a_static_shape_that_two_stops_share():
    """Turned a little, one has a shape of its own: that ended in the words of NumPy. Modes alone have a derivative."""
    path, step = "stops[1].direction[2]", 1e-4
    with pytest.raises(ValueError, match=r"number of coordinates must not change, got .* leave out residual=True"):
        cantilever_between(residual=True).sensitivity(path)
    run = cantilever_between()
    there = [run.model.again(with_value(run.model.scene, path, k * step)).simulate(0.05, 1e-3, solver=FINE).q[-1]
             for k in (1, -1)]  # fmt: skip
    expected = (there[0] - there[1]) / (2.0 * step)
    np.testing.assert_allclose(run.sensitivity(path).q[-1], expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("path", ["beam.nodes.A[1]", "beam.nodes.B[1]", "beam.nodes.C[1]"])
def test_a_node_that_leaves_the_plane_of_a_frame(path):
    """Modes of that plane got either sign: they were refused, "modes must change smoothly"."""
    tube = fb.Section.tube(2e11, 7900.0, 0.05, 0.04)
    frame = fb.Frame.polyline({"A": (0.0, 0.0, 0.0), "B": (0.0, 0.0, 1.0), "C": (0.8, 0.0, 1.0)}, tube)
    hole = fb.AnnularStop("C", KelvinVoigt(1e5, 50.0), 1e-3, directions=("y", "z"))
    push = [fb.PointForce("C", fb.Harmonic(200.0, 60.0), direction=one) for one in ("y", "z")]
    scene = fb.Scene(frame, [fb.Clamped("A")], masses=[fb.LumpedMass("C", 5.0)], stops=[hole], forces=push,
                     damping=fb.ModalDamping(0.02))  # fmt: skip
    found, step = simulated(scene, 3).sensitivity(path).displacement("C", "y"), 1e-5
    near = [simulated(with_value(scene, path, h), 3).displacement("C", "y") for h in (step, -step)]
    expected = (near[0] - near[1]) / (2.0 * step)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_a_foundation_of_zero_beside_a_far_stiffer_body():
    """Steps from 0 went by the highest frequency of all bodies, to 1e6 N/m², and were refused as not smooth."""
    slow = fb.Scene(fb.Beam(0.2, BAR), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.03))
    scene = fb.Scene(
        fb.Beam(0.25, BAR),
        [fb.Clamped(0.0, motion={"y": fb.Harmonic(1e-3, 130.0)})],
        elements=[fb.Element(0.1, KelvinVoigt(1e3, 1.0), to=(1, 0.1))],
        damping=fb.ModalDamping(0.02),
        bodies=[slow],
    )
    path, runs = "bodies[0].beam.foundation", {}
    for h in (0.0, 10.0, 20.0):
        runs[h] = simulated(with_value(scene, path, h)).displacement(0.25)
    expected = (4.0 * runs[10.0] - 3.0 * runs[0.0] - runs[20.0]) / 20.0
    found = simulated(scene).sensitivity(path).displacement(0.25)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3 * np.abs(expected).max())


def test_a_place_that_a_shorter_beam_does_not_have():
    """Of the tip it said that 0.25 m is not on the beam, as if the place asked for were wrong."""
    beam = fb.Beam(0.25, fb.Section.circle(2.0e11, 7800.0, 0.01))
    scene = fb.Scene(beam, [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 100.0), damping=fb.ModalDamping(0.02))
    found = scene.reduce(modes=1).simulate(0.01, 1e-3).sensitivity("beam.length")
    assert found.displacement(0.2).any()
    with pytest.raises(ValueError, match=r"no derivative by beam.length of what is at 0.25, which is not there at"):
        found.displacement(0.25)


def test_the_first_point_of_a_table():
    """It is always (0, 0), and moving it adds a point: that ended in the words of NumPy."""
    run = simulated(rig(Tabulated([0.0, 1e-4, 1e-3], [0.0, 2.0, 50.0])), duration=0.06)
    assert len(run.contacts)
    with pytest.raises(ValueError, match="no derivative: the law of contact 0 has more numbers at one value"):
        run.sensitivity("stops[0].law.indentation[0]")


def test_what_is_no_number_is_refused_by_name():
    """Text, complex numbers, ragged rows and lists of paths ended in the words of NumPy or of Python."""
    run, law = simulated(rig(), duration=0.01, dt=1e-3), Polynomial([2e4])
    for values in ("fast", [1j], [[1.0], [1.0, 2.0]]):
        with pytest.raises(ValueError, match="start must be real numbers"):
            run.sensitivity(start=values)
        with pytest.raises(ValueError, match="amplitudes must be real numbers"):
            fb.study.equivalent(law, values)
        with pytest.raises(ValueError, match="levels must be real numbers"):
            fb.study.backbone(run.model, values, (50.0, 200.0))
        with pytest.raises(ValueError, match="spins must be real numbers"):
            rig().campbell(values)
    with pytest.raises(ValueError, match="parameter must be the path of one number"):
        run.sensitivity(["stops[0].gap"])
    with pytest.raises(ValueError, match="constraints must be"):
        fb.study.minimise(rig(), {"stops[0].gap": (1e-4, 1e-3)}, "rms", [3.0], duration=0.01, dt=1e-3)


def shaft(stiffer, **options):
    """A round shaft whose bearings are equal but for one, across neither of the two planes of its modes."""
    bar = fb.Frame.straight(0.8, fb.Section.circle(2.1e11, 7850.0, 0.03), bending_only=True, spin=300.0)
    ways = ("x", (0.6, 0.8, 0.0)), ("y", (-0.8, 0.6, 0.0))
    springs = [fb.Spring(at, 2e6, direction=way) for both in ways for at, way in zip("BA", both, strict=True)]
    springs.append(fb.Spring("A", stiffer, direction=(0.6, 0.8, 0.0)))
    return fb.Scene(bar, [], springs=springs, forces=[fb.Unbalance("B", 3e-4)], **options)


HOLE = fb.AnnularStop("B", KelvinVoigt(1e6, 50.0), 4e-6, directions=("x", "y"))


@pytest.mark.parametrize("stiffer", [1e2, 1e3, 4e3])
@pytest.mark.parametrize("stops", [[], [HOLE]])
def test_modes_that_turn_among_themselves(stops, stiffer):
    """Of one frequency, or within 0.1 %: with a hole refused as not smooth, without one off by up to 1000 times."""
    scene, options = shaft(stiffer, stops=stops, damping=fb.ModalDamping(0.02)), {"modes": 4, "duration": 0.03}
    run = simulated(scene, **options)
    assert bool(len(run.contacts)) == bool(stops)
    for path in ("springs[1].stiffness", "springs[2].stiffness", "springs[4].stiffness"):
        found = run.sensitivity(path)
        for way in "xy":
            by_differences = differences(scene, path, 40.0, lambda one, way=way: one.displacement("B", way), **options)
            size = np.abs(by_differences).max()
            np.testing.assert_allclose(found.displacement("B", way), by_differences, rtol=0.0, atol=2e-5 * size)


def test_modes_that_turn_with_damping_of_their_own():
    """The damping of each jumps where they change places."""
    run = simulated(shaft(1e3, damping=fb.ModalDamping([0.02, 0.01])), 4, 0.01)
    with pytest.raises(ValueError, match="modes change places here: give them one damping ratio"):
        run.sensitivity("springs[1].stiffness")
