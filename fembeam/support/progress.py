"""Progress bars: on terminals and in notebooks, silent elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from fembeam.support.checks import require

WHERE = "a run or study"
SIMULATED = "{percentage:3.0f}%|{bar}| {n:.4g}/{total:.4g} s simulated [{elapsed}<{remaining}]"


def _check(wanted: Any) -> None:
    """ValueError for text, which counts as true."""
    require(not isinstance(wanted, str), "progress must be True or False", wanted, WHERE, "without quotes")


@contextmanager
def bar(duration: float, wanted: bool) -> Iterator[Callable[[float], None]]:
    """A progress bar over simulated seconds; where signals that waited are handled."""
    from fembeam.support import interrupts

    _check(wanted)
    if not wanted:
        yield lambda _: interrupts.check()
        return
    with counting(True, total=duration, bar_format=SIMULATED) as shown:

        def report(t: float) -> None:
            shown.update(t - shown.n)
            interrupts.check()

        yield report


def titled(wanted: bool, title: str) -> str | None:
    """The name of a bar that is shown elsewhere, None for no bar."""
    _check(wanted)
    return title if wanted else None


def counting(wanted: bool, *items: Any, **options: Any) -> Any:
    """The bar of tqdm, with its arguments: of widgets in a notebook that has them, else of text."""
    _check(wanted)
    if not wanted:
        from tqdm import tqdm

        return tqdm(*items, disable=True, **options)
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a notebook without widgets: a bar of text does as well
        from tqdm.auto import tqdm as shown
    return shown(*items, disable=False if _in_notebook() else None, **options)  # None: silent unless on a terminal


def _in_notebook() -> bool:
    """Whether a kernel shows what is written, though it is no terminal."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return getattr(shell, "kernel", None) is not None
