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

from fembeam.scene import unit_of
from fembeam.support import html_table, written_whole

if TYPE_CHECKING:
    from fembeam.scene import Source

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff; max-width: 60rem; margin: auto;
  padding: 1rem }
h1, h2, p, li { overflow-wrap: anywhere }
h1 { font-size: 1.5rem; margin: 0 } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; border-bottom: 1px solid #ccc }
.wide { overflow-x: auto } table { border-collapse: collapse; font-variant-numeric: tabular-nums }
td { white-space: nowrap } th { vertical-align: bottom }
th, td { text-align: right; padding: .15rem .6rem; border-bottom: 1px solid #eee }
th:first-child, td:first-child { text-align: left; padding-left: 0 } th { font-weight: 600 }
img { max-width: 100%; height: auto } figure { margin: 1rem 0 } figcaption { color: #555; font-size: .9rem }
pre { overflow-x: auto; background: #f6f6f6; padding: .75rem; font-size: .85rem; line-height: 1.4 }
@media (max-width: 40rem) { body { padding: .75rem } figure img { max-width: none; width: 38rem }
  table { font-size: .85rem } th, td { padding: .15rem .4rem } }
.good { color: #00664a } .bad { color: #a83c00; font-weight: 600 } .note { color: #555; font-size: .9rem }
"""
CONTACT_ROWS = (
    ("at z / m", "z"),
    ("number", "number"),
    ("per second", "rate"),
    ("± s.e.", "rate_error"),
    ("mean time / s", "duration", "mean"),
    ("mean peak / {force}", "peak_force", "mean"),
    ("largest peak / {force}", "peak_force", "max"),
    ("mean entry / {speed}", "entry_speed", "mean"),
)
ORDER = ("time_history", "psd", "densities", "contacts", "modes")


def write_page(
    folder: str | Path,
    source: Source | None = None,
    warnings: Sequence[str] = (),
    files: Sequence[Path] | None = None,
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
    head = f'<meta charset="utf-8">{phone}<title>{escape(title)}</title>'
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head>{head}<style>{STYLE}</style></head>\n<body>\n{body}\n</body></html>\n'
    )


def _sections(files: Sequence[Path], source: Source | None, warnings: Sequence[str]) -> Iterator[str]:
    """The page from top to bottom."""
    found = next((_json(path) for path in files if path.name == "summary.json"), {})
    if found:
        yield _status(found)
    if warnings:
        yield "<h2>Warnings</h2><ul>" + "".join(f'<li class="bad">{escape(said)}</li>' for said in warnings) + "</ul>"
    if found:
        yield from _simulation(found)
    for path in files:
        if path.suffix == ".txt":
            yield f"<h2>{escape(_words(path.stem))}</h2><pre>{escape(path.read_text(encoding='utf-8'))}</pre>"
    yield from _figures(files)
    yield from _settings(found, source)


def _json(path: Path) -> dict[str, Any]:
    """A JSON file."""
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def _status(found: dict[str, Any]) -> str:
    """How the run ended."""
    kind = "good" if found["complete"] else "bad"
    cost, seconds = found["cost"], found["simulated_seconds"]
    about = f"{seconds:g} s simulated in {found['wall_seconds']:.3g} s, {cost['events']} events, {cost['steps']} steps"
    return f'<p><span class="{kind}">{escape(found["status"])}</span><br><span class="note">{about}</span></p>'


def _simulation(found: dict[str, Any]) -> Iterator[str]:
    """Tables of [simulate]."""
    rotations = found.get("rotations", [])
    if found["omega"]:
        rows = [
            [i + 1, w, w / 6.283185307179586, z]
            for i, (w, z) in enumerate(zip(found["omega"], found["zeta"], strict=True))
        ]
        yield "<h2>Model</h2>" + html_table(["coordinate", "ω / rad s⁻¹", "Hz", "ζ"], rows)
    if found["moments"]:
        m = unit_of("indentation", [False, *rotations])
        names = {"mean": f"mean / {m}", "std": f"std / {m}", "std_error": "± s.e.", "skewness": "skewness",
                 "kurtosis": "kurtosis", "min": f"min / {m}", "max": f"max / {m}"}  # fmt: skip
        rows = [[words, *(row.get(key) for row in found["moments"].values())] for key, words in names.items()]
        yield "<h2>Response</h2>" + html_table(["", *found["moments"]], rows)
        yield f'<p class="note">{escape(found["confidence"])}</p>'
    if found["contacts"]:
        force, speed = (unit_of(of, rotations).replace("/s", " s⁻¹") for of in ("force", "speed"))
        rows = [
            [words.format(force=force, speed=speed), *(_of_stop(row, *keys) for row in found["contacts"])]
            for words, *keys in CONTACT_ROWS
        ]
        stops = [row.get("name", f"stop {row['stop']}") for row in found["contacts"]]
        yield "<h2>Contacts</h2>" + html_table(["", *stops], rows)
    if found["energy"]:
        names = {"input": "put in", "damping": "lost in damping", "contact": "lost in contacts", "stored": "stored"}
        rows = [[words, found["energy"][name]] for name, words in names.items()]
        residual = found["energy"]["residual_over_input"]
        yield "<h2>Energy</h2>" + html_table(["", "J"], rows)
        yield f'<p class="note">Missing in this balance, an estimate of the error: {residual:.1e} of the input.</p>'


def _of_stop(row: dict[str, Any], key: str, part: str = "") -> Any:
    """One number of a stop."""
    return row.get(key, {}).get(part) if part else row.get(key)


def _figures(files: Sequence[Path]) -> Iterator[str]:
    """All figures, embedded."""
    figures = [path for path in files if path.suffix == ".png"]
    paths = sorted(figures, key=lambda p: (ORDER.index(p.stem) if p.stem in ORDER else len(ORDER), p.stem))
    if paths:
        yield "<h2>Figures</h2>"
    for path in paths:
        data, name = base64.b64encode(path.read_bytes()).decode(), escape(_words(path.stem))
        image = f'<div class="wide"><img src="data:image/png;base64,{data}" alt="{name}"></div>'
        yield f"<figure>{image}<figcaption>{name}</figcaption></figure>"


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
    known = {"psd": "Power spectral densities"}
    return known.get(name, name.replace("_", " ").capitalize())
