"""The energy balance of a run: work of loads, damping and contacts, and whether they add up.

`energy_tables` keeps it with closed forms, `flight_tables` those of flight, `contact_tables` those of contact steps;
`quadrature` serves where they do not reach; `check` refuses runs that do not balance.
"""
