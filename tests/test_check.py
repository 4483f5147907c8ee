"""What a scene is told before it is run: `Scene.check`, and `fembeam check`, which prints it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused_by

import fembeam as fb
from contacts import Hertz, KelvinVoigt
from fembeam.cli import main
from fembeam.inspection import check
from fembeam.inspection.sampling import of_run
from fembeam.inspection.units import doubts
from fembeam.scene_file import read

EXAMPLE = Path(__file__).parent.parent / "examples" / "beam_stop.toml"
STEEL = fb.Section.rectangle(E=2.1e11, rho=7800.0, width=0.02, height=0.002)


def cantilever(**parts):
    return fb.Scene(fb.Beam(0.26, STEEL), [fb.Clamped(0.0)], **{"damping": fb.ModalDamping(0.02), **parts})


def doubts_of_example(*overrides):
    file = read(EXAMPLE, overrides)
    model, study = file.model(), file.studies["simulate"]
    return [*doubts(model), *of_run(model, study.duration, study.dt, study.discard)]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("beam.section.E=1.9e5", "looks like N/mm²"),
        ("beam.section.rho=8", "looks like g/cm³"),
        ("beam.section.rho=8e4", "heavier than osmium"),
        ("beam.section.E=1.9e13", "stiffer than diamond"),
        ("beam.section.A=58.3", "is one of them in mm²"),
        ("damping.zeta=[2.0]", "looks like per cent"),
        ("masses[0].mass=25.4e3", "is it in grams"),
        ("stops[0].gap=10.0", "is it in mm"),
        ("base.std=25", "is it in mm"),
        ("base.band=[0, 1e5]", "loads reach 100000 rad/s"),
        ("base={kind = 'harmonic', amplitude = 1e-3, omega = 17.37}", "looks like Hz"),
        ("simulate.dt=0.1", "spectra are folded"),
        ("simulate.discard=0.0", "keeps the transient"),
    ],
)
def test_doubtful_numbers(override, message):
    assert not any(message in one for one in doubts_of_example())
    assert any(message in one for one in doubts_of_example(override))


def test_a_transient_is_kept_in_whole():
    sweep = "base={kind = 'sine_sweep', amplitude = 1e-3, omega0 = 60.0, omega1 = 300.0, duration = 600.0}"
    assert not any("keeps the transient" in one for one in doubts_of_example(sweep, "simulate.discard=0.0"))


def test_a_good_scene_has_no_sentences():
    found = cantilever(base=fb.Harmonic(1e-3, 120.0)).check(duration=20.0, dt=1e-3, discard=5.0)
    assert list(found) == []
    assert len(found) == 0
    assert found  # it is there all the same
    assert "warning" not in str(found)


def test_what_is_printed_are_tables_and_sentences():
    found = cantilever(stops=[fb.Stop(0.26, Hertz(1e8), gap=0.5)], base=fb.Harmonic(1e-3, 120.0)).check(modes=3)
    (gap, *rest) = found
    assert gap == "stops[0]: a gap of 0.5 m on a beam of 0.26 m: is it in mm?"
    text = str(found)
    assert [line.removeprefix("warning: ") for line in text.splitlines() if line.startswith("warning: ")] == [
        gap,
        *rest,
    ]
    for part in ("rad/s", "mesh: ", "suggested output step dt", "correlation time"):
        assert part in text
    assert f"<p>warning: {gap}</p>" in found._repr_html_()


def test_the_command_prints_what_the_method_finds(capsys):
    """The same tables on stdout, the same sentences as warnings on stderr, the same numbers as JSON."""
    options = ["--set", "damping.zeta=[2.0]", "--set", "simulate.duration=0.05", "--set", "simulate.discard=0.0"]
    options += ["--set", "reduce.elements=4", "--set", "reduce.modes=3"]
    file = read(EXAMPLE, options[1::2])
    study = file.studies["simulate"]
    found = file.scene.check(study.duration, study.dt, study.discard, **file.reduce)
    assert all(word in str(found) for word in ("coarse", "per cent", "is it long enough"))
    assert main(["check", str(EXAMPLE), *options]) == 0
    said = capsys.readouterr()
    head, _, _ = str(found).partition("\nwarning: ")
    assert said.out == f"{head}\n"
    assert said.err == "".join(f"fembeam: warning: {one}\n" for one in found)
    assert main(["check", str(EXAMPLE), "--json", *options]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["warnings"] == list(found)
    assert printed["suggested_modes"] == found.modes


def test_contacts_to_expect_scale_with_the_law():
    """Hertz, strike of a mode: F ~ k^(2/5) v^(6/5) and T ~ k^(-2/5) v^(-1/5) of a mass alone; a beam stays near it."""
    soft, stiff = (cantilever(stops=[fb.Stop(0.26, Hertz(k))]).check(modes=1).touched[0] for k in (1e7, 1e9))
    assert soft.speed == stiff.speed == 0.1
    assert stiff.peak_force / soft.peak_force == pytest.approx(100**0.4, rel=0.05)
    assert soft.time / stiff.time == pytest.approx(100**0.4, rel=0.05)


def test_contacts_of_impactors_and_of_further_bodies_are_expected_too():
    """A mass strikes the tip, a second beam its own stop; of mode and mass μ = 1/(1/m + φ²), T = π √(μ/k)."""
    beam, k, mass = fb.Beam(1.0, fb.Section.rectangle(2.1e11, 7850.0, width=0.05, height=0.02)), 1e9, 0.1
    stop = fb.Stop(1.0, KelvinVoigt(1e6, 10.0), gap=1e-4, name="guard")
    other = fb.Scene(beam, [fb.Clamped(0.0)], stops=[stop])
    ball = fb.Impactor(1.0, mass, velocity=-1.0, law=KelvinVoigt(k, 0.0), gap=0.01, name="ball")
    scene = fb.Scene(beam, [fb.Clamped(0.0)], bodies=[other], impactors=[ball], base=fb.Harmonic(1e-3, 70.0))
    found = scene.check(modes=1)
    assert [found.model.contact_rows[one.stop].name for one in found.touched] == ["ball", "guard"]
    falls, guard = found.touched
    together = 1.0 / (1.0 / mass + found.model.phi(1.0)[0] ** 2)
    assert falls.time == pytest.approx(np.pi * np.sqrt(together / k), rel=1e-3)
    assert falls.peak_force == pytest.approx(falls.speed * np.sqrt(together * k), rel=1e-3)
    assert guard.contacts > 0
    assert "ball: " in str(found)


def test_suggested_modes_are_those_of_every_body():
    """A second beam beside the first, which changes nothing of it: as many modes of each are enough."""
    beam, stop = fb.Beam(1.0, fb.Section.rectangle(2.1e11, 7850.0, width=0.05, height=0.02)), Hertz(1e8)
    alone = fb.Scene(beam, [fb.Clamped(0.0)], stops=[fb.Stop(1.0, stop, gap=1e-4)], base=fb.Harmonic(1e-3, 700.0))
    two = replace(alone, bodies=[fb.Scene(beam, [fb.Clamped(0.0)])])
    one, both = (scene.check(modes=2).modes for scene in (alone, two))
    assert next(iter(one.values())) == 3  # 105, 658 rad/s, and 1842, the first beyond 1.5 * 700
    assert both == one


def test_a_body_without_damping_beside_a_damped_one_is_told():
    beam = fb.Beam(1.0, fb.Section.rectangle(2.1e11, 7850.0, width=0.05, height=0.02))
    damped, bare = (fb.Scene(beam, [fb.Clamped(0.0)], damping=fb.ModalDamping(zeta)) for zeta in (0.02, 0.0))
    for own, other, told in ((damped, bare, True), (damped, damped, False), (bare, bare, False)):
        said = list(replace(own, bodies=[other]).check(modes=2))
        assert any(one.startswith("bodies[0]: nothing damps it") for one in said) is told


def test_a_record_in_ms_is_told():
    t = 0.01 * np.arange(200)
    for unit, few in ((1e3, True), (1.0, False)):
        drive = fb.Record(unit * t, np.sin(20.0 * t), quantity="acceleration", detrend=True, interpolation="linear")
        said = list(cantilever(base=drive).check(duration=1.5, dt=1e-3, modes=2))
        record = "base: a run of 1.5 s sees 1 of 200 samples of the record, which lasts 1990 s: is its time in ms?"
        assert (record in said) is few


def test_a_preload_is_not_told_to_be_soft():
    """It is in contact for long because it begins there."""
    drive = fb.Harmonic(1e-5, 50.0)
    for gap in (-1e-3, 1e-6):
        said = cantilever(stops=[fb.Stop(0.26, KelvinVoigt(200.0, 1.0), gap=gap)], base=drive).check(modes=1)
        assert not any("so soft" in one for one in said)
        assert "a contact outlasts" in str(said) or gap > 0.0


def test_doubts_of_other_bodies_say_which():
    body = fb.Scene(fb.Beam(0.3, fb.Section.circle(E=2.1e5, rho=7800.0, diameter=0.01)), [fb.Clamped(0.0)])
    said = list(cantilever(bodies=[body], stops=[fb.Stop(0.26, Hertz(1e8), gap=1e-3, on=(1, 0.3))]).check())
    assert "bodies[0]: E = 210000 N/m² looks like N/mm²: steel has 2.1e11 N/m²" in said


def test_what_scene_and_model_warn_of_is_among_the_sentences(recwarn):
    """Said once: when they are made, and by the check."""
    with pytest.warns(UserWarning, match="rigid-body") as warned:
        scene = fb.Scene(fb.Beam(0.26, STEEL), forces=[fb.PointForce(0.1, fb.Harmonic(1.0, 50.0))])
    recwarn.clear()
    found = list(scene.check(modes=4, elements=3))
    assert found[0] == str(warned[0].message)
    assert "elements are too coarse for the highest mode" in found[1]
    assert not recwarn.list
    assert not any("coarse" in one for one in scene.check(modes=4))


def test_a_run_is_as_long_as_it_says():
    """Three periods of the lowest mode are enough, a rounding less is not; rigid motion has no period."""
    model = cantilever().reduce(2)
    period = 2 * np.pi / model.omega[0]
    assert not list(of_run(model, 3.001 * period, None, 0.0))
    assert ["periods of the lowest mode" in one for one in of_run(model, 2.999 * period, None, 0.0)] == [True]
    free = fb.Scene(fb.Beam(0.26, STEEL)).reduce(2)
    assert not list(of_run(free, 1e-6, None, 0.0))


test_what_is_refused = refused_by(
    lambda arguments: cantilever().check(**arguments),
    ({"duration": -1.0}, "duration must be finite and positive, got -1.0 in Scene.check"),
    ({"dt": "1"}, "dt must be a number, got '1' in Scene.check"),
    ({"discard": float("nan")}, "discard must be finite and not negative, got nan in Scene.check"),
    ({"modes": 0}, "modes"),
)


def test_a_beam_a_thousand_times_too_long_is_checked_at_once():
    """Its trial lasted twenty periods of its lowest mode, 36 million of the load."""
    scene = cantilever(stops=[fb.Stop(0.25, Hertz(1e8))], base=fb.Harmonic(1e-3, 195.0))
    found = replace(scene, beam=fb.Beam(260.0, STEEL)).check(modes=2)
    assert 0 < found.touched[0].contacts < 4000


def test_checking_changes_nothing():
    scene = cantilever(stops=[fb.Stop(0.26, Hertz(1e8))])
    before = repr(scene)
    assert str(scene.check()) == str(check(scene.reduce()))
    assert repr(scene) == before


def test_a_command_warns_once_however_often_it_reduces_the_scene(tmp_path, capsys):
    text = """
    [frame.nodes]
    A = [0, 0, 0]
    B = [0, 0, 1]
    [[frame.members]]
    nodes = ["A", "B"]
    section = { shape = "circle", E = 2.1e11, rho = 7800, diameter = 0.02 }
    [[supports]]
    kind = "clamped"
    at = "A"
    [damping]
    zeta = [0.02]
    [base.x]
    kind = "harmonic"
    amplitude = 1e-3
    omega = 25.0
    [reduce]
    modes = 3
    [simulate]
    duration = 1.0
    dt = 1e-3
    [orbit]
    """
    (tmp_path / "scene.toml").write_text(text)
    assert main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert capsys.readouterr().err.count("3 modes cut a pair of one frequency") == 1
