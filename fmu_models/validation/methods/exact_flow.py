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
from fmu_models.validation.methods.result import MethodRun, NotTreated, Problem, needs_steady_inputs

INSTEAD = "Use event-driven Taylor."
PARTS = 1 << 16  # of a run that nothing forces, at most
_GO = np.zeros(1, np.int32)


@final
@dataclass(frozen=True)
class ExactFlow:
    """The stepper of ensembles; its tolerances have no meaning."""

    name: str = "exact flow in lanes (stickslip)"
    family: Literal["event-driven"] = "event-driven"
    tolerances: tuple[float, ...] = (1e-14,)

    def prepare(self, problem: Problem) -> Callable[[float], MethodRun]:
        """Open the FMU, build the lanes, and see that they make every step."""
        needs_steady_inputs(problem, self.name)
        fmu = Fmu.open(problem.fmu)
        if not has_lanes(fmu):
            raise NotTreated(f"{self.name}: {lane_obstacles(problem.system)[0]}. {INSTEAD}")
        period = _period(problem, self.name)
        if period is None:
            return self._in_parts(problem, fmu)
        run = _Run.of(problem, fmu, period)
        if run is None:
            raise NotTreated(f"{self.name}: some steps are left to the series. {INSTEAD}")
        return run

    def _in_parts(self, problem: Problem, fmu: Fmu) -> Callable[[float], MethodRun]:
        """Of what nothing forces: as few parts as lanes have a table for."""
        parts = 1
        while parts <= PARTS:
            run = _Run.of(problem, fmu, problem.stop_time / parts)
            if run is not None:
                return run
            parts *= 2
        raise NotTreated(f"{self.name}: some steps are left to the series. {INSTEAD}")


@dataclass(frozen=True, eq=False)
class _Run:
    """Whole periods, and what is left."""

    whole: Strobe | None
    periods: int
    rest: Strobe | None
    start: NDArray[np.float64]

    @classmethod
    def of(cls, problem: Problem, fmu: Fmu, period: float) -> _Run | None:
        """Ready, or None where lanes leave a step to the series."""
        given = problem.arguments
        values = {**given["parameters"], **given["inputs"]}
        periods = math.floor(problem.stop_time / period * (1.0 + 1e-12))
        left = problem.stop_time - periods * period
        whole = Strobe(fmu, period=period, parameters=values) if periods else None
        rest = Strobe(fmu, period=left, parameters=values) if left > 1e-12 * problem.stop_time else None
        some = whole or rest
        assert some is not None
        run = cls(whole, periods, rest, some.start(given["start"])[None])
        run(0.0)
        return run if all(one is None or ("by series" not in one.how and one.how) for one in (whole, rest)) else None

    def __call__(self, _: float) -> MethodRun:
        begin = time.perf_counter()
        points = self.start
        for strobe, steps in ((self.whole, self.periods), (self.rest, 1)):
            if strobe is None:
                continue
            made = strobe.run(Jobs(points, transient=steps - 1, rows=1), _GO)
            if made.outcomes[0] != FINISHED:
                raise NotTreated(f"the motion ends on its way: {made.messages.get(0, 'it goes to infinity')}")
            points = made.points[:, 0]
        return MethodRun(points[0], None, None, time.perf_counter() - begin)


def _period(problem: Problem, name: str) -> float | None:
    """The period that all harmonics of a problem fit into, s; None where nothing depends on the time.

    Raises:
        NotTreated: there is none.
    """
    waves = [abs(float(sympy.diff(argument, TIME))) for argument in Lifted.of(problem.system).harmonics]
    if not waves:
        return None
    slowest = min(waves)
    for times in range(1, 9):
        if all(abs(w * times / slowest - round(w * times / slowest)) < 1e-12 for w in waves):
            return 2.0 * math.pi * times / slowest
    raise NotTreated(f"{name}: its forces have no common period. {INSTEAD}")
