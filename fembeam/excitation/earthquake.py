"""Earthquake records: two columns, PEER (AT2) and COSMOS files, units, baseline.

Of PEER files the header's NPTS and DT are read, of COSMOS ones the real header (sampling interval) and the line above
the data (number, unit, Fortran format). A header that contradicts itself is an error.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal, NoReturn, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fembeam.excitation.record import Interpolation, Record
from fembeam.excitation.samples import checked_samples, read_rows
from fembeam.support import file_path, require_switch

Vector = NDArray[np.float64]
Unit = Literal["g", "m/s2", "cm/s2"]
FACTORS = dict(zip(get_args(Unit), (9.80665, 1.0, 0.01), strict=True))  # m/s²
SPELLINGS: dict[str, Unit] = {
    **{"g": "g", "gal": "cm/s2", "cm/sec2": "cm/s2", "cm/s2": "cm/s2", "cm/sec/sec": "cm/s2", "cm/s/s": "cm/s2"},
    **{"m/s2": "m/s2", "m/sec2": "m/s2", "m/s/s": "m/s2", "m/sec/sec": "m/s2"},
}
PEER = re.compile(
    r"NPTS\s*=\s*(?P<count>\d+)[\s,]*DT\s*=\s*(?P<step>[\d.eE+-]+)[^\n]*\n"
    r"|^\s*(?P<old_count>\d+)\s+(?P<old_step>[\d.eE+-]+)\s+NPTS,\s*DT[^\n]*\n",
    re.M | re.I,
)
FORMAT = r"\s*,\s*Format\s*=\s*\(?\d*[EFG](\d+)[^\n]*\n"
REAL_HEADER = re.compile(r"(\d+)\s+Real-header values follow on\s+\d+ lines" + FORMAT, re.I)
COSMOS = re.compile(
    r"^\s*(\d+)\s+[^\n|]*accel[^\n]*?pts,\s*approx\s+([\d.]+)\s*secs,\s*units\s*=\s*([^,(\n]+?)\s*(?:\(\d+\))?"
    + FORMAT,
    re.M | re.I,
)
STEP, STEP_MS = 33, 61  # of the real header: sampling interval as recorded (s) and as processed (ms)
UNTOLD = -999.0


def earthquake(
    path: Path,
    unit: Unit | None = None,
    columns: tuple[int, int] = (0, 1),
    baseline: bool = True,
    band: tuple[float, float] | None = None,
    interpolation: Interpolation = "linear",
    padding: float = 0.0,
) -> Record:
    r"""An earthquake record as the motion of the frame: acceleration in g, m/s² or cm/s² from a file.

    Parameters
    ----------
    path : a text file with columns of time (s) and acceleration, a PEER file (AT2), or a COSMOS file (V1, V2; its
        first acceleration).
    unit : "g" (9.80665 m/s²), "m/s2" or "cm/s2" of the columns; PEER and COSMOS files say it themselves.
    columns : of time and acceleration, counted from 0.
    baseline : subtract the parabola that makes the mean square of the velocity least, see `without_baseline`.
    band, interpolation, padding : as for `Record`.

    Returns
    -------
    Record : with ``quantity="acceleration"``.

    Raises
    ------
    ValueError : no unit, or one beside the file's own; a header without time step, number or unit, or that contradicts
        the data; what `Record` refuses.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp(), "quake.AT2")
    >>> numbers = " ".join(f"{0.1 * np.sin(0.2 * j):.6f}" for j in range(200))
    >>> head = "PEER\nsomewhere\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 200, DT= .0100 SEC\n"
    >>> _ = path.write_text(head + numbers)
    >>> earthquake(path, baseline=False).derivative(2)(0.08) / 9.80665  # g
    np.float64(0.099957)
    """
    require_switch("baseline", baseline, "earthquake")
    path = file_path(path, "earthquake")
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    found = _peer(text, path) or _cosmos(text, path)
    if found is None:
        _check_unit(unit, path)
        t, acceleration = read_rows(path, columns).T
    else:
        if unit is not None:
            raise ValueError(f"{path}: unit must be left out, got {unit!r}: the file says {found[2]}")
        t, acceleration, unit = found
    try:
        t, acceleration = checked_samples(t, acceleration * FACTORS[str(unit)])
        if baseline:
            acceleration = without_baseline(t, acceleration)
        return Record(t, acceleration, band, "acceleration", False, interpolation, padding)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def without_baseline(t: ArrayLike, acceleration: ArrayLike) -> Vector:
    """An acceleration less the parabola c_0 + c_1 t + c_2 t² that makes ∫ v² dt least, v(0) = 0.

    Parameters
    ----------
    t, acceleration : (k,) s and m/s².

    References
    ----------
    G.V. Berg, G.W. Housner, Integrated velocity and displacement of strong earthquake ground motion, Bull. Seism. Soc.
    Am. 51 (1961) 175.

    Examples
    --------
    >>> t = np.linspace(0.0, 10.0, 1001)
    >>> drift = without_baseline(t, np.sin(9.0 * t) + 0.1 - 0.02 * t) - without_baseline(t, np.sin(9.0 * t))
    >>> bool(np.abs(drift).max() < 1e-12)
    True
    """
    from scipy.integrate import cumulative_trapezoid

    times, values = np.asarray(t, dtype=float), np.asarray(acceleration, dtype=float)
    powers = (times / times[-1])[:, None] ** np.arange(3)
    velocities = cumulative_trapezoid(np.column_stack([powers, values]), times, axis=0, initial=0.0)
    steps = np.pad(np.diff(times), 1)
    weight = np.sqrt((steps[1:] + steps[:-1]) / 2)[:, None]  # trapezia: the ends count half
    found = np.linalg.lstsq(weight * velocities[:, :3], (weight * velocities[:, 3:])[:, 0])[0]
    return np.asarray(values - powers @ found)


def _check_unit(unit: str | None, path: Path) -> None:
    """Raise ValueError without a known unit: columns do not tell theirs."""
    if unit not in list(FACTORS):  # a list: what is given need not be hashable
        _fail(path, f"unit must be {' or '.join(map(repr, FACTORS))} for a file of columns, got {unit!r}")


def _peer(text: str, path: Path) -> tuple[Vector, Vector, Unit] | None:
    """Times, accelerations and their unit of a PEER file; None if it is none."""
    head = PEER.search(text[:2000])
    if head is None:
        return None
    if not re.search(r"UNITS OF\s+\(?G\b", text[: head.end()], re.I):
        _fail(path, "a PEER file must be an acceleration in units of g (AT2), its header says otherwise")
    count = int(head["count"] or head["old_count"])
    step = _numbers([head["step"] or head["old_step"]], path)[0]
    if not 0.0 < step < np.inf:
        _fail(path, f"DT of its header must be positive, got {step:g} s")
    values = _numbers(text[head.end() :].split(), path)
    return *_series(values, count, float(step), path), "g"


def _cosmos(text: str, path: Path) -> tuple[Vector, Vector, Unit] | None:
    """Times, values and the unit of a COSMOS file; None if it is none."""
    head, data = REAL_HEADER.search(text), COSMOS.search(text)
    if head is None:
        return None
    if data is None:
        _fail(path, "the COSMOS file has no acceleration with number, unit and format of its data")
    unit = SPELLINGS.get(data[3].lower().replace("^", "").replace("**", "").replace(" ", ""))
    if unit is None:
        _fail(path, f"the unit of its acceleration must be g, m/s2 or cm/s2, it is {data[3]!r}; bring a V1 or V2 file")
    real = _numbers(_fixed(text[head.end() :], int(head[1]), int(head[2])), path)
    told = [real[i] * factor for i, factor in ((STEP_MS, 1e-3), (STEP, 1.0)) if i < real.size and real[i] != UNTOLD]
    step = next((value for value in told if value > 0), np.nan)
    count, seconds = int(data[1]), float(data[2])
    if not abs(count * step - seconds) <= 1.0 + 0.02 * seconds:
        _fail(path, f"{count} samples of {step:g} s do not make the {seconds:g} s that the header says")
    values = _numbers(_fixed(text[data.end() :], count, int(data[4])), path)
    return *_series(values, count, float(step), path), unit


def _fixed(text: str, count: int, width: int) -> list[str]:
    """Cells of a Fortran format, which may touch each other."""
    cells: list[str] = []
    for line in text.splitlines():
        if len(cells) >= count:
            break
        cells += [line[i : i + width] for i in range(0, len(line.rstrip()), width)]
    return cells[:count]


def _numbers(cells: list[str], path: Path) -> Vector:
    """Cells as numbers."""
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError as error:
        _fail(path, f"its data are not numbers alone: {error}")


def _series(values: Vector, count: int, step: float, path: Path) -> tuple[Vector, Vector]:
    """Times and values, as many as the header says."""
    if values.size != count:
        _fail(path, f"its header says {count} samples, there are {values.size}; the file is cut, or no such file")
    t: Vector = step * np.arange(count, dtype=np.float64)
    return t, values


def _fail(path: Path, message: Any) -> NoReturn:
    """Raise with the file in front."""
    raise ValueError(f"{path}: {message}")
