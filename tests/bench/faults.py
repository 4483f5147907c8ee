"""Faults tried on `fembeam run`: signals at random moments; what is left in the folder must be whole.

    python tests/bench/faults.py [count] [seed]

Every run is stopped by SIGINT, SIGTERM or SIGKILL at a random moment of its life; a second signal follows some. After
it every file in the folder is opened; nothing may be broken, no traceback may be printed, and with --resume the next
run goes on. SIGKILL alone may leave a hidden temporary file.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import fembeam as fb

HOME = Path(__file__).resolve().parent.parent.parent
SIGNALS = [signal.SIGINT, signal.SIGINT, signal.SIGTERM, signal.SIGTERM, signal.SIGKILL]
STUDIES = """
[mode_count]
counts = [1, 2]
quantity = "peak_force"
duration = 0.5
seeds = 3
[ensemble]
realisations = 6
duration = 40
dt = 2e-3
"""


def command(folder: Path, *more: str) -> list[str]:
    """`fembeam run` of the example with several studies."""
    text = (HOME / "examples" / "beam_stop.toml").read_text(encoding="utf-8")
    scene = folder / "scene.toml"
    scene.write_text(text.replace("duration = 600", "duration = 60") + STUDIES, encoding="utf-8")
    return [sys.executable, "-m", "fembeam.cli", "run", str(scene), "--out", str(folder / "out"), *more]


def heard() -> None:
    """Background jobs ignore SIGINT; ours do not."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def stopped(folder: Path, after: float, number: int, again: float, *more: str) -> tuple[int, str]:
    """Start, send the signal after some seconds, perhaps once more; the exit code and what was said."""
    environment = {**os.environ, "PYTHONPATH": f"{HOME}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    with subprocess.Popen(
        command(folder, *more), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        preexec_fn=heard,
    ) as process:  # fmt: skip
        for pause in (after, again):
            try:
                process.wait(pause)
                break
            except subprocess.TimeoutExpired:
                process.send_signal(number)
        out, said = process.communicate(timeout=300)
    return process.returncode, out + said


def broken(folder: Path, killed: bool) -> list[str]:
    """What is wrong with the files."""
    found = []
    for path in sorted(folder.iterdir()) if folder.exists() else []:
        if path.name.startswith("."):
            found += [] if killed else [f"{path.name} was left"]
            continue
        try:
            opened(path)
        except Exception as error:
            found.append(f"{path.name}: {type(error).__name__}: {error}")
    return found


def opened(path: Path) -> None:
    """Read a file wholly."""
    if path.name == "run.npz":
        fb.load(path)
    elif path.suffix == ".npz":
        with np.load(path) as data:
            _ = [data[name] for name in data.files]
    elif path.suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    elif path.suffix == ".png":
        assert path.read_bytes().endswith(b"IEND\xaeB`\x82")
    elif path.suffix == ".html":
        assert path.read_text(encoding="utf-8").endswith("</html>\n")
    else:
        assert path.stat().st_size > 0


def main(count: int = 50, seed: int = 0) -> int:
    """Try that many; exit code 1 when something was lost."""
    rng, outcomes, lost = np.random.default_rng(seed), Counter(), 0
    with tempfile.TemporaryDirectory() as place:
        started = time.perf_counter()
        code, said = stopped(Path(place), 600.0, signal.SIGKILL, 0.0)
        life = time.perf_counter() - started
        assert code == 0, said
    print(f"a whole run takes {life:.1f} s", flush=True)
    for i in range(count):
        number = int(SIGNALS[rng.integers(len(SIGNALS))])
        after, again = life * rng.random(), (rng.exponential(0.3) if rng.random() < 0.2 else 300.0)
        with tempfile.TemporaryDirectory() as place:
            code, said = stopped(Path(place), after, number, again)
            faults = broken(Path(place) / "out", number == signal.SIGKILL)
            faults += ["traceback: " + said[-600:]] if "Traceback" in said else []
            # -SIGINT: the interpreter dies so when a signal met it while it made a dataclass, whatever `main` returns
            allowed = {0, -number, -signal.SIGINT, {signal.SIGINT: 130, signal.SIGTERM: 143}.get(number)}
            faults += [f"exit code {code}"] if code not in allowed else []
            if i % 5 == 0 and (Path(place) / "out").exists():
                code, said = stopped(Path(place), 600.0, signal.SIGKILL, 0.0, "--resume", "--quiet")
                faults += [] if code == 0 else [f"--resume fails with {code}: {said[-300:]}"]
                outcomes["of these resumed to the end"] += code == 0
        outcomes[f"{signal.Signals(number).name}"] += 1
        lost += bool(faults)
        if faults:
            print(f"{i}: {signal.Signals(number).name} after {after:.2f} s, again after {again:.2f} s:", *faults,
                  sep="\n  ", flush=True)  # fmt: skip
    print(f"{count} runs stopped, {lost} with faults; " + re.sub(r"[{}']", "", str(dict(outcomes))))
    return int(lost > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
