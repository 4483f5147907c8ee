"""The record of a result folder: which studies are done, of which scene, in which files.

The record is rewritten whole before and after every study. With it a run can go on, and a report shows one scene's
results only.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam import __version__
from fembeam.results.files import write_json
from fembeam.support import changes

if TYPE_CHECKING:
    from fembeam.scene_file import SceneFile

RECORD = "studies.json"


def digest(file: SceneFile, study: str) -> str:
    """Tells scenes apart for one study: its tables after overrides, the files that it names, the version."""
    about = json.dumps([__version__, _tables(file, study)], sort_keys=True, default=str)
    found = hashlib.sha256(about.encode())
    for name, content in sorted(file.source.files.items()):
        found.update(f"{name} {len(content)} ".encode() + content)
    return found.hexdigest()[:16]


def _tables(file: SceneFile, study: str) -> dict[str, Any]:
    """The scene and one study of a file, after overrides."""
    others = set(file.studies) - {study}
    return {name: table for name, table in file.source.tables().items() if name not in others}


def changed(folder: Path, file: SceneFile, study: str) -> str:
    """What is another scene than that of which a folder holds a study, begun or finished; "" where nothing is known.

    The study's own table is left out: whether it may grow, as by more realisations, the study knows.
    """
    there = finished(folder).get(study, {}).get("tables", "")
    here = {name: table for name, table in _tables(file, study).items() if name != study}
    return changes(there, repr(here)) if there else ""


def finished(folder: Path) -> dict[str, dict[str, Any]]:
    """{study: {"scene": digest, "files": names, "tables": of the scene, "warnings": said}} of a folder.

    A study that was begun has no files yet. ValueError when the record is damaged.
    """
    path = folder / RECORD
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return {
            name: {"scene": str(one["scene"]), "tables": str(one["tables"])}
            | {kind: [str(each) for each in one.get(kind, [])] for kind in ("files", "warnings")}
            for name, one in found.items()
        }
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise ValueError(f"{path} is damaged: {error!r}; delete it, and all studies are computed again") from None


def kept(folder: Path, study: str, scene: str) -> list[Path]:
    """Files of a study that is finished for this scene; none when it must be computed."""
    one = finished(folder).get(study, {"scene": "", "files": []})
    files = [folder / name for name in one["files"]]
    return files if one["scene"] == scene and all(path.is_file() for path in files) else []


def record(folder: Path, file: SceneFile, study: str, files: Sequence[Path] = (), warnings: Sequence[str] = ()) -> None:
    """Note that a study is finished, with its files and what it warned of, or begun.

    A checkpoint stays with the scene that began it.
    """
    found = finished(folder)
    begun = found.get(study, {}).get("tables") if not files and (folder / f"{study}.npz").exists() else None
    tables = {name: table for name, table in _tables(file, study).items() if name != study}
    found[study] = {
        "scene": digest(file, study),
        "files": [path.name for path in files],
        "tables": begun or repr(tables),
        "warnings": list(warnings),
    }
    write_json(folder / RECORD, found)
