"""Residual shapes, Craig–Bampton, Guyan, truncation by frequency and mass; models of scenes made with them."""

from dataclasses import replace

import numpy as np
import pytest
from problems import STEEL, paper_scene
from refusals import refused, refused_by

import reduction
import solvers
from contacts import Hertz, KelvinVoigt
from fembeam.beams import Beam, Rayleigh, Section
from fembeam.excitation import Harmonic
from fembeam.model import reduce as reducing
from fembeam.model.mode_table import mode_rows
from fembeam.scene import Clamped, Dashpot, LumpedMass, Pinned, PointForce, Scene, Stop
from fembeam.structures import Frame, Structure
from reduction import interface

UNIT = Section(E=1.0, rho=1.0, A=1.0, I=1.0)


@pytest.fixture(scope="module")
def cantilever():
    return Scene(Beam(1.0, UNIT), [Clamped(0.0)]).matrices(elements=50)


@pytest.fixture(scope="module")
def tip(cantilever):
    return cantilever.interpolation(1.0).T


# --- static compliance -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "share"), [(1, 0.970688), (2, 0.995404), (3, 0.998556)])
def test_static_tip_compliance(cantilever, tip, count, share):
    M, K, R = cantilever.M, cantilever.K, cantilever.root
    basis = reduction.modal_basis(M, K, count, root=R)
    assert reduction.static_share(basis, M, K, tip, R)[0] == pytest.approx(share, abs=6e-7)
    extended = reduction.with_residual(basis, M, K, tip, R)
    assert extended.count == count + 1
    assert np.sum(extended.project(tip)[:, 0] ** 2 / extended.omega**2) == pytest.approx(1 / 3, rel=1e-10)
    np.testing.assert_array_equal(extended.vectors[:, :count], basis.vectors)


@pytest.mark.parametrize("root", [True, False])
@pytest.mark.parametrize("count", [0, 1, 4])
def test_interface_bases_are_statically_exact(cantilever, count, root):
    M, K, R = cantilever.M, cantilever.K, cantilever.root if root else None
    z = np.array([1.0, 0.4, 0.4, 0.74])  # one twice
    B = cantilever.interpolation(z).T
    basis = reduction.craig_bampton(M, K, B, count, R)
    assert basis.count == 3 + count
    near, far = np.minimum.outer(z, z), np.maximum.outer(z, z)
    kept = basis.project(B).T @ (basis.project(B) / basis.omega[:, None] ** 2)
    np.testing.assert_allclose(kept, near**2 * (3 * far - near) / 6, rtol=1e-10 if root else 1e-7)
    np.testing.assert_allclose(basis.project_matrix(M), np.eye(3 + count), atol=1e-9)
    full = reduction.modal_basis(M, K, 2, root=R).omega
    assert np.all(basis.omega[:2] >= full * (1 - 1e-9))  # Rayleigh–Ritz bounds from above


@pytest.mark.parametrize("elements", [100, 400])
@pytest.mark.parametrize("share", [0.5, 0.99, 0.99999])
@pytest.mark.parametrize("how", ["residual", "interface", "guyan"])
def test_compliance_of_a_compressed_beam(share, elements, how):
    """A load in the middle of a pinned beam, EI = L = 1, N = k²: u = (tan k/2 - k/2)/2k³ there.

    On 400 elements K alone refused all of them, or was off by more than 1e-7.
    """
    k = np.pi * np.sqrt(share)
    full = Scene(Beam(1.0, UNIT, axial_force=-(k**2)), [Pinned(0.0), Pinned(1.0)]).matrices(elements=elements)
    given = full.M, full.K, full.interpolation(0.5).T
    if how == "residual":
        basis = reduction.with_residual(reduction.modal_basis(*given[:2], 3, root=full.root), *given, full.root)
    else:
        basis = reduction.craig_bampton(*given, 0 if how == "guyan" else 3, full.root)
    found = np.sum(basis.project(given[2])[:, 0] ** 2 / basis.omega**2)
    rounding, mesh = 4 * np.finfo(float).eps * elements**2, (np.pi / elements) ** 4 / 720
    exact = (np.tan(k / 2) - k / 2) / (2 * k**3)
    assert found == pytest.approx(exact, rel=2 * (rounding + mesh) / (1 - share))


@pytest.mark.parametrize("modes", [3, 16, 24, 30])
@pytest.mark.parametrize("force", [-20.0, -1e-3])
def test_static_shapes_of_a_compressed_beam_are_not_refused(force, modes):
    """By K alone their shared stiffness was 1e-5 where 2e-6 is allowed; without compression all were made."""
    beam = Beam(0.92, Section(2.1e11, 7800.0, 7.5e-5, 9.4e-10), axial_force=force)
    dashpots, forces = [Dashpot(0.46, 7.0), Dashpot(0.3, 7.0)], [PointForce(0.41, Harmonic(1.0, 10.0))]
    model = Scene(beam, [Clamped(0.0)], dashpots=dashpots, forces=forces).reduce(modes=modes, residual=True)
    assert model.omega.size == modes + 3


@pytest.mark.parametrize("apart", [2e-4, 3e-3])
def test_places_close_together_under_compression(apart):
    """EI = L = 1, N = k²: u(a) = sin ka sin k(1-b)/(k³ sin k) - a (1-b)/k² of a load at b ≥ a.

    Of opposite loads at two places; they once shared an element, and u was off by 7e-4 and 4e-3.
    """
    k, z = np.pi * np.sqrt(0.5), np.array([0.5, 0.5 + apart])
    stops = [Stop(place, KelvinVoigt(1.0, 1.0)) for place in z]
    scene = Scene(Beam(1.0, UNIT, axial_force=-(k**2)), [Pinned(0.0), Pinned(1.0)], stops=stops)
    model = scene.reduce(modes=3, elements=100, residual=True)
    a, b = np.minimum.outer(z, z), np.maximum.outer(z, z)
    exact = np.sin(k * a) * np.sin(k * (1 - b)) / (k**3 * np.sin(k)) - a * (1 - b) / k**2
    apart_by = np.array([1.0, -1.0])
    found = np.sum((apart_by @ model.directions / model.omega) ** 2)
    assert found == pytest.approx(apart_by @ exact @ apart_by, rel=1e-6, abs=0.0)  # eps (L/h)² = 6e-9


def test_supports_close_together_under_compression():
    """Two pins 3e-4 apart, once refused, are a clamping but for a share of 3e-4."""
    beam = Beam(1.0, UNIT, axial_force=-5.0)
    pins = [Pinned(0.0), Pinned(3e-4), Pinned(1.0)]
    found, clamped = (Scene(beam, held).reduce(2).omega for held in (pins, [Clamped(0.0), Pinned(1.0)]))
    np.testing.assert_allclose(found, clamped, rtol=1e-3)


def test_craig_bampton_with_all_modes_is_the_full_model():
    full = Scene(Beam(1.0, UNIT), [Clamped(0.0)], [LumpedMass(0.8, 0.5, 0.01)]).matrices(elements=6)
    size = full.M.shape[0]
    basis = reduction.craig_bampton(full.M, full.K, full.interpolation(1.0).T, size - 1, full.root)
    np.testing.assert_allclose(basis.omega, reduction.modal_basis(full.M, full.K, root=full.root).omega, rtol=1e-9)


def test_guyan_is_craig_bampton_without_modes(cantilever, tip):
    M, K, R = cantilever.M, cantilever.K, cantilever.root
    guyan, none = reduction.guyan(M, K, tip, R), reduction.craig_bampton(M, K, tip, 0, R)
    np.testing.assert_array_equal(guyan.vectors, none.vectors)
    # one coordinate with the static shape (3 z² - z³)/2: ω² = 3/(33/140)
    assert guyan.omega[0] == pytest.approx(np.sqrt(3 * 140 / 33), rel=1e-6)


def test_free_body_gets_elastic_shapes():
    # inertia relief at the end of a free beam: compliance 1/105 of L³/EI
    full = Scene(Beam(1.0, UNIT)).matrices(modes=6)
    B = full.interpolation([1.0, 0.3]).T
    basis = reduction.modal_basis(full.M, full.K, 4, root=full.root)
    extended = reduction.with_residual(basis, full.M, full.K, B, full.root)
    elastic = extended.omega > 0
    kept = np.sum(extended.project(B)[elastic, 0] ** 2 / extended.omega[elastic] ** 2)
    assert kept == pytest.approx(1 / 105, rel=1e-7)
    with pytest.raises(ValueError, match="rigid-body modes that are not in the basis"):
        reduction.with_residual(reduction.Basis(basis.vectors[:, 2:], basis.omega[2:]), full.M, full.K, B, full.root)
    with pytest.raises(ValueError, match="must not move freely with its interface held"):
        reduction.craig_bampton(full.M, full.K, full.interpolation(1.0).T, 2, full.root)


def test_nothing_is_counted_twice(cantilever):
    M, K, R = cantilever.M, cantilever.K, cantilever.root
    B = cantilever.interpolation([1.0, 0.5, 1.0]).T
    basis = reduction.modal_basis(M, K, indices=[0, 3], root=R)
    extended = reduction.with_residual(basis, M, K, B, R)
    assert extended.count == 4  # two independent directions
    strain = extended.project_matrix(K) / np.outer(extended.omega, extended.omega)
    np.testing.assert_allclose(strain, np.eye(4), atol=1e-6)
    np.testing.assert_allclose(reduction.static_share(extended, M, K, B, R), 1.0, rtol=1e-10)
    assert extended.effective_mass(cantilever.base_load).sum() < reduction.moved_mass(M, cantilever.base_load)


@pytest.mark.parametrize("mass", [1e-9, 1e9])
@pytest.mark.parametrize("stiffness", [1e-9, 1e9])
def test_dependent_directions_count_once_in_any_units(mass, stiffness):
    """Of a beam that is held and of a free one; one direction given twice, once in other units."""
    for supports in ([Clamped(0.0)], []):
        full = Scene(Beam(1.0, Section(E=stiffness, rho=mass, A=1.0, I=1.0)), supports).matrices(elements=20)
        M, K, R = full.M, full.K, full.root
        B = full.interpolation([1.0, 0.52, 0.1, 0.35, 1.0]).T.toarray() * [1.0, 1.0, 1.0, 1.0, 1e3]
        assert reduction.dofs_inside(M, K, B, R) == M.shape[0] - 4
        basis = reduction.with_residual(reduction.modal_basis(M, K, 4, root=R), M, K, B, R)
        assert basis.count == 8
        np.testing.assert_allclose(reduction.static_share(basis, M, K, B, R), 1.0, rtol=1e-9)


@pytest.mark.parametrize("root", [True, False])
def test_directions_side_by_side_in_different_units(cantilever, root):
    M, K, R = cantilever.M, cantilever.K, cantilever.root if root else None
    z, units = np.array([1.0, 0.98]), np.array([1.0, 1e6])
    B = cantilever.interpolation(z).T.toarray() * units
    basis = reduction.with_residual(reduction.modal_basis(M, K, 3, root=R), M, K, B, R)
    near, far = np.minimum.outer(z, z), np.maximum.outer(z, z)
    kept = basis.project(B).T @ (basis.project(B) / basis.omega[:, None] ** 2) / np.outer(units, units)
    np.testing.assert_allclose(kept, near**2 * (3 * far - near) / 6, rtol=1e-9 if root else 2e-6)


def test_complete_basis_has_no_residual():
    full = Scene(Beam(1.0, UNIT), [Clamped(0.0)]).matrices(elements=4)
    basis = reduction.modal_basis(full.M, full.K, root=full.root)
    assert reduction.with_residual(basis, full.M, full.K, full.interpolation(1.0).T, full.root) is basis


def test_wrong_shapes_are_noticed(cantilever, tip, monkeypatch):
    M, K, R = cantilever.M, cantilever.K, cantilever.root
    basis = reduction.modal_basis(M, K, 2, root=R)
    exact = interface.static_shapes
    monkeypatch.setattr(interface, "static_shapes", lambda *a: exact(*a) * (1 + 1e-8))
    with pytest.raises(reduction.AccuracyError, match=r"must be statically exact to 1e-09, got 1e-08"):
        reduction.with_residual(basis, M, K, tip, R)
    monkeypatch.undo()
    monkeypatch.setattr(interface, "_orthogonal", lambda v, basis, M: v)  # the static shape itself: counts modes twice
    with pytest.raises(reduction.AccuracyError, match="must be orthonormal to 1e-09"):
        reduction.with_residual(basis, M, K, tip, R)


# --- truncation ------------------------------------------------------------------------------------------


def test_by_frequency_and_by_mass(cantilever):
    M, K, R, load = cantilever.M, cantilever.K, cantilever.root, cantilever.base_load
    omega = reduction.modal_basis(M, K, 20, root=R).omega
    for count in (1, 9, 17):
        np.testing.assert_allclose(reduction.fewest_modes(M, K, reduction.below(omega[count - 1] + 1.0), R).omega,
                                   omega[:count], rtol=1e-9)  # fmt: skip
    mass = reduction.moved_mass(M, load)
    basis = reduction.fewest_modes(M, K, reduction.carrying(0.9, load, mass), R)
    assert basis.effective_mass(load).sum() >= 0.9 * mass
    assert basis.effective_mass(load)[:-1].sum() < 0.9 * mass
    assert reduction.fewest_modes(M, K, reduction.carrying(1.0, load, mass), R).count <= M.shape[0]


def test_a_frequency_at_the_limit_counts():
    """Where it is the last one known, another one of the same frequency may stand behind it."""
    basis = reduction.Basis(np.eye(3), np.array([1.0, 2.0, 3.0]))
    assert reduction.below(2.0)(basis) == 2
    assert reduction.below(3.0)(basis) is None


EYE = np.eye(3)


test_bad_input = refused(
    (lambda: reduction.with_residual(reduction.modal_basis(EYE, EYE, 1), EYE, EYE, np.ones(3)), "shape"),
    (lambda: reduction.with_residual(reduction.modal_basis(EYE, EYE, 1), EYE, EYE, np.zeros((3, 1))), "not zero"),
    (lambda: reduction.craig_bampton(EYE, EYE, np.ones((3, 1)), 3), "count must be 0 to 2"),
    (lambda: reduction.craig_bampton(EYE, EYE, np.ones((3, 1)), True), "count must be 0 to 2"),
    (lambda: reduction.craig_bampton(EYE, EYE, np.full((3, 1), np.nan), 1), "finite"),
    (lambda: reduction.craig_bampton(EYE, EYE, [[1.0, 1.0], [0.0, np.nan], [0.0, 0.0]], 1), "finite"),
    (lambda: reduction.craig_bampton(EYE, EYE, [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]], 1), "not zero"),
    (lambda: reduction.below(0.0), "omega_max must be positive"),
    (lambda: reduction.below(np.inf), "omega_max must be positive and finite"),
    (lambda: reduction.carrying(1.5, EYE[0], 1.0), r"share must lie in \(0, 1\]"),
    (lambda: reduction.carrying(0.0, EYE[0], 1.0), r"share must lie in \(0, 1\]"),
    (lambda: reduction.carrying(0.5, EYE[0], 0.0), "mass must be positive and finite"),
    (lambda: reduction.moved_mass(EYE, np.ones(2)), "load must be 3 finite numbers"),
    (lambda: reduction.moved_mass(EYE, np.array([1.0, np.nan, 0.0])), "load must be 3 finite numbers"),
    (lambda: reduction.carrying(0.5, EYE[0], np.nan), "mass must be positive and finite"),
    (lambda: reduction.craig_bampton(np.eye(2), EYE, EYE[:, :1], 1), "M and K must have the same shape"),
    (lambda: reduction.fewest_modes(EYE, EYE, reduction.below(0.5)), "at least one mode"),
)


def test_modes_next_to_one_left_out_settle():
    # without guards the last mode wanted settles by (ω₂/ω₃)² a correction, which looked like the limit of rounding
    places = np.array([0.0717, 0.0719, 0.2344])
    floating = Scene(
        Beam(1.0, UNIT, foundation=1e3), [], [LumpedMass(0.6996, 0.6)], stops=[Stop(z, Hertz(1.0)) for z in places]
    )
    full = floating.matrices(modes=2)
    B = full.interpolation(places).T
    basis = reduction.modal_basis(full.M, full.K, 2, root=full.root)
    residual = full.root.T @ (full.root @ basis.vectors) - (full.M @ basis.vectors) * basis.omega**2
    energy = np.sum(residual * np.linalg.solve(full.K.toarray(), residual), axis=0)
    assert np.all(np.sqrt(energy) < 1e-9 * basis.omega)
    more = reduction.with_residual(basis, full.M, full.K, B, full.root)
    np.testing.assert_allclose(reduction.static_share(more, full.M, full.K, B, full.root), 1.0, rtol=1e-10)


# --- models of scenes ------------------------------------------------------------------------------------


def struck(law=None, damping=0.01, **changes):
    return replace(paper_scene(zeta=damping, law=law or Hertz(2.1e8)), **{"base": None, **changes})


def test_models_with_static_shapes():
    scene = struck(forces=[PointForce(0.1, Harmonic(1.0, 50.0))], base=Harmonic(1e-3, 195.0))
    plain, residual, interface = scene.reduce(), scene.reduce(2, residual=True), scene.reduce(2, interface=True)
    assert (len(plain.omega), len(residual.omega), len(interface.omega)) == (2, 4, 4)
    assert (plain.static, residual.static, interface.static) == (0, 2, 0)
    assert residual.modes == (0, 1, 2, 3)
    assert np.all(plain.static_share < 1 - 1e-5)
    for model in (residual, interface):
        np.testing.assert_allclose(model.static_share, 1.0, rtol=1e-10)
        assert plain.effective_mass.sum() < model.effective_mass.sum() < model.moving_mass
    np.testing.assert_allclose(residual.omega[:2], plain.omega, rtol=1e-9)
    assert np.all(residual.phi(0.24445) > 0)
    # a slow force moves its own place as the full structure does
    run = residual.simulate(np.pi / 50, start=None)
    assert run.complete


@pytest.mark.parametrize(
    "how", [{"modes": [0, 2], "residual": True}, {"modes": 2, "interface": True}, {"omega_max": 1e3}]
)
def test_made_again(how):
    model = struck().reduce(**how)
    np.testing.assert_array_equal(model.again(model.scene).omega, model.omega)
    assert len(model.again(struck(masses=[])).omega) == len(model.omega)


def test_pseudo_modes_are_damped_as_higher_modes():
    ratios = struck(damping=[0.03, 0.02, 0.01]).reduce(1, residual=True).zeta
    np.testing.assert_allclose(ratios, [0.03, 0.02])
    rayleigh = struck(damping=0.0, ).reduce(1, residual=True)  # fmt: skip
    model = replace(struck(), damping=Rayleigh(2.0, 1e-5)).reduce(1, residual=True)
    np.testing.assert_allclose(2 * model.zeta * model.omega, 2.0 + 1e-5 * rayleigh.omega**2, rtol=1e-9)


def test_by_frequency_mass_and_all():
    scene = struck()
    assert len(scene.reduce(omega_max=1e4).omega) == 5
    model = scene.reduce(mass_share=0.95)
    share = np.cumsum(model.effective_mass) / model.moving_mass
    assert share[-1] >= 0.95 > share[-2]
    full = scene.reduce("all", elements=10)
    assert len(full.omega) == full.matrices.M.shape[0]
    assert full.effective_mass.sum() == pytest.approx(full.moving_mass, rel=1e-9)
    first, second = full.omega[:2]
    assert len(scene.reduce(omega_max=0.5 * (first + second)).omega) == 1


def test_rows_of_modes_of_a_light_cantilever():
    """f = (βL)²/2π √(EI/ρA)/L², and of its 0.2 kg the shares 4 (σ/βL)² of a clamped beam."""
    section = Section(E=1e4, rho=0.2, A=1.0, I=1e-4)
    for number, row in enumerate(mode_rows(Scene(Beam(1.0, section), [Clamped(0.0)]).reduce(2))):
        root, sigma = ((1.8751040687, 0.7340955138), (4.6940911330, 1.0184673188))[number]
        assert row["hz"] == pytest.approx(root**2 * np.sqrt(1.0 / 0.2) / (2.0 * np.pi), rel=1e-6)
        assert row["share"] == pytest.approx(4.0 * (sigma / root) ** 2, rel=1e-5)
        assert row["effective_mass"] == pytest.approx(0.2 * row["share"], rel=1e-9)


def test_all_modes_beside_a_beam_need_its_elements():
    pair = Structure(np.eye(2), np.eye(2), labels=[("a", "x"), ("b", "x")])
    mixed = Scene(pair, bodies=[Scene(Beam(1.0, UNIT), [Clamped(0.0)])])
    with pytest.raises(ValueError, match="'all' with elements given"):
        mixed.reduce("all")
    assert mixed.reduce("all", elements=3).counts == ((2, 0), (6, 0))


def test_strike_foretells_contact_time():
    # a heavy end mass behaves as a free mass: t_c v/δ_max = 2.943275, δ_max = (5 m v²/4K)^(2/5)
    scene = struck(Hertz(1e9), damping=0.0, masses=[LumpedMass(0.24445, 50.0)])
    log = scene.reduce(1).strike(0.1)
    deepest = (5 * 50.0 * 0.1**2 / (4 * 1e9)) ** 0.4
    assert log.t_out[0] - log.t_in[0] == pytest.approx(2.943275 * deepest / 0.1, rel=1e-3)
    with pytest.raises(ValueError, match="speed must be finite and positive"):
        scene.reduce(1).strike(0.0)
    with pytest.raises(ValueError, match="stop must be below 1"):
        scene.reduce(1).strike(1.0, stop=1)


def test_a_strike_swings_in_a_mode_that_moves_the_stop():
    """The first mode of a bar moves its weak direction only: a stop in the other one was struck for ever."""
    times = []
    for weak, strong, direction in (("width", "height", "x"), ("height", "width", "y")):
        bar = Section.rectangle(2.1e11, 7850.0, **{weak: 0.01, strong: 0.02}, nu=0.3)
        frame = Frame.straight(0.5, bar, bending_only=True)
        for way in ("x", "y"):
            stop = Stop(0.5, Hertz(1e8), gap=1e-4, direction=way)
            log = Scene(frame, [Clamped("A")], stops=[stop]).reduce(modes=4).strike(0.1)
            times.append((way == direction, log.t_out[0] - log.t_in[0]))
    stiff, weak = ([t for own, t in times if own is which] for which in (False, True))
    assert np.ptp(stiff) < 1e-9 * stiff[0]
    assert np.ptp(weak) < 1e-9 * weak[0]
    assert 0.0 < stiff[0] < 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"modes": 2, "omega_max": 100.0}, "choose modes in one way"),
        ({"omega_max": 50.0}, "omega_max must reach the first frequency, 109"),
        ({"mass_share": 0.0}, r"share must lie in \(0, 1\]"),
        ({"mass_share": 0.9999999}, "mass_share = 0.9999999 must be reached by 16 modes"),
        ({"modes": "all"}, "'all' with elements given"),
        ({"modes": "many"}, "'all' with elements given"),
        ({"modes": 0}, "modes must be a count above 0"),
        ({"modes": [], "residual": True}, "modes must be a count above 0"),
        ({"modes": [1], "interface": True}, "modes must be a count with interface=True"),
        ({"residual": True, "interface": True}, "exclude each other"),
        ({"modes": 50, "elements": 10}, r"modes must be at most 20 \(free dofs\), got 50"),
    ],
)
def test_scene_reduce_rejects(arguments, message, monkeypatch):
    monkeypatch.setattr(reducing, "MOST_TRIED", 16)
    with pytest.raises(ValueError, match=message):
        struck().reduce(**arguments)


test_static_shapes_need_a_place = refused_by(
    lambda name: Scene(Beam(0.26, STEEL), [Clamped(0.0)]).reduce(**{name: True}),
    ("residual", "static shapes need a stop, a force or a dashpot"),
    ("interface", r"or an element, got none in .*leave out interface=True, or add one"),
)


# --- models beside another -------------------------------------------------------------------------------


def turned_pair(angle):
    """Two masses whose shapes are turned by an angle."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    labels = [("a", "x"), ("b", "x")]
    return Scene(Structure(turn @ np.diag([100.0, 400.0]) @ turn.T, np.eye(2), labels=labels)).reduce("all")


def test_likeness_is_the_cosine_between_shapes():
    for first, second in ((0.2, 0.3), (0.2, 1.2), (0.7, 0.9)):
        found = reducing.likeness(turned_pair(first), turned_pair(second))
        assert found == pytest.approx(np.cos(second - first), rel=1e-12)


def test_shapes_take_the_signs_of_a_model_near():
    """Where another entry becomes the largest, the second shape changes its sign."""
    before, after = turned_pair(0.25 * np.pi - 0.1), turned_pair(0.25 * np.pi + 0.1)
    assert np.sum(before.basis.vectors * after.basis.vectors, axis=0)[1] < 0.0
    signed = reducing.signed_like(after, before)
    for place in (("a", "x"), ("b", "x")):
        np.testing.assert_array_equal(signed.phi(place), after.phi(place) * [1.0, -1.0])
    np.testing.assert_allclose(np.diag(before.basis.vectors.T @ signed.basis.vectors), np.cos(0.2), rtol=1e-12)
    assert reducing.signed_like(after, after) is after


# --- full against reduced --------------------------------------------------------------------------------


def test_all_modes_are_the_full_matrices():
    # independent: another method, on the matrices as assembled, without any modes
    scene = struck(Hertz(1e8), stops=[Stop(0.24445, KelvinVoigt(1e5, 20.0))])
    full, model = scene.matrices(elements=3), scene.reduce("all", elements=3)
    w = full.interpolation(0.24445).toarray()[0]
    system = solvers.System(full.M, full.C, full.K, [solvers.Contact(w, scene.stops[0].law)])
    start = model.state(velocity=lambda z: -0.5 * (z / 0.2599) ** 2)
    u, u_dot = (model.basis.expand(part) for part in np.split(start, 2))
    direct = solvers.integrate(system, u, u_dot, 0.01, method=solvers.DormandPrince(1e-10))
    run = model.simulate(0.01, start=start)
    assert len(run.contacts) == len(direct.contacts) > 0
    np.testing.assert_allclose(run.contacts.peak_force, direct.contacts.peak_force, rtol=1e-6)
    np.testing.assert_allclose(model.basis.expand(run.q[-1]), direct.q[-1], atol=1e-6 * np.abs(direct.q[-1]).max())


def test_interface_inside_an_element(cantilever):
    # a direction that is no single dof
    M, K, R = cantilever.M, cantilever.K, cantilever.root
    B = cantilever.interpolation([0.731, 1.0]).T
    basis = reduction.craig_bampton(M, K, B, 2, R)
    assert basis.count == 4
    np.testing.assert_allclose(reduction.static_share(basis, M, K, B, R), 1.0, rtol=1e-10)
