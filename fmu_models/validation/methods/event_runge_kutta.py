"""Event-driven Runge-Kutta through the FMU's Model Exchange face: the compiled master for any FMU.

The model decides what happens at an event; the master finds it, by the indicators interpolated over each step.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), for DOPRI5 and DOP853.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.validation.methods.result import MethodProblem, MethodRun, NotTreated


@final
@dataclass(frozen=True)
class EventRungeKutta:
    """``order`` as the master calls it."""

    order: Literal["dopri5", "dop853"] = "dop853"
    tolerances: tuple[float, ...] = (1e-6, 1e-8, 1e-10, 1e-12)
    family: Literal["event-driven"] = "event-driven"

    @property
    def name(self) -> str:
        return f"Runge-Kutta {self.order}, Model Exchange"

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Open the FMU; one driver per tolerance."""
        from fmu_models.importer.driver import Driver

        fmu = Fmu.open(problem.fmu)
        drivers: dict[float, Driver] = {}

        def run(tolerance: float) -> MethodRun:
            if tolerance not in drivers:
                drivers[tolerance] = Driver(fmu, method=self.order, tolerance=tolerance, record=(), max_step=math.inf)
            started = time.perf_counter()
            try:
                trajectory = drivers[tolerance].run(
                    problem.stop_time, output_times=[problem.stop_time], **problem.arguments
                )
            except StickslipError as error:
                raise NotTreated(str(error)) from error
            seconds = time.perf_counter() - started
            end = np.array([float(trajectory[name][-1]) for name in problem.states])
            return MethodRun(end, None, trajectory.evaluations, seconds)

        return run
