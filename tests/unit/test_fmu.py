"""Opening an FMU from somebody else: nothing escapes its folder."""

from __future__ import annotations

import gc
import zipfile
from pathlib import Path

import pytest

from fmu_models.codegen.package import built
from fmu_models.errors import StickslipError
from fmu_models.simulation import fmu as module
from fmu_models.simulation.fmu import Fmu
from fmu_models.simulation.system import simulate


def archive(path: Path, *entries: tuple[str | zipfile.ZipInfo, str]) -> Path:
    with zipfile.ZipFile(path, "w") as file:
        for name, text in entries:
            file.writestr(name, text)
    return path


@pytest.mark.parametrize("name", ["../evil", "a/../../evil", "/evil", "..\\evil", "C:/evil", "C:\\evil"])
def test_a_path_that_escapes(tmp_path: Path, name: str) -> None:
    entry = zipfile.ZipInfo("x")
    entry.filename = name  # the constructor would mend backslashes on some platforms
    path = archive(tmp_path / "a.fmu", (entry, "evil"))
    with pytest.raises(StickslipError, match="outside its folder"):
        Fmu.open(path)
    assert not list(tmp_path.parent.rglob("evil"))


def test_a_link(tmp_path: Path) -> None:
    entry = zipfile.ZipInfo("resources/link")
    entry.external_attr = 0o120777 << 16
    with pytest.raises(StickslipError, match="link"):
        Fmu.open(archive(tmp_path / "a.fmu", (entry, "/etc/passwd")))


def test_too_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = archive(tmp_path / "a.fmu", ("a", "x" * 600), ("b", "x" * 600))
    monkeypatch.setattr(module, "MAX_BYTES", 1000)
    with pytest.raises(StickslipError, match="more than"):
        Fmu.open(path)
    monkeypatch.setattr(module, "MAX_FILES", 1)
    with pytest.raises(StickslipError, match="2 files"):
        Fmu.open(path)


def test_what_is_no_fmu(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="no file"):
        Fmu.open(tmp_path / "absent.fmu")
    text = tmp_path / "text.fmu"
    text.write_text("hello")
    with pytest.raises(StickslipError, match="zip"):
        Fmu.open(text)
    with pytest.raises(StickslipError, match="no modelDescription"):
        Fmu.open(archive(tmp_path / "empty.fmu", ("a", "")))
    with pytest.raises(StickslipError, match="cannot be read"):
        Fmu.open(archive(tmp_path / "broken.fmu", ("modelDescription.xml", "<fmiModelDescription")))
    entity = '<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]><a>&e;</a>'
    with pytest.raises(StickslipError, match="document type"):
        Fmu.open(archive(tmp_path / "entity.fmu", ("modelDescription.xml", entity)))


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
