"""The next experiment: which drive speed and load would tell the parameters apart best.

A candidate (drive speed w, normal force N) is simulated with the fitted law. Its slip segments are what an estimator
would see; with D the derivatives of the border's displacement R theta by the law's parameters, start states projected
out,
    I = a duration sum D'D,    sd' = sqrt(diag((C^-1 + I)^-1))
a is the precision of one sample, found by asking that the fitted logs, predicted in the same way, have the determinant
of the stated covariance C: it holds noise, colour and sampling rate without a model of them. Candidates without
stick-slip are refused with the reason. Steady sliding at a slip speed v is offered where it is stable,
    k theta = R N mu(v),    c + R^2 N mu'(v) > 0,    I = (R^2 N/k)^2 g g'/(zero^2 + 1/(a n)),   g = d mu/d q,
which reaches slip speeds that no cycle has; zero is what is not known of the laser's zero (a constant for the whole
log, as the angle is).

Candidates are ranked by the geometric mean of sd'/sd, which no unit enters. Source of the information of an experiment:
Fedorov (1972), Theory of Optimal Experiments, chapter 2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import deviation
from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Shown, Tabular
from identification.estimators.shooting_problem import ZERO_UNCERTAINTY
from identification.estimators.shooting_segments import STARTS
from identification.fit.parts import FittedParameter
from identification.fit.result import FrictionFit
from identification.fitted_model.model import SimulatedMotion, fitted_model, fitted_rig, fmu_parameters
from identification.inference.identifiability import HIGHEST
from identification.inference.problem import determines
from identification.laws import FittableLaw, find_law, slip_laws
from identification.measurement.pooled import RigValues
from identification.measurement.slip_segments import THRESHOLD, stretches

if TYPE_CHECKING:
    import pandas

SPEEDS = 10  # candidates, from half the lowest drive speed of the logs to twice the highest
LOADS = (0.5, 1.0, 2.0)  # of the normal force of the fit
SLIDING, FASTEST = 5, 2.7  # candidates of steady sliding, from the highest drive speed of the logs to twice that, or
# to what the drives of the rig reach, rad/s
RATE = 1000.0  # Hz, at which candidates are sampled
OBSERVED = 12.0  # natural periods of the simulated motion that are looked at


@dataclass(frozen=True)
class Candidate(Shown):
    """An experiment. kind: "stick-slip" or "steady sliding"; drive_speed: rad/s; load: N; deviations: of each
    parameter, with this log beside those fitted; gain: share by which they fall, geometric mean, 0 to 1; index:
    collinearity with it; greatest_slip: m/s; refused: why it is none, None if it is one; both: whether it sticks and
    slips or slides on, as it was begun."""

    kind: str
    drive_speed: float
    load: float
    deviations: Mapping[str, float]
    gain: float
    index: float
    greatest_slip: float
    refused: str | None
    both: bool = False


@dataclass(frozen=True)
class Design(Tabular, Recorded):
    """Candidates, the best first, those refused last; what is known now: deviations and collinearity index predicted
    for the fitted logs; duration: s, of each candidate; advice: what to do."""

    candidates: tuple[Candidate, ...]
    deviations: Mapping[str, float]
    index: float
    duration: float
    advice: str

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each candidate, best first; "sd ..." are the deviations with it."""
        import pandas

        names = ("kind", "drive_speed", "load", "gain", "index", "greatest_slip", "refused")
        return pandas.DataFrame(
            {name: getattr(candidate, name) for name in names}
            | {f"sd {name}": sd for name, sd in candidate.deviations.items()}
            for candidate in self.candidates
        )

    def _heading(self) -> str:
        return f"Design: {self.advice}"


def design(
    fit: FrictionFit,
    *,
    speeds: Sequence[float] | None = None,
    loads: Sequence[float] | None = None,
    duration: float = 20.0,
    progress: Callable[[float], None] | None = None,
) -> Design:
    """What one more log of ``duration`` s would add, by drive speed (rad/s) and load (N; those of the fit and half and
    twice it if None).

    Raises:
        StickslipError: a speed, load or duration that is not positive, a law with bristles, or a fitted law whose model
            does not stick and slip at any of the fitted drive speeds.
    """
    law, rig = find_law(fit.law_reference), fitted_rig(fit)
    if not law.sticks:
        raise StickslipError(
            f"A design needs a law of slip speed alone ({', '.join(slip_laws())}), not '{fit.law}': what its bristles "
            "do shows in stick. Fit Conti's law to the same logs (slip shooting) and design with that."
        )
    if len(fit.contacts) > 1:
        raise StickslipError(
            "A design is for one driving disc; this fit is of two. Fit the logs of each disc by itself."
        )
    driven = [abs(log.drive_speeds[0]) for log in fit.logs]
    tried = list(np.geomspace(0.5 * min(driven), 2 * max(driven), SPEEDS).tolist() if speeds is None else speeds)
    loaded_by = [rig.N * share for share in LOADS] if loads is None else list(loads)
    for name, values in (("drive speed", tried), ("load", loaded_by), ("duration", [duration])):
        if not values or not all(np.isfinite(value) and value > 0 for value in values):
            raise StickslipError(f"Every {name} of a design must be a positive number.")
    fisher = np.linalg.inv(_covariance(fit))
    with _Experiments(fit, law) as runs:
        logged = [runs.stick_slip(w, rig.N).information * log.duration for w, log in zip(driven, fit.logs, strict=True)]
        seen = sum(logged, np.zeros_like(fisher))
        if not determines(seen):
            raise StickslipError(
                "The fitted model does not stick and slip at the drive speeds of the logs, so that it cannot say what "
                "others would show. Compare it with the logs first: stickslip compare."
            )
        precision = float(np.exp((np.linalg.slogdet(fisher)[1] - np.linalg.slogdet(seen)[1]) / len(fisher)))
        results, grid = [], [(w, N) for N in loaded_by for w in tried]
        for number, (w, N) in enumerate(grid):
            run = runs.stick_slip(w, N)
            found = _candidate(fit, "stick-slip", w, N, run, fisher, precision * duration * run.information)
            both = run.refused is None and _slides_on(fit, law, replace(rig, forces=(N,)), rig.r * w)
            results.append(replace(found, both=both))
            if progress is not None:
                progress((number + 1) / len(grid))
        for v in _sliding_speeds(fit, law, rig):
            run = _steady(law, fit, rig, v, precision * duration * RATE)
            results.append(_candidate(fit, "steady sliding", v / rig.r, rig.N, run, fisher, run.information))
    ranked = tuple(sorted(results, key=lambda c: (c.refused is not None, -c.gain)))
    names = [parameter.name for parameter in _found(fit)]
    sds = dict(zip(names, np.sqrt(np.diag(np.linalg.inv(fisher))).tolist(), strict=True))
    advice = _advice(ranked, sds, _index(fisher), duration) + _holds(fit) + _reversal(fit)
    return Design(ranked, sds, _index(fisher), duration, advice)


@dataclass(frozen=True, eq=False)
class _Seen:
    """Information (m, m) for unit precision, per second of log (steady: in all), greatest slip speed m/s."""

    information: np.ndarray
    greatest_slip: float
    refused: str | None = None


class _Experiments:
    """Simulated stick-slip logs of the fitted law; one kept instance of the model for their derivatives."""

    def __init__(self, fit: FrictionFit, law: FittableLaw) -> None:
        from fmu_models.simulation.sensitivity import SensitiveRun

        self.fit, self.law, self.rig, self.disc = fit, law, fitted_rig(fit), fit.contacts[0][-1]
        self.model = fitted_model(fit)
        by = (*(f"{parameter.name}{self.disc}" for parameter in _found(fit)), *STARTS)
        self.run = SensitiveRun(self.model.fmu, by=by, recorded=STARTS)
        self.seen: dict[tuple[float, float], _Seen] = {}

    def __enter__(self) -> _Experiments:
        return self

    def __exit__(self, *_: object) -> None:
        self.run.close()

    def stick_slip(self, w: float, N: float) -> _Seen:
        """The information of the slip segments at this drive speed and load."""
        if (w, N) not in self.seen:
            self.seen[w, N] = self._stick_slip(w, N)
        return self.seen[w, N]

    def _stick_slip(self, w: float, N: float) -> _Seen:
        nothing, rig = np.zeros((len(_found(self.fit)),) * 2), self.rig
        fit = loaded(self.fit, N)
        span = OBSERVED * 2 * np.pi * float(np.sqrt(rig.J / rig.k))
        try:
            model = self.model.with_parameters(fmu_parameters(fit))
            motion = model.run({fit.contacts[0]: w}, span, 1 / RATE)
            slip = rig.r * w - rig.R * motion.speed
            greatest = float(np.max(np.abs(slip)))
            slipping = np.abs(slip) > THRESHOLD
            if slipping.all():
                return _Seen(nothing, greatest, "slides without sticking")
            segments = [(int(a), int(b)) for a, b in stretches(slipping) if a > 0 and b < len(slip) and b - a > 10]
            if not segments:
                return _Seen(nothing, greatest, f"no slip above {THRESHOLD:g} m/s")
            information = sum((self._segment(fit, motion, w, N, a, b) for a, b in segments), nothing)
        except StickslipError as error:
            return _Seen(nothing, 0.0, str(error))
        return _Seen(information / (motion.time[segments[-1][1]] - motion.time[segments[0][0]]), greatest)

    def _segment(
        self, fit: FrictionFit, motion: SimulatedMotion, w: float, N: float, first: int, last: int
    ) -> np.ndarray:
        """Information (m, m) of one segment, samples first..last-1."""
        states = {"theta": float(motion.angle[first]), "omega": float(motion.speed[first])}
        seen = self.run.run(
            motion.time[first + 1 : last],
            start_time=float(motion.time[first]),
            parameters=fmu_parameters(fit),
            start=states,
            inputs={f"w{self.disc}": w},
        )
        slope = self.rig.R * seen.derivative[:, 0]
        columns, by_start = np.split(slope, [-len(STARTS)], axis=1)
        free = columns - by_start @ np.linalg.lstsq(by_start, columns, rcond=None)[0]
        return free.T @ free


def loaded(fit: FrictionFit, N: float) -> FrictionFit:
    """The fit with another normal force, N."""
    return replace(fit, constants=tuple(replace(c, value=N) if c.name == "N" else c for c in fit.constants))


def _held(fit: FrictionFit) -> np.ndarray:
    """(m,) which parameters of the law have a value that was not found."""
    return np.array([parameter.held for parameter in fit.parameters])


def _found(fit: FrictionFit) -> list[FittedParameter]:
    """The parameters that a design is of."""
    return [parameter for parameter in fit.parameters if not parameter.held]


def _covariance(fit: FrictionFit) -> np.ndarray:
    deviation = np.array([parameter.standard_deviation for parameter in _found(fit)])
    free = np.flatnonzero(~_held(fit))
    covariance = np.array(fit.correlation)[np.ix_(free, free)] * np.outer(deviation, deviation)
    if not np.all(np.isfinite(covariance)) or not np.all(np.linalg.eigvalsh(covariance) > 0):
        raise StickslipError(
            "The fit does not determine its parameters one by one, so that there is nothing to build a design on. Pool "
            "logs at more drive speeds, or take a simpler law."
        )
    return covariance


def _sliding_speeds(fit: FrictionFit, law: FittableLaw, rig: RigValues) -> Iterator[float]:
    """Slip speeds (m/s) at which steady sliding is stable."""
    highest = max(abs(log.drive_speeds[0]) for log in fit.logs)
    for v in rig.r * np.geomspace(highest, max(2 * highest, FASTEST), SLIDING):
        if _slides_on(fit, law, rig, v):
            yield float(v)


def _slides_on(fit: FrictionFit, law: FittableLaw, rig: RigValues, v: float) -> bool:
    """Whether steady sliding at a slip speed is stable, m/s: c + R^2 N mu'(v) > 0."""
    slope = float(np.diff(law.value(v * np.array([1 - 1e-5, 1 + 1e-5]), fit.law_values))[0]) / (2e-5 * v)
    return rig.c + rig.R**2 * rig.N * slope > 0


def _steady(law: FittableLaw, fit: FrictionFit, rig: RigValues, v: float, precision: float) -> _Seen:
    g = law.gradient(np.array([v]), fit.law_values)[~_held(fit), 0]
    scale = rig.R**2 * rig.N / rig.k
    return _Seen(scale**2 * np.outer(g, g) / (ZERO_UNCERTAINTY**2 + 1 / precision), v)


def _candidate(
    fit: FrictionFit, kind: str, w: float, N: float, run: _Seen, fisher: np.ndarray, added: np.ndarray
) -> Candidate:
    then = fisher + added
    deviations = np.sqrt(np.diag(np.linalg.inv(then)))
    ratio = np.exp(np.mean(np.log(deviations / np.sqrt(np.diag(np.linalg.inv(fisher))))))
    names = [parameter.name for parameter in _found(fit)]
    named = dict(zip(names, deviations.tolist(), strict=True))
    return Candidate(kind, float(w), float(N), named, float(1 - ratio), _index(then), run.greatest_slip, run.refused)


def _index(information: np.ndarray) -> float:
    """Collinearity index of parameters with this information (m, m)."""
    norms = np.sqrt(np.diag(information))
    least = float(np.linalg.eigvalsh(information / np.outer(norms, norms))[0])
    return float(1 / np.sqrt(max(least, HIGHEST**-2)))


def _reversal(fit: FrictionFit) -> str:
    """A sentence where nothing in the logs shows the zero of the angle."""
    signs = {float(np.sign(speed)) for log in fit.logs for speed in log.drive_speeds}
    if len(signs) > 1 or any(constant.name == "k/J" for constant in fit.constants):
        return ""
    return (
        " All drives turn one way and there is no free decay, so that a zero of the angle that is off passes for "
        "friction: let one log turn the other way, which gives the zero to some um on the border."
    )


def _holds(fit: FrictionFit) -> str:
    """What tells how fast breakaway ages, where it does and the sticks have not told."""
    if fit.breakaway is None or not fit.breakaway.ages or fit.breakaway.growth is not None:
        return ""
    low, high = fit.breakaway.span
    return (
        f" Breakaway ages, but the sticks last {low:.2g} to {high:.2g} s alone: one log with holds over two decades, "
        "the drive stopped for 0.3, 3 and 30 s in turn, twice each, would tell how fast."
    )


def _advice(ranked: Sequence[Candidate], sds: Mapping[str, float], index: float, duration: float) -> str:
    useful = [c for c in ranked if c.refused is None]
    if not useful:
        return "No candidate sticks and slips: try lower drive speeds or higher loads (--speeds, --loads)."
    best = useful[0]
    falls = ", ".join(f"{name} {deviation(sds[name])} -> {deviation(sd)}" for name, sd in best.deviations.items())
    text = (
        f"{duration:g} s more of {best.kind} at {best.drive_speed:.3g} rad/s with N = {best.load:.3g} N would help "
        f"most: standard deviations {falls}; collinearity index {index:.3g} -> {best.index:.3g}."
    )
    if best.both:
        text += (
            " Steady sliding is stable there too: bring the drive up from rest with both discs in contact, so that the "
            "body sticks from the begin; let down on a running drive it may slide on."
        )
    reached = max((c.greatest_slip for c in useful if c.kind == "stick-slip"), default=0.0)
    steady = next((c for c in useful if c.kind == "steady sliding" and c.greatest_slip > reached), None)
    if steady is not None and best.kind == "stick-slip":
        text += (
            f" No cycle reaches slip speeds above {reached:.2g} m/s; steady sliding at {steady.drive_speed:.3g} rad/s "
            f"shows friction at {steady.greatest_slip:.2g} m/s."
        )
    return text
