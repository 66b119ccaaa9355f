"""mu(v) = mu + mu_v v: Coulomb's law with viscous friction N mu_v v. Simulated as Conti's with mu_s = mu_k."""

from __future__ import annotations

import numpy as np

from identification.laws.coulomb import MU
from identification.laws.law import VISCOUS, FittableLaw


def _value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return q[0] + q[1] * v


def _gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.stack([np.ones_like(v, dtype=float), np.asarray(v, dtype=float)])


def _start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    from scipy.optimize import nnls

    return nnls(np.stack([np.ones_like(v), v], axis=1), mu)[0]


def _warnings(q: np.ndarray) -> tuple[str, ...]:
    return ()


def _simulated(q: np.ndarray, N: float) -> dict[str, float]:
    return {"mu_s": float(q[0]), "mu_k": float(q[0]), "p": 0.0, "viscous": float(N * q[1])}


LAW = FittableLaw("Coulomb+viscous", (MU, VISCOUS), _value, _gradient, _start, _warnings, "conti_viscous", _simulated)
