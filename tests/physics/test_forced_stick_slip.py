"""The forced stick-slip oscillator: equations (15), (16), Figs. 8 to 10.

The periodic points on its 1/2-subharmonic loop come from an independent event-driven code in extended precision and
are printed with twelve decimals. s = k x - f0 cos(omega t) is what stick must hold.
"""

from __future__ import annotations

import numpy as np
import pytest
from lazy_fmu import LazyFmu
from replay import replay, straight

from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

pytestmark = pytest.mark.digits

BLOCK = LazyFmu("forced_stick_slip")
POINTS = [
    # branch, omega, forcing periods, x0, v0, largest multiplier, stick time
    ("I", 1.6, 2, 1.040922001474, -0.720488407813, 0.4646435094, 0.674980833048),
    ("I", 1.67587, 2, 1.652839449281, -0.835945777956, 0.7657716081, 0.644233608713),
    ("V", 1.67587, 2, 2.079734897160, -0.631175144660, 1.3881738006, 0.327252603855),
    ("IV", 1.67587, 2, 2.122917263608, -0.494267912184, -1.2299351068, 0.0),
    ("II", 1.8, 2, 0.727294230053, 0.445984295430, 2.4934257148, 0.0),
    ("VI", 1.71, 4, 1.891443599339, -0.262041095369, 0.9064831293, 0.0),
    ("VIII", 1.69, 8, 2.164846083735, -0.491606021503, -2.5127615173, 0.132401706368),
]


def run(x: float, v: float, stop: float, omega: float = 1.6, **options) -> Trajectory:
    parameters = {"omega": omega, **options.pop("parameters", {})}
    return simulate(BLOCK, stop, start={"x": x, "v": v}, parameters=parameters, **options)


def end_of(trajectory: Trajectory) -> list[float]:
    return [trajectory["x"][-1], trajectory["v"][-1]]


def rates(omega: float, v_dr: Signal):
    """(15), (16) typed out, with the values of the paper."""

    def within(middle, contacts):
        sign = contacts["belt"]
        speed, slope = straight(v_dr, middle)
        if sign == 0:
            return lambda t, y: [y[1], slope]

        def slipping(t, y):
            x, v = y
            w = v - speed(t)
            return [v, -x + 0.1 * np.cos(omega * t) - sign * 1.5 + 1.5 * w - 0.45 * w**3]

        return slipping

    return within


def path(trajectory: Trajectory) -> list[int]:
    """States of the contact in order."""
    return [trajectory.events[0].before, *(event.after for event in trajectory.events)]


def sticks(trajectory: Trajectory) -> list[tuple[float, float]]:
    """Start and length of each stick that begins and ends within the run."""
    pairs = zip(trajectory.events[:-1], trajectory.events[1:], strict=True)
    return [(a.time, b.time - a.time) for a, b in pairs if a.after == 0]


@pytest.mark.parametrize(("branch", "omega", "n", "x", "v", "multiplier", "stick"), POINTS)
def test_periodic_point_returns_to_itself(branch, omega, n, x, v, multiplier, stick):
    """Stable or not: after n forcing periods the state is back, to 1e-9 times what the multiplier makes of it."""
    trajectory = run(x, v, n * 2 * np.pi / omega, omega)
    assert end_of(trajectory) == pytest.approx([x, v], abs=1e-9 * max(1.0, abs(multiplier)))
    assert sum(length for _, length in sticks(trajectory)) == pytest.approx(stick, abs=1e-9)
    # not periodic in less
    earlier = run(x, v, n // 2 * 2 * np.pi / omega, omega)
    assert np.abs(np.subtract(end_of(earlier), [x, v])).max() > 1e-2


@pytest.mark.parametrize(
    ("start", "end", "states"),
    [
        ((-2.5, 0.5), (0.078919248812072, -0.015613641044143), [-1, 1, 0, -1]),
        ((1.0, 3.0), (0.617697652981217, 0.699751528024382), [1, -1]),
        ((-1.4, 1.0), (0.102054048915192, -0.084066493851102), [0, -1]),
    ],
)
def test_state_after_two_periods(start, end, states):
    trajectory = run(start[0], start[1], 4 * np.pi / 1.6)
    assert end_of(trajectory) == pytest.approx(end, abs=1e-12)
    assert path(trajectory) == states


@pytest.mark.parametrize(("branch", "omega", "n", "x", "v", "multiplier", "stick"), POINTS)
def test_another_integrator_agrees(branch, omega, n, x, v, multiplier, stick):
    stop = n * 2 * np.pi / omega
    trajectory = run(x, v, stop, omega, output_times=[0.0, stop])
    again = replay(trajectory, ["x", "v"], rates(omega, Signal.constant(1.0, 0.0, stop)))
    assert end_of(trajectory) == pytest.approx(again.tolist(), abs=1e-9)


@pytest.mark.parametrize(("branch", "omega", "n", "x", "v", "multiplier", "stick"), POINTS)
def test_stick_ends_at_the_friction_force_at_rest(branch, omega, n, x, v, multiplier, stick):
    """Release only at s = +a0, backwards, with the slip speed and its rate at zero."""
    trajectory = run(x, v, n * 2 * np.pi / omega, omega)
    releases = [event for event in trajectory.events if event.before == 0]
    assert bool(releases) == bool(stick)
    for event in releases:
        at = run(x, v, event.time, omega, output_times=[event.time])
        assert at["x"][0] - 0.1 * np.cos(omega * event.time) == pytest.approx(1.5, abs=1e-12)
        assert [at["slip"][0], at["der(v)"][0]] == pytest.approx([0.0, 0.0], abs=1e-12)
        assert event.after == -1


def test_stable_motion_is_kept_for_thousands_of_periods():
    """4000 forcing periods: the phase of the force is still that of the clock."""
    omega, _, x, v, *_ = POINTS[0][1:]
    stop = 4000 * 2 * np.pi / omega
    trajectory = run(x, v, stop, omega, output_times=[stop])
    assert end_of(trajectory) == pytest.approx([x, v], abs=1e-9)
    assert len(trajectory.events) == 4000


def test_a_stick_much_shorter_than_a_step_is_found():
    """A stick of 0.07 s between two slips in the same direction, which an integrator of high order steps over.

    From the point on V, where stick lasts 0.327 s, towards IV, which passes the belt speed by: every stick on the way
    is there, down to none, and all agree with a run of smaller steps.
    """
    V, IV = np.array(POINTS[2][3:5]), np.array(POINTS[3][3:5])
    lengths = []
    for share in np.linspace(0.0, 1.0, 81):
        x, v = (V + share * (IV - V)).tolist()
        coarse, tight = (run(x, v, 4 * np.pi / 1.67587, 1.67587, tolerance=tolerance) for tolerance in (1e-12, 1e-15))
        assert [e.after for e in coarse.events] == [e.after for e in tight.events]
        assert [e.time for e in coarse.events] == pytest.approx([e.time for e in tight.events], abs=1e-9)
        lengths += [length for _, length in sticks(coarse)]
    assert min(lengths) < 0.02
    assert max(lengths) > 0.3
    assert any(0.06 < length < 0.08 for length in lengths)


@pytest.mark.parametrize("offset", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("touches", [True, False])
def test_grazing_the_belt_speed(offset, touches):
    """Slip that comes up to zero and turns there: v = 1 and s = a0 at once, as in the points A, B, C of Fig. 8.

    Near t = 0 and zero slip y' = a0 - s and s' = 1 but for small terms: from s = a0 - d, y = -h slip comes up to
    d^2/2 - h and turns.
    """
    d = np.sqrt(offset)
    h = (0.45 if touches else 0.55) * d**2
    trajectory = run(1.5 - d + 0.1, 1.0 - h, 0.5)
    assert (0 in [event.after for event in trajectory.events]) == touches


@pytest.mark.parametrize(("x", "state"), [(1.6, -1), (-1.4, 0), (1.6 - 1e-9, 0), (-1.4 - 1e-9, 1), (1.6 + 1e-9, -1)])
def test_start_at_zero_slip(x, state):
    """At s = +a0 the block slips, at s = -a0 it sticks, since s' = v = 1 (t = 0: x = s + f0)."""
    trajectory = run(x, 1.0, 1e-10)
    assert trajectory["belt_state"][-1] == state
    assert trajectory.events == () or trajectory.events[0].time == 0.0


def test_belt_that_reverses():
    """Stick, slip both ways, and a belt speed that passes through zero twice; against another integrator."""
    belt = Signal([0, 4, 12, 20, 30], [1.0, 1.0, -1.2, 0.8, 0.8])
    runs = [
        run(1.0, 0.5, 30.0, inputs={"v_dr": belt}, tolerance=tolerance, output_times=[0.0, 30.0])
        for tolerance in (1e-12, 1e-15)
    ]
    assert {event.after for event in runs[0].events} == {-1, 0, 1}
    assert [e.time for e in runs[0].events] == pytest.approx([e.time for e in runs[1].events], abs=1e-9)
    again = replay(runs[0], ["x", "v"], rates(1.6, belt), bends=belt.time[1:-1])
    assert end_of(runs[0]) == pytest.approx(again.tolist(), abs=1e-9)


def test_no_friction_is_the_forced_oscillator():
    """a0 = a1 = a3 = 0: x = (x0 - A) cos t + v0 sin t + A cos(omega t), A = f0/(1 - omega^2)."""
    trajectory = run(0.5, 2.0, 50.0, parameters={"a0": 0.0, "a1": 0.0, "a3": 0.0})
    t, A = trajectory.time, 0.1 / (1 - 1.6**2)
    exact = (0.5 - A) * np.cos(t) + 2.0 * np.sin(t) + A * np.cos(1.6 * t)
    assert np.abs(trajectory["x"] - exact).max() < 1e-11
    assert {event.after for event in trajectory.events} == {-1, 1}


def test_constant_friction_comes_to_rest_in_straight_lines():
    """a1 = a3 = f0 = 0, belt at rest: each half swing shrinks by 2 a0/k until |k x| < a0."""
    parameters = {"a1": 0.0, "a3": 0.0, "f0": 0.0, "a0": 0.3}
    trajectory = run(4.0, 0.0, 40.0, inputs={"v_dr": 0.0}, parameters=parameters)
    half_swings = np.ceil((4.0 - 0.3) / 0.6)
    assert trajectory["x"][-1] == pytest.approx((-1) ** half_swings * (4.0 - 0.6 * half_swings), abs=1e-12)
    assert trajectory["belt_state"][-1] == 0
