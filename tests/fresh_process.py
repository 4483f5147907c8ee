"""Code run in processes of their own that begin with numba loaded: to load it takes longer than most of such code does.

One process that has loaded it forks another for every task; nothing of `contacts` or `solvers` is known there. Scripts
that users write begin with these and `fembeam` loaded too.
"""

import atexit
import json
import os
import signal
import subprocess
import sys
import tempfile
import traceback
from functools import cache
from pathlib import Path

LONGEST = 300  # s
PACKAGES = """
import os
os.environ["MPLBACKEND"] = "Agg"
import matplotlib.pyplot, scipy.optimize, scipy.signal, scipy.stats, skfem
import solvers, fembeam.plot, fembeam.scene_file, fembeam.study
from contacts import Hertz
ball = solvers.System([[2.0]], [[0.0]], [[4.0]], [solvers.Contact([1.0], Hertz(1e6))])
for options in {"dt": 0.01}, {"tangent": True}:
    solvers.integrate(ball, [1e-3], [-0.5], 0.1, **options)
"""


def run(code, folder, environment, packages=""):
    """What code in a folder prints, and its warnings: like `python -c`, and by it where nothing can be forked.

    ``packages`` is code that the process which is forked has run.
    """
    if not hasattr(os, "fork"):
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout, done.stderr
    with tempfile.TemporaryDirectory() as place:
        server, printed = _server(packages), [Path(place, name) for name in ("stdout", "stderr")]
        task = {"code": code, "folder": str(folder), "environment": environment, "printed": [*map(str, printed)]}
        server.stdin.write(json.dumps(task) + "\n")
        server.stdin.flush()
        failed = int(server.stdout.readline())
        said, warned = (path.read_text() for path in printed)
        assert not failed, warned
        return said, warned


def run_script(folder, path, *arguments):
    """The same of ``python path arguments``, with the packages loaded and figures that no window shows."""
    command, home = [str(path), *arguments], str(Path(folder, path).parent)
    code = f"import runpy, sys\nsys.argv, sys.path[0] = {command!r}, {home!r}\n"
    code += f"runpy.run_path({command[0]!r}, run_name='__main__')"
    return run(code, folder, {**os.environ, "MPLBACKEND": "Agg"}, PACKAGES)


@cache
def _server(packages):
    """The process that forks others."""
    command = [sys.executable, __file__, packages]
    started = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(started.stdin.close)
    return started


def _serve():
    """Run task after task; print 0 for each that ends well."""
    import numba

    numba.njit(lambda x: x)(1.0)  # which loads what numba compiles with
    exec(sys.argv[1], {})
    for line in sys.stdin:
        child = os.fork()
        if not child:
            _work(**json.loads(line))
        print(os.waitpid(child, 0)[1], flush=True)


def _work(code, folder, environment, printed):
    """Be the process of a task."""
    from numba import config

    for number, path in enumerate(["/dev/null", *printed]):
        os.dup2(os.open(path, os.O_RDWR | os.O_CREAT), number)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.path[0], tempfile.tempdir = str(folder), None
    config.reload_config()
    signal.alarm(LONGEST)
    try:
        exec(code, {"__name__": "__main__"})
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


if __name__ == "__main__":
    _serve()
