"""Synchronous rub: a round rotor that whirls with its spin in one circular clearance and never leaves it.

In the frame that turns with Ω, q = exp(ΩJt) p, it is an equilibrium; J turns the rotor by a right angle about its axis:

    M p̈ + (C + G + 2ΩMJ) ṗ + (K + Ω(C + G)J + Ω²MJ²) p = f₀ - Wᵀ (N e_r + σμN (c/r) e_θ)

With its compliance α there, a complex number as x + iy is, the radius r of one that slips all the way follows from

    |r + α N(r - c) (1 + iσμ c/r)| = |d₀|,    d₀ the unbalance's own whirl;  one disk:  1/α = k - mΩ² + icΩ
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import solvers
from fembeam.scene import AnnularStop, spin_of, tangent, with_value
from fembeam.support import Part, Printed, require, require_finite

if TYPE_CHECKING:
    from fembeam.model.model import Model

Vector = NDArray[np.float64]
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])  # turns x to y
ROUND = 1e-6  # of the size of matrices and loads: what a rotor may lack of being round
FELT = 1e-4  # of the size of the largest row of a matrix: what rounding leaves of rows of nothing, as of twist
DEEPEST, LEAST, TRIED = 1e3, 1e-9, 2000  # indentations looked at, of clearance or free whirl, and how many
WHERE = "Model.rub"


@dataclass(frozen=True, eq=False, repr=False)
class Rub(Printed):
    """A synchronous rub.

    Attributes
    ----------
    spin : Ω, rad/s. radius : r of the whirl, m. angle : rad, of the place from the stop's first direction at t = 0.
    indentation : δ, m. force : N. friction : F_t, N, as in `Run.friction`. sliding_speed : ξ̇, m/s.
    eigenvalues : (2n,) 1/s in the turning frame, the least damped first. radii : of all such rubs at this spin, m.
    state : (2n,) [q, q̇] at t = 0, a start for `simulate`.
    """

    spin: float
    radius: float
    angle: float
    indentation: float
    force: float
    friction: float
    sliding_speed: float
    eigenvalues: NDArray[np.complex128]
    radii: tuple[float, ...]
    state: Vector

    def __repr__(self) -> str:
        kind = "stable" if self.stable else "unstable"
        return f"<rub at {self.spin:g} rad/s, {kind}: radius {self.radius:.6g} m, force {self.force:.6g} N>"

    @property
    def growth(self) -> float:
        """Largest real part of the eigenvalues, 1/s: negative where small disturbances die away."""
        return float(self.eigenvalues.real.max())

    @property
    def stable(self) -> bool:
        """Whether small disturbances die away."""
        return self.growth < 0.0

    @property
    def power(self) -> float:
        """F_t ξ̇, W: what wears and heats."""
        return self.friction * self.sliding_speed

    def _parts(self) -> list[Part]:
        rows = [(one.real, one.imag) for one in self.eigenvalues.tolist()]
        forces = f"friction {self.friction:.6g} N at {self.sliding_speed:.6g} m/s: {self.power:.6g} W"
        return [repr(self), forces, (("real part / 1/s", "imaginary part / rad/s"), rows)]


def rub(model: Model, spin: float | None, near: float | None, entry_rate: float | None) -> Rub:
    """`Model.rub`, which explains it."""
    model, omega = _spun(model, spin)
    _check(model, entry_rate)
    J = quarter_turn(model)
    start = _turning_load(model, J, omega)
    return synchronous_rub(model.system, omega, J, start, near, entry_rate)


def _spun(model: Model, spin: float | None) -> tuple[Model, float]:
    """The model at a spin, and Ω about the axis of its stop."""
    scene, stops = model.scene, model.scene.stops
    one = len(stops) == 1 and isinstance(stops[0], AnnularStop) and not scene.elements and not scene.bodies
    has = {"stops": len(stops), "elements": len(scene.elements), "bodies": len(scene.bodies)}
    require(one, "a synchronous rub needs one AnnularStop, and no other stop, element or body", has, WHERE,
            "leave the others out; else ask orbit()")  # fmt: skip
    if spin is not None:
        require_finite("spin", spin, WHERE, "give rad/s")
    if not hasattr(scene.beam, "spin"):  # turned by its loads alone
        require(spin is not None, "spin must be given for a body that has none", None, WHERE, "give rad/s")
        assert spin is not None
        return model, float(spin)
    if spin is not None and spin != scene.beam.spin:
        require(spin != 0.0, "spin must not be 0", spin, WHERE, "give rad/s")
        model = model.again(with_value(scene, "beam.spin", float(spin)))
    omega = spin_of(model.scene.beam, model.scene.stops[0])
    require(omega != 0.0, "the shaft must spin", omega, WHERE, "give rad/s")
    return model, omega


def _check(model: Model, entry_rate: float | None) -> None:
    """Raise ValueError for what floats, a circle off the axis, damping by a speed of entry that is not known."""
    stop = model.scene.stops[0]
    assert isinstance(stop, AnnularStop)
    held = bool(np.all(model.omega > 0.0))
    require(held, "the rotor must be held, also in twist, which friction would drive ever faster", "a free motion",
            WHERE, "write bending_only=True, or hold it by a spring, however soft")  # fmt: skip
    require(not any(stop.centre), "the circle must lie round the axis", stop.centre, WHERE, "leave the centre out")
    latches = tangent(stop.law, 1e-6, 0.0, 1.0) != tangent(stop.law, 1e-6, 0.0, 2.0)
    require(not latches or entry_rate is not None, "the damping of this law goes by the speed of entry", stop.law,
            WHERE, "give entry_rate in m/s, that of the contact since it began")  # fmt: skip


def quarter_turn(model: Model) -> Vector:
    """J (n, n): by it coordinates turn by a right angle about the axis of the stop; ValueError of what is not round."""
    first, second = (place.along[:3] for place in model.scene.stops[0].coordinates)
    places = model.shapes.known
    x, y = (model.phi([(place, tuple(way)) for place in places]) for way in (first, second))
    both, turned = np.vstack([x, y]), np.vstack([-y, x])
    J: Vector = np.asarray(np.linalg.lstsq(both, turned, rcond=1e-9)[0], dtype=float)
    system = model.system
    lack = np.abs(both @ J - turned).max() / np.abs(both).max()
    for matrix in (system.K, system.C, system.by_rate - system.C):
        lack = max(lack, _apart(np.asarray(matrix), J))
    require(lack < ROUND, "a synchronous rub needs a round rotor on round supports, with both modes of each pair",
            f"a lack of {lack:.3g}", WHERE, "keep as many modes as cut no pair; else ask orbit()")  # fmt: skip
    return J


def _apart(matrix: Vector, J: Vector) -> float:
    """How far a matrix and J are from commuting; one of gyroscopic moments has nothing on its diagonal."""
    rows = np.sqrt(np.abs(matrix).max(axis=1, initial=0.0))
    if not rows.any():
        return 0.0
    size = rows + FELT * rows.max()
    return float(np.abs((matrix @ J - J @ matrix) / np.outer(size, size)).max())


def _turning_load(model: Model, J: Vector, omega: float) -> Vector:
    """f₀ (n,), the load at t = 0; ValueError unless it turns with Ω."""

    def load(angle: float) -> Vector:
        t = angle / omega
        found = (np.asarray(vector) * float(np.squeeze(signal(t))) for vector, signal in model.system.loads)
        return np.sum([*found, np.zeros(len(J))], axis=0)

    start, sign = load(0.0), math.copysign(1.0, omega)
    size, off = np.abs(start).max(initial=0.0), 0.0
    for angle in (sign * 0.5 * math.pi, sign * 1.1, sign * 4.0):  # from t = 0 on
        wanted = math.cos(angle) * start + math.sin(angle) * J @ start
        off = max(off, np.abs(load(angle) - wanted).max(initial=0.0))
    require(size > 0.0 and off < ROUND * size, "the loads must be an unbalance, and turn with the spin",
            [signal for _, signal in model.system.loads], WHERE, "drive it by Unbalance alone")  # fmt: skip
    return start


def synchronous_rub(
    system: solvers.System,
    spin: float,
    J: Vector,
    load: Vector,
    near: float | None = None,
    entry_rate: float | None = None,
    lever: bool = True,
) -> Rub:
    """The rub of a system with one annular contact, by its matrices.

    Parameters
    ----------
    system : with M, C, K, G that commute with J; the contact is a hole round the axis. spin : Ω, rad/s, of the whirl.
    J : (n, n), a quarter turn; 0 on what does not turn. load : (n,) f₀, at t = 0, where it turns with Ω.
    near : the radius wanted, m, where there are several; None: the largest. entry_rate : m/s, as for `Model.rub`.
    lever : False leaves out c/r of the force of friction: μN on the place, as in textbooks; F_t ξ̇ is then not its
        power, by a share δ/c.
    """
    turning = _Turning(system, spin, J, load, entry_rate or 1.0, lever)
    radii = turning.radii()
    if not radii:
        raise solvers.OrbitError(
            f"no synchronous rub at {spin:g} rad/s: the unbalance alone whirls at {abs(turning.free):.6g} m, the "
            f"clearance is {turning.contact.gap:g} m; ask simulate what the rotor does"
        )
    r = radii[-1] if near is None else min(radii, key=lambda one: abs(one - near))
    angle = float(np.angle(turning.free / turning.resisted(r)))
    p = turning.equilibrium(r, angle)
    normal, slip = turning.force(r), turning.slip
    state = np.concatenate((p, spin * J @ p))
    delta, values = r - turning.contact.gap, turning.eigenvalues(r, angle)
    return Rub(spin, r, angle, delta, normal, slip * normal, turning.sliding_speed, values, radii, state)


@dataclass(frozen=True, eq=False)
class _Turning:
    """A rotor in the frame that turns with it, in contact at a radius r and an angle."""

    system: solvers.System
    spin: float
    J: Vector
    load: Vector
    entry_rate: float
    lever: bool

    @property
    def contact(self) -> solvers.Contact:
        """The circular clearance."""
        return self.system.contacts[0]

    @property
    def arm(self) -> float:
        """R, m; 0 without."""
        return self.contact.radius or 0.0

    @property
    def sliding_speed(self) -> float:
        """ξ̇ = cΩ + RΩ, m/s."""
        return self.contact.gap * self.spin + self.arm * self.contact.spin

    @property
    def slip(self) -> float:
        """σμ; 0 without friction."""
        rubs = self.contact.friction
        return 0.0 if rubs is None else math.copysign(rubs.mu, self.sliding_speed)

    @cached_property
    def dynamic(self) -> Vector:
        """K + Ω(C + G)J + Ω²MJ²."""
        system, J = self.system, self.J
        return np.asarray(system.K + self.spin * system.by_rate @ J + self.spin**2 * system.M @ J @ J)

    @cached_property
    def free(self) -> complex:
        """d₀, the whirl without contact, m."""
        return complex(*(self.contact.direction @ np.linalg.solve(self.dynamic, self.load)))

    @cached_property
    def compliance(self) -> complex:
        """α, m/N."""
        both = self.contact.direction @ np.linalg.solve(self.dynamic, self.contact.direction.T)
        return complex(both[0, 0], both[1, 0])

    def share(self, r: Any) -> Any:
        """c/r of the force of friction."""
        return self.contact.gap / r if self.lever else 1.0

    def force(self, r: Any) -> Any:
        """N, of radii (k,) too."""
        delta = r - self.contact.gap
        found = self.contact.law.force(np.maximum(delta, 0.0), 0.0, self.entry_rate)
        return np.where(delta > 0.0, found, 0.0) if np.ndim(r) else float(np.squeeze(found)) * (delta > 0.0)

    def resisted(self, r: Any) -> Any:
        """The whirl without contact that is needed for a radius, in the direction of the place."""
        return r + self.compliance * self.force(r) * (1.0 + 1j * self.slip * self.share(r))

    def radii(self) -> tuple[float, ...]:
        """All radii in contact, ascending; those closer together than the trials are not told apart."""
        from scipy.optimize import brentq

        c, free = self.contact.gap, abs(self.free)
        tried = c + np.append(0.0, np.geomspace(LEAST * c, DEEPEST * max(c, free), TRIED))

        def apart(r: Any) -> Any:
            return np.abs(self.resisted(r)) - free

        signs = np.sign(apart(tried))
        turns = np.flatnonzero(signs[1:] * signs[:-1] < 0.0)
        return tuple(float(brentq(apart, tried[i], tried[i + 1], xtol=1e-16 * c, rtol=1e-14)) for i in turns)

    def pushed(self, r: float, angle: float) -> tuple[Vector, Vector, Vector]:
        """(2,) unit vectors along the radius and across it, and the way w of the force -N w on the place."""
        along = np.array([math.cos(angle), math.sin(angle)])
        across = QUARTER @ along
        return along, across, along + self.slip * self.share(r) * across

    @property
    def torque(self) -> Vector:
        """(n,) -∂(force on the coordinates)/∂N by the torque."""
        row = self.contact.rotation
        return np.zeros(len(self.J)) if row is None else self.arm * self.slip * np.asarray(row)

    def equilibrium(self, r: float, angle: float) -> Vector:
        """Coordinates (n,) in the turning frame."""
        way = self.contact.direction.T @ self.pushed(r, angle)[2] + self.torque
        return np.asarray(np.linalg.solve(self.dynamic, self.load - self.force(r) * way))

    def eigenvalues(self, r: float, angle: float) -> NDArray[np.complex128]:
        """(2n,) 1/s, the least damped first."""
        law: Any = self.contact.law if self.contact.friction is None else self.contact.law.law  # type: ignore[attr-defined]
        slope, rate = tangent(law, r - self.contact.gap, 0.0, self.entry_rate)
        along, across, way = self.pushed(r, angle)
        W, normal, share = self.contact.direction, self.force(r), self.slip * self.share(r)
        grown = np.outer(W.T @ way + self.torque, along @ W)  # of N, by δ
        bend = np.outer(across - share * along, across) / r - self.lever * share / r * np.outer(across, along)
        stiffness = self.dynamic + slope * grown + normal * W.T @ bend @ W
        M, J = np.asarray(self.system.M), self.J
        damping = self.system.by_rate + 2.0 * self.spin * M @ J + rate * grown
        right = np.linalg.solve(M, np.hstack([stiffness, damping]))
        values = np.linalg.eigvals(np.vstack([np.hstack([0.0 * M, np.eye(len(M))]), -right]))
        return np.asarray(values[np.lexsort((values.imag, -values.real.round(9)))])
