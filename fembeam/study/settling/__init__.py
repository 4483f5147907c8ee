"""Where motion settles: diagrams over a parameter by brute force, basins of attraction over starts."""

from fembeam.study.settling.basins import Basins, basins
from fembeam.study.settling.bifurcation import Bifurcation, bifurcation
