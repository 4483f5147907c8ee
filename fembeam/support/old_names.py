"""Old names of attributes and methods, which work for one release and name the new one."""

from __future__ import annotations

import warnings
from typing import Any


class OldName:
    """The value of another attribute of the object; reading it is a DeprecationWarning."""

    def __init__(self, new: str) -> None:
        self.new, self.__doc__ = new, f"Old name of `{new}`."

    def __set_name__(self, owner: type, name: str) -> None:
        self.old = name

    def __get__(self, one: object, owner: type) -> Any:
        if one is None:
            return self
        of = type(one).__name__
        warnings.warn(f"{of}.{self.old} is now {of}.{self.new}", DeprecationWarning, stacklevel=2)
        return getattr(one, self.new)
