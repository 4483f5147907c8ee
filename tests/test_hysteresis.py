"""Loops of laws with memory along given paths: rationals, Masing's rules, an independent integration, energies."""

from fractions import Fraction as Q
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fembeam as fb
from contacts import BoucWen, Coulomb, ElastoPlastic, Hertz, Iwan, Jenkins, KelvinVoigt, Polynomial, WaltonBraun
from contacts.path import walk, work

STIFFNESS, LIMITS = (Q(20000), Q(10000), Q(5000), Q(7000)), (Q(10), Q(15), Q(20), Q(7))
FOUR = Iwan([float(k) for k in STIFFNESS], [float(f) for f in LIMITS])


def rational_forces(path):
    """Sliders moved point by point: exact, as a monotone step ends where it would in many."""
    sliders, forces = [Q(0)] * 4, []
    for d in path:
        parts = [max(-f, min(f, k * (d - s))) for k, f, s in zip(STIFFNESS, LIMITS, sliders, strict=True)]
        sliders = [d - part / k for k, part in zip(STIFFNESS, parts, strict=True)]
        forces.append(sum(parts))
    return forces


def first_loading(d):
    return sum(min(k * d, f) for k, f in zip(STIFFNESS, LIMITS, strict=True))


@pytest.mark.parametrize("seed", range(2))
def test_random_paths_are_those_of_rational_sliders(seed):
    steps = np.random.default_rng(seed).integers(-80, 81, 60).tolist()
    path = [Q(x, 10000) for x in steps]
    expected = [float(f) for f in rational_forces(path)]
    np.testing.assert_allclose(FOUR.along([float(d) for d in path]), expected, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("x", [5, 12, 20, 33, 70])
def test_area_of_a_loop_is_a_rational(x):
    amplitude = Q(x, 10000)
    slipping = [(k, f) for k, f in zip(STIFFNESS, LIMITS, strict=True) if amplitude > f / k]
    area = sum((4 * f * (amplitude - f / k) for k, f in slipping), Q(0))
    X = float(amplitude)
    assert work(FOUR, [0.0, X, -X, X]) - work(FOUR, [0.0, X]) == pytest.approx(float(area), rel=1e-12, abs=1e-15)


def test_branches_are_twice_the_first_loading():
    """Masing: from X on F(δ) = F(X) - 2 F_1((X - δ)/2), and the other way round."""
    X, points = Q(60, 10000), [Q(60 - j, 10000) for j in range(0, 121, 3)]
    down = [float(first_loading(X) - 2 * first_loading((X - d) / 2)) for d in points]
    found = FOUR.along([float(X), *map(float, points), *map(float, points[::-1])])[1:]
    np.testing.assert_allclose(found[: len(points)], down, rtol=1e-12, atol=1e-11)
    np.testing.assert_allclose(found[len(points) :], -np.array(down), rtol=1e-12, atol=1e-11)


def test_a_loop_that_closes_is_forgotten():
    plain = FOUR.along([7e-3, -2e-3, -6e-3])
    inner = FOUR.along([7e-3, -2e-3, 1e-3, -1e-3, 0.0, -1e-3, 1e-3, -2e-3, -6e-3])
    assert inner[-2:] == pytest.approx(plain[-2:], rel=1e-12)


def test_uniform_limits_tend_to_a_parabola():
    k, f, N = 1e4, 10.0, 8
    law = Iwan.uniform(k, f, N)
    assert (sum(law.stiffness), sum(law.limits)) == (pytest.approx(k, rel=1e-14), pytest.approx(f, rel=1e-14))
    d = np.linspace(0.0, 2.0 * f / k, 50 * N + 1)
    gap = k * d * (1.0 - k * d / (4.0 * f)) - law.along(d)
    assert np.abs(gap).max() == pytest.approx(f / (4 * N**2), rel=1e-9)
    assert law.along([(2.0 - 1.0 / N) * f / k])[0] == pytest.approx(f, rel=1e-14)


def test_a_backbone_is_passed_through():
    d, f = np.array([1e-3, 2e-3, 3e-3, 5e-3]), np.array([10.0, 16.0, 22.0, 24.0])
    law = Iwan.from_backbone(d, f, slope=500.0)
    assert len(law.sliders) == 3  # the bend at 2e-3 is none
    np.testing.assert_allclose(law.along(d), f, rtol=1e-12)
    np.testing.assert_allclose(law.along([0.0, 2.5e-3, 7e-3]), [0.0, 19.0, 25.0], rtol=1e-12, atol=1e-12)
    assert Iwan.from_backbone(np.append(0.0, d), np.append(0.0, f), 500.0) == law


def test_hardening_moves_the_elastic_range():
    k, fy, h = 2e4, 10.0, 5e3
    law = ElastoPlastic(k, fy, h)
    X = 3e-3
    top = fy + h * (X - fy / k)
    found = law.along([fy / k, X, X - 2 * fy / k, -X])
    np.testing.assert_allclose(found, [fy, top, top - 2 * fy, -top], rtol=1e-12)
    assert law.along([X, X - fy / k])[1] == pytest.approx(top - fy, rel=1e-12)


def test_static_friction_drops_to_the_kinetic():
    law, k = Coulomb(10.0, 2e4, 12.0), 2e4
    path = np.array([11.9, 12.1, 20.0, 0.0, -1.9, -2.1]) / k
    # stuck again at 20 N/k with s = 10 N/k: slips back at -12 N, that is -2 N/k
    np.testing.assert_allclose(law.along(path), [11.9, 10.0, 10.0, -10.0, -11.9, -10.0], rtol=1e-12)


PATH = np.array([0.0, 1.0, -0.7, 1.4, -1.6, 0.2, -0.5, 2.0, -2.2, 0.9, 0.1, 0.6])  # ten reversals
SHAPES = [(0.6, 0.3), (0.6, -0.5), (0.3, 0.6)]  # γ > 0, γ < 0, γ > β
UNUSUAL = [(0.5, 0.5), (0.5, -0.5), (0.5, -0.8), (-0.2, 0.7), (0.0, 0.5), (0.4, 0.0), (0.0, 0.0)]


def integrated(n, A, beta, gamma, path, points=3):
    """z at points of every run by an independent integration of dz/dδ, piece by piece between zeros of z."""
    z, out, d = 0.0, [], path[0]
    zero = lambda x, y: y[0]  # noqa: E731
    zero.terminal = True
    for end in path[1:]:
        up = np.sign(end - d)
        for goal in np.linspace(d, end, points + 1)[1:]:
            while d != goal:
                side = up if z == 0.0 else np.sign(z)
                slope = lambda x, y, s=side: A - np.abs(y) ** n * (gamma + beta * up * s)  # noqa: B023, E731
                zero.direction = -side
                done = solve_ivp(slope, (d, goal), [z], "DOP853", rtol=2.3e-14, atol=1e-17, events=zero)
                d, z = done.t[-1], 0.0 if done.status == 1 else done.y[0, -1]
            out.append(z)
    return np.array(out)


def refined(path, points=3):
    return np.concatenate([[path[0]], *(np.linspace(a, b, points + 1)[1:] for a, b in pairwise(path))])


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize(("beta", "gamma"), SHAPES)
def test_bouc_wen_through_ten_reversals(n, beta, gamma):
    expected = integrated(n, 1.3, beta, gamma, PATH)
    law = BoucWen(7.0, 0.0, 1.3, beta, gamma, n)
    np.testing.assert_allclose(law.along(refined(PATH))[1:] / 7.0, expected, rtol=1e-12, atol=1e-12)
    both = BoucWen(7.0, 0.25, 1.3, beta, gamma, n).along(refined(PATH))[1:]
    np.testing.assert_allclose(both, 7.0 * (0.25 * refined(PATH)[1:] + 0.75 * expected), rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("n", [1, 2])
@pytest.mark.parametrize(("beta", "gamma"), UNUSUAL)
def test_bouc_wen_of_unusual_shape(n, beta, gamma):
    """Without a bound, quasi-linear, without dissipation, linear; over a path too short for a pole."""
    path = 0.4 * PATH
    law = BoucWen(1.0, 0.0, 1.0, beta, gamma, n)
    expected = integrated(n, 1.0, beta, gamma, path)
    np.testing.assert_allclose(law.along(refined(path))[1:], expected, rtol=1e-11, atol=1e-11)


def test_bouc_wen_beyond_its_pole_is_refused():
    law = BoucWen(1.0, 0.0, 1.0, 0.5, -1.5, 2)  # z = tan δ
    assert law.along([1.5])[0] == pytest.approx(np.tan(1.5), rel=1e-13)
    with pytest.raises(ValueError, match=r"force of BoucWen is nan N at δ = 1\.6 m"):
        law.along([1.6])


@pytest.mark.parametrize("n", [1, 2])
def test_bouc_wen_saturates(n):
    law = BoucWen(1.0, 0.0, 1.0, 0.75, 0.25, n)
    down = law.along([60.0, -60.0, -59.0, 60.0])
    np.testing.assert_allclose(down[[0, 1, 3]], [1.0, -1.0, 1.0], rtol=1e-14)
    assert law.bound == 1.0


def test_loops_of_bouc_wen_within_a_loop_do_not_close():
    law = BoucWen(1.0, 0.0, 1.0, 0.6, 0.3)
    turns = law.along([2.0, 0.5, 1.0, 0.5, 1.0, 0.5, 1.0])[2::2]
    assert np.all(np.diff(turns) > 1e-3)  # it creeps up, ever more slowly
    assert np.all(np.diff(turns, 2) < 0.0)
    closed = FOUR.along([7e-3, -2e-3, 1e-3, -2e-3, 1e-3, -2e-3, 1e-3])[2::2]
    assert np.ptp(closed) < 1e-12


@pytest.mark.parametrize(
    "law", [FOUR, Jenkins(2e4, 10.0), ElastoPlastic(2e4, 10.0, 4e3), BoucWen(2e4, 0.1, 1.0, 1e3, 4e2)]
)
def test_what_is_lost_is_never_negative(law):
    """Work along a path less what is stored at its end grows."""
    path = law.reach * PATH
    lost = []
    for end in range(2, path.size + 1):
        *_, last = walk(law, path[:end])
        lost.append(work(law, path[:end]) - law.stored(path[end - 1], last.parameters))
    assert np.all(np.diff(lost) > -1e-12)
    assert lost[-1] > lost[0] > 0.0


K1, K2 = 1e5, 4e5


@pytest.mark.parametrize("law", [WaltonBraun(K1, K2), WaltonBraun(K1, K2, "forgotten")])
def test_first_blow_on_a_yielding_stop(law):
    X = 1e-3
    rest = X * (1.0 - K1 / K2)
    path = [-1e-3, 0.0, 4e-4, X, X - 1e-4, rest, rest - 1e-5, -1e-4]
    np.testing.assert_allclose(law.along(path), [0, 0, 40, 100, 60, 0, 0, 0], rtol=1e-12, atol=1e-10)
    given, back = work(law, [0.0, X]), work(law, [0.0, X]) - work(law, [0.0, X, 0.0])
    assert np.sqrt(back / given) == pytest.approx(law.exact_restitution(1.0, 1.0), rel=1e-12)
    speed = X * np.sqrt(K1 / 0.03)  # ½ m v² = ½ k₁ X²
    assert law.permanent_set(speed, 0.03) == pytest.approx(rest, rel=1e-12)


def test_set_kept_and_forgotten():
    X, rest = 1e-3, 7.5e-4
    second = [X, -1e-3, 5e-4, 8e-4, X, 1.5e-3, -1e-3, 9e-4]
    kept, forgotten = (WaltonBraun(K1, K2, how).along(second) for how in ("kept", "forgotten"))
    np.testing.assert_allclose(kept, [100, 0, 0, 20, 100, 150, 0, 0], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(forgotten, [100, 0, 50, 80, 100, 150, 0, 90], rtol=1e-12, atol=1e-9)
    above = [X, rest - 1e-4, 8e-4, X, 1.2e-3]  # back before δ < 0: not forgotten yet
    for how in ("kept", "forgotten"):
        found = WaltonBraun(K1, K2, how).along(above)
        np.testing.assert_allclose(found, [100, 0, 20, 100, 120], rtol=1e-12, atol=1e-9)


def test_an_elastic_stop_of_two_equal_slopes():
    path = 1e-3 * PATH
    np.testing.assert_allclose(WaltonBraun(K1, K1).along(path), np.maximum(K1 * path, 0.0), rtol=1e-12, atol=1e-10)


def test_a_sum_is_that_of_its_parts_along_any_path():
    path = 4e-3 * np.random.default_rng(5).uniform(-1.0, 1.0, 200)
    parts = [FOUR, Jenkins(3e4, 8.0), BoucWen(1e4, 0.1, 1.0, 600.0, 200.0, 2), Polynomial([1e3, 0.0, 1e8])]
    both = parts[0] + parts[1] + parts[2] + parts[3]
    np.testing.assert_allclose(both.along(path), sum(part.along(path) for part in parts), rtol=1e-11, atol=1e-11)


def test_laws_of_stops_act_in_contact_beside_one_with_memory():
    path = 2e-3 * np.random.default_rng(6).uniform(-1.0, 1.0, 200)
    hertz = Hertz(1e8)
    slider = Jenkins(3e4, 8.0)
    expected = slider.along(path) + hertz.force(path)
    np.testing.assert_allclose((slider + hertz).along(path), expected, rtol=1e-11, atol=1e-11)
    stop, soft = WaltonBraun(K1, K2), KelvinVoigt(1e4, 20.0)
    found = (stop + soft).along(path)
    np.testing.assert_allclose(found, stop.along(path) + np.maximum(1e4 * path, 0.0), rtol=1e-11, atol=1e-10)


def test_a_path_may_rest_repeat_and_begin_beyond_the_limit():
    law = Jenkins(2e4, 10.0)
    assert law.along([0.0]).tolist() == [0.0]
    assert law.along([2e-4, 2e-4, 2e-4]).tolist() == [4.0] * 3
    np.testing.assert_allclose(law.along([0.0, 1e-3, 1e-3, 9e-4, 9e-4]), [0, 10, 10, 8, 8], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(law.along([-1e-3, 0.0]), [-10.0, 10.0], rtol=1e-12)
    np.testing.assert_allclose(law.along([-1e-3] * 2), [-10.0] * 2, rtol=1e-12)


def test_points_do_not_change_a_path():
    rng = np.random.default_rng(7)
    law = FOUR + BoucWen(1e4, 0.0, 1.0, 600.0, 200.0)
    path = 5e-3 * PATH
    fine = np.sort(rng.uniform(0.0, path.size - 1.0, 500))
    fine = np.union1d(fine, np.arange(path.size))
    dense = law.along(np.interp(fine, np.arange(path.size), path))
    np.testing.assert_allclose(dense[np.isin(fine, np.arange(path.size))], law.along(path), rtol=1e-10, atol=1e-10)


def test_a_figure_of_loops():
    wen = BoucWen(2e4, 0.1, 1.0, 1e3, 4e2)
    figure = fb.plot.hysteresis({"four": FOUR, "smooth": wen})
    lines = [line for line in figure.axes[0].lines if len(line.get_xdata()) > 2]
    assert [line.get_label() for line in lines] == ["four", "smooth"]
    d, force = lines[1].get_data()
    assert np.abs(d).max() == pytest.approx(1e3 * wen.reach, rel=1e-12)
    np.testing.assert_allclose(force, wen.along(1e-3 * np.asarray(d)), rtol=1e-9, atol=1e-9)
    stop = fb.plot.hysteresis({"stop": WaltonBraun(K1, K2)}, path=[-1e-4, 1e-3, 0.0])
    assert stop.axes[0].lines[0].get_ydata().max() == pytest.approx(100.0, rel=1e-9)
    with pytest.raises(ValueError, match="there is no path for a law without a size of its own"):
        fb.plot.hysteresis({"stop": WaltonBraun(K1, K2)})
    with pytest.raises(ValueError, match="nothing to draw"):
        fb.plot.hysteresis({})
