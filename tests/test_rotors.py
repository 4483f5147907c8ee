"""Rotors of scenes: whirl of the exact shaft, Campbell diagrams, unbalance, identities of turned shafts, bad input."""

import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import brentq

import fembeam as fb
from contacts import Hertz, KelvinVoigt
from fembeam import plot, scene_file
from fembeam.scene import value_of, with_signals, with_value
from fembeam.scene.parameters import scalars

SECTION = fb.Section.circle(2.1e11, 7850.0, 0.04)
LENGTH, DISK = 0.5, fb.Disk("B", mass=12.0, diametral=0.04, polar=0.075)
SPEEDS = np.array([0.0, 150.0, 300.0])


def rotor(spin=300.0, **parts):
    shaft = fb.Frame.straight(LENGTH, SECTION, spin=spin, bending_only=True)
    return fb.Scene(shaft, [fb.Clamped("A")], masses=[DISK], **parts)


def determinant(omega, spin, disk=DISK):
    """Of the exact Rayleigh shaft, u = u_x + i u_y, and the disk: zero at a forward whirl ω > 0 or a backward one < 0.

    EI u'''' + ρI (ω² - 2Ωω) u'' = ρA ω² u;  EI u'' = (I_d ω² - I_p Ω ω) u', EI u''' + ρI (ω² - 2Ωω) u' = -m ω² u.
    """
    EI, rho_A, turn = SECTION.bending_stiffness, SECTION.line_mass, 7850.0 * SECTION.I * (omega**2 - 2.0 * spin * omega)
    squares = np.roots([EI, turn, -rho_A * omega**2])
    roots = np.concatenate([s * np.sqrt(squares.astype(complex)) for s in (1.0, -1.0)])
    at_end = np.exp(roots * LENGTH)
    rows = [
        np.ones(4),
        roots,
        (EI * roots**2 - (disk.diametral * omega**2 - disk.polar * spin * omega) * roots) * at_end,
        (EI * roots**3 + turn * roots + disk.mass * omega**2) * at_end,
    ]
    scaled = np.array([row / np.abs(row).max() for row in rows])
    return np.linalg.det(scaled) / np.prod(roots[:2]) / (squares[0] - squares[1])


def exact(near, spin):
    """The root of the real or imaginary part next to a value; spin None: that of the frequency itself."""

    def value(omega):
        found = determinant(omega, omega if spin is None else spin)
        return found.imag if abs(found.imag) > abs(found.real) else found.real

    return brentq(value, *sorted((0.9999 * near, 1.0001 * near)), xtol=1e-12 * abs(near))


# --- Campbell diagrams ------------------------------------------------------------------------------------------------


def test_frequencies_are_those_of_the_exact_shaft():
    found = rotor().campbell(SPEEDS, modes=4)
    assert found.signed.shape == (3, 4)
    for spin, row in zip(SPEEDS, found.signed, strict=True):
        for omega in row:
            assert omega == pytest.approx(exact(omega, spin), rel=2e-6)


def test_critical_speeds_are_where_the_whirl_has_the_spin():
    found = rotor().campbell([0.0, 6000.0], modes=4)
    assert len(found.critical) >= 4
    for speed in found.critical:
        assert speed == pytest.approx(exact(speed, abs(speed)), rel=2e-6)
    forward = found.critical[found.critical > 0.0]
    at_speed = rotor().campbell([forward[0]], modes=2)
    assert at_speed.signed.max() == pytest.approx(forward[0], rel=1e-9)


def test_a_disk_that_spins_fast():
    """It turns the shaft sharply, which few modes at standstill do not: as good as with modes to spare."""
    mass = SECTION.line_mass * LENGTH
    disk = fb.Disk("B", 0.25 * mass, diametral=0.003 * mass * LENGTH**2, polar=0.006 * mass * LENGTH**2)
    stiffness = 3.0 * SECTION.bending_stiffness / LENGTH**3
    springs = [fb.Spring(at, share * stiffness, direction=way) for at, share in (("A", 20), ("B", 400)) for way in "xy"]
    shaft = fb.Frame.straight(LENGTH, SECTION, bending_only=True)
    few, many = (fb.Scene(shaft, [], masses=[disk], springs=springs).campbell([15e3], modes) for modes in (2, 24))
    np.testing.assert_allclose(few.signed, many.signed[:, :2], rtol=5e-6)


def test_a_housing_that_moves_leaves_the_diagram_as_it_is():
    housing = fb.Frame({"S": (0.3, 0, 0.5), "T": (0.1, 0, 0.5)}, [fb.Member("S", "T", SECTION)])
    stop = fb.AnnularStop("B", KelvinVoigt(2e6, 300.0), 1e-4, on=(1, "T"), directions=("x", "y"))
    scene = rotor(bodies=[fb.Scene(housing, [fb.Clamped("S")])], stops=[stop])
    np.testing.assert_array_equal(scene.campbell([0.0, 300.0]).signed, rotor().campbell([0.0, 300.0]).signed)


def test_twist_and_stretch_are_no_critical_speeds():
    """They meet the spin at their own frequencies, which no unbalance excites."""
    shaft = fb.Frame.straight(LENGTH, SECTION)
    found = fb.Scene(shaft, [fb.Clamped("A")], masses=[DISK]).campbell([0.0, 3000.0], modes=4)
    np.testing.assert_allclose(found.critical, rotor().campbell([0.0, 3000.0], modes=4).critical, rtol=1e-6)


def test_many_spins_of_a_diagram_need_little_memory():
    """Shapes of each spin are not kept: 0.5 MB each."""
    rotor().campbell([0.0], modes=2)
    tracemalloc.start()
    found = rotor().campbell(np.linspace(0.0, 400.0, 60), modes=2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.omega.shape == (60, 2)
    assert peak < 15e6


def test_table_text_and_figure(tmp_path):
    found = rotor().campbell(np.linspace(0.0, 400.0, 5), modes=2)
    rows = found.table()
    assert [row["spin"] for row in rows] == [0.0, 100.0, 200.0, 300.0, 400.0]
    assert rows[3]["mode 1"] < 0.0 < rows[3]["mode 2"]
    found.save(tmp_path / "rotor.csv")
    head, *_ = (tmp_path / "rotor.csv").read_text(encoding="utf-8").splitlines()
    assert head == "spin [rad/s],mode 1 [rad/s],mode 2 [rad/s]"
    assert "critical speeds: 211.048 rad/s (backward), 221.961 rad/s (forward)" in str(found)
    axis = found.figure().axes[0]
    labels = [text.get_text() for text in axis.get_legend().get_texts()]
    assert labels == ["forward", "backward", "ω = Ω", "critical speeds"]
    assert plot.campbell(found).axes[0].get_ylabel() == "frequency ω / rad s⁻¹"


def test_motion_on_a_line_has_no_sense():
    """Bearings of two stiffnesses: at standstill the modes move on lines; stretch and twist of a full frame too."""
    springs = [fb.Spring("B", k, direction=way) for k, way in ((4e5, "x"), (9e5, "y"))]
    found = replace(rotor(), springs=springs).campbell([0.0, 300.0], modes=2)
    assert found.turning[0].tolist() == [0, 0]
    assert sorted(found.turning[1].tolist()) == [-1, 1]
    full = fb.Scene(fb.Frame.straight(LENGTH, SECTION), [fb.Fixed("A", "x", "y", "z", "rx", "ry")], masses=[DISK])
    lines = full.campbell([300.0], modes=4)  # its own rotation is a rigid motion and no mode
    np.testing.assert_allclose(lines.signed[0, :2], rotor().campbell([300.0], modes=2).signed[0], rtol=1e-6)
    assert lines.omega.min() > 100.0


@pytest.mark.parametrize("way", [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.36, 0.48, -0.8)])
def test_a_shaft_turned_in_space_whirls_the_same(way):
    nodes = {"A": (0.1, 0.2, 0.3), "B": tuple(np.array([0.1, 0.2, 0.3]) + LENGTH * np.array(way))}
    shaft = fb.Frame.polyline(nodes, SECTION)
    scene = fb.Scene(shaft, [fb.Clamped("A")], masses=[DISK])
    expected = rotor().campbell(SPEEDS, modes=2)
    found = scene.campbell(SPEEDS, modes=2)
    np.testing.assert_allclose(found.signed, expected.signed, rtol=1e-6)
    np.testing.assert_allclose(found.critical, expected.critical, rtol=1e-6)


# --- unbalance --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spin", [150.0, -150.0, 300.0])
def test_an_unbalance_whirls_the_shaft_on_a_circle(spin):
    """Its radius is that of one plane's disk of inertia I_d - I_p, driven by m e Ω²."""
    scene = rotor(spin, forces=[fb.Unbalance("B", 1e-4)], damping=fb.ModalDamping(0.02))
    model = scene.reduce(6)
    n = len(model.omega)
    Z = np.zeros(n, dtype=complex)
    for vector, signal in model.system.loads:
        Z += np.asarray(vector) * signal.tones()[1][0]
    A = np.diag(model.omega**2 - spin**2) + 1j * abs(spin) * model.system.by_rate
    q = np.linalg.solve(A, Z)
    start = np.concatenate([q.real, (1j * abs(spin) * q).real])
    run = model.simulate(0.2, 1e-3, start)
    x, y = run.displacement("B", "x"), run.displacement("B", "y")
    np.testing.assert_allclose(np.hypot(x, y), np.hypot(x, y)[0], rtol=1e-9)
    turned = x[:-1] * np.diff(y) - y[:-1] * np.diff(x)
    assert np.all(np.sign(turned) == np.sign(spin))


def test_an_unbalance_follows_the_spin():
    scene = rotor(forces=[fb.Unbalance("B", 1e-4, phase=0.3)])
    assert [force.signal.amplitude for force in scene.forces] == [9.0, 9.0]
    faster = replace(scene, beam=replace(scene.beam, spin=600.0))
    assert [force.signal.amplitude for force in faster.forces] == [36.0, 36.0]
    assert [force.signal.omega for force in faster.forces] == [600.0, 600.0]
    again = replace(faster, beam=scene.beam)
    assert again.forces == scene.forces
    t = np.linspace(0.0, 0.1, 7)
    np.testing.assert_allclose(scene.forces[0].signal(t), 9.0 * np.cos(300.0 * t + 0.3), atol=1e-12)
    np.testing.assert_allclose(scene.forces[1].signal(t), 9.0 * np.sin(300.0 * t + 0.3), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "value"), [("moment", 3e-4), ("phase", 1.1), ("forces[0].moment", 0.0), ("forces[u].phase", -2.0)]
)
@pytest.mark.parametrize("spin", [300.0, -300.0])
def test_a_parameter_of_an_unbalance_changes_both_of_its_forces(name, value, spin):
    """One along e₁ was changed alone, so that what turned became an ellipse, and a phase changed nothing."""
    given = {"moment": 1e-4, "phase": 0.3}
    scene = rotor(spin, forces=[fb.Unbalance("B", name="u", **given)])
    asked = {**given, name.split(".")[-1]: value}
    fresh = rotor(spin, forces=[fb.Unbalance("B", name="u", **asked)])
    changed = with_value(scene, name, value)
    assert changed.forces == fresh.forces
    assert with_value(changed, name, value_of(scene, name)).forces == scene.forces
    known = [path for path in scalars(scene) if path.startswith("forces")]
    assert known == ["forces[0].moment", "forces[0].phase"]
    with pytest.raises(ValueError, match="no such parameter"):
        with_value(scene, "forces[0].signal.amplitude", 2.0)


def test_a_response_is_linear_in_its_unbalance():
    """Also by its exact derivative, along both directions: it was 1.14 and 0.56 of that."""
    scene = rotor(200.0, forces=[fb.Unbalance("B", 1e-3), fb.PointForce("B", fb.Harmonic(0.0, 9.0), direction="x")])
    run = scene.reduce(2).simulate(0.2, 1e-3)
    found = run.sensitivity("forces[0].moment")
    for way in "xy":
        expected = run.displacement("B", way) / 1e-3
        np.testing.assert_allclose(found.displacement("B", way), expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("path", ["forces[0].phase", "forces[2].direction[0]"])
def test_a_derivative_by_a_phase_or_direction_of_a_load_that_is_zero(path):
    """Steps from 0 went by the modes, which these leave alone, up to 1e6 rad: of the phase 1e-6 of it was found."""
    beside = fb.PointForce("B", fb.Harmonic(3.0, 170.0), direction=(0.0, 1.0, 0.0))
    scene = rotor(200.0, forces=[fb.Unbalance("B", 1e-3), beside])
    found = scene.reduce(2).simulate(0.1, 1e-3).sensitivity(path)
    near = [with_value(scene, path, h).reduce(2).simulate(0.1, 1e-3) for h in (1e-4, -1e-4)]
    for way in "xy":
        expected = (near[0].displacement("B", way) - near[1].displacement("B", way)) / 2e-4
        np.testing.assert_allclose(found.displacement("B", way), expected, atol=1e-5 * np.abs(expected).max() + 1e-14)


def test_the_static_share_of_an_unbalance_is_that_of_a_force_along_each_axis():
    beside = [fb.PointForce("B", fb.Harmonic(1.0, 9.0), direction=way) for way in ("x", "y")]
    shares = rotor(forces=[fb.Unbalance("B", 1e-3), *beside]).reduce(4).static_share
    assert shares[:2].tolist() == shares[2:].tolist()
    assert 0.9 < shares[0] < 1.0


def test_a_signal_made_of_that_of_an_unbalance_stays():
    """As that of an orbit from a later time on, whose phase alone differs."""
    scene = rotor(forces=[fb.Unbalance("B", 1e-4, phase=0.3)])
    later = with_signals(scene, lambda signal: replace(signal, phase=signal.phase + 1.0))
    assert [force.signal.phase for force in later.forces] == pytest.approx([1.3, 1.3 - 0.5 * np.pi])
    assert with_value(later, "gravity", 9.81).forces == later.forces


# --- runs -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spin", [220.0, -220.0])
def test_the_clamp_turns_the_angular_momentum_of_the_disk(spin):
    """On a shaft without mass: M_x = I_d θ_x'' + I_p Ω θ_y' - L m a_y + L f_y about the clamp, M_y alike."""
    shaft = fb.Frame.straight(LENGTH, replace(SECTION, rho=1e-3), spin=spin, bending_only=True)
    scene = fb.Scene(shaft, [fb.Clamped("A")], masses=[DISK], forces=[fb.Unbalance("B", 1e-4)])
    run = scene.reduce(4).simulate(0.1, 1e-3)
    (x, y), (turn_x, turn_y) = ([run.acceleration("B", r + way) for way in "xy"] for r in ("", "r"))
    push_x, push_y = (DISK.mass * a - force.signal(run.t) for a, force in zip((x, y), scene.forces, strict=True))
    spun = DISK.polar * spin
    expected = [
        DISK.diametral * turn_x + spun * run.velocity("B", "ry") - LENGTH * push_y,
        DISK.diametral * turn_y - spun * run.velocity("B", "rx") + LENGTH * push_x,
    ]
    found = run.reactions()[0].moment[:, :2].T
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(found).max())


def test_a_stop_on_the_housing_is_met_as_by_another_method():
    from solvers import DormandPrince

    stop = fb.Stop("B", Hertz(1e9), gap=1e-5, direction="x", name="housing")
    model = rotor(200.0, forces=[fb.Unbalance("B", 1e-4)], stops=[stop], damping=fb.ModalDamping(0.02)).reduce(4)
    run = model.simulate(0.15, 1e-3)
    other = model.simulate(0.15, 1e-3, solver=DormandPrince(1e-11, 1e-16))
    assert len(run.contacts) == len(other.contacts) >= 3
    np.testing.assert_allclose(run.q, other.q, atol=1e-5 * np.abs(run.q).max())
    assert np.abs(run.energy.residual).max() < 1e-7 * np.abs(run.energy.input).max()


HOUSING = fb.Stop("B", KelvinVoigt(2e6, 300.0), gap=1e-4, direction="x", name="housing")


def test_a_model_at_another_spin_is_that_of_its_scene():
    """Nothing but G and the unbalance changes: the modes at standstill are kept."""
    scene = rotor(200.0, forces=[fb.Unbalance("B", 1e-4)], stops=[HOUSING])
    other = replace(scene, beam=replace(scene.beam, spin=-260.0))
    kept, fresh = scene.reduce(4).again(other), other.reduce(4)
    np.testing.assert_array_equal(kept.basis.vectors, scene.reduce(4).basis.vectors)
    np.testing.assert_allclose(np.sqrt(kept.system.blocks.k), np.sqrt(fresh.system.blocks.k), rtol=1e-9)
    assert kept.scene.beam.spin == kept.matrices.beam.spin == -260.0
    ends = [model.simulate(0.02, 1e-3).displacement("B", "y") for model in (kept, fresh)]
    np.testing.assert_allclose(*ends, atol=1e-9 * np.abs(ends[0]).max())
    stiffer = replace(other, springs=[fb.Spring("B", 1e5, direction="x")])
    assert scene.reduce(4).again(stiffer).omega[1] > 1.001 * kept.omega[1]


def test_a_branch_over_the_spin_finds_where_the_stop_is_met():
    """It begins where the whirl without contact, known in closed form, has the amplitude of the gap."""
    scene = rotor(213.5, forces=[fb.Unbalance("B", 1e-4)], stops=[HOUSING], damping=fb.ModalDamping(0.02))
    model = scene.reduce(2)

    def amplitude(spin):
        system = model.again(replace(scene, beam=replace(scene.beam, spin=spin))).system
        pushed = sum(np.asarray(vector) * signal.tones()[1][0] for vector, signal in system.loads)
        resisting = np.diag(np.diag(system.K) - spin**2) + 1j * spin * system.by_rate
        return abs(model.phi(("B", "x")) @ np.linalg.solve(resisting, pushed))

    met = brentq(lambda spin: amplitude(spin) - HOUSING.gap, 210.0, 220.0)
    branch = model.branch("beam.spin", (213.5, 216.0), at=213.5, step=0.2).run()
    grazings = [one.parameter for one in branch.found.special if one.mark == "grazing"]
    assert grazings[0] == pytest.approx(met, rel=1e-7)


def test_frequency_response_of_a_rotor_is_that_of_its_matrices():
    model = rotor(300.0, damping=fb.ModalDamping(0.01)).reduce(4)
    omega = np.array([100.0, 208.8, 223.9])
    found = model.frequency_response(omega, ("B", "x"), ("B", "y"))
    b, c = model.phi(("B", "x")), model.phi(("B", "y"))
    exact = [c @ np.linalg.solve(np.diag(model.omega**2 - w**2) + 1j * w * model.system.by_rate, b) for w in omega]
    np.testing.assert_allclose(found.values, exact, rtol=1e-10)
    assert abs(exact[1]) > 1e-6  # spin couples the planes


# --- bad input --------------------------------------------------------------------------------------------------------


BEAM = fb.Scene(fb.Beam(1.0, SECTION), [fb.Clamped(0.0)])
PLANE = fb.Frame.polyline({"A": (0, 0), "B": (1, 0)}, SECTION)

test_disks_and_unbalances_are_refused_in_words = refused(
    (lambda: fb.Disk("B", 1.0, 0.04, 0.09), "polar must be at most 2 × diametral, 0.08 kg m², as of a thin disk, got"),
    (lambda: fb.Disk("B", 1.0, diametral=-0.04, polar=0.0), "diametral"),
    (lambda: fb.Unbalance("B", math.nan), "moment"),
    (lambda: replace(BEAM, masses=[fb.Disk(1.0, 1.0, 0.1, 0.1)]), "a Disk needs a shaft: a straight Frame in space"),
    (lambda: fb.Scene(PLANE, [fb.Clamped("A")], masses=[DISK]), "Disk needs a shaft: a straight Frame in space"),
    (lambda: rotor(0.0, forces=[fb.Unbalance("B", 1e-4)]), "Unbalance needs a shaft that spins"),
    (lambda: replace(BEAM, forces=[fb.Unbalance(1.0, 1e-4)]), "Unbalance needs a shaft"),
)


test_campbell_arguments_are_refused = refused(
    (lambda: BEAM.campbell([0.0]), "a Campbell diagram needs one shaft: a straight Frame in space"),
    (lambda: rotor().campbell([100.0, 0.0]), r"spins must be finite and ascending"),
    (lambda: rotor().campbell([100.0], modes=0), r"modes must be a whole number above 0"),
)


def test_half_a_pair_is_told():
    with pytest.warns(UserWarning, match=r"3 modes cut a pair of one frequency, 1976.34 rad/s, .* ask for one more"):
        rotor().reduce(3)


@pytest.mark.filterwarnings("default")
def test_half_a_pair_of_each_of_two_equal_bodies_is_told():
    """Python shows a text once: of equal bodies it did not say that the second is cut, too."""
    straight = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7850.0, 0.02))
    held = fb.Scene(straight, [fb.Clamped("A")])
    with pytest.warns(UserWarning, match="cut a pair") as said:
        fb.Scene(straight, [fb.Clamped("A")], bodies=[held]).reduce(3)
    texts = [str(one.message).partition(" cut")[0] for one in said]
    assert texts == ["3 modes of the scene's own body", "3 modes of bodies[0]"]


def test_pairs_of_a_round_shaft_lie_along_x_and_y():
    model = rotor().reduce(6)
    mass = model.effective_mass
    np.testing.assert_allclose(mass[1::2, 0], 0.0, atol=1e-12 * mass.max())
    np.testing.assert_allclose(mass[::2, 1], 0.0, atol=1e-12 * mass.max())
    vectors = model.basis.vectors
    np.testing.assert_allclose(vectors.T @ (model.matrices.M @ vectors), np.eye(6), atol=1e-9)
    np.testing.assert_array_equal(model.omega[::2], model.omega[1::2])


ROTOR = """
[frame]
nodes = { A = [0, 0, 0], B = [0, 0, 0.5] }
spin = 300.0
bending_only = true
[[frame.members]]
nodes = ["A", "B"]
section = { shape = "circle", E = 2.1e11, rho = 7850, diameter = 0.04 }
[[supports]]
kind = "clamped"
at = "A"
[[masses]]
kind = "disk"
at = "B"
mass = 12.0
diametral = 0.04
polar = 0.075
[[forces]]
kind = "unbalance"
at = "B"
moment = 1e-4
"""


def test_a_rotor_in_a_scene_file(file_of):
    assert file_of(ROTOR).scene == rotor(forces=[fb.Unbalance("B", 1e-4)])


def test_the_table_campbell_writes_its_answer(tmp_path, file_of):
    file = file_of(f"{ROTOR}[campbell]\nspins = [0, 300]\npoints = 3\nmodes = 2\n")
    found = file.studies["campbell"].run(file, tmp_path)
    np.testing.assert_allclose(found.signed, rotor().campbell(SPEEDS, modes=2).signed, rtol=1e-12)
    with pytest.raises(scene_file.SceneFileError, match=r"spins must be two values, ascending"):
        file_of(f"{ROTOR}[campbell]\nspins = [300, 0]\n")


def test_half_a_pair_of_a_shaft_at_rest_is_told_and_moves_along_x():
    straight = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7850.0, 0.02))
    with pytest.warns(UserWarning, match=r"3 modes cut a pair of one frequency, 569.834 rad/s, that move") as said:
        model = fb.Scene(straight, [fb.Clamped("A")]).reduce(3)
    assert said[0].filename == __file__
    np.testing.assert_allclose(model.phi(("B", "y"))[[0, 2]], 0.0, atol=1e-8)
    assert np.all(np.abs(model.phi(("B", "x"))[[0, 2]]) > 1.0)


def test_rotor_of_nelson_and_mcvaugh():
    """Critical speeds, rpm, as H.D. Nelson, J.M. McVaugh print for isotropic bearings, J. Eng. Ind. 98 (1976) 593."""
    z = [0, 1.27, 5.08, 7.62, 8.89, 10.16, 10.67, 11.43, 12.7, 13.46, 16.51, 19.05, 22.86, 26.67, 28.7, 30.48, 31.5]
    z += [34.54, 35.5]  # cm, as all of their table
    outer = [0.51, 1.02, 0.76, 2.03, 2.03, 3.3, 3.3, 2.54, 2.54, 1.27, 1.27, 1.52, 1.52, 1.27, 1.27, 3.81, 2.03, 2.03]
    inner = {6: 1.52, 7: 1.78, 17: 1.52}
    members = []
    for i, radius in enumerate(outer):
        hole = {"outer": 0.02 * radius, "inner": 0.02 * inner[i]} if i in inner else {"diameter": 0.02 * radius}
        make = fb.Section.tube if i in inner else fb.Section.circle
        members.append(fb.Member(f"{i}", f"{i + 1}", make(2.078e11, 7806.0, **hole)))
    shaft = fb.Frame({f"{i}": (0, 0, 0.01 * x) for i, x in enumerate(z)}, members, spin=1000.0, bending_only=True)
    bearings = [fb.Spring(place, 4.378e7, direction=way) for place in ("10", "14") for way in "xy"]
    rotor = fb.Scene(shaft, masses=[fb.Disk("4", 1.401, diametral=0.00136, polar=0.002)], springs=bearings)
    found = rotor.campbell(np.linspace(0.0, 11000.0, 23)).critical * 30.0 / np.pi
    np.testing.assert_allclose(found, [-15470, 17159, -46612, 49983, -64752, 96457], rtol=7e-3)


def test_the_line_of_critical_speeds_is_that_of_either_sense():
    """Over spins of both signs it was drawn level, at the largest; a critical speed below the first spin widened it."""
    axis = rotor().campbell(np.linspace(-400.0, 400.0, 5), modes=2).figure().axes[0]
    lines = {line.get_label(): line for line in axis.lines}
    line = lines["ω = |Ω|"]
    assert np.interp([-400.0, -200.0, 0.0, 300.0], *line.get_data()).tolist() == [400.0, 200.0, 0.0, 300.0]
    x, y = lines["critical speeds"].get_data()
    assert sorted(np.round(x).tolist()) == [-222.0, -211.0, 211.0, 222.0]
    np.testing.assert_array_equal(y, np.abs(x))
    one = rotor().campbell([300.0], modes=2).figure().axes[0]
    assert "critical speeds" not in [line.get_label() for line in one.lines]
    assert one.get_xlim()[0] < 300.0 < one.get_xlim()[1]
