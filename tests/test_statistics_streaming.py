"""Statistics that arrive in pieces, against those of the whole; long runs against exact stationary densities."""

import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused_by

import fembeam as fb
import solvers
from contacts import Hertz, Jenkins, KelvinVoigt
from fembeam.statistics import Batches, Estimate, Impacts, Signal, moments, psd, settling
from fembeam.statistics.batches import MOST
from fembeam.statistics.scales import KURTOSIS, LEVEL, LINEAR, RATE, SKEWNESS
from fembeam.statistics.streaming import up_crossings
from fembeam.study import segments, stationary
from fembeam.study.decay import correlation_time


def coloured(seed, n=40_000):
    """Skewed noise with memory."""
    white = np.random.default_rng(seed).standard_normal(n + 200)
    smooth = np.convolve(white, np.exp(-np.arange(200) / 20.0), "valid")[:n]
    return smooth + 0.1 * smooth**2


@pytest.mark.parametrize("segment", [255, 256])
def test_pieces_give_the_statistics_of_the_whole(segment):
    x, dt = coloured(1) + 7.0, 0.02
    signal = Signal(x[:3000], dt, segment, level=7.0)
    for part in np.split(x, [3000, 3001, 3100, 9000, 22_222, 30_000]):
        signal.add(part)
    whole, found = moments(x), [signal.mean, signal.std, signal.skewness, signal.kurtosis]
    expected = [whole.mean, whole.std, whole.skewness, whole.kurtosis]
    np.testing.assert_allclose([e.value for e in found], expected, rtol=1e-9)
    spectrum = psd(x, dt, segment)
    np.testing.assert_allclose(signal.psd.density, spectrum.density, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(signal.psd.omega, spectrum.omega)
    assert signal.psd.n_segments == spectrum.n_segments
    assert signal.crossing_rate.value == up_crossings(x - 7.0, None, dt) / (dt * (x.size - 1))
    x_bins, density = signal.pdf
    np.testing.assert_allclose(np.sum(density) * (x_bins[1] - x_bins[0]), 1 - signal.outside, rtol=1e-12)


def test_equal_bins_count_as_searched_ones():
    x = np.concatenate((coloured(2), [-1e9, 1e9]))
    first = x[:3000]
    equal = Signal(first, 0.1, 64)
    searched = Signal(first, 0.1, 64, bins=equal.edges)
    for signal in (equal, searched):
        signal.add(x)
    moved = np.abs(equal.pdf.density - searched.pdf.density).sum() * np.diff(equal.edges)[0] * x.size
    assert moved < 4.5  # the smallest and the largest of the first samples lie on edges
    assert equal.outside == searched.outside > 0.0


def test_a_cut_starts_a_new_segment_and_no_crossing():
    signal = Signal(np.array([-1.0, 1.0]), 0.1, 8)
    for part in (-np.ones(12), np.ones(12)):
        signal.cut()
        signal.add(part)
    assert signal.crossing_rate.value == 0.0
    assert signal.psd.n_segments == 4


@pytest.mark.drawn
def test_the_spectrum_carries_the_variance():
    found = []
    for seed in range(12):
        x = coloured(seed)
        signal = Signal(x, 0.1, 1024)
        for part in np.split(x, 20):
            signal.add(part)
        found.append(signal.psd.variance / signal.variance.value)
        hz, density = signal.psd.per_hz
        assert np.sum(density) * hz[1] == pytest.approx(signal.psd.variance)
    ratio = Estimate.of_mean(found)
    lo, hi = ratio.interval(0.9999)
    assert ratio.relative < 0.01
    assert lo < 1.0 < hi


def test_the_jackknife_is_the_standard_error_of_a_mean():
    values = np.random.default_rng(2).standard_normal(40)
    batches = Batches(2)
    for value in values:
        batches.add([1.0, value])
    found = batches.estimate(lambda s: s[1] / s[0])
    assert found.value == pytest.approx(values.mean())
    assert found.standard_error == pytest.approx(values.std(ddof=1) / math.sqrt(40))


def test_merging_keeps_the_sums_and_the_memory():
    batches, values = Batches(1), np.random.default_rng(3).standard_normal(10_001)
    for value in values:
        batches.add([value])
    assert batches.rows.shape == (MOST, 1)
    assert MOST / 2 <= len(batches.filled) <= MOST
    assert batches.total[0] == pytest.approx(values.sum())


@pytest.mark.drawn
def test_intervals_cover_what_they_say():
    hits = 0
    for seed in range(300):
        batches = Batches(3)
        for x in np.random.default_rng(seed).standard_normal((12, 50)):
            batches.add([x.size, x.sum(), (x**2).sum()])
        lo, hi = batches.estimate(lambda s: s[2] / s[0] - (s[1] / s[0]) ** 2).interval(0.9)
        hits += lo < 1.0 < hi
    assert abs(hits / 300 - 0.9) < 4 * math.sqrt(0.09 / 300)


def level(s):
    return s[1] / s[0]


def kurtosis(s):
    return 1.5 * s[2] * s[0] / s[1] ** 2


@pytest.mark.drawn
@pytest.mark.parametrize(("function", "size", "true", "scale"), [(level, 2, 1.0, LEVEL), (kurtosis, 6, 3.0, KURTOSIS)])
def test_intervals_of_narrow_band_levels_and_kurtosis_cover_what_they_say(function, size, true, scale):
    """Squared amplitudes E of narrow-band noise are exponential: variance ∝ E, kurtosis 3/2 mean(E²)/mean(E)².

    In 2000 trials 0.95 is known to 0.005. On its own scale a short run comes within 0.015 of it; plainly it does not.
    """
    held = {LINEAR: 0, scale: 0}
    for squares in np.random.default_rng(5).exponential(size=(2000, 8, size)):
        batches = Batches(3)
        for part in squares:
            batches.add([part.size, part.sum(), (part**2).sum()])
        for kind in held:
            lo, hi = batches.estimate(function, kind).interval()
            held[kind] += lo < true < hi
    assert abs(held[scale] / 2000 - 0.95) < 0.015 + 4 * 0.005
    assert held[scale] - held[LINEAR] > 0.01 * 2000


@pytest.mark.drawn
def test_intervals_of_the_rate_of_events_that_come_in_clusters_cover_more():
    """Eight clusters of five in the mean, in 16 batches: 0.87 of plain intervals hold the rate, 0.13 lie below it."""
    rng, held = np.random.default_rng(5), {LINEAR: 0, RATE: 0}
    for _ in range(1000):
        batches = Batches(2)
        for clusters in rng.poisson(0.5, 16):
            batches.add([1.0, rng.geometric(0.2, clusters).sum()])
        for kind in held:
            lo, hi = batches.estimate(level, kind).interval()
            held[kind] += lo < 2.5 < hi
    assert held[RATE] > 900 > held[LINEAR]


def test_a_run_without_contact_or_crossing_does_not_tell_how_rare_they_are():
    """Its rate was 0 ± 0, from 0 to 0, and known well enough for any `until`."""
    signal = Signal(np.zeros(2), 1.0, 8, level=1.0)
    none = solvers.ContactLog(np.zeros(0, int), *np.zeros((8, 0)), np.zeros(0, bool))
    impacts = Impacts()
    for i in range(16):
        impacts.add(none, 0, float(i), i + 1.0)
        signal.add(np.sin(np.arange(16.0)))
    one = solvers.ContactLog(np.zeros(1, int), *np.zeros((8, 1)), np.zeros(1, bool))
    pressed = Impacts()  # all the time: that does not tell how rarely the stop opens
    for i in range(16):
        pressed.add(replace(one, t_out=np.full(1, np.nan)), 0, float(i), i + 1.0)
    assert pressed.probability.value == 1.0
    for found in (impacts.rate, impacts.probability, signal.crossing_rate, pressed.rate):
        assert found.value == 0.0
        assert found.relative == math.inf
        assert np.isnan(found.interval()).all()


def test_scales_are_inverted():
    for scale, values in (
        (LEVEL, [1e-9, 1.0, 1e9]),
        (RATE, [0.0, 1.0, 1e9]),
        (SKEWNESS, [-5.0, 0.0, 5.0]),
        (KURTOSIS, [1.01, 3.0, 40.0]),
    ):
        np.testing.assert_allclose(scale.back(scale.forth(np.array(values))), values, rtol=1e-9)
    assert SKEWNESS.back(-2.0) == -np.inf
    assert KURTOSIS.back(0.1) == np.inf


def test_an_interval_without_scatter_is_a_point():
    constant, empty = Signal(np.ones(8), 0.1, 8), Signal(np.ones(8), 0.1, 8)
    for _ in range(3):
        constant.add(np.ones(8))
    assert constant.variance.interval() == (0.0, 0.0)
    assert all(np.isnan(constant.kurtosis.interval()))
    empty.add(np.arange(8.0))
    assert all(np.isnan(empty.variance.interval()))
    with pytest.raises(ValueError, match="no scatter to tell an interval from"):
        psd(np.arange(64.0), 0.1).interval()


@pytest.mark.drawn
def test_what_estimates_have_in_common_is_no_scatter():
    rng = np.random.default_rng(4)
    a = rng.gamma(20.0, size=200)
    b = 3.0 * a * (1.0 + 0.01 * rng.standard_normal(200))
    ratio = Estimate.joint(np.divide, Estimate.of_mean(b), Estimate.of_mean(a))
    assert ratio.value == b.mean() / a.mean()
    by_hand = np.std(b - ratio.value * a, ddof=1) / math.sqrt(200) / a.mean()  # linearised
    assert ratio.standard_error == pytest.approx(by_hand, rel=0.02)
    apart = ratio.value * math.hypot(Estimate.of_mean(a).relative, Estimate.of_mean(b).relative)
    assert ratio.standard_error < 0.1 * apart


def test_joint_estimates_need_the_same_parts():
    two, three, one = (Estimate.of_mean(np.arange(1.0, n + 1.0)) for n in (2, 3, 1))
    for pair in ((two, three), (one, one), (two, Estimate(1.0, 0.1, 2))):
        with pytest.raises(ValueError, match=r"estimates must have the same parts, at least 2, got \["):
            Estimate.joint(np.divide, *pair)


def test_powers_of_several_bands_are_those_of_each():
    x = np.random.default_rng(5).standard_normal(8000)
    signal = Signal(x, 0.1, 256)
    for part in np.split(x, 8):
        signal.add(part)
    both = signal.power([0.0, 5.0], [5.0, np.inf])
    for i, band in enumerate([(0.0, 5.0), (5.0, np.inf)]):
        assert both.value[i] == signal.power(*band).value
        assert both.standard_error[i] == pytest.approx(signal.power(*band).standard_error, rel=1e-12)
    whole = Estimate.joint(np.sum, both)
    assert whole.value == pytest.approx(signal.power(0.0, np.inf).value, rel=1e-12)
    assert whole.standard_error == pytest.approx(signal.power(0.0, np.inf).standard_error, rel=1e-9)


def test_crossings_with_rates_are_those_of_the_cubics():
    rng = np.random.default_rng(6)
    x, rate = np.round(rng.standard_normal(1000)), 30.0 * rng.standard_normal(1000)  # zeros among them
    true = 0
    for a, b, u, v in zip(x[:-1], x[1:], 0.1 * rate[:-1], 0.1 * rate[1:], strict=True):
        cubic = np.polynomial.Polynomial([a, u, 3 * (b - a) - 2 * u - v, 2 * (a - b) + u + v])
        extrema = np.sort([root.real for root in cubic.deriv().roots() if root.imag == 0.0 and 0.0 < root.real < 1.0])
        values = np.array([a, *cubic(extrema), b])
        true += np.count_nonzero((values[:-1] <= 0.0) & (values[1:] > 0.0))
    assert abs(up_crossings(x, rate, 0.1) - true) <= 2  # extrema of 0 are above it or not by rounding


def test_estimates_say_when_they_know_nothing():
    assert math.isnan(Estimate.of_mean([1.0]).standard_error)
    assert Estimate.of_mean([1.0]).relative == math.inf
    with pytest.raises(ValueError, match="confidence must lie between 0 and 1, got 95"):
        Estimate.of_mean([1.0, 2.0]).interval(95)


def test_crossings_between_samples_show_in_the_rates():
    t = 0.35 * np.arange(4000)  # a small fast wave on a slow one: many pairs between two samples
    x, rate = np.sin(t) + 0.9 * np.sin(2.7 * t), np.cos(t) + 2.43 * np.cos(2.7 * t)
    fine = np.arange(0.0, t[-1], 0.001)
    true = up_crossings(np.sin(fine) + 0.9 * np.sin(2.7 * fine), None, 0.001)
    assert up_crossings(x, None, 0.35) <= true - 10
    assert abs(up_crossings(x, rate, 0.35) - true) <= 0.01 * true


def test_impacts_by_batch_are_those_of_the_log():
    t_in = np.array([0.5, 1.9, 2.5, 3.7])
    lasting = np.array([0.2, 0.3, 0.1, np.nan])
    force, zero = np.array([1.0, 4.0, 2.0, 9.0]), np.zeros(4)
    log = solvers.ContactLog(zero.astype(int), t_in, t_in + lasting, force, zero, zero, force, zero, zero, zero > 1)
    impacts = Impacts()
    impacts.add(log, 0, 0.0, 2.0)
    impacts.add(log, 0, 2.0, 4.0)
    impacts.add(log, 1, 4.0, 4.5)
    assert impacts.number == 4
    assert impacts.rate.value == pytest.approx(4 / 4.5)
    assert impacts.probability.value == pytest.approx((0.2 + 0.3 + 0.1 + 0.3) / 4.5)
    assert impacts.mean("duration").value == pytest.approx(0.2)
    assert impacts.std("peak_force").value == pytest.approx(np.std([1.0, 4.0, 2.0]))
    assert impacts.largest["peak_force"] == 4.0
    with pytest.raises(ValueError, match="no quantity 'speed'"):
        impacts.mean("speed")


def test_a_contact_that_one_segment_hands_to_the_next_began_once(monkeypatch):
    """Under tones: what always presses never enters, and with memory segments are cut wherever they end."""
    pressed = cantilever(1, base=fb.Harmonic(2e-4, 160.0), stops=[fb.Stop(0.3, law=KelvinVoigt(1e5, 10.0), gap=-1e-3)])
    parts = {"elements": [fb.Element(0.3, Jenkins(1e5, 2.0))], "stops": [fb.Stop(0.5, KelvinVoigt(1e5, 50.0))]}
    slider = replace(pressed.scene, **parts)
    for model in (pressed, slider.reduce(modes=1)):
        whole = stationary(model, 8.0, 1e-3, discard=1.0)
        with monkeypatch.context() as short:
            short.setattr(segments, "SEGMENT", 34.0)
            parts = stationary(model, 8.0, 1e-3, discard=1.0)
        assert parts.impacts[0].number == whole.impacts[0].number
        assert parts.impacts[0].probability.value == pytest.approx(whole.impacts[0].probability.value, rel=1e-3)


@pytest.mark.drawn
def test_transients_are_found_and_their_absence_too():
    """One calm record of 300 seems to go on settling, four of ten once in 1e5; of the others three of five so."""
    t = 0.02 * np.arange(100_000)
    calm = [settling(coloured(seed, t.size), 0.02, 1.0) for seed in range(10)]
    assert sum(found.died_out for found in calm) >= 7
    assert np.median([found.time for found in calm]) < 0.2 * t[-1]
    faded = [settling(coloured(seed, t.size) + 100.0 * np.exp(-t / 50.0), 0.02, 1.0) for seed in range(5)]
    assert sum(found.died_out for found in faded) >= 3
    assert 100.0 < np.median([found.time for found in faded]) < 0.5 * t[-1]  # at 100 s four deviations are left
    assert not settling(coloured(1, t.size) * t, 0.02, 1.0).died_out
    assert not settling(coloured(1, t.size) + t / 100.0, 0.02, 1.0).died_out
    with pytest.raises(ValueError, match="settling needs 32 batches of 100 s"):
        settling(coloured(1, t.size), 0.02, 100.0)


STEEL = fb.Section.circle(2.1e11, 7800.0, 0.01)
QUICK = solvers.Exponential(1e-8, ledger=False)


def cantilever(modes, damping=0.05, **features):
    return fb.Scene(fb.Beam(0.5, STEEL), [fb.Clamped(0.0)], damping=fb.ModalDamping(damping), **features).reduce(modes)


def within(found, exact, bias=0.0):
    """An interval that holds with 99.999 %, so that up to ten hold together with 99.99 %; the error is below 1 %."""
    assert found.relative < 0.01
    lo, hi = found.interval(0.99999)
    assert lo - abs(bias * exact) < exact < hi + abs(bias * exact)


@pytest.mark.drawn
def test_linear_beam_under_band_limited_base_motion():
    model = cantilever(2, base=fb.BandNoise(1e-4, (0.0, 1500.0), seed=7))
    found = stationary(model, 1200.0, 1e-3, solver=QUICK)["tip u"]
    w = np.linspace(0.0, 1500.0, 200_001)
    terms = zip(model.phi(0.5) * model.participation, model.omega, model.zeta, strict=True)
    H = sum(g * w**2 / (o**2 - w**2 + 2j * z * o * w) for g, o, z in terms)
    S = 1e-8 / 1500.0 * abs(H) ** 2
    variance, variance_of_rate = np.trapezoid(S, w), np.trapezoid(S * w**2, w)
    within(found.variance, variance)
    within(found.crossing_rate, math.sqrt(variance_of_rate / variance) / (2 * math.pi))
    within(found.std, math.sqrt(variance))
    assert abs(found.skewness.value) < 4 * found.skewness.standard_error
    assert abs(found.kurtosis.value - 3.0) < 4 * found.kurtosis.standard_error
    exact = np.interp(found.psd.omega, w, S)
    peak = np.argmax(exact)
    assert abs(found.psd.density[peak] - exact[peak]) < 5 * found.psd.standard_error[peak]


@pytest.mark.chaotic
def test_hertz_stop_under_wide_band_noise_has_the_exact_density():
    """One dashpot c and one noise force at the tip: white noise of S = 2cθ/π gives the density exp(-(T + V)/θ).

    V = Σ ω²q²/2 + 2/5 K δ^2.5, so δ is Gaussian times exp(-2/5 K δ^2.5/θ), its rate Gaussian with variance θ Σφ². The
    band ends at Ω: what lies beyond would carry the share 2c Σφ²/(πΩ) of the rate's variance, 0.4 % here with two
    modes, which lowers the contact rate by 0.2 %; of the displacement's it is (ω/Ω)² times less.
    """
    modes, theta, c, top, K = 2, 1e-3, 2.0, 8000.0, 1e7
    noise = fb.BandNoise(math.sqrt(2 * c * theta / math.pi * top), (0.0, top), seed=42)
    parts = {"dashpots": [fb.Dashpot(0.5, c)], "forces": [fb.PointForce(0.5, noise)]}
    model = cantilever(modes, damping=0.0, stops=[fb.Stop(0.5, law=Hertz(K))], **parts)
    found = stationary(model, 1000.0, 2e-3, solver=QUICK)
    phi = model.phi(0.5)
    sigma, rate = math.sqrt(theta * np.sum(phi**2 / model.omega**2)), math.sqrt(theta * np.sum(phi**2))
    delta = np.linspace(-9 * sigma, 9 * sigma, 200_001)
    p = np.exp(-((delta / sigma) ** 2) / 2 - 0.4 * K * np.maximum(delta, 0.0) ** 2.5 / theta)
    p /= np.trapezoid(p, delta)
    mean = np.trapezoid(delta * p, delta)
    bias = c * np.sum(phi**2) / (math.pi * top)
    assert bias < 0.003
    within(found["δ"].mean, mean)
    within(found["δ"].variance, np.trapezoid((delta - mean) ** 2 * p, delta))
    within(found.impacts[0].probability, np.trapezoid(np.where(delta > 0.0, p, 0.0), delta), bias)
    within(found.impacts[0].rate, np.interp(0.0, delta, p) * rate / math.sqrt(2 * math.pi), bias)


def test_contacts_of_further_bodies_count_as_those_of_the_run():
    """In the order of the log: what the scene itself meets, its impactor, then what its body meets."""
    law, beam = Hertz(1e8), fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))
    other = fb.Scene(beam, [fb.Clamped(0.0)], stops=[fb.Stop(0.5, law, name="ground")], damping=fb.ModalDamping(0.05),
                     forces=[fb.PointForce(0.3, fb.Harmonic(4.0, 230.0))])  # fmt: skip
    ball = fb.Impactor(0.2, mass=0.01, velocity=0.0, law=law, gap=1e-5, stiffness=300.0, damping=0.5)
    scene = fb.Scene(beam, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.05), base=fb.Harmonic(1e-4, 160.0),
                     stops=[fb.Stop(0.5, law)], elements=[fb.Element(0.3, Jenkins(1e5, 1.0))], impactors=[ball],
                     bodies=[other])  # fmt: skip
    model = scene.reduce(modes=1)
    found, log = stationary(model, 4.0, 1e-3, discard=0.0), model.simulate(4.0, 1e-3).contacts
    assert found.touching == (0, 2, 3)
    numbers = found.numbers()
    for stop, name in ((0, "stop 0"), (2, "stop 2"), (3, "ground")):
        mine = (log.stop == stop) & (log.t_in > 0.0)
        assert numbers[f"{name} rate"].value == pytest.approx(np.count_nonzero(mine) / found.duration, rel=0.02)
        forces = log.peak_force[mine & np.isfinite(log.t_out)]
        assert numbers[f"{name} peak_force"].value == pytest.approx(forces.mean(), rel=0.02)
        assert len(forces) > 20


def test_tones_go_on_through_the_segments(monkeypatch):
    model = cantilever(2, base=fb.Harmonic(2e-4, 160.0), stops=[fb.Stop(0.5, law=Hertz(1e8))])
    whole = stationary(model, 8.0, 1e-3, discard=1.0)
    monkeypatch.setattr(segments, "SEGMENT", 34.0)
    parts = stationary(model, 8.0, 1e-3, discard=1.0)
    assert whole["δ"].batches.per_row < parts["δ"].batches.full / 8
    assert parts.impacts[0].number == whole.impacts[0].number > 100
    assert parts["δ"].variance.value == pytest.approx(whole["δ"].variance.value, rel=1e-3)
    assert parts.discarded == pytest.approx(1.0, abs=0.01)


@pytest.mark.drawn
def test_errors_are_those_between_seeds():
    """The lines carry the same power whatever the seed, so that parts of one realisation scatter several times as much.

    Over 20 runs the mean of the squared errors is known to √(2/7/20) = 0.12 and the variance between the runs to
    √(2/19) = 0.32 of itself, together 0.35; their ratio lies within exp(±4 * 0.35).
    """
    model = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 1500.0), period=15.0))
    found = []
    for seed in range(20):
        noise = replace(model.scene.base, seed=seed)
        response = stationary(model.under(replace(model.scene, base=noise)), 60.0, 2e-3, solver=QUICK)
        found.append(response["tip u"].variance)
    between = np.var([e.value for e in found], ddof=1)
    claimed = np.mean([e.standard_error**2 for e in found])
    assert abs(math.log(claimed / between)) < 4 * 0.35


def test_a_period_of_few_correlation_times_makes_the_response_less_than_gaussian():
    """Kurtosis 3 - 1.5 Σa⁴/(Σa²)² of a sum of lines of fixed size, 3 - 1.5/(ζω period) of a mode's response."""
    omega, zeta, times, found = 100.0, 0.05, 20.0, []
    for seed in range(3000):
        noise = fb.BandNoise(1.0, (0.0, 4.0 * omega), seed, period=times / (zeta * omega))
        a = noise.amplitude / (omega**2 - noise.omega**2 + 2j * zeta * omega * noise.omega)
        x = np.fft.irfft(np.append(0.0, a), 4 * a.size)  # over one period, to a factor
        found.append((x**4).mean() / (x**2).mean() ** 2)
    mean, error = np.mean(found), np.std(found) / math.sqrt(len(found))
    assert mean == pytest.approx(3.0 - 1.5 * (np.abs(a) ** 4).sum() / (np.abs(a) ** 2).sum() ** 2, abs=4.0 * error)
    assert mean == pytest.approx(3.0 - 1.5 / times, abs=4.0 * error)
    assert mean < 3.0 - 4.0 * error


def test_a_batch_is_a_realisation_of_its_own():
    model = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 1500.0)))
    for seconds, batches in ((80.0, 16), (20.0, 4), (10.0, 2)):
        signal = stationary(model, seconds, 2e-3, solver=QUICK)["tip u"]
        rows = signal.batches.filled
        assert len(rows) == batches
        assert np.ptp(rows[:, 0]) <= 1  # samples
        assert signal.psd.n_segments >= 2 * batches
        lo, hi = signal.psd.interval()
        assert np.all((lo > 0.0) & (lo < hi))


@pytest.mark.drawn
def test_a_slow_start_leaves_the_number_of_batches_as_it_is():
    """Of 60 draws the settling takes 0.36 to 1.85 times as long as the start is above the motion, 0.92 but for one."""
    times = []
    for seed in range(5):
        model = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 1500.0), seed=seed))
        calm = stationary(model, 80.0, 2e-3, solver=QUICK)
        slow = stationary(model, 80.0, 2e-3, solver=QUICK, start=[100.0, 0.0])
        size = model.simulate(20.0, 2e-3, solver=QUICK).q[2500:].std()
        times.append(slow.settling.time / (correlation_time(model) * math.log(100.0 / size)))
        assert slow["tip u"].variance.batches == calm["tip u"].variance.batches == 16
        assert slow.duration == pytest.approx(80.0, abs=0.1)
    assert 0.6 < np.median(times) < 2.0


@pytest.mark.parametrize("rest", [0.0, 0.3, 0.6, 0.9])
def test_a_duration_of_a_broken_number_of_samples(rest):
    """What is left of it after the last realisation, less than a sample, is no batch of its own."""
    model, dt = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 1500.0))), 2e-3
    found = stationary(model, (8000 + rest) * dt, dt, solver=QUICK)
    rows = found["tip u"].batches.filled
    assert np.ptp(rows[:, 0]) <= 16  # samples, one a realisation
    assert found.duration == pytest.approx(8000 * dt, abs=1.5 * dt)


def test_a_run_too_short_for_errors_says_so():
    model = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 1500.0)))
    with pytest.warns(UserWarning, match=r"5 s hold one realisation of the noise, .* simulate at least 9.6"):
        found = stationary(model, 5.0, 2e-3, solver=QUICK)
    assert math.isnan(found["tip u"].variance.standard_error)
    assert all(np.isnan(found["tip u"].kurtosis.interval()))
    with pytest.warns(UserWarning, match="simulate at least 75.* s, or give a shorter segment= of the spectrum"):
        stationary(model, 5.0, 2e-3, solver=QUICK, segment=12_500)


def test_a_slow_structure_has_a_spectrum_too():
    """At 0.02 rad/s, sampled ten times a period, two rad/s are half a sample."""
    slow = fb.Section.circle(2.1e3, 7800.0, 0.01)
    scene = fb.Scene(fb.Beam(0.5, slow), [fb.Clamped(0.0)], damping=fb.ModalDamping(0.05))
    model = replace(scene, base=fb.BandNoise(1e-4, (0.0, 0.1))).reduce(modes=1)
    omega = float(model.omega[0])
    found = stationary(model, 64.0 * 20.0 / omega, 0.6 / omega, solver=QUICK)["tip u"].psd
    assert found.omega[1] < 0.2 * omega
    assert found.omega[np.argmax(found.density)] == pytest.approx(omega, rel=0.2)


@pytest.mark.drawn
def test_it_stops_when_enough_is_known():
    model = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 600.0), seed=1))
    found = stationary(model, 1e5, 2e-3, until=0.02)
    assert found.enough
    assert found["tip u"].variance.relative <= 0.02
    assert found.duration < 2000.0
    by_mean = stationary(model, 300.0, 2e-3, until=0.001, of=lambda r: r["tip u"].kurtosis)
    assert by_mean.enough is False
    assert by_mean.duration == pytest.approx(300.0)
    assert stationary(model, 20.0, 2e-3, until=0.5).enough  # known from four batches, all there are


def test_the_same_seed_gives_the_same_bits_and_the_model_is_left_alone():
    model = cantilever(1, base=fb.BandNoise(1e-4, (0.0, 600.0), seed=1))
    a, b = (stationary(model, 60.0, 2e-3)["tip u"] for _ in range(2))
    assert np.array_equal(a.batches.rows, b.batches.rows)
    assert model.scene.base.seed == 1


def test_a_record_is_one_segment():
    t = np.linspace(0.0, 60.0, 60_001)
    record = fb.Record(t, 1e-5 * np.minimum(t, 1.0) ** 3 * coloured(3, t.size), band=(5.0, 600.0))  # from rest
    found = stationary(cantilever(1, base=record), 60.0, 2e-3)
    assert found.duration + found.discarded == pytest.approx(60.0)


def test_few_samples_under_tones():
    """What is left after the last free flight may be a few samples, and a lead-in longer than the rest of the run."""
    stop = fb.Stop(0.5, KelvinVoigt(1e5, 50.0))
    model = cantilever(2, base=fb.Harmonic(2e-4, 160.0), stops=[stop])
    for samples in range(100, 112):
        for discard in (0.0, 3.0):
            found = stationary(model, samples * 2e-3, 2e-3, discard=discard)
            assert found.duration == pytest.approx(samples * 2e-3, abs=3e-3)


def test_a_transient_that_lasts_is_warned_of():
    t = np.linspace(0.0, 60.0, 60_001)
    growing = fb.Record(t, 1e-5 * (t / 10.0) ** 2 * np.sin(100.0 * t))
    with pytest.warns(UserWarning, match="transient has not died out"):
        found = stationary(cantilever(1, base=growing), 60.0, 2e-3)
    assert not found.settling.died_out


def test_memory_of_many_modes():
    """A decay of 0.5 1/s beside frequencies of 1e5 rad/s and their squares."""
    model = cantilever(20, damping=0.005, base=fb.BandNoise(1e-4, (0.0, 600.0)))
    assert correlation_time(model) == pytest.approx(1.0 / (0.005 * model.omega[0]), rel=1e-9)
    light = cantilever(12, damping=1e-7, base=fb.BandNoise(1e-4, (0.0, 600.0)))
    assert correlation_time(light) == pytest.approx(1e7 / light.omega[0], rel=1e-3)


NOISE = fb.BandNoise(1e-4, (0.0, 600.0))
RECORD = fb.Record(np.linspace(0.0, 8.0, 801), 1e-5 * np.hanning(801) * coloured(3, 801), band=(5.0, 300.0))


def watched(duration=10.0, dt=2e-3, damping=0.05, base=NOISE, **options):
    return stationary(cantilever(1, damping, base=base), duration, dt, **options)


test_bad_input = refused_by(
    lambda arguments: watched(**arguments),
    ({"duration": -1.0}, "duration"),
    ({"dt": 0.0}, "dt"),
    ({"dt": 1.0}, "64 samples"),
    ({"until": 2.0}, "until must be"),
    ({"discard": -1.0}, "discard"),
    ({"duration": 1.0}, "duration must be at least 3.5"),
    ({"bins": {"x": [0.0, 1.0]}}, "bins names 'x', which is not watched; there are tip u, mid-beam u"),
    ({"levels": {"x": 0.0}}, "levels names 'x'"),
    ({"base": None}, "something that drives it"),
    ({"damping": 0.0}, "needs damping in every mode"),
    ({"base": replace(NOISE, period=2.0)}, "lengthen the period of the noise"),
    ({"base": RECORD, "duration": 6.0, "discard": 5.9}, "at least 64 samples of the duration of 6 s, got 5.9 s"),
    ({"base": fb.Harmonic(2e-4, 160.0), "duration": 1e40}, r"dt must leave fewer than 1e\+13 samples of .* 1e\+40 s"),
)


def test_signals_are_asked_for_by_name():
    with pytest.raises(KeyError, match="no signal 'tip' was watched; there are tip u, mid-beam u"):
        watched()["tip"]
