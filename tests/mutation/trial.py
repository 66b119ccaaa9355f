"""Tests of one file, run in a fork of this process, which has loaded what others wrote, and watched from outside.

A fork spares each trial some seconds of imports. Nothing of ours is imported before it, so that it takes the tree it is
told to.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import shutil
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import pytest

# what trials would import each for itself; what is not installed is not missed
LIBRARIES = (
    *("numpy", "scipy.integrate", "scipy.interpolate", "scipy.linalg", "scipy.optimize", "scipy.signal"),
    *("scipy.sparse.linalg", "scipy.special", "scipy.stats", "sympy", "pandas", "h5py", "fmpy.model_description"),
    *("fmpy", "tomlkit", "typer", "rich.console", "rich.table", "jinja2", "platformdirs", "threadpoolctl", "pint"),
    *("matplotlib.figure", "lmfit", "xml.etree.ElementTree", "http.server", "multiprocessing", "coverage"),
)
DIED = "died"  # what a trial has failed by that left no record
MEMORY = 8 << 30  # bytes of a process
UNCOMPILED = "The C compiler failed"  # what the toolchain says of C that is none


@dataclass(frozen=True)
class Outcome:
    """What a trial did.

    Attributes:
        failed: first test that failed, or what else went wrong; empty if nothing.
        why: the end of its report.
        timed_out: it was ended from outside.
        seconds: of each test that passed, its fixtures with it.
    """

    failed: str = ""
    why: str = ""
    timed_out: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    failures: tuple[str, ...] = ()


@cache
def _preload() -> None:
    """Load what others wrote, once for all trials."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    for name in LIBRARIES:
        with suppress(ImportError):
            importlib.import_module(name)


class _Recorder:
    """A plugin: order and choice of tests, their times, the first failure; coverage by test where it is asked for."""

    def __init__(self, order: dict[str, float], measured: Any) -> None:
        self.order, self.measured = order, measured
        self.record: dict[str, Any] = {"seconds": {}, "failed": "", "why": "", "failures": []}
        self.seconds: dict[str, float] = {}
        self.current = ""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        if self.order:
            items[:] = sorted((i for i in items if i.nodeid in self.order), key=lambda i: self.order[i.nodeid])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self.current = item.nodeid
        self._switch(item.nodeid)
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Iterator[None]:
        # what a fixture of a module runs is covered by all tests of the file
        self._switch("" if fixturedef.scope != "function" else self.current)
        try:
            return (yield)
        finally:
            self._switch(self.current)

    def _switch(self, context: str) -> None:
        if self.measured is not None:
            self.measured.switch_context(context)
            os.environ["MUTANTS_CONTEXT"] = context

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration
        if report.failed:
            self.record["failures"].append(report.nodeid)
            if not self.record["failed"]:
                self.record |= {"failed": report.nodeid, "why": report.longreprtext[-4000:]}
        elif report.passed and report.when == "call":
            self.record["seconds"][report.nodeid] = 0.0

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.record |= {"failed": report.nodeid or "collection", "why": report.longreprtext[-4000:]}


def run(
    tree: Path,
    files: Sequence[str],
    order: dict[str, float],
    environment: dict[str, str],
    patience: float,
    *,
    first: bool = True,
    covered: Path | None = None,
) -> Outcome:
    """Run tests of ``tree``.

    Args:
        files: files of tests, relative to the tree.
        order: the tests to be run, sorted by these values; empty for all.
        environment: variables beside ours.
        patience: s of CPU time of each of its processes, and four times as long by the clock.
        first: end at the first failure.
        covered: folder for data of coverage, with the test as context.
    """
    _preload()
    folder = tree.parent / "trial"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "tmp").mkdir(parents=True)
    child = os.fork()
    if child == 0:
        try:
            _child(tree, folder, files, order, environment, patience, first, covered)
        finally:
            os._exit(70)
    timed_out = not _waited(child, 4.0 * patience)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if timed_out:
        os.waitpid(child, 0)
        return Outcome("time-out", timed_out=True)
    try:
        record = json.loads((folder / "record.json").read_text("utf-8"))
    except (OSError, ValueError):
        return Outcome(DIED, (folder / "output").read_text("utf-8", "replace")[-2000:])
    return Outcome(record["failed"], record["why"], False, record["seconds"], tuple(record["failures"]))


def _waited(child: int, seconds: float) -> bool:
    end = time.monotonic() + seconds
    pause = 0.005
    while time.monotonic() < end:
        if os.waitpid(child, os.WNOHANG)[0]:
            return True
        time.sleep(pause)
        pause = min(0.1, 1.3 * pause)
    return False


def _child(
    tree: Path,
    folder: Path,
    files: Sequence[str],
    order: dict[str, float],
    environment: dict[str, str],
    patience: float,
    first: bool,
    covered: Path | None,
) -> None:
    """Run pytest and write what it did; never returns."""
    os.setsid()
    output = os.open(folder / "output", os.O_CREAT | os.O_WRONLY | os.O_TRUNC)
    null = os.open(os.devnull, os.O_RDONLY)
    for number, target in enumerate((null, output, output)):
        os.dup2(target, number)
    resource.setrlimit(resource.RLIMIT_CPU, (int(patience) + 1, int(patience) + 6))
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.chdir(tree)
    os.environ.update(environment | {"TMPDIR": str(folder / "tmp"), "PYTHONPATH": str(tree)})
    sys.path[:] = [str(tree), *(path for path in sys.path[1:] if path)]
    measured = None
    if covered is not None:
        import coverage

        covered.mkdir(parents=True, exist_ok=True)
        settings = covered / "settings"
        packages = "\n".join(f"    {tree / name}" for name in ("fmu_models", "rig_io", "identification"))
        silent = "no-data-collected,module-not-imported,module-not-measured"
        lines = ["[run]", f"source =\n{packages}", "parallel = true", f"data_file = {covered / 'data'}"]
        lines += ["context = ${MUTANTS_CONTEXT}", f"disable_warnings = {silent}"]
        settings.write_text("\n".join(lines), "utf-8")
        os.environ |= {"MUTANTS_CONTEXT": "", "COVERAGE_PROCESS_START": str(settings)}
        measured = coverage.Coverage(config_file=str(settings), context=None, messages=False)
        measured.start()
    recorder = _Recorder(order, measured)
    options = ["-q", "-n", "0", "-p", "no:cacheprovider", "-m", "", "-W", "ignore::pytest.PytestAssertRewriteWarning"]
    code = pytest.main([*options, *(["-x"] if first else []), *files], plugins=[recorder])
    record = recorder.record
    record["seconds"] = {test: recorder.seconds[test] for test in record["seconds"] if test not in record["failures"]}
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED) and not record["failed"]:
        record["failed"] = f"exit code {int(code)}"
    if measured is not None:
        measured.stop()
        measured.save()
    (folder / "record.json").write_text(json.dumps(record), "utf-8")
    sys.stdout.flush()
    os._exit(0)
