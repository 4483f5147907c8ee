"""The energy balance of a run: work of loads, damping and contacts, and whether it closes.

`balance` adds work and damping step by step: by the closed forms of `flight_tables` and `contact_tables`, else by
`quadrature`. `check` refuses runs whose balance does not close.
"""
