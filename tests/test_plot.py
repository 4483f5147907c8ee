"""Figures: what they show, without a display."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import fembeam as fb
from contacts import PUBLISHED, Hertz, Hysteretic, bounce, identify
from fembeam import plot, statistics
from fembeam.plot.axis_names import axis_name
from fembeam.results import files as report


@pytest.fixture(scope="module")
def run():
    steel = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    scene = fb.Scene(
        beam=fb.Beam(0.2599, steel),
        supports=[fb.Clamped(0.0)],
        stops=[fb.Stop(0.24445, law=Hertz(2.1e8)), fb.Stop(0.2, law=Hertz(2.1e8), gap=1e-3, side="above")],
        damping=fb.ModalDamping(0.02),
        base=fb.BandNoise(2e-4, (0.0, 1226.6), seed=3),
    )
    return scene.reduce(2).simulate(2.0, 1e-3)


def texts(figure):
    return " ".join(text.get_text() for text in figure.findobj(lambda artist: hasattr(artist, "get_text")))


def test_every_figure_draws_with_units(run):
    drawn = report.figures(run, discard=0.5)
    assert list(drawn) == ["time_history", "psd", "densities", "contacts", "modes"]
    for draw, unit in zip(drawn.values(), ("mm", "rad", "mm", "m s⁻¹", "mm"), strict=True):
        figure = draw()
        figure.canvas.draw()
        assert unit in texts(figure)
        assert all(axis.get_xlabel() or axis.get_ylabel() for axis in figure.axes)


def test_histories_are_those_of_the_run(run):
    window = 1.0, 1.2
    line = plot.time_history(run, window).axes[0].lines[0]
    t, u = line.get_data()
    assert window[0] - 2e-3 <= t[0] <= window[0]
    assert np.interp(1.1, t, u) == pytest.approx(1e3 * run.displacement(0.2599)[1100], rel=1e-9)


def test_peaks_of_two_tones():
    t = 1e-3 * np.arange(60_000)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    found = plot.peaks(fb.psd(np.sin(200 * t) + 0.1 * np.sin(780 * t) + noise, 1e-3, 4096), count=2)
    assert found == pytest.approx([200.0, 780.0], abs=3.0)


def apart(labels):
    """Whether no two of the drawn texts overlap."""
    boxes = [label.get_window_extent() for label in labels if label.get_visible() and label.get_text()]
    assert len(boxes) > 1
    return not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])


def test_labels_of_a_periodic_motion_do_not_overlap(run):
    scene = dataclasses.replace(run.model.scene, base=fb.Harmonic(1e-3, 60.0))
    driven = scene.reduce(6).simulate(6.0, 1e-3)
    figure = plot.spectrum(driven, discard=1.0, omega_max=2500.0)
    figure.draw_without_rendering()
    assert apart(figure.axes[0].texts)
    figure = plot.spectrum(dataclasses.replace(driven, t=driven.t / 10), omega_max=2e4)  # all six frequencies in view
    figure.draw_without_rendering()
    assert apart(figure.axes[1].texts)


@pytest.mark.parametrize("highest", [1.0, 1.7, 5.0, 300.0])
def test_ticks_of_entry_speeds_do_not_overlap(run, highest):
    speeds = np.geomspace(1.0, highest, len(run.contacts))
    log = dataclasses.replace(run.contacts, speed_in=speeds, speed_out=0.7 * speeds)
    axis = (figure := plot.contacts(dataclasses.replace(run, contacts=log))).axes[3]
    figure.draw_without_rendering()
    low, high = axis.get_xlim()
    assert apart([tick for tick in axis.get_xticklabels(which="both") if low <= tick.get_position()[0] <= high])


def test_contacts_that_all_began_at_rest(run):
    log = dataclasses.replace(run.contacts, speed_in=np.zeros(len(run.contacts)))
    assert "no contact began with a speed" in texts(plot.contacts(dataclasses.replace(run, contacts=log)))


def test_a_partial_run_says_so(run):
    partial = dataclasses.replace(run, status="interrupted: partial result")
    assert "PARTIAL RESULT: interrupted" in texts(plot.densities(partial))
    assert "PARTIAL" not in texts(plot.densities(run))


def test_a_run_too_short_gets_the_figures_it_can(run):
    short = run.model.simulate(2e-3, 1e-3)
    drawn = report.figures(short)
    assert list(drawn) == ["time_history", "modes"]
    drawn["time_history"]()
    with pytest.raises(ValueError, match="no finished contact"):
        plot.contacts(short)
    report.summary(run.model.simulate(1e-3, None))


def test_a_loaded_run_draws_without_its_model(run, tmp_path):
    loaded = fb.load(run.save(tmp_path / "run"))
    for draw in report.figures(loaded).values():
        draw()


def test_the_users_settings_are_left_alone(run):
    import matplotlib

    before = dict(matplotlib.rcParams)
    plot.mode_shapes(run.model)
    assert dict(matplotlib.rcParams) == before


def test_segments_resolve_two_rad_per_second_on_long_runs():
    assert 2 * np.pi / (plot.segment_for(600_000, 1e-3) * 1e-3) <= 2.0
    assert plot.segment_for(800, 1e-3) == 100


def test_random_figures_have_units_bands_and_confidence():
    x = np.random.default_rng(1).standard_normal(4000)
    signal = statistics.Signal(x, 1e-3, 256)
    for part in np.split(x, 8):
        signal.add(part)
    orbits = [SimpleNamespace(extremes=lambda z: (-2e-3, 1e-3), mark=None) for _ in range(3)]
    stop = fb.Stop(0.25, Hertz(1e8))
    model = SimpleNamespace(scene=SimpleNamespace(acting=[stop]))
    one = SimpleNamespace(
        family=SimpleNamespace(model=model, period=2, name="base.omega"),
        **{"parameter": np.array([100.0, 150.0, 200.0]), "stable": np.array([True, False, True])},
        **{"orbits": orbits, "special": [], "ends": []},
    )
    branches = {"broad": [one]}
    panels = {"broad": {"δ": signal, "mid": signal.psd}, "narrow": {"δ": signal.psd}}
    figure = plot.random_spectra(panels, 1000.0, {"narrow": (100.0, 200.0)}, branches)
    assert len(figure.axes) == 4
    for word in (
        "PSD / m² s rad⁻¹",
        "ω / rad s⁻¹",
        "broad",
        "narrow",
        "period 2",
        "unstable",
        "max |u| at the stop / mm",
    ):
        assert word in texts(figure)
    assert len(plot.random_spectra(panels, 1000.0).axes) == 2
    figure = plot.random_densities({"δ": signal, "mid": signal})
    for word in ("probability density / mm⁻¹", "δ / mm", "Gaussian", "skewness", " ± "):
        assert word in texts(figure)


def test_figures_of_laws():
    drawn = plot.loops({"hertz": Hertz(2e8), "damped": Hysteretic.hu_guo(2e8, 0.5)}, entry_rate=0.3, mass=0.02)
    assert "damped: e = 0.488" in texts(drawn)
    delta, force = drawn.axes[0].lines[0].get_data()
    exact = 1e3 * (1.25 * 0.02 * 0.3**2 / 2e8) ** 0.4
    assert delta.max() == pytest.approx(exact, rel=1e-4)
    assert force.max() == pytest.approx(2e8 * (1e-3 * exact) ** 1.5, rel=1e-3)
    catalogue = texts(plot.restitutions())
    assert all(name in catalogue for name in PUBLISHED)
    hit = bounce(Hysteretic(2e8, 0.5), 0.3, 0.02)
    figure = plot.identification(identify(hit.delta, hit.delta_dot, hit.force))
    assert "a = 0.5" in texts(figure)
    for one in (drawn, figure):
        one.canvas.draw()
        assert all(axis.get_ylabel() for axis in one.axes)


@pytest.mark.parametrize(
    "draw",
    [lambda: fb.plot.branch([]), lambda: fb.plot.loops({}), lambda: fb.plot.failures([]), fb.plot.stability_map],
)
def test_figures_of_nothing_are_refused(draw):
    with pytest.raises(ValueError, match=r"nothing to draw, got .* in plot\.\w+; give "):
        draw()


PATHS = {
    "base.omega": "drive frequency ω / rad s⁻¹",
    "base.amplitude": "base amplitude / m",
    "forces[0].signal.omega": "drive frequency ω / rad s⁻¹",
    "forces[0].signal.amplitude": "drive amplitude / N",
    "forces[1].signal.amplitude": "drive amplitude / N m",
    "stops[0].gap": "gap of stop 0 / m",
    "stops[0].law.stiffness": "contact stiffness of stop 0 / N/m^p",
    "masses[0].mass": "mass of mass 0 / kg",
    "dashpots[0].rotational": "rotational damping of dashpot 0 / N m s/rad",
    "damping.zeta[0]": "damping ratio ζ",
    "bodies[0].springs[1].foot.omega": "drive frequency ω of beam 1 / rad s⁻¹",
    "stops[0].law.something": "stops[0].law.something",
}


@pytest.mark.parametrize(("path", "words"), PATHS.items(), ids=list(PATHS))
def test_parameters_in_words(run, path, words):
    load = fb.Harmonic(1.0, 2.0)
    scene = dataclasses.replace(run.model.scene, forces=[fb.PointForce(0.1, load), fb.PointMoment(0.1, load)])
    assert axis_name(path, scene) == words


def test_ends_of_branches_are_marked_and_explained(run):
    scene = dataclasses.replace(run.model.scene, base=None, forces=[fb.PointForce(0.2, fb.Harmonic(1.0, 60.0))])
    whole = scene.reduce(1).branch("forces[0].signal.omega", (55.0, 60.0)).run()
    assert [why for _, why in whole.ends] == ["reached the end of the span"]
    assert whole.ends[0][0].parameter in (55.0, 60.0)
    axis = plot.branch(whole).axes[0]
    assert axis.get_xlabel() == "drive frequency ω / rad s⁻¹"
    assert "end: reached the end of the span" in texts(axis.figure)
    lost = SimpleNamespace(
        **{name: getattr(whole, name) for name in ("family", "parameter", "stable", "orbits", "special")},
        ends=[(whole.orbits[0], "lost: no orbit was found"), (whole.orbits[-1], "closed: came back")],
    )
    axis = plot.branch([lost]).axes[0]
    assert "end: lost" in texts(axis.figure)
    assert "end: closed" not in texts(axis.figure)
    (mark,) = [line for line in axis.lines if line.get_label() == "end: lost"]
    assert mark.get_xdata() == [whole.orbits[0].parameter]


def test_shaded_bands_are_the_intervals_of_the_estimates():
    signal = statistics.Signal(np.random.default_rng(1).standard_normal(4000), 1e-3, 64)
    for part in np.split(np.random.default_rng(2).standard_normal(8000), 8):
        signal.add(part)
    drawn = {
        "psd": (plot.random_spectra({"": {"x": signal}}, 1e4), signal.psd.omega, signal.psd.interval()),
        "pdf": (plot.random_densities({"x": signal}), 1e3 * signal.pdf.x, signal.pdf.interval()),
    }
    for name, (figure, x, (low, high)) in drawn.items():
        scale = 1e-3 if name == "pdf" else 1.0
        corners = figure.axes[0].collections[0].get_paths()[0].vertices
        i = len(x) // 2
        at = np.sort(corners[np.isclose(corners[:, 0], x[i]), 1])
        assert at[[0, -1]] == pytest.approx([scale * max(low[i], 0.0), scale * high[i]]), name
    with pytest.raises(ValueError, match="no scatter to tell an interval from"):
        fb.pdf([0.0, 1.0, 1.0]).interval()
