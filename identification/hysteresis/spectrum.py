"""The sliders that a log asks for: a convex fit, which needs no start values and has one answer.

    F = load sum_j (sum_f a_jf f) z_j(x) + (sum_f b_f f)(...) + k x + c x' + F_0,    a_jf >= 0

z_j elongations of springs behind sliders with bounds spaced evenly by logarithm over the way (sliders.py of the
language), f factors: 1 and conditions such as a current. With time also saturated damping, tanh(x'/v_i), and viscous.
Non-negative least squares over columns that are known beforehand.

Source: Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.hysteresis.loop import LoopLog, saturated, stops

SLIDERS = 30
FINEST = 300  # parts of the range: the least bound
SPEEDS = 12  # widths of saturated damping
SAME = 1e-9  # of a column: what is left of one that others hold
LAGS = 14  # that are tried
LAGGED = 4000  # samples by which a lag is found
RIGID = 1.5  # times the least bound: a slider below it is one without spring, as far as the log tells


@dataclass(frozen=True, eq=False)
class SliderSpectrum:
    """Sliders in parallel.

    Attributes:
        bound: (k,) m, D_j.
        stiffness: (k, factors) N/m a factor, a_jf.
        reach: m, half of the largest range of the way: what does not slide within it is a spring.
        factors: conditions that scale them, after the constant 1.
        widths, damping: (i,) m/s and (i, factors) N, of tanh(x'/v_i); empty without time.
        viscous: (factors,) N s/m.
        spring: N/m; offset: N.
        rate: whether speeds were asked.
        loaded: whether the force is proportional to the load.
    """

    bound: np.ndarray
    stiffness: np.ndarray
    reach: float
    factors: tuple[str, ...]
    widths: np.ndarray
    damping: np.ndarray
    viscous: np.ndarray
    spring: float
    offset: float
    rate: bool
    loaded: bool

    def force(self, log: LoopLog) -> np.ndarray:
        """(n,) N, along a log."""
        return self.acting(log)[0] + self.spring * log.way + self.offset

    def acting(self, log: LoopLog) -> tuple[np.ndarray, np.ndarray]:
        """Force (n,) N of sliders and damping along a log, and columns (n, m) of those of them that have a weight."""
        weights = np.concatenate([self.stiffness.ravel(), self.damping.ravel(), self.viscous])
        columns = _columns(log, self.bound, self.widths, self.factors, self.rate, self.loaded)
        return columns @ weights, columns[:, weights > 0]

    def left(self, log: LoopLog) -> float:
        """Root mean square of what is left of the force of a log, over its standard deviation."""
        return float(np.sqrt(np.mean((log.force - self.force(log)) ** 2)) / np.std(log.force))

    @property
    def slides(self) -> np.ndarray:
        """(k,) whether a slider gives way within the way."""
        return self.bound < self.reach * (1 - 1e-9)

    def at(self, conditions: Sequence[float] = ()) -> np.ndarray:
        """(k,) N/m, stiffness of the sliders under conditions in the order of ``factors`` (default: 0)."""
        return self.stiffness @ np.array([1.0, *(conditions or [0.0] * len(self.factors))])

    def backbone(self) -> tuple[np.ndarray, np.ndarray]:
        """Way (m,) m and force (m,) N from rest, without memory."""
        way = np.linspace(0.0, self.reach, 101)
        springs = np.minimum(way[:, None], self.bound) @ self.at()
        return way, springs + self.spring * way

    def stiffness_at_rest(self, conditions: Sequence[float] = ()) -> float:
        """Of the sliders that give way, N/m; that of springs beside is ``spring_beside``."""
        return float(self.at(conditions)[self.slides].sum())

    def sliding_force(self, conditions: Sequence[float] = ()) -> float:
        """Once all that gives way does, N."""
        return float((self.at(conditions) * self.bound)[self.slides].sum())

    def spring_beside(self, conditions: Sequence[float] = ()) -> float:
        """Of what never gives way, N/m."""
        return float(self.at(conditions)[~self.slides].sum()) + self.spring

    def is_rigid(self, conditions: Sequence[float] = ()) -> bool:
        """Whether most of the sliding force stands in the least bound: stiffness is larger than what the log tells."""
        force = (self.at(conditions) * self.bound)[self.slides]
        return bool(len(force) and force[self.at_once].sum() > 0.5 * force.sum())

    @property
    def at_once(self) -> np.ndarray:
        """Which of the sliders that give way (m,) do so at the least bound."""
        return self.bound[self.slides] < RIGID * self.bound.min()


def fit_sliders(logs: Sequence[LoopLog], *, factors: Sequence[str] = (), rate: bool | None = None) -> SliderSpectrum:
    """The sliders of logs together. logs: all with a load or none, all with the conditions ``factors``; factors:
    conditions by which stiffnesses and damping grow; rate: whether speeds are asked too; as all logs have times where
    None. StickslipError: no log, a condition that a log lacks, or loads of some of them alone."""
    if not logs:
        raise StickslipError("There is no log. Give one, better several of different amplitudes.")
    loaded = logs[0].load is not None
    if any((log.load is not None) != loaded for log in logs):
        raise StickslipError(
            "Some logs have a column of the load and others none. Give logs that have it, or say none."
        )
    for log in logs:
        for name in factors:
            if name not in log.conditions and name not in log.signals:
                raise StickslipError(
                    f"{log.name} has no column '{name}' and does not say it in its name, which says "
                    f"{', '.join(log.conditions) or 'nothing'}."
                )
    rate = all(log.time is not None for log in logs) if rate is None else rate
    span = max(log.range for log in logs)
    bound = np.geomspace(span / FINEST, span / 2, SLIDERS)
    fastest = max(float(np.abs(log.speed()).max()) for log in logs) if rate else 0.0
    widths = np.geomspace(fastest / FINEST, fastest, SPEEDS) if rate else np.zeros(0)
    rows = [_columns(log, bound, widths, tuple(factors), rate, loaded) for log in logs]
    way, force = (np.concatenate([getattr(log, name) for log in logs]) for name in ("way", "force"))
    weights = non_negative(np.vstack(rows), np.column_stack([way - way.mean(), np.ones(len(way))]), force)
    n, count = 1 + len(factors), SLIDERS
    parts = np.split(weights, [count * n, (count + len(widths)) * n, (count + len(widths) + rate) * n])
    spring, offset = parts[3]
    return SliderSpectrum(
        bound=bound,
        stiffness=parts[0].reshape(count, n),
        reach=span / 2,
        factors=tuple(factors),
        widths=widths,
        damping=parts[1].reshape(len(widths), n),
        viscous=parts[2],
        spring=float(spring),
        offset=float(offset - spring * way.mean()),
        rate=rate,
        loaded=loaded,
    )


def fit_lag(logs: Sequence[LoopLog], *, factors: Sequence[str], rate: bool | None = None) -> tuple[float, float, float]:
    """The lag, s, with which sliders follow signals, and the root mean square, N, of what they leave with it and
    without; errors as in `fit_sliders`, and of a log without times."""
    from scipy.optimize import minimize_scalar

    if any(log.time is None for log in logs):
        raise StickslipError("A lag needs times. Name the column: --column time=NAME; or say that none is: --lag 0.")
    stride = max(sum(len(log.way) for log in logs) // LAGGED, 1)

    def left(lag: float) -> float:
        rough = [log.lagged(lag).part(0, None, stride) for log in logs]
        spectrum = fit_sliders(rough, factors=factors, rate=rate)
        return float(np.sqrt(np.mean(np.concatenate([log.force - spectrum.force(log) for log in rough]) ** 2)))

    times = [log.time for log in logs if log.time is not None]
    lags = np.geomspace(min(float(np.median(np.diff(t))) for t in times) / 2, min(np.ptp(t) for t in times) / 20, LAGS)
    without = left(0.0)
    best = min(range(1, LAGS - 1), key=lambda i: left(float(lags[i])))
    ends = np.log(lags[[best - 1, best + 1]])
    minimum: Any = minimize_scalar(lambda log: left(float(np.exp(log))), bounds=tuple(ends), method="bounded")
    return (float(np.exp(minimum.x)), float(minimum.fun), without) if minimum.fun < without else (0.0, without, without)


def _columns(
    log: LoopLog, bound: np.ndarray, widths: np.ndarray, factors: Sequence[str], rate: bool, loaded: bool
) -> np.ndarray:
    """(n, m) of what has a weight that is not negative; each part for each factor."""
    blocks = [stops(log, bound, saturated(log, bound))]
    if rate:
        speed = log.speed()[:, None]
        blocks += [np.tanh(speed / widths), speed]
    conditions = {**log.conditions, **log.signals}
    scale = np.column_stack(np.broadcast_arrays(np.ones(len(log.way)), *(conditions[name] for name in factors)))
    columns = np.hstack([(block[:, :, None] * scale[:, None]).reshape(len(log.way), -1) for block in blocks])
    return columns * log.load[:, None] if loaded and log.load is not None else columns


def non_negative(columns: np.ndarray, free: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Weights that are not negative of ``columns``, then those of ``free`` of any sign."""
    from scipy.optimize import nnls

    lengths = np.linalg.norm(columns, axis=0)
    lengths[lengths == 0] = 1.0
    basis, _ = np.linalg.qr(free)
    along = np.column_stack([columns / lengths, force])
    across = along - basis @ (basis.T @ along)
    # a slider that never gives way is the spring beside, which has its column already
    across[:, np.linalg.norm(across, axis=0) < SAME * np.linalg.norm(along, axis=0)] = 0.0
    triangle: np.ndarray = np.asarray(np.linalg.qr(across, mode="r"))
    weights, _ = nnls(triangle[:, :-1], triangle[:, -1], maxiter=100 * columns.shape[1])
    weights = weights / lengths
    return np.concatenate([weights, np.linalg.lstsq(free, force - columns @ weights, rcond=None)[0]])
