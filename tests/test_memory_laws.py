"""Laws with memory: their six kernels, alone and in sums, against formulas and differences."""

import ctypes
import itertools
import math

import numpy as np
import pytest

from contacts import Hertz, Jenkins, KelvinVoigt, Polynomial

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


def codes(law, row):
    """Which latched numbers are segment codes: those a law of this file names."""
    return CODES.get(type(law), lambda one: [])(law)


JENKINS = Jenkins(2e4, 10.0)
SUM = Jenkins(2e4, 10.0) + Polynomial([1e3, 0.0, 1e9]) + Jenkins(5e3, 20.0) + KelvinVoigt(1e3, 5.0)
# law, latched numbers, d, v: every segment
STATES = [
    (JENKINS, (0.0, 1e-4), 3e-4, 0.2),
    (JENKINS, (1.0, 1e-4), 3e-3, 0.2),
    (JENKINS, (-1.0, 1e-4), -3e-3, -0.2),
    *((SUM, (a, 1e-4, b, -2e-4), 2e-4, 0.3) for a, b in itertools.product((0.0, 1.0, -1.0), repeat=2)),
]
CODES = {Jenkins: lambda one: [0], type(SUM): lambda one: [0, 2]}


@pytest.mark.parametrize(("law", "numbers", "d", "v"), STATES)
def test_derivatives_are_those_of_the_force(law, numbers, d, v):
    row, h = with_memory(law, *numbers), 1e-7
    by_d, by_v, by_entry = asked(law, "gradient", 3, [d], [v], row)[:, 0]
    low, high = forces(law, [d - h, d + h], [v, v], row)
    assert by_d == pytest.approx((high - low) / (2 * h), rel=1e-6, abs=1e-6)
    low, high = forces(law, [d, d], [v - 1e-3, v + 1e-3], row)
    assert by_v == pytest.approx((high - low) / 2e-3, rel=1e-6, abs=1e-9)
    assert by_entry == 0.0
    slopes = asked(law, "memory_gradient_address", len(law.memory), [d, d], [v, -v], row)
    for place, slope, code in zip(law.memory, slopes, range(len(slopes)), strict=True):
        shifted = [row.copy(), row.copy()]
        shifted[0][place] -= h
        shifted[1][place] += h
        low, high = (forces(law, d, v, one)[0] for one in shifted)
        expected = 0.0 if code in codes(law, row) else (high - low) / (2 * h)
        assert slope == pytest.approx([expected] * 2, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("law", "numbers", "d", "v"), STATES)
def test_derivatives_of_every_renewal(law, numbers, d, v):
    row, places, h = with_memory(law, *numbers), list(law.memory), 1e-7
    for j in range(law.borders):
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
        for code in codes(law, row):
            expected[code], expected[:, 2 + code] = 0.0, 0.0
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7)


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
        addresses = [
            getattr(law, f"{name}_address") for name in ("borders", "renew", "memory_gradient", "renew_gradient")
        ]
        assert (law.memory, law.borders, law.events, addresses) == ((), 0, (), [0] * 4)
        assert law.one_sided
    assert not (KelvinVoigt(1e6, 1.0) + Polynomial([1.0])).one_sided
    assert KelvinVoigt(1e6, 1.0, clamp=True).one_sided


def test_energy_stored_without_memory():
    assert Hertz(1e8).stored(1e-3, Hertz(1e8).parameters) == pytest.approx(1e8 * 1e-3**2.5 / 2.5, rel=1e-9)
    assert Hertz(1e8).stored(-1e-3, Hertz(1e8).parameters) == 0.0
    assert Polynomial([1e3]).stored(-1e-3, np.zeros(0)) == pytest.approx(5e-4, rel=1e-9)


@pytest.mark.parametrize("bad", [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, math.nan), ("a", 1.0), (1.0, math.inf)])
def test_jenkins_refuses(bad):
    with pytest.raises(ValueError, match=r"(stiffness|limit) of Jenkins must be finite and > 0, got"):
        Jenkins(*bad)
