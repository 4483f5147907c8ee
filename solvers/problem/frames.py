"""Tables of pandas, for those who have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
