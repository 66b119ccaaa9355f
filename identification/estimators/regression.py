"""Estimators that regress friction on slip speed.

They reduce their logs to equations of one form,
    sum_j average_j mu(slip_ij; q) d(place_ij; a) = measured_i - tilt_i sum_j average_j s(place_ij; a),     i = 1..n
(d = 1, s = 0 without disturbances), with residuals that depend on one another inside a slip segment (a cluster),
whitened cluster by cluster by the known colour of the sensor noise. The rig's constants and the laser's gain and delay
are taken as given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.base import CONSTANT_STEP, DELAY_STEP, GAIN_STEP, FrictionProblem, FrictionRows, Options
from identification.estimators.disturbances import Place, Term, disturbed, shown
from identification.inference.problem import Evaluation, Prior, Solution, Unknown, solve
from identification.laws.law import FittableLaw, unknowns
from identification.measurement.motion import drive_angle
from identification.measurement.pooling import Pool, RigValues
from identification.measurement.slip_segments import SlipSegment, long_enough


@dataclass(frozen=True, eq=False)
class Regression:
    """The equations.

    slip: (n, w) m/s, >= 0; average: (w,), sums to 1; measured: (n,) friction coefficient; cluster: (n,) labels, equal
    ones adjacent; log: (n,) number of the log; whiten: for each cluster in order a matrix (n_g, n_g) or weights (n_g,);
    where: where (n, w) drive and body stood; tilt: (n,) 1/rad, what the sensor shows too much counts as friction.
    """

    slip: np.ndarray
    average: np.ndarray
    measured: np.ndarray
    cluster: np.ndarray
    log: np.ndarray
    whiten: tuple[np.ndarray, ...]
    where: Place | None = field(default=None, kw_only=True)
    tilt: np.ndarray | None = field(default=None, kw_only=True)

    @property
    def speed(self) -> np.ndarray:
        """Averaged slip speed (n,), m/s."""
        return self.slip @ self.average

    def model(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Averaged law (n,)."""
        return law.value(self.slip, q) @ self.average

    def model_gradient(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Derivatives (n, m) of the averaged law."""
        return (law.gradient(self.slip, q) @ self.average).T

    def disturbed(self, law: FittableLaw, terms: Sequence[Term], x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Averaged law (n,) with disturbances, whose values follow those of the law in x (m,), and derivatives
        (n, m)."""
        assert self.where is not None and self.tilt is not None
        q, a = np.split(x, [len(law.parameters)])
        friction, (factor, by) = law.value(self.slip, q), disturbed(terms, a, self.where)
        more, by_more = shown(terms, a, self.where)
        slopes = [self._averaged(factor * slope) for slope in law.gradient(self.slip, q)]
        slopes += [
            self._averaged(friction * slope) + self.tilt * self._averaged(other)
            for slope, other in zip(by, by_more, strict=True)
        ]
        return self._averaged(friction * factor) + self.tilt * self._averaged(more), np.stack(slopes, axis=1)

    def _averaged(self, values: np.ndarray) -> np.ndarray:
        """Of (n, w), or of what is the same in a row or in all of them."""
        return np.broadcast_to(values, self.slip.shape) @ self.average

    def thinned(self, every: int) -> Regression:
        """The same with averages over every so many samples, for what is searched often."""
        assert self.where is not None
        nodes = np.arange((len(self.average) // 2) % every, len(self.average), every)
        average = self.average[nodes] / self.average[nodes].sum()
        turned, angle = self.where.turned[:, nodes], self.where.angle[:, nodes]
        return replace(
            self, slip=self.slip[:, nodes], average=average, where=replace(self.where, turned=turned, angle=angle)
        )

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, m) cluster by cluster times ``whiten``."""
        parts = np.split(values, np.cumsum([len(w) for w in self.whiten])[:-1])
        return np.concatenate(
            [w @ part if w.ndim == 2 else (w * part.T).T for w, part in zip(self.whiten, parts, strict=True)]
        )

    def of(self, clusters: np.ndarray) -> Regression:
        """The equations of these clusters (k,), labelled anew 0..k-1."""
        labels = self.cluster[np.cumsum([0, *(len(w) for w in self.whiten[:-1])])]
        places = [int(np.flatnonzero(labels == label)[0]) for label in clusters]
        rows = [np.flatnonzero(self.cluster == label) for label in clusters]
        chosen = np.concatenate(rows)
        return Regression(
            self.slip[chosen],
            self.average,
            self.measured[chosen],
            np.repeat(np.arange(len(rows)), [len(part) for part in rows]),
            self.log[chosen],
            tuple(self.whiten[place] for place in places),
            where=None if self.where is None else self.where.of(chosen),
            tilt=None if self.tilt is None else self.tilt[chosen],
        )


@dataclass(frozen=True, eq=False)
class RegressionProblem(FrictionProblem):
    """A regression and a law. ``again`` builds the equations with other constants (relative changes by name, among them
    gain; delay in s); None where nothing is taken as given."""

    law: FittableLaw
    regression: Regression
    held: tuple[Prior, ...] = ()
    again: Callable[[Mapping[str, float]], Regression] | None = None
    terms: tuple[Term, ...] = ()
    noise_known = False
    residual_unit = "1"

    def __getstate__(self) -> dict[str, object]:
        """For another process, which solves these equations and builds no others."""
        return {**self.__dict__, "again": None}

    @property
    def unknowns(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # of the law
        return (*unknowns(self.law), *(term.unknown for term in self.terms))

    def start(self) -> np.ndarray:
        """The law's own guess, without disturbances."""
        guess = self.law.start(self.regression.speed, self.regression.measured)
        return np.concatenate([guess, np.zeros(len(self.terms))])

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Whitened residuals of the averaged law."""
        these = self.regression
        if self.terms:
            model, gradient = these.disturbed(self.law, self.terms, x)
        else:
            model, gradient = these.model(self.law, x), these.model_gradient(self.law, x)
        return Evaluation(
            residual=these.whitened(model - these.measured),
            gradient=these.whitened(gradient),
            cluster=these.cluster,
            log=these.log,
            slip=these.speed,
        )

    def _model(self, equations: Regression, x: np.ndarray) -> np.ndarray:
        return equations.disturbed(self.law, self.terms, x)[0] if self.terms else equations.model(self.law, x)

    def resampled(self, clusters: np.ndarray) -> RegressionProblem:
        """As in `Problem`."""
        again = self.again
        made = None if again is None else lambda moved: again(moved).of(clusters)
        return replace(self, regression=self.regression.of(clusters), again=made)

    def rows(self, x: np.ndarray) -> FrictionRows:
        """The equations, without what disturbances change."""
        these = self.regression
        fitted = these.model(self.law, x[: len(self.law.parameters)])
        off = self._model(these, x) - fitted if self.terms else 0.0
        return FrictionRows(
            speed=these.speed,
            least=these.slip.min(axis=1),
            greatest=these.slip.max(axis=1),
            measured=these.measured - off,
            fitted=fitted,
            cluster=these.cluster,
            log=these.log,
            place=np.zeros(len(these.log), dtype=int),
        )

    def rms(self, x: np.ndarray) -> float:
        """Of the friction coefficient."""
        left = self._model(self.regression, x) - self.regression.measured
        return float(np.sqrt(np.mean(left**2)))

    def by_held(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """By difference of the equations with moved constants, whitened as these."""
        steps = {prior.name: CONSTANT_STEP for prior in self.held} | {"gain": GAIN_STEP, "delay": DELAY_STEP}
        raw = self._model(self.regression, x) - self.regression.measured
        if self.again is None:
            return {}
        slopes = {}
        for name, step in steps.items():
            other = self.again({name: step})
            moved = self._model(other, x) - other.measured - raw
            slopes[name] = self.regression.whitened(moved) / step
        for prior in self.held:
            slopes[prior.name] = slopes[prior.name] / prior.value
        return slopes


def whereabouts(segments: Sequence[SlipSegment], logs: Sequence[int]) -> list[Place]:
    """Where drive and body stood at the samples of each segment, (m,) each."""
    turned = {id(s.motion): drive_angle(s.motion, int(s.motion.log.contacts[0][-1])) for s in segments}
    places = []
    for segment, log in zip(segments, logs, strict=True):
        inside, time = slice(segment.first, segment.last), segment.motion.time
        share = (time[inside] - time[0]) / (time[-1] - time[0]) - 0.5
        places.append(Place(turned[id(segment.motion)][inside], segment.angle, share, np.full(len(share), log)))
    return places


def joined(places: Sequence[Place]) -> Place:
    """One after the other."""
    columns = ("turned", "angle", "share", "log")
    return Place(*(np.concatenate([getattr(one, name) for one in places]) for name in columns))


def tilts(segments: Sequence[SlipSegment], cluster: np.ndarray, rig: RigValues) -> np.ndarray:
    """Friction (n,) for which the spring makes a radian that the sensor shows too much. cluster: (n,) segment."""
    return np.array([segment.sign for segment in segments])[cluster] * rig.k / (rig.R * rig.N)


Equations = Callable[[Sequence[SlipSegment], Sequence[int], RigValues, float], Regression]
"""From segments, the number of the log of each, rig and natural period (s) to equations."""


def regress(
    ready: Pool, law: FittableLaw, equations: Equations, window: float, options: Options
) -> tuple[RegressionProblem, Solution]:
    """Equations of the pooled slip segments that hold ``window`` natural periods, and their solution.

    Raises:
        StickslipError: no segment holds the window, only one does, or friction has the wrong sign.
    """
    period = ready.natural_period

    def again(moved: Mapping[str, float]) -> Regression:
        return equations(*ready.moved(moved, window * period), period)

    if len(long_enough(ready.segments, window * period)) < 2:
        raise StickslipError("One slip segment alone gives no standard deviation. Record for several cycles.")
    problem = RegressionProblem(law, again({}), ready.priors, again, options.disturbances)
    _check_sign(problem.regression)
    given = options.given
    found = solve(problem, given.start(problem), fixed=given.fixed(problem), progress=options.progress)
    return problem, found


def _check_sign(regression: Regression) -> None:
    middle = float(np.median(regression.measured))
    if middle <= 0:
        raise StickslipError(
            f"Friction is found to drive the slip instead of opposing it (median coefficient {middle:.2g}): angle and "
            "drive count in opposite senses. Turn the sign of the laser's gain (and of the encoder), or that of the "
            "drive."
        )
