"""What is asked of a calibration: settings, and the free runs of its logs with their unknowns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.measured import UNSTATED
from identification.calibration.log import LogLike, ModelLog
from identification.calibration.problem import SegmentProblem
from identification.calibration.search import GUESSES, STARTS, noise_of
from identification.calibration.segments import IDEAL, SENSED, Sensor, whole
from identification.calibration.systems import subject_of
from identification.calibration.ties import TiedSubject, Ties
from identification.calibration.unknowns import Bounds, FreeParameter, free_parameters
from identification.inference.problem import Prior, Unknown

DELAY = 0.02  # of a log: the longest delay that is tried, to either side, unless stated


@dataclass(frozen=True)
class Settings:
    """What is known and how it is searched, beside model, logs and what is free.

    parameters: values held, first values of those that are free, and start states; starts: states whose start is sought
    (default: all that ``parameters`` do not hold); bounds, priors (value, standard deviation): by name; sensors: by
    variable; sensed: constants of sensors that are sought, (variable, "gain", "offset" or "delay"); noise: standard
    deviation by variable; each: parameters that every log has a value of its own for; columns, inputs, hold, events: as
    in `log.model_log`; guesses, attempts: scored, and searched from; segments: of each log; seed: of the guesses; ties:
    parameters that are expressions of others, from `lmfit.Parameters`.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    starts: Sequence[str] | None = None
    bounds: Mapping[str, Bounds] = field(default_factory=dict)
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    sensed: Sequence[tuple[str, str]] = ()
    noise: Mapping[str, float] = field(default_factory=dict)
    each: Sequence[str] = ()
    columns: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    hold: Sequence[str] = ()
    events: Mapping[str, str] = field(default_factory=dict)
    held_out: Sequence[LogLike] = ()
    guesses: int = GUESSES
    attempts: int = STARTS
    segments: int | None = None
    seed: int = 0
    ties: Ties | None = None


def problem_of(
    fmu: Fmu, logs: Sequence[ModelLog], free: Sequence[str], said: Settings
) -> tuple[SegmentProblem, tuple[FreeParameter, ...]]:
    """The free runs of all logs, and what is sought but start states. free: none, to seek start states alone.
    StickslipError: as in `calibrate`."""
    constants = {f"{name} {key}": (name, key) for name, key in said.sensed}
    priors = {name: prior for name, prior in said.priors.items() if name not in constants}
    sought = free_parameters(fmu, free, said.parameters, said.bounds, priors)
    measured = list(dict.fromkeys(name for log in logs for name in log.observed))
    tied = tuple(said.ties.tied.values()) if said.ties else ()
    subject = subject_of(fmu, (*free, *tied), measured)
    if said.ties:
        subject = TiedSubject(subject, said.ties)
        if said.each:
            raise StickslipError(
                f"'{next(iter(tied))}' is tied to others, which must be the same of all logs: leave each out."
            )
    for log in logs:
        subject.check(log.time)
    if stray := [name for name in said.each if name not in free]:
        raise StickslipError(f"'{stray[0]}' is to have a value for each log and is not free. Add it to --free.")
    unknowns: list[FreeParameter] = []
    places: list[dict[str, int]] = [{} for _ in logs]
    for one in sought:
        name = one.unknown.name
        for number, log in enumerate(logs):
            if number == 0 or name in said.each:
                own = f"{name} [{log.name}]" if name in said.each and len(logs) > 1 else name
                unknowns.append(replace(one, unknown=replace(one.unknown, name=own)))
            places[number][name] = len(unknowns) - 1
    sensed = {}
    for name, key in said.sensed:
        sensed[name, key] = len(unknowns)
        constant = _sensor_constant(name, key, said.sensors.get(name, IDEAL), logs)
        if known := said.priors.get(constant.unknown.name):
            prior = Prior(constant.unknown.name, known[0], constant.unknown.unit, known[1], "given")
            constant = replace(constant, unknown=replace(constant.unknown, prior=prior))
        unknowns.append(constant)
    fixed = {name: value for name, value in said.parameters.items() if name not in free}
    loose = _loose(subject.states, fixed, said.starts)
    fixed |= {name: fmu.start_of(name) for name in subject.states if name not in loose and name not in fixed}
    starts = np.full((len(logs), len(subject.states)), -1)
    more, first = [], [unknown.first for unknown in unknowns]
    for number, log in enumerate(logs):
        for place, name in enumerate(subject.states):
            if name in loose:
                starts[number, place] = len(first)
                own = f"{name}(0)" + (f" [{log.name}]" if len(logs) > 1 else "")
                more.append(Unknown(own, str(fmu.variables[name].unit or "1"), description="start"))
                first.append(said.parameters.get(name, fmu.start_of(name)))
    problem = SegmentProblem(
        subject=subject,
        logs=tuple(logs),
        segments=whole(logs),
        unknowns=(*(unknown.unknown for unknown in unknowns), *more),
        first=np.array(first),
        fixed=fixed,
        places=tuple(places),
        starts=starts,
        noise={},
        scale=np.ones(len(subject.states)),
        noise_known=all(_stated_noise(said, log, name) is not None for log in logs for name in log.observed),
        sensors=dict(said.sensors),
        sensed=sensed,
    )
    noise = {key: _stated_noise(said, logs[key[0]], key[1]) or sd for key, sd in noise_of(problem).items()}
    return replace(problem, noise=noise), tuple(unknowns)


def _stated_noise(said: Settings, log: ModelLog, name: str) -> float | None:
    """Of a variable, or of event times of a contact: as it was set, else as it stands with the log."""
    stated = log.instruments.get(name, UNSTATED).noise
    return said.noise.get(name, stated)


def with_instruments(said: Settings, logs: Sequence[ModelLog]) -> Settings:
    """Settings with what stands with the logs of their sensors, where it was not set. StickslipError: logs that differ
    in what is said of a sensor."""
    sensors, sensed, priors = dict(said.sensors), list(said.sensed), dict(said.priors)
    for name in dict.fromkeys(name for log in logs for name in log.measured):
        stated = [log.instruments.get(name, UNSTATED) for log in logs if name in log.measured]
        first = stated[0]
        if any((one.constants, one.clip) != (first.constants, first.clip) for one in stated):
            raise StickslipError(f"The logs differ in what is said of the sensor of '{name}'. Say the same of all.")
        sensor = said.sensors.get(name, IDEAL)
        own = {key: value for key, value in vars(sensor).items() if value != getattr(IDEAL, key)}
        values = {key: constant.value for key, constant in first.constants.items()}
        sensors[name] = replace(Sensor(**values, clip=first.clip or IDEAL.clip), **own)
        for key, constant in first.constants.items():
            if constant.deviation == 0 or key in own or (name, key) in sensed:
                continue
            sensed.append((name, key))
            if np.isfinite(constant.deviation):
                priors[f"{name} {key}"] = constant.value, constant.deviation
    return replace(said, sensors=sensors, sensed=tuple(sensed), priors=priors)


def _loose(states: Sequence[str], held: Mapping[str, float], asked: Sequence[str] | None) -> list[str]:
    """States whose start is sought."""
    for name in asked or ():
        refuse_unknown(name, states, f"There is no start state '{name}' to be sought.")
    return list(asked) if asked is not None else [name for name in states if name not in held]


def _sensor_constant(name: str, key: str, sensor: Sensor, logs: Sequence[ModelLog]) -> FreeParameter:
    if key not in SENSED or not any(name in log.measured for log in logs):
        raise StickslipError(f"A sensor is VARIABLE:{','.join(SENSED)} of a measured variable; found '{name}:{key}'.")
    first, low, high, unit = float(getattr(sensor, key)), -np.inf, np.inf, ""
    if key == "gain":
        low, high = sorted((first * np.exp(-3.5), first * np.exp(3.5)))
    elif key == "delay":
        longest = sensor.longest or DELAY * min(float(log.time[-1] - log.time[0]) for log in logs)
        low, high, unit = -longest, longest, "s"
    unknown = Unknown(f"{name} {key}", unit, low, high, f"{key} of the sensor")
    return FreeParameter(first, unknown, key == "gain")
