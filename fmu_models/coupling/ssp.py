"""A system from SSP 1.0: a System Structure Description (.ssd), alone beside its FMUs or packed with them (.ssp).

Read are the components of the top system, its connections with their linear transformations, and parameter bindings of
components and of the system, inline or in .ssv files, with their mappings, inline or in .ssm files.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection, conversion, unit_of
from fmu_models.fmu import archive
from fmu_models.fmu.fmu import Fmu

DESCRIPTION = "SystemStructure.ssd"
MAX_XML = 32 << 20
BASE = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = {
    "ssd": f"{BASE}Description",
    "ssc": f"{BASE}Common",
    "ssv": f"{BASE}ParameterValues",
    "ssm": f"{BASE}ParameterMapping",
}
FMU = ("", "application/x-fmu-sharedlibrary")
NUMBERS = ("Real", "Integer", "Boolean", "Enumeration")


@dataclass(frozen=True)
class _Value:
    """A number of a parameter set, for a variable of a component."""

    where: str
    name: str
    value: float
    unit: str | None


def read(path: Path) -> CoupledSystem:
    """The system in ``path``. StickslipError: an unsafe archive, not SSP, a part that is missing or not supported, a
    system that does not fit together."""
    if path.suffix.lower() == ".ssd":
        return _system(path, path.parent, path)
    with temporary_folder("ssp") as folder:
        archive.unpack(path, folder)
        if not (folder / DESCRIPTION).is_file():
            raise StickslipError(f"'{path}' is not an SSP: it holds no {DESCRIPTION}.")
        system = _system(path, folder, folder / DESCRIPTION)
        for unit in system.units.values():
            # the hash is taken while the file is there
            _ = unit.fmu.sha256
        return system


def read_parameter_set(path: Path) -> list[tuple[str, float, str | None]]:
    """Names, values and units of an .ssv file. StickslipError: it cannot be read, or holds something else."""
    root = _parsed(path, f"'{path}'")
    if not root.tag.endswith("}ParameterSet"):
        raise StickslipError(f"'{path}' is no parameter set (.ssv). 'stickslip apply FIT -o FILE.ssv' writes one.")
    return [(value.name, value.value, value.unit) for value in _values(root, f"'{path}'", "")]


def converted(value: float, unit: str | None, own: str | None, what: str) -> float:
    """A value that is given in a unit, in that of its variable. StickslipError: units that do not fit; begins with
    ``what``."""
    if not unit or not own or unit == own:
        return value
    try:
        factor, offset = conversion(unit, own)
    except ValueError as error:
        raise StickslipError(f"{what} is given in {unit}, but is in {own}: {error}") from None
    return factor * value + offset


class _NoDoctype(ElementTree.TreeBuilder):
    def doctype(self, *_: object) -> None:
        # with it come entities: files of this machine read in, and a few bytes that grow to gigabytes
        raise StickslipError("it has a document type (DOCTYPE), which is not read")


def _parsed(file: Path, where: str) -> Element:
    try:
        if file.stat().st_size > MAX_XML:
            raise StickslipError(f"it has more than {MAX_XML >> 20} MB")
        return ElementTree.parse(file, ElementTree.XMLParser(target=_NoDoctype())).getroot()
    except (OSError, ElementTree.ParseError, ValueError, LookupError, StickslipError) as error:
        raise StickslipError(f"{where} cannot be read: {error}.") from error


def _system(path: Path, folder: Path, description: Path) -> CoupledSystem:
    root = _parsed(description, f"'{path}'")
    top = root.find("ssd:System", NAMESPACES)
    if not root.tag.endswith("}SystemStructureDescription") or top is None:
        raise StickslipError(f"'{path}' is not a System Structure Description of SSP 1.0: it has no System.")
    if top.find("ssd:Elements/ssd:System", NAMESPACES) is not None:
        raise StickslipError(
            f"'{path}' has systems within the system. Flatten it: components of the top system are read."
        )
    fmus: dict[str, Fmu] = {}
    bindings: dict[str, list[_Value]] = {}
    for component in top.iterfind("ssd:Elements/ssd:Component", NAMESPACES):
        name = component.get("name", "")
        where = f"'{path}': component '{name}'"
        if name in fmus:
            raise StickslipError(f"{where} is there twice; which one is meant cannot be told.")
        if component.get("type", "") not in FMU:
            raise StickslipError(f"{where} is of type {component.get('type')}; FMUs are read.")
        file = _inside(folder, component.get("source", ""), where)
        try:
            fmus[name] = Fmu.open(file)
        except StickslipError as error:
            raise StickslipError(f"{where}: {error}") from error
        bindings[name] = list(_bound(component, folder, where))
    for value in _bound(top, folder, f"'{path}': system '{top.get('name')}'"):
        unit = max((u for u in fmus if value.name.startswith(f"{u}.")), key=len, default=None)
        if unit is None:
            raise StickslipError(f"{value.where}: '{value.name}' names no parameter of a component.")
        # what the system says goes before what its components say
        bindings[unit].append(_Value(value.where, value.name[len(unit) + 1 :], value.value, value.unit))
    units = {name: _unit(name, fmu, bindings[name]) for name, fmu in fmus.items()}
    connections, outputs = _connections(top, f"'{path}'")
    experiment = root.find("ssd:DefaultExperiment", NAMESPACES)
    attributes = dict(experiment.attrib) if experiment is not None else {}
    start = _number(attributes.get("startTime", "0"), f"'{path}': startTime")
    stop = _number(attributes.get("stopTime", str(start + 20.0)), f"'{path}': stopTime")
    name = top.get("name") or path.stem
    return CoupledSystem(name, units, tuple(connections), start_time=start, stop_time=stop, outputs=tuple(outputs))


def _inside(folder: Path, source: str, where: str) -> Path:
    inside = PurePosixPath(unquote(source).removeprefix("./"))
    if not source or inside.is_absolute() or ".." in inside.parts or "\\" in source or ":" in source:
        raise StickslipError(f"{where} refers to '{source}', which is no file beside the description.")
    return folder / inside


def _number(text: str | None, where: str) -> float:
    try:
        value = {"true": 1.0, "false": 0.0}.get(str(text)) if str(text) in ("true", "false") else float(str(text))
    except ValueError:
        value = math.nan
    if value is None or not math.isfinite(value):
        raise StickslipError(f"{where} is '{text}', not a finite number.")
    return value


def _connections(top: Element, where: str) -> tuple[list[Connection], list[str]]:
    """Connections between components, and the outputs that the system shows to the outside."""
    connections, outputs = [], []
    for element in top.iterfind("ssd:Connections/ssd:Connection", NAMESPACES):
        ends = [(element.get(f"{end}Element"), element.get(f"{end}Connector", "")) for end in ("start", "end")]
        names = [f"{element}.{connector}" for element, connector in ends]
        transformations = [child.tag for child in element if child.tag.endswith("MappingTransformation")]
        if transformations:
            raise StickslipError(f"{where}: the connection {names[0]} -> {names[1]} maps values; linear ones are read.")
        if ends[0][0] is None:
            continue  # an input of the whole system, which nothing feeds
        if ends[1][0] is None:
            outputs.append(names[0])
            continue
        linear = _linear(element, f"{where}: the transformation of {names[0]} -> {names[1]}")
        connections.append(Connection(names[0], names[1], *(linear or ())))
    return connections, outputs


def _linear(element: Element, about: str) -> tuple[float, float] | None:
    """Factor and offset of the linear transformation in an element, if there is one."""
    linear = element.find("ssc:LinearTransformation", NAMESPACES)
    if linear is None:
        return None
    return _number(linear.get("factor", "1"), about), _number(linear.get("offset", "0"), about)


def _bound(element: Element, folder: Path, where: str) -> Iterator[_Value]:
    """The values bound to a component or to the system."""
    component = element.tag.endswith("}Component")
    for binding in element.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", NAMESPACES):
        # a component's own files may be named from its FMU on
        if binding.get("sourceBase", "SSD") != "SSD":
            raise StickslipError(
                f"{where}: its parameters lie in its FMU (sourceBase); put the .ssv file beside the .ssd."
            )
        values = _document(binding, "ParameterValues", "ssv:ParameterSet", folder, where)
        if values is None:
            raise StickslipError(f"{where} has a parameter binding without values.")
        mapping = _document(binding, "ParameterMapping", "ssm:ParameterMapping", folder, where)
        prefix = binding.get("prefix", "")
        for value in _values(values, where, prefix):
            yield from _mapped(value, mapping, where, strict=component)


def _document(binding: Element, tag: str, inner: str, folder: Path, where: str) -> Element | None:
    """The set or mapping of a binding: inline, or in the file it names."""
    holder = binding.find(f"ssd:{tag}", NAMESPACES)
    inline = holder.find(inner, NAMESPACES) if holder is not None else None
    if inline is not None:
        return inline
    source = binding.get("source") if tag == "ParameterValues" else holder.get("source") if holder is not None else None
    return _parsed(_inside(folder, source, where), f"{where}: '{source}'") if source else None


def _values(element: Element, where: str, prefix: str) -> Iterator[_Value]:
    for parameter in element.iterfind("ssv:Parameters/ssv:Parameter", NAMESPACES):
        name = prefix + parameter.get("name", "")
        typed = next((t for kind in NUMBERS if (t := parameter.find(f"ssv:{kind}", NAMESPACES)) is not None), None)
        if typed is None:
            raise StickslipError(f"{where}: the parameter '{name}' is no number.")
        yield _Value(where, name, _number(typed.get("value"), f"{where}: the parameter '{name}'"), typed.get("unit"))


def _mapped(value: _Value, mapping: Element | None, where: str, *, strict: bool) -> Iterator[_Value]:
    entries = mapping.iterfind("ssm:MappingEntry", NAMESPACES) if mapping is not None else ()
    mappings = [entry for entry in entries if entry.get("source") == value.name]
    if not mappings:
        # a mapping leaves out what the component does not take
        if mapping is None or not strict:
            yield value
        return
    for entry in mappings:
        linear = _linear(entry, f"{where}: the mapping of '{value.name}'")
        factor, offset = linear or (1.0, 0.0)
        yield _Value(where, entry.get("target", ""), factor * value.value + offset, None if linear else value.unit)


def _unit(name: str, fmu: Fmu, values: list[_Value]) -> Unit:
    """The values where they belong: parameters, inputs, other start values."""
    settings: dict[str, dict[str, float]] = {"parameter": {}, "input": {}, "start": {}}
    for value in values:
        variable = fmu.variables.get(value.name)
        unit = unit_of(fmu, variable) if variable is not None else None
        number = converted(value.value, value.unit, unit, f"{value.where}: '{value.name}'")
        causality = str(variable.causality) if variable is not None else "parameter"
        settings[causality if causality in ("parameter", "input") else "start"][value.name] = number
    return Unit(fmu, settings["parameter"], settings["start"], settings["input"])
