"""The reduced model: a scene seen through a few modes, ready to be simulated.

q_i'' + 2 ζ_i ω_i q_i' + ω_i² q_i = -Γ_i (ÿ + g) + Σ φ_i(z_f) f + Σ_s w_si F_s,    u(z, t) = Σ φ_i(z) q_i(t)

Of several bodies each has its own coordinates: the modes of the scene's beam, those of its `bodies`, then √m x for
every impactor.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import solvers
from fembeam.model import initial_states
from fembeam.model.equations import ModalEquations
from fembeam.response import PlacedLog
from fembeam.response.shapes import Vector
from fembeam.scene import for_duration, respun, with_signals, with_value
from fembeam.support import Part, Printed, bar, is_whole, note, numbers, require, require_positive
from solvers.integration import loads_taken
from solvers.problem import counted
from solvers.problem.whole_runs import whole_runs

if TYPE_CHECKING:
    from pathlib import Path

    from fembeam.model.branch import Branch
    from fembeam.model.orbit import Attractor, Orbit
    from fembeam.model.rub import Rub
    from fembeam.model.run import Run
    from fembeam.response import FrequencyResponse
    from fembeam.scene import Scene

Field = Callable[[Vector], Any] | None  # of displacement in m or velocity in m/s, over z (k,)
_MOVES = 0.1  # of the mode that moves a stop most: one that moves it so far does
# of what is computed once of a model: what no signal changes, and but for the rows of contacts no gap or law
UNDRIVEN = ("zeta", "participation", "moving_mass", "section_forces", "contact_rows", "sites", "directions", "rows_of",
            "turning")  # fmt: skip


def _with_laws(scene: Scene) -> list[Any]:
    """All parts of a scene and of its bodies that have a law."""
    return [part for one in (scene, *scene.bodies) for part in (*one.acting, *one.impactors)]


@dataclass(frozen=True, eq=False)
class Model(Printed, ModalEquations):
    """A scene reduced to n coordinates; made by `Scene.reduce`.

    Attributes
    ----------
    omega, zeta : (n,) rad/s and damping ratios (the modes' own; dashpots couple modes and come on top). A static
        shape is a pseudo-mode of high frequency, damped as the next higher mode would be (Rayleigh: by its ω).
    participation : Γ (n,) = Φᵀ M r in √kg: the load of a base motion y is -Γ ÿ.
    effective_mass : Γ² (n,) in kg; over all modes it sums to the moving mass.
    modes : numbers (n,) of the kept modes, 0 the lowest; of each beam after the other, a beam's static shapes last and
        numbered on; 0 for an impactor.
    shapes : φ(z) of the scene's own beam; call ``model.phi(z)``. others : the same for its `bodies`.
    counts : of modes and of static shapes, (modes, static), of each beam.
    reduction_options : arguments of `Scene.reduce` that make it again, with mode numbers instead of criteria.
    static_share : part of the static compliance that the model keeps at every stop, every element, then at every
        force; 1 is all.
    """

    def __repr__(self) -> str:
        ends = dict.fromkeys(f"{omega:.6g}" for omega in (self.omega.min(), self.omega.max()))
        size = f"{counted(len(self.omega), 'coordinate')}, {' to '.join(ends)} rad/s"
        return f"<model of {size}, with {counted(len(self.contact_rows), 'contact')}>"

    def _parts(self) -> list[Part]:
        from fembeam.model.mode_table import mode_part

        return [repr(self), mode_part(self)]

    def again(self, scene: Scene) -> Model:
        """Another scene reduced in the same way: the same mode numbers, mesh size and kind of static shapes."""
        spun = respun(self.matrices, self.scene, scene)
        return replace(self, scene=scene, matrices=spun) if spun else scene.reduce(**self.reduction_options)

    def strike(self, speed: float, stop: int = 0) -> PlacedLog:
        """Contacts with one stop when the model swings into it in the first mode that moves it, nothing else acting.

        Tells what to expect before a study: contact time ``t_out - t_in`` of the first contact and peak force, and so
        how many periods of the highest mode a contact lasts. Friction is left out. An impactor arrives by itself.

        Parameters
        ----------
        speed : m/s at the stop on arrival, > 0.
        stop : its number, as in the contact log: elements, impactors and stops of further bodies count on.
        """
        require_positive("speed", speed, "Model.strike", "give the speed of arrival in m/s")
        known = is_whole(stop) and 0 <= stop < len(self.contact_rows) and not self.contact_rows[stop].always
        require(known, f"stop must be below {len(self.contact_rows)} and no element", stop, "Model.strike",
                "count from 0")  # fmt: skip
        contact = initial_states.smooth(self.system.contacts[stop])
        require(bool(contact.direction.any()), "a mode must move the stop", contact.name, "Model.strike",
                "keep more modes, or residual=True")  # fmt: skip
        start, mode = np.zeros((2, len(self.omega))), 0
        if contact.map == "annulus":
            start[:, 0] = initial_states.onto_circle(contact, speed)
        else:
            mode = self._arriving(np.abs(contact.direction))
            start[:, mode] = np.array([-contact.gap, -float(speed)]) / contact.direction[mode]
        system = solvers.System(self.system.M, self.system.C, self.system.K, [contact], gyroscopic=self.turning)
        slowest = max(float(self.omega[mode]), 1.0)
        with whole_runs():
            found = solvers.integrate(system, *start, np.pi / slowest).contacts
        return PlacedLog.of(found, self.sites[stop : stop + 1])

    def _arriving(self, reach: Vector) -> int:
        """The coordinate that brings a stop of |row| (n,) to its surface: its impactor, else the first to move it."""
        free = len(reach) - len(self.matrices.impactors)  # these are the last coordinates
        if reach[free:].any():
            return free + int(np.argmax(reach[free:]))
        return int(np.argmax(reach >= _MOVES * reach.max()))

    def under(self, scene: Scene) -> Model:
        """The same model of a scene that differs in signals, gaps and laws only; what depends on none is kept."""
        other = replace(self, scene=scene)
        kept = {name: self.__dict__[name] for name in UNDRIVEN if name in self.__dict__}
        if any(new is not old for new, old in zip(_with_laws(scene), _with_laws(self.scene), strict=True)):
            kept.pop("contact_rows", None)
        other.__dict__.update(kept, system=self.system_like(scene))
        return other

    def state(self, displacement: Field | Sequence[Field] = None, velocity: Field | Sequence[Field] = None) -> Vector:
        """The start [q, q_dot] (2n,) nearest, in the mass norm, to given fields u(z) in m and u̇(z) in m/s.

        Parameters
        ----------
        displacement, velocity : functions of z (k,), relative to the frame; of frames and structures
            {(node, component): value} of all dofs that move, m or rad, where points of a structure may stand for
            nodes. None is zero, or what follows supports that move. A list gives one for each beam. Impactors start
            in their places with their velocities.

        Warns
        -----
        UserWarning : the kept modes miss more than 1 % of a field; says how much. `Model.missed` gives the number.

        Raises
        ------
        ValueError : a field is not finite, or moves a dof that is held or does not exist; a free impactor would start
            inside the beam.
        """
        return initial_states.state(self, displacement, velocity)

    def missed(self, field: Field | Sequence[Field]) -> float:
        """The part of a field of displacement or velocity that the kept modes cannot represent: ‖u - Φq‖/‖u‖ in M."""
        return initial_states.missed(self, field)

    def equilibrium(self, loads: Mapping[Any, float] | None = None) -> Vector:
        """The start at rest under gravity, preloads and given dead loads, contacts included.

        Parameters
        ----------
        loads : {z in m: force in N, positive up} on the scene's own beam, of frames, structures and other bodies
            {(place, direction): force}, for as long as it settles; signals of forces and base do not act. Simulate
            from it to see what follows when the loads go (release from a pull).

        Returns
        -------
        (2n,) : impactors with a velocity are held in place while the rest settles, and start with it.

        Raises
        ------
        reduction.AccuracyError : nothing carries the loads, so that no equilibrium is found; or contacts are so stiff
            and their gaps so wide that rounding of places hides their forces.
        """
        return initial_states.equilibrium(self, loads or {})

    def for_duration(self, duration: float) -> Model:
        """The same model with every signal valid for a run of ``duration`` s; noise without a period gets one."""
        require_positive("duration", duration, "Model.for_duration", "give s")
        scene = with_signals(self.scene, lambda signal: for_duration(signal, duration))
        return self if scene is self.scene else self.under(scene)

    def simulate(
        self,
        duration: float,
        dt: float | ArrayLike | None = None,
        start: ArrayLike | None = None,
        solver: Any = None,
        progress: bool = False,
    ) -> Run:
        """Integrate the model from t = 0.

        Parameters
        ----------
        duration : s.
        dt : output sampling in s (0, dt, 2 dt, …; what is left of a duration that dt does not divide is run, and in
            the log, but has no sample), or the output times themselves, increasing; None keeps the final state and
            the contact log only, no histories.
        start : (2n,) as made by `rest`, `state` or `equilibrium`; None is rest. Or the (2n + l,) of `Run.end`, with
            what the laws have latched, from which the run goes on, of signals that begin anew at t = 0. What
            follows sampled motions of supports begins where the run takes these to be, which is right to rtol.
        solver : one of the methods in `solvers`; None is the library's best.
        progress : show a bar (on terminals and in notebooks only).

        Returns
        -------
        Run : after Ctrl-C partial, and its status says so.

        Warns
        -----
        UserWarning : a stop whose law goes by the rate of entry moves in contact at the given start, which holds no
            such rate.

        Raises
        ------
        ValueError for bad input before computing; solvers.SolverError when the method fails.
        """
        if start is not None:
            initial_states.warn_of_entries(self, start)
        return self.go_on(duration, dt, start, solver, progress)

    def go_on(
        self,
        duration: float,
        dt: float | ArrayLike | None,
        start: ArrayLike | None,
        solver: Any = None,
        progress: bool = False,
    ) -> Run:
        """The same as `simulate`, from a start in the middle of a contact without a warning."""
        from fembeam.model.run import Made, Run

        require_positive("duration", duration, "Model.simulate", "give s")
        if dt is not None:
            numbers("dt", dt, "Model.simulate", "give the output sampling in s, or output times")
        model = self.for_duration(duration)
        q, q_dot, memory = initial_states.split_start(model, model.rest() if start is None else start)
        moved = np.concatenate((q, q_dot))
        if len(model.following):
            taken = loads_taken(model.system, duration, np.zeros(1), solver)
            moved += initial_states.follow(model, taken=taken) - initial_states.follow(model)
        with bar(duration, progress) as report:
            solution = solvers.integrate(
                model.system, *np.split(moved, 2), duration, dt, solver, progress=report, memory=memory or None
            )
        run = Run.of(model, solution, memory, dt is not None, Made(np.concatenate((q, q_dot)), duration, solver))
        note("%r, integrated in %.3g s", run, run.cost.seconds)
        return run

    def frequency_response(
        self,
        omega: ArrayLike,
        input: Any = "base",
        output: Any = None,
        absolute: bool = False,
        body: int = 0,
        slipping: bool = False,
    ) -> FrequencyResponse:
        """Steady displacement per unit of a harmonic input, complex, of the linear scene: its contacts stay open.

        (K + iωC - ω²) q = v,   H(ω) = φ(z)·q;   v = ω² Γ of the base, φ(z_f) of a force. Dashpots and static shapes
        are in C and in the coordinates; elements act with their stiffness and damping at u = 0.

        Parameters
        ----------
        omega : (k,) rad/s, ≥ 0.
        input : "base", a displacement of the frame (of bodies with several directions "base.x"); a place z in m, or
            (place, direction), where a force acts; or a signal of the scene, such as "forces[0]" or "springs[0].foot".
        output : z in m, or (j,), or (place, direction), or a list;
            None: the first stop, else the tip. body : the beam it is on.
        absolute : add the frame's own motion (transmissibility); only for "base".
        slipping : elements with sliders, and those that yield, act with the stiffness that is left once all of them
            slip; False: with that at u = 0, stuck.

        Returns
        -------
        FrequencyResponse : values (k,) or (k, j), amplitude, phase, decibel; draw it by `plot.frequency_response`.

        Raises
        ------
        ValueError : an unknown input (lists those there are), omega at a natural frequency without damping.

        References
        ----------
        D.J. Ewins, Modal Testing (2000), section 2.4.
        """
        from fembeam.model.watched_places import observed
        from fembeam.response import frequency_response

        places = observed(self) if output is None else output
        return frequency_response(self, omega, input, places, absolute, body, slipping)

    def orbit(
        self, period: int = 1, start: ArrayLike | Orbit | None = None, shots: int | None = None, progress: bool = False
    ) -> Orbit:
        """Find a periodic motion by shooting.

        Parameters
        ----------
        period : in periods of the load; 2 is a 1/2 subharmonic.
        start : (2n,) state at t = 0 or an orbit near it; None tries what a run from rest settles to, then other starts,
            then, for period 1, an orbit with more damping, followed until the damping is the model's.
        shots : per period; None takes as many as it needs.
        progress : show a bar of the starts tried (on terminals and in notebooks only).

        Returns
        -------
        Orbit : state, multipliers, stable, contacts, extremes(z), run.

        Raises
        ------
        ValueError for a period below 1 or loads without a period; solvers.OrbitError with what was tried.
        """
        from fembeam.model.orbit import orbit

        return orbit(self, period, start, shots, progress)

    def rub(self, spin: float | None = None, near: float | None = None, entry_rate: float | None = None) -> Rub:
        """The synchronous rub of an unbalanced round rotor in one `AnnularStop`: an equilibrium of the turning frame.

        It whirls with the spin Ω in full contact and slips throughout; N by the law at rest, F_t = σμN, σ the sign of
        the sliding speed. For one disk with damping c_d in a clearance c

            |(k - mΩ² + N/r) + i (c_d Ω + σμ (c/r) N/r)| r = m e Ω²

        Parameters
        ----------
        spin : Ω, rad/s, not 0; None: that of the shaft. Of a structure without a spin that of its turning loads.
        near : m, which of several radii; None: the largest.
        entry_rate : m/s, at which the contact began; needed by laws that depend on it.

        Returns
        -------
        Rub : radius, force, friction, eigenvalues, growth, stable; state, a start. Spins at which `growth` passes 0 are
            thresholds of dry whirl.

        Raises
        ------
        ValueError : a rotor that is not round, loads that do not turn with it, other stops or elements.
        solvers.OrbitError : no such rub at this spin.

        Notes
        -----
        Eigenvalues are of the model's coordinates with steady slip; multipliers of the same motion as an orbit are
        exp(2π λ/Ω). Indentations up to 1000 clearances (or radii of free whirl) are looked at.

        References
        ----------
        A. Muszynska, Rotordynamics (2005). K. Prabith, I.R.P. Krishna, The numerical modeling of rotor-stator rubbing
        in rotating machinery: a comprehensive review, Nonlinear Dynamics (2020), doi 10.1007/s11071-020-05832-y.

        Examples
        --------
        >>> import fembeam as fb
        >>> from contacts import KelvinVoigt
        >>> shaft = fb.Frame.straight(0.5, fb.Section.circle(2.1e11, 7850.0, 0.04), spin=200.0, bending_only=True)
        >>> hole = fb.AnnularStop("B", KelvinVoigt(2e6, 300.0), 2e-4, friction=fb.Friction(0.1, 2e6), radius=0.02)
        >>> scene = fb.Scene(shaft, [fb.Clamped("A")], [fb.Disk("B", 12.0, 0.04, 0.075)], stops=[hole],
        ...                  forces=[fb.Unbalance("B", 1e-3)], damping=fb.ModalDamping(0.02))
        >>> found = scene.reduce(modes=2).rub(190.0)
        >>> found.stable, found.radius > 2e-4
        (True, True)
        """
        from fembeam.model.rub import rub

        return rub(self, spin, near, entry_rate)

    def attractors(
        self,
        omega: float | None = None,
        starts: int | Sequence[ArrayLike] = 12,
        longest: int = 8,
        seed: int = 0,
        progress: bool = False,
    ) -> list[Attractor]:
        """Settle many starts and name what they come to, the most frequent first.

        Parameters
        ----------
        omega : rad/s of the load; None leaves the scene as it is.
        starts : how many (rest and random states of the size of the motion from rest), or a list of states (2n,).
        longest : periods above this many of the load's count as "not periodic".
        seed : of the random states.
        progress : show a bar of the starts tried (on terminals and in notebooks only).

        Returns
        -------
        list of Attractor : orbit (None when not periodic), period, impacts, count, state, name.

        Warns
        -----
        UserWarning : random starts are left out, as their runs are refused.
        """
        from fembeam.model.orbit import attractors

        model = self if omega is None else self.under(with_value(self.scene, "omega", omega))
        return attractors(model, starts, longest, seed, progress=progress)

    def branch(
        self,
        parameter: str = "omega",
        span: tuple[float, float] = (0.0, 0.0),
        period: int = 1,
        start: ArrayLike | Orbit | None = None,
        at: float | None = None,
        **options: Any,
    ) -> Branch:
        """Follow an orbit along one number of the scene, in both directions.

        Parameters
        ----------
        parameter : such as "omega", "amplitude", "gap", "stops[0].law.stiffness"; see `fembeam.scene.parameters`.
        span : (lowest, highest) value.
        period : in periods of the load.
        start : as for `orbit`. at : the parameter's value there; None: the scene's, if it lies in the span.
        options : step (largest, in units of the span), shots, method; see `solvers.branch`.

        Returns
        -------
        Branch : computes as it is iterated over; ``run()`` computes all. Orbits carry a ``mark`` where special.

        Raises
        ------
        ValueError : unknown parameter (lists the valid ones), empty span. solvers.OrbitError : no orbit at the start.
        """
        from fembeam.model.branch import follow

        return follow(self, parameter, span, period, start, at, options)

    def resume(self, path: str | Path) -> Branch:
        """A branch written by `Branch.save`, to be continued; refused if it belongs to another scene."""
        from fembeam.model.branch import resumed

        return resumed(self, path)
