"""Drawings of rigs: beams, walls, springs, masses, in the units of an axis of equal scales."""

import numpy as np
from matplotlib.patches import Circle, FancyArrowPatch, Polygon, Rectangle

INK = {"color": "0.15", "lw": 1.2}


def line(axis, x, y, **style):
    """Through points."""
    axis.plot(x, y, **{**INK, "solid_capstyle": "round", **style})


def wall(axis, x, y, length=0.6, angle=90.0, side=1.0):
    """A rigid surface through (x, y) along an angle (degrees), hatched on its left (side 1) or right (-1)."""
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    across = side * np.array([-along[1], along[0]])
    ends = np.array([x, y]) + np.outer([-0.5, 0.5], length * along)
    line(axis, *ends.T, lw=1.6)
    for share in np.linspace(0.0, 1.0, max(int(length / 0.1), 3)):
        foot = ends[0] + share * (ends[1] - ends[0])
        line(axis, *np.array([foot, foot + 0.09 * (across - along)]).T, lw=0.7)


def beam(axis, start, end, y=0.0, height=0.07):
    """A beam between two abscissae."""
    axis.add_patch(Rectangle((start, y - height / 2), end - start, height, fc="0.85", ec="0.15", lw=1.0))


def _ways(start, end, width):
    """The start, the way to the end, and the width across it."""
    start, along = np.array(start, float), np.subtract(end, start)
    return start, along, np.array([-along[1], along[0]]) / np.hypot(*along) * width


def spring(axis, start, end, turns=5, width=0.07):
    """A spring between two points."""
    start, along, across = _ways(start, end, width)
    share = np.concatenate(([0.0], np.linspace(0.15, 0.85, 2 * turns + 1), [1.0]))
    swing = np.zeros(share.size)
    swing[2:-2:2], swing[3:-2:2] = 1.0, -1.0
    line(axis, *(start + np.outer(share, along) + np.outer(swing, across)).T, lw=1.0)


def dashpot(axis, start, end, width=0.07):
    """A dashpot between two points."""
    start, along, across = _ways(start, end, width)
    for points in ([(0, 0), (0.5, 0)], [(0.5, -0.7), (0.5, 0.7)], [(0.68, 0), (1, 0)],
                   [(0.35, 1), (0.68, 1), (0.68, -1), (0.35, -1)]):  # fmt: skip
        line(axis, *np.array([start + a * along + b * across for a, b in points]).T, lw=1.0)


def slider(axis, start, end, width=0.07):
    """A dry slider between two points."""
    start, along, across = _ways(start, end, width)
    for points in ([(0, 0), (0.6, 0)], [(0.6, -1), (0.6, 1)], [(0.66, -1), (0.66, 1)], [(0.66, 0), (1, 0)]):
        line(axis, *np.array([start + a * along + b * across for a, b in points]).T, lw=1.0)


def block(axis, x, y, text="", width=0.4, height=0.4):
    """A rigid mass about (x, y)."""
    axis.add_patch(Rectangle((x - width / 2, y - height / 2), width, height, fc="0.92", ec="0.15", lw=1.2, zorder=3))
    axis.text(x, y, text, ha="center", va="center", zorder=4)


def ball(axis, x, y, radius, text=""):
    """A ball about (x, y)."""
    axis.add_patch(Circle((x, y), radius, fc="0.92", ec="0.15", lw=1.2, zorder=3))
    axis.text(x, y, text, ha="center", va="center", zorder=4)


def pin(axis, x, y, size=0.14):
    """A support that lets turn, below (x, y)."""
    axis.add_patch(Polygon([(x, y), (x - size / 2, y - size), (x + size / 2, y - size)], fc="w", ec="0.15", lw=1.0))
    wall(axis, x, y - size, 0.3, 0.0, -1.0)


def stop(axis, x, y, height=0.3):
    """A stop whose top is at (x, y), on the ground."""
    spring(axis, (x, y - height), (x, y - 0.03))
    line(axis, [x - 0.08, x + 0.08], [y - 0.03, y - 0.03], lw=2.0)
    wall(axis, x, y - height, 0.35, 0.0, -1.0)


def arrow(axis, start, end, text="", both=False, shift=(0.0, 0.0)):
    """An arrow with a text at its end, or, of both heads, at its middle."""
    style = "<->" if both else "->"
    axis.add_patch(FancyArrowPatch(start, end, arrowstyle=style, mutation_scale=10, lw=1.0, color="0.15", zorder=5))
    place = np.add(start, end) / 2 if both else np.array(end)
    axis.text(*(place + shift), text, ha="center", va="center")


def view(axis, left, right, low, high):
    """What is seen."""
    axis.set(xlim=(left, right), ylim=(low, high))
