"""What the pages say holds: their code runs, their links lead somewhere, the site builds without a warning."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import fresh_process
import pytest

import contacts
import fembeam
import reduction
import solvers

HOME = Path(__file__).parent.parent
PACKAGES = Path(fembeam.__file__).parent.parent  # elsewhere, where a wheel is tested
BUILT = {"_build", "gallery", "generated"}
SITE = [
    path.relative_to(HOME).as_posix() for path in sorted((HOME / "docs").rglob("*.md")) if not BUILT & set(path.parts)
]
PAGES = ["README.md", "CONTRIBUTING.md", "examples/README.md", *SITE]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)


def run(folder, *command):
    options = {"env": {**os.environ, "MPLBACKEND": "Agg"}, "capture_output": True, "text": True, "timeout": 300}
    done = subprocess.run([sys.executable, *command], cwd=folder, check=False, **options)
    assert done.returncode == 0, done.stderr
    return done


def text_of(page):
    return (HOME / page).read_text(encoding="utf-8")


WITH_CODE = [page for page in ["README.md", *SITE] if BLOCK.search(text_of(page))]


@pytest.mark.example
@pytest.mark.parametrize("page", WITH_CODE)
def test_code_of_a_page(page, tmp_path):
    """Blocks run from top to bottom as one script; those that begin with `# name.py` are files of their own."""
    (tmp_path / "examples").symlink_to(HOME / "examples")
    together, files = [], []
    for block in BLOCK.findall(text_of(page)):
        name = re.match(r"# (\w+\.py)\n", block)
        (files if name else together).append(block)
        if name:
            (tmp_path / name[1]).write_text(block, encoding="utf-8")
    (tmp_path / "page.py").write_text("\n".join(together), encoding="utf-8")
    fresh_process.run_script(tmp_path, "page.py")
    for block in files:
        fresh_process.run_script(tmp_path, re.match(r"# (\w+\.py)\n", block)[1])


def test_the_front_page_leads_to_every_task():
    """One click from the front page to each how-to page."""
    tasks = {path.name for path in (HOME / "docs" / "how_to").glob("*.md")} - {"index.md"}
    assert tasks == set(re.findall(r"\]\(how_to/(\w+\.md)\)", text_of("docs/index.md"))) - {"index.md"}


def test_figures_of_benchmarks_stand_on_two_pages():
    naming = {page for page in SITE if "tests/bench/" in text_of(page)}
    assert naming == {"docs/evidence.md", "docs/explanation/cost.md"}


def test_readme_is_short():
    assert len(text_of("README.md").splitlines()) <= 120


def test_the_version_to_cite():
    assert re.search(r"^version: (.+)$", text_of("CITATION.cff"), re.M)[1] == fembeam.__version__


def anchors(path):
    """Names of the headings of a page, as they are linked to."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_files_named_in_the_architecture_exist():
    """Paths in CONTRIBUTING; 25 at most of them on the way of one run."""
    text = (HOME / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:contacts|reduction|solvers|fembeam|tests|docs)/[\w/]+\.py)`", text)
    assert [name for name in named if not (HOME / name).is_file()] == []
    way = text[text.index("### The way of one run") : text.index("A method of constant step replaces")]
    assert 18 <= len(set(re.findall(r"`[\w/]+\.py`", way))) <= 25


@pytest.mark.parametrize("page", PAGES)
def test_links(page):
    path = HOME / page
    for target in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        linked = (path.parent / name).resolve() if name else path
        assert linked.exists(), f"{page} links to {target}, which is not there"
        assert not anchor or anchor in anchors(linked), f"{page} links to {target}; there are {anchors(linked)}"


def test_files_the_pages_name():
    for page in PAGES:
        text = text_of(page)
        for name in re.findall(r"\b(?:examples|tests|docs|fembeam|solvers|contacts)/[\w/]+\.(?:py|toml|csv)\b", text):
            found = (HOME / name).exists() or (PACKAGES / name).exists()
            assert found, f"{page} names {name}, which is not there"


def test_the_course_is_complete():
    """Every script stands once in the table, below 80 lines; the gallery of failures is ten small problems."""
    course = (HOME / "examples" / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| \d+ \| \[(\w+\.py)\]\(\1\)", course, re.M)
    scripts = sorted((HOME / "examples").glob("*.py"))
    assert sorted(listed) == [path.name for path in scripts]
    for path in scripts:
        long = len(path.read_text(encoding="utf-8").splitlines()) >= 80
        assert not long or path.name == "failure_gallery.py", f"{path.name} is too long for one idea"


WITH_SPHINX = pytest.mark.skipif(not find_spec("sphinx_gallery"), reason="the extra 'docs' is not installed")


@pytest.fixture
def formulas(monkeypatch):
    monkeypatch.syspath_prepend(HOME / "docs" / "_ext")
    return pytest.importorskip("formulas", exc_type=ImportError)


@WITH_SPHINX
@pytest.mark.parametrize(
    ("plain", "latex"),
    [
        ("F = K δ^p (1 + a δ̇/δ̇⁻)", r"F = K δ^{p} (1 + a \dot{δ}/\dot{δ}^{-})"),
        ("τ = √(v² + 2 B g)/B", r"τ = \sqrt{v^{2} + 2 B g}/B"),
        ("Σ_{j≠i} r_j <= θ_(i)", r"\sum _{j\ne i} r_{j} \le  θ_{(i)}"),
        ("δ_max = EI,    F = ∫₀¹ x dx", r"δ_{\mathrm{max}} = E I, \quad F = \int _{0}^{1} x d x"),
        ("y = √Δω Re a_k", r"y = \sqrt{Δω} \mathrm{Re}\, a_{k}"),
        ("r = a/(1 + a),    at all speeds", r"r = a/(1 + a), \quad \text{ at all speeds }"),
    ],
)
def test_plain_formulas_are_typeset(formulas, plain, latex):
    assert formulas.formula(plain) == latex
    assert formulas.readable(latex)


@WITH_SPHINX
@pytest.mark.parametrize(
    "text",
    [
        "model = scene.reduce(modes=2)",
        'name = "stop"',
        "grazing   a contact comes to touch",
        "the rate = the speed of entry",
        "F = √(1 + a",
    ],
)
def test_what_is_no_formula_stays(formulas, text):
    assert formulas.formula(text) is None or not formulas.readable(formulas.formula(text))


@WITH_SPHINX
def test_what_a_script_prints_stays(formulas):
    from docutils import nodes, utils

    document = utils.new_document("page")
    for classes in ([], [formulas.PRINTED]):
        document += nodes.literal_block("F = k x", "F = k x", classes=classes, language="none")
    formulas.typeset(None, document)
    assert [type(block).__name__ for block in document] == ["math_block", "literal_block"]


@WITH_SPHINX
def test_an_equation_that_cannot_be_read_is_named(formulas):
    from mathml import converted

    with pytest.raises(ValueError, match=r"no MathML can be made of the formula '.*unheard"):
        converted(r"a = \unheard{b}", display=True)


@WITH_SPHINX
def test_an_index_stands_beside_an_accented_letter(formulas):
    """It stood below it, as under a sum."""
    from mathml import converted

    for latex in (r"\dot{q}_i", r"\ddot{q}_{12} + \hat{q}_{i j}", r"F(\dot{\delta}_s(t_j))"):
        found = converted(latex, display=True)
        assert "munder" not in found
        assert found.count("<msub>") == latex.count("_")
        assert found.count("<mover") == found.count("</mover>") == latex.count(r"{q}") + latex.count(r"{\delta}")
    assert "munderover" in converted(r"\sum_{i=1}^n", display=True)


@WITH_SPHINX
def test_a_line_of_equations_breaks_between_them(formulas):
    from mathml import parts

    assert parts(r"a = b, \quad c = d \qquad e") == ["a = b, ", " c = d ", " e"]
    aligned = r"\begin{matrix} a & b \\ c \quad d & e \end{matrix}"
    assert parts(aligned) == [aligned]


@pytest.mark.example
@WITH_SPHINX
def test_site(tmp_path):
    """Without running the examples, which have a test of their own; links within the site hold."""
    shutil.copytree(HOME, tmp_path / "here", ignore=shutil.ignore_patterns(".*", "_build", "gallery", "generated"))
    build = ["-m", "sphinx", "-q", "-W", "-D", "sphinx_gallery_conf.plot_gallery=0", "docs", "../site"]
    run(tmp_path / "here", *build)
    run(tmp_path, "here/docs/_ext/links.py", "site")
    for package in (contacts, fembeam, reduction, solvers):
        for name in {*package.__all__} - {"plot", "study"}:
            page = tmp_path / "site" / "reference" / "generated" / f"{package.__name__}.{name}.html"
            indexed = package is fembeam or getattr(package, name) is not getattr(fembeam, name, None)  # once
            assert (f'id="{package.__name__}.{name}"' in page.read_text(encoding="utf-8")) == indexed
    pages = {path: path.read_text(encoding="utf-8") for path in (tmp_path / "site").rglob("*.html")}
    loaded = r'<(?:script|img|iframe)[^>]+src="(?:https?:)?//|<link[^>]+rel="stylesheet"[^>]+href="(?:https?:)?//'
    assert [path for path, page in pages.items() if re.search(loaded, page)] == []
    typeset = (tmp_path / "site" / "explanation" / "equations.html").read_text(encoding="utf-8")
    source = text_of("docs/explanation/equations.md")
    indented = len(re.findall(r"\n\n {4}\S", source))
    assert typeset.count('class="equation"') == len(re.findall(r"^\$\$$", source, re.M)) / 2 + indented
    assert "$$" not in typeset
