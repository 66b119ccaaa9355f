"""The engine and one model as WebAssembly, built from the sources that an FMU of ours carries."""

import re
from pathlib import Path

from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder
from fmu_models.fmu.fmu import Fmu
from fmu_models.toolchain.compiler import FLAGS, WITHOUT_LIBRARY, compile_shared

TARGET = "wasm32-wasi"
# no entry point but functions to call; what these need of a C library stands among the sources; the stack holds a few
# series, which a default of 64 kB or 1 MB does not fit
_WASM = (WITHOUT_LIBRARY, "-rtlib=none", "-Wl,--no-entry", "-Wl,-z,stack-size=262144", "-s")
COMPILED = ("all.c", "explorer/c/mathematics.c")
_LIBRARY = "explorer/c/freestanding.c"
# rooms of the engine that a motion needs whole, and files of others: neither tangents nor an interface of FMI
_ROOMS = ("model", "step", "events")
_FILES = ("fmi/instance.c", "fmi/variables.c", "whole_run/restart.c", "whole_run/whole_run.c")
_PHASE = re.compile(r"\bjet_(angle|turns)\(([^,()]+),")
_NUMBER = re.compile(r"[pd]\[\d+\]|[0-9.]+(?:e[+-]?\d+)?")


def wasm(fmu: Fmu) -> bytes:
    """The module of an FMU that passes ``check``; it imports nothing. StickslipError: the compiler fails."""
    options = [flag for flag in FLAGS if flag not in ("-shared", "-fPIC", "-s")]
    with temporary_folder("explore") as folder:
        file = compile_shared(
            module_sources(fmu),
            folder / "engine.wasm",
            target=TARGET,
            files=(*COMPILED, _LIBRARY),
            options=(*options, *_WASM),
        )
        return file.read_bytes()


def check(fmu: Fmu) -> None:
    """Raises StickslipError: an FMU of somebody else, one without its sources, or a map."""
    name = fmu.path.name
    if fmu.is_map:
        raise StickslipError(
            f"'{name}' is a map, which has no motion between its steps: stickslip map diagram draws it."
        )
    if not fmu.ours:
        raise StickslipError(
            f"'{name}' was not exported by stickslip: the engine of a page is built from the equations, which it does "
            "not carry. Run it with: stickslip simulate"
        )
    if not (fmu.folder / "sources/model.c").is_file():
        raise StickslipError(f"'{name}' carries no sources, from which a page is built. Export it again.")


def module_sources(fmu: Fmu) -> dict[str, str | bytes]:
    """C files and headers by name, of which ``COMPILED`` are compiled; of an FMU that passes ``check``."""
    folder = fmu.sources
    sources: dict[str, str | bytes] = {
        f"engine/{path.relative_to(folder).as_posix()}": path.read_text("utf-8")
        for path in sorted(folder.rglob("*"))
        if path.suffix in (".c", ".h") and path.name != "all.c"
    }
    ours = sorted((Path(__file__).parent / "c").iterdir())
    sources |= {f"explorer/c/{path.name}": path.read_text("utf-8") for path in ours if path.suffix in (".c", ".h")}
    sources["explorer/c/explore_period.h"] = (
        f"#define EXPLORE_PERIOD {_period((folder / 'model_kind.c').read_text())}\n"
    )
    sources["all.c"] = _all(list(sources), (folder / "all.c").read_text("utf-8"))
    return sources


def _all(names: list[str], packed: str) -> str:
    """The file that includes the engine as a page needs it."""
    units = [name for name in names if name.endswith(".c") and name.startswith(tuple(f"engine/{r}/" for r in _ROOMS))]
    files = ["engine/model.c", *units, *(f"engine/{name}" for name in _FILES), "explorer/c/explore.c"]
    nominals = re.search(r"^const double model_nominal_states.*;$", packed, re.M)
    if nominals is None:
        raise ValueError("all.c tells no nominal values of the states")
    includes = "".join(f'#include "{name}"\n' for name in files)
    return f'#include "explorer/c/mathematics.h"\n{includes}\n{nominals[0]}\n'


def _period(model: str) -> str:
    """The period of the forcing as C, by p and d: of the one frequency that phases in the equations have, else 0."""
    rates = set(_PHASE.findall(model))
    if len(rates) != 1:
        return "0.0"
    kind, rate = rates.pop()
    if not _NUMBER.fullmatch(rate.strip()):
        return "0.0"
    turn = "6.283185307179586" if kind == "angle" else "1.0"
    return f"({rate} != 0.0 ? {turn} / fabs({rate}) : 0.0)"
