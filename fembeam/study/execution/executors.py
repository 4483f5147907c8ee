"""One function over many items: here in turn, or on the user's executor.

Any `concurrent.futures.Executor` will do: threads, processes, `dask.distributed.Client.get_executor()`,
`mpi4py.futures.MPIPoolExecutor`. Results come in the order of the items, whichever is ready first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Executor, as_completed
from typing import TypeVar

from fembeam.support import counting, interrupts, require
from solvers.problem.whole_runs import whole_runs

Item = TypeVar("Item")
Result = TypeVar("Result")


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
        futures = [executor.submit(_named, function, index, item) for index, item in enumerate(work)]
        places = {future: index for index, future in enumerate(futures)}
        try:
            for done in as_completed(futures):
                tell(places[done], done.result())
                bar.update()
        except BaseException:
            for future in futures:
                future.cancel()
            raise
        return [future.result() for future in futures]


def _named(function: Callable[[Item], Result], index: int, item: Item) -> Result:
    """function(item); an error learns which item it was."""
    try:
        with whole_runs():
            interrupts.check_ended()
            return function(item)
    except Exception as error:
        error.add_note(f"item {index}: {item!r}"[:200])
        raise
