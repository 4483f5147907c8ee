"""Ctrl-C while a result is made of several runs: none of them is taken for a whole one, and what was found is kept."""

from functools import partial

import numpy as np
import pytest

import fembeam as fb
import solvers
from contacts import Hertz
from fembeam.study import ensemble, vary
from fembeam.study.execution import executors
from solvers.exponential.method import Engine as Engine

SCENE = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    stops=[fb.Stop(0.24445, law=Hertz(2.1e8))],
    damping=fb.ModalDamping(0.02),
    base=fb.BandNoise(std=2.5e-4, band=(0.0, 1226.6), seed=1),
)
MODEL = SCENE.reduce(modes=2)
DRIVE = {"base": fb.Harmonic(5e-4, 150.0), "damping": fb.ModalDamping(0.1)}  # settles into one orbit, |μ| = 0.6
DRIVEN = fb.Scene(**{**vars(SCENE), **DRIVE}).reduce(modes=2)
ORBIT = DRIVEN.orbit()


@pytest.fixture
def interrupt(monkeypatch):
    """Make the compiled loop of some later call end in Ctrl-C, as a signal does."""

    def after(calls):
        march, left = Engine.march, [calls]

        def interrupted(self, *arguments):
            left[0] -= 1
            if left[0] == 0:
                raise KeyboardInterrupt
            return march(self, *arguments)

        monkeypatch.setattr(Engine, "march", interrupted)

    return after


def contacts(model, duration=1.0):
    return len(model.simulate(duration, 1e-3).contacts)


def test_a_run_alone_is_partial(interrupt):
    interrupt(1)
    assert MODEL.simulate(1.0, 1e-3).status.startswith("interrupted: partial result")


def test_an_ensemble_keeps_no_partial_realisation(interrupt, tmp_path):
    kept = tmp_path / "kept.npz"
    quantity = partial(contacts, duration=1.0)
    whole = ensemble(MODEL, 4, quantity).values[""]
    interrupt(3)
    with pytest.raises(KeyboardInterrupt):
        ensemble(MODEL, 4, quantity, checkpoint=kept)
    np.testing.assert_array_equal(ensemble(MODEL, 4, quantity, checkpoint=kept).values[""], whole)


@pytest.mark.parametrize(
    "asked",
    [
        lambda: DRIVEN.attractors(3),
        lambda: DRIVEN.orbit(),
        lambda: ORBIT.extremes(0.2),
        lambda: ORBIT.sensitivity("omega"),
        lambda: MODEL.strike(0.1),
        lambda: solvers.lyapunov(DRIVEN.system, np.zeros(2), np.zeros(2), 1.0),
        lambda: vary(SCENE, {"stops[0].gap": [0.0, 1e-3]}, "peak_force", duration=0.2, dt=1e-3, modes=2),
        lambda: executors.spread(contacts, [MODEL]),
    ],
    ids=["attractors", "orbit", "extremes", "sensitivity", "strike", "lyapunov", "vary", "spread"],
)
def test_what_is_made_of_runs_stops(interrupt, asked):
    interrupt(1)
    with pytest.raises(KeyboardInterrupt):
        asked()


def test_an_interrupted_branch_goes_on_as_if_it_had_not_been(interrupt):
    whole = DRIVEN.branch("omega", (145.0, 155.0)).run()
    branch = DRIVEN.branch("omega", (145.0, 155.0))
    for calls in (2, 3, 5, 8, 13):
        interrupt(calls)
        with pytest.raises(KeyboardInterrupt):
            branch.run()
    branch.run()
    np.testing.assert_array_equal(branch.parameter, whole.parameter)
    assert [one.mark for one in branch.orbits] == [one.mark for one in whole.orbits]
