"""A law as text: equation, parameters, restitution of a free mass, where it pulls or is singular."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import Any

import numpy as np

from contacts.custom import CustomLaw
from contacts.law import Law
from contacts.path import name_of, work
from contacts.restitution import bounce, checked_throw, restitution
from contacts.sums import Sum, parts_of


def describe(law: Law, entry_rate: float = 1.0, mass: float = 1.0) -> str:
    """Text of `Law.describe`."""
    entry_rate, mass = checked_throw(law, entry_rate, mass)
    lines = [f"{name_of(law)}: {law.equation}"]
    if isinstance(law, Sum):
        lines += [f"  {name_of(part)}: {part.equation}; {_values(part)}" for part in law.parts]
    else:
        lines.append(f"  parameters: {_values(law)}")
    if not law.memory or law.exact_restitution(entry_rate, mass) is not None:
        lines.append(f"  restitution: {_restitution(law, entry_rate, mass)}")
    elif law.reach > 0.0 and not law.opens:
        lines.append(f"  {_cycle(law)}")
    if law.nominal is not None:
        lines.append(f"  {law.nominal[0]}: {_source(law)}")
    remarks = law.remarks or (() if law.memory else _observed(law, entry_rate, mass))
    lines += [f"  {remark}" for remark in remarks]
    if law.knots:
        shown = ", ".join(f"{knot:.4g}" for knot in law.knots[:6]) + (", …" if len(law.knots) > 6 else "")
        lines.append(f"  kinks at δ = {shown} m")
    return "\n".join(lines)


def _values(law: Law) -> str:
    """Parameters with their units."""
    if own := getattr(law, "values", None):  # a user's
        return ", ".join(f"{name} = {value:.6g}" for name, value in own)
    if isinstance(law, CustomLaw):
        return "none"
    told = [(f.name, getattr(law, f.name)) for f in fields(law) if f.init]  # type: ignore[arg-type]
    return ", ".join(f"{name} = {_shown(value)} {law.units.get(name, '')}".rstrip() for name, value in told)


def _shown(value: Any) -> str:
    """A number, a flag, a word, or a short sequence."""
    if isinstance(value, (bool, np.bool_, str, type(None))):
        return str(value)
    if isinstance(value, (tuple, list)):
        return f"({', '.join(f'{x:.6g}' for x in value[:6])}{', …' if len(value) > 6 else ''})"
    return f"{value:.6g}"


def _cycle(law: Law) -> str:
    """Loss of the second slow cycle, large enough for all of the memory; parts without one lose nothing."""
    X = law.reach
    one, two = [0.0, X, -X, X], [0.0, X, -X, X, -X, X]
    lost = sum(work(part, two) - work(part, one) for part in parts_of(law) if part.memory)
    return f"a slow cycle between δ = ±{X:.4g} m loses {lost:.6g} J"


def _restitution(law: Law, entry_rate: float, mass: float) -> str:
    """Nominal and achieved."""
    how = "by integration" if law.exact_restitution(entry_rate, mass) is None else "exactly"
    achieved = f"a free mass of {mass:g} kg entering at {entry_rate:g} m/s achieves"
    try:
        value = f"{restitution(law, entry_rate, mass):.6f} ({how})"
    except ValueError as error:
        return f"{achieved} none: {error}"
    if law.nominal is None:
        return f"{achieved} {value}"
    return f"nominal {law.nominal[1]:g} by {law.nominal[0]}; {achieved} {value}"


def _observed(law: Law, entry_rate: float, mass: float) -> list[str]:
    """Where a law without `remarks` pulls and jumps, from samples of its force."""
    try:
        deepest = bounce(law, entry_rate, mass).delta.max()
    except ValueError:  # told as restitution
        return []
    delta, delta_dot = np.meshgrid(deepest * np.linspace(0.02, 1.0, 50), entry_rate * np.linspace(-1.0, 1.0, 41))
    force = law.force(delta, delta_dot, entry_rate)
    worst = np.unravel_index(np.argmin(force), force.shape)
    if force[worst] < 0.0:
        where = f"δ = {delta[worst]:.3g} m, δ̇ = {delta_dot[worst]:.3g} m/s"
        remarks = [f"pulls, for example {-force[worst]:.3g} N at {where}"]
    else:
        remarks = ["pulls nowhere within this bounce's δ and |δ̇| <= entry_rate"]
    begins = min(part.exponent for part in parts_of(law))
    remarks.append("jumps when contact begins" if law.jump else f"begins like δ^{begins:g}")
    return remarks


def _source(law: Law) -> str:
    """Formula and source of the constructor: the first paragraph of its docstring, on one line."""
    assert law.nominal is not None
    doc = inspect.getdoc(getattr(type(law), law.nominal[0])) or ""
    return " ".join(doc.split("\n\n", 1)[0].split())
