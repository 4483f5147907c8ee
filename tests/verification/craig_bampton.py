"""Component modes of a beam in two halves

A clamped beam, EI = ρA = L = 1, is cut in the middle. Each half brings the cubic shapes of its interface
(displacement, rotation) and k modes with the interface held. By symmetry one problem of k + 1 unknowns is left for
each of the two shapes, with h = ½, modes φ_j of a clamped beam of length h and c_j = ∫ N φ_j dz:

    displacement  N = 3s² - 2s³:     K = diag(12/h³, λ_j⁴/h⁴),   M = [[13h/35, c], [cᵀ, 1]]
    rotation      N = h (s³ - s²):   K = diag(4/h, λ_j⁴/h⁴),     M = [[h³/105, c], [cᵀ, 1]]

With k = 0 this is one cubic element each, ω² = 420/13h⁴; the exact frequencies are 22.3733 and 61.6728. The sheet
integrates c_j by quadrature; fembeam does the same on finite elements, with the interface of the whole beam and by two
superelements that are joined.
"""

import math

import numpy as np
import sketch
from scipy import sparse
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.optimize import brentq
from sheets import Row

import fembeam as fb
import reduction

SOURCE = "R.R. Craig, M.C.C. Bampton, *Coupling of substructures for dynamic analyses*, AIAA Journal 6 (1968) 1313"
H, ELEMENTS = 0.5, 80
UNIT = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0)
SHAPES = {
    "displacement": (lambda s: 3.0 * s**2 - 2.0 * s**3, 12.0 / H**3, 13.0 * H / 35.0),
    "rotation": (lambda s: H * (s**3 - s**2), 4.0 / H, H**3 / 105.0),
}


def held(j):
    """λ_j and the mass-normalised mode of a clamped beam of length H."""
    near = (j + 0.5) * math.pi
    root = brentq(lambda x: math.cos(x) - 1.0 / math.cosh(x), near - 0.5, near + 0.5, xtol=1e-14)
    ratio = (math.cosh(root) - math.cos(root)) / (math.sinh(root) - math.sin(root))

    def shape(s):
        x = root * s
        return (math.cosh(x) - math.cos(x) - ratio * (math.sinh(x) - math.sin(x))) / math.sqrt(H)

    return root, shape


def exact(name, k):
    """The lowest frequency of one kind."""
    N, stiffness, mass = SHAPES[name]
    modes = [held(j) for j in range(1, k + 1)]
    c = np.array([H * quad(lambda s, f=f: N(s) * f(s), 0.0, 1.0, epsabs=1e-13)[0] for _, f in modes])
    M = np.block([[np.array([[mass]]), c[None, :]], [c[:, None], np.eye(k)]])
    K = np.diag([stiffness, *[(root / H) ** 4 for root, _ in modes]])
    return math.sqrt(eigh(K, M, eigvals_only=True)[0])


def ours(k):
    """The two lowest frequencies."""
    matrices = fb.Scene(fb.Beam(1.0, UNIT), [fb.Clamped(0.0), fb.Clamped(1.0)]).matrices(ELEMENTS)
    interface = sparse.vstack([matrices.interpolation(H), matrices.interpolation(H, 1)]).T
    return reduction.craig_bampton(matrices.M, matrices.K, interface, 2 * k).omega[:2]


def joined(k):
    """The same of one half as a superelement, used twice; in space, so that each comes in both planes."""
    both = fb.Section(E=1.0, rho=1.0, A=1.0, I=1.0, I2=1.0)
    half = fb.Frame({"A": (0, 0, 0), "B": (0, 0, H)}, [fb.Member("A", "B", both)], bending_only=True)
    half = half.reduced(["A", "B"], 2 * k, ELEMENTS // 2)
    bodies, joints = [fb.Scene(half, [fb.Clamped("B")])], [fb.Joint("B", to=(1, "A"))]
    return fb.Scene(half, [fb.Clamped("A")], bodies=bodies, joints=joints).reduce("all").omega[:4:2]


def rows():
    return [
        Row(f"ω, {name} of the middle, k = {k}{said}", exact(name, k), float(omega), 1e-6)
        for said, compute in (("", ours), (", superelements joined", joined))
        for k in (0, 1, 2)
        for name, omega in zip(SHAPES, compute(k), strict=True)
    ]


def draw(rig, plot):
    for start, end, y in ((0.0, 1.0, 0.3), (1.2, 2.2, 0.3), (0.1, 2.1, -0.5)):
        sketch.beam(rig, start, end, y)
    for x, y, side in ((0.0, 0.3, 1.0), (2.2, 0.3, -1.0), (0.1, -0.5, 1.0), (2.1, -0.5, -1.0)):
        sketch.wall(rig, x, y, 0.4, 90.0, side)
    rig.plot([1.0, 1.2, 1.1], [0.3, 0.3, -0.5], "ko", ms=5)
    sketch.view(rig, -0.3, 2.5, -0.9, 0.8)
    for name, true in (("displacement", 22.37328544806132), ("rotation", 61.67282286792025)):
        errors = [exact(name, k) / true - 1.0 for k in range(5)]
        (line,) = plot.semilogy(range(5), errors, lw=3.0, alpha=0.4, label=f"{name}, formula")
        mine = [ours(k)[int(name == "rotation")] / true - 1.0 for k in range(3)]
        plot.semilogy(range(3), mine, ".", color=line.get_color(), ms=9)
    plot.set(xlabel="modes k of each half", ylabel="above exact ω; dots: fembeam", xticks=range(5))
    plot.legend(fontsize="small")
