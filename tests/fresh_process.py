"""Code run in processes of their own that begin with numba loaded: to load it takes longer than most of such code does.

One process that has loaded it forks another for every task; nothing of `contacts` or `solvers` is known there.
"""

import atexit
import json
import os
import subprocess
import sys
import tempfile
import traceback
from functools import cache
from pathlib import Path


def run(code, folder, environment):
    """What code in a folder prints, and its warnings: like `python -c`, and by it where nothing can be forked."""
    if not hasattr(os, "fork"):
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout, done.stderr
    with tempfile.TemporaryDirectory() as place:
        server, printed = _server(), [Path(place, name) for name in ("stdout", "stderr")]
        task = {"code": code, "folder": str(folder), "environment": environment, "printed": [*map(str, printed)]}
        server.stdin.write(json.dumps(task) + "\n")
        server.stdin.flush()
        failed = int(server.stdout.readline())
        said, warned = (path.read_text() for path in printed)
        assert not failed, warned
        return said, warned


@cache
def _server():
    """The process that forks others."""
    started = subprocess.Popen([sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(started.stdin.close)
    return started


def _serve():
    """Run task after task; print 0 for each that ends well."""
    import numba

    numba.njit(lambda x: x)(1.0)  # which loads what numba compiles with
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
