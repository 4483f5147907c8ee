"""How many runs are carried out: in which processes (`executors`), and saved as they finish (`checkpoint`).

Runs are told apart by what they compute (`support.fingerprint`). Imports: `model`, `support`. Begin with
`executors.spread`.
"""
