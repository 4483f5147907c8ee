"""A beam by itself: sections, Euler–Bernoulli elements, damping, where a mesh needs nodes, mesh files.

Imports: `support`. Begin with `beam`.
"""

from fembeam.beams.beam import (
    Beam,
    bare_beam,
    bending_matrices,
    bending_root,
    element_matrices,
    gauss_points,
    geometric_stiffness,
    hermite_rows,
    hermite_shapes,
    joining,
)
from fembeam.beams.damping import ModalDamping, Rayleigh
from fembeam.beams.mesh import (
    FREQUENCY_TOLERANCE,
    MESHED_MODES,
    MOST_ELEMENTS,
    MOST_MODES,
    SAME_PLACE,
    SHORTEST,
    SHORTEST_ROOTLESS,
    WAVE_STEP,
    divided,
    on_beam,
    shares,
    wavenumber,
)
from fembeam.beams.mesh_files import by_group, chosen_names, lines_of, named_nodes, read_mesh, shown
from fembeam.beams.section import Section, Taper
