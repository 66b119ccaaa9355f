"""Features that are flat where a step begins and not beyond: pulses in time, Stribeck curves, tanh of little width.

Crossings of a Gauss pulse are known in closed form; motions are compared with DOP853 at steps below the width.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.special import erf

from fmu_models import (
    TIME,
    Automaton,
    Coordinate,
    Coulomb,
    Friction,
    Impact,
    Mechanism,
    Parameter,
    State,
    Stop,
    Tanh,
    load,
    simulate,
    simulate_with_error,
)
from fmu_models.language.contact_dynamics import terms
from fmu_models.language.impacts import Newton
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.laws.stribeck import Stribeck
from fmu_models.simulation.sensitivity import SensitiveRun


def parameter(name: str, value: float, unit: str = "1", **bounds: Any) -> Parameter:
    return Parameter(name, value, unit, name, **bounds)


M = parameter("m", 1.0, "kg", positive=True)
K = parameter("k", 1.0, "N/m")
CENTRE, WIDTH = parameter("t0", 5.0, "s"), parameter("width", 0.1, "s", positive=True)
F, H = parameter("F", 1.0, "N"), parameter("h", 1.0, "m")
X = Coordinate("x", "m", "position", velocity="v")
BELL = sympy.exp(-(((TIME - CENTRE) / WIDTH) ** 2))
SPRING: dict[str, Any] = {"potential_energy": K * X**2 / 2}


@cache
def fmu(name: str) -> Any:
    """A block of 1 kg with what the name says."""
    mu, N = parameter("mu", 0.5, minimum=0.0), parameter("N", 10.0, "N", minimum=0.0)
    e, g = parameter("e", 0.5, minimum=0.0, maximum=1.0), parameter("g", 10.0, "m/s2")
    slow = parameter("slow", 0.01, "m/s", positive=True)
    stiff, viscous = parameter("stiff", 1e4, "N/m", minimum=0.0), parameter("viscous", 1.0, "N s/m", minimum=0.0)
    parts: dict[str, dict[str, Any]] = {
        "gap": {"contacts": [Impact(name="wall", gap=H * (1 - 2 * BELL) - X, restitution=Newton(e))]},
        "compliant": {
            "contacts": [
                Stop(name="wall", gap=H * (1 - 2 * BELL) - X, law=KelvinVoigt(stiff, viscous), release="force")
            ]
        },
        "capacity": {
            "applied": {X: F},
            "contacts": [Friction(name="floor", slip=X.v, law=Coulomb(N * (1 - 0.9 * BELL), mu))],
        },
        "closed": {
            "potential_energy": M * g * X,
            "applied": {X: F * BELL},
            "contacts": [Impact(name="floor", gap=X, restitution=Newton(e))],
        },
        "pulse": SPRING | {"applied": {X: F * BELL}},
        "pushed": {"applied": {X: F * BELL}},
        "steep": SPRING | {"contacts": [Friction(name="floor", slip=X.v, law=Tanh(Coulomb(N, mu), slow))]},
        "stribeck": SPRING
        | {
            "contacts": [
                Friction(
                    name="floor",
                    slip=X.v,
                    law=Stribeck(N, mu, parameter("mu_k", 0.3), slow, parameter("mu_v", 0.0, "s/m")),
                )
            ]
        },
        "parametric": {"applied": {X: K * X * BELL}},
    }
    about = {"name": f"narrow_{name}", "title": name, "source": "closed form", "coordinates": [X]}
    return load(Mechanism(**about, kinetic_energy=M * X.v**2 / 2, **parts[name]))


WIDTHS = (1.0, 0.3, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@pytest.mark.parametrize(
    ("name", "ratio", "values"), [("gap", 2.0, {}), ("capacity", 2.25, {"F": 3.0}), ("closed", 3.0, {"F": 30.0})]
)
def test_every_thin_contact_is_seen(name: str, ratio: float, values: dict[str, float]) -> None:
    """The instant at which a pulse of each width opens or closes the contact; steps grow with the log of the width."""
    steps = []
    for width in WIDTHS:
        run = simulate(fmu(name), 10.0, parameters={"width": width, **values}, output_times=[10.0])
        assert run.events[0].time == pytest.approx(5.0 - width * math.sqrt(math.log(ratio)), abs=1e-14)
        steps.append(run.steps)
    assert steps[-1] - steps[2] < 5 * 60


def test_thin_contact_with_a_compliant_wall_is_seen() -> None:
    run = simulate(fmu("compliant"), 10.0, parameters={"width": 1e-3}, output_times=[10.0])
    assert run.events[0].time == pytest.approx(5.0 - 1e-3 * math.sqrt(math.log(2.0)), abs=1e-14)


@pytest.mark.parametrize("unit", [2.0**-12, 2.0**12])
def test_slow_and_quick_motions_take_the_same_steps(unit: float) -> None:
    """The motion of seconds, with all times so many times as long."""

    def swing(s: float) -> Any:
        values = {"width": 0.1 * s, "t0": 5.0 * s, "k": s**-2, "F": s**-2}
        return simulate(fmu("pulse"), 10.0 * s, parameters=values, start={"x": 1.0}, output_times=[10.0 * s])

    known, other = swing(1.0), swing(unit)
    assert other.steps == known.steps
    assert other["x"][-1] == pytest.approx(known["x"][-1], abs=1e-13)


@pytest.mark.parametrize("width", WIDTHS)
def test_thin_pulse_gives_its_impulse(width: float) -> None:
    run = simulate(fmu("pushed"), 10.0, parameters={"width": width}, output_times=[10.0])
    impulse = math.sqrt(math.pi) / 2 * width * (erf(5.0 / width) + erf(5.0 / width))
    assert run["v"][-1] == pytest.approx(impulse, rel=1e-12)


def reference(rates: Callable[[float, np.ndarray], list[float]], start: list[float], end: float, step: float) -> Any:
    return solve_ivp(rates, (0, end), start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=step).y[:, -1]


def test_derivative_by_a_pulse_of_no_size_upon_a_free_block() -> None:
    """Neither the motion nor the derivative of a state has anything to see before the pulse: 5 s later, its impulse."""
    with SensitiveRun(fmu("pushed"), by=["F"], recorded=["x", "v"]) as run:
        slopes = run.run([10.0], parameters={"F": 0.0, "width": 1e-4}, start={"x": 0.3, "v": 0.1})
    impulse = math.sqrt(math.pi) * 1e-4
    np.testing.assert_allclose(slopes.derivative[-1].ravel(), [5.0 * impulse, impulse], rtol=1e-9)


def test_derivative_by_a_normal_force_that_is_zero() -> None:
    """The rise of friction at low speed, on both sides of a reversal, where the motion has no friction."""
    start, values = {"x": -0.40625, "v": -0.09375}, {"slow": 1 / 256, "mu": 1.0, "mu_k": 0.0}
    with SensitiveRun(fmu("stribeck"), by=["N"], recorded=["x", "v"]) as run:
        slopes = run.run([3.0], parameters={"N": 0.0, **values}, start=start)
    ends = [
        simulate(fmu("stribeck"), 3.0, parameters={"N": N, **values}, start=start, output_times=[3.0])
        for N in (1e-4, 2e-4, 0.0)
    ]
    near, far, none = (np.array([end["x"][-1], end["v"][-1]]) for end in ends)
    expected = (4 * near - far - 3 * none) / 2e-4
    np.testing.assert_allclose(slopes.derivative[-1].ravel(), expected, rtol=1e-3, atol=1e-8)


@pytest.mark.parametrize("width", [1.0, 0.1, 0.01])
def test_pulse_upon_a_spring(width: float) -> None:
    run = simulate(fmu("pulse"), 10.0, parameters={"width": width}, start={"v": 0.1}, output_times=[10.0])
    expected = reference(lambda t, y: [y[1], -y[0] + math.exp(-(((t - 5) / width) ** 2))], [0, 0.1], 10.0, width / 4)
    np.testing.assert_allclose([run["x"][-1], run["v"][-1]], expected, atol=2e-12)


@pytest.mark.parametrize("slow", [0.1, 0.01, 1e-3])
def test_steep_tanh(slow: float) -> None:
    values = {"slow": slow, "N": 3.5, "mu": 0.2}
    run = simulate(fmu("steep"), 3.0, parameters=values, start={"v": -1.0}, output_times=[3.0])
    expected = reference(lambda t, y: [y[1], -y[0] - 0.7 * math.tanh(y[1] / slow)], [0, -1.0], 3.0, slow / 4)
    np.testing.assert_allclose([run["x"][-1], run["v"][-1]], expected, atol=2e-12)


@pytest.mark.parametrize("slow", [1.0, 0.1, 0.01, 1e-3, 1e-4])
def test_stick_after_a_stribeck_curve(slow: float) -> None:
    """A block that comes to rest through the rise of friction at low speed: where and when it sticks."""
    run = simulate(
        fmu("stribeck"), 2.0, parameters={"slow": slow, "N": 1.0}, start={"v": -1.0}, output_times=np.linspace(0, 2, 5)
    )

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -y[0] + 0.3 + 0.2 * math.exp(-((y[1] / slow) ** 2))]

    def rest(t: float, y: np.ndarray) -> float:
        return y[1]

    rest.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  # how scipy is told
    way = solve_ivp(rates, (0, 2), [0, -1.0], method="DOP853", rtol=1e-13, atol=1e-15, max_step=slow / 3, events=rest)
    first = run.events[0]
    assert first.time == pytest.approx(way.t_events[0][0], abs=2e-12)


def test_derivatives_see_a_pulse_that_the_motion_does_not() -> None:
    """x'' = k x exp(-((t - t0)/w)^2) at rest in x = 0: the motion stays, its derivative by x does not."""
    width = 0.01
    with SensitiveRun(fmu("parametric"), by=["x"], recorded=["x", "v"]) as run:
        result = run.run([10.0], parameters={"width": width, "k": 100.0})
    # from where the pulse begins to where it is over
    x, v = reference(lambda t, y: [y[1], 100 * y[0] * math.exp(-(((t - 0.1) / width) ** 2))], [1, 0], 0.2, width / 4)
    np.testing.assert_allclose(np.ravel(result.derivative)[-2:], [x + 4.9 * v, v], rtol=1e-10)


@pytest.mark.parametrize("width", [0.1, 1e-3, 1e-6])
def test_derivatives_by_an_amplitude_that_is_zero(width: float) -> None:
    """x'' + x = F exp(-((t - t0)/w)^2) at F = 0: dx/dF = w sqrt(pi) exp(-w^2/4) sin(t - t0)."""
    with SensitiveRun(fmu("pulse"), by=["F"], recorded=["x", "v"]) as run:
        result = run.run([8.0], parameters={"F": 0.0, "width": width}, start={"x": 0.3, "v": 0.1})
    impulse = width * math.sqrt(math.pi) * math.exp(-(width**2) / 4)
    np.testing.assert_allclose(np.ravel(result.derivative) / impulse, [math.sin(3.0), math.cos(3.0)], rtol=1e-9)


def test_derivatives_where_a_neighbour_is_beside_a_pole() -> None:
    """x' = tanh(4 x): sinh(4 x(t)) = sinh(4 x(0)) exp(4 t). The disc of tanh as large as x has no bound."""
    x = State("x", "1", "x", start=-0.5)
    rate = parameter("rate", 1.0, "1/s")
    model = Automaton(
        name="steep", title="Steep", source="closed form", states=[x], flows={x: rate * sympy.tanh(4 * x)}, switches=[]
    )
    with SensitiveRun(load(model), by=["x"], recorded=["x"]) as run:
        result = run.run([0.5])
    end = np.arcsinh(np.sinh(-2.0) * np.exp(2.0)) / 4.0
    assert np.ravel(result.values)[-1] == pytest.approx(end, rel=1e-12)
    derivative = np.cosh(-2.0) * np.exp(2.0) / np.cosh(4.0 * end)
    assert np.ravel(result.derivative)[-1] == pytest.approx(derivative, rel=1e-11)


def test_a_step_that_ends_where_a_contact_just_let_go() -> None:
    """Companions of a run end steps at a release, where the slip leaves zero with its square."""
    mu, N, amp = parameter("mu", 0.34), parameter("N", 3.0, "N"), parameter("amp", 0.22, "m/s")
    plate = amp * sympy.exp(-(((TIME - 1.6) / 0.5) ** 2))
    model = Mechanism(
        name="pulsed_plate",
        title="Block on a pulsed plate",
        source="closed form",
        coordinates=[X],
        kinetic_energy=M * X.v**2 / 2,
        potential_energy=4 * K * X**2 / 2,
        contacts=[Friction(name="plate", slip=X.v - plate, law=Coulomb(N, mu))],
    )
    for start in (0.1, 0.2, 0.25, 0.3):
        estimate = simulate_with_error(load(model), 3.0, start={"x": start, "v": 0.3})[1]
        assert not estimate.refused and estimate.wrong is None and estimate.relative < 1e-11


def test_steps_stay_long_where_a_coupling_of_the_inertia_passes_zero():
    """The inverse has an entry that passes zero there, and so has what the discs of the accelerations begin with."""
    q0, q1, q2, q3 = (Coordinate(f"q{i}", "1", f"q{i}") for i in range(4))
    h = parameter("h", 0.375)
    speeds = q0.v**2 + q1.v**2 * (1 + q0**2 / 4) + q2.v**2 + q3.v**2 + (q1.v + q2.v) ** 2
    law = Stribeck(N=sympy.S.One, mu_s=h + h / 8, mu_k=h, v_s=sympy.Rational(1, 16), mu_v=sympy.S.Zero)
    coupled = Mechanism(
        name="coupled",
        title="Coupled",
        source="tests",
        coordinates=[q0, q1, q2, q3],
        kinetic_energy=speeds / 2 + h * q2.v * q3.v * sympy.cos(q3 - q2),
        potential_energy=q0**2 / 2,
        contacts=[Friction(name="rubs", slip=q3.v - 1, law=law)],
    )
    start = {"q0": -0.8, "q2": 0.8, "q3": -0.7, "q0_v": -0.5, "q1_v": 0.4, "q2_v": 1.3, "q3_v": -1.5}
    run = simulate(load(coupled), 1.0, start=start, output_times=[0.0, 1.0])
    assert (run["q3"] - run["q2"])[-1] < -math.pi / 2 < (run["q3"] - run["q2"])[0] + 0.1
    assert run.steps < 15


def test_terms_of_a_pulse_are_finite_far_from_it():
    at, width = parameter("at", 1.9), parameter("width", 1 / 64)
    pulse = sympy.exp(-(((TIME - at) / width) ** 2))
    x = Coordinate("x", "m", "x")
    assert terms(x + pulse * (x + 1)) == sympy.Add.make_args(x + x * pulse + pulse)


def test_the_shipped_law_of_stribeck_sticks_where_radau_says():
    """From x = .2 the block comes to its belt at .320311 s; a step that did not see the curve came at .320805 s."""
    run = simulate(load("block_on_belt", laws={"belt": "stribeck"}), 0.4, start={"x": 0.2})
    assert run.events[0].time == pytest.approx(0.320311, abs=1e-6)
