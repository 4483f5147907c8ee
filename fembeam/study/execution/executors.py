"""One function over many items: here in turn, or on the user's executor.

Any `concurrent.futures.Executor` will do: threads, processes, `dask.distributed.Client.get_executor()`,
`mpi4py.futures.MPIPoolExecutor`. Results come in the order of the items, whichever is ready first.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, as_completed
from itertools import chain
from threading import current_thread, main_thread
from typing import Any, TypeVar

from fembeam.support import counting, interrupts, require, warn
from solvers.problem.whole_runs import whole_runs

Item = TypeVar("Item")
Result = TypeVar("Result")
_SAID: dict[Any, Any] = {}  # warnings of a user's code that this process has shown


def spread(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    executor: Executor | None = None,
    progress: str | None = None,
    seen: Callable[[int, Result], None] | None = None,
) -> list[Result]:
    """[function(item) for item in items], on an executor if one is given.

    Parameters
    ----------
    function : of one item; for processes and clusters it and the items must be picklable (no lambdas).
    items : any iterable; it is read once.
    executor : any `concurrent.futures.Executor`, left open; None: here, one after the other.
    progress : label of a bar over the items, shown only on a terminal; None: no bar.
    seen : called here with (index, result) as each result arrives, in any order: for checkpoints.

    Returns
    -------
    Results in the order of the items.

    Raises
    ------
    Exception : the first error, with a note that names its item; what has not begun yet is cancelled.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(2) as pool:
    ...     spread(abs, [-3, 2, -1], pool)
    [3, 2, 1]
    """
    require(executor is None or hasattr(executor, "submit"), "executor must be one of concurrent.futures", executor,
            "study", "e.g. ProcessPoolExecutor(4)")  # fmt: skip
    work = list(items)
    tell = seen or (lambda index, result: None)
    with counting(progress is not None, total=len(work), desc=progress) as bar:
        if executor is None:
            results = []
            for index, item in enumerate(work):
                results.append(_named(function, index, item))
                tell(index, results[-1])
                bar.update()
            return results
        here = os.getpid()
        futures = [executor.submit(_away, function, index, item, here) for index, item in enumerate(work)]
        places = {future: index for index, future in enumerate(futures)}
        try:
            for done in as_completed(futures):
                tell(places[done], done.result()[0])
                bar.update()
        except BaseException:
            for future in futures:
                future.cancel()
            raise
        for message in dict.fromkeys(chain.from_iterable(future.result()[1] for future in futures)):
            warn(message)
        return [future.result()[0] for future in futures]


def _away(function: Callable[[Item], Result], index: int, item: Item, caller: int) -> tuple[Result, list[str]]:
    """The result, and what another process than the caller's warned of, which knows no line of a user to name.

    Threads share the caller's warnings already, and those of one process may not collect theirs at the same time.
    """
    if os.getpid() == caller or current_thread() is not main_thread():
        return _named(function, index, item), []
    with warnings.catch_warnings(record=True) as found:
        result = _named(function, index, item)
    for one in found:
        if one.category is not UserWarning:  # of a user's own code: its line tells more
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno, registry=_SAID)
    return result, [str(one.message) for one in found if one.category is UserWarning]


def _named(function: Callable[[Item], Result], index: int, item: Item) -> Result:
    """function(item); an error learns which item it was."""
    try:
        with whole_runs():
            interrupts.check_ended()
            return function(item)
    except Exception as error:
        error.add_note(f"item {index}: {item!r}"[:200])
        raise
