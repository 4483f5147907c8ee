"""What the benches that draw systems have in common: run, run again, compare number by number, report.

A system is run by the method in question and by a reference, with samples and without. What a difference is worth is
told by the system itself: the reference is run again from slightly moved starts, and every number's error is taken in
units of rtol × its own amplification, beyond what a coarser reference differs by (between the steps of a strongly
damped motion that is up to 1e-5). Systems whose contacts change in number already under such a move, and those too
stiff for the reference, are counted, not compared.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from drawn import Scene

from solvers import DormandPrince, Exponential, SolverError, integrate

REFERENCE = DormandPrince(rtol=1e-13, atol=1e-15)
COARSER = DormandPrince(rtol=1e-12, atol=1e-14)  # differs from it by more than the reference is off
PATIENCE, OWN_PATIENCE = 12, 400  # stretches of 20 000 steps that a run of the reference, or of `Exponential`, may take
MOST_CONTACTS = 6
SAMPLES = 16
ALLOWED = 300.0  # error of a number, in units of rtol × its amplification
SCATTER = 3.0  # a single difference of the two references may be that much smaller than what they are off
BALANCE = 100.0  # energy not accounted for, in units of rtol × the energy there was
NUMBERS = ("t_in", "t_out", "speed_in", "speed_out", "peak_indentation", "peak_force", "impulse", "energy_loss")


class TooStiffError(RuntimeError):
    """A run took more steps than it may."""


@dataclass
class Verdict:
    """How the method did: kind is 'fine', why it was not compared, or the failure in words."""

    kind: str
    contacts: int = 0
    errors: dict[str, float] = field(default_factory=dict)  # largest of every number, rtol × amplification


def run(scene: Scene, method: Any, move: Any = 0.0, sampled: bool = True) -> Any:
    """One run, with the start moved by ``move``; its end only unless ``sampled``."""
    n = scene.system.size
    move = np.broadcast_to(move, 2 * n)
    left = iter(range(OWN_PATIENCE if isinstance(method, Exponential) else PATIENCE))

    def progress(_t: float) -> None:
        if next(left, None) is None:
            raise TooStiffError

    return integrate(
        *(scene.system, scene.q0 + move[:n], scene.q_dot0 + move[n:], scene.duration),
        *(scene.duration / SAMPLES if sampled else None, method),
        progress=progress,
        memory=scene.memory,
    )


def cut_after_contacts(scene: Scene, seed: int) -> Scene:
    """The scene cut after a few contacts: at a random place, or within a contact."""
    log = run(scene, DormandPrince(1e-7)).contacts
    rng = np.random.default_rng([seed, 1])
    t_in = np.sort(log.t_in)
    if len(t_in) > MOST_CONTACTS:
        scene.duration = t_in[MOST_CONTACTS - 1] + rng.random() * (t_in[MOST_CONTACTS] - t_in[MOST_CONTACTS - 1])
        if scene.duration <= 1e-9 * t_in[-1]:  # stops loaded from the start
            scene.duration = 0.1 * t_in[-1]
    ended = np.flatnonzero((log.t_out < scene.duration) & (log.t_in < log.t_out))
    if ended.size and rng.random() < 0.3:
        i = rng.choice(ended)
        scene.duration = log.t_in[i] + rng.random() * (log.t_out[i] - log.t_in[i])
    return scene


def cut_after_transitions(scene: Scene, most: int) -> Scene:
    """The scene cut after so many transitions, between two."""
    times = run(scene, DormandPrince(1e-7)).transitions.t
    times = np.unique(times[times > 0.0])
    if len(times) > most:
        scene.duration = 0.5 * float(times[most - 1] + times[most])
    return scene


def significant(solution: Any, size: float) -> Any:
    """Contacts that are not rounding, in order of stop and time: a start at rest on the surface may count or not."""
    log = solution.contacts
    real = np.flatnonzero(log.peak_indentation > 1e-7 * size)
    return real[np.lexsort((log.t_in[real], log.stop[real]))]


def first_forces(scene: Scene) -> Any:
    """Size of every stop's force at the start: one that is left fast may pull much harder than it ever pushes."""
    with np.errstate(invalid="ignore"):  # of a place at the centre of its circle, where δ̇ is not defined
        delta, rate = np.array([c.motion(scene.q0, scene.q_dot0)[:2] for c in scene.system.contacts]).T
    laws = [c.law for c in scene.system.contacts]
    begun = np.maximum(np.abs(rate), [made.entry_rate_floor for made in laws])
    found = [made.force(d, v, v0) for made, d, v, v0 in zip(laws, delta, rate, begun, strict=True)]
    return np.nan_to_num(np.abs(np.array(found, dtype=float)))


def numbers_of(solution: Any, scene: Scene, size: float, duration: float) -> dict[str, Any]:
    """Everything to compare, each number of a contact in units of that contact."""
    log, i = solution.contacts, significant(solution, size)
    depth, force = log.peak_indentation[i], np.abs(log.peak_force[i])
    force = np.where(log.t_in[i] == 0.0, np.maximum(force, first_forces(scene)[log.stop[i]]), force)
    force = np.maximum(force, 1e-12 * force.max(initial=0.0) + 1e-300)  # one that was cut all the time has none
    end = np.where(np.isnan(log.t_out[i]), duration, log.t_out[i])
    length = np.maximum(end - log.t_in[i], 1e-300)
    fast = np.maximum(log.speed_in[i], depth / length)
    scale = {"t_in": length, "t_out": length, "speed_in": fast, "speed_out": fast, "peak_indentation": depth}
    part = np.array([int(stop) for stop in log.stop[i]], dtype=int)
    between = np.zeros(part.max(initial=0) + 1)  # rates of each stop, met between the samples too
    np.maximum.at(between, part, np.maximum(fast, np.nan_to_num(np.abs(log.speed_out[i]))))
    np.maximum.at(between, part, speed_from_rest(scene, part, force * depth))
    scale |= {"peak_force": force + _viscous_forces(scene, part, depth, log.speed_in[i], between[part])}
    scale |= {"impulse": force * length, "energy_loss": force * depth}
    rates = {"q": solution.q, "q_dot": solution.q_dot, "fast": between, "work": (force * depth).max(initial=0.0)}
    found = (
        rates
        | {"stop": log.stop[i], "order": log.stop[i].tolist(), "scale": scale}
        | {name: getattr(log, name)[i] for name in NUMBERS}
    )
    at_rest = found["t_in"] * found["speed_in"] <= rounding_of_surfaces(scene)[part]
    for name in ("t_in", "speed_in"):  # of a start at rest on a surface: entered at once, or within its rounding
        found[name] = np.where(at_rest, 0.0, found[name])
    return found


def speed_from_rest(scene: Scene, part: Any, work: Any) -> Any:
    """m/s: what presses a mass from rest into a linear stop, by ``work`` = F δ, gives it v = √(F δ/m)/2 on the way.

    A start inside a stop is not moved by what it is pressed with: it counts as none.
    """
    with np.errstate(invalid="ignore"):
        begun = np.array([c.motion(scene.q0, scene.q_dot0)[0] for c in scene.system.contacts])[part]
    rows = [np.atleast_2d(scene.system.contacts[stop].rows)[0] for stop in part]
    accelerance = np.array([row @ np.linalg.solve(scene.system.M, row) for row in rows])
    return np.where(begun <= rounding_of_surfaces(scene)[part], 0.5 * np.sqrt(np.abs(work * accelerance)), 0.0)


def _viscous_forces(scene: Scene, part: Any, depth: Any, entry: Any, fast: Any) -> Any:
    """N: of contacts entered from rest, what their dashpot gives at the stop's largest rate.

    The small rate latched makes it so strong that the peak of the force is no more exact than rtol × this.
    """
    laws = [scene.system.contacts[stop].law for stop in part]
    latched = np.maximum(entry, [law.entry_rate_floor for law in laws])
    found = [
        np.ptp([float(law.force(d, v, v0)) for v in (-1e-6 * largest, 1e-6 * largest)]) / 2e-6
        for law, d, v0, largest in zip(laws, depth, latched, fast, strict=True)
    ]
    return np.where(entry < 1e-4 * fast, np.nan_to_num(np.array(found, dtype=float)), 0.0)


def rounding_of_surfaces(scene: Scene) -> Any:
    """Way, m, of every stop from its start that is rounding of its gap and of what is read."""
    contacts = scene.system.contacts
    sizes = [abs(c.gap) + (np.abs(c.direction) @ np.abs(scene.q0)).sum() for c in contacts]
    return 1e-13 * np.array(sizes)


def differences(a: dict[str, Any], b: dict[str, Any], measure: dict[str, Any], parts: int) -> dict[str, Any]:
    """Relative differences of all numbers, of the motion part by part, of contacts one by one."""
    found = {}
    for name in ("q", "q_dot"):
        m = len(b[name])
        both = a[name][-m:] - b[name], measure[name]
        apart, size = (np.abs(x).reshape(len(x), parts, -1).max(axis=(0, 2)) for x in both)
        if name == "q_dot":  # of what is at rest at the samples
            fast = np.resize(measure["fast"].max(initial=0.0), parts) if parts == 1 else measure["fast"]
            size[: len(fast)] = np.maximum(size[: len(fast)], fast)
        found[name] = apart / np.maximum(size, 1e-300)
    for name, scale in measure["scale"].items():
        apart = np.abs(a[name] - b[name]) / np.maximum(scale, 1e-300)
        found[name] = np.where(np.isnan(a[name]) & np.isnan(b[name]), 0.0, apart)
    return found


def imbalance(solution: Any) -> float:
    """Energy a run does not account for, in units of all the energy it handled."""
    return float(np.abs(solution.energy.residual).max() / handled(solution))


def handled(solution: Any) -> float:
    """All the energy of a run, J, that within its stops included."""
    e, log = solution.energy, solution.contacts
    total = e.initial + np.abs(e.input).max() + np.abs(e.stored).max() + np.abs(log.energy_loss).sum()
    total += np.max(np.abs(e.friction)) + np.max(np.abs(e.spin))
    total += np.abs(log.peak_force * log.peak_indentation).max(initial=0.0)
    return max(float(total), 1e-300)


@contextmanager
def strictly() -> Iterator[None]:
    """Warnings of calculations are errors, but for overflows."""
    with warnings.catch_warnings(), np.errstate(over="ignore"):
        warnings.simplefilter("error", RuntimeWarning)
        yield


def references(scene: Scene, cut: Callable[[Scene], Scene]) -> tuple[Any, Any, str]:
    """The reference and the coarser one of a scene that is ``cut``, None where they fail; and why, in words."""
    try:
        cut(scene)
        return run(scene, REFERENCE), run(scene, COARSER), ""
    except (TooStiffError, SolverError, ValueError) as error:  # some damped modes cannot be separated, which is refused
        return None, None, str(error)


def against(
    scene: Scene,
    theirs: Any,
    again: Any,
    rtol: float,
    seed: int,
    numbers: Any = numbers_of,
    disturbed: Any = lambda scene, rng, by: scene,
) -> Verdict:
    """How the method does on a scene of known references; ``disturbed`` is what else is moved beside the start."""
    try:
        ours, end = (run(scene, Exponential(rtol), sampled=sampled) for sampled in (True, False))
    except (TooStiffError, RuntimeError, RuntimeWarning, ValueError) as error:
        both = isinstance(error, (TooStiffError, ValueError)) and theirs is None
        return Verdict("the reference failed" if both else f"{type(error).__name__}: {error}")
    if theirs is None:
        return Verdict("the reference failed", len(ours.contacts))
    if not (np.all(np.isfinite(ours.q)) and np.all(np.isfinite(ours.q_dot))):
        return Verdict("not finite")
    size, move = np.abs(theirs.q).max(), max(1e-7, 3.0 * rtol)
    exact = numbers(theirs, scene, size, scene.duration)
    amplification = amplified(scene, exact, size, move, seed, numbers, disturbed)
    other = numbers(again, scene, size, scene.duration)
    if amplification is None or other["order"] != exact["order"]:
        return Verdict("ill-conditioned")
    doubt = differences(other, exact, exact, scene.parts)
    found = [numbers(solution, scene, size, scene.duration) for solution in (ours, end)]
    for a in found:
        if a["order"] != exact["order"]:
            return Verdict(f"events {unlike(a['order'], exact['order'])}", len(exact["order"]))
    exact_end = {**exact, "q": exact["q"][-1:], "q_dot": exact["q_dot"][-1:]}
    if theirs.t[-1] < scene.duration * (1.0 - 1e-12):  # the last sample is not the end
        exact_end |= {"q": end.q, "q_dot": end.q_dot}
    errors = {}
    for a, b in zip(found, (exact, exact_end), strict=True):
        for name, apart in differences(a, b, exact, scene.parts).items():
            known = SCATTER * np.nan_to_num(doubt[name], posinf=0.0) / ALLOWED
            worst = (apart / (rtol * amplification[name] + 1e-11 + known)).max(initial=0.0)
            errors[name] = max(errors.get(name, 0.0), float(worst))
    verdict = Verdict("fine", len(exact["order"]), errors)
    errors["balance"] = imbalance(ours) / (rtol + 1e-11) * ALLOWED / BALANCE
    wrong = [f"{name} {error:.3g}" for name, error in errors.items() if not error <= ALLOWED]
    if wrong:
        verdict.kind = "errors " + ", ".join(wrong)
    return verdict


def unlike(ours: list[Any], theirs: list[Any]) -> str:
    """How two rows of events differ: what one has more often than the other."""
    counts = Counter(ours), Counter(theirs)
    return (
        f"{len(ours)} instead of {len(theirs)}, more {dict(counts[0] - counts[1])}, less {dict(counts[1] - counts[0])}"
    )


def amplified(
    scene: Scene, exact: dict[str, Any], size: float, move: float, seed: int, numbers: Any, disturbed: Any
) -> dict[str, Any] | None:
    """How much every number changes per relative move of the start, at least 1; None where contacts come or go."""
    rng, n = np.random.default_rng([seed, 2]), scene.system.size
    sizes = np.concatenate((np.abs(exact["q"]).max(axis=0), np.abs(exact["q_dot"]).max(axis=0)))
    amplification: dict[str, Any] = {}
    for _ in range(3):
        try:
            other_start = move * sizes * rng.choice([-1.0, 1.0], 2 * n)
            if scene.kept is not None:
                other_start -= np.linalg.pinv(scene.kept) @ (scene.kept @ other_start)
            moved = run(disturbed(scene, rng, move), DormandPrince(max(1e-12, 1e-3 * move)), other_start)
        except (TooStiffError, SolverError):
            return None
        other = numbers(moved, scene, size, scene.duration)
        if other["order"] != exact["order"]:
            return None
        for name, apart in differences(other, exact, exact, scene.parts).items():
            if not np.all(np.isfinite(apart)):  # a contact that ended does so no more
                return None
            amplification[name] = np.maximum(amplification.get(name, 1.0), apart / move)
    rows = [np.atleast_2d(c.direction) for c in scene.system.contacts]
    mobility = np.array([np.trace(row @ np.linalg.solve(scene.system.M, row.T)) for row in rows])
    shares = exact["work"] * mobility[exact["stop"]] / np.maximum(exact["scale"]["speed_in"], 1e-300) ** 2
    for name in ("speed_in", "speed_out", "energy_loss"):  # what is left of energies that cancel
        amplification[name] = np.maximum(amplification[name], shares)
    if max(float(np.max(a, initial=0.0)) for a in (amplification["q"], amplification["q_dot"])) > 1e4:
        return None
    return amplification


def judged(judge: Callable[..., Any], count: int, first: int, processes: int, *more: Any) -> Iterator[Any]:
    """What a judge says of seeds one after the other, by several processes; ``more`` are its further arguments."""
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(judge, range(first, first + count), *([one] * count for one in more), chunksize=2)


def main(judge: Callable[[int], tuple[str, Verdict]]) -> None:
    """Judge [count] systems from [first seed] on with [processes], the arguments; exits with 1 after a failure."""
    count, first, processes = [*map(int, sys.argv[1:4]), *(500, 0, 2)[len(sys.argv) - 1 :]]
    sys.exit(report(judged(judge, count, first, processes), count) > 0)


def told_apart(found: Iterator[tuple[str, list[str], int]], what: str, most: int | None = None) -> int:
    """Print what differs, at most so many lines of each, and how many there were of what kind; returns how many do."""
    kinds: Counter[str] = Counter()
    for words, wrong, contacts in found:
        kinds["contacts"] += contacts
        passed = wrong and wrong[0].split(":")[0] in ("ill-conditioned", "the reference failed", "refused")
        kinds[wrong[0].split(":")[0] if passed else "differ" if wrong else "agree"] += 1
        if wrong and wrong != ["ill-conditioned"]:
            print(words, *wrong[:most], sep="\n    ", flush=True)
    print(f"{what}: {dict(kinds)}")
    return kinds["differ"]


def report(found: Iterator[tuple[str, Verdict]], count: int) -> int:
    """Print failures as they come, then how large the errors were; returns the number of failures."""
    kinds: Counter[str] = Counter()
    errors: dict[str, list[float]] = {}
    events = 0
    for i, (words, verdict) in enumerate(found):
        passed = verdict.kind in ("fine", "ill-conditioned", "the reference failed", "refused by both")
        kinds[verdict.kind if passed else "failures"] += 1
        events += verdict.contacts if verdict.kind == "fine" else 0
        if not passed:
            print(f"{words}\n    {verdict.kind}", flush=True)
        for name, error in verdict.errors.items():
            errors.setdefault(name, []).append(error)
        if i % 100 == 99:
            print(f"... {i + 1}: {dict(kinds)}", flush=True)
    print(f"{count} systems, {events} events compared: {dict(kinds)}")
    for name, values in errors.items():
        at = np.quantile(values, [0.5, 0.99, 1.0])
        print(f"  {name:17s} error in units of rtol × amplification: median {at[0]:.2g}, 99 % {at[1]:.3g}, {at[2]:.3g}")
    return kinds["failures"]
