"""SIMD vectors, sums and packed arguments against numpy and the tuples they stand for."""

import contextlib
import operator
import re
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest
from numba import njit, types
from numba.core.errors import TypingError
from numba.core.inline_closurecall import InlineWorker
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction
from scipy.integrate import DOP853
from scipy.special import eval_jacobi, roots_jacobi

from contacts import Hertz, KelvinVoigt, Viscoelastic
from fembeam import Harmonic
from solvers import Contact, Exponential, System
from solvers.compiled import decorators, dop853_tableau
from solvers.compiled.fields import _declared, packed_type, shapes_of
from solvers.compiled.packed import Layout, Packed, PackedTemplate, aligned, unpacker
from solvers.compiled.shortcuts import Shortcuts, known_by_type
from solvers.compiled.simd import bit_pattern, load8, positive8, splat8, sqrt8, store8, sum8
from solvers.compiled.sums import combine, padded
from solvers.exponential.contact.nodes import LOCAL, S, gauss_jacobi, node_sets_of, series_of
from solvers.exponential.contact.peaks import local_maximum
from solvers.exponential.flight import level_within
from solvers.integration import prepared_once

OPTIONS = {"error_model": "numpy", "_nrt": False}


@njit(**OPTIONS)
def onto(rows, weights, count, start, result):
    combine(rows, weights, count, start, result)


@njit(**OPTIONS)
def from_zero(rows, weights, count, result):
    combine(rows, weights, count, None, result)


@pytest.mark.parametrize("size", [1, 7, 8, 9, 16, 33])
def test_padded_is_the_next_multiple_of_eight(size):
    assert padded(size) % 8 == 0
    assert 0 <= padded(size) - size < 8


@pytest.mark.parametrize("count", [0, 1, 2, 5, 12])
@pytest.mark.parametrize("width", [8, 16, 24])
def test_combine_is_the_weighted_sum_of_the_first_rows(count, width):
    rng = np.random.default_rng(count + width)
    rows, weights, start = rng.standard_normal((12, width)), rng.standard_normal(12), rng.standard_normal(width)
    result = np.full(width, np.nan)
    from_zero(rows, weights, count, result)
    np.testing.assert_allclose(result, weights[:count] @ rows[:count], atol=1e-14)
    onto(rows, weights, count, start, result)
    np.testing.assert_allclose(result, start + weights[:count] @ rows[:count], atol=1e-14)


@pytest.mark.parametrize("size", [1, 6, 8, 11])
def test_combine_of_padded_rows_leaves_their_padding_zero(size):
    rng = np.random.default_rng(size)
    rows = np.zeros((5, padded(size)))
    rows[:, :size] = rng.standard_normal((5, size))
    weights, result = rng.standard_normal(5), np.full(padded(size), np.nan)
    from_zero(rows, weights, 5, result)
    np.testing.assert_allclose(result[:size], weights @ rows[:, :size], atol=1e-14)
    assert not result[size:].any()


def test_combine_may_add_to_its_own_start():
    rows, weights, result = np.ones((3, 8)), np.array([1.0, 2.0, 3.0]), np.arange(8.0)
    onto(rows, weights, 3, result, result)
    np.testing.assert_array_equal(result, np.arange(8.0) + 6.0)


class Things(NamedTuple):
    """Arrays and a number to pack."""

    vector: np.ndarray
    number: float
    cube: np.ndarray
    count: np.ndarray


KIND = types.NamedTuple(
    [types.float64[::1], types.float64, types.Array(types.float64, 3, "C"), types.int64[::1]], Things
)
_open = unpacker(KIND)


@njit(**OPTIONS)
def look(address, out):
    """Sums, shapes and single entries read through the address; writes one entry back."""
    things = _open(address)
    out[0], out[1], out[2] = things.vector.sum(), things.number, things.cube[1, 2, 3]
    out[3], out[4], out[5] = things.cube.shape[0], things.cube.shape[2], things.count[1]
    out[6] = things.cube[1].sum()
    things.vector[0] = -1.0


def things():
    """One of each kind."""
    rng = np.random.default_rng(1)
    return Things(rng.standard_normal(5), 0.25, rng.standard_normal((2, 3, 4)), np.array([3, 7, 11]))


def seen(address):
    out = np.empty(7)
    look(address, out)
    return out


def expected(of):
    return [of.vector.sum(), of.number, of.cube[1, 2, 3], 2, 4, of.count[1], of.cube[1].sum()]


def test_attributes_of_packed_arguments_are_those_of_the_tuple():
    one = things()
    wanted = expected(one)
    np.testing.assert_allclose(seen(Packed.of(one, KIND).address), wanted, rtol=1e-14)
    assert one.vector[0] == -1.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("vector", np.zeros(3, dtype=np.float32)),
        ("vector", np.zeros((2, 2))),
        ("cube", np.zeros((2, 3, 8))[:, :, ::2]),
        ("count", np.zeros(3)),
    ],
)
def test_what_does_not_fit_the_declared_kind_is_refused_by_name(name, value):
    with pytest.raises(TypeError, match=f"{name} must be a contiguous"):
        Packed.of(things()._replace(**{name: value}), KIND)


def test_aligned_arrays_begin_at_lines_of_the_cache_and_are_equal():
    one = things()._replace(vector=np.arange(9.0)[1:6])
    found = aligned(one)
    for before, after in zip(one, found, strict=True):
        np.testing.assert_array_equal(after, before)
    for array in (found.vector, found.cube, found.count):
        assert array.ctypes.data % 64 == 0
    found.vector[0] = -1.0
    assert one.vector[0] == 1.0


def test_copies_of_a_template_have_own_arrays_and_share_the_rest():
    one = things()
    template = PackedTemplate(one, KIND, ["vector", "cube"])
    first, second = template.copy(), template.copy(number=8.0)
    first.value.vector[:] = 5.0
    assert (first.value.number, second.value.number, one.number) == (0.25, 8.0, 0.25)
    assert first.value.count is second.value.count is one.count
    for copy in (first, second):
        wanted = expected(copy.value)
        np.testing.assert_allclose(seen(copy.address), wanted, rtol=1e-14)
    np.testing.assert_array_equal(second.value.vector[1:], one.vector[1:])
    assert one.vector[0] != -1.0


@pytest.mark.parametrize("made", [Packed.of, lambda one, kind: PackedTemplate(one, kind, ["vector"]).copy(number=8.0)])
def test_other_arrays_take_the_place_of_some_and_the_rest_is_shared(made):
    one = things()
    packed = made(one, KIND)
    other = packed.replaced(KIND, cube=np.ones((2, 5, 4)), count=np.array([1, 2]))
    assert other.value.vector is packed.value.vector
    assert other.value.number == packed.value.number
    for each in (other, packed):
        wanted = expected(each.value)
        np.testing.assert_allclose(seen(each.address), wanted, rtol=1e-14)
    with pytest.raises(TypeError, match="cube must be a contiguous"):
        packed.replaced(KIND, cube=np.ones(3))


class Pair(NamedTuple):
    """Arrays that live in one block."""

    values: np.ndarray
    marks: np.ndarray


PAIR = types.NamedTuple([types.Array(types.float64, 2, "C"), types.int64[::1]], Pair)
_open_pair = unpacker(PAIR)


@njit(**OPTIONS)
def write(address):
    pair = _open_pair(address)
    for i in range(pair.values.shape[0]):
        for j in range(pair.values.shape[1]):
            pair.values[i, j] = 10 * i + j
    pair.marks[0] = pair.values.shape[1]


def test_tuples_of_a_layout_share_one_block_and_do_not_overlap():
    layout = Layout([PAIR, PAIR], [[(2, 3), (1,)], [(4, 1), (2,)]])
    block, start = layout.block()
    for at in layout.starts:
        write(start + at)
    first, second = (Pair._make(layout.arrays(block, i)) for i in range(2))
    np.testing.assert_array_equal(first.values, [[0, 1, 2], [10, 11, 12]])
    np.testing.assert_array_equal(second.values[:, 0], [0, 10, 20, 30])
    assert (first.marks[0], second.marks[0], second.marks[1]) == (3, 1, 0)
    longer = np.zeros((5, 2))
    layout.replace_array(block, 1, 0, longer)
    write(start + layout.starts[1])
    np.testing.assert_array_equal(longer[:, 1], [1, 11, 21, 31, 41])


@njit(**OPTIONS)
def in_vectors(x, y, out):
    for i in range(0, x.size, 8):
        a, b = load8(x, i), load8(y, i)
        more = a * b - splat8(0.5)
        more += sqrt8(positive8(a))
        store8(out, i, more)
    return sum8(load8(out, 8))


@njit(**OPTIONS)
def bits_of(number):
    return bit_pattern(number)


class Lengths(NamedTuple):
    flight_step: np.ndarray


# compiled anew: the library's own caches must not know a type that only this file has
level_of = njit(**OPTIONS)(level_within.py_func)


def test_vectors_calculate_like_numbers():
    rng = np.random.default_rng(1)
    x, y, out = rng.standard_normal(16), rng.standard_normal(16), np.full(20, np.nan)
    expected = x * y - 0.5 + np.sqrt(np.maximum(x, 0.0))
    assert in_vectors(x, y, out) == pytest.approx(expected[8:].sum(), rel=1e-14)
    np.testing.assert_allclose(out[:16], expected, rtol=1e-15, atol=1e-15)
    assert np.isnan(out[16:]).all()


def test_not_a_number_is_not_clipped_to_zero():
    x, out = np.zeros(16), np.zeros(16)
    x[3] = np.nan
    in_vectors(x, x, out)
    assert np.flatnonzero(np.isnan(out)).tolist() == [3]


def test_bits_are_a_logarithm_to_a_twelfth():
    x = np.geomspace(1e-12, 1e12, 999)
    logarithms = np.array([bits_of(value) - bits_of(1.0) for value in x]) / 2.0**52
    assert np.all(np.diff(logarithms) > 0.0)
    assert 0.0860 < np.ptp(np.log2(x) - logarithms) < 0.0862


def test_level_is_the_longest_tabulated_step_within_the_span():
    h = 3.7 * 2.0 ** (-0.25 * np.arange(60))
    spans = np.exp(np.random.default_rng(2).uniform(np.log(h[-1]), np.log(2.0 * h[0]), 4000))
    spans = np.concatenate((spans, h, np.nextafter(h[:-1], 0.0), np.nextafter(h, 9.0), [np.inf]))
    found = np.array([level_of(Lengths(h), span) for span in spans])
    assert np.all(h[found] <= spans)
    assert np.all((found == 0) | (h[found - 1] > spans))


maximum_of = njit(**OPTIONS)(local_maximum.py_func)


def test_maximum_is_that_of_the_polynomial_around_its_highest_point():
    """Of what a step looks like between three of its nodes: terms that fall."""
    rng, fine = np.random.default_rng(3), np.linspace(-1.0, 1.0, 20_001)
    for _ in range(400):
        polynomial = np.polynomial.Polynomial(rng.standard_normal(8) * rng.uniform(0.1, 0.5) ** np.arange(8))
        values, limit = polynomial(LOCAL), float(rng.choice([1.0, rng.uniform(-0.9, 1.0)]))
        seen = limit >= LOCAL
        place = int(np.where(seen, values, -np.inf).argmax())
        low, high = LOCAL[max(place - 1, 0)], min(LOCAL[min(place + 1, 7)], limit)
        inside = polynomial(fine[(fine >= low) & (fine <= high)])
        found = maximum_of(values, limit, np.empty(8))
        assert max(values[place], polynomial(limit)) <= found + 1e-12
        assert found <= polynomial(np.append(fine[fine <= limit], limit)).max() + 1e-6
        if 0 < place < 7 and inside.argmax() not in (0, inside.size - 1):
            assert found >= inside.max() - 1e-7


def test_steps_are_interpolated_around_every_node():
    """δ and h δ̇ of a motion that eight nodes resolve, between the neighbours of each node."""
    motion = np.array([lambda t: np.sin(3.0 * t + 0.2), lambda t: 3.0 * np.cos(3.0 * t + 0.2)])
    node_sets, h = node_sets_of(((2.0, 3.0), (4.0, 1.0))), 0.7
    for f, error in ((0, 1e-6), (1, 3e-6), (2, 1e-5)):
        t = h * node_sets.nodes[f] ** node_sets.time_exponent[f]
        for zoom, (begin, end) in zip(node_sets.local_interpolation[f], node_sets.local_interval[f], strict=True):
            at = h * (begin + 0.5 * (LOCAL + 1.0) * (end - begin)) ** node_sets.time_exponent[f]
            known = [motion[0](t), h * motion[1](t), [motion[0](0.0), h * motion[1](0.0)]]
            found = np.concatenate(known) @ zoom
            np.testing.assert_allclose(found, np.concatenate((motion[0](at), h * motion[1](at))), atol=error)


@pytest.mark.parametrize(
    ("made", "series"),
    [
        (Hertz(1.0), (2.0, 3.0)),
        (Hertz(1.0, 2.0), (1.0, 0.0)),
        (KelvinVoigt(1.0, 1.0), (1.0, 0.0)),
        (Hertz(1.0) + KelvinVoigt(1.0, 1.0), (2.0, 0.0)),
        (Hertz(1.0) + Hertz(1.0, 1.0), (2.0, 2.0)),
        (Viscoelastic.tsuji(1.0, 0.5, 1.0), (4.0, 1.0)),
        (Viscoelastic(1.0, 1.0, 2.0), (2.0, 1.0)),
        (Hertz(1.0, 1.2), (2.0, 2.4)),
    ],
)
def test_force_at_entry_is_a_series_in_the_root_of_time_its_powers_need(made, series):
    assert series_of(made) == pytest.approx(series)


def test_coefficients_are_those_of_scipy():
    size = dop853_tableau.STAGES
    assert np.array_equal(dop853_tableau.A[:size, :size], DOP853.A[:size, :size])
    assert np.array_equal(dop853_tableau.A[size, :size], DOP853.B)
    assert np.array_equal(dop853_tableau.A[size + 1 :], DOP853.A_EXTRA)
    assert np.array_equal(dop853_tableau.C, [*DOP853.C[:size], 1.0, *DOP853.C_EXTRA])
    for name in ("E3", "E5", "D"):
        assert np.array_equal(getattr(dop853_tableau, name), getattr(DOP853, name))


@pytest.mark.parametrize("beta", [0.0, 0.5, 1.0, 3.4, 5.0])
def test_nodes_and_coefficients_of_jacobi_are_those_of_scipy(beta):
    x, weights, spectrum = gauss_jacobi(beta)
    expected, areas = roots_jacobi(S, 0.0, beta)
    np.testing.assert_allclose(x, expected, rtol=0.0, atol=2e-15)
    np.testing.assert_allclose(weights, areas / 2.0 ** (beta + 1.0), rtol=1e-13)
    polynomials = np.array([eval_jacobi(k, 0.0, beta, x) for k in range(S)])
    np.testing.assert_allclose(spectrum @ polynomials.T, np.eye(S), atol=1e-13)


class Declared(NamedTuple):
    k: Annotated[Any, "N"]
    rows: Annotated[Any, "int m, 2*N+1"]
    size: Annotated[float, "number"]


def test_a_declaration_gives_type_and_shapes():
    assert packed_type(Declared) == types.NamedTuple(
        [types.Array(types.float64, 1, "C"), types.Array(types.int64, 2, "C"), types.float64], Declared
    )
    assert shapes_of(Declared, {"N": 3, "m": 4}) == [(3,), (4, 7), ()]


@pytest.mark.parametrize(("stops", "tones"), [(0, 0), (1, 1), (2, 3), (14, 1)])
def test_arrays_have_the_shapes_they_are_declared_with(stops, tones):
    """Every name among the dimensions has one size in all fields, or none where a table is not needed."""
    rows = np.random.default_rng(1).normal(size=(stops + 1, 5))
    contacts = [Contact(row, Hertz(1e5), 0.1) for row in rows[1:]]
    loads = [(rows[0], Harmonic(1.0, 3.0 + i)) for i in range(tones)]
    system = System.modal([1.0, 2.0, 3.0, 5.0, 8.0], 0.01, contacts, loads)
    method = Exponential(1e-8)
    _, prepared = prepared_once(system, method, 10.0)
    for value in (prepared.problem.value, prepared.tables.value):
        sizes = {}
        for name, _, shape in _declared(type(value)):
            array = np.asarray(getattr(value, name))
            assert array.ndim == len(shape), name
            for part, size in zip(shape, array.shape, strict=True):
                if array.size and part.isidentifier():
                    assert sizes.setdefault(part, size) == size, (name, part)
            for part, size in zip(shape, array.shape, strict=True):
                if array.size and {*re.findall("[A-Za-z]+[0-9]*", part)} <= {*sizes, "S"}:
                    assert shapes_of(tuple_of(part), {**sizes, "S": S}) == [(size,)], (name, part)


def tuple_of(dimension):
    return NamedTuple("tuple_of", [("field", Annotated[Any, dimension])])


def test_shortcuts_of_the_compiler_end_with_it():
    """Within, a builtin has the signature that numba finds, and one only; after that, and after a failure, numba's."""
    own, context = (BaseFunction.get_call_type, InlineWorker.inline_function), cpu_target.typing_context
    context.refresh()
    times, numbers = context.resolve_value_type(operator.mul), (types.float64, types.int64)
    expected, shortcuts = times.get_call_type(context, numbers, {}), Shortcuts(lambda _: True)
    with contextlib.suppress(ZeroDivisionError), shortcuts.taken():
        found = [times.get_call_type(context, numbers, {}) for _ in range(2)]
        assert found[0] is found[1]
        assert found[0] == expected
        assert times.get_impl_key(found[0]) is operator.mul
        with shortcuts.taken():
            pass
        assert BaseFunction.get_call_type is not own[0]
        raise ZeroDivisionError
    assert (BaseFunction.get_call_type, InlineWorker.inline_function) == own


def test_branches_that_a_type_excludes_are_not_compiled():
    """The branch would not compile; numba's own pruning does not know of the function, whose machine code is right."""

    @known_by_type(lambda kind: False if isinstance(kind, types.Float) else None)
    @njit
    def is_text(x):
        return x == "text"

    @njit
    def length(x):
        return len(x) if is_text(x) else 0

    with decorators._SHORTCUTS.taken():
        assert length(1.5) == 0
        assert length("text") == 4  # a type of which nothing is known
        assert length("word") == 0
        with pytest.raises(TypingError):
            length(1)


class Held(NamedTuple):
    """A field that may be a number or a text, beside others."""

    number: float
    content: Any
    more: float
    last: float


@pytest.mark.parametrize("read", ["field", "line"])
def test_branches_that_the_type_of_a_field_excludes_are_not_compiled(read):
    """As above, for fields read by themselves or several of them in one line."""

    @known_by_type(lambda kind: False if isinstance(kind, types.Float) else None)
    @njit
    def is_text(x):
        return x == "text"

    @njit
    def by_field(held):
        return len(held.content) if is_text(held.content) else 0

    @njit
    def by_line(held):
        number, content, more, last = held.number, held.content, held.more, held.last
        return len(content) if is_text(content) else int(number + more + last)

    length, rest = (by_field, 0) if read == "field" else (by_line, 6)
    with decorators._SHORTCUTS.taken():
        assert length(Held(1.0, 1.5, 2.0, 3.0)) == rest
        assert length(Held(1.0, "text", 2.0, 3.0)) == 4
        assert length(Held(1.0, "word", 2.0, 3.0)) == rest


LINKED = """
@njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)
def twice(x):
    return 2.0 * x

@njit
def four_times(x):
    return twice(twice(x))
"""


def test_what_is_only_linked_has_no_machine_code_of_its_own():
    names = {"__name__": "solvers.trial", "njit": njit}
    with decorators._SHORTCUTS.taken():
        exec(LINKED, names)
        assert names["four_times"](3.0) == 12.0
        assert njit(lambda x: x + 1.0)(2.0) == 3.0  # of others
    codes = [names[name].overloads[(types.float64,)].library for name in ("twice", "four_times")]
    sizes = [len(code.serialize_using_object_code()[2][0]) for code in codes]
    assert sizes[0] == 0 < sizes[1]
    twice = names["twice"]
    assert njit(lambda x: twice(x) - 1.0)(3.0) == 5.0  # linked again, later
