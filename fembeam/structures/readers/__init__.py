"""Matrices of other programs from their files: plain data in, one file a format.

npz, Matrix Market, Nastran op4 and DMIG, Abaqus .mtx, CalculiX .sti/.mas/.dof, Ansys Harwell–Boeing with .mapping.
Imports: numpy, scipy. Begin with `reading.read_matrices`.
"""

from fembeam.structures.readers.given import Given
from fembeam.structures.readers.node_files import read_nodes
from fembeam.structures.readers.npz import read_modes
from fembeam.structures.readers.reading import read_matrices, structure_arguments
