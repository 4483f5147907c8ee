"""What a start costs: compiling with an empty cache, loading from a full one, a user's new law.

    python tests/bench/start_up.py [rounds]

Every figure is seconds of processor in a fresh process (what else runs on the machine lengthens it by up to a half all
the same), the least of some rounds. Compiled: the main integrator, and the one that carries the tangent along, which is
compiled when first asked for. Python keeps its byte code, as by default. ``NUMBA_OPT`` and the like are passed on.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

BEGIN = "import time; begin = time.process_time()\n"
END = "print(time.process_time() - begin)\n"
RUN = """
from contacts import Hertz
from solvers import Contact, System, integrate
ball = System(M=[[2.0]], C=[[0.0]], K=[[0.0]], contacts=[Contact([1.0], Hertz(1e6))])
integrate(ball, [1e-3], [-0.5], duration=0.1, tangent=TANGENT)
"""
LAW = """
import math
from contacts import law
@law(exponent=1.5)
def softening(delta, delta_dot, entry_rate, stiffness=2e7, loss=0.3):
    return stiffness * delta * math.sqrt(delta) * (1.0 + loss * delta_dot / entry_rate) / (1.0 + 1e3 * delta)
"""
AGAIN = """
ball = System(M=[[2.0]], C=[[0.0]], K=[[0.0]], contacts=[Contact([1.0], softening())])
integrate(ball, [1e-3], [-0.5], duration=0.1)
"""


def seconds(code: str, cache: str) -> float:
    """Seconds of processor that a fresh process says it took."""
    command = [sys.executable, "-c", code]
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPYCACHEPREFIX": cache, "PYTHONDONTWRITEBYTECODE": ""}
    return float(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)


def law_code(folder: str) -> str:
    """Define, compile and use a law that no cache knows; the integrator is loaded beforehand."""
    Path(folder, "laws.py").write_text(LAW, encoding="utf-8")
    loaded = f"import sys; sys.path.insert(0, {folder!r})\n" + RUN.replace("TANGENT", "False")
    return loaded + BEGIN + "from laws import softening\n" + AGAIN + END


def main(rounds: int = 3) -> None:
    """Measure and print."""
    plain, whole = (BEGIN + RUN.replace("TANGENT", value) + END for value in ("False", "True"))
    found: dict[str, list[float]] = {}
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as cache:
            for name, code in (
                ("first run, everything compiled", plain),
                ("first tangent after that", whole),
                ("later run", plain),
                ("later tangent", whole),
                ("new law, compiled and run", law_code(cache)),
            ):
                found.setdefault(name, []).append(seconds(code, cache))
    for name, values in found.items():
        print(f"{name:32s} {min(values):6.2f} s   (to {max(values):.2f})")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
