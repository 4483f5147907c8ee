r"""The simple route through an impact, to read and compare with: exact flight, DOP853 where contact is smooth.

One stop, modes q'' + c q' + k q = l s(t) + φ F, tones s = Re Σ a e^{iΩt}, δ = -φᵀq - gap. With λ = -c/2 + iω_d the
complex numbers x = q̇ - λ̄ q give q = Im x/ω_d and obey x' = λ x + l s + φ F.

Flight is exact: x(t + τ) = P(t + τ) + e^{λτ}(x(t) - P(t)), with the steady response

    P(t) = l/2 Σ [a e^{iΩt}/(iΩ - λ) + ā e^{-iΩt}/(-iΩ - λ)].

M = Σ |φ|/ω_d (|λ|²|x - P| + Ω²|P|) bounds |δ̈| from now on, so that no stop at the distance g = -δ, opening at v = -δ̇,
is reached before τ = (v + √(v² + 2Mg))/M. Such steps are taken until Newton's method on the exact motion is safe.

In contact δ^{3/2} is singular in t where δ = 0, but not in u = √δ. With dt = u dτ

    u' = δ̇/2,   t' = u,   x' = u (λ x + l s + φ F(u², δ̇)),

and the way out takes u itself as its variable, dx/du = (2u/δ̇) x', dt/du = 2u/δ̇, from some u_a to 0: it lands on the
end of the contact without iteration.
"""

from dataclasses import dataclass

import numpy as np
from problems import force_of
from scipy.integrate import DOP853, solve_ivp

SHORTEST = 1e-9  # s: a start at rest on the stop has no safe step


@dataclass
class Beam:
    """Numbers of a problem: modes, load, stop."""

    rate: np.ndarray  # λ
    omega: np.ndarray  # ω_d
    phi: np.ndarray
    gap: float
    load: np.ndarray
    tones: list  # (Ω, a)
    force: object
    floor: float

    def delta(self, x):
        """δ = -φᵀq - gap."""
        return -self.phi @ (x.imag / self.omega) - self.gap

    def delta_dot(self, x):
        """δ̇ = -φᵀq̇, q̇ = Re x + Re λ q."""
        return -self.phi @ (x.real + self.rate.real * x.imag / self.omega)

    def steady(self, t):
        """P(t), and a bound of its second derivative per mode."""
        terms = [(sign * w, a if sign > 0 else np.conj(a)) for w, a in self.tones for sign in (1, -1)]
        parts = [self.load / 2 * a / (1j * w - self.rate) * np.exp(1j * w * t) for w, a in terms]
        return sum(parts), sum(w**2 * abs(part) for (w, _), part in zip(terms, parts, strict=True))

    def slope(self, t, x, force):
        """x' at time t."""
        signal = sum((a * np.exp(1j * w * t)).real for w, a in self.tones)
        return self.rate * x + self.load * signal + self.phi * force


def beam_of(system):
    """A modal system with one stop and one tone load."""
    (contact,), ((load, signal),) = system.contacts, system.loads
    c, k = np.diag(system.C), np.diag(system.K)
    rate = -c / 2 + 1j * np.sqrt(k - c**2 / 4)
    tones = [(w, a) for w, a in zip(*signal.tones(), strict=True)]
    return Beam(
        *(rate, rate.imag, contact.direction, contact.gap, np.asarray(load), tones),
        *(force_of(contact.law), contact.law.entry_rate_floor),
    )


def fly(beam, t, x, end):
    """(t, x) at the next entry, or at the end."""
    while t < end:
        P, curvature = beam.steady(t)
        free, g, v = x - P, -beam.delta(x), -beam.delta_dot(x)
        M = abs(beam.phi) / beam.omega @ (abs(beam.rate) ** 2 * abs(free) + curvature)
        root = np.sqrt(v**2 + 2 * M * max(g, 0.0))
        tau = (v + root) / M if v >= 0 else 2 * max(g, 0.0) / (root - v)
        entering = v < 0 and M * tau < 0.2 * -v
        if entering:
            for _ in range(6):
                at = beam.steady(t + tau)[0] + np.exp(beam.rate * tau) * free
                tau -= beam.delta(at) / beam.delta_dot(at)
        tau = min(max(tau, 0.0 if entering else SHORTEST), end - t)
        x, t = beam.steady(t + tau)[0] + np.exp(beam.rate * tau) * free, t + tau
        if entering and t < end:
            break
    return t, x


def contact(beam, t, x, rtol):
    """(t, x) at the end of a contact that begins at t."""
    n, entry = x.size, max(beam.delta_dot(x), beam.floor)

    def in_tau(_, y):
        x, t, u = y[:n], y[n].real, y[n + 1].real
        rate = beam.delta_dot(x)
        slope = beam.slope(t, x, beam.force(u * u, rate, entry))
        return np.concatenate((u * slope, [u, rate / 2]))

    def in_u(u, y):
        return in_tau(0.0, np.append(y, u))[:-1] * 2 / beam.delta_dot(y[:n])

    def leaving(y):
        return beam.delta_dot(y[:n]) < -0.2 * entry

    y, limit = np.concatenate((x, [t, 0.0])), np.inf
    atol = rtol * np.append(np.full(n, abs(x).max()), [1e-3, 1e-3])
    while not leaving(y):
        solver = DOP853(in_tau, 0.0, y, np.inf, max_step=limit, rtol=rtol, atol=atol)
        while not leaving(solver.y):
            y = solver.y
            solver.step()
        if solver.y[-1].real > 0:
            y = solver.y
        limit = solver.step_size / 2  # where that step went past the end of the contact
    out = solve_ivp(in_u, (y[-1].real, 0.0), y[:-1], "DOP853", rtol=rtol, atol=atol[:-1]).y[:, -1]
    return out[n].real, out[:n]


def regularised(system, q0, q_dot0, duration, rtol=1e-12):
    """(q, q̇, entry times) at the end, which must lie in flight; law of exponent 3/2, restitution above 0.2."""
    beam = beam_of(system)
    t, entries = 0.0, []
    x = np.asarray(q_dot0) - beam.rate.conj() * q0
    while True:
        t, x = fly(beam, t, x, duration)
        if t >= duration:
            q = x.imag / beam.omega
            return q, x.real + beam.rate.real * q, entries
        entries.append(t)
        t, x = contact(beam, t, x, rtol)
        assert t < duration, "the run ends in contact"
