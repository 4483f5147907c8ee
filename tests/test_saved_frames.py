"""Section forces of frames from the file of a run, alone, joined and on moving supports; what a file cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from frames import PORTAL, portal

import fembeam as fb

WAVE = fb.Harmonic(1e-3, 30.0)


def scenes():
    """A portal with a preload, a release and a moving foot; a post with a superelement joined to it."""
    first, girder, last = portal().members
    members = [replace(first, axial_force=-500.0), replace(girder, release="end rz", up=(-1.0, 1.0)), last]
    alone = fb.Scene(fb.Frame(PORTAL, members), [fb.Clamped("A"), fb.Clamped("D", motion={"x": WAVE})])
    post = fb.Frame({"A": (0, 0, 0), "B": (0, 0, 1)}, [fb.Member("A", "B", first.section)])
    arm = fb.Frame({"B": (0, 0, 1), "C": (0, 0.5, 1)}, [fb.Member("B", "C", first.section)])
    bodies = [fb.Scene(arm), fb.Scene(arm.reduced(["B", "C"], 2))]
    joints = [fb.Joint("B", to=(1, "B")), fb.Joint("B", to=(2, "B"))]
    return alone, fb.Scene(post, [fb.Clamped("A")], base={"x": WAVE}, bodies=bodies, joints=joints)


@pytest.mark.parametrize(("which", "place", "kind"), [
    (0, ("B-C", 1.7), "npz"), (0, ("A-B", 0.0), "h5"), (1, ("A-B", 0.5), "npz"), (1, (1, ("B-C", 0.2)), "npz"),
    (1, ("B-C", 0.2), "npz"),
])  # fmt: skip
def test_as_before(tmp_path, which, place, kind):
    """All section forces, stress, extremes of all nodes; preload included."""
    run = scenes()[which].reduce(2).simulate(0.02, 2e-3)
    run.save(tmp_path / f"run.{kind}")
    read = fb.load(tmp_path / f"run.{kind}")
    known, found = run.section_forces(place), read.section_forces(place)
    assert list(known) == list(found)
    assert all(np.array_equal(known[name], found[name]) for name in known)
    assert any(np.ptp(values) > 0 for values in known.values())
    assert np.array_equal(run.stress([place]), read.stress([place]))
    assert run.extremes("M").largest == read.extremes("M").largest
    assert np.array_equal(run.reactions()[0]["x"], read.reactions()[0]["x"])


def test_places_that_do_not_exist(tmp_path):
    """The nearest, of a file too; a superelement has no sections."""
    run = scenes()[1].reduce(2).simulate(0.02, 2e-3)
    run.save(tmp_path / "run.npz")
    for one in (run, fb.load(tmp_path / "run.npz")):
        with pytest.raises(ValueError, match="is the nearest"):
            one.section_forces(("A-Q", 0.1))
        with pytest.raises(ValueError, match=r"body must be one of 0, 1|is on a structure"):
            one.section_forces((2, "C"))


def test_contradictions(tmp_path):
    """Arrays of another number of elements are refused."""
    scenes()[0].reduce(2).simulate(0.02, 2e-3).save(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as data:
        arrays = dict(data)
    np.savez(tmp_path / "other.npz", **{**arrays, "members_0_0": arrays["members_0_0"][:, :, 1:]})
    with pytest.raises(ValueError, match=r"section forces must be of .* elements"):
        fb.load(tmp_path / "other.npz")


def test_names_of_numbered_nodes():
    """Reactions tell a node from a coordinate."""
    body = fb.Structure(1e4 * np.array([[2.0, -1.0], [-1.0, 2.0]]), np.eye(2), labels=[(1, "x"), (2, "x")])
    run = fb.Scene(body, [fb.Fixed(1)], springs=[fb.Spring(2, 1e3, direction="x")], base={"x": WAVE}).reduce(1)
    assert [one.name for one in run.simulate(0.1, 0.05).reactions()] == ["Fixed at node 1", "Spring at node 2"]
