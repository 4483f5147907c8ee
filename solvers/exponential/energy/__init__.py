"""The energy balance of a run: work of loads, damping and contacts, and whether it closes.

`flight_balance` and `contact_balance` add work and damping step by step: by the closed forms of `flight_tables` and
`contact_tables`, those of contact steps summed over the blocks by `contact_sums`, else by `quadrature`. `check` refuses
runs whose balance does not close.
"""
