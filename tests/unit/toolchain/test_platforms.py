"""FMUs for every platform from one machine: names, places, headers of the libraries, and a run of a foreign one."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import fmu_models
from fmu_models.base.cache import cache_folder
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import Packaging, export
from fmu_models.toolchain.platforms import PLATFORMS, platforms, this_platform

# machine numbers of ELF, PE and Mach-O headers
ELF = {"x86_64-linux": 62, "aarch64-linux": 183}
PE = {"x86_64-windows": 0x8664}
MACH_O = {"x86_64-darwin": 0x01000007, "aarch64-darwin": 0x0100000C}
# engine's own calls beside those of the standard
OWN = ("fmi2", "fmi3", "stickslip_")


# what the compiler brings along for Windows takes more than a minute to unfold
AT_ONCE = [name for name, platform in PLATFORMS.items() if "windows" not in platform.target]


AT_NIGHT = [pytest.param((version, ["all"]), marks=pytest.mark.nightly) for version in ("2.0", "3.0")]
Built = tuple[str, list[str], Path]  # version, names of platforms, FMU


@pytest.fixture(scope="module", params=[("3.0", AT_ONCE), *AT_NIGHT])
def everywhere(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Built:
    path = tmp_path_factory.mktemp("all") / "belt.fmu"
    version, names = request.param
    seen: list[float] = []
    export("block_on_belt", path, packaging=Packaging(platforms=names, advance=seen.append), fmi_version=version)
    count = len(platforms(names))
    assert seen == pytest.approx(np.arange(1, count + 1) / count)
    return version, names, path


def libraries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if name.startswith("binaries/")]
        return {name.removeprefix("binaries/"): archive.read(name) for name in names}


def test_every_platform_has_its_library_in_its_folder(everywhere: Built) -> None:
    version, names, path = everywhere
    folders = {p.fmi2 if version == "2.0" else p.fmi3: p for p in platforms(names)}
    found = libraries(path)
    assert set(found) == {f"{folder}/block_on_belt{p.suffix}" for folder, p in folders.items()}
    assert path.stat().st_size < 1_000_000
    for name, data in found.items():
        platform = folders[name.partition("/")[0]].fmi3
        if platform in ELF:
            assert data[:4] == b"\x7fELF" and struct.unpack_from("<H", data, 18) == (ELF[platform],)
        elif platform in PE:
            (start,) = struct.unpack_from("<I", data, 60)
            assert data[start : start + 4] == b"PE\0\0"
            assert struct.unpack_from("<H", data, start + 4) == (PE[platform],)
        else:
            assert struct.unpack_from("<II", data) == (0xFEEDFACF, MACH_O[platform])


def test_a_library_of_linux_needs_an_old_glibc_and_shows_the_interface_alone(everywhere: Built, tmp_path: Path) -> None:
    if not (tool := shutil.which("nm")):
        pytest.skip("nm of binutils is not installed: the symbols cannot be read")
    version, _, path = everywhere
    for name, data in libraries(path).items():
        if "linux" not in name:
            continue
        (tmp_path / "library.so").write_bytes(data)
        shown = subprocess.run([tool, "-D", tmp_path / "library.so"], capture_output=True, text=True, check=True).stdout
        rows = [line.split()[-2:] for line in shown.splitlines()]
        assert all(symbol.startswith(OWN) for kind, symbol in rows if kind in "TDBR")
        assert any(symbol.startswith(f"fmi{version[0]}") for kind, symbol in rows if kind == "T")
        needed = [symbol.rpartition("GLIBC_")[2] for _, symbol in rows if "GLIBC_" in symbol]
        assert all(tuple(map(int, v.split("."))) <= (2, 17) for v in needed)


@pytest.mark.parametrize(("folder", "runner"), [("aarch64-linux", "qemu-aarch64"), ("x86_64-windows", "wine")])
def test_a_library_of_another_platform_is_loaded_there(
    everywhere: Built, tmp_path: Path, folder: str, runner: str
) -> None:
    if shutil.which(runner) is None:
        pytest.skip(f"{runner} is not installed: a library for {folder} cannot be loaded here")
    version, names, path = everywhere
    windows = folder.endswith("windows")
    if windows and names == AT_ONCE:
        pytest.skip("a library for Windows is made at night")
    source = tmp_path / "load.c"
    call, header = ("LoadLibraryA", "windows.h") if windows else ("dlopen", "dlfcn.h")
    find, arguments = ("GetProcAddress", "(argv[1])") if windows else ("dlsym", "(argv[1], RTLD_NOW)")
    source.write_text(
        f"#include <{header}>\n#include <stdio.h>\nint main(int n, char **argv) {{\n"
        f"void *library = (void *){call}{arguments};\nif (n != 2 || !library) return 1;\n"
        f'const char *(*version)(void) = (const char *(*)(void)){find}(library, "fmi{version[0]}GetVersion");\n'
        "if (!version) return 2;\nputs(version());\nreturn 0;\n}\n",
        "utf-8",
    )
    (one,) = (p for p in PLATFORMS.values() if p.fmi3 == folder)
    place = one.fmi2 if version == "2.0" else one.fmi3
    (data,) = (data for name, data in libraries(path).items() if name.startswith(place))
    library, program = tmp_path / f"model{one.suffix}", tmp_path / "load.exe"
    library.write_bytes(data)
    compiler = [sys.executable, "-m", "ziglang", "cc", "-target", one.target, str(source), "-o", str(program)]
    subprocess.run(compiler, check=True)
    options = ["-L", "/usr/aarch64-linux-gnu"] if runner.startswith("qemu") else []
    said = subprocess.run([runner, *options, program, library], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == version


@pytest.mark.nightly
def test_two_hosts_make_the_same_bytes(tmp_path: Path) -> None:
    """Another user, folder, zone, language, order of hashes and mask of files; nothing kept from the other host."""
    made = []
    for i, (zone, language) in enumerate((("Asia/Tokyo", "C"), ("America/Lima", "C.UTF-8"))):
        home = tmp_path / f"host{i}" / ("deep/er" * i)
        home.mkdir(parents=True)
        environment = {
            **os.environ,
            **{"HOME": str(home), "TZ": zone, "LC_ALL": language, "PYTHONHASHSEED": str(i), "USER": f"user{i}"},
            # what the compiler brings along is the same everywhere, and takes a minute to unfold
            **{"STICKSLIP_CACHE": str(home / "cache"), "ZIG_GLOBAL_CACHE_DIR": str(cache_folder() / "zig")},
            **{"SOURCE_DATE_EPOCH": "1700000000", "PYTHONPATH": str(Path(fmu_models.__file__).parents[1])},
        }
        code = (
            f"import os; os.umask({0o077 if i else 0o022}); from fmu_models.codegen.package import Packaging, export; "
            "export('block_on_belt', 'belt.fmu', packaging=Packaging(platforms=['linux64', 'win64']))"
        )
        subprocess.run([sys.executable, "-c", code], cwd=home, env=environment, check=True)
        made.append(home / "belt.fmu")
    one, other = (libraries(path) for path in made)
    assert {name for name in one if one[name] != other[name]} == set() and len(one) == 2
    assert made[0].read_bytes() == made[1].read_bytes()
    with zipfile.ZipFile(made[0]) as archive:
        assert b'generationDateAndTime="2023-11-14T22:13:20Z"' in archive.read("modelDescription.xml")


def test_names_of_platforms() -> None:
    assert platforms(["host"]) == (this_platform(),)
    assert platforms(["win64", "x86_64-windows", "darwin64"]) == (PLATFORMS["win64"], PLATFORMS["darwin-x86_64"])
    assert set(platforms(["all", "host"])) == set(PLATFORMS.values())


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["win32"], "FMUs for 'win32', of 32 bits, are not built"),
        (["i686-windows"], "of 32 bits"),
        (["win65"], "There is no platform 'win65'. Did you mean 'win64'"),
        ([], "No platform is named"),
    ],
)
def test_platforms_that_are_not_there(tmp_path: Path, names: list[str], message: str) -> None:
    with pytest.raises(StickslipError, match=message):
        export("block_on_belt", tmp_path / "belt.fmu", packaging=Packaging(platforms=names))
    assert not list(tmp_path.iterdir())
