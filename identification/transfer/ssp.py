"""Fitted values as an SSP 1.0 parameter set (.ssv), and the rig as a whole SSP (.ssp): FMU, structure and that set.

Source: Modelica Association, System Structure and Parameterization 1.0 (2019), sections 5 (.ssd) and 6 (.ssv).
"""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from fmu_models.base.digits import deviation
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole
from fmu_models.base.version import version
from fmu_models.coupling.ssp import DESCRIPTION, FMU, NAMESPACES
from identification.fitted_model.model import FittedModel
from identification.transfer.values import HandedValue

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu

PARAMETERS = "fitted.ssv"


def write_parameter_set(
    path: Path, values: Sequence[HandedValue], model: FittedModel, *, overwrite: bool = False
) -> Path:
    """Write the values as an .ssv file, with units defined by base units and what is known of each in its description.

    Raises:
        StickslipError: another suffix, or ``path`` exists and ``overwrite`` is false, or cannot be written.
    """
    if path.suffix != ".ssv":
        raise StickslipError(f"'{path}' must end in .ssv, as parameter sets do.")
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(parameter_set(values, model.fmu))
    return path


def parameter_set(values: Sequence[HandedValue], fmu: Fmu) -> bytes:
    """The .ssv document."""
    root = _root("ssv:ParameterSet", version="1.0", name="fitted", generationTool=f"stickslip {version()}")
    parameters = ElementTree.SubElement(root, _tag("ssv:Parameters"))
    for one in values:
        known = "" if one.deviation is None else f"; fitted, standard deviation {deviation(one.deviation)} {one.unit}"
        parameter = ElementTree.SubElement(
            parameters, _tag("ssv:Parameter"), name=one.target, description=one.description + known
        )
        ElementTree.SubElement(parameter, _tag("ssv:Real"), value=repr(one.value), unit=one.unit)
    _add_units(root, "ssv:Units", fmu, dict.fromkeys(one.unit for one in values))
    return _bytes(root)


def write_ssp(path: Path, values: Sequence[HandedValue], model: FittedModel, *, overwrite: bool = False) -> Path:
    """Write the rig as an SSP: its FMU as the models come, and the fitted values as a parameter set bound to it.

    Raises:
        StickslipError: another suffix, or ``path`` exists and ``overwrite`` is false, or cannot be written.
    """
    if path.suffix != ".ssp":
        raise StickslipError(f"'{path}' must end in .ssp, as packed systems do.")
    with write_whole(path, overwrite=overwrite) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        contents = {
            DESCRIPTION: _structure(model.fmu),
            PARAMETERS: parameter_set(values, model.fmu),
            f"resources/{model.fmu.path.name}": model.fmu.path.read_bytes(),
        }
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, content)
    return path


def _structure(fmu: Fmu) -> bytes:
    """The .ssd document: one component, its inputs, outputs and parameters as connectors."""
    root = _root("ssd:SystemStructureDescription", version="1.0", name="rig", generationTool=f"stickslip {version()}")
    system = ElementTree.SubElement(root, _tag("ssd:System"), name="rig")
    elements = ElementTree.SubElement(system, _tag("ssd:Elements"))
    component = ElementTree.SubElement(
        elements, _tag("ssd:Component"), name="rig", source=f"resources/{fmu.path.name}", type=FMU[1]
    )
    connectors = ElementTree.SubElement(component, _tag("ssd:Connectors"))
    shown = {"input": fmu.inputs, "output": fmu.outputs, "parameter": fmu.parameters}
    for kind, names in shown.items():
        for name in names:
            connector = ElementTree.SubElement(connectors, _tag("ssd:Connector"), name=name, kind=kind)
            ElementTree.SubElement(connector, _tag("ssc:Real"), unit=fmu.variables[name].unit or "1")
    bindings = ElementTree.SubElement(component, _tag("ssd:ParameterBindings"))
    ElementTree.SubElement(bindings, _tag("ssd:ParameterBinding"), source=PARAMETERS)
    units = dict.fromkeys(fmu.variables[name].unit or "1" for names in shown.values() for name in names)
    _add_units(root, "ssd:Units", fmu, units)
    ElementTree.SubElement(root, _tag("ssd:DefaultExperiment"), startTime="0", stopTime="20")
    return _bytes(root)


def _add_units(parent: ElementTree.Element, tag: str, fmu: Fmu, names: dict[str, None]) -> None:
    """Definitions of units by the base units, as the FMU states them."""
    stated = {unit.name: unit.baseUnit for unit in fmu.description.unitDefinitions}
    units = ElementTree.SubElement(parent, _tag(tag))
    for name in names:
        unit = ElementTree.SubElement(units, _tag("ssc:Unit"), name=name)
        base = stated.get(name)
        powers = {"kg": 0, "m": 0, "s": 0, "A": 0, "K": 0, "mol": 0, "cd": 0, "rad": 0}
        attributes = {key: str(int(power)) for key in powers if base is not None and (power := getattr(base, key, 0))}
        ElementTree.SubElement(unit, _tag("ssc:BaseUnit"), attributes)


def _tag(name: str) -> str:
    prefix, _, local = name.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


def _root(tag: str, /, **attributes: str) -> ElementTree.Element:
    for prefix, address in NAMESPACES.items():
        ElementTree.register_namespace(prefix, address)
    return ElementTree.Element(_tag(tag), attributes)


def _bytes(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
