"""What a start costs, first with an empty cache, then with a full one: every method, laws of a user's own.

    python tests/bench/start_up.py [rounds]

Every figure is seconds of processor in a fresh process (what else runs on the machine lengthens it by up to a half all
the same), the least of some rounds. The rows of a round share a cache: the first method with the loop of `stepping`
compiles it for all, the tangent what it needs beside the main method. Of laws the integrator is loaded beforehand.
Python keeps its byte code, as by default. ``NUMBA_OPT`` and the like are passed on.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

BEGIN = "import time; begin = time.process_time()\n"
END = "print(time.process_time() - begin)\n"
BALL = """
import solvers
from contacts import Hertz
def run(law, always=False, **options):
    ball = solvers.System([[2.0]], [[0.0]], [[0.0]], [solvers.Contact([1.0], law, always=always)])
    solvers.integrate(ball, [1e-3], [-0.5], duration=0.1, **options)
"""
METHODS = {
    "Exponential": "",
    "its tangent": "tangent=True",
    "DormandPrince": "method=solvers.DormandPrince()",
    "HenonRK2": "method=solvers.HenonRK2(1e-4, 1e-4)",
    "RK4": "method=solvers.RK4(1e-4)",
    "CentralDifference": "method=solvers.CentralDifference(1e-4)",
    "Newmark": "method=solvers.Newmark(1e-4)",
    "GeneralizedAlpha": "method=solvers.GeneralizedAlpha(1e-4)",
}
LAWS = """
import math
from contacts import Border, Segment, law, memory_law

@law(exponent=1.5)
def softening(delta, delta_dot, entry_rate, stiffness=2e7, loss=0.3):
    return stiffness * delta * math.sqrt(delta) * (1.0 + loss * delta_dot / entry_rate) / (1.0 + 1e3 * delta)

def pull(delta, delta_dot, way, slider, stiffness, limit):
    return stiffness * (delta - slider)

def left(delta, delta_dot, way, slider, stiffness, limit):
    return limit - abs(stiffness * (delta - slider))

def let_go(delta, delta_dot, way, slider, stiffness, limit):
    return math.copysign(1.0, delta - slider), slider

def drag(delta, delta_dot, way, slider, stiffness, limit):
    return way * limit

def onwards(delta, delta_dot, way, slider, stiffness, limit):
    return way * delta_dot

def hold(delta, delta_dot, way, slider, stiffness, limit):
    return 0.0, delta - way * limit / stiffness

stick, slip = Segment(pull, Border(left, "slip", let_go)), Segment(drag, Border(onwards, "stick", hold))
friction = memory_law("friction", {"stick": stick, "slip": slip}, {"way": 0.0, "slider": 0.0})
"""
USES = {
    "own law": "import laws; run(laws.softening())",
    "own law with memory": "import laws; run(laws.friction(stiffness=2e4, limit=10.0), always=True)",
}
LOADED = "from contacts import Jenkins; run(Hertz(1e6)); run(Jenkins(2e4, 10.0), always=True)\n"


def seconds(code: str, cache: str) -> float:
    """Seconds of processor that a fresh process says it took."""
    command = [sys.executable, "-W", "error", "-c", code]
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPYCACHEPREFIX": cache, "PYTHONDONTWRITEBYTECODE": ""}
    return float(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)


def programs(folder: str) -> dict[str, str]:
    """What is measured, by name."""
    Path(folder, "laws.py").write_text(LAWS, encoding="utf-8")
    loaded = f"import sys; sys.path.insert(0, {folder!r})\n" + BALL + LOADED + BEGIN
    methods = {name: f"{BEGIN}{BALL}run(Hertz(1e6), {options})\n{END}" for name, options in METHODS.items()}
    return methods | {name: f"{loaded}{use}\n{END}" for name, use in USES.items()}


def main(rounds: int = 3) -> None:
    """Measure and print."""
    found: dict[str, tuple[list[float], list[float]]] = {name: ([], []) for name in (*METHODS, *USES)}
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as cache:
            for k in range(2):  # with an empty cache, with a full one
                for name, code in programs(cache).items():
                    found[name][k].append(seconds(code, cache))
    print(f"{'':20s} first     later     s of processor")
    for name, (first, later) in found.items():
        print(f"{name:20s} {min(first):6.2f} {min(later):9.2f}   (to {max(first):.2f} and {max(later):.2f})")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
