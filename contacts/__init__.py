"""Contact laws: indentation, its rate and the entry rate in; force out.

The force acts while ``delta > 0`` and is positive when it pushes the bodies apart.
"""

from contacts.law import CustomLaw, Law, law
from contacts.laws import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear
from contacts.restitution import achieved_restitution, damping_factor_for

__all__ = [
    "CustomLaw",
    "Hertz",
    "Hysteretic",
    "KelvinVoigt",
    "Law",
    "PiecewiseLinear",
    "achieved_restitution",
    "damping_factor_for",
    "law",
]
