"""The next experiment on any model: which constants of inputs and drives would tell calibrated parameters apart best.

A candidate is a run with other values of what is held: an input, a frequency, a load, a start state. With D the slopes
of what is measured by the parameters, start states projected out, and sd the noise that the calibration left,

    I = D'D/sd^2,    sd' = sqrt(diag((C^-1 + I)^-1)),    C the covariance of the calibration.

A parameter that its logs do not tell begins without any information. The sd' are geometric means over the values that
were found and draws from their deviations: where contacts graze, slopes at one point promise what those beside it do
not keep. What is far off may call for another experiment.

Sources: Fedorov (1972), Theory of Optimal Experiments, chapter 2; Chaloner, Verdinelli (1995), Statistical Science 10,
273 (mean over what is known of the values).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Tabular
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.signal import Signal
from identification.calibration.result import CalibratedValue, Calibration
from identification.calibration.subject import Stretch, Subject, Window
from identification.calibration.systems import subject_of
from identification.calibration.untold import column_norms
from identification.next_step.information import deviations_of, free_of, mean_logarithm, rank

if TYPE_CHECKING:
    import pandas

SAMPLES = 1000
POINTS, FAR = 8, 2.0  # draws from the calibration beside what was found, by so many deviations
OTHER_NOISE = 0.01  # of its root mean square: noise of a variable that nothing measured so far


@dataclass(frozen=True)
class CandidateExperiment:
    """A candidate. settings: what differs from the calibration; deviations: of each parameter with its log beside those
    that were calibrated with, None where it stays untold; refused: why it is none, None if it is one; label: what it
    is, where settings do not say it; signals: inputs over time."""

    settings: Mapping[str, float]
    deviations: Mapping[str, float | None]
    refused: str | None = None
    label: str = ""
    signals: Mapping[str, Signal] = field(default_factory=dict)

    @property
    def size(self) -> float:
        """Mean ln of the deviations, infinite where one is not told."""
        return mean_logarithm(self.deviations)

    @property
    def words(self) -> str:
        """What is set."""
        settings = ", ".join(f"{name} = {value:.4g}" for name, value in self.settings.items())
        return " of ".join(word for word in (self.label, settings) if word) or "as it was"


@dataclass(frozen=True)
class Experiments(Tabular, Recorded):
    """Candidates, the best first, those refused last. deviations: as they are now; duration: s, of each; sentences:
    what would tell parameters that the logs do not."""

    candidates: tuple[CandidateExperiment, ...]
    deviations: Mapping[str, float | None]
    duration: float
    sentences: tuple[str, ...] = ()

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each candidate; "sd ..." are the deviations with it."""
        import pandas

        return pandas.DataFrame(
            {
                **({"experiment": candidate.label} if candidate.label else {}),
                **candidate.settings,
                **{f"sd {name}": sd for name, sd in candidate.deviations.items()},
                "refused": candidate.refused,
            }
            for candidate in self.candidates
        )

    def _heading(self) -> str:
        return f"Experiments: {len(self.candidates)} candidates of {self.duration:g} s"


@one_blas_thread()
def rank_experiments(
    calibration: Calibration,
    fmu: Fmu,
    candidates: Sequence[Mapping[str, float]],
    *,
    duration: float,
    only: Sequence[str] = (),
    samples: int = SAMPLES,
    progress: Callable[[float], None] = lambda _: None,
) -> Experiments:
    """What one more log of ``duration`` s would add, by the values of candidates, of the variables measured so far.

    Args:
        candidates: values of inputs, held parameters or start states, by name; all else is as in the first log.
        only: parameters that the ranking is for; all if empty.
        samples: of each log.

    Raises:
        StickslipError: a name that is none or was calibrated itself, a duration that is not positive, or nothing
            measured but times of events.
    """
    settable = dict.fromkeys(name for one in candidates for name in one)
    forecast = Forecast.of(calibration, fmu, settable, duration=duration, only=only, samples=samples)
    judged = []
    for number, candidate in enumerate(candidates):
        judged.append(forecast.judged(candidate))
        progress((number + 1) / len(candidates))
    return forecast.experiments(judged)


@dataclass(frozen=True, eq=False)
class Forecast:
    """What one more log would tell. names: parameters that all logs share; chosen: those that count; noise: by measured
    variable, 0 of one that nothing measured so far; now: (m, m) precision of the parameters; points: the calibration,
    and others that it could be; duration, samples: of the log."""

    calibration: Calibration
    subject: Subject
    names: Sequence[str]
    chosen: Sequence[str]
    noise: Mapping[str, float]
    now: np.ndarray
    points: Sequence[Calibration]
    duration: float
    samples: int

    @classmethod
    def of(
        cls,
        calibration: Calibration,
        fmu: Fmu,
        settable: Iterable[str],
        *,
        duration: float,
        only: Sequence[str],
        samples: int,
    ) -> Forecast:
        """Of experiments that set some names; errors as in `rank_experiments`."""
        names = [parameter.name for parameter in calibration.parameters if parameter.name in fmu.parameters]
        signals = [*fmu.inputs, *(name for name in fmu.parameters if name not in names), *fmu.states]
        for name in settable:
            refuse_unknown(
                name,
                signals,
                f"'{name}' is nothing that an experiment on {calibration.model} can set: "
                f"no input, held parameter or state.",
            )
        for name in only:
            refuse_unknown(name, names, f"{calibration.model} was calibrated without '{name}'.")
        noise = {line.variable: line.rms for line in calibration.residuals if line.variable in fmu.variables}
        if not (duration > 0 and samples > len(names) and noise and names):
            raise StickslipError(
                "An experiment needs a duration above 0, more samples than parameters, and a calibration of samples "
                "whose parameters all logs share."
            )
        if calibration.horizon is not None:
            duration = min(duration, calibration.horizon)
        subject, present = subject_of(fmu, names, list(noise)), _precision(calibration, names)
        return cls(
            calibration, subject, names, list(only) or names, noise, present, _points(calibration), duration, samples
        )

    def judged(
        self, settings: Mapping[str, float], signals: Mapping[str, Signal] | None = None, label: str = ""
    ) -> CandidateExperiment:
        """A candidate, refused where it has no run."""
        said, refused = dict.fromkeys(self.chosen), None
        try:
            said = self.deviations(self.informations(settings, signals))
        except StickslipError as error:
            refused = str(error)
        return CandidateExperiment(dict(settings), said, refused, label, dict(signals or {}))

    def experiments(self, judged: Iterable[CandidateExperiment]) -> Experiments:
        """All that were judged, in their order, and what they tell that the logs do not."""
        present = deviations_of(self.now, self.names, self.chosen)
        best_first = tuple(sorted(judged, key=lambda one: rank(one.refused, one.deviations)))
        return Experiments(best_first, present, self.duration, tuple(self._sentences(present, best_first)))

    def deviations(self, informations: Sequence[np.ndarray]) -> dict[str, float | None]:
        """Geometric means over the points, by name; None of what is not told at one of them."""
        each = [deviations_of(self.now + information, self.names, self.chosen) for information in informations]
        logs = {name: [np.log(sd) for one in each if (sd := one[name])] for name in self.chosen}
        return {name: float(np.exp(np.mean(of))) if len(of) == len(each) else None for name, of in logs.items()}

    def informations(
        self, settings: Mapping[str, float], signals: Mapping[str, Signal] | None = None
    ) -> list[np.ndarray]:
        """(m, m) that the log of an experiment adds, at each of the points. StickslipError: it has no run, or that no
        derivative."""
        fmu = self.subject.fmu
        constants = {name: value for name, value in self.calibration.reading.inputs.items() if value is not None}
        inputs = {name: value for name, value in {**constants, **settings}.items() if name in fmu.inputs}
        times = np.linspace(0.0, self.duration, self.samples + 1)[1:]
        window = Window(0.0, times, {**inputs, **(signals or {})})
        return [self._information(point, settings, window) for point in self.points]

    def _information(self, calibration: Calibration, settings: Mapping[str, float], window: Window) -> np.ndarray:
        first, fmu = calibration.logs[0], self.subject.fmu
        values = {**calibration.held, **calibration.values_in(first)}
        values |= {name.removesuffix("(0)"): value for name, value in calibration.values_in(first, starts=True).items()}
        values |= settings
        parameters = {name: value for name, value in values.items() if name in (*fmu.parameters, *fmu.memories)}
        start = {name: values.get(name, fmu.start_of(name)) for name in self.subject.states}
        run = self.subject.respond(Stretch(window, parameters, start))
        recorded = self.subject.recorded
        sizes = dict(zip(recorded, np.sqrt(np.mean(run.values**2, axis=0)), strict=True))
        noise = {name: sd or OTHER_NOISE * (sizes[name] or 1.0) for name, sd in self.noise.items()}
        slopes = np.vstack([run.slopes[:, recorded.index(name)] / sd for name, sd in noise.items()])
        if not np.isfinite(slopes).all():
            raise StickslipError("The run has no derivative.")
        count = len(self.subject.parameters)
        starts = slopes[:, count:] / column_norms(slopes[:, count:])
        residual = free_of(slopes[:, :count], starts)
        return residual.T @ residual

    def _sentences(self, now: Mapping[str, float | None], best_first: Sequence[CandidateExperiment]) -> Iterable[str]:
        untold = [name for name, sd in now.items() if sd is None]
        if not untold:
            return
        able = [one for one in best_first if one.refused is None]
        best = min(able, key=lambda one: sum(one.deviations[name] is None for name in untold), default=None)
        told = {name: sd for name in untold if best and (sd := best.deviations[name]) is not None}
        if told and best:
            values = ((self.calibration[name], sd) for name, sd in told.items())
            words = ", ".join(f"{one.name} = {value_with_sd(one.value, sd, one.unit)}" for one, sd in values)
            yield f"The logs do not tell {', '.join(told)}. This would: {best.words}, after which {words}."
        if silent := [name for name in untold if name not in told]:
            others = self._others(silent, best) if best else []
            measure = f"measure one of {', '.join(others)}" if others else "measure what was not"
            yield f"Nothing that was tried tells {', '.join(silent)}: hold one of them, give it a prior, or {measure}."

    def _others(self, left: Sequence[str], best: CandidateExperiment) -> list[str]:
        """Variables which, if they were measured beside the others, would tell what is left."""
        fmu, others = self.subject.fmu, []
        for name in dict.fromkeys((*fmu.outputs, *self.subject.states)):
            if name in self.noise:
                continue
            noise = {**self.noise, name: 0.0}
            wider = replace(self, subject=subject_of(fmu, self.names, list(noise)), noise=noise)
            seen = wider.judged(best.settings, best.signals).deviations
            if all(seen.get(parameter) is not None for parameter in left):
                others.append(name)
        return others


def _points(calibration: Calibration) -> list[Calibration]:
    """What was found, and draws from what is not known of it."""
    random, told = np.random.default_rng(0), [q.standard_deviation is not None for q in calibration.parameters]
    covariance = np.where(np.outer(told, told), np.array(calibration.covariance), 0.0)
    points = [calibration]
    for offsets in random.multivariate_normal(np.zeros(len(told)), covariance, POINTS, method="eigh"):
        parameters = map(_moved, calibration.parameters, offsets.tolist())
        starts = (_moved(q, random.normal() * (q.standard_deviation or 0.0)) for q in calibration.starts)
        points.append(replace(calibration, parameters=tuple(parameters), starts=tuple(starts)))
    return points


def _moved(one: CalibratedValue, offset: float) -> CalibratedValue:
    low = -np.inf if one.minimum is None else one.minimum
    high = np.inf if one.maximum is None else one.maximum
    return replace(one, value=float(np.clip(one.value + FAR * offset, low, high)))


def _precision(calibration: Calibration, names: Sequence[str]) -> np.ndarray:
    """(m, m) of the parameters; nothing of those that are not told."""
    every = [parameter.name for parameter in calibration.parameters]
    told = [n for n, name in enumerate(names) if calibration[name].standard_deviation is not None]
    places = [every.index(names[n]) for n in told]
    covariance, precision = np.array(calibration.covariance), np.zeros((len(names), len(names)))
    precision[np.ix_(told, told)] = np.linalg.inv(covariance[np.ix_(places, places)])
    return precision
