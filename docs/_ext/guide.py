"""Pages made of sections of `guide.md`: a line `% guide: Laws` in a page stands for the text of that section.

`% guide: Choosing modes | Errors for` begins at the paragraph with these first words, and ends the piece before it.
A section goes up to the next heading. Links to examples lead to their pages in the gallery.
"""

import re
from functools import cache
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
MARK = re.compile(r"^% guide: ([^|\n]+?)(?: \| (.+))?$", re.MULTILINE)
HEADING = re.compile(r"^##+ (.+)$", re.MULTILINE)
EXAMPLE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+examples/(\w+)\.py\)")


def pages() -> list[Path]:
    """All pages in Markdown but the guide."""
    hidden = {"_build", "gallery", "generated"}
    return [path for path in sorted(HOME.rglob("*.md")) if path.name != "guide.md" and not hidden & set(path.parts)]


@cache
def pieces() -> dict[tuple[str, str], str]:
    """Text by heading and first words."""
    _, *rest = HEADING.split((HOME / "guide.md").read_text(encoding="utf-8"))
    sections = dict(zip(rest[::2], rest[1::2], strict=True))
    marks = {mark for path in pages() for mark in MARK.findall(path.read_text(encoding="utf-8"))}
    found = {}
    for heading, text in sections.items():
        starts = {text.index("\n" + words): words for name, words in marks if name == heading and words}
        cuts = sorted({0: "", **starts}.items())
        ends = [*(place for place, _ in cuts[1:]), None]
        for (place, words), end in zip(cuts, ends, strict=True):
            found[heading, words] = text[place:end].strip()
    return found


def expanded(text: str) -> str:
    """A page with the guide's sections in their places."""
    lost = [name for name, words in MARK.findall(text) if (name, words) not in pieces()]
    if lost:
        raise ValueError(f"guide.md has no section {lost[0]!r}, which a page asks for; rename it in both")
    return MARK.sub(lambda mark: pieces()[mark[1], mark[2] or ""], text)


def linked(text: str) -> str:
    """Links that lead out of the site as links within it."""
    text = EXAMPLE.sub(r"{doc}`\1 </gallery/\2>`", text)
    return re.sub(r"\]\((?:\.\./)+examples/(\w+\.(?:png|toml|csv))\)", r"](/../examples/\1)", text)


def setup(app: object) -> dict[str, bool]:
    """Fill pages as they are read."""

    def fill(app: object, name: str, source: list[str]) -> None:
        source[0] = linked(expanded(source[0]))

    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
