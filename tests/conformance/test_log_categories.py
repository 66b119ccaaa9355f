"""Messages by category: errors, warnings and the events of contacts, each only where it is asked for."""

from __future__ import annotations

import re

import pytest
from faces import Face, face

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

EVENT = re.compile(r"t = (\S+): (\w+)_state (becomes|stays) (-?\d+)(?:, impact with work (\S+) J)?")
SPAN, STEP = 2.0, 0.05


def run(one: Face) -> list[tuple]:
    """What is heard of a run: contacts, what they become, and when."""
    one.initialize()
    for k in range(round(SPAN / STEP)):
        one.step(k * STEP, STEP)
    said = [EVENT.fullmatch(message) for message in one.messages]
    return [(m[2], int(m[4]), float(m[1])) for m in said if m]


def test_events_are_those_of_our_own_run(fmu: Fmu) -> None:
    expected = [(e.contact, e.after, e.time) for e in simulate(fmu, SPAN).events]
    with face(fmu) as one:
        assert one.log("logEvents") == 0
        found = run(one)
        assert set(one.categories) <= {"logEvents"}
    assert [event[:2] for event in found] == [event[:2] for event in expected]
    # ten digits are written; a chaotic motion makes more of the rounding of the steps' times
    assert [event[2] for event in found] == pytest.approx([event[2] for event in expected], rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("categories", [("logStatusError",), ("logStatusWarning", "logStatusError")])
def test_events_are_not_told_unasked(fmu: Fmu, categories: tuple[str, ...]) -> None:
    with face(fmu) as one:
        assert one.log(*categories) == 0
        assert run(one) == [] and one.messages == []
        assert one.log(on=False) == 0
        one.step(SPAN, STEP)
        assert one.messages == []


def test_an_event_that_the_importer_locates_is_told(fmu: Fmu) -> None:
    near = 1e-4
    happened = [e for e in simulate(fmu, SPAN).events if e.time > near]
    if not happened:
        pytest.skip("no contact changes its state")
    first = happened[0]
    before = simulate(fmu, first.time, output_times=[first.time - near])
    with face(fmu, co_simulation=False) as one:
        one.set({name: float(before[name][0]) for name in [*fmu.states, *fmu.memories]})
        one.initialize(first.time - near)
        one.update()
        one.api.enterContinuousTimeMode()
        if one.contact_states() != [int(before[f"{name}_state"][0]) for name in fmu.contacts]:
            pytest.skip("a start at rest on a wall forgets that the contact was closed")
        assert one.log("logEvents") == 0
        one.set_states(one.get(fmu.states) + 2 * near * one.derivatives())
        one.api.setTime(first.time + near)
        one.api.enterEventMode()
        one.update()
        event = EVENT.fullmatch(one.messages[0])
        assert event and one.categories[0] == "logEvents"
    assert (event[2], int(event[4])) == (first.contact, first.after)
    assert float(event[1]) == pytest.approx(first.time, abs=2 * near)


def test_warnings_and_errors_are_told_apart(fmu: Fmu) -> None:
    with face(fmu) as one:
        assert one.log("logStatusWarning") == 0
        one.initialize(tolerance=1e-30)
        assert one.categories == ["logStatusWarning"]
        assert "tolerance 1e-30 is finer" in one.messages[0]


def test_every_declared_category_is_known(fmu: Fmu) -> None:
    names = [category.name for category in fmu.description.logCategories]
    assert len(names) == 3
    with face(fmu) as one:
        for name in names:
            assert one.log(name) == 0, name
