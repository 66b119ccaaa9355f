"""Functions that the tests of isolation run in a child process."""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Callable

import numpy as np

from fmu_models.base.errors import StickslipError


def squares(n: int, progress: Callable[[float], None] | None = None) -> np.ndarray:
    if progress:
        for fraction in (0.25, 0.5, 1.0):
            progress(fraction)
    return np.arange(n, dtype=float) ** 2


def crash() -> None:
    ctypes.string_at(0)


def crash_on(*_: object) -> None:
    crash()


def hang(note: str | None = None) -> None:
    if note:
        with open(note, "w", encoding="ascii") as file:
            file.write(str(os.getpid()))
    ctypes.CDLL(None).sleep(1000)


def sleep(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def eat(megabytes: int) -> int:
    return len(bytes(megabytes << 20))


def eat_in_c(megabytes: int) -> None:
    """As careless C code does: what malloc returns is written to."""
    libc = ctypes.CDLL(None)
    libc.malloc.restype = ctypes.c_void_p
    libc.malloc.argtypes = (ctypes.c_size_t,)
    for _ in range(megabytes):
        ctypes.memset(libc.malloc(1 << 20), 1, 1 << 20)


def refuse() -> None:
    raise StickslipError("the pendulum is too long. Shorten it.")


class Particular(StickslipError):
    """An error that says more than its text."""

    def __init__(self, text: str, time: float) -> None:
        super().__init__(text)
        self.time = time

    def __reduce__(self) -> tuple[object, ...]:
        return Particular, (str(self), self.time)


def refuse_in_particular() -> None:
    raise Particular("the pendulum is too long.", 1.5)


def stumble() -> None:
    raise KeyError("lost")


def leave(code: int) -> None:
    os._exit(code)


def abort() -> None:
    os.abort()


def chatter() -> int:
    """As an FMU does: prints through C, and into the file descriptor."""
    libc = ctypes.CDLL(None)
    libc.printf(b"hello from C\n")
    libc.fflush(None)
    os.write(1, b"hello from below\n")
    print("hello from Python")
    return 7


def close_everything() -> None:
    os.closerange(0, 100)
    ctypes.CDLL(None).sleep(1000)


def write_garbage() -> None:
    for number in range(3, 20):
        try:
            os.write(number, b"\x05" + bytes(7) + b"wrong and more")
        except OSError:
            continue
    ctypes.CDLL(None).sleep(1000)


def leave_a_process_behind(note: str) -> None:
    import subprocess

    # it holds every file of this process, the pipe of the reports among them
    left = subprocess.Popen(["sleep", "1000"], close_fds=False)
    with open(note, "w", encoding="ascii") as file:
        file.write(str(left.pid))
    os._exit(5)


class Keeper:
    """Remembers what it was asked for before."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def ask(self, name: str) -> tuple[int, list[str]]:
        """The number of the process, and what it was asked for until now."""
        if name == "crash":
            crash()
        if name == "hang":
            hang()
        if name == "refuse":
            refuse()
        self.asked.append(name)
        return os.getpid(), list(self.asked)


def first_letter(name: str) -> str:
    return name[0]


def threads(size: int) -> list[int]:
    """Of the BLAS libraries, after some work."""
    from threadpoolctl import threadpool_info

    assert np.isfinite(np.linalg.inv(np.eye(size))).all()
    return [library["num_threads"] for library in threadpool_info()]
