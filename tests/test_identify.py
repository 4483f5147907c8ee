"""Laws from synthetic measurements whose truth is known."""

import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from refusals import refused_by
from scipy.stats import binom

from contacts import Hysteretic, achieved_restitution, bounce, identify, read_collisions
from contacts.identification.fit import _Fit
from contacts.identification.records import collisions_of

sys.path.insert(0, str(Path(__file__).parent / "bench"))
from collisions import KINDS, LAW, collisions, coverage


def exact(**options):
    """Measurements without noise."""
    return collisions(np.random.default_rng(0), **options)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
@pytest.mark.parametrize("timed", [False, True])
def test_clean_measurements_give_the_law_back(exponent, timed):
    law = Hysteretic(2e5, 0.4, exponent) if exponent == 1.0 else Hysteretic(2.1e8, 0.4, exponent)
    data = exact(law=law, samples=120, timed=timed)
    for free in (exponent, None):
        found = identify(**data, exponent=free)
        tolerance = 2e-3 if timed else 2e-4
        assert found.stiffness.value == pytest.approx(law.stiffness, rel=50 * tolerance if free is None else tolerance)
        assert found.exponent.value == pytest.approx(exponent, abs=tolerance)
        assert found.damping_factor.value == pytest.approx(0.4, rel=3 * tolerance)
        assert found.restitution.value == pytest.approx(achieved_restitution(0.4), rel=2 * tolerance)
        assert found.nominal.value == pytest.approx(np.sqrt(1 - 1.6 / 3), rel=2 * tolerance)
        assert not found.remarks


def test_each_collision_is_described():
    found = identify(**exact(samples=200))
    for one, speed in zip(found.collisions, (0.2, 0.3, 0.4), strict=True):
        left = achieved_restitution(LAW.damping_factor) * speed
        assert one.entry_rate == pytest.approx(speed, rel=1e-3)
        assert one.exit_rate == pytest.approx(left, rel=1e-2)
        assert one.energy_loss == pytest.approx(0.5 * 0.03 * (speed**2 - left**2), rel=1e-3)
        assert one.stiffness == pytest.approx(LAW.stiffness, rel=1e-3)
        assert one.damping_factor == pytest.approx(LAW.damping_factor, rel=2e-3)
    assert found.loop_stiffness == pytest.approx(LAW.stiffness, rel=3e-3)
    assert found.loop_damping_factor == pytest.approx(LAW.damping_factor, rel=5e-3)
    assert found.law.stiffness == found.stiffness.value
    assert "restitution" in str(found)


def test_zeros_are_found():
    found = identify(**exact(samples=100, offset_force=0.1, offset_delta=3e-6))
    assert found.indentation_offset.value == pytest.approx(3e-6, rel=1e-3)
    assert found.force_offset.value == pytest.approx(0.1 * 60.7, rel=0.1)
    assert found.stiffness.value == pytest.approx(LAW.stiffness, rel=1e-3)
    with pytest.warns(UserWarning, match="neighbouring residuals are correlated"):
        ignored = identify(**exact(samples=100, offset_force=0.1, offset_delta=3e-6), offsets=False)
    assert ignored.stiffness.value > 1.01 * LAW.stiffness


@pytest.mark.drawn
@pytest.mark.parametrize("kind", ["force noise 2 %", "time, noise 1 % on both"])
def test_intervals_hold_the_truth_as_often_as_they_say(kind):
    # tests/bench/collisions.py does more experiments and kinds; here what 95 % rejects once in a million
    made, options = KINDS[kind]
    count = 25
    shares, widths = coverage(count, made, options, seed=11)
    fewest = binom.ppf(1e-6, count, 0.95)
    assert np.all(count * shares[[0, 2, 3]] >= fewest), shares
    assert widths[0] < 0.03
    assert widths[1] < 0.05


def test_a_record_is_cut_into_its_collisions():
    data = exact(samples=80, timed=True, speeds=(0.2, 0.3, 0.4))
    away = np.full(50, -1e-2)
    touch = np.where(np.abs(np.arange(50) - 25) < 5, 0.08 * np.max(data["delta"]), -1e-4)  # below a tenth: no collision
    pieces, start = {"time": [], "delta": [], "force": []}, 0.0
    gaps = np.full(50, -1e-4), touch, away
    for t, delta, force, gap in zip(data["time"], data["delta"], data["force"], gaps, strict=True):
        dt = t[1] - t[0]
        pieces["time"] += [start + t - t[0], start + t[-1] - t[0] + dt * np.arange(1, 51)]
        pieces["delta"] += [delta, gap]
        pieces["force"] += [force, 0.0 * gap]
        start = pieces["time"][-1][-1] + dt
    record = {name: np.concatenate(parts) for name, parts in pieces.items()}
    found = identify(**record)
    assert [round(one.entry_rate, 2) for one in found.collisions] == [0.2, 0.3, 0.4]
    assert found.damping_factor.value == pytest.approx(LAW.damping_factor, rel=1e-2)
    kept = {name: column.copy() for name, column in record.items()}
    identify(**record)
    for name, column in record.items():
        np.testing.assert_array_equal(column, kept[name])


@pytest.mark.drawn
@pytest.mark.filterwarnings("ignore:neighbouring residuals")
def test_collisions_that_disagree_are_told():
    rng = np.random.default_rng(5)
    soft = collisions(rng, law=Hysteretic(1.8e8, 0.5625), speeds=(0.2, 0.3), noise_force=0.01)
    hard = collisions(rng, law=Hysteretic(2.4e8, 0.5625), speeds=(0.25, 0.35), noise_force=0.01)
    together = {name: soft[name] + hard[name] for name in soft}
    with pytest.warns(UserWarning, match=r"collisions disagree in stiffness, 0\.8.* to 1\.1.* times the common one"):
        found = identify(**together)
    assert found.stiffness.low < 2.0e8
    assert found.stiffness.high > 2.2e8
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        alone = identify(**soft)
    assert (alone.stiffness.high - alone.stiffness.low) < 0.5 * (found.stiffness.high - found.stiffness.low)


def fit_of_three():
    """Cut after the top, as κ and κa of whole collisions are independent; 2 % noise of the force, zeros known."""
    data = collisions(np.random.default_rng(1), law=Hysteretic(2.1e8, 2.0), samples=200, noise_force=0.02)
    most = {name: [x[:120] for x in records] for name, records in data.items()}
    return _Fit(collisions_of(**most, time=None), 1.5, False)


def test_errors_of_one_collision_by_itself():
    """Of ln κ and a: s² (JᵀJ)⁻¹ with the slopes of the law by central differences; the motion has no noise."""
    fit = fit_of_three()
    for i, one in enumerate(fit.measured):
        found, errors = fit.alone(i, inflation=1.0)
        x, s = np.maximum(one.delta, 0.0) / fit.depth, one.delta_dot / fit.motions[i].entry_rate

        def law(theta, x=x, s=s):
            return np.exp(theta[0]) * x**1.5 * (1.0 + theta[1] * s)

        J = np.column_stack([(law(found + h) - law(found - h)) / 2e-5 for h in 1e-5 * np.eye(2)])
        left = law(found) - one.force / fit.strength
        covariance = left @ left / (len(left) - 2) * np.linalg.inv(J.T @ J)
        np.testing.assert_allclose(errors, np.sqrt(np.diag(covariance)), rtol=1e-4)


@pytest.mark.parametrize("column", [0, 1])
def test_intervals_widen_by_the_scatter_of_collisions(column):
    """Birge's ratio: standard deviation over standard error where all errors are the same; 1 where they agree."""
    fit, x = fit_of_three(), np.array([0.0, 0.3, -0.1, 0.25, 0.05])
    values = np.where(np.arange(2) == column, x[:, None], 0.5)
    for error, wanted in ((0.02, np.std(x, ddof=1) / 0.02), (0.5, 1.0)):
        singles = [(one, np.full(2, error)) for one in values]
        widening, remarks = fit._disagreement(singles)
        assert widening == pytest.approx(wanted, rel=1e-12)
        assert len(remarks) == (wanted > 1.0)


@pytest.mark.drawn
@pytest.mark.filterwarnings("ignore:collisions disagree")
def test_a_filtered_channel_is_told_and_widens():
    """Of 300 draws one is less than twice as wide, and one in 300 is widened by chance: three of five once in 3e5."""
    rng = np.random.default_rng(6)
    ratios = []
    for _ in range(5):
        data = collisions(rng, samples=200)
        white = rng.standard_normal((3, 219))
        smooth = np.array([np.convolve(row, np.full(20, 20**-0.5), "valid") for row in white])
        rough = {**data, "force": [f + 0.5 * w[:200] for f, w in zip(data["force"], white, strict=True)]}
        filtered = {**data, "force": [f + 0.5 * s for f, s in zip(data["force"], smooth, strict=True)]}
        with pytest.warns(UserWarning, match="neighbouring residuals are correlated"):
            wide = identify(**filtered).stiffness
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # collisions that disagree by chance
            narrow = identify(**rough).stiffness
        ratios.append((wide.high - wide.low) / (narrow.high - narrow.low))
    assert np.median(ratios) > 2.0


def test_files(tmp_path):
    data = collisions(np.random.default_rng(7), samples=40, noise_force=0.01, timed=True)
    rows = ["force\tcollision\tdelta\ttime\tdelta_dot"]
    for number in range(3):
        columns = [data[name][number] for name in ("force", "delta", "time")]
        rows += [f"{F!r}\t{number}\t{d!r}\t{t!r}\t0" for F, d, t in zip(*map(np.ndarray.tolist, columns), strict=True)]
    path = tmp_path / "measured.txt"
    path.write_text("\n".join(rows))
    assert str(identify(**read_collisions(path))) == str(identify(**data))
    path.write_text("")
    with pytest.raises(ValueError, match="no column 'delta'; its first line names nothing"):
        read_collisions(path)


test_bad_measurements_are_refused = refused_by(
    lambda change: identify(**{**exact(), **change}),
    ({"delta_dot": None}, "either delta_dot or time"),
    ({"force": None}, "needs the force"),
    ({"force": [np.ones(60)] * 2}, "force must have as many records as delta, 3, got 2"),
    ({"force": [np.ones(59)] * 3}, "record 1 has arrays of different lengths"),
    ({"force": [np.full(60, np.nan)] * 3}, "force of record 1 must be a finite vector, got nan"),
    ({"force": [["a"] * 60] * 3}, "force of record 1 must be a number, got"),
    ({"force": [np.zeros(60)] * 3}, "force of collision 1 is 0 N throughout; leave the collision out"),
    ({"delta": [-np.ones(60)] * 3}, "record 1 has no contact"),
    ({"delta_dot": [-np.ones(60)] * 3}, "0 samples that move in"),
    ({"exponent": 0.9}, "exponent of identify must be finite and >= 1"),
    ({"confidence": 1.0}, r"confidence must lie in \(0, 1\)"),
)


def test_too_few_samples_are_refused():
    """Whether the last of seven is in contact is rounding."""
    with pytest.raises(ValueError, match=r"collision 1 has [56] samples in contact, at least 8 are needed"):
        identify(**exact(samples=7))
    data = exact(samples=40, timed=True)
    with pytest.raises(ValueError, match="time of record 1 must increase, it does not at sample 1"):
        identify(**{**data, "time": [t[::-1] for t in data["time"]]})


def loops_of(law, speeds=(0.2, 0.4), timed=False):
    """Measurements of bounces, as arguments of identify."""
    hits = [bounce(law, speed, mass=0.03) for speed in speeds]
    motion = {"time": [h.t for h in hits]} if timed else {"delta_dot": [h.delta_dot for h in hits]}
    return {"delta": [h.delta for h in hits], "force": [h.force for h in hits], **motion}


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("factor", [0.0, 1e-17, 1e-12, 1e-6])
def test_nearly_elastic_collisions_are_found_whatever_the_rounding(timed, factor):
    found = identify(**loops_of(Hysteretic(2.1e8, factor), timed=timed))
    assert found.damping_factor.value == pytest.approx(factor, abs=1e-6 if timed else 1e-11)
    assert found.restitution.value == pytest.approx(1.0, abs=2e-6)
    assert found.stiffness.value == pytest.approx(2.1e8, rel=1e-4)


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("exponent", [1.5, None])
def test_a_force_that_pulls_is_refused(timed, exponent):
    data = loops_of(Hysteretic(2.1e8, 0.5625), timed=timed)
    negated = data | {"force": [-force for force in data["force"]]}
    with pytest.raises(ValueError, match=r"force of collision 1 falls with indentation .* change its sign"):
        identify(**negated, exponent=exponent)
    second = data | {"force": [data["force"][0], -data["force"][1]]}
    with pytest.raises(ValueError, match="force of collision 2 falls with indentation"):
        identify(**second, exponent=exponent)


@pytest.mark.parametrize("factor", [0.05, 1e3])
@pytest.mark.filterwarnings("ignore:neighbouring residuals")
def test_a_force_that_is_mostly_damping_is_no_force_that_pulls(factor):
    found = identify(**loops_of(Hysteretic(2.1e8, factor)))
    assert found.damping_factor.value == pytest.approx(factor, rel=1e-2)
    identify(
        **loops_of(Hysteretic(2.1e8, min(factor, 50.0)), timed=True)
    )  # the smoothed motion may be poor, not refused


@pytest.mark.parametrize("timed", [False, True])
@pytest.mark.parametrize("size", [1e300, 1e-150])
@pytest.mark.parametrize("what", ["delta", "force", "motion"])
def test_sizes_that_no_record_has_are_refused(timed, size, what):
    data = loops_of(Hysteretic(2.1e8, 0.5625), timed=timed)
    name = what if what != "motion" else "time" if timed else "delta_dot"
    data[name] = [size * one for one in data[name]]
    with pytest.raises(ValueError, match=rf"{name} reaches .* where 1e-30 to 1e\+30 can be computed with"):
        identify(**data)


def test_any_units_within_these_give_the_same_law():
    data = loops_of(Hysteretic(2.1e8, 0.5625))
    for size in (1e-20, 1e20):
        found = identify(data["delta"], data["delta_dot"], [size * force for force in data["force"]])
        assert found.stiffness.value == pytest.approx(2.1e8 * size, rel=1e-6)
        found = identify([size * one for one in data["delta"]], data["delta_dot"], data["force"])
        assert found.stiffness.value == pytest.approx(2.1e8 / size**1.5, rel=1e-6)


T = np.linspace(0.0, np.pi, 60)
HALF_SINE = {"delta": np.sin(T), "delta_dot": np.cos(T), "force": np.sin(T) ** 1.5}

test_options_and_records_that_are_none_are_refused = refused_by(
    lambda change: identify(**{**HALF_SINE, **change}),
    ({"force": np.full(60, 5.0)}, "force of collision 1 is 5 N throughout; leave the collision out"),
    ({"exponent": 9.0}, "exponent of identify must be at most 8 in size, got 9.0"),
    ({"exponent": "1.5"}, "exponent of identify must be a number, got '1.5'"),
    ({"confidence": "high"}, "confidence must be a number, got 'high'"),
    ({"offsets": None}, "offsets must be fitted or not, True or False, got None"),
    ({"force": np.full(60, 1j)}, r"force of record 1 must be a number, got 1j"),
    ({"force": ["5"] * 60}, "force of record 1 must be a number, got '5'"),
)


def test_a_sample_at_the_surface_does_not_change_the_interval():
    """The interval takes the entry rate's derivative by the surface; that a sample enters there is no part of it."""
    data = collisions(np.random.default_rng(10), samples=80, noise_force=0.01, noise_delta=0.01, timed=True)
    found, depth = identify(**data), data["delta"][2].max()
    usual = found.damping_factor.high - found.damping_factor.low
    last = int(np.flatnonzero(data["delta"][2] > found.indentation_offset.value)[-1])
    for _ in range(2):  # the surface moves with the sample, less the second time
        data["delta"][2][last] = found.indentation_offset.value + 3e-5 * depth
        found = identify(**data)
    assert 1e-5 < (data["delta"][2][last] - found.indentation_offset.value) / depth < 5e-5
    assert found.damping_factor.high - found.damping_factor.low == pytest.approx(usual, rel=0.1)
