"""Other realisations of what a test or an example follows: other noise, and starts a rounding away.

    FEMBEAM_REALISATION=7 pytest -m chaotic

Every random number comes from `numpy.random.default_rng`, every run begins with `checked_start`: both are replaced.
A start is moved by 1e-13 of itself and of 1 mm or 1 mm/s, the same each time: little more than another rounding does.
After some twenty impacts a chaotic response is another one. `tests/bench/realisations.py` asks for many.

    FEMBEAM_REALISATION=7 python tests/realisation.py examples/basins.py       one example
"""

import multiprocessing
import os
import runpy
import sys
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np

from solvers import integration


@contextmanager
def taken(which):
    """Realisation number `which`, as long as this lasts."""
    own_rng, own_start = np.random.default_rng, integration.checked_start

    def rng(seed=None):
        if seed is None or isinstance(seed, (np.random.Generator, np.random.BitGenerator)):
            return own_rng(seed)
        of = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
        return own_rng(np.random.SeedSequence(of.entropy, spawn_key=(*of.spawn_key, 1_000_000 + which)))

    def start(*arguments):
        z = own_start(*arguments)
        return z + 1e-13 * (np.abs(z) + 1e-3) * own_rng([which, z.size]).standard_normal(z.size)

    with patch.object(np.random, "default_rng", rng), patch.object(integration, "checked_start", start):
        yield


if __name__ == "__main__":
    multiprocessing.set_start_method("fork")  # so that pools know it too
    del sys.argv[0]
    with taken(int(os.environ["FEMBEAM_REALISATION"])):
        runpy.run_path(sys.argv[0], run_name="__main__")
