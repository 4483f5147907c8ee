"""One self-contained page per result folder: what was found, how sure it is, figures, settings, warnings.

Figures are embedded, so that the one file can be sent by mail; it needs no network and reads on a phone.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterator, Sequence
from html import escape
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam.plot.figure import after
from fembeam.scene import unit_of
from fembeam.support import html_table, written_whole

if TYPE_CHECKING:
    from fembeam.scene import Source

CONTACT_ROWS = (  # words, unit of the figures per SI unit, place in the summary
    ("at z / mm", 1e3, "z", ""),
    ("at", 1.0, "place", ""),
    ("side", 1.0, "side", ""),
    ("closes along", 1.0, "direction", ""),
    ("number", 1.0, "number", ""),
    ("per second", 1.0, "rate", ""),
    ("± s.e.", 1.0, "rate_error", ""),
    ("mean time / ms", 1e3, "duration", "mean"),
    ("mean peak / {force}", 1.0, "peak_force", "mean"),
    ("largest peak / {force}", 1.0, "peak_force", "max"),
    ("mean entry / {speed}", 1.0, "entry_speed", "mean"),
)
WHERE = "z", "place", "side", "direction"  # of which a summary has two
ENERGY = {"input": "put in", "spin": "put in by spin", "damping": "lost in damping", "contact": "lost in contacts",
          "friction": "lost in friction", "stored": "stored"}  # fmt: skip
MOMENT_ROWS = (
    ("mean / {}", 1e3, "mean"),
    ("std / {}", 1e3, "std"),
    ("± s.e.", 1e3, "std_error"),
    ("skewness", 1.0, "skewness"),
    ("kurtosis", 1.0, "kurtosis"),
    ("min / {}", 1e3, "min"),
    ("max / {}", 1e3, "max"),
)
OUTPUT_COLUMNS = ("mean", "std", "min", "at t / s", "max", "at t / s")
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PREFIXES = ("p", "n", "µ", "m", "", "k", "M", "G", "T")
OF_PART = ("psd", "densities", "contacts")  # figures of what comes after the discarded seconds
OF_WHOLE = {"time_history": ", an excerpt of the whole run", "response_spectrum": " of the whole run"}
ORDER = ("rig", "time_history", "psd", "densities", "response_spectrum", "contacts", "modes")


def write_page(
    folder: str | Path, source: Source | None = None, warnings: Sequence[str] = (), files: Sequence[Path] | None = None
) -> Path:
    """Write `report.html` from the tables and figures in a result folder.

    Parameters
    ----------
    folder : as `fembeam run` leaves it.
    source : the scene file. warnings : said while computing.
    files : to show; None: all in the folder.
    """
    folder = Path(folder)
    files = sorted(folder.iterdir()) if files is None else sorted(files)
    title = source.path.stem.replace("_", " ") if source else folder.resolve().name
    body = "\n".join([f"<h1>{escape(title)}</h1>", *_sections(files, source, warnings)])
    with written_whole(folder / "report.html") as file:
        file.write(page(title, body).encode())
    return folder / "report.html"


def page(title: str, body: str) -> str:
    """A whole document."""
    phone = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    style = "\n" + Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    head = f'<meta charset="utf-8">{phone}<title>{escape(title)}</title><style>{style}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def _sections(files: Sequence[Path], source: Source | None, warnings: Sequence[str]) -> Iterator[str]:
    """The page from top to bottom."""
    summaries = (path.read_text(encoding="utf-8") for path in files if path.name == "summary.json")
    found = json.loads(next(summaries, "{}"))
    if found:
        yield _status(found)
    if warnings:
        yield "<h2>Warnings</h2><ul>" + "".join(f'<li class="bad">{escape(said)}</li>' for said in warnings) + "</ul>"
    if found:
        yield from _simulation(found)
    for path in files:
        if path.suffix == ".txt" and not (path.stem == "outputs" and found.get("outputs")):
            yield f"<h2>{escape(_words(path.stem))}</h2>"
            yield from _text(path.read_text(encoding="utf-8"))
    yield from _figures(files, found.get("discarded_seconds", 0.0))
    yield from _settings(found, source)


def _status(found: dict[str, Any]) -> str:
    """How the run ended."""
    kind = "good" if found["complete"] else "bad"
    cost, seconds = found["cost"], found["simulated_seconds"]
    took = _rounded(found["wall_seconds"], 3)
    about = f"{seconds:g} s simulated in {took} s, {cost['events']} events, {cost['steps']} steps"
    return f'<p><span class="{kind}">{escape(found["status"])}</span><br><span class="note">{about}</span></p>'


def _text(content: str) -> Iterator[str]:
    """Tables as they are, sentences as paragraphs that wrap."""
    for is_table, lines in groupby(content.splitlines(), key=lambda line: "  " in line.rstrip()):
        if is_table:
            yield "<pre>" + escape("\n".join(lines)) + "</pre>"
        else:
            yield from (f"<p>{escape(line)}</p>" for line in lines if line.strip())


def _simulation(found: dict[str, Any]) -> Iterator[str]:
    """Tables of [simulate], in the units of the figures."""
    rotations, part = found.get("rotations", []), after(found["discarded_seconds"])
    rows: list[list[Any]] = [
        [name, _rounded(w, 5), _rounded(w / math.tau, 5), f"{z:.4g}"]
        for name, w, z in zip(found["coordinates"], found["omega"], found["zeta"], strict=True)
    ]
    yield "<h2>Model</h2>" + html_table(["coordinate", "ω / rad s⁻¹", "Hz", "ζ"], rows)
    if found["moments"]:
        signals = found["moments"].values()
        length = " or ".join(f"m{unit}" for unit in unit_of("indentation", [False, *rotations]).split(" or "))
        rows = [
            [words.format(length), *(_scaled(row.get(key), unit, words) for row in signals)]
            for words, unit, key in MOMENT_ROWS
        ]
        yield f"<h2>Response{part}</h2>" + html_table(["", *(row["label"] for row in signals)], rows)
        yield f'<p class="note">{escape(found["confidence"])}</p>'
    if found["contacts"]:
        force, speed = (unit_of(of, rotations).replace("/s", " s⁻¹") for of in ("force", "speed"))
        rows = [
            [
                words.format(force=force, speed=speed),
                *(_scaled(_of_stop(row, *keys), unit, words) for row in found["contacts"]),
            ]
            for words, unit, *keys in CONTACT_ROWS
            if keys[0] in found["contacts"][0] or keys[0] not in WHERE
        ]
        stops = [row["name"] for row in found["contacts"]]
        yield f"<h2>Contacts{part}</h2>" + html_table(["", *stops], rows)
    if found.get("outputs"):
        rows = [[name, *(_scaled(x, 1.0, "") for x in row.values())] for name, row in found["outputs"].items()]
        yield f"<h2>Outputs{part}</h2>" + html_table(["", *OUTPUT_COLUMNS], rows)
    if found["energy"]:
        ledger = found["energy"]
        rows = [[words, with_prefix(ledger[name], "J")] for name, words in ENERGY.items() if name in ledger]
        residual = ledger["residual_over_input"]
        yield f"<h2>Energy{' of the whole run' if part else ''}</h2>" + html_table(["", ""], rows)
        yield f'<p class="note">Missing in this balance, an estimate of the error: {residual:.1e} of the input.</p>'


def _of_stop(row: dict[str, Any], key: str, part: str = "") -> Any:
    """One number of a stop."""
    return row.get(key, {}).get(part) if part else row.get(key)


def _scaled(value: Any, unit: float, words: str) -> Any:
    """A number in the unit of its row; of a standard error two digits, of a place all; words as they are."""
    if value is None or isinstance(value, (int, str)):
        return value
    return f"{unit * value:.6g}" if " z " in words else _rounded(unit * value, 2 if "s.e." in words else 4)


def _rounded(value: float, digits: int = 4) -> str:
    """A number to so many significant digits, with a power of 1000 where it is very large or small.

    Examples
    --------
    >>> _rounded(0.0345678), _rounded(-123456.7), _rounded(1.2345e-7), _rounded(0.0)
    ('0.03457', '-123.5·10³', '123.5·10⁻⁹', '0')
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    value = float(f"{value:.{digits - 1}e}")
    power = math.floor(math.log10(abs(value)))
    thousands = 0 if -3 <= power < 5 else power // 3
    decimals = max(0, digits - 1 - power + 3 * thousands)
    exponent = str(3 * thousands).translate(SUPERSCRIPT)
    return f"{value / 1e3**thousands:.{decimals}f}" + f"·10{exponent}" * bool(thousands)


def with_prefix(value: float, unit: str) -> str:
    """A number to four significant digits with the prefix of its unit that keeps it between 1 and 1000.

    Examples
    --------
    >>> with_prefix(0.0123456, "J"), with_prefix(-45678.9, "J"), with_prefix(0.0, "J")
    ('12.35 mJ', '-45.68 kJ', '0 J')
    """
    scaled = float(f"{value:.3e}")
    power = 0 if scaled == 0.0 or not math.isfinite(scaled) else math.floor(math.log10(abs(scaled))) // 3
    power = min(max(power, -4), 4)
    return f"{_rounded(value / 1e3**power)} {PREFIXES[power + 4]}{unit}"


def _figures(files: Sequence[Path], discard: float) -> Iterator[str]:
    """All figures, embedded."""
    figures = [path for path in files if path.suffix == ".png"]
    paths = sorted(figures, key=lambda p: (ORDER.index(p.stem) if p.stem in ORDER else len(ORDER), p.stem))
    if paths:
        yield "<h2>Figures</h2>"
    for path in paths:
        data = base64.b64encode(path.read_bytes()).decode()
        name = escape(_words(path.stem) + _stretch(path.stem, discard))
        image = f'<div class="wide"><img src="data:image/png;base64,{data}" alt="{name}"></div>'
        yield f"<figure><figcaption>{name}</figcaption>{image}</figure>"


def _stretch(name: str, discard: float) -> str:
    """What part of the run a figure shows, where seconds are discarded."""
    return after(discard) if name in OF_PART else OF_WHOLE.get(name, "") * (discard > 0.0)


def _settings(found: dict[str, Any], source: Source | None) -> Iterator[str]:
    """The scene and the versions."""
    if source:
        changed = "".join(f"# --set {override}\n" for override in source.overrides)
        yield f"<h2>Scene</h2><pre>{escape(changed + source.text)}</pre>"
    if found:
        versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
        yield f'<p class="note">{escape(found["units"])}. {escape(versions)}.</p>'


def _words(name: str) -> str:
    """time_history -> Time history."""
    known = {"psd": "Power spectral densities", "response_spectrum": "Response spectra"}
    return known.get(name, name.replace("_", " ").capitalize())
