"""From an estimator's equations to a result: solution, standard deviations, sensitivities, warnings.

To first order a change dx of something taken as given moves the estimate by  dq = -(A'A)^-1 A' (dr/dx) dx,  with r(x)
the whitened residual. The same formula serves the laser's gain and delay (their covariance joins the noise) and the
constants of the rig (their uncertainty is reported apart).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.errors import StickslipError
from identification.laws import FittableLaw
from identification.laws_fit import Regression, Solution, solve
from identification.pooling import Pool, RigValues, rig_values
from identification.result import Constant, FittedParameter, FrictionFit, LogSummary, SpeedBin
from identification.slip_segments import SlipSegment, long_enough
from identification.uncertainty import (
    autocorrelation,
    block_bootstrap,
    clustered_covariance,
    correlation,
    plain_covariance,
)

FEW_SEGMENTS = 10  # fewer independent slips leave the standard deviations themselves uncertain by a quarter
BINS = 12
SINGULAR = 1e9  # condition of the scaled gradient from which on the parameters cannot be told apart
GAIN_STEP, DELAY_STEP, CONSTANT_STEP = 1e-4, 1e-5, 1e-4  # relative, s, relative: for differences of smooth functions


@dataclass(frozen=True)
class Estimator:
    """An estimator by name: what it assumes, the window (natural periods) that a segment must hold, and its equations
    from segments, rig and natural period (s)."""

    name: str
    structure: tuple[str, ...]
    window: float
    regression: Callable[[Sequence[SlipSegment], RigValues, float], Regression]


def conclude(ready: Pool, estimator: Estimator, law: FittableLaw, *, bootstrap: int = 0, seed: int = 0) -> FrictionFit:
    """Solve the pooled equations and say how well the result is known.

    Raises:
        StickslipError: no segment holds the window, or too few equations or segments.
    """
    period = ready.natural_period
    segments = long_enough(ready.segments, estimator.window * period)
    if len(segments) < 2:
        raise StickslipError("One slip segment alone gives no standard deviation. Record for several cycles.")
    regression = estimator.regression(segments, ready.values, period)
    _check_sign(regression)
    found = solve(regression, law)
    _check_determined(found, law)
    shifts = _Shifts(ready, estimator, law, regression, found, segments, period)
    by_sensor = np.stack([shifts.by_gain(), shifts.by_delay()], axis=1)
    covariance = _noise(regression, law, found, bootstrap, seed) + by_sensor @ ready.sensors.covariance @ by_sensor.T
    constants, scale = _constants(ready, shifts, law, found.values)
    parameters = _parameters(law, found, covariance, scale)
    return FrictionFit(
        estimator=estimator.name,
        law=law.name,
        structure=estimator.structure,
        contacts=ready.contacts,
        materials=tuple(ready.materials),
        parameters=parameters,
        correlation=tuple(tuple(float(x) for x in row) for row in correlation(covariance)),
        constants=constants,
        logs=_summaries(ready, segments, regression),
        bins=_bins(regression, law, found),
        sensors=_sensors(ready),
        segments=len(segments),
        values=len(regression.measured),
        rms_residual=float(np.sqrt(np.mean(found.raw_residual**2))),
        autocorrelation=autocorrelation(found.residual, regression.cluster),
        converged=found.converged,
        message=found.message,
        warnings=(*ready.warnings, *_doubts(law, found, parameters, len(segments))),
    )


def _check_sign(regression: Regression) -> None:
    middle = float(np.median(regression.measured))
    if middle <= 0:
        raise StickslipError(
            f"Friction is found to drive the slip instead of opposing it (median coefficient {middle:.2g}): angle and "
            "drive count in opposite senses. Turn the sign of the laser's gain (and of the encoder), or that of the "
            "drive."
        )


def _check_determined(found: Solution, law: FittableLaw) -> None:
    norms = np.linalg.norm(found.gradient, axis=0)
    if np.linalg.cond(found.gradient / np.where(norms > 0, norms, 1.0)) > SINGULAR:
        names = [parameter.name for parameter in law.parameters]
        values = ", ".join(f"{name} = {value:.4g}" for name, value in zip(names, found.values, strict=True))
        raise StickslipError(
            f"The logs do not determine {', '.join(names)} of '{law.name}' one by one (found {values}): friction "
            "hardly changes over the slip speeds in them. Pool logs at more drive speeds, or take a simpler law."
        )


def _parameters(
    law: FittableLaw, found: Solution, covariance: np.ndarray, scale: np.ndarray
) -> tuple[FittedParameter, ...]:
    deviation, plain = np.sqrt(np.diag(covariance)), np.sqrt(np.diag(plain_covariance(found.gradient, found.residual)))
    return tuple(
        FittedParameter(
            name=spec.name,
            value=float(found.values[i]),
            unit=spec.unit,
            standard_deviation=float(deviation[i]),
            plain_deviation=float(plain[i]),
            scale_deviation=float(scale[i]),
            minimum=spec.minimum,
            maximum=spec.maximum,
            at_bound=found.at_bound[i],
            description=spec.description,
        )
        for i, spec in enumerate(law.parameters)
    )


@dataclass(frozen=True, eq=False)
class _Shifts:
    """First-order shifts of the estimate (m,) by things taken as given."""

    ready: Pool
    estimator: Estimator
    law: FittableLaw
    regression: Regression
    found: Solution
    segments: Sequence[SlipSegment]
    period: float

    def by_constant(self, name: str) -> np.ndarray:
        """d q / d ln(constant)."""
        known = {prior.name: prior.value for prior in self.ready.priors}
        known[name] *= 1 + CONSTANT_STEP
        return self._shift(self.segments, rig_values(known)) / CONSTANT_STEP

    def by_gain(self) -> np.ndarray:
        """d q / d gain of the laser."""
        return self._shift(self._moved(GAIN_STEP, 0.0), self.ready.values) / GAIN_STEP

    def by_delay(self) -> np.ndarray:
        """d q / d delay of the laser, per second."""
        return self._shift(self._moved(0.0, DELAY_STEP), self.ready.values) / DELAY_STEP

    def _moved(self, gain: float, delay: float) -> list[SlipSegment]:
        return long_enough(self.ready.with_sensors(gain, delay), self.estimator.window * self.period)

    def _shift(self, segments: Sequence[SlipSegment], rig: RigValues) -> np.ndarray:
        other = self.estimator.regression(segments, rig, self.period)
        moved = other.model(self.law, self.found.values) - other.measured - self.found.raw_residual
        return -np.linalg.lstsq(self.found.gradient, self.regression.whitened(moved), rcond=None)[0]


def _noise(regression: Regression, law: FittableLaw, found: Solution, bootstrap: int, seed: int) -> np.ndarray:
    """Covariance (m, m) from the residuals: jackknife over slip segments, or bootstrap of whole segments."""
    if bootstrap == 0:
        return clustered_covariance(found.gradient, found.residual, regression.cluster)

    def again(rows: np.ndarray) -> np.ndarray:
        # one Gauss-Newton step from the solution: the law is nearly linear over the spread of the draws
        return found.values - np.linalg.lstsq(found.gradient[rows], found.residual[rows], rcond=None)[0]

    draws = block_bootstrap(again, regression.cluster, draws=bootstrap, seed=seed)
    return np.cov(draws, rowvar=False)


def _constants(
    ready: Pool, shifts: _Shifts, law: FittableLaw, values: np.ndarray
) -> tuple[tuple[Constant, ...], np.ndarray]:
    """Constants with the sensitivities of the parameters, and the standard deviations (m,) that they pass on."""
    names = [parameter.name for parameter in law.parameters]
    constants, power = [], np.zeros(len(names))
    for prior in ready.priors:
        shift = shifts.by_constant(prior.name)
        power += (shift * prior.standard_uncertainty / prior.value) ** 2
        relative = {name: float(s / v) if v else None for name, s, v in zip(names, shift, values, strict=True)}
        constants.append(
            Constant(prior.name, prior.value, prior.unit, prior.standard_uncertainty, prior.source, relative)
        )
    return tuple(constants), np.sqrt(power)


def _summaries(ready: Pool, segments: Sequence[SlipSegment], regression: Regression) -> tuple[LogSummary, ...]:
    ends = np.stack([regression.slip.min(axis=1), regression.slip.max(axis=1)], axis=1)
    summaries = []
    for motion in ready.motions:
        mine = [number for number, segment in enumerate(segments) if segment.motion is motion]
        rows = ends[np.isin(regression.cluster, mine)]
        least, greatest = (float(rows[:, 0].min()), float(rows[:, 1].max())) if len(rows) else (0.0, 0.0)
        summaries.append(LogSummary(motion.log.name, float(np.mean(motion.drive)), len(mine), least, greatest))
    return tuple(summaries)


def _bins(regression: Regression, law: FittableLaw, found: Solution) -> tuple[SpeedBin, ...]:
    """Measured and fitted coefficient in ranges of slip speed of equal counts; standard errors over slip segments."""
    speed = regression.slip @ regression.average
    fitted = regression.model(law, found.values)
    edges = np.quantile(speed, np.linspace(0, 1, BINS + 1))
    place = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, BINS - 1)
    bins = []
    for number in np.unique(place):
        inside = place == number
        off, labels = (regression.measured - fitted)[inside], regression.cluster[inside]
        means = [float(np.mean(off[labels == label])) for label in np.unique(labels)]
        error = float(np.std(means, ddof=1) / np.sqrt(len(means))) if len(means) > 1 else None
        bins.append(
            SpeedBin(
                float(np.mean(speed[inside])),
                float(np.mean(regression.measured[inside])),
                error,
                float(np.mean(fitted[inside])),
                int(np.sum(inside)),
            )
        )
    return tuple(bins)


def _sensors(ready: Pool) -> dict[str, float]:
    fit = ready.sensors
    if fit.lines == 0:
        return {}
    deviation = np.sqrt(np.diag(fit.covariance))
    return {
        "laser_gain_correction": fit.gain,
        "laser_gain_correction_sd": float(deviation[0]),
        "laser_delay": fit.delay,
        "laser_delay_sd": float(deviation[1]),
        "encoder_line_error": fit.rms,
        "encoder_lines": fit.lines,
    }


def _doubts(
    law: FittableLaw, found: Solution, parameters: tuple[FittedParameter, ...], segments: int
) -> tuple[str, ...]:
    doubts = list(law.doubts(found.values))
    if not found.converged:
        doubts.append(f"The search did not converge: {found.message}. The values are its last ones.")
    for parameter in parameters:
        if parameter.at_bound:
            doubts.append(
                f"{parameter.name} = {parameter.value:g} {parameter.unit} lies on a bound of the search "
                f"[{parameter.minimum:g}, {parameter.maximum:g}]: the data ask for more, and its standard deviation "
                "says nothing."
            )
        elif parameter.standard_deviation > 0.5 * abs(parameter.value):
            doubts.append(
                f"{parameter.name} is hardly determined: {parameter.value:.3g} +- {parameter.standard_deviation:.2g} "
                f"{parameter.unit}. Pool logs at more drive speeds."
            )
    if segments < FEW_SEGMENTS:
        doubts.append(
            f"Only {segments} slip segments: the standard deviations are themselves uncertain. Record longer."
        )
    return tuple(doubts)
