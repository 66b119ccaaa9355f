"""Resets as events and sections: integrate-and-fire neuron, rimless wheel, against their closed forms.

Sources: Keener, Hoppensteadt and Rinzel, SIAM Journal on Applied Mathematics 41 (1981) (locking of the neuron);
McGeer, International Journal of Robotics Research 9 (1990) (the wheel).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from mechanisms import opened
from resetting import neuron, wheel
from scipy.optimize import root_scalar

from fmu_models import Impacts, SensitiveRun, Strobe, basins, branch, homoclinic, lyapunov, orbit_diagram, simulate
from fmu_models.simulation.results import read_trajectory, write_trajectory

# of the neuron at I = 1.2, driven with the period 1.6
CURRENT, PERIOD = 1.2, 1.6
INTERVAL = math.log(CURRENT / (CURRENT - 1.0))
# the least amplitude at which there is one spike a period
LOCKS = abs(1.0 / (1.0 - math.exp(-PERIOD)) - CURRENT) * math.hypot(1.0, 2 * math.pi / PERIOD)


@pytest.fixture(scope="module")
def firing():
    return opened(neuron())


@pytest.fixture(scope="module")
def rolling():
    return opened(wheel())


def step_of_wheel(gamma: float, alpha: float = 0.2) -> tuple[float, float]:
    """Speed after a spoke in the steady roll, and the multiplier: w-^2 = w+^2 + 4 sin(gamma) sin(alpha)."""
    keeps = math.cos(2 * alpha) ** 2
    return math.sqrt(keeps * 4 * math.sin(gamma) * math.sin(alpha) / (1 - keeps)), keeps


def test_a_neuron_tells_its_spikes(firing, tmp_path):
    run = simulate(firing, 8.0, start={"V": 0.0})
    assert [event.time for event in run.events] == pytest.approx(INTERVAL * np.arange(1, 5), rel=1e-13)
    assert all(event.reset and event.clock == "reset" and event.before == event.after == 1 for event in run.events)
    assert str(run.events[0]) == f"{INTERVAL:.9g} s: spike slip+ -> slip+, reset"
    write_trajectory(run, tmp_path / "run.h5")
    assert tuple(read_trajectory(tmp_path / "run.h5").trajectory.events) == tuple(run.events)


def test_interspike_intervals_are_steps_of_a_section(firing):
    step = Impacts(firing, "spike").step(np.array([[0.0]]))
    assert step.times == pytest.approx([INTERVAL], rel=1e-13)
    assert step.began.tolist() == [[1]] and step.points.tolist() == [[0.0]]


def test_a_driven_neuron_locks_where_it_must(firing):
    """V = 1 one period after a reset at t: A (cos wt + w sin wt) = (1 + w^2) (1/(1 - exp(-T)) - I)."""
    driven = Strobe(firing, forcing="omega", parameters={"A": 0.3})
    locked = branch(driven, "A", (0.1, 0.4), settle=True)
    (fold,) = locked.special
    assert (fold.kind, fold.value) == ("fold", pytest.approx(LOCKS, rel=1e-7))
    section = Impacts(firing, "spike", forcing="omega", parameters={"A": 0.3})
    sweep = orbit_diagram(section, "A", [0.15, 0.3], transient=200)
    assert sweep.periods.tolist() == [[0, 1]]
    late = math.atan(2 * math.pi / PERIOD) - math.acos(LOCKS / 0.3)
    assert 2 * math.pi * sweep.frame["phase"].to_numpy()[-1] == pytest.approx(late, rel=1e-9)
    grid = basins(section, V=np.linspace(0.0, 0.9, 4))
    assert len(grid.attractors) == 1 and not (grid.labels != 0).any()


def test_a_phase_locked_neuron_has_its_exponent(firing):
    """dt'/dt = exp(-T) (rate of V after the reset) / (rate before it)."""
    section = Impacts(firing, "spike", forcing="omega", parameters={"A": 0.3})
    exponents = lyapunov(section, periods=400, transient=200)
    phase = orbit_diagram(section, "A", [0.3], transient=200).frame["phase"].to_numpy()[-1]
    push = CURRENT + 0.3 * math.cos(2 * math.pi * phase)
    assert exponents.values == pytest.approx([math.log(math.exp(-PERIOD) * push / (push - 1.0))], rel=1e-10)


def test_a_wheel_rolls_as_mcgeer_has_it(rolling):
    section = Impacts(rolling, "spoke")
    speed, multiplier = step_of_wheel(0.08)
    step = section.step(np.array([[0.08 - 0.2, speed]]))
    assert step.points[0] == pytest.approx([0.08 - 0.2, speed], rel=1e-13)
    assert step.derivatives[0, 1, 1] == pytest.approx(multiplier, rel=1e-12)
    sweep = orbit_diagram(section, "gamma", [0.06, 0.1], transient=300, start={"q": -0.12, "w": speed})
    assert sweep.frame["w"].to_numpy() == pytest.approx([step_of_wheel(g)[0] for g in (0.06, 0.1)], rel=1e-9)
    exponents = lyapunov(section, [-0.12, speed], periods=100, transient=100)
    assert exponents.values == pytest.approx([math.log(multiplier)], rel=1e-9)


def test_a_branch_of_the_wheel_has_its_multiplier(rolling):
    start = {"q": -0.12, "w": step_of_wheel(0.08)[0]}
    rolls = branch(Strobe(rolling, period=0.667, autonomous=True), "gamma", (0.06, 0.1), settle=True, start=start)
    assert set(rolls.words) == {(("spoke", 1, 1),)}
    largest = [np.sort(np.abs(multipliers - 1.0))[-1] for multipliers in rolls.multipliers]
    assert largest == pytest.approx([1.0 - step_of_wheel(0.0)[1]] * len(largest), rel=1e-7)


def test_a_branch_of_the_wheel_ends_at_its_saddle(rolling):
    """Where its speed at the apex is zero the wheel rolls for ever: w+^2 = 2 (1 - cos(gamma - alpha))."""
    start = {"q": -0.12, "w": step_of_wheel(0.08)[0]}
    system = Strobe(rolling, period=0.667, autonomous=True, parameters={"gamma": 0.08})
    rolls = branch(system, "gamma", (0.001, 0.1), settle=True, start=start)
    assert [kind for kind, _ in rolls.ends] == ["homoclinic", "range"] and "saddle q = " in rolls.ends[0][1]
    (end,) = rolls.special

    def apex(gamma):
        return step_of_wheel(gamma)[0] ** 2 - 2 * (1 - math.cos(gamma - 0.2))

    known = root_scalar(apex, bracket=(0.001, 0.02), xtol=1e-16).root
    assert (end.kind, end.value) == ("homoclinic", pytest.approx(known, abs=1e-13))
    found = homoclinic(rolling, "gamma", (0.004, 0.02), start={"q": 0.0, "w": 0.0})
    assert found.value == pytest.approx(known, abs=1e-15)
    assert "a cycle" in found.summary()


def test_tangents_go_through_resets(rolling, firing):
    """A spoke leaves c^2 of w^2; the neuron's interval is ln(I/(I - 1))."""
    keeps, w0 = math.cos(0.4) ** 2, 0.6
    end = SensitiveRun(rolling, by=["w"]).run([1.5], start={"q": -0.12, "w": w0})
    assert len(end.events) == 2
    (q, w), (dq, dw) = end.values[-1, :2], end.derivative[-1, :2, 0]
    assert w * dw - math.sin(q) * dq == pytest.approx(keeps**2 * w0, rel=1e-11)
    spikes = SensitiveRun(firing, by=["I"]).run([8.0], start={"V": 0.0})
    slope = 1 / CURRENT - 1 / (CURRENT - 1)
    assert spikes.event_derivative[:, 0] == pytest.approx(slope * np.arange(1, 5), rel=1e-11)
