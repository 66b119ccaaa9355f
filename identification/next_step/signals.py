"""The input over time and the constants, within limits, whose log would leave the smallest deviations.

    u(t) = middle + half q(t)/max(1, max |q|),    q a Fourier series, or levels that hold,

    minimise  max mean ln sd'    over the series or levels of all inputs and what else may be set,

with sd' as of the candidates of `experiments`, the largest over what the values could be. Parameters that nothing tells
yet count with a prior so wide that it only gives the search a direction.

Source of Fourier series as excitation: Swevers, Ganseman, Tukel, De Schutter, Van Brussel (1997), IEEE Trans. Robotics
Automation 13, 730.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.signal import Signal
from identification.calibration.result import Calibration
from identification.inference.excitation import best_of_draws, fourier
from identification.next_step.experiments import SAMPLES, CandidateExperiment, Experiments, Forecast

if TYPE_CHECKING:
    import pandas

EVALUATIONS = 400  # of each search
KNOTS = 20  # in the period of the highest harmonic, with straight lines between
WIDE = 1e3  # of its value: standard deviation of a parameter before any log
NONE = 1e3  # cost of an experiment without a run
Limits = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class SignalShape:
    """Of a designed input. harmonics: of the period (s; the duration if None); levels: instead, how many values that
    hold one after the other."""

    harmonics: int = 6
    period: float | None = None
    levels: int | None = None

    @property
    def count(self) -> int:
        """Search variables of an input."""
        return self.levels or 1 + 2 * self.harmonics

    def draw(self, random: np.random.Generator) -> np.ndarray:
        """(count,) of a random input, which touches its limits now and then."""
        if self.levels:
            return random.uniform(-1.5, 1.5, self.levels)
        falling = 1 / np.sqrt(np.arange(1, self.harmonics + 1))
        return np.concatenate([random.normal(size=1) / 3, np.tile(falling, 2) * random.normal(size=self.count - 1)])

    def signal(self, x: np.ndarray, limits: tuple[float, float], duration: float) -> Signal:
        """The input of search variables (count,) over a log."""
        low, high = limits
        if self.levels:
            time = np.linspace(0.0, duration, self.levels + 1)
            level = (low + high) / 2 + (high - low) / 2 * np.clip(x, -1.0, 1.0)
            return Signal.held(time, np.append(level, level[-1]))
        period = self.period or duration
        time = np.linspace(0.0, duration, int(np.ceil(KNOTS * self.harmonics * duration / period)) + 1)
        sines, cosines = x[1:].reshape(2, 1, self.harmonics)
        wave = fourier(x[:1], sines, cosines, period, time)[0][:, 0]
        return Signal(time, (low + high) / 2 + (high - low) / 2 * wave / max(1.0, float(np.max(np.abs(wave)))))


@one_blas_thread()
def design_experiment(
    calibration: Calibration,
    fmu: Fmu,
    *,
    inputs: Limits | None = None,
    within: Limits | None = None,
    duration: float,
    shape: SignalShape | None = None,
    only: Sequence[str] = (),
    samples: int = SAMPLES,
    seed: int = 0,
    progress: Callable[[float], None] = lambda _: None,
) -> Experiments:
    """Design one more log of ``duration`` s: the best that was found, the best of random ones, and one as it was.

    Args:
        inputs: low and high of inputs that become signals.
        within: low and high of constants: inputs, held parameters, start states.
        shape: of the signals; a Fourier series if None.
        only, samples: as in `rank_experiments`.
        seed: of the random ones.

    Raises:
        StickslipError: as in `rank_experiments`; limits that leave nothing, a signal of what is no input, a name in
            both, no experiment within the limits that has a run.
    """
    driven, held, form = dict(inputs or {}), dict(within or {}), shape or SignalShape()
    _check(fmu, driven, held, form)
    forecast = Forecast.of(calibration, fmu, [*driven, *held], duration=duration, only=only, samples=samples)
    search = _Search(forecast, driven, held, form)
    best, drawn = best_of_draws(search.cost, search.draw, seed, EVALUATIONS, progress)
    if search.cost(best) >= NONE:
        refused = search.judged(best, "").refused
        raise StickslipError(f"No experiment within these limits has a run ({refused}). Give others.")
    labelled = [search.judged(best, "designed"), search.judged(drawn, "best of random")]
    logged = any(value is None for value in calibration.reading.inputs.values())  # a column, which is not kept
    return forecast.experiments([*labelled, forecast.judged({}, label="inputs as declared" if logged else "as it was")])


def signal_frame(candidate: CandidateExperiment, fmu: Fmu) -> pandas.DataFrame:
    """Time and inputs of a candidate, with units in the names as logs have them; a time that stands twice is a jump."""
    import pandas

    columns = {"time [s]": next(iter(candidate.signals.values())).time}
    for name, signal in candidate.signals.items():
        columns[f"{name} [{fmu.variables[name].unit or '1'}]"] = signal.value
    return pandas.DataFrame(columns)


def _check(fmu: Fmu, inputs: Limits, within: Limits, shape: SignalShape) -> None:
    if not inputs and not within:
        raise StickslipError("Say what may be set in the next experiment, and its limits: inputs, or constants.")
    for name in inputs:
        refuse_unknown(name, fmu.inputs, f"'{fmu.description.modelName}' has no input '{name}'.")
        if name in within:
            raise StickslipError(f"'{name}' is either a signal or a constant. Give its limits once.")
    for name, (low, high) in {**inputs, **within}.items():
        if not -np.inf < low < high < np.inf:
            raise StickslipError(f"The limits of '{name}', {low:g} to {high:g}, leave nothing.")
    if shape.count < 1 or shape.harmonics < 1 or not (shape.period is None or shape.period > 0):
        raise StickslipError("Harmonics, levels and period of a designed input must be above 0.")


@dataclass(frozen=True, eq=False)
class _Search:
    """Experiments by search variables: those of each input, then one for each constant, whose sine is within limits."""

    forecast: Forecast
    inputs: Limits
    within: Limits
    shape: SignalShape

    def draw(self, random: np.random.Generator) -> np.ndarray:
        shapes = [self.shape.draw(random) for _ in self.inputs]
        return np.concatenate([*shapes, random.uniform(-np.pi / 2, np.pi / 2, len(self.within))])

    def experiment(self, x: np.ndarray) -> tuple[dict[str, float], dict[str, Signal]]:
        """Constants and signals at x."""
        first = len(self.inputs) * self.shape.count
        amplitudes = x[:first].reshape(len(self.inputs), self.shape.count)
        signals = {
            name: self.shape.signal(knots, limits, self.forecast.duration)
            for (name, limits), knots in zip(self.inputs.items(), amplitudes, strict=True)
        }
        settings = {
            name: float((low + high) / 2 + (high - low) / 2 * np.sin(position))
            for (name, (low, high)), position in zip(self.within.items(), x[first:], strict=True)
        }
        return settings, signals

    def judged(self, x: np.ndarray, label: str) -> CandidateExperiment:
        return self.forecast.judged(*self.experiment(x), label)

    def cost(self, x: np.ndarray) -> float:
        """Mean ln of the deviations of the parameters that count, where it is largest."""
        forecast = self.forecast
        try:
            informations = forecast.informations(*self.experiment(x))
        except StickslipError:
            return NONE
        sizes = np.array([abs(forecast.calibration[name].value) or 1.0 for name in forecast.names])
        scaled = (forecast.now + np.array(informations)) * np.outer(sizes, sizes) + np.eye(len(sizes)) / WIDE**2
        places = [forecast.names.index(name) for name in forecast.chosen]
        variances = np.diagonal(np.linalg.inv(scaled), axis1=1, axis2=2)[:, places]
        return float(np.max(np.mean(np.log(variances), axis=1))) / 2
