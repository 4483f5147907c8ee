"""Whether Ctrl-C within a run leaves a partial run, or ends what is made of several."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_WHOLE = ContextVar("whole runs", default=False)


@contextmanager
def whole_runs() -> Iterator[None]:
    """Ctrl-C within a run raises KeyboardInterrupt here, where a partial run would be taken for a whole one.

    Examples
    --------
    >>> with whole_runs():
    ...     must_be_whole()
    True
    >>> must_be_whole()
    False
    """
    before = _WHOLE.set(True)
    try:
        yield
    finally:
        _WHOLE.reset(before)


def must_be_whole() -> bool:
    """Whether partial runs are of no use."""
    return _WHOLE.get()
