"""FMUs made by the tests, good and bad, and what is expected of a bad one."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu

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


def packed(path: Path, *entries: Entry, compression: int = zipfile.ZIP_DEFLATED) -> Path:
    """An FMU with a good modelDescription.xml, and the entries."""
    names = {entry[0] for entry in entries}
    with zipfile.ZipFile(path, "w", compression) as file:
        if "modelDescription.xml" not in names:
            file.writestr("modelDescription.xml", XML)
        for name, data in entries:
            file.writestr(name, data)
    return path


def refused(path: Path, said: str) -> None:
    with pytest.raises(StickslipError) as caught:
        Fmu.open(path)
    text = str(caught.value)
    assert re.search(said, text), text
    assert path.name in text
    assert len(text) < 600
