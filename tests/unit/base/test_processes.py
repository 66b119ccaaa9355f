"""A run in a process of its own: whatever happens there, the parent gets the value or the reason."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import isolated_functions as functions
import numpy as np
import pytest

from fmu_models.base import child_process
from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import ProcessPool, in_processes, isolated
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

linux = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
posix = pytest.mark.skipif(os.name != "posix", reason="signals")


def test_a_value_comes_back_whole() -> None:
    seen: list[float] = []
    assert np.array_equal(isolated(functions.squares, 1_000_000, progress=seen.append), np.arange(1e6) ** 2)
    assert seen == [0.25, 0.5, 1.0]


def test_a_run_is_the_same_in_a_process_of_its_own() -> None:
    fmu = Fmu.open(built("block_on_belt"))
    here = simulate(fmu, 5.0)
    seen: list[float] = []
    there = isolated(simulate, fmu, 5.0, limits=Limits(60, 2000), progress=seen.append)
    assert all(np.array_equal(here[name], there[name]) for name in here.values)
    assert (here.events, here.units, here.steps) == (there.events, there.units, there.steps)
    assert seen[-1] == 1.0
    assert (fmu.folder / "modelDescription.xml").is_file()


def test_errors_of_the_user_and_of_the_program() -> None:
    with pytest.raises(StickslipError, match=r"the pendulum is too long\. Shorten it\."):
        isolated(functions.refuse)
    with pytest.raises(RuntimeError, match="KeyError: 'lost'"):
        isolated(functions.stumble)
    with pytest.raises(functions.Particular, match="too long") as caught:
        isolated(functions.refuse_in_particular)
    assert caught.value.time == 1.5


@posix
def test_a_crash() -> None:
    with pytest.raises(IsolatedFailure, match=r"crashed .SIGSEGV, segmentation fault"):
        isolated(functions.crash, limits=Limits(60))
    with pytest.raises(IsolatedFailure, match=r"crashed .SIGABRT"):
        isolated(functions.abort)


def test_an_exit() -> None:
    with pytest.raises(IsolatedFailure, match=r"ended the process of the run .exit code 0x3"):
        isolated(functions.leave, 3)


@posix
def test_a_hang_is_stopped_in_time() -> None:
    with pytest.raises(IsolatedFailure, match=r"did not end within 0\.5 s"):
        isolated(functions.hang, limits=Limits(0.5))
    assert isolated(functions.sleep, 0.2, limits=Limits(30)) == 0.2


@linux
def test_too_much_memory() -> None:
    for function in (functions.eat, functions.eat_in_c):
        with pytest.raises(IsolatedFailure, match="more than the 300 MB"):
            isolated(function, 400, limits=Limits(memory=300))
    assert isolated(functions.eat, 200, limits=Limits(memory=300)) == 200 << 20


@linux
def test_a_crash_with_little_memory_used_is_a_crash() -> None:
    with pytest.raises(IsolatedFailure, match="SIGSEGV"):
        isolated(functions.crash, limits=Limits(memory=300))


@linux
def test_a_large_parent_does_not_hide_what_happened() -> None:
    ballast = bytearray(500 << 20)
    ballast[:: 1 << 12] = b"x" * len(ballast[:: 1 << 12])
    with pytest.raises(IsolatedFailure, match=r"SIGSEGV.*Or it needed more than the 300 MB"):
        isolated(functions.eat_in_c, 400, limits=Limits(memory=300))
    with pytest.raises(IsolatedFailure, match="crashed"):
        isolated(functions.crash, limits=Limits(memory=300))


@pytest.mark.parametrize(("time_limit", "memory"), [(0, None), (-1, None), (float("nan"), None), (None, 0)])
def test_limits_that_are_none(time_limit: float | None, memory: float | None) -> None:
    with pytest.raises(StickslipError, match="must be a positive number"):
        Limits(time_limit, memory)


def test_limits_without_end() -> None:
    assert Limits(float("inf"), float("inf")) == Limits()
    assert Limits.default().time == 600


def test_what_it_prints_does_not_disturb(capfd: pytest.CaptureFixture[str]) -> None:
    assert isolated(functions.chatter) == 7
    printed = capfd.readouterr()
    assert printed.out == ""
    for text in ("hello from C", "hello from below", "hello from Python"):
        assert text in printed.err


def hanging_parent(note: Path) -> subprocess.Popen[bytes]:
    """A process that isolates a hanging call; ``note`` holds the child's number once it hangs."""
    code = (
        "import isolated_functions as f\nfrom fmu_models.base.processes import isolated\n"
        f"isolated(f.hang, {str(note)!r})\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen([sys.executable, "-c", code], env=environment, stderr=subprocess.DEVNULL)
    while not (note.exists() and note.read_text()):
        assert parent.poll() is None
        time.sleep(0.02)
    return parent


def gone(number: int) -> bool:
    """Whether a process ends within a time that only one that goes on takes."""
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        try:
            os.kill(number, 0)
        except ProcessLookupError:
            return True
        # an orphan is a zombie until whoever adopts it looks
        if (state := Path(f"/proc/{number}/stat")).exists() and state.read_text().rsplit(")")[-1].split()[0] == "Z":
            return True
        time.sleep(0.02)
    return False


@posix
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_the_child_goes_with_the_parent(tmp_path: Path, end: signal.Signals) -> None:
    note = tmp_path / "number"
    parent = hanging_parent(note)
    try:
        parent.send_signal(end)
        assert parent.wait(timeout=120) != 0
        assert gone(int(note.read_text()))
    finally:
        parent.kill()  # its child goes with it


@posix
def test_a_library_gone_wild() -> None:
    for function in (functions.close_everything, functions.write_garbage):
        with pytest.raises(IsolatedFailure, match=r"broke the connection|ended the process"):
            isolated(function, limits=Limits(60))


@posix
def test_what_it_leaves_behind_goes_too(tmp_path: Path) -> None:
    note = tmp_path / "number"
    with pytest.raises(IsolatedFailure, match="exit code 0x5"):
        isolated(functions.leave_a_process_behind, str(note))
    assert gone(int(note.read_text()))


def outcomes_of(function: Callable[..., Any], jobs: list[tuple[Any, ...]], **how: Any) -> list[Any]:
    return [outcome for _, outcome in sorted(in_processes(function, jobs, **how))]


def test_children_stay_and_keep_to_their_group() -> None:
    names = [f"{letter}{i}" for i in range(3) for letter in "ab"]
    jobs = [(name,) for name in names]
    (one, asked), *_ = outcomes_of(functions.Keeper().ask, jobs, processes=1, group=functions.first_letter)[::-1]
    assert asked == ["a0", "a1", "a2", "b0", "b1", "b2"]
    both = {process for process, _ in outcomes_of(functions.Keeper().ask, jobs, processes=2)}
    assert len(both) == 2 and one not in both


@posix
def test_a_job_that_fails_is_reported_and_the_others_go_on() -> None:
    jobs = [(name,) for name in ("first", "refuse", "again", "crash", "hang", "last")]
    first, refused, again, crashed, hung, last = outcomes_of(
        functions.Keeper().ask, jobs, processes=1, limits=Limits(5)
    )
    assert isinstance(refused, StickslipError) and "too long" in str(refused)
    assert isinstance(crashed, IsolatedFailure) and (crashed.cause, crashed.code) == ("own", -signal.SIGSEGV)
    assert isinstance(hung, IsolatedFailure) and hung.cause == "time" and hung.seconds >= 5
    # a refusal leaves the child as it is; a dead one is replaced, and the new one knows nothing
    assert (again[0], again[1], last[1]) == (first[0], ["first", "again"], ["last"])


def test_jobs_given_ahead_to_a_child_that_dies_are_done_by_the_next() -> None:
    names = ["first", "crash", *(f"later{i}" for i in range(8))]
    first, crashed, *later = outcomes_of(functions.Keeper().ask, [(name,) for name in names], processes=1)
    assert isinstance(crashed, IsolatedFailure)
    assert {process for process, _ in later} == {later[0][0]} != {first[0]}
    assert [asked[-1] for _, asked in later] == names[2:]


def test_the_time_of_a_job_given_ahead_begins_when_the_job_does(monkeypatch: pytest.MonkeyPatch) -> None:
    # half of what is left is given at once after the first, and lasts longer together than one may
    monkeypatch.setattr(child_process, "AHEAD", 10.0)
    assert outcomes_of(functions.sleep, [(0.25,)] * 20, processes=1, limits=Limits(0.9)) == [0.25] * 20


def test_a_pool_serves_several_times_and_ends() -> None:
    with ProcessPool(functions.Keeper().ask, processes=1) as pool:
        (first,), (second,) = ([outcome for _, outcome in pool.run([(name,)])] for name in ("a", "b"))
        assert not isinstance(first, Exception)
        assert second == (first[0], ["a", "b"])
    assert gone(first[0])


def test_ending_the_iteration_ends_the_children() -> None:
    outcomes = in_processes(functions.Keeper().ask, [("a",), ("b",), ("c",)], processes=2)
    _, outcome = next(outcomes)
    assert not isinstance(outcome, Exception)
    outcomes.close()
    assert gone(outcome[0])


def test_children_share_the_cores() -> None:
    assert all(set(found) == {1} for found in outcomes_of(functions.threads, [(50,), (60,)], processes=2, threads=1))
