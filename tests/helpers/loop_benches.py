"""Laws that emulated benches move, and whether fits of their logs hold the truth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from identification.hysteresis.loop import LoopLog
from identification.hysteresis.result import HysteresisFit
from rig_io.bench.settings import Recorded

LAWS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "MaxwellSlip-2": ("MaxwellSlip(k=[3e5, 1e5], D=[5e-4, 2e-3])", {"k_1": 3e5, "k_2": 1e5, "D_1": 5e-4, "D_2": 2e-3}),
    "MaxwellSlip-4": (
        "MaxwellSlip(k=[2e5, 1e5, 6e4, 4e4], D=[3e-4, 8e-4, 1.8e-3, 3.5e-3])",
        {f"k_{i}": k for i, k in enumerate((2e5, 1e5, 6e4, 4e4), 1)}
        | {f"D_{i}": d for i, d in enumerate((3e-4, 8e-4, 1.8e-3, 3.5e-3), 1)},
    ),
    "Dahl": ("Dahl(sigma=3e5, F_c=300)", {"sigma": 3e5, "F_c": 300.0}),
    "BoucWen-1": ("BoucWen(k=3e5, beta=600, gamma=400, n=1)", {"k": 3e5, "beta": 600.0, "gamma": 400.0}),
    "Iwan4": (
        "Iwan4(F_S=300, K_T=3e5, chi=-0.4, beta=0.6, sliders=8)",
        {"F_S": 300.0, "K_T": 3e5, "chi": -0.4, "beta_S": 0.6},
    ),
}
NOISY: dict[str, Any] = {"noise_way": 1e-3, "noise_force": 1e-3}


def loop_log(recorded: Recorded, *, clock: bool = False) -> LoopLog:
    """A log in SI as it would be read."""
    columns = recorded.columns
    return LoopLog(recorded.name, columns["way"], columns["force"], columns["time"] if clock else None)


def holding(fit: HysteresisFit, name: str, truth: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """By parameter, error over deviation, and whether the interval holds the truth; sliders by their bounds."""
    law = next(one for one in fit.laws if one.name == name)
    assert law.calibration is not None, law.why
    names = list(truth)
    if name.startswith("MaxwellSlip"):
        count = len(names) // 2
        order = sorted(range(1, count + 1), key=lambda i: law.values[f"D_{i}"])
        names = [f"{what}_{i}" for what in "kD" for i in order]
    values = np.array([law.values[one] for one in names])
    ends = np.array([law.calibration.interval(one) for one in names])
    expected = np.array(list(truth.values()))
    half = (ends[:, 1] - ends[:, 0]) / 2 / 1.96
    return (values - expected) / half, (ends[:, 0] <= expected) & (expected <= ends[:, 1])
