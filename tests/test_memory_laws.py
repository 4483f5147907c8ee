"""Laws with memory: their six kernels, alone and in sums, against formulas and differences."""

import ctypes
import itertools
import math
import subprocess
import sys

import numpy as np
import pytest
from refusals import refused

from contacts import (
    BoucWen,
    Coulomb,
    ElastoPlastic,
    Hertz,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    PiecewiseLinear,
    Polynomial,
    Tabulated,
    WaltonBraun,
    bounce,
    restitution,
    sum_kernels,
    sums,
)
from contacts.sums import Gated, Sum

POINTER = ctypes.POINTER(ctypes.c_double)
RENEWED = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_double, ctypes.c_double, ctypes.c_double, POINTER)


def at(address, n, d, v, row, *outputs):
    """Call a batch kernel at an address as an integrator does."""
    kind = ctypes.CFUNCTYPE(None, ctypes.c_int64, POINTER, POINTER, ctypes.c_double, *[POINTER] * (1 + len(outputs)))
    arrays = [x.ctypes.data_as(POINTER) for x in (d, v, row, *outputs)]
    kind(address)(n, *arrays[:2], 0.7, *arrays[2:])


def asked(law, name, rows, d, v, row):
    """Values of the kernel `name` at points, (rows, n)."""
    d, v = np.atleast_1d(np.asarray(d, dtype=float)), np.atleast_1d(np.asarray(v, dtype=float))
    out = np.full((rows, d.size), math.nan)
    if name == "gradient":
        at(law.gradient_address, d.size, d, v, row, *out)
    else:
        at(getattr(law, name), d.size, d, v, row, out)
    return out


def forces(law, d, v, row):
    return asked(law, "address", 1, d, v, row)[0]


def borders(law, d, v, row):
    return asked(law, "borders_address", law.borders, d, v, row)


def renewed(law, j, d, v, row):
    """Event and parameters after border j."""
    after = row.copy()
    return RENEWED(law.renew_address)(j, d, v, 0.7, after.ctypes.data_as(POINTER)), after


def renewal_slopes(law, j, d, v, row):
    size = len(law.memory)
    out = np.full((size, 2 + size), math.nan)
    kind = ctypes.CFUNCTYPE(None, ctypes.c_int64, *[ctypes.c_double] * 3, POINTER, POINTER)
    kind(law.renew_gradient_address)(j, d, v, 0.7, row.ctypes.data_as(POINTER), out.ctypes.data_as(POINTER))
    return out


def with_memory(law, *numbers):
    row = law.parameters
    row[list(law.memory)] = numbers
    return row


JENKINS = Jenkins(2e4, 10.0)
SUM = Jenkins(2e4, 10.0) + Polynomial([1e3, 0.0, 1e9]) + Jenkins(5e3, 20.0) + KelvinVoigt(1e3, 5.0)
COULOMB = Coulomb(10.0, 2e4, 12.0, 3.0)
IWAN = Iwan([2e4, 1e4, 3e3], [10.0, 20.0, math.inf])
SHAPES = (600.0, 300.0), (600.0, -300.0), (200.0, 500.0)
WENS = [BoucWen(1e4, 0.2, 1.0, *shape, n) for n in (1, 2) for shape in SHAPES]
# one way and the other, before and after z = 0, and before the first reversal
WEN_STATES = [
    ((1.0, 1e-4, -4e-4), 2e-4, 0.1),
    ((1.0, 1e-4, -4e-4), 2e-3, 0.1),
    ((1.0, 1e-4, 4e-4), 5e-4, 0.1),
    ((-1.0, 1e-4, 4e-4), -2e-4, -0.1),
    ((-1.0, 1e-4, 4e-4), -2e-3, -0.1),
    ((0.0, 1e-4, 0.0), 1.3e-3, 0.1),
    ((0.0, 1e-4, 0.0), -1e-3, -0.1),
]
DENTED, FRESH = WaltonBraun(1e5, 4e5), WaltonBraun(1e5, 4e5, set="forgotten")
GATED = Gated(Hysteretic(1e7, 0.5, entry_rate_floor=0.01))
STOPS = DENTED + Hysteretic(1e7, 0.5) + KelvinVoigt(1e3, 2.0)
# law, latched numbers, d, v: every segment
STATES = [
    (JENKINS, (0.0, 1e-4), 3e-4, 0.2),
    (JENKINS, (1.0, 1e-4), 3e-3, 0.2),
    (JENKINS, (-1.0, 1e-4), -3e-3, -0.2),
    *((SUM, (a, 1e-4, b, -2e-4), 2e-4, 0.3) for a, b in itertools.product((0.0, 1.0, -1.0), repeat=2)),
    (COULOMB, (0.0, 1e-4), 3e-4, 0.2),
    (COULOMB, (-1.0, 1e-4), 3e-4, -0.2),
    (ElastoPlastic(2e4, 10.0, 5e3), (0.0, 1e-4), 3e-4, 0.2),
    *((IWAN, (a, 1e-4, b, -2e-4), 2e-4, 0.3) for a, b in itertools.product((0.0, 1.0, -1.0), repeat=2)),
    *((law, state, d, v) for law in WENS for state, d, v in WEN_STATES),
    *((law, (code, 50.0), 7e-4, 0.1) for law in (DENTED, FRESH) for code in (0.0, 1.0, 2.0)),
    *((GATED, (code, rate), 7e-4, 0.1) for code, rate in ((0.0, 0.3), (1.0, 0.3), (1.0, 0.001))),
    *((STOPS, (a, 0.3, b, 0.2, c, 50.0), 7e-4, 0.1) for c, a, b in itertools.product((0.0, 1.0), repeat=3)),
]
CODES = {Iwan: [0, 2], Sum: [0, 2, 4]}


def codes(law):
    """Which latched numbers are segment codes."""
    return [i for i in CODES.get(type(law), [0]) if i < len(law.memory)]


@pytest.mark.parametrize("law", {type(law): law for law, *_ in STATES}.values(), ids=lambda law: type(law).__name__)
def test_codes_of_segments_are_those_it_passes_through(law):
    told = law.segment_codes
    assert len(told) == len(law.memory)
    assert [i for i, known in enumerate(told) if known] == codes(law)
    met = {i: {float(law.parameters[law.memory[i]])} for i in codes(law)}
    for d, v in itertools.product((-1e-2, 0.0, 1e-2), (-1.0, 1.0)):
        for numbers in itertools.product(*[known or (1e-3,) for known in told]):
            for j in range(law.borders):
                after = renewed(law, j, d, v, with_memory(law, *numbers))[1][list(law.memory)]
                for i in met:
                    met[i].add(float(after[i]))
    for i, seen in met.items():
        assert seen == set(told[i])


@pytest.mark.parametrize(("law", "numbers", "d", "v"), STATES)
def test_derivatives_are_those_of_the_force(law, numbers, d, v):
    row, h = with_memory(law, *numbers), 1e-8
    by_d, by_v, by_entry = asked(law, "gradient", 3, [d], [v], row)[:, 0]
    low, high = forces(law, [d - h, d + h], [v, v], row)
    assert by_d == pytest.approx((high - low) / (2 * h), rel=1e-5, abs=1e-5)
    low, high = forces(law, [d, d], [v - 1e-3, v + 1e-3], row)
    assert by_v == pytest.approx((high - low) / 2e-3, rel=1e-6, abs=1e-9)
    assert by_entry == 0.0
    slopes = asked(law, "memory_gradient_address", len(law.memory), [d, 2 * d], [v, v], row)
    assert np.array_equal(slopes[:, :1], asked(law, "memory_gradient_address", len(law.memory), d, v, row))
    for place, slope, code in zip(law.memory, slopes, range(len(slopes)), strict=True):
        shifted = [row.copy(), row.copy()]
        shifted[0][place] -= h
        shifted[1][place] += h
        low, high = (forces(law, d, v, one)[0] for one in shifted)
        expected = 0.0 if code in codes(law) else (high - low) / (2 * h)
        assert slope[0] == pytest.approx(expected, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(("law", "numbers", "d", "v"), STATES)
def test_derivatives_of_every_renewal(law, numbers, d, v):
    row, places, h = with_memory(law, *numbers), list(law.memory), 1e-8
    for j in range(-1, law.borders):
        if j < 0:
            expected = np.zeros((len(places), 2 + len(places)))
            kept = [i for i in range(len(places)) if i not in codes(law)]
            expected[kept, np.array(kept, dtype=int) + 2] = 1.0
            np.testing.assert_array_equal(renewal_slopes(law, j, d, v, row), expected)
            continue
        if borders(law, d, v, row)[j] == 1.0:  # there is none in this segment
            continue
        event, _ = renewed(law, j, d, v, row)
        assert 0 <= event < len(law.events)
        found, expected = renewal_slopes(law, j, d, v, row), np.zeros((len(places), 2 + len(places)))
        for column in range(2 + len(places)):
            ends = []
            for sign in (-h, h):
                point, moved = [d, v], row.copy()
                if column < 2:
                    point[column] += sign
                else:
                    moved[places[column - 2]] += sign
                ends.append(renewed(law, j, *point, moved)[1][places])
            expected[:, column] = (ends[1] - ends[0]) / (2 * h)
        for code in codes(law):
            expected[code], expected[:, 2 + code] = 0.0, 0.0
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=3e-6)


def test_a_slider_sticks_slips_and_sticks_again():
    k, f = 2e4, 10.0
    row = JENKINS.parameters
    assert forces(JENKINS, 2e-4, 1.0, row) == 4.0
    assert borders(JENKINS, [2e-4, 5e-4, 6e-4], [1.0] * 3, row)[0] == pytest.approx([6.0, 0.0, -2.0], rel=1e-14)
    event, row = renewed(JENKINS, 0, 5e-4, 1.0, row)
    assert (JENKINS.events[event], row[JENKINS.memory[0]]) == ("slip", 1.0)
    assert forces(JENKINS, [5e-4, 9e-4], [1.0, -1.0], row).tolist() == [f, f]
    assert borders(JENKINS, [9e-4] * 2, [0.3, -0.3], row).tolist() == [[0.3, -0.3]]
    event, row = renewed(JENKINS, 0, 9e-4, 0.0, row)
    assert (JENKINS.events[event], row[list(JENKINS.memory)].tolist()) == ("stick", [0.0, 9e-4 - f / k])
    assert forces(JENKINS, 9e-4, 0.0, row) == pytest.approx(f, rel=1e-14)
    assert JENKINS.stored(9e-4, row) == pytest.approx(f**2 / (2 * k), rel=1e-14)


def test_a_sum_renews_each_part_by_itself():
    row = with_memory(SUM, 0.0, 1e-4, -1.0, -2e-4)
    assert SUM.events == ("stick", "slip", "stick", "slip")
    assert (SUM.borders, SUM.one_sided, len(SUM.memory)) == (2, False, 4)
    values = borders(SUM, [7e-4, 2e-4], [0.1, 0.2], row)
    np.testing.assert_allclose(values, [[10.0 - 12.0, 8.0], [-0.1, -0.2]], rtol=1e-13)
    event, after = renewed(SUM, 1, 2e-4, 0.2, row)
    assert event == 2
    assert after[list(SUM.memory)].tolist() == [0.0, 1e-4, 0.0, 2e-4 + 20.0 / 5e3]
    event, after = renewed(SUM, 0, 7e-4, 0.2, row)
    assert event == 1
    assert after[list(SUM.memory)].tolist() == [1.0, 1e-4, -1.0, -2e-4]
    assert forces(SUM, 2e-4, 0.2, row)[0] == pytest.approx(2.0 + 0.2 + 8e-3 - 20.0 + 0.2 + 1.0, rel=1e-13)
    parts = 0.5 * 2e4 * 1e-8 + 0.5e3 * 4e-8 + 1e9 * 1.6e-15 / 4 + 400.0 / 1e4 + 0.5e3 * 4e-8
    assert SUM.stored(2e-4, row) == pytest.approx(parts, rel=1e-12)


def test_laws_without_memory_have_none():
    for law in (Hertz(1e8), Hertz(1e8) + KelvinVoigt(1e6, 1.0)):
        names = "borders", "renew", "memory_gradient", "renew_gradient"
        addresses = [getattr(law, f"{name}_address") for name in names]
        assert (law.memory, law.borders, law.events, addresses) == ((), 0, (), [0] * 4)
        assert law.one_sided
    assert not (KelvinVoigt(1e6, 1.0) + Polynomial([1.0])).one_sided
    assert KelvinVoigt(1e6, 1.0, clamp=True).one_sided


def test_energy_stored_without_memory():
    assert Hertz(1e8).stored(1e-3, Hertz(1e8).parameters) == pytest.approx(1e8 * 1e-3**2.5 / 2.5, rel=1e-9)
    assert Hertz(1e8).stored(-1e-3, Hertz(1e8).parameters) == 0.0
    assert Polynomial([1e3]).stored(-1e-3, np.zeros(0)) == pytest.approx(5e-4, rel=1e-9)


@pytest.mark.parametrize("bad", [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, math.nan), (1.0, math.inf)])
def test_jenkins_refuses(bad):
    with pytest.raises(ValueError, match=r"(stiffness|limit) of Jenkins must be finite and > 0, got"):
        Jenkins(*bad)


test_bad_input = refused(
    (lambda: Coulomb(0.0, 1e4), "limit of Coulomb must be finite and > 0, got 0.0"),
    (lambda: Coulomb(1.0, 1e4, 0.5), "static_limit of Coulomb must be finite and >= 1, got 0.5"),
    (lambda: Coulomb(1.0, 1e4, damping=-1.0), "damping of Coulomb must be finite and >= 0"),
    (lambda: ElastoPlastic(1e4, 1.0, 1e4), "hardening of ElastoPlastic must be smaller than stiffness 10000 N/m"),
    (lambda: ElastoPlastic(1e4, 0.0), "yield_force of ElastoPlastic must be finite and > 0"),
    (lambda: Iwan([1e4], [1.0, 2.0]), r"limits of Iwan must be as many as stiffness, .*, got shapes \(2,\) and \(1,\)"),
    (lambda: Iwan([1e4, -1.0], [1.0, 2.0]), "stiffness and limits of Iwan must be > 0"),
    (lambda: Iwan([1e4], [math.inf]), "limits of Iwan must hold a finite one"),
    (lambda: Iwan([], []), "limits of Iwan must be as many as stiffness, .* one per element"),
    (lambda: Iwan(["a"], [1.0]), "stiffness of Iwan must be a number, got"),
    (lambda: Iwan.uniform(1e4, 1.0, 0), "parts of Iwan.uniform must be a whole number from 1 to 10000, got 0"),
    (lambda: Iwan.from_backbone([1.0, 2.0], [1.0, 3.0]), "slope of Iwan.from_backbone must not rise, got 1 N/m"),
    (lambda: Iwan.from_backbone([1.0, 1.0], [1.0, 3.0]), "must be finite, delta ascending from"),
    (lambda: Iwan.from_backbone([1.0], [1.0, 3.0]), "must be as many as delta, 1, got 2"),
    (lambda: BoucWen(1e4, 1.0, 1.0, 1.0, 1.0), "alpha of BoucWen must be below 1, got 1.0"),
    (lambda: BoucWen(1e4, 0.1, 0.0, 1.0, 1.0), "A of BoucWen must be finite and > 0"),
    (lambda: BoucWen(1e4, 0.1, 1.0, math.nan, 1.0), "beta of BoucWen must be finite, got nan$"),
    (lambda: BoucWen(1e4, 0.1, 1.0, 1.0, -math.inf), "gamma of BoucWen must be finite, got -inf$"),
    (lambda: BoucWen(1e4, 0.1, 1.0, 1.0, 1.0, 3), "n of BoucWen must be 1 or 2, for which"),
    (lambda: WaltonBraun(1e5, 1e4), "unloading of WaltonBraun must be finite and >= 100000, got"),
    (lambda: WaltonBraun(1e5, 1e5, "lost"), 'set of WaltonBraun must be "kept" or "forgotten", got'),
    (lambda: bounce(JENKINS), "bounce knows laws without memory"),
    (lambda: restitution(STOPS), "bounce knows laws without memory"),
    (lambda: JENKINS.along([0.0, math.nan]), "path of Jenkins must be a row of finite indentations"),
    (lambda: JENKINS.along([[0.0]]), r"path of Jenkins must be a row .* of shape \(1, 1\)"),
    (lambda: JENKINS.along([]), "path of Jenkins must be a row"),
)


def test_what_a_law_says():
    assert "loses 0.02 J" in JENKINS.describe()  # 4 f (X - f/k) at X = 2 f/k
    assert "jumps by 2 N where slip begins" in COULOMB.describe()
    assert "without damping it rings" in Coulomb(1.0, 1e4, 1.5).describe()
    assert "restitution: a free mass of 1 kg entering at 0.1 m/s achieves 0.500000 (exactly)" in DENTED.describe(0.1)
    assert f"set: {0.1 * math.sqrt(1 / 1e5) * 0.75:.6g} m after this blow" in DENTED.describe(0.1)
    assert "|z| stays below" in WENS[0].describe()
    assert "grows without bound" in BoucWen(1e4, 0.1, 1.0, 1.0, -2.0).describe()
    assert "Jenkins" in SUM.describe()
    assert "loses" in SUM.describe()
    sliders = Jenkins(2e4, 1.0) + Jenkins(1e4, 4.0)  # 4 f (X - f/k) of each at X = 0.8 mm, whatever is beside them
    for beside in (Hertz(1e8), PiecewiseLinear([1e3, 1e6], knots=[4e-5]), Tabulated([1e-5, 1e-4], [0.01, 80.0])):
        assert "δ = ±0.0008 m loses 0.0094 J" in (sliders + beside).describe()
    assert STOPS.describe().count("\n") == 3


def test_how_far_bouc_wen_is_shown():
    """To twice the knee of a straight loading, z = 2 δ = 1 mm; where z = √(A/s) tan(√(A s) δ) to 1/π of its pole."""
    assert BoucWen(1e4, 0.1, 2.0, 1500.0, 500.0).reach == pytest.approx(1e-3, rel=1e-12)
    stiffening, pole = BoucWen(1e4, 0.0, 2.0, -3e5, 0.0, n=2), math.pi / 2 / math.sqrt(2.0 * 3e5)
    assert stiffening.reach == pytest.approx(pole / math.pi, rel=1e-12)
    force = stiffening.along([0.0, stiffening.reach])[1]
    assert force == pytest.approx(1e4 * math.sqrt(2.0 / 3e5) * math.tan(0.5), rel=1e-9)


def test_who_may_act_where():
    assert (JENKINS + Hertz(1e8)).one_sided is False
    assert STOPS.one_sided
    assert STOPS.opens
    assert not (DENTED + DENTED).opens
    assert STOPS.jumps
    assert (DENTED + Hysteretic(1e7, 0.5)).jumps is False
    acting = STOPS.acting, (JENKINS + Hertz(1e8) + Polynomial([1.0])).acting
    names = [[type(part).__name__ for part in parts] for parts in acting]
    assert names == [["Gated", "Gated", "WaltonBraun"], ["Jenkins", "Gated", "Polynomial"]]
    assert STOPS.events == ("contact", "open", "contact", "open", "contact", "unload", "reload", "open")


def test_a_run_without_memory_loads_none_of_this():
    code = (
        "import sys, fembeam as fb\nfrom contacts import Hertz, KelvinVoigt\n"
        "(Hertz(1e8) + KelvinVoigt(1e6, 1.0)).parameters\n"
        "print([name for name in sys.modules if name.startswith('contacts') and name.endswith('_kernels')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['contacts.custom_kernels', 'contacts.memory.custom_kernels']"  # no numba in these
    assert sums.HEAD == sum_kernels.HEAD
