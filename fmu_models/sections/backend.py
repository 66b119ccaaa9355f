"""The backend of a section of an FMU: what computes the steps. The engine in the FMU, exact lanes, or the importer.

    FmuSection -> Backend: points (m, n) -> step, jobs -> rows

A backend knows a section by its points, and by the four questions that follow from what it is (``point``).
"""

from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Varied
from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import Step
from fmu_models.sections.point import FmuPoints, Vector
from fmu_models.simulation.rows import RunRows


class Backend(Protocol):
    """The computation of the steps of a section.

    Attributes:
        pace: steps in the time that a run of the engine's series takes for one.
        together: runs that are best made by one call.
    """

    pace: int
    together: int

    @property
    def how(self) -> str:
        """Where steps and derivatives come from, in words; empty for the engine."""
        ...

    def fresh(self) -> Self:
        """The same backend with nothing counted yet."""
        ...

    def step(self, section: FmuPoints, points: Vector, varied: Varied, *, derivative: bool) -> Step:
        """One step of points (m, n)."""
        ...

    def run(self, section: FmuPoints, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        """The rows of some jobs; ends soon where ``stop`` (1,) is set."""
        ...


@runtime_checkable
class DirectedBackend(Backend, Protocol):
    """A backend that tells the direction of a motion; the engine follows it by itself, and is not asked."""

    def along(self, section: FmuPoints, points: Vector, varied: Varied) -> Vector:
        """(m, n) rates of the states at points (m, n)."""
        ...
