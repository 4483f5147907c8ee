"""What a scene is before it is run: modes, contacts to expect, steps and modes to take, and what looks wrong.

A contact of length T excites what lies below 3π/T, where the spectrum of a half-sine pulse first vanishes: modes above
it are hardly excited.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import solvers
from fembeam.inspection import sampling, units
from fembeam.inspection.trial import Touched, expected, fastest, of_contacts, stops
from fembeam.model.mode_table import mode_part, mode_rows
from fembeam.scene import unit_of
from fembeam.study.decay import correlation_time
from fembeam.support import Part, Printed
from solvers.problem import counted

if TYPE_CHECKING:
    from fembeam.model import Model
    from fembeam.scene import Scene

MOST_MODES = 40  # considered when counting those a contact excites


@dataclass(frozen=True)
class Check(Printed):
    """What was found: print it, or go through its sentences on what looks wrong.

    Attributes
    ----------
    model : the reduced model that was looked at. touched : what to expect of the stops.
    steps, modes : suggested output steps and largest stable steps in s, numbers of modes, by what they are for.
    correlation_time : 1/min(ζω) in s, infinite without damping.
    warnings : the sentences; none where nothing looks wrong.

    Examples
    --------
    >>> import fembeam as fb
    >>> steel = fb.Section.circle(E=2.1e5, rho=7800.0, diameter=0.01)
    >>> found = fb.Scene(fb.Beam(0.5, steel), [fb.Clamped(0.0)], damping=fb.ModalDamping(2.0)).check()
    >>> for sentence in found:
    ...     print(sentence)
    E = 210000 N/m² looks like N/mm²: steel has 2.1e11 N/m²
    zeta = 2 looks like per cent: 1 is critical damping
    """

    model: Model
    touched: list[Touched]
    steps: dict[str, float]
    modes: dict[str, int]
    correlation_time: float
    warnings: list[str]

    def __iter__(self) -> Iterator[str]:
        return iter(self.warnings)

    def __len__(self) -> int:
        return len(self.warnings)

    def __bool__(self) -> bool:
        return True  # also where nothing looks wrong

    def __repr__(self) -> str:
        return f"<check of {self.model!r}: {solvers.problem.counted(len(self), 'warning')}>"

    def _parts(self) -> list[Part]:
        found: list[Part] = [*self.structure, mode_part(self.model), ""]
        found.append(f"mesh: {self.model.matrices.accuracy}")
        found.append(f"correlation time of the structure 1/min(ζω): {self.correlation_time:.3g} s")
        found += [self._contacts_with(one) for one in self.touched]
        if self.stiffened:
            lowest = ", ".join(f"{omega:.6g}" for omega in self.stiffened[:3])
            found.append(f"elements: with their stiffness at u = 0 the lowest frequencies are {lowest} rad/s")
        found += [f"suggested {what}: {count}" for what, count in self.modes.items()]
        found += [f"suggested {what}: {step:.2g} s" for what, step in self.steps.items()]
        return [*found, *(f"warning: {sentence}" for sentence in self)]

    def _contacts_with(self, one: Touched) -> str:
        """What to expect of a stop, in a sentence."""
        seen = f"{counted(one.contacts, 'contact') if one.contacts else 'no contact'} in a trial"
        row = self.model.contact_rows[one.stop]
        speed, force = (unit_of(of, [row.rotation]) for of in ("speed", "force"))
        lasts = f"lasts {one.time:.3g} s ({one.periods:.2g} periods of the highest mode kept)"
        lasts = lasts if math.isfinite(one.time) else "outlasts the trial"
        return (
            f"{row.name}: {seen}; at {one.speed:.3g} {speed} a contact {lasts}, peak force {one.peak_force:.3g} {force}"
        )

    @property
    def structure(self) -> list[str]:
        """What the matrices of a structure say."""
        return self.model.scene.beam.check() if hasattr(self.model.scene.beam, "check") else []

    @property
    def stiffened(self) -> list[float]:
        """Frequencies with the stiffness of the elements, rad/s; empty without elements."""
        if not any(one.always for one in self.model.contact_rows):
            return []
        squares = np.linalg.eigvalsh(self.model.system.K + self.model.linear_elements[0])
        return np.sqrt(np.maximum(squares, 0.0)).tolist()  # type: ignore[no-any-return]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            **({"structure": self.structure} if self.structure else {}),
            "modes": mode_rows(self.model),
            "correlation_time": self.correlation_time,
            "stops": [asdict(one) | {"name": self.model.contact_rows[one.stop].name} for one in self.touched],
            "suggested_modes": self.modes,
            "suggested_steps": self.steps,
            "warnings": self.warnings,
            **({"omega_with_elements": self.stiffened} if self.stiffened else {}),
        }


def check(
    model: Model, duration: float | None = None, dt: float | None = None, discard: float = 0.0, said: Sequence[str] = ()
) -> Check:
    """Look at a scene and its model; `Scene.check` explains it. `said`: what was warned of when the model was made."""
    touched, failed = expected(model)
    shortest = min((one.time for one in touched), default=math.inf)
    steps = {}
    if np.any(model.omega > 0):  # rigid-body modes alone have no period
        steps["output step dt, 20 in the shortest period kept"] = 2 * math.pi / (20 * fastest(model))
    if shortest < math.inf:
        steps["output step dt to see the force, 20 in a contact"] = shortest / 20
    found = _sentences(model, (touched, failed), (duration, dt, discard), said)
    modes = _suggested_modes(model.scene, shortest)
    return Check(model, touched, steps | _limits(model), modes, _correlation_time(model), found)


def doubts(model: Model, duration: float | None = None, dt: float | None = None, discard: float = 0.0) -> list[str]:
    """The warnings of `check` alone, without what its tables need: the model is not reduced again."""
    return _sentences(model, expected(model), (duration, dt, discard))


def _sentences(
    model: Model,
    trial: tuple[list[Touched], list[str]],
    run: tuple[float | None, float | None, float],
    said: Sequence[str] = (),
) -> list[str]:
    """What looks wrong with a scene, its numbers, a run of (duration, dt, discard), and the contacts of its trial."""
    touched, failed = trial
    moved = getattr(model.scene.beam, "doubts", [])
    found = [*model.scene.doubts, *moved, *said, *units.doubts(model), *sampling.of_run(model, *run)]
    return [*found, *failed, *of_contacts(model, touched)]


def _suggested_modes(scene: Scene, shortest: float) -> dict[str, int]:
    """Numbers of modes for what drives the beam and for its contacts: the last is the first above the limit, which
    shows that none below is missing, so that `of_contacts` and `units.of_loads` do not warn of them.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        try:
            model = scene.reduce(modes=MOST_MODES)
        except (ValueError, RuntimeError):
            return {}
    wanted = {}
    top = units.highest_driven(scene)
    if 0 < top < math.inf:
        wanted["modes for the motion, to the first above 1.5 times the highest frequency that drives it"] = 1.5 * top
    if shortest < math.inf:
        wanted["modes for contact forces, to the first above 3π over the contact time"] = 3 * math.pi / shortest
    each = [model.omega[own] for own in units.of_each_body(model)]  # `modes` counts those of every body
    most = max(map(len, each))
    counts = {name: 1 + max(int(np.count_nonzero(omega <= w)) for omega in each) for name, w in wanted.items()}
    return {name if n <= most else f"{name} (at least)": min(n, most) for name, n in counts.items()}


def _limits(model: Model) -> dict[str, float]:
    """Largest stable steps of methods with constant steps, which take stops on lines alone."""
    found: dict[str, float] = {}
    if any(one.is_circle or one.friction for one in model.contact_rows):
        return found
    for method in (solvers.RK4(1e-6), solvers.HenonRK2(1e-6, 1e-6)):
        limit = method.stable_dt(model.system)
        name = type(method).__name__
        steps = {"flight": limit.flight, **({"contact": limit.contact} if stops(model) else {})}
        found |= {f"step of {name} in {where}, at most": step for where, step in steps.items() if 0 < step < math.inf}
    return found


def _correlation_time(model: Model) -> float:
    """Time constant of the slowest decay, s; infinite without damping."""
    try:
        return correlation_time(model)
    except ValueError:
        return math.inf
