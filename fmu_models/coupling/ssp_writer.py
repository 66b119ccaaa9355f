"""A coupled system as an SSP 1.0 (.ssp): its FMUs, what connects them, and parameter sets (.ssv) bound to them.

A system that was read from SSP and runs as it was read is written as it was, with its nested systems, geometry and
annotations; what is new is bound to its top system, whose values go before all others.

Source: Modelica Association, System Structure and Parameterization 1.0 (2019), sections 5 (.ssd) and 6 (.ssv).
"""

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import write_whole
from fmu_models.base.version import version
from fmu_models.coupling import ssp_documents as documents
from fmu_models.coupling.ssp import DESCRIPTION, FMU
from fmu_models.coupling.ssp_documents import REALS, WHOLE
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import split
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.start_values import check_parameter

NAMESPACES = {
    prefix: f"http://ssp-standard.org/SSP1/SystemStructure{name}"
    for prefix, name in {"ssd": "Description", "ssc": "Common", "ssv": "ParameterValues"}.items()
}
DEFAULTS, FITTED = "default", "fitted"


@dataclass(frozen=True)
class ParameterEntry:
    """A value of a parameter set, for a variable of a component, in ``unit``."""

    name: str
    value: float | str
    unit: str
    description: str
    type: str = "Real"


def defaults(unit: Unit, without: Iterable[str] = ()) -> list[ParameterEntry]:
    """The parameters of a unit with the values it runs with, and the start values and inputs that it is given."""
    starts = {name: str(unit.fmu.variables[name].start or "") for name in unit.fmu.parameters}
    # arrays, texts and what the FMU computes have no number
    values: dict[str, float | str] = {
        name: documents.number(start, f"the start value of '{name}'")
        for name, start in starts.items()
        if len(start.split()) == 1 and unit.fmu.variables[name].type not in documents.TEXTS[1:]
    }
    values |= {**unit.parameters, **unit.start, **unit.inputs, **unit.texts}
    for name, value in unit.inputs.items():
        if not isinstance(value, (float, int)):
            raise StickslipError(f"The input '{name}' changes with time, and a parameter set holds constants only.")
    left_out = set(without)
    return [_entry(unit.fmu, name, value) for name, value in values.items() if name not in left_out]


def _entry(fmu: Fmu, name: str, value: float | str) -> ParameterEntry:
    return ParameterEntry(name, value, _unit(fmu, name), fmu.variables[name].description or name, _type(fmu, name))


def parameter_sets(system: CoupledSystem, fitted: Path | None = None) -> dict[str, dict[str, list[ParameterEntry]]]:
    """Per unit the values it runs with, and those of a parameter set (.ssv) that are for it, which replace them.

    Of several units the one is meant that a name begins with, as "unit.name", or the only one with such a parameter.
    StickslipError: the file cannot be read, or a name or unit in it is no unit's.
    """
    fitted_entries: dict[str, list[ParameterEntry]] = {name: [] for name in system.units}
    for full, value, unit in documents.read_parameter_set(fitted) if fitted is not None else ():
        owner, name = _owner(system, full, str(fitted))
        fmu = system.units[owner].fmu
        factor, offset = documents.unit_line(unit, _unit(fmu, name), f"'{fitted}': '{full}'", {})
        check_parameter(fmu, name, factor * value + offset)
        fitted_entries[owner].append(_entry(fmu, name, factor * value + offset))
    sets = {}
    for name, unit in system.units.items():
        sets[name] = {DEFAULTS: defaults(unit, [entry.name for entry in fitted_entries[name]])}
        if fitted_entries[name]:
            sets[name][FITTED] = fitted_entries[name]
    return sets


def _owner(system: CoupledSystem, name: str, where: str) -> tuple[str, str]:
    units = system.units.items()
    by_prefix = [(u, name[len(u) + 1 :]) for u in system.units if name.startswith(f"{u}.")]
    owners = [(u, n) for u, n in by_prefix if n in system.units[u].fmu.parameters]
    owners = owners or [(u, name) for u, unit in units if name in unit.fmu.parameters]
    if len(owners) == 1:
        return owners[0]
    reason = "no unit has one." + nearest(name, [p for _, unit in units for p in unit.fmu.parameters])
    if owners:
        reason = f"several units have one: {', '.join(unit for unit, _ in owners)}. Name it UNIT.{name}."
    raise StickslipError(f"'{where}' has a value for '{name}': {reason}")


def parameter_set(name: str, entries: Sequence[ParameterEntry], *fmus: Fmu) -> bytes:
    """The .ssv document, with units defined by base units, as the FMUs state them."""
    root = _root("ssv:ParameterSet", version="1.0", name=name, generationTool=f"stickslip {version()}")
    parameters = SubElement(root, _tag("ssv:Parameters"))
    for entry in entries:
        parameter = SubElement(parameters, _tag("ssv:Parameter"), name=entry.name, description=entry.description)
        write = {"Real": lambda v: repr(float(v)), "Boolean": lambda v: str(bool(v)).lower()}
        text = write.get(entry.type, lambda v: v if isinstance(v, str) else str(int(v)))(entry.value)
        unit = {"unit": entry.unit} if entry.type == "Real" else {}
        SubElement(parameter, _tag(f"ssv:{entry.type}"), {"value": text, **unit})
    _add_units(root, "ssv:Units", fmus, dict.fromkeys(entry.unit for entry in entries if entry.type == "Real"))
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
    """Pack a system. sets: per unit its parameter sets by name, bound to it in this order; of one that is written as it
    was, those but DEFAULTS. StickslipError: another suffix, or ``path`` exists and ``overwrite`` is false, or cannot be
    written."""
    check_path(path)
    contents = _kept(system, sets) or _flat(system, sets)
    with write_whole(path, overwrite=overwrite) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, content)
    return path


def _kept(system: CoupledSystem, sets: Mapping[str, Mapping[str, Sequence[ParameterEntry]]]) -> dict[str, bytes] | None:
    """The files of what a system was read from, with its times and further values; None if it is another one now."""
    origin = system.origin
    if origin is None or (system.units, system.connections) != (origin.units, origin.connections):
        return None
    folder, root = origin.description.parent, documents.original(origin.description)
    named = (folder / element.get("source", "") for element in root.iter() if element.get("source"))
    files = [path for path in (folder.rglob("*") if origin.packed else named) if path.is_file()]
    contents = {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
    contents.pop(origin.description.name, None)
    entries = [
        replace(entry, name=f"{unit}.{entry.name}")
        for unit, kinds in sets.items() for kind, values in kinds.items() if kind != DEFAULTS for entry in values
    ]  # fmt: skip
    if entries:
        file = next(name for i in range(len(contents) + 1) if (name := f"{FITTED}{i or ''}.ssv") not in contents)
        contents[file] = parameter_set(FITTED, entries, *system.fmus.values())
        top = _child(root, "System")
        SubElement(
            _child(top, "ParameterBindings", "Connectors", "ElementGeometry"), _tag("ssd:ParameterBinding"), source=file
        )
    _child(root, "DefaultExperiment", "System", "Enumerations", "Units").attrib.update(_times(system))
    return {DESCRIPTION: ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True), **contents}


def _child(parent: Element, name: str, *before: str) -> Element:
    """The child of this name, or a new one behind those that go before it."""
    child = parent.find(f"ssd:{name}", NAMESPACES)
    if child is None:
        child = Element(_tag(f"ssd:{name}"))
        parent.insert(sum(c.tag in [_tag(f"ssd:{tag}") for tag in before] for c in parent), child)
    return child


def _flat(system: CoupledSystem, sets: Mapping[str, Mapping[str, Sequence[ParameterEntry]]]) -> dict[str, bytes]:
    """A new description, its parameter sets and FMUs by name."""
    sources, fmus = _sources(system), system.fmus
    alone = len(fmus) == 1
    files = {(u, name): f"{name}.ssv" if alone else f"{u}_{name}.ssv" for u, named in sets.items() for name in named}
    contents = {DESCRIPTION: _structure(system, sources, files)}
    contents |= {file: parameter_set(name, sets[unit][name], fmus[unit]) for (unit, name), file in files.items()}
    return contents | {source: fmus[unit].path.read_bytes() for unit, source in sources.items()}


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

    Inputs that nothing feeds, and the outputs to be recorded, are connectors of the system: UNIT_VARIABLE, since some
    readers take UNIT.VARIABLE for the unit's own, and with a number behind where two would have the same name.
    """
    fmus = system.fmus
    about = {"version": "1.0", "name": system.name, "generationTool": f"stickslip {version()}"}
    root = _root("ssd:SystemStructureDescription", **about)
    top = SubElement(root, _tag("ssd:System"), name=system.name)
    _child(top, "Elements")
    fed = {wire.target: wire.source for wire in system.wires}
    used = {*fed, *fed.values()}
    free = [(unit, name) for unit, fmu in fmus.items() for name in fmu.inputs if (unit, name) not in fed]
    outputs = [split(fmus, name, system.name) for name in system.outputs]
    outputs = [end for end in outputs if fmus[end[0]].variables[end[1]].causality == "output"]
    outer: dict[tuple[str, str], str] = {}
    for end in (*free, *outputs):
        names = ("_".join((*end, *number)) for number in ((), *((str(i),) for i in range(1, len(outer) + 1))))
        outer[end] = next(name for name in names if name not in outer.values())
    for (unit, name), text in outer.items():
        _add_connector(_child(top, "Connectors"), text, "input" if (unit, name) in free else "output", fmus[unit], name)
    for name, unit in system.units.items():
        component = SubElement(
            _child(top, "Elements"), _tag("ssd:Component"), name=name, source=sources[name], type=FMU[1]
        )  # fmt: skip
        kinds = {"input": unit.fmu.inputs, "output": unit.fmu.ports, "parameter": unit.fmu.parameters}
        ends = [n for u, n in (*used, *outputs) if u == name]
        for kind, names in kinds.items():
            also = sorted(n for n in ends if unit.fmu.variables[n].causality == kind)
            for variable in dict.fromkeys((*names, *also)):
                _add_connector(_child(component, "Connectors"), variable, kind, unit.fmu, variable)
        for file in (file for (of, _), file in files.items() if of == name):
            SubElement(_child(component, "ParameterBindings", "Connectors"), _tag("ssd:ParameterBinding"), source=file)
    for wire, connection in zip(system.wires, system.connections, strict=True):
        element = _add_connection(top, wire.source, wire.target)
        if connection.factor is not None:
            # it stands for what units would do
            element.set("suppressUnitConversion", "true")
            numbers = {"factor": repr(float(connection.factor)), "offset": repr(float(connection.offset))}
            SubElement(element, _tag("ssc:LinearTransformation"), numbers)
    for end, text in outer.items():
        _add_connection(top, *((("", text), end) if end in free else (end, ("", text))))
    units = (_unit(fmu, name) for fmu in fmus.values() for name in (*fmu.inputs, *fmu.ports, *fmu.parameters))
    _add_units(root, "ssd:Units", [*fmus.values()], dict.fromkeys(units))
    SubElement(root, _tag("ssd:DefaultExperiment"), _times(system))
    return _bytes(root)


def _times(system: CoupledSystem) -> dict[str, str]:
    return {"startTime": repr(float(system.start_time)), "stopTime": repr(float(system.stop_time))}


def _add_connection(top: Element, start: tuple[str, str], end: tuple[str, str]) -> Element:
    attributes = {"startElement": start[0], "startConnector": start[1], "endElement": end[0], "endConnector": end[1]}
    connections = _child(top, "Connections", "Connectors", "Elements")
    return SubElement(connections, _tag("ssd:Connection"), {name: text for name, text in attributes.items() if text})


def _add_connector(parent: Element, name: str, kind: str, fmu: Fmu, variable: str) -> None:
    connector, type_name = SubElement(parent, _tag("ssd:Connector"), name=name, kind=kind), _type(fmu, variable)
    # an enumeration's items are said by its FMU
    if fmu.variables[variable].type != "Enumeration":
        SubElement(connector, _tag(f"ssc:{type_name}"), {"unit": _unit(fmu, variable)} if type_name == "Real" else {})


def _type(fmu: Fmu, name: str) -> str:
    """The type of a variable as SSP 1.0 has it; of an enumeration that of its numbers."""
    declared = str(fmu.variables[name].type)
    return "Real" if declared in REALS else "Integer" if declared in (*WHOLE, "Enumeration") else declared


def _unit(fmu: Fmu, name: str) -> str:
    return fmu.variables[name].unit or "1"


def _add_units(parent: Element, tag: str, fmus: Sequence[Fmu], names: Mapping[str, None]) -> None:
    """Definitions of units by the base units, as the FMUs state them."""
    stated = {unit.name: unit.baseUnit for fmu in fmus for unit in fmu.description.unitDefinitions}
    units = SubElement(parent, _tag(tag)) if names else parent
    for name in names:
        unit, base = SubElement(units, _tag("ssc:Unit"), name=name), stated.get(name)
        numbers = {
            key: float(getattr(base, key, None) or 0.0) for key in (*documents.POWERS, "rad", "offset", "factor")
        }
        attributes = {key: repr(n) if key in ("offset", "factor") else str(int(n)) for key, n in numbers.items() if n}
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
