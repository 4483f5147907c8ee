"""Figures: one function per question, each returns a matplotlib figure. `response` holds those of one run."""

from fembeam.plot.orbits import branch, orbit, peak
from fembeam.plot.random import random_densities, random_spectra
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
    "mode_shapes",
    "orbit",
    "peak",
    "peaks",
    "places",
    "random_densities",
    "random_spectra",
    "responses",
    "segment_for",
    "spectra_of",
    "spectrum",
    "styled",
    "time_history",
]
