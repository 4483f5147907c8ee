"""The command line: results, tables, exit codes."""

import contextlib
import csv
import io
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import fembeam as fb
import reduction
from fembeam import support
from fembeam.cli import main
from fembeam.results import html_page as html
from fembeam.results.compare import compare
from fembeam.scene import Source
from fembeam.scene_file import built, kinds, read, template

EXAMPLE = Path(__file__).parent.parent / "examples" / "beam_stop.toml"
FIGURES = ["rig.png", "time_history.png", "psd.png", "densities.png", "contacts.png", "modes.png"]


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


def test_run_writes_run_summary_and_figures(tmp_path, capsys, whole_figures):
    out = tmp_path / "results" / "new"
    assert main(["run", str(scene(tmp_path)), "--out", str(out), "--quiet"]) == 0
    said = capsys.readouterr()
    warned = json.loads((out / "summary.json").read_text())["warnings"]
    assert said.err == "".join(f"fembeam: warning: {one}\n" for one in warned)
    assert re.search(r"^stop at 0.24445 m, below +\d+ ", said.out, re.MULTILINE)
    named = ["run.npz", "summary.json", "report.html", "studies.json"]
    assert sorted(p.name for p in out.iterdir()) == sorted([*named, *FIGURES])
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
    assert "with --modes 0: modes must be a count above 0" in refused(capsys, "modes", EXAMPLE, "--modes", "0")
    no_study = tmp_path / "no_study.toml"
    no_study.write_text(path.read_text().split("[reduce]")[0])
    assert "needs a study, such as a table [simulate]" in refused(capsys, "run", no_study, *out)
    path = scene(tmp_path, ("std = 2.5e-4", "std = 1e300"))
    assert "std must be at most 1e+50 in size, got 1e+300" in refused(capsys, "run", path, *out, "--quiet")
    said = refused(capsys, "draw", EXAMPLE, "--out", tmp_path / "none" / "rig.png")
    assert f"fembeam: error: {tmp_path / 'none'}: no such folder to write rig.png to; make it first" in said
    (tmp_path / "file").write_text("")
    path = scene(tmp_path, duration="1e7")
    assert "is not writable" in refused(capsys, "run", path, "--out", tmp_path / "file")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("0.5,0", "shorter than the duration"),
        ("0.05,0", "must increase strictly"),
        ("0.5,nan", "must be finite, got nan in row 50"),
    ],
)
def test_a_record_that_does_not_serve(tmp_path, capsys, row, message):
    rows = [f"{0.01 * i},{1e-6 * (i % 7)}" for i in range(100)]
    rows[50] = row
    (tmp_path / "y.csv").write_text("\n".join(rows))
    head, _, tail = scene(tmp_path).read_text().partition("[base]")
    base = '[base]\nkind = "record"\npath = "y.csv"\nquantity = "acceleration"\nband = [10, 200]\n[reduce]'
    path = tmp_path / "record.toml"
    path.write_text(head + base + tail.partition("[reduce]")[2])
    assert message in refused(capsys, "run", path, "--out", tmp_path / "out", "--quiet")


def test_a_free_beam_is_warned_about(tmp_path, capsys):
    path = scene(tmp_path, ('[[supports]]\nkind = "clamped"\nz = 0\n', ""))
    assert main(["modes", str(path)]) == 0
    said = capsys.readouterr()
    assert re.fullmatch(r"fembeam: warning: 2 rigid-body modes appear.*\n", said.err)
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert capsys.readouterr().err.count("rigid-body modes appear") == 1


def test_a_failing_method_leaves_what_it_computed(tmp_path, capsys):
    solver = 'solver = { kind = "henon_rk2", dt_flight = 5e-3, dt_contact = 1e-5, force_unstable = true }'
    path = scene(tmp_path, ("discard = 1", solver), duration="20")
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 1
    assert "more energy than it was ever given" in capsys.readouterr().err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert not summary["complete"]
    assert "more energy than it was ever given" in summary["status"]


def test_modes_that_cannot_be_computed_are_bad_input(capsys, monkeypatch):
    def fails(*_, **__):
        raise reduction.AccuracyError("frequencies must settle")

    monkeypatch.setattr(reduction, "modal_basis", fails)
    assert "[reduce]: frequencies must settle" in refused(capsys, "modes", EXAMPLE)


def check_partial(out, said):
    """What was computed until a signal came is there, and is marked."""
    assert "interrupted: partial result" in said
    assert "Traceback" not in said
    summary, run = json.loads((out / "summary.json").read_text()), fb.load(out / "run.npz")
    assert not summary["complete"]
    assert "interrupted" in summary["status"]
    assert not run.complete
    assert 0.0 < run.t[-1] < 600.0
    assert summary["simulated_seconds"] == run.t[-1]
    assert (out / "psd.png").exists()


@pytest.mark.skipif(os.name != "posix", reason="processes elsewhere do not end by signals")
def test_the_exit_code_of_a_signal_within_code_that_is_text(tmp_path):
    """As dataclasses run: by itself ``python -m`` then ends by SIGINT, whatever `sys.exit` says."""
    loaded = "import sys, fembeam.support.interrupts\nfrom fembeam.cli.messages import interrupted\n"
    codes = []
    for name, then in (("plain", "pass"), ("known", "interrupted()")):
        text = f"{loaded}try: exec('raise KeyboardInterrupt')\nexcept KeyboardInterrupt: {then}\nsys.exit(143)"
        (tmp_path / f"{name}.py").write_text(text)
        path = os.pathsep.join([str(tmp_path), str(EXAMPLE.parents[1])])
        done = subprocess.run([sys.executable, "-m", name], env={**os.environ, "PYTHONPATH": path}, check=False)
        codes.append(done.returncode)
    assert codes == [-signal.SIGINT, 143]


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_leaves_what_was_computed(tmp_path, capsys, monkeypatch, number, code):
    """Sent as soon as the run tells how far it is."""
    plain, out = support.bar, tmp_path / "out"

    @contextlib.contextmanager
    def bar(duration, wanted):
        with plain(duration, wanted) as report:
            yield lambda t: (wanted and signal.raise_signal(number), report(t))  # not in the trial before

    monkeypatch.setattr("fembeam.model.model.bar", bar)
    heard = signal.signal(signal.SIGINT, signal.default_int_handler)  # background jobs ignore it
    before = signal.getsignal(number)
    try:
        assert main(["run", str(scene(tmp_path, duration="600")), "--out", str(out)]) == code
        assert signal.getsignal(number) is before
    finally:
        signal.signal(signal.SIGINT, heard)
    check_partial(out, capsys.readouterr().err)


def test_ctrl_c_before_the_run_is_one_line(capsys, monkeypatch):
    def interrupted(*_):
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
    assert re.search(r"stop 0 rate / 1/s +4\d(\.\d+)? ± \d", table)
    suffixes = "csv", "json", "npz", "png", "txt"
    named = [*(f"ensemble.{kind}" for kind in suffixes), "report.html", "rig.png", "studies.json"]
    assert sorted(p.name for p in out.iterdir()) == named
    found = json.loads((out / "ensemble.json").read_text())
    assert found["numbers"]["δ skewness"]["mean"] < -0.7
    ensemble_scene(tmp_path, ("realisations = 3", "realisations = 4\nworkers = 2"))
    assert "--resume to continue" in refused(capsys, "run", path, "--out", out)
    assert printed(capsys, "run", path, "--out", out, "--quiet", "--resume").startswith("4 realisations\n")
    before = (out / "ensemble.npz").stat().st_mtime_ns
    assert printed(capsys, "run", path, "--out", out, "--quiet", "--resume").startswith("4 realisations\n")
    assert (out / "ensemble.npz").stat().st_mtime_ns == before
    ensemble_scene(tmp_path, ("gap = 0.0", "gap = 1e-4"))
    said = said_on_failure(capsys, 2, "run", path, "--out", out, "--resume")
    assert "belongs to another study: stops[0].gap is 0.0 there and 0.0001 here; set it back" in said
    said = refused(capsys, "run", path, "--out", out)
    assert "of another scene: stops[0].gap is 0.0 there and 0.0001 here; set it back and add --resume" in said


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("realisations = 3", "realisations = 1"), "realisations must be at least 2, got 1"),
        (("dt = 2e-3", "dt = 0"), "dt"),
    ],
)
def test_a_bad_ensemble(tmp_path, capsys, change, message):
    assert message in refused(capsys, "run", ensemble_scene(tmp_path, change), "--out", tmp_path / "out")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("duration = 16", "duration = 0.5"), "scene.toml:42: [ensemble]: duration must be at least"),
        (("duration = 16", "duration = 0.05"), "[ensemble]: dt must leave at least 64 samples"),
        (("duration = 16", "duration = 0.5\ndiscard = 0.1"), ""),
    ],
)
def test_an_ensemble_that_is_too_short_is_refused_by_check_too(tmp_path, capsys, change, message):
    """Every realisation was tried, and the run failed with 1."""
    path = ensemble_scene(tmp_path, change)
    if not message:
        assert printed(capsys, "check", path)
        return
    assert message in refused(capsys, "check", path)
    assert message in said_on_failure(capsys, 2, "run", path, "--out", tmp_path / "out", "--quiet")


def test_counts_beyond_the_modes_are_refused_before_a_run(tmp_path, capsys):
    """The counts before them were computed first."""
    path = shaken(tmp_path, "[mode_count]\ncounts = [1, 400]\nquantity = 'peak_force'\n")
    assert "[mode_count]: modes must be at most 300, got 400" in refused(capsys, "check", path)
    few = "--set", "mode_count.counts=[1, 99]", "--set", "reduce.elements=20"
    assert "counts=[1, 99]: modes must be at most 40 (free dofs), got 99" in refused(capsys, "check", path, *few)


def printed(capsys, *arguments):
    """What a command prints that succeeds."""
    assert main([str(a) for a in arguments]) == 0
    return capsys.readouterr().out


STUDIES = """
[orbit]
[branch]
span = [194.0, 196.0]
step = 0.5
[mode_count]
counts = [1, 2]
quantity = "peak_force"
duration = 0.2
"""


def shaken(tmp_path, studies=STUDIES):
    """A scene under harmonic motion with several studies."""
    path = scene(tmp_path)
    text = re.sub(r"\[base\](?:.|\n)*?(?=\n\[)", '[base]\nkind = "harmonic"\namplitude = 1e-3\nomega = 195.0\n',
                  path.read_text(encoding="utf-8"))  # fmt: skip
    path.write_text(text + studies, encoding="utf-8")
    return path


def test_the_page_of_kept_studies_still_warns(tmp_path, capsys):
    path, out = shaken(tmp_path, "[orbit]\n"), tmp_path / "out"
    path.write_text(re.sub(r"\[simulate\](?:.|\n)*?(?=\n\[)", "", path.read_text(encoding="utf-8")), encoding="utf-8")
    for more in ([], ["--resume"]):
        printed(capsys, "run", path, "--out", out, "--quiet", *more)
        assert "excite modes above the 2 kept" in (out / "report.html").read_text(encoding="utf-8")


def test_every_study_is_run_and_kept(tmp_path, capsys):
    path, out = shaken(tmp_path), tmp_path / "out"
    found = json.loads(printed(capsys, "run", path, "--out", out, "--quiet", "--json"))
    assert list(found) == ["simulate", "orbit", "branch", "mode_count"]
    assert found["orbit"]["stable"]
    omega = [row["base.omega"] for row in found["branch"]["orbits"]]
    assert (omega[0], omega[-1]) == pytest.approx((194.0, 196.0))
    text = (out / "report.html").read_text(encoding="utf-8")
    Page(text)
    assert all(f"<h2>{title}" in text for title in ("Orbit", "Branch", "Mode count", "Contacts"))
    written = {p: p.stat().st_mtime_ns for p in out.iterdir() if p.name not in ("report.html", "rig.png")}
    assert main(["run", str(path), "--out", str(out), "--resume", "--json"]) == 0
    said = capsys.readouterr()
    assert said.err.count("is done already; its results are kept") == 4
    assert json.loads(said.out) == found | {"simulate": json.loads((out / "summary.json").read_text())}
    assert {p: p.stat().st_mtime_ns for p in written} == written
    assert (out / "report.html").read_text(encoding="utf-8") == text
    again = "run", path, "--out", out, "--resume", "--quiet"
    printed(capsys, *again, "--set", "mode_count.counts=[1, 3]")
    changed = [p.name for p in written if p.stat().st_mtime_ns != written[p]]
    assert sorted(changed) == [*(f"mode_count.{kind}" for kind in ("csv", "json", "npz", "png", "txt")), "studies.json"]
    other = "--set", "mode_count.counts=[1, 3]", "--set", "branch.span=[150.0, 200.0]"
    said = said_on_failure(capsys, 2, *again, *other)
    assert "belongs to another branch: span[0] is 194.0 there and 150.0 here; span[1] is 196.0 there" in said
    said = said_on_failure(capsys, 2, *again, "--set", "base.amplitude=2e-4")
    assert re.search(r"belongs to another scene: base\.amplitude is 0\.\d+ there and 0\.0002 here; set it back", said)
    (out / "studies.json").write_text("{")
    assert "studies.json is damaged" in said_on_failure(capsys, 2, *again)


def said_on_failure(capsys, code, *arguments):
    """What a command says on stderr that exits with that code."""
    assert main([str(a) for a in arguments]) == code
    return capsys.readouterr().err


def test_a_study_that_fails_does_not_stop_the_others(tmp_path, capsys):
    plane = "x_span = [0.0, 1e-3]\ny_span = [0.0, 0.1]\npoints = [2, 2]\nx = 99\ny = 0\n"
    counts = '[mode_count]\ncounts = [1]\nquantity = "peak_force"\nduration = 0.1\n'
    path, out = shaken(tmp_path, f"[basins]\n{plane}{counts}"), tmp_path / "out"
    said = said_on_failure(capsys, 2, "run", path, "--out", out, "--quiet")
    line = path.read_text(encoding="utf-8").splitlines().index("[basins]") + 1
    assert f"scene.toml:{line}: [basins]: the number of a state must lie in" in said
    text = (out / "report.html").read_text(encoding="utf-8")
    assert "Mode count" in text
    assert "Contacts" in text
    assert "Basins" not in text
    recorded = json.loads((out / "studies.json").read_text())
    assert {name for name, one in recorded.items() if one["files"]} == {"simulate", "mode_count"}


def test_a_report_shows_one_scene_only(tmp_path, capsys):
    out = tmp_path / "out"
    printed(capsys, "run", shaken(tmp_path, "[orbit]\n"), "--out", out, "--quiet")
    printed(capsys, "run", scene(tmp_path), "--out", out, "--quiet")
    assert (out / "orbit.png").exists()
    assert "Orbit" not in (out / "report.html").read_text(encoding="utf-8")


def test_help_tells_exit_codes(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    said = capsys.readouterr().out
    assert all(re.search(rf"\b{code}\b", said) for code in (0, 1, 2, 130, 143))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_stdout_is_an_error(capsys, monkeypatch):
    full = open("/dev/full", "w")  # noqa: SIM115 (to close it says again that it is full)
    monkeypatch.setattr(sys, "stdout", full)
    assert main(["modes", str(EXAMPLE)]) == 1
    assert re.fullmatch(r"fembeam: error: .*No space left.*\n", capsys.readouterr().err)
    with contextlib.suppress(OSError):
        full.close()


def test_the_new_scene_is_checked_and_runs(tmp_path, capsys):
    path, out = tmp_path / "new.toml", tmp_path / "out"
    printed(capsys, "new", path)
    assert "exists: give another name, or delete it" in refused(capsys, "new", path)
    assert f"there is no folder {tmp_path / 'none'} for x.toml; make it first" in refused(
        capsys, "new", tmp_path / "none" / "x.toml"
    )
    found = json.loads(printed(capsys, "check", path, "--json"))
    omega = [row["omega"] for row in found["modes"]][:3]
    assert omega == pytest.approx([106.945812, 813.508628, 2384.149653], rel=1e-6)
    stop = found["stops"][0]
    strike = read(path).scene.reduce(modes=9).strike(stop["speed"])
    assert stop["time"] == pytest.approx(float(strike.t_out[0] - strike.t_in[0]))
    assert found["correlation_time"] == pytest.approx(1 / (0.02 * 106.945812), rel=1e-6)
    assert found["warnings"] == []
    found = json.loads(printed(capsys, "run", path, "--out", out, "--json", "--quiet", "--set", "simulate.duration=3"))
    assert found["simulate"]["simulated_seconds"] == 3.0
    assert found["simulate"] == json.loads((out / "summary.json").read_text())


def test_a_run_warns_as_check_does_and_once(tmp_path, capsys):
    path, out = tmp_path / "new.toml", tmp_path / "out"
    printed(capsys, "new", path)
    path.write_text(path.read_text() + "[floor_spectra]\nplaces = [0.13]\nduration = 0.5\ndt = 1e-3\nomega = [100.0]\n")
    changes = [
        word for one in ("beam.section.E=2.1e5", "reduce.modes=3", "simulate.duration=3") for word in ("--set", one)
    ]
    found = json.loads(printed(capsys, "check", path, "--json", *changes))["warnings"]
    assert len(found) >= 2
    main(["run", str(path), "--out", str(out), "--quiet", *changes])
    said = capsys.readouterr().err
    assert [said.count(f"fembeam: warning: {one}\n") for one in found] == [1] * len(found)
    assert json.loads((out / "summary.json").read_text())["warnings"] == found


@pytest.mark.parametrize("number", range(6))
def test_every_example_in_the_new_scene_is_right(tmp_path, number):
    blocks = re.findall(r"^# \[(?:.|\n)*?(?=\n\n|\n*\Z)", template(), re.MULTILINE)
    assert len(blocks) == 6
    text = template().replace(blocks[number], re.sub(r"^# ", "", blocks[number], flags=re.MULTILINE))
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    read(path).scene.reduce(modes=3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--set", "stops.0.gap=abc"), "with --set stops.0.gap=abc: [[stops]] number 1: gap must be a number"),
        (("--set", "beam.section.E=-1"), "with --set beam.section.E=-1: [beam] section: E must be finite"),
        (("--set", "masses[0].z=9"), "with --set masses[0].z=9: the scene: z must lie on the beam"),
        (("--set", "stopps.0.gap=1"), "with --set stopps.0.gap=1: the file: unknown table 'stopps'"),
        (("--set", "reduce.modes=500"), "with --set reduce.modes=500: [reduce]: modes must be at most 300"),
        (("--modes", "-3"), "with --modes -3: modes must be a count above 0"),
        (("--modes", "400"), "with --modes 400: modes must be at most 300"),
    ],
)
def test_an_option_is_blamed_for_its_value_and_no_line_of_the_file(capsys, options, message):
    assert f"beam_stop.toml {message}" in refused(capsys, "check", EXAMPLE, *options)


def test_a_line_is_blamed_beside_the_option_that_does_not_agree_with_it(capsys):
    said = refused(capsys, "check", EXAMPLE, "--set", "beam.length=0.2")
    assert re.search(r"beam_stop\.toml:\d+: the scene with --set beam\.length=0\.2: z must lie on the beam", said)


def test_a_stop_that_is_too_soft(capsys):
    found = json.loads(printed(capsys, "check", EXAMPLE, "--json", "--set", "stops[0].law.stiffness=1"))
    assert any("so soft that a contact lasts half the lowest period" in one for one in found["warnings"])


def test_a_run_repeats_from_its_file_alone(tmp_path, capsys):
    (tmp_path / "in").mkdir()
    t = np.arange(0.0, 3.0, 0.01)
    np.savetxt(tmp_path / "in" / "y.csv", np.column_stack((t, 1e-3 * np.sin(20 * t))), delimiter=",")
    base = '[base]\nkind = "record"\npath = "y.csv"\nquantity = "displacement"\nband = [10, 200]\n[reduce]'
    head, _, tail = scene(tmp_path / "in", duration="2").read_text().partition("[base]")
    path = tmp_path / "in" / "scene.toml"
    path.write_text(head + base + tail.partition("[reduce]")[2])
    options = "--set", "simulate.duration=1.5"
    printed(capsys, "run", path, "--out", tmp_path / "a", "--quiet", *options)
    for used in (path, tmp_path / "in" / "y.csv"):
        used.unlink()
    printed(capsys, "run", tmp_path / "a" / "run.npz", "--out", tmp_path / "b", "--quiet")
    first, second = (fb.load(tmp_path / name / "run.npz") for name in "ab")
    assert np.array_equal(first.q, second.q)
    assert first.t[-1] == pytest.approx(1.5)
    assert second.scene_file.reduce == {"modes": 2}
    assert first.versions["numpy"] == np.__version__
    assert re.search(r"^(\d+) of \1 numbers are equal", printed(capsys, "compare", tmp_path / "a", tmp_path / "b"))
    other = printed(
        capsys, "run", tmp_path / "a" / "run.npz", "--out", tmp_path / "c", "--set", "stops[0].gap=1e-3", "--json"
    )
    assert other
    rows = json.loads(printed(capsys, "compare", tmp_path / "a", tmp_path / "c", "--json"))
    unlike = next(row for row in rows if row["name"] == "summary contacts 0 number")
    assert unlike["difference"] == (unlike["b"] - unlike["a"]) / unlike["a"] != 0
    printed(capsys, "compare", tmp_path / "a", tmp_path / "c", "--out", tmp_path / "figures")
    assert (tmp_path / "figures" / "compare.png").read_bytes().startswith(b"\x89PNG")


def test_results_are_compared_in_standard_errors_of_their_own(tmp_path):
    """Values of modes stood in units of the uncertainty of their relative error, those of [vary] had none."""
    for name, factor in (("a", 1.0), ("b", 1.5)):
        found = {
            "mode_count": {"rows": [{"value": 1e-8 * factor, "error": 0.2 * factor, "uncertainty": 0.05}]},
            "vary": {"values": [[3.0 * factor]], "standard_error": [[0.3]]},
            "minimise": {"value": 2.0 * factor, "standard_error": 0.4},
        }
        (tmp_path / name).mkdir()
        for file, content in found.items():
            (tmp_path / name / f"{file}.json").write_text(json.dumps(content))
    rows = {row.name: row for row in compare(tmp_path / "a", tmp_path / "b")}
    plain = {f"mode_count rows 0 {key}" for key in ("value", "error", "uncertainty")}
    assert {*rows} == {"vary values 0 0", "minimise value", *plain}
    assert all(rows[name].deviations is None for name in plain)
    assert rows["vary values 0 0"].deviations == pytest.approx(1.5 / (0.3 * math.sqrt(2.0)))
    assert rows["minimise value"].deviations == pytest.approx(1.0 / (0.4 * math.sqrt(2.0)))


def test_branches_are_compared_at_equal_parameters(tmp_path, capsys):
    """Peaks of 2 omega on one grid and on another, where orbits of equal number differ by 10 % and more."""

    def written(name, grid, fold=()):
        orbits = [{"omega": w, "peak": 2.0 * w, "impacts": 1 + (w > 4.0), "residual": 1e-9 * w} for w in (*grid, *fold)]
        (tmp_path / name).mkdir()
        (tmp_path / name / "branch.json").write_text(json.dumps({"orbits": orbits, "status": "done"}))
        return tmp_path / name

    a, b = written("a", [1.0, 2.0, 3.5, 5.0]), written("b", [5.5, 4.5, 2.5, 1.2])
    rows = {row.name: row for row in compare(a, b)}
    assert all(row.a == pytest.approx(row.b) for row in rows.values() if None not in (row.a, row.b))
    assert {name for name, row in rows.items() if row.b is None} == {
        "branch at omega = 1 peak", "branch at omega = 1 impacts", "branch at omega = 3.5 impacts"}  # fmt: skip
    assert "the second interpolated linearly" in printed(capsys, "compare", a, b)
    folded = written("c", [1.0, 3.0], [2.0, 4.0])
    assert [(row.name, row.a, row.b) for row in compare(a, folded)] == [("branch folds along omega", 0, 2)]
    assert all(row.difference == 0.0 for row in compare(folded, folded))


def test_a_run_reads_no_file_outside_its_folder_unless_asked(tmp_path, capsys):
    def named(path, *overrides):
        text = head + f'[base]\nkind = "record"\npath = "{path}"\nquantity = "displacement"\n' + rest
        np.savez(
            kept / "run.npz", **arrays, about=json.dumps({**about, "scene_file": {**about["scene_file"], "text": text}})
        )
        return read(kept / "run.npz", overrides).scene.base.duration

    kept = tmp_path / "kept"
    kept.mkdir()
    printed(capsys, "run", scene(tmp_path, duration="0.1"), "--out", kept, "--quiet", "--set", "simulate.discard=0")
    with np.load(kept / "run.npz") as data:
        about = json.loads(str(data["about"]))
        arrays = {name: data[name] for name in data.files if name != "about"}
    head, _, tail = about["scene_file"]["text"].partition("[base]")
    rest = tail[tail.index("[reduce]") :]
    for folder, count in ((tmp_path, 20), (kept, 30)):
        (folder / "y.csv").write_text("\n".join(f"{0.01 * i},0" for i in range(count)))
    (kept / "link.csv").symlink_to(tmp_path / "y.csv")
    for path in (tmp_path / "y.csv", "../y.csv", "link.csv"):
        with pytest.raises(ValueError, match=r"\[base\]: names .*y.csv|names link.csv, which this run does not carry"):
            named(path)
    assert named("y.csv") == pytest.approx(0.29)
    assert named("y.csv", f'base.path="{tmp_path / "y.csv"}"') == pytest.approx(0.19)
    assert named(tmp_path / "y.csv", "base.path=y.csv") == pytest.approx(0.29)


def said(encoding, *arguments):
    """What a command writes to streams of an encoding."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding) for _ in range(2)]
    with (
        contextlib.redirect_stdout(streams[0]),
        contextlib.redirect_stderr(streams[1]),
        contextlib.suppress(SystemExit),
    ):
        assert main([str(argument) for argument in arguments]) == 0
    for stream in streams:
        stream.flush()
    return [stream.buffer.getvalue().decode(encoding) for stream in streams]


@pytest.mark.parametrize(
    ("encoding", "root"), [("ascii", "sqrt kg"), ("latin-1", "sqrt kg"), ("cp437", "√kg"), ("utf-8", "√kg")]
)
def test_any_terminal_can_show_what_is_said(encoding, root):
    table, rest = said(encoding, "modes", EXAMPLE)
    assert f" {root} " in table
    assert "?" not in table + rest
    assert "usage" in said(encoding, "--help")[0]


def test_a_terminal_without_greek_letters_shows_a_check():
    table, warnings = said("ascii", "check", EXAMPLE, "--set", "base.band=[0, 1e5]")
    assert "1/min(zetaomega)" in table
    assert "3pi over the contact time" in table
    assert "?" not in table + warnings
    assert "loads reach 100000 rad/s" in warnings
    assert json.loads(said("ascii", "modes", EXAMPLE, "--json")[0])


def test_what_cannot_be_compared_or_repeated(tmp_path, capsys):
    assert "holds no results" in refused(capsys, "compare", tmp_path, tmp_path)
    (tmp_path / "summary.json").write_text("{")
    assert "is damaged" in refused(capsys, "compare", tmp_path, tmp_path)
    fb.Scene(read(EXAMPLE).scene.beam, [fb.Clamped(0.0)]).reduce(2).simulate(0.1, 0.01).save(tmp_path / "python.npz")
    assert "holds no scene file" in refused(capsys, "run", tmp_path / "python.npz", "--out", tmp_path)
    (tmp_path / "cut.npz").write_bytes((tmp_path / "python.npz").read_bytes()[:500])
    assert "damaged" in refused(capsys, "modes", tmp_path / "cut.npz")
    with pytest.raises(ValueError, match="made in Python"):
        _ = fb.load(tmp_path / "python.npz").scene_file


def test_a_run_as_csv(tmp_path, capsys):
    printed(capsys, "run", scene(tmp_path), "--out", tmp_path, "--quiet")
    printed(capsys, "export", tmp_path / "run.npz", "--out", tmp_path / "csv", "--stride", "10")
    run = fb.load(tmp_path / "run.npz")
    head = (tmp_path / "csv" / "histories.csv").read_text().splitlines()[0].split(",")
    rows = np.loadtxt(tmp_path / "csv" / "histories.csv", delimiter=",", skiprows=1)
    assert rows[:, head.index("force stop 0 [N]")] == pytest.approx(run.force()[::10], rel=1e-11)
    assert rows[:, head.index("displacement tip [m]")] == pytest.approx(run.displacement(0.2599)[::10], rel=1e-11)
    with (tmp_path / "csv" / "contacts.csv").open(newline="", encoding="utf-8") as file:
        log = list(csv.DictReader(file))
    assert [float(row["t_in [s]"]) for row in log] == pytest.approx(run.contacts.t_in, rel=1e-11)
    assert {row["name"] for row in log} == {"stop at 0.24445 m, below"}


class Page(HTMLParser):
    """Checks that what is opened is closed, and remembers it."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.sources = [], [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.sources += [value for name, value in attributes if name in ("src", "href")]
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_report_is_one_page_that_needs_nothing_else(tmp_path, capsys):
    path = scene(tmp_path, ("a Teflon half-sphere", "<b>a Teflon</i> & half-sphere"))
    printed(capsys, "run", path, "--out", tmp_path / "out", "--quiet", "--set", "simulate.discard=2.5")
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.tags.count("img") == len(FIGURES)
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert 'name="viewport"' in text
    assert "&lt;b&gt;a Teflon&lt;/i&gt; &amp;" in text
    assert "# --set simulate.discard=2.5" in text
    assert "of the input" in text


CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
         "--disable-background-networking", "--disable-component-update", "--dump-dom")  # fmt: skip
LOOK = """<script>
const wide = [...document.body.children].filter(e => e.getBoundingClientRect().right > innerWidth).length
const broken = [...document.images].filter(e => !e.naturalWidth).length
const asked = performance.getEntriesByType("resource").filter(e => !e.name.startsWith("data:")).length
document.title = [innerWidth, document.documentElement.scrollWidth, wide, broken, asked].join(" ")
</script>"""


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")
def test_the_report_fits_the_screen_of_a_browser(tmp_path, report_page):
    text, widths = report_page.read_text(encoding="utf-8"), (390, 1200)
    # in frames, because a window cannot be as narrow as a phone
    (tmp_path / "page.html").write_text(text.replace("</body>", f"{LOOK}</body>"), encoding="utf-8")
    frame = '<iframe src="page.html" width="{}" height="3000" style="border:0"></iframe>'
    body = '<body style="margin:0">' + "".join(map(frame.format, widths))
    tell = "<script>onload = () => { document.title = [0, 1].map(i => frames[i].document.title).join(' ') }</script>"
    (tmp_path / "frame.html").write_text(f"<!DOCTYPE html><title></title>{body}{tell}", encoding="utf-8")
    command = [CHROMIUM, *FLAGS, "--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}",
               (tmp_path / "frame.html").as_uri()]  # fmt: skip
    seen = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    found = list(map(int, re.search(r"<title>([\d ]+)</title>", seen)[1].split()))
    assert len(found) == 10
    for width in widths:
        (inner, scrolled, *faults), found = found[:5], found[5:]
        assert inner == width
        assert scrolled <= width
        assert faults == [0, 0, 0]  # boxes too wide, pictures broken, requests


@pytest.fixture(scope="module")
def report_page(tmp_path_factory):
    """A report with long names, a warning, tables of two stops, an ensemble's text."""
    folder = tmp_path_factory.mktemp("report")
    path = folder / "a_scene_with_a_rather_long_name_that_needs_more_than_one_line_on_a_phone.toml"
    text = EXAMPLE.read_text(encoding="utf-8").replace("duration = 600", "duration = 2").replace("discard = 5", "")
    stop = '[[stops]]\nz = 0.2\ngap = 1e-3\nside = "above"\nlaw = { kind = "hertz", stiffness = 1e8 }\n'
    path.write_text(text + stop, encoding="utf-8")
    assert main(["run", str(path), "--out", str(folder / "out"), "--quiet"]) == 0
    (folder / "out" / "ensemble.txt").write_text(f"{'x' * 200}\n", encoding="utf-8")
    return html.write_page(folder / "out", read(path).source, ["E" * 100 + " looks like N/mm²"])


def test_a_shell_completes_commands_options_and_files(capsys, tmp_path):
    pytest.importorskip("shtab", reason="the extra completion is not installed")
    bash = shutil.which("bash") or pytest.skip("there is no bash")
    script = tmp_path / "fembeam.bash"
    script.write_text(printed(capsys, "completion", "bash"), encoding="utf-8")
    (tmp_path / "scene.toml").touch()
    for line, expected in {
        "ru": "run",
        "run --res": "--resume",
        "check sc": "scene.toml",
        "completion z": "zsh",
    }.items():
        words = ["fembeam", *line.split()]
        asked = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; COMPREPLY=(); _shtab_fembeam"
        asked = f"source {script}; {asked} fembeam {words[-1]}; echo ${{COMPREPLY[@]}}"
        found = subprocess.run([bash, "-c", asked], capture_output=True, text=True, check=True, cwd=tmp_path)
        assert found.stdout.split() == [expected], (line, found)
    assert "#compdef fembeam" in printed(capsys, "completion", "zsh")


def test_an_optional_package_that_is_missing_is_named_in_a_line(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["completion", "bash"]) == 2
    assert "shell completion needs shtab, which is optional: pip install shtab" in capsys.readouterr().err


def test_the_schema_knows_what_the_reader_knows(capsys):
    schema = json.loads(printed(capsys, "schema"))
    valid = re.search(r"valid: (.*)\)", refused_text(EXAMPLE.read_text(encoding="utf-8") + "\n[nothing]\n"))[1]
    assert sorted(schema["properties"]) == sorted(valid.split(", "))
    laws = next(d["anyOf"] for name, d in schema["$defs"].items() if name == f"kind such as {next(iter(kinds.LAWS))}")
    assert [law["properties"]["kind"]["const"] for law in laws] == list(kinds.LAWS)
    masses = schema["properties"]["masses"]["items"]["anyOf"][0]  # a lumped mass; the other is a disk
    assert masses["required"] == ["z", "mass"]
    assert masses["properties"]["mass"] == {"type": "number"}
    assert check_against(schema, tomllib.loads(EXAMPLE.read_text(encoding="utf-8")), schema) is None
    assert check_against(schema, tomllib.loads(template()), schema) is None
    for old, new in (("mass =", "mas ="), ('"clamped"', '"clampd"'), ("= 600", '= "600"'), ("length =", "# ")):
        changed = tomllib.loads(EXAMPLE.read_text(encoding="utf-8").replace(old, new))
        assert check_against(schema, changed, schema), new


def refused_text(text):
    """The message about a file that is wrong."""
    with pytest.raises(ValueError) as caught:
        built(Source(Path("scene.toml"), text))
    return str(caught.value)


def check_against(schema, value, whole):
    """A small validator of the parts of JSON Schema that are used; the first fault in words, or None."""
    if "$ref" in schema:
        schema = whole["$defs"][schema["$ref"].removeprefix("#/$defs/").replace("%20", " ")]
    if "anyOf" in schema:
        faults = [check_against(option, value, whole) for option in schema["anyOf"]]
        return None if None in faults else f"{value}: {faults}"
    if value not in schema.get("enum", [value]) or schema.get("const", value) != value:
        return f"{value} is not {schema}"
    types = {"number": (int, float), "integer": int, "string": str, "boolean": bool, "array": list, "object": dict}
    if "type" in schema and not isinstance(value, types[schema["type"]]):
        return f"{value} is no {schema['type']}"
    if isinstance(value, list):
        return next((fault for entry in value if (fault := check_against(schema["items"], entry, whole))), None)
    if not isinstance(value, dict):
        return None
    if missing := set(schema.get("required", ())) - set(value):
        return f"{missing} missing"
    others = schema.get("additionalProperties", {}) or None
    pairs = ((key, schema.get("properties", {}).get(key, others)) for key in value)
    return next(
        (f"{k}: {fault}" for k, s in pairs if (fault := "unknown" if s is None else check_against(s, value[k], whole))),
        None,
    )


def test_noise_of_a_table_and_rolled_off_in_a_file(tmp_path):
    kinds = {
        "noise_of_psd": "psd = [[0.0, 1226.6], [1e-10, 1e-11]]",
        "rolled_off_noise": "std = 2.5e-4\ncorner = 300.0",
    }
    for kind, keys in kinds.items():
        path = ensemble_scene(tmp_path, ('"band_noise"', f'"{kind}"'), ("std = 2.5e-4", keys))
        base = read(path).scene.base
        assert base.psd_at(1226.6) < 0.2 * base.psd_at(0.0)
