"""Functions run in processes of their own: what kills or stops one of them is one failed job here.

    parent                                   child (python -m fmu_models.base.processes)
    starts the child, sends the function ->  imports it, then lowers its limit of memory
    sends a job                          ->  calls the function
    shows progress, watches the clock    <-  reports the fraction done
    takes the value or the reason        <-  sends the value, or the error; waits for the next job
    on time out, interrupt, error: kills     on the end of its standard input: the parent is gone, ends

What a job prints goes to standard error; standard output carries the reports alone. This guards against faults, not
against malice: the child may do whatever the user may.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Hashable, Sequence
from dataclasses import dataclass
from typing import IO, Any, TypeVar

from fmu_models.base.errors import StickslipError

Value = TypeVar("Value")

LENGTH = struct.Struct("<Q")
MEGABYTE = 1 << 20
# share of the allowed memory from which a crash is put down to it: allocations fail before the last byte is used
MEMORY_SHARE = 0.8
GRACE = 2.0  # s that a process whose reports ended has to end as well
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
    limits = limits or Limits()
    work = pickle.dumps(_Work(function, limits.memory, threads, progress is not None), protocol=5)
    waiting: dict[Hashable, deque[int]] = {}
    for number, job in enumerate(jobs):
        waiting.setdefault(group(*job) if group else None, deque()).append(number)
    reports: queue.Queue[tuple[_Child, bytes | None]] = queue.Queue()
    children: list[_Child] = []
    try:
        for _ in range(len(jobs)):
            idle = [child for child in children if child.job is None]
            while any(waiting.values()) and (idle or len(children) < processes):
                if not idle:
                    idle.append(_Child(work, limits, reports))
                    children += idle
                child = idle.pop()
                child.group = _next_group(child, children, waiting)
                number = waiting[child.group].popleft()
                child.give(number, jobs[number])
            child, outcome = _next_outcome(children, reports, progress)
            number, child.job = child.job, None
            if isinstance(outcome, IsolatedFailure):
                outcome.seconds = time.monotonic() - child.since
                children.remove(child)
                child.end()
            assert number is not None
            yield number, outcome
    finally:
        for child in children:
            child.end()


def _next_group(child: _Child, children: list[_Child], waiting: dict[Hashable, deque[int]]) -> Hashable:
    """The group that a child knows already, else one that nobody works on, else that with the most jobs left."""
    if waiting.get(child.group):
        return child.group
    taken = {other.group for other in children}
    return max(waiting, key=lambda group: (bool(waiting[group]), group not in taken, len(waiting[group])))


@dataclass(frozen=True)
class _Work:
    function: Callable[..., Any]
    memory: float | None
    threads: int | None
    progress: bool


@dataclass(frozen=True)
class _Memory:
    """MB in use when the function begins, and the peak until then: that of the parent, if it was larger."""

    used: float
    peak: float


class _Child:
    """A process, the job it works on and until when it may, and the group of jobs that it knows."""

    def __init__(self, work: bytes, limits: Limits, reports: queue.Queue[tuple[_Child, bytes | None]]) -> None:
        self.limits = limits
        self.group: Hashable = None
        self.job: int | None = None
        self.since, self.due = 0.0, math.inf
        self.memory: _Memory | None = None
        self.last: float | None = None  # when its reports end at the latest, once it has ended itself
        self.process = subprocess.Popen(
            # -P: no module of the working folder stands in for one of ours
            [sys.executable, "-P", "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)},
            start_new_session=True,
        )
        self.listener = threading.Thread(target=_listen, args=(self, reports), daemon=True)
        self.listener.start()
        self._send(work)

    def give(self, number: int, job: tuple[Any, ...]) -> None:
        """Let it work on a job."""
        self.job = number
        self.begin()
        self._send(pickle.dumps(job, protocol=5))

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
            _send(self.process.stdin, data)


def _next_outcome(
    children: list[_Child],
    reports: queue.Queue[tuple[_Child, bytes | None]],
    progress: Callable[[float], None] | None,
) -> tuple[_Child, Any]:
    """The next child that is done with its job, and the value or the error."""
    while True:
        child, report = _next_report(children, reports)
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
        elif kind == "progress" and progress:
            progress(content)
        elif kind == "done":
            return child, content
        elif kind == "memory":
            return child, _out_of_memory(child.limits)
        elif kind == "fault":
            return child, RuntimeError(f"the isolated function failed:\n{content}")


def _next_report(
    children: list[_Child], reports: queue.Queue[tuple[_Child, bytes | None]]
) -> tuple[_Child, bytes | None]:
    """A child at work and its next report; none if no more can come, empty if its time is over."""
    while True:
        busy = [child for child in children if child.job is not None]
        now = time.monotonic()
        for child in busy:
            if now >= child.due:
                return child, b""
            if child.ended(now):
                return child, None
        with contextlib.suppress(queue.Empty):
            wait = min(1 / LOOKS_PER_SECOND, *(child.due - now for child in busy))
            child, report = reports.get(timeout=wait)
            if child in busy:
                return child, report


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
        while report := _receive(child.process.stdout):
            reports.put((child, report))
    except (OSError, ValueError, MemoryError, OverflowError):
        pass  # closed, or a length that a library gone wild has written
    finally:
        reports.put((child, None))


def _send(stream: IO[bytes], data: bytes) -> None:
    stream.write(LENGTH.pack(len(data)))
    stream.write(data)
    stream.flush()


def _receive(stream: IO[bytes]) -> bytes | None:
    """The next report, or None at the end of the stream or of a report cut short."""
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (size,) = LENGTH.unpack(head)
    data = stream.read(size)
    return data if len(data) == size else None


def _can_limit_memory() -> bool:
    # elsewhere the limit is missing (Windows) or not enforced (macOS)
    return sys.platform == "linux"


def _limit_memory(megabytes: float) -> _Memory:
    import resource

    with open("/proc/self/statm", encoding="ascii") as file:
        reserved, used = (int(pages) * resource.getpagesize() for pages in file.read().split()[:2])
    limit = reserved + int(megabytes * MEGABYTE)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    # Linux hands the peak of the parent on to the child it starts
    return _Memory(used / MEGABYTE, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def _take(calls: queue.SimpleQueue[bytes]) -> None:
    """What the parent sends; nobody is left to read a result once standard input ends."""
    while (call := _receive(sys.stdin.buffer)) is not None:
        calls.put(call)
    os._exit(1)


def _main() -> None:
    # reports leave through a copy: what a job prints must not come between them
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    # the terminal sends Ctrl-C to both; the parent decides, and kills
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_take, args=(calls,), daemon=True).start()
    lock = threading.Lock()

    def report(kind: str, content: object) -> None:
        with lock:
            _send(out, pickle.dumps((kind, content), protocol=5))

    packed = calls.get()
    work: Any = None
    while True:
        job = calls.get()
        try:
            if work is None:
                work = pickle.loads(packed)
                report("started", None if work.memory is None else _limit_memory(work.memory))
            keywords = {"progress": lambda fraction: report("progress", fraction)} if work.progress else {}
            with _limited_threads(work.threads):
                report("done", work.function(*pickle.loads(job), **keywords))
        except StickslipError as error:
            report("done", error)
        except MemoryError:
            report("memory", None)
        except BaseException:
            report("fault", traceback.format_exc())


def _limited_threads(threads: int | None) -> contextlib.AbstractContextManager[object]:
    """With each job anew: it limits the libraries that are loaded by then."""
    if threads is None:
        return contextlib.nullcontext()
    from threadpoolctl import threadpool_limits

    return threadpool_limits(threads)


if __name__ == "__main__":
    # the instance of this module that the work was pickled with, not __main__
    from fmu_models.base import processes

    processes._main()
