"""Tables of pandas, for those who have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np


def dataframe(columns: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> Any:
    """A pandas DataFrame of columns by name, or of rows; ImportError in words where pandas is missing."""
    return optional("pandas", "a data frame").DataFrame(columns)


def optional(package: str, wanted: str) -> Any:
    """A package that is no requirement, or an ImportError that says how to get it."""
    from importlib import import_module

    try:
        return import_module(package)
    except ImportError as error:
        raise ImportError(f"{wanted} needs {package}, which is optional: pip install {package}") from error


def columns_of(table: Any) -> list[str]:
    """Names of the columns of a table: its fields that are not keyword-only."""
    return [f.name for f in fields(table) if not f.kw_only]


class Columns:
    """Base of the frozen dataclasses whose fields are the columns of a table, the first one the index of a contact.

    Keyword-only fields are no columns.
    """

    names: tuple[str, ...]  # of all contacts, empty where one has none

    def __len__(self) -> int:
        return len(next(iter(self.arrays().values())))

    @property
    def name(self) -> Any:
        """What the contact of each row is called."""
        return named(self.names, next(iter(self.arrays().values())))

    def arrays(self) -> dict[str, Any]:
        """The columns of numbers by name."""
        return {name: getattr(self, name) for name in columns_of(self)}

    def named_arrays(self) -> dict[str, Any]:
        """The columns by name, that of what each contact is called after its index."""
        index, *others = self.arrays().items()
        return dict([index, ("name", self.name), *others])

    def to_dataframe(self) -> Any:
        """A table of pandas, one entry of the arrays a row, in SI units; ImportError where pandas is missing."""
        return dataframe(self.named_arrays())


def named(names: Sequence[str], contacts: Any) -> Any:
    """Names of contacts by index, an array; "stop 3" where there is none.

    Examples
    --------
    >>> named(["valve", ""], np.array([1, 0, 1])).tolist()
    ['stop 1', 'valve', 'stop 1']
    """
    count = max(len(names), int(np.max(contacts, initial=-1)) + 1)
    known = [name or f"stop {i}" for i, name in enumerate([*names, *[""] * (count - len(names))])]
    return np.array(known, dtype=object)[np.asarray(contacts, dtype=int)]
