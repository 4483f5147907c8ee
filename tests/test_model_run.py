"""The reduced model and its runs: hand-over, starts, histories, forces, files."""

import math
import pickle
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest
from problems import PAPER_OMEGA, TIP, paper_scene, two_sided_scene

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt

PERIOD = 2 * math.pi / 195.0


@pytest.fixture(scope="module")
def model():
    return paper_scene().reduce(2)


@pytest.fixture(scope="module")
def run(model):
    return model.simulate(3 * PERIOD, PERIOD / 200)


# --- model --------------------------------------------------------------------------------------------------------


def test_system_is_the_modal_one(model):
    system = model.system
    np.testing.assert_array_equal(system.M, np.eye(2))
    np.testing.assert_allclose(system.K, np.diag(model.omega**2), rtol=1e-15)
    np.testing.assert_allclose(system.C, np.diag(2 * model.zeta * model.omega), rtol=1e-14, atol=1e-15)
    np.testing.assert_array_equal(model.zeta, [0.02, 0.01])
    np.testing.assert_array_equal(system.contacts[0].direction, model.phi(TIP))
    vector, signal = system.loads[0]
    np.testing.assert_array_equal(vector, -model.participation)
    assert signal(0.013) == model.scene.base.derivative(2)(0.013)
    assert model.phi(TIP)[0] > 0.0


def test_chosen_modes_keep_their_own_damping():
    chosen = paper_scene(zeta=(0.02, 0.01, 0.03)).reduce([0, 2])
    np.testing.assert_allclose(chosen.omega, [PAPER_OMEGA[0], PAPER_OMEGA[2]], rtol=1e-6)
    np.testing.assert_array_equal(chosen.zeta, [0.02, 0.03])


def test_a_beam_moves_with_its_frame_along_y_alone(model):
    np.testing.assert_array_equal(model.participation_along("y"), model.participation)
    with pytest.raises(ValueError, match="the frame must move along y, got 'z' in Model"):
        model.participation_along("z")


def test_share_of_the_first_mode_of_a_cantilever():
    # Γ²/ρAl = (2 σ/λ)², σ = (sinh λ - sin λ)/(cosh λ + cos λ), whatever mesh the modes asked for need
    lam = 1.875104068711961
    sigma = (np.sinh(lam) - np.sin(lam)) / (np.cosh(lam) + np.cos(lam))
    steel = fb.Section.circle(2.1e11, 7800.0, 0.01)
    exact = pytest.approx((2 * sigma / lam) ** 2, rel=1e-5)
    model = fb.Scene(fb.Beam(0.5, steel), [fb.Clamped(0.0)]).reduce(modes=1)
    assert model.effective_mass[0] / model.moving_mass == exact
    pair = fb.Scene(fb.Frame.straight(0.5, steel, bending_only=True), [fb.Clamped("A")]).reduce(modes=2)
    np.testing.assert_allclose(pair.effective_mass.sum(axis=0) / pair.moving_mass, exact.expected, rtol=1e-5)


@pytest.mark.parametrize("frame", [False, True])
def test_moving_mass_of_rigid_bodies_at_supports(frame):
    # a pin leaves m e to the slope, which moves (m e)²/(m e² + J); a clamp nothing; 400 elements miss 1/1000 of ρAl
    steel = fb.Section.circle(2.1e11, 7800.0, 0.01)
    places = ("A", "B", ("A-B", 0.2)) if frame else (0.0, 0.5, 0.2)
    body = fb.Frame.straight(0.5, steel, bending_only=True) if frame else fb.Beam(0.5, steel)
    masses = [fb.LumpedMass(places[0], 2.0, inertia=0.1, offset=0.3), fb.LumpedMass(places[1], 5.0),
              fb.LumpedMass(places[2], 0.2, offset=0.1)]  # fmt: skip
    scene = fb.Scene(body, [fb.Pinned(places[0]), fb.Clamped(places[1])], masses)
    own, exact = steel.line_mass * 0.5, (2.0 * 0.3) ** 2 / (2.0 * 0.3**2 + 0.1) + 0.2
    assert np.ravel(scene.reduce(modes=2).moving_mass)[0] == pytest.approx(own + exact, rel=1e-12)
    of_mesh = scene.reduce(modes=2, elements=400)
    assert np.ravel(of_mesh.moving_mass)[0] == pytest.approx(0.9985 * own + exact, abs=1e-3 * own)


def test_moving_mass_of_joined_frames_is_that_of_one_frame():
    steel = fb.Section.circle(2.1e11, 7800.0, 0.01)
    first, second = (fb.Frame.polyline({"A": a, "B": b}, steel) for a, b in (((0, 0), (0, 1)), ((0, 1), (2, 1))))
    beside = [fb.Scene(second, [fb.Clamped("B")])]
    scene = fb.Scene(first, [fb.Clamped("A")], [fb.LumpedMass((0, "B"), 0.5)], bodies=beside,
                     joints=[fb.Joint("B", to=(1, "A"), dofs="xy")])  # fmt: skip
    np.testing.assert_allclose(scene.reduce(modes=2).moving_mass, 2 * [3 * steel.line_mass + 0.5], rtol=1e-12)


def test_start_of_a_mode_shape_is_that_mode(model):
    start = model.state(displacement=lambda z: 2e-3 * model.phi(z)[:, 1], velocity=lambda z: 0.3 * model.phi(z)[:, 0])
    np.testing.assert_allclose(start, [0.0, 2e-3, 0.3, 0.0], atol=3e-6 * 0.3)
    assert not model.rest().any()
    assert model.rest().shape == (4,)
    np.testing.assert_array_equal(model.state(), model.rest())


def test_start_of_wrong_length_is_refused(model):
    for start in (np.zeros(2), np.zeros((2, 2)), np.zeros(5)):
        with pytest.raises(ValueError, match=r"start must have shape \(4,\), \[q, q_dot\]"):
            model.simulate(0.1, start=start)
    with pytest.raises(ValueError, match=r"q0 must be finite, got nan at coordinate 1"):
        model.simulate(0.1, start=[0.0, math.nan, 0.0, 0.0])


def test_place_off_the_beam_is_refused(model, run):
    for z in (-1e-3, 0.26, math.nan):
        with pytest.raises(ValueError, match=r"z must lie on the beam, 0 to 0.2599 m"):
            model.phi(z)
        with pytest.raises(ValueError, match=r"z must lie on the beam"):
            run.displacement([0.1, z])


# --- run ----------------------------------------------------------------------------------------------------------


def test_run_is_the_systems_solution(model, run):
    solution = solvers.integrate(model.system, np.zeros(2), np.zeros(2), 3 * PERIOD, PERIOD / 200)
    np.testing.assert_array_equal(run.t, solution.t)
    np.testing.assert_allclose(run.q, solution.q, atol=1e-6 * np.abs(solution.q).max())
    assert len(run.contacts) == len(solution.contacts) == 4
    assert run.status == "finished"
    assert run.complete


def test_start_is_used_and_kept(model):
    start = np.array([1e-5, 2e-6, 0.01, 0.02])
    kept = start.copy()
    run = model.simulate(0.01, 0.005, start=start)
    np.testing.assert_array_equal(start, kept)
    np.testing.assert_allclose(np.concatenate([run.q[0], run.q_dot[0]]), start, rtol=1e-13)


def test_displacement_is_the_modal_sum(model, run):
    u, v = run.displacement([0.1, TIP]), run.velocity(0.1)
    assert u.shape == (len(run.t), 2)
    assert v.shape == run.t.shape
    np.testing.assert_allclose(u[:, 0], run.q @ model.phi(0.1), rtol=1e-13)
    np.testing.assert_allclose(u[:, 1], run.displacement(TIP), rtol=1e-13)
    np.testing.assert_allclose(v, run.q_dot @ model.phi(0.1), rtol=1e-13)
    np.testing.assert_array_equal(run.displacement(0.0), 0.0)


def test_indentation_follows_the_side_and_the_gap():
    scene = two_sided_scene(gap=2e-4)
    run = scene.reduce(2).simulate(PERIOD, PERIOD / 100)
    u = run.displacement(TIP)
    np.testing.assert_allclose(run.indentation(0), -u - 2e-4, rtol=1e-12)
    np.testing.assert_allclose(run.indentation(1), u - 2e-4, rtol=1e-12)
    np.testing.assert_array_equal(run.indentation(-1), run.indentation(1))
    for stop in (2, -3):
        with pytest.raises(ValueError, match=r"stop must be below 2, the number of stops"):
            run.indentation(stop)
        with pytest.raises(ValueError, match=r"stop must be below 2, the number of stops"):
            run.force(stop)


@pytest.mark.parametrize("law", [Hysteretic(2.1e8, 0.9), KelvinVoigt(1e5, 5.0), Hertz(2.1e8)], ids=repr)
def test_force_is_the_law_with_the_latched_entry_rate(law):
    run = paper_scene(law=law).reduce(2).simulate(3 * PERIOD, PERIOD / 2000)
    log, delta, rate, force = run.contacts, run.indentation(), -run.velocity(TIP), run.force()
    assert len(log) >= 3
    expected = np.zeros_like(run.t)
    for t_in, t_out, speed in zip(log.t_in, log.t_out, log.speed_in, strict=True):
        during = (run.t > t_in) & (run.t < t_out)
        assert during.sum() > 20
        expected[during] = law.force(delta[during], rate[during], speed)
    np.testing.assert_allclose(force, expected, rtol=1e-12, atol=1e-9)
    # and its time integral is the logged impulse
    impulse = np.sum(force) * PERIOD / 2000
    assert impulse == pytest.approx(log.impulse.sum(), rel=2e-3)
    assert force.max() <= log.peak_force.max() * (1 + 1e-9)


def test_force_uses_the_floor_of_slow_entries():
    law = Hysteretic(2.1e8, 0.9, entry_rate_floor=10.0)
    run = paper_scene(law=law).reduce(2).simulate(PERIOD, PERIOD / 2000)
    assert run.contacts.entry_rate_clipped.all()
    during = run.indentation() > 0.0
    expected = law.force(run.indentation()[during], -run.velocity(TIP)[during], 10.0)
    np.testing.assert_allclose(run.force()[during], expected, rtol=1e-13)


def test_progress_bar_changes_nothing(model, run):
    with_bar = model.simulate(3 * PERIOD, PERIOD / 200, progress=True)
    np.testing.assert_array_equal(with_bar.q, run.q)


def interrupted(model, monkeypatch):
    """A run stopped by Ctrl-C at its third report."""
    from contextlib import contextmanager

    calls = []

    def report(t):
        calls.append(t)
        if len(calls) == 3:
            raise KeyboardInterrupt

    @contextmanager
    def fake_bar(duration, wanted):
        yield report

    monkeypatch.setattr("fembeam.model.model.bar", fake_bar)
    return model.simulate(1000.0, 1e-3, solver=solvers.HenonRK2(2e-5, 2e-6))


def test_interrupted_run_is_marked_partial_and_can_be_saved(model, monkeypatch, tmp_path):
    partial = interrupted(model, monkeypatch)
    assert not partial.complete
    assert partial.status.startswith("interrupted: partial result up to the time reached (t = ")
    assert 0.1 < partial.t[-1] < 10.0
    whole = model.simulate(partial.t[-1], 1e-3, solver=solvers.HenonRK2(2e-5, 2e-6))
    np.testing.assert_allclose(partial.q[:50], whole.q[:50], rtol=1e-12, atol=1e-18)
    again = fb.load(partial.save(tmp_path / "partial"))
    assert again.status == partial.status
    assert not again.complete


def test_failing_run_raises_with_what_was_computed(model):
    heun = solvers.HenonRK2(5e-3, 5e-3, force_unstable=True)
    with pytest.raises(solvers.SolverError, match=r"the method is unstable.*: try .* s") as caught:
        model.simulate(5.0, 1e-2, start=[0, 1e-9, 0, 0], solver=heun)
    assert np.all(np.isfinite(caught.value.solution.q))


# --- files --------------------------------------------------------------------------------------------------------


def test_saved_run_comes_back_exactly(run, tmp_path):
    path = run.save(tmp_path / "first")
    assert path == tmp_path / "first.npz"
    again = fb.load(path)
    for name in ("t", "q", "q_dot", "stops"):
        np.testing.assert_array_equal(getattr(again, name), getattr(run, name))
    for name, column in run.contacts.arrays().items():
        np.testing.assert_array_equal(again.contacts.arrays()[name], column)
        assert again.contacts.arrays()[name].dtype == column.dtype
    for field in fields(run.energy):
        np.testing.assert_array_equal(getattr(again.energy, field.name), getattr(run.energy, field.name))
    assert (again.status, again.scene, again.cost) == (run.status, run.scene, run.cost)
    np.testing.assert_array_equal(again.displacement([0.1, TIP]), run.displacement([0.1, TIP]))
    np.testing.assert_array_equal(again.velocity(0.2), run.velocity(0.2))
    np.testing.assert_array_equal(again.indentation(), run.indentation())
    np.testing.assert_array_equal(again.force(), run.force())
    np.testing.assert_array_equal(again.energy.residual, run.energy.residual)


HISTORIES = {
    "displacement": lambda run: run.displacement(TIP),
    "velocity": lambda run: run.velocity(TIP),
    "acceleration": lambda run: run.acceleration(TIP),
    "moment": lambda run: run.moment(0.0),
    "extremes": lambda run: run.extremes("shear"),
    "reactions": lambda run: run.reactions(),
    "indentation": lambda run: run.indentation(),
    "indentation_rate": lambda run: run.indentation_rate(),
    "force": lambda run: run.force(),
    "time_history": lambda run: fb.plot.time_history(run),
    "to_dataframe": lambda run: run.to_dataframe(),
}


@pytest.mark.parametrize("asked", HISTORIES.values(), ids=HISTORIES)
def test_histories_of_a_run_without_samples_are_refused(model, asked, tmp_path):
    """Its last state alone passed for a history: 5.6e-5 m for a largest displacement of 7.2e-4 m."""
    run = model.simulate(PERIOD)
    for one in (run, fb.load(run.save(tmp_path / "run"))):
        with pytest.raises(ValueError, match=r"need output samples, got .*; give simulate a dt"):
            asked(one)


def test_the_end_alone_can_be_asked_for(model, tmp_path):
    run, end = model.simulate(PERIOD), model.simulate(PERIOD, dt=[PERIOD])
    np.testing.assert_allclose(end.displacement(TIP), run.q @ model.phi(TIP), rtol=1e-9)
    np.testing.assert_array_equal(run.end, np.concatenate((run.q[-1], run.q_dot[-1])))
    assert fb.load(end.save(tmp_path / "end")).indentation().shape == (1,)
    assert "displacement" not in str(run)
    assert "contacts" in str(run)


def test_open_contact_survives_the_file(model, tmp_path):
    log = model.simulate(PERIOD).contacts
    inside = 0.5 * (log.t_in[0] + log.t_out[0])
    run = model.simulate(inside, inside / 20)
    assert np.isnan(run.contacts.t_out).all()
    assert run.force()[-1] > 0.0
    again = fb.load(run.save(tmp_path / "open.npz"))
    assert np.isnan(again.contacts.t_out).all()
    assert again.force()[-1] == run.force()[-1]


def test_missing_file_is_missing(tmp_path):
    with pytest.raises(FileNotFoundError):
        fb.load(tmp_path / "nowhere.npz")


@pytest.mark.parametrize("damage", ["cut", "flip", "text", "empty"])
def test_damaged_file_is_refused(run, tmp_path, damage):
    path = run.save(tmp_path / "run.npz")
    whole = path.read_bytes()
    middle = len(whole) // 2
    turned = bytes(255 - b for b in whole[middle : middle + 64])
    flipped = whole[:middle] + turned + whole[middle + 64 :]
    path.write_bytes({"cut": whole[:middle], "flip": flipped, "text": b"hello", "empty": b""}[damage])
    with pytest.raises(ValueError, match=r"run.npz is not a saved run, or is damaged"):
        fb.load(path)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("t", lambda t: t[:-1], r"t must have shape \(\d+,\), it has"),
        ("t", lambda t: t[::-1], "t must be finite and increase"),
        ("t", lambda t: np.where(t == t[5], np.nan, t), "t must be finite and increase"),
        ("t", lambda t: t.astype(str), "t must hold numbers"),
        ("q", lambda q: q > 0.0, "q must hold numbers, it has type bool"),
        ("contact_stop", lambda s: s > 0, "contact_stop must hold numbers"),
        ("kinds", lambda k: k + 0.5, "kinds must hold truth values, it has type float64"),
        ("q", lambda q: q[:, :1], "q_dot must have shape"),
        ("q", lambda q: q[:, 0], "q must have two dimensions"),
        ("q_dot", lambda q: q.T, "q_dot must have shape"),
        ("force", lambda f: f[:, 1:], "force must have shape"),
        ("stops", lambda s: np.vstack([s, s]), "force must have shape"),
        ("stops", lambda s: s * np.nan, "stops must be finite"),
        ("directions", lambda w: w[:, :1], "directions must have shape"),
        ("impactor_masses", lambda m: np.ones(9), "impactor_masses must have shape"),
        ("nodes", lambda z: z[1:], "shapes must have shape"),
        ("nodes", lambda z: z[::-1], "nodes must be finite and increase"),
        ("contact_stop", lambda s: s + 1, "contact_stop must hold numbers of stops, 0 to 0"),
        ("contact_stop", lambda s: s + 0.5, "contact_stop must hold numbers of stops"),
        ("contact_t_out", lambda t: t - 1.0, "contact_t_out must not be before"),
        ("contact_impulse", lambda p: p[1:], "contact_impulse must have shape"),
        ("energy_input", lambda e: e[1:], "energy_input must have shape"),
        ("energy_initial", lambda e: np.ones(3), r"energy_initial must have shape \(\)"),
    ],
)
def test_arrays_that_contradict_each_other_are_refused(run, tmp_path, name, change, message):
    with np.load(run.save(tmp_path / "run.npz")) as data:
        arrays = {key: data[key] for key in data.files}
    np.savez(tmp_path / "run.npz", **{**arrays, name: change(arrays[name])})
    with pytest.raises(ValueError, match=f"its arrays contradict each other: {message}"):
        fb.load(tmp_path / "run.npz")


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"x": np.arange(3)}, "is not a saved run"),
        *(({"about": about}, "is not a saved run") for about in ('{"format": 5}', "{}", "[1]")),
        *(({"about": f'{{"format": {n}}}'}, f"has format {n}, this version reads 5; simulate again$") for n in (2, 99)),
    ],
)  # fmt: skip
def test_archive_of_something_else_is_refused(tmp_path, arrays, message):
    np.savez(tmp_path / "other.npz", **arrays)
    with pytest.raises(ValueError, match=rf"other\.npz {message}"):
        fb.load(tmp_path / "other.npz")


def test_saved_file_has_the_usual_permissions(run, tmp_path):
    plain = tmp_path / "plain"
    plain.write_bytes(b"")
    assert run.save(tmp_path / "run").stat().st_mode == plain.stat().st_mode


def test_model_survives_pickling(model):
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.simulate(PERIOD).q, model.simulate(PERIOD).q)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda run: run.displacement(0.1, body=1), "body must be below 1, the number of beams, got 1"),
        (lambda run: run.stress(0.1, body="tip"), "body must be below 1, the number of beams, got 'tip'"),
        (lambda run: run.force("below"), "no contact has this name, got 'below' in Run"),
        (lambda run: run.to_csv("x", quantities="stress"), "quantities must be a list, got 'stress'"),
        (lambda run: run.to_csv("x", places=0.1), "places must be a list, got 0.1"),
        (lambda run: run.to_csv("x", places=[0.1, ("C", "x")]), r"of a beam must be numbers, got \[\('C', 'x'\)\]"),
        *((lambda run, bad=bad: run.model.simulate(bad), "duration must be finite and positive")
          for bad in (0.0, -1.0, math.nan, math.inf)),
        (lambda run: run.model.simulate(0.1, dt=-1e-3), "dt must be positive and finite"),
        (lambda run: run.model.state(lambda z: np.full_like(z, np.nan)), "the field must be finite on the beam"),
        (lambda run: run.model.simulate("1", 1e-3), "duration must be a number, got '1' in Model.simulate"),
        (lambda run: run.model.simulate(1.0, "1 ms"), "dt must be real numbers, got '1 ms'"),
        (lambda run: run.model.simulate(1.0, start="rest"), "start must be real numbers, got 'rest'"),
        (lambda run: run.model.scene.reduce(2.5), "modes must be a whole number or a list of them, got 2.5"),
        (lambda run: replace(run.model.scene, stops=[fb.Stop(0.1, Hertz(1e8), on=(1, 0))]), "must name a body, and"),
    ],
)  # fmt: skip
def test_bad_arguments_are_refused_in_words(run, ask, message):
    with pytest.raises(ValueError, match=message):
        ask(run)


RAGGED = [[1.0, 2.0], [3.0]]


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda run: fb.ModalDamping(RAGGED), r"zeta\[0\] must be a number, got \[1.0, 2.0\]"),
        (lambda run: run.model.scene.reduce(RAGGED), "mode numbers must be whole, from 0, each once"),
        (lambda run: run.model.scene.reduce(np.array(2.5)), "modes must be a whole number or a list of them"),
        (lambda run: fb.pdf(np.arange(9.0), bins=RAGGED), "edges of bins must be real numbers"),
        (lambda run: fb.study.basins(run.model, points=RAGGED), "points must be one or two whole numbers"),
        (lambda run: fb.study.mode_count(run.model.scene, np.array(2), "peak_force"), "counts must be a list"),
        (lambda run: fb.study.floor_spectra(run, np.array(0.2)), "places must be a list of one or more"),
        (lambda run: fb.Stop(0.2, Hertz(1e8), direction=np.array(1.0)), "direction must be a name or a vector"),
        (lambda run: fb.Stop(0.2, Hertz(1e8), side=np.array([])), "side must be 'below' or 'above'"),
        (lambda run: fb.Stop(0.2, Hertz(1e8), of=np.array(["rotation"] * 2)), "of must be 'displacement' or"),
        (lambda run: fb.SineSweep(1e-3, 10.0, 20.0, 1.0, np.ones(2)), "kind must be 'linear' or 'logarithmic'"),
        (lambda run: run.model.orbit(10**400), "period counts periods of the load"),
        (lambda run: solvers.System(RAGGED, RAGGED, RAGGED), "M must be real numbers in rows of equal length"),
        (lambda run: solvers.System.modal(RAGGED, 0.1), "omega must be real numbers in rows of equal length"),
        (lambda run: solvers.System.modal([1.0], 0.1, [], [(RAGGED, math.cos)]), "vector of load 0 must be real"),
        (lambda run: solvers.Contact(RAGGED, Hertz(1e8)), "direction of a Contact must be real numbers"),
        (lambda run: solvers.integrate(solvers.System.modal([1.0], 0.1), RAGGED, [0.0], 1.0), "q0 must be real"),
    ],
)  # fmt: skip
def test_ragged_rows_and_arrays_without_a_length_are_refused_in_words(run, ask, message):
    """They ended in the words of NumPy."""
    with pytest.raises(ValueError, match=message):
        ask(run)


def test_a_run_that_goes_on_within_a_contact_warns_of_its_rate_of_entry(run):
    """Hysteretic's, not KelvinVoigt's; at rest in contact it is the floor, as ever."""
    log = run.contacts
    within, open_again = 0.5 * (log.t_in[0] + log.t_out[0]), log.t_out[0] + 1e-4
    with pytest.warns(UserWarning, match="is in contact at the start, and its law goes by the rate"):
        run.model.simulate(1e-4, start=run.model.simulate(within).end)
    elastic = replace(run.model.scene, stops=[replace(run.model.scene.stops[0], law=KelvinVoigt(1e5, 2.0))]).reduce(2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run.model.simulate(1e-4, start=run.model.simulate(open_again).end)
        elastic.simulate(1e-4, start=elastic.simulate(within).end)
        pressed = replace(run.model.scene, stops=[replace(run.model.scene.stops[0], gap=-1e-4)], base=None).reduce(2)
        pressed.simulate(1e-4, start=pressed.equilibrium())
        noisy = replace(pressed.scene, base=fb.BandNoise(2e-4, (0.0, 900.0), seed=1)).reduce(2)
        warnings.filterwarnings("ignore", message=".* one realisation")
        fb.study.stationary(noisy, 2.0, 1e-3, discard=0.1)  # whose segments go on wherever the one before has come to
