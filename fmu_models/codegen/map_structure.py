"""The variables of a map's FMU: its states are discrete outputs, which change at its time events alone."""

from fmu_models.codegen.model_structure import ModelUnknown
from fmu_models.codegen.variables import Variables
from fmu_models.lowering.hybrid_system import HybridSystem


class MapVariables(Variables):
    """Time, parameters and states, in the order of engine/fmi/variables.c; the rates behind them are not listed."""

    def __init__(self, system: HybridSystem) -> None:
        super().__init__()
        self._add_time()
        for p in system.parameters:
            self._add_parameter(p)
        self.states = [
            self._add("state of a map", x.name, x.description, start=x.start, unit=x.unit) for x in system.states
        ]


class MapStructure:
    """What is written about a map: every state depends on all by its steps, and none is integrated."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.variables = MapVariables(system)
        self.output_unknowns = [ModelUnknown(v) for v in self.variables.states]
        self.derivative_unknowns: list[ModelUnknown] = []
        self.initial_unknowns: list[ModelUnknown] = []
        self.indicator_unknowns: list[ModelUnknown] = []
