"""Systems as SSP has them, with whatever may be in one."""

from __future__ import annotations

import zipfile
from pathlib import Path

from coupled import exported

SPACES = " ".join(
    f'xmlns:{key}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for key, name in {
        "ssd": "Description",
        "ssc": "Common",
        "ssv": "ParameterValues",
        "ssm": "ParameterMapping",
    }.items()
)
INLINE = """<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p">
<ssv:Parameters><ssv:Parameter name="x"><ssv:Real value="1000" unit="mm"/></ssv:Parameter></ssv:Parameters>
</ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"""
FROM_FILE = (
    '<ssd:ParameterBindings><ssd:ParameterBinding source="b.ssv">%s</ssd:ParameterBinding></ssd:ParameterBindings>'
)
MAPPING = """<ssd:ParameterMapping><ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="stiffness" target="k">
<ssc:LinearTransformation factor="2"/></ssm:MappingEntry></ssm:ParameterMapping></ssd:ParameterMapping>"""
VALUES = f"""<ssv:ParameterSet {SPACES} version="1.0" name="p"><ssv:Parameters><ssv:Parameter name="stiffness">
<ssv:Real value="3"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>"""


def structure(
    first: str = INLINE, second: str = FROM_FILE % MAPPING, *, source: str = "resources/mass.fmu", begin: str = ""
) -> str:
    return f"""<?xml version="1.0" encoding="UTF-8"?>{begin}
<ssd:SystemStructureDescription {SPACES} version="1.0" name="masses"><ssd:System name="masses"><ssd:Elements>
<ssd:Component name="a" source="{source}" type="application/x-fmu-sharedlibrary">{first}</ssd:Component>
<ssd:Component name="b" source="resources/mass.fmu">{second}</ssd:Component></ssd:Elements>
<ssd:Connections>
<ssd:Connection startElement="a" startConnector="place" endElement="b" endConnector="other"/>
<ssd:Connection startElement="b" startConnector="place" endElement="a" endConnector="other">
<ssc:LinearTransformation factor="0.5" offset="0.25"/></ssd:Connection>
<ssd:Connection startElement="b" startConnector="speed" endConnector="shown"/>
</ssd:Connections></ssd:System><ssd:DefaultExperiment startTime="0" stopTime="1.5"/></ssd:SystemStructureDescription>"""


def packed(folder: Path, target: Path, description: str, **others: str) -> Path:
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("SystemStructure.ssd", description)
        archive.write(exported("mass", folder).path, "resources/mass.fmu")
        for name, text in {"b.ssv": VALUES, **others}.items():
            archive.writestr(name, text)
    return target
