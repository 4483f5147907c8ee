"""What is said of places that are written wrongly: numbers for names, names for numbers, mm for m, no direction."""

import re

import numpy as np
import pytest

import fembeam as fb
import reduction
from contacts import KelvinVoigt

LAW = KelvinVoigt(1e5, 10.0)
STEEL = fb.Section.tube(2.0e11, 7900.0, 0.0603, 0.0525)
BENT = fb.Frame.polyline({"33": (0, 0, 0), "34": (2, 0, 0), "N35": (2, 0, 1.5)}, STEEL)
STRAIGHT = fb.Frame.polyline({"3": (0, 0, 0), "4": (0, 0, 2)}, STEEL)
BODY = fb.Structure(1e4 * np.eye(2), np.eye(2), labels=[(33, "x"), (34, "x")], points={"35": 34})
BEAM = fb.Beam(0.5, STEEL)


def stop(body, place, direction="x"):
    return fb.Scene(body, stops=[fb.Stop(place, LAW, direction=direction)])


@pytest.fixture(scope="module")
def run():
    scene = fb.Scene(BENT, [fb.Clamped("33")], stops=[fb.Stop("N35", LAW, direction="z")])
    return scene.reduce(2).simulate(0.01, 1e-3)


@pytest.fixture(scope="module")
def straight():
    return fb.Scene(BEAM, [fb.Clamped(0.0)], base=fb.Harmonic(1e-3, 50.0)).reduce(1)


@pytest.mark.parametrize(
    "bad", ["abc", "9.81", None, True, 1 + 2j, [True], ["a"], [None], [[1.0], [2.0, 3.0]]], ids=repr
)
@pytest.mark.parametrize("name", ["z", "omega", "start", "duration", "dt", "body"])
def test_a_model_says_which_argument_is_no_number(straight, name, bad):
    calls = {
        "z": lambda: straight.simulate(0.01, 1e-3).displacement(bad),
        "omega": lambda: straight.frequency_response(bad, output=0.4),
        "start": lambda: straight.simulate(0.01, start=bad),
        "duration": lambda: straight.for_duration(bad),
        "dt": lambda: straight.simulate(0.01, bad),
        "body": lambda: straight.phi(0.4, body=bad),
    }
    if bad is None and name in ("start", "dt"):
        return  # stands for rest, and for no samples
    said = "places of a beam must be" if name == "z" and isinstance(bad, str) else f"{name} must be"
    with pytest.raises(ValueError, match=re.escape(said)) as raised:
        calls[name]()
    assert repr(bad) in str(raised.value)


@pytest.mark.parametrize("bad", ["abc", None, True, 1 + 2j, float("nan")], ids=repr)
@pytest.mark.parametrize(("make", "what"), [
    (lambda bad: fb.RollOff(bad, 10.0), "RollOff level"),
    (lambda bad: fb.RollOff(1.0, corner=bad), "RollOff corner"),
    (lambda bad: fb.Joint(("A-B", bad), to=(1, "B")), "z"),
    (lambda bad: fb.Joint("A", to=(1, ["A-B", bad])), "z"),
    (lambda bad: fb.Multisine([bad], [1.0]), "Multisine amplitude"),
    (lambda bad: fb.Structure.of_modes(bad, np.eye(1), [("A", "x")]), "omega"),
    (lambda bad: fb.response_spectrum([0.0, 1.0], [0.0, 1.0], bad), "omega"),
    (lambda bad: fb.psd(np.sin(np.arange(300.0)), 0.1, overlap=bad), "overlap"),
    (lambda bad: reduction.below(bad), "omega_max"),
    (lambda bad: reduction.carrying(bad, [1.0, 1.0], 2.0), "share"),
    (lambda bad: reduction.carrying(0.5, bad, 2.0), "load"),
    (lambda bad: reduction.moved_mass(np.eye(1), [bad]), "load"),
    (lambda bad: reduction.modal_basis(np.eye(1), [[bad]]), "K"),
    (lambda bad: reduction.Basis([[bad]], [1.0]), "vectors"),
    (lambda bad: reduction.guyan(np.eye(1), np.eye(1), [[bad]]), "directions"),
])  # fmt: skip
def test_what_is_no_number_is_refused_where_it_is_written(make, what, bad):
    if bad is None and what == "omega" and make.__code__.co_names[-1] == "response_spectrum":
        return  # periods stand for it
    with pytest.raises(ValueError, match=f"{what}.* (must|needs)"):
        make(bad)


def test_names_of_digits_are_names():
    assert fb.Scene(BENT, [fb.Clamped("33")]).supports[0].z == "33"
    assert stop(BODY, "35").stops[0].z == "35"
    assert stop(BODY, 33).stops[0].z == 33


@pytest.mark.parametrize(("make", "message"), [
    (lambda: fb.Scene(BENT, [fb.Clamped(33)]),
     "the frame is not straight; there is '33', text in quotes, got 33 in supports[0] (Clamped) of Scene"),
    (lambda: fb.Scene(BENT, [fb.Clamped(35)]), "the frame is not straight; 'N35' is the nearest there is, got 35"),
    (lambda: fb.Scene(STRAIGHT, [fb.Clamped(4)]), "z must lie on the frame, 0 to 2 m, got 4 in supports[0] (Clamped) "
     "of Scene; move it, or write '4', the node"),
    (lambda: fb.Scene(STRAIGHT, [fb.Clamped(1500.0)]),
     "got 1500.0 in supports[0] (Clamped) of Scene; move it, or is it in mm?"),
    (lambda: stop(BENT, ("34-N35", 700)),
     "within 0 to 1.5 m, got 700 in stops[0] (Stop) of Scene; move it, or is it in mm?"),
    (lambda: stop(BODY, "33"), "there is 33, a number without quotes, got '33' in stops[0]"),
    (lambda: stop(BODY, 35), "there is '35', text in quotes, got 35 in stops[0]"),
    (lambda: fb.Member(33, "34", STEEL), "must be names of nodes, got 33 in Member; names are text: write '33'"),
    (lambda: fb.Scene(BEAM, [fb.Clamped("33")]), "z must be a number on a Beam, which has no names, got '33'"),
    (lambda: fb.Scene(BEAM, [fb.Clamped(400.0)]), "move it, or lengthen the beam, or is it in mm?"),
])  # fmt: skip
def test_of_parts(make, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make()


@pytest.mark.parametrize(("ask", "message"), [
    (lambda r: r.displacement("34"), "a direction of x, y, z, rx, ry, rz, got '34' in a place; write ('34', 'x')"),
    (lambda r: r.floor_spectrum(("34-N35", 0.5), periods=[0.1]), "write (('34-N35', 0.5), 'x')"),
    (lambda r: r.displacement("34-N35", "x"), "write ('34-N35', s) for a place s along the member"),
    (lambda r: r.displacement(33, "x"), "there is '33', text in quotes, got 33"),
    (lambda r: r.model.frequency_response([1.0], "34", ("34", "z")), "input must be a place and its direction, or one"),
])  # fmt: skip
def test_of_runs(run, ask, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        ask(run)


def test_a_member_is_no_place_where_parts_have_names_either():
    scene = fb.Scene(BENT, [fb.Clamped("33")], [fb.LumpedMass("34", 1.0, name="valve")])
    with pytest.raises(ValueError, match=re.escape("write ('34-N35', s) for a place s along the member")):
        scene.reduce(1).phi(("34-N35", "x"))
    with pytest.raises(ValueError, match=re.escape("write ('34-N35', s) for a place s along the member")):
        fb.Scene(BENT, scene.supports, scene.masses, stops=[fb.Stop("34-N35", LAW, direction="x")])


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_numbers_of_numpy_are_places_of_frames(kind):
    """They were compared with ("A-B", 0.25) number by number: "truth value of an array"."""
    tube = fb.Frame.straight(1.0, fb.Section.circle(2.1e11, 7850.0, 0.02))
    scene = fb.Scene(tube, [fb.Clamped("A")], stops=[fb.Stop(("A-B", 0.25), LAW, 1e-3, direction="x")],
                     base={"x": fb.Harmonic(1e-3, 90.0)})  # fmt: skip
    run = scene.reduce(modes=2).simulate(0.01, 1e-3)
    for z in (0.25, 0.375):
        np.testing.assert_array_equal(run.displacement(kind(z), "x"), run.displacement(z, "x"))


def test_a_number_of_a_body_within_a_place():
    """`1 is the nearest there is, got (1, 'b')` was said of a node named 1."""
    other = fb.Structure(1e4 * np.eye(2), np.eye(2), labels=[(1, "x"), (2, "x")])
    run = fb.Scene(other, bodies=[fb.Scene(BODY)]).reduce(2).simulate(0.01, 1e-3)
    said = "a place must be on one body, without its number, got (1, 33) in Run; write 33, and body=1"
    with pytest.raises(ValueError, match=re.escape(said)):
        run.displacement((1, 33), "x")
    assert run.displacement(33, "x", body=1).shape == (11,)


@pytest.mark.parametrize("make", [
    lambda: fb.Structure.of_modes([True, 2.0], np.eye(2), [("A", "x"), ("B", "x")]),
    lambda: fb.response_spectrum([0.0, 1.0], [0.0, 1.0], [1.0, True]),
])  # fmt: skip
def test_a_switch_among_numbers_is_none_of_them(make):
    with pytest.raises(ValueError, match=r"must be (real )?numbers, got \[.*True"):
        make()


def test_arrays_without_a_row_are_no_list_and_numbers_no_parameter(straight):
    with pytest.raises(TypeError, match=r"supports\[0\] must be a Clamped or .*, got 'A' in Scene; write Clamped\(…\)"):
        fb.Scene(BEAM, ["A"])
    with pytest.raises(TypeError, match=r"masses\[0\] must be a LumpedMass or .* in Scene; move it to its own list"):
        fb.Scene(BEAM, [fb.Clamped(0.0)], masses=[fb.Clamped(0.0)])
    frame = fb.Frame.straight(1.0, fb.Section.circle(2.0e11, 7800.0, 0.02))
    with pytest.raises(TypeError, match=r"bodies\[0\] must be a Scene, got Frame.* in Scene; write Scene\(…\)"):
        fb.Scene(frame, bodies=[frame])
    with pytest.raises(TypeError, match=r"elements must be a list of Element, got array\(3\) in Scene"):
        fb.Scene(BEAM, elements=np.array(3))
    for bad in (None, 1.0, ["omega"]):
        with pytest.raises(ValueError, match="a parameter must be called by its path, got"):
            straight.branch(bad, (40.0, 60.0))


@pytest.mark.parametrize(("name", "call"), [
    ("absolute", lambda run: run.displacement("N35", "z", absolute="no")),
    ("mean", lambda run: run.force(0, mean="no")),
    ("progress", lambda run: run.model.simulate(0.1, progress="no")),
    ("progress", lambda run: fb.study.vary(run.model.scene, {"stops[0].gap": [0.0]}, "rms", duration=0.1, dt=1e-3,
                                           modes=2, progress="no")),
])  # fmt: skip
def test_text_is_no_switch(run, name, call):
    with pytest.raises(ValueError, match=f"{name} must be True or False, got 'no' in"):
        call(run)
