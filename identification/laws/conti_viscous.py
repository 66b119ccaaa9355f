"""mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k + mu_v v: Conti's law with viscous friction N mu_v v."""

from __future__ import annotations

import numpy as np

from identification.laws import conti
from identification.laws.law import VISCOUS, FittableLaw, fall_start, falling_warnings


def _value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return conti.value(v, q) + q[3] * v


def _gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.concatenate([conti.gradient(v, q), np.asarray(v)[None]])


def _start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    return fall_start(v, mu, conti.scales(v), conti.share, viscous=True)


def _warnings(q: np.ndarray) -> tuple[str, ...]:
    return falling_warnings("Conti+viscous", q[0], q[1])


def _simulated(q: np.ndarray, N: float) -> dict[str, float]:
    return {"mu_s": float(q[0]), "mu_k": float(q[1]), "p": float(q[2]), "viscous": float(N * q[3])}


LAW = FittableLaw(
    "Conti+viscous",
    (conti.MU_S, conti.MU_K, conti.P, VISCOUS),
    _value,
    _gradient,
    _start,
    _warnings,
    "conti_viscous",
    _simulated,
)
