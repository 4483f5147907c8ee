"""What each contact takes for good: closed forms on a motion that nothing disturbs, and the balance of energy."""

import numpy as np
import pytest
from test_own_memory import JENKINS, LATCHED, OWN, SLIP, pull

import fembeam as fb
from contacts import (
    Border,
    BoucWen,
    Coulomb,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    PiecewiseLinear,
    Polynomial,
    Segment,
    WaltonBraun,
    memory_law,
)
from contacts.path import walk, work
from fembeam.results.files import summary
from solvers import RK4, Contact, DormandPrince, Exponential, System, integrate

X, OMEGA, HEAVY = 2e-3, 3.0, 1e12
METHODS = pytest.mark.parametrize("method", [Exponential(1e-10), DormandPrince(1e-11)], ids=["main", "stepping"])


def heavy(laws, gaps=None):
    """A heavy mass on a spring, with elements and stops."""
    always = [not isinstance(law, (Hysteretic, WaltonBraun, PiecewiseLinear)) for law in laws]
    contacts = [Contact([-1.0], law, g or 0.0, a) for law, a, g in zip(laws, always, gaps or [0.0] * 9, strict=False)]
    return System([[HEAVY]], [[0.0]], [[HEAVY * OMEGA**2]], contacts)


def swing(laws, periods, method, gaps=None, q=0.0, v=X * OMEGA):
    """X sin ωt to within 1e-9 whatever the elements do."""
    return integrate(heavy(laws, gaps), [q], [v], periods * 2.0 * np.pi / OMEGA, method=method)


@METHODS
def test_losses_of_a_cycle(method):
    """4 f (X - f/k) of a slider, the sum of them of Iwan's, π c ω X² of a dashpot, nothing of a spring."""
    joint = Iwan([2e4, 1e4, 3e3], [4.0, 9.0, np.inf])
    laws = [Jenkins(2e4, 10.0), joint, KelvinVoigt(1e4, 7.0), Polynomial([1e4, 0.0, 1e8]), Jenkins(2e4, 60.0)]
    one, two = (swing(laws, n, method).losses.loss for n in (1, 2))
    expected = [40.0 * (X - 5e-4), 16.0 * (X - 2e-4) + 36.0 * (X - 9e-4), np.pi * 7.0 * OMEGA * X**2, 0.0, 0.0]
    np.testing.assert_allclose(two - one, expected, rtol=1e-8, atol=1e-9)
    assert one[0] == pytest.approx(10.0 * (4.0 * X - 2.5e-3), rel=1e-8)  # slip X - f/k, 2 (X - f/k), X - 2 f/k


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize("sharpness", [10.0, 40.0])
def test_loss_of_a_light_element_with_a_sharp_knee(rtol, sharpness):
    """2 (1 - α) k/c (ln cosh √c L - ½) per cycle, c = 2 β = 2 γ, n = 2, L = 2 X - 1/√c; of no weight in the motion.

    A reversal at ± X begins with a line of the slope k, down to z = 0; from there on it is a tanh of the length L.
    """
    root = sharpness / X
    law = BoucWen(1e4, 0.0, 1.0, 0.5 * root**2, 0.5 * root**2, 2)
    one, two = (swing([law], n, Exponential(rtol)).losses.loss[0] for n in (1, 2))
    straight = 2.0 * sharpness - 1.0  # √c L; ln cosh of it is this less ln 2 to 1e-16
    assert two - one == pytest.approx(2e4 / root**2 * (straight - np.log(2.0) - 0.5), rel=20.0 * rtol)


@METHODS
def test_path_of_slip(method):
    """4 (X - f/k) per cycle of each slider; a slip cut by the end of a run counts on both sides."""
    laws = [Jenkins(2e4, 10.0), Iwan([2e4, 1e4], [4.0, 9.0]), Jenkins(2e4, 60.0), Polynomial([1e4])]
    one, two, half = (swing(laws, n, method) for n in (1, 2, 0.15))
    expected = [4.0 * (X - 5e-4), 4.0 * (X - 2e-4) + 4.0 * (X - 9e-4), 0.0, 0.0]
    np.testing.assert_allclose(two.losses.slip - one.losses.slip, expected, rtol=1e-8, atol=1e-12)
    assert half.memory[0][0] == 1.0  # it slips
    assert half.losses.slip[0] == pytest.approx(X * np.sin(0.3 * np.pi) - 5e-4, rel=1e-8)
    rest = integrate(heavy(laws), half.q[-1], half.q_dot[-1], 0.85 * 2 * np.pi / OMEGA, method=method,
                     memory=half.memory)  # fmt: skip
    np.testing.assert_allclose(half.losses.slip + rest.losses.slip, one.losses.slip, rtol=1e-8, atol=1e-12)
    assert list(one.losses.arrays()) == ["work", "stored", "loss", "slip"]
    assert repr(one.losses) == f"<losses of 4 contacts: {one.losses.loss.sum():.6g} J>"


@METHODS
def test_a_slip_that_lasts_a_whole_run_counts(method):
    """Of a run that goes on from one that slips, and ends before the slip does; of each slider of a sum."""
    slider = Jenkins(2e4, 10.0)
    laws = [slider, Iwan([2e4, 1e4], [4.0, 9.0]), Jenkins(2e4, 60.0), slider + Polynomial([1e4])]
    first = swing(laws, 0.20, method)
    rest = integrate(heavy(laws), first.q[-1], first.q_dot[-1], 0.02 * 2 * np.pi / OMEGA, method=method,
                     memory=first.memory)  # fmt: skip
    assert len(rest.transitions) == 0
    way = rest.q[-1, 0] - first.q[-1, 0]
    np.testing.assert_allclose(rest.losses.slip, [way, 2.0 * way, 0.0, way], rtol=1e-12)


@METHODS
@pytest.mark.parametrize("kind", ["kept", "forgotten"])
def test_a_slider_beside_a_yielding_stop(kind, method):
    """What each takes alone, also while the stop is open."""
    stop, slider = WaltonBraun(1e4, 4e4, kind), Iwan([2e4, 1e4], [4.0, 9.0])
    for part in (0.1, 0.4, 0.9):
        both, other, one, two = swing([stop + slider, slider + stop, stop, slider], part, method).losses.loss
        assert both == pytest.approx(one + two, rel=1e-8)
        assert other == pytest.approx(both, rel=1e-10)
    taken = swing([slider + stop, slider], 0.9, method).losses.slip
    assert taken[0] == pytest.approx(taken[1], rel=1e-12)


def left_up(delta, delta_dot, way, slider, stiffness, limit):
    return limit - stiffness * (delta - slider)


def left_down(delta, delta_dot, way, slider, stiffness, limit):
    return limit + stiffness * (delta - slider)


def up(delta, delta_dot, way, slider, stiffness, limit):
    return 1.0, slider


def down(delta, delta_dot, way, slider, stiffness, limit):
    return -1.0, slider


def own_slider(slip):
    """Jenkins' element with a border for each direction; its second segment by name."""
    stick = Segment(pull, (Border(left_up, slip, up), Border(left_down, slip, down)))
    return memory_law("own slider", {"stick": stick, slip: SLIP}, LATCHED, reach=2e-3)(stiffness=2e4, limit=10.0)


@METHODS
def test_slip_of_a_law_of_ones_own(method):
    """That of the built-in law whichever border a slip begins at; none of a law without a segment of this name."""
    slider, stop = Jenkins(2e4, 10.0), WaltonBraun(1e4, 4e4)
    laws = [slider, own_slider("slip"), stop + own_slider("slip"), own_slider("creep")]
    for part in (0.3, 0.9, 2.2):
        slip = swing(laws, part, method).losses.slip
        np.testing.assert_allclose(slip[1:], [slip[0], slip[0], 0.0], rtol=1e-9)


@METHODS
def test_losses_wherever_the_run_ends(method):
    """Less what is stored then; smooth hysteresis along the same path."""
    wen, slider = BoucWen(2e4, 0.1, 1.0, 900.0, 300.0), Jenkins(2e4, 10.0)
    for part in (0.1, 0.3, 0.77):
        found = swing([wen, slider, Polynomial([1e4])], part, method).losses.loss
        t = np.linspace(0.0, part, 2001)
        path = X * np.sin(2.0 * np.pi * np.union1d(t, [x for x in (0.25, 0.75) if x < part]))
        for law, lost in zip((wen, slider), found, strict=False):
            *_, last = walk(law, path)
            assert lost == pytest.approx(work(law, path) - law.stored(path[-1], last.parameters), rel=1e-7, abs=1e-10)
        assert abs(found[2]) < 1e-10


def test_what_is_stored_at_the_start_is_no_gain():
    """A spring that lets go gives its energy back: neither gain nor loss; a stop closed at the start likewise."""
    found = swing([Polynomial([1e4]), PiecewiseLinear([1e4])], 0.25, Exponential(1e-10), q=X, v=0.0).losses.loss
    assert abs(found).max() < 1e-7 * 0.5 * 1e4 * X**2


@METHODS
def test_a_start_beyond_a_limit_stores_no_more_than_the_limit_holds(method):
    """Released from rest far beyond its limit a slider first sticks at once with the force at its limit."""
    laws = Jenkins(2e3, 1.0), Coulomb(1.0, 2e3), Jenkins(2e3, 1.0) + Iwan([100.0], [0.5])
    for law, lost, held in zip(laws, (1.0, 1.0, 1.5), (2.5e-4, 2.5e-4, 1.5e-3), strict=True):
        system = System.modal([5.0], [0.0], contacts=[Contact([1.0], law, always=True)])
        run = integrate(system, [0.93], [0.0], 0.5, method=method)
        energy = 0.5 * (25.0 * run.q[-1, 0] ** 2 + run.q_dot[-1, 0] ** 2)
        assert run.losses.loss[0] == pytest.approx(lost * (0.93 - run.q[-1, 0]), rel=2e-3 * lost)
        assert energy + run.losses.loss[0] + run.losses.stored[0] == pytest.approx(12.5 * 0.93**2, rel=1e-8)
        assert abs(run.losses.stored[0]) < held


@METHODS
@pytest.mark.parametrize(("speed", "lost"), [(0.0, 0.0), (-0.3, 0.0), (0.3, 0.75 * 0.5 * 1e3 * 1.8e-4)])
def test_a_start_inside_a_yielding_stop_stores_what_unloading_gives_back(method, speed, lost):
    """From δ = 10 mm with F = k₁ δ: F²/2k₂ comes back; further loading by δ̇ loses (1 - k₁/k₂) k₁ (δm² - δ²)/2."""
    system = System([[2.0]], [[0.0]], [[0.0]], contacts=[Contact([1.0], WaltonBraun(1e3, 4e3))])
    run = integrate(system, [-1e-2], [-speed], 0.5, method=method)
    assert run.losses.stored[0] == pytest.approx(-0.0125, rel=1e-8)
    assert run.losses.loss[0] == pytest.approx(lost, rel=1e-7, abs=1e-10)


def test_losses_of_stops_are_those_of_their_log():
    laws = [Hysteretic(2.1e6, 0.4), WaltonBraun(1e4, 4e4, "forgotten")]
    run = swing(laws, 3, Exponential(1e-10), [1e-3, 5e-4])
    for stop in (0, 1):
        logged = run.contacts.energy_loss[run.contacts.stop == stop]
        assert run.losses.loss[stop] == pytest.approx(logged.sum(), rel=1e-9)
    deepest = X - 5e-4
    assert run.losses.loss[1] == pytest.approx(3 * 0.5 * 1e4 * deepest**2 * 0.75, rel=2e-8)
    middle = swing(laws, 0.25, Exponential(1e-10), [1e-3, 5e-4])  # at rest in contact: what was lost on the way in
    assert middle.losses.loss[1] == pytest.approx(run.losses.loss[1] / 3.0, rel=1e-6)
    assert 0.0 < middle.losses.loss[0] < middle.contacts.energy_loss[0]


def test_nan_where_a_law_cannot_tell():
    run = swing([OWN, JENKINS, OWN], 0.3, Exponential(1e-9))
    assert np.isnan(run.losses.loss).tolist() == [True, False, True]
    assert np.isfinite(run.losses.history).all()


@METHODS
def test_the_balance_with_losses(method):
    """Given = stored in structure and elements + damping + losses; work by contact sums up to what contacts took."""
    laws = [Jenkins(50.0, 0.4), BoucWen(30.0, 0.1, 1.0, 2.0, 1.0), Iwan([30.0, 10.0], [0.1, 0.2])]
    rows = [[-1.0, -0.5], [-0.2, 0.9], [-1.0, 0.3]]
    contacts = [Contact(row, law, always=True) for row, law in zip(rows, laws, strict=True)]
    system = System.modal([1.0, 3.7], [0.02, 0.02], contacts, [([1.0, 0.3], fb.Harmonic(1.5, 1.3))])
    run = integrate(system, [0.0, 0.0], [0.5, 0.0], 20.0, dt=0.1, method=method)
    energy, held = run.energy, []
    np.testing.assert_allclose(run.losses.history.sum(axis=1), energy.contact, rtol=1e-12, atol=1e-12)
    for contact, latched in zip(contacts, run.memory, strict=True):
        row = contact.law.parameters
        row[list(contact.law.memory)] = latched
        held.append(contact.law.stored(float(-contact.direction @ run.q[-1]), row))
    taken = energy.initial + energy.input[-1] - energy.damping[-1] - energy.stored[-1] - sum(held)
    assert taken == pytest.approx(run.losses.loss.sum(), rel=1e-8)
    assert run.losses.loss.min() > 0.0
    np.testing.assert_allclose(run.losses.loss + held, run.losses.history[-1], rtol=1e-9, atol=1e-9)
    half = integrate(system, [0.0, 0.0], [0.5, 0.0], 20.0, method=method)
    np.testing.assert_allclose(half.losses.loss, run.losses.loss, rtol=1e-8)  # samples are not needed


def test_a_run_that_goes_on_loses_the_rest():
    laws = [Jenkins(2e4, 10.0), Iwan([2e4, 1e4], [4.0, 9.0])]
    contacts = [Contact([-1.0], law, always=True) for law in laws]
    system = System([[5.0]], [[0.3]], [[2e3]], contacts)
    whole = integrate(system, [0.0], [0.7], 0.5, method=DormandPrince(1e-11)).losses.loss
    first = integrate(system, [0.0], [0.7], 0.2, method=DormandPrince(1e-11))
    rest = integrate(system, first.q[-1], first.q_dot[-1], 0.3, method=DormandPrince(1e-11), memory=first.memory)
    np.testing.assert_allclose(first.losses.loss + rest.losses.loss, whole, rtol=1e-8)
    rough = integrate(system, [0.0], [0.7], 0.5, method=RK4(1e-4)).losses.loss
    np.testing.assert_allclose(rough, whole, rtol=1e-3)


def test_losses_in_print_csv_and_summary(tmp_path):
    damper, length = fb.Element(0.5, Jenkins(2e4, 0.05)), 0.5
    scene = fb.Scene(fb.Beam(length, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)], elements=[damper],
                     damping=fb.ModalDamping(0.01), base=fb.Harmonic(1e-4, 300.0))  # fmt: skip
    run = scene.reduce(2).simulate(0.1, 1e-3)
    again = fb.load(run.save(tmp_path / "run"))
    for one in (run, again):
        rows = [line.removeprefix("element at 0.5 m ").split() for line in str(one).splitlines()]
        row = next(row for row in rows if len(row) == 3 and row[0] != "work")
        taken = run.losses.work[0], run.losses.loss[0], run.losses.slip[0]
        assert [float(x) for x in row] == pytest.approx(taken, rel=1e-3)
        assert summary(one)["losses"]["slip"] == run.losses.slip.tolist()
        lines = one.to_csv(tmp_path, quantities=["work"])[0].read_text(encoding="utf-8").splitlines()
        assert lines[0] == "t [s],work element 0 [J]"
        assert float(lines[-1].split(",")[1]) == pytest.approx(run.losses.work[0], rel=1e-9)
