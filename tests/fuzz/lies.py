"""An FMU that lies to the importer: real ones, and something between them and the master that changes what they say.

A lie is about one function: numbers that are none, of the wrong sign, stuck or too large, statuses and flags that do
not fit, events in the past or without end. The run ends by a reason, or with finite states at ascending times; the next
run, without lies, is the one that it would have been.
"""

from __future__ import annotations

import ctypes
import itertools
import math
import random
from collections.abc import Callable
from ctypes import CFUNCTYPE, c_double, c_int, c_size_t, c_ubyte, c_void_p
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzzing import Target
from models import foreign

from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import claim_folder, temporary_folder
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.importer.instance import FUNCTIONS, F, master_library
from fmu_models.simulation.trajectory import Trajectory

# what a run may meet, in either version: falls, slides, time events, steps that must be completed, stiffness, inputs
MODELS = (
    *(("ball", 2), ("ball", 3), ("relay", 3), ("circle", 2), ("corner", 3), ("clock", 2), ("clock", 3), ("wrap", 3)),
    *(("robertson", 2), ("van_der_pol", 3), ("driven", 2), ("block", 3), ("integers", 2), ("integers", 3)),
)
METHODS = ("auto", "dopri5", "dop853", "stiff")
END = 1.2  # s: before the ball's bounces accumulate
NOISE = 1e-4  # more, and steps of any length are too long for a tolerance of 1e-6
NUMBERS = (math.nan, math.inf, -math.inf, 0.0, 1e300, -1.0, 5e-324)
STATUSES = (1, 2, 3, 4, 5, -1, 99)

P = c_void_p


def _array(_fmi: int) -> Any:
    return CFUNCTYPE(c_int, P, ctypes.POINTER(c_double), c_size_t)


def _given(_fmi: int) -> Any:
    return CFUNCTYPE(c_int, P, P, c_size_t)


def _plain(_fmi: int) -> Any:
    return CFUNCTYPE(c_int, P)


def _update(fmi: int) -> Any:
    return CFUNCTYPE(c_int, P, P) if fmi == 2 else CFUNCTYPE(c_int, *[P] * 7)


def _completed(fmi: int) -> Any:
    return CFUNCTYPE(c_int, P, c_int, P, P) if fmi == 2 else CFUNCTYPE(c_int, P, ctypes.c_bool, P, P)


def _getter(fmi: int) -> Any:
    values = ctypes.POINTER(c_double)
    return CFUNCTYPE(c_int, P, P, c_size_t, values, *(() if fmi == 2 else (c_size_t,)))


def _directional(fmi: int) -> Any:
    values = ctypes.POINTER(c_double)
    if fmi == 2:
        return CFUNCTYPE(c_int, P, P, c_size_t, P, c_size_t, P, values)
    return CFUNCTYPE(c_int, P, P, c_size_t, P, c_size_t, P, c_size_t, values, c_size_t)


def _time(_fmi: int) -> Any:
    return CFUNCTYPE(c_int, P, c_double)


def _step(fmi: int) -> Any:
    flags = (c_int,) if fmi == 2 else (ctypes.c_bool, *[P] * 4)
    return CFUNCTYPE(c_int, P, c_double, c_double, *flags)


KINDS: dict[int, Callable[[int], Any]] = {
    **dict.fromkeys((F.GET_DERIVATIVES, F.GET_INDICATORS, F.GET_STATES, F.NOMINALS), _array),
    **dict.fromkeys((F.EXIT_INITIALIZATION, F.ENTER_EVENT, F.ENTER_CONTINUOUS, F.TERMINATE, F.RESET), _plain),
    F.UPDATE: _update,
    F.COMPLETED: _completed,
    F.GETTERS: _getter,
    F.DIRECTIONAL: _directional,
    F.SET_TIME: _time,
    F.SET_STATES: _given,  # what the importer gives is its own: to write there would be no lie but an attack
    F.DO_STEP: _step,
}
# functions that matter most, more often
LIKELY = (F.GET_DERIVATIVES, F.GET_INDICATORS, F.UPDATE, F.NOMINALS, F.COMPLETED, F.GETTERS, F.GET_STATES, F.DO_STEP)


class _Liar:
    """Stands in for one function of an FMU."""

    def __init__(self, generator: random.Random, fmi: int, index: int, real: int) -> None:
        self.draw, self.fmi, self.index = generator, fmi, index
        kind = KINDS[index](fmi)
        self.real = kind(real)
        self.c = kind(self._called)
        self.calls = 0
        self.first = generator.choice((0, 0, 1, 3, 10, 50, 200))
        self.share = generator.choice((1.0, 1.0, 0.5, 0.1))
        self.number = generator.choice(NUMBERS)
        self.how = generator.choice(("numbers", "numbers", "sign", "stuck", "status", "noise"))
        self.kept: list[float] | None = None

    def _called(self, *arguments: Any) -> int:
        status = self.real(*arguments)
        self.calls += 1
        if self.calls <= self.first or self.draw.random() > self.share:
            return status
        if self.how == "status" or KINDS[self.index] in (_plain, _time, _given):
            return self.draw.choice(STATUSES)
        if KINDS[self.index] in (_array, _getter, _directional):
            self._falsify(*self._values(arguments))
        elif KINDS[self.index] is _update:
            self._falsify_update(arguments)
        elif KINDS[self.index] is _completed:
            width = 4 if self.fmi == 2 else 1
            for pointer in arguments[2:]:
                self._flag(pointer, width)
        elif self.fmi == 3:
            for pointer in arguments[4:7]:
                self._flag(pointer, 1)
            ctypes.cast(arguments[7], ctypes.POINTER(c_double))[0] = self._when()
        return status

    def _values(self, arguments: tuple[Any, ...]) -> tuple[Any, int]:
        """The array that the function wrote, and its size."""
        if KINDS[self.index] is _array:
            return arguments[1], arguments[2]
        if KINDS[self.index] is _getter:
            return arguments[3], arguments[2]
        return arguments[6 if self.fmi == 2 else 7], arguments[2]

    def _falsify(self, values: Any, n: int) -> None:
        if self.kept is None:
            self.kept = [values[i] for i in range(n)]
        for i in range(n):
            if self.how == "sign":
                values[i] = -values[i]
            elif self.how == "stuck":
                values[i] = self.kept[i] if i < len(self.kept) else 0.0
            elif self.how == "noise":
                values[i] += self.draw.gauss(0.0, NOISE)
            elif self.draw.random() < 0.7:
                values[i] = self.number

    def _falsify_update(self, arguments: tuple[Any, ...]) -> None:
        if self.fmi == 3:
            for pointer in arguments[1:6]:
                self._flag(pointer, 1)
            ctypes.cast(arguments[6], ctypes.POINTER(c_double))[0] = self._when()
            return
        for i in range(5):
            self._flag(arguments[1] + 4 * i, 4)
        ctypes.cast(arguments[1] + 24, ctypes.POINTER(c_double))[0] = self._when()

    def _flag(self, pointer: int, width: int) -> None:
        """A flag now and then changes: to what is true, false, or neither."""
        if self.draw.random() < 0.3:
            ctypes.cast(pointer, ctypes.POINTER(c_ubyte if width == 1 else c_int))[0] = self.draw.choice((0, 1, 1, 2))

    def _when(self) -> float:
        return self.draw.choice((*NUMBERS, 0.1, 0.5, 1e-12, END, -5.0, 0.3 + 1e-15))


@cache
def _folder() -> Path:
    return claim_folder("lies")


def _prepare() -> None:
    """The libraries are kept where every process finds them."""
    with temporary_folder("lies") as folder:
        for name, fmi in MODELS:
            foreign(name, folder, fmi)
    master_library()


@cache
def _driver(name: str, fmi: int, method: str) -> tuple[Driver, Trajectory]:
    """A driver that stays, and the run without lies."""
    path = _folder() / f"{name}{fmi}.fmu"
    if not path.exists():
        foreign(name, _folder(), fmi)
    driver = Driver(Fmu.open(path), method=method, tolerance=1e-6)
    return driver, _run(driver)


def _run(driver: Driver) -> Trajectory:
    return driver.run(END, output_times=np.linspace(0.0, END, 7) if driver.method != "co-simulation" else None)


def _case(generator: random.Random) -> None:
    name, fmi = generator.choice(MODELS)
    method = generator.choice(METHODS)
    driver, honest = _driver(name, fmi, "auto" if name == "integers" else method)
    calls = driver._instance.calls
    kept = {index: calls.function[index] for index in KINDS if calls.function[index]}
    liars = []
    for _ in range(generator.choice((1, 1, 2, 3))):
        index = generator.choice([i for i in (*LIKELY, *LIKELY, *KINDS) if i in kept])
        liars.append(_Liar(generator, fmi, index, kept[index]))
        calls.function[index] = ctypes.cast(liars[-1].c, c_void_p).value
    try:
        _check(_run(driver), driver)
    except StickslipError as error:
        assert str(error).strip(), "an error without words"
    finally:
        for index, function in kept.items():
            calls.function[index] = function
    again = _run(driver)
    assert again.time.size == honest.time.size
    assert all(np.array_equal(again[column], honest[column]) for column in honest.values), "the lies outlive their run"


def _check(run: Trajectory, driver: Driver) -> None:
    times = [event.time for event in run.events]
    assert all(0.0 <= a <= b <= END for a, b in itertools.pairwise(times)), "events out of order"
    assert np.all(np.diff(run.time) >= 0)
    for state in driver._states:
        assert np.isfinite(run[state]).all(), f"{state} is not finite, and nothing is said"


LIES = Target("lies", _case, _prepare, native=True, weight=3)
assert all(index in FUNCTIONS for index in KINDS)
