"""Constants adjusted to all that is known of them, and readings that contradict each other.

Constants b > 0 are known by readings of products of their powers (J as stated; k/J of a free decay), and by residuals
r(x, b) of a fit whose unknowns x are projected out. In l = ln b, near where the constants are,
    minimise  sum_i ((d_i.l - y_i)/s_i)^2 + (l - l_0)'H(l - l_0) + 2 h'(l - l_0)
H, h of the residuals; their scores over clusters, whose covariance is W, allow for colour:
    M = D'S^-2 D + H,   step = M^-1 (D'S^-2 (y - D l_0) - h),   C = M^-1 (D'S^-2 D + W) M^-1      (S = diag s)
A reading that is off by more than `SUSPECT` of the deviations of its residual contradicts the others. Readings whose
residuals go together cannot be told apart by them (stated J and k, where the logs give k/J): all of them are widened
by that ratio, so that the adjusted value lies between and its deviation spans both.

Sources: Baarda (1968), A testing procedure for use in geodetic networks; Birge (1932), Phys. Rev. 40, 207.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.inference.problem import Evaluation, FitProblem, prior_precision

SUSPECT = 3.0  # standard deviations of a residual: 3 in a thousand readings that are right
TOGETHER = 0.9  # correlation of residuals from which on readings cannot be told apart
UNKNOWN = 0.3  # relative deviation given to a constant of which nobody says how well it is known
CHECKED = 1e-3  # share of a reading's variance that its residual must keep to tell anything


@dataclass(frozen=True)
class ConstantReading:
    """What is known of a product of powers of constants. deviation: relative, standard; stated: whether it is known
    how well."""

    name: str
    powers: Mapping[str, int]
    value: float
    deviation: float
    stated: bool = True


@dataclass(frozen=True, eq=False)
class Pull:
    """What residuals say of n constants near where they are, by their logarithms: information H (n, n), score h (n,)
    and covariance of the score W (n, n)."""

    information: np.ndarray
    score: np.ndarray
    spread: np.ndarray

    @staticmethod
    def nothing(count: int) -> Pull:
        """The pull of residuals that are not asked: no information."""
        return Pull(np.zeros((count, count)), np.zeros(count), np.zeros((count, count)))


@dataclass(frozen=True)
class Contradiction:
    """Readings that contradict the others. names: those that cannot be told apart; deviations: by which they are off,
    and were widened; values: as read; others: what each would have to be by all others."""

    names: tuple[str, ...]
    deviations: float
    values: tuple[float, ...]
    others: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Adjustment:
    """step: (n,) of the logarithms of the constants; covariance: (n, n) of them."""

    step: np.ndarray
    covariance: np.ndarray


def pull(
    problem: FitProblem,
    x: np.ndarray,
    point: Evaluation,
    columns: np.ndarray,
    beside: np.ndarray,
    precision: np.ndarray,
) -> tuple[Pull, np.ndarray, np.ndarray]:
    """What the residuals of a problem at x (m,) say of constants; and how x moves to its best (m,), and with the
    logarithms of the constants (m, k).

    columns: (n, k) derivatives of its residuals by the logarithms of the constants; beside: (n, j) by what else is
    taken as given, of which the precision (j, j) is known.
    """
    count = len(x)
    freedom = len(point.residual) - point.eliminated - count
    scale = 1.0 if problem.noise_known else float(np.sqrt(point.residual @ point.residual / freedom))
    prior = np.zeros((count + len(precision),) * 2)
    prior[:count, :count], prior[count:, count:] = prior_precision(problem), precision
    priors = np.diag(prior) > 0
    roots = np.linalg.cholesky(prior[np.ix_(priors, priors)]).T
    off = np.array([0.0 if u.prior is None else v - u.prior.value for u, v in zip(problem.unknowns, x, strict=True)])
    off = np.concatenate([off, np.zeros(len(precision))])[priors]
    design = np.vstack([np.hstack([point.gradient, beside]) / scale, np.eye(len(prior))[priors]])
    design[len(columns) :] = roots @ design[len(columns) :]
    residual = np.concatenate([point.residual / scale, roots @ off])
    stacked = np.vstack([columns / scale, np.zeros((len(roots), columns.shape[1]))])
    norms = np.linalg.norm(design, axis=0)
    basis, triangle = np.linalg.qr(design / norms)
    across = stacked - basis @ (basis.T @ stacked)
    remainder = residual - basis @ (basis.T @ residual)
    moved = -np.linalg.solve(triangle, basis.T @ np.column_stack([residual, stacked])) / norms[:, None]
    scores = across[: len(columns)] * remainder[: len(columns), None]
    labels, index = np.unique(point.cluster, return_inverse=True)
    table = np.stack([np.bincount(index, column) for column in scores.T], axis=1)
    table = table - table.mean(axis=0)
    # residuals of a fit are smaller than errors; priors scatter as they say
    fewer = len(labels) / max(len(labels) - count / 2, 1)
    spread = fewer * table.T @ table + across[len(columns) :].T @ across[len(columns) :]
    fisher = across.T @ across
    # residuals that depend on one another are so many times fewer
    colour = max(float(np.trace(spread)) / max(float(np.trace(fisher)), 1e-300), 1.0)
    return Pull(fisher / colour, across.T @ residual / colour, spread / colour**2), moved[:count, 0], moved[:count, 1:]


def _design(names: Sequence[str], readings: Sequence[ConstantReading]) -> np.ndarray:
    return np.array([[float(reading.powers.get(name, 0)) for name in names] for reading in readings])


def adjusted(names: Sequence[str], at: np.ndarray, readings: Sequence[ConstantReading], pulled: Pull) -> Adjustment:
    """Constants (n,) ``at`` their present values adjusted to readings and residuals.

    One of which nobody says how well it is known stays; the others are adjusted as if it could be anything.
    """
    design = _design(names, readings)
    weight = np.array([reading.deviation**-2 for reading in readings])
    off = np.array([np.log(reading.value) for reading in readings]) - design @ np.log(at)
    normal = (design.T * weight) @ design
    inverse = np.linalg.inv(normal + pulled.information)
    unknown = {reading.name for reading in readings if not reading.stated}
    moves = np.array([name not in unknown for name in names], dtype=float)
    step = moves * (inverse @ ((design.T * weight) @ off - pulled.score))
    return Adjustment(step, np.outer(moves, moves) * (inverse @ (normal + pulled.spread) @ inverse))


def contradiction(
    names: Sequence[str], at: np.ndarray, readings: Sequence[ConstantReading], pulled: Pull
) -> Contradiction | None:
    """The readings that contradict the others most; None where none does."""
    design = _design(names, readings)
    variance = np.array([reading.deviation**2 for reading in readings])
    weighted = design.T / variance
    inverse = np.linalg.inv(weighted @ design + pulled.information)
    off = np.array([np.log(reading.value) for reading in readings]) - design @ np.log(at)
    residual = off - design @ (inverse @ (weighted @ off - pulled.score))
    projector = np.eye(len(readings)) - design @ inverse @ weighted
    of_logs = inverse @ pulled.spread @ inverse
    spread = (projector * variance) @ projector.T + design @ of_logs @ design.T
    checked = (np.diag(projector) > CHECKED) & np.array([reading.stated for reading in readings])
    sd = np.sqrt(np.where(checked, np.diag(spread), np.inf))
    ratio = np.abs(residual) / sd
    worst = int(np.argmax(ratio))
    if not ratio[worst] > SUSPECT:
        return None
    together = np.abs(spread[worst]) / (sd * sd[worst]) > TOGETHER
    group = [index for index in range(len(readings)) if index == worst or (together[index] and ratio[index] > SUSPECT)]
    return Contradiction(
        tuple(readings[index].name for index in group),
        float(ratio[worst]),
        tuple(readings[index].value for index in group),
        tuple(float(readings[p].value * np.exp(-residual[p] / projector[p, p])) for p in group),
    )


def widened(readings: Sequence[ConstantReading], clash: Contradiction) -> tuple[ConstantReading, ...]:
    """The readings, of which those that contradict the others are taken as less sure."""
    return tuple(
        replace(reading, deviation=reading.deviation * clash.deviations) if reading.name in clash.names else reading
        for reading in readings
    )
