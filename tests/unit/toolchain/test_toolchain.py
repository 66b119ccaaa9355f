"""The compiler: what it makes, what it keeps, and what it says when it cannot."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np
import pytest

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError, WriteError
from fmu_models.codegen.package import built
from fmu_models.families.jobs import Jobs
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.lanes import library as lanes
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.run import simulate
from fmu_models.toolchain import compiler as toolchain
from fmu_models.toolchain import platforms
from fmu_models.toolchain.compiler import compile_shared

SOURCE = {"all.c": '__attribute__((visibility("default"))) int answer(void);\nint answer(void) { return 42; }\n'}


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """A fresh cache for libraries, and a record of the compiler's runs; its own cache stays warm."""
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(cache_folder() / "zig"))
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    runs: list[list[str]] = []
    run = toolchain.subprocess.run

    def recorded(command: list[str], **options: object) -> object:
        runs.append(command)
        return run(command, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(toolchain.subprocess, "run", recorded)
    return runs


def test_a_library_is_compiled_once(compiler: list[list[str]], tmp_path: Path) -> None:
    first = compile_shared(SOURCE, tmp_path / "first.so")
    assert ctypes.CDLL(str(first)).answer() == 42
    second = compile_shared(SOURCE, tmp_path / "second.so")
    assert len(compiler) == 1
    assert first.read_bytes() == second.read_bytes()


def test_a_first_build_that_takes_long_says_why_once(
    compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    if not toolchain.compiler_for().cross:
        pytest.skip("the system's compiler prepares no C library")
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", str(tmp_path / "zig"))
    monkeypatch.setattr(toolchain, "PATIENCE", 0.01)
    compile_shared(SOURCE, tmp_path / "first.so")
    said = capfd.readouterr().err
    assert said.startswith("stickslip: the first build for ") and len(said.splitlines()) == 1
    compile_shared({"all.c": SOURCE["all.c"].replace("42", "43")}, tmp_path / "second.so")
    assert len(compiler) == 2 and not capfd.readouterr().err


def test_a_header_that_changes_makes_another_library(compiler: list[list[str]], tmp_path: Path) -> None:
    body = '#include "of/two/n.h"\n' + SOURCE["all.c"].replace("42", "N")
    for n in (1, 2):
        library = compile_shared({"all.c": body, "of/two/n.h": f"#define N {n}\n"}, tmp_path / f"{n}.so")
        assert ctypes.CDLL(str(library)).answer() == n
    assert len(compiler) == 2


def test_processes_at_the_same_time_do_not_disturb_each_other(compiler: list[list[str]], tmp_path: Path) -> None:
    with ThreadPoolExecutor(3) as pool:
        libraries = list(pool.map(lambda i: compile_shared(SOURCE, tmp_path / f"{i}.so"), range(3)))
    assert len({library.read_bytes() for library in libraries}) == 1
    # the library and its hash, and nothing left over
    assert sorted(path.suffix for path in (cache_folder() / "libraries").iterdir()) == ["", ".sha256"]


def test_an_error_of_the_compiler_is_shown_and_nothing_kept(compiler: list[list[str]], tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match=r"all\.c:1:\d+: error"):
        compile_shared({"all.c": "int f(void) { return nonsense; }\n"}, tmp_path / "out.so")
    assert not (tmp_path / "out.so").exists()
    assert not list((cache_folder() / "libraries").iterdir())


@pytest.mark.parametrize("said", ["error: NoSpaceLeft", "all.c:1:1: fatal error: No space left on device"])
def test_a_disk_that_is_full_is_told_whatever_else_the_compiler_says(
    said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(command, 1, "", f"warning: of something else\n{said}\n1 error generated.\n")

    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(toolchain.subprocess, "run", full)
    with pytest.raises(WriteError, match=r"is full\. Make room there, or set STICKSLIP_CACHE"):
        compile_shared(SOURCE, tmp_path / "library.so")


def test_a_warning_is_an_error(compiler: list[list[str]], tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="unused"):
        compile_shared({"all.c": "int f(void);\nint f(void) { int x = 1; return 2; }\n"}, tmp_path / "out.so")


def test_what_only_a_runtime_of_the_compiler_has_is_not_linked_on_linux(tmp_path: Path) -> None:
    """Division of numbers of 128 bits, for one: our C does without, so that no such runtime is built."""
    source = SOURCE["all.c"].replace("int ", "__int128 ").replace("(void)", "(__int128 a)").replace("42", "42 / a")
    with pytest.raises(StickslipError, match="undefined symbol: __divti3"):
        compile_shared({"all.c": source}, tmp_path / "out.so", target="x86_64-linux-gnu.2.17")


def test_headers_of_a_c_library_are_there_though_it_is_not_linked(compiler: list[list[str]], tmp_path: Path) -> None:
    source = "#include <math.h>\n#include <string.h>\ndouble size(double x) { return fabs(x); }\n"
    options = (toolchain.WITHOUT_LIBRARY, "-O2", "-rtlib=none", "-Wl,--no-entry")
    module = compile_shared({"all.c": source}, tmp_path / "module", target="wasm32-wasi", options=options)
    assert module.read_bytes()[:4] == b"\0asm"


def test_a_cache_that_cannot_be_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(StickslipError, match="STICKSLIP_CACHE"):
        cache_folder()


def test_where_one_text_ends_counts() -> None:
    assert digest("ab", "c") != digest("a", "bc")
    assert digest("ab", b"c") == digest(b"ab", "c")


def test_a_machine_without_fmus_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms.platform, "machine", lambda: "riscv64")
    with pytest.raises(StickslipError, match="riscv64"):
        platforms.this_platform()


def test_a_target_that_the_compiler_has_not_is_named(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="failed for sparc99-linux-gnu:\n  error: unknown architecture: 'sparc99'"):
        compile_shared({"all.c": "int x;"}, tmp_path / "library", target="sparc99-linux-gnu")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def without_package(monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiler's package is not installed."""
    monkeypatch.setattr(toolchain, "version_of", lambda _: "")
    toolchain._system_compiler.cache_clear()


@pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="this system has no C compiler")
def test_the_compiler_of_the_system_serves_without_the_package(
    without_package: None, compiler: list[list[str]], tmp_path: Path
) -> None:
    library = compile_shared(SOURCE, tmp_path / "library.so")
    assert ctypes.CDLL(str(library)).answer() == 42
    assert not any("ziglang" in word for command in compiler for word in command)
    with pytest.raises(StickslipError, match=r"does not build for wasm32-wasi.*stickslip\[cross\]"):
        compile_shared(SOURCE, tmp_path / "library.wasm", target="wasm32-wasi")


@pytest.mark.nightly
@pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="this system has no C compiler")
def test_the_compiler_of_the_system_builds_a_model(without_package: None, compiler: list[list[str]]) -> None:
    """The whole engine, whatever that compiler warns of."""
    belt = simulate(Fmu.open(built("block_on_belt")), 1.0)
    assert belt["time"][-1] == 1.0
    assert not any("ziglang" in word for command in compiler for word in command)


def test_a_compiler_that_does_not_work_is_as_none(
    without_package: None, compiler: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "bin" / "cc"
    broken.parent.mkdir()
    broken.write_text("#!/bin/sh\necho broken; exit 1\n")
    broken.chmod(0o755)
    monkeypatch.setenv("PATH", str(broken.parent))
    with pytest.raises(StickslipError, match=r"no C compiler here.*stickslip\[cross\]"):
        compile_shared(SOURCE, tmp_path / "library.so")


@pytest.mark.nightly
@pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="this system has no C compiler")
def test_lanes_of_the_systems_compiler_have_the_same_bits(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu = load("discontinuous_support")
    rows = []
    for installed in (True, False):
        if not installed:
            request.getfixturevalue("without_package")
        monkeypatch.setattr(lanes, "_libraries", WeakKeyDictionary())
        system = Strobe(fmu, forcing="omega", parameters={"ks": 300.0})
        starts = np.tile(system.start({"x": 0.0, "v": 0.0}), (9, 1))
        jobs = Jobs(starts, {"omega": np.linspace(0.8, 1.0, 9)}, transient=50, rows=3)
        rows.append(system.make(jobs).points)
    assert rows[0].tobytes() == rows[1].tobytes()
