"""Ten ways to get a wrong answer from a beam and a stop, and what the library gives or says instead.

More modes than a step allows, contacts shorter than a step, grazing, chatter, a rule that gains energy, aliased modes,
a contact that never ends, a law that is singular at grazing: red is a naive method, blue this library. Small problems
with known answers, a function each.

    python examples/failure_gallery.py        prints the cases and writes failure_gallery.png
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

import contacts
import fembeam as fb
import solvers
from solvers import RK4, Contact, HenonRK2, Newmark, System

z_stop = 0.24445
scene = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=contacts.Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.Harmonic(amplitude=1e-3, omega=195.0),
)
BEST = solvers.Exponential(1e-11, ledger=False)
RED, BLUE = "#D55E00", "#0072B2"


@dataclass(frozen=True)
class Case:
    """Curves (x, y), what each method gives or says, and errors relative to the number that the case is about."""

    title: str
    labels: tuple[str, str]
    naive: tuple
    ours: tuple
    said: tuple[str, str]
    naive_error: float  # inf where a run is refused or stopped
    our_error: float
    scale: str = "linear"  # "log" (y) or "loglog"


def forced(system, start, duration, dt, method):
    """A run that the library would refuse."""
    method = replace(method, force_unstable=True)
    return solvers.integrate(system, *start, duration, dt, method, check=False)


def refusal(system, method, duration):
    """What the library says to such a step, shortened."""
    try:
        solvers.integrate(system, *at_rest(system), duration, method=method)
    except ValueError as error:
        return str(error).split(": ", 1)[1].split(";")[0]


def disagreement(system, start, duration):
    """Of the library's default method and the independent `DormandPrince`, at the end of a run."""
    methods = (None, solvers.DormandPrince(1e-11))
    one, two = (solvers.integrate(system, *start, duration, method=method).q[-1] for method in methods)
    return np.abs(one - two).max() / np.abs(two).max()


def at_rest(system):
    return np.zeros(system.size), np.zeros(system.size)


def heun_with_more_modes(modes):
    """Steps good for two modes blow up with more: Heun is limited by (8ζ)^⅓/ω of the fastest."""
    system, duration = scene.reduce(modes=modes).system, 0.1
    dt = 0.5 * HenonRK2(1.0, 1.0).stable_dt(scene.reduce(modes=2).system).flight
    method, start = HenonRK2(dt, dt / 4), at_rest(system)
    naive = forced(system, start, duration, dt, method)
    ours = solvers.integrate(system, *start, duration, dt, BEST)
    return Case(
        f"Heun, steps for 2 modes, with {modes}", ("time / ms", "energy / mJ"),
        *((1e3 * run.t[1:], 1e3 * run.energy.stored[1:]) for run in (naive, ours)),
        (f"grows until stopped at {1e3 * naive.t[-1]:.2g} ms",
         f"refuses Heun: {refusal(system, method, duration)}"),
        0.0 if naive.status.good else np.inf, disagreement(system, start, 0.03), "log",
    )  # fmt: skip


def jumped_contact():
    """A step longer than a contact passes through the stop."""
    law = contacts.Hysteretic.achieving(1e6, restitution=0.3)
    system = System([[1.0]], [[0.0]], [[400.0]], [Contact([1.0], law, 0.049)])
    duration, dt, start = 0.9, 4.5e-2, ([0.05], [0.0])
    naive = forced(system, start, duration, dt, RK4(dt, locate=False))
    ours = solvers.integrate(system, *start, duration, np.linspace(0.0, duration, 1000)[1], BEST)
    end = solvers.integrate(system, *start, duration, method=BEST).q[-1, 0]
    return Case(
        "A step over a whole contact", ("time / ms", "displacement / mm"),
        *((1e3 * run.t, 1e3 * run.q[:, 0]) for run in (naive, ours)),
        (f"RK4, 45 ms: {len(naive.contacts)} contacts",
         f"{len(ours.contacts)} contacts; refuses the step: {refusal(system, RK4(dt), duration)}"),
        *(abs(run.q[-1, 0] - end) / 0.05 for run in (naive, ours)),
    )  # fmt: skip


def henon_at_grazing():
    """Hénon's step divides by δ̇, which goes to zero as a swing only just reaches the stop."""
    omega, depths, before = 20.0, np.geomspace(1e-8, 1e-2, 25), 5e-3
    naive, ours = [], []
    for depth in depths:  # u = cos ωt, gap 1 - depth: enters at ωt = π - arccos(1 - depth)
        entry = (np.pi - np.arccos(1.0 - depth)) / omega
        naive.append(abs(henon_step(omega, entry - before, 1.0 - depth) / before - 1.0))
        system = System.modal([omega], 0.0, [Contact([1.0], contacts.Hertz(1.0), 1.0 - depth)])
        log = solvers.integrate(system, [1.0], [0.0], np.pi / omega, method=BEST).contacts
        ours.append(abs(log.t_in[0] - entry) / before)
    shown = np.isfinite(naive)
    return Case(
        "Hénon's step at grazing", ("depth of the dip / amplitude", "error of entry / step"),
        (depths[shown], np.maximum(np.array(naive)[shown], 1e-16)), (depths, np.maximum(ours, 1e-16)),
        ("δ̇ → 0: no entry, or a wrong one", "lands by Newton on exact flight"),
        max(naive[:5]), max(ours), "loglog",
    )  # fmt: skip


def henon_step(omega, t, gap):
    """Duration of one unguarded Hénon–Heun step of u = cos ωt onto δ = -u - gap = 0."""
    u, v = np.cos(omega * t), -omega * np.sin(omega * t)
    distance = gap + u  # to δ = 0
    second = -v + omega**2 * u * distance / -v  # δ̇ after an Euler step in δ
    return 0.5 * distance * (1.0 / -v + 1.0 / second) if second > 0.0 else np.inf


def two_entries_in_a_step():
    """A fast oscillation enters the stop twice within one step; both ends of the step are in flight."""
    omega, ripple, gap = 10.0, 800.0, 1.0055
    system = System.modal([omega, ripple], 0.0, [Contact([1.0, 1.0], contacts.Hertz(1e4), gap)])
    bottom, dt = np.pi / omega, 4.05 * np.pi / ripple
    start, duration = ([1.0, 0.01], [0.0, 0.0]), bottom + dt
    naive = forced(system, start, duration, dt, Newmark(dt, locate=False))
    ours = solvers.integrate(system, *start, duration, 1e-5, BEST)
    late = (run.t > bottom - 2 * dt for run in (naive, ours))
    return Case(
        "Two entries in one step", ("time from the bottom / ms", "displacement - gap / amplitude"),
        *((1e3 * (run.t[i] - bottom), run.q[i].sum(axis=1) + gap) for run, i in zip((naive, ours), late, strict=True)),
        (f"Newmark, 16 ms: {len(naive.contacts)} contacts", f"{len(ours.contacts)} contacts, proven to miss none"),
        1.0 - len(naive.contacts) / len(ours.contacts), disagreement(system, start, duration),
    )  # fmt: skip


def chatter():
    """A ball that comes to rest in ever shorter bounces, all inside a few steps in the end."""
    law = contacts.Hysteretic.achieving(1e8, restitution=0.6)
    system = System([[1.0]], [[0.0]], [[0.0]], [Contact([1.0], law)], [([-9.81], np.ones_like)])
    start, duration, dt = ([0.05], [0.0]), 1.0, 1e-3
    naive = forced(system, start, duration, dt, RK4(3e-3, locate=False))
    ours = solvers.integrate(system, *start, duration, dt, solvers.Exponential(1e-10))
    left, rest = (np.abs(run.q[run.t > 0.7, 0]) for run in (naive, ours))
    highest = left.max() if left.size else np.inf
    last = f"still {1e3 * highest:.2g} mm high" if naive.status.good else f"stopped at {naive.t[-1]:.2g} s"
    return Case(
        "Chatter", ("time / s", "height / mm"),
        (naive.t, 1e3 * np.maximum(naive.q[:, 0], -0.01)), (ours.t, 1e3 * ours.q[:, 0]),
        (f"RK4, 3 ms: {last}", f"at rest after {len(ours.contacts)} contacts"),
        highest / 0.05, rest.max() / 0.05,
    )  # fmt: skip


def newmark_gains_energy():
    """The trapezoidal rule keeps the energy of a linear structure, but not through a stop."""
    system = System.modal([10.0], 0.0, [Contact([1.0], contacts.PiecewiseLinear([1e7]))])
    start, duration, dt = ([1.0], [0.0]), 1.5, 1e-3
    naive = forced(system, start, duration, dt, Newmark(dt, locate=False))
    ours = solvers.integrate(system, *start, duration, dt, BEST)
    flights = [run.q[:, 0] > 0.0 for run in (naive, ours)]
    (t, gained), (t_ours, kept) = (
        (run.t[i], run.energy.stored[i] / run.energy.initial) for run, i in zip((naive, ours), flights, strict=True)
    )
    return Case(
        "Newmark at an elastic stop", ("time / s", "energy / initial"), (t, gained), (t_ours, kept),
        (f"trapezoidal rule, 1 ms: {gained.max():.2g} times its energy; then stopped", "keeps it to 1e-8"),
        np.abs(gained - 1.0).max(), np.abs(kept - 1.0).max(), "log",
    )  # fmt: skip


def aliased_high_modes():
    """A step that does not resolve the tenth mode is stable by Newmark's rule, but its frequency is wrong."""
    system = scene.reduce(modes=10).system
    start = at_rest(system)
    first = solvers.integrate(system, *start, 0.1, method=BEST).contacts.t_in[0]
    duration = first + 2e-3
    runs = [solvers.integrate(system, *start, duration, 2e-6, method) for method in (Newmark(1e-4), BEST)]
    t, naive, ours = runs[0].t, runs[0].q_dot[:, -1], runs[1].q_dot[:, -1]
    near, scale = t > first - 2e-4, np.abs(ours).max()
    return Case(
        "Aliased high modes in contact", ("time after entry / ms", "rate of mode 10 / largest"),
        *((1e3 * (t[near] - first), rate[near] / scale) for rate in (naive, ours)),
        ("Newmark, 0.1 ms: stable, but hω = 3.3", "checks each mode on its nodes"),
        np.abs(naive - ours).max() / scale, disagreement(system, start, duration),
    )  # fmt: skip


def preloaded_contact():
    """In a contact that never ends a small-step phase never ends either, and its limit is the one that counts."""
    law, depth, omega, w = contacts.Hertz(1e8), 1e-3, np.array([20.0, 150.0]), np.array([1.0, 0.7])
    rest = w * law.force(depth, 0.0, 1.0) / omega**2
    system = System.modal(omega, 0.02, [Contact(w, law, float(-w @ rest - depth))])
    dt = 2.0 * HenonRK2(1.0, 1.0).stable_dt(system, depth).contact
    start, duration = (rest + 1e-6, np.zeros(2)), 3000 * dt
    naive = forced(system, start, duration, dt, HenonRK2(dt, dt))
    ours = solvers.integrate(system, *start, duration, dt, BEST)
    away, near = (1e6 * np.abs(run.q @ w - rest @ w) for run in (naive, ours))
    return Case(
        "Preloaded, permanent contact", ("time / ms", "distance from rest / μm"),
        (1e3 * naive.t, np.maximum(away, 1e-3)), (1e3 * ours.t, np.maximum(near, 1e-3)),
        (f"Heun at twice its limit: {away.max() / near.max():.0f} times too far", "one contact, no step to choose"),
        away.max() / near.max(), near.max() / near[0] - 1.0, "log",
    )  # fmt: skip


def singular_latch():
    """F = K δ^1.5 (1 + a δ̇/entry_rate) is singular where the entry rate goes to zero, as at grazing under load."""
    law, speeds = contacts.Hysteretic(1e8, 0.5), np.geomspace(1e-9, 1e-1, 25)
    naive, ours = (
        np.array([dashpot(replace(law, entry_rate_floor=floor), speed) for speed in speeds])
        for floor in (1e-15, law.entry_rate_floor)
    )
    pressed = System([[1.0]], [[0.0]], [[0.0]], [Contact([1.0], law)], [([-1.0], np.ones_like)])
    return Case(
        "Latched damping at grazing", ("entry rate / (m/s)", "dashpot at 10 μm / (N s/m)"),
        (speeds, naive), (speeds, ours),
        ("a/entry_rate without bound", "entry rate clipped, and the log says where"),
        naive[0] / ours[0], disagreement(pressed, ([1e-15], [-1e-6]), 0.05), "loglog",
    )  # fmt: skip


def dashpot(law, speed):
    """∂F/∂δ̇ at δ = 10 μm."""
    without, with_rate = law.force(np.full(2, 1e-5), np.array([0.0, 1e-3]), speed)
    return (with_rate - without) / 1e-3


@fb.plot.styled
def drawn(cases):
    """A panel each: the naive method in red, this library in blue, below the title what they say."""
    figure, rows = Figure(figsize=(9.6, 2.75 * len(cases) / 2), layout="constrained"), len(cases) // 2
    for axis, case in zip(figure.subplots(rows, 2).flat, cases, strict=True):
        axis.plot(*case.ours, color=BLUE, lw=1.3)
        axis.plot(*case.naive, color=RED, lw=0.9, marker="o" if len(case.naive[0]) < 40 else "", ms=3)
        if case.scale != "linear":
            axis.set_yscale("log")
        if case.scale == "loglog":
            axis.set_xscale("log")
        axis.set(xlabel=case.labels[0], ylabel=case.labels[1])
        axis.set_title(case.title, fontweight="bold", pad=29)
        for height, colour, words in zip((25, 14), (RED, BLUE), case.said, strict=True):
            axis.annotate(words, (0.0, 1.0), (0, height), "axes fraction", "offset points", color=colour, fontsize=7.5,
                          va="top")  # fmt: skip
    return figure


cases = [
    heun_with_more_modes(3),
    heun_with_more_modes(10),
    jumped_contact(),
    henon_at_grazing(),
    two_entries_in_a_step(),
    chatter(),
    newmark_gains_energy(),
    aliased_high_modes(),
    preloaded_contact(),
    singular_latch(),
]

for case in cases:
    assert case.naive_error > 0.05, f"{case.title}: the naive method is only {case.naive_error:.1e} off"
    assert case.our_error < 1e-3, f"{case.title}: ours is {case.our_error:.1e} off"

if __name__ == "__main__":
    for case in cases:
        print(f"{case.title}\n    naive: {case.said[0]}\n    ours:  {case.said[1]}")
    drawn(cases).savefig("failure_gallery.png", dpi=90, metadata={"Software": None})
