import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from refusals import refused

from fembeam.excitation import BandNoise
from fembeam.statistics import Estimate, Moments, moments, pdf, psd


def white(seed, n=65_536):
    """Unit white noise."""
    return np.random.default_rng(seed).standard_normal(n)


@pytest.mark.drawn
def test_level_of_white_noise():
    dt = 0.01
    levels = np.array([psd(2.0 * white(s), dt).density[5:-5].mean() for s in range(20)])
    exact = 4.0 * dt / math.pi  # variance over the band from 0 to π/dt
    found = Estimate.of_mean(levels)
    lo, hi = found.interval(0.9999)
    assert found.relative < 5e-3
    assert lo < exact < hi


def test_sine_on_a_bin():
    dt, segment = 0.01, 512
    spacing = 2 * math.pi / (segment * dt)
    spectrum = psd(3.0 * np.cos(40 * spacing * dt * np.arange(8 * segment)), dt, segment)
    omega, density = spectrum
    assert omega[40] == pytest.approx(40 * spacing, rel=1e-12)
    assert density[40] == pytest.approx(4.5 / (1.5 * spacing), rel=1e-9)  # 1.5 bins: noise width of the Hann window
    assert spectrum.variance == pytest.approx(4.5, rel=1e-9)
    assert spectrum.variance_in(39 * spacing - 1e-6, 41 * spacing + 1e-6) == pytest.approx(4.5, rel=1e-9)
    assert spectrum.variance_in(42 * spacing, 1e9) < 1e-9


def test_variance_is_the_windowed_power_of_the_signal():
    x, segment = 5.0 + white(1, 4096), 256
    window = np.sin(np.pi * np.arange(segment) / segment) ** 2
    starts = range(0, 4096 - segment + 1, segment // 2)
    parts = np.array([x[i : i + segment] - x.mean() for i in starts])
    power = np.mean(parts**2 @ window**2) / np.sum(window**2)
    spectrum = psd(x, 0.02, segment)
    assert spectrum.variance == pytest.approx(power, rel=1e-12)
    assert spectrum.n_segments == len(starts)


@pytest.mark.drawn
def test_variance_of_the_spectrum_is_that_of_the_signal():
    ratios = []
    for seed in range(20):
        t, y = BandNoise(2e-3, (0.0, 500.0), seed).series()
        ratios.append(psd(y, t[1]).variance / 4e-6)
    found = Estimate.of_mean(ratios)
    lo, hi = found.interval(0.9999)
    assert found.relative < 0.01
    assert lo < 1.0 < hi


@pytest.mark.drawn
def test_band_noise_is_flat_in_its_band():
    noise = BandNoise(1e-3, (100.0, 300.0), seed=2, period=600.0)
    t, y = noise.series()
    omega, density = psd(y, t[1])
    inside, outside = (omega > 105) & (omega < 295), (omega < 95) | (omega > 305)
    assert density[inside].mean() == pytest.approx(5e-9, rel=0.02)
    assert density[inside].std() < 0.25 * 5e-9
    assert density[outside].max() < 1e-5 * 5e-9


def test_slow_motion_keeps_its_energy():
    t = 0.01 * np.arange(4096)
    slow = np.sqrt(2) * np.sin(2 * np.pi * t / 10.24)  # four segments of 256 samples to a period
    assert psd(slow, 0.01, segment=256).variance == pytest.approx(1.0, rel=0.05)


def test_per_hz_keeps_the_variance():
    spectrum = psd(white(3, 4096), 0.05)
    hz, density = spectrum.per_hz
    np.testing.assert_allclose(hz * 2 * math.pi, spectrum.omega, rtol=1e-15)
    assert hz[-1] == pytest.approx(10.0)
    assert np.sum(density) * hz[1] == pytest.approx(spectrum.variance, rel=1e-12)


def test_default_segment_and_overlap():
    assert psd(white(1, 32_000), 0.1).n_segments == 63
    assert psd(white(1, 32_000), 0.1, overlap=0.0).n_segments == 32
    assert psd(white(1, 100), 0.1).n_segments == 1
    assert psd(white(1, 64), 0.1, segment=8, overlap=0.99).n_segments == 57


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=200).filter(lambda x: np.ptp(x) > 1e-3))
@example([0.0, 0.0, 0.0, -39.0, -1.8e-307])
def test_density_integrates_to_one(samples):
    x, density = pdf(samples)
    assert 10 <= x.size <= 200
    assert np.sum(density) * (x[1] - x[0]) == pytest.approx(1.0, rel=1e-9)
    assert x[0] > min(samples)
    assert x[-1] < max(samples)


@pytest.mark.drawn
def test_density_of_a_gaussian():
    samples = white(5)
    x, density = pdf(samples, bins=40)
    width = x[1] - x[0]
    exact = np.exp(-(x**2) / 2) / math.sqrt(2 * math.pi)
    error = np.sqrt(exact / (width * samples.size))  # of a binomial count
    core = np.abs(x) < 2.5
    bias = width**2 / 24  # of the mean over a bin, |f''| <= 0.4
    assert np.all(np.abs(density - exact)[core] < 4.5 * error[core] + bias)


def test_density_on_given_edges():
    x, density = pdf([0.1, 0.2, 0.9], bins=[0.0, 0.5, 1.0])
    assert x.tolist() == [0.25, 0.75]
    np.testing.assert_allclose(density, [4 / 3, 2 / 3])


@pytest.mark.drawn
def test_moments_of_known_samples():
    assert moments([1.0, -1.0]) == Moments(0.0, 1.0, 0.0, 1.0)
    found = moments(np.random.default_rng(0).exponential(2.0, (1000, 400)))
    assert found.mean == pytest.approx(2.0, rel=0.01)
    assert found.std == pytest.approx(2.0, rel=0.01)
    assert found.skewness == pytest.approx(2.0, rel=0.05)
    assert found.kurtosis == pytest.approx(9.0, rel=0.1)


def test_moments_of_equal_samples():
    found = moments([0.1] * 10)
    assert (found.mean, found.std) == (pytest.approx(0.1), 0.0)
    assert math.isnan(found.skewness)
    assert math.isnan(found.kurtosis)


def test_samples_are_left_alone():
    x = white(7, 512)
    kept = x.copy()
    psd(x, 0.1)
    pdf(x)
    moments(x)
    assert np.array_equal(x, kept)


test_bad_statistics = refused(
    (lambda: psd([1.0] * 5, 0.1), "psd needs at least 8 samples, got 5"),
    (lambda: psd([1.0] * 9 + [math.nan], 0.1), "psd: samples must be finite, got nan at index 9"),
    (lambda: psd(np.ones((4, 4)), 0.1), r"one dimension, got shape \(4, 4\)"),
    (lambda: psd(white(0, 64), 0.0), r"psd: dt \(s\) must be finite above 0, got 0.0"),
    (lambda: psd(white(0, 64), math.inf), r"psd: dt \(s\) must be finite above 0, got inf"),
    (lambda: psd(white(0, 64), 0.1, segment=65), "segment must be a whole number of samples from 8 to 64, got 65"),
    (lambda: psd(white(0, 64), 0.1, segment=16.0), "segment must be a whole number"),
    (lambda: psd(white(0, 64), 0.1, overlap=1.0), r"overlap must lie in \[0, 1\), got 1.0"),
    (lambda: psd(white(0, 64), 0.1).variance_in(3.0, 1.0), r"variance_in needs lo < hi in rad/s, got \(3.0, 1.0\)"),
    (lambda: pdf([1.0]), "pdf needs at least 2 samples, got 1"),
    (lambda: pdf([1.0, math.nan]), "pdf: samples must be finite, got nan at index 1"),
    (lambda: pdf([2.0, 2.0]), "pdf: all 2 samples equal 2, which has no density"),
    (lambda: pdf([1.0, 2.0], bins=0), "bins must be a whole number of at least 1, or edges, got 0"),
    (lambda: pdf([1.0, 2.0], bins=[0.0, 1.5]), r"edges \[0, 1.5\] leave out samples, which span \[1, 2\]"),
    (lambda: pdf([1.0, 2.0], bins=[3.0, 0.0]), "edges of bins must increase strictly"),
    (lambda: moments([1.0]), "moments needs at least 2 samples, got 1"),
    (lambda: moments([[1.0, 2.0], [math.inf, 0.0]]), "samples must be finite, got inf at index 2"),
    (lambda: moments("abc"), "samples must be real numbers, got .abc. in moments"),
)
