"""Tables of pandas, for those who have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any


def dataframe(columns: Mapping[str, Any] | Sequence[Mapping[str, Any]], index: Any = None) -> Any:
    """A pandas DataFrame of columns by name, or of rows; ImportError in words where pandas is missing."""
    return optional("pandas", "a data frame").DataFrame(columns, index=index)


def optional(package: str, wanted: str) -> Any:
    """A package that is no requirement, or an ImportError that says how to get it."""
    from importlib import import_module

    try:
        return import_module(package)
    except ImportError as error:
        raise ImportError(f"{wanted} needs {package}, which is optional: pip install {package}") from error


class Columns:
    """Base of the frozen dataclasses whose fields are the columns of a table."""

    def arrays(self) -> dict[str, Any]:
        """All columns by name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    def to_dataframe(self) -> Any:
        """A table of pandas, one entry of the arrays a row, in SI units; ImportError where pandas is missing."""
        return dataframe(self.arrays())
