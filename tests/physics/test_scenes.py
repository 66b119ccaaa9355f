"""Every scene that comes along: it computes what it says, and meets what is known."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import compare, compute
from fmu_models.scene.read import files, read_scene
from fmu_models.scene.reduce import built_scene

# scenes of which nothing is known beforehand
UNKNOWN = {"disc_rig_micro_slip"}


@pytest.mark.nightly_for(
    "hinge_clearance_diagram",
    "hinge_clearance_basins",
    "hinge_clearance_figure_4",
    "woodpecker_figure_16",
    "woodpecker_figure_17_points",
    "woodpecker_figure_17",
    "hinge_clearance_exponents",
    "hinge_clearance_figure_16",
    "hinge_clearance_figure_18",
    "hinge_clearance_figure_17",
    "discontinuous_support_figure_10",
    "forced_stick_slip_curves",
    "discontinuous_support_grazing",
    "discontinuous_support_figure_8",
    "discontinuous_support_figure_9",
    "discontinuous_support_figure_6",
    "discontinuous_support_exponents",
    "forced_stick_slip_figure_8",
    "hinge_clearance_figure_10",
    "disc_rig_sticks",
)
@pytest.mark.parametrize("path", files(), ids=lambda path: path.stem)
def test_scene(path):
    scene = read_scene(path)
    rows = compute(scene, Fmu.open(built_scene(scene)))
    panels = sum(map(len, scene.compute.panels.values()))
    assert len(rows) == max(1, len(scene.compute.values)) * max(1, panels)
    comparisons = compare(scene, rows)
    assert bool(comparisons) != (path.stem in UNKNOWN)
    for one in comparisons:
        assert one.passed, one


def test_every_figure_of_the_disc_paper_has_its_scene():
    names = {path.stem for path in files()}
    assert names >= {f"disc_rig_figure_{number}" for number in range(8, 14)}


def test_stick_comes_and_goes_as_the_figures_show():
    sticking = {}
    for number in (9, 10, 11, 12, 13):
        scene = read_scene(f"disc_rig_figure_{number}")
        rows = compute(scene, Fmu.open(built_scene(scene)))
        sticking[number] = [{c for c in ("disc0", "disc1") if row.values.get(f"{c}_stick")} for row in rows]
    zero, one, both = {"disc0"}, {"disc1"}, {"disc0", "disc1"}
    assert sticking[9] == [zero, zero, both, one, one]
    assert ["disc0" in contacts for contacts in sticking[10]] == [True, True, True, True, False, False]
    assert [bool(contacts) for contacts in sticking[11]] == [True, True, False, False]
    assert sticking[12] == [zero, both, both]
    assert sticking[13] == [zero, both, both, both, one]


@pytest.mark.parametrize(
    ("name", "velocity"),
    [("bouncing_ball_period_1", "v"), ("impact_damper_two_impacts", "v"), ("bouncing_ball_chatter", "v")],
)
def test_a_portrait_has_both_sides_of_each_event(name, velocity):
    scene = read_scene(name)
    (row,) = compute(scene, Fmu.open(built_scene(scene)))
    trajectory = row.trajectory
    assert trajectory is not None
    inside = [event.time for event in trajectory.events if trajectory.time[0] < event.time < trajectory.time[-1]]
    assert inside and all(time in trajectory.time for time in inside)
    # what jumps does so within the last digits of the time of an event
    jumps = np.abs(np.diff(trajectory[velocity]))
    steps = np.diff(trajectory.time)
    at_events = np.isin(trajectory.time[1:], inside) | np.isin(trajectory.time[:-1], inside)
    assert jumps[at_events].max() > 100.0 * np.median(jumps)
    rates = jumps[~at_events] / steps[~at_events]
    assert rates.max() < 50.0 * (np.median(rates) + 1e-9)
