"""One way to talk to an FMU 2.0 and an FMU 3.0, for tests that are about both."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from fmpy import fmi2, fmi3

from fmu_models.fmu.fmu import Fmu

LOADING = threading.Lock()  # fmpy goes to the folder of a library while it loads it, with the whole process


class Face:
    """An instance of an FMU; ``call`` is the raw FMI function by its name without prefix, and returns its status."""

    def __init__(self, fmu: Fmu, *, co_simulation: bool, **options: Any) -> None:
        self.fmu = fmu
        self.two = fmu.fmi == 2
        self.messages: list[str] = []
        self.categories: list[str] = []
        interface = fmu.description.coSimulation if co_simulation else fmu.description.modelExchange
        assert interface is not None
        arguments = {
            "guid": fmu.description.guid,
            "modelIdentifier": interface.modelIdentifier,
            "unzipDirectory": str(fmu.folder),
            "instanceName": "face",
        }
        if self.two:
            with LOADING:
                self.api: Any = (fmi2.FMU2Slave if co_simulation else fmi2.FMU2Model)(**arguments)
            callbacks = fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _e, _n, _s, c, m: self._hear(c, m))
            self.api.instantiate(callbacks=callbacks, loggingOn=True, **options)
        else:
            with LOADING:
                self.api = (fmi3.FMU3Slave if co_simulation else fmi3.FMU3Model)(**arguments)
            logger = lambda _e, _s, c, m: self._hear(c, m)  # noqa: E731  (ctypes needs a callable)
            self.api.instantiate(loggingOn=True, logMessage=logger, **options)

    def _hear(self, category: bytes, message: bytes) -> None:
        self.categories.append(category.decode())
        self.messages.append(message.decode())

    def log(self, *categories: str, on: bool = True) -> int:
        """Ask for messages of some categories, of all without any."""
        self.messages.clear()
        self.categories.clear()
        names = (ctypes.c_char_p * len(categories))(*(c.encode() for c in categories))
        return self.call("SetDebugLogging", ctypes.c_int(on), ctypes.c_size_t(len(categories)), names)

    def reference(self, name: str) -> int:
        return self.fmu.variables[name].valueReference

    def references(self, names: Sequence[str]) -> list[int]:
        return [self.reference(name) for name in names]

    def call(self, name: str, *arguments: Any) -> int:
        """Status of ``fmi2<name>`` or ``fmi3<name>`` for this instance."""
        return self.raw(name, ctypes.c_void_p(self.api.component), *arguments)

    def raw(self, name: str, *arguments: Any) -> int:
        """Status of a function for any instance pointer."""
        function = self.api.dll[f"fmi{2 if self.two else 3}{name}"]
        function.restype = ctypes.c_int
        return function(*arguments)

    def initialize(self, start_time: float = 0.0, tolerance: float | None = None) -> None:
        if self.two:
            self.api.setupExperiment(startTime=start_time, tolerance=tolerance)
            self.api.enterInitializationMode()
        else:
            self.api.enterInitializationMode(startTime=start_time, tolerance=tolerance)
        self.api.exitInitializationMode()

    def get(self, names: Sequence[str]) -> np.ndarray:
        read = self.api.getReal if self.two else self.api.getFloat64
        return np.array(read(self.references(names)))

    def set(self, values: dict[str, float]) -> None:
        write = self.api.setReal if self.two else self.api.setFloat64
        write(self.references(list(values)), list(values.values()))

    def contact_states(self) -> list[int]:
        names = [f"{name}_state" for name in self.fmu.contacts]
        return list((self.api.getInteger if self.two else self.api.getInt32)(self.references(names)))

    def step(self, time: float, length: float) -> Any:
        return self.api.doStep(time, length)

    def update(self) -> tuple:
        return self.api.newDiscreteStates() if self.two else self.api.updateDiscreteStates()

    def derivatives(self) -> np.ndarray:
        values = np.zeros(len(self.fmu.states))
        pointer = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        (self.api.getDerivatives if self.two else self.api.getContinuousStateDerivatives)(pointer, values.size)
        return values

    def set_states(self, x: np.ndarray) -> None:
        x = np.ascontiguousarray(x, dtype=float)
        self.api.setContinuousStates(x.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), x.size)

    def directional(self, unknowns: Sequence[str], known: str, seed: float) -> np.ndarray:
        arguments = self.references(unknowns), [self.reference(known)], [seed]
        return np.array(self.api.getDirectionalDerivative(*arguments))

    def adjoint(self, unknowns: Sequence[str], knowns: Sequence[str], seed: np.ndarray) -> np.ndarray:
        found = (ctypes.c_double * len(knowns))()
        self.api.fmi3GetAdjointDerivative(
            self.api.component,
            (ctypes.c_uint32 * len(unknowns))(*self.references(unknowns)),
            len(unknowns),
            (ctypes.c_uint32 * len(knowns))(*self.references(knowns)),
            len(knowns),
            (ctypes.c_double * len(seed))(*seed),
            len(seed),
            found,
            len(knowns),
        )
        return np.array(found)

    def get_state(self) -> Any:
        return (self.api.getFMUstate if self.two else self.api.getFMUState)()

    def set_state(self, state: Any) -> None:
        (self.api.setFMUstate if self.two else self.api.setFMUState)(state)

    def free_state(self, state: Any) -> None:
        (self.api.freeFMUstate if self.two else self.api.freeFMUState)(state)

    def serialize(self, state: Any) -> bytes:
        return (self.api.serializeFMUstate if self.two else self.api.serializeFMUState)(state)

    def deserialize(self, data: bytes) -> Any:
        return (self.api.deSerializeFMUstate if self.two else self.api.deserializeFMUState)(data)


@contextmanager
def face(fmu: Fmu, *, co_simulation: bool = True, **options: Any) -> Iterator[Face]:
    """An instance that is freed at the end."""
    made = Face(fmu, co_simulation=co_simulation, **options)
    try:
        yield made
    finally:
        made.api.freeInstance()
