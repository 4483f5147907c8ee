"""Where motion settles: bifurcation diagrams by simulation, basins of attraction over starts.

Imports: `model`, `scene`, `support`, `execution`. Begin with `bifurcation`.
"""

from fembeam.study.settling.basins import Basins, basins
from fembeam.study.settling.bifurcation import Bifurcation, bifurcation
