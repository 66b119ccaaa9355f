"""A system of several FMUs as values: its units, what connects them, and how it is run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.shown import Shown
from fmu_models.coupling.wiring import Connection, Misfit, Wire, split, wires
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request, texts
from fmu_models.simulation.inputs import signals_of

EXCHANGE = ("auto", "dopri5", "dop853", "stiff")
BY_STEPS = "co-simulation"
SOLVERS = (*EXCHANGE, BY_STEPS)


@dataclass(frozen=True)
class Unit(Shown):
    """One FMU of a system, with values by name in its own units of measure; inputs as ``simulate`` takes them; texts:
    start values of its Strings."""

    fmu: Fmu
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Connector:
    """A connector that a system has itself, of a kind and type of SSP: factor source + offset, where ``source``
    ("unit.variable") feeds it, or a value; neither where nothing feeds it."""

    kind: str
    type: str | None = None
    unit: str | None = None
    source: str | None = None
    factor: float = 1.0
    offset: float = 0.0
    value: float | str | None = None


@dataclass(frozen=True, eq=False)
class Origin:
    """The description (.ssd) that a system was read from, in a folder of its own if ``packed``, and what it said."""

    description: Path
    packed: bool
    units: Mapping[str, Unit]
    connections: Sequence[Connection]


@dataclass(frozen=True, eq=False)
class CoupledSystem(Shown):
    """Units by name and what connects them.

    Attributes:
        connections: as written; ``wires`` are the checked ones.
        solver: one of SOLVERS; "auto" integrates all as one where every unit has Model Exchange, otherwise it steps the
            units one by one ("co-simulation").
        step: communication step of a co-simulation, s; None: of controlled length.
        rollback: steps of a co-simulation that miss the tolerance are repeated; None: where every unit can be put back,
            and no step is given. With True and a step, shorter ones lie between its points.
        parallel: units that can be put back step at the same time, in threads, with the same result: where a step takes
            long.
        tolerance: relative error; None: 1e-8, of a co-simulation 1e-6.
        outputs: variables to record, "unit.variable"; none: states, inputs and outputs of all units.
        connectors: of the system itself and of systems in it, by dotted name; a trajectory has those with a value or a
            recorded source too.
        origin: what it was read from, where that can be written again with all that it holds.

    Raises:
        Misfit: a name, value or connection that does not fit.
    """

    name: str
    units: Mapping[str, Unit]
    connections: Sequence[Connection] = ()
    solver: str = "auto"
    step: float | None = None
    rollback: bool | None = None
    parallel: bool = False
    tolerance: float | None = None
    start_time: float = 0.0
    stop_time: float = 20.0
    outputs: Sequence[str] = ()
    connectors: Mapping[str, Connector] = field(default_factory=dict)
    origin: Origin | None = None
    wires: tuple[Wire, ...] = field(init=False)

    def __post_init__(self) -> None:
        if not self.units and not self.connectors:
            raise Misfit(f"The system '{self.name}' has no units. Name at least one FMU.", "units")
        if self.solver not in SOLVERS:
            raise Misfit(f"There is no solver '{self.solver}'.{nearest(self.solver, SOLVERS)}", "solver")
        if self.step is not None and not (math.isfinite(self.step) and self.step > 0):
            raise Misfit(f"The step must be a positive number of seconds, found {self.step:g}.", "step")
        if not (math.isfinite(self.start_time) and math.isfinite(self.stop_time) and self.stop_time > self.start_time):
            raise Misfit(
                f"The run must end after it starts, found start {self.start_time:g} s and stop {self.stop_time:g} s.",
                "stop_time",
            )
        if self.tolerance is not None and not (1e-14 <= self.tolerance <= 0.1):
            raise Misfit(f"The tolerance must lie between 1e-14 and 0.1, found {self.tolerance:g}.", "tolerance")
        object.__setattr__(self, "wires", wires(self.fmus, self.connections))
        fed = {wire.target for wire in self.wires}
        for name, unit in self.units.items():
            try:
                request.start_values(unit.fmu, unit.parameters, unit.start)
                texts.settings(unit.fmu, {}, unit.texts, {})
                span = self.start_time, self.stop_time
                request.table(unit.fmu, signals_of(unit.fmu, unit.inputs, *span), *span)
                for variable in (*unit.parameters, *unit.start, *unit.inputs):
                    if variable not in unit.fmu.variables:
                        raise StickslipError(f"'{variable}' is an element of an array; units take single numbers.")
            except StickslipError as error:
                raise Misfit(f"Unit '{name}': {error}", "units", name) from error
            for variable in unit.inputs:
                if (name, variable) in fed:
                    raise Misfit(
                        f"Unit '{name}': the input '{variable}' is given a value, but is fed by a connection.",
                        *("units", name, "inputs", variable),
                    )
        for output in self.outputs:
            try:
                unit, variable = split(self.fmus, output, "outputs")
                if not request.is_number(self.fmus[unit], variable):
                    raise StickslipError(f"outputs: '{output}' cannot be recorded: it is no single number.")
            except StickslipError as error:
                raise Misfit(str(error), "outputs", output) from error

    def changed(self, **settings: Any) -> CoupledSystem:
        """The same system with other settings; errors as for a new one."""
        names = (f.name for f in fields(self) if f.init)
        return CoupledSystem(**{**{name: getattr(self, name) for name in names}, **settings})

    def with_inputs(self, inputs: Mapping[str, Any]) -> CoupledSystem:
        """The same system with other inputs, by "unit.variable"; errors as for a new one."""
        units = dict(self.units)
        for name, value in inputs.items():
            unit, variable = split(self.fmus, name, "input")
            units[unit] = replace(units[unit], inputs={**units[unit].inputs, variable: value})
        return self.changed(units=units) if inputs else self

    def values(self, kind: str) -> dict[str, Any]:
        """Values of all units, by "unit.variable"; kind: "parameters", "start" or "inputs"."""
        return {f"{u}.{name}": v for u, unit in self.units.items() for name, v in getattr(unit, kind).items()}

    @property
    def fmus(self) -> dict[str, Fmu]:
        """The FMU of every unit."""
        return {name: unit.fmu for name, unit in self.units.items()}

    @property
    def integrates(self) -> bool:
        """Whether all units are integrated as one, rather than stepped one by one."""
        return self.solver != BY_STEPS and self.exchanges_models

    @property
    def exchanges_models(self) -> bool:
        """Whether every unit has Model Exchange, so that all can be integrated as one."""
        return all(unit.fmu.description.modelExchange is not None for unit in self.units.values())
