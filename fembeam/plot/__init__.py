"""Figures: one function per question, each returns a matplotlib figure.

`response` holds those of one run, `study` those of studies.
"""

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
from fembeam.plot.study import mode_count, smallest_model

__all__ = [
    "branch",
    "contacts",
    "densities",
    "mode_count",
    "mode_shapes",
    "orbit",
    "peak",
    "peaks",
    "places",
    "responses",
    "segment_for",
    "smallest_model",
    "spectra_of",
    "spectrum",
    "styled",
    "time_history",
]
