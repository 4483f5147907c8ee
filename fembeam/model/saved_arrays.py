"""Consistency of the arrays of a saved run; a truncated or edited file is refused with the reason.

k samples, n coordinates, m contacts, r rows of them (two of a circular clearance), b nodes of a beam, c entries of the
log: t (k,), q, q_dot (k, n), force (r, k), stops (m, 3), circles (m, 3) if there are any, with friction rubs (m, 4) and
friction_log (f, 11), losses then (m, 5), r a row more for each but circles without radius; kinds (m, 2), on (m, 3),
directions (r, n), impactor_masses (i,),
nodes (b,), shapes (2b, n), contact_* (c,), energy_* (k,) but energy_initial; what `fembeam.response.readout` reads a
run with; mean_force (m, k), transitions (r, 9), losses (m, 3), work (k, m) and end (2n + l,).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fembeam.response import READOUT_FINITE, expected_readout
from fembeam.scene import ON
from solvers.problem import FrictionLog, Transitions, columns_of

Shape = tuple[int, ...]
TRANSITION_COLUMNS, FRICTION_COLUMNS = len(columns_of(Transitions)), len(columns_of(FrictionLog))
BOOLEAN = ("kinds", "contact_entry_rate_clipped")
FINITE = {"transitions", "end", "shapes", "directions", "impactor_masses", "circles", "rubs", *READOUT_FINITE}


def outline(shape: Shape, dtype: np.dtype[Any]) -> Any:
    """An array of that shape and type that takes no memory."""
    return np.broadcast_to(np.zeros((), dtype), shape)


def known(arrays: Mapping[str, Any], files: int) -> list[str]:
    """Names of what a run is read from, of arrays or their outlines; ValueError unless types and shapes agree."""
    _need(arrays["q"].ndim == 2, f"q must have two dimensions, it has shape {arrays['q'].shape}")
    shapes = {"q": arrays["q"].shape, **expected(arrays)}
    for name, shape in shapes.items():
        dtype, meant = arrays[name].dtype, ("b", "truth values") if name in BOOLEAN else ("iuf", "numbers")
        _need(dtype.kind in meant[0], f"{name} must hold {meant[1]}, it has type {dtype}")
        _need(arrays[name].shape == shape, f"{name} must have shape {shape}, it has {arrays[name].shape}")
    carried = [f"file_{i}" for i in range(files)]
    for name in carried:
        _need(arrays[name].dtype == np.uint8 and arrays[name].ndim == 1, f"{name} must hold the bytes of a file")
    return [*shapes, *carried]


def check(arrays: Mapping[str, Any]) -> None:
    """Raise ValueError unless times, numbers of stops and all else that shapes do not tell agree; names the array."""
    for name in ("t", *(name for name in arrays if name.split("_")[0] == "nodes")):
        steps = np.diff(arrays[name])
        _need(np.isfinite(arrays[name]).all() and np.all(steps > 0), f"{name} must be finite and increase")
    for name in (name for name in arrays if name.rstrip("_0123456789") in FINITE):
        _need(np.isfinite(arrays[name]).all(), f"{name} must be finite")
    _need(np.isfinite(arrays["stops"][:, 1:]).all(), "stops must be finite but for places by name")
    _need(np.all(arrays["impactor_masses"] > 0), "impactor_masses must be positive")
    rows = _rows(arrays)
    _need(len(arrays["directions"]) == rows, f"directions must have {rows} rows, there are {len(arrays['directions'])}")
    beams = sum(name.split("_")[0] == "nodes" for name in arrays)
    most = [beams, len(ON), max(beams, len(arrays["impactor_masses"]))]
    whole = arrays["on"].dtype.kind in "iu" and np.all((arrays["on"] >= 0) & (arrays["on"] < most))
    _need(whole, f"on must hold whole numbers from 0, below {most}")
    contact, m = arrays["transitions"][:, 0], len(arrays["stops"])
    _need(np.all((contact >= 0) & (contact < m)), f"transitions must name contacts, 0 to {m - 1}")
    rubbing = arrays["friction_log"][:, 0] if "friction_log" in arrays else contact
    _need(np.all((rubbing >= 0) & (rubbing < m)), f"friction_log must name contacts, 0 to {m - 1}")
    _check_log(arrays)


def _rows(arrays: Mapping[str, Any]) -> int:
    """Rows of all contacts: two of a circle; with friction one more, but of a circle without radius."""
    none = np.zeros((len(arrays["stops"]), 4))
    circle, rubs = arrays.get("circles", none)[:, 0] != 0.0, arrays.get("rubs", none)
    return int(np.sum(1 + circle + ((rubs[:, 1] != 0.0) & (~circle | (rubs[:, 2] != 0.0)))))


def expected(arrays: Mapping[str, Any]) -> dict[str, Shape]:
    """{name: shape} that follow from q, stops, the nodes and the entries of the log."""
    (k, n), m, entries = arrays["q"].shape, len(arrays["stops"]), arrays["contact_stop"].size
    rubs = "rubs" in arrays
    r = arrays["directions"].shape[0] if "circles" in arrays or rubs else m
    shapes: dict[str, Shape] = {"t": (k,), "q_dot": (k, n), "force": (r, k), "stops": (m, 3), "directions": (r, n)}
    shapes |= {"circles": (m, 3)} if "circles" in arrays else {}
    if rubs:
        shapes |= {"rubs": (m, 4), "friction_log": (len(arrays["friction_log"]), FRICTION_COLUMNS)}
    shapes |= {"kinds": (m, 2), "on": (m, 3), "mean_force": (m, k), "losses": (m, 5 if rubs else 3), "work": (k, m)}
    shapes["transitions"] = len(arrays["transitions"]), TRANSITION_COLUMNS
    shapes["end"] = (max(2 * n, arrays["end"].size),)
    shapes["impactor_masses"] = (min(arrays["impactor_masses"].size, n),)
    shapes |= {name: (entries,) for name in arrays if name.startswith("contact_")}
    shapes |= {name: () if name == "energy_initial" else (k,) for name in arrays if name.startswith("energy_")}
    for name in arrays:
        if name.split("_")[0] == "nodes":
            b = arrays[name].size
            of_body = name.replace("nodes", "shapes")
            rows = arrays[of_body].shape[0] if arrays[of_body].ndim == 2 and b else 2 * b
            shapes |= {name: (b,), of_body: (max(rows // max(b, 1), 1) * b, n)}  # 2 of a beam, else a body's components
    return shapes | expected_readout(arrays)


def _check_log(arrays: Mapping[str, Any]) -> None:
    """Contacts are with stops that exist and end after they began; a contact under way has no end."""
    stop, t_in, t_out = (arrays[f"contact_{name}"] for name in ("stop", "t_in", "t_out"))
    m = len(arrays["stops"])
    known = stop.dtype.kind in "iu" and np.all((stop >= 0) & (stop < m))
    _need(known, f"contact_stop must hold numbers of stops, 0 to {m - 1}")
    ended = ~np.isnan(t_out)
    _need(
        np.isfinite(t_in).all() and np.all(t_out[ended] >= t_in[ended]), "contact_t_out must not be before contact_t_in"
    )


def _need(valid: Any, rule: str) -> None:
    """Raise ValueError unless valid."""
    if not valid:
        raise ValueError(f"its arrays contradict each other: {rule}")
