"""How many runs are done: in which processes (`executors`), kept where when interrupted (`checkpoint`).

Runs are told apart by what they compute (`fingerprint`). Imports: `model`, `support`. Begin with `executors.spread`.
"""
