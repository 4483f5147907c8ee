"""Studies: many runs spread over executors, quantities, mode counts, smallest models."""

import warnings
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from problems import PAPER_BEAM, STEEL, paper_scene
from refusals import refused_by, refused_files

import fembeam as fb
import solvers
from contacts import Hertz, Jenkins, KelvinVoigt
from fembeam import scene_file
from fembeam.cli import main
from fembeam.model import Model, extremes_of
from fembeam.study import ModeCount, NotMetError, measure, mode_count, smallest_model
from fembeam.study.execution.executors import spread
from fembeam.study.measure import cut
from fembeam.study.mode_count import difference
from fembeam.study.quantities import QUANTITIES, Amplitude, Psd, label, named

SCENE = paper_scene()
FREE = replace(SCENE, stops=[])
STIFF = replace(SCENE, base=None, stops=[fb.Stop(0.24445, law=Hertz(1e10))])


def swing(model):
    """A fast strike in the shape of the static deflection."""
    return model.state(velocity=lambda z: -2.0 * (z / 0.2599) ** 2)


def shifted(x):
    if x == 13:
        raise ValueError("thirteen")
    return x + 1


@pytest.mark.parametrize("pool", [None, ThreadPoolExecutor, ProcessPoolExecutor])
def test_spread_keeps_the_order(pool):
    items = range(20, 9, -1)
    executor = pool(2) if pool else None
    try:
        assert spread(shifted, iter(range(5, -1, -1)), executor) == [6, 5, 4, 3, 2, 1]
        with pytest.raises(ValueError, match="thirteen") as error:
            spread(shifted, items, executor)
        assert "item 7: 13" in error.value.__notes__
    finally:
        if executor:
            executor.shutdown()


# --- quantities and parts of runs ------------------------------------------------------------------------


def test_amplitude_finds_extremes_between_samples():
    # one undamped mode let go from rest: amplitude is what it was let go from
    scene = replace(FREE, damping=fb.ModalDamping(0.0), base=None)
    model = scene.reduce(1)
    start = np.array([1e-3, 0.0])
    run = model.simulate(0.5, dt=2 * np.pi / model.omega[0] / 32.3, start=start)
    exact = 1e-3 * model.phi(0.2599)[0]
    assert Amplitude(z=0.2599)(run) == pytest.approx(exact, rel=2e-6)
    assert np.ptp(run.displacement(0.2599)) / 2 < exact * (1 - 1e-5)  # the samples alone miss it


def test_extremes_of_cubics_that_begin_at_rest():
    """Where the slope is 0 at a sample the other extreme of the cubic was left out: 0.2 instead of 0.31."""
    a, b, c = 0.0, 1.6, -1.4
    top = -2.0 * b / (3.0 * c)
    found = extremes_of(np.array([0.0, 1.0]), np.array([0.0, a + b + c]), np.array([a, a + 2.0 * b + 3.0 * c]))
    assert found == pytest.approx((0.0, b * top**2 + c * top**3), rel=1e-12)


def test_parts_of_a_run_make_the_whole():
    run = SCENE.reduce(2).simulate(1.0, dt=1e-3)
    parts = [measure.cut(run, a, b) for a, b in ((0.0, 0.25), (0.25, 0.7), (0.7, 1.0))]
    assert sum(len(part.contacts) for part in parts) == len(run.contacts)
    assert [part.t[0] for part in parts] == pytest.approx([0, 0, 0], abs=1e-12)
    assert parts[1].t[-1] == pytest.approx(0.45)
    np.testing.assert_array_equal(parts[1].q, run.q[250:701])
    np.testing.assert_array_equal(parts[2].energy.input, run.energy.input[700:])
    np.testing.assert_allclose(parts[1].contacts.t_in + 0.25, run.contacts.t_in[len(parts[0].contacts) :][
        : len(parts[1].contacts)])  # fmt: skip
    rates = [QUANTITIES["impact_rate"]()(part) * part.t[-1] for part in parts]
    assert sum(rates) == pytest.approx(len(run.contacts))
    coarse = SCENE.reduce(2).simulate(1.0, dt=0.3)  # the last sample is at 0.9 s, the log goes on to 1 s
    assert QUANTITIES["impact_rate"]()(coarse) == len(coarse.contacts)


@pytest.mark.filterwarnings("ignore:contacts last fewer")
def test_every_quantity_has_a_value_and_a_name():
    run = SCENE.reduce(2).simulate(4.0, dt=1e-3)
    with pytest.raises(ValueError, match="the stop must have friction, got 0 in WearPower"):
        named("wear_power")(run)
    for name in [name for name in QUANTITIES if name != "wear_power"]:
        value = np.asarray(named(name)(run))
        assert np.all(np.isfinite(value)), name
        assert np.any(value != 0), name
        assert label(named(name)) == name
    spectrum = fb.psd(run.indentation(), 1e-3, 1024)
    level = Psd((100.0, 300.0), 1)(run)[0] * 200.0
    assert level == pytest.approx(spectrum.variance_in(100.0, 300.0), rel=0.1)
    mean = np.trapezoid(run.energy.stored, run.t) / run.t[-1]
    assert QUANTITIES["energy"]()(run) == pytest.approx(mean, rel=1e-9)
    assert label(Psd((1.0, 9.0))) == "psd(band=(1.0, 9.0))"
    assert label(swing) == "swing"


# --- mode_count ------------------------------------------------------------------------------------------


def test_linear_beam_converges_at_the_rate_of_its_modes():
    # tip of a beam shaken slowly: mode i adds Γ φ/ω² ~ i⁻¹ i⁻⁴
    scene = fb.Scene(fb.Beam(1.0, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.1), base=fb.Harmonic(1.0, 1.0))
    study = mode_count(scene, [1, 2, 3, 4, 6, 12], Amplitude(z=1.0))
    # differences of neighbours alternate in sign, so the error is about half the first term left out
    assert 4.0 < study.rate < 6.5
    assert np.isnan(study.rate_residual)
    assert study.row(12).reference
    assert study.closest < 1e-4


def test_paper_scene_needs_more_than_two_modes_for_its_peak():
    study = mode_count(SCENE, [1, 2, 3, 10, 20], "peak_force")
    errors = [study.row(n).error for n in (1, 2, 3, 10)]
    assert errors[0] > 0.5
    assert errors[1] > 0.5
    assert 0.05 < errors[2] < 0.4
    assert errors[3] < 0.01
    assert all(row.measured.share == pytest.approx(1.0, abs=1e-9) for row in study.rows if row.residual)
    table = str(study)
    assert "reference" in table
    assert "static share" in table
    assert len(study.figure().axes) == 2


def test_values_of_a_mode_count_have_their_unit(tmp_path):
    scene = fb.Scene(fb.Beam(1.0, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.1), base=fb.Harmonic(1.0, 1.0))
    for quantity, head in (("amplitude", "value / m"), (lambda run: float(run.q[-1, 0]), "value  ")):
        study = mode_count(scene, [1, 2], quantity, duration=0.1, dt=1e-2)
        assert head in str(study)
        study.save(tmp_path / "modes.csv")
        assert f",{head.strip().replace('/ m', '[m]')}," in (tmp_path / "modes.csv").read_text().splitlines()[0]


@pytest.mark.filterwarnings("ignore:.* of the velocity")
def test_fast_strike_on_a_stiff_stop():
    study = mode_count(STIFF, [1, 2, 12], "peak_force", duration=0.05, start=swing, reference=24)
    assert study.row(2).error > 0.1
    assert study.row(2, residual=True).error > 0.1
    assert study.row(12, residual=True).error < 0.01
    assert study.row(24, residual=True).reference
    full = mode_count(STIFF, [4], "peak_force", duration=0.05, start=swing, reference="full")
    assert full.row(None).reference
    assert full.row(None).measured.coordinates > 80
    assert 0.05 < full.row(4, residual=True).error < 0.2


@pytest.mark.chaotic
def test_random_response_is_paired_and_knows_its_noise():
    """Bounds are six standard deviations away.

    Fifteen sets of seeds gave errors of 0.216 ± 0.007 and 0.042 ± 0.010, and half-widths of 0.03 ± 0.01 for one mode.
    """
    noise = replace(SCENE, base=fb.BandNoise(std=2.5e-4, band=(0.0, 1226.6)))
    study = mode_count(noise, [1, 2, 3], "impact_rate", duration=12.0, discard=2.0, seeds=range(5), residual=False)
    assert study.row(1).resolved  # one mode lacks contacts
    assert study.row(1).error > 2 * study.row(2).error
    assert all(row.uncertainty > 0 for row in study.rows if not row.reference)
    assert study.row(3).measured.values.shape == (5,)


@pytest.mark.drawn
def test_half_width_of_paired_differences():
    rng = np.random.default_rng(1)
    common, covered = rng.normal(10.0, 3.0, (400, 8)), 0
    for x in common:  # what realisations share cancels; the true relative difference is 1 % of the mean
        one, other = (measure.Measured(found, 1, 0.0, 0.0, 1.0, 1.0) for found in (x + 0.1 + rng.normal(0, 0.05, 8), x))
        error, width = difference(one, other)
        covered += abs(error - 0.1 / x.mean()) < width
    assert abs(covered / 400 - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 400)


def test_executor_gives_the_same_study():
    arguments = FREE, [1, 2], Amplitude(z=0.2599)
    with ThreadPoolExecutor(2) as pool:
        spread_out = mode_count(*arguments, executor=pool)
    alone = mode_count(*arguments)
    assert [row.error for row in spread_out.rows] == [row.error for row in alone.rows]


def largest_forces(run):
    """Of eight fifths of a second, once nothing is known of the start any more."""
    log, starts = run.contacts, 1.2 + 0.2 * np.arange(8)
    return [log.peak_force[(log.t_in >= t) & (log.t_in < t + 0.2)].max(initial=0.0) for t in starts]


largest_forces.sampled = False


@pytest.mark.chaotic
def test_studies_of_modes_go_on_where_they_were_interrupted(tmp_path, monkeypatch):
    """Model by model, to the same bits, and to other counts; those of another quantity are refused."""
    runs = {"duration": 0.3, "dt": 1e-3, "discard": 0.1}
    studies = (partial(mode_count, SCENE, [1, 2, 3]), partial(smallest_model, SCENE, tolerance=0.4, residual=False))
    reduce, left = fb.Scene.reduce, [0]

    def interrupted(*given, **options):
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt
        return reduce(*given, **options)

    for study in studies:
        call = partial(study, quantity="amplitude", **runs)
        kept = tmp_path / f"{study.func.__name__}.npz"
        whole = call()
        for calls in (3, 2):
            left[0] = calls
            monkeypatch.setattr(fb.Scene, "reduce", interrupted)
            with pytest.raises(KeyboardInterrupt):
                call(checkpoint=kept)
        monkeypatch.undo()
        found = call(checkpoint=kept)
        one, other = ([{**row, "seconds": 0.0} for row in each.table()] for each in (whole, found))
        np.testing.assert_equal(one, other)
        with pytest.raises(ValueError, match=r"another study: study.quantity is 'amplitude' there and 'rms' here"):
            study(quantity="rms", checkpoint=kept, **runs)
    rows = mode_count(SCENE, [1, 4], "amplitude", checkpoint=tmp_path / "mode_count.npz", **runs).rows
    assert [row.modes for row in rows] == [1, 4, 1, 4]


def test_mode_count_doubts_a_chaotic_transient():
    """Errors and sensitivity are distances of realisations in eight numbers each.

    Squares of their ratios follow F with 8 and 8 degrees of freedom: 1 in 5e6 is beyond the factor ten of a doubt.
    """
    chaotic = replace(SCENE, base=fb.Harmonic(1e-3, 300.0))
    with pytest.warns(UserWarning, match=r"3 of 3 errors may be chance, not modes: .* largest_forces .* changes by"):
        study = mode_count(chaotic, [2, 5], largest_forces, duration=2.8)
    assert str(study).endswith(f"IN DOUBT: {study.doubt}")
    loose, tight = (
        np.array(largest_forces(chaotic.reduce(5, residual=True).simulate(2.8, solver=solvers.Exponential(rtol))))
        for rtol in (1e-7, 1e-8)
    )
    assert study.sensitivity == pytest.approx(np.linalg.norm(loose - tight) / np.linalg.norm(tight), rel=1e-6)


@pytest.mark.filterwarnings("error")
def test_mode_count_does_not_doubt_what_settles():
    arguments = SCENE, [1, 2, 5], "peak_force"
    study = mode_count(*arguments, duration=0.25)
    assert 0.0 < study.sensitivity < 1e-6
    assert study.doubt == ""
    assert "IN DOUBT" not in str(study)
    assert mode_count(*arguments, duration=0.25, solver=solvers.RK4(2e-5)).sensitivity is None  # its step is fixed
    assert mode_count(*arguments).sensitivity is None  # groups of periods scatter


@pytest.mark.parametrize(("changed", "words"), [(np.inf, "2 of 2"), (2e-3, "1 of 2"), (2e-5, ""), (1e-6, "")])
def test_doubt_counts_errors_within_ten_times_the_sensitivity(changed, words):
    study = mode_count(FREE, [1, 2, 3], "amplitude", duration=0.05, dt=5e-4)
    errors = [1e-1, 1e-2]
    rows = tuple(replace(row, error=e) for row, e in zip(study.rows, [*errors, 0.0], strict=True))
    found = ModeCount("q", rows, changed)
    assert words in found.doubt
    assert bool(words) == bool(found.doubt)


def growing(run):
    return np.ones(len(run.model.omega))


test_mode_count_rejects = refused_by(
    lambda arguments: mode_count(*arguments),
    ((SCENE, [], "amplitude"), "counts must hold a number of modes"),
    ((SCENE, [0], "amplitude"), "counts must be whole numbers above 0, got 0"),
    ((SCENE, [1.5], "amplitude"), "counts must be whole numbers above 0, got 1.5"),
    ((SCENE, [301], "amplitude"), "modes must be at most 300"),
    ((SCENE, [1], "amplitud"), "quantity must be one of amplitude, rms, peak_force"),
    ((SCENE, [1, 2], growing, 0.01, 1e-3), r"quantity must return one shape, \(3,\) for the reference, got"),
    ((SCENE, [1], lambda run: [], 0.01, 1e-3), "quantity must return a number or an array"),
    ((SCENE, [1], "amplitude", 1.0), "amplitude needs samples, got 'dt = None' in study; give dt$"),
    ((SCENE, [1], growing, 1.0), "growing needs samples.* give dt; a function of contacts alone: set its sampled"),
    ((SCENE, [1], "peak_force", -1.0), "duration must be finite and positive"),
    ((SCENE, [1], "peak_force", 1.0, None, 1.0), "discard must be below the duration"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, [1, 2, 3]), "seeds need noise"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, [1]), "seeds must be at least 3"),
    ((SCENE, [1], "peak_force", None, None, 0.0, [1, 2, 3]), "seeds need a duration"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, 8), "seeds must be a list of seeds, got 8"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, [1, 2, 1]), "seeds must differ, got "),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, [1.5, 2, 3]), "seeds must be whole numbers"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, (), "no"), "residual must be True, False or None, got 'no'"),
    ((SCENE, 3, "peak_force", 1.0), "counts must be a list of numbers of modes, got 3"),
    ((SCENE.reduce(modes=1), [1], "peak_force", 1.0), "scene must be a Scene, got .* of a model, give model.scene"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, (), None, None, [0.0, 0.0]), "start must be a function of a model"),
    ((SCENE, [1], "peak_force", 1.0, None, 0.0, (), None, None, None, None, 4), "executor must be one of concurrent"),
    ((STIFF, [1], "peak_force"), "study without duration needs a periodic response: an orbit"),
    ((STIFF, [1], "peak_force", 0.01), "reference value must be finite and not zero"),
    ((FREE, [1], "contact_time", 0.01), "reference value must be finite and not zero"),
)


def test_quantity_of_the_wrong_kind():
    with pytest.raises(TypeError, match="name or a function"):
        mode_count(SCENE, [1], 3)


# --- smallest_model --------------------------------------------------------------------------------------

PLATE = fb.Section.rectangle(2.1e11, 7800.0, 0.02, 0.005)
TWO_STOPS = fb.Scene(
    beam=fb.Beam(0.5, PLATE),
    supports=[fb.Pinned(0.0), fb.Pinned(0.5)],
    stops=[fb.Stop(0.2, KelvinVoigt(1e5, 5.0), gap=1e-4), fb.Stop(0.35, Hertz(1e8), gap=2e-4, side="above")],
    damping=fb.ModalDamping(0.02),
    forces=[fb.PointForce(0.13, fb.Harmonic(20.0, 300.0))],
)
CASES = {
    "amplitude, periodic": (SCENE, Amplitude(z=0.13), 0.05, {"residual": False}),
    "contact time, chaotic": (replace(SCENE, base=fb.Harmonic(1e-3, 100.0)), "contact_time", 0.5, {"residual": True}),
    "energy, two stops": (TWO_STOPS, "energy", 0.05, {"duration": 0.1, "dt": 1e-4}),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.chaotic] * ("chaotic" in name)) for name in CASES]
)
def test_smallest_model_is_right_afterwards(name):
    """The chaotic case has one attractor: its deviation is 0.03 ± 0.02 in 28 realisations, its tolerance 0.5.

    At 120 rad/s two modes have a second one with contacts 1.6 times as long, which a sixth of the realisations came to.
    """
    scene, quantity, tolerance, how = CASES[name]
    found = smallest_model(scene, quantity, tolerance, **how)
    assert found.met
    assert found.reduction_error + found.integration_error <= tolerance
    finer = scene.reduce(2 * found.modes, residual=found.residual)
    plan = measure.Plan(how.get("duration"), how.get("dt"), start=how.get("start"))
    value, reference = (
        np.mean([named(quantity)(run) for run in measure.runs(model, plan, named(quantity), solvers.Exponential(rtol))])
        for model, rtol in ((found.model, found.rtol), (finer, found.rtol / 100))
    )
    assert abs(value / reference - 1) <= tolerance
    assert value == pytest.approx(float(found.value), rel=tolerance / 10)
    assert "reduction" in str(found)
    assert "integration" in str(found)


@pytest.mark.filterwarnings("ignore:.* of the velocity")
def test_smallest_model_says_when_modes_do_not_suffice():
    with pytest.raises(NotMetError, match=r"peak_force to 0\.01: NOT MET: modes converge too slowly.*up to 2") as error:
        smallest_model(STIFF, "peak_force", 0.01, duration=0.05, start=swing, most=2)
    evidence = error.value.evidence
    assert evidence.model is None
    assert not evidence.met
    assert evidence.solver is None
    two = next(line for line in evidence.reduction if line.choice[:2] == (2, False))
    assert two.error > 0.1
    assert len(evidence.figure().axes) == 1


def jumping(run):
    """As of a mean over contacts where that of six modes has one contact less."""
    return 1.25 if run.q.shape[1] == 6 else 1.0


def test_smallest_model_says_when_a_quantity_jumps_with_modes():
    """It said that modes converge too slowly and the best of up to 16 modes is off by 6.63e-06 of 0.02."""
    with pytest.raises(NotMetError, match=r"does not settle with modes .*, \d modes? .* and 6 modes by 2\.50e-01"):
        smallest_model(FREE, jumping, 0.02, duration=0.02, dt=1e-3, most=4, residual=False)


def test_smallest_model_looks_between_the_counts_that_are_tried():
    """Five modes suffice, and of 4 and 6 only the last."""
    found = smallest_model(FREE, lambda run: 1.0 if run.q.shape[1] > 4 else 1.5, 0.02,
                           duration=0.02, dt=1e-3, most=8, residual=False)  # fmt: skip
    assert len(found.model.omega) == 5


def test_smallest_model_says_when_scatter_hides_it():
    noise = replace(SCENE, base=fb.BandNoise(std=2.5e-4, band=(0.0, 1226.6)))
    with pytest.raises(NotMetError, match=r"scatter hides it.*more seeds"):
        smallest_model(noise, "mean_force", 1e-3, duration=3.0, seeds=range(3), most=1, residual=False)


test_smallest_model_rejects = refused_by(
    lambda tolerance, most: smallest_model(SCENE, "amplitude", tolerance, most=most),
    (0.0, 8, r"tolerance must lie in \(0, 1\), got 0.0"),
    (-1.0, 8, "tolerance must lie"),
    (float("nan"), 8, "tolerance must lie"),
    (0.1, 0, "most must be a whole number, 1 to 64"),
    (0.1, 100, "most must be a whole number, 1 to 64"),
)


# --- from a file -----------------------------------------------------------------------------------------

FILE = """
[beam]
length = 0.2599
section = { E = 1.9e11, rho = 8000, A = 58.3e-6, I = 18.5e-12 }
[[supports]]
kind = "clamped"
z = 0
[damping]
zeta = 0.05
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 100
[mode_count]
counts = [1, 2]
quantity = { kind = "amplitude", z = 0.2 }
[smallest_model]
quantity = "amplitude"
tolerance = 0.01
most = 2
"""


def test_studies_of_a_file(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(FILE)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    written = {file.name for file in (tmp_path / "out").iterdir()}
    assert written >= {f"{study}.{kind}" for study in ("mode_count", "smallest_model") for kind in ("txt", "png")}
    assert capsys.readouterr().out.strip() in "".join(
        (tmp_path / "out" / f"{study}.txt").read_text() for study in ("mode_count", "smallest_model")
    )
    path.write_text(FILE.replace("0.01\nmost = 2", "1e-9\nmost = 1"))
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert "mode_count.npz holds results of [mode_count]: add --resume" in capsys.readouterr().err
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet", "--resume"]) == 1
    said = capsys.readouterr()
    assert "NOT MET" in said.err
    assert "NOT MET" in said.out


test_mistakes_in_a_file = refused_files(
    FILE,
    ("counts = [1, 2]", "counts = []", r"\[mode_count\]: counts must hold"),
    ("tolerance = 0.01", "tolerance = 0", r"\[smallest_model\]: tolerance must lie"),
    ('quantity = "amplitude"', 'quantity = "amplitud"', "did you mean 'amplitude'"),
    ("most = 2", "mots = 2", "unknown key 'mots'; did you mean 'most'"),
    ("most = 2", "duration = 1.0", r"\[smallest_model\]: amplitude needs samples"),
    ("omega = 100", "omega = 0", r"\[mode_count\]: a study without duration needs a periodic response"),
    error=scene_file.SceneFileError,
)


def test_a_part_of_a_run_reads_as_the_run():
    """From a time that is no drive period, with a stop pressed all the time and a slider that has slipped before."""
    parts = {
        "stops": [fb.Stop(0.25, KelvinVoigt(1e3, 0.1), gap=-0.01)],
        "elements": [fb.Element(0.25, Jenkins(3e3, 0.5))],
        "base": fb.Harmonic(1e-3, 195.0, 0.7),
    }
    run = fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02), **parts).reduce(2).simulate(0.3, 1e-3)
    part, kept = cut(run, 0.1234, 0.2888), slice(124, 289)
    np.testing.assert_allclose(part.end, run.model.simulate(0.288).end, rtol=1e-6, atol=1e-9)
    assert np.array_equal(cut(run, 0.1, 0.3).end, run.end)
    np.testing.assert_allclose(part.t + 0.1234, run.t[kept], rtol=1e-12)
    for read in (
        lambda one: one.force(0),
        lambda one: one.force(1),
        lambda one: one.acceleration(0.2, absolute=True),
        lambda one: one.reactions()[0].force,
        lambda one: one.force(1, mean=True)[1:-1],
    ):
        whole, cells = read(run), read(part)
        at = kept if len(whole) == len(run.t) else slice(124, 287)
        np.testing.assert_allclose(cells, whole[at], atol=1e-9 * np.abs(whole).max())
    log, whole = part.transitions, run.transitions
    assert 0 < len(log) < len(whole)
    among = (whole.t >= 0.1234) & (whole.t < 0.2888)
    np.testing.assert_allclose(log.t + 0.1234, whole.t[among], rtol=1e-12)


# --- settled responses to periodic loads, without a duration -----------------------------------------------


def settled(names, base, zeta, **options):
    """Quantities of the response of the paper's beam without its stop, and H (k,) at the tones."""
    scene = replace(FREE, damping=fb.ModalDamping(zeta), base=base)
    found = fb.study.vary(scene, {"beam.length": [PAPER_BEAM.length]}, names, modes=2, **options)
    response = scene.reduce(modes=2).frequency_response(base.tones()[0], "base")
    return [found[name][0] for name in names], response.values


@pytest.mark.parametrize(("share", "zeta"), [(0.9, 1e-3), (6.0, 5e-3)])
def test_a_settled_response_has_settled(share, zeta):
    # 240 periods of the load are not enough where damping is light, or the load quick beside the lowest mode
    omega = share * FREE.reduce(modes=2).omega[0]
    (amplitude, rms), H = settled(["amplitude", "rms"], fb.Harmonic(1e-3, omega), zeta)
    np.testing.assert_allclose([amplitude, np.sqrt(2.0) * rms], 1e-3 * abs(H[0]), rtol=2e-6)


def test_a_settled_response_is_sampled_by_its_fastest_tone():
    # 1 and 200 rad/s have a period of 6.3 s, of which 128 samples meet every second swing
    (amplitude,), H = settled(["amplitude"], fb.Multisine([1e-3, 1e-3], [1.0, 200.0], [0.0, 0.0]), 0.05)
    t = np.linspace(0.0, 2.0 * np.pi, 1_000_001)
    u = (1e-3 * H[0] * np.exp(1j * t) + 1e-3 * H[1] * np.exp(200j * t)).real
    assert amplitude == pytest.approx(np.ptp(u) / 2.0, rel=1e-4)


def test_a_settled_response_takes_dt_and_discard_as_asked_for(monkeypatch):
    asked = []
    simulate = Model.simulate
    monkeypatch.setattr(Model, "simulate", lambda *given: asked.append(given[1:3]) or simulate(*given))
    base = fb.Harmonic(1e-3, 2.0 * np.pi * 20.0)
    settled(["amplitude"], base, 0.05, dt=1e-3, discard=20.0)
    duration, times = asked[-1]
    assert duration == pytest.approx(20.0 + 6.0)
    np.testing.assert_allclose([times[0], times[1] - times[0], times[-1]], [20.0, 1e-3, 26.0])


def test_a_response_without_damping_is_not_called_settled():
    with pytest.warns(UserWarning, match="decays by friction alone, or not at all"):
        settled(["amplitude"], fb.Harmonic(1e-3, 100.0), 0.0)


# --- spectra as a quantity -------------------------------------------------------------------------------


def sampled(t, u, v):
    """What stands for a run of this motion at every place."""
    shapes = SimpleNamespace(nodes=[0.0, 1.0])
    return SimpleNamespace(t=t, stops=(), shapes=shapes, displacement=lambda z: u, velocity=lambda z: v)


@pytest.mark.parametrize("band", [(0.0, 200.0), (50.0, 250.0), (3.0, 290.0)])
def test_levels_of_white_noise_are_alike_in_all_parts(band):
    """Parts have four lines and a bit: counting whole ones made the first level from 0 on 11 % too high."""
    dt, rng = np.pi / 100 / 3.2, np.random.default_rng(3)
    u = rng.standard_normal(400_000)
    white = sampled(dt * np.arange(u.size), u, u)
    np.testing.assert_allclose(Psd(band, parts=4)(white), dt / np.pi, rtol=0.03)


def test_a_peak_near_a_border_stays_in_its_part():
    """Of four lines in each part most of it lay in the part beside: the level there was 6.6 times too high."""
    t = 1e-3 * np.arange(30_001)
    tone = sampled(t, np.sqrt(2.0) * np.sin(109.0 * t), 109.0 * np.cos(109.0 * t))
    power = Psd((1.0, 1201.0), parts=12)(tone) * 100.0
    np.testing.assert_allclose(power, np.arange(12) == 1, atol=1e-3)


@pytest.mark.parametrize("wrong", [
    {"band": 5}, {"band": ("a", "b")}, {"band": (1, 2, 3)}, {"band": (0, np.inf)}, {"parts": "x"}, {"parts": 2.5},
])  # fmt: skip
def test_psd_says_what_is_wrong(wrong):
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be .* in Psd; e.g."):
        Psd(**wrong)


# --- the mesh that [reduce] says -------------------------------------------------------------------------

COARSE = """
[beam]
length = 1.0
section = { E = 2.1e11, rho = 7800, A = 1e-4, I = 1e-9 }
[[supports]]
kind = "clamped"
z = 0
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 30.0
[reduce]
elements = 4
[mode_count]
counts = [1, 2]
quantity = "amplitude"
duration = 0.1
dt = 1e-3
[smallest_model]
quantity = "amplitude"
tolerance = 0.1
duration = 0.1
dt = 1e-3
"""


@pytest.mark.filterwarnings("ignore:elements are too coarse")
def test_studies_of_a_file_use_the_mesh_that_reduce_says(tmp_path, file_of):
    file = file_of(COARSE)
    run = {"quantity": "amplitude", "duration": 0.1, "dt": 1e-3}
    value = Amplitude()(file.scene.reduce(1, elements=4).simulate(0.1, 1e-3, solver=solvers.Exponential(ledger=False)))
    assert file.studies["mode_count"].run(file, tmp_path).row(1).value == pytest.approx(value, rel=1e-9)
    assert mode_count(file.scene, [1, 2], elements=4, **run).row(1).value == pytest.approx(value, rel=1e-9)
    assert mode_count(file.scene, [1, 2], **run).row(1).value != pytest.approx(value, rel=1e-5)
    found = file.studies["smallest_model"].run(file, tmp_path)
    assert found.model.matrices.elements == 4


def test_a_campbell_diagram_of_a_file_uses_the_mesh_that_reduce_says(tmp_path, file_of):
    text = """
        [frame]
        nodes = { A = [0, 0, 0], B = [0, 0, 0.5] }
        [[frame.members]]
        nodes = ["A", "B"]
        section = { shape = "circle", E = 2.1e11, rho = 7850, diameter = 0.04 }
        [[supports]]
        kind = "clamped"
        at = "A"
        [reduce]
        elements = 5
        [campbell]
        spins = [0.0, 300.0]
        points = 2
        modes = 2
        """
    file = file_of(text)
    found = file.studies["campbell"].run(file, tmp_path).omega
    np.testing.assert_array_equal(found, file.scene.campbell([0.0, 300.0], 2, elements=5).omega)
    assert np.abs(found / file.scene.campbell([0.0, 300.0], 2).omega - 1).max() > 1e-7
    with pytest.raises(scene_file.SceneFileError, match="modes must be at most 64, got 1000 in campbell"):
        file_of(text, "campbell.modes=1000")


def test_the_mean_energy_of_samples_that_miss_contacts_is_told():
    """Of 1.4 samples in a contact it is off by 4e-3, with a standard error of 1e-15."""
    scene = paper_scene(fb.Harmonic(1e-3, 108.0))
    with pytest.warns(UserWarning, match="contacts last fewer than 4 samples: the mean energy may be off") as told:
        fb.study.vary(scene, {"base.amplitude": [1e-3, 0.99e-3]}, "energy", modes=2)
    assert len({str(one.message) for one in told}) == 1  # so that Python says it once
    assert {one.filename for one in told} == {__file__}  # they named lines inside the package
    box = {"base.amplitude": (9e-4, 1e-3)}
    with pytest.warns(UserWarning, match="contacts last") as told:
        fb.study.minimise(scene, box, "energy", gradients=False, modes=2, tolerance=0.05)
    assert {one.filename for one in told} == {__file__}  # also where SciPy calls back
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fb.study.vary(scene, {"base.amplitude": [1e-3]}, "energy", modes=2, dt=1e-5, discard=0.1, duration=0.3)
