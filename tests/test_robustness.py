"""What must hold of any scene, and what happens when files, disks, laws or scales are extreme."""

import importlib.util
import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt, law
from fembeam.cli import main
from fembeam.scene import Source
from fembeam.scene_file import built
from fembeam.support import written_whole

HOME = Path(__file__).parent.parent
EXAMPLE = HOME / "examples" / "beam_stop.toml"
SIDES = {"below": "above", "above": "below"}

sections = st.builds(
    lambda E, rho, height, ratio: fb.Section.rectangle(E, rho, ratio * height, height),
    st.floats(1e9, 4e11), st.floats(500, 2e4), st.floats(1e-3, 1e-2), st.floats(1, 10),
)  # fmt: skip
laws = st.one_of(
    st.builds(Hertz, st.floats(1e5, 1e9)),
    st.builds(Hysteretic.achieving, st.floats(1e5, 1e9), st.floats(0.3, 1.0)),
    st.builds(KelvinVoigt, st.floats(1e3, 1e6), st.floats(0.0, 10.0)),
)


@st.composite
def scenes(draw):
    """A held beam that meets one or two stops, driven hard enough to reach them."""
    length = draw(st.floats(0.2, 1.0))
    place = st.floats(0.3, 1.0).map(lambda s: s * length)
    supports = draw(
        st.sampled_from([[fb.Clamped(0.0)], [fb.Pinned(0.0), fb.Pinned(length)], [fb.Clamped(0.0), fb.Guided(length)]])
    )
    stops = [fb.Stop(0.6 * length, draw(laws), draw(st.floats(-1e-5, 1e-3)), draw(st.sampled_from(["below", "above"])))]
    if draw(st.booleans()):
        stops.append(fb.Stop(0.8 * length, draw(laws), draw(st.floats(0.0, 1e-3)), "below"))
    masses = [fb.LumpedMass(draw(place), draw(st.floats(1e-3, 0.1)))] if draw(st.booleans()) else []
    drive = fb.Harmonic(amplitude=draw(st.floats(1e-4, 2e-3)), omega=draw(st.floats(10.0, 500.0)))
    damping = fb.ModalDamping(draw(st.floats(0.001, 0.1)))
    return fb.Scene(fb.Beam(length, draw(sections)), supports, masses, stops=stops, damping=damping, base=drive)


def mirrored(scene):
    """The same seen upside down: u becomes -u."""
    stops = [fb.Stop(s.z, s.law, s.gap, SIDES[s.side]) for s in scene.stops]
    drive = fb.Harmonic(amplitude=-np.array(scene.base.amplitude), omega=scene.base.omega)
    return fb.Scene(scene.beam, scene.supports, scene.masses, stops=stops, damping=scene.damping, base=drive)


@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(scene=scenes(), modes=st.integers(1, 4))
def test_random_scenes_keep_energy_and_symmetry(scene, modes):
    model = scene.reduce(modes)
    assert np.all(np.diff(model.omega) > 0)
    assert np.sum(model.effective_mass) <= model.moving_mass * (1 + 1e-9)
    duration = 6 * 2 * np.pi / float(model.omega[0])
    run = model.simulate(duration, duration / 100)
    ledger = run.energy
    exchanged = np.abs(ledger.input).max() + np.abs(ledger.contact).max() + np.abs(ledger.stored).max()
    assert np.abs(ledger.residual).max() <= 3e-4 * exchanged  # its quadrature, whatever rtol, under a fast drive
    assert np.all(np.diff(ledger.damping) >= -1e-9 * exchanged)
    other = mirrored(scene).reduce(modes).simulate(duration, duration / 100)
    z, scale = 0.6 * scene.beam.length, np.abs(run.displacement(scene.beam.length / 2)).max()
    early = run.t <= _first_exits(run, 3)  # later chaos may tell rounding apart
    assert other.displacement(z)[early] == pytest.approx(-run.displacement(z)[early], abs=1e-5 * scale)


def _first_exits(run, count):
    """Time of the count-th end of a contact."""
    ends = np.sort(run.contacts.t_out[np.isfinite(run.contacts.t_out)])
    return ends[count - 1] if len(ends) >= count else np.inf


def scaled(factor):
    """The paper's scene, every length times a factor, the material kept: time then scales alike, speeds stay."""
    k = factor
    return fb.Scene(
        beam=fb.Beam(0.2599 * k, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6 * k**2, I=18.5e-12 * k**4)),
        supports=[fb.Clamped(0.0)],
        masses=[fb.LumpedMass(0.24445 * k, mass=25.4e-3 * k**3, inertia=3.0e-6 * k**5)],
        stops=[fb.Stop(0.24445 * k, law=Hysteretic.lankarani_nikravesh(2.1e8 * k**0.5, restitution=0.5))],
        damping=fb.ModalDamping([0.02, 0.01]),
        base=fb.Harmonic(amplitude=1e-3 * k, omega=195.0 / k),
    )


@pytest.mark.parametrize("factor", [1e-6, 1e3])
def test_a_micro_beam_and_a_ship_move_alike(factor):
    runs = [scaled(k).reduce(2).simulate(0.3 * k, 1e-3 * k) for k in (1.0, factor)]
    one, other = (run.displacement(0.2599 * k) / k for run, k in zip(runs, (1.0, factor), strict=True))
    assert len(runs[0].contacts) == len(runs[1].contacts) > 5
    assert other == pytest.approx(one, abs=1e-5 * np.abs(one).max())
    assert runs[1].contacts.speed_in == pytest.approx(runs[0].contacts.speed_in, rel=1e-4)
    forces = runs[1].contacts.peak_force / factor**2
    assert forces == pytest.approx(runs[0].contacts.peak_force, rel=1e-4)


@pytest.mark.parametrize("factor", [1e-4])
def test_the_command_line_takes_any_scale(tmp_path, capsys, factor):
    k = factor
    (tmp_path / "s.toml").write_text(f"""
[beam]
length = {0.26 * k}
section = {{ shape = "rectangle", E = 1.6e11, rho = 2330, width = {0.02 * k}, height = {0.004 * k} }}
[[supports]]
kind = "clamped"
z = 0
[[stops]]
z = {0.26 * k}
law = {{ kind = "achieving", stiffness = {2e8 * k**0.5}, restitution = 0.8 }}
[damping]
zeta = 0.02
[base]
kind = "band_noise"
std = {5e-4 * k}
band = [{100 / k}, {2000 / k}]
seed = 1
[reduce]
modes = 2
[simulate]
duration = {1 * k}
dt = {5e-4 * k}
""")
    assert main(["check", str(tmp_path / "s.toml")]) == 0
    assert "no contact" not in capsys.readouterr().out
    assert main(["run", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    run = fb.load(tmp_path / "out" / "run.npz")
    assert len(run.contacts) > 10


def fuzz():
    """The bench of mutated files."""
    spec = importlib.util.spec_from_file_location("fuzz", HOME / "tests" / "bench" / "fuzz.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.skipif(not hasattr(__import__("signal"), "SIGPROF"), reason="uses an alarm to notice a hang")
def test_mutated_scene_files_are_refused_or_run():
    bench = fuzz()
    texts = bench.seeds()
    for seed in range(40):
        what, trace = bench.tried(bench.mutated(np.random.default_rng(seed), texts))
        assert not trace, f"seed {seed}: {what}\n{trace}"


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.text(max_size=200))
def test_any_text_is_refused_in_words(text):
    with pytest.raises(ValueError, match=r"scene\.toml"):
        built(Source(Path("scene.toml"), text))


@pytest.mark.skipif(os.name != "posix", reason="limits the size of files")
@pytest.mark.parametrize("room", [1000, 100_000])
def test_a_full_disk_leaves_whole_files_only(tmp_path, capsys, room):
    import resource

    out, before = tmp_path / "out", resource.getrlimit(resource.RLIMIT_FSIZE)
    command = ["run", str(EXAMPLE), "--out", str(out), "--set", "simulate.duration=3", "--set", "simulate.discard=1"]
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))  # Python ignores the signal and raises an OSError
    try:
        code = main([*command, "--quiet"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert code == 1
    said = capsys.readouterr().err
    assert "results cannot be written" in said
    assert re.search(r"out.\w+\.\w+: File too large", said)  # which file
    assert not [path for path in out.iterdir() if path.name.startswith(".")]
    assert all(path.stat().st_size < room for path in out.iterdir())


@pytest.mark.parametrize("interrupted", [True, False], ids=["while it is written", "when it is put in place"])
def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path, monkeypatch, interrupted):
    target = tmp_path / "run.npz"

    def full(*_):
        raise OSError(28, "No space left on device")

    def write(content, fails=False):
        with written_whole(target) as file:
            file.write(content)
            if fails:
                raise KeyboardInterrupt

    write(b"old")
    if not interrupted:
        monkeypatch.setattr(os, "replace", full)
    with pytest.raises(KeyboardInterrupt if interrupted else OSError):
        write(b"new", interrupted)
    assert target.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["run.npz"]


@law
def not_a_number(delta, delta_dot, entry_rate, stiffness):
    """NaN in a thin layer that looking at a few depths does not meet."""
    return stiffness * delta if delta < 2e-6 else np.nan if delta < 5e-5 else stiffness * delta


@law
def too_large(delta, delta_dot, entry_rate, stiffness):
    """Overflow in the same layer."""
    return stiffness * delta * (np.exp(1e9 * delta) if 2e-6 < delta < 5e-5 else 1.0)


@law
def raises(delta, delta_dot, entry_rate, stiffness):
    """An exception in the same layer."""
    if 2e-6 < delta < 5e-5:
        raise ValueError("deeper than expected")
    return stiffness * delta


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # what `raises` says
@pytest.mark.parametrize("bad", [not_a_number, too_large, raises])
@pytest.mark.parametrize("method", [solvers.Exponential(1e-8), solvers.DormandPrince(1e-8), solvers.RK4(1e-5)])
def test_a_law_that_is_not_finite_stops_the_run(bad, method):
    scene = scaled(1.0)
    scene = fb.Scene(
        scene.beam, scene.supports, scene.masses, stops=[fb.Stop(0.24445, bad(stiffness=1e5), 1e-4)], base=scene.base
    )
    with np.errstate(all="ignore"), pytest.raises(solvers.SolverError, match=r"not finite|stopped at") as caught:
        scene.reduce(2).simulate(0.5, 1e-3, solver=method)
    solution = caught.value.solution
    assert len(solution.t)
    assert np.isfinite(solution.q).all()
    assert re.search(r"t = [\d.]+", str(caught.value))


def test_motion_that_overflows_stops_the_run():
    with np.errstate(all="ignore"), pytest.raises(solvers.SolverError, match="not finite any more"):
        scaled(1.0).reduce(2).simulate(0.5, start=[1e306, 0.0, 0.0, 0.0])
