"""Documents of SSP (.ssd, .ssv, .ssm, .ssb): read safely, judged by their schema, and what is in them.

SSP 1.0 and 2.0 share their elements. Tags are given without the namespaces of SSP; those of annotations keep theirs.
Source: Modelica Association, System Structure and Parameterization 1.0 (2019) and 2.0 (2024).
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.wiring import conversion

MAX_XML = 32 << 20
NAMESPACE = re.compile(r"\{http://ssp-standard\.org/SSP\d/SystemStructure(\w+)\}")
SET, MAPPING = "ParameterSet", "ParameterMapping"
SCHEMAS = {"SystemStructureDescription": "Description", SET: "ParameterValues", MAPPING: MAPPING}
SCHEMAS |= {"SignalDictionary": "SignalDictionary"}
WORDS = {SET: "parameter set (.ssv)", "SystemStructureDescription": "System Structure Description (.ssd)"}
REALS = ("Real", "Float64", "Float32")
WHOLE = ("Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))
TEXTS = ("Enumeration", "String", "Binary")
POWERS = ("kg", "m", "s", "A", "K", "mol", "cd")  # an angle is a number

Scalar = float | str
Units = dict[str, tuple[tuple[float, ...], float, float]]  # by name: powers of base units, factor, offset


@dataclass(frozen=True)
class Step:
    """On the way of a value: units are converted unless ``suppress``, then it is put on a line or into a table."""

    where: str
    suppress: bool = False
    line: tuple[float, float] | None = None
    table: Mapping[Scalar, Scalar] | None = None

    @property
    def changes(self) -> bool:
        """Whether it does something beside converting units."""
        return self.line is not None or self.table is not None

    @property
    def as_line(self) -> tuple[float, float]:
        """Factor and offset. StickslipError: the table is no line."""
        if self.table is None:
            return self.line or (1.0, 0.0)
        points = [(x, y) for x, y in self.table.items() if not isinstance(x, str) and not isinstance(y, str)]
        if points:
            (x, y), (x1, y1) = points[0], points[-1]
            factor = (y1 - y) / ((x1 - x) or 1.0)
            if len(points) == len(self.table) and all(factor * (a - x) + y == b for a, b in points):
                return factor, y - factor * x
        raise StickslipError(
            f"{self.where} maps values by a table that is no line; such are read for parameters. Between variables "
            "give factor and offset, or put the table into an FMU between the two."
        )


@dataclass(frozen=True)
class Value:
    """A number or a text (also the name of an enumeration's item, with the numbers of its ``items`` where the document
    says them), and the steps that it goes through before it reaches the variable."""

    where: str
    name: str
    value: Scalar
    unit: str | None = None
    items: Mapping[str, int] = field(default_factory=dict)
    steps: tuple[Step, ...] = ()


class _Builder(ElementTree.TreeBuilder):
    """Tags without the namespaces of SSP, and no document type."""

    def start(self, tag: str, attrs: dict[str, str], /) -> Element:
        return super().start(NAMESPACE.sub("", tag), attrs)

    def end(self, tag: str, /) -> Element:
        return super().end(NAMESPACE.sub("", tag))

    def doctype(self, *_: object) -> None:
        # with it come entities: files of this machine read in, and a few bytes that grow to gigabytes
        raise StickslipError("it has a document type (DOCTYPE), which is not read")


def original(file: Path) -> Element:
    """The root of a document that has been read, with its namespaces and comments, whose prefixes are kept."""
    for _, (prefix, address) in ElementTree.iterparse(file, ("start-ns",)):
        if not re.fullmatch(r"ns\d+", prefix):
            ElementTree.register_namespace(prefix, address)
    return ElementTree.parse(
        file, ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))
    ).getroot()


def parsed(file: Path, where: str, kind: str) -> Element:
    """The root of a document of a kind of SCHEMAS. StickslipError: it cannot be read, is of another kind, or breaks the
    schema of SSP 1; begins with ``where``."""
    try:
        if file.stat().st_size > MAX_XML:
            raise StickslipError(f"it has more than {MAX_XML >> 20} MB")
        text = file.read_bytes()
        root = ElementTree.fromstring(text, ElementTree.XMLParser(target=_Builder()))
        complaint = _complaint(text) if (root.get("version") or "1").startswith("1") else ""
    except (OSError, SyntaxError, ValueError, LookupError, StickslipError) as error:
        raise StickslipError(f"{where} cannot be read: {error}.") from error
    if root.tag != kind:
        advice = " 'stickslip apply FIT -o FILE.ssv' writes one." if kind == SET else ""
        raise StickslipError(f"{where} is no {WORDS.get(kind, kind)} of SSP: it is <{root.tag}>.{advice}")
    if complaint:
        raise StickslipError(f"{where}, {complaint}")
    return root


@cache
def _schema(kind: str) -> Any:
    from lxml import etree  # pyright: ignore  # compiled, without types

    package = find_spec("fmpy")
    assert package is not None and package.origin is not None  # every FMU is read by it
    return etree.XMLSchema(etree.parse(str(Path(package.origin).parent / f"ssp/schema/SystemStructure{kind}.xsd")))


def _complaint(text: bytes) -> str:
    """Where a document, or one inside it, breaks the schema of SSP 1.0."""
    from lxml import etree  # pyright: ignore  # compiled, without types

    root = etree.fromstring(text)
    for element in root.iter(*(f"{{*}}{tag}" for tag in SCHEMAS)):
        space = NAMESPACE.match(element.tag)
        # the holder of a mapping has the same name in the namespace of descriptions
        if space is not None and space[1] == SCHEMAS[NAMESPACE.sub("", element.tag)]:
            schema = _schema(space[1])
            if not schema.validate(root if element is root else etree.fromstring(etree.tostring(element))):
                line = schema.error_log[0].line + (0 if element is root else element.sourceline - 1)
                message = NAMESPACE.sub("", schema.error_log[0].message)
                return f"line {line}, is not valid SSP 1.0: {message} Correct it."
    return ""


def inside(folder: Path, source: str, where: str) -> Path:
    """The file that a document names. StickslipError: it is not in the folder or below it; begins with ``where``."""
    path = PurePosixPath(unquote(source).removeprefix("./"))
    if not source or path.is_absolute() or ".." in path.parts or "\\" in source or ":" in source:
        raise StickslipError(f"{where} refers to '{source}', which is no file beside the description. Put it there.")
    return folder / path


def document(holder: Element | None, kind: str, folder: Path, where: str) -> Element | None:
    """The document that an element holds, or that is in the file which it names; otherwise None."""
    inline = holder.find(f"ParameterValues/{kind}" if kind == SET else kind) if holder is not None else None
    source = holder.get("source") if holder is not None else None
    if inline is not None or not source:
        return inline
    return parsed(inside(folder, source, where), f"{where}: '{source}'", kind)


def number(text: str | None, where: str) -> float:
    """A finite number, or a Boolean as 0 or 1. StickslipError: neither; begins with ``where``."""
    try:
        value = float({"true": "1", "false": "0"}.get(str(text), str(text)))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise StickslipError(f"{where} is '{text}', not a finite number.")
    return value


def type_of(element: Element) -> Element | None:
    """The child that says the type of a connector, a parameter or an entry of a dictionary."""
    return next((child for child in element if child.tag in (*REALS, *WHOLE, "Boolean", *TEXTS)), None)


def values(parameters: Element, where: str, prefix: str = "", root: Element | None = None) -> Iterator[Value]:
    """The values of a set; root: a description that may define their enumerations."""
    enumerations = [
        e for holder in (root, parameters) if holder is not None for e in holder.iterfind("Enumerations/Enumeration")
    ]
    items = {
        e.get("name"): {i.get("name", ""): int(number(i.get("value"), where)) for i in e.iterfind("Item")}
        for e in enumerations
    }
    for parameter in parameters.iterfind("Parameters/Parameter"):
        name = prefix + parameter.get("name", "")
        typed, about = type_of(parameter), f"{where}: the parameter '{name}'"
        if typed is None or (text := typed.get("value")) is None:
            raise StickslipError(f"{about} has no single value. Arrays, and types that are not of FMI, are not read.")
        value = text if typed.tag in TEXTS else number(text, about)
        yield Value(where, name, value, typed.get("unit"), items.get(typed.get("name"), {}))


def mapped(value: Value, mapping: Element | None, where: str, prefix: str = "") -> list[Value]:
    """A value under the names that a mapping gives it, or else under its own. Mappings name it with its prefix; those
    of some tools without."""
    candidates = mapping.findall("MappingEntry") if mapping is not None else []
    entries = [entry for entry in candidates if entry.get("source") == value.name]
    entries = entries or [entry for entry in candidates if entry.get("source") == value.name.removeprefix(prefix)]
    steps = [step(entry, f"{where}: the mapping of '{value.name}'") for entry in entries]
    return [replace(value, name=e.get("target", ""), steps=(s,)) for e, s in zip(entries, steps, strict=True)] or [
        value
    ]


def step(element: Element, where: str) -> Step:
    """What a connection or an entry of a mapping does to its value."""
    suppress = element.get("suppressUnitConversion") in ("true", "1")
    for child in element:
        if child.tag == "LinearTransformation":
            line = number(child.get("factor", "1"), where), number(child.get("offset", "0"), where)
            return Step(where, suppress, line)
        if child.tag.endswith("MappingTransformation"):
            texts = child.tag.startswith("Enumeration")
            ends = [[entry.get(end, "") for end in ("source", "target")] for entry in child.iterfind("MapEntry")]
            table = {x if texts else number(x, where): y if texts else number(y, where) for x, y in ends}
            return Step(where, suppress, table=table)
    return Step(where, suppress)


def transformed(value: Value, steps: Iterable[Step]) -> Scalar:
    """The value after all steps; text passes conversions of units, and meets tables of numbers as its item's number.
    StickslipError: a table lacks it, or text is put on a line."""
    end = value.value
    for step in steps:
        if step.table is not None:
            end = float(value.items[str(end)]) if end not in step.table and end in value.items else end
            if end not in step.table:
                entries = ", ".join(map(str, step.table))
                raise StickslipError(f"{step.where} has no entry for {end}, only for {entries}. Add it.")
            end = step.table[end]
        elif step.line not in (None, (1.0, 0.0)):
            if isinstance(end, str):
                raise StickslipError(f"{step.where}: '{end}' is no number, which a linear transformation needs.")
            end = step.as_line[0] * end + step.as_line[1]
    return end


def read_parameter_set(path: Path) -> list[tuple[str, float, str | None]]:
    """Names, values and units of an .ssv file. StickslipError: it cannot be read, or holds something else than
    numbers."""
    rows: list[tuple[str, float, str | None]] = []
    for value in values(parsed(path, f"'{path}'", SET), f"'{path}'"):
        if isinstance(value.value, str):
            raise StickslipError(f"'{path}': the parameter '{value.name}' is no number.")
        rows.append((value.name, value.value, value.unit))
    return rows


def units(root: Element, where: str) -> Units:
    """The units that a document defines by base units."""
    defined: Units = {}
    for unit in root.iterfind("Units/Unit"):
        if (base := unit.find("BaseUnit")) is not None:
            name, about = unit.get("name", ""), f"{where}: the unit '{unit.get('name')}'"
            powers = tuple(number(base.get(power, "0"), about) for power in POWERS)
            factor = number(base.get("factor", "1"), about)
            if factor == 0.0:
                raise StickslipError(f"{about} has the factor 0.")
            defined[name] = powers, factor, number(base.get("offset", "0"), about)
    return defined


def unit_line(unit: str | None, own: str | None, what: str, known: Units) -> tuple[float, float]:
    """Factor and offset from a unit to another, by their definitions where both have one, otherwise by their names.
    StickslipError: units that do not fit; begins with ``what``."""
    if not unit or not own or unit == own:
        return 1.0, 0.0
    try:
        if unit not in known or own not in known:
            return conversion(unit, own)
        (powers, factor, offset), (powers2, factor2, offset2) = known[unit], known[own]
        if powers != powers2:
            raise ValueError("these measure different quantities. Connect other variables, or correct the units.")
        return factor / factor2, (offset - offset2) / factor2
    except ValueError as error:
        raise StickslipError(f"{what} is given in {unit}, but is in {own}: {error}") from None
