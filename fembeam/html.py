"""One self-contained page per result folder: what was found, how sure it is, figures, settings, warnings.

Figures are embedded, so that the one file can be sent by mail; it needs no network and reads on a phone.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam.run import written_whole

if TYPE_CHECKING:
    from fembeam.source import Source

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 60rem; margin: auto;
  padding: 1rem }
h1 { font-size: 1.5rem; margin: 0 } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc }
.wide { overflow-x: auto } table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { text-align: right; padding: .15rem .6rem; border-bottom: 1px solid #eee; white-space: nowrap }
th:first-child, td:first-child { text-align: left; padding-left: 0 } th { font-weight: 600 }
img { max-width: 100%; height: auto } figure { margin: 1rem 0 } figcaption { color: #555; font-size: .9rem }
pre { overflow-x: auto; background: #f6f6f6; padding: .75rem; font-size: .85rem; line-height: 1.4 }
.good { color: #00664a } .bad { color: #a83c00; font-weight: 600 } .note { color: #555; font-size: .9rem }
"""
ORDER = ("time_history", "psd", "densities", "contacts", "modes")


def write_page(folder: str | Path, source: Source | None = None, warnings: Sequence[str] = ()) -> Path:
    """Write `report.html` from the tables and figures in a result folder.

    Parameters
    ----------
    folder : as `fembeam run` leaves it.
    source : the scene file. warnings : said while computing.
    """
    folder = Path(folder)
    title = source.path.stem.replace("_", " ") if source else folder.resolve().name
    body = "\n".join([f"<h1>{escape(title)}</h1>", *_sections(folder, source, warnings)])
    with written_whole(folder / "report.html") as file:
        file.write(page(title, body).encode())
    return folder / "report.html"


def page(title: str, body: str) -> str:
    """A whole document."""
    phone = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    head = f'<meta charset="utf-8">{phone}<title>{escape(title)}</title>'
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head>{head}<style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n'
    )


def _sections(folder: Path, source: Source | None, warnings: Sequence[str]) -> Iterator[str]:
    """The page from top to bottom."""
    found = _json(folder / "summary.json")
    if found:
        yield _status(found)
    if warnings:
        yield "<h2>Warnings</h2><ul>" + "".join(f'<li class="bad">{escape(said)}</li>' for said in warnings) + "</ul>"
    if found:
        yield from _simulation(found)
    for path in sorted(folder.glob("*.txt")):
        yield f"<h2>{escape(_words(path.stem))}</h2><pre>{escape(path.read_text(encoding='utf-8'))}</pre>"
    ensemble = _json(folder / "ensemble.json")
    if ensemble:
        rows = [[name, e["mean"], e["standard_error"]] for name, e in ensemble["numbers"].items()]
        yield f"<h2>Ensemble of {ensemble['realisations']} realisations</h2>" + table(["", "mean", "± s.e."], rows)
    yield from _figures(folder)
    yield from _settings(found, source)


def _json(path: Path) -> dict[str, Any]:
    """A JSON file; {} when there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def _status(found: dict[str, Any]) -> str:
    """How the run ended."""
    kind = "good" if found["complete"] else "bad"
    cost, seconds = found["cost"], found["simulated_seconds"]
    about = f"{seconds:g} s simulated in {found['wall_seconds']:.3g} s, {cost['events']} events, {cost['steps']} steps"
    return f'<p><span class="{kind}">{escape(found["status"])}</span><br><span class="note">{about}</span></p>'


def _simulation(found: dict[str, Any]) -> Iterator[str]:
    """Tables of [simulate]."""
    if found["omega"]:
        rows = [
            [i + 1, w, w / 6.283185307179586, z]
            for i, (w, z) in enumerate(zip(found["omega"], found["zeta"], strict=True))
        ]
        yield "<h2>Model</h2>" + table(["coordinate", "ω / rad s⁻¹", "Hz", "ζ"], rows)
    if found["moments"]:
        keys = ("mean", "std", "std_error", "skewness", "kurtosis", "min", "max")
        head = ["", "mean / m", "std / m", "± s.e.", "skewness", "kurtosis", "min / m", "max / m"]
        yield "<h2>Response</h2>" + table(
            head, [[name, *(row.get(k) for k in keys)] for name, row in found["moments"].items()]
        )
        yield f'<p class="note">{escape(found["confidence"])}</p>'
    if found["contacts"]:
        head = [
            "stop",
            "at z / m",
            "number",
            "per second",
            "± s.e.",
            "mean time / s",
            "mean peak / N",
            "largest peak / N",
            "mean entry / m s⁻¹",
        ]
        yield "<h2>Contacts</h2>" + table(head, [_contact(row) for row in found["contacts"]])
    if found["energy"]:
        names = {"input": "put in", "damping": "lost in damping", "contact": "lost in contacts", "stored": "stored"}
        rows = [[words, found["energy"][name]] for name, words in names.items()]
        residual = found["energy"]["residual_over_input"]
        yield "<h2>Energy</h2>" + table(["", "J"], rows)
        yield f'<p class="note">Missing in this balance, an estimate of the error: {residual:.1e} of the input.</p>'


def _contact(row: dict[str, Any]) -> list[Any]:
    """One stop."""
    mean = {name: row.get(name, {}).get("mean") for name in ("duration", "peak_force", "entry_speed")}
    largest = row.get("peak_force", {}).get("max")
    return [
        row["stop"],
        row["z"],
        row["number"],
        row["rate"],
        row.get("rate_error"),
        mean["duration"],
        mean["peak_force"],
        largest,
        mean["entry_speed"],
    ]


def _figures(folder: Path) -> Iterator[str]:
    """All figures of the folder, embedded."""
    paths = sorted(folder.glob("*.png"), key=lambda p: (ORDER.index(p.stem) if p.stem in ORDER else len(ORDER), p.stem))
    if paths:
        yield "<h2>Figures</h2>"
    for path in paths:
        data, name = base64.b64encode(path.read_bytes()).decode(), escape(_words(path.stem))
        yield f'<figure><img src="data:image/png;base64,{data}" alt="{name}"><figcaption>{name}</figcaption></figure>'


def _settings(found: dict[str, Any], source: Source | None) -> Iterator[str]:
    """The scene and the versions."""
    if source:
        changed = "".join(f"# --set {override}\n" for override in source.overrides)
        yield f"<h2>Scene</h2><pre>{escape(changed + source.text)}</pre>"
    if found:
        versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
        yield f'<p class="note">{escape(found["units"])}. {escape(versions)}.</p>'


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    r"""A table that scrolls sideways where the screen is narrow.

    Examples
    --------
    >>> table(["", "m"], [["u & v", 0.1]])
    '<div class="wide"><table><tr><th></th><th>m</th></tr>\n<tr><td>u &amp; v</td><td>0.1</td></tr></table></div>'
    """
    lines = ["".join(f"<th>{escape(str(cell))}</th>" for cell in head)]
    lines += ["".join(f"<td>{escape(_cell(cell))}</td>" for cell in row) for row in rows]
    return '<div class="wide"><table>' + "\n".join(f"<tr>{line}</tr>" for line in lines) + "</table></div>"


def _cell(value: Any) -> str:
    """A value of a table."""
    return "–" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)


def _words(name: str) -> str:
    """time_history -> Time history."""
    known = {"psd": "Power spectral densities"}
    return known.get(name, name.replace("_", " ").capitalize())
