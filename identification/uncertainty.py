"""Standard deviations that hold when residuals are coloured.

Least squares with gradient A (n, m) and residual e (n,): with M = (A'A)^-1 the covariance of the estimate is the
sandwich
    C = M Omega M,   Omega = Cov(A'e)
    plain           Omega = s^2 A'A                     right for white residuals only; 2-6 times too small on slip
    segments clustered       Omega = sum_g (A_g'e_g)(A_g'e_g)'   any dependence inside a cluster g, none between
    Newey-West      Omega = S_0 + sum_l (1 - l/(L+1)) (S_l + S_l'),  S_l = sum_t (A_t e_t)(A_t+l e_t+l)'
Sources: Newey & West (1987), Econometrica 55, 703; Liang & Zeger (1986), Biometrika 73, 13; Bell & McCaffrey (2002),
Survey Methodology 28, 169 (jackknife form of the clustered one); Kuensch (1989), Ann. Statist. 17, 1217 (block
bootstrap).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def plain_covariance(gradient: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Covariance (m, m) for white residuals. gradient: (n, m); residual: (n,)."""
    freedom = len(residual) - gradient.shape[1]
    return np.linalg.inv(gradient.T @ gradient) * float(residual @ residual) / freedom


def newey_west(gradient: np.ndarray, residual: np.ndarray, *, lags: int) -> np.ndarray:
    """Covariance (m, m) for residuals correlated over up to ``lags`` samples. gradient: (n, m); residual: (n,)."""
    inverse = np.linalg.inv(gradient.T @ gradient)
    score = gradient * residual[:, None]
    spread = score.T @ score
    for lag in range(1, min(lags, len(score) - 1) + 1):
        cross = score[:-lag].T @ score[lag:]
        spread += (1 - lag / (lags + 1)) * (cross + cross.T)
    return inverse @ spread @ inverse * len(residual) / (len(residual) - gradient.shape[1])


def clustered_covariance(
    gradient: np.ndarray, residual: np.ndarray, cluster: np.ndarray, precision: np.ndarray | None = None
) -> np.ndarray:
    """Covariance (m, m) for residuals dependent within a cluster and independent between clusters (jackknife form).

    The estimate is recomputed, to first order, without each cluster in turn; with few clusters this is slightly too
    wide where the plain sandwich is too narrow. gradient: (n, m); residual: (n,); cluster: (n,) labels, two or more
    of them; precision: (m, m) of what is known beforehand, which stays when a cluster leaves.
    """
    normal = gradient.T @ gradient + (0 if precision is None else precision)
    shifts = []
    for label in np.unique(cluster):
        inside = cluster == label
        part = gradient[inside]
        shifts.append(np.linalg.solve(normal - part.T @ part, part.T @ residual[inside]))
    table = np.array(shifts)
    table = table - table.mean(axis=0)
    return (len(table) - 1) / len(table) * table.T @ table


def block_bootstrap(
    estimate: Callable[[np.ndarray], np.ndarray], cluster: np.ndarray, *, draws: int = 200, seed: int = 0
) -> np.ndarray:
    """Estimates (draws, m) from resampled blocks: whole clusters are drawn with replacement.

    estimate: takes row numbers (k,), repeats allowed, and returns the estimate (m,) from these rows.
    """
    rng = np.random.default_rng(seed)
    blocks = [np.flatnonzero(cluster == label) for label in np.unique(cluster)]
    chosen = rng.integers(0, len(blocks), size=(draws, len(blocks)))
    return np.array([estimate(np.concatenate([blocks[block] for block in draw])) for draw in chosen])


def correlation(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix (m, m) of a covariance (m, m)."""
    deviation = np.sqrt(np.diag(covariance))
    return covariance / np.outer(deviation, deviation)


def autocorrelation(residual: np.ndarray, cluster: np.ndarray) -> float:
    """Correlation of successive residuals (n,) inside clusters (n,); 0 for white ones."""
    same = cluster[1:] == cluster[:-1]
    power = float(np.mean(residual**2))
    return float(np.mean((residual[1:] * residual[:-1])[same]) / power) if same.any() and power > 0 else 0.0
