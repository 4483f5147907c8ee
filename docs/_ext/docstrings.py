"""Docstrings as numpydoc wants them: formulas kept as they are, one entry for each name of a list.

Ours read well as plain text: a formula is indented, a list has lines `name : meaning; next : meaning`.
"""

import re
from itertools import pairwise

HEADING = re.compile(r"^([A-Z][A-Za-z ]+)\n-{3,}\n", re.MULTILINE)
NAMED = {"Parameters", "Attributes"}
CODE = re.compile(r"(``.+?``|`[^`\n]+`)")


def prose(text: str) -> str:
    """Text whose stars, bars and underscores mean themselves; code between backticks stays code."""
    parts = CODE.split(text)
    parts[::2] = [re.sub(r"([*|\\])|(?<=\w)(_)(?!\w)", r"\\\1\2", part) for part in parts[::2]]
    parts[1::2] = [part if re.fullmatch(r"`[\w.]+`|``.*", part) else f"`{part}`" for part in parts[1::2]]
    return re.sub(r"^(?=\w\.)", r"\\", "".join(parts))  # "m." is a unit, no item of a list


def blocks(text: str) -> str:
    """Paragraphs, with indented ones as literal blocks and examples untouched."""
    return "\n\n".join(block(each) for each in re.split(r"\n\s*\n", apart(text).strip("\n")))


def apart(text: str) -> str:
    """Blank lines around indented formulas."""
    lines = text.rstrip().splitlines()
    spaced = lines[:1]
    for before, line in pairwise(lines):
        if before.strip() and line.strip() and before.startswith("    ") != line.startswith("    "):
            spaced += [""] * (not before.startswith(("- ", ">>>", "...")))
        spaced.append(line)
    return "\n".join(spaced)


def block(text: str) -> str:
    """One paragraph."""
    if text.startswith("    "):
        return "::\n\n" + text
    return text if text.startswith((">>>", "...")) else prose(text)


def listed(body: str) -> str:
    """Entries `name` with an indented meaning, from lines that may hold several."""
    items = [" ".join(line.strip() for line in each.splitlines()) for each in re.split(r"\n(?=\S)", body.strip())]
    items = [each for item in items for each in re.split(r"(?<=[.;]) (?=\w[\w, .]*? : )", item)]
    return "\n".join(entry(item) for item in items)


def entry(item: str) -> str:
    """One of them; without a name it is a remark, which numpydoc shows as it is."""
    name, colon, meaning = item.partition(" : ")
    return f"{name}\n    {prose(meaning)}" if colon else prose(item)


def section(heading: str, body: str) -> str:
    """One section; what is returned or raised is a sentence."""
    if heading in NAMED:
        text = listed(body)
    elif heading == "Examples":
        text = body.rstrip()
    elif heading in {"Returns", "Raises", "Warns", "Yields"}:
        return f".. rubric:: {heading}\n\n" + "\n\n".join(
            prose(re.sub(r"^(\w+) : ", r"``\1``: ", " ".join(each.split())))
            for each in re.split(r"\n(?=\S+ : )", body.strip())
        )
    else:
        text = blocks(body)
    return f"{heading}\n{'-' * len(heading)}\n{text}"


def readable(text: str) -> str:
    """A whole docstring."""
    intro, *rest = HEADING.split(text)
    parts = [section(*each) for each in zip(rest[::2], rest[1::2], strict=True)]
    sentences = [part for part in parts if part.startswith("..")]
    return "\n\n".join([blocks(intro), *(part for part in parts if part not in sentences), *sentences])


def convert(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Called for every docstring before numpydoc."""
    lines[:] = [*readable("\n".join(lines)).splitlines(), ""]


def setup(app: object) -> dict[str, bool]:
    """Register it before numpydoc's own step."""
    app.connect("autodoc-process-docstring", convert, priority=100)
    return {"parallel_read_safe": True}
