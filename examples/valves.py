"""One valve, reduced once to a superelement, joined to a pipe twice, the second time turned; also from valves.toml.

Asserted: six frequencies to 5e-6 of the frame made in one piece; the mass that the modes move along each axis; the
levers meet their stops at the same times in both.

python examples/valves.py     prints them and draws valves.png
"""

from pathlib import Path

import numpy as np

import fembeam as fb
from contacts import Hertz
from fembeam import scene_file

tube = fb.Section.tube(2.0e11, 7900.0, 0.0603, 0.0525)
bar = fb.Section.rectangle(2.0e11, 7900.0, width=0.03, height=0.02)
nodes = {"A": (0, 0, 0), "B": (1.5, 0, 0), "C": (1.5, 0, 1.2), "D": (3.0, 0, 1.2)}
pipe = fb.Frame.polyline(nodes, tube)
arm = fb.Frame({"flange": (0, 0, 0), "lever": (0, 0.4, 0)}, [fb.Member("flange", "lever", bar)])
valve = arm.reduced(["flange", "lever"], modes=4)


def parts(lever, name, direction):
    """What is on a lever."""
    stop = fb.Stop(lever, Hertz(1e8), gap=2e-3, direction=direction, name=name)
    return {"masses": [fb.LumpedMass(lever, 3.0)], "stops": [stop]}


ends = [fb.Clamped("A"), fb.Clamped("D")]
drive = {"damping": fb.ModalDamping(0.01), "base": {"z": fb.Harmonic(1e-3, 95.0)}}
upright = fb.Scene(valve, **parts("lever", "upright", "z"))
lying = fb.Scene(valve.turned((np.pi / 2, 0, 0)), **parts("lever", "lying", "y"))
joints = [fb.Joint("B", to=(1, "flange")), fb.Joint("C", to=(2, "flange"))]
joined = fb.Scene(pipe, ends, bodies=[upright, lying], joints=joints, **drive)

up, along = {"up": (0, 0, 1)}, {"up": (0, -1, 0)}  # the ways of the bar's height
levers = {"up": (1.5, 0.4, 0), "along": (1.5, 0, 1.6)}
members = [*pipe.members, fb.Member("B", "up", bar, **up), fb.Member("C", "along", bar, **along)]
both = {key: parts("up", "upright", "z")[key] + parts("along", "lying", "y")[key] for key in ("masses", "stops")}
whole = fb.Scene(fb.Frame(nodes | levers, members), ends, **both, **drive)

model, reference = joined.reduce(modes=6), whole.reduce(modes=6)
error = float(np.abs(model.omega / reference.omega - 1).max())
assert error < 5e-6, f"frequencies differ by {error:.2g}"
assert np.allclose(model.effective_mass.sum(axis=0), reference.effective_mass.sum(axis=0), rtol=1e-4)
read = scene_file.read(Path(__file__).with_name("valves.toml"))
assert np.array_equal(read.model().omega, model.omega)

run, other = (one.simulate(duration=0.4, dt=1e-3) for one in (model, reference))
first = [one.contacts.t_in[:3] for one in (run, other)]
assert len(first[0]) == 3, run
assert np.allclose(*first, atol=1e-5), first

if __name__ == "__main__":
    print(model)
    print(f"frequencies differ from those in one piece by {error:.1g}, {model.basis.vectors.shape[0]} dofs instead of "
          f"{reference.basis.vectors.shape[0]}")  # fmt: skip
    print(run)
    joined.figure().savefig("valves.png")
