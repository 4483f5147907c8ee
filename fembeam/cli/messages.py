"""What the command line says on stderr, and its exit codes."""

from __future__ import annotations

import codecs
import sys
from typing import Any

FAILED, BAD_INPUT, INTERRUPTED, TERMINATED = 1, 2, 130, 143
EXIT_CODES = """\
exit codes:
  0    done
  1    a computation failed, or results could not be written; what was computed is written where possible
  2    bad input, nothing was computed for it
  130  interrupted (Ctrl-C), 143 terminated; what was computed is written and marked as partial"""
PLAIN = {"ω": "omega", "ζ": "zeta", "δ": "delta", "Δ": "Delta", "π": "pi", "Γ": "Gamma", "φ": "phi", "σ": "sigma",
         "μ": "mu", "µ": "u", "²": "2", "³": "3", "√": "sqrt ", "±": "+-", "–": "-", "…": "..."}  # fmt: skip
warned: list[str] = []  # by this command


def write_anywhere() -> None:
    """Let stdout and stderr take what their encoding does not know: Greek letters by name, other characters as ?."""
    codecs.register_error("fembeam", _plainly)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="fembeam")


def _plainly(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that cannot be encoded, and where to go on."""
    assert isinstance(error, UnicodeEncodeError)
    return "".join(PLAIN.get(c, "?") for c in error.object[error.start : error.end]), error.end


def say(message: str) -> None:
    """One line on stderr."""
    print(f"fembeam: {message}", file=sys.stderr)


def show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as one line, once in a command however often a scene is reduced; remembered for the report."""
    if (said := one_line(message)) not in warned:
        warned.append(said)
        say(f"warning: {said}")


def one_line(message: object) -> str:
    """A message without line breaks, of the system without its number."""
    if isinstance(message, OSError) and message.filename is not None and message.strerror:
        message = f"{message.filename}: {message.strerror}"
    return " ".join(str(message).split()) or type(message).__name__


def interrupted() -> int:
    """The exit code shells expect after a signal."""
    import signal

    from fembeam.support import interrupts

    # interrupted in text that it ran, as of a dataclass, `python -m` else ends by SIGINT whatever the code is
    exec("")
    return TERMINATED if interrupts.received() == signal.SIGTERM else INTERRUPTED
