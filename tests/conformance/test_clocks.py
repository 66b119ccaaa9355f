"""The clocks of contacts (FMI 3): they tick at the events of our own run, once each, and are silent elsewhere."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from ctypes import c_bool, c_double, c_size_t, c_uint32
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from faces import Face, face
from fmpy.validation import validate_fmu
from quick_export import quick_export
from resetting import wheel

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built, export
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Event

# friction, rigid impacts, rigid impacts with friction, a compliant stop, a switch without clocks, one that resets
MODELS = ("block_on_belt", "bouncing_ball", "woodpecker", "discontinuous_support", "two_domain_oscillator", "wheel")
STOP = 3.0
ERROR = 3


@pytest.fixture(scope="module", params=MODELS)
def clocked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    if request.param == "wheel":
        return Fmu.open(quick_export(wheel(), tmp_path_factory.mktemp("wheel") / "wheel.fmu"))
    return Fmu.open(built(request.param))


def expected(fmu: Fmu, events: list[Event]) -> list[tuple[float, str]]:
    """What the events of a run mean for clocks, told apart from the engine."""
    ticks = []
    for e in events:
        declared = fmu.variables[f"{e.contact}_state"].declaredType
        kind = str(declared and declared.name)
        if "Friction" in kind and e.after == 0:
            ticks.append((e.time, f"{e.contact}.stick"))
        if "Friction" in kind and e.after in (-1, 1):
            ticks.append((e.time, f"{e.contact}.slip"))
        if (kind == "ImpactState" and e.is_impact) or (kind == "StopState" and (e.before, e.after) == (2, 3)):
            ticks.append((e.time, f"{e.contact}.impact"))
        if e.contact == "spoke":
            ticks.append((e.time, "spoke.reset"))
    return sorted(ticks)


def active(one: Face, names: list[str]) -> list[str]:
    values = one.api.getClock(one.references(names)) if names else []
    return [name for name, value in zip(names, values, strict=True) if value]


def ticks(one: Face, step: float) -> Iterator[tuple[float, str]]:
    """Those of a Co-Simulation with event mode."""
    names, time = one.fmu.clocks, 0.0
    one.initialize()
    assert active(one, names) == []
    one.api.enterStepMode()
    while time < STOP:
        event, _, _, reached = one.step(time, min(step, STOP - time))
        time = reached
        if event:
            one.api.enterEventMode()
            found = active(one, names)
            assert active(one, names) == []
            one.update()
            one.api.enterStepMode()
            yield from ((time, name) for name in found)


def test_clocks_tick_at_the_events_of_our_own_run(clocked: Fmu) -> None:
    events = list(simulate(clocked, STOP).events)
    assert events
    wanted = expected(clocked, events)
    with face(clocked, eventModeUsed=True, earlyReturnAllowed=True) as one:
        found = sorted(ticks(one, 0.7))
    assert [name for _, name in found] == [name for _, name in wanted]
    assert [t for t, _ in found] == pytest.approx([t for t, _ in wanted], rel=1e-9, abs=1e-9)
    assert bool(wanted) == bool(clocked.clocks)
    # what a run tells of its events says the same
    assert (
        sorted((e.time, f"{e.contact}.{e.clock}") for e in events if f"{e.contact}.{e.clock}" in clocked.clocks)
        == wanted
    )


def test_clocks_of_an_importer_that_integrates_by_itself() -> None:
    fmu = Fmu.open(built("block_on_belt"))
    first = next(e for e in simulate(fmu, 20.0).events if e.after == 0)
    near = 1e-6
    before = simulate(fmu, first.time, output_times=[first.time - near])
    with face(fmu, co_simulation=False) as one:
        one.set({name: float(before[name][0]) for name in fmu.states})
        one.initialize(first.time - near)
        assert active(one, fmu.clocks) == []
        one.update()
        one.api.enterContinuousTimeMode()
        one.set_states(one.get(fmu.states) + 2 * near * one.derivatives())
        one.api.setTime(first.time + near)
        one.api.enterEventMode()
        assert active(one, fmu.clocks) == ["belt.stick"]
        # the rates jump, whoever asked for the clock before
        assert one.update()[3]
        assert one.contact_states() == [0] and active(one, fmu.clocks) == []


def test_all_bounces_that_an_importer_has_passed_tick() -> None:
    fmu = Fmu.open(built("impact_pair"))
    own = simulate(fmu, 0.2, start={"v": 100.0}).events
    assert [e.contact for e in own] == ["right", "left"]
    with face(fmu, co_simulation=False) as one:
        one.set({"v": 100.0})
        one.initialize()
        one.update()
        one.api.enterContinuousTimeMode()
        one.set_states(one.get(fmu.states) + 0.16 * one.derivatives())
        one.api.setTime(0.16)
        one.api.enterEventMode()
        one.log("logEvents")
        assert active(one, fmu.clocks) == ["right.impact", "left.impact"]
        # the work of both, told once
        told = [float(m.split()[-2]) for m in one.messages if "work" in m]
        assert told == pytest.approx([sum(e.work for e in own)], rel=0.05)


def test_a_clock_that_nobody_reads_is_silent_afterwards() -> None:
    fmu = Fmu.open(built("bouncing_ball"))
    bounce = next(e.time for e in simulate(fmu, STOP).events)
    with face(fmu, eventModeUsed=True, earlyReturnAllowed=True) as one:
        one.initialize()
        one.api.enterStepMode()
        assert one.step(0.0, STOP)[3] == pytest.approx(bounce, rel=1e-12)
        one.api.enterEventMode()
        state = one.get_state()
        one.update()
        one.api.enterStepMode()
        one.api.enterEventMode()
        assert active(one, fmu.clocks) == []
        one.set_state(state)
        assert active(one, fmu.clocks) == ["table.impact"]


def test_what_is_wrong_with_clocks_is_refused() -> None:
    fmu = Fmu.open(built("block_on_belt"))
    with face(fmu, eventModeUsed=True, earlyReturnAllowed=True) as one:
        stick, theirs = (c_uint32 * 1)(one.reference("belt.stick")), (c_uint32 * 1)(one.reference("time"))
        one.initialize()
        for name, values in (("SetClock", c_bool), ("GetShiftDecimal", c_double), ("SetIntervalDecimal", c_double)):
            assert one.call(name, stick, c_size_t(1), (values * 1)()) == ERROR
            assert "the clocks tick" in one.messages[-1]
        assert one.call("GetClock", theirs, c_size_t(1), (c_bool * 1)()) == ERROR
        assert "is not a clock" in one.messages[-1]
        assert one.call("GetClock", stick, c_size_t(1), None) == ERROR
        assert one.call("GetFloat64", stick, c_size_t(1), (c_double * 1)(), c_size_t(1)) == ERROR
        assert "is a clock, not a real variable" in one.messages[-1]
        one.api.enterStepMode()
        assert one.call("GetClock", stick, c_size_t(1), (c_bool * 1)()) == ERROR
        assert "not allowed in step mode" in one.messages[-1]


def test_clocks_can_be_outputs(tmp_path: Path) -> None:
    path = export("block_on_belt", tmp_path / "a.fmu", expose=["states", "clocks"])
    assert validate_fmu(str(path)) == []
    variables = Fmu.open(path).variables
    assert {variables[name].causality for name in ("belt.stick", "belt.slip", "belt_state")} == {"output"}
    with pytest.raises(StickslipError, match=r"FMI 2\.0 has no clocks to expose"):
        export("block_on_belt", tmp_path / "b.fmu", expose=["clocks"], fmi_version="2.0")
    with pytest.raises(StickslipError, match=r"no local 'clock' to expose\. Did you mean 'clocks'"):
        export("block_on_belt", tmp_path / "b.fmu", expose=["clock"])
    assert not (tmp_path / "b.fmu").exists()


class Looking:
    """A run by Co-Simulation that is looked at inside its steps; ``ask`` says of a time when to return, if at all."""

    def __init__(self, fmu: Fmu, *, early: bool = True, events: bool = False, ask=lambda time: None) -> None:
        self.fmu, self.ask = fmu, ask
        self.seen: list[tuple[float, list[float]]] = []
        self.refused: list[int] = []
        self.can_return: list[bool] = []
        self.flags: set[tuple[bool, bool, bool]] = set()
        self.one: Face | None = None
        required = [fmu.variables[name].valueReference for name in fmu.states]
        options: dict[str, Any] = {
            "eventModeUsed": events,
            "earlyReturnAllowed": early,
            "intermediateUpdate": self._look,
        }
        self.options: dict[str, Any] = options | {"requiredIntermediateVariables": required}

    def _look(self, _environment, time, set_requested, get_allowed, finished, can_return, returns, until) -> None:
        assert self.one is not None
        self.flags.add((set_requested, get_allowed, finished))
        self.can_return.append(can_return)
        self.seen.append((time, [*self.one.get(["time", *self.fmu.states])]))
        wanted = self.ask(time)
        if wanted is not None:
            returns[0], until[0] = True, wanted
        # what would spoil the step
        one, nothing = self.one, ctypes.c_void_p(None)
        self.refused += [one.call(name) for name in ("Reset", "Terminate", "EnterEventMode")]
        self.refused += [one.call("GetFMUState", ctypes.byref(nothing)), one.call("SetFloat64", *self._parameter())]

    def _parameter(self) -> tuple:
        assert self.one is not None
        reference = (c_uint32 * 1)(self.one.reference(self.fmu.parameters[0]))
        return reference, c_size_t(1), (c_double * 1)(1.0), c_size_t(1)


@pytest.mark.parametrize("early", [False, True])
def test_steps_can_be_looked_into(clocked: Fmu, early: bool) -> None:
    looking = Looking(clocked, early=early)
    with face(clocked, **looking.options) as one, face(clocked) as plain:
        looking.one = one
        for each in (one, plain):
            each.initialize()
            assert each.step(0.0, STOP) == (False, False, False, STOP)
        # the motion is the same to the last digit
        assert one.get(clocked.states).tolist() == plain.get(clocked.states).tolist()
    times = [time for time, _ in looking.seen]
    assert times == sorted(times) and times[0] > 0.0 and times[-1] <= STOP
    assert looking.flags == {(False, True, True)}
    assert set(looking.refused) == {ERROR}
    assert looking.can_return == [early and time < STOP for time in times]
    native = simulate(clocked, STOP, output_times=sorted(set(times)))
    # an update at each change of contact, beside those after steps of the engine
    assert {e.time for e in native.events} <= set(times) | {STOP}
    assert len(times) >= len({e.time for e in native.events})
    at = dict(looking.seen)
    for k, time in enumerate(native.time):
        assert at[time][0] == time
        assert at[time][1:] == pytest.approx([native[name][k] for name in clocked.states], rel=1e-9, abs=1e-12)


def test_the_importer_can_ask_to_return(clocked: Fmu) -> None:
    seen = Looking(clocked)
    with face(clocked, **seen.options) as one:
        seen.one = one
        one.initialize()
        one.step(0.0, STOP)
    first = seen.seen[0][0]
    for until in (first, 0.0, first + 0.25 * (STOP - first), float("nan")):
        looking = Looking(clocked, ask=lambda _, until=until: until)
        with face(clocked, **looking.options) as one:
            looking.one = one
            one.initialize()
            reached = max(first, until) if until == until else first
            assert one.step(0.0, STOP) == (False, False, True, reached)
            # and goes on from there
            looking.ask = lambda _: None
            one.step(reached, STOP - reached)
            found = one.get(clocked.states)
        expected = simulate(clocked, STOP, output_times=[STOP])
        assert found == pytest.approx([expected[name][0] for name in clocked.states], rel=1e-8, abs=1e-10)


def test_returning_is_not_asked_of_an_importer_that_forbids_it() -> None:
    fmu = Fmu.open(built("block_on_belt"))
    looking = Looking(fmu, early=False, ask=lambda time: time)
    with face(fmu, **looking.options) as one:
        looking.one = one
        one.initialize()
        assert one.step(0.0, STOP) == (False, False, False, STOP)


def test_events_return_early_while_steps_are_looked_into(clocked: Fmu) -> None:
    looking = Looking(clocked, events=True)
    with face(clocked, **looking.options) as one:
        looking.one = one
        found = list(ticks(one, STOP))
    assert sorted(name for _, name in found) == sorted(
        name for _, name in expected(clocked, list(simulate(clocked, STOP).events))
    )


def test_variables_that_cannot_be_looked_at_are_refused() -> None:
    fmu = Fmu.open(built("block_on_belt"))
    wrong = [fmu.variables["belt_state"].valueReference]
    with pytest.raises(Exception, match="instantiate"), face(fmu, requiredIntermediateVariables=wrong):
        pass


def test_what_is_declared_is_done(clocked: Fmu) -> None:
    interface = clocked.description.coSimulation
    assert interface
    assert interface.providesIntermediateUpdate and interface.canReturnEarlyAfterIntermediateUpdate
    assert interface.mightReturnEarlyFromDoStep and interface.hasEventMode
    assert np.unique([v.valueReference for v in clocked.variables.values()]).size == len(clocked.variables)
