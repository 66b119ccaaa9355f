"""Every method of integration against closed forms at the accuracy it deserves, and what it refuses."""

import math

import numpy as np
import pytest

from fmu_models.validation.bench.problems import problem
from fmu_models.validation.methods.catalogue import OURS
from fmu_models.validation.methods.exact_flow import ExactFlow
from fmu_models.validation.methods.linear_flow import LinearFlow
from fmu_models.validation.methods.moreau import Moreau
from fmu_models.validation.methods.peers.fmpy_cvode import FmpyCvode
from fmu_models.validation.methods.peers.heyoka_taylor import HeyokaTaylor
from fmu_models.validation.methods.result import CLOSED, NotInstalled, NotTreated
from fmu_models.validation.methods.scipy_events import ScipyEvents
from fmu_models.validation.methods.smoothing import Smoothing
from fmu_models.validation.methods.switch_model import SwitchModel

PERIODS = 2
SUPPORT = (3.648464099396639, 2.514570496974713)  # of the periodic motion: published to sixteen digits
ENTRY, EXIT = 0.156261938048459, 0.764467881781506


@pytest.fixture(scope="module")
def support():
    return problem("discontinuous_support_table_1", PERIODS * 2 * math.pi)


@pytest.fixture(scope="module")
def ball():
    """Ten periods of the table, of which the ball meets every one once at the same phase: it ends where it began."""
    return problem("bouncing_ball_period_1", 0.1)


def error(run, end):
    return float(np.abs(run.end - np.array(end)).max())


# the tolerance of each beside what its own error leaves: band, width or step, times the length of the run
@pytest.mark.parametrize(
    ("method", "tolerance", "allowed"),
    [
        (OURS, 1e-14, 1e-14),
        (LinearFlow(), 1e-30, 1e-14),
        (ScipyEvents("DOP853"), 1e-12, 1e-10),
        (ScipyEvents("RK45"), 1e-9, 1e-6),
        (SwitchModel(1e-4), 1e-11, 1e-7),
        (SwitchModel(1e-4, frozen=True), 1e-8, 0.3),
        (Smoothing("tanh", 1e-5, "DOP853"), 1e-10, 1e-7),
        (Smoothing("arctan", 1e-5, "LSODA"), 1e-9, 2e-5),
        (Smoothing("tanh", 1e-3, "Radau"), 1e-7, 1e-4),
        (Moreau(), 1e-3, 2e-2),
        (FmpyCvode(), 1e-8, 1e-5),
    ],
    ids=lambda value: value.name if hasattr(value, "name") else "",
)
def test_support_ends_where_it_began(support, method, tolerance, allowed):
    run = method.prepare(support)(tolerance)
    assert error(run, SUPPORT) < allowed
    assert run.seconds > 0
    if run.switches is None:
        return
    entries = [s.time for s in run.switches if s.after == CLOSED]
    exits = [s.time for s in run.switches if s.before == CLOSED]
    assert len(entries) == len(exits) == PERIODS
    slack = max(10 * allowed, 1e-14)
    assert entries[0] == pytest.approx(ENTRY, abs=slack)
    assert exits[0] == pytest.approx(EXIT, abs=slack)


def test_frozen_mode_is_wrong_by_orders_where_the_switch_model_is_not(support):
    """What the two differ in is only when the mode is decided."""
    switching = error(SwitchModel(1e-4).prepare(support)(1e-8), SUPPORT)
    frozen = error(SwitchModel(1e-4, frozen=True).prepare(support)(1e-8), SUPPORT)
    assert frozen > 1e3 * switching


@pytest.mark.parametrize(
    ("method", "tolerance", "allowed"),
    [(OURS, 1e-14, 1e-14), (LinearFlow(), 1e-30, 1e-14), (ScipyEvents(), 1e-10, 1e-10), (Moreau(), 1e-3, 2e-3)],
    ids=lambda value: value.name if hasattr(value, "name") else "",
)
def test_ball_meets_the_table_once_per_period(ball, method, tolerance, allowed):
    run = method.prepare(ball)(tolerance)
    assert error(run, ball.start) < allowed
    assert len([s for s in run.switches or () if s.matters]) == 1


def test_time_stepping_treats_two_walls():
    """Plastic: once per period the particle is released by the left wall at its speed, in closed form."""
    pair = problem("impact_pair_stick", 4 * math.pi)
    assert error(Moreau().prepare(pair)(5e-4), (-0.5, 1.0)) < 1e-2


def test_time_stepping_is_of_first_order(support):
    """A third of the step: at most a half of the error, and no third of a half, within what the events' places add."""
    runs = [error(Moreau().prepare(support)(step), SUPPORT) for step in (3e-3, 1e-3, 1e-4)]
    assert runs[0] > runs[1] > runs[2]
    assert runs[2] < runs[0] / 8


def test_stick_slip_of_a_disc():
    """Friction: the event loop against the engine, the others at what band and step leave."""
    rig = problem("disc_rig_class_a", 3.0)
    ours = OURS.prepare(rig)(1e-14)
    exact = ScipyEvents("DOP853").prepare(rig)(1e-12)
    assert error(exact, ours.end) < 1e-10
    assert [(s.before, s.after) for s in exact.switches or ()] == [(s.before, s.after) for s in ours.switches or ()]
    for finer, coarser, method in ((1e-4, 1e-3, SwitchModel), (1e-5, 1e-4, lambda w: Smoothing("tanh", w))):
        errors = [error(method(width).prepare(rig)(1e-8), ours.end) for width in (coarser, finer)]
        assert errors[1] < errors[0] / 4
    assert error(Moreau().prepare(rig)(3e-5), ours.end) < 2e-2


def test_the_exact_flow_agrees_and_refuses_what_it_is_not(support, ball):
    for one, expected in ((support, SUPPORT), (ball, ball.start)):
        made = ExactFlow().prepare(one)(1e-14)
        assert error(made, expected) < 1e-13
        assert made.switches is None
    # nothing forces it: parts of the run
    free = problem("planar_hopf")
    assert error(ExactFlow().prepare(free)(1e-14), OURS.prepare(free)(1e-14).end) < 1e-12
    with pytest.raises(NotTreated, match=r"is not linear in the speed\. Use event-driven Taylor"):
        ExactFlow().prepare(problem("disc_rig_class_a", 3.0))


def test_heyoka_agrees(support, ball):
    try:
        runs = [HeyokaTaylor().prepare(p)(1e-15) for p in (support, ball)]
    except NotInstalled as refusal:
        pytest.skip(str(refusal))
    assert error(runs[0], SUPPORT) < 1e-13
    assert error(runs[1], ball.start) < 1e-13


@pytest.mark.parametrize(
    ("method", "scene", "instead"),
    [
        (Smoothing(), "bouncing_ball_period_1", "Moreau time-stepping"),
        (SwitchModel(), "bouncing_ball_period_1", "Moreau time-stepping"),
        (Smoothing(), "hinge_clearance_transient", "event-driven Taylor"),
        (SwitchModel(), "hinge_clearance_transient", "event-driven Taylor"),
        (Moreau(), "hinge_clearance_transient", "event-driven Taylor"),
        (ScipyEvents(), "woodpecker_period_1", "Moreau time-stepping"),
        (LinearFlow(), "hinge_clearance_transient", "event-driven Taylor"),
    ],
    ids=lambda value: value.name if hasattr(value, "name") else value,
)
def test_refusal_says_what_can(method, scene, instead):
    with pytest.raises(NotTreated, match=instead):
        method.prepare(problem(scene))(1e-6)


def test_nonlinear_field_has_no_closed_form():
    with pytest.raises(NotTreated, match="not linear"):
        LinearFlow().prepare(problem("disc_rig_class_a", 1.0))(1e-30)


def test_infinitely_many_bounces_end_at_rest():
    """The event loop closes the contact after some forty of them, where the engine completes them in closed form."""
    chatter = problem("bouncing_ball_chatter")
    ours = OURS.prepare(chatter)(1e-14)
    assert error(ScipyEvents().prepare(chatter)(1e-12), ours.end) < 1e-9


def test_switch_model_needs_no_band_where_nothing_jumps():
    """Bristle friction has a kink at zero slip, no jump: the error does not know the band."""
    rig = problem("disc_rig_micro_slip", 0.5)
    ours = OURS.prepare(rig)(1e-14)
    for eta in (1e-2, 1e-4):
        assert error(SwitchModel(eta).prepare(rig)(1e-8), ours.end) < 1e-7
