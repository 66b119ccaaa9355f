"""Archives made to do harm: each is refused with a sentence that says what was found, and nothing stays unpacked."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import stat
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_fmu import XML, packed, refused

from fmu_models.base.errors import StickslipError
from fmu_models.fmu import archive
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.start_values import copy_with_start_values

pytestmark = pytest.mark.usefixtures("nothing_left")
LOCAL = archive.LOCAL_HEADER
WITH_PARAMETER = XML.replace(
    "</ModelVariables>",
    '<ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed" initial="exact">'
    '<Real start="1"/></ScalarVariable></ModelVariables>',
)


def named(name: str) -> zipfile.ZipInfo:
    """An entry whose name the constructor does not mend."""
    entry = zipfile.ZipInfo("x")
    entry.filename = entry.orig_filename = name
    return entry


def of_kind(kind: int) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo("resources/thing")
    entry.external_attr = (kind | 0o777) << 16
    return entry


NAMES = {
    "climbs": ("../evil", "outside its folder"),
    "climbs from inside": ("a/../../evil", "outside its folder"),
    "absolute": ("/evil", "outside its folder"),
    "backslash": ("..\\evil", "outside its folder"),
    "drive": ("C:/evil", "outside its folder"),
    "drive and backslash": ("C:\\evil", "outside its folder"),
    "server": ("\\\\server\\share\\evil", "outside its folder"),
    "stream": ("resources/a.txt:evil", "outside its folder"),
    "NUL": ("resources/a.txt\0.exe", "control characters"),
    "line feed": ("resources/a\nb", "control characters"),
    "escape": ("resources/\x1b[2J", "control characters"),
    "nothing": ("", "empty"),
    "dot": (".", "empty"),
    "long": ("a" * 300, "too long"),
    "deep": ("a/" * 600 + "b", "too long"),
    "device": ("resources/AUX", "device on Windows"),
    "device with suffix": ("sources/con.c", "device on Windows"),
    "port": ("com1", "device on Windows"),
    "blank": ("resources/a ", "Windows drops"),
}


@pytest.mark.parametrize("case", NAMES)
def test_names(tmp_path: Path, case: str) -> None:
    name, said = NAMES[case]
    # a name with a NUL cannot be written by zipfile: put it in afterwards
    path = packed(tmp_path / "a.fmu", (named(name.replace("\0", "\x01")), "evil"))
    path.write_bytes(path.read_bytes().replace(b"a.txt\x01.exe", b"a.txt\x00.exe"))
    refused(path, said)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (stat.S_IFLNK, "the link"),
        (stat.S_IFIFO, "the pipe"),
        (stat.S_IFSOCK, "the socket"),
        (stat.S_IFCHR, "the device"),
        (stat.S_IFBLK, "the device"),
    ],
)
def test_what_is_no_plain_file(tmp_path: Path, kind: int, said: str) -> None:
    refused(packed(tmp_path / "a.fmu", (of_kind(kind), "/etc/passwd")), said)


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("resources/A", "resources/a"), "case does not count"),
        (("MODELDESCRIPTION.XML", "modelDescription.xml"), "case does not count"),
        (("stra\u00dfe", "STRASSE"), "case does not count"),
        (("\u00e9", "e\u0301"), "case does not count"),
        (("Resources/a", "resources/b"), "one on Windows"),
        (("a", "a/b"), "both as a file and as a folder"),
        (("a/b", "A"), "both as a file and as a folder"),
    ],
)
def test_entries_that_fall_on_one_file(tmp_path: Path, names: tuple[str, ...], said: str) -> None:
    refused(packed(tmp_path / "a.fmu", *((name, XML) for name in names)), said)


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("names", [("a", "a"), ("modelDescription.xml", "modelDescription.xml"), ("a/b", "a/./b")])
def test_an_entry_that_comes_twice(tmp_path: Path, names: tuple[str, str]) -> None:
    one, other = names
    for contents in (XML + " ", "", XML.replace("Ramp", "Pump")):
        refused(packed(tmp_path / "a.fmu", (one, XML), (other, contents)), "twice, with different contents")
    path = packed(tmp_path / "b.fmu", (one, XML), (other, XML))
    assert (Fmu.open(path).folder / one).read_text() == XML
    assert archive.repeated(path) == [one]
    assert archive.repeated(packed(tmp_path / "c.fmu", (one, XML))) == []


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_entry_that_comes_twice_is_changed_once(tmp_path: Path) -> None:
    twice = [("modelDescription.xml", WITH_PARAMETER)] * 2
    fmu = Fmu.open(packed(tmp_path / "a.fmu", *twice))
    copy = Fmu.open(copy_with_start_values(fmu, tmp_path / "b.fmu", {"k": 2.0}))
    assert float(str(copy.variables["k"].start)) == 2.0
    assert archive.repeated(copy.path) == []


def test_a_copy_with_start_values_has_all_other_files_folders_between_them_or_not(tmp_path: Path) -> None:
    path = packed(
        tmp_path / "a.fmu", ("modelDescription.xml", WITH_PARAMETER), ("resources/", ""), ("resources/a", "1")
    )
    copy = Fmu.open(copy_with_start_values(Fmu.open(path), tmp_path / "b.fmu", {"k": 2.0}))
    assert (copy.folder / "resources" / "a").read_text() == "1"


def edited(path: Path, edit: Callable[[bytearray, int, int], None]) -> Path:
    """The archive of one more entry 'x', stored, with ``edit(bytes, local header, directory entry)`` done to it."""
    packed(path, ("x", "harmless"), compression=zipfile.ZIP_STORED)
    data = bytearray(path.read_bytes())
    local, central = data.rindex(b"PK\x03\x04"), data.rindex(b"PK\x01\x02")
    edit(data, local, central)
    path.write_bytes(data)
    return path


def test_encrypted(tmp_path: Path) -> None:
    def edit(data: bytearray, local: int, central: int) -> None:
        data[local + 6] |= 1
        data[central + 8] |= 1

    refused(edited(tmp_path / "a.fmu", edit), "'x' is encrypted")


def test_two_names_for_one_entry(tmp_path: Path) -> None:
    def edit(data: bytearray, local: int, _: int) -> None:
        data[local + LOCAL : local + LOCAL + 1] = b"y"

    refused(edited(tmp_path / "a.fmu", edit), "differ")


def test_damaged_data(tmp_path: Path) -> None:
    def edit(data: bytearray, local: int, _: int) -> None:
        data[local + LOCAL + 3] ^= 0xFF

    refused(edited(tmp_path / "a.fmu", edit), "CRC")


def test_damaged_deflate_stream(tmp_path: Path) -> None:
    path = packed(tmp_path / "a.fmu", ("x", "harmless " * 50))
    data = bytearray(path.read_bytes())
    start = data.rindex(b"PK\x03\x04") + LOCAL + 1
    data[start : start + 4] = b"\xff\xff\xff\xff"
    path.write_bytes(data)
    refused(path, "damaged")


def test_a_size_that_lies(tmp_path: Path) -> None:
    def edit(data: bytearray, local: int, central: int) -> None:
        for at in (local + 22, central + 24):
            data[at : at + 4] = struct.pack("<I", 1000)

    refused(edited(tmp_path / "a.fmu", edit), "ends after 8 of 1000 bytes|CRC")


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_compression(tmp_path: Path, method: int) -> None:
    refused(packed(tmp_path / "a.fmu", compression=method), "packed by (bzip2|lzma)")


def test_unknown_compression(tmp_path: Path) -> None:
    def edit(data: bytearray, local: int, central: int) -> None:
        data[local + 8] = data[central + 10] = 97

    refused(edited(tmp_path / "a.fmu", edit), "packed by method 97")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
def test_truncated(tmp_path: Path, share: float) -> None:
    path = packed(tmp_path / "a.fmu", ("x", "harmless" * 100))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    refused(path, "not an FMU, or damaged")


def test_the_front_cut_off(tmp_path: Path) -> None:
    path = packed(tmp_path / "a.fmu", ("x", "harmless" * 100))
    path.write_bytes(path.read_bytes()[60:])
    refused(path, "its beginning is missing")


@pytest.mark.parametrize("data", [b"", b"hello", b"PK\x03\x04", b"PK\x05\x06" + bytes(18)])
def test_what_is_no_archive(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.fmu"
    path.write_bytes(data)
    refused(path, "zip archive|no modelDescription")


def test_a_bomb(tmp_path: Path) -> None:
    refused(packed(tmp_path / "a.fmu", ("zeros", bytes(20 << 20))), "grows [0-9]+-fold to 20 MB")


def test_too_much_in_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = packed(tmp_path / "a.fmu", ("a", "x" * 600), ("b", "x" * 600))
    monkeypatch.setattr(archive, "MAX_BYTES", 1000)
    refused(path, "more than 0 MB")


def test_a_directory_that_claims_little(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Entries that share one kernel: their stated sizes are small, their sum is not."""
    kernel = zlib.compressobj(wbits=-15)
    data = kernel.compress(bytes(1000)) + kernel.flush()
    path = tmp_path / "a.fmu"
    packed(path, ("kernel", bytes(1000)), ("copy", bytes(1000)))
    raw = bytearray(path.read_bytes())
    assert data in raw
    first = raw.index(b"PK\x03\x04", 10)
    struct.pack_into("<I", raw, raw.rindex(b"PK\x01\x02") + 42, first)
    path.write_bytes(raw)
    refused(path, "share their packed bytes")


def test_too_many_files(tmp_path: Path) -> None:
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as file:
        for i in range(archive.MAX_FILES + 1):
            file.writestr(f"{i}", "")
    refused(path, "holds 10001 files")


def test_a_bomb_inside(tmp_path: Path) -> None:
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("zeros", bytes(20 << 20))
    refused(packed(tmp_path / "a.fmu", ("resources/data.zip", inner.getvalue())), "archive 'resources/data.zip' in it")


def test_a_bomb_inside_that_only_claims(tmp_path: Path) -> None:
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as file:
        for i in range(4):
            file.writestr(f"{i}", "")
    data = bytearray(inner.getvalue())
    for found in re.finditer(b"PK\x01\x02", bytes(data)):
        struct.pack_into("<I", data, found.start() + 24, 1 << 30)
    refused(packed(tmp_path / "a.fmu", ("resources/data.zip", bytes(data))), "unpacks to 4096 MB")


def test_harmless_archives_inside_stay_packed(tmp_path: Path) -> None:
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as file:
        file.writestr("table.csv", "1,2")
    entries = (("resources/data.zip", inner.getvalue()), ("resources/like.zip", b"PK\x03\x04 and no archive"))
    fmu = Fmu.open(packed(tmp_path / "a.fmu", *entries))
    assert (fmu.folder / "resources" / "data.zip").read_bytes() == inner.getvalue()
    assert not (fmu.folder / "resources" / "table.csv").exists()


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255)), min_size=1, max_size=8))
def test_damage_anywhere_is_survived(tmp_path: Path, changes: list[tuple[int, int]]) -> None:
    path = packed(tmp_path / "a.fmu", ("x", "harmless " * 50), compression=zipfile.ZIP_STORED)
    data = bytearray(path.read_bytes())
    for at, value in changes:
        data[at % len(data)] = value
    path.write_bytes(data)
    with contextlib.suppress(StickslipError):
        Fmu.open(path)


def test_more_than_the_size_stated_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A deflated entry that states 10 bytes and holds a megabyte: no more than 10 are written."""
    path = packed(tmp_path / "a.fmu", ("x", bytes(1 << 20)))
    data = bytearray(path.read_bytes())
    for at in (data.rindex(b"PK\x03\x04") + 22, data.rindex(b"PK\x01\x02") + 24):
        struct.pack_into("<I", data, at, 10)
    path.write_bytes(data)
    seen: list[int] = []
    rmtree = shutil.rmtree

    def measured(folder: Path, ignore_errors: bool) -> None:
        seen.append(sum(file.stat().st_size for file in Path(folder).rglob("x")))
        rmtree(folder, ignore_errors=ignore_errors)

    monkeypatch.setattr(shutil, "rmtree", measured)
    refused(path, "CRC")
    assert seen and seen[0] <= 10


def test_a_trailing_dot_is_refused_on_windows_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = packed(tmp_path / "a.fmu", ("modelDescription.xml", XML), ("resources./a", "text"))
    assert (Fmu.open(path).folder / "resources." / "a").read_text() == "text"
    monkeypatch.setattr(archive.sys, "platform", "win32")
    refused(path, "Windows drops")
