"""What a signal must be to stand at its place: a motion or a load, a function of many times at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from fembeam.support import require


def require_load(signal: Any, unit: str, where: str) -> None:
    """Raise ValueError for samples of an acceleration as a force or moment: its value is their double integral."""
    integrated = getattr(signal, "quantity", None) == "acceleration" and getattr(signal, "order", 0) < 2
    rule = f"signal must hold samples of a load in {unit}, not of an acceleration, whose double integral would act"
    require(not integrated, rule, signal, where, "give quantity='force', or make it the base's motion")
    require_array_function(signal, "signal", where)


def require_motion(signal: Any, name: str, where: str) -> None:
    """Raise ValueError for samples of a force where a motion belongs."""
    is_load = getattr(signal, "quantity", None) == "force"
    require(not is_load, f"{name} must hold samples of a motion, not of a force", signal, where,
            "give quantity='displacement' or 'acceleration', or make it a PointForce")  # fmt: skip
    require_array_function(signal, name, where)


def require_array_function(function: Any, name: str, where: str, argument: str = "times") -> None:
    """Raise ValueError for a function that takes one number but no array, such as one that calls `math.sin`."""
    require(not isinstance(function, type), f"{name} must be a signal made with its values", function, where,
            "write Harmonic(amplitude, omega) or so")  # fmt: skip
    if hasattr(function, "tones") or hasattr(function, "nodes"):
        return
    try:
        function(np.zeros(2))
    except (TypeError, ValueError) as error:
        try:
            function(0.0)
        except Exception:
            return
        raise ValueError(f"{name} must take an array of {argument}, got {type(error).__name__} ({error}) for two of "
                         f"them in {where}; write np.sin for math.sin, np.where for if") from error  # fmt: skip
