"""A parameter of a friction law as its declaration states it, once: for the model and for a fit.

A law is a frozen dataclass whose fields are its parameters:

    mu: sympy.Expr = field(metadata=coefficient(0.5, "friction coefficient at any slip speed"))
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T_0 = 0.01  # s, of stick, after which breakaway that ages grows by decades
# of the law `free`: distance of knots in ln(1 + v/V), power of its steps, knots from rest to the greatest slip speed
KNOT_SPACING, STEEPNESS, KNOTS_INSIDE = 0.5, 4, 7


@dataclass(frozen=True)
class LawParameter:
    """A parameter of a friction law. value: default, where a search starts that has no better guess; minimum, maximum:
    bounds of the search; a model refuses values that are not positive (minimum > 0) or negative (minimum = 0)."""

    name: str
    value: float
    unit: str
    description: str
    minimum: float
    maximum: float


def declared(value: float, unit: str, description: str, minimum: float, maximum: float) -> Mapping[str, Any]:
    """Metadata of the field that is the parameter; as in `LawParameter`."""
    return {"declared": (value, unit, description, minimum, maximum)}


def coefficient(value: float, description: str) -> Mapping[str, Any]:
    """Metadata of a friction coefficient."""
    return declared(value, "1", description, 0.0, 10.0)


def viscous() -> Mapping[str, Any]:
    """Metadata of the coefficient mu_v of viscous friction N mu_v v."""
    return declared(0.0, "s/m", "rise of the friction coefficient with slip speed, viscous", 0.0, 100.0)


def parameters_of(law: type[Any]) -> Iterator[LawParameter]:
    """Parameters that a class of laws declares, in order."""
    for entry in fields(law):
        if "declared" in entry.metadata:
            yield LawParameter(entry.name, *entry.metadata["declared"])


def declared_in(law: "DataclassInstance | type[DataclassInstance]") -> Iterator[tuple[Any, LawParameter]]:
    """Values of the declared parameters of a law, those of laws within it included, and what they are."""
    for entry in fields(law):
        value = getattr(law, entry.name)
        if "declared" in entry.metadata:
            yield value, LawParameter(entry.name, *entry.metadata["declared"])
        elif is_dataclass(value):
            yield from declared_in(value)
