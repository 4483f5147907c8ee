"""Earthquake records from columns, PEER and COSMOS files: units, time step, baseline, headers that are wrong."""

import numpy as np
import pytest

import fembeam as fb
from fembeam.excitation.earthquake import without_baseline
from fembeam.scene_file import SceneFileError

STEP = 0.005
T = STEP * np.arange(803)
QUAKE = np.round(0.2 * np.exp(-(((T - 1.5) / 0.6) ** 2)) * np.sin(20.0 * T), 5)  # g


def rows(values, count, width, digits):
    """Values in Fortran's columns, which may touch each other."""
    lines = (values[i : i + count] for i in range(0, len(values), count))
    return "".join("".join(f"{value:{width}.{digits}f}" for value in line) + "\n" for line in lines)


def peer(head="NPTS=    803, DT=   .0050 SEC,", unit="ACCELERATION TIME SERIES IN UNITS OF G"):
    return f"PEER NGA STRONG MOTION DATABASE RECORD\nImperial, 5/19/1940, 180\n{unit}\n{head}\n" + rows(QUAKE, 5, 15, 7)


def cosmos(unit="cm/sec2(04)", factor=981.0, step=0.005, step_ms=-999.0, seconds=4, width=10, count=803):
    real = np.full(100, -999.0)
    real[5], real[33], real[61], real[34] = -12345.7, step, step_ms, 63.6
    head = "Corrected acceleration  (Format v01.20 with 13 text lines)\n" + "text of 12725 pts\n" * 12
    head += " 100 Integer-header values follow on  10 lines, Format= (10I8)\n" + ("    -999" * 10 + "\n") * 10
    head += " 100 Real-header values follow on  17 lines, Format= (6F13.6)\n" + rows(real, 6, 13, 6)
    head += '   2 Comment line(s) follow, each starting with a "|":\n| 803 acceleration pts are below\n|\n'
    data = f"     {count} acceleration pts, approx  {seconds} secs, units={unit},Format=(8F{width}.3)\n"
    other = "      3 velocity pts, approx  1 secs, units=cm/sec (05),Format=(8F10.5)\n   1.00000   2.00000   3.00000\n"
    return head + data + rows(QUAKE * factor, 8, width, 3) + "End-of-data for Chan  1 acceleration\n" + other


@pytest.mark.parametrize("text", [peer(), peer("  803    0.0050   NPTS, DT"), peer("NPTS=  803  DT= 5.0E-3 SEC,")])
def test_a_peer_file_is_in_g(tmp_path, text):
    (tmp_path / "quake.AT2").write_text(text)
    record = fb.Record.earthquake(tmp_path / "quake.AT2", baseline=False)
    assert (record.quantity, record.interpolation) == ("acceleration", "linear")
    np.testing.assert_allclose(record.t, T, atol=1e-12)
    np.testing.assert_allclose(record.y, 9.80665 * QUAKE, rtol=1e-12)
    assert record.derivative(2)(1.5 + STEP / 2) == pytest.approx(9.80665 * QUAKE[300:302].mean())


@pytest.mark.parametrize(
    ("options", "scale"),
    [
        ({}, 9.81),
        ({"width": 8}, 9.81),  # columns touch
        ({"unit": "cm/s^2 (4)", "step": 0.0025, "step_ms": 5.0}, 9.81),  # resampled
        ({"unit": "g (02)", "factor": 1.0}, 9.80665),
    ],
)
def test_a_cosmos_file_says_unit_step_and_columns(tmp_path, options, scale):
    (tmp_path / "quake.v2").write_text(cosmos(**options))
    record = fb.Record.earthquake(tmp_path / "quake.v2", baseline=False, padding=2.0)
    np.testing.assert_allclose(record.t, T, atol=1e-12)
    np.testing.assert_allclose(record.y, scale * QUAKE, atol=1e-2 if "factor" in options else 1e-5)
    assert record.duration == pytest.approx(T[-1] + 2.0)


def test_columns_in_any_unit_and_in_a_scene_file(tmp_path, file_of):
    for unit, factor in (("g", 9.80665), ("m/s2", 1.0), ("cm/s2", 0.01)):
        np.savetxt(tmp_path / "quake.csv", np.column_stack([T, QUAKE]), header="t,a", delimiter=",", comments="")
        record = fb.Record.earthquake(tmp_path / "quake.csv", unit, baseline=False)
        np.testing.assert_allclose(record.y, factor * QUAKE, rtol=1e-12)
    beam = '[beam]\nlength = 1.0\nsection = { shape = "circle", E = 2e11, rho = 7800, diameter = 0.01 }\n[base]\n'
    text = beam + 'kind = "earthquake"\npath = "quake.csv"\nunit = "g"\npadding = 1\n'
    text += '[[supports]]\nkind = "clamped"\nz = 0\n'
    base = file_of(text).scene.base
    np.testing.assert_allclose(base.y, without_baseline(T, 9.80665 * QUAKE), rtol=1e-12)
    assert base.padding == 1.0
    with pytest.raises(SceneFileError, match="unit must be 'g' or 'm/s2' or 'cm/s2', got 'G'"):
        file_of(text.replace('"g"', '"G"'))


def test_the_baseline_is_the_parabola_of_least_velocity():
    clean = without_baseline(T, QUAKE)
    offset = 0.02 + 0.01 * T - 0.004 * T**2
    np.testing.assert_allclose(without_baseline(T, QUAKE + offset), clean, atol=1e-14)
    np.testing.assert_allclose(without_baseline(T, clean), clean, atol=1e-15)
    from scipy.integrate import cumulative_trapezoid, trapezoid

    def mean_square(a):
        return trapezoid(cumulative_trapezoid(a, T, initial=0.0) ** 2, T)

    for power in range(3):  # any other parabola is worse, on both sides alike
        more, less = (mean_square(clean + sign * 1e-6 * T**power) - mean_square(clean) for sign in (1, -1))
        assert more > 0.0
        assert more == pytest.approx(less, rel=1e-4)


def test_the_baseline_of_a_short_record_cut_amid_its_motion():
    """Its parabola against the integrals of v² of straight lines: displacements were off by 1.7e-2."""
    t = 0.01 * np.arange(201)
    noise = np.random.default_rng(0).normal(size=201) * np.exp(-(((t - 1.0) / 0.4) ** 2)) + 0.05 - 0.01 * t
    fine, step = np.linspace(0.0, 2.0, 8001, retstep=True)
    given = np.interp(fine, t, noise)
    motion = np.cumsum(np.cumsum(given - np.interp(fine, t, noise - without_baseline(t, noise)))) * step**2
    exact = np.cumsum(np.cumsum(without_baseline(fine, given))) * step**2
    np.testing.assert_allclose(motion, exact, atol=1e-3 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("0 1\n1 2\n", {}, "unit must be 'g' or 'm/s2' or 'cm/s2' for a file of columns, got None"),
        ("0 1\n1 2\n", {"unit": "m/s²"}, "unit must be 'g'"),
        ("0 1\n1 2\n", {"unit": "g"}, "Record needs t and y of one length of at least 8"),
        (peer(), {"unit": "g"}, "unit must be left out, got 'g': the file says g"),
        (peer(unit="VELOCITY TIME SERIES IN UNITS OF CM/S"), {}, "a PEER file must be an acceleration in units of g"),
        (peer()[:-46], {}, "its header says 803 samples, there are 800"),
        (peer().replace("0.0", "x.0"), {}, "its data are not numbers alone"),
        (cosmos(unit="counts (50)"), {}, "the unit of its acceleration must be g, m/s2 or cm/s2, it is 'counts'"),
        (cosmos(step=-999.0), {}, "803 samples of nan s do not make the 4 s"),
        (cosmos(step=0.01), {}, "803 samples of 0.01 s do not make the 4 s"),
        (cosmos(count=900), {}, "its (header says 900 samples, there are|data are not numbers)"),
        (cosmos().replace("acceleration pts, approx", "velocity pts"), {}, "the COSMOS file has no acceleration"),
    ],
)
def test_what_is_wrong_is_said_with_the_file(tmp_path, text, options, message):
    (tmp_path / "quake.txt").write_text(text)
    with pytest.raises(ValueError, match=rf"quake\.txt: {message}"):
        fb.Record.earthquake(tmp_path / "quake.txt", **options)


def test_check_follows_a_record_to_its_end(tmp_path, file_of, recwarn):
    """Shaken late, and not for twenty periods of the beam: the trial is as long as the record."""
    from fembeam.inspection import check

    (tmp_path / "quake.AT2").write_text(peer())
    beam = '[beam]\nlength = 2.0\nsection = { shape = "circle", E = 2e11, rho = 7800, diameter = 0.01 }\n'
    support = '[[supports]]\nkind = "clamped"\nz = 0\n[damping]\nzeta = 0.02\n'
    stop = '[[stops]]\nz = 2.0\ngap = 5e-3\nlaw = { kind = "hertz", stiffness = 1e7 }\n'
    text = beam + support + stop + '[base]\nkind = "earthquake"\npath = "quake.AT2"\n'
    file = file_of(text)
    model = file.scene.reduce(2)
    assert 20 * 2 * np.pi / model.omega[0] > T[-1]
    assert check(model).touched[0].contacts > 0
    assert not [str(w.message) for w in recwarn if "a trial" in str(w.message)]


def test_a_peer_header_may_be_in_small_letters_and_needs_a_step(tmp_path):
    path = tmp_path / "quake.AT2"
    path.write_text(peer("npts=  803, dt= .0050 sec", "acceleration time series in units of g"))
    np.testing.assert_allclose(fb.Record.earthquake(path, baseline=False).y, 9.80665 * QUAKE, rtol=1e-12)
    for step, message in (
        ("-", "its data are not numbers alone"),
        (".0000", "DT of its header must be positive, got 0"),
    ):
        path.write_text(peer(f"NPTS=  803, DT= {step} SEC"))
        with pytest.raises(ValueError, match=rf"quake\.AT2: {message}"):
            fb.Record.earthquake(path)


@pytest.mark.parametrize("columns", [0, None, (0, -1), (0,), (True, 1)])
def test_columns_are_two_numbers_from_0(tmp_path, columns):
    np.savetxt(tmp_path / "quake.csv", np.column_stack([T, QUAKE]))
    with pytest.raises(ValueError, match="columns must be two whole numbers from 0"):
        fb.Record.earthquake(tmp_path / "quake.csv", "g", columns=columns)
    with pytest.raises(ValueError, match="unit must be 'g' or"):
        fb.Record.earthquake(tmp_path / "quake.csv", ["g"])


def test_switches_are_true_or_false(tmp_path):
    """Text such as "no" counted as true."""
    np.savetxt(tmp_path / "quake.csv", np.column_stack([T, QUAKE]))
    with pytest.raises(ValueError, match="baseline must be True or False, got 'no'"):
        fb.Record.earthquake(tmp_path / "quake.csv", "g", baseline="no")
    with pytest.raises(ValueError, match="detrend must be True or False, got 'no'"):
        fb.Record.from_csv(tmp_path / "quake.csv", detrend="no")
