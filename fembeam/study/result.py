"""What all studies find: numbers in a table, which prints, goes to pandas, CSV and JSON, and is drawn."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fembeam.model import Model, Run
from fembeam.support import Printed, file_path, write_rows
from solvers.problem import dataframe

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NUMBERS = (str, int, float, list, tuple, dict, np.ndarray, np.generic, type(None))


class Result(Printed, ABC):
    """What a study found; print it, or let a notebook show it."""

    INDEX: ClassVar[str] = ""  # the column that names the rows of a data frame

    @abstractmethod
    def table(self) -> list[dict[str, Any]]:
        """The numbers in SI units, a dictionary for each row."""

    @abstractmethod
    def figure(self) -> Figure:
        """A figure of it, made by `fembeam.plot`."""

    def _units(self) -> dict[str, str]:
        """Units of the table's columns, of those that have one."""
        return {}

    def to_dataframe(self) -> Any:
        """The table as one of pandas; ImportError without pandas."""
        frame = dataframe(self.table())
        return frame.set_index(self.INDEX) if self.INDEX else frame

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table as CSV, with units where they are known, whole or not at all."""
        write_rows(file_path(path, "save"), self.table(), self._units())

    def plain(self) -> dict[str, Any]:
        """What was found as JSON has it, without models, runs and functions."""
        found: dict[str, Any] = plain(self)
        return found


def with_units(names: Sequence[str], units: Sequence[str]) -> list[str]:
    """Names with units where there are any, as heads of tables."""
    return [f"{name} / {unit}" if unit else name for name, unit in zip(names, units or [""] * len(names), strict=True)]


def column(rows: str, name: str, doc: str) -> Any:
    """A property of a result: one number of each of its rows."""
    return property(lambda self: np.array([getattr(one, name) for one in getattr(self, rows)]), doc=doc)


def plain(value: Any) -> Any:
    """Dataclasses as dictionaries, arrays as lists."""
    if is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in fields(value) if f.init}
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items() if _telling(one)}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value if _telling(one)]
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def _telling(value: Any) -> bool:
    """Whether a value belongs into a table of results."""
    return isinstance(value, NUMBERS) or (is_dataclass(value) and not isinstance(value, (Run, Model)))
