"""Figures: one function per question, each returns a matplotlib Figure; most draw into your own axes with `axes=`.

`response` and `animation` hold those of one run, `laws` those of contact laws, `orbits` those of periodic motion,
`random` those of random motion, `mode_count` and `methods` those of studies, `figure` what is common to all.
"""

from fembeam.model import places
from fembeam.plot.animation import animate, frame
from fembeam.plot.laws import identification, loops, restitutions
from fembeam.plot.methods import failures, speed_accuracy, stability_map
from fembeam.plot.mode_count import mode_count, smallest_model
from fembeam.plot.orbits import branch, orbit, peak
from fembeam.plot.random import random_densities, random_spectra
from fembeam.plot.response import (
    contacts,
    densities,
    mode_shapes,
    peaks,
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
    "failures",
    "frame",
    "identification",
    "loops",
    "mode_count",
    "mode_shapes",
    "orbit",
    "peak",
    "peaks",
    "places",
    "random_densities",
    "random_spectra",
    "responses",
    "restitutions",
    "segment_for",
    "smallest_model",
    "spectra_of",
    "spectrum",
    "speed_accuracy",
    "stability_map",
    "styled",
    "time_history",
]
