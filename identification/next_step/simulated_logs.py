"""Logs that the fitted law would give, and what they would tell of it beside the fitted ones.

A log is simulated as an estimator sees it: slips above the threshold, in each y = (1 + g) R sin(theta(t - d)). With D
the derivatives of y by the law's parameters and by what all logs share, the laser's gain g and delay d, start states
projected out, a the precision of one sample, n whole slips,

    M = a sum_logs n D'D + diag(0, 1/sd_g^2, 1/sd_d^2),    sd' = sqrt(diag(M^-1))

Gain and delay cannot be left out: they move all coefficients of friction together, by more than the noise does, and
another log hardly tells them; taken for noise of the samples they make a log look several times less telling than it
is. An encoder that gives the gain knows it the better the more of its lines the body passes: a straight line through so
many misplaced ones, 1/sd_g^2 ~ sum of the cubes of the ranges of angle.

a is found by asking that the fitted logs leave the deviations that the fit states, on geometric average: these hold
colour and sampling rate without a model of them (their correlation is not asked, which scatters). The logarithm of a
deviation by a jackknife over n slips scatters by 1/sqrt(2 n) about that of white residuals, and what they differ by is
shrunk by that much (James & Stein's positive part).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.segment_runs import STARTS
from identification.fit.parts import FittedParameter
from identification.fit.result import FrictionFit
from identification.fitted_model.model import FittedModel, SimulatedMotion, fitted_model, fitted_rig, fmu_parameters
from identification.inference.problem import determines
from identification.laws import FittableLaw
from identification.measurement.slip_segments import THRESHOLD
from identification.next_step.information import free_of
from rig_io.logs.log import stretches

RATE = 1000.0  # Hz, at which logs are simulated
OBSERVED = 12.0  # natural periods of the simulated motion that are looked at
SHORTEST = 10  # samples of a slip
CUT = 0.5  # of a slip, which a log loses at its ends: a part tells far less than its share
FASTER = 1.02  # a drive is uneven, and a cycle that ends within so much is none to propose
BACK = (0.5, 1.0, 2.0, 4.0)  # of the angle of release: how far back a body is turned to start
SURE = 1.25  # of that
WIDEST = 7.0  # ln of the precision of a sample, about that without what logs share


@dataclass(frozen=True, eq=False)
class SeenLog:
    """What a log shows. information: (m, m) of one slip for unit precision of a sample, of the law's parameters and of
    what logs share; period, lasts: s, from one slip to the next, and of one; angles: rad, least and greatest;
    greatest_slip: m/s; refused: why it is no log of stick-slip."""

    information: np.ndarray
    greatest_slip: float
    refused: str | None = None
    period: float = 1.0
    lasts: float = 0.0
    angles: tuple[float, float] = (0.0, 0.0)

    def over(self, duration: float, precision: float) -> np.ndarray:
        """Information (m, m) of a log of ``duration`` s."""
        return self.information * precision * max(duration - CUT * self.lasts, 0.0) / self.period


Logs = Sequence[tuple[SeenLog, float, float]]
"""Each with its duration in s, and the sign of its drive."""


class SimulatedLogs:
    """Logs of the fitted law at other drive speeds (rad/s, positive) and loads (N); one kept instance of the model for
    their derivatives."""

    def __init__(self, fit: FrictionFit, law: FittableLaw) -> None:
        from fmu_models.simulation.sensitivity import SensitiveRun

        self.fit, self.law, self.rig, self.disc = fit, law, fitted_rig(fit), fit.contacts[0][-1]
        self.model = fitted_model(fit)
        by = (*(f"{parameter.name}{self.disc}" for parameter in found(fit)), *STARTS)
        self.run = SensitiveRun(self.model.fmu, by=by, recorded=STARTS)
        self.shared, self.seen = _shared(fit), {}

    def __enter__(self) -> SimulatedLogs:
        return self

    def __exit__(self, *_: object) -> None:
        self.run.close()

    @cached_property
    def span(self) -> float:
        """Time that is looked at, s."""
        return OBSERVED * 2 * np.pi * float(np.sqrt(self.rig.J / self.rig.k))

    def stick_slip(self, w: float, N: float) -> SeenLog:
        """A log of slips, on the cycle; refused where there is none."""
        if (w, N) not in self.seen:
            self.seen[w, N] = self._stick_slip(w, N)
        return self.seen[w, N]

    def _stick_slip(self, w: float, N: float) -> SeenLog:
        nothing = np.zeros((len(found(self.fit)) + len(self.shared),) * 2)
        try:
            motion = self.motion(w, N)
            slip = self.rig.r * w - self.rig.R * motion.speed
            greatest, slipping = float(np.max(np.abs(slip))), np.abs(slip) > THRESHOLD
            if slipping.all():
                return SeenLog(nothing, greatest, "slides without sticking")
            slips = [(int(a), int(b)) for a, b in stretches(slipping) if a > 0 and b < len(slip) and b - a > SHORTEST]
            if not slips:
                return SeenLog(nothing, greatest, f"no slip above {THRESHOLD:g} m/s")
            information = sum((self._slip(motion, w, N, a, b) for a, b in slips), nothing) / len(slips)
        except StickslipError as error:
            return SeenLog(nothing, 0.0, str(error))
        begins = np.array([motion.time[a] for a, _ in slips])
        period = float(np.mean(np.diff(begins))) if len(slips) > 1 else self.span
        lasts = float(np.mean([b - a for a, b in slips])) / RATE
        angles = (float(motion.angle.min()), float(motion.angle.max()))
        return SeenLog(information, greatest, None, period, lasts, angles)

    def candidate(self, w: float, N: float) -> SeenLog:
        """As `stick_slip`, refused where an uneven drive may end the cycle."""
        seen = self.stick_slip(w, N)
        if seen.refused is None and not self._sticks(self.motion(FASTER * w, N)):
            nothing = 0 * seen.information
            return replace(seen, information=nothing, refused=f"no stick if it is {100 * (FASTER - 1):.0f} % faster")
        return seen

    def slides_on(self, w: float, N: float) -> bool:
        """Whether steady sliding is stable."""
        sliding = self._model(N).sliding({self.fit.contacts[0]: w})
        return sliding is not None and sliding.damping > 0

    def _model(self, N: float) -> FittedModel:
        return self.model.with_parameters(fmu_parameters(loaded(self.fit, N)))

    def motion(self, w: float, N: float, **how: object) -> SimulatedMotion:
        """The motion at a drive speed and load."""
        return self._model(N).run({self.fit.contacts[0]: w}, self.span, 1 / RATE, **how)  # type: ignore[reportArgumentType]

    def _sticks(self, motion: SimulatedMotion) -> bool:
        return bool(np.any(motion.states[self.fit.contacts[0]] == 0))

    def start_angle(self, w: float, N: float) -> float | None:
        """Angle (rad) to which the body is turned back, to be let go there on the running drive, so that it comes to
        stick and slip; 0 where it does so from its rest; None where nothing that was tried does."""
        release = self.rig.R * N * float(self.law.value(np.zeros(1), self.fit.law_values)[0]) / self.rig.k
        for share in (0.0, *BACK):
            angle = -SURE * share * release or 0.0
            if self._sticks(self.motion(w, N, transient=0.0, start={"theta": angle, "omega": 0.0})):
                return angle
        return None

    def _slip(self, motion: SimulatedMotion, w: float, N: float, first: int, last: int) -> np.ndarray:
        """Information (m, m) of one slip, samples first..last-1."""
        seen = self.run.run(
            motion.time[first + 1 : last],
            start_time=float(motion.time[first]),
            parameters=fmu_parameters(loaded(self.fit, N)),
            start={"theta": float(motion.angle[first]), "omega": float(motion.speed[first])},
            inputs={f"w{self.disc}": w},
        )
        theta, omega, R = seen["theta"], seen["omega"], self.rig.R
        columns, by_start = np.split(R * np.cos(theta)[:, None] * seen.of("theta"), [-len(STARTS)], axis=1)
        laser = {"gain": R * np.sin(theta), "delay": R * np.cos(theta) * omega}
        free = free_of(np.column_stack([columns, *(laser[name] for name in self.shared)]), by_start)
        return free.T @ free


class Knowledge:
    """What logs tell together. shared: deviations of what all have in common, by name; by_encoder: whether an encoder
    gave these, or they are what the slips too have left; logged: those that were fitted; stated: mean ln of the
    deviations that they left. StickslipError: the fitted model does not stick and slip in them."""

    def __init__(self, shared: Mapping[str, float], by_encoder: bool, logged: Logs, stated: float) -> None:
        self.logged, self.shared, self.by_encoder = logged, shared, by_encoder
        self.count = len(logged[0][0].information) - len(self.shared)
        information = np.asarray(sum(shown.over(lasts, 1.0) for shown, lasts, _ in logged))
        if not determines(information[: self.count, : self.count]):
            raise StickslipError(
                "The fitted model does not stick and slip at the drive speeds of the logs, so that it cannot say what "
                "others would show. Compare it with the logs first: stickslip compare."
            )
        self.precision = self._sample_precision(information, stated)

    def _sample_precision(self, information: np.ndarray, stated: float) -> float:
        from scipy.optimize import brentq

        def excess(logarithm: float) -> float:
            matrix = np.exp(logarithm) * information
            return _size(self._of_law(matrix, self._beforehand(matrix))) - stated

        least = 2 * (_size(information[: self.count, : self.count]) - stated)
        # what logs share leaves a part that no precision of samples lowers; where there is no more this hardly counts
        greatest = least + WIDEST
        root = greatest if excess(greatest) > 0 else brentq(excess, least - 1.0, greatest)
        return float(np.exp(root))  # type: ignore[reportArgumentType]  # the stubs know of more that it returns

    def with_logs(self, logs: Logs = ()) -> np.ndarray:
        """Precision (m, m) of the law with these logs beside the fitted ones."""
        every = [*self.logged, *logs]
        before, after = (
            np.asarray(sum(shown.over(lasts, self.precision) for shown, lasts, _ in some))
            for some in (self.logged, every)
        )
        known = self._beforehand(before)
        if self.by_encoder and "gain" in self.shared:
            known[0] *= _told_lines(every) / _told_lines(self.logged)
        return self._of_law(after, known)

    def _beforehand(self, information: np.ndarray) -> np.ndarray:
        """Precision (k,) of what logs share without the slips, which have this information."""
        known = np.array([1 / sd**2 for sd in self.shared.values()])
        if self.by_encoder:
            return known
        law, shared = slice(0, self.count), slice(self.count, None)
        told = information[shared, shared] - information[shared, law] @ np.linalg.solve(
            information[law, law], information[law, shared]
        )
        return np.maximum(known - np.diag(told), 0.0)

    def _of_law(self, information: np.ndarray, known: np.ndarray) -> np.ndarray:
        """Precision (m, m) of the law, from information of law and of what logs share, known so well beforehand."""
        law, shared = slice(0, self.count), slice(self.count, None)
        others = information[shared, shared] + np.diag(known)
        return information[law, law] - information[law, shared] @ np.linalg.solve(others, information[shared, law])


def _size(precision: np.ndarray) -> float:
    """Mean ln of deviations, of a precision (m, m)."""
    return float(np.mean(np.log(np.diag(np.linalg.inv(precision))))) / 2


def _told_lines(logs: Logs) -> float:
    """Sum of the cubes of the ranges of angle that bodies pass, those that overlap taken together."""
    ranges = sorted(
        tuple(sorted((sign * low, sign * high))) for (low, high), sign in ((one.angles, sign) for one, _, sign in logs)
    )
    joined: list[list[float]] = []
    for low, high in ranges:
        if joined and low <= joined[-1][1]:
            joined[-1][1] = max(joined[-1][1], high)
        else:
            joined.append([low, high])
    return float(sum((high - low) ** 3 for low, high in joined)) or 1.0


def _shared(fit: FrictionFit) -> dict[str, float]:
    """Deviations of gain (relative) and delay (s) of the laser; nothing where there is no doubt of them."""
    beside = {parameter.name: parameter.standard_deviation for parameter in fit.nuisance}
    deviations = {
        "gain": fit.sensors.get("laser_gain_correction_sd") or beside.get("laser", 0.0),
        "delay": fit.sensors.get("laser_delay_sd") or beside.get("delay", 0.0),
    }
    return {name: sd for name, sd in deviations.items() if sd > 0}


def loaded(fit: FrictionFit, N: float) -> FrictionFit:
    """The fit with another normal force, N."""
    return replace(fit, constants=tuple(replace(c, value=N) if c.name == "N" else c for c in fit.constants))


def held(fit: FrictionFit) -> np.ndarray:
    """(m,) which parameters of the law have a value that was not found."""
    return np.array([parameter.held for parameter in fit.parameters])


def found(fit: FrictionFit) -> list[FittedParameter]:
    """The parameters that a design is of."""
    return [parameter for parameter in fit.parameters if not parameter.held]


def stated_size(fit: FrictionFit) -> float:
    """Mean ln of the deviations of the parameters found, nearer to that of white residuals by what chance makes.
    StickslipError: the fit does not determine them one by one."""
    stated, white = (
        np.array([getattr(parameter, name) for parameter in found(fit)])
        for name in ("standard_deviation", "plain_deviation")
    )
    free = np.flatnonzero(~held(fit))
    covariance = np.array(fit.correlation)[np.ix_(free, free)] * np.outer(stated, stated)
    if not np.all(np.isfinite(covariance)) or not np.all(np.linalg.eigvalsh(covariance) > 0):
        raise StickslipError(
            "The fit does not determine its parameters one by one, so that there is nothing to build a design on. Pool "
            "logs at more drive speeds, or take a simpler law."
        )
    colour = float(np.mean(np.log(stated / white))) if np.all(white > 0) else np.inf
    chance = 1 / np.sqrt(2 * max(fit.segments - len(stated), 1))
    by_chance = colour * min((chance / colour) ** 2, 1.0) if np.isfinite(colour) and colour else 0.0
    return float(np.mean(np.log(stated))) - by_chance


def logged(runs: SimulatedLogs, fit: FrictionFit) -> Iterable[tuple[SeenLog, float, float]]:
    """The fitted logs, simulated."""
    for log in fit.logs:
        w = log.drive_speeds[0]
        yield runs.stick_slip(abs(w), runs.rig.N), log.duration, float(np.sign(w))
