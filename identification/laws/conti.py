"""mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k.

Source: Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), equations (2) and (28), Table 1.
"""

from __future__ import annotations

import numpy as np

from identification.laws.law import FittableLaw, LawParameter, coefficient, fall_start, falling_warnings

MU_S = coefficient("mu_s", "friction coefficient at vanishing slip speed")
MU_K = coefficient("mu_k", "friction coefficient at great slip speed")
P = LawParameter("p", "s/m", 0.0, 1e4, "slope of the fall of friction with slip speed")


def share(v: np.ndarray, p: float) -> np.ndarray:
    """What is left at slip speed v of the difference between mu_s and mu_k."""
    return 1 / (1 + p * v)


def scales(v: np.ndarray) -> np.ndarray:
    """Values of p among which a fit may start."""
    return np.geomspace(0.2 / np.max(v), 100 / np.max(v), 25)


def value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    """mu at slip speeds v."""
    return (q[0] - q[1]) * share(v, q[2]) + q[1]


def gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    """d mu / d (mu_s, mu_k, p)."""
    left = share(v, q[2])
    return np.stack([left, 1 - left, -(q[0] - q[1]) * v * left**2])


def _start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    return fall_start(v, mu, scales(v), share)


def _warnings(q: np.ndarray) -> tuple[str, ...]:
    return falling_warnings("Conti", q[0], q[1])


def _simulated(q: np.ndarray, N: float) -> dict[str, float]:
    return {"mu_s": float(q[0]), "mu_k": float(q[1]), "p": float(q[2])}


LAW = FittableLaw("Conti", (MU_S, MU_K, P), value, gradient, _start, _warnings, None, _simulated)
