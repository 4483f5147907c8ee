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
from typing import Any

import pdoc

HOME = Path(__file__).resolve().parent
PACKAGES = ["contacts", "reduction", "solvers", "fembeam", "fembeam.statistics", "fembeam.study.quantities"]
PRIVATE = [r"!(contacts|solvers)\..+", r"!fembeam\.study\.(?!quantities).+"]  # modules named like their functions
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
    """Items `name : meaning`, continued by indented lines; short ones may share a line."""
    items = [item(each) for each in re.split(r"\n(?=\S)", body.strip())]
    items = [each for line in items for each in re.split(r"(?<=[.;]) (?=\w[\w, .]*? : )", line)]
    return "\n".join("- " + re.sub(r"^(.+?) : ", r"**\1**: ", each) for each in items)


def item(text: str) -> str:
    """One item on one line, whether its meaning begins on the first line or on the second."""
    head, *tail = (line.strip() for line in text.splitlines())
    apart = bool(tail) and tail[0][:1].isupper() and head[-1] not in ".,;:"
    joint = " : " if tail and head.isidentifier() else "; " if apart else " "
    return joint.join([head, " ".join(tail)]) if tail else head


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
    text = ARRAY.sub("Array", plain(annotation, *rest)).replace("typing.", "")
    if "_SupportsArray" in text:  # what numpy's ArrayLike expands to
        return "ArrayLike | None" if "NoneType" in text else "ArrayLike"
    return text


def with_hidden_bases(listed: Any) -> Any:
    """The members a page shows of a class: its own and those of bases that no package offers by name."""

    def members(one: Any) -> list[Any]:
        found = listed.func(one)
        for (module, name), inherited in one._members_by_origin.items():
            home = sys.modules.get(module.split(".")[0])
            if module.split(".")[0] in PACKAGES and name not in home.__all__ and module != one.taken_from[0]:
                found = found + [member for member in inherited if member not in found]
        return found

    return members


def build(folder: Path) -> None:
    """Write the pages into a folder."""
    pdoc.doc.Class.own_members = property(with_hidden_bases(pdoc.doc.Class.own_members))
    warnings.simplefilter("error")
    pdoc.docstrings.convert, inspect.formatannotation, pdoc.doc.formatannotation = readable, short, short
    look = {"template_directory": HOME / "templates", "footer_text": "SI units, angular frequencies in rad/s"}
    pdoc.render.configure(docformat="markdown", show_source=False, **look)
    pdoc.pdoc(*PACKAGES, *PRIVATE, output_directory=folder)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else HOME / "api"
    build(target)
    print(f"open {target / 'index.html'}")
