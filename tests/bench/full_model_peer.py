r"""The full finite-element model against OpenSees: the same matrices, the same law, the same base motion, one chart.

``python tests/bench/full_model_peer.py [--elements 16] [--chart FILE.png]`` runs the paper's scene over three drive
periods from rest, unreduced and with a few modes, and the same mesh in OpenSees (``openseespy`` of the extra `bench`;
without it only this library is measured). Before anything is timed the natural frequencies must agree.

.. math:: M\ddot u + (αM + βK)\dot u + K u = -M r\,\ddot y + w F,\quad F = K_h δ^{3/2} (1 + a \dot δ/\dot δ^-)

Settings of OpenSees: elasticBeamColumn with consistent mass; Hertzdamp in a zeroLength element, the same law, its rate
latched in the step that finds the contact; base motion as the nodal forces -M r y''; the trapezoidal rule, the most
accurate of its integrators here (HHT, generalised α, TRBDF2 are two to three times less so at the same step);
ProfileSPD; Newton on the initial tangent, 1.5 times as fast as Newton, which Hertzdamp's tangent of the wrong sign
fails above 2e-5 s. All steps of a run are one call.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from reference import LENGTH, OMEGA, TIP, paper_scene

import fembeam as fb
from solvers import Exponential, GeneralizedAlpha, Newmark

DURATION = 6.0 * math.pi / OMEGA
STEPS = 1e-4, 3e-5, 1e-5
ALPHA, BETA = 4.14, 1.87e-5  # damping ratios 0.02 and 0.01 of the first two modes
METHODS = [
    *(Exponential(rtol) for rtol in (1e-4, 1e-6, 1e-8, 1e-10)),
    *(method(dt) for method in (Newmark, GeneralizedAlpha) for dt in (*STEPS, 3e-6)),
]


def problem() -> fb.Scene:
    """The paper's scene with Rayleigh's damping; its base sets out without acceleration, as OpenSees expects it."""
    return replace(paper_scene(), damping=fb.Rayleigh(ALPHA, BETA), base=fb.Harmonic(1e-3, OMEGA, phase=-0.5 * math.pi))


class OpenSees:
    """The mesh of a scene in OpenSees."""

    def __init__(self, of: fb.Scene, elements: int) -> None:
        self.ops, self.scene = _opensees(), of
        self.matrices = of.matrices(elements)
        self.nodes = np.asarray(of.reduce(modes=2, elements=elements).shapes.nodes)
        self.tip = int(np.argmin(np.abs(self.nodes - TIP))) + 1

    def build(self) -> None:
        """Nodes, elements, the tip's mass, the stop, and the forces of the moving base."""
        ops, section, stop = self.ops, self.scene.beam.spans[0][1], self.scene.stops[0]
        ops.wipe()
        ops.model("basic", "-ndm", 2, "-ndf", 3)
        for i, z in enumerate(self.nodes, 1):
            ops.node(i, float(z), 0.0)
            ops.fix(i, *((1, 1, 1) if i == 1 else (1, 0, 0)))
        ops.geomTransf("Linear", 1)
        for i in range(1, len(self.nodes)):
            stiffness, density = (section.A, section.E, section.I), section.rho * section.A
            ops.element("elasticBeamColumn", i, i, i + 1, *stiffness, 1, "-mass", density, "-cMass")
        lump = self.scene.masses[0]
        ops.mass(self.tip, lump.mass, lump.mass, lump.inertia)
        ground, law = 10_000, stop.law
        ops.node(ground, TIP, 0.0)
        ops.fix(ground, 1, 1, 1)
        ops.uniaxialMaterial("HertzDamp", 1, law.stiffness, float(law.damping_factor), -1e-300, law.exponent)
        ops.element("zeroLength", ground, ground, self.tip, "-mat", 1, "-dir", 2)
        ops.rayleigh(ALPHA, 0.0, BETA, 0.0)
        base = self.scene.base
        ops.timeSeries("Trig", 1, 0.0, 1e3, 2.0 * math.pi / OMEGA, "-factor", base.amplitude * OMEGA**2)
        ops.pattern("Plain", 1, 1)
        for i, (force, moment) in enumerate(self.matrices.base_load.reshape(-1, 2), 2):
            ops.load(i, 0.0, float(force), float(moment))

    def frequencies(self) -> np.ndarray:
        """All natural frequencies in rad/s, from the matrices it has assembled."""
        from scipy.linalg import eigh

        K, M = (self._matrix(*weights) for weights in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
        return np.sqrt(eigh(K, M, eigvals_only=True))

    def _matrix(self, *weights: float) -> np.ndarray:
        """A weighted sum of M, C, K."""
        ops = self.ops
        self.build()
        self._analysis("FullGeneral", ("Linear",), ("GimmeMCK", *weights))
        ops.analyze(1, 0.0)
        return np.array(ops.printA("-ret")).reshape(2 * (ops.systemSize(),))

    def _analysis(self, matrix: str, algorithm: tuple, integrator: tuple) -> None:
        """The solution's parts."""
        ops = self.ops
        ops.constraints("Plain")
        ops.numberer("RCM" if matrix == "ProfileSPD" else "Plain")
        ops.system(matrix)
        ops.test("NormDispIncr", 1e-11, 50, 0)
        ops.algorithm(*algorithm)
        ops.integrator(*integrator)
        ops.analysis("Transient")

    def run(self, dt: float) -> tuple[float, float]:
        """(seconds, tip at the end)."""
        self.build()
        self._analysis("ProfileSPD", ("ModifiedNewton", "-initial"), ("Newmark", 0.5, 0.25))
        steps = round(DURATION / dt)
        started = time.perf_counter()
        failed = self.ops.analyze(steps, DURATION / steps)
        took = time.perf_counter() - started
        return took, math.nan if failed else float(self.ops.nodeDisp(self.tip, 2))


def _opensees() -> Any:
    """The module; on Linux it looks for the BLAS it brings along only where the loader has been told to."""
    import ctypes
    import importlib.util

    found = importlib.util.find_spec("openseespylinux")
    for folder in (found.submodule_search_locations or []) if found else []:
        for name in ("libgfortran.so.4", "libblas.so.3"):
            if (file := Path(folder, "lib", name)).exists():
                ctypes.CDLL(str(file), mode=ctypes.RTLD_GLOBAL)
    import openseespy.opensees as ops

    return ops


@contextmanager
def _silent() -> Iterator[None]:
    """Without the line that Hertzdamp writes at every impact."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def peer_points(of: fb.Scene, elements: int, truth: float) -> list[fb.study.Point]:
    """OpenSees at all steps, the faster of two runs each; nothing with a notice where it is not installed."""
    try:
        peer = OpenSees(of, elements)
    except (ImportError, RuntimeError, OSError) as fault:
        print(f"left out: OpenSees: {fault}; pip install openseespy")
        return []
    points, size = [], 2 * elements
    with _silent():
        own = of.reduce(modes="all", elements=elements).omega
        apart = float(np.abs(peer.frequencies() / own - 1.0).max())
        if not apart < 1e-9:
            raise SystemExit(f"natural frequencies differ by {apart:.1e}")
        for dt in STEPS:
            took, tip = zip(*(peer.run(dt) for _ in range(2)), strict=True)
            error = np.array([abs(tip[0] - truth) / LENGTH])
            spent = np.array([min(took)])
            points.append(fb.study.Point("OpenSees", f"dt={dt:g}", size, spent, error, error, math.nan, DURATION / dt))
    print(f"OpenSees: all {size} natural frequencies agree to {apart:.0e}")
    return points


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--elements", type=int, default=16)
    parser.add_argument("--chart", metavar="FILE.png")
    given, of = parser.parse_args(), problem()
    full = of.reduce(modes="all", elements=given.elements)
    models = [of.reduce(modes=n, elements=given.elements) for n in (2, 5, 10)] + [full]
    found = fb.study.speed_accuracy(models, METHODS, np.zeros((1, 4)), DURATION, rounds=5)
    truth = float(full.phi(TIP) @ full.simulate(DURATION, solver=Exponential(1e-12, ledger=False)).q[-1])
    mine = [
        replace(p, errors=p.errors * found.unit / LENGTH, totals=p.totals * found.unit / LENGTH) for p in found.points
    ]
    reduction, floor = ({n: e * found.unit / LENGTH for n, e in d.items()} for d in (found.reduction, found.floor))
    points = mine + peer_points(of, given.elements, truth)
    chart = fb.study.SpeedAccuracy(points, LENGTH, floor, reduction, "tip after three periods / 1 mm")
    print(chart)
    for point in points[len(mine) :]:
        fast = next(p for p in mine if p.modes == point.modes and p.error <= point.error)
        print(f"OpenSees {point.setting}: {point.time / fast.time:.0f} times the time of "
              f"{fast.method}({fast.setting}), which is {point.error / fast.error:.0f} times as accurate")  # fmt: skip
    if given.chart:
        fb.plot.speed_accuracy(chart).savefig(given.chart, dpi=100)


if __name__ == "__main__":
    main()
