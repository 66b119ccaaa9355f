"""Derivatives of outputs in time: with them the outputs are extrapolated."""

from __future__ import annotations

import ctypes
from itertools import pairwise
from math import erf, factorial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from faces import Face, face
from quick_export import quick_export

from fmu_models import TIME, Coordinate, Mechanism, Parameter
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

DISCARD = 2
HIGHEST = 5  # of FMI 2, whose importers may tell as many derivatives of the inputs


def highest(fmu: Fmu) -> int:
    declared = fmu.description.coSimulation
    assert declared
    return int(declared.maxOutputDerivativeOrder or 0)


def derivatives(one: Face, names: list[str], order: int) -> np.ndarray:
    n = len(names)
    values = (ctypes.c_double * n)()
    vr, orders = (ctypes.c_uint32 * n)(*one.references(names)), (ctypes.c_int32 * n)(*([order] * n))
    size = [ctypes.c_size_t(n)]
    function = "GetRealOutputDerivatives" if one.two else "GetOutputDerivatives"
    status = one.call(function, vr, size[0], orders, values, *([] if one.two else size))
    if status == DISCARD and not one.two:
        pytest.skip("an output follows an input at once by a rate that FMI 3 does not hand over")
    if status != 0:
        raise ValueError(one.messages[-1])
    return np.array(values)


@pytest.fixture(scope="module")
def pause(fmu: Fmu) -> tuple[float, float]:
    """As `longest_pause`."""
    if not fmu.outputs:
        pytest.skip("the model has no output")
    return longest_pause(fmu)


def longest_pause(fmu: Fmu) -> tuple[float, float]:
    """A time in the middle of the longest pause between two events, and how long nothing happens from then."""
    times = [0.0, *(event.time for event in simulate(fmu, 2.0).events), 2.0]
    begin, end = max(pairwise(times), key=lambda pair: pair[1] - pair[0])
    return (begin + end) / 2, (end - begin) / 2


def orders_of(one: Face, names: list[str]) -> list[np.ndarray]:
    """Values and all their derivatives, (n_outputs,) each."""
    return [one.get(names), *(derivatives(one, names, k) for k in range(1, highest(one.fmu) + 1))]


def shrink(orders: list[np.ndarray], h: float) -> bool:
    """Whether the terms of a series over h shrink at least fourfold each."""
    terms = [np.abs(value).max() * h**k / factorial(k) for k, value in enumerate(orders)]
    return all(term <= 4.0**-k * scale_of(orders) for k, term in enumerate(terms) if k > 1)


def scale_of(orders: list[np.ndarray]) -> float:
    return max(np.abs(value / factorial(k)).max() for k, value in enumerate(orders[:3])) + 1e-3


def converging(fmu: Fmu, time: float, longest: float) -> tuple[float, float]:
    """A step over which series converge, and the largest derivative above the highest one there, by differences.

    Both are seen along all of the step: terms at its beginning know nothing of a pulse.
    """
    places = 8
    h = longest
    while True:
        with face(fmu) as one:
            one.initialize()
            one.step(0.0, time)
            last = []
            for k in range(places + 1):
                orders = orders_of(one, fmu.outputs)
                if not shrink(orders, h):
                    break
                last.append(orders[-1])
                one.step(time + k * h / places, h / places)
            else:
                return h, np.abs(np.diff(last, axis=0)).max() * places / h
        h /= 2


def test_they_extrapolate_outputs(fmu: Fmu, pause: tuple[float, float]) -> None:
    """Far by all orders together; near, each order by those above it, so that none may be wrong."""
    time, quiet = pause
    h, above = converging(fmu, time, 0.8 * quiet)  # it looks an eighth further
    near = h / 64
    with face(fmu) as one:
        one.initialize()
        one.step(0.0, time)
        before = orders_of(one, fmu.outputs)
        one.step(time, near)
        after = orders_of(one, fmu.outputs)
        one.step(time + near, h - near)
        far = one.get(fmu.outputs)
    scale, top = scale_of(before), highest(fmu)
    assert np.abs(far - sum(x * h**k / factorial(k) for k, x in enumerate(before))).max() <= 4.0**-top * scale
    for order in range(top):
        series = [value * near**k / factorial(k) for k, value in enumerate(before[order:])]
        # four times the first term left out, as terms go on to shrink or as it is along the step, and rounding
        left_out = top + 1 - order
        next_one = max(4.0**-top * scale * factorial(top + 1) / h ** (top + 1), 4.0 * above)
        rounding = 1e-10 * scale * factorial(order) / h**order
        assert np.abs(after[order] - sum(series)).max() <= next_one * near**left_out / factorial(left_out) + rounding


def test_the_first_is_the_directional_derivative_along_the_motion(fmu: Fmu, pause: tuple[float, float]) -> None:
    with face(fmu) as one:
        one.initialize()
        one.set({f"{name}_rate": 0.3 for name in fmu.inputs})
        one.step(0.0, pause[0])
        along = [*((f"der({name})", name) for name in fmu.states), *((f"{name}_rate", name) for name in fmu.inputs)]
        expected = one.directional(fmu.outputs, "time", 1.0)
        for rate, name in along:
            expected += one.directional(fmu.outputs, name, one.get([rate])[0])
        scale = np.abs(expected).max() + 1.0
        assert derivatives(one, fmu.outputs, 1) == pytest.approx(expected, rel=1e-9, abs=1e-10 * scale)


def test_orders_and_variables_that_there_are_not(fmu: Fmu, pause: tuple[float, float]) -> None:
    assert highest(fmu) == HIGHEST or (fmu.fmi == 3 and fmu.inputs and highest(fmu) >= 1)
    with face(fmu) as one:
        with pytest.raises(ValueError, match="before initialization"):
            derivatives(one, fmu.outputs, 1)
        one.initialize()
        for order in (0, -1, HIGHEST + 1):
            with pytest.raises(ValueError, match="orders 1 to 5"):
                derivatives(one, fmu.outputs, order)
        with pytest.raises(ValueError, match="a parameter, not a continuous output"):
            derivatives(one, fmu.parameters[:1], 1)


def test_derivatives_of_outputs_after_steps_by_a_pulse(tmp_path: Path):
    """The discs that prove a step leave nothing behind in the series of an instant: power F B(t) v of a free block."""
    A, at, width = 1.25, 0.96875, 0.125  # N, s
    pulse = A * sympy.exp(-(((TIME - at) / width) ** 2))
    x, m = Coordinate("x", "m", "place", velocity="v"), Parameter("m", 1.0, "kg", "mass", positive=True)
    free = Mechanism(
        name="free", title="free", source="", coordinates=[x], kinetic_energy=m * x.v**2 / 2, applied={x: pulse}
    )
    time = 1.0
    v = sympy.Function("v")(TIME)
    speed = A * width * np.sqrt(np.pi) / 2 * (erf((time - at) / width) + erf(at / width))
    power: Any = pulse * v
    with face(Fmu.open(quick_export(free, tmp_path / "free.fmu"))) as one:
        one.initialize()
        one.step(0.0, time)
        for order in range(1, 6):
            power = power.diff(TIME).subs(v.diff(TIME), pulse)
            expected = float(power.subs(v, speed).subs(TIME, time))
            assert derivatives(one, ["power_input"], order)[0] == pytest.approx(expected, rel=1e-9)
