"""Standard deviations that hold when residuals are coloured.

Least squares with gradient A (n, m), residual e (n,) and what is known beforehand, the precisions P (m, m) of priors:
with M = (A'A + P)^-1 the covariance of the estimate is the sandwich
    C = M (Omega + P) M,   Omega = Cov(A'e)
    plain           Omega = s^2 A'A                     right for white residuals only; 2-6 times too small on slip
    segments clustered       Omega = sum_g (A_g'e_g)(A_g'e_g)'   any dependence inside a cluster g, none between
    Newey-West      Omega = S_0 + sum_l (1 - l/(L+1)) (S_l + S_l'),  S_l = sum_t (A_t e_t)(A_t+l e_t+l)'
Sources: Newey & West (1987), Econometrica 55, 703; Andrews (1991), Econometrica 59, 817 (lags from the colour itself);
Liang & Zeger (1986), Biometrika 73, 13; Bell & McCaffrey (2002), Survey Methodology 28, 169 (jackknife form of the
clustered one).
"""

from __future__ import annotations

import numpy as np


def plain_covariance(gradient: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Covariance (m, m) for white residuals. gradient: (n, m); residual: (n,)."""
    freedom = len(residual) - gradient.shape[1]
    return np.linalg.inv(gradient.T @ gradient) * float(residual @ residual) / freedom


def newey_west(
    gradient: np.ndarray,
    residual: np.ndarray,
    *,
    log: np.ndarray | None = None,
    lags: int | None = None,
    prior: np.ndarray | None = None,
) -> np.ndarray:
    """Covariance (m, m) for residuals correlated over up to ``lags`` rows, `automatic_lags` if None.

    gradient: (n, m); residual: (n,); log: (n,) labels, no correlation reaches from one to the next (one log if None);
    prior: (m, m) precisions.
    """
    log = np.zeros(len(residual)) if log is None else log
    known = np.zeros((gradient.shape[1],) * 2) if prior is None else prior
    inverse = np.linalg.inv(gradient.T @ gradient + known)
    score = gradient * residual[:, None]
    if lags is None:
        lags = automatic_lags(score @ inverse, log)
    spread = score.T @ score
    for lag in range(1, min(lags, len(score) - 1) + 1):
        same = (log[:-lag] == log[lag:])[:, None]
        cross = (score[:-lag] * same).T @ score[lag:]
        spread += (1 - lag / (lags + 1)) * (cross + cross.T)
    spread *= len(residual) / (len(residual) - gradient.shape[1])
    return inverse @ (spread + known) @ inverse


def automatic_lags(influence: np.ndarray, log: np.ndarray) -> int:
    """Lags for Bartlett's weights that suit the colour of the influences (n, m) of rows on the parameters.

    Each column is taken for a first-order autoregression of coefficient a: 1.1447 (4 a^2 n/((1 - a)^2 (1 + a)^2))^(1/3)
    (Andrews 1991, equations (6.2), (6.4)); the largest of the columns counts. log: (n,) labels.
    """
    count = len(influence)
    power = np.sum(influence**2, axis=0)
    same = (log[:-1] == log[1:])[:, None]
    cross = np.sum(influence[:-1] * influence[1:] * same, axis=0)
    memory = np.clip(np.divide(cross, power, out=np.zeros_like(power), where=power > 0), -0.97, 0.97)
    reach = 1.1447 * (4 * memory**2 * count / ((1 - memory) ** 2 * (1 + memory) ** 2)) ** (1 / 3)
    return int(min(np.ceil(np.max(reach)), count // 3))


def clustered_covariance(
    gradient: np.ndarray, residual: np.ndarray, cluster: np.ndarray, *, prior: np.ndarray | None = None
) -> np.ndarray:
    """Covariance (m, m) for residuals dependent within a cluster and independent between clusters (jackknife form).

    The estimate is recomputed, to first order, without each cluster in turn; with few clusters this is slightly too
    wide where the plain sandwich is too narrow. gradient: (n, m); residual: (n,); cluster: (n,) labels, two or more
    of them; prior: (m, m) precisions.
    """
    known = np.zeros((gradient.shape[1],) * 2) if prior is None else prior
    normal = gradient.T @ gradient + known
    shifts = []
    for label in np.unique(cluster):
        inside = cluster == label
        part = gradient[inside]
        # least squares: without a cluster some direction may be lost, along which the estimate then stays
        shifts.append(np.linalg.lstsq(normal - part.T @ part, part.T @ residual[inside], rcond=None)[0])
    table = np.array(shifts)
    table = table - table.mean(axis=0)
    inverse = np.linalg.inv(normal)
    return (len(table) - 1) / len(table) * table.T @ table + inverse @ known @ inverse


def student(freedom: int, level: float) -> float:
    """Quantile of Student's distribution for a two-sided interval of that level."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1), 0.5 + level / 2))


def correlation(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix (m, m) of a covariance (m, m)."""
    deviation = np.sqrt(np.diag(covariance))
    return covariance / np.outer(deviation, deviation)


def autocorrelation(residual: np.ndarray, cluster: np.ndarray) -> float:
    """Correlation of successive residuals (n,) inside clusters (n,); 0 for white ones."""
    same = cluster[1:] == cluster[:-1]
    power = float(np.mean(residual**2))
    return float(np.mean((residual[1:] * residual[:-1])[same]) / power) if same.any() and power > 0 else 0.0
