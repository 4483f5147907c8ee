"""Accelerations of a run from its equations of motion, and the motion of the frame.

    q'' = Σ_l v_l s_l(t) + Σ_s w_s F_s - C q' - K q,    ü(z) = φ(z)·q'',    absolute: u + y and its derivatives

Not from differences of the samples: contacts shorter than a sample would be lost, and digits with them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fembeam.support import require

if TYPE_CHECKING:
    from fembeam.model import Model, Run

Vector = NDArray[np.float64]


def model_of(run: Run, what: str) -> Model:
    """The model of a run; ValueError where the run was read from a file, which does not hold it."""
    require(run.model is not None, f"the {what} needs the model of the run", "a run read from a file", "Run",
            "simulate again, or use dataclasses.replace(run, model=model)")  # fmt: skip
    assert run.model is not None
    return run.model


def coordinates(run: Run) -> Vector:
    """Modal accelerations q'' (k, n) at the samples, m √kg/s², with the contact forces of the laws there."""
    system = model_of(run, "acceleration").system  # whose M is 1
    forces = np.array([run.force(stop) for stop in range(len(run.stops))]).reshape(-1, len(run.t))
    rates = forces.T @ run.directions - run.q_dot @ system.C.T - run.q @ system.K.T
    for vector, signal in system.loads:
        rates += np.multiply.outer(np.broadcast_to(signal(run.t), run.t.shape), vector)
    return np.asarray(rates)


def frame_motion(run: Run, order: int = 0) -> Vector:
    """The frame's displacement y (k,) at the samples, or a derivative; zeros for a frame at rest."""
    base = model_of(run, "motion of the frame").scene.base
    if base is None:
        return np.zeros(len(run.t))
    motion = base if order == 0 else base.derivative(order)
    return np.array(np.broadcast_to(motion(run.t), run.t.shape), dtype=float)
