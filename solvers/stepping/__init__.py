"""Methods of constant or controlled step, one per file, and the loop they share.

`loop` marches a method from event to event; `events` finds them on the dense output of a step and `located` ends the
step there. `sparse` does the same on the matrices themselves. `stability` predicts the largest steps. Imports:
`compiled`, `problem`. A method's file loads its machine code when it is imported. Begin with `loop`.
"""
