"""Functions run in processes of their own: what kills or stops one of them is one failed job here.

The children are servers of jobs (child_process.py). This guards against faults, not against malice: the child may do
whatever the user may.
"""

import contextlib
import functools
import pickle
import queue
import time
from collections import deque
from collections.abc import Callable, Generator, Hashable, Sequence
from typing import Any, Generic, Self, TypeVar

from fmu_models.base.child_process import Child, IsolatedFailure, Limits, cause_of_death, out_of_memory
from fmu_models.base.job_server import Work

Value = TypeVar("Value")

LOOKS_PER_SECOND = 5  # of the parent, for Ctrl-C (Windows waits deaf otherwise) and for the end of the child


def isolated(
    function: Callable[..., Value],
    *arguments: object,
    limits: Limits | None = None,
    progress: Callable[[float], None] | None = None,
    **keywords: object,
) -> Value:
    """``function(*arguments, **keywords)`` in a child process.

    Args:
        function: of a module that can be imported; it, its arguments and its value can be pickled (an Fmu can).
        limits: of time and memory.
        progress: called here with what the function passes to its own ``progress`` (given to it if this is given).

    Raises:
        IsolatedFailure: the child crashed, took too long or too much memory.
        StickslipError: whatever the function raised for the user.
        RuntimeError: an error of the program in the child, with its traceback.
    """
    call = functools.partial(function, *arguments, **keywords)
    ((_, outcome),) = in_processes(call, [()], processes=1, limits=limits, progress=progress)
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def in_processes(
    function: Callable[..., Value],
    jobs: Sequence[tuple[Any, ...]],
    *,
    processes: int,
    limits: Limits | None = None,
    threads: int | None = None,
    group: Callable[..., Hashable] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Generator[tuple[int, Value | Exception], None, None]:
    """``function(*job)`` for every job, in child processes that stay, as they are finished.

    Args:
        function: as for ``isolated``; each child gets it once and keeps it, with what it remembers.
        processes: number of children, at most; one that dies is replaced.
        limits: of the time of a job and of the memory of a child.
        threads: of BLAS and OpenMP in each child, which share the cores already; None leaves them as they are.
        group: of a job, ``group(*job)``: a child goes on with the group that it knows while that has jobs.
        progress: as for ``isolated``.

    Yields:
        Index of the job, and its value or an error: those that ``isolated`` raises. Ending the iteration, or an
        interrupt, ends the children.
    """
    with ProcessPool(
        function, processes=min(processes, len(jobs)), limits=limits, threads=threads, progress=progress
    ) as pool:
        yield from pool.run(jobs, group=group)


class ProcessPool(Generic[Value]):
    """Child processes for one function: they start at once, so that they are ready when the jobs are known, and stay.

    Args:
        function, processes, limits, threads, progress: as for ``in_processes``.
    """

    def __init__(
        self,
        function: Callable[..., Value],
        *,
        processes: int,
        limits: Limits | None = None,
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        self.limits, self.processes, self.threads, self.progress = limits or Limits(), processes, threads, progress
        self._work = pickle.dumps(Work(function, self.limits.memory, progress is not None), protocol=5)
        self._reports: queue.Queue[tuple[Child, bytes | None]] = queue.Queue()
        self._children: list[Child] = []
        try:
            self._start(processes)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the children, whatever they are at."""
        while self._children:
            self._children.pop().end()

    def run(
        self, jobs: Sequence[tuple[Any, ...]], *, group: Callable[..., Hashable] | None = None
    ) -> Generator[tuple[int, Value | Exception], None, None]:
        """The jobs as they are finished; as ``in_processes``."""
        waiting: dict[Hashable, deque[int]] = {}
        for number, job in enumerate(jobs):
            waiting.setdefault(group(*job) if group else None, deque()).append(number)
        try:
            for finished in range(len(jobs)):
                self._start(len(jobs) - finished)
                # one for each before the second for any
                for child in sorted(self._children, key=lambda child: len(child.jobs)):
                    self._assign(child, jobs, waiting)
                child, outcome = self._next_outcome()
                number = child.done()
                if isinstance(outcome, IsolatedFailure):
                    outcome.seconds = child.seconds
                    waiting[child.group].extendleft(reversed(child.jobs))
                    self._children.remove(child)
                    child.end()
                yield number, outcome
        except BaseException:
            self.close()
            raise

    def _start(self, count: int) -> None:
        """Children up to that number."""
        for _ in range(len(self._children), min(self.processes, count)):
            self._children.append(Child(self._work, self.limits, self.threads, self._reports))

    def _assign(self, child: Child, jobs: Sequence[tuple[Any, ...]], waiting: dict[Hashable, deque[int]]) -> None:
        """Some jobs of one group, if it has too few: fewer at a time towards the end, so that all end together."""
        remaining = sum(map(len, waiting.values()))
        target = max(1, min(child.pace(), remaining // (2 * len(self._children))))
        if remaining and not child.jobs:
            child.group = self._next_group(child, waiting)
        while len(child.jobs) < target and waiting.get(child.group):
            number = waiting[child.group].popleft()
            child.give(number, jobs[number])

    def _next_group(self, child: Child, waiting: dict[Hashable, deque[int]]) -> Hashable:
        """The group that a child knows already, else one that nobody works on, else that with the most jobs left."""
        if waiting.get(child.group):
            return child.group
        taken = {worker.group for worker in self._children}
        return max(waiting, key=lambda group: (bool(waiting[group]), group not in taken, len(waiting[group])))

    def _next_outcome(self) -> tuple[Child, Any]:
        """The next child that is done with a job, and the value or the error."""
        while True:
            child, report = self._next_report()
            if report is not None and not report:
                text = f"It did not end within {child.limits.time:g} s and was stopped: it hangs, or needs more time."
                return child, IsolatedFailure(text, "time")
            try:
                kind, content = pickle.loads(report or b"")
            except Exception:  # it ended, or wrote something else between the reports
                return child, cause_of_death(child)
            if kind == "started":
                # loading Python is no work of the function
                child.memory = content
                child.begin()
            elif kind == "progress" and self.progress:
                self.progress(content)
            elif kind == "done":
                return child, content
            elif kind == "memory":
                return child, out_of_memory(child.limits)
            elif kind == "fault":
                return child, RuntimeError(f"the isolated function failed:\n{content}")

    def _next_report(self) -> tuple[Child, bytes | None]:
        """A child and its next report; none if no more can come, empty if the time of its job is over."""
        while True:
            busy = [child for child in self._children if child.jobs]
            now = time.monotonic()
            if self._reports.empty():  # what has come counts, however long nobody looked
                for child in busy:
                    if now >= child.due:
                        return child, b""
                    if child.ended(now):
                        return child, None
            with contextlib.suppress(queue.Empty):
                wait = min(1 / LOOKS_PER_SECOND, *(max(0.0, child.due - now) for child in busy))
                child, report = self._reports.get(timeout=wait)
                if child in busy or (child in self._children and report):
                    return child, report
