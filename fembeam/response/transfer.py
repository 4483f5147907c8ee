"""Frequency response of the linear scene: what a harmonic input of unit size moves, all contacts open.

(K + iωC - ω² M) q = v,   H(ω) = φ(z)·q,   v = ω² Γ of a base displacement, φ(z_f) of a force
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.scene import loads_of_dof, signals_of, split, unit_of
from fembeam.structures import COMPONENTS, turns
from fembeam.support import is_finite, require, require_switch, vector

if TYPE_CHECKING:
    from fembeam.model import Model

Vector = NDArray[np.float64]
AT_ONCE = 4_000_000  # matrix entries solved together
WHERE = "Model.frequency_response"


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Complex response H to inputs cos(ωt): displacement Re(H exp(iωt)).

    Attributes
    ----------
    omega : (k,) rad/s. values : complex (k,), or (k, j) for several places; `unit` says of what.
    input : what drives, in words. output : z in m, one or (j,). absolute : whether the frame's motion is in it.
    natural : (n,) undamped natural frequencies of the model, rad/s.
    """

    omega: Vector
    values: NDArray[np.complex128]
    input: str
    output: float | Vector
    absolute: bool
    unit: str
    natural: Vector

    def __repr__(self) -> str:
        span = f"{self.omega[0]:.4g} to {self.omega[-1]:.4g} rad/s"
        at = self.output if isinstance(self.output, (tuple, list)) else f"z = {self.output} m"
        return f"<frequency response at {at} to {self.input}, {span}>"

    @property
    def amplitude(self) -> Vector:
        """|H|."""
        return np.abs(self.values)

    @property
    def phase(self) -> Vector:
        """Phase in rad, continuous along omega; the response lags where it is negative."""
        return np.unwrap(np.angle(self.values), axis=0)

    @property
    def decibel(self) -> Vector:
        """20 log10 |H|; -inf where nothing moves."""
        with np.errstate(divide="ignore"):
            return 20 * np.log10(self.amplitude)


def frequency_response(
    model: Model,
    omega: ArrayLike,
    driven: str | float,
    output: ArrayLike,
    absolute: bool,
    body: int,
    slipping: bool = False,
) -> FrequencyResponse:
    """The response of a model without its contacts; `Model.frequency_response` explains it."""
    shapes = model.body_shapes(body, WHERE)
    output, driven = shapes.place(output), _named_input(model, driven)
    for name, flag in (("absolute", absolute), ("slipping", slipping)):
        require_switch(name, flag, WHERE, "leave it out")
    moved = isinstance(driven, str) and driven.split(".")[0] == "base"
    require(not absolute or moved, "absolute is for the input 'base'", driven, WHERE, "leave it out")
    if model.scene.named and isinstance(output, np.ndarray):
        output = output.tolist()
    frequencies, places = _checked(omega, model, slipping), model.phi(output, 0, body)
    if isinstance(driven, str) and ".motion" in driven:
        return _of_support(model, frequencies, driven, output, body, slipping)
    vector, power, said, unit = _driving(model, driven)
    values = _solved(model, frequencies, vector, slipping) @ places.T
    values = (values.T * frequencies**power).T + (_carried_along(model, driven, output) if absolute else 0.0)
    shown, unit = _shown(shapes, output), _unit(unit, shapes, output)
    return FrequencyResponse(frequencies, values, said, shown, absolute, unit, model.omega)


def _of_support(model: Model, omega: Vector, driven: str, output: Any, body: int, slipping: bool) -> FrequencyResponse:
    """The response to a unit motion of one dof of a support that moves: (v₀ + iω v₁ - ω² v₂) of its three loads."""
    names = [path for path in signals_of(model.scene) if ".motion." in path]
    require(driven in names, f"input must be one of {', '.join(names) or 'none, as no support moves'}", driven, WHERE,
            "use one")  # fmt: skip
    shapes, n, k = (model.shapes, *model.others)[body], len(model.omega), names.index(driven)
    alone = shapes.named and not isinstance(output, list)
    rows = shapes.rows_with_supports([output] if alone else output)
    rows = rows[0] if alone else rows
    vectors = [np.asarray(model.system.loads[i][0]) for i in loads_of_dof(k)]
    answers = [_solved(model, omega, vector, slipping) for vector in vectors]
    q = sum((1j * omega[:, None]) ** order * one for order, one in enumerate(answers))
    values = q @ rows[..., :n].T + rows[..., n + k]
    unit = _unit("m/rad" if driven.split(".")[-1].startswith("r") else "m/m", shapes, output)
    return FrequencyResponse(omega, values, f"motion of {driven}", _shown(shapes, output), False, unit, model.omega)


def _unit(unit: str, shapes: Any, output: Any) -> str:
    """The unit with rad for m where rotations are asked for."""
    if not shapes.named:
        return unit
    at = output if isinstance(output, list) else [output]
    return unit.replace("m", unit_of("indentation", [turns(split(one, shapes.components)[1]) for one in at]), 1)


def _shown(shapes: Any, output: Any) -> Any:
    """The places as they were named, of a beam as numbers."""
    return output if shapes.named else np.array(output, dtype=float)[()]


def _carried_along(model: Model, driven: str | float, output: Any) -> Any:
    """What a unit motion of the frame adds at the places: 1 on a beam, n_x along x."""
    if not model.scene.named:
        return 1.0
    direction, components = COMPONENTS.index(str(driven).removeprefix("base.")), model.scene.beam.components
    ways = [split(one, components)[1] for one in (output if isinstance(output, list) else [output])]
    parts = np.array([way[direction] for way in ways])
    return parts if isinstance(output, list) else parts[0]


def _named_input(model: Model, driven: Any) -> Any:
    """The input "base" with its direction, where there is but one of a structure; the place of a part for its name."""
    if isinstance(driven, tuple) or (isinstance(driven, str) and driven in model.shapes.parts):
        return model.shapes.place(driven)
    if driven != "base" or not model.scene.named:
        return driven
    known = tuple(model.scene.motions) or model.moved_along
    write = " or ".join(f"base.{one}" for one in known) or "a place where a force acts, as no base moves this structure"
    require(len(known) == 1, "input must name the direction of the base", driven, WHERE, f"write {write}")
    return f"base.{known[0]}"


def _driving(model: Model, driven: Any) -> tuple[Vector, int, str, str]:
    """Vector (n,) and power of ω of an input of size 1, what it is in words, the unit of the response to it."""
    if driven == "base":
        return model.participation, 2, "displacement of the frame", "m/m"
    if isinstance(driven, str) and driven.startswith("base."):
        direction = driven.removeprefix("base.")
        return model.participation_along(direction), 2, f"displacement of the frame along {direction}", "m/m"
    if isinstance(driven, tuple) and model.scene.named:
        turned = turns(split(driven, model.scene.beam.components)[1])
        said, unit = ("moment at {} about {}", "m/(N m)") if turned else ("force at {} along {}", "m/N")
        return model.phi(driven), 0, said.format(*driven), unit
    if is_finite(driven):
        return model.phi(float(driven)), 0, f"force at z = {driven} m", "m/N"
    names = [path for path in signals_of(model.scene) if path.split(".")[0] != "base"]
    motions = [name for name in names if ".motion." in name]  # of supports come first, with three loads each
    inputs = [name.removesuffix(".signal") for name in names if name not in motions]
    known = isinstance(driven, str) and driven.removesuffix(".signal") in inputs
    place = "a place and its direction" if model.scene.named else "a place z in m"
    require(known, f"input must be {place}, or one of {', '.join(['base', *motions, *inputs])}", driven, WHERE,
            "use one")  # fmt: skip
    said = str(driven).removesuffix(".signal")
    vector = np.asarray(model.system.loads[3 * len(motions) + inputs.index(said)][0], dtype=float)
    return vector, 0, said, "m/m" if said.endswith("foot") else "m per unit"


def _checked(omega: ArrayLike, model: Model, slipping: bool) -> Vector:
    """Frequencies (k,) at which the system is not singular."""
    values = vector("omega", omega, WHERE, "give frequencies in rad/s", "must be at least 0 and finite, (k,)",
                    lambda x: np.isfinite(x) & (x >= 0))  # fmt: skip
    C, K = _linear(model, slipping)
    natural = np.sqrt(np.maximum(np.linalg.eigvalsh(K), 0.0)) if model.scene.elements else model.omega
    singular = np.isin(values, natural[natural == 0.0] if np.any(C) else natural)
    require(not singular.any(), "omega must not be an undamped natural frequency", values[singular][:1].tolist(),
            WHERE, "move it, or add damping")  # fmt: skip
    return values


def _linear(model: Model, slipping: bool) -> tuple[Vector, Vector]:
    """C + G and K with the tangents of the elements, stuck or slipping."""
    K, C = model.slipping_elements if slipping else model.linear_elements
    return model.system.by_rate + C, model.system.K + K


def _solved(model: Model, omega: Vector, vector: Vector, slipping: bool) -> NDArray[np.complex128]:
    """Coordinates (k, n) of (K + iωC - ω²) q = vector, some frequencies at a time unless nothing couples the modes."""
    C, K, one = *_linear(model, slipping), np.eye(len(vector))
    if not np.any(np.where(one, 0.0, C)) and not np.any(np.where(one, 0.0, K)):
        return np.asarray(vector / (np.diag(K) + 1j * np.outer(omega, np.diag(C)) - omega[:, None] ** 2))
    answers = []
    for part in np.array_split(omega, len(omega) * len(vector) ** 2 // AT_ONCE + 1):
        w = part[:, None, None]
        answers.append(np.linalg.solve(K + 1j * w * C - w**2 * one, vector[:, None].astype(complex))[..., 0])
    return np.concatenate(answers)
