"""What the pages say holds: their code runs, their links lead somewhere, pages of all docstrings build."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import fembeam

HOME = Path(__file__).parent.parent
PACKAGES = Path(fembeam.__file__).parent.parent  # elsewhere, where a wheel is tested
PAGES = ["README.md", "CONTRIBUTING.md", "docs/guide.md", "examples/README.md"]


def run(folder, *command):
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.parametrize("page", ["README.md", "docs/guide.md"])
def test_code_of_a_page(page, tmp_path):
    """Blocks run from top to bottom as one script; those that begin with `# name.py` are files of their own."""
    (tmp_path / "examples").symlink_to(HOME / "examples")
    together, files = [], []
    for block in re.findall(r"^```python\n(.*?)^```", (HOME / page).read_text(encoding="utf-8"), re.M | re.S):
        name = re.match(r"# (\w+\.py)\n", block)
        (files if name else together).append(block)
        if name:
            (tmp_path / name[1]).write_text(block, encoding="utf-8")
    assert together
    (tmp_path / "page.py").write_text("\n".join(together), encoding="utf-8")
    run(tmp_path, "page.py")
    for block in files:
        run(tmp_path, re.match(r"# (\w+\.py)\n", block)[1])


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
        text = (HOME / page).read_text(encoding="utf-8")
        for name in re.findall(r"\b(?:examples|tests|docs|fembeam|solvers|contacts)/[\w/]+\.(?:py|toml|csv)\b", text):
            found = (HOME / name).exists() or (PACKAGES / name).exists()
            assert found, f"{page} names {name}, which is not there"


def test_the_course_is_complete():
    """Every script stands once in the table, below 80 lines."""
    course = (HOME / "examples" / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| \d+ \| \[(\w+\.py)\]\(\1\)", course, re.M)
    scripts = sorted((HOME / "examples").glob("*.py"))
    assert sorted(listed) == [path.name for path in scripts]
    for path in scripts:
        assert len(path.read_text(encoding="utf-8").splitlines()) < 80, f"{path.name} is too long for one idea"


def test_pages_of_all_docstrings(tmp_path):
    pytest.importorskip("pdoc", reason="the extra 'docs' is not installed")
    done = run(HOME, "docs/api.py", str(tmp_path))
    assert done.stderr == ""
    for package, name in {
        "contacts": "Hysteretic",
        "reduction": "Basis",
        "solvers": "System",
        "fembeam": "Scene",
    }.items():
        assert f'id="{name}"' in (tmp_path / f"{package}.html").read_text(encoding="utf-8")
