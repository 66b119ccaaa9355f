"""Damaged files given to a reader, in a process of its own: what it does with each."""

from __future__ import annotations

import signal
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs import guarded
from rig_io.readers import READERS, matlab_log

PATIENCE = 10  # s that a reader may take for a damaged file


class Hangs(BaseException):
    """A parser goes in circles; nothing that it catches itself."""


@contextmanager
def stopped_after(seconds: int) -> Iterator[None]:
    """Raise `Hangs` after so long, where there are alarms."""
    if not hasattr(signal, "SIGALRM"):
        yield
        return

    def ring(*_: object) -> None:
        raise Hangs

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def read_here(name: str, path: Path) -> None:
    """As the reader does, but parsed in this process, which is guarded itself."""
    before = guarded.isolated
    for module in (guarded, matlab_log):
        vars(module)["isolated"] = lambda function, *arguments, limits=None: function(*arguments)
    try:
        READERS.load(name).read(path)
    finally:
        for module in (guarded, matlab_log):
            vars(module)["isolated"] = before


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Cut off, with bits turned over, bytes put in, a stretch left out, doubled or set to zeros."""
    made = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        if not made:
            break
        kind, spot = int(rng.integers(0, 6)), int(rng.integers(0, len(made)))
        length = int(rng.integers(1, 40))
        if kind == 0:
            del made[spot:]
        elif kind == 1:
            made[spot] ^= 1 << int(rng.integers(0, 8))
        elif kind == 2:
            made[spot:spot] = rng.bytes(length)
        elif kind == 3:
            del made[spot : spot + length]
        elif kind == 4:
            made[spot:spot] = made[spot : spot + length]
        else:
            made[spot : spot + length] = bytes(min(length, len(made) - spot))
    return bytes(made)


def fuzz(name: str, suffix: str, data: bytes, first: int, count: int) -> dict[str, int]:
    """How many damaged files were read, and how many refused.

    Raises:
        RuntimeError: one ended in another error; with its number.
    """
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as room, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(room) / f"log{suffix}"
        for number in range(first, first + count):
            path.write_bytes(damaged(data, np.random.default_rng([7, number])))
            try:
                with stopped_after(PATIENCE):
                    read_here(name, path)
                found["read"] += 1
            except Hangs:  # which the guard of a reader turns into a word, as it does want of memory
                found["stopped"] += 1
            except StickslipError as error:
                assert str(path) in str(error), f"case {number} does not name the file: {error}"
                found["refused"] += 1
            except MemoryError:
                found["refused"] += 1
            except BaseException as error:
                raise RuntimeError(f"{name}, case {number}: {type(error).__name__}: {error}") from error
    return dict(found)
