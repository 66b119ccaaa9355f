"""What becomes of volumes by the divergence alone: closed forms, and where events change them too."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from lazy_fmu import LazyFmu

from fmu_models import maps
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.fmu.load import load
from fmu_models.language.contact_kinds import TOUCHING
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.divergence import keeps_volumes, volume_change
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative

SUPPORT = LazyFmu("discontinuous_support")
VALUES = {"ks": 300.0, "cs": 0.6, "g": 1.6, "omega": 0.94}


def test_damping_shrinks_volumes_and_a_stop_does_so_while_it_is_touched():
    start, end = {"x": 0.3, "v": 0.5}, 20.0
    run = simulate(SUPPORT, end, parameters=VALUES, start=start, output_times=[0.0, end])
    states = [(0.0, run.events[0].before), *((event.time, event.after) for event in run.events), (end, 0)]
    touched = sum(until - since for (since, state), (until, _) in pairwise(states) if state == TOUCHING)
    assert 0.1 < touched < end - 1.0
    found = volume_change(SUPPORT, end, start=start, parameters=VALUES, inputs={})
    assert found == pytest.approx(-(0.05 * end + 0.6 * touched), abs=1e-12)
    whole = flow_derivative(SUPPORT, end, parameters=VALUES, start=start).by_start
    assert found == pytest.approx(math.log(abs(np.linalg.det(whole))), abs=1e-10)


def test_the_identity_of_the_sum_is_told_where_it_holds():
    strobe = Strobe(SUPPORT, forcing="omega", parameters=VALUES)
    found = lyapunov(strobe, {"x": 0.0, "v": 0.0}, periods=400, transient=50)
    assert found.identity is not None and found.identity < 1e-10 and "identity" in repr(found)
    henon = lyapunov(Iteration.of(maps.load("henon")), periods=400)
    assert henon.identity is not None and henon.identity < 1e-12
    # the entry of the hinge's stops is remembered, dry friction takes volumes away, impacts shrink them
    assert not any(keeps_volumes(load(name)) for name in ("hinge_clearance", "disc_rig", "bouncing_ball"))
    ball = Strobe(load("bouncing_ball"), forcing="omega", parameters={"A": 2.0})
    assert lyapunov(ball, {"x": 3.0}, periods=40, transient=5).identity is None


def test_an_identity_that_is_missed_is_told(monkeypatch):
    monkeypatch.setattr(Strobe, "log_volumes", lambda self, points: np.full(len(points), -0.5))
    found = lyapunov(Strobe(SUPPORT, forcing="omega", parameters=VALUES), {"x": 0.0}, periods=400, transient=50)
    assert found.identity is not None and found.identity > 1e-3
