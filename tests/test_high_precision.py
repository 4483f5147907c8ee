"""The reference method against motion in 80-bit numbers; `tests/bench/high_precision.py` does hundreds of systems."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "bench"))

from high_precision import QUANTITIES, TOLERANCES, judge

SYSTEMS = {"plain": 24, "compressed": 69, "ends inside": 46, "graze": 115}  # quick ones


@pytest.mark.parametrize(("kind", "seed"), SYSTEMS.items())
def test_motion_and_log_of_the_reference_are_those_of_a_high_precision_integrator(kind, seed):
    found, verdict, errors = judge(seed)
    assert (found, verdict) == (kind, "compared")
    assert set(errors) == set(TOLERANCES)
    assert set(errors[TOLERANCES[-1]]) == set(QUANTITIES)
    for rtol, error in errors.items():  # in units of rtol × what a relative move of the start by 1 moves
        assert max(error.values()) < 100.0, (rtol, error)
