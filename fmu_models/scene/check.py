"""What a scene says, held against its model: names, units, bounds, contacts that are needed, a start that is possible.

    title = "Disc rig, class a"
    source = "..."
    model = "disc_rig"
    contacts = ["disc0"]
    outputs = ["F0", "energy"]
    stop_time = "25 s"
    [laws]         disc0 = "lugre"
    [parameters]   N0 = "8 N"
    [free]         mu_s0 = 0.65
    [drives]       w0 = "8 rpm"
    [start]        theta = "5 deg"
    [compute]      kind = "cycle"
    [[reference]]  at = 0.41, period = 1.0, tolerance = 1e-9

KEYS says what each means. A value is a number in the unit of the model or a text of number and unit.
"""

import re
from collections.abc import Collection, Mapping
from itertools import pairwise
from typing import Any, cast

import sympy

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.formula import Formula
from fmu_models.base.toml_document import Document
from fmu_models.codegen.package import variant
from fmu_models.fmu.load import named_map
from fmu_models.language.maps import Map
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Quantity
from fmu_models.language.values import check_values
from fmu_models.lowering.lower import lower
from fmu_models.scene.check_compute import Names, checked_compute
from fmu_models.scene.scene import Drive, Reference, Scene
from fmu_models.simulation.inputs import signal_of
from fmu_models.simulation.signal import Signal, knots

# what the reference of the manual says of each key or table
KEYS = {
    "title": "what it is",
    "source": "where it comes from; the model's source if left out",
    "model": "its name, as `stickslip models` or `stickslip maps` lists them, or `my_model.py` beside the scene",
    "contacts": "those in use; all if left out, `[]` for none",
    "outputs": "those to show beside the states; if left out those that the model declares, "
    "without energy, powers and forces",
    "stop_time": "end of the run, which begins at 0 s; of a map, how many steps it makes",
    "laws": 'per contact another law: its name, such as `disc0 = "lugre"`, or `my_law.py` beside the scene',
    "parameters": "fixed: constants of the code, as is every parameter that is named nowhere; an input here is held, "
    "and a constant too",
    "free": "parameters that stay parameters of the FMU, with their start values",
    "drives": 'inputs: a constant, `{ from = 0, to = "1 rad/s", begin = 0, end = "5 s" }` or '
    '`{ times = [0, 5], values = [0, 1] }`, or a column of a log beside the scene, `"log.csv:speed"`',
    "start": "states at 0 s, and `<stop>_memory` for a start inside a stop that remembers its speed of entry",
    "compute": "`kind` and its keys, below",
    "reference": "known results by name, `[[reference]]` for each: numbers, or formulas of parameters, as "
    '`period = "2*pi*sqrt(m/k)"`; `tolerance` (relative, 1e-9 if left out), `at` where something is varied, '
    "`panel` where there are some, `source`",
    "sensors": "of the bench that `stickslip emulate` emulates, below",
}


def checked_scene(document: Document) -> Scene:
    """The scene of a document. StickslipError: what is wrong, with its line, what was expected and what to do."""
    document.check_keys(KEYS)
    return _Check(document).scene()


class _Check:
    def __init__(self, document: Document) -> None:
        self.doc = document
        self.full: Mechanism = self._load()
        self.kept, self.laws = self._variant()
        parameters: dict[str, Quantity] = {p.name: p for p in self.kept.parameters}
        inputs: dict[str, Quantity] = {u.name: u for u in self.kept.inputs}
        self.parameters, self.inputs = parameters, inputs
        self.lost = self._lost()

    def scene(self) -> Scene:
        doc = self.doc
        free = self._values("free", self.parameters, "parameter")
        parameters = self._values("parameters", {**self.parameters, **self.inputs}, "parameter")
        drives = self._drives()
        for name in parameters:
            for table, given in (("free", free), ("drives", drives)):
                if name in given:
                    raise doc.fault(
                        f"'{name}' is both fixed in [parameters] and given in [{table}]. Keep it in [parameters] to "
                        f"fold it into the code, or in [{table}] to be able to change it.",
                        "parameters",
                        name,
                    )
        defaults = {n: p.value for n, p in self.parameters.items() if n not in free}  # pyright: ignore[reportAttributeAccessIssue]
        scene = Scene(
            name=_identifier(doc.path.stem),
            title=doc.text("title"),
            source=doc.text("source", default=self.full.source),
            model=doc.text("model"),
            contacts=self.contacts,
            laws=self.laws,
            fixed={**defaults, **parameters},
            free=free,
            drives=drives,
            start=self._start(),
            outputs=self._outputs(),
            stop_time=self._stop_time(),
            compute=checked_compute(doc, self._names(free, drives)),
            references=self._references({**defaults, **parameters, **free}),
            of_map=isinstance(self.full, Map),
            sensors=doc.table("sensors"),
            lines={key: doc.line("sensors", key) or 0 for key in doc.table("sensors")},
            path=str(doc.path),
            units={name: quantity.unit for name, quantity in {**self.parameters, **self.inputs}.items()},
        )
        self._check_values(scene)
        self._check_start(scene)
        return scene

    # the model

    def _load(self) -> Mechanism:
        model, beside = self.doc.reference("model"), self.doc.path.parent
        try:
            return variant(cast("str", named_map(model, beside) or model), beside=beside)
        except StickslipError as error:
            raise self.doc.fault(str(error), "model") from error

    def _variant(self) -> tuple[Mechanism, dict[str, str]]:
        """The model with the contacts in use and their laws."""
        doc = self.doc
        self.contacts = doc.names("contacts")
        laws = {contact: doc.reference(contact, "laws") for contact in doc.table("laws")}
        contacts = [contact.name for contact in self.full.contacts]
        for name in self.contacts or ():
            if name not in contacts:
                raise doc.fault(f"{self.full.name} has no contact '{name}'.{nearest(name, contacts)}", "contacts", name)
        for name in laws:
            if name in contacts and self.contacts is not None and name not in self.contacts:
                raise doc.fault(
                    f"'{name}' gets a law but is left out. Add it to contacts, or take it out of [laws].", "laws", name
                )
        if self.contacts is not None:
            self.contacts = tuple(name for name in contacts if name in self.contacts)
        try:
            return variant(self.full, self.contacts, laws, beside=doc.path.parent), laws
        except StickslipError as error:
            raise doc.fault(str(error), *(("laws", next(iter(laws))) if laws else ("contacts",))) from error

    def _lost(self) -> dict[str, str]:
        """What went with the contacts left out: name of a quantity, and its contact."""
        if self.contacts is None:
            return {}
        symbols: Any = self.kept.symbols
        available = {s.name for s in symbols} | {o.name for o in self.kept.outputs}
        lost = {}
        for contact in self.full.contacts:
            if contact.name in self.contacts:
                continue
            symbols = {*getattr(contact, "symbols", ()), *getattr(contact, "shown", ())}
            outputs = [o for o in self.full.outputs if o.expression.free_symbols & symbols]
            names = {*(str(s.name) for s in symbols), *(o.name for o in outputs), f"{contact.name}_force"}
            lost |= {name: contact.name for name in names if name not in available}
        return lost

    def _stranger(self, kind: str, name: str, names: Collection[str], *path: str | int) -> StickslipError:
        """The error for a name that the scene's system does not have."""
        if name in self.lost:
            contact = self.lost[name]
            return self.doc.fault(
                f"{kind} '{name}' needs contact '{contact}', which the scene leaves out. Add '{contact}' to contacts, "
                f"or remove '{name}'.",
                *path,
            )
        has = nearest(name, names) if names else f" It has no {kind}s."
        return self.doc.fault(f"{self.full.name} has no {kind} '{name}'.{has}", *path)

    # values

    def _values(self, table: str, quantities: Mapping[str, Quantity], kind: str) -> dict[str, float]:
        values = {}
        for name, raw in self.doc.table(table).items():
            if name not in quantities:
                raise self._stranger(kind, name, quantities, table, name)
            values[name] = self.doc.value(raw, quantities[name].unit, table, name)
        return values

    def _drives(self) -> dict[str, Drive]:
        """Every input that is not held, at its default where the scene does not name it."""
        drives: dict[str, Drive] = {}
        tables = self.doc.table("drives")
        for name in tables:
            if name not in self.inputs:
                hint = " A parameter stands in [parameters] or [free]." if name in self.parameters else ""
                fault = self._stranger("drive", name, self.inputs, "drives", name)
                raise StickslipError(f"{fault}{hint}")
        parameters = self.doc.table("parameters")
        for name, quantity in self.inputs.items():
            if name in tables:
                drives[name] = self._drive(tables[name], quantity.unit, name)
            elif name not in parameters:
                value = float(quantity.value)  # pyright: ignore[reportAttributeAccessIssue]  # an Input
                drives[name] = Drive(times=(0.0,), values=(value,))
        return drives

    def _drive(self, raw: object, unit: str, name: str) -> Drive:
        doc, path = self.doc, ("drives", name)
        if isinstance(raw, str) and ":" in raw:
            try:
                return self._from_log(raw, unit, name)
            except StickslipError as error:
                raise doc.fault(str(error), *path) from error
        if not isinstance(raw, dict):
            return Drive(times=(0.0,), values=(doc.value(raw, unit, *path),))
        keys = ("times", "values") if "times" in raw or "values" in raw else ("from", "to", "begin", "end")
        doc.check_keys(keys, *path)
        for key in keys:
            if key not in raw:
                raise doc.fault(f"drive '{name}' lacks '{key}'. It needs {', '.join(keys)}.", *path)
        if keys[0] == "from":
            times = [doc.value(raw[key], "s", *path, key) for key in ("begin", "end")]
            values = [doc.value(raw[key], unit, *path, key) for key in ("from", "to")]
        else:
            times = doc.values(raw["times"], "s", *path, "times")
            values = doc.values(raw["values"], unit, *path, "values")
        if len(times) != len(values) or len(times) < 2 or any(b < a for a, b in pairwise(times)):
            raise doc.fault(
                f"drive '{name}' needs ascending times, at least two, and a value for each; found {len(times)} times "
                f"and {len(values)} values.",
                *path,
            )
        return Drive(times=tuple(times), values=tuple(values))

    def _from_log(self, raw: str, unit: str, name: str) -> Drive:
        signal = signal_of(raw, 0.0, 0.0, label=f"drive '{name}'", unit=unit, folder=self.doc.path.parent)
        assert isinstance(signal, Signal)
        knots({name: signal}, 0.0, self._stop_time())
        return Drive(times=tuple(signal.time.tolist()), values=tuple(signal.value.tolist()), column=raw)

    def _start(self) -> dict[str, float]:
        self.system = lower(self.kept)
        units, values = self._state_units(), {}
        for name, raw in self.doc.table("start").items():
            if name not in units:
                raise self._stranger("state", name, units, "start", name)
            values[name] = self.doc.value(raw, units[name], "start", name)
        return values

    def _state_units(self) -> dict[str, str]:
        """Units of states, and of the speeds of entry that stops remember."""
        memories = {f"{c.name}_memory": "m/s" for c in self.system.contacts if c.remembers}
        return {state.name: state.unit for state in self.system.states} | memories

    def _outputs(self) -> tuple[str, ...]:
        requested = self.doc.names("outputs")
        available = [output.name for output in self.system.outputs]
        if requested is None:
            declared = (
                {output.name for output in self.kept.outputs} if isinstance(self.kept, Mechanism) else set(available)
            )
            return tuple(name for name in available if name in declared)
        available += [f"{contact.name}_state" for contact in self.system.contacts]
        for name in requested:
            if name not in available:
                states = {state.name for state in self.system.states}
                if name in states:
                    raise self.doc.fault(
                        f"'{name}' is a state, and states are always shown. Remove it.", "outputs", name
                    )
                raise self._stranger("output", name, available, "outputs", name)
        return requested

    def _stop_time(self) -> float:
        raw = self.doc.table().get("stop_time")
        if raw is None:
            raise self.doc.fault("'stop_time' is missing. Add when the run ends: stop_time = \"20 s\"")
        stop_time = self.doc.value(raw, "s", "stop_time")
        if stop_time <= 0.0:
            raise self.doc.fault(f"the run must end after it starts, found stop_time = {stop_time:g} s.", "stop_time")
        return stop_time

    # what to compute

    def _names(self, free: Mapping[str, float], drives: Mapping[str, Drive]) -> Names:
        quantities: dict[str, Quantity] = {**self.parameters, **self.inputs}
        return Names(
            varied={name: quantities[name].unit for name in (*free, *drives)},
            parameters={name: quantity.unit for name, quantity in self.parameters.items()},
            states=self._state_units(),
            contacts=tuple(contact.name for contact in self.system.contacts),
            forced=TIME in self.kept.symbols,
            signals=bool(self.system.signals),
            of_map=isinstance(self.full, Map),
            stranger=self._stranger,
        )

    def _references(self, parameters: Mapping[str, float]) -> tuple[Reference, ...]:
        doc, over = self.doc, self.doc.table("compute").get("over")
        references = []
        for i, table in enumerate(doc.entries("reference")):
            source = doc.text("source", "reference", i, default="")
            numbers = {n: doc.value(table[n], "1", "reference", i, n) for n in _NUMBERS if n in table}
            varied = {"at": over, "panel": next(iter(doc.table("compute", "panels")), None)}
            constants = {**parameters, **{name: numbers[n] for n, name in varied.items() if name and n in numbers}}
            values = {
                name: self._known(value, constants, "reference", i, name)
                for name, value in table.items()
                if name not in (*_NUMBERS, "source")
            }
            references.append(Reference(values=values, source=source, **numbers))
        return tuple(references)

    def _known(self, raw: object, parameters: Mapping[str, float], *path: str | int) -> float:
        """A number, or what a formula of the scene's parameters says."""
        if isinstance(raw, str):
            try:
                raw = float(Formula.read(raw)(parameters))
            except StickslipError as error:
                raise self.doc.fault(str(error), *path) from error
        return self.doc.value(raw, "1", *path)

    # the whole

    def _check_values(self, scene: Scene) -> None:
        values = {name: value for name, value in scene.parameters.items() if name in self.parameters}
        try:
            check_values(self.kept, values)
        except StickslipError as error:
            # the message begins with the parameter, or ends with "(found a = 1, b = 2)."
            names = re.findall(r"\b([A-Za-z]\w*) = ", str(error))
            tables = [(t, n) for n in names for t in ("parameters", "free") if n in self.doc.table(t)]
            raise self.doc.fault(str(error), *(tables[0] if tables else ("model",))) from error

    def _check_start(self, scene: Scene) -> None:
        """A rigid contact cannot begin behind its wall; a start inside some stops needs the speed of entry."""
        drives = {name: drive.values[0] for name, drive in scene.drives.items()}
        values = {p.name: p.value for p in self.system.parameters} | scene.parameters | drives
        values |= {**{s.name: s.start for s in self.system.states}, **scene.start}
        quantities = (*self.system.parameters, *self.system.inputs, *self.system.states)
        point: dict[Any, Any] = {TIME: sympy.S.Zero, **{q: sympy.Float(values[q.name]) for q in quantities}}
        for contact in self.system.contacts:
            if contact.depth is None or not (contact.kind.impulsive or contact.remembers):
                continue
            expressions: Any = (contact.depth, *contact.depth_terms)
            depth, *terms = (float(expression.xreplace(point)) for expression in expressions)
            scale = sum(map(abs, terms))
            if depth <= _ROUNDING * scale:
                continue
            involved = [s.name for s in self.system.states if s in contact.depth.free_symbols]
            path = next((("start", n) for n in involved if n in self.doc.table("start")), ("start",))
            if contact.kind.impulsive:
                raise self.doc.fault(
                    f"the start lies {depth:.6g} m behind the wall of contact '{contact.name}' "
                    f"({contact.description}). Choose {', '.join(involved)} such that its gap is not negative.",
                    *path,
                )
            if f"{contact.name}_memory" not in scene.start:
                raise self.doc.fault(
                    f"the start lies {depth:.6g} inside stop '{contact.name}', whose force depends on the speed of "
                    f"entry. Add {contact.name}_memory to [start], or start outside.",
                    *path,
                )


_NUMBERS = ("at", "panel", "tolerance")  # of a reference, beside known values

# of the terms of a gap that cancel: rounding of a start at a wall, as the engine takes it
_ROUNDING = 1e-13


def _identifier(stem: str) -> str:
    """The name of an FMU, from that of a file."""
    name = re.sub(r"\W+", "_", stem, flags=re.ASCII)
    return name if re.match(r"[A-Za-z]", name) else f"scene_{name}"
