"""A hinged beam falls on a stop: a rigid-body mode, gravity and contact; then the same beam lying on it.

θ'' = -3g/2L:  the end falls with 3g/2 and arrives after √(4h/3g) with √(3gh);  at rest the stop carries m g L/2z

python examples/hinged_beam.py        prints them beside the theory
"""

import math

import fembeam as fb
from contacts import Hysteretic

g, length, height, z_stop = 9.81, 0.5, 0.02, 0.4
steel = fb.Section.rectangle(2.1e11, 7850.0, width=0.03, height=0.01)
weight = steel.line_mass * length * g
scene = fb.Scene(
    beam=fb.Beam(length, steel),
    supports=[fb.Pinned(0.0)],
    stops=[fb.Stop(z_stop, law=Hysteretic.achieving(1e8, restitution=0.5))],
    damping=fb.ModalDamping(0.05),
    gravity=g,
)
model = scene.reduce(modes=4)
start = model.state(displacement=lambda z: height * z / z_stop)
end = height * length / z_stop  # of the beam, over its place on the stop

first = model.simulate(duration=0.09, dt=1e-4, start=start)
flight, arrival = math.sqrt(4 * end / (3 * g)), math.sqrt(3 * g * end) * z_stop / length
log = first.contacts
# gravity also bends the falling beam a little: the rigid-body mode alone is exact
assert abs(log.t_in[0] / flight - 1) < 1e-3, f"lands after {log.t_in[0]:.5f} s, rigid {flight:.5f} s"
assert abs(log.speed_in[0] / arrival - 1) < 1e-2, f"lands with {log.speed_in[0]:.4f} m/s, rigid {arrival:.4f} m/s"

rest = model.simulate(duration=0.01, dt=1e-3, start=model.equilibrium())
carried = weight * length / (2 * z_stop)
assert abs(rest.force()[-1] / carried - 1) < 1e-9, f"the stop carries {rest.force()[-1]:.6f} N, statics {carried:.6f} N"

if __name__ == "__main__":
    print(f"rigid-body mode: omega = {model.omega[0]} rad/s, first bending mode {model.omega[1]:.0f} rad/s")
    print(f"lands after {log.t_in[0]:.5f} s (rigid {flight:.5f}), with {log.speed_in[0]:.4f} m/s (rigid {arrival:.4f})")
    print(f"{len(log)} contacts in {first.t[-1]:.2f} s, the first with {log.peak_force[0]:.0f} N")
    print(f"at rest the stop carries {rest.force()[-1]:.4f} N (statics {carried:.4f} N)")
