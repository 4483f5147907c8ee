"""The same ensemble on a Dask cluster: any executor will do, and the numbers are the same bits as here.

A cluster of two processes is started on this machine; for a real one, give `Client` the address of its scheduler.
Workers import the quantity, so it lives in a module that they have, not in a script. Needs the extra `cluster`.

    python examples/cluster.py        prints mean ± standard error of both, or says that `distributed` is missing
"""

from functools import partial
from importlib.util import find_spec

import numpy as np

import fembeam as fb
from contacts import Hysteretic
from fembeam.study import characteristics, ensemble

z_stop = 0.24445
scene = fb.Scene(
    beam=fb.Beam(0.2599, fb.Section(E=1.9e11, rho=8000.0, A=58.3e-6, I=18.5e-12)),
    supports=[fb.Clamped(0.0)],
    masses=[fb.LumpedMass(z_stop, mass=25.4e-3, inertia=3.0e-6)],
    stops=[fb.Stop(z_stop, law=Hysteretic.lankarani_nikravesh(2.1e8, restitution=0.5))],
    damping=fb.ModalDamping([0.02, 0.01]),
    base=fb.BandNoise(std=2.5e-4, band=(0.0, 1226.6), seed=1),
)


def main() -> None:
    from distributed import Client, LocalCluster

    model, quantity = scene.reduce(modes=2), partial(characteristics, duration=20.0, dt=1e-3)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        there = ensemble(model, 4, quantity, client.get_executor())
    here = ensemble(model, 4, quantity)
    for name, values in here.values.items():
        assert np.array_equal(values, there.values[name], equal_nan=True), f"{name} differs between cluster and here"
    print(there)


if __name__ == "__main__":
    if find_spec("distributed") is None:
        print("skipped: the package 'distributed' is not installed; pip install -e '.[cluster]'")
    else:
        main()
