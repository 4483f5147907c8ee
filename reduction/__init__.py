"""Reduction of M u'' + C u' + K u = f to few coordinates: matrices in, basis and reduced matrices out."""

from reduction.basis import AccuracyError, Basis, oriented
from reduction.interface import craig_bampton, guyan, static_share, with_residual
from reduction.modal import modal_basis
from reduction.truncation import below, carrying, fewest_modes, moved_mass

__all__ = [
    "AccuracyError",
    "Basis",
    "below",
    "carrying",
    "craig_bampton",
    "fewest_modes",
    "guyan",
    "modal_basis",
    "moved_mass",
    "oriented",
    "static_share",
    "with_residual",
]
