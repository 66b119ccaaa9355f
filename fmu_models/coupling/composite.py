"""Units as one FMU: the C structure of the coupled system (importer/c/exchange.h), and its description."""

from __future__ import annotations

import ctypes
from collections.abc import Collection, Mapping, Sequence
from ctypes import POINTER, byref, c_double, c_int32, c_void_p
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from fmu_models.codegen.c_structures import declarations
from fmu_models.coupling.order import CouplingStage, Port, discrete, stages
from fmu_models.coupling.wiring import unit_of
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import instance, request, text_calls
from fmu_models.importer.clocks import refuse_clocks

if TYPE_CHECKING:
    from fmu_models.coupling.system import CoupledSystem

_C = declarations("importer/c/exchange.h")
GROUP = np.dtype(_C.structure("Group"))
STAGE = np.dtype(_C.structure("Stage"))
Coupling = _C.structure("Coupling")


@cache
def library() -> ctypes.CDLL:
    """The compiled master with the functions of the coupled system declared."""
    dll = instance.master_library()
    dll.coupling_fill.restype, dll.coupling_fill.argtypes = None, (POINTER(instance.FmuInstance), POINTER(Coupling))
    for name, arguments in {
        "coupling_exchange": (POINTER(Coupling), c_int32),
        "fmi_read": (POINTER(instance.FmuInstance), POINTER(instance.Variables), c_void_p),
        "fmi_write": (POINTER(instance.FmuInstance), POINTER(instance.Variables), c_void_p),
        "fmi_plain": (POINTER(instance.FmuInstance), c_int32),
        "fmi_update": (POINTER(instance.FmuInstance), c_void_p),
        "fmi_do_step": (POINTER(instance.FmuInstance), c_double, c_double, c_void_p),
    }.items():
        function = getattr(dll, name)
        function.restype, function.argtypes = c_int32, arguments
    return dll


class Composite:
    """Instances of all units and the structure that joins them; looks to the master's driver like one instance.

    Attributes:
        calls: of the coupled system.
        states: "unit.state" of all units, in their order.
        ports, wires: outputs and wires in the order of the structure's arrays.
        arrays: those of the structure by their names there, each one longer.

    Raises:
        StickslipError: a unit cannot be loaded.
    """

    def __init__(self, system: CoupledSystem, *, co_simulation: bool) -> None:
        self.system = system
        self.names = list(system.units)
        self.instances: list[instance.Instance] = []
        try:
            for unit in system.units.values():
                refuse_clocks(unit.fmu, "a coupling")
                self.instances.append(instance.Instance(unit.fmu, co_simulation=co_simulation))
        except BaseException:
            self.close()
            raise
        units = list(zip(self.names, self.instances, strict=True))
        self.states = [f"{unit}.{x}" for unit, unit_instance in units for x in unit_instance.states]
        self.derivatives = [f"{unit}.{x}" for unit, unit_instance in units for x in unit_instance.derivatives]
        self.log = SimpleNamespace(count=0, warnings=0, message=b"")
        self.calls = instance.FmuInstance()
        self.c = Coupling(failed_unit=-1, failed_stage=-1)
        self.arrays: dict[str, np.ndarray] = {}
        all_calls = [unit_instance.calls for unit_instance in self.instances]
        pointers = POINTER(instance.FmuInstance) * len(all_calls)
        self._pointers = pointers(*(ctypes.pointer(calls) for calls in all_calls))
        self.c.n_units, self.c.fmus = len(all_calls), ctypes.addressof(self._pointers)
        for name in ("state", "indicator"):
            counts = [getattr(calls, f"n_{name}s") for calls in all_calls]
            self._put(f"first_{name}", np.cumsum([0, *counts]), np.int64)
            setattr(self.calls, f"n_{name}s", int(sum(counts)))
        self._wire(stages(system.fmus, system.wires))
        self._variables()
        library().coupling_fill(byref(self.calls), byref(self.c))
        self.write_texts()
        self.calls.completes = int(any(calls.completes for calls in all_calls))

    def close(self) -> None:
        """Free all instances."""
        for unit_instance in self.instances:
            unit_instance.close()

    def write_texts(self) -> None:
        """Give units their texts before a run. A reset takes them away, so that all units are reset first."""
        units = self.system.units.values()
        if any(unit.texts for unit in units):
            for unit, unit_instance in zip(units, self.instances, strict=True):
                unit_instance.calls.resets = self.calls.resets
                text_calls.write(unit_instance, unit.texts)
            self.calls.resets = 0

    def renew(self) -> None:
        """Replace units that cannot be reset by fresh ones."""
        for unit_instance in self.instances:
            unit_instance.renew()

    @property
    def remark(self) -> str:
        """Those of the units, by their names."""
        remarks = {name: unit.remark for name, unit in zip(self.names, self.instances, strict=True)}
        return ", ".join(f"unit '{name}': {remark}" for name, remark in remarks.items() if remark)

    def message(self) -> str:
        """What went wrong between the units, or what the unit that failed said last."""
        if self.c.failed_stage >= 0:
            stage = self.stages[self.c.failed_stage]
            ring = ", ".join(f"{w.source[0]}.{w.source[1]} -> {w.target[0]}.{w.target[1]}" for w in stage.wires)
            return (
                f"the algebraic loop {ring} has no solution that Newton's method finds. "
                "Break it by a state between, or start nearer to a solution."
            )
        if self.c.failed_unit < 0:
            return ""
        message = self.instances[self.c.failed_unit].message()
        return f"unit '{self.names[self.c.failed_unit]}'" + (f": {message}" if message else "")

    def _put(self, name: str, values: Sequence[float] | NDArray[Any], kind: DTypeLike) -> None:
        # one more, so that an empty array has an address too
        array = np.zeros(len(values) + 1, dtype=kind)
        array[: len(values)] = values
        setattr(self.c, name, array.ctypes.data)
        self.arrays[name] = array

    def hold(self, ports: Collection[Port]) -> None:
        """Leave inputs alone in an exchange, as those that change at events only."""
        self._wire(self.stages, ports)

    def _wire(self, order: Sequence[CouplingStage], held: Collection[Port] = ()) -> None:
        """The arrays of outputs, inputs, groups and stages."""
        fmus = self.system.fmus
        self.stages = list(order)
        self.ports = [port for stage in order for port in stage.outputs]
        self.wires = [wire for stage in order for wire in stage.wires]
        targets = [wire.target for wire in self.wires]
        reads, writes, rows = [], [], []
        matrix = first_output = first_input = 0
        for stage in order:
            row = [int(stage.loop), len(reads), 0, len(writes), 0, first_input, len(stage.wires), matrix, 0]
            reads += self._groups(stage.outputs, first_output)
            writes += self._groups([wire.target for wire in stage.wires], first_input, held)
            row[2], row[4] = len(reads) - row[1], len(writes) - row[3]
            rows.append(tuple(row))
            first_output += len(stage.outputs)
            first_input += len(stage.wires)
            matrix += len(stage.wires) ** 2 if stage.loop else 0
        self.c.n_stages, self.c.n_inputs = len(order), len(targets)
        self._put("stages", np.array(rows, dtype=STAGE), STAGE)
        self._put("reads", np.array(reads, dtype=GROUP), GROUP)
        self._put("writes", np.array(writes, dtype=GROUP), GROUP)
        for name, ports in (("output", self.ports), ("input", targets)):
            variables = [(fmus[unit], fmus[unit].variables[variable]) for unit, variable in ports]
            self._put(f"{name}_types", [instance.types_of(fmu)[str(v.type)] for fmu, v in variables], np.int32)
            self._put(f"{name}_references", [v.valueReference for _, v in variables], np.uint32)
        index = {port: i for i, port in enumerate(self.ports)}
        self._put("source", [index[wire.source] for wire in self.wires], np.int64)
        self._put("factor", [wire.factor for wire in self.wires], np.float64)
        self._put("offset", [wire.offset for wire in self.wires], np.float64)
        for name, length in (
            ("outputs", len(self.ports)),
            *((name, len(targets)) for name in ("inputs", "scale", "step")),
            ("matrix", matrix),
            ("rates", max(len(unit_instance.states) for unit_instance in self.instances)),
        ):
            self._put(name, np.zeros(length), np.float64)
        self._put("pivot", np.zeros(len(targets)), np.int32)

    def _groups(
        self, ports: Sequence[Port], first: int, held: Collection[Port] = ()
    ) -> list[tuple[int, int, int, int]]:
        """Runs of one unit and one variability."""
        groups: list[tuple[int, int, int, int]] = []
        for i, (unit, name) in enumerate(ports):
            key = self.names.index(unit), int(discrete(self.system.fmus[unit], name) or (unit, name) in held)
            if groups and (groups[-1][0], groups[-1][3]) == key:
                groups[-1] = (key[0], groups[-1][1], groups[-1][2] + 1, key[1])
            else:
                groups.append((key[0], first + i, 1, key[1]))
        return groups

    def _variables(self) -> None:
        """The description of the coupled system, in which every number of a unit is a real one."""
        fed = {wire.target for wire in self.system.wires}
        variables: dict[str, Any] = {}
        units, types, references = [], [], []
        for i, (unit, fmu) in enumerate(self.system.fmus.items()):
            for name, v in fmu.variables.items():
                if not request.is_number(fmu, name) or v.causality == "independent":
                    continue
                causality = "local" if (unit, name) in fed else v.causality
                variables[f"{unit}.{name}"] = SimpleNamespace(
                    **{"name": f"{unit}.{name}", "valueReference": len(units), "type": "Real", "shape": ()},
                    **{"causality": causality, "variability": v.variability, "initial": v.initial, "start": v.start},
                    **{"min": v.min, "max": v.max, "nominal": None, "unit": unit_of(fmu, v), "declaredType": None},
                    **{"description": v.description, "derivative": None, "clocks": None},
                )
                units.append(i)
                types.append(instance.types_of(fmu)[str(v.type)])
                references.append(v.valueReference)
        self._put("variable_unit", units, np.int64)
        self._put("variable_types", types, np.int32)
        self._put("variable_references", references, np.uint32)
        steps = [request.StepBound.of(fmu, None, 0.0, 0.0).longest for fmu in self.system.fmus.values()]
        description = SimpleNamespace(
            **{"modelName": self.system.name, "description": "", "generationTool": "", "guid": ""},
            **{"fmiVersion": "2.0"},
            **{"modelExchange": True, "coSimulation": None, "defaultExperiment": SimpleNamespace(stepSize=min(steps))},
            **{
                "derivatives": self._derivatives(variables),
                "outputs": [],
                "eventIndicators": self._indicators(variables),
            },
        )
        self.fmu = Fmu(Path(self.system.name), Path(), description, variables)  # pyright: ignore[reportArgumentType]

    def _derivatives(self, variables: Mapping[str, Any]) -> list[SimpleNamespace]:
        derivatives = []
        for unit, fmu in self.system.fmus.items():
            for unknown in fmu.description.derivatives:
                name = f"{unit}.{unknown.variable.name}" if unknown.variable is not None else ""
                if name in variables:
                    derivatives.append(SimpleNamespace(variable=variables[name]))
        return derivatives

    def _indicators(self, variables: Mapping[str, Any]) -> list[SimpleNamespace]:
        """Names of the indicators: those of the unit (FMI 3), or their numbers in it."""
        indicators = []
        for unit, unit_instance in zip(self.names, self.instances, strict=True):
            named = unit_instance.fmu.description.eventIndicators
            for i in range(unit_instance.calls.n_indicators):
                indicator = named[i] if i < len(named) else None
                text = (
                    str(indicator.variable.name) if indicator is not None and indicator.variable else f"indicator {i}"
                )
                depends = [
                    variables.get(f"{unit}.{v.name}") for v in (indicator.dependencies if indicator else None) or []
                ]
                indicators.append(
                    SimpleNamespace(variable=SimpleNamespace(name=f"{unit}.{text}"), dependencies=depends)
                )
        return indicators
