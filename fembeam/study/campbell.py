"""Campbell diagram: frequencies of a rotor over its spin, with the sense in which it whirls, and critical speeds.

M q'' + Ω G q' + K q = 0 on real modes at standstill; stops, elements, damping and loads are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

import reduction
from fembeam import plot
from fembeam.scene import Scene
from fembeam.structures import COMPONENTS, Frame
from fembeam.study.result import Result
from fembeam.support import Part, counting, is_whole, require, vector
from solvers.problem import counted

Vector = NDArray[np.float64]
WHERE = "campbell"
SPARE = 12  # modes at standstill besides twice those shown that the mesh has to know
BASIS = 48  # modes of that mesh besides twice those shown: a heavy disk that spins fast turns the shaft sharply
MOST = 64  # modes shown; twice as many take minutes
ACROSS = 1e-12  # of the largest motion across the shaft, squared: less is twist or stretch, which spin does not excite
STILL = 1e-9  # of |G|: a rigid motion that does not turn the shaft's axis, such as its own rotation
SENSES = {1: "forward", -1: "backward", 0: "straight"}


@dataclass(frozen=True, eq=False, repr=False)
class Campbell(Result):
    """Frequencies over spin.

    Attributes
    ----------
    spins : Ω (k,), rad/s.
    omega : (k, n) rad/s, ascending for each spin.
    turning : (k, n) 1 for forward whirl (the way of a positive spin), -1 backward, 0 for motion on a line.
    critical : (c,) spins at which a whirl has the frequency of the spin, up to the largest spin; negative for backward
        ones, which an unbalance of a round rotor does not excite.
    """

    INDEX: ClassVar[str] = "spin"

    spins: Vector
    omega: Vector
    turning: NDArray[np.int64]
    critical: Vector

    def __repr__(self) -> str:
        return f"<Campbell diagram of {counted(self.omega.shape[1], 'mode')} over {len(self.spins)} spins>"

    @property
    def signed(self) -> Vector:
        """(k, n) rad/s, negative for backward whirl."""
        return np.where(self.turning < 0, -self.omega, self.omega)

    def table(self) -> list[dict[str, Any]]:
        """A row for each spin: the frequencies in rad/s, negative for backward whirl."""
        names = [f"mode {i + 1}" for i in range(self.omega.shape[1])]
        return [
            {"spin": float(spin), **dict(zip(names, row.tolist(), strict=True))}
            for spin, row in zip(self.spins, self.signed, strict=True)
        ]

    def _units(self) -> dict[str, str]:
        return dict.fromkeys(self.table()[0], "rad/s")

    figure = plot.campbell

    def _parts(self) -> list[Part]:
        found = ", ".join(f"{abs(w):.6g} rad/s ({SENSES[int(np.sign(w))]})" for w in self.critical)
        head = ["spin / rad/s", *(f"ω{i + 1}" for i in range(self.omega.shape[1]))]
        rows = [[float(spin), *row.tolist()] for spin, row in zip(self.spins, self.signed, strict=True)]
        return [repr(self), f"critical speeds: {found or 'none in this range'}", (head, rows)]


def campbell(
    scene: Scene, spins: ArrayLike, modes: int = 4, elements: int | None = None, progress: bool = False
) -> Campbell:
    """Frequencies of a rotor over its spin, and its critical speeds.

    Parameters
    ----------
    scene : with a straight `Frame` in space, whatever its own spin; its disks, masses, springs and supports count.
        Stops, elements and bodies that these alone connect with it do not.
    spins : (k,) rad/s, ascending.
    modes : how many frequencies of each spin, 1 to 64.
    elements : of the mesh; None: as few as make the frequencies right to 1e-6.
    progress : show a bar (on terminals and in notebooks only).

    Returns
    -------
    Campbell : print it, `table()`, `figure()`, `critical`.

    Raises
    ------
    ValueError : a body that is no shaft, spins that are not ascending numbers, modes that is no such count.

    References
    ----------
    W. Campbell, Protection of steam turbine disk wheels from axial vibration, Trans. ASME 46 (1924) 31.

    Examples
    --------
    >>> import fembeam as fb
    >>> shaft = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), bending_only=True)
    >>> scene = fb.Scene(shaft, [fb.Clamped("A")], masses=[fb.Disk("B", 12.0, diametral=0.04, polar=0.075)])
    >>> found = campbell(scene, [0.0, 300.0], modes=2)
    >>> found.signed[1].round(1).tolist(), found.critical.round(1).tolist()
    ([-208.8, 223.9], [-211.0, 222.0])
    """
    speeds = vector("spins", spins, WHERE, "give rad/s, such as np.linspace(0, 600)",
                    "must be finite and ascending, (k,)",
                    lambda x: np.isfinite(x).all() and np.all(np.diff(x) > 0))  # fmt: skip
    check_modes(modes)
    basis, G, across = _at_unit_spin(scene, int(modes), elements)
    found = [
        (one.omega[:modes], one.turning[:modes])
        for one in (reduction.whirl(basis, spin * G, *across) for spin in counting(progress, speeds, unit=" spins"))
    ]
    met = reduction.critical_speeds(basis, G, *across)
    critical = met.signed[_bends(met, across)]
    return Campbell(
        speeds,
        np.array([omega for omega, _ in found]),
        np.array([turning for _, turning in found]),
        critical[np.abs(critical) <= np.abs(speeds).max()],
    )


def check_modes(modes: Any) -> None:
    """Raise ValueError unless modes is a count that takes seconds: time grows with its third power."""
    require(is_whole(modes) and modes > 0, "modes must be a whole number above 0", modes, WHERE, "give a count")
    require(modes <= MOST, f"modes must be at most {MOST}", modes, WHERE, "ask for fewer, e.g. 8")


def check_shaft(scene: Scene) -> Frame:
    """The shaft of a scene; ValueError where there is none."""
    body = scene.beam
    shaft = isinstance(body, Frame) and body.axis is not None and not body.in_plane
    require(shaft, "a Campbell diagram needs one shaft: a straight Frame in space", type(body).__name__, WHERE,
            "use Frame.straight")  # fmt: skip
    assert isinstance(body, Frame)
    return body


def _bends(found: reduction.Whirl, across: tuple[Any, Any]) -> NDArray[np.bool_]:
    """(c,) whether a motion moves the shaft across its axis; twist and stretch meet the spin without being whirls."""
    moved = sum(np.sum(np.abs(rows @ found.shapes) ** 2, axis=0) for rows in across)
    return np.asarray(moved > ACROSS * np.max(moved, initial=0.0))


def _at_unit_spin(scene: Scene, modes: int, elements: int | None) -> tuple[reduction.Basis, Any, tuple[Any, Any]]:
    """Modes at standstill without rigid motions that do not tilt the shaft, G per rad/s and rows across the shaft.

    All in the coordinates of these modes, whose vectors are unit vectors then.
    """
    body = check_shaft(scene)
    bare = replace(scene, stops=(), elements=(), bodies=(), forces=(), base=None, gravity=0.0)
    spun = replace(bare, beam=replace(body, spin=1.0))
    wanted = 2 * modes + SPARE
    matrices: Any = spun.matrices(elements, wanted)
    count = min(2 * modes + BASIS, matrices.M.shape[0])
    require(modes <= count, f"modes must be at most {count} (free dofs)", modes, WHERE, "ask for fewer")
    basis, G = reduction.modal_basis(matrices.M, matrices.K, count, root=matrices.root), matrices.gyroscopic
    tilts = np.linalg.norm(G @ basis.vectors, axis=0) > STILL * abs(G).max() * np.linalg.norm(basis.vectors, axis=0)
    kept = (basis.omega > 0.0) | tilts
    basis = reduction.Basis(basis.vectors[:, kept], basis.omega[kept])
    x, y = (rows @ basis.vectors for rows in _across(matrices, spun.beam))
    return reduction.Basis(np.eye(basis.count), basis.omega), basis.project_matrix(G), (x, y)


def _across(matrices: Any, body: Frame) -> tuple[Any, Any]:
    """Rows (nodes, N) of the displacements of all nodes along both axes across the shaft."""
    rows: list[list[Any]] = [[], []]
    for axis, entries in zip(body.axes[0][:2], rows, strict=True):
        part = dict(zip(COMPONENTS[:3], axis, strict=True))
        nodes: dict[Any, int] = {}
        for dof, (node, component) in enumerate(matrices.assembled.labels):
            if component in part:
                entries.append((nodes.setdefault(node, len(nodes)), dof, part[component]))
    size = len(matrices.assembled.labels)
    made = []
    for entries in rows:
        i, j, values = zip(*entries, strict=True)
        made.append((sparse.csr_matrix((values, (i, j)), shape=(max(i) + 1, size)) @ matrices.spread).toarray())
    return made[0], made[1]
