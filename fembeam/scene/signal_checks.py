"""What a signal must be to stand at its place: a motion or a load."""

from __future__ import annotations

from typing import Any

from fembeam.support import require


def require_load(signal: Any, unit: str, where: str) -> None:
    """Raise ValueError for samples of an acceleration as a force or moment: its value is their double integral."""
    integrated = getattr(signal, "quantity", None) == "acceleration" and getattr(signal, "order", 0) < 2
    rule = f"signal must hold samples of a load in {unit}, not of an acceleration, whose double integral would act"
    require(not integrated, rule, signal, where, "give quantity='force', or make it the base's motion")


def require_motion(signal: Any, name: str, where: str) -> None:
    """Raise ValueError for samples of a force where a motion belongs."""
    is_load = getattr(signal, "quantity", None) == "force"
    require(not is_load, f"{name} must hold samples of a motion, not of a force", signal, where,
            "give quantity='displacement' or 'acceleration', or make it a PointForce")  # fmt: skip
