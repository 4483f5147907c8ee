"""One step in contact: forces by collocation at eight nodes, or a landing on an event.

`step` chooses between them and controls the step size; `first_step` has the first one. `collocation` and `node_newton`
solve for the forces at the `nodes`; `node_response` gives the motion under them, through `many_stops` if there are more
than two. `landing`, by a `landing_step`, locates where a contact ends, `segment_ends` where a segment of its law does;
`crossings` and `borders` find the events that a step would pass, `slider_margins` those of friction, `kinks` those of
sampled loads. `step_integrals` has the works, `peaks` the largest indentations and forces, `outputs` the samples inside
a step.
"""
