"""The smallest model that gives a quantity to a tolerance, with the evidence.

The total error of a model with n modes at tolerance rtol is split and bounded by measurement:

    |x(n, rtol) - x(∞, 0)| ≤ |x(n) - x(n_ref)| + |x(n_ref) - x(∞)| + |x(n, rtol) - x(n, rtol → 0)|
                               reduction                                  integration

where the distance of the finest model n_ref from the next finest stands for its distance from all modes. Counts climb
a ladder 1, 2, 3, 4, 6, 8, … until one of them agrees with everything finer, up to at least twice its modes; then the
gap below it is filled in, rtol is loosened as far as the rest of the tolerance allows, and the answer is checked
against twice the modes and a hundredth of rtol.
"""

from __future__ import annotations

from concurrent.futures import Executor
from typing import TYPE_CHECKING

from fembeam.study.measure import Plan, Start
from fembeam.study.model_search import Search
from fembeam.study.quantities import Quantity, named
from fembeam.study.smallest_model_result import SmallestModel
from fembeam.support import is_finite, is_whole, require

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fembeam.scene import Scene

MOST = 64  # modes offered as an answer; the ladder goes twice as far


def smallest_model(
    scene: Scene,
    quantity: str | Quantity,
    tolerance: float,
    duration: float | None = None,
    dt: float | None = None,
    discard: float = 0.0,
    seeds: Sequence[int] = (),
    residual: bool | None = None,
    most: int = MOST,
    start: Start | None = None,
    executor: Executor | None = None,
) -> SmallestModel:
    """The fewest coordinates and the loosest rtol that give a quantity to a relative tolerance.

    Parameters
    ----------
    scene, quantity, duration, dt, discard, seeds, residual, start, executor : as for `mode_count`.
    tolerance : relative, in (0, 1); of the norm if the quantity is an array.
    most : modes that an answer may have, 1 to 64.

    Returns
    -------
    SmallestModel : model, solver settings, errors split into reduction and integration, evidence, figure.

    Raises
    ------
    ValueError : tolerance or most out of range, and what `mode_count` refuses.
    NotMetError : no such model up to `most`; the message says whether modes, scatter or chaos are to blame, and its
        `evidence` holds the tables.

    Notes
    -----
    Errors of random responses and of chaotic ones are bounded with 97.5 % at each comparison: they count with their
    uncertainty. Rungs between 8 and 64 are not all tried unless they border on the answer, so a quantity that
    converges unevenly may have a smaller model than the one found; the one found is checked.

    Examples
    --------
    >>> from fembeam import Beam, Clamped, Harmonic, ModalDamping, Scene, Section
    >>> steel = Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)
    >>> scene = Scene(Beam(0.26, steel), [Clamped(0.0)], damping=ModalDamping(0.05), base=Harmonic(1e-3, 100.0))
    >>> smallest_model(scene, "amplitude", tolerance=0.01).modes
    1
    """
    check_goal(tolerance, most)
    plan, kept = Plan(duration, dt, discard, tuple(seeds), start), named(quantity)
    plan.check(scene, kept)
    kinds = (residual,) if residual is not None else (False, True) if scene.loaded_places else (False,)
    search = Search(scene, kept, plan, float(tolerance), int(most), kinds, executor)
    return search.answer()


def check_goal(tolerance: float, most: int) -> None:
    """Raise ValueError unless the tolerance is a part and `most` a count that the ladder reaches."""
    require(
        is_finite(tolerance) and 0 < tolerance < 1,
        "tolerance must lie in (0, 1)",
        tolerance,
        "smallest_model",
        "e.g. 0.01",
    )
    whole = is_whole(most)
    require(whole and 1 <= most <= MOST, f"most must be a whole number, 1 to {MOST}", most, "smallest_model",
            "e.g. 20")  # fmt: skip
