"""Periodic motions by Newton's method on exact derivatives, and their multipliers, against reference values.

The derivatives are carried through the events by the engine (saltation included); nothing here is a finite difference.
"""

from __future__ import annotations

import numpy as np
import pytest
from lazy_fmu import LazyFmu

from fmu_models.base.errors import StickslipError
from fmu_models.sections.orbits import find_orbit, orbit_at
from fmu_models.sections.return_map import ReturnMap
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sections import Section
from fmu_models.simulation.sensitivity import SensitiveRun, flow_derivative

pytestmark = pytest.mark.digits

SUPPORT = LazyFmu("discontinuous_support")
HINGE = LazyFmu("hinge_clearance")
BELT = LazyFmu("forced_stick_slip")


@pytest.mark.parametrize(
    ("ks", "x", "v", "modulus"),
    [
        (10.0, 3.648464099396639, 2.514570496974713, 0.780117660219),
        (1e5, 3.440645004751037, 2.060653451073986, 0.853376023571),
    ],
)
def test_support_period_1(ks, x, v, modulus):
    """Table 1, omega = 1: a complex pair; its product is exp(-(c T + cs Tc)/m) with Tc the time in contact."""
    orbit = orbit_at(SUPPORT, 2 * np.pi, {"x": x, "v": v}, parameters={"ks": ks})
    assert orbit.residual < 1e-9
    assert orbit.stable
    assert np.abs(orbit.multipliers) == pytest.approx([modulus] * 2, rel=1e-11)
    events = simulate(SUPPORT, 2 * np.pi, start={"x": x, "v": v}, parameters={"ks": ks}).events
    (entry,) = (event.time for event in events if event.after == 3)
    (exit_,) = (event.time for event in events if event.before == 3)
    product = np.exp(-(0.05 * 2 * np.pi + 0.3 * (exit_ - entry)))
    assert np.linalg.det(orbit.monodromy) == pytest.approx(product, rel=1e-8)


def test_support_entry_and_exit_saltation():
    """Entry [[1, 0], [-cs/m, 1]], exit identity: across one event the derivative of the flow is S exp(A t) pieces."""
    from scipy.linalg import expm

    free = np.array([[0.0, 1.0], [-1.0, -0.05]])
    touching = np.array([[0.0, 1.0], [-11.0, -0.35]])
    start = {"x": 3.648464099396639, "v": 2.514570496974713}
    entry, exit_ = 0.156261938048459, 0.764467881781506
    saltation = np.array([[1.0, 0.0], [-0.3, 1.0]])
    inside = expm(touching * (0.5 - entry)) @ saltation @ expm(free * entry)
    assert flow_derivative(SUPPORT, 0.5, start=start).by_start == pytest.approx(inside, abs=1e-8)
    whole = expm(touching * (exit_ - entry)) @ saltation @ expm(free * entry)
    after = expm(free * (2.0 - exit_)) @ whole
    assert flow_derivative(SUPPORT, 2.0, start=start).by_start == pytest.approx(after, abs=1e-8)


def test_support_fold_of_the_contact_branch():
    """ks = 10: at omega = 1.193153181280957 one multiplier is +1 (resonance curve jumps)."""
    omega = 1.193153181280957
    start = {"x": -2.501194103020, "v": 6.067313981204}
    orbit = orbit_at(SUPPORT, 2 * np.pi / omega, start, parameters={"omega": omega})
    assert orbit.residual < 1e-8
    # at a fold the multiplier leaves 1 like the square root of the distance: 1e-12 in the state gives 1e-6
    assert np.abs(orbit.multipliers - 1.0).min() < 1e-5


def test_support_period_3_is_found_from_a_rough_guess():
    """Table 2, omega = 0.92: the period-3 motion that an upward sweep reaches."""
    parameters = {"ks": 300.0, "cs": 0.6, "g": 1.6, "omega": 0.92}
    orbit = find_orbit(SUPPORT, 6 * np.pi / 0.92, {"x": 1.14, "v": -0.27}, parameters=parameters)
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([1.140362014614650, -0.270093925370817], abs=1e-9)
    assert orbit.stable


def test_hinge_period_1():
    """f = 0.429: multipliers of the 1-1-1 motion.

    The printed multipliers, -0.8937818817 and -0.2083375874, are reproduced to 1e-7; Richardson's extrapolation of
    differences of runs at 1e-15 agrees with the derivative below to 1e-8 (the force ends like (t_exit - t)^(3/2)).
    """
    orbit = find_orbit(HINGE, 1 / 0.429, {"x": -5e-6, "v": 0.033})
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([-5.19128647e-6, 0.03296490834399], abs=1e-11)
    assert np.sort(orbit.multipliers.real) == pytest.approx([-0.8937818817, -0.2083375874], abs=2e-7)
    assert np.abs(orbit.multipliers.imag).max() == 0.0
    columns = []
    for state in ("x", "v"):
        ends = {}
        for steps in (-2, -1, 1, 2):
            start = {**orbit.start, state: orbit.start[state] + steps * 1e-5}
            run = simulate(HINGE, 1 / 0.429, start=start, output_times=[1 / 0.429], tolerance=1e-15)
            ends[steps] = np.array([run["x"][-1], run["v"][-1]])
        columns.append((8 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / 12e-5)
    assert orbit.monodromy == pytest.approx(np.stack(columns, axis=1), abs=2e-8)


def test_hinge_from_inside_a_stop():
    """Multipliers do not ask where a period begins; inside a stop its speed of entry is a state too, soon forgotten."""
    period = 1 / 0.429
    outside = find_orbit(HINGE, period, {"x": -5e-6, "v": 0.033})
    (entry, exit_) = (
        next(e.time for e in simulate(HINGE, period, start=outside.start).events if getattr(e, which) == 3)
        for which in ("after", "before")
    )
    for part in (0.1, 0.5, 0.8):
        time = entry + part * (exit_ - entry)
        run = simulate(HINGE, time, start=outside.start, output_times=[time])
        (stop,) = (name for name in HINGE.contacts if run[f"{name}_state"][-1] == 3)
        names = ["x", "v", f"{stop}_memory"]
        guess = {name: 1.001 * run[name][-1] for name in names}
        inside = find_orbit(HINGE, period, guess, start_time=time)
        assert list(inside.start) == names
        assert [inside.start[name] for name in names] == pytest.approx([run[name][-1] for name in names], abs=1e-10)
        assert np.sort(inside.multipliers.real) == pytest.approx([*np.sort(outside.multipliers.real), 0.0], abs=1e-9)
        columns = []
        for name in names:
            ends = {}
            for steps in (-2, -1, 1, 2):
                start = {**inside.start, name: inside.start[name] + steps * 1e-6}
                end = simulate(HINGE, time + period, start_time=time, start=start, output_times=[time + period])
                ends[steps] = np.array([end[other][-1] for other in names])
            columns.append((8 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / 12e-6)
        assert inside.monodromy == pytest.approx(np.stack(columns, axis=1), abs=1e-6)
        assert np.abs(inside.monodromy[:, 2]).max() > 1e-3


def test_a_start_at_a_stop_remembers_the_speed_it_has_there():
    """Just at the bound the speed of entry is the speed itself."""
    start = {"x": 0.01, "v": 0.1}
    with SensitiveRun(HINGE, by=["v", "right_memory"], recorded=["x", "right_memory"]) as kept:
        found = kept.run([0.0, 0.3], start={**start, "right_memory": 0.7})
    assert found["right_memory"] == pytest.approx([0.1, 0.1])
    assert found.of("right_memory") == pytest.approx(np.array([[1.0, 0.0], [1.0, 0.0]]), abs=1e-15)
    assert found.of("x")[:, 1] == pytest.approx([0.0, 0.0], abs=1e-15)
    ends = [simulate(HINGE, 0.3, start={**start, "v": 0.1 + h}, output_times=[0.3])["x"][-1] for h in (1e-6, -1e-6)]
    assert found.of("x")[1, 0] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)


@pytest.mark.parametrize(
    "start",
    [{"x": 0.011, "right_memory": 0.1}, lambda v: {"x": 0.011, "v": v, "right_memory": 2 * v}],
    ids=["held", "with the speed"],
)
def test_slope_of_a_map_that_starts_inside_a_stop(start):
    """The speed of entry may go with what the map is of."""
    back = ReturnMap(HINGE, "v", section=Section("x", 0.0, -1), cap=10.0, start=start)
    h = 1e-6
    assert back.slope(0.05) == pytest.approx((back(0.05 + h) - back(0.05 - h)) / (2 * h), abs=1e-8)


def test_hinge_doubles_its_period():
    """f = 0.42628837787: one multiplier of the 1-1-1 motion is -1."""
    f = 0.42628837787
    orbit = find_orbit(HINGE, 1 / f, {"x": -5e-6, "v": 0.033}, parameters={"f": f})
    assert np.abs(orbit.multipliers + 1.0).min() < 2e-7


@pytest.mark.parametrize(
    ("branch", "omega", "n", "x", "v", "multipliers"),
    [
        ("I", 1.6, 2, 1.040922001474, -0.720488407813, (0.4646435094, 0.0)),
        ("I", 1.67587, 2, 1.652839449281, -0.835945777956, (0.7657716081, 0.0)),
        ("V", 1.67587, 2, 2.079734897160, -0.631175144660, (1.3881738006, 0.0)),
        ("IV", 1.67587, 2, 2.122917263608, -0.494267912184, (-1.2299351068, -0.0406922271)),
        ("II", 1.8, 2, 0.727294230053, 0.445984295430, (2.4934257148, 0.4004668420)),
        ("VI", 1.71, 4, 1.891443599339, -0.262041095369, (0.9064831293, 0.0071598455)),
        ("VIII", 1.69, 8, 2.164846083735, -0.491606021503, (-2.5127615173, 0.0)),
    ],
)
def test_forced_stick_slip_branches(branch, omega, n, x, v, multipliers):
    """Equations (15), (16): states at t = 0 on the branches of Fig. 8, stable or not; stick makes one multiplier 0."""
    orbit = find_orbit(BELT, 2 * np.pi * n / omega, {"x": x, "v": v}, parameters={"omega": omega})
    assert [orbit.start["x"], orbit.start["v"]] == pytest.approx([x, v], abs=2e-12 * max(1, abs(multipliers[0])))
    assert orbit.multipliers.real == pytest.approx(multipliers, abs=1e-9)
    assert orbit.stable == (abs(multipliers[0]) < 1)


def test_forced_stick_slip_smooth_fold():
    """Fold I/V at omega = 1.683440572496: a multiplier is +1 there (with stick, so the other is 0)."""
    omega = 1.683440572496
    start = {"x": 1.652839449281, "v": -0.835945777956}
    for between in np.linspace(1.67587, omega - 1e-9, 8):
        start = find_orbit(BELT, 4 * np.pi / between, start, parameters={"omega": between}).start
    orbit = orbit_at(BELT, 4 * np.pi / (omega - 1e-9), start, parameters={"omega": omega - 1e-9})
    assert orbit.multipliers.real == pytest.approx([1.0, 0.0], abs=1e-3)


def test_forced_stick_slip_flip():
    """Flip IV/III at omega = 1.712981036227: multipliers -1 and -0.08447867."""
    start = {"x": 2.122917263608, "v": -0.494267912184}
    for omega in np.linspace(1.67587, 1.712981036227, 12):
        start = find_orbit(BELT, 4 * np.pi / omega, start, parameters={"omega": omega}).start
    orbit = orbit_at(BELT, 4 * np.pi / 1.712981036227, start, parameters={"omega": 1.712981036227})
    assert orbit.multipliers.real == pytest.approx([-1.0, -0.08447867], abs=1e-7)


def test_the_determinant_of_friction_is_the_integral_of_its_divergence():
    """No stick: det of the monodromy = exp(integral over time of (a1 - 3 a3 w^2)/m) times f+/f- per crossing."""
    omega, period = 1.8, 4 * np.pi / 1.8
    orbit = find_orbit(BELT, period, {"x": 0.727294230053, "v": 0.445984295430}, parameters={"omega": omega})
    run = simulate(
        BELT, period, start=orbit.start, parameters={"omega": omega}, output_times=np.linspace(0, period, 20001)
    )
    slip = run["v"] - 1.0
    integral = np.trapezoid(1.5 - 1.35 * slip**2, run.time)
    jumps = 1.0
    for event in run.events:
        at = simulate(BELT, period, start=orbit.start, parameters={"omega": omega}, output_times=[event.time])
        s = at["x"][0] - 0.1 * np.cos(omega * event.time)
        # before and after the crossing v' = -s -+ 1.5
        jumps *= (-s - 1.5 * event.after) / (-s - 1.5 * event.before)
    assert np.linalg.det(orbit.monodromy) == pytest.approx(np.exp(integral) * jumps, rel=1e-7)


def test_no_orbit_is_said_in_words():
    """Without a spring the mass drifts: the map over a period is a shear, and Newton's equations are singular."""
    drift = {"k": 0.0, "c": 0.0, "g": 1e6}
    with pytest.raises(StickslipError, match="Start nearer"):
        find_orbit(SUPPORT, 2 * np.pi, {"x": 3.0, "v": 1.0}, parameters=drift)
