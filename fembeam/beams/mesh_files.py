"""Beams from and to mesh files: line elements along a straight axis, through meshio.

What is taken from a file is where sections begin and end, and the places that node sets name. The elements themselves
are made anew, as few as the modes need, so that a file's element size changes nothing.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from errno import ENOENT
from io import StringIO
from itertools import combinations, groupby, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fembeam.beams.beam import Beam
from fembeam.beams.mesh import SHORTEST, divided
from fembeam.beams.mesh_cards import abaqus_mesh, nastran_mesh
from fembeam.beams.section import Section, Taper
from fembeam.support import file_path, is_whole, require, warn, written_beside

Vector = NDArray[np.float64]
Names = list[set[str]]

LINES = ("line", "line3", "line4")  # of higher ones the ends are used
READERS = {".inp": abaqus_mesh, ".bdf": nastran_mesh, ".nas": nastran_mesh, ".fem": nastran_mesh}  # of ours
# suffixes, and what meshio needs to know
WRITERS: dict[str, Any] = {".msh": {"file_format": "gmsh22", "binary": False}, ".inp": {}, ".vtu": {}, ".vtk": {}}
STRAIGHT = 1e-6  # of the length: farther from the axis is a bend


def beam_of(
    path: str | os.PathLike[str],
    sections: Section | Taper | Mapping[Any, Section | Taper],
    data: str | None = None,
    foundation: float = 0.0,
    axial_force: float = 0.0,
) -> Beam:
    """The beam in a file; `Beam.from_mesh` explains it."""
    where = f"{path}"
    mesh = read_mesh(path)
    lines, names = lines_of(mesh, data, sections, where)
    z, off = _along(np.asarray(mesh.points, dtype=float), lines, where)
    chain, order = _chained(z, lines, mesh.points, where)
    chosen = chosen_names(sections, [names[i] for i in order], [f"z = {z:.6g} m" for z in chain], where)
    _warn_of_size(chain, where)
    spans, index = [], 0
    table = by_group(sections)
    for name, group in groupby(chosen):
        after = index + len(list(group))
        spans.append((float(chain[after] - chain[index]), table[name]))
        index = after
    beam = Beam.of_spans(spans, foundation, axial_force)
    on = off <= STRAIGHT * beam.length  # nodes elsewhere, such as reference points, are no places of the beam
    on &= np.abs(z - (chain[0] + chain[-1]) / 2) <= (0.5 + STRAIGHT) * beam.length
    named = [(name, node) for name, node in named_nodes(mesh) if on[node]]
    places = [(name, float(np.clip(z[node] - chain[0], 0.0, beam.length))) for name, node in named]
    return Beam(beam.length, beam.section, beam.spans, foundation, axial_force, tuple(sorted(places)))


def read_mesh(path: str | os.PathLike[str]) -> Any:
    """The file, or a ValueError that says why not."""
    import meshio

    file = file_path(path, "read_mesh")
    if not file.is_file():
        raise FileNotFoundError(ENOENT, "this mesh does not exist", f"{path}")
    if reader := READERS.get(file.suffix.lower()):
        return reader(file)
    said = StringIO()
    try:
        with _mended_reader(), redirect_stdout(said):
            mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio raises many kinds, and exits for unknown suffixes
        reason = f"{_reason(error, said.getvalue())}; is it cut, or of another format than its suffix says?"
        raise ValueError(f"{path} cannot be read as a mesh: {reason}") from error
    for block in mesh.cells:  # of a node that is not there the readers of gmsh make -1, the last one
        inside = not len(block.data) or (np.min(block.data) >= 0 and np.max(block.data) < len(mesh.points))
        require(bool(inside), "cells must have nodes that are defined", f"others in a {block.type}", f"{path}",
                "export it again: it is cut or edited")  # fmt: skip
    return mesh


def _reason(error: BaseException, said: str) -> str:
    """Why meshio does not read a file: what it raised, or printed before it exits with a number."""
    if isinstance(error, SystemExit) and is_whole(error.code):
        return said.strip() or "unknown format"
    return f"{error}" or "unknown format"


@contextmanager
def _mended_reader() -> Iterator[None]:
    """Lend meshio's reader of gmsh 4.1 what it lacks, and leave it as it was: other code may read with it."""
    from meshio.gmsh import _gmsh41

    mesh = _gmsh41.Mesh
    _gmsh41.Mesh = _even_mesh
    try:
        yield
    finally:
        _gmsh41.Mesh = mesh


def _even_mesh(points: Any, cells: Any, cell_data: Any, **rest: Any) -> Any:
    """A mesh of gmsh's format 4.1 without data that meshio has for some cells only, those in groups; sets name them."""
    import meshio

    even = {name: data for name, data in cell_data.items() if len(data) == len(cells)}
    return meshio.Mesh(points, cells, cell_data=even, **rest)


def lines_of(mesh: Any, data: str | None, sections: Any, where: str) -> tuple[NDArray[np.int64], Names]:
    """Ends (e, 2) of all line elements and the names each goes by.

    Gmsh's format 2.2 has a line of several groups once for each: those of groups without a section are left out.
    """
    others = Counter({block.type: len(block.data) for block in mesh.cells if block.type not in (*LINES, "vertex")})
    require(not others, "cells must be lines", dict(others), where, "mesh the axes only")
    blocks = [i for i, block in enumerate(mesh.cells) if block.type in LINES and len(block.data)]
    require(bool(blocks), "the mesh must hold lines", [b.type for b in mesh.cells], where, "mesh the axis")
    points = np.asarray(mesh.points, dtype=float)
    lines = np.concatenate([_ends(points, np.asarray(mesh.cells[i].data, dtype=np.int64)) for i in blocks])
    names = [name for i in blocks for name in _names(mesh, i, data, where)]
    if not isinstance(sections, Mapping):
        return lines, names
    wanted, pairs = {str(key) for key in sections}, [frozenset(line) for line in lines.tolist()]
    known = {pair for pair, found in zip(pairs, names, strict=True) if found & wanted}
    kept = [i for i, found in enumerate(names) if found & wanted or pairs[i] not in known]
    return lines[kept], [names[i] for i in kept]


def _ends(points: Vector, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """The two nodes (e, 2) of each line that are farthest apart; Abaqus has the one in the middle second."""
    pairs = list(combinations(range(nodes.shape[1]), 2))
    apart = [np.linalg.norm(points[nodes[:, a]] - points[nodes[:, b]], axis=1) for a, b in pairs]
    return np.take_along_axis(nodes, np.array(pairs)[np.argmax(apart, axis=0)], axis=1)


def _names(mesh: Any, block: int, data: str | None, where: str) -> Names:
    """Names of every cell of a block: its sets, else its number in the cell data."""
    found: Names = [set() for _ in mesh.cells[block].data]
    if data is None:
        for name, cells in mesh.cell_sets.items():
            if not name.startswith("gmsh:") and cells[block] is not None:
                for cell in np.asarray(cells[block], dtype=np.int64):
                    found[cell].add(name)
        if any(found):
            return found
        data = _numbering(mesh)
    if data is not None:
        require(data in mesh.cell_data, f"data must be one of {', '.join(mesh.cell_data) or 'none'}", data, where,
                "name a cell data array of the file")  # fmt: skip
        numbers = np.asarray(mesh.cell_data[data][block])
        known = {tag: [name] for tag, name in _physical(mesh, 1).items()}
        known |= getattr(mesh, "cell_tags", {})  # families of MED: one for each combination of groups
        for cell, number in enumerate(numbers):
            whole = int(number) if float(number).is_integer() else number
            found[cell] |= {str(whole), *known.get(whole, ())}
    return found


def _physical(mesh: Any, dimension: int) -> dict[int, str]:
    """{number: name} of gmsh's groups of points (0) or lines (1); of MED there stand names of fields instead."""
    groups = {name: pair for name, pair in mesh.field_data.items() if name != "med:nom"}
    return {int(pair[0]): name for name, pair in groups.items() if pair[1] == dimension}


def _numbering(mesh: Any) -> str | None:
    """The cell data that numbers the sections: gmsh's, or the only array of whole numbers."""
    for name, known in (("gmsh:physical", True), ("cell_tags", bool(getattr(mesh, "cell_tags", None)))):
        if known and name in mesh.cell_data:
            return name
    whole = [name for name, blocks in mesh.cell_data.items()
             if all(np.asarray(b).ndim == 1 and np.all(np.mod(b, 1) == 0) for b in blocks)]  # fmt: skip
    own = [name for name in whole if not name.startswith("gmsh:")]
    return own[0] if len(own) == 1 else None


def _along(points: Vector, lines: NDArray[np.int64], where: str) -> tuple[Vector, Vector]:
    """Coordinates (p,) of all points along the axis of the lines, and their distances from it."""
    points = points.reshape(len(points), -1)
    used = points[np.unique(lines)]
    size = np.ptp(used, axis=0)
    main = int(np.argmax(size))
    first, last = used[np.argmin(used[:, main])], used[np.argmax(used[:, main])]
    length = float(np.linalg.norm(last - first))
    require(length > 0, "the lines must have a length", length, where, "check the coordinates")
    axis = (last - first) / length
    z = (points - first) @ axis
    off = np.linalg.norm(points - first - z[:, None] * axis, axis=1)
    bent = np.unique(lines)[off[np.unique(lines)] > STRAIGHT * length]
    require(not bent.size, "the lines must lie on one straight axis", shown(points[bent[:1]]), where,
            "a node is off it there; bent ones are read by Frame.from_mesh")  # fmt: skip
    return z, off


def _chained(z: Vector, lines: NDArray[np.int64], points: Vector, where: str) -> tuple[Vector, NDArray[np.int64]]:
    """Coordinates (e + 1,) of the chain of elements from end to end, and the order of the elements in it."""
    ends = np.sort(z[lines], axis=1)
    order = np.argsort(ends.mean(axis=1))
    nodes, counts = np.unique(lines, return_counts=True)
    many = nodes[counts > 2]
    require(not many.size, "lines must not branch: at most two meet in a node", shown(points[many[:1]]), where,
            "remove the branch, or elements that lie on each other")  # fmt: skip
    for before, after in pairwise(order):
        shared = len(set(lines[before]) & set(lines[after])) == 1
        joined = shared and ends[before, 1] <= ends[after, 0] + 1e-12 * np.ptp(z)
        at = points[lines[after][np.argmin(z[lines[after]])]]
        require(joined, "lines must be connected end to end", shown([at]), where,
                "a part begins there that does not share a node with the one before; merge double nodes")  # fmt: skip
    chain = np.append(ends[order, 0], ends[order[-1], 1])
    thin = np.flatnonzero(np.diff(chain) <= 0)
    require(not thin.size, "elements must have a length", float(chain[thin[0]]) if thin.size else 0.0, where,
            "remove the element there")  # fmt: skip
    return chain, order


def shown(points: Any) -> tuple[float, ...] | None:
    """One point for a message."""
    return tuple(float(f"{x:.6g}") for x in points[0]) if len(points) else None


def by_group(sections: Any) -> dict[str, Any]:
    """Sections by the names of their groups; one for all elements has the name ""."""
    return {"": sections} if isinstance(sections, (Section, Taper)) else {str(k): s for k, s in sections.items()}


def chosen_names(sections: Any, names: Names, places: Sequence[str], where: str) -> list[str]:
    """The one name of every element that has a section; `places` tell where it begins."""
    if isinstance(sections, (Section, Taper)):
        return [""] * len(names)
    wanted = {str(key) for key in sections}
    there = set().union(*names)
    missing = sorted(wanted - there)
    listed = ", ".join(sorted(there)) or "none"
    require(not missing, f"sections must name groups of the file (it has {listed})", missing, where, "rename them")
    chosen = []
    for found, at in zip(names, places, strict=False):
        mine = sorted(found & wanted)
        has = ", ".join(sorted(found)) or "no group"
        require(len(mine) == 1, "every element must have one section", mine or f"none for {has}", f"{where} at {at}",
                f"give a section for one of its groups; the file has {listed}")  # fmt: skip
        chosen.append(mine[0])
    return chosen


def _warn_of_size(chain: Vector, where: str) -> None:
    """Warn of elements so short that sections cannot change from one to the next."""
    lengths, total = np.diff(chain), chain[-1] - chain[0]
    if lengths.min() < SHORTEST * total:
        place = chain[int(np.argmin(lengths))] - chain[0]
        size = f"{lengths.min():.3g} m at z = {place:.6g} m"
        warn(f"elements of {where} are far too fine: {size}, below "
             f"{SHORTEST:g} of the length; a section that changes there is refused")  # fmt: skip


def named_nodes(mesh: Any) -> Iterator[tuple[str, int]]:
    """(name, node) of every point set and every group of vertices."""
    for name, nodes in mesh.point_sets.items():
        yield from ((name, int(node)) for node in np.asarray(nodes).ravel())
    for family, names in getattr(mesh, "point_tags", {}).items():
        nodes = np.flatnonzero(np.asarray(mesh.point_data["point_tags"]) == family)
        yield from ((name, int(node)) for name in names for node in nodes)
    tags = mesh.cell_data.get("gmsh:physical")
    known = _physical(mesh, 0)
    for i, block in enumerate(mesh.cells):
        if block.type != "vertex":
            continue
        found = []
        if tags is not None:
            pairs = zip(np.asarray(tags[i]), block.data[:, 0], strict=True)
            found += [(known[int(tag)], int(node)) for tag, node in pairs if int(tag) in known]
        for name in known.values():  # sets have all groups of a point, tags the first one
            cells = mesh.cell_sets.get(name, [None] * len(mesh.cells))[i]
            found += (
                [] if cells is None else [(name, int(node)) for node in block.data[np.asarray(cells, dtype=int), 0]]
            )
        yield from dict.fromkeys(found)


def to_mesh(beam: Beam, path: str | os.PathLike[str], elements: int = 100) -> dict[str, Section | Taper]:
    """Write a beam as line elements: .msh, .inp (with groups for spans and places), .vtu, .vtk (spans only).

    Parameters
    ----------
    path : its suffix is the format; cell data `section` number the spans from 1 where a format has no groups.
    elements : about how many.

    Returns
    -------
    The `sections` with which `Beam.from_mesh` reads it back.
    """
    target = file_path(path, "to_mesh")
    where, borders = "to_mesh", np.array(beam.borders)
    known = target.suffix in WRITERS
    require(is_whole(elements) and elements > 0, "elements must be a whole number above 0", elements, where,
            "give a count")  # fmt: skip
    require(known, f"the suffix must be one of {', '.join(WRITERS)}", target.suffix, where, "choose one")
    apart = [name for name, _ in beam.places if set(name) & set(',"\n')]
    require(not apart, "names of places must have no commas and quotes", apart, where, "such files end names there")
    counts = np.maximum(1, np.round(elements * np.diff(borders) / beam.length)).astype(int)
    z = np.unique(np.concatenate([divided(borders, counts), [place for _, place in beam.places]]))
    group = 1 + np.searchsorted(borders[1:-1], (z[:-1] + z[1:]) / 2)
    grouped = target.suffix in (".msh", ".inp")
    keys = [f"span_{i}" if grouped else f"{i}" for i in range(1, len(beam.spans) + 1)]
    mesh = (_gmsh if target.suffix == ".msh" else _plain)(beam, z, group, keys, target.suffix == ".inp")
    with written_beside(target) as draft:
        mesh.write(draft, **WRITERS[target.suffix])
    return {key: section for key, (_, section) in zip(keys, beam.spans, strict=True)}


def _on_axis(z: Vector) -> tuple[Vector, NDArray[np.int64]]:
    """Points (p, 3) and lines (p - 1, 2)."""
    count = np.arange(len(z) - 1)
    return np.column_stack([z, np.zeros((len(z), 2))]), np.column_stack([count, count + 1])


def _plain(beam: Beam, z: Vector, group: NDArray[np.int64], keys: list[str], sets: bool) -> Any:
    """Spans as cell data, or as sets of elements beside sets of nodes."""
    import meshio

    points, lines = _on_axis(z)
    if not sets:
        return meshio.Mesh(points, [("line", lines)], cell_data={"section": [group]})
    spans = {key: [np.flatnonzero(group == i)] for i, key in enumerate(keys, 1)}
    places = {name: np.searchsorted(z, [at for other, at in beam.places if other == name]) for name, _ in beam.places}
    return meshio.Mesh(points, [("line", lines)], cell_sets=spans, point_sets=places)


def _gmsh(beam: Beam, z: Vector, group: NDArray[np.int64], keys: list[str], _: bool) -> Any:
    """Spans and places as physical groups."""
    import meshio

    points, lines = _on_axis(z)
    labels = list(dict.fromkeys(name for name, _ in beam.places))
    fields = {key: np.array([i, 1]) for i, key in enumerate(keys, 1)}
    fields |= {name: np.array([i, 0]) for i, name in enumerate(labels, 1)}
    cells: list[tuple[str, Any]] = [("line", lines)]
    tags = [group]
    if labels:
        cells.append(("vertex", np.searchsorted(z, [at for _, at in beam.places])[:, None]))
        tags.append(np.array([1 + labels.index(name) for name, _ in beam.places]))
    return meshio.Mesh(points, cells, cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags}, field_data=fields)
