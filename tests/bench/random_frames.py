"""Random frames in the plane and in space as scene files, against a second implementation with elements of its own.

    python tests/bench/random_frames.py [count] [first seed] [processes]

Trees of members at any angle with sections of two second moments, a product of area and torsion, rigid arms, preload,
foundation, or a shaft that spins; supports of chosen components, springs, dashpots, rigid bodies with offsets and
tensors, disks, stops and elements along any direction, between places and bodies too, impactors, forces, moments,
unbalances, motions of the base along several axes and of supports, gravity; in one piece, or cut at a node into two
bodies that a joint holds, one of them turned, perhaps a superelement. Frequencies, motion of all nodes, forces,
impulses, work, the log and reactions agree to what the mesh of the second implementation is off, times what a scene
amplifies. Scenes with two frequencies that are nearly one, or too chaotic, are counted, not compared.
"""

from __future__ import annotations

import math
import signal as clock
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from comparison import judged, told_apart
from drawn_frames import FrameDrawer, cut
from model_tables import scene_file
from scipy.linalg import eigh
from second_frames import AXES, LOG, PIECES, Reduced, Space, Table, own_numbers, own_run, reduced, significant
from second_motion import TooManyError

from fembeam.scene_file.reader import read
from reduction import AccuracyError
from solvers import Exponential, SolverError

ALLOWED = 3e-4
MOVE = 1e-6  # of the start
WORST = 1e4  # amplification, beyond which nothing is compared
APART = 2e-3  # relative distance of frequencies
PATIENCE = 60  # s, of the second implementation


def their_numbers(tables: Table, run: Any, plane: bool) -> dict[str, Any]:
    """The same from a run."""
    found: dict[str, Any] = {}
    known = ("x", "y", "rz") if plane else AXES
    for node in tables["frame"]["nodes"]:
        for c in known:
            for name, read_off in (("u", run.displacement), ("v", run.velocity), ("a", run.acceleration)):
                found[f"{name} {node} {c}"] = read_off(node, c)
    for i in range(len(run.stops)):
        found[f"force {i}"], found[f"impulse {i}"] = run.force(i), run.losses.impulses[:, i]
        found[f"work {i}"] = run.losses.history[:, i]
    table = list(run.reactions())
    for i in range(len(tables["supports"])):
        for name in known:
            found[f"reaction {i} {name}"] = table[i][name]
    log = run.contacts
    kept = significant(log.stop, log.peak_indentation, log.t_in)
    found["contacts"] = np.array([np.sum(log.stop[kept] == i) for i in range(len(run.stops))])
    for name in LOG:
        found[f"log {name}"] = np.asarray(getattr(log, name))[kept]
    return found


def too_long(*_: Any) -> None:
    """The reference has no more patience."""
    raise TooManyError


def judge(seed: int) -> tuple[str, list[str], int]:
    """Draw, run, compare."""
    drawer = FrameDrawer(seed, 5)
    tables, how, rtol = drawer.draw_frame()
    one_body = seed % 2 == 0 or "bodies" in tables or drawer.turning
    told = tables if one_body else cut(tables, np.random.default_rng([seed, 5]))
    words = f"seed {seed}: {'plane' if drawer.plane else 'space'} {list(told)} {how}"
    model = reduced(tables, how["modes"])
    if model.apart < APART:
        return words, ["ill-conditioned"], 0
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        path = Path(folder, "scene.toml")
        path.write_text(scene_file(told, how), encoding="utf-8")
        try:
            file = read(path)
            run = file.scene.reduce(**file.reduce).simulate(
                drawer.duration, drawer.duration / 40, None, Exponential(rtol)
            )
        except (ValueError, TypeError, AccuracyError, SolverError) as error:
            return words, [f"refused: {error}"], 0
    return words, *compared(seed, drawer, tables, model, run, "reduced" in str(told))


def compared(
    seed: int, drawer: FrameDrawer, tables: Table, model: Reduced, run: Any, superelement: bool
) -> tuple[list[str], int]:
    """What differs, and how many contacts there were."""
    sizes, sign = (drawer.size, drawer.rate), np.random.default_rng(seed).choice([-1.0, 1.0], len(model.omega))
    clock.signal(clock.SIGALRM, too_long)
    clock.alarm(PATIENCE)
    try:
        motions = [own_run(tables, model, drawer.duration, 1e-10, sizes, move) for move in (0.0, MOVE * sign)]
    except TooManyError:
        return ["the reference failed"], 0
    finally:
        clock.alarm(0)
    own, other = (own_numbers(tables, model, *motion, run.t) for motion in motions)
    wrong = frequencies(model, run.model.omega, superelement)
    if any(np.shape(own[k]) != np.shape(other[k]) for k in own):
        return wrong or ["ill-conditioned"], 0
    moving = any("motion" in one for one in tables["supports"])  # there each has a shape more, and starts otherwise
    factor = 100 if moving else 10 if superelement else 1
    apart = differences(their_numbers(tables, run, drawer.plane), own, other, 1 / model.omega[0], moving)
    if any(amplified > WORST for name, (_, amplified) in apart.items() if name.startswith("u ")):
        return wrong or ["ill-conditioned"], 0
    for name, (error, amplified) in apart.items():
        most = ALLOWED * amplified * factor * (30 if name.startswith(("a ", "reaction", "force", "log")) else 3)
        if not error <= most and amplified < WORST:
            wrong.append(f"{name} off by {error:.3g}, amplified {amplified:.3g}")
    return wrong, len(motions[0][0].log)


def frequencies(model: Reduced, theirs: Any, superelement: bool) -> list[str]:
    """Whether each body's are among those of fembeam, to a fifth of what half the mesh makes of them."""
    count, wrong = (len(model.omega) - len(model.space.impactors)) // len(model.space.parts), []
    for i, part in enumerate(model.space.parts):
        half, mine = Space(part.tables, PIECES // 2), model.omega[i * count : (i + 1) * count]
        squares = eigh(half.Z.T @ half.K @ half.Z, half.Z.T @ half.M @ half.Z, eigvals_only=True)[: len(mine)]
        off = np.array([np.min(np.abs(theirs - w)) / w for w in mine])
        if np.any(off > (1e-4 if superelement else 2e-6) + 0.2 * np.abs(np.sqrt(squares) / mine - 1)):
            wrong.append(f"omega off by {off.max():.2g}")
    return wrong


def differences(
    found: dict[str, Any], own: dict[str, Any], other: dict[str, Any], second: float, moving: bool
) -> dict[str, tuple[float, float]]:
    """Error of every number in units of the largest of its kind, and the amplification of a moved start."""
    sizes: dict[str, float] = {}
    for name, value in own.items():
        sizes[_kind(name)] = max(sizes.get(_kind(name), 1e-300), float(np.abs(value).max(initial=0.0)))
    largest = {name.split()[0]: max(v for k, v in sizes.items() if k.split()[0] == name.split()[0]) for name in own}
    apart = {}
    for name, value in own.items():
        first = int(moving and name.startswith(("a ", "reaction")))
        if np.shape(found[name]) != np.shape(value):
            apart[name] = math.inf, 1.0
            continue
        size = second if name.startswith("log t") else max(sizes[_kind(name)], 1e-6 * largest[name.split()[0]])
        error, moved = (np.abs(np.subtract(x, value))[first:].max(initial=0.0) for x in (found[name], other[name]))
        apart[name] = float(error / size), max(1.0, float(moved / size / MOVE))
    return apart


def _kind(name: str) -> str:
    """Numbers of one size: all displacements, all rotations; every force by itself."""
    words = name.split()
    return f"{words[0]} {words[-1][:1]}" if words[0] in ("u", "v", "a", "reaction") else name


def main(count: int = 100, first: int = 0, processes: int = 1) -> int:
    """Run and print; returns the number of scenes that differ."""
    return told_apart(judged(judge, count, first, processes), f"{count} frames", 8)


if __name__ == "__main__":
    sys.exit(main(*(int(x) for x in sys.argv[1:])) > 0)
