"""Friction of rate and state: a block on a belt against each phase integrated by itself, in stick in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

M, K, LOAD, BELT = 1.25, 60.0, 4.905, 0.05  # kg, N/m, N, m/s
MU, WEAKENING, A, D_C, V_R, V_C = 0.5, 0.02, 0.01, 1e-4, 0.05, 1e-6
PARAMETERS = {"m": M, "k": K, "N": LOAD, "c": 0.0, "mu_r": MU, "weakening": WEAKENING, "a": A, "D_c": D_C}

# rate of the age at a slip speed, and the age after a time at rest
RATES: dict[str, Callable[[float, float], float]] = {
    "dieterich": lambda speed, age: 1 - (speed + V_C) * age / D_C,
    "ruina": lambda speed, age: -(speed + V_C) * age / D_C * math.log((speed + V_C) * age / D_C),
}
AGED: dict[str, Callable[[float, float], float]] = {
    "dieterich": lambda age, t: D_C / V_C + (age - D_C / V_C) * math.exp(-V_C * t / D_C),
    "ruina": lambda age, t: D_C / V_C * math.exp(math.log(V_C * age / D_C) * math.exp(-V_C * t / D_C)),
}


def friction(speed: float, age: float) -> float:
    """Magnitude of the force, N."""
    rate = A * math.log((speed + V_C) / V_R)
    return LOAD * (MU + rate + (A + WEAKENING) * math.log(V_R * age / D_C))


def phases(law: str, count: int) -> list[tuple[float, float, float]]:
    """Time, place and age at the ends of stick and slip in turn, from rest on the belt at x = 0 and age 1 s."""
    t, x, age, marks = 0.0, 0.0, 1.0, []
    for _ in range(count):

        def margin(d: float, x: float = x, age: float = age) -> float:
            return K * (x + BELT * d) - friction(0.0, AGED[law](age, d))

        held = float(np.asarray(brentq(margin, 1e-9, 10.0, xtol=1e-15)))
        t, x, age = t + held, x + BELT * held, AGED[law](age, held)
        marks.append((t, x, age))

        def rates(_: float, y: np.ndarray) -> list[float]:
            speed = max(BELT - y[1], 0.0)
            return [y[1], (friction(speed, y[2]) - K * y[0]) / M, RATES[law](speed, y[2])]

        def stops(_: float, y: np.ndarray) -> float:
            return y[1] - BELT

        stops.terminal, stops.direction = True, 1.0  # type: ignore[attr-defined]
        run = solve_ivp(rates, (0.0, 5.0), [x, BELT, age], method="DOP853", rtol=2.3e-14, atol=1e-16, events=stops)
        t, (x, _, age) = t + run.t_events[0][0], run.y_events[0][0]
        marks.append((t, x, age))
    return marks


@pytest.mark.parametrize("law", RATES)
def test_stick_and_slip_of_a_block_on_a_belt(law: str) -> None:
    fmu = Fmu.open(built("block_on_belt", laws={"belt": law}))
    expected = phases(law, 3)
    start = {"x": 0.0, "v": BELT}
    run = simulate(fmu, expected[-1][0] + 1e-3, parameters=PARAMETERS, inputs={"v_belt": BELT}, start=start)
    found = [event.time for event in run.events if event.time > 0]
    np.testing.assert_allclose(found, [time for time, _, _ in expected], rtol=1e-9)
    there = simulate(
        fmu, found[-1], parameters=PARAMETERS, inputs={"v_belt": BELT}, start=start, output_times=np.array(found)
    )
    np.testing.assert_allclose(there["x"], [place for _, place, _ in expected], rtol=1e-9)
    np.testing.assert_allclose(there["theta"], [age for _, _, age in expected], rtol=1e-8)


def test_breakaway_grows_by_b_for_every_factor_e_in_stick() -> None:
    """A belt that hardly moves pulls for a time that its speed says; the force at release is the friction at rest."""
    fmu = Fmu.open(built("block_on_belt", laws={"belt": "dieterich"}))
    released = []
    for speed in (1e-3, 1e-2):
        stop = 1.1 * LOAD / K / speed
        run = simulate(fmu, stop, parameters=PARAMETERS, inputs={"v_belt": speed}, start={"x": 0.0, "v": speed})
        first = next(event.time for event in run.events if event.time > 0)
        released.append((first, K * speed * first))
    (long, high), (short, low) = released
    # from age 1 s on, as nearly as creep leaves it
    ages = [AGED["dieterich"](1.0, time) for time in (long, short)]
    assert high - low == pytest.approx(LOAD * (A + WEAKENING) * math.log(ages[0] / ages[1]), rel=1e-9)
    assert high > low + 0.1
