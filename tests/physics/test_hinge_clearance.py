"""The hinge with clearance against its reference values: equations (8) to (10); (1), (2) for the form in SI units.

The reference values come from closed-form free flight and an integrator of order 8 with located events; extrapolation
in extended precision agrees to 3e-14. A motion "n-p-q" has n forcing periods with p impacts left and q right.
Multipliers: ``test_multipliers``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lazy_fmu import LazyFmu
from stroboscope import after_transient, entries, period

from fmu_models.base.errors import StickslipError
from fmu_models.oscillators.hinge_clearance_dimensional import scaled
from fmu_models.sections.orbits import find_orbit
from fmu_models.simulation.run import simulate

pytestmark = pytest.mark.digits

HINGE = LazyFmu("hinge_clearance")
CLAMPED = LazyFmu("hinge_clearance_clamped")
DIMENSIONAL = LazyFmu("hinge_clearance_dimensional")
AWAY, TOUCHING, RELEASED = 2, 3, 4
# the orbit at f = 0.429: contact, state after, theta = 2 pi f t, v
EVENTS = [
    ("right", TOUCHING, 0.54722475437, 0.08229430217796),
    ("right", AWAY, 3.56060254418, -0.0636753610939),
    ("left", TOUCHING, 4.04954983356, -0.1665642911684),
    ("left", AWAY, 5.75733541360, 0.0862781055053),
]
STARTS = [{"x": 0.0, "v": 0.0}, {"x": -0.005, "v": -0.5}, {"x": 0.008, "v": -0.9}, {"x": 0.002, "v": 0.8}]


def motion(fmu, f, start, *, transient=500, **parameters):
    """(n, p, q) of the motion that a start leads to; n = 0 if it is aperiodic."""
    run = after_transient(fmu, 1 / f, transient, start=start, parameters={"f": f, **parameters})
    n = period(run, within=1e-7)
    impacts = [entries(run, contact) * n / 48 for contact in ("left", "right")]
    assert n == 0 or all(impact == round(impact) for impact in impacts)
    return (n, *map(round, impacts))


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("fmu", [HINGE, CLAMPED], ids=["hinge", "clamped"])
def test_orbit_at_0_429(fmu, mirror):
    """Returns to its start, with every event at its phase and speed; its mirror twin is half a period later."""
    f, side = 0.429, -1 if mirror else 1
    start = {"x": side * -5.19128647e-6, "v": side * 0.03296490834399}
    setup: dict[str, Any] = {"start": start, "parameters": {"f": f, "tau": np.pi if mirror else 0.0}}
    run = simulate(fmu, 1 / f, output_times=[1 / f], **setup)
    assert [run["x"][0], run["v"][0]] == pytest.approx(list(start.values()), abs=1e-12)
    opposite = {"left": "right", "right": "left"}
    for event, (contact, after, theta, v) in zip(run.events, EVENTS, strict=True):
        assert (event.contact, event.after) == (opposite[contact] if mirror else contact, after)
        # the start is printed to 1e-14 but ends of contacts amplify it; theta is printed to 1e-11
        assert 2 * np.pi * f * event.time == pytest.approx(theta, abs=2e-10)
        at = simulate(fmu, 1 / f, output_times=[event.time], **setup)
        assert at["v"][0] == pytest.approx(side * v, rel=1e-9)
        assert abs(at["x"][0]) == pytest.approx(0.01, abs=1e-14)


def test_transient_from_rest():
    run = simulate(HINGE, 10 / 0.429, output_times=np.array([1, 10]) / 0.429)
    assert run["x"] == pytest.approx([-0.00505144074574, -0.00023940077901], rel=1e-9)
    assert run["v"] == pytest.approx([0.02156576258885, 0.0312310268845], rel=1e-9)


@pytest.mark.parametrize(
    ("f", "expected"),
    [
        (0.429, {(1, 1, 1)}),
        (0.422, {(2, 2, 2)}),
        (0.420, {(2, 2, 2)}),
        (0.414, {(4, 4, 4), (3, 3, 3)}),
        (0.365, {(1, 2, 2)}),
        (0.366, {(1, 2, 1), (1, 1, 2)}),
        (0.3674, {(2, 4, 2), (2, 2, 4)}),
        (0.368, {(2, 2, 4), (2, 4, 2)}),
        (0.3688, {(4, 4, 8), (4, 8, 4)}),
    ],
)
def test_periodic_motions_of_the_paper(f, expected):
    """Figures 5 to 14; mirror twins coexist, at 0.414 also periods 3 and 4. The clamp changes no class."""
    assert {motion(HINGE, f, start) for start in STARTS} == expected
    assert motion(CLAMPED, f, STARTS[0]) in expected


@pytest.mark.parametrize(("f", "coexisting"), [(0.410, (3, 3, 3)), (0.405, (3, 3, 3)), (0.370, None)])
def test_aperiodic_motions_of_the_paper(f, coexisting):
    """Figures 8, 9, 15; beside the first two lives 3-3-3. (0.410 is chaos, not quasiperiodic.)"""
    more = [{"x": x, "v": v} for x in (-0.008, 0.0, 0.005) for v in (-0.4, 0.3, 0.5)]
    found = {motion(HINGE, f, start)[0] for start in (STARTS + more if coexisting else STARTS)}
    assert found == ({0, coexisting[0]} if coexisting else {0})


def test_weakest_hit_at_0_365():
    run = after_transient(HINGE, 1 / 0.365, 500, periods=1, parameters={"f": 0.365})
    times = [e.time for e in run.events if e.after == TOUCHING and e.time > run.time[0]]
    hits = simulate(HINGE, run.time[-1], parameters={"f": 0.365}, output_times=times)
    assert np.abs(hits["v"]).min() == pytest.approx(0.0136, abs=5e-5)


@pytest.mark.parametrize(("side", "impacts"), [(-1, 4), (1, 3)])
def test_grazing_at_0_3655(side, impacts):
    """1-2-2 loses one impact at f = 0.36553408655."""
    found = motion(HINGE, 0.36553408655 + side * 2e-10, STARTS[0])
    assert found[0] == 1
    assert sum(found[1:]) == impacts


@pytest.mark.parametrize("side", [-1, 1])
def test_period_doubles_at_0_4263(side):
    """f = 0.42628837787 (the paper's 0.4265): 1-1-1 above is stable, below it is not."""
    # found from multipliers good to 1e-7, which change by 39 per unit of f
    f = 0.42628837787 + side * 5e-9
    orbit = find_orbit(HINGE, 1 / f, {"x": -5e-6, "v": 0.033}, parameters={"f": f})
    assert orbit.stable == (side > 0)


@pytest.mark.parametrize(("delta", "periodic"), [(0.005, True), (0.1, True), (0.01, False)])
def test_influence_of_the_clearance(delta, periodic):
    """f = 0.414 (Fig. 16): period 1 at both ends, complex between."""
    assert (motion(HINGE, 0.414, STARTS[0], delta=delta)[0] == 1) == periodic


def test_dimensional_form_is_the_scaled_one():
    """Equations (1), (2) against (8) to (10), with constants of no round ratio."""
    constants = {"M": 3.1, "C": 17.0, "K": 870.0, "P": 21.0, "Omega": 45.0, "Gamma": 0.4, "K0": 9.3e5, "Delta": 2.2e-4}
    length, time = 21.0 / 870.0, np.sqrt(3.1 / 870.0)
    parameters = scaled(constants)
    times = np.linspace(0.0, 30.0, 61)
    run = simulate(HINGE, 30.0, parameters=parameters, output_times=times)
    real = simulate(DIMENSIONAL, 30.0 * time, parameters=constants, output_times=np.minimum(times, 30.0) * time)
    assert real["X"] / length == pytest.approx(run["x"], abs=1e-11)
    assert real["V"] * time / length == pytest.approx(run["v"], abs=1e-11)
    assert [e.time / time for e in real.events] == pytest.approx([e.time for e in run.events], abs=1e-10)
    assert scaled({}) == pytest.approx(
        {"zeta": 0.2, "delta": 0.01, "k0": 300.0, "ce": 0.9, "f": 0.429, "tau": 0.0}, rel=1e-14
    )


@pytest.mark.parametrize(
    ("fmu", "time", "before"), [(HINGE, 2.112, TOUCHING), (CLAMPED, 1.227, RELEASED)], ids=["hinge", "clamped"]
)
def test_a_grazing_mass_lingers_unless_the_stop_cannot_pull(fmu, time, before):
    """tau = 0.3, f = 0.414, entry at 1e-6: when the mass leaves."""
    run = simulate(fmu, 4.0, start={"x": 0.01, "v": 1e-6}, parameters={"f": 0.414, "tau": 0.3})
    leave = next(event for event in run.events if event.after == AWAY)
    assert leave.time == pytest.approx(time, abs=5e-4)
    assert leave.before == before


@pytest.mark.parametrize("fmu", [HINGE, CLAMPED], ids=["hinge", "clamped"])
@pytest.mark.parametrize("v", [0.1, 0.0, -0.1])
def test_start_inside_needs_the_speed_of_entry(fmu, v):
    with pytest.raises(StickslipError, match="give that speed as right_memory, or start outside"):
        simulate(fmu, 1.0, start={"x": 0.02, "v": v})
    with pytest.raises(StickslipError, match=r"'right_memory'.*must be at least"):
        simulate(fmu, 1.0, start={"x": 0.02, "v": v, "right_memory": -0.1})
    run = simulate(fmu, 1.0, start={"x": 0.02, "v": v, "right_memory": 0.2})
    assert run["right_state"][0] == TOUCHING
    assert run["right_force"][0] == pytest.approx(300.0 * 0.01**1.5 * (1 + 0.1425 * v / 0.2), rel=1e-12)


def test_a_run_goes_on_from_inside_a_contact():
    """The state in contact is x, v and the speed of entry."""
    whole = simulate(HINGE, 6.0, output_times=[0.5, 6.0])
    assert whole["right_state"][0] == TOUCHING
    start = {name: whole[name][0] for name in ("x", "v", "right_memory")}
    rest = simulate(HINGE, 6.0, start_time=0.5, start=start, output_times=[6.0])
    assert [rest["x"][0], rest["v"][0]] == pytest.approx([whole["x"][1], whole["v"][1]], rel=1e-11)
