"""Values for parameters, checked at the door."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Protocol

import sympy

from fmu_models.errors import StickslipError, nearest
from fmu_models.language.contacts import Requirement
from fmu_models.language.quantities import Parameter


class Parametrised(Protocol):
    """A Mechanism or what it is lowered to."""

    @property
    def name(self) -> str:
        """Name of the model."""
        ...

    @property
    def parameters(self) -> Iterable[Parameter]:
        """Its parameters."""
        ...

    @property
    def all_requirements(self) -> Iterable[Requirement]:
        """What they must satisfy together."""
        ...


def check_values(model: Parametrised, values: Mapping[str, float]) -> None:
    """Refuse values that the model cannot have; parameters not named keep their defaults.

    Raises:
        StickslipError: unknown parameter, not a finite number, out of bounds, or a requirement violated.
    """
    parameters = {parameter.name: parameter for parameter in model.parameters}
    for name, value in values.items():
        if name not in parameters:
            raise StickslipError(f"{model.name} has no parameter '{name}'.{nearest(name, parameters)}")
        _check_bounds(parameters[name], value)
    point = {parameter: values.get(name, parameter.value) for name, parameter in parameters.items()}
    for requirement in model.all_requirements:
        number = float(sympy.sympify(requirement.expression).subs(point))
        if number < 0.0 or (requirement.strict and number == 0.0):
            used = sorted(sympy.sympify(requirement.expression).free_symbols, key=lambda s: s.declared)
            found = ", ".join(f"{s.name} = {point[s]:g}" for s in used)
            raise StickslipError(f"{requirement.sentence} (found {found}).")


def bound_sentences(parameter: Parameter) -> list[tuple[str, float]]:
    """The bounds of a parameter, each as relation and number, such as (">=", 0.0)."""
    bounds = []
    if parameter.minimum is not None:
        bounds.append((">" if parameter.positive else ">=", parameter.minimum))
    if parameter.maximum is not None:
        bounds.append(("<=", parameter.maximum))
    return bounds


def _check_bounds(parameter: Parameter, value: float) -> None:
    name, unit, what = parameter.name, _unit(parameter), parameter.description
    if not math.isfinite(value):
        raise StickslipError(f"{name} = {value} is not a finite number ({what}).")
    holds = {">": value > 0.0 if parameter.minimum is None else value > parameter.minimum}
    holds[">="] = parameter.minimum is None or value >= parameter.minimum
    holds["<="] = parameter.maximum is None or value <= parameter.maximum
    for relation, bound in bound_sentences(parameter):
        if not holds[relation]:
            raise StickslipError(
                f"{name} = {value:g}{unit} is out of range: {what} must be {relation} {bound:g}{unit}."
            )


def _unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else f" {parameter.unit}"
