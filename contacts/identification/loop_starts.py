"""Starting values for least squares: sliders added one by one while each reduces the residual more than noise."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contacts.identification.loop_fit import ROUNDING, Fit, Measured
from contacts.identification.loop_models import Loop, Sliders, Smooth, extensions
from contacts.identification.records import Vector

_WIDTHS = np.geomspace(0.01, 1.9, 30)  # half ranges of the displacement at which a further slider is tried
_LOADS_AT_START = (-0.7, 0.0, 0.7)  # shares of its limit that it may carry at the start of a record
_WIDER = 0.2  # logarithm of the widths' ratio of further starts
_FALLS = 0.2  # slope in units of the half ranges from which on a force that falls is none by noise
_UNLIKELY = 1e-5  # chance that noise alone explains as much as a further slider


def fit_sliders(measured: Measured, most: int, spring: bool) -> Fit:
    """Add sliders as long as one reduces the residual more than noise would."""
    slope, squares, numbers = _line(measured)
    tried, chosen = _Tried(measured, spring), list[int]()
    best: Fit | None = None
    for count in range(1, most + 1):
        model = Sliders(count, spring)
        if measured.count < model.main + measured.offset + count * len(measured.loops) + 4 and best:
            break
        chosen = tried.with_one_more(chosen)
        rough = [Fit(measured, model, start, most=20) for start in tried.starts(chosen)]
        fit = _converged(Fit(measured, model, min(rough, key=lambda one: one.squares).theta))
        if not _better(squares, numbers, fit):
            break
        best, squares, numbers = fit, fit.squares, fit.theta.size
        if fit.exact:
            break
    if best is None:
        raise ValueError(_no_slip(measured, slope, squares))
    return best


def _converged(fit: Fit) -> Fit:
    """The fit, begun anew where it ended as long as the squares fall.

    Least squares take a step in units of the largest slopes they have met; those by the memory vanish where a slider
    begins at its limit, so that steps towards it become ever smaller.
    """
    while not fit.exact:
        again = Fit(fit.measured, fit.model, fit.theta)
        if not again.squares < 0.5 * fit.squares:
            break
        fit = again
    return fit


def _better(squares: float, numbers: int, fit: Fit) -> bool:
    """Whether a fit explains more than noise would; each width tried is a chance of its own."""
    from scipy.stats import f as fisher

    more, freedom = max(fit.theta.size - numbers, 1), fit.measured.count - fit.theta.size
    floor = max(fit.squares, fit.measured.count * ROUNDING**2)
    gain = (squares - floor) / more / (floor / freedom)
    return bool(fisher.sf(gain, more, freedom) < _UNLIKELY / _WIDTHS.size)


def _line(measured: Measured) -> tuple[float, float, int]:
    """(slope, squares left, numbers) of straight lines, one slope for all records and each its own height."""
    heights = np.zeros((measured.count, len(measured.loops)))
    heights[np.arange(measured.count), np.repeat(range(len(measured.loops)), [x.x.size for x in measured.loops])] = 1.0
    columns = np.column_stack((np.concatenate([loop.x for loop in measured.loops]), heights))
    found, *_ = np.linalg.lstsq(columns, measured.target, rcond=None)
    left = columns @ found - measured.target
    return float(found[0]), float(left @ left), found.size


def _no_slip(measured: Measured, slope: float, squares: float) -> str:
    """What to say of straight lines."""
    stiffness, noise = slope * measured.strength / measured.depth, math.sqrt(squares / measured.count)
    if slope < -_FALLS:
        return (
            f"the force falls as delta rises, by {-stiffness:.6g} N/m: an element's force is positive where delta is: "
            "change the sign of one"
        )
    return (
        f"nothing slips in these records: the force is a line of slope {stiffness:.6g} N/m to within "
        f"{noise * measured.strength:.3g} N, which tells of the limit only that half the range of force, "
        f"{measured.strength:.6g} N, does not reach it; load further, or look whether samples are dense and in order"
    )


class _Tried:
    """Sliders of many widths and starting loads: which together explain most, stiffnesses by linear least squares."""

    def __init__(self, measured: Measured, spring: bool) -> None:
        self.measured, self.spring = measured, spring
        settled = [[_settled(loop, width) for loop in measured.loops] for width in _WIDTHS]
        same = np.outer(_LOADS_AT_START, np.ones(len(measured.loops)))
        self.widths = np.repeat(_WIDTHS, 1 + len(_LOADS_AT_START))
        self.loads = np.concatenate([[own, *same] for own in settled])  # shares of the limit
        each = [extensions(x, self.widths, self.widths * b) for x, b in zip(measured.loops, self.loads.T, strict=True)]
        linear = [np.concatenate([loop.x for loop in measured.loops])] * spring
        self.fixed = self.widths.size + np.arange(spring + measured.offset)
        columns = np.vstack((*[np.concatenate(each, axis=1)], *linear, *[np.ones(measured.count)] * measured.offset))
        self.products, self.target = columns @ columns.T, columns @ measured.target

    def weights(self, chosen: Any) -> Vector:
        """(..., r) of the sliders (..., n), and of spring and offset."""
        rows = self._rows(chosen)
        inverse = np.linalg.pinv(self.products[rows[..., None], rows[..., None, :]], rcond=1e-12, hermitian=True)
        return np.asarray((inverse @ self.target[rows][..., None])[..., 0])

    def explained(self, chosen: Any) -> Vector:
        """Sum of squares explained by sliders (..., n) together; 0 where the fit gives one a negative stiffness."""
        weights = self.weights(chosen)
        together = np.sum(weights * self.target[self._rows(chosen)], axis=-1)
        return np.where(np.all(weights[..., : np.shape(chosen)[-1]] > 0.0, axis=-1), together, 0.0)

    def _rows(self, chosen: Any) -> NDArray[np.intp]:
        """Numbers of their columns, those of spring and offset behind."""
        sliders = np.asarray(chosen, dtype=np.intp)
        return np.concatenate((sliders, np.broadcast_to(self.fixed, (*sliders.shape[:-1], len(self.fixed)))), axis=-1)

    def with_one_more(self, chosen: list[int]) -> list[int]:
        """A further slider; then each is exchanged for a better one until there is none."""
        chosen, before = [*chosen, self.best(chosen)], np.array(-1.0)
        while self.explained(chosen) > before * (1.0 + 1e-9):
            before = self.explained(chosen)
            for _ in range(len(chosen)):
                chosen = [*chosen[1:], self.best(chosen[1:])]
        return chosen

    def best(self, others: list[int]) -> int:
        """The slider that explains most beside others."""
        each = np.arange(self.widths.size)
        return int(np.argmax(self.explained(np.column_stack((*[np.full_like(each, i) for i in others], each)))))

    def starts(self, chosen: list[int]) -> list[Vector]:
        """θ of these sliders, and with one of them wider or narrower: whether cycles slip makes many minima."""
        weights, loads = self.weights(chosen), np.arcsin(self.loads[chosen]).T.ravel()
        stiffness, count = np.maximum(weights[: len(chosen)], 1e-6), len(chosen)
        theta = np.concatenate((np.log(stiffness), np.log(self.widths[chosen]), weights[count:], loads))
        other = np.arange(theta.size) == np.arange(count, 2 * count)[:, None]
        return [theta, *(theta + _WIDER * other), *(theta - _WIDER * other)]


def _settled(loop: Loop, width: float) -> float:
    """Share of its limit that a slider carries once the record has been passed, as in a steady state."""
    return 0.9 * float(extensions(loop, np.array([width]), np.zeros(1))[0, -1]) / width


def smooth_starts(measured: Measured, model: Smooth) -> list[Vector]:
    """From one slider with a spring: its slopes, and what |z| stays below; γ equal to β, to none and to -β/2."""
    fit = fit_sliders(measured, 1, True)
    (stiffness, width), elastic = np.exp(fit.theta[:2]), fit.theta[2]
    shape, count = width**-model.n, len(measured.loops)
    rest = [*fit.theta[3:-count], *(width * np.sin(fit.theta[-count:]))]
    return [np.array([np.log(stiffness), elastic, shape * b, shape * (1.0 - b), *rest]) for b in (0.5, 1.0, 2.0)]
