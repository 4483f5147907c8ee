"""The rig drawn: what artists and labels there are, where, and that no label lies on another; no pixels."""

import json
import re
import tomllib
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from scipy.optimize import minimize

import fembeam as fb
from contacts import Hertz, KelvinVoigt, Polynomial, law, parallel
from fembeam.cli import main
from fembeam.plot.rig import MANY, THICK
from fembeam.plot.rig_labels import extent, rows_of, spread
from fembeam.plot.rig_words import label

EXAMPLE = Path(__file__).parent.parent / "examples" / "beam_stop.toml"
THIN = fb.Section.rectangle(E=2.1e11, rho=7800.0, width=0.02, height=0.002)
HIGH = fb.Section.rectangle(E=2.1e11, rho=7800.0, width=0.02, height=0.004)
LAW, HINGE = Hertz(1e8), KelvinVoigt(400.0, 0.05)


def paper():
    return fb.Scene(fb.Beam(0.2599, THIN), [fb.Clamped(0.0)], [fb.LumpedMass(0.24445, 25.4e-3, inertia=3e-6)],
                    stops=[fb.Stop(0.24445, LAW)], base=fb.Harmonic(1e-3, 195.0))  # fmt: skip


def two_sided():
    stops = [fb.Stop(0.45, LAW, gap=5e-4, name="lower"), fb.Stop(0.45, LAW, gap=1e-3, side="above", name="upper"),
             fb.Stop(0.2, LAW, gap=-1e-4)]  # fmt: skip
    forces = [fb.PointForce(0.3, fb.Harmonic(2.0, 150.0), name="shaker"), fb.PointMoment(0.1, fb.Step(1.0, 0.1))]
    return fb.Scene(fb.Beam(0.5, THIN), [fb.Clamped(0.0)], stops=stops, forces=forces, gravity=9.81)


def bodies():
    under = fb.Scene(fb.Beam(0.4, HIGH), [fb.Clamped(0.0), fb.Pinned(0.4)], [fb.LumpedMass(0.2, 0.5)])
    over = fb.Scene(fb.Beam(0.3, HIGH), [fb.Clamped(0.3)])
    stops = [fb.Stop(0.3, LAW, 1e-3, on=(1, 0.25), name="A"), fb.Stop(0.48, LAW, 5e-4, "above", on=(2, 0.1), name="B")]
    impactors = [
        fb.Impactor(0.4, 0.1, -1.0, LAW, gap=2e-3),
        fb.Impactor(0.2, 0.05, 0.0, LAW, 1e-3, "both", name="ring"),
    ]
    return fb.Scene(fb.Beam(0.5, THIN), [fb.Clamped(0.0)], springs=[fb.Spring(0.4, 1e3)], stops=stops,
                    elements=[fb.Element(0.1, HINGE, to=(1, 0.1), name="link")], bodies=[under, over],
                    impactors=impactors)  # fmt: skip


def many(count=40, named=False):
    gaps = np.linspace(1e-4, 2e-3, count)
    places = np.linspace(0.1, 3.9, count)
    names = [f"baffle {i}" if named else None for i in range(count)]
    stops = [fb.Stop(z, LAW, gap, name=name) for z, gap, name in zip(places, gaps, names, strict=True)]
    return fb.Scene(fb.Beam(4.0, HIGH), [fb.Pinned(0.0), fb.Pinned(4.0)],
                    stops=[*stops, fb.Stop(2.0, LAW, gap=1e-3, side="above", name="guard")])  # fmt: skip


def rotation():
    stops = [fb.Stop(0.0, HINGE, 0.02, "above", of="rotation"), fb.Stop(0.0, HINGE, 0.03, of="rotation", name="hinge")]
    elements = [fb.Element(0.7, HINGE, of="rotation"), fb.Element(0.3, Polynomial([0, 0, 1e9]), to=0.6, name="tie")]
    return fb.Scene(fb.Beam(1.0, THIN), [fb.Pinned(0.0), fb.Guided(1.0)], stops=stops, elements=elements,
                    springs=[fb.Spring(0.3, 0.0, rotational=50.0)],
                    dashpots=[fb.Dashpot(0.85, 0.0, rotational=1.0)])  # fmt: skip


def offset():
    masses = [fb.LumpedMass(0.5, 0.2, 1e-5, 0.05, name="sensor"), fb.LumpedMass(0.3, 0.1),
              fb.LumpedMass(0.25, 0.1, offset=-0.08, name="counterweight")]  # fmt: skip
    return fb.Scene(fb.Beam.of_spans([(0.3, HIGH), (0.2, THIN)]), [fb.Clamped(0.0)], masses,
                    stops=[fb.Stop(0.5, LAW, gap=3e-4)])  # fmt: skip


def springs():
    foot = fb.Harmonic(1e-3, 20.0)
    return fb.Scene(fb.Beam(2.0, fb.Taper(HIGH, THIN), foundation=1e3, axial_force=-5.0),
                    springs=[fb.Spring(z, 1e4, foot=foot if z == 1.0 else None) for z in (0.0, 0.5, 1.0, 1.5, 2.0)],
                    dashpots=[fb.Dashpot(0.5, 3.0), fb.Dashpot(1.0, 3.0)], stops=[fb.Stop(1.0, LAW, gap=1e-3)],
                    elements=[fb.Element(1.0, Polynomial([0, 0, 1e9]))])  # fmt: skip


def free():
    return fb.Scene(fb.Beam(0.8, THIN))


def drawn_at_random(seed):
    """Any parts anywhere, many of them at one place, names short and long."""
    rng = np.random.default_rng(seed)
    names = iter(f"{'part ' * rng.integers(0, 4)}{i}" if rng.random() < 0.5 else None for i in range(1000))
    z = lambda: float(rng.choice([0.0, 0.31, 0.32, 0.5, 1.0, rng.random()]))  # noqa: E731
    stops = [fb.Stop(float(rng.random()), LAW, float(rng.uniform(-1e-3, 1e-2)), str(rng.choice(["above", "below"])),
                     name=next(names)) for _ in range(rng.integers(0, 8))]  # fmt: skip
    return fb.Scene(
        fb.Beam(1.0, THIN), stops=stops,
        masses=[fb.LumpedMass(z(), 1.0, offset=float(rng.choice([0.0, 0.1])), name=next(names)) for _ in range(3)],
        springs=[fb.Spring(z(), 1e3, name=next(names)) for _ in range(rng.integers(0, 5))],
        dashpots=[fb.Dashpot(z(), 1.0, name=next(names)) for _ in range(rng.integers(0, 3))],
        elements=[fb.Element(z(), HINGE, to=None, name=next(names)) for _ in range(rng.integers(0, 3))],
        forces=[fb.PointForce(z(), np.cos, name=next(names)) for _ in range(rng.integers(0, 4))],
    )  # fmt: skip


SCENES = [paper, two_sided, bodies, many, rotation, offset, springs, free]


def texts_of(figure):
    """Texts that are shown, of the one axes."""
    return [text for text in figure.axes[0].texts if text.get_text()]


def boxes(figure):
    """Extents of all texts in inches."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    return [one.get_window_extent(renderer).transformed(figure.dpi_scale_trans.inverted()) for one in texts_of(figure)]


def patches(figure, name, kind=None):
    return [one for one in figure.axes[0].patches if one.get_gid() == name and isinstance(one, kind or object)]


def per_inch(figure):
    """z per inch of the page, in the unit of the axis."""
    axis = figure.axes[0]
    return np.diff(axis.get_xlim())[0] / (figure.get_size_inches()[0] * axis.get_position().width)


@pytest.mark.parametrize("scene", SCENES, ids=lambda make: make.__name__)
def test_labels_do_not_overlap_and_stay_in_the_figure(scene):
    check_labels(scene().figure())


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_labels_of_any_scene_do_not_overlap(seed):
    check_labels(drawn_at_random(seed).figure())


def check_labels(figure):
    figure.set_dpi(200)
    found = list(zip(boxes(figure), texts_of(figure), strict=True))
    for (one, a), (two, b) in combinations(found, 2):
        assert not one.padded(-0.01).overlaps(two.padded(-0.01)), (a.get_text(), b.get_text())
    for box, text in found:
        assert box.x0 >= -0.01, text.get_text()
        assert box.x1 <= figure.get_size_inches()[0] + 0.01, text.get_text()
        assert box.y0 >= 0.3, text.get_text()
        assert box.y1 <= figure.get_size_inches()[1], text.get_text()


@pytest.mark.parametrize("scene", [paper, two_sided, bodies, rotation, offset, springs], ids=lambda make: make.__name__)
def test_every_part_is_drawn_and_labelled(scene):
    scene = scene()
    figure = scene.figure()
    shown = sorted(text.get_text() for text in texts_of(figure) if text.get_text().split("\n")[0] != text.get_gid())
    wanted = []
    for body, part in enumerate((scene, *scene.bodies)):
        for name in ("supports", "masses", "springs", "dashpots", "stops", "elements", "forces", "impactors"):
            wanted += [(one.label_on(body), label(one)) for one in getattr(part, name)]
    labels = [(text.get_gid(), text.get_text()) for text in texts_of(figure)]
    for one in wanted:
        assert labels.count(one) == 1, one
    others = {text for _, text in labels} - {text for _, text in wanted}
    assert all(re.match(r"beam \d$|base motion|gravity|axial|elastic", text) for text in others), shown
    gids = {one.get_gid() for one in [*figure.axes[0].patches, *figure.axes[0].lines]}
    assert {name for name, _ in wanted} <= gids


def test_what_labels_say():
    assert label(fb.LumpedMass(0.5, 0.2, 1e-5, -0.05, name="sensor")) == "sensor\n0.2 kg\nJ = 1e-05 kg m²\n50 mm behind"
    assert label(fb.Spring(1.0, 2e4, foot=fb.Harmonic(1e-3, 20.0))) == (
        "spring at 1 m\n20000 N/m\nfoot: Harmonic, 1 mm,\n20 rad/s"
    )
    assert label(fb.Stop(0.24445, parallel([LAW, HINGE]), gap=-2e-5)) == (
        "stop at 0.24445 m,\nbelow\npressed on by 0.02 mm\nHertz + KelvinVoigt"
    )
    assert label(fb.Stop(0.0, HINGE, 0.02, of="rotation", name="hinge")) == "hinge\ngap 0.02 rad\nKelvinVoigt"
    assert label(fb.Impactor(0.4, 0.1, -1.0, LAW, gap=2.5)).split("\n")[2:] == ["0.1 kg, -1 m/s", "gap 2.5 m", "Hertz"]
    assert label(fb.Element(0.3, HINGE, to=(1, 0.2), name="tie")) == "tie\nKelvinVoigt\nto 0.2 m of beam 1"
    assert label(fb.PointForce(0.3, lambda t: t)) == "force at 0.3 m\nfunction of t"

    @law
    def rubber(delta, delta_dot, entry_rate, k):
        return k * delta

    assert label(fb.Stop(0.3, rubber(k=3.0))).endswith("no gap\nrubber")


@pytest.mark.parametrize("scene", [two_sided, many, offset], ids=lambda make: make.__name__)
def test_gaps_are_enlarged_as_the_title_says(scene):
    """Distance of a stop's tip from the beam, measured in the figure by the scale along z, over the gap."""
    scene = scene()
    figure = scene.figure()
    factor = float(re.search(r"gaps × ([\d.]+) across", figure.get_suptitle())[1])
    unit, scale = (1e3, per_inch(figure)) if scene.beam.length <= 1.0 else (1.0, per_inch(figure))
    (beam,) = patches(figure, "beam 0")
    outline = beam.get_xy()
    for stop in scene.stops:
        (tip,) = patches(figure, stop.label)
        y = tip.get_xy()[:, 1]
        half = len(outline) // 2  # the upper side from left to right, the lower one back
        upper = np.interp(unit * stop.z, *outline[:half].T)
        lower = np.interp(unit * stop.z, *outline[half : 2 * half][::-1].T)
        apart = min(y) - upper if stop.side == "above" else lower - max(y)
        assert apart * scale / unit == pytest.approx(max(stop.gap, 0.0) * factor, abs=1e-3 * scale / unit)


def test_the_factor_is_round_and_uses_the_room():
    for gap in (1e-7, 3e-5, 1e-2):
        figure = fb.Scene(fb.Beam(0.5, THIN), [fb.Clamped(0.0)], stops=[fb.Stop(0.5, LAW, gap=gap)]).figure()
        factor = float(re.search(r"gaps × ([\d.e+]+) across", figure.get_suptitle())[1])
        assert float(f"{factor:e}"[0]) in (1.0, 2.0, 5.0)
        assert 0.07 < 1e3 * gap * factor / per_inch(figure) <= 0.2
    assert paper().figure().get_suptitle() == "Rig, to scale along z"  # no gap at all
    closed = fb.Scene(fb.Beam(0.5, THIN), [fb.Clamped(0.0)], stops=[fb.Stop(0.5, LAW, gap=1e-320)])
    assert closed.figure().get_suptitle() == "Rig, to scale along z"


def test_beams_are_to_scale_along_z_and_heights_to_each_other():
    """√(I/A) is h/√12 of a rectangle: one of half the height is drawn at a quarter plus three eighths."""
    (outline,) = patches(offset().figure(), "beam 0")
    x, y = outline.get_xy().T
    assert x.min() == pytest.approx(0.0, abs=1e-6)
    assert x.max() == pytest.approx(500.0)
    assert np.ptp(y[x < 299.9]) == pytest.approx(THICK)
    assert np.ptp(y[x > 300.1]) == pytest.approx(THICK * (0.25 + 0.75 * 0.5))
    assert fb.Scene(fb.Beam(1.5, THIN)).figure().axes[0].get_xlabel() == "z / m"
    assert free().figure().axes[0].get_xlabel() == "z / mm"


def test_an_arm_is_to_scale():
    figure = offset().figure()
    for name, centre in (("sensor", 550.0), ("counterweight", 170.0)):
        (box,) = patches(figure, name)
        assert box.get_xy()[:4, 0].mean() == pytest.approx(centre)
    assert figure.axes[0].get_xlim()[1] > 550.0


def test_many_stops_share_a_label_and_stand_at_their_places():
    scene = many()
    figure = scene.figure()
    said = [text.get_text() for text in texts_of(figure)]
    assert "40 stops at 0.1 to 3.9 m, below\ngaps 0.1 mm to 2 mm\nHertz" in said
    assert len(said) == 4  # two pins and the guard
    for stop in scene.stops:
        (tip,) = patches(figure, stop.label)
        assert np.mean(tip.get_xy()[[40, 41], 0]) == pytest.approx(stop.z, abs=1e-6)


def test_many_names_are_turned():
    figure = many(named=True).figure()
    turned = [text.get_text() for text in texts_of(figure) if text.get_rotation() == 90]
    assert {f"baffle {i}" for i in range(40)} < set(turned)
    check_labels(figure)


def test_names_without_a_place_are_left_out():
    crowd = fb.Scene(fb.Beam(4.0, HIGH), stops=[fb.Stop(z, LAW, name=f"{1e3 * z:.0f}") for z in np.linspace(0, 4, 80)])
    figure = crowd.figure()
    check_labels(figure)
    assert 50 < len({stop.name for stop in crowd.stops} & {text.get_text() for text in texts_of(figure)}) < 80


def test_symbols_at_one_place_stand_side_by_side():
    """Spring, dashpot, stop and element at z = 1 m: no symbol reaches into another, feet end at the place."""
    figure = springs().figure()
    names = ["spring at 1 m", "dashpot at 1 m", "stop at 1 m, below", "element at 1 m"]
    spans = []
    for name in names:
        lines = [line for line in figure.axes[0].lines if line.get_gid() == name]
        assert any(abs(np.mean(line.get_xdata()[:39]) - 1.0) < 1e-6 for line in lines if len(line.get_xdata()) == 40)
        symbol = [line.get_xdata() for line in lines if len(line.get_xdata()) == 2 and np.ptp(line.get_ydata()) < 1e-9]
        spans.append(sorted(np.concatenate(symbol))[:: 2 * len(symbol) - 1])
    for one, two in pairwise(sorted(spans)):
        assert one[1] <= two[0] + 0.02
    assert MANY > 4


def test_loads_are_arrows():
    figure = two_sided().figure()
    assert len(patches(figure, "shaker", FancyArrowPatch)) == 1
    assert len(patches(figure, "moment at 0.1 m", FancyArrowPatch)) == 1
    assert len(patches(figure, "gravity 9.81 m/s²", FancyArrowPatch)) == 1
    (arrow,) = patches(paper().figure(), "base motion", FancyArrowPatch)
    (x0, y0), (x1, y1) = arrow._posA_posB
    assert x0 == x1
    assert y0 > y1
    assert "base motion: Harmonic, 1 mm, 195 rad/s" in [text.get_text() for text in texts_of(paper().figure())]


def test_lines_lead_to_the_bodies():
    """From the stop's place on the beam to its place on the body: the one over it above, the others below."""
    figure = bodies().figure()
    middle = {i: np.mean(patches(figure, f"beam {i}")[0].get_xy()[:, 1]) for i in range(3)}
    assert middle[2] > middle[0] > middle[1]
    for name, body, z in (("A", 1, 250.0), ("B", 2, 100.0), ("link", 1, 100.0)):
        ends = [(line.get_xdata()[-1], line.get_ydata()[-1]) for line in figure.axes[0].lines if line.get_gid() == name]
        assert any(abs(x - z) < 1e-6 and abs(y - middle[body]) < THICK for x, y in ends), name


def test_axes_of_ones_own():
    figure = Figure(figsize=(8.0, 4.0))
    axis = figure.subplots()
    assert fb.plot.rig(paper(), axis) is figure
    assert axis.get_title(loc="left") == "Rig, to scale along z"
    assert paper().figure(axis) is figure
    with pytest.raises(TypeError, match=r"fembeam.plot.rig draws one Scene, got Beam"):
        fb.plot.rig(fb.Beam(1.0, THIN))


def test_odd_names_are_drawn_as_they_are():
    odd = ["$x$ {", "a_b^c", "\\frac", "x" * 60]
    stops = [fb.Stop(0.1 + 0.1 * i, LAW, name=name) for i, name in enumerate(odd)]
    figure = fb.Scene(fb.Beam(0.5, THIN), [fb.Clamped(0.0)], stops=stops).figure()
    said = "\n".join(text.get_text() for text in texts_of(figure))
    assert all(name[:20] in said for name in odd)
    check_labels(figure)


# --- placing of labels ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_spread_is_the_nearest_arrangement(seed):
    """Against a general optimiser."""
    rng = np.random.default_rng(seed)
    x, widths, weights = np.sort(10 * rng.random(6)), rng.uniform(0.5, 1.8, 6), rng.uniform(0.5, 3.0, 6)
    found = spread(x, widths, 0.0, 12.0, weights)
    apart = (widths[1:] + widths[:-1]) / 2
    rules = [{"type": "ineq", "fun": lambda y: np.diff(y) - apart},
             {"type": "ineq", "fun": lambda y: [y[0] - widths[0] / 2, 12.0 - widths[-1] / 2 - y[-1]]}]  # fmt: skip
    best = minimize(lambda y: weights @ (y - x) ** 2, np.linspace(1.0, 11.0, 6), constraints=rules, tol=1e-12)
    assert np.all(np.diff(found) >= apart - 1e-9)
    assert weights @ (found - x) ** 2 == pytest.approx(best.fun, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_lines_of_labels_cross_neither_each_other_nor_texts(seed):
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(0.3, 7.7, rng.integers(2, 18)))
    texts = ["" if rng.random() < 0.2 else "\n".join(["label " * rng.integers(1, 4)] * rng.integers(1, 4)) for _ in x]
    placed, depth = rows_of(x, texts, 0.0, 8.0)
    if any(one.upright for one in placed):
        return
    rows = [[(one.path[i], one.path[i + 1]) for i in range(len(one.path) - 1)] for one in placed]
    for one, two in combinations(rows, 2):
        assert not any(crosses(*a, *b) for a in one for b in two)
    for one, way in zip(placed, rows, strict=True):
        if not one.text:
            continue
        (width, height), (centre, low) = extent(one.text), one.path[-1]
        assert low + height <= depth + 1e-9
        corners = [(centre - width / 2, low + 0.01), (centre + width / 2, low + height - 0.01)]
        for other in (other for other in rows if other is not way):
            for a, b in other:
                assert not crosses(*corners, a, b), one.text


def crosses(a, b, c, d):
    """Whether two segments cross properly."""
    side = lambda p, q, r: np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))  # noqa: E731
    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


# --- command line and pages -------------------------------------------------------------------------------------------


def test_the_command_draws(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["draw", str(EXAMPLE), "--set", "stops[0].name=valve"]) == 0
    assert (tmp_path / "beam_stop.png").read_bytes().startswith(b"\x89PNG")
    for suffix, begins in ((".svg", b"<?xml"), (".pdf", b"%PDF")):
        assert main(["draw", str(EXAMPLE), "--out", str(tmp_path / f"rig{suffix}")]) == 0
        assert (tmp_path / f"rig{suffix}").read_bytes().startswith(begins)
    assert "wrote" in capsys.readouterr().err
    assert main(["draw", str(EXAMPLE), "--out", "rig.docx"]) == 2
    assert "a figure must end in .png, .svg or .pdf, got 'rig.docx'" in capsys.readouterr().err
    assert not (tmp_path / "rig.docx").exists()


def test_the_page_shows_the_rig_first(tmp_path):
    quick = ["simulate.duration=0.2", "simulate.discard=0.0", "reduce.modes=1"]
    options = [word for one in quick for word in ("--set", one)]
    assert main(["run", str(EXAMPLE), "--out", str(tmp_path), "--quiet", *options]) == 0
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", page)
    assert captions[0] == "Rig"
    assert (tmp_path / "rig.png").exists()
    assert json.loads((tmp_path / "summary.json").read_text())["contacts"][0]["name"] == "stop at 0.24445 m, below"
    assert tomllib.loads(EXAMPLE.read_text())["stops"]
