"""The next experiments: which drive speeds and loads would tell the parameters apart best.

A candidate (drive speed w, normal force N) is simulated with the fitted law, and the deviations with its log beside
those fitted follow from the information of all (see `simulated_logs`). Candidates without stick-slip are refused with
the reason; where steady sliding is stable too it is said how to begin. Several logs are planned together: the best
beside those chosen so far, one after the other, then each changed for the best beside the rest until no change helps
(Fedorov's exchange).

Candidates and plans are ranked by the geometric mean of the deviations, which no unit enters. Source of the information
of an experiment and of the exchange: Fedorov (1972), Theory of Optimal Experiments, chapters 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle, islice
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import deviation
from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Shown, Tabular
from identification.fit.result import FrictionFit
from identification.fitted_model.model import fitted_rig
from identification.inference.identifiability import HIGHEST
from identification.laws import FittableLaw, find_law, slip_laws
from identification.next_step.information import deviations_of, mean_logarithm, rank
from identification.next_step.simulated_logs import Knowledge, SeenLog, SimulatedLogs, logged, stated_size
from identification.next_step.simulated_logs import found as parameters_of

if TYPE_CHECKING:
    import pandas

SPEEDS = 20  # candidates, from half the lowest drive speed of the logs to twice the highest
HOLDS = (0.3, 3.0, 30.0)  # s, two decades
MOST = 50  # logs of a plan
ANY, REPEATED = "as you like", "as the logs were made"
BETTER = 1e-6  # of the mean ln of the deviations: a change of the plan that helps


@dataclass(frozen=True)
class Candidate(Shown):
    """A log of stick-slip. drive_speed: rad/s, negative the other way; load: N; deviations: of each parameter, with
    this log beside those before; gain: share by which they fall from those of the fitted logs, geometric mean, 0 to 1;
    index: collinearity with it; greatest_slip: m/s; refused: why it is none, None if it is one; both: whether steady
    sliding is stable there too; start_angle: rad, to which the body is turned back to be let go on the running drive,
    so that it sticks and slips (0: from its rest; None: nothing that was tried leads there); holds: s, for which the
    drive is stopped now and then."""

    drive_speed: float
    load: float
    deviations: Mapping[str, float]
    gain: float
    index: float
    greatest_slip: float
    refused: str | None
    both: bool = False
    start_angle: float | None = 0.0
    holds: tuple[float, ...] = ()

    RECORD = (
        *("drive_speed", "load", "deviations", "gain", "index", "greatest_slip", "refused", "both"),
        *("start_angle", "start", "holds"),
    )

    @property
    def start(self) -> str:
        """How to begin, and what to do in between."""
        holding = f", with holds of {', '.join(f'{hold:g}' for hold in self.holds)} s" if self.holds else ""
        if self.start_angle == 0 and not self.both:
            return ANY + holding
        release = "" if self.start_angle is None else f", or let the body go at {self.start_angle:.2g} rad"
        return f"bring the drive up from rest in contact{release}{holding}"


@dataclass(frozen=True)
class Plan(Tabular, Recorded):
    """Logs to be made together, the one that helps most first, each with the deviations after it; repeated: what as
    many logs like those that were made would leave."""

    logs: tuple[Candidate, ...]
    repeated: Mapping[str, float]

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each log, the last one for a repetition of those that were made; "sd ..." are the deviations."""
        import pandas

        rows = [
            {"drive_speed": log.drive_speed, "load": log.load, "start": log.start} | _named(log) for log in self.logs
        ]
        return pandas.DataFrame([*rows, {"start": REPEATED} | {f"sd {q}": sd for q, sd in self.repeated.items()}])

    def _heading(self) -> str:
        return f"Plan of {len(self.logs)} logs"


@dataclass(frozen=True)
class Design(Tabular, Recorded):
    """Candidates, the best first, those refused last; what is known now: deviations and collinearity index predicted
    for the fitted logs; duration: s, of each candidate; advice: what to do; plan: of the logs asked for."""

    candidates: tuple[Candidate, ...]
    deviations: Mapping[str, float]
    index: float
    duration: float
    advice: str
    plan: Plan

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each candidate, best first; "sd ..." are the deviations with it."""
        import pandas

        names = ("drive_speed", "load", "gain", "index", "greatest_slip", "start", "refused")
        return pandas.DataFrame(
            {name: getattr(candidate, name) for name in names} | _named(candidate) for candidate in self.candidates
        )

    def _heading(self) -> str:
        return f"Design: {self.advice}"


def _named(candidate: Candidate) -> dict[str, float]:
    return {f"sd {name}": sd for name, sd in candidate.deviations.items()}


def design(
    fit: FrictionFit,
    *,
    speeds: Sequence[float] | None = None,
    loads: Sequence[float] | None = None,
    duration: float = 20.0,
    logs: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Design:
    """What one more log of ``duration`` s would add, by drive speed (rad/s) and load (N; that of the fit if None), and
    a plan of so many ``logs``. StickslipError: a speed, load or duration that is not positive, a number of logs that is
    none, a law with bristles, or a fitted law whose model does not stick and slip at any of the fitted drive speeds."""
    law, rig = find_law(fit.law_reference), fitted_rig(fit)
    _check(fit, law)
    if isinstance(logs, bool) or not isinstance(logs, int) or not 1 <= logs <= MOST:
        raise StickslipError(f"A design plans 1 to {MOST} logs, and {logs!r} is no such number.")
    driven = [abs(log.drive_speeds[0]) for log in fit.logs]
    tried = list(np.geomspace(0.5 * min(driven), 2 * max(driven), SPEEDS).tolist() if speeds is None else speeds)
    loaded_by = [rig.N] if loads is None else list(loads)
    for name, values in (("drive speed", tried), ("load", loaded_by), ("duration", [duration])):
        if not values or not all(np.isfinite(value) and value > 0 for value in values):
            raise StickslipError(f"Every {name} of a design must be a positive number.")
    stated = stated_size(fit)
    sign, unseen = float(np.sign(fit.logs[0].drive_speeds[0])), bool(_reversal(fit))
    with SimulatedLogs(fit, law) as runs:
        known = Knowledge(runs.shared, "encoder_lines" in fit.sensors, list(logged(runs, fit)), stated)
        forecast = _Forecast(known, [q.name for q in parameters_of(fit)], duration, sign, unseen)
        results, grid = [], [(w, N) for N in loaded_by for w in tried]
        seen: dict[tuple[float, float], SeenLog] = {}
        for number, (w, N) in enumerate(grid):
            run = runs.candidate(w, N)
            one = forecast.candidate(w, N, run)
            if run.refused is None:
                seen[w, N] = run
                one = replace(one, both=runs.slides_on(w, N), start_angle=runs.start_angle(w, N))
            results.append(one)
            if progress is not None:
                progress((number + 1) / len(grid))
    best_first = tuple(sorted(results, key=lambda one: rank(one.refused, one.deviations)))
    planned = [one for one in best_first if (one.drive_speed, one.load) in seen]
    plan = forecast.plan(planned, [seen[one.drive_speed, one.load] for one in planned], logs)
    if _holds(fit) and plan.logs:
        slowest = min(plan.logs, key=lambda one: abs(one.drive_speed))
        plan = replace(plan, logs=tuple(replace(one, holds=HOLDS) if one is slowest else one for one in plan.logs))
    present, index = forecast.deviations(), _index(forecast.precision(()))
    advice = _advice(best_first, present, index, duration) + _together(plan, duration)
    advice += _constants(fit, best_first[0].deviations) + _holds(fit) + _reversal(fit)
    if fit.causes:
        advice += (
            f" Foretold as if {', '.join(cause.name for cause in fit.causes)} were known: estimated in the log to come "
            "too, they leave larger deviations."
        )
    if not np.allclose(loaded_by, rig.N):
        advice += " Logs of another normal force cannot be pooled with those that were made: fit them by themselves."
    return Design(best_first, present, index, duration, advice, plan)


def _check(fit: FrictionFit, law: FittableLaw) -> None:
    if not law.sticks:
        raise StickslipError(
            f"A design needs a law of slip speed alone ({', '.join(slip_laws())}), not '{fit.law}': what its bristles "
            "do shows in stick. Fit Conti's law to the same logs (slip shooting) and design with that."
        )
    if len(fit.contacts) > 1:
        raise StickslipError(
            "A design is for one driving disc; this fit is of two. Fit the logs of each disc by itself."
        )


@dataclass(frozen=True, eq=False)
class _Forecast:
    """What logs of ``duration`` s would add to what is known of the parameters that have these names; way: sign of
    their drives; alternating: whether they turn either way in turn, the other one first."""

    knowledge: Knowledge
    names: Sequence[str]
    duration: float
    way: float
    alternating: bool

    def precision(self, runs: Sequence[SeenLog]) -> np.ndarray:
        """Of the parameters (m, m), with these logs beside the fitted ones."""
        return self.knowledge.with_logs([(run, self.duration, self.sign(number)) for number, run in enumerate(runs)])

    def deviations(self, runs: Sequence[SeenLog] = ()) -> dict[str, float]:
        """Deviations with these logs beside the fitted ones."""
        return self._told(self.precision(runs))

    def _told(self, precision: np.ndarray) -> dict[str, float]:
        told = deviations_of(precision, self.names, self.names)
        return {name: np.inf if sd is None else sd for name, sd in told.items()}

    def sign(self, place: int) -> float:
        """Of the drive in a planned log."""
        return self.way * (-1) ** (place + 1) if self.alternating else self.way

    def candidate(self, w: float, N: float, run: SeenLog) -> Candidate:
        """One more log."""
        return self._with(Candidate(float(w), float(N), {}, 0.0, 0.0, run.greatest_slip, run.refused), [run])

    def _with(self, one: Candidate, runs: Sequence[SeenLog]) -> Candidate:
        then, index = self.deviations(runs), _index(self.precision(runs))
        fall = mean_logarithm(then) - mean_logarithm(self.deviations())
        return replace(one, deviations=then, gain=float(1 - np.exp(fall)), index=index)

    def plan(self, candidates: Sequence[Candidate], runs: Sequence[SeenLog], count: int) -> Plan:
        """The best ``count`` logs of candidates, which have these runs; none where there is no candidate."""
        made = ((run, self.duration, sign) for run, _, sign in self.knowledge.logged)
        repeated = self._told(self.knowledge.with_logs(list(islice(cycle(made), count))))
        if not runs:
            return Plan((), repeated)

        def size(chosen: Sequence[int]) -> float:
            return mean_logarithm(self.deviations([runs[i] for i in chosen]))

        def best(rest: Sequence[int], of: Sequence[int] = range(len(runs))) -> int:
            return min(of, key=lambda i: size([*rest, i]))

        chosen: list[int] = []
        for _ in range(count):
            chosen.append(best(chosen))
        helps = True
        while helps:
            helps = False
            for number in range(count):
                rest = chosen[:number] + chosen[number + 1 :]
                trial = [*rest, best(rest)]
                if size(trial) < size(chosen) - BETTER:
                    chosen, helps = trial, True
        ordered: list[int] = []
        while chosen:
            ordered.append(best(ordered, chosen))
            chosen.remove(ordered[-1])
        logs = []
        for number, i in enumerate(ordered):
            candidate, sign = self._with(candidates[i], [runs[j] for j in ordered[: number + 1]]), self.sign(number)
            angle = None if candidate.start_angle is None else sign * candidate.start_angle + 0.0  # no -0
            logs.append(replace(candidate, drive_speed=sign * candidate.drive_speed, start_angle=angle))
        return Plan(tuple(logs), repeated)


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


def _constants(fit: FrictionFit, then: Mapping[str, float]) -> str:
    """What no log lowers, where it is more than what is left with one."""
    rest = [q for q in parameters_of(fit) if q.scale_deviation > then[q.name]]
    if not rest:
        return ""
    share = {
        c.name: abs(c.sensitivity.get(rest[0].name) or 0) * c.standard_uncertainty / c.value for c in fit.constants
    }
    unsettled = ", ".join(f"{q.name} {deviation(q.scale_deviation)}" for q in rest)
    worst = max(share, key=lambda name: share[name])
    return f" Beside that the constants of the rig leave {unsettled}, which no log lowers: measure {worst} better."


def _holds(fit: FrictionFit) -> str:
    """What tells how fast breakaway ages, where it does and the sticks have not told."""
    if fit.breakaway is None or not fit.breakaway.ages or fit.breakaway.growth is not None:
        return ""
    low, high = fit.breakaway.span
    return (
        f" Breakaway ages, but the sticks last {low:.2g} to {high:.2g} s alone: one log with holds over two decades, "
        f"the drive stopped for {', '.join(f'{hold:g}' for hold in HOLDS)} s in turn, twice each, would tell how fast."
    )


def _advice(best_first: Sequence[Candidate], now: Mapping[str, float], index: float, duration: float) -> str:
    useful = [c for c in best_first if c.refused is None]
    if not useful:
        return "No candidate sticks and slips: try lower drive speeds or higher loads (--speeds, --loads)."
    best = useful[0]
    falls = ", ".join(f"{name} {deviation(now[name])} -> {deviation(sd)}" for name, sd in best.deviations.items())
    text = (
        f"{duration:g} s more of stick-slip at {best.drive_speed:.3g} rad/s with N = {best.load:.3g} N would help "
        f"most: standard deviations {falls}; collinearity index {index:.3g} -> {best.index:.3g}."
    )
    if best.start != ANY:
        text += f" It may slide on there without sticking: {best.start}."
    return text


def _together(plan: Plan, duration: float) -> str:
    """What several logs come to."""
    if len(plan.logs) < 2:
        return ""
    last = plan.logs[-1].deviations
    share = 1 - np.exp(mean_logarithm(last) - mean_logarithm(plan.repeated))
    return (
        f" {len(plan.logs)} logs of {duration:g} s as planned leave deviations {100 * share:.0f} % below those of as "
        "many like the logs that were made."
    )
