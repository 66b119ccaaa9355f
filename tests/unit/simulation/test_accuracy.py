"""Error estimates against errors that are known."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

from fmu_models import TIME, Coordinate, Coulomb, Friction, Mechanism, Parameter, load, simulate
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import accuracy
from fmu_models.simulation.accuracy import simulate_with_error
from fmu_models.simulation.defect import defect_of


def free_decay(t: float) -> list[float]:
    s, w = 0.055 / (2 * 0.0548), math.sqrt(2.62 / 0.0548 - (0.055 / (2 * 0.0548)) ** 2)
    decay = 0.15 * math.exp(-s * t)
    return [decay * (math.cos(w * t) + s / w * math.sin(w * t)), -decay * (w + s * s / w) * math.sin(w * t)]


# name, end s, arguments, states at the end as printed or in closed form, rounding of these
KNOWN: list[tuple[str, float, dict[str, Any], list[float], float]] = [
    ("discontinuous_support", 20 * math.pi, {}, [3.648464099396639, 2.514570496974713], 1e-15),
    (
        "discontinuous_support",
        20 * math.pi,
        {"parameters": {"ks": 1e5}, "start": {"x": 3.440645004751037, "v": 2.060653451073986}},
        [3.440645004751037, 2.060653451073986],
        1e-15,
    ),
    ("bouncing_ball", 1.0, {}, [0.005115361730320378, -0.41084764605635454], 1e-17),
    ("fermi_accelerator", 20 * math.pi, {}, [8.573434546814733, 16.00131151416345], 1e-14),
]


@pytest.mark.parametrize(("name", "end", "arguments", "known", "digits"), KNOWN)
def test_the_estimate_is_near_the_error(name, end, arguments, known, digits):
    """Not less than a third of it, and no more than some hundred roundings beyond: neither lie nor fear."""
    run, estimate = simulate_with_error(Fmu.open(built(name)), end, **arguments)
    states = list(estimate.end)
    for state, value in zip(states, known, strict=True):
        error = abs(run[state][-1] - value)
        size = np.abs(run[state]).max()
        assert error <= 3 * estimate.end[state] + digits
        assert estimate.end[state] <= 30 * error + 1e-12 * size
    assert estimate.apart is None and not estimate.refused
    assert min(estimate.seconds) > 0.0


def test_a_finer_run_takes_the_series_that_sums_stand_for():
    """Whose steps are shorter: sums have more orders. Both are right."""
    fmu = Fmu.open(built("discontinuous_support"))
    sums, series = (simulate(fmu, 60.0, tolerance=tolerance) for tolerance in (1e-14, 1e-15))
    assert series.steps >= 1.2 * sums.steps
    assert max(np.abs(sums[state] - series[state]).max() for state in fmu.states) < 1e-12


def test_closed_form_of_the_free_decay():
    fmu = Fmu.open(built("disc_rig", contacts=[]))
    run, estimate = simulate_with_error(fmu, 3.0, start={"theta": 0.15})
    for state, value in zip(("theta", "omega"), free_decay(3.0), strict=True):
        assert abs(run[state][-1] - value) <= 3 * estimate.end[state] + 1e-16


def test_the_estimate_sees_a_sensitive_motion():
    """Chaos doubles errors at its rate, from rounding to the size of the motion: the estimate says when."""
    fmu = Fmu.open(built("hinge_clearance"))
    short = simulate_with_error(fmu, 40.0, parameters={"f": 0.405})[1]
    long = simulate_with_error(fmu, 300.0, parameters={"f": 0.405})[1]
    assert short.apart is None and short.relative < 1e-6
    assert long.apart is not None and 60.0 < long.apart < 200.0
    assert long.relative <= 1e-3


def test_equal_drives_stay_equal():
    """Moved by one rounding, two discs of one speed remain so: stick on both is no other motion."""
    fmu = Fmu.open(built("disc_rig"))
    estimate = simulate_with_error(fmu, 10.0, inputs={"w0": 0.83, "w1": 0.83})[1]
    assert estimate.apart is None
    assert estimate.relative < 1e-12


def test_velocities_that_jump_are_not_compared_at_their_events():
    """An output time at an impact would show the jump of a run in which it comes one rounding later."""
    fmu = Fmu.open(built("bouncing_ball"))
    first = simulate_with_error(fmu, 1.0)[0].events[0].time
    estimate = simulate_with_error(fmu, 1.0, output_times=[0.0, first, 1.0])[1]
    assert estimate.states["v"] < 1e-13


def test_events_that_move_take_the_times_around_them_along():
    """A ball in chaos: at the times of its bounces companions have not bounced yet, or have long since."""
    fmu = Fmu.open(built("bouncing_ball"))
    chaos: dict[str, Any] = {"parameters": {"A": 6e-3, "e": 0.8}}
    events = [event.time for event in simulate_with_error(fmu, 4.0, **chaos)[0].events]
    estimate = simulate_with_error(fmu, 4.0, output_times=events, **chaos)[1]
    assert len(events) > 10
    assert estimate.event_time > 1e-15
    assert estimate.apart is None and estimate.relative < 1e-6


def test_rounding_of_the_data_counts():
    """Motion in straight lines has no truncation at any tolerance: what is left is the rounding of its speed."""
    fmu = Fmu.open(built("impact_pair"))
    run, estimate = simulate_with_error(fmu, 100.0, parameters={"A": 0.0, "e": 1.0}, start={"x": 0.3, "v": 0.7})
    assert estimate.by.startswith("data")
    assert 1e-15 < estimate.end["x"] < 1e-12
    assert len(run.impacts) > 10


def test_equal_values_move_together():
    """mu_k may not exceed mu_s: where they are equal they still are when moved."""
    fmu = Fmu.open(built("disc_rig", contacts=["disc0"]))
    estimate = simulate_with_error(fmu, 5.0, parameters={"mu_s0": 0.3, "mu_k0": 0.3})[1]
    assert estimate.refused == {}


def test_a_companion_that_cannot_run_is_named():
    """Walls that leave each other one rounding of room: moved by one rounding they overlap. Said, not hidden."""
    fmu = Fmu.open(built("fermi_accelerator"))
    estimate = simulate_with_error(fmu, 1.0, parameters={"L": 1.0 + 2**-52, "A": 1.0}, start={"x": 1.0, "v": 0.0})[1]
    assert "the walls overlap" in estimate.refused["data up"]
    assert estimate.relative < 1e-15


def test_progress_rises_to_one():
    seen: list[float] = []
    simulate_with_error(Fmu.open(built("hinge_clearance")), 50.0, progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == pytest.approx(1.0)


def test_what_simulate_refuses_is_refused():
    with pytest.raises(StickslipError, match="must end after it starts"):
        simulate_with_error(Fmu.open(built("bouncing_ball")), -1.0)


def recorded(state, rate, *deciding):
    """A run whose values are functions of time."""
    return lambda t: np.column_stack([np.broadcast_to(f(t), t.shape) for f in (state, rate, *deciding)])


def test_the_defect_of_a_run_that_obeys_is_rounding():
    for w in (1.0, 30.0, 1000.0):
        record = recorded(lambda t, w=w: np.sin(w * t) / w, lambda t, w=w: np.cos(w * t))
        found = defect_of(record, np.array([0.0, 1.0, 7.0]), 1)
        assert found.resolved and found.contradiction is None
        assert np.abs(found.sums).max() < 1e-13


@pytest.mark.parametrize("width", [1.0, 1e-1, 1e-2, 1e-3])
def test_the_defect_of_a_pulse_that_was_passed_is_its_integral(width):
    """The state knows nothing of a force that is there."""
    record = recorded(lambda t: 0.0 * t, lambda t: np.exp(-np.minimum(((t - 4.321) / width) ** 2, 700.0)))
    found = defect_of(record, np.array([0.0, 10.0]), 1)
    truth = -width * math.sqrt(math.pi) * (math.erf(5.679 / width) + math.erf(4.321 / width)) / 2
    assert found.sums[-1, 0] == pytest.approx(truth, rel=1e-9)
    begun = found.time[np.argmax(np.abs(found.sums[:, 0]) > 1e-6 * abs(truth))]
    assert 4.321 - 6 * width < begun < 4.321


def test_a_feature_at_an_event_is_seen_however_narrow():
    """A law's curve at zero slip has its width at the event where slip ends."""
    for width in (1e-3, 1e-5, 1e-7):
        record = recorded(lambda t: 0.0 * t, lambda t, w=width: np.exp(-np.minimum((3.0 - t) / w, 700.0)))
        found = defect_of(record, np.array([0.0, 3.0]), 1)
        assert found.sums[:, 0].min() == pytest.approx(-width, rel=1e-3)


def test_a_deciding_function_that_turns_negative_contradicts():
    record = recorded(lambda t: t, lambda t: 1.0 + 0.0 * t, lambda t: 1.0 + 0.0 * t, lambda t: 2.0 + np.cos(50 * t) - t)
    time, which = defect_of(record, np.array([0.0, 4.0]), 1).contradiction or (0.0, -1)
    times = np.linspace(0.0, 4.0, 400001)
    first = times[np.argmax(2.0 + np.cos(50 * times) - times < 0)]
    assert which == 1 and time == pytest.approx(first, abs=0.01)


def test_what_contradicts_its_contact_is_named_with_its_time(monkeypatch):
    monkeypatch.setattr(accuracy, "defect_of", lambda *run: replace(defect_of(*run), contradiction=(0.2, 0)))
    _, estimate = simulate_with_error(Fmu.open(built("block_on_belt")), 0.5)
    assert (estimate.wrong, estimate.contradiction) == (0.2, "belt_indicator")


def wrong(fmu: Fmu, truth: float, end: float, state: str, **arguments: Any) -> None:
    """The estimate is not below a tenth of the error, whatever the steps are."""
    run, estimate = simulate_with_error(fmu, end, **arguments)
    error = abs(run[state][-1] - truth)
    assert error <= 10 * estimate.end[state] + 1e-13
    assert estimate.end[state] <= 100 * error + 1e-12
    assert error < 1e-9 or estimate.wrong is not None


@pytest.mark.parametrize("v_s", [10.0, 1.0, 0.1, 0.05, 0.01, 1e-3, 1e-4])
def test_narrow_friction_curves(v_s):
    """A block on a belt from x = 0.2 m: each time it has the belt's speed it sticks, or goes through."""

    def rates(t, y, sign):
        mu = 0.35 + 0.3 * math.exp(-min(((y[1] - 0.1) / v_s) ** 2, 700.0))
        return [y[1], -100.0 * y[0] - 0.5 * y[1] - sign * 9.81 * mu]

    def at_belt_speed(t, y, sign):
        return (y[1] - 0.1) * sign

    at_belt_speed.terminal, at_belt_speed.direction = True, -1.0  # type: ignore[attr-defined]
    options = {"method": "DOP853", "rtol": 3e-13, "atol": 1e-15, "events": at_belt_speed}
    t, x, v, sign = 0.0, 0.2, 0.0, -1.0
    while t < 0.4:
        longest = max(v_s / 100, 2e-5) if v_s < 0.2 else 2e-3
        slide = solve_ivp(rates, (t, 0.4), [x, v], args=(sign,), max_step=longest, **options)
        t, (x, v), sign = slide.t[-1], slide.y[:, -1], -sign
        if slide.status == 1 and abs(100.0 * x + 0.05) < 9.81 * 0.65:
            x, t = x + 0.1 * (0.4 - t), 0.4
    wrong(
        Fmu.open(built("block_on_belt", laws={"belt": "stribeck"})),
        x,
        0.4,
        "x",
        start={"x": 0.2},
        parameters={"v_s": v_s},
    )


@pytest.mark.nightly
def test_rounding_of_what_is_held_is_no_error():
    """A block at rest beside a spring: its speed is rounding of the forces that hold one another."""
    m, length = Parameter("m", 0.515625, "kg", "mass", positive=True), Parameter("l", 2.0, "m", "length", positive=True)
    k, N = Parameter("k", 1.765625, "N/m", "stiffness"), Parameter("N", 0.5, "N", "normal force", minimum=0.0)
    mu = Parameter("mu", 0.484375, "1", "friction coefficient", minimum=0.0)
    x = Coordinate("x", "m", "position", velocity="v")
    held = Mechanism(
        name="held",
        title="Block at rest",
        source="closed form",
        coordinates=[x],
        kinetic_energy=m * (1 + (x / length) ** 2) * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        contacts=[Friction(name="floor", slip=x.v, law=Coulomb(N, mu))],
    )
    fmu = load(held)
    speeds = []
    for start in (0.015625, 0.1):
        run, estimate = simulate_with_error(fmu, 3.0, start={"x": start})
        speeds.append(np.abs(run["v"]).max())
        assert estimate.wrong is None and estimate.relative < 1e-9
    assert 0.0 < max(speeds) < 1e-15


@pytest.mark.nightly
def test_a_plate_that_shakes():
    """A slip that depends on time decides, though the motion is a parabola: v(20 s) by bisection of closed forms."""
    m, N = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("N", 1.0, "N", "normal force", minimum=0.0)
    mu = Parameter("mu", 0.3, "1", "friction coefficient", minimum=0.0)
    x = Coordinate("x", "m", "displacement", velocity="v", v_start=2.0)
    speed = Parameter("b", 1.0, "m/s", "speed") * sympy.sin(Parameter("w", 1.0, "rad/s", "frequency") * TIME)
    plate = Friction(name="plate", slip=x.v - speed, law=Coulomb(N, mu))
    shaken = Mechanism(
        name="plate", title="plate", source="-", coordinates=[x], kinetic_energy=m * x.v**2 / 2, contacts=[plate]
    )
    run, estimate = simulate_with_error(load(shaken), 20.0)
    error = abs(run["v"][-1] - 0.04191231)
    assert error < 1e-8 or (estimate.wrong is not None and error <= 10 * estimate.end["v"] <= 1000 * error)
