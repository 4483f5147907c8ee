"""Starts of a motion: at rest, from given fields, from static equilibrium with contact.

q = Φᵀ M u,    K q = f + Σ w_s F_s(-w_s·q - gap_s)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import linalg as sparse_linalg

import reduction
from contacts.path import borders
from fembeam.scene import (
    BodyMatrices,
    directed_words,
    is_directed,
    loads_of_dof,
    place_words,
    quoted,
    support_loads,
    tangent,
)
from fembeam.scene.signal_checks import require_array_function
from fembeam.structures import Structure
from fembeam.support import is_pair, numbers, require, require_finite, warn

if TYPE_CHECKING:
    from fembeam.model.equations import ModalEquations
    from fembeam.model.model import Field, Model
    from fembeam.scene import Matrices
    from fembeam.scene.contact_rows import ContactRow

Vector = NDArray[np.float64]

HELD = 1e-6  # of the largest value of a field: no motion of a support
MISSED = 0.01  # of a field in the mass norm; more gets a warning
SETTLED = 1e-12  # of the forces at work: an equilibrium
KNOWN = 0.5  # of them: rounding of the contacts' forces, at most
ROUNDED = 8.0 * np.finfo(float).eps  # of what an indentation is the difference of: as near as it can be told
MOST_STEPS = 2000


def rest(model: ModalEquations) -> Vector:
    """[q, q_dot] (2n,): zero but for the impactors' velocities, and for supports that move, which all follow."""
    start = follow(model)
    if impactors := model.matrices.impactors:
        start[-len(impactors) :] = [np.sqrt(impactor.mass) * impactor.velocity for impactor in impactors]
    return start


def follow(model: ModalEquations, t: float = 0.0, taken: Mapping[int, Vector] | None = None) -> Vector:
    """[q, q_dot] (2n,) of places that follow supports at a time, by their signals or by what is ``taken`` of loads.

    These are values (1,) by the numbers of loads, of the tables of a run, which are right to rtol. A stiff coordinate
    that begins beside them swings about the difference, with its own frequency: an acceleration many times rtol.
    """
    at, known = np.array([t]), taken or {}
    moved = [signal for _, signal in support_loads(model.scene, model.matrices)]
    start = np.zeros((2, len(model.omega)))
    for i, shape in enumerate(model.following):
        for part, load in zip(start, loads_of_dof(i), strict=False):  # the third is by acceleration
            part += float(np.squeeze(known[load] if load in known else moved[load](at))) * shape
    return start.ravel()


def state(model: Model, displacement: Field | Sequence[Field], velocity: Field | Sequence[Field]) -> Vector:
    """Start from fields; `Model.state` explains it."""
    start, n = rest(model), len(model.omega)
    for name, field, part in (("displacement", displacement, slice(0, n)), ("velocity", velocity, slice(n, 2 * n))):
        full = _nodal(model, field)
        start[part][_given(model, field)] = 0.0
        start[part] += model.basis.project(model.matrices.M @ full)
        lost = _missed(model, full)
        if lost > MISSED:
            warn(f"{lost:.1%} of the {name} (mass norm) in Model.state is not represented by the kept modes; "
                 "keep more modes")  # fmt: skip
    _check_impactors(model, start[:n])
    return start


def split_start(model: Model, start: ArrayLike) -> tuple[Vector, Vector, tuple[Vector, ...]]:
    """q, q̇ and, where given, what each law has latched, of a start (2n,) or the (2n + l,) of `Run.end`."""
    x, n = numbers("start", start, "Model.simulate", "use model.state(displacement, velocity)"), len(model.omega)
    sizes = [one.latched for one in model.contact_rows]
    require(x.shape in ((2 * n,), (2 * n + sum(sizes),)), f"start must have shape ({2 * n},), [q, q_dot]", x.shape,
            "Model.simulate", "use model.state(displacement, velocity)")  # fmt: skip
    latched = np.split(x[2 * n :], np.cumsum(sizes)[:-1]) if x.size > 2 * n else ()
    return x[:n], x[n : 2 * n], tuple(latched)


def warn_of_entries(model: Model, start: ArrayLike) -> None:
    """Warn of stops that move in contact at a start, and whose laws go by the rate of entry, which no start holds."""
    from solvers.orbits import latching_stops

    q, q_dot, _ = split_start(model, start)
    closed = [s for s, one in enumerate(model.system.contacts) if not one.always and one.indentation(q) > 0.0]
    for s in set(closed) & set(latching_stops(model.system)) if closed else ():
        with np.errstate(divide="ignore", invalid="ignore"):  # at the centre of a post, which is refused
            rate = abs(model.system.contacts[s].motion(q, q_dot)[1])
        if rate > 0.0:
            warn(
                f"{model.contact_rows[s].name} is in contact at the start, and its law goes by the rate at which the "
                f"contact was entered, which a start does not hold: it is taken as that of now, {rate:.3g} m/s; of a "
                "run that goes on from another one, end that one where this stop is open"
            )


def missed(model: Model, field: Field | Sequence[Field]) -> float:
    """‖u - Φq‖/‖u‖ in the mass norm."""
    return _missed(model, _nodal(model, field))


def _missed(model: Model, full: Vector) -> float:
    """`missed` of nodal values (N,)."""
    M = model.matrices.M
    size = float(full @ (M @ full))
    left = full - model.basis.expand(model.basis.project(M @ full))
    return float(np.sqrt(max(left @ (M @ left), 0.0) / size)) if size > 0 else 0.0


def _nodal(model: Model, field: Field | Sequence[Field]) -> Vector:
    """Values (N,) on all free dofs; impactors 0."""
    parts = [_on_nodes(beam, one) for beam, one in _of_each(model, field)]
    return np.concatenate([*parts, np.zeros(len(model.matrices.impactors))])


def _given(model: Model, field: Field | Sequence[Field]) -> NDArray[np.bool_]:
    """Coordinates (n,) of the beams whose field is given: it is all of u, with what follows supports that move."""
    given = [one is not None and not beam.named for beam, one in _of_each(model, field)]
    return np.repeat([*given, False], [*map(sum, model.counts), len(model.matrices.impactors)])


def _of_each(model: Model, field: Field | Sequence[Field]) -> list[tuple[Matrices, Field]]:
    """Every beam with its field; a single one is that of the first."""
    beams = model.matrices.beams
    fields = list(field) if isinstance(field, Sequence) else [field, *[None] * (len(beams) - 1)]
    require(len(fields) == len(beams), f"fields must be {len(beams)}, one for each beam", len(fields), "Model.state",
            "give None for a beam at rest")  # fmt: skip
    return list(zip(beams, fields, strict=True))


def _on_nodes(beam: Matrices, field: Field) -> Vector:
    """A field's values and slopes, those of a cubic spline through the nodes, on a beam's free dofs."""
    if field is None:
        return np.zeros(beam.M.shape[0])
    if isinstance(beam, BodyMatrices):
        return _on_labels(beam, field)
    from scipy.interpolate import CubicSpline

    require(callable(field), "a field must be a function of z, an array in m", field, "Model.state",
            "write lambda z: 1e-3 * z, or a list of functions, one for each beam")  # fmt: skip
    require_array_function(field, "a field", "Model.state", "coordinates z")
    values = np.asarray(field(beam.nodes), dtype=float)
    require(values.shape in ((), beam.nodes.shape), f"a field must give one value for each of {beam.nodes.size} z",
            values.shape, "Model.state", "check its shape")  # fmt: skip
    values = np.broadcast_to(values, beam.nodes.shape)
    bad = values[~np.isfinite(values)]
    require(not bad.size, "the field must be finite on the beam", bad[:1], "Model.state", "check the function")
    both = np.stack([values, CubicSpline(beam.nodes, values)(beam.nodes, 1)], axis=1)
    return both[beam.dofs >= 0]


def _on_labels(body: BodyMatrices, field: Any) -> Vector:
    """Values (N,) on free dofs of {(node, component): value}; others are 0, supported ones must be."""
    labels = body.assembled.labels
    require(isinstance(field, Mapping), "the field of a structure must be {(node, component): value}", field,
            "Model.state", "name the dofs that move")  # fmt: skip
    for site, value in field.items():
        require_finite(f"the field at {site}", value, "Model.state", "give m, or rad")
    given = {_label(body, site): float(value) for site, value in field.items()}
    unknown = [label for label in given if label not in labels]
    require(not unknown, f"the field must be of dofs that exist, such as {labels[0]!r}", unknown[:1], "Model.state",
            "write (node, component)")  # fmt: skip
    values = np.array([given.get(label, 0.0) for label in labels])
    held = np.flatnonzero(np.diff(body.spread.tocsr().indptr) == 0)
    moved = held[np.abs(values[held]) > HELD * np.abs(values).max()]
    require(not moved.size, "a start must leave supports where they are", [labels[i] for i in moved[:1]], "Model.state",
            "leave out dofs that are held")  # fmt: skip
    return np.asarray(sparse_linalg.lsqr(body.spread, values, atol=1e-15, btol=1e-15)[0])


def _label(body: BodyMatrices, site: Any) -> Any:
    """The dof of a site, whose node may go by the name of a structure's point."""
    points = body.beam.points if isinstance(body.beam, Structure) else {}
    named = is_pair(site) and isinstance(site[0], str) and site[0] in points
    return (points[site[0]], site[1]) if named else site


def _check_impactors(model: Model, q: Vector) -> None:
    """Raise ValueError when a field puts a free impactor inside the beam."""
    for contact, own in zip(model.contact_rows, model.rows_of, strict=True):
        direction, (kind, number) = model.directions[own.start], contact.on
        if kind == "impactor" and model.matrices.impactors[number].stiffness == 0:
            delta = float(-direction @ q - contact.gap)
            scale = float(np.abs(direction) @ np.abs(q)) + contact.gap
            at = quoted(contact.z) + " m" * (contact.direction is None)
            require(delta <= 1e-9 * scale, f"impactor {number} ({at}) must start outside the beam: δ ≤ 0",
                    delta, "Model.state", "widen its gap")  # fmt: skip


def equilibrium(model: Model, loads: Mapping[Any, float]) -> Vector:
    """Start from static equilibrium; `Model.equilibrium` explains it."""
    start, n = rest(model), len(model.omega)
    load = np.zeros(n)
    for direction, g in model.scene.pulls.items():
        load = load - model.participation_along(direction) * g
    named = isinstance(loads, Mapping)
    require(named, "loads must name their places", loads, "Model.equilibrium", "write {z: force}, in m and N")
    for z, force in loads.items():
        where = directed_words(z) if is_directed(z) else place_words(z)
        require_finite(f"force at {where}", force, "Model.equilibrium", "give N, positive up")
        load = load + force * model.phi(z)
    free = np.ones(n, dtype=bool)
    free[n - len(model.matrices.impactors) :] = start[2 * n - len(model.matrices.impactors) :] == 0.0
    q = np.zeros(n)
    q[free] = _settled(model, load, free, start[:n][free])
    start[:n] = q
    return start


def smooth(contact: Any) -> Any:
    """The same contact without friction."""
    if contact.friction is None:
        return contact
    kept = "annulus" if contact.map == "annulus" else "line"
    return replace(contact, friction=None, map=kept, tangent=None, rotation=None, radius=None, spin=0.0)


def onto_circle(contact: Any, speed: float) -> tuple[float, float]:
    """Value and rate of the first coordinate that bring a place onto its circle with δ̇ = speed, all others at rest.

    |t w - o| = c,  δ̇ = ± (t w - o)·w ṫ/c;  of two such values the larger, of an outer circle that nearer to rest.
    """
    w, o, sign = contact.direction[:, 0], np.array(contact.centre), -1.0 if contact.outer else 1.0
    a, b = w @ w, w @ o
    root = b * b - a * (o @ o - contact.gap**2)
    require(a > 0.0 and root > 0.0, "the first mode must reach the circle", root, "Model.strike", "simulate instead")
    t = (b + sign * np.copysign(np.sqrt(root), 1.0 if sign > 0 else b)) / a
    return t, speed * contact.gap / (sign * ((t * w - o) @ w))


def _settled(model: Model, load: Vector, free: NDArray[np.bool_], rest: Vector) -> Vector:
    """The rest + q, r(q) = f + Σ w F - ω² q = 0, by Newton steps damped like time: (1/τ + J) Δq = r.

    Forces that hold the rest of moved supports are left out: those in static shapes would hide what is not settled.
    τ doubles while it goes well; the damping carries a body that nothing holds yet to the contact that will.
    """
    K, f, W = model.omega[free] ** 2, load[free], model.directions[:, free]
    rows = model.contact_rows
    gaps = np.array([gap for contact in rows for gap in contact.gaps]) + W @ rest
    rounded = np.abs(gaps) + np.abs(W) @ np.abs(rest)
    q = np.zeros(len(f))
    forces, slopes, circles = _pushed(model, -W @ q - gaps)
    residual = f + forces @ W - K * q
    tau = 1e-3 / max(K.max(initial=0.0), 1e-6)
    for _ in range(MOST_STEPS):
        scale = np.abs(f).max(initial=0.0) + np.abs(forces[:, None] * W).max(initial=0.0) + np.abs(K * q).max(initial=0)
        stiff = slopes.copy()
        for own, block in circles:
            stiff[own] = np.abs(block).max()
        told = ROUNDED * stiff * (np.abs(W) @ np.abs(q) + rounded)  # N, of δ: stiff contacts multiply its rounding
        if _balanced(residual, scale, told, W, bool(f.any() or rest.any())):
            _check_memory(model, -W @ q - gaps)
            return rest + q
        J = np.diag(1 / tau + K) + (W.T * slopes) @ W
        for own, block in circles:
            J += W[own].T @ block @ W[own]
        try:
            step = np.linalg.solve(J, residual)
        except np.linalg.LinAlgError:  # τ is so long that nothing holds what is free
            tau /= 4
            continue
        trial = q + step
        trial_forces, trial_slopes, trial_circles = _pushed(model, -W @ trial - gaps)
        after = f + trial_forces @ W - K * trial
        downhill = residual @ step > 0.0 and after @ step > 0.0  # round a post the forces may grow on the way down
        least = np.linalg.norm(told @ np.abs(W))  # below it they cannot fall
        if downhill or np.linalg.norm(after) <= (1 + 1e-12) * np.linalg.norm(residual) + least:
            q, forces, residual, tau = trial, trial_forces, after, min(2 * tau, 1e300)
            slopes, circles = trial_slopes, trial_circles
        elif not tau > 1e-30:
            break
        else:
            tau /= 4
    raise reduction.AccuracyError(
        f"no static equilibrium found, forces out of balance by {np.abs(residual).max():.3g} (modal) in "
        "Model.equilibrium; does anything carry the loads?"
    )


def _balanced(residual: Vector, scale: float, told: Vector, W: Vector, loaded: bool) -> bool:
    """Whether forces balance but for errors of the contacts' forces, up to those `told` (r,), all along the contacts.

    A moment that nothing carries stays, and where a body that falls has gone so far that its contacts' forces are
    rounding, they carry nothing. Of what is not ``loaded`` all forces may be rounding.
    """
    size, error = np.abs(residual).max(initial=0.0), (told @ np.abs(W)).max(initial=0.0)
    known = error <= KNOWN * scale or not loaded
    if size == 0.0 or not (size <= SETTLED * scale + error and known):
        return bool(size == 0.0)
    if size <= SETTLED * scale:
        return True
    stiff = W[told > 0.0].T
    left = residual - stiff @ np.linalg.lstsq(stiff, residual)[0]
    return bool(np.abs(left).max() <= SETTLED * scale)


def _check_memory(model: Model, delta: Vector) -> None:
    """Raise AccuracyError when a law with memory would pass a border, such as slip, on the way."""
    for row, own in zip(model.contact_rows, model.rows_of, strict=True):
        d = delta[own.start]
        if row.remembers and np.any(borders(row.law, np.array([d]), 0.0, row.law.parameters) < 0):
            way = "is touched" if getattr(row.law, "opens", False) else "slips or yields"
            raise reduction.AccuracyError(
                f"{row.name} {way} before equilibrium in Model.equilibrium, and where it rests "
                "depends on how it gets there; simulate from rest instead, with damping"
            )


def _pushed(model: Model, delta: Vector) -> tuple[Vector, Vector, list[tuple[slice, Vector]]]:
    """Static forces (r,) on all rows and their slopes ∂F/∂δ (r,), of stops by differences; of circles 2 by 2."""
    force, slope, circles = np.zeros(len(delta)), np.zeros(len(delta)), []
    for row, own in zip(model.contact_rows, model.rows_of, strict=True):
        i = own.start
        if row.is_circle:
            pair = slice(i, i + 2)
            force[pair], block = _round(row, -delta[pair])
            circles += [(pair, block)] if block.any() else []
        elif row.always:
            force[i], slope[i] = float(row.force(delta[i])), max(tangent(row.law, delta[i])[0], 0.0)
        elif delta[i] > 0:
            force[i], slope[i] = _one_sided(row, delta[i])
    return force, slope, circles


def _one_sided(row: ContactRow, d: float) -> tuple[float, float]:
    """Static force of a stop at δ > 0, and its slope."""
    step = 1e-6 * d
    low, force, high = (float(f) for f in row.force(np.array([d - step, d, d + step])))
    return force, max((high - low) / (2 * step), 0.0)


def _round(row: ContactRow, d: Vector) -> tuple[Vector, Vector]:
    """Static force (2,) of a circular clearance on a place at d, and -∂F/∂d = N' e eᵀ + N/r (1 - e eᵀ), e = ± d/r."""
    radius, r = row.circle[0], float(np.hypot(*d))
    delta = np.sign(radius) * r - radius
    if delta <= 0 or r == 0.0:
        return np.zeros(2), np.zeros((2, 2))
    force, slope = _one_sided(row, delta)
    e = np.sign(radius) * d / r
    return -force * e, slope * np.outer(e, e) + np.sign(radius) * force / r * (np.eye(2) - np.outer(e, e))
