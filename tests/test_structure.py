"""Structures by their matrices: what is checked and told, massless dofs, units, given modes."""

import re
import warnings

import numpy as np
import pytest
from refusals import refused
from scipy import linalg, sparse
from structures import ELEMENTS, LAW, beam_labels, beam_matrices, beam_structure, space_truss

import fembeam as fb
from fembeam.structures import direction_of, following

K, M = np.array([[3e4, -1e4], [-1e4, 1e4]]), np.diag([1.0, 2.0])


@pytest.mark.parametrize("kind", [sparse.coo_matrix, sparse.lil_array, sparse.dok_matrix, sparse.dia_array])
def test_it_is_the_matrices_it_was_given(kind):
    one = fb.Structure(kind(K), M, labels=[("a", "x"), ("b", "x")], points={"end": "b"})
    assert (one.K.toarray() == K).all()
    assert (one.M.toarray() == M).all()
    assert one.rows("end").toarray().tolist() == [[0.0, 1.0]]
    assert one.components == ("x",)
    assert one.position("end") is None
    assert one.lines() == []


def test_lines_and_interfaces_may_be_anything_that_is_listed():
    """Ranges, keys, rows of an array, and what can be gone through only once."""
    K3, at = np.diff(np.eye(4), axis=0).T @ np.diff(np.eye(4), axis=0), {n: (n, 0.0, 0.0) for n in range(4)}
    labels = [(n, "x") for n in range(4)]
    for lines in ([range(4)], [at], np.array([[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]])):
        chain = fb.Structure(K3, np.eye(4), labels=labels, nodes=at, lines=lines)
        assert chain.edges == ((0, 1), (1, 2), (2, 3))
    assert chain.reduced(iter([0, 3]), modes=1).labels == chain.reduced([0, 3], modes=1).labels


def test_the_callers_arrays_stay():
    given, mass = K.copy(), sparse.csr_matrix(M)
    one = fb.Structure(given, mass)
    one.K.data[:] = 0.0
    assert (given == K).all()
    assert (mass.toarray() == M).all()


def test_it_tells_rigid_motions_and_mass():
    told = "\n".join(space_truss().check())
    assert "rigid motions x, y, z, rx, ry, rz" in told
    assert "rᵀMr: 5 kg along x, 5 kg along y, 5 kg along z" in told
    assert "lowest frequencies without supports: 0, 0, 0, 0, 0, 0 Hz" in told


def test_dofs_in_another_order_are_told():
    truss = space_truss()
    labels = [*truss.labels[1::-1], *truss.labels[2:]]  # x and y of node 1 exchanged
    swapped = fb.Structure(truss.K, truss.M, labels=labels, nodes=truss.nodes)
    assert any("K resists the rigid motions" in line and "another order" in line for line in swapped.check())


def test_grounded_structures_are_told():
    said = re.compile(r"K resists the rigid motions x \(\S+ of \|K\|\|r\|\):")
    assert any(said.match(line) for line in fb.Structure(K, M).check())


def test_stiffness_of_few_decimals_is_told():
    """Nine decimals make ω² of the rigid motions negative: check ended as an error that called the body unstable."""
    nodes = {"A": (0, 0, 0), "B": (0.31, 0.12, -0.07), "C": (0.2, 0.53, 0.11), "D": (-0.1, 0.7, 0.4)}
    made = fb.Frame.polyline(nodes, fb.Section.rectangle(2.1e11, 7850.0, 0.013, 0.027)).reduced(list(nodes), modes=0)
    K, M = (np.vectorize(lambda x: float(f"{x:.9e}"))(A.toarray()) for A in (made.K, made.M))
    told = fb.Structure((K + K.T) / 2, (M + M.T) / 2, labels=made.labels).check()
    assert any("or K is rounded, for this is" in line and "give more digits" in line for line in told)
    wrong = fb.Structure(np.diag([4.0, -1.0]), np.eye(2)).check()
    assert any(line.endswith("got omega² = -1 in modal_basis; the structure is unstable") for line in wrong)


def test_a_lost_dof_shows_in_the_mass():
    truss = space_truss()
    kept = np.arange(11)
    part = fb.Structure(truss.K[kept][:, kept], truss.M[kept][:, kept], labels=truss.labels[:11])
    assert any("the mass is not the same along all axes" in line for line in part.check())


BAD = [
    (lambda: fb.Structure([[2.0 + 0.1j]], [[1.0]]), "K must be real; its largest imaginary part is, got 0.1"),
    (lambda: fb.Structure(sparse.csr_array([[2.0]]), sparse.csr_array([[1.0 + 1e-9j]])), "M must be real"),
    (lambda: fb.Structure(np.ones((2, 3)), M), r"K must be square, got \(2, 3\) in Structure"),
    (lambda: fb.Structure(K, np.eye(3)), r"M must have the shape of K, \(2, 2\), got \(3, 3\)"),
    (lambda: fb.Structure(K, M, np.eye(3)), r"C must have the shape of K"),
    (lambda: fb.Structure(np.triu(K), M), "K must be symmetric, got entries that differ by 1e\\+04 of 3e\\+04 between"),
    (lambda: fb.Structure(np.array([[1.0, np.nan], [np.nan, 1.0]]), M), "K must be finite, .* 1e36"),
    (lambda: fb.Structure(K, -M), "M must be positive semidefinite; the mass of dof 'x' of node 1 is negative"),
    (lambda: fb.Structure(K, [[1.0, 2.0], [2.0, 1.0]]), "M must be positive semidefinite; its least pivot"),
    (lambda: fb.Structure(K, [[0.0, 1.0], [1.0, 1.0]]), "no mass of its own but coupling"),
    (lambda: fb.Structure(K, M, labels=[(1, "x")]), "labels must be 2, one for each dof of K, got 1"),
    (lambda: fb.Structure(K, M, labels=1.0), "labels must be a list, got 1.0"),
    (lambda: fb.Structure(K, M, labels=[(1, "x"), (1, "x")]), "labels must not repeat: dof 0 and dof 1"),
    (lambda: fb.Structure(K, M, labels=[(1, "x"), (1, "w")]), r"labels\[1\] must be a node and one of x, y"),
    (lambda: fb.Structure(K, M, points={"end": 5}), "point 'end' must be a node of labels; 1 is the nearest"),
    (lambda: fb.Structure(K, M, nodes={0: (1.0,)}), r"nodes\[0\] must be three numbers"),
    (lambda: fb.Structure(K, M, nodes={0: "abc"}), r"nodes\[0\] must be three numbers.*, got 'abc'"),
    (lambda: fb.Structure(K, M, nodes={0: (0.0, [1.0])}), r"nodes\[0\] must be three numbers"),
    (lambda: fb.Structure(K, M, nodes=[(0.0, 0.0), (1.0, 0.0)]), "nodes must be a dict by name, got"),
    (lambda: fb.Structure(K, M, points=["tip"]), "points must be a dict by name, got"),
    (lambda: fb.Structure(K, M, lines=[(0, 1)]), "lines must join nodes whose coordinates are given"),
    *((lambda bad=bad: fb.Structure(K, M, lines=bad), "lines must be a list, got") for bad in (5, None, "ab", {})),
    *((lambda bad=bad: fb.Structure(K, M, lines=[bad]), "each of lines must be two nodes") for bad in ("ab", 0, [0])),
    (lambda: fb.Structure(K, M, nodes={0: (0.0, 0.0, 0.0)}, lines=[(0, [1])]), "lines must join names or numbers of"),
    (lambda: fb.Structure("K", M), "K must be numbers, got .K. in Structure"),
    (lambda: fb.Structure(K, M).assembled(elements=3), "elements must be left out"),
    (lambda: beam_structure().rows("tp"), "a place must be a point or a node of the structure; 'tip' is the nearest"),
    (lambda: fb.Scale("mm", "ton"), "mass must be one of kg, t, g"),
    (lambda: fb.Scale(time=0.0), "time must be positive"),
    (lambda: fb.Structure(K, M, scale="mm"), "scale must be a Scale of three units, got 'mm' in Structure"),
    (lambda: direction_of("w", "Stop"), "direction must be one of x, y, z, rx, ry, rz"),
    (lambda: direction_of((0, 0, 0), "Stop"), "not all zero"),
    (lambda: direction_of((1, 0, 0, 0), "Stop"), "two or three numbers"),
]


test_bad_input_is_refused_in_a_sentence = refused(*BAD)


def test_massless_dofs_follow_statically():
    """The frequencies are those of the pencil with infinite roots, and the rotations those of the static shape."""
    K, M = beam_matrices()
    heavy = np.diag(np.diag(M)) * np.tile([1.0, 0.0], ELEMENTS + 1)  # rotations without mass
    body = fb.Structure(K, heavy, labels=beam_labels(), points={"root": 0, "tip": 8})
    assert body.massless == [(i, "rx") for i in range(ELEMENTS + 1)]
    assert any("9 dofs have no mass" in line for line in body.check())
    scene = fb.Scene(body, [fb.Clamped("root")])
    model = scene.reduce(modes="all")
    free = np.arange(2, 2 * ELEMENTS + 2)
    inverse = linalg.solve(K[np.ix_(free, free)], heavy[np.ix_(free, free)])  # 1/ω², zeros of massless dofs
    exact = np.sort(1 / np.sqrt(np.sort(linalg.eigvals(inverse).real)[ELEMENTS:]))
    np.testing.assert_allclose(model.omega, exact, rtol=1e-8)
    assert "8 of them without mass follow statically" in scene.matrices().accuracy


def test_loads_on_massless_dofs_are_told():
    body = fb.Structure(K, np.diag([1.0, 0.0]), labels=[("a", "x"), ("b", "x")])
    with pytest.warns(UserWarning, match=r"forces\[0\] acts on \('b', 'x'\), a dof without mass"):
        fb.Scene(body, forces=[fb.PointForce("b", fb.Harmonic(1.0, 1.0), "x")]).matrices()


def test_a_massless_dof_that_nothing_holds_is_named():
    with pytest.raises(ValueError, match=r"a dof without mass must be held by stiffness, got \('b', 'x'\)"):
        following(np.diag([1.0, 0.0]), np.diag([1.0, 0.0]), [("a", "x"), ("b", "x")], "Scene")


def test_units_of_another_program():
    """Millimetres, tonnes and seconds: the same frequencies, rotations included, and the mass in kg."""
    si = beam_structure()
    length = np.array([1e3 if c == "y" else 1.0 for _, c in si.labels])  # u in mm per m
    energy = 1e-3 / 1e-6  # t mm²/s² are 1e-3 J
    given = [energy * (A.toarray() / np.outer(length, length)) for A in (si.K, si.M)]
    nodes = {node: 1e3 * at for node, at in si.nodes.items()}
    body = fb.Structure(*given, labels=si.labels, nodes=nodes, scale=fb.Scale("mm", "t", "s"))
    np.testing.assert_allclose(body.K.toarray(), si.K.toarray(), rtol=1e-12)
    np.testing.assert_allclose(body.M.toarray(), si.M.toarray(), rtol=1e-12)
    np.testing.assert_allclose(body.nodes[8], [0, 0, 0.5])


def test_given_modes_are_the_structure_they_came_from():
    """Modes, shapes and participation of a clamped beam give its run, contacts included."""
    stop = fb.Stop("tip", LAW, 1e-3, direction="y")
    options = {"stops": [stop], "damping": fb.ModalDamping(0.01), "base": {"y": fb.Harmonic(1e-3, 180.0)}}
    model = fb.Scene(beam_structure(), [fb.Clamped("root")], **options).reduce(modes=3)
    tip, middle = model.phi(("tip", "y")), model.phi(("middle", "rx"))
    body = fb.Structure.of_modes(model.omega, [tip, middle], [("tip", "y"), ("middle", "rx")],
                                 {"y": model.participation[:, 0]})  # fmt: skip
    again = fb.Scene(body, **options).reduce(modes="all")
    np.testing.assert_allclose(again.participation, model.participation, rtol=1e-12)
    one, other = (m.simulate(0.1, 1e-3) for m in (model, again))
    assert len(one.contacts) > 2
    np.testing.assert_allclose(other.contacts.t_in, one.contacts.t_in, atol=1e-12)
    np.testing.assert_allclose(other.displacement("middle", "rx"), one.displacement("middle", "rx"), atol=1e-12)


ONE_MODE = fb.Structure.of_modes([1.0], [[0.5]], [(1, "x")])

test_given_modes_that_do_not_fit_are_refused = refused(
    (lambda: fb.Structure.of_modes([2.0, 1.0], np.ones((1, 2)), [(1, "x")]), "omega must be .* ascending"),
    (lambda: fb.Structure.of_modes([1.0, 2.0], np.ones((1, 3)), [(1, "x")]), "shapes must be finite and have"),
    (lambda: fb.Structure.of_modes([1.0], [[1.0]], [(1, "x")], {"w": [1.0]}), "participation must be named"),
    (lambda: fb.Structure.of_modes([1.0], [[1.0]], [(1, "x")], {"x": [1.0, 2.0]}), "must be 1 finite numbers"),
    (lambda: fb.Scene(ONE_MODE, [fb.Fixed(1)]).matrices(), "a support must hold a node"),
    (lambda: fb.Scene(ONE_MODE, base={"x": fb.Harmonic(1.0, 1.0)}), "base must move along nothing"),
)


def test_complex_numbers_without_imaginary_parts_are_real():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fb.Structure([[8.0 + 0.0j]], sparse.csr_array([[2.0 + 0.0j]]))
    assert fb.Scene(found).reduce(modes=1).omega == pytest.approx([2.0])
    with pytest.raises(ValueError, match="shapes must be real; its largest imaginary part is, got 1"):
        fb.Structure.of_modes([10.0], [[1.0 + 1.0j]], [("a", "x")])


@pytest.mark.parametrize("given", ["matrices", "modes"])
def test_rows_of_many_places_are_made_at_once(given, monkeypatch):
    """One after another those of 32 000 places took nine tenths of the time of `reduce`."""
    labels = [(1, "y"), (1, "x"), (2, "z"), (5, "x")]
    if given == "modes":
        body = fb.Structure.of_modes([30.0, 190.0], np.arange(8.0).reshape(4, 2), labels, {"y": [1.2, 0.7]})
    else:
        body = fb.Structure(np.eye(4), np.eye(4), labels=labels, points={"tip": 5})
    last = 5 if given == "modes" else "tip"
    one_by_one = np.vstack([body.rows(place).toarray() for place in (2, last, 1)])
    made = body.assembled()
    monkeypatch.setattr(sparse, "vstack", None)
    assert np.array_equal(made.rows_of([2, last, 1]).toarray(), one_by_one)
