"""Structures by given modes in scene files: from a .npz, or written out; what is refused before computing."""

import re

import numpy as np
import pytest

import fembeam as fb
from contacts import KelvinVoigt
from fembeam.scene_file import SceneFileError, json_schema, read

OMEGA, SHAPES = [30.0, 190.0], [[0.5, -0.4], [0.2, 0.7]]
LABELS, GAMMA = [("tip", "y"), (4, "rx")], {"y": [1.2, 0.7]}
REST = """
points = { end = "tip" }
[[stops]]
at = "end"
direction = "y"
gap = 1e-3
law = { kind = "kelvin_voigt", stiffness = 1e4, damping = 10.0 }
[damping]
zeta = [0.02, 0.01]
[base.y]
kind = "harmonic"
amplitude = 1e-2
omega = 40.0
[simulate]
duration = 0.5
dt = 1e-2
"""
INLINE = """[structure]
omega = [30.0, 190.0]
shapes = [[0.5, -0.4], [0.2, 0.7]]
labels = [["tip", "y"], [4, "rx"]]
participation = { y = [1.2, 0.7] }"""
FILE = '[structure]\nmodes = "valve.npz"'


def written(folder, text, **changes):
    """The path of a scene file with valve.npz beside it."""
    arrays = {"omega": OMEGA, "shapes": SHAPES, "labels": np.array(LABELS, dtype=str), "participation_y": GAMMA["y"]}
    arrays = {name: one for name, one in {**arrays, **changes}.items() if one is not None}
    np.savez(folder / "valve.npz", **arrays)
    (folder / "scene.toml").write_text(text + REST)
    return folder / "scene.toml"


@pytest.mark.parametrize("text", [INLINE, FILE], ids=["inline", "npz"])
def test_it_is_the_structure_of_python(tmp_path, text):
    """The same digest, damping ratios and run as that of the constructor, contacts included."""
    file = read(written(tmp_path, text))
    body = fb.Structure.of_modes(OMEGA, SHAPES, LABELS, GAMMA, points={"end": "tip"})
    assert file.scene.beam.digest == body.digest
    stop = fb.Stop("end", KelvinVoigt(1e4, 10.0), 1e-3, direction="y")
    scene = fb.Scene(body, stops=[stop], damping=fb.ModalDamping([0.02, 0.01]), base={"y": fb.Harmonic(1e-2, 40.0)})
    one, other = (each.reduce(modes="all") for each in (file.scene, scene))
    np.testing.assert_array_equal(one.zeta, [0.02, 0.01])
    runs = [model.simulate(0.5, 1e-2) for model in (one, other)]
    assert len(runs[0].contacts) > 2
    np.testing.assert_array_equal(runs[0].displacement("end", "y"), runs[1].displacement("end", "y"))


def test_a_saved_run_carries_its_modes(tmp_path):
    from dataclasses import replace

    file = read(written(tmp_path, FILE))
    run = replace(file.model(modes="all").simulate(0.1, 1e-2), source=file.source)
    path = run.save(tmp_path / "run.npz")
    (tmp_path / "valve.npz").unlink()
    assert read(path).scene.beam.digest == file.scene.beam.digest


def test_what_the_file_lacks_stands_in_the_table(tmp_path):
    text = FILE + '\nlabels = [["tip", "y"], [4, "rx"]]\nnodes = { tip = [0, 0, 1], 4 = [0, 0, 0.5] }'
    body = read(written(tmp_path, text, labels=None)).scene.beam
    assert body.labels == tuple(LABELS)
    np.testing.assert_array_equal(body.position(4), [0.0, 0.0, 0.5])


@pytest.mark.parametrize(("text", "changes", "message"), [
    (FILE, {"omega": None}, "valve.npz, as a whole: expected arrays omega and shapes, got shapes, labels"),
    (FILE, {"labels": None}, "the key 'labels' is missing; modes need omega, shapes and labels, here or in a .npz"),
    (FILE, {"omega": [190.0, 30.0]}, "omega must be (n,), finite, at least 0 and ascending"),
    (FILE, {"shapes": np.eye(3)}, "shapes must be finite and have a row for each dof and 2 columns"),
    (FILE, {"participation_w": [1.0, 2.0]}, "array participation_w: expected omega, shapes, labels, participation_x"),
    (FILE, {"participation_y": [1.0]}, "participation along y must be 2 finite numbers"),
    (FILE + "\nomega = [1.0]", {}, "omega stands here and in valve.npz; keep one"),
    (FILE + '\nstiffness = "K.mtx"', {}, "unknown key 'stiffness'"),
    (FILE.replace("valve", "vlave"), {}, "No such file or directory"),
    ("[structure]\nmodes = 3", {}, "modes must be the path of a .npz, got 3"),
    (FILE + "\nturned = [0, 0, 1]", {}, "modes can neither be turned nor reduced"),
    (INLINE.replace("omega = [30.0, 190.0]", ""), {}, "the key 'omega' is missing"),
    (INLINE.replace("{ y = [1.2, 0.7] }", "[1.2, 0.7]"), {}, "participation must name its directions"),
])  # fmt: skip
def test_refused(tmp_path, text, changes, message):
    with pytest.raises(SceneFileError, match=re.escape(message)):
        read(written(tmp_path, text, **changes))


def test_a_damaged_file_is_refused(tmp_path):
    path = written(tmp_path, FILE)
    content = (tmp_path / "valve.npz").read_bytes()
    (tmp_path / "valve.npz").write_bytes(content[: len(content) // 2])
    with pytest.raises(SceneFileError, match=r"valve.npz, as a whole: expected arrays of numbers in a .npz"):
        read(path)
    np.save(tmp_path / "valve.npy", np.eye(2))
    (tmp_path / "valve.npy").rename(tmp_path / "valve.npz")
    with pytest.raises(SceneFileError, match="expected arrays of numbers in a"):
        read(path)


def test_the_schema_knows_the_three_forms():
    forms = json_schema()["properties"]["structure"]["anyOf"]
    assert [form["required"] for form in forms] == [["stiffness", "mass"], ["modes"], ["omega", "shapes", "labels"]]
