"""Backbone of a driven structure: frequency and damping of one resonance over the level of a tone, by phase resonance.

With the tone f cos ωt in coordinates (M = 1) and the first harmonic Q of the orbit, q = Re Q e^{iωt} + …,

    Re f·Q = 0,    ζ = W/(2π ω² |Q|²),    W = -π Im f·Q

The motion is a quarter of a period behind the force, so that inertia and elastic forces balance; W is the work of the
tone in a period, which is lost in it.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from fembeam import plot
from fembeam.model import Model, Orbit, observed
from fembeam.model.branch import Family
from fembeam.plot.axis_names import parameter_unit
from fembeam.scene import Scene, called, path_of, turns_at
from fembeam.study.execution.checkpoint import Checkpoint, study_identity
from fembeam.study.measure import require_model
from fembeam.study.peak import check_peak
from fembeam.study.response_curve import ResponseCurve, Seen, arrays_of, restored
from fembeam.study.result import Result, column
from fembeam.support import Part, counting, require
from solvers.problem import counted

Vector = NDArray[np.float64]
WHERE = "study.backbone"
SURE = 1e-10  # of ω: where the secant ends
TRIES = 20  # secants
QUARTER = 1e-4  # cotangent of the phase, above which there is no phase resonance


@dataclass(frozen=True)
class Resonance:
    """Phase resonance at one level: ω (rad/s), ζ, amplitude (m), energy W (J) lost in a period, `stable`."""

    level: float
    omega: float
    zeta: float
    amplitude: float
    energy: float
    stable: bool
    orbit: Orbit = field(repr=False, compare=False)


@dataclass(frozen=True, eq=False, repr=False)
class Backbone(Result):
    """Frequency and damping of one resonance over amplitude.

    Attributes
    ----------
    level : name of the tone's amplitude. resonances : one for each level, each with its `orbit`.
    z : where the amplitude is taken. unit : of the tone's amplitude.
    """

    INDEX: ClassVar[str] = "level"

    level: str
    resonances: tuple[Resonance, ...]
    z: Any
    unit: str = ""

    levels = column("resonances", "level", "(k,) amplitudes of the tone.")
    omega = column("resonances", "omega", "(k,) rad/s, of phase resonance.")
    zeta = column("resonances", "zeta", "(k,) damping ratios of the linear oscillator that loses as much.")
    amplitude = column("resonances", "amplitude", "(k,) m: half the range of the displacement at z.")
    energy = column("resonances", "energy", "(k,) J lost in a period.")
    stable = column("resonances", "stable", "(k,) whether the orbits are stable.")

    def __repr__(self) -> str:
        low, high = self.amplitude.min(), self.amplitude.max()
        length = self._units()["amplitude"]
        levels = counted(len(self.resonances), "level")
        return f"<backbone at {levels} of {self.level}, {low:.4g} to {high:.4g} {length}>"

    def table(self) -> list[dict[str, Any]]:
        """A row for each level, in SI units."""
        names = "level", "amplitude", "omega", "zeta", "energy", "stable"
        return [{name: getattr(one, name) for name in names} for one in self.resonances]

    def plain(self) -> dict[str, Any]:
        """What was found, as JSON has it, without orbits."""
        return {"level": self.level, "resonances": self.table()}

    def _units(self) -> dict[str, str]:
        length = "rad" if turns_at(self.z) else "m"
        return {"level": self.unit, "amplitude": length, "omega": "rad/s", "energy": "J"}

    def _parts(self) -> list[Part]:
        level = f"{self.level} / {self.unit}" if self.unit else self.level
        head = (level, f"amplitude / {self._units()['amplitude']}", "ω / rad/s", "ζ", "energy per period / J", "stable")
        rows = [(*list(row.values())[:-1], "yes" if row["stable"] else "no") for row in self.table()]
        return [repr(self), (head, rows)]

    figure = plot.backbone


def backbone(
    model: Model,
    levels: ArrayLike,
    span: tuple[float, float],
    level: str = "amplitude",
    parameter: str = "omega",
    z: Any = None,
    progress: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Backbone:
    """Frequency and damping of one resonance over amplitude: phase resonance is followed over the level of a tone.

        Re f·Q = 0,    ζ = W/(2π ω² |Q|²),    W = -π Im f·Q

    Parameters
    ----------
    levels : (k,) amplitudes of the tone, ascending, two or more.
    span : (lowest, highest) ω, rad/s, with one resonance inside it.
    level, parameter : paths of the tone's amplitude and of its frequency.
    z : m, or (place, direction), of the displacement; None: the first stop or element, else the tip.
    progress : show a bar (on terminals and in notebooks only).
    checkpoint : file that keeps each level; what it holds is not computed again, also with more levels above.

    Returns
    -------
    Backbone : ``omega``, ``zeta``, ``amplitude``, ``energy``, ``stable``; print it, `table()`, `figure()`.

    Raises
    ------
    ValueError : loads of more than one frequency, levels that do not ascend, an empty span; no phase resonance in it;
        the checkpoint of another study.
    solvers.OrbitError : no periodic motion to begin with.

    Notes
    -----
    Of a linear oscillator ω and ζ are its own, at any damping. Of a structure they are those of the mode as far as
    others take no part in the motion; ζ counts what the whole structure loses. The orbits are exact, only the measure
    of phase and size is their first harmonic. Of several phase resonances in the span the highest is taken at the first
    level.

    References
    ----------
    M. Peeters, G. Kerschen, J.C. Golinval, J. Sound Vib. 330 (2011) 486, doi 10.1016/j.jsv.2010.08.028: phase resonance
    of nonlinear modes. S. Peter, R.I. Leine, Mech. Syst. Signal Process. 96 (2017), doi 10.1016/j.ymssp.2017.04.011:
    phase resonance held by a loop, judged by the power of the exciter.

    Examples
    --------
    >>> import fembeam as fb
    >>> from contacts import Jenkins
    >>> scene = fb.Scene(fb.Beam(0.5, fb.Section.circle(2.1e11, 7800.0, 0.01)), [fb.Clamped(0.0)],
    ...                  elements=[fb.Element(0.5, Jenkins(2e3, 1.0))], damping=fb.ModalDamping(0.01),
    ...                  forces=[fb.PointForce(0.5, fb.Harmonic(0.1, 200.0))])
    >>> found = backbone(scene.reduce(modes=1), [0.01, 0.8], (160.0, 280.0))
    >>> found.omega.round(1).tolist(), found.zeta.round(4).tolist()
    ([243.7, 209.7], [0.0075, 0.1016])
    """
    require_model(model, "backbone")
    given = check_backbone(model.scene, levels, span, level, parameter)
    place = observed(model) if z is None else z
    model.phi(place)  # a place that does not exist is refused
    family = Family(model, path_of(model.scene, level), 1)
    along, ends = path_of(model.scene, parameter), (float(span[0]), float(span[1]))
    asked = {"level": family.name, "parameter": along, "span": ends, "z": place}
    kept = Checkpoint(checkpoint, lambda: study_identity(model, study="backbone", **asked))
    search = _Search(family, along, ends, place, kept)
    with kept, counting(progress, given, unit=" levels") as bar:
        found = [search.at(float(value)) for value in bar]
    unit = parameter_unit(search.levels.name, model.scene)
    return Backbone(called(model.scene, level), tuple(found), place, unit)


def check_backbone(scene: Scene, levels: ArrayLike, span: Any, level: str, parameter: str) -> Vector:
    """Levels; ValueError for what `backbone` refuses."""
    given = check_peak(scene, parameter, level, levels, span, WHERE, "levels")
    require(given[0] > 0.0, "levels must be above 0", given[0], WHERE, "give amplitudes of the tone")
    return given


@dataclass
class _Search:
    """The resonance, from level to level."""

    levels: Family
    parameter: str
    span: tuple[float, float]
    z: Any
    kept: Checkpoint
    passed: list[float] = field(default_factory=list)
    last: Resonance | None = None

    def at(self, level: float) -> Resonance:
        """At one level, the next above those passed, on which it depends; computed unless it is kept."""
        self.passed.append(level)
        key, along = repr(self.passed), Family(self.levels.at(level), self.parameter, 1)
        if key in self.kept.values:
            self.last = restored(Resonance, self.kept.values[key], along, "omega")
        else:
            self.last = self._found(level, along)
            self.kept.add(key, arrays_of(self.last))
        return self.last

    def _found(self, level: float, along: Family) -> Resonance:
        """From the last one if there is one, else along the whole span."""
        curve = ResponseCurve(along, self.z)
        one = None if self.last is None else self.followed(curve, self.last)
        one = one or self.searched(curve, level)
        f = tone(one.orbit.model)
        Q = first_harmonic(one.orbit, one.at)
        energy, size = -math.pi * float((f @ Q).imag), float(np.linalg.norm(Q))
        zeta = energy / (2.0 * math.pi * (one.at * size) ** 2)
        return Resonance(level, one.at, zeta, one.amplitude, energy, bool(one.orbit.stable), one.orbit)

    def followed(self, curve: ResponseCurve, last: Resonance) -> Seen | None:
        """By secants from the last level; None where they lead away."""
        x, before = last.omega, curve.from_near(last.omega, last.orbit)
        if before is None:
            return None
        x = before.at * (1.0 + last.zeta * cotangent(before))  # of a linear oscillator: cot = (ω₀² - ω²)/2ζω₀ω
        for _ in range(TRIES):
            one = curve.from_near(x, before.orbit) if self.span[0] <= x <= self.span[1] else None
            if one is None:
                return None
            a, b = cotangent(before), cotangent(one)
            if a == b or abs(one.at - before.at) <= SURE * one.at:
                return one if abs(b) < QUARTER else None
            x, before = one.at - b * (one.at - before.at) / (b - a), one
        return None

    def searched(self, curve: ResponseCurve, level: float) -> Seen:
        """Along the curve: the highest place where the phase passes a quarter of a period."""
        points = curve.points(*self.span)
        phases = [cotangent(one) for one in points]
        passed = [i for i in range(len(points) - 1) if phases[i] * phases[i + 1] <= 0.0 and phases[i] != phases[i + 1]]
        ends = f"{phases[0]:.3g} to {phases[-1]:.3g}"
        require(bool(passed), "no phase resonance in the span: the phase's cotangent must change its sign", ends, WHERE,
                f"widen span = {self.span} about one resonance")  # fmt: skip
        i = max(passed, key=lambda i: points[i].amplitude + points[i + 1].amplitude)
        curve.seen = points[i : i + 2]
        for one in curve.seen:
            if cotangent(one) == 0.0:
                return one

        def phase(x: float) -> float:
            one = next((one for one in curve.seen if one.at == x), None)
            one = one or curve.from_near(x, curve.nearest(x).orbit)
            return math.nan if one is None else cotangent(one)

        x = brentq(phase, points[i].at, points[i + 1].at, xtol=SURE * points[i].at, rtol=1e-14)
        one = min(curve.seen, key=lambda one: abs(one.at - x))
        require(abs(cotangent(one)) < QUARTER, "the phase jumps where it passes a quarter", one.at,
                f"{WHERE} at {self.levels.name} = {level:g}", "begin at a lower level")  # fmt: skip
        return one


def tone(model: Model) -> Any:
    """Complex load (n,) on the coordinates of the only frequency there is, f = Re(… e^{iωt})."""
    found: dict[float, Any] = {}
    for vector, signal in model.system.loads:
        tones: Any = signal
        for omega, amplitude in zip(*tones.tones(), strict=True):
            if omega > 0.0 and amplitude != 0.0:
                found[float(omega)] = found.get(float(omega), 0.0) + np.asarray(vector) * amplitude
    require(len(found) == 1, "a backbone needs loads of one frequency", sorted(found), WHERE, "use one Harmonic")
    return next(iter(found.values())).conj()


def first_harmonic(orbit: Orbit, omega: float) -> Any:
    """Complex Q (n,) of an orbit, q = Re Q e^{iωt} + …, by the mean over its even samples."""
    run = orbit.run
    turns = np.exp(-1j * omega * (orbit.found.phase + run.t[:-1]))
    return 2.0 * (turns @ run.q[:-1]) / len(turns)


def cotangent(one: Seen) -> float:
    """Re f·Q over -Im f·Q: above 0 below resonance; (ω₀² - ω²)/2ζω₀ω of a linear oscillator."""
    work = complex(tone(one.orbit.model) @ first_harmonic(one.orbit, one.at))
    return math.inf if work.imag == 0.0 else -work.real / work.imag
