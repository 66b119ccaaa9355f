"""The last cycle of a run, where it is not the simple one of the disc rig (``test_disc_rig`` has those)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from crossed import crossings

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.cycles import last_cycle
from fmu_models.simulation.run import simulate


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


@pytest.mark.parametrize("ks", [1e3, 1e6])
def test_extremes_are_those_at_zeros_of_the_rate(ks):
    """The section is located on the steps themselves; in a contact of some ms at ks = 1e6 the mass turns round."""
    fmu = Fmu.open(built("discontinuous_support"))
    parameters = {"ks": ks, "g": 1.0, "f0": 0.6, "cs": 20.0, "omega": 0.9, "c": 0.3}
    cycle = last_cycle(fmu, 400.0, parameters=parameters)
    assert cycle is not None
    turning = crossings(fmu, "v", direction=0, stop_time=400.0, parameters=parameters)
    positions = turning.states["x"][(turning.times >= cycle.start) & (turning.times < cycle.start + cycle.period)]
    assert cycle.maximum["x"] == pytest.approx(positions.max(), rel=1e-14)
    assert cycle.minimum["x"] == pytest.approx(positions.min(), rel=1e-14)
    # the speeds: no sample of a finer grid lies beyond, and one comes near
    times = np.concatenate([np.linspace(cycle.start, cycle.start + cycle.period, 200001), turning.times])
    for event in cycle.events:
        times = np.concatenate([times, event.time + np.linspace(0.0, 20.0 / ks, 2001)])
    end = cycle.start + cycle.period
    times = np.unique(times[(times >= cycle.start) & (times <= end)])
    fine = simulate(fmu, end, parameters=parameters, output_times=times)["v"]
    assert cycle.maximum["v"] >= fine.max() and cycle.maximum["v"] == pytest.approx(fine.max(), rel=1e-9)
    assert cycle.minimum["v"] <= fine.min() and cycle.minimum["v"] == pytest.approx(fine.min(), rel=1e-9)


def test_the_speed_just_before_an_impact_counts():
    """One bounce per period: it arrives with the largest speed downwards, and leaves with the largest one upwards."""
    fmu = Fmu.open(built("bouncing_ball"))
    cycle = last_cycle(fmu, 40.0, parameters={"A": 1.4 * 9.81 / (20 * math.pi) ** 2})
    assert cycle is not None
    after = simulate(
        fmu, 40.0, parameters={"A": 1.4 * 9.81 / (20 * math.pi) ** 2}, output_times=[cycle.start, cycle.start + 0.1]
    )["v"]
    assert cycle.maximum["v"] == pytest.approx(after[0], rel=1e-13)
    assert cycle.minimum["v"] == pytest.approx(after[0] - 9.81 * cycle.period, rel=1e-12)
