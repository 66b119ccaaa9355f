"""Processes that make chunks: an interrupt ends all of them, and what they had is handed over."""

from __future__ import annotations

import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.families.execution import Execution, Runner
from fmu_models.families.jobs import FINISHED, STOPPED, Jobs
from fmu_models.simulation.rows import RunRows


class Doubling:
    """Twice each start; from the second start on it waits to be stopped, and hands over half of the start then."""

    together, pace, alone = 1, 0, True

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def check(self, name: str, values: np.ndarray) -> None:
        """Nothing varies."""

    def identity(self) -> dict[str, str]:
        return {"doubling": "of starts"}

    def run(self, jobs: Jobs, stop: np.ndarray) -> RunRows:
        rows = RunRows.empty(1, 1, 1, 0)
        rows.points[0], rows.outcomes[0] = 2 * jobs.starts[0], FINISHED
        if jobs.starts[0, 0] > 1:
            (self.folder / "waits").touch()
            while not stop[0]:
                time.sleep(0.01)
            rows.points[0], rows.outcomes[0] = jobs.starts[0] / 2, STOPPED
        return rows


class Dying(Doubling):
    def run(self, jobs: Jobs, stop: np.ndarray) -> RunRows:
        signal.raise_signal(signal.SIGKILL)
        raise AssertionError


def test_an_interrupt_hands_over_what_workers_had(tmp_path):
    def interrupt() -> None:
        while not (tmp_path / "waits").exists() or not taken:
            time.sleep(0.01)
        signal.raise_signal(signal.SIGINT)
        # one that comes while a finalizer runs is lost there, and whoever sits at a terminal presses again
        while not ended.wait(30.0):
            signal.raise_signal(signal.SIGINT)

    taken: list[float] = []
    ended = threading.Event()
    thread = threading.Thread(target=interrupt, daemon=True)
    with pytest.raises(KeyboardInterrupt), Runner(Doubling(tmp_path), execution=Execution(workers=2)) as runner:
        thread.start()
        runner.each(Jobs(np.array([[1.0], [4.0]])), lambda number, rows: taken.append(rows.points.item()))
    ended.set()
    assert taken == [2.0, 2.0]


def test_a_family_ends_when_enough_was_taken(tmp_path):
    """The second start would wait for ever."""
    with Runner(Doubling(tmp_path), execution=Execution(workers=1)) as runner:
        runner.each(Jobs(np.array([[1.0], [4.0]])), lambda number, rows: True)
    assert not (tmp_path / "waits").exists()


def test_workers_that_die_are_said(tmp_path):
    runner = Runner(Dying(tmp_path), execution=Execution(workers=2))
    with pytest.raises(StickslipError, match="worker processes ended"), runner:
        runner.make(Jobs(np.array([[1.0]])))
