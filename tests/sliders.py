"""Mass, spring and one slider, every piece in closed form; independent of `solvers` and `contacts`."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Slider:
    """q'' + K q + F = 0, unit mass: F = k (q - s) up to |F| = f, then ±f until q' = 0, where s = q ∓ f/k."""

    spring: float
    stiffness: float
    limit: float

    def piece(self, side, s):
        """(ω, rest position) of a piece: side 0 sticks at s, ±1 slips."""
        if side == 0:
            stiffness = self.spring + self.stiffness
            return math.sqrt(stiffness), self.stiffness * s / stiffness
        return math.sqrt(self.spring), -side * self.limit / self.spring

    def end(self, q, v, side, s):
        """Time until the piece ends; inf if it never does."""
        omega, rest = self.piece(side, s)
        size, phase = (
            math.hypot(q - rest, v / omega),
            math.atan2(-v / omega, q - rest),
        )  # q = rest + size cos(ωt + phase)
        if side:
            ahead = (-phase if side > 0 else math.pi - phase) % (2.0 * math.pi)
            return ahead / omega
        found = math.inf
        for way in (1.0, -1.0):
            cosine = (s + way * self.limit / self.stiffness - rest) / size
            if abs(cosine) < 1.0 - 1e-12:  # reached going outward; 1 where stick has just begun
                ahead = (-way * math.acos(cosine) - phase) % (2.0 * math.pi)
                found = min(found, ahead / omega)
        return found

    def run(self, q, v, duration, s=0.0):
        """(q, q', events (t, side after)) after ``duration`` from stick at s."""
        t, side, events = 0.0, 0, []
        while True:
            omega, rest = self.piece(side, s)
            last = min(self.end(q, v, side, s), duration - t)
            c, d = math.cos(omega * last), math.sin(omega * last)
            q, v = rest + (q - rest) * c + v / omega * d, v * c - (q - rest) * omega * d
            t += last
            if t >= duration:
                return q, v, events
            if side:
                s, v = q - side * self.limit / self.stiffness, 0.0
            side = 0 if side else int(math.copysign(1, q - s))
            events.append((t, side))
