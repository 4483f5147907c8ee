"""Figures: what they show, without a display."""

import dataclasses
import re
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from problems import PAPER_BEAM, TIP, paper_scene

import fembeam as fb
from contacts import (
    PUBLISHED,
    BoucWen,
    ElastoPlastic,
    Hertz,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    Polynomial,
    bounce,
    identify,
)
from fembeam import plot, statistics
from fembeam.plot.axis_names import axis_name
from fembeam.plot.figure import heading
from fembeam.plot.orbits import _widen
from fembeam.plot.style import BLUE, GREY, RED
from fembeam.response import backbone
from fembeam.results import files as report


@pytest.fixture(scope="module")
def run():
    stops = [fb.Stop(TIP, law=Hertz(2.1e8)), fb.Stop(0.2, law=Hertz(2.1e8), gap=1e-3, side="above")]
    scene = paper_scene(fb.BandNoise(2e-4, (0.0, 1226.6), seed=3), 0.02, masses=(), stops=stops)
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


@pytest.mark.parametrize("width", [5.0, 7.0])
@pytest.mark.parametrize(
    "title",
    [
        "Power spectral densities after 5 s (595 s, 378 segments, lines 2 rad/s apart, 95 % shaded)",
        "K = 2.104e+08 N/m^1.5, a = 0.554 (0.54 to 0.567), restitution 0.728 (0.723 to 0.734)",
    ],
)
def test_a_long_title_is_broken_so_that_it_fits(width, title):
    figure = Figure(figsize=(width, 3.0))
    heading([figure.subplots()], title, True)
    for dpi in (120, 90, 70):
        figure.set_dpi(dpi)
        figure.draw_without_rendering()
        assert figure.texts[0].get_window_extent().x1 <= figure.bbox.x1


def test_histories_are_those_of_the_run(run):
    window = 1.0, 1.2
    log = run.contacts
    inside = (log.t_in < window[1]) & ~(log.t_out < window[0])
    shown = log.stop[inside][np.argmax(log.peak_force[inside])]  # another stop under another rounding
    line = plot.time_history(run, window).axes[0].lines[0]
    t, u = line.get_data()
    assert window[0] - 2e-3 <= t[0] <= window[0]
    assert np.interp(1.1, t, u) == pytest.approx(1e3 * run.displacement(run.stops[shown, 0])[1100], rel=1e-9)
    t, u = plot.time_history(run, window, z=0.1).axes[0].lines[0].get_data()
    assert np.interp(1.1, t, u) == pytest.approx(1e3 * run.displacement(0.1)[1100], rel=1e-9)


def test_the_window_holds_the_largest_force_where_contacts_end_before_the_motion():
    """A quake whose weaker end touches nothing: the last periods, an empty window, were shown."""
    t = 1e-3 * np.arange(4001)
    quake = 8.0 * np.sin(60.0 * t) * np.where(t < 1.0, 1.0, 0.6)
    base = fb.Record(t, quake, quantity="acceleration")
    scene = fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.05), base=base)
    calm = scene.reduce(1).simulate(3.9, 1e-3)
    assert plot.stationary(calm)
    gap = 0.9 * np.abs(calm.displacement(0.2599)).max()
    run = dataclasses.replace(scene, stops=[fb.Stop(0.2599, Hertz(2.1e8), gap)]).reduce(1).simulate(3.9, 1e-3)
    peak = run.contacts.t_in[np.argmax(run.contacts.peak_force)]
    assert peak < 1.5
    lo, hi = plot.time_history(run).axes[1].get_xlim()
    assert lo < peak < hi < 3.0
    assert "no contact in this window" not in texts(plot.time_history(run))
    assert plot.time_history(calm).axes[0].get_xlim()[1] >= calm.t[-1]


def shaded(axis):
    """Times (k, 2) at which the bands of an axis begin and end."""
    return np.array([[band.get_x(), band.get_x() + band.get_width()] for band in axis.patches]).reshape(-1, 2)


@pytest.fixture(scope="module")
def knocked():
    """A beam with two stops at different places after a pulse, sampled so that its contacts are short."""
    stops = [fb.Stop(0.12, Hertz(2.1e8), 2e-4), fb.Stop(0.2599, Hertz(2.1e8), 1e-3, side="above")]
    load = fb.PointForce(0.2599, fb.Pulse(30.0, length=5e-3, at=0.5))
    scene = fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], stops=stops, forces=[load], damping=fb.ModalDamping(0.02))
    return scene.reduce(3).simulate(4.0, 2e-4)


def test_the_window_of_a_transient_is_about_its_largest_force(knocked, run):
    log = knocked.contacts
    largest = int(np.argmax(log.peak_force))
    assert 0.5 < log.t_in[largest] < 1.0
    lo, hi = plot.time_history(knocked).axes[1].get_xlim()
    assert lo < log.t_in[largest] < hi < 2.0
    assert plot.time_history(run).axes[1].get_xlim()[1] >= run.t[-1]  # noise lasts: the end


def test_shaded_contacts_are_those_of_the_stop_whose_motion_is_drawn(knocked):
    log = knocked.contacts
    stop = int(log.stop[np.argmax(log.peak_force)])
    upper, lower = (figure := plot.time_history(knocked, (0.4, 1.2))).axes
    mine = (log.stop == stop) & (log.t_in < 1.2)
    assert 0 < np.count_nonzero(mine) < np.count_nonzero(log.t_in < 1.2)
    np.testing.assert_allclose(shaded(upper), np.transpose([log.t_in[mine], log.t_out[mine]]))
    t, u = upper.lines[0].get_data()
    at = np.searchsorted(knocked.t, 0.6)
    z = knocked.stops[stop, 0]
    assert np.interp(knocked.t[at], t, u) == pytest.approx(1e3 * knocked.displacement(z)[at])
    assert f"contacts of {knocked.name(stop)} shaded" in " ".join(texts(figure).split())
    tops = [segment[1, 1] for lines in lower.collections for segment in lines.get_segments()]
    short = (log.t_out - log.t_in < 10 * 2e-4) & (log.t_in < 1.2)
    assert sorted(tops) == pytest.approx(sorted(log.peak_force[short]))
    other = 1 - stop
    figure = plot.time_history(knocked, (0.4, 1.2), z=knocked.stops[other, 0])
    assert len(shaded(figure.axes[0])) == np.count_nonzero((log.stop == other) & (log.t_in < 1.2))
    assert "all stops shaded" in texts(plot.time_history(knocked, (0.4, 1.2), z=0.05))


def test_a_window_without_contact_says_so(knocked):
    figure = plot.time_history(knocked, (0.1, 0.3))
    assert "no contact in this window" in texts(figure)
    assert figure.axes[1].get_ylabel() == "contact force / N"


def test_what_lasts_and_what_does_not(run, knocked):
    scene, t = run.model.scene, 1e-3 * np.arange(2001)
    free = run.model.under(dataclasses.replace(scene, base=None))
    assert plot.stationary(run)
    assert not plot.stationary(knocked)
    assert not plot.stationary(free.simulate(0.5, 1e-3, start=np.array([1e-3, 0.0, 0.0, 0.0])))
    for record, lasts in ((np.sin(60.0 * t), True), (np.sin(60.0 * t) * np.exp(-4.0 * t), False)):
        driven = run.model.under(dataclasses.replace(scene, base=fb.Record(t, record, quantity="acceleration")))
        assert plot.stationary(driven.simulate(1.9, 1e-3), 0.2) == lasts


def run_at(run, times):
    """The same motion at other times."""
    return run.model.simulate(float(times[-1]), times)


def test_a_transient_gets_a_response_spectrum_instead_of_a_psd(knocked, tmp_path):
    drawn = report.figures(knocked)
    assert list(drawn) == ["time_history", "response_spectrum", "contacts", "modes"]
    figure = drawn["response_spectrum"]()
    period, level = figure.axes[0].lines[0].get_data()
    with pytest.warns(UserWarning, match="not resolved by samples"):
        exact = knocked.floor_spectrum(0.12, periods=period[::20], zeta=0.05)
    assert level[::20] == pytest.approx(exact.acceleration[0])
    assert "z = 120 mm, ζ = 0.05" in texts(figure)
    assert "Contacts are shorter than ten samples" in texts(figure)
    uneven = run_at(knocked, np.geomspace(0.4, 4.0, 300))
    assert "response_spectrum" not in report.figures(uneven)
    loaded = fb.load(knocked.save(tmp_path / "run"))
    again = report.figures(loaded)["response_spectrum"]()
    np.testing.assert_allclose(again.axes[0].lines[0].get_ydata(), level)


def test_floor_spectra_in_axes_of_an_array_keep_their_warning_and_their_legend(knocked):
    axes = Figure().subplots(2)
    figure = plot.floor_spectrum(knocked, axes=axes)
    assert "Contacts are shorter than ten samples" in axes[0].get_title("left")
    assert "pseudo-acceleration" in axes[0].get_legend().get_texts()[-1].get_text()
    assert "pseudo-acceleration" in texts(report.figures(knocked)["response_spectrum"]())
    assert figure is axes[0].figure


LONG = "guide of the main steam line at the wall of the turbine hall, north side, of the drawing of 1987"


@pytest.fixture(scope="module")
def long_named(run):
    stops = [dataclasses.replace(stop, name=f"{LONG} {i}") for i, stop in enumerate(run.model.scene.stops)]
    return dataclasses.replace(run.model.scene, stops=stops).reduce(2).simulate(2.0, 1e-3)


@pytest.mark.parametrize(
    "draw", [plot.time_history, plot.spectrum, lambda run: plot.frame(run, 1.0)], ids=["history", "psd", "animation"]
)
def test_long_names_fit(long_named, draw):
    figure = draw(long_named)
    figure.draw_without_rendering()
    legends = [*figure.legends, *(axis.get_legend() for axis in figure.axes if axis.get_legend())]
    drawn = [*figure.texts, *(text for legend in legends for text in legend.get_texts())]
    extents = [text.get_window_extent() for text in drawn]
    assert any("turbine" in text.get_text() for text in drawn)
    assert all(extent.x0 >= 0.0 and extent.x1 <= figure.bbox.x1 for extent in extents)
    assert figure.axes[0].get_position().width > 0.6


def test_numbers_below_a_narrow_density_do_not_overlap():
    x = -0.5e-3 + 1.7e-5 * np.random.default_rng(0).standard_normal(1000)
    signal = statistics.Signal(x, 1e-3, 256)
    signal.add(x)
    figure = plot.random_densities({"a": signal, "b": signal})
    figure.draw_without_rendering()
    labels = [label.get_window_extent() for label in figure.axes[0].get_xticklabels() if label.get_text()]
    assert all(left.x1 < right.x0 for left, right in pairwise(labels))


def test_a_legend_of_many_laws_fits():
    figure = plot.loops({f"law {i}": KelvinVoigt(1e5 * (i + 1), 10.0) for i in range(30)})
    figure.draw_without_rendering()
    extent = figure.legends[0].get_window_extent()
    assert extent.y0 >= 0.0
    assert extent.y1 <= figure.bbox.y1


def test_linear_response_lies_in_the_band_of_a_linear_run(run):
    noise = fb.BandNoise(2e-4, (0.0, 1226.6), seed=3)
    scene = dataclasses.replace(run.model.scene, stops=[], base=noise, damping=fb.ModalDamping(0.1))
    linear = scene.reduce(2).simulate(100.0, 1e-3)
    figure = plot.spectrum(linear, discard=5.0, omega_max=1200.0)
    upper = figure.axes[0]
    omega, level = next(line for line in upper.lines if line.get_label() == "linear, no contact").get_data()
    H = linear.model.frequency_response(omega, output=0.2599)
    assert level == pytest.approx(H.amplitude**2 * noise.psd_at(omega))
    assert "95 % shaded" in texts(figure).replace("\n", " ")
    line = plot.spectra_of(linear, 5.0)["tip u"]
    low, high = line.interval()
    broad = (line.omega > 150.0) & (line.omega < 700.0)  # between the resonances: no leakage
    expected = np.interp(line.omega[broad], omega, level)
    # of 95 % intervals over ~280 lines whose neighbours are correlated by the window
    inside = np.mean((low[broad] <= expected) & (expected <= high[broad]))
    assert inside > 0.85
    assert len(upper.collections) >= 1
    assert not plot.spectrum(run).axes[0].collections  # 1.9 s hold no four independent parts


def test_a_slow_sweep_has_the_spectrum_of_its_samples(run):
    """Its own grid has three nodes in 0.3 s: too few for a spectrum."""
    sweep = fb.SineSweep(1e-4, 10.0, 100.0, duration=2.0)
    swept = dataclasses.replace(run.model.scene, base=sweep).reduce(1).simulate(0.3, 1e-3)
    line = plot.spectra_of(swept)["base y"]
    expected = statistics.psd(sweep(swept.t), 1e-3, plot.segment_for(len(swept.t), 1e-3))
    np.testing.assert_array_equal(line.density, expected.density)
    assert plot.spectrum(swept).axes


@pytest.mark.parametrize("changes", [{"supports": []}, {"damping": fb.ModalDamping(0.0)}], ids=["free", "undamped"])
@pytest.mark.filterwarnings("ignore:2 rigid-body modes")
def test_spectra_of_free_and_of_undamped_beams_are_drawn(run, changes):
    for modes in (2, 4):
        model = dataclasses.replace(run.model.scene, **changes).reduce(modes)
        figure = plot.spectrum(model.simulate(1.0, 1e-3))
        lines = [line for line in figure.axes[0].lines if line.get_label() == "linear, no contact"]
        assert len(lines) == (model.omega[-1] > 0.0)
        assert all(np.isfinite(line.get_ydata()).all() for line in lines)


def test_every_natural_frequency_in_view_is_named(run):
    many = dataclasses.replace(run.model.scene, base=fb.Harmonic(1e-3, 60.0)).reduce(12).simulate(1.0, 1e-3)
    figure = plot.spectrum(many, omega_max=3000.0)
    wide = plot.spectrum(dataclasses.replace(many, t=many.t / 100), omega_max=2e5)
    for drawn, top in ((figure, 3000.0), (wide, 2e5)):
        drawn.draw_without_rendering()
        names = [text for text in drawn.axes[0].texts if "omega" in text.get_text()]
        assert len(names) == np.count_nonzero(many.model.omega < top)
        assert apart(names)
        assert not any(text.get_bbox_patch() for text in drawn.axes[0].texts)


def test_figures_of_a_part_of_the_run_say_so(run):
    """The spectrum of the base motion is of that part, too."""
    shown = (plot.spectrum(run, 0.5), plot.densities(run, 0.5), plot.contacts(run, 0.5))
    assert all("after 0.5 s" in figure.get_suptitle() for figure in shown)
    assert "after" not in plot.densities(run).get_suptitle()
    sweep = fb.SineSweep(1e-3, 20.0, 400.0, 2.0)
    swept = dataclasses.replace(run.model.scene, base=sweep).reduce(1).simulate(1.9, 1e-3)
    late = swept.t[swept.t >= 1.0]
    expected = statistics.psd(sweep(late), 1e-3, plot.segment_for(len(late), 1e-3))
    np.testing.assert_array_equal(plot.spectra_of(swept, 1.0)["base y"].density, expected.density)


def test_contacts_say_what_is_left_out(run):
    count = 9000
    speed = np.geomspace(0.01, 0.5, count)
    ratio = np.full(count, 0.7)
    ratio[:100] = 3.0
    columns = {name: np.resize(column, count) for name, column in run.contacts.arrays().items()}
    log = dataclasses.replace(run.contacts, **columns | {"speed_in": speed, "speed_out": ratio * speed,
                              "t_in": np.full(count, 1.0), "t_out": np.full(count, 1.001)})  # fmt: skip
    figure = plot.contacts(dataclasses.replace(run, contacts=log))
    axis = figure.axes[3]
    assert f"of {count} drawn" in axis.get_title(loc="left")
    above = next(line for line in axis.lines if line.get_marker() == "^")
    assert len(above.get_xdata()) == 100 - count // 200  # but for the slowest 0.5 %
    assert above.get_label() == "55 above, up to 3"
    assert max(above.get_ydata()) < axis.get_ylim()[1]
    assert [ax.get_title(loc="left").split()[2] for ax in figure.axes[:3]] == ["ms", "kN", "m"]
    some = {name: column[:150] for name, column in run.contacts.arrays().items()}
    few = plot.contacts(dataclasses.replace(run, contacts=dataclasses.replace(run.contacts, **some)))
    assert "without" not in few.axes[0].get_xlabel()
    counts = sum(patch.get_height() for patch in few.axes[0].patches)
    assert counts == 150


def test_the_legend_of_modes_is_inside_and_covers_no_curve(run):
    figure = plot.mode_shapes(run.model.scene.reduce(6))
    figure.draw_without_rendering()
    (axis,) = figure.axes
    assert not figure.legends
    box = axis.get_legend().get_window_extent()
    assert axis.bbox.y0 < box.y0
    assert box.y1 < axis.bbox.y1
    assert axis.transData.transform((0.0, 1.0))[1] < box.y0


def test_peaks_of_two_tones():
    t = 1e-3 * np.arange(60_000)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(t.size)
    found = plot.peaks(fb.psd(np.sin(200 * t) + 0.1 * np.sin(780 * t) + noise, 1e-3, 4096), count=2)
    assert found == pytest.approx([200.0, 780.0], abs=3.0)


def apart(labels):
    """Whether no two of the drawn texts overlap."""
    boxes = [Text.get_window_extent(label) for label in labels if label.get_visible() and label.get_text()]
    assert len(boxes) > 1
    return not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])


@pytest.mark.parametrize("highest", [1.0, 1.7, 300.0])
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


def test_rates_of_contacts_do_not_depend_on_samples(run):
    """The log lasts to the end of the run, the last sample may lie before."""
    end = run.reached
    part = run.model.simulate(end, [0.0, 0.1 * end])
    rates = [re.search(r"[^ ]+ per second", texts(plot.contacts(one)))[0] for one in (run, part)]
    assert rates[0] == rates[1]
    assert report.summary(part)["contacts"][0]["rate"] == report.summary(run)["contacts"][0]["rate"]


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
    assert plot.segment_for(10_000, 1.0) == 64  # slow motion: two rad/s would be four samples


def test_random_figures_have_units_bands_and_confidence():
    x = 1e-3 * np.random.default_rng(1).standard_normal(4000)
    signal = statistics.Signal(x, 1e-3, 256)
    for part in np.split(x, 8):
        signal.add(part)
    orbits = [SimpleNamespace(extremes=lambda z: (-2e-3, 1e-3), mark=None) for _ in range(3)]
    nothing = {"base": None, "forces": [], "springs": [], "bodies": [], "supports": []}
    stop = fb.Stop(0.25, Hertz(1e8))
    model = SimpleNamespace(scene=SimpleNamespace(acting=[stop], named=False, **nothing), contact_rows=[])
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
    figure = plot.random_densities(
        {f"δ of annular stop at A-B + {z} m of body 1, (0.1521, -0.9884, 0)": signal for z in "12"}
    )
    figure.draw_without_rendering()
    left, right = (axis.get_tightbbox().x1 for axis in figure.axes)
    assert left < figure.axes[1].get_window_extent().x0
    assert right < figure.bbox.x1
    figure = plot.random_densities({f"MOMENT AMPLITUDE, WIDE WINDOW MEMBER, {i}": signal for i in "123"})
    figure.draw_without_rendering()
    titles = [axis.title.get_window_extent() for axis in figure.axes]
    assert all(one.x1 < other.x0 for one, other in pairwise(titles))
    long = [f"guide of the main steam line at the turbine hall, {side}" for side in ("north", "south")]
    (axis,) = plot.random_spectra({"": dict.fromkeys(long, signal)}, 1000.0).axes
    axis.figure.draw_without_rendering()
    assert axis.get_window_extent().x1 < axis.get_legend().get_window_extent().x0


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


@pytest.mark.parametrize("draw", [lambda: fb.plot.branch([]), lambda: fb.plot.loops({}), fb.plot.stability_map])
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
    "base.std": "base standard deviation / m",
    "base.x.band[1]": "base band of ω along x / rad s⁻¹",
    "forces[1].signal.peak": "drive peak / N m",
    "supports[0].motion.rz.amplitude": "motion amplitude along rz of support 0 / rad",
    "beam.nodes.B[1]": "y of node B / m",
    "beam.members[0].section.fibre": "distance of the outer fibre / m",
    "elements[0].law.coefficients[0]": "coefficient 1 of the contact law of element 0 / N/m",
    "elements[0].law.coefficients[2]": "coefficient 3 of the contact law of element 0 / N/m^3",
    "stops[0].friction.mu": "coefficient of friction of stop 0",
    "stops[0].law.something": "stops[0].law.something",
}


@pytest.mark.parametrize(("path", "words"), PATHS.items(), ids=list(PATHS))
def test_parameters_in_words(run, path, words):
    load = fb.Harmonic(1.0, 2.0)
    scene = dataclasses.replace(run.model.scene, forces=[fb.PointForce(0.1, load), fb.PointMoment(0.1, load)])
    assert axis_name(path, scene) == words


def test_ends_of_branches_are_marked_and_explained(run):
    load, (_, *stops) = fb.PointForce(0.2, fb.Harmonic(1.0, 60.0)), run.model.scene.stops
    scene = dataclasses.replace(run.model.scene, base=None, forces=[load], stops=stops)
    whole = scene.reduce(1).branch("forces[0].signal.omega", (59.0, 60.0)).run()
    assert [why.split(":")[0] for _, why in whole.ends] == ["reached the end of the span"]
    assert whole.ends[0][0].parameter in (59.0, 60.0)
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


def test_linear_response_and_backbone_lie_behind_a_branch(run):
    stops = [fb.Stop(0.24445, Hertz(2.1e8), gap=1e-3, side=side) for side in ("below", "above")]
    load = fb.PointForce(0.2, fb.Harmonic(0.05, 60.0))
    scene = dataclasses.replace(run.model.scene, base=None, stops=stops, forces=[load])
    branch = scene.reduce(2).branch("forces[0].signal.omega", tuple(np.array([0.97, 1.02]) * run.model.omega[0])).run()
    axis = plot.branch(branch).axes[0]
    drawn = {line.get_label(): line for line in axis.lines}
    omega, height = drawn["linear, no contact"].get_data()
    H = branch.family.model.frequency_response(omega, "forces[0]", 0.24445)
    assert height == pytest.approx(1e3 * 0.05 * H.amplitude)
    peaks = 1e3 * np.array([plot.peak(orbit, 0.24445) for orbit in branch.orbits])
    assert axis.dataLim.y1 == pytest.approx(peaks.max())
    assert axis.get_ylim()[1] > height.max() > 1.2 * peaks.max()  # it was cut at the height of the branch
    given = Figure().subplots()
    plot.branch(branch, axes=given)
    assert given.get_ylim()[1] < 1.2 * peaks.max()  # axes of others keep the limits of the branch
    for high, scale in ((1.2, "linear"), (50.0, "log")):
        axis = Figure().subplots()
        axis.plot([0.0, 1.0], [0.5, 1.0])
        _widen(axis, np.array([0.2, high]))
        assert axis.get_yscale() == scale
        assert axis.get_ylim()[0] < 0.2
        assert axis.get_ylim()[1] > high
    omega, height = drawn["backbone of the lowest mode"].get_data()
    seen = np.isfinite(omega)
    assert omega[seen] == pytest.approx(backbone(branch.family.model, 0.24445, 1e-3 * height[seen]))
    assert "backbone" not in texts(plot.branch(scene.reduce(1).branch("amplitude", (0.04, 0.06)).run()))


def test_the_linear_response_of_a_slider_is_that_of_a_stuck_one_for_every_level(run):
    """One level only was drawn, as "linear, no contact"."""
    slider = fb.Element(0.24445, Jenkins(300.0, 1.0))
    found = []
    for amplitude in (1e-6, 3e-6):
        base = fb.Harmonic(amplitude, 125.0)
        model = dataclasses.replace(run.model.scene, stops=(), elements=[slider], base=base).reduce(1)
        found.append(model.branch("omega", (120.0, 126.0), step=0.3).run())
    axis = plot.branch(found).axes[0]
    labels = [line.get_label() for line in axis.lines]
    assert labels.count("base amplitude 1e-06 m") == labels.count("base amplitude 3e-06 m") == 1
    drawn = [line for line in axis.lines if line.get_linestyle() == ":"]
    assert [line.get_color() for line in drawn] == [BLUE, RED, GREY]
    assert drawn[-1].get_label() == "linear, elements stuck"
    for line, one in zip(drawn, found, strict=False):  # neither slips
        heights = [1e6 * plot.peak(orbit, 0.24445) for orbit in one.orbits]
        np.testing.assert_allclose(np.interp(one.parameter, *line.get_data()), heights, rtol=1e-3)
    free = [line for line in axis.lines if line.get_label() == "linear, elements slipping"]
    assert len(free) == 1
    long = [line for line in axis.lines if len(line.get_xdata()) > 300]
    slipping = [line for line in long if line not in drawn]
    for line, one in zip(slipping, found, strict=True):  # of a slider nothing is left: the beam alone
        model = dataclasses.replace(one.family.model.scene, elements=[]).reduce(1)
        alone = model.frequency_response(line.get_xdata(), output=0.24445).amplitude * model.scene.base.amplitude
        np.testing.assert_allclose(line.get_ydata(), 1e6 * alone, rtol=1e-5)  # of another mesh
    assert "linear, no contact, elements stuck" in {  # a stop beside the slider
        line.get_label() for line in plot.branch(replaced_stops(found[0], run.model.scene.stops)).axes[0].lines
    }


def test_the_frequency_response_of_what_slips_keeps_the_springs_beside():
    """Jenkins leaves nothing, hardening its spring, Bouc and Wen α k, Iwan its spring; dashpots and springs stay."""
    steel = fb.Section.circle(2.1e11, 7800.0, 0.01)
    scene = fb.Scene(fb.Beam(0.5, steel), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02))
    pairs = [
        (Jenkins(3e3, 2.0), []),
        (ElastoPlastic(3e3, 2.0, 500.0), [Polynomial([500.0])]),
        (Iwan([1e3, 2e3, 700.0], [1.0, 2.0, np.inf]), [Polynomial([700.0])]),
        (BoucWen(3e3, 0.2, 1.0, 3e3, 1e3), [Polynomial([600.0])]),
        (Jenkins(3e3, 2.0) + KelvinVoigt(400.0, 3.0), [KelvinVoigt(400.0, 3.0)]),
    ]
    omega = np.linspace(10.0, 500.0, 50)
    for law, left in pairs:
        one, other = (
            dataclasses.replace(scene, elements=[fb.Element(0.4, each) for each in laws]).reduce(2)
            for laws in ([law], left)
        )
        slipping = one.frequency_response(omega, 0.5, 0.5, slipping=True).values
        np.testing.assert_allclose(slipping, other.frequency_response(omega, 0.5, 0.5).values, rtol=1e-6)
        stuck = one.frequency_response(omega, 0.5, 0.5).values
        assert not np.allclose(stuck, slipping, rtol=1e-2)


def replaced_stops(branch, stops):
    """The same orbits, said to be of a scene with stops, too."""
    model = branch.family.model
    other = dataclasses.replace(model.scene, stops=stops).reduce(1)
    return SimpleNamespace(
        **{name: getattr(branch, name) for name in ("parameter", "stable", "orbits", "special", "ends")},
        family=dataclasses.replace(branch.family, model=other),
    )


def test_shaded_bands_are_the_intervals_of_the_estimates():
    signal = statistics.Signal(1e-3 * np.random.default_rng(1).standard_normal(4000), 1e-3, 64)
    for part in np.split(1e-3 * np.random.default_rng(2).standard_normal(8000), 8):
        signal.add(part)
    drawn = {
        "psd": (plot.random_spectra({"": {"x": signal}}, 1e4), signal.psd.omega, signal.psd.interval()),
        "pdf": (plot.random_densities({"x": signal}), 1e3 * signal.pdf.x, signal.pdf.interval()),
    }
    for name, (figure, x, (low, high)) in drawn.items():
        scale = 1e-3 if name == "pdf" else 1.0
        corners = figure.axes[0].collections[0].get_paths()[0].vertices
        i = len(x) // 2
        beside = 0.51 * (x[1] - x[0]) * (name == "pdf") + 1e-9  # a step has its corners between the bins
        at = corners[np.abs(corners[:, 0] - x[i]) < beside, 1]
        for bound in (scale * max(low[i], 0.0), scale * high[i]):
            assert np.isclose(at, bound).any(), name
    with pytest.raises(ValueError, match="no scatter to tell an interval from"):
        fb.pdf([0.0, 1.0, 1.0]).interval()


def test_a_figure_of_the_wrong_object_says_what_it_draws(run):
    with pytest.raises(TypeError, match=r"plot\.time_history draws one Run, got Hertz"):
        plot.time_history(Hertz(1.0))
    with pytest.raises(TypeError, match=r"plot\.loops draws things by name, got Hertz\(.*; write \{'name': it\}"):
        plot.loops(Hertz(1e9))
    with pytest.raises(TypeError, match=r"plot\.mode_shapes draws one Model, got Run"):
        plot.mode_shapes(run)


def test_curves_keep_the_librarys_colours_when_they_are_drawn_later(run):
    """matplotlib looks "C1" up only as it draws, in the settings of that time: legends then had other colours."""
    shown = [plot.time_history(run), plot.loops({"a": KelvinVoigt(1e4, 1.0), "b": KelvinVoigt(1e4, 2.0)})]
    lines = [line for figure in shown for axis in figure.axes for line in axis.lines]
    assert all(str(line.get_color()).startswith("#") for line in lines)


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda run: plot.time_history(run, (-1.0, 0.0)), r"overlap the run, 0 to 2 s, got \(-1.0, 0.0\)"),
        (lambda run: plot.time_history(run, (3.0, 4.0)), "the window must overlap the run, 0 to 2 s"),
        (lambda run: plot.time_history(run, (0.0, np.inf)), r"the window must be two numbers, got \(0.0, inf\)"),
        (lambda run: plot.time_history(run, (0.3, 0.1)), "the window must end after it begins"),
        (lambda run: plot.time_history(run, 5), "the window must be two numbers, got 5 in time_history"),
        (lambda run: plot.time_history(run, ("a", "b")), "the window must be two numbers"),
        (lambda run: plot.densities(run, discard=2.0), "discard must be below the last sample, at 2 s, got 2.0"),
        (lambda run: plot.densities(run, discard=None), "discard must be a number, got None"),
        (lambda run: plot.spectrum(run, discard=-1.0), "discard must be finite and not negative, got -1.0"),
        (lambda run: plot.contacts(run, discard=-1.0), "discard must be finite and not negative, got -1.0"),
        (lambda run: plot.spectrum(run, omega_max=np.inf), "omega_max must be finite and positive, got inf"),
        (lambda run: plot.spectrum(run, omega_max=-5.0), "omega_max must be finite and positive, got -5.0"),
        (lambda run: plot.animate(run, "run.gif", fps=0), "fps must be finite and positive, got 0 in animate"),
        (lambda run: plot.animate(run, "run.gif", fps="25"), "fps must be a number, got '25' in animate"),
        (lambda run: plot.frame(run, 9.0), "t must lie within the run, 0 to 2 s, got 9.0 in plot.frame"),
    ],
)  # fmt: skip
def test_times_beyond_a_run_are_refused_by_what_is_wrong(run, draw, message):
    with pytest.raises(ValueError, match=message):
        draw(run)


def test_a_window_may_be_an_array_or_reach_beyond_the_run(run):
    for window in (np.array([0.1, 0.3]), (-5.0, 50.0)):
        assert plot.time_history(run, window).axes[-1].get_xlim()[0] < 1e3 * 0.3


def test_forces_of_more_stops_than_colours_are_told_apart():
    stops = [fb.Stop(z, KelvinVoigt(1e5, 10.0), gap=1e-4) for z in np.linspace(0.1, 0.25, 8)]
    run = paper_scene(fb.Harmonic(1e-3, 195.0), 0.02, masses=(), stops=stops).reduce(3).simulate(0.1, 1e-4)
    for axis in (plot.time_history(run, (0.0, 0.1)).axes[1], plot.frame(run, 0.05).axes[1]):
        curves = [line for line in axis.lines if not line.get_label().startswith("_")]
        assert len(curves) > 6
        assert len({(line.get_color(), line.get_linestyle()) for line in curves}) == len(curves)


def test_a_contact_beyond_the_end_of_a_period_is_shaded_at_its_beginning():
    period, run = 1.0, SimpleNamespace()
    run.t = np.linspace(0.0, period, 11)
    run.displacement = run.velocity = lambda _: np.sin(2 * np.pi * run.t)
    log = np.rec.fromarrays([[0.3, 0.9], [0.4, 1.15]], names="t_in,t_out")
    one = SimpleNamespace(run=run, contacts=log, stable=True, parameter=np.nan, period=1)
    bands = sorted((p.get_x(), p.get_x() + p.get_width()) for p in plot.orbit.__wrapped__(one, 0.1).axes[0].patches)
    np.testing.assert_allclose(bands, [(0.0, 150.0), (300.0, 400.0), (900.0, 1000.0)])


def test_a_second_response_moves_by_more_than_rounding():
    bar = fb.Section.circle(2.1e11, 7850.0, 0.012)
    frame = fb.Frame(
        {"A": (0, 0, 0), "B": (0.5, 0, 0), "C": (0.5, 0.3, 0)}, [fb.Member("A", "B", bar), fb.Member("B", "C", bar)]
    )
    scene = fb.Scene(frame, [fb.Clamped("A")], stops=[fb.Stop("C", Hertz(1e8), gap=5e-4, direction="-z")],
                     damping=fb.ModalDamping(0.02), base={"z": fb.Harmonic(4e-4, 100.0)})  # fmt: skip
    run = scene.reduce(5).simulate(0.5, 1e-3)
    assert np.ptp(run.displacement("B", "x")) < 1e-15  # which comes before z
    first, second = plot.responses(run).values()
    assert np.ptp(second) > 1e-3 * np.ptp(first)


def test_a_legend_of_many_response_spectra_stands_beside_the_curves():
    t = np.linspace(0.0, 4.0, 401)
    one = fb.response_spectrum(t, np.sin(9.0 * t), periods=np.geomspace(0.05, 5.0, 20), zeta=[0.02, 0.05])
    few, many = plot.response_spectrum(one), plot.response_spectrum({"A": one, "B": one, "C": one})
    many.draw_without_rendering()
    assert few.axes[0].get_legend() is not None
    assert not few.legends
    (beside,) = many.legends
    assert len(beside.get_texts()) == 7
    assert not any(beside.get_window_extent().overlaps(axis.get_window_extent()) for axis in many.axes)


def test_what_is_no_count_span_or_result_is_refused_before_its_use(run, tmp_path):
    model, uses = run.model, "choose one|count from 0|give|1 keeps every|make them"
    for call in (
        lambda: run.indentation(True),
        lambda: run.unit(["force"]),
        lambda: run.impactor_displacement("a"),
        lambda: run.to_csv(tmp_path, stride="2"),
        lambda: run.to_csv(tmp_path, stride=2.5),
        lambda: run.to_vtu(tmp_path / "run.vtu", sample=None),
        lambda: fb.study.basins(model, x_span="ab"),
        lambda: fb.study.bifurcation(model, "stops[0].gap", "abc"),
        lambda: plot.branch(run),
        lambda: plot.response_spectrum(run),
        lambda: plot.rig(model.scene, 3),
    ):
        with pytest.raises(ValueError, match=rf".*, got .* in .*; ({uses})"):
            call()
    log = model.strike(np.uint64(1))  # -np.uint64(1) is 1.8e19
    np.testing.assert_array_equal(log.peak_force, model.strike(1.0).peak_force)
