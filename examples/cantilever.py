"""A cantilever: natural frequencies from finite elements, against the roots of its characteristic equation.

ω_n = (β_n L)² √(EI/ρA L⁴),    cos βL cosh βL = -1

python examples/cantilever.py        prints both, and the errors of coarse meshes
"""

import math

import numpy as np
from scipy.optimize import brentq

import fembeam as fb

length = 0.26
steel = fb.Section.rectangle(E=2.1e11, rho=7850.0, width=0.02, height=0.003)
scene = fb.Scene(beam=fb.Beam(length, steel), supports=[fb.Clamped(0.0)])
model = scene.reduce(modes=4)

scale = math.sqrt(steel.bending_stiffness / (steel.line_mass * length**4))
roots = [brentq(lambda x: math.cos(x) + 1 / math.cosh(x), n * math.pi, (n + 1) * math.pi) for n in range(4)]
exact = scale * np.array(roots) ** 2


def error(elements: int) -> float:
    """Relative error of the second frequency on a mesh of one's own choice."""
    return float(scene.reduce(modes=2, elements=elements).omega[1] / exact[1] - 1)


errors = {elements: error(elements) for elements in (4, 8, 16)}
order = math.log2(errors[8] / errors[16])

assert np.allclose(model.omega, exact, rtol=1e-6, atol=0), f"{model.omega} rad/s, exact {exact}"
assert abs(order - 4) < 0.1, f"errors fall as h^{order:.2f}, Hermite elements should give h^4"

if __name__ == "__main__":
    for n, (found, true) in enumerate(zip(model.omega, exact, strict=True), start=1):
        print(f"mode {n}: {found:10.3f} rad/s, exact {true:10.3f}, {found / true - 1:+.1e}")
    print("error of mode 2 with 4, 8, 16 elements: " + ", ".join(f"{e:.1e}" for e in errors.values()))
