"""Reduction of M u'' + C u' + K u = f to few coordinates: matrices in, basis and reduced matrices out.

`basis` holds a basis, the reduced matrices and their checks; `modal` finds modes, `truncation` tells how many are
enough, `interface` adds the static shapes of loaded places, `whirl` has the modes of rotors. Nothing is known of beams,
contacts or time.
Imports: numpy, scipy. Begin with `modal.modal_basis`.
"""

from reduction.basis import AccuracyError, Basis, oriented
from reduction.interface import craig_bampton, dofs_inside, guyan, static_shapes, static_share, with_residual
from reduction.modal import modal_basis
from reduction.truncation import below, carrying, fewest_modes, moved_mass
from reduction.whirl import Whirl, critical_speeds, whirl

__all__ = [
    "AccuracyError", "Basis", "Whirl", "below", "carrying", "craig_bampton", "critical_speeds", "dofs_inside",
    "fewest_modes", "guyan", "modal_basis", "moved_mass", "oriented", "static_shapes", "static_share", "whirl",
    "with_residual",
]  # fmt: skip
