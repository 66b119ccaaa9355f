"""A model of this suite of which no library is built yet: runs build the part that they need, all else the whole.

load       ->  the sources and the description are there
a run      ->  the core is compiled (c/core.c), in half the time of the whole
path, or any other use of the library  ->  the FMU is completed in the user's cache, as ``export`` writes it
"""

from __future__ import annotations

import re
import threading
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fmu_models.base.cache import digest
from fmu_models.base.files import is_sealed, seal, write_whole
from fmu_models.fmu.fmu import Fmu
from fmu_models.toolchain import compiler
from fmu_models.toolchain.platforms import this_platform

CORE = "core.c"
# files of which whole runs call nothing; to read them takes a tenth of the compiler's time
BEYOND = re.compile(
    rb'#include "(?:ensemble|tangents/(?!point_|tangent_kind)|fmi/(?!instance|variables)|whole_run/sensitivity).*\n'
)


class UnbuiltFmu(Fmu):
    """An FMU whose file is made by whoever asks for its ``path`` first."""

    def __init__(self, packed: Path, complete: Callable[[], Path]) -> None:
        """packed: it without a library; complete: writes the whole."""
        opened = Fmu.open(packed)
        attributes = {name: value for name, value in vars(opened).items() if name != "path"}
        # its folder goes with the one opened
        vars(self).update(attributes, _opened=opened, _complete=complete, _lock=threading.Lock())

    def __getattr__(self, name: str) -> Any:
        if name != "path":
            raise AttributeError(name)
        with self._lock:
            if name not in vars(self):
                path = self._complete()
                with zipfile.ZipFile(path) as archive:
                    archive.extractall(self.folder, [n for n in archive.namelist() if n.startswith("binaries/")])
                vars(self)[name] = path
        return vars(self)[name]

    @property
    def core(self) -> Path | None:
        """The library that makes whole runs alone; None once the whole is there. StickslipError: the compiler fails."""
        text = (Path(__file__).parent / "c" / CORE).read_bytes()
        library = self._opened.path.with_name(f"{digest(text)}{this_platform().suffix}")  # beside it, for the next run
        with self._lock:
            if "path" in vars(self):
                return None
            if not is_sealed(library):
                with zipfile.ZipFile(self._opened.path) as archive:
                    names = [n for n in archive.namelist() if n.startswith("sources/") and n.endswith((".c", ".h"))]
                    texts = {name.removeprefix("sources/"): archive.read(name) for name in names}
                with write_whole(library, overwrite=True) as temporary:
                    compiler.compile_shared(
                        {**texts, "all.c": BEYOND.sub(b"", texts["all.c"]), CORE: text}, temporary, files=(CORE,)
                    )
                seal(library)
        return library

    def _contents(self) -> dict[str, object]:
        if "path" in vars(self):
            return super()._contents()
        return {**self._opened._contents(), "file": "built when something needs it"}  # which a look at it does not
