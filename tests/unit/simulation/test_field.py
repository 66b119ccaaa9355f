"""Rates at a point and their derivatives, through both versions of the standard."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models import Fmu, StickslipError
from fmu_models.codegen.package import built
from fmu_models.simulation.field import VectorField


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize("side", [1, -1])
def test_rates_of_the_planar_system(version, side):
    """x1' = x2, x2' = -x2 - 3/2 |x2 - mu| - x1, on both sides of its kink."""
    field = VectorField(Fmu.open(built("planar_hopf", fmi_version=version)), {"mu": 0.3})
    x = np.array([0.7, 0.3 + 0.25 * side])
    seen = field.at(x)
    assert seen.rates == pytest.approx([x[1], -x[1] - 1.5 * 0.25 - x[0]], abs=1e-15)
    assert seen.contacts == (side,) and seen.indicators == pytest.approx([0.25], abs=1e-9)
    expected = [[0.0, 1.0, 0.0], [-1.0, -1.0 - 1.5 * side, 1.5 * side]]
    assert field.slopes(x, ["mu"]) == pytest.approx(np.array(expected), abs=1e-14)
    assert field.at(x, {"mu": 0.3 + 0.5 * side}).contacts == (-side,)


def test_a_point_that_is_none_is_told():
    with pytest.raises(StickslipError, match="not finite"):
        VectorField(Fmu.open(built("planar_hopf")), {}).at([np.nan, 0.0])
