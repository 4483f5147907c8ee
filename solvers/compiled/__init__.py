"""What all compiled functions share.

`decorators` states which options of the compiler are used, and what each is worth; `kernels` has the arrays of a
problem, the right-hand side of the stepping methods (where a stop's force enters their equations) and the calls of
laws; `state` has the arrays a run changes, and the contact log; `friction` and `sliding` have sliders, `renewals` what
laws with memory latch; `fields` declares named tuples of arrays, `packed` passes them by their address; `simd` is a
type of eight numbers and `sums` the weighted sums made with it; `parts` are functions compiled by themselves, some when
first needed; `dop853_tableau` holds coefficients; `cache` keeps machine code, `shortcuts` saves time in making it.
Imports: `problem`, numba. Other folders import from these files: kernels need their constants by name. Begin with
`kernels`.
"""
