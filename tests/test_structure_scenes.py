"""Scenes of structures: a beam given by its matrices is that beam, oracles of scipy, reductions, bad input."""

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp
from structures import BEAM, ELEMENTS, LAW, LENGTH, beam_structure, space_truss

import fembeam as fb
from contacts import Polynomial

STEP = LENGTH / ELEMENTS


def drive():
    return fb.Harmonic(1e-3, 180.0)


def beam_scene(base=True):
    """The beam with every kind of part that a structure has too."""
    return fb.Scene(
        BEAM,
        [fb.Clamped(0.0)],
        masses=[fb.LumpedMass(4 * STEP, 0.1, 1e-5, 0.01)],
        springs=[fb.Spring(3 * STEP, 500.0, 2.0, foot=fb.Harmonic(1e-4, 90.0))],
        dashpots=[fb.Dashpot(6 * STEP, 0.5), fb.Dashpot(7 * STEP, 0.0, 1e-3)],
        stops=[
            fb.Stop(LENGTH, LAW, 1e-3, "above"),
            fb.Stop(5 * STEP, LAW, 8e-4, "below"),
            fb.Stop(4 * STEP, LAW, 0.0015, "above", of="rotation"),
        ],
        elements=[fb.Element(2 * STEP, Polynomial([0.0, 0.0, 1e9]), to=6 * STEP)],
        forces=[fb.PointForce(LENGTH, fb.Harmonic(0.4, 70.0)), fb.PointMoment(LENGTH, fb.Harmonic(0.05, 70.0))],
        damping=fb.ModalDamping(0.01),
        base=drive() if base else None,
        gravity=9.81,
    )


def same_scene(base=True):
    """The same of the beam's matrices, with places by name."""
    return fb.Scene(
        beam_structure(),
        [fb.Fixed("root")],
        masses=[fb.LumpedMass("middle", 0.1, 1e-5, 0.01)],
        springs=[fb.Spring(3, 500.0, foot=fb.Harmonic(1e-4, 90.0), direction="y"), fb.Spring(3, 2.0, direction="rx")],
        dashpots=[fb.Dashpot(6, 0.5, direction="-y"), fb.Dashpot(7, 1e-3, direction="rx")],
        stops=[
            fb.Stop("tip", LAW, 1e-3, direction="y", name="upper"),
            fb.Stop(5, LAW, 8e-4, direction=(0.0, -2.0, 0.0)),
            fb.Stop("middle", LAW, 0.0015, direction="-rx"),
        ],
        elements=[fb.Element(2, Polynomial([0.0, 0.0, 1e9]), to=6, direction="y")],
        forces=[
            fb.PointForce("tip", fb.Harmonic(0.4, 70.0), direction="y"),
            fb.PointMoment("tip", fb.Harmonic(0.05, 70.0), direction="-rx"),
        ],
        damping=fb.ModalDamping(0.01),
        base={"y": drive()} if base else None,
        gravity=9.81,
    )


@pytest.fixture(scope="module")
def runs():
    models = beam_scene().reduce(modes="all", elements=ELEMENTS), same_scene().reduce(modes="all")
    return [model.simulate(0.15, 5e-4) for model in models]


def close(one, other, rtol=1e-8):
    one, other = np.asarray(one), np.asarray(other)
    np.testing.assert_allclose(other, one, rtol=0, atol=rtol * np.abs(one).max())


def test_frequencies_and_participation_are_those_of_the_beam():
    beam, body = beam_scene().reduce(modes="all", elements=ELEMENTS), same_scene().reduce(modes="all")
    close(beam.omega, body.omega)
    close(beam.effective_mass, body.effective_mass[:, 0], 1e-7)
    close(beam.moving_mass, body.moving_mass[0])
    close(beam.static_share, body.static_share, 1e-7)


def test_motion_log_and_balance_are_those_of_the_beam(runs):
    beam, body = runs
    assert len(beam.contacts) > 8
    assert set(beam.contacts.stop) == {0, 1, 2}
    for name, column in beam.contacts.arrays().items():
        close(column, body.contacts.arrays()[name], 1e-6)
    close(beam.displacement(LENGTH), body.displacement("tip", "y"))
    close(beam.slope(LENGTH), -body.displacement("tip", "rx"))
    close(beam.velocity(5 * STEP), body.velocity(5, "y"))
    close(beam.acceleration(LENGTH, absolute=True), body.acceleration("tip", "y", absolute=True), 1e-6)
    close(beam.displacement(LENGTH, absolute=True), -body.displacement("tip", "-y", absolute=True))
    close(beam.motion(LENGTH)[:, 1], -body.motion("tip")[:, 1])
    for stop in range(4):
        close(beam.indentation(stop), body.indentation(stop))
        close(beam.force(stop), body.force(stop), 1e-6)
    for part in ("input", "damping", "stored"):
        close(getattr(beam.energy, part), getattr(body.energy, part))


def test_reactions_are_those_of_the_beam(runs):
    beam, body = (run.reactions() for run in runs)
    close(beam[0].force, body[0]["y"], 1e-6)
    close(beam[0].moment, -body[0]["rx"], 1e-6)
    close(beam[1].force, body[1]["y"], 1e-6)  # the spring's force, then its moment as a spring of its own
    close(beam[1].moment, -body[2]["rx"], 1e-6)
    close(beam[2].force, body[3]["y"], 1e-6)
    close(beam[3].moment, -body[4]["rx"], 1e-6)
    assert body[0].name == "Fixed at 'root'"
    assert "component" in str(body)


def test_spectra_and_frequency_response_are_those_of_the_beam(runs):
    beam, body = runs
    omega = np.array([60.0, 180.0, 900.0])
    with pytest.warns(UserWarning, match="not resolved"):
        one = beam.floor_spectrum(LENGTH, omega)
    with pytest.warns(UserWarning, match="not resolved"):
        other = body.floor_spectrum(("tip", "y"), omega)
    close(one.acceleration, other.acceleration, 1e-6)
    beam, body = beam.model, body.model
    for driven, same in (("base", "base"), (LENGTH, ("tip", "y")), ("springs[0].foot", "springs[0].foot")):
        H = beam.frequency_response(omega, driven, [LENGTH, STEP]).values
        close(H, body.frequency_response(omega, same, [("tip", "y"), (1, "y")]).values)
    H = beam.frequency_response(omega, output=LENGTH, absolute=True).values
    close(H, body.frequency_response(omega, "base.y", ("tip", "y"), absolute=True).values)


@pytest.mark.parametrize("options", [{"modes": 2}, {"modes": 2, "residual": True}, {"modes": 1, "interface": True}])
def test_reductions_are_those_of_the_beam(options):
    beam, body = beam_scene().reduce(elements=ELEMENTS, **options), same_scene().reduce(**options)
    close(beam.omega, body.omega)
    close(beam.phi(LENGTH), body.phi(("tip", "y")), 1e-6)
    close(beam.static_share, body.static_share, 1e-6)


def test_equilibrium_and_states_are_those_of_the_beam():
    beam, body = beam_scene().reduce(modes="all", elements=ELEMENTS), same_scene().reduce(modes="all")
    q = [model.equilibrium({at: 25.0})[: len(model.omega)] for model, at in ((beam, LENGTH), (body, ("tip", "y")))]
    close(beam.phi(LENGTH) @ q[0], body.phi(("tip", "y")) @ q[1])
    with pytest.raises(ValueError, match=r"direction must be one of x, .* got 'w' in the place 'tip'"):
        body.equilibrium({("tip", "w"): 25.0})
    field = {label: 1e-3 * number for number, label in enumerate(body.scene.beam.labels) if number > 1}
    start = body.state(field)
    for node, c in (("tip", "y"), (3, "rx")):
        number = body.scene.beam.labels.index((8 if node == "tip" else node, c))
        close(1e-3 * number, body.phi((node, c)) @ start[: len(body.omega)])
    named = {("tip", c) if node == 8 else (node, c): value for (node, c), value in field.items()}
    np.testing.assert_array_equal(body.state(named), start)
    for wrong, message in (
        ({("tip", "y"): "1 mm"}, r"the field at \('tip', 'y'\) must be a number, got '1 mm' in Model.state; give m"),
        ({("tipp", "y"): 1e-3}, r"of dofs that exist, such as \(0, 'y'\), got \[\('tipp', 'y'\)\]"),
        ({("root", "y"): 1e-3}, r"leave supports where they are, got \[\(0, 'y'\)\] in Model.state; leave out"),
    ):
        with pytest.raises(ValueError, match=message):
            body.state(wrong)


def test_a_saved_run_is_the_run(runs, tmp_path):
    run = runs[1]
    again = fb.load(run.save(tmp_path / "run"))
    for ask in (
        lambda r: r.displacement("tip", "y", absolute=True),
        lambda r: r.acceleration(5, "rx"),
        lambda r: r.motion("middle"),
        lambda r: r.force(1),
        lambda r: r.reactions()[0]["rx"],
        lambda r: r.energy.stored,
    ):
        np.testing.assert_array_equal(ask(again), ask(run))
    assert [again.name(i) for i in range(4)] == ["upper", "stop at 5, -y", "stop at middle, -rx",
                                                 "element from 2, y to 6"]  # fmt: skip
    assert str(again) == str(run)
    with pytest.raises(ValueError, match="one of the body, or the name of a part; 'tip' is the nearest there is"):
        again.displacement("tipp", "y")


def test_tables_have_names(runs, tmp_path):
    histories, contacts = runs[1].to_csv(tmp_path, places=[("tip", "y"), ("tip", "rx")], quantities=["displacement",
                                         "force", "reactions"])  # fmt: skip
    head = histories.read_text(encoding="utf-8").splitlines()[0]
    for word in ('"displacement at tip, y [m]"', '"displacement at tip, rx [rad]"', "force upper [N]",
                 "reaction rx 0 (Fixed at 'root') [N m]"):  # fmt: skip
        assert word in head
    first, *rest = contacts.read_text(encoding="utf-8").splitlines()
    assert first.startswith("stop,name,place,direction,t_in")
    assert len(rest) == len(runs[1].contacts)
    assert sum(row.startswith("0,upper,") for row in rest) == np.sum(runs[1].contacts.stop == 0)


def test_orbit_and_branch_are_those_of_the_beam():
    def scene(body, supports, stop, base):
        return fb.Scene(body, supports, stops=[stop], damping=fb.ModalDamping(0.02), base=base)

    beam = scene(BEAM, [fb.Clamped(0.0)], fb.Stop(LENGTH, LAW, 1e-3, "above"), drive())
    body = scene(beam_structure(), [fb.Clamped("root")], fb.Stop("tip", LAW, 1e-3, direction="y"), {"y": drive()})
    beam, body = beam.reduce(modes=2, elements=ELEMENTS), body.reduce(modes=2)
    one = beam.orbit()
    other = body.orbit(start=one.state)
    close(one.state, other.state, 1e-7)
    close(np.sort(np.abs(one.multipliers)), np.sort(np.abs(other.multipliers)), 1e-6)
    close(one.extremes(LENGTH), other.extremes(("tip", "y")), 1e-7)
    span = (179.0, 180.5)
    first, second = (m.branch("omega", span, start=o).run() for m, o in ((beam, one), (body, other)))
    close(first.parameter, second.parameter, 1e-6)
    close(first.extremes(LENGTH), second.extremes(("tip", "y")), 1e-6)


# --- bodies in space ------------------------------------------------------------------------------------------------


def test_base_motion_of_three_components_against_scipy():
    """M ẍ + C ẋ + K x = -M Σ r_i ÿ_i with a stop, by an independent integrator on the full matrices."""
    truss = space_truss()
    base = {c: fb.Harmonic(1e-3 * (i + 1), 40.0 + 13 * i) for i, c in enumerate("xyz")}
    n = np.array([0.6, 0.0, 0.8])
    stop = fb.Stop("top", LAW, 5e-4, direction=tuple(n), on="foot")
    grounded = [fb.Spring(node, 3e3, direction=c) for node in (1, 2, 3) for c in "xyz"]
    dashpots = [fb.Dashpot("top", 4.0, direction=(1.0, 1.0, 0.0))]
    scene = fb.Scene(truss, springs=grounded, dashpots=dashpots, stops=[stop], base=base)
    run = scene.reduce(modes="all").simulate(0.15, 0.01)

    K = truss.K.toarray() + 3e3 * np.diag([1.0] * 9 + [0.0] * 3)
    M, r, w, d = truss.M.toarray(), np.kron(np.ones((4, 1)), np.eye(3)), np.zeros(12), np.zeros(12)
    w[9:], w[:3], d[9:11] = n, -n, np.sqrt(0.5)
    inverse, accelerations = np.linalg.inv(M), [base[c].derivative(2) for c in "xyz"]

    def rate(t, x):
        u, v = x[:12], x[12:]
        delta, closing = w @ u - 5e-4, w @ v
        pushed = float(LAW.force(delta, closing)) if delta > 0.0 else 0.0
        motion = np.array([shaken(t) for shaken in accelerations], dtype=float)
        return np.concatenate([v, inverse @ (-w * pushed - K @ u - 4.0 * d * (d @ v)) - r @ motion])

    exact = solve_ivp(rate, (0.0, 0.15), np.zeros(24), "DOP853", run.t, rtol=1e-11, atol=1e-14, max_step=2e-4).y
    assert len(run.contacts) > 3
    np.testing.assert_allclose(run.motion("top"), exact[9:12].T, rtol=0, atol=3e-6 * np.abs(exact[9:12]).max())
    moved = run.displacement("top", "z", absolute=True) - run.displacement("top", "z")
    np.testing.assert_allclose(moved, base["z"](run.t), atol=1e-18)
    together = run.displacement(["top", "foot"], (1, 1, 1), absolute=True)
    frame = sum(base[c](run.t) for c in "xyz") / np.sqrt(3)
    np.testing.assert_allclose(together - run.displacement(["top", "foot"], (1, 1, 1)), frame[:, None] * np.ones(2),
                               atol=1e-17)  # fmt: skip


def test_effective_masses_sum_to_the_moved_mass_in_each_direction():
    springs = [fb.Spring(node, 3e3, direction=c) for node in (1, 2, 3) for c in "xyz"]
    model = fb.Scene(space_truss(), springs=springs).reduce(modes="all")
    np.testing.assert_allclose(model.effective_mass.sum(axis=0), [5.0, 5.0, 5.0], rtol=1e-9)
    np.testing.assert_allclose(model.moving_mass, [5.0, 5.0, 5.0], rtol=1e-12)
    assert "5 kg" in str(model)
    by_share = fb.Scene(space_truss(), springs=springs).reduce(mass_share=0.9)
    assert np.all(by_share.effective_mass.sum(axis=0) >= 0.9 * 5.0)


def test_bodies_of_both_kinds_meet():
    """A stop between a beam and a structure that is the same beam gives what two beams give."""

    def scene(other, on):
        free = fb.Scene(BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.01), base=drive(), bodies=[other],
                        stops=[fb.Stop(LENGTH, LAW, 2e-4, on=on[0], **on[1])])  # fmt: skip
        return free.reduce(modes="all", elements=ELEMENTS)

    stiff = fb.Spring(LENGTH, 400.0)
    beams = scene(fb.Scene(BEAM, [fb.Clamped(0.0)], springs=[stiff]), ((1, LENGTH), {"side": "above"}))
    mixed = scene(fb.Scene(beam_structure(), [fb.Clamped("root")], springs=[fb.Spring("tip", 400.0, direction="y")]),
                  ((1, "tip"), {"direction": "y"}))  # fmt: skip
    one, other = (model.simulate(0.1, 1e-3) for model in (beams, mixed))
    assert len(one.contacts) > 2
    close(one.contacts.t_in, other.contacts.t_in)
    close(one.displacement(LENGTH, body=1), other.displacement("tip", "y", body=1))


# --- bad input ------------------------------------------------------------------------------------------------------

STRUCTURE, CLAMP = beam_structure(), [fb.Fixed("root")]
BAD = [
    (lambda: fb.Scene(STRUCTURE, [fb.Clamped("rot")]), r"'root' is the nearest there is, got 'rot' in supports\[0\]"),
    (lambda: fb.Scene(STRUCTURE, [fb.Clamped(0.25)]), "a place must be a point or a node of the structure"),
    (lambda: fb.Scene(STRUCTURE, [fb.Guided("root")]), "Guided is for a Beam"),
    (lambda: fb.Scene(STRUCTURE, [fb.Fixed("root", "x")]), "a support must hold dofs that exist; .* has y, rx"),
    (lambda: fb.Scene(STRUCTURE, [fb.Fixed("root"), fb.Fixed(0, "y")]), "supports must not hold one dof twice"),
    (lambda: fb.Fixed("root", "w"), "dofs must be of x, y, z"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, stops=[fb.Stop("tip", LAW)]), r"a place by name needs a direction"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, stops=[fb.Stop("tip", LAW, direction="x")]), "must move along x; it has y, rx"),
    (lambda: fb.Stop("tip", LAW, side="above", direction="y"), "side and direction exclude each other"),
    (lambda: fb.Stop("tip", LAW, direction="up"), "direction must be one of"),
    (lambda: fb.Stop("tip", LAW, direction="y", of="rotation"), "of must be left out where a direction is given"),
    (lambda: fb.Stop("tip", LAW, direction="y", name=""), "name must be text"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, stops=[fb.Stop("tip", LAW, direction="y", on="tip")]), "must be another place"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, stops=[fb.Stop("tip", LAW, direction="y", on="tp")]), "'tip' is the nearest"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, stops=2 * [fb.Stop("tip", LAW, direction="y")]), "must not share one place"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, springs=[fb.Spring("tip", 1.0)]), "needs a direction"),
    (lambda: fb.Spring("tip", 1.0, 2.0, direction="y"), "rotational is for parts without a direction"),
    (lambda: fb.PointForce("tip", drive(), "rx"), "make it a PointMoment"),
    (lambda: fb.PointMoment("tip", drive(), "y"), "direction of a moment must be a rotation"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, base=drive()), "base must name its directions.*write base={'y': signal}"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, base={"x": drive()}), "base must move along y, got 'x'"),
    (lambda: fb.Scene(STRUCTURE, CLAMP, impactors=[fb.Impactor("tip", 1.0, -1.0, LAW)]), "needs a direction"),
    (lambda: fb.Scene(STRUCTURE, CLAMP).reduce(elements=4), "elements must be left out"),
    (lambda: fb.Scene(STRUCTURE, CLAMP).reduce(modes=17), r"modes must be at most 16 \(free dofs\)"),
    (lambda: fb.Scene(STRUCTURE, CLAMP).reduce([0, 0]), "mode numbers must be whole, from 0, each once"),
    (lambda: fb.Scene(STRUCTURE, CLAMP).reduce([0.7]), "mode numbers must be whole"),
    (lambda: fb.Scene(STRUCTURE, CLAMP).buckling_load(), "buckling_load is for a Beam"),
    (lambda: fb.Scene(space_truss()).reduce(modes=1).phi("top"), "needs a direction of x, y, z"),
    (lambda: fb.Scene(BEAM, [fb.Clamped("root")]), "z must be a number on a Beam, which has no names"),
    (lambda: fb.Scene(BEAM, [fb.Clamped(0.0)], stops=[fb.Stop(0.5, LAW, direction="x")]), "bends in one plane"),
    (lambda: fb.Scene(BEAM, [fb.Clamped(0.0)], springs=[fb.Spring(0.5, 1.0, direction="y")]), "not a Beam"),
    (lambda: fb.Scene(BEAM, [fb.Fixed(0.0, "x")]), "it has y and rx"),
    (lambda: fb.Scene(BEAM, [fb.Clamped(0.0)], base={"y": drive()}), "base of a Beam must be one signal"),
]


test_bad_input_is_refused_in_a_sentence = refused(*BAD)


def test_what_has_no_meaning_says_so(runs, tmp_path):
    run = runs[1]
    for ask in (run.moment, run.shear, run.stress, run.slope):
        with pytest.raises(ValueError, match="is of a Beam or a Frame, which have sections"):
            ask("tip")
    with pytest.raises(ValueError, match="is of a Beam or a Frame, which have sections"):
        run.extremes("moment")


def test_a_structure_that_may_drift_is_told():
    with pytest.warns(UserWarning, match="6 rigid-body modes appear in Scene: supports and springs do not hold"):
        fb.Scene(space_truss(), forces=[fb.PointForce("top", drive(), "x")]).reduce(modes=7)


def test_influence_is_that_of_beams_alone():
    """1 on translations, of impactors too; refused where a body has directions, instead of zeros."""
    strike = fb.Impactor(0.5, mass=0.1, law=LAW, gap=1e-3, velocity=0.0)
    beams = fb.Scene(BEAM, [fb.Clamped(0.0)], impactors=[strike]).matrices(elements=2)
    assert beams.influence.tolist() == [1, 0, 1, 0, 1]
    with pytest.raises(ValueError, match="influence is known of a Beam only"):
        _ = fb.Scene(space_truss()).matrices().influence


def test_a_support_of_a_beam_by_components():
    """Fixed on a Beam is Clamped, or Pinned, or Guided."""
    for dofs, kind in (((), fb.Clamped), (("y",), fb.Pinned), (("rx",), fb.Guided)):
        scenes = fb.Scene(BEAM, [fb.Fixed(0.0, *dofs)]), fb.Scene(BEAM, [kind(0.0)])
        one, other = (scene.reduce(modes=3, elements=6).omega for scene in scenes)
        np.testing.assert_array_equal(one, other)


def test_directions_of_a_beam_are_its_sides():
    """ "y" is above, "-y" below, "-rx" stops u_z > 0: the same bits."""

    def model(*stops):
        return fb.Scene(BEAM, [fb.Clamped(0.0)], stops=list(stops)).reduce(modes=3, elements=6)

    sides = model(fb.Stop(0.5, LAW, 0.1, "above"), fb.Stop(0.5, LAW, 0.1, "below"),
                  fb.Stop(0.5, LAW, 0.1, "above", of="rotation"))  # fmt: skip
    directions = model(*(fb.Stop(0.5, LAW, 0.1, direction=way) for way in ("y", "-y", "-rx")))
    np.testing.assert_array_equal(sides.directions, directions.directions)


@pytest.mark.parametrize("motion", [None, {"x": fb.Harmonic(1e-3, 45.0, 0.3)}])
def test_reactions_know_where_the_damping_of_a_structure_acts(motion):
    """A chain between two walls whose dashpots, in its own C, are strong at one end and on the frame."""
    K, C = (_chain(sizes) for sizes in ([1e4, 2e4, 8e3, 1.5e4], [60.0, 2.0, 1.0, 0.0]))
    C[2, 2] += 40.0
    M, labels = np.diag([1.0, 0.7, 1.2, 0.5, 0.9]), [(i, "x") for i in range(5)]
    force, base = fb.Harmonic(30.0, 60.0, 0.2), None if motion else {"x": fb.Harmonic(2e-3, 50.0)}
    supports = [fb.Fixed(0, "x", motion=motion), fb.Fixed(4, "x")]
    scene = fb.Scene(fb.Structure(K, M, C, labels), supports, forces=[fb.PointForce(3, force, "x")], base=base)
    run = scene.reduce(modes="all").simulate(0.5, 1e-3)
    u, v, a = (np.array([ask(i, "x") for i in range(5)]) for ask in (run.displacement, run.velocity, run.acceleration))
    if base:
        a = a + base["x"].derivative(2)(run.t)
    held = K @ u + C @ v + M @ a
    held[3] -= force(run.t)
    np.testing.assert_allclose(held[1:4], 0.0, atol=1e-6)
    for reaction, exact in zip(run.reactions(), held[[0, 4]], strict=True):
        np.testing.assert_allclose(reaction["x"], exact, atol=1e-9 * abs(exact).max())


def _chain(sizes):
    """The matrix of springs or dashpots in a row."""
    ends = np.diff(np.eye(len(sizes) + 1), axis=0)
    return ends.T @ np.diag(sizes) @ ends
