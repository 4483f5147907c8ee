"""What signals without an end share."""

from __future__ import annotations

from typing import Self


class Unlimited:
    """A signal defined for all times."""

    def for_duration(self, duration: float) -> Self:
        """The signal itself, which serves a run of any length."""
        return self
