"""The block on a belt against closed forms, and against an independent code where there are none.

A test of a model of your own can begin as a copy of this one: an equilibrium, a phase with a closed form, a limit in
which all of the motion has one, and the whole motion by somebody else's integrator.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmu_models import Fmu, load, simulate

pytestmark = pytest.mark.digits

# of the declaration; SI units
M, K, C, N, MU_S, MU_K, P, V = 1.0, 100.0, 0.5, 9.81, 0.65, 0.35, 15.0, 0.1
# events and states come from Taylor series of the engine's order: what is left is rounding
ROUNDING = 1e-12
# of the peer, which is asked for 1e-13 per step and finds its events to four of its rounding units
PEER = 1e-10


def mu(slip: float, mu_s: float = MU_S, mu_k: float = MU_K) -> float:
    """Conti's law."""
    return (mu_s - mu_k) / (1.0 + P * abs(slip)) + mu_k


@pytest.fixture(scope="module")
def block() -> Fmu:
    return load("block_on_belt")


def test_at_rest_on_the_slipping_belt_the_spring_carries_the_friction(block):
    x = N * mu(V) / K
    run = simulate(block, 0.1, start={"x": x, "v": 0.0}, inputs={"v_belt": V})
    assert run["F"] == pytest.approx(N * mu(V), rel=ROUNDING)
    # the equilibrium is unstable (friction falls with speed): rounding grows, in a tenth of a second by little
    assert run["x"] == pytest.approx(x, rel=ROUNDING)
    assert np.abs(run["v"]).max() < ROUNDING


def test_the_belt_carries_the_block_until_the_spring_tears_it_off(block):
    end = (N * MU_S - C * V) / (K * V)  # k x + c v = N mu_s with x = v t
    run = simulate(block, 0.9 * end, start={"x": 0.0, "v": V}, inputs={"v_belt": V})
    assert (run["belt_state"] == 0).all()
    assert run["x"] == pytest.approx(V * run.time, abs=ROUNDING)
    assert run["F"] == pytest.approx(K * V * run.time + C * V, rel=ROUNDING)
    release = simulate(block, 1.1 * end, start={"x": 0.0, "v": V}, inputs={"v_belt": V}).events[0]
    assert (release.contact, release.before, release.after) == ("belt", 0, -1)
    assert release.time == pytest.approx(end, rel=ROUNDING)


def test_with_coulomb_friction_the_slip_is_a_damped_swing(block):
    """mu_k = mu_s: x'' + (c/m) x' + (k/m)(x - N mu/k) = 0 from the release on, and no second stick."""
    release = (N * MU_S - C * V) / (K * V)
    decay, centre = C / (2 * M), N * MU_S / K
    omega = math.sqrt(K / M - decay**2)
    run = simulate(block, release + 3.0, parameters={"mu_k": MU_S}, start={"x": 0.0, "v": V}, inputs={"v_belt": V})
    t = run.time[run.time > release] - release
    begin = V * release - centre
    swing = np.exp(-decay * t) * (begin * np.cos(omega * t) + (V + decay * begin) / omega * np.sin(omega * t))
    assert run["x"][run.time > release] == pytest.approx(centre + swing, rel=ROUNDING)
    assert len(run.events) == 1


def test_the_whole_cycle_against_another_integrator(block):
    """Stick by its closed form, slip by Dormand and Prince's method of order 8: times of the events, and the state."""
    run = simulate(block, 4.0, start={"x": 0.0, "v": V}, inputs={"v_belt": V})
    assert len(run.events) >= 4

    def slipping(_, state):
        x, v = state
        return [v, (-K * x - C * v + N * mu(v - V)) / M]

    class CaughtUp:
        terminal, direction = True, 1.0

        def __call__(self, _, state):
            return state[1] - V

    tear = (N * MU_S - C * V) / K  # where the block leaves the belt
    time, x = 0.0, 0.0
    for release, stick in zip(run.events[0::2], run.events[1::2], strict=False):
        time += (tear - x) / V
        assert release.time == pytest.approx(time, rel=PEER)
        found = solve_ivp(
            slipping, (0.0, 2.0), [tear, V], "DOP853", events=CaughtUp(), rtol=1e-13, atol=1e-15, first_step=1e-6
        )
        time, x = time + found.t_events[0][-1], found.y_events[0][-1][0]
        assert stick.time == pytest.approx(time, rel=PEER)
        assert (stick.before, stick.after) == (-1, 0)
