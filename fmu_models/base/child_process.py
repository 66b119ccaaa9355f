"""A child process that serves jobs (job_server.py): its pipe, its limits, how long it works, and what it died of.

What is done with several of them is in processes.py.
"""

from __future__ import annotations

import contextlib
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
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from fmu_models.base import job_server
from fmu_models.base.errors import StickslipError
from fmu_models.base.job_server import MEGABYTE, Memory, receive, send

# share of the allowed memory from which a crash is put down to it: allocations fail before the last byte is used
MEMORY_SHARE = 0.8
GRACE = 2.0  # s that a process whose reports ended has to end as well
# what libraries read that compute in threads of their own: OpenMP, and BLAS of every make
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
AHEAD = 1.0  # s of work that a child is given at once: it need not wait for the parent after each job


def kill_session(process: subprocess.Popen[Any]) -> None:
    """Kill a process that leads a session of its own and, where there are process groups, what it started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


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


TIME, MEMORY = 600.0, 4096.0  # limits of a run where none are given, s and MB


@dataclass(frozen=True)
class Limits:
    """What a job in a child process may use: wall time in s, memory in MB beyond Python itself; None, inf: no limit.

    Raises:
        StickslipError: not a positive number, or a limit of memory where there is none to set.
    """

    time: float | None = None
    memory: float | None = None

    def __post_init__(self) -> None:
        for name, value, unit in (("time", self.time, "s"), ("memory", self.memory, "MB")):
            if value == math.inf:
                object.__setattr__(self, name, None)
            elif value is not None and not 0 < value < math.inf:
                raise StickslipError(f"The limit of {name} must be a positive number of {unit}, found {value:g}.")
        if self.memory is not None and not _can_limit_memory():
            raise StickslipError("Memory can be limited on Linux only. Leave the limit of memory out.")

    @classmethod
    def default(cls) -> Limits:
        """Ample for a run, and less than a machine has; memory where it can be limited."""
        return cls(TIME, MEMORY if _can_limit_memory() else None)


class Child:
    """A process, the jobs it has, the first being worked on, until when it may, and the group of jobs that it knows."""

    def __init__(
        self, work: bytes, limits: Limits, threads: int | None, reports: queue.Queue[tuple[Child, bytes | None]]
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
        """Start the clock of the current job."""
        self.since = time.monotonic()
        self.due = math.inf if self.limits.time is None else self.since + self.limits.time

    def end(self) -> None:
        """Kill it and what it started."""
        kill_session(self.process)
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


def cause_of_death(child: Child) -> IsolatedFailure:
    """The cause of death of a child that reports no more, by its exit code and its memory."""
    code, peak = _end_of(child.process)
    if code is None:
        return IsolatedFailure("It broke the connection to its process.", "own")
    limits, memory = child.limits, child.memory
    share = 0.0 if limits.memory is None else MEMORY_SHARE * limits.memory
    doubt = ""
    if share and memory and peak and peak - memory.used > share:
        if peak > memory.peak:
            return out_of_memory(limits, code)
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


def out_of_memory(limits: Limits, code: int | None = None) -> IsolatedFailure:
    """The sentence that the limit of memory ended a job."""
    return IsolatedFailure(f"It needed more than the {limits.memory:g} MB of memory allowed.", "memory", code)


def _listen(child: Child, reports: queue.Queue[tuple[Child, bytes | None]]) -> None:
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
