"""Where branches end that go no further: at bounds of a parameter, where impacts no longer come to rest."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mechanisms import opened

from fmu_models import Crossing, KelvinVoigt, StickslipError, Stop, Strobe, branch, load
from fmu_models.language.contacts import Requirement
from fmu_models.oscillators.discontinuous_support import MODEL, c, cs, g, ks, support, x


def test_a_parameter_out_of_its_bounds_ends_the_branch():
    """The damping must be larger than it is at the end of the range, for a reason that the model gives."""
    bounded = replace(MODEL, name="bounded", requirements=[Requirement(c - 0.02, "c, the damping, must exceed 0.02")])
    system = Strobe(opened(bounded), forcing="omega", parameters={"omega": 0.8})
    found = branch(system, "c", (0.01, 0.3), start={"x": 0.0, "v": 0.0})
    (kind, why), (other, _) = found.ends
    assert kind == "bounds" and "c, the damping, must exceed 0.02" in why and other == "range"
    assert found.values.min() == pytest.approx(0.02, abs=1e-4) and found.values.min() >= 0.02
    with pytest.raises(StickslipError, match="must be at least 0"):
        branch(system, "c", (-0.1, 0.3))


@pytest.mark.nightly
def test_a_curved_branch_ends_at_its_range_where_a_step_along_the_tangent_would_not_leave_it():
    left = Stop(name="left", gap=g + x, law=KelvinVoigt(ks, cs), release="force", description="second support")
    between = replace(MODEL, name="between_supports", contacts=[support, left])
    values = {"c": 0.1, "g": 1.0, "ks": 30.0, "cs": 0.5, "f0": 1.0, "omega": 0.8}
    system = Strobe(opened(between), forcing="omega", parameters=values)
    found = branch(system, "omega", (0.6, 3.5), start={"x": 0.0, "v": 0.0}, settle=True)
    assert found.ends[1][0] == "range" and found.values.max() == pytest.approx(3.5, abs=1e-12)


@pytest.mark.nightly
def test_infinitely_many_impacts_on_the_branch():
    """A ball that chatters to rest in each period: until it is thrown as it comes to rest, at 1.59734987, where motions
    of ever more impacts come together that do not."""
    parameters = {"g": 1.0, "omega": 1.0, "e": 0.5, "A": 1.02}
    for settle in (False, True):  # a settled ball rests on its table as the period ends
        system = Strobe(load("bouncing_ball"), forcing="omega", parameters=parameters)
        found = branch(system, "A", (1.01, 1.7), settle=settle)
        assert [kind for kind, _ in found.ends] == ["range", "chatter"] and found.stable.all()
        assert found.values.max() == pytest.approx(1.59734987, abs=2e-5)
        assert not found.special


def test_another_section_than_a_strobe():
    section = Crossing(load("block_on_belt"), "v", 0.1)
    with pytest.raises(StickslipError, match=r"followed at a strobe: .*autonomous=True, period="):
        branch(section, "v_belt", (0.1, 0.2))
