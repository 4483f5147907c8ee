"""One step in contact: forces by collocation at eight nodes, or a landing on an event.

`step` chooses, `nodes` and `node_response` tell motion from forces, of many stops through the `blocks`, `collocation`
and `node_newton` solve for them, `landing` ends a step on a border, `crossings` looks for borders between nodes,
`peaks` for summits; `outputs` are samples inside a step.
"""
