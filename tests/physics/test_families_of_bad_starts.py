"""Families of motions where some of the runs cannot be made: those say why, the others go on."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models import maps
from fmu_models.analyses.basins import basins
from fmu_models.analyses.chart import chart
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.analyses.labels import FAILED, INFINITE
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from fmu_models.sections.crossing import Crossing
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe


@pytest.fixture(scope="module")
def hinge() -> Strobe:
    return Strobe(load("hinge_clearance"), forcing="f", parameters={"f": 0.429})


def test_a_start_inside_a_stop_says_what_it_needs(hinge):
    x = [-0.02, 0.0, 0.0101]
    found = basins(hinge, x=x, v=[0.0], most=300)
    assert found.labels.ravel().tolist() == [FAILED, 0, FAILED]
    assert "left_memory" in found.failures[0, 0] and "right_memory" in found.failures[2, 0]
    # with the speed of entry it is a start like others; a stop that is free takes no notice of it
    entered = basins(hinge, start={"right_memory": 0.3, "left_memory": 0.3}, x=x, v=[0.0], most=300)
    assert not entered.failures and (entered.labels >= 0).all()


def test_a_sweep_goes_on_where_its_parameter_takes_the_motion_out_of_its_contact(hinge):
    # at this phase the orbit is in the stop; a wider gap leaves it outside, a narrower one brings it in
    shifted = hinge.at(tau=1.2)
    deltas = [0.0073, 0.0336, 0.06]
    found = orbit_diagram(shifted, "delta", deltas, direction="both", start={"x": 0.0, "v": 0.0}, transient=400)
    assert not found.failures and found.periods[0].tolist() == found.periods[1].tolist()
    alone = shifted.at(delta=0.06).step(found.points[0, 2, :1], derivative=False).points[0]
    assert alone == pytest.approx(found.points[0, 2, 0], abs=1e-10)


def test_motions_to_infinity_are_a_label():
    henon = Iteration.of(maps.load("henon"))
    found = basins(henon, x=[-3.0, 0.0], y=[0.0])
    assert found.labels.ravel()[0] == INFINITE and found.labels.ravel()[1] >= 0 and not found.failures
    plane = chart(henon, a=[1.0, 1.8], b=[0.3], transient=100)
    assert dict(plane.failures) == {(1, 0): "to infinity"}


def test_a_section_that_is_not_met_says_how_long_it_was_waited_for():
    section = Crossing(load("discontinuous_support"), "x", 50.0, forcing="omega")
    found = chart(section, omega=[0.5, 1.0], f0=[0.5], transient=1)
    assert [why.rpartition("periods, ")[2] for why in found.failures.values()] == ["12566.4 s", "6283.19 s"]


def test_values_outside_their_range_are_refused_before_any_run(hinge):
    with pytest.raises(StickslipError, match="at least 0"):
        basins(hinge, start={"right_memory": -1.0}, x=[0.0], v=[0.0])
    with pytest.raises(StickslipError, match="finite"):
        basins(hinge, x=[0.0, np.inf], v=[0.0])
    with pytest.raises(StickslipError, match="at most"):
        orbit_diagram(hinge, "ce", [0.5, 1.5])
