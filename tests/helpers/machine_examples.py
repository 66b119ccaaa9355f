"""The logs in data/machines, emulated: axis, slider and arm. Run:  python tests/helpers/machine_examples.py FOLDER"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np
from emulated_arm import table
from scipy.signal import lfilter

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from identification.measurement.signals import GRAVITY
from rig_io.readers.csv_log import write

AXIS = {"M": 20.0, "Fv": 60.0, "Fc": 12.0, "offset": -1.5}  # kg, N s/m, N, N
SLIDER = {"mass": 0.5, "stiffness": 50.0, "speed": 0.01, "mu_s": 0.6, "mu_k": 0.45}  # kg, N/m, m/s, 1, 1


def axis() -> dict[str, np.ndarray]:
    """A linear axis, 10 s at 500 Hz: time (s), position (mm, in steps of 1 um), force (N, coloured noise of a drive).

    At both ends position and acceleration are zero, so that filters have no edge there.
    """
    time = np.arange(5001) / 500
    first, second = 2 * np.pi * 0.6, 2 * np.pi * 1.7
    x = 0.12 * np.sin(first * time) + 0.02 * np.sin(second * time)
    v = 0.12 * first * np.cos(first * time) + 0.02 * second * np.cos(second * time)
    a = -0.12 * first**2 * np.sin(first * time) - 0.02 * second**2 * np.sin(second * time)
    force = AXIS["M"] * a + AXIS["Fv"] * v + AXIS["Fc"] * np.sign(v) + AXIS["offset"]
    force = force + lfilter([0.4], [1, -0.9], np.random.default_rng(1).normal(size=len(time)))
    return {"time": time, "position": np.round(1e3 * x, 3), "force": np.round(force, 2)}


def slider() -> dict[str, np.ndarray]:
    """A slider on a belt, drawn by a spring, 45 s at 200 Hz: time (s), spring force over weight (1)."""
    known = SLIDER
    time = np.arange(9000) / 200
    weight = known["mass"] * GRAVITY
    parameters = {"m": known["mass"], "k": known["stiffness"], "c": 0.0, "N": weight, "p": 2000.0}
    run = simulate(
        Fmu.open(built("block_on_belt")),
        time[-1],
        output_times=time,
        parameters={**parameters, "mu_s": known["mu_s"], "mu_k": known["mu_k"]},
        inputs={"v_belt": known["speed"]},
        start={"x": 0.04, "v": known["speed"]},
    )
    noise = 0.001 * np.random.default_rng(2).normal(size=len(time))
    return {"time": time, "friction": np.round(run["x"] * known["stiffness"] / weight + noise, 4)}


EXAMPLES = {"axis": axis, "slider": slider} | {f"two_link_arm_{seed}": partial(table, seed) for seed in (1, 2, 3)}

if __name__ == "__main__":
    for name, make in EXAMPLES.items():
        write(Path(sys.argv[1]) / f"{name}.csv", make())
