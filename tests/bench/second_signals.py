"""Signals of the second implementation, and their second derivatives, from the tables of a scene file."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

import fembeam as fb

Table = dict[str, Any]
BELL = Polynomial([1.0, 0.0, -1.0])


def signal(table: Table, order: int = 0) -> Callable[[float], float]:
    """The signal of a table, or its derivative of an order up to two."""
    kind = table["kind"]
    if kind == "harmonic":
        w, turn = table["omega"], table.get("phase", 0.0) + order * math.pi / 2
        return lambda t: table["amplitude"] * w**order * math.cos(w * t + turn)
    if kind == "multisine":
        a, w, p = (np.atleast_1d(table.get(name, 0.0)) for name in ("amplitude", "omega", "phase"))
        return lambda t: float(np.sum(a * w**order * np.cos(w * t + p + order * math.pi / 2)))
    if kind in ("pulse", "step"):
        return _once(table, order)
    return _swept(table, order) if kind == "sine_sweep" else _lines(table, order)


def breaks(table: Table) -> list[float]:
    """Times where it is not smooth."""
    long = table.get("length", table.get("rise"))
    return [table["at"], table["at"] + long] if table["kind"] in ("pulse", "step") else []


def _once(table: Table, order: int) -> Callable[[float], float]:
    """peak (1 - s²)⁹, or size times the integral of (1 - s²)⁸ over that from -1 to 1."""
    if table["kind"] == "pulse":
        p, long, after = table["peak"] * BELL**9, table["length"], 0.0
    else:
        whole = (BELL**8).integ()
        p, long, after = (
            table["size"] * (whole - whole(-1.0)) / (whole(1.0) - whole(-1.0)),
            table["rise"],
            table["size"],
        )
    p, at = p.deriv(order) * (2 / long) ** order if order else p, table["at"]

    def value(t: float) -> float:
        s = 2 * (t - at) / long - 1
        return 0.0 if s <= -1 else float(p(s)) if s < 1 else after * (order == 0)

    return value


def _swept(table: Table, order: int) -> Callable[[float], float]:
    """A sin θ with θ' from ω₀ to ω₁, linearly or by a constant factor per time."""
    a, w0, w1, T = (table[name] for name in ("amplitude", "omega0", "omega1", "duration"))
    rate, growth = (w1 - w0) / T, math.log(w1 / w0) / T

    def value(t: float) -> float:
        if table["rate"] == "linear":
            angle, w, turn = w0 * t + rate * t * t / 2, w0 + rate * t, rate
        else:
            w = w0 * math.exp(growth * t)
            angle, turn = (w - w0) / growth, growth * w
        return a * (math.sin(angle), w * math.cos(angle), turn * math.cos(angle) - w * w * math.sin(angle))[order]

    return value


def _lines(table: Table, order: int) -> Callable[[float], float]:
    """Noise by its values alone: lines from a transform of one period, differentiated one by one."""
    made = fb.BandNoise(**{k: v for k, v in table.items() if k != "kind"})
    step = 2 * math.pi / table["period"]
    n = 4 * math.ceil(table["band"][1] / step) + 8
    lines = 2.0 * np.fft.rfft(made(np.arange(n) * table["period"] / n)) / n
    w = step * np.arange(len(lines))
    assert abs(np.sum(np.abs(lines) ** 2) / 2 / table["std"] ** 2 - 1) < 1e-9, "not the standard deviation asked for"
    assert np.abs(lines[(w < table["band"][0]) | (w > table["band"][1])]).max() < 1e-9 * table["std"], "outside"
    kept = np.abs(lines) > 1e-9 * table["std"]
    lines, w = lines[kept] * (1j * w[kept]) ** order, w[kept]
    return lambda t: float(np.sum(lines.real * np.cos(w * t) - lines.imag * np.sin(w * t)))
