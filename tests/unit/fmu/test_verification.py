"""An FMU is verified by building it once more; what was altered is named."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import Packaging, export
from fmu_models.codegen.rights import Rights
from fmu_models.fmu.verification import verify


def altered(
    path: Path, to: Path, change: dict[str, tuple[bytes, bytes]], extra: dict[str, bytes] | None = None
) -> Path:
    """A copy of an archive with bytes of some entries replaced."""
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(to, "w") as target:
        for entry in source.infolist():
            old, new = change.get(entry.filename, (b"", b""))
            data = source.read(entry)
            assert old in data
            target.writestr(entry, data.replace(old, new, 1) if old else data)
        for name, data in (extra or {}).items():
            target.writestr(name, data)
    return to


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def exported(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export("block_on_belt", tmp_path_factory.mktemp("own") / "belt.fmu", fmi_version=request.param)


def test_what_was_exported_is_what_the_model_gives(exported: Path) -> None:
    found = verify(exported)
    assert found.differences == () and found.entries > 20


def test_every_option_is_read_from_the_fmu(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    licence = tmp_path / "mine.txt"
    licence.write_text("Hands off.\n\nReally.\n")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    rights = Rights("A. Author", "(c) 2026 A. Author", str(licence))
    options = {"contacts": ["disc1"], "values": {"J": 0.125}, "expose": ["states"], "packaging": Packaging(rights)}
    path = export("disc_rig", tmp_path / "rig.fmu", **options, fmi_version="2.0")
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert verify(path).differences == ()
    named = export("disc_rig", tmp_path / "named.fmu", packaging=Packaging(Rights(license="MIT")))
    assert verify(named).differences == ()


def test_what_was_altered_is_named(exported: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(exported) as archive:
        names = archive.namelist()
        (name,) = (n for n in names if n.endswith("fmi/instance.c"))
        (library,) = (n for n in names if n.startswith("binaries/"))
    source = {name: (b"STATUS_OK", b"STATUS_NO"), library: (b"stickslip_open", b"stickslip_0pen")}
    path = altered(exported, tmp_path / "belt.fmu", source, {"resources/more.txt": b"x"})
    found = verify(path).differences
    assert [text.partition(":")[0] for text in found] == ["resources/more.txt", library, name]
    assert "STATUS_NO" in found[2] and "the model gives" in found[2] and "from byte" in found[1]


def test_a_repacked_archive_is_told_from_an_altered_one(exported: Path, tmp_path: Path) -> None:
    path = tmp_path / "belt.fmu"
    with zipfile.ZipFile(exported) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            target.writestr(name, source.read(name))
    assert verify(path).differences == ("all files agree, but the archive was packed by another program",)


def test_what_is_not_ours_is_refused(exported: Path, tmp_path: Path) -> None:
    description = "modelDescription.xml"
    other = altered(
        exported, tmp_path / "a.fmu", {description: (b'generationTool="stickslip', b'generationTool="other')}
    )
    with pytest.raises(StickslipError, match="was made by other"):
        verify(other)
    renamed = altered(exported, tmp_path / "b.fmu", {description: (b'modelName="block', b'modelName="clock')})
    with pytest.raises(StickslipError, match="no model 'clock_on_belt' here"):
        verify(renamed)
