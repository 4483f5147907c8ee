"""Figures in notebooks, in windows, and in axes that are given."""

import warnings

import numpy as np
import pytest
from matplotlib import figure as of_matplotlib
from matplotlib import pyplot as plt
from problems import ROD

import fembeam as fb
from contacts import Hertz, Hysteretic, bounce, identify
from fembeam import plot
from fembeam.plot.figure import sheet


@pytest.fixture(scope="module")
def model():
    beam = ROD
    stops, drive, damping = [fb.Stop(0.5, Hertz(1e9))], fb.Harmonic(1e-3, 150.0), fb.ModalDamping(0.05)
    return fb.Scene(beam, [fb.Clamped(0.0)], stops=stops, base=drive, damping=damping).reduce(modes=2)


@pytest.fixture
def given():
    figure = of_matplotlib.Figure()
    return figure, list(figure.subplots(1, 2))


def collisions():
    hit = bounce(Hysteretic(2e8, 0.5), 0.3, 0.02)
    return identify(hit.delta, hit.delta_dot, hit.force)


def test_a_notebook_gets_a_picture_and_pyplot_nothing(model):
    figure = plot.mode_shapes(model)
    assert isinstance(figure, of_matplotlib.Figure)
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert plt.get_fignums() == []


def test_show_registers_the_figure_itself_until_it_is_closed(model, monkeypatch):
    figure, seen = plot.mode_shapes(model), []
    monkeypatch.setattr(plt, "show", lambda: seen.append(plt.gcf()))
    for _ in range(2):
        figure.show()  # again: no second window
    assert seen == [figure, figure]
    assert len(plt.get_fignums()) == 1
    plt.close(figure)
    figure.show()  # closed windows open again
    assert len(plt.get_fignums()) == 1
    plt.close("all")


def test_show_without_windows_says_so_unless_told_not_to(model, monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")  # without one matplotlib says nothing
    figure = plot.mode_shapes(model)
    with pytest.warns(UserWarning, match="non-interactive"):
        figure.show()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.show(warn=False)
    plt.close("all")


def spectrum():
    return fb.response_spectrum([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], periods=[0.5, 1.0])


DRAWN = {
    "loops": (lambda model, axes: plot.loops({"Hertz": Hertz(1e9)}, axes=axes[0]), 1),
    "restitutions": (lambda model, axes: plot.restitutions(axes=axes), 2),
    "identification": (lambda model, axes: plot.identification(collisions(), axes=axes), 2),
    "orbit": (lambda model, axes: plot.orbit(model.orbit(), axes=axes), 2),
    "branch": (lambda model, axes: plot.branch(model.branch("amplitude", (0.9e-3, 1e-3)).run(), axes=axes[0]), 1),
    "modes": (lambda model, axes: plot.mode_shapes(model, axes=axes[0]), 1),
    "history": (lambda model, axes: plot.time_history(model.simulate(0.3, 1e-3), axes=axes), 2),
    "psd": (lambda model, axes: plot.spectrum(model.simulate(0.3, 1e-3), axes=axes), 2),
    "densities": (lambda model, axes: plot.densities(model.simulate(0.3, 1e-3), axes=axes), 2),
    "floor": (lambda model, axes: plot.floor_spectrum(model.simulate(0.3, 1e-3), axes=axes), 2),
    "response spectrum": (lambda model, axes: plot.response_spectrum(spectrum(), axes=axes), 2),
    "frequency response": (
        lambda model, axes: plot.frequency_response(model.frequency_response([1.0, 2.0]), axes=axes),
        2,
    ),
}


@pytest.mark.parametrize(("draw", "panels"), DRAWN.values(), ids=DRAWN)
def test_axes_that_are_given_are_drawn_into_and_nothing_else_is_changed(model, given, draw, panels):
    figure, axes = given
    assert draw(model, axes) is figure
    assert [axis.has_data() for axis in axes] == [True, panels == 2]
    assert figure._suptitle is None
    assert not figure.legends
    assert figure.axes == axes


def test_axes_of_studies(model, given):
    study = fb.study.mode_count(model.scene, [1, 2], "amplitude", duration=0.2, dt=1e-3)
    figure, axes = given
    assert plot.mode_count(study, axes=axes) is figure
    assert "amplitude against " in axes[0].get_title(loc="left")
    assert figure._suptitle is None


def test_axes_of_contacts_and_basins(model, given):
    figure = of_matplotlib.Figure()
    axes = list(figure.subplots(2, 2).ravel())
    assert plot.contacts(model.simulate(0.5, 1e-3), axes=axes) is figure
    assert all(axis.get_title(loc="left") for axis in axes)
    figure, axes = given
    assert plot.basins(fb.study.basins(model, points=2), axes=axes[0]) is figure
    assert axes[0].images
    assert not figure.legends


def test_another_number_of_axes_is_refused(given):
    for bad in (5, given[0]):
        with pytest.raises(ValueError, match=r"axes must be axes of matplotlib, got .* by plt.subplots"):
            plot.loops({"Hertz": Hertz(1e9)}, axes=bad)
    with pytest.raises(ValueError, match=r"as many as the figure has panels, got 2 in fembeam\.plot; give 1"):
        plot.loops({"Hertz": Hertz(1e9)}, axes=given[1])
    figure, axes = sheet(1, 2, (1.0, 1.0), np.array(given[1]))
    assert (figure, axes) == given
