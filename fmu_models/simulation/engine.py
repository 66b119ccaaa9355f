"""The engine in an FMU of this suite: a library that is bound once, and instances that are started again, not freed.

A library is loaded when its FMU first makes a run, and let go with the FMU. Threads share it; each run has an instance
of its own, which the next run takes over.
"""

from __future__ import annotations

import ctypes
import struct
import threading
import weakref
from collections.abc import Callable, Mapping
from ctypes import POINTER, addressof, byref, c_char, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint32, c_void_p
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_structures import declarations
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import library, unload
from fmu_models.fmu.unbuilt import UnbuiltFmu

if TYPE_CHECKING:
    from ctypes import _CDataType, _NamedFuncPointer

C = declarations(
    "engine/model/run_state.h",
    *(f"engine/whole_run/{name}.h" for name in ("restart", "whole_run")),
    *("engine/tangents/near_miss.h", "engine/whole_run/sensitivity_run.h"),
    *("engine/model/model.h", "engine/ensemble/request.h"),
)
RUN = C.constants(prefix="WHOLE_RUN_")
EVENT = np.dtype(C.structure("ContactEvent"))
# an instant may need a thousand per contact: enough for 262; memory not written to costs nothing
EVENT_CAPACITY = 1 << 18
_START = ctypes.sizeof(C.structure("RunStart"))
LINE = 8  # numbers in a line of memory


class Engine:
    """The functions of a library, and the instances that no run is using."""

    def __init__(self, fmu: Fmu, core: Path | None = None) -> None:
        """Load it, or the ``core`` of it, which makes whole runs alone. StickslipError: the FMU was not made by this
        suite, or by another version of it, or cannot be loaded."""
        interface = fmu.description.coSimulation
        if interface is None:
            raise StickslipError(f"'{fmu.path}' has no Co-Simulation interface, through which FMUs are simulated here.")
        try:
            dll = ctypes.CDLL(str(core or library(fmu, str(interface.modelIdentifier))))
        except OSError as error:
            raise StickslipError(f"'{fmu.path}' cannot be loaded: {error}") from error
        self.model = str(fmu.description.modelName)
        self._idle: list[EngineInstance] = []
        handles: list[int] = []
        self._handles = handles
        prefix = "core" if core else "stickslip"
        try:
            version = dll[f"{prefix}_native_version"]
        except AttributeError:
            unload(dll)
            raise StickslipError(
                f"'{fmu.path.name}' was not exported by stickslip and has no engine of its own. Name a method of "
                "integration: --method auto, or fmu_models.simulate."
            ) from None
        if version() != RUN.VERSION:
            unload(dll)
            raise StickslipError(
                f"'{fmu.path.name}' was exported by another version of stickslip. Export it again, or name a method: "
                "--method auto."
            )
        self.open = _bound(dll[f"{prefix}_open"], c_void_p, c_char_p)
        self.restart = _bound(dll[f"{prefix}_restart"], c_int, c_void_p, c_void_p)
        self.simulate = _bound(dll[f"{prefix}_simulate"], c_int, c_void_p, POINTER(C.structure("WholeRun")))
        weakref.finalize(self, _let_go, dll, _bound(dll[f"{prefix}_close"], None, c_void_p), handles)
        if core:
            return
        self.differentiate = _bound(dll.stickslip_sensitivity, c_int, c_void_p, POINTER(C.structure("SensitivityRun")))
        self.sensitivity_room = _bound(dll.stickslip_sensitivity_room, c_int64, c_int64)
        self.ensemble = _bound(dll.stickslip_ensemble, c_int, c_void_p, POINTER(C.structure("Ensemble")))
        self.ensemble_room = _bound(dll.stickslip_ensemble_room, c_int64, c_int64)
        self.lane_room = _bound(dll.stickslip_lane_room, c_int64, c_void_p, c_int64)
        self.ensemble_memory = _bound(dll.stickslip_ensemble_memory, c_int64, c_int64)
        references, numbers = (c_void_p, c_size_t), (c_void_p, c_size_t) if fmu.fmi == 3 else (c_void_p,)
        directional = dll[f"fmi{fmu.fmi}GetDirectionalDerivative"]
        self._directional = _bound(directional, c_int, c_void_p, *references, *references, *numbers, *numbers)
        self._counted = fmu.fmi == 3

    def derivative(self, instance: EngineInstance, of: NDArray[np.uint32], by: int) -> Vector:
        """(n,) derivatives of rates or outputs by one variable, all by reference, where the instance is.
        StickslipError: one of them has none there."""
        derivatives, seed_reference, seed = np.empty(len(of)), c_uint32(by), c_double(1.0)
        values = [(byref(seed), 1), (derivatives.ctypes.data, len(of))]
        numbers = [number for value in values for number in (value if self._counted else value[:1])]
        if self._directional(instance.handle, of.ctypes.data, len(of), byref(seed_reference), 1, *numbers) != 0:
            raise instance.failure()
        return derivatives

    def take(self) -> EngineInstance:
        """An instance for one user, in whatever state the last one left it; give it back."""
        try:
            return self._idle.pop()
        except IndexError:
            instance = EngineInstance(self)
            self._handles.append(instance.handle)
            return instance

    def give(self, instance: EngineInstance) -> None:
        """Take it back."""
        self._idle.append(instance)


class EngineInstance:
    """One motion at a time, by one thread at a time; what a run writes to is kept for the next one."""

    def __init__(self, engine: Engine) -> None:
        self._model, self._restart = engine.model, engine.restart
        self._message = ctypes.create_string_buffer(RUN.MESSAGE)
        self._room, self._kept = -1, np.empty(0)
        handle = engine.open(self._message)
        if not handle:
            raise MemoryError(f"no memory for an instance of {engine.model}")
        self.handle: int = handle

    @cached_property
    def event_bytes(self) -> memoryview:
        """Room for EVENT_CAPACITY of dtype EVENT, which the engine writes to."""
        return np.empty(EVENT_CAPACITY * EVENT.itemsize, dtype=np.uint8).data

    @cached_property
    def whole_run(self) -> ctypes.Structure:
        """A request with room for events, to be filled in."""
        return C.structure("WholeRun")(event_capacity=EVENT_CAPACITY, events=address(self.event_bytes))

    def lines(self, numbers: int) -> int:
        """Address of room for so many numbers, at the beginning of a line of memory; what was there is lost."""
        if self._kept.size < numbers + LINE:
            self._kept = np.empty(numbers + LINE)
        return -(-self._kept.ctypes.data // (8 * LINE)) * 8 * LINE

    def restart(self, initial: Mapping[int, float], start_time: float, tolerance: float) -> None:
        """Go to start values by reference; all others have their defaults. StickslipError: the engine refuses them."""
        if self._restart(self.handle, self.start(initial, start_time, tolerance)) != RUN.DONE:
            raise self.failure()

    def start(self, initial: Mapping[int, float], start_time: float, tolerance: float) -> int:
        """Address of a RunStart with start values by reference, until it is asked for again."""
        n = len(initial)
        if n > self._room:
            self._room, self._start = n, bytearray(_START + 12 * n)
            self._where = address(self._start)
        values = self._where + _START
        layout = _layout(n)
        layout.pack_into(self._start, 0, n, values + 8 * n, values, start_time, tolerance, *initial.values(), *initial)
        return self._where

    def failure(self) -> StickslipError:
        """An error that says why the engine has refused last."""
        text = self._message.value.decode("utf-8", "replace")
        head, colon, message = text.partition(": ")
        # messages may begin with the C function that refused; that is of no use to the reader
        reason = message if colon and head.startswith(("stickslip_", "whole_run_")) else text
        return StickslipError(f"{self._model}: {reason}")


@cache
def _layout(n: int) -> struct.Struct:
    """Of a RunStart, n values and their references; doubles first, which need the stricter alignment."""
    return struct.Struct(f"{C.packing('RunStart', 'n_initial', 'tolerance').format}{n}d{n}I")


def address(array: NDArray[Any] | memoryview | bytearray) -> int:
    """Where the data of a writable array begins; numpy's own way takes five times as long."""
    return addressof(_at(array)) if len(array) else 0


_at: Callable[[Any], c_char] = c_char.from_buffer


def indicators_of(fmu: Fmu) -> list[int]:
    """Value references of the event indicators of an FMU of this suite: they come right behind the contacts."""
    contacts = [fmu.variables[f"{name}_state"].valueReference for name in fmu.contacts]
    count = int(fmu.description.numberOfEventIndicators or 0) if contacts else 0
    return [int(contacts[-1]) + 1 + i for i in range(count)]


def engine_of(fmu: Fmu, *, runs_alone: bool = False) -> Engine:
    """The engine of an opened FMU; errors as for ``Engine``. runs_alone: for whole runs, for which not all of a model
    that is not built yet has to be compiled."""
    engine = _engines.get(fmu)
    if engine is None and runs_alone:
        engine = _cores.get(fmu)
    if engine is None:
        # compiled here, and not while others wait for models of theirs
        core = fmu.core if runs_alone and isinstance(fmu, UnbuiltFmu) else None
        if core is None:
            _ = fmu.path
        with _loading:
            engines = _cores if core else _engines
            engine = engines.get(fmu)
            if engine is None:
                engine = engines[fmu] = Engine(fmu, core)
    return engine


_engines: weakref.WeakKeyDictionary[Fmu, Engine] = weakref.WeakKeyDictionary()
_cores: weakref.WeakKeyDictionary[Fmu, Engine] = weakref.WeakKeyDictionary()
_loading = threading.Lock()


def _bound(
    function: _NamedFuncPointer, result: type[_CDataType] | None, *arguments: type[_CDataType]
) -> _NamedFuncPointer:
    function.restype, function.argtypes = result, arguments
    return function


def _let_go(dll: ctypes.CDLL, close: Callable[[int], object], handles: list[int]) -> None:
    for handle in handles:
        close(handle)
    unload(dll)
