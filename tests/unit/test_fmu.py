"""An opened FMU: its folder, and libraries that are missing or not ours."""

from __future__ import annotations

import gc
import zipfile
from pathlib import Path

import pytest

from fmu_models.codegen.package import built
from fmu_models.errors import StickslipError
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.system import simulate


def archive(path: Path, *entries: tuple[str | zipfile.ZipInfo, str]) -> Path:
    with zipfile.ZipFile(path, "w") as file:
        for name, text in entries:
            file.writestr(name, text)
    return path


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="no file"):
        Fmu.open(tmp_path / "absent.fmu")


def test_the_folder_goes_with_the_object() -> None:
    opened = Fmu.open(built("block_on_belt"))
    folder = opened.folder
    assert (folder / "modelDescription.xml").is_file()
    del opened
    gc.collect()
    assert not folder.exists()


def test_an_fmu_of_somebody_else_is_not_simulated(tmp_path: Path) -> None:
    from fmu_models.engine.toolchain import compile_shared, fmi_headers, this_platform

    path = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(built("block_on_belt")) as source:
        contents = {name: source.read(name) for name in source.namelist()}
    platform, _, _, suffix = this_platform()
    # the same FMU without the native face
    sources = {Path(n).name: data.decode() for n, data in contents.items() if n.endswith((".c", ".h"))}
    sources["all.c"] = sources["all.c"].replace('#include "native.c"\n', "")
    library = compile_shared(sources, tmp_path / "library")
    assert fmi_headers().is_dir()
    contents[f"binaries/{platform}/block_on_belt{suffix}"] = library.read_bytes()
    with zipfile.ZipFile(path, "w") as target:
        for name, data in contents.items():
            target.writestr(name, data)
    with pytest.raises(StickslipError, match="not exported by stickslip"):
        simulate(Fmu.open(path), 1.0)


def test_a_platform_without_binary(tmp_path: Path) -> None:
    with zipfile.ZipFile(built("block_on_belt")) as source:
        path = archive(tmp_path / "a.fmu", ("modelDescription.xml", source.read("modelDescription.xml").decode()))
    with pytest.raises(StickslipError, match="cannot be loaded"):
        simulate(Fmu.open(path), 1.0)
