"""The laws most stops need: Hertz, hysteretic Hertz, Kelvin–Voigt, piecewise linear.

The first three are members of one family, ``F = K d^p (1 + a v/entry_rate) + c d^r v`` with d = delta, v =
delta_dot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contacts.law import ENTRY_RATE_FLOOR, Law, number
from contacts.restitution import damping_factor_for


@dataclass(frozen=True)
class Hysteretic(Law):
    r"""Power law with hysteresis, :math:`F = K δ^p (1 + a\,\dot δ/\dot δ^-)`.

    Parameters
    ----------
    stiffness : K > 0, N/m^p.
    damping_factor : a >= 0; 0 is elastic. See the constructors for values from a restitution.
    exponent : p >= 1; 1.5 for spheres.
    clamp : cut the force at zero, so that the stop never pulls (it would where delta_dot < -entry_rate/a).
    entry_rate_floor : entry rates below it (m/s) count as it; a contact log says where the floor acted.

    Notes
    -----
    On a free mass the achieved restitution r obeys a (1 + r) = ln[(1 + a)/(1 - a r)], whatever K, mass, speed
    and p (with ``clamp=False``). The rate at entry must be latched by the integrator.

    References
    ----------
    Lankarani, Nikravesh, J. Mech. Des. 112 (1990) 369; van de Wouw et al., Int. J. Non-Linear Mech. 38
    (2003) 767, Eq. (3).

    Examples
    --------
    >>> stop = Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5)
    >>> stop.damping_factor
    0.5625
    """

    stiffness: float
    damping_factor: float
    exponent: float = 1.5
    clamp: bool = False
    entry_rate_floor: float = ENTRY_RATE_FLOOR

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "damping_factor")
        number(self, "exponent", 1.0)
        number(self, "entry_rate_floor", strict=True)

    @classmethod
    def lankarani_nikravesh(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """Published factor a = 3 (1 - e²)/4, for e near 1; what e = 0.5 achieves is 0.725, not 0.5."""
        if not 0.0 <= restitution <= 1.0:
            raise ValueError(f"restitution of lankarani_nikravesh must lie in [0, 1], got {restitution!r}")
        return cls(stiffness, 0.75 * (1.0 - restitution**2), **options)

    @classmethod
    def achieving(cls, stiffness: float, restitution: float, **options: Any) -> Hysteretic:
        """The factor with which a free mass leaves at exactly ``restitution`` in (0, 1] times its entry speed."""
        return cls(stiffness, damping_factor_for(restitution), **options)

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(K, p, a, c, r, clamp) of the power family."""
        return np.array([self.stiffness, self.exponent, self.damping_factor, 0.0, 0.0, float(self.clamp)])

    @property
    def kernel(self) -> Any:
        """Compiled power family."""
        from contacts.kernels import power

        return power

    @property
    def gradient(self) -> Any:
        """Its compiled derivatives."""
        from contacts.kernels import power_gradient

        return power_gradient


@dataclass(frozen=True)
class Hertz(Law):
    r"""Elastic power law :math:`F = K δ^p`, Hertz's for p = 1.5.

    Parameters
    ----------
    stiffness : K > 0, N/m^p.
    exponent : p >= 1.

    References
    ----------
    Hertz, J. reine angew. Math. 92 (1882) 156; van de Wouw et al. (2003), Eqs (1) and (2).

    Examples
    --------
    >>> float(Hertz(1e9).force(1e-4))
    1000.0
    """

    stiffness: float
    exponent: float = 1.5

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "exponent", 1.0)

    @classmethod
    def of_spheres(cls, E1: float, nu1: float, R1: float, E2: float, nu2: float, R2: float) -> Hertz:
        """Two elastic spheres: K = (2/3) E_r √R_r, E_r = 2/[(1-ν₁²)/E₁ + (1-ν₂²)/E₂], R_r = R₁R₂/(R₁+R₂).

        Moduli in Pa, radii in m (``inf`` for a flat), Poisson's ratios in (-1, 0.5].
        """
        for name, value in {"E1": E1, "R1": R1, "E2": E2, "R2": R2}.items():
            if not value > 0.0 or (name[0] == "E" and not math.isfinite(value)):
                raise ValueError(f"{name} of Hertz.of_spheres must be positive, got {value!r}")
        for name, value in {"nu1": nu1, "nu2": nu2}.items():
            if not -1.0 < value <= 0.5:
                raise ValueError(f"{name} of Hertz.of_spheres must lie in (-1, 0.5], got {value!r}")
        if math.isinf(R1) and math.isinf(R2):
            raise ValueError("R1 and R2 of Hertz.of_spheres are both infinite; two flats are no Hertz contact")
        modulus = 2.0 / ((1.0 - nu1**2) / E1 + (1.0 - nu2**2) / E2)
        radius = 1.0 / (1.0 / R1 + 1.0 / R2)
        return cls(2.0 / 3.0 * modulus * math.sqrt(radius))

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(K, p, a, c, r, clamp) of the power family."""
        return np.array([self.stiffness, self.exponent, 0.0, 0.0, 0.0, 0.0])

    @property
    def kernel(self) -> Any:
        """Compiled power family."""
        from contacts.kernels import power

        return power

    @property
    def gradient(self) -> Any:
        """Its compiled derivatives."""
        from contacts.kernels import power_gradient

        return power_gradient


@dataclass(frozen=True)
class KelvinVoigt(Law):
    r"""Spring and dashpot, :math:`F = k δ + c \dot δ` while δ > 0: jumps at entry and may pull before exit.

    Parameters
    ----------
    stiffness : k > 0, N/m.
    damping : c >= 0, N s/m.
    clamp : cut the force at zero, so that the stop never pulls.

    Examples
    --------
    >>> float(KelvinVoigt(1e6, 100.0).force(1e-3, 0.5))
    1050.0
    """

    stiffness: float
    damping: float
    clamp: bool = False

    def __post_init__(self) -> None:
        number(self, "stiffness", strict=True)
        number(self, "damping")

    @property
    def jump(self) -> bool:  # type: ignore[override]
        """The dashpot's force appears at once."""
        return self.damping > 0.0

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(K, p, a, c, r, clamp) of the power family."""
        return np.array([self.stiffness, 1.0, 0.0, self.damping, 0.0, float(self.clamp)])

    @property
    def kernel(self) -> Any:
        """Compiled power family."""
        from contacts.kernels import power

        return power

    @property
    def gradient(self) -> Any:
        """Its compiled derivatives."""
        from contacts.kernels import power_gradient

        return power_gradient


@dataclass(frozen=True)
class PiecewiseLinear(Law):
    r"""Elastic polyline: slope ``slopes[j]`` between ``knots[j-1]`` and ``knots[j]``, from F(0) = 0.

    Parameters
    ----------
    slopes : m >= 1 stiffnesses, N/m; the first positive; later ones may soften but the force stays >= 0.
    knots : the m - 1 indentations (m) where the slope changes, ascending and positive.

    Examples
    --------
    >>> fender = PiecewiseLinear([1e4, 1e6], knots=[1e-3])
    >>> fender.force([5e-4, 2e-3])
    array([   5., 1010.])
    """

    slopes: Sequence[float] | float
    knots: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        slopes = tuple(float(s) for s in np.atleast_1d(np.asarray(self.slopes, dtype=float)))
        knots = tuple(float(k) for k in np.atleast_1d(np.asarray(self.knots, dtype=float)))
        object.__setattr__(self, "slopes", slopes)
        object.__setattr__(self, "knots", knots)
        if not np.all(np.isfinite(slopes)) or slopes[0] <= 0.0:
            raise ValueError(f"slopes of PiecewiseLinear must be finite, the first positive, got {slopes}")
        if len(knots) != len(slopes) - 1:
            raise ValueError(f"PiecewiseLinear with {len(slopes)} slopes needs {len(slopes) - 1} knots, got {knots}")
        if not (np.all(np.isfinite(knots)) and np.all(np.diff(knots, prepend=0.0) > 0.0)):
            raise ValueError(f"knots of PiecewiseLinear must be finite, positive and ascending, got {knots}")
        if np.any(self._corner_forces() < 0.0) or (len(slopes) > 1 and slopes[-1] < 0.0):
            raise ValueError(f"slopes {slopes} of PiecewiseLinear soften to a negative force")

    def _corner_forces(self) -> NDArray[np.float64]:
        """Force at (0, knots...)."""
        rises = np.diff(self.knots, prepend=0.0) * np.asarray(self.slopes)[:-1]
        return np.concatenate((np.zeros(1), np.cumsum(rises)))

    @property
    def parameters(self) -> NDArray[np.float64]:
        """(m, knots[m], forces[m], slopes[m])."""
        slopes = np.asarray(self.slopes)
        return np.concatenate(([len(slopes)], [0.0], self.knots, self._corner_forces(), slopes))

    @property
    def kernel(self) -> Any:
        """Compiled polyline."""
        from contacts.kernels import piecewise

        return piecewise

    @property
    def gradient(self) -> Any:
        """Its compiled derivatives."""
        from contacts.kernels import piecewise_gradient

        return piecewise_gradient
