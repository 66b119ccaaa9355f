"""Tangents in lanes: derivatives and growth are those of the series, and what closed forms say."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from test_lanes import FAMILIES, GO, HELD, family, held_family

from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.families.jobs import Jobs
from fmu_models.fmu.load import load
from fmu_models.lanes.library import lanes_of
from fmu_models.sections.strobe import Strobe


@pytest.mark.parametrize("name", FAMILIES)
def test_derivatives_over_ten_periods_are_those_of_the_series(name):
    system, jobs = family(name, 40, 10)
    jobs = dataclasses.replace(jobs, derivatives=True)
    lanes, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert lanes.in_lanes.sum() > 0.98 * lanes.steps.sum()
    made, right = lanes.derivatives, series.derivatives
    errors = np.abs(made - right).max(axis=(2, 3)) / np.abs(right).max(axis=(2, 3))
    assert np.median(errors) < 1e-13
    assert errors.max() < 1e-10
    # the motion itself is the same with tangents as without, to the bit
    alone = system.run(dataclasses.replace(jobs, derivatives=False), GO)
    whole = lanes.in_lanes == 10
    assert np.array_equal(lanes.points[whole], alone.points[whole])


def test_each_impact_shrinks_areas_by_the_square_of_its_restitution():
    system, jobs = family("impact_pair", 200, 5)
    made = system.run(dataclasses.replace(jobs, derivatives=True), GO)
    e = float(load("impact_pair").variables["e"].start or 0.0)
    areas = np.linalg.det(made.derivatives)
    assert (made.began.sum(axis=-1) == 2).sum() > 500
    assert np.abs(areas / e ** (2 * made.began.sum(axis=-1)) - 1.0).max() < 1e-13


def test_growth_is_the_same_bits_for_any_number_of_lanes_and_that_of_the_series(monkeypatch):
    system, jobs = family("discontinuous_support", 13, 4)
    jobs = dataclasses.replace(jobs, transient=3, batch=5, tangents=2)
    series = system.stepped_by("taylor").run(jobs, GO)
    made = []
    for width in (1, 2, 4, 8):
        stepper = lanes_of(system.fmu).stepper(width)
        if stepper is not None:
            monkeypatch.setitem(vars(system.backend), "stepper", lambda _, one=stepper: one)
            made.append(system.run(jobs, GO))
    for one in made:
        assert np.array_equal(one.growth, made[0].growth)
    assert made[0].growth == pytest.approx(series.growth, abs=1e-8)


@pytest.mark.parametrize("name", ["hinge", "table", "discontinuous_support"])
def test_strobes_that_nobody_looks_at_are_the_same_bits_whoever_is_beside(name):
    # seven strobes before the first row and three to a row are made by one call, until one motion needs the engine
    system, jobs = held_family(name, 11, 4) if name in HELD else family(name, 11, 4)
    jobs = dataclasses.replace(jobs, transient=7, batch=3, tangents=2)
    made = system.run(jobs, GO)
    alone = [system.run(jobs.part(i, i + 1), GO) for i in range(len(jobs))]
    for field in ("points", "times", "growth", "held", "began", "steps", "in_lanes"):
        assert np.array_equal(getattr(made, field), np.concatenate([getattr(one, field) for one in alone])), field
    assert made.steps.tolist() == [19] * len(jobs)
    every = system.run(dataclasses.replace(jobs, batch=1, transient=0, rows=19), GO)
    assert np.array_equal(made.points, every.points[:, 9::3])
    assert np.array_equal(made.began, every.began[:, 7:].reshape(len(jobs), 4, 3, -1).sum(axis=2))


@pytest.mark.nightly
def test_a_motion_that_nothing_forces_has_an_exponent_zero_along_itself():
    system = Strobe(load("planar_hopf"), period=1.0, autonomous=True)
    start = np.array([[0.3, 0.2]])
    jobs = Jobs(start, transient=200, rows=1, batch=50, tangents=2, flow=True)
    lanes, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert lanes.in_lanes.sum() > 0
    assert lanes.growth == pytest.approx(series.growth, abs=1e-9)
    assert abs(lanes.growth[0, 0, 0]) < 1e-9


def test_a_touch_without_speed_has_no_derivative_and_says_so():
    # the highest point of a free swing is behind the wall by no more than rounding
    values = {"f0": 0.0, "c": 0.0, "g": 1.0 - 1e-14}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=values)
    made = system.run(Jobs(np.array([[0.0, 1.0], [0.0, 2.0]]), rows=1, derivatives=True), GO)
    series = system.stepped_by("taylor").run(Jobs(np.array([[0.0, 1.0]]), rows=1, derivatives=True), GO)
    assert "has no derivative" in made.messages[0]
    assert made.messages[0] == series.messages[0]
    assert made.filled[1] == made.in_lanes[1] == 1


def test_analyses_take_their_tangents_from_lanes_and_say_so():
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={"omega": 0.9})
    start = [0.0, 0.0]
    exact, series = (
        lyapunov(one, start, periods=256, transient=50, motions=2) for one in (system, system.stepped_by("taylor"))
    )
    assert exact.how.startswith("exact flow")
    assert series.how == ""
    assert exact.values == pytest.approx(series.values, abs=1e-8)
    found = orbit_diagram(system, "omega", [0.9, 0.95], transient=20, exponents=1024)
    assert found.how.startswith("exact flow") and "by series" not in found.how


def test_starts_that_cannot_be_leave_their_places_empty():
    system = Strobe(load("bouncing_ball"), forcing="omega")
    starts = np.array([[0.01, 0.0], [-1.0, 0.0], [-1.0, 0.0], [-1.0, 0.0]])
    made = system.run(Jobs(starts, rows=2, derivatives=True), GO)
    assert made.filled.tolist() == [2, 0, 0, 0]
    assert all("is penetrated" in made.messages[i] for i in (1, 2, 3))


@pytest.mark.parametrize("name", HELD)
def test_differences_of_what_is_held_are_those_of_the_series_from_the_same_point(name):
    """Of rows that go on from where a contact is held, too, in lanes and by series."""
    system, jobs = held_family(name, 12, 12)
    jobs = dataclasses.replace(jobs, derivatives=True)
    by_series = system.stepped_by("taylor")
    varied = {parameter: np.repeat(values, 11) for parameter, values in jobs.varied.items()}
    for rows in (system.run(jobs, GO), by_series.run(jobs, GO)):
        assert (rows.held.sum(axis=-1) > 0).any()
        starts = Jobs(rows.points[:, :-1].reshape(12 * 11, -1), varied, rows=1, derivatives=True)
        lanes, series = system.run(starts, GO), by_series.run(starts, GO)
        assert lanes.in_lanes.sum() > 0.7 * 12 * 11
        right = series.derivatives
        sizes = np.abs(right).max(axis=(1, 2, 3))
        assert (np.abs(lanes.derivatives - right).max(axis=(1, 2, 3)) / sizes).max() < 1e-9
        # by speeds: a start that is off its wall by rounding strikes it, and what that makes of places is rounding
        errors = np.abs(rows.derivatives[:, 1:].reshape(right.shape) - right)[..., right.shape[-1] // 2 :]
        assert (errors.max(axis=(1, 2, 3)) / sizes).max() < 1e-9


def test_growth_of_what_is_held_is_that_of_the_series_and_what_stick_takes_away_is_lost():
    system = Strobe(load("woodpecker"), period=0.146, autonomous=True)
    varied = {"eN1": np.array([0.42, 0.5])}
    jobs = Jobs(np.tile(system.start(), (2, 1)), varied, transient=21, rows=10, tangents=6, flow=True)
    lanes, series = system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)
    assert (lanes.in_lanes == lanes.steps).all()
    assert np.isneginf(lanes.growth[..., 3:]).all()
    assert lanes.growth == pytest.approx(series.growth, abs=1e-8)


def test_an_impact_that_rubs_has_the_differences_of_two_neighbours():
    system = Strobe(load("woodpecker"), period=0.05, autonomous=True)
    start = system.run(Jobs(system.start()[None], rows=12), GO).points[0, -1]
    step = 1e-7 * np.eye(len(start))
    for i in (0, 2, 5):  # those that leave the sleeve on the pole
        both = system.run(Jobs(np.stack([start + step[i], start - step[i]]), rows=1), GO).points[:, 0]
        made = system.run(Jobs(start[None], rows=1, derivatives=True), GO).derivatives[0, 0, :, i]
        assert made == pytest.approx((both[0] - both[1]) / 2e-7, rel=1e-5, abs=1e-4)
