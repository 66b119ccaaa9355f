"""Estimators that regress friction on slip speed.

They reduce their logs to equations of one form,
    sum_j average_j mu(slip_ij; q) d(place_ij; a) = measured_i -+ k/(R N) sum_j average_j s(place_ij; a),     i = 1..n
(d = 1, s = 0 without disturbances), with residuals that depend on one another inside a slip segment (a cluster),
whitened cluster by cluster by the known colour of the sensor noise. The rig's constants and the laser's gain and delay
are taken as given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self, TypeVar

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import in_threads
from identification.disturbances.term import DisturbanceTerm, Whereabouts, disturbed, misread
from identification.estimators.base import CONSTANT_STEP, DELAY_STEP, GAIN_STEP, FrictionProblem, FrictionRows, Options
from identification.inference.problem import Evaluation, Prior, Solution, Unknown, solve
from identification.laws.law import FittableLaw, unknowns
from identification.measurement.motion import DiscMotion, drive_angle
from identification.measurement.pooled import Pool, RigValues
from identification.measurement.slip_segments import SlipSegment, long_enough

Made = TypeVar("Made")
CHUNK = 2**15  # values of a law that are computed at once: they stay in a core's cache


@dataclass(frozen=True, eq=False)
class Regression:
    """The equations.

    slip: (n, w) m/s, >= 0; average: (w,), sums to 1; measured: (n,) friction coefficient; cluster: (n,) labels, equal
    ones adjacent; log: (n,) number of the log; whiten: for each cluster in order a matrix (n_g, n_g) or weights (n_g,);
    where: where (n, w) drive and body stood; noise: deviation of a row for unit noise of the angle; sign: (n,) of the
    slip, where known; spring: friction coefficient for which it makes a radian, k/(R N); workers: threads.
    """

    slip: np.ndarray
    average: np.ndarray
    measured: np.ndarray
    cluster: np.ndarray
    log: np.ndarray
    whiten: tuple[np.ndarray, ...]
    by_row: ClassVar[tuple[str, ...]] = ("slip", "measured", "log", "sign")  # fields with a row for each equation
    where: Whereabouts | None = field(default=None, kw_only=True)
    noise: float = field(default=1.0, kw_only=True)
    sign: np.ndarray | None = field(default=None, kw_only=True)
    spring: float = field(default=0.0, kw_only=True)
    workers: int | None = field(default=1, kw_only=True)

    @property
    def speed(self) -> np.ndarray:
        """Averaged slip speed (n,), m/s."""
        return self.slip @ self.average

    def along(self, law: FittableLaw, speed: np.ndarray, rows: slice = slice(None)) -> np.ndarray:
        """Slip speeds of rows, (k,) or (k, w), without sign as a law takes them."""
        return speed if self.sign is None else law.along(speed.T, self.sign[rows]).T

    def model(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Averaged law (n,)."""

        def part(rows: slice) -> np.ndarray:
            return law.value(self.along(law, self.slip[rows], rows), q) @ self.average

        return np.concatenate(self._by_chunks(part))

    def model_gradient(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Derivatives (n, m) of the averaged law."""

        def part(rows: slice) -> np.ndarray:
            return (law.gradient(self.along(law, self.slip[rows], rows), q) @ self.average).T

        return np.concatenate(self._by_chunks(part))

    def disturbed(
        self, law: FittableLaw, terms: Sequence[DisturbanceTerm], x: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Averaged law (n,) with disturbances, whose values follow those of the law in x (m,), and derivatives
        (n, m)."""
        where, sign, (q, a) = self.where, self.sign, np.split(x, [len(law.parameters)])
        assert where is not None and sign is not None

        def averaged(values: np.ndarray, like: np.ndarray) -> np.ndarray:
            return np.broadcast_to(values, like.shape) @ self.average

        def part(rows: slice) -> tuple[np.ndarray, np.ndarray]:
            slip, tilt = self.along(law, self.slip[rows], rows), self.spring * sign[rows]
            friction, (factor, by) = (
                law.value(slip, q),
                disturbed(terms, a, chunk := where.map(lambda values: values[rows])),
            )
            added, by_more = misread(terms, a, chunk)
            slopes = [averaged(factor * slope, slip) for slope in law.gradient(slip, q)]
            slopes += [
                averaged(friction * slope, slip) + tilt * averaged(extra, slip)
                for slope, extra in zip(by, by_more, strict=True)
            ]
            return averaged(friction * factor, slip) + tilt * averaged(added, slip), np.stack(slopes, axis=1)

        values, slopes = zip(*self._by_chunks(part), strict=True)
        return np.concatenate(values), np.concatenate(slopes)

    def _by_chunks(self, compute: Callable[[slice], Made]) -> list[Made]:
        """Results of ``compute`` for all rows, a chunk at a time."""
        rows = max(CHUNK // self.slip.shape[1], 1)
        return in_threads(compute, [slice(i, i + rows) for i in range(0, len(self.slip), rows)], self.workers)

    def thinned(self, every: int) -> Regression:
        """The same equations with averages over fewer nodes, for searches that ask them often."""
        assert self.where is not None
        nodes = np.arange((len(self.average) // 2) % every, len(self.average), every)
        average = self.average[nodes] / self.average[nodes].sum()
        thin = {name: getattr(self.where, name)[:, nodes] for name in ("turned", "angle", "load", "speed")}
        return replace(self, slip=self.slip[:, nodes], average=average, where=replace(self.where, **thin))

    def whitened(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, m) cluster by cluster times ``whiten``."""
        blocks = np.split(values, np.cumsum([len(w) for w in self.whiten])[:-1])
        return np.concatenate(
            [w @ block if w.ndim == 2 else (w * block.T).T for w, block in zip(self.whiten, blocks, strict=True)]
        )

    def of(self, clusters: np.ndarray) -> Self:
        """The equations of these clusters (k,), labelled anew 0..k-1."""
        labels = self.cluster[np.cumsum([0, *(len(w) for w in self.whiten[:-1])])]
        places = [int(np.flatnonzero(labels == label)[0]) for label in clusters]
        rows = [np.flatnonzero(self.cluster == label) for label in clusters]
        chosen = np.concatenate(rows)
        columns = {name: getattr(self, name) for name in self.by_row}
        return replace(
            self,
            **{name: values[chosen] for name, values in columns.items() if values is not None},
            cluster=np.repeat(np.arange(len(rows)), [len(row) for row in rows]),
            whiten=tuple(self.whiten[index] for index in places),
            where=None if self.where is None else self.where.map(lambda values: values[chosen]),
        )


@dataclass(frozen=True, eq=False)
class RegressionProblem(FrictionProblem):
    """A regression and a law. ``rebuild`` makes the equations with other constants (relative changes by name, gain
    among them; delay in s; see `Pool.moved`); None where nothing is taken as given. drawn: as in `Pool`; zero: rad,
    deviation of the zero of an encoder."""

    law: FittableLaw
    regression: Regression
    held: tuple[Prior, ...] = ()
    rebuild: Callable[[Mapping[str, float]], Regression] | None = None
    terms: tuple[DisturbanceTerm, ...] = ()
    drawn: int = 0
    zero: float = 0.0
    noise_known = False
    residual_unit = "1"

    def __getstate__(self) -> dict[str, object]:
        """State for another process, which solves these equations and builds no others."""
        return {**self.__dict__, "rebuild": None}

    @property
    def unknowns(self) -> tuple[Unknown, ...]:  # type: ignore[override]  # of the law
        return (*unknowns(self.law), *(term.unknown for term in self.terms))

    def start(self) -> np.ndarray:
        """The law's own guess, without disturbances."""
        these = self.regression
        guess = self.law.start(these.along(self.law, these.speed), these.measured)
        return np.concatenate([guess, [term.first for term in self.terms]])

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

    def tested(self, solution: Solution) -> bool:
        """Whether residuals tell of the model: not where the angle is interpolated between edges."""
        return not self.drawn

    def _model(self, equations: Regression, x: np.ndarray) -> np.ndarray:
        return equations.disturbed(self.law, self.terms, x)[0] if self.terms else equations.model(self.law, x)

    def resampled(self, clusters: np.ndarray) -> RegressionProblem:
        rebuild = self.rebuild
        rebuilt = None if rebuild is None else lambda moved: rebuild(moved).of(clusters)
        return replace(self, regression=self.regression.of(clusters), rebuild=rebuilt)

    def rows(self, x: np.ndarray) -> FrictionRows:
        """Friction of the equations, without what disturbances change."""
        these = self.regression
        fitted = these.model(self.law, x[: len(self.law.parameters)])
        off = self._model(these, x) - fitted if self.terms else 0.0
        return FrictionRows(
            speed=these.along(self.law, these.speed),
            least=these.slip.min(axis=1),
            greatest=these.slip.max(axis=1),
            measured=these.measured - off,
            fitted=fitted,
            cluster=these.cluster,
            log=these.log,
            disc=np.zeros(len(these.log), dtype=int),
        )

    def rms(self, x: np.ndarray) -> float:
        """Root mean square of the residual of the friction coefficient."""
        residual = self._model(self.regression, x) - self.regression.measured
        return float(np.sqrt(np.mean(residual**2)))

    def with_held(self, priors: tuple[Prior, ...]) -> RegressionProblem:
        """The same problem with equations that are built anew."""
        rebuild = self.rebuild
        if rebuild is None:
            return replace(self, held=priors)
        base = {new.name: new.value / old.value - 1 for new, old in zip(priors, self.held, strict=True)}

        def moved(by: Mapping[str, float]) -> Regression:
            return rebuild({**by, **{name: (1 + share) * (1 + by.get(name, 0.0)) - 1 for name, share in base.items()}})

        return replace(self, held=priors, regression=moved({}), rebuild=moved)

    def by_held(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Slopes from the difference of the equations with moved constants, whitened as these. Constants that scale the
        rows scale their noise: of a smaller J smaller residuals say nothing."""
        constants = {prior.name for prior in self.held}
        steps = {prior.name: CONSTANT_STEP for prior in self.held} | {"gain": GAIN_STEP, "delay": DELAY_STEP}
        raw = self._model(self.regression, x) - self.regression.measured
        if self.rebuild is None:
            return {}
        slopes = {}
        for name, step in steps.items():
            variant = self.rebuild({name: step})
            moved = self._model(variant, x) - variant.measured
            louder = variant.noise / self.regression.noise if name in constants else 1.0
            slopes[name] = self.regression.whitened(moved / louder - raw) / step
        for prior in self.held:
            slopes[prior.name] = slopes[prior.name] / prior.value
        if self.drawn:
            others = [self.rebuild({"lines": draw}) for draw in range(self.drawn)] + [self.rebuild({"zero": self.zero})]
            moved = np.stack([self._model(variant, x) - variant.measured - raw for variant in others], axis=1)
            moved[:, : self.drawn] /= np.sqrt(self.drawn)
            slopes["lines"] = self.regression.whitened(moved)
        return slopes


def load_factor(motion: DiscMotion, force: float) -> np.ndarray:
    """Normal force (n,) of the one disc by its load cell over a mean ``force`` N; ones without a cell."""
    return np.ones(len(motion.time)) if motion.loads is None else motion.loads[0] / force


def warmth(motion: DiscMotion) -> np.ndarray:
    """Temperature (n,) over its mean in all logs, K; zeros where it is not recorded."""
    return np.zeros(len(motion.time)) if motion.warmer is None else motion.warmer


def whereabouts(segments: Sequence[SlipSegment], logs: Sequence[int], force: float) -> list[Whereabouts]:
    """Where drive and body stood at the samples of each segment, (m,) each. force: N, mean of a load cell."""
    motions = {id(segment.motion): segment.motion for segment in segments}
    turned = {key: drive_angle(motion, int(motion.log.contacts[0][-1])) for key, motion in motions.items()}
    places = []
    for segment, log in zip(segments, logs, strict=True):
        inside, time = slice(segment.first, segment.last), segment.motion.time
        speed = np.gradient(segment.angle, segment.motion.step)
        seen = Whereabouts.seen(time, log, time[inside], segment.angle, speed)
        drive, load = turned[id(segment.motion)][inside], load_factor(segment.motion, force)[inside]
        warmer = warmth(segment.motion)[inside]
        places.append(replace(seen, turned=drive, load=load, side=segment.sign * seen.side, warmer=warmer))
    return places


Equations = Callable[[Sequence[SlipSegment], Sequence[int], RigValues, float], Regression]
"""From segments, the number of the log of each, rig and natural period (s) to equations."""


def regress(
    ready: Pool, law: FittableLaw, equations: Equations, window: float, options: Options
) -> tuple[RegressionProblem, Solution]:
    """`reduced`, and its solution."""
    problem, limits = reduced(ready, law, equations, window, options), options.given
    solution = solve(problem, limits.start(problem), fixed=limits.fixed(problem), progress=options.progress)
    build = problem.rebuild
    if build is None or not any(term.prior for term in problem.terms):
        return problem, solution
    # what is known beforehand weighs against residuals of unit variance
    residual = solution.evaluation.residual
    deviation = float(np.sqrt(residual @ residual / (len(residual) - len(solution.values))))

    def scaled(moved: Mapping[str, float]) -> Regression:
        these = build(moved)
        return replace(these, whiten=tuple(rows / deviation for rows in these.whiten))

    problem = replace(problem, regression=scaled({}), rebuild=scaled)
    return problem, solve(problem, solution.values, fixed=limits.fixed(problem), progress=options.progress)


def reduced(ready: Pool, law: FittableLaw, equations: Equations, window: float, options: Options) -> RegressionProblem:
    """Equations of the pooled slip segments that hold ``window`` natural periods. StickslipError: no segment holds the
    window, only one does, or friction has the wrong sign."""
    period = ready.natural_period

    def build(moved: Mapping[str, float]) -> Regression:
        return replace(equations(*ready.moved(moved, window * period), period), workers=options.workers)

    if len(long_enough(ready.segments, window * period)) < 2:
        raise StickslipError("One slip segment alone gives no standard deviation. Record for several cycles.")
    problem = RegressionProblem(law, build({}), ready.priors, build, options.disturbances, ready.drawn, loose(ready))
    _check_sign(problem.regression)
    check_directions(law, problem.regression.sign)
    return problem


def loose(ready: Pool) -> float:
    """How far the zero of an encoder that alone shows the angle may be off, rad: its deviation."""
    return 0.0 if ready.zero is None else ready.zero.standard_uncertainty


def check_directions(law: FittableLaw, sign: np.ndarray | None) -> None:
    """Refuse friction by direction where slips of one direction are missing. sign: (n,)."""
    if law.directed and (sign is None or len(np.unique(sign)) < 2):
        raise StickslipError(
            f"All slips go one way, so that the logs say nothing of the other half of '{law.name}'. Record a log with "
            "the drive reversed, or fit Conti's law."
        )


def _check_sign(regression: Regression) -> None:
    middle = float(np.median(regression.measured))
    if middle <= 0:
        raise StickslipError(
            f"Friction is found to drive the slip instead of opposing it (median coefficient {middle:.2g}): angle and "
            "drive count in opposite senses. Turn the sign of the laser's gain (and of the encoder), or that of the "
            "drive."
        )
