"""Where the nodes go: on every feature, and as dense as the bending waves of the highest mode kept ask for.

Relative error of ω on cubic Hermite elements of length h: (κ h)⁴/1440, with the wavenumber κ of
EI κ⁴ - |N| κ² = max(ρA ω², k), which also covers the boundary layers of tension and foundation. In a taper the
curvature M/EI is no straight line either: relative error of ω up to g⁴/180, where EI changes by g along an element.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fembeam.beams.beam import Beam
from fembeam.support import require

Vector = NDArray[np.float64]

FREQUENCY_TOLERANCE = 1e-6  # relative, promised for each mode asked for
ERROR_CONSTANT = 1 / 1440  # relative error of omega of a cubic Hermite mesh: (beta h)^4/1440
WAVE_STEP = (0.65 * FREQUENCY_TOLERANCE / ERROR_CONSTANT) ** 0.25  # beta h = 0.175, a third below the promise
TAPER_STEP = (0.65 * FREQUENCY_TOLERANCE * 180) ** 0.25  # g = 0.104
SAMPLES = 200  # of each interval of a beam with tapers
MESHED_MODES = 10  # modes for whose frequencies a mesh is made where none are asked for
MOST_MODES = 300  # of one mesh: 5400 elements, about a minute; a slender beam has lost its meaning long before
MOST_ELEMENTS = 10_000  # of one mesh: above it rounding of K hides the lowest frequencies
SAME_PLACE = 1e-9  # of the length: features closer than this share a node
SHORTEST = 1e-4  # of the length: rounding of K grows like (length/h)³, 2e-4 of the first omega² here
SHORTEST_ROOTLESS = 4e-3  # the same where K has no root that keeps rounding away from frequencies
INSIDE = np.array([1e-9, 0.5, 1 - 1e-9])  # where a tapered interval is sampled


def on_beam(z: Vector, beam: Beam, where: str) -> Vector:
    """z, all of which must lie on the beam."""
    outside = ~((z >= 0) & (z <= beam.length))
    require(not outside.any(), f"z must lie on the beam, 0 to {beam.length} m", z[outside].tolist(), where,
            "keep to the beam")  # fmt: skip
    return z


def slowness(beam: Beam, nodes: Vector) -> Vector:
    """(ρA/EI)^(1/4), the largest between neighbouring nodes: bending wavenumber over √omega."""
    return wavenumber(Beam(beam.length, beam.section, beam.spans), nodes, 1.0)


def wavenumber(beam: Beam, nodes: Vector, omega: float) -> Vector:
    """κ in 1/m, the largest between neighbouring nodes."""
    return _waves(beam, nodes[:-1, None] + np.diff(nodes)[:, None] * INSIDE, omega).max(axis=1)


def _waves(beam: Beam, z: Vector, omega: float) -> Vector:
    """κ in 1/m at z."""
    profile = beam.profile(z)
    EI = profile.E * profile.I
    half = abs(beam.axial_force) / (2 * EI)
    squared = half + np.sqrt(half**2 + np.maximum(profile.rho * profile.A * omega**2, beam.foundation) / EI)
    return np.sqrt(squared)


def _change(beam: Beam, z: Vector) -> Vector:
    """|EI'|/EI in 1/m at z (k, s) along k tapers, by a bound: that of the width and thrice that of the height."""
    profile = beam.profile(z)
    height = np.sqrt(profile.I / profile.A)
    sides = ((1, profile.A / height), (3, height))
    parts = [power * np.ptp(one, axis=1)[:, None] / one for power, one in sides]
    return np.asarray(sum(parts) / np.ptp(z, axis=1)[:, None])


def demand(beam: Beam, borders: Vector, omega: float) -> Vector:
    """How many elements (k, s) are needed from each border to s places of equal distance up to the next one.

    So that κ h stays below WAVE_STEP at omega, and the change of EI along an element below TAPER_STEP.
    """
    x = np.linspace(0.0, 1.0, SAMPLES if beam.tapered else 2)
    h = np.diff(borders)[:, None]
    z = borders[:-1, None] + h * np.clip(x, INSIDE[0], INSIDE[-1])
    dense = _waves(beam, z, omega) / WAVE_STEP
    if beam.tapered:
        finest = 2.0 / (beam.length * SHORTEST)
        dense = np.hypot(dense, np.minimum(_change(beam, z) / TAPER_STEP, finest))  # errors of curvature go with h²
    steps = h * np.diff(x) * (dense[:, 1:] + dense[:, :-1]) / 2
    return np.hstack([0.0 * h, np.cumsum(steps, axis=1)])


def placed(borders: Vector, needed: Vector, counts: NDArray[np.int64]) -> Vector:
    """Nodes with counts[i] elements between borders i and i + 1, each for an equal part of the `demand`."""
    x = np.linspace(0.0, 1.0, needed.shape[1])
    parts = [
        start + (end - start) * np.append(0.0, np.interp(np.arange(1, count) / count * own[-1], own, x))
        for start, end, count, own in zip(borders[:-1], borders[1:], counts, needed, strict=True)
    ]
    return np.append(np.concatenate(parts), borders[-1])


def divided(borders: Vector, counts: NDArray[np.int64]) -> Vector:
    """Nodes with counts[i] equal elements between borders i and i + 1."""
    intervals = zip(borders[:-1], borders[1:], counts, strict=True)
    pieces = [np.linspace(start, end, count, endpoint=False) for start, end, count in intervals]
    return np.append(np.concatenate(pieces), borders[-1])


def spread(beam: Beam, borders: Vector, elements: int) -> Vector:
    """Nodes with `elements` elements in all (at least one per interval), short where waves are short."""
    return divided(borders, shares(np.diff(borders) * slowness(beam, borders), elements))


def shares(waves: Vector, elements: int) -> NDArray[np.int64]:
    """How many of `elements` elements each interval gets, at least one: the more, the more waves it holds."""
    counts = np.ones(len(waves), dtype=int)
    for _ in range(elements - len(waves)):
        counts[np.argmax(waves / counts)] += 1
    return counts
