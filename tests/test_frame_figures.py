"""Figures of frames: where the drawn lines lie, how much they are magnified, in the plane and in space."""

import dataclasses

import meshio
import numpy as np
import pytest
from frames import portal, space_l
from mpl_toolkits.mplot3d import proj3d
from problems import ROD

import fembeam as fb
from contacts import KelvinVoigt
from fembeam.results import files
from fembeam.results import html_page as html


@pytest.fixture(scope="module")
def plane():
    """The portal, shaken against a stop."""
    stop = fb.Stop("C", KelvinVoigt(1e6, 50.0), gap=1e-3, direction="x")
    held = [fb.Clamped("A"), fb.Clamped("D")]
    scene = fb.Scene(portal(), held, stops=[stop], base={"x": fb.Harmonic(1e-3, 40.0)}, damping=fb.ModalDamping(0.02))
    return scene.reduce(modes=3, elements=12).simulate(duration=1.0, dt=1e-2)


@pytest.fixture(scope="module")
def space():
    """The space L, shaken along z."""
    scene = fb.Scene(space_l(), [fb.Clamped("A")], base={"z": fb.Harmonic(1e-3, 80.0)})
    return scene.reduce(modes=3, elements=8).simulate(duration=0.2, dt=1e-2)


def test_deflected(plane):
    """The red line goes through the node where scale times its displacement says, and rests at the supports."""
    figure = fb.plot.deflected(plane, t=0.5, scale=100.0)
    rest, moved = figure.axes[0].lines
    x, y = (np.asarray(values) for values in moved.get_data())
    at_c = np.array([4.0, 3.0]) + 100 * np.array([plane.displacement("C", c)[50] for c in "xy"])
    assert np.nanmin(np.hypot(x - at_c[0], y - at_c[1])) < 1e-9
    assert np.nanmin(np.hypot(x, y)) == 0
    assert np.nanmax(rest.get_xdata()) == 4.0
    title = fb.plot.deflected(plane).axes[0].get_title(loc="left")
    most = max(np.hypot(*(plane.displacement(name, c) for c in "xy")).max() for name in "BC")
    assert most <= 1.001 * float(title.split()[-2]) < 1.05 * most


@pytest.mark.parametrize(("members", "pieces"), [(1, 12), (50, 600), (100, 600), (250, 500), (400, 800)])
def test_members_are_drawn_in_fewer_pieces_where_there_are_many(members, pieces):
    """Twelve each, 600 at most in all, but two each."""
    nodes = {f"{i}": (float(i), 0.1 * (i % 2)) for i in range(members + 1)}
    assert len(fb.Frame.polyline(nodes, portal().members[0].section).edges) == pieces


def test_in_space(space):
    """Three axes; the shapes are magnified to an eighth of the body."""
    figure = fb.plot.mode_shapes(space.model)
    assert [axis.name for axis in figure.axes] == ["3d"] * 3
    assert "mode 1: 104.63 rad/s" in figure.axes[0].get_title()
    _, moved = figure.axes[0].lines
    x, y, z = (np.asarray(values, dtype=float) for values in moved.get_data_3d())
    assert np.nanmax(np.abs(z)) == pytest.approx(0.12 * np.hypot(0.5, 0.3), rel=0.1)
    assert np.nanmin(np.abs(x) + np.abs(y) + np.abs(z)) == 0
    assert fb.plot.deflected(space).axes[0].name == "3d"


def test_moving_pictures(plane, space, tmp_path):
    """Both are written, and a picture shows its time and scale."""
    for name, run in (("plane.gif", plane), ("space.gif", space)):
        assert fb.plot.animate(run, tmp_path / name, frames=3).stat().st_size > 1000
    title = fb.plot.frame(plane, t=0.3).axes[0].get_title()
    assert title.startswith("t = 0.3000 s, displacements x ")


def test_paraview(space, tmp_path):
    """The points of the members, where they are, with displacements and section forces."""
    found = meshio.read(space.to_vtu(tmp_path / "l.vtu"))
    corner = np.flatnonzero(np.linalg.norm(found.points - [0.5, 0.3, 0.0], axis=1) < 1e-12)
    assert len(corner) == 1
    moved = found.point_data["displacement"][corner[0]]
    assert np.allclose(moved, [space.displacement("C", c)[-1] for c in "xyz"], rtol=0, atol=1e-15)
    root = np.flatnonzero(np.linalg.norm(found.points, axis=1) == 0)[0]
    forces = space.section_forces(("A-B", 0.0))
    for name, values in forces.items():
        assert found.point_data[name][root] == pytest.approx(values[-1], rel=1e-9, abs=1e-9)
    assert space.to_xdmf(tmp_path / "l.xdmf").exists()


def test_refused(plane):
    """Times outside the run, scales that are none, beams."""
    for options, says in ({"t": 2.0}, "within the run, 0 to 1 s"), ({"scale": 0.0}, "scale must be above 0"):
        with pytest.raises(ValueError, match=says):
            fb.plot.deflected(plane, **options)
    beam = fb.Scene(ROD, [fb.Clamped(0.0)]).reduce(modes=1)
    with pytest.raises(ValueError, match="must be a frame or a structure"):
        fb.plot.deflected(beam.simulate(duration=0.1, dt=1e-2))


def test_rig_of_a_frame():
    """A stop stands ahead the way its gap closes, on the frame; names stand in the figure, the frame is where it is."""
    law = KelvinVoigt(1e6, 50.0)
    scene = fb.Scene(
        portal(), [fb.Clamped("A"), fb.Fixed("D", "x", "y", name="hinge")],
        stops=[fb.Stop(("B-C", 0.7), law, gap=1e-3, direction="-y")], masses=[fb.LumpedMass("C", 2.0, name="box")],
        base={"x": fb.Harmonic(1e-3, 40.0)},
    )  # fmt: skip
    axis = scene.figure().axes[0]
    body, tip, ground = axis.lines[1], *axis.lines[-2:]  # of three members, the beam; supports, mass, stop
    np.testing.assert_allclose(np.transpose(body.get_data()), [[0, 3], [4, 3]], atol=1e-12)
    (x, y), (_, low) = tip.get_data(), ground.get_data()
    assert (x.min() + x.max()) / 2 == pytest.approx(0.7)
    assert low.min() < y.min() < y.max() < 3.0
    np.testing.assert_allclose(axis.patches[0].get_path().vertices[: len(x)], np.transpose((x, y)))  # filled
    texts = " ".join(text.get_text().replace("\n", " ") for text in axis.texts)
    for word in ("clamp at A", "hinge", "box, 2 kg", "stop at B- C + 0.7 m, -y, gap 1 mm"):
        assert word.replace("- ", "-") in texts.replace("- ", "-")
    assert "base motion along x" in axis.get_title(loc="left")


def test_few_contacts_are_seen_beside_their_median(plane):
    *_, restitution = fb.plot.contacts(plane).axes
    dots, median = restitution.lines
    assert 0 < len(dots.get_xdata()) == len(plane.contacts) < 200
    assert dots.get_markersize() > 4
    assert dots.get_zorder() > median.get_zorder()


def test_texts_of_a_rig_in_space_lie_apart():
    """A shaft with stops close together: numbers at the places, and a list of all names beside the axes."""
    law = KelvinVoigt(1e6, 50.0)
    shaft = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7850.0, 0.03))
    stops = [fb.AnnularStop(z, law, clearance=1e-4) for z in (0.5, 0.8)]
    stops += [fb.Stop("B", law, gap=1e-4, direction=way) for way in ("x", "-y")]
    figure = fb.Scene(shaft, [fb.Clamped("A")], stops=stops).figure()
    figure.draw_without_rendering()
    *numbers, listed = figure.axes[0].texts
    assert [text.get_text().strip() for text in numbers] == ["1", "2", "3", "4"]
    for name in ("clamp at A", "annular stop at 0.8 m", "stop at B, x", "stop at B, -y, gap 0.1 mm"):
        assert name in listed.get_text()
    axis, box = figure.axes[0], listed.get_window_extent()
    x, y, _ = proj3d.proj_transform(*np.transpose([text.get_position_3d() for text in numbers]), axis.get_proj())
    at = axis.transData.transform(np.column_stack([x, y]))
    assert np.linalg.norm(np.diff(at, axis=0), axis=1).min() > listed.get_fontsize()
    assert at[:, 0].max() + 50.0 < box.x0 < box.x1 <= figure.bbox.x1
    names = [one.label.get_window_extent() for one in (axis.xaxis, axis.yaxis, axis.zaxis)]
    assert min(name.y0 for name in names) > 0.0  # of a shaft that stands upright, too


def test_rigs_in_space_of_unknown_places_and_of_several_bodies():
    space = fb.Scene(space_l(), [fb.Clamped("A")], stops=[fb.Stop("B", KelvinVoigt(1e6, 50.0), direction="-z")])
    axis = space.figure().axes[0]
    z = axis.lines[-1].get_data_3d()[2]
    assert z[1] < z[0] < 0.0
    chain = fb.Structure([[2.0, -1.0], [-1.0, 2.0]], np.eye(2), labels=[(20, "x"), (40, "x")])
    body = fb.Scene(ROD, [fb.Clamped(0.0)])
    both = fb.Scene(chain, masses=[fb.LumpedMass(40, 1.0)], bodies=[body])
    first, second = both.figure().axes
    assert "places are not known" in first.get_title(loc="left")
    assert [text.get_text() for text in first.texts] == ["mass at 40, 1 kg"]
    assert second.get_xlabel() == "z / m"
    with pytest.raises(ValueError, match="a rig of several bodies needs a figure of its own"):
        both.figure(second)
    with pytest.raises(ValueError, match="the axes must be of three dimensions"):
        space.figure(second)


def test_flat_frames_in_space_have_axes_whose_numbers_do_not_meet():
    elbow = fb.Frame.polyline(
        {"A": (0, 0, 0), "B": (0.5, 0, 0), "C": (0.5, 0.3, 0)}, fb.Section.circle(2e11, 7800.0, 0.02)
    )
    figure = fb.plot.mode_shapes(fb.Scene(elbow, [fb.Clamped("A")]).reduce(2, elements=4))
    for axis in figure.axes:
        assert np.ptp(axis.get_zlim()) > 0.25 * np.hypot(0.5, 0.3)
        assert len(axis.get_zticks()) <= 4


@pytest.mark.parametrize("end", [(0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (0.0, 1.0, 1.0)])
def test_names_of_the_axes_of_a_rig_in_space_are_inside(end):
    """Those of an upright shaft were cut off below."""
    frame = fb.Frame.polyline({"A": (0.0, 0.0, 0.0), "B": end}, fb.Section.circle(2.1e11, 7850.0, 0.04))
    figure = fb.Scene(frame, [fb.Clamped("A")], masses=[fb.LumpedMass("B", 1.0)]).figure()
    figure.draw_without_rendering()
    (axis,) = figure.axes
    for one in (axis.xaxis, axis.yaxis, axis.zaxis):
        assert figure.bbox.containsx(one.label.get_window_extent().x1)
        assert figure.bbox.containsy(one.label.get_window_extent().y0)


def test_each_curve_of_a_spectrum_has_its_own_colour(plane):
    """Base motions along two directions stand above, beside δ; below is another place alone."""
    noise = {c: fb.BandNoise(1e-3, (5.0, 60.0), seed=i) for i, c in enumerate("xy")}
    scene = dataclasses.replace(plane.model.scene, base=noise)
    upper, lower = fb.plot.spectrum(scene.reduce(modes=3, elements=12).simulate(5.0, 1e-2)).axes
    shown = [[(line.get_label(), line.get_color()) for line in axis.lines if line.get_linestyle() == "-"]
             for axis in (upper, lower)]  # fmt: skip
    assert [label for label, _ in shown[0]] == ["base x", "base y", "δ"]
    assert [label.startswith("base") for label, _ in shown[1]] == [False]
    assert len({colour for _, colour in shown[0] + shown[1]}) == 4


def test_drawing_frames_reports_nothing(plane, caplog):
    """matplotlib reports every fixed limit that it moves for equal scales, again at each layout."""
    rig = fb.plot.rig(plane.model.scene)
    for figure in (fb.plot.mode_shapes(plane.model), fb.plot.deflected(plane), fb.plot.frame(plane, t=0.3), rig):
        figure.draw_without_rendering()
    assert not caplog.records


def test_static_shapes_are_called_so(plane, tmp_path):
    """Their frequency is that of the reduced model, of no mode of the structure."""
    model = plane.model.scene.reduce(modes=2, residual=True, elements=12)
    run = model.simulate(duration=5.0, dt=1e-2)
    titles = [axis.get_title(loc="left").partition(":")[0] for axis in fb.plot.mode_shapes(model).axes]
    assert titles == ["mode 1", "mode 2", "static shape"]
    above = {
        text.get_text().split(" =")[0].split(":")[0] for text in fb.plot.spectrum(run, omega_max=1e3).axes[0].texts
    }
    assert {r"$\omega_{1}$", r"$\omega_{2}$", "static shape"} <= above
    assert r"$\omega_{3}$" not in above
    files.write(run, tmp_path)
    assert "<td>static shape</td>" in html.write_page(tmp_path).read_text(encoding="utf-8")


def test_rotations_are_drawn_in_radians():
    frame = fb.Frame.polyline({"A": (0, 0), "B": (0, 1), "C": (0.8, 1)}, fb.Section.circle(2.1e11, 7850.0, 0.02))
    base, damping = {"x": fb.Harmonic(1e-3, 30.0)}, fb.ModalDamping(0.05)
    model, turned = fb.Scene(frame, [fb.Clamped("A")], base=base, damping=damping).reduce(modes=2), ("C", "rz")
    orbit, run = model.orbit(), model.simulate(0.5, 1e-2)
    branch = model.branch("base.x.omega", (29.0, 31.0)).run()
    figures = fb.plot.orbit(orbit, turned), fb.plot.branch(branch, turned), fb.plot.time_history(run, z=turned)
    drawn = [axis for figure in figures for axis in figure.axes]
    labels = [axis.get_ylabel() for axis in drawn]
    assert labels == ["u(C, rz) / mrad", "velocity / rad/s", "max |u(C, rz)| / mrad", "rotation / mrad"]
    assert drawn[0].lines[0].get_ydata() == pytest.approx(1e3 * orbit.run.displacement(turned))
    assert drawn[2].lines[0].get_ydata().max() == pytest.approx(1e3 * np.abs(branch.extremes(turned)).max())
