"""Tables of the exponential method: propagators and responses to forces for every step size.

A block p'' + c p' + k p = 0 moves by E(x) = exp(A x) = α I + β A with A = [[0, 1], [-k, -c]], A² = -k I - c A, so two
numbers (α, β) are a propagator and products stay of this form. Flight steps are h_l = h_0 2^{-l/4}; contact steps
are every second of them.

On a contact step a force is given by its values at a few nodes, see `contact.nodes`, and its effect by the responses of
the blocks, see `responses`. For a few stops there are tables of the response of each stop to each force; with more, the
motion of the blocks is computed first, see `contact.many_stops`: then memory grows with the blocks, hardly with the
stops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from solvers.compiled.kernels import Problem
from solvers.compiled.state import parameters_of
from solvers.compiled.sums import padded
from solvers.exponential.block_tables import Blocks, blocks_of, filled
from solvers.exponential.contact.nodes import S, gauss, node_sets_of, so_far
from solvers.exponential.phi_functions import quintic_responses, signal_responses
from solvers.exponential.responses import fill_propagators

STIFFNESS, EXPONENT, FACTOR, DAMPING = range(4)  # places in `Tables.power_law`
RATE, FORCE = 1.0, 2.0  # kinds of bends in `Tables.bend`, named by their event function; 0 for a law without one
TAYLOR_REACH = 0.02  # |λ| h up to which a Taylor step of order 6 is exact to rounding
_MOST_RADIANS = 2000.0  # |λ| h of the largest contact step
_AT_ENDS = 2.1  # √Σ L_i², L_i the polynomials through the smooth nodes at an end of the step
OBSERVED_RADIANS = 200.0  # |λ| h up to which contact steps have tables of the energy
_MOST_SLOW = 17  # blocks, ascending in k, among which flight chooses the slowest
_CONTACT_REACH = 1e-6  # |λ| h of the smallest one, at most
_SLOWEST = 1e-9  # rate in units of the fastest, below which blocks do not lengthen the steps in the tables
_SHORT = 1e-9  # s, of the smallest contact step, at most: a stop may be far stiffer than the structure
_FOLLOWS = 4.0  # ωh from which on a block follows signals on cells of length h: it may oscillate within one
SHORTER = 1e-5  # factor of the smallest contact step where a run has failed for want of a shorter one


class Tables(NamedTuple):
    """Numbers per step size, read by kernels only; `build` and `fill_tones` write them.

    l counts flight steps, j contact steps, f node sets (the smooth one, then one per element that enters), E elements,
    R rows, L loads, N blocks with those of the tones.
    """

    flight_step: Annotated[Any, "l"]  # s, falling
    flight_propagator: Annotated[Any, "l, 2, N8"]  # α, β of every block
    signal: Annotated[Any, "l, L, 6, 2, N8"]  # state change by a signal t^k/k!
    cell: Annotated[Any, "2, N8"]  # α, β over a whole cell of the sampled signals
    cell_signal: Annotated[Any, "L, 6, 2, N8"]  # state change over a cell by s, s', s'' at its start, then at its end
    cell_error: Annotated[Any, "R, N8"]  # see `cell_errors`
    cell_error_signal: Annotated[Any, "R, L, 8"]
    following: Annotated[Any, "L, 3, 2, N8"]  # see `following`
    follows: Annotated[float, "number"]  # 1 where any block follows a signal
    derived: Annotated[float, "number"]  # 1 where bounds have parts in the derivatives of signals
    load_rows: Annotated[Any, "L, 2, N8"]  # state rate of p and v per unit of a signal
    block_k_c: Annotated[Any, "2, N8"]  # k in 1/s², c in 1/s
    observed: Annotated[float, "number"]  # contact step from which on the energy balance has tables
    force_following: Annotated[Any, "R, 4, 2*N"]  # `following` of forces on the rows, all blocks with k > 0
    stop_rows: Annotated[Any, "R, 4, N8"]  # the first two rows give δ + gap from p and v, the others δ̇
    acceleration_weight: Annotated[Any, "R, N8"]  # |δ̈| <= Σ weight × energy norm
    amplitude_weight: Annotated[Any, "R, N8"]  # |δ + gap| <= Σ weight × energy norm, of blocks with k > 0
    slowest: Annotated[Any, "slowest"]  # numbers of the slowest blocks, by k, kept as reals; see `safe_steps`
    acceleration_signal: Annotated[Any, "R, L, 5"]  # see `_acceleration_by_signal`
    rate_weight: Annotated[Any, "R, N"]  # |δ̇| <= Σ weight × energy norm
    load_acceleration: Annotated[Any, "R, L"]  # δ̈ per unit of a signal
    load_norm: Annotated[Any, "L, N"]  # energy norm of a load per block
    fastest: Annotated[float, "number"]  # |λ|max, rad/s
    own_blocks: Annotated[float, "number"]  # number of the structure's blocks; those behind them are tones
    accelerance: Annotated[Any, "R, R"]  # -δ̈ of row r per newton at row u, > 0 where the force opens the contact
    exponent: Annotated[Any, "E"]  # leading exponents p of the laws
    power_law: Annotated[Any, "E, 4"]  # K, p, a, c of K δ^p (1 + a δ̇/δ̇⁻) + c δ̇ before a cut; p = 0: the law is called
    contact_step: Annotated[Any, "j"]  # s, falling
    contact_propagator: Annotated[Any, "j, 2, N"]  # α, β of every block
    time_exponent: Annotated[Any, "f"]  # κ
    weight_exponent: Annotated[Any, "f"]  # λ
    nodes: Annotated[Any, "f, S"]  # σ
    times: Annotated[Any, "f, S"]  # σ^κ
    weights: Annotated[Any, "f, S"]  # ∫F dt = h Σ weights F
    plain: Annotated[Any, "f, S"]  # the same of a force without the weight σ^λ
    work: Annotated[Any, "f, S, S"]  # ∫ F dδ = Σ F_i (Σ work_ij (δ_j - δ₀) + work_end_i (δ - δ₀ at the end)), plain F
    work_end: Annotated[Any, "f, S"]
    summary: Annotated[Any, "f, S, 8"]  # from node values: last four Jacobi coefficients, ends' values, slopes
    node_slopes: Annotated[Any, "f, S, S"]  # h δ̈ at the nodes from δ̇ there less that at the start
    lagrange: Annotated[Any, "f, 2, S"]  # 1/Π (σ_j - σ_i) of the nodes' polynomials, and the same over σ_j^λ
    tail: Annotated[Any, "f, S, 8"]  # from node values of a signal, its Legendre coefficients in σ, the last four first
    local_interpolation: Annotated[Any, "f, S, 2*S+2, 2*S"]  # δ, h δ̇ around a node from those at all and the start
    local_interval: Annotated[Any, "f, S, 2"]  # the interval of σ these points span
    kind: Annotated[Any, "int f"]  # of kinds, and of weightings of plain forces; see `contact.nodes.NodeSets`
    entering: Annotated[Any, "int f"]  # index of the weighting of the force of the stop that enters
    free: Annotated[Any, "kinds, j, R, 2*N, 2*S"]  # δ and δ̇ at nodes from the state; for a few stops, as the next two
    forced: Annotated[Any, "weightings, j, R+L, R, S, 2*S"]  # the same from the forces and signals at the nodes
    end_response: Annotated[Any, "weightings, j, R+L, S, 2*N8"]  # state change at the end
    node_propagator: Annotated[Any, "kinds, j, 2, N, S"]  # α, β of blocks at nodes; for many stops, as the next two
    block_response: Annotated[Any, "weightings, j, S, 2*own, S"]  # α, then β, of the blocks at the nodes per node value
    block_end_response: Annotated[Any, "weightings, j, 2, own, S"]  # the same at the end
    alias: Annotated[Any, "kinds, j, 2*N"]  # error of δ between the nodes <= Σ ripple_weight (alias |p| + alias |v|)
    ringing: Annotated[Any, "R, N"]  # rate at which a block swings once a force begins, per unit of its slope: |push|/k
    reactions: Annotated[Any, "R, j, 2"]  # see `reactions`
    ripple_weight: Annotated[Any, "R, N"]  # amplitude of δ per unit of an oscillating block's rate
    rate_ripple_weight: Annotated[Any, "R, N"]  # amplitude of δ̇ per unit of that rate
    aliased: Annotated[Any, "kinds, j"]  # 0 if the nodes resolve all blocks
    signal_rows: Annotated[Any, "L, 2*N"]  # a load's tones from the state
    power_rows: Annotated[Any, "L, 2*N"]  # input power = signal × power row
    loss_rows: Annotated[Any, "r, 2*N"]  # damping power = Σ (row·z)², less those of rows beyond the blocks
    steady_rate: Annotated[Any, "2*tones, own8"]  # blocks' steady rate by p, then v, of the tones; loss_rows: × √c
    gauss: Annotated[Any, "2+S, S"]  # points, weights on (0, 1); integrals to all points of each one's polynomial
    extrapolation: Annotated[Any, "f, 5, S, S"]  # force on the next smooth step, 2^{(i-2)/2} times shorter
    bend: Annotated[Any, "E"]  # kind of the law's bend: 0 for none, else as named above
    uncut: Annotated[Any, "int E"]  # addresses of the laws without their cut at F = 0
    uncut_gradient: Annotated[Any, "int E"]  # and of their derivatives
    uncut_parameters: Annotated[Any, "E, P"]


def law_tables_of(contacts: Sequence[Any]) -> dict[str, Any]:
    """Entries of `Tables` from the laws of contacts, see `problem.system.Law`."""
    laws = [contact.law for contact in contacts]
    bends = [getattr(law, "bend", None) for law in laws]
    uncut = [_uncut(law) for law in laws]
    inlined = [_inlined(contact) for contact in contacts]
    return {
        "exponent": np.array([law.exponent for law in laws], dtype=float),
        "power_law": np.array([own or (0.0,) * 4 for own in inlined]).reshape(-1, 4),
        "bend": np.array([(None, "rate", "force").index(bend) for bend in bends], dtype=float),
        "uncut": np.array([law.address for law in uncut], dtype=np.int64),
        "uncut_gradient": np.array([law.gradient_address for law in uncut], dtype=np.int64),
        "uncut_parameters": parameters_of(uncut),
    }


def _inlined(contact: Any) -> Any:
    """Parameters of a power law that need not be called, before its cut at F = 0; None of others.

    Under friction a law with a cut is called: there the slopes of its force count, which are 0 where it is cut.
    """
    law = contact.law if contact.friction is not None else _uncut(contact.law)
    return None if contact.always else getattr(law, "inlined", None)


def _uncut(law: Any) -> Any:
    """The law without its cut at F = 0, or itself."""
    return law.uncut if getattr(law, "bend", None) == "force" else law


def uncut_parameters(contacts: Sequence[Any]) -> Any:
    """Parameters (E, P) of the laws of contacts without their cuts at F = 0."""
    return parameters_of([_uncut(contact.law) for contact in contacts])


# tables with columns for the tones' blocks
TONE_TABLES = (
    *("flight_propagator", "contact_propagator", "free", "node_propagator", "alias", "aliased"),
    *("ripple_weight", "rate_ripple_weight"),
    *("block_k_c", "stop_rows", "acceleration_weight", "amplitude_weight", "slowest", "rate_weight"),
    *("signal_rows", "power_rows", "loss_rows", "steady_rate", "cell", "cell_error"),
)


def build(
    problem: Problem,
    tones: int,
    series: tuple[tuple[float, float], ...],
    laws: dict[str, Any],
    dt_cell: float,
    energy_rows: tuple[Any, Any, Any],
    shortened: int = 0,
    kinked: bool = False,
) -> Tables:
    """Tables of a problem whose last blocks are ``tones``; the columns of these are filled by `fill_tones`.

    Contact steps go down to 1e-5 of the usual shortest one for each time they have been ``shortened``. The slopes of
    ``kinked`` signals jump at nodes.
    """
    size = len(problem.k)
    omega, damping = np.sqrt(problem.k), problem.c
    fastest = float(max((omega + damping).max(), 1e-3))
    h, contact_h = _steps(omega, damping, tones, shortened)
    node_sets = node_sets_of(series)
    blocks = blocks_of(problem, tones, h, contact_h, node_sets)
    own, alias = size - tones, blocks.alias[node_sets.kind[0]]
    ready = {**node_sets._asdict(), **blocks._asdict(), **laws}  # `alias` is that of the blocks
    signal_rows, power_rows, loss_rows = energy_rows
    return Tables(
        **_ripples(problem, contact_h, alias, own),
        **_of_signals(problem, h, dt_cell, kinked),
        **_of_rows(problem),
        **{name: ready[name] for name in Tables._fields if name in ready},
        flight_step=h,
        block_k_c=_in_eights(np.array([problem.k, problem.c])),
        observed=float(np.count_nonzero(contact_h * (omega + damping)[:own].max() > OBSERVED_RADIANS)),
        force_following=following(problem, problem.push, 0.0, 4),
        fastest=fastest,
        own_blocks=float(own),
        contact_step=contact_h,
        aliased=blocks.alias.max(axis=2),
        signal_rows=signal_rows,
        power_rows=power_rows,
        loss_rows=loss_rows,
        steady_rate=np.zeros((2 * tones, padded(own))),
        gauss=_gauss_rule(),
    )


def _of_signals(problem: Problem, h: Any, dt_cell: float, kinked: bool) -> dict[str, Any]:
    """The tables of sampled signals on steps h and on their cells, by name."""
    size, response = len(problem.k), following(problem, problem.load, _FOLLOWS / dt_cell)
    cell_error, cell_error_signal = cell_errors(problem, dt_cell, response, kinked)
    return {
        "signal": _in_eights(signal_responses(problem, h).reshape(len(h), len(problem.load), 6, 2, size)),
        "cell": _in_eights(_cell(problem, dt_cell)),
        "cell_signal": _in_eights(quintic_responses(problem, dt_cell)),
        "cell_error": _in_eights(cell_error),
        "cell_error_signal": cell_error_signal,
        "following": _in_eights(response.reshape(-1, 3, 2, size)),
        "follows": float(response.any()),
        "derived": float(response.any() or cell_error_signal[:, :, 2:].any()),
        "load_rows": _in_eights(problem.load.reshape(-1, 2, size)),
        "load_norm": _load_norm(problem),
        "acceleration_signal": _acceleration_by_signal(problem, response),
    }


def _of_rows(problem: Problem) -> dict[str, Any]:
    """The tables of the rows' motion by that of the blocks, and its bounds, by name."""
    size, omega = len(problem.k), np.sqrt(problem.k)
    p, v = np.abs(problem.read[:, :size]), np.abs(problem.read[:, size:])
    return {
        "stop_rows": _in_eights(np.concatenate((problem.read, problem.read_rate), axis=1).reshape(-1, 4, size)),
        "acceleration_weight": _in_eights(_acceleration_weight(problem)),
        "amplitude_weight": _in_eights(_ripple_weight(problem.read, omega)),
        "slowest": _slowest(problem.k),
        "rate_weight": p + v * (omega + problem.c),
        "load_acceleration": problem.read_rate @ problem.load.T,
        "accelerance": -problem.read_rate @ problem.push.T,
    }


@lru_cache(maxsize=1)
def _gauss_rule() -> Any:
    """Points and weights of Gauss's rule on (0, 1), and the weights of integrals from 0 to each point; only read."""
    return np.concatenate((gauss(S), so_far(gauss(S)[0]).T))


def fill_tones(tables: Tables, problem: Problem, tones: int, series: tuple[tuple[float, float], ...]) -> None:
    """Fill the columns of the last blocks of a problem, its ``tones``, into tables that `build` has made."""
    if not tones:
        return
    size = len(problem.k)
    own, k = size - tones, problem.k[size - tones :]
    p, v, omega = np.abs(problem.read[:, own:size]), np.abs(problem.read[:, size + own :]), np.sqrt(k)
    tables.acceleration_weight[:, own:size], tables.rate_weight[:, own:] = p * omega + v * k, p + v * omega
    tables.block_k_c[0, own:size] = k
    tables.ripple_weight[:, own:] = _ripple_weight(problem.read, np.sqrt(problem.k))[:, own:]
    tables.amplitude_weight[:, own:size], tables.slowest[:] = tables.ripple_weight[:, own:], _slowest(problem.k)
    tables.rate_ripple_weight[:, own:] = tables.ripple_weight[:, own:] * np.sqrt(k)
    for i, rows in enumerate((problem.read, problem.read_rate)):
        tables.stop_rows[:, 2 * i : 2 * i + 2, own:size] = rows.reshape(-1, 2, size)[:, :, own:]
    if problem.table_dt.size:
        fill_propagators(problem.k, problem.c, (own, size), problem.table_dt[:1], tables.cell[None])
        tables.cell_error[:, own:size] = np.minimum(*_cell_weights(problem, problem.table_dt[0]))[:, own:]
    blocks = Blocks(*(getattr(tables, name) for name in Blocks._fields))
    filled(blocks, problem, (own, size), tables.flight_step, tables.contact_step, node_sets_of(series))
    tables.aliased[:] = tables.alias.max(axis=2)


def doublings(speeds: Any, tones: Any) -> int:
    """Octaves by which the fastest tone is above the fastest block of a structure, rounded up; 0 if it is slower."""
    ratio = float(tones.max(initial=0.0)) / max(float(speeds.max()), 1e-3)
    return math.ceil(math.log2(max(ratio, 1.0)))


def _steps(omega: Any, damping: Any, tones: int, shortened: int) -> tuple[Any, Any]:
    """Flight and contact steps, s; functions of the structure alone unless a tone is faster than it, or shortened."""
    own = omega.size - tones
    times = doublings((omega + damping)[:own], omega[own:])
    return _steps_of(omega[:own].tobytes(), damping[:own].tobytes(), times, shortened)


@lru_cache(maxsize=64)
def _steps_of(omegas: bytes, dampings: bytes, doublings: int, shortened: int) -> tuple[Any, Any]:
    """The same for the frequencies and dampings of a structure, and tones faster by some octaves."""
    omega, damping = np.frombuffer(omegas), np.frombuffer(dampings)
    fastest = max(float((omega + damping).max()), 1e-3)
    rates = np.concatenate((omega, damping))
    moving = rates[rates > _SLOWEST * fastest]
    fastest *= 2.0**doublings
    longest = 4.0 * math.pi / (moving.min() if moving.size else fastest)
    levels = 2 + math.ceil(4.0 * math.log2(longest * fastest / TAYLOR_REACH))
    h = longest * 2.0 ** (-0.25 * np.arange(levels))
    first = int(np.searchsorted(-h, -_MOST_RADIANS / fastest))
    bottom = math.ceil(4.0 * math.log2(longest / (min(_CONTACT_REACH / fastest, _SHORT) * SHORTER**shortened)))
    return h, longest * 2.0 ** (-0.25 * np.arange(first, bottom + 2, 2))


def _ripples(problem: Problem, h: Any, alias: Any, own: int) -> dict[str, Any]:
    """The tables of what oscillates between the nodes, by name; ``alias`` is that of the smooth nodes."""
    size, omega = len(problem.k), np.sqrt(problem.k)
    weight = _ripple_weight(problem.read, omega)
    ringing = np.hypot(problem.push[:, size:], omega * problem.push[:, :size])
    ringing /= np.where(omega > 0.0, problem.k, np.inf)
    moved = reactions(problem, h, alias, weight * ringing, own)
    return {"ringing": ringing, "reactions": moved, "ripple_weight": weight, "rate_ripple_weight": weight * omega}


def _ripple_weight(read: Any, omega: Any) -> Any:
    """(R, N): amplitude of δ per unit of an oscillating block's rate."""
    p, v = np.abs(read[:, : omega.size]), np.abs(read[:, omega.size :])
    return np.ascontiguousarray(p / np.where(omega > 0.0, omega, np.inf) + v)


def reactions(problem: Problem, h: Any, alias: Any, swing: Any, own: int) -> Any:
    """(R, J, 2) most that a block is moved by the force that it makes between the nodes, per unit of its oscillation.

    An oscillation of rate v moves a row by w v, of which the nodes miss ``alias`` (J, 2N; its second half). So much has
    the force there, times its slope F_δ by δ, or ω F_δ̇. The block follows the polynomial of the force at both ends of
    the step, where it has 2.1 times that, in the mean over all phases: the root of the sum of the squares of Lagrange's
    polynomials. ``swing`` (R, N) is w × rate of the block per newton and second. Damping leaves e^{-ch/2} of it. Given
    are the largest of the first ``own`` blocks, per unit of F_δ and of F_δ̇.
    """
    omega, found = np.sqrt(problem.k[:own]), np.zeros((len(swing), len(h), 2))
    left = _AT_ENDS * alias[:, len(problem.k) :][:, :own] * np.exp(-0.5 * h[:, None] * problem.c[:own])
    for out, row in zip(found, swing[:, :own], strict=True):
        moved = left * (omega * row)
        out[:, 0], out[:, 1] = moved.max(axis=1), (moved * omega).max(axis=1)
    return found


def _acceleration_weight(problem: Problem) -> Any:
    """(R, N): amplitude of δ̈ per unit of a block's energy norm."""
    size, omega, c = len(problem.k), np.sqrt(problem.k), problem.c
    p, v = np.abs(problem.read[:, :size]), np.abs(problem.read[:, size:])
    return p * (omega + c) + v * (problem.k + c * (omega + c))


def _slowest(k: Any) -> Any:
    """Numbers of the slowest blocks, ascending in k."""
    return np.argsort(k, kind="stable")[:_MOST_SLOW].astype(float)


def _load_norm(problem: Problem) -> Any:
    """(L, N): rate at which a unit of a signal can raise a block's energy norm."""
    size = len(problem.k)
    return np.sqrt(problem.load[:, size:] ** 2 + problem.k * problem.load[:, :size] ** 2)


def following(problem: Problem, rates: Any, slowest: float, terms: int = 3) -> Any:
    """(L, terms, 2N) response Σ F_i s⁽ⁱ⁾ that follows signals s, of blocks from ``slowest`` on; zero of the others.

    With ẋ = A x + g s, g the row of ``rates`` (L, 2N), it is F_0 = -A⁻¹g, F_i = A⁻¹F_{i-1}, and what is left,
    d = x - Σ F_i s⁽ⁱ⁾, obeys ḋ = A d - F_m s⁽ᵐ⁺¹⁾, F_m the last.
    """
    n = len(problem.k)
    fast = (problem.k > 0.0) & (np.sqrt(problem.k) >= slowest)
    stiff, c, out = np.where(fast, problem.k, np.inf), problem.c, np.zeros((len(rates), terms, 2, n))
    response = -rates.reshape(-1, 2, n)
    for i in range(terms):
        p, v = response[:, 0], response[:, 1]
        response = np.stack((-(v + c * p) / stiff, np.where(fast, p, 0.0)), axis=1)
        out[:, i] = response
    return out.reshape(-1, terms, 2 * n)


def cell_errors(problem: Problem, h: float, response: Any, kinked: bool) -> tuple[Any, Any]:
    """Weights (R, N) and (R, L, 8) of a bound of how far δ is from its linear interpolant between the ends of a cell.

    A block's share of δ differs from its interpolant by at most h²/8 max|δ̈_b|, and by at most twice its amplitude
    r_b E_b, whichever is smaller. With E_b the largest energy norm, |δ̈_b| <= w_b E_b + |a_b s|, so that

        error <= Σ_b W_b E_b + A |s|max,    W_b = min(w_b h²/8, 2 r_b),    A = |Σ_b a_b| h²/8

    where A is the sum over the blocks whose first bound is taken. As dε_b/dt <= ν_b |s|, E_b <= ε_b + m h ν_b |s|max
    within m cells; what the signal adds is |s|max (A + m G), G = h Σ W_b ν_b. Coupling lets a signal move places of
    blocks by ṗ_b = v_b + b_b s, so that δ̈_b has a part in ṡ too. In the sum over all blocks it is zero, δ̇ being free
    of s; where some take the second bound it adds |ṡ|max |Σ_b d_b b_b| h²/8, summed over these, d_b b_b s in δ̇_b.

    Of blocks that follow the signal E_b is that of d, see `following`, W_b = 2 r_b, dε_b/dt <= μ_b |s⃛|, and the rest
    is c_0 s + c_1 ṡ + c_2 s̈, which adds |s̈|max (h²/8 |c_0| + 2 |c_2|) + |s⃛|max (h²/8 |c_1| + m h Σ W_b μ_b). Where ṡ
    and s̈ of ``kinked`` signals jump, by at most twice their largest values, d jumps by F_1 and F_2 times that, which
    adds 2 m Σ W_b (|F_1|_b |ṡ|max + |F_2|_b |s̈|max). Returned are W, then A, G, the three factors before, that of the
    part in ṡ, and these two.
    """
    follows, growth = _left_over(response, problem.k)
    jump = follows * (2.0 if kinked else 0.0)
    bent, both = _cell_weights(problem, h)
    oscillates = follows | (both < bent)
    weight = np.where(oscillates, both, bent)
    jumps = ((jump * weight) @ _norms_of_response(response, problem.k)[:, i].T for i in (1, 2))
    rate = np.where(np.tile(oscillates, 2), 0.0, problem.read_rate)
    at_once = np.abs(rate @ problem.load.T) * (h * h / 8.0)
    moved = np.abs(np.where(np.tile(oscillates, 2), problem.read, 0.0) @ problem.load.T) * (h * h / 8.0)
    place = np.abs(problem.read @ response.transpose(1, 2, 0))  # (3, R, L): |c_0|, |c_1|, |c_2|
    factors = (
        *(at_once, h * np.where(follows, 0.0, weight) @ _load_norm(problem).T),
        *(h * h / 8.0 * place[0] + 2.0 * place[2], h * h / 8.0 * place[1], h * (follows * weight) @ growth.T),
        *(moved, *jumps),
    )
    return weight, np.stack(factors, axis=2)


def _cell_weights(problem: Problem, h: float) -> tuple[Any, Any]:
    """(R, N) each: w_b h²/8 and, of blocks that oscillate, 2 r_b, see `cell_errors`; else inf."""
    both = 2.0 * _ripple_weight(problem.read, np.sqrt(problem.k))
    return _acceleration_weight(problem) * (h * h / 8.0), np.where(problem.k > 0.0, both, np.inf)


def _left_over(response: Any, k: Any) -> tuple[Any, Any]:
    """(N,) whether a block follows a signal; (L, N) μ, the rate at which s⃛ raises the energy norm of what is left."""
    norms = _norms_of_response(response, k)
    return norms.any(axis=(0, 1)), norms[:, 2]


def _norms_of_response(response: Any, k: Any) -> Any:
    """(L, 3, N) energy norms of F_0, F_1 and F_2."""
    parts = response.reshape(len(response), 3, 2, len(k))
    return np.hypot(parts[:, :, 1], np.sqrt(k) * parts[:, :, 0])


def _acceleration_by_signal(problem: Problem, response: Any) -> Any:
    """(R, L, 5): what signals add to a bound of |δ̈| during a time t: by |s|, |s| t, |ṡ|, |s̈| and |s⃛| t.

    With what follows the signal taken off, δ̈ of a block is (its row of δ̇)·(A d + F_0 ṡ + F_1 s̈).
    """
    follows, growth = _left_over(response, problem.k)
    weight = _acceleration_weight(problem)
    rate = np.where(np.tile(follows, 2), 0.0, problem.read_rate)
    moved = np.abs(problem.read_rate @ response.transpose(1, 2, 0))
    factors = (
        *(np.abs(rate @ problem.load.T), np.where(follows, 0.0, weight) @ _load_norm(problem).T),
        *(moved[0], moved[1], (follows * weight) @ growth.T),
    )
    return np.stack(factors, axis=2)


def _in_eights(rows: Any) -> Any:
    """Rows with zeros up to a multiple of eight."""
    out = np.zeros((*rows.shape[:-1], padded(rows.shape[-1])))
    out[..., : rows.shape[-1]] = rows
    return out


def _cell(problem: Problem, dt: float) -> Any:
    """(2, N): α, β of every block over a cell of the sampled signals."""
    out = np.empty((1, 2, len(problem.k)))
    fill_propagators(problem.k, problem.c, (0, len(problem.k)), np.array([dt]), out)
    return out[0]
