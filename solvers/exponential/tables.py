"""Everything the exponential integrator knows before it starts: propagators and force responses per step size.

A block p'' + c p' + k p = 0 moves by E(x) = exp(A x) = α I + β A with A = [[0, 1], [-k, -c]], A² = -k I - c A, so two
numbers (α, β) are a propagator and products stay of this form. Flight steps are h_l = h_0 2^{-l/4}; contact steps
are every second of them.

On a contact step a force is known by its values at a few nodes, see `contact.nodes`. Responses of a block to such a
force, ∫ E(t_i - τ) F(τ) dτ, are computed by composite Gauss quadrature fine enough for the fastest block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from solvers.compiled.kernels import Problem, inner, kernel
from solvers.compiled.state import parameters_of
from solvers.compiled.sums import padded
from solvers.exponential.contact.nodes import PHASES, Families, S, families_of, gauss, lagrange
from solvers.exponential.phi_functions import signal_responses
from solvers.problem import Memo

STIFFNESS, EXPONENT, FACTOR, DAMPING = range(4)  # of an inlined law
TAYLOR_REACH = 0.02  # |λ| x up to which a Taylor step of order 6 is exact to rounding
_PANEL = 6.0  # radians of the fastest oscillation per quadrature panel of 12 points
_MOST_RADIANS = 2000.0  # largest contact step in units of 1/|λ|
_CONTACT_REACH = 1e-6  # smallest one in the same units, and not above
_SHORT = 1e-9  # s: a stop may be far stiffer than the structure


class Tables(NamedTuple):
    """Numbers per step size; l counts flight steps, j contact steps."""

    h: Any  # (l,)
    propagator: Any  # (l, 2, N padded): α, β of every block
    signal: Any  # (l, L, 6, 2N): state change by a signal t^k/k!
    cell: Any  # (2, N) propagator of a whole cell of the sampled signals
    cell_signal: Any  # (L, 6, 2N)
    apart: Any  # (2, N padded): k, c
    look: Any  # (m, 4, N padded): the first two rows give δ + gap from p and v, the others δ̇
    weight: Any  # (m, N padded): |δ̈| <= Σ weight × energy norm
    reach: Any  # (m, N): |δ̇| <= Σ reach × energy norm
    direct: Any  # (m, L): δ̈ per unit of a signal
    load_norm: Any  # (L, N): energy norm of a load per block
    fastest: float  # |λ|max
    own: float  # number of the structure's own blocks; those behind are tones
    mobility: Any  # (m, m): δ̈ of stop s per newton at stop u, positive where the force opens the contact
    exponent: Any  # (m,) leading exponents p
    inlined: Any  # (m, 4) (K, p, a, c) of a force K δ^p (1 + a δ̇/δ̇⁻) + c δ̇; p = 0 for the laws to be called
    step: Any  # (j,) contact steps
    step_propagator: Any  # (j, 2, N)
    power: Any  # (f,) κ
    lead: Any  # (f,) λ
    nodes: Any  # (f, S) σ
    times: Any  # (f, S) σ^κ
    weights: Any  # (f, S): ∫F dt = h Σ weights F
    plain: Any  # (f, S): the same of a force without the weight σ^λ
    summary: Any  # (f, S, 8): from node values, the last four Jacobi coefficients, both ends' values, both slopes
    tail: Any  # (f, S, 8): from node values of a signal, the last four Legendre coefficients in σ
    zoom: Any  # (f, S, 2S + 2, 2S): δ and h δ̇ at points around a node from those at all nodes and at the begin
    places: Any  # (f, S, 2): the interval of σ these points span
    free: Any  # (f, j, m, 2N, 2S): δ and δ̇ at the nodes from the state
    forced: Any  # (f, j, m, m + L, S, 2S): the same from the forces and signals at the nodes
    kick: Any  # (f, j, m + L, S, 2N padded): state change at the end
    ripple: Any  # (f, j, m, 2N): error of the indentation between the nodes <= Σ ripple |z|
    signal_rows: Any  # (L, 2N): a load's tones from the state
    power_rows: Any  # (L, 2N): input power = signal × power row
    loss_rows: Any  # (r, 2N): damping power = Σ (row·z)²
    gauss: Any  # (2, 8) points and weights on (0, 1) for the energy ledger
    extend: Any  # (f, 5, S, S): the force on the next smooth step, 2^{(i-2)/2} times shorter, from that of the last
    bend: Any  # (m,) kind of the law's bend, see `contact.crossings`
    uncut: Any  # (m,) addresses of the laws without their cut at F = 0, and of their derivatives
    uncut_gradient: Any
    uncut_parameters: Any  # (m, P)


class Known(NamedTuple):
    """What the tables hold of the laws."""

    exponent: Any
    inlined: Any
    bend: Any
    uncut: Any
    uncut_gradient: Any
    uncut_parameters: Any


def known_of(laws: Sequence[Any]) -> Known:
    """The same of given laws; see `solvers.problem.system.Law`."""
    bends = [getattr(law, "bend", None) for law in laws]
    uncut = [law.uncut if bend == "force" else law for law, bend in zip(laws, bends, strict=True)]
    return Known(
        np.array([law.exponent for law in laws], dtype=float),
        np.array([getattr(law, "inlined", None) or (0.0,) * 4 for law in laws]).reshape(-1, 4),
        np.array([(None, "rate", "force").index(bend) for bend in bends], dtype=float),
        np.array([law.address for law in uncut], dtype=np.int64),
        np.array([law.gradient_address for law in uncut], dtype=np.int64),
        parameters_of(uncut),
    )


@kernel
def propagate(k, c, x):
    """(α, β) of exp(A x), any damping: e^{-cx/2} [cos θ, sin θ / ω_d], its hyperbolic form, or their limit."""
    half = 0.5 * c
    discriminant = half * half - k
    if discriminant < 0.0:
        omega = math.sqrt(-discriminant)
        decay = math.exp(-half * x)
        beta = decay * math.sin(omega * x) / omega
        return decay * math.cos(omega * x) + half * beta, beta
    root = math.sqrt(discriminant)
    slow = -k / (half + root) if half + root > 0.0 else 0.0
    decay = math.exp(slow * x)
    beta = decay * x if root * x < 1e-12 else -decay * math.expm1(-2.0 * root * x) / (2.0 * root)
    return decay - slow * beta, beta


@inner
def _block_response(k, c, h, rate, power, lead, nodes, weights, gauss, out, basis):
    """out[i, j] = (α, β) of ∫_0^{t_i} E(t_i - τ) w(σ) L_j(σ)/w(σ_j) dτ; i = S is the end of the step."""
    count = nodes.size
    for i in range(count + 1):
        a = nodes[i - 1] if i > 0 else 0.0
        b = nodes[i] if i < count else 1.0
        ta, tb = h * a**power, h * b**power
        ea, eb = propagate(k, c, tb - ta)
        for j in range(count):  # carry the integral so far to the new node
            alpha = out[i - 1, j, 0] if i > 0 else 0.0
            beta = out[i - 1, j, 1] if i > 0 else 0.0
            out[i, j, 0] = ea * alpha - k * eb * beta
            out[i, j, 1] = ea * beta + eb * alpha - c * eb * beta
        panels = 1 + int(rate * (tb - ta) / _PANEL)
        for panel in range(panels):
            left = a + (b - a) * panel / panels
            width = (b - a) / panels
            for g in range(gauss.shape[1]):
                sigma = left + width * gauss[0, g]
                t, measure = h * sigma, h * width * gauss[1, g]
                if power > 1.0:
                    pace = sigma ** (power - 1.0)
                    t, measure = t * pace, measure * power * pace
                if lead > 0.0:
                    measure *= sigma**lead
                alpha, beta = propagate(k, c, tb - t)
                lagrange(nodes, weights, sigma, basis)
                for j in range(count):
                    out[i, j, 0] += alpha * measure * basis[j]
                    out[i, j, 1] += beta * measure * basis[j]


@inner
def _fill_free(problem, b, h, family, level, power, nodes, free):
    """What one block's state does at the nodes of one family and contact level."""
    count, size = nodes.size, problem.k.size
    k, c = problem.k[b], problem.c[b]
    for i in range(count):
        alpha, beta = propagate(k, c, h * nodes[i] ** power)
        for s in range(problem.gap.size):
            for d in range(2):
                r = problem.read[s] if d == 0 else problem.read_rate[s]
                free[family, level, s, b, d * count + i] = r[b] * alpha - r[size + b] * k * beta
                free[family, level, s, size + b, d * count + i] = r[b] * beta + r[size + b] * (alpha - c * beta)


@inner
def _fill_forced(problem, b, family, level, u, pushed, nodes, work, forced, kick):
    """What one input does through one block, from the block's response in ``work``; ``pushed`` is its (p, v) part."""
    count, size = nodes.size, problem.k.size
    k, c = problem.k[b], problem.c[b]
    for j in range(count):
        for i in range(count + 1):
            alpha, beta = work[i, j, 0], work[i, j, 1]
            p = alpha * pushed[0] + beta * pushed[1]
            v = -k * beta * pushed[0] + (alpha - c * beta) * pushed[1]
            if i == count:
                kick[family, level, u, j, b] = p
                kick[family, level, u, j, size + b] = v
                continue
            for s in range(problem.gap.size):
                forced[family, level, s, u, j, i] += problem.read[s, b] * p + problem.read[s, size + b] * v
                forced[family, level, s, u, j, count + i] += (
                    problem.read_rate[s, b] * p + problem.read_rate[s, size + b] * v
                )


@inner
def _fill_block(problem, b, h, family, level, power, lead, nodes, weights, gauss, inputs, forced, kick, work, basis):
    """What inputs do through one block: the force of the stop that enters has the weight σ^lead."""
    size = problem.k.size
    rate = math.sqrt(problem.k[b]) + problem.c[b]
    reached = 0.0
    for u in range(inputs.shape[0]):
        reached += abs(inputs[u, b]) + abs(inputs[u, size + b])
    for weighted in range(2):
        if reached == 0.0 or (weighted == 1 and lead == 0.0):
            continue
        _block_response(
            *(problem.k[b], problem.c[b], h, rate, power, lead * weighted),
            *(nodes, weights[weighted], gauss, work, basis),
        )
        for u in range(inputs.shape[0]):
            pushed = inputs[u, b], inputs[u, size + b]
            enters = u == family - 1 and lead > 0.0
            if enters == (weighted == 1) and (pushed[0] != 0.0 or pushed[1] != 0.0):
                _fill_forced(problem, b, family, level, u, pushed, nodes, work, forced, kick)


@kernel
def _fill(problem, blocks, h, powers, leads, nodes, weights, gauss, inputs, free, forced, kick, work, basis):
    """All tables of the smooth family and of the entries that are not smooth, for some of the blocks."""
    for f in range(powers.size):
        if f > 0 and powers[f] == 1.0:
            continue
        for level in range(h.size):
            for b in range(blocks[0], blocks[1]):
                _fill_free(problem, b, h[level], f, level, powers[f], nodes[f], free)
                _fill_block(
                    *(problem, b, h[level], f, level, powers[f], leads[f], nodes[f], weights[f]),
                    *(gauss, inputs, forced, kick, work, basis),
                )


@kernel
def _fill_propagators(k, c, blocks, h, out):
    """(len(h), 2, N): α, β of the blocks from the first to before the last."""
    for i in range(h.size):
        for b in range(blocks[0], blocks[1]):
            out[i, 0, b], out[i, 1, b] = propagate(k[b], c[b], h[i])


@kernel
def _fill_ripple(problem, blocks, h, phases, alias, out):
    """Error of each stop's indentation between the nodes, per |p| and |v| of every block that oscillates.

    The phases ω h of the aliasing errors are a geometric sequence.
    """
    size, last = problem.k.size, phases.size - 1
    density = last / math.log(phases[last] / phases[0])
    for b in range(blocks[0], blocks[1]):
        omega = math.sqrt(problem.k[b])
        for level in range(h.size):
            phase = h[level] * omega
            if phase < phases[0]:
                break  # the steps become ever shorter
            i = min(int(density * math.log(phase / phases[0])), last - 1)
            way = min((phase - phases[i]) / (phases[i + 1] - phases[i]), 1.0)
            for f in range(alias.shape[0]):
                error = (1.0 - way) * alias[f, i] + way * alias[f, i + 1]
                for s in range(problem.gap.size if error > 1e-13 else 0):
                    row = abs(problem.read[s, b]) / omega + abs(problem.read[s, size + b])
                    out[f, level, s, b], out[f, level, s, size + b] = error * row * omega, error * row


class _Blocks(NamedTuple):
    """The part of the tables that takes long, block by block; no contact force reaches the tones' blocks."""

    propagator: Any
    step_propagator: Any
    free: Any
    ripple: Any
    forced: Any
    kick: Any


# the tables that tones have a part in
OF_TONES = (
    *("propagator", "step_propagator", "free", "ripple", "apart", "look", "weight", "reach"),
    *("signal_rows", "power_rows", "loss_rows", "cell"),
)

_KNOWN = Memo(1 << 27)  # `_Blocks` of structures met lately: a tone, gap or stiffness more is cheap


def build(
    problem: Problem,
    tones: int,
    series: tuple[tuple[float, float], ...],
    laws: Known,
    dt_cell: float,
    ledger: tuple[Any, Any, Any],
) -> Tables:
    """Tables of a problem whose last blocks are ``tones``, but for their columns, which `fill_tones` fills."""
    size = len(problem.k)
    omega, damping = np.sqrt(problem.k), problem.c
    fastest = float(max((omega + damping).max(), 1e-3))
    h, contact_h = _steps(omega, damping, tones)
    families = families_of(series)
    blocks = _blocks(problem, tones, h, contact_h, families)
    return Tables(
        h=h,
        propagator=blocks.propagator,
        signal=signal_responses(problem, h),
        cell=_cell(problem, dt_cell),
        cell_signal=signal_responses(problem, np.array([dt_cell]))[0],
        apart=_in_eights(np.array([problem.k, problem.c])),
        look=_in_eights(np.concatenate((problem.read, problem.read_rate), axis=1).reshape(-1, 4, size)),
        weight=_in_eights(
            np.abs(problem.read[:, :size]) * (omega + damping)
            + np.abs(problem.read[:, size:]) * (problem.k + damping * (omega + damping))
        ),
        reach=np.abs(problem.read[:, :size]) + np.abs(problem.read[:, size:]) * (omega + damping),
        direct=problem.read_rate @ problem.load.T,
        load_norm=np.sqrt(problem.load[:, size:] ** 2 + problem.k * problem.load[:, :size] ** 2),
        fastest=fastest,
        own=float(size - tones),
        mobility=-problem.read_rate @ problem.push.T,
        **laws._asdict(),
        step=contact_h,
        step_propagator=blocks.step_propagator,
        power=families.power,
        lead=families.lead,
        nodes=families.nodes,
        times=families.times,
        weights=families.weights,
        plain=families.plain,
        summary=families.summary,
        tail=families.tail,
        zoom=families.zoom,
        places=families.places,
        free=blocks.free,
        forced=blocks.forced,
        kick=blocks.kick,
        ripple=blocks.ripple,
        signal_rows=ledger[0],
        power_rows=ledger[1],
        loss_rows=ledger[2],
        gauss=gauss(8),
        extend=families.extend,
    )


def fill_tones(tables: Tables, problem: Problem, tones: int, series: tuple[tuple[float, float], ...]) -> None:
    """Fill the columns of a problem's last blocks, its ``tones``, into tables `build` has made."""
    if not tones:
        return
    size = len(problem.k)
    own, k = size - tones, problem.k[size - tones :]
    p, v, omega = np.abs(problem.read[:, own:size]), np.abs(problem.read[:, size + own :]), np.sqrt(k)
    tables.weight[:, own:size], tables.reach[:, own:] = p * omega + v * k, p + v * omega
    tables.apart[0, own:size] = k
    for i, rows in enumerate((problem.read, problem.read_rate)):
        tables.look[:, 2 * i : 2 * i + 2, own:size] = rows.reshape(-1, 2, size)[:, :, own:]
    if problem.table_dt.size:
        _fill_propagators(problem.k, problem.c, (own, size), problem.table_dt[:1], tables.cell[None])
    blocks = _Blocks(*(getattr(tables, name) for name in _Blocks._fields))
    _filled(blocks, problem, (own, size), tables.h, tables.step, families_of(series))


def doublings(speeds: Any, tones: Any) -> int:
    """How many times twice as fast as a structure's blocks the fastest tone is, rounded up; 0 for a slower one."""
    ratio = float(tones.max(initial=0.0)) / max(float(speeds.max()), 1e-3)
    return math.ceil(math.log2(max(ratio, 1.0)))


def _steps(omega: Any, damping: Any, tones: int) -> tuple[Any, Any]:
    """Flight and contact steps. They depend on the structure alone, but for tones faster than it."""
    own = omega.size - tones
    times = doublings((omega + damping)[:own], omega[own:])
    return _steps_of(omega[:own].tobytes(), damping[:own].tobytes(), times)


@lru_cache(maxsize=64)
def _steps_of(omegas: bytes, dampings: bytes, doublings: int) -> tuple[Any, Any]:
    """Steps for a structure's frequencies and dampings, and for tones so many times twice as fast."""
    omega, damping = np.frombuffer(omegas), np.frombuffer(dampings)
    fastest = max(float((omega + damping).max()), 1e-3)
    moving = np.concatenate((omega[omega > 0], damping[damping > 0]))
    fastest *= 2.0**doublings
    longest = 4.0 * math.pi / (moving.min() if moving.size else fastest)
    levels = 2 + math.ceil(4.0 * math.log2(longest * fastest / TAYLOR_REACH))
    h = longest * 2.0 ** (-0.25 * np.arange(levels))
    first = int(np.searchsorted(-h, -_MOST_RADIANS / fastest))
    bottom = math.ceil(4.0 * math.log2(longest / min(_CONTACT_REACH / fastest, _SHORT)))
    return h, longest * 2.0 ** (-0.25 * np.arange(first, bottom + 2, 2))


def _blocks(problem: Problem, tones: int, h: Any, contact_h: Any, families: Families) -> _Blocks:
    """Tables of all blocks, zero for the tones; those of a structure met lately are kept."""
    size = len(problem.k)
    own = size - tones
    rows = (row.reshape(-1, 2, size)[:, :, :own] for row in (problem.push, problem.read, problem.load))
    arrays = (problem.k[:own], problem.c[:own], *rows, h, contact_h, *families[:3])
    key = b"|".join((b"%d" % tones, *(array.tobytes() for array in arrays)))

    def make() -> _Blocks:
        return _filled(_empty(problem, h, contact_h, families), problem, (0, own), h, contact_h, families)

    known: _Blocks = _KNOWN.get(key, make)
    return known


def _empty(problem: Problem, h: Any, contact_h: Any, families: Families) -> _Blocks:
    """Zeros for the tables of all blocks."""
    stops, size, kinds, levels = len(problem.gap), len(problem.k), len(families.power), len(contact_h)
    inputs = stops + len(problem.load)
    return _Blocks(
        *(np.zeros((len(h), 2, padded(size))), np.zeros((levels, 2, size))),
        *(np.zeros((kinds, levels, stops, 2 * size, 2 * S)), np.zeros((kinds, levels, stops, 2 * size))),
        np.zeros((kinds, levels, stops, inputs, S, 2 * S)),
        np.zeros((kinds, levels, inputs, S, padded(2 * size))),
    )


def _filled(
    tables: _Blocks, problem: Problem, blocks: tuple[int, int], h: Any, contact_h: Any, families: Families
) -> _Blocks:
    """The tables, filled for the blocks from the first to before the last."""
    _fill_propagators(problem.k, problem.c, blocks, h, tables.propagator)
    _fill_propagators(problem.k, problem.c, blocks, contact_h, tables.step_propagator)
    inputs = np.ascontiguousarray(np.concatenate((problem.push, problem.load)).reshape(-1, 2 * len(problem.k)))
    _fill(
        *(problem, blocks, contact_h, families.power, families.lead, families.nodes, families.lagrange),
        *(gauss(12), inputs, tables.free, tables.forced, tables.kick, np.zeros((S + 1, S, 2)), np.zeros(S)),
    )
    _fill_ripple(problem, blocks, contact_h, PHASES, families.alias, tables.ripple)
    for f in np.flatnonzero(families.power[1:] == 1.0) + 1:  # an analytic entry is a smooth step
        tables.free[f] = tables.free[0]
        if blocks[0] == 0:
            tables.forced[f], tables.kick[f] = tables.forced[0], tables.kick[0]
    return tables


def _in_eights(rows: Any) -> Any:
    """Rows with zeros up to a multiple of eight."""
    out = np.zeros((*rows.shape[:-1], padded(rows.shape[-1])))
    out[..., : rows.shape[-1]] = rows
    return out


def _cell(problem: Problem, dt: float) -> Any:
    """(2, N): α, β of every block over a cell of the sampled signals."""
    out = np.empty((1, 2, len(problem.k)))
    _fill_propagators(problem.k, problem.c, (0, len(problem.k)), np.array([dt]), out)
    return out[0]
