"""Contact laws: indentation, its rate and the entry rate in; force out.

The force acts while ``delta > 0`` and is positive when it pushes the bodies apart. A law knows nothing but these three
numbers. Laws with memory (Bouc–Wen, Jenkins, Iwan) are left out on purpose: their state must be integrated, landed on
at yield and return, differentiated and saved along with the structure's, which every method here would have to carry
for elements that act all the time and need none of what makes contacts hard.
"""

from contacts.curves import PiecewiseLinear, Tabulated
from contacts.custom import CustomLaw, law
from contacts.identification import Estimate, Identified, identify, read_collisions
from contacts.law import Law, Sum, parallel
from contacts.polynomial import Polynomial
from contacts.power_laws import PUBLISHED, Hertz, Hysteretic
from contacts.restitution import Bounce, achieved_restitution, bounce, damping_factor_for, restitution
from contacts.viscous import KelvinVoigt, Viscoelastic

__all__ = [
    "PUBLISHED",
    "Bounce",
    "CustomLaw",
    "Estimate",
    "Hertz",
    "Hysteretic",
    "Identified",
    "KelvinVoigt",
    "Law",
    "PiecewiseLinear",
    "Polynomial",
    "Sum",
    "Tabulated",
    "Viscoelastic",
    "achieved_restitution",
    "bounce",
    "damping_factor_for",
    "identify",
    "law",
    "parallel",
    "read_collisions",
    "restitution",
]
