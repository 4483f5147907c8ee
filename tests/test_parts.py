"""Parts of the main method compiled by themselves: what they get and return, and that runs load what they need only."""

import importlib
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import fresh_process
import numpy as np
import pytest
from numba import types

import solvers
from solvers.compiled import parts
from solvers.compiled.kernels import PROBLEM, VECTOR, Problem, entry
from solvers.compiled.packed import Packed, PackedType, unpacker

PLACE = parts.PASSED  # lent for the test
HOME = Path(solvers.__file__).parent.parent
BEGIN = """
import numpy as np
from contacts import Hertz, KelvinVoigt
from fembeam import Step
from solvers import Contact, Exponential, System, integrate
from solvers.compiled.kernels import PlanarProblem, Problem
from solvers.compiled.parts import *
class Kink:
    def __call__(self, t):
        return abs(t - 0.01)
    def nodes(self, duration, rtol):
        return 0.01, np.array([[0.01, -1, 0, 0.01, -1, 0], [0, 1, 0, 0, -1, 0], [0.01, 1, 0, 0.01, 1, 0]])
def run(law=Hertz(1e6), stops=1, loads=(), stiffness=0.0, **options):
    contacts = [Contact([1.0], law, 1e-4 * i) for i in range(stops)]
    ball = System(M=[[2.0]], C=[[0.0]], K=[[stiffness]], contacts=contacts, loads=loads)
    integrate(ball, [1e-3], [-0.5], duration=0.02, **options)
def loaded():
    return [np.flatnonzero(addresses_of(kind)).tolist() for kind in (Problem, PlanarProblem)]
needed = set()
"""


@pytest.fixture
def problem(monkeypatch):
    """A problem whose table of parts has one of the test's own."""
    monkeypatch.setattr(parts, "_DECLARED", {})
    monkeypatch.setattr(parts, "_ADDRESSES", {})
    monkeypatch.setattr(parts, "_LOADED", {})
    arrays = [np.zeros((0,) * getattr(kind, "ndim", 0), str(kind.dtype)) for kind in PROBLEM.types]
    return Packed.of(Problem(*arrays)._replace(gap=np.array([2.0, 3.0]), parts=parts.addresses_of(Problem)), PROBLEM)


def test_a_part_gets_its_arguments_and_returns_a_tuple(problem):
    result = types.Tuple((types.float64, types.int64, types.boolean))

    @parts.part(PLACE, result, types.int64, VECTOR, types.float64, types.boolean)
    def scaled(problem, s, x, factor, found):
        x[0] = factor * problem.gap[s]
        return x[0] + 1.0, s + 5, not found

    unpacked = unpacker(PROBLEM)

    @entry(types.Tuple((types.float64, types.int64, types.boolean))(types.int64, VECTOR))
    def call(address, x):
        return scaled(unpacked(address), 1, x, 2, False)

    parts.load({"problem": PackedType(PROBLEM)}, [PLACE])
    x = np.zeros(1)
    assert call(problem.address, x) == (7.0, 6, True)
    assert x[0] == 6.0
    loaded = parts.addresses_of(Problem).copy()
    parts.load({"problem": PackedType(PROBLEM)}, [PLACE])
    assert np.array_equal(loaded, parts.addresses_of(Problem))
    assert np.count_nonzero(loaded) == 1


def test_two_threads_compile_a_part_once(problem, monkeypatch):
    made = []

    def slow(signature):
        time.sleep(0.1)
        made.append(signature)
        return lambda function: SimpleNamespace(address=len(made))

    monkeypatch.setattr(parts, "c_function", slow)
    parts.part(PLACE, types.void)(lambda problem: None)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: parts.load({"problem": PackedType(PROBLEM)}, [PLACE]), range(4)))
    assert len(made) == 1
    assert parts.addresses_of(Problem)[PLACE] == 1


def test_every_place_has_a_function():
    importlib.import_module("solvers.exponential.method")
    groups = parts.EVERY_RUN, parts.ENERGY, parts.BORDERS, parts.TWO_STOPS, parts.MANY_STOPS, parts.CIRCLES
    groups += parts.KINKS, parts.FOLLOWING, parts.FRICTION
    assert sorted(place for group in groups for place in group) == list(range(parts.PLACES))
    assert sorted(parts._DECLARED) == list(range(parts.PLACES))


def test_a_run_loads_what_it_needs_and_nothing_of_circles():
    """Runs one after the other, each of which needs more."""
    code = BEGIN
    for run, needed in (
        ("run()", "EVERY_RUN"),
        ("run(dt=1e-3, method=Exponential(ledger=False))", "EVERY_RUN"),
        ("run(tangent=True)", "EVERY_RUN"),
        ("run(dt=1e-3)", "ENERGY"),
        ("run(KelvinVoigt(1e6, 0.5, clamp=True))", "BORDERS"),
        ("run(stops=2)", "TWO_STOPS"),
        ("run(stops=4)", "MANY_STOPS"),
        ("run(loads=[([1.0], Kink())])", "KINKS"),
        ("run(loads=[([1.0], Step(1.0, 0.01))], stiffness=1e12)", "FOLLOWING"),
    ):
        code += f"{run}\nneeded |= set({needed})\nassert loaded() == [sorted(needed), []], ({run!r}, loaded())\n"
    fresh_process.run(code, HOME, {**os.environ, "PYTHONPATH": str(HOME)})
