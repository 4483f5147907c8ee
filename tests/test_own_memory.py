"""A user's law with memory, made of plain functions: the same as a built-in one, and what is refused."""

import math
import pickle

import numpy as np
import pytest
from refusals import refused
from test_memory_laws import asked, borders, forces, renewal_slopes, renewed, with_memory

import solvers
from contacts import Border, Iwan, Jenkins, Polynomial, Segment, WaltonBraun, memory_law


def pull(delta, delta_dot, way, slider, stiffness, limit):
    """F = stiffness (δ - s)."""
    return stiffness * (delta - slider)


def left(delta, delta_dot, way, slider, stiffness, limit):
    return limit - abs(stiffness * (delta - slider))


def let_go(delta, delta_dot, way, slider, stiffness, limit):
    return math.copysign(1.0, delta - slider), slider


def drag(delta, delta_dot, way, slider, stiffness, limit):
    return way * limit


def onwards(delta, delta_dot, way, slider, stiffness, limit):
    return way * delta_dot


def hold(delta, delta_dot, way, slider, stiffness, limit):
    return 0, delta - way * limit / stiffness


def pull_slopes(delta, delta_dot, way, slider, stiffness, limit):
    return stiffness, 0, 0.0, -stiffness


STICK, SLIP = Segment(pull, Border(left, "slip", let_go)), Segment(drag, Border(onwards, "stick", hold))
LATCHED = {"way": 0.0, "slider": 0.0}
friction = memory_law("friction", {"stick": STICK, "slip": SLIP}, LATCHED, reach=2e-3)
OWN, JENKINS = friction(stiffness=2e4, limit=10.0), Jenkins(2e4, 10.0)


def test_it_is_the_built_in_law():
    path = 2e-3 * np.random.default_rng(1).uniform(-1.0, 1.0, 100)
    for own in (OWN, mistaken()()):
        np.testing.assert_allclose(own.along(path), JENKINS.along(path), rtol=1e-13, atol=1e-13)
    assert (OWN.memory, OWN.borders, OWN.events) == ((0, 1, 2), 1, ("stick", "slip"))
    assert not OWN.one_sided
    both = OWN + JENKINS + Polynomial([1e3])
    np.testing.assert_allclose(both.along(path), 2.0 * JENKINS.along(path) + 1e3 * path, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("numbers", [(0.0, 0.0, 1e-4), (1.0, 1.0, 1e-4), (1.0, -1.0, 0.0)])
@pytest.mark.parametrize("slopes", [None, pull_slopes])
def test_kernels(numbers, slopes):
    segments = {"stick": Segment(pull, Border(left, "slip", let_go), slopes), "slip": SLIP}
    law = memory_law("friction", segments, LATCHED, reach=2e-3)(stiffness=2e4, limit=10.0)
    row = with_memory(law, *numbers)
    code, way, slider = numbers
    d, v = [3e-4, -2e-4], [0.1, -0.3]
    force = [way * 10.0] * 2 if code else [2e4 * (x - slider) for x in d]
    np.testing.assert_allclose(forces(law, d, v, row), force, rtol=1e-14)
    value = [way * x for x in v] if code else [10.0 - abs(x) for x in force]
    np.testing.assert_allclose(borders(law, d, v, row)[0], value, rtol=1e-14)
    k = 0.0 if code else 2e4
    np.testing.assert_allclose(asked(law, "gradient", 3, d, v, row), [[k] * 2, [0.0] * 2, [0.0] * 2], rtol=1e-7)
    by_way = 10.0 if code else 0.0
    found = asked(law, "memory_gradient_address", 3, d, v, row)
    np.testing.assert_allclose(found, [[0.0] * 2, [by_way] * 2, [-k] * 2], rtol=1e-7)
    event, after = renewed(law, 0, d[0], v[0], row)
    assert law.events[event] == ("stick" if code else "slip")
    expected = [0.0, 0.0, d[0] - way * 10.0 / 2e4] if code else [1.0, 1.0, slider]
    np.testing.assert_allclose(after[:3], expected, rtol=1e-14)
    table = np.zeros((3, 5))
    if code:
        table[2, [0, 3]] = 1.0, -10.0 / 2e4
    else:
        table[2, 4] = 1.0
    np.testing.assert_allclose(renewal_slopes(law, 0, d[0], v[0], row), table, rtol=1e-7, atol=1e-12)
    same = np.diag([0.0, 1.0, 1.0])
    np.testing.assert_array_equal(renewal_slopes(law, -1, d[0], v[0], row), np.hstack((np.zeros((3, 2)), same)))


def spring_back(delta, delta_dot, peak, stiffness):
    """F = stiffness δ³/peak²."""
    return stiffness * delta**3 / peak**2


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_derivatives_of_any_size_of_motion(size):
    """Steps of differences go with the reach: those for millimetres were 1 % of a peak of 100 nm."""
    law = memory_law("foam", {"unload": Segment(spring_back)}, {"peak": 1e-4 * size}, reach=1e-3 * size)(stiffness=2e4)
    d = [0.8e-4 * size, 0.3e-4 * size]
    by_delta, by_peak = np.array([3.0, -2.0])[:, None] * 2e4 * np.array([0.8, 0.3]) ** [[2], [3]]
    np.testing.assert_allclose(asked(law, "gradient", 3, d, [0.0, 0.0], law.parameters)[0], by_delta, rtol=1e-8)
    found = asked(law, "memory_gradient_address", 2, d, [0.0, 0.0], law.parameters)[1]
    np.testing.assert_allclose(found, by_peak, rtol=1e-8)


def test_it_travels_and_tells_of_itself():
    assert pickle.loads(pickle.dumps(OWN)) == OWN
    assert "friction: stick: F = stiffness (δ - s).; slip: drag" in OWN.describe()
    assert "stiffness = 20000, limit = 10" in OWN.describe()
    assert f"loses {4 * 10.0 * (2e-3 - 5e-4):.6g} J" in OWN.describe()
    assert math.isnan(OWN.stored(1e-3, OWN.parameters))


SCALE = 1e4


def scaled(delta, delta_dot):
    return SCALE * delta


def test_it_is_of_what_it_read_when_it_was_bound(monkeypatch):
    maker = memory_law("scaled", {"always": Segment(scaled)})
    before = maker()
    monkeypatch.setitem(globals(), "SCALE", 3e4)
    after = maker()
    for one, stiffness in ((before, 1e4), (after, 3e4)):
        assert one.along([1e-3])[0] == pytest.approx(1e-3 * stiffness, rel=1e-12)
        found = asked(one, "gradient", 3, np.array([1e-3]), np.array([0.0]), one.parameters)[0]
        assert found[0] == pytest.approx(stiffness, rel=1e-8)
    assert pickle.loads(pickle.dumps(after)) == after
    with pytest.raises(pickle.PicklingError, match=r"law 'scaled' cannot be pickled"):
        pickle.dumps(before)


def nothing(delta, delta_dot, dent, k1, k2):
    return 0


def load(delta, delta_dot, dent, k1, k2):
    return k1 * delta


def unload(delta, delta_dot, dent, k1, k2):
    return k2 * (delta - dent)


def touch(delta, delta_dot, dent, k1, k2):
    return dent - delta


def turn(delta, delta_dot, dent, k1, k2):
    return delta_dot


def dented(delta, delta_dot, dent, k1, k2):
    return delta * (1.0 - k1 / k2)


def inside(delta, delta_dot, dent, k1, k2):
    return delta - dent


def below_first(delta, delta_dot, dent, k1, k2):
    return dent * k2 / (k2 - k1) - delta


def test_a_stop_of_several_borders_that_opens():
    stop = memory_law(
        "dented stop",
        {
            "open": Segment(nothing, Border(touch, "again")),
            "load": Segment(load, Border(turn, "again", dented)),
            "again": Segment(unload, (Border(inside, "open"), Border(below_first, "load"))),
        },
        {"dent": 0.0},
        opens=True,
    )
    own, given = stop(k1=1e5, k2=4e5), WaltonBraun(1e5, 4e5)
    assert (own.opens, own.one_sided, own.borders, own.memory) == (True, True, 2, (0, 1))
    path = 2e-3 * np.random.default_rng(2).uniform(-0.5, 1.0, 200)
    np.testing.assert_allclose(own.along(path), given.along(path), rtol=1e-11, atol=1e-11)


def soft(delta, delta_dot, k):
    return k * delta


def hard(delta, delta_dot, k):
    return 3.0 * k * delta


def below(delta, delta_dot, k):
    return -delta


def above(delta, delta_dot, k):
    return delta


def test_segments_alone_may_be_passed_at_one_place():
    segments = {f"s{i}": Segment(soft, Border(below, f"s{i + 1}")) for i in range(6)}
    law = memory_law("row", {**segments, "s6": Segment(hard, Border(above, "s0"))})(k=1e3)
    np.testing.assert_allclose(law.along([-1.0, 1.0, -0.5]), [-1e3, 3e3, -500.0], rtol=1e-14)


def test_sliders_that_slip_and_stick_together_are_not_refused():
    path = 2e-3 * np.random.default_rng(3).uniform(-1.0, 1.0, 60)
    all_at_once = Iwan([2e4] * 30, [10.0 + 1e-13 * j for j in range(30)])
    np.testing.assert_allclose(all_at_once.along(path), 30.0 * JENKINS.along(path), rtol=1e-10, atol=1e-9)


def pulls(delta, delta_dot, way, slider, stiffness, limit, real, inner, sense, never, latch, held):
    """The pull of `friction`; no number unless ``real`` is positive."""
    return stiffness * (delta - slider) * math.sqrt(real)


def leaves(delta, delta_dot, way, slider, stiffness, limit, real, inner, sense, never, latch, held):
    return inner * (limit - abs(stiffness * (delta - slider)))


def lets_go(delta, delta_dot, way, slider, stiffness, limit, real, inner, sense, never, latch, held):
    return math.copysign(1.0, delta - slider), slider


def drags(delta, delta_dot, way, slider, stiffness, limit, real, inner, sense, never, latch, held):
    return way * limit


def goes_on(delta, delta_dot, way, slider, stiffness, limit, real, inner, sense, never, latch, held):
    return sense * way * delta_dot - never


def holds(delta, delta_dot, way, slider, stiffness, limit, real, inner, sense, never, latch, held):
    return (1.0 - latch) * way, (1.0 - latch) * slider + latch * (delta - held * way * limit / stiffness)


def mistaken(jumps=False, **wrong):
    """Makes `friction` with a mistake: by parameters, so that one law is compiled for all of them."""
    right = {"real": 1.0, "inner": 1.0, "sense": 1.0, "never": 0.0, "latch": 1.0, "held": 1.0}
    stick = Segment(pulls, Border(leaves, "slip", lets_go))
    slip = Segment(drags, Border(goes_on, "stick", holds))
    law = memory_law("mine", {"stick": stick, "slip": slip}, LATCHED, jumps=jumps)
    return lambda: law(stiffness=2e4, limit=10.0, **{**right, **wrong})


def bad_arguments(delta, delta_dot, stiffness):
    return 0.0


def no_number(delta, delta_dot, way, slider, stiffness, limit):
    return "strong"


def wrong_slopes(delta, delta_dot, way, slider, stiffness, limit):
    return stiffness, 0, 0.0, -1.01 * stiffness


def few_slopes(delta, delta_dot, way, slider, stiffness, limit):
    return stiffness, 0.0


def let_go_alone(delta, delta_dot, way, slider, stiffness, limit):
    return way


def left_below(delta, delta_dot, way, slider, stiffness, limit):
    return limit - abs(stiffness * (delta - slider)) if delta < 1e-4 else math.nan


def left_slowly(delta, delta_dot, way, slider, stiffness, limit):
    return limit - abs(stiffness * (delta - slider)) if abs(delta_dot) < 0.1 else math.nan


def made(stick=STICK, slip=SLIP, **options):
    return lambda: memory_law("mine", {"stick": stick, "slip": slip}, LATCHED, **options)(stiffness=2e4, limit=10.0)


def sticks(force, renew=let_go, *slopes):
    """The law with another segment of sticking."""
    return made(stick=Segment(force, Border(left, "slip", renew), *slopes))


TURNS = (
    "border 'goes_on' of segment 'slip' of mine falls to zero again and again at δ = {}, in turn with border 'leaves'"
)
MISTAKES = [
    (mistaken(held=0.5), "force of law 'mine' jumps by -5 N from 'slip' to 'stick'"),
    (mistaken(held=1.5, jumps=True), TURNS.format("0.00.*")),
    (mistaken(latch=0.0, jumps=True), "falls to zero again and again at δ = 0.00"),
    # these meet a border at distances of rounding, so that the path goes on, without an end
    (mistaken(sense=-1.0), TURNS.format("0.0005 m, δ̇ > 0")),
    (mistaken(inner=-1.0), TURNS.format("1e-05 m, δ̇ < 0") + ".* Check the sign of these borders"),
    (mistaken(sense=0.0, never=1.0), TURNS.format("0.0005 m, δ̇ > 0")),
    (mistaken(real=-1.0), "force of mine is nan N at δ = "),
    (made(stick=Segment(pull, Border(left_below, "slip", let_go))), "force of mine is nan N at δ = 0.0001 m"),
    (made(slip=Segment(drag, Border(onwards, "stuck", hold))), "law 'mine': 'slip' ends in 'stuck'; its segments are"),
    (sticks(pull, let_go, wrong_slopes), "slope of segment 'stick' .* slider is -20200 at δ = .* differences.* -20000"),
    (made(reach=0.0), "reach of law 'mine' must be finite and > 0, got 0.0"),
    (lambda: memory_law("mine", {}), "segments of law 'mine' must be contacts.Segment by name, at least one"),
    (
        lambda: memory_law("mine", {"stick": STICK}, {"way": math.nan}),
        "start of latched 'way' of law 'mine' must be finite",
    ),
]


test_mistakes_get_a_sentence = refused(*MISTAKES)


test_functions_that_do_not_fit = refused(
    (made(slip=Segment(bad_arguments)), "must take the same arguments, but 'pull' takes .* and 'bad_arguments'"),
    (
        lambda: memory_law("mine", {"a": Segment(bad_arguments)}, LATCHED),
        "must take .delta, delta_dot, way, slider, par",
    ),
    (sticks(no_number), "law with memory 'no_number' .* cannot be compiled"),
    (sticks(pull, let_go, few_slopes), "slopes of segment 'stick' of law 'mine' must return 4 numbers, got 2"),
    (sticks(pull, let_go_alone), "renew 'let_go_alone' of law 'mine' must return as many .* as are latched, 2, got 1"),
    (lambda: friction(stiffness=1.0), "law 'friction': missing a required argument: 'limit'"),
    (lambda: friction(stiffness=1.0, limit=1.0, mass=2.0), "law 'friction': unexpected 'mass'"),
    error=TypeError,
)


def raising(delta, delta_dot, way, slider, stiffness, limit):
    if delta > 1e9:
        raise ValueError
    return 0.0, delta - way * limit / stiffness


def test_a_renewal_that_raises_gives_nan():
    law = made(slip=Segment(drag, Border(onwards, "stick", raising)))()
    _, after = renewed(law, 0, 2e9, 0.1, with_memory(law, 1.0, 1.0, 0.0))
    assert np.isnan(after[1:3]).all()


@pytest.mark.parametrize("method", [solvers.Exponential(), solvers.DormandPrince()])
def test_a_border_that_is_not_a_number_ends_the_run(method):
    """`Exponential` took it for one that is never met: "finished", and stuck for ever."""
    law = made(stick=Segment(pull, Border(left_slowly, "slip", let_go)))()
    body = solvers.System([[2.0]], [[0.0]], [[0.0]], [solvers.Contact([1.0], law, always=True)])
    assert solvers.integrate(body, [0.0], [0.05], 0.01, method=method).status.good
    with pytest.raises(solvers.SolverError, match="not finite"):
        solvers.integrate(body, [0.0], [0.5], 0.01, method=method)
