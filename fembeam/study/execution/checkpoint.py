"""Finished realisations in one file that is written whole, so that a study continues where it was interrupted."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.model import Model
from fembeam.scene import Scene
from fembeam.study.realisations import renewed
from fembeam.support import changes, one_at_a_time, require, written_whole
from fembeam.support.fingerprint import fingerprint

FORMAT = 2
EVERY = 5.0  # s between two times a file is written
Values = dict[str, NDArray[Any]]


class Checkpoint:
    """Values by seed, kept in memory and, with a path, in a file.

    It is written with the first value, then every `EVERY` seconds at most, and at the end of ``with``, whatever ends
    that. Several processes may keep values of one study in one file: each adds to it what the others have kept.

    Parameters
    ----------
    path : the file; None keeps nothing. One that exists is read.
    about : function that tells what the values belong to, name -> text; where this ends in "#" and a digest, that
        decides. A file about something else is refused. Without a path it is not asked.
    """

    def __init__(self, path: str | os.PathLike[str] | None, about: Callable[[], dict[str, str]] = dict) -> None:
        right = path is None or (isinstance(path, (str, os.PathLike)) and path != "" and not Path(path).is_dir())
        require(right, "checkpoint must be the path of a file", path, "study", 'e.g. "kept.npz"')
        self.path = None if path is None else Path(path)
        self.about = {} if path is None else about()
        self.values: dict[str, Values] = {}
        self.seen: tuple[int, ...] = ()
        self.written, self.complete = -math.inf, True
        if self.path is None:
            return
        if not self.path.parent.is_dir():
            raise ValueError(f"checkpoint: the folder {self.path.parent} does not exist; make it first")
        if not (self.path.exists() or os.access(self.path.parent, os.W_OK)):
            raise ValueError(f"checkpoint: the folder {self.path.parent} cannot be written to; choose another place")
        self._take(self.path)

    def add(self, key: str, values: Values) -> None:
        """Keep the values of one more seed, as they are now."""
        self.values[key] = {name: np.array(value) for name, value in values.items()}
        self.complete = self.path is None
        if not self.complete and monotonic() - self.written > EVERY:
            self._write()

    def __enter__(self) -> Checkpoint:
        return self

    def __exit__(self, *_: object) -> None:
        if not self.complete:
            self._write()

    def _write(self) -> None:
        """Write all that is known, and what other processes have written."""
        assert self.path is not None
        with one_at_a_time(self.path.parent):
            self._take(self.path)
            self._put(self.path)
            self.seen = _state_of(self.path)
        self.written, self.complete = monotonic(), True

    def _take(self, path: Path) -> None:
        """Take over what the file holds, if it is not as this one has seen it last."""
        state = _state_of(path)
        if state not in ((), self.seen):
            self.values = self._read(path) | self.values
        self.seen = state

    def _put(self, path: Path) -> None:
        """Write all values, which have the same names."""
        values = next(iter(self.values.values()))
        about = {"format": FORMAT, "about": self.about, "seeds": list(self.values), "values": list(values)}
        stacked = {f"value {name}": np.stack([v[name] for v in self.values.values()]) for name in values}
        with written_whole(path) as file:
            np.savez(file, header=json.dumps(about), **stacked)  # type: ignore[arg-type]

    def _read(self, path: Path) -> dict[str, Values]:
        """The values in a file, after it has been checked."""
        try:
            with np.load(path, allow_pickle=False) as data:
                header = json.loads(str(data["header"]))
                columns = {name.removeprefix("value "): data[name] for name in data.files if name != "header"}
            if missing := {*header.get("values", ())} - {*columns}:  # a byte of the archive's list hides the next one
                raise ValueError(f"it has lost {', '.join(sorted(missing))}")
            seeds = {key: {name: c[i] for name, c in columns.items()} for i, key in enumerate(header["seeds"])}
            known = header["format"], header["about"]
        except Exception as error:
            raise ValueError(f"{path} is not a checkpoint, or is damaged: {error}; delete it to begin anew, or choose "
                             "another place") from error  # fmt: skip
        if known[0] != FORMAT:
            raise ValueError(f"checkpoint {path} has format {known[0]}, this version reads {FORMAT}; delete it")
        self._compare(path, known[1])
        return seeds

    def _compare(self, path: Path, theirs: Mapping[str, str]) -> None:
        """Refuse values of something else, saying what differs."""
        names = sorted({*theirs, *self.about})
        differing = [name for name in names if _deciding(theirs.get(name)) != _deciding(self.about.get(name))]
        if differing:
            named = [name for name in differing if name != "frequencies"] or differing  # they follow from the others
            pairs = [_difference(name, theirs.get(name), self.about.get(name)) for name in named]
            said = [one for one, seen in pairs if seen] or [one for one, _ in pairs]
            raise ValueError(f"checkpoint {path} belongs to another study: {'; '.join(said)}; set it back, "
                             "delete the file to begin anew, or choose another place")  # fmt: skip


def _state_of(path: Path) -> tuple[int, ...]:
    """What changes when a file is written; empty when there is none."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return ()
    return found.st_ino, found.st_mtime_ns, found.st_size


def identity(model: Model, quantity: Callable[..., Any]) -> dict[str, str]:
    """What an ensemble's values depend on besides the seed, as texts that can be compared.

    That is all the scene and the quantity consist of: numbers, and of functions (a law's, a signal's, the quantity)
    code, constants, defaults, closure and the globals read; and fembeam's version. Which noises are one realisation
    counts, their seeds do not.

    Raises
    ------
    ValueError : something the quantity or the scene reads cannot be told from another of its kind.
    """
    asked = digested(quantity, "the quantity", _name(quantity))
    return model_identity(renewed(model, lambda j, _: j)) | {"quantity": asked}


def model_identity(model: Model) -> dict[str, str]:
    """The same of a model: its scene, seeds among it, and its modes."""
    return scene_identity(model.scene) | {
        "modes": repr(model.modes),
        "frequencies": digested(model.omega, "frequencies", f"[{', '.join(f'{w:.6g}' for w in model.omega)}]"),
    }


def study_identity(model: Model, **asked: Any) -> dict[str, str]:
    """The same of a model and of what a study was asked, by name."""
    return model_identity(model) | {name: digested(value, name) for name, value in asked.items()}


def scene_identity(scene: Scene | Callable[..., Scene]) -> dict[str, str]:
    """All that a scene, or a function that makes scenes, consists of, and fembeam's version, as `identity` has them."""
    from fembeam import __version__

    parts = [f.name for f in fields(scene)] if is_dataclass(scene) else []
    about = {name: digested(getattr(scene, name), name) for name in parts} or {"scene": digested(scene, "scene")}
    return about | {"fembeam": __version__}


def digested(value: Any, name: str, text: str | None = None) -> str:
    """A part of a scene or study as text to be read, its `repr` if none is given, then its digest to be compared."""
    readable = re.sub(" at 0x[0-9a-f]+", "", repr(value) if text is None else text).replace(" #", " ")
    return f"{readable} #{fingerprint(value, name)}"


def _name(quantity: Any) -> str:
    """A callable by its name, with the arguments that it is given already."""
    if isinstance(quantity, partial):
        given = [*map(repr, quantity.args), *(f"{key}={one!r}" for key, one in quantity.keywords.items())]
        return f"{_name(quantity.func)}({', '.join(given)})"
    return f"{getattr(quantity, '__module__', '')}.{getattr(quantity, '__qualname__', type(quantity).__qualname__)}"


def _deciding(text: str | None) -> str | None:
    """The digest at the end of a text, else the text."""
    return None if text is None else text.partition(" #")[2] or text


def _difference(name: str, theirs: str | None, ours: str | None) -> tuple[str, bool]:
    """What differs, and whether its text shows it."""
    readable = [None if text is None else text.partition(" #")[0] for text in (theirs, ours)]
    said = changes(readable[0] or "nothing", readable[1] or "nothing", name)
    unseen = f"{name} {_short(readable[1])} has other code, or reads other values, than there"
    return said or unseen, bool(said)


def _short(text: str | None) -> str:
    """A text shortened for a message."""
    text = str(text)
    return text if len(text) <= 160 else f"{text[:80]}…{text[-78:]}"
