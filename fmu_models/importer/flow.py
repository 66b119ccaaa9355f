"""Motions of any FMU from one point to another: to a time or to where a state crosses a level, with the derivative of
where they arrive by where they begin, through the loop of the master.

The derivative follows the motion (importer/c/tangent.c). It is not known where an event moves the states, where several
indicators change at once, or along a sliding motion; whoever needs it there takes differences of motions.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request
from fmu_models.importer.driver import Driver
from fmu_models.importer.motion_error import RUN
from fmu_models.simulation.sections import Section

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Flow(Shown):
    """A motion from a point to another one.

    Attributes:
        time: s, at which it arrived.
        crossed: it arrived at the section, not at the end of the time.
        start, start_rates: (n,) states and their rates where it began, after what the FMU does at its start.
        states, rates: (n,) where it arrived.
        derivative: (n, n) of the states by those at the start, at a fixed time; nan where it is not known, empty where
            it was not asked for.
        slopes: (n, n) derivatives of the rates by the states where it began; as ``derivative``.
        indicators: (m,) of its events, where it arrived.
        recorded: (k,) what is read where it began.
        events: those of indicators on the way, in order: numbers of the indicators.
        misses: (m, 2) least value of each indicator on its side, of those with a minimum between events, and its time,
            s; infinite where there is none.
    """

    time: float
    crossed: bool
    start: Vector
    start_rates: Vector
    states: Vector
    rates: Vector
    derivative: Vector
    slopes: Vector
    indicators: Vector
    recorded: Vector
    events: tuple[int, ...] = ()
    misses: Vector = field(default_factory=lambda: np.empty((0, 2)))


class FlowDriver(Driver):
    """An FMU that is loaded once and followed from point to point.

    Args:
        fmu: for Model Exchange.
        tolerance: as for ``Driver``.
        record: names of variables that are read where a motion begins.

    Raises:
        StickslipError: as ``Driver`` does.
    """

    def __init__(self, fmu: Fmu, *, tolerance: float = 1e-12, record: Sequence[str] = ()) -> None:
        if fmu.description.modelExchange is None:
            raise StickslipError(
                f"'{fmu.path}' is followed through Model Exchange, with a method of integration; it offers "
                "Co-Simulation, which tells neither rates nor events."
            )
        computed = [n for n in fmu.states if fmu.variables[n].shape or not request.has_start(fmu.variables[n])]
        if computed or not fmu.states:
            raise StickslipError(
                f"A motion of '{fmu.path}' cannot be begun at given states: "
                + (f"the FMU computes '{computed[0]}', or it is an array." if computed else "it has none.")
            )
        # without a bound: runs at several tolerances tell the error only where the tolerance decides the steps
        super().__init__(fmu, tolerance=tolerance, record=record, max_step=math.inf)
        n = len(self._states)
        self._ends, self._tangents, self._slopes = np.zeros((4, n)), np.zeros((n, n)), np.zeros((n, n))
        self._room, self._pivots = np.zeros(20 * n * n + 4 * n), np.zeros(4 * n, np.int32)
        self._last, self._misses = np.zeros(len(self._indicators)), np.zeros((len(self._indicators), 2))
        self._blank.event_capacity = 0
        self._blank.indicators = request.address(self._last)
        self._blank.ends = request.address(self._ends)

    @property
    def directional(self) -> bool:
        """Whether the FMU offers directional derivatives."""
        return bool(self._instance.calls.directional)

    def follow(
        self,
        values: Mapping[str, float],
        start_time: float,
        stop_time: float,
        *,
        section: Section | None = None,
        derivative: bool = False,
        slopes: bool = False,
        told: bool = False,
    ) -> Flow:
        """The motion from the start time on, to the section or, if it is not met, to the stop time.

        Args:
            values: of parameters and states at the start; checked by the caller.
            start_time, stop_time: s.
            section: where it ends.
            derivative: follow it.
            slopes: make them, of a derivative that is followed.
            told: of events and misses.

        Raises:
            MotionError: the motion cannot be continued, or the FMU ends it; says when and why.
        """
        times = np.full(1 if self._recorded.names else 0, start_time)
        prepared = self._prepare(times, values, request.table(self.fmu, {}, start_time, stop_time), 0.0, 0.0)
        c = prepared.c
        c.start, c.stop = start_time, stop_time
        if section is not None:
            c.section_state = self._states.index(section.state) + 1
            c.section_level, c.section_direction = section.level, section.direction
        if derivative:
            c.tangents, c.tangent_room = request.address(self._tangents), request.address(self._room)
            c.tangent_pivots = request.address(self._pivots)
            c.slopes = request.address(self._slopes) if slopes else None
        if told:
            c.event_capacity, c.misses = len(self._events), request.address(self._misses)
        self._ends[:] = math.nan
        status, events = RUN.MORE, []
        while status == RUN.MORE:
            status = self._call(prepared)
            events += [event for event in self._events_of(c.n_events) if event.kind == "state"]
            c.n_events = 0
        if status not in (RUN.DONE, RUN.CROSSED):
            raise StickslipError(self._end(c)) if status == RUN.TERMINATED else self._error(status, c)
        tangent = np.empty((0, 0))
        if derivative:
            tangent = np.full_like(self._tangents, math.nan) if c.missed else self._tangents.copy()
        start, start_rates, states, rates = self._ends.copy()
        slope = self._slopes.copy() if slopes else np.empty((0, 0))
        return Flow(
            float(c.report_time), status == RUN.CROSSED, start, start_rates, states, rates, tangent, slope,
            self._last.copy(), prepared.values.ravel(),
            tuple(event.indicator for event in events), self._misses.copy(),
        )  # fmt: skip


def constants_of(fmu: Fmu) -> list[str]:
    """Names of the numbers that can be set for a motion and stay: parameters and inputs."""
    kinds = ("parameter", "input")
    return [n for n, v in fmu.variables.items() if v.causality in kinds and request.is_number(fmu, n)]
