"""Laws from measured collisions: records of motion and force in, parameters with standard errors out.

`records` reads and checks collisions, `motion` makes positions and rates of what was measured, `fit` finds the law,
`result` tells how well it is known. Imports: the laws of `contacts`. Begin with `fit.identify`.
"""

from contacts.identification.fit import identify
from contacts.identification.records import read_collisions
from contacts.identification.result import Estimate, Identified

__all__ = ["Estimate", "Identified", "identify", "read_collisions"]
