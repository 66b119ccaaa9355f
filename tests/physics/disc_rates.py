"""The disc rig typed out: (1), (2), (11) to (16) with sgn written out, for any set of discs that touch."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

STATES = ["theta", "omega"]
LINER_RUBBER = {f"{name}{i}": value for i in (0, 1) for name, value in (("mu_s", 0.5), ("mu_k", 0.33), ("p", 20.0))}


def normal_forces(N: float) -> dict[str, float]:
    return {"N0": N, "N1": N}


def disc_rates(
    w: Callable[[float], tuple[float, float]], N: float = 4.905, c: float = 0.055
) -> Callable[[float, NDArray[np.float64], Mapping[str, int]], list[float]]:
    """Rates of theta and omega for paper/rubber and disc speeds w(t); in stick the body keeps the disc's speed."""
    J, k, R, r, mu_s, mu_k, p = 0.0548, 2.62, 0.125, 0.06, 0.65, 0.35, 15.0

    def rates(t: float, x: NDArray[np.float64], contacts: Mapping[str, int]) -> list[float]:
        theta, omega = x
        if 0 in contacts.values():
            i = [contacts["disc0"], contacts["disc1"]].index(0)
            h = 1e-6
            return [omega, r / R * (w(t + h)[i] - w(t - h)[i]) / (2 * h)]
        torque = 0.0
        for i in (0, 1):
            sign = contacts[f"disc{i}"]
            if sign != 2:
                v = r * w(t)[i] - R * omega
                torque += R * N * sign * ((mu_s - mu_k) / (1 + p * sign * v) + mu_k)
        return [omega, (torque - c * omega - k * theta) / J]

    return rates
