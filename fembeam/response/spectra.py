"""Response spectra: the largest response of single oscillators to a recorded or computed acceleration.

    x'' + 2 ζ ω x' + ω² x = -a(t),   at rest at the first sample,   a piecewise linear between samples

With z = x' - λ̄ x, λ = -ζω + iω√(1 - ζ²), this is z' = λ z - a, whose exact step is

    z_{j+1} = exp(λh) z_j - h [(φ_1 - φ_2)(λh) a_j + φ_2(λh) a_{j+1}],   φ_1(x) = (eˣ - 1)/x,  φ_2(x) = (eˣ - 1 - x)/x²
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.scene import turns_at
from fembeam.support import LARGEST, numbers, require, vector, warn

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fembeam.response.histories import Histories

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]
UNIFORM = 1e-6  # of a step, that times may be off a uniform grid
FINE = 0.05  # ω τ up to which the cubic through values and slopes keeps maxima to 1e-5, mostly (ω τ)⁴/384
PARTS = 4  # of an interval, at least: what its two samples do may nearly cancel in between
ENOUGH = 1e-6  # relative: bounds on a maximum that exceed it by less
SLOWEST = 1e-10  # ω τ; below 1e-12 rounding takes over the displacement
GONE = 40.0  # ζ ω τ after which free vibration is below rounding
FIRST_LOOK, MOST_AT_ONCE = 16, 1 << 12  # intervals looked into at once
BLOCK = 1 << 16  # steps of the record at once, so that memory stays small
SERIES = 18  # terms of φ_2 for |x| < 1, right to rounding
MOST_BEYOND = 4 / 27  # largest value of s (1 - s)²: a slope's part in a cubic
FEW = 10  # samples in a contact, below which its acceleration is not resolved


@dataclass(frozen=True, eq=False)
class ResponseSpectrum:
    """Largest responses of oscillators, one row for each damping ratio.

    Attributes
    ----------
    omega : (p,) rad/s. zeta : (d,) damping ratios.
    displacement, velocity : (d, p) max |x| in m and max |x'| in m/s, relative to what carries the oscillator.
    acceleration : (d, p) max |x'' + a| = max |2 ζ ω x' + ω² x| in m/s², absolute.
    unit : of the displacement; of a rotation rad, and so the others.
    """

    omega: Vector
    zeta: Vector
    displacement: Vector
    velocity: Vector
    acceleration: Vector
    unit: str = "m"

    def __repr__(self) -> str:
        low, high = self.omega.min(), self.omega.max()
        return f"<response spectrum of {len(self.omega)} oscillators, {low:.4g} to {high:.4g} rad/s, zeta {self.zeta}>"

    @property
    def period(self) -> Vector:
        """2π/ω (p,) in s."""
        return 2 * np.pi / self.omega

    @property
    def pseudo_velocity(self) -> Vector:
        """ω max |x| (d, p), m/s."""
        return self.omega * self.displacement

    @property
    def pseudo_acceleration(self) -> Vector:
        """ω² max |x| (d, p), m/s²: the largest spring force per mass."""
        return self.omega**2 * self.displacement


def response_spectrum(
    t: ArrayLike,
    acceleration: ArrayLike,
    omega: ArrayLike | None = None,
    zeta: ArrayLike = 0.05,
    *,
    periods: ArrayLike | None = None,
) -> ResponseSpectrum:
    """Maxima of oscillators on a base of given acceleration, by the exact recursion for piecewise-linear records.

        x'' + 2 ζ ω x' + ω² x = -a(t),   x = x' = 0 at the first sample

    Parameters
    ----------
    t : (k,) s, uniform, k ≥ 2.
    acceleration : (k,) m/s², absolute acceleration a of the base or floor; straight lines between samples.
    omega : (p,) rad/s, > 0; or ``periods`` (p,) in s instead.
    zeta : one damping ratio or (d,), 0 ≤ ζ < 1.

    Returns
    -------
    ResponseSpectrum : arrays (d, p).

    Raises
    ------
    ValueError : lengths that differ, times off a uniform grid, numbers that are not finite or out of range, both or
        neither of omega and periods.

    Notes
    -----
    Maxima are those between samples too, right to 1e-5 for the piecewise-linear record at any ω; for one that is smooth
    between its samples the error is about (ω_a h)²/12 of its part at ω_a. What comes after the last sample does not
    count: append zeros to see the free vibration, above all for periods longer than the record.

    References
    ----------
    N.C. Nigam, P.C. Jennings, Calculation of response spectra from strong-motion earthquake records, Bull. Seism. Soc.
    Am. 59 (1969) 909.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.linspace(0.0, 10.0, 1001)
    >>> step = response_spectrum(t, np.ones(1001), periods=[0.5, 1.0], zeta=0.0)
    >>> np.round(step.pseudo_acceleration, 6)  # twice the static answer
    array([[2., 2.]])
    """
    step, values = _checked_record(t, acceleration)
    omega, zeta = checked_oscillators(omega, periods), checked_damping(zeta)
    require(omega.min() * step >= SLOWEST, f"omega must be at least {SLOWEST / step:.3g} rad/s, {SLOWEST:g} / step",
            omega.min(), "response_spectrum", "leave slower ones out")  # fmt: skip
    found = np.array([[_largest(step, values, w, d) for w in omega] for d in zeta])
    return ResponseSpectrum(omega, zeta, *np.moveaxis(found, -1, 0))


def floor_spectrum(
    run: Histories, z: float, omega: ArrayLike | None, zeta: ArrayLike, body: int = 0, **options: Any
) -> ResponseSpectrum:
    """The spectrum of the absolute acceleration at z; `Run.floor_spectrum` explains it."""
    require(len(run.t) > 1, "a floor spectrum needs output samples", len(run.t), "Run.floor_spectrum",
            "give simulate a dt below the duration")  # fmt: skip
    lengths = run.contacts.t_out - run.contacts.t_in
    shortest, step = float(np.nanmin(lengths, initial=np.inf)), float(run.t[1] - run.t[0])
    if shortest < FEW * step:
        warn(f"contacts of {shortest:.2g} s are not resolved by samples {step:.2g} s apart: their "
             f"acceleration is missed or counted too long; simulate with dt below {shortest / FEW:.2g}")  # fmt: skip
    found = response_spectrum(run.t, run.acceleration(z, body, absolute=True), omega, zeta, **options)
    return replace(found, unit="rad") if turns_at(z) else found


def _checked_record(t: ArrayLike, acceleration: ArrayLike) -> tuple[float, Vector]:
    """The step and the samples."""
    where = "response_spectrum"
    times, values = numbers("t", t, where, "give s"), numbers("acceleration", acceleration, where, "give m/s²")
    fits = times.ndim == 1 and times.shape == values.shape and times.size > 1
    require(fits, "t and acceleration must have one length of at least 2", (times.shape, values.shape), where,
            "give one sample for each time")  # fmt: skip
    for name, column in (("t", times), ("acceleration", values)):
        bad = ~np.isfinite(column)
        require(not bad.any(), f"{name} must be finite", f"{column[bad][:1]} at sample {int(bad.argmax())}", where,
                "cut or mend the record")  # fmt: skip
    step = (times[-1] - times[0]) / (times.size - 1)
    off = np.abs(times - times[0] - step * np.arange(times.size)).max()
    require(step > 0 and off <= UNIFORM * step, "t must increase in equal steps", f"{off:.3g} s off", where,
            "interpolate to a uniform grid")  # fmt: skip
    return float(step), values


def checked_oscillators(omega: ArrayLike | None, periods: ArrayLike | None) -> Vector:
    """Frequencies (p,), rad/s."""
    require((omega is None) != (periods is None), "give omega or periods, one of them", (omega, periods),
            "response_spectrum", "omega in rad/s, or periods in s")  # fmt: skip
    name, given = ("omega", omega) if periods is None else ("periods", periods)
    rule = f"must be positive and finite, at least {1.0 / LARGEST:g}"
    values = vector(name, given, "response_spectrum", "give at least one", rule,
                    lambda x: np.isfinite(x) & (x >= 1.0 / LARGEST))  # fmt: skip
    return values if periods is None else 2 * np.pi / values


def checked_damping(zeta: ArrayLike) -> Vector:
    """Damping ratios (d,)."""
    return vector("zeta", zeta, "response_spectrum", "give ratios such as 0.05", "must be at least 0 and below 1",
                  lambda x: (x >= 0) & (x < 1))  # fmt: skip


def _largest(step: float, record: Vector, omega: float, zeta: float) -> Vector:
    """Max |x|, |x'|, |x'' + a| of one oscillator: f_k = Im(λᵏ z)/Im λ, f_k' = f_{k+1} - a Im(λᵏ)/Im λ."""
    decay, largest = complex(-zeta * omega, omega * np.sqrt(1 - zeta**2)), np.zeros(3)
    for a, z in _motion(step, record, decay):
        for k in range(3):
            value, slope = _quantity(k, decay, a, z)
            known = max(largest[k], float(np.abs(value).max()))
            if omega * step <= FINE:
                at = np.flatnonzero(_bound(value, slope, step) > known)
                largest[k] = _in_parts(k, decay, step, a, z, at, known) if len(at) else known
            else:
                largest[k] = _between(k, decay, step, a, z, known)
    return largest


def _quantity(k: int, decay: complex, a: Vector, z: Complex) -> tuple[Vector, Vector]:
    """f_k and its derivative."""
    first, second = (np.imag(decay**power * z) / decay.imag for power in (k, k + 1))
    return first, second - a * ((decay**k).imag / decay.imag)


def _motion(step: float, record: Vector, decay: complex) -> Iterator[tuple[Vector, Complex]]:
    """The record a and z at its samples, block by block."""
    from scipy.signal import lfilter

    exponent = decay * step
    late = step * _phi2(exponent)
    early = step * np.expm1(exponent) / exponent - late
    state, last = np.array([late * record[0]]), np.empty(0)  # so that z = 0 at the first sample
    for first in range(0, len(record) - 1, BLOCK):
        a = record[first : first + BLOCK + 1]
        fresh = a if first == 0 else a[1:]
        z, state = lfilter([-late, -early], [1.0, -np.exp(exponent)], fresh.astype(complex), zi=state)
        z = np.concatenate([last, z])
        last = z[-1:]
        yield a, z


def _in_parts(k: int, decay: complex, step: float, a: Vector, z: Complex, at: NDArray[np.intp], known: float) -> float:
    """Max |f_k| in some intervals, too, at least ``known``, where ω step is small.

    What is left of a record that alternates from sample to sample may lie between samples alone, and be the small
    difference of what its two samples do: intervals are cut into `PARTS`, by the exact step.
    """
    tau, early, later = step / PARTS * np.arange(PARTS + 1), a[at], a[at + 1] - a[at]
    record, inner = early + np.outer(tau / step, later), np.empty((PARTS + 1, len(at)), dtype=complex)
    inner[0], inner[-1] = z[at], z[at + 1]
    for j in range(1, PARTS):
        x = decay * tau[j]
        first, second = np.expm1(x) / x, _phi2(x)
        inner[j] = np.exp(x) * z[at] - tau[j] * ((first - second) * early + second * record[j])
    return max(known, _peak(*_quantity(k, decay, record.T, inner.T), float(tau[1])))


def _between(k: int, decay: complex, step: float, a: Vector, z: Complex, known: float) -> float:
    """Max |f_k| between samples, too, at least ``known``: z = c + d τ + (z_0 - c) exp(λτ), d = a'/λ, c = (a_0 + d)/λ.

    Only intervals that may exceed what is known are looked into, those of the highest bounds first, and in each the
    first and the last period T. With f = b τ + s, s its free part, and q = exp(-ζωT), f changes by b T - (1 - q) s one
    period later and by (1/q - 1) s - b T one period earlier. Where s > 0 one of them is no fall; where s < 0 f is
    higher at the zero of s before or behind. So no τ with a period on both sides is a maximum; likewise for -f.
    """
    rate = np.diff(a) / step
    d = rate / decay
    c = (a[:-1] + d) / decay
    free, power = z[:-1] - c, decay**k / decay.imag
    bound = np.maximum(*(np.abs(np.imag(power * end)) for end in (c, c + step * d))) + np.abs(power * free)
    omega = abs(decay)
    lead = min(step, 2 * np.pi / decay.imag, GONE / max(-decay.real, 1e-300))
    tau = np.linspace(0.0, lead, max(PARTS, int(np.ceil(lead * omega / FINE))) + 1)
    order, first, count = np.argsort(-bound), 0, FIRST_LOOK
    while first < len(order) and bound[order[first]] > (1 + ENOUGH) * known:
        at = order[first : first + count, None]
        for t in (tau, tau + (step - lead))[: 1 + (lead < step)]:
            inner = c[at] + d[at] * t + free[at] * np.exp(decay * t)
            known = max(known, _peak(*_quantity(k, decay, a[at] + rate[at] * t, inner), float(tau[1])))
        first, count = first + count, min(2 * count, MOST_AT_ONCE)
    return known


def _phi2(x: complex) -> complex:
    """(eˣ - 1 - x)/x², by its series near 0."""
    if abs(x) >= 1:
        return complex((np.expm1(x) - x) / x**2)
    total = term = 0.5 + 0j
    for k in range(3, SERIES + 3):
        term *= x / k
        total += term
    return total


def _bound(value: Vector, slope: Vector, h: float) -> Vector:
    """Bounds (…, k - 1) on the |f| of cubic pieces: their ends, and 4/27 of each slope's change in a step h."""
    size, change = np.abs(value), h * np.abs(slope)
    return np.maximum(size[..., :-1], size[..., 1:]) + MOST_BEYOND * (change[..., :-1] + change[..., 1:])


def _peak(value: Vector, slope: Vector, h: float) -> float:
    """Max |f| of the cubic pieces through values and slopes (…, k) on a grid of step h."""
    top = np.abs(value).max()
    higher = _bound(value, slope, h) > top
    parts = value[..., :-1], value[..., 1:], h * slope[..., :-1], h * slope[..., 1:]
    f0, f1, d0, d1 = (part[higher] for part in parts)
    # f' = d0 + 2 b s + 3 c s²: both roots, in the form without cancellation
    b, c = 3 * (f1 - f0) - 2 * d0 - d1, d0 + d1 - 2 * (f1 - f0)
    large = -b - np.copysign(np.sqrt(np.maximum(b**2 - 3 * c * d0, 0.0)), b)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        roots = np.stack((d0 / large, large / (3 * c)))
    s = np.where((roots > 0.0) & (roots < 1.0), roots, 0.0)
    inside = np.abs(f0 + s * (d0 + s * (b + s * c)))
    return float(max(top, inside.max(initial=0.0)))
