"""The exact flow of piecewise linear systems in lanes, as ensembles have it, of one motion: periods of its forcing, and
the rest of the run in a step of its own. It tells no events. See fmu_models/lanes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
import sympy
from numpy.typing import NDArray

from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.families.jobs import FINISHED, Jobs
from fmu_models.fmu.fmu import Fmu
from fmu_models.lanes.library import has_lanes
from fmu_models.language.quantities import TIME
from fmu_models.lowering.piecewise_linear import Lifted
from fmu_models.sections.strobe import Strobe
from fmu_models.validation.methods.result import MethodProblem, MethodRun, NotTreated, needs_steady_inputs

INSTEAD = "Use event-driven Taylor."
HALVINGS = 16  # of a run that nothing forces, at most
_GO = np.zeros(1, np.int32)


@final
@dataclass(frozen=True)
class ExactFlow:
    """The stepper of ensembles; its tolerances have no meaning."""

    name: str = "exact flow in lanes (stickslip)"
    family: Literal["event-driven"] = "event-driven"
    tolerances: tuple[float, ...] = (1e-14,)

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Open the FMU, build the lanes, and see that they make every step."""
        needs_steady_inputs(problem, self.name)
        fmu = Fmu.open(problem.fmu)
        if not has_lanes(fmu):
            raise NotTreated(f"{self.name}: {lane_obstacles(problem.system)[0]}. {INSTEAD}")
        period = _period(problem, self.name)
        # of what nothing forces as few parts as lanes have a table for
        lengths = (problem.stop_time / 2**k for k in range(HALVINGS + 1)) if period is None else (period,)
        for length in lengths:
            if run := _FlowRun.of(problem, fmu, length):
                return run
        raise NotTreated(f"{self.name}: some steps are left to the series. {INSTEAD}")


@dataclass(frozen=True, eq=False)
class _FlowRun:
    """Whole periods, and what is left."""

    whole: Strobe | None
    periods: int
    rest: Strobe | None
    start: NDArray[np.float64]

    @classmethod
    def of(cls, problem: MethodProblem, fmu: Fmu, period: float) -> _FlowRun | None:
        """Ready, or None where lanes leave a step to the series."""
        arguments = problem.arguments
        values = {**arguments["parameters"], **arguments["inputs"]}
        periods = math.floor(problem.stop_time / period * (1.0 + 1e-12))
        remainder = problem.stop_time - periods * period
        strobe = Strobe(fmu, period=period, parameters=values) if periods else None
        last_strobe = (
            Strobe(fmu, period=remainder, parameters=values) if remainder > 1e-12 * problem.stop_time else None
        )
        any_strobe = strobe or last_strobe
        assert any_strobe is not None
        run = cls(strobe, periods, last_strobe, any_strobe.start(arguments["start"])[None])
        run(0.0)
        exact = all(part is None or (part.how and "by series" not in part.how) for part in (strobe, last_strobe))
        return run if exact else None

    def __call__(self, _: float) -> MethodRun:
        started = time.perf_counter()
        points = self.start
        for strobe, steps in ((self.whole, self.periods), (self.rest, 1)):
            if strobe is None:
                continue
            rows = strobe.run(Jobs(points, transient=steps - 1, rows=1), _GO)
            if rows.outcomes[0] != FINISHED:
                raise NotTreated(f"the motion ends on its way: {rows.messages.get(0, 'it goes to infinity')}")
            points = rows.points[:, 0]
        return MethodRun(points[0], None, None, time.perf_counter() - started)


def _period(problem: MethodProblem, name: str) -> float | None:
    """The period that all harmonics of a problem fit into, s; None where nothing depends on the time. NotTreated: there
    is none."""
    waves = [abs(float(sympy.diff(argument, TIME))) for argument in Lifted.of(problem.system).harmonics]
    if not waves:
        return None
    slowest = min(waves)
    for times in range(1, 9):
        if all(abs(w * times / slowest - round(w * times / slowest)) < 1e-12 for w in waves):
            return 2.0 * math.pi * times / slowest
    raise NotTreated(f"{name}: its forces have no common period. {INSTEAD}")
