"""Event-driven Taylor series of adaptive order: the engine of this suite, through the FMU in one call per run.

Source: Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods,
Experimental Mathematics 14 (2005), for order and step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.validation.methods.result import MethodRun, Problem, Switch


@final
@dataclass(frozen=True)
class EventTaylor:
    """The engine. Tolerances above its default, 1e-14, have no effect on it."""

    name: str = "event-driven Taylor (stickslip)"
    family: Literal["event-driven"] = "event-driven"
    tolerances: tuple[float, ...] = (1e-14,)

    def prepare(self, problem: Problem) -> Callable[[float], MethodRun]:
        """Open the FMU."""
        fmu = Fmu.open(problem.fmu)
        stop = problem.stop_time

        def run(tolerance: float) -> MethodRun:
            made = simulate(fmu, stop, tolerance=tolerance, output_times=[stop], **problem.arguments)
            end = np.array([made[name][-1] for name in problem.states])
            switches = tuple(Switch(e.time, e.contact, e.before, e.after) for e in made.events)
            return MethodRun(end, switches, made.evaluations, made.seconds)

        return run
