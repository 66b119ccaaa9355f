"""Units of a declaration: every sum adds like to like, and energies, forces and outputs are what they say.

Dimensions are exponents of kilogram, meter, second and so on; angles have none. A floating-point number in an
expression may stand for a quantity of any unit, so that what it multiplies is not checked. In a scaled model, whose
coordinates (or states) all have the unit "1", time is scaled too and is left out of every dimension.

Units are read only when a model is declared.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import base_units
from fmu_models.language.contacts import ContactSymbol, Friction
from fmu_models.language.declaration import Body
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.impacts import Impact
from fmu_models.language.quantities import Quantity
from fmu_models.language.stops import Stop

Dimension = tuple[tuple[str, sympy.Rational], ...]
_NONE: Dimension = ()


class _Mismatch(Exception):
    """Two dimensions that cannot go together; the message says which."""


def check_units(mechanism: Body) -> None:
    """Refuse a mechanism whose units do not match.

    Raises:
        StickslipError: which expression, and what does not match in it.
    """
    units = _Units(mechanism.name, mechanism.coordinates)
    units.expect("the kinetic energy", mechanism.kinetic_energy, "J")
    units.expect("the potential energy", mechanism.potential_energy, "J")
    units.expect("the dissipation", mechanism.dissipation, "W")
    for q, force in mechanism.applied.items():
        work = None if force == 0 else units.expect(f"the force on {q.name}", force, None)
        if work is not None:
            units.match(f"the force on {q.name} times its velocity", units.times(work, units.of_unit(q.v.unit)), "W")
    for contact in mechanism.contacts:
        if isinstance(contact, Friction):
            _check_friction(units, contact)
        elif isinstance(contact, Impact):
            _check_impact(units, contact)
        else:
            _check_stop(units, contact)
    for output in mechanism.outputs:
        units.expect(f"output '{output.name}'", output.expression, output.unit)


def check_expression_units(
    model: str, states: Sequence[Quantity], expected: Iterable[tuple[str, sympy.Expr, str]]
) -> None:
    """Refuse a model without a body in which an expression, given with what it is, has another unit than it should.

    Raises:
        StickslipError: which expression, and what does not match in it.
    """
    units = _Units(model, states)
    for what, expression, unit in expected:
        units.expect(what, expression, unit)


def _check_friction(units: _Units, contact: Friction) -> None:
    slip = units.expect(f"the slip of contact '{contact.name}'", contact.slip, None)
    units.known[contact.slip_speed] = slip
    what = f"the law of contact '{contact.name}'"
    force = units.expect(what, contact.law.force(contact.slip_speed, contact.sign), None)
    if force is not None and slip is not None:
        units.match(f"slip times force of contact '{contact.name}'", units.times(force, slip), "W")
    if slip is not None:
        for bound in dict.fromkeys((contact.law.capacity, contact.law.capacity_minus)):
            most = units.expect(f"what contact '{contact.name}' holds in stick", bound, None)
            if most is not None:
                units.match(f"slip times what contact '{contact.name}' holds", units.times(most, slip), "W")
    units.known[contact.force] = force
    for state, rate in zip(contact.law.states, contact.law.rates(contact.slip_speed, contact.sign), strict=True):
        per_second = units.times(units.of_unit(state.unit), units.of_unit("1/s"))
        units.compare(f"the rate of {state.name}", units.expect(f"the rate of {state.name}", rate, None), per_second)
    if contact.where is not None:
        units.expect(f"the region of contact '{contact.name}'", contact.where, None)


def _check_stop(units: _Units, stop: Stop) -> None:
    depth = units.expect(f"the gap of stop '{stop.name}'", stop.gap, None)
    rate = None if depth is None else units.times(depth, units.of_unit("1/s"))
    units.known |= {stop.penetration: depth, stop.rate: rate, stop.memory: rate}
    force = units.expect(f"the law of stop '{stop.name}'", stop.compression, None)
    if force is not None and depth is not None:
        units.match(f"gap times force of stop '{stop.name}'", units.times(force, depth), "J")
    units.known[stop.force] = force


def _check_impact(units: _Units, contact: Impact) -> None:
    scaled = units.scaled
    units.expect(f"the gap of contact '{contact.name}'", contact.gap, "1" if scaled else "m")
    if contact.slip is not None:
        units.expect(f"the slip of contact '{contact.name}'", contact.slip, "1" if scaled else "m/s")
    units.expect(f"the restitution of contact '{contact.name}'", contact.e, "1")
    units.expect(f"mu of contact '{contact.name}'", contact.friction, "1")
    for force in contact.shown:
        units.known[force] = _NONE if scaled else units.of_unit("N")


class _Units:
    """Dimensions of the expressions of one model; None stands for one that is not checked."""

    def __init__(self, model: str, states: Sequence[Quantity]) -> None:
        self.model = model
        self.scaled = all(state.unit == "1" for state in states)
        self.known: dict[sympy.Basic, Dimension | None] = {}
        self.parts: dict[sympy.Basic, Dimension | None] = {}
        self.symbols = Derivatives().symbols

    def of_unit(self, unit: str) -> Dimension:
        try:
            return tuple((name, power) for name, power in _dimension(unit) if not (self.scaled and name == "second"))
        except Exception as error:
            raise StickslipError(
                f"{self.model}: '{unit}' is not a unit. Write units such as 'kg m2', 'N s/m', 'rad/s', '1'."
            ) from error

    @staticmethod
    def times(a: Dimension, b: Dimension, power: Any = 1) -> Dimension:
        """a times b to a power."""
        total = dict(a)
        for name, exponent in b:
            total[name] = total.get(name, sympy.S.Zero) + exponent * power
        return tuple(sorted((name, exponent) for name, exponent in total.items() if exponent != 0))

    def expect(self, what: str, expression: Any, unit: str | None) -> Dimension | None:
        """Dimension of an expression, which must be that of the unit if there is one."""
        try:
            found = self._dimension(sympy.sympify(expression))
        except _Mismatch as error:
            raise StickslipError(f"{self.model}: units do not match in {what}: {error}") from error
        if unit is not None and sympy.sympify(expression) != 0:
            self.match(what, found, unit)
        return found

    def match(self, what: str, found: Dimension | None, unit: str) -> None:
        """Refuse a dimension that is not that of the unit; a scaled model has energies and powers without unit."""
        mechanical = self.scaled and unit in ("J", "W")
        self.compare(what, found, _NONE if mechanical else self.of_unit(unit), unit)

    def compare(self, what: str, found: Dimension | None, expected: Dimension, unit: str = "") -> None:
        """Refuse two dimensions that differ."""
        if found is not None and found != expected:
            raise StickslipError(
                f"{self.model}: units do not match: {what} is in {_text(found)}, not in {unit or _text(expected)}"
                f"{f' = {_text(expected)}' if unit and unit != _text(expected) else ''}. Look at the units of its "
                "parameters."
            )

    def _dimension(self, e: Any) -> Dimension | None:
        if isinstance(e, Quantity):
            if e not in self.known:
                self.known[e] = _NONE if isinstance(e, ContactSymbol) else self.of_unit(e.unit)
            return self.known[e]
        if e not in self.parts:
            self.parts[e] = self._composed(e)
        return self.parts[e]

    def _composed(self, e: Any) -> Dimension | None:
        if not self.symbols(e) and e.has(sympy.Float):
            return None
        if e.is_Add:
            return self._sum(e)
        if e.is_Mul:
            return self._product(self._dimension(factor) for factor in e.args)
        if e.is_Pow:
            return self._power(e)
        if isinstance(e, sympy.Function):
            for argument in e.args:
                dimension = self._dimension(argument)
                if dimension:
                    raise _Mismatch(f"{e.func}({argument}) of a quantity in {_text(dimension)}; it must be a number")
        return _NONE

    def _sum(self, e: Any) -> Dimension | None:
        seen: dict[Dimension, sympy.Basic] = {}
        for term in e.args:
            dimension = self._dimension(term)
            if dimension is not None:
                seen.setdefault(dimension, term)
        if len(seen) > 1:
            (first, one), (second, other) = list(seen.items())[:2]
            raise _Mismatch(f"{one} is in {_text(first)}, {other} in {_text(second)}; they cannot be added")
        return next(iter(seen), None)

    def _product(self, dimensions: Iterable[Dimension | None]) -> Dimension | None:
        total: Dimension | None = _NONE
        for dimension in dimensions:
            total = None if total is None or dimension is None else self.times(total, dimension)
        return total

    def _power(self, e: Any) -> Dimension | None:
        base, exponent = self._dimension(e.base), self._dimension(e.exp)
        if exponent:
            raise _Mismatch(f"the exponent of {e} is in {_text(exponent)}; it must be a number")
        if not base:
            return base
        if not e.exp.is_Number:
            raise _Mismatch(f"{e.base} in {_text(base)} to a power that is not a number")
        return self.times(_NONE, base, sympy.nsimplify(e.exp))


@cache
def _dimension(unit: str) -> Dimension:
    powers = {name: sympy.nsimplify(power) for name, power in base_units(unit).powers if name != "radian"}
    return tuple(sorted(powers.items()))


def _text(dimension: Dimension) -> str:
    short = {"kilogram": "kg", "meter": "m", "second": "s"}
    return " ".join(f"{short.get(n, n)}{'' if p == 1 else f'^{p}'}" for n, p in dimension) or "1"
