"""Systems with closed answers, the paper's scene, and an independent reference integrator.

Signs as everywhere: contact while delta > 0, the force pushes along +direction, the loads of a base motion y are
-participation * y''. Nothing here uses the kernels of `solvers`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.special import beta

import fembeam as fb
import solvers
from contacts import Hertz, Hysteretic, KelvinVoigt, PiecewiseLinear, Sum, Tabulated, Viscoelastic, law

PAPER_LAW = Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5)
PAPER_OMEGA = 109.1299120547, 790.6100943811, 2303.729838331
TIP = 0.24445
ROD_FILE = """
[beam]
length = 0.5
section = { shape = "circle", E = 2.1e11, rho = 7800, diameter = 0.01 }
[[supports]]
kind = "clamped"
z = 0
"""  # a scene file to add to, of a beam as ROD
STEEL = fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
PAPER_BEAM = fb.Beam(0.2599, STEEL)
ROD = fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01))


@law
def cubic(delta, delta_dot, entry_rate, stiffness):
    return stiffness * delta**3


def as_sparse(system):
    """The same on sparse matrices."""
    matrices = (sparse.csc_array(A) for A in (system.M, system.C, system.K))
    return solvers.System(*matrices, system.contacts, system.loads)


def free_mass(law, mass=1.0, gap=0.0, loads=()):
    """A rigid mass over one stop at q = -gap: delta = -q - gap."""
    return solvers.System([[mass]], [[0.0]], [[0.0]], [solvers.Contact([1.0], law, gap)], loads)


def bounce(law, speed=1.0, mass=1.0, duration=1.0, rtol=1e-13, **options):
    """Solution of a free mass thrown onto its stop from delta = 0."""
    method = solvers.DormandPrince(rtol=rtol, atol=1e-18)
    return solvers.integrate(free_mass(law, mass), [0.0], [-speed], duration, method=method, **options)


@dataclass(frozen=True)
class HertzBounce:
    """Closed answers of m δ'' = -K δ^p from δ = 0 at speed v."""

    stiffness: float
    mass: float
    speed: float
    exponent: float = 1.5

    @property
    def peak_indentation(self):
        """½ m v² = K δ^(p+1)/(p+1)."""
        p = self.exponent
        return ((p + 1.0) * self.mass * self.speed**2 / (2.0 * self.stiffness)) ** (1.0 / (p + 1.0))

    @property
    def peak_force(self):
        """K δ_max^p."""
        return self.stiffness * self.peak_indentation**self.exponent

    @property
    def duration(self):
        """2 δ_max/v ∫₀¹ dx/√(1 - x^(p+1)), by Euler's beta function."""
        r = 1.0 / (self.exponent + 1.0)
        return 2.0 * self.peak_indentation / self.speed * r * beta(r, 0.5)


@dataclass(frozen=True)
class DampedHalfWave:
    """Closed answers of m δ'' + c δ' + k δ = 0 from δ = 0 at speed v: δ = v/ω_d e^{-σt} sin ω_d t."""

    stiffness: float
    damping: float
    mass: float
    speed: float

    @property
    def decay(self):
        """σ = c/2m."""
        return self.damping / (2.0 * self.mass)

    @property
    def omega(self):
        """ω_d."""
        return math.sqrt(self.stiffness / self.mass - self.decay**2)

    @property
    def exit_time(self):
        """Half a damped period, when δ is 0 again; the dashpot pulls before."""
        return math.pi / self.omega

    @property
    def exit_speed(self):
        """v e^{-σ π/ω_d}."""
        return self.speed * math.exp(-self.decay * self.exit_time)

    @property
    def peak_indentation(self):
        """δ where δ' = 0: tan ω_d t = ω_d/σ."""
        t = math.atan2(self.omega, self.decay) / self.omega
        return self.delta(t)

    def delta(self, t):
        """δ(t)."""
        return self.speed / self.omega * np.exp(-self.decay * t) * np.sin(self.omega * t)

    def delta_dot(self, t):
        """δ'(t)."""
        wave = np.cos(self.omega * t) - self.decay / self.omega * np.sin(self.omega * t)
        return self.speed * np.exp(-self.decay * t) * wave

    @property
    def release_time(self):
        """First time the force k δ + c δ' is zero: the end of contact for a stop that never pulls."""
        return math.atan2(self.damping * self.omega, self.damping * self.decay - self.stiffness) / self.omega


def bilinear(omega_1, omega_2):
    """A unit mass on a spring with a linear stop at zero gap: ω₁ without, ω₂ with it."""
    stop = PiecewiseLinear([omega_2**2 - omega_1**2])
    return solvers.System.modal([omega_1], 0.0, [solvers.Contact([1.0], stop)])


def linear_stop():
    """m = 100 kg, k = 1e4 N/m, k_stop = 1e6 N/m at zero gap."""
    return solvers.System([[100.0]], [[0.0]], [[1e4]], [solvers.Contact([1.0], PiecewiseLinear([1e6]))])


def paper_scene(base=None, zeta=(0.02, 0.01), law=None, **parts):
    """The clamped beam with a tip mass over an elastic stop, or other parts; base None is 1 mm at 195 rad/s."""
    own = {
        "masses": [fb.LumpedMass(TIP, mass=25.4e-3, inertia=3.0e-6)],
        "stops": [fb.Stop(TIP, law=PAPER_LAW if law is None else law)],
        "base": fb.Harmonic(amplitude=1e-3, omega=195.0) if base is None else base,
    }
    return fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(zeta), **{**own, **parts})


def two_sided_scene(gap=2e-4, law=None, mid_gap=None):
    """The paper's beam between two stops at its tip; with ``mid_gap`` a third one under its middle."""
    law = PAPER_LAW if law is None else law
    stops = [fb.Stop(TIP, law, gap, "below"), fb.Stop(TIP, law, gap, "above")]
    if mid_gap is not None:
        stops.append(fb.Stop(0.13, Hertz(2.1e8), mid_gap, "below"))
    return paper_scene(stops=stops)


def state_matrix(M, C, K):
    """A of x' = A x, x = [q, q_dot]."""
    zero = np.zeros_like(M)
    return np.block([[zero, np.eye(len(M))], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])


def soft_behind_stiff():
    """M and K of a chain whose soft end stands behind stiff springs, and its ω², of the same K in 60 digits."""
    springs, order = [1e12, 1e9, 1e6, 1e2, 1e-2], np.ix_([4, 3, 0, 2, 1], [4, 3, 0, 2, 1])
    K = np.diag(np.add(springs, [*springs[1:], 0.0])) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    exact = [3.3329999888596007e-3, 99.99999032334257, 999098.0088152341, 500001251.8761322, 1001000499750.1251]
    return np.diag([3.0, 1.0, 1.0, 1.0, 2.0]), K[order], exact


def coupled_dashpot(contacts=(), loads=()):
    """Three masses in a chain whose one dashpot couples the modes."""
    K = 1e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    C = np.diag([0.0, 0.0, 8.0]) + 1e-4 * K
    return solvers.System(np.diag([1.0, 2.0, 0.5]), C, K, contacts, loads)


# --- the independent reference -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reference:
    """What `reference` finds: state at the times asked for, and per contact (stop, t_in, t_out, entry rate)."""

    t: np.ndarray
    q: np.ndarray
    q_dot: np.ndarray
    contacts: list


def force_of(law) -> Callable:
    """Plain Python force of a law, written from its formula."""
    if isinstance(law, Hertz):
        return lambda d, v, r: law.stiffness * d**law.exponent
    if isinstance(law, Hysteretic):
        a = law.damping_factor

        def hysteretic(d, v, r):
            force = law.stiffness * d**law.exponent * (1.0 + a * v / r)
            return max(force, 0.0) if law.clamp else force

        return hysteretic
    if isinstance(law, KelvinVoigt):

        def kelvin_voigt(d, v, r):
            force = law.stiffness * d + law.damping * v
            return max(force, 0.0) if law.clamp else force

        return kelvin_voigt
    if isinstance(law, Viscoelastic):

        def viscoelastic(d, v, r):
            viscosity = 0.0 if law.approach_only and v <= 0.0 else law.damping * d ** (0.5 * (law.exponent - 1.0))
            force = law.stiffness * d**law.exponent + viscosity * v
            return max(force, 0.0) if law.clamp else force

        return viscoelastic
    if isinstance(law, Sum):
        parts = [(force_of(part), part.entry_rate_floor) for part in law.parts]
        return lambda d, v, r: sum(force(d, v, max(r, floor)) for force, floor in parts)
    if isinstance(law, Tabulated):
        curve = PchipInterpolator(law.indentation, law.measured)
        top, steep = law.indentation[-1], float(curve.derivative()(law.indentation[-1]))
        return lambda d, v, r: float(curve(min(d, top))) + steep * max(d - top, 0.0)
    if isinstance(law, PiecewiseLinear) and any(law.damping):
        elastic = force_of(PiecewiseLinear(law.slopes, law.knots))
        return lambda d, v, r: elastic(d, v, r) + law.damping[np.searchsorted(law.knots, d)] * v
    if isinstance(law, PiecewiseLinear):
        knots = [0.0, *law.knots, math.inf]
        pieces = list(zip(law.slopes, knots[:-1], knots[1:], strict=True))
        return lambda d, v, r: sum(k * (min(d, top) - low) for k, low, top in pieces if d > low)
    return lambda d, v, r: float(law.force(d, v, r))


def reference(system, q0, q_dot0, duration, t_eval=(), rtol=1e-12, max_step=2e-4):
    """Integrate q, q_dot with SciPy's DOP853 between located entries, exits and knots.

    ``max_step`` bounds a step, so that no contact hides in one.
    """
    n, stops = system.size, system.contacts
    inverse = np.linalg.inv(system.M)
    forces = [force_of(contact.law) for contact in stops]
    levels = [np.array([0.0, *contact.law.knots]) for contact in stops]
    rows = np.array([contact.direction for contact in stops]).reshape(len(stops), n)
    gaps = np.array([contact.gap for contact in stops])
    x, t = np.concatenate((np.asarray(q0, float), np.asarray(q_dot0, float))), 0.0
    delta = -rows @ x[:n] - gaps
    rates = -rows @ x[n:]
    inside = (delta > 0.0) | ((delta == 0.0) & (rates > 0.0))
    entry = [max(abs(v), c.law.entry_rate_floor) for v, c in zip(rates, stops, strict=True)]
    opened = np.where(inside, 0.0, np.nan)
    done, wanted = [], np.asarray(t_eval, dtype=float)
    states = np.empty((wanted.size, 2 * n))

    def rhs(t, x):
        load = -system.C @ x[n:] - system.K @ x[:n]
        for vector, signal in system.loads:
            load = load + vector * signal(t)
        for s in np.flatnonzero(inside):
            d, v = -rows[s] @ x[:n] - gaps[s], -rows[s] @ x[n:]
            load = load + rows[s] * forces[s](max(d, 0.0), v, entry[s])
        return np.concatenate((x[n:], inverse @ load))

    def surface(s, level, direction):
        def event(t, x):
            return -rows[s] @ x[:n] - gaps[s] - level

        event.terminal, event.direction = True, direction
        return event

    while t < duration:
        watch = []
        for s in range(len(stops)):
            if not inside[s]:
                watch.append((s, "enter", surface(s, 0.0, 1.0)))
                continue
            watch.append((s, "leave", surface(s, 0.0, -1.0)))
            watch += [(s, "knot", surface(s, level, 0.0)) for level in levels[s][1:]]
        start = t
        part = solve_ivp(
            *(rhs, (t, duration), x, "DOP853"),
            **{"events": [w[2] for w in watch], "rtol": rtol, "atol": rtol * 1e-6, "max_step": max_step},
            dense_output=wanted.size > 0,
        )
        t, x = float(part.t[-1]), part.y[:, -1].copy()
        mine = (wanted >= start) & (wanted <= t)
        if mine.any():
            states[mine] = part.sol(wanted[mine]).T
        for (s, kind, _), times in zip(watch, part.t_events, strict=True):
            if not len(times) or kind == "knot":
                continue
            if kind == "enter":
                inside[s], opened[s] = True, t
                entry[s] = max(abs(rows[s] @ x[n:]), stops[s].law.entry_rate_floor)
            else:
                inside[s] = False
                done.append((s, opened[s], t, entry[s]))
    done += [(s, opened[s], math.nan, entry[s]) for s in np.flatnonzero(inside)]
    if not wanted.size:
        wanted, states = np.array([t]), x[None]
    return Reference(wanted, states[:, :n], states[:, n:], done)
