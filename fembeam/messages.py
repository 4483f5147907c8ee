"""What the command line says on stderr, and its exit codes."""

from __future__ import annotations

import sys
from typing import Any

FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 1, 2, 130, 143
EXIT_CODES = """\
exit codes:
  0    done
  1    a computation failed, or results could not be written; what was computed is written where possible
  2    bad input, nothing was computed for it
  130  interrupted (Ctrl-C), 143 terminated; what was computed is written and marked as partial"""
warned: list[str] = []  # by this command


def say(message: str) -> None:
    """One line on stderr."""
    print(f"fembeam: {message}", file=sys.stderr)


def show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line, remembered for the report."""
    warned.append(one_line(message))
    say(f"warning: {warned[-1]}")


def one_line(message: object) -> str:
    """A message without line breaks."""
    return " ".join(str(message).split()) or type(message).__name__


def interrupted() -> int:
    """The exit code shells expect after a signal."""
    import signal

    from fembeam import interrupts

    return TERMINATED if interrupts.heard() == signal.SIGTERM else INTERRUPTED
