"""Models without tangents: whole runs are differenced,

    dy/dp = (y(p + h) - y(p - h))/(2 h),    h = step max(|p|, size of p),

at a tolerance tight enough that the steps' own errors cancel: at 1e-8 the same step loses five digits. Where one of the
halves holds a jump, as of a sample that an impact passes, the other half is the derivative.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.simulation.trajectory import Trajectory
from identification.calibration.subject import Response, Stretch, Subject, Vector

TOLERANCE = 1e-10  # of runs that are differenced
STEP, STEP_OF_SOLVER = 1e-4, 1e-2  # relative, of a difference: of a method of integration, of an FMU's own
JUMP = 0.5  # relative: halves of a difference that differ by more have a jump, or nothing but rounding
SOLVER = "The FMU is co-simulated: model and solver are identified together."


class DifferencedSubject(Subject):
    """A model whose runs are differenced. step: relative, of a difference."""

    step = STEP

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        if self.timed:
            raise StickslipError(
                f"Times of events are compared with models of this suite only; found '{self.timed[0]}'."
            )

    @abstractmethod
    def swept(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        """(runs, n, k) of what is recorded, of a run for each row of parameters and start states.

        Raises:
            StickslipError: one of them cannot be made.
        """

    def respond(self, stretch: Stretch) -> Response:
        given = {**stretch.values, **stretch.start}
        sizes = {name: abs(given[name]) or float(self.fmu.variables[name].nominal or 1.0) for name in self.by}
        steps = np.array([self.step * sizes[name] for name in self.by])
        rows = {name: np.full(1 + 2 * len(steps), value) for name, value in given.items()}
        for place, (name, step) in enumerate(zip(self.by, steps, strict=True)):
            rows[name][1 + 2 * place : 3 + 2 * place] += -step, step
        values = self.swept(stretch, rows)
        below, above = (values[0] - values[1::2]), (values[2::2] - values[0])
        smaller = np.where(np.abs(below) < np.abs(above), below, above)
        jumps = np.abs(above - below) > JUMP * np.maximum(np.abs(above), np.abs(below))
        slopes = np.where(jumps, smaller, (above + below) / 2) / steps[:, None, None]
        return Response(values[0], np.moveaxis(slopes, 0, -1))


class ForeignSubject(DifferencedSubject):
    """Any FMU of others, by the master."""

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        rates = [name for name in map(self.rate_name, self.states) if name in fmu.variables]
        record = [name for name in dict.fromkeys((*measured, *rates)) if name not in self.states]
        self._driver = self._driven(record)
        if not self.states:
            self.step, self.note = STEP_OF_SOLVER, SOLVER
            self.by, self.recorded = self.parameters, tuple(measured)

    def _driven(self, record: Sequence[str]) -> Driver:
        exchange = self.fmu.description.modelExchange is not None
        if not exchange:
            self.states = ()
        # where events accumulate a guess is followed as far as it goes, and stays there
        return Driver(self.fmu, tolerance=TOLERANCE, record=record, on_zeno="hold" if exchange else "stop")

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return self._driver.run(float(stretch.times[-1]), output_times=stretch.times, **stretch.begin)

    def swept(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        if not self.states:
            return self._each(stretch, rows)
        sweep = self._driver.sweep(
            float(stretch.times[-1]),
            rows,
            start_time=stretch.start_time,
            inputs=stretch.inputs,
            output_times=stretch.times,
        )
        if sweep.failures:
            raise StickslipError(next(iter(sweep.failures.values())))
        return np.stack([sweep[name] for name in self.recorded], axis=2)

    def _each(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        """The same of co-simulations, one after the other."""
        runs = range(len(next(iter(rows.values()))))
        return np.array(
            [
                self.values(replace(stretch, values={name: float(rows[name][run]) for name in stretch.values}))
                for run in runs
            ]
        )
