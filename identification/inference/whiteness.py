"""What the residuals say of the model: white or coloured, and whether they repeat themselves.

Colour alone (Ljung-Box over the lags of a log, within its clusters) makes standard deviations wrong, and those of the
fit allow for it. A model that is wrong shows otherwise: its residuals repeat. Two tests, each by the spread of whole
clusters, so that colour cannot raise them:
    slip speed    the mean residual in a range of slip speeds against its standard error over clusters
    course        the residuals of a cluster projected on Legendre polynomials of the time within it; their means over
                  the clusters of a log against the covariance over these clusters (Hotelling's T^2)

Sources: Ljung & Box (1978), Biometrika 65, 297; Hotelling (1931), Ann. Math. Statist. 2, 360.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.inference.problem import Evaluation

LAGS = 20  # of the test for colour, or a quarter of the longest cluster
BINS = 12  # ranges of slip speed, of equal numbers of rows
COURSE = 4  # Legendre polynomials
FEWEST = 5  # clusters in a range of slip speeds, or above COURSE in a log, for a test
BEYOND = 3.5  # standard errors: a mean residual that is no chance, of all ranges one in 180
COLOURED = 0.01  # probability by chance below which residuals count as coloured
LEAST_CHANCE = 1e-300  # of which the deviations of a normal variable can be told
REPEATED = 1e-3  # probability by chance, over all logs, below which a course counts as repeated


@dataclass(frozen=True)
class LogResiduals:
    """Residuals of one log. autocorrelation: of neighbours; colour: probability of so much of it by chance
    (Ljung-Box); course: probability by chance of so much that repeats in every cluster, None with too few of them."""

    log: str
    values: int
    autocorrelation: float
    colour: float
    course: float | None


@dataclass(frozen=True)
class SpeedResidual:
    """Mean residual (in units of its root mean square) in a range of slip speeds, m/s, and how many standard errors
    over clusters it is from zero, as a normal variable would be."""

    slip: float
    mean: float
    deviations: float


@dataclass(frozen=True)
class Whiteness:
    """The residuals of a fit, by log and by slip speed."""

    logs: tuple[LogResiduals, ...]
    speeds: tuple[SpeedResidual, ...]

    @property
    def beyond(self) -> tuple[SpeedResidual, ...]:
        """Ranges of slip speed whose residual is no chance."""
        return tuple(speed for speed in self.speeds if abs(speed.deviations) > BEYOND)

    @property
    def coloured(self) -> tuple[str, ...]:
        """Names of the logs whose residuals are coloured."""
        return tuple(log.log for log in self.logs if log.colour < COLOURED)

    @property
    def repeated(self) -> tuple[str, ...]:
        """Names of the logs whose residuals take the same course in every cluster."""
        tested = sum(log.course is not None for log in self.logs)
        return tuple(log.log for log in self.logs if log.course is not None and log.course * tested < REPEATED)

    @property
    def missed(self) -> float:
        """How surely the model misses something: standard errors of the most telling of all tests."""
        from scipy.special import ndtri

        course = [-float(ndtri(max(log.course, LEAST_CHANCE) / 2)) for log in self.logs if log.course is not None]
        return max([abs(speed.deviations) for speed in self.speeds] + course, default=0.0)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences where the residuals show that the model is wrong."""
        warnings = []
        if self.beyond:
            worst = max(self.beyond, key=lambda speed: abs(speed.deviations))
            where = ", ".join(f"{speed.slip:.3g}" for speed in self.beyond)
            warnings.append(
                f"The law misses the data at slip speeds of {where} m/s (by up to {abs(worst.deviations):.1f} standard "
                "errors): its form is wrong there, and the stated deviations leave that out. Compare laws with "
                "`stickslip laws`."
            )
        if self.repeated and self.beyond:
            warnings.append(
                f"The residuals of {' and '.join(self.repeated)} take the same course in every slip, as they do under "
                "a law of the wrong form. Only what the right law leaves of it has another cause (micro-slip, a wrong "
                "constant of the rig)."
            )
        elif self.repeated:
            warnings.append(
                f"The residuals of {' and '.join(self.repeated)} take the same course in every slip: something is "
                "missing from the model (the law's form, micro-slip, a wrong constant of the rig). Compare laws with "
                "`stickslip laws`."
            )
        return tuple(warnings)


def whiteness(evaluation: Evaluation, logs: Sequence[str]) -> Whiteness:
    """Tests of the residuals at a solution. logs: names by the numbers in ``evaluation.log``."""
    by_log = []
    for number in np.unique(evaluation.log):
        rows = evaluation.log == number
        residual, cluster = evaluation.residual[rows], evaluation.cluster[rows]
        first, chance = colour(residual, cluster)
        by_log.append(LogResiduals(logs[int(number)], int(rows.sum()), first, chance, _course(residual, cluster)))
    return Whiteness(tuple(by_log), _by_speed(evaluation))


def colour(residual: np.ndarray, cluster: np.ndarray) -> tuple[float, float]:
    """Autocorrelation of neighbours, and the probability of Ljung and Box's statistic by chance; lags that reach from
    one cluster to the next are left out."""
    from scipy.special import chdtrc

    power = float(residual @ residual)
    longest = int(np.max(np.unique(cluster, return_counts=True)[1]))
    statistic, freedom, first = 0.0, 0, 0.0
    for lag in range(1, max(min(LAGS, longest // 4), 1) + 1):
        same = cluster[lag:] == cluster[:-lag]
        pairs = int(same.sum())
        if pairs == 0 or power == 0:
            break
        value = float((residual[lag:] * residual[:-lag])[same].sum()) / power
        first = value if lag == 1 else first
        # the variance of an autocorrelation of white values over so many pairs is pairs/n^2
        statistic += value**2 * len(residual) ** 2 / pairs
        freedom += 1
    return first, float(chdtrc(freedom, statistic)) if freedom else 1.0


def _course(residual: np.ndarray, cluster: np.ndarray) -> float | None:
    """Probability by chance of the mean course of the residuals over clusters; None with too few clusters."""
    from numpy.polynomial.legendre import legvander
    from scipy.special import fdtrc

    means = []
    for label in np.unique(cluster):
        rows = residual[cluster == label]
        if len(rows) > COURSE:
            means.append(legvander(np.linspace(-1, 1, len(rows)), COURSE - 1).T @ rows / np.sqrt(len(rows)))
    table = np.array(means)
    if len(table) < COURSE + FEWEST:
        return None
    covariance = np.cov(table, rowvar=False)
    if np.linalg.matrix_rank(covariance) < COURSE:
        return None
    mean = table.mean(axis=0)
    count = len(table)
    squared = count * float(mean @ np.linalg.solve(covariance, mean))
    return float(fdtrc(COURSE, count - COURSE, squared * (count - COURSE) / (COURSE * (count - 1))))


def _by_speed(evaluation: Evaluation) -> tuple[SpeedResidual, ...]:
    from scipy.special import ndtri, stdtr

    slipping = np.isfinite(evaluation.slip)
    slip, residual, cluster = evaluation.slip[slipping], evaluation.residual[slipping], evaluation.cluster[slipping]
    if not len(slip):
        return ()
    scale = float(np.sqrt(np.mean(residual**2))) or 1.0
    edges = np.quantile(slip, np.linspace(0, 1, BINS + 1))
    bins = np.clip(np.searchsorted(edges, slip, side="right") - 1, 0, BINS - 1)
    residuals = []
    for number in np.unique(bins):
        inside = bins == number
        labels, where = np.unique(cluster[inside], return_inverse=True)
        sums = np.bincount(where, residual[inside])
        spread = float(np.std(sums, ddof=1)) if len(labels) >= FEWEST else 0.0
        if spread == 0:
            continue
        student = float(np.mean(sums)) / (spread / np.sqrt(len(labels)))
        # as many deviations of a normal variable as are equally rare; of the tail, which keeps its digits
        deviations = -float(ndtri(max(float(stdtr(len(labels) - 1, -abs(student))), LEAST_CHANCE)))
        mean = float(np.mean(residual[inside])) / scale
        residuals.append(SpeedResidual(float(np.mean(slip[inside])), mean, float(np.copysign(deviations, student))))
    return tuple(residuals)
