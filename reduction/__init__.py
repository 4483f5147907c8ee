"""Reduction of M u'' + C u' + K u = f to few coordinates: matrices in, basis and reduced matrices out."""

from reduction.basis import AccuracyError, Basis, oriented
from reduction.modal import modal_basis

__all__ = ["AccuracyError", "Basis", "modal_basis", "oriented"]
