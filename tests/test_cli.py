"""The command line: results, tables, exit codes."""

import json
import os
import re
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import fembeam as fb
import reduction
from fembeam.cli import main
from fembeam.scene_file import read

EXAMPLE = Path(__file__).parent.parent / "examples" / "beam_stop.toml"
FIGURES = ["time_history.png", "psd.png", "densities.png", "contacts.png", "modes.png"]


def scene(tmp_path, *changes, duration="3"):
    text = EXAMPLE.read_text(encoding="utf-8").replace("duration = 600", f"duration = {duration}")
    for old, new in (("discard = 5", "discard = 1"), *changes):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refused(capsys, *arguments):
    """The one line said by a command that exits with 2."""
    assert main([str(a) for a in arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err


def test_run_writes_run_summary_and_figures(tmp_path, capsys):
    out = tmp_path / "results" / "new"
    assert main(["run", str(scene(tmp_path)), "--out", str(out), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert sorted(p.name for p in out.iterdir()) == sorted(["run.npz", "summary.json", *FIGURES])
    for name in FIGURES:
        assert (out / name).read_bytes().startswith(b"\x89PNG")
        assert (out / name).stat().st_size < 200_000
    run, summary = fb.load(out / "run.npz"), json.loads((out / "summary.json").read_text())
    assert summary["complete"]
    assert summary["omega"] == pytest.approx([109.1299120547, 790.6100943811], rel=1e-6)
    contacts = summary["contacts"][0]
    kept = run.contacts.t_in >= 1.0
    assert contacts["number"] == np.count_nonzero(kept & np.isfinite(run.contacts.t_out))
    assert contacts["rate"] == pytest.approx(contacts["number"] / 2.0)
    assert contacts["peak_force"]["max"] == pytest.approx(run.contacts.peak_force[kept].max())
    delta = fb.moments(run.indentation()[run.t >= 1.0])
    assert summary["moments"]["indentation, stop 0"]["skewness"] == pytest.approx(delta.skewness)
    assert summary["energy"]["residual_over_input"] < 1e-5
    assert set(summary["versions"]) >= {"python", "fembeam", "numpy"}


def test_a_scene_without_stop_or_base(tmp_path):
    path = tmp_path / "linear.toml"
    path.write_text(
        "[beam]\nlength = 0.5\nsection = { E = 2e11, rho = 7800, A = 1e-4, I = 1e-9 }\n"
        '[[supports]]\nkind = "clamped"\nz = 0\n[[supports]]\nkind = "clamped"\nz = 0.5\n'
        '[[forces]]\nz = 0.2\nsignal = { kind = "harmonic", amplitude = 1, omega = 100 }\n'
        "[simulate]\nduration = 0.5\ndt = 1e-3\n"
    )
    out = tmp_path / "out"
    assert main(["run", str(path), "--out", str(out), "--quiet"]) == 0
    assert not (out / "contacts.png").exists()
    assert (out / "time_history.png").exists()
    summary = json.loads((out / "summary.json").read_text())
    assert summary["contacts"] == []
    assert list(summary["moments"]) == ["displacement, mid-beam"]


def test_modes_prints_a_table(tmp_path, capsys):
    assert main(["modes", str(EXAMPLE), "--modes", "3"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert rows[0][:3] == ["mode", "rad/s", "Hz"]
    assert [float(row[1]) for row in rows[2:5]] == pytest.approx([109.12991205, 790.61009438, 2303.72983833], rel=1e-6)
    assert [float(row[3]) for row in rows[2:5]] == [0.02, 0.01, 0.01]
    assert float(rows[5][-1]) == pytest.approx(sum(float(row[-1]) for row in rows[2:5]), abs=0.01)
    assert 80 < float(rows[5][-1]) < 100


def test_version(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out.strip() == f"fembeam {fb.__version__}"


def test_bad_input_is_one_line_and_exit_code_two(tmp_path, capsys):
    out = ("--out", tmp_path / "out")
    assert "nothing.toml: cannot be read" in refused(capsys, "run", tmp_path / "nothing.toml", *out)
    path = scene(tmp_path, ("mass = 25.4e-3", "mas = 1"))
    assert "did you mean 'mass'?" in refused(capsys, "run", path, *out)
    path = scene(tmp_path, ("modes = 2", "modes = 50\nelements = 4"))
    assert "[reduce]: modes must be at most 8" in refused(capsys, "run", path, *out)
    assert "[reduce]: modes must be a count above 0" in refused(capsys, "modes", EXAMPLE, "--modes", "0")
    no_study = tmp_path / "no_study.toml"
    no_study.write_text(path.read_text().split("[reduce]")[0])
    assert "needs a study, such as a table [simulate]" in refused(capsys, "run", no_study, *out)
    path = scene(tmp_path, ("std = 2.5e-4", "std = 1e300"))
    assert "out of range" in refused(capsys, "run", path, *out, "--quiet")
    (tmp_path / "file").write_text("")
    path = scene(tmp_path, duration="1e7")
    assert "is not writable" in refused(capsys, "run", path, "--out", tmp_path / "file")


def test_a_record_shorter_than_the_run(tmp_path, capsys):
    (tmp_path / "y.csv").write_text("\n".join(f"{0.01 * i},{1e-6 * (i % 7)}" for i in range(100)))
    head, _, tail = scene(tmp_path).read_text().partition("[base]")
    base = '[base]\nkind = "record"\npath = "y.csv"\nband = [10, 200]\n[reduce]'
    path = tmp_path / "record.toml"
    path.write_text(head + base + tail.partition("[reduce]")[2])
    assert "shorter than the duration" in refused(capsys, "run", path, "--out", tmp_path / "out", "--quiet")


def test_a_free_beam_is_warned_about(tmp_path, capsys):
    path = scene(tmp_path, ('[[supports]]\nkind = "clamped"\nz = 0\n', ""))
    assert main(["modes", str(path)]) == 0
    said = capsys.readouterr()
    assert re.fullmatch(r"fembeam: warning: 2 rigid-body modes appear.*\n", said.err)
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert capsys.readouterr().err.count("\n") == 1


def test_a_failing_method_leaves_what_it_computed(tmp_path, capsys):
    solver = 'solver = { kind = "henon_rk2", dt_flight = 5e-3, dt_contact = 1e-5, force_unstable = true }'
    path = scene(tmp_path, ("discard = 1", solver), duration="20")
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 1
    assert "more energy than it was ever given" in capsys.readouterr().err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert not summary["complete"]
    assert "more energy than it was ever given" in summary["status"]


def test_a_record_that_is_unsorted_or_not_finite(tmp_path, capsys):
    head, _, tail = scene(tmp_path).read_text().partition("[base]")
    path = tmp_path / "record.toml"
    path.write_text(head + '[base]\nkind = "record"\npath = "y.csv"\n[reduce]' + tail.partition("[reduce]")[2])
    for bad, message in (("0.05,0", "must increase strictly"), ("0.5,nan", "must be finite, got nan in row 50")):
        rows = [f"{0.01 * i},{1e-6 * (i % 7)}" for i in range(100)]
        rows[50] = bad
        (tmp_path / "y.csv").write_text("\n".join(rows))
        assert message in refused(capsys, "run", path, "--out", tmp_path / "out")


def test_modes_that_cannot_be_computed_are_bad_input(capsys, monkeypatch):
    def fails(*_, **__):
        raise reduction.AccuracyError("frequencies must settle")

    monkeypatch.setattr(reduction, "modal_basis", fails)
    assert "[reduce]: frequencies must settle" in refused(capsys, "modes", EXAMPLE)


RUN_THAT_TELLS = """
import sys, fembeam.run
from contextlib import contextmanager
from fembeam.cli import main

@contextmanager
def bar(duration, wanted):
    yield lambda t: print("at", t, file=sys.stderr, flush=True)

fembeam.run.bar = bar
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT to another process")
def test_ctrl_c_leaves_what_was_computed(tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-c", RUN_THAT_TELLS, "run", str(scene(tmp_path, duration="600")), "--out", str(out)]
    heard = partial(signal.signal, signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=heard) as process:
        while not process.stderr.readline().startswith("at"):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=120)[1]
    assert process.returncode == 130, said
    assert "interrupted: partial result" in said
    assert "Traceback" not in said
    summary, run = json.loads((out / "summary.json").read_text()), fb.load(out / "run.npz")
    assert not summary["complete"]
    assert "interrupted" in summary["status"]
    assert not run.complete
    assert 0.0 < run.t[-1] < 600.0
    assert summary["simulated_seconds"] == run.t[-1]
    assert (out / "psd.png").exists()


def test_ctrl_c_before_the_run_is_one_line(capsys, monkeypatch):
    def interrupted(path):
        raise KeyboardInterrupt

    monkeypatch.setattr("fembeam.scene_file.read", interrupted)
    assert main(["modes", str(EXAMPLE)]) == 130
    assert capsys.readouterr().err.count("\n") == 1


ENSEMBLE = """
[ensemble]
realisations = 3
duration = 16
dt = 2e-3
solver = { kind = "exponential", rtol = 1e-6, ledger = false }
"""


def ensemble_scene(tmp_path, *changes):
    path = scene(tmp_path)
    text = path.read_text(encoding="utf-8").split("[simulate]")[0] + ENSEMBLE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


def test_an_ensemble_is_written_and_goes_on(tmp_path, capsys):
    path, out = ensemble_scene(tmp_path), tmp_path / "out"
    assert main(["run", str(path), "--out", str(out), "--quiet"]) == 0
    table = capsys.readouterr().out
    assert table.startswith("3 realisations\n")
    assert re.search(r"stop 0 rate +4\d\.\d+ ± \d", table)
    assert sorted(p.name for p in out.iterdir()) == ["ensemble.json", "ensemble.npz", "ensemble.png"]
    found = json.loads((out / "ensemble.json").read_text())
    assert found["numbers"]["δ skewness"]["mean"] < -0.7
    ensemble_scene(tmp_path, ("realisations = 3", "realisations = 4\nworkers = 2"))
    assert main(["run", str(path), "--out", str(out), "--quiet"]) == 0
    assert capsys.readouterr().out.startswith("4 realisations\n")
    ensemble_scene(tmp_path, ("gap = 0.0", "gap = 1e-4"))
    assert "belongs to another study: stops is" in refused(capsys, "run", path, "--out", out)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("realisations = 3", "realisations = 1"), "realisations must be at least 2, got 1"),
        (("realisations = 3\n", ""), "the key 'realisations' is missing"),
        (("dt = 2e-3", "dt = 0"), "dt"),
        (("duration = 16", "durations = 16"), "did you mean 'duration'"),
        (("std = 2.5e-4", "std = 2.5e-4\ncolour = 3"), "unknown key 'colour'"),
    ],
)
def test_a_bad_ensemble(tmp_path, capsys, change, message):
    assert message in refused(capsys, "run", ensemble_scene(tmp_path, change), "--out", tmp_path / "out")


def test_noise_of_a_table_and_rolled_off_in_a_file(tmp_path):
    kinds = {
        "noise_of_psd": "psd = [[0.0, 1226.6], [1e-10, 1e-11]]",
        "rolled_off_noise": "std = 2.5e-4\ncorner = 300.0",
    }
    for kind, keys in kinds.items():
        path = ensemble_scene(tmp_path, ('"band_noise"', f'"{kind}"'), ("std = 2.5e-4", keys))
        base = read(path).scene.base
        assert base.psd_at(1226.6) < 0.2 * base.psd_at(0.0)
