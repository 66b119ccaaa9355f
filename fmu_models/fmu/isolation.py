"""Run a function in a process of its own: what kills or stops an FMU there is one failed run here.

    parent                                   child (python -m fmu_models.fmu.isolation)
    starts the child, sends the call   ->    imports the function, then lowers its limit of memory
    shows progress, watches the clock  <-    reports the fraction done
    takes the value or the reason      <-    sends the value, or the error
    on time out, interrupt or error: kills   on the end of its standard input: the parent is gone, ends

What the FMU prints goes to standard error; standard output carries the reports alone. This guards against faults, not
against malice: the child may do whatever the user may.
"""

from __future__ import annotations

import contextlib
import importlib
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
from collections.abc import Callable
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
    """The run in the child process did not come back; the text says why."""


@dataclass(frozen=True)
class Limits:
    """What a run in a child process may use: wall time in s, memory in MB beyond Python itself; None, inf: no limit.

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
    limits = limits or Limits()
    call = _Call(function.__module__, function.__qualname__, arguments, keywords, limits.memory, progress is not None)
    child = subprocess.Popen(
        # -P: no module of the working folder stands in for one of ours
        [sys.executable, "-P", "-m", __name__],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)},
        start_new_session=True,
    )
    reports: queue.Queue[bytes | None] = queue.Queue()
    assert child.stdin
    assert child.stdout
    listener = threading.Thread(target=_listen, args=(child.stdout, reports), daemon=True)
    listener.start()
    try:
        # if it dies before it listens, its exit code tells how
        with contextlib.suppress(BrokenPipeError):
            _send(child.stdin, call)
        return _conversation(child, reports, limits, progress)
    finally:
        _kill(child)
        child.wait()
        with contextlib.suppress(OSError):
            child.stdin.close()
        # a process that the FMU left behind may hold the other end; closing would wait for it
        listener.join(GRACE)
        if not listener.is_alive():
            child.stdout.close()


def _kill(child: subprocess.Popen[bytes]) -> None:
    """The child and, where there are process groups, what the FMU started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)
    else:
        child.kill()


@dataclass(frozen=True)
class _Call:
    module: str
    name: str
    arguments: tuple[object, ...]
    keywords: dict[str, object]
    memory: float | None
    progress: bool


@dataclass(frozen=True)
class _Memory:
    """MB in use when the function begins, and the peak until then: that of the parent, if it was larger."""

    used: float
    peak: float


def _conversation(
    child: subprocess.Popen[bytes],
    reports: queue.Queue[bytes | None],
    limits: Limits,
    progress: Callable[[float], None] | None,
) -> Any:
    deadline = None if limits.time is None else time.monotonic() + limits.time
    memory = None
    while True:
        report = _next(child, reports, deadline, limits)
        try:
            kind, content = pickle.loads(report or b"")
        except Exception:  # it ended, or wrote something else between the reports
            raise IsolatedFailure(_cause_of_death(child, limits, memory)) from None
        if kind == "started":
            # loading Python is no work of the FMU
            memory = content
            deadline = None if limits.time is None else time.monotonic() + limits.time
        elif kind == "progress" and progress:
            progress(content)
        elif kind == "value":
            return content
        elif kind == "error":
            raise content
        elif kind == "memory":
            raise IsolatedFailure(_out_of_memory(limits))
        elif kind == "fault":
            raise RuntimeError(f"the isolated function failed:\n{content}")


def _next(
    child: subprocess.Popen[bytes], reports: queue.Queue[bytes | None], deadline: float | None, limits: Limits
) -> bytes | None:
    """The next report; None if no more can come."""
    last = None
    while True:
        wait = 1 / LOOKS_PER_SECOND
        now = time.monotonic()
        if deadline is not None:
            if now >= deadline:
                raise IsolatedFailure(
                    f"The run did not end within {limits.time:g} s and was stopped: the FMU hangs, or needs more time. "
                    "Allow it more, or ask for a shorter run."
                )
            wait = min(wait, deadline - now)
        if last is None and _ended(child):
            last = now + GRACE  # what it left behind may keep the pipe open without end
        if last is not None and now >= last:
            return None
        with contextlib.suppress(queue.Empty):
            return reports.get(timeout=wait)


def _ended(child: subprocess.Popen[bytes]) -> bool:
    if child.returncode is None and hasattr(os, "waitid"):
        return os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
    return child.poll() is not None


def _cause_of_death(child: subprocess.Popen[bytes], limits: Limits, memory: _Memory | None) -> str:
    code, peak = _end_of(child)
    if code is None:
        return "The FMU broke the connection to the process of the run. The fault is in its library."
    share = 0.0 if limits.memory is None else MEMORY_SHARE * limits.memory
    doubt = ""
    if share and memory and peak and peak - memory.used > share:
        if peak > memory.peak:
            return _out_of_memory(limits)
        doubt = f" Or it needed more than the {limits.memory:g} MB of memory allowed, and did not look."
    if code == -getattr(signal, "SIGKILL", 9):
        return "The process of the run was killed from outside, most likely because the machine ran out of memory."
    if code < 0:
        name = signal.Signals(-code).name if -code in signal.valid_signals() else f"signal {-code}"
        meaning = {"SIGSEGV": "segmentation fault", "SIGABRT": "abort", "SIGFPE": "arithmetic fault"}.get(name)
        text = f"The FMU crashed ({name}{', ' + meaning if meaning else ''})."
    else:
        text = f"The FMU ended the process of the run (exit code {code:#x})."
    return f"{text} The fault is in its library; report it to its author.{doubt}"


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


def _out_of_memory(limits: Limits) -> str:
    return f"The run needed more than the {limits.memory:g} MB of memory allowed. Allow it more, or mend the FMU."


def _listen(stream: IO[bytes], reports: queue.Queue[bytes | None]) -> None:
    try:
        while (report := _receive(stream)) is not None:
            reports.put(report)
    except (OSError, ValueError, MemoryError, OverflowError):
        pass  # closed, or a length that a library gone wild has written
    finally:
        reports.put(None)


def _send(stream: IO[bytes], content: object) -> None:
    data = pickle.dumps(content, protocol=5)
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


def _end_with_the_parent() -> None:
    """Nobody is left to read the result once standard input ends."""
    sys.stdin.buffer.read()
    os._exit(1)


def _main() -> None:
    # reports leave through a copy: what the FMU prints must not come between them
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    # the terminal sends Ctrl-C to both; the parent decides, and kills
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    lock = threading.Lock()

    def report(kind: str, content: object) -> None:
        with lock:
            _send(out, (kind, content))

    try:
        call: _Call = pickle.loads(_receive(sys.stdin.buffer) or b"")
        function: Any = importlib.import_module(call.module)
        for part in call.name.split("."):
            function = getattr(function, part)
        keywords = dict(call.keywords)
        if call.progress:
            keywords["progress"] = lambda fraction: report("progress", fraction)
        threading.Thread(target=_end_with_the_parent, daemon=True).start()
        report("started", None if call.memory is None else _limit_memory(call.memory))
        report("value", function(*call.arguments, **keywords))
    except StickslipError as error:
        report("error", error)
    except MemoryError:
        report("memory", None)
    except BaseException:
        report("fault", traceback.format_exc())
    out.flush()
    # no clean-up by libraries that may be broken by now: the report is out
    os._exit(0)


if __name__ == "__main__":
    # the instance of this module that the call was pickled with, not __main__
    from fmu_models.fmu import isolation

    isolation._main()
