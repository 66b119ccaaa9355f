"""A system from SSP 1.0 or 2.0: a System Structure Description, by itself (.ssd) or packed with its FMUs (.ssp).

One pass over the description makes it flat: components by dotted names, for each connector what feeds it, and the
values that sets of parameters give, those of a system after those of what is in it, since they go before. What feeds a
component is then followed back through connectors of systems and signal dictionaries to a component or to a value.
"""

import warnings
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from fmu_models.base.errors import StickslipError, StickslipWarning, nearest
from fmu_models.base.temporary import claim_folder, release_folder
from fmu_models.coupling import ssp_documents as documents
from fmu_models.coupling.ssp_documents import Step, Value
from fmu_models.coupling.system import Connector, CoupledSystem, Origin, Unit
from fmu_models.coupling.wiring import Connection, unit_of
from fmu_models.fmu import archive
from fmu_models.fmu.fmu import Fmu

DESCRIPTION = "SystemStructure.ssd"
FMU = ("", "application/x-fmu-sharedlibrary")
DEEPEST = 64  # systems in one another
GIVES = {"output": True, "calculatedParameter": True, "input": False, "parameter": False}

Node = tuple[str, str]  # dotted path of an element, "" for the system itself, and a connector of it


def read(path: Path) -> CoupledSystem:
    """The system in ``path``; warns of values that nothing takes. StickslipError: an unsafe archive, not SSP, a part
    that is missing or not supported, a system that does not fit together."""
    if path.suffix.lower() == ".ssd":
        return _Reader(path, path).flat()
    folder = claim_folder("ssp")
    try:
        archive.unpack(path, folder)
        if not (folder / DESCRIPTION).is_file():
            raise StickslipError(f"'{path}' is not an SSP: it holds no {DESCRIPTION}.")
        system = _Reader(path, folder / DESCRIPTION).flat()
        for unit in system.units.values():
            # the hash is taken while the file is there
            _ = unit.fmu.sha256
    except BaseException:
        release_folder(folder)
        raise
    weakref.finalize(system.origin, release_folder, folder)
    return system


class _Reader:
    """What one pass over a description finds.

    Attributes:
        paths: of elements; of a reference to a signal dictionary that of the dictionary.
        connectors: of systems, dictionaries and components, as they are declared.
        feeds: per connector what feeds it, and what happens to the value on this way.
        values: given by sets of parameters.
    """

    def __init__(self, path: Path, file: Path) -> None:
        self.path, self.file = path, file
        self.fmus: dict[str, Fmu] = {}
        self.paths: dict[str, str] = {}
        self.connectors: dict[Node, Connector] = {}
        self.feeds: dict[Node, tuple[Node, Step]] = {}
        self.values: dict[Node, Value] = {}
        self.root = documents.parsed(file, f"'{path}'", "SystemStructureDescription")
        top = self.root.find("System")
        if top is None:
            raise StickslipError(f"'{path}' is no System Structure Description: it has no System.")
        self.name = top.get("name") or path.stem
        self.units = dict(documents.units(self.root, f"'{path}'"))
        self.element(top, "", {})

    def element(self, element: Element, at: str, dictionaries: Mapping[str, str]) -> None:
        """Note what is in an element, its values last. dictionaries: those around it, name to path."""
        where = f"'{self.path}': {element.tag.lower()} '{at or self.name}'"
        if at.count(".") > DEEPEST:
            raise StickslipError(f"{where}: more than {DEEPEST} systems in one another are not read.")
        for connector in element.iterfind("Connectors/Connector"):
            self.connectors[at, connector.get("name", "")] = _connector(connector)
        if element.tag == "Component" and (source := element.get("source")) is not None:
            if element.get("type", "") not in FMU:
                raise StickslipError(f"{where} is of type {element.get('type')}; FMUs are read.")
            file = documents.inside(self.file.parent, source, where)
            try:
                self.fmus[at] = Fmu.open(file)
            except StickslipError as error:
                raise StickslipError(f"{where}: {error}") from error
        dictionaries = {**dictionaries, **self.dictionaries(element, at, where)}
        for child in element.iterfind("Elements/*"):
            name = child.get("name", "")
            path = f"{at}.{name}" if at else name
            if path in self.paths:
                raise StickslipError(f"{where}: '{name}' is there twice; which one is meant cannot be told.")
            self.paths[path] = path
            if child.tag == "SignalDictionaryReference":
                dictionary = child.get("dictionary", "")
                if dictionary not in dictionaries:
                    hint = nearest(dictionary, dictionaries)
                    raise StickslipError(f"{where}: '{name}' refers to no signal dictionary '{dictionary}'.{hint}")
                self.paths[path] = dictionaries[dictionary]
            self.element(child, path, dictionaries)
        for connection in element.iterfind("Connections/Connection"):
            self.connect(connection, at, where)
        for binding in element.iterfind("ParameterBindings/ParameterBinding"):
            self.bind(binding, at, where)

    def dictionaries(self, element: Element, at: str, where: str) -> dict[str, str]:
        """The signal dictionaries of a system: name to the path under which their signals go."""
        paths: dict[str, str] = {}
        for holder in element.iterfind("SignalDictionaries/SignalDictionary"):
            name = holder.get("name", "")
            dictionary = documents.document(holder, "SignalDictionary", self.file.parent, where)
            if dictionary is None:
                raise StickslipError(f"{where}: the signal dictionary '{name}' is neither here nor in a file.")
            self.units |= documents.units(dictionary, where)
            paths[name] = f"{at}#{name}"
            for entry in dictionary.iterfind("DictionaryEntry"):
                self.connectors[paths[name], entry.get("name", "")] = _connector(entry)
        return paths

    def connect(self, element: Element, at: str, where: str) -> None:
        """Note what a connection feeds; which end gives is said by the kinds of the connectors."""
        ends: list[Node] = []
        gives: list[bool | None] = []
        for side in ("start", "end"):
            child, name = element.get(f"{side}Element") or "", element.get(f"{side}Connector", "")
            path = ".".join(filter(None, (at, child)))
            if child and path not in self.paths:
                names = [p.removeprefix(f"{at}.") for p in self.paths if p.startswith(at)]
                raise StickslipError(f"{where}: a connection names no element '{child}' there.{nearest(child, names)}")
            variable = self.fmus[path].variables.get(name) if path in self.fmus else None
            if not child:
                self.connectors.setdefault((at, name), Connector("input" if side == "start" else "output"))
            declared = self.connectors.get((path, name))
            kind = GIVES.get(declared.kind if declared else str(getattr(variable, "causality", "")))
            # seen from within, an input of the system gives
            gives.append(kind if child or kind is None else not kind)
            ends.append((self.paths.get(path, path), name))
        start, end = ends[::-1] if gives in ([False, True], [False, None], [None, True]) else ends
        if end in self.feeds and self.feeds[end][0] != start:
            raise StickslipError(
                f"{where}: '{_name(end)}' is fed by '{_name(self.feeds[end][0])}' already, and again by "
                f"'{_name(start)}'. An input has one source; leave one of the two out."
            )
        about = f"{where}: the transformation of {_name(start)} -> {_name(end)}"
        self.feeds[end] = start, documents.step(element, about)

    def bind(self, binding: Element, at: str, where: str) -> None:
        """Note the values of a set of parameters, which go before those noted until now."""
        holder = binding.find("ParameterMapping")
        # a component's files may be named from its FMU on
        own_folder = self.fmus[at].folder if at in self.fmus else self.file.parent
        base, base2 = (own_folder if e is not None and e.get("sourceBase") == "component" else self.file.parent
                       for e in (binding, holder))  # fmt: skip
        parameters = documents.document(binding, "ParameterSet", base, where)
        if parameters is None:
            raise StickslipError(f"{where} has a parameter binding without values.")
        mapping = documents.document(holder, "ParameterMapping", base2, where)
        self.units |= documents.units(parameters, where)
        unknown: list[str] = []
        prefix = binding.get("prefix", "")
        for value in documents.values(parameters, where, prefix, self.root):
            for target in documents.mapped(value, mapping, where, prefix):
                node = self.target(at, target.name)
                if node is not None:
                    self.values[node] = target
                elif mapping is None or target.steps:
                    unknown.append(f"'{target.name}'")
        if unknown:
            _warn(f"{where} has nothing called {', '.join(unknown)}; what its parameters say of it is ignored.")

    def target(self, at: str, name: str) -> Node | None:
        """What a name means in an element; names of elements and of variables may have dots themselves."""
        full = f"{at}.{name}" if at else name
        paths = sorted((path for path in self.paths if full.startswith(f"{path}.")), key=len, reverse=True)
        for node in ((at, name), *((path, full[len(path) + 1 :]) for path in paths)):
            fmu = self.fmus.get(node[0])
            if node in self.connectors if fmu is None else node[1] in fmu.variables:
                return node
        return None

    def way(self, node: Node) -> list[Node]:
        """From what feeds a connector in the end, a variable or a value, to the connector; empty: nothing does."""
        nodes = [node]
        while nodes[0] in self.feeds and not self.begins_with_variable(nodes):
            start = self.feeds[nodes[0]][0]
            if start in nodes:
                name = _name(start)
                raise StickslipError(f"'{self.path}': connections go round from '{name}' to itself. Break them.")
            nodes.insert(0, start)
        while nodes and nodes[0] not in self.values and not self.begins_with_variable(nodes):
            nodes.pop(0)
        return nodes

    def begins_with_variable(self, nodes: Sequence[Node]) -> bool:
        return len(nodes) > 1 and nodes[0][0] in self.fmus

    def own_unit(self, node: Node) -> str | None:
        """Unit of an FMU's variable; of another connector the one that it states."""
        fmu = self.fmus.get(node[0])
        if fmu is None:
            return self.connectors[node].unit if node in self.connectors else None
        return unit_of(fmu, fmu.variables[node[1]]) if node[1] in fmu.variables else None

    def end(self, nodes: Sequence[Node]) -> tuple[Connector, bool]:
        """What the end of a way shows, and whether units alone decide about it."""
        declared = self.connectors.get(nodes[-1], Connector("inout"))
        stated = [self.connectors[n].unit if n in self.connectors else None for n in nodes]
        own_unit = self.own_unit(nodes[0])
        if self.begins_with_variable(nodes):
            value, unit, label = None, own_unit, f"'{self.path}': {_name(nodes[0])} -> {_name(nodes[-1])}"
            hops = [(Step(label), stated[0])]
        else:
            value = self.values[nodes[0]]
            unit, label = value.unit, f"{value.where}: '{value.name}'"
            hops = [(step, stated[0] or own_unit) for step in value.steps or (Step(label),)]
        hops += [(self.feeds[n][1], unit or self.own_unit(n)) for n, unit in zip(nodes[1:], stated[1:], strict=True)]
        hops.append((Step(label), self.own_unit(nodes[-1])))
        steps: list[Step] = []
        for step, own_unit in hops:
            if not step.suppress and own_unit:
                steps.append(Step(label, line=documents.unit_line(unit, own_unit, label, self.units)))
            steps += [step] if step.changes else []
            unit = own_unit or (None if step.changes or step.suppress else unit)
        if value is not None:
            return replace(declared, unit=unit, value=documents.transformed(value, steps)), False
        factor, offset = 1.0, 0.0
        for a, b in (step.as_line for step in steps):
            factor, offset = a * factor, a * offset + b
        plain = not any(step.changes or step.suppress for step, _ in hops) and all(
            stated in (None, self.own_unit(n)) for stated, n in ((stated[0], nodes[0]), (stated[-1], nodes[-1]))
        )
        return replace(declared, unit=unit, source=_name(nodes[0]), factor=factor, offset=offset), plain

    def flat(self) -> CoupledSystem:
        """The system as units, connections, values and connectors."""
        connections: list[Connection] = []
        values: dict[str, dict[str, Value]] = {path: {} for path in self.fmus}
        connectors: dict[str, Connector] = {}
        for node in dict.fromkeys((*self.feeds, *self.values, *self.connectors)):
            nodes, name, inner = self.way(node), _name(node), node[0] in self.fmus
            if node in self.values and nodes[0] != node:
                where, source = self.values[node].where, _name(nodes[0])
                _warn(f"{where}: '{name}' is given a value, but is fed by '{source}'; the value is not used.")
            end, plain = self.end(nodes) if nodes else (self.connectors.get(node, Connector("inout")), False)
            if not inner and "#" not in node[0] and self.paths.get(node[0], node[0]) == node[0]:
                connectors[name] = end
            elif inner and end.source:
                connections.append(Connection(end.source, name, *(() if plain else (end.factor, end.offset))))
            elif inner and end.value is not None:
                values[node[0]][node[1]] = replace(self.values[nodes[0]], value=end.value)
        units = {path: _unit(fmu, values[path]) for path, fmu in self.fmus.items()}
        own_connectors = (connectors[name] for at, name in self.connectors if not at)
        outputs = dict.fromkeys(c.source for c in own_connectors if c.kind == "output" and c.source)
        experiment = self.root.find("DefaultExperiment")
        attributes = dict(experiment.attrib) if experiment is not None else {}
        start = documents.number(attributes.get("startTime", "0"), f"'{self.path}': startTime")
        stop = documents.number(attributes.get("stopTime", str(start + 20.0)), f"'{self.path}': stopTime")
        origin = Origin(self.file, self.path != self.file, units, tuple(connections))
        settings: dict[str, Any] = {"start_time": start, "stop_time": stop, "outputs": tuple(outputs)}
        return CoupledSystem(
            self.name, units, origin.connections, connectors=connectors, origin=origin, **settings
        )  # fmt: skip


def _unit(fmu: Fmu, values: Mapping[str, Value]) -> Unit:
    """The values where they belong: parameters, inputs, texts, other start values."""
    settings: dict[str, dict[str, Any]] = {"parameter": {}, "input": {}, "start": {}, "text": {}}
    for name, value in values.items():
        variable, number = fmu.variables.get(name), value.value
        causality = str(variable.causality) if variable is not None else "parameter"
        kind = causality if causality in settings else "start"
        if variable is not None and isinstance(number, str):
            declared = getattr(variable.declaredType, "items", None) or ()
            items = {str(item.name): int(item.value) for item in declared} or value.items
            if str(variable.type) in ("String", "Binary"):
                kind = "text"
            elif number in items:
                number = float(items[number])
            else:
                hint = nearest(number, items) or f" It is of type {variable.type}: give it a number."
                raise StickslipError(f"{value.where}: '{value.name}' is '{number}', which '{name}' cannot be.{hint}")
        settings[kind][name] = number
    return Unit(fmu, settings["parameter"], settings["start"], settings["input"], settings["text"])


def _connector(element: Element) -> Connector:
    typed = documents.type_of(element)
    kind = element.get("kind", "inout")
    return Connector(kind, typed.tag, typed.get("unit")) if typed is not None else Connector(kind)


def _name(node: Node) -> str:
    return ".".join(filter(None, node))


def _warn(text: str) -> None:
    warnings.warn(text, StickslipWarning, stacklevel=4)
