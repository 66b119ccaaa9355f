"""Whole runs with exact derivatives by parameters, start states and inputs, through all their events.

The engine carries the derivatives along with the motion (engine/tangents/tangent.c): variational equation and saltation
in one, derived from the model's own arithmetic; no finite differences. Its instance is kept, so that many short runs
cost little more than their steps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown, Tabular
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import EngineInstance, engine_of
from fmu_models.simulation.run import check_names, check_span, check_tolerance, checked_times, facts_of, settings_of
from fmu_models.simulation.trajectory import Events

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class Sensitivity(Tabular):
    """A run and its derivatives, at the time of an event those after it.

    Attributes:
        time: (n,) s.
        names: of the states, memories of stops and outputs recorded.
        values: (n, n_names), in the unit of each.
        by: names of the m directions: parameters, start states, speeds of entry, constants added to inputs.
        derivative: (n, n_names, m) d value / d direction at a fixed time.
        events: every change of contact state and every impact, in order of time.
        event_derivative: (k, m) d event time / d direction, s per unit; nan for the end of a chatter, of whose time
            none is known.
        steps: that the engine made.
        seconds: wall time of the engine, s.
        one_sided: several events came at one instant, at times that depend on a direction in different ways (a corner):
            the derivatives hold for the neighbours on one side, whose events come in the order of the contacts.
        passage: rates of the states at the times, speeds of events; None where it was not asked for.
    """

    time: Vector
    names: tuple[str, ...]
    values: Vector
    by: tuple[str, ...]
    derivative: Vector
    events: Events
    event_derivative: Vector
    steps: int
    seconds: float
    one_sided: bool = False
    passage: whole_run.Passage | None = None

    @property
    def frame(self) -> pandas.DataFrame:
        """Values and derivatives as columns of a table indexed by time (s); a derivative is called "d x/d k"."""
        import pandas

        columns = {name: self[name] for name in self.names}
        slopes = {f"d {name}/d {by}": self.of(name)[:, i] for name in self.names for i, by in enumerate(self.by)}
        return pandas.DataFrame(columns | slopes, index=pandas.Index(self.time, name="time"))

    def _heading(self) -> str:
        counts = f"{len(self.time)} times, {len(self.events)} events"
        return f"Sensitivity of {', '.join(self.names)} to {', '.join(self.by)}: {counts}"

    def __getitem__(self, name: str) -> Vector:
        """(n,) values of one of ``names``."""
        return self.values[:, self._column(name)]

    def of(self, name: str) -> Vector:
        """(n, m) derivatives of one of ``names``."""
        return self.derivative[:, self._column(name)]

    def _column(self, name: str) -> int:
        refuse_unknown(name, self.names, f"The run has not recorded '{name}'.")
        return self.names.index(name)


@dataclass(frozen=True, eq=False)
class RunWindow:
    """Times and inputs that runs have in common. request: of each; start_time: s; driven: first values of the inputs,
    by reference."""

    request: whole_run.Request
    start_time: float
    driven: Mapping[int, float]


class SensitiveRun(Shown):
    """An instance of an FMU of this suite, kept for any number of runs; a context manager.

    Args:
        by: what to differentiate by: parameters, states (their start values), inputs (a constant added to the input),
            and ``<stop>_memory``, the speed at which a stop was entered before the start.
        recorded: states, outputs and ``<stop>_memory``; default all states.
        passage: Tell what runs pass, too.
        tolerance: relative local error of a step, of motion and derivatives. Looser ones are followed, unlike those of
            ``simulate``: 1e-10 takes half the time where steps are many.

    Raises:
        StickslipError: unknown or repeated names, or an FMU of somebody else.
    """

    def __init__(
        self,
        fmu: Fmu,
        *,
        by: Sequence[str],
        recorded: Sequence[str] | None = None,
        passage: bool = False,
        tolerance: float = 1e-14,
    ) -> None:
        self.fmu, self.by, self.tolerance = fmu, tuple(by), float(tolerance)
        self.recorded = tuple(fmu.states if recorded is None else recorded)
        check_tolerance(self.tolerance)
        self._contacts, self._rigid = fmu.contacts, set(fmu.impacts)
        states = [*fmu.states, *fmu.memories]
        check_names(fmu, "parameter, state or input", dict.fromkeys(by), [*fmu.parameters, *states, *fmu.inputs])
        check_names(fmu, "state or output", dict.fromkeys(self.recorded), [*states, *fmu.outputs])
        for kind, names in (("differentiated by", self.by), ("recorded", self.recorded)):
            if repeated := sorted({name for name in names if names.count(name) > 1}):
                raise StickslipError(f"'{repeated[0]}' is to be {kind} twice. Name it once.")
        if not self.by:
            raise StickslipError("Name at least one parameter, state or input to differentiate by; or use simulate.")
        variables = fmu.variables
        self._references = np.array([variables[name].valueReference for name in self.recorded], dtype=np.uint32)
        directions = np.array([variables[name].valueReference for name in self.by], dtype=np.uint32)
        self._engine = engine_of(fmu)
        self._instance: EngineInstance | None = self._engine.take()
        told = len(fmu.states) if passage else None
        self._differentiator = whole_run.Differentiator(self._engine, self._instance, directions, told)

    def _contents(self) -> dict[str, object]:
        return {"model": self.fmu.description.modelName, "by": self.by, "recorded": self.recorded}

    def __enter__(self) -> SensitiveRun:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the instance back; no run afterwards."""
        if self._instance is not None:
            self._engine.give(self._instance)
            self._instance = None

    def run(
        self,
        output_times: ArrayLike,
        *,
        start_time: float = 0.0,
        parameters: Mapping[str, float] | None = None,
        start: Mapping[str, float] | None = None,
        inputs: Mapping[str, Any] | None = None,
    ) -> Sensitivity:
        """A run from ``start_time`` (s) to the last of ``output_times`` (n,) s, whatever the run before it was.

        Args:
            parameters, start, inputs: as for ``simulate``; what is not given has the default of the FMU.

        Raises:
            StickslipError: as for ``simulate``; or the motion has no derivative, because it touches the bound of a
                contact without crossing it.
        """
        return self.over(self.window(output_times, start_time=start_time, inputs=inputs), parameters, start)

    def window(
        self, output_times: ArrayLike, *, start_time: float = 0.0, inputs: Mapping[str, Any] | None = None
    ) -> RunWindow:
        """What any number of runs over the same times have in common; errors as for ``run``."""
        times = np.ascontiguousarray(output_times, dtype=float)
        if not math.isfinite(start_time):
            raise StickslipError(f"The start time must be a finite number of seconds, found {start_time:g}.")
        times = checked_times(times, start_time, math.inf)
        span = start_time, float(times[-1])
        first, table = settings_of(self.fmu, facts_of(self.fmu), span, (None, None, inputs))
        return RunWindow(whole_run.Request(times, self._references, table), start_time, first)

    def over(
        self, window: RunWindow, parameters: Mapping[str, float] | None, start: Mapping[str, float] | None
    ) -> Sensitivity:
        """The run over a window; errors as for ``run``."""
        result, derivatives, event_derivatives, one_sided = self._differentiator.run(
            window.request, self._initial(window, parameters, start), window.start_time, self.tolerance
        )
        events = Events(result.events, self._contacts, self._rigid), event_derivatives
        recorded = window.request.times, self.recorded, result.values, self.by, derivatives
        passage = self._differentiator.passage
        return Sensitivity(*recorded, *events, result.steps, result.seconds, one_sided, passage)

    def values(
        self, window: RunWindow, parameters: Mapping[str, float] | None, start: Mapping[str, float] | None
    ) -> tuple[Vector, Events]:
        """(n, n_names) values of the run over a window, and its events, without derivatives: a small part of the cost.

        Errors as for ``simulate``.
        """
        initial = self._initial(window, parameters, start)
        assert self._instance is not None
        begin = initial, window.start_time, self.tolerance
        result = whole_run.run(self._engine, self._instance, begin, *window.request)
        return result.values, Events(result.events, self._contacts, self._rigid)

    def _initial(
        self, window: RunWindow, parameters: Mapping[str, float] | None, start: Mapping[str, float] | None
    ) -> dict[int, float]:
        """Start values by reference."""
        if self._instance is None:
            raise StickslipError("The runs of this FMU are closed. Open a SensitiveRun again.")
        span = window.start_time, window.start_time
        initial, _ = settings_of(self.fmu, facts_of(self.fmu), span, (parameters, start, None))
        return {**initial, **window.driven}


@dataclass(frozen=True, eq=False)
class FlowDerivative(Shown):
    """Where a motion arrives, and how that depends on where it began.

    Attributes:
        states: names of the states, in the order of rows and columns below; of a motion that was given the speed at
            which it had entered a stop, also the memories of these.
        end: (n,) states at the end.
        by_start: (n, n) d end / d start; over a period of a periodic motion its monodromy matrix.
        by_parameter: per parameter asked for (n,) d end / d parameter, start states held.
        one_sided: the motion passes a corner, as for ``Sensitivity``.
    """

    states: tuple[str, ...]
    end: Vector
    by_start: Vector
    by_parameter: Mapping[str, Vector]
    one_sided: bool = False


def flow_derivative(
    fmu: Fmu,
    stop_time: float,
    *,
    start_time: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    by: Sequence[str] = (),
    tolerance: float = 1e-14,
) -> FlowDerivative:
    """End states of a run and their derivatives.

    Args:
        parameters, start, inputs: as for ``simulate``.
        by: parameters to differentiate by.

    Raises:
        StickslipError: as for ``simulate``; or the motion has no derivative, because it touches the bound of a contact
            without crossing it.
    """
    check_span(start_time, stop_time)
    check_names(fmu, "parameter", dict.fromkeys(by), fmu.parameters)
    states = (*fmu.states, *(name for name in fmu.memories if name in (start or {})))
    with SensitiveRun(fmu, by=[*states, *by], recorded=states, tolerance=tolerance) as sensitive_run:
        sensitivity = sensitive_run.run(
            [stop_time], start_time=start_time, parameters=parameters, start=start, inputs=inputs
        )
    end, derivative, n = sensitivity.values[0], sensitivity.derivative[0], len(states)
    by_parameter = dict(zip(by, derivative[:, n:].T.copy(), strict=True))
    return FlowDerivative(states, end, derivative[:, :n].copy(), by_parameter, sensitivity.one_sided)
