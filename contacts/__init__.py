"""Contact laws: indentation, its rate and the entry rate in; force out. They know neither structures nor methods.

The force acts while ``delta > 0`` and is positive when it pushes the bodies apart. Laws of these three numbers:
`Hertz`, `Hysteretic`, `KelvinVoigt`, `Viscoelastic`, `PiecewiseLinear`, `Polynomial`, `Tabulated`, and one's own with
`@law`. Laws with memory, of a few latched numbers that are renewed at borders: `Jenkins`, `Coulomb`, `Iwan`,
`ElastoPlastic`, `BoucWen`, `WaltonBraun`, and with `memory_law` one's own (`contacts.memory`). Laws add: ``a + b``.

`law` holds what every law offers, `kernels` and `sum_kernels` the forces as compiled functions; `restitution` bounces a
free mass off a law, `path` evaluates one along given indentations, `contacts.identification` finds laws from
measurements. Imports: numpy, scipy, numba. Begin with `law`, then `power_laws`.
"""

from contacts.curves import PiecewiseLinear, Tabulated
from contacts.custom import CustomLaw, law
from contacts.identification import Estimate, Identified, IdentifiedLoop, identify, identify_loop, read_collisions
from contacts.law import Law
from contacts.memory import (
    Border,
    BoucWen,
    Coulomb,
    CustomMemoryLaw,
    ElastoPlastic,
    Iwan,
    Jenkins,
    Segment,
    WaltonBraun,
    memory_law,
)
from contacts.polynomial import Polynomial
from contacts.power_laws import PUBLISHED, Hertz, Hysteretic
from contacts.restitution import Bounce, achieved_restitution, bounce, damping_factor_for, restitution
from contacts.sums import Sum, parallel
from contacts.viscous import KelvinVoigt, Viscoelastic

__all__ = [
    "PUBLISHED", "Border", "BoucWen", "Bounce", "Coulomb", "CustomLaw", "CustomMemoryLaw", "ElastoPlastic", "Estimate",
    "Hertz", "Hysteretic", "Identified", "IdentifiedLoop", "Iwan", "Jenkins", "KelvinVoigt", "Law", "PiecewiseLinear",
    "Polynomial", "Segment", "Sum", "Tabulated", "Viscoelastic", "WaltonBraun", "achieved_restitution", "bounce",
    "damping_factor_for", "identify", "identify_loop", "law", "memory_law", "parallel", "read_collisions",
    "restitution",
]  # fmt: skip
