"""Units of axes: with the prefix that suits what they show, and the numbers drawn are those of the run in that unit."""

import numpy as np
import pytest
from matplotlib.ticker import ScalarFormatter

import fembeam as fb
from contacts import KelvinVoigt
from fembeam import plot, statistics
from fembeam.plot.rig_words import length
from fembeam.plot.units import length_for, unit_for
from fembeam.results import files
from fembeam.results.compare import overlaid


def cantilever(size, drive):
    """A silicon strip of this length, m, with a stop at its tip; everything scales with it."""
    section = fb.Section.rectangle(1.6e11, 2330.0, width=size / 10, height=size / 50)
    stop = fb.Stop(size, KelvinVoigt(1e5 * size, 1e-6 * size), gap=1e-4 * size, name="tip stop")
    beam, omega = fb.Beam(size, section), 250.0 / size
    scene = fb.Scene(beam, [fb.Clamped(0.0)], stops=[stop], damping=fb.ModalDamping(0.05), base=drive(size, omega))
    return scene.reduce(1).simulate(120.0 / omega, 0.1 / omega)


@pytest.fixture(scope="module")
def micro():
    """0.1 mm long."""
    return cantilever(1e-4, lambda size, omega: fb.Harmonic(1e-4 * size, omega))


def offsets(figure):
    """Powers of ten that matplotlib writes beside linear axes."""
    figure.draw_without_rendering()
    both = [one for axis in figure.axes for one in (axis.xaxis, axis.yaxis) if "ω" not in one.get_label_text()]
    return [one.get_offset_text().get_text() for one in both if isinstance(one.get_major_formatter(), ScalarFormatter)]


def test_the_prefix_follows_the_largest():
    given = {2e-9: "nm", 2e-6: "µm", 2e-5: "mm", 0.5: "mm", 1.0: "mm", 1.01: "m", 5e3: "m", 1e-12: "nm", 0.0: "mm"}
    assert {size: length_for([0.0, -size, np.nan])[1] for size in given} == given
    forces = {1e-3: "mN", 0.5: "N", 2e3: "N", 2.1e3: "kN", 3e7: "MN", 4e-5: "µN"}
    assert {size: unit_for(np.array([size]), "N")[1] for size in forces} == forces
    assert {t: unit_for(t, "s")[1] for t in (1e-5, 5e-3, 0.1, 9e4)} == {1e-5: "µs", 5e-3: "ms", 0.1: "s", 9e4: "s"}
    for size in np.geomspace(1e-9, 1e9, 100):
        scale, _ = unit_for(size, "N")
        assert 0.01 <= scale * size <= 2000.0
    assert length_for([])[1] == "mm"


def test_lengths_in_words():
    assert [length(x) for x in (2e-9, 3e-6, 2e-5, 0.02, 1.0)] == ["2 nm", "3 µm", "0.02 mm", "20 mm", "1 m"]


def test_figures_of_a_micro_run_have_no_powers_of_ten(micro):
    assert len(micro.contacts) > 10
    for name in ("time_history", "densities", "contacts"):
        assert not any(offsets(files.figures(micro)[name]())), name
    picture = plot.animation.frame(micro, micro.t[50])
    assert not any(offsets(picture))
    assert picture.axes[0].get_title(loc="left") == f"t = {1e6 * micro.t[50]:.2f} µs"
    assert not any(offsets(overlaid({"a": micro})))
    assert not any(offsets(plot.mode_shapes(micro.model)))
    assert not any(offsets(micro.model.scene.figure()))


def test_numbers_are_those_of_the_run_in_the_unit_of_the_axis(micro):
    scales = {"nm": 1e9, "µm": 1e6, "µs": 1e6, "ms": 1e3, "µN": 1e6, "mN": 1e3, "nN": 1e9}
    upper, lower = plot.time_history(micro, window=(0.0, float(micro.t[-1])), z=1e-4).axes
    words, name, unit = (
        text.rpartition(" / ")[2] for text in (upper.get_ylabel(), lower.get_ylabel(), lower.get_xlabel())
    )
    (line,) = upper.lines
    most = scales[words] * np.abs(micro.displacement(1e-4)).max()
    assert np.abs(line.get_ydata()).max() == pytest.approx(most, rel=0.05)
    assert line.get_xdata()[-1] == pytest.approx(scales[unit] * micro.t[-1])
    assert lower.dataLim.y1 == pytest.approx(scales[name] * micro.contacts.peak_force.max(), rel=0.2)


def test_densities_integrate_to_one_in_their_unit():
    signal = statistics.Signal(1e-6 * np.random.default_rng(1).standard_normal(4000), 1e-3, 256)
    signal.add(1e-6 * np.random.default_rng(2).standard_normal(4000))
    axis = plot.random_densities({"x": signal}).axes[0]
    assert (axis.get_xlabel(), axis.get_ylabel()) == ("x / µm", "probability density / µm⁻¹")
    x, p = axis.lines[0].get_data()
    assert np.sum(p) * (x[1] - x[0]) == pytest.approx(1.0, rel=1e-6)


def test_orbits_and_branches_of_micro_structures(micro):
    orbit = micro.model.orbit()
    left, right = plot.orbit(orbit).axes
    assert left.get_ylabel().endswith(" nm")
    assert np.ptp(left.lines[0].get_ydata()) == pytest.approx(1e9 * np.ptp(orbit.run.displacement(1e-4)))
    assert not any(offsets(left.figure))
    assert right.get_xlabel() == "u / nm"
