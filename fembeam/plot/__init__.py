"""Figures: one function per question, each returns a matplotlib figure. `response` holds those of one run,
`laws` those of contact laws, `orbits` those of periodic motion.
"""

from fembeam.plot.laws import identification, loops, restitutions
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
    "identification",
    "loops",
    "mode_shapes",
    "orbit",
    "peak",
    "peaks",
    "places",
    "responses",
    "restitutions",
    "segment_for",
    "spectra_of",
    "spectrum",
    "styled",
    "time_history",
]
