"""The energy balance of a run: work of loads, damping and contacts, and whether they add up.

`books` keeps it with closed forms, `flight_tables` those of flight, `contact_tables` those of contact steps;
`quadrature` serves where they do not reach; `guard` refuses runs that do not balance.
"""
