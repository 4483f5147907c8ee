"""Work, impulse and loss of elements by quadrature of a densely sampled run, for `random_memory.py`.

Read from the run are its motion and the borders it passed. What is latched between two of them is that at the start,
renewed by the laws themselves; from it follow the force F, the power F δ̇, and for each law what it turns into heat: a
slider f |δ̇| while it slips, a yielding stop (1 - k₁/k₂) F δ̇ on its first loading, smooth hysteresis
(1 - α) k z (δ̇ - ż/A), and everything without memory (F(δ, δ̇) - F(δ, 0)) δ̇. Their integrals are those of Gauss
between borders, taken twice with pieces of two lengths: the difference is what the quadrature is in doubt of.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from comparison import ALLOWED, BALANCE, SAMPLES, handled
from drawn import Scene

from contacts import BoucWen, Coulomb, Jenkins, Law, Sum, WaltonBraun
from contacts.memory.friction import SLIDER_SIZE, Sliders
from contacts.path import renew
from contacts.sums import HEAD, Gated, parts_of
from solvers import Contact, integrate

NODES, WEIGHTS = (0.5 * (x + one) for x, one in zip(np.polynomial.legendre.leggauss(8), (1.0, 0.0), strict=True))
FEWEST = 200  # pieces of a run, at least


@dataclass
class Integrals:
    """Of every element over a run; of what is not known nan."""

    work: Any
    history: Any  # (elements, samples) work and impulse up to the samples
    impulses: Any
    loss: Any
    slip: Any
    force: Any  # largest of the run, as δ and the slopes ∂F/∂δ and ∂F/∂δ̇
    delta: Any
    stiffness: Any
    damping: Any
    balance: float  # energy not accounted for by loads, damping and these works


def integrate_at(scene: Scene, method: Any, dt: Any) -> Any:
    """A run with samples."""
    return integrate(scene.system, scene.q0, scene.q_dot0, scene.duration, dt, method, memory=scene.memory)


def nodes(scene: Scene, known: Any, pace: float) -> tuple[Any, Any]:
    """Times and weights of Gauss' rule on short pieces between all that a run has met."""
    T = scene.duration
    met = np.concatenate((known.transitions.t, known.contacts.t_in, known.contacts.t_out, known.t, [0.0, T]))
    ends = np.unique(np.clip(met[np.isfinite(met)], 0.0, T))
    ends = ends[np.append(True, np.diff(ends) > 1e-11 * T)]
    counts = np.ceil(np.diff(ends) * pace).astype(int)
    cuts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], counts, strict=True)]
    cuts = np.append(np.concatenate(cuts), ends[-1])
    lengths = np.diff(cuts)
    return (cuts[:-1, None] + lengths[:, None] * NODES).ravel(), (lengths[:, None] * WEIGHTS).ravel()


def pace_of(scene: Scene, found: Integrals | None = None) -> float:
    """1/s, the fastest rate of the motion, with springs and dashpots as steep as elements have been in a run."""
    system, rows = scene.system, np.array([contact.direction for contact in scene.system.contacts])
    k, c = (0.0, 0.0) if found is None else (np.nan_to_num(found.stiffness), np.nan_to_num(found.damping))
    K, C = (matrix + (rows.T * more) @ rows for matrix, more in ((system.K, k), (system.C, c)))
    swings, decays = (np.abs(np.linalg.eigvals(np.linalg.solve(system.M, matrix))).max() for matrix in (K, C))
    return max(float(np.sqrt(swings) + decays), FEWEST / scene.duration)


def integrals(scene: Scene, method: Any, known: Any, pace: float) -> Integrals:
    """Those of a run of its own, sampled at the nodes."""
    t, weights = nodes(scene, known, pace)
    dense = integrate_at(scene, method, t)
    up_to = np.where(dense.t < known.t[:, None] * (1.0 + 1e-12), weights, 0.0)  # (samples, nodes)
    found = [_of_element(s, scene, dense, weights, up_to) for s in range(len(scene.system.contacts))]
    work, *others = (np.array(column) for column in zip(*found, strict=True))
    return Integrals(work, *others, _unbalanced(scene, dense, weights, work))


def _unbalanced(scene: Scene, dense: Any, weights: Any, work: Any) -> float:
    """Energy at the end, less that at the start, less the work of loads, and what damping and elements took."""
    system, v = scene.system, dense.q_dot
    power = sum((signal(dense.t) * (v @ vector) for vector, signal in system.loads), np.zeros(len(v)))
    taken = weights @ (power - np.einsum("ti,ij,tj->t", v, system.C, v))
    n = system.size
    ends = (scene.q0, scene.q_dot0), (dense.end[:n], dense.end[n : 2 * n])
    first, last = (0.5 * (v @ system.M @ v + q @ system.K @ q) for q, v in ends)
    return float(last - first - taken + work.sum())


def _of_element(s: int, scene: Scene, dense: Any, weights: Any, up_to: Any) -> tuple[Any, ...]:
    """What `Integrals` holds of an element; nan of a stop without memory, which its log tells."""
    contact: Contact = scene.system.contacts[s]
    law: Any = contact.law
    d, v = -dense.q @ contact.direction - contact.gap, -dense.q_dot @ contact.direction
    if not contact.always:
        own = np.abs(dense.contacts.peak_force[dense.contacts.stop == s])
        unknown = np.full(len(up_to), np.nan)
        told = dense.losses.work[s], unknown, unknown, np.nan, np.nan
        return *told, own.max(initial=0.0), np.abs(d).max(), np.nan, np.nan
    latched, since, shed = latched_over(s, scene, dense)
    force, heat, slipping, slopes = np.empty(len(d)), np.empty(len(d)), np.zeros(len(d)), np.zeros(2)
    which = np.searchsorted(since, dense.t, side="right")
    for j in np.unique(which):
        i, row = which == j, latched[j]
        force[i] = law.batch(1.0, row)(d[i], v[i])
        slopes = np.maximum(slopes, _slopes(law.batch(1.0, row), d[i], v[i]))
        heat[i] = sum(_heat(part, own, d[i], v[i]) for part, own in _parts(law, row))
        slipping[i] = sum(np.count_nonzero(_sliders(own)[4]) for part, own in _parts(law, row) if _slides(part))
    work, loss, slip = (weights @ x for x in (force * v, heat, slipping * np.abs(v)))
    sizes = np.abs(force).max(), np.abs(d).max(), *slopes
    return work, up_to @ (force * v), up_to @ force, loss + shed, slip, *sizes


def _slopes(force: Any, d: Any, v: Any) -> Any:
    """Largest |∂F/∂δ| and |∂F/∂δ̇|, by differences."""
    by_d, by_v = 1e-6 * np.abs(d).max() + 1e-300, 1e-6 * np.abs(v).max() + 1e-300
    at = force(d, v)
    return np.abs([(force(d + by_d, v) - at) / by_d, (force(d, v + by_v) - at) / by_v]).max(axis=1)


def latched_over(s: int, scene: Scene, dense: Any) -> tuple[list[Any], Any, float]:
    """Parameters of a law from each border on, the times of these, and what springs of sliders lose by jumps there."""
    law: Any = scene.system.contacts[s].law
    row, places = np.array(law.parameters, dtype=float), list(law.memory)
    if scene.memory is not None and scene.memory[s] is not None:
        row[places] = scene.memory[s]
    rows, passed, shed = [row], dense.transitions, 0.0
    mine = np.flatnonzero(passed.contact == s)
    for i in mine.tolist():
        row, d = rows[-1].copy(), float(passed.delta[i])
        renew(law, int(passed.border[i]), d, float(passed.delta_dot[i]), row)
        if passed.t[i] > 0.0:  # no work is done at the start
            shed += _springs(law, rows[-1], d) - _springs(law, row, d)
        rows.append(row)
    return rows, passed.t[mine], shed


def _parts(law: Law, row: Any) -> list[tuple[Law, Any]]:
    """The laws that act in one, each with its parameters."""
    if not isinstance(law, Sum):
        return [(law, row)]
    found, at = [], 1
    for part in law.acting:
        found.append((part, row[at + HEAD : at + HEAD + part.parameters.size]))
        at += HEAD + part.parameters.size
    return found


def _slides(part: Law) -> bool:
    return isinstance(part, Sliders)


def _sliders(row: Any) -> Any:
    """(k, f, f_s, c, code, s) of all sliders."""
    return row[2:].reshape(-1, SLIDER_SIZE).T


def _springs(law: Law, row: Any, d: float) -> float:
    """Energy in the springs of all sliders, J."""
    total = 0.0
    for part, own in _parts(law, row):
        if _slides(part):
            k, f, _, _, code, s = _sliders(own)
            total += float(np.sum(np.where(code == 0.0, 0.5 * k * (d - s) ** 2, 0.5 * f**2 / k)))
    return total


def _heat(part: Law, row: Any, d: Any, v: Any) -> Any:
    """Power that a law turns into heat, W; nan of a user's law."""
    if isinstance(part, Sliders):
        _, f, _, c, code, _ = _sliders(row)
        return np.sum(f * np.abs(code)) * np.abs(v) + np.sum(c[code == 0.0]) * v**2
    if isinstance(part, BoucWen):
        elastic, hysteretic, A, beta, gamma, n = row[:6].tolist()
        z = (part.batch(1.0, row)(d, v) - elastic * d) / hysteretic
        return hysteretic * z * np.abs(z) ** (n - 1.0) * (beta * np.abs(v) * z + gamma * v * np.abs(z)) / A
    if isinstance(part, WaltonBraun):
        return (1.0 - row[0] / row[1]) * row[0] * d * v if row[3] == 1.0 else 0.0
    if isinstance(part, Gated):
        return _viscous(part.law, row[5:], row[1], d, v) if row[0] == 1.0 else 0.0
    return np.full(len(d), np.nan) if part.memory else _viscous(part, row, 1.0, d, v)


def _viscous(law: Law, row: Any, entry_rate: float, d: Any, v: Any) -> Any:
    """(F(δ, δ̇) - F(δ, 0)) δ̇."""
    force = law.batch(entry_rate, row)
    return (force(d, v) - force(d, 0.0 * v)) * v


def passive(law: Law) -> bool:
    """Whether no motion makes it give energy: not of a slider damped in stick, whose spring jumps as it lets go."""
    return all(_passive(part) for part in parts_of(law))


def _passive(part: Any) -> bool:
    damped = isinstance(part, Sliders) and any(c > 0.0 for _, _, _, c in part.sliders)
    gives = isinstance(part, BoucWen) and abs(part.gamma) > part.beta
    return not (damped or gives)


def accounts(scene: Scene, method: Any, rtol: float, reach: Any) -> str:
    """What is wrong with losses and impulses of a run; empty if nothing is.

    Where δ and δ̇ are off by rtol of ``reach`` (elements, 2), the largest of the run, work is off by F × rtol × the
    longest way or δ, and an impulse by F × rtol × the duration × the part of the motion that the element sees.
    """
    known = integrate_at(scene, method, scene.duration / SAMPLES)
    pace = pace_of(scene, integrals(scene, method, known, pace_of(scene)))
    coarse, fine = (integrals(scene, method, known, finer * pace) for finer in (1, 2))
    allowed, losses, way = ALLOWED * (rtol + 1e-11), known.losses, reach[:, 0] + reach[:, 1] * scene.duration
    force = np.maximum(fine.force, 1e-12 * fine.force.max() + 1e-300)  # of one that touched within rounding
    units = {"work": force * way, "loss": force * way, "slip": way, "history": (force * way)[:, None]}
    units["impulses"] = (force * scene.duration * reach[:, 0] / np.maximum(fine.delta, 1e-300))[:, None]
    found = {"work": losses.work, "loss": losses.loss, "slip": losses.slip}
    found |= {"history": losses.history.T, "impulses": losses.impulses.T}
    wrong = []
    for name, unit in units.items():
        exact = getattr(fine, name)
        doubt = np.abs(getattr(coarse, name) - exact)
        off = np.where(np.isnan(exact), 0.0, np.abs(found[name] - exact) / (allowed * unit + doubt + 1e-300))
        off = off.reshape(len(off), -1).max(axis=1)
        wrong += [f"{name} of {s}: {off[s]:.3g} allowed" for s in np.flatnonzero(~(off <= 1.0))]
    energy = handled(known) + float(fine.force @ reach[:, 0])
    bound = BALANCE * (rtol + 1e-11) * energy + abs(fine.balance - coarse.balance)
    if not abs(fine.balance) <= bound:
        wrong.append(f"balance of quadratures: {abs(fine.balance) / bound:.3g} allowed")
    return ", ".join(wrong + of_laws(scene, known, allowed * units["loss"]))


def of_laws(scene: Scene, known: Any, allowed: Any) -> list[str]:
    """What laws tell: no passive one gives energy, a slider takes limit times slip, a stop what its log says."""
    wrong, losses, log = [], known.losses, known.contacts
    for s, contact in enumerate(scene.system.contacts):
        law: Any = contact.law
        loss = float(losses.loss[s])
        if passive(law) and loss < -allowed[s]:
            wrong.append(f"loss of {s} is {loss / allowed[s]:.3g} allowed")
        if isinstance(law, (Jenkins, Coulomb)) and passive(law) and not law.jumps:
            off = abs(loss - law.limit * losses.slip[s]) / allowed[s]
            wrong += [f"loss less limit times slip of {s}: {off:.3g} allowed"] * (not off <= 1.0)
        closed = np.isnan(log.t_out) | (log.t_in == 0.0)
        if not contact.always and not closed[log.stop == s].any():
            off = abs(loss - log.energy_loss[log.stop == s].sum()) / max(allowed[s], 1e-300)
            wrong += [f"loss of stop {s} less that of its log: {off:.3g} allowed"] * (not off <= 1.0)
    return wrong
