"""Studies: many runs spread over executors, mode counts, smallest models."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import pytest

from fembeam.study.executors import spread


def shifted(x):
    if x == 13:
        raise ValueError("thirteen")
    return x + 1


@pytest.mark.parametrize("pool", [None, ThreadPoolExecutor, ProcessPoolExecutor])
def test_spread_keeps_the_order(pool):
    items = range(20, 9, -1)
    options = {"mp_context": get_context("forkserver")} if pool is ProcessPoolExecutor else {}
    executor = pool(2, **options) if pool else None
    try:
        assert spread(shifted, iter(range(5, -1, -1)), executor) == [6, 5, 4, 3, 2, 1]
        with pytest.raises(ValueError, match="thirteen") as error:
            spread(shifted, items, executor)
        assert "item 7: 13" in error.value.__notes__
    finally:
        if executor:
            executor.shutdown()
