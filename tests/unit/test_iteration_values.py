"""The numbers of a map are those of its parameters: all, no others, in any order."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.analyses.iteration import Iteration
from fmu_models.base.errors import StickslipError
from fmu_models.maps.henon import MAP as MODEL


def test_a_parameter_that_is_missing_or_unknown_is_named() -> None:
    whole = dict(Iteration.of(MODEL).values)
    last = list(whole)[-1]
    with pytest.raises(StickslipError, match=f"no value for its parameter '{last}'; Iteration.of"):
        Iteration(MODEL, {name: value for name, value in whole.items() if name != last})
    with pytest.raises(StickslipError, match="has no parameter 'zz'"):
        Iteration(MODEL, {**whole, "zz": 1.0})


def test_their_order_is_of_no_account() -> None:
    system = Iteration.of(MODEL)
    turned = Iteration(MODEL, dict(reversed(system.values.items())))
    x = np.array([[0.3, 0.2]])
    assert len(system.values) > 1
    assert np.array_equal(turned.step(x).points, system.step(x).points)
