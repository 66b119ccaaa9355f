"""Chunks made by processes of this machine, for systems that make one run at a time; or in this one."""

from collections.abc import Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.families.jobs import Jobs, System
from fmu_models.simulation.rows import RunRows

if TYPE_CHECKING:
    from ctypes import Array, c_int


class Processes:
    """The workers, each with the system that it was sent once. Where only this process works, a chunk is made at once,
    and an interrupt reaches the system itself; others hear of it by ``stop``."""

    def __init__(self, system: System, workers: int) -> None:
        context = get_context("spawn")  # threads of BLAS do not survive a fork
        self._system, self._workers, self._stop = system, workers, context.RawArray("i", 1)
        self._pool = ProcessPoolExecutor(workers, context, _receive, (system, self._stop)) if workers > 1 else None

    def threads(self) -> int:
        """How many chunks are made at a time."""
        return self._workers

    def submit(self, jobs: Jobs) -> Future[RunRows]:
        """Have a chunk made.

        Raises:
            StickslipError: the processes cannot be started.
        """
        if self._pool is not None:
            try:
                return self._pool.submit(_make, jobs)
            except BrokenProcessPool as error:
                raise no_workers() from error
        future: Future[RunRows] = Future()
        future.set_result(self._system.run(jobs, np.zeros(1, np.int32)))
        return future

    def interrupted(self, pending: Mapping[Future[RunRows], int]) -> list[tuple[int, RunRows]]:
        """What chunks that are being made come to when all have to end, by their numbers."""
        self._stop[0] = 1
        ended = {k: future.result() for future, k in pending.items() if not future.cancel()}
        return sorted(ended.items())

    def close(self) -> None:
        """End the workers."""
        self._stop[0] = 1
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)


def no_workers() -> StickslipError:
    """Why processes do not start, as a rule."""
    return StickslipError(
        "The worker processes ended before they had made anything. In a script, call below 'if __name__ == "
        '"__main__":\'; otherwise memory may be short: take fewer workers.'
    )


_received: tuple[System, np.ndarray]  # in a worker: the system, and whether to stop


def _receive(system: System, stop: "Array[c_int]") -> None:
    import signal

    import scipy.linalg  # noqa: F401  # has a BLAS of its own
    from threadpoolctl import threadpool_limits

    global _received
    _received = system, np.frombuffer(memoryview(stop), np.int32)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that asks says when to stop
    threadpool_limits(1)


def _make(jobs: Jobs) -> RunRows:
    system, stop = _received
    return system.run(jobs, stop)
