"""The C structures of engine/whole_run, and the calls that make a whole run."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable, Iterator, Mapping
from ctypes import POINTER, c_int, c_int64, c_void_p
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_structures import declarations

_C = declarations(
    "engine/model/run_state.h",
    *(f"engine/whole_run/{name}.h" for name in ("restart", "whole_run", "sensitivity_run")),
)
_RUN = _C.constants(prefix="WHOLE_RUN_")
EVENT_CAPACITY = (
    1 << 18
)  # an instant may need a thousand per contact: enough for 262; memory not written to costs nothing
ALLOWANCE = 20000  # steps per call, some 50 ms: how long an interrupt from the keyboard waits

EVENT = np.dtype(_C.structure("ContactEvent"))
_WholeRun = _C.structure("WholeRun")
_RunStart = _C.structure("RunStart")
_SensitivityRun = _C.structure("SensitivityRun")


@dataclass(frozen=True, eq=False)
class Request:
    """What to do: output times (n,) s, references to record (m,), and the table of inputs of ``signal.knots``."""

    times: NDArray[np.float64]
    references: list[int]
    inputs: list[int]
    knot_times: NDArray[np.float64]
    knot_values: NDArray[np.float64]
    knot_rates: NDArray[np.float64]


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


def library_of(dll: ctypes.CDLL, name: str) -> Callable[..., int]:
    """The function ``stickslip_simulate`` of a loaded FMU.

    Raises:
        StickslipError: the FMU was not made by this suite, or by another version of it.
    """
    try:
        version, run = dll.stickslip_native_version, dll.stickslip_simulate
    except AttributeError:
        raise StickslipError(
            f"'{name}' was not exported by stickslip and has no engine of its own. Name a method of integration: "
            "--method auto, or master.simulate_any."
        ) from None
    version.restype = c_int
    if version() != _RUN.VERSION:
        raise StickslipError(
            f"'{name}' was exported by another version of stickslip. Export it again, or name a method: --method auto."
        )
    run.restype = c_int
    run.argtypes = (c_void_p, POINTER(_WholeRun))
    return run


def run(
    simulate: Callable[..., int], instance: int, request: Request, progress: Callable[[float], None] | None = None
) -> Result | None:
    """Make the run; None if the engine failed (it has logged why)."""
    values = np.empty((request.times.size, len(request.references)))
    buffer = np.empty(EVENT_CAPACITY, dtype=EVENT)
    c = _structure(request, values, buffer)
    chunks = []
    status = _RUN.MORE
    seconds = 0.0
    while status == _RUN.MORE:
        c.n_events = 0
        begin = time.perf_counter()
        status = simulate(instance, ctypes.byref(c))
        seconds += time.perf_counter() - begin
        if c.n_events:
            chunks.append(buffer[: c.n_events].copy())
        if progress:
            progress(c.next_time / max(1, request.times.size))
    if status != _RUN.DONE:
        return None
    events = np.concatenate(chunks) if chunks else buffer[:0]
    return Result(values, events, c.steps, c.evaluations, seconds)


def crossings(
    simulate: Callable[..., int], instance: int, request: Request, section: Section
) -> Iterator[NDArray[np.float64] | None]:
    """Rows (m,) of the values recorded at one crossing after the other; None if the engine failed.

    The run goes on only as far as it is iterated.
    """
    values = np.empty((request.times.size, len(request.references)))
    row = np.empty(len(request.references))
    buffer = np.empty(EVENT_CAPACITY, dtype=EVENT)
    c = _structure(request, values, buffer)
    c.crossings = row.ctypes.data
    c.crossing_capacity = 1
    c.crossing_state, c.level, c.direction = section.reference, section.level, section.direction
    status = _RUN.MORE
    while status == _RUN.MORE:
        c.n_events = c.n_crossings = 0
        status = simulate(instance, ctypes.byref(c))
        if c.n_crossings:
            yield row.copy()
    if status != _RUN.DONE:
        yield None


class Differentiator:
    """Runs of one instance with their derivatives by the variables ``directions``, memory kept from run to run."""

    def __init__(self, dll: ctypes.CDLL, instance: int, directions: list[int]) -> None:
        room = dll.stickslip_sensitivity_room
        room.restype, room.argtypes = c_int64, (c_int64,)
        self._run = dll.stickslip_sensitivity
        self._run.restype, self._run.argtypes = c_int, (c_void_p, POINTER(_SensitivityRun))
        self._instance = instance
        self._directions = np.array(directions, dtype=np.uint32)
        self._events = np.empty(EVENT_CAPACITY, dtype=EVENT)
        self._event_derivatives = np.empty((EVENT_CAPACITY, len(directions)))
        self._room = np.empty(int(room(len(directions))) // 8 + 2)
        self._allowance = max(1, ALLOWANCE // (4 * (1 + len(directions))))  # a tangent costs as much as four runs

    def run(
        self, request: Request, initial: Mapping[int, float], start_time: float, tolerance: float
    ) -> tuple[Result, NDArray[np.float64], NDArray[np.float64], bool] | None:
        """The run from these start values by reference; None if the engine failed (it has logged why).

        Returns:
            the run; derivatives of its values (n, m, n_directions) and of the times of its events (k, n_directions);
            whether they are one-sided.
        """
        m = self._directions.size
        values = np.empty((request.times.size, len(request.references)))
        derivatives = np.empty((*values.shape, m))
        references = np.fromiter(initial, np.uint32, len(initial))
        start = np.fromiter(initial.values(), float, len(initial))
        structure = _structure(request, values, self._events)  # keeps alive what the copy of it points into
        structure.allowance = self._allowance
        c = _SensitivityRun(
            run=structure,
            start=_RunStart(start.size, references.ctypes.data, start.ctypes.data, start_time, tolerance),
            n_directions=m,
            directions=self._directions.ctypes.data,
            derivatives=derivatives.ctypes.data,
            event_derivatives=self._event_derivatives.ctypes.data,
            room=self._room.ctypes.data,
        )
        events, changes = [], []
        status, seconds = _RUN.MORE, 0.0
        while status == _RUN.MORE:
            c.run.n_events = 0
            begin = time.perf_counter()
            status = self._run(self._instance, ctypes.byref(c))
            seconds += time.perf_counter() - begin
            events.append(self._events[: c.run.n_events].copy())
            changes.append(self._event_derivatives[: c.run.n_events].copy())
        if status != _RUN.DONE:
            return None
        result = Result(values, np.concatenate(events), c.run.steps, c.run.evaluations, seconds)
        return result, derivatives, np.concatenate(changes), c.corners > 0


def _structure(request: Request, values: NDArray[np.float64], buffer: NDArray) -> Any:
    """The request as the engine reads it; it keeps the arrays alive that it points into."""
    references = np.array(request.references, dtype=np.uint32)
    inputs = np.array(request.inputs, dtype=np.uint32)
    c = _WholeRun(
        n_times=request.times.size,
        n_values=references.size,
        times=request.times.ctypes.data,
        references=references.ctypes.data,
        values=values.ctypes.data,
        n_knots=request.knot_times.size if inputs.size else 0,
        n_inputs=inputs.size,
        knot_times=request.knot_times.ctypes.data,
        inputs=inputs.ctypes.data,
        knot_values=request.knot_values.ctypes.data,
        knot_rates=request.knot_rates.ctypes.data,
        event_capacity=EVENT_CAPACITY,
        events=buffer.ctypes.data,
        allowance=ALLOWANCE,
    )
    c.keep = (request, references, inputs, values, buffer)  # the structure points into them
    return c
