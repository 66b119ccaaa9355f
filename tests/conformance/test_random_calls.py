"""Calls in any order with any arguments: every one returns a status, errors come with a reason, and nothing crashes."""

from __future__ import annotations

import ctypes
import math
import random
from collections.abc import Callable
from ctypes import byref, c_bool, c_double, c_int, c_size_t, c_uint32, c_void_p

import pytest
from faces import Face, face

from fmu_models.fmu.fmu import Fmu

VALUES = (0.0, 1.0, -1.0, 0.1, 0.41, 0.65, 1e300, -1e300, 1e-300, 5e-324, math.nan, math.inf)
STEPS = (1.0, 0.1, 1e-2, 1e-12, 1e-300, 0.0, -1.0, math.nan)
CALLS = 300


class Caller:
    """An instance and the calls that a confused importer might make."""

    def __init__(self, one: Face, seed: int) -> None:
        self.one, self.random = one, random.Random(seed)
        self.states: list[int | None] = []
        self.suffix = "FMUstate" if one.two else "FMUState"
        self.calls: list[Callable[[], int]] = [self.get, self.set, self.set, self.step, self.step, self.initialize]
        self.calls += [self.simple, self.simple, self.update, self.exchange, self.derivative, self.keep, self.restore]

    def number(self) -> float:
        return self.random.choice(VALUES) if self.random.random() < 0.3 else self.random.random()

    def some(self) -> tuple[ctypes.Array, int]:
        """Value references, some of them wrong."""
        last, n = len(self.one.fmu.variables) - 1, self.random.randint(0, 5)
        wrong = self.random.random() < 0.2
        return (c_uint32 * 6)(*[self.random.randint(0, 2**32 - 1 if wrong else last) for _ in range(n)]), n

    def values(self, verb: str) -> int:
        references, n = self.some()
        data = (c_double * 6)(*[self.number() for _ in range(n)])
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
        results = [ctypes.create_string_buffer(8) for _ in range(4)]
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
            return self.one.call("NewDiscreteStates", ctypes.create_string_buffer(64))
        return self.one.call("UpdateDiscreteStates", *[ctypes.create_string_buffer(8) for _ in range(6)])

    def exchange(self) -> int:
        fmu, rate = self.one.fmu, "GetDerivatives" if self.one.two else "GetContinuousStateDerivatives"
        x = (c_double * 16)(*[self.number() for _ in fmu.states])
        name = self.random.choice(["SetContinuousStates", "GetContinuousStates", "GetEventIndicators", "SetTime", rate])
        if name == "SetTime":
            return self.one.call(name, c_double(self.number()))
        return self.one.call(name, x, c_size_t(len(fmu.contacts if "Indicators" in name else fmu.states)))

    def derivative(self) -> int:
        unknown, n = self.some()
        known, k = self.some()
        seed, result = (c_double * 6)(*[self.number() for _ in range(k)]), (c_double * 6)()
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


@pytest.mark.parametrize("co_simulation", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_any_calls_in_any_order(fmu: Fmu, co_simulation: bool, seed: int) -> None:
    with face(fmu, co_simulation=co_simulation) as one:
        caller = Caller(one, seed)
        done = {0: 0, 3: 0}
        for _ in range(CALLS):
            said = len(one.messages)
            call = caller.random.choice(caller.calls)
            status = call()
            assert status in done, call
            assert (len(one.messages) > said) or status == 0, call
            done[status] += 1
        # neither refusing everything nor accepting everything
        assert min(done.values()) > CALLS / 10
        # and the instance is as good as new
        one.api.reset()
        one.initialize()
        assert [math.isfinite(x) for x in one.get(fmu.states)] == [True] * len(fmu.states)
