"""A law with memory from measured loops of force over displacement, by least squares over all records.

Rate-independent hysteresis knows the order of the samples, not their times. What the element has been through before a
record is unknown: the memory at its first sample is fitted too.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from contacts.identification.loop_fit import Fit, Measured
from contacts.identification.loop_models import Smooth
from contacts.identification.loop_result import IdentifiedLoop
from contacts.identification.loop_starts import fit_sliders, smooth_starts
from contacts.identification.records import checked_options
from contacts.law import Law
from contacts.memory import BoucWen, Iwan, Jenkins


def identify_loop(
    delta: Any,
    force: Any,
    law: type[Law] = Jenkins,
    *,
    parts: int | None = None,
    n: int | None = None,
    offset: bool = True,
    confidence: float = 0.95,
) -> IdentifiedLoop:
    """Parameters of a law with memory from measured loops, with confidence intervals.

    Parameters
    ----------
    delta, force : (k,) m and N of a record, in order, or lists of such records; no times. Between two samples the path
        is straight: sample turning points densely.
    law : `Jenkins`, `Iwan` (with a spring beside) or `BoucWen`.
    parts : of Iwan, how many sliders at most; None is 4. There are fewer where the records cannot distinguish more.
    n : of Bouc and Wen, 1 or 2; None takes the one that fits better.
    offset : fit the zero of the force too.
    confidence : of the intervals, in (0, 1).

    Returns
    -------
    IdentifiedLoop : print it; ``.law`` is the law, ``.estimates["limit"]`` a number with its interval.

    Raises
    ------
    TypeError for another law; ValueError for arrays that do not fit together or are not finite, for too few samples,
    and for records in which nothing slips: a straight line tells the stiffness alone. Warns of residuals that are
    correlated, of parameters that the records do not determine, or only in combination, and of noise in delta.

    Notes
    -----
    Intervals are of linear theory with Student's t for independent noise of the force, widened for a correlation of
    neighbouring residuals. Delta counts as exact: a law with memory follows every turn of its noise, so smooth it
    between the turning points. Where a slider that slips in one direction only fits as well, the interval of its
    limit ends at infinity, and that of the zero of force on one side. Of Bouc and Wen's A, β, γ and (1 - α) k loops
    tell three numbers: A = 1 is chosen.

    Examples
    --------
    >>> import numpy as np
    >>> damper = Jenkins(2e4, 10.0)
    >>> path = 1e-3 * np.sin(np.linspace(0.0, 12.0, 200))
    >>> found = identify_loop(path, damper.along(path))
    >>> round(found.estimates["stiffness"].value, 2), round(found.law.limit, 6)
    (20000.0, 10.0)
    """
    if law not in (Jenkins, Iwan, BoucWen):
        raise TypeError(f"law of identify_loop must be Jenkins, Iwan or BoucWen, the class, got {law!r}")
    _check_options(law, parts, n)
    share = checked_options(offset, confidence)
    measured = Measured(delta, force, bool(offset))
    if law is BoucWen:
        models = [Smooth(m) for m in ((1, 2) if n is None else (n,))]
        fits = [Fit(measured, model, theta) for model in models for theta in smooth_starts(measured, model)]
        best = min(fits, key=lambda fit: fit.squares)
    else:
        best = fit_sliders(measured, (parts or 4) if law is Iwan else 1, law is Iwan)
    return best.result(share)


def _check_options(law: type[Law], parts: Any, n: Any) -> None:
    """Options belong to one law each."""
    for name, value, owner, allowed in (("parts", parts, Iwan, range(1, 21)), ("n", n, BoucWen, (1, 2))):
        if value is None:
            continue
        if law is not owner:
            raise ValueError(f"{name} of identify_loop belongs to {owner.__name__}, got {value!r} for {law.__name__}")
        if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value not in allowed:
            said = "a whole number from 1 to 20" if owner is Iwan else "1 or 2"
            raise ValueError(f"{name} of identify_loop must be {said}, got {value!r}")
