"""Finished realisations in one file that is written whole, so that a study goes on where it was interrupted."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.excitation import BandNoise
from fembeam.model import Model
from fembeam.run import written_whole
from fembeam.signals import signals_of
from fembeam.study.realisation import seed_key

FORMAT = 1
Values = dict[str, NDArray[Any]]


class Checkpoint:
    """Values by seed, kept in memory and, with a path, in a file.

    Parameters
    ----------
    path : the file; None keeps nothing. One that exists is read.
    about : what the values belong to, name -> text. A file about something else is refused.
    """

    def __init__(self, path: str | os.PathLike[str] | None, about: Mapping[str, str]) -> None:
        self.path, self.about = None if path is None else Path(path), dict(about)
        self.values: dict[str, Values] = {}
        if self.path is not None and self.path.exists():
            self.values = self._read(self.path)
        elif self.path is not None and not self.path.parent.is_dir():
            raise ValueError(f"checkpoint: the folder {self.path.parent} does not exist; make it first")

    def add(self, key: str, values: Values) -> None:
        """Keep the values of one more seed."""
        self.values[key] = values
        if self.path is None:
            return
        about = {"format": FORMAT, "about": self.about, "seeds": list(self.values)}
        stacked = {f"value {name}": np.stack([v[name] for v in self.values.values()]) for name in values}
        with written_whole(self.path) as file:
            np.savez(file, header=json.dumps(about), **stacked)  # type: ignore[arg-type]

    def _read(self, path: Path) -> dict[str, Values]:
        """The values in a file, after it has been checked."""
        try:
            with np.load(path, allow_pickle=False) as data:
                header = json.loads(str(data["header"]))
                columns = {name.removeprefix("value "): data[name] for name in data.files if name != "header"}
            seeds = {key: {name: c[i] for name, c in columns.items()} for i, key in enumerate(header["seeds"])}
            known = header["format"], header["about"]
        except Exception as error:
            raise ValueError(f"{path} is not a checkpoint, or is damaged: {error}; delete it to begin anew") from error
        if known[0] != FORMAT:
            raise ValueError(f"checkpoint {path} has format {known[0]}, this version reads {FORMAT}; delete it")
        self._compare(path, known[1])
        return seeds

    def _compare(self, path: Path, theirs: Mapping[str, str]) -> None:
        """Refuse values of something else, saying what differs."""
        names = sorted({*theirs, *self.about})
        differing = [name for name in names if theirs.get(name) != self.about.get(name)]
        if differing:
            pairs = [f"{n} is {_short(theirs.get(n))} there and {_short(self.about.get(n))} here" for n in differing]
            raise ValueError(f"checkpoint {path} belongs to another study: {'; '.join(pairs)}; give another path")


def identity(model: Model, quantity: Callable[..., Any]) -> dict[str, str]:
    """What an ensemble's values depend on besides the seed, as texts that can be compared.

    Noise is told by its density, not by its seed; the quantity by its name, arguments and code.
    """
    scene, signals = model.scene, signals_of(model.scene)
    about = {f.name: repr(getattr(scene, f.name)) for f in fields(scene)}
    for path, signal in signals.items():
        about = {name: text.replace(repr(signal), path) for name, text in about.items()}
    about |= {path: _signal(signal) for path, signal in signals.items()}
    about |= {"modes": repr(model.modes), "frequencies": _digest(model.omega)}
    seeds = [seed_key(signal.seed) for signal in signals.values() if hasattr(signal, "seed")]
    about["noises"] = repr([seeds.index(seed) for seed in seeds])  # which of them are one realisation
    return about | {"quantity": _function(quantity)}


def _signal(signal: Any) -> str:
    """A signal without its realisation."""
    if isinstance(signal, BandNoise):
        grid = np.linspace(*signal.band, 257)
        period = signal.period if signal.period_was_given else None
        about = f"std={signal.std!r}, mean={signal.mean!r}, band={signal.band}, period={period}, order={signal.order}"
        return f"BandNoise({about}, density {_digest(signal.psd_at(grid))})"
    if hasattr(signal, "y"):
        return f"{signal!r} {_digest(signal.y)}"
    return repr(signal)


def _function(function: Any) -> str:
    """A callable by its name, arguments and code, stable from process to process."""
    if isinstance(function, partial):
        inner = [_function(function.func), *map(_argument, function.args)]
        return ", ".join(inner + [f"{k}={_argument(v)}" for k, v in sorted(function.keywords.items())])
    name = f"{getattr(function, '__module__', '')}.{getattr(function, '__qualname__', type(function).__qualname__)}"
    code = getattr(function, "__code__", None)
    return name if code is None else f"{name} {_code(code)}"


def _argument(value: Any) -> str:
    """An argument of a partial."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_argument(entry)}" for key, entry in value.items()) + "}"
    return _function(value) if callable(value) else repr(value)


def _code(code: CodeType) -> str:
    """Digest of byte code and constants."""
    inner = [_code(c) if isinstance(c, CodeType) else repr(c) for c in code.co_consts]
    return hashlib.sha256(code.co_code + repr((inner, code.co_names)).encode()).hexdigest()[:12]


def _digest(values: Any) -> str:
    """Digest of numbers."""
    return hashlib.sha256(np.ascontiguousarray(values, dtype=np.float64).tobytes()).hexdigest()[:12]


def _short(text: str | None) -> str:
    """A text shortened for a message."""
    if text is None:
        return "not there"
    return text if len(text) <= 160 else f"{text[:80]}…{text[-78:]}"
