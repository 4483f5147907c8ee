"""Studies of methods: speed against accuracy, maps of stability; their figures; the example of failures."""

import csv
import re
import sys
from dataclasses import replace
from functools import partial
from io import StringIO
from pathlib import Path
from runpy import run_path
from types import SimpleNamespace

import numpy as np
import pytest
from problems import TIP, paper_scene
from refusals import refused_by

import fembeam as fb
from contacts import KelvinVoigt, PiecewiseLinear
from fembeam.cli import main
from fembeam.study import NoReferenceError, Point, SpeedAccuracy, Verdict, mode_count, speed_accuracy, stability_map
from fembeam.study.measure import cut
from fembeam.study.quantities import Amplitude, Psd
from solvers import RK4, CentralDifference, DormandPrince, Exponential, HenonRK2, Newmark

EXAMPLES = Path(__file__).parent.parent / "examples"
METHODS = [Exponential(1e-4), Exponential(1e-8), DormandPrince(1e-8), RK4(4e-5), RK4(1e-5), HenonRK2(1.0, 1.0)]


# --- speed against accuracy ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found():
    models = [paper_scene().reduce(modes=n) for n in (3, 1)]
    return speed_accuracy(models, METHODS, starts=3, duration=0.05, rounds=1)


@pytest.mark.parametrize(
    "study",
    [
        lambda scene: speed_accuracy(scene, [RK4(1e-5)]),
        lambda scene: speed_accuracy([scene.reduce(modes=1), scene], [RK4(1e-5)]),
        lambda scene: fb.study.peak(scene, "omega", "stops[0].gap", [1e-3, 2e-3], (60.0, 90.0)),
        lambda scene: fb.study.backbone(scene, [1.0, 2.0], (60.0, 90.0)),
        lambda scene: fb.study.basins(scene),
        lambda scene: fb.study.bifurcation(scene, "omega", [60.0, 70.0]),
        lambda scene: fb.study.stationary(scene, 1.0, 1e-3),
        lambda scene: fb.study.ensemble(scene, 2, fb.study.characteristics),
    ],
)
def test_a_scene_in_place_of_its_model_is_refused(study):
    with pytest.raises(ValueError, match=r"model must be a Model, got Scene.* in .*; scene.reduce"):
        study(paper_scene())


def test_errors_fall_with_the_setting_and_reduction_errors_with_modes(found):
    by = {(p.method, p.setting, p.modes): p for p in found.points}
    for modes in (1, 3):
        assert by["Exponential", "rtol=1e-08", modes].error < 1e-7
        assert by["RK4", "dt=1e-05", modes].error < 0.5 * by["RK4", "dt=4e-05", modes].error
        assert by["DormandPrince", "rtol=1e-08", modes].law_calls > 100
    assert found.reduction[3] == 0.0
    assert found.reduction[1] > 1e-3
    fine = by["Exponential", "rtol=1e-08", 1]
    assert fine.total == pytest.approx(found.reduction[1], rel=1e-3)  # a finer step is wasted on one mode
    assert all(len(p.errors) == 3 for p in found.points if not p.failure)


def test_a_refused_method_is_listed_with_its_reason(found):
    refused = [p for p in found.points if p.method == "HenonRK2"]
    assert len(refused) == 2
    assert all("unstable in flight" in p.failure and not p.errors.size and np.isnan(p.time) for p in refused)
    assert "unstable in flight" in str(found)


def test_errors_are_those_of_plain_runs(found):
    models = {n: paper_scene().reduce(modes=n) for n in (1, 3)}
    start = np.array([1e-4, -0.02])
    one = speed_accuracy(models[1], [RK4(1e-5)], starts=start, duration=0.03, rounds=1)
    runs = [models[1].simulate(0.03, start=start, solver=solver) for solver in (RK4(1e-5), Exponential(1e-12))]
    ends = [models[1].phi(TIP) @ run.q[-1] for run in runs]
    assert one.points[0].error == pytest.approx(abs(ends[0] - ends[1]) / abs(ends[1]), rel=1e-3)


def test_references_that_disagree_are_refused():
    model = paper_scene().reduce(modes=2)
    with pytest.raises(NoReferenceError, match=r"2 modes .* differ by .* run shorter, or ask for a statistic"):
        speed_accuracy(model, [Exponential()], starts=1, duration=0.1, agreement=1e-18, rounds=1)


def test_statistics_on_a_long_horizon():
    def impact_rate(run):
        return len(run.contacts) / run.t[-1]

    model = paper_scene().reduce(modes=2)
    options = {"starts": 2, "duration": 3.0, "quantity": impact_rate, "agreement": 0.1, "rounds": 1}
    result = speed_accuracy(model, [Exponential(1e-6), HenonRK2(1e-4, 2e-5)], **options)
    assert result.quantity == "impact rate, relative"
    assert result.unit > 10.0
    assert all(p.error < 0.15 for p in result.points)


def test_the_orbit_a_method_settles_to():
    model, period = paper_scene().reduce(modes=2), 2.0 * np.pi / 195.0

    def settled(run):
        return Amplitude()(cut(run, run.t[-1] - period, run.t[-1]))

    near = model.orbit().state * 1.01
    solvers = [Exponential(1e-6, ledger=False), RK4(1e-4), RK4(5e-5)]
    result = speed_accuracy(model, solvers, near, 15 * period, period / 60, settled, rounds=1)
    best, coarse, fine = (point.error for point in result.points)
    assert best < 1e-7
    assert 3.0 * fine < coarse < 1e-2  # its own orbit, not that of the start
    assert result.claim() == "below 0.0001 Exponential is the front everywhere"


def late_spectrum(run):
    """Where rounding errors have grown to the size of the motion, after 1 to 2 s here."""
    return Psd(parts=2)(cut(run, 2.5, 5.5))


def test_starts_are_taken_with_the_stop_open():
    """From within a contact its law would not know how fast it was entered. The stop is closed half of the time."""
    scene = replace(paper_scene(), stops=[fb.Stop(TIP, KelvinVoigt(300.0, 0.1))])
    begun = []
    speed_accuracy(
        *(scene.reduce(modes=1), [RK4(1e-4)]),
        **{"starts": 8, "duration": 0.05, "dt": 0.01, "rounds": 1, "agreement": np.inf},
        quantity=lambda run: begun.append(run.indentation()[0]) or 1.0,
    )
    assert len(begun) >= 3 * 8  # two references and one method
    assert max(begun) <= 0.0


@pytest.mark.chaotic
def test_the_spectrum_of_a_long_response_is_known_to_its_scatter():
    """Methods that are exact enough differ from another as that one does from a third: by the scatter of chaos.

    The first of the two parts carries the spectrum's size. It scatters by 4.3 % (60 starts), so differences are
    half-normal, of 6 %. The median of eight of them is above three times the largest of eight others with a probability
    of 4e-6 (drawn 1e7 times, one of each pair in common); that largest is beyond 0.1 or 60 % with less than 1e-14.
    """
    model = replace(paper_scene(), base=fb.Harmonic(1e-3, 300.0)).reduce(modes=2)
    options = {"starts": 8, "duration": 5.5, "dt": 1e-3, "quantity": late_spectrum, "rounds": 1}
    result = speed_accuracy(model, [Exponential(1e-4, ledger=False), HenonRK2(1e-4, 5e-5)], **options, agreement=1.0)
    assert 1e-3 < result.floor[2] < 0.6
    assert all(point.error < 3.0 * result.floor[2] for point in result.points)
    assert result.claim() == ""
    assert len(result.front(2)) <= 2
    with pytest.raises(NoReferenceError, match="ask for a statistic and allow its scatter"):
        speed_accuracy(model, [Exponential(1e-4)], **{**options, "starts": 1})


def test_the_front_is_what_no_point_beats():
    def point(method, seconds, error, modes=2):
        return Point(method, "", modes, np.array([seconds]), np.array([error]), np.array([error]), 1.0, 1.0)

    rows = ("a", 1.0, 1e-3), ("b", 2.0, 1e-5), ("a", 3.0, 1e-4), ("b", 1.5, 1e-2), ("a", 9.0, 1e-9, 5)
    points = [point(*row) for row in rows]
    result = SpeedAccuracy(points, 1.0, {2: 0.0, 5: 0.0}, {2: 0.1, 5: 0.0})
    assert result.front(2) == points[:2]
    assert result.beaten("a") == [points[1]]
    assert result.beaten("b", better_than=1e-2) == [points[0], points[4]]
    assert not result.beaten("b", better_than=1e-10)
    assert result.claim("b") == "below 0.0001 b is the front, but for a with 5 modes"
    assert SpeedAccuracy(points, 1.0, {2: 1e-3}, {2: 0.1}).front(2) == points[:1]  # what is below the floor is alike


def test_table_and_figure(found, tmp_path):
    found.save(tmp_path / "table.csv")
    with open(tmp_path / "table.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(found.points)
    assert float(rows[0]["error"]) == found.points[0].error
    figure = fb.plot.speed_accuracy(found)
    assert len(figure.axes) == 2
    figure.savefig(tmp_path / "chart.png")


def test_command_line(tmp_path, capsys):
    text = (EXAMPLES / "beam_stop.toml").read_text().split("[simulate]")[0]
    base = '[base]\nkind = "harmonic"\namplitude = 1e-3\nomega = 195.0\n\n'
    text = re.sub(r"(?ms)^\[base\].*?(?=^\[)", base, text)
    scene = tmp_path / "scene.toml"
    scene.write_text(text + "[speed_accuracy]\nmodes = [1, 2]\nrtols = [1e-6]\nsteps = [5e-5]\nstarts = 2\n"
                     "duration = 0.03\nrounds = 1\n")  # fmt: skip
    assert main(["run", str(scene), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert "RK4" in capsys.readouterr().out
    assert {p.name for p in (tmp_path / "out").iterdir()} >= {f"speed_accuracy.{k}" for k in ("csv", "png", "txt")}
    scene.write_text(text + "[speed_accuracy]\nrtols = [1e-20]\n")
    assert main(["run", str(scene), "--out", str(tmp_path / "out")]) == 2
    assert "[speed_accuracy]: rtols must lie in" in capsys.readouterr().err


test_bad_input_is_refused = refused_by(
    lambda change: speed_accuracy(**{"model": paper_scene().reduce(modes=2), "methods": [Exponential()], **change}),
    ({"starts": 0}, "starts must be at least 1"),
    ({"starts": np.zeros((2, 3))}, "starts must have 4 columns"),
    ({"rounds": 0}, "rounds must be at least 1"),
    ({"duration": -1.0}, "duration must be finite and positive"),
    ({"methods": []}, "methods must hold one"),
    ({"methods": Exponential()}, "methods must be a list of one or more, got Exponential"),
)


def test_models_must_be_nested_and_methods_be_methods():
    scene = paper_scene()
    with pytest.raises(ValueError, match="nested"):
        speed_accuracy([scene.reduce(modes=[1]), scene.reduce(modes=2)], [Exponential()])
    with pytest.raises(TypeError, match="methods must be given with their settings"):
        speed_accuracy(scene.reduce(modes=2), [Exponential])


# --- maps ------------------------------------------------------------------------------------------------------------


def test_map_over_modes_agrees_with_the_predicted_limits(tmp_path):
    steps = np.array([1e-5, 5e-5, 1e-4, 2e-4, 8e-4])
    found = stability_map(paper_scene(), RK4, steps, modes=(2, 10), duration=0.05)
    assert found.verdict.shape == found.error.shape == (2, 5)
    for line, flight, contact in zip(found.verdict, found.flight, found.contact, strict=True):
        assert not np.any(line[steps < 0.9 * min(flight, contact)] == Verdict.UNSTABLE)
    assert np.all(found.verdict[1, steps > 1.1 * found.flight[1]] == Verdict.UNSTABLE)
    assert found.verdict[0, 0] == found.verdict[1, 0] == Verdict.ACCURATE
    assert found.error[0, 0] < found.tolerance
    assert "predicted" in str(found)
    fb.plot.stability_map(found).savefig(tmp_path / "map.png")


@pytest.mark.parametrize("wanted", [True, False])
def test_studies_show_progress_on_a_terminal_when_asked(wanted, monkeypatch):
    """A map showed none, studies of modes did under `fembeam run --quiet` too."""
    terminal = StringIO()
    terminal.isatty = lambda: True
    monkeypatch.setattr(sys, "stderr", terminal)
    stability_map(paper_scene(), RK4, [1e-5, 5e-5], modes=(1, 2), duration=0.01, progress=wanted)
    assert ("4/4" in terminal.getvalue()) == wanted
    terminal.truncate(0)
    mode_count(paper_scene(), [1, 2], "peak_force", duration=0.1, residual=False, progress=wanted)
    assert ("2/2" in terminal.getvalue()) == wanted


def test_map_over_stiffness_sees_missed_contacts():
    found = stability_map(
        paper_scene(), partial(Newmark, locate=False), [2e-6, 1.5e-3], modes=1, stiffness=[1e7, 1e9], duration=0.1
    )
    assert found.axis == "stiffness"
    assert found.method == "Newmark, events ignored"
    assert np.all(found.verdict[:, 0] <= Verdict.WRONG)
    assert np.all(found.verdict[:, 1] >= Verdict.WRONG)
    assert np.all(np.isinf(found.flight))


def test_map_scales_the_limit_of_the_second_step():
    found = stability_map(paper_scene(), lambda dt: HenonRK2(dt, dt / 10), [1e-5], modes=(1,), duration=0.02)
    plain = stability_map(paper_scene(), lambda dt: HenonRK2(dt, dt), [1e-5], modes=(1,), duration=0.02)
    assert found.contact[0] == pytest.approx(10 * plain.contact[0])
    assert found.flight[0] == pytest.approx(plain.flight[0])


test_bad_maps_are_refused = refused_by(
    lambda change: stability_map(**{"scene": paper_scene(), "method": CentralDifference, "steps": [1e-5], **change}),
    ({"steps": [0.0]}, "steps must be positive"),
    ({"steps": [np.nan]}, "steps must be positive"),
    ({"steps": []}, "steps must be positive"),
    ({"modes": []}, "modes must hold one"),
    ({"stiffness": [], "modes": 1}, "stiffness must hold one"),
    ({"scene": paper_scene(fb.Harmonic(0.0, 195.0)), "modes": 1}, "δ of the first stop must move, got 0.0"),
    ({"tolerance": 2.0}, "tolerance must lie in"),
    ({"stiffness": [1e8]}, "modes must be one count"),
    ({"stiffness": [1e8], "modes": 1, "scene": paper_scene(law=PiecewiseLinear([1e5]))}, "must have a stiffness"),
    ({"scene": fb.Scene(fb.Beam(1.0, fb.Section(1e11, 1e3, 1e-4, 1e-9)), [fb.Clamped(0.0)])}, "must have a stop"),
)


# --- the example of failures -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def gallery():
    return SimpleNamespace(**run_path(str(EXAMPLES / "failure_gallery.py")))


@pytest.mark.parametrize(
    ("title", "naive", "says"),
    [
        ("Heun, steps for 2 modes, with 3", np.inf, ("stopped at", "mode 3 of 3 allows")),
        ("Heun, steps for 2 modes, with 10", np.inf, ("stopped at", "mode 10 of 10 allows")),
        ("A step over a whole contact", 0.1, ("0 contacts", "3 contacts; refuses")),
        ("Hénon's step at grazing", 0.2, ("no entry", "lands")),
        ("Two entries in one step", 0.5, ("0 contacts", "2 contacts")),
        ("Chatter", 1.0, ("stopped", "at rest after")),
        ("Newmark at an elastic stop", 1.0, ("times its energy", "keeps it")),
        ("Aliased high modes in contact", 0.5, ("stable, but", "checks each mode")),
        ("Preloaded, permanent contact", 10.0, ("times too far", "one contact")),
        ("Latched damping at grazing", 1e5, ("without bound", "clipped")),
    ],
)
def test_naive_methods_fail_and_ours_does_not(gallery, title, naive, says):
    (case,) = [case for case in gallery.cases if case.title == title]
    assert case.naive_error >= naive
    assert case.our_error < 1e-3
    assert all(part in said for part, said in zip(says, case.said, strict=True))


def test_failures_are_drawn(gallery):
    figure = gallery.drawn(gallery.cases)
    assert [axis.get_title(loc="left") for axis in figure.axes] == [case.title for case in gallery.cases]
    figure.canvas.draw()
