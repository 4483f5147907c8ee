"""Synchronous rub: published numbers, closed form, runs, multipliers of orbits, growth of disturbances, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt
from fembeam.model.rub import QUARTER, quarter_turn, synchronous_rub

MASS, DAMPING, STIFFNESS, WALL, CLEARANCE, ECCENTRICITY = 2.0, 60.0, 8e4, 3e5, 2e-4, 1e-4
METHOD = solvers.DormandPrince(1e-10)
PLANE = np.eye(2)
SHAFT = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), spin=200.0, bending_only=True)


def disk(mu=0.15):
    """A disk on a flexible shaft by its matrices."""
    hole = solvers.Contact(PLANE, KelvinVoigt(WALL, 0.0), CLEARANCE, map="annulus", friction=solvers.Friction(mu, 1e5))
    return solvers.System(MASS * PLANE, DAMPING * PLANE, STIFFNESS * PLANE, [hole])


def push(omega):
    return MASS * ECCENTRICITY * omega**2


def as_scene(omega, mu=0.15, k_t=1e5):
    """The same as a structure driven by two forces a quarter apart; without friction for None."""
    body = fb.Structure(STIFFNESS * PLANE, MASS * PLANE, DAMPING * PLANE, labels=[("D", "x"), ("D", "y")],
                        nodes={"D": (0, 0, 0)})  # fmt: skip
    rub = None if mu is None else fb.Friction(mu, k_t)
    hole = fb.AnnularStop("D", KelvinVoigt(WALL, 0.0), CLEARANCE, directions=("x", "y"), friction=rub)
    drive = [fb.PointForce("D", fb.Harmonic(push(omega), omega, phase), direction=way)
             for way, phase in (("x", 0.0), ("y", -0.5 * np.pi))]  # fmt: skip
    return fb.Scene(body, stops=[hole], forces=drive)


def overhung(law=KelvinVoigt(2e6, 300.0), mu=0.05, body=SHAFT, moment=1e-3, **options):  # noqa: B008
    """A disk at the end of a clamped shaft in its housing."""
    hole = fb.AnnularStop("B", law, 2e-4, friction=fb.Friction(mu, 2e6), radius=0.02)
    given = {"stops": [hole], "forces": [fb.Unbalance("B", moment, 0.7)], **options}
    return fb.Scene(body, [fb.Clamped("A")], [fb.Disk("B", 12.0, 0.04, 0.075)], damping=fb.ModalDamping(0.02), **given)


@pytest.mark.parametrize(
    ("omega", "radius", "pairs"),
    [
        (180.0, 2.090913226729e-4, [-0.260825 + 542.232341j, -29.739175 + 85.384998j]),
        (220.0, 2.410678947996e-4, [2.10256 + 587.888557j, -32.10256 + 82.920270j]),
    ],
)
def test_a_disk_with_the_force_of_textbooks(omega, radius, pairs):
    """|(k - mΩ² + k_c (1 - g/r)) + i (cΩ + μk_c (1 - g/r))| r = m e Ω²"""
    found = synchronous_rub(disk(), omega, QUARTER, np.array([push(omega), 0.0]), lever=False)
    assert found.radius == pytest.approx(radius, rel=1e-10)
    for value in pairs:
        assert np.abs(found.eigenvalues - value).min() < 1e-6 * abs(value)
        assert np.abs(found.eigenvalues - np.conj(value)).min() < 1e-6 * abs(value)
    assert found.stable == (omega == 180.0)


@pytest.mark.parametrize("omega", [180.0, 220.0, 260.0])
def test_a_disk_in_closed_form(omega):
    """The same with μN c/r, whose power is F_t ξ̇."""
    found = as_scene(omega).reduce(modes=2).rub(omega)

    def apart(r):
        wall = WALL * (1.0 - CLEARANCE / r)
        stiffness = STIFFNESS - MASS * omega**2 + wall + 1j * (DAMPING * omega + 0.15 * wall * CLEARANCE / r)
        return abs(stiffness) * r - push(omega)

    r = brentq(apart, CLEARANCE, 10.0 * CLEARANCE, xtol=1e-18)
    assert found.radius == pytest.approx(r, rel=1e-9)
    assert found.force == pytest.approx(WALL * (r - CLEARANCE), rel=1e-7)
    assert found.friction == pytest.approx(0.15 * found.force, rel=1e-12)
    assert found.power == pytest.approx(found.friction * CLEARANCE * omega, rel=1e-12)


def test_runs_from_a_rub_stay_in_it():
    """Of a shaft with its gyroscopic moments and torsion, an unbalance at an angle; of a law that grows as Hertz's."""
    for law, body, modes in ((KelvinVoigt(2e6, 300.0), SHAFT, 4), (Hertz(3e8), replace(SHAFT, bending_only=False), 5)):
        model = overhung(law, body=body).reduce(modes=modes)
        found = model.rub()
        assert found.stable
        run = model.simulate(0.1, 1e-3, found.state, solver=METHOD)
        r = np.linalg.norm(run.place_in_clearance(), axis=1)
        np.testing.assert_allclose(r, found.radius, rtol=1e-7)
        np.testing.assert_allclose(run.friction()[1:], found.friction, rtol=1e-4)
        np.testing.assert_allclose(run.sliding_speed(), found.sliding_speed, rtol=1e-4)
        np.testing.assert_allclose(np.linalg.norm(run.force()[1:], axis=1),
                                   np.hypot(found.force, found.friction * 2e-4 / found.radius), rtol=1e-4)  # fmt: skip
        if "rz" in run.shapes.components:
            twist = run.displacement("B", "rz")
            assert np.ptp(twist) < 1e-3 * np.abs(twist).max()
        assert run.losses.friction[0] == pytest.approx(0.1 * found.power, rel=1e-3)


def test_backward_spin_mirrors():
    """Turned about y: the same radius and growth."""
    forward = overhung().reduce(modes=4).rub(210.0)
    backward = overhung().reduce(modes=4).rub(-210.0)
    assert backward.radius == pytest.approx(forward.radius, rel=1e-9)
    assert backward.growth == pytest.approx(forward.growth, rel=1e-7)
    assert backward.friction == pytest.approx(-forward.friction, rel=1e-9)
    run = overhung(body=replace(SHAFT, spin=-210.0)).reduce(modes=4).simulate(0.02, 1e-3, backward.state, solver=METHOD)
    np.testing.assert_allclose(np.linalg.norm(run.place_in_clearance(), axis=1), backward.radius, rtol=1e-7)


def test_without_friction_the_orbit_has_its_multipliers():
    model = as_scene(180.0, None).reduce(modes=2)
    found, orbit = model.rub(180.0), model.orbit()
    np.testing.assert_allclose(np.linalg.norm(orbit.state[:2]), np.linalg.norm(found.state[:2]), rtol=1e-9)
    for value in np.exp(2.0 * np.pi / 180.0 * found.eigenvalues):
        assert np.abs(orbit.multipliers - value).min() < 1e-7


def test_a_branch_over_the_spin_follows_the_rub():
    """Its orbits, in slip all the way, have the size of the equilibrium and the multipliers exp(2πλ/Ω)."""
    model = overhung().reduce(modes=2)
    branch = model.branch("beam.spin", (195.0, 215.0), start=model.rub(200.0).state, at=200.0, step=0.9).run()
    assert branch.parameter[[0, -1]].tolist() == [195.0, 215.0]
    for orbit in branch.orbits:
        found = model.rub(orbit.parameter)
        np.testing.assert_allclose(np.linalg.norm(orbit.state[:2]), np.linalg.norm(found.state[:2]), rtol=1e-9)
        for value in np.exp(2.0 * np.pi / orbit.parameter * found.eigenvalues):
            assert np.abs(orbit.multipliers - value).min() < 1e-7


def test_small_disturbances_grow_as_the_eigenvalues_say():
    """Unstable with much friction: the whirl leaves its circle as exp(growth t), beside what dies away."""
    model = as_scene(220.0, 0.3, 1e9).reduce(modes=2)  # a slider that is soon drawn
    found = model.rub(220.0)
    fast = found.eigenvalues[:2]
    assert not found.stable
    assert found.growth > 5.0
    start = found.state * (1.0 + np.array([1e-6, 2e-6, 0.0, 0.0]))
    run = model.simulate(0.3, 2e-4, start, solver=METHOD)
    turned = run.place_in_clearance() @ np.array([1.0, 1.0j]) * np.exp(-220.0j * run.t)
    off = np.abs(turned - found.radius * np.exp(1j * found.angle))
    window = 2.0 * np.pi / abs(fast.imag).max()
    peaks = [off[(run.t >= at) & (run.t < at + window)].max() for at in (0.1, 0.28)]
    assert np.log(peaks[1] / peaks[0]) / 0.18 == pytest.approx(found.growth, rel=0.03)


def test_more_modes_settle():
    radii = [overhung().reduce(modes=n).rub().radius for n in (2, 4, 8)]
    assert abs(radii[2] - radii[1]) < 0.1 * abs(radii[1] - radii[0])


def test_several_rubs_of_one_spin():
    model = overhung().reduce(modes=4)
    largest = model.rub(300.0)
    assert len(largest.radii) == 2
    other = model.rub(300.0, near=2e-4)
    assert (other.radius, largest.radius) == largest.radii
    assert largest.stable
    assert not other.stable
    assert "radius" in str(largest)
    with pytest.raises(solvers.OrbitError, match="no synchronous rub at 150 rad/s: the unbalance alone whirls at"):
        model.rub(150.0)


def test_laws_whose_damping_goes_by_the_entry_need_its_speed():
    model = overhung(Hysteretic.lankarani_nikravesh(3e8, 0.6)).reduce(modes=4)
    with pytest.raises(ValueError, match=r"damping of this law goes by the speed of entry, .*give entry_rate"):
        model.rub()
    slow, quick = model.rub(entry_rate=0.01), model.rub(entry_rate=0.1)
    assert slow.radius == pytest.approx(quick.radius, rel=1e-12)
    assert slow.growth < quick.growth


def test_a_rotor_without_damping_has_its_rub():
    """It was refused as not round: gyroscopic moments have nothing on the diagonal to compare with."""
    twisted = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), spin=200.0)
    for body, options in ((SHAFT, {"modes": 4}), (twisted, {"modes": 5, "residual": True})):
        scene = overhung(body=body)
        none, hardly = (replace(scene, damping=fb.ModalDamping(zeta)).reduce(**options).rub() for zeta in (0.0, 1e-7))
        assert none.radius == pytest.approx(hardly.radius, rel=1e-3)
        apart = np.abs(none.eigenvalues[:, None] - hardly.eigenvalues).min(axis=1)
        assert np.all(apart < 1e-5 * np.abs(none.eigenvalues) + 1e-3)


def test_rounding_of_the_static_twist_makes_no_rotor_unround():
    """The gyroscopic moments of that shape are rounding: three of 320 drawn rotors lacked 3e-6 to 6e-6."""
    body = fb.Frame.straight(0.395, fb.Section.tube(2.1e11, 7850.0, 0.0342, 0.0239), spin=174.0)
    places, disks = (0.173, 0.201), [fb.Disk(0.201, 4.41, 0.0242, 0.0154), fb.Disk(0.244, 2.58, 0.0112, 0.0056)]
    hole = fb.AnnularStop(0.201, Hertz(9e8), 1e-6, friction=fb.Friction(0.3, 1e6), radius=0.023)
    push = [fb.Unbalance(z, 1e-3, phase) for z, phase in zip(places, (1.9, 2.4), strict=True)]
    scene = fb.Scene(body, [fb.Clamped("A")], disks, stops=[hole], forces=push, damping=fb.ModalDamping(0.02))
    more, fewer = (scene.reduce(modes=modes, residual=True).rub() for modes in (8, 5))
    assert more.radius == pytest.approx(fewer.radius, rel=1e-3)


def test_a_rotor_that_can_turn_freely_is_refused():
    """Friction drives its twist ever faster: a rub was told, with a twist of 1e25."""
    body = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), spin=200.0)
    ends = [fb.Pinned("A"), fb.Pinned("B")]
    hole = fb.AnnularStop(0.2, Hertz(1e9), 1e-5, friction=fb.Friction(0.1, 1e6), radius=0.02)
    scene = fb.Scene(body, ends, [fb.Disk(0.2, 12.0, 0.04, 0.075)], stops=[hole], forces=[fb.Unbalance(0.2, 1e-2)])
    with pytest.raises(ValueError, match="the rotor must be held, also in twist"):
        scene.reduce(modes=3).rub()
    alone = replace(scene, beam=replace(body, bending_only=True))
    assert alone.reduce(modes=2).rub().radius > 1e-5


@pytest.mark.filterwarnings("ignore:3 modes cut a pair")
def test_what_is_not_round_is_refused():
    model = overhung().reduce(modes=4)
    J = quarter_turn(model)
    np.testing.assert_allclose(J @ J, -np.eye(4), atol=1e-9)
    hole = model.scene.stops[0]
    for scene, modes, message in (
        (overhung(springs=[fb.Spring("B", 1e4, direction="x")]), 4, "needs a round rotor .* got 'a lack of"),
        (overhung(dashpots=[fb.Dashpot("B", 50.0, direction="x")]), 4, "needs a round rotor"),
        (overhung(), 3, "needs a round rotor"),
        (overhung(stops=[]), 4, "needs one AnnularStop"),
        (overhung(stops=[fb.Stop("B", Hertz(1e8), direction="x")]), 4, "needs one AnnularStop"),
        (overhung(stops=[hole, replace(hole, z=0.3)]), 4, "needs one AnnularStop"),
        (overhung(stops=[replace(hole, centre=(1e-5, 0.0))]), 4, "the circle must lie round the axis"),
        (overhung(gravity=(0.0, -9.81, 0.0)), 4, "the loads must be an unbalance"),
        (overhung(forces=[]), 4, "the loads must be an unbalance"),
        (overhung(forces=[fb.PointForce("B", fb.Harmonic(9.0, 200.0), direction="x")]), 4, "the loads must be an unb"),
    ):
        with pytest.raises(ValueError, match=message):
            scene.reduce(modes=modes).rub()
    for spin in (0.0, np.nan):
        with pytest.raises(ValueError, match="spin must"):
            model.rub(spin)
    with pytest.raises(ValueError, match="spin must be given for a body that has none"):
        as_scene(180.0).reduce(modes=2).rub()


def test_derivatives_of_a_rub_by_the_spin():
    """The period follows the spin, as unbalances do: it was held, and the derivative off by 2.6 times its size."""
    spin, h = 200.0, 0.02
    model = overhung(mu=0.1).reduce(modes=4)
    found = model.orbit(start=model.rub().state).sensitivity("beam.spin")
    assert found.period == pytest.approx(-2.0 * np.pi / spin**2, rel=1e-9)
    before, after = (model.rub(spin + d).state for d in (-h, h))
    expected = (after - before) / (2.0 * h)
    np.testing.assert_allclose(found.state, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())
