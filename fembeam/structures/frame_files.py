"""Frames from mesh files: groups of lines become members, through meshio.

Of a file only corners, branches, named nodes and changes of section are taken; elements are made anew, as few as the
modes need.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.beams import Section, by_group, chosen_names, lines_of, named_nodes, read_mesh, shown
from fembeam.structures.frame import Frame
from fembeam.structures.members import Member
from fembeam.support import require

Vector = NDArray[np.float64]
Chain = tuple[list[int], str]  # nodes, and the group of their lines
STRAIGHT = 1e-6  # sine of the angle below which two lines are one


def frame_of(
    path: str | os.PathLike[str],
    sections: Section | Mapping[Any, Section],
    data: str | None,
    up: Any,
    plane: bool | None,
    options: dict[str, Any],
) -> Frame:
    """The frame in a file; `Frame.from_mesh` explains it."""
    where = f"{path}"
    mesh = read_mesh(path)
    lines, groups = lines_of(mesh, data, sections, where)
    points = np.zeros((len(mesh.points), 3))
    points[:, : np.shape(mesh.points)[1]] = mesh.points
    middles = [f"{shown(points[line].mean(axis=0, keepdims=True))} m" for line in lines]
    chosen = chosen_names(sections, groups, middles, where)
    table = by_group(sections)
    named = _names(mesh)
    chains = list(_chains(points, lines, chosen, set(named), where))
    skew = {group for group, one in table.items() if isinstance(one, Section) and one.I12}
    _require_one_way(points, lines, chosen, chains, skew, where)
    chains, ends = _in_order(points, lines, chains, skew)
    names = {node: named.get(node, f"n{node}") for node in ends}
    flat = not np.any(points[np.unique(lines), 2]) and not options.get("bending_only") if plane is None else plane
    members = [
        Member(names[chain[0]], names[chain[-1]], table[group], up.get(group) if isinstance(up, Mapping) else up, name)
        for (chain, group), name in zip(chains, _numbered([group for _, group in chains]), strict=True)
    ]
    nodes = {name: tuple(float(x) for x in points[node, : 2 if flat else 3]) for node, name in names.items()}
    return Frame(nodes, members, **options)


def _require_one_way(
    points: Vector, lines: NDArray[np.int64], groups: list[str], chains: list[Chain], skew: set[str], where: str
) -> None:
    """Lines of one member must run one way where its section has I12, whose sign goes by it."""
    for chain, group in chains if skew else ():
        inside = {frozenset(pair) for pair in pairwise(chain)}
        along = points[chain[-1]] - points[chain[0]]
        mine = [line for line, own in zip(lines, groups, strict=True) if own == group and frozenset(line) in inside]
        against = [line for line in mine if (points[line[1]] - points[line[0]]) @ along < 0]
        there = shown(points[against[0]]) if against else None
        one_way = group not in skew or len(against) in (0, len(mine))
        require(one_way, "lines of a member must run one way, by which the sign of I12 goes", there, where,
                "turn the lines round that begin there")  # fmt: skip


def _in_order(
    points: Vector, lines: NDArray[np.int64], chains: list[Chain], skew: set[str]
) -> tuple[list[Chain], list[int]]:
    """The chains and their ends in the order of the file; of straight ones along their line.

    That is the way the lines run, or where they run both ways from the lower end, in its longest direction.
    """
    ends = list(dict.fromkeys(node for chain, _ in chains for node in (chain[0], chain[-1])))
    used = points[ends]
    main = int(np.argmax(np.ptp(used, axis=0)))
    low = used[np.argmin(used[:, main])]
    axis = used[np.argmax(used[:, main])] - low
    length = float(np.linalg.norm(axis))
    along = (points - low) @ axis / length
    off = np.linalg.norm(used - low - np.outer(along[ends], axis / length), axis=1)
    if off.max() > STRAIGHT * length:
        return chains, ends
    sense = -1.0 if np.all(along[lines[:, 1]] < along[lines[:, 0]]) else 1.0
    place = sense * along
    turned = [
        (chain if place[chain[0]] < place[chain[-1]] or group in skew else chain[::-1], group)
        for chain, group in chains
    ]
    middle = {id(one): place[one[0][0]] + place[one[0][-1]] for one in turned}
    return sorted(turned, key=lambda one: middle[id(one)]), sorted(ends, key=lambda node: float(place[node]))


def _names(mesh: Any) -> dict[int, str]:
    """{node: name} of points that have a physical name of their own; several of one name are numbered."""
    found = list(named_nodes(mesh))
    names: dict[int, str] = {}
    for (_, node), name in zip(found, _numbered([name for name, _ in found]), strict=True):
        names.setdefault(node, name)
    return names


def _numbered(names: list[str]) -> list[str]:
    """Names, each one of several alike numbered but for empty ones."""
    sizes, seen, numbered = Counter(names), Counter[str](), []
    for name in names:
        seen[name] += 1
        numbered.append(name if sizes[name] == 1 or not name else f"{name} {seen[name]}")
    return numbered


def _chains(
    points: Vector, lines: NDArray[np.int64], groups: list[str], named: set[int], where: str
) -> Iterator[Chain]:
    """Straight chains of lines of one group, from corner to corner, in the order of the file."""
    meeting: dict[int, list[int]] = {}
    for i, line in enumerate(lines):
        for node in line.tolist():
            meeting.setdefault(node, []).append(i)
    spans = points[lines[:, 1]] - points[lines[:, 0]]
    lengths = np.linalg.norm(spans, axis=1)
    thin = np.flatnonzero(lengths == 0)
    at = shown(points[lines[thin, 0]])
    require(not thin.size, "lines must have a length", at, where, "remove the line there")
    along = spans / lengths[:, None]
    for node, mine in meeting.items():
        _require_apart(points[node], [along[i] if lines[i, 0] == node else -along[i] for i in mine], where)

    def passes(node: int) -> bool:
        first, *rest = meeting[node]
        alike = len(rest) == 1 and node not in named and groups[first] == groups[rest[0]]
        return alike and bool(np.linalg.norm(np.cross(along[first], along[rest[0]])) < STRAIGHT)

    used = np.zeros(len(lines), dtype=bool)
    for i, line in enumerate(lines):
        if not used[i]:
            back = _walk(lines, meeting, used, i, int(line[0]), passes)
            ahead = _walk(lines, meeting, used, i, int(line[1]), passes)
            yield [*reversed(back), *ahead], groups[i]


def _require_apart(at: Vector, ways: list[Vector], where: str) -> None:
    """Lines must not lie on each other, as of groups that share lines: stiffness and mass would count twice."""
    apart = np.linalg.norm(np.subtract(ways, np.array(ways)[:, None]), axis=2)
    double = bool(np.any(apart[np.triu_indices(len(ways), 1)] < STRAIGHT))
    require(not double, "lines must not lie on each other", shown([at]) if double else None, where,
            "remove one of those that leave there the same way")  # fmt: skip


def _walk(lines: Any, meeting: dict[int, list[int]], used: Any, line: int, node: int, passes: Any) -> list[int]:
    """Nodes from one end of a line on to the next corner."""
    used[line] = True
    nodes = [node]
    while passes(node):
        line = next(other for other in meeting[node] if other != line)
        if used[line]:
            break
        used[line] = True
        node = int(sum(lines[line]) - node)
        nodes.append(node)
    return nodes
