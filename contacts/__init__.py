"""Contact laws: indentation, its rate and the entry rate in; force out.

The force acts while ``delta > 0`` and is positive when it pushes the bodies apart. A law depends on these three numbers
only. Laws with a state of their own (Bouc–Wen, Jenkins, Iwan) are not included: every method would have to integrate
that state, locate yield and return, differentiate and save it, for elements that act all the time.
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
