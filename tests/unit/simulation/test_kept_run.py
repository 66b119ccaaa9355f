"""Instances that are kept: whatever they did before, a run is that of a fresh one, to the last bit."""

from __future__ import annotations

import gc
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from crossed import crossings
from hypothesis import given, settings
from hypothesis import strategies as st
from lazy_fmu import LazyFmu

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import whole_run
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.run import KeptRun, simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Events, Trajectory

# friction with two held contacts, impacts that chatter, a stop with memory, internal states, no contact at all, modes
# whose factors are kept
MODELS = {
    "disc_rig": LazyFmu("disc_rig"),
    "bouncing_ball": LazyFmu("bouncing_ball", fmi_version="2.0"),
    "hinge_clearance": LazyFmu("hinge_clearance"),
    "block_on_belt": LazyFmu("block_on_belt", laws={"belt": "lugre"}),
    "disc_rig_free": LazyFmu("disc_rig", contacts=[]),
    "discontinuous_support": LazyFmu("discontinuous_support"),
}


class Stopped(Exception):
    """Raised in the middle of a run."""


def stop(_: float) -> None:
    raise Stopped


def same(one: Trajectory, other: Trajectory) -> bool:
    """Every number of two runs, bit by bit."""
    assert list(one.values) == list(other.values)
    assert isinstance(one.events, Events) and isinstance(other.events, Events)
    return (
        one.time.tobytes() == other.time.tobytes()
        and all(one[name].tobytes() == other[name].tobytes() for name in one.values)
        and one.events.rows.tolist() == other.events.rows.tolist()
        and (one.steps, one.evaluations) == (other.steps, other.evaluations)
    )


def fresh(name: str, *arguments: Any, **options: Any) -> Trajectory:
    """The run of an instance that has made no other."""
    return simulate(Fmu.open(MODELS[name].path), *arguments, **options)


def options_of(name: str, draw: Callable[[Any], float]) -> dict[str, Any]:
    """Arguments of a run that differ from the defaults here and there."""
    fmu = MODELS[name]
    near = st.floats(0.9, 1.1)
    given: dict[str, Any] = {"parameters": {}, "start": {}, "inputs": {}}
    for kind, names in (("parameters", fmu.parameters), ("inputs", fmu.inputs)):
        for variable in names:
            value = float(fmu.variables[variable].start or 0.0)
            if value and draw(st.booleans()):
                given[kind][variable] = value * draw(near)
    if name == "disc_rig" and draw(st.booleans()):
        given["inputs"]["w0"] = Signal([0.0, 1.0, 5.0], [0.2, 0.5 * draw(near), 0.4])
    given["start_time"] = draw(st.sampled_from([0.0, 0.25]))
    given["output_times"] = draw(st.sampled_from([None, [0.5], [0.3, 0.3, 1.0]]))
    return given


def disturb(name: str, kept: KeptRun, what: str) -> None:
    """Something else that an instance may have been through."""
    fmu = MODELS[name]
    match what:
        case "unknown":
            with pytest.raises(StickslipError):
                kept(1.0, parameters={"none": 1.0})
        case "stopped":
            with pytest.raises(Stopped):
                kept(2.0, progress=stop)
        case "section":
            crossings(fmu, fmu.states[0], level=1e-3, direction=0, stop_time=2.0, most=1)
        case "derivatives":
            with SensitiveRun(fmu, by=fmu.parameters[:1]) as run:
                run.run([0.2])
        case "refused":
            # beyond the range of numbers, or inside the table
            with pytest.raises(StickslipError):
                kept(1.0, start={"x": -1.0} if name == "bouncing_ball" else dict.fromkeys(fmu.states, 1e200))


@pytest.mark.nightly_for("disc_rig_free", "block_on_belt", "hinge_clearance", "disc_rig")
@pytest.mark.parametrize("name", MODELS)
@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_any_sequence_of_runs_is_that_of_fresh_instances(name: str, data: st.DataObject) -> None:
    with KeptRun(MODELS[name]) as kept, pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole_run, "ALLOWANCE", 7)  # so that a run can be stopped in its middle
        for _ in range(data.draw(st.integers(1, 4))):
            disturb(name, kept, data.draw(st.sampled_from(["nothing", "unknown", "stopped", "section", "derivatives"])))
            options = options_of(name, data.draw)
            try:
                expected = fresh(name, 1.5, **options)
            except StickslipError as error:
                with pytest.raises(StickslipError) as caught:
                    kept(1.5, **options)
                assert str(caught.value) == str(error)
            else:
                assert same(kept(1.5, **options), expected)
                assert same(simulate(MODELS[name], 1.5, **options), expected)


@pytest.mark.parametrize("name", ["disc_rig", "bouncing_ball"])
def test_an_error_of_the_engine_leaves_the_next_run_as_it_was(name: str) -> None:
    with KeptRun(MODELS[name]) as kept:
        before = kept(2.0)
        for what in ("refused", "stopped", "refused"):
            disturb(name, kept, what)
            assert same(kept(2.0), before)


def test_a_message_is_that_of_its_own_run() -> None:
    with KeptRun(MODELS["disc_rig"]) as kept:
        with pytest.raises(StickslipError, match=r"^disc_rig: mu_k0 exceeds mu_s0"):
            kept(1.0, parameters={"mu_k0": 0.9})
        with pytest.raises(StickslipError, match=r"^disc_rig: mu_k1 exceeds mu_s1"):
            kept(1.0, parameters={"mu_k1": 0.9})


def test_threads_share_a_library_and_no_run() -> None:
    """Each thread its own parameters, some in one KeptRun, some by simulate, all at once."""
    fmu = Fmu.open(MODELS["disc_rig"].path)
    loads = [{"N0": 5.0 + i} for i in range(4)]
    expected = [fresh("disc_rig", 20.0, parameters=load) for load in loads]
    found: list[bool] = []
    ready = threading.Barrier(len(loads))
    with KeptRun(fmu) as kept:

        def work(i: int) -> None:
            ready.wait()
            for _ in range(8):
                found.append(same(kept(20.0, parameters=loads[i]), expected[i]))
                found.append(same(simulate(fmu, 20.0, parameters=loads[i]), expected[i]))

        threads = [threading.Thread(target=work, args=(i,)) for i in range(len(loads))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(found) == 64 and all(found)


def test_a_run_within_a_run_has_an_instance_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole_run, "ALLOWANCE", 20)
    inner: list[Trajectory] = []
    with KeptRun(MODELS["disc_rig"]) as kept:
        outer = kept(5.0, progress=lambda _: inner.append(kept(1.0, parameters={"N0": 7.0})))
    assert len(inner) > 2 and same(outer, fresh("disc_rig", 5.0))
    assert all(same(one, fresh("disc_rig", 1.0, parameters={"N0": 7.0})) for one in inner[:2])


def test_results_outlive_the_runs_after_them() -> None:
    with KeptRun(MODELS["bouncing_ball"]) as kept:
        first = kept(3.0)
        values = {name: column.copy() for name, column in first.values.items()}
        events = tuple(first.events)
        kept(3.0, parameters={"A": 0.0})
    assert all((first[name] == column).all() for name, column in values.items())
    assert first.events == events


def test_what_is_closed_runs_no_more() -> None:
    with KeptRun(MODELS["disc_rig"]) as kept, KeptRun(MODELS["disc_rig"]) as other:
        kept.close()
        kept.close()
        with pytest.raises(StickslipError, match=r"closed\. Open a KeptRun again"):
            kept(1.0)
        assert len(other(1.0).time) == 1001
    with pytest.raises(StickslipError, match="tolerance must be a positive number, found -1"):
        KeptRun(MODELS["disc_rig"], tolerance=-1.0)


def test_one_run_after_the_other_takes_one_instance() -> None:
    fmu = Fmu.open(MODELS["disc_rig"].path)
    with KeptRun(fmu) as kept:
        for _ in range(3):
            kept(0.1)
            simulate(fmu, 0.1)
    with SensitiveRun(fmu, by=["J"]) as run:
        run.run([0.1])
    assert len(engine_of(fmu)._handles) == 1


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="only Linux tells which libraries are loaded")
def test_a_library_goes_with_its_fmu() -> None:
    fmu = Fmu.open(MODELS["disc_rig"].path)
    folder = fmu.folder
    with KeptRun(fmu) as kept:
        kept(0.1)
    assert str(folder) in Path("/proc/self/maps").read_text()
    del fmu, kept
    gc.collect()
    assert str(folder) not in Path("/proc/self/maps").read_text()
    assert not folder.exists()
