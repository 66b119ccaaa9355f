"""Event-driven Taylor series of adaptive order: the engine of this suite, as its users call it.

Source: Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,
Experimental Mathematics 14 (2005), for order and step.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.validation.methods.result import MethodProblem, MethodRun, SwitchEvent


@final
@dataclass(frozen=True)
class EventTaylor:
    """The engine. Tolerances above its default, 1e-14, have no effect on it."""

    name: str = "event-driven Taylor (stickslip)"
    family: Literal["event-driven"] = "event-driven"
    tolerances: tuple[float, ...] = (1e-14,)

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Open the FMU; its library is loaded by a first run."""
        fmu = Fmu.open(problem.fmu)
        stop = problem.stop_time
        simulate(fmu, stop, output_times=[stop], **problem.arguments)

        def run(tolerance: float) -> MethodRun:
            started = time.perf_counter()
            trajectory = simulate(fmu, stop, tolerance=tolerance, output_times=[stop], **problem.arguments)
            seconds = time.perf_counter() - started
            end = np.array([trajectory[name][-1] for name in problem.states])
            switches = tuple(SwitchEvent(e.time, e.contact, e.before, e.after) for e in trajectory.events)
            return MethodRun(end, switches, trajectory.evaluations, seconds)

        return run
