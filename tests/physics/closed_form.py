"""What tests against closed forms share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from scipy.optimize import brentq


def root(function: Callable[[float], Any], low: float, high: float) -> float:
    """The zero of a function between two numbers at which it has different signs, to rounding."""
    return cast(float, brentq(function, low, high, xtol=1e-15))
