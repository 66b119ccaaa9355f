"""Origin and licence of an FMU, and the bytes it always has."""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import Packaging, export
from fmu_models.codegen.rights import Rights


def head(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        return archive.read("modelDescription.xml").decode().split(">", 2)[1]


def license_text(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        return archive.read("documentation/licenses/license.txt").decode()


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_author_and_licence_stand_in_the_description_and_the_licences_in_the_archive(
    tmp_path: Path, version: str
) -> None:
    own = tmp_path / "terms.txt"
    own.write_text("Only on Sundays.\n", "utf-8")
    rights = Rights(author="A. <Author>", copyright="(c) 2026 A. Author", license=str(own))
    path = export("block_on_belt", tmp_path / "belt.fmu", packaging=Packaging(rights), fmi_version=version)
    description = read_model_description(str(path))
    assert (description.author, description.copyright) == ("A. <Author>", "(c) 2026 A. Author")
    assert description.license == "see documentation/licenses/license.txt; engine BSD-3-Clause"
    model, engine = license_text(path).split("The engine")
    assert "Only on Sundays." in model and "(c) 2026 A. Author" in model
    assert "Redistributions of source code must retain" in engine
    assert validate_fmu(str(path)) == []


def test_without_them_the_engine_s_licence_is_told(tmp_path: Path) -> None:
    path = export("block_on_belt", tmp_path / "belt.fmu")
    assert read_model_description(str(path)).license == "BSD-3-Clause"
    assert license_text(path).startswith("BSD 3-Clause License")


def test_the_date_is_the_stated_one_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = export("block_on_belt", tmp_path / "plain.fmu")
    assert "generationDateAndTime" not in head(plain)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    dated = export("block_on_belt", tmp_path / "dated.fmu")
    assert 'generationDateAndTime="1970-01-02T00:00:00Z"' in head(dated)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "soon")
    with pytest.raises(StickslipError, match="SOURCE_DATE_EPOCH is 'soon', not a number of seconds"):
        export("block_on_belt", tmp_path / "never.fmu", packaging=Packaging(Rights(author="A")))
    assert not (tmp_path / "never.fmu").exists()


@pytest.mark.nightly
def test_the_same_model_gives_the_same_bytes_wherever_and_whenever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashes = set()
    for n, (zone, folder) in enumerate([("UTC", "a"), ("Pacific/Kiritimati", "a b/ü")]):
        monkeypatch.setenv("TZ", zone)
        monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / folder / "cache"))
        monkeypatch.setenv("LC_ALL", ["C", "de_DE.UTF-8"][n])
        path = export("block_on_belt", tmp_path / folder / "belt.fmu", packaging=Packaging(Rights(license="MIT")))
        hashes.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(hashes) == 1


def test_a_licence_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "terms.pdf").write_bytes(b"%PDF\xff\xfe")
    with pytest.raises(StickslipError, match="cannot be read as text"):
        export("block_on_belt", tmp_path / "belt.fmu", packaging=Packaging(Rights(license=str(tmp_path / "terms.pdf"))))
    assert not (tmp_path / "belt.fmu").exists()
