"""The woodpecker toy against its reference values: equations (21) and (22), the return map (23), (24), Figs. 12 to 18.

The reference values come from an event-driven Taylor code in double and extended precision, with an integrator of order
8 and a time-stepping scheme as checks. Angles are printed to 1e-12. The paper's period of 0.1452 s is not that of its
equations.
"""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
import woodpecker_impacts as wp
from crossed import crossings
from lazy_fmu import LazyFmu
from quick_export import quick_export
from scipy.optimize import brentq

from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact, Poisson
from fmu_models.oscillators.woodpecker import MODEL
from fmu_models.sections.diagonal import find_crossings
from fmu_models.sections.return_map import ReturnMap
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sections import Section, SectionPoint

pytestmark = pytest.mark.digits

TOY = LazyFmu("woodpecker")
STICK, SLIP_MINUS, OPEN, CLOSED = 0, -1, 2, 3
PERIOD, LOWEST = 0.145976065144, -0.529471967111
EVENTS = [
    ("lower_friction", 0.028410160578, SLIP_MINUS),
    ("lower", 0.034230917813, OPEN),
    ("upper", 0.045119985859, OPEN),
    ("beak", 0.048221339518, OPEN),
    ("upper", 0.048800861056, CLOSED),
    ("upper", 0.050655551850, OPEN),
    ("lower", 0.085943962538, OPEN),
    ("lower", 0.088672696570, CLOSED),
    ("lower_friction", 0.134792818722, STICK),
]
TWINS = (-0.493433022180, -0.578477420763)
SIMULTANEOUS = -0.7577872573


def jams(crossing: SectionPoint) -> bool:
    return crossing.contacts["lower_friction"] == STICK


@cache
def return_map(e: float = 0.5, cap: float = 4.0) -> ReturnMap:
    """Least angle of the woodpecker in one jam -> that in the next; the same extremum, from minimum to minimum."""
    return ReturnMap(TOY, "phi_S", section=Section("w_S"), accept=jams, cap=cap, parameters={"eN1": e})


# --- at rest ---------------------------------------------------------------------------------------------------------


def hanging(mu: float = wp.MU, angle: float | None = None) -> float:
    """Margin mu lambda_N - lambda_T of the jammed sleeve (it holds while positive), N, with the woodpecker at an angle.

    (J_S + m_S l_G^2) phi_S'' = -c (phi_S - phi_M) - m_S g l_G,      lambda_T = (m_M + m_S) g + m_S l_G phi_S''
    h_M lambda_N = m_S l_M (g + l_G phi_S'') + c (phi_M - phi_S) - r_M lambda_T
    """
    phi = equilibrium() if angle is None else angle
    spring = wp.C_PHI * (-wp.SLEEVE - phi)
    swing = (spring - wp.M_S * wp.G * wp.L_G) / (wp.J_S + wp.M_S * wp.L_G**2)
    friction = (wp.M_M + wp.M_S) * wp.G + wp.M_S * wp.L_G * swing
    normal = (wp.M_S * wp.L_M * (wp.G + wp.L_G * swing) + spring - wp.R_M * friction) / wp.H_M
    return mu * normal - friction


def equilibrium() -> float:
    """phi_S = phi_M - m_S g l_G/c with phi_M = -(r_M - r_0)/h_M."""
    return -wp.SLEEVE - wp.M_S * wp.G * wp.L_G / wp.C_PHI


def test_equilibrium():
    assert [-wp.SLEEVE, equilibrium()] == pytest.approx([-0.103448276, -0.221693812], abs=5e-10)
    run = simulate(TOY, 1.0, start={"phi_M": -wp.SLEEVE, "phi_S": equilibrium()})
    assert run.events == ()
    assert np.ptp(run["y"]) < 1e-13 and np.ptp(run["phi_M"]) < 1e-15
    # the mass matrix, of condition 1.6e5, leaves accelerations that do not quite cancel
    assert run["phi_S"] == pytest.approx(equilibrium(), abs=2e-12)


def test_jamming_needs_friction():
    """mu2 >= (m_M + m_S) h_M / (m_S (l_G + l_M) - r_M (m_M + m_S))."""
    weight = wp.M_M + wp.M_S
    least = weight * wp.H_M / (wp.M_S * (wp.L_G + wp.L_M) - wp.R_M * weight)
    assert least == pytest.approx(0.285187462, abs=5e-10)
    assert hanging(least) == pytest.approx(0.0, abs=1e-15)
    for mu2, slides in ((least - 1e-8, True), (least + 1e-8, False)):
        start = {"phi_M": -wp.SLEEVE, "phi_S": equilibrium()}
        run = simulate(TOY, 0.1, start=start, parameters={"mu2": mu2})
        assert (run["y"][-1] < -1e-10) == slides
        assert (run["lower_friction_state"][0] == SLIP_MINUS) == slides


def test_centres():
    """The woodpecker swings about its equilibrium while the sleeve holds: every start in the band is a fixed point."""
    high = float(np.asarray(brentq(lambda angle: hanging(angle=angle), equilibrium(), -0.1)))
    low = 2 * equilibrium() - high
    assert [low, high] == pytest.approx([-0.2382522739, -0.2051353492], abs=5e-11)
    frequency = math.sqrt(wp.C_PHI / (wp.J_S + wp.M_S * wp.L_G**2)) / (2 * math.pi)
    for angle in (low + 1e-8, -0.23, -0.2217):
        back = return_map().crossing(angle)
        assert back is not None
        assert back.states["phi_S"] == pytest.approx(angle, abs=1e-13)
        # rounding of the angle over the amplitude of the swing, which is 6e-6 at least
        assert back.time == pytest.approx(1 / frequency, rel=1e-9)
        assert return_map().slope(angle) == pytest.approx(1.0, abs=1e-10)
    # at its very edge, on either side, too little is missing for the sleeve to slip
    for beyond in (0.0, 1e-11, 1e-10, 1e-9):
        assert return_map()(high + beyond) == pytest.approx(low, abs=2e-9)
    # from just outside it the sleeve slips for a moment
    slips = {d: bool(simulate(TOY, 0.1, start={"phi_S": low + d}).events) for d in (-1e-8, 1e-8)}
    assert slips == {-1e-8: True, 1e-8: False}


def test_eigenfrequency_in_flight():
    """f = sqrt(c k' M^-1 k)/2 pi with k = (0, 1, -1): 72.91 Hz in the paper. Falling, w_S vanishes twice a period."""
    k = np.array([0.0, 1.0, -1.0])
    f = math.sqrt(wp.C_PHI * k @ np.linalg.solve(wp.MASS, k)) / (2 * math.pi)
    assert f == pytest.approx(72.9085, abs=5e-5)
    found = crossings(TOY, "w_S", direction=0, stop_time=0.5, start={"phi_M": 0.01, "phi_S": 0.02})
    assert found.times == pytest.approx(np.arange(1, len(found) + 1) / (2 * f), abs=1e-12)
    assert len(found) == 72


# --- the periodic motion ---------------------------------------------------------------------------------------------


def test_every_event_of_the_periodic_motion():
    run = simulate(TOY, PERIOD, output_times=[PERIOD])
    # friction comes and goes with its contact
    told = [
        (e.contact, e.time, e.after)
        for e in run.events
        if not (e.contact.endswith("_friction") and OPEN in (e.before, e.after))
    ]
    assert [(contact, after) for contact, _, after in told] == [(contact, after) for contact, _, after in EVENTS]
    assert [time for _, time, _ in told] == pytest.approx([time for _, time, _ in EVENTS], abs=2e-12)
    # the first upper and the first lower impact let go at once: bounces although their restitution is 0
    assert [e.contact for e in run.impacts if e.before == e.after] == ["upper", "beak", "lower"]


def test_periodic_motion():
    """T, fall per period, slope of the return map; neither the paper's 0.1452 s nor 0.222 s, got by assuming stick."""
    back = return_map().crossing(LOWEST)
    assert back is not None
    assert back.time == pytest.approx(PERIOD, abs=2e-12)
    assert back.states["y"] == pytest.approx(-0.019445379285, abs=2e-12)
    assert back.states["phi_S"] == pytest.approx(LOWEST, abs=2e-12)
    assert back.states["phi_M"] == pytest.approx(-wp.SLEEVE, abs=1e-15)
    assert np.abs([back.states[name] for name in ("v", "w_M", "w_S")]).max() < 1e-11
    assert return_map().slope(LOWEST) == pytest.approx(-0.8391557, abs=1e-7)


def test_the_toy_falls_evenly():
    """A hundred periods: the motion is stable, and the height, on which nothing depends, adds up."""
    found = crossings(TOY, "w_S", stop_time=101 * PERIOD, most=100)
    assert found.times == pytest.approx(PERIOD * np.arange(1, 101), abs=1e-9)
    assert found.states["y"] == pytest.approx(-0.019445379285 * np.arange(1, 101), abs=1e-9)
    assert found.states["phi_S"] == pytest.approx(LOWEST, abs=1e-11)


def test_stable_motion_of_twice_the_period():
    P, (one, other) = return_map(), TWINS
    assert [P(one), P(other)] == pytest.approx([other, one], abs=2e-12)
    assert P.slope(one) * P.slope(other) == pytest.approx(0.829751, abs=1e-6)
    angle = one + 1e-4
    for _ in range(200):
        angle = P(P(angle))
    assert angle == pytest.approx(one, abs=1e-11)


# --- the return map --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "end"),
    [
        (-2.0, -0.469254792531),
        (-1.0, -0.364324882079),
        (-0.6, -0.479415128300),
        (-0.4, -0.633257530220),
        (-0.3, -0.969846906776),
    ],
)
def test_values_of_the_return_map(start, end):
    P = return_map()
    assert P(start) == pytest.approx(end, abs=2e-12)
    h = 1e-5
    central = (P(start - 2 * h) - 8 * P(start - h) + 8 * P(start + h) - P(start + 2 * h)) / (12 * h)
    assert P.slope(start) == pytest.approx(central, rel=1e-7)


@pytest.mark.parametrize(
    ("e", "angle", "slope", "digits"),
    [
        (0.0, -0.856354474973, 0.0, 1e-10),
        (0.2, -0.715091737424, -0.688, 5e-4),
        (0.3, -0.587217937026, -0.778, 5e-4),
        (0.3, -0.951710333003, -1.91, 5e-3),
        (0.5, LOWEST, -0.8391557, 1e-7),
        (0.6, -0.520499851139, -0.877, 6e-4),
        (0.8, -0.512891170734, -0.541, 5e-4),
    ],
)
def test_fixed_points(e, angle, slope, digits):
    """Fig. 16; slopes to the digits they are printed with (at 0.6 it is -0.87746)."""
    P = return_map(e)
    assert P(angle) == pytest.approx(angle, abs=2e-12)
    assert P.slope(angle) == pytest.approx(slope, abs=digits)


def test_jumps():
    """Where two impacts change their order; at -0.7577872573 those of beak and upper edge, whatever eN1 is."""
    found = find_crossings(return_map(), -2.4, -0.3, samples=120)
    jumps = np.array([jump.x for jump in found.jumps])
    for known in (-2.3492910259, -0.8847733440, SIMULTANEOUS, -0.4475239613):
        assert np.abs(jumps - known).min() < 1e-9
    around = find_crossings(return_map(), -0.56, -0.48, samples=50, resolution=1e-5)
    assert [jump.x for jump in around.jumps] == pytest.approx([-0.5136203246, -0.5126990721], abs=1e-9)
    for e in (0.125, 0.8):
        (jump,) = find_crossings(return_map(e), -0.8, -0.7, samples=20).jumps
        assert jump.x == pytest.approx(SIMULTANEOUS, abs=1e-9)


def test_fixed_points_and_jumps_are_told_apart():
    found = find_crossings(return_map(), -1.1, -0.3, samples=80, slope=return_map().slope)
    assert [(point.x, point.stable) for point in found.fixed_points] == [(pytest.approx(LOWEST, abs=1e-11), True)]
    assert found.jump_crossings == ()


def test_no_fixed_points_near_the_jumps_at_0_125():
    """Fig. 18 of the paper has a stable and an unstable one there; these data give two jump crossings only."""
    P = return_map(0.125)
    found = find_crossings(P, -1.1, -0.3, samples=80)
    assert found.fixed_points == ()
    assert [jump.x for jump in found.jump_crossings] == pytest.approx([-0.8847733440, SIMULTANEOUS], abs=1e-9)


@pytest.mark.parametrize("dip", [-0.2659427014, -1.2247781837])
def test_dips(dip):
    """The motion falls along the pole, the longer the nearer, and swings back the farther; nan is no return."""
    P = return_map()
    assert math.isnan(P(dip - 5e-10))
    assert math.isfinite(P(dip + 5e-10))
    assert P(dip + 1e-7) < P(dip + 1e-5) < P(dip + 1e-4) < -0.9
    assert math.isnan(return_map(cap=0.05)(-0.6))


def test_deeper_the_longer_it_may_fall():
    """A fall that the cap of 4 s cuts off ends after 6 s, at a speed that swings the woodpecker over twice."""
    assert math.isnan(return_map()(-0.26597))
    assert return_map(cap=20.0)(-0.26597) == pytest.approx(-15.1813822, abs=1e-6)


# --- impacts ---------------------------------------------------------------------------------------------------------


def test_simultaneous_impacts_differ_from_both_orders():
    """At the critical start beak and upper edge meet the pole at once: the return is neither one-sided limit."""
    before = simulate(TOY, 0.04, start={"phi_S": SIMULTANEOUS}, output_times=[0.0393832396])
    velocities = [before[name][0] for name in ("v", "w_M", "w_S")]
    start = dict(zip(("v", "w_M", "w_S"), velocities, strict=True))

    def after(phi_M: float, phi_S: float) -> float:
        found = crossings(TOY, "w_S", stop_time=0.5, most=1, start={**start, "phi_M": phi_M, "phi_S": phi_S})
        return float(found.states["phi_S"][0])

    both = after(wp.SLEEVE, wp.BEAK)
    orders = after(wp.SLEEVE, wp.BEAK - 1e-10), after(wp.SLEEVE - 1e-10, wp.BEAK)
    limits = return_map()(SIMULTANEOUS - 1e-9), return_map()(SIMULTANEOUS + 1e-9)
    # the state is that of 1e-11 s before
    assert orders == pytest.approx(limits, abs=1e-7)
    assert both == pytest.approx(-0.35150415, abs=1e-7)
    assert min(abs(both - one) for one in limits) > 4e-4

    run = simulate(TOY, 1e-3, start={**start, "phi_M": wp.SLEEVE, "phi_S": wp.BEAK}, output_times=[0.0])
    expected, _ = wp.impact(velocities, {"beak": 0.5, "upper": 0.0})
    assert [run[name][0] for name in ("v", "w_M", "w_S")] == pytest.approx(expected, abs=1e-10)


def beak_impact(speed: float, slip: float, e: float) -> float:
    """Work, J, of an impact of the beak alone at a speed of approach and a slip speed."""
    gap = 1e-12
    w_S = speed / wp.H_S
    start = {"phi_M": 0.0, "phi_S": wp.BEAK - gap / wp.H_S, "w_S": w_S, "v": slip - (wp.L_G - wp.L_S) * w_S}
    run = simulate(TOY, 1e-9, start=start, parameters={"eN1": e}, output_times=[1e-9])
    (event,) = run.impacts
    assert event.contact == "beak"
    return event.work


def test_one_beak_impact_gains_energy_above_0_601_only():
    """The most is gained where friction brings the slip to rest with all it has: Lambda_T = -mu Lambda_N, slip after 0.

    work = Lambda_N ((1 + e) k - (1 - e)) |approach|/2,   k = mu (G_NT - mu G_TT)/(G_NN - mu G_NT)
    so that e > (1 - k)/(1 + k) can gain, at the slip speed before  (G_NT - mu G_TT)(1 + e)/(mu G_NT - G_NN) |approach|
    """
    (nn, nt), (_, tt) = wp.matrix("beak")
    k = wp.MU * (nt - wp.MU * tt) / (nn - wp.MU * nt)
    critical = (1 - k) / (1 + k)
    assert critical == pytest.approx(0.6010, abs=5e-5)

    def worst(e: float) -> float:
        return -(nt - wp.MU * tt) * (1 + e) / (nn - wp.MU * nt)

    for e, gains in ((critical - 1e-4, False), (critical + 1e-4, True)):
        assert (beak_impact(1.0, worst(e), e) > 0) == gains
    slips = np.linspace(-4.0, 4.0, 60)
    assert max(beak_impact(1.0, slip, 0.601) for slip in slips) < 0
    for slip in (-1.0, -0.1, worst(0.8), 0.3, 2.0):
        w_S = 1.0 / wp.H_S
        _, work = wp.impact([slip - (wp.L_G - wp.L_S) * w_S, 0.0, w_S], {"beak": 0.8})
        assert beak_impact(1.0, slip, 0.8) == pytest.approx(work, rel=1e-7)


def impacts_that_gain(fmu: Fmu, e: float) -> int:
    starts = np.linspace(-2.5, -0.25, 30)
    runs = [simulate(fmu, 0.5, start={"phi_S": x}, parameters={"eN1": e}, output_times=[0.0, 0.5]) for x in starts]
    return sum(len(run.gains) for run in runs)


@pytest.mark.parametrize(("e", "gains"), [(0.5, False), (0.6, False), (0.7, True), (0.9, True)])
def test_newton_with_friction_gains_energy_from_some_starts(e, gains):
    assert (impacts_that_gain(TOY, e) > 0) == gains


def test_poisson_never_gains_energy(tmp_path):
    contacts = [
        dataclasses.replace(contact, restitution=Poisson(contact.e))
        for contact in MODEL.contacts
        if isinstance(contact, Impact)
    ]
    mechanism = dataclasses.replace(MODEL, name="woodpecker_poisson", contacts=contacts)
    fmu = Fmu.open(quick_export(mechanism, tmp_path / "woodpecker_poisson.fmu"))
    assert [impacts_that_gain(fmu, e) for e in (0.7, 0.9, 1.0)] == [0, 0, 0]


@pytest.mark.parametrize("e", [0.0, 0.001, 0.05, 0.3])
def test_bounces_of_the_beak_end(e):
    """Without an end to the chatter they are 2000 and more; here it closes within some ten, and energy only falls."""
    closed = 0
    for start in np.linspace(-2.4, -0.3, 12):
        run = simulate(TOY, 1.0, start={"phi_S": start}, parameters={"eN1": e})
        assert sum(event.contact == "beak" for event in run.impacts) <= 12
        closed += sum(event.contact == "beak" and event.after != OPEN for event in run.events)
        assert np.diff(run["energy"]).max() < 1e-15
        gaps = [wp.BEAK - run["phi_S"], wp.SLEEVE - run["phi_M"], wp.SLEEVE + run["phi_M"]]
        assert np.min(gaps) >= -1e-15
    assert closed > 0 or e == 0.3


def test_exponents_from_the_jammed_start():
    """The default start lies on a closed wall: motions beside it begin on its free side. Height and direction of the
    motion stay, the slope of the return map decides one difference, stick and jams take the others."""
    found = lyapunov(Strobe(TOY, period=PERIOD, autonomous=True), periods=4000, transient=50, motions=4)
    assert np.abs(found.per_time[:2]).max() < 1e-9 and found.lost == 3
    # differences that are followed anew after the transient still turn: by 1 / steps
    assert found.per_time[2] == pytest.approx(np.log(0.8391557) / PERIOD, rel=3e-3)
