"""The strobe of an oscillator: its states after each period of the forcing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import Flow
from fmu_models.sections.backend import Begin
from fmu_models.sections.importer import ImporterBackend
from fmu_models.sections.oscillator import FmuSection
from fmu_models.sections.point import Vector
from fmu_models.simulation.divergence import keeps_volumes, volume_change
from fmu_models.simulation.ensemble import KINDS, Where
from fmu_models.simulation.field import VectorField, is_forced

# the ratio that is farthest from those of whole numbers
GOLDEN = 0.5 * (1.0 + 5.0**0.5)


class Strobe(FmuSection):
    """The states after each period.

    Args:
        every: periods of the forcing in one step.
        autonomous: nothing forces the motion, ``period`` is how often it is looked at.
        others: of ``FmuSection``.
    """

    strobes = True

    def __init__(self, fmu: Fmu, *, every: int = 1, autonomous: bool = False, **others: Any) -> None:
        super().__init__(fmu, **others)
        self.every, self.autonomous = every, autonomous
        if not self.forced or every < 1:
            raise StickslipError(
                f"A strobe of '{self.name}' needs a period, and takes at least one a step. Name the parameter that is "
                "the frequency of its forcing (--forcing, forcing=), or give the period in s (--period, period=), with "
                "--autonomous, autonomous=True where nothing forces the motion."
            )
        if autonomous and self.forcing is not None:
            raise StickslipError(f"'{self.forcing}' forces the motion: it is not autonomous. Give period= in s.")

    def folded(self, times: int) -> Strobe:
        """So many steps of this one as one."""
        return Strobe(
            self.fmu,
            every=self.every * times,
            forcing=self.forcing,
            period=self.period,
            autonomous=self.autonomous,
            parameters=self.values,
            tolerance=self.tolerance,
            stepper=self.stepper,
        )

    def beside_periods(self, point: Vector) -> tuple[Strobe, float] | None:
        """Where nothing forces the motion at a point (n,), the same looked at more often, in no ratio to a period of
        whole steps, and how many times; None where something forces it."""
        if not self.autonomous:
            if self.forcing is not None or not self.fmu.ours:
                return None
            try:
                if is_forced(VectorField(self.fmu, self.values), point[: len(self.fmu.states)]):
                    return None
            except StickslipError:  # the point cannot be begun from
                return None
        period = self.every * float(self.period or 0.0) / GOLDEN
        settings = {"parameters": self.values, "tolerance": self.tolerance, "stepper": self.stepper}
        return Strobe(self.fmu, period=period, autonomous=True, **settings), GOLDEN

    def log_volumes(self, points: Vector) -> Vector | None:
        """Logarithms of volumes from the divergence of the rates, where no event changes volumes."""
        if not keeps_volumes(self.fmu):
            return None
        length = self.every * float(self.periods({}, 1)[0])
        return np.array([volume_change(self.fmu, length, **self.as_run(point)) for point in points])

    def flow(self, point: Vector) -> Flow:
        """The step of a third-party FMU from a point (n,), with its events and misses.

        Raises:
            StickslipError: it cannot be made.
        """
        assert isinstance(self.backend, ImporterBackend)
        departure = self.begin(point, self.values, float(self.periods({}, 1)[0]))
        return self.backend.flow(point, departure, events=True)

    def _phase(self, index: int) -> list[tuple[str, int]]:
        return []

    def repeats(self, periods: Vector) -> Vector:
        return self.every * periods

    def where(self) -> Where:
        return Where(KINDS.STROBE)

    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        return Begin(values, 0.0, self.every * period)
