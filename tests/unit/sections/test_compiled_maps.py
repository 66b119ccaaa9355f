"""Families of runs of a map: the compiled rule does what the steps of NumPy do, one after the other."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy

from fmu_models import Map, Parameter, State
from fmu_models.analyses.attractors import claimed, targets_of
from fmu_models.families import jobs as families
from fmu_models.families import stepwise
from fmu_models.families.jobs import Jobs
from fmu_models.maps import MAPS
from fmu_models.sections.iteration import Iteration
from fmu_models.simulation.rows import RunRows

STOP = np.zeros(1, np.int32)
SMOOTH = ("henon", "high_bounce")


def system(name: str, **values: float) -> Iteration:
    return Iteration.of(MAPS.load(name), values)


def starts(iteration: Iteration, count: int = 40) -> np.ndarray:
    low, high = iteration.box.T
    return low + (high - low) * np.random.default_rng(2).random((count, len(low)))


def assert_same(compiled: RunRows, interpreted: RunRows, tolerance: float = 0.0, without: tuple[str, ...] = ()) -> None:
    assert (compiled.outcomes == interpreted.outcomes).all() and (compiled.filled == interpreted.filled).all()
    arrived = np.flatnonzero(compiled.outcomes <= families.ABSORBED)
    arrays: dict[str, Any] = dict(interpreted.only(arrived).arrays())
    values: Any
    for name, values in compiled.only(arrived).arrays().items():
        if name not in ("in_lanes", *without):
            np.testing.assert_allclose(values, arrays[name], rtol=tolerance, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("asked", [{"batch": 5, "rows": 4}, {"rows": 3, "derivatives": True}, {"rows": 20, "chain": 4}])
def test_rows_are_those_of_the_interpreted_rule(name, asked):
    iteration = system(name)
    jobs = Jobs(starts(iteration), transient=7, **asked)
    compiled, interpreted = iteration.run(jobs, STOP), stepwise.run(iteration, jobs, STOP)
    assert (compiled.derivatives.size > 0) == (interpreted.derivatives.size > 0) == ("derivatives" in asked)
    done = compiled.outcomes == families.FINISHED
    assert done.any() and (interpreted.steps[done] == 7 + jobs.rows * jobs.batch).all()
    # NumPy rounds sines of many numbers otherwise than libm those of one
    assert_same(compiled, interpreted, 1e-12 if name == "high_bounce" else 0.0, without=("steps",))


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("tangents", [1, 2])
def test_differences_grow_as_those_of_the_interpreted_rule(name, tangents):
    iteration = system(name)
    jobs = Jobs(starts(iteration, 6), transient=3, rows=2, batch=9, tangents=tangents)
    assert_same(iteration.run(jobs, STOP), stepwise.run(iteration, jobs, STOP), 1e-11, without=("steps",))


def test_a_difference_that_is_lost_in_the_transient_is_taken_up_after_it():
    """The logistic map is flat at 1/2, which it maps to r/4."""
    r = 3.9
    jobs = Jobs(np.array([[0.5]]), transient=1, tangents=1)
    for run in (system("logistic", r=r).run(jobs, STOP), stepwise.run(system("logistic", r=r), jobs, STOP)):
        assert run.growth[0, 0, 0] == pytest.approx(math.log(r * (2 * r / 4 - 1)), rel=1e-12)


def test_sums_of_exponents_are_what_volumes_say():
    rows = system("henon").run(Jobs(np.array([[0.1, 0.1]]), transient=100, rows=50, batch=100, tangents=2), STOP)
    np.testing.assert_allclose(rows.growth.sum(axis=2), 100.0 * np.log(0.3), rtol=1e-13)
    assert rows.growth[0, :, 0].mean() / 100.0 == pytest.approx(0.419, abs=0.02)


def test_an_angle_comes_back_after_a_turn_and_a_known_motion_ends_a_run():
    # of two motions of one state an angle jumps from the end of its turn to its beginning
    turning = State("a", "rad", "angle", start=0.1)
    other = State("b", "1", "what dies out", start=1.0)
    declared = Map(
        name="turning",
        title="Turning",
        source="a rotation by a quarter",
        states=[turning, other],
        rule={turning: turning + sympy.pi / 2, other: other / 2},
        modulus={turning: 2 * sympy.pi},
        box={other: (-1.0, 1.0)},
    )
    iteration = Iteration.of(declared)
    jobs = Jobs(np.array([[1e-14, 1.0], [6.2, 0.5]]), transient=400, rows=8, longest=8, settled=1e-10)
    rows = iteration.run(jobs, STOP)
    assert rows.periods.tolist() == [4, 4] and (rows.outcomes == families.SETTLED).all()
    assert_same(rows, stepwise.run(iteration, jobs, STOP), 1e-12, without=("steps",))

    bounce = system("high_bounce", e=0.5, Gamma=1.2)
    seen = bounce.run(Jobs(starts(bounce, 60), transient=2000, rows=16, longest=8, settled=1e-10), STOP)
    motions = [m for m in claimed(bounce, seen, longest=8).motions if m is not None]
    jobs = Jobs(starts(bounce, 60), transient=2000, targets=targets_of(bounce, motions[:1]))
    compiled, interpreted = bounce.run(jobs, STOP), stepwise.run(bounce, jobs, STOP)
    assert (compiled.outcomes == families.ABSORBED).sum() > 5
    assert (compiled.outcomes == interpreted.outcomes).all() and (compiled.orbits == interpreted.orbits).all()


def test_what_goes_to_infinity_and_what_has_no_value_is_told_apart():
    x, c = State("x", "1", "state", start=1.0), Parameter("c", 1.0, "1", "shift")
    root = Map(name="root", title="Root", source="none", states=[x], rule={x: (x - c) ** 0.5}, box={x: (0.0, 9.0)})
    rows = Iteration.of(root).run(Jobs(np.array([[1.5], [9.0]]), rows=4), STOP)
    assert rows.outcomes.tolist() == [families.BROKEN] * 2 and rows.messages[0] == "the rule has no value there"
    assert rows.filled.tolist() == [1, 3]
    square = replace(root, name="square", rule={x: c * x**2})
    rows = Iteration.of(square).run(Jobs(np.array([[0.5], [2.0]]), transient=9, rows=2), STOP)
    assert rows.outcomes.tolist() == [families.FINISHED, families.ESCAPED]


def test_values_that_differ_from_run_to_run_a_way_back_and_a_quantity_called_period():
    iteration = system("logistic")
    growth = np.array([2.5, 3.2, 3.5])
    rows = iteration.run(Jobs(np.full((3, 1), 0.3), {"r": growth}, transient=3000, rows=8, longest=8), STOP)
    assert rows.periods.tolist() == [1, 2, 4]
    assert rows.points[0, 0, 0] == pytest.approx(1 - 1 / 2.5, rel=1e-14)
    henon = system("henon")
    forward = henon.run(Jobs(np.array([[0.1, 0.2]]), rows=5), STOP).points[0]
    back = replace(henon, backward=True).run(Jobs(forward[-1:], rows=5), STOP).points[0]
    np.testing.assert_allclose(back[-1], [0.1, 0.2], atol=1e-9)
    period = State("period", "1", "a state of that name", start=0.5)
    named = Map(
        name="named", title="N", source="none", states=[period], rule={period: period / 2}, box={period: (0, 1)}
    )
    assert Iteration.of(named).run(Jobs(np.ones((1, 1)), rows=3), STOP).points[0, :, 0].tolist() == [0.5, 0.25, 0.125]


def test_a_run_that_is_stopped_says_so():
    rows = system("logistic").run(Jobs(np.full((1, 1), 0.3), transient=10**9), np.ones(1, np.int32))
    assert rows.outcomes.tolist() == [families.STOPPED]
