"""FMUs of what a single test declares, compiled without optimization: a run has the same bits, the compiler a fifth of
the work. That the bits are the same is judged in test_package; what we ship is optimized wherever it is tested.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from fmu_models.codegen import package
from fmu_models.toolchain.compiler import FLAGS, compile_shared
from fmu_models.toolchain.platforms import this_platform

# the runtime is left out as for what we ship: to compile it takes longer than the rest
QUICK = ("-O0", *(flag for flag in FLAGS if flag != "-O2"))
if "-linux-" in this_platform().target:
    QUICK = (*QUICK, "-rtlib=none", "-Wl,-z,defs")


def quick_export(declared: Any, path: Path, **options: Any) -> Path:
    """``export`` of a declaration, not of a name: what is kept under a name is what users get."""
    assert not isinstance(declared, str | Path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(package, "compile_shared", partial(compile_shared, options=QUICK))
        return package.export(declared, path, **options)
