"""Strings, and Binary of FMI 3, of an FMU by another hand: set, told at both ends of a run, kept in files."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from build import build
from models import FOLDER

from fmu_models.base.child_process import Limits
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.importer.experiment import FmuExperiment, perform
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.results import read_trajectory
from identification import cli

TWO = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="texts" guid="texts" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="texts"/>
<CoSimulation modelIdentifier="texts" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="1" causality="output" initial="exact"><Real start="1"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="101"><Real derivative="1"/></ScalarVariable>
<ScalarVariable name="label" valueReference="501" causality="parameter" variability="fixed"><String start="pump"/>
</ScalarVariable>
<ScalarVariable name="said" valueReference="502" causality="input" variability="discrete"><String start="nothing"/>
</ScalarVariable>
<ScalarVariable name="word" valueReference="503" causality="output" variability="discrete"><String/></ScalarVariable>
<ScalarVariable name="raw" valueReference="504" causality="output" variability="discrete"><String/></ScalarVariable>
<ScalarVariable name="updates" valueReference="401" causality="output" variability="discrete"><Integer/>
</ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="1"/><Unknown index="5"/><Unknown index="6"/><Unknown index="7"/></Outputs>
<Derivatives><Unknown index="2"/></Derivatives>
<InitialUnknowns><Unknown index="2"/><Unknown index="5"/><Unknown index="6"/><Unknown index="7"/></InitialUnknowns>
</ModelStructure>
</fmiModelDescription>
"""
ONE = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="texts" modelIdentifier="texts" guid="texts"
numberOfContinuousStates="1" numberOfEventIndicators="0">
<ModelVariables>
<ScalarVariable name="x" valueReference="1" causality="output"><Real start="1"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="101"><Real/></ScalarVariable>
<ScalarVariable name="label" valueReference="501" variability="parameter"><String start="pump"/></ScalarVariable>
<ScalarVariable name="said" valueReference="502" causality="input"><String start="nothing"/></ScalarVariable>
<ScalarVariable name="word" valueReference="503" causality="output"><String/></ScalarVariable>
<ScalarVariable name="raw" valueReference="504" causality="output"><String/></ScalarVariable>
<ScalarVariable name="updates" valueReference="401" causality="output"><Integer/></ScalarVariable>
</ModelVariables>
</fmiModelDescription>
"""
THREE = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="texts" instantiationToken="texts">
<ModelExchange modelIdentifier="texts"/>
<CoSimulation modelIdentifier="texts" canHandleVariableCommunicationStepSize="true" hasEventMode="true"/>
<ModelVariables>
<Float64 name="x" valueReference="1" causality="output" initial="exact" start="1"/>
<Float64 name="der(x)" valueReference="101" derivative="1"/>
<String name="label" valueReference="501" causality="parameter" variability="fixed"><Start value="pump"/></String>
<String name="said" valueReference="502" causality="input"><Start value="nothing"/></String>
<String name="word" valueReference="503" causality="output"/>
<String name="raw" valueReference="504" causality="output"/>
<Binary name="key" valueReference="505" causality="parameter" variability="fixed"><Start value="010002"/></Binary>
<Binary name="told" valueReference="506" causality="output"/>
<String name="names" valueReference="507" causality="parameter" variability="fixed"><Dimension start="2"/>
<Start value="Ada"/><Start value="Bob"/></String>
<Int32 name="updates" valueReference="401" causality="output" variability="discrete"/>
<String name="greetings" valueReference="508" causality="output"><Dimension start="2"/></String>
</ModelVariables>
<ModelStructure>
<Output valueReference="1"/><Output valueReference="401"/>
<Output valueReference="503"/><Output valueReference="504"/><Output valueReference="506"/>
<Output valueReference="508"/><ContinuousStateDerivative valueReference="101"/><InitialUnknown valueReference="101"/>
<InitialUnknown valueReference="503"/><InitialUnknown valueReference="504"/><InitialUnknown valueReference="506"/>
<InitialUnknown valueReference="508"/><InitialUnknown valueReference="401"/>
</ModelStructure>
</fmiModelDescription>
"""
METHODS = ("dop853", "co-simulation")
RAW = ("a\\xff", "")  # a byte that is no UTF-8; no text at all


@pytest.fixture(scope="module")
def fmu(fmi: int, tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    path = tmp_path_factory.mktemp("texts") / "texts.fmu"
    options = (f"-DFMI={fmi}", "-DPREFIX=texts_", "-Wno-unused-function", "-Wno-unused-variable")
    return Fmu.open(build(path, FOLDER / "texts.c", (ONE, TWO, THREE)[fmi - 1], "texts", options=options))


@pytest.mark.parametrize("method", METHODS)
def test_texts_are_set_and_told_at_both_ends(fmu: Fmu, method: str) -> None:
    if fmu.adapted and method == "co-simulation":
        pytest.skip("an FMU 1.0 has one interface")
    with Driver(fmu, method=method) as driver:
        run = driver.run(1.0, parameters={"label": "Größe"}, inputs={"said": "go"}, output_times=[0.0, 1.0])
        other = driver.run(1.0, inputs={"said": ""}, output_times=[0.0, 1.0])
        again = driver.run(1.0, output_times=[0.0, 1.0])
    assert run.texts["word"] == ("Größe, go", "Größe, go, später")
    assert run.texts["raw"] == RAW
    # every run begins from the FMU's own values
    assert other.texts["word"] == ("pump, ", "pump, , später")
    assert again.texts["word"] == ("pump, nothing", "pump, nothing, später")
    assert run["x"] == pytest.approx(np.exp([0.0, -1.0]), abs=1e-7)
    assert set(run.values) == {"x", "der(x)", "updates"}
    # a look at the texts is no second beginning
    assert run["updates"][-1] == (0 if (fmu.fmi, method) == (2, "co-simulation") else 1)
    if fmu.fmi == 3:
        assert run.texts["told"] == (b"\1\0\2", b"\xfe\xff\xfd")
        assert [run.texts[f"greetings[{i}]"][0] for i in (1, 2)] == ["Bob", "Ada"]
    assert "told" not in run.method


def test_what_is_recorded_is_chosen(fmu: Fmu) -> None:
    run = simulate_any(fmu, 1.0, record=["label"], output_times=[1.0])
    assert run.texts == {"label": ("pump", "pump")}
    assert simulate_any(fmu, 1.0, record=[], output_times=[1.0]).texts == {}


def test_bytes_and_arrays(fmu: Fmu, tmp_path: Path) -> None:
    if fmu.fmi == 2:
        pytest.skip("FMI 2 has neither")
    (tmp_path / "key.bin").write_bytes(b"\0\x10")
    for given, start in (("0x00ff", b"\0\xff"), (f"@{tmp_path / 'key.bin'}", b"\0\x10"), (b"\0", b"\0"), (b"", b"")):
        run = simulate_any(fmu, 1.0, parameters={"key": given}, output_times=[1.0])
        assert run.texts["told"] == (start, bytes(255 - byte for byte in start))
    names = {"names[2]": "Eve", "names[1]": "Cy"}
    run = simulate_any(fmu, 1.0, parameters=names, output_times=[1.0])
    assert [run.texts[f"greetings[{i}]"][1] for i in (1, 2)] == ["Eve", "Cy"]
    for options, said in (
        ({"key": 1.0}, "'key' cannot be set to 1.0: it is of type Binary. Give its bytes as hex text, such as 0x00ff"),
        ({"key": "0x0g"}, "'key' cannot be set to '0x0g'"),
        ({"key": f"@{tmp_path / 'no.bin'}"}, "There is no file"),
        ({"key": b"1" * 65}, "refuses the value of 'key'"),
        ({"names[1]": "Cy"}, r"'names' is an array of String, which FMI sets as a whole: give 'names[2]' too"),
        ({"names": "Cy"}, r"give 'names[1]' too"),
    ):
        with pytest.raises(StickslipError, match=re.escape(said)):
            simulate_any(fmu, 1.0, parameters=options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"parameters": {"label": 1.0}}, "'label' cannot be set to 1.0: it is of type String. Give it text."),
        ({"parameters": {"label": "a\0b"}}, "a String ends at its first zero byte"),
        ({"parameters": {"label": "a\udcff"}}, "a String is UTF-8, and this is not"),
        ({"parameters": {"label": "a" * 64}}, "refuses the value of 'label': it says nothing"),
        ({"parameters": {"word": "a"}}, "'word' of 'texts' is no parameter to be set: it is a discrete output"),
        ({"start": {"word": "a"}}, "'word' of 'texts' is no start value to be set"),
        ({"start": {"x": "a"}}, "'x' must be a finite number, found 'a'"),
        ({"inputs": {"said": 1.0}}, "'said' cannot be set to 1.0"),
    ],
)
def test_what_cannot_be_set(fmu: Fmu, options: dict[str, Any], said: str) -> None:
    with Driver(fmu) as driver:
        with pytest.raises(StickslipError, match=re.escape(said)):
            driver.run(1.0, **options)
        # nothing of it is left behind
        assert driver.run(1.0, output_times=[1.0]).texts["word"][0] == "pump, nothing"


def test_a_file_keeps_them(fmu: Fmu, tmp_path: Path) -> None:
    asked = FmuExperiment(1.0, parameters={"label": "a/b"}, inputs={"said": "go"}, output_times=[0.0, 1.0])
    if fmu.fmi == 3:
        asked = FmuExperiment(1.0, parameters={"label": "a/b", "key": "0x00ff"}, output_times=[0.0, 1.0])
    recording = perform(fmu, asked, limits=Limits.default())
    recording.write(tmp_path / "run.h5")
    again = read_trajectory(tmp_path / "run.h5")
    assert again.trajectory.texts == recording.trajectory.texts
    assert {"word", "raw"} <= set(again.trajectory.texts)
    assert again.provenance is not None
    assert again.provenance.parameters == {"label": "a/b"} | ({"key": b"\0\xff"} if fmu.fmi == 3 else {})
    recording.write(tmp_path / "run.csv")
    assert "word" not in (tmp_path / "run.csv").read_text()


def test_the_command_takes_and_tells_them(
    fmu: Fmu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*options: object) -> tuple[str, str]:
        line = ["stickslip", "simulate", str(fmu.path), "--until", "1", *map(str, options)]
        monkeypatch.setattr(sys, "argv", line)
        with pytest.raises(SystemExit):
            cli.main()
        return capsys.readouterr()

    label = ("--set", "label=7=b")
    out, err = said(*label, "--json", "-o", tmp_path / "run.csv")
    assert json.loads(out)["texts"]["word"] == {"start": "7=b, nothing", "end": "7=b, nothing, später"}
    assert "CSV takes numbers; word, raw" in err
    if fmu.fmi == 3:
        out, _ = said("--set", "key=0x00ff", "--json")
        assert json.loads(out)["texts"]["told"] == {"start": "0x00ff", "end": "0xff00"}
    assert "word: '7=b, nothing', at the end '7=b, nothing, später'" in said(*label)[0]
    assert "NAME=VALUE with a number" in said("--start", "x=a")[1]
