"""The compiled ground: what every kernel stands on.

`decorators` says which options of the compiler are used and why; `kernels` has the problem's arrays, calls of laws and
the right-hand side; `packed` passes arrays by their address; `simd` is a type of eight numbers and `sums` weighted
sums of table rows; `state` is what a run changes, its log among it; `dop853_tableau` holds coefficients; `cache` keeps
machine code. Imports: `problem`, numba. Other rooms import from these files: kernels need their constants by name.
Begin with `kernels`.
"""
