"""The calls that make a whole run: what is asked of an instance, and what it gives."""

from collections.abc import Callable, Iterator, Mapping
from ctypes import Structure, addressof, c_char
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Vector
from fmu_models.simulation.engine import EVENT, RUN, C, Engine, EngineInstance, address
from fmu_models.simulation.signal import Knots

SIDES = 256  # instants with events per call whose sides are recorded
ALLOWANCE = 20000  # steps per call, some 50 ms: how long an interrupt from the keyboard waits

_DONE, _MORE = RUN.DONE, RUN.MORE
_EVENT_SIZE = EVENT.itemsize
_AT: Callable[[Any], c_char] = c_char.from_buffer
_PACK = C.packing("WholeRun", "start", "n_events").pack_into
_WholeRun = C.structure("WholeRun")
_RunStart = C.structure("RunStart")
_SensitivityRun = C.structure("SensitivityRun")
NEAR_MISS = np.dtype(C.structure("NearMiss"))
NEAR_MISSES = 1 << 14  # as many as a run of some thousand events can have; memory not written to costs nothing


class Request(NamedTuple):
    """The request of a run.

    Attributes:
        times: (n,) s, of output.
        references: (m,) of the variables to record.
        inputs: references (k,) of inputs that change with time, and their table of ``signal.knots``.
        sides: whether both sides of events are recorded.
    """

    times: Vector
    references: NDArray[np.uint32]
    inputs: tuple[NDArray[np.uint32], Knots] | None = None
    sides: bool = False


@dataclass(frozen=True)
class SectionRequest:
    """A level of the state ``reference`` and the direction of its crossings: 1 upward, -1 downward, 0 both."""

    reference: int
    level: float
    direction: int


class Result(NamedTuple):
    """What came of it: values (n, m), events (k,) of dtype EVENT, counters of the engine, and its wall time in s.

    sides: (j, 2, 1 + m) time and values before and after events; None if they were not asked for.
    """

    values: Vector
    events: NDArray
    steps: int
    evaluations: int
    seconds: float
    sides: Vector | None = None


def run(
    engine: Engine, instance: EngineInstance, begin: tuple[Mapping[int, float], float, float] | None, times: Vector,
    references: NDArray[np.uint32], inputs: tuple[NDArray[np.uint32], Knots] | None = None, sides: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Result:  # fmt: skip
    """Make the run of a ``Request``, part by part, from ``EngineInstance.start`` of what it begins with, or from where
    the instance is. StickslipError: the engine refuses the start, or cannot continue the motion.

    After other work every function and module that a short run enters costs it as much as ten lines.
    """
    values = np.empty((times.size, references.size))
    c, call, handle, buffer = instance.whole_run, engine.simulate, instance.handle, instance.event_bytes
    room = np.full((SIDES, 2, 1 + references.size), np.nan) if sides else None
    _fill(c, times, references, values, inputs, room, 0 if begin is None else instance.start(*begin))
    chunks, parts, seconds, status = [], [], 0.0, _MORE
    while status == _MORE:
        c.n_events = c.n_sides = 0
        started = perf_counter()
        status = call(handle, c)
        seconds += perf_counter() - started
        # as bytes: numpy copies structures one by one
        chunks.append(np.frombuffer(bytearray(buffer[: c.n_events * _EVENT_SIZE]), EVENT))
        if room is not None:
            parts.append(room[: c.n_sides].copy())
        if progress:
            progress(c.next_time / max(1, len(values)))
    if status != _DONE:
        raise instance.failure()
    events = chunks[0] if len(chunks) == 1 else np.concatenate(chunks)
    both = np.concatenate(parts) if parts else None
    return tuple.__new__(Result, (values, events, c.steps, c.evaluations, seconds, both))  # by names it takes a us more


def crossings(engine: Engine, instance: EngineInstance, request: Request, section: SectionRequest) -> Iterator[Vector]:
    """Rows (m,) of the values recorded at one crossing after the other; the run goes on only as far as it is iterated.
    StickslipError: the engine cannot continue the motion."""
    values = np.empty((request.times.size, request.references.size))
    row = np.empty(request.references.size)
    c = structure(request, values, instance)
    c.crossings = row.ctypes.data
    c.crossing_capacity = 1
    c.crossing_state, c.level, c.direction = section.reference, section.level, section.direction
    for _ in _calls(engine.simulate, instance, c, c):
        if c.n_crossings:
            yield row.copy()
        c.n_crossings = 0


def _calls(
    call: Callable[[int, Any], int], instance: EngineInstance, c: Structure, run_structure: Structure
) -> Iterator[float]:
    """Call the engine until its run is done, and tell how long each call took, s."""
    status = _MORE
    while status == _MORE:
        run_structure.n_events = run_structure.n_sides = 0
        started = perf_counter()
        status = call(instance.handle, c)
        yield perf_counter() - started
    if status != _DONE:
        raise instance.failure()


class Passage(NamedTuple):
    """What a run with derivatives tells beside its values, of n states, k events and j near misses.

    Attributes:
        rates: (n_times, n) of the states.
        speeds, speed_derivatives: (k,), (k, m) at which the indicator of each event fell, per second; nan where it has
            none.
        misses: (j,) of dtype NEAR_MISS: where pending indicators came nearest to zero, by contact and time.
        miss_derivatives: (j, m) of their values.
    """

    rates: Vector
    speeds: Vector
    speed_derivatives: Vector
    misses: NDArray[Any]
    miss_derivatives: Vector


class _Details:
    """Where the engine writes what makes a ``Passage``."""

    def __init__(self, events: int, directions: int, states: int) -> None:
        self.speeds, self.speed_derivatives = np.empty(events), np.empty((events, directions))
        self.misses, self.derivatives = np.empty(NEAR_MISSES, NEAR_MISS), np.empty((NEAR_MISSES, directions))
        self.states = states
        self.seen: list[tuple[Vector, Vector]] = []

    def ask(self, c: Structure, rows: int) -> None:
        """Have the engine write here; forget what was."""
        self.rates = np.empty((rows, self.states))
        self.seen = []
        c.misses.count = c.misses.pending = 0
        c.rates, c.event_speeds = self.rates.ctypes.data, self.speeds.ctypes.data
        c.event_speed_derivatives = self.speed_derivatives.ctypes.data
        c.misses.capacity, c.misses.list = len(self.misses), self.misses.ctypes.data
        c.misses.derivatives = self.derivatives.ctypes.data

    def keep(self, events: int) -> None:
        """Keep the derivatives of the events of a part of the run."""
        self.seen.append((self.speeds[:events].copy(), self.speed_derivatives[:events].copy()))

    def passage(self, c: Structure) -> Passage:
        n = min(int(c.misses.count), len(self.misses))
        speeds, changes = (np.concatenate(column) for column in zip(*self.seen, strict=True))
        return Passage(self.rates, speeds, changes, self.misses[:n].copy(), self.derivatives[:n].copy())


class Differentiator:
    """Runs of one instance with their derivatives by the variables ``directions``, memory kept from run to run.

    Args:
        states: how many the model has, if every run is to be told with its ``passage``.
    """

    def __init__(
        self, engine: Engine, instance: EngineInstance, directions: NDArray[np.uint32], states: int | None = None
    ) -> None:
        self._engine, self._instance, self._directions = engine, instance, directions
        events = instance.whole_run.event_capacity
        self._details = None if states is None else _Details(events, directions.size, states)
        self.passage: Passage | None = None
        self._event_derivatives = np.empty((events, directions.size))
        self._room = np.empty(int(engine.sensitivity_room(directions.size)) // 8 + 2)
        self._request = c = _SensitivityRun(
            n_directions=directions.size,
            directions=address(directions),
            event_derivatives=address(self._event_derivatives),
            room=address(self._room),
        )
        self._run = c.run  # which is part of it
        self._run.event_capacity, self._run.events = events, instance.whole_run.events
        self._allowance = max(1, ALLOWANCE // (4 * (1 + directions.size)))  # a tangent costs as much as four runs

    def run(
        self,
        request: Request,
        initial: Mapping[int, float],
        start_time: float,
        tolerance: float,
        seeds: Vector | None = None,
    ) -> tuple[Result, Vector, Vector, bool]:
        """The run from these start values by reference.

        Args:
            seeds: (k, n) mixtures of the states, which the first k directions are along instead; nothing may hold at
                the start.

        Returns:
            the run; derivatives of its values (n, m, n_directions) and of the times of its events (k, n_directions);
            whether they are one-sided.

        Raises:
            StickslipError: the engine refuses the start, or cannot continue the motion or its derivatives.
        """
        values = np.empty((request.times.size, request.references.size))
        derivatives = np.empty((*values.shape, self._directions.size))
        c, run = self._request, self._run
        _fill(run, request.times, request.references, values, request.inputs)
        run.allowance = self._allowance
        c.started = 0
        c.start = _RunStart.from_address(self._instance.start(initial, start_time, tolerance))
        c.n_seeds, c.seeds = (0, None) if seeds is None else (len(seeds), address(seeds))
        c.derivatives = address(derivatives)
        details = self._details
        if details:
            details.ask(c, len(values))
        events, changes, seconds = [], [], 0.0
        for took in _calls(self._engine.differentiate, self._instance, c, run):
            seconds += took
            events.append(np.frombuffer(bytearray(self._instance.event_bytes[: run.n_events * _EVENT_SIZE]), EVENT))
            changes.append(self._event_derivatives[: run.n_events].copy())
            if details:
                details.keep(run.n_events)
        self.passage = details.passage(c) if details else None
        result = Result(values, np.concatenate(events), run.steps, run.evaluations, seconds)
        return result, derivatives, np.concatenate(changes), c.corners > 0


def structure(request: Request, values: Vector, instance: EngineInstance) -> Structure:
    """The request as the engine reads it, its values to go into ``values``, of a run that has not begun."""
    prepared = instance.whole_run
    c = _WholeRun(event_capacity=prepared.event_capacity, events=prepared.events)
    _fill(c, request.times, request.references, values, request.inputs)
    return c


def _fill(
    c: Structure, times: Vector, references: NDArray[np.uint32], values: Vector,
    inputs: tuple[NDArray[np.uint32], Knots] | None, sides: Vector | None = None, start: int = 0,
) -> None:  # fmt: skip
    """Write a request into the structure, whose arrays the caller keeps alive."""
    where, at = addressof, _AT  # no array is empty here
    _PACK(
        c, 0, start, times.size, references.size, where(at(times)), where(at(references)), where(at(values)), 0, 0,
        *((0, 0, 0) if sides is None else (SIDES, 0, sides.ctypes.data)), ALLOWANCE, 0, 0, 0,
    )  # fmt: skip
    if inputs:
        driven, (knot_times, knot_values, rates) = inputs
        c.n_knots, c.n_inputs = knot_times.size, driven.size
        c.knot_times, c.inputs = knot_times.ctypes.data, driven.ctypes.data
        c.knot_values, c.knot_rates = knot_values.ctypes.data, rates.ctypes.data
