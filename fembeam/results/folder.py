"""The record of a result folder: which studies are done, of which scene, in which files.

The record is rewritten whole after every study. With it a run can go on, and a report shows one scene's results only.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fembeam import __version__
from fembeam.results.files import write_json

if TYPE_CHECKING:
    from fembeam.scene_file import SceneFile

RECORD = "studies.json"


def digest(file: SceneFile, study: str) -> str:
    """Tells scenes apart for one study: its tables after overrides, the files that it names, the version."""
    others = set(file.studies) - {study}
    tables = {name: table for name, table in file.source.tables().items() if name not in others}
    about = json.dumps([__version__, tables], sort_keys=True, default=str)
    found = hashlib.sha256(about.encode())
    for name, content in sorted(file.source.files.items()):
        found.update(f"{name} {len(content)} ".encode() + content)
    return found.hexdigest()[:16]


def finished(folder: Path) -> dict[str, dict[str, Any]]:
    """{study: {"scene": digest, "files": names}} of what a folder holds; ValueError when the record is damaged."""
    path = folder / RECORD
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return {
            name: {"scene": str(one["scene"]), "files": [str(f) for f in one["files"]]} for name, one in found.items()
        }
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise ValueError(f"{path} is damaged: {error!r}; delete it, and all studies are computed again") from None


def kept(folder: Path, study: str, scene: str) -> list[Path]:
    """Files of a study that is finished for this scene; none when it must be computed."""
    one = finished(folder).get(study, {"scene": "", "files": []})
    files = [folder / name for name in one["files"]]
    return files if one["scene"] == scene and all(path.is_file() for path in files) else []


def record(folder: Path, study: str, scene: str, files: Sequence[Path]) -> None:
    """Note that a study is finished; with no files that it is not."""
    found = {name: one for name, one in finished(folder).items() if name != study}
    if files:
        found[study] = {"scene": scene, "files": [path.name for path in files]}
    if found or (folder / RECORD).exists():
        write_json(folder / RECORD, found)
