"""The calls of a confused importer: any function of FMI and of the suite's own face, in any order, with any arguments.

Every array has the size that is said of it, so that a sanitizer sees what is read or written beyond.
"""

from __future__ import annotations

import ctypes
import math
import random
from collections.abc import Callable
from ctypes import byref, c_bool, c_double, c_int, c_size_t, c_uint32, c_void_p
from typing import Any

import numpy as np
from faces import Face

from fmu_models.simulation import engine

VALUES = (0.0, 1.0, -1.0, 0.1, 0.41, 0.65, 1e300, -1e300, 1e-300, 5e-324, math.nan, math.inf)
STEPS = (1.0, 0.1, 1e-2, 1e-12, 1e-300, 0.0, -1.0, math.nan)
OK, ERROR = 0, 3


class Caller:
    """An instance and the calls that a confused importer might make; each returns its status."""

    def __init__(self, one: Face, generator: random.Random) -> None:
        self.one, self.random = one, generator
        self.states: list[int | None] = []
        self.kept = b""
        self.suffix = "FMUstate" if one.two else "FMUState"
        self.calls: list[Callable[[], int]] = [self.get, self.set, self.set, self.step, self.step, self.initialize]
        self.calls += [self.simple, self.simple, self.update, self.exchange, self.derivative, self.keep, self.restore]

    def number(self) -> float:
        return self.random.choice(VALUES) if self.random.random() < 0.3 else self.random.random()

    def some(self) -> tuple[ctypes.Array, int]:
        """Value references, some of them wrong."""
        last, n = len(self.one.fmu.variables) - 1, self.random.randint(0, 5)
        wrong = self.random.random() < 0.2
        return (c_uint32 * n)(*[self.random.randint(0, 2**32 - 1 if wrong else last) for _ in range(n)]), n

    def values(self, verb: str) -> int:
        references, n = self.some()
        data = (c_double * n)(*[self.number() for _ in range(n)])
        if self.one.two:
            return self.one.call(f"{verb}Real", references, c_size_t(n), data)
        return self.one.call(f"{verb}Float64", references, c_size_t(n), data, c_size_t(n))

    def get(self) -> int:
        return self.values("Get")

    def set(self) -> int:
        return self.values("Set")

    def step(self) -> int:
        time, length = c_double(self.one.get(["time"])[0]), c_double(self.random.choice(STEPS))
        if self.one.two:
            return self.one.call("DoStep", time, length, c_int(1))
        results = [ctypes.create_string_buffer(size) for size in (1, 1, 1, 8)]
        return self.one.call("DoStep", time, length, c_bool(True), *results)

    def initialize(self) -> int:
        # a start time of any size would only show that no step can follow it
        if self.one.two:
            self.one.call("SetupExperiment", c_int(0), c_double(0), c_double(0.5), c_int(0), c_double(0))
            return self.one.call("EnterInitializationMode")
        flags = c_bool(False), c_double(0.0), c_double(0.5), c_bool(False), c_double(0.0)
        return self.one.call("EnterInitializationMode", *flags)

    def simple(self) -> int:
        names = (
            ["ExitInitializationMode"] * 3 + ["EnterEventMode", "EnterContinuousTimeMode"] * 2 + ["Reset", "Terminate"]
        )
        return self.one.call(self.random.choice(names if self.one.two else [*names, "EnterStepMode"]))

    def update(self) -> int:
        if self.one.two:
            return self.one.call("NewDiscreteStates", ctypes.create_string_buffer(32))
        return self.one.call("UpdateDiscreteStates", *[ctypes.create_string_buffer(size) for size in (1,) * 5 + (8,)])

    def exchange(self) -> int:
        fmu, rate = self.one.fmu, "GetDerivatives" if self.one.two else "GetContinuousStateDerivatives"
        name = self.random.choice(["SetContinuousStates", "GetContinuousStates", "GetEventIndicators", "SetTime", rate])
        if name == "SetTime":
            return self.one.call(name, c_double(self.number()))
        n = len(fmu.contacts if "Indicators" in name else fmu.states)
        n = max(0, n + self.random.choice((0, 0, 0, 0, 0, 0, -1, 1)))
        return self.one.call(name, (c_double * n)(*[self.number() for _ in range(n)]), c_size_t(n))

    def derivative(self) -> int:
        unknown, n = self.some()
        known, k = self.some()
        seed, result = (c_double * k)(*[self.number() for _ in range(k)]), (c_double * n)()
        if self.one.two:
            return self.one.call("GetDirectionalDerivative", unknown, c_size_t(n), known, c_size_t(k), seed, result)
        sizes = c_size_t(n), c_size_t(k)
        arguments = unknown, sizes[0], known, sizes[1], seed, sizes[1], result, sizes[0]
        return self.one.call("GetDirectionalDerivative", *arguments)

    def keep(self) -> int:
        pointer = c_void_p(None)
        status = self.one.call(f"Get{self.suffix}", byref(pointer))
        self.states.append(pointer.value)
        return status

    def restore(self) -> int:
        pointer = c_void_p(self.random.choice(self.states) if self.states else None)
        if self.random.random() < 0.3:
            return self.one.call(f"Free{self.suffix}", byref(pointer))
        return self.one.call(f"Set{self.suffix}", pointer)


class WiderCaller(Caller):
    """The rest of FMI as well, bytes of states that were damaged, and the whole runs of the suite's own face."""

    def __init__(self, one: Face, generator: random.Random) -> None:
        super().__init__(one, generator)
        self.calls += [self.serialize, self.deserialize, self.others, self.completed, self.whole, self.whole]
        self.calls += [self.sensitivity, self.counts]

    def serialize(self) -> int:
        pointer = c_void_p(self.random.choice(self.states) if self.states else None)
        size = c_size_t(0)
        status = self.one.call(f"Serialized{self.suffix}Size", pointer, byref(size))
        if status != OK:
            return status
        room = max(0, size.value - self.random.choice((0, 0, 0, 1, 100)))
        data = ctypes.create_string_buffer(room)
        status = self.one.call(f"Serialize{self.suffix}", pointer, data, c_size_t(room))
        if status == OK:
            self.kept = data.raw
        return status

    def deserialize(self) -> int:
        data = bytearray(self.kept)
        if data and self.random.random() < 0.6:
            data[self.random.randrange(len(data))] ^= 1 << self.random.randrange(8)
        if self.random.random() < 0.2:
            data = data[: self.random.randrange(len(data) + 1)]
        pointer = c_void_p(None)
        name = f"DeSerialize{self.suffix}" if self.one.two else f"Deserialize{self.suffix}"
        buffer = (ctypes.c_ubyte * len(data))(*data)
        status = self.one.call(name, buffer, c_size_t(len(data)), byref(pointer))
        if status == OK:
            self.states.append(pointer.value)
        return status

    def others(self) -> int:
        """Variables of types that few or none have."""
        references, n = self.some()
        types = {"Integer": c_int, "Boolean": c_int, "String": ctypes.c_char_p}
        if not self.one.two:
            types = {"Int32": ctypes.c_int32, "Boolean": c_bool, "Int64": ctypes.c_int64, "Float32": ctypes.c_float}
            types["Clock"] = c_bool
        kind = self.random.choice(sorted(types))
        data = (types[kind] * n)()
        verb = self.random.choice(("Get", "Set"))
        return self.one.call(f"{verb}{kind}", references, c_size_t(n), data, c_size_t(n))

    def completed(self) -> int:
        flags = [ctypes.create_string_buffer(4 if self.one.two else 1) for _ in range(2)]
        return self.one.call("CompletedIntegratorStep", c_int(1), *flags)

    def counts(self) -> int:
        """Nominal values, and the numbers of states and indicators."""
        n = len(self.one.fmu.states)
        if self.one.two or self.random.random() < 0.5:
            return self.one.call("GetNominalsOfContinuousStates", (c_double * n)(), c_size_t(n))
        name = self.random.choice(("GetNumberOfContinuousStates", "GetNumberOfEventIndicators"))
        return self.one.call(name, byref(c_size_t(0)))

    def whole(self) -> int:
        """A whole run, or a part of one that is then abandoned."""
        request = self._request()
        return self._pursued(self.one.api.dll.stickslip_simulate, request)

    def sensitivity(self) -> int:
        """The same with derivatives, from start values of its own."""
        dll = self.one.api.dll
        directions, m = self.some()
        initial, n = self.some()
        run = self._request()
        dll.stickslip_sensitivity_room.restype = ctypes.c_int64
        room = int(dll.stickslip_sensitivity_room(ctypes.c_int64(m)))
        arrays = {
            "derivatives": np.zeros(max(1, int(run.n_times * run.n_values * m))),
            "event_derivatives": np.zeros(max(1, int(run.event_capacity) * m)),
            "room": np.zeros(max(0, room) // 8 + 1),
        }
        values = np.array([self.number() for _ in range(max(1, n))])
        request = engine.C.structure("SensitivityRun")(
            run=run,
            start=engine.C.structure("RunStart")(
                n_initial=n,
                initial=ctypes.addressof(initial),
                initial_values=values.ctypes.data,
                start_time=0.5,
                tolerance=1e-14,
            ),
            n_directions=m,
            directions=ctypes.addressof(directions),
            **{name: array.ctypes.data for name, array in arrays.items()},
        )
        request.alive = arrays, run, initial, directions, values
        return self._pursued(dll.stickslip_sensitivity, request)

    def _request(self) -> Any:
        """A run of a second at most, with whatever buffers, inputs and levels to watch."""
        draw, fmu = self.random, self.one.fmu
        references, n = self.some()
        now = float(self.one.get(["time"])[0])
        times = np.sort([now + draw.random() for _ in range(draw.randrange(5))])
        inputs = np.array([fmu.variables[name].valueReference for name in fmu.inputs], dtype=np.uint32)
        if draw.random() < 0.1:
            inputs = np.array(references[:], dtype=np.uint32)
        knots = np.sort([now + draw.random() for _ in range(draw.randrange(4))])
        events = draw.choice((0, 10, 5000, 20000))
        crossings = draw.choice((0, 0, 1, 3))
        arrays = {
            "times": times,
            "values": np.zeros(max(1, times.size * n)),
            "knot_times": knots,
            "inputs": inputs,
            "knot_values": np.array([self.number() for _ in range(max(1, knots.size * inputs.size))]),
            "knot_rates": np.array([self.number() for _ in range(max(1, knots.size * inputs.size))]),
            "events": np.zeros(max(1, events), dtype=engine.EVENT),
            "crossings": np.zeros(max(1, crossings * n)),
        }
        state = draw.choice([fmu.variables[name].valueReference for name in fmu.states] + [2**31])
        made = engine.C.structure("WholeRun")(
            n_times=times.size,
            n_values=n,
            references=ctypes.addressof(references),
            n_knots=knots.size,
            n_inputs=inputs.size,
            event_capacity=events,
            crossing_capacity=crossings,
            level=draw.choice((0.0, 0.1, self.number())),
            direction=draw.choice((-1, 0, 1)),
            crossing_state=state,
            allowance=draw.choice((1, 5, 100, 2000)),
            **{name: array.ctypes.data for name, array in arrays.items()},
        )
        made.alive = arrays, references
        return made

    def _pursued(self, function: Any, request: Any) -> int:
        function.restype = c_int
        inner = getattr(request, "run", request)
        for _ in range(self.random.choice((1, 1, 2, 50))):
            inner.n_events = inner.n_crossings = 0
            status = function(c_void_p(self.one.api.component), byref(request))
            if status != engine.RUN.MORE:
                return OK if status == engine.RUN.DONE else ERROR
        return OK
