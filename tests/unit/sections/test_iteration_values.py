"""The numbers of a map are those of its parameters: all, no others, in any order."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.maps.henon import MAP
from fmu_models.sections.iteration import Iteration


def test_a_parameter_that_is_missing_or_unknown_is_named() -> None:
    whole = dict(Iteration.of(MAP).values)
    last = list(whole)[-1]
    with pytest.raises(StickslipError, match=f"no value for its parameter '{last}'; Iteration.of"):
        Iteration(MAP, {name: value for name, value in whole.items() if name != last})
    with pytest.raises(StickslipError, match="has no parameter 'zz'"):
        Iteration(MAP, {**whole, "zz": 1.0})
    for refused in ("x", None, float("nan")):
        with pytest.raises(StickslipError, match=f"{last} = {refused} is not a finite number"):
            Iteration(MAP, {**whole, last: refused})  # pyright: ignore[reportArgumentType]
        with pytest.raises(StickslipError, match=f"{last} = {refused} is not a finite number"):
            Iteration.of(MAP).at(**{last: refused})  # pyright: ignore[reportArgumentType]


def test_their_order_is_of_no_account() -> None:
    system = Iteration.of(MAP)
    turned = Iteration(MAP, dict(reversed(list(system.values.items()))))
    x = np.array([[0.3, 0.2]])
    assert len(system.values) > 1
    assert np.array_equal(turned.step(x).points, system.step(x).points)
