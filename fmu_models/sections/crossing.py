"""An oscillator seen at events: where one of its states crosses a level, or right after a contact begins or ends."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fmu_models.base.arrays import Flags
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.oscillator import ON_LEVEL, FmuSection
from fmu_models.sections.point import PATIENCE, Begin, Vector
from fmu_models.simulation.ensemble import KINDS, Where
from fmu_models.simulation.run import check_names
from fmu_models.simulation.sections import Section


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
    def free(self) -> Flags:
        return super().free & (np.array(self.states) != self.state)

    def placed(self, starts: Vector) -> Vector:
        column = self.states.index(self.state)
        close = np.abs(starts[:, column] - self.level) <= ON_LEVEL * self.sizes()[column]
        placed = starts.copy()
        placed[close, column] = self.level
        return placed

    def where(self) -> Where:
        return Where(KINDS.LEVEL, self.fmu.variables[self.state].valueReference, self.level, self.direction)

    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        time = float(point[-1]) * period if self.forced else 0.0
        section = Section(self.state, self.level, self.direction)
        return Begin(values, time, time + PATIENCE * (period or self.wait), section, period)


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

    def where(self) -> Where:
        return Where(KINDS.END if self.ends else KINDS.BEGIN, contact=self.contacts.index(self.contact))

    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        raise StickslipError(f"'{self.name}' is not of this suite: it has no contacts to be seen at.")
