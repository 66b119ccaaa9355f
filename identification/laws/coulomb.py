"""mu(v) = mu: Coulomb's law. Simulated as Conti's law with mu_s = mu_k."""

from __future__ import annotations

import numpy as np

from identification.laws.law import FittableLaw, coefficient

MU = coefficient("mu", "friction coefficient at any slip speed")


def _value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.full_like(v, q[0], dtype=float)


def _gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.ones((1, *np.shape(v)))


def _start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    return np.array([np.mean(mu)])


def _warnings(q: np.ndarray) -> tuple[str, ...]:
    return ()


def _simulated(q: np.ndarray, N: float) -> dict[str, float]:
    return {"mu_s": float(q[0]), "mu_k": float(q[0]), "p": 0.0}


LAW = FittableLaw("Coulomb", (MU,), _value, _gradient, _start, _warnings, None, _simulated)
