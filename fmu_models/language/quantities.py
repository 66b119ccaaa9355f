"""What a model is made of: quantities that carry their name, start value, unit and meaning.

A quantity is a SymPy symbol, so it is used in expressions as it stands; it is a ``Dummy``, so two quantities of one
name in two models never collide.
"""

from collections.abc import Mapping
from typing import Self, TypeVar

import sympy

_Quantity = TypeVar("_Quantity", bound="Quantity")


class Quantity(sympy.Dummy):
    """A real number with unit and meaning. Abstract: a model uses the classes below."""

    unit: str
    description: str

    @classmethod
    def _create(cls, name: str, unit: str, description: str, **assumptions: bool) -> Self:
        symbol = sympy.Dummy.__new__(cls, name, real=True, **assumptions)
        symbol.unit = unit
        symbol.description = description
        return symbol

    def _with(self, **attributes: object) -> Self:
        """The same quantity, equal to this one in expressions, with other attributes."""
        same = _again(type(self), self.name, self.dummy_index, self.assumptions0)
        same.__dict__.update(self.__dict__, **attributes)
        return same

    def __reduce__(self) -> tuple[object, ...]:
        return _again, (type(self), self.name, self.dummy_index, self.assumptions0), self.__dict__

    @property
    def declared(self) -> int:
        """Rank in the order of declaration."""
        return int(self.dummy_index)


def _again(kind: type[_Quantity], name: str, index: int, assumptions: Mapping[str, bool]) -> _Quantity:
    """A quantity that is equal to the one with this index."""
    return sympy.Dummy.__new__(kind, name, index, **assumptions)


class Parameter(Quantity):
    """A constant of the model.

    Args:
        name: as in the source of the model, for example "J".
        value: default, in ``unit``.
        unit: SI unit, for example "kg m2"; "1" for a pure number.
        description: what it is, in a few words.
        minimum: smallest value allowed.
        maximum: largest value allowed.
        positive: zero and negative values are refused.
    """

    value: float
    minimum: float | None
    maximum: float | None
    positive: bool

    def __new__(
        cls,
        name: str,
        value: float,
        unit: str,
        description: str,
        *,
        minimum: float | None = None,
        maximum: float | None = None,
        positive: bool = False,
    ) -> Self:
        if positive:
            symbol = cls._create(name, unit, description, positive=True)
        elif minimum == 0:
            symbol = cls._create(name, unit, description, nonnegative=True)
        else:
            symbol = cls._create(name, unit, description)
        symbol.value = float(value)
        symbol.minimum = 0.0 if positive and minimum is None else minimum
        symbol.maximum = maximum
        symbol.positive = positive
        return symbol

    def with_value(self, value: float) -> Self:
        """The same quantity (equal to this one in expressions) with another default."""
        return self._with(value=float(value))


class Rate(Quantity):
    """Time derivative of an input; every input has one."""

    value: float


class Input(Quantity):
    """A prescribed function of time, linear between its knots; ``rate`` is its slope.

    Args:
        name, unit, description: as for a Parameter.
        value: what it is as long as nobody sets it, in ``unit``.
    """

    value: float
    rate: Rate

    def __new__(cls, name: str, value: float, unit: str, description: str) -> Self:
        symbol = cls._create(name, unit, description)
        symbol.value = float(value)
        symbol.rate = Rate._create(f"{name}_rate", per_second(unit), f"rate of {name}: {description}")
        symbol.rate.value = 0.0
        return symbol

    def with_value(self, value: float) -> Self:
        """The same input (equal to this one in expressions) with another default."""
        return self._with(value=float(value))


class Acceleration(Quantity):
    """Rate of a velocity or of a state of an automaton, contact forces included; only outputs may use it."""


class State(Quantity):
    """A continuous state with a start value and the magnitude it usually has.

    Args:
        name, unit, description: as for a Parameter.
        start: start value, in ``unit``.
        nominal: magnitude that it usually has.
    """

    start: float
    nominal: float
    rate: Acceleration

    def __new__(cls, name: str, unit: str, description: str, *, start: float = 0.0, nominal: float = 1.0) -> Self:
        symbol = cls._state(name, unit, description, start, nominal)
        symbol.rate = Acceleration._create(f"{name}_rate", per_second(unit), f"rate of {name}: {description}")
        return symbol

    def with_start(self, start: float) -> Self:
        """The same state (equal to this one in expressions) with another start value."""
        return self._with(start=float(start))

    @classmethod
    def _state(cls, name: str, unit: str, description: str, start: float, nominal: float) -> Self:
        symbol = cls._create(name, unit, description)
        symbol.start = float(start)
        symbol.nominal = float(nominal)
        return symbol


class Velocity(State):
    """Rate of a coordinate."""


class InternalState(State):
    """State of a friction law, for example the mean deflection of bristles."""

    def __new__(cls, name: str, unit: str, description: str, *, start: float = 0.0, nominal: float = 1.0) -> Self:
        return cls._state(name, unit, description, start, nominal)


class Coordinate(State):
    """A generalised coordinate q with its velocity ``v`` and its acceleration ``a``.

    Args:
        name, unit, description: as for a Parameter.
        velocity: name of the velocity; ``<name>_v`` if left out.
        start, v_start: start values of coordinate and velocity, in ``unit`` and ``unit``/s.
        nominal, v_nominal: magnitudes that coordinate and velocity usually have.
    """

    v: Velocity
    a: Acceleration

    def __new__(
        cls,
        name: str,
        unit: str,
        description: str,
        *,
        velocity: str | None = None,
        start: float = 0.0,
        v_start: float = 0.0,
        nominal: float = 1.0,
        v_nominal: float = 1.0,
    ) -> Self:
        symbol = cls._state(name, unit, description, start, nominal)
        rate = per_second(unit)
        symbol.v = Velocity._state(velocity or f"{name}_v", rate, f"rate of {name}: {description}", v_start, v_nominal)
        symbol.a = Acceleration._create(f"{name}_a", per_second(rate), f"acceleration of {name}: {description}")
        return symbol


class Time(Quantity):
    """The time; its one instance is ``TIME``."""


TIME = Time._create("time", "s", "time")


def per_second(unit: str) -> str:
    """Unit of the rate of a quantity.

    >>> per_second("m"), per_second("rad/s"), per_second("1")
    ('m/s', 'rad/s2', '1/s')
    """
    if unit.endswith("/s"):
        return f"{unit}2"
    return f"{unit}/s"


class ContactSymbol(Quantity):
    """A quantity that the engine computes for a contact: its force, slip speed or sign of slip."""
