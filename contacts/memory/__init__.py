"""Laws with memory: elastic dry friction, hysteresis, yielding.

Between borders the force is a smooth function φ_p(δ, δ̇; L) of a segment p and a few latched numbers L; at a border the
numbers are renewed and another segment begins (`contacts.law` gives the kernels). Nothing is integrated: what happens
between two reversals is known in closed form. Begin with `friction`, where a slider sticks or slips; `iwan` has many
sliders, `bouc_wen` smooth hysteresis, `walton_braun` yielding.

One's own is made of plain functions in `custom`. May import the files of `contacts` itself.
"""

from contacts.memory.bouc_wen import BoucWen
from contacts.memory.custom import Border, CustomMemoryLaw, Segment, memory_law
from contacts.memory.friction import Coulomb, ElastoPlastic, Jenkins
from contacts.memory.iwan import Iwan
from contacts.memory.walton_braun import WaltonBraun
