"""What lanes do at the edge of what they are for: values that grow, decay, repeat or do not, and declarations that
qualify for some parameters alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmu_models.analyses.fmu_sections import Strobe
from fmu_models.analyses.jobs import ESCAPED, FINISHED, Jobs
from fmu_models.codegen.lane_tables import lane_obstacles
from fmu_models.codegen.package import build_fmu
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter
from fmu_models.lowering.lower import lower
from fmu_models.lowering.piecewise_linear import obstacles

GO = np.zeros(1, np.int32)


def both(system: Strobe, starts: Any, periods: int = 5, **varied: Any) -> tuple[Any, Any]:
    """The same motions by lanes and by series."""
    jobs = Jobs(np.asarray(starts, dtype=float), {n: np.asarray(v, dtype=float) for n, v in varied.items()}, rows=periods)
    return system.run(jobs, GO), system.stepped_by("taylor").run(jobs, GO)


def test_no_damping_and_stiffnesses_that_are_equal_are_ordinary():
    # a resonance, and two modes of one matrix: neither has eigenvectors or a particular solution of its own
    values = {"d": 0.0, "w1": 1.0, "w2": 1.0, "W": 1.0, "b1": 0.0, "b2": 0.0}
    system = Strobe(load("two_domain_oscillator"), forcing="W", parameters=values)
    lanes, series = both(system, [[0.3, 1.0], [0.0, 2.0]])
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.points == pytest.approx(series.points, abs=1e-11)
    # x'' = b twice over: nilpotent
    free = system.at(w1=0.0, w2=0.0, b1=0.5, b2=-0.5)
    lanes, series = both(free, [[0.3, 1.0], [0.1, 2.0]])
    assert lanes.in_lanes.sum() == lanes.steps.sum()
    assert lanes.points == pytest.approx(series.points, abs=1e-10)


def test_what_decays_comes_to_rest_and_not_to_the_least_of_numbers():
    values = {"f0": 0.0, "c": 1.0, "g": 1.0}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=values)
    made = system.run(Jobs(np.array([[0.5, 0.0]]), transient=299, rows=1), GO)
    assert made.points[0, 0].tolist() == [0.0, 0.0]


def test_many_sub_steps_in_a_period_are_left_to_the_series_and_others_are_not():
    values = {"f0": 0.0, "omega": 1e-4, "c": 0.5, "g": 1.0}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=values)
    # 1e5 steps of the grid in the first, a few in the second
    lanes, series = both(system, [[0.5, 0.0]] * 2, 1, omega=[1e-4, 1.0])
    assert lanes.in_lanes.tolist() == [0, 1]
    assert lanes.points == pytest.approx(series.points, abs=1e-12)
    assert "50 % of the steps made now by series" in system.how
