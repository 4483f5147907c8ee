"""Bending moment, shear force and stress along the beam; extremes; files for ParaView."""

import math
from dataclasses import replace

import numpy as np
import pytest

import fembeam as fb
from contacts import Hertz

SQUARE = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)
EI, L = SQUARE.bending_stiffness, 0.4
CLAMPED = [fb.Clamped(0.0)]


def mode(b, z, derivative):
    """A clamped–free mode shape's derivatives, b = βL, up to a factor."""
    x, sigma = b * z / L, (math.cosh(b) + math.cos(b)) / (math.sinh(b) + math.sin(b))
    even = {0: (-1, -1), 2: (1, 1), 3: (1, -1)}[derivative]
    if derivative == 3:
        shape = np.sinh(x) - np.sin(x) - sigma * (np.cosh(x) + np.cos(x))
    else:
        shape = np.cosh(x) + even[0] * np.cos(x) - sigma * (np.sinh(x) + even[1] * np.sin(x))
    return (b / L) ** derivative * shape


def test_moment_and_shear_of_modes_are_as_good_as_their_frequencies():
    model = fb.Scene(fb.Beam(L, SQUARE), CLAMPED).reduce(3)
    z = np.linspace(0, 0.99 * L, 57)
    for i, b in enumerate([1.875104068711961, 4.694091132974175, 7.854757438237613]):
        scale = model.phi(L)[i] / mode(b, L, 0)
        moment, shear = (EI * scale * mode(b, z, d) for d in (2, 3))
        found = model.section_forces[0]
        np.testing.assert_allclose(found.moment(z)[:, i], moment, atol=3e-6 * np.abs(moment).max())
        at_nodes = found.nodes[5:40]
        exact = EI * scale * mode(b, at_nodes, 3)
        np.testing.assert_allclose(found.shear(at_nodes)[:, i], exact, atol=1e-7 * np.abs(shear).max())
        np.testing.assert_allclose(found.shear(z)[:, i], shear, atol=5e-5 * np.abs(shear).max())


def test_free_ends_carry_nothing():
    model = fb.Scene(fb.Beam(L, SQUARE)).reduce(4)
    forces = model.section_forces[0]
    ends = np.array([0.0, L])
    assert np.abs(forces.moment(ends)).max() < 1e-7 * np.abs(forces.moment(np.linspace(0, L, 9))).max()
    assert np.abs(forces.shear(ends)).max() < 1e-7 * np.abs(forces.shear(np.linspace(0, L, 9))).max()
    assert np.abs(forces.moment(np.linspace(0, L, 9))[:, :2]).max() < 1e-6


@pytest.mark.parametrize("options", [{"axial_force": 400.0}, {"axial_force": -100.0}, {"foundation": 3e4}])
def test_moment_is_the_curvature_and_shear_its_slope_whatever_acts(options):
    model = fb.Scene(fb.Beam(L, SQUARE, **options), CLAMPED, [fb.LumpedMass(0.3, 0.2)]).reduce(2)
    z = np.linspace(0.01, 0.29, 29)
    forces, step = model.section_forces[0], 1e-4
    curvature = (model.phi(z + step, 1) - model.phi(z - step, 1)) / (2 * step)
    assert np.abs(forces.moment(z) - EI * curvature).max() < 3e-3 * np.abs(EI * curvature).max()
    slope = (forces.moment(z + step) - forces.moment(z - step)) / (2 * step)
    assert np.abs(forces.shear(z) - slope).max() < 1e-4 * np.abs(slope).max()


def test_a_lumped_mass_makes_the_shear_jump_by_its_inertia():
    mass = 0.2
    model = fb.Scene(fb.Beam(L, SQUARE), CLAMPED, [fb.LumpedMass(0.3, mass)]).reduce(2)
    before, after = model.section_forces[0].shear([0.3 - 1e-9, 0.3 + 1e-9])
    np.testing.assert_allclose(after - before, mass * model.omega**2 * model.phi(0.3), rtol=1e-5)


def test_static_moment_line_is_exact_with_the_residual_shape():
    scene = fb.Scene(fb.Beam(L, SQUARE), CLAMPED, stops=[fb.Stop(0.3, Hertz(1e7), gap=1.0)])
    model = scene.reduce(2, residual=True)
    run = model.simulate(1e-4, 1e-4, start=model.equilibrium({0.3: -10.0}))
    z = np.linspace(0.0, 0.4, 33)
    np.testing.assert_allclose(run.moment(z)[0], -10.0 * np.maximum(0.3 - z, 0.0), atol=1e-7)
    np.testing.assert_allclose(run.shear(z + 1e-6 * (z < L))[0], 10.0 * (z < 0.2999), atol=1e-5)


STATIC_LOADS = {
    "force": ({"forces": [fb.PointForce(L, fb.Harmonic(3.0, 0.0))]}, 3.0, 0.0),
    "moment": ({"forces": [fb.PointMoment(L, fb.Harmonic(3.0, 0.0))]}, 0.0, 3.0),
    "foot": ({"springs": [fb.Spring(L, 1e3, foot=fb.Harmonic(2e-3, 0.0))]}, 2.0 / (1 + 1e3 * L**3 / (3 * EI)), 0.0),
    "two places": ({"forces": [fb.PointForce(z, fb.Harmonic(1.5, 0.0)) for z in (L, L - 1e-3)]}, 3.0, -1.5e-3),
}


@pytest.mark.parametrize("given", STATIC_LOADS)
def test_static_shapes_of_loads_give_exact_moments_and_shears(given):
    """A tip load gives V = -F and M = F (L - z) + M₀; with one mode the shear was up to 4 % off."""
    parts, force, moment = STATIC_LOADS[given]
    model = fb.Scene(fb.Beam(L, SQUARE), CLAMPED, **parts).reduce(1, residual=True)
    q = sum(vector * float(signal(0.0)) for vector, signal in model.system.loads) / model.omega**2
    z, found = np.linspace(0.0, 0.9 * L, 33), model.section_forces[0]
    size = force * L + abs(moment)
    np.testing.assert_allclose(found.moment(z) @ q, force * (L - z) + moment, atol=1e-8 * size)
    np.testing.assert_allclose(found.shear(z) @ q, -force, atol=1e-7 * size / L)


@pytest.mark.parametrize("option", ["residual", "interface"])
def test_static_shapes_on_a_coarse_mesh(option):
    """More shapes and loads than dofs: inertia and loads were mixed, the shear was off by 1.0 N of 10 N."""
    places, sizes = np.array([0.1, 0.2, 0.3, L]), np.array([4.0, -3.0, 7.0, 2.0])
    forces = [fb.PointForce(z, fb.Harmonic(size, 0.0)) for z, size in zip(places, sizes, strict=True)]
    model = fb.Scene(fb.Beam(L, SQUARE), CLAMPED, forces=forces).reduce(2, elements=4, **{option: True})
    q = sum(vector * float(signal(0.0)) for vector, signal in model.system.loads) / model.omega**2
    z, found = np.linspace(0.01, 0.39, 20), model.section_forces[0]
    ahead = np.where(places > z[:, None], 1.0, 0.0)
    np.testing.assert_allclose(found.shear(z) @ q, -ahead @ sizes, atol=1e-7)
    np.testing.assert_allclose(found.moment(z) @ q, (ahead * (places - z[:, None])) @ sizes, atol=1e-8)


def test_stress_is_moment_over_section_modulus_plus_tension():
    beam = fb.Beam(L, SQUARE, axial_force=500.0)
    model = fb.Scene(beam, CLAMPED).reduce(3)
    run = model.simulate(1e-4, 1e-4, start=model.equilibrium({L: -10.0}))
    expected = run.moment(0.1) / (0.01**3 / 6) + 500.0 / 1e-4
    np.testing.assert_allclose(run.stress(0.1), expected, rtol=1e-12)


def test_stress_needs_the_outer_fibre(tmp_path):
    bare = fb.Section(2.1e11, 7850.0, 1e-4, 1e-9)
    run = fb.Scene(fb.Beam.of_spans([(0.2, SQUARE), (0.2, bare)]), CLAMPED).reduce(2).simulate(1e-4, 1e-4)
    assert run.stress(0.1).shape == (2,)
    with pytest.raises(ValueError, match=r"every section must know its outer fibre, got \[0.3\]"):
        run.stress([0.1, 0.3])
    loaded = fb.load(run.save(tmp_path / "run"))
    assert loaded.slope(0.3).shape == (2,)
    with pytest.raises(ValueError, match=r"every section must know its outer fibre, got \[0.3\]"):
        loaded.stress(0.3)
    with pytest.raises(ValueError, match="quantity must be one of displacement, slope"):
        run.extremes("strain")
    with pytest.raises(ValueError, match="z must lie on the beam"):
        run.moment(0.5)


def test_extremes_say_where_and_when():
    model = fb.Scene(fb.Beam(L, SQUARE), CLAMPED).reduce(1)
    quarter = math.pi / model.omega[0] / 2
    run = model.simulate(4 * quarter, quarter / 25, start=model.equilibrium({L: -5.0}))
    found = run.extremes("moment")
    value, z, t = found.largest
    assert z == 0.0
    assert abs(value) == pytest.approx(abs(run.moment(0.0)[0]), rel=1e-9)
    assert t in [pytest.approx(2 * turns * quarter) for turns in (0, 1, 2)]
    u = run.displacement(found.z)
    down = run.extremes()
    np.testing.assert_allclose(down.lowest, u.min(axis=0), atol=1e-18)
    np.testing.assert_allclose(down.highest, u.max(axis=0), atol=1e-18)
    assert run.extremes("slope", [0.1, L]).highest.shape == (2,)


def at_rest_under(scene, load):
    """A run that stays in the static deflection under a load that does not change."""
    model = scene.reduce(1, residual=True)
    q = model.system.loads[0][0] * load / model.omega**2
    return model.simulate(1e-4, 1e-4, start=np.concatenate([q, 0 * q]))


def test_extremes_are_those_of_both_sides_of_a_jump():
    """±m/2 on both sides of a moment m in the middle; the stress of the thinner span, which lies behind the border."""
    moment = fb.Harmonic(6.0, 0.0)
    frame = fb.Frame({"A": (0, 0), "B": (L, 0)}, [fb.Member("A", "B", SQUARE)])
    beam = fb.Scene(fb.Beam(L, SQUARE), [fb.Pinned(0.0), fb.Pinned(L)], forces=[fb.PointMoment(L / 2, moment)])
    turned = [fb.PointMoment(("A-B", L / 2), moment, direction="rz")]
    for scene in beam, fb.Scene(frame, [fb.Pinned("A"), fb.Pinned("B")], forces=turned):
        found = at_rest_under(scene, 6.0).extremes("moment")
        assert (found.lowest.min(), found.highest.max()) == pytest.approx((-3.0, 3.0), rel=1e-6)
    thick = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.02)
    stepped = fb.Beam.of_spans([(L / 2, SQUARE), (L / 2, thick)])
    run = at_rest_under(fb.Scene(stepped, [fb.Clamped(L)], forces=[fb.PointForce(0.0, fb.Harmonic(5.0, 0.0))]), 5.0)
    value, z, _ = run.extremes("stress").largest
    assert (value, z) == (pytest.approx(5.0 * L / 2 / (0.01**3 / 6), rel=1e-6), L / 2)


# --- files --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def collision():
    other = fb.Scene(fb.Beam(0.3, SQUARE), CLAMPED)
    scene = fb.Scene(fb.Beam(L, SQUARE), CLAMPED, bodies=[other], stops=[fb.Stop(0.3, Hertz(1e9), 1e-3, on=(1, 0.3))],
                     impactors=[fb.Impactor(L, 0.1, -1.0, Hertz(1e9), gap=2e-3)])  # fmt: skip
    return scene.reduce(3).simulate(0.01, 1e-3)


def test_xdmf_opens_again_with_the_same_values(collision, tmp_path):
    import meshio

    run, path = collision, collision.to_xdmf(tmp_path / "run", stride=np.int64(2))
    assert path.suffix == ".xdmf"
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    own, second = (len(shapes.nodes) for shapes in (run.shapes, *run.others))
    with meshio.xdmf.TimeSeriesReader(path) as reader:
        points, (cells,) = reader.read_points_cells()
        assert points[:own, 0].tolist() == run.shapes.nodes.tolist()
        assert points[own : own + second, 1].tolist() == [-1e-3] * second
        assert points[-1].tolist() == [L, 2e-3, 0.0]
        assert len(cells.data) == own - 1 + second - 1 + 1
        assert reader.num_steps == 6
        for step in range(reader.num_steps):
            t, data, _ = reader.read_data(step)
            assert t == run.t[2 * step]
            expected = run.displacement(run.shapes.nodes)[2 * step]
            np.testing.assert_allclose(data["displacement"][:own, 1], expected, rtol=1e-13)
            stress, moment = run.stress(run.shapes.nodes)[2 * step], run.moment(run.others[0].nodes, 1)[2 * step]
            np.testing.assert_allclose(data["stress"][:own], stress, rtol=1e-10, atol=1e-9)
            np.testing.assert_allclose(data["moment"][own:-1], moment, rtol=1e-10, atol=1e-12)
            assert data["velocity"][-1, 1] == pytest.approx(run.impactor_velocity()[2 * step], rel=1e-13)


def test_xdmf_is_the_text_of_meshio_without_its_slow_rows(collision, tmp_path, monkeypatch):
    from meshio.xdmf import TimeSeriesWriter

    import fembeam.model.run_paraview as paraview

    its_own = TimeSeriesWriter("", "XML").numpy_to_xml_string
    for values in (np.array([[1.0 / 3.0, -0.0, 1e-310], [np.pi, 2e5, np.nan]]), np.arange(-2, 4).reshape(3, 2)):
        assert paraview._as_text(values) == its_own(values)
    monkeypatch.setattr(np, "savetxt", lambda *_: pytest.fail("written number by number"))
    collision.to_xdmf(tmp_path / "run")


def test_vtu_holds_one_sample(collision, tmp_path):
    import meshio

    mesh = meshio.read(collision.to_vtu(tmp_path / "last.vtu"))
    u = collision.displacement(collision.shapes.nodes)[-1]
    np.testing.assert_allclose(mesh.point_data["displacement"][: len(u), 1], u, rtol=1e-13)


def test_a_series_of_vtu_names_its_files_and_times(collision, tmp_path):
    import xml.etree.ElementTree as ElementTree

    import meshio

    path = collision.to_vtu(tmp_path / "a & b.vtu", stride=4)
    assert path.name == "a & b.pvd"
    rows = ElementTree.parse(path).findall("Collection/DataSet")
    assert [float(row.get("timestep")) for row in rows] == collision.t[::4].tolist()
    assert sorted(entry.name for entry in tmp_path.iterdir()) == sorted([path.name, *(row.get("file") for row in rows)])
    for row, expected in zip(rows, collision.velocity(collision.shapes.nodes)[::4], strict=True):
        found = meshio.read(tmp_path / row.get("file")).point_data["velocity"]
        np.testing.assert_allclose(found[: len(expected), 1], expected, rtol=1e-13, atol=1e-15)


def test_xdmf_with_hdf5_holds_the_same(collision, tmp_path, monkeypatch):
    import meshio

    pytest.importorskip("h5py", reason="the extra hdf5 is not installed")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    text, binary = collision.to_xdmf("text"), collision.to_xdmf("out/run", hdf5=True)
    assert [entry.name for entry in tmp_path.iterdir() if entry.is_file()] == ["text.xdmf"]
    assert sorted(entry.name for entry in binary.parent.iterdir()) == ["run.h5", "run.xdmf"]
    with meshio.xdmf.TimeSeriesReader(text) as one, meshio.xdmf.TimeSeriesReader(binary) as other:
        np.testing.assert_array_equal(one.read_points_cells()[0], other.read_points_cells()[0])
        assert one.num_steps == other.num_steps
        (t, data, _), (t_other, data_other, _) = one.read_data(5), other.read_data(5)
        assert t == t_other
        assert data.keys() == data_other.keys()
        for name, values in data.items():
            np.testing.assert_allclose(data_other[name], values, rtol=1e-13, atol=1e-300)


def test_files_refuse(collision, tmp_path):
    with pytest.raises(ValueError, match="the folder must exist"):
        collision.to_xdmf(tmp_path / "missing" / "run")
    with pytest.raises(ValueError, match="stride must be a whole number above 0, got 0"):
        collision.to_xdmf(tmp_path / "run", stride=0)
    with pytest.raises(ValueError, match="sample must be below 11"):
        collision.to_vtu(tmp_path / "run", sample=11)
    with pytest.raises(ValueError, match="needs the model of the run"):
        replace(collision, model=None).to_vtu(tmp_path / "run")
    with pytest.raises(ValueError, match="stride must be a whole number above 0, got 0"):
        collision.to_vtu(tmp_path / "run", stride=0)
    assert not list(tmp_path.iterdir())
