"""Contact force as the mean over each sample: impulses to rounding, the mean of finely sampled forces, bad input."""

import numpy as np
import pytest
from problems import PAPER_BEAM, TIP, paper_scene

import fembeam as fb
from contacts import BoucWen, Hertz, Jenkins, KelvinVoigt, WaltonBraun
from fembeam.study.measure import cut
from solvers import Exponential


def scene(*stops, **more):
    parts = {"damping": fb.ModalDamping(0.02), "base": fb.Harmonic(1e-3, 195.0), **more}
    return fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], stops=list(stops), **parts)


@pytest.mark.parametrize("dt", [1e-2, 1e-3, 1e-4, 1.3e-5])
def test_impulses_are_kept_whatever_the_sampling(dt):
    below, above = fb.Stop(TIP, KelvinVoigt(1e5, 20.0), gap=1e-4), fb.Stop(0.15, Hertz(1e8), gap=1e-5, side="above")
    run = scene(below, above).reduce(3).simulate(0.2, dt)
    for stop in (0, 1, -1):
        mean, log = run.force(stop, mean=True), run.contacts
        impulses = log.impulse[log.stop == stop % 2]
        assert len(impulses) > 3
        assert np.trapezoid(mean, run.t) == pytest.approx(impulses.sum(), rel=1e-12)
        assert mean.min() >= (-20.0 * log.speed_out.max() if stop == 0 else 0.0)  # the dashpot pulls
        assert mean.max() <= log.peak_force[log.stop == stop % 2].max()


def test_it_is_the_mean_of_the_force_sampled_finely():
    model = scene(fb.Stop(TIP, Hertz(2e6))).reduce(2)  # contacts of some ms
    fine, coarse = model.simulate(0.2, 1e-6), model.simulate(0.2, 2e-4)
    force, cell = fine.force(), 200
    whole = np.concatenate([[0.0], np.cumsum((force[1:] + force[:-1]) / 2)]) * 1e-6
    edges = np.concatenate([[0], np.arange(cell // 2, len(force), cell), [len(force) - 1]])
    expected = np.diff(whole[edges]) / np.diff(fine.t[edges])
    np.testing.assert_allclose(coarse.force(mean=True), expected, atol=2e-4 * expected.max())


def test_contacts_cut_by_start_and_end_and_samples_of_ones_own():
    pressed = scene(fb.Stop(TIP, Hertz(1e7), gap=-1e-4), base=None).reduce(2)
    run = pressed.simulate(0.01, 1e-3, start=pressed.equilibrium())
    np.testing.assert_allclose(run.force(mean=True), run.force(), rtol=1e-6)
    model = paper_scene().reduce(2)
    whole = model.simulate(0.1, 1e-4)
    cut = whole.contacts.t_in[1] + 1e-4
    part = model.simulate(cut, np.linspace(0.0, cut, 12))
    assert np.isnan(part.contacts.t_out[-1])
    assert np.trapezoid(part.force(mean=True), part.t) == pytest.approx(part.contacts.impulse.sum(), rel=1e-12)
    late = model.simulate(0.1, np.linspace(0.04, 0.1, 61))
    seen = late.contacts.impulse[late.contacts.t_in > 0.04].sum()
    assert np.trapezoid(late.force(mean=True), late.t) == pytest.approx(seen, rel=1e-12)


@pytest.mark.parametrize("dt", [1e-3, 2e-4])
def test_a_contact_under_way_at_the_first_sample_keeps_what_is_left_of_its_impulse(dt):
    """Of a part of a run, and of a run sampled late, against forces sampled finely."""
    model = scene(fb.Stop(TIP, Hertz(2e6))).reduce(2)  # contacts of some ms
    fine, run = model.simulate(0.2, 1e-6), model.simulate(0.2, dt)
    grown = np.append(0.0, np.cumsum(fine.force()[1:] + fine.force()[:-1])) * 0.5e-6
    log, cell = run.contacts, round(dt / 1e-6)
    open_at = np.flatnonzero(run.force() > 0.0)
    assert len(log) > 5
    for first, last in ((open_at[0], open_at[-1]), (open_at[1], open_at[1] + 1), (open_at[3], len(run.t) - 1)):
        edges = np.arange(first, last + 1) * cell
        edges = np.concatenate([edges[:1], (edges[1:] + edges[:-1]) // 2, edges[-1:]])
        expected = np.diff(grown[edges]) / np.diff(fine.t[edges])
        part = cut(run, run.t[first], run.t[last])
        late = model.simulate(0.2, run.t[first : last + 1])
        for one in (part, late):
            found = one.force(mean=True)
            np.testing.assert_allclose(found, expected, atol=5e-3 * expected.max())
            assert np.trapezoid(found, one.t) == pytest.approx(grown[edges[-1]] - grown[edges[0]], rel=1e-6)


@pytest.mark.parametrize("law", [KelvinVoigt(1e5, 20.0), Hertz(1e7)])
def test_what_comes_after_the_last_sample_is_left_out(law):
    """A stop that stays pressed: the impulse is that of all forces up to the last sample, 0.4 dt before the end."""
    model = scene(fb.Stop(TIP, law, gap=-2e-4), base=fb.Harmonic(1e-5, 195.0)).reduce(2)
    run = model.simulate(0.0324, 1e-3, start=model.equilibrium())
    assert np.isnan(run.contacts.t_out).all()
    to_there = model.simulate(0.032, 1e-3, start=model.equilibrium())
    assert np.trapezoid(run.force(mean=True), run.t) == pytest.approx(to_there.contacts.impulse.sum(), rel=1e-9)
    np.testing.assert_allclose(run.force(mean=True), to_there.force(mean=True), rtol=1e-9)


@pytest.mark.parametrize("damping", [0.0, 3.0])
def test_a_contact_over_many_samples_is_shared_as_its_law_says(damping):
    """Of a spring and a dashpot, which pulls at last; cubics are exact to dt⁴: the mean is that by Simpson's rule."""
    run = scene(fb.Stop(TIP, KelvinVoigt(1e3, damping), gap=1e-4)).reduce(1).simulate(0.2, 2e-4)
    fine = run.readout.model.simulate(0.2, 1e-4).force()
    t, among = run.t, slice(1, -1)
    log, held = run.contacts, np.zeros(len(t), dtype=bool)
    for t_in, t_out in zip(log.t_in, log.t_out, strict=True):
        held |= (t > t_in + 3e-4) & (t < t_out - 3e-4)
    expected = (fine[1:-3:2] + 4 * fine[2:-2:2] + fine[3:-1:2]) / 6
    assert held.sum() > 100
    found = run.force(mean=True)[among][held[among]]
    np.testing.assert_allclose(found, expected[held[among]], atol=1e-6 * expected.max())
    assert (found.min() < -1e-2 * found.max()) == (damping > 0.0)


@pytest.mark.parametrize(
    "part",
    [
        fb.Element(TIP, KelvinVoigt(300.0, 1.0)),
        fb.Element(TIP, Jenkins(300.0, 0.15)),
        fb.Element(TIP, BoucWen(300.0, 0.1, 1.0, 1e3, 500.0)),
        fb.Stop(TIP, WaltonBraun(300.0, 600.0), gap=1e-4),
    ],
)
def test_impulses_of_what_always_acts_are_kept_whatever_the_sampling(part, tmp_path):
    """Against the sum of forces so finely sampled that it is right to 1e-7 of their size; cubics miss up to 4 %."""
    parts = {"stops": [part]} if isinstance(part, fb.Stop) else {"elements": [part]}
    drive = fb.Harmonic(2e-3, 195.0, 0.7)
    model = fb.Scene(PAPER_BEAM, [fb.Clamped(0.0)], damping=fb.ModalDamping(0.02), base=drive, **parts).reduce(1)
    method, duration, count = Exponential(1e-10), 0.2, 40_000
    fine = model.simulate(duration, duration / count, solver=method)
    grown = np.append(0.0, np.cumsum(fine.force()[1:] + fine.force()[:-1])) * duration / count / 2
    size = np.abs(np.diff(grown)).sum()
    uneven = np.sort(np.random.default_rng(1).choice(np.arange(count + 1), 30, replace=False))
    for at in (np.arange(0, count + 1, count // 20), uneven):
        run = model.simulate(duration, fine.t[at], solver=method)
        expected = grown[at[-1]] - grown[at[0]]
        for one in (run, fb.load(run.save(tmp_path / "run"))):
            assert np.trapezoid(one.force(mean=True), one.t) == pytest.approx(expected, abs=1e-6 * size)
        impulses = run.losses.part(slice(5, None)).impulses[:, 0]
        np.testing.assert_allclose(impulses, grown[at[5:]] - grown[at[5]], atol=1e-6 * size)


def test_bad_input():
    model = paper_scene().reduce(2)
    run = model.simulate(0.05, 1e-3)
    with pytest.raises(ValueError, match="stop must be below 1"):
        run.force(1, mean=True)
    with pytest.raises(ValueError, match="the mean force needs samples"):
        model.simulate(0.05).force(mean=True)
