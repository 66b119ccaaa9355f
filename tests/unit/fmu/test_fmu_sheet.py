"""What is told of an FMU without loading it."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.report.fmu_sheet import LISTED, print_sheet, sheet

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="[bold]Pump" guid="{p}" numberOfEventIndicators="3"
    generationTool="Tool 7" description="a pump&#x9b;2J">
  <CoSimulation modelIdentifier="pump" canInterpolateInputs="true" maxOutputDerivativeOrder="1"
    canGetAndSetFMUstate="false"/>
  <TypeDefinitions><SimpleType name="Speed"><Real unit="rad/s"/></SimpleType></TypeDefinitions>
  <DefaultExperiment stopTime="3.5"/>
  <ModelVariables>
    <ScalarVariable name="n[/i]" valueReference="0" causality="input"><Real start="1" declaredType="Speed"/></ScalarVariable>
    <ScalarVariable name="on" valueReference="0" causality="parameter" variability="fixed"><Boolean start="true"/></ScalarVariable>
    <ScalarVariable name="label" valueReference="0" causality="parameter" variability="fixed"><String start="7"/></ScalarVariable>
    <ScalarVariable name="far" valueReference="3" causality="parameter" variability="fixed"><Real start="INF"/></ScalarVariable>
    MORE
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"""  # noqa: E501


@pytest.fixture
def pump(tmp_path: Path) -> Fmu:
    more = (f'<ScalarVariable name="v{i}" valueReference="{i + 9}"><Real/></ScalarVariable>' for i in range(LISTED + 5))
    with zipfile.ZipFile(tmp_path / "pump.fmu", "w") as file:
        file.writestr("modelDescription.xml", XML.replace("MORE", "".join(more)))
        # nobody may load this
        file.writestr("binaries/win64/pump.dll", "MZ")
        file.writestr("binaries/linux64/readme.txt", "")
        file.writestr("sources/pump.c", "")
    return Fmu.open(tmp_path / "pump.fmu")


def printed(content: dict[str, Any]) -> str:
    out = io.StringIO()
    print_sheet(content, Console(file=out, width=120, highlight=False))
    return out.getvalue()


def test_an_fmu_of_somebody_else(pump: Fmu) -> None:
    content = sheet(pump)
    json.dumps(content, allow_nan=False)
    assert content["interfaces"] == [
        {
            "kind": "Co-Simulation",
            "identifier": "pump",
            "capabilities": ["canInterpolateInputs", "maxOutputDerivativeOrder = 1"],
        }
    ]
    assert (content["platforms"], content["sources"], content["runs_here"]) == (["win64"], ["pump.c"], False)
    assert (content["event_indicators"], content["default_experiment"]) == (3, {"stopTime": 3.5})
    rows = {row["name"]: row for row in content["variables"]}
    assert (rows["n[/i]"]["unit"], rows["n[/i]"]["start"], rows["n[/i]"]["causality"]) == ("rad/s", 1, "input")
    assert [rows[name]["start"] for name in ("on", "label", "far", "v0")] == [True, "7", "INF", None]
    assert any("rad/s" in problem for problem in content["problems"])


def test_its_page_shows_names_as_they_are(pump: Fmu) -> None:
    text = printed(sheet(pump))
    for expected in ("[bold]Pump", "Tool 7", "n[/i]", "built when it is simulated", "win64", "and 5 more", "departs"):
        assert expected in text
    lines = [line.split() for line in text.splitlines()]
    assert ["n[/i]", "1", "rad/s", "Real"] in [line[:4] for line in lines]
    assert ["v39", "Real"] in [line[:2] for line in lines]  # without a start value
    assert "\x9b" not in text
    assert "v39" in text
    assert "v40" not in text


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_ours(version: str) -> None:
    content = sheet(Fmu.open(built("block_on_belt", fmi_version=version)))
    assert [i["kind"] for i in content["interfaces"]] == ["Model Exchange", "Co-Simulation"]
    assert content["runs_here"]
    assert content["problems"] == []
    assert "keeps to the standard" in printed(content)
    assert any((row["name"], row["unit"], row["start"]) == ("m", "kg", 1.0) for row in content["variables"])
