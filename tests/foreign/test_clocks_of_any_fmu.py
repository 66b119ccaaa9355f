"""Clocks of FMI 3: those that the importer ticks, those that it reads; partitions; steps that show themselves."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from build import build
from models import FOLDER
from rich.console import Console

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import driver as drivers
from fmu_models.importer.driver import Driver
from fmu_models.importer.experiment import FmuExperiment, perform
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any
from fmu_models.report.run_summary import print_summary, summary
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="3.0" modelName="{0}" '
HEAD += 'instantiationToken="{0}">\n'
CLOCKED = """<ModelExchange modelIdentifier="clocked"/>
<CoSimulation modelIdentifier="clocked" canHandleVariableCommunicationStepSize="true" hasEventMode="true"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="x" valueReference="1" causality="output" initial="exact" start="0"/>
<Float64 name="der(x)" valueReference="101" derivative="1"/>
<Float64 name="period" valueReference="202" causality="parameter" variability="tunable" start="0.4"/>
<Float64 name="held" valueReference="203" causality="output" variability="discrete" clocks="601"/>
<Int32 name="samples" valueReference="401" causality="output" variability="discrete" clocks="601"/>
<Int32 name="total" valueReference="402" causality="output" variability="discrete" clocks="601 602 603 604 606"/>
<Int32 name="fifths" valueReference="403" causality="output" variability="discrete"/>
<Clock name="sample" valueReference="601" causality="input" intervalVariability="constant" intervalDecimal="0.25"
 shiftDecimal="0.1"/>
<Clock name="grow" valueReference="602" causality="input" intervalVariability="changing"/>
<Clock name="later" valueReference="603" causality="input" intervalVariability="countdown"/>
<Clock name="go" valueReference="604" causality="input" intervalVariability="triggered"/>
<Clock name="fifth" valueReference="605" causality="output" intervalVariability="triggered"/>
<Clock name="tuned" valueReference="606" causality="input" intervalVariability="tunable"/>
</ModelVariables>
<ModelStructure><Output valueReference="1"/><Output valueReference="203"/><Output valueReference="401"/>
<Output valueReference="402"/><Output valueReference="403"/><Output valueReference="605"/>
<ContinuousStateDerivative valueReference="101"/><InitialUnknown valueReference="101"/>
<InitialUnknown valueReference="203"/><InitialUnknown valueReference="403"/>
</ModelStructure>
</fmiModelDescription>"""
PARTITIONS = """<ScheduledExecution modelIdentifier="partitions"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Clock name="each" valueReference="601" causality="input" intervalVariability="constant" priority="0"
 intervalCounter="2" resolution="2"/>
<Clock name="asked" valueReference="602" causality="input" intervalVariability="triggered" priority="1"/>
<Clock name="soon" valueReference="603" causality="input" intervalVariability="countdown" priority="2"/>
<Clock name="fifth" valueReference="604" causality="output" intervalVariability="triggered"/>
<Int32 name="n_each" valueReference="401" causality="output" variability="discrete" clocks="601"/>
<Int32 name="n_asked" valueReference="402" causality="output" variability="discrete" clocks="602"/>
<Int32 name="n_soon" valueReference="403" causality="output" variability="discrete" clocks="603"/>
<Int32 name="total" valueReference="404" causality="output" variability="discrete" clocks="601 602 603"/>
<Float64 name="handed" valueReference="201" causality="output" variability="discrete"/>
</ModelVariables>
<ModelStructure/>
</fmiModelDescription>"""
ASKING = """<CoSimulation modelIdentifier="asking" canHandleVariableCommunicationStepSize="true"
 providesIntermediateUpdate="true" canReturnEarlyAfterIntermediateUpdate="true"/>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="x" valueReference="1" causality="output" initial="exact" start="0"/>
<Float64 name="u" valueReference="201" causality="input" start="0" intermediateUpdate="true"/>
<Int32 name="steps" valueReference="401" causality="output" variability="discrete"/>
<Int32 name="returns" valueReference="402" causality="output" variability="discrete"/>
</ModelVariables>
<ModelStructure><Output valueReference="1"/></ModelStructure>
</fmiModelDescription>"""
METHODS = ("dop853", "stiff", "co-simulation")
STOP = 2.2
GO = Signal([0.0, 0.33, 0.33, 0.5, 0.5, 1.7, 1.7, 3.0], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0])


def made(folder: Path, name: str, text: str) -> Fmu:
    options = ("-DFMI=3", "-Wno-unused-function")
    return Fmu.open(
        build(folder / f"{name}.fmu", FOLDER / f"{name}.c", HEAD.format(name) + text, name, options=options)
    )


@pytest.fixture(scope="module")
def clocked(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    return made(tmp_path_factory.mktemp("clocked"), "clocked", CLOCKED)


@pytest.fixture(scope="module")
def partitions(tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    return made(tmp_path_factory.mktemp("partitions"), "partitions", PARTITIONS)


def expected(period: float) -> dict[str, list[float]]:
    """Times of the ticks, by the rules that the head of the C file states."""
    found = {
        "sample": [0.1 + 0.25 * k for k in range(9)],
        "grow": [0.1, 0.3, 0.6, 1.0, 1.5, 2.1],
        "later": [0.65, 1.4, 2.15],
        "go": [0.33, 1.7],
        "tuned": [period * k for k in range(int(STOP / period) + 1)],
    }
    every = sorted(time for times in found.values() for time in times)
    return found | {"fifth": every[4::5]}


def ticked(run: Any) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for event in run.events:
        for name in filter(None, event.clocks.split(", ")):
            found.setdefault(name, []).append(event.time)
    return found


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("period", [0.4, 0.55])
def test_clocks_of_every_kind_tick(clocked: Fmu, method: str, period: float) -> None:
    times = np.linspace(0.0, STOP, 221) if method != "co-simulation" else None
    options: dict[str, Any] = {"communication_step": 0.1} if times is None else {"output_times": times}
    run = simulate_any(clocked, STOP, method=method, parameters={"period": period}, inputs={"go": GO}, **options)
    wanted = expected(period)
    found = ticked(run)
    assert {name: len(times) for name, times in found.items()} == {name: len(times) for name, times in wanted.items()}
    for name, ticks in wanted.items():
        assert found[name] == pytest.approx(ticks, abs=1e-12), name
    # what has a clock keeps its value from tick to tick; before the first one it has that of the initialization
    near = np.array([np.abs(run.time[:, None] - [t for ts in wanted.values() for t in ts]).min(axis=1)])[0] < 1e-9
    last = [max([-1.0, *(t for t in wanted["sample"] if t <= time)]) for time in run.time]
    assert run["held"][~near] == pytest.approx(np.array(last)[~near], abs=1e-9)
    for name, ticks in (("samples", wanted["sample"]), ("fifths", wanted["fifth"])):
        assert run[name][~near].tolist() == [sum(t <= time for t in ticks) for time in run.time[~near]]
    every = [t for name, ticks in wanted.items() if name != "fifth" for t in ticks]
    assert run["total"][~near].tolist() == [sum(t <= time for t in every) for time in run.time[~near]]
    assert run["total"].dtype == np.int64 and "never" not in run.method


def test_a_run_by_the_shell_tells_of_ticks(clocked: Fmu, partitions: Fmu, capsys: pytest.CaptureFixture[str]) -> None:
    for fmu, said in (
        (clocked, {"sample": 4, "grow": 4, "later": 1, "go": 1, "fifth": 2, "tuned": 3}),
        (partitions, {"each": 2, "asked": 1, "soon": 0, "fifth": 0}),
    ):
        recording = perform(fmu, FmuExperiment(1.0, inputs={name: 1.0 for name in ("go", "asked") if name in said}))
        content = summary(fmu, recording)
        assert content["clocks"] == said
    print_summary(content | {"files": []}, Console(width=200))
    assert "clocks: each 2, asked 1, soon 0, fifth 0 ticks" in capsys.readouterr().out


def test_the_times_of_a_run_that_begins_later(clocked: Fmu) -> None:
    run = simulate_any(clocked, 3.0, start_time=2.0, inputs={"go": 0.5})
    assert ticked(run)["sample"] == pytest.approx([2.1, 2.35, 2.6, 2.85])
    assert ticked(run)["go"] == [2.0]


def test_clocks_that_never_tick_are_named(clocked: Fmu) -> None:
    run = simulate_any(clocked, 0.05)
    assert re.findall(r"clock '(\w+)' never ticked", run.method) == ["sample", "grow", "later", "go"]
    assert "'sample' never ticked: its first tick lies after the end" in run.method
    with pytest.raises(StickslipError, match="'go' would never tick: it ticks where its signal jumps up"):
        simulate_any(clocked, 1.0, inputs={"go": 0.0})
    with pytest.raises(StickslipError, match="'go' would never tick"):
        simulate_any(clocked, 1.0, inputs={"go": Signal([0.0, 2.0], [0.0, 1.0])})
    with pytest.raises(StickslipError, match="'sample' ticks by its interval or by the FMU, and takes no signal"):
        simulate_any(clocked, 1.0, inputs={"sample": 1.0})


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('intervalDecimal="0.25"', 'intervalDecimal="0"', "'sample' has the interval 0 s; expected a positive number"),
        ('shiftDecimal="0.1"', 'shiftDecimal="-1"', "'sample' has the shift -1 s; expected zero or more"),
        ('"changing"', '"now and then"', "a clock in modelDescription.xml makes no sense: .*now and then"),
        ('shiftDecimal="0.1"', 'shiftCounter="1" resolution="0"', "makes no sense"),
    ],
)
def test_clocks_that_make_no_sense(tmp_path: Path, old: str, new: str, said: str) -> None:
    bad = made(tmp_path, "clocked", CLOCKED.replace(old, new))
    with pytest.raises(StickslipError, match=said):
        simulate_any(bad, 1.0)


def test_a_period_that_the_fmu_tells_and_is_none(clocked: Fmu) -> None:
    with pytest.raises(MotionError, match="'tuned' has the interval -1 s"):
        simulate_any(clocked, 1.0, parameters={"period": -1.0})


def test_clocks_without_event_mode_and_in_couplings_are_refused(tmp_path: Path, clocked: Fmu) -> None:
    text = re.sub(r"<ModelExchange.*?/>", "", CLOCKED).replace(' hasEventMode="true"', "")
    with pytest.raises(StickslipError, match="has the clocks sample, grow, later, go, tuned, which tick in event mode"):
        simulate_any(made(tmp_path, "clocked", text), 1.0)
    with pytest.raises(StickslipError, match=r"has the clocks sample, .* which a coupling does not tick"):
        simulate_coupled(clocked)


def simulate_coupled(fmu: Fmu) -> None:
    from fmu_models.coupling.run import couple

    couple(CoupledSystem("one", {"a": Unit(fmu)}, stop_time=1.0))


def test_partitions_are_scheduled(partitions: Fmu) -> None:
    asked = Signal([0.0, 1.0, 1.0, 1.5, 1.5, 8.0, 8.0, 8.5, 8.5, 9.0, 9.0, 9.9], [1, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1])
    run = simulate_any(partitions, 9.5, inputs={"asked": asked}, output_times=np.arange(20) * 0.5)
    assert run.method == "scheduled execution"
    each, at = np.floor(run.time) + 1, {"asked": [0.0, 1.0, 8.0, 9.0], "soon": [4.0]}
    n_asked, n_soon = (np.array([sum(t <= time for t in at[name]) for time in run.time]) for name in ("asked", "soon"))
    assert run["n_each"].tolist() == each.tolist()
    assert run["n_asked"].tolist() == n_asked.tolist()
    assert run["n_soon"].tolist() == n_soon.tolist()
    assert run["total"].tolist() == (each + n_asked + n_soon).tolist()
    assert run["handed"].tolist() == (1000.0 * n_soon).tolist()
    # 1, 2 at 0; 3, 4 at 1; the fifth at 2, the tenth at 6, the fifteenth at 9
    assert ticked(run) == {"each": [*range(10)], **at, "fifth": [2.0, 6.0, 9.0]}
    # of what ticks at the same time the first is that of the lowest priority
    assert [event.clocks for event in run.events if event.time == 9.0] == ["each, asked, fifth"]


def test_partitions_that_nobody_asks_for(partitions: Fmu) -> None:
    run = simulate_any(partitions, 3.0)
    assert "the clock 'asked' never ticked: it ticks where a signal given for it jumps up" in run.method
    assert "the clock 'soon' never ticked: the FMU never told when" in run.method
    with pytest.raises(StickslipError, match="offers Scheduled Execution, but no Model Exchange"):
        simulate_any(partitions, 3.0, method="stiff")
    with pytest.raises(StickslipError, match="offers Model Exchange and Co-Simulation, but no Scheduled Execution"):
        simulate_any(Fmu.open(built("block_on_belt")), 3.0, method="scheduled")


def test_inputs_are_given_inside_steps_where_they_are_asked_for(tmp_path: Path) -> None:
    fmu = made(tmp_path, "asking", ASKING)
    # x' = t (4 - t), whose steps by midpoints are wrong by their length squared; with u held over 0.5 s it were 0.3
    time = np.linspace(0.0, 4.0, 4001)
    u = Signal(time, time * (4.0 - time))
    run = simulate_any(fmu, 4.0, inputs={"u": u}, communication_step=0.5)
    assert run["x"] == pytest.approx(2.0 * run.time**2 - run.time**3 / 3.0, abs=1e-4)
    assert run["steps"][-1] == pytest.approx(400, abs=8) and run["returns"][-1] == 0


def test_a_long_step_is_broken_off_for_the_keyboard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fmu = made(tmp_path, "asking", ASKING)
    monkeypatch.setattr(drivers, "ALLOWANCE", 50)
    calls = []
    with Driver(fmu, method="co-simulation") as driver:
        run = driver.run(4.0, inputs={"u": 1.0}, communication_step=4.0, progress=calls.append)
    assert run["x"][-1] == pytest.approx(4.0, abs=1e-12)
    assert run["returns"][-1] == len(calls) - 1 == 7


@pytest.mark.parametrize("method", ["dop853", "co-simulation"])
@pytest.mark.parametrize("name", ["block_on_belt", "woodpecker"])
def test_clocks_of_our_own_tick_at_the_events_of_our_own_run(name: str, method: str) -> None:
    fmu = Fmu.open(built(name))
    stop = 2.0 if name == "woodpecker" else 20.0
    own = simulate(fmu, stop)
    run = simulate_any(fmu, stop, method=method, tolerance=1e-10, output_times=own.time)
    wanted: dict[str, list[float]] = {}
    for e in own.events:
        ticks = "impact" if e.is_impact else {0: "stick", 1: "slip", -1: "slip"}.get(e.after) if not e.rigid else None
        if ticks:
            wanted.setdefault(f"{e.contact}.{ticks}", []).append(e.time)
    found = ticked(run)
    assert wanted and found.keys() == wanted.keys()
    for clock, times in wanted.items():
        assert found[clock] == pytest.approx(times, abs=1e-6), clock
    # they belong to the events that the master finds by itself
    assert {event.kind for event in run.events} == {"state"}
