"""The importer as a backend: steps of the sections of third-party FMUs.

Every step is a motion of its own from the states at its begin: what such an FMU remembers beside its states is as after
its initialization there. Derivatives follow the motion by the FMU's directional derivatives, or by differences of its
rates where it offers none. Where they are not known (an event that moves the states, several at once, a sliding motion)
they are central differences of steps.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from threading import Semaphore
from typing import Self

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Varied, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.families import stepwise
from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import Step
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import Flow, FlowDriver
from fmu_models.sections.point import Begin, FmuPoints
from fmu_models.simulation.rows import RunRows

# of the size of a number of a point: change of a start for a central difference, which loses two thirds of the digits
CHANGE = 1e-4
INSTANCES = 64  # of one FMU at a time: more threads wait


@dataclass(eq=False)
class ImporterBackend:
    """Steps of one FMU for Model Exchange; several threads may ask for them.

    Attributes:
        fmu: of anybody.
        tolerance: relative error of a step of the method of integration.
    """

    fmu: Fmu
    tolerance: float
    pace = 1
    together = 1
    _idle: list[FlowDriver] = field(default_factory=list)

    def __post_init__(self) -> None:
        driver = FlowDriver(self.fmu, tolerance=self.tolerance)
        self.directional = driver.directional
        self._idle.append(driver)
        only_one = self.fmu.description.modelExchange.canBeInstantiatedOnlyOncePerProcess  # type: ignore[union-attr]
        self._room = Semaphore(1 if str(only_one).lower() == "true" else INSTANCES)

    @property
    def how(self) -> str:
        """Where steps and their derivatives come from, in words."""
        by = "its directional derivatives" if self.directional else "differences of its rates"
        return f"steps by the importer, tangents by {by}, and by differences of motions where events move states"

    def fresh(self) -> Self:
        return self

    def step(self, section: FmuPoints, points: Vector, varied: Varied, *, derivative: bool) -> Step:
        """One step of points (m, n), one after the other."""
        (m, k), n = points.shape, len(section.fmu.states)
        points, periods = section.placed(points), section.periods(varied, m)
        ends, times = np.full((m, k), np.nan), np.full(m, np.nan)
        derivatives = np.full((m, k, k) if derivative else (m, 0), np.nan)
        why: dict[int, str] = {}
        for i in range(m):
            values = {**section.values, **{name: float(numbers[i]) for name, numbers in varied.items()}}
            departure = section.begin(points[i], values, float(periods[i]))
            try:
                flow = self.flow(points[i, :n], departure, derivative=derivative)
                if departure.section is not None and not flow.crossed:
                    why[i] = section.missed(float(periods[i]))
                    continue
                scale = np.append(np.ones(n), periods[i] or 1.0)
                ends[i] = np.append(flow.states, flow.time)[:k] / scale[:k]
                times[i] = flow.time - departure.time
                if derivative:
                    exact = self.derivative(points[i, :n], departure, flow, section.sizes()[:n])
                    derivatives[i] = (exact * scale / scale[:, None])[:k, :k]
            except StickslipError as error:
                ends[i], why[i] = np.nan, str(error)
        return Step.without_contacts(section.wrapped(ends), derivatives, times, why)

    def run(self, section: FmuPoints, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        return stepwise.run(section, jobs, stop)

    def along(self, section: FmuPoints, points: Vector, varied: Varied) -> Vector:
        """(m, n) rates of the states at points (m, n)."""
        periods = section.periods(varied, len(points))
        rates = np.zeros_like(points)
        for i, (point, period) in enumerate(zip(points, periods.tolist(), strict=True)):
            values = {**section.values, **{name: float(numbers[i]) for name, numbers in varied.items()}}
            departure = section.begin(point, values, period)
            flow = self.flow(point, replace(departure, latest=departure.time), derivative=True)
            rates[i] = flow.start_rates
        return rates

    @contextmanager
    def _driver(self) -> Iterator[FlowDriver]:
        with self._room:
            driver = self._idle.pop() if self._idle else FlowDriver(self.fmu, tolerance=self.tolerance)
            try:
                yield driver
            finally:
                self._idle.append(driver)

    def flow(self, x: Vector, departure: Begin, *, derivative: bool = False, events: bool = False) -> Flow:
        """The motion from states (n,), with its events and misses on request.

        Raises:
            StickslipError: it cannot be continued; says why.
        """
        values = {**departure.values, **dict(zip(self.fmu.states, x.tolist(), strict=True))}
        with self._driver() as driver:
            return driver.follow(
                values, departure.time, departure.latest, section=departure.section, derivative=derivative, told=events
            )

    def derivative(self, x: Vector, departure: Begin, flow: Flow, sizes: Vector) -> Vector:
        """(n + 1, n + 1) of the states and the time of the end, by those of the begin; sizes (n,) of the states.

        Raises:
            StickslipError: a motion beside this one does not arrive.
        """
        n = len(x)
        if not np.isfinite(flow.derivative).all() or not np.allclose(flow.start, x, rtol=1e-12, atol=0.0):
            return self._differences(x, departure, flow, sizes)
        matrix = np.zeros((n + 1, n + 1))
        # a motion that begins later from these states is, at first, one from states that are behind by their rates
        matrix[:n, :n], matrix[:n, n] = flow.derivative, -flow.derivative @ flow.start_rates
        if departure.section is not None:
            bound = self.fmu.states.index(departure.section.state)
            matrix[n] = -matrix[bound] / flow.rates[bound]
            matrix[:n] += np.outer(flow.rates, matrix[n])
        return matrix

    def _differences(self, x: Vector, departure: Begin, flow: Flow, sizes: Vector) -> Vector:
        n = len(x)
        matrix = np.zeros((n + 1, n + 1))
        bound = self.fmu.states.index(departure.section.state) if departure.section is not None else -1
        for j in (j for j in range(n + (departure.period > 0.0)) if j != bound):
            change = CHANGE * (sizes[j] if j < n else departure.period)
            moved = np.zeros(n + 1)
            moved[j] = change
            matrix[:, j] = (self._end(x, departure, moved) - self._end(x, departure, -moved)) / (2.0 * change)
        if bound >= 0:
            # a start farther along its motion arrives at the same point
            along = np.append(flow.start_rates, 1.0)
            matrix[:, bound] = -(matrix @ along - matrix[:, bound] * along[bound]) / along[bound]
        return matrix

    def _end(self, x: Vector, departure: Begin, moved: Vector) -> Vector:
        """(n + 1,) where a motion beside another one arrives, and when; a period later, before which no time lies."""
        n = len(x)
        by = departure.period + float(moved[n])
        late = departure.latest + (by if departure.section is not None else departure.period)
        beside = replace(departure, time=departure.time + by, latest=late)
        flow = self.flow(x + moved[:n], beside)
        if departure.section is not None and not flow.crossed:
            raise StickslipError("a motion beside this one does not come to the section")
        return np.append(flow.states, flow.time)

    def __reduce__(self) -> tuple[object, ...]:
        # another process loads the FMU for itself
        return ImporterBackend, (self.fmu, self.tolerance)
