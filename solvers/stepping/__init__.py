"""Methods of constant or controlled step, one per file, and the loop they share.

`loop` marches a method from event to event; `events` finds them on the dense output of a step and `located` ends the
step there. Loop and formulae are written once (`shared`): compiled on decoupled modes, as Python on the matrices
themselves, which `sparse` multiplies and solves with. `stability` predicts the largest steps. Imports:
`compiled`, `problem`. A method's file loads its machine code when it is imported. Begin with `loop`.
"""
