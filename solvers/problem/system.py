r"""The mechanical problem an integrator is handed, and its decoupled form.

.. math:: M \ddot q + (C + G) \dot q + K q = \sum_l v_l s_l(t) + \sum_s w_s F_s(δ_s, \dot δ_s),\qquad
          δ_s = -w_s^T q - g_s

Every method here integrates the same decoupled form: n blocks (p_j, v_j) with

    p_j' = v_j + ...,   v_j' = -k_j p_j - c_j v_j + ...,   z = [p, v],   [q, q'] = T z.

With proportional damping and no G, p is the modal coordinate and T = diag(Φ, Φ). Otherwise each complex pair (or pair
of real eigenvalues) of the state matrix gives one block, and loads and contacts push p as well as v.
Runge–Kutta and exact propagation commute with this change of coordinates, so nothing is lost by it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from solvers.problem.decoupling import Blocks, decouple
from solvers.problem.friction import Friction, Rubbing, row_of
from solvers.problem.matrices import Array, check_mass, dense, number, product, reals, square_matrix
from solvers.problem.memo import Memo

_SMALL = 64  # coordinates up to which one product gives the energy of a motion sooner than two of half the size


class Law(Protocol):
    """What a contact law must offer. `contacts.law.Law` has it all, and what laws with memory add.

    The C signature of ``address`` is
    ``void (int64 n, double *delta, double *delta_dot, double entry_rate, double *parameters, double *force)``.
    """

    knots: tuple[float, ...]
    jump: bool
    exponent: float
    entry_rate_floor: float

    @property
    def address(self) -> int:
        """Address of the compiled force."""

    @property
    def gradient_address(self) -> int:
        """Address of its derivatives: the same arguments, then arrays for ∂F/∂δ, ∂F/∂δ̇ and ∂F/∂entry_rate."""

    @property
    def parameters(self) -> Array:
        """Numbers for the compiled force."""

    def force(self, delta: ArrayLike, delta_dot: ArrayLike, entry_rate: ArrayLike) -> Array:
        """Force on arrays."""

    def batch(self, entry_rate: float) -> Callable[[Array, Array], Array]:
        """The force as a function of arrays δ and δ̇, for one entry rate."""


Signal = Callable[[Any], Any]
"""A function t -> value that broadcasts; may offer ``tones()`` or ``nodes(duration, rtol)``, see `signals`."""


@dataclass(frozen=True, eq=False)
class Contact:
    """One stop: ``delta = -direction @ q - gap``; it pushes with ``+direction * force`` while ``delta > 0``, or always.

    With ``map="annulus"`` the stop is a circular clearance of radius c, the gap. A place d = direction @ q - centre of
    two coordinates moves in it, r = |d|, and is pushed along the line to the centre:

        δ = r - c,  δ̇ = d·ḋ/r,  force on the place -N(δ, δ̇) d/r;    outer: δ = c - r, the force +N d/r

    `friction` acts along the tangential displacement ξ, by a force F_t against it whose power is F_t ξ̇. With
    ``map="oblique"``, a stop on a line with a tangential row, ξ = tangent @ q. In an annulus, with d at the angle θ,
    the place turned by φ = rotation @ q about its own axis and by the spin Ω beside, and touching at the radius R,

        ξ = c θ + R (φ + Ω t),    force on the place -F_t (c/r) e_θ, torque -R F_t on φ;    outer: with -R for R

    Parameters
    ----------
    direction : (n,), the way the stop pushes; (2, n) of an annulus, whose rows read the two coordinates of the place.
    law : a contact law, such as those of the package `contacts`; in an annulus one without memory.
    gap : clearance in m; negative for a preload. The radius c > 0 of an annulus.
    always : whether the law acts at both signs of ``delta``; its knots still count from ``delta = 0``. Of a
        law with memory for δ > 0 only, such as `contacts.WaltonBraun`, it is set: the law says where it is open.
    name : what logs call it; empty: "stop 0", "stop 1", … by its index.
    map : "line", "oblique" for one with friction, or "annulus" for a circular clearance.
    centre : (2,) m, of an annulus: where direction @ q is at its centre.
    outer : of an annulus, whether the place is outside, beside a post of radius c.
    friction : `Friction` of an oblique stop or an annulus, None for none.
    tangent : (n,) of an oblique stop: the way along its surface.
    rotation : (n,) of an annulus with friction: the row of φ, rad; None if it does not turn but by ``spin``.
    radius : R > 0, m, of an annulus with friction, of the place's own surface: what rotation and spin need.
    spin : Ω, rad/s, prescribed, of an annulus with friction.

    Examples
    --------
    >>> from contacts import Hertz
    >>> Contact([0.0, 1.0], Hertz(1e9), gap=1e-3).gap
    0.001

    The two coordinates of a place in a hole of radius 1 mm, in contact at (0.9, 0.6) mm:

    >>> hole = Contact([[1.0, 0.0], [0.0, 1.0]], Hertz(1e9), gap=1e-3, map="annulus")
    >>> round(float(hole.indentation([0.9e-3, 0.6e-3])), 9)
    8.1665e-05

    A ball that meets a wall at an angle, with friction along it:

    >>> Contact([-1.0, 0.0], Hertz(1e9), map="oblique", tangent=[0.0, 1.0], friction=Friction(0.2, 1e6)).friction
    Friction(mu=0.2, stiffness=1000000.0)
    """

    direction: Array
    law: Law
    gap: float = 0.0
    always: bool = False
    name: str = ""
    map: str = "line"
    centre: tuple[float, float] = (0.0, 0.0)
    outer: bool = False
    friction: Friction | None = None
    tangent: Array | None = None
    rotation: Array | None = None
    radius: float | None = None
    spin: float = 0.0

    def __post_init__(self) -> None:
        direction = reals(self.direction, "direction of a Contact", 1)
        if isinstance(self.law, Rubbing):  # of a contact that this one is made of
            object.__setattr__(self, "law", self.law.law)
        if not hasattr(self.law, "entry_rate_floor") or isinstance(self.law, type):
            hint = "decorate the function with @law and call it" if callable(self.law) else "use one of contacts"
            raise TypeError(f"law of a Contact must be a contact law, got {self.law!r}; {hint}")
        object.__setattr__(self, "gap", number(self.gap, "gap of a Contact"))
        self._check_map(direction)
        if self.memory and getattr(self.law, "one_sided", False):
            object.__setattr__(self, "always", True)  # its law itself says where it is open
        elif self.memory and not self.always:
            raise ValueError(f"{self.law!r} has a memory and acts at both signs of delta: give always=True")
        if not math.isfinite(self.gap):
            raise ValueError(f"gap must be finite, got {self.gap!r}; use no Contact at all for a stop out of reach")
        direction.setflags(write=False)
        object.__setattr__(self, "direction", direction)
        self._check_friction(direction)

    def _check_map(self, direction: Array) -> None:
        """Directions, clearance and centre fit the map."""
        if self.map not in ("line", "annulus", "oblique"):
            raise ValueError(
                f'map of a Contact must be "line" or "annulus", or "oblique" with friction, got {self.map!r}'
            )
        if self.map != "annulus":
            if direction.ndim != 1 or not np.all(np.isfinite(direction)):
                raise ValueError(f"direction of a Contact must be a finite vector, got {self.direction!r}")
            if self.outer or np.any(self.centre):
                raise ValueError('centre and outer belong to an annulus: give map="annulus", or leave them out')
            return
        if direction.ndim != 2 or len(direction) != 2 or not np.all(np.isfinite(direction)):
            raise ValueError(f"direction of an annulus must be two finite rows (2, n), got {self.direction!r}")
        if np.linalg.matrix_rank(direction) < 2:
            raise ValueError(f"the two rows of an annulus's direction must differ, got {self.direction!r}")
        if not 0.0 < self.gap < math.inf:
            raise ValueError(
                f"gap of an annulus, its clearance, must be positive and finite (m), got {self.gap!r}; "
                "without a clearance it is a spring in each direction"
            )
        if self.always or self.memory:
            raise ValueError(f"an annulus takes laws without memory that act for delta > 0, got {self.law!r}")
        centre = reals(self.centre, "centre of a Contact")
        if centre.shape != (2,) or not np.all(np.isfinite(centre)):
            raise ValueError(f"centre of an annulus must be two finite numbers (m), got {self.centre!r}")
        object.__setattr__(self, "centre", tuple(centre.tolist()))

    def _check_friction(self, direction: Array) -> None:
        """Friction has what it needs, and nothing is given for it where there is none; it becomes a part of the law."""
        if self.friction is None and self.map == "oblique":
            raise ValueError('map="oblique" is that of friction: give friction=Friction(mu, stiffness)')
        for name, of in {"tangent": "oblique", "rotation": "annulus", "radius": "annulus", "spin": "annulus"}.items():
            self._check_way_of_friction(name, of, direction.shape[-1])
        if self.friction is None:
            return
        self._check_tangent_and_law(direction)
        arm = 0.0 if self.radius is None else -self.radius if self.outer else self.radius
        object.__setattr__(self, "law", Rubbing(self.law, self.friction, float(arm), float(self.spin)))

    def _check_way_of_friction(self, name: str, of: str, size: int) -> None:
        """One of the numbers that say along which way friction acts belongs to the map ``of``; rows become arrays."""
        given: Any = getattr(self, name)
        if given is None or (name == "spin" and given == 0.0):
            return
        if self.map != of or self.friction is None:
            raise ValueError(f'{name} of a Contact belongs to map="{of}" with friction, got {given!r}')
        if name in ("tangent", "rotation"):
            object.__setattr__(self, name, row_of(name, given, size))
        elif not math.isfinite(given) or (name == "radius" and given <= 0.0):
            least = "positive and finite (m)" if name == "radius" else "finite (rad/s)"
            raise ValueError(f"{name} of a Contact must be {least}, got {given!r}")

    def _check_tangent_and_law(self, direction: Array) -> None:
        """A contact with friction has a map with a way to rub along, and a law without memory."""
        if not isinstance(self.friction, Friction):
            raise TypeError(f"friction of a Contact must be a Friction(mu, stiffness), got {self.friction!r}")
        if self.map == "line":
            raise ValueError('friction of a stop on a line needs map="oblique" and tangent=, the way along its surface')
        if self.map == "oblique" and self.tangent is None:
            raise ValueError('map="oblique" needs tangent=, the way along the surface of the stop')
        if self.tangent is not None and np.linalg.matrix_rank(np.stack((direction, self.tangent))) < 2:
            raise ValueError(f"tangent of a Contact must not lie along its direction, got {self.tangent!r}")
        if self.always or self.memory:
            raise ValueError(f"friction takes laws without memory that act for delta > 0, got {self.law!r}")
        if self.radius is None and (self.rotation is not None or self.spin != 0.0):
            raise ValueError("radius (m) of a Contact is missing: rotation and spin rub at a radius")

    @property
    def memory(self) -> list[int]:
        """Places, among its law's parameters, of the numbers that the law latches; none without a memory."""
        return list(getattr(self.law, "memory", ()))

    @property
    def rows(self) -> Array:
        """(m, n) the coordinates it acts on, one row each; of a rotation R φ."""
        turned = None if self.rotation is None or self.radius is None else self.radius * self.rotation
        more = [row for row in (self.tangent, turned) if row is not None]
        return np.vstack((self.direction, *more)) if more else np.atleast_2d(self.direction)

    @property
    def row_gaps(self) -> Array:
        """(m,) of each row, in m, by which ``-rows @ q - row_gaps`` is δ, or -d of an annulus."""
        if self.map == "annulus":
            return np.append(-np.array(self.centre), np.zeros(len(self.rows) - 2))
        return np.append(self.gap, np.zeros(len(self.rows) - 1))

    @property
    def surface(self) -> float:
        """R Ω, m/s, the speed that a spin gives the place's own surface; negative around a post."""
        law: Any = self.law
        return float(law.arm * self.spin) if self.friction is not None else 0.0

    @property
    def circle(self) -> float:
        """Clearance of an annulus in m, negative of an outer one; 0 of a stop on a line."""
        if self.map != "annulus":
            return 0.0
        return -self.gap if self.outer else self.gap

    def indentation(self, q: ArrayLike) -> Array:
        """δ (...) in m at coordinates (..., n)."""
        if self.map != "annulus":
            return -np.asarray(q) @ self.direction - self.gap
        distance = np.linalg.norm(np.asarray(q) @ self.direction.T - self.centre, axis=-1)
        return self.gap - distance if self.outer else distance - self.gap

    def motion(self, q: Array, q_dot: Array) -> tuple[float, float, Array, Array]:
        """δ in m and δ̇ in m/s of a state, and their derivatives ∂δ/∂q and ∂δ̇/∂q, both (n,); ∂δ̇/∂q̇ is ∂δ/∂q."""
        delta = float(self.indentation(q))
        if self.map != "annulus":
            return delta, float(-q_dot @ self.direction), -self.direction, np.zeros(self.direction.size)
        place, speed = self.direction @ q - self.centre, self.direction @ q_dot
        distance = np.linalg.norm(place)
        along = (-place if self.outer else place) / distance
        rate = along @ speed
        turning = (speed if not self.outer else -speed) / distance - rate * place / distance**2
        return delta, float(rate), along @ self.direction, turning @ self.direction


@dataclass(frozen=True, eq=False)
class System:
    """Matrices, contacts and loads of one problem, M q̈ + (C + G) q̇ + K q = Σ v_l s_l(t) + Σ w_s F_s(δ_s, δ̇_s).

    Parameters
    ----------
    M, C, K : (n, n), dense or SciPy sparse; M symmetric positive definite, C and K symmetric. Sparse ones stay sparse
        for methods that step on matrices; other methods, and `blocks`, take n³ operations once.
    contacts : sequence of `Contact`.
    loads : sequence of ``(vector (n,), signal)``.
    gyroscopic : G (n, n), skew: of a rotor, or of a frame that turns; it does no work. None for none.

    Raises
    ------
    ValueError for shapes that do not fit, entries that are not finite, or M not positive definite. `blocks`, which all
    methods ask for but those that step on matrices, raises it where a body with gyroscopic terms can float.

    Examples
    --------
    >>> mass = System(M=[[2.0]], C=[[0.0]], K=[[0.0]])
    >>> mass.size
    1

    A disk of I_d = 1 and I_p Ω = 3 whose axis is held by springs whirls at 1 backward and at 4 forward:

    >>> disk = System(np.eye(2), np.zeros((2, 2)), 4.0 * np.eye(2), gyroscopic=[[0.0, 3.0], [-3.0, 0.0]])
    >>> np.sqrt(disk.blocks.k).round(12).tolist()
    [1.0, 4.0]
    """

    M: Any
    C: Any
    K: Any
    contacts: Sequence[Contact] = ()
    loads: Sequence[tuple[ArrayLike, Signal]] = ()
    gyroscopic: Any = None
    # what methods prepare once, by what it depends on: all of the system; matrices and vectors of contacts and loads;
    # the laws. The last two are shared by systems made by `like` as long as these parts stay
    kept: Memo = field(default_factory=Memo, init=False, repr=False)
    about_structure: Memo = field(default_factory=Memo, init=False, repr=False)
    about_laws: Memo = field(default_factory=Memo, init=False, repr=False)

    def __repr__(self) -> str:
        return f"<system of size {self.size}, contacts: {len(self.contacts)}, loads: {len(self.loads)}>"

    def __post_init__(self) -> None:
        for name in "MCK":
            object.__setattr__(self, name, square_matrix(name, getattr(self, name)))
        if not self.M.shape == self.C.shape == self.K.shape:
            raise ValueError(f"M, C, K must have one shape, got {self.M.shape}, {self.C.shape}, {self.K.shape}")
        names = ["M", "C", "K"]
        if self.gyroscopic is not None:
            names.append("gyroscopic")
            object.__setattr__(self, "gyroscopic", square_matrix("gyroscopic", self.gyroscopic, skew=True))
            if self.gyroscopic.shape != self.M.shape:
                raise ValueError(f"gyroscopic must have the shape of M, {self.M.shape}, got {self.gyroscopic.shape}")
        if not all(hasattr(getattr(self, name), "toarray") for name in names):
            for name in names:
                object.__setattr__(self, name, dense(getattr(self, name)))
        check_mass(self.M)
        self._check_contacts_and_loads()

    def _check_contacts_and_loads(self, known: Sequence[Any] = ()) -> None:
        """Contacts and loads fit the matrices; of loads with unchanged vectors only the signals are checked."""
        for name, each in (("contacts", "of Contact"), ("loads", "of pairs (vector, signal)")):
            if not isinstance(getattr(self, name), Iterable):
                raise TypeError(f"{name} must be a sequence {each}, got {getattr(self, name)!r}")
        object.__setattr__(self, "contacts", tuple(self.contacts))
        object.__setattr__(self, "loads", tuple(self._load(i, pair, known) for i, pair in enumerate(self.loads)))
        for i, contact in enumerate(self.contacts):
            if not isinstance(contact, Contact):
                raise TypeError(f"contact {i} must be a Contact, got {contact!r}")
            if contact.rows.shape[1] != self.size:
                raise ValueError(f"contact {i} has a direction of {contact.rows.shape[1]}, the system {self.size}")

    def like(
        self, contacts: Sequence[Contact] | None = None, loads: Sequence[tuple[ArrayLike, Signal]] | None = None
    ) -> System:
        """The same structure with other contacts or loads; its matrices are neither checked nor decoupled again."""
        other = object.__new__(System)
        other.__dict__.update(self.__getstate__(), blocks=self.blocks, push=self.push)
        other.__dict__.pop("latches", None)  # of the contacts
        for name, value in (("contacts", contacts), ("loads", loads)):
            if value is not None:
                other.__dict__[name] = value
        other._check_contacts_and_loads([vector for vector, _ in self.loads])
        if len(self.contacts) == len(other.contacts):
            pairs = zip(self.contacts, other.contacts, strict=True)
            if all(a.law is b.law and a.always == b.always for a, b in pairs):
                other.__dict__["about_laws"] = self.about_laws
            if self._vectors_are_those_of(other):
                other.__dict__["about_structure"] = self.about_structure
        return other

    def _vectors_are_those_of(self, other: System) -> bool:
        """Whether contacts and loads act along the same vectors."""
        if len(self.loads) != len(other.loads):
            return False
        pairs: list[tuple[Any, Any]] = [
            (a.rows, b.rows) if a.friction or b.friction else (a.direction, b.direction)
            for a, b in zip(self.contacts, other.contacts, strict=True)
        ]
        pairs += [(a, b) for (a, _), (b, _) in zip(self.loads, other.loads, strict=True)]
        return all(a is b or np.array_equal(a, b) for a, b in pairs)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or another process gets: all but what methods have prepared, which holds addresses of memory."""
        return {**self.__dict__, "kept": Memo(), "about_structure": Memo(), "about_laws": Memo()}

    def _load(self, i: int, pair: tuple[ArrayLike, Signal], known: Sequence[Any]) -> tuple[Array, Signal]:
        """One checked load."""
        try:
            given, signal = pair
        except (TypeError, ValueError):
            raise TypeError(f"load {i} must be a pair (vector, signal), got {pair!r}") from None
        vector: Any = next((vector for vector in known if vector is given), None)
        if vector is None:
            vector = reals(given, f"vector of load {i}", 1)
            vector.setflags(write=False)
            if vector.shape != (self.size,) or not np.all(np.isfinite(vector)):
                raise ValueError(f"load {i} needs a finite vector of {self.size}, got {vector!r}")
        if not callable(signal):
            raise TypeError(f"load {i} needs a signal t -> value, got {signal!r}")
        return vector, signal

    @cached_property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.M.shape[0])

    @classmethod
    def modal(
        cls,
        omega: ArrayLike,
        zeta: ArrayLike,
        contacts: Sequence[Contact] = (),
        loads: Sequence[tuple[ArrayLike, Signal]] = (),
    ) -> System:
        """Mass-normalised modes: M = I, C = diag(2 ζ ω), K = diag(ω²); one ζ serves all modes.

        Parameters
        ----------
        omega : (n,) rad/s, >= 0; 0 for a rigid-body mode.
        zeta : one number or (n,), >= 0.
        contacts, loads : as for `System`, in modal coordinates.
        """
        omega, zeta = reals(omega, "omega", 1), reals(zeta, "zeta")
        if omega.ndim != 1 or zeta.shape not in ((), (1,), omega.shape):
            raise ValueError(
                f"omega must be a row of numbers, zeta one number or as many, got shapes {omega.shape}, {zeta.shape}"
            )
        zeta = np.broadcast_to(zeta, omega.shape)
        if not (np.all(np.isfinite(omega)) and np.all(omega >= 0.0)):
            raise ValueError(f"omega must be finite and >= 0 (rad/s), got {omega}")
        if not (np.all(np.isfinite(zeta)) and np.all(zeta >= 0.0)):
            raise ValueError(f"zeta must be finite and >= 0, got {zeta}")
        return cls(np.eye(omega.size), np.diag(2.0 * zeta * omega), np.diag(omega**2), contacts, loads)

    @cached_property
    def latches(self) -> bool:
        """Whether any law latches numbers on borders."""
        return any(getattr(contact.law, "borders", 0) for contact in self.contacts)

    @cached_property
    def blocks(self) -> Blocks:
        """The decoupled form."""
        G = None if self.gyroscopic is None else dense(self.gyroscopic)
        return decouple(dense(self.M), dense(self.C), dense(self.K), G)

    @property
    def by_rate(self) -> Any:
        """C + G, what multiplies q̇."""
        return self.C if self.gyroscopic is None else self.C + self.gyroscopic

    @cached_property
    def push(self) -> Array:
        """(2n, n) rate of the blocks' state per unit force on every coordinate."""
        return self.blocks.inverse[:, self.size :] @ np.linalg.inv(dense(self.M))

    @property
    def sparse(self) -> bool:
        """Whether the matrices were given sparse."""
        return hasattr(self.M, "toarray")

    def energy(self, q: Array, q_dot: Array) -> Array:
        """Stored energy ½ q'ᵀ M q' + ½ qᵀ K q in J, for (..., n) arrays; inf of a run that diverged."""
        with np.errstate(over="ignore", invalid="ignore"):
            return 0.5 * (np.vecdot(product(q_dot, self.M), q_dot) + np.vecdot(product(q, self.K), q))

    def energy_of(self, motion: Array) -> Array:
        """The same for rows [q, q̇] (k, 2n)."""
        n = self.size
        if n > _SMALL:
            return self.energy(motion[:, :n], motion[:, n:])
        with np.errstate(over="ignore", invalid="ignore"):
            return np.vecdot(motion.dot(self._energy_form), motion)

    @cached_property
    def _energy_form(self) -> Array:
        """(2n, 2n) of which the energy is the quadratic form in [q, q̇]."""
        none = np.zeros((self.size, self.size))
        return 0.5 * np.block([[dense(self.K), none], [none, dense(self.M)]])


@dataclass(frozen=True, eq=False)
class Parameter:
    """A scalar of the problem, given by the systems at its value less and plus ``step``.

    The derivative d[q, q̇]/d(parameter) at fixed start and fixed duration. Where the systems differ in loads' tones,
    gaps and laws' parameters only, these data are differenced and the motion's derivative is exact; where anything
    else differs (matrices, directions, knots, sampled signals), it is the central difference of two runs.

    Parameters
    ----------
    behind, ahead : systems of one size, with the same number of contacts and loads.
    step : half the difference of the parameter, > 0.

    Examples
    --------
    >>> soft, stiff = (System.modal(omega=[w], zeta=[0.0]) for w in (1.99, 2.01))
    >>> Parameter(soft, stiff, step=0.01).step
    0.01
    """

    behind: System
    ahead: System
    step: float

    def __post_init__(self) -> None:
        if not 0.0 < self.step < math.inf:
            raise ValueError(f"step of a Parameter must be positive and finite, got {self.step!r}")
        sizes = [(s.size, len(s.contacts), len(s.loads)) for s in (self.behind, self.ahead)]
        if sizes[0] != sizes[1]:
            raise ValueError(f"the systems of a Parameter differ in coordinates, contacts or loads: {sizes}")


def require_step(name: str, value: float) -> None:
    """ValueError for a step that is none."""
    if not 0.0 < number(value, name) < np.inf:
        raise ValueError(f"{name} must be positive and finite (s), got {value!r}")
