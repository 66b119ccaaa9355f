"""What tests of every folder share."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from typing import Any

import pytest
from threadpoolctl import threadpool_limits
from xdist.scheduler import WorkStealingScheduling

from fmu_models.base.processes import THREADS

# Workers of tests share the cores already: threads of BLAS beside them wait for one another, at a third of the CPU time
# of a fit. What plugins have loaded is told; what is loaded later, in children too, reads the environment.
os.environ.update({name: os.environ.get(name, "1") for name in THREADS})
threadpool_limits(1)


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C does here and in children what it does at a terminal: a shell's background jobs inherit it as ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> WorkStealingScheduling:
    """A worker begins with half of the files, so that what their tests share is built once, and ends with the other's.

    What xdist does of itself hands out hundreds of tests at once and leaves them there, minutes of commands among them.
    """
    return WorkStealingScheduling(config, log)
