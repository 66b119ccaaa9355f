"""Libraries that workers of the tests share: each is compiled once, and optimized where it is run at length.

That are the models that are shipped, with the face of FMI 3, and those that a fit disturbs. For what tests declare, and
for the face of FMI 2, the compiler without optimization does an eighth of the work; that optimization changes no bit is
judged in test_package.
"""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from quick_export import QUICK

from fmu_models import oscillators
from fmu_models.base.files import is_sealed
from fmu_models.codegen import package
from fmu_models.toolchain import compiler
from fmu_models.toolchain.compiler import FLAGS
from fmu_models.toolchain.platforms import this_platform


def share_builds(cache: Path) -> None:
    """Keep what this process and its children compile in a cache of the tests, by turns where two need the same."""
    os.environ.setdefault("STICKSLIP_CACHE", str(cache))
    compiler._compile = _by_turns(compiler._compile)
    package.compile_shared = _compile_model


def _compile_model(sources: Mapping[str, str | bytes], output: Path, *, target: str | None = None) -> Path:
    name = re.search(r'#define MODEL_NAME "(\w+)"', str(sources["model_sizes.h"]))
    assert name is not None
    is_long = name[1] in oscillators.names() or name[1].startswith("disturbed_")
    is_fmi2 = any(file.startswith("fmi/fmi2") for file in sources)
    is_here = target in (None, this_platform().target)
    options = FLAGS if (is_long and not is_fmi2) or not is_here else QUICK
    return compiler.compile_shared(sources, output, target=target, options=options)


def _by_turns(compile_library: Callable[..., None]) -> Callable[..., None]:
    """The same, but one process waits while another compiles the same library."""

    def compile_once(sources: Any, headers: Path, flags: Any, library: Path, *command: Any) -> None:
        with _locked(library):
            if not is_sealed(library):
                compile_library(sources, headers, flags, library, *command)

    return compile_once


@contextmanager
def _locked(library: Path) -> Iterator[None]:
    folder = library.parent.parent / "locks"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / library.name).open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
