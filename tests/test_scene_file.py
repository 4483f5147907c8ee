"""Scene files: what they make, and what they say when they are wrong."""

import math
from pathlib import Path

import pytest
from problems import paper_scene
from refusals import refused_files

import fembeam as fb
import solvers
from contacts import (
    PUBLISHED,
    BoucWen,
    Coulomb,
    ElastoPlastic,
    Hertz,
    Hysteretic,
    Iwan,
    Jenkins,
    KelvinVoigt,
    PiecewiseLinear,
    Tabulated,
    Viscoelastic,
    WaltonBraun,
)
from fembeam import scene_file
from fembeam.scene_file import SceneFileError
from fembeam.scene_file.keys import fits, parameters, required
from fembeam.scene_file.kinds import LAWS

EXAMPLE = (Path(__file__).parent.parent / "examples" / "beam_stop.toml").read_text(encoding="utf-8")
SIMPLE = """
[beam]
length = 1.0
section = { E = 2.1e11, rho = 7800, A = 1e-4, I = 1e-9 }
[[supports]]
kind = "clamped"
z = 0
"""


def test_the_example_is_the_papers_scene(file_of):
    file = file_of(EXAMPLE)
    assert repr(file.scene) == repr(paper_scene(fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1)))
    assert file.reduce == {"modes": 2}
    assert file.studies["simulate"].solver is None


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ('kind = "hertz", stiffness = 1e9', Hertz(1e9)),
        ('kind = "hysteretic", stiffness = 1e9, damping_factor = 0.5', Hysteretic(1e9, 0.5)),
        ('kind = "achieving", stiffness = 1e9, restitution = 0.5, clamp = true',
         Hysteretic.achieving(1e9, 0.5, clamp=True)),
        ('kind = "kelvin_voigt", stiffness = 1e6, damping = 10', KelvinVoigt(1e6, 10.0)),
        ('kind = "piecewise_linear", slopes = [1e4, 1e6], knots = [1e-3]', PiecewiseLinear([1e4, 1e6], (1e-3,))),
        ('kind = "piecewise_linear", slopes = [1e4, 1e6], knots = [1e-3], damping = [0, 5]',
         PiecewiseLinear([1e4, 1e6], (1e-3,), [0, 5])),
        ('kind = "anagnostopoulos", stiffness = 1e6, restitution = 0.5, mass = 2, clamp = true',
         KelvinVoigt.anagnostopoulos(1e6, 0.5, 2.0, clamp=True)),
        ('kind = "viscoelastic", stiffness = 1e6, damping = 10, approach_only = true',
         Viscoelastic(1e6, 10.0, approach_only=True)),
        ('kind = "tsuji", stiffness = 1e6, restitution = 0.5, mass = 2, exponent = 2',
         Viscoelastic.tsuji(1e6, 0.5, 2.0, exponent=2.0)),
        ('kind = "jankowski", stiffness = 1e6, restitution = 0.5, mass = 2', Viscoelastic.jankowski(1e6, 0.5, 2.0)),
        ('kind = "tabulated", indentation = [1e-3, 2e-3], measured = [5, 20]', Tabulated([1e-3, 2e-3], [5.0, 20.0])),
        ('kind = "tabulated_file", path = "curve.csv"', Tabulated([1e-3, 2e-3], [5.0, 20.0])),
        ('kind = "parallel", laws = [{ kind = "hertz", stiffness = 1e9 }, { kind = "hertz", stiffness = 1 }]',
         Hertz(1e9) + Hertz(1.0)),
        *((f'kind = "{name}", stiffness = 1e9, restitution = 0.5', getattr(Hysteretic, name)(1e9, 0.5))
          for name in PUBLISHED),
    ],
)  # fmt: skip
def test_laws(tmp_path, file_of, text, law):
    (tmp_path / "curve.csv").write_text("delta,force\n1e-3,5\n2e-3,20\n")
    file = file_of(SIMPLE + f'[[stops]]\nz = 0.5\ngap = 1e-3\nside = "above"\nlaw = {{ {text} }}')
    assert file.scene.stops == (fb.Stop(0.5, law=law, gap=1e-3, side="above"),)


@pytest.mark.parametrize(
    ("kind", "keys", "law"),
    [
        ("jenkins", {"stiffness": 20000, "limit": 10}, Jenkins(2e4, 10.0)),
        ("coulomb", {"limit": 10, "stiffness": 2e4, "static_limit": 12}, Coulomb(10.0, 2e4, 12.0)),
        ("elasto_plastic", {"stiffness": 2e4, "yield_force": 10}, ElastoPlastic(2e4, 10.0)),
        ("iwan", {"stiffness": [2e4, 1e4], "limits": [10, math.inf]}, Iwan([2e4, 1e4], [10.0, math.inf])),
        ("iwan_uniform", {"stiffness": 2e4, "limit": 10, "parts": 5}, Iwan.uniform(2e4, 10.0, 5)),
        ("iwan_backbone", {"delta": [1e-3, 2e-3], "force": [10, 12]}, Iwan.from_backbone([1e-3, 2e-3], [10.0, 12.0])),
        ("bouc_wen", {"stiffness": 1e4, "alpha": 0.1, "A": 1, "beta": 500, "gamma": 200, "n": 2},
         BoucWen(1e4, 0.1, 1.0, 500.0, 200.0, 2)),
        ("walton_braun", {"loading": 1e5, "unloading": 4e5, "set": "forgotten"}, WaltonBraun(1e5, 4e5, "forgotten")),
    ],
)  # fmt: skip
def test_laws_with_memory(kind, keys, law):
    expected = parameters(LAWS[kind])
    assert all(fits(value, expected[key].annotation) for key, value in keys.items())
    assert set(required(expected)) <= set(keys)
    assert LAWS[kind](**keys) == law


def test_everything_that_hangs_on_a_beam(file_of):
    scene = file_of("""
[beam]
spans = [
  { length = 0.5, section = { shape = "rectangle", E = 2e11, rho = 7800, width = 0.02, height = 0.01 } },
  { length = 0.3, section = { shape = "tube", E = 2e11, rho = 7800, outer = 0.02, inner = 0.01 } },
]
[[supports]]
kind = "pinned"
z = 0
[[supports]]
kind = "guided"
z = 0.8
[[springs]]
z = 0.4
stiffness = 100
[[dashpots]]
z = 0.4
damping = 2
[[forces]]
z = 0.4
signal = { kind = "multisine", amplitude = [1, 2], omega = [10, 20] }
[damping]
alpha = 1
beta = 1e-5
[reduce]
modes = [0, 2]
""").scene  # fmt: skip
    assert scene.beam.borders == (0.0, 0.5, 0.8)
    assert scene.supports == (fb.Pinned(0), fb.Guided(0.8))
    assert scene.springs == (fb.Spring(0.4, 100.0),)
    assert scene.dashpots == (fb.Dashpot(0.4, 2.0),)
    assert scene.damping == fb.Rayleigh(1.0, 1e-5)
    assert float(scene.forces[0].signal(0.0)) == 3.0


def test_impactors_tapers_foundations_and_once_only_signals(file_of):
    scene = file_of("""
gravity = 9.81
[beam]
length = 0.5
foundation = 100
axial_force = 20.0
[beam.section]
shape = "taper"
start = { shape = "circle", E = 2e11, rho = 7800, diameter = 0.02 }
end = { shape = "circle", E = 2e11, rho = 7800, diameter = 0.01 }
[[supports]]
kind = "clamped"
z = 0
[[springs]]
z = 0.5
stiffness = 100
foot = { kind = "step", size = 1e-3, rise = 0.1 }
[[forces]]
z = 0.5
signal = { kind = "pulse", peak = 10, length = 0.01 }
[[forces]]
kind = "point_moment"
z = 0.5
signal = { kind = "harmonic", amplitude = 1, omega = 0 }
[[impactors]]
z = 0.4
mass = 0.1
velocity = -1.0
law = { kind = "hertz", stiffness = 1e9 }
gap = 1e-3
side = "above"
""").scene  # fmt: skip
    thick, thin = (fb.Section.circle(2e11, 7800, d) for d in (0.02, 0.01))
    assert scene == fb.Scene(
        fb.Beam(0.5, fb.Taper(thick, thin), foundation=100, axial_force=20.0),
        [fb.Clamped(0.0)],
        springs=[fb.Spring(0.5, 100, foot=fb.Step(1e-3, 0.1))],
        forces=[fb.PointForce(0.5, fb.Pulse(10, 0.01)), fb.PointMoment(0.5, fb.Harmonic(1, 0))],
        impactors=[fb.Impactor(0.4, 0.1, -1.0, Hertz(1e9), 1e-3, "above")],
        gravity=9.81,
    )


@pytest.mark.filterwarnings("ignore:.*rigid-body:UserWarning")
def test_a_mesh_is_found_beside_the_scene(tmp_path, file_of):
    section = fb.Section.circle(2e11, 7800.0, 0.01)
    fb.Beam.of_spans([(0.2, section), (0.3, section)]).to_mesh(tmp_path / "rig.msh")
    shape = '{ shape = "circle", E = 2e11, rho = 7800, diameter = 0.01 }'
    table = f'[beam]\nmesh = "rig.msh"\n[beam.sections]\nspan_1 = {shape}\n'
    assert file_of(table + f"span_2 = {shape}\n").scene.beam.borders == (0.0, 0.2, 0.5)
    with pytest.raises(SceneFileError, match=r"\[beam\]: every element must have one section"):
        file_of(table)
    with pytest.raises(SceneFileError, match=r"\[beam\]: .*none.msh: this mesh does not exist"):
        file_of(table.replace("rig.msh", "none.msh"))
    with pytest.raises(SceneFileError, match="a mesh needs its path and a table sections"):
        file_of('[beam]\nmesh = "rig.msh"')
    with pytest.raises(SceneFileError, match=r"unknown key 'lenght'"):
        file_of('[beam]\nmesh = "rig.msh"\nlenght = 1')


def test_a_record_is_found_beside_the_scene(tmp_path, file_of):
    rows = [f"{0.01 * i},{i % 5}" for i in range(100)]
    (tmp_path / "motion.csv").write_text("\n".join(["t,a", *rows]))
    text = '[base]\nkind = "record"\npath = "motion.csv"\nquantity = "acceleration"\nscale = 1e-3'
    base = file_of(SIMPLE + text).scene.base
    assert isinstance(base, fb.Record)
    assert base.quantity == "acceleration"
    assert base.y.max() == pytest.approx(4e-3)


def test_solvers_by_name(file_of):
    simulate = "[simulate]\nduration = 1\ndt = 1e-3\nsolver = "
    dopri = file_of(SIMPLE + simulate + '{ kind = "dormand_prince", rtol = 1e-6 }')
    assert dopri.studies["simulate"].solver == solvers.DormandPrince(rtol=1e-6)
    heun = file_of(SIMPLE + simulate + '{ kind = "henon_rk2", dt_flight = 1e-5, dt_contact = 1e-6 }')
    assert heun.studies["simulate"].solver == solvers.HenonRK2(1e-5, 1e-6)


test_mistakes_are_named = refused_files(
    EXAMPLE,
    ("mass = 25.4e-3", "mas = 1", r"\[\[masses\]\] number 1: unknown key 'mas'; did you mean 'mass'\?"),
    ("mass = 25.4e-3", "", r"\[\[masses\]\] number 1: the key 'mass' is missing"),
    ("mass = 25.4e-3", 'mass = "25"', r"\[\[masses\]\] number 1: mass must be a number, got '25'"),
    ("mass = 25.4e-3", "mass = true", r"mass must be a number, got true"),
    ("inertia = 3.0e-6", "inertia = [0.1, 0.2]", r"list of 3 numbers or a list of lists of numbers"),
    ("mass = 25.4e-3", "mass = nan", r"\[\[masses\]\] number 1: mass must be finite"),
    ("stiffness =", "stifness =", r"\[\[stops\]\] number 1 law: unknown key 'stifness'; did you mean 'stiffness'"),
    ('"lankarani_nikravesh"', '"hysteretc"', r"law: kind must be one of .*did you mean 'hysteretic'"),
    ('"lankarani_nikravesh"', '["hertz"]', r"law: kind must be one of"),
    ('kind = "clamped"', "", r"\[\[supports\]\] number 1: kind must be one of clamped, pinned, guided; it is missing"),
    ("[damping]", "[dampning]", r"unknown table 'dampning'; did you mean 'damping'"),
    ("[[stops]]", "[stops]", r"write \[\[stops\]\]"),
    ("[base]", "[[base]]", r"write \[base\], once"),
    ("zeta = ", "alpha = 1\nzeta = ", r"\[damping\]: give either zeta, or alpha and beta"),
    ("E = 1.9e11", "E = -1.9e11", r"\[beam\] section: E must be finite and positive"),
    ("[0.0, 1226.6]", "[1226.6, 0.0]", r"\[base\]: BandNoise band must run from lo to hi"),
    ("[0.0, 1226.6]", "[1226.6]", r"\[base\]: band must be a list of 2 numbers"),
    ("modes = 2", "modes = true", r"\[reduce\]: .* a whole number or a list of whole numbers or 'all', got true"),
    ("modes = 2", "mode = 2", r"\[reduce\]: unknown key 'mode'; did you mean 'modes'"),
    ("modes = 2", "modes = 2\ngravity = 9.81", r"unknown key 'gravity'; gravity stands above all tables \(valid"),
    ("[damping]", "[damping]\nmodes = 2", r"unknown key 'modes'; modes of a run stand in \[reduce\] \(valid"),
    ("[beam]", 'gravity = "9.81"\n[beam]', r"toml:\d+: the file: gravity must be a number, or three, got '9.81'"),
    ("modes = 2", "modes = -1", r"\[reduce\]: modes must be a count above 0 or a list"),
    ("[base]", "[base.y]", r"\[base.y\]: the base of a beam moves along y alone: write \[base\] with kind = "),
    ("seed = 1", "frequency_hz = 9", r"unknown key 'frequency_hz'; frequencies are in rad/s, 2π times hertz: band"),
    ("modes = 2", "modes = 'most'", r"\[reduce\]: modes must be"),
    ("modes = 2", "modes = 2\nelements = 0", r"\[reduce\]: elements must be a whole number above 0"),
    ("modes = 2", "omega_max = -1.0", r"\[reduce\]: omega_max must be positive"),
    ("modes = 2", "mass_share = 1.5", r"\[reduce\]: mass_share must lie in"),
    ("dt = 1e-3", "dt = 0", r"\[simulate\]: dt must be finite and positive"),
    ("discard = 5", "discard = 700", r"\[simulate\]: discard must be below the duration of 600 s"),
    ("discard = 5", 'solver = { kind = "henon" }', r"\[simulate\] solver: kind must be one of .*henon_rk2"),
    ("duration = 600", "duration = 600 s", r"not valid TOML: .*line \d+"),
    ("z = 0.24445", "z = 0.3", r"z must lie on the beam.*LumpedMass"),
    ("length = 0.2599", "length = 1" + 400 * "0", r"length must be a number"),
    ("E = 1.9e11", "E = 1e300", r"\[beam\] section: E must be finite and positive and at most 1e\+50 in size"),
    ("E = 1.9e11", "E = 1e-300", r"\[beam\] section: E must be at least 1e-50, got 1e-300"),
    ("zeta = [0.02", "zeta = [1e300", r"zeta\[0\] must be finite and not negative and at most 1e\+50 in size"),
    ("[beam]", "[beam]\nspans = 3\n#", r"spans must be a list|unknown key"),
    error=SceneFileError,
)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("mass = 25.4e-3", "mas = 25.4e-3", "mas ="),
        ("mass = 25.4e-3", "mass = 'a'", "mass ="),
        ("stiffness = 2.1e8", "stiffness = -1", "law ="),
        ("modes = 2", "mode = 2", "mode ="),
        ("duration = 600", "duration = -1", "duration ="),
        ("[damping]", "[dampning]", "[dampning]"),
        ("z = 0.24445\nmass", "z = 0.3\nmass", "z = 0.3"),
        ("modes = 2", "modes = 2 2", "modes ="),
    ],
)
def test_mistakes_are_found_by_their_line(file_of, old, new, line):
    text = EXAMPLE.replace(old, new, 1)
    number = next(i for i, found in enumerate(text.splitlines(), start=1) if found.startswith(line))
    with pytest.raises(SceneFileError, match=rf"scene\.toml:{number}: "):
        file_of(text)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("simulate", "write table.key=value"),
        ("=3", "write table.key=value"),
        ("stops[1].gap=0", r"stops has 1 item, "),
        ("gravity.x.y=0", r"unknown|gravity"),
        ("beam.length.x=0", r"beam.length is no table"),
        ("simulate.durtion=1", "did you mean 'duration'"),
        ("simulate.dt=[", "dt must be a number"),
        ("simulate.dt=1e-3\nduration=2", "dt must be a number"),
    ],
)
def test_bad_overrides(file_of, override, message):
    with pytest.raises(SceneFileError, match=message):
        file_of(EXAMPLE, override)


def test_overrides(file_of):
    overrides = ["stops[0].law.stiffness=1e9", "stops.0.side = above", "reduce.modes=[0, 2]", "gravity=9.81"]
    file = file_of(EXAMPLE, *overrides)
    assert file.scene.stops[0] == fb.Stop(0.24445, Hysteretic.lankarani_nikravesh(1e9, 0.5), side="above")
    assert file.reduce == {"modes": [0, 2]}
    assert file.scene.gravity == 9.81


def test_the_mark_some_editors_begin_a_file_with_is_passed_over(tmp_path, file_of):
    plain = file_of(SIMPLE)
    (tmp_path / "marked.toml").write_bytes(SIMPLE.encode("utf-8-sig"))
    marked = scene_file.read(tmp_path / "marked.toml")
    assert marked.scene == plain.scene
    assert marked.source.text == plain.source.text
    for encoding in ("utf-16", "utf-16-le"):  # with a mark and without
        (tmp_path / "wide.toml").write_bytes(SIMPLE.encode(encoding))
        with pytest.raises(SceneFileError, match=r"not a text file in UTF-8 \(zero bytes, as in UTF-16\); save it as"):
            scene_file.read(tmp_path / "wide.toml")


def test_files_that_are_none(tmp_path, file_of):
    with pytest.raises(SceneFileError, match="cannot be read"):
        scene_file.read(tmp_path / "nothing.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneFileError, match="UTF-8"):
        scene_file.read(tmp_path / "binary.toml")
    with pytest.raises(SceneFileError, match=r"needs a table \[beam\]"):
        file_of("")
    with pytest.raises(SceneFileError, match=r"nothing\.csv"):
        file_of(SIMPLE + '[base]\nkind = "record"\npath = "nothing.csv"\nquantity = "displacement"')
    missing = r"the key 'quantity' is missing \('displacement' or 'acceleration' or 'force'\); it needs path, quantity"
    with pytest.raises(SceneFileError, match=missing):
        file_of(SIMPLE + '[base]\nkind = "record"\npath = "nothing.csv"')


DRIVEN = (
    SIMPLE
    + """
[base]
kind = "harmonic"
amplitude = 1e-3
omega = 30.0
[[stops]]
z = 1.0
gap = 1e-3
law = { kind = "hertz", stiffness = 1e7 }
"""
)


GAPS = "parameters = { 'stops[0].gap' = [1e-3, 2e-3] }\nquantity = 'rms'\nduration = 1\n"
MINIMISE, ENSEMBLE = f"[minimise]\n{GAPS}dt = 1e-3\n", "[ensemble]\nrealisations = 4\nduration = 9.0\ndt = 1e-3\n"
BASINS = "[basins]\nx_span = [0.0, 1.0]\ny_span = [0.0, 1.0]\n"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[branch]\nspan = [20.0, 40.0]\nat = 50.0", "at must lie in the span of 20 to 40, got 50.0"),
        ("[branch]\nspan = [-inf, 40.0]", "span must be two values, ascending"),
        ("[orbit]\nperiod = 1001", "period must be 1 to 1000, got 1001"),
        ("[branch]\nspan = [20.0, 40.0]\nstep = nan", r"step must lie in \(0, 1\], got nan"),
        ("[branch]\nspan = [20.0, 40.0]\nparameter = 'x'", "no such parameter"),
        ("[basins]\nx_span = [1.0, 0.0]\ny_span = [0.0, 1.0]", r"x_span must be two finite values, ascending"),
        (f"{BASINS}points = 1", "points must be one or two whole numbers"),
        (f"{BASINS}threads = 0", "threads must be above 0, got 0"),
        (f"{BASINS}points = {10**30}", "points must be at most 100000000 in all"),
        ("[vary]\n" + GAPS.replace("'rms'", "{ kind = 'rms', z = 9.0 }") + "dt = 1e-3", "z must lie on the beam"),
        (f"[vary]\n{GAPS}dt = 1e-3\nworkers = {10**30}", "workers must be 1 to 1000"),
        (
            "[mode_count]\ncounts = [1, 2]\nquantity = 'rms'\nduration = 0.5\ndt = 1e-3\nreference = 0",
            "reference must be whole numbers above 0, got 0",
        ),
        (
            "[mode_count]\ncounts = [1, 2]\nquantity = { kind = 'rms', z = 'tip' }\nduration = 0.5\ndt = 1e-3",
            "places of a beam must be numbers",
        ),
        (
            "[vary]\n" + GAPS.replace("'rms'", "{ kind = 'rms', stop = 1 }") + "dt = 1e-3",
            "stop must be below 1, the numb",
        ),
        (
            "[minimise]\n" + GAPS.replace("'rms'", "{ kind = 'power', stop = -2 }") + "dt = 1e-3",
            "stop must be below 1, ",
        ),
        (
            "[mode_count]\ncounts = [1, 2]\nquantity = { kind = 'peak_force', stop = 'valv' }\nduration = 0.5",
            "no contact has this name, got 'valv' in peak_force.stop=valv.; the nearest is 'stop at 1 m, below'",
        ),
        ("[peak]\nover = 'stops[0].gap'\nvalues = [1e-3, 2e-3]\nspan = [20.0, 40.0]\nz = 2.0", "must lie on the beam"),
        ("[peak]\nover = 'damping.zeta[0]'\nvalues = [-0.1, 0.1]\nspan = [20.0, 40.0]", "zeta"),
        ("[backbone]\nlevels = [1e-3, 2e-3]\nspan = [20.0, 40.0]\nz = 2.0", "must lie on the beam"),
        (f"[vary]\n{GAPS}dt = 2.0", "dt must be at most the duration of 1 s, got 2.0"),
        ("[mode_count]\ncounts = [1, 2]\nquantity = 'rms'\nduration = 0.5\ndt = 2.0", "dt must be at most the dura"),
        (f"{ENSEMBLE}until = 2.0", r"until must lie in \(0, 1\), got 2.0"),
        (f"{ENSEMBLE}discard = -1", "discard must be finite and not neg"),
        (f"{ENSEMBLE}segment = 3", "segment must be at least 8 samples"),
        (f"{MINIMISE}tolerance = 0.5", r"tolerance must lie in \(0, 0.1\), got 0.5"),
        (f"{MINIMISE}constraints = {{ peak_force = nan }}", "the bound of peak_force must be a finite number"),
        (
            f"{BASINS}x = 'displacment'",
            "must be 'displacement', 'velocity' or the number of a state, got 'displacment'",
        ),
    ],
)
def test_wrong_values_of_studies_are_said_before_anything_is_computed(file_of, table, message):
    name = table[: table.index("]") + 1].replace("[", r"\[").replace("]", r"\]")
    with pytest.raises(SceneFileError, match=f"{name}: .*{message}"):
        file_of(DRIVEN + table)


@pytest.mark.parametrize(
    "study",
    [
        "[orbit]",
        "[branch]\nspan = [0.0, 1e-3]\nparameter = 'stops[0].gap'",
        "[basins]\nx_span = [-1e-3, 1e-3]\ny_span = [-0.1, 0.1]\npoints = [3, 3]",
        "[peak]\nover = 'stops[0].gap'\nvalues = [0.0, 1e-3]\nspan = [1e8, 2e8]\nparameter = 'stops[0].law.stiffness'",
    ],
)
def test_orbits_under_loads_without_a_period_are_refused_when_read(file_of, study):
    """They were refused after the studies before them had run."""
    with pytest.raises(SceneFileError, match="an orbit needs periodic loads"):
        file_of(EXAMPLE + study)


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ("[ensemble]\nrealisations = 8\nduration = 1.0\ndt = 1e-3", "an ensemble needs a BandNoise"),
        ("[campbell]\nspins = [0.0, 100.0]", "a Campbell diagram needs one shaft"),
    ],
)
def test_studies_of_other_scenes_are_refused_when_read(file_of, study, message):
    """They were refused after the studies before them had run, and passed the check."""
    with pytest.raises(SceneFileError, match=message):
        file_of(DRIVEN + study)
