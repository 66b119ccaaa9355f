"""The next experiment on any model: which constants of inputs and drives would tell calibrated parameters apart best.

A candidate is a run with other values of what is held: an input, a frequency, a load, a start state. With D the slopes
of what is measured by the parameters, start states projected out, and sd the noise that the calibration left,

    I = D'D/sd^2,    sd' = sqrt(diag((C^-1 + I)^-1)),    C the covariance of the calibration.

A parameter that its logs do not tell begins without any information. Candidates are ranked by the geometric mean of
sd', which no unit enters. It holds near the values that were found: what is far off may call for another experiment.

Source: Fedorov (1972), Theory of Optimal Experiments, chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Tabular
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from identification.calibration.result import Calibration
from identification.calibration.subject import Stretch, Subject, Window
from identification.calibration.systems import subject_of
from identification.calibration.untold import column_norms

if TYPE_CHECKING:
    import pandas

SAMPLES = 1000


@dataclass(frozen=True)
class CandidateExperiment:
    """A candidate. settings: what differs from the calibration; deviations: of each parameter with its log beside those
    that were calibrated with, None where it stays untold; refused: why it is none, None if it is one."""

    settings: Mapping[str, float]
    deviations: Mapping[str, float | None]
    refused: str | None = None

    @property
    def size(self) -> float:
        """Mean ln of the deviations, infinite where one is not told."""
        told = [sd for sd in self.deviations.values() if sd]
        return float(np.mean(np.log(told))) if told and len(told) == len(self.deviations) else np.inf


@dataclass(frozen=True)
class Experiments(Tabular, Recorded):
    """Candidates, the best first, those refused last. deviations: as they are now; duration: s, of each."""

    candidates: tuple[CandidateExperiment, ...]
    deviations: Mapping[str, float | None]
    duration: float

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each candidate; "sd ..." are the deviations with it."""
        import pandas

        return pandas.DataFrame(
            {
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
    names = [parameter.name for parameter in calibration.parameters if parameter.name in fmu.parameters]
    known = [*fmu.inputs, *(name for name in fmu.parameters if name not in names), *fmu.states]
    for name in dict.fromkeys(name for one in candidates for name in one):
        refuse_unknown(
            name,
            known,
            f"'{name}' is nothing that an experiment on {calibration.model} can set: "
            f"no input, held parameter or state.",
        )
    for name in only:
        refuse_unknown(name, names, f"{calibration.model} was calibrated without '{name}'.")
    noise = {line.variable: line.rms for line in calibration.residuals if line.variable in fmu.variables}
    if not (duration > 0 and samples > len(names) and noise and names):
        raise StickslipError(
            "An experiment needs a duration above 0, more samples than parameters, and a calibration of samples whose "
            "parameters all logs share."
        )
    if calibration.horizon is not None:
        duration = min(duration, calibration.horizon)
    subject, now = subject_of(fmu, names, list(noise)), _precision(calibration, names)
    chosen = list(only) or names
    judged = []
    for number, candidate in enumerate(candidates):
        try:
            information = _information(calibration, subject, candidate, duration, samples, noise)
            judged.append(CandidateExperiment(dict(candidate), _deviations(now + information, names, chosen)))
        except StickslipError as error:
            judged.append(CandidateExperiment(dict(candidate), dict.fromkeys(chosen), str(error)))
        progress((number + 1) / len(candidates))
    ranked = tuple(sorted(judged, key=lambda one: (one.refused is not None, one.size)))
    return Experiments(ranked, _deviations(now, names, chosen), duration)


def _precision(calibration: Calibration, names: Sequence[str]) -> np.ndarray:
    """(m, m) of the parameters; nothing of those that are not told."""
    every = [parameter.name for parameter in calibration.parameters]
    told = [n for n, name in enumerate(names) if calibration[name].standard_deviation is not None]
    places = [every.index(names[n]) for n in told]
    covariance, precision = np.array(calibration.covariance), np.zeros((len(names), len(names)))
    precision[np.ix_(told, told)] = np.linalg.inv(covariance[np.ix_(places, places)])
    return precision


def _information(
    calibration: Calibration,
    subject: Subject,
    candidate: Mapping[str, float],
    duration: float,
    samples: int,
    noise: Mapping[str, float],
) -> np.ndarray:
    first, fmu = calibration.logs[0], subject.fmu
    values = {**calibration.held, **calibration.values_in(first)}
    values |= {name.removesuffix("(0)"): value for name, value in calibration.values_in(first, starts=True).items()}
    constants = {name: value for name, value in calibration.reading.inputs.items() if value is not None}
    values |= {**constants, **candidate}
    parameters = {name: value for name, value in values.items() if name in (*fmu.parameters, *fmu.memories)}
    start = {name: values.get(name, float(fmu.variables[name].start or 0.0)) for name in subject.states}
    inputs = {name: value for name, value in values.items() if name in fmu.inputs}
    times = np.linspace(0.0, duration, samples + 1)[1:]
    run = subject.respond(Stretch(Window(0.0, times, inputs), parameters, start))
    slopes = np.vstack([run.slopes[:, subject.recorded.index(name)] / sd for name, sd in noise.items()])
    if not np.isfinite(slopes).all():
        raise StickslipError("The run has no derivative.")
    count = len(subject.parameters)
    starts = slopes[:, count:] / column_norms(slopes[:, count:])
    left = slopes[:, :count] - starts @ np.linalg.lstsq(starts, slopes[:, :count], rcond=None)[0]
    return left.T @ left


def _deviations(precision: np.ndarray, names: Sequence[str], chosen: Sequence[str]) -> dict[str, float | None]:
    """By name; None of what is not told."""
    sizes = np.sqrt(np.diag(precision))
    told = np.flatnonzero(sizes > 0)
    scaled = precision[np.ix_(told, told)] / np.outer(sizes[told], sizes[told])
    deviations: dict[str, float | None] = dict.fromkeys(chosen)
    if told.size and np.linalg.cond(scaled) < 1e12:
        spread = np.sqrt(np.diag(np.linalg.inv(scaled))) / sizes[told]
        deviations |= {names[n]: float(sd) for n, sd in zip(told.tolist(), spread, strict=True) if names[n] in chosen}
    return deviations
