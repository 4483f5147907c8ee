"""What is computed from a scene: reduction, initial states, runs, orbits, branches, rubs, section forces.

`reduce` makes a `model`; that gives a `run`, an `orbit`, a `rub` or a `branch`, saved and exported around them.
Imports: `scene`, `response` and what they import, `reduction`, `solvers`; inside the method `Run.scene_file` also
`fembeam.scene_file`. Begin with `model`.
"""

from fembeam.model.branch import Branch
from fembeam.model.equations import load_period
from fembeam.model.extremes import extremes_of
from fembeam.model.model import Model
from fembeam.model.orbit import Attractor, Orbit
from fembeam.model.reduce import check_mode_count, check_reduction
from fembeam.model.rub import Rub
from fembeam.model.run import Run
from fembeam.model.run_file import load
from fembeam.model.watched_places import observed, places
from fembeam.response import PlacedShapes, Shapes
