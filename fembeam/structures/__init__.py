"""Bodies that are not one straight beam: structures by their matrices, places and directions by name.

A body gives matrices with named dofs and rows for a place (`Assembled`); a scene adds supports and all else.
Imports: `support`, `beams`, `reduction`. Begin with `assembled`.
"""

from fembeam.structures.assembled import COMPONENTS, Assembled
from fembeam.structures.buckling import check_buckling
from fembeam.structures.directions import (
    TURN,
    UP,
    Direction,
    Six,
    direction_of,
    named,
    nearest,
    require_components,
    rows_along,
    turns,
)
from fembeam.structures.frame import Frame
from fembeam.structures.frame_checks import arm_matrix
from fembeam.structures.frame_forces import FORCES, FrameForces
from fembeam.structures.frame_mesh import FrameMatrices, FrameMesh, points_of
from fembeam.structures.joined_bodies import JoinedBodies, JoinedForces, has_place, located_among
from fembeam.structures.joints import Joint, joining, translations_of
from fembeam.structures.massless import following
from fembeam.structures.members import Member
from fembeam.structures.modes_given import GivenModes
from fembeam.structures.scale import Scale
from fembeam.structures.structure import Structure
