"""Many runs in one call: each is the run by itself, whoever makes it; they end as they should, and say why."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
from typing import Any

import numpy as np
import pytest
from crossed import crossings
from lazy_fmu import LazyFmu

from fmu_models import maps
from fmu_models.analyses.attractors import claimed, targets_of
from fmu_models.analyses.basins import basins
from fmu_models.analyses.chart import chart
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.analyses.rotation import rotation_number
from fmu_models.analyses.section import poincare_section
from fmu_models.analyses.spectrum import spectrum
from fmu_models.base.errors import StickslipError
from fmu_models.families import jobs as families
from fmu_models.families import stepwise
from fmu_models.families.jobs import Jobs
from fmu_models.sections.crossing import Crossing, Impacts
from fmu_models.sections.iteration import Iteration, iterate
from fmu_models.sections.periodic import find_cycles, motion_at
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

SUPPORT, HINGE, BALL = map(LazyFmu, ("discontinuous_support", "hinge_clearance", "bouncing_ball"))
T = 2.0 * math.pi
GO = np.zeros(1, np.int32)
CHAOS = {"ks": 300.0, "cs": 0.6, "g": 1.6, "omega": 0.94}


def support(**values: float) -> Strobe:
    return Strobe(SUPPORT, forcing="omega", parameters=values)


def test_a_strobe_is_the_run_and_its_derivative_that_of_the_flow():
    start = {"x": 0.0, "v": 0.0}
    rows = support().run(Jobs(support().start(start)[None], rows=20, derivatives=True), GO)
    run = simulate(SUPPORT, 20 * T, start=start, output_times=T * np.arange(1, 21))
    assert rows.points[0, :, 0] == pytest.approx(run["x"], abs=1e-12)
    assert rows.began.sum() == sum(event.after == 3 for event in run.events)
    assert rows.held.sum() == pytest.approx(_touching(run.events, 20 * T), abs=1e-10)
    monodromy = np.eye(2)
    for step in rows.derivatives[0]:
        monodromy = step @ monodromy
    assert monodromy == pytest.approx(flow_derivative(SUPPORT, 20 * T, start=start).by_start, abs=1e-12)


def _touching(events, end: float) -> float:
    touched, since = 0.0, math.nan
    for event in events:
        if event.after == 3:
            since = event.time
        elif event.before == 3:
            touched, since = touched + event.time - since, math.nan
    return touched + (0.0 if math.isnan(since) else end - since)


def test_a_level_is_that_of_the_crossings_and_its_derivative_that_of_differences():
    section = Crossing(SUPPORT, "x", 1.0, -1, forcing="omega")
    start = {"x": 0.0, "v": 0.5}
    known = crossings(SUPPORT, "x", level=1.0, direction=-1, stop_time=80.0, start=start)
    rows = section.run(Jobs(section.start(start)[None], rows=8), GO)
    assert rows.points[0, :, 1] == pytest.approx(known.states["v"][:8], abs=1e-12)
    assert np.cumsum(rows.times[0]) == pytest.approx(known.times[:8], abs=1e-11)
    point = rows.points[0, 3]
    exact, h = section.step(point[None]).derivatives[0], 1e-6
    for k in (1, 2):
        beside = section.step(np.array([point + h * np.eye(3)[k], point - h * np.eye(3)[k]])).points
        assert exact[:, k] == pytest.approx(section.difference(beside[0] - beside[1]) / (2 * h), abs=1e-6)


def test_what_a_stop_remembers_belongs_to_the_point_where_the_strobe_falls_into_it():
    # the motion is in the right stop from the phase 0.547 to 3.561 of the force
    system = Strobe(HINGE, forcing="f", parameters={"f": 0.429, "tau": 2.0})
    rows = system.run(Jobs(system.start({"x": 0.0, "v": 0.05})[None], transient=300, rows=1), GO)
    point = rows.points[0, 0]
    assert point[0] > 0.01 and point[2] > 0.0  # in the right stop, with the speed of its entry
    exact, scales = system.step(point[None]).derivatives[0], (1e-8, 1e-7, 1e-7)
    for k, h in enumerate(scales):
        beside = system.step(np.array([point + h * np.eye(4)[k], point - h * np.eye(4)[k]])).points
        assert exact[:3, k] == pytest.approx((beside[0] - beside[1])[:3] / (2 * h), rel=1e-5, abs=1e-6)
    (cycle,) = find_cycles(system, point[None, None])
    # the mirror twin of the motion of the reference, which enters its left stop at this speed
    assert cycle[0, 2] == pytest.approx(0.1665642911684, abs=1e-11)
    # multipliers do not depend on where the motion is looked at
    found = motion_at(system, cycle).stability.eigenvalues
    assert found == pytest.approx([-0.893781973816, -0.208337557390], abs=1e-10)


@pytest.mark.parametrize("workers", [1, 2, 7])
def test_rows_do_not_depend_on_who_makes_them(workers, monkeypatch):
    monkeypatch.setattr(families, "CHUNK", 300)
    starts = np.random.default_rng(0).uniform(-2, 2, (37, 2))
    system = support(**CHAOS)
    alone = [system.run(Jobs(one[None], transient=30, rows=10), GO).points[0] for one in starts]
    made = system.make(Jobs(starts, transient=30, rows=10), workers=workers)
    assert np.array_equal(made.points, np.array(alone))
    jobs = Jobs(np.tile(starts[0], (12, 1)), {"omega": np.linspace(0.8, 1.0, 12)}, rows=5, chain=4)
    assert np.array_equal(system.make(jobs, workers=workers).points, system.run(jobs, GO).points)


@pytest.mark.parametrize(("gamma", "e"), [(1.2, 0.2), (0.5, 0.9), (2.0, 0.5), (1.75, 0.5)])
def test_bounces_that_die_out_over_several_periods_know_the_time_they_began(gamma, e):
    values = {"omega": 1.0, "g": 1.0, "A": gamma, "e": e}
    system = Strobe(BALL, forcing="omega", parameters=values)
    start = {"x": 2.0, "v": 0.0}
    rows = system.run(Jobs(system.start(start)[None], rows=6), GO)
    run = simulate(BALL, 6 * T, start=start, parameters=values, output_times=T * np.arange(1, 7))
    assert rows.points[0, :, 0] == pytest.approx(run["x"], abs=1e-9)
    assert rows.points[0, :, 1] == pytest.approx(run["v"], abs=1e-9)


@pytest.mark.parametrize("stepper", ["auto", "taylor"])
def test_a_body_at_rest_on_a_moving_wall_is_started_again_from_its_strobe(stepper):
    # omega T is not 2 pi to the last digit: the table is higher there than where the time goes back to
    values = {"omega": 3.0, "g": 9.81, "A": 1.05 * 9.81 / 9.0, "e": 0.2}
    strobe = Strobe(BALL, forcing="omega", parameters=values, stepper=stepper)
    at = strobe.run(Jobs(np.array([[10.0, 0.0]]), rows=12), GO).points[0, -1]
    again = strobe.step(at[None])
    assert again.why == {}
    assert again.points[0] == pytest.approx(at, abs=1e-13)


def test_a_chain_goes_on_where_the_run_before_it_ended():
    values = np.array([0.9, 0.95, 1.0])
    made = support(**CHAOS).run(Jobs(np.zeros((3, 2)), {"omega": values}, rows=4, chain=3), GO)
    point = np.zeros(2)
    for i, omega in enumerate(values):
        one = support(**CHAOS).at(omega=float(omega)).run(Jobs(point[None], rows=4), GO)
        assert np.array_equal(one.points[0], made.points[i])
        point = one.points[0, -1]


def beside(values, start, chains):
    """Sweeps of these values, every second downward, one after the other and in turn."""
    swept = np.array([values if k % 2 == 0 else values[::-1] for k in range(chains)])
    starts = np.tile(start, (swept.size, 1)) * (1.0 + 0.1 * np.arange(swept.size)[:, None] % chains)
    how: dict[str, Any] = {"transient": 200, "rows": 48, "longest": 24, "chain": len(values)}
    order = np.arange(swept.size).reshape(swept.shape).T.ravel()
    return Jobs(starts, {"omega": swept.ravel()}, **how), order, how


@pytest.mark.parametrize(
    "make",
    [
        lambda: support(**CHAOS),
        lambda: support(**CHAOS).stepped_by("taylor"),
        lambda: Crossing(SUPPORT, "v", 0.0, -1, forcing="omega", parameters=CHAOS),
    ],
    ids=["lanes", "series", "level"],
)
def test_chains_beside_one_another_are_those_made_one_by_one(make, monkeypatch):
    system = make()
    alone, order, how = beside(np.linspace(0.85, 1.0, 9), system.start({"x": 0.5, "v": 0.1}), 5)
    one_by_one = system.run(alone, GO).only(order)
    jobs = Jobs(alone.starts[order], {"omega": alone.varied["omega"][order]}, beside=5, **how)
    twice = Jobs(np.tile(jobs.starts, (2, 1)), {"omega": np.tile(jobs.varied["omega"], 2)}, beside=5, **how)
    assert len({*one_by_one.periods.tolist()}) > 1
    for steps in (10**6, 400, 1):
        monkeypatch.setattr(families, "CHUNK", steps)
        made = system.make(twice, workers=2)
        for name, array in one_by_one.arrays().items():
            assert np.array_equal(made.arrays()[name][:45], array, equal_nan=True), name
            assert np.array_equal(made.arrays()[name][45:], array, equal_nan=True), name


def test_chains_of_a_map_beside_one_another_are_the_same_step_by_step():
    logistic = Iteration.of(maps.load("logistic"))
    r = np.repeat(np.linspace(3.4, 3.9, 11), 3)
    jobs = Jobs(np.tile([[0.2], [0.4], [0.7]], (11, 1)), {"r": r}, 100, 16, longest=8, chain=11, beside=3)
    made = logistic.run(jobs, GO)
    alone = logistic.run(Jobs(jobs.starts[1::3], {"r": r[1::3]}, 100, 16, longest=8, chain=11), GO)
    assert np.array_equal(made.points[1::3], alone.points, equal_nan=True)
    assert (made.periods == stepwise.run(logistic, jobs, GO).periods).all()


def test_a_chain_that_fails_begins_anew_and_leaves_the_others_alone(monkeypatch):
    system = support(**CHAOS)
    alone, order, how = beside(np.linspace(0.85, 1.0, 6), system.start({"x": 0.5, "v": 0.1}), 3)
    starts = alone.starts.copy()
    starts[6:12, 1] = 1e12  # beyond every bound, the first run of the second chain and so all that begin anew
    alone = dataclasses.replace(alone, starts=starts)
    one_by_one = system.run(alone, GO).only(order)
    assert (one_by_one.outcomes[1::3] == families.ESCAPED).all()
    assert (one_by_one.outcomes.reshape(6, 3)[:, [0, 2]] <= families.ABSORBED).all()
    jobs = Jobs(starts[order], {"omega": alone.varied["omega"][order]}, beside=3, **how)
    for steps in (10**6, 1):
        monkeypatch.setattr(families, "CHUNK", steps)
        assert np.array_equal(system.make(jobs).points, one_by_one.points, equal_nan=True)


SWEPT = [
    (lambda: Crossing(SUPPORT, "v", 0.0, -1, forcing="omega"), "omega", np.linspace(1.12, 0.9, 12)),
    (
        lambda: Impacts(BALL, "table", forcing="omega", parameters={"omega": 1.0, "g": 1.0, "e": 0.5}),
        "A",
        np.linspace(1.1, 1.5, 12),
    ),
]


@pytest.mark.parametrize(("make", "over", "values"), SWEPT, ids=["level", "impacts"])
def test_a_chain_keeps_the_phase_of_what_forces_it_whoever_makes_its_links(make, over, values, monkeypatch):
    """The phase is part of a point where a state crosses a level or a contact begins. A table whose amplitude has grown
    meanwhile carries the ball that has just left it."""
    section = make()
    start = section.start({"x": 0.5, "v": 0.0})
    jobs = Jobs(np.tile(start, (12, 1)), {over: values}, transient=3, rows=4, chain=12)
    whole = section.run(jobs, GO)
    assert not whole.messages
    monkeypatch.setattr(families, "CHUNK", 1)
    assert np.array_equal(section.make(jobs).points, whole.points)
    for i in range(1, 12):
        # the next link from the phase, and from the states but for the height of a table that moved
        alone = section.at(**{over: float(values[i])})
        begin = whole.ends[i - 1].copy()
        if over == "A":
            begin[0] = max(begin[0], values[i] * math.sin(T * begin[-1]))
        after = alone.run(Jobs(begin[None], transient=3, rows=4), GO)
        assert after.points[0] == pytest.approx(whole.points[i], abs=1e-9)


def test_a_motion_that_repeats_itself_is_recorded_once():
    made = support(ks=300.0, cs=0.6, g=1.6, omega=0.92).run(
        Jobs(np.array([[1.14, -0.27]]), transient=5000, rows=48, longest=24), GO
    )
    assert (made.outcomes[0], made.periods[0], made.filled[0]) == (families.SETTLED, 3, 3)
    assert made.steps[0] < 1000
    (motion,) = claimed(support(ks=300.0, cs=0.6, g=1.6, omega=0.92), made).motions
    assert motion is not None
    assert any(point == pytest.approx([1.140362014614650, -0.270093925370817], abs=1e-12) for point in motion.points)


def test_unstable_motions_are_no_attractors():
    # the saddle between the two motions of omega = 1.18 is found by Newton's method, and claimed by nobody
    system = support(omega=1.18)
    motions = [motion_at(system, c) for c in find_cycles(system, np.random.default_rng(1).uniform(-7, 7, (60, 1, 2)))]
    saddle = next(one for one in motions if not one.stability.stable)
    made = system.run(Jobs(saddle.points, rows=3, longest=1, settled=1e-6), GO)
    assert claimed(system, made, longest=1).motions == [None]
    found = basins(system, x=saddle.points[0, :1], v=saddle.points[0, 1:] + np.linspace(-1, 1, 9))
    assert len(found.attractors) == 2 and found.undecided == 1
    assert found.labels.tolist() == [[0, 0, 0, 0, -1, 1, 1, 1, 1]]


def test_targets_hold_what_comes_inside_them():
    system = support(omega=1.18)
    rows = system.make(Jobs(np.array([[-1.0, 0.0], [-0.5, 6.5]]), transient=2000, rows=2, longest=1))
    motions = [one for one in claimed(system, rows).motions if one is not None]
    targets = targets_of(system, motions)
    assert targets is not None
    chance = np.random.default_rng(2)
    for number, motion in enumerate(motions):
        form = targets.forms[number]
        rays = np.linalg.solve(np.linalg.cholesky(form).T, chance.normal(size=(2, 200)))
        inside = motion.points[0] + (rays / np.sqrt(np.einsum("ik,ij,jk->k", rays, form, rays))).T * 0.999
        ends = system.make(Jobs(inside, transient=400)).ends
        assert ends == pytest.approx(np.tile(motion.points[0], (200, 1)), abs=1e-6)
        # such a motion is followed no farther
        met = system.make(Jobs(inside, transient=400, targets=targets))
        assert met.orbits.tolist() == [targets.orbits[number]] * 200 and met.steps.max() == targets.passes[number]


def test_runs_end_as_they_should():
    # no spring holds it; without gravity the ball never comes back
    away = support(k=0.0, c=0.0, f0=0.0).at(omega=1.0)
    far = away.run(Jobs(np.array([[-1.0, -1e9]]), rows=5), GO)
    assert far.outcomes[0] == families.ESCAPED
    lost = Impacts(BALL, "table", forcing="omega", parameters={"g": 0.0})
    rows = lost.run(Jobs(lost.start({"x": 1.0, "v": 1.0})[None], rows=2), GO)
    assert rows.outcomes[0] in (families.LOST, families.ESCAPED)
    inside = Strobe(HINGE, forcing="f")
    rows = inside.run(Jobs(np.array([[0.02, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]]), rows=3), GO)
    assert rows.outcomes.tolist() == [families.BROKEN, families.FINISHED]
    assert "give that speed as right_memory" in rows.messages[0]


def test_an_error_in_one_cell_is_said_there_and_the_others_go_on():
    found = basins(Strobe(HINGE, forcing="f"), x=np.array([-0.002, 0.02]), v=np.array([0.0, 0.05]), most=300)
    assert (found.labels[1] == -3).all() and (found.labels[0] >= 0).all()
    assert "right_memory" in found.failures[1, 0]
    sweep = orbit_diagram(Strobe(HINGE, forcing="f"), "delta", [0.005, 0.01], start={"x": 0.008}, transient=20)
    assert list(sweep.failures) == [("up", 0.005)] and sweep.periods[0, 0] == 0


def test_an_interrupt_ends_all_threads_within_a_step():
    system, starts = support(**CHAOS), np.zeros((64, 2))

    def interrupted(fraction: float) -> None:
        raise KeyboardInterrupt

    before = threading.active_count()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        system.make(Jobs(starts, transient=10**7), workers=2, progress=interrupted)
    assert time.monotonic() - begin < 5.0 and threading.active_count() == before


def test_a_map_obeys_the_same_rules():
    system = Iteration.of(maps.load("logistic"), {"r": 3.5})
    made = system.make(Jobs(np.array([[0.3], [0.31]]), transient=1000, rows=8, longest=8))
    assert made.periods.tolist() == [4, 4] and made.filled.tolist() == [4, 4]
    plain = system.run(Jobs(np.array([[0.3]]), rows=6), GO).points[0, :, 0]
    assert np.array_equal(plain, iterate(system, [0.3], 6)[1:, 0])
    sweep = orbit_diagram(system, "r", [2.8, 3.2, 3.5, 3.55, 3.9], start=[0.3], transient=400, exponents=1024)
    assert sweep.periods[0].tolist() == [1, 2, 4, 8, 0]
    assert (np.sign(sweep.exponents[0]) == [-1, -1, -1, -1, 1]).all()
    away = Iteration.of(maps.load("logistic"), {"r": 5.0}).make(Jobs(np.array([[0.3]]), rows=100))
    assert away.outcomes[0] in (families.ESCAPED, families.BROKEN)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: Strobe(SUPPORT), "needs a period"),
        (lambda: Strobe(SUPPORT, forcing="omge"), "Did you mean 'omega'"),
        (lambda: Strobe(SUPPORT, forcing="omega", period=1.0), "leave out"),
        (lambda: Strobe(SUPPORT, forcing="omega", parameters={"omega": 0.0}), "no period"),
        (lambda: Strobe(SUPPORT, forcing="omega", parameters={"m": -1.0}), "must be at least"),
        (lambda: Strobe(SUPPORT, forcing="omega", autonomous=True), "not autonomous"),
        (lambda: Crossing(SUPPORT, "y"), "no state 'y'"),
        (lambda: Crossing(SUPPORT, "x", direction=2), "direction"),
        (lambda: Impacts(SUPPORT, "wall"), "no contact 'wall'"),
        (lambda: orbit_diagram(support(), "omega", [1.0, 0.9]), "ascending"),
        (lambda: orbit_diagram(support(), "omega", [0.9], direction="left"), "one of up, down, both"),
        (lambda: orbit_diagram(support(), "m", [-1.0, 1.0]), "must be at least"),
        (lambda: basins(support()), "Name the states"),
        (lambda: basins(support(), y=[0.0]), "no state 'y'"),
        (lambda: basins(support(), x=[0.0, math.nan]), "finite"),
        (lambda: chart(support(), omega=[1.0]), "over two parameters"),
        (lambda: chart(support(), what="colour", omega=[1.0], f0=[1.0]), "shows one of period"),
        (lambda: chart(support(), refine=3, omega=[1.0], f0=[1.0]), "power of two"),
        (lambda: rotation_number(support(), about={"x": 0.0}), "two states"),
        (lambda: poincare_section(Crossing(SUPPORT, "x", 100.0, forcing="omega")), "not met within 1000 periods, 6283"),
        (lambda: spectrum(simulate(SUPPORT, 1.0, output_times=[0.0, 0.1, 1.0])), "even samples"),
        (lambda: support().start([1.0]), "2 finite numbers"),
    ],
)
def test_bad_input_is_refused_with_what_to_do(made, said):
    with pytest.raises(StickslipError, match=said):
        made()
