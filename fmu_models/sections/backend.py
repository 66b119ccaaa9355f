"""The backend of a section of an FMU: what computes the steps. The engine in the FMU, exact lanes, or the importer.

    FmuSection -> Backend: points (m, n) -> step, jobs -> rows

A backend knows a section by its points, and by the four questions of ``SectionQuestions``.
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import Step
from fmu_models.sections.point import FmuPoints, Vector
from fmu_models.simulation.ensemble import Where
from fmu_models.simulation.rows import RunRows
from fmu_models.simulation.sections import Section

# periods, or seconds where nothing forces the motion, after which a section counts as one that is not met
PATIENCE = 1000.0


@dataclass(frozen=True)
class Begin:
    """What a motion from some states is beside them.

    Attributes:
        values: of parameters by name.
        time, latest: s, its begin and its latest end.
        section: where it ends before that.
        period: s, of the forcing; 0: its begin is no number of a point.
    """

    values: Mapping[str, float]
    time: float
    latest: float
    section: Section | None = None
    period: float = 0.0


class SectionQuestions(FmuPoints):
    """The points of a section, and what a backend asks about it.

    Attributes:
        tolerance: relative local error of a step.
        strobes: whether the section is one of time.
        wait: s, what counts as a period where nothing forces the motion.
    """

    tolerance: float
    wait: float = 1.0
    strobes: bool = False

    @abstractmethod
    def where(self) -> Where:
        """The section, as the engine is asked for it."""

    @abstractmethod
    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        """The motion to the next meeting from a point, as the importer is asked for it."""

    def placed(self, starts: Vector) -> Vector:
        """Starts (m, n) brought onto the section where only rounding keeps them off it, as the engine does."""
        return starts

    def repeats(self, periods: Vector) -> Vector:
        """(m,) what the engine takes for the period: that of a step of a strobe, that of the forcing of the others."""
        return periods

    def missed(self, period: float) -> str:
        """The sentence that the section is not met, and how long it was waited for."""
        waited = f"{PATIENCE:g} periods, {PATIENCE * period:.6g} s" if self.forced else f"{PATIENCE * self.wait:g} s"
        return f"the section is not met within {waited}"


class Backend(Protocol):
    """The computation of the steps of a section.

    Attributes:
        pace: steps in the time that a run of the engine's series takes for one.
    """

    pace: int

    @property
    def how(self) -> str:
        """Where steps and derivatives come from, in words; empty for the engine."""
        ...

    def fresh(self) -> Self:
        """The same backend with nothing counted yet."""
        ...

    def step(
        self, section: SectionQuestions, points: Vector, varied: Mapping[str, Vector], *, derivative: bool
    ) -> Step:
        """One step of points (m, n)."""
        ...

    def run(self, section: SectionQuestions, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        """The rows of some jobs; ends soon where ``stop`` (1,) is set."""
        ...


@runtime_checkable
class DirectedBackend(Backend, Protocol):
    """A backend that tells the direction of a motion; the engine follows it by itself, and is not asked."""

    def along(self, section: SectionQuestions, points: Vector, varied: Mapping[str, Vector]) -> Vector:
        """(m, n) rates of the states at points (m, n)."""
        ...
