"""The last cycle of a run, where it is not the simple one of the disc rig (``test_disc_rig`` has those)."""

from __future__ import annotations

import math

import pytest

from fmu_models.analyses.cycles import last_cycle
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu


@pytest.mark.parametrize(("gamma", "periods"), [(1.4, 1), (1.6, 2)])
def test_ball_beyond_its_flip_closes_after_two_bounces(gamma, periods):
    """e = 0.5: the flip is at Gamma = 1.5268; 10 Hz, so that one period of the table takes 0.1 s."""
    fmu = Fmu.open(built("bouncing_ball"))
    cycle = last_cycle(fmu, 40.0, parameters={"A": gamma * 9.81 / (20 * math.pi) ** 2})
    assert cycle is not None
    assert cycle.period == pytest.approx(0.1 * periods, rel=1e-7)
    assert len(cycle.events) == periods


def test_chaos_closes_in_no_cycle():
    fmu = Fmu.open(built("bouncing_ball"))
    assert last_cycle(fmu, 20.0, parameters={"A": 6e-3, "e": 0.8}) is None
