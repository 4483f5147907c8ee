"""Figures: one function per question, each returns a matplotlib figure. `response` and `animation` are of one run."""

from fembeam.plot.animation import animate, frame
from fembeam.plot.orbits import branch, orbit, peak
from fembeam.plot.response import (
    contacts,
    densities,
    mode_shapes,
    peaks,
    places,
    responses,
    segment_for,
    spectra_of,
    spectrum,
    styled,
    time_history,
)

__all__ = [
    "animate",
    "branch",
    "contacts",
    "densities",
    "frame",
    "mode_shapes",
    "orbit",
    "peak",
    "peaks",
    "places",
    "responses",
    "segment_for",
    "spectra_of",
    "spectrum",
    "styled",
    "time_history",
]
