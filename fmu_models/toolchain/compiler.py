"""Compile C into a shared library with the compiler that comes as a Python package (zig cc).

A library is built once: it is kept in the user's cache under the hash of everything it depends on (sources, headers,
flags, compiler version). Processes that build the same one at the same time each write their own file and rename it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib import metadata, util
from pathlib import Path

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError, WriteError
from fmu_models.base.files import FULL, is_sealed, seal
from fmu_models.base.temporary import temporary_folder
from fmu_models.toolchain.platforms import this_platform

# zig would first compile a runtime of its own, for numbers and instructions that processors lack: 4 s, of which our C
# uses nothing on Linux, as the linker sees to there
_WITHOUT_RUNTIME = ("-rtlib=none", "-Wl,-z,defs")

# -ffp-contract=off: fused multiply-adds would make results differ between processors
# -fno-sanitize=undefined: zig cc adds run-time checks unless told otherwise; -s: debug information triples the size
FLAGS = (
    *("-O2", "-std=c11", "-Wall", "-Wextra", "-Werror", "-fvisibility=hidden", "-ffp-contract=off"),
    *("-fno-sanitize=undefined", "-shared", "-fPIC", "-s"),
)

# a C library of the target would have to be built first: 30 s of which our C takes a dozen functions
WITHOUT_LIBRARY = "-nostdlib"
# its headers in the compiler's package, which go with it, of the one target that we do without it
_HEADERS = ("wasm-wasi-musl", "generic-musl")

_SHOWN = 8  # lines of what the compiler says

CPP = (".cpp", ".cc", ".cxx", ".C")


def engine_sources() -> dict[str, str]:
    """Name and text of every hand-written C file and header of the engine; the name begins with its folder."""
    folder = Path(__file__).parents[1] / "engine"
    found = sorted(path for path in folder.glob("*/*") if path.suffix in (".c", ".h"))
    return {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in found}


def fmi_headers() -> Path:
    """Folder with the C headers of FMI 2 and FMI 3, which come with fmpy."""
    spec = util.find_spec("fmpy")
    folder = Path(spec.origin).parent / "c-code" if spec and spec.origin else None
    if not folder or not (folder / "fmi3Functions.h").is_file():
        raise StickslipError("The FMI headers are missing: they come with fmpy. Install it again: pip install fmpy")
    return folder


def compile_shared(
    sources: Mapping[str, str | bytes],
    output: Path,
    *,
    target: str | None = None,
    files: Sequence[str] = ("all.c",),
    options: Sequence[str] = FLAGS,
) -> Path:
    """Compile ``files`` of ``sources`` into a shared library and copy it to ``output``.

    Args:
        sources: C files and headers by name (with '/' in it for a subfolder); what is not compiled is there to include.
        output: where the library goes; replaced if it exists.
        target: zig target such as "aarch64-linux-gnu.2.17"; None takes the one for this machine.
        files: names of those to compile; C++ by their suffix.
        options: of the compiler.

    Returns:
        ``output``.

    Raises:
        StickslipError: the compiler is missing or refuses the sources.
    """
    target = target or this_platform().target
    runtime = _WITHOUT_RUNTIME if options is FLAGS and "-linux-" in target else ()
    flags = [*options, *runtime, "-target", target, *files]
    headers = fmi_headers()
    key = digest(
        *(text for pair in sorted(sources.items()) for text in pair),
        *(path.read_bytes() for path in sorted(headers.glob("fmi*.h"))),
        *flags,
        compiler_version(),
    )
    kept = cache_folder() / "libraries" / key
    if not is_sealed(kept):
        try:
            _compile(sources, headers, flags, kept, "c++" if any(name.endswith(CPP) for name in files) else "cc")
        except OSError as error:
            if error.errno in FULL:
                raise _full() from error
            raise
    shutil.copyfile(kept, output)
    return output


def compiler_version() -> str:
    """Version of the compiler that comes as a package.

    Raises:
        StickslipError: it is missing.
    """
    try:
        return metadata.version("ziglang")
    except metadata.PackageNotFoundError:
        raise StickslipError(
            "The C compiler is missing: it comes as a package. Install it: pip install ziglang"
        ) from None


def _headers_alone() -> list[str]:
    """Options for the headers of a C library that is not linked."""
    spec = util.find_spec("ziglang")
    folder = Path(spec.origin).parent / "lib/libc/include" if spec and spec.origin else Path()
    return [option for name in _HEADERS for option in ("-isystem", str(folder / name))]


def _full() -> WriteError:
    return WriteError(
        f"The disk of the cache folder '{cache_folder()}' is full. Make room there, or set STICKSLIP_CACHE."
    )


def _compile(
    sources: Mapping[str, str | bytes], headers: Path, flags: Sequence[str], kept: Path, language: str
) -> None:
    """Run the compiler in a folder of its own and rename the result to ``kept``."""
    kept.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder("build", kept.parent) as folder:
        for file, text in sources.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_bytes(text.encode() if isinstance(text, str) else text)
        library_of_target = _headers_alone() if WITHOUT_LIBRARY in flags else ["-lm"]
        command = [sys.executable, "-m", "ziglang", language, *flags, f"-I{headers}", "-o", "library"]
        command += library_of_target
        # the compiler's own cache: beside ours, so that one variable moves both
        environment = {"ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "zig"), **os.environ}
        environment["ZIG_LOCAL_CACHE_DIR"] = str(folder / "zig")
        run = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, errors="replace", check=False
        )
        library = folder / "library"
        if run.returncode != 0 or not library.is_file():
            lines = [line for line in run.stderr.splitlines() if line.strip()] or [f"exit code {run.returncode}"]
            if any("NoSpaceLeft" in line or "No space left" in line for line in lines):
                raise _full()
            # lists of what it knows come before the error
            first = next((i for i, line in enumerate(lines) if "error" in line), 0)
            shown = "\n  ".join(lines[first if first >= _SHOWN else 0 :][:_SHOWN])
            target = flags[flags.index("-target") + 1]
            raise StickslipError(f"The C compiler failed for {target}:\n  {shown}")
        os.replace(library, kept)
    seal(kept)
