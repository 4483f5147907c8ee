"""The annotated scene file that `fembeam new` writes: it runs as it is, and shows what else a file may hold."""

from __future__ import annotations

TEMPLATE = """\
# A scene: a clamped steel beam with a tip mass, shaken by its frame, that meets a stop.
#
#     fembeam check {name}                  what the model is, what to doubt
#     fembeam run {name} --out results      tables, figures, report.html
#     fembeam schema > scene.schema.json    then let the first line be `#:schema scene.schema.json` for your editor
#
# SI units throughout: m, kg, s, N, rad/s; frequencies are angular. A table behind `# ` is an example of what else
# may be said: remove the `# `.

[beam]
length = 0.26
section = {{ shape = "rectangle", E = 2.1e11, rho = 7800, width = 0.02, height = 0.002 }}
# shapes: general (E, rho, A, I, fibre), rectangle, circle (diameter), tube (outer, inner), taper (start, end)

[[supports]]                # clamped, pinned, guided; none: a free beam
kind = "clamped"
z = 0                       # along the beam, from its left end

[[masses]]
z = 0.25
mass = 0.025
inertia = 3e-6              # kg m², 0 if left out

# [[springs]]
# z = 0.2
# stiffness = 500           # N/m
# rotational = 0            # N m/rad

# [[dashpots]]
# z = 0.2
# damping = 0.1             # N s/m

[[stops]]                   # several are allowed
z = 0.25
gap = 0.0                   # < 0: pressed against the beam
side = "below"              # or "above"
law = {{ kind = "achieving", stiffness = 2e8, restitution = 0.7 }}
# other laws: hertz (stiffness), kelvin_voigt (stiffness, damping), piecewise_linear (slopes, knots),
# tabulated_file (path of a CSV file with indentation and force), with memory jenkins (stiffness, limit), walton_braun
# (loading, unloading), ...; an unknown name lists them all

# [[elements]]              # act always, at both signs of u - gap
# z = 0.2
# law = {{ kind = "polynomial", coefficients = [0, 0, 1e9] }}   # or kelvin_voigt (stiffness, damping), ...
# of = "rotation"           # of the slope: a hinge spring, N m over rad (stops have it as well); else displacement
# to = 0.1                  # other end on the beam; left out: the frame

[damping]
zeta = [0.02, 0.01]         # ratios of the modes, the last for all higher ones; or alpha and beta of Rayleigh

[base]                      # motion of the frame; leave out for none
kind = "harmonic"           # or multisine, band_noise (std, band, seed), pulse, step, or
                            # record (path of a CSV file, quantity = "displacement" or "acceleration")
amplitude = 1e-3            # m
omega = 195.0               # rad/s

# [[forces]]
# z = 0.13
# signal = {{ kind = "harmonic", amplitude = 1.0, omega = 300.0 }}   # N

# [[impactors]]             # a free mass that strikes the beam from above
# z = 0.13
# mass = 0.01
# velocity = -1.0           # m/s
# law = {{ kind = "hertz", stiffness = 1e9 }}
# gap = 1e-3
# side = "above"

[reduce]
modes = 3                   # or omega_max, mass_share; residual = true adds static shapes of stops, forces, dashpots

[simulate]                  # one table per study; a file may have several
duration = 10.0
dt = 5e-4                   # output sampling; the solver chooses its own steps
discard = 2.0               # transient that statistics leave out
# solver = {{ kind = "exponential", rtol = 1e-10 }}

# [mode_count]              # how many modes it takes
# counts = [1, 2, 3, 5]
# quantity = "peak_force"
# duration = 1.0
"""
