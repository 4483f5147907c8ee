"""The scene: supports, masses, springs, stops, elements, impactors, loads; full matrices, contact rows, signals.

Imports: `beams`, `structures`, `excitation`, `support`, `reduction`, of `solvers` `Friction`; inside the methods
`Scene.reduce` also `fembeam.model`, `Scene.figure` `fembeam.plot`, `Scene.check` `fembeam.inspection`. Begin with
`scene`, then `assembly`.
"""

from fembeam.scene.annular_stop import AnnularStop
from fembeam.scene.assembly import MOST_DENSE, MOST_MODES, Matrices, check_counts, unsupported
from fembeam.scene.body_assembly import BodyMatrices, respun
from fembeam.scene.contact_rows import (
    ON,
    carried_on,
    contact_rows,
    heights,
    keys_of,
    load_signals,
    loaded,
    loads,
    made_key,
    static_rows,
    support_loads,
    watched,
    weight,
)
from fembeam.scene.element import Element, tangent
from fembeam.scene.impactor import Impactor
from fembeam.scene.local_coordinate import LocalCoordinate, unit_of
from fembeam.scene.moving_loads import PER_DOF, loads_of_dof, loads_of_order
from fembeam.scene.parameters import called, changes_structure, numbered, path_of, replaced, value_of, with_value
from fembeam.scene.part import ScenePart
from fembeam.scene.part_places import at_parts, require_number
from fembeam.scene.parts import (
    Clamped,
    Dashpot,
    Fixed,
    Guided,
    LumpedMass,
    Pinned,
    PointForce,
    PointMoment,
    Spring,
    Stop,
)
from fembeam.scene.places import Place, body_words, directed_words, is_directed, place_words, quoted, split, turns_at
from fembeam.scene.rigid_motions import rigid_shapes
from fembeam.scene.rotors import Disk, Unbalance
from fembeam.scene.rubbing import Friction, spin_of
from fembeam.scene.scene import FEATURES, Scene
from fembeam.scene.signals import PLACES, for_duration, persistent_drive, signals_of, support_motion, with_signals
from fembeam.scene.source import Source
