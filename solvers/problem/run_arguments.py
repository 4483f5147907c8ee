"""Arguments of a run: start, duration, output times, parameter of a tangent."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers.problem import Array, Contact, Parameter, System
from solvers.problem.matrices import number, reals

_MOST_SAMPLES = 500_000_000
_FEW_SAMPLES = 10_000  # up to which an even sampling is kept
_SHORTEST = 1e-50  # s, of a run: derivatives of sampled loads are fifth powers of parts of it
_LONGEST = 1e50  # s: its square, and times a frequency, must be numbers


def check_tangent(tangent: Any, method: Any, system: System) -> None:
    """A tangent is asked for in one of its forms, of a method that has one, for laws that have one."""
    if tangent is False:
        return
    if not isinstance(tangent, bool | Parameter):
        raise TypeError(f"tangent must be True, False or a solvers.Parameter, got {tangent!r}")
    if tangent and not getattr(method, "has_tangent", False):
        raise ValueError(f"tangent is not offered by {type(method).__name__}; use Exponential")
    if tangent:
        check_slopes(system)


def check_maps(system: System, method: Any) -> None:
    """A method that does not follow circular clearances, or friction under their force, is not asked to."""
    annuli, friction = getattr(method, "takes_annuli", False), getattr(method, "takes_friction", False)
    for i, contact in enumerate(system.contacts):
        name = type(method).__name__
        if contact.friction is not None and not friction:
            raise ValueError(
                f"{name} takes contacts without friction, and contact {i} has some; use Exponential or DormandPrince"
            )
        if contact.map == "annulus" and not annuli:
            raise ValueError(
                f"{name} takes scalar stops, and contact {i} is an annulus; use Exponential or DormandPrince"
            )


def check_places(system: System, q0: ArrayLike) -> None:
    """No place begins at the centre of its post, where nothing says which way it is pushed; q0 is (..., n)."""
    for i, contact in enumerate(system.contacts):
        if contact.outer and np.any(contact.indentation(q0) >= contact.gap):
            raise ValueError(
                f"the place of contact {i} begins at the centre of its post, {contact.gap:g} m deep, where no way "
                "leads out of it: begin outside of the post"
            )


def check_slopes(system: System) -> None:
    """No law has an infinite slope at its surface, F ~ δ^r with r < 1 but for a declared jump or where it has none."""
    system.about_laws.get("finite slopes", lambda: _finite_slopes(system))


def _finite_slopes(system: System) -> bool:
    """True, or ValueError."""
    delta = np.array([1e-12, 1e-10])
    for i, contact in enumerate(system.contacts):
        for law in _laws_of_stops(contact):
            viscous = law.force(delta, 1.0, 1.0) - law.force(delta, 0.0, 1.0)
            if not law.jump and 0.0 < abs(viscous[1]) < 95.0 * abs(viscous[0]):
                trouble = f"its slope is infinite at the surface: {contact.law!r}"
                raise ValueError(
                    f"tangent is not offered for the law of contact {i}: {trouble}; take KelvinVoigt or Hysteretic"
                )
    return True


def _laws_of_stops(contact: Contact) -> list[Any]:
    """The laws of a contact that act from the surface on: those a sum keeps behind gates beside laws with memory."""
    gated = [part.law for part in getattr(contact.law, "acting", ()) if hasattr(part, "law")]
    return gated or ([] if contact.always else [contact.law])


def checked_start(system: System, q0: ArrayLike, q_dot0: ArrayLike, method: Any) -> Array:
    """Checked start in the coordinates a method steps in: decoupled blocks, or the system's own."""
    n = system.size
    try:
        start = np.array((q0, q_dot0))
        fits = start.shape == (2, n) and start.dtype == float
    except (TypeError, ValueError):  # also of different lengths
        fits = False
    start = start.ravel() if fits else _joined(n, q0, q_dot0)
    if not math.isfinite(start.dot(start)):  # or large: squares overflow
        finite = np.isfinite(start)
        if not finite.all():
            which, bad = divmod(int(np.argmin(finite)), n)
            name = ("q0", "q_dot0")[which]
            raise ValueError(f"{name} must be finite, got {start[which * n + bad]} at coordinate {bad}")
    if hasattr(method, "takes_matrices") and method.takes_matrices(system):
        return start
    return system.blocks.inverse.dot(start)


def _joined(n: int, q0: ArrayLike, q_dot0: ArrayLike) -> Array:
    """A start (2n,) of one coordinate given as plain numbers, or ValueError that says which vector does not fit."""
    start = np.empty(2 * n)
    for name, given, place in (("q0", q0, start[:n]), ("q_dot0", q_dot0, start[n:])):
        vector = reals(given, name)
        if vector.shape != (n,) and (vector.ndim or n != 1):
            raise ValueError(f"{name} must have shape ({n},), got {vector.shape}")
        place[:] = vector
    return start


def output_times(duration: float, dt: Any) -> Array | None:
    """Output times of a sampling, or those given; None for none. Few of an even sampling are shared, read-only."""
    if type(duration) is float and (dt is None or (type(dt) is float and dt * _FEW_SAMPLES > duration)):
        return _few_times(duration, dt)
    return _output_times(duration, dt)


@lru_cache(maxsize=16)
def _few_times(duration: float, dt: float | None) -> Array | None:
    """The same, kept."""
    times = _output_times(duration, dt)
    if times is not None:
        times.setflags(write=False)
    return times


def _output_times(duration: Any, dt: Any) -> Array | None:
    """The same, made anew."""
    duration = number(duration, "duration")
    if not 0.0 < duration < math.inf:
        raise ValueError(f"duration must be positive and finite (s), got {duration!r}")
    if duration < _SHORTEST:
        raise ValueError(
            f"duration must be at least {_SHORTEST:g} s, got {duration!r}: fifth powers of shorter times are no "
            "numbers; give it in other units of time"
        )
    if duration > _LONGEST:
        raise ValueError(f"duration must be at most {_LONGEST:g} s, got {duration!r}; give it in other units of time")
    if dt is None:
        return None
    if np.ndim(dt) > 0:
        return _given_times(duration, dt)
    dt = number(dt, "dt")
    if not 0.0 < dt < math.inf:
        raise ValueError(f"dt must be positive and finite (s), got {dt!r}")
    if dt > duration * (1.0 + 1e-12):
        raise ValueError(
            f"dt = {dt:g} s is longer than the duration of {duration:g} s, so that only the start would be sampled; "
            "choose a smaller dt, give output times, or leave dt out for the end alone"
        )
    most = duration / dt * (1.0 + 1e-12)
    if most + 1.0 > _MOST_SAMPLES:
        raise ValueError(
            f"dt = {dt:g} s over {duration:g} s asks for {most:.4g} samples, more than {_MOST_SAMPLES:g}; choose a "
            "larger dt or a shorter duration"
        )
    count = math.floor(most) + 1
    return np.arange(count) * dt


def output_arrays(times: Array, duration: float, width: int) -> dict[str, Array]:
    """Arrays of a state for the outputs of a run at times: due times, of which the last is never reached, and rows."""
    due = np.full(len(times) + 1, math.inf)
    np.minimum(times, duration, out=due[:-1])
    return {"out": np.empty((len(times), width)), "due": due}


def _given_times(duration: float, given: ArrayLike) -> Array:
    """Checked output times."""
    times = reals(given, "dt as output times")
    if times.ndim != 1 or not np.isfinite(times).all() or np.any(np.diff(times) <= 0.0):
        raise ValueError(f"dt as output times must be one increasing row of finite numbers (s), got {given!r}")
    if times.size and not (times[0] >= 0.0 and times[-1] <= duration * (1.0 + 1e-12)):
        raise ValueError(f"output times must lie in [0, {duration:g}] s, got {times[0]:g} to {times[-1]:g} s")
    return times


def check_laws(system: System) -> None:
    """Every law is finite at rest, so that a NaN is found before the run; checked once per system."""
    system.about_laws.get("finite", lambda: _finite(system))


def _finite(system: System) -> bool:
    """True, or ValueError."""
    delta = np.array([1e-12, 1e-6, 1e-3])
    for i, contact in enumerate(system.contacts):
        places = np.concatenate((-delta, delta)) if contact.always else delta
        law: Any = contact.law
        force = law.batch(1.0)(places, 0.0 * places)
        if not np.all(np.isfinite(force)):
            where = places[~np.isfinite(force)][0]
            hint = "; one defined for delta > 0 only is no law of a contact that always acts" if where < 0.0 else ""
            raise ValueError(f"the law of contact {i} is not finite at delta = {where:g} m: {contact.law!r}{hint}")
    return True


def latched_at_start(system: System, memory: Sequence[ArrayLike | None] | None) -> list[tuple[int, Array]]:
    """(contact, latched numbers) of those given, checked."""
    if memory is None:
        return []
    if len(memory) != len(system.contacts):
        raise ValueError(f"memory must have one entry per contact, {len(system.contacts)}, got {len(memory)}")
    given = [(s, np.array(numbers, dtype=float)) for s, numbers in enumerate(memory) if numbers is not None]
    for s, numbers in given:
        count = len(system.contacts[s].memory)
        if numbers.shape != (count,) or not np.isfinite(numbers).all():
            raise ValueError(f"memory of contact {s} must be {count} finite numbers, got {memory[s]!r}")
        _check_codes(s, system.contacts[s].law, numbers)
    return given


def _check_codes(s: int, law: Any, numbers: Array) -> None:
    """ValueError for the code of a segment that the law of contact s does not have."""
    for place, codes in enumerate(getattr(law, "segment_codes", ())):
        if codes and numbers[place] not in codes:
            known = ", ".join(f"{code:g}" for code in codes)
            raise ValueError(
                f"memory of contact {s} must have at place {place} the code of a segment of {type(law).__name__}, one "
                f"of {known}, got {numbers[place]:g}"
            )
