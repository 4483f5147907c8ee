"""The decorators of compiled functions: which options of numba they use, what each is worth, what to do without it.

Processor times without an option over those with it, of runs of the paper's scene (rtol 1e-8) with 2, 10 and 30 modes
and of one under noise, by turns on one machine, off by up to 0.07; ``python tests/bench/compiler_options.py NAME``
repeats those that have a name:

| name       | option                              | 2    | 10   | 30   | noise | where numba drops it            |
|------------|-------------------------------------|------|------|------|-------|---------------------------------|
| nrt        | ``_nrt=False``, no reference counts | 1.61 | 1.74 | 1.90 | 1.31  | leave it out                    |
| force      | ``forceinline``                     | 1.04 | 1.03 | 1.05 | 1.04  | `inlined` becomes `inner`       |
| merged     | ``inline="always"`` (documented)    | 1.06 | 1.08 | 1.07 | 1.03  | `merged` becomes `inner`        |
| alias      | the mark in `packed._attribute`     | 1.00 | 1.03 | 1.06 | 1.03  | leave the mark out              |
| tuples     | arrays by address, `packed`         | 3.13 | 3.20 | 3.68 | 1.89  | hand over the named tuples      |
|            | eight numbers as one, `simd`        | 1.50 | 1.49 | 2.47 | 1.17  | plain loops in `sums`, `flight` |
| parts      | called at an address, `parts`       | 0.99 | 1.02 | 0.99 | 1.12  | `part` becomes `inner`          |

The row of `simd` is of a copy changed by hand. Without `packed` parts cannot be called at addresses either: that row is
of both. `pair_response` returns an array, which only a merged function may: without merging it has to fill one. `parts`
halve the time of compiling: the first run took 67 s of processor without, 33 s with them, by turns;
``python tests/bench/start_up.py`` measures it.
The methods of numba replaced in `shortcuts` leave 0.54 of the time of compiling, and machine code that is no slower.
``no_cpython_wrapper`` and ``no_cfunc_wrapper`` save most of the compile time of inner functions and no run time.
``_nrt``, ``forceinline`` and these two are not documented by numba, nor are a function's ``_cache`` and what is
imported of ``numba.core``: hence the upper bound of its version in pyproject.toml. With a new version: raise the bound,
run the tests and the bench; what fails is left out as the table says.
"""

from __future__ import annotations

import gc
import logging
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import IO, Any

from numba import config, njit
from numba.core import event
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

from solvers.compiled.cache import is_current, lock_folder, lock_of, store, unlock_folder
from solvers.compiled.shortcuts import Shortcuts

if config.DISABLE_JIT:
    raise RuntimeError("NUMBA_DISABLE_JIT is set, but time integration runs as machine code only: unset it")


def _compiled(function: Any, **options: Any) -> Any:
    """A function compiled by numba when first called, its machine code kept in the folder of these sources."""
    return _stored(njit(**options)(function), function)


def _stored(made: Any, function: Any) -> Any:
    """Have what numba made of a function keep its machine code, where that can be."""
    found = store(function)
    if found is not None:
        made._cache = found
    return made


def _decorator(**options: Any) -> Callable[[Any], Any]:
    return partial(_compiled, **options)


_OPTIONS: Any = {"nogil": True, "error_model": "numpy", "_nrt": False}
kernel = _decorator(**_OPTIONS)
"""Decorator of the compiled functions Python calls. They allocate nothing, so reference counting is switched off:
passing twenty arrays down a call would otherwise cost ten times the arithmetic of a two-mode step."""
_INNER: Any = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
inner = _decorator(**_INNER)
"""The same for functions only kernels call: no wrappers, which would take most of their compile time."""
inlined = _decorator(**_INNER, forceinline=True)
"""The same for what the innermost loops call, from few places: there even passing the arrays' descriptors costs more
than the arithmetic. Everywhere else it would only cost compile time."""
merged = njit(**_INNER, inline="always")
"""The same for what is called from one place: compiled as a part of the caller, a third quicker than by itself."""
reordered = _decorator(**_INNER, forceinline=True, fastmath={"reassoc", "contract"})
"""The same for sums whose order does not matter, so that they can be vectorised."""


class _CompilerNotice(event.Listener):
    """Says once per process that code is compiled: half a minute for runs, a third of that for tangents."""

    given = False

    def on_start(self, _: Any) -> None:
        """A function was not found in the cache."""
        if not self.given:
            self.given = True
            logging.getLogger("fembeam.solvers").warning(
                "compiling what this needs of the integrator: 10 to 60 s, later starts load it"
            )

    def on_end(self, _: Any) -> None:
        """It is compiled."""


_NOTICE = _CompilerNotice()


class _OneProcess(event.Listener):
    """Lets one process at a time compile a function that takes long, until its code is stored.

    It is looked for in the cache only then, so that those that waited need not compile, too; other functions are
    compiled meanwhile. What is compiled when first called has one lock in common.
    """

    def __init__(self) -> None:
        self._guard, self._depth = threading.RLock(), 0
        self._file: IO[bytes] | None = None

    def on_start(self, found: Any) -> None:
        """A thread asks for numba's compiler lock, or compiles within it."""
        with self._guard:
            if found.kind == "numba:compiler_lock":
                self._depth += 1
            elif is_current(found.data["dispatcher"].py_func):
                self.lock()

    def on_end(self, found: Any) -> None:
        """Compiled; given back: all is stored."""
        if found.kind == "numba:compiler_lock":
            self.release()

    def lock(self, name: str = "lock") -> None:
        """Wait for other processes; released with the last of numba's locks."""
        with self._guard:
            self._file = self._file or lock_folder(self._tell, name)

    def release(self) -> None:
        """One lock less."""
        with self._guard:
            self._depth = max(self._depth - 1, 0)  # a lock taken before this module was imported is given back now
            if self._depth == 0 and self._file is not None:
                unlock_folder(self._file)
                self._file = None

    @contextmanager
    def alone(self, work: str = "") -> Iterator[None]:
        """Compile or load within, with no other process at the same work."""
        with self._guard:
            self._depth += 1
        try:
            self.lock(lock_of(work))  # which Ctrl-C may end
            yield
        finally:
            self.release()

    def forget(self) -> None:
        """In a forked process: the lock is its parent's, whatever thread took it."""
        if self._file is not None:
            self._file.close()  # of two copies one, which leaves the lock to the other
        self._guard, self._depth, self._file = threading.RLock(), 0, None

    def _tell(self) -> None:
        """Say why nothing happens."""
        logging.getLogger("fembeam.solvers").warning("waiting for another process that compiles the integrator")


_ONE_PROCESS = _OneProcess()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_ONE_PROCESS.forget)
_SHORTCUTS = Shortcuts(is_current)
event.register("numba:compiler_lock", _ONE_PROCESS)
event.register("numba:compile", _ONE_PROCESS)
event.register("numba:compile", _SHORTCUTS)


@contextmanager
def _compiling(function: Any, signature: Any) -> Iterator[None]:
    """Tell of compiling, and let the garbage collector rest.

    The compiler keeps most of what it makes; looking through that again and again takes a sixth of the time.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        work = f"{function.__module__}.{function.__qualname__} {signature}"
        with _ONE_PROCESS.alone(work), _SHORTCUTS.taken(), event.install_listener("numba:compile", _NOTICE):
            yield
    finally:
        if collects:
            gc.enable()


def entry(signature: Any) -> Callable[[Any], Any]:
    """Decorator of a kernel that is compiled, or loaded, when its module is imported."""

    def compiled(function: Any) -> Any:
        made = _compiled(function, **_OPTIONS)
        with _compiling(function, signature):
            made.compile(signature)
        made.disable_compile()
        return made

    return compiled


def c_function(signature: Any) -> Callable[[Any], Any]:
    """Decorator of a C function, called at its ``address``, likewise."""

    def compiled(function: Any) -> Any:
        made = _stored(CFunc(function, normalize_signature(signature), {}, _OPTIONS), function)
        with _compiling(function, signature):
            made.compile()
        return made

    return compiled
