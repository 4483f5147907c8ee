"""Write the pages of all public functions and classes from their docstrings.

    pip install -e ".[docs]" && python docs/api.py [FOLDER]        default folder: docs/api

Needs pdoc, nothing from the network. Warnings are errors, so that a broken reference does not go unseen.
"""

import inspect
import re
import sys
import warnings
from itertools import pairwise
from pathlib import Path

import pdoc

HOME = Path(__file__).resolve().parent
PACKAGES = ["contacts", "reduction", "solvers", "fembeam", "fembeam.statistics", "fembeam.study.quantities"]
PRIVATE = ["!contacts.identify", "!contacts.law", "!contacts.restitution", "!solvers.lyapunov"]  # named like functions
LISTED = {"Parameters", "Returns", "Raises", "Attributes", "Yields"}
ARRAY = re.compile(r"numpy\.ndarray\[tuple\[typing\.Any, \.\.\.\], numpy\.dtype\[numpy\.(\w+)\]\]")
plain = inspect.formatannotation


def readable(text: str, *_: object) -> str:
    """A docstring in Markdown: sections as headings, `name : meaning` as lists, formulas kept as they are."""
    intro, *rest = re.split(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", text, flags=re.MULTILINE)
    parts = [blocks(intro)]
    for heading, body in zip(rest[::2], rest[1::2], strict=True):
        parts.append(f"###### {heading}\n\n{listed(body) if heading in LISTED else blocks(body)}")
    return "\n\n".join(parts)


def listed(body: str) -> str:
    """Items `name : meaning`, continued by indented lines."""
    items = re.split(r"\n(?=\S)", inspect.cleandoc(body))
    lines = [" ".join(line.strip() for line in item.splitlines()) for item in items]
    return "\n".join("- " + re.sub(r"^(.+?) : ", r"**\1**: ", line) for line in lines)


def blocks(body: str) -> str:
    """Blank lines around indented formulas, which Markdown then shows as they stand."""
    lines = body.rstrip().splitlines()
    spaced = lines[:1]
    for before, line in pairwise(lines):
        if before and line and before.startswith("    ") != line.startswith("    ") and ">>>" not in line:
            spaced.append("")
        spaced.append(line)
    return "\n".join(spaced)


def short(annotation: object, *rest: object) -> str:
    """A type as a reader would write it."""
    return ARRAY.sub("Array", plain(annotation, *rest)).replace("typing.", "")


def build(folder: Path) -> None:
    """Write the pages into a folder."""
    warnings.simplefilter("error")
    pdoc.docstrings.convert, inspect.formatannotation, pdoc.doc.formatannotation = readable, short, short
    pdoc.render.configure(docformat="markdown", show_source=False, footer_text="SI units, angular frequencies in rad/s")
    pdoc.pdoc(*PACKAGES, *PRIVATE, output_directory=folder)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else HOME / "api"
    build(target)
    print(f"open {target / 'index.html'}")
