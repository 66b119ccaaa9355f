"""Oscillators at a section: once per period, at a level of a state, at a contact. See ``fmu_points`` for points.

Strobe      the states after each period of the forcing
Crossing    the states where one of them crosses a level
Impacts     the states right after a contact begins (an impact, the touch of a stop, the begin of stick), or ends
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_models.analyses.fmu_points import Vector
from fmu_models.analyses.fmu_section import ON_LEVEL, PATIENCE, FmuSection
from fmu_models.analyses.importer_steps import Begin
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import Flow
from fmu_models.simulation.divergence import keeps_volumes, volume_change
from fmu_models.simulation.ensemble import KINDS, Where
from fmu_models.simulation.field import Field, is_forced
from fmu_models.simulation.run import check_names
from fmu_models.simulation.sections import Section

# the ratio that is farthest from those of whole numbers
GOLDEN = 0.5 * (1.0 + 5.0**0.5)


class Strobe(FmuSection):
    """The states after each period.

    Args:
        every: periods of the forcing in one step.
        autonomous: nothing forces the motion, ``period`` is how often it is looked at.
        others: of ``FmuSection``.
    """

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
                if is_forced(Field(self.fmu, self.values), point[: len(self.fmu.states)]):
                    return None
            except StickslipError:  # the point cannot be begun from
                return None
        period = self.every * float(self.period or 0.0) / GOLDEN
        given = {"parameters": self.values, "tolerance": self.tolerance, "stepper": self.stepper}
        return Strobe(self.fmu, period=period, autonomous=True, **given), GOLDEN

    def log_volumes(self, points: Vector) -> Vector | None:
        """By the divergence of the rates, where no event changes volumes."""
        if not keeps_volumes(self.fmu):
            return None
        length = self.every * float(self.periods({}, 1)[0])
        return np.array([volume_change(self.fmu, length, **self.as_run(point)) for point in points])

    def told(self, point: Vector) -> Flow:
        """The step of an FMU of others from a point (n,), with its events and misses.

        Raises:
            StickslipError: it cannot be made.
        """
        assert self._importer is not None
        begin = self._begin(point, self.values, float(self.periods({}, 1)[0]))
        return self._importer.flow(point, begin, told=True)

    def _phase(self, place: int) -> list[tuple[str, int]]:
        return []

    @property
    def _strobes(self) -> bool:
        return True

    def _repeats(self, periods: Vector) -> Vector:
        return self.every * periods

    def _where(self) -> Where:
        return Where(KINDS.STROBE)

    def _begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        return Begin(values, 0.0, self.every * period)


class Crossing(FmuSection):
    """The states where one of them crosses a level.

    Args:
        state, level: name of a state, and a value in its unit.
        direction: 1 upward, -1 downward, 0 both.
        others: of ``FmuSection``; what is forced must say so.
    """

    def __init__(self, fmu: Fmu, state: str, level: float = 0.0, direction: int = 1, **others: Any) -> None:
        super().__init__(fmu, **others)
        Section(state, level, direction).check(fmu)
        self.state, self.level, self.direction = state, float(level), direction

    @property
    def dimension(self) -> int:
        """The level binds one of the states; the phase counts instead where there is one."""
        return len(self.fmu.states) - (not self.forced)

    def _placed(self, starts: Vector) -> Vector:
        column = self.states.index(self.state)
        near = np.abs(starts[:, column] - self.level) <= ON_LEVEL * self.sizes()[column]
        placed = starts.copy()
        placed[near, column] = self.level
        return placed

    def _where(self) -> Where:
        return Where(KINDS.LEVEL, self.fmu.variables[self.state].valueReference, self.level, self.direction)

    def _begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        time = float(point[-1]) * period if self.forced else 0.0
        section = Section(self.state, self.level, self.direction)
        return Begin(values, time, time + PATIENCE * (period or 1.0), section, period)


class Impacts(FmuSection):
    """The states right after a contact begins: an impact, the touch of a stop, the begin of stick.

    Args:
        contact: its name.
        ends: where it ends instead.
        others: of ``FmuSection``; what is forced must say so.
    """

    def __init__(self, fmu: Fmu, contact: str, *, ends: bool = False, **others: Any) -> None:
        if not fmu.ours:
            raise StickslipError(
                f"'{fmu.description.modelName}' is not of this suite and tells no contacts. Take a level of a state, "
                "as the gap where it is one, or a strobe."
            )
        super().__init__(fmu, **others)
        check_names(fmu, "contact", {contact: None}, fmu.contacts)
        self.contact, self.ends = contact, ends

    @property
    def dimension(self) -> int:
        """The contact binds one of the states to the phase."""
        return len(self.fmu.states) - (not self.forced)

    def _where(self) -> Where:
        return Where(KINDS.END if self.ends else KINDS.BEGIN, contact=self.contacts.index(self.contact))

    def _begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        raise StickslipError(f"'{self.name}' is not of this suite: it has no contacts to be seen at.")
