"""What a calibration returns: values with intervals that allow for colour, and what the logs leave open."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.digits import value_with_sd
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.files import existing
from fmu_models.base.plain_values import from_plain
from fmu_models.base.record import record
from fmu_models.base.shown import Pictured
from fmu_models.base.trust import admit
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.trajectory import Trajectory
from identification.calibration.log import ModelLog, Reading
from identification.calibration.problem import SegmentProblem
from identification.calibration.segments import IDEAL, Sensor
from identification.calibration.systems import opened
from identification.inference.defaults import SEED
from identification.inference.identifiability import Collinearity
from identification.inference.lmfit_exchange import Solved
from identification.inference.posterior import STEPS, Posterior, Target, sample
from identification.inference.profile import Interval, profile
from identification.inference.uncertainty import Joint, student

if TYPE_CHECKING:
    from lmfit import Minimizer

KIND = "stickslip calibration"
LOOPS = "stickslip hysteresis"  # of several calibrations, one for each law, the best first
LEVEL = 0.95


@dataclass(frozen=True)
class CalibratedValue:
    """A parameter, a constant of a sensor or a start state. standard_deviation: None where the logs do not tell it;
    first: where the search began; at_bound: whether it ended on a bound of the search."""

    name: str
    unit: str
    value: float
    standard_deviation: float | None
    first: float
    minimum: float | None = None
    maximum: float | None = None
    at_bound: bool = False
    description: str = ""


@dataclass(frozen=True)
class SeriesResidual:
    """What is left of one variable of a log: root mean square in ``unit``, and as a share of the standard deviation of
    what is measured (None of event times); correlation of neighbours, and the probability of so much colour by chance
    (Ljung-Box); order of the autoregression that whitens it. held_out: the log took no part, only its start states were
    found."""

    log: str
    variable: str
    unit: str
    samples: int
    rms: float
    share: float | None
    autocorrelation: float
    chance: float
    order: int
    held_out: bool = False


@dataclass(frozen=True)
class LocalMinimum:
    """Where a start of the search led: misfit relative to the least, and the parameters there."""

    misfit: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Calibration(Pictured):
    """Parameters of a model from logs.

    parameters: sought, constants of sensors included; starts: states at the begin of each log; covariance: of the
    parameters, in their order; directions: which of them the logs do not tell, in words; residuals: by series; minima:
    within a tenth of the least misfit; inflation: of deviations by the sandwich; horizon: s over which a free run of a
    chaotic motion means something, None where it always does; interrupted: by the user; held: parameters and start
    states that were given and not sought; sensors: by variable, of those that are not ideal; reading: of the logs;
    declaration: what names the model. intervals: by profile likelihood; posterior: of all unknowns; where they were
    asked for. solved: the problem behind it, None in a calibration that was read back.
    """

    COLUMNS = ("[name]=all_values.*",)

    model: str
    title: str
    method: str
    logs: tuple[str, ...]
    parameters: tuple[CalibratedValue, ...]
    starts: tuple[CalibratedValue, ...]
    covariance: tuple[tuple[float, ...], ...]
    directions: tuple[str, ...]
    collinearity: Collinearity
    residuals: tuple[SeriesResidual, ...]
    minima: tuple[LocalMinimum, ...]
    freedom: int
    inflation: float
    horizon: float | None = None
    interrupted: bool = False
    warnings: tuple[str, ...] = ()
    held: Mapping[str, float] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    reading: Reading = field(default_factory=Reading)
    declaration: str = ""
    intervals: tuple[Interval, ...] = ()
    posterior: Posterior | None = None
    solved: Solved | None = field(default=None, repr=False, compare=False)

    def __getitem__(self, name: str) -> CalibratedValue:
        """A parameter or start state by name. StickslipError: there is none."""
        values = {one.name: one for one in self.all_values}
        refuse_unknown(name, values, f"{self.model} was calibrated without '{name}'.")
        return values[name]

    def interval(self, name: str, level: float = LEVEL) -> tuple[float, float]:
        """Confidence interval, by profile where there is one of this level; infinite where the logs do not tell the
        value."""
        one = self[name]
        for profiled in self.intervals:
            if profiled.name == name and profiled.level == level:
                return profiled.ends
        reach = np.inf if one.standard_deviation is None else one.standard_deviation * student(self.freedom, level)
        return one.value - float(reach), one.value + float(reach)

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {parameter.name: parameter.value for parameter in self.parameters}

    @property
    def joint(self) -> Joint:
        """Parameters with their covariance. StickslipError: the logs do not tell one of them."""
        untold = [one.name for one in self.parameters if one.standard_deviation is None]
        if untold:
            raise StickslipError(
                f"The logs do not tell {', '.join(untold)}, so that nothing bounds what follows from it."
            )
        return Joint.of(self.parameters, np.array(self.covariance))

    def values_in(self, log: str, starts: bool = False) -> dict[str, float]:
        """Parameters as they are in a log of the calibration, those of the first one in any other log; or what is said
        of its start, by ``state(0)``."""
        own = log if log in self.logs else self.logs[0]
        others = tuple(f" [{name}]" for name in self.logs if name != own)
        lines = self.starts if starts else self.parameters
        return {line.name.removesuffix(f" [{own}]"): line.value for line in lines if not line.name.endswith(others)}

    @property
    def all_values(self) -> tuple[CalibratedValue, ...]:
        """Parameters, then start states."""
        return (*self.parameters, *self.starts)

    def _heading(self) -> str:
        return f"Calibration: {self.title}, {len(self.parameters)} values from {', '.join(self.logs)} ({self.method})"

    def _contents(self) -> Mapping[str, Any]:
        return {
            parameter.name: value_with_sd(parameter.value, parameter.standard_deviation, parameter.unit)
            for parameter in self.parameters
        }

    def _problem(self) -> tuple[SegmentProblem, Solved]:
        if self.solved is None or not isinstance(self.solved.problem, SegmentProblem):
            raise StickslipError("This calibration was read from a file, which holds no logs. Calibrate again.")
        return self.solved.problem, self.solved

    def log(self, number: int = 0) -> ModelLog:
        """A log as it was compared.

        Raises:
            StickslipError: the calibration was read from a file.
        """
        return self._problem()[0].logs[number]

    def free_run(self, log: int = 0) -> Trajectory:
        """The model from its start states along a log, with its inputs, at its times.

        Raises:
            StickslipError: the calibration was read from a file, or there is no such run.
        """
        problem, solved = self._problem()
        number = next(n for n, segment in enumerate(problem.segments) if segment.log == log)
        return problem.subject.trajectory(problem.stretch(number, solved.solution.values, problem.logs[log].time))

    def profiles(self, *names: str, level: float = LEVEL) -> tuple[Interval, ...]:
        """Intervals by profile likelihood, of all parameters where none are named; an open end is None.

        Raises:
            StickslipError: unknown name, or the calibration was read from a file.
        """
        problem, solved = self._problem()
        chosen = names or tuple(parameter.name for parameter in self.parameters)
        quantile = student(self.freedom, level)
        return profile(problem, solved.solution, solved.covariance, chosen, quantile=quantile, level=level).intervals

    def sample(self, *, seed: int = SEED, steps: int = STEPS) -> Posterior:
        """Parameters and start states by Markov chains; errors as in `inference.posterior.sample`."""
        problem, solved = self._problem()
        loose = [place for place, one in enumerate(problem.unknowns) if one.prior is None]
        target = Target(problem, solved.solution, solved.covariance[np.ix_(loose, loose)], [])
        return sample(target, seed=seed, steps=steps)

    def to_lmfit(self) -> tuple[Minimizer, Any]:
        """As lmfit has it, to go on with: see `inference.lmfit_exchange`.

        Raises:
            StickslipError: the calibration was read from a file.
        """
        return self._problem()[1].to_lmfit()

    def to_dict(self) -> dict[str, Any]:
        """Plain values only; the inverse of `read_calibration`."""
        posterior = None if self.posterior is None else replace(self.posterior, samples=None)
        return {"type": KIND, **record(replace(self, posterior=posterior))}


def read_calibration(path: str | os.PathLike[str]) -> Calibration:
    """A result of 'stickslip calibrate MODEL LOGS -o FILE.json', of 'decay', or that of the best law of 'hysteresis'.

    Raises:
        StickslipError: there is none, or it is something else.
    """
    file = existing(path, "calibration", " Make one: stickslip calibrate MODEL LOGS --free k,c -o FILE.json")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        if isinstance(content, dict) and content.get("type") == LOOPS:
            if not any(law["calibration"] for law in content["laws"]):
                raise StickslipError("no law was fitted to its loops; see --laws")
            content = {"type": KIND, **content["laws"][0]["calibration"]}
        if not isinstance(content, dict) or content.pop("type", None) != KIND:
            raise StickslipError(f'it lacks "type": "{KIND}"')
        for sensor in content.get("sensors", {}).values():
            sensor["clip"] = [
                end if known is None else known for known, end in zip(sensor["clip"], IDEAL.clip, strict=True)
            ]
        return from_plain(Calibration, content, "it")
    except (OSError, ValueError, TypeError, AttributeError, KeyError, StickslipError) as error:
        raise StickslipError(
            f"'{path}' is no calibration ({error}). Give a result of 'stickslip calibrate MODEL LOGS -o FILE'."
        ) from error


def loops_of(path: str | os.PathLike[str]) -> dict[str, Any]:
    """What a saved result says of loops beside its best law, plain values: sliders, cycles, laws by what they leave;
    nothing of another result."""
    content = json.loads(Path(path).read_text(encoding="utf-8"))
    if content.get("type") != LOOPS:
        return {}
    kept = ("stiffness", "sliding_force", "spring_beside", "left", "left_out", "cycles", "load", "notes")
    of_law = ("name", "parameters", "left", "held_out", "declaration")
    laws = [{key: law[key] for key in of_law} for law in content["laws"]]
    return {**{key: content[key] for key in kept}, "laws": laws}


def calibrated_fmu(
    found: Calibration, declaration: str | None = None, *, trust: bool = False, fmi_version: str = "3.0"
) -> Fmu:
    """The model of a calibration as an FMU, where it was declared, or where it is now; an FMU has its version already.
    trust: code that the calibration names may run. StickslipError: it is not there, the calibration does not say where,
    or names code that is not trusted."""
    place = declaration or found.declaration
    if not place:
        raise StickslipError(f"The calibration does not say where {found.model} is declared: name it with --machine.")
    if not declaration:
        admit(place, Path(), trust=trust)
    return opened(place, fmi_version=fmi_version)
