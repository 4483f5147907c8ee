"""A model near another one on coordinates that change smoothly: turned among modes of close frequencies.

Where frequencies cross or veer, shapes V change places or turn within a small change of a parameter, and of equal
frequencies they are arbitrary among themselves. What they span changes smoothly, and so does V T, which is as near to
the shapes V₀ of the other model as an orthogonal T within each group of close modes makes it (Procrustes):

    T = U Wᵀ,    Vᵀ V₀ = U S Wᵀ,    q = T q'
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import solvers
from fembeam.model.reduce import motions

if TYPE_CHECKING:
    from fembeam.model.model import Model

Vector = NDArray[np.float64]

CLOSE = 0.02  # relative distance of neighbouring frequencies up to which modes are turned among themselves


@dataclass(frozen=True, eq=False)
class Turned:
    """A model on coordinates q', q = T q'."""

    model: Model
    turn: Vector

    @property
    def omega(self) -> Vector:
        """(n,) of the model itself."""
        return self.model.omega

    @property
    def directions(self) -> Vector:
        """(r, n) rows of all contacts."""
        return np.asarray(self.model.directions @ self.turn)

    @cached_property
    def system(self) -> solvers.System:
        """Its matrices, contacts and loads."""
        own, T = self.model.system, self.turn
        contacts = [self._contact(one) for one in own.contacts]
        loads = [(np.asarray(vector) @ T, signal) for vector, signal in own.loads]
        turning = None if own.gyroscopic is None else self._matrix(own.gyroscopic, -1.0)
        M, C, K = (self._matrix(one) for one in (own.M, own.C, own.K))
        return solvers.System(M, C, K, contacts, loads, turning)

    def _matrix(self, matrix: Any, sign: float = 1.0) -> Vector:
        """TᵀAT, symmetric, or skew with the sign -1."""
        turned = self.turn.T @ matrix @ self.turn
        return np.asarray(0.5 * (turned + sign * turned.T))

    def _contact(self, contact: solvers.Contact) -> solvers.Contact:
        rows = {name: getattr(contact, name) for name in ("direction", "tangent", "rotation")}
        return replace(contact, **{name: row @ self.turn for name, row in rows.items() if row is not None})

    def rows_with_supports(self, z: Any, body: int = 0) -> Vector:
        """See `Model.rows_with_supports`."""
        rows, n = self.model.rows_with_supports(z, body), len(self.turn)
        return np.concatenate([rows[..., :n] @ self.turn, rows[..., n:]], axis=-1)

    def rest(self) -> Vector:
        """The start [q', q̇'] (2n,) at rest."""
        return np.asarray(self.model.rest().reshape(2, -1) @ self.turn).ravel()


def turned_like(model: Model, near: Model) -> Turned:
    """The model on coordinates as near as may be to those of another one."""
    own, other = motions(model, near)
    turn = np.zeros((len(near.omega), len(near.omega)))
    for group in _close(near):
        left, _, right = np.linalg.svd(own[:, group].T @ other[:, group])
        turn[np.ix_(group, group)] = left @ right
    return Turned(model, turn)


def angle(near: Turned) -> float:
    """Largest sine of the angles by which modes are turned among themselves; 0 if only signs change."""
    return float(np.abs(near.turn - np.diag(np.diag(near.turn))).max(initial=0.0))


def _close(model: Model) -> list[NDArray[np.int64]]:
    """Numbers of the coordinates in groups of close frequencies, those of each body by itself; impactors alone."""
    ends = np.cumsum([0, *(sum(count) for count in model.counts)])
    groups = [np.array([i]) for i in range(ends[-1], len(model.omega))]
    for first, last in pairwise(ends):
        order = first + np.argsort(model.omega[first:last])
        omega = model.omega[order]
        groups += np.split(order, 1 + np.flatnonzero(np.diff(omega) > CLOSE * omega[1:]))
    return groups
