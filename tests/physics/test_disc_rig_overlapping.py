"""The disc rig with overlapping discs (class d): section 2.1 (d), friction as in (11) to (16).

The period of its reference cycle is known to 1e-5; that it is met to 1e-9 is shown by another integrator. At the ends
of its parameter alpha class d is class b and class c, whose reference values are known to twelve digits.
"""

from __future__ import annotations

import pytest
from disc_rates import LINER_RUBBER, STATES, disc_rates, normal_forces
from lazy_fmu import LazyFmu
from replay import replay
from steady_cycle import disc_rig, steady_cycle

from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

RIG = LazyFmu("disc_rig_overlapping")
SPEED = 0.06 / 0.125  # angular speed of the body that sticks on a disc of 1 rad/s


def test_cycle_at_the_end_of_disc_0():
    """paper/rubber, alpha = 0.1, w = (0.6, 1.0): stick on disc 0 from 0.0921 rad until it ends at 0.1 rad."""
    cycle = steady_cycle(RIG, inputs={"w0": 0.6, "w1": 1.0}, start={"theta": 0.14})
    assert cycle.period == pytest.approx(0.69236, abs=0.5e-5)
    assert cycle.angles["disc0", 2] == pytest.approx([0.1], abs=1e-13)
    # it releases where it ends, and its stick lasts as long as the disc takes from one angle to the other
    (landing,) = cycle.angles["disc0", 0]
    assert cycle.stick["disc0"] * cycle.period == pytest.approx((0.1 - landing) / (SPEED * 0.6), rel=1e-9)
    # from landing to landing by another integrator
    start = {"theta": landing, "omega": SPEED * 0.6}
    run = simulate(RIG, cycle.period, inputs={"w0": 0.6, "w1": 1.0}, start=start, output_times=[0, cycle.period])
    again = replay(run, STATES, disc_rates(*(Signal.constant(w, 0, 1) for w in (0.6, 1.0))))
    assert again == pytest.approx(list(start.values()), rel=1e-9)


@pytest.mark.parametrize(
    ("w0", "w1", "period", "minimum", "maximum", "stick0", "stick1"),
    [
        (0.41, 0.83, 1.240683492251, 0.165591261286, 0.304098449952, 0.4558702846, 0.0),
        (0.83, 0.83, 1.119370261661, 0.110122771115, 0.341411666625, 0.3927019884, 0.3927019884),
        (1.40, 0.83, 1.043139513424, 0.124657641567, 0.320583906166, 0.0, 0.3224480738),
        (1.50, -0.5, 1.164278079826, -0.070096962075, 0.077415151319, 0.0, 0.4002053150),
    ],
)
def test_wide_overlap_is_class_b(w0, w1, period, minimum, maximum, stick0, stick1):
    cycle = steady_cycle(RIG, inputs={"w0": w0, "w1": w1}, parameters={"alpha": 1.5}, start={"theta": 0.14})
    assert cycle.period == pytest.approx(period, rel=1e-9)
    assert cycle.minimum["theta"] == pytest.approx(minimum, rel=1e-9)
    assert cycle.maximum["theta"] == pytest.approx(maximum, rel=1e-9)
    assert cycle.stick.get("disc0", 0.0) == pytest.approx(stick0, abs=1e-10)
    assert cycle.stick.get("disc1", 0.0) == pytest.approx(stick1, abs=1e-10)


def test_no_overlap_is_class_c():
    """alpha = 0: one disc hands over to the other at theta = 0."""
    parameters = {**LINER_RUBBER, **normal_forces(3.0), "c": 0.0055, "alpha": 0.0}
    cycle = steady_cycle(RIG, inputs={"w0": 0.9, "w1": 1.15}, parameters=parameters, start={"theta": 0.14})
    assert cycle.period == pytest.approx(0.928719259537, rel=1e-9)
    assert cycle.stick["disc0"] == pytest.approx(0.0346616487, rel=3e-9)
    assert cycle.stick["disc1"] == pytest.approx(0.0949705753, rel=1e-9)


def test_both_discs_carry_the_body_until_one_ends():
    """Closed form: both stick at r w/R from 0.05 rad; disc 0 ends at 0.1 rad; disc 1 alone holds to its capacity."""
    v = SPEED * 0.2
    run = simulate(RIG, 1.5, inputs={"w0": 0.2, "w1": 0.2}, start={"theta": 0.05, "omega": v})
    release = (0.125 * 4.905 * 0.65 - 0.055 * v) / 2.62
    assert [(e.contact, e.before, e.after) for e in run.events[:2]] == [("disc0", 0, 2), ("disc1", 0, 1)]
    times = [(0.1 - 0.05) / v, (release - 0.05) / v]
    assert [e.time for e in run.events[:2]] == pytest.approx(times, rel=1e-12)


def test_the_disc_that_remains_cannot_hold():
    """The same where disc 1 alone is too weak for the spring at 0.1 rad: stick ends on both discs at once."""
    v = SPEED * 0.2
    inputs, start = {"w0": 0.2, "w1": 0.2}, {"theta": 0.05, "omega": v}
    run = simulate(RIG, 0.6, inputs=inputs, parameters={"mu_s1": 0.4}, start=start)
    assert {(e.contact, e.before, e.after) for e in run.events[:2]} == {("disc0", 0, 2), ("disc1", 0, 1)}
    assert [e.time for e in run.events[:2]] == pytest.approx([0.05 / v] * 2, rel=1e-12)


@pytest.mark.parametrize("end", [1, -1])
@pytest.mark.parametrize("outwards", [1, -1, 0])
def test_start_exactly_at_the_end_of_a_disc(end, outwards):
    """A body that moves outwards has left the disc, one that moves inwards has it; at rest the forces decide."""
    disc = "disc0" if end > 0 else "disc1"
    inputs = {"w0": 0.5, "w1": 0.6}
    run = simulate(RIG, 1e-3, inputs=inputs, start={"theta": end * 0.1, "omega": end * outwards * 0.1})
    # at rest: R N mu of either disc exceeds k 0.1 = 0.262 N m at speeds like these, so that the body turns up
    inside = outwards < 0 or (outwards == 0 and end < 0)
    assert ((run[f"{disc}_state"] != 2) == inside).all()
    assert (run[f"disc{int(end > 0)}_state"] != 2).all()
    assert run.events == ()


def test_drives_that_reverse():
    """Both drives swing through zero; the same by another integrator, and by a tighter run."""
    w0 = Signal([0, 1, 2, 4], [0.9, -0.9, -0.9, 1.2])
    w1 = Signal([0, 2, 4], [-0.5, 0.8, -0.8])

    runs = [
        simulate(RIG, 4.0, inputs={"w0": w0, "w1": w1}, start={"theta": 0.05}, output_times=[0, 4], tolerance=tolerance)
        for tolerance in (1e-12, 1e-15)
    ]
    assert len(runs[0].events) > 10
    assert [e.time for e in runs[0].events] == pytest.approx([e.time for e in runs[1].events], abs=1e-10)
    again = replay(runs[0], STATES, disc_rates(w0, w1), bends=[1, 2])
    assert [runs[0][name][-1] for name in STATES] == pytest.approx(again.tolist(), abs=1e-9)


def test_no_normal_force_is_the_damped_oscillator():
    run = simulate(RIG, 5.0, parameters=normal_forces(0.0), start={"theta": 0.3})
    free = simulate(disc_rig(()), 5.0, start={"theta": 0.3})
    assert run["theta"] == pytest.approx(free["theta"], abs=1e-12)
    crossed = {(event.contact, event.after) for event in run.events}
    assert {("disc0", 2), ("disc1", 2)} <= crossed
