"""A nonlinear element as a spring and a dashpot, over the amplitude: harmonic balance of its law.

On the cycle δ = m + X cos θ, θ = ωt, the force is replaced by the linear one that has the same first harmonic:

    k = 1/(π X) ∮ F cos θ dθ,    ω c = W/(π X²),    W = ∮ F dδ

k is the equivalent stiffness, c the equivalent damping, and W the energy lost in a cycle, which c loses exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contacts import Law, Sum
from contacts.path import walk
from contacts.sums import Gated
from fembeam import plot
from fembeam.study.result import Result
from fembeam.support import Part, by_rows, number, require, require_switch, vector

Vector = NDArray[np.float64]
WHERE = "study.equivalent"
GAUSS = np.polynomial.legendre.leggauss(24)  # on each piece of a cycle
SAME = 1e-9  # of the force's size: two cycles that differ by less are one
CYCLES, ROUNDS = 3, 64  # of a round; rounds until cycles are the same
SLOWEST = 1.0 - 1e-6  # ratio of two changes from cycle to cycle, above which they are no series that ends


@dataclass(frozen=True, eq=False, repr=False)
class Equivalent(Result):
    """A law over amplitude.

    Attributes
    ----------
    name : of the law.
    amplitude : X (k,), m. mean : m, about which δ moves.
    energy : W (k,), J lost in a cycle.
    stiffness : k (k,), N/m, the first harmonic in phase with δ.
    loss_stiffness : ω c (k,), N/m, the first harmonic in phase with the rate.
    omega : rad/s; None: a slow cycle, on which dashpots give nothing.
    """

    INDEX: ClassVar[str] = "amplitude"

    name: str
    amplitude: Vector
    mean: float
    energy: Vector
    stiffness: Vector
    loss_stiffness: Vector
    omega: float | None = None

    def __repr__(self) -> str:
        return f"<{self.name} as a spring and a dashpot at {len(self.amplitude)} amplitudes>"

    @property
    def damping(self) -> Vector:
        """C (k,), N s/m, at the frequency of the cycle; ValueError for a slow one, whose c has no limit."""
        require(self.omega is not None, "a slow cycle has no damping coefficient", self.omega, WHERE,
                "give omega=, or use loss_stiffness = ω c")  # fmt: skip
        return self.loss_stiffness / float(self.omega or math.nan)

    @property
    def loss_factor(self) -> Vector:
        """η = ω c/k (k,); half of it is the damping ratio of a mass on this element at resonance."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.loss_stiffness / self.stiffness

    def table(self) -> list[dict[str, Any]]:
        """A row for each amplitude, in SI units."""
        names = "amplitude", "energy", "stiffness", "loss_stiffness", "loss_factor"
        return by_rows({name: getattr(self, name) for name in names})

    def _units(self) -> dict[str, str]:
        return {"amplitude": "m", "energy": "J", "stiffness": "N/m", "loss_stiffness": "N/m"}

    figure = plot.equivalent

    def _parts(self) -> list[Part]:
        head = ("amplitude / m", "energy per cycle / J", "stiffness / N/m", "ω c / N/m", "loss factor")
        return [repr(self), (head, [tuple(row.values()) for row in self.table()])]


def equivalent(
    law: Law, amplitudes: ArrayLike, omega: float | None = None, mean: float = 0.0, stop: bool = False
) -> Equivalent:
    """Energy per cycle, equivalent stiffness and damping of a law over amplitude, by harmonic balance.

    On δ = m + X cos ωt the law is replaced by k (δ - m) + c δ̇ with the same first harmonic:

        k = 1/(π X) ∮ F cos θ dθ,    ω c = W/(π X²),    W = ∮ F dδ

    Parameters
    ----------
    law : of an element, which acts at both signs of δ, or of a stop.
    amplitudes : X (k,), m, > 0.
    omega : rad/s, > 0, for laws whose force depends on the rate; None: a slow cycle.
    mean : m, finite, about which δ moves: -g for a gap g in a motion about the rest.
    stop : whether there is no force where δ <= 0; so it is for laws that know δ > 0 only, and for dashpots beside them.

    Returns
    -------
    Equivalent : print it, `table()`, `figure()`, arrays `energy`, `stiffness`, `loss_stiffness`, `damping`.

    Raises
    ------
    ValueError : amplitudes that are no positive numbers, a law whose cycles do not become the same.

    Notes
    -----
    Laws with memory are followed along cycles until these repeat, exactly from border to border; their own rates give
    nothing, as in `Law.along`. The steady cycle counts, not the first. What is lost at higher harmonics of the motion
    is left out: the approximation is good where the motion at the element is nearly harmonic.

    References
    ----------
    N.M. Krylov, N.N. Bogoliubov, Introduction to Non-Linear Mechanics (1943); T.K. Caughey, J. Appl. Mech. 27 (1960)
    640 (bilinear hysteresis).

    Examples
    --------
    >>> from contacts import Jenkins
    >>> found = equivalent(Jenkins(2e4, 10.0), [4e-4, 1e-3])  # 4 f (X - f/k) where it slips
    >>> found.energy.round(6).tolist(), found.stiffness.round().tolist()
    ([0.0, 0.02], [20000.0, 10000.0])
    """
    require_switch("stop", stop, WHERE)
    require(isinstance(law, Law), "law must be a contact law", law, WHERE, "give one of `contacts`, such as Jenkins")
    X = vector("amplitudes", amplitudes, WHERE, "give them in m", "must be above 0 and finite, (k,)",
               lambda x: np.isfinite(x) & (x > 0.0))  # fmt: skip
    if omega is not None:
        number("omega (rad/s)", omega, above=0.0)
    middle = number("mean (m)", mean)
    rows = np.array([harmonics(law, float(x), middle, omega, stop) for x in X])
    k, loss = rows[:, 0] / (math.pi * X), rows[:, 1] / (math.pi * X**2)
    return Equivalent(type(law).__name__, X, middle, rows[:, 1], k, loss, omega)


def harmonics(law: Law, X: float, mean: float, omega: float | None = None, stop: bool = False) -> Vector:
    """(∮ F cos θ dθ, ∮ F dδ) of the steady cycle; of a sum, the sum of both."""
    if isinstance(law, Sum):
        stop = stop or (law.one_sided and not law.memory)
        return np.sum([_of_part(part, X, mean, omega, stop) for part in law.acting], axis=0)
    return _with_memory(law, X, mean) if law.memory else _without(law, X, mean, omega, stop)


def _of_part(part: Law, X: float, mean: float, omega: float | None, stop: bool) -> Vector:
    """`harmonics` of a law beside others, some of which make it act for δ > 0 only."""
    if isinstance(part, Gated):
        return harmonics(part.law, X, mean, omega, stop=True)
    return harmonics(part, X, mean, omega, stop)


def _without(law: Law, X: float, mean: float, omega: float | None, stop: bool) -> Vector:
    """By quadrature in θ between the places where the law has a kink, or a power of δ begins."""
    from scipy.integrate import quad

    open_ = stop or law.one_sided
    met = [math.acos((place - mean) / X) for place in (0.0, *law.knots) if abs(place - mean) < X]
    turns = np.unique([0.0, math.pi, 2.0 * math.pi, *met, *(2.0 * math.pi - angle for angle in met)])
    entry = (omega or 0.0) * math.sqrt(max(X**2 - mean**2, 0.0))
    force = law.batch(max(entry, law.entry_rate_floor))

    def at(theta: float) -> float:
        delta, rate = mean + X * math.cos(theta), -(omega or 0.0) * X * math.sin(theta)
        if open_ and delta <= 0.0:
            return 0.0
        return float(force(np.array([delta]), np.array([rate]))[0])

    def integral(weight: Any) -> float:
        parts = (quad(lambda x: at(x) * weight(x), a, b, epsrel=1e-10, limit=200)[0] for a, b in pairwise(turns))
        return float(sum(parts))

    return np.array([integral(math.cos), -X * integral(math.sin)])


def _with_memory(law: Law, X: float, mean: float) -> Vector:
    """From border to border of a cycle, of the first that is that of the round before, too."""
    row, before = _round(law, np.array([0.0, mean + X]), X, mean, law.parameters)[2][-1], np.full(2, math.inf)
    for _ in range(ROUNDS):
        sums, size, rows = _round(law, np.array([mean + X, *[mean - X, mean + X] * CYCLES]), X, mean, row)
        if np.all(np.abs(np.array([sums[-2], before]) - sums[-1]) <= SAME * size * np.array([1.0, X])):
            return sums[-1]
        row, before = _settled(rows, list(law.memory)), sums[-1]
    raise ValueError(
        f"cycles of {type(law).__name__} between {mean - X:g} and {mean + X:g} m are not the same after "
        f"{ROUNDS * CYCLES}: it has no steady loop there; give another amplitude or mean"
    )


def _round(law: Law, path: Vector, X: float, mean: float, row: Vector) -> tuple[Vector, float, Vector]:
    """Sums (c, 2) over the cycles of a path, largest |F|, parameters (c, …) at the end of each."""
    count = max(1, len(path) // 2)
    sums, rows, size = np.zeros((count, 2)), np.tile(row, (count, 1)), 0.0
    for piece in walk(law, path, row):
        found, rows[piece.first // 2] = _over(law, piece, X, mean), piece.parameters
        sums[piece.first // 2] += found[:2]
        size = max(size, found[2])
    return sums, size, rows


def _settled(rows: Vector, memory: list[int]) -> Vector:
    """Parameters with what is latched where it leads to: of three that settle as a geometric series, the limit."""
    row, (first, second) = rows[-1].copy(), np.diff(rows[-3:, memory], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = second / first
        row[memory] += np.where((ratio > 0.0) & (ratio < SLOWEST), second * ratio / (1.0 - ratio), 0.0)
    return row


def _over(law: Law, piece: Any, X: float, mean: float) -> Vector:
    """(∫ F cos θ dθ, ∫ F dδ, largest |F|) over a piece without a border."""
    falls = piece.rate < 0.0
    a, b = np.arccos(np.clip((np.array([piece.start, piece.end]) - mean) / X, -1.0, 1.0)) * (1.0 if falls else -1.0)
    nodes, weights = GAUSS
    theta = 0.5 * (a + b) + 0.5 * (b - a) * nodes
    delta = np.clip(mean + X * np.cos(theta), *sorted((piece.start, piece.end)))
    force = law.batch(1.0, piece.parameters)(delta, np.full_like(nodes, piece.rate))
    part = 0.5 * (b - a) * weights
    return np.array([part @ (force * np.cos(theta)), part @ (force * -X * np.sin(theta)), np.abs(force).max()])
