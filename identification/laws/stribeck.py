"""mu(v) = mu_k + (mu_s - mu_k) exp(-v/v_s): Stribeck's fall as an exponential.

Source: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994), 1083, there as Tustin's.
"""

from __future__ import annotations

import numpy as np

from identification.laws.conti import MU_K, MU_S
from identification.laws.law import FittableLaw, LawParameter, fall_start, falling_warnings

V_S = LawParameter("v_s", "m/s", 1e-4, 100.0, "slip speed over which friction falls")


def _share(v: np.ndarray, v_s: float) -> np.ndarray:
    return np.exp(-v / v_s)


def _value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return q[1] + (q[0] - q[1]) * _share(v, q[2])


def _gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    left = _share(v, q[2])
    return np.stack([left, 1 - left, (q[0] - q[1]) * left * v / q[2] ** 2])


def _start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    return fall_start(v, mu, np.max(v) / np.geomspace(0.2, 100, 25), _share)


def _warnings(q: np.ndarray) -> tuple[str, ...]:
    return falling_warnings("Stribeck", q[0], q[1])


def _simulated(q: np.ndarray, N: float) -> dict[str, float]:
    return {"mu_s": float(q[0]), "mu_k": float(q[1]), "v_s": float(q[2])}


LAW = FittableLaw(
    "Stribeck", (MU_S, MU_K, V_S), _value, _gradient, _start, _warnings, "exponential_stribeck", _simulated
)
