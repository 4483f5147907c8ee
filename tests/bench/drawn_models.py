"""Random scenes of all kinds for `random_models.py`, as the tables of a scene file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from finite_elements import Part, Table


@dataclass
class Drawn:
    """A scene, how to reduce it, and how to run it."""

    tables: Table
    how: Table
    duration: float
    dt: Any
    rtol: float
    sizes: tuple[float, float]  # of displacements and velocities
    start: str = "rest"
    brief: bool = False  # without the checks on fine meshes


class Drawer:
    """Draws one scene; ``depth`` from 0 (a clamped beam, a stop, a tone) to 5 (everything)."""

    def __init__(self, seed: int, depth: int) -> None:
        self.rng, self.depth = np.random.default_rng([seed, depth]), depth

    def u(self, low: float, high: float) -> float:
        """Uniform, in few digits."""
        return float(f"{self.rng.uniform(low, high):.4g}")

    def maybe(self, chance: float, depth: int) -> bool:
        """Whether a feature of that depth is there."""
        return bool(self.rng.random() < chance) and self.depth >= depth

    def pick(self, *choices: Any) -> Any:
        """One of them."""
        return choices[self.rng.integers(len(choices))]

    def section(self, h: float) -> Table:
        """A section of about the height h."""
        material = self.pick({"E": 2.1e11, "rho": 7800.0}, {"E": 7e10, "rho": 2700.0}, {"E": 3e9, "rho": 1200.0})
        shape = self.pick("rectangle", "circle", "tube", "general") if self.depth >= 1 else "rectangle"
        if shape == "rectangle":
            return {"shape": shape, **material, "width": 2 * h, "height": h}
        if shape == "general":
            return {"shape": shape, **material, "A": h * h, "I": h**4 / 12, "fibre": 0.6 * h}
        return {
            "shape": shape,
            **material,
            **({"diameter": h} if shape == "circle" else {"outer": h, "inner": 0.7 * h}),
        }

    def beam(self, length: float) -> Table:
        """Uniform, tapered, of spans, on a foundation, under axial force."""
        h = length * self.u(0.006, 0.03)
        one = self.section(h)
        found: Table = {"length": length, "section": one}
        if self.maybe(0.3, 1):
            other = {**one, **{k: v * self.pick(0.5, 0.8, 1.3) for k, v in one.items() if k in ("width", "diameter")}}
            found["section"] = {"shape": "taper", "start": one, "end": other}
        elif self.maybe(0.3, 1):
            share = self.u(0.3, 0.7)
            spans = [
                {"length": share * length, "section": one},
                {"length": length - share * length, "section": self.section(h)},
            ]
            found = {"spans": spans}
        return found

    def supports(self, L: float) -> Table:
        """How a beam is held."""
        ways = [
            {"supports": [("clamped", 0.0)]}, {"supports": [("pinned", 0.0), ("pinned", L)]},
            {"supports": [("clamped", 0.0), ("pinned", L)]}, {"supports": [("pinned", 0.3 * L), ("pinned", 0.9 * L)]},
            {"supports": [("clamped", 0.0), ("guided", L)]}, {"supports": [("pinned", 0.0), ("guided", L)]},
            {"supports": [("pinned", 0.0)], "springs": True}, {"springs": True}, {"supports": [("clamped", L)]},
        ]  # fmt: skip
        found = dict(ways[self.rng.integers(len(ways))] if self.depth >= 1 else ways[0])
        if "supports" in found:
            found["supports"] = [{"kind": kind, "z": z} for kind, z in found["supports"]]
        return found

    def signal(self, size: float, w1: float, base: bool, duration: float) -> Table:
        """A motion or force of about that size around the frequency w1."""
        w = w1 * self.u(0.3, 2.5)
        kind = (
            self.pick("harmonic", "multisine", "pulse", "step", "sine_sweep", "band_noise")
            if self.depth >= 2
            else "harmonic"
        )
        if kind == "harmonic":
            return {
                "kind": kind,
                "amplitude": size,
                "omega": w if base or self.u(0, 1) < 0.8 else 0.0,
                "phase": self.u(0, 6),
            }
        if kind == "multisine":
            return {"kind": kind, "amplitude": [size, 0.4 * size], "omega": [w, 2.2 * w], "phase": [self.u(0, 6), 0.3]}
        if kind in ("pulse", "step"):
            size = 10 * size if base else 4 * size
            name, long = ("peak", "length") if kind == "pulse" else ("size", "rise")
            return {"kind": kind, name: size, long: 20.0 / w, "at": self.u(0, 0.3) * duration}
        if kind == "sine_sweep":
            return {"kind": kind, "amplitude": size, "omega0": 0.4 * w1, "omega1": w + w1, "duration": 1.25 * duration,
                    "rate": self.pick("linear", "logarithmic")}  # fmt: skip
        return {"kind": kind, "std": size, "band": [0.2 * w, 2.0 * w], "seed": int(self.rng.integers(1000)),
                "period": 3 * duration + 300 / w}  # fmt: skip

    def law(self, k: float, depth: float, mass: float, rate: float) -> Table:
        """A stop's law of about the stiffness k at an indentation ``depth``."""
        kind = self.pick("hertz", "hysteretic", "lankarani_nikravesh", "hunt_crossley", "flores", "gonthier",
                         "kelvin_voigt", "piecewise_linear", "polynomial") if self.depth >= 1 else "hertz"  # fmt: skip
        p = self.pick(1.5, 1.5, 1.0, 2.0) if kind in ("hertz", "hysteretic") else 1.5
        power = k * depth ** (1 - p)
        if kind == "kelvin_voigt":
            return {
                "kind": kind,
                "stiffness": k,
                "damping": self.u(0.02, 0.5) * math.sqrt(k * mass),
                "clamp": self.pick(True, False),
            }
        if kind == "piecewise_linear":
            return {"kind": kind, "slopes": [0.5 * k, 2 * k], "knots": [self.u(0.2, 0.8) * depth]}
        if kind == "polynomial":
            return {"kind": kind, "coefficients": [0.7 * k, 0.0, 0.5 * k / depth**2]}
        if kind == "hertz":
            return {"kind": kind, "stiffness": power, "exponent": p}
        more = {"clamp": self.pick(True, False), "entry_rate_floor": self.pick(1e-3, 0.05) * rate}
        if kind == "hysteretic":
            return {"kind": kind, "stiffness": power, "damping_factor": self.u(0.1, 1.0), "exponent": p, **more}
        return {"kind": kind, "stiffness": power, "restitution": self.u(0.4, 0.9), **more}

    def element_law(self, k: float, size: float, mass: float) -> Table:
        """A law of an element of about the stiffness k for deformations of about ``size``."""
        kind = self.pick("polynomial", "kelvin_voigt", "jenkins", "elasto_plastic", "bouc_wen")
        return {
            "polynomial": {"coefficients": [0.5 * k, 0.0, 0.5 * k / size**2]},
            "kelvin_voigt": {"stiffness": k, "damping": 0.05 * math.sqrt(k * mass)},
            "jenkins": {"stiffness": k, "limit": 0.3 * k * size},
            "elasto_plastic": {"stiffness": k, "yield_force": 0.3 * k * size, "hardening": 0.2 * k},
            "bouc_wen": {"stiffness": k, "alpha": 0.2, "A": 1.0, "beta": 0.7 / size, "gamma": 0.3 / size, "n": 1},
        }[kind] | {"kind": kind}

    def structure(self, L: float) -> tuple[Table, float, float]:
        """A linear structure, its first frequency and mass."""
        found = {"beam": self.beam(L), **self.supports(L)}
        sprung = found.pop("springs", False)
        bare = Part(found, np.linspace(0.0, L, 9))
        mass = float(bare.r @ bare.M @ bare.r)
        stiff = at_mid = float(bare.K[2, 2]) * (L / 8) ** 3 / L**3  # 12 EI/L³ about
        if self.maybe(0.25, 1):
            found["beam"]["foundation"] = self.u(5, 80) * at_mid / L
        if self.maybe(0.35, 1):
            found["beam"]["axial_force"] = self.pick(-0.1, 0.5, 3.0) * at_mid * L
        if sprung or self.maybe(0.3, 1):
            found["springs"] = []
            for z in (0.1 * L, 0.8 * L):
                turning = self.pick(0.0, 0.1 * stiff * L * L)
                found["springs"].append({"z": z, "stiffness": self.u(0.5, 5) * stiff, "rotational": turning})
        if self.depth == 0 or self.maybe(0.6, 1):
            found["masses"] = [{"z": self.u(0.5, 0.95) * L, "mass": self.u(0.1, 1.5) * mass}]
            if self.maybe(0.5, 1):
                found["masses"][0] |= {"inertia": self.u(0.001, 0.02) * mass * L * L, "offset": self.u(-0.05, 0.05) * L}
        if self.maybe(0.3, 2):
            found["dashpots"] = [{"z": self.u(0.4, 0.9) * L, "damping": self.u(0.02, 0.4) * math.sqrt(stiff * mass),
                                  "rotational": self.pick(0.0, 0.01 * math.sqrt(stiff * mass) * L * L)}]  # fmt: skip
        zeta: Any = [0.02, 0.01]
        found["damping"] = {"zeta": zeta}
        whole = Part(found, np.linspace(0.0, L, 9))
        if whole.free_modes()[0][0] <= 0.0:  # buckled
            found["beam"]["axial_force"] = 0.0
            whole = Part(found, whole.nodes)
        w1 = math.sqrt(max(whole.free_modes()[0][0], 0.0))
        if self.maybe(0.4, 2):
            found["damping"] = self.pick(
                {"zeta": self.u(0.0, 0.1)}, {"alpha": 0.02 * w1, "beta": 0.01 / w1}, {"zeta": [0.05, 0.0, 0.3]}
            )
        return found, w1, float(whole.r @ whole.M @ whole.r)

    def draw(self) -> Drawn:
        """The scene."""
        rng, L = self.rng, self.u(0.2, 5.0)
        tables, w1, mass = self.structure(L)
        size = L * 10 ** self.u(-4, -2.5)
        rate, duration = w1 * size, self.u(2, 5) * 2 * math.pi / w1
        tc = self.u(0.1, 0.5) / w1
        k, deep = 0.3 * mass / tc**2, 0.3 * rate * tc
        tables["stops"] = []
        for _ in range(1 if self.depth < 2 else int(rng.integers(0, 4))):
            z, gap = self.u(0.35, 0.85) * L, self.pick(0.0, self.u(0.05, 0.8) * size, -self.u(0.0, 0.2) * size)
            gap = self.u(0.1, 0.6) * size if self.depth == 0 else gap
            stop = {"z": z, "gap": gap, "side": self.pick("below", "above") if self.depth else "below"}
            stop["law"] = self.law(k, deep, mass, rate)
            if self.maybe(0.2, 3):
                stop |= {
                    "of": "rotation",
                    "gap": gap / L,
                    "law": self.law(0.1 * k * L * L, 5 * deep / L, 0.1 * mass * L * L, rate / L),
                }
            elif self.maybe(0.15, 3):
                stop["on"] = self.u(0.05, 0.3) * L
            tables["stops"].append(stop)
        if self.depth < 2 or rng.random() < 0.6:
            tables["base"] = self.signal(0.6 * size, w1, True, duration)
        tables["forces"] = []
        for _ in range(0 if self.depth < 2 else int(rng.integers(0, 3))):
            kind = self.pick("point_force", "point_moment")
            force = 0.3 * mass * w1 * rate * (0.2 * L if kind == "point_moment" else 1.0)
            tables["forces"].append(
                {"kind": kind, "z": self.u(0.1, 1.0) * L, "signal": self.signal(force, w1, False, duration)}
            )
        if "springs" in tables and self.maybe(0.4, 2):
            tables["springs"][0]["foot"] = self.signal(size, w1, False, duration)
        if self.maybe(0.25, 2):
            tables["gravity"] = 0.5 * w1 * rate
        tables["elements"] = []
        for _ in range(0 if self.depth < 3 else int(rng.integers(0, 3))):
            one: Table = {
                "z": self.u(0.35, 0.9) * L,
                "law": self.element_law(0.3 * mass * w1**2, size, mass),
                "gap": self.pick(0.0, 0.1 * size),
            }
            if self.maybe(0.3, 3):
                one |= {
                    "of": "rotation",
                    "law": self.element_law(0.03 * mass * (w1 * L) ** 2, size / L, 0.1 * mass * L * L),
                    "gap": 0.0,
                }
            elif self.maybe(0.25, 3):
                one["to"] = self.u(0.05, 0.3) * L
            tables["elements"].append(one)
        if self.maybe(0.3, 3):
            side = self.pick("above", "below", "both")
            own = {"stiffness": 0.2 * mass * w1**2, "damping": 0.01 * mass * w1} if rng.random() < 0.5 else {}
            struck = {"z": self.u(0.4, 0.8) * L, "mass": 0.2 * mass, "velocity": rate if side == "below" else -rate}
            struck |= {"law": self.law(k, deep, mass, rate), "gap": self.u(0.1, 1) * size, "side": side, **own}
            tables["impactors"] = [struck]
        if self.maybe(0.25, 4):
            self.body(tables, size, k, deep, mass, rate, L)
        tables = {name: value for name, value in tables.items() if value != []}
        acting = any(name in tables for name in ("stops", "elements", "forces", "dashpots"))
        how: Table = {"modes": int(rng.integers(1, 5)), "elements": int(rng.integers(6, 13))}
        if self.maybe(0.2, 1):
            how["modes"] = [0, *sorted(rng.choice([1, 2, 3, 4], int(rng.integers(1, 3)), replace=False).tolist())]
        elif acting and self.maybe(0.4, 2):
            how[self.pick("residual", "interface") if "bodies" not in tables else "residual"] = True
        dt = self.pick(duration / 50, duration / 37.3, None) if self.depth >= 1 else duration / 50
        rtol = self.pick(1e-6, 1e-8, 1e-9, 1e-10) if self.depth >= 1 else 1e-8
        start = self.pick("rest", "rest", "moving", "equilibrium") if self.depth >= 2 else "rest"
        driven = any(name in tables for name in ("base", "forces", "gravity", "impactors"))
        start = start if driven else "moving"
        return Drawn(tables, how, duration, dt, rtol, (size, rate), start)

    def body(self, tables: Table, size: float, k: float, deep: float, mass: float, rate: float, L: float) -> None:
        """A second beam that the first one meets."""
        l2 = self.u(0.5, 1.5) * L
        other, _, _ = self.structure(l2)
        other["stops"] = [{"z": 0.7 * l2, "gap": 0.5 * size, "side": "above", "law": self.law(k, deep, mass, rate)}]
        tables["bodies"] = [other]
        z, law = self.u(0.35, 0.85), self.law(k, deep, mass, rate)
        tables["stops"].append({"z": z * L, "gap": 0.3 * size, "on": (1, 0.6 * l2), "law": law})
        if self.maybe(0.4, 4):
            tables["elements"].append({"z": 0.4 * L, "to": (1, 0.5 * l2), "law": self.element_law(0.2 * k, size, mass)})
