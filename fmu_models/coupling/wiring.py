"""Connections between units, checked: which output feeds which input, with the factor between their units of measure.

u = factor y + offset
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from fmu_models.base.errors import StickslipError, nearest, refuse_unknown
from fmu_models.base.unit_names import parse_unit
from fmu_models.importer import request

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable

    from fmu_models.fmu.fmu import Fmu

WHOLE = "a whole number"
KINDS = {"Real": "a real number", "Boolean": "a boolean", "Enumeration": "an enumeration"}


class Misfit(StickslipError):
    """What does not fit in a system; ``place``: where, by names of attributes and units and numbers of connections."""

    def __init__(self, text: str, *place: str | int) -> None:
        super().__init__(text)
        self.place = place


@dataclass(frozen=True)
class Connection:
    """As somebody wrote it: ``source`` and ``target`` are "unit.variable"; factor and offset if it has its own."""

    source: str
    target: str
    factor: float | None = None
    offset: float = 0.0

    def __str__(self) -> str:
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True)
class Wire:
    """A checked connection: (unit, variable) at both ends, and u = factor y + offset."""

    source: tuple[str, str]
    target: tuple[str, str]
    factor: float
    offset: float


def wires(fmus: Mapping[str, Fmu], connections: Sequence[Connection]) -> tuple[Wire, ...]:
    """The connections between these units, checked. Misfit: no such unit or variable, one that is no output or no
    input, types or units of measure that do not fit, an input that is fed twice; names the connection."""
    wire_to: dict[tuple[str, str], Wire] = {}
    for i, connection in enumerate(connections):
        try:
            source = _end(fmus, connection, connection.source, ("output",))
            target = _end(fmus, connection, connection.target, ("input",))
            if target in wire_to:
                raise StickslipError(
                    f"Connection '{connection}': '{connection.target}' is fed by '{'.'.join(wire_to[target].source)}' "
                    "already. An input has one source; leave one of the two out."
                )
            wire_to[target] = Wire(source, target, *_conversion(fmus, connection, source, target))
        except StickslipError as error:
            raise Misfit(str(error), "connections", i) from error
    return tuple(wire_to.values())


def split(fmus: Mapping[str, Fmu], name: str, where: str) -> tuple[str, str]:
    """Unit and variable of "unit.variable"; units and variables may have dots themselves. StickslipError: there is
    none; ``where`` begins the message."""
    unit = max((u for u in fmus if name.startswith(f"{u}.")), key=len, default=None)
    if unit is None:
        first = name.partition(".")[0]
        if "." not in name:
            raise StickslipError(f"{where}: '{name}' names no variable of a unit. Write it as 'unit.variable'.")
        raise StickslipError(f"{where}: there is no unit '{first}'.{nearest(first, fmus)}")
    variable = name[len(unit) + 1 :]
    refuse_unknown(variable, fmus[unit].variables, f"{where}: the unit '{unit}' has no variable '{variable}'.")
    return unit, variable


def _end(fmus: Mapping[str, Fmu], connection: Connection, name: str, causality: Sequence[str]) -> tuple[str, str]:
    where = f"Connection '{connection}'"
    unit, variable = split(fmus, name, where)
    actual = fmus[unit].variables[variable].causality
    if actual not in causality:
        has = [n for n, v in fmus[unit].variables.items() if v.causality in causality]
        hint = nearest(variable, has) if has else f" The unit has no {causality[0]}."
        article = "an" if str(actual)[0] in "aeiou" else "a"
        raise StickslipError(
            f"{where}: '{name}' is {article} {actual} of its unit, but an {causality[0]} is needed there.{hint}"
        )
    if not request.is_number(fmus[unit], variable):
        kind = fmus[unit].variables[variable].type
        raise StickslipError(f"{where}: '{name}' is an array or of type {kind}; single numbers can be connected.")
    return unit, variable


def _kind(variable: ScalarVariable) -> str:
    name = str(variable.type)
    if name.startswith("Float"):
        name = "Real"
    return KINDS.get(name, WHOLE)


def _conversion(
    fmus: Mapping[str, Fmu], connection: Connection, source: tuple[str, str], target: tuple[str, str]
) -> tuple[float, float]:
    source_variable, two = (fmus[unit].variables[name] for unit, name in (source, target))
    kinds = _kind(source_variable), _kind(two)
    # a whole number is a real number too; nothing else passes for another
    if kinds[0] != kinds[1] and kinds != (WHOLE, KINDS["Real"]):
        raise StickslipError(
            f"Connection '{connection}': '{connection.source}' is {kinds[0]}, '{connection.target}' is {kinds[1]}. "
            "Connect variables of one type."
        )
    if source_variable.variability != "discrete" and two.variability == "discrete" and kinds[0] == KINDS["Real"]:
        raise StickslipError(
            f"Connection '{connection}': '{connection.target}' changes at events only, '{connection.source}' at all "
            "times. Connect a discrete output."
        )
    if connection.factor is not None:
        return connection.factor, connection.offset
    units = unit_of(fmus[source[0]], source_variable), unit_of(fmus[target[0]], two)
    if units[0] == units[1] or None in units:
        return 1.0, 0.0
    try:
        return conversion(str(units[0]), str(units[1]))
    except ValueError as error:
        raise StickslipError(
            f"Connection '{connection}': '{connection.source}' is in {units[0]}, "
            f"'{connection.target}' in {units[1]}: {error}"
        ) from None


def unit_of(fmu: Fmu, variable: ScalarVariable) -> str | None:
    """Unit of measure of a variable, or of its declared type; None where the FMU states none."""
    declared = variable.declaredType
    text = variable.unit or (declared.unit if declared is not None else None)
    return str(text) if text else None


@cache
def conversion(source_unit: str, two: str) -> tuple[float, float]:
    """Factor and offset from a number in ``one`` to the same quantity in ``two``. ValueError: units of different
    quantities, or unknown ones; says what to do."""
    import pint

    try:
        a, b = (parse_unit("1" if text.strip() in ("", "-") else text) for text in (source_unit, two))
        at_zero, at_one = (float(type(a)(value, a.units).to(b.units).magnitude) for value in (0.0, 1.0))
    except pint.DimensionalityError:
        raise ValueError("these measure different quantities. Connect other variables, or correct the units.") from None
    except (pint.PintError, ValueError) as error:
        raise ValueError(f"a unit is not understood ({error}). Correct it in its FMU.") from None
    return at_one - at_zero, at_zero
