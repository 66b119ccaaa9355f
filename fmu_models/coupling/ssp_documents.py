"""Documents of SSP (.ssd, .ssv, .ssm, .ssb): read safely, judged by their schema, and the values, mappings and units in
them.

SSP 1.0 and 2.0 share names of elements and namespaces. Tags are given without the namespaces of SSP; those of
annotations keep theirs.
Source: Modelica Association, System Structure and Parameterization 1.0 (2019) and 2.0 (2024).
"""

from __future__ import annotations

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
KINDS = {
    "SystemStructureDescription": ("Description", "System Structure Description (.ssd)"),
    "ParameterSet": ("ParameterValues", "parameter set (.ssv)"),
    "ParameterMapping": ("ParameterMapping", "parameter mapping (.ssm)"),
    "SignalDictionary": ("SignalDictionary", "signal dictionary (.ssb)"),
}
REALS = ("Real", "Float64", "Float32")
WHOLE = ("Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))
TYPES = (*REALS, *WHOLE, "Boolean", "Enumeration", "String", "Binary")
POWERS = ("kg", "m", "s", "A", "K", "mol", "cd")  # an angle is a number

Scalar = float | str
Units = Mapping[str, tuple[tuple[int, ...], float, float]]  # by name: powers of base units, factor, offset


@dataclass(frozen=True)
class Transformation:
    """What happens to a value on its way: units converted unless ``suppress``, then u = factor y + offset, or the entry
    of a table."""

    where: str
    suppress: bool = False
    linear: tuple[float, float] | None = None
    table: Mapping[Scalar, Scalar] | None = None

    def apply(self, value: Scalar) -> Scalar:
        """The value transformed. StickslipError: the table lacks it, or text is to be multiplied."""
        if self.table is not None:
            if value not in self.table:
                entries = ", ".join(map(str, self.table))
                raise StickslipError(f"{self.where}: the mapping has no entry for {value}, only for {entries}. Add it.")
            return self.table[value]
        if self.linear is None:
            return value
        if isinstance(value, str):
            raise StickslipError(f"{self.where}: '{value}' is no number, and a linear transformation takes numbers.")
        return self.linear[0] * value + self.linear[1]

    @property
    def changes(self) -> bool:
        """Whether it does something beside converting units."""
        return self.linear is not None or self.table is not None

    @property
    def as_line(self) -> tuple[float, float]:
        """Factor and offset. StickslipError: the table is no line."""
        if self.table is None:
            return self.linear or (1.0, 0.0)
        points = [(x, y) for x, y in self.table.items() if not isinstance(x, str) and not isinstance(y, str)]
        (x, y), (x1, y1) = points[0] if points else (0.0, 0.0), points[-1] if points else (1.0, 1.0)
        factor = (y1 - y) / (x1 - x) if x1 != x else 1.0
        if len(points) < len(self.table) or any(factor * (a - x) + y != b for a, b in points):
            raise StickslipError(
                f"{self.where} maps values by a table that is no line; such are read for parameters, and between "
                "variables where factor and offset say the same. Put the table into an FMU between the two."
            )
        return factor, y - factor * x


@dataclass(frozen=True)
class Value:
    """A value of a parameter set: a number, or text (of a String, or the name of an enumeration's item).

    ``items``: numbers by name of the enumeration's items, where the document says them. ``steps``: what it goes through
    before it reaches the variable.
    """

    where: str
    name: str
    value: Scalar
    unit: str | None = None
    items: Mapping[str, int] = field(default_factory=dict)
    steps: tuple[Transformation, ...] = ()


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
    builder = ElementTree.TreeBuilder(insert_comments=True)
    return ElementTree.parse(file, ElementTree.XMLParser(target=builder)).getroot()


@cache
def _schema(kind: str) -> Any:
    from lxml import etree  # pyright: ignore  # compiled, without types

    folder = Path(str((find_spec("fmpy") or find_spec("lxml")).origin)).parent / "ssp" / "schema"  # pyright: ignore
    return etree.XMLSchema(etree.parse(str(folder / f"SystemStructure{kind}.xsd")))


def parsed(file: Path, where: str, kind: str) -> Element:
    """The root of a document of a kind of KINDS. StickslipError: it cannot be read, is of another kind, or breaks the
    schema of SSP 1; begins with ``where``."""
    try:
        if file.stat().st_size > MAX_XML:
            raise StickslipError(f"it has more than {MAX_XML >> 20} MB")
        text = file.read_bytes()
        root = ElementTree.fromstring(text, ElementTree.XMLParser(target=_Builder()))
    except (OSError, ElementTree.ParseError, ValueError, LookupError, StickslipError) as error:
        raise StickslipError(f"{where} cannot be read: {error}.") from error
    if root.tag != kind:
        found = KINDS[root.tag][1] if root.tag in KINDS else f"<{root.tag}>"
        advice = " 'stickslip apply FIT -o FILE.ssv' writes one." if kind == "ParameterSet" else ""
        raise StickslipError(f"{where} is no {KINDS[kind][1]}: it is {found}.{advice}")
    if (root.get("version") or "1").startswith("1"):
        _judge(text, where)
    return root


def _judge(text: bytes, where: str) -> None:
    """Refuse what breaks the schema of SSP 1.0, also in the documents inside."""
    from lxml import etree  # pyright: ignore  # compiled, without types

    try:
        root = etree.fromstring(text)
    except etree.XMLSyntaxError as error:
        raise StickslipError(f"{where} cannot be read: {error}.") from error
    for element in root.iter(*(f"{{*}}{tag}" for tag in KINDS)):
        space = NAMESPACE.match(element.tag)
        # the holder of a mapping has the same name in the namespace of descriptions
        if space is None or space[1] != KINDS[NAMESPACE.sub("", element.tag)][0]:
            continue
        schema = _schema(space[1])
        part = root if element is root else etree.fromstring(etree.tostring(element, with_tail=False))
        if not schema.validate(part):
            error = schema.error_log[0]
            line = error.line + (0 if element is root else element.sourceline - 1)
            found = NAMESPACE.sub("", error.message)
            raise StickslipError(f"{where}, line {line}, is not valid SSP 1.0: {found} Correct it.")


def inside(folder: Path, source: str | None, where: str) -> Path:
    """The file that a document names. StickslipError: it is not in the folder or below it; begins with ``where``."""
    source = source or ""
    path = PurePosixPath(unquote(source).removeprefix("./"))
    if not source or path.is_absolute() or ".." in path.parts or "\\" in source or ":" in source:
        raise StickslipError(f"{where} refers to '{source}', which is no file beside the description.")
    return folder / path


def document(holder: Element | None, kind: str, folder: Path, where: str) -> Element | None:
    """The set, mapping or dictionary that an element holds, or that is in the file which it names; else None."""
    if holder is None:
        return None
    inline = holder.find(f"ParameterValues/{kind}" if kind == "ParameterSet" else kind)
    if inline is not None:
        return inline
    source = holder.get("source")
    return parsed(inside(folder, source, where), f"{where}: '{source}'", kind) if source else None


def number(text: str | None, where: str) -> float:
    """A finite number, or a Boolean as 0 or 1. StickslipError: neither; begins with ``where``."""
    try:
        value = {"true": 1.0, "false": 0.0}.get(str(text))
        value = float(str(text)) if value is None else value
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise StickslipError(f"{where} is '{text}', not a finite number.")
    return value


def type_of(element: Element) -> Element | None:
    """The child that says the type of a connector, a parameter or an entry of a dictionary."""
    return next((child for child in element if child.tag in TYPES), None)


def values(parameters: Element, where: str, prefix: str = "", known: Element | None = None) -> Iterator[Value]:
    """The values of a set; ``known``: a description with further enumerations."""
    items = enumerations(known) | enumerations(parameters)
    for parameter in parameters.iterfind("Parameters/Parameter"):
        name = prefix + parameter.get("name", "")
        typed = type_of(parameter)
        about = f"{where}: the parameter '{name}'"
        if typed is None or typed.get("value") is None:
            raise StickslipError(f"{about} has no value of a type that is read ({', '.join(TYPES)}; no arrays).")
        text = str(typed.get("value"))
        is_text = typed.tag in ("Enumeration", "String", "Binary")
        of = items.get(typed.get("name", ""), {}) if typed.tag == "Enumeration" else {}
        value = text if is_text else number(text, about)
        yield Value(where, name, value, typed.get("unit") if typed.tag in REALS else None, of)


def mapped(value: Value, mapping: Element | None, where: str) -> list[Value]:
    """A value under the names that a mapping gives it, or else under its own."""
    entries = mapping.iterfind("MappingEntry") if mapping is not None else ()
    about = f"{where}: the mapping of '{value.name}'"
    return [
        replace(value, name=entry.get("target", ""), steps=(transformation(entry, about),))
        for entry in entries
        if entry.get("source") == value.name
    ] or [value]


def transformed(value: Value, steps: Iterable[Transformation]) -> Scalar:
    """The value after all steps; text passes conversions of units, and meets tables of numbers as its item's number."""
    end = value.value
    for step in steps:
        if isinstance(end, str) and step.table is not None and end not in step.table:
            end = float(value.items[end]) if end in value.items else end
        if not isinstance(end, str) or step.linear != (1.0, 0.0):
            end = step.apply(end)
    return end


def read_parameter_set(path: Path) -> list[tuple[str, float, str | None]]:
    """Names, values and units of an .ssv file. StickslipError: it cannot be read, or holds something else than
    numbers."""
    found = list(values(parsed(path, f"'{path}'", "ParameterSet"), f"'{path}'"))
    for value in found:
        if isinstance(value.value, str):
            raise StickslipError(f"'{path}': the parameter '{value.name}' is no number.")
    return [(value.name, float(value.value), value.unit) for value in found]


def enumerations(root: Element | None) -> dict[str, dict[str, int]]:
    """Numbers of the items of the enumerations that a document defines, by name of both."""
    found = root.iterfind("Enumerations/Enumeration") if root is not None else ()
    return {
        e.get("name", ""): {i.get("name", ""): int(number(i.get("value"), "an item")) for i in e.iterfind("Item")}
        for e in found
    }


def transformation(element: Element, where: str) -> Transformation:
    """What a connection or an entry of a mapping does to its value."""
    suppress = element.get("suppressUnitConversion") in ("true", "1")
    for child in element:
        if child.tag == "LinearTransformation":
            line = number(child.get("factor", "1"), where), number(child.get("offset", "0"), where)
            return Transformation(where, suppress, line)
        if child.tag.endswith("MappingTransformation"):
            texts = child.tag.startswith("Enumeration")
            table: dict[Scalar, Scalar] = {}
            for entry in child.iterfind("MapEntry"):
                source, target = (entry.get(end, "") for end in ("source", "target"))
                table[source if texts else number(source, where)] = target if texts else number(target, where)
            return Transformation(where, suppress, table=table)
    return Transformation(where, suppress)


def units(root: Element, where: str) -> Units:
    """The units that a document defines by base units."""
    defined = {}
    for unit in root.iterfind("Units/Unit"):
        base = unit.find("BaseUnit")
        if base is not None:
            about = f"{where}: the unit '{unit.get('name')}'"
            powers = tuple(int(number(base.get(power, "0"), about)) for power in POWERS)
            factor, offset = number(base.get("factor", "1"), about), number(base.get("offset", "0"), about)
            if factor == 0.0:
                raise StickslipError(f"{about} has the factor 0.")
            defined[unit.get("name", "")] = (powers, factor, offset)
    return defined


def unit_line(unit: str | None, own: str | None, what: str, known: Units) -> tuple[float, float]:
    """Factor and offset from a unit to another, by their definitions where both have one, otherwise by their names.
    StickslipError: units that do not fit; begins with ``what``."""
    if not unit or not own or unit == own:
        return 1.0, 0.0
    try:
        if unit in known and own in known:
            (one, factor, offset), (two, factor2, offset2) = known[unit], known[own]
            if one != two:
                raise ValueError("these measure different quantities. Connect other variables, or correct the units.")
            return factor / factor2, (offset - offset2) / factor2
        return conversion(unit, own)
    except ValueError as error:
        raise StickslipError(f"{what} is given in {unit}, but is in {own}: {error}") from None
