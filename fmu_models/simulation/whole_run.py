"""The calls that make a whole run: what is asked of an instance, and what it gives."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.simulation.engine import EVENT_CAPACITY, RUN, C, Engine, Instance, run_start
from fmu_models.simulation.signal import Knots

ALLOWANCE = 20000  # steps per call, some 50 ms: how long an interrupt from the keyboard waits

_WholeRun = C.structure("WholeRun")
_SensitivityRun = C.structure("SensitivityRun")


@dataclass(frozen=True, eq=False)
class Request:
    """What to do.

    Attributes:
        times: (n,) s, of output.
        references: (m,) of the variables to record.
        inputs: references (k,) of inputs that change with time, and their table of ``signal.knots``.
    """

    times: NDArray[np.float64]
    references: NDArray[np.uint32]
    inputs: tuple[NDArray[np.uint32], Knots] | None = None


@dataclass(frozen=True)
class Section:
    """A level of the state ``reference`` and the direction of its crossings: 1 upward, -1 downward, 0 both."""

    reference: int
    level: float
    direction: int


@dataclass(frozen=True, eq=False)
class Result:
    """What came of it: values (n, m), events (k,) of dtype EVENT, counters of the engine, and its wall time in s."""

    values: NDArray[np.float64]
    events: NDArray
    steps: int
    evaluations: int
    seconds: float


def run(
    engine: Engine, instance: Instance, request: Request, progress: Callable[[float], None] | None = None
) -> Result:
    """Make the run of an instance that was started.

    Raises:
        StickslipError: the engine cannot continue the motion.
    """
    values = np.empty((request.times.size, request.references.size))
    buffer = instance.events
    c = _structure(request, values, buffer)
    chunks = []
    status = RUN.MORE
    seconds = 0.0
    while status == RUN.MORE:
        c.n_events = 0
        begin = time.perf_counter()
        status = engine.simulate(instance.handle, c)
        seconds += time.perf_counter() - begin
        if c.n_events:
            chunks.append(buffer[: c.n_events].copy())
        if progress:
            progress(c.next_time / max(1, request.times.size))
    if status != RUN.DONE:
        raise instance.failure()
    events = chunks[0] if len(chunks) == 1 else np.concatenate(chunks) if chunks else buffer[:0].copy()
    return Result(values, events, c.steps, c.evaluations, seconds)


def crossings(engine: Engine, instance: Instance, request: Request, section: Section) -> Iterator[NDArray[np.float64]]:
    """Rows (m,) of the values recorded at one crossing after the other; the run goes on only as far as it is iterated.

    Raises:
        StickslipError: the engine cannot continue the motion.
    """
    values = np.empty((request.times.size, request.references.size))
    row = np.empty(request.references.size)
    c = _structure(request, values, instance.events)
    c.crossings = row.ctypes.data
    c.crossing_capacity = 1
    c.crossing_state, c.level, c.direction = section.reference, section.level, section.direction
    status = RUN.MORE
    while status == RUN.MORE:
        c.n_events = c.n_crossings = 0
        status = engine.simulate(instance.handle, c)
        if c.n_crossings:
            yield row.copy()
    if status != RUN.DONE:
        raise instance.failure()


class Differentiator:
    """Runs of one instance with their derivatives by the variables ``directions``, memory kept from run to run."""

    def __init__(self, engine: Engine, instance: Instance, directions: NDArray[np.uint32]) -> None:
        self._engine, self._instance, self._directions = engine, instance, directions
        self._event_derivatives = np.empty((EVENT_CAPACITY, directions.size))
        self._room = np.empty(int(engine.sensitivity_room(directions.size)) // 8 + 2)
        self._allowance = max(1, ALLOWANCE // (4 * (1 + directions.size)))  # a tangent costs as much as four runs

    def run(
        self, request: Request, initial: Mapping[int, float], start_time: float, tolerance: float
    ) -> tuple[Result, NDArray[np.float64], NDArray[np.float64], bool]:
        """The run from these start values by reference.

        Returns:
            the run; derivatives of its values (n, m, n_directions) and of the times of its events (k, n_directions);
            whether they are one-sided.

        Raises:
            StickslipError: the engine refuses the start, or cannot continue the motion or its derivatives.
        """
        m = self._directions.size
        buffer = self._instance.events
        values = np.empty((request.times.size, request.references.size))
        derivatives = np.empty((*values.shape, m))
        structure = _structure(request, values, buffer)  # keeps alive what the copy of it points into
        start = run_start(initial, start_time, tolerance)  # the same
        structure.allowance = self._allowance
        c = _SensitivityRun(
            run=structure,
            start=start,
            n_directions=m,
            directions=self._directions.ctypes.data,
            derivatives=derivatives.ctypes.data,
            event_derivatives=self._event_derivatives.ctypes.data,
            room=self._room.ctypes.data,
        )
        events, changes = [], []
        status, seconds = RUN.MORE, 0.0
        while status == RUN.MORE:
            c.run.n_events = 0
            begin = time.perf_counter()
            status = self._engine.differentiate(self._instance.handle, c)
            seconds += time.perf_counter() - begin
            events.append(buffer[: c.run.n_events].copy())
            changes.append(self._event_derivatives[: c.run.n_events].copy())
        if status != RUN.DONE:
            raise self._instance.failure()
        result = Result(values, np.concatenate(events), c.run.steps, c.run.evaluations, seconds)
        return result, derivatives, np.concatenate(changes), c.corners > 0


def _structure(request: Request, values: NDArray[np.float64], buffer: NDArray) -> Any:
    """The request as the engine reads it; it keeps the arrays alive that it points into."""
    c = _WholeRun(
        n_times=request.times.size,
        n_values=request.references.size,
        times=request.times.ctypes.data,
        references=request.references.ctypes.data,
        values=values.ctypes.data,
        event_capacity=EVENT_CAPACITY,
        events=buffer.ctypes.data,
        allowance=ALLOWANCE,
    )
    if request.inputs:
        inputs, (times, knot_values, rates) = request.inputs
        c.n_knots, c.n_inputs = times.size, inputs.size
        c.knot_times, c.inputs = times.ctypes.data, inputs.ctypes.data
        c.knot_values, c.knot_rates = knot_values.ctypes.data, rates.ctypes.data
    c.keep = (request, values, buffer)  # the structure points into them
    return c
