"""A law with memory from measured loops: a bolted joint that slips little by little.

    F = Σ F_j + k₀ δ,   each F_j = k_j (δ - s_j) while |F_j| < f_j, else ±f_j until δ' = 0

A shaker moves the joint with a slowly changing amplitude; displacement and force are recorded in order, no times are
needed, and what the joint has been through before does not matter. The measurement is made here: three sliders and a
spring, 2 % noise and a zero of the force that is off. A cycle of amplitude X, at which all slip, loses
Σ 4 f_j (X - f_j/k_j).

    python examples/identify_loop.py        prints what it finds and writes identify_loop.png
"""

import numpy as np
from matplotlib.figure import Figure

import fembeam as fb
from contacts import Iwan, Jenkins, identify_loop
from contacts.path import work

joint = Iwan([8e6, 4e6, 2e6, 1e6], [40.0, 60.0, 70.0, np.inf])
phase = np.linspace(1.0, 40.0, 1200)
delta = 1e-5 * np.sin(phase) * (4.0 + 3.0 * np.sin(0.19 * phase))
noise = 5.0 * np.random.default_rng(1).standard_normal(delta.size)
force = joint.along(delta) + 12.0 + noise

found = identify_loop(delta, force, Iwan, confidence=0.9999)  # to hold the truth whatever the noise

X = 8e-5
cycle = [0.0, X, -X, X]
loss = work(found.law, cycle) - work(found.law, cycle[:2])
exact = sum(4.0 * f * (X - f / k) for k, f in zip(joint.stiffness, joint.limits, strict=True) if f < np.inf)
assert len(found.law.sliders) == 3, found
assert 40.0 in found.estimates["limits[0]"], found
assert 12.0 in found.force_offset, found
assert abs(loss - exact) < 0.01 * exact, f"a larger cycle loses {loss} J, not {exact} J"

if __name__ == "__main__":
    print(found)
    print(f"a cycle of 80 µm, larger than any measured, loses {1e3 * loss:.3f} mJ; exactly {1e3 * exact:.3f} mJ")
    print(f"one slider alone leaves {identify_loop(delta, force, Jenkins).noise:.1f} N, noise is 5 N")
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axis = figure.subplots()
    fb.plot.hysteresis({"found": found.law}, path=delta, axes=axis)
    axis.plot(1e3 * delta, force - found.force_offset.value, ".", color="0.6", markersize=3, zorder=0, label="measured")
    axis.legend()
    figure.savefig("identify_loop.png", dpi=110, metadata={"Software": None})
