"""Structural parameters of an FMU 3.0, on which sizes of arrays depend: set once, before any run."""

import copy
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.fmu.description import MAX_ELEMENTS
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import check_value


def split(fmu: Fmu, parameters: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The structural ones of some parameters, and the rest."""
    structural = {name for name, v in fmu.variables.items() if v.causality == "structuralParameter"}
    return {n: v for n, v in parameters.items() if n in structural}, {
        n: v for n, v in parameters.items() if n not in structural
    }


def configured(fmu: Fmu, structure: Mapping[str, float]) -> Fmu:
    """The FMU with other values of structural parameters, and arrays of the sizes that follow; its files are those of
    ``fmu``, which must outlive it. StickslipError: no such structural parameter, a value that is no size, or arrays
    beyond all bounds."""
    if not structure:
        return fmu
    description = copy.deepcopy(fmu.description)
    variables = {str(v.name): v for v in description.modelVariables}
    structural = [name for name, v in variables.items() if v.causality == "structuralParameter"]
    for name, value in structure.items():
        if name not in structural:
            has = nearest(name, structural) if structural else " It has no structural parameters."
            raise StickslipError(f"'{description.modelName}' has no structural parameter '{name}'.{has}")
        check_value(fmu, name, value)
        if value != math.floor(value) or value < 0:
            raise StickslipError(
                f"'{name}' of '{description.modelName}' is a structural parameter, on which sizes of arrays depend: a "
                f"whole number of zero or more, found {value:g}."
            )
        variables[name].start = str(int(value))
    for name, variable in variables.items():
        sizes = [d.variable.start if d.variable is not None else d.start for d in variable.dimensions or ()]
        variable.shape = tuple(int(str(size)) for size in sizes)
        if math.prod(variable.shape) > MAX_ELEMENTS:
            shape = " x ".join(map(str, variable.shape))
            raise StickslipError(f"'{name}' would be an array of {shape}, more than {MAX_ELEMENTS} elements.")
    return replace(fmu, description=description, variables=variables)
