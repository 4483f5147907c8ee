"""Laws with memory as a user may write them, for `drawn_wider.py`: borders at forces, rates, places, a jump, a stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from contacts import Border, Segment, memory_law


def ratchet_spring(delta, delta_dot, slider, stiffness, up, down):
    return stiffness * (delta - slider)


def left_up(delta, delta_dot, slider, stiffness, up, down):
    return up - stiffness * (delta - slider)


def left_down(delta, delta_dot, slider, stiffness, up, down):
    return down + stiffness * (delta - slider)


def slip_up(delta, delta_dot, slider, stiffness, up, down):
    return up


def slip_down(delta, delta_dot, slider, stiffness, up, down):
    return -down


def rising(delta, delta_dot, slider, stiffness, up, down):
    return delta_dot


def falling(delta, delta_dot, slider, stiffness, up, down):
    return -delta_dot


def held_above(delta, delta_dot, slider, stiffness, up, down):
    return delta - up / stiffness


def held_below(delta, delta_dot, slider, stiffness, up, down):
    return delta + down / stiffness


ratchet = memory_law(  # limits that differ by direction
    "ratchet",
    {
        "stick": Segment(ratchet_spring, (Border(left_up, "up"), Border(left_down, "down"))),
        "up": Segment(slip_up, Border(rising, "stick", held_above)),
        "down": Segment(slip_down, Border(falling, "stick", held_below)),
    },
    {"slider": 0.0},
)


def whole(delta, delta_dot, stiffness, reach, rest):
    return stiffness * delta


def broken(delta, delta_dot, stiffness, reach, rest):
    return rest * delta


def above(delta, delta_dot, stiffness, reach, rest):
    return reach - delta


def below(delta, delta_dot, stiffness, reach, rest):
    return reach + delta


brittle = memory_law(  # most of its stiffness is lost for good
    "brittle",
    {"whole": Segment(whole, (Border(above, "broken"), Border(below, "broken"))), "broken": Segment(broken)},
    jumps=True,
)


def throttle(delta, delta_dot, damping, pace, relieved):
    return damping * delta_dot


def relieved_up(delta, delta_dot, damping, pace, relieved):
    return damping * pace + relieved * (delta_dot - pace)


def relieved_down(delta, delta_dot, damping, pace, relieved):
    return -damping * pace + relieved * (delta_dot + pace)


def slower_up(delta, delta_dot, damping, pace, relieved):
    return pace - delta_dot


def slower_down(delta, delta_dot, damping, pace, relieved):
    return pace + delta_dot


def faster_up(delta, delta_dot, damping, pace, relieved):
    return delta_dot - pace


def faster_down(delta, delta_dot, damping, pace, relieved):
    return -delta_dot - pace


valve = memory_law(  # a damper whose valves open beyond a rate
    "valve",
    {
        "throttled": Segment(
            throttle, (Border(slower_up, "relieved upwards"), Border(slower_down, "relieved downwards"))
        ),
        "relieved upwards": Segment(relieved_up, Border(faster_up, "throttled")),
        "relieved downwards": Segment(relieved_down, Border(faster_down, "throttled")),
    },
)


def no_force(delta, delta_dot, peak, stiffness):
    return 0.0


def crushed(delta, delta_dot, peak, stiffness):
    return stiffness * delta


def springs_back(delta, delta_dot, peak, stiffness):
    return stiffness * delta * (delta / peak) ** 2


def outside(delta, delta_dot, peak, stiffness):
    return -delta


def goes_on(delta, delta_dot, peak, stiffness):
    return delta_dot


def inside(delta, delta_dot, peak, stiffness):
    return delta


def less(delta, delta_dot, peak, stiffness):
    return peak - delta


def deepest(delta, delta_dot, peak, stiffness):
    return delta


foam = memory_law(  # a stop that comes back along a cubic from wherever it turned
    "foam",
    {
        "open": Segment(no_force, Border(outside, "load")),
        "load": Segment(crushed, Border(goes_on, "unload", deepest)),
        "unload": Segment(springs_back, (Border(inside, "open"), Border(less, "load"))),
    },
    {"peak": 1.0},
    opens=True,
)


def draw_own(rng: np.random.Generator, k: float, limit: float, speed: float) -> Any:
    """One of them, about as stiff as k and as strong as the limit."""
    kinds: list[Callable[[], Any]] = [
        lambda: ratchet(stiffness=k, up=limit, down=rng.uniform(0.2, 1.0) * limit),
        lambda: brittle(stiffness=k, reach=limit / k, rest=rng.uniform(0.0, 0.5) * k),
        lambda: valve(damping=limit / speed, pace=rng.uniform(0.1, 0.8) * speed, relieved=0.2 * limit / speed),
        lambda: foam(stiffness=k),
    ]
    return kinds[rng.integers(len(kinds))]()
