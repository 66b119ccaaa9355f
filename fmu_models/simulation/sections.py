"""Sections: the states of a motion at the instants at which one of them crosses a level.

The engine locates a crossing to rounding on the polynomial of its step (engine/step/section.c). A crossing exactly at
the start does not count; neither does a level that is touched only. Where an impact or another event makes the state
jump across, the crossing is the event, and the states are those after it.
"""

import math
import weakref
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.run import check_names, check_settings, check_span, check_tolerance

DIRECTIONS = (1, -1, 0)


@dataclass(frozen=True)
class Section:
    """Where a state crosses a level.

    Attributes:
        state: name of a state, a coordinate or a velocity.
        level: in the unit of the state.
        direction: 1 upward, -1 downward, 0 both.
    """

    state: str
    level: float = 0.0
    direction: int = 1

    def check(self, fmu: Fmu) -> None:
        """Raises StickslipError: the FMU has no such state, or level or direction are none."""
        check_names(fmu, "state", {self.state: None}, fmu.states)
        if not math.isfinite(self.level) or self.direction not in DIRECTIONS:
            raise StickslipError(
                f"A section is a finite level crossed in the direction 1 (upward), -1 (downward) or 0 (both), found "
                f"the level {self.level} in the direction {self.direction}."
            )


@dataclass(frozen=True)
class SectionPoint(Shown):
    """One of them.

    Attributes:
        time: s.
        states: values of the states by name.
        rates: their rates by name.
        contacts: state of each contact by name (keys of ``contact_kinds.CONTACT_STATES``).
    """

    time: float
    states: Mapping[str, float]
    rates: Mapping[str, float]
    contacts: Mapping[str, int]


class SectionFollower:
    """Follows one motion after the other to a section, with a single instance of the FMU."""

    def __init__(
        self,
        fmu: Fmu,
        section: Section,
        *,
        parameters: Mapping[str, float] | None = None,
        inputs: Mapping[str, float] | None = None,
        tolerance: float = 1e-14,
    ) -> None:
        """Arguments as for ``simulate``; inputs are constant. StickslipError: as there, or a section that is none."""
        section.check(fmu)
        check_tolerance(tolerance)
        parameters, inputs = dict(parameters or {}), dict(inputs or {})
        check_settings(fmu, "parameter", parameters, fmu.parameters)
        check_settings(fmu, "input", inputs, fmu.inputs)
        self.fmu, self.section, self.tolerance = fmu, section, tolerance
        self.constants = MappingProxyType({**parameters, **inputs})
        self._engine = engine_of(fmu)
        self._instance = self._engine.take()
        weakref.finalize(self, self._engine.give, self._instance)
        self._motions = 0
        rates, contacts = (f"der({name})" for name in fmu.states), (f"{name}_state" for name in fmu.contacts)
        recorded = ("time", *fmu.states, *rates, *contacts)
        self._recorded = np.array([fmu.variables[name].valueReference for name in recorded], dtype=np.uint32)
        self._section = whole_run.SectionRequest(
            fmu.variables[section.state].valueReference, float(section.level), section.direction
        )

    def follow(
        self, start: Mapping[str, float], stop_time: float, *, start_time: float = 0.0
    ) -> Iterator[SectionPoint]:
        """The crossings up to ``stop_time``, one after the other; the motion goes on only as far as they are asked for.
        StickslipError: unknown state, value out of its range, a stop that is not after the start, a motion that the
        engine cannot continue, or one that is asked for more after another one has begun."""
        fmu = self.fmu
        check_span(start_time, stop_time)
        check_settings(fmu, "state", start, [*fmu.states, *fmu.memories])
        self._motions += 1
        initial = {fmu.variables[name].valueReference: value for name, value in {**self.constants, **start}.items()}
        self._instance.restart(initial, start_time, self.tolerance)
        request = whole_run.Request(np.array([stop_time], dtype=float), self._recorded)
        return self._each(request, self._motions)

    def _each(self, request: whole_run.Request, motion: int) -> Iterator[SectionPoint]:
        n = len(self.fmu.states)
        for row in whole_run.crossings(self._engine, self._instance, request, self._section):
            time, *values = row.tolist()
            states, rates = (dict(zip(self.fmu.states, part, strict=True)) for part in (values[:n], values[n : 2 * n]))
            contacts = zip(self.fmu.contacts, map(round, values[2 * n :]), strict=True)
            yield SectionPoint(time, states, rates, dict(contacts))
            if motion != self._motions:
                raise StickslipError(
                    "Another motion has begun since; this one cannot go on. "
                    "Follow each with a SectionFollower of its own."
                )
