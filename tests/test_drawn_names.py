"""Names of parts, places, laws and folders in figures: drawn letter by letter, whatever matplotlib reads in them."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.text import Text
from problems import ROD_FILE

import fembeam as fb
import solvers
from contacts import Hertz, Jenkins, KelvinVoigt
from fembeam import plot, study
from fembeam.cli import main
from fembeam.plot.axis_names import axis_name
from fembeam.plot.style import verbatim
from fembeam.results import files
from fembeam.results.compare import overlaid

ROUND = fb.Section.circle(2.1e11, 7800.0, 0.01)
BROKEN, PAIR, HIDDEN = "$\\delta_{x$", "cost $5 to $6 each", "_a"  # no formula, one by accident, no label of a legend
DAMPING = fb.ModalDamping(0.02)


def shown(figure):
    """The texts of a figure as they are drawn, after drawing it; formulas as None."""
    figure.draw_without_rendering()
    found = []
    for text in figure.findobj(Text):
        formula = text.get_parse_math() and len(re.findall(r"(?<!\\)\$", text.get_text())) in range(2, 99, 2)
        found.append(None if formula else text.get_text().replace("\\$", "$"))
    return found


def legend(figure):
    """All entries of legends as they are drawn."""
    figure.draw_without_rendering()
    legends = [*figure.legends, *(axis.get_legend() for axis in figure.axes)]
    return [text.get_text().replace("\\$", "$").strip() for one in legends if one for text in one.get_texts()]


@pytest.fixture(scope="module")
def scene():
    law, places = KelvinVoigt(1e5, 10.0), (0.5, 0.4, 0.3)
    stops = [fb.Stop(z, law, gap=1e-5, name=name) for z, name in zip(places, (BROKEN, PAIR, HIDDEN), strict=True)]
    return fb.Scene(fb.Beam(0.5, ROUND), [fb.Clamped(0.0, name=PAIR + "!")], stops=stops, damping=DAMPING,
                    base=fb.Harmonic(1e-3, 200.0))  # fmt: skip


@pytest.fixture(scope="module")
def run(scene):
    return scene.reduce(2).simulate(0.3, 1e-3)


def test_verbatim_is_drawn_as_it_is():
    for name in (BROKEN, PAIR, HIDDEN, "\\$", "a\\$b$c$", "100 %", "x^2_3", "\\frac", "$", "$$"):
        text = Text(0.0, 0.0, verbatim(name))
        drawn, formula = text._preprocess_math(text.get_text())
        assert (drawn.strip(), formula) == (name, False)


def test_stops_in_figures_of_a_run(run):
    assert legend(plot.time_history(run)) == [BROKEN, PAIR, HIDDEN]
    assert {BROKEN, PAIR, HIDDEN} <= {*legend(plot.animation.frame(run, 0.1))}
    for draw in files.figures(run).values():
        draw().draw_without_rendering()
    title = plot.time_history(run, z=0.4).get_suptitle()
    assert PAIR in title.replace("\\$", "$")


def test_the_rig(scene):
    said = " ".join(text or "" for text in shown(scene.figure())).split()
    for name in (BROKEN, PAIR, HIDDEN):
        assert name in " ".join(said)


def test_studies(scene):
    found = fb.study.vary(scene, {f"stops[{PAIR}].gap": [1e-4, 2e-4]}, "rms", duration=0.05, dt=1e-3, modes=1)
    assert any(text and text.startswith(f"gap of {PAIR}") for text in shown(found.figure()))
    assert axis_name("stops[1].gap", scene) == f"gap of {PAIR} / m"  # tables and files have it without escapes


def test_laws_by_name():
    laws = {BROKEN: Jenkins(2e4, 10.0), PAIR: Jenkins(1e4, 10.0), HIDDEN: Jenkins(3e4, 10.0)}
    assert legend(plot.hysteresis(laws)) == [BROKEN, PAIR, HIDDEN]
    bounced = legend(plot.loops({name: Hertz(1e8) for name in laws}))
    assert [entry.partition(": e =")[0] for entry in bounced] == [BROKEN, PAIR, HIDDEN]


def test_signals_and_spectra_by_name():
    t = np.linspace(0.0, 4.0, 401)
    spectrum = fb.response_spectrum(t, np.sin(9.0 * t), periods=np.geomspace(0.05, 5.0, 9), zeta=[0.02])
    entries = legend(plot.response_spectrum({BROKEN: spectrum, HIDDEN: spectrum}))
    assert [entry.partition(", ζ")[0] for entry in entries[:-1]] == [BROKEN, HIDDEN]


def test_places_of_frames():
    """Nodes and members whose names look like formulas."""
    nodes = {"$A_{$": (0.0, 0.0), PAIR: (0.0, 1.0), "$C$": (1.0, 1.0)}
    frame = fb.Frame(nodes, [fb.Member("$A_{$", PAIR, ROUND), fb.Member(PAIR, "$C$", ROUND)])
    push = fb.PointForce("$C$", fb.Harmonic(5.0, 30.0), direction="y")
    scene = fb.Scene(frame, [fb.Clamped("$A_{$")], forces=[push], damping=DAMPING)
    assert "clamp at $A_{$" in " ".join(text or "" for text in shown(scene.figure())).replace("\n", " ")
    run = scene.reduce(2).simulate(0.5, 1e-3)
    assert any(text and "$C$, x" in text for text in shown(plot.time_history(run, z=("$C$", "x"))))
    for figure in (plot.densities(run), plot.spectrum(run), plot.mode_shapes(run.model), plot.deflected(run)):
        figure.draw_without_rendering()
    response = run.model.frequency_response(np.linspace(1.0, 90.0, 30), "forces[0]", [("$C$", "x"), (PAIR, "x")])
    assert legend(plot.frequency_response(response)) == ["$C$, x", f"{PAIR}, x"]


def test_circles():
    shaft = fb.Frame.straight(1.0, ROUND, bending_only=True)
    stop = fb.AnnularStop("B", KelvinVoigt(1e5, 10.0), 1e-4, name=BROKEN)
    push = fb.PointForce("B", fb.Harmonic(5.0, 30.0), direction="y")
    run = fb.Scene(shaft, [fb.Clamped("A")], stops=[stop], forces=[push], damping=DAMPING).reduce(2).simulate(0.5, 1e-3)
    assert plot.orbit_in_clearance(run).get_suptitle().replace("\\$", "$") == f"Path at {BROKEN}"
    for figure in (plot.orbit_in_clearance(run), plot.forces_in_clearance(run), plot.animation.frame(run, 0.1)):
        figure.draw_without_rendering()


def test_folders_side_by_side(run):
    assert legend(overlaid({"_out": run, "$a$": run})) == ["_out", "$a$"]


def test_run_of_a_scene_file(tmp_path, monkeypatch, whole_figures):
    """It ended with an error of matplotlib, after the run and before its report."""
    monkeypatch.chdir(tmp_path)
    stop = (
        "name = '$\\delta_{x$'\nz = 0.5\ngap = 1e-4\nlaw = { kind = 'kelvin_voigt', stiffness = 1e5, damping = 10.0 }"
    )
    base = "kind = 'harmonic'\namplitude = 1e-3\nomega = 200.0"
    tables = f"[[stops]]\n{stop}\n[base]\n{base}\n[damping]\nzeta = 0.02\n[reduce]\nmodes = 2"
    Path("rod.toml").write_text(f"{ROD_FILE}{tables}\n[simulate]\nduration = 0.2\ndt = 1e-3\n", encoding="utf-8")
    assert main(["run", "rod.toml", "--out", "out"]) == 0
    assert Path("out/report.html").exists()


def outside(figure):
    """Labels of axes and entries of legends that the figure cuts off."""
    figure.draw_without_rendering()
    texts = [text for axis in figure.axes for text in (axis.xaxis.label, axis.yaxis.label)]
    texts += [text for legend in figure.legends for text in legend.get_texts()]
    frame = figure.bbox.padded(1.0)
    boxes = {text.get_text(): text.get_window_extent() for text in texts if text.get_text()}
    return [name for name, box in boxes.items() if not (frame.contains(*box.min) and frame.contains(*box.max))]


def test_long_names_of_what_varies_are_within_the_figure(scene):
    name = "the third upper snubber of the feedwater line in room 0123, north side"
    scene = dataclasses.replace(scene, stops=[dataclasses.replace(scene.stops[0], name=name)])
    gap, more = {"stops[0].gap": [0.0, 1e-4]}, {"base.amplitude": [1e-4, 1e-3]}
    asked = {"minus the largest displacement in the middle of the beam": lambda run: -abs(run.displacement(0.2)).max()}
    for values in (gap, gap | more, more | gap, gap | more | {"base.omega": [80.0, 90.0]}):
        assert outside(study.vary(scene, values, asked, 0.1, 1e-3, modes=1).figure()) == []


class Peak(SimpleNamespace):
    """What is drawn of one."""


class Fold(SimpleNamespace):
    """What is drawn of one."""


def test_long_names_of_what_a_resonance_goes_along_are_within_the_figure():
    """They were cut off at both ends, below peaks and folds alike."""
    name = "coefficient 3 of the contact law of the third upper snubber of the feedwater line in room 0123 / N/m^3"
    values, titles = np.array([1e-3, 2e-3]), (name, f"amplitude of {name}")
    tops = [SimpleNamespace(value=p, at=100.0 + p, amplitude=p, slope=1.0, stable=True) for p in values]
    peak = Peak(tops=tops, least=None, z=0.5, titles=titles)
    fold = Fold(values=values, at=values, amplitude=values, cusps=[], z=0.5, titles=titles)
    assert outside(plot.peak_curve(peak)) == outside(plot.fold_curve(fold)) == []


def test_the_legend_of_a_single_map_is_within_the_figure(scene):
    """Three columns of it were wider: "able and accurate"."""
    found = study.stability_map(scene, solvers.RK4, [1e-5, 1e-4], modes=[1], duration=0.01)
    assert outside(found.figure()) == []


def test_values_spread_evenly_in_their_logarithm_are_shown_so(scene):
    gaps = np.geomspace(1e-6, 1e-2, 4)
    figures = [study.vary(scene, {"stops[0].gap": x}, "peak_force", 0.1, modes=1).figure() for x in (gaps, [0.0, 1.0])]
    figures += [study.equivalent(Jenkins(2e4, 10.0), x).figure() for x in (gaps, [1e-3, 2e-3])]
    assert [figure.axes[0].get_xscale() for figure in figures] == ["log", "linear"] * 2
    (dot,) = study.equivalent(Jenkins(2e4, 10.0), [1e-3]).figure().axes[0].lines
    assert dot.get_marker() == "o"
