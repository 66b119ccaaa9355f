"""Archives made to do harm: each is refused with a sentence that says what was found, and nothing stays unpacked."""

from __future__ import annotations

import contextlib
import io
import re
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_models.errors import StickslipError
from fmu_models.report.fmu_sheet import sheet
from fmu_models.simulation import archive, description
from fmu_models.simulation.fmu import Fmu

LOCAL = archive.LOCAL_HEADER
Entry = tuple[str | zipfile.ZipInfo, str | bytes]

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Ramp" guid="{ramp}" numberOfEventIndicators="0">
  <ModelExchange modelIdentifier="ramp"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="1"><Real derivative="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Derivatives><Unknown index="2"/></Derivatives>
    <InitialUnknowns><Unknown index="2"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""
XML3 = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Ramp" instantiationToken="{ramp}">
  <ModelExchange modelIdentifier="ramp"/>
  <ModelVariables>
    <Float64 name="time" valueReference="9" causality="independent"/>
    <Float64 name="x" valueReference="0" initial="exact" start="0"/>
    <Float64 name="der(x)" valueReference="1" derivative="0"/>
  </ModelVariables>
  <ModelStructure><ContinuousStateDerivative valueReference="1"/><InitialUnknown valueReference="1"/></ModelStructure>
</fmiModelDescription>
"""


@pytest.fixture(autouse=True)
def nothing_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Whatever happened: no unpacked folder stays, and no file is written beside the archive."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield
    assert not list(folder.iterdir())
    assert not list(tmp_path.rglob("evil*"))


def packed(path: Path, *entries: Entry, compression: int = zipfile.ZIP_DEFLATED) -> Path:
    """An FMU with a good modelDescription.xml, and the entries."""
    names = {entry[0] for entry in entries}
    with zipfile.ZipFile(path, "w", compression) as file:
        if "modelDescription.xml" not in names:
            file.writestr("modelDescription.xml", XML)
        for name, data in entries:
            file.writestr(name, data)
    return path


def named(name: str) -> zipfile.ZipInfo:
    """An entry whose name the constructor does not mend."""
    entry = zipfile.ZipInfo("x")
    entry.filename = entry.orig_filename = name
    return entry


def of_kind(kind: int) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo("resources/thing")
    entry.external_attr = (kind | 0o777) << 16
    return entry


def refused(path: Path, said: str) -> None:
    with pytest.raises(StickslipError) as caught:
        Fmu.open(path)
    text = str(caught.value)
    assert re.search(said, text), text
    assert path.name in text
    assert len(text) < 600


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
    "trailing dot": ("resources./a", "Windows drops"),
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
        (("a", "a"), "'a' twice"),
        (("modelDescription.xml", "modelDescription.xml"), "twice"),
        (("a/b", "a/./b"), "twice"),
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


ENTITY = '<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]>'
LAUGHS = "<!DOCTYPE a [<!ENTITY a 'ha'>" + "".join(f"<!ENTITY {c}{c} '&a;&a;'>" for c in "bcdefg") + "]>"
ROOT = XML.partition("<fmiModelDescription")[2]
DESCRIPTIONS: dict[str, tuple[str | bytes, str]] = {
    "external entity": (XML.replace("?>", f"?>{ENTITY}", 1), "DOCTYPE"),
    "internal entities": (XML.replace("?>", f"?>{LAUGHS}", 1), "DOCTYPE"),
    "external document type": (XML.replace("?>", '?><!DOCTYPE a SYSTEM "http://x/">', 1), "DOCTYPE"),
    "in UTF-16": (XML.replace("UTF-8", "UTF-16").replace("?>", f"?>{ENTITY}", 1).encode("utf-16"), "DOCTYPE"),
    "in UTF-7": (XML.replace("UTF-8", "UTF-7"), "encoding"),
    "not XML": ("hello", "cannot be read"),
    "empty": ("", "cannot be read"),
    "cut": (XML[:300], "cannot be read"),
    "bad UTF-8": (XML.replace("Ramp", "R\xff").encode("latin-1"), "cannot be read"),
    "another root": ("<html/>", "describes 'html'"),
    "no version": (XML.replace('fmiVersion="2.0"', ""), "no fmiVersion"),
    "FMI 1.0": (XML.replace('fmiVersion="2.0"', 'fmiVersion="1.0"'), "FMI 1.0. FMI 2.0 and 3.0 are read"),
    "FMI 4.0": (XML.replace('fmiVersion="2.0"', 'fmiVersion="4.0"'), "FMI 4.0. FMI 2.0 and 3.0 are read"),
    "no interface": (XML.replace('<ModelExchange modelIdentifier="ramp"/>', ""), "neither Model Exchange nor"),
    "no guid": (XML.replace('guid="{ramp}"', ""), "no guid"),
    "no token": (XML3.replace('instantiationToken="{ramp}"', ""), "no instantiationToken"),
    "climbing library": (XML.replace('"ramp"', '"../../evil"'), "modelIdentifier '../../evil'"),
    "absolute library": (XML.replace('"ramp"', '"/evil"'), "not the name of a library"),
    "library of Windows": (XML.replace('"ramp"', '"C:\\evil"'), "not the name of a library"),
    "no library": (XML.replace('"ramp"', '""'), "not the name of a library"),
    "climbing library, FMI 3": (XML3.replace('"ramp"', '"../evil"'), "not the name of a library"),
    "scheduled only": (XML3.replace("ModelExchange", "ScheduledExecution"), "Scheduled Execution only"),
    "variable 0": (XML.replace('<Unknown index="2"', '<Unknown index="0"'), "counts from 1"),
    "negative dependency": (XML.replace('index="2"', 'index="2" dependencies="-1"'), "counts from 1"),
    "variable 9": (XML.replace('<Unknown index="2"', '<Unknown index="9"'), "cannot be read"),
    "unknown reference": (
        XML3.replace('Derivative valueReference="1"', 'Derivative valueReference="5"'),
        "read: KeyErr",
    ),
    "derivative of nothing": (XML.replace('derivative="1"', ""), "does not say of which"),
    "derivative of 9": (XML.replace('derivative="1"', 'derivative="9"'), "does not exist"),
    "two variables x": (XML.replace('"der(x)"', '"x"'), "two variables 'x'"),
    "reference of 40 bits": (XML.replace('valueReference="1"', f'valueReference="{1 << 40}"'), "32 bits"),
    "negative indicators": (XML.replace('Indicators="0"', 'Indicators="-1"'), "-1 event indicators"),
    "a billion indicators": (XML.replace('Indicators="0"', 'Indicators="1000000000"'), "event indicators"),
    "indicators in words": (XML.replace('Indicators="0"', 'Indicators="two"'), "cannot be read"),
    "a huge array": (
        XML3.replace('start="0"/>', 'start="0"><Dimension start="99999"/><Dimension start="99999"/></Float64>'),
        r"shape \(99999, 99999\)",
    ),
    "no variables": (re.sub("<ModelVariables>.*</ModelVariables>", "", XML, flags=re.DOTALL), "cannot be read"),
    "deep": ("<a>" * 1000, "describes 'a'"),
    "deep inside": (XML.replace("<ModelVariables>", "<a>" * 1000), "nested"),
}


@pytest.mark.parametrize("case", DESCRIPTIONS)
def test_descriptions(tmp_path: Path, case: str) -> None:
    xml, said = DESCRIPTIONS[case]
    refused(packed(tmp_path / "a.fmu", ("modelDescription.xml", xml)), said)


def test_no_description(tmp_path: Path) -> None:
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("model.xml", XML)
    refused(path, "no modelDescription.xml")
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("ramp/modelDescription.xml", XML)
    refused(path, "lies in 'ramp': pack the folder's contents")


def test_a_huge_description(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(description, "MAX_XML", 200)
    refused(packed(tmp_path / "a.fmu"), "more than the 0 MB")


def test_a_description_of_too_many_elements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(description, "MAX_TAGS", 5)
    refused(packed(tmp_path / "a.fmu"), "more than the 5 elements")


def test_entities_in_the_build_description(tmp_path: Path) -> None:
    build = f'<?xml version="1.0"?>{ENTITY}<fmiBuildDescription fmiVersion="3.0">&e;</fmiBuildDescription>'
    entries = (("modelDescription.xml", XML3), ("sources/buildDescription.xml", build))
    refused(packed(tmp_path / "a.fmu", *entries), "buildDescription.xml has a document type")


@pytest.mark.parametrize("xml", [XML, XML3])
def test_a_good_one_opens_without_problems(tmp_path: Path, xml: str) -> None:
    fmu = Fmu.open(packed(tmp_path / "a.fmu", ("modelDescription.xml", xml), ("resources/", ""), ("resources/a", "1")))
    assert (fmu.states, fmu.problems) == (["x"], [])


def test_departures_are_told_and_do_not_refuse(tmp_path: Path) -> None:
    xml = XML.replace('<Real start="0"/>', '<Real start="0" unit="m" vendor="1"/>')
    fmu = Fmu.open(packed(tmp_path / "a.fmu", ("modelDescription.xml", xml)))
    assert any("vendor" in problem for problem in fmu.problems)
    assert any('unit "m"' in problem for problem in fmu.problems)


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


TOKENS = [
    "-1",
    "0",
    "1",
    "2",
    "99",
    "1e999",
    "nan",
    "",
    " ",
    "x",
    "der(x)",
    "Real",
    "Float64",
    "<a/>",
    ">",
    '"',
    "Unknown",
]
WORDS = re.compile(r"[\w.()-]+")


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from([XML, XML3]), st.lists(st.tuples(st.integers(0, 200), st.sampled_from(TOKENS)), max_size=4))
def test_any_words_in_the_description_are_survived(tmp_path: Path, xml: str, changes: list[tuple[int, str]]) -> None:
    for at, token in changes:
        found = list(WORDS.finditer(xml))
        word = found[at % len(found)]
        xml = xml[: word.start()] + token + xml[word.end() :]
    path = packed(tmp_path / "a.fmu", ("modelDescription.xml", xml))
    with contextlib.suppress(StickslipError):
        fmu = Fmu.open(path)
        assert all(isinstance(problem, str) for problem in fmu.problems)
        fmu.suggested_times()
        sheet(fmu)
