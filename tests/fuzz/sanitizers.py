"""Child processes in which all C that the suite compiles has AddressSanitizer and UndefinedBehaviorSanitizer in it.

The compiler that comes along as a package has no runtime of AddressSanitizer; a gcc or clang of the system has. It
takes the package's place (compiler/ziglang), with a cache of its own, so that engine, generated models, FMUs of others
and the importer are compiled by it without knowing.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import IO

from fmu_models.base.temporary import temporary_folder
from fmu_models.toolchain.compiler import cache_folder

WIDE = 200
DEEP = re.compile(r"\s+#([89]|\d\d+) ")  # frames below those of our libraries
COMPILER = Path(__file__).parent / "compiler"


@cache
def missing() -> str:
    """Why there are no sanitizers here; empty if there are."""
    if sys.platform != "linux":
        return "the sanitizers are loaded before Python as Linux does it"
    return "" if _found() else "no gcc or clang with the runtime of AddressSanitizer; on Debian: apt install gcc"


class Reports:
    """What children write to standard error, from where it was read last."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def taken(self) -> str:
        """The beginnings of the reports, whose long ends are the frames of Python."""
        lines = self._file.read().decode("utf-8", "replace").splitlines()
        return "\n".join(line[:WIDE] for line in lines if line.strip() and not DEEP.match(line))


@contextmanager
def sanitized() -> Iterator[Reports]:
    """Children started meanwhile examine what they compile and run."""
    found = _found()
    assert found, missing()
    compiler, runtimes = found
    shim = hashlib.sha256((COMPILER / "ziglang" / "__main__.py").read_bytes() + compiler.encode()).hexdigest()[:8]
    kept = dict(os.environ)
    with temporary_folder("reports") as folder, (folder / "stderr").open("w+b") as file, _standard_error(file):
        options = "abort_on_error=1:allocator_may_return_null=1"
        os.environ |= {
            "SANITIZING_CC": compiler,
            "STICKSLIP_CACHE": str(cache_folder() / f"sanitized-{shim}"),
            "LD_PRELOAD": ":".join(runtimes),
            # every array of Python has its own guards around it
            "PYTHONMALLOC": "malloc",
            # what Python leaves behind is not ours
            "ASAN_OPTIONS": f"{options}:detect_leaks=0",
            "UBSAN_OPTIONS": f"{options}:print_stacktrace=1",
        }
        sys.path.insert(0, str(COMPILER))
        try:
            yield Reports(file)
        finally:
            sys.path.remove(str(COMPILER))
            for name in set(os.environ) - set(kept):
                del os.environ[name]
            os.environ |= kept


@contextmanager
def _standard_error(file: IO[bytes]) -> Iterator[None]:
    """What is written there meanwhile, by children too, goes to a file."""
    kept = os.dup(2)
    # one that writes does not move the place from which another reads
    writer = os.open(file.name, os.O_WRONLY | os.O_APPEND)
    os.dup2(writer, 2)
    os.close(writer)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


@cache
def _found() -> tuple[str, tuple[str, ...]] | None:
    """A compiler, and the libraries to load before Python."""
    for name, library in (("gcc", "libasan.so"), ("clang", "libclang_rt.asan-x86_64.so")):
        compiler = shutil.which(name)
        if not compiler:
            continue
        # without the C++ runtime beside it AddressSanitizer cannot follow the exceptions of other libraries
        runtimes = [_file(compiler, file) for file in (library, "libstdc++.so.6")]
        if all(runtimes):
            return compiler, tuple(runtimes)
    return None


def _file(compiler: str, library: str) -> str:
    run = subprocess.run([compiler, f"-print-file-name={library}"], capture_output=True, text=True, check=False)
    path = Path(run.stdout.strip())
    return str(path.resolve()) if path.is_absolute() and path.is_file() else ""
