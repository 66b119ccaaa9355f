"""Descriptions made to do harm, or that leave it open what is meant: each is refused with a sentence that says why."""

from __future__ import annotations

import contextlib
import io
import pickle
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_fmu import XML, XML3, packed, refused

from fmu_models.base.errors import StickslipError
from fmu_models.fmu import description
from fmu_models.fmu.fmu import Fmu
from fmu_models.report.fmu_sheet import sheet

pytestmark = pytest.mark.usefixtures("nothing_left")

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
    "FMI 1.0 without a library": (XML.replace('fmiVersion="2.0"', 'fmiVersion="1.0"'), "not the name of a library"),
    "FMI 1.0 without states": (
        XML.replace('fmiVersion="2.0"', 'fmiVersion="1.0" modelIdentifier="ramp"'),
        "declares 'no' continuous states; expected 0 to 999999",
    ),
    "FMI 1.0 of a billion states": (
        XML.replace('fmiVersion="2.0"', f'fmiVersion="1.0" modelIdentifier="r" numberOfContinuousStates="{10**9}"'),
        "declares '1000000000' continuous states; expected 0 to 999999",
    ),
    "another FMI 1": (
        XML.replace('fmiVersion="2.0"', 'fmiVersion="1.1" modelIdentifier="r" numberOfContinuousStates="1"'),
        "version: 1.1",
    ),
    "FMI 4.0": (XML.replace('fmiVersion="2.0"', 'fmiVersion="4.0"'), "FMI 4.0. FMI 1.0, 2.0 and 3.0 are read"),
    "no interface": (XML.replace('<ModelExchange modelIdentifier="ramp"/>', ""), "neither Model Exchange nor"),
    "no guid": (XML.replace('guid="{ramp}"', ""), "no guid"),
    "no token": (XML3.replace('instantiationToken="{ramp}"', ""), "no instantiationToken"),
    "climbing library": (XML.replace('"ramp"', '"../../evil"'), "modelIdentifier '../../evil'"),
    "absolute library": (XML.replace('"ramp"', '"/evil"'), "not the name of a library"),
    "library of Windows": (XML.replace('"ramp"', '"C:\\evil"'), "not the name of a library"),
    "no library": (XML.replace('"ramp"', '""'), "not the name of a library"),
    "climbing library, FMI 3": (XML3.replace('"ramp"', '"../evil"'), "not the name of a library"),
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
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))  # where it was not read before
    monkeypatch.setattr(description, "MAX_XML", 200)
    refused(packed(tmp_path / "a.fmu"), "more than the 0 MB")


def test_a_description_of_too_many_elements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))  # where it was not read before
    monkeypatch.setattr(description, "MAX_TAGS", 5)
    refused(packed(tmp_path / "a.fmu"), "more than the 5 elements")


FIRST = """
import sys
from fmpy import read_model_description
from fmu_models.fmu.fmu import Fmu
read = Fmu.open(sys.argv[1]).description
theirs = read_model_description(sys.argv[1], validate=False)
for one, other in [(read, theirs), *zip(read.modelVariables, theirs.modelVariables, strict=True)]:
    for name in type(other).__slots__:
        value = getattr(other, name, None)
        if isinstance(value, str | int | float | None) and name != "__weakref__":
            assert getattr(one, name, None) == value, name
assert read.derivatives[0].variable is read.modelVariables[theirs.modelVariables.index(theirs.derivatives[0].variable)]
assert read.guid == theirs.guid
"""
AGAIN = """
import sys
from fmu_models.fmu.fmu import Fmu
assert Fmu.open(sys.argv[1]).states and "fmpy" not in sys.modules
"""


def test_a_description_is_kept_as_fmpy_reads_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    fmu = str(packed(tmp_path / "a.fmu"))
    for script in (FIRST, AGAIN):
        subprocess.run([sys.executable, "-c", script, fmu], check=True)


def test_a_kept_description_names_no_code() -> None:
    with pytest.raises(pickle.UnpicklingError, match=r"holds no builtins\.eval"):
        description._Reader(io.BytesIO(pickle.dumps(eval))).load()


def test_entities_in_the_build_description(tmp_path: Path) -> None:
    build = f'<?xml version="1.0"?>{ENTITY}<fmiBuildDescription fmiVersion="3.0">&e;</fmiBuildDescription>'
    entries = (("modelDescription.xml", XML3), ("sources/buildDescription.xml", build))
    refused(packed(tmp_path / "a.fmu", *entries), "buildDescription.xml has a document type")


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_entry_that_comes_twice_is_told(tmp_path: Path) -> None:
    fmu = Fmu.open(packed(tmp_path / "a.fmu", ("modelDescription.xml", XML), ("modelDescription.xml", XML)))
    assert fmu.problems == ["the archive holds 'modelDescription.xml' more than once, with the same contents"]


OF_NO_ELEMENTS = XML3.replace('start="0"/>', 'start=""><Dimension start="0"/></Float64>')


@pytest.mark.parametrize("xml", [XML, XML3, OF_NO_ELEMENTS])
def test_a_good_one_opens_without_problems(tmp_path: Path, xml: str) -> None:
    fmu = Fmu.open(packed(tmp_path / "a.fmu", ("modelDescription.xml", xml), ("resources/", ""), ("resources/a", "1")))
    assert (fmu.states, fmu.problems) == (["x"], [])


def test_departures_are_told_and_do_not_refuse(tmp_path: Path) -> None:
    xml = XML.replace('<Real start="0"/>', '<Real start="0" unit="m" vendor="1"/>')
    fmu = Fmu.open(packed(tmp_path / "a.fmu", ("modelDescription.xml", xml)))
    assert any("vendor" in problem for problem in fmu.problems)
    assert any('unit "m"' in problem for problem in fmu.problems)


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
