"""Gap and stiffness of a stop by scipy.optimize: the smallest rms that a force limit allows, on all processors.

    minimise √(mean u(tip)²)  over gap and stiffness,    largest contact force <= limit

A bar with a mass at its tip sags onto a stop and is shaken. A soft stop with preload lets it swing, a stiff one pushes
too hard. Searches from several soft stops share the processors; an evaluation is one run, as the modes are those
without the stop. The independent check: as long as contact lasts the stop is a spring and a dashpot, whose rms and
force follow from the frequency response; the best of a fine grid of those is the same.

    python examples/choose_stop.py       prints the choice, the number of runs and their time
"""

import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import minimize

import fembeam as fb
from contacts import KelvinVoigt

length, limit, omega, amplitude, lag = 0.8, 7.5, 25.0, 2e-3, 2e-3  # m, N, rad/s, m, s: damping over stiffness
low, high = np.array([-20e-3, 2.5]), np.array([2e-3, 5.0])  # gap in m, log10 of the stiffness in N/m
SETTINGS = {"rhobeg": 0.2, "tol": 1e-3, "maxiter": 40}


def scene(gap: float = 0.0, stiffness: float = 1e3) -> fb.Scene:
    section = fb.Section.rectangle(E=7.0e10, rho=2700.0, width=0.04, height=0.008)
    stop = fb.Stop(length, KelvinVoigt(stiffness, damping=lag * stiffness, clamp=True), gap=gap)
    parts = {"masses": [fb.LumpedMass(length, mass=0.5)], "stops": [stop], "damping": fb.ModalDamping(0.05)}
    drive = {"base": fb.Harmonic(amplitude, omega), "gravity": 9.81}
    return fb.Scene(fb.Beam(length, section), [fb.Clamped(0.0)], **parts, **drive)


model = scene().reduce(modes=2)


@cache  # goal and constraint ask for the same run
def response(gap: float, exponent: float) -> tuple[float, float]:
    """Rms of the tip (m) and the largest force (N) once the transient has died out."""
    changed = replace(model, scene=scene(gap, 10.0**exponent))
    run = changed.simulate(duration=6.0, dt=2e-3, start=changed.equilibrium())
    late = run.t > 4.0
    return float(np.sqrt((run.displacement(length)[late] ** 2).mean())), float(run.force()[late].max())


def search(start: np.ndarray) -> tuple[np.ndarray, int]:
    """What one start (0 to 1 across the box) leads to, and how many runs it took."""

    def asked(x: np.ndarray) -> tuple[float, float]:
        return response(*(low + x * (high - low)).tolist())

    allowed = {"type": "ineq", "fun": lambda x: np.array([limit - asked(x)[1], *x, *(1 - x)])}
    found = minimize(lambda x: 1e3 * asked(x)[0], start, method="COBYLA", constraints=allowed, options=SETTINGS)
    return low + found.x * (high - low), found.nfev


def closed_form() -> float:
    """Least rms (m) with a spring and a dashpot that always push, on a fine grid of the box."""
    gap, k = np.linspace(low[0], high[0], 800)[:, None], 10.0 ** np.linspace(low[1], high[1], 400)
    static, dynamic = (model.frequency_response(w, input=length, output=length).values[0] for w in (0.0, omega))
    sag = model.phi(length) @ (-model.participation * 9.81 / model.omega**2)
    push, impedance = k * (-gap - sag) / (1.0 + k * static.real), k * (1.0 + 1j * lag * omega)
    swing = abs(amplitude * model.frequency_response(omega, output=length).values[0] / (1.0 + impedance * dynamic))
    rms, varying = np.sqrt((sag + static.real * push) ** 2 + swing**2 / 2), abs(impedance) * swing
    return float(rms[(push + varying <= limit) & (push > varying)].min())


if __name__ == "__main__":
    started, starts = time.perf_counter(), [np.array([x, 0.25]) for x in (0.1, 0.3, 0.5, 0.7, 0.9)]
    with ProcessPoolExecutor() as pool:  # with joblib: Parallel(n_jobs=-1)(delayed(search)(start) for start in starts)
        choices, counts = zip(*pool.map(search, starts), strict=True)
    seconds, exact, pairs = time.perf_counter() - started, closed_form(), [(response(*at), tuple(at)) for at in choices]
    (rms, force), (gap, exponent) = min(pair for pair in pairs if pair[0][1] < 1.001 * limit)
    print(f"gap {1e3 * gap:.2f} mm, stiffness {10**exponent:.0f} N/m: rms {1e3 * rms:.4f} mm, force {force:.3f} N")
    print(f"{sum(counts)} runs in {seconds:.1f} s; closed form {1e3 * exact:.4f} mm")
    assert abs(rms / exact - 1.0) < 0.01, f"rms {rms:.4g} m, closed form {exact:.4g} m"
