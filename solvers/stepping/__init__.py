"""Methods of constant or controlled step, one per file, and the loop they share.

`loop` marches a method from event to event, which `events` locates; `henon_landing` and the methods' own dense output
land on them. `sparse` does the same on the matrices themselves. `stability` predicts the largest steps. Imports:
`compiled`, `problem`. A method's file loads its machine code when it is imported. Begin with `loop`.
"""
