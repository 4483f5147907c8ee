"""Ctrl-C and SIGTERM for the command line: they stop at once, or wait while results are made."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_state: dict[str, Any] = {"received": 0, "waits": False, "ended": False}


@contextmanager
def handling() -> Iterator[None]:
    """SIGINT and SIGTERM raise KeyboardInterrupt; outside the main thread nothing changes."""
    _state.update(received=0, waits=False)
    before, hook = {}, sys.unraisablehook

    def send_again(dropped: Any) -> None:
        """Ctrl-C within a callback of the interpreter or a library is dropped there: send it once more."""
        if dropped.exc_type is KeyboardInterrupt:
            from threading import Timer

            Timer(0.05, signal.raise_signal, [received() or signal.SIGINT]).start()
        else:
            hook(dropped)

    sys.unraisablehook = send_again
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:  # as nohup and background jobs want it
                before[number] = signal.signal(number, _on_signal)
    except ValueError:  # not the main thread
        pass
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in before.items():
            signal.signal(number, handler)


def _on_signal(number: int, _: Any) -> None:
    """Note the first signal while it can wait, stop at any other."""
    first, _state["received"] = not _state["received"], number
    if not (_state["waits"] and first):
        raise KeyboardInterrupt
    os.write(2, b"\nfembeam: stopping as soon as what was computed can be kept; once more stops at once\n")


def heard_while(running: Callable[[], bool]) -> None:
    """In a process that works for another: SIGINT raises KeyboardInterrupt while that holds, else `check_ended` does.

    SIGTERM ends it at once.
    """

    def heard(number: int, _: Any) -> None:
        _state.update(received=number, ended=True)
        if running():
            raise KeyboardInterrupt

    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, heard)
    signal.signal(signal.SIGTERM, lambda *_: os._exit(1))


@contextmanager
def deferred() -> Iterator[None]:
    """The first signal waits until `check` is called, so that nothing computed is lost; a second one does not."""
    _state["waits"] = True
    try:
        yield
    finally:
        _state["waits"] = False


def check() -> None:
    """Stop here if a signal came."""
    if received():
        raise KeyboardInterrupt


def check_ended() -> None:
    """Stop here in a process that a signal has ended while it waited for work."""
    if _state["ended"]:
        raise KeyboardInterrupt


def received() -> int:
    """Number of the signal that came, 0 for none."""
    return int(_state["received"])
