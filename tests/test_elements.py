"""Local elements and stops of displacement, rotation and between two places: closed forms, static shapes, units."""

import json
import re
import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, quad, simpson
from scipy.optimize import brentq

import fembeam as fb
import reduction
import solvers
from contacts import (
    BoucWen,
    Coulomb,
    Hertz,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    PiecewiseLinear,
    Polynomial,
    Tabulated,
    WaltonBraun,
    law,
)
from fembeam.plot.axis_names import axis_name
from fembeam.scene import changes_structure, with_value
from fembeam.scene_file import SceneFileError, json_schema

UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0)
PINNED = [fb.Pinned(0.0), fb.Pinned(1.0)]
FREE = fb.ModalDamping(0.0)


def beam(supports, **parts):
    return fb.Scene(fb.Beam(1.0, UNIT), supports, damping=FREE, **parts)


def frequencies(model):
    """rad/s of a model with the stiffness of its elements."""
    return np.sqrt(np.linalg.eigvalsh(model.system.K + model.linear_elements[0]))


def roots(equation, count, first):
    """The first roots of the characteristic equation, one in each π."""
    return np.array([brentq(equation, first + np.pi * i + 1e-9, first + np.pi * (i + 1) - 1e-9) for i in range(count)])


# --- rotation: a hinge with a spring and a stop ---------------------------------------------------------------------


def sprung_hinge(kappa, count=2):
    """ω of a pinned beam of unit data with EI u_zz = κ u_z at its left end: κ (cot x - coth x) = 2 x."""
    return roots(lambda x: kappa * (np.cos(x) - np.sin(x) / np.tanh(x)) - 2 * x * np.sin(x), count, np.pi) ** 2


@pytest.mark.parametrize("kappa", [1.0, 100.0, 1000.0])
def test_static_shapes_of_the_moment_make_one_mode_right(kappa):
    scene = beam(PINNED, elements=[fb.Element(0.0, KelvinVoigt(kappa, 0.0), of="rotation")])
    exact = sprung_hinge(kappa)
    assert frequencies(scene.reduce(1, residual=True))[0] == pytest.approx(exact[0], rel=2e-3)
    np.testing.assert_allclose(frequencies(scene.reduce(4, residual=True))[:2], exact, rtol=3e-5)
    np.testing.assert_allclose(frequencies(scene.reduce(3, interface=True))[:2], exact, rtol=1e-3)
    assert scene.reduce(1, residual=True).static_share == pytest.approx([1.0], rel=1e-10)
    plain = [frequencies(scene.reduce(n))[0] / exact[0] - 1 for n in (1, 8, 16)]
    assert plain[1] / plain[2] == pytest.approx(2.0, rel=0.2)  # an error like 1/N without it
    if kappa == 1000.0:
        assert plain[0] > 8.0


def test_a_run_moves_as_the_characteristic_equation_says():
    """A hinge spring as an element: the lowest eigenvector alone moves by cos(ωt)."""
    model = beam(PINNED, elements=[fb.Element(0.0, KelvinVoigt(100.0, 0.0), of="rotation")]).reduce(3, residual=True)
    omega = sprung_hinge(100.0, 1)[0]
    shape = np.linalg.eigh(model.system.K + model.linear_elements[0])[1][:, 0]
    run = model.simulate(6 * np.pi / omega, np.pi / (20 * omega), np.concatenate([1e-3 * shape, np.zeros(4)]))
    np.testing.assert_allclose(run.q, 1e-3 * np.outer(np.cos(omega * run.t), shape), atol=5e-8)
    np.testing.assert_allclose(run.force(0), 100.0 * run.slope(0.0), atol=1e-12)
    np.testing.assert_allclose(run.indentation(0), run.slope(0.0), atol=1e-15)
    assert np.abs(run.energy.residual).max() < 1e-9 * run.energy.stored[0]


@pytest.mark.filterwarnings("ignore:.*rigid-body")
def test_freeplay_period_of_a_hinge_stop():
    """A rigid bar, J = 1/3, at a hinge with freeplay: T = 4 gap/Ω + 2π √(J/κ)."""
    kappa, gap, rate = 50.0, 0.01, 0.2
    sides = [fb.Stop(0.0, KelvinVoigt(kappa, 0.0), gap, side, of="rotation") for side in ("below", "above")]
    model = beam([fb.Pinned(0.0)], stops=sides).reduce(1)
    start = model.state(velocity=lambda z: rate * z)
    period = 4 * gap / rate + 2 * np.pi * np.sqrt(1 / (3 * kappa))
    run = model.simulate(2 * period, period / 40, start)
    np.testing.assert_allclose(run.q_dot[[40, 80]], [start[1:]] * 2, rtol=1e-8)
    np.testing.assert_allclose(run.q[[40, 80]], 0.0, atol=1e-8 * gap)
    log = run.contacts
    assert log.stop.tolist() == [1, 0, 1, 0]  # it turns up first
    np.testing.assert_allclose(log.t_in[0], gap / rate, rtol=1e-9)
    np.testing.assert_allclose(log.speed_in, rate, rtol=1e-9)
    np.testing.assert_allclose(log.peak_force, rate * np.sqrt(kappa / 3), rtol=1e-8)  # κ δ, ½ κ δ² = ½ J Ω²
    assert run.slope(0.0).max() > gap
    np.testing.assert_allclose(run.indentation(0), -run.slope(0.0) - gap, atol=1e-15)


# --- two places -----------------------------------------------------------------------------------------------------


def joined(law, of="displacement"):
    """Two equal cantilevers with an element between their tips."""
    return beam([fb.Clamped(0.0)], bodies=[beam([fb.Clamped(0.0)])], elements=[fb.Element(1.0, law, of, to=(1, 1.0))])


@pytest.mark.parametrize("of", ["displacement", "rotation"])
def test_two_cantilevers_joined_at_their_tips(of):
    """Symmetric: each alone; antisymmetric: each with a spring of twice the stiffness to the ground.

    u_zz = 0, u_zzz = 2k u at the tip, or u_zzz = 0, u_zz = -2k u_z.
    """
    k = 7.0

    def ground(x, k):
        c, s, ch, sh = np.cos(x), np.sin(x), np.cosh(x), np.sinh(x)
        if of == "displacement":
            return (x**3 * (1 + c * ch) + k * (s * ch - c * sh)) / ch
        return (x * (1 + c * ch) + k * (s * ch + c * sh)) / ch

    symmetric = brentq(ground, 1.5, 2.5, (0.0,)) ** 2
    antisymmetric = brentq(ground, 1.6, 3.6, (2 * k,)) ** 2
    model = joined(KelvinVoigt(k, 0.0), of).reduce(6, residual=True)
    values, vectors = np.linalg.eigh(model.system.K + model.linear_elements[0])
    np.testing.assert_allclose(np.sqrt(values[:2]), [symmetric, antisymmetric], rtol=2e-6)
    tips = [vectors[:, i] @ np.array([model.phi(1.0), model.phi(1.0, body=1)]).T for i in (0, 1)]
    assert tips[0][0] == pytest.approx(tips[0][1], rel=1e-6)
    assert tips[1][0] == pytest.approx(-tips[1][1], rel=1e-6)
    start = np.concatenate([1e-3 * vectors[:, 1], np.zeros(len(values))])
    run = model.simulate(2 * np.pi / antisymmetric, np.pi / antisymmetric, start)
    np.testing.assert_allclose(run.q[1:], [-run.q[0], run.q[0]], atol=2e-8)


def test_a_link_of_two_places_of_one_beam_against_the_whole_mesh():
    """Elements and stops between z = 0.3 and 0.8 need the static shape of the pair of forces, one column."""
    k = 4e4
    scene = beam(PINNED, elements=[fb.Element(0.3, KelvinVoigt(k, 0.0), to=0.8)])
    model = scene.reduce(3, residual=True, elements=40)
    assert len(model.omega) == 4
    full = scene.matrices(elements=40)
    w = (full.interpolation(0.3) - full.interpolation(0.8)).toarray()
    K = full.K.toarray() + k * w.T @ w
    exact = np.sqrt(np.linalg.eigvals(np.linalg.solve(full.M.toarray(), K)).real.min())
    assert frequencies(model)[0] == pytest.approx(exact, rel=1e-5)
    assert frequencies(scene.reduce(3, elements=40))[0] > 1.001 * exact
    assert model.static_share == pytest.approx([1.0], rel=1e-9)
    gap = fb.Stop(0.3, KelvinVoigt(k, 0.0), on=0.8)
    np.testing.assert_allclose(beam(PINNED, stops=[gap]).reduce(3, residual=True).static_share, 1.0, rtol=1e-9)
    assert {0.3, 0.8} <= set(full.nodes)


def test_a_pair_of_rotation_on_one_beam_and_within_a_body():
    """A beam without bending between two places: u_z(z1) - u_z(z2) = 0 for a stiff link; rigid parts turn alike."""
    link = fb.Element(0.4, KelvinVoigt(1e7, 0.0), of="rotation", to=0.6)
    own = beam([fb.Clamped(0.0)], elements=[link]).reduce(6, residual=True)
    inside = beam([fb.Clamped(0.0)], bodies=[beam([fb.Clamped(0.0)], elements=[link])]).reduce(6, residual=True)
    np.testing.assert_allclose(frequencies(inside)[[1, 3]], frequencies(own)[:2], rtol=1e-6)
    mode = np.linalg.eigh(own.system.K + own.linear_elements[0])[1][:, 0]
    turned = own.phi(np.array([0.4, 0.6]), 1) @ mode
    assert turned[0] == pytest.approx(turned[1], rel=1e-4)


# --- nonlinear, static, several methods -----------------------------------------------------------------------------


def test_period_of_a_cubic_spring():
    """One mode at a cubic element: T = 4 ∫ dq/q̇ over a quarter, by quadrature."""
    k3, amplitude = 500.0, 0.3
    model = beam([fb.Clamped(0.0)], elements=[fb.Element(1.0, Polynomial([0.0, 0.0, k3]))]).reduce(1)
    phi, omega = model.phi(1.0)[0], model.omega[0]

    def time(angle):
        q = amplitude * np.sin(angle)
        rest = omega**2 + 0.5 * k3 * phi**4 * (amplitude**2 + q**2)  # 2 (V(a) - V(q)) = (a² - q²) rest
        return 1 / np.sqrt(rest)

    period = 4 * quad(time, 0, np.pi / 2, epsabs=1e-13)[0]
    run = model.simulate(5 * period, 5 * period / 400, [amplitude, 0.0])
    assert run.q[-1, 0] == pytest.approx(amplitude, abs=1e-7)
    assert run.q_dot[-1, 0] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(run.force(), k3 * run.displacement(1.0) ** 3, rtol=1e-12, atol=1e-12)
    assert len(run.contacts) == 0
    mean = run.force(mean=True)
    assert mean[1:-1] == pytest.approx(run.force()[1:-1], abs=5e-3 * np.abs(mean).max())


@pytest.mark.parametrize("gap", [0.0, 0.02, -0.02])
def test_equilibrium_with_an_element(gap):
    """A cantilever, 3 EI/L³ = 3, at a cubic spring under a tip load: 3u + F(u - gap) = P."""
    k, load = 1e4, -0.2
    element = fb.Element(1.0, Polynomial([5.0, 0.0, k]), gap=gap)
    model = beam([fb.Clamped(0.0)], elements=[element]).reduce(2, residual=True)
    u = brentq(lambda u: 3 * u + 5 * (u - gap) + k * (u - gap) ** 3 - load, -1, 1)
    q = model.equilibrium({1.0: load})[: len(model.omega)]
    assert q @ model.phi(1.0) == pytest.approx(u, rel=1e-8)


def test_equilibrium_at_a_hinge_spring():
    """A bar pinned at its left end hangs in a rotational element: κ θ + P = 0 to the left of what bends."""
    element = fb.Element(0.0, KelvinVoigt(40.0, 0.0), of="rotation")
    model = beam([fb.Pinned(0.0)], elements=[element]).reduce(3, residual=True)
    q = model.equilibrium({1.0: -0.3})[: len(model.omega)]
    assert q @ model.phi(0.0, 1) == pytest.approx(-0.3 / 40.0, rel=1e-8)
    assert q @ model.phi(1.0) == pytest.approx(-0.3 / 40.0 - 0.3 / 3.0, rel=3e-3)  # and 1/3EI of bending


def test_reactions_balance_an_element_and_a_hinge_moment():
    """At rest under gravity the support carries what the element does not, moments about z = 0 too."""
    elements = [fb.Element(0.6, KelvinVoigt(80.0, 0.0)), fb.Element(0.9, KelvinVoigt(3.0, 0.0), of="rotation")]
    model = beam([fb.Clamped(0.0)], elements=elements, gravity=9.81).reduce(4, residual=True)
    run = model.simulate(0.1, 0.05, model.equilibrium())
    clamp = run.reactions()[0]
    force, moment = run.force(0)[0], run.force(1)[0]
    assert clamp.force[0] - force == pytest.approx(9.81, rel=1e-6)
    assert clamp.moment[0] - 0.6 * force - moment == pytest.approx(9.81 / 2, rel=1e-6)


def test_frequency_response_takes_the_tangent_of_elements():
    """With a linear element it is that of the same spring in the structure; of a cubic one nothing is left at u = 0."""
    omega = np.linspace(0.0, 30.0, 7)
    supports, damping = [fb.Clamped(0.0)], fb.ModalDamping(0.01)
    spring = fb.Scene(fb.Beam(1.0, UNIT), supports, springs=[fb.Spring(1.0, 2.0)], dashpots=[fb.Dashpot(1.0, 0.3)])
    element = fb.Scene(fb.Beam(1.0, UNIT), supports, elements=[fb.Element(1.0, KelvinVoigt(2.0, 0.3))])
    found, wanted = (s.reduce("all", 10).frequency_response(omega, 1.0, 0.5).values for s in (element, spring))
    np.testing.assert_allclose(found, wanted, rtol=1e-7)
    plain = fb.Scene(fb.Beam(1.0, UNIT), supports, damping=damping)
    cubic = replace(plain, elements=[fb.Element(1.0, Polynomial([0.0, 0.0, 1e9]))])
    found, wanted = (s.reduce(3).frequency_response(omega, 1.0, 0.5).values for s in (cubic, plain))
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_orbit_and_branch_along_the_law_of_an_element():
    """A linear element shaken: the amplitude of the closed form; the branch along its stiffness follows it."""
    drive = fb.PointForce(1.0, fb.Harmonic(0.1, 2.0))
    scene = fb.Scene(fb.Beam(1.0, UNIT), [fb.Clamped(0.0)], forces=[drive], damping=fb.ModalDamping(0.05),
                     elements=[fb.Element(1.0, KelvinVoigt(4.0, 0.0))])  # fmt: skip
    model = scene.reduce(1)

    def amplitude(k):
        phi, omega = model.phi(1.0)[0], model.omega[0]
        return 0.1 * phi**2 / abs(omega**2 + k * phi**2 - 4.0 + 2j * 0.05 * omega * 2.0)

    assert model.orbit().extremes(1.0)[1] == pytest.approx(amplitude(4.0), rel=1e-6)
    branch = model.branch("elements[0].law.stiffness", span=(3.0, 6.0)).run()
    wanted = [amplitude(k) for k in branch.parameter]
    np.testing.assert_allclose(branch.extremes(1.0)[:, 1], wanted, rtol=1e-5)
    assert axis_name("elements[0].law.stiffness", scene) == "contact stiffness of element 0 / N/m"


def test_the_whole_scene_again_when_a_place_moves():
    scene = beam(PINNED, elements=[fb.Element(0.3, KelvinVoigt(9.0, 0.0), to=0.8)])
    model = scene.reduce(2)
    with pytest.raises(ValueError, match="no such parameter"):
        model.branch("elements[0].nothing", span=(0.0, 1.0))
    assert changes_structure("elements[0].to")
    assert not changes_structure("elements[0].gap")
    moved = with_value(scene, "elements[0].gap", 0.1)
    assert model.system_like(moved).contacts[0].gap == 0.1
    other = with_value(scene, "elements[0].to", 0.7)
    again = model.again(other)
    np.testing.assert_allclose(again.directions[0], again.phi(0.7) - again.phi(0.3), atol=1e-12)


# --- what is refused ------------------------------------------------------------------------------------------------


@law
def softened(delta, delta_dot, entry_rate, stiffness):
    return stiffness * delta / (1.0 + delta * delta)


@law
def entering(delta, delta_dot, entry_rate, stiffness):
    return stiffness * delta * (1.0 + 0.1 * delta_dot / entry_rate)


@pytest.mark.parametrize(
    ("law", "why"),
    [
        (Hertz(1e9), "not a number"),
        (KelvinVoigt(1.0, 1.0) + Hertz(1e9), "not a number"),
        (Hysteretic(1e9, 0.2), "not a number"),
        (entering(stiffness=1.0), "depends on the rate of entry"),
        (KelvinVoigt(1.0, 1.0, clamp=True), "is cut at zero"),
        (WaltonBraun(1.0, 2.0), "is cut at zero"),
        (Tabulated([1e-3, 2e-3], [1.0, 3.0]), "a table of measured forces begins at d = 0"),
    ],
)
def test_laws_for_positive_indentation_only_are_refused(law, why):
    with pytest.raises(ValueError, match=rf"law must act at both signs of d: .*{why}.* use a Stop, or a law such as"):
        fb.Element(0.5, law)


@pytest.mark.parametrize(
    "law",
    [
        PiecewiseLinear([1.0, 2.0], (0.1,)),
        KelvinVoigt(1.0, 2.0) + Polynomial([0.0, 0.0, 3.0]),
        softened(stiffness=2.0),
        Coulomb(1.0, 100.0),
    ],
)
def test_laws_for_both_signs_are_taken(law):
    fb.Element(0.5, law)


def test_bad_places_are_refused():
    spring, clamp = KelvinVoigt(1.0, 0.0), [fb.Clamped(0.0)]
    for part, message in (
        (lambda: fb.Element(0.5, spring, of="slope"), "of must be 'displacement' or 'rotation', got 'slope'"),
        (lambda: fb.Stop(0.5, spring, of="slope"), "of must be 'displacement' or 'rotation', got 'slope'"),
        (lambda: fb.Element(0.5, spring, to=(1, 2, 3)), r"to must be a place z, \(body, z\) or None"),
        (lambda: fb.Element(0.5, spring, to=""), r"to must be a place z, \(body, z\) or None"),
        (lambda: fb.Element(0.5, spring, gap=np.nan), "gap must be finite"),
        (lambda: fb.Element(0.5, softened), "law must not be a bare function|law must offer force"),
        (lambda: beam(clamp, elements=[fb.Element(1.5, spring)]), r"z must lie on the beam, 0 to 1.0 m, got 1.5"),
        (lambda: beam(clamp, elements=[fb.Element(0.5, spring, to=1.5)]), "z of to must lie on the beam, 0 to 1.0 m"),
        (lambda: beam(clamp, elements=[fb.Element(0.5, spring, to="tip")]), "0 to 1.0 m, got 'tip' .* name the part"),
        (lambda: beam(clamp, elements=[fb.Element(0.5, spring, to=0.5)]), "z of to must be another place"),
        (
            lambda: beam(clamp, elements=[fb.Element(0.5, spring, to=(1, 0.5))]),
            "to must name a body, and there is none",
        ),
        (lambda: beam(clamp, elements=[fb.Element(0.0, spring, of="rotation")]), "free to turn at z.* by Pinned"),
        (lambda: beam(clamp, stops=[fb.Stop(0.0, spring, of="rotation")]), "free to turn at z.* by Pinned"),
    ):
        with pytest.raises(ValueError, match=message):
            part()
    with pytest.raises(TypeError, match=r"elements\[0\] must be a Element"):
        beam(clamp, elements=[fb.Stop(0.5, spring)])
    hinge = [fb.Stop(1.0, spring, of="rotation"), fb.Stop(1.0, spring)]
    beam(clamp, stops=hinge)  # one place and side, but not the same motion


@pytest.mark.parametrize(
    ("support", "of"),
    [(fb.Clamped, "displacement"), (fb.Pinned, "displacement"), (fb.Clamped, "rotation"), (fb.Guided, "rotation")],
)
def test_what_supports_hold_still_is_no_place_to_act_at(support, of):
    """Nor is a pair whose places are both held; one of them that is free will do."""
    act = partial(fb.Element, law=KelvinVoigt(1.0, 0.0), of=of)
    held, move = [support(0.0), support(0.5)], "move" if of == "displacement" else "turn"
    message = rf"free to {move} at z, got \[{support.__name__}\(z=0.5\).*elements\[0\]"
    with pytest.raises(ValueError, match=message):
        beam(held, elements=[act(0.5)])
    with pytest.raises(ValueError, match=message.replace("elements", "stops")):
        beam(held, stops=[fb.Stop(0.5 + 1e-12, KelvinVoigt(1.0, 0.0), of=of)])
    for to in (0.0, (1, 0.5)):
        with pytest.raises(ValueError, match=message):
            beam(held, elements=[act(0.5, to=to)], bodies=[beam(held)])
    for z, to in ((0.5, 0.8), (0.8, 0.5), (0.5, (1, 0.8)), (0.8, (1, 0.5)), (0.5 + 1e-3, None)):
        assert beam(held, elements=[act(z, to=to)], bodies=[beam(held)]).reduce(3).directions.any()


@pytest.mark.parametrize(("support", "of"), [(fb.Guided, "displacement"), (fb.Pinned, "rotation")])
def test_what_supports_leave_free_is_a_place_to_act_at(support, of):
    element = fb.Element(0.0, KelvinVoigt(1.0, 0.0), of=of)
    assert beam([support(0.0), fb.Pinned(0.9)], elements=[element]).reduce(1).static_share[0] > 0.1


def test_what_holds_a_beam_that_supports_do_not_hold():
    spring, drive = KelvinVoigt(1.0, 0.0), {"base": fb.Harmonic(1e-3, 1.0)}
    hinge = [fb.Stop(0.0, spring, 0.1, side, of="rotation") for side in ("below", "above")]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        beam([fb.Pinned(0.0)], stops=hinge, **drive)
        beam([fb.Pinned(0.0)], elements=[fb.Element(0.0, spring, of="rotation")], **drive)
        beam([fb.Pinned(0.0)], elements=[fb.Element(1.0, spring)], **drive)
        beam([fb.Clamped(0.0)], bodies=[beam([])], elements=[fb.Element(0.5, spring, to=(1, 0.5))], **drive)
    with pytest.warns(UserWarning, match="1 rigid-body mode appears"):
        beam([fb.Pinned(0.0)], stops=hinge[:1], **drive)
    with pytest.warns(UserWarning, match="1 rigid-body mode appears"):
        beam([fb.Guided(0.0)], elements=[fb.Element(1.0, spring, of="rotation")], **drive)


# --- units, files, tables -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def mixed():
    """A pinned beam with a hinge stop, a displacement stop and a hinge spring, shaken into both stops."""
    stops = [fb.Stop(0.0, KelvinVoigt(400.0, 0.05), 0.003, "above", of="rotation"), fb.Stop(0.5, Hertz(1e5), 0.001)]
    element = fb.Element(1.0, KelvinVoigt(0.5, 0.01), of="rotation")
    scene = fb.Scene(fb.Beam(1.0, UNIT), PINNED, stops=stops, elements=[element], damping=fb.ModalDamping(0.02),
                     base=fb.Harmonic(0.01, 9.0))  # fmt: skip
    return scene.reduce(2, residual=True).simulate(6.0, 1e-2)


def test_units_in_tables(mixed, tmp_path):
    assert set(mixed.contacts.stop.tolist()) == {0, 1}
    names = ["stop of rotation at 0 m, above", "stop at 0.5 m, below", "element of rotation at 1 m"]
    assert [mixed.name(i) for i in range(3)] == names
    assert [mixed.key(i) for i in range(3)] == ["stop 0 (rotation)", "stop 1", "element 2 (rotation)"]
    assert [mixed.unit("force", i) for i in range(3)] == ["N m", "N", "N m"]
    histories, log = (path.read_text().splitlines()[0].split(",") for path in mixed.to_csv(tmp_path))
    expected = {"indentation stop 0 (rotation) [rad]", "indentation stop 1 [m]", "force element 2 (rotation) [N m]"}
    assert expected <= set(histories)
    assert {"speed_in [m/s or rad/s]", "peak_force [N or N m]", "impulse [N s or N m s]", "t_in [s]"} <= set(log)
    printed = str(mixed)
    assert "indentation, stop of rotation at 0 m, above" in printed
    assert "mean / m or rad" in printed
    assert "largest force / N or N m" in printed
    assert fb.plot.contacts(mixed).axes[1].get_xlabel().startswith("peak force / N or N m")


def test_units_in_reports(mixed, tmp_path):
    from fembeam.results import files, html_page

    found = files.summary(mixed)
    assert found["rotations"] == [True, False, True]
    assert [row["name"] for row in found["contacts"]] == ["stop of rotation at 0 m, above", "stop at 0.5 m, below"]
    assert "mean peak force/N or N m" in files.text(found)
    (tmp_path / "summary.json").write_text(json.dumps(found))
    page = html_page.write_page(tmp_path).read_text()
    assert "mean peak / N or N m" in page
    assert "mean entry / m s⁻¹ or rad s⁻¹" in page


def test_a_time_history_names_what_acts(mixed):
    """The place is that of the stop of displacement; the element's moment is drawn though it has no contacts."""
    figure = fb.plot.time_history(mixed, window=(0.0, 6.0))
    _, lower = figure.axes
    title = " ".join(figure.get_suptitle().split())
    assert title.startswith("Displacement at mid-beam relative to the frame, contacts of stop at 0.5 m, below shaded")
    assert lower.get_ylabel() == "force / N or N m"
    names = {"stop of rotation at 0 m, above", "stop at 0.5 m, below", "element of rotation at 1 m"}
    assert names == {text.get_text() for text in lower.get_legend().get_texts()}


def test_a_saved_run_keeps_its_kinds(mixed, tmp_path):
    again = fb.load(mixed.save(tmp_path / "run"))
    assert again.name(2) == "element of rotation at 1 m"
    assert again.key(2) == "element 2 (rotation)"
    np.testing.assert_array_equal(again.force(2), mixed.force(2))


def test_pictures_of_rotation(mixed):
    axes = fb.plot.frame(mixed, 3.0).axes
    assert axes[1].get_ylabel() == "peak contact\nforce / N or N m"
    scene = mixed.model.scene
    assert axis_name("stops[0].gap", scene) == "gap of stop 0 / rad"
    assert axis_name("stops[0].law.stiffness", scene) == "contact stiffness of stop 0 / N m/rad"
    assert axis_name("elements[0].z", scene) == "place z of element 0 / m"


def test_a_scene_is_printed_as_it_is_called():
    """Saved branches and runs know their scene by this text."""
    scene = beam([fb.Clamped(0.0)], stops=[fb.Stop(1.0, Hertz(1.0))])
    assert repr(scene).endswith("gravity=0.0, elements=(), joints=())")
    shown = f"Stop(z=1.0, law={Hertz(1.0)!r}, gap=0.0, side='below', on=None, of='displacement')"
    assert repr(scene.stops[0]) == shown


FILE = """
[beam]
length = 1.0
section = { E = 1.0, rho = 1.0, A = 1.0, I = 1.0 }
[[supports]]
kind = "pinned"
z = 0
[[supports]]
kind = "pinned"
z = 1
[[stops]]
z = 0
of = "rotation"
gap = 0.003
side = "above"
law = { kind = "kelvin_voigt", stiffness = 400, damping = 0.05 }
[[elements]]
z = 0.3
to = 0.8
law = { kind = "polynomial", coefficients = [1.0, 0, 1e3] }
[[elements]]
z = 1
of = "rotation"
law = { kind = "kelvin_voigt", stiffness = 0.5, damping = 0.01 }
[damping]
zeta = 0.02
[base]
kind = "harmonic"
amplitude = 0.01
omega = 9.0
[reduce]
modes = 2
residual = true
"""


def test_scene_files(file_of):
    from fembeam.inspection import check

    file = file_of(FILE)
    assert file.scene.elements[0] == fb.Element(0.3, Polynomial([1.0, 0.0, 1e3]), to=0.8)
    assert file.scene.stops[0].of == "rotation"
    model = file.scene.reduce(**file.reduce)
    said = str(check(model))
    assert re.search(r"above: \d+ contacts in a trial; at [\d.]+ rad/s .* peak force [\d.]+ N m", said)
    assert "elements: with their stiffness at u = 0 the lowest frequencies are" in said
    for change, message in (
        ('elements[1].of="slope"', r"\[\[elements\]\] number 2: of must be 'displacement' or 'rotation', got 'slope'"),
        ('elements[0].to="tip"', "z of to must lie on the beam, 0 to 1.0 m, got 'tip'"),
        ("elements[0].to=true", "to must be a number or a list of 2 numbers or text, got true"),
        ("elements[0].law.kind=hertz", "unknown key 'coefficients'"),
        ("elements[0].at=1", r"unknown key 'at'.*valid: z, law, of, to, gap"),
    ):
        with pytest.raises(SceneFileError, match=message):
            file_of(FILE, change)
    steep = file_of(FILE, "stops[0].gap=1.0")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert any("is it in degrees?" in said for said in check(steep.model()))


def test_schema_names_the_tables():
    """At a z, or at a place by name."""
    for table in ("elements", "stops"):
        kinds = [kind["properties"] for kind in json_schema()["properties"][table]["items"]["anyOf"]]
        keys = next(one for one in kinds if "z" in one)
        assert keys["of"] == {"enum": ["displacement", "rotation"], "default": "displacement"}
        second = keys["to" if table == "elements" else "on"]
        assert second["anyOf"][1]["items"] == {"type": "number"}


# --- studies --------------------------------------------------------------------------------------------------------


def test_studies_know_rotations_and_elements():
    hinge = fb.Stop(0.0, KelvinVoigt(400.0, 0.1), 0.002, "above", of="rotation")
    scene = fb.Scene(fb.Beam(1.0, UNIT), PINNED, stops=[hinge], damping=fb.ModalDamping(0.02),
                     base=fb.Harmonic(0.01, 9.0))  # fmt: skip
    found = fb.study.mode_count(scene, [1, 2, 4], "peak_force", duration=1.5)
    assert found.row(2, residual=True).error < found.row(2).error
    chart = fb.study.stability_map(scene, solvers.RK4, [1e-4, 0.5], modes=[1], duration=1.0)
    assert (chart.verdict[0] == 0).tolist() == [True, False]
    spring = replace(scene, stops=(), elements=[fb.Element(0.0, KelvinVoigt(400.0, 0.1), of="rotation")])
    assert fb.study.smallest_model(spring, "amplitude", tolerance=0.01, duration=3.0, dt=0.01).modes <= 2
    with pytest.raises(ValueError, match="must have a stop or element"):
        fb.study.stability_map(replace(scene, stops=()), solvers.RK4, [1e-4])


# --- laws with memory -----------------------------------------------------------------------------------------------


def test_an_element_with_memory_is_replayed():
    """Jenkins at the tip: the force keeps its limit, and moves the beam as the equations say."""
    model = beam([fb.Clamped(0.0)], elements=[fb.Element(1.0, Jenkins(40.0, 0.6))]).reduce(2, residual=True)
    start = np.concatenate([np.zeros(3), [0.0, 0.0, 0.0]])
    start[:3] = model.equilibrium({1.0: -0.1})[:3]
    start[:3] *= 3.0 / np.abs(start[:3] @ model.phi(1.0)) * 0.05
    run = model.simulate(3.0, 5e-4, start)
    events = run.transitions
    assert set(events.event) == {"stick", "slip"}
    assert len(events) > 6
    force, d = run.force(), run.indentation()
    assert np.abs(force).max() == pytest.approx(0.6, rel=1e-12)
    rise = cumulative_simpson(run.acceleration(1.0), x=run.t, initial=0)
    np.testing.assert_allclose(run.velocity(1.0) - run.velocity(1.0)[0], rise, atol=2e-4 * np.abs(rise).max())
    assert simpson(force * run.velocity(1.0), x=run.t) == pytest.approx(run.energy.contact[-1], rel=1e-3)
    assert run.force(mean=True)[1:-1] == pytest.approx(force[1:-1], abs=0.02)
    assert d[0] == pytest.approx(-0.15, rel=1e-9)
    with pytest.raises(reduction.AccuracyError, match=r"element at 1 m slips or yields before equilibrium"):
        model.equilibrium({1.0: -2.0})


@pytest.mark.parametrize(("force", "slips"), [(9.0, False), (15.0, True), (70.0, True)])
def test_one_slider_of_several_that_slips_is_no_equilibrium(force, slips):
    """Of two, at 0.01 m and at 0.05 m, where 11 N and 55 N hold them and the spring beside them."""
    body = fb.Structure([[900.0]], [[1.0]], labels=[("lever", "x")])
    element = fb.Element("lever", Iwan([100.0, 100.0], [1.0, 5.0]), direction="x")
    model = fb.Scene(body, elements=[element]).reduce("all")
    if not slips:
        start = model.equilibrium({("lever", "x"): force})
        assert model.phi(("lever", "x")) @ start[:1] == pytest.approx(force / 1100.0, rel=1e-9)
        return
    with pytest.raises(reduction.AccuracyError, match=r"element at lever, x slips or yields before equilibrium"):
        model.equilibrium({("lever", "x"): force})


@pytest.mark.parametrize(("law", "left"), [
    (BoucWen(1e4, 0.1, 1.0, 500.0, 500.0, 1), (1e3, 0.0)),
    (Iwan([1e3, 2e3], [1.0, np.inf]), (2e3, 0.0)),
    (Jenkins(1e3, 2.0), (0.0, 0.0)),
    (KelvinVoigt(500.0, 3.0) + Jenkins(1e3, 2.0), (500.0, 3.0)),
])  # fmt: skip
def test_what_is_left_once_all_sliders_move(law, left):
    model = beam([fb.Clamped(0.0)], elements=[fb.Element(1.0, law)]).reduce(2)
    found, w = model.slipping_elements, model.phi(1.0)
    np.testing.assert_allclose(found, np.multiply.outer(left, np.outer(w, w)), rtol=1e-9, atol=1e-9)


def test_what_yields_before_equilibrium_is_named():
    law, clamp = WaltonBraun(200.0, 900.0), [fb.Clamped(0.0)]
    with pytest.raises(reduction.AccuracyError, match=r"^stop at 1 m, below is touched before equilibrium"):
        beam(clamp, stops=[fb.Stop(1.0, law, gap=-0.1)]).reduce(2).equilibrium()
    striker = fb.Impactor(0.5, 1.0, 0.0, law, gap=-0.1, stiffness=10.0)
    with pytest.raises(reduction.AccuracyError, match=r"^impactor at 0.5 m, above is touched before equilibrium"):
        beam(clamp, impactors=[striker]).reduce(2).equilibrium()
    valve = fb.Structure([[900.0]], [[1.0]], labels=[("lever", "x")])
    model = fb.Scene(valve, stops=[fb.Stop("lever", law, gap=-0.1, direction="x")]).reduce("all")
    with pytest.raises(reduction.AccuracyError, match=r"^stop at lever, x is touched before equilibrium"):
        model.equilibrium()
    with pytest.raises(ValueError, match=r"^force at lever, x must be finite"):
        model.equilibrium({("lever", "x"): np.nan})


def test_a_stop_with_memory_is_replayed():
    """A yielding stop under a falling tip: the force of every blow has the peak of the log, less at the same depth."""
    stop = fb.Stop(1.0, WaltonBraun(200.0, 900.0))
    model = beam([fb.Clamped(0.0)], stops=[stop], gravity=1.0).reduce(2)
    run = model.simulate(6.0, 2e-4, model.state(velocity=lambda z: model.phi(z) @ [-0.1, 0.0]))
    log, force = run.contacts, run.force()
    assert len(log) > 1
    assert force.min() >= 0.0
    first = (run.t >= log.t_in[0]) & (run.t <= log.t_out[0])
    assert force[first].max() == pytest.approx(log.peak_force[0], rel=1e-4)
    assert simpson(force[first], x=run.t[first]) == pytest.approx(log.impulse[0], rel=1e-3)
    assert np.all(force[run.indentation() < 0.0] == 0.0)


def test_laws_that_never_open_are_no_stops():
    with pytest.raises(ValueError, match=r"law must be one that opens, .* make it an Element"):
        fb.Stop(0.5, Jenkins(1.0, 1.0))
    fb.Stop(0.5, WaltonBraun(1.0, 2.0))


@pytest.mark.parametrize("make", [fb.Stop, fb.Element])
def test_a_gap_of_a_slope_given_in_degrees_is_refused(make):
    with pytest.raises(
        ValueError, match=r"quarter turn, 1\.57 rad, got 20 in .*; is it in degrees\? np\.radians\(20\) are 0\.349"
    ):
        make(0.2, KelvinVoigt(400.0, 0.2), gap=20, of="rotation")
    assert make(0.2, KelvinVoigt(400.0, 0.2), gap=0.349, of="rotation").gap == 0.349
    assert make(0.2, KelvinVoigt(400.0, 0.2), gap=20).gap == 20  # m, which `check` doubts
