"""Floor spectra of a run at several places: what equipment there has to stand.

max over t of |x'' + a|,   x'' + 2 ζ ω x' + ω² x = -a(t),   a the absolute acceleration of the place
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from fembeam import plot
from fembeam.response import ResponseSpectrum
from fembeam.scene import directed_words, is_directed, place_words
from fembeam.structures import COMPONENTS
from fembeam.study.result import Result
from fembeam.support import Part, counting, is_listed, require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fembeam.model import Run

RATES = {"acceleration": "/s²", "pseudo_acceleration": "/s²", "velocity": "/s", "displacement": ""}


@dataclass(frozen=True, eq=False, repr=False)
class FloorSpectra(Result):
    """Response spectra by the name of their place.

    Attributes
    ----------
    spectra : {"valve, x": `ResponseSpectrum`}.
    """

    spectra: dict[str, ResponseSpectrum]

    def __repr__(self) -> str:
        return f"<floor spectra of {'; '.join(self.spectra)}>"

    def __getitem__(self, name: str) -> ResponseSpectrum:
        return self.spectra[name]

    def table(self) -> list[dict[str, Any]]:
        """A row for each oscillator: place, zeta, period, omega and its largest responses."""
        return [
            {"place": name, "zeta": zeta, "period": period, "omega": omega, **_responses(one, i, j)}
            for name, one in self.spectra.items()
            for i, zeta in enumerate(one.zeta.tolist())
            for j, (period, omega) in enumerate(zip(one.period.tolist(), one.omega.tolist(), strict=True))
        ]

    def _units(self) -> dict[str, str]:
        return {"period": "s", "omega": "rad/s"} | {name: self._unit(rate) for name, rate in RATES.items()}

    def _unit(self, rate: str) -> str:
        """The unit of responses, "" or with "/s", "/s²": of rotations rad."""
        return " or ".join(f"{unit}{rate}" for unit in dict.fromkeys(one.unit for one in self.spectra.values()))

    def figure(self) -> Figure:
        """The spectra over the period; see `plot.response_spectrum`."""
        return plot.response_spectrum(self.spectra)

    def _parts(self) -> list[Part]:
        rows = []
        for name, one in self.spectra.items():
            for zeta, size in zip(one.zeta.tolist(), one.acceleration, strict=True):
                most = int(size.argmax())
                rows.append((name, zeta, float(size[most]), float(one.period[most])))
        return [repr(self), (("", "zeta", f"largest acceleration / {self._unit('/s²')}", "at period / s"), rows)]


def _responses(one: ResponseSpectrum, i: int, j: int) -> dict[str, float]:
    """The largest responses of one oscillator."""
    return {name: float(getattr(one, name)[i, j]) for name in RATES}


def floor_spectra(
    run: Run,
    places: Sequence[Any],
    omega: ArrayLike | None = None,
    zeta: ArrayLike = 0.05,
    *,
    periods: ArrayLike | None = None,
    progress: bool = False,
) -> FloorSpectra:
    """`Run.floor_spectrum` at several places.

    Parameters
    ----------
    run : with output samples a tenth of the shortest contact apart.
    places : of a beam z in m, of other bodies (place, direction), or a place: its motion along x, y and z, as far as it
        has these. Names of parts are places.
    omega, zeta, periods : as for `fembeam.response_spectrum`.
    progress : show a bar (on terminals and in notebooks only).

    Returns
    -------
    FloorSpectra : ``found["valve, x"]``, `table()`, `figure()`; prints the largest accelerations.

    Raises
    ------
    ValueError : no places, places that do not exist, numbers out of range, a run without samples.

    Examples
    --------
    >>> import fembeam as fb
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  [fb.LumpedMass(0.4, 0.1, name="valve")], base=fb.Harmonic(1e-3, 100.0))
    >>> run = scene.reduce(modes=1).simulate(0.2, 1e-3)
    >>> floor_spectra(run, ["valve", 0.2], periods=[0.05, 0.1])
    <floor spectra of valve; 0.2 m>
    """
    several = is_listed(places) and hasattr(places, "__len__") and len(places) > 0
    require(several, "places must be a list of one or more", places, "floor_spectra", "put it in brackets")
    asked = {name: at for place in places for name, at in _along(run, place).items()}
    each = counting(progress, asked.items(), unit=" places")
    return FloorSpectra({name: run.floor_spectrum(at, omega, zeta, periods=periods) for name, at in each})


def _along(run: Run, place: Any) -> dict[str, Any]:
    """What is asked for at a place, by its name."""
    if not run.shapes.named:
        return {place_words(place): place}
    ways = [place] if is_directed(place) else [(place, c) for c in run.shapes.components if c in COMPONENTS[:3]]
    return {directed_words(at): at for at in ways}
