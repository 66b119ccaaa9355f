"""Both sides of events in one run: closed forms of an impact, of corners of stick-slip, of a jump of an input."""

import math
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from fmu_models import Signal, load, simulate
from fmu_models.report.trajectory_figure import trajectory_figure
from fmu_models.simulation.accuracy import simulate_with_error
from fmu_models.simulation.trajectory import Sides, Trajectory
from identification.commands import application

G, HEIGHT, E = 9.81, 0.4, 0.7
FALL = math.sqrt(2.0 * HEIGHT / G)
DROPPED: dict[str, Any] = {"start": {"x": HEIGHT, "v": 0.0}, "parameters": {"A": 0.0, "e": E, "g": G}}


@pytest.fixture(scope="module")
def ball():
    return load("bouncing_ball")


@pytest.fixture(scope="module")
def belt():
    return load("block_on_belt")


def both(run: Trajectory) -> Sides:
    assert run.sides is not None
    return run.sides


def test_both_speeds_of_an_impact_stand_at_one_time(ball):
    run = simulate(ball, 1.4, output_times=[0.0, 0.1, 1.4], sides=True, **DROPPED)
    speed = E ** np.arange(3) * G * FALL  # of arrival at the table
    hits = FALL + 2.0 * FALL * np.cumsum(np.concatenate([[0.0], E ** np.arange(1, 3)]))
    sides = both(run)
    assert sides.time[:6] == pytest.approx(np.repeat(hits, 2), rel=1e-13)
    assert (sides.time[0::2] == sides.time[1::2]).all()
    assert sides.values["v"][:6] == pytest.approx(np.stack([-speed, E * speed], axis=1).ravel(), rel=1e-12)
    assert sides.time.size == 2 * len(run.events)
    assert run.time.tolist() == [0.0, 0.1, 1.4]
    drawn = run.drawn
    assert (np.diff(drawn.time) >= 0.0).all() and drawn.time.size == 3 + sides.time.size
    (at,) = np.nonzero(drawn.time == run.events[0].time)
    assert drawn["v"][at] == pytest.approx([-speed[0], E * speed[0]], rel=1e-12)
    assert drawn["x"].min() > -1e-14


def test_corners_of_stick_slip(belt):
    m, k, c, n, mu, speed = 1.0, 100.0, 0.5, 9.81, 0.65, 0.1
    sides = both(simulate(belt, 12.0, output_times=[4.0, 12.0], sides=True))
    x, rate, state = (sides.values[name].reshape(-1, 2) for name in ("x", "der(v)", "belt_state"))
    assert sides.time[0] > 4.0 and len(x) > 4
    lands, leaves = state[:, 1] == 0, state[:, 0] == 0
    assert (lands != leaves).all()
    assert rate[lands, 0] == pytest.approx((n * mu - k * x[lands, 0] - c * speed) / m, rel=1e-10)  # slips no more
    assert (np.abs(rate[lands, 0]) > 0.1).all() and (rate[lands, 1] == 0.0).all() and (rate[leaves, 0] == 0.0).all()
    assert x[leaves] == pytest.approx((n * mu - c * speed) / k, rel=1e-12)
    first = int(np.flatnonzero(lands)[0])
    stuck = np.diff(sides.time[::2][first : first + 2])
    assert stuck == pytest.approx(np.diff(x[first : first + 2, 0]) / speed, rel=1e-11)


def test_an_input_that_jumps(belt):
    """The belt stops at once under a block that sticks: before it carries the block, afterwards the block slides."""
    jump = Signal([0.0, 0.2, 0.2, 0.4], [0.1, 0.1, 0.0, 0.0])
    run = simulate(belt, 0.4, start={"v": 0.1}, inputs={"v_belt": jump}, sides=True)
    values = {name: both(run).values[name][:2].tolist() for name in ("v_belt", "slip", "belt_state")}
    assert both(run).time[:2].tolist() == [0.2, 0.2]
    assert values == {"v_belt": [0.1, 0.0], "slip": [0.0, 0.1], "belt_state": [0, 1]}
    assert both(run).values["x"][:2] == pytest.approx([0.02, 0.02])


@pytest.mark.parametrize(
    ("name", "until", "settings"),
    [
        ("bouncing_ball", 10.0, {"start": {"x": 0.1}, "parameters": {"e": 0.9}}),
        ("bouncing_ball", 3.0, {"start": {"x": 0.4, "v": 0.0}, "parameters": {"A": 0.0, "e": 0.9}}),
        ("woodpecker", 20.0, {}),
        ("hinge_clearance", 200.0, {}),
        ("impact_pair", 30.0, {}),
        ("disc_rig", 20.0, {"inputs": {"w0": Signal([0.0, 3.0, 3.0, 20.0], [0.2, 0.4, -0.1, 0.3])}}),
        ("planar_hopf", 20.0, {}),
    ],
)
def test_who_looks_changes_nothing(name, until, settings):
    fmu, times = load(name), np.linspace(0.0, until, 77)
    plain = simulate(fmu, until, output_times=times, **settings)
    looked = simulate(fmu, until, output_times=times, sides=True, **settings)
    assert list(looked.events) == list(plain.events) and looked.steps == plain.steps
    assert all((looked[variable] == plain[variable]).all() for variable in plain.values)
    assert plain.sides is None and plain.drawn is plain
    instants = np.unique([event.time for event in plain.events])
    assert both(looked).time.tolist() == np.repeat(instants[instants > 0.0], 2).tolist()
    contacts = {event.contact for event in plain.events}
    for contact in contacts:  # what the events say of the states of contacts
        pairs = both(looked).values[f"{contact}_state"].reshape(-1, 2)
        told = {event.time: event.after for event in plain.events if event.contact == contact and event.time > 0.0}
        at = dict(zip(both(looked).time[::2].tolist(), pairs[:, 1].tolist(), strict=True))
        assert {time: at[time] for time in told} == told
        assert (pairs[1:, 0] == pairs[:-1, 1]).all()


def test_a_figure_has_the_jump_and_the_table_the_times_asked_for(ball, tmp_path):
    run, _ = simulate_with_error(ball, 0.5, output_times=np.linspace(0.0, 0.5, 5), sides=True, **DROPPED)
    (axes,) = trajectory_figure(run, ball, ["v"]).axes
    line = next(line for line in axes.lines if np.size(line.get_xdata()) > 5)
    hit = np.asarray(line.get_xdata()) == run.events[0].time
    assert np.asarray(line.get_ydata())[hit] == pytest.approx([-G * FALL, E * G * FALL], rel=1e-12)
    assert np.max(run.plot("v").lines[0].get_ydata()) == pytest.approx(E * G * FALL, rel=1e-12)
    arguments = ["simulate", "bouncing_ball", "--until", "0.5", "--samples", "5"]
    files = ["-o", str(tmp_path / "run.csv"), "--figure", str(tmp_path / "run.svg"), "--plot", "v"]
    assert CliRunner().invoke(application.only(arguments), [*arguments, *files]).exit_code == 0
    assert len((tmp_path / "run.csv").read_text().splitlines()) == 6
