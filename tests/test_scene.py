"""Scenes: the paper's beam, features on the mesh, damping, and what is refused."""

import math
from fractions import Fraction

import numpy as np
import pytest
from problems import PAPER_BEAM
from refusals import refused

import fembeam as fb
import reduction
from contacts import Hertz, KelvinVoigt, law
from fembeam.beams import Beam, ModalDamping, Rayleigh, Section
from fembeam.excitation import Harmonic
from fembeam.scene import Clamped, Dashpot, Guided, LumpedMass, Pinned, PointForce, Scene, Spring, Stop

UNIT = Section(E=1.0, rho=1.0, A=1.0, I=1.0)
BEAM = Beam(1.0, UNIT)


class Linear:
    """Stand-in for a law."""

    def force(self, delta, delta_dot, entry_rate):
        return delta


def paper(inertia=3.0e-6, **parts):
    mass = LumpedMass(0.24445, mass=25.4e-3, inertia=inertia)
    return Scene(PAPER_BEAM, [Clamped(0.0)], [mass], **parts)


def basis_of(scene, modes, **mesh):
    matrices = scene.matrices(modes=modes, **mesh)
    return matrices, reduction.modal_basis(matrices.M, matrices.K, modes, root=matrices.root)


@pytest.mark.parametrize("modes", [3, 10, 30])
@pytest.mark.parametrize(
    ("inertia", "omega"),
    [
        (3.0e-6, [109.1299120547, 790.6100943811, 2303.729838331]),
        (0.0, [109.2243455999, 800.0303389402, 2379.248123522]),
    ],
)
def test_paper_frequencies(inertia, omega, modes):
    _, basis = basis_of(paper(inertia), modes)
    np.testing.assert_allclose(basis.omega[:3], omega, rtol=1e-6 if modes == 3 else 1e-8)


def test_nodes_on_every_feature_and_probe():
    beam = Beam.of_spans([(0.31, UNIT), (0.69, UNIT)])
    scene = Scene(
        beam,
        [Clamped(0.0), Pinned(0.97)],
        [LumpedMass(0.123, 1.0)],
        [Spring(0.456, 1.0)],
        [Dashpot(0.511, 1.0)],
        [Stop(0.789, Linear())],
        forces=[PointForce(0.832, np.sin)],
    )
    for matrices in (scene.matrices(modes=3, probes=[0.6543]), scene.matrices(elements=20, probes=[0.6543])):
        for z in (0.0, 0.31, 0.123, 0.456, 0.511, 0.789, 0.832, 0.6543, 0.97, 1.0):
            assert np.min(np.abs(matrices.nodes - z)) < 1e-15
        assert np.all(np.diff(matrices.nodes) > 0)
    assert scene.matrices(elements=20).elements == 20
    assert scene.matrices(elements=1).elements == 8  # the features alone


def test_dof_map_and_sizes():
    matrices = Scene(BEAM, [Clamped(0.0), Pinned(0.5), Guided(1.0)]).matrices(elements=4)
    assert matrices.dofs.tolist() == [[-1, -1], [0, 1], [-1, 2], [3, 4], [5, -1]]
    assert matrices.M.shape == matrices.K.shape == matrices.C.shape == (6, 6)
    assert all(A.format == "csr" for A in (matrices.M, matrices.K, matrices.C, matrices.dashpots))
    assert matrices.influence.tolist() == [1, 0, 0, 1, 0, 1]
    rounding = np.finfo(float).eps * abs(matrices.K).max()  # entries are sums of some four products of rounded numbers
    assert abs(matrices.K - matrices.root.T @ matrices.root).max() < 10.0 * rounding


def test_interpolation_sees_supported_dofs_as_zero():
    matrices = Scene(BEAM, [Clamped(0.0)]).matrices(elements=7)
    free = matrices.dofs >= 0
    nodal = np.column_stack([matrices.nodes**2 * (3 - matrices.nodes), 6 * matrices.nodes - 3 * matrices.nodes**2])
    u, z = nodal[free], np.linspace(0, 1, 23)
    np.testing.assert_allclose(matrices.interpolation(z) @ u, z**2 * (3 - z), atol=1e-13)
    np.testing.assert_allclose(matrices.interpolation(z, 1) @ u, 6 * z - 3 * z**2, atol=1e-12)
    np.testing.assert_allclose(matrices.interpolation(z, 2) @ u, 6 - 6 * z, atol=1e-11)
    assert matrices.interpolation(0.5).shape == (1, 14)
    for bad in (1.0001, -1e-6, math.nan):
        with pytest.raises(ValueError, match=r"z must lie on the beam, 0 to 1.0 m, got .* in interpolation"):
            matrices.interpolation([0.5, bad])


def test_base_load_includes_the_columns_of_supported_dofs():
    # A uniform field u = 1 of the whole beam: the momentum of all free and supported dofs is the mass.
    coarse = Scene(BEAM, [Clamped(0.0)]).matrices(elements=1)
    np.testing.assert_allclose(coarse.base_load, [(156 + 54) / 420, (-22 - 13) / 420 + 0.0], rtol=1e-13)
    assert not np.allclose(coarse.base_load, coarse.M @ coarse.influence)


def test_cantilever_effective_masses():
    matrices, basis = basis_of(Scene(BEAM, [Clamped(0.0)]), 40)
    mass = basis.effective_mass(matrices.base_load)
    np.testing.assert_allclose(mass[:3], [0.613076, 0.188300, 0.064732], atol=1e-6)
    assert 0.98 < mass.sum() < 1.0


def test_offset_mass_is_a_rigid_arm():
    m, J, e = 0.7, 0.02, 0.15
    matrices = Scene(BEAM, [Clamped(0.0)], [LumpedMass(1.0, m, J, e)]).matrices(elements=3)
    bare = Scene(BEAM, [Clamped(0.0)]).matrices(elements=3)
    expected = [[m, m * e], [m * e, J + m * e**2]]
    np.testing.assert_allclose((matrices.M - bare.M).toarray()[-2:, -2:], expected, rtol=1e-12)
    assert matrices.base_load[-2:] - bare.base_load[-2:] == pytest.approx([m, m * e])


def test_very_stiff_spring_is_a_support():
    spring = Scene(BEAM, [Clamped(0.0)], springs=[Spring(1.0, 1e13)])
    pinned = Scene(BEAM, [Clamped(0.0), Pinned(1.0)])
    np.testing.assert_allclose(basis_of(spring, 4)[1].omega, basis_of(pinned, 4)[1].omega, rtol=1e-9)


@pytest.mark.parametrize("gap", [1e-5, 1e-7, 1e-12])
def test_features_close_together_keep_their_digits(gap):
    two = Scene(BEAM, [Clamped(0.0)], [LumpedMass(0.5 - gap / 2, 1.0), LumpedMass(0.5 + gap / 2, 1.0)])
    one = Scene(BEAM, [Clamped(0.0)], [LumpedMass(0.5, 2.0)])
    np.testing.assert_allclose(basis_of(two, 3)[1].omega, basis_of(one, 3)[1].omega, rtol=1e-7)


def test_mesh_says_what_it_promises():
    scene = paper()
    matrices, basis = basis_of(scene, 3)
    assert str(matrices) == "Matrices: 44 elements, 88 free dofs: the lowest 3 frequencies are right to 1e-06 relative"
    assert 3e-7 < matrices.frequency_error(basis.omega[-1]) < 1e-6
    assert "as asked" in scene.matrices(elements=5).accuracy
    assert scene.matrices().modes == 10


def test_elements_follow_the_local_wavelength():
    thin = Section(1.0, 1.0, 0.1, 1e-5)  # wavenumber 10 times the unit section's
    matrices = Scene(Beam.of_spans([(1.0, UNIT), (1.0, thin)]), [Clamped(0.0)]).matrices(modes=20)
    inside = np.diff(matrices.nodes)
    assert inside[0] / inside[-1] == pytest.approx(10, rel=0.1)


# --- damping ---------------------------------------------------------------------------------------------


def test_modal_damping_matrix_gives_its_ratios_back():
    matrices, basis = basis_of(Scene(BEAM, [Clamped(0.0)], damping=ModalDamping([0.02, 0.01])), 4, elements=10)
    coefficients = basis.project_matrix(matrices.C)
    expected = 2 * np.array([0.02, 0.01, 0.01, 0.01]) * basis.omega
    np.testing.assert_allclose(coefficients, np.diag(expected), atol=1e-9 * expected.max())
    assert ModalDamping([0.02, 0.01]).ratios(basis.omega[[0, 3]], indices=[0, 3]).tolist() == [0.02, 0.01]
    assert ModalDamping(1.5).ratios([1.0]).tolist() == [1.5]


def test_rayleigh():
    damping = Rayleigh(alpha=0.3, beta=0.02)
    matrices = Scene(BEAM, [Clamped(0.0)], damping=damping).matrices(elements=4)
    np.testing.assert_allclose((matrices.C - 0.3 * matrices.M - 0.02 * matrices.K).toarray(), 0, atol=1e-12)
    omega = np.array([0.0, 2.0])
    np.testing.assert_allclose(damping.modal_coefficients(omega), [0.3, 0.38])
    np.testing.assert_allclose(damping.ratios(omega), [np.inf, 0.095])
    assert Rayleigh(0.0, 0.1).ratios([0.0]).tolist() == [0.0]


def test_dashpots_come_on_top():
    scene = Scene(BEAM, [Clamped(0.0)], dashpots=[Dashpot(1.0, 3.0, 0.5)], damping=Rayleigh(0.1, 0.0))
    matrices = scene.matrices(elements=2)
    assert matrices.dashpots.toarray()[-2:, -2:] == pytest.approx(np.diag([3.0, 0.5]))
    np.testing.assert_allclose((matrices.C - matrices.dashpots - 0.1 * matrices.M).toarray(), 0, atol=1e-13)


def test_rigid_body_modes_are_not_damped_by_modal_ratios():
    scene = Scene(BEAM, damping=ModalDamping(0.1))
    matrices = scene.matrices(elements=4)
    assert np.abs(matrices.C @ matrices.influence).max() < 1e-9 * abs(matrices.C).max()


def test_full_modal_damping_has_a_size_limit():
    matrices = Scene(BEAM, [Clamped(0.0)], damping=ModalDamping(0.1)).matrices(elements=1001)
    with pytest.raises(ValueError, match="at most 2000 free dofs, got 2002 in ModalDamping"):
        _ = matrices.C
    free = Scene(BEAM, [Clamped(0.0)]).matrices(elements=1001)
    assert free.C.nnz == 0


# --- bad input -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "feature"),
    [
        ("supports", lambda z: Pinned(z)),
        ("masses", lambda z: LumpedMass(z, 1.0)),
        ("springs", lambda z: Spring(z, 1.0)),
        ("dashpots", lambda z: Dashpot(z, 1.0)),
        ("stops", lambda z: Stop(z, Linear())),
        ("forces", lambda z: PointForce(z, np.sin)),
    ],
)
def test_features_must_sit_on_the_beam(name, feature):
    good = [Clamped(0.0)] if name == "supports" else [feature(0.5)]
    supports = {} if name == "supports" else {"supports": [Clamped(0.0)]}
    for z in (1.001, -0.001):
        with pytest.raises(ValueError, match=rf"z must lie on the beam, 0 to 1.0 m, got {z} in {name}\[1\]"):
            Scene(BEAM, **{name: [*good, feature(z)]}, **supports)


class OneByOne:
    """A motion that its writer made for one time at once."""

    def __call__(self, t):
        return math.sin(t)

    def derivative(self, order):
        return self


STEEL = fb.Section.circle(2.1e11, 7800.0, 0.01)
PARTS_REFUSED = [
    (lambda: LumpedMass(0.5, -1.0), "mass must be finite and not negative, got -1.0 in LumpedMass at z = 0.5"),
    (lambda: LumpedMass(0.5, 1.0, math.nan), "inertia must be finite and not negative, got nan"),
    (lambda: LumpedMass(0.5, 1.0, 0.0, math.inf), "offset must be finite, got inf"),
    (lambda: Spring(0.5, -2.0), "stiffness must be finite and not negative"),
    (lambda: Spring(0.5, 2.0, "a"), "rotational must be a number, got 'a'"),
    (lambda: Dashpot(0.5, -2.0), "damping must be finite and not negative"),
    (lambda: Stop(0.5, Linear(), gap=math.nan), "gap must be finite, got nan in Stop at z = 0.5"),
    (lambda: Stop(0.5, Linear(), side="left"), "side must be 'below' or 'above', got 'left'"),
    (lambda: Stop(0.5, lambda d, v, e: d), "law must not be a bare function, .*decorate it with @law"),
    (lambda: Stop(0.5, law(lambda delta, delta_dot, entry_rate: delta)), "law must not be .*with @law .*, and call it"),
    (lambda: Stop(0.5, 3.0), "law must offer force"),
    (lambda: Stop(0.5, Linear), "law must offer force"),
    (lambda: PointForce(0.5, None), "signal must be a function of t, got None"),
    (lambda: PointForce(0.5, Harmonic), "signal must be a signal made with its values, got <class"),
    (lambda: Spring(0.5, 1e3, foot=Harmonic), "foot must be a signal made with its values, got <class"),
    (lambda: PointForce(0.5, 3.0), "signal must be a function of t, got 3.0 .* a constant"),
    (lambda: PointForce(0.5, math.sin), r"must take an array of times, got TypeError .* in PointForce at z = 0.5"),
    (lambda: PointForce(0.5, lambda t: 0.0 if t > 1.0 else 9.0), "must take an array of times, .* np.where for if"),
    (lambda: Rayleigh(-1, 0), "alpha must be finite and not negative, got -1 in Rayleigh"),
    (lambda: Rayleigh(0, math.nan), "beta must be finite and not negative, got nan"),
    *((lambda bad=bad: ModalDamping(bad), r"zeta.* must .* in ModalDamping")
      for bad in (-0.1, math.nan, [0.1, math.inf], [], "x", [0.1, None])),
    (lambda: fb.Scene(fb.Beam(1.0, STEEL), gravity="9.81"), "gravity must be a number, got '9.81' in Scene"),
    (lambda: fb.Stop(0.5, Hertz(1e8), gap="0"), "gap must be a number, got '0' in Stop at z = 0.5"),
    (lambda: fb.Beam("1", STEEL), "length must be a number, got '1' in Beam"),
    (lambda: fb.LumpedMass(0.5, None), "mass must be a number, got None in LumpedMass"),
    (lambda: fb.ModalDamping(["1 %"]), r"zeta\[0\] must be a number, got '1 %' in ModalDamping"),
    (lambda: fb.Element(0.5, KelvinVoigt(1e3, 1.0), to=(1, "y")), r"to must be a place z, \(body, z\) or None"),
    (lambda: fb.Element(0.5, KelvinVoigt(1e3, 1.0), to=("1", 0.2)), r"to must be a place z, \(body, z\) or None"),
    (lambda: fb.Harmonic(True, 50.0), "Harmonic amplitude must be a number, got True"),
]  # fmt: skip
SCENES_REFUSED = [
    (lambda: Scene(BEAM, [Clamped(0.0), Pinned(0.0)]), "supports must not share one place, got .*Clamped.*, Pinned"),
    (lambda: Scene(BEAM, [Clamped(0.0), Pinned(1e-6)]).matrices(), "supports and span ends must be 0.0001 m apart"),
    (lambda: Scene(BEAM, Clamped(0.0)), "supports must be a list of Clamped or Pinned or Guided"),
    (lambda: Scene(BEAM, [Clamped(0.0)], [Spring(0.1, 1.0)]), r"masses\[0\] must be a LumpedMass"),
    (lambda: Scene(BEAM, [Clamped(0.0)], damping=0.1), "damping must be ModalDamping or Rayleigh, got 0.1"),
    (lambda: Scene(1.0), "beam must be a Beam"),
    (lambda: Scene(BEAM, [Clamped(0.0)], base=lambda t: 1e-3 * np.sin(t)),
     "base must be a motion .* got <function .* without derivative in Scene; use Har"),
    (lambda: Scene(BEAM, [Clamped(0.0)], base=1e-3), "got 0.001 without __call__ and derivative"),
    (lambda: Scene(BEAM, [Clamped(0.0)], base=Harmonic), "got <class .*Harmonic'> without values"),
    (lambda: Scene(BEAM, [Clamped(0.0)], base=OneByOne()), "base must take an array of times, got TypeError"),
    *((lambda bad=bad: paper().matrices(elements=bad), "elements must be a whole number above 0")
      for bad in (0, -1, 2.5, True, "10")),
    *((lambda bad=bad: paper().matrices(modes=bad), "modes must be a whole number above 0")
      for bad in (0, -1, 2.5, True, "10")),
    (lambda: paper().matrices(elements=4, modes=9), r"modes must be at most 8 \(free dofs\), got 9"),
    (lambda: paper().reduce(modes=5000), "modes must be at most 300, got 5000 .*; keep the modes"),
    (lambda: paper().reduce(modes=[0, 5000]), "modes must be at most 300, got 5001 "),
    (lambda: paper().matrices(elements=10**9), "elements must be at most 10000, .* got 1000000000 "),
    (lambda: paper().matrices(probes=[0.1, 0.3]), r"z must lie on the beam, .* got \[0.3\] in probes"),
    (lambda: paper().matrices(probes=0.1), "probes must be a list, got 0.1 in Scene.matrices; put it in brackets"),
    (lambda: paper().reduce(residual="false"), "residual must be True or False, got 'false' in Scene.reduce"),
    (lambda: paper().reduce(interface=1), "interface must be True or False, got 1 in Scene.reduce"),
    (lambda: paper().matrices(probes=[math.nan]), r"probes\[0\] must be finite"),
]  # fmt: skip


test_parts_are_refused = refused(*PARTS_REFUSED)


test_scenes_and_their_matrices_are_refused = refused(*SCENES_REFUSED, error=(ValueError, TypeError))


def test_rigid_body_modes_are_announced():
    cases = [
        ([], [], 2),
        ([Pinned(0.3)], [], 1),
        ([Guided(0.3)], [], 1),
        ([Pinned(0.3), Pinned(0.5)], [], 0),
        ([Pinned(0.3), Guided(0.5)], [], 0),
        ([Guided(0.3), Guided(0.5)], [], 1),
        ([Pinned(0.3)], [Spring(0.9, 1.0)], 0),
        ([Pinned(0.3)], [Spring(0.3, 1.0)], 1),
        ([Pinned(0.3)], [Spring(0.3, 0.0, 1.0)], 0),
        ([], [Spring(0.3, 1.0, 1.0)], 0),
        ([], [Spring(0.3, *np.array([1.0, 1.0]))], 0),
    ]
    for supports, springs, count in cases:
        with pytest.warns(UserWarning, match=f"{count} rigid-body") if count else _silent():
            scene = Scene(BEAM, supports, springs=springs, base=Harmonic(1e-3, 50.0))
        assert scene.rigid_body_modes == count
        assert np.sum(basis_of(scene, 4)[1].omega == 0.0) == count


def test_scenes_that_are_meant_to_move_freely_are_not_warned_of():
    below, above = (Stop(0.5, Hertz(1e8), gap=1e-3, side=side) for side in ("below", "above"))
    y, free = Harmonic(1e-3, 50.0), Scene(BEAM)
    meant = [
        {},  # thrown or struck
        {"supports": [Pinned(0.0)], "stops": [below], "gravity": 9.81},  # lies on its stop
        {"stops": [below, above], "base": y},
        {"supports": [Clamped(0.0)], "bodies": [free], "stops": [below]},
        {"bodies": [free], "stops": [Stop(0.5, Hertz(1e8), side=side, on=(1, 0.5)) for side in ("below", "above")]},
    ]
    for parts in meant:
        with _silent():
            Scene(BEAM, **parts)
    on_body = Stop(0.5, Hertz(1e8), side="above", on=(1, 0.5))
    with _silent():  # a body that gravity lays on the beam
        Scene(BEAM, [Clamped(0.0)], stops=[on_body], bodies=[free], gravity=9.81)
    drifting = [
        ({"stops": [below], "base": y}, "2 rigid-body modes appear in Scene"),
        ({"stops": [above], "supports": [Pinned(0.0)], "gravity": 9.81}, "1 rigid-body mode appears in Scene"),
        ({"supports": [Clamped(0.0)], "bodies": [free], "stops": [below], "gravity": 9.81}, r"in bodies\[0\] of Scene"),
        ({"forces": [PointForce(0.5, y)]}, "its loads may carry it away"),
    ]
    for parts, message in drifting:
        with pytest.warns(UserWarning, match=message):
            Scene(BEAM, **parts)


def _silent():
    import warnings

    context = warnings.catch_warnings(action="error")
    return context


def test_the_finest_meshes_keep_their_digits():
    omega = paper().reduce(2, elements=10_000).omega
    assert omega == pytest.approx([109.1299120547, 790.6100943811], rel=1e-9)


def test_a_mesh_too_fine_is_noticed(monkeypatch):
    monkeypatch.setattr(reduction.modal, "MOST_CORRECTIONS", 1)
    with pytest.raises(reduction.AccuracyError, match="frequencies must settle to 1e-09, got a change of"):
        paper().reduce(2, elements=4_000)


def test_lists_become_tuples_and_stay_the_callers():
    supports = [Clamped(0.0)]
    scene = Scene(BEAM, supports)
    supports.append(Pinned(1.0))
    assert scene.supports == (Clamped(0.0),)
    assert scene.masses == scene.stops == ()


AT = {
    "Clamped": fb.Clamped,
    "Pinned": fb.Pinned,
    "Guided": fb.Guided,
    "LumpedMass": lambda z: fb.LumpedMass(z, 0.1),
    "Spring": lambda z: fb.Spring(z, 1e3),
    "Dashpot": lambda z: fb.Dashpot(z, 1.0),
    "Stop": lambda z: fb.Stop(z, Hertz(1e8)),
    "Element": lambda z: fb.Element(z, KelvinVoigt(1e3, 1.0)),
    "PointForce": lambda z: fb.PointForce(z, fb.Harmonic(1.0, 50.0)),
    "PointMoment": lambda z: fb.PointMoment(z, fb.Harmonic(1.0, 50.0)),
    "Impactor": lambda z: fb.Impactor(z, 0.1, -1.0, Hertz(1e8)),
}


@pytest.mark.parametrize("part", AT)
def test_a_place_is_checked_where_it_is_written(part):
    for bad in ("0.5", None, 0.5 + 0j, (0.5, "y"), np.array(0.5), True, Fraction(1, 2)):
        with pytest.raises(ValueError, match=rf"z must be a number, got .* in {part}; give the coordinate along the"):
            AT[part](bad)
    with pytest.raises(ValueError, match=f"z must be finite, got nan in {part}"):
        AT[part](math.nan)


@pytest.mark.parametrize("kind", [np.longdouble, np.float32])
def test_every_kind_of_float_is_a_place(kind):
    """np.longdouble ended as a TypeError of NumPy when the scene was reduced."""

    def moved(number):
        """A run with places, gap, mass and gravity of a kind."""
        one, half = number(1), number(1) / number(2)
        stop = fb.Stop(half, Hertz(1e8), gap=half / number(512), on=half / number(2))
        element = fb.Element(one, KelvinVoigt(1e3, 1.0))
        scene = fb.Scene(fb.Beam(one, STEEL), [fb.Clamped(number(0))], [fb.LumpedMass(half, one)], stops=[stop],
                         elements=[element], gravity=one)  # fmt: skip
        return scene.reduce(1).simulate(0.01, 1e-3).q

    np.testing.assert_array_equal(moved(kind), moved(float))


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int16, np.uint64, np.float32])
def test_numbers_of_numpy_count_like_those_of_python(kind):
    """Small and unsigned whole numbers of NumPy wrap around: -np.uint8(1) is 255, np.int16(100)**3 is 16960."""

    def omega(of):
        section = fb.Section.rectangle(2e11, 7800.0, of(5), of(7))
        assert section.I == 5 * 7**3 / 12
        scene = fb.Scene(
            fb.Beam(of(100), section, axial_force=of(100)),
            [fb.Clamped(of(0))],
            masses=[fb.LumpedMass(of(100), mass=of(100), inertia=of(100), offset=of(20))],
            stops=[fb.Stop(of(100), Hertz(of(100)), gap=of(1))],
            gravity=of(100),
        )
        run = scene.reduce(2).simulate(of(1), 0.1)
        frame = fb.Frame({"A": (of(0), of(0)), "B": (of(100), of(0))}, [fb.Member("A", "B", section)])
        parts = {"masses": [fb.LumpedMass("B", of(100), offset=(of(20), of(20)))], "gravity": (of(0), of(100))}
        placed = fb.Scene(frame, [fb.Clamped("A")], **parts).reduce(3)
        return np.concatenate([run.model.omega, run.indentation(0), placed.omega, placed.equilibrium()])

    np.testing.assert_array_equal(omega(kind), omega(float))
