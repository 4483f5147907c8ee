"""What a simulation gives: histories at any place, forces, contact log, energy balance; saved whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import solvers
from fembeam.response import Histories, PlacedLog
from fembeam.scene import Source
from fembeam.support import Part, Printed, file_path
from solvers.integration import loads_taken
from solvers.problem import counted

if TYPE_CHECKING:
    from fembeam.model.model import Model
    from fembeam.model.sensitivity import Sensitivity
    from fembeam.response import Reactions
    from fembeam.scene_file import SceneFile

Vector = NDArray[np.float64]


class Made(NamedTuple):
    """What a run was made by: its start [q, q̇], duration in s and solver."""

    start: Vector
    duration: float
    solver: Any


@dataclass(frozen=True, eq=False, kw_only=True)
class Run(Histories, Printed):
    """A simulated motion of a reduced model.

    Attributes
    ----------
    t, q, q_dot : (k,) s, (k, n) and (k, n) modal coordinates and rates.
    contacts : log of contacts: stop, name, z and side (of other bodies than a `Beam` place and direction), t_in, t_out,
        speed_in, speed_out, peak_indentation, peak_force, impulse, energy_loss, entry_rate_clipped (arrays); it prints.
    energy : energy balance at t: input, damping, contact, stored, residual in J, of friction also friction and spin;
        made by ``ledger`` when first read.
    end : (2n + l,) [q, q̇] at the time reached and what laws have latched: a start from which another run goes on.
    status : how it ended, a sentence.
    cost : steps, rejections, law_calls, events, seconds.
    names : what every contact is called: as its part was named, else such as "stop at 3 m, below".
    """

    ledger: Callable[[], solvers.Energy] = field(repr=False)
    status: str
    cost: solvers.Cost
    scene: str
    source: Source | None = None  # of a run made from a scene file
    versions: dict[str, str] = field(default_factory=dict)  # that made a run read from a file
    made: Made | None = None  # start, duration and solver; None of a run read from a file

    def __repr__(self) -> str:
        reached = f"to t = {self.t[-1]:g} s" if len(self.t) else "without samples"
        return f"<run {reached}, {counted(len(self.contacts), 'contact')}: {self.status}>"

    def _parts(self) -> list[Part]:
        from fembeam.model.run_csv import parts

        return parts(self)

    @cached_property
    def energy(self) -> solvers.Energy:
        """The energy balance."""
        return self.ledger()

    @property
    def scene_file(self) -> SceneFile:
        """The scene, reduction and studies this run was made from; ValueError for a run made in Python."""
        from fembeam.scene_file import built

        if self.source is None:
            raise ValueError("this run was made in Python, not from a scene file; its scene is the text run.scene")
        return built(self.source)

    @classmethod
    def of(
        cls,
        model: Model,
        solution: solvers.Solution,
        began: tuple[Vector, ...] = (),
        sampled: bool = True,
        made: Made | None = None,
    ) -> Run:
        """The run of a model from its solution."""
        status = solution.status.value
        if not solution.status.good:
            status += f" (t = {solution.t[-1]:g} s)" if len(solution.t) else " (before the first sample)"
        reached = made.duration if made and solution.status.good else float(solution.t[-1]) if len(solution.t) else 0.0
        taken = None
        if made and len(model.following):
            taken = partial(loads_taken, model.system, made.duration, method=made.solver)
        return cls(
            *(solution.t, solution.q, solution.q_dot),
            contacts=PlacedLog.of(solution.contacts, model.sites),
            ledger=solution.record.energy,
            status=status,
            cost=solution.cost,
            shapes=model.shapes,
            directions=model.directions,
            make_transitions=solution.record.transitions,
            make_losses=solution.record.losses,
            model=model,
            others=model.others,
            memory_at_start=began,
            end=solution.end,
            sampled=sampled,
            make_friction_log=solution.record.friction,
            reached=reached,
            loads_taken=taken,
            made=made,
            **model.run_fields,
        )

    @property
    def complete(self) -> bool:
        """Whether the run reached its end."""
        return self.status == solvers.Status.DONE.value

    def sensitivity(
        self, parameter: str | None = None, start: ArrayLike | None = None, progress: bool = False
    ) -> Sensitivity:
        """Exact derivative of the run by a number of its scene, or by a change of its start, through every contact.

        Y' = A Y + Σ b_s dF_s + ∂f/∂p,   dt* = -dδ/δ̇ at entries and exits

        Parameters
        ----------
        parameter : a path such as "stops[valve].gap", "stops[0].law.stiffness", "base.amplitude", "base.omega",
            "damping.zeta[0]", "masses[0].mass"; those of `study.vary`. The start is held fixed in coordinates.
        start : instead, the direction (2n,) in which the start moves, as `Model.state` makes one.
        progress : show a bar (on terminals and in notebooks only).

        Returns
        -------
        Sensitivity : per unit of the parameter ``displacement(z)`` and ``velocity(z)`` at the samples, at fixed times;
            ``entries``, ``exits``, ``peak_force``, ``impulse`` in the order of `contacts`; prints a table.

        Raises
        ------
        ValueError : an unknown path (with the nearest one), values near the present one that the scene refuses, a law
            with an infinite slope at its surface, a run read from a file, one that would take many minutes.
        solvers.NoDerivativeError : a contact grazes, so that there is none.

        Warns
        -----
        UserWarning : small changes grow by more than 1e6 to the end of the run (chaos, or a long run).

        Notes
        -----
        As exact as the run: some hundred times its rtol at most. The run is made again, about 5 ms for a contact of a
        few modes more. Numbers that change modes (masses, lengths, stiffness) need the modes of four scenes nearby;
        loads and such numbers also panels over the whole run.

        References
        ----------
        R.I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7.
        """
        from fembeam.model.sensitivity import of_run

        return of_run(self, parameter, start, progress)

    def reactions(self) -> Reactions:
        """Forces (N) and moments (N m) of supports, springs and dashpots on the beams, at the samples.

        They balance loads, contact forces and the inertia of the kept modes on the finite-element model; modes left
        out follow statically, structural damping counts as internal. A contact shorter than the period of the highest
        mode kept acts at once: keep more modes until the extremes settle.

        Returns
        -------
        Reactions : of each beam supports, then springs; then dashpots. ``[i].force``, ``[i].moment`` (k,),
            ``[i].extremes("force")``. (Stops: `force`.)

        References
        ----------
        R.R. Craig, A.J. Kurdila, Fundamentals of Structural Dynamics (2006), 11.4: mode-acceleration method.
        """
        from fembeam.response import reactions

        return reactions(self)

    def floor_spectrum(self, z: Any, omega: ArrayLike | None = None, zeta: ArrayLike = 0.05, **options: Any) -> Any:
        """`fembeam.response_spectrum` of the absolute acceleration at z: the load on equipment mounted there.

        omega or ``periods=``, zeta : as there; ``body=`` another beam; z (place, direction) of others.
        Warns where samples do not resolve contacts.
        """
        from fembeam.response import floor_spectrum

        return floor_spectrum(self, z, omega, zeta, **options)

    def to_xdmf(self, path: str | os.PathLike[str], stride: int = 1, hdf5: bool = False) -> Path:
        """Write every `stride`-th sample for ParaView: displacement, velocity, slope, moment, shear, stress.

        ``hdf5``: the numbers go to an .h5 file beside it, half as large as text; ImportError without h5py.
        """
        from fembeam.model.run_paraview import to_xdmf

        return to_xdmf(self, path, stride, hdf5)

    def to_vtu(self, path: str | os.PathLike[str], sample: int = -1, stride: int | None = None) -> Path:
        """Write one sample for ParaView; or every `stride`-th one as .vtu files and a .pvd beside them to open."""
        from fembeam.model.run_paraview import to_vtu

        return to_vtu(self, path, sample, stride)

    def to_csv(self, folder: str | os.PathLike[str], stride: int = 1, **chosen: Any) -> list[Path]:
        """Write every `stride`-th sample as `histories.csv`, the log as `contacts.csv`, of friction `friction.csv`.

        Parameters
        ----------
        chosen : ``places=`` z in m (j,), else tip and mid-beam. ``quantities=`` from displacement, velocity,
            acceleration, each also "absolute …", slope, moment, shear, stress; indentation, force, work, friction,
            friction loss (of stops);
            reactions (of supports, springs, dashpots). Else displacement, velocity, indentation, force.
        """
        from fembeam.model.run_csv import write

        return write(self, file_path(folder, "Run.to_csv"), stride, **chosen)

    def to_dataframe(self, stride: int = 1, **chosen: Any) -> Any:
        """The same histories as a table of pandas over t; ImportError without pandas."""
        from fembeam.model.run_csv import to_dataframe

        return to_dataframe(self, stride, **chosen)

    def to_xarray(self, z: ArrayLike | None = None) -> Any:
        """Displacement and velocity over t and z (m; None: the mesh), stops and coordinates as a Dataset of xarray.

        With friction also F_t and the loss by friction of every stop. SI units in the attributes. ImportError without
        xarray.
        """
        from fembeam.model.run_csv import to_xarray

        return to_xarray(self, z)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one file, whole or not at all; read it with `load`.

        ``.npz``, or HDF5 if the path ends in .h5 or .hdf5 (ImportError without h5py). The file holds what the methods
        read, so that neither the scene nor its laws are needed; `model` is None then.
        """
        from fembeam.model.run_file import save

        return save(self, file_path(path, "Run.save"))
