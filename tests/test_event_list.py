"""The event list of a run: segments follow each other, and the contact log is what it says."""

import numpy as np
import pytest

from contacts import Jenkins, PiecewiseLinear, WaltonBraun
from solvers import Contact, DormandPrince, Exponential, Status, System
from solvers.integration import prepared_run
from solvers.problem import event_list as at

STOPS = [
    Contact([1.0, 0.0], PiecewiseLinear([1e5, 4e5, 2e5], [2e-4, 5e-4]), -3e-4),  # preloaded beyond its first knot
    Contact([-1.0, 0.3], PiecewiseLinear([3e5, 1e5], [3e-4]), 1e-4),
    Contact([0.2, 1.0], WaltonBraun(2e5, 5e5), 1e-4),
    Contact([0.0, 1.0], Jenkins(1e5, 20.0), always=True),
]


@pytest.fixture(params=[Exponential(1e-9), DormandPrince(1e-9)], ids=["exponential", "dormand"])
def run(request):
    """A finished run of two masses on springs."""
    system = System(np.eye(2), 2.0 * np.eye(2), np.diag([4e4, 9e4]), STOPS)
    run = prepared_run(system, [0.0, 0.0], [0.4, -0.3], 0.06, None, request.param, False)
    assert run.to_the_end(None) is Status.DONE
    return run


def test_segments_of_an_element_follow_each_other(run):
    rows = run._rows()
    assert np.all(np.diff(rows[~np.isnan(rows[:, at.TIME]), at.TIME]) >= 0.0)
    assert {at.KNOT, at.BEGIN, 0.0} <= set(rows[:, at.GUARD])
    for element in range(len(STOPS)):
        mine = rows[rows[:, at.ELEMENT] == element]
        np.testing.assert_array_equal(mine[1:, at.FROM], mine[:-1, at.TO])
        assert mine[0, at.FROM] == 0.0
    first = rows[rows[:, at.ELEMENT] == 0]
    assert first[0, at.GUARD] == at.BEGIN
    assert first[0, at.TO] == 2.0  # begun between both knots
    inner = first[(first[:, at.GUARD] == at.KNOT) & (first[:, at.FROM] > 0.0) & (first[:, at.TO] > 0.0)]
    assert np.all(np.isin(inner[:, at.DELTA], [2e-4, 5e-4]))
    np.testing.assert_array_equal(np.sign(inner[:, at.RATE]), inner[:, at.TO] - inner[:, at.FROM])


def test_the_contact_log_is_a_view_of_it(run):
    rows, log = run._rows(), run.solution(Status.DONE, 0.0).contacts
    ends = at.ends_of(rows[rows[:, at.ELEMENT] < 3])  # the slider always acts
    assert len(log) == len(ends) > 4
    np.testing.assert_array_equal(log.stop, ends[:, at.ELEMENT])
    np.testing.assert_array_equal(log.t_out, ends[:, at.TIME])
    np.testing.assert_array_equal(log.peak_force, ends[:, at.LARGEST])
    for stop in range(3):
        mine = np.flatnonzero(log.stop == stop)
        assert np.all(log.t_in[mine[1:]] >= log.t_out[mine[:-1]])
        total = ends[ends[:, at.ELEMENT] == stop][-1, at.IMPULSE]
        np.testing.assert_allclose(log.impulse[mine].sum(), total, rtol=1e-12)
