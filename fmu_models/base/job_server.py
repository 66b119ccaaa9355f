"""A child process that does jobs for its parent (processes.py).

    parent                                   child (python -m fmu_models.base.job_server)
    starts the child, sends the function ->  imports it, then lowers its limit of memory
    sends a job, and some more ahead     ->  calls the function
    shows progress, watches the clock    <-  reports the fraction done
    takes the value or the reason        <-  sends the value, or the error; takes the next job
    on time out, interrupt, error: kills     on the end of its standard input: the parent is gone, ends

What a job prints goes to standard error; standard output carries the reports alone.
"""

import os
import pickle
import queue
import signal
import struct
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, Any

from fmu_models.base.errors import StickslipError

LENGTH = struct.Struct("<Q")
MEGABYTE = 1 << 20


@dataclass(frozen=True)
class Work:
    """The function that a child is for, its limit of memory in MB, and whether it reports progress."""

    function: Callable[..., Any]
    memory: float | None
    progress: bool


@dataclass(frozen=True)
class Memory:
    """MB in use when the function begins, and the peak until then: that of the parent, if it was larger."""

    used: float
    peak: float


def send(stream: IO[bytes], data: bytes) -> None:
    """Write one message."""
    stream.write(LENGTH.pack(len(data)))
    stream.write(data)
    stream.flush()


def receive(stream: IO[bytes]) -> bytes | None:
    """The next message, or None at the end of the stream or of one cut short."""
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (size,) = LENGTH.unpack(head)
    data = stream.read(size)
    return data if len(data) == size else None


def _limit_memory(megabytes: float) -> Memory:
    import resource

    with open("/proc/self/statm", encoding="ascii") as file:
        reserved, used = (int(pages) * resource.getpagesize() for pages in file.read().split()[:2])
    limit = reserved + int(megabytes * MEGABYTE)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    # Linux hands the peak of the parent on to the child it starts
    return Memory(used / MEGABYTE, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def _take(calls: queue.SimpleQueue[bytes]) -> None:
    """What the parent sends; nobody is left to read a result once standard input ends."""
    while (call := receive(sys.stdin.buffer)) is not None:
        calls.put(call)
    os._exit(1)


def main() -> None:
    """Serve the parent at the other ends of standard input and output, until it is gone."""
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
            send(out, pickle.dumps((kind, content), protocol=5))

    work: Any = None
    failed: tuple[str, object] | None = None
    try:
        work = pickle.loads(calls.get())
        report("started", None if work.memory is None else _limit_memory(work.memory))
    except StickslipError as error:
        failed = ("done", error)
    except BaseException:
        failed = ("fault", traceback.format_exc())
    while True:
        job = calls.get()
        if failed:
            report(*failed)
        else:
            _answer(work, report, job)


def _answer(work: Work, report: Callable[[str, object], None], job: bytes) -> None:
    """Do a job and report what comes of it."""
    keywords = {"progress": lambda fraction: report("progress", fraction)} if work.progress else {}
    try:
        report("done", work.function(*pickle.loads(job), **keywords))
    except StickslipError as error:
        report("done", error)
    except MemoryError:
        report("memory", None)
    except BaseException:
        report("fault", traceback.format_exc())


if __name__ == "__main__":
    # the instance of this module that the work was pickled with, not __main__
    from fmu_models.base import job_server

    job_server.main()
