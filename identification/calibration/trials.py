"""What a search has made: guesses that are scored, and descents from the best of them, as a family of runs.

A row of numbers says what is to be made, another what came of it. The problem travels to each worker once and is built
there anew from what it was made from (`Subject`); who makes which row does not show.
"""

import threading
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fmu_models.base.cache import digest
from fmu_models.families.jobs import FINISHED, STOPPED, Jobs
from fmu_models.simulation.rows import RunRows
from fmu_models.simulation.signal import Signal
from identification.calibration.descent import Minimum, Progress, between_events, descend, thinned, with_logs
from identification.calibration.log import ModelLog
from identification.calibration.nodes import Nodes
from identification.calibration.problem import SegmentProblem
from identification.inference.problem import Solution

FREE, JOINED, THINNED = range(3)  # what a minimum is of: the free run, segments with all samples, or with some
FACTS = 4  # numbers of a minimum before its values: what it is of, weight, horizon, whether it converged
TURN = threading.Lock()  # a subject makes one run at a time, and workers of a cluster are threads


class Trials:
    """Guesses of a free run, and descents from them; a system of `families.execution`.

    free_run: with all samples; light: with those of the search; nodes: segments, None of logs that have none.
    """

    pace, alone = 0, True

    def __init__(self, free_run: SegmentProblem) -> None:
        self.together = 1
        self.free_run, self.light = free_run, thinned(free_run)
        self.nodes: Nodes | None = None
        self.progress: Progress = _quiet

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "progress": _quiet}

    def check(self, name: str, values: np.ndarray) -> None:
        """Nothing varies beside the rows."""

    def identity(self) -> dict[str, Any]:
        """Model, logs and all that is known, as JSON."""
        problem, fmu = self.free_run, self.free_run.subject.fmu
        key = (problem.unknowns, problem.fixed, sorted(problem.noise.items()), problem.sensors, problem.places)
        return {
            "model": str(fmu.description.modelName),
            "sha256": fmu.sha256,
            "logs": {log.name: _digest(log) for log in problem.logs},
            "first": dict(zip((unknown.name for unknown in problem.unknowns), problem.first.tolist(), strict=True)),
            "known": digest(repr(key)),
        }

    def run(self, jobs: Jobs, stop: np.ndarray) -> RunRows:
        """Rows (m, n): x of the free run is scored, from x and start states of the segments it is descended."""
        with TURN:
            made = [self._row(start, stop) for start in jobs.starts]
        rows = RunRows.empty(len(made), 1, len(made[0][0]), 0)
        rows.points[:, 0], rows.filled[:] = [values for values, _ in made], 1
        rows.outcomes[:] = [STOPPED if stopped else FINISHED for _, stopped in made]
        return rows

    def _row(self, start: np.ndarray, stop: np.ndarray) -> tuple[np.ndarray, bool]:
        if self.nodes is not None and len(start) == len(self.light.first):
            starts, score = self.nodes.rolled(start)
            return np.append(score, starts), False
        problem, x = self.posed(start)

        def progress(done: float) -> None:
            if stop[0]:
                raise KeyboardInterrupt
            self.progress(done)

        minimum = descend(problem, x, self.free_run, progress)
        return self._packed(minimum, max(len(x), len(self.free_run.first))), minimum.interrupted

    def posed(self, row: np.ndarray) -> tuple[SegmentProblem, np.ndarray]:
        """The problem of a row, and the unknowns that it begins with."""
        if self.nodes is None:
            timed = not any(log.measured for log in self.light.logs)
            return between_events(self.light, row) if timed else (self.light, row)
        count = len(self.light.first)
        return self.nodes.placed(row, row[count:].reshape(self.nodes.states.shape))

    def _packed(self, minimum: Minimum, most: int) -> np.ndarray:
        problem, solution = minimum.problem, minimum.solution
        samples = JOINED if problem.logs is self.free_run.logs else THINNED
        kind = FREE if problem is self.free_run else samples
        horizon = np.nan if minimum.horizon is None else minimum.horizon
        facts = [kind, problem.weight, horizon, solution.converged, *solution.values, *solution.at_bound]
        row = np.full(FACTS + 2 * most, np.nan)
        row[: len(facts)] = facts
        return row

    def minimum(self, row: np.ndarray, rows: RunRows) -> Minimum:
        """The minimum that came of a row."""
        kind, weight, horizon, converged, *values = rows.points[0, 0]
        problem = self.free_run if kind == FREE else replace(self.posed(row)[0], weight=float(weight))
        problem = with_logs(problem, self.free_run.logs) if kind == JOINED else problem
        count = len(problem.unknowns)
        x, at_bound = np.array(values[:count]), tuple(bool(at) for at in values[count : 2 * count])
        solution = Solution(x, problem.evaluate(x), bool(converged), "", at_bound)
        return Minimum(problem, solution, None if np.isnan(horizon) else float(horizon), rows.outcomes[0] == STOPPED)


def _quiet(done: float) -> None:
    """Say nothing."""


def _digest(log: ModelLog) -> str:
    series: Mapping[str, Any] = {"time": log.time, **log.observed, **log.inputs}
    pieces: list[str | bytes] = []
    for name, values in series.items():
        arrays = [values.time, values.value] if isinstance(values, Signal) else [np.asarray(values)]
        pieces += [name, *(array.tobytes() for array in arrays)]
    return digest(*pieces)
