"""Failures of naive methods beside what this library gives: small problems with known answers, seconds in all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import contacts
import solvers
from solvers import Contact, System

if TYPE_CHECKING:
    from fembeam.scene import Scene

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector]


@dataclass(frozen=True, eq=False)
class Failure:
    """One case.

    Attributes
    ----------
    title, x_label, y_label : of its panel. naive, ours : (x, y) curves. said : what each gives or says, two sentences.
    naive_error, our_error : relative errors of the number the case is about; inf where a run is refused or stopped.
    scale : "linear", "log" (y) or "loglog".
    """

    title: str
    x_label: str
    y_label: str
    naive: Curve
    ours: Curve
    said: tuple[str, str]
    naive_error: float
    our_error: float
    scale: str = "linear"

    def __repr__(self) -> str:
        return f"<failure: {self.title}, error {self.naive_error:.2g}, ours {self.our_error:.2g}>"


def gallery(scene: Scene) -> list[Failure]:
    """All cases; ``scene`` is the beam of those with many modes, with one Hertz-like stop at its gap of zero.

    Draw them with ``fb.plot.failures``; each case is a function of its own too.

    Examples
    --------
    >>> case = jumped_contact()
    >>> print(case.title, case.our_error < 1e-6 < case.naive_error)
    A step over a whole contact True
    """
    return [
        heun_with_more_modes(scene, 3),
        heun_with_more_modes(scene, 10),
        jumped_contact(),
        henon_at_grazing(),
        two_entries_in_a_step(),
        chatter(),
        newmark_gains_energy(),
        aliased_high_modes(scene),
        preloaded_contact(),
        singular_latch(),
    ]


def heun_with_more_modes(scene: Scene, modes: int) -> Failure:
    """Steps good for two modes blow up with more: Heun is limited by (8ζ)^⅓/ω of the fastest."""
    model, duration = scene.reduce(modes=modes), 0.1
    dt = 0.5 * solvers.HenonRK2(1.0, 1.0).stable_dt(scene.reduce(modes=2).system).flight
    method = solvers.HenonRK2(dt, dt / 4)
    run = solvers.integrate(*_at_rest(model.system), duration, dt, _forced(method), check=False)
    best = solvers.integrate(*_at_rest(model.system), duration, dt, _best())
    return Failure(
        f"Heun, steps for 2 modes, with {modes}",
        *("time / ms", "energy / mJ"),
        (1e3 * run.t[1:], 1e3 * run.energy.stored[1:]),
        (1e3 * best.t[1:], 1e3 * best.energy.stored[1:]),
        (
            f"grows until stopped at {1e3 * run.t[-1]:.2g} ms",
            f"refuses Heun: {_refusal(model.system, method, duration)}",
        ),
        *(np.inf if not run.status.good else 0.0, _disagreement(*_at_rest(model.system), 0.03)),
        scale="log",
    )


def jumped_contact() -> Failure:
    """A step longer than a contact passes through the stop."""
    law = contacts.Hysteretic.achieving(1e6, restitution=0.3)
    system = System([[1.0]], [[0.0]], [[400.0]], [_stop([1.0], law, 0.049)])
    duration, start = 0.9, ([0.05], [0.0])
    times = np.linspace(0.0, duration, 1000)
    naive = solvers.integrate(system, *start, duration, 4.5e-2, _forced(solvers.RK4(4.5e-2, locate=False)), check=False)
    best = solvers.integrate(system, *start, duration, times[1], _best())
    end = float(solvers.integrate(system, *start, duration, method=_best()).q[-1, 0])
    refused = _refusal(system, solvers.RK4(4.5e-2), duration)
    return Failure(
        "A step over a whole contact",
        *("time / ms", "displacement / mm"),
        (1e3 * naive.t, 1e3 * naive.q[:, 0]),
        (1e3 * best.t, 1e3 * best.q[:, 0]),
        (f"RK4, 45 ms: {len(naive.contacts)} contacts", f"{len(best.contacts)} contacts; refuses the step: {refused}"),
        *(abs(naive.q[-1, 0] - end) / 0.05, abs(best.q[-1, 0] - end) / 0.05),
    )


def henon_at_grazing() -> Failure:
    """Hénon's step divides by δ̇, which goes to zero as a swing only just reaches the stop."""
    omega, depths = 20.0, np.geomspace(1e-8, 1e-2, 25)
    naive, ours = [], []
    for depth in depths:  # u = cos ωt, gap 1 - depth: enters at ωt = π - arccos(1 - depth)
        entry = (np.pi - np.arccos(1.0 - depth)) / omega
        before = entry - 5e-3
        found = before + _henon(omega, before, 1.0 - depth)
        naive.append(abs(found - entry) / 5e-3 if np.isfinite(found) else np.inf)
        stop = _stop([1.0], contacts.Hertz(1.0), 1.0 - depth)
        log = solvers.integrate(
            System.modal([omega], 0.0, [stop]), [1.0], [0.0], np.pi / omega, method=_best()
        ).contacts
        ours.append(abs(log.t_in[0] - entry) / 5e-3)
    shown = np.isfinite(naive)
    return Failure(
        "Hénon's step at grazing",
        *("depth of the dip / amplitude", "error of entry / step"),
        (depths[shown], np.maximum(np.array(naive)[shown], 1e-16)),
        (depths, np.maximum(ours, 1e-16)),
        ("δ̇ → 0: no entry, or a wrong one", "lands by Newton on exact flight"),
        *(float(np.max(naive[:5])), float(np.max(ours))),
        scale="loglog",
    )


def _stop(direction: Any, law: Any, gap: float = 0.0) -> Contact:
    """A contact."""
    return Contact(np.array(direction), law, gap)


def _henon(omega: float, t: float, gap: float) -> float:
    """Duration of one unguarded Hénon–Heun step of u = cos ωt onto δ = -u - gap = 0."""
    u, v = np.cos(omega * t), -omega * np.sin(omega * t)
    distance = gap + u  # to δ = 0
    second = -v + omega**2 * u * distance / -v  # δ̇ after an Euler step in δ
    return float(0.5 * distance * (1.0 / -v + 1.0 / second)) if second > 0.0 else np.inf


def two_entries_in_a_step() -> Failure:
    """A fast oscillation enters the stop twice within one step; both ends of the step are in flight."""
    omega, ripple = 10.0, 800.0
    system = System.modal([omega, ripple], 0.0, [_stop([1.0, 1.0], contacts.Hertz(1e4), 1.0055)])
    bottom, dt = np.pi / omega, 4.05 * np.pi / ripple
    start, duration = ([1.0, 0.01], [0.0, 0.0]), bottom + dt
    naive = solvers.integrate(system, *start, duration, dt, _forced(solvers.Newmark(dt, locate=False)))
    best = solvers.integrate(system, *start, duration, 1e-5, _best())
    late = best.t > bottom - 2 * dt
    seen = naive.t > bottom - 2 * dt
    return Failure(
        "Two entries in one step",
        *("time from the bottom / ms", "displacement - gap / amplitude"),
        (1e3 * (naive.t[seen] - bottom), naive.q[seen].sum(axis=1) + 1.0055),
        (1e3 * (best.t[late] - bottom), best.q[late].sum(axis=1) + 1.0055),
        (f"Newmark, 16 ms: {len(naive.contacts)} contacts", f"{len(best.contacts)} contacts, proven to miss none"),
        *(1.0 - len(naive.contacts) / len(best.contacts), _disagreement(system, *start, duration)),
    )


def chatter() -> Failure:
    """A ball that comes to rest in ever shorter bounces, all inside a few steps in the end."""
    law = contacts.Hysteretic.achieving(1e8, restitution=0.6)
    system = System([[1.0]], [[0.0]], [[0.0]], [_stop([1.0], law)], [([-9.81], np.ones_like)])
    start, duration = ([0.05], [0.0]), 1.0
    naive = solvers.integrate(system, *start, duration, 1e-3, _forced(solvers.RK4(3e-3, locate=False)), check=False)
    best = solvers.integrate(system, *start, duration, 1e-3, solvers.Exponential(1e-10))
    late = naive.t > 0.7
    highest = float(np.abs(naive.q[late, 0]).max(initial=0.0)) if late.any() else np.inf
    last = f"stopped at {naive.t[-1]:.2g} s" if not naive.status.good else f"still {1e3 * highest:.2g} mm high"
    return Failure(
        "Chatter",
        *("time / s", "height / mm"),
        (naive.t, 1e3 * np.maximum(naive.q[:, 0], -0.01)),
        (best.t, 1e3 * best.q[:, 0]),
        (f"RK4, 3 ms: {last}", f"at rest after {len(best.contacts)} contacts"),
        *(highest / 0.05, float(np.abs(best.q[best.t > 0.7, 0]).max()) / 0.05),
    )


def newmark_gains_energy() -> Failure:
    """The trapezoidal rule keeps the energy of a linear structure, but not through a stop."""
    system = System.modal([10.0], 0.0, [_stop([1.0], contacts.PiecewiseLinear([1e7]))])
    start, duration, dt = ([1.0], [0.0]), 1.5, 1e-3
    naive = solvers.integrate(system, *start, duration, dt, _forced(solvers.Newmark(dt, locate=False)), check=False)
    best = solvers.integrate(system, *start, duration, dt, _best())
    flight, swing = naive.q[:, 0] > 0.0, best.q[:, 0] > 0.0
    return Failure(
        "Newmark at an elastic stop",
        *("time / s", "energy / initial"),
        (naive.t[flight], naive.energy.stored[flight] / naive.energy.initial),
        (best.t[swing], best.energy.stored[swing] / best.energy.initial),
        (
            f"trapezoidal rule, 1 ms: {naive.energy.stored[flight].max() / 50.0:.2g} times its energy; then stopped",
            "keeps it to 1e-8",
        ),
        *(float(np.abs(naive.energy.stored[flight] / 50.0 - 1.0).max()),
          float(np.abs(best.energy.stored[swing] / 50.0 - 1.0).max())),
        scale="log",
    )  # fmt: skip


def aliased_high_modes(scene: Scene) -> Failure:
    """A step that does not resolve the tenth mode is stable by Newmark's rule, but its frequency is wrong."""
    model, dt = scene.reduce(modes=10), 1e-4
    first = solvers.integrate(*_at_rest(model.system), 0.1, method=_best()).contacts.t_in[0]
    duration = float(first) + 2e-3
    shown = {}
    for name, method in (("naive", solvers.Newmark(dt)), ("ours", _best())):
        run = solvers.integrate(*_at_rest(model.system), duration, 2e-6, method)
        kept = run.t > first - 2e-4
        shown[name] = run.t[kept], run.q_dot[kept, -1]
    naive, best = shown["naive"], shown["ours"]
    scale = float(np.abs(best[1]).max())
    return Failure(
        "Aliased high modes in contact",
        *("time after entry / ms", "rate of mode 10 / largest"),
        (1e3 * (naive[0] - first), naive[1] / scale),
        (1e3 * (best[0] - first), best[1] / scale),
        ("Newmark, 0.1 ms: stable, but hω = 3.3", "checks each mode on its nodes"),
        *(float(np.abs(naive[1] - best[1]).max()) / scale, _disagreement(*_at_rest(model.system), duration)),
    )


def preloaded_contact() -> Failure:
    """In a contact that never ends a small-step phase never ends either, and its limit is the one that counts."""
    law, depth = contacts.Hertz(1e8), 1e-3
    w = np.array([1.0, 0.7])
    rest = w * float(law.force(depth, 0.0, 1.0)) / np.array([20.0, 150.0]) ** 2
    system = System.modal([20.0, 150.0], 0.02, [_stop(w, law, float(-w @ rest - depth))])
    dt = 2.0 * solvers.HenonRK2(1.0, 1.0).stable_dt(system, depth).contact
    start, duration = (rest + 1e-6, np.zeros(2)), 3000 * dt
    naive = solvers.integrate(system, *start, duration, dt, _forced(solvers.HenonRK2(dt, dt)), check=False)
    best = solvers.integrate(system, *start, duration, dt, _best())
    away, near = (1e6 * np.abs(run.q @ w - rest @ w) for run in (naive, best))
    return Failure(
        "Preloaded, permanent contact",
        *("time / ms", "distance from rest / μm"),
        (1e3 * naive.t, np.maximum(away, 1e-3)),
        (1e3 * best.t, np.maximum(near, 1e-3)),
        (f"Heun at twice its limit: {away.max() / near.max():.0f} times too far", "one contact, no step to choose"),
        *(float(away.max() / near.max()), float(near.max() / near[0] - 1.0)),
        scale="log",
    )


def singular_latch() -> Failure:
    """F = K δ^1.5 (1 + a δ̇/entry_rate) is singular where the entry rate goes to zero, as at grazing under load."""
    speeds = np.geomspace(1e-9, 1e-1, 25)
    law = contacts.Hysteretic(1e8, 0.5)
    pressed = System([[1.0]], [[0.0]], [[0.0]], [_stop([1.0], law)], [([-1.0], np.ones_like)])
    peaks: dict[str, list[float]] = {"naive": [], "ours": []}
    for speed in speeds:
        for name, floor in (("naive", 1e-15), ("ours", law.entry_rate_floor)):
            peaks[name].append(_dashpot(contacts.Hysteretic(1e8, 0.5, entry_rate_floor=floor), float(speed)))
    return Failure(
        "Latched damping at grazing",
        *("entry rate / (m/s)", "dashpot at 10 μm / (N s/m)"),
        (speeds, np.array(peaks["naive"])),
        (speeds, np.array(peaks["ours"])),
        ("a/entry_rate without bound", "entry rate clipped, and the log says where"),
        *(peaks["naive"][0] / peaks["ours"][0], _disagreement(pressed, [1e-15], [-1e-6], 0.05)),
        scale="loglog",
    )


def _dashpot(law: Any, speed: float) -> float:
    """∂F/∂δ̇ at δ = 10 μm."""
    force = law.force(np.full(2, 1e-5), np.array([0.0, 1e-3]), speed)
    return float(force[1] - force[0]) / 1e-3


def _best() -> Any:
    """The method that gives what is right."""
    return solvers.Exponential(1e-11, ledger=False)


def _disagreement(system: System, q: Any, q_dot: Any, duration: float) -> float:
    """Of the library's default method and the independent `DormandPrince`, at the end of a run."""
    one, two = (
        solvers.integrate(system, q, q_dot, duration, method=method).q[-1]
        for method in (None, solvers.DormandPrince(1e-11))
    )
    return float(np.abs(one - two).max() / np.abs(two).max())


def _at_rest(system: System) -> tuple[System, Vector, Vector]:
    """Arguments of `integrate`."""
    return system, np.zeros(system.size), np.zeros(system.size)


def _forced(method: Any) -> Any:
    """The method without its refusal."""
    from dataclasses import replace

    return replace(method, force_unstable=True)


def _refusal(system: System, method: Any, duration: float) -> str:
    """What the library says to such a step, shortened; empty if nothing."""
    from solvers.stepping.constant_step import check_stability

    try:
        check_stability(method, system, duration)
    except ValueError as error:
        return str(error).split(": ", 1)[1].split(";")[0]
    return ""
