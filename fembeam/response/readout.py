"""What it takes besides coordinates to evaluate a run: computed from its model when asked for, or read from its file.

    q'' = Σ_l v_l s_l(t) + Σ_s w_s F_s - C q' - K q,    reactions = R [F; s; q''; q']

k samples, n coordinates, m rows of contacts, l loads, r reactions. Neither scene nor laws nor signals are needed then.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fembeam.scene import heights, loads
from fembeam.structures import COMPONENTS, UP, Six
from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model import Model
    from fembeam.model.histories import Histories

Vector = NDArray[np.float64]


class Readout:
    """Loads, damping, the frame's motion, section forces, reactions, heights of one run; each made once.

    `kept` are those of a file, by the names of the properties; what is neither there nor of a model is a ValueError.
    """

    def __init__(self, model: Model | None, t: Vector, kept: dict[str, Any] | None = None) -> None:
        self._model, self.t = model, t
        self.__dict__.update(kept or {})

    @property
    def model(self) -> Model:
        """The model; ValueError without one."""
        require(self._model is not None, "this needs the model of the run",
                "a run read from a file that does not keep it", "Run",
                "simulate again, or use dataclasses.replace(run, model=model)")  # fmt: skip
        assert self._model is not None
        return self._model

    @cached_property
    def stiffness(self) -> Vector:
        """K (n, n), 1/s²; M is 1."""
        return np.asarray(self.model.system.K)

    @cached_property
    def omega(self) -> Vector:
        """Natural frequencies ω (n,) with all contacts open, rad/s: K is diagonal."""
        return np.sqrt(np.diag(self.stiffness))

    @cached_property
    def zeta(self) -> Vector:
        """Damping ratios (n,) of the structure without dashpots."""
        return self.model.zeta

    @cached_property
    def damping(self) -> Vector:
        """C (n, n), 1/s."""
        return np.asarray(self.model.system.C)

    @cached_property
    def load_vectors(self) -> Vector:
        """Vectors v (l, n)."""
        vectors = [vector for vector, _ in self.model.system.loads]
        return np.array(vectors, dtype=float).reshape(len(vectors), len(self.stiffness))

    @cached_property
    def loads(self) -> Vector:
        """Signals s (l, k): of forces and feet, then the frame's ÿ if it moves, then gravity."""
        signals = [signal for _, signal in self.model.system.loads]
        return np.array([_sampled(signal, self.t) for signal in signals]).reshape(len(signals), len(self.t))

    @cached_property
    def base(self) -> int | None:
        """Number of ÿ (the first of several) among the loads; None for a frame at rest."""
        scene = self.model.scene
        return None if not scene.motions else len(loads(scene, self.model.matrices))

    @cached_property
    def moved(self) -> tuple[str, ...]:
        """Directions (b,) in which the frame moves."""
        return tuple(self.model.scene.motions)

    @cached_property
    def frame(self) -> Vector:
        """Its motion y and ẏ (2 b, k), m and m/s, one direction after the other; (0, k) for a frame at rest."""
        motions = [part for base in self.model.scene.motions.values() for part in (base, base.derivative(1))]
        return np.array([_sampled(motion, self.t) for motion in motions]).reshape(len(motions), len(self.t))

    @cached_property
    def section_forces(self) -> Any:
        """`SectionForces` of each beam; None of bodies without sections."""
        return self.model.section_forces

    @cached_property
    def reactions(self) -> tuple[list[tuple[Any, int]], Vector]:
        """(part, body) of each reaction and R (r, 2, m + l + 2 n): force and moment."""
        from fembeam.response.support_reactions import reaction_rows

        return reaction_rows(self.model)

    @cached_property
    def supports(self) -> Vector:
        """Place z and body of each support (s, 2)."""
        scene = self.model.scene
        beams = [(body, one) for body, one in enumerate((scene, *scene.bodies)) if not one.named]
        found = [(support.z, body) for body, one in beams for support in one.supports]
        return np.array(found, dtype=float).reshape(-1, 2)

    @cached_property
    def heights(self) -> Vector:
        """Heights of the beams (b,), m."""
        return np.array(heights(self.model.scene)[0])

    @cached_property
    def impactor_places(self) -> Vector:
        """Place z and height of each impactor (i, 2), m; z is 0 where places have names."""
        along = [one.z if one.direction is None else 0.0 for one in self.model.matrices.impactors]
        return np.array([along, heights(self.model.scene)[1]]).T.reshape(-1, 2)


def _sampled(signal: Any, t: Vector) -> Vector:
    """A signal at the samples (k,)."""
    return np.broadcast_to(np.asarray(signal(t), dtype=float), t.shape)


def coordinates(run: Histories) -> Vector:
    """Modal accelerations q'' (k, n) at the samples, m √kg/s², with the contact forces of the laws there.

    Not from differences of the samples: contacts shorter than a sample would be lost, and digits with them.
    """
    read = run.readout
    driven = run._forces.T @ run.directions + read.loads.T @ read.load_vectors
    return np.asarray(driven - run.q_dot @ read.damping.T - run.q @ read.stiffness.T)


def frame_motion(run: Histories, order: int = 0, along: Six = UP) -> Vector:
    """The frame's displacement y (k,) at the samples, or a derivative up to the second; zeros for a frame at rest.

    ``along`` a direction: Σ n_i y_i.
    """
    base, found = run.readout.base, np.zeros(len(run.t))
    if base is None:
        return found
    for number, direction in enumerate(run.readout.moved):
        part = along[COMPONENTS.index(direction)]
        motion = run.readout.loads[base + number] if order == 2 else run.readout.frame[2 * number + order]
        found = found + part * np.array(motion) if part else found
    return found
