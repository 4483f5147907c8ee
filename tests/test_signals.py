"""One list of all signals of a scene: every place where one can stand, and everybody who asks for them."""

from dataclasses import MISSING, fields, replace

import numpy as np
import pytest
from problems import ROD, ROD_FILE

import fembeam as fb
from contacts import Hertz
from fembeam.inspection.units import doubts, highest_driven
from fembeam.model import load_period
from fembeam.scene import (
    FEATURES,
    Scene,
    changes_structure,
    for_duration,
    path_of,
    signals_of,
    with_signals,
    with_value,
)
from fembeam.scene.signals import is_of_signal
from fembeam.study import ensemble
from fembeam.study.execution.checkpoint import identity
from fembeam.study.measure import Plan, runs
from fembeam.study.realisations import realisation
from fembeam.study.segments import Segments

PLAIN = {  # annotations of what is no signal
    *("float", "str", "str | None", "float | tuple[float, ...]", "tuple[str, ...]"),
    *("Of", "Place", "Second | None", "Direction | None", "float | Sequence[float]", "bool", "float | None"),
    *("tuple[float, float]", "tuple[Direction, Direction] | None"),
    "float | tuple[float, float, float] | tuple[tuple[float, ...], ...]",
}
STRUCTURE = {*("z", "beam", "damping", "bodies", "joints", "law", "friction"), *FEATURES}  # are none, others annotated
TABLES = {"motion"}  # signals by name, see below
VALUES = {"z": 0.3, "stiffness": 1e3, "mass": 0.1, "velocity": 0.0, "damping": 0.1, "law": Hertz(1e8)}
TONE, NOISE = fb.Harmonic(1e-5, 300.0), fb.BandNoise(1e-5, (0.0, 600.0), seed=3)


def signal_fields(kind):
    """Fields that can hold a signal: all whose annotation or name does not say that they hold something else."""
    return [f.name for f in fields(kind) if f.type not in PLAIN and f.name not in STRUCTURE | TABLES and not f.kw_only]


def made(kind, key, signal):
    """A part of that kind with the signal in that field."""
    needed = {f.name: VALUES[f.name] for f in fields(kind) if f.default is MISSING and f.name != key}
    return kind(**needed, **{key: signal})


def scene_of(**parts):
    return Scene(ROD, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.05), **parts)


def places():
    """(path, signal -> scene) of every place a dataclass of a scene has for a signal, alone and on a body."""
    for key in signal_fields(Scene):
        yield key, lambda signal, key=key: scene_of(**{key: signal})
    for name, kinds in FEATURES.items():
        for kind in kinds:
            for key in signal_fields(kind):
                path = f"{name}[0].{key}"

                def alone(signal, name=name, kind=kind, key=key):
                    return scene_of(**{name: [made(kind, key, signal)]})

                yield path, alone
                yield f"bodies[0].{path}", lambda signal, alone=alone: scene_of(bodies=[alone(signal)])


def moved(signal):
    """A frame whose support moves."""
    section = fb.Section.circle(2.1e11, 7800.0, 0.01)
    frame = fb.Frame({"A": (0, 0), "B": (0.5, 0)}, [fb.Member("A", "B", section)])
    return Scene(frame, [fb.Clamped("A", motion={"y": signal})], damping=fb.ModalDamping(0.05))


PLACES = [*places(), ("supports[0].motion.y", moved)]
everywhere = pytest.mark.parametrize(("path", "scene_with"), PLACES, ids=[path for path, _ in PLACES])


def test_the_places_are_found_by_the_fields_of_the_parts():
    parts = ["forces[0].signal", "forces[0].signal", "springs[0].foot"]  # of forces and of moments
    assert sorted(path for path, _ in PLACES[:-1]) == sorted(["base", *parts, *(f"bodies[0].{path}" for path in parts)])


@everywhere
def test_every_place_is_listed_changed_and_a_load(path, scene_with):
    scene = scene_with(TONE)
    assert signals_of(scene) == {path: TONE}
    assert signals_of(with_signals(scene, lambda signal: NOISE)) == {path: NOISE}
    assert with_signals(scene, lambda signal: signal) is scene
    loads = [signal for _, signal in scene.reduce(modes=1).system.loads]
    of_support = [TONE, TONE.derivative(1), TONE.derivative(2)]
    assert loads == (of_support if ".motion." in path else [TONE.derivative(2) if path == "base" else TONE])


@everywhere
def test_periods_and_frequencies_of_every_signal_are_known(path, scene_with):
    scene = scene_with(TONE)
    assert load_period(scene) == pytest.approx(2 * np.pi / 300.0)
    assert highest_driven(scene) == 300.0
    with pytest.raises(ValueError, match="an orbit needs periodic loads"):
        load_period(scene_with(NOISE))


@everywhere
def test_every_signal_can_be_varied_and_leaves_the_structure_alone(path, scene_with):
    scene = scene_with(TONE)
    assert path_of(scene, "omega") == f"{path}.omega"
    assert is_of_signal(f"{path}.omega")
    assert not changes_structure(f"{path}.omega")
    assert signals_of(with_value(scene, "omega", 200.0))[path].omega == 200.0


@everywhere
def test_realisations_renew_every_noise(path, scene_with):
    model = scene_with(NOISE).reduce(modes=1)
    first, second = (signals_of(realisation(model, seed).scene)[path] for seed in (1, 2))
    assert len({NOISE(0.1), first(0.1), second(0.1)}) == 3
    found = ensemble(model, 2, lambda model: signals_of(model.scene)[path](0.1))
    assert found.values[""][0] != found.values[""][1]
    plan = Plan(duration=0.05, dt=0.01, seeds=(5, 6, 7))
    plan.check(model.scene, lambda run: 0.0)
    assert [signals_of(run.model.scene)[path].seed for run in runs(model, plan, abs, None)] == [5, 6, 7]


@everywhere
def test_checkpoints_know_every_signal_but_not_its_seed(path, scene_with):
    def about(signal):
        return identity(scene_with(signal).reduce(modes=1), abs)

    assert about(NOISE) == about(replace(NOISE, seed=4))
    assert about(NOISE) != about(replace(NOISE, std=2e-5))


@everywhere
def test_every_signal_goes_on_in_the_next_segment_and_lasts(path, scene_with):
    model = scene_with(TONE).reduce(modes=1)
    plan = Segments.of(model, 10.0, 1e-3, 0.0, None, None, 256)
    plan.time = 0.3
    assert signals_of(plan._run(0.05).model.scene)[path](0.1) == pytest.approx(TONE(0.4), abs=1e-17)
    long = scene_with(NOISE).reduce(modes=1).for_duration(1e3)
    assert signals_of(long.scene)[path].period == 1e3


def test_for_duration_asks_signals_that_offer_it():
    assert for_duration(abs, 2.0) is abs
    assert for_duration(NOISE, 1e3).period == 1e3


def test_two_noises_renewed_for_a_study_stay_apart_or_together():
    def seeds(*signals):
        scene = scene_of(base=signals[0], forces=[fb.PointForce(0.3, signals[1])])
        run = runs(scene.reduce(modes=1), Plan(duration=0.01, seeds=(5, 6, 7)), abs, None)[0]
        return [signal(0.1) for signal in signals_of(run.model.scene).values()]

    together, apart = seeds(NOISE, NOISE), seeds(NOISE, replace(NOISE, seed=4))
    assert together[0] == together[1] == apart[0] == replace(NOISE, seed=5)(0.1)
    assert apart[0] != apart[1]


def test_orbit_and_branch_of_a_beam_shaken_by_the_foot_of_a_spring_alone():
    spring = fb.Spring(0.5, 2e3, foot=fb.Harmonic(1e-3, 150.0))
    scene = scene_of(springs=[spring], stops=[fb.Stop(0.5, Hertz(1e8), gap=1e-4)])
    model = scene.reduce(modes=1)
    orbit = model.orbit()
    assert orbit.found.period == pytest.approx(2 * np.pi / 150.0)
    assert len(orbit.contacts) >= 1
    n = len(model.omega)
    end = model.simulate(orbit.found.period, start=orbit.state)
    np.testing.assert_allclose(np.concatenate((end.q[-1], end.q_dot[-1])), orbit.state, atol=1e-8 * n)
    branch = model.branch("omega", (150.0, 151.0), at=150.0, start=orbit, step=1.0).run()
    assert {150.0, 151.0} <= set(branch.parameter)


def test_doubts_see_feet(file_of):
    file = file_of(
        ROD_FILE
        + """
[[springs]]
z = 0.5
stiffness = 100
foot = { kind = "harmonic", amplitude = 2.0, omega = 1e5 }
"""
    )
    said = doubts(file.scene.reduce(modes=2))
    assert any("springs[0].foot moves by 2 m" in one for one in said)
    assert any("loads reach 100000 rad/s" in one for one in said)
