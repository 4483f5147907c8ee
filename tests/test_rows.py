"""Elements and rows: an element that has further rows, on which it does nothing, takes part in a run as before.

So whatever is looked up by row instead of by element, or the other way, finds another number.
"""

import numpy as np
import pytest
from test_many_stops import LAWS, NOISE, TONE, tube

from contacts import Jenkins, KelvinVoigt, WaltonBraun
from solvers import Contact, DormandPrince, Exponential, Parameter, System, integrate, integrate_many

START = 1.0 / np.arange(1, 7) ** 3
Q, V = 2e-5 * START, 0.3 * START
SMOOTH = [LAWS[i] for i in (0, 1, 2, 4, 5)]  # without that of an infinite slope at the surface, which has no tangent


class WithIdleRows(Contact):
    """A contact with one to three rows, of which the first acts."""

    @property
    def rows(self):
        idle = np.zeros((round(1e4 * abs(self.gap)) % 3, self.direction.size))
        return np.concatenate((self.direction[None], idle))


def widened(system):
    """The same system of such contacts."""
    contacts = [WithIdleRows(c.direction, c.law, c.gap, c.always) for c in system.contacts]
    other = System(system.M, system.C, system.K, contacts, system.loads)
    assert sum(len(c.rows) for c in contacts) > len(contacts)
    return other


def with_memory():
    """Two stops, one that yields, and a slider that is fixed to the tube."""
    plain = tube(2, (TONE,))
    number = np.arange(1, 7)
    slider = Contact(np.sin(0.37 * np.pi * number), Jenkins(3e4, 0.4), 2e-4, always=True)
    yielding = Contact(-np.sin(0.21 * np.pi * number), WaltonBraun(2e5, 6e5, "kept"), 1e-4)
    return plain.like(contacts=(*plain.contacts, slider, yielding))


def same(one, other):
    """Ends, logs, transitions, energies and derivatives, each in units of its largest; steps and law calls too."""
    for name in ("steps", "law_calls", "events"):
        assert getattr(one.cost, name) == getattr(other.cost, name)
    assert len(one.contacts.t_in) > 1
    assert np.array_equal(one.contacts.stop, other.contacts.stop)
    pairs = [(one.q, other.q), (one.q_dot, other.q_dot), (one.transitions.t, other.transitions.t)]
    pairs += [
        (getattr(one.contacts, name), getattr(other.contacts, name))
        for name in ("t_in", "t_out", "peak_indentation", "peak_force", "impulse", "energy_loss")
    ]
    pairs += [(getattr(one.energy, name), getattr(other.energy, name)) for name in ("input", "damping", "contact")]
    if one.tangent is not None:
        pairs.append((one.tangent, other.tangent))
    for a, b in pairs:
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-9 * np.nanmax(np.abs(b), initial=0.0))


@pytest.mark.parametrize("options", [{"dt": 1e-4}, {"tangent": True}], ids=["sampled", "tangent"])
@pytest.mark.parametrize("stops", [1, 2, 6])
def test_idle_rows_change_nothing(stops, options):
    """Up to two rows there are tables of pairs, beyond forces act through blocks: rows change one for the other."""
    system, way = tube(stops, (TONE, NOISE), laws=SMOOTH), -1.0 if stops == 1 else 1.0  # towards a stop
    one, other = (
        integrate(s, Q, way * V, 0.05, method=Exponential(1e-9), **options) for s in (system, widened(system))
    )
    same(one, other)


@pytest.mark.parametrize("options", [{"dt": 1e-4}, {"tangent": True}], ids=["sampled", "tangent"])
def test_idle_rows_change_nothing_with_memory(options):
    system = with_memory()
    one, other = (integrate(s, Q, V, 0.05, method=Exponential(1e-9), **options) for s in (system, widened(system)))
    assert len(one.transitions.t) > 3
    same(one, other)


def test_idle_rows_change_nothing_for_a_stepping_method():
    """The one that takes contacts of several rows."""
    system = tube(4, (TONE,))
    same(*(integrate(s, Q, V, 0.02, 1e-3, DormandPrince(1e-8)) for s in (system, widened(system))))


def test_idle_rows_change_nothing_of_a_strong_dashpot():
    """Newton's method solves for the forces."""
    system = tube(6, (TONE,), laws=[LAWS[2], KelvinVoigt(4e4, 400.0)])
    same(*(integrate(s, Q, V, 0.05, method=Exponential(1e-9), tangent=True) for s in (system, widened(system))))


def test_gaps_of_many_starts_belong_to_elements():
    system, factors = tube(3), np.linspace(1.0, 2.0, 5)
    gaps = np.outer(factors, [1e-4, 2e-4, 3e-4])
    one, other = (
        integrate_many(s, np.outer(factors, Q), np.outer(factors, V), 0.03, gaps=gaps)
        for s in (system, widened(system))
    )
    np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-9 * np.abs(one.q).max())
    np.testing.assert_allclose(one.peak_force, other.peak_force, rtol=1e-6)


def test_derivative_by_a_gap_belongs_to_an_element():
    system, step = tube(3, laws=SMOOTH), 1e-7

    def shifted(system, change):
        contacts = list(system.contacts)
        first = contacts[1]
        contacts[1] = type(first)(first.direction, first.law, first.gap + change, first.always)
        return system.like(contacts=contacts)

    ends = []
    for s in (system, widened(system)):
        parameter = Parameter(shifted(s, -step), shifted(s, step), step)
        ends.append(integrate(s, Q, V, 0.03, method=Exponential(1e-9), tangent=parameter).tangent[:, -1])
    np.testing.assert_allclose(*ends, rtol=0.0, atol=1e-8 * np.abs(ends[0]).max())
