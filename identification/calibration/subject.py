"""What is calibrated: a model that is run over stretches of logs, with the derivatives of what it shows.

An FMU of this suite carries exact tangents through its events (fmu_models.simulation.sensitivity); runs of any other
model are differenced (`systems`).
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contact_kinds import TOUCHING
from fmu_models.simulation.field import FieldRates, VectorField
from fmu_models.simulation.run import KeptRun
from fmu_models.simulation.sensitivity import RunWindow, SensitiveRun
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Event, Trajectory

Vector = NDArray[np.float64]
Inputs = Mapping[str, float | Signal]

NONE = np.empty((0, 0, 0))  # slopes that were not asked for
HALF = 5  # samples to either side that a parabola joins
# of runs with tangents: slopes to 1e-9 for three quarters of the time of all that rounding allows
TOLERANCE, EXACT = 1e-11, 1e-14
KINEMATIC = 1e-9  # relative: so near to the rate of a state another one is that rate


@dataclass(frozen=True, eq=False)
class Window:
    """Where runs are read. start_time: s; times: (n,) s of output; inputs: constant or Signal. What a subject prepares
    for a window serves all runs over it."""

    start_time: float
    times: Vector
    inputs: Inputs


@dataclass(frozen=True, eq=False)
class Stretch:
    """A run to be made. values: parameters; start: states."""

    window: Window
    values: Mapping[str, float]
    start: Mapping[str, float]

    @property
    def asked(self) -> dict[str, Any]:
        """The run as those of all kinds take it."""
        window = self.window
        begin = {"start_time": window.start_time, "parameters": self.values, "start": self.start}
        return {"stop_time": float(window.times[-1]), "output_times": window.times, "inputs": window.inputs, **begin}


@dataclass(frozen=True, eq=False)
class Response:
    """A run, with its derivatives where these were asked for. values: (n, k) of what is recorded; slopes: (n, k, m) by
    the unknowns; met: contacts that had an event; hits: by contact that is timed, (h,) s, times at which it began to
    touch or to slip, with (h, m) slopes."""

    values: Vector
    slopes: Vector = field(default_factory=lambda: NONE)
    met: frozenset[str] = frozenset()
    hits: Mapping[str, tuple[Vector, Vector]] = field(default_factory=dict)


class Subject(ABC):
    """A model whose runs are compared with logs.

    fmu: it; by: parameters, then start states, by which is differentiated; recorded: states, then measured
    variables; timed: contacts whose events are.
    """

    note = ""
    half = HALF  # samples to either side that a parabola may join; 0 of a map, whose iterates no smooth motion joins
    _made_from: tuple[Any, ...]

    def __new__(cls, *made_from: Any) -> Self:
        subject = super().__new__(cls)
        subject._made_from = made_from
        return subject

    def __reduce__(self) -> tuple[Any, ...]:
        # instances of an engine stay where they are: another process makes its own
        return type(self), self._made_from

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        self.fmu, self.states, self.contacts = fmu, tuple(fmu.states), ()
        self.timed = tuple(name for name in measured if name in fmu.contacts)
        measured = [name for name in measured if name not in self.timed]
        self.parameters = tuple(parameters)
        self.by = (*self.parameters, *self.states)
        self.recorded = tuple(dict.fromkeys((*self.states, *measured)))

    @abstractmethod
    def trajectory(self, stretch: Stretch) -> Trajectory:
        """The run alone. StickslipError: it cannot be made."""

    @abstractmethod
    def respond(self, stretch: Stretch) -> Response:
        """The run with its derivatives by ``by``; errors as in `trajectory`."""

    def check(self, time: Vector) -> None:
        """Refuse times (n,) of a log at which there is nothing to compare. StickslipError: a map has no value between
        its iterates."""
        broken = np.flatnonzero(time != np.round(time))
        if not self.half and broken.size:
            raise StickslipError(
                f"The times of a map number its iterates: whole numbers; found {time[broken[0]]:g} in sample "
                f"{broken[0] + 1}."
            )

    def closed(self, stretch: Stretch) -> bool:
        """Whether the motion cannot begin here without a memory: in a stop, or behind a wall."""
        return False

    def refusal(self, stretch: Stretch) -> str:
        """Why no motion can begin here, such as parameters that exclude each other; empty where nothing says so."""
        return ""

    def shown(self, stretch: Stretch) -> Response:
        """The run without derivatives; errors as in `trajectory`."""
        run = self.trajectory(stretch)
        values = np.column_stack([run[name] for name in self.recorded])
        if len(values) < len(stretch.window.times) or not np.isfinite(values).all():
            raise StickslipError(f"The run of '{self.fmu.description.modelName}' ended early.")
        return Response(values, hits=self._hits(run.events))

    def _hits(self, events: Iterable[Event]) -> dict[str, tuple[Vector, Vector]]:
        """Times s at which each contact that is timed began to touch or to slip."""
        listed = [(event.contact, event.time) for event in events if is_hit(event)] if self.timed else []
        return {name: (np.array([time for contact, time in listed if contact == name]), NONE) for name in self.timed}

    def rates(self, stretch: Stretch) -> dict[str, str]:
        """Which states are rates of others, seen in a run: the position's name -> the speed's."""
        run = self.trajectory(stretch)
        speeds = {}
        for name in self.states:
            rate = run.values.get(self.rate_name(name))
            size = 0.0 if rate is None else float(np.max(np.abs(rate), initial=0.0))
            for other in self.states:
                if rate is not None and size > 0 and np.max(np.abs(run[other] - rate)) <= KINEMATIC * size:
                    speeds[name] = other
        return speeds

    def rate_name(self, state: str) -> str:
        """The variable that is the rate of a state."""
        return f"der({state})"


class OwnSubject(Subject):
    """An FMU of this suite, by its own engine."""

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        self.contacts = tuple(fmu.contacts)
        self._kept, self._field = KeptRun(fmu), VectorField(fmu, {})
        self._windows: WeakKeyDictionary[Window, RunWindow] = WeakKeyDictionary()
        # times of events are followed along whole motions, which may be chaotic
        tolerance = EXACT if self.timed else TOLERANCE
        self._sensitive = SensitiveRun(fmu, by=self.by, recorded=self.recorded, tolerance=tolerance)
        compliant = set(fmu.contacts) - set(fmu.impacts)
        self._stops = [place for place, name in enumerate(fmu.contacts) if name in compliant]

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return self._kept(**stretch.asked)

    def _window(self, window: Window) -> RunWindow:
        if window not in self._windows:
            begin = {"start_time": window.start_time, "inputs": window.inputs}
            self._windows[window] = self._sensitive.window(window.times, **begin)
        return self._windows[window]

    def shown(self, stretch: Stretch) -> Response:
        values, events = self._sensitive.values(self._window(stretch.window), stretch.values, stretch.start)
        return Response(values, hits=self._hits(events))

    def respond(self, stretch: Stretch) -> Response:
        run = self._sensitive.over(self._window(stretch.window), stretch.values, stretch.start)
        hits = {}
        for contact in self.timed:
            rows = [place for place, event in enumerate(run.events) if event.contact == contact and is_hit(event)]
            hits[contact] = np.array([run.events[row].time for row in rows]), run.event_derivative[rows]
        met = frozenset(self.contacts[number] for number in set(run.events.rows["contact"].tolist()))
        return Response(run.values, run.derivative, met, hits)

    def closed(self, stretch: Stretch) -> bool:
        try:
            there = self._begun(stretch)
        except StickslipError:
            return True
        return any(there.contacts[place] == TOUCHING for place in self._stops)

    def refusal(self, stretch: Stretch) -> str:
        try:
            self._begun(stretch)
        except StickslipError as error:
            return str(error)
        return ""

    def _begun(self, stretch: Stretch) -> FieldRates:
        """Where the motion begins."""
        values = dict(stretch.values)
        for name, value in stretch.window.inputs.items():
            at = np.array([stretch.window.start_time])
            values[name] = float(value.piece(at)[0][0]) if isinstance(value, Signal) else value
        return self._field.at([stretch.start[name] for name in self.states], values, stretch.window.start_time)


def is_hit(event: Event) -> bool:
    """Whether a contact begins to touch or to slip: what is heard of it."""
    return event.clock in ("impact", "slip")
