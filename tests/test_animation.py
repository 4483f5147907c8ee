"""Moving pictures: files that open, pictures that show the motion, what is refused."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

import fembeam as fb
from contacts import Hertz, Hysteretic
from fembeam.plot import animation

STEEL = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)


@pytest.fixture(scope="module")
def run():
    other = fb.Scene(fb.Beam(0.3, STEEL), [fb.Clamped(0.0)])
    stops = [fb.Stop(0.4, Hysteretic.achieving(1e8, 0.5), 1e-3), fb.Stop(0.3, Hertz(1e8), 2e-3, "above", on=(1, 0.3))]
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], stops=stops, bodies=[other],
                     impactors=[fb.Impactor(0.25, 0.3, -1.0, Hertz(1e8), gap=4e-3)])  # fmt: skip
    return scene.reduce(3).simulate(0.02, 2e-4)


def test_gif_holds_the_frames(run, tmp_path):
    from PIL import Image

    path = fb.plot.animate(run, tmp_path / "run.gif", frames=3)
    assert [entry.name for entry in tmp_path.iterdir()] == ["run.gif"]
    with Image.open(path) as film:
        assert film.n_frames == 3


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg here")
def test_mp4_where_it_can_be_made(run, tmp_path):
    assert fb.plot.animate(run, tmp_path / "run.mp4", frames=4).stat().st_size > 1000


def test_a_frame_shows_the_bodies_where_they_are(run):
    i = int(np.argmax(run.force(2)))
    figure = fb.plot.frame(run, run.t[i])
    axis = figure.axes[0]
    own, second = axis.lines[:2]
    np.testing.assert_allclose(own.get_ydata(), 1e3 * run.displacement(own.get_xdata() / 1e3)[i], atol=1e-9)
    np.testing.assert_allclose(second.get_ydata()[0], 2.0)
    ball = next(line for line in axis.lines if line.get_marker() == "o")
    assert ball.get_ydata()[0] == pytest.approx(1e3 * (4e-3 + run.impactor_displacement()[i]))
    (arrows,) = axis.collections
    assert arrows.V[2] < 0
    assert arrows.Umask.tolist() == [run.force(0)[i] == 0, True, False]


def test_no_force_is_lost_between_pictures(run):
    log = run.contacts
    for frames in (2, 7, 40):
        stage = animation._stage(run, animation._samples(run, None, frames), None)
        for stop, shown in enumerate(stage.forces):
            mine = log.peak_force[log.stop == stop]
            assert shown.max() == pytest.approx(mine.max(initial=0.0))
    assert stage.force_axis.get_ylabel() == "peak contact\nforce / N"


def test_a_contact_between_two_samples_shows_in_the_nearest_picture(run):
    number = int(np.argmax(run.contacts.peak_force))
    entry = float(run.contacts.t_in[number])
    columns = {name: column[[number]] for name, column in run.contacts.arrays().items()}
    log = replace(run.contacts, **columns | {"t_out": np.array([entry + 1e-6])})
    short = replace(run, contacts=log, kept_readout={"forces": np.zeros((len(run.stops), len(run.t)))})
    stage = animation._stage(short, animation._samples(short, None, 30), 25.0)
    (picture,) = np.flatnonzero(stage.forces[log.stop[0]])
    assert picture == np.argmin(np.abs(run.t[stage.samples] - entry))
    assert stage.forces[log.stop[0]][picture] == log.peak_force[0]


PACES = {25.0: "66.7 times slower than real time", 5e3: "3 times faster than real time", 1 / 6e-4: "in real time"}


@pytest.mark.parametrize("fps", PACES)
def test_the_title_says_how_fast_the_film_is(run, fps):
    stage = animation._stage(run, animation._samples(run, None, 34), fps)  # 0.6 ms from picture to picture
    stage.show(3)
    assert stage.title.get_text().endswith(f" s, {PACES[fps]}")


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("run.avi", {}, "the suffix must be .gif or .mp4, got '.avi'"),
        ("run.gif", {"frames": 1}, "frames must be 2 to 1000, got 1"),
        ("run.gif", {"window": (5.0, 6.0)}, "the window must hold at least 2 samples"),
        ("missing/run.gif", {}, "the folder must exist"),
    ],
)
def test_refusals(run, tmp_path, name, options, message):
    with pytest.raises(ValueError, match=message):
        fb.plot.animate(run, tmp_path / name, **options)


def test_a_run_read_from_its_file_looks_the_same(run, tmp_path):
    own, loaded = (fb.plot.frame(one, 0.01) for one in (run, fb.load(run.save(tmp_path / "run"))))
    for axis, again in zip(own.axes, loaded.axes, strict=True):
        assert axis.get_ylim() == again.get_ylim()
        for line, other in zip(axis.lines, again.lines, strict=True):
            np.testing.assert_array_equal(line.get_xydata(), other.get_xydata())


def test_a_run_without_its_model_cannot_be_drawn(run, tmp_path):
    with pytest.raises(ValueError, match="needs the model of the run"):
        fb.plot.animate(replace(run, model=None), tmp_path / "run.gif")


def test_an_mp4_without_ffmpeg_is_refused(run, tmp_path, monkeypatch):
    from matplotlib.animation import FFMpegWriter

    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(ValueError, match=r"an .mp4 needs the program ffmpeg"):
        fb.plot.animate(run, tmp_path / "run.mp4")


def test_without_contacts_there_is_no_panel_of_forces():
    scene = fb.Scene(fb.Beam(0.4, STEEL), [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 100.0))
    upper, lower = animation.frame(scene.reduce(1).simulate(0.02, 1e-3), 0.01).axes
    assert lower.get_ylabel() == ""
    assert lower.get_position().height < 0.1 * upper.get_position().height
