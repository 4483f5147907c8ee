"""Work rates by friction: of runs, of stationary responses with standard errors, of ensembles."""

import numpy as np
import pytest

import fembeam as fb
import solvers
from contacts import KelvinVoigt
from fembeam.study import ensemble, stationary
from fembeam.study.quantities import ContactTime, Power, WearPower

METHOD = solvers.DormandPrince(1e-7)


def shaken(friction=fb.Friction(0.3, 300.0)):  # noqa: B008
    """A mass of two places, each in its own hole, under two forces of white noise."""
    labels = [(node, way) for node in ("A", "B") for way in "xy"]
    K = np.kron([[160.0, -60.0], [-60.0, 160.0]], np.eye(2))
    body = fb.Structure(K, np.eye(4), 1.2 * np.eye(4), labels=labels, nodes={"A": (0, 0, 0), "B": (0, 0, 1)})
    stops = [fb.AnnularStop(at, KelvinVoigt(800.0, 3.0), c, directions=("x", "y"), friction=friction)
             for at, c in (("A", 2e-2), ("B", 3e-2))]  # fmt: skip
    noise = [fb.BandNoise(2.0, (0.0, 40.0), seed=seed) for seed in (1, 2)]
    forces = [fb.PointForce("A", one, direction=way) for one, way in zip(noise, "xy", strict=True)]
    return fb.Scene(body, stops=stops, forces=forces).reduce(modes=4)


@pytest.fixture(scope="module")
def found():
    model = shaken()
    dampers = np.asarray(model.system.C)
    watch = {
        "own": lambda run: np.einsum("ki,ij,kj->k", run.q_dot, dampers, run.q_dot),
        "given": lambda run: np.sum((run.readout.loads.T @ run.readout.load_vectors) * run.q_dot, axis=1),
    }
    return model, stationary(model, 120.0, 5e-3, watch, discard=5.0, segment=256, solver=METHOD)


def test_what_is_given_is_what_is_taken(found):
    """Forces times speeds at the samples are what dampers, blows and rubbing take, but for what is left at the end."""
    _, response = found
    given, own = response["given"].mean.value, response["own"].mean.value
    assert own + response.power().value == pytest.approx(given, rel=0.03)
    assert response.wear().value > 0.1 * given  # seen by this balance
    assert response.wear().value == pytest.approx(response.wear(0).value + response.wear(1).value)
    assert response.wear().value < response.power().value
    assert 0.0 < response.wear(0).standard_error < 0.3 * response.wear(0).value


def test_work_rates_are_among_the_numbers(found):
    _, response = found
    names = response.numbers()
    assert [name for name in names if name.endswith("wear")] == ["stop 0 wear", "stop 1 wear"]
    assert repr(names["stop 0 wear"]) == repr(response.wear(0))
    assert response.impacts[0].probability.value > 0.0  # share of time in contact
    with pytest.raises(ValueError, match="contact must be below 2"):
        response.wear(2)


def test_seeds_scatter_as_the_standard_error_says(found):
    """An ensemble of runs from rest has the same work rate; both intervals of 99.99 % cover the difference."""
    model, response = found

    def rate(seeded):
        run = seeded.simulate(15.0, 5e-3, solver=METHOD)
        power = WearPower()(run)
        assert power == pytest.approx(run.losses.friction[0] / 15.0, rel=1e-6, abs=1e-9)
        assert 0.0 < power < Power()(run)
        assert ContactTime()(run) > 0.0
        return power

    mean = ensemble(model, 8, rate).mean
    error = np.hypot(mean.standard_error, response.wear(0).standard_error)
    assert abs(mean.value - response.wear(0).value) < 6.0 * error


def test_stops_without_friction_have_no_wear():
    run = shaken(None).simulate(1.0, 5e-3, solver=METHOD)
    assert not run.friction_loss.any()
    with pytest.raises(ValueError, match="the stop must have friction"):
        WearPower()(run)
