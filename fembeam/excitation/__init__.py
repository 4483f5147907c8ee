"""Signals with exact derivatives: tones, sweeps, pulses, noise of a given spectrum, records; nothing of beams.

A signal is a function of t with `derivative(order)`; line spectra offer their `tones()` or values on a grid. `noise`
makes a realisation from a seed, as lines with random phases (`noise_lines`); the studies renew it by
`fembeam.study.realisations`. `record` and `samples` are measured signals, `psd` densities. Imports: `support`. Begin
with `tones`, then `line_spectrum`.
"""

from fembeam.excitation.noise import BandNoise
from fembeam.excitation.psd import RollOff
from fembeam.excitation.pulses import Pulse, Step
from fembeam.excitation.record import Interpolation, Quantity, Record
from fembeam.excitation.sweep import SineSweep
from fembeam.excitation.tones import Harmonic, Multisine
