"""Logs of a block on a belt with known truth and noise, for calibrations."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

FREE = ["a0", "a1", "a3", "k", "f0"]
TRUE = {"a0": 1.5, "a1": 1.5, "a3": 0.45, "k": 1.0, "f0": 0.1}
OFF = {"a0": 2.4, "a1": 0.95, "a3": 0.7, "k": 0.65, "f0": 0.16}  # by half, each
NOISE = 0.005


def noisy(
    fmu: Fmu,
    seed: int,
    until: float = 60.0,
    samples: int = 601,
    parameters: dict[str, float] | None = None,
    name: str = "x",
    noise: float = NOISE,
    **more: Any,
) -> dict[str, np.ndarray]:
    """Times and one variable of a run, with white noise."""
    time = np.linspace(0, until, samples)
    run = simulate(fmu, until, output_times=time, parameters=parameters or {}, **more)
    return {"time": time, name: run[name] + noise * np.random.default_rng(seed).normal(size=samples)}
