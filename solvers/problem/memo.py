"""Values computed once and kept: by key, up to a number of bytes, the same for all threads."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any

_SMALL = 1024  # bytes a value counts that does not tell its size


class Memo:
    """Values by key; beyond ``most`` bytes those not used for longest are let go, but never the last one.

    A key names everything its value depends on besides the owner of the memo. Between threads the first value stored
    under a key is the one that all get. A copy, also in another process, is empty: values may hold addresses of memory.

    Parameters
    ----------
    most : bytes. A value counts with its attribute ``nbytes``; tuples, lists and dicts with the sum of their entries.

    Examples
    --------
    >>> squares = Memo()
    >>> squares.get(("square", 3), lambda: 9)
    9
    >>> squares.find(("square", 4)) is None
    True
    """

    def __init__(self, most: int = 1 << 28) -> None:
        self.most, self.size = most, 0
        self._entries: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._lock = Lock()

    def find(self, key: Hashable) -> Any:
        """The value of a key, None if there is none."""
        with self._lock:
            entry = self._entries.get(key)
            if entry is None:
                return None
            self._entries.move_to_end(key)
            return entry[0]

    def store(self, key: Hashable, value: Any) -> Any:
        """Keep a value, not None, unless another thread has stored one meanwhile; returns the one kept."""
        size = _bytes(value)
        with self._lock:
            if key not in self._entries:
                self._entries[key] = value, size
                self.size += size
            self._entries.move_to_end(key)
            found = self._entries[key][0]
            while self.size > self.most and len(self._entries) > 1:
                self.size -= self._entries.popitem(last=False)[1][1]
            return found

    def get(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """The value of a key, made if need be. No lock is held meanwhile: two threads may both make it."""
        found = self.find(key)
        return self.store(key, make()) if found is None else found

    def __len__(self) -> int:
        return len(self._entries)

    def __reduce__(self) -> tuple[type[Memo], tuple[int]]:
        return Memo, (self.most,)


def _bytes(value: Any) -> int:
    """What a value counts."""
    if isinstance(value, dict):
        return _SMALL + sum(_bytes(item) for item in value.values())
    size = getattr(value, "nbytes", None)
    if size is not None:
        return int(size)
    return _SMALL + sum(_bytes(item) for item in value) if isinstance(value, tuple | list) else _SMALL
