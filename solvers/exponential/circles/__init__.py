"""Circular clearances: an element of two rows, whose law acts along the line from the place to the centre.

Rows read u, the vector from the place to the centre; r = |u|, e = u/r, and σ is 1, or -1 of an outer circle:

    δ = σ (r - c),   δ̇ = σ e·u̇,   force on the rows σ N(δ, δ̇) e

`flight` proves that no contact is missed and finds the first one, `contact` solves the steps in contact, `friction` has
the tangential forces, on circles and on oblique stops. `derivative` and `friction_derivative` linearise a run. All of
it is compiled for the first system with a circular clearance, or with friction.
"""
