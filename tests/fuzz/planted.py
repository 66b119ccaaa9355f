"""Targets with a fault in them, to see that a hunt finds it."""

from __future__ import annotations

import ctypes
import os
import random
import time
import warnings
from pathlib import Path

from fuzzing import Target

from fmu_models.base.errors import StickslipError
from fmu_models.toolchain.compiler import compile_shared

RARE = 7  # the fault is in one case of so many

C = """
#include <stdlib.h>
#include <string.h>
#include <stdint.h>
__attribute__((visibility("default"))) int overrun(int n)
{
    double *room = calloc(4, sizeof *room);
    memset(room, 1, (size_t)n * sizeof *room);
    int all = 0;
    for (int i = 0; i < 4; i++) all += room[i] > 0.0;
    free(room);
    return all;
}
__attribute__((visibility("default"))) int64_t cast(double value) { return (int32_t)value; }
"""


def _rarely(generator: random.Random) -> bool:
    return generator.randrange(RARE) == 0


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(str(compile_shared({"all.c": C}, Path("planted.so").resolve())))


def _sound(generator: random.Random) -> None:
    """Refuses now and then, in words."""
    if _rarely(generator):
        raise StickslipError("this one is refused")


def _other_error(generator: random.Random) -> None:
    if _rarely(generator):
        raise KeyError("lost")


def _warning(generator: random.Random) -> None:
    if _rarely(generator):
        warnings.warn("divided by zero", RuntimeWarning, stacklevel=1)


def _silent(generator: random.Random) -> None:
    if _rarely(generator):
        raise StickslipError(" ")


def _dead(generator: random.Random) -> None:
    if _rarely(generator):
        os.abort()


def _hanging(generator: random.Random) -> None:
    if _rarely(generator):
        time.sleep(1000)


def _overrun(generator: random.Random) -> None:
    """One beyond the end of an array, which nobody sees without a sanitizer."""
    library = _library()
    if _rarely(generator):
        library.overrun(5)


def _cast(generator: random.Random) -> None:
    """A number that its type cannot hold."""
    library = _library()
    library.cast.argtypes = (ctypes.c_double,)
    if _rarely(generator):
        library.cast(1e300)


SOUND = Target("sound", _sound)
FAULTS = {
    "KeyError": Target("error", _other_error),
    "RuntimeWarning": Target("warning", _warning),
    "an error without words": Target("silent", _silent),
    "crashed (SIGABRT": Target("dead", _dead),
    "did not end within": Target("hanging", _hanging),
}
NATIVE_FAULTS = {
    "heap-buffer-overflow": Target("overrun", _overrun, native=True),
    "outside the range of representable values": Target("cast", _cast, native=True),
}
