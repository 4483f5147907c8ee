"""The energy balance of a run: work of loads, damping and contacts, and whether it closes.

`flight_balance` and `contact_balance` add work and damping step by step: by closed forms, which `flight_tables` and
`contact_tables` tabulate as `quadratic_forms` (those of contact steps summed over the blocks in `contact_sums`), else
by `quadrature`.
`check` refuses runs whose balance does not close.
"""
