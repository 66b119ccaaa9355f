"""FMUs that crash, hang, eat memory and so on once they run; ``hostile/`` has one C file for each."""

from __future__ import annotations

from pathlib import Path

from build import build

FOLDER = Path(__file__).parent / "hostile"
NAMES = sorted(file.stem for file in FOLDER.glob("*.c"))

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="NAME" guid="NAME" numberOfEventIndicators="0">
  <ModelExchange modelIdentifier="NAME"/>
  <DefaultExperiment startTime="0" stopTime="2"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="1" initial="calculated"><Real derivative="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1"/></Outputs>
    <Derivatives><Unknown index="2"/></Derivatives>
    <InitialUnknowns><Unknown index="2"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""


def hostile(name: str, folder: Path) -> Path:
    """The FMU ``name`` in ``folder``."""
    return build(folder / f"{name}.fmu", FOLDER / f"{name}.c", DESCRIPTION.replace("NAME", name), name)
