"""Laws from measurements: records of motion and force in, parameters with confidence intervals out.

`records` reads and checks collisions, `motion` makes positions and rates of what was measured, `fit` finds the law,
`result` tells how well it is known. Laws with memory come from loops of force over displacement, by `loops`, whose
models are in `loop_models`, starting values in `loop_starts`, least squares in `loop_fit`, remarks and results in
`loop_remarks` and `loop_result`. Imports: the laws of `contacts`. Begin with `fit.identify` or `loops.identify_loop`.
"""

from contacts.identification.fit import identify
from contacts.identification.loop_result import IdentifiedLoop
from contacts.identification.loops import identify_loop
from contacts.identification.records import read_collisions
from contacts.identification.result import Estimate, Identified
