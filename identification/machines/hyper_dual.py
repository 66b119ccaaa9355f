"""Hyper-dual numbers: values with two first derivatives and the mixed second one, exact to rounding.

    f(x + d1 e1 + d2 e2) = f + f' d1 e1 + f' d2 e2 + (f'' d1 d2 + f' d12) e1 e2,    e1^2 = e2^2 = 0

Source: Fike & Alonso (2011), AIAA 2011-886.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fmu_models.base.errors import StickslipError


class HyperDual:
    """A value with its parts along e1, e2 and e1 e2: arrays that broadcast against one another."""

    __slots__ = ("both", "first", "second", "value")
    __array_ufunc__ = None  # an array on the left leaves the operation to us

    def __init__(self, value: np.ndarray, first: np.ndarray, second: np.ndarray, both: np.ndarray) -> None:
        self.value, self.first, self.second, self.both = value, first, second, both

    def __add__(self, other: HyperDual | np.ndarray | float) -> HyperDual:
        if not isinstance(other, HyperDual):
            return HyperDual(self.value + other, self.first, self.second, self.both)
        return HyperDual(
            self.value + other.value, self.first + other.first, self.second + other.second, self.both + other.both
        )

    __radd__ = __add__

    def __neg__(self) -> HyperDual:
        return HyperDual(-self.value, -self.first, -self.second, -self.both)

    def __sub__(self, other: HyperDual | np.ndarray | float) -> HyperDual:
        return self + (-other)

    def __rsub__(self, other: np.ndarray | float) -> HyperDual:
        return -self + other

    def __mul__(self, other: HyperDual | np.ndarray | float) -> HyperDual:
        if not isinstance(other, HyperDual):
            return HyperDual(self.value * other, self.first * other, self.second * other, self.both * other)
        return HyperDual(
            self.value * other.value,
            self.first * other.value + self.value * other.first,
            self.second * other.value + self.value * other.second,
            self.both * other.value + self.first * other.second + self.second * other.first + self.value * other.both,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: HyperDual | np.ndarray | float) -> HyperDual:
        return self * (other**-1)

    def __rtruediv__(self, other: np.ndarray | float) -> HyperDual:
        return self**-1 * other

    def __pow__(self, power: float) -> HyperDual:
        if isinstance(power, HyperDual):
            raise StickslipError("A motion as an exponent has no place in an energy.")
        return self.mapped(*_power(self.value, power))

    def mapped(self, value: np.ndarray, slope: np.ndarray, bend: np.ndarray) -> HyperDual:
        """A function of the number, from the function's value and first two derivatives there."""
        return HyperDual(
            value, slope * self.first, slope * self.second, slope * self.both + bend * self.first * self.second
        )


# value, slope and bend of functions of a number
_BENT: dict[str, Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]] = {
    "sin": lambda x: (s := np.sin(x), np.cos(x), -s),
    "cos": lambda x: (c := np.cos(x), -np.sin(x), -c),
    "tan": lambda x: (t := np.tan(x), 1 + t**2, 2 * t * (1 + t**2)),
    "exp": lambda x: (e := np.exp(x), e, e),
    "log": lambda x: (np.log(x), 1 / x, -1 / x**2),
    "sqrt": lambda x: _power(x, 0.5),
    "tanh": lambda x: (t := np.tanh(x), 1 - t**2, -2 * t * (1 - t**2)),
    "atan": lambda x: (np.arctan(x), over := 1 / (1 + x**2), -2 * x * over**2),
}


def _power(x: np.ndarray, power: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return x**power, power * x ** (power - 1), power * (power - 1) * x ** (power - 2)


def _either(name: str) -> Callable[..., object]:
    """A function of numbers and of hyper-dual numbers."""
    plain, bent = getattr(np, {"atan": "arctan"}.get(name, name)), _BENT[name]
    return lambda x: x.mapped(*bent(x.value)) if isinstance(x, HyperDual) else plain(x)


FUNCTIONS = {name: _either(name) for name in _BENT}
