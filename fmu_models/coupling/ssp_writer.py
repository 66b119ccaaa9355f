"""A coupled system as an SSP 1.0 (.ssp): its FMUs, what connects them, and parameter sets (.ssv) bound to them.

Source: Modelica Association, System Structure and Parameterization 1.0 (2019), sections 5 (.ssd) and 6 (.ssv).
"""

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import write_whole
from fmu_models.base.version import version
from fmu_models.coupling import ssp
from fmu_models.coupling.ssp import DESCRIPTION, FMU, NAMESPACES
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.start_values import check_parameter

DEFAULTS, FITTED = "default", "fitted"


@dataclass(frozen=True)
class ParameterEntry:
    """A value of a parameter set, for a variable of a component, in ``unit``."""

    name: str
    value: float
    unit: str
    description: str


def defaults(unit: Unit, without: Iterable[str] = ()) -> list[ParameterEntry]:
    """The parameters of a unit with the values it runs with, and the start values and inputs that it is given."""
    values = {name: float(str(unit.fmu.variables[name].start)) for name in unit.fmu.parameters}
    values |= {**unit.parameters, **unit.start, **unit.inputs}
    for name, value in unit.inputs.items():
        if not isinstance(value, (float, int)):
            raise StickslipError(f"The input '{name}' changes with time, and a parameter set holds constants only.")
    left_out = set(without)
    return [
        ParameterEntry(name, value, _unit(unit.fmu, name), unit.fmu.variables[name].description or name)
        for name, value in values.items()
        if name not in left_out
    ]


def parameter_sets(system: CoupledSystem, fitted: Path | None = None) -> dict[str, dict[str, list[ParameterEntry]]]:
    """Per unit the values it runs with, and those of a parameter set (.ssv) that are for it, which replace them.

    Of several units the one is meant that a name begins with, as "unit.name", or the only one with such a parameter.

    Raises:
        StickslipError: the file cannot be read, or a name or unit in it is no unit's.
    """
    fitted_entries: dict[str, list[ParameterEntry]] = {name: [] for name in system.units}
    for full, value, unit in ssp.read_parameter_set(fitted) if fitted is not None else ():
        owner, name = _owner(system, full, str(fitted))
        variable = system.units[owner].fmu.variables[name]
        own_unit = _unit(system.units[owner].fmu, name)
        value = ssp.converted(value, unit, own_unit, f"'{fitted}': '{full}'")
        check_parameter(system.units[owner].fmu, name, value)
        fitted_entries[owner].append(ParameterEntry(name, value, own_unit, variable.description or name))
    sets = {}
    for name, unit in system.units.items():
        sets[name] = {DEFAULTS: defaults(unit, [entry.name for entry in fitted_entries[name]])}
        if fitted_entries[name]:
            sets[name][FITTED] = fitted_entries[name]
    return sets


def _owner(system: CoupledSystem, name: str, where: str) -> tuple[str, str]:
    unit, _, variable = name.partition(".")
    if unit in system.units and variable in system.units[unit].fmu.parameters:
        return unit, variable
    owners = [unit_name for unit_name, it in system.units.items() if name in it.fmu.parameters]
    if len(owners) != 1:
        parameters = [p for it in system.units.values() for p in it.fmu.parameters]
        reason = f"several units have one: {', '.join(owners)}. Name it UNIT.{name}" if owners else "no unit has one"
        raise StickslipError(
            f"'{where}' has a value for '{name}': {reason}.{'' if owners else nearest(name, parameters)}"
        )
    return owners[0], name


def parameter_set(name: str, entries: Sequence[ParameterEntry], fmu: Fmu) -> bytes:
    """The .ssv document, with units defined by base units."""
    root = _root("ssv:ParameterSet", version="1.0", name=name, generationTool=f"stickslip {version()}")
    parameters = SubElement(root, _tag("ssv:Parameters"))
    for entry in entries:
        parameter = SubElement(parameters, _tag("ssv:Parameter"), name=entry.name, description=entry.description)
        SubElement(parameter, _tag("ssv:Real"), value=repr(float(entry.value)), unit=entry.unit)
    _add_units(root, "ssv:Units", [fmu], dict.fromkeys(entry.unit for entry in entries))
    return _bytes(root)


def check_path(path: Path) -> Path:
    """Raises StickslipError: another suffix than .ssp."""
    if path.suffix != ".ssp":
        raise StickslipError(f"'{path}' must end in .ssp, as packed systems do.")
    return path


def write(
    path: Path,
    system: CoupledSystem,
    sets: Mapping[str, Mapping[str, Sequence[ParameterEntry]]],
    *,
    overwrite: bool = False,
) -> Path:
    """Pack a system. sets: per unit its parameter sets by name, bound to it in this order. StickslipError: another
    suffix, or ``path`` exists and ``overwrite`` is false, or cannot be written."""
    check_path(path)
    sources = _sources(system)
    files = {
        (unit, name): f"{name}.ssv" if len(system.units) == 1 else f"{unit}_{name}.ssv"
        for unit, named in sets.items()
        for name in named
    }
    contents: dict[str, bytes] = {DESCRIPTION: _structure(system, sources, files)}
    for (unit, name), file in files.items():
        contents[file] = parameter_set(name, sets[unit][name], system.units[unit].fmu)
    for unit, source in sources.items():
        contents[source] = system.units[unit].fmu.path.read_bytes()
    with write_whole(path, overwrite=overwrite) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, content)
    return path


def _sources(system: CoupledSystem) -> dict[str, str]:
    """Per unit where its FMU lies; units of the same FMU share it."""
    sources: dict[str, str] = {}
    by_content: dict[str, str] = {}
    for name, unit in system.units.items():
        target = f"resources/{unit.fmu.path.name}"
        if target in by_content.values() and unit.fmu.sha256 not in by_content:
            target = f"resources/{name}_{unit.fmu.path.name}"
        sources[name] = by_content.setdefault(unit.fmu.sha256, target)
    return sources


def _structure(system: CoupledSystem, sources: Mapping[str, str], files: Mapping[tuple[str, str], str]) -> bytes:
    """The .ssd document: components with their inputs, outputs and parameters as connectors, and the connections.

    Outputs of the system are named UNIT_VARIABLE, since some readers take UNIT.VARIABLE for the unit's own.
    """
    about = {"version": "1.0", "name": system.name, "generationTool": f"stickslip {version()}"}
    root = _root("ssd:SystemStructureDescription", **about)
    top = SubElement(root, _tag("ssd:System"), name=system.name)
    ends = [tuple(name.split(".", 1)) for name in system.outputs]
    outputs = [(unit, name) for unit, name in ends if name in system.units[unit].fmu.ports]
    if outputs:
        connectors = SubElement(top, _tag("ssd:Connectors"))
        for unit, name in outputs:
            _add_connector(connectors, f"{unit}_{name}", "output", system.units[unit].fmu, name)
    elements = SubElement(top, _tag("ssd:Elements"))
    for name, unit in system.units.items():
        component = SubElement(elements, _tag("ssd:Component"), name=name, source=sources[name], type=FMU[1])
        connectors = SubElement(component, _tag("ssd:Connectors"))
        kinds = {"input": unit.fmu.inputs, "output": unit.fmu.ports, "parameter": unit.fmu.parameters}
        for kind, names in kinds.items():
            for variable in names:
                _add_connector(connectors, variable, kind, unit.fmu, variable)
        bound = [file for (of, _), file in files.items() if of == name]
        if bound:
            bindings = SubElement(component, _tag("ssd:ParameterBindings"))
            for file in bound:
                SubElement(bindings, _tag("ssd:ParameterBinding"), source=file)
    if system.connections or outputs:
        connections = SubElement(top, _tag("ssd:Connections"))
        for connection in system.connections:
            ((a, x), (b, y)) = (end.split(".", 1) for end in (connection.source, connection.target))
            attributes = {"startElement": a, "startConnector": x, "endElement": b, "endConnector": y}
            element = SubElement(connections, _tag("ssd:Connection"), attributes)
            if connection.factor is not None:
                numbers = {"factor": repr(float(connection.factor)), "offset": repr(float(connection.offset))}
                SubElement(element, _tag("ssc:LinearTransformation"), numbers)
        for unit, name in outputs:
            attributes = {"startElement": unit, "startConnector": name, "endConnector": f"{unit}_{name}"}
            SubElement(connections, _tag("ssd:Connection"), attributes)
    fmus = [unit.fmu for unit in system.units.values()]
    units = (_unit(fmu, name) for fmu in fmus for name in (*fmu.inputs, *fmu.ports, *fmu.parameters))
    _add_units(root, "ssd:Units", fmus, dict.fromkeys(units))
    span = {"startTime": repr(float(system.start_time)), "stopTime": repr(float(system.stop_time))}
    SubElement(root, _tag("ssd:DefaultExperiment"), span)
    return _bytes(root)


def _add_connector(parent: Element, name: str, kind: str, fmu: Fmu, variable: str) -> None:
    connector = SubElement(parent, _tag("ssd:Connector"), name=name, kind=kind)
    if fmu.variables[variable].type in ("Int32", "Integer"):
        SubElement(connector, _tag("ssc:Integer"))
    else:
        SubElement(connector, _tag("ssc:Real"), unit=_unit(fmu, variable))


def _unit(fmu: Fmu, name: str) -> str:
    return fmu.variables[name].unit or "1"


def _add_units(parent: Element, tag: str, fmus: Sequence[Fmu], names: Iterable[str]) -> None:
    """Definitions of units by the base units, as the FMUs state them."""
    stated = {unit.name: unit.baseUnit for fmu in fmus for unit in fmu.description.unitDefinitions}
    units = SubElement(parent, _tag(tag))
    for name in names:
        unit = SubElement(units, _tag("ssc:Unit"), name=name)
        base = stated.get(name)
        powers = {"kg": 0, "m": 0, "s": 0, "A": 0, "K": 0, "mol": 0, "cd": 0, "rad": 0}
        attributes = {key: str(int(power)) for key in powers if base is not None and (power := getattr(base, key, 0))}
        if base is not None and (factor := float(base.factor or 1.0)) != 1.0:
            attributes["factor"] = repr(factor)
        SubElement(unit, _tag("ssc:BaseUnit"), attributes)


def _tag(name: str) -> str:
    prefix, _, local = name.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


def _root(tag: str, /, **attributes: str) -> Element:
    for prefix, address in NAMESPACES.items():
        ElementTree.register_namespace(prefix, address)
    return Element(_tag(tag), attributes)


def _bytes(root: Element) -> bytes:
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
