"""The disc rig with one disc at a time (class c): equations (21) to (26).

The reference cycle comes from an independent event-driven Taylor code of order 26, confirmed to 1e-12 by a code of
order 8; the speeds of the bifurcations are known to the digits given.
"""

from __future__ import annotations

import numpy as np
import pytest
from disc_rates import LINER_RUBBER, STATES, disc_rates, normal_forces
from lazy_fmu import LazyFmu
from replay import replay
from steady_cycle import disc_rig, steady_cycle

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

RIG = LazyFmu("disc_rig_sequential")
SPEED = 0.06 / 0.125  # angular speed of the body that sticks on a disc of 1 rad/s


def one_at_a_time(run) -> bool:
    return bool(((run["disc0_state"] == 2) != (run["disc1_state"] == 2)).all())


def test_cycle_that_sticks_on_both_discs():
    parameters = {**LINER_RUBBER, **normal_forces(3.0), "c": 0.0055, "theta_s": 0.0}
    cycle = steady_cycle(RIG, inputs={"w0": 0.9, "w1": 1.15}, parameters=parameters, start={"theta": 0.14})
    assert cycle.period == pytest.approx(0.928719259537, rel=1e-9)
    assert cycle.stick["disc0"] == pytest.approx(0.0346616487, rel=3e-9)
    assert cycle.stick["disc1"] == pytest.approx(0.0949705753, rel=1e-9)
    # stick on disc 0 ends by loss of contact, not by slip
    assert cycle.angles["disc0", 2] == pytest.approx([0.0], abs=1e-15)


@pytest.mark.parametrize(
    ("w0", "sticking"),
    [(0.5950, {"disc0"}), (0.5952, {"disc0", "disc1"}), (1.0995, {"disc0", "disc1"}), (1.1005, {"disc1"})],
)
def test_stick_moves_from_disc_0_over_both_to_disc_1(w0, sticking):
    """Section 2.5.3: liner/rubber, w1 = 1.15 rad/s, with a damping that lets the body cross theta = 0."""
    parameters = {**LINER_RUBBER, **normal_forces(3.0621), "c": 0.0055, "theta_s": 0.0}
    cycle = steady_cycle(RIG, inputs={"w0": w0, "w1": 1.15}, parameters=parameters, start={"theta": 0.14}, until=200.0)
    assert cycle.sticking == sticking


@pytest.mark.parametrize(
    ("w0", "sticking"),
    [(0.9198, {"disc0"}), (0.9200, {"disc0", "disc1"}), (1.0995, {"disc0", "disc1"}), (1.1005, {"disc1"})],
)
def test_the_same_sequence_with_a_changeover_off_neutral(w0, sticking):
    parameters = {**LINER_RUBBER, **normal_forces(5.5), "theta_s": 0.068914}
    cycle = steady_cycle(RIG, inputs={"w0": w0, "w1": 1.15}, parameters=parameters, start={"theta": 0.0}, until=200.0)
    assert cycle.sticking == sticking


@pytest.mark.parametrize("w0", [0.6, 0.9, 1.1])
def test_with_the_damping_of_the_rig_disc_0_is_not_touched(w0):
    """theta_s = 0, c = 0.055: whatever happens first, the motion stays on disc 1."""
    parameters = {**LINER_RUBBER, **normal_forces(5.5), "theta_s": 0.0}
    run = simulate(RIG, 60.0, inputs={"w0": w0, "w1": 1.15}, parameters=parameters, start={"theta": -0.05})
    assert run["disc0_state"][0] != 2
    assert all(event.contact == "disc1" for event in run.events if event.time > 10.0)
    assert (run["disc0_state"][run.time > 10.0] == 2).all()


@pytest.mark.parametrize("disc", [0, 1])
@pytest.mark.parametrize("speed", [0.2, 0.41, 0.83])
def test_changeover_out_of_reach_leaves_one_disc(disc, speed):
    """Class c becomes class a."""
    alone = simulate(disc_rig(("disc0",)), 5.0, inputs={"w0": speed}, start={"theta": 0.14})
    inputs = {f"w{disc}": speed, f"w{1 - disc}": 7.0}
    theta_s = 50.0 if disc == 0 else -50.0
    run = simulate(RIG, 5.0, inputs=inputs, parameters={"theta_s": theta_s}, start={"theta": 0.14})
    assert [e.time for e in run.events] == pytest.approx([e.time for e in alone.events], abs=1e-12)
    assert run["theta"] == pytest.approx(alone["theta"], abs=1e-12)


def test_equal_discs_are_one_disc():
    """Section 2.1: class c is class a if the speeds and the friction are the same, wherever the changeover is."""
    alone = simulate(disc_rig(("disc0",)), 5.0, inputs={"w0": 0.41}, start={"theta": 0.0})
    run = simulate(RIG, 5.0, inputs={"w0": 0.41, "w1": 0.41}, parameters={"theta_s": 0.1}, start={"theta": 0.0})
    assert run["theta"] == pytest.approx(alone["theta"], abs=1e-11)
    assert run["omega"] == pytest.approx(alone["omega"], abs=1e-10)
    assert {event.after for event in run.events} >= {0, 1, 2}
    assert one_at_a_time(run)


def test_stick_ends_where_the_disc_ends():
    """Closed form: carried by disc 0 at r w0/R from -0.02 rad the body meets disc 1 at t = 0.02 R/(r w0)."""
    start, parameters, inputs = {"theta": -0.02, "omega": SPEED * 0.5}, {"theta_s": 0.0}, {"w0": 0.5, "w1": 0.9}
    run = simulate(RIG, 0.1, inputs=inputs, parameters=parameters, start=start)
    passing = 0.02 / (SPEED * 0.5)
    first, second = run.events[:2]
    assert [first.time, second.time] == pytest.approx([passing, passing], rel=1e-13)
    assert {(e.contact, e.before, e.after) for e in (first, second)} == {("disc0", 0, 2), ("disc1", 2, 1)}
    # velocity and angle go on without a jump; the acceleration is that of (23) at theta = 0
    run = simulate(RIG, 0.1, inputs=inputs, parameters=parameters, start=start, output_times=[passing])
    assert run["omega"][0] == pytest.approx(SPEED * 0.5, rel=1e-13)
    mu = 0.3 / (1 + 15 * (0.06 * 0.9 - 0.06 * 0.5)) + 0.35
    assert run["der(omega)"][0] == pytest.approx((0.125 * 4.905 * mu - 0.055 * SPEED * 0.5) / 0.0548, rel=1e-10)


def test_the_other_disc_of_the_same_speed_takes_over_stick():
    """Equal speeds: stick on disc 0 goes over into stick on disc 1 if its capacity suffices, else into slip."""
    for mu_s, state in ((0.65, 0), (0.36, 1)):
        parameters = {"mu_s1": mu_s, "theta_s": 0.1}
        start = {"theta": 0.09, "omega": SPEED * 0.5}
        run = simulate(RIG, 0.06, inputs={"w0": 0.5, "w1": 0.5}, parameters=parameters, start=start)
        assert run.events[0].time == pytest.approx(0.01 / (SPEED * 0.5), rel=1e-12)
        assert run["disc0_state"][-1] == 2
        assert run["disc1_state"][-1] == state


@pytest.mark.parametrize(
    ("theta_s", "omega", "touched"),
    [
        (0.05, 0.3, "disc1"),
        (0.05, -0.3, "disc0"),
        (0.0, 0.0, "disc1"),
        (0.3, 0.0, "disc0"),
        (0.05, SPEED * 0.9, "disc1"),
    ],
)
def test_start_exactly_on_the_changeover(theta_s, omega, touched):
    """Only the disc that the body moves to acts; at rest the spring decides: R N mu - k theta_s > 0 at theta_s = 0."""
    run = simulate(RIG, 1e-3, parameters={"theta_s": theta_s}, start={"theta": theta_s, "omega": omega})
    other = {"disc0": "disc1", "disc1": "disc0"}[touched]
    assert (run[f"{touched}_state"] != 2).all()
    assert (run[f"{other}_state"] == 2).all()
    assert run.events == ()


@pytest.mark.parametrize(("w0", "w1", "theta"), [(-0.5, 0.5, 1), (-0.5, -0.5, -1)])
def test_rest_on_the_changeover_with_drives_of_any_sense(w0, w1, theta):
    """The disc to which the body then turns is the one that turns it; the stronger one where both could."""
    inputs, parameters = {"w0": w0, "w1": w1}, {"theta_s": 0.0, "N1": 6.0}
    run = simulate(RIG, 0.02, inputs=inputs, parameters=parameters)
    assert np.sign(run["theta"][-1]) == theta
    assert one_at_a_time(run)
    mu = 0.3 / (1 + 15 * 0.06 * 0.5) + 0.35
    N = 6.0 if theta > 0 else 4.905
    assert run["der(omega)"][0] == pytest.approx(theta * 0.125 * N * mu / 0.0548, rel=1e-12)


def test_body_held_at_the_changeover_from_both_sides():
    """w0 > 0 > w1: equal discs hold the body at rest; with unequal ones it is pushed back and forth without a pause."""
    inputs = {"w0": 0.5, "w1": -0.5}
    run = simulate(RIG, 1.0, inputs=inputs, parameters={"theta_s": 0.0})
    assert (run["theta"] == 0.0).all()
    with pytest.raises(StickslipError, match=r"switches ever faster up to t = 0: .*cannot rest where they end"):
        simulate(RIG, 1.0, inputs=inputs, parameters={"theta_s": 0.0, "N0": 6.0})


@pytest.mark.parametrize("inside", [True, False])
def test_grazing_of_the_changeover(inside):
    """N0 = 0, c = 0: theta = -A cos(W t) passes theta_s = A(1 - 1e-10) for 4 us around its peak.

    Entry at cos(W t) = -theta_s/A; with theta_s = A(1 + 1e-10) it never comes.
    """
    A, W = 0.1, np.sqrt(2.62 / 0.0548)
    theta_s = A * (1 - 1e-10 if inside else 1 + 1e-10)
    parameters = {"N0": 0.0, "N1": 1e-3, "c": 0.0, "theta_s": theta_s}
    run = simulate(RIG, 0.6, parameters=parameters, start={"theta": -A})
    visits = [event.time for event in run.events if event.contact == "disc1" and event.before == 2]
    if inside:
        assert visits == pytest.approx([(np.pi - np.arccos(1 - 1e-10)) / W], abs=1e-10)
        assert run["disc1_state"][-1] == 2
    else:
        assert visits == []


def test_drives_that_reverse():
    """Both drives swing through zero; the same by another integrator, and by a tighter run."""
    w0 = Signal([0, 1.3, 2, 4], [0.9, -0.7, -0.9, 1.2])
    w1 = Signal([0, 2, 4], [0.5, -0.8, 0.8])
    runs = [
        simulate(RIG, 4.0, inputs={"w0": w0, "w1": w1}, start={"theta": 0.05}, output_times=[0, 4], tolerance=tolerance)
        for tolerance in (1e-12, 1e-15)
    ]
    assert len(runs[0].events) > 10
    assert [e.time for e in runs[0].events] == pytest.approx([e.time for e in runs[1].events], abs=1e-10)
    again = replay(runs[0], STATES, disc_rates(w0, w1), bends=[1.3, 2])
    assert [runs[0][name][-1] for name in STATES] == pytest.approx(again.tolist(), abs=1e-9)


def test_no_normal_force_is_the_damped_oscillator():
    run = simulate(RIG, 5.0, parameters=normal_forces(0.0), start={"theta": 0.3})
    free = simulate(disc_rig(()), 5.0, start={"theta": 0.3})
    assert run["theta"] == pytest.approx(free["theta"], abs=1e-12)
    assert one_at_a_time(run)


@pytest.mark.parametrize("p", [1.0, 1e3, 1e6])
@pytest.mark.parametrize("mu_s", [0.65, 0.35])
def test_steep_and_constant_laws_agree_with_a_tighter_run(p, mu_s):
    parameters = {f"{name}{i}": value for i in (0, 1) for name, value in (("p", p), ("mu_s", mu_s))}
    runs = [
        simulate(RIG, 5.0, parameters={**parameters, "c": 0.0055}, start={"theta": -0.1}, tolerance=tolerance)
        for tolerance in (1e-12, 1e-15)
    ]
    assert runs[0].events
    assert [e.time for e in runs[0].events] == pytest.approx([e.time for e in runs[1].events], abs=1e-10)
    assert one_at_a_time(runs[0])
