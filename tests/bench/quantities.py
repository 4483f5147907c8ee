"""What accuracy buys: the errors of a trajectory, of an orbit, and of statistics of a long response, one panel each.

``python tests/bench/quantities.py [--chart FILE.png]``, about two minutes. The paper's scene with two modes. The
trajectory is the tip after three drive periods; the orbit is the amplitude of δ to which a run near a stable orbit has
settled after thirty periods, with the method's own steps; the statistics are contacts per second and the spectrum of δ
over 20 s of noise. There the two references, exact as each is, differ by the scatter of a chaotic response (dashed):
no method can be told from another below it, and the loosest tolerance serves.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import Any

from reference import OMEGA, paper_scene

import fembeam as fb
from fembeam.study.measure import cut
from fembeam.study.quantities import Amplitude, ImpactRate, Psd
from solvers import RK4, DormandPrince, Exponential, HenonRK2, Newmark

PERIOD = 2.0 * math.pi / OMEGA
METHODS: list[Any] = [
    *(Exponential(rtol, ledger=False) for rtol in (1e-2, 1e-4, 1e-6, 1e-8)),
    *(DormandPrince(rtol) for rtol in (1e-4, 1e-6, 1e-8)),
    *(method(dt) for method in (RK4, Newmark) for dt in (1e-4, 3e-5, 1e-5)),
    *(HenonRK2(dt, dt / 5) for dt in (1e-4, 3e-5, 1e-5)),
]


def settled_amplitude(run: Any) -> float:
    """Amplitude of δ over the last two periods."""
    return Amplitude()(cut(run, run.t[-1] - 2.0 * PERIOD, run.t[-1]))


def studies() -> Iterator[tuple[str, fb.study.SpeedAccuracy]]:
    """(title, study), one after the other."""
    model = paper_scene().reduce(modes=2)
    noisy = paper_scene(fb.BandNoise(2.5e-4, (0.0, 1226.6), seed=1)).reduce(modes=2)
    orbit = model.orbit(period=1)
    if not orbit.stable:
        raise SystemExit(f"no stable orbit: {orbit}")
    near = orbit.state * 1.02
    ask, long = fb.study.speed_accuracy, {"starts": 2, "duration": 20.0, "rounds": 1}
    yield "trajectory: tip after three periods", ask(model, METHODS, 4, 3.0 * PERIOD, rounds=3)
    settle = near, 30.0 * PERIOD, PERIOD / 60.0, settled_amplitude
    yield "orbit: amplitude of δ it settles to", ask(model, METHODS, *settle, rounds=2)
    yield "statistics: contacts per second", ask(noisy, METHODS, quantity=ImpactRate(), agreement=0.3, **long)
    yield "statistics: spectrum of δ", ask(noisy, METHODS, dt=1e-3, quantity=Psd(parts=6), agreement=1.0, **long)


def chart(found: dict[str, fb.study.SpeedAccuracy]) -> Any:
    """Error against time, one panel per quantity; dashed what the references themselves differ by."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    for ax, (title, study) in zip(figure.subplots(2, 2, sharex=True).ravel(), found.items(), strict=True):
        for method, marker in zip(dict.fromkeys(p.method for p in study.points), "osD^v", strict=True):
            mine = [p for p in study.points if p.method == method and p.seconds.size]
            errors = [max(p.error, 1e-14) for p in mine]
            ax.loglog(errors, [1e3 * p.time for p in mine], f"{marker}-", ms=4, label=method)
        ax.axvline(max(study.floor.values()), color="grey", ls="--", lw=0.9)
        ax.set(title=title, xlabel="relative error", ylabel="time of a run / ms", xlim=(1.0, 1e-12))
        ax.grid(alpha=0.25, lw=0.5)
    figure.axes[0].legend()
    return figure


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chart", metavar="FILE.png")
    given, found = parser.parse_args(), {}
    for title, study in studies():
        found[title] = study
        print(f"\n{title}\n{study}", flush=True)
    if given.chart:
        chart(found).savefig(given.chart, dpi=100)


if __name__ == "__main__":
    main()
