"""The compiler: what it makes, what it keeps, and what it says when it cannot."""

from __future__ import annotations

import ctypes
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError
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


def test_a_header_that_changes_makes_another_library(compiler: list[list[str]], tmp_path: Path) -> None:
    body = '#include "n.h"\n__attribute__((visibility("default"))) int answer(void);\nint answer(void) { return N; }\n'
    for n in (1, 2):
        library = compile_shared({"all.c": body, "n.h": f"#define N {n}\n"}, tmp_path / f"{n}.so")
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


def test_a_warning_is_an_error(compiler: list[list[str]], tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="unused"):
        compile_shared({"all.c": "int f(void);\nint f(void) { int x = 1; return 2; }\n"}, tmp_path / "out.so")


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
