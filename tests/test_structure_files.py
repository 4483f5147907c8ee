"""Structures in scene files and from matrix files; what the command line, studies and figures make of them."""

import json
import pickle
from dataclasses import replace
from functools import partial

import meshio
import numpy as np
import pytest
from scipy import io, sparse
from structures import BEAM, ELEMENTS, LAW, LENGTH, beam_labels, beam_matrices, beam_structure

import fembeam as fb
from fembeam import plot, study
from fembeam.cli import main
from fembeam.scene_file import read
from fembeam.support.fingerprint import fingerprint

FILE = """
[structure]
stiffness = "K.mtx"
mass = "M.npz"
labels = "dofs.csv"
nodes = "nodes.csv"
points = { root = 0, tip = 8 }
lines = [[0, 1, 2, 3, 4, 5, 6, 7, 8]]

[[supports]]
kind = "fixed"
at = "root"

[[masses]]
at = 4
mass = 0.1

[[stops]]
at = "tip"
direction = "y"
name = "upper"
gap = 1e-3
law = { kind = "kelvin_voigt", stiffness = 1e6, damping = 10.0 }

[[stops]]
at = "tip"
on = 2
direction = [0, -1, 0]
gap = 3e-3
law = { kind = "kelvin_voigt", stiffness = 1e6, damping = 10.0 }

[damping]
zeta = 0.01

[base.y]
kind = "harmonic"
amplitude = 1e-3
omega = 180.0

[reduce]
modes = 3

[simulate]
duration = 0.2
dt = 2e-4
places = [["tip", "y"], [2, "rx"]]
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with the matrices of a beam in other programs' files, and the scene file."""
    K, M = beam_matrices()
    io.mmwrite(tmp_path / "K.mtx", sparse.csr_matrix(K), precision=17, symmetry="symmetric")
    sparse.save_npz(tmp_path / "M.npz", sparse.csr_matrix(M))
    (tmp_path / "dofs.csv").write_text("# node, component\n" + "".join(f"{n}, {c}\n" for n, c in beam_labels()))
    (tmp_path / "nodes.csv").write_text("".join(f"{n} 0 0 {n * LENGTH / ELEMENTS}\n" for n in range(ELEMENTS + 1)))
    (tmp_path / "s.toml").write_text(FILE)
    return tmp_path


def test_matrices_of_files_are_the_structure(folder):
    body = fb.Structure.read(folder / "K.mtx", folder / "M.npz", None, folder / "dofs.csv", folder / "nodes.csv")
    same = beam_structure()
    np.testing.assert_allclose(body.K.toarray(), same.K.toarray(), rtol=1e-15, atol=1e-9)  # of 1e7 N/m
    np.testing.assert_array_equal(body.M.toarray(), same.M.toarray())
    assert body.labels == same.labels
    np.testing.assert_allclose(body.nodes[8], same.nodes[8])
    np.savez(folder / "dense.npz", K=same.K.toarray())
    np.save(folder / "dense.npy", same.M.toarray())
    assert fb.Structure.read(folder / "dense.npz", folder / "dense.npy", labels=beam_labels()).labels == same.labels


def test_a_scene_file_is_the_scene_in_python(folder):
    file = read(folder / "s.toml")
    scene = fb.Scene(
        beam_structure(points={"root": 0, "tip": 8}),
        [fb.Fixed("root")],
        masses=[fb.LumpedMass(4, 0.1)],
        stops=[
            fb.Stop("tip", LAW, 1e-3, direction="y", name="upper"),
            fb.Stop("tip", LAW, 3e-3, direction=(0, -1, 0), on=2),
        ],
        damping=fb.ModalDamping(0.01),
        base={"y": fb.Harmonic(1e-3, 180.0)},
    )
    one, other = file.model().simulate(0.2, 1e-3), scene.reduce(modes=3).simulate(0.2, 1e-3)
    assert len(one.contacts) > 4
    np.testing.assert_allclose(one.contacts.t_in, other.contacts.t_in, atol=1e-12)
    np.testing.assert_allclose(one.displacement(2, "rx"), other.displacement(2, "rx"), atol=1e-13)
    assert [one.name(i) for i in (0, 1)] == ["upper", "stop at tip, -y, on 2"]


def test_the_command_line_runs_and_checks_it(folder, capsys):
    assert main(["check", str(folder / "s.toml"), "--json"]) in (0, None)
    told = json.loads(capsys.readouterr().out)
    assert any("rᵀMr: 0.785 kg along y" in line for line in told["structure"])
    assert "share y" in told["modes"][0]
    out = folder / "out"
    assert main(["run", str(folder / "s.toml"), "--out", str(out)]) == 0
    head = (out / "histories.csv").read_text(encoding="utf-8").splitlines()[0]
    assert '"displacement at 2, rx [rad]"' in head
    assert "force upper [N]" in head
    assert (out / "modes.png").stat().st_size > 0
    again = fb.load(out / "run.npz")
    assert again.scene_file.scene.stops[0].name == "upper"  # its files travel with it
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert "upper" in json.dumps(summary)
    assert "NaN" not in json.dumps(summary)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('at = "tip"\ndirection = "y"', 'z = "tip"\ndirection = "y"', "unknown key 'z'"),
        ('at = "tip"\ndirection = "y"', 'at = "tipp"\ndirection = "y"', "'tip' is the nearest there is"),
        ('direction = "y"\n', "", "a place by name needs a direction.* has y, rx"),
        ('direction = "y"\n', 'direction = "x"\n', "must move along x; it has y, rx"),
        ("[base.y]", "[base.x]", "base must move along y, got 'x'"),
        ("[base.y]", "[base]", "base must name its directions"),
        ('[base.y]\nkind = "harmonic"\namplitude = 1e-3\nomega = 180.0', "[base]", r"\[base\]: must have a table for"),
        ('stiffness = "K.mtx"\n', "", r"\[structure\]: the key 'stiffness' is missing"),
        ('mass = "M.npz"', 'mass = "gone.npz"', "gone.npz: No such file"),
        ('mass = "M.npz"', 'mass = "dofs.csv"', "dofs.csv, its suffix: expected one of"),
        ('nodes = "nodes.csv"', "nodes = [[0, 0, 0]]", r"nodes must be the path of a file or a table"),
        ('mass = "M.npz"', 'mas = "M.npz"', "unknown key 'mas'; did you mean 'mass'"),
        ("[structure]", '[structure]\nscale = ["mm"]', "scale must be a list of three units"),
        ("[structure]", '[structure]\nscale = ["mm", "stone", "s"]', "mass must be one of kg"),
        ("[structure]", "[beam]\nlength = 1.0\n[structure]", r"needs one of the tables \[beam\] and \[structure\]"),
        ('["tip", "y"], [2, "rx"]', '["tp", "y"]', "'tip' is the nearest there is"),
        ("dt = 2e-4", 'dt = 2e-4\nquantities = ["moment"]', "section forces must be asked for on a member"),
        ('kind = "fixed"\nat = "root"', 'kind = "fixed"\nat = "root"\ndofs = ["x"]', "must hold dofs that exist"),
    ],
)
def test_mistakes_are_told_with_their_table(folder, old, new, message):
    text = FILE.replace(old, new, 1)
    assert text != FILE
    (folder / "s.toml").write_text(text)
    with pytest.raises(ValueError, match=message):
        read(folder / "s.toml").model()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("K.mtx", "%%MatrixMarket matrix coordinate real general\n3 3", "K.mtx, line 2: expected"),
        ("M.npz", "nothing", "M.npz, as a whole: expected arrays of numbers"),
        ("dofs.csv", "1, x\n2\n", "dofs.csv, line 2: expected a node and a component, got '2'"),
        ("nodes.csv", "1 0 0 0\n2 0 0 up\n", "nodes.csv, line 2: expected node, x, y, z, got '2 0 0 up'"),
    ],
)
def test_damaged_files_are_named(folder, name, content, message):
    (folder / name).write_text(content)
    with pytest.raises(ValueError, match=message):
        read(folder / "s.toml")


# --- studies and figures --------------------------------------------------------------------------------------------


def pair(base):
    """The beam and the structure that it is, under the same motion."""
    damping = fb.ModalDamping(0.02)
    beam = fb.Scene(BEAM, [fb.Clamped(0.0)], stops=[fb.Stop(LENGTH, LAW, 1e-3, "above")], damping=damping, base=base)
    body = fb.Scene(beam_structure(), [fb.Fixed("root")], stops=[fb.Stop("tip", LAW, 1e-3, direction="y")],
                    damping=damping, base={"y": base})  # fmt: skip
    return beam, body


def test_random_response_is_that_of_the_beam():
    """The same noise: the same realisation, hence the same estimates, over few impacts."""
    noise = fb.BandNoise(5e-4, (50.0, 400.0), seed=3)
    beam, body = (scene for scene in pair(noise))
    runs = beam.reduce(modes=2, elements=ELEMENTS).simulate(0.4, 1e-3), body.reduce(modes=2).simulate(0.4, 1e-3)
    np.testing.assert_allclose(runs[1].displacement("tip", "y"), runs[0].displacement(LENGTH), rtol=0,
                               atol=1e-6 * np.abs(runs[0].displacement(LENGTH)).max())  # fmt: skip
    assert set(plot.spectra_of(runs[1])) >= {"base y", "δ"}


def test_studies_are_those_of_the_beam():
    beam, body = pair(fb.Harmonic(1e-3, 180.0))
    plan = {"duration": 0.3, "dt": 1e-3}
    one = study.mode_count(beam, [1, 2], "peak_force", residual=False, reference=3, **plan)
    other = study.mode_count(body, [1, 2], "peak_force", residual=False, reference=3, **plan)
    first, second = ([row["value"] for row in found.table() if row.get("value") is not None] for found in (one, other))
    np.testing.assert_allclose(second, first, rtol=5e-3)  # the beam has its own mesh, right to 1e-6


def test_amplitude_at_a_place(folder):
    model = pair(fb.Harmonic(1e-3, 180.0))[1].reduce(modes=2)
    run = model.simulate(0.3, 1e-4)
    u = run.displacement(4, "y")
    assert study.quantities.Amplitude(z=(4, "y"))(run) == pytest.approx((u.max() - u.min()) / 2, rel=1e-3)


@pytest.mark.parametrize("lines", [True, False])
def test_figures_are_drawn(lines):
    body = beam_structure(**({} if lines else {"lines": (), "nodes": None}))
    scene = fb.Scene(body, [fb.Fixed("root")], stops=[fb.Stop("tip", LAW, 1e-3, direction="y", name="upper")],
                     damping=fb.ModalDamping(0.02), base={"y": fb.Harmonic(1e-3, 180.0)})  # fmt: skip
    model = scene.reduce(modes=2)
    run = model.simulate(0.4, 2e-4)
    titles = [axis.get_title() or axis.get_title("left") for axis in plot.mode_shapes(model).axes]
    assert any(title.startswith("mode 1: 2") for title in titles)
    assert "tip, y" in plot.time_history(run).get_suptitle()
    assert plot.densities(run).axes
    assert plot.spectrum(run).axes
    assert plot.frequency_response(model.frequency_response(np.linspace(50.0, 900.0, 60))).axes
    assert plot.floor_spectrum(run).axes
    orbit = model.orbit()
    assert "u(tip, y)" in plot.orbit(orbit).axes[0].get_ylabel()
    found = study.bifurcation(model, "omega", [179.0, 181.0], settle=3, keep=2)
    assert "u(tip, y)" in plot.bifurcation(found).axes[0].get_ylabel()
    assert "omega / rad s⁻¹  smallest peak / mm" in str(found)


def test_lines_are_shown_in_pictures_and_in_paraview(tmp_path):
    run = pair(fb.Harmonic(1e-3, 180.0))[1].reduce(modes=2).simulate(0.1, 1e-3)
    assert plot.animate(run, tmp_path / "run.gif", frames=3).stat().st_size > 1000
    found = meshio.read(run.to_vtu(tmp_path / "run.vtu"))
    tip = int(np.argmax(found.points[:, 2]))
    assert found.point_data["displacement"][tip, 1] == pytest.approx(run.displacement("tip", "y")[-1], rel=1e-12)


def test_what_cannot_be_drawn_says_so(tmp_path):
    body = beam_structure(lines=(), nodes=None)
    scene = fb.Scene(body, [fb.Fixed("root")], base={"y": fb.Harmonic(1e-3, 180.0)})
    run = scene.reduce(modes=2).simulate(0.1, 1e-3)
    with pytest.raises(ValueError, match="the body must know where its nodes are"):
        plot.animate(run, tmp_path / "run.gif")
    with pytest.raises(ValueError, match="bodies with lines"):
        run.to_xdmf(tmp_path / "run.xdmf")


def noisy_scene():
    """The structure under noise."""
    return pair(fb.BandNoise(3e-4, (50.0, 400.0), seed=1))[1]


def test_a_scene_is_told_by_what_it_was_made_of():
    """The same before and after its matrices were used, and in another process; another entry of K is another scene."""
    scene = noisy_scene()
    before = fingerprint(scene)
    model = scene.reduce(modes=2)
    model.simulate(0.05, 1e-3)
    scene.beam.check()
    assert fingerprint(scene) == before == fingerprint(noisy_scene())
    K = scene.beam.K.toarray()
    K[0, 0] *= 1.0 + 1e-9
    other = fb.Structure(K, scene.beam.M, labels=scene.beam.labels)
    assert fingerprint(other) != fingerprint(scene.beam)
    assert repr(other) != repr(scene.beam)
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.phi((4, "rx")), model.phi((4, "rx")))


def test_statistics_with_standard_errors():
    response = study.stationary(noisy_scene().reduce(modes=2), duration=10.0, dt=1e-3)
    assert {"δ std", "stop 0 rate"} <= set(response.numbers())
    free = replace(noisy_scene(), stops=())
    assert any(name.startswith("middle, y u") for name in study.stationary(free.reduce(modes=2), 10.0, 1e-3).numbers())


@pytest.mark.filterwarnings("ignore:.* hold one realisation")
def test_an_ensemble_resumes_from_its_checkpoint(tmp_path):
    quantity = partial(study.characteristics, duration=0.5, dt=1e-3, discard=0.1)
    model, path = noisy_scene().reduce(modes=2), tmp_path / "ensemble.npz"
    first = study.ensemble(model, 2, quantity, checkpoint=path)
    both = study.ensemble(noisy_scene().reduce(modes=2), 3, quantity, checkpoint=path)
    assert len(first) == 2
    assert len(both) == 3
    with pytest.raises(ValueError, match="another"):
        study.ensemble(pair(fb.BandNoise(3e-4, (50.0, 300.0), seed=1))[1].reduce(modes=2), 3, quantity, checkpoint=path)


BESIDE = {
    "job.sti": "1 1 3e5\n1 2 -1e5\n2 2 1e5\n",
    "job.mas": "1 1 2.0\n2 2 0.5\n",
    "job.dof": "20.1\n88.1\n",
    "parts/nodes.inp": "*NODE\n1,0,0,0\n2,.5,0,0\n",
    "parts/rig.inp": "*INCLUDE, INPUT=nodes.inp\n*ELEMENT, TYPE=B31, ELSET=all\n1,1,2\n",
    "../outside.inp": "*INCLUDE, INPUT=scene/parts/rig.inp\n",
}
MESH = """[beam]
mesh = "{}"
sections = {{ all = {{ shape = "circle", E = 2e11, rho = 7800, diameter = 0.01 }} }}
[[supports]]
kind = "clamped"
z = 0
"""


@pytest.mark.parametrize(
    "text",
    [
        '[structure]\nstiffness = "job.sti"\nmass = "job.mas"\n',
        MESH.format("parts/rig.inp"),
        MESH.format("../outside.inp"),
    ],
)
def test_a_saved_run_carries_what_its_files_are_read_with(tmp_path, text):
    """Names of dofs beside matrices and files that a mesh includes: the run could not be read as a scene."""
    folder = tmp_path / "scene"
    (folder / "parts").mkdir(parents=True)
    for name, content in BESIDE.items():
        (folder / name).write_text(content)
    (folder / "a.toml").write_text(text + "[damping]\nzeta = 0.01\n")
    file = read(folder / "a.toml")
    run = replace(file.model(modes=1).simulate(0.1, 1e-2), source=file.source)
    path = run.save(folder / "run.npz")
    for name in BESIDE:
        (folder / name).unlink()
    again = read(path)
    np.testing.assert_array_equal(again.model(modes=1).omega, file.model(modes=1).omega)
    assert again.source.files == file.source.files
