"""FMUs of the tests: a C file and a modelDescription.xml, packed with a library for this machine."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

from fmu_models.toolchain.compiler import FLAGS, compile_shared
from fmu_models.toolchain.platforms import this_platform


def build(target: Path, source: Path, description: str, identifier: str, *, options: Sequence[str] = ()) -> Path:
    """Write the FMU ``target`` of the C file ``source`` (which may include its neighbours); returns ``target``."""
    texts = {file.name: file.read_bytes() for file in source.parent.iterdir() if file.suffix in (".c", ".h")}
    fmi3_platform, fmi2_platform, _, suffix = this_platform()
    platform = fmi3_platform if 'fmiVersion="3.0"' in description else fmi2_platform
    library = target.with_suffix(suffix)
    compile_shared(texts, library, files=(source.name,), options=(*FLAGS, "-Wno-unused-parameter", *options))
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr(f"binaries/{platform}/{identifier}{suffix}", library.read_bytes())
    library.unlink()
    return target
