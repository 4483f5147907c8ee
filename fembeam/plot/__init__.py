"""Figures: one function per question, each returns a matplotlib figure. `response` holds those of one run."""

from fembeam.plot.chart import failures, speed_accuracy, stability_map
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
    "branch",
    "contacts",
    "densities",
    "failures",
    "mode_shapes",
    "orbit",
    "peak",
    "peaks",
    "places",
    "responses",
    "segment_for",
    "spectra_of",
    "spectrum",
    "speed_accuracy",
    "stability_map",
    "styled",
    "time_history",
]
