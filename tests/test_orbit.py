"""Orbits, attractors and branches of a model; the parameters of a scene by name; the table [branch]."""

import io
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from differences import end_of
from problems import TIP, paper_scene
from tqdm import tqdm

import fembeam as fb
import solvers
from contacts import Hysteretic, PiecewiseLinear, law
from fembeam.cli import commands as cli
from fembeam.model import extremes_of
from fembeam.model.equations import common_period
from fembeam.scene import parameters
from solvers.orbits import delayed


@pytest.fixture(scope="module")
def model():
    return paper_scene().reduce(1)


def test_orbit_is_what_a_long_run_settles_to(model):
    orbit = model.orbit()
    once = 2.0 * math.pi / 195.0
    end = model.simulate(400 * once, solver=solvers.Exponential(1e-11))
    np.testing.assert_allclose(orbit.state, np.concatenate((end.q[-1], end.q_dot[-1])), atol=1e-9)
    assert orbit.stable
    run = model.simulate(once, once / 2000, start=orbit.state)
    u = run.displacement(TIP)
    assert orbit.extremes(TIP) == pytest.approx((u.min(), u.max()), rel=1e-4)
    assert orbit.contacts.peak_indentation.max() == pytest.approx(-orbit.extremes(TIP)[0], rel=1e-4)


def test_subharmonics_from_nothing_and_their_names(model, monkeypatch):
    bars = []

    def counting(wanted, *items, **options):
        bars.append((wanted, options["total"]))
        return tqdm(*items, disable=True, **options)

    monkeypatch.setattr("fembeam.model.orbit.counting", counting)
    found = model.attractors(430.0, starts=3, progress=True)
    assert bars == [(True, 3)]
    assert [a.name for a in found] == ["period 2 with 1 impact"]
    driven = paper_scene(fb.Harmonic(1e-3, 430.0)).reduce(1)
    half = driven.orbit(period=2)
    assert half.period == 2
    assert half.stable
    told = r"^12 starts settled to period 2 with 1 impact, none to period 3; "
    with pytest.raises(solvers.OrbitError, match=told) as error:
        driven.orbit(period=3)
    assert len(str(error.value)) < 250
    assert "3 shot(s)" in str(error.value.__cause__)
    with pytest.raises(solvers.OrbitError, match="Newton's method went to one of period 1"):
        model.orbit(period=2, start=model.orbit())


def test_starts_that_settle_slowly_are_on_no_unstable_orbit():
    """They near an orbit whose multiplier is -0.998: Newton's method took half of them to one with 12.2."""
    law = Hysteretic(34876461.985566534, damping_factor=0.2752137808049512, exponent=1.5)
    stops = [fb.Stop(TIP, law), fb.Stop(TIP, law, gap=2e-3, side="above")]
    push = fb.PointForce(0.2, fb.Harmonic(0.7881704090917894, 3 * 290.7190220035914, 3.95579346384189))
    scene = replace(paper_scene(fb.Harmonic(1.4324847429712658e-3, 290.7190220035914)), stops=stops, forces=[push],
                    damping=fb.ModalDamping(0.028479455880775946))  # fmt: skip
    found = scene.reduce(1).attractors(starts=6, seed=39)
    assert sum(one.count for one in found) == 6
    assert all(one.orbit is None or one.orbit.stable for one in found)


def test_a_mode_that_nothing_drives_dies_out():
    """By the same share in every period, however small it is: half the range is F φ²/|ω₁² - ω² + 2iζω₁ω|."""
    beam = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    force, damping = fb.PointForce(0.25, fb.Harmonic(20.0, 100.0)), fb.ModalDamping(0.01)
    model = fb.Scene(beam, [fb.Pinned(0.0), fb.Pinned(0.5)], forces=[force], damping=damping).reduce(2)
    start = model.state(lambda z: 1e-3 * np.sin(2.0 * np.pi * z / beam.length), lambda z: 0.0 * z)
    (found,) = model.attractors(starts=[start])
    assert found.name == "period 1 with 0 impacts"
    w, phi = model.omega[0], model.phi(0.25)[0]
    size = 20.0 * phi**2 / abs(w**2 - 100.0**2 + 2j * 0.01 * w * 100.0)
    assert found.orbit.extremes(0.25) == pytest.approx((-size, size), rel=1e-6)


def test_an_orbit_within_a_contact_where_the_period_begins_is_one_attractor():
    """Its state there does not tell the entry rate that the law has latched: one of period 2 was counted as two."""
    bar = fb.Section.rectangle(2.0e11, 7800.0, width=0.02, height=0.003)
    scene = fb.Scene(fb.Beam(0.25, bar), [fb.Clamped(0.0)], [fb.LumpedMass(0.25, mass=0.05)],
                     stops=[fb.Stop(0.25, Hysteretic(4.6e6, 0.2), 1e-5)], damping=fb.ModalDamping(0.015),
                     base=fb.Harmonic(1e-3, 580.0, 0.3))  # fmt: skip
    (found,) = scene.reduce(2).attractors(starts=8, longest=4)
    assert (found.period, found.impacts, found.count) == (2, 1, 8)


def test_bad_numbers_of_a_search_for_attractors_are_refused(model):
    """With longest=0 all motion was "not periodic"; 3.0 starts failed inside."""
    for name in ("longest", "starts"):
        for value in (0, -1, 3.0, True, None):
            with pytest.raises(ValueError, match=rf"{name} must be a .*, got {value} in Model.attractors; ask for"):
                model.attractors(**{"starts": 1, name: value})
    for seed in (-1, 1.0, None):
        with pytest.raises(ValueError, match=f"seed must be a whole number of at least 0, got {seed} in Model.attrac"):
            model.attractors(starts=2, seed=seed)


def test_a_search_from_nothing_tells_how_far_it_is(monkeypatch):
    """A run from rest and 12 other starts."""
    bars = []

    def counting(wanted, *items, **options):
        bar = tqdm(*items, disable=not wanted, file=io.StringIO(), **options)
        bars.extend([bar] if wanted else [])
        return bar

    monkeypatch.setattr("fembeam.model.orbit.counting", counting)
    with pytest.raises(solvers.OrbitError, match="none to period 3"):
        paper_scene(fb.Harmonic(1e-3, 430.0)).reduce(1).orbit(period=3, progress=True)
    assert [(bar.n, bar.total) for bar in bars] == [(13, 13)]


def test_an_unstable_orbit_beside_a_stable_subharmonic_from_nothing():
    """It closes for another integrator."""
    orbit = paper_scene(fb.Harmonic(1e-3, 430.0)).reduce(1).orbit()
    assert not orbit.stable
    assert orbit.found.period == pytest.approx(2.0 * math.pi / 430.0)
    later, method = delayed(orbit.found.system, orbit.found.phase), solvers.DormandPrince(rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(end_of(later, orbit.found.period, method)(orbit.state), orbit.state, rtol=1e-7)


def test_a_branch_is_not_continued_under_a_law_with_other_code(tmp_path):
    def with_law(factor):
        @law
        def spring(delta, delta_dot, entry_rate, stiffness):
            return factor * stiffness * delta

        scene = paper_scene()
        return replace(scene, stops=[replace(scene.stops[0], law=spring(stiffness=1e5))]).reduce(1)

    next(iter(branch := with_law(1.0).branch("omega", (190.0, 200.0), at=195.0)))
    branch.save(tmp_path / "b.npz")
    assert len(with_law(1.0).resume(tmp_path / "b.npz").parameter) == 1
    with pytest.raises(ValueError, match="belongs to another scene: a law, a signal or fembeam itself has other code"):
        with_law(3.0).resume(tmp_path / "b.npz")


def test_a_branch_of_what_has_no_digest_is_saved_all_the_same(model, tmp_path, monkeypatch):
    branch = model.branch("omega", (190.0, 200.0), at=195.0)
    next(iter(branch))
    monkeypatch.setattr("fembeam.model.branch.fingerprint", lambda *_: (_ for _ in ()).throw(ValueError("a lock")))
    branch.save(tmp_path / "b.npz")
    assert len(model.resume(tmp_path / "b.npz").parameter) == 1


def test_branch_marks_the_flip_and_its_copy_from_a_file_is_the_same(model, tmp_path):
    branch = model.branch("omega", (270.0, 300.0), at=280.0, step=0.2).run()
    flips = [orbit for orbit in branch.special if orbit.mark == "flip"]
    assert [round(orbit.parameter, 2) for orbit in flips] == [287.1]
    assert flips[0].multipliers[0].real == pytest.approx(-1.0, abs=1e-6)
    assert branch.status == "reached the end of the span; reached the end of the span"
    branch.save(tmp_path / "b.npz")
    again = model.resume(tmp_path / "b.npz")
    np.testing.assert_array_equal(again.parameter, branch.parameter)
    with pytest.raises(ValueError, match="belongs to another scene"):
        paper_scene(fb.Harmonic(2e-3, 195.0)).reduce(1).resume(tmp_path / "b.npz")
    whole = (tmp_path / "b.npz").read_bytes()
    listed = whole.index(b"PK\x01\x02")  # the list of the archive: flags, compression; where it lies
    flipped = [whole[:i] + bytes([whole[i] ^ 65]) + whole[i + 1 :] for i in (listed + 8, listed + 10, len(whole) - 3)]
    for content in (b"", b"no archive" * 9, whole[: len(whole) // 2], *flipped):
        (tmp_path / "damaged.npz").write_bytes(content)
        with pytest.raises(ValueError, match=r"damaged\.npz is not a saved branch, or is damaged"):
            model.resume(tmp_path / "damaged.npz")
    branch.to_csv(tmp_path / "b.csv")
    head, *rows = (tmp_path / "b.csv").read_text().splitlines()
    assert len(rows) == len(branch.orbits)
    assert head == ("base.omega [rad/s],period,stable,largest multiplier,its angle [rad],impacts,peak indentation [m],"
                    "peak force [N],residual,mark")  # fmt: skip
    assert fb.plot.branch(branch).axes[0].get_xlabel() == "drive frequency ω / rad s⁻¹"
    assert "1 contact, unstable" in fb.plot.orbit(flips[0])._suptitle.get_text()


def test_brute_force_agrees_with_the_branch(model, tmp_path):
    found = fb.study.bifurcation(model, "omega", [200.0, 215.0], settle=150, keep=4)
    branch = model.branch("omega", (200.0, 215.0), at=200.0, step=0.5).run()
    peaks = [max(-low, high) for low, high in (branch.orbits[0].extremes(TIP), branch.orbits[-1].extremes(TIP))]
    np.testing.assert_allclose(found.peaks, np.repeat([[peaks[0]], [peaks[1]]], 4, axis=1), rtol=1e-6)
    assert found.figure().axes[0].get_xlabel() == "drive frequency ω / rad s⁻¹"
    found.save(tmp_path / "peaks.csv")
    head, first, *_ = (tmp_path / "peaks.csv").read_text(encoding="utf-8").splitlines()
    assert (head, first) == ("base.omega [rad/s],peak [m]", f"200.0,{found.peaks[0, 0]}")


def test_brute_force_of_a_rotation_is_in_radians():
    frame = fb.Frame.polyline({"A": (0, 0), "B": (0, 1), "C": (0.8, 1)}, fb.Section.circle(2.1e11, 7850.0, 0.02))
    base, damping = {"x": fb.Harmonic(1e-3, 30.0)}, fb.ModalDamping(0.05)
    model, turned = fb.Scene(frame, [fb.Clamped("A")], base=base, damping=damping).reduce(modes=2), ("C", "rz")
    found = fb.study.bifurcation(model, "base.x.omega", [30.0], turned, settle=100, keep=1)
    assert found.peaks[0, 0] == pytest.approx(np.abs(model.orbit().extremes(turned)).max(), rel=1e-4)
    assert f"{1e3 * found.peaks[0, 0]:.5g}" in str(found)
    assert "largest peak / mrad" in str(found)


def test_brute_force_beside_a_support_that_moves():
    """The support itself has its own amplitude, and a place in the first element moves with it."""
    section, motion = fb.Section.circle(2.1e11, 7800.0, 0.01), {"y": fb.Harmonic(1e-3, 150.0)}
    model = fb.Scene(fb.Beam(0.5, section), [fb.Clamped(0.0, motion=motion)], damping=fb.ModalDamping(0.05)).reduce(2)
    for z, peak in ((0.0, 1e-3), (0.01, max(model.orbit().extremes(0.01)))):
        found = fb.study.bifurcation(model, "supports[0].motion.y.omega", [150.0], z, settle=60, keep=1)
        assert found.peaks[0, 0] == pytest.approx(peak, rel=1e-5)


def between_clamps(mass: float, stop: float) -> fb.Scene:
    """A beam between clamps, driven aside of its middle; of masses and stops elsewhere it is symmetric."""
    section, sheet = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12), PiecewiseLinear([2e4])
    return fb.Scene(fb.Beam(0.5, section), [fb.Clamped(0.0), fb.Clamped(0.5)], [fb.LumpedMass(0.35, mass=mass)],
                    stops=[fb.Stop(stop, sheet, gap=1e-4)], forces=[fb.PointForce(0.2, fb.Harmonic(0.5, 230.0))],
                    damping=fb.ModalDamping(0.03))  # fmt: skip


@pytest.mark.parametrize(
    ("name", "span", "first", "last"),
    [
        ("masses[0].mass", (0.0, 0.02), (0.0, 0.25), (0.02, 0.25)),
        ("stops[0].z", (0.2, 0.3), (0.0, 0.2), (0.0, 0.3)),
    ],
)
def test_a_branch_passes_where_a_mode_has_its_node_at_the_stop(name, span, first, last):
    """The second mode has its node there, so that the rule for its sign turns it: branches were lost at once."""
    branch = between_clamps(0.0, 0.25).reduce(modes=2).branch(name, span).run()
    assert set(branch.parameter[[0, -1]]) == {*span}
    for orbit, of in zip((branch.orbits[0], branch.orbits[-1]), (first, last), strict=True):
        anew = between_clamps(*of).reduce(modes=2).orbit()
        assert len(orbit.contacts) == len(anew.contacts) > 0
        np.testing.assert_allclose(orbit.extremes(0.2), anew.extremes(0.2), rtol=1e-6)


def test_brute_force_starts_where_it_is_told_whatever_the_signs_of_modes():
    """The second mode, whose node is at the stop without the mass, turned its sign over the values."""
    free = replace(between_clamps(0.0, 0.25), stops=[fb.Stop(0.25, PiecewiseLinear([1.0]), gap=10.0)])
    model, start = free.reduce(modes=2), [0.0, 0.0, 250.0, 700.0]
    found = fb.study.bifurcation(model, "masses[0].mass", [0.0, 1e-5], 0.1, settle=1, keep=1, start=start)
    assert found.peaks[1, 0] == pytest.approx(found.peaks[0, 0], rel=1e-3)


def test_brute_force_reduces_as_the_model_was(model):
    """With static shapes: of as many modes as coordinates the peaks would be off by 1e-3."""
    scene = model.scene
    found = fb.study.bifurcation(scene.reduce(modes=2, residual=True), "zeta[0]", [0.08], settle=40, keep=1)
    damped = replace(scene, damping=fb.ModalDamping((0.08, *scene.damping.zeta[1:]))).reduce(modes=2, residual=True)
    T = 2.0 * np.pi / scene.base.omega
    run = damped.simulate(41.0 * T, np.linspace(40.0 * T, 41.0 * T, 2001))
    assert found.peaks[0, 0] == pytest.approx(np.abs(run.displacement(TIP)).max(), rel=1e-5)


def test_peaks_under_a_slow_and_a_fast_tone():
    """Both are sampled as often as the fast one asks for: of a linear beam the peak is that of its response."""
    tones = fb.Multisine([0.01, 50.0], [2.0, 3000.0])
    beam = fb.Beam(0.26, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12))
    scene = fb.Scene(beam, [fb.Clamped(0.0)], forces=[fb.PointForce(0.26, tones)], damping=fb.ModalDamping(0.05))
    model = scene.reduce(modes=1)
    (at,), (omega,), (phi,) = tones.tones()[0][None], model.omega, model.phi(0.26)
    response = phi**2 * tones.tones()[1] / (omega**2 - at**2 + 0.1j * omega * at)
    u = (response @ np.exp(1j * np.outer(at, np.linspace(0.0, np.pi, 1_000_001)))).real
    assert model.orbit().extremes(0.26) == pytest.approx((u.min(), u.max()), rel=1e-4)
    found = fb.study.bifurcation(model, "damping.zeta[0]", [0.05], settle=5, keep=1)
    assert found.peaks[0, 0] == pytest.approx(np.abs(u).max(), rel=1e-3)


@pytest.mark.parametrize(
    ("name", "value"), [("gap", 1e-4), ("stiffness", 1e8), ("masses[0].mass", 0.02), ("zeta[0]", 0.03)]
)
def test_any_number_of_a_scene_can_be_varied(model, name, value):
    path = parameters.path_of(model.scene, name)
    scene = parameters.with_value(model.scene, name, value)
    assert parameters.value_of(scene, path) == value
    assert model.branch(name, (0.9 * value, 1.1 * value), at=value).orbits[0].parameter == value


def test_extremes_of_a_sampled_sine_and_common_periods():
    t = np.linspace(0.0, 2.0, 41)
    assert extremes_of(t, np.sin(9 * t), 9 * np.cos(9 * t)) == pytest.approx((-1.0, 1.0), abs=2e-4)
    for first, last in ((0.1, 1.4), (3.0, 1.7)):  # the top lies behind the last sample, or before the first
        part = np.linspace(min(first, last), max(first, last), 8)
        assert extremes_of(part, np.sin(part), np.cos(part)) == pytest.approx((np.sin(first), np.sin(last)))
    tones = [fb.Multisine([1.0, 1.0], [2.0, 3.0]), fb.Harmonic(1.0, 0.0)]
    assert common_period(tones) == pytest.approx(2.0 * math.pi)


def test_bad_input(model):
    with pytest.raises(ValueError, match=r"no such parameter; the scene has beam.length, .*base.omega"):
        model.branch("omga", (1.0, 2.0))
    for span, told in (((1.0, 0.5), ""), ((200.0,), ", got (200.0,)"), (200.0, ", got 200.0"), ((1.0, math.inf), "")):
        with pytest.raises(ValueError, match=re.escape(f"span must be two values, ascending{told}")):
            model.branch("omega", span=span)  # type: ignore[arg-type]
    for period in (0, 1.5):
        with pytest.raises(ValueError, match="period counts periods of the load"):
            model.orbit(period=period)
    with pytest.raises(ValueError, match="an orbit needs periodic loads"):
        paper_scene(fb.BandNoise(1e-4, (0.0, 100.0), seed=1)).reduce(1).orbit()
    with pytest.raises(ValueError, match="no common period"):
        paper_scene(fb.Multisine([1e-4, 1e-4], [2.0, 2.0 * math.pi])).reduce(1).orbit()
    with pytest.raises(ValueError, match=re.escape("start must have shape (2,), [q, q_dot], got (3,) in bifurcation")):
        fb.study.bifurcation(model, "omega", [200.0], start=[0.0, 0.0, 0.0])


def test_the_table_branch(tmp_path, capsys):
    text = (Path(__file__).parent.parent / "examples" / "beam_stop.toml").read_text()
    head = text[: text.index("[base]")]
    file = tmp_path / "scene.toml"
    file.write_text(
        head + '[base]\nkind = "harmonic"\namplitude = 1e-3\nomega = 195.0\n[reduce]\nmodes = 1\n'
        "[branch]\nspan = [190.0, 200.0]\nstep = 0.5\n"
    )
    assert cli.main(["run", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert "reached the end of the span" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"branch.npz", "branch.csv", "branch.png"}


@pytest.mark.parametrize("phase", [1.0, 2.0, 3.0])
def test_what_is_read_off_an_orbit_takes_loads_at_its_own_times(phase):
    """An orbit whose law latches the entry rate begins where its stop is open, which need not be t = 0."""
    law, mass = Hysteretic.lankarani_nikravesh(1e4, restitution=0.5), fb.LumpedMass(TIP, 0.0254)
    orbit = paper_scene(fb.Harmonic(1e-3, 90.0, phase=phase), 0.02, law, masses=[mass]).reduce(modes=2).orbit()
    run, step = orbit.run, orbit.run.t[1]
    frame = run.displacement(TIP, absolute=True) - run.displacement(TIP)
    expected = 1e-3 * np.cos(90.0 * (run.t + orbit.found.phase) + phase)
    np.testing.assert_allclose(frame, expected, rtol=0.0, atol=1e-15)
    velocity, acceleration = run.velocity(TIP), run.acceleration(TIP)
    error = np.abs((velocity[2:] - velocity[:-2]) / (2.0 * step) - acceleration[1:-1])
    assert np.median(error) < 1e-3 * np.abs(acceleration).max()
    assert (orbit.found.phase > 0.0) == (phase > 1.0)
