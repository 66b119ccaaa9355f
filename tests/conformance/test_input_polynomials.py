"""Inputs that bend within one step of Co-Simulation: by their derivatives (FMI 2), by values asked for inside (FMI 3).

The oracle is the motion of a linear oscillator under a polynomial force in closed form:

    m x'' + c x' + k x = F(t),  z' = A z + B u,  z = e^(A t)(z0 - p(0)) + p(t),  p the polynomial that solves it
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import factorial
from typing import Any

import numpy as np
import pytest
from faces import Face, face
from numpy.polynomial import Polynomial
from quick_export import quick_export
from scipy.linalg import expm

from fmu_models import Coordinate, Input, Mechanism, Output, Parameter
from fmu_models.fmu.fmu import Fmu

M, C, K = 1.25, 0.3, 4.0
START = np.array([0.7, -0.4])
FORCE = Polynomial([0.5, -1.5, 2.0, 1.0])
STEP = 1.5
A = np.array([[0.0, 1.0], [-K / M, -C / M]])


def oscillator() -> Mechanism:
    m, c, k = (Parameter(n, v, u, n, positive=True) for n, v, u in (("m", M, "kg"), ("c", C, "N s/m"), ("k", K, "N/m")))
    F = Input("F", 0.0, "N", "force")
    x = Coordinate("x", "m", "place", velocity="v", start=START[0], v_start=START[1])
    return Mechanism(
        name="osc", title="oscillator", source="", coordinates=[x], kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2, applied={x: F - c * x.v}, outputs=[Output("load", F - k * x, "N", "load")],
    )  # fmt: skip


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Fmu]:
    folder = tmp_path_factory.mktemp("osc")
    versions = {2: "2.0", 3: "3.0"}
    return {n: Fmu.open(quick_export(oscillator(), folder / f"osc{n}.fmu", fmi_version=v)) for n, v in versions.items()}


def motion(t: float, force: Polynomial = FORCE) -> np.ndarray:
    """(2,) x and v at t, in closed form."""
    degree = force.degree()
    series = [force.deriv(n)(0.0) / factorial(n) if n else force(0.0) for n in range(degree + 1)]
    p = np.zeros((degree + 2, 2))
    for n in range(degree, -1, -1):  # (n + 1) p[n + 1] = A p[n] + b f[n]
        p[n] = np.linalg.solve(A, (n + 1) * p[n + 1] - np.array([0.0, series[n] / M]))
    return expm(A * t) @ (START - p[0]) + sum(p[n] * t**n for n in range(degree + 1))


def set_derivatives(one: Face, name: str, values: list[float], first: int = 1) -> int:
    n = len(values)
    references, orders = (
        (ctypes.c_uint32 * n)(*[one.reference(name)] * n),
        (ctypes.c_int32 * n)(*range(first, first + n)),
    )
    return one.call("SetRealInputDerivatives", references, ctypes.c_size_t(n), orders, (ctypes.c_double * n)(*values))


def output_derivatives(one: Face, name: str, highest: int) -> tuple[int, list[float]]:
    n = highest
    references, orders = (ctypes.c_uint32 * n)(*[one.reference(name)] * n), (ctypes.c_int32 * n)(*range(1, n + 1))
    values, size = (ctypes.c_double * n)(), ctypes.c_size_t(n)
    function = "GetRealOutputDerivatives" if one.two else "GetOutputDerivatives"
    status = one.call(function, references, size, orders, values, *([] if one.two else [size]))
    return status, list(values)


def test_a_cubic_force_over_one_step_of_fmi_2(fmus: dict[int, Fmu]) -> None:
    assert fmus[2].description.coSimulation and fmus[2].description.coSimulation.canInterpolateInputs
    with face(fmus[2]) as one:
        one.initialize()
        one.set({"F": FORCE(0.0)})
        assert set_derivatives(one, "F", [FORCE.deriv(n)(0.0) for n in (1, 2, 3)]) == 0
        one.step(0.0, 0.4 * STEP)  # the polynomial goes on where nothing is written
        one.step(0.4 * STEP, 0.6 * STEP)
        assert one.get(["x", "v"]) == pytest.approx(motion(STEP), abs=1e-13)
        assert one.get(["F", "F_rate"]) == pytest.approx([FORCE(STEP), FORCE.deriv()(STEP)], rel=1e-14)


def test_the_sixth_degree_and_no_more(fmus: dict[int, Fmu]) -> None:
    force = Polynomial([0.5, -1.5, 2.0, 1.0, 0.3, -0.4, 0.2])
    with face(fmus[2]) as one:
        one.initialize()
        one.set({"F": force(0.0)})
        assert set_derivatives(one, "F", [force.deriv(n)(0.0) for n in range(1, 7)]) == 0
        one.step(0.0, STEP)
        assert one.get(["x", "v"]) == pytest.approx(motion(STEP, force), abs=1e-12)
        assert set_derivatives(one, "F", [1.0], first=7) == 3
        assert "orders 1 to 6" in one.messages[-1]
        assert set_derivatives(one, "x", [1.0]) == 3


@pytest.mark.parametrize("version", [2, 3])
def test_derivatives_of_outputs_are_right_to_the_order_claimed(fmus: dict[int, Fmu], version: int) -> None:
    """Of x they are A^n (z - p) + p^(n): right where the force is known so far, and refused beyond."""
    claimed = int(fmus[version].description.coSimulation.maxOutputDerivativeOrder or 0)  # type: ignore[union-attr]
    # the load takes the force at once, and FMI 3 hands over its rate alone
    assert claimed == {2: 5, 3: 1}[version]
    jet = [START]
    for n in range(5):
        jet.append(A @ jet[n] + np.array([0.0, FORCE.deriv(n)(0.0) / M if n else FORCE(0.0) / M]))
    load = [(FORCE.deriv(n)(0.0)) - K * jet[n][0] for n in range(1, 6)]
    right = {"x": [z[0] for z in jet[1:]], "v": [z[1] for z in jet[1:]], "load": load}
    known = {2: {"x": 5, "v": 5, "load": 5}, 3: {"x": 3, "v": 2, "load": 1}}[version]
    with face(fmus[version]) as one:
        one.initialize()
        one.set({"F": FORCE(0.0), "F_rate": FORCE.deriv()(0.0)})
        if version == 2:
            assert set_derivatives(one, "F", [FORCE.deriv(2)(0.0), FORCE.deriv(3)(0.0)], first=2) == 0
        for name, values in right.items():
            highest = known[name]
            assert highest >= claimed
            status, found = output_derivatives(one, name, highest)
            assert status == 0 and found == pytest.approx(values[:highest], rel=1e-12), name
            if version == 3:
                status, _ = output_derivatives(one, name, highest + 1)
                assert status == 2 and "inputs beyond order 1" in one.messages[-1], name


@contextmanager
def asked(fmu: Fmu, answer: Callable[[Face, float], None], names: list[str]) -> Iterator[Any]:
    """An instance of FMI 3 by fmpy whose importer answers inside of steps."""
    seen: list[tuple[float, bool, bool]] = []

    def update(_e: Any, time: float, sets: bool, gets: bool, _f: bool, _r: bool, returns: Any, until: Any) -> None:
        seen.append((time, bool(sets), bool(gets)))
        if sets:
            answer(one, time)

    options: dict[str, Any] = {"requiredIntermediateVariables": [fmu.variables[name].valueReference for name in names]}
    with face(fmu, intermediateUpdate=update, eventModeUsed=False, **options) as one:
        one.initialize()
        yield one, seen


def test_a_cubic_force_is_asked_for_inside_one_step_of_fmi_3(fmus: dict[int, Fmu]) -> None:
    def give(one: Face, time: float) -> None:
        one.set({"F": FORCE(time)})

    with asked(fmus[3], give, ["F", "x"]) as (one, seen):
        one.set({"F": FORCE(0.0)})
        one.step(0.0, 0.4 * STEP)
        assert sum(sets for _, sets, _ in seen) == 3 and not any(sets and gets for _, sets, gets in seen)
        one.step(0.4 * STEP, 0.6 * STEP)
        assert one.get(["x", "v"]) == pytest.approx(motion(STEP), abs=1e-12)
        assert one.get(["F"])[0] == pytest.approx(FORCE(STEP), rel=1e-13)


@pytest.mark.parametrize(("written", "order"), [(False, 4), (True, 7)])
def test_a_smooth_force_is_followed_to_high_order(fmus: dict[int, Fmu], written: bool, order: int) -> None:
    """Without a jump by a cubic from where the last has ended; with the value at the start through Radau's points."""

    def error(steps: int) -> float:
        with asked(fmus[3], lambda one, time: one.set({"F": np.sin(2.0 * time)}), ["F"]) as (one, _):
            for k in range(steps):
                if written:
                    one.set({"F": np.sin(2.0 * k * STEP / steps)})
                one.step(k * STEP / steps, STEP / steps)
            return abs(one.get(["x"])[0] - exact)

    # x'' + .. = Im e^(2 i t): particular solution by its frequency response
    response = np.linalg.solve(2j * np.eye(2) - A, np.array([0.0, 1.0 / M]))
    exact = (expm(A * STEP) @ (START - response.imag) + (response * np.exp(2j * STEP)).imag)[0]
    coarse, fine = error(4), error(8)
    assert np.log2(coarse / fine) > order - 0.5


def test_an_input_that_is_not_given_goes_on_at_its_rate(fmus: dict[int, Fmu]) -> None:
    line = Polynomial([0.5, -1.5])
    with asked(fmus[3], lambda one, time: None, ["F"]) as (one, _):
        one.set({"F": line(0.0), "F_rate": line.deriv()(0.0)})
        one.step(0.0, STEP)
        assert one.get(["x", "v"]) == pytest.approx(motion(STEP, line), abs=1e-13)


def test_only_inputs_are_taken_inside_a_step(fmus: dict[int, Fmu]) -> None:
    refused = []

    def give(one: Face, time: float) -> None:
        for name in ("F_rate", "m", "F"):
            reference, value = (ctypes.c_uint32 * 1)(one.reference(name)), (ctypes.c_double * 1)(1.5)
            n = ctypes.c_size_t(1)
            refused.append(one.call("SetFloat64", reference, n, value, n))

    with asked(fmus[3], give, ["F"]) as (one, _):
        one.step(0.0, STEP)
    assert refused == [3, 3, 0] * 3
