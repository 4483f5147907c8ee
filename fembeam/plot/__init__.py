"""Figures: one function per question, each returns a matplotlib Figure; all but moving pictures draw into your `axes`.

`response`, `bodies`, `clearance`, `spectra`, `contact_histograms` and `animation` hold those of one run, `laws` those
of contact laws, `orbits` those of periodic motion, `campbell` that of rotors, `basins` maps of starts, `random` those
of random motion, `linear` spectra and frequency response, `rig` that of a scene, `mode_count`, `methods`, `variation`
and `peaks` those of studies; `run_signals`, `style`, `units` and `figure` are what they share. Imports: `statistics`,
`model` and what they import. Begin with `response`.
"""

from fembeam.model import places
from fembeam.plot.animation import animate, frame
from fembeam.plot.basins import basins
from fembeam.plot.campbell import campbell
from fembeam.plot.clearance import forces_in_clearance, orbit_in_clearance
from fembeam.plot.contact_histograms import contacts
from fembeam.plot.laws import equivalent, hysteresis, identification, loops, restitutions
from fembeam.plot.linear import floor_spectrum, frequency_response, response_spectrum
from fembeam.plot.methods import speed_accuracy, stability_map
from fembeam.plot.mode_count import mode_count, smallest_model
from fembeam.plot.orbits import bifurcation, branch, orbit, peak
from fembeam.plot.peaks import backbone, fold_curve, peak_curve
from fembeam.plot.random import random_densities, random_spectra
from fembeam.plot.response import deflected, densities, mode_shapes, time_history
from fembeam.plot.rig import rig
from fembeam.plot.run_signals import batches, coordinates, natural, responses, sampling_of, stationary
from fembeam.plot.spectra import peaks, segment_for, spectra_of, spectrum
from fembeam.plot.style import one_legend, styled
from fembeam.plot.variation import minimum, variation

__all__ = [
    "animate", "backbone", "basins", "batches", "bifurcation", "branch", "campbell", "contacts", "coordinates",
    "deflected", "densities", "equivalent", "floor_spectrum", "fold_curve", "forces_in_clearance", "frame",
    "frequency_response",
    "hysteresis", "identification", "loops", "minimum", "mode_count", "mode_shapes", "natural", "one_legend",
    "orbit", "orbit_in_clearance", "peak", "peak_curve", "peaks", "places", "random_densities", "random_spectra",
    "response_spectrum", "responses", "restitutions", "rig", "sampling_of", "segment_for", "smallest_model",
    "spectra_of", "spectrum", "speed_accuracy", "stability_map", "stationary", "styled", "time_history",
    "variation",
]  # fmt: skip
