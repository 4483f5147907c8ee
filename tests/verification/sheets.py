"""Verification sheets: a benchmark each, from its problem to the page that shows it.

A sheet is a module of this folder, named in `SHEETS`. It offers

    __doc__            title, then the problem in words and numbers, in Markdown
    SOURCE             who published it, in Markdown
    rows()             what is compared, a list of `Row`
    draw(rig, plot)    a drawing of the problem and one of the result, into two axes

All of `docs/verification` is made from these, by `python tests/verification --write`.
"""

import re
import runpy
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

from matplotlib.figure import Figure

HOME = Path(__file__).parent.parent.parent
PAGES = HOME / "docs" / "verification"
SHEETS = (
    "natural_frequencies",
    "tip_mass",
    "axial_load",
    "craig_bampton",
    "duffing",
    "bilinear",
    "spring_shock",
    "hertz",
    "ball_on_beam",
    "rod_wall",
    "restitution",
    "bouc_wen",
    "iwan",
    "masing",
    "den_hartog",
    "stick_slip",
    "moon_shaw",
    "jeffcott_rub",
    "shock_spectrum",
    "spectral_noise",
    "white_noise",
    "paper_2003",
)
COMMAND = "python tests/verification"
MADE = f"<!-- made by `{COMMAND} --write` from tests/verification -->\n"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
UNSEEN = 1e-9  # errors below it are rounding, other processors have others


@dataclass(frozen=True)
class Row:
    """One number: as the published formula gives it, evaluated here, and as fembeam finds it.

    ``printed`` is the number as it stands in the source, or what the source claims, where there is one. ``allowed`` is
    the largest relative error; above 1e-2 it is one of chance or of an approximation.
    """

    quantity: str
    formula: float
    ours: float
    allowed: float
    printed: str = ""

    @property
    def error(self):
        """Of ours, relative."""
        return abs(self.ours / self.formula - 1.0)


def sheet(name):
    """The module of a sheet."""
    return import_module(name)


@cache
def rows(name):
    """What a sheet compares, computed once."""
    return sheet(name).rows()


@cache
def example(name):
    """What a script of the course computes, by name."""
    return runpy.run_path(str(HOME / "examples" / f"{name}.py"))


def title(name):
    """The heading of a sheet."""
    return sheet(name).__doc__.splitlines()[0]


def size(error):
    """An error as text."""
    return f"{error:.1e}" if error >= UNSEEN else f"< {UNSEEN:.0e}"


def cells(row, printed):
    """Text of one line of a table."""
    claimed = [row.printed] * printed
    off = [size(abs(float(row.printed) / row.formula - 1.0)) if row.printed else ""] * printed
    values = [f"{row.formula:.8g}", f"{row.ours:.8g}"]
    return [row.quantity, *claimed, *values, *off, size(row.error), f"{row.allowed:.0e}"]


def table(name):
    """Lines of text: the numbers of a sheet."""
    found = rows(name)
    printed = any(row.printed for row in found)
    heads = ["", *["published"] * printed, "formula", "fembeam", *["error of published"] * printed]
    return lines([[*heads, "error of fembeam", "allowed"], *(cells(row, printed) for row in found)])


def line(entry):
    """Of a table in Markdown."""
    return f"| {' | '.join(entry)} |"


def lines(entries):
    """A table in Markdown; the first entry holds the headings."""
    heads, *others = entries
    return "\n".join(line(entry) for entry in [heads, ["---"] * len(heads), *others])


def page(name):
    """Text of the page of a sheet."""
    parts = [
        MADE + f"# {title(name)}",
        sheet(name).__doc__.split("\n", 1)[1].strip("\n"),  # it may begin with an indented formula
        f"**Source.** {sheet(name).SOURCE}",
        f"![The problem, and the result]({name}.png)",
        "Relative errors against the formula:",
        table(name),
        f"`{COMMAND} {name}` computes this table.",
    ]
    return "\n\n".join(parts) + "\n"


def brief(source):
    """Authors and year of what a source names first."""
    first = source.split(";")[0]
    year = re.search(r"\b(?:1[89]|20)\d\d\b", first)
    return " ".join([first.split("*")[0].strip(", "), *([year[0]] if year else [])])


def summary(name):
    """One entry of the table of all sheets."""
    worst = max(rows(name), key=lambda row: row.error / row.allowed)
    link = f"[{title(name)}]({name}.md)"
    return [link, brief(sheet(name).SOURCE), str(len(rows(name))), size(worst.error), f"{worst.allowed:.0e}"]


def index():
    """Text of the page that lists all sheets: that of `index.txt`, with their table and their menu."""
    text = Path(__file__).with_name("index.txt").read_text(encoding="utf-8")
    heads = ["sheet", "first source", "numbers", "error nearest to its limit", "limit"]
    made = lines([heads, *(summary(name) for name in SHEETS)])
    return MADE + text.format(table=made, sheets="\n".join(SHEETS))


def figure(name):
    """Drawing of the problem beside that of the result."""
    found = Figure(figsize=(8.4, 3.2), layout="constrained")
    rig, plot = found.subplots(1, 2, width_ratios=(1.0, 1.25))
    rig.set_aspect("equal")
    rig.axis("off")
    sheet(name).draw(rig, plot)
    return found


def current(written, made):
    """Whether a written page says what is made now: the same words, and numbers up to another processor's rounding.

    Numbers agree to 1e-6, small ones (errors) to half their size and 1e-8; where more than 1 % is allowed, to what is
    allowed.
    """
    written, made = (text.replace("< ", "") for text in (written, made))
    if NUMBER.split(written) != NUMBER.split(made):
        return False
    for old, new in zip(written.splitlines(), made.splitlines(), strict=True):
        before, after = ([float(one) for one in NUMBER.findall(line)] for line in (old, new))
        loose = after[-1] if old.startswith("|") and after and 1e-2 < after[-1] < 1.0 else 0.0
        if not all(same(a, b, loose) for a, b in zip(before, after, strict=True)):
            return False
    return True


def same(old, new, loose):
    """Whether two numbers of a page are one, but for rounding or, in loose lines, for chance."""
    within = 0.5 * abs(new) + 10.0 * UNSEEN if abs(new) < 1e-2 else 1e-6 * abs(new)
    return abs(old - new) <= within + loose * max(abs(new), 1.0)
