"""Sets of equilibria of what sticks: their ends against the balance of forces there."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models import Coordinate, Coulomb, Fmu, Friction, Mechanism, Parameter, StickslipError, equilibria, load
from fmu_models.codegen.package import built_of
from fmu_models.lowering.lower import lower


def test_a_block_at_rest_on_a_belt_that_stands():
    """|k x| <= mu_s N; nothing holds it where N = 0."""
    found = equilibria(load("block_on_belt"), "N", (0.0, 20.0), start={"x": 0.01, "v": 0.0}, parameters={"v_belt": 0.0})
    assert found.intervals is not None
    end = 0.65 * found.values / 100.0
    assert found.intervals[:, :, 0] == pytest.approx(np.array([-end, end]).T, abs=1e-10)
    assert found.points[:, 0] == pytest.approx(np.zeros(len(end)), abs=1e-10)
    assert found.values[-1] == 20.0 and [kind for kind, _ in found.ends] == ["point", "range"]
    assert "shrinks to a point at N = 0" in found.ends[0][1] or float(found.ends[0][1].split("=")[-1]) < 1e-12
    assert found.stable.all() and (found.eigenvalues == np.array([0.0, -np.inf])).all()
    assert found.frame["x_to"].to_numpy() == pytest.approx(end, abs=1e-10)


def two_blocks():
    units = {"m": "kg", "d": "N s/m", "k": "N/m", "kc": "N/m", "k3": "N/m3"}
    m, d, k, kc, k3 = (Parameter(name, 1.0, unit, name) for name, unit in units.items())
    x, y = Coordinate("x", "m", "held", velocity="v"), Coordinate("y", "m", "free", velocity="w")
    held = Friction(
        name="ground", slip=x.v, law=Coulomb(Parameter("N", 2.0, "N", "load"), Parameter("mu", 0.5, "1", "mu"))
    )
    model = Mechanism(
        name="two_blocks", title="two", source="here", coordinates=[x, y], contacts=[held],
        kinetic_energy=m * (x.v**2 + y.v**2) / 2, dissipation=d * y.v**2 / 2,
        potential_energy=k * x**2 / 2 + kc * (x - y) ** 2 / 2 + k3 * y**4 / 4,
    )  # fmt: skip
    return Fmu.open(built_of(lower(model)))


def test_what_hangs_on_a_block_that_sticks_moves_along():
    """kc (x - y) = k3 y^3 all along, and k x + k3 y^3 = -+mu N at the ends; from a start that is at no equilibrium."""
    found = equilibria(two_blocks(), "k", (0.2, 5.0), start={"x": 0.3, "v": 0.0, "y": -0.2, "w": 0.0})
    assert found.intervals is not None and [kind for kind, _ in found.ends] == ["range", "range"]
    x, y = found.intervals[:, :, found.states.index("x")], found.intervals[:, :, found.states.index("y")]
    assert x - y == pytest.approx(y**3, abs=1e-12)
    pull = found.values[:, None] * x + y**3
    assert pull == pytest.approx(np.tile([-1.0, 1.0], (len(x), 1)), abs=1e-9)
    # y'' = -y' - (kc + 3 k3 y^2) y about the middle, y = 0
    assert found.eigenvalues[:, 1] == pytest.approx(np.full(len(x), -0.5 + 0.75**0.5 * 1j), abs=1e-9)
    assert found.stable.all()


def test_what_rides_along_is_at_rest_at_one_speed_alone():
    with pytest.raises(StickslipError, match=r"belt sticks, from x = -0.063765 to x = 0.063765, .* v_belt = 0 alone"):
        equilibria(load("block_on_belt"), "v_belt", (-1, 1), parameters={"v_belt": 0.0})
