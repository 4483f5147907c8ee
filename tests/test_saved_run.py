"""A run read from its file gives what the run gave: fields, reactions, spectra, ParaView; npz and HDF5."""

import json
import sys
import zipfile
from functools import partial
from importlib.util import find_spec

import numpy as np
import pytest
from problems import STEEL, cubic

import fembeam as fb
from contacts import Hertz, Jenkins
from fembeam import scene_file
from fembeam.results.files import summary

SQUARE = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.01)
THIN = fb.Section.rectangle(2.1e11, 7850.0, 0.01, 0.005)
L = 0.4
HDF5 = pytest.param(".h5", marks=pytest.mark.skipif(not find_spec("h5py"), reason="the extra hdf5 is not installed"))


def rig(**more):
    """Almost everything a scene can hold, with a law and a foot that no file can keep."""
    tapered = fb.Beam.of_spans([(0.1, SQUARE), (L - 0.1, fb.Taper(SQUARE, THIN))], 1e3, 500.0)
    other = fb.Scene(fb.Beam(0.3, SQUARE), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.01))
    return fb.Scene(
        tapered,
        [fb.Clamped(0.0), fb.Pinned(0.12)],
        masses=[fb.LumpedMass(L, mass=25.4e-3, inertia=3.0e-6)],
        springs=[fb.Spring(0.2, 300.0, rotational=0.05, foot=fb.Harmonic(1e-3, 90.0)), fb.Spring(0.3, 10.0)],
        stops=[fb.Stop(L, cubic(stiffness=1e13), gap=1e-4), fb.Stop(0.3, Hertz(1e8), 1e-4, "above", on=(1, 0.3))],
        forces=[fb.PointForce(0.23, fb.Harmonic(2.0, 300.0)), fb.PointMoment(0.12, fb.Harmonic(0.1, 200.0))],
        damping=fb.ModalDamping(0.02),
        base=fb.Harmonic(1e-3, 195.0),
        bodies=[other],
        gravity=9.81,
        **more,
    )


DASHPOTS = {"dashpots": [fb.Dashpot(0.22, 0.3, rotational=1e-4)]}
IMPACTORS = {"impactors": [fb.Impactor(L, 0.1, -1.0, Hertz(1e9), gap=2e-3)]}


@pytest.fixture(scope="module", params=[DASHPOTS, IMPACTORS], ids=["dashpot", "impactor"])
def run(request):
    made = rig(**request.param).reduce(3).simulate(0.05, 1e-3)
    assert len(made.contacts) > 3
    return made


def readings(run):
    """All that is read off a run."""
    found = {}
    for name in ("displacement", "velocity", "acceleration"):
        for absolute in (False, True):
            found[f"{name} {absolute}"] = getattr(run, name)([0.1, 0.33], absolute=absolute)
        found[f"{name} of the other"] = getattr(run, name)(0.2, body=1)
    for name in ("slope", "moment", "shear", "stress"):
        found[name], found[f"{name} of the other"] = getattr(run, name)([0.0, 0.05, 0.31]), getattr(run, name)(0.2, 1)
    for one in run.reactions():
        found |= {f"force of {one.name}": one.force, f"moment of {one.name}": one.moment}
    for stop in range(len(run.stops)):
        found |= {f"force {stop}": run.force(stop), f"indentation {stop}": run.indentation(stop)}
        found[f"mean force {stop}"] = run.force(stop, mean=True)
    for i in range(len(run.impactor_masses)):
        found["impactor"] = run.impactor_displacement(i)
    found |= {"loss": run.losses.loss, "work": run.losses.history, "slip": run.losses.slip, "end": run.end}
    found["extremes"] = run.extremes("stress").highest
    with pytest.warns(UserWarning, match="not resolved"):
        found["floor"] = run.floor_spectrum(0.33, [50.0, 300.0]).acceleration
    return found


@pytest.mark.parametrize(
    ("run", "suffix"),
    [
        pytest.param(DASHPOTS, ".npz", id="dashpot"),
        pytest.param(IMPACTORS, *HDF5.values, marks=HDF5.marks, id="impactor"),
    ],
    indirect=["run"],
)
def test_all_is_read_from_the_file(run, tmp_path, suffix):
    path = run.save(tmp_path / f"run{suffix}")
    assert [entry.name for entry in tmp_path.iterdir()] == [f"run{suffix}"]
    twice = fb.load(fb.load(path).save(tmp_path / f"twice{suffix}"))
    live, again = readings(run), readings(twice)
    assert live.keys() == again.keys()
    for name, values in live.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)
    assert repr(twice.reactions()) == repr(run.reactions())
    assert str(twice) == str(run)
    for kind in ("to_xdmf", "to_vtu"):
        files = [getattr(each, kind)(tmp_path / name).read_bytes() for each, name in ((run, "a"), (twice, "b"))]
        assert files[0] == files[1]


def test_nothing_of_elements_times_samples_is_stored(run, tmp_path):
    """A sample adds t, q, q̇, contact forces, their means and work, loads, y and ẏ, four energies."""
    model = run.model
    sizes = []
    for count in (1000, 2000):
        with np.load(model.simulate(0.05, 0.05 / count).save(tmp_path / "run.npz")) as data:
            arrays = {name: data[name].size for name in data.files if not name.startswith(("contact_", "about"))}
        sizes.append(arrays)
    more = sum(sizes[1].values()) - sum(sizes[0].values())
    n, stops, loads, frame, energies = len(model.omega), len(run.stops), 5, 2, 4
    assert more == 1000 * (1 + 2 * n + 3 * stops + loads + frame + energies)


@pytest.fixture(scope="module")
def rubbing():
    """A run with a friction damper and a stop."""
    damper = fb.Element(L, Jenkins(2e4, 0.05))
    scene = fb.Scene(fb.Beam(L, SQUARE), [fb.Clamped(0.0)], elements=[damper], damping=fb.ModalDamping(0.01),
                     stops=[fb.Stop(L, Hertz(1e8), 1e-4)], base=fb.Harmonic(1e-4, 300.0))  # fmt: skip
    return scene.reduce(2).simulate(0.1, 1e-3)


@pytest.mark.parametrize("suffix", [".npz", HDF5])
def test_stick_and_slip_are_read_from_a_file(rubbing, tmp_path, suffix):
    found, log, model = fb.load(rubbing.save(tmp_path / f"run{suffix}")), rubbing.transitions, rubbing.model
    read, numbers = found.transitions, summary(found)
    assert found.model is None
    assert {"stick", "slip"} <= set(log.event)
    assert (list(read.event), repr(read)) == (list(log.event), repr(log))
    for name in ("t", "work", "contact", "border"):
        np.testing.assert_array_equal(getattr(read, name), getattr(log, name))
    np.testing.assert_array_equal(read.slid(), log.slid())
    for i in (0, 1):
        np.testing.assert_array_equal(found.force(i, mean=True), rubbing.force(i, mean=True))
    assert (numbers["omega"], numbers["zeta"]) == (pytest.approx(model.omega, rel=1e-14), model.zeta.tolist())
    assert numbers["omega"] == summary(rubbing)["omega"]
    assert read.contact.dtype == log.contact.dtype


def test_a_run_without_memory_or_samples_keeps_empty_ones(run, tmp_path):
    again = fb.load(run.save(tmp_path / "run"))
    assert len(again.transitions) == 0
    bare = fb.load(run.model.simulate(0.01).save(tmp_path / "bare"))
    with pytest.raises(ValueError, match="the mean force needs samples"):
        bare.force(mean=True)


def test_a_beam_on_two_supports_without_anything_else(tmp_path):
    run = fb.Scene(fb.Beam(1.0, STEEL), [fb.Pinned(0.0), fb.Pinned(1.0)], gravity=9.81).reduce(2).simulate(0.01, 1e-3)
    again = fb.load(run.save(tmp_path / "run"))
    np.testing.assert_array_equal(again.reactions().force, run.reactions().force)
    np.testing.assert_array_equal(again.acceleration(0.5, absolute=True), run.acceleration(0.5))
    with pytest.raises(ValueError, match="every section must know its outer fibre"):
        again.stress(0.5)


def test_what_is_no_saved_run_is_refused(run, tmp_path):
    (tmp_path / "table.csv").write_text("t,a\n0,0\n")
    with pytest.raises(ValueError, match=r"it is neither npz nor HDF5; give a file of Run\.save"):
        fb.load(tmp_path / "table.csv")
    with pytest.raises(FileNotFoundError, match=r"no such folder to write run.npz to; make it first: .*nowhere"):
        run.save(tmp_path / "nowhere" / "run")


def changed(path, change):
    """A saved run with its arrays and words changed."""
    with np.load(path) as data:
        arrays = {name: data[name] for name in data.files}
    about = json.loads(str(arrays["about"]))
    change(about, arrays)
    np.savez(path, **arrays | {"about": json.dumps(about)})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda about, arrays: arrays.update(loads=arrays["loads"][:, 1:]), "loads must have shape"),
        (lambda about, arrays: arrays.update(reactions=arrays["reactions"][..., 1:]), "reactions must have shape"),
        (lambda about, arrays: arrays.update(moments_1=arrays["moments_1"] * np.nan), "moments_1 must be finite"),
        (lambda about, arrays: about["readout"]["parts"][0].update(kind="System"), "'System'"),
        (lambda about, arrays: about["names"].pop(), "contacts need as many names"),
        (lambda about, arrays: about["readout"]["beams"].pop(), "bodies"),
        (lambda about, arrays: about["readout"].update(base=17), "base"),
        (lambda about, arrays: about["readout"]["parts"].pop(), "parts"),
        (lambda about, arrays: arrays.update(mean_force=arrays["mean_force"][:, 1:]), "mean_force must have shape"),
        (lambda about, arrays: arrays.update(zeta=arrays["zeta"] * np.nan), "zeta must be finite"),
        (lambda about, arrays: arrays.update(transitions=np.full((1, 9), 7.0)), "transitions must name contacts"),
        (lambda about, arrays: arrays.update(transitions=np.full((1, 9), 1.0)), "index 1 is out of bounds"),
        (lambda about, arrays: arrays.update(transitions=np.ones((1, 8))), "transitions must have shape"),
        (lambda about, arrays: arrays.pop("energy_damping"), "it has lost energy_damping"),
    ],
)
def test_contradictions_are_refused(run, tmp_path, change, message):
    path = run.save(tmp_path / "run.npz")
    changed(path, change)
    with pytest.raises(ValueError, match=rf"is not a saved run, or is damaged.*{message}"):
        fb.load(path)


def test_only_what_a_run_is_made_of_is_read(run, tmp_path):
    """A small file whose further members unpacked to gigabytes took these, and shapes were looked at afterwards."""
    path = run.save(tmp_path / "run.npz")
    others = {"bomb": np.array([{}]), "contact": np.zeros(3), "moments_77": np.zeros(2), "file_0": np.zeros(2)}
    changed(path, lambda about, arrays: arrays.update(others))  # the first cannot be read at all
    np.testing.assert_array_equal(fb.load(path).q, run.q)
    with np.load(path, allow_pickle=True) as data:
        arrays = {name: data[name] for name in data.files if name != "q_dot"}
    np.savez(path, **arrays)
    with zipfile.ZipFile(path, "a") as archive, archive.open("q_dot.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"shape": (10**11, 2), "fortran_order": False, "descr": "<f8"})
    with pytest.raises(ValueError, match=r"q_dot must have shape \(\d+, \d+\), it has \(100000000000, 2\)"):
        fb.load(path)


@pytest.mark.parametrize("suffix", [".npz", HDF5])
def test_a_byte_that_changed_is_seen(run, tmp_path, suffix):
    """HDF5 has no checksum by itself: one sample of q had changed, and nothing was said."""
    path = run.save(tmp_path / f"run{suffix}")
    content, sample = bytearray(path.read_bytes()), run.q[len(run.q) // 2].tobytes()
    content[content.index(sample) + 5] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match="is damaged"):
        fb.load(path)


def test_units_that_a_run_has(run):
    """Another name ended in a KeyError."""
    assert run.unit("force", 0) == "N"
    with pytest.raises(ValueError, match=r"quantity must be one of indentation, speed, .*, got 'displacement' in Run"):
        run.unit("displacement")


def test_hdf5_is_optional(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(ImportError, match="a run in HDF5 needs h5py, which is optional: pip install h5py"):
        run.save(tmp_path / "run.h5")
    with pytest.raises(ImportError, match="XDMF with HDF5 data needs h5py"):
        run.to_xdmf(tmp_path / "run", hdf5=True)
    assert not list(tmp_path.iterdir())
    (tmp_path / "given.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(ImportError, match="needs h5py"):
        fb.load(tmp_path / "given.h5")


def test_quantities_of_a_run_are_those_of_its_file(tmp_path):
    """All that need no Python object, the mean energy too, which asked for the model."""
    from fembeam.study.quantities import QUANTITIES, Psd

    noise = fb.BandNoise(1e-4, (0.0, 400.0), seed=1)
    stop = fb.Stop(0.25, Hertz(1e7), gap=1e-4)
    scene = fb.Scene(fb.Beam(0.25, STEEL), [fb.Clamped(0.0)], stops=[stop], damping=fb.ModalDamping(0.02), base=noise)
    run = scene.reduce(modes=2).simulate(2.0, dt=2e-4)
    back = fb.load(run.save(tmp_path / "run.npz"))
    for name, kind in QUANTITIES.items():
        if name != "wear_power":
            quantity = Psd((10.0, 1000.0), 4) if name == "psd" else kind()
            np.testing.assert_allclose(quantity(back), quantity(run), rtol=1e-14, err_msg=name)
    bare = scene.reduce(modes=2).simulate(0.1)
    with pytest.raises(ValueError, match="the run must have samples, got 1 in Psd; give a dt below the duration"):
        Psd()(bare)


def test_a_folder_is_no_saved_run(tmp_path):
    with pytest.raises(ValueError, match=r"is a folder: give the file of a run in it, .*run\.npz"):
        fb.load(tmp_path)


@pytest.mark.parametrize("path", [None, 3, b"run.npz", "", ["run.npz"]])
def test_what_is_no_path_is_refused_by_name(path, tmp_path):
    run = fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)]).reduce(1).simulate(0.1, 0.05)
    for call, where in (
        (fb.load, "load"),
        (run.save, "Run.save"),
        (run.to_csv, "Run.to_csv"),
        (run.to_xdmf, "Run.to_xdmf"),
        (run.to_vtu, "Run.to_vtu"),
        (partial(fb.plot.animate, run), "animate"),
        (fb.Record.from_csv, "Record.from_csv"),
        (scene_file.read, "scene_file.read"),
    ):
        with pytest.raises(ValueError, match=rf"path must be text or a pathlib.Path, got .* in {where}; write e.g."):
            call(path)
