"""What sections of oscillators have in common: how points become runs of the engine, or of the importer, and back.

What a point is stands in ``point``. Derivatives are exact, events on the way included; at a section that a
neighbour meets earlier or later they are those on the section.

FMUs of others are strobed, or seen at a level, through the importer (``importer_steps``).
"""

from __future__ import annotations

import copy
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.families import jobs as families
from fmu_models.families import stepwise
from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import Step
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.lanes.library import Stepper, has_lanes, lanes_of
from fmu_models.sections.importer import Begin, ImporterSteps
from fmu_models.sections.point import FmuPoints, Vector
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.ensemble import Runs, Targets, Where, make_runs
from fmu_models.simulation.rows import Rows, joined
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Trajectory

# periods, or seconds where nothing forces the motion, after which a section counts as one that is not met
PATIENCE = 1000.0
# of the size of a state: a start nearer to its level is on it, and does not cross it at once
ON_LEVEL = 1e-9
STEPPERS = ("auto", "taylor")
# steps in lanes in the time of one by the series, about
PACE = 8
# relative error of a step: of our engine, which keeps it at little cost; of a method of integration, above its rounding
TOLERANCE, TOLERANCE_OF_OTHERS = 1e-14, 1e-12


class FmuSection(FmuPoints):
    """What the sections of an FMU share.

    Strobes of a system whose every mode is linear with constant coefficients are made by its exact flow, many motions
    at once (fmu_models/lanes); ``how`` says so.

    Args:
        fmu: of this suite, or of others and for Model Exchange.
        forcing: the parameter that is the frequency of the forcing, in rad/s where its unit says so, else in cycles.
        period: s, of the forcing, where no parameter says it.
        parameters: parameters and constant inputs that are not at their default.
        tolerance: relative local error of a step; 1e-14, and 1e-12 of FMUs of others.
        stepper: "auto", or "taylor" for the series of the engine alone.

    Raises:
        StickslipError: unknown names, values out of their range, a forcing without period, an FMU of others that has no
            Model Exchange or states that cannot be set.
    """

    together = 1

    def __init__(
        self,
        fmu: Fmu,
        *,
        forcing: str | None = None,
        period: float | None = None,
        parameters: Mapping[str, float] | None = None,
        tolerance: float | None = None,
        stepper: str = "auto",
    ) -> None:
        super().__init__(fmu, forcing, period, parameters)
        self.stepper = _known(stepper)
        self.tolerance = tolerance or (TOLERANCE if fmu.ours else TOLERANCE_OF_OTHERS)
        self._follow()

    @property
    def how(self) -> str:
        """Where steps and derivatives come from, if not from the engine in the FMU; counted are those made here, and
        not those that a store had."""
        if self._importer:
            return self._importer.how
        made, lanes = sum(steps for steps, _ in self._made), sum(lanes for _, lanes in self._made)
        if not lanes or self._lanes is None:
            return ""
        rest = 100.0 * (made - lanes) / made
        by_series = f"; {rest:.2g} % of the steps made now by series" if rest else ""
        return f"exact flow, up to {self._lanes.lanes} lanes{by_series}"

    @cached_property
    def _lanes(self) -> Stepper | None:
        """What makes the steps of many motions at once."""
        return lanes_of(self.fmu).stepper() if self._exact else None

    @property
    def _exact(self) -> bool:
        """Whether steps are made by the exact flow in lanes."""
        return self._strobes and self._engine is not None and self.stepper == "auto" and has_lanes(self.fmu)

    def _stepper(self, motions: int) -> Stepper | None:
        """That for so many motions at once: empty lanes cost time, and change no bit of the others."""
        if self._lanes is None or motions >= self._lanes.lanes:
            return self._lanes
        return lanes_of(self.fmu).stepper(1 << (motions - 1).bit_length())

    @property
    def _strobes(self) -> bool:
        """Whether the section is one of time."""
        return False

    def at(self, **values: float) -> Self:
        """With other values of parameters or inputs."""
        other = super().at(**values)
        other._made = []
        return other

    def stepped_by(self, stepper: str) -> Self:
        """The same made by another stepper."""
        other = copy.copy(self)
        other.stepper, other._made = _known(stepper), []
        vars(other).pop("_lanes", None)
        other.pace = PACE if other._exact else 1
        return other

    def identity(self) -> dict[str, Any]:
        """With the FMU's token and hash, and the stepper where it is chosen."""
        chosen = {} if self.stepper == "auto" else {"stepper": self.stepper}
        return {**super().identity(), "token": str(self.fmu.description.guid), "sha256": self.fmu.sha256, **chosen}

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: one for name, one in vars(self).items() if name not in ("_engine", "_importer", "_lanes", "_made")
        }

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state)
        self._follow()

    def trajectory(self, point: Vector, times: Vector) -> Trajectory:
        """The motion from a point (n,), whose phase is left out, from 0 to the last of some times (m,), s."""
        given: dict[str, Any] = {**self.as_run(point), "output_times": times, "tolerance": self.tolerance}
        return (simulate if self.fmu.ours else simulate_any)(self.fmu, float(times[-1]), **given)

    def _follow(self) -> None:
        """Who makes the steps: the engine of an FMU of ours, or the importer."""
        self._engine = engine_of(self.fmu) if self.fmu.ours else None
        self.pace = PACE if self._exact else 1
        self._made: list[tuple[int, int]] = []  # steps of each call, and how many of them were made in lanes
        self._importer = None if self.fmu.ours else ImporterSteps(self.fmu, self.tolerance)

    @abstractmethod
    def _where(self) -> Where:
        """The section, as the engine is asked for it."""

    @abstractmethod
    def _begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        """The motion to the next meeting from a point, as the importer is asked for it."""

    def _placed(self, starts: Vector) -> Vector:
        """Starts (m, n) brought onto the section where only rounding keeps them off it, as the engine does."""
        return starts

    def _repeats(self, periods: Vector) -> Vector:
        """(m,) what the engine takes for the period: that of a step of a strobe, that of the forcing of the others."""
        return periods

    def step(self, points: Vector, varied: Mapping[str, Vector] | None = None, *, derivative: bool = True) -> Step:
        """One step of points (m, n), all by one instance."""
        if self._importer:
            return self._imported(self._importer, points, varied or {}, derivative)
        rows = self.run(Jobs(points, varied or {}, derivatives=derivative), np.zeros(1, np.int32))
        lost = np.flatnonzero(rows.filled == 0)
        said = {int(i): rows.messages.get(int(i), "the motion goes to infinity") for i in lost}
        derivatives = rows.derivatives[:, 0] if derivative else rows.derivatives[:, :0]
        return Step(rows.points[:, 0], derivatives, rows.times[:, 0], rows.began[:, 0], rows.held[:, 0], said)

    def _imported(
        self, importer: ImporterSteps, points: Vector, varied: Mapping[str, Vector], derivative: bool
    ) -> Step:
        """A step of points (m, n) through the importer, one after the other."""
        (m, k), n = points.shape, len(self.fmu.states)
        points, periods = self._placed(points), self.periods(varied, m)
        ends, times = np.full((m, k), np.nan), np.full(m, np.nan)
        derivatives = np.full((m, k, k) if derivative else (m, 0), np.nan)
        why: dict[int, str] = {}
        for i in range(m):
            values = {**self.values, **{name: float(one[i]) for name, one in varied.items()}}
            begin = self._begin(points[i], values, float(periods[i]))
            try:
                flow = importer.flow(points[i, :n], begin, derivative=derivative)
                if begin.section is not None and not flow.crossed:
                    why[i] = self._lost(float(periods[i]))
                    continue
                scale = np.append(np.ones(n), periods[i] or 1.0)
                ends[i] = np.append(flow.states, flow.time)[:k] / scale[:k]
                times[i] = flow.time - begin.time
                if derivative:
                    found = importer.derivative(points[i, :n], begin, flow, self.sizes()[:n])
                    derivatives[i] = (found * scale / scale[:, None])[:k, :k]
            except StickslipError as error:
                ends[i], why[i] = np.nan, str(error)
        return Step(self.wrapped(ends), derivatives, times, np.zeros((m, 0), np.int32), np.zeros((m, 0)), why)

    def along(self, points: Vector, varied: Mapping[str, Vector] | None = None) -> Vector:
        """(m, n) rates of the states at points (m, n)."""
        assert self._importer is not None  # the engine follows the motion's direction by itself
        periods = self.periods(varied or {}, len(points))
        rates = np.zeros_like(points)
        for i, (point, period) in enumerate(zip(points, periods.tolist(), strict=True)):
            values = {**self.values, **{name: float(one[i]) for name, one in (varied or {}).items()}}
            begin = self._begin(point, values, period)
            flow = self._importer.flow(point, replace(begin, latest=begin.time), derivative=True)
            rates[i] = flow.start_rates
        return rates

    def _lost(self, period: float) -> str:
        """That the section is not met, and how long it was waited for."""
        waited = f"{PATIENCE:g} periods, {PATIENCE * period:.6g} s" if self.forced else f"{PATIENCE:g} s"
        return f"the section is not met within {waited}"

    def run(self, jobs: Jobs, stop: NDArray[np.int32]) -> Rows:
        """The rows of some jobs, in one call of the engine per chain."""
        if self._engine is None:
            return stepwise.run(self, jobs, stop)
        if jobs.chain > 1 and len(jobs) > jobs.chain:
            begins = range(0, len(jobs), jobs.chain)
            return joined([self.run(jobs.part(i, i + jobs.chain), stop) for i in begins], begins)
        places = [place for _, place in self._columns]
        periods = self.periods(jobs.varied, len(jobs))
        sizes = (len(self.fmu.states), len(self.contacts))
        runs = self._runs(jobs)
        made = make_runs(self._engine, sizes, self._where(), runs, stop)
        self._made.append((int(made.steps.sum()), int(made.in_lanes.sum())))
        lost = np.flatnonzero(made.outcomes == families.LOST)
        points, derivatives = made.points[..., places], made.derivatives
        if jobs.derivatives:
            derivatives = np.zeros((*points.shape, len(places)))
            derivatives[..., [places.index(one) for one in self._along(jobs)]] = made.derivatives[:, :, places, :]
        if self.states[-1:] == ("phase",):
            points[..., -1] /= periods[:, None]
            derivatives[:, :, -1:, :] /= periods[:, None, None, None]
            derivatives[..., -1:] *= periods[:, None, None, None]
        messages = {int(i): self._lost(float(periods[i])) for i in lost} | made.messages
        return replace(made, points=points, derivatives=derivatives, messages=messages)

    def _runs(self, jobs: Jobs) -> Runs:
        m, n = len(jobs), len(self.fmu.states)
        variables, phased = self.fmu.variables, self.states[-1:] == ("phase",)
        constants = {name: np.full(m, value) for name, value in self.values.items()} | dict(jobs.varied)
        given = self.states[: -1 if phased else None]
        values = np.stack([*constants.values(), *jobs.starts.T[: len(given)]], axis=1)
        periods = self.periods(jobs.varied, m)
        weights = np.zeros(n + 1)
        weights[:n] = 1.0 / self.sizes()[:n]
        return Runs(
            references=[variables[name].valueReference for name in (*constants, *given)],
            values=values,
            starts=jobs.starts[:, -1] * periods if phased else np.zeros(m),
            periods=self._repeats(periods),
            patience=PATIENCE * np.where(periods > 0, periods, 1.0),
            transient=jobs.transient,
            rows=jobs.rows,
            weights=weights,
            batch=jobs.batch,
            follow=jobs.chain > 1,
            resumed=jobs.resumed,
            longest=jobs.longest,
            settled=jobs.settled,
            known=self._known(jobs),
            along=self._along(jobs) if jobs.derivatives else range(jobs.tangents),
            flow=jobs.flow,
            jacobians=jobs.derivatives,
            tolerance=self.tolerance,
            stepper=self._stepper(1 if jobs.chain > 1 else m),
        )

    def _along(self, jobs: Jobs) -> list[int]:
        """Places of the numbers of a point by which steps are differentiated: those that matter to a start."""
        matters = [name not in self._memories or jobs.starts[:, i].any() for i, name in enumerate(self.states)]
        return [place for (_, place), one in zip(self._columns, matters, strict=True) if one]

    def _known(self, jobs: Jobs) -> Targets | None:
        """The targets by their states alone."""
        if jobs.targets is None:
            return None
        t, n = jobs.targets, len(self.fmu.states)
        return replace(t, points=t.points[:, :n], forms=t.forms[:, :n, :n])


def _known(stepper: str) -> str:
    if stepper not in STEPPERS:
        raise StickslipError(f"There is no stepper '{stepper}'. Choose {' or '.join(STEPPERS)}.")
    return stepper
