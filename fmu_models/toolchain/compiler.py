"""Compile C into a shared library, and keep it in the user's cache under the hash of everything it depends on.

The compiler is zig's, which comes as a Python package (extra ``cross``) and builds for every platform; where it is
not installed, that of the system, which builds for this machine alone. Processes that build the same library at the
same time each write their own file and rename it.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache
from importlib import util
from pathlib import Path
from threading import Timer

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError, WriteError
from fmu_models.base.files import FULL, is_sealed, seal
from fmu_models.base.temporary import temporary_folder
from fmu_models.base.version import version_of
from fmu_models.toolchain.platforms import this_platform

CROSS = "pip install 'stickslip[cross]'"

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

PATIENCE = 2.0  # s without a word
_SHOWN = 8  # lines of what the compiler says

CPP = (".cpp", ".cc", ".cxx", ".C")


def engine_sources() -> dict[str, str]:
    """Name and text of every hand-written C file and header of the engine; the name begins with its folder."""
    folder = Path(__file__).parents[1] / "engine"
    sources = sorted(path for path in folder.glob("*/*") if path.suffix in (".c", ".h"))
    return {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in sources}


def fmi_headers() -> Path:
    """Folder with the C headers of FMI 2 and FMI 3, which come with fmpy."""
    spec = util.find_spec("fmpy")
    folder = Path(spec.origin).parent / "c-code" if spec and spec.origin else None
    if not folder or not (folder / "fmi3Functions.h").is_file():
        raise StickslipError("The FMI headers are missing: they come with fmpy. Install it again: pip install fmpy")
    return folder


@dataclass(frozen=True)
class Compiler:
    """A C compiler.

    Attributes:
        name: of its package or command, and version; what it builds is kept under that name.
        c, cpp: the commands that compile C and C++.
        cross: whether it builds for other platforms than this machine.
    """

    name: str
    c: tuple[str, ...]
    cpp: tuple[str, ...]
    cross: bool = False


def compiler_for(target: str | None = None) -> Compiler:
    """The compiler that builds for a target, such as "aarch64-linux-gnu.2.17"; None is this machine. StickslipError:
    there is none, with the line that installs one."""
    if installed := version_of("ziglang"):
        zig = [sys.executable, "-m", "ziglang"]
        return Compiler(f"ziglang {installed}", (*zig, "cc"), (*zig, "c++"), cross=True)
    if target not in (None, this_platform().target):
        raise StickslipError(f"The compiler of this system does not build for {target}. Install one that does: {CROSS}")
    system = _system_compiler()
    if system is None:
        raise StickslipError(
            f"There is no C compiler here: none as a package, no cc, gcc or clang. Install one: {CROSS}"
        )
    return system


@cache
def _system_compiler() -> Compiler | None:
    """The first C compiler on the path that compiles."""
    for c, cpp in (("cc", "c++"), ("gcc", "g++"), ("clang", "clang++")):
        file = shutil.which(c)
        if file is None:
            continue
        run = subprocess.run([file, "--version"], capture_output=True, text=True, errors="replace", check=False)
        first = next(iter(run.stdout.splitlines()), "")
        compiler = Compiler(first, (file,), (shutil.which(cpp) or cpp,))
        try:
            _kept({"all.c": "int probe(void);\nint probe(void) { return 1; }\n"}, ("all.c",), FLAGS, compiler, None)
        except StickslipError:
            continue
        return compiler
    return None


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
    try:
        cached = _kept(sources, files, options, compiler_for(target), target)
    except OSError as error:
        if error.errno in FULL:
            raise _full() from error
        raise
    shutil.copyfile(cached, output)
    return output


def _kept(
    sources: Mapping[str, str | bytes],
    files: Sequence[str],
    options: Sequence[str],
    compiler: Compiler,
    target: str | None,
) -> Path:
    """The library in the user's cache, built if it is not there."""
    target = target or this_platform().target
    flags = [*options, *files]
    if compiler.cross:
        # zig would first compile a runtime of its own, for numbers and instructions that processors lack: 4 s, of
        # which our C uses nothing on Linux, as the linker sees to there
        runtime = ("-rtlib=none", "-Wl,-z,defs") if options is FLAGS and "-linux-" in target else ()
        flags = [*options, *runtime, "-target", target, *files]
    else:
        # each version of gcc warns of other things, which are no reason to do without
        flags = [flag for flag in flags if flag != "-Werror"]
    headers = fmi_headers()
    key = digest(
        *(text for pair in sorted(sources.items()) for text in pair),
        *(path.read_bytes() for path in sorted(headers.glob("fmi*.h"))),
        *flags,
        compiler.name,
    )
    folder = cache_folder() / "libraries" / key
    if not is_sealed(folder):
        command = compiler.cpp if any(name.endswith(CPP) for name in files) else compiler.c
        _compile(sources, headers, flags, folder, command, target)
    return folder


def _headers_alone() -> list[str]:
    """Options for the headers of a C library that is not linked."""
    spec = util.find_spec("ziglang")
    folder = Path(spec.origin).parent / "lib/libc/include" if spec and spec.origin else Path()
    return [option for name in _HEADERS for option in ("-isystem", str(folder / name))]


def _full() -> WriteError:
    return WriteError(
        f"The disk of the cache folder '{cache_folder()}' is full. Make room there, or set STICKSLIP_CACHE."
    )


@contextmanager
def _first_build_told(prepared: Path, target: str) -> Iterator[None]:
    """Say where time goes while a target is new to this cache, whose file ``prepared`` says that it is no more."""
    text = (
        f"stickslip: the first build for {target}: the compiler prepares its C library, once, and other builds for it "
        "wait meanwhile."
    )
    timer = Timer(PATIENCE, print, (text,), {"file": sys.stderr})
    if not prepared.exists():
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
    prepared.parent.mkdir(parents=True, exist_ok=True)
    prepared.touch()


def _compile(
    sources: Mapping[str, str | bytes],
    headers: Path,
    flags: Sequence[str],
    built: Path,
    compiler: Sequence[str],
    target: str,
) -> None:
    """Run the compiler in a folder of its own and rename the result to ``built``."""
    built.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder("build", built.parent) as folder:
        for file, text in sources.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_bytes(text.encode() if isinstance(text, str) else text)
        library_of_target = _headers_alone() if WITHOUT_LIBRARY in flags else ["-lm"]
        command = [*compiler, *flags, f"-I{headers}", "-o", "library", *library_of_target]
        # zig's own cache: beside ours, so that one variable moves both
        environment = {"ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "zig"), **os.environ}
        environment["ZIG_LOCAL_CACHE_DIR"] = str(folder / "zig")
        first = Path(environment["ZIG_GLOBAL_CACHE_DIR"]) / f"{Path(compiler[-1]).name} {target}"
        with _first_build_told(first, target) if "ziglang" in compiler else nullcontext():
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
            excerpt = "\n  ".join(lines[first if first >= _SHOWN else 0 :][:_SHOWN])
            raise StickslipError(f"The C compiler failed for {target}:\n  {excerpt}")
        os.replace(library, built)
    seal(built)
