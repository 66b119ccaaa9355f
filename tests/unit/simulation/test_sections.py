"""Crossings of a level, and maps of returns to one, against closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from crossed import crossings
from hypothesis import given, settings
from hypothesis import strategies as st
from lazy_fmu import LazyFmu
from scipy.special import ellipk, ellipkinc

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built, export
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.sections.return_map import ReturnMap
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import RUN
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sections import Section, SectionFollower

FREE = LazyFmu("disc_rig", contacts=[])
BALL = LazyFmu("bouncing_ball")
# J theta'' + k theta = 0
W = 3.0
HARMONIC: dict[str, Any] = {"parameters": {"J": 0.5, "k": 4.5, "c": 0.0}, "start": {"theta": 0.0, "omega": W}}
STICK = 0


def sine_crossings(level: float, direction: int, end: float) -> np.ndarray:
    """Times at which sin(W t) crosses a level."""
    phase = math.asin(level)
    up = (phase + 2 * math.pi * np.arange(-1, 40)) / W
    down = (math.pi - phase + 2 * math.pi * np.arange(-1, 40)) / W
    times = np.sort(np.concatenate([up] * (direction >= 0) + [down] * (direction <= 0)))
    return times[(times > 1e-9) & (times <= end)]


@given(st.floats(-0.99, 0.99), st.sampled_from([1, 0, -1]))
@settings(max_examples=25, deadline=None)
def test_levels_of_a_sine(level, direction):
    level = level if abs(level) > 1e-6 else 0.0
    found = crossings(FREE, "theta", level=level, direction=direction, stop_time=20.0, **HARMONIC)
    assert found.times == pytest.approx(sine_crossings(level, direction, 20.0), abs=1e-12)
    assert found.states["theta"] == pytest.approx(level, abs=1e-14)
    assert np.abs(found.states["omega"]) == pytest.approx(W * math.sqrt(1 - level**2), rel=1e-12)


def test_levels_of_a_velocity():
    found = crossings(FREE, "omega", level=0.0, direction=-1, stop_time=20, **HARMONIC)
    assert found.times == pytest.approx((math.pi / 2 + 2 * math.pi * np.arange(10)) / W, abs=1e-12)
    assert found.states["theta"] == pytest.approx(1.0, abs=1e-13)


def test_a_crossing_at_the_start_does_not_count():
    found = crossings(FREE, "theta", direction=1, stop_time=5.0, **HARMONIC)
    assert found.times == pytest.approx([2 * math.pi / W, 4 * math.pi / W], abs=1e-13)
    later = crossings(FREE, "theta", start_time=7.0, stop_time=12.0, **HARMONIC)
    assert later.times - 7.0 == pytest.approx(found.times, abs=1e-13)


def test_a_start_at_an_extremum_is_no_crossing():
    start = {"theta": 1.0, "omega": 0.0}
    found = crossings(FREE, "omega", direction=0, stop_time=4.0, parameters=HARMONIC["parameters"], start=start)
    assert found.times == pytest.approx(np.arange(1, 4) * math.pi / W, abs=1e-13)


@pytest.mark.parametrize("beyond", [-1e-12, 0.0, 1e-12])
def test_touching_a_level_is_no_crossing(beyond):
    """theta = sin(W t) has its maximum 1 at W t = pi/2."""
    found = crossings(FREE, "theta", level=1.0 + beyond, direction=0, stop_time=1.0, **HARMONIC)
    if beyond < 0:
        assert found.times == pytest.approx(math.pi / 2 / W + np.array([-1, 1]) * math.sqrt(-2 * beyond) / W, abs=1e-9)
    else:
        assert len(found) == 0


def test_no_more_than_asked_for():
    found = crossings(FREE, "theta", direction=0, stop_time=1e6, most=3, **HARMONIC)
    assert found.times == pytest.approx(np.arange(1, 4) * math.pi / W, abs=1e-12)


def test_nothing_is_lost_between_short_calls(monkeypatch):
    monkeypatch.setattr(whole_run, "ALLOWANCE", 1)
    found = crossings(FREE, "theta", level=0.3, direction=0, stop_time=20.0, **HARMONIC)
    assert found.times == pytest.approx(sine_crossings(0.3, 0, 20.0), abs=1e-12)


def test_pendulum(tmp_path: Path):
    """phi'' = -sin(phi) from rest at a: phi = 0 at K, 3K, ...; phi = b at K - F(asin(sin(b/2)/k)), k = sin(a/2)."""
    phi = Coordinate("phi", "rad", "angle", velocity="w")
    unit = Parameter("I", 1.0, "kg m2", "inertia")
    weight = Parameter("G", 1.0, "N m", "weight")
    pendulum = Mechanism(
        name="pendulum",
        title="Pendulum",
        source="closed form",
        coordinates=[phi],
        kinetic_energy=unit * phi.v**2 / 2,
        potential_energy=-weight * sympy.cos(phi),
        contacts=[],
    )
    fmu = Fmu.open(export(pendulum, tmp_path / "pendulum.fmu"))
    a, b = 2.5, 0.7
    k = math.sin(a / 2)
    quarter = float(ellipk(k**2))
    start = {"phi": a}
    down = crossings(fmu, "phi", direction=-1, stop_time=9 * quarter, start=start)
    assert down.times == pytest.approx(quarter * np.array([1.0, 5.0]), abs=1e-12)
    passing = quarter - float(ellipkinc(math.asin(math.sin(b / 2) / k), k**2))
    first = crossings(fmu, "phi", level=b, direction=0, stop_time=10.0, most=1, start=start)
    assert first.times == pytest.approx([passing], abs=1e-12)
    rest = crossings(fmu, "w", direction=0, stop_time=5 * quarter, start=start)
    assert rest.times == pytest.approx(2 * quarter * np.array([1.0, 2.0]), abs=1e-11)


# a ball dropped from 1 m onto a table at rest
DROP: dict[str, Any] = {"start": {"x": 1.0, "v": 0.0}, "parameters": {"A": 0.0, "e": 0.5}}


def test_a_chattering_ball():
    """Bounces at t1 (1 + 2e + 2e^2 + ...), where the velocity jumps upward; at the tops between it passes downward."""
    g, e = 9.81, 0.5
    events = simulate(BALL, 3.0, output_times=[3.0], **DROP).events
    hits = np.array([event.time for event in events if event.before == event.after])
    up = crossings(BALL, "v", direction=1, stop_time=3.0, **DROP)
    down = crossings(BALL, "v", direction=-1, stop_time=3.0, **DROP)
    fall = math.sqrt(2 / g)
    bounces = fall * (1 + 2 * (e - e ** np.arange(1, len(up) + 1)) / (1 - e))
    assert len(up) in (len(hits), len(hits) + 1)  # the last one is followed by rest
    assert up.times[: len(hits)].tolist() == hits.tolist()
    assert up.times == pytest.approx(bounces, abs=1e-13)
    assert up.states["v"][:10] == pytest.approx(g * fall * e ** np.arange(1, 11), rel=1e-10)
    tops = bounces + fall * e ** np.arange(1, len(up) + 1)
    assert down.times == pytest.approx(tops[: len(down)], abs=1e-13)
    assert len(down) >= len(hits) - 1


def test_a_bounce_touches_the_level_of_the_table():
    assert len(crossings(BALL, "x", direction=0, stop_time=3.0, **DROP)) == 0
    # h > e^2 is passed on the way down only, lower ones on every bounce that reaches them
    for h, passes in ((0.5, 1), (0.2, 3), (0.05, 5)):
        assert len(crossings(BALL, "x", level=h, direction=0, stop_time=3.0, **DROP)) == passes


def test_rest_at_a_level():
    """A block that comes to the speed of the belt, sticks, and leaves: passed where it leaves to the other side."""
    fmu = Fmu.open(built("forced_stick_slip"))
    run = simulate(fmu, 30.0)
    assert any(event.after == STICK for event in run.events)
    side, up, down = 0, [], []
    for event in run.events:
        if event.after == -side and side:
            (up if event.after > 0 else down).append(event.time)
        side = event.after or side
    for direction, times in ((1, up), (-1, down)):
        found = crossings(fmu, "v", level=1.0, direction=direction, stop_time=30.0)
        assert found.times.tolist()[-len(times) :] == pytest.approx(times, abs=1e-12)
        assert len(found) - len(times) in (0, 1)  # one where the start, whose side no event tells, is left


def test_return_map_of_a_damped_swing():
    """Over one turn an amplitude shrinks by exp(-a T), a = c/2J, T = 2 pi/sqrt(k/J - a^2)."""
    parameters = {"J": 0.5, "k": 4.5, "c": 0.3}
    a = 0.3
    ratio = math.exp(-a * 2 * math.pi / math.sqrt(9.0 - a**2))
    P = ReturnMap(
        FREE, "theta", section=Section("omega", 0.0, -1), start={"omega": 0.0}, cap=10.0, parameters=parameters
    )
    assert [P(x) for x in (1.0, 0.1)] == pytest.approx([ratio, 0.1 * ratio], rel=1e-13)
    assert P.slope(0.7) == pytest.approx(ratio, rel=1e-12)
    back = P.crossing(1.0)
    assert back is not None and back.rates["omega"] == pytest.approx(-9.0 * ratio, rel=1e-12)
    # on the section theta = 0 the speed shrinks alike, and the time of return matters to its slope
    start = lambda x: {"theta": 0.0, "omega": 2 * x}  # noqa: E731
    Q = ReturnMap(FREE, "omega", section=Section("theta"), start=start, cap=10.0, parameters=parameters)
    assert Q(1.0) == pytest.approx(2 * ratio, rel=1e-13)
    assert Q.slope(1.0) == pytest.approx(2 * ratio, rel=1e-9)
    assert math.isnan(ReturnMap(FREE, "theta", section=Section("omega"), cap=0.1)(1.0))
    second = ReturnMap(
        FREE,
        "theta",
        section=Section("omega", 0.0, 0),
        accept=lambda one: one.states["theta"] > 0,
        cap=10.0,
        parameters=parameters,
    )
    assert second(1.0) == pytest.approx(ratio, rel=1e-13)


def test_what_is_refused():
    with pytest.raises(StickslipError, match=r"has no state 'omga'. Did you mean 'omega'"):
        crossings(FREE, "omga", stop_time=1.0)
    with pytest.raises(StickslipError, match="crossed in the direction 1"):
        crossings(FREE, "omega", direction=2, stop_time=1.0)
    with pytest.raises(StickslipError, match="must end after it starts"):
        crossings(FREE, "omega", stop_time=0.0)
    with pytest.raises(StickslipError, match="must be a finite number"):
        crossings(FREE, "omega", stop_time=1.0, start={"theta": math.nan})
    with pytest.raises(StickslipError, match="positive number of seconds"):
        ReturnMap(FREE, "theta", section=Section("omega"), cap=math.inf)
    with pytest.raises(StickslipError, match="'table' is penetrated"):
        crossings(BALL, "v", stop_time=1.0, start={"x": -1.0})
    follower = SectionFollower(FREE, Section("theta"), parameters=HARMONIC["parameters"])
    one = follower.follow(HARMONIC["start"], 50.0)
    first = next(one)
    assert [next(follower.follow(HARMONIC["start"], 50.0)).time for _ in range(2)] == [first.time, first.time]
    with pytest.raises(StickslipError, match="Another motion has begun"):
        next(one)


def test_an_abandoned_section_is_forgotten():
    """The next request of the instance has no room for crossings, so none may be written."""
    follower = SectionFollower(FREE, Section("theta"), parameters=HARMONIC["parameters"])
    next(follower.follow(HARMONIC["start"], 20.0))
    times = np.array([20.0])
    guard = np.full(8 * len(follower._recorded), np.pi)
    request = whole_run.Request(times, follower._recorded)
    values = np.empty((1, len(follower._recorded)))
    c = whole_run.structure(request, values, follower._instance)
    c.crossings = guard.ctypes.data
    assert follower._engine.simulate(follower._instance.handle, c) == RUN.DONE
    assert c.n_crossings == 0 and (guard == np.pi).all()
    assert values[0, 1] == pytest.approx(math.sin(W * 20.0), abs=1e-12)
