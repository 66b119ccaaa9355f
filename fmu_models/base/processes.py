"""Functions run in processes of their own: what kills or stops one of them is one failed job here.

The children are servers of jobs (job_server.py). This guards against faults, not against malice: the child may do
whatever the user may.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Self, TypeVar

from fmu_models.base import job_server
from fmu_models.base.errors import StickslipError
from fmu_models.base.job_server import MEGABYTE, Memory, Work, receive, send

Value = TypeVar("Value")

# share of the allowed memory from which a crash is put down to it: allocations fail before the last byte is used
MEMORY_SHARE = 0.8
GRACE = 2.0  # s that a process whose reports ended has to end as well
# what libraries read that compute in threads of their own: OpenMP, and BLAS of every make
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
AHEAD = 1.0  # s of work that a child is given at once: it need not wait for the parent after each job
LOOKS_PER_SECOND = 5  # of the parent, for Ctrl-C (Windows waits deaf otherwise) and for the end of the child


class IsolatedFailure(StickslipError):
    """A job in a child process did not come back; the text says why.

    Attributes:
        cause: "time" or "memory": more than its limits; "killed": from outside; "own": the function ended its process,
            by a crash, an exit or a broken connection.
        code: of the exit, negative for a signal; None if the process was stopped here.
        seconds: of the job until then.
    """

    def __init__(self, text: str, cause: str, code: int | None = None) -> None:
        super().__init__(text)
        self.cause, self.code, self.seconds = cause, code, 0.0


@dataclass(frozen=True)
class Limits:
    """What a job in a child process may use: wall time in s, memory in MB beyond Python itself; None, inf: no limit.

    Raises:
        StickslipError: not a positive number, or a limit of memory where there is none to set.
    """

    time: float | None = None
    memory: float | None = None

    def __post_init__(self) -> None:
        for what, value, unit in (("time", self.time, "s"), ("memory", self.memory, "MB")):
            if value == math.inf:
                object.__setattr__(self, what, None)
            elif value is not None and not 0 < value < math.inf:
                raise StickslipError(f"The limit of {what} must be a positive number of {unit}, found {value:g}.")
        if self.memory is not None and not _can_limit_memory():
            raise StickslipError("Memory can be limited on Linux only. Leave the limit of memory out.")

    @classmethod
    def default(cls) -> Limits:
        """Ample for a run, and less than a machine has: 600 s, and 4096 MB where memory can be limited."""
        return cls(600.0, 4096.0 if _can_limit_memory() else None)


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
    with Pool(function, processes=min(processes, len(jobs)), limits=limits, threads=threads, progress=progress) as pool:
        yield from pool.run(jobs, group=group)


class Pool(Generic[Value]):
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
        self._reports: queue.Queue[tuple[_Child, bytes | None]] = queue.Queue()
        self._children: list[_Child] = []
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
                    self._give(child, jobs, waiting)
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

    def _start(self, most: int) -> None:
        """Children up to that number."""
        for _ in range(len(self._children), min(self.processes, most)):
            self._children.append(_Child(self._work, self.limits, self.threads, self._reports))

    def _give(self, child: _Child, jobs: Sequence[tuple[Any, ...]], waiting: dict[Hashable, deque[int]]) -> None:
        """Some jobs of one group, if it has too few: fewer at a time towards the end, so that all end together."""
        left = sum(map(len, waiting.values()))
        wanted = max(1, min(child.pace(), left // (2 * len(self._children))))
        if left and not child.jobs:
            child.group = self._next_group(child, waiting)
        while len(child.jobs) < wanted and waiting.get(child.group):
            number = waiting[child.group].popleft()
            child.give(number, jobs[number])

    def _next_group(self, child: _Child, waiting: dict[Hashable, deque[int]]) -> Hashable:
        """The group that a child knows already, else one that nobody works on, else that with the most jobs left."""
        if waiting.get(child.group):
            return child.group
        taken = {other.group for other in self._children}
        return max(waiting, key=lambda group: (bool(waiting[group]), group not in taken, len(waiting[group])))

    def _next_outcome(self) -> tuple[_Child, Any]:
        """The next child that is done with a job, and the value or the error."""
        while True:
            child, report = self._next_report()
            if report is not None and not report:
                text = f"It did not end within {child.limits.time:g} s and was stopped: it hangs, or needs more time."
                return child, IsolatedFailure(text, "time")
            try:
                kind, content = pickle.loads(report or b"")
            except Exception:  # it ended, or wrote something else between the reports
                return child, _cause_of_death(child)
            if kind == "started":
                # loading Python is no work of the function
                child.memory = content
                child.begin()
            elif kind == "progress" and self.progress:
                self.progress(content)
            elif kind == "done":
                return child, content
            elif kind == "memory":
                return child, _out_of_memory(child.limits)
            elif kind == "fault":
                return child, RuntimeError(f"the isolated function failed:\n{content}")

    def _next_report(self) -> tuple[_Child, bytes | None]:
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


class _Child:
    """A process, the jobs it has, the first being worked on, until when it may, and the group of jobs that it knows."""

    def __init__(
        self,
        work: bytes,
        limits: Limits,
        threads: int | None,
        reports: queue.Queue[tuple[_Child, bytes | None]],
    ) -> None:
        self.limits = limits
        self.group: Hashable = None
        self.jobs: deque[int] = deque()
        self.since, self.due = 0.0, math.inf
        self.seconds = 0.0  # of its last job
        self.finished, self.worked = 0, 0.0  # jobs, and s for all
        self.memory: Memory | None = None
        self.last: float | None = None  # when its reports end at the latest, once it has ended itself
        self.process = subprocess.Popen(
            # -P: no module of the working folder stands in for one of ours
            [sys.executable, "-P", "-m", job_server.__name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={
                **os.environ,
                **({} if threads is None else dict.fromkeys(THREADS, str(threads))),
                "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path),
            },
            start_new_session=True,
        )
        self.listener = threading.Thread(target=_listen, args=(self, reports), daemon=True)
        self.listener.start()
        self._send(work)

    def give(self, number: int, job: tuple[Any, ...]) -> None:
        """Let it work on a job, after those that it has."""
        self.jobs.append(number)
        if len(self.jobs) == 1:
            self.begin()
        self._send(pickle.dumps(job, protocol=5))

    def done(self) -> int:
        """It has ended its first job, one way or the other: the number of that; the next one begins."""
        self.seconds = time.monotonic() - self.since
        self.finished, self.worked = self.finished + 1, self.worked + self.seconds
        number = self.jobs.popleft()
        self.begin()
        return number

    def pace(self) -> int:
        """Jobs that it does in the time of AHEAD; 1 while nobody knows."""
        return int(AHEAD * self.finished / self.worked) if self.worked else 1

    def begin(self) -> None:
        """From now on its time counts."""
        self.since = time.monotonic()
        self.due = math.inf if self.limits.time is None else self.since + self.limits.time

    def end(self) -> None:
        """Kill it and, where there are process groups, what it started."""
        if hasattr(os, "killpg"):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        else:
            self.process.kill()
        self.process.wait()
        assert self.process.stdin
        assert self.process.stdout
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        # a process that the child left behind may hold the other end; closing would wait for it
        self.listener.join(GRACE)
        if not self.listener.is_alive():
            self.process.stdout.close()

    def ended(self, now: float) -> bool:
        """Whether the process has ended, and had its time to end its reports: what it left behind may keep the pipe."""
        if self.last is None:
            process = self.process
            if process.returncode is None and hasattr(os, "waitid"):
                over = os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
            else:
                over = process.poll() is not None
            self.last = now + GRACE if over else None
        return self.last is not None and now >= self.last

    def _send(self, data: bytes) -> None:
        assert self.process.stdin
        # if it dies before it listens, its exit code tells how
        with contextlib.suppress(BrokenPipeError):
            send(self.process.stdin, data)


def _cause_of_death(child: _Child) -> IsolatedFailure:
    code, peak = _end_of(child.process)
    if code is None:
        return IsolatedFailure("It broke the connection to its process.", "own")
    limits, memory = child.limits, child.memory
    share = 0.0 if limits.memory is None else MEMORY_SHARE * limits.memory
    doubt = ""
    if share and memory and peak and peak - memory.used > share:
        if peak > memory.peak:
            return _out_of_memory(limits, code)
        doubt = f" Or it needed more than the {limits.memory:g} MB of memory allowed, and did not look."
    if code == -getattr(signal, "SIGKILL", 9):
        text = "The process of the run was killed from outside, most likely because the machine ran out of memory."
        return IsolatedFailure(text, "killed", code)
    if code < 0:
        name = signal.Signals(-code).name if -code in signal.valid_signals() else f"signal {-code}"
        meaning = {"SIGSEGV": "segmentation fault", "SIGABRT": "abort", "SIGFPE": "arithmetic fault"}.get(name)
        text = f"It crashed ({name}{', ' + meaning if meaning else ''})."
    else:
        text = f"It ended the process of the run (exit code {code:#x})."
    return IsolatedFailure(f"{text}{doubt}", "own", code)


def _end_of(child: subprocess.Popen[bytes]) -> tuple[int | None, float | None]:
    """Exit code (None: it goes on) and peak memory in MB, where it is known."""
    if child.returncode is not None or not hasattr(os, "wait4"):
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(GRACE)
        return child.returncode, None
    deadline = time.monotonic() + GRACE
    while time.monotonic() < deadline:
        number, status, usage = os.wait4(child.pid, os.WNOHANG)
        if number:
            child.returncode = os.waitstatus_to_exitcode(status)
            return child.returncode, usage.ru_maxrss / (1024 if sys.platform == "linux" else MEGABYTE)
        time.sleep(0.005)
    return None, None


def _out_of_memory(limits: Limits, code: int | None = None) -> IsolatedFailure:
    return IsolatedFailure(f"It needed more than the {limits.memory:g} MB of memory allowed.", "memory", code)


def _listen(child: _Child, reports: queue.Queue[tuple[_Child, bytes | None]]) -> None:
    assert child.process.stdout
    try:
        while report := receive(child.process.stdout):
            reports.put((child, report))
    except (OSError, ValueError, MemoryError, OverflowError):
        pass  # closed, or a length that a library gone wild has written
    finally:
        reports.put((child, None))


def _can_limit_memory() -> bool:
    # elsewhere the limit is missing (Windows) or not enforced (macOS)
    return sys.platform == "linux"
