"""What runs have come to is claimed with as few searches as tell it."""

import numpy as np
import pytest

from fmu_models import maps
from fmu_models.analyses import attractors, chart
from fmu_models.analyses.attractors import claimed
from fmu_models.families.jobs import Jobs
from fmu_models.sections.iteration import Iteration
from fmu_models.simulation.rows import RunRows


def test_a_guess_that_has_arrived_at_another_motion_is_not_searched_again(monkeypatch):
    searched: list[int] = []
    search = attractors.solved_cycles

    def counted(system, guesses, *varied, **how):
        searched.append(len(guesses))
        return search(system, guesses, *varied, **how)

    monkeypatch.setattr(attractors, "solved_cycles", counted)
    henon, values = Iteration.of(maps.load("henon")), {"a": np.linspace(0.2, 1.4, 600)}
    rows = henon.make(Jobs(np.tile(henon.start(None), (600, 1)), values, 60, 48, longest=24))
    found = {}
    for unsure in (np.inf, attractors.UNSURE):  # every one is searched again, and only those that need it
        monkeypatch.setattr(attractors, "UNSURE", unsure)
        searched.clear()
        found[unsure] = claimed(henon, rows, values).motions, sum(searched)
    (all_, many), (some, few) = found.values()
    assert few < 0.9 * many
    assert [motion is None for motion in some] == [motion is None for motion in all_]
    assert sum(motion is not None for motion in some) > 300
    for one, other in zip(some, all_, strict=True):
        assert one is None or (other is not None and np.array_equal(one.points, other.points))


@pytest.mark.parametrize("period", [1, 2, 3, 5])
def test_runs_look_alike_after_the_least_number_of_points_that_the_last_ones_repeat(period):
    henon = Iteration.of(maps.load("henon"))
    random = np.random.default_rng(period)
    points = np.tile(random.normal(size=(4, period, 2)), (1, 48, 1))[:, :48]
    points[1, -period - 1] += 1.0  # the last ones repeat those before but for one
    points[2] = random.normal(size=(48, 2))
    points[3, :-1] += 0.9 * attractors.ALIKE * (np.arange(47) % 2)[:, None]
    expected = [
        next((n for n in range(1, 25) if np.abs(p[-n:] - p[-2 * n : 48 - n]).max() <= attractors.ALIKE), 0)
        for p in points
    ]
    assert attractors._alike(henon, points, 24).tolist() == expected
    assert expected[0] == period
    assert expected[2] == 0


def test_a_cell_without_a_motion_has_the_period_after_which_all_its_points_repeat():
    henon, random = Iteration.of(maps.load("henon")), np.random.default_rng(0)
    rows = RunRows.empty(5, 12, 2, 1)
    rows.filled[:] = 12, 12, 12, 1, 0
    rows.points[:] = np.tile(random.normal(size=(3, 2)), (4, 1))
    rows.points[1, 0] += 1.0  # repeats itself but for its first point
    rows.points[2] = random.normal(size=(12, 2))
    rows.began[:] = np.arange(12)[:, None]
    found = [chart._alike(henon, rows, i, 8) for i in range(5)]
    assert found == [(3, [9 + 10 + 11]), (0, []), (0, []), (0, []), (0, [])]
    assert chart._alike(henon, rows, 0, 2) == (0, [])
