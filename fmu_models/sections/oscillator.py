"""What the sections of an FMU have in common: their points, and the backend that computes their steps.

What a point is stands in ``point``. Derivatives are exact, events on the way included; at a section that a
neighbour meets earlier or later they are those on the section.
"""

import copy
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Varied
from fmu_models.base.errors import StickslipError
from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import Step
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.lanes.library import has_lanes
from fmu_models.sections.backend import Backend, DirectedBackend
from fmu_models.sections.engine import EngineBackend, LanesBackend
from fmu_models.sections.importer import ImporterBackend
from fmu_models.sections.point import FmuPoints, Vector
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.rows import RunRows
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Trajectory

# of the size of a state: a start nearer to its level is on it, and does not cross it at once
ON_LEVEL = 1e-9
STEPPERS = ("auto", "taylor")
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
        wait: s, of which a motion that nothing forces has a thousand until it meets the section.
        stepper: "auto", or "taylor" for the series of the engine alone.

    Raises:
        StickslipError: unknown names, values out of their range, a forcing without period, an FMU of others that has no
            Model Exchange or states that cannot be set.
    """

    def __init__(
        self,
        fmu: Fmu,
        *,
        forcing: str | None = None,
        period: float | None = None,
        parameters: Mapping[str, float] | None = None,
        tolerance: float | None = None,
        wait: float = 1.0,
        stepper: str = "auto",
    ) -> None:
        super().__init__(fmu, forcing, period, parameters)
        self.stepper = _checked(stepper)
        self.wait = wait
        self.tolerance = tolerance or (TOLERANCE if fmu.ours else TOLERANCE_OF_OTHERS)
        self._connect()

    @property
    def how(self) -> str:
        """Where steps and derivatives come from, if not from the engine in the FMU; counted are those made here, and
        not those that a store had."""
        return self.backend.how

    def at(self, **values: float) -> Self:
        section = super().at(**values)
        section.backend = self.backend.fresh()
        return section

    def stepped_by(self, stepper: str) -> Self:
        """The same made by another stepper."""
        section = copy.copy(self)
        section.stepper = _checked(stepper)
        section._connect()
        return section

    def identity(self) -> dict[str, Any]:
        """The identity with the FMU's token and hash, and the stepper where it is chosen."""
        chosen = {} if self.stepper == "auto" else {"stepper": self.stepper}
        return {**super().identity(), "token": str(self.fmu.description.guid), "sha256": self.fmu.sha256, **chosen}

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "backend"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state)
        self._connect()

    def trajectory(self, point: Vector, times: Vector) -> Trajectory:
        """The motion from a point (n,), whose phase is left out, from 0 to the last of some times (m,), s."""
        options: dict[str, Any] = {**self.as_run(point), "output_times": times, "tolerance": self.tolerance}
        return (simulate if self.fmu.ours else simulate_any)(self.fmu, float(times[-1]), **options)

    def step(self, points: Vector, varied: Varied | None = None, *, derivative: bool = True) -> Step:
        """One step of points (m, n), all by one instance."""
        step = self.backend.step(self, points, varied or {}, derivative=derivative)
        if derivative:
            step.derivatives[:, self.drifting] = 0.0
        return step

    def along(self, points: Vector, varied: Varied | None = None) -> Vector:
        """(m, n) rates of the states at points (m, n), where the backend tells them."""
        if isinstance(self.backend, DirectedBackend):
            return self.backend.along(self, points, varied or {})
        return super().along(points, varied)

    def run(self, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        return self.backend.run(self, jobs, stop)

    def _connect(self) -> None:
        self.backend = _backend_of(self)
        self.pace, self.together = self.backend.pace, self.backend.together


def _backend_of(section: FmuSection) -> Backend:
    if not section.fmu.ours:
        return ImporterBackend(section.fmu, section.tolerance)
    if section.strobes and section.stepper == "auto" and has_lanes(section.fmu):
        return LanesBackend(engine_of(section.fmu), fmu=section.fmu)
    return EngineBackend(engine_of(section.fmu))


def _checked(stepper: str) -> str:
    if stepper not in STEPPERS:
        raise StickslipError(f"There is no stepper '{stepper}'. Choose {' or '.join(STEPPERS)}.")
    return stepper
