"""What the library tells of its work: `logging` under the name fembeam, at level INFO, silent unless asked for."""

from __future__ import annotations


def note(message: str, *values: object) -> None:
    """Tell whoever listens; values are formatted only then."""
    import logging

    logging.getLogger("fembeam").info(message, *values)
