"""The stepper in lanes of one FMU: a library beside it, built when it is first asked for and kept in the user's cache.

An FMU that qualifies (codegen/lane_tables.py) carries its tables as a header among its sources; the code is here, in
``c``. The engine of the FMU calls the stepper (engine/ensemble/lane_runs.c).
"""

import ctypes
import threading
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmu_models.base.temporary import temporary_folder
from fmu_models.codegen.contents import LANE_TABLES
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import unload
from fmu_models.toolchain.compiler import compile_shared
from fmu_models.toolchain.platforms import this_platform


@dataclass(frozen=True, eq=False)
class Stepper:
    """A stepper of so many lanes; ``at`` is the address of its LaneStepper."""

    lanes: int
    at: int


class LaneLibrary:
    """The steppers of one FMU."""

    def __init__(self, fmu: Fmu) -> None:
        """Build it, or take it from the cache. StickslipError: the compiler fails."""
        sources = _sources(fmu)
        with temporary_folder("lanes") as folder:
            file = compile_shared(sources, folder / f"lanes{this_platform().suffix}")
            dll = ctypes.CDLL(str(file))
        self._find = dll.stickslip_lanes
        self._find.restype, self._find.argtypes = ctypes.c_void_p, (ctypes.c_int64,)
        self._steppers: dict[int, Stepper | None] = {}
        weakref.finalize(self, unload, dll)

    def stepper(self, width: int = 0) -> Stepper | None:
        """The stepper of ``width`` lanes, 0: as many as this processor has; None where it has not so many."""
        if width not in self._steppers:
            at = self._find(width)
            lanes = int(ctypes.c_int64.from_address(at + _TOGETHER).value) if at else 0
            self._steppers[width] = Stepper(lanes, int(at)) if at else None
        return self._steppers[width]


# of LaneStepper: version, token, together
_TOGETHER = 16


def has_lanes(fmu: Fmu) -> bool:
    """Whether an FMU of this suite carries tables for lanes."""
    return fmu.ours and (fmu.folder / "sources" / LANE_TABLES).is_file()


def lanes_of(fmu: Fmu) -> LaneLibrary:
    """The library of an opened FMU that has lanes; errors as for ``LaneLibrary``."""
    with _loading:
        if fmu not in _libraries:
            _libraries[fmu] = LaneLibrary(fmu)
        return _libraries[fmu]


_libraries: weakref.WeakKeyDictionary[Fmu, LaneLibrary] = weakref.WeakKeyDictionary()
_loading = threading.Lock()


def _sources(fmu: Fmu) -> dict[str, str | bytes]:
    """Our code, and what the FMU says of its model."""
    folder, package = fmu.sources, Path(__file__).parent
    headers = [LANE_TABLES, "model_sizes.h", "ensemble/lane_stepper.h"]
    headers += sorted(path.relative_to(folder).as_posix() for path in (folder / "model").glob("*.h"))
    sources: dict[str, Any] = {f"engine/{name}": (folder / name).read_text("utf-8") for name in headers}
    code = sorted(path for path in (package / "c").iterdir() if path.suffix in (".c", ".h"))
    sources |= {f"lanes/c/{path.name}": path.read_text("utf-8") for path in code}
    names = [name for name in sources if name.endswith(".c")]
    return {**sources, "all.c": "".join(f'#include "{name}"\n' for name in names)}
