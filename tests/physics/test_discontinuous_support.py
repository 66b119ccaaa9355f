"""The oscillator with a discontinuous support against its reference values: equations (3), (4), (8), (9).

The reference values come from the closed-form flow of each mode in extended precision, periodic motions solved at 40
digits; an independent integrator of order 8 confirms the transients. Multipliers: ``test_multipliers``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lazy_fmu import LazyFmu
from stroboscope import after_transient, entries, period, turning_points

from fmu_models.simulation.run import simulate

pytestmark = pytest.mark.digits

SUPPORT = LazyFmu("discontinuous_support")
T = 2 * np.pi
REST = {"x": 0.0, "v": 0.0}
TABLE_2 = {"ks": 300.0, "cs": 0.6, "g": 1.6}
THIRD = {"ks": 1000.0, "cs": 0.6, "g": 2.0, "omega": 0.9}
AWAY, TOUCHING, RELEASED = 2, 3, 4

ORBITS: dict[float, Any] = {
    10.0: {
        "start": {"x": 3.648464099396639, "v": 2.514570496974713},
        "entry": (0.156261938048459, 1.976129158556606),
        "exit": (0.764467881781506, 4.051902841386992, -1.730094712899738),
        "extremes": (4.334229130298108, -4.419255308920885),
    },
    1e5: {
        "start": {"x": 3.440645004751037, "v": 2.060653451073986},
        "entry": (0.394510049488097, 0.739991274617878),
        "exit": (0.404345856998689, 4.000002216171887, -0.738723962213340),
        "extremes": (4.002302932931401, -4.004065304562137),
    },
}


def linear_response(omega, f0=0.5, c=0.05):
    """Amplitude and state at phase 0 of the steady motion without support (m = k = 1)."""
    response = f0 / (1.0 - omega**2 + 1j * c * omega)
    return abs(response), {"x": response.real, "v": (1j * omega * response).real}


def free_flow(time, x, v, c=0.05, k=1.0):
    """State at ``time`` of m x'' + c x' + k x = 0 with m = 1, by the matrix exponential."""
    from scipy.linalg import expm

    return expm(np.array([[0.0, 1.0], [-k, -c]]) * time) @ [x, v]


def state(run, row=-1):
    return [run["x"][row], run["v"][row]]


@pytest.mark.parametrize("ks", ORBITS)
def test_period_1_motion_returns_to_its_start(ks):
    """Table 1, omega = 1."""
    start, parameters = ORBITS[ks]["start"], {"ks": ks}
    run = simulate(SUPPORT, T, start=start, parameters=parameters, output_times=[T])
    assert state(run) == pytest.approx(list(start.values()), abs=1e-9)
    entry, leave, _ = run.events
    assert [entry.after, leave.after] == [TOUCHING, RELEASED]
    at = simulate(SUPPORT, T, start=start, parameters=parameters, output_times=[entry.time, leave.time])
    assert [entry.time, at["v"][0]] == pytest.approx(ORBITS[ks]["entry"], rel=1e-9)
    assert at["x"][0] == pytest.approx(4.0, abs=1e-12)
    assert [leave.time, *state(at)] == pytest.approx(ORBITS[ks]["exit"], rel=1e-9)
    found = turning_points(SUPPORT, T, start=start, parameters=parameters)
    assert [found.max(), found.min()] == pytest.approx(ORBITS[ks]["extremes"], rel=1e-12)


def test_transient_from_rest_soft_support():
    run = simulate(SUPPORT, 100.0, start=REST, output_times=[50.0, 100.0])
    assert state(run, 0) == pytest.approx([3.5423157186358, 2.0348953053301], rel=1e-12)
    assert state(run, 1) == pytest.approx([1.784736603906, 3.888653619606], rel=1e-11)
    # the reference counts entry, release and the way out of x > g
    assert sum(event.time <= 50.0 for event in run.events) == 12
    assert len(run.events) == 36


def test_transient_from_rest_stiff_support():
    run = simulate(SUPPORT, 50.0, start=REST, parameters={"ks": 1e5}, output_times=[50.0])
    assert state(run) == pytest.approx([1.925158396166, 2.560863696141], rel=1e-11)


@pytest.mark.parametrize("start", [REST, {"x": 8.0, "v": 8.0}, {"x": -8.0, "v": 8.0}, {"x": -8.0, "v": -8.0}])
def test_soft_support_has_one_attractor(start):
    run = after_transient(SUPPORT, T, 200, periods=1, start=start)
    assert state(run) == pytest.approx(list(ORBITS[10.0]["start"].values()), abs=1e-9)


def test_stiff_support_has_several():
    """ks = 1e5: from rest to period 4, beside the stable period 1 above."""
    run = after_transient(SUPPORT, T, 400, start=REST, parameters={"ks": 1e5})
    assert period(run, within=1e-7) == 4


@pytest.mark.parametrize(
    ("omega", "inside", "parameters"),
    [(0.940307815834782, 1, {"g": 4.0}), (1.055140375248726, -1, {"g": 4.0}), (0.830826937695969, 1, TABLE_2)],
)
def test_linear_motion_grazes_at_the_analytic_frequencies(omega, inside, parameters):
    """Where the amplitude without support is g, whatever ks; inside: the side of resonance."""
    assert linear_response(omega)[0] == pytest.approx(parameters["g"], rel=1e-14)
    for side in (-1, 1):
        beside = omega * (1 + side * 1e-9)
        start = linear_response(beside)[1]
        run = simulate(SUPPORT, T / beside, start=start, parameters={**parameters, "omega": beside})
        assert bool(run.events) == (side == inside)


def test_linear_motion_grazes_at_the_analytic_force():
    f0 = 0.390512483795333
    assert linear_response(0.9, f0)[0] == pytest.approx(2.0, rel=1e-14)
    for side in (-1, 1):
        start = linear_response(0.9, f0 * (1 + side * 1e-9))[1]
        run = simulate(SUPPORT, T / 0.9, start=start, parameters={**THIRD, "f0": f0 * (1 + side * 1e-9)})
        assert bool(run.events) == (side > 0)


def test_contact_branch_ends_in_a_fold():
    """ks = 10: the fold motion returns, a little below lives a motion with contact, above none does."""
    omega, start = 1.193153181280957, {"x": -2.501194103020, "v": 6.067313981204}
    run = simulate(SUPPORT, T / omega, start=start, parameters={"omega": omega}, output_times=[T / omega])
    # multipliers of modulus up to 1, printed to 1e-12
    assert state(run) == pytest.approx(list(start.values()), abs=1e-10)
    for beside, contact in ((omega - 1e-3, True), (omega + 1e-3, False)):
        late = after_transient(SUPPORT, T / beside, 400, start=start, parameters={"omega": beside})
        assert bool(entries(late, "support")) == contact


def test_beyond_the_fold_all_starts_lose_contact():
    """ks = 10, omega = 1.2: no point of the grid on [-8, 8]^2 goes to a contact motion."""
    for x in np.linspace(-8, 8, 7):
        for v in np.linspace(-8, 8, 7):
            run = after_transient(SUPPORT, T / 1.2, 300, start={"x": x, "v": v}, parameters={"omega": 1.2}, periods=8)
            assert entries(run, "support") == 0


def test_upward_sweep_of_table_2():
    """From rest in steps of 5e-4, each step from where the last one ended; the band edges themselves are left out."""
    found, start = {}, REST
    for omega in np.round(np.arange(0.8, 0.98, 5e-4), 4):
        run = after_transient(SUPPORT, T / omega, 300, start=start, parameters={**TABLE_2, "omega": omega})
        start = {"x": run["x"][-1], "v": run["v"][-1]}
        found[omega] = period(run, within=1e-6) if entries(run, "support") else "none"
    bands = [(0.8, 0.8305, "none"), (0.831, 0.8405, 0), (0.842, 0.9185, 3), (0.9295, 0.9685, 0), (0.9715, 0.979, 1)]
    for begin, end, motion in bands:
        inside = [value for omega, value in found.items() if begin <= omega <= end]
        # a window of another period inside chaos may be hit
        assert inside.count(motion) >= (len(inside) if motion != 0 else 0.9 * len(inside)), (begin, end, inside)


def test_period_3_lives_beside_period_1():
    """Table 2, omega = 0.99."""
    starts = [REST, *({"x": x, "v": v} for x in (-1.0, 0.5) for v in (-1.0, 0.0, 1.0))]
    runs = [after_transient(SUPPORT, T / 0.99, 600, start=s, parameters={**TABLE_2, "omega": 0.99}) for s in starts]
    assert {period(run, within=1e-6) for run in runs} == {1, 3}


def test_period_3_motion_returns_to_its_start():
    omega, start = 0.92, {"x": 1.140362014614650, "v": -0.270093925370817}
    parameters, end = {**TABLE_2, "omega": omega}, 3 * T / omega
    run = simulate(SUPPORT, end, start=start, parameters=parameters, output_times=[end])
    assert state(run) == pytest.approx(list(start.values()), abs=1e-9)


def test_period_3_motion_ends_where_it_grazes():
    """Followed up from 0.92, one of its maxima reaches g at omega = 0.9289664625404 (slope about -0.3 per rad/s)."""
    from fmu_models.sections.orbits import find_orbit

    start = {"x": 1.140362014614650, "v": -0.270093925370817}
    graze = 0.9289664625404
    for omega in (*np.linspace(0.92, 0.9288, 6), graze - 1e-5, graze - 1e-9):
        parameters = {**TABLE_2, "omega": omega}
        orbit = find_orbit(SUPPORT, 3 * T / omega, start, parameters=parameters)
        assert orbit.stable
        start = dict(orbit.start)
    maxima = turning_points(SUPPORT, 3 * T / graze, start=start, parameters={**TABLE_2, "omega": graze - 1e-9})
    below = 1.6 - maxima[maxima < 1.6].max()
    assert 0 < below < 1e-7


@pytest.mark.parametrize("start", [REST, {"x": 1.0, "v": 0.0}, {"x": -1.5, "v": 1.0}])
@pytest.mark.parametrize("omega", [0.93, 0.94])
def test_beyond_the_graze_every_motion_is_aperiodic(omega, start):
    run = after_transient(SUPPORT, T / omega, 600, start=start, parameters={**TABLE_2, "omega": omega})
    assert period(run, within=1e-5) == 0


@pytest.mark.parametrize(("f0", "expected"), [(0.45, 4), (0.7, 0), (0.8, 2)])
def test_third_set(f0, expected):
    """ks = 1000, g = 2, omega = 0.9 (Figs. 10 and 11)."""
    run = after_transient(SUPPORT, T / 0.9, 600, start=REST, parameters={**THIRD, "f0": f0})
    assert period(run, within=1e-7) == expected


def test_third_set_period_4_motion():
    """One contact in four periods."""
    start, parameters, end = {"x": 1.088191293921281, "v": 0.407062081316524}, {**THIRD, "f0": 0.45}, 4 * T / 0.9
    run = simulate(SUPPORT, end, start=start, parameters=parameters, output_times=[end])
    assert state(run) == pytest.approx(list(start.values()), abs=1e-9)
    assert [event.after for event in run.events] == [TOUCHING, RELEASED, AWAY]
    found = turning_points(SUPPORT, end, start=start, parameters=parameters)
    assert found.max() == pytest.approx(2.039188545288902, rel=1e-12)


def test_no_contact_is_missed():
    """1000 frequencies, 10 periods each: the run at the default tolerance has every event of the tightest run."""
    for omega in np.linspace(0.8, 1.0, 1000):
        end = 10 * T / omega
        setup: dict[str, Any] = {"start": REST, "parameters": {**TABLE_2, "omega": omega}, "output_times": [end]}
        run, tight = (simulate(SUPPORT, end, tolerance=tolerance, **setup) for tolerance in (1e-12, 1e-15))
        assert [e.after for e in run.events] == [e.after for e in tight.events]
        assert state(run) == pytest.approx(state(tight), abs=1e-6)


def test_stiffness_costs_no_steps():
    """ks from 10 to 1e9, 10 periods: error below 1e-9, less than three times the steps."""
    steps = []
    for ks in (10.0, 1e3, 1e5, 1e7, 1e9):
        for start in (REST, ORBITS[10.0]["start"]):
            setup: dict[str, Any] = {"start": start, "parameters": {"ks": ks}, "output_times": [10 * T]}
            run, tight = (simulate(SUPPORT, 10 * T, tolerance=tolerance, **setup) for tolerance in (1e-12, 1e-15))
            assert state(run) == pytest.approx(state(tight), abs=1e-9)
            steps.append(run.steps)
    assert max(steps) < 3 * min(steps[:2])
