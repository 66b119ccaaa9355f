"""Standard deviations that hold when residuals are coloured.

Least squares with gradient A (n, m), residual e (n,) and what is known beforehand, the precisions P (m, m) of priors:
with M = (A'A + P)^-1 the covariance of the estimate is the sandwich
    C = M (Omega + P) M,   Omega = Cov(A'e)
    plain           Omega = s^2 A'A                     right for white residuals only; 2-6 times too small on slip
    segments clustered       Omega = sum_g (A_g'e_g)(A_g'e_g)'   any dependence inside a cluster g, none between
    Newey-West      Omega = S_0 + sum_l (1 - l/(L+1)) (S_l + S_l'),  S_l = sum_t (A_t e_t)(A_t+l e_t+l)',  L = n/20
Sources: Newey & West (1987), Econometrica 55, 703; Kiefer & Vogelsang (2005), Econometric Theory 21, 1130 (lags as a
share of the samples); Liang & Zeger (1986), Biometrika 73, 13; Bell & McCaffrey (2002), Survey Methodology 28, 169
(jackknife form of the clustered one).
"""

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

SHARE = 0.05  # of the samples: lags of Newey and West
LAG_RULE = "Newey-West, lags of 1/20 of the samples, widened (Kiefer-Vogelsang)"
# 97.5 % quantile of the ratio of an estimate to its deviation with lags of a share b, by powers of b (Bartlett's
# weights; Kiefer & Vogelsang 2005, table 1)
QUANTILE = (1.96, 2.9694, 0.4160, -0.5324)


class Joint(NamedTuple):
    """Estimates (m,) by name, the bounds that they were sought within, and their covariance (m, m)."""

    names: tuple[str, ...]
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    covariance: np.ndarray

    @classmethod
    def of(cls, estimates: Sequence[Any], covariance: np.ndarray) -> Self:
        """Of what has a name and a value, and may have a minimum and a maximum."""
        low, high = (
            np.array([sign * np.inf if (end := getattr(one, name, None)) is None else end for one in estimates])
            for name, sign in (("minimum", -1.0), ("maximum", 1.0))
        )
        values = np.array([one.value for one in estimates])
        return cls(tuple(one.name for one in estimates), values, low, high, covariance)


def plain_covariance(gradient: np.ndarray, residual: np.ndarray, *, prior: np.ndarray | None = None) -> np.ndarray:
    """Covariance (m, m) for white residuals. gradient: (n, m); residual: (n,); prior: (m, m) precisions."""
    variance = float(residual @ residual) / (len(residual) - gradient.shape[1])
    inverse = inverse_information(gradient, prior)
    if prior is None or not prior.any():
        return inverse * variance
    return inverse @ (variance * gradient.T @ gradient + prior) @ inverse


def inverse_information(gradient: np.ndarray, prior: np.ndarray | None = None) -> np.ndarray:
    """(A'A + P)^-1 (m, m) by QR of the rows, their columns scaled: A'A would square the condition, and a pseudoinverse
    drop the very directions that are least known. Rows of a direction without effect give infinities.

    gradient: (n, m); prior: (m, m) precisions, positive semidefinite.
    """
    rows = gradient if prior is None else np.vstack([gradient, _root(prior)])
    norms = np.linalg.norm(rows, axis=0)
    norms = np.where(norms > 0, norms, np.finfo(float).tiny)
    triangle = np.linalg.qr(rows / norms, mode="r")
    inverse = np.linalg.solve(
        triangle + np.diag(np.where(np.diag(triangle) == 0, np.finfo(float).tiny, 0)), np.eye(len(norms))
    )
    return inverse @ inverse.T / np.outer(norms, norms)


def _root(matrix: np.ndarray) -> np.ndarray:
    """R with R'R = matrix (m, m), positive semidefinite."""
    units = np.sqrt(np.diag(matrix))
    units = np.where(units > 0, units, 1.0)
    values, vectors = np.linalg.eigh(matrix / np.outer(units, units))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * units


def newey_west(
    gradient: np.ndarray,
    residual: np.ndarray,
    *,
    log: np.ndarray | None = None,
    prior: np.ndarray | None = None,
    reach: int | None = None,
) -> np.ndarray:
    """Covariance (m, m) for residuals correlated over up to `lag_count` rows, so that 1.96 deviations hold the truth
    in 95 of 100 cases; or over ``reach`` rows, where it is known how far the correlation reaches.

    With so many lags the deviation is itself a random number; QUANTILE of the share of lags in place of 1.96 widens it
    for that. Measured with the motion of the EMPS and noise of its residuals' colour, 200 times
    (tests/benchmarks/bench_lags.py), 95 % intervals of M, Fv, Fc and offset hold the truth in
        lags by an AR(1) of the scores (Andrews 1991)                             98 83 86 74 %
        lags by the residuals' first zero crossing, twice                         96 88 88 86 %
        1.3 sqrt(n) lags, widened (Lazarus, Lewis, Stock, Watson 2018)            98 90 89 83 %
        n/20 lags, widened: this rule                                             98 92 91 88 %
        n/10 lags, widened: no better by more than chance, deviations scatter 1.4 times as much   97 93 92 90 %
        prewhitened, quadratic spectral (Andrews & Monahan 1992)                  99 74 78 54 %
    Friction that the model lacks comes back with every stroke, seconds later: what neighbours do, or when the residuals
    first change sign, does not tell of it.

    gradient: (n, m); residual: (n,); log: (n,) labels, no correlation reaches from one to the next (one log if None);
    prior: (m, m) precisions.
    """
    log = np.zeros(len(residual)) if log is None else log
    precision = np.zeros((gradient.shape[1],) * 2) if prior is None else prior
    inverse = inverse_information(gradient, precision)
    count, lags = len(residual), lag_count(len(residual)) if reach is None else reach
    share = (lags + 1) / count if reach is None else 0.0
    widened = np.polynomial.polynomial.polyval(share, QUANTILE) / QUANTILE[0]
    spread = bartlett(gradient * residual[:, None], lags, log) * count / (count - gradient.shape[1])
    return inverse @ (float(widened) ** 2 * spread + precision) @ inverse


def lag_count(count: int) -> int:
    """Over how many of ``count`` samples they are taken to depend on one another: the one rule (see `newey_west`)."""
    return max(int(SHARE * count), 1)


def bartlett(score: np.ndarray, lags: int, log: np.ndarray) -> np.ndarray:
    """Covariance (m, m) of the sum of correlated rows (n, m), with Bartlett's weights over ``lags``; log: (n,)."""
    spread = score.T @ score
    for lag in range(1, min(lags, len(score) - 1) + 1):
        same = (log[:-lag] == log[lag:])[:, None]
        cross = (score[:-lag] * same).T @ score[lag:]
        spread = spread + (1 - lag / (lags + 1)) * (cross + cross.T)
    return spread


def clustered_covariance(
    gradient: np.ndarray, residual: np.ndarray, cluster: np.ndarray, *, prior: np.ndarray | None = None
) -> np.ndarray:
    """Covariance (m, m) for residuals dependent within a cluster and independent between clusters (jackknife form).

    The estimate is recomputed, to first order, without each cluster in turn; with few clusters this is slightly too
    wide where the plain sandwich is too narrow. gradient: (n, m); residual: (n,); cluster: (n,) labels, two or more
    of them; prior: (m, m) precisions.
    """
    precision = np.zeros((gradient.shape[1],) * 2) if prior is None else prior
    # in units of their own: beside coefficients of friction a stiffness in N/m is smaller than rounding
    units = np.sqrt(np.sum(gradient**2, axis=0) + np.diag(precision))
    units[units == 0] = 1.0
    gradient, precision = gradient / units, precision / np.outer(units, units)
    normal = gradient.T @ gradient + precision
    shifts = []
    order = np.argsort(cluster, kind="stable")
    for inside in np.split(order, np.flatnonzero(np.diff(cluster[order])) + 1):
        rows = gradient[inside]
        # least squares: without a cluster some direction may be lost, along which the estimate then stays
        shifts.append(np.linalg.lstsq(normal - rows.T @ rows, rows.T @ residual[inside], rcond=None)[0])
    table = np.array(shifts)
    table = table - table.mean(axis=0)
    inverse = np.linalg.inv(normal)
    covariance = (len(table) - 1) / len(table) * table.T @ table + inverse @ precision @ inverse
    return covariance / np.outer(units, units)


def student(freedom: float, level: float) -> float:
    """Quantile of Student's distribution for a two-sided interval of that level."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1), 0.5 + level / 2))


def inflation(white: np.ndarray, coloured: np.ndarray) -> float:
    """By how much colour inflates a covariance (m, m), on average over the parameters that are not held; 1 or more."""
    count = np.count_nonzero(np.diag(white))
    return max(float(np.trace(np.linalg.lstsq(white, coloured, rcond=None)[0])) / count, 1.0)


def correlation(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix (m, m) of a covariance (m, m)."""
    deviation = np.sqrt(np.diag(covariance))
    return covariance / np.outer(deviation, deviation)


def autocorrelation(residual: np.ndarray, cluster: np.ndarray) -> float:
    """Correlation of successive residuals (n,) inside clusters (n,); 0 for white ones."""
    same = cluster[1:] == cluster[:-1]
    power = float(np.mean(residual**2))
    return float(np.mean((residual[1:] * residual[:-1])[same]) / power) if same.any() and power > 0 else 0.0
