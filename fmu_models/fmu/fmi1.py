"""What a description of FMI 1.0 leaves unsaid, as one of FMI 2.0 would say it, so that nobody else need know of it.

    states            x of each variable der(x); of others, which the library alone knows, a name made up
    initial           of what has a start value: exact, or approx where it is not fixed
    negatedAlias      minus (not) the variable of its value reference, which ``alias`` keeps: a reference made up
    DirectDependency  dependencies of an output

Variables made up have no ``sourceline``, and their references follow on the greatest of the others.
"""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription, ModelVariable

UNDEFINED = (1 << 32) - 1  # fmiUndefinedValueReference
CAPABILITIES = ("canHandleVariableCommunicationStepSize", "canInterpolateInputs", "maxOutputDerivativeOrder")


def complete(description: ModelDescription, xml: Path) -> None:
    """Fill in a description that fmpy has read from ``xml``."""
    from fmpy.model_description import Unknown

    root = ElementTree.parse(xml).getroot()
    if description.modelExchange is not None:
        description.modelExchange.needsCompletedIntegratorStep = True
    capabilities = root.find("Implementation/*/Capabilities")
    stated = {} if capabilities is None else capabilities.attrib
    for name in stated.keys() & set(CAPABILITIES):
        setattr(description.coSimulation, name, stated[name])
    variables = {str(v.name): v for v in description.modelVariables}
    references = [v.valueReference for v in variables.values() if v.valueReference != UNDEFINED]
    made = 1 + max(references, default=-1)
    for element in root.iterfind("ModelVariables/ScalarVariable"):
        variable = variables.get(element.get("name", ""))
        if variable is None:
            continue  # it has no name
        _complete_variable(variable, element)
        if element.get("alias") == "negatedAlias":
            variable.alias = copy.copy(variable)
            variable.valueReference, made = made, made + 1
        if variable.causality == "output":
            stated = element.find("DirectDependency")
            names = None if stated is None else [name.text for name in stated]
            depends = None if names is None else [v for name, v in variables.items() if name in names]
            description.outputs.append(Unknown(variable=variable, dependencies=depends))
    for state, rate in _states(description, variables, made):
        rate.derivative = state
        description.derivatives.append(Unknown(variable=rate))
        description.modelVariables += [v for v in (state, rate) if v.sourceline is None]


def _complete_variable(variable: ModelVariable, element: ElementTree.Element) -> None:
    value = element.find(str(variable.type))
    if variable.causality not in ("input", "output", "parameter"):
        variable.causality = "local"
    if variable.type != "Real" and variable.variability == "continuous":
        variable.variability = "discrete"
    variable.initial = "calculated"
    if variable.start is not None:
        variable.initial = "approx" if value is not None and value.get("fixed") in ("false", "0") else "exact"


def _states(
    description: ModelDescription, variables: dict[str, ModelVariable], made: int
) -> list[tuple[ModelVariable, ModelVariable]]:
    """Each state with its derivative. Where more variables have one than there are states, which is which is not said:
    all names are made up. A Co-Simulation shows those that it describes alone."""
    from fmpy.model_description import ModelVariable

    n, pairs = description.numberOfContinuousStates, {}
    for name, rate in variables.items():
        state = variables.get(name[4:-1]) if name.startswith("der(") else None
        if state is not None and (state.type, state.variability, state.alias) == ("Real", "continuous", None):
            pairs.setdefault(state.valueReference, (state, rate))
    known = list(pairs.values()) if len(pairs) <= n else []
    for k in range(len(known), n if description.modelExchange is not None else 0):
        kind = {"type": "Real", "shape": (), "causality": "local", "variability": "continuous"}
        names = f"state_{k + 1}", f"der(state_{k + 1})"
        state, rate = (ModelVariable(name=name, valueReference=made + i, **kind) for i, name in enumerate(names))
        known.append((state, rate))
        made += 2
    return known
