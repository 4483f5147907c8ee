"""What all figures share: colours, type, how a spectrum is drawn."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np
from numpy.typing import NDArray

from fembeam.plot.units import length_for
from fembeam.scene import directed_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

    from fembeam.statistics import Spectrum


Vector = NDArray[np.float64]


P = ParamSpec("P")


BLUE, RED, GREEN, ORANGE, GREY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#777777"  # Okabe and Ito
ENTRY = 40  # characters of a line in a legend
ALONG, UP = 60, 34  # letters along panels as broad as a page, and up
EVEN = 0.1  # of the largest, below which the median is where values are spread evenly in their logarithm
CYCLE = BLUE, RED, GREEN, ORANGE, "#CC79A7", "#56B4E9"


STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": f"cycler('color', {list(CYCLE)})",
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "figure.dpi": 120,
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw in the library's style, and leave the user's settings alone.

    TypeError unless the first argument is of the class, or a mapping, that ``draw`` names for it.
    """
    wanted = next(iter(signature(draw).parameters.values())).annotation

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> Figure:
        from matplotlib import rc_context

        if args and str(wanted).isidentifier() and wanted not in [one.__name__ for one in type(args[0]).__mro__]:
            raise TypeError(f"fembeam.plot.{draw.__name__} draws one {wanted}, got {type(args[0]).__name__}")
        if args and str(wanted).startswith("Mapping") and not isinstance(args[0], Mapping):
            raise TypeError(f"fembeam.plot.{draw.__name__} draws things by name, got {args[0]!r}; write {{'name': it}}")
        with rc_context(STYLE):  # type: ignore[arg-type]
            return draw(*args, **kwargs)

    return inside


def own_colour(number: int) -> str:
    """The colour of one of several curves; matplotlib would look "C1" up as it draws, in the user's settings."""
    return CYCLE[number % len(CYCLE)]


def own_line(number: int) -> dict[str, Any]:
    """Colour and dashes of one of several curves; dashes tell them apart once the colours repeat."""
    return {"color": own_colour(number), "linestyle": ("-", "--", ":")[number // len(CYCLE) % 3]}


def verbatim(name: Any) -> str:
    r"""Text of a figure that shows a user's name as it is: matplotlib makes formulas of what stands between two $.

    A name that begins with an underscore gets a space before it, as legends leave out labels such as "_a".

    Examples
    --------
    >>> print(verbatim("cost $5 to $6"), verbatim("_a"), sep=";")
    cost \$5 to \$6; _a
    """
    text = str(name).replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def entry(name: Any, width: int = ENTRY) -> str:
    """A user's name as the entry of a legend, on several lines where it is longer than so many letters.

    Examples
    --------
    >>> print(entry("guide of the main steam line at the turbine hall, north"))
    guide of the main steam line at the
    turbine hall, north
    """
    return verbatim(textwrap.fill(str(name), width, break_on_hyphens=False))


def logarithmic(axis: Axes, x: Vector) -> bool:
    """Whether values along x are spread evenly in their logarithm; then so is the axis.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> axis = Figure().subplots()
    >>> logarithmic(axis, np.linspace(0.1, 1.0, 9)), logarithmic(axis, np.geomspace(1e-6, 1.0, 9)), axis.get_xscale()
    (False, True, 'log')
    """
    spread = len(x) > 2 and bool(0.0 < x.min() <= np.median(x) < EVEN * x.max())
    if spread:
        axis.set_xscale("log")
    return spread


def short(number: float) -> str:
    """A number above 0 with two digits, without an exponent where it is large.

    Examples
    --------
    >>> short(0.314), short(7.85), short(125.3)
    ('0.31', '7.8', '125')
    """
    return f"{number:.0f}" if number >= 10.0 else f"{number:.2g}"


def place_name(z: Any) -> str:
    """A place in mm, beyond 1 m in m, below 0.01 mm in µm; one by name with its direction."""
    if isinstance(z, tuple):
        return directed_words(z)
    if isinstance(z, str):  # of a part
        return z
    scale, unit = length_for(z)
    return f"z = {scale * z:.5g} {unit}"


def displacement_name(z: Any) -> str:
    """What an axis of displacements at a place is called, without unit.

    Examples
    --------
    >>> displacement_name(0.25), displacement_name(("lever", "x"))
    ('u(0.25 m)', 'u(lever, x)')
    """
    return f"u({verbatim(directed_words(z)) if isinstance(z, tuple) else f'{z:.4g} m'})"


def round_factor(factor: float) -> float:
    """The next smaller of …, 1, 2, 5, 10, 20, 50, ….

    Examples
    --------
    >>> round_factor(73.0), round_factor(0.7), round_factor(1000.0)
    (50.0, 0.5, 1000.0)
    """
    power = 10.0 ** math.floor(math.log10(factor) + 1e-9)
    return next(m * power for m in (5.0, 2.0, 1.0) if m * power <= factor * (1 + 1e-9))


def drawable(line: Spectrum, top: float) -> tuple[Vector, Vector]:
    """The curve up to the end of the axis, without ω = 0 (the mean is gone) and without zeros."""
    kept = (line.omega > 0) & (line.omega <= top) & (line.density > 0)
    return line.omega[kept], line.density[kept]


def fit_levels(axis: Axes, lines: list[Spectrum], top: float, behind: list[Spectrum] | None = None) -> None:
    """Limits from the responses, so that a band-limited input does not stretch the axis to rounding errors.

    Of curves `behind` only the peaks count.
    """
    levels = np.concatenate([drawable(line, top)[1] for line in lines])
    if len(levels):
        highest = max(drawable(line, top)[1].max(initial=0.0) for line in [*lines, *(behind or [])])
        axis.set_ylim(max(levels.min(), 1e-9 * highest) / 3, 10 * highest)


def plain_decades(axis: Axis, low: float, high: float) -> None:
    """Ticks of a logarithmic axis as plain numbers: 1, 2, 5 in every decade while they have room."""
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def curve(axis: Axes, line: Spectrum, top: float, **options: Any) -> None:
    """One spectrum up to the end of the axis, with its 95 % confidence shaded where it is known."""
    omega, density = drawable(line, top)
    (drawn,) = axis.semilogy(omega, density, **options)
    if line.estimate is not None and line.estimate.batches > 1:
        shown = np.isin(line.omega, omega)
        ribbon(axis, omega, [bound[shown] for bound in line.interval()], drawn.get_color())


def ribbon(axis: Axes, x: Vector, bounds: Sequence[Vector], colour: Any, **options: Any) -> None:
    """A shaded 95 % interval, which is not below zero."""
    low, high = bounds
    axis.fill_between(x, np.maximum(low, 0.0), high, color=colour, alpha=0.3, linewidth=0, **options)


def one_legend(axes: Sequence[Axes]) -> None:
    """One legend beside the figure in place of those within several axes, every label once.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> axes = Figure(layout="constrained").subplots(1, 2)
    >>> for axis in axes:
    ...     _ = axis.plot([0.0, 1.0], label="same")
    ...     _ = axis.legend()
    >>> one_legend(axes)
    >>> [text.get_text() for text in axes[0].figure.legends[0].get_texts()], axes[0].get_legend()
    (['same'], None)
    """
    entries: dict[str, Any] = {}
    for inner in [found for axis in axes if (found := axis.get_legend()) is not None]:
        for text, handle in zip(inner.get_texts(), inner.legend_handles, strict=True):
            entries.setdefault(text.get_text(), handle)
        inner.remove()
    figure: Any = axes[0].figure
    figure.legend(entries.values(), entries, loc="outside right upper", fontsize=8)
