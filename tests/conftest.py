"""What tests of every folder share."""

from __future__ import annotations

import os
import shutil
import signal
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from shared_builds import share_builds
from threadpoolctl import threadpool_limits
from xdist.scheduler import WorkStealingScheduling

from fmu_models.base.child_process import THREADS

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

# Workers of tests share the cores already: threads of BLAS beside them wait for one another, at a third of the CPU time
# of a fit. What plugins have loaded is told; what is loaded later, in children too, reads the environment.
os.environ.update({name: os.environ.get(name, "1") for name in THREADS})
threadpool_limits(1)
# Images often set PYTHONDONTWRITEBYTECODE: each worker, and each command that a test starts, would compile and rewrite
# every file anew, half the CPU time of listing the tests.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# Ctrl-C does here and in children what it does at a terminal: background jobs of a shell, and what nohup or a service
# starts, inherit it as ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Compile into a cache beside pytest's own, which outlives a run."""
    share_builds(config.rootpath / ".pytest_cache" / "stickslip")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What needs a browser runs at night, but for the smoke test, and so do slow parameters of a test."""
    for item in items:
        slow = item.get_closest_marker("nightly_for")
        if slow is not None and item.callspec.id in slow.args:  # pyright: ignore[reportAttributeAccessIssue]
            item.add_marker(pytest.mark.nightly)
        fixtures = getattr(item, "fixturenames", ())
        if {"browser", "firefox_tab"} & set(fixtures) and not item.get_closest_marker("smoke"):
            item.add_marker(pytest.mark.nightly)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A headless Chromium, led by playwright; a test is skipped where either is absent."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed, in which the page could be opened")
    with playwright.sync_playwright() as started:
        made = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield made
        made.close()


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> WorkStealingScheduling:
    """A worker begins with half of the files, so that what their tests share is built once, and ends with the other's.

    What xdist does of itself hands out hundreds of tests at once and leaves them there, minutes of commands among them.
    """
    return WorkStealingScheduling(config, log)
