"""The scripts of `examples/` for sphinx-gallery: in course order, with headings and the figures they write.

Links of the pages to scripts, and to the course as a whole, lead to their pages in the gallery. Its pictures are kept
in `_static/course`, so that a build that runs no scripts has them too; after one that runs them

    python docs/_ext/course.py        renews the kept pictures by those of the last build
"""

import re
import shutil
from pathlib import Path

from docstrings import blocks
from sphinx_gallery.scrapers import figure_rst

HOME = Path(__file__).resolve().parent.parent
EXAMPLES = HOME.parent / "examples"
COPIES = HOME / "_build" / "examples"
KEPT, WIDTH, COLOURS = HOME / "_static" / "course", 240, 32  # pictures of some 5 kB
SCRIPT = re.compile(r"\[([^\]]+)\]\((?:\.\./)+examples/(\w+)\.py\)")
COURSE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+examples/README\.md\)")
HEADER = """Course
======

One idea per script, each ending in an asserted number, from theory or from an independent computation. Output and
figures are of this build; long ones ran with their switch ``--quick``. Every page offers its script and a notebook.
"""


def copy() -> None:
    """Copies of all scripts, whose docstrings begin with a heading, and of the files they read."""
    COPIES.mkdir(parents=True, exist_ok=True)
    for path in [*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("*.csv")]:
        shutil.copy(path, COPIES)
    (COPIES / "GALLERY_HEADER.rst").write_text(HEADER, encoding="utf-8")
    for path in EXAMPLES.glob("*.py"):
        text = headed(path.read_text(encoding="utf-8")) + pictured(path.stem)
        (COPIES / path.name).write_text(text, encoding="utf-8")


def pictured(name: str) -> str:
    """What tells the gallery which picture a script has, if one is kept."""
    path = KEPT / f"{name}.png"
    return f'\n# sphinx_gallery_thumbnail_path = "{path.relative_to(HOME).as_posix()}"\n' if path.exists() else ""


def keep() -> None:
    """Small copies of the pictures of the last build, but for those that stand for none."""
    from PIL import Image

    KEPT.mkdir(exist_ok=True)
    for path in sorted((HOME / "gallery" / "images").glob("sphx_glr_*_001.png")):
        with Image.open(path) as image:
            small = image.convert("RGB").resize((WIDTH, round(WIDTH * image.height / image.width)), Image.LANCZOS)
        name = path.stem.removeprefix("sphx_glr_").removesuffix("_001")
        small.quantize(COLOURS).save(KEPT / f"{name}.png", optimize=True)


def headed(code: str) -> str:
    """A script whose docstring has a title: its first sentence up to the colon."""
    _, text, rest = code.split('"""', 2)
    title = re.split(r"[:.]", " ".join(text.split("\n\n")[0].split()), maxsplit=1)[0]
    return f'r"""\n{title}\n{"=" * len(title)}\n\n{blocks(text)}\n"""{rest}'


class Lesson:
    """Key that sorts scripts by their number in the course."""

    def __init__(self, folder: str) -> None:
        course = (EXAMPLES / "README.md").read_text(encoding="utf-8")
        self.names = re.findall(r"^\| \d+ \| \[(\w+\.py)\]", course, re.MULTILINE)

    def __call__(self, name: str) -> int:
        """Place of a script."""
        return self.names.index(Path(name).name)


def written_figures(block: object, variables: dict, gallery_conf: dict) -> str:
    """Take over the PNG files that a script has written into its folder."""
    found = []
    for path in sorted(COPIES.glob("*.png"), key=lambda path: path.stat().st_mtime):
        target = next(variables["image_path_iterator"])
        shutil.move(path, target)
        found.append(target)
    return figure_rst(found, gallery_conf["src_dir"])


def arguments(gallery_conf: dict, variables: dict) -> list[str]:
    """The quick way, and a name for the figure, where a script takes them; it also learns where its file is."""
    variables["example_globals"]["__file__"] = variables["src_file"]
    code = Path(variables["src_file"]).read_text(encoding="utf-8")
    offered = {"[FIGURE.png]": "figure.png", "--quick": "--quick"}
    return [argument for sign, argument in offered.items() if sign in code]


def linked(app: object, name: str, source: list[str]) -> None:
    """A page as it is read, with links to scripts as links within the site."""
    text = SCRIPT.sub(r"{doc}`\1 </gallery/\2>`", source[0])
    source[0] = COURSE.sub(r"{doc}`\1 </gallery/index>`", text)


def setup(app: object) -> dict[str, bool]:
    """Copy before the gallery looks for its scripts."""
    app.connect("config-inited", lambda app, config: copy(), priority=1)
    app.connect("source-read", linked)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    keep()
