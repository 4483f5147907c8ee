"""Functions written once for both kinds of runs: compiled on decoupled modes, plain Python on matrices."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from solvers.compiled.kernels import merged


class shared:  # noqa: N801  a decorator
    """Decorator of functions that are `merged` into a compiled caller, and run as Python when called from Python.

    Functions passed to them are called directly in both. What they call must be shared or a `kernel`, except what only
    runs on decoupled modes reach.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func, self.merged = function, merged(function)
        self.targetoptions, self._numba_type_ = self.merged.targetoptions, self.merged._numba_type_  # which numba reads
        self.__doc__ = function.__doc__

    def __call__(self, *arguments: Any) -> Any:
        """Call the function as Python."""
        return self.py_func(*arguments)
