"""A progress bar over simulated time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def bar(duration: float, wanted: bool) -> Iterator[Callable[[float], None]]:
    """A progress bar over simulated seconds, silent when not on a terminal; the moment at which signals are heard."""
    from fembeam.support import interrupts

    if not wanted:
        yield lambda _: interrupts.check()
        return
    from tqdm import tqdm

    shape = "{percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} s simulated [{elapsed}<{remaining}]"
    with tqdm(total=duration, disable=None, bar_format=shape) as shown:

        def report(t: float) -> None:
            shown.update(t - shown.n)
            interrupts.check()

        yield report
