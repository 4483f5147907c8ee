"""Oscillators with answers of their own, independent of `solvers`: pieces in closed form, harmonic balance.

Signs as everywhere: δ = -q - gap, the stop pushes q upward. All drives are f cos Ωt.
"""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.optimize import brentq, root

from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear
from solvers import Contact, Exponential, System, integrate


@dataclass(frozen=True)
class Tone:
    """Re a e^{iΩt}, as a tone; a real: a cos Ωt."""

    amplitude: complex
    omega: float

    def __call__(self, t):
        return (self.amplitude * np.exp(1j * self.omega * np.asarray(t))).real

    def tones(self):
        return np.array([self.omega]), np.array([self.amplitude + 0j])


@dataclass(frozen=True)
class Later:
    """A signal ``by`` seconds later."""

    signal: object
    by: float

    def __call__(self, t):
        return self.signal(np.asarray(t) + self.by)

    def tones(self):
        omega, amplitude = self.signal.tones()
        return omega, amplitude * np.exp(1j * omega * self.by)


def over(problem, name="omega", periods=1):
    """A family over one of the oscillator's numbers."""

    def make(value):
        changed = replace(problem, **{name: value})
        return changed.system(), periods * changed.period

    return make


def from_phase(found):
    """The system of an orbit, at time 0 of which the orbit has its state: ``phase`` s later."""
    return found.system.like(loads=[(vector, Later(signal, found.phase)) for vector, signal in found.system.loads])


def state_after(system, x, duration, method):
    """[q, q', latched numbers of all contacts] after a time."""
    n, counts = system.size, [len(getattr(contact.law, "memory", ())) for contact in system.contacts]
    memory = np.split(x[2 * n :], np.cumsum(counts)[:-1]) if sum(counts) else None
    return integrate(system, x[:n], x[n : 2 * n], duration, method=method, memory=memory).end


def state_at_zero(found):
    """The same of an orbit at t = 0, by a run that knows the phase only."""
    later = found.period - found.phase if found.phase else 0.0
    return state_after(from_phase(found), found.whole, later, Exponential(1e-12)) if later else found.whole


def status_names(found):
    """How the directions of a branch ended."""
    return [status.name for status in found.status]


@cache
def _bilinear(stiffness, zeta):
    """A system whose tables serve all that differ in gap and drive."""
    return System.modal([1.0], zeta, [Contact([1.0], PiecewiseLinear([stiffness]))], [([1.0], Tone(1.0, 1.0))])


@dataclass(frozen=True)
class Bilinear:
    r"""q'' + 2ζ q' + q = f cos Ωt + k max(-q - gap, 0), every piece solved in closed form.

    The force is continuous, so that the derivative of a run is the product of the pieces' matrix exponentials.
    """

    omega: float
    stiffness: float = 4.0
    zeta: float = 0.02
    gap: float = 0.0
    amplitude: float = 1.0

    @property
    def period(self):
        return 2.0 * math.pi / self.omega

    def system(self, phase=0.0):
        """The same for `solvers`; ``phase`` s later."""
        tone = Tone(self.amplitude * np.exp(1j * self.omega * phase), self.omega)
        base = _bilinear(self.stiffness, self.zeta)
        return base.like([replace(base.contacts[0], gap=self.gap)], [([1.0], tone)])

    def propagator(self, closed, t):
        """exp(A t), shape (..., 2, 2)."""
        sigma, k = self.zeta, 1.0 + closed * self.stiffness
        omega = math.sqrt(k - sigma**2)
        c, s = np.cos(omega * t), np.sin(omega * t) / omega
        rows = [[c + sigma * s, s], [-k * s, c - sigma * s]]
        return np.moveaxis(np.exp(-sigma * t) * np.array(rows), (0, 1), (-2, -1))

    def steady(self, closed, t):
        """Particular solution [q, q'], shape (..., 2)."""
        k, w = 1.0 + closed * self.stiffness, self.omega
        z = self.amplitude / (k - w**2 + 2j * self.zeta * w) * np.exp(1j * w * np.asarray(t))
        return np.stack((z.real - closed * self.stiffness * self.gap / k, (1j * w * z).real), axis=-1)

    def march(self, x, duration, grid=200):
        """(state, derivative of it, entries and exits) after a run from t = 0."""
        t, x, product, switches = 0.0, np.asarray(x, float), np.eye(2), []
        closed = bool(-x[0] - self.gap > 0.0)
        while t < duration:
            start, free = t, x - self.steady(closed, t)

            def at(t, closed=closed, start=start, free=free):
                turned = np.einsum("...ij,j->...i", self.propagator(closed, np.asarray(t) - start), free)
                return turned + self.steady(closed, t)

            def height(t, at=at, sign=1.0 if closed else -1.0):
                return sign * (at(t)[..., 0] + self.gap)  # negative within the piece

            times = np.append(np.arange(start + 1e-7, duration, self.period / grid), duration)
            out = np.flatnonzero(height(times) > 0.0)
            end = brentq(height, times[out[0] - 1], times[out[0]], xtol=1e-15, rtol=1e-15) if out.size else duration
            if out.size:
                switches.append(end)
            product = self.propagator(closed, end - start) @ product
            t, x, closed = end, at(end), closed != bool(out.size)
        return x, product, np.array(switches)

    def orbit(self, x, periods=1):
        """(state at t = 0, monodromy, entries and exits) of the periodic motion near x, by Newton's method."""
        duration = periods * self.period
        for _ in range(30):
            end, product, switches = self.march(x, duration)
            step = np.linalg.solve(np.eye(2) - product, end - x)
            x = x + step
            if np.linalg.norm(step) < 1e-13 * np.linalg.norm(x):
                return x, self.march(x, duration)[1], switches
        raise ArithmeticError(f"no orbit: the last step was {step}")

    @cache  # noqa: B019 (a few values)
    def settled(self, periods=200):
        """State after a run from rest."""
        return self.march(np.zeros(2), periods * self.period)[0]

    def special(self, mu, x, periods=1):
        """(Ω, state) nearby where the multiplier is ``mu`` = ±1: det(Φ - μ) = 1 - μ tr Φ + det Φ is zero."""

        def distance(unknowns):
            problem = replace(self, omega=unknowns[2])
            end, product, _ = problem.march(unknowns[:2], periods * problem.period)
            return np.append(end - unknowns[:2], 1.0 - mu * np.trace(product) + np.linalg.det(product))

        found = root(distance, np.append(x, self.omega), tol=1e-14)
        if not np.abs(found.fun).max() < 1e-12:
            raise ArithmeticError(f"no special point: {found.message}")
        return found.x[2], found.x[:2]

    def linear_amplitude(self):
        """Of the motion that does not touch the stop."""
        return self.amplitude / abs(1.0 - self.omega**2 + 2j * self.zeta * self.omega)


@dataclass(frozen=True)
class Duffing:
    r"""q'' + 2ζ q' + q + β q³ = f cos Ωt by harmonic balance: coefficients u of 1, cos jΩt, sin jΩt.

    The cube is taken at enough samples that nothing is aliased.
    """

    beta: float = 1.0
    zeta: float = 0.05
    amplitude: float = 0.2
    harmonics: int = 15

    def __post_init__(self):
        j, count = np.arange(1, self.harmonics + 1), 4 * self.harmonics + 4
        angle = 2.0 * math.pi * np.outer(np.arange(count), j) / count
        waves = np.hstack((np.ones((count, 1)), np.cos(angle), np.sin(angle)))
        object.__setattr__(self, "waves", waves)
        object.__setattr__(self, "project", np.linalg.pinv(waves))

    def linear(self, omega):
        """Matrix of the linear part."""
        j = np.arange(1, self.harmonics + 1)
        inertia = np.diag(np.concatenate(([1.0], 1.0 - (j * omega) ** 2, 1.0 - (j * omega) ** 2)))
        n = self.harmonics
        inertia[1 : n + 1, n + 1 :] = np.diag(2.0 * self.zeta * omega * j)
        inertia[n + 1 :, 1 : n + 1] = -inertia[1 : n + 1, n + 1 :]
        return inertia

    def at_lag(self, lag, u, omega):
        """(u, Ω, dΩ/d lag) of the motion whose first harmonic lags the drive by an angle."""
        n = self.harmonics
        border = np.zeros(2 * n + 2)
        border[1], border[n + 1] = math.sin(lag), -math.cos(lag)
        for _ in range(30):
            q = self.waves @ u
            residual = self.linear(omega) @ u + self.project @ (self.beta * q**3)
            residual[1] -= self.amplitude
            by_u = self.linear(omega) + self.project @ (3.0 * self.beta * q[:, None] ** 2 * self.waves)
            by_omega = (self.linear(omega + 0.5) - self.linear(omega - 0.5)) @ u  # exact: quadratic in Ω
            matrix = np.vstack((np.column_stack((by_u, by_omega)), border))
            step = np.linalg.solve(matrix, np.append(-residual, -border[:-1] @ u))
            u, omega = u + step[:-1], omega + step[-1]
            if np.abs(step).max() < 1e-12:
                turned = u[1] * math.cos(lag) + u[n + 1] * math.sin(lag)
                return u, omega, np.linalg.solve(matrix, -turned * np.eye(2 * n + 2)[-1])[-1]
        raise ArithmeticError(f"no balance at a lag of {lag}: the last step was {np.abs(step).max()}")

    def walk(self, lags):
        """[(u, Ω, dΩ/d lag)] along descending lags, from above the resonance."""
        u, omega, found = np.zeros(2 * self.harmonics + 1), 1.0, []
        for _ in range(50):  # of one harmonic at the first lag
            size = self.amplitude * math.sin(lags[0]) / (2.0 * self.zeta * omega)
            omega = math.sqrt(1.0 + 0.75 * self.beta * size**2 - self.amplitude * math.cos(lags[0]) / size)
        u[1], u[self.harmonics + 1] = size * math.cos(lags[0]), size * math.sin(lags[0])
        for lag in lags:
            found.append(self.at_lag(lag, u, omega))
            u, omega, _ = found[-1]
        return found

    def folds(self, lags):
        """[Ω] of the folds between the lags."""
        points, folds = self.walk(lags), []
        for (u, omega, slope), following, high, low in zip(points, points[1:], lags, lags[1:], strict=False):
            if slope * following[2] < 0.0:
                lag = brentq(lambda x, u=u, omega=omega: self.at_lag(x, u, omega)[2], low, high, xtol=1e-13)
                folds.append(self.at_lag(lag, u, omega)[1])
        return folds

    def at_frequency(self, omega, u):
        """Coefficients of the motion near u."""
        for _ in range(30):
            q = self.waves @ u
            residual = self.linear(omega) @ u + self.project @ (self.beta * q**3)
            residual[1] -= self.amplitude
            step = np.linalg.solve(
                self.linear(omega) + self.project @ (3.0 * self.beta * q[:, None] ** 2 * self.waves), residual
            )
            u = u - step
            if np.abs(step).max() < 1e-12:
                return u
        raise ArithmeticError(f"no balance at {omega} rad/s: the last step was {np.abs(step).max()}")

    def state(self, u, omega, t=0.0):
        """[q, q'] at time t."""
        j, n = np.arange(1, self.harmonics + 1), self.harmonics
        c, s = np.cos(j * omega * t), np.sin(j * omega * t)
        a, b = u[1 : n + 1], u[n + 1 :]
        return np.array([u[0] + a @ c + b @ s, omega * (j * b) @ c - omega * (j * a) @ s])


def random_law(rng):
    """One of three laws."""
    laws = [PiecewiseLinear([10.0 ** rng.uniform(0, 3)]), Hertz(10.0 ** rng.uniform(1, 5)),
            Hysteretic.lankarani_nikravesh(10.0 ** rng.uniform(1, 5), restitution=rng.uniform(0.2, 1.0))]  # fmt: skip
    return laws[rng.integers(3)]


def random_family(rng, over="omega"):
    """(family over the drive's omega or amplitude or the gap, its span, modes) of one or two masses with a stop."""
    modes, frequencies = int(rng.integers(1, 3)), np.array([1.0, 2.0 + 3.0 * rng.random()])
    direction = rng.normal(size=modes)
    law, gap = random_law(rng), rng.uniform(-0.5, 1.0)
    return _driven(rng, over, frequencies[:modes], [direction], [law], [gap])


def random_stops_family(rng, over="omega", stops=2):
    """The same of two or three masses with several stops: on any coordinates, on one each (hardly) coupled, in pairs.

    On one coordinate each the masses do not see each other, or couple by 1e-6 to 1e-2; a pair is symmetric.
    """
    kind, modes = rng.choice(["any", "apart", "weak", "pair"]), max(stops, 2)
    frequencies = np.concatenate(([1.0], rng.uniform(1.2, 5.0, modes - 1)))
    directions, gaps = list(rng.normal(size=(stops, modes))), list(rng.uniform(-0.3, 1.0, stops))
    if kind in ("apart", "weak"):
        coupling = 10.0 ** rng.uniform(-6, -2) if kind == "weak" else 0.0
        directions = list(np.eye(stops, modes) + coupling * rng.normal(size=(stops, modes)))
    dashpot = KelvinVoigt(10.0 ** rng.uniform(0, 3), 10.0 ** rng.uniform(-2, 0))
    laws = [dashpot if rng.random() < 0.25 else random_law(rng) for _ in range(stops)]
    if kind == "pair":
        directions[1], laws[1], gaps[:2] = -directions[0], laws[0], [abs(gaps[0])] * 2
    return _driven(rng, over, frequencies, directions, laws, gaps)


def _driven(rng, over, frequencies, directions, laws, gaps):
    """(family, span, modes) of masses that one drive pushes against stops; over the gap all gaps move."""
    zeta, amplitude, periods = 10.0 ** rng.uniform(-2.5, -0.5), rng.uniform(0.1, 2.0), int(rng.integers(1, 3))
    low, modes = rng.uniform(0.3, 2.0), len(frequencies)
    spans = {
        "omega": (low, low * rng.uniform(1.1, 3.0)),
        "amplitude": (amplitude, 3.0 * amplitude),
        "gap": (gaps[0], gaps[0] + 0.5),
    }

    still = System.modal(frequencies, zeta)

    def make(value):
        now = {"omega": low, "amplitude": amplitude, "gap": gaps[0], over: value}
        moved = [gap + (now["gap"] - gaps[0]) for gap in gaps]
        contacts = [Contact(w, law, gap=gap) for w, law, gap in zip(directions, laws, moved, strict=True)]
        loads = [(np.ones(modes), Tone(now["amplitude"], now["omega"]))]
        base = ready.setdefault("base", still.like(contacts, loads))  # its tables serve all
        return base.like(contacts, loads), periods * 2.0 * math.pi / now["omega"]

    ready: dict[str, System] = {}

    return make, spans[over], modes
