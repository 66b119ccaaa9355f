"""The engine in an FMU of ours, and its exact lanes, as backends: whole families of runs in one call."""

import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Varied
from fmu_models.families import jobs as families
from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import Step
from fmu_models.fmu.fmu import Fmu
from fmu_models.lanes.library import Stepper, lanes_of
from fmu_models.sections.point import PATIENCE, FmuPoints, Vector
from fmu_models.simulation.engine import Engine
from fmu_models.simulation.ensemble import EnsembleRuns, Targets, make_runs
from fmu_models.simulation.rows import RunRows, joined

PACE = 8  # steps in lanes in the time of one by the series, about
TOGETHER = 32  # motions whose events fill vectors as well as those of more do


@dataclass(eq=False)
class EngineBackend:
    """The series of the engine.

    Attributes:
        engine: of the FMU.
        counts: steps of each call, and how many of them were made in lanes.
    """

    engine: Engine
    counts: list[tuple[int, int]] = field(default_factory=list)
    pace = 1
    together = 1

    @property
    def how(self) -> str:
        return ""

    def fresh(self) -> Self:
        backend = copy.copy(self)
        backend.counts = []
        return backend

    def stepper(self, motions: int) -> Stepper | None:
        """A stepper of this many motions at once; None where the engine makes the steps."""
        return None

    def step(self, section: FmuPoints, points: Vector, varied: Varied, *, derivative: bool) -> Step:
        """One step of points (m, n), all by one instance."""
        rows = self.run(section, Jobs(points, varied, derivatives=derivative), np.zeros(1, np.int32))
        lost = np.flatnonzero(rows.filled == 0)
        messages = {int(i): rows.messages.get(int(i), "the motion goes to infinity") for i in lost}
        derivatives = rows.derivatives[:, 0] if derivative else rows.derivatives[:, :0]
        return Step(rows.points[:, 0], derivatives, rows.times[:, 0], rows.began[:, 0], rows.held[:, 0], messages)

    def run(self, section: FmuPoints, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        """The rows of some jobs, in one call of the engine for chains beside one another."""
        if jobs.chain > 1 and len(jobs) > jobs.block:
            begins = range(0, len(jobs), jobs.block)
            return joined([self.run(section, jobs.part(i, i + jobs.block), stop) for i in begins], begins)
        places = [index for _, index in section.columns]
        periods = section.periods(jobs.varied, len(jobs))
        sizes = (len(section.fmu.states), len(section.contacts))
        runs = self._runs(section, jobs)
        rows = make_runs(self.engine, sizes, section.where(), runs, stop)
        self.counts.append((int(rows.steps.sum()), int(rows.in_lanes.sum())))
        lost = np.flatnonzero(rows.outcomes == families.LOST)
        points, derivatives = rows.points[..., places], rows.derivatives
        if jobs.derivatives:
            derivatives = np.zeros((*points.shape, len(places)))
            columns = [places.index(index) for index in _along(section, jobs)]
            derivatives[..., columns] = rows.derivatives[:, :, places, :]
        if section.states[-1:] == ("phase",):
            points[..., -1] /= periods[:, None]
            derivatives[:, :, -1:, :] /= periods[:, None, None, None]
            derivatives[..., -1:] *= periods[:, None, None, None]
        messages = {int(i): section.missed(float(periods[i])) for i in lost} | rows.messages
        return replace(rows, points=points, derivatives=derivatives, messages=messages)

    def _runs(self, section: FmuPoints, jobs: Jobs) -> EnsembleRuns:
        m, n = len(jobs), len(section.fmu.states)
        variables, phased = section.fmu.variables, section.states[-1:] == ("phase",)
        constants = {name: np.full(m, value) for name, value in section.values.items()} | dict(jobs.varied)
        numbers = section.states[: -1 if phased else None]
        values = np.stack([*constants.values(), *jobs.starts.T[: len(numbers)]], axis=1)
        periods = section.periods(jobs.varied, m)
        weights = np.zeros(n + 1)
        weights[:n] = 1.0 / section.sizes()[:n]
        if phased and n == 1:  # at the section that state tells nothing, as a potential right after its reset
            weights[n] = 1.0 / periods.max()
        return EnsembleRuns(
            references=[variables[name].valueReference for name in (*constants, *numbers)],
            values=values,
            starts=jobs.starts[:, -1] * periods if phased else np.zeros(m),
            periods=section.repeats(periods),
            patience=PATIENCE * np.where(periods > 0, periods, section.wait),
            weights=weights,
            known=_targets(section, jobs),
            along=_along(section, jobs) if jobs.derivatives else range(jobs.tangents),
            tolerance=section.tolerance,
            # events of chains come at like times
            stepper=self.stepper(2 * jobs.beside if jobs.chain > 1 else m),
            **jobs.settings,
        )


@dataclass(eq=False)
class LanesBackend(EngineBackend):
    """The exact flow in lanes, and the engine's series for the steps that they refuse.

    Attributes:
        fmu: whose strobe it is.
    """

    fmu: Fmu = field(kw_only=True)
    pace = PACE
    together = TOGETHER

    @property
    def how(self) -> str:
        steps, in_lanes = sum(steps for steps, _ in self.counts), sum(lanes for _, lanes in self.counts)
        if not in_lanes or self._all_lanes is None:
            return ""
        share = 100.0 * (steps - in_lanes) / steps
        by_series = f"; {share:.2g} % of the steps made now by series" if share else ""
        return f"exact flow, up to {self._all_lanes.lanes} lanes{by_series}"

    def stepper(self, motions: int) -> Stepper | None:
        """That for so many motions at once, with half as many lanes: events of few come at other times, and empty lanes
        cost time. Results have the same bits."""
        if self._all_lanes is None or motions >= 2 * self._all_lanes.lanes:
            return self._all_lanes
        return lanes_of(self.fmu).stepper(1 << max(motions.bit_length() - 2, 0))

    @cached_property
    def _all_lanes(self) -> Stepper | None:
        return lanes_of(self.fmu).stepper()


def _along(section: FmuPoints, jobs: Jobs) -> list[int]:
    """Places of the numbers of a point by which steps are differentiated: those that matter to a start."""
    matters = [name not in section.memories or jobs.starts[:, i].any() for i, name in enumerate(section.states)]
    return [index for (_, index), decides in zip(section.columns, matters, strict=True) if decides]


def _targets(section: FmuPoints, jobs: Jobs) -> Targets | None:
    """The targets by their states alone."""
    if jobs.targets is None:
        return None
    t, n = jobs.targets, len(section.fmu.states)
    return replace(t, points=t.points[:, :n], forms=t.forms[:, :n, :n])
