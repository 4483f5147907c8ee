"""Orbits and branches of laws with memory: against exact pieces, long runs, differences, closed forms."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from differences import central, jacobian
from oscillators import Tone, from_phase, state_after, state_at_zero
from problems import paper_scene
from scipy.optimize import root

import fembeam as fb
from contacts import PiecewiseLinear
from contacts.memory import BoucWen, Coulomb, ElastoPlastic, Iwan, Jenkins, WaltonBraun
from solvers import Contact, Exponential, System, branch, integrate, orbit
from solvers.orbits import PeriodicProblem


@cache
def driven(law, damping, direction, gap):
    """An oscillator whose tables serve all loads."""
    contact = Contact([direction], law, gap=gap, always=True)
    return System([[1.0]], [[damping]], [[1.0]], [contact], [([1.0], Tone(1.0, 1.0))])


def oscillator(law, omega, force=1.0, damping=0.02, direction=-1.0, gap=0.0):
    """q'' + c q' + q + F = f cos Ωt; period."""
    loads = [([1.0], Tone(force, omega))]
    return driven(law, damping, direction, gap).like(loads=loads), 2.0 * math.pi / omega


def beam(omega, *contacts):
    """Three modes under a tone; period."""
    loads = [([1.0, 0.3, 0.2], Tone(1.5, omega))]
    return System.modal([1.0, 3.7, 9.0], [0.01, 0.01, 0.02], contacts, loads), 2.0 * math.pi / omega


def element(law, *direction):
    """A contact that always acts."""
    return Contact(direction, law, always=True)


@dataclass(frozen=True)
class Pieces:
    """q'' + c q' + q + F = f cos Ωt with a Jenkins slider of k and limit: half a period of slip, then stick, exactly.

    The motion is odd: q(t + T/2) = -q(t). Unknowns are the time t₁ of the upper turning point, q there, and the time
    t₂ at which stick ends.
    """

    omega: float
    stiffness: float
    limit: float
    force: float = 1.0
    damping: float = 0.02

    def flow(self, k, offset, t, begin, x):
        """State after t of q'' + c q' + k q + offset = f cos Ω(begin + t), and its derivative by the first."""
        c, w = self.damping, self.omega
        a = self.force / complex(k - w * w, c * w)

        def steady(s):
            z = a * np.exp(1j * w * s)
            return np.array([z.real - offset / k, (1j * w * z).real])

        m, g = math.sqrt(k - 0.25 * c * c), 0.5 * c
        cos, sin = math.cos(m * t), math.sin(m * t) / m
        matrix = math.exp(-g * t) * np.array([[cos + g * sin, sin], [-k * sin, cos - g * sin]])
        return steady(begin + t) + matrix @ (x - steady(begin)), matrix

    def half(self, t1, q, t2):
        """From the turning point at t₁: state where stick ends, then that half a period after t₁."""
        s = q - self.limit / self.stiffness
        k, rest = 1.0 + self.stiffness, math.pi / self.omega - (t2 - t1)
        middle, _ = self.flow(k, -self.stiffness * s, t2 - t1, t1, np.array([q, 0.0]))
        end, _ = self.flow(1.0, -self.limit, rest, t2, middle)
        return middle, end

    def orbit(self, guess):
        """(t₁, q, t₂) of the odd motion."""

        def miss(u):
            middle, end = self.half(*u)
            return [self.stiffness * (middle[0] - u[1]) + 2.0 * self.limit, end[0] + u[1], end[1]]

        found = root(miss, guess, tol=1e-14)
        assert np.abs(miss(found.x)).max() < 1e-12
        return found.x

    def multipliers(self, t1, q, t2):
        """Squares of those of half a period, x = (q, q', s) just after the turning point, at right angles to s."""
        k, kt = 1.0 + self.stiffness, self.stiffness
        _, first = self.flow(k, -kt * (q - self.limit / kt), t2 - t1, t1, np.array([q, 0.0]))
        middle, _ = self.half(t1, q, t2)
        _, second = self.flow(1.0, -self.limit, math.pi / self.omega - (t2 - t1), t2, middle)
        by_s = kt / k * (np.array([1.0, 0.0]) - first[:, 0])  # the state of rest follows s
        state = second @ np.column_stack((first, by_s))  # force continuous: no jump
        whole = -np.vstack((state, state[0]))  # s follows q where q' = 0; odd
        return np.linalg.eigvals(whole @ whole)


JENKINS = Jenkins(4.0, 0.5)


@pytest.mark.parametrize("omega", [0.7, 0.9, 1.3])
def test_jenkins_orbit_is_that_of_its_exact_pieces(omega):
    system, period = oscillator(JENKINS, omega)
    found = orbit(system, period)
    log = found.transitions
    assert log.event.tolist().count("stick") == 2 == log.event.tolist().count("slip")
    up = next(i for i in range(4) if log.event[i] == "stick" and log.force[i] > 0.0)
    after = min((t for t, event in zip(log.t, log.event, strict=True) if event == "slip" and t > log.t[up]), default=0)
    t2 = after or log.t[log.event == "slip"].min() + period
    pieces = Pieces(omega, 4.0, 0.5)
    t1, q, t2 = pieces.orbit([log.t[up], log.delta[up], t2])
    assert abs(log.t[up] - t1) < 1e-9
    assert abs(log.delta[up] - q) < 1e-10
    later = state_after(system, found.whole, t1 - found.phase, Exponential(1e-12))
    assert abs(later[:2] - [q, 0.0]).max() < 1e-10
    exact = pieces.multipliers(t1, q, t2)
    exact = exact[np.argsort(-abs(exact))]
    assert found.multipliers[2] == 0.0
    assert found.forgotten == 1
    assert abs(exact[2]) < 1e-12
    assert abs(np.poly(found.multipliers) - np.poly(exact)).max() < 1e-8
    assert not found.family
    assert not found.doubt


def test_jenkins_orbit_is_what_a_long_run_settles_to():
    system, period = oscillator(JENKINS, 0.9)
    found, run = orbit(system, period), integrate(system, [0.0], [0.0], 200 * period, method=Exponential(1e-12))
    assert abs(found.state - [run.q[-1, 0], run.q_dot[-1, 0]]).max() < 1e-9
    assert abs(found.memory[0] - run.memory[0]).max() < 1e-9
    samples = found.samples(10)
    assert abs(samples.q[-1] - samples.q[0]).max() < 1e-9
    again = orbit(system, period, found.whole, shots=2)
    assert abs(again.state - found.state).max() < 1e-8
    assert abs(np.poly(again.multipliers) - np.poly(found.multipliers)).max() < 1e-7


def den_hartog(omega, limit):
    """Amplitude of q'' + q + limit sgn q' = cos Ωt without stops: J.P. Den Hartog, Trans. ASME 53 (1931) 107."""
    u = math.sin(math.pi / omega) / (omega * (1.0 + math.cos(math.pi / omega)))
    return math.sqrt((1.0 / (1.0 - omega**2)) ** 2 - (limit * u) ** 2)


def with_stops(omega, limit, guess):
    """The same with one stop per half period: (amplitude, end of the stop, end of the slip), by the exact slip."""

    def miss(u):
        (X, begin, end), a = u, 1.0 / (1.0 - omega**2)
        c, s = X - limit - a * math.cos(omega * begin), a * omega * math.sin(omega * begin)
        turn = end - begin
        q = a * math.cos(omega * end) + limit + c * math.cos(turn) + s * math.sin(turn)
        v = -a * omega * math.sin(omega * end) - c * math.sin(turn) + s * math.cos(turn)
        return [math.cos(omega * begin) - X + limit, q + X, v]

    found = root(miss, guess, tol=1e-14)
    assert np.abs(miss(found.x)).max() < 1e-12
    return found.x


def dry(omega, limit, stiffness, damping=0.0):
    """Orbit with dry friction behind a stiff contact, and its amplitude."""
    found = orbit(*oscillator(Coulomb(limit, stiffness, damping=damping), omega, damping=0.0))
    assert len(found.transitions) == 4
    return found, abs(found.transitions.delta).max()


@pytest.mark.parametrize(("omega", "limit"), [(0.7, 0.3), (1.5, 0.3)])
def test_dry_friction_without_stops_comes_to_den_hartogs_like_the_root_of_the_stiffness(omega, limit):
    errors = [abs(dry(omega, limit, k)[1] - den_hartog(omega, limit)) for k in (4e2, 1.6e3, 6.4e3)]
    slopes = np.diff(np.log(errors)) / math.log(4.0)
    assert abs(slopes + 0.5).max() < 0.02
    assert errors[-1] < 5e-3


@pytest.mark.parametrize(("omega", "limit"), [(0.6, 0.85), (0.5, 0.7)])
def test_dry_friction_with_stops_comes_to_the_exact_amplitude(omega, limit):
    """A damped contact lets the amplitude, a turning point, come like 1/k."""
    errors = []
    for k in (1e2, 4e2, 1.6e3):
        found, amplitude = dry(omega, limit, k, 2.0 * math.sqrt(k))
        log = found.transitions
        begin = log.t[log.delta.argmax()] + 0.12 * found.period
        exact, *_ = with_stops(omega, limit, [log.delta.max(), begin, begin + 0.45 * found.period])
        errors.append(abs(amplitude - exact))
    slopes = np.diff(np.log(errors)) / math.log(4.0)
    assert abs(slopes + 1.0).max() < 0.05
    assert errors[-1] < 3e-3


def differenced(found, step=1e-6):
    """Derivative of the return map by the real numbers of the state, central."""
    later, x = from_phase(found), found.whole
    whole = [i for i in range(len(x)) if i < 2 * found.system.size or x[i] != round(x[i])]

    def end(numbers):
        moved = x.copy()
        moved[whole] = numbers
        return state_after(later, moved, found.period, Exponential(1e-12))[whole]

    return jacobian(end, x[whole], step, central)


PAIR = element(Jenkins(50.0, 0.1), -1.0, -0.5, 0.3), element(Jenkins(30.0, 0.08), -0.2, 0.9, -0.5)
MIXED = (
    element(BoucWen(20.0, 0.2, 1.0, 3.0, 1.0, n=2), -1.0, -0.5, 0.3),
    element(ElastoPlastic(20.0, 0.1, 5.0), -0.2, 0.9, -0.5),
)


@pytest.mark.parametrize("contacts", [PAIR, MIXED])
def test_multipliers_against_differences_of_the_return_map(contacts):
    found = orbit(*beam(1.3, *contacts))
    wanted = differenced(found)
    assert abs(found.monodromy - wanted).max() < 1e-6 * max(1.0, abs(wanted).max())
    assert found.forgotten == len(found.monodromy) - np.linalg.matrix_rank(wanted, 1e-6) > 0


def test_two_sliders_that_slip_leave_a_return_map_of_rank_two():
    """(q, q', s₁, s₂) of one mass: each slider forgets."""
    found = orbit(*oscillator(Iwan([25.0, 25.0], [0.1, 0.3]), 0.9))
    assert found.monodromy.shape == (4, 4)
    assert found.forgotten == 2
    assert not found.family
    assert np.linalg.matrix_rank(found.monodromy, 1e-9) == 2
    assert np.sum(found.multipliers == 0.0) == 2


def test_a_stuck_slider_is_one_of_a_family():
    """Linear then: amplitude and multipliers in closed form, whatever the slider's place."""
    system, period = oscillator(Jenkins(4.0, 50.0), 0.9)
    for place in (0.0, 0.3):
        found = orbit(system, period, [0.1, 0.0, 0.0, place])
        assert found.family == ((0, 1),)
        assert found.memory[0].tolist() == [0.0, place]
        assert not found.forgotten
        assert found.multipliers[0] == 1.0
        assert found.stable
        assert "family" in repr(found)
        z = 1.0 / complex(5.0 - 0.81, 0.018)
        assert abs(found.state - [0.8 * place + z.real, (0.9j * z).real]).max() < 1e-10
        assert abs(abs(found.transverse) - math.exp(-0.01 * period)).max() < 1e-9


@pytest.mark.parametrize(
    "law", [BoucWen(4.0, 0.2, 1.0, 2.0, 1.0, n=1), BoucWen(4.0, 0.2, 1.0, 4.0, -1.0, n=2)], ids=["n = 1", "n = 2"]
)
def test_bouc_wen_orbit_is_what_a_long_run_settles_to(law):
    system, period = oscillator(law, 0.7, damping=0.1)
    found, run = orbit(system, period), integrate(system, [0.0], [0.0], 200 * period, method=Exponential(1e-12))
    assert found.forgotten == 1
    assert abs(found.multipliers[2]) > 0.1
    assert abs(found.state - [run.q[-1, 0], run.q_dot[-1, 0]]).max() < 1e-8


def test_a_yielded_stop_after_shakedown_is_one_of_a_family():
    """It has yielded to F_p and is elastic from then on: a spring k₂ behind the set."""
    system, period = oscillator(WaltonBraun(4.0, 9.0), 0.7, damping=0.1)
    spring = Contact([-1.0], PiecewiseLinear([9.0]), gap=8.0 * (1.0 / 4.0 - 1.0 / 9.0))
    same = orbit(system.like(contacts=[spring]), period)
    found = orbit(system, period, [*state_at_zero(same), 0.0, 8.0])
    assert found.family == ((0, 1),)
    assert found.memory[0][1] == 8.0
    assert len(found.contacts) == 1
    assert abs(found.contacts.t_in - same.contacts.t_in).max() < 1e-8
    assert abs(state_at_zero(found)[:2] - state_at_zero(same)).max() < 1e-9
    assert abs(np.sort_complex(found.transverse) - np.sort_complex(same.multipliers)).max() < 1e-7


def hardly_slipping(omega):
    """The slider under a load by which it slips around resonance alone."""
    return oscillator(JENKINS, omega, force=0.3)


def test_branch_against_runs():
    """Amplitudes of a slider's branch over the frequency are what runs settle to; its ends stick."""
    found = branch(hardly_slipping, (1.3, 3.0), orbit(*hardly_slipping(2.2)), at=2.2).run()
    assert [status.name for status in found.status] == ["END", "END"]
    assert {len(one.transitions) for one in found.orbits} >= {0, 4}
    assert [one.mark for one in found.special].count("stick") >= 2
    assert found.orbits[0].family
    assert found.orbits[-1].family
    slipping = [one for one in found.orbits if len(one.transitions) == 4]
    for one in slipping[:: len(slipping) // 3]:
        run = integrate(from_phase(one), [0.0], [0.0], 300 * one.period, method=Exponential(1e-11))
        assert abs(one.state - [run.q[-1, 0], run.q_dot[-1, 0]]).max() < 1e-6
        assert one.residual < 1e-9


def test_a_branch_goes_on_where_a_stuck_slider_begins_to_slip():
    """One of a family, met on one side, pushes its slider on until both sides slip; it does not lead back.

    Where the slider slips the motion forgets where it began.
    """
    at = 1.3
    first = orbit(*hardly_slipping(at)).whole
    first[-1] += 0.02
    found = branch(hardly_slipping, (at - 0.05, 1.8), orbit(*hardly_slipping(at), first), at=at).run()
    assert (found.orbits[0].parameter, found.orbits[-1].parameter) == (at - 0.05, 1.8)
    assert found.endings == ("reached the end of the span",) * 2
    last = found.orbits[-1]
    assert len(last.transitions) == 4
    run = integrate(from_phase(last), [0.0], [0.0], 300 * last.period, method=Exponential(1e-11))
    assert abs(last.state - [run.q[-1, 0], run.q_dot[-1, 0]]).max() < 1e-6


def test_a_branch_says_where_it_turned_round_or_was_lost():
    """In words, with the parameter of the last orbit and what may be why."""
    found = branch(hardly_slipping, (1.2, 3.0), orbit(*hardly_slipping(2.2)), at=2.2)
    walk, status = found.walks[1], type(found.status[1])
    walk.status = status.LOST
    assert found.endings[1].startswith("lost: no orbit was found")
    assert "; the last orbit, at 2.2, has multipliers up to" in found.endings[1]
    walk.status = status.END
    assert found.endings[1] == "reached the end of the span: turned round at 2.2, came to 2.2"


def test_phases_that_come_and_go_are_located():
    """A phase of stick within slip is born where the rate there comes to zero: the branch passes, and marks it."""

    def family(omega):
        return oscillator(JENKINS, omega)

    found = branch(family, (0.42, 0.47), orbit(*family(0.46)), at=0.46).run()
    born = [one for one in found.special if one.mark == "stick"]
    assert born
    assert abs(born[-1].parameter - 0.445505) < 1e-5
    for one in found.orbits:  # at the very point the phase has no length: rounding decides how often it is entered
        if 0.4345 < one.parameter < 0.4455:
            assert len(one.transitions) == 8
    assert {len(o.transitions) for o in found.orbits if o.parameter > 0.446} == {4}
    phases = np.diff(np.sort(born[-1].transitions.t))
    assert phases.min() < 1e-3 * born[-1].period


def test_branch_of_a_beam_with_friction_is_saved_and_gone_on_with(tmp_path):
    slider = fb.Element(0.2, Jenkins(300.0, 0.1))
    model = paper_scene(fb.Harmonic(1e-3, 250.0), masses=(), stops=(), elements=[slider]).reduce(modes=2)
    start = model.orbit()
    assert "forgets" in str(start)
    assert len(start.transitions) >= 4
    end = model.simulate(400 * start.found.period).q[-1] @ model.phi(0.2)
    assert abs(end - start.run.displacement(0.2)[0]) < 1e-6 * abs(start.run.displacement(0.2)).max()
    first = model.branch("omega", (245.0, 255.0), start=start, at=250.0)
    for _, one in zip(range(3), first, strict=False):
        assert one.stable
    first.save(tmp_path / "branch.npz")
    whole, resumed = first.run(), model.resume(tmp_path / "branch.npz").run()
    assert abs(whole.orbits[-1].found.whole - resumed.orbits[-1].found.whole).max() < 1e-8
    assert whole.parameter[-1] == resumed.parameter[-1] == 255.0


def test_slopes_by_a_parameter_of_the_matrices_know_what_is_latched():
    """The parameter is a stiffness: differences of runs that begin with the orbit's latched numbers."""

    def family(stiffness):
        system, period = oscillator(JENKINS, 0.9)
        return System(system.M, system.C, [[stiffness]], system.contacts, system.loads), period

    x, step = orbit(*family(1.0)).whole, 1e-6
    chain = PeriodicProblem(family, Exponential(1e-12), step=step).evaluate(x[None, :], 1.0)
    sides = [family(1.0 + side * step) for side in (-1.0, 1.0)]
    ends = [state_after(system, x, period, Exponential(1e-12)) for system, period in sides]
    wanted = (ends[1] - ends[0]) / (2.0 * step)
    assert abs(chain.by_parameter[0] - wanted).max() < 1e-6
    assert abs(chain.by_parameter[0, 3]) > 1e-3


def test_a_start_of_another_length_is_refused():
    system, period = oscillator(JENKINS, 0.9)
    with pytest.raises(ValueError, match=r"2 finite numbers .* or 4 with what is latched"):
        orbit(system, period, [0.0, 0.0, 0.0])


def test_smooth_hysteresis_has_no_marks_of_rounding():
    """z latched as 0 came back from Newton's method as 1e-20, of either sign, and was met as a border at t = 0."""

    def made(omega):
        law, load = BoucWen(0.2, 0.1, 1.0, 6.0, 4.0), fb.Harmonic(0.6, omega)
        return System.modal([1.0], [0.03], [Contact([1.0], law, always=True)], [([1.0], load)]), 2.0 * np.pi / omega

    found = branch(made, (0.69, 0.76), orbit(*made(0.69)), at=0.69).run()
    assert not found.special
    assert {tuple(one.transitions.event) for one in found.orbits} == {("reversal", "zero") * 2}
