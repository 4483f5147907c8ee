"""Parameter studies: closed answers over grids and samples, the same bits however they are run, minima, bad input."""

import math
import multiprocessing
import os
import re
import select
import signal
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from problems import ROD_FILE, paper_scene
from refusals import refused_by
from scipy import stats

import fembeam as fb
from contacts import Hertz, Hysteretic
from fembeam import cli, scene_file
from fembeam.scene import with_value
from fembeam.scene_file.study_tables import _pool
from fembeam.study.execution.executors import spread
from fembeam.study.quantities import Amplitude, PeakForce

ROD = fb.Section.circle(2.1e11, 7800.0, 0.01)
STEADY = {"duration": 0.3, "dt": 1e-3, "modes": 1, "elements": 4}


def rod(**parts):
    """A clamped rod of 0.5 m."""
    return fb.Scene(fb.Beam(0.5, ROD), [fb.Clamped(0.0)], **{"damping": fb.ModalDamping(0.05), **parts})


def swung(load=1e-3, zeta=0.05):
    return rod(base=fb.Harmonic(load, 100.0), damping=fb.ModalDamping(zeta))


def sag(run):
    """Deflection of the tip at the end, m."""
    return float(run.displacement(0.5)[-1])


def struck(model):
    """Unit velocity of the first mode."""
    return np.concatenate((np.zeros(len(model.omega)), np.ones(len(model.omega))))


def kick(run):
    """∫ (ω² q + 2ζω q̇)² dt of a free mode: what the frame feels of a blow."""
    omega, zeta = run.model.omega[0], run.model.zeta[0]
    return float(np.trapezoid((omega**2 * run.q[:, 0] + 2.0 * zeta * omega * run.q_dot[:, 0]) ** 2, run.t))


def reach(run):
    """Largest |q| of a free mode."""
    return float(np.abs(run.q[:, 0]).max())


BLOW = {"duration": 0.3, "dt": 2e-4, "start": struck, "modes": 1, "elements": 4}

# --- names ------------------------------------------------------------------------------------------------------------


def frame(gap=1e-4):
    """A clamped plane frame that meets two stops by name, shaken along two axes."""
    body = fb.Frame.polyline({"A": (0, 0), "B": (1, 0)}, ROD)
    stops = [fb.Stop("B", Hertz(1e7), 1.0, direction="-y"), fb.Stop("B", Hertz(1e7), gap, direction="y", name="wall")]
    base = {"x": fb.Harmonic(1e-4, 50.0), "y": fb.Harmonic(1e-3, 50.0)}
    return fb.Scene(body, [fb.Clamped("A")], stops=stops, damping=fb.ModalDamping(0.05), base=base)


def test_stops_and_parameters_go_by_the_names_they_were_given():
    runs = {"duration": 0.5, "dt": 1e-2, "modes": 1}
    found = fb.study.vary(frame(), {"stops[wall].gap": [1e-4, 2e-4]}, PeakForce("wall"), **runs)
    assert found.names == ("stops[wall].gap",)
    plain = fb.study.vary(frame(), {"stops[1].gap": [1e-4, 2e-4]}, PeakForce(1), **runs)
    assert plain.names == ("stops[1].gap",)
    np.testing.assert_array_equal(found.values, plain.values)
    assert np.all(found.values > 1.0)
    best = fb.study.minimise(frame(), {"stops[wall].gap": (1e-4, 2e-4)}, PeakForce("wall"), tolerance=0.05, **runs)
    assert list(best.at) == ["stops[wall].gap"]
    for stop, said in (("wal", "the nearest is 'wall'"), (2, "stop must be below 2")):
        with pytest.raises(ValueError, match=said):
            fb.study.vary(frame(), {"stops[1].gap": [1e-4]}, PeakForce(stop), **runs)


def test_whole_numbers_of_a_scene_are_parameters_too():
    stop, mass = fb.Stop(0.5, Hertz(10_000_000), gap=0), fb.LumpedMass(0.5, mass=1, inertia=0)
    scene = rod(masses=[mass], stops=[stop], base=fb.Harmonic(1e-3, 100), gravity=9)
    values = {"stops[0].gap": 1e-4, "masses[0].mass": 2.0, "stops[0].law.stiffness": 2e7, "gravity": 8.0}
    found = fb.study.vary(scene, [values], "peak_force", 0.1, modes=1, elements=4)
    changed = replace(scene, masses=[replace(mass, mass=2)], stops=[replace(stop, law=Hertz(2e7), gap=1e-4)], gravity=8)
    run = changed.reduce(modes=1, elements=4).simulate(0.1)
    assert found["peak_force"][0] == run.contacts.peak_force.max() > 0.0
    lever = replace(frame(), masses=[fb.LumpedMass("B", 1, inertia=0, offset=(0, 0.05))])
    assert with_value(lever, "masses[0].offset[0]", 0.01).masses[0].offset == (0.01, 0.05, 0.0)


def test_axes_of_a_base_motion_name_its_direction_and_have_few_numbers():
    values = {"base.x.amplitude": [1.25e-4, 2.5e-4, 3.75e-4], "base.y.amplitude": [1e-3, 2e-3]}
    axis = fb.study.vary(frame(), values, "amplitude", duration=0.1, dt=1e-2, modes=1).figure().axes[0]
    assert axis.get_xlabel() == "base amplitude along x / m"
    assert axis.get_ylabel() == "base amplitude along y / m"
    assert len(axis.get_xticks()) <= 7


def test_one_frequency_of_a_base_in_several_directions_is_one_parameter():
    shaken = with_value(frame(), "omega", 60.0)
    assert [signal.omega for signal in shaken.base.values()] == [60.0, 60.0]
    assert with_value(frame(), "base.x.omega", 60.0).base["y"].omega == 50.0
    with pytest.raises(ValueError, match=r"ambiguous parameter: base.x.omega, base.y.omega"):
        with_value(with_value(frame(), "base.x.omega", 60.0), "omega", 70.0)
    orbits = frame(gap=1.0).reduce(1).branch("omega", (40.0, 60.0)).run().orbits
    assert {orbit.parameter for orbit in orbits} >= {40.0, 60.0}


# --- closed answers ---------------------------------------------------------------------------------------------------


def test_static_deflection_over_load_and_stiffness():
    """u = F L³/(3 E I + k L³), with all of the rod's static compliance in its attachment mode."""
    loads, springs = [-3.0, 2.0], [0.0, 5e3, 4e4]
    scene = rod(forces=[fb.PointForce(0.5, fb.Step(1.0, 1e-2))], springs=[fb.Spring(0.5, 0.0)],
                damping=fb.ModalDamping(0.9))  # fmt: skip
    parameters = {"forces[0].signal.size": loads, "springs[0].stiffness": springs}
    found = fb.study.vary(scene, parameters, sag, 0.6, 1e-2, modes=1, residual=True, elements=4)
    F, k = np.meshgrid(loads, springs, indexing="ij")
    np.testing.assert_allclose(found["sag"], F / (3.0 * ROD.E * ROD.I / 0.5**3 + k), rtol=1e-5)
    assert found.axes[1].tolist() == springs
    assert [row["springs[0].stiffness"] for row in found.table()] == springs * 2


def test_resonance_amplitude_over_damping_and_amplitude():
    """|H(ω)| ω² Γ φ a of the settled response: no duration, ten groups of periods without scatter."""
    omega = rod().reduce(modes=1).omega[0]
    ratios, sizes = [0.02, 0.1], [1e-4, 3e-4]
    scene = rod(base=fb.Harmonic(1e-4, omega), damping=fb.ModalDamping([0.05]))
    found = fb.study.vary(scene, {"zeta[0]": ratios, "amplitude": sizes}, Amplitude(z=0.5), modes=1)
    model = scene.reduce(modes=1)
    peak = abs(model.participation[0] * model.phi(0.5)[0])
    np.testing.assert_allclose(found["amplitude(z=0.5)"], np.divide.outer(peak, 2 * np.array(ratios))[:, None] * sizes,
                               rtol=1e-5)  # fmt: skip
    assert found.names == ("damping.zeta[0]", "base.amplitude")
    assert np.all(found.standard_error < 1e-6 * found.values)


def collision(damping_factor, speed):
    """A free mass that strikes a beam far heavier than itself."""
    law = Hysteretic(1e6, damping_factor)
    heavy = fb.Section(E=1e15, rho=1e9, A=1.0, I=1.0)
    ball = fb.Impactor(0.25, 1e-3, -speed, law)
    return fb.Scene(fb.Beam(0.5, heavy), [fb.Pinned(0.0), fb.Pinned(0.5)], impactors=[ball])


def restitution(run):
    return float(-run.contacts.speed_out[0] / run.contacts.speed_in[0])


def test_restitution_of_one_impact():
    """a (1 + r) = ln[(1 + a)/(1 - a r)] whatever the speed; the scenes come from a function."""
    factors, speeds = [0.1, 0.5, 1.5], [0.5, 2.0]
    found = fb.study.vary(collision, {"damping_factor": factors, "speed": speeds}, restitution, 0.01, 1e-3, modes=1)
    r = np.abs(found["restitution"])
    a = np.array(factors)[:, None]
    np.testing.assert_allclose(a * (1.0 + r), np.log((1.0 + a) / (1.0 - a * r)), rtol=1e-5)


# --- samples ----------------------------------------------------------------------------------------------------------


def test_samples_of_distributions_give_the_scatter_of_a_linear_quantity():
    """Amplitude ∝ load: its mean, deviation and percentiles are those of the load."""
    law = stats.norm(1e-3, 5e-5)
    found = fb.study.vary(swung(), {"amplitude": law}, "amplitude", samples=40, seed=3, **STEADY)
    loads, values = found.points[:, 0], found["amplitude"]
    unit = fb.study.vary(swung(), {"amplitude": [1.0]}, "amplitude", **STEADY)["amplitude"][0]
    np.testing.assert_allclose(values, unit * loads, rtol=1e-6)
    estimate = found.estimate("amplitude")
    assert abs(estimate.value - unit * 1e-3) < 4.0 * estimate.standard_error
    assert estimate.standard_error == pytest.approx(unit * 5e-5 / math.sqrt(40), rel=0.5)
    assert stats.kstest(loads, law.cdf).pvalue > 1e-3
    again = fb.study.vary(swung(), {"amplitude": law}, "amplitude", samples=40, seed=3, **STEADY)
    np.testing.assert_array_equal(again.points, found.points)
    assert "over the samples" in str(found)


def test_samples_of_qmc_and_points_one_by_one():
    shares = stats.qmc.Sobol(2, seed=1).random(4)
    laws = {"amplitude": stats.uniform(1e-3, 1e-3), "zeta": stats.uniform(0.05, 0.1)}
    scene = swung(zeta=[0.05])
    found = fb.study.vary(scene, {"amplitude": laws["amplitude"], "zeta[0]": laws["zeta"]}, "amplitude",
                          samples=shares, **STEADY)  # fmt: skip
    np.testing.assert_allclose(found.points, [1e-3, 0.05] + shares * [1e-3, 0.1], rtol=1e-12)
    listed = [{"amplitude": a, "zeta[0]": z} for a, z in found.points.tolist()]
    other = fb.study.vary(scene, listed, "amplitude", **STEADY)
    np.testing.assert_array_equal(other.values, found.values)
    assert other["amplitude"].shape == (4,)


def test_standard_errors_of_noise_cover():
    """Mean square of a mode under white noise: the exact one lies within the errors, for the same seeds everywhere."""
    noise = fb.BandNoise(1e-5, (0.0, 400.0), seed=1)
    scene = rod(base=noise)
    found = fb.study.vary(scene, {"base.std": [1e-5, 2e-5]}, "rms", 8.0, 2e-3, 1.0, seeds=range(12), modes=1)
    model = scene.reduce(modes=1)
    line = model.frequency_response(np.linspace(1e-3, 400.0, 20001), output=0.5).amplitude
    exact = 1e-5 * math.sqrt(np.mean(line**2))
    values, errors = found["rms"], found.standard_error[:, 0]
    assert np.all(np.abs(values - exact * np.array([1.0, 2.0])) < 4.5 * errors)
    assert np.all((errors > 0.0) & (errors < 0.15 * values))
    assert values[1] / values[0] == pytest.approx(2.0, rel=1e-9)  # common random numbers
    assert "±" in str(found)
    assert "standard error of rms" in found.table()[0]


# --- the same bits ----------------------------------------------------------------------------------------------------

GRID = {"stops[0].gap": [0.0, 5e-4, 1e-3], "base.amplitude": [1e-3, 2e-3]}
ASKED = {"quantity": ["peak_force", "rms"], "duration": 0.2, "dt": 1e-3}


def test_parallel_is_serial():
    serial = fb.study.vary(paper_scene(), GRID, **ASKED)
    with ThreadPoolExecutor(3) as pool:
        parallel = fb.study.vary(paper_scene(), GRID, **ASKED, executor=pool)
    with ProcessPoolExecutor(1) as pool:  # the trial and what it finds can be sent
        sent = fb.study.vary(paper_scene(), GRID, **ASKED, executor=pool)
    np.testing.assert_array_equal(parallel.values, serial.values)
    np.testing.assert_array_equal(sent.values, serial.values)
    one = paper_scene(fb.Harmonic(2e-3, 195.0)).reduce(modes=2).simulate(0.2, 1e-3)
    assert serial["peak_force"][0, 1] == pytest.approx(PeakForce()(one), rel=1e-12)


def test_resumed_runs_give_the_same_bits(tmp_path, monkeypatch):
    whole, path = fb.study.vary(paper_scene(), GRID, **ASKED), tmp_path / "vary.npz"

    def killed(function, items, executor, progress, seen):
        spread(function, items[:3], executor, progress, seen)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("fembeam.study.variation.spread", killed)
        with pytest.raises(KeyboardInterrupt):
            fb.study.vary(paper_scene(), GRID, **ASKED, checkpoint=path)
    counted = []

    def counting(function, items, *others):
        counted.append(len(items))
        return spread(function, items, *others)

    monkeypatch.setattr("fembeam.study.variation.spread", counting)
    resumed = fb.study.vary(paper_scene(), GRID, **ASKED, checkpoint=path)
    np.testing.assert_array_equal(resumed.values, whole.values)
    wider = fb.study.vary(paper_scene(), GRID | {"stops[0].gap": [0.0, 1e-3, 2e-3]}, **ASKED, checkpoint=path)
    np.testing.assert_array_equal(wider["rms"][:2], whole["rms"][[0, 2]])
    assert counted == [3, 2]
    for change in ({"duration": 0.3}, {"quantity": ["peak_force"]}):
        with pytest.raises(ValueError, match="belongs to another study"):
            fb.study.vary(paper_scene(), GRID, **ASKED | change, checkpoint=path)
    with pytest.raises(ValueError, match=r"stops\[0\].law is .* there and .* here"):
        fb.study.vary(paper_scene(law=Hertz(1e8)), GRID, **ASKED, checkpoint=path)


def test_failed_points_are_told_and_the_rest_survives(monkeypatch):
    import solvers

    simulate = fb.Model.simulate

    def fragile(self, *arguments):
        if self.scene.stops[0].gap == 5e-4:
            raise solvers.SolverError("too hard", None)
        return simulate(self, *arguments)

    monkeypatch.setattr(fb.Model, "simulate", fragile)
    with pytest.warns(UserWarning, match=r"1 of 3 points failed; stops\[0\].gap = 0.0005: SolverError"):
        found = fb.study.vary(paper_scene(), {"gap": [0.0, 5e-4, 1e-3]}, "peak_force", 0.1)
    assert np.isfinite(found["peak_force"]).tolist() == [True, False, True]
    assert found.failures[0][0] == 1
    with pytest.raises(RuntimeError, match=r"a run failed at stops\[0\].gap = 0.0005"):
        fb.study.minimise(paper_scene(), {"gap": (0.0, 1e-3)}, "peak_force", duration=0.1)


def test_points_that_buckle_fail_and_the_rest_survives():
    scene = replace(paper_scene(), supports=[fb.Clamped(0.0), fb.Pinned(0.2599)], stops=[], masses=[])
    call = partial(fb.study.vary, scene, quantity="rms", duration=0.1, dt=1e-3)
    with pytest.warns(UserWarning, match=r"1 of 3 points failed; beam.axial_force = -1e\+06: axial_force must stay"):
        found = call({"beam.axial_force": [0.0, -1e6, 10.0]})
    assert np.isfinite(found["rms"]).tolist() == [True, False, True]
    with pytest.raises(ValueError, match=r"where the beam buckles.*at beam.axial_force = -1e\+06, and at all others"):
        call({"beam.axial_force": [-1e6, -2e6]})


def working(end):
    """Hold the end of a pipe, as the processes of a table do."""
    with _pool(2) as pool:
        pids = {pool.submit(os.getpid).result() for _ in range(8)}
        os.write(end, " ".join(map(str, pids)).encode())
        time.sleep(300.0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no such processes")
def test_workers_of_a_table_end_with_what_began_them():
    reads, writes = os.pipe()
    victim = multiprocessing.get_context("fork").Process(target=working, args=(writes,))
    victim.start()
    os.close(writes)
    pids = os.read(reads, 1000).split()
    victim.kill()
    victim.join()
    ready, _, _ = select.select([reads], [], [], 30.0)
    for pid in () if ready else pids:
        os.kill(int(pid), signal.SIGKILL)
    assert ready, "a worker still holds the pipe"
    os.close(reads)


# --- minima -----------------------------------------------------------------------------------------------------------


def test_the_same_with_a_bound_on_the_reach():
    """max |q| ω = exp(-ζ/√(1-ζ²) arccos ζ) for unit velocity: the bound is active, at its root ζ > 1/2."""
    omega, zeta = rod().reduce(modes=1, elements=4).omega[0], 0.7
    bound = math.exp(-zeta / math.sqrt(1 - zeta**2) * math.acos(zeta)) / omega
    scene = rod(damping=fb.ModalDamping([0.1]))
    ask = partial(fb.study.minimise, scene, {"zeta[0]": (0.05, 0.95)}, kick, **BLOW)
    found = ask(constraints={reach: bound})
    assert found.at["damping.zeta[0]"] == pytest.approx(zeta, abs=2e-3)
    assert found.active == ("reach",)
    assert found.limits[0].value <= bound
    assert "at most" in str(found)
    loose = ask(constraints={reach: 2.0 * bound}, tolerance=1e-2)
    assert (loose.active, loose.limits[0].active) == ((), False)
    with pytest.raises(RuntimeError, match=r"no point keeps the constraints; the nearest is damping.zeta\[0\] = 0.9"):
        ask(constraints={reach: 0.3 * bound}, tolerance=1e-2)


@pytest.mark.parametrize("number", range(12))
def test_a_limit_of_what_jumps_is_met_to_its_jumps(number):
    """g jumps by less than 0.01 about x at every point: beyond x = 0.6 it is kept nowhere, below 0.59 everywhere."""

    def damping(run):
        return run.model.scene.damping.zeta[0]

    def jumps(run):
        x = damping(run)
        return x + 0.01 * np.random.default_rng([number, int(1e12 * x)]).uniform()

    ask = partial(fb.study.minimise, rod(damping=fb.ModalDamping([0.1])), {"zeta[0]": (0.05, 0.95)})
    found = ask(lambda run: -damping(run), {jumps: 0.6}, duration=0.01, dt=5e-3, modes=1, elements=4)
    assert 0.585 < found.at["damping.zeta[0]"] < 0.6
    assert found.active == ("jumps",)
    assert found.limits[0].value <= 0.6


def test_a_minimum_at_an_end_and_in_two_parameters():
    scene = rod(damping=fb.ModalDamping([0.1]), forces=[fb.PointForce(0.5, fb.Step(1.0, 1e-2))])

    def bowl(run):
        x, y = run.model.scene.damping.zeta[0], run.model.scene.forces[0].signal.size
        return (x - 0.3) ** 2 + 2.0 * (y - 3.0) ** 2 + 0.2 * (x - 0.3) * (y - 3.0)

    box = {"zeta[0]": (0.1, 0.9), "forces[0].signal.size": (1.0, 2.0)}
    found = fb.study.minimise(scene, box, bowl, duration=0.01, dt=5e-3, modes=1, elements=4)
    assert found.at["forces[0].signal.size"] == pytest.approx(2.0, abs=1e-3)
    assert found.at["damping.zeta[0]"] == pytest.approx(0.4, abs=2e-2)
    assert found.active == ("forces[0].signal.size",)
    assert found.figure().axes[0].get_ylabel()


def test_common_random_numbers_and_a_search_that_is_resumed(tmp_path):
    """Rms of the linear beam over damping falls: with the same noise everywhere, without a dip from chance."""
    scene = rod(base=fb.BandNoise(1e-5, (0.0, 400.0), seed=1), damping=fb.ModalDamping([0.1]))
    ask = partial(fb.study.minimise, scene, {"zeta[0]": (0.02, 0.2)}, "rms", duration=1.0, dt=4e-3, seeds=range(3),
                  modes=1, elements=4, checkpoint=tmp_path / "least.npz")  # fmt: skip
    found, again = ask(), ask()
    order = np.argsort(found.tried.points[:, 0])
    assert np.all(np.diff(found.tried["rms"][order]) < 0.0)
    assert found.active == ("damping.zeta[0]",)
    assert found.standard_error > 0.0
    np.testing.assert_array_equal(again.tried.values, found.tried.values)
    assert found.plain()["evaluations"] == found.evaluations


# --- figures and files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("parameters", "samples", "panels"), [
    ({"gap": [0.0, 1e-3]}, None, 2),
    (GRID, None, 4),
    ({"gap": stats.uniform(0.0, 1e-3), "omega": stats.uniform(150.0, 50.0)}, 3, 4),
    ({"gap": [0.0], "omega": [190.0, 195.0], "amplitude": [1e-3]}, None, 6),
])  # fmt: skip
def test_figures(parameters, samples, panels):
    found = fb.study.vary(paper_scene(), parameters, ["peak_force", "rms"], 0.1, 1e-3, samples=samples)
    figure = found.figure()
    assert len(figure.axes) == panels
    assert figure.axes[0].get_xlabel() == "gap of stop 0 / m"
    assert len(found.table()) == len(found) == len(found.plain()["points"])


def test_tables_have_the_units_of_the_parameters():
    """Of arguments of a function none is known."""
    run = {"quantity": "rms", "duration": 0.1, "dt": 1e-3}
    found = fb.study.vary(paper_scene(), {"gap": [0.0, 1e-3], "damping.zeta[0]": [0.1]}, **run)
    assert found.units == ("m", "")
    assert re.search(r"stops\[0\].gap / m +damping.zeta\[0\] +rms", str(found))
    least = fb.study.minimise(paper_scene(), {"gap": (0.0, 1e-3)}, tolerance=0.05, most=12, **run)
    assert "stops[0].gap / m" in str(least)
    made = fb.study.vary(lambda gap: paper_scene(), {"gap": [0.0]}, **run)
    assert made.units == ("",)
    assert made.value_units == ("m",)


def test_values_have_units_in_tables_figures_and_files(tmp_path):
    """Of the stop that is asked for, of rotation or not; a function has none."""
    hinge = fb.Stop(0.5, Hertz(1e4), of="rotation", name="hinge")
    scene = replace(swung(), stops=[fb.Stop(0.5, Hertz(1e7)), hinge])
    asked = {"F": "peak_force", "M": PeakForce("hinge"), "M1": PeakForce(1), "M2": PeakForce(-1),
             "turn": Amplitude("hinge"), "own": lambda run: 1.0}  # fmt: skip
    found = fb.study.vary(scene, {"omega": [100.0, 110.0]}, asked, 0.05, 1e-3)
    assert found.value_units == ("N", "N m", "N m", "N m", "rad", "")
    assert re.search(r"omega / rad s⁻¹ +F / N +M / N m +M1 / N m +M2 / N m +turn / rad +own\n", str(found))
    assert found.figure().axes[1].get_ylabel() == "M / N m"
    found.save(tmp_path / "table.csv")
    head = (tmp_path / "table.csv").read_text().splitlines()[0]
    assert head == "base.omega [rad/s],F [N],M [N m],M1 [N m],M2 [N m],turn [rad],own"
    least = fb.study.minimise(scene, {"omega": (100.0, 110.0)}, "rms", {"energy": 1e9}, 0.05, 1e-4, tolerance=0.05)
    assert re.search(r"rms / m .*\n.*omega / rad s⁻¹.*\nenergy / J", str(least))


FILE = (
    ROD_FILE
    + """
[[stops]]
z = 0.5
law = { kind = "hertz", stiffness = 1e9 }
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 150
[reduce]
modes = 1
[vary]
parameters = { "stops[0].gap" = [0, 1e-4], amplitude = [1e-3] }
quantity = ["peak_force", { kind = "rms", z = 0.5 }]
duration = 0.1
dt = 1e-3
[minimise]
parameters = { "stops[0].gap" = [0, 2e-3] }
quantity = "rms"
constraints = { peak_force = 1e9 }
duration = 0.1
dt = 1e-3
tolerance = 0.01
"""
)


def test_tables_of_a_scene_file(tmp_path, capsys):
    path, out = tmp_path / "scene.toml", tmp_path / "out"
    path.write_text(FILE)
    assert cli.main(["run", str(path), "--out", str(out), "--quiet"]) == 0
    said = capsys.readouterr().out
    assert "rms(z=0.5)" in said
    assert "converged" in said
    left = {f"{name}.{kind}" for name in ("vary", "minimise") for kind in ("npz", "json", "csv", "txt", "png")}
    assert {one.name for one in out.iterdir()} >= left
    file = scene_file.read(path)
    found = fb.study.vary(file.scene, {"gap": [0.0, 1e-4], "amplitude": [1e-3]}, "peak_force", 0.1, modes=1)
    assert f"{found['peak_force'][1, 0]:.5g}" in said
    drawn = FILE.replace(
        "[0, 1e-4], amplitude = [1e-3] }", '{ kind = "norm", loc = 1e-3, scale = 1e-5 } }\nsamples = 2'
    )
    path.write_text(drawn[: drawn.index("[minimise]")])
    assert cli.main(["run", str(path), "--out", str(tmp_path / "drawn"), "--quiet"]) == 0
    assert "over the samples" in capsys.readouterr().out


@pytest.mark.parametrize(("old", "new", "said"), [
    ("stops[0].gap", "stops[0].gaps", "did you mean stops[0].gap?"),
    ("[0, 1e-4]", '"wide"', "parameters must be a table of names, each with a list of numbers or"),
    ("[0, 1e-4]", '{ kind = "normal" }', "must be a distribution of scipy.stats"),
    ("[0, 1e-4]", '{ kind = "norm", mean = 1e-3 }', "numbers of norm must be loc, scale, got ['mean'] in stops[0].gap"),
    ("[0, 1e-4]", '{ kind = "gamma", loc = 1e-3 }', "numbers of gamma must be a, loc, scale, got ['loc']"),
    ('"peak_force", {', '"peak", {', "kind must be one of amplitude"),
    ("[0, 2e-3]", "[2e-3, 0]", "bounds of stops[0].gap must be two finite values, ascending"),
    ("peak_force = 1e9", "peak = 1e9", "quantity must be one of"),
])  # fmt: skip
def test_tables_are_checked_when_read(file_of, old, new, said):
    with pytest.raises(scene_file.tables.SceneFileError, match=re.escape(said)):
        file_of(FILE.replace(old, new))


def test_places_of_quantities_are_those_of_the_scenes_that_run(file_of):
    """A place beyond the beam of the file was refused, though all that run are longer."""
    longer = FILE[: FILE.index("[minimise]")].replace("amplitude = [1e-3]", '"beam.length" = [0.6, 0.7]')
    assert "vary" in file_of(longer.replace("z = 0.5 }]", "z = 0.55 }]")).studies
    with pytest.raises(scene_file.tables.SceneFileError, match=r"z must lie on the beam, 0 to 0\.6 m, got"):
        file_of(longer.replace("z = 0.5 }]", "z = 0.65 }]"))


# --- bad input --------------------------------------------------------------------------------------------------------


GIVEN = {"quantity": "rms", "duration": 0.05, "dt": 1e-3}

test_bad_input = refused_by(
    lambda change: fb.study.vary(paper_scene(), **{**GIVEN, "parameters": {"gap": [0.0]}, **change}),
    ({"parameters": {"stops[0].gapp": [1e-3]}}, r"no such parameter; .*'stops\[0\].gapp' .*mean stops\[0\].gap\?"),
    ({"parameters": {"gap": ["wide"]}}, "values of gap must be finite numbers, got .'wide'."),
    ({"parameters": {"gap": [0.0, math.nan]}}, "values of gap must be finite numbers"),
    ({"parameters": {"gap": []}}, "values of gap must be finite numbers"),
    ({"parameters": {"gap": 1e-3}}, "values of gap must be finite numbers"),
    ({"parameters": {"gap": [True]}}, "values of gap must be finite numbers"),
    ({"parameters": {"gap": [[0.0], [1.0, 2.0]]}}, "values of gap must be finite numbers"),
    ({"parameters": {}}, "parameters must name at least one"),
    ({"parameters": "gap"}, "parameters must be {path: values}"),
    ({"parameters": {"gap": [0.0], "stops[0].gap": [0.0]}}, "parameters must differ"),
    ({"parameters": [{"gap": 0.0}, {"omega": 1.0}]}, "every point must name the same parameters"),
    ({"parameters": {"stops[0].law.stiffness": [1e8, -1.0]}}, r"stiffness .*\(at stops\[0\].law.stiffness = -1\)"),
    ({"parameters": {"gap": stats.norm(1e-3, 1e-5)}}, "samples must be a number of them"),
    ({"parameters": {"gap": stats.norm(1e-3, -1e-5)}, "samples": 2}, "the distribution of gap must have a median"),
    ({"parameters": {"gap": stats.norm(1e-3, 1e-5)}, "samples": 0}, "samples must be at least 1"),
    ({"parameters": {"gap": stats.norm(1e-3, 1e-5)}, "samples": [[2.0]]}, r"samples must lie in \[0, 1\]"),
    ({"parameters": {"gap": stats.norm(1e-3, 1e-5)}, "samples": [[0.0]]}, "samples must be finite"),
    ({"parameters": {"gap": stats.norm(1e-3, 1e-5), "omega": [1.0]}, "samples": 2}, "omega must be a distribution"),
    ({"samples": 3}, "samples are drawn from distributions"),
    ({"quantity": "peak"}, "quantity must be one of amplitude, rms"),
    ({"quantity": []}, "quantity must name at least one"),
    ({"quantity": ["rms", "rms"]}, "quantities must have different names"),
    ({"quantity": "density"}, "density must be one number at every point"),
    ({"dt": None}, "rms needs samples"),
    ({"quantity": "wear_power"}, "a stop must have friction, got 'wear_power'"),
    ({"seeds": range(4)}, "seeds need noise"),
    ({"checkpoint": 3}, "checkpoint must be the path of a file, got 3"),
    ({"duration": -1.0}, "duration must be finite and positive"),
)


test_bad_bounds = refused_by(
    lambda change: fb.study.minimise(paper_scene(), **{**GIVEN, "parameters": {"gap": (0.0, 1e-3)}, **change}),
    ({"parameters": {"gap": (1.0, 0.0)}}, "bounds of gap must be two finite values, ascending"),
    ({"parameters": {"gap": 1.0}}, "bounds of gap must be two finite values"),
    ({"parameters": {}}, "parameters must be {path: "),
    ({"constraints": {"peak_force": "ten"}}, "the bound of peak_force must be a finite number"),
    ({"constraints": {"rms": 1.0}}, "quantities must have different names"),
    ({"tolerance": 0.5}, "tolerance must lie in"),
    ({"most": 8}, "most must be above the 8 first points"),
    ({"quantity": "mean_force", "parameters": {"gap": (1.0, 2.0)}}, "mean_force must have a value at every point"),
)


def test_what_is_no_such_thing():
    with pytest.raises(ValueError, match="scene must be a Scene or a function that makes one, got 3"):
        fb.study.vary(3, {"gap": [0.0]}, "rms", 0.1)
    with pytest.raises(TypeError, match="quantity must be a name or a function of a run"):
        fb.study.vary(paper_scene(), {"gap": [0.0]}, 3, 0.1)
    found = fb.study.vary(paper_scene(), {"gap": [0.0]}, "peak_force", 0.05)
    with pytest.raises(KeyError, match="the study has no 'rms'; it has peak_force"):
        found["rms"]
    with pytest.raises(ValueError, match="the mean over a grid is none of a distribution"):
        found.estimate("peak_force")


def test_noise_along_two_axes_is_no_obstacle():
    """Signals of a base were compared as keys of a set, which noise is not."""
    noises = {axis: fb.BandNoise(1e-3, (1.0, 50.0), seed=seed) for seed, axis in enumerate("xy")}
    member = fb.Member("A", "B", fb.Section.rectangle(2.1e11, 7850.0, 0.02, 0.01))
    frame = fb.Frame({"A": (0.0, 0.0), "B": (0.0, 1.0)}, [member])
    scene = fb.Scene(frame, [fb.Clamped("A")], base=noises, damping=fb.ModalDamping(0.02))
    found = fb.study.vary(scene, {"beam.nodes.B[1]": [1.0, 1.1]}, "rms", duration=0.2, dt=1e-3, modes=2)
    assert len(found.values) == 2
