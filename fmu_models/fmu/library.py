"""The library of an FMU for this machine: packed in it, or built from the sources in it."""

from __future__ import annotations

import ctypes
import re
import sys
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError
from fmu_models.toolchain.compiler import CPP, compile_shared
from fmu_models.toolchain.platforms import this_platform

if TYPE_CHECKING:
    from fmpy.model_description import SourceFileSet

    from fmu_models.fmu.fmu import Fmu

# -w: warnings about somebody else's code help nobody here; otherwise as for our own
FLAGS = ("-O2", "-w", "-ffp-contract=off", "-fno-sanitize=undefined", "-shared", "-fPIC", "-s", "-I.")
# sources meant for static linking give every function the model's name as prefix; a shared library has plain names
PLAIN_NAMES = ("-DFMI2_OVERRIDE_FUNCTION_PREFIX=1", "-DFMI3_OVERRIDE_FUNCTION_PREFIX=1")
LIBRARIES = (".so", ".dll", ".dylib")


def this_folder(fmu: Fmu) -> str:
    """Name of the folder in ``binaries`` for this machine, which depends on the version of FMI."""
    platform = this_platform()
    return platform.fmi2 if fmu.fmi == 2 else platform.fmi3


def platforms(fmu: Fmu) -> list[str]:
    """Folders in ``binaries`` that hold a library, such as "linux64" (FMI 2) or "x86_64-linux" (FMI 3)."""
    _ = fmu.path  # by which a model that is not built yet is
    folders = (fmu.folder / "binaries").glob("*/*")
    return sorted({file.parent.name for file in folders if file.suffix in LIBRARIES})


def sources(fmu: Fmu) -> list[str]:
    """C and C++ files in ``sources``."""
    folder = fmu.sources
    files = (file for file in folder.rglob("*") if file.suffix == ".c" or file.suffix in CPP)
    return sorted(file.relative_to(folder).as_posix() for file in files)


def library(fmu: Fmu, identifier: str) -> Path:
    """The library ``identifier`` for this machine; built where it is not packed (kept in the user's cache).
    StickslipError: neither packed nor buildable; lists what the FMU has."""
    path = fmu.path  # of a model that is not built yet, by which it is
    folder = fmu.folder / "binaries" / this_folder(fmu)
    target = folder / f"{identifier}{this_platform().suffix}"
    if target.is_file():
        return target
    has = ", ".join(platforms(fmu)) or "no platform at all"
    missing = f"'{path}' has no library '{target.name}' for {folder.name} (it has {has})"
    if not sources(fmu):
        raise StickslipError(f"{missing} and no sources. Ask its author for one of them.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return _build(fmu, identifier, target)
    except StickslipError as error:
        raise StickslipError(f"{missing}, and its sources cannot be built. {error}") from error


def unload(dll: ctypes.CDLL) -> None:
    """Let go of a loaded library, of which nothing may be called any more."""
    if sys.platform == "win32":
        ctypes.windll.kernel32.FreeLibrary(ctypes.c_void_p(dll._handle))
    else:
        close = ctypes.CDLL(None).dlclose
        close.argtypes = (ctypes.c_void_p,)
        close(dll._handle)


def _build(fmu: Fmu, identifier: str, target: Path) -> Path:
    folder = fmu.sources
    texts = {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    files, options = [], []
    for configuration in _parts(fmu, identifier):
        if configuration.language and not re.fullmatch(r"C(\+\+)?\d*", configuration.language):
            raise StickslipError(f"They are written in {configuration.language}; C and C++ are built here.")
        files += [_inside(name, texts) for name in configuration.sourceFiles]
        options += [f"-I{_inside(name, None)}" for name in configuration.includeDirectories]
        for definition in configuration.preprocessorDefinitions:
            if not re.fullmatch(r"\w+", definition.name or ""):
                raise StickslipError(f"They define the ill-formed macro '{definition.name}'.")
            options.append(f"-D{definition.name}" + (f"={definition.value}" if definition.value else ""))
    if not files:
        # not listed, as in many FMUs 2.0: one that includes the rest, or all
        files = ["all.c"] if "all.c" in texts else sources(fmu)
    flags = [option for option in PLAIN_NAMES if option.partition("=")[0] not in {o.partition("=")[0] for o in options}]
    return compile_shared(texts, target, files=files, options=(*FLAGS, *flags, *options))


def _parts(fmu: Fmu, identifier: str) -> list[SourceFileSet]:
    configurations = [c for c in fmu.description.buildConfigurations if c.modelIdentifier == identifier]
    return configurations[0].sourceFileSets if configurations else []


def _inside(name: str, files: dict[str, bytes] | None) -> str:
    """A file or folder named in the FMU's own list, if it lies within its sources."""
    inside = PurePosixPath(name or "")
    if inside.is_absolute() or ".." in inside.parts or "\\" in name or ":" in name or name.startswith("-"):
        raise StickslipError(f"They list '{name}', which lies outside their folder.")
    if files is not None and inside.as_posix() not in files:
        raise StickslipError(f"They list '{name}', which is not there.")
    return inside.as_posix()
