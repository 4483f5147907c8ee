"""Methods of constant or controlled step, one per file, and the loop they share.

`engine` is one run: its `loop` marches a method from event to event. `events` and, with memory, `borders` find these on
the dense output of a step and `located` ends the step there. Loop and formulae are written once (`shared`): compiled on
decoupled modes, as Python on the matrices themselves, which `sparse` multiplies and solves with. `constant_step` checks
steps; `stability`, on the oscillators of `critical_step`, predicts the largest, and `energy_gain` sees when they were
too long. Imports: `compiled`, `problem`. A method's file loads its machine code when it is imported. Begin with `loop`.
"""
