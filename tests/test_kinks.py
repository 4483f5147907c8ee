"""Nonsmooth points of branches: contacts that merge, corners at the entry rate's floor, grazings; one mode."""

import math

import numpy as np
import pytest
from oscillators import Tone, random_family, random_stops_family, status_names

from contacts import Hysteretic, PiecewiseLinear
from solvers import Contact, DormandPrince, Exponential, OrbitError, System, branch, integrate, orbit
from solvers.branches import walk
from solvers.branches.bifurcations import between
from solvers.branches.grazing import signature
from solvers.branches.nonsmooth import nonsmooth_near

LATCHED = Hysteretic(2.1e8, 0.5625, entry_rate_floor=5e-3)
TWO = 328.9, [1.58306e-4, -0.0933967169]  # rad/s, an orbit of two contacts over two periods of the drive
FIVE = 327.487238, [1.44000287e-4, -0.0931451829]  # one of five, with the floor at 1e-3 m/s


def family(law, periods=2):
    """The paper's beam with one mode over the frequency of its base, rad/s."""

    def load(omega):
        return [-0.30982846], Tone(-1e-3 * omega**2, omega)

    base = System.modal([109.13], 0.02, [Contact([4.05079553], law)], [load(1.0)])  # its tables serve all

    def make(omega):
        return base.like(loads=[load(omega)]), periods * 2.0 * math.pi / omega

    return make


def marks(found, *kinds):
    return [one for one in found.special if one.mark in kinds]


def motion(one, end, count=4000):
    """Times, indentation and final state of an orbit by another integrator."""
    n, x = one.system.size, one.state
    times = np.linspace(0.0, end, count)
    run = integrate(one.system, x[:n], x[n:], end, times, DormandPrince(1e-11))
    return times, -run.q @ one.system.contacts[0].direction, np.append(run.q[-1], run.q_dot[-1])


@pytest.fixture(scope="module")
def merged():
    return branch(family(LATCHED), (327.55, 330.5), TWO[1], at=TWO[0]).run()


@pytest.fixture(scope="module")
def pairs(merged):
    """Both orbits of each merging, the one with more contacts first."""
    found = marks(merged, "merging")
    return [sorted(found[i : i + 2], key=lambda one: -len(one.contacts)) for i in (0, 2)]


def test_a_branch_goes_on_where_contacts_merge(merged):
    assert status_names(merged) == ["END", "END"]
    counts = [len(one.contacts) for one in merged.orbits]
    assert {1, 2, 3} <= set(counts)
    ends = sorted([merged.orbits[0], merged.orbits[-1]], key=lambda one: one.parameter)
    assert [one.parameter for one in ends] == [327.55, 330.5]
    assert [len(one.contacts) for one in ends] == [2, 3]
    assert all(one.residual <= 1e-10 for one in merged.orbits)


def test_on_one_side_of_a_merging_the_flight_vanishes(pairs):
    """The second contact is entered more slowly than the floor, hardly later than the first one ends."""
    for (apart, _), count in zip(pairs, (2, 3), strict=True):
        log = apart.contacts
        assert len(log) == count
        last = np.argmin(log.speed_in)
        assert log.speed_in[last] < 1e-3 * LATCHED.entry_rate_floor * 10.0
        assert 0.0 < log.t_in[last] - log.t_out[last - 1] < 1e-4 * apart.period


def test_on_the_other_side_a_contact_touches_the_surface_from_within(pairs):
    for apart, one in pairs:
        log = one.contacts
        assert len(log) == len(apart.contacts) - 1
        longest = np.argmax(log.t_out - log.t_in)
        times, delta, _ = motion(one, one.period, 40_000)
        inner = (times > log.t_in[longest] + 1e-5) & (times < log.t_out[longest] - 1e-5)
        dips = inner[1:-1] & (delta[1:-1] < delta[:-2]) & (delta[1:-1] <= delta[2:])
        assert -1e-12 < delta[1:-1][dips].min() < 1e-5 * log.peak_indentation[longest]


def test_orbits_beside_a_merging_close_for_another_integrator(pairs):
    for one in [one for pair in pairs for one in pair]:
        end = motion(one, one.period, 2)[2]
        assert np.abs(end - one.state).max() < 1e-6 * np.abs(one.state).max()


def test_no_orbit_lies_beyond_the_end_of_a_branch(merged, pairs):
    """Orbits of three contacts end at 329.767 rad/s: just below it Newton's method finds none of them."""
    apart, _ = pairs[1]
    beside = next(one for one in merged.orbits if 0.0 < one.parameter - apart.parameter < 0.01)
    slope = (beside.state - apart.state) / (beside.parameter - apart.parameter)
    for off, there in ((1e-4, True), (-1e-3, False)):
        start = apart.state + off * slope
        try:
            found = orbit(*family(LATCHED)(apart.parameter + off), start=start, shots=1)
            count = len(found.contacts)
        except OrbitError:
            count = 0
        assert (count == 3) == there


def test_a_merging_is_crossed_both_ways(pairs):
    apart, one = pairs[1]
    back = branch(family(LATCHED), (329.5, 330.4), apart.state, at=apart.parameter + 1e-5).run()
    both = marks(back, "merging")
    assert sorted(orbit.parameter for orbit in both) == pytest.approx([apart.parameter, one.parameter], abs=1e-5)


def test_contacts_that_take_each_others_place_are_not_taken_for_the_same(merged):
    """Between 327.55 and 327.9 rad/s two contacts merge and another begins: before and after there are two."""
    found = [one for one in merged.special if one.parameter < 328.0]
    kinds = [one.mark for one in sorted(found, key=lambda one: merged.orbits.index(one))]
    assert [kind for kind in kinds if kind != "floor"] == ["flip", "grazing", "merging", "merging", "flip"]


def test_a_corner_at_the_floor_turns_the_branch():
    law = Hysteretic(2.1e8, 0.5625)
    found = branch(family(law), (327.4, 327.6), FIVE[1], at=FIVE[0]).run()
    (corner,) = marks(found, "floor")
    assert not marks(found, "fold")
    assert np.abs(corner.multipliers - 1.0).min() > 0.1
    assert corner.contacts.speed_in.min() == pytest.approx(law.entry_rate_floor, rel=1e-3)
    assert max(one.parameter for one in found.orbits) == pytest.approx(corner.parameter, rel=1e-10)
    place = found.orbits.index(corner)
    clipped = [int(one.contacts.entry_rate_clipped.sum()) for one in found.orbits]
    assert {*clipped[:place]} | {*clipped[place + 1 :]} == {0, 1}
    assert len({*clipped[:place]}) == len({*clipped[place + 1 :]}) == 1
    end = marks(found, "merging")  # it would go on outside the span
    assert len(end) == 1
    assert status_names(found) == ["END", "END"]


def test_a_law_without_memory_has_no_merging():
    system, period = family(PiecewiseLinear([1e6]))(300.0)
    found = orbit(system, period)
    assert {nonsmooth.kind for nonsmooth in nonsmooth_near(found)} <= {"grazing"}


def test_two_flips_between_two_orbits_are_seen_by_the_one_before():
    """With one mode the harmonic branch is unstable between 79.46 and 90.19 rad/s."""
    found = branch(family(Hysteretic(2.1e8, 0.5625), 1), (77.0, 103.0), [3.305e-4, 0.01542], at=103.0).run()
    flips = [one.parameter for one in marks(found, "flip")]
    assert flips == pytest.approx([90.186248, 79.463069], abs=1e-5)
    points = found.walks[0].passed
    last, a = [point for point in points if point.chain.parameter > flips[0] + 0.5][-2:]
    b = next(point for point in points if point.chain.parameter < flips[1])

    def way(p, q):
        return float(p.tangent @ p.metric @ (q.unknowns - p.unknowns))

    assert not between(a, b, way(a, b))
    seen = between(a, b, way(a, b), (last, way(last, a)))
    assert [one.parameter for one in seen] == pytest.approx(flips, rel=1e-9)


def test_the_floor_is_marked_where_it_is_met():
    """Stability and the clipped contacts change at marked orbits only; at one floor |mu| falls from 3.1 to 0."""
    make, _, _ = random_family(np.random.default_rng(13), "amplitude")
    found = branch(make, (1.44, 1.51), np.zeros(4), step=0.3).run()
    assert [one.mark for one in found.special] == ["grazing", "floor", "fold", "floor", "merging", "merging"]
    for one in marks(found, "floor"):
        assert one.contacts.speed_in.min() == pytest.approx(1e-3, rel=1e-4)
    for a, b in zip(found.orbits, found.orbits[1:], strict=False):
        assert (signature(a), a.stable) == (signature(b), b.stable) or a.mark or b.mark
    corner = found.orbits.index(marks(found, "floor")[1])
    before, after = found.orbits[corner - 1], found.orbits[corner + 1]
    assert abs(before.multipliers[0]) > 1.1
    assert abs(after.multipliers[0]) < 0.01


def test_a_merging_is_met_over_the_gap():
    """The surface moves with the parameter; this branch was lost where its jump leads out of the span."""
    make, span, _ = random_stops_family(np.random.default_rng(125), "gap", 3)
    found = branch(make, span, orbit(*make(span[0])), at=span[0], step=0.3).run()
    assert status_names(found) == ["END"]
    assert [one.mark for one in found.special] == ["merging"]


def test_two_mergings_at_once_are_crossed(merged):
    """Over twice the period every contact of an orbit comes twice, and both merge at the same parameter."""
    found = branch(family(LATCHED, 4), (TWO[0], 330.5), TWO[1], at=TWO[0], shots=2).run()
    once, twice = marks(merged, "merging")[2:], marks(found, "merging")
    assert status_names(found) == ["END"]
    assert [2 * len(one.contacts) for one in once] == [len(one.contacts) for one in twice]
    assert [one.parameter for one in twice] == pytest.approx([one.parameter for one in once], rel=1e-7)


def test_a_jump_without_a_way_over_is_said(monkeypatch, pairs):
    """Where the orbits that would lead over it are lost."""

    def lost(*_):
        raise OrbitError("lost")

    monkeypatch.setattr(walk, "behind", lost)
    found = branch(family(LATCHED), (TWO[0], 330.5), TWO[1], at=TWO[0]).run()
    assert status_names(found) == ["JUMP"]
    _, one = pairs[1]
    assert found.orbits[-1].parameter == pytest.approx(one.parameter, abs=1e-5)


@pytest.mark.parametrize("rtol", [1e-7, 1e-9, 1e-10, 1e-11])
def test_a_cut_force_that_fast_modes_raise_for_a_moment_is_not_passed_over(rtol):
    """A dashpot cuts the force while modes swing freely, faster than the nodes of a step tell; it was off by 1.3e-6."""
    rows = [0.801, -0.4774, -0.4106, 0.0986], [0.5078, 0.7772, -0.9319, -0.5486]
    cut, other = Hysteretic(1.7579e7, 0.71132, 1.0, clamp=True), Hysteretic(1.4465e8, 1.059, 1.0)
    stops = [Contact(rows[0], cut, -1.18559e-3), Contact(rows[1], other, 0.0)]
    system = System.modal([195.956, 20896.1, 75686.2, 164566.2], 4.165e-4, stops)
    start = [-5.8609e-5, 5.24e-12, -1.08e-11, 3.5e-12], [-6.4893e-2, -5.95e-7, 7.11e-7, 1.18e-6]
    ours, theirs = (integrate(system, *start, 2.1e-3, method=m) for m in (Exponential(rtol), DormandPrince(1e-12)))
    assert np.abs(ours.q_dot - theirs.q_dot).max() < 1e-9 * np.abs(start[1]).max()
