import dataclasses
import math
import pickle
import tracemalloc
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refused
from scipy.interpolate import BPoly

from fembeam import LumpedMass
from fembeam.excitation import BandNoise, Harmonic, Multisine, Record, RollOff
from fembeam.statistics import Estimate, moments

BROAD = (0.0, 1226.6)
NARROW = (144.5, 270.2)


def summed(omega, amplitude, t, order=0):
    """Value of Re Σ amplitude (i omega)^order exp(i omega t), term by term."""
    return sum((a * (1j * w) ** order * np.exp(1j * w * t)).real for w, a in zip(omega, amplitude, strict=True))


def hermite(dt, values):
    """The quintic through the nodes, by SciPy."""
    return BPoly.from_derivatives(dt * np.arange(len(values)), values)


# harmonic and multisine


@pytest.mark.parametrize("order", range(6))
def test_harmonic_derivatives_are_exact(order):
    y = Harmonic(1.3e-3, 195.0, 0.4)
    t = np.linspace(0.0, 0.2, 50).reshape(5, 10)
    exact = 1.3e-3 * 195.0**order * np.cos(195.0 * t + 0.4 + order * np.pi / 2)
    np.testing.assert_allclose(y.derivative(order)(t), exact, rtol=0, atol=1e-13 * 195.0**order)


def test_second_derivative_of_a_harmonic_keeps_its_phase():
    assert Harmonic(2.0, 3.0, 0.5).derivative(2) == Harmonic(-18.0, 3.0, 0.5)


def test_a_constant_has_no_derivative():
    assert Harmonic(2.0, 0.0)(7.0) == 2.0
    assert Harmonic(2.0, 0.0).derivative(1)(7.0) == 0.0


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize(
    "signal", [Harmonic(0.3, 7.0, 1.1), Multisine([1.0, -2.0, 0.5], [0.0, 7.0, 31.0], [0.1, 2.0, -1.0])]
)
def test_tones_are_the_signal(signal, order):
    t = np.linspace(0.0, 3.0, 101)
    omega, amplitude = signal.derivative(order).tones()
    assert omega.dtype == np.float64
    assert amplitude.dtype == np.complex128
    scale = np.abs(amplitude).sum()
    np.testing.assert_allclose(summed(omega, amplitude, t), signal.derivative(order)(t), atol=1e-13 * scale)
    first = signal.tones()
    np.testing.assert_allclose(summed(*first, t, order), signal.derivative(order)(t), atol=1e-13 * scale)
    assert signal.for_duration(1e9) is signal


def test_multisine_is_a_value_and_leaves_the_arrays_alone():
    amplitude, omega = np.array([1.0, 2.0]), np.array([3.0, 4.0])
    y = Multisine(amplitude, omega)
    assert y == Multisine([1.0, 2.0], [3.0, 4.0], [0.0, 0.0])
    assert hash(y) == hash(Multisine([1.0, 2.0], [3.0, 4.0]))
    assert y != Multisine([1.0, 2.0], [3.0, 5.0])
    amplitude[0] = 9.0
    assert y(0.0) == 3.0
    with pytest.raises(ValueError, match="read-only"):
        y.omega[0] = 1.0
    assert omega.flags.writeable


test_bad_tones = refused(
    (lambda: Harmonic(math.nan, 1.0), "Harmonic amplitude must be finite, got nan"),
    (lambda: Harmonic(1.0, -1.0), r"Harmonic omega \(rad/s\) must be finite of at least 0, got -1.0"),
    (lambda: Harmonic("big", 1.0), "Harmonic amplitude must be a number, got 'big'"),
    (lambda: Harmonic(1e-3, "195"), r"omega \(rad/s\) must be a number, got '195'"),
    (lambda: Harmonic(1.0, 1.0).derivative(-1), "order of the derivative .* got -1"),
    (lambda: Multisine([1.0], [1.0, 2.0]), r"one length >= 1, got lengths \(1, 2, 2\)"),
    (lambda: Multisine([], []), r"one length >= 1, got lengths \(0, 0, 0\)"),
    (lambda: Multisine([1.0, 1.0], [1.0, -2.0]), "omega must be at least 0 rad/s, got -2 at index 1"),
    (lambda: Multisine([1.0, math.inf], [1.0, 2.0]), "amplitude must be finite, got inf at index 1"),
    (lambda: Multisine([[1.0]], [[1.0]]), r"one dimension, got shape \(1, 1\)"),
)


# band-limited noise


@pytest.mark.parametrize("band", [BROAD, NARROW, (351.9, 477.5)])
@pytest.mark.parametrize("period", [None, 12.34])
def test_sample_variance_is_the_square_of_std(band, period):
    noise = BandNoise(1.7e-3, band, seed=3, period=period)
    _, y = noise.series()
    assert abs(np.mean(y**2) / 1.7e-3**2 - 1) < 1e-12
    assert abs(y.mean()) < 1e-15
    assert abs(noise.rms / 1.7e-3 - 1) < 1e-12


def test_spectrum_is_flat_in_the_band_and_empty_outside():
    noise = BandNoise(1e-3, NARROW, seed=5)
    t, y = noise.series()
    spacing = 2 * np.pi / noise.period
    omega = spacing * np.arange(y.size // 2 + 1)
    density = 2 * np.abs(np.fft.rfft(y) / y.size) ** 2 / spacing  # one-sided, per rad/s
    inside = (omega >= NARROW[0] - 1e-6) & (omega <= NARROW[1] + 1e-6)
    level = 1e-6 / (NARROW[1] - NARROW[0])
    np.testing.assert_allclose(density[inside], level, rtol=1 / inside.sum())  # n lines fill n +- 1 spacings
    np.testing.assert_allclose(density[inside], noise.psd_at(200.0), rtol=1e-9)
    assert density[~inside].max() < 1e-20 * level
    assert inside.sum() == noise.omega.size
    assert noise.psd_at([100.0, 300.0]).tolist() == [0.0, 0.0]
    assert t[1] * y.size == pytest.approx(noise.period, rel=1e-14)


def test_second_derivative_agrees_with_the_motion_line_by_line():
    noise = BandNoise(1e-3, BROAD, seed=2)
    _, y = noise.series()
    _, y_ddot = noise.derivative(2).series()
    omega = 2 * np.pi / noise.period * np.arange(y.size // 2 + 1)
    lines, from_y = np.fft.rfft(y_ddot), -(omega**2) * np.fft.rfft(y)
    inside = omega <= BROAD[1]  # beyond it there is rounding only
    assert np.abs(lines - from_y)[inside].max() < 1e-11 * np.abs(lines).max()
    assert y_ddot @ y / (y @ y) == pytest.approx(-(BROAD[1] ** 2) / 3, rel=1e-3)  # -m2/m0 of a flat band
    np.testing.assert_allclose(noise.derivative(2).psd_at(600.0), 600.0**4 * noise.psd_at(600.0), rtol=1e-13)
    assert noise.derivative(1).derivative(1) == noise.derivative(2)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_evaluation_is_the_sum_of_the_lines(order):
    noise = BandNoise(1e-3, NARROW, seed=4, period=17.0)
    t = np.random.default_rng(0).uniform(0.0, 40.0, (3, 7))
    exact = summed(noise.omega, noise.amplitude, t, order)
    scale = noise.derivative(order).rms
    np.testing.assert_allclose(noise.derivative(order)(t), exact, atol=1e-11 * scale)
    assert np.ndim(noise(0.3)) == 0
    times, y = noise.series(dt=1e-3)
    assert times[1] <= 1e-3
    np.testing.assert_allclose(noise(times[::1000]), y[::1000], atol=1e-11 * noise.rms)


def test_long_sums_are_chunked_without_a_seam():
    noise = BandNoise(1.0, NARROW, seed=4)
    t = np.linspace(0.0, 3.0, 20_001)
    whole = noise(t)
    assert whole[12_345] == pytest.approx(noise(t[12_345]), abs=1e-12)
    assert whole[-1] == pytest.approx(noise(3.0), abs=1e-12)


@pytest.mark.parametrize("order", [0, 2])
def test_many_equal_steps_are_summed_as_any_instants_are(order):
    signal = BandNoise(1e-3, (100.0, 1000.0), seed=4).for_duration(60.0)
    signal = signal.derivative(order) if order else signal
    mixed = np.random.default_rng(1).permutation(20001)
    for t in (1.7 + 2e-3 * np.arange(20001), np.linspace(50.0, 0.0, 20001)):
        values = signal(t)
        np.testing.assert_allclose(values[mixed], signal(t[mixed]), atol=1e-9 * values.std())


@pytest.mark.drawn
def test_kurtosis_is_gaussian():
    found = np.array([moments(BandNoise(1.0, BROAD, seed=s).series()[1]).kurtosis for s in range(40)])
    lo, hi = Estimate.of_mean(found).interval(0.9999)
    assert hi - lo < 0.1
    assert lo < 3.0 < hi


@pytest.mark.drawn
def test_zero_crossings_come_at_rices_rate():
    rates = []
    for seed in range(40):
        noise = BandNoise(1.0, BROAD, seed=seed)
        _, y = noise.series(dt=2 * np.pi / BROAD[1] / 40)
        rates.append(np.count_nonzero((y < 0) & (np.roll(y, -1) >= 0)) / noise.period)
    exact = BROAD[1] / (2 * np.pi * math.sqrt(3))  # √(m2/m0)/2π of a flat band from 0
    found = Estimate.of_mean(rates)
    lo, hi = found.interval(0.9999)
    assert found.relative < 2e-3
    assert lo < exact < hi


@pytest.mark.drawn
def test_the_seed_is_the_realisation():
    a, b = BandNoise(1.0, BROAD, seed=7), BandNoise(1.0, BROAD, seed=7)
    assert a == b
    assert hash(a) == hash(b)
    assert np.array_equal(a.series()[1], b.series()[1])
    packed = pickle.dumps(a)  # after the lines were drawn, which a worker draws again
    assert len(packed) < 2000
    assert pickle.loads(packed) == a
    assert np.array_equal(pickle.loads(packed).amplitude, a.amplitude)
    other = dataclasses.replace(a, seed=8).series()[1]
    correlation = np.mean(a.series()[1] * other)
    assert 0 < abs(correlation) < 4 / math.sqrt(2 * a.omega.size)  # mean of cos of 4096 random phases
    child = np.random.SeedSequence(1).spawn(2)
    assert not np.array_equal(BandNoise(1.0, BROAD, child[0]).amplitude, BandNoise(1.0, BROAD, child[1]).amplitude)


@lru_cache(maxsize=1)
def at_random_times(band, order):
    """Times, and what the noise of the next test is there."""
    t = np.random.default_rng(1).uniform(0.0, 3.0, 4000)
    return t, BandNoise(1e-3, band, seed=11).derivative(order)(t)


@pytest.mark.parametrize("rtol", [1e-2, 1e-6, 1e-9])
@pytest.mark.parametrize(("band", "order"), [(BROAD, 0), (NARROW, 2)])
def test_nodes_keep_their_promise(band, order, rtol):
    noise = BandNoise(1e-3, band, seed=11).derivative(order)
    dt, values = noise.nodes(3.0, rtol)
    assert values.shape[1] == 3
    assert (len(values) - 1) * dt >= 3.0 > (len(values) - 3) * dt
    t, exact = at_random_times(band, order)
    error = np.std(hermite(dt, values)(t) - exact)
    assert error < rtol * noise.rms
    assert error > 0.4 * rtol * noise.rms or rtol >= 1e-4  # no finer than need be, unless to hold the highest line


@settings(max_examples=5, deadline=None)
@given(
    ratio=st.floats(0.0, 3.0),
    width=st.floats(1.0, 2000.0),
    exponent=st.floats(-8.0, -2.0),
    lines=st.integers(12, 300),
    seed=st.integers(0, 1000),
)
def test_nodes_keep_their_promise_for_any_band(ratio, width, exponent, lines, seed):
    period = 2 * np.pi * lines / width
    noise = BandNoise(1.0, (ratio * width, (ratio + 1) * width), seed, period).derivative(2)
    dt, values = noise.nodes(period, 10.0**exponent)
    points = (np.arange(8) + 0.5) / 8  # of every cell of the period: the mean over them is that over the period
    t = (dt * (np.arange(round(period / dt))[:, None] + points)).ravel()
    rounding = 1e-13 * noise.omega[-1] * period
    error = hermite(dt, values)(t) - noise(t)
    assert np.sqrt(np.mean(error**2)) < (1.001 * 10.0**exponent + rounding) * noise.rms


def test_the_grid_does_not_depend_on_the_phases():
    a, b = (BandNoise(1e-3, BROAD, seed=seed, period=20.0).derivative(2) for seed in (1, 2))
    assert a.nodes(10.0, 1e-6)[0] == b.nodes(10.0, 1e-6)[0]


def test_nodes_of_a_long_run_are_lean():
    noise = BandNoise(1e-3, BROAD, seed=1).derivative(2).for_duration(600.0)
    dt, values = noise.nodes(600.0, 1e-6)
    assert values.nbytes < 4e7
    t = np.array([0.1, 299.97, 599.9])
    j = (t / dt).astype(int)
    found = [hermite(dt, values[k : k + 2])(s - k * dt) for k, s in zip(j, t, strict=True)]
    np.testing.assert_allclose(found, noise(t), atol=4e-6 * noise.rms)


def test_nodes_take_little_more_memory_than_they_hold():
    """At most the transform and the lines, twice as much; sums over all blocks at once took four times."""
    noise = BandNoise(2.5e-4, BROAD, seed=1, period=400.0)
    noise.nodes(1.0, 1e-6)  # makes the lines
    tracemalloc.start()
    _, values = noise.nodes(200.0, 1e-6)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3.3 * values.nbytes


def test_the_last_node_closes_the_period():
    noise = BandNoise(1.0, NARROW, seed=1, period=4.0)
    dt, values = noise.nodes(4.0, 1e-6)
    assert (len(values) - 1) * dt >= 4.0
    assert np.array_equal(values[round(4.0 / dt)], values[0])


def test_an_automatic_period_can_be_lengthened():
    noise = BandNoise(1e-3, BROAD, seed=6)
    assert noise.period == pytest.approx(4096 * 2 * np.pi / 1226.6)
    assert noise.omega.size == 4096
    assert noise.for_duration(10.0) is noise
    longer = noise.for_duration(50.0)
    assert longer.period == 50.0
    assert longer.rms == pytest.approx(1e-3, rel=1e-12)
    assert noise.derivative(2).for_duration(50.0) == longer.derivative(2)
    assert dataclasses.replace(noise, seed=9).for_duration(50.0).period == 50.0
    assert dataclasses.replace(noise, band=NARROW).omega.size == 4096


def test_a_period_asked_for_is_kept():
    noise = BandNoise(1e-3, BROAD, seed=6, period=30.0)
    assert noise.for_duration(30.0) is noise
    for call in (lambda: noise.for_duration(31.0), lambda: noise.nodes(31.0, 1e-6)):
        with pytest.raises(ValueError, match=r"would repeat after its period of 30 s, got a duration of 31 s"):
            call()
    with pytest.raises(ValueError, match="would repeat after its period of 50 s"):
        BandNoise(1e-3, BROAD).for_duration(50.0).for_duration(60.0)


def test_repr_makes_the_same_signal():
    noise = BandNoise(1e-3, BROAD, seed=6).derivative(2)
    assert eval(repr(noise), {"BandNoise": BandNoise}) == noise
    assert "of_psd" in repr(BandNoise.of_psd(lambda w: 1.0, BROAD))


# any density


def roll_off(omega):
    """A first-order roll-off."""
    return 1e-9 / (1 + (omega / 300.0) ** 2)


def test_of_psd_has_the_density_line_by_line():
    noise = BandNoise.of_psd(roll_off, BROAD, seed=1, period=40.0)
    spacing = 2 * np.pi / 40.0
    np.testing.assert_allclose(np.abs(noise.amplitude) ** 2, 2 * spacing * roll_off(noise.omega), rtol=1e-12)
    assert noise.std**2 == pytest.approx(spacing * roll_off(noise.omega).sum(), rel=1e-12)
    assert np.mean(noise.series()[1] ** 2) == pytest.approx(noise.std**2, rel=1e-12)
    assert noise.std**2 == pytest.approx(1e-9 * 300 * math.atan(BROAD[1] / 300), rel=1e-3)
    np.testing.assert_allclose(noise.psd_at([0.0, 300.0, 2000.0]), [1e-9, 5e-10, 0.0], rtol=1e-12)


def test_an_actuator_rolls_off():
    noise = BandNoise.rolled_off(2e-3, NARROW, corner=300.0, seed=1)
    assert noise.std == pytest.approx(2e-3, rel=1e-3)
    ratio = noise.psd_at(noise.omega[-1]) / noise.psd_at(noise.omega[0])
    assert ratio == pytest.approx(roll_off(noise.omega[-1]) / roll_off(noise.omega[0]), rel=1e-12)
    shape = RollOff(1e-9, 300.0)
    assert np.array_equal(shape(noise.omega), roll_off(noise.omega))
    grid = np.linspace(*BROAD, 100_001)
    assert shape.power(*BROAD) == pytest.approx(np.trapezoid(roll_off(grid), grid), rel=1e-8)
    assert repr(noise).startswith("BandNoise.of_psd(psd=RollOff(level=")


@pytest.mark.parametrize("psd", [None, roll_off])
def test_a_mean_is_added_and_has_no_derivative(psd):
    if psd is None:
        plain, moved = BandNoise(1e-3, NARROW, 4), BandNoise(1e-3, NARROW, 4, mean=-2.0)
    else:
        plain, moved = BandNoise.of_psd(psd, NARROW, 4), BandNoise.of_psd(psd, NARROW, 4, mean=-2.0)
    t = np.linspace(0.0, 3.0, 50)
    np.testing.assert_allclose(moved(t), plain(t) - 2.0, rtol=1e-12)
    np.testing.assert_allclose(moved.series()[1].mean(), -2.0, rtol=1e-12)
    at_nodes = moved.nodes(1.0, 1e-8)[1] - plain.nodes(1.0, 1e-8)[1]
    np.testing.assert_allclose(at_nodes, [[-2.0, 0.0, 0.0]] * len(at_nodes), atol=1e-12)
    assert np.array_equal(moved.derivative(2)(t), plain.derivative(2)(t))
    assert np.array_equal(moved.derivative(1).nodes(1.0, 1e-8)[1], plain.derivative(1).nodes(1.0, 1e-8)[1])
    assert moved.rms == plain.rms
    assert moved.for_duration(1000.0).mean == -2.0


def test_a_table_is_its_interpolant():
    table = np.linspace(0.0, 1300.0, 400)
    level = roll_off(table)
    by_table = BandNoise.of_psd((table, level), BROAD, seed=1)
    by_function = BandNoise.of_psd(lambda w: np.interp(w, table, level), BROAD, seed=1)
    assert np.array_equal(by_table.amplitude, by_function.amplitude)
    level[:] = 0.0  # the table was copied
    assert by_table.derivative(1).rms > 0
    assert by_table == BandNoise.of_psd((table, roll_off(table)), BROAD, seed=1)


def test_a_constant_density_is_flat_noise():
    flat = BandNoise(1e-3, NARROW, seed=2)
    same = BandNoise.of_psd(lambda w: float(flat.psd_at(200.0)), NARROW, seed=2)
    np.testing.assert_allclose(same.amplitude, flat.amplitude, rtol=1e-12)
    assert same.for_duration(1000.0).std == pytest.approx(1e-3, rel=1e-3)
    assert dataclasses.replace(same, seed=3).std == same.std


test_bad_noise = refused(
    (lambda: BandNoise(0.0, BROAD), "std must be finite above 0, got 0.0"),
    (lambda: BandNoise(math.nan, BROAD), "std must be finite above 0, got nan"),
    (lambda: BandNoise(None, BROAD), "std must be a number, got None"),
    (lambda: BandNoise(1.0, BROAD, mean=math.inf), "mean must be finite, got inf"),
    (lambda: BandNoise.rolled_off(1.0, BROAD, 0.0), r"corner \(rad/s\) must be finite above 0, got 0.0"),
    (lambda: BandNoise(1.0, (5.0, 2.0)), r"band must run from lo to hi > lo in rad/s, got \(5, 2\)"),
    (lambda: BandNoise(1.0, (5.0, 5.0)), "band must run from lo to hi"),
    (lambda: BandNoise(1.0, (-5.0, 5.0)), r"band\[0\] must be finite of at least 0, got -5.0"),
    (lambda: BandNoise(1.0, (0.0, math.inf)), r"band\[1\] must be finite"),
    (lambda: BandNoise(1.0, 5.0), r"band must be a pair \(lo, hi\)"),
    (lambda: BandNoise(1.0, BROAD, seed=None), "seed must be an integer of at least 0 .* got None"),
    (lambda: BandNoise(1.0, BROAD, seed=-1), "seed must be an integer of at least 0 .* got -1"),
    (lambda: BandNoise(1.0, BROAD, period=0.0), r"period \(s\) must be finite above 0, got 0.0"),
    (lambda: BandNoise(1.0, BROAD, period=1e40), r"takes at most 1e\+08 lines in the band, got 1\.\d+e\+42 in"),
    (lambda: BandNoise(1.0, BROAD, period=0.01), "at least 8 lines in the band, got 1 in"),
    (lambda: BandNoise(1.0, BROAD).derivative(1.5), "order of the derivative .* got 1.5"),
    (lambda: BandNoise(1.0, BROAD).nodes(1.0, 0.0), r"rtol must lie in \[1e-13, 1\), got 0.0"),
    (lambda: BandNoise(1.0, BROAD).nodes(math.nan, 1e-6), r"duration \(s\) must be finite"),
    (lambda: BandNoise(1.0, BROAD).series(dt=-1.0), r"dt \(s\) must be finite above 0"),
    (lambda: BandNoise.of_psd(lambda w: -w, BROAD), "psd must be finite and at least 0, got -0.2.* at omega = 0.2"),
    (lambda: BandNoise.of_psd(lambda w: w * math.nan, BROAD), "psd must be finite and at least 0, got nan"),
    (lambda: BandNoise.of_psd(lambda w: 0.0 * w, BROAD), "psd is zero on every line"),
    (lambda: BandNoise.of_psd(lambda w: w[:3], BROAD), r"one value per omega, got shape \(3,\)"),
    (lambda: BandNoise.of_psd(None, BROAD), "got None"),
    (lambda: BandNoise.of_psd("flat", BROAD), "psd must be a function of omega or a table .* got str"),
    (lambda: BandNoise.of_psd(([0, 2000], [1, -1]), BROAD), "got -1.0 at omega = 2000 rad/s"),
    (lambda: BandNoise.of_psd(([0, 1000], [1, 1]), BROAD), r"spans \[0, 1000\] rad/s and must cover the band"),
    (lambda: BandNoise.of_psd(([0, 1000, math.inf], [1, 1, 1]), BROAD), "finite and strictly increasing omega"),
    (lambda: BandNoise.of_psd(([0, 3000, 2000], [1, 1, 1]), BROAD), "strictly increasing omega"),
    (lambda: BandNoise.of_psd(([0, 3000], [1]), BROAD), "two columns of equal length"),
    (lambda: dataclasses.replace(BandNoise.of_psd(roll_off, BROAD), std=1.0), "std follows from psd"),
)


# measured motion

STEP, SAMPLES = 1e-3, 5001


def tones_below(fraction, seed=0):
    """Forty tones below a fraction of the Nyquist frequency, and the rms of their second derivative."""
    rng = np.random.default_rng(seed)
    omega = rng.uniform(0.01 * fraction, fraction, 40) * np.pi / STEP
    signal = Multisine(np.ones(40), omega, rng.uniform(0, 2 * np.pi, 40))
    return signal, math.sqrt(np.sum(omega**4) / 2)


def error_beyond(record, signal, order, samples):
    """Largest error at a distance from both ends, between the samples too."""
    edge = samples * STEP
    t = np.linspace(edge, record.duration - edge, 20_011)
    return np.abs(record.derivative(order)(t) - signal.derivative(order)(t)).max()


@pytest.mark.drawn
@pytest.mark.parametrize("fraction", [0.1, 0.33, 0.5])
def test_record_derivative_of_uniform_samples(fraction):
    signal, rms = tones_below(fraction)
    t = STEP * np.arange(SAMPLES)
    record = Record(t, signal(t))
    np.testing.assert_allclose(record(t), signal(t), atol=1e-10)
    for samples, bound in ((2, 0.6), (10, 3e-2), (50, 1.5e-3), (1000, 3e-6)):  # in 30 draws at most 0.42 of these
        assert error_beyond(record, signal, 2, samples) < bound * rms


@pytest.mark.parametrize(("fraction", "bound"), [(0.1, 5e-4), (0.2, 3e-3)])
def test_record_derivative_of_jittered_samples(fraction, bound):
    signal, rms = tones_below(fraction)
    t = STEP * np.arange(SAMPLES)
    t[1:-1] += 0.3 * STEP * np.random.default_rng(1).uniform(-1, 1, SAMPLES - 2)
    record = Record(t, signal(t))
    assert error_beyond(record, signal, 2, 50) < bound * rms
    uniform = Record(STEP * np.arange(SAMPLES), signal(t))  # ignoring the jitter must be far worse
    assert error_beyond(uniform, signal, 2, 50) > 20 * bound * rms


def test_record_counts_time_from_its_first_sample():
    t = 12.0 + STEP * np.arange(200)
    record = Record(t, np.sin(t))
    assert record.t[0] == 0.0
    assert record.duration == pytest.approx(0.199)
    assert record(0.1) == pytest.approx(math.sin(12.1), abs=1e-9)


@pytest.mark.parametrize("order", range(3))
def test_record_straight_line_is_exact(order):
    t = 0.01 * np.arange(50)
    record = Record(t, 3.0 - 2.0 * t).derivative(order)
    exact = (3.0 - 2.0 * 0.123, -2.0, 0.0)[order]
    assert record(0.123) == pytest.approx(exact, abs=1e-9)
    dt, values = record.nodes(0.4, 1e-6)
    assert hermite(dt, values)(0.123) == pytest.approx(exact, abs=1e-9)


def test_record_band_removes_what_is_outside():
    t = np.linspace(0.0, 10.0, 10_001)
    slow, wanted, fast = (np.sin(w * t) for w in (0.1 * np.pi, 20 * np.pi, 200 * np.pi))
    record = Record(t, 5.0 + 3.0 * t + slow + wanted + fast, band=(30.0, 100.0))
    middle = np.linspace(3.0, 7.0, 1001)
    np.testing.assert_allclose(record(middle), np.sin(20 * np.pi * middle), atol=1e-3)
    low = Record(t, 5.0 + 3.0 * t + wanted + fast, band=(0.0, 100.0))
    np.testing.assert_allclose(low(middle), 5.0 + 3.0 * middle + np.sin(20 * np.pi * middle), atol=1e-9)


@pytest.mark.drawn
def test_record_band_tames_the_noise_of_the_second_derivative():
    signal, rms = tones_below(0.1)
    t = STEP * np.arange(SAMPLES)
    y = signal(t) + 1e-2 * np.random.default_rng(2).standard_normal(SAMPLES)
    assert error_beyond(Record(t, y), signal, 2, 200) > 0.5 * rms
    banded = Record(t, y, band=(0.0, 0.11 * np.pi / STEP))
    assert error_beyond(banded, signal, 2, 200) < 0.01 * rms
    assert error_beyond(Record(t, signal(t), band=banded.band), signal, 2, 200) < 2e-3 * rms


@pytest.mark.drawn
@pytest.mark.parametrize("rtol", [1e-4, 1e-9])
@pytest.mark.parametrize("order", [0, 2])
def test_record_nodes_keep_their_promise(order, rtol):
    signal, _ = tones_below(0.3)
    t = STEP * np.arange(1001)
    record = Record(t, 2.0 + signal(t)).derivative(order)
    dt, values = record.nodes(1.0, rtol)
    assert (len(values) - 1) * dt >= 1.0 - 1e-12
    at = np.random.default_rng(3).uniform(0.0, 1.0, 3000)
    assert np.std(hermite(dt, values)(at) - record(at)) < (1.5 * rtol + 1e-11) * np.std(record(at))


def test_acceleration_record_is_its_own_second_derivative():
    t = STEP * np.arange(SAMPLES)
    y = Harmonic(1e-3, 50 * 2 * np.pi / t[-1])  # whole periods: no straight line
    record = Record(t, y.derivative(2)(t), kind="acceleration")
    np.testing.assert_allclose(record.derivative(2)(t), y.derivative(2)(t), atol=1e-12 * 1e3)
    banded = Record(t, y.derivative(2)(t) + 0.5, band=(40.0, 500.0), kind="acceleration")
    inner = np.linspace(1.0, 4.0, 500)
    np.testing.assert_allclose(banded(inner), y(inner), atol=0.01e-3)
    last, line = t[-1], Record(t, 0.5 + 0.1 * t, kind="acceleration")
    cubic = 0.25 * 2.0**2 + 0.1 / 6.0 * 2.0**3 - 2.0 * (0.25 * last + 0.1 / 6.0 * last**2)  # zero at both ends
    assert line(2.0) == pytest.approx(cubic, rel=1e-12)


def test_an_acceleration_record_loses_the_offset_and_drift_of_its_sensor():
    t = STEP * np.arange(SAMPLES)
    y = Harmonic(1e-3, 50 * 2 * np.pi / t[-1])
    raw = y.derivative(2)(t)
    record = Record(t, raw + 0.5 - 0.02 * t, kind="acceleration", detrend=True)
    straight = np.polynomial.polynomial.polyfit(t, raw, 1)  # what a straight line finds in the motion itself
    expected = raw - straight[0] - straight[1] * t
    np.testing.assert_allclose(record.derivative(2)(t), expected, atol=1e-9)
    assert abs(Record(t, raw + 0.5, kind="acceleration").derivative(2)(t).mean() - 0.5) < 1e-3


def test_record_leaves_the_arrays_alone():
    t, y = STEP * np.arange(20) + 1.0, np.ones(20)
    record = Record(t, y)
    y[:] = 5.0
    assert record(0.005) == pytest.approx(1.0)
    assert t[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        record.y[0] = 2.0


@pytest.mark.parametrize(
    "text", ["{rows}", "\ufeff{rows}", "time,motion\n{rows}", "\ufeff# rig 3\n\ntime (s);y (mm)\n{rows}", "{rows}\n\n"]
)
@pytest.mark.parametrize("mark", [",", "\t", "  ", " ; "])
def test_csv_with_and_without_header(tmp_path, text, mark):
    t = STEP * np.arange(30)
    rows = "\n".join(f"{a!r}{mark}{b!r}" for a, b in zip(t.tolist(), np.sin(40 * t).tolist(), strict=True))
    path = tmp_path / "record.csv"
    path.write_text(text.format(rows=rows), encoding="utf-8")
    record = Record.from_csv(path, scale=1e-3)
    assert np.array_equal(record.t, t)
    assert np.array_equal(record.y, np.sin(40 * t) * 1e-3)


def test_csv_columns(tmp_path):
    path = tmp_path / "record.csv"
    path.write_text("\n".join(f"x,{k * k},{0.1 * k}" for k in range(20)))
    with pytest.raises(ValueError, match=r"columns must be two different ones \(time, motion\), got \(1, 1\)"):
        Record.from_csv(path, columns=(1, 1))
    record = Record.from_csv(path, columns=(2, 1), band=(0.0, 20.0), kind="acceleration")
    assert record.y[3] == 9.0
    assert record.quantity == record.kind == "acceleration"
    assert record.band == (0.0, 20.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\nc,d\n", r"has no row with numbers in columns \(0, 1\)"),
        ("t;y\n0,1;0,2\n", r"has no row with numbers .*; its last line is '0,1;0,2'; give .* decimal points"),
        ("t,y\n0,1\n0.1,oops\n", "record.csv, line 3: no numbers in columns"),
        ("0,1\n0.1\n", "line 2: no numbers"),
        ("\n".join(f"{k},nan" if k == 4 else f"{k},1" for k in range(12)), r"record.csv: Record y .* got nan in row 4"),
    ],
)
def test_bad_csv(tmp_path, text, message):
    path = tmp_path / "record.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        Record.from_csv(path)


def times(**changed):
    """Ten times 0, 0.1, … with some replaced."""
    t = 0.1 * np.arange(10)
    for row, value in changed.items():
        t[int(row[1:])] = value
    return t


test_bad_record = refused(
    (lambda: Record(times(r4=0.2), np.ones(10)), "t must increase strictly, got 0.2 s after 0.3 s in row 4"),
    (lambda: Record(times(r4=0.3), np.ones(10)), "t must increase strictly, got 0.3 s after 0.3 s in row 4"),
    (lambda: Record(times(r4=math.nan), np.ones(10)), "t must be finite, got nan in row 4"),
    (lambda: Record(times(), np.where(np.arange(10) == 6, np.inf, 1)), "y must be finite, got inf in row 6"),
    (lambda: Record(times(), np.ones(9)), r"got shapes \(10,\) and \(9,\)"),
    (lambda: Record([0, 1, 2], [0, 1, 2]), "one length of at least 8"),
    (lambda: Record("file.csv", [1]), "must be arrays of numbers"),
    (lambda: Record(times(r9=5.0), np.ones(10)), "a gap of 4.2 s before row 9, more than 10 median steps of 0.1 s"),
    (lambda: Record(times(), np.ones(10), band=(9.0, 3.0)), "band must run from lo to hi"),
    (lambda: Record(times(), np.ones(10), band=(900.0, 950.0)), r"band .* holds no line: the record resolves 3.49"),
    (lambda: Record(times(), np.ones(10), kind="jerk"), "'acceleration' or 'force', got 'jerk'"),
    (lambda: Record(times(), np.ones(10)).for_duration(1.0), "0.9 s long and shorter than the duration of 1 s"),
    (lambda: Record(times(), np.ones(10)).nodes(1.0, 1e-6), "Record is 0.9 s long and shorter"),
    (lambda: Record(times(), np.ones(10))(0.95), "covers 0 to 0.9 s, got t = 0.95 s"),
    (lambda: Record(times(), np.ones(10))([0.1, -0.1]), "covers 0 to 0.9 s, got t = -0.1 s"),
    (lambda: Record(times(), np.ones(10))(math.nan), "got t = nan s"),
    (lambda: Record.from_csv("none.csv", columns=(0, "y")), "columns must be two whole numbers"),
)


NO_NUMBERS = [True, np.True_, "1", None, 1j, np.complex64(1), np.complex128(1), [1.0, 2.0], 10**400]


@pytest.mark.parametrize("bad", NO_NUMBERS, ids=lambda bad: type(bad).__name__)
def test_what_is_no_number_is_refused_in_words(bad):
    with pytest.raises(ValueError, match=r"amplitude must be (a number|finite), got"):
        Harmonic(bad, 100.0)
    with pytest.raises(ValueError, match=r"mass must be (a number|finite and not negative)"):
        LumpedMass(0.1, bad)
