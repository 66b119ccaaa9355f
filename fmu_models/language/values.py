"""Values for parameters, checked at the door."""

import math
import operator
from collections.abc import Iterable, Mapping
from typing import Protocol, SupportsFloat

import sympy

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.language.contacts import Requirement
from fmu_models.language.quantities import Parameter

_RELATIONS = {">": operator.gt, ">=": operator.ge, "<=": operator.le}


class Parametrised(Protocol):
    """A Mechanism or what it is lowered to."""

    @property
    def name(self) -> str:
        """Name of the model."""
        ...

    @property
    def parameters(self) -> Iterable[Parameter]:
        """Parameters of the model."""
        ...

    @property
    def all_requirements(self) -> Iterable[Requirement]:
        """Requirements that the parameters must meet together."""
        ...


def check_values(model: Parametrised, values: Mapping[str, float]) -> None:
    """Refuse values that the model cannot have; parameters not named keep their defaults. StickslipError: unknown
    parameter, not a finite number, out of bounds, or a requirement violated."""
    check_numbers(model, values)
    parameters = {parameter.name: parameter for parameter in model.parameters}
    point = {parameter: sympy.Float(values.get(name, parameter.value)) for name, parameter in parameters.items()}
    for requirement in model.all_requirements:
        expression = sympy.sympify(requirement.expression)
        number = float(sympy.Float(expression.xreplace(point)))
        if number < 0.0 or (requirement.strict and number == 0.0):
            used = [p for p in parameters.values() if p in expression.free_symbols]
            numbers = ", ".join(f"{p.name} = {float(point[p]):g}" for p in used)
            raise StickslipError(f"{requirement.sentence} (found {numbers}).")


def check_numbers(model: Parametrised, values: Mapping[str, float]) -> None:
    """The same, each value by itself: requirements between several are left out."""
    parameters = {parameter.name: parameter for parameter in model.parameters}
    for name, value in values.items():
        refuse_unknown(name, parameters, f"{model.name} has no parameter '{name}'.")
        _check_bounds(parameters[name], value)


def bounds(parameter: Parameter) -> list[tuple[str, float]]:
    """The bounds of a parameter, each as relation and number, such as (">=", 0.0)."""
    limits = []
    if parameter.minimum is not None:
        limits.append((">" if parameter.positive else ">=", parameter.minimum))
    if parameter.maximum is not None:
        limits.append(("<=", parameter.maximum))
    return limits


def _check_bounds(parameter: Parameter, value: float) -> None:
    name, unit, meaning = parameter.name, _unit(parameter), parameter.description
    if not isinstance(value, SupportsFloat) or not math.isfinite(value):
        raise StickslipError(f"{name} = {value} is not a finite number ({meaning}).")
    for relation, bound in bounds(parameter):
        if not _RELATIONS[relation](value, bound):
            raise StickslipError(
                f"{name} = {value:g}{unit} is out of range: {meaning} must be {relation} {bound:g}{unit}."
            )


def _unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else f" {parameter.unit}"
