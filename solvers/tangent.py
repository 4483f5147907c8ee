"""Derivative of a whole run with respect to its start and to a parameter; `solvers.replay` has the mathematics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.dormand_prince import STAGES
from solvers.forcing import Forcing, hand_over
from solvers.kernels import Problem, rhs
from solvers.preparation import with_tones
from solvers.replay import Nudge, Slopes, begin, replay
from solvers.state import HEAD, TAPED, T, new_state, problem_of
from solvers.system import Array, Parameter, System
from solvers.tables import S

_ROWS = 256  # of the tape between two replays: some 25 contacts, within which no derivative overflows
_LARGE = 1e100  # size at which the derivatives are scaled down
_FIXED = [
    "k",
    "c",
    "loss",
    "push",
    "read",
    "levels",
    "load",
    "power",
    "law",
    "floor",
]  # what no exact parameter changes
_FIXED += ["tone_load", "table", "table_dt", "table_load"]


class Tangent:
    """Derivatives of one run of an engine, carried along as its tape grows."""

    def __init__(self, system: System, engine: Any, parameter: Parameter | None) -> None:
        self.engine, self.blocks = engine, system.blocks
        problem, state = engine.problem, engine.state
        stops, loads, size = len(problem.gap), len(problem.load), 2 * len(problem.k)
        width, n = state.x.size, system.size
        change = _Change.of(system, parameter, engine) if parameter else None
        self.exact = change is not None
        self.change, columns = change or _Change.none(problem, n), 2 * n + self.exact
        shapes: list[Any] = [(columns, width), (columns, stops), (columns, stops), (stops + loads, S), (loads, S)]
        shapes += [(stops, 2, S), (stops, S), (2, width), (STAGES, columns, width), (columns, width), 8]
        self.slopes = Slopes(*(np.zeros(shape) for shape in shapes))
        self.places = np.r_[0:n, size // 2 : size // 2 + n]  # of the structure among the blocks
        self.slopes.y[: 2 * n, self.places] = system.blocks.inverse.T
        self.slopes.y[2 * n :, self.places] = -self.change.steady(0.0)
        self.laws = [problem._replace(parameters=parameters) for parameters in self.change.laws]
        engine.record(np.empty((_ROWS, HEAD + width + stops * S)))
        self.shadow = new_state(state.x[:size], stops)
        self.log_scale = 0.0  # the derivatives are exp(log_scale) times what is kept
        self.history: list[tuple[float, float]] = []  # (time, ln of their size)

    def start(self) -> None:
        """Before the first step."""
        begin(self.engine.problem, self.shadow, self.slopes, self.change.nudge)

    def follow(self) -> None:
        """Replay what the engine has taped, and let it tape anew."""
        engine = self.engine
        replay(
            *(engine.problem, *self.laws, engine.tables, self.shadow, engine.space, self.slopes),
            *(self.change.nudge, engine.state.tape, engine.state.count[TAPED], engine.state.now[T]),
            self.blocks.k.size,
        )
        engine.state.count[TAPED] = 0
        size = float(np.linalg.norm(self.slopes.y, 2))
        self.history.append((float(engine.state.now[T]), self.log_scale + math.log(size) if size > 0.0 else -math.inf))
        if not 1.0 / _LARGE < size < _LARGE and size > 0.0:
            for array in (self.slopes.y, self.slopes.entry, self.slopes.shift):
                array /= size
            self.log_scale += math.log(size)

    def rate(self) -> Array:
        """(2n,) derivative of [q, q̇] by time at the time reached."""
        problem, state = self.engine.problem, self.engine.state
        rate = np.zeros_like(state.x)
        rhs(problem, state.now[T], state.x, state.piece, state.entry_rate, rate, np.zeros(3))
        return self.engine.back @ rate[: 2 * len(problem.k)]

    def matrix(self) -> Array:
        """(2n, columns) derivatives of [q, q̇] at the time reached."""
        if self.log_scale > 600.0:
            raise OverflowError(f"the tangent grew to e^{self.log_scale:.0f}; shorten the run, or use solvers.lyapunov")
        y = math.exp(self.log_scale) * self.slopes.y[:, self.places]
        y[2 * self.blocks.k.size :] += self.change.steady(self.engine.state.now[T])
        return self.blocks.T @ y.T


@dataclass(frozen=True, eq=False)
class _Change:
    """What a parameter changes: the nudge, the laws' parameters ahead and behind, the steady response per tone."""

    nudge: Nudge
    laws: list[Array]
    a: Any  # (K, 2n) complex: the steady response changes by Re (a + t b) e^{iωt}
    b: Any

    def steady(self, t: float) -> Array:
        """Change of the steady response at time t, in block coordinates."""
        waves = (self.a + t * self.b) * np.exp(1j * self.nudge.omega * t)[:, None]
        return waves.sum(axis=0).real

    @classmethod
    def none(cls, problem: Problem, n: int) -> _Change:
        """No parameter."""
        stops = len(problem.gap)
        nudge = Nudge(0.0, np.zeros(0), np.zeros((0, stops, 2, 4)), np.zeros(stops))
        none = np.zeros((0, 2 * n), dtype=complex)
        return cls(nudge, [problem.parameters] * 2, none, none)

    @classmethod
    def of(cls, system: System, parameter: Parameter, engine: Any) -> _Change | None:
        """The change between two systems; None if they differ in more than tones, gaps and laws' parameters."""
        systems = system, parameter.behind, parameter.ahead
        forcings = [_forcing(s, engine.duration) for s in systems]
        problems = here, behind, ahead = [problem_of(s, f) for s, f in zip(systems, forcings, strict=True)]
        same = all(np.array_equal(getattr(here, name), getattr(p, name)) for p in (behind, ahead) for name in _FIXED)
        if not same or len(engine.problem.k) != system.size + len(here.tone_omega):  # fewer: a tone is sampled
            return None
        middle, first, last = (_steady(p, f) for p, f in zip(problems, forcings, strict=True))
        width = 2.0 * parameter.step
        a, b = (last - first) / width, 1j * ((ahead.tone_omega - behind.tone_omega) / width)[:, None] * middle
        rows = np.stack((here.read, here.read_rate), axis=1)  # (m, 2, 2n)
        parts = [part for z in (a, b) for part in (z.real, z.imag)]
        steady = np.stack([np.einsum("sdi,ki->ksd", rows, part) for part in parts], axis=-1)
        nudge = Nudge(parameter.step, here.tone_omega, np.ascontiguousarray(steady), (ahead.gap - behind.gap) / width)
        return cls(nudge, [ahead.parameters, behind.parameters], a, b)


def _forcing(system: System, duration: float) -> Forcing:
    """The tones; sampled signals only need to be there."""
    return hand_over([signal for _, signal in system.loads], duration, 1e-6)


def _steady(problem: Problem, forcing: Forcing) -> Any:
    """(K, 2n) complex amplitudes of the steady response to each tone."""
    n, tones = len(problem.k), len(forcing.tone_omega)
    rows = with_tones(problem, forcing)[1].T
    return rows[n : n + tones] + 1j * forcing.tone_omega[:, None] * rows[2 * n + tones :]
