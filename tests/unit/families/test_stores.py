"""Stores of runs: the same to the last byte whoever makes them and however often they are broken off, or refused."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from checkout import ROOT
from hypothesis import given
from hypothesis import strategies as st
from lazy_fmu import LazyFmu
from store_content import content

from fmu_models import maps
from fmu_models.analyses.basins import Basins, basins
from fmu_models.analyses.chart import chart
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.base.errors import StickslipError, WriteError
from fmu_models.families import jobs as families
from fmu_models.families.execution import Execution
from fmu_models.families.store import ROOM, RunLog, stored_runs
from fmu_models.fmu.load import load
from fmu_models.sections.crossing import Crossing
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.return_map import ReturnMap
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.sections import Section

xarray = pytest.importorskip("xarray")
pytest.importorskip("zarr")

HELPERS = str(ROOT / "tests/helpers")
SUPPORT = LazyFmu("discontinuous_support")
CHAOS = {"ks": 300.0, "cs": 0.6, "g": 1.6, "omega": 0.94}
LINE = np.linspace(-8.0, 8.0, 12)
SMALL = 75  # steps of a chunk by series, and an eighth of those in lanes
LOGISTIC = Iteration.of(maps.load("logistic"), {"r": 3.5})


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    for name in ("FAR_CHUNK", "MOST_CHUNK"):
        monkeypatch.setattr(families, name, SMALL)


def support(**values: float) -> Strobe:
    return Strobe(SUPPORT, forcing="omega", parameters={**CHAOS, **values})


def quiet(fraction: float) -> None: ...


def mapped(progress: Any = quiet, **execution: Any) -> Basins:
    """Three periodic motions, and some starts that a bound of 40 steps leaves to a second family."""
    return basins(support(omega=0.92), x=LINE, v=LINE, most=40, execution=Execution(**execution), progress=progress)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "run.zarr"
    with pytest.MonkeyPatch.context() as patch:
        for name in ("FAR_CHUNK", "MOST_CHUNK"):
            patch.setattr(families, name, SMALL)
        mapped(store=path, workers=1)
    return path


def analyses() -> dict[str, Any]:
    omega = np.linspace(0.8, 1.0, 31)
    return {
        "basins": lambda **how: basins(support(omega=0.92), x=LINE, v=LINE, most=40, **how),
        "diagram": lambda **how: orbit_diagram(
            support(), "omega", omega, direction="both", exponents=1024, transient=60, points=20, longest=4, **how
        ),
        "chart": lambda **how: chart(
            support(), what="impacts", omega=omega[:9], ks=[250.0, 300.0, 350.0], refine=2, transient=300, **how
        ),
        "lyapunov": lambda **how: lyapunov(support(), {"x": 0.0, "v": 0.0}, periods=400, transient=20, **how),
        "map": lambda **how: orbit_diagram(LOGISTIC, "r", np.linspace(3.0, 4.0, 9), transient=50, **how),
    }


@pytest.mark.parametrize("name", analyses())
def test_a_store_is_the_same_whoever_makes_it_and_what_is_found_as_without_it(name, tmp_path):
    make = analyses()[name]
    workers = (1, 2, 7) if name == "basins" else (1, 7)
    kept = [make(execution=Execution(count, store=tmp_path / f"{count}.zarr")) for count in workers]
    assert all(content(tmp_path / f"{count}.zarr") == content(tmp_path / "1.zarr") for count in workers)
    plain = make().to_xarray().drop_attrs()
    for found in (kept[0].to_xarray(), xarray.open_zarr(tmp_path / "1.zarr", consolidated=False, chunks=None)):
        xarray.testing.assert_identical(plain, found.drop_attrs().astype({n: plain[n].dtype for n in found.data_vars}))


def test_the_runs_of_a_store_are_those_that_were_made(whole, monkeypatch):
    made, run = [], Strobe.run

    def noted(self: Strobe, jobs: families.Jobs, stop: Any) -> Any:
        made.append(run(self, jobs, stop))
        return made[-1]

    monkeypatch.setattr(Strobe, "run", noted)
    mapped(workers=1)
    ends = np.concatenate([rows.ends for rows in made])
    stored = np.concatenate([rows.ends for rows in stored_runs(whole)])
    assert len(stored_runs(whole)) >= 3 and {*map(bytes, stored)} <= {*map(bytes, ends)}


def test_a_finished_store_is_a_few_files_that_zarr_knows(whole, recwarn):
    import zarr

    group: Any = zarr.open_group(whole, mode="r")
    log: Any = group["records/log"]
    assert log.dtype == np.uint8 and log[:8].view(np.int64)[0] == 0
    # of two groups, the log, the two axes and the two grids over them
    assert not recwarn.list and len(content(whole)) == 2 + 2 * 5
    with xarray.open_zarr(whole, consolidated=False) as opened:
        assert opened["attractor"].chunks == ((12,), (12,)) and not recwarn.list


@given(numbers=st.lists(st.integers(-1, 9), min_size=1, max_size=12), cut=st.floats(0.0, 1.0), seed=st.integers(0, 99))
def test_a_log_that_is_cut_keeps_what_was_whole(numbers, cut, seed, tmp_path_factory):
    path, draw = tmp_path_factory.mktemp("log") / "0.log", random.Random(seed)
    records = [(number, draw.randbytes(draw.randrange(50))) for number in numbers]
    tail = draw.randbytes(draw.randrange(40))
    ends, log = [0], RunLog(path)
    for number, text in records:
        log.put(number, text)
        ends.append(path.stat().st_size)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(cut * ends[-1])] + tail)
    # by chance the tail begins with what was cut
    length = len(list(takewhile(lambda pair: pair[0] == pair[1], zip(whole, path.read_bytes(), strict=False))))
    kept = dict(records[: sum(end <= length for end in ends) - 1])
    again = RunLog(path)
    assert {number: again.get(number) for number in again.numbers} == kept
    again.put(3, b"next")
    kept[3] = b"next"
    again.sort()
    sorted_log = RunLog(path)
    assert [(number, sorted_log.get(number)) for number in sorted_log.numbers] == sorted(kept.items())
    assert path.stat().st_size == sum(RunLog.HEAD.size + len(text) for text in kept.values())


def test_what_is_killed_as_it_finishes_is_finished_later(whole, tmp_path, monkeypatch):
    store, replace = tmp_path / "run.zarr", os.replace
    packed: list[Path] = []

    def failing(source: Path, target: Path) -> None:
        if "c" in Path(target).parts[-2:]:
            packed.append(Path(target))
        if packed:
            raise KeyboardInterrupt
        replace(source, target)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("fmu_models.families.store.os.replace", failing)
        mapped(store=store)
    assert len(stored_runs(store)) == len(stored_runs(whole))
    mapped(store=store, resume=True)
    assert content(store) == content(whole)


def test_runs_of_what_is_no_store_are_refused(tmp_path):
    with pytest.raises(StickslipError, match="is no store of runs"):
        stored_runs(tmp_path / "nothing.zarr")


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="no kill -9 there")
def test_what_is_killed_goes_on_and_repeats_one_chunk_per_worker(whole, tmp_path):
    """Each child comes four times farther and is killed; the last one comes to the end."""
    store = tmp_path / "run.zarr"
    code = (
        "import os, sys, time\n"
        f"sys.path[:0] = {[str(Path(__file__).parent), str(ROOT), str(ROOT / 'tests/helpers')]!r}\n"
        "import test_stores as t\n"
        "t.families.FAR_CHUNK = t.families.MOST_CHUNK = t.SMALL\n"
        "seen, run = [], t.Strobe.run\n"
        "def counted(self, jobs, stop):\n"
        "    if jobs.transient or jobs.rows > 1: print(len(jobs), flush=True)\n"
        "    time.sleep(0.05)  # or several come at once, and are one step of the progress\n"
        "    return run(self, jobs, stop)\n"
        "t.Strobe.run = counted\n"
        "def progress(fraction):\n"
        "    if seen[-1:] != [fraction]: seen.append(fraction)\n"
        "    if len(seen) > 3: os.kill(os.getpid(), 9)\n"
        f"t.mapped(store={str(store)!r}, resume=True, workers=2, progress=progress)\n"
    )
    children = [killed(code)]
    while children[-1].returncode == -signal.SIGKILL:
        children.append(killed(code))
    assert children[-1].returncode == 0, children[-1].stderr
    assert 1 < len(children) < 9
    assert content(store) == content(whole)
    made = sum(len(child.stdout.split()) for child in children)
    # what two workers were at, and what had come and was not written yet
    assert made <= finished(store) + 4 * (len(children) - 1)


def killed(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_an_interrupt_keeps_what_is_finished_and_says_how_to_go_on(whole, tmp_path, monkeypatch):
    def interrupted(fraction: float) -> None:
        if fraction > 0.3:
            raise KeyboardInterrupt

    store = tmp_path / "run.zarr"
    with pytest.raises(KeyboardInterrupt) as caught:
        mapped(store=store, workers=2, progress=interrupted)
    assert "Go on: --resume" in caught.value.__notes__[0]
    with pytest.raises(StickslipError, match=r"is not finished\. Go on with it: --resume"):
        mapped(store=store)
    kept, made, run = finished(store), [], Strobe.run

    def counted(self: Strobe, jobs: families.Jobs, stop: Any) -> Any:
        made.extend([1] if jobs.transient or jobs.rows > 1 else [])
        return run(self, jobs, stop)

    monkeypatch.setattr(Strobe, "run", counted)
    mapped(store=store, resume=True)
    assert content(store) == content(whole)
    assert kept > 1 and len(made) == finished(store) - kept


def finished(store: Path) -> int:
    """Chunks that are there."""
    (path,) = [*store.glob("records.log"), *store.glob("records/log/c/0")]
    return sum(number % ROOM > 0 for number in RunLog(path).numbers)


def test_a_full_disk_is_said_and_left_behind_when_there_is_room(whole, tmp_path):
    store, before = tmp_path / "run.zarr", signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (3000, hard))  # a chunk of points is larger, the descriptions are not
        with pytest.raises(WriteError, match="Make room"):
            mapped(store=store)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    mapped(store=store, resume=True)
    assert content(store) == content(whole)


def test_a_finished_store_is_read_and_no_run_is_made(whole, monkeypatch):
    labels = mapped().labels

    run = Strobe.run

    def single_steps(self: Strobe, jobs: families.Jobs, stop: Any) -> Any:
        assert jobs.transient == 0 and jobs.rows == 1, "a run was made"
        return run(self, jobs, stop)

    monkeypatch.setattr(Strobe, "run", single_steps)
    assert np.array_equal(mapped(store=whole).labels, labels)


def test_a_store_of_something_else_is_refused_with_the_difference(whole, tmp_path, monkeypatch):
    other = Iteration.of(maps.load("logistic"), {"r": 3.4})
    cases: list[tuple[Any, str]] = [
        (
            lambda: basins(support(omega=0.92), x=LINE, v=LINE, most=50, execution=Execution(store=whole, resume=True)),
            "most = 40 there, 50",
        ),
        (
            lambda: basins(support(omega=0.9), x=LINE, v=LINE, most=40, execution=Execution(store=whole)),
            "parameters.omega = 0.92 there, 0.9",
        ),
        (
            lambda: basins(support(omega=0.92), x=LINE, v=-LINE, most=40, execution=Execution(store=whole)),
            "axes.v.digest",
        ),
        (
            lambda: basins(other, x=[0.3], most=40, execution=Execution(store=whole)),
            "system.model = .discontinuous_support. there, .log",
        ),
        (
            lambda: orbit_diagram(support(), "omega", [0.9], execution=Execution(store=whole)),
            "analysis = .basins. there, .diagram. here",
        ),
        (lambda: mapped(store=tmp_path), "is no store of runs"),
    ]
    (tmp_path / "notes.txt").write_text("of mine")
    (tmp_path / "zarr.json.partial").write_text("of a process that was killed")
    for make, said in cases:
        with pytest.raises(StickslipError, match=said):
            make()
    monkeypatch.setattr("fmu_models.families.execution.version", lambda: "9.9")
    with pytest.raises(StickslipError, match=r"stickslip = .*there, .9\.9. here"):
        mapped(store=whole)
    assert (tmp_path / "notes.txt").is_file()


def test_a_return_map_whose_start_is_a_function_has_no_store(tmp_path):
    back = ReturnMap(SUPPORT, "v", section=Section("x", 0.0, 1), cap=50.0, start=lambda v: {"x": 0.0, "v": v})
    assert orbit_diagram(back, "omega", [1.0], start=[1.0], transient=2, points=1, longest=0).steps == 3
    with pytest.raises(StickslipError, match="give the start of the return map as values"):
        orbit_diagram(back, "omega", [1.0], execution=Execution(store=tmp_path / "run.zarr"))


def test_overwriting_takes_the_place_of_a_store(tmp_path):
    store = tmp_path / "run.zarr"
    for value in (0.2, 0.3):
        basins(LOGISTIC, x=[value], execution=Execution(store=store, overwrite=True))
        assert xarray.open_zarr(store, consolidated=False, chunks=None)["x"].item() == value


def test_an_error_of_one_run_is_kept_with_it(tmp_path):
    system = Strobe(load("hinge_clearance"), forcing="f")
    for _ in range(2):  # made, then read
        found = basins(
            system, x=[-0.002, 0.02], v=[0.0, 0.05], most=300, execution=Execution(store=tmp_path / "run.zarr")
        )
        assert (found.labels[1] == -3).all() and (found.labels[0] >= 0).all()
        assert "right_memory" in found.failures[1, 0]


def test_a_chain_is_the_same_in_one_piece_and_in_links(monkeypatch):
    omega = np.tile(np.linspace(0.8, 1.0, 30), 2)
    system = Crossing(SUPPORT, "v", 0.0, -1, forcing="omega", parameters=CHAOS)
    for one in (support(), system):
        start = one.start({"x": 0.5, "v": 0.0})
        jobs = families.Jobs(np.tile(start, (60, 1)), {"omega": omega}, transient=5, rows=5, chain=30)
        monkeypatch.setattr(families, "CHUNK", 10**6)
        assert len(jobs.chunks()) == 2
        whole_chain = one.make(jobs).points
        for steps, links in ((70, 10), (10, 60)):  # of seven runs and a rest of two, or of one
            monkeypatch.setattr(families, "CHUNK", steps)
            assert len(jobs.chunks()) == links
            assert np.array_equal(one.make(jobs, workers=3).points, whole_chain)


def test_sweeps_from_several_starts_are_those_from_each_also_broken_off(tmp_path):
    """Three in each direction, side by side, and the one whose start is not there twice alone; where two motions exist
    some sweeps come to the other."""
    system, omega = support(ks=300.0), np.linspace(0.93, 1.0, 12)
    how: dict[str, Any] = {"transient": 150, "direction": "both"}

    def swept(execution: Execution, progress: Any = quiet) -> Any:
        return orbit_diagram(system, "omega", omega, starts=3, **how, execution=execution, progress=progress)

    found = swept(Execution(workers=2))
    assert found.directions == ("up", "up_2", "up_3", "down", "down_2", "down_3") and not found.failures
    apart = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 2)) * system.sizes()
    for k, by in enumerate([0.0 * apart[0], *apart[1:]]):
        alone = orbit_diagram(system, "omega", omega, start=(system.start() + by).tolist(), **how)
        for d in (0, 1):
            assert np.array_equal(alone.points[d], found.points[k + 3 * d], equal_nan=True)
            assert (alone.periods[d] == found.periods[k + 3 * d]).all()
    assert any(len(set(column)) > 1 for column in found.periods.T.tolist())
    assert set(found.ways) == {"up", "down"}

    def break_off(fraction: float) -> None:
        if fraction > 0.4:
            raise KeyboardInterrupt

    store = tmp_path / "run.zarr"
    with pytest.raises(KeyboardInterrupt):
        swept(Execution(store=store, workers=1), break_off)
    resumed = swept(Execution(store=store, resume=True))
    assert np.array_equal(resumed.points, found.points, equal_nan=True)
    assert sum(len(rows.filled) for rows in stored_runs(store)) == 72
    with pytest.raises(StickslipError, match="one start"):
        orbit_diagram(system, "omega", omega, starts=0)
