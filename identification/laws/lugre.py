"""LuGre: bristles of stiffness sigma0 and damping sigma1 before Conti's law, which is its friction in steady slip.

    F = sigma0 z + sigma1 z',    z' = v - sigma0 |v| z/(N mu(|v|)),    mu(v) = (mu_s - mu_k)/(1 + p v) + mu_k

mu says nothing of the bristles: regressions on slip cannot find them. Source: fmu_models/language/laws/lugre.py.
"""

from __future__ import annotations

import numpy as np

from identification.laws import conti
from identification.laws.law import FittableLaw, LawParameter, falling_warnings


def _value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return conti.value(v, q)


def _gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.concatenate([conti.gradient(v, q), np.zeros((2, *np.shape(v)))])


def _start(v: np.ndarray, mu: np.ndarray) -> np.ndarray:
    return np.append(conti.LAW.start(v, mu), [2e5, 100.0])


def _warnings(q: np.ndarray) -> tuple[str, ...]:
    return falling_warnings("LuGre", q[0], q[1])


def _simulated(q: np.ndarray, N: float) -> dict[str, float]:
    return dict(zip(("mu_s", "mu_k", "p", "sigma0", "sigma1"), map(float, q), strict=True))


LAW = FittableLaw(
    "LuGre",
    (
        conti.MU_S,
        conti.MU_K,
        conti.P,
        LawParameter("sigma0", "N/m", 1e3, 2e6, "stiffness of the bristles, below gross slip"),
        LawParameter("sigma1", "N*s/m", 0.0, 1e4, "damping of the bristles"),
    ),
    _value,
    _gradient,
    _start,
    _warnings,
    "lugre",
    _simulated,
)
