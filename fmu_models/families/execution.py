"""Who makes the chunks of a family of motions, and where they are kept.

    chunks -> threads, processes, or workers of a cluster -> memory, or a store on the disk -> rows, in order

Only the process that asks for a family writes its store; a chunk is written when it arrives. Without a store no more
chunks are ahead of the one that is waited for than workers need.
"""

from __future__ import annotations

import copy
import dataclasses
import os
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Tabular
from fmu_models.base.version import version
from fmu_models.families import jobs as families
from fmu_models.families.cluster import Cluster
from fmu_models.families.jobs import Chunk, Jobs, System
from fmu_models.families.store import Stage, Store
from fmu_models.simulation.rows import RunRows, joined

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
        """Have a chunk made. StickslipError: the processes cannot be started."""
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


def _receive(system: System, stop: Array[c_int]) -> None:
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


Take = Callable[[int, RunRows], Any]
Result = TypeVar("Result", bound=Tabular)

AHEAD = 4  # chunks per worker that are under way or wait for one before them
TICK = 0.2  # s between looks at the progress


@dataclass(frozen=True)
class Execution:
    """Who makes the runs of an analysis, and where they are kept.

    Attributes:
        workers: Number of threads, or of processes for a calibration. Defaults to the number of cores.
        scheduler: Address of the scheduler of a Dask cluster, whose workers make the chunks instead.
        store: Folder (.zarr) that keeps every chunk when it is finished.
        resume: Go on with an unfinished store; a finished one of the same plan is read in any case.
        overwrite: Replace a store of another plan, or one that is not finished.
    """

    workers: int | None = None
    scheduler: str | None = None
    store: str | os.PathLike[str] | None = None
    resume: bool = False
    overwrite: bool = False


IN_MEMORY = Execution()  # by threads of this process


class Runner:
    """Make the runs of one analysis: by threads, or by a cluster, into memory or a store.

    Args:
        system: The system whose runs they are.
        plan: Arguments of the analysis by name, its own name as "analysis"; with the system it says all that the result
            depends on.
        execution: Who makes the runs, and where they are kept.
        progress: Called with the fraction done of each family, from this thread.

    Raises:
        StickslipError: an address where no scheduler is; a store of another plan, version or model, with the
            difference; a store that is not finished without ``resume`` or ``overwrite``.
    """

    def __init__(
        self,
        system: System,
        plan: Mapping[str, Any] | None = None,
        execution: Execution = IN_MEMORY,
        progress: Callable[[float], Any] = lambda fraction: None,
    ) -> None:
        self.system, self.workers, self.progress = system, execution.workers or os.cpu_count() or 1, progress
        self.provenance: dict[str, Any] = {}
        if plan is not None:
            self.provenance = {"stickslip": version(), **{n: _described(v) for n, v in plan.items()}}
            try:
                self.provenance["system"] = system.identity()
            except StickslipError:
                if execution.store is not None:  # without one nobody asks later which system it was
                    raise
        self.store: Store | None = None
        self.held: dict[str, float] = {}
        self.cluster: Cluster | Processes | None = None
        if execution.store is not None:
            self.store = Store.open(Path(execution.store), self.provenance, execution.resume, execution.overwrite)
        if execution.scheduler is not None:
            self.cluster = Cluster(execution.scheduler, system)
        elif system.alone:
            self.cluster = Processes(system, self.workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self.cluster is not None:
            self.cluster.close()
        if self.store is not None and isinstance(error, KeyboardInterrupt):
            error.add_note(f"Finished chunks are in '{self.store.path}'. Go on: --resume (in Python resume=True).")

    def finish(self, result: Result) -> Result:
        """Store the result next to the runs it was computed from."""
        if self.store is not None:
            self.store.finish(result.to_xarray())
        return result

    def holding(self, **values: float) -> Self:
        """The same who makes them, of runs at other values of parameters, which are not stored."""
        runner = copy.copy(self)
        runner.held, runner.store = values, None
        return runner

    def make(self, jobs: Jobs, *, quiet: bool = False) -> RunRows:
        """All rows at once; ``quiet``: without a word of progress."""
        chunks: list[RunRows] = []
        begins: list[int] = []

        def take(first: int, rows: RunRows) -> None:
            begins.append(first)
            chunks.append(rows)

        self.each(jobs, take, quiet=quiet)
        return joined(chunks, begins)

    def each(self, jobs: Jobs, take: Take, *, quiet: bool = False) -> None:
        """The rows chunk by chunk: ``take`` is called with the number of the first run of each, in order; when it
        returns True the family ends. StickslipError: values that parameters cannot have, and as ``run`` does;
        KeyboardInterrupt ends all threads within a step."""
        held = {name: np.full(len(jobs), value) for name, value in self.held.items()}
        jobs = dataclasses.replace(jobs, varied={**held, **jobs.varied}) if held else jobs
        for name, values in jobs.varied.items():
            self.system.check(name, values)
        chunks = jobs.chunks(self.system.together, self.system.pace, far=bool(self.store or self.cluster))
        sink = self.store.stage(jobs) if self.store else _InMemory(self._ahead if jobs.chain == 1 else len(chunks))
        self._run(jobs, chunks, sink, take, quiet)

    @property
    def _ahead(self) -> int:
        return (AHEAD if self.system.pace else 1) * (self.cluster.threads() if self.cluster else self.workers)

    def _run(self, jobs: Jobs, chunks: Sequence[Chunk], sink: _InMemory | Stage, take: Take, quiet: bool) -> None:
        """Have all chunks made that are not kept yet, and taken in order."""
        ready = deque(k for k in range(len(chunks)) if not sink.has(k) and (not chunks[k].follows or sink.has(k - 1)))
        pending: dict[Future[RunRows], int] = {}
        stop = np.zeros(1, np.int32)
        pool, taken = ThreadPoolExecutor(max(1, min(self.workers, len(chunks))), "runs"), 0
        try:
            while True:
                while taken < len(chunks) and sink.has(taken):
                    if take(chunks[taken].begin, sink.get(taken)) is True:
                        return
                    taken += 1
                    # a link may still ask where this one ended
                    sink.forget(taken - 2)
                if not ready and not pending:
                    return
                while ready and len(pending) < self._ahead and (sink.has_room() or not pending):
                    k = ready.popleft()
                    part = self._part(jobs, chunks, k, sink)
                    future = self.cluster.submit(part) if self.cluster else pool.submit(self.system.run, part, stop)
                    pending[future] = k
                for future in wait(pending, TICK, FIRST_COMPLETED).done:
                    k, rows = pending.pop(future), future.result()
                    if families.STOPPED in rows.outcomes:
                        take(chunks[k].begin, rows)
                        raise KeyboardInterrupt
                    sink.put(k, rows)
                    if k + 1 < len(chunks) and chunks[k + 1].follows and not sink.has(k + 1):
                        ready.appendleft(k + 1)
                if not quiet:
                    self.progress(sink.count / len(chunks))
        except KeyboardInterrupt:
            if isinstance(self.cluster, Processes):
                for k, rows in self.cluster.interrupted(pending):
                    take(chunks[k].begin, rows)
            raise
        except BrokenProcessPool as error:
            raise no_workers() from error
        finally:
            stop[0] = 1
            pool.shutdown(cancel_futures=True)
            for future in pending:
                future.cancel()

    def _part(self, jobs: Jobs, chunks: Sequence[Chunk], k: int, sink: _InMemory | Stage) -> Jobs:
        """The jobs of a chunk; chains go on where they ended in the chunk before, those that failed do not."""
        chunk_jobs = jobs.part(chunks[k].begin, chunks[k].end)
        if chunks[k].follows:
            before, chains = sink.get(k - 1), jobs.beside
            sound = before.outcomes[-chains:] <= families.ABSORBED
            starts = chunk_jobs.starts.copy()
            starts[:chains][sound] = before.ends[-chains:][sound]
            chunk_jobs = dataclasses.replace(chunk_jobs, starts=starts, resumed=sound)
        return chunk_jobs


class _InMemory:
    """Chunks that wait in memory until all before them have been taken."""

    def __init__(self, room: int) -> None:
        self.room, self.count = room, 0
        self.rows: dict[int, RunRows] = {}

    def has(self, k: int) -> bool:
        return k in self.rows

    def has_room(self) -> bool:
        return len(self.rows) < self.room

    def get(self, k: int) -> RunRows:
        return self.rows[k]

    def put(self, k: int, rows: RunRows) -> None:
        self.rows[k] = rows
        self.count += 1

    def forget(self, k: int) -> None:
        self.rows.pop(k, None)


def _described(value: object) -> object:
    """An argument as JSON; of an array how many values, from where to where, and their hash."""
    if isinstance(value, np.ndarray):
        ends = [value.ravel()[0].item(), value.ravel()[-1].item()] if value.size else []
        return {"values": value.size, "ends": ends, "digest": families.digest(value.tobytes())}
    if isinstance(value, Mapping):
        return {str(name): _described(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_described(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value
